/* SPDX-License-Identifier: MIT */
#include "run_episodes.h"
#include "episodes.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- plans ---- */

static bool same_fields(const quern_store *a, const quern_store *b, const char **which) {
	bool same = a->n_fields == b->n_fields && a->n_sets == b->n_sets;
	for (size_t k = 0; k < a->n_fields && k < b->n_fields; k++) {
		const quern_field *f = &a->fields[k], *g = &b->fields[k];
		if (!strcmp(f->name, g->name) && f->shape == g->shape && f->twice == g->twice && f->kept == g->kept &&
			f->local == g->local && f->lane == g->lane)
			continue;
		*which = f->name;
		return false;
	}
	if (!same) *which = a->n_fields > b->n_fields ? a->fields[b->n_fields].name : b->fields[a->n_fields].name;
	return same;
}

static bool same_plugins(const quern_loader *a, const quern_loader *b, const char **which) {
	const size_t n = quern_loader_count(a), m = quern_loader_count(b);
	for (size_t i = 0; i < n || i < m; i++) {
		*which = i < m ? quern_loader_at(b, i)->plugin.id : quern_loader_at(a, i)->plugin.id;
		if (i >= n || i >= m || strcmp(quern_loader_at(a, i)->plugin.id, *which) != 0) return false;
	}
	return true;
}

static double cell_of(const quern_scene *s) {
	for (size_t i = 0; i < s->n_sections; i++) {
		const double wish =
			s->sections[i].ops->cell ? s->sections[i].ops->cell(s->sections[i].solver->self) : 0;
		if (wish > 0) return wish;
	}
	return 0;
}

/* The state goes from plan to plan as it is. */
static void check(quern_run *run, const quern_scene *other, const quern_plan *plan) {
	quern_report *report = run->scene->report;
	const quern_entry *entry = quern_node_entry(run->scene->tree->root, "stages");
	const char *which = "";
	if (!same_plugins(run->scene->loader, other->loader, &which))
		quern_report_add(report, entry->mark,
			"stages: %s is there in one and not in another: a stage changes values, not what takes part",
			which);
	else if (!same_fields(&run->plan->store, &plan->store, &which))
		quern_report_add(report, entry->mark,
			"stages: the field %s is there in one and not in another: a stage changes values, not what is "
			"computed",
			which);
	else if (cell_of(run->scene) != cell_of(other))
		quern_report_add(report, entry->mark, "stages: the grid's cell cannot change in the course of a run");
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
		quern_report_take(scene->report, other->report);
		if (!quern_report_errors(scene->report)) check(run, other, run->plans[k]);
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
	const bool changes = run->scene->episodes[k].scene || (run->episode >= 0 && run->plan != run->first_plan);
	change_plan(run, k);
	if (changes) run->entered = run->clock.step;
	if (run->log && (k || changes))
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
