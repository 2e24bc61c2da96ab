/* SPDX-License-Identifier: MIT */
#include "estimate.h"
#include "wishes.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double day = 86400;

/* s on one core for one step of all entries that are counted, by the rough prices in the tables of their solvers: in
 * substeps, or else in whole steps. */
static double price(const quern_run *run, bool substeps) {
	double sum = 0;
	for (size_t i = 0; i < run->plan->scene->n_sections; i++) {
		const quern_section *section = &run->plan->scene->sections[i];
		if (quern_section_takes_substeps(section) != substeps) continue;
		for (const quern_set *set = section->ops->sets; set->name; set++)
			if (set->counted)
				sum += set->cost[run->scene->general.dimension - 2] *
					   quern_host_table.set((quern_run *)(uintptr_t)run, set->name).n;
	}
	return sum;
}

quern_estimate quern_estimate_of(quern_run *run) {
	const quern_general *g = &run->scene->general;
	const double substep = price(run, true), step = price(run, false);
	quern_estimate e = { .substeps = quern_wish_substeps(run->plan->scene) };
	e.most_substeps = quern_run_most_substeps(run);
	const double limit = quern_run_limit(run, &e.hard, e.reason, e.hard_reason);
	e.step = g->step > 0 ? g->step : limit;
	if (g->step > 0) snprintf(e.reason, sizeof e.reason, "the scene's time.step");
	if (!run->clock.settled) e.settle_steps = ceil(quern_run_settling(run, &e.settle_step));
	e.steps = isfinite(e.step) ? ceil((g->end - quern_run_time(run)) / e.step) : 1;
	e.settling = e.settle_steps * substep;
	e.running = e.steps * (e.substeps * substep + step);
	return e;
}

void quern_estimate_time(double seconds, char out[32]) {
	static const struct {
		double size;
		const char *name;
	} units[] = { { 365.25 * 86400, "years" }, { 86400, "days" }, { 3600, "h" }, { 60, "min" }, { 1, "s" } };
	snprintf(out, 32, "less than 2 s");
	for (size_t k = 0; k < sizeof units / sizeof *units; k++) {
		const double n = seconds / units[k].size;
		if (!(n >= 2)) continue;
		snprintf(out, 32,
			n < 10    ? "about %.1f %s"
			: n < 1e6 ? "about %.0f %s"
					  : "about %.1e %s",
			n, units[k].name);
		return;
	}
}

bool quern_estimate_is_long(const quern_estimate *e, uint32_t cores, char say[600]) {
	char settling[32], running[32];
	if (!((e->settling + e->running) / cores > day)) return false;
	quern_estimate_time(e->settling / cores, settling);
	quern_estimate_time(e->running / cores, running);
	snprintf(say, 600,
		"this will take long on %u core%s: %s of settling, %.2g steps of %.2g s, and %s of running, %.2g "
		"steps of %.2g s, set by %s",
		cores, cores > 1 ? "s" : "", settling, e->settle_steps, e->settle_step, running, e->steps, e->step,
		e->reason);
	return true;
}
