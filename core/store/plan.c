/* SPDX-License-Identifier: MIT */
#include "order.h"
#include "text.h"
#include <quern/columns.h>
#include <stdlib.h>
#include <string.h>

const char *const quern_phase_names[] = { "setup", "begin", "substep", "deposit", "exchange", "advance",
	"end", "output" };

/* Whether a parameter of a plugin is not zero; NULL: whatever it is. */
static bool holds(const quern_instance *it, const char *when) {
	const quern_param *row = when ? quern_param_find(it->file->params, when) : NULL;
	return !when || (row && quern_param_number(row, it->self) != 0);
}

/* ---- sets ---- */

static bool slot_filled(const quern_section *section, const char *slot) {
	for (size_t k = 0; k < section->n_slots; k++)
		if (!strcmp(section->slots[k].slot->name, slot)) return section->slots[k].n > 0;
	return false;
}

/* Names of groups in frames and checkpoints: each is there once, and checkpoints have two of their own. */
static void check_name(const quern_plan *p, const quern_section *section, const char *name) {
	static const char *const own[] = { "plugins", "stepped", NULL };
	bool taken = false;
	for (size_t k = 0; own[k]; k++) taken = taken || !strcmp(own[k], name);
	for (size_t k = 0; k < p->store.n_sets; k++)
		taken = taken || !strcmp(p->store.sets[k].name, name) ||
				!strcmp(quern_set_plural(&p->store.sets[k]), name);
	if (taken)
		quern_report_add(p->scene->report, section->mark, "%s: there is another set that is called %s",
			section->name, name);
}

static void add_set(quern_plan *p, const char *name, const quern_set *table, bool grid) {
	quern_store *store = &p->store;
	store->sets = quern_grow(store->sets, store->n_sets, &store->sets_capacity, sizeof(quern_set_store));
	quern_set_store *set = &store->sets[store->n_sets++];
	*set = (quern_set_store) { .rows = table ? table->rows : 0, .grid = grid, .table = table };
	snprintf(set->name, sizeof set->name, "%s", name);
}

static void gather_sets(quern_plan *p) {
	add_set(p, "total", NULL, false);
	add_set(p, "cell", NULL, true);
	for (size_t i = 0; i < p->scene->n_sections; i++) {
		const quern_section *section = &p->scene->sections[i];
		for (const quern_set *set = section->ops->sets; set && set->name; set++) {
			if ((set->slot && !slot_filled(section, set->slot)) || !holds(section->solver, set->when))
				continue;
			check_name(p, section, set->name);
			if (set->plural && strcmp(set->plural, set->name) != 0) check_name(p, section, set->plural);
			add_set(p, set->name, set, set->rows != 0);
		}
	}
}

/* Declared here, but by a solver whose slot for it is empty: whoever names it does without. */
static bool set_left_out(const quern_plan *p, const char *field) {
	const size_t n = strcspn(field, ".");
	for (size_t i = 0; i < p->scene->n_sections; i++)
		for (const quern_set *set = p->scene->sections[i].ops->sets; set && set->name; set++)
			if (!strncmp(set->name, field, n) && !set->name[n]) return true;
	return false;
}

static int set_of(const quern_plan *p, const char *field) {
	char name[24];
	const size_t n = strcspn(field, ".");
	if (n >= sizeof name) return -1;
	memcpy(name, field, n);
	name[n] = 0;
	return quern_store_set(&p->store, name);
}

/* ---- uses ---- */

/* Where there are cases of their own, a row counts if it does in any of them. */
static bool holds_refined(const quern_filling *f, const char *when, bool again) {
	for (size_t i = 0; i < f->n_refined; i++)
		for (size_t v = again && f->n_variant; v <= (again ? f->n_variant : 0); v++)
			if (holds(f->refined[i * (1 + f->n_variant) + v], when)) return true;
	return false;
}

/* Where some entries override parameters, a repeated row counts if it does for any of them. */
static bool holds_anywhere(const quern_filling *f, const char *when) {
	bool any = (!f->n_variant && holds(f->instance, when)) || holds_refined(f, when, true);
	for (size_t v = 0; v < f->n_variant; v++)
		any = any || holds(f->variant[v] ? f->variant[v] : f->instance, when);
	return any;
}

