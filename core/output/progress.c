/* SPDX-License-Identifier: MIT */
#include "progress.h"
#include "watch.h"
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double every = 0.5; /* s */
enum { SHARE = 200 };            /* of the time, at most one part in that many */

bool quern_progress_due(const quern_progress *p) { return quern_wall() >= p->next; }

/* ---- what solvers say ---- */

typedef struct {
	quern_text line; /* ", kinetic 1.2e-07 J, overlap 0.4 %" */
	json_t *looks;   /* by section */
} telling;

static json_t *number(double value) { return isfinite(value) ? json_real(value) : json_null(); }

static void say(quern_text *line, const quern_output *row, double value) {
	const bool bare = !row->unit || !strcmp(row->unit, "1");
	quern_text_add(line, ", %s %.3g%s%s", row->name, value, bare ? "" : " ", bare ? "" : row->unit);
}

static void look_at(telling *t, quern_run *run, const quern_section *section) {
	double value[QUERN_MOST_SUMS] = { 0 };
	const quern_step step = quern_run_record(run, section);
	json_t *own = json_object();
	quern_watch_enter(section->solver->file->plugin.id, "look");
	section->ops->look(section->solver->self, &step, value);
	quern_watch_leave();
	quern_run_reset(run);
	for (size_t k = 0; section->ops->looks[k].name; k++) {
		const quern_output *row = &section->ops->looks[k];
		if (!isfinite(value[k])) continue;
		say(&t->line, row, value[k]);
		json_t *one = json_object();
		json_object_set_new(one, "unit", json_string(row->unit ? row->unit : "1"));
		json_object_set_new(one, "value", json_real(value[k]));
		json_object_set_new(own, row->name, one);
	}
	json_object_set_new(t->looks, section->name, own);
}

static telling look(quern_run *run) {
	telling t = { .looks = json_object() };
	quern_plan_refresh(run->plan);
	for (size_t i = 0; i < run->plan->scene->n_sections && run->status == QUERN_OK; i++)
		if (run->plan->scene->sections[i].ops->look) look_at(&t, run, &run->plan->scene->sections[i]);
	return t;
}

/* ---- the file ---- */

/* Others read it while the run goes on: there is the old one or the new one. Nobody needs it after a power cut, and a fault
 * of writing is found at the next frame. */
static bool save(const quern_run *run, json_t *root) {
	bool good = false;
	char *path = quern_format("%s/progress.json", run->folder), *half = quern_format("%s.part", path);
	FILE *file = fopen(half, "w");
	if (file) {
		good = !json_dumpf(root, file, JSON_INDENT(2) | JSON_PRESERVE_ORDER | JSON_REAL_PRECISION(9));
		good = !fclose(file) && good && !rename(half, path);
		if (!good) unlink(half);
	}
	free(path);
	free(half);
	return good;
}

typedef struct {
	double rate, left; /* steps/s; s, not a number where nobody knows */
} pace;

static bool save_all(const quern_run *run, const char *status, double wall, const pace *is, json_t *looks) {
	json_t *root = json_object();
	const quern_clock *c = &run->clock;
	json_object_set_new(root, "status", json_string(status));
	json_object_set_new(root, "process", json_integer(getpid()));
	json_object_set_new(root, "time", number(quern_run_time(run)));
	json_object_set_new(root, "time_end", number(run->scene->general.end));
	json_object_set_new(root, "step", json_integer(c->step));
	json_object_set_new(root, "settle_step", json_integer(c->settle_step));
	json_object_set_new(root, "frame", json_integer(c->frame));
	json_object_set_new(root, "steps_per_second", number(is->rate));
	json_object_set_new(root, "wall_seconds", number(wall));
	json_object_set_new(root, "seconds_left", number(is->left));
	json_object_set(root, "looks", looks);
	const bool good = save(run, root);
	json_decref(root);
	return good;
}

/* ---- the line ---- */

/* Since the last look: what was slow long ago says little. */
static pace pace_of(quern_progress *p, const quern_run *run, double wall) {
	const quern_clock *c = &run->clock;
	const bool settling = !c->settled;
	const double now = quern_wall(), t = quern_run_time(run);
	const int64_t step = settling ? c->settle_step : c->step;
	pace is = { NAN, NAN };
	if (p->begin > 0 && p->settling == settling && now > p->begin)
		is.rate = (double)(step - p->step) / (now - p->begin);
	if (!settling && t > 0) is.left = (wall - run->settle_wall) * (run->scene->general.end - t) / t;
	p->begin = now;
	p->step = step;
	p->settling = settling;
	return is;
}

static void put_line(quern_run *run, const pace *is, double wall, const char *looks) {
	const double t = quern_run_time(run), end = run->scene->general.end;
	char rate[40] = "";
	if (isfinite(is->rate)) snprintf(rate, sizeof rate, ", %.4g steps/s", is->rate);
	if (!run->clock.settled)
		quern_log_progress(run->log, "settling: %lld steps, %.0f s%s%s", (long long)run->clock.settle_step,
			wall, rate, looks);
	else
		quern_log_progress(run->log, "t = %.4g of %.4g s (%.0f %%), step %lld, %.0f s left%s%s", t, end,
			100 * t / end, (long long)run->clock.step, isfinite(is->left) ? is->left : 0, rate, looks);
}

void quern_progress_tell(quern_progress *p, quern_run *run, double wall) {
	const double begin = quern_wall();
	const pace is = pace_of(p, run, wall);
	telling t = look(run);
	put_line(run, &is, wall, quern_text_string(&t.line));
	save_all(run, run->clock.settled ? "running" : "settling", wall, &is, t.looks);
	quern_text_finish(&t.line);
	json_decref(t.looks);
	const double now = quern_wall();
	p->next = now + fmax(every, SHARE * (now - begin));
}

void quern_progress_end(quern_progress *p, quern_run *run, const char *status, double wall) {
	pace is = pace_of(p, run, wall);
	telling t = { .looks = NULL };
	if (run->status == QUERN_OK) t = look(run);
	else t.looks = json_object();
	if (quern_run_over(run)) is.left = 0;
	if (!save_all(run, status, wall, &is, t.looks)) {
		char *path = quern_format("%s/progress.json", run->folder);
		unlink(path); /* no word is better than one that the run goes on */
		free(path);
	}
	quern_text_finish(&t.line);
	json_decref(t.looks);
}
