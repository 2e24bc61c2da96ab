/* SPDX-License-Identifier: MIT */
#include "wishes.h"
#include "watch.h"

static double cell_of(const quern_section *s) {
	if (!s->ops->cell) return 0;
	quern_watch_enter(s->solver->file->plugin.id, "cell");
	const double cell = s->ops->cell(s->solver->self);
	quern_watch_leave();
	return cell > 0 ? cell : 0;
}

static uint32_t substeps_of(const quern_section *s) {
	if (!s->ops->substeps) return 0;
	quern_watch_enter(s->solver->file->plugin.id, "substeps");
	const uint32_t n = s->ops->substeps(s->solver->self);
	quern_watch_leave();
	return n;
}

/* Wishes are one, so that the first is that of all. */
double quern_wish_cell(const quern_scene *scene) {
	double cell = 0;
	for (size_t i = 0; i < scene->n_sections && !(cell > 0); i++) cell = cell_of(&scene->sections[i]);
	return cell;
}

uint32_t quern_wish_substeps(const quern_scene *scene) {
	uint32_t n = 0;
	for (size_t i = 0; i < scene->n_sections && !n; i++) n = substeps_of(&scene->sections[i]);
	return n ? n : 1;
}

uint32_t quern_wish_repeats(const quern_bound *observer) {
	enum { MOST = 1000 };
	const quern_observer_ops *ops = observer->ops;
	if (!ops->repeat) return 1;
	quern_watch_enter(observer->id, "repeat");
	const uint32_t n = ops->repeat(observer->self);
	quern_watch_leave();
	return n < 1 ? 1 : n < MOST ? n : MOST;
}

static void check_substeps(const quern_scene *scene) {
	const quern_section *first = NULL;
	uint32_t n = 0;
	for (size_t i = 0; i < scene->n_sections; i++) {
		const quern_section *s = &scene->sections[i];
		const uint32_t wish = substeps_of(s);
		if (first && wish && wish != n)
			quern_report_add(scene->report, s->mark, "%s wants %u substeps in a step, and %s %u", s->name,
				wish, first->name, n);
		if (wish && !first) first = s, n = wish;
	}
}

static void check_cell(const quern_scene *scene) {
	const quern_section *first = NULL;
	double cell = 0;
	for (size_t i = 0; i < scene->n_sections; i++) {
		const quern_section *s = &scene->sections[i];
		const double wish = cell_of(s);
		if (first && wish > 0 && wish != cell)
			quern_report_add(scene->report, s->mark,
				"%s wants a grid with cells of %.6g m, and %s one of %.6g m", s->name, wish, first->name,
				cell);
		if (wish > 0 && !first) first = s, cell = wish;
	}
	if (!first) quern_report_add(scene->report, (quern_mark) { 0 }, "the grid has no cell size");
}

void quern_wishes_check(const quern_scene *scene, bool grid) {
	check_substeps(scene);
	if (grid) check_cell(scene);
}