static quern_plan_use *add_use(
	quern_plan *p, const quern_use *row, int stage, const char *owner, quern_mark mark) {
	p->uses = quern_grow(p->uses, p->n_uses, &p->uses_capacity, sizeof(quern_plan_use));
	quern_plan_use *u = &p->uses[p->n_uses++];
	*u = (quern_plan_use) { .row = row, .owner = owner, .mark = mark, .stage = stage, .target = -1 };
	snprintf(u->field, sizeof u->field, "%s", row->field);
	return u;
}

static int stage_named(const quern_plan *p, const char *name) {
	for (size_t i = 0; name && i < p->n_stages; i++)
		if (!strcmp(p->stages[i].name, name)) return (int)i;
	return -1;
}

static void add_stage(quern_plan *p, quern_plan_stage stage) {
	p->stages = quern_grow(p->stages, p->n_stages, &p->stages_capacity, sizeof(quern_plan_stage));
	stage.sequence = (int)p->n_stages;
	stage.order = -1;
	stage.first_use = p->n_uses;
	p->stages[p->n_stages++] = stage;
}

static void gather_stages(quern_plan *p) {
	for (size_t i = 0; i < p->scene->n_sections; i++) {
		const quern_section *section = &p->scene->sections[i];
		for (const quern_stage *s = section->ops->stages; s && s->name; s++) {
			if (!holds(section->solver, s->when)) continue;
			add_stage(p, (quern_plan_stage) { .name = s->name,
							 .doc = s->doc,
							 .stage = s,
							 .section = section,
							 .phase = (quern_phase)s->phase,
							 .solver = (int)i,
							 .sometimes = (s->flags & QUERN_SOMETIMES) != 0,
							 .settles = (s->flags & QUERN_SETTLES) != 0 });
			quern_plan_stage *stage = &p->stages[p->n_stages - 1];
			for (const quern_use *row = s->uses; row && row->field; row++, stage->n_uses++)
				add_use(p, row, (int)p->n_stages - 1, s->name, section->mark)->counts =
					holds(section->solver, row->when);
		}
	}
}

static void rename_set(quern_plan_use *u, const char *set, const char *other) {
	const size_t n = strlen(set);
	if (!strncmp(u->row->field, set, n) && u->row->field[n] == '.')
		snprintf(u->field, sizeof u->field, "%.23s.%.31s", other, u->row->field + n + 1);
}

/* `caller`: the solver in whose slot it sits; NULL: the host. */
static quern_plan_bound *add_bound(quern_plan *p, const quern_slot *slot, const quern_filling *f,
	const char *path, int stage, const quern_plugin_file *caller) {
	quern_plan_bound *b = quern_take(1, sizeof *b);
	const quern_instance *it = f->instance;
	b->uses = caller ? quern_table_uses_for(&it->file->table, caller->library) : NULL;
	b->bound = (quern_bound) { .self = it->self,
		.ops = f->ops,
		.item = f->item,
		.uses = b->uses ? b->uses : it->file->uses,
		.n_uses = (uint32_t)it->file->n_uses,
		.n_variant = (uint32_t)f->n_variant,
		.id = it->file->plugin.id,
		.path = path };
	b->variant = quern_take(f->n_variant, sizeof(void *));
	for (size_t v = 0; v < f->n_variant; v++) b->variant[v] = f->variant[v] ? f->variant[v]->self : it->self;
	b->bound.variant = f->n_variant ? b->variant : NULL;
	b->bound.refined = b->refined = quern_filling_refined(f);
	b->bound.n_refined = (uint32_t)f->n_refined;
	b->column = quern_take(it->file->n_uses, sizeof(quern_column));
	b->bound.column = b->column;
	b->first_use = p->n_uses;
	b->first_again = SIZE_MAX;
	for (size_t k = 0; k < it->file->n_uses; k++) {
		const quern_use *row = &it->file->uses[k];
		const char *called = slot && row->hook < 3 ? slot->stage[row->hook] : NULL;
		quern_plan_use *u =
			add_use(p, row, slot ? stage_named(p, called) : stage, it->file->plugin.id, it->mark);
		u->counts = u->stage >= 0 && (holds(it, row->when) || holds_refined(f, row->when, false));
		u->slot = slot, u->bound = (int)p->n_bounds;
		if (slot && slot->particle) rename_set(u, "particle", slot->particle);
	}
	if (slot && slot->repeat) {
		b->again = quern_take(it->file->n_uses, sizeof(quern_column));
		b->bound.again = b->again;
		b->first_again = p->n_uses;
		for (size_t k = 0; k < it->file->n_uses; k++) {
			const quern_use *row = &it->file->uses[k];
			const char *called = row->hook < 3 ? slot->stage[row->hook] : NULL;
			quern_plan_use *u = add_use(p, row, stage_named(p, called), it->file->plugin.id, it->mark);
			u->counts = u->stage >= 0 && holds_anywhere(f, row->when);
			u->slot = slot, u->bound = (int)p->n_bounds;
			rename_set(u, slot->repeat, slot->again);
		}
	}
	p->bounds = quern_grow(p->bounds, p->n_bounds, &p->bounds_capacity, sizeof(b));
	return p->bounds[p->n_bounds++] = b;
}

