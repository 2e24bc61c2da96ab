/* SPDX-License-Identifier: MIT */
/* table_ops - tables of functions: their length by their kind, and what solvers, observers and conformance tests hang on theirs */
#include "param.h"
#include "plugin_table_read.h"
#include <stdlib.h>
#include <string.h>

enum {
	MOST_SETS = 32,
	MOST_SLOTS = 32,
	MOST_STAGES = 64,
	MOST_STAGE_USES = 256,
	MOST_FUNCTIONS = 64,
	MOST_SECTIONS = 16,
	LARGEST_OPS = 4096,
	LARGEST_ENTRY = 1024
};

/* ---- a kind's functions ---- */

typedef void function(void);

static function *function_at(const void *ops, const quern_function *f) {
	function *at;
	memcpy(&at, (const char *)ops + f->offset, sizeof at);
	return at;
}

static bool has_functions(quern_text *why, const quern_plugin *p, const quern_kind *kind, const void *ops) {
	for (const quern_function *f = kind->functions; f->name; f++) {
		const uint32_t dims = f->dim == 2 ? QUERN_2D : QUERN_3D;
		if (!f->required || function_at(ops, f) || (f->dim && !(p->dims & dims))) continue;
		quern_text_add(why, "has a faulty table: ops lacks the function %s", f->name);
		if (f->dim) quern_text_add(why, " for %u-D, which dims promises", f->dim);
		return false;
	}
	return true;
}

void *quern_table_ops_for(const quern_table *t, const quern_kind *kind, quern_text *why) {
	uint32_t size;
	memcpy(&size, t->plugin.ops, sizeof size);
	if (size > kind->ops_size) {
		quern_text_add(why,
			"has %u bytes of functions, where whoever calls it knows %u of a %s: it is built with a newer "
			"header of its kind; rebuild both with one",
			size, kind->ops_size, kind->name);
		return NULL;
	}
	void *ops = quern_take(1, kind->ops_size);
	memcpy(ops, t->plugin.ops, size);
	if (has_functions(why, &t->plugin, kind, ops)) return ops;
	free(ops);
	return NULL;
}

/* ---- tables of entries that have a name first ---- */

/* How many entries there are, each of `stride` bytes; false if they go on beyond `most`. */
static bool count(
	quern_table_reader *r, const char *what, const void *table, uint32_t stride, size_t most, size_t *n) {
	if (stride < sizeof(char *) || stride > LARGEST_ENTRY || stride % 8)
		return quern_table_refuse(r,
			"%s of %u bytes each: set the sizes of ops by QUERN_SOLVER_SIZES, or output_size", what, stride);
	for (*n = 0; table; ++*n) {
		const char *name;
		memcpy(&name, (const char *)table + *n * stride, sizeof name);
		if (!name) break;
		if (*n >= most)
			return quern_table_refuse(r, "more than %zu %s, so the last one has a name", most, what);
	}
	return true;
}

/* A copy in the host's own layout: what the plugin does not know is zero. */
static void *copy(quern_table_reader *r, const void *table, uint32_t stride, size_t own, size_t n) {
	char *to = quern_table_keep(r, (n + 1) * own);
	for (size_t i = 0; i < n; i++)
		memcpy(to + i * own, (const char *)table + i * stride, stride < own ? stride : own);
	return to;
}

static bool is_short_name(const char *name) { return quern_table_text(name, 23) && quern_is_name(name); }

static bool is_label(const char *name) {
	return !name || (*name && quern_table_text(name, QUERN_LONGEST_NAME));
}

/* ---- numbers that come out ---- */

static bool outputs(quern_table_reader *r, const char *what, const quern_output **table, uint32_t stride,
	size_t most, size_t *n) {
	if (!count(r, what, *table, stride, most, n)) return false;
	quern_output *own = copy(r, *table, stride, sizeof *own, *n);
	for (size_t i = 0; i < *n; i++) {
		if (!quern_table_text(own[i].name, QUERN_LONGEST_NAME) || !quern_is_name(own[i].name) ||
			own[i].combine > QUERN_MIN)
			return quern_table_refuse(
				r, "output '%.60s' has a name that is no word, or another way to combine", own[i].name);
		if (!quern_table_text(own[i].unit, QUERN_LONGEST_NAME) || !quern_table_text(own[i].doc, 1 << 16))
			return quern_table_refuse(r, "unit or doc of output %s is no plain text", own[i].name);
	}
	*table = own;
	return true;
}

