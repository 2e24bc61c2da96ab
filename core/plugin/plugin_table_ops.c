/* SPDX-License-Identifier: MIT */
/* table_ops - the functions of every kind, and the tables that solvers and observers hang on theirs */
#include "loader.h"
#include "param.h"
#include "plugin_table_read.h"
#include <stdlib.h>
#include <string.h>

enum { MOST_SETS = 32, MOST_SLOTS = 32, MOST_STAGES = 64, MOST_STAGE_USES = 256, LARGEST_OPS = 4096 };

#define EACH(kind, type, member)                                                                             \
	{ #member, kind, (uint32_t)offsetof(type, member[0]), 2, true }, {                                       \
#member, kind, (uint32_t)offsetof(type, member[1]), 3, true                                          \
	}
#define EITHER(kind, type, member)                                                                           \
	{ #member, kind, (uint32_t)offsetof(type, member[0]), 2, false }, {                                      \
#member, kind, (uint32_t)offsetof(type, member[1]), 3, false                                         \
	}
#define ONE(kind, type, member)                                                                              \
	{ #member, kind, (uint32_t)offsetof(type, member), 0, true }
#define MAYBE(kind, type, member)                                                                            \
	{ #member, kind, (uint32_t)offsetof(type, member), 0, false }

const quern_function quern_functions[] = { EACH(QUERN_CONTACT, quern_contact_ops, force),
	MAYBE(QUERN_CONTACT, quern_contact_ops, period), MAYBE(QUERN_CONTACT, quern_contact_ops, stiffness),
	MAYBE(QUERN_CONTACT, quern_contact_ops, reach), MAYBE(QUERN_CONTACT, quern_contact_ops, damping),
	ONE(QUERN_NEIGHBOURS, quern_neighbour_ops, keys), MAYBE(QUERN_NEIGHBOURS, quern_neighbour_ops, index),
	ONE(QUERN_NEIGHBOURS, quern_neighbour_ops, pairs), EACH(QUERN_INTEGRATOR, quern_integrator_ops, close),
	EITHER(QUERN_INTEGRATOR, quern_integrator_ops, open), ONE(QUERN_BODY, quern_body_ops, closest),
	MAYBE(QUERN_BODY, quern_body_ops, features), ONE(QUERN_BODY, quern_body_ops, bounds),
	EACH(QUERN_MATERIAL, quern_material_ops, update), EACH(QUERN_MATERIAL, quern_material_ops, assign),
	ONE(QUERN_MATERIAL, quern_material_ops, moduli), ONE(QUERN_SHAPE, quern_shape_ops, weights),
	ONE(QUERN_SHAPE, quern_shape_ops, shares), ONE(QUERN_SHAPE, quern_shape_ops, stiffness),
	EACH(QUERN_TRANSFER, quern_transfer_ops, gather), ONE(QUERN_COUPLING, quern_coupling_ops, couple),
	ONE(QUERN_ORACLE, quern_oracle_ops, mark), ONE(QUERN_ORACLE, quern_oracle_ops, decide),
	MAYBE(QUERN_ORACLE, quern_oracle_ops, surface), EACH(QUERN_PACKER, quern_packer_ops, pack),
	MAYBE(QUERN_OBSERVER, quern_observer_ops, map), MAYBE(QUERN_OBSERVER, quern_observer_ops, whole),
	MAYBE(QUERN_SOLVER, quern_solver_ops, ready), MAYBE(QUERN_SOLVER, quern_solver_ops, limit),
	MAYBE(QUERN_SOLVER, quern_solver_ops, substeps), MAYBE(QUERN_SOLVER, quern_solver_ops, settled),
	MAYBE(QUERN_SOLVER, quern_solver_ops, account), MAYBE(QUERN_SOLVER, quern_solver_ops, settling),
	{ .name = NULL } };

/* The host's own sizes. */
static const size_t sizes[QUERN_KINDS] = { [QUERN_SOLVER] = sizeof(quern_solver_ops),
	[QUERN_CONTACT] = sizeof(quern_contact_ops),
	[QUERN_NEIGHBOURS] = sizeof(quern_neighbour_ops),
	[QUERN_INTEGRATOR] = sizeof(quern_integrator_ops),
	[QUERN_BODY] = sizeof(quern_body_ops),
	[QUERN_MATERIAL] = sizeof(quern_material_ops),
	[QUERN_SHAPE] = sizeof(quern_shape_ops),
	[QUERN_TRANSFER] = sizeof(quern_transfer_ops),
	[QUERN_COUPLING] = sizeof(quern_coupling_ops),
	[QUERN_ORACLE] = sizeof(quern_oracle_ops),
	[QUERN_PACKER] = sizeof(quern_packer_ops),
	[QUERN_OBSERVER] = sizeof(quern_observer_ops) };

void (*quern_function_of(const quern_plugin *p, const quern_function *f))(void) {
	void (*function)(void);
	memcpy(&function, (const char *)p->ops + f->at, sizeof function);
	return function;
}

static bool functions(quern_table_reader *r) {
	const quern_plugin *p = &r->table->plugin;
	for (const quern_function *f = quern_functions; f->name; f++) {
		if (f->kind != p->kind || !f->required || quern_function_of(p, f)) continue;
		if (!f->dim) return quern_table_refuse(r, "ops lacks the function %s", f->name);
		if (p->dims & (f->dim == 2 ? QUERN_2D : QUERN_3D))
			return quern_table_refuse(
				r, "ops lacks the function %s for %u-D, which dims promises", f->name, f->dim);
	}
	return true;
}

/* ---- observers ---- */

static bool observer(quern_table_reader *r, const quern_observer_ops *ops) {
	size_t n = 0;
	if ((ops->map != NULL) == (ops->whole != NULL) || (ops->map && !ops->set))
		return quern_table_refuse(r, "ops has map, with the set that it runs over, or whole, and not both");
	for (const quern_output *o = ops->outputs; o && o->name; o++) {
		if (n++ >= QUERN_MOST_ROWS)
			return quern_table_refuse(r, "more than %d outputs, so the last one has a name", QUERN_MOST_ROWS);
		if (!quern_table_text(o->name, QUERN_LONGEST_NAME) || !quern_is_name(o->name) ||
			o->combine > QUERN_MIN)
			return quern_table_refuse(
				r, "output '%.60s' has a name that is no word, or another way to combine", o->name);
		if (!quern_table_text(o->unit, QUERN_LONGEST_NAME) || !quern_table_text(o->doc, 1 << 16))
			return quern_table_refuse(r, "unit or doc of output %s is no plain text", o->name);
	}
	return n || quern_table_refuse(r, "an observer without outputs");
}

/* ---- solvers ---- */

/* How many entries a table of named things has; false if it goes on beyond `most`. Its entries have no stride: they are
 * what this header says they are. */
static bool count(
	quern_table_reader *r, const char *what, const void *table, size_t size, size_t most, size_t *n) {
	for (*n = 0; table; ++*n) {
		const char *name;
		memcpy(&name, (const char *)table + *n * size, sizeof name);
		if (!name) break;
		if (*n >= most)
			return quern_table_refuse(r, "more than %zu %s, so the last one has a name", most, what);
	}
	return true;
}

static bool is_short_name(const char *name) { return quern_table_text(name, 23) && quern_is_name(name); }

static bool is_label(const char *name) {
	return !name || (*name && quern_table_text(name, QUERN_LONGEST_NAME));
}

static bool has_stage(const quern_solver_ops *ops, const char *name) {
	for (const quern_stage *s = ops->stages; s && s->name; s++)
		if (!strcmp(s->name, name)) return true;
	return false;
}

static bool has_slot(const quern_solver_ops *ops, const char *name) {
	for (const quern_slot *s = ops->slots; s && s->name; s++)
		if (!strcmp(s->name, name)) return true;
	return false;
}

static bool sets(quern_table_reader *r, const quern_solver_ops *ops) {
	size_t n;
	if (!count(r, "sets", ops->sets, sizeof(quern_set), MOST_SETS, &n)) return false;
	for (const quern_set *s = ops->sets; s && s->name; s++) {
		if (!is_short_name(s->name))
			return quern_table_refuse(r, "set '%.60s': a word of at most 23 letters is wanted", s->name);
		if (s->rows && s->rows != 8)
			return quern_table_refuse(r, "set %s: rows is %u, must be 0 or 8", s->name, s->rows);
		if (!is_label(s->slot) || (s->slot && !has_slot(ops, s->slot)))
			return quern_table_refuse(
				r, "set %s hangs on the slot '%.60s', and there is none", s->name, s->slot);
	}
	return true;
}

/* "fill.packer" sits in the items of the list "fill". */
static bool in_a_list(const quern_table *t, const char *slot) {
	char list[QUERN_LONGEST_NAME + 1];
	const size_t n = strcspn(slot, ".");
	snprintf(list, sizeof list, "%.*s", (int)n, slot);
	const quern_param *row = quern_param_find(t->params, list);
	return !slot[n] || (row && row->type == QUERN_T_LIST);
}

static bool slot(quern_table_reader *r, const quern_solver_ops *ops, quern_slot *s) {
	size_t n;
	quern_param *rows;
	if (!quern_table_text(s->name, QUERN_LONGEST_NAME) || !quern_table_text(s->doc, 1 << 16) ||
		!quern_table_text(s->def, 1 << 16) || !is_label(s->same_as) || !is_label(s->repeat) ||
		!is_label(s->particle) || !is_label(s->override))
		return quern_table_refuse(r, "slot '%.60s': one of its texts is no plain text", s->name);
	if (!quern_kind_name(s->kind) || s->kind == QUERN_SOLVER)
		return quern_table_refuse(r, "slot %s: kind %u is unknown", s->name, s->kind);
	for (int h = 0; h < 3; h++)
		if (!is_label(s->stage[h]) || (s->stage[h] && !has_stage(ops, s->stage[h])))
			return quern_table_refuse(r, "slot %s: there is no stage '%.60s'", s->name, s->stage[h]);
	if (!in_a_list(r->table, s->name))
		return quern_table_refuse(r, "slot %s: there is no such list among the parameters", s->name);
	if (s->override && !strchr(s->override, '.'))
		return quern_table_refuse(
			r, "slot %s: it overrides '%s', which is no SECTION.SLOT", s->name, s->override);
	if (!s->rows != !s->item_size || s->item_size > QUERN_LARGEST_INSTANCE)
		return quern_table_refuse(
			r, "slot %s: rows and item_size go together, and it is %u", s->name, s->item_size);
	if (!s->rows) return true;
	if (!quern_table_params(r, s->name, s->rows, s->item_size, 1, &rows, &n)) return false;
	s->rows = rows;
	return true;
}

static bool stage(quern_table_reader *r, quern_stage *s) {
	size_t n;
	quern_use *uses;
	if (!is_label(s->name) || !quern_table_text(s->doc, 1 << 16))
		return quern_table_refuse(r, "stage '%.60s': its name or doc is no plain text", s->name);
	if (s->phase >= QUERN_PHASES || !s->run || !s->uses)
		return quern_table_refuse(
			r, "stage %s: phase %u is unknown, or there is no run or no uses", s->name, s->phase);
	if (!quern_table_uses(r, s->name, s->uses, MOST_STAGE_USES, r->table->params, &uses, &n)) return false;
	s->uses = uses;
	return true;
}

/* Slots and stages are copied for the sake of the rows that hang on them. */
static bool solver(quern_table_reader *r, quern_solver_ops *ops) {
	size_t n_slots, n_stages;
	if (!count(r, "slots", ops->slots, sizeof(quern_slot), MOST_SLOTS, &n_slots) ||
		!count(r, "stages", ops->stages, sizeof(quern_stage), MOST_STAGES, &n_stages) || !sets(r, ops))
		return false;
	if (!n_stages) return quern_table_refuse(r, "a solver without stages");
	quern_slot *slots = quern_table_keep(r, (n_slots + 1) * sizeof *slots);
	quern_stage *stages = quern_table_keep(r, (n_stages + 1) * sizeof *stages);
	if (n_slots) memcpy(slots, ops->slots, n_slots * sizeof *slots);
	memcpy(stages, ops->stages, n_stages * sizeof *stages);
	for (size_t i = 0; i < n_stages; i++)
		if (!stage(r, &stages[i])) return false;
	for (size_t i = 0; i < n_slots; i++)
		if (!slot(r, ops, &slots[i])) return false;
	ops->slots = slots;
	ops->stages = stages;
	return true;
}

bool quern_table_ops(quern_table_reader *r, const void *from) {
	quern_plugin *p = &r->table->plugin;
	const size_t own = sizes[p->kind];
	uint32_t size;
	memcpy(&size, from, sizeof size);
	if (size < 8 || size > LARGEST_OPS || size % 8)
		return quern_table_refuse(r, "ops has the size %u: set .size = sizeof ops", size);
	void *ops = quern_table_keep(r, own);
	memcpy(ops, from, size < own ? size : own);
	p->ops = ops;
	if (p->kind == QUERN_SOLVER) return solver(r, ops) && functions(r);
	if (p->kind == QUERN_OBSERVER) return observer(r, ops) && functions(r);
	return functions(r);
}