static void gather_slots(quern_plan *p) {
	for (size_t i = 0; i < p->scene->n_sections; i++) {
		const quern_section *section = &p->scene->sections[i];
		p->slots[i] = quern_take(section->n_slots, sizeof(*p->slots[i]));
		p->n_slot[i] = quern_take(section->n_slots, sizeof(uint32_t));
		for (size_t k = 0; k < section->n_slots; k++) {
			const quern_slot_use *use = &section->slots[k];
			const size_t stride = section->ops->bound_size;
			char *place = p->slots[i][k] = quern_take(use->n, stride);
			p->n_slot[i][k] = (uint32_t)use->n;
			for (size_t e = 0; e < use->n; e++) {
				const quern_plan_bound *b =
					add_bound(p, use->slot, &use->filling[e], use->path, -1, section->solver->file);
				memcpy(place + e * stride, &b->bound, stride < sizeof b->bound ? stride : sizeof b->bound);
			}
		}
	}
	const quern_slot_use *observe = &p->scene->observe;
	p->observers = quern_take(observe->n, sizeof(*p->observers));
	for (size_t e = 0; e < observe->n; e++) {
		add_stage(p, (quern_plan_stage) { .name = observe->filling[e].instance->file->plugin.id,
						 .observer = &observe->filling[e],
						 .phase = QUERN_OUTPUT,
						 .solver = 100 + (int)e });
		p->observers[e] = add_bound(p, NULL, &observe->filling[e], "observe", (int)p->n_stages - 1, NULL);
	}
}

/* ---- fields ---- */

static quern_field *add_field(quern_plan *p, const quern_plan_use *u) {
	quern_store *store = &p->store;
	store->fields = quern_grow(store->fields, store->n_fields, &store->fields_capacity, sizeof(quern_field));
	quern_field *field = &store->fields[store->n_fields++];
	*field = (quern_field) { .unit = u->row->unit,
		.doc = u->row->doc,
		.set = set_of(p, u->field),
		.target = -1,
		.shape = u->row->shape,
		.n_components = (uint8_t)quern_shape_size(u->row->shape, (uint32_t)p->scene->general.dimension),
		.initial = u->row->initial };
	snprintf(field->name, sizeof field->name, "%s", u->field);
	return field;
}

/* A field of a section that this scene goes without, as one does that keeps one model alone. */
static bool section_left_out(const quern_plan *p, const char *field) {
	const quern_catalogue *known = quern_loader_catalogue(p->scene->loader);
	const size_t length = strcspn(field, ".");
	bool usual = !strncmp(field, "cell.", 5); /* the host's own, where there is a grid */
	for (size_t i = 0; i < known->n_solvers; i++)
		for (size_t k = 0; k < known->solvers[i].n_sets; k++) {
			const char *set = known->solvers[i].sets[k];
			usual = usual || (!strncmp(set, field, length) && !set[length]);
		}
	return usual && (set_of(p, field) < 0 || !quern_scene_is_whole(p->scene));
}

/* A row that goes with another field counts only where that one exists. */
static bool in_force(const quern_plan *p, const quern_plan_use *u) {
	return u->counts && (!u->row->with || quern_store_field(&p->store, u->row->with) >= 0);
}

static void leave_out_sets(quern_plan *p) {
	for (size_t i = 0; i < p->n_uses; i++) {
		quern_plan_use *u = &p->uses[i];
		const bool here = set_of(p, u->field) >= 0;
		if (!here && quern_plan_demands(u) && !u->row->with && !set_left_out(p, u->field))
			quern_report_add(p->scene->report, u->mark,
				"%s needs %s, and nothing in the scene has a set of that name", u->owner, u->field);
		u->counts = u->counts && here;
	}
}