static bool observer(quern_table_reader *r, quern_observer_ops *ops) {
	size_t n;
	if ((ops->map != NULL) == (ops->whole != NULL) || (ops->map && !ops->set))
		return quern_table_refuse(r, "ops has map, with the set that it runs over, or whole, and not both");
	if (!outputs(r, "outputs", &ops->outputs, ops->output_size, QUERN_MOST_ROWS, &n)) return false;
	return n || quern_table_refuse(r, "an observer without outputs");
}

/* ---- kinds that a solver calls ---- */

static bool functions(quern_table_reader *r, quern_kind *kind) {
	size_t n = 0;
	if (!count(r, "functions of a kind", kind->functions, kind->function_size, MOST_FUNCTIONS, &n))
		return false;
	quern_function *own = copy(r, kind->functions, kind->function_size, sizeof *own, n);
	for (size_t i = 0; i < n; i++)
		if (!is_short_name(own[i].name) || own[i].offset < 8 || own[i].offset % 8 ||
			own[i].offset + sizeof(function *) > kind->ops_size || own[i].dim == 1 || own[i].dim > 3)
			return quern_table_refuse(r, "kind %s: function %zu is faulty; use QUERN_KIND", kind->name, i);
	kind->functions = own;
	return true;
}

/* `what` names its place: "slot contact". */
static bool kind(quern_table_reader *r, const char *what, const quern_kind **at) {
	uint32_t size = 0;
	if (*at) memcpy(&size, *at, sizeof size);
	if (size < offsetof(quern_kind, functions) + sizeof(void *) || size > LARGEST_ENTRY)
		return quern_table_refuse(r, "%s: there is no kind; use QUERN_KIND", what);
	quern_kind *own = quern_table_keep(r, sizeof *own);
	memcpy(own, *at, size < sizeof *own ? size : sizeof *own);
	if (!own->name || !is_short_name(own->name) || !quern_table_text(own->doc, 1 << 16) ||
		own->ops_size < 8 || own->ops_size > LARGEST_OPS || own->ops_size % 8)
		return quern_table_refuse(r, "%s: its kind has no name, or ops of %u bytes", what, own->ops_size);
	*at = own;
	return functions(r, own);
}

/* ---- conformance tests ---- */

static bool conformance(quern_table_reader *r, quern_check_ops *ops) {
	if (!kind(r, "ops", &ops->kind)) return false;
	const char *id = r->table->plugin.id, *name = ops->kind->name;
	if (!strcmp(name, quern_solver_kind.name) || !strcmp(name, quern_check_kind.name))
		return quern_table_refuse(r, "a %s has no conformance test of its kind", name);
	return !strcmp(id + strlen(quern_check_kind.name) + 1, name) ||
		   quern_table_refuse(r, "it checks the kind %s, so its id must be check.%s", name, name);
}

/* ---- solvers ---- */

static bool has_stage(const quern_solver_ops *ops, const char *name) {
	for (const quern_stage *s = ops->stages; s->name; s++)
		if (!strcmp(s->name, name)) return true;
	return false;
}

static bool has_slot(const quern_solver_ops *ops, const char *name) {
	for (const quern_slot *s = ops->slots; s->name; s++)
		if (!strcmp(s->name, name)) return true;
	return false;
}

/* A parameter that a set or a stage hangs on. */
static bool hangs(quern_table_reader *r, const char *what, const char *name, const char *when) {
	if (!when) return true;
	if (is_label(when) && quern_param_find(r->table->params, when)) return true;
	return quern_table_refuse(r, "%s %s hangs on the parameter '%.60s', and there is none", what, name, when);
}

