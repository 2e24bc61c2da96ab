/* SPDX-License-Identifier: MIT */
#include "run_episodes.h"
#include "episodes.h"
#include "wishes.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- plans ---- */

/* A field that is there in one alone, or in another form or place; NULL: there is none. */
static const char *other_field(const quern_store *a, const quern_store *b) {
	for (size_t k = 0; k < a->n_fields; k++)
		if (quern_store_field(b, a->fields[k].name) < 0) return a->fields[k].name;
	for (size_t k = 0; k < b->n_fields; k++)
		if (quern_store_field(a, b->fields[k].name) < 0) return b->fields[k].name;
	for (size_t k = 0; k < a->n_fields; k++) {
		const quern_field *f = &a->fields[k], *g = &b->fields[k];
		if (strcmp(f->name, g->name) != 0 || f->shape != g->shape || f->twice != g->twice ||
			f->kept != g->kept || f->local != g->local || f->lane != g->lane)
			return f->name;
	}
	return NULL;
}

static bool has_stage(const quern_plan *p, const char *name) {
	for (size_t k = 0; k < p->n_stages; k++)
		if (!strcmp(p->stages[k].name, name)) return true;
	return false;
}

/* A stage of a solver that runs in one alone; NULL: there is none. */
static const char *other_stage(const quern_plan *a, const quern_plan *b) {
	for (size_t k = 0; k < a->n_stages; k++)
		if (!has_stage(b, a->stages[k].name)) return a->stages[k].name;
	for (size_t k = 0; k < b->n_stages; k++)
		if (!has_stage(a, b->stages[k].name)) return b->stages[k].name;
	return NULL;
}

/* An observer whose outputs come more often in one, so that there would be other columns; NULL: there is none. */
static const char *other_columns(const quern_plan *a, const quern_plan *b) {
	for (size_t e = 0; e < a->scene->observe.n; e++)
		if (quern_wish_repeats(&a->observers[e]->bound) != quern_wish_repeats(&b->observers[e]->bound))
			return a->observers[e]->bound.id;
	return NULL;
}

static const char *name_of(const quern_filling *f) {
	const quern_node *name = f->instance->map ? quern_node_find(f->instance->map, "name") : NULL;
	return name && name->kind == QUERN_NODE_SCALAR ? name->text : "";
}

/* The same plugins in the same places, called alike: sets have entries for them, and others know them by number. */
static bool same_filling(const quern_slot_use *a, const quern_slot_use *b) {
	for (size_t i = 0; i < a->n && i < b->n; i++)
		if (strcmp(a->filling[i].instance->file->plugin.id, b->filling[i].instance->file->plugin.id) != 0 ||
			strcmp(name_of(&a->filling[i]), name_of(&b->filling[i])) != 0)
			return false;
	return a->n == b->n;
}

/* A slot that is filled otherwise, or a solver; NULL: there is none. */
static const char *other_plugins(const quern_scene *a, const quern_scene *b) {
	for (size_t i = 0; i < a->n_sections && i < b->n_sections; i++) {
		const quern_section *one = &a->sections[i], *two = &b->sections[i];
		if (strcmp(one->name, two->name) != 0 ||
			strcmp(one->solver->file->plugin.id, two->solver->file->plugin.id) != 0)
			return one->name;
		for (size_t k = 0; k < one->n_slots; k++)
			if (!same_filling(&one->slots[k], &two->slots[k])) return one->slots[k].path;
	}
	return a->n_sections == b->n_sections ? NULL : "one of the sections";
}

static bool same_value(const quern_param *row, const void *a, const void *b, uint32_t dim) {
	const quern_param alone[] = { *row, { .name = NULL } };
	const void *self[2] = { a, b };
	quern_text text[2] = { { 0 }, { 0 } };
	for (int k = 0; k < 2; k++) {
		quern_node *map = quern_node_create(QUERN_NODE_MAP);
		quern_params_write(alone, self[k], dim, NULL, map);
		quern_node_print(map, 0, &text[k]);
		quern_node_destroy(map);
	}
	const bool same = !strcmp(quern_text_string(&text[0]), quern_text_string(&text[1]));
	for (int k = 0; k < 2; k++) quern_text_finish(&text[k]);
	return same;
}

/* A parameter that counts before the first step alone, as all of them may, and has another value; NULL: there is
 * none. */
static const char *other_value(const quern_instance *a, const quern_instance *b, uint32_t dim, bool all) {
	for (const quern_param *row = a->file->params; row && row->name; row++)
		if ((all || row->flags & QUERN_ONCE) && !same_value(row, a->self, b->self, dim)) return row->name;
	return NULL;
}

/* A slot in the items of a list that counts once. */
static bool is_once(const quern_section *section, const quern_slot *slot) {
	for (const quern_param *row = section->solver->file->params; row && row->name; row++)
		if (strchr(slot->name, '.') && row->flags & QUERN_ONCE && quern_same_head(row->name, slot->name))
			return true;
	return false;
}

/* The same of solvers and of plugins in slots, of which there are as many in both; what overrides a plugin makes
 * instances that one scene alone may have, so that their running numbers tell nothing. */