static bool add_quern_plan_demands(quern_plan *p, bool with_others) {
	bool any = false;
	for (size_t i = 0; i < p->n_uses; i++) {
		const quern_plan_use *u = &p->uses[i];
		if (!quern_plan_demands(u) || (u->row->with != NULL) != with_others || !in_force(p, u)) continue;
		if (quern_store_field(&p->store, u->field) < 0) any = add_field(p, u);
	}
	return any;
}

/* Somebody would like it and somebody else can make it. */
static bool add_wanted(quern_plan *p) {
	bool any = false;
	for (size_t i = 0; i < p->n_uses; i++) {
		const quern_plan_use *u = &p->uses[i];
		bool makable = false;
		if (!(u->row->flags & QUERN_WANTED) || !in_force(p, u) || quern_store_field(&p->store, u->field) >= 0)
			continue;
		for (size_t k = 0; k < p->n_uses && !makable; k++)
			makable = k != i && in_force(p, &p->uses[k]) && quern_use_changes(p->uses[k].row) &&
					  !strcmp(p->uses[k].field, u->field);
		if (makable) any = add_field(p, u);
	}
	return any;
}

/* The scene writes it out. */
static bool add_asked(quern_plan *p) {
	const quern_scene *s = p->scene;
	bool any = false;
	for (size_t k = 0; k < s->n_fields; k++)
		for (size_t i = 0; i < p->n_uses; i++) {
			const quern_plan_use *u = &p->uses[i];
			if (quern_store_field(&p->store, s->fields[k]) >= 0) break;
			if (in_force(p, u) && quern_use_changes(u->row) && !strcmp(u->field, s->fields[k]))
				any = add_field(p, u);
		}
	return any;
}