static bool set(quern_table_reader *r, const quern_solver_ops *ops, const quern_set *s) {
	if (!is_short_name(s->name))
		return quern_table_refuse(r, "set '%.60s': a word of at most 23 letters is wanted", s->name);
	if (s->rows && s->rows != 8)
		return quern_table_refuse(r, "set %s: rows is %u, must be 0 or 8", s->name, s->rows);
	if (s->plural && !is_short_name(s->plural))
		return quern_table_refuse(r, "set %s: the plural '%.60s' is no word", s->name, s->plural);
	if (!(s->cost[0] >= 0 && s->cost[0] < 1 && s->cost[1] >= 0 && s->cost[1] < 1))
		return quern_table_refuse(r, "set %s: a step of one entry costs less than a second", s->name);
	if (!is_label(s->slot) || (s->slot && !has_slot(ops, s->slot)))
		return quern_table_refuse(r, "set %s hangs on the slot '%.60s', and there is none", s->name, s->slot);
	return hangs(r, "set", s->name, s->when);
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
		!is_label(s->again) || !is_label(s->particle) || !is_label(s->override) || !is_label(s->refine))
		return quern_table_refuse(r, "slot '%.60s': one of its texts is no plain text", s->name);
	char what[QUERN_LONGEST_NAME + 8];
	snprintf(what, sizeof what, "slot %s", s->name);
	if (!kind(r, what, &s->kind)) return false;
	if (!strcmp(s->kind->name, quern_solver_kind.name) || !strcmp(s->kind->name, quern_check_kind.name))
		return quern_table_refuse(r, "slot %s: a %s sits in no slot", s->name, s->kind->name);
	for (int h = 0; h < 3; h++)
		if (!is_label(s->stage[h]) || (s->stage[h] && !has_stage(ops, s->stage[h])))
			return quern_table_refuse(r, "slot %s: there is no stage '%.60s'", s->name, s->stage[h]);
	if (!in_a_list(r->table, s->name))
		return quern_table_refuse(r, "slot %s: there is no such list among the parameters", s->name);
	if (s->override && !strchr(s->override, '.'))
		return quern_table_refuse(
			r, "slot %s: it overrides '%s', which is no SECTION.SLOT", s->name, s->override);
	const quern_param *cases = s->refine ? quern_param_find(r->table->params, s->refine) : NULL;
	if (s->refine && (!cases || cases->type != QUERN_T_LIST || s->same_as))
		return quern_table_refuse(
			r, "slot %s: '%s' shall refine it, and is no list among the parameters", s->name, s->refine);
	if (!s->repeat != !s->again)
		return quern_table_refuse(r, "slot %s: repeat and again are a pair of sets", s->name);
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
	if (s->phase >= QUERN_PHASES || !s->run || !s->uses || s->flags > 2 * QUERN_SETTLES - 1)
		return quern_table_refuse(r,
			"stage %s: phase %u or flags %u are unknown, or there is no run or no uses", s->name, s->phase,
			s->flags);
	if (s->flags & QUERN_SETTLES && s->phase != QUERN_SUBSTEP)
		return quern_table_refuse(r, "stage %s: only what runs in QUERN_SUBSTEP settles", s->name);
	if (!quern_table_uses(r, s->name, s->uses, MOST_STAGE_USES, r->table->params, &uses, &n)) return false;
	s->uses = uses;
	return hangs(r, "stage", s->name, s->when);
}

static bool sections(quern_table_reader *r, const char *what, const char *const *list) {
	for (size_t n = 0; list && list[n]; n++)
		if (n >= MOST_SECTIONS || !is_short_name(list[n]))
			return quern_table_refuse(
				r, "%s: '%.60s' is no section, or there is no NULL at the end", what, list[n]);
	return true;
}

/* Names of sets, of fields, of parameters. */
static bool labels(quern_table_reader *r, const char *what, const char *const *list) {
	for (size_t n = 0; list && list[n]; n++)
		if (n >= QUERN_MOST_ROWS || !is_label(list[n]))
			return quern_table_refuse(
				r, "%s: '%.60s' is no plain text, or there is no NULL at the end", what, list[n]);
	return true;
}

/* Sets of its own that a file can fill. */
static bool takes_own(quern_table_reader *r, const quern_solver_ops *ops) {
	for (size_t i = 0; ops->takes[i]; i++) {
		const quern_set *set = ops->sets;
		while (set->name && strcmp(set->name, ops->takes[i]) != 0) set++;
		if (!set->name || set->rows || (!i && (set->slot || set->when)))
			return quern_table_refuse(r, "takes: '%.60s' is no set of this solver that %s", ops->takes[i],
				i ? "holds entries" : "holds entries in every scene");
	}
	return true;
}