static const char *other_start(const quern_scene *a, const quern_scene *b, const char **of) {
	const uint32_t dim = (uint32_t)a->general.dimension;
	for (size_t i = 0; i < a->n_sections; i++) {
		const quern_section *one = &a->sections[i], *two = &b->sections[i];
		const char *name = other_value(one->solver, two->solver, dim, false);
		*of = one->name;
		for (size_t k = 0; k < one->n_slots && !name; k++) {
			const quern_slot_use *use = &one->slots[k];
			*of = use->path;
			for (size_t j = 0; j < use->n && !name; j++)
				name = other_value(use->filling[j].instance, two->slots[k].filling[j].instance, dim,
					use->slot->once || is_once(one, use->slot));
		}
		if (name) return name;
	}
	return NULL;
}

/* The state goes from plan to plan as it is. */
static void check(quern_run *run, size_t episode, const quern_scene *other, const quern_plan *plan) {
	static const char mended[] = "what a stage switches on must be on in the scene, be it by a tiny value";
	quern_report *report = run->scene->report;
	const quern_node *list = quern_node_find(run->scene->tree->root, "stages");
	const quern_mark mark = list->entries[episode].value->mark;
	const char *of = "", *which = other_plugins(run->scene, other);
	if (which)
		quern_report_add(report, mark,
			"stages: %s must hold the same plugins as the scene, in the same order and by the same names: a "
			"stage changes values, not what takes part",
			which);
	else if ((which = other_start(run->scene, other, &of)))
		quern_report_add(report, mark,
			"stages: %s.%s cannot change in the course of a run: it counts before the first step alone", of,
			which);
	else if ((which = other_field(&run->plan->store, &plan->store)))
		quern_report_add(report, mark,
			"stages: the field %s is there in one and not in another, or otherwise: %s", which, mended);
	else if ((which = other_stage(run->plan, plan)))
		quern_report_add(report, mark, "stages: %s runs in one and not in another: %s", which, mended);
	else if ((which = other_columns(run->plan, plan)))
		quern_report_add(report, mark,
			"stages: %s would have other columns in one than in another, which cannot change in the course "
			"of a run",
			which);
	else if (quern_wish_cell(run->scene) != quern_wish_cell(other))
		quern_report_add(report, mark, "stages: the grid's cell cannot change in the course of a run");
}

void quern_run_plan_episodes(quern_run *run) {
	quern_scene *scene = run->scene;
	run->episode = -1;
	run->entered = -1;
	run->n_plans = scene->n_episodes;
	run->plans = quern_take(run->n_plans + 1, sizeof(quern_plan *));
	run->first_plan = run->plan;
	for (size_t k = 0; k < scene->n_episodes && !quern_report_errors(scene->report); k++) {
		quern_scene *other = scene->episodes[k].scene;
		if (!other) continue;
		run->plans[k] = quern_plan_create(other, run->pool);
		quern_wishes_check(other, run->has_grid);
		quern_report_take(scene->report, other->report);
		if (!quern_report_errors(scene->report)) check(run, k, other, run->plans[k]);
	}
}

void quern_run_finish_episodes(quern_run *run) {
	for (size_t k = 0; run->plans && k < run->n_plans; k++) quern_plan_destroy(run->plans[k]);
	if (run->first_plan) quern_plan_destroy(run->first_plan);
	else quern_plan_destroy(run->plan);
	free(run->plans);
}

/* ---- time ---- */

double quern_run_episode_end(const quern_run *run, double time) {
	const int64_t next = quern_episode_at(run->scene, time) + 1;
	return next < (int64_t)run->scene->n_episodes ? run->scene->episodes[next].begin : INFINITY;
}

bool quern_run_is_seam(const quern_run *run, double time) {
	const int64_t k = quern_episode_at(run->scene, time);
	return k > 0 && run->scene->episodes[k].begin == time;
}

/* The store, with all that it holds, goes over to the plan whose columns will be asked for. */
static void change_plan(quern_run *run, int64_t episode) {
	quern_plan *to = episode >= 0 && run->plans[episode] ? run->plans[episode] : run->first_plan;
	run->episode = episode;
	if (to == run->plan) return;
	const quern_store empty = to->store;
	to->store = run->plan->store;
	run->plan->store = empty;
	for (size_t i = 0; i < to->n_stages; i++) to->stages[i].seconds = run->plan->stages[i].seconds;
	run->plan = to;
	run->plan->fresh = UINT64_MAX;
	quern_plan_refresh(run->plan);
}

void quern_run_enter_episode(quern_run *run, double time) {
	const int64_t k = quern_episode_at(run->scene, time);
	if (k == run->episode) return;
	change_plan(run, k);
	run->entered = run->clock.step;
	if (run->log)
		quern_log_add(run->log, 1, "stage %lld of the scene, from t = %.6g s on", (long long)k, time);
}

/* Between two intervals the next one has not been entered yet, even if its time has come. */
void quern_run_find_episode(quern_run *run) {
	const quern_clock *c = &run->clock;
	if (!run->scene->n_episodes || c->frame < 0) return;
	int64_t k = quern_episode_at(run->scene, c->begin);
	if (!c->steps_in && k >= 0 && run->scene->episodes[k].begin == c->begin) k--;
	if (c->steps_in && run->scene->episodes[k].begin == c->begin && !c->at) run->entered = c->step;
	change_plan(run, k);
}