static void miss_asked(quern_plan *p, size_t k) {
	const quern_scene *s = p->scene;
	if (section_left_out(p, s->fields[k])) {
		if (quern_scene_is_whole(s))
			quern_report_warn(s->report, s->field_marks[k],
				"scene: output.fields: '%s' is left out: the section that makes it is not in this scene",
				s->fields[k]);
		return;
	}
	const char **known = quern_take(p->n_uses + 1, sizeof(char *));
	for (size_t i = 0; i < p->n_uses; i++) known[i] = p->uses[i].field;
	const char *near = quern_nearest(s->fields[k], known);
	if (near && !strcmp(near, s->fields[k])) near = NULL; /* somebody could make it, and nobody asks for it */
	quern_report_add(s->report, s->field_marks[k],
		"scene: output.fields: nothing in this scene makes '%s'%s%s%s", s->fields[k],
		near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
	free(known);
}

/* A field that is made may bring others along: rows that go with it. */
static void make_fields(quern_plan *p) {
	leave_out_sets(p);
	add_quern_plan_demands(p, false);
	while (add_quern_plan_demands(p, true) || add_wanted(p) || add_asked(p)) {}
	for (size_t i = 0; i < p->n_uses; i++) p->uses[i].counts = in_force(p, &p->uses[i]);
	for (size_t k = 0; k < p->scene->n_fields; k++)
		if (quern_store_field(&p->store, p->scene->fields[k]) < 0) miss_asked(p, k);
}

/* Who else takes a field, and how: "SOLVER: an index". The first one has made it. */
static const quern_plan_use *first_use_of(const quern_plan *p, const char *field) {
	for (size_t i = 0; i < p->n_uses; i++)
		if (quern_plan_demands(&p->uses[i]) && !strcmp(p->uses[i].field, field)) return &p->uses[i];
	return NULL;
}

static void state_rule(quern_plan *p, quern_field *field, const quern_plan_use *u) {
	static const char *const names[] = { "", "keeps", "sums", "means", "own" };
	if (u->row->rule && field->rule && u->row->rule != field->rule)
		quern_report_add(p->scene->report, u->mark,
			"%s: by the rule of %s it is '%s' where entries are parted or joined, by that of others '%s'",
			u->field, u->owner, names[u->row->rule], names[field->rule]);
	else if (u->row->rule) field->rule = u->row->rule;
}

/* Every use finds its field; doc, target, rule and initial value come from whoever states them. */
static void bind_uses(quern_plan *p) {
	const quern_scene *s = p->scene;
	for (size_t i = 0; i < p->n_uses; i++) {
		quern_plan_use *u = &p->uses[i];
		const int k = quern_store_field(&p->store, u->field);
		if (!u->counts || k < 0) continue;
		quern_field *field = &p->store.fields[k];
		u->target = k;
		if (!quern_units_equal(s->units, field->unit ? field->unit : "1", u->row->unit ? u->row->unit : "1"))
			quern_report_add(s->report, u->mark, "%s: %s takes it in %s, others in %s", u->field, u->owner,
				u->row->unit, field->unit);
		const quern_plan_use *first = field->shape != u->row->shape ? first_use_of(p, u->field) : NULL;
		if (field->shape != u->row->shape)
			quern_report_add(s->report, u->mark, "%s: %s takes it for %s, %s for %s", u->field, u->owner,
				quern_shape_name(u->row->shape), first ? first->owner : "others",
				quern_shape_name(field->shape));
		if (!field->doc) field->doc = u->row->doc;
		if (!(u->row->initial == 0)) field->initial = u->row->initial;
		field->shown = field->shown || u->row->flags & QUERN_SHOWN;
		state_rule(p, field, u);
		if (!u->row->target) continue;
		field->target = quern_store_set(&p->store, u->row->target);
		if (field->target < 0)
			quern_report_add(s->report, u->mark, "%s points into a set '%s' that does not exist", u->field,
				u->row->target);
	}
	for (size_t k = 0; k < s->n_fields; k++) {
		const int i = quern_store_field(&p->store, s->fields[k]);
		if (i >= 0) p->store.fields[i].shown = true;
	}
}

static void lay_field(quern_plan *p, int k, bool *laid) {
	quern_field *field = &p->store.fields[k];
	quern_set_store *set = &p->store.sets[field->set];
	if (!set->rows || laid[k]) return;
	laid[k] = true;
	field->lane = set->lanes;
	set->lanes += field->n_components;
	if (set->lanes > 8)
		quern_report_add(
			p->scene->report, (quern_mark) { 0 }, "%s: a node row holds at most 8 numbers", set->name);
}

static bool owns_set(const quern_section *section, const char *name) {
	for (const quern_set *set = section->ops->sets; set && set->name; set++)
		if (!strcmp(set->name, name)) return true;
	return false;
}

/* Lanes of a row in the order in which the stages of the set's owner first name its fields, whoever else has named them
 * before: the owner's kernels count on it. What others add comes after. */
static void lay_rows(quern_plan *p) {
	bool *laid = quern_take(p->store.n_fields, sizeof(bool));
	for (size_t i = 0; i < p->n_stages; i++) {
		const quern_plan_stage *stage = &p->stages[i];
		for (size_t k = stage->first_use; k < stage->first_use + stage->n_uses; k++) {
			const quern_plan_use *u = &p->uses[k];
			if (u->target < 0) continue;
			const char *set = p->store.sets[p->store.fields[u->target].set].name;
			if (stage->section && owns_set(stage->section, set)) lay_field(p, u->target, laid);
		}
	}
	for (size_t i = 0; i < p->store.n_fields; i++) lay_field(p, (int)i, laid);
	free(laid);
}

/* ---- columns ---- */

static bool swapped_in(const quern_plan_stage *stage, int field) {
	for (const int *k = stage->swaps; k && *k >= 0; k++)
		if (*k == field) return true;
	return false;
}

static quern_column column_of(const quern_plan *p, const quern_plan_use *u, const quern_plan_stage *stage) {
	if (u->target < 0 || u->row->flags & QUERN_EXISTS) return (quern_column) { .real = { NULL } };
	const quern_field *field = &p->store.fields[u->target];
	const bool other = stage && field->twice && quern_use_renews(u->row) && swapped_in(stage, u->target);
	return quern_field_column(&p->store, field, other ? !field->now : field->now);
}

void quern_plan_refresh(quern_plan *p) {
	if (p->fresh == p->store.version) return;
	p->fresh = p->store.version;
	for (size_t i = 0; i < p->n_stages; i++) {
		quern_plan_stage *stage = &p->stages[i];
		for (size_t k = 0; k < stage->n_uses; k++)
			stage->column[k] = column_of(p, &p->uses[stage->first_use + k], stage);
	}
	for (size_t i = 0; i < p->n_bounds; i++) {
		quern_plan_bound *b = p->bounds[i];
		for (size_t k = 0; k < b->bound.n_uses; k++) {
			b->column[k] = column_of(p, &p->uses[b->first_use + k], NULL);
			if (b->again) b->again[k] = column_of(p, &p->uses[b->first_again + k], NULL);
		}
	}
}

/* Adds the columns of some uses to `links`, or counts them where that is NULL. */
static size_t link_uses(const quern_plan *p, int field, size_t first, size_t n, quern_column *column,
	const quern_plan_stage *stage, quern_plan_link *links) {
	size_t found = 0;
	for (size_t k = 0; k < n && column; k++) {
		if (p->uses[first + k].target != field) continue;
		if (links) links[found] = (quern_plan_link) { column + k, first + k, stage };
		found++;
	}
	return found;
}

static size_t link_field(const quern_plan *p, int field, quern_plan_link *links) {
	size_t n = 0;
	for (size_t i = 0; i < p->n_stages && p->store.fields[field].twice; i++) {
		const quern_plan_stage *s = &p->stages[i];
		n += link_uses(p, field, s->first_use, s->n_uses, s->column, s, links ? links + n : NULL);
	}
	for (size_t i = 0; i < p->n_bounds && p->store.fields[field].twice; i++) {
		const quern_plan_bound *b = p->bounds[i];
		n += link_uses(p, field, b->first_use, b->bound.n_uses, b->column, NULL, links ? links + n : NULL);
		n += link_uses(p, field, b->first_again, b->bound.n_uses, b->again, NULL, links ? links + n : NULL);
	}
	return n;
}

static void link_columns(quern_plan *p) {
	p->first_link = quern_take(p->store.n_fields + 1, sizeof(size_t));
	for (size_t k = 0; k < p->store.n_fields; k++)
		p->first_link[k + 1] = p->first_link[k] + link_field(p, (int)k, NULL);
	p->links = quern_take(p->first_link[p->store.n_fields] + 1, sizeof(quern_plan_link));
	for (size_t k = 0; k < p->store.n_fields; k++) link_field(p, (int)k, p->links + p->first_link[k]);
}

void quern_plan_swap(quern_plan *p, const int *fields) {
	for (const int *k = fields; *k >= 0; k++) {
		p->store.fields[*k].now = !p->store.fields[*k].now;
		for (size_t i = p->first_link[*k]; i < p->first_link[*k + 1]; i++)
			*p->links[i].column = column_of(p, &p->uses[p->links[i].use], p->links[i].stage);
	}
}

/* ---- the whole ---- */

quern_plan *quern_plan_create(const quern_scene *scene, quern_pool *pool) {
	quern_plan *p = quern_take(1, sizeof *p);
	p->scene = scene;
	p->fresh = UINT64_MAX;
	quern_store_init(&p->store, pool);
	gather_sets(p);
	gather_stages(p);
	gather_slots(p);
	make_fields(p);
	bind_uses(p);
	lay_rows(p);
	quern_plan_order(p);
	for (size_t i = 0; i < p->n_stages; i++)
		p->stages[i].column = quern_take(p->stages[i].n_uses, sizeof(quern_column));
	link_columns(p);
	return p;
}

void quern_plan_destroy(quern_plan *p) {
	if (!p) return;
	for (size_t i = 0; i < p->n_bounds; i++) {
		free(p->bounds[i]->column);
		free(p->bounds[i]->again);
		free(p->bounds[i]->variant);
		free(p->bounds[i]->refined);
		free(p->bounds[i]->uses);
		free(p->bounds[i]);
	}
	for (size_t i = 0; i < p->scene->n_sections; i++) {
		for (size_t k = 0; p->slots[i] && k < p->scene->sections[i].n_slots; k++) free(p->slots[i][k]);
		free(p->slots[i]);
		free(p->n_slot[i]);
	}
	for (size_t i = 0; i < p->n_stages; i++) {
		free(p->stages[i].column);
		free(p->stages[i].swaps);
		free(p->stages[i].zeros);
		free(p->stages[i].zeros_settling);
	}
	free(p->bounds);
	free(p->observers);
	free(p->stages);
	free(p->uses);
	free(p->order);
	free(p->links);
	free(p->first_link);
	quern_store_finish(&p->store);
	free(p);
}

size_t quern_plan_entry_bytes(const quern_plan *p, int set) {
	size_t bytes = 0;
	for (size_t i = 0; i < p->store.n_fields; i++) {
		const quern_field *field = &p->store.fields[i];
		if (field->set == set && !field->local)
			bytes += field->n_components * quern_field_bytes(field) * (field->twice ? 2 : 1);
	}
	return bytes;
}
