/* SPDX-License-Identifier: MIT */
/* account - what all solvers carry, summed up by the names that they give; and whether they can go on from a state */
#include "run.h"
#include "text.h"
#include "watch.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static double *sum_named(quern_account *a, const quern_output *row) {
	for (size_t k = 0; k < a->n; k++)
		if (!strcmp(a->sum[k].name, row->name)) return &a->sum[k].value;
	if (a->n == QUERN_MOST_SUMS) return NULL;
	a->sum[a->n].name = row->name;
	a->sum[a->n].unit = row->unit ? row->unit : "1";
	a->sum[a->n].value = row->combine == QUERN_MAX ? -INFINITY : row->combine == QUERN_MIN ? INFINITY : 0;
	return &a->sum[a->n++].value;
}

void quern_account_check(const quern_scene *scene) {
	quern_account all = { .n = 0 };
	for (size_t i = 0; i < scene->n_sections; i++) {
		const quern_section *s = &scene->sections[i];
		for (const quern_output *row = s->ops->sums; row && row->name; row++) {
			if (sum_named(&all, row)) continue;
			quern_report_add(scene->report, s->mark, "%s and the sections before it give more than %d sums",
				s->name, QUERN_MOST_SUMS);
			return;
		}
	}
}

static void add_section(quern_account *a, const quern_section *s, const quern_step *step) {
	double value[QUERN_MOST_SUMS] = { 0 };
	quern_watch_enter(s->solver->file->plugin.id, "account");
	s->ops->account(s->solver->self, step, value);
	quern_watch_leave();
	if (!step->run->stage) quern_run_reset(step->run);
	for (size_t k = 0; s->ops->sums[k].name; k++) {
		const quern_output *row = &s->ops->sums[k];
		double *sum = sum_named(a, row);
		if (!sum) return;
		if (isnan(*sum)) continue;
		if (row->combine == QUERN_SUM) *sum += value[k];
		else if (row->combine == QUERN_MAX ? !(value[k] <= *sum) : !(value[k] >= *sum)) *sum = value[k];
	}
}

quern_account quern_run_account(quern_run *run) {
	quern_account account = { .n = 0 };
	quern_plan_refresh(run->plan);
	for (size_t i = 0; i < run->plan->scene->n_sections; i++) {
		const quern_section *s = &run->plan->scene->sections[i];
		const quern_step step = quern_run_record(run, s);
		if (s->ops->account) add_section(&account, s, &step);
	}
	return account;
}

double quern_account_of(const quern_account *a, const char *name) {
	for (size_t k = 0; k < a->n; k++)
		if (!strcmp(a->sum[k].name, name)) return a->sum[k].value;
	return 0;
}

double quern_run_carries(quern_run *run, const char *name) {
	const quern_account a = quern_run_account(run);
	return quern_account_of(&a, name);
}

/* Where nothing leaves or is poured this is (mass + owed)/initial - 1 to the bit. */
double quern_run_mass_defect(const quern_run *run, const quern_account *a) {
	const double whole = run->mass_initial + quern_account_of(a, "poured");
	const double now =
		quern_account_of(a, "mass") + quern_account_of(a, "owed") + quern_account_of(a, "left");
	return whole > 0 ? now / whole - 1 : 0;
}

quern_status quern_run_check_account(quern_run *run) {
	const quern_account a = quern_run_account(run);
	for (size_t k = 0; k < a.n; k++)
		if (!isfinite(a.sum[k].value))
			return quern_run_stop(run, QUERN_E_NUMERIC,
				"the sum '%s' of the run is no finite number at t = %.6g s (step %lld)", a.sum[k].name,
				quern_run_time(run), (long long)run->clock.step);
	return QUERN_OK;
}

bool quern_run_accept(quern_run *run, quern_text *why) {
	bool good = run->status == QUERN_OK;
	quern_plan_refresh(run->plan);
	for (size_t i = 0; i < run->plan->scene->n_sections && good; i++) {
		const quern_section *s = &run->plan->scene->sections[i];
		if (!s->ops->accept) continue;
		const quern_step step = quern_run_record(run, s);
		quern_watch_enter(s->solver->file->plugin.id, "accept");
		good = s->ops->accept(s->solver->self, &step) == QUERN_OK && run->status == QUERN_OK;
		quern_watch_leave();
		if (!run->stage) quern_run_reset(run);
		if (good) continue;
		if (run->message) quern_text_add(why, "%s", run->message);
		else quern_text_add(why, "%s cannot go on from this state", s->name);
		run->fault = (quern_mark) { 0 };
		free(run->message);
		run->message = NULL;
		run->status = QUERN_OK;
	}
	return good;
}
