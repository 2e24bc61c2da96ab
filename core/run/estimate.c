/* SPDX-License-Identifier: MIT */
#include "estimate.h"
#include "watch.h"
#include "wishes.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double day = 86400;

static double entries(quern_run *run, const quern_section *section) {
	double sum = 0;
	for (const quern_set *set = section->ops->sets; set->name; set++)
		if (set->counted)
			sum += set->cost[run->scene->general.dimension - 2] * quern_host_table.set(run, set->name).n;
	return sum;
}

static double work(quern_run *run, const quern_section *section, uint32_t n, double wider) {
	if (!section->ops->work) return 0;
	quern_step step = quern_run_record(run, section);
	step.n_substeps = n;
	quern_watch_enter(section->solver->file->plugin.id, "work");
	const double sum = section->ops->work(section->solver->self, &step, wider);
	quern_watch_leave();
	return sum;
}

/* What moves on the grid is so dense in cells, whatever their width; what takes substeps does not mind them. */
double quern_estimate_price(quern_run *run, bool substeps, uint32_t n, double wider) {
	const double fewer =
		run->scene->general.dimension == 2 ? 1 / (wider * wider) : 1 / (wider * wider * wider);
	double sum = 0;
	for (size_t i = 0; i < run->plan->scene->n_sections; i++) {
		const quern_section *section = &run->plan->scene->sections[i];
		if (substeps == quern_section_takes_substeps(section))
			sum += entries(run, section) * (substeps ? 1 : fewer);
		if (!substeps) sum += work(run, section, n, wider);
	}
	return sum;
}

quern_estimate quern_estimate_of(quern_run *run) {
	const quern_general *g = &run->scene->general;
	const uint32_t n = quern_wish_substeps(run->plan->scene);
	const double substep = quern_estimate_price(run, true, n, 1),
				 step = quern_estimate_price(run, false, n, 1);
	quern_estimate e = { .substeps = n };
	e.own = quern_run_own_steps(run);
	e.most_substeps = quern_run_most_substeps(&e.own);
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