static bool starts(quern_table_reader *r, const quern_solver_ops *ops) {
	if (!ops->from) return true;
	const quern_param *row = is_label(ops->from) ? quern_param_find(r->table->params, ops->from) : NULL;
	if (!row || row->type != QUERN_T_TEXT || !(row->flags & QUERN_FILE))
		return quern_table_refuse(r, "from: '%.60s' is no parameter that names a file", ops->from);
	if (!ops->takes || !ops->takes[0] || !ops->essential || !ops->essential[0])
		return quern_table_refuse(r, "from is there, and takes or essential are not");
	return labels(r, "takes", ops->takes) && takes_own(r, ops) && labels(r, "essential", ops->essential) &&
		   labels(r, "same", ops->same) && sections(r, "unlike", ops->unlike);
}

static bool solver(quern_table_reader *r, quern_solver_ops *ops) {
	size_t n_sets, n_slots, n_stages, n_sums = 0, n_looks = 0;
	if (ops->section && !is_short_name(ops->section))
		return quern_table_refuse(r, "the section '%.60s' is no word", ops->section);
	if (ops->bound_size < offsetof(quern_bound, path) + sizeof(char *) || ops->bound_size > LARGEST_ENTRY ||
		ops->bound_size % 8)
		return quern_table_refuse(
			r, "bound_size is %u: set the sizes of ops by QUERN_SOLVER_SIZES", ops->bound_size);
	if (!sections(r, "needs", ops->needs) || !sections(r, "with", ops->with) ||
		!sections(r, "after", ops->after))
		return false;
	if (!count(r, "sets", ops->sets, ops->set_size, MOST_SETS, &n_sets) ||
		!count(r, "slots", ops->slots, ops->slot_size, MOST_SLOTS, &n_slots) ||
		!count(r, "stages", ops->stages, ops->stage_size, MOST_STAGES, &n_stages) ||
		!outputs(r, "sums", &ops->sums, ops->output_size, QUERN_MOST_SUMS, &n_sums) ||
		!outputs(r, "looks", &ops->looks, ops->output_size, QUERN_MOST_SUMS, &n_looks))
		return false;
	if (!n_stages) return quern_table_refuse(r, "a solver without stages");
	if (!n_sums != !ops->account) return quern_table_refuse(r, "sums and account go together");
	if (!n_looks != !ops->look) return quern_table_refuse(r, "looks and look go together");
	quern_set *own_sets = copy(r, ops->sets, ops->set_size, sizeof *own_sets, n_sets);
	quern_slot *own_slots = copy(r, ops->slots, ops->slot_size, sizeof *own_slots, n_slots);
	quern_stage *own_stages = copy(r, ops->stages, ops->stage_size, sizeof *own_stages, n_stages);
	ops->sets = own_sets, ops->slots = own_slots, ops->stages = own_stages;
	if (own_stages[0].when)
		return quern_table_refuse(r, "stage %.60s: the first one hangs on no parameter", own_stages[0].name);
	bool settles = !ops->settled;
	for (size_t i = 0; i < n_stages; i++) {
		if (!stage(r, &own_stages[i])) return false;
		settles = settles || own_stages[i].flags & QUERN_SETTLES;
	}
	if (!settles) return quern_table_refuse(r, "settled is there, and no stage has QUERN_SETTLES");
	for (size_t i = 0; i < n_sets; i++)
		if (!set(r, ops, &own_sets[i])) return false;
	for (size_t i = 0; i < n_slots; i++)
		if (!slot(r, ops, &own_slots[i])) return false;
	return starts(r, ops);
}

/* ---- of any plugin ---- */

bool quern_table_ops(quern_table_reader *r, const void *from) {
	static const quern_kind *const own[] = { &quern_solver_kind, &quern_observer_kind, &quern_check_kind };
	uint32_t size;
	memcpy(&size, from, sizeof size);
	if (size < 8 || size > LARGEST_OPS || size % 8)
		return quern_table_refuse(r, "ops has the size %u: set .size = sizeof ops", size);
	for (size_t k = 0; k < sizeof own / sizeof *own; k++) {
		if (strcmp(r->table->kind, own[k]->name) != 0) continue;
		void *ops = quern_table_ops_for(r->table, own[k], r->why);
		if (!ops) return false;
		void *kept = quern_table_keep(r, own[k]->ops_size);
		memcpy(kept, ops, own[k]->ops_size);
		free(ops);
		r->table->plugin.ops = kept;
		return k == 0 ? solver(r, kept) : k == 1 ? observer(r, kept) : conformance(r, kept);
	}
	return true;
}
