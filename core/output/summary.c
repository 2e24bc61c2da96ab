/* SPDX-License-Identifier: MIT */
#include "summary.h"
#include "commit.h"
#include "config.h"
#include "identity.h"
#include "platform.h"
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* JSON has no NaN: what is not a number is null. */
static json_t *number(double x) { return isfinite(x) ? json_real(x) : json_null(); }

static json_t *vector(const double *x, uint32_t dim) {
	json_t *list = json_array();
	for (uint32_t k = 0; k < dim; k++) json_array_append_new(list, number(x[k]));
	return list;
}

static json_t *hash(uint64_t value) {
	char text[20];
	snprintf(text, sizeof text, "%016llx", (unsigned long long)value);
	return json_string(text);
}

static json_t *stages(const quern_run *run) {
	json_t *map = json_object();
	for (size_t o = 0; o < run->plan->n_stages; o++) {
		const quern_plan_stage *stage = &run->plan->stages[run->plan->order[o]];
		if (stage->stage) json_object_set_new(map, stage->name, number(stage->seconds));
	}
	return map;
}

static json_t *plugins(const quern_run *run) {
	json_t *list = json_array();
	for (size_t i = 0; i < quern_loader_count(run->scene->loader); i++) {
		const quern_plugin_file *f = quern_loader_at(run->scene->loader, i);
		json_t *one = json_object();
		json_object_set_new(one, "id", json_string(f->plugin.id));
		json_object_set_new(one, "version", json_string(f->library->version));
		json_object_set_new(one, "revision", json_integer(f->plugin.revision));
		json_object_set_new(one, "file", json_string(f->path));
		json_object_set_new(one, "hash", hash(f->hash));
		json_array_append_new(list, one);
	}
	return list;
}

static json_t *observed(const quern_observed *o) {
	json_t *one = json_object();
	json_object_set_new(one, "unit", json_string(o->unit));
	json_object_set_new(one, "first", number(o->first));
	json_object_set_new(one, "last", number(o->last));
	json_object_set_new(one, "mean", number(o->n ? o->sum / (double)o->n : NAN));
	json_object_set_new(one, "min", number(o->least));
	json_object_set_new(one, "max", number(o->most));
	return one;
}

/* One object per observer, by label. */
static json_t *observers(const quern_run *run, const quern_series *s) {
	json_t *all = json_object();
	for (size_t e = 0; e < run->scene->observe.n; e++) {
		json_t *own = json_object();
		for (size_t c = 0; c < s->n; c++)
			if (s->column[c].output && s->column[c].observer == e)
				json_object_set_new(own, s->column[c].output, observed(&s->column[c]));
		json_object_set_new(all, quern_observer_label(run, e), own);
	}
	return all;
}

/* The share of the mass that is carried by single ones: the mean of what an observer of it saw, or as it is now. */
static double discrete_share(const quern_run *run, const quern_series *s, const quern_account *a) {
	const double mass = quern_account_of(a, "mass");
	for (size_t c = 0; c < s->n; c++) {
		const quern_observed *o = &s->column[c];
		if (o->output && o->n && !strcmp(o->output, "share") &&
			!strcmp(run->plan->observers[o->observer]->bound.id, "observer.discrete_share"))
			return o->sum / (double)o->n;
	}
	return mass > 0 ? quern_account_of(a, "discrete") / mass : 0;
}

/* How many there are of each set that is counted, and how many steps they took. A reader of any run finds those of
 * `documented`, be it as zeros. */
static void put_counts(json_t *root, const quern_run *run) {
	static const char *const documented[][2] = { { "grains", "grain_steps" }, { "points", "point_steps" } };
	for (size_t k = 0; k < sizeof documented / sizeof *documented; k++) {
		json_object_set_new(root, documented[k][0], json_integer(0));
		json_object_set_new(root, documented[k][1], json_integer(0));
	}
	for (size_t k = 0; k < run->plan->store.n_sets; k++) {
		const quern_set_store *set = &run->plan->store.sets[k];
		if (!quern_set_is_counted(set)) continue;
		char *steps = quern_format("%s_steps", set->name);
		json_object_set_new(root, quern_set_plural(set), json_integer(set->n));
		json_object_set_new(root, steps, json_integer(set->stepped));
		free(steps);
	}
}

/* All that solvers sum up, by the names that they give. */
static json_t *sums(const quern_account *a) {
	json_t *all = json_object();
	for (size_t k = 0; k < a->n; k++)
		json_object_set_new(all, a->sum[k].name,
			json_pack("{s:s, s:o}", "unit", a->sum[k].unit, "value", number(a->sum[k].value)));
	return all;
}

/* Plugins that took the place of others on the way, a line each. */
static json_t *replaced(const quern_run *run) {
	json_t *list = json_array();
	for (const char *line = run->replaced; line && *line;) {
		const size_t n = strcspn(line, "\n");
		json_array_append_new(list, json_stringn(line, n));
		line += n + (line[n] != 0);
	}
	return list;
}

static json_t *provenance(quern_run *run) {
	json_t *p = json_object();
	json_object_set_new(p, "program", json_string("quern " QUERN_VERSION));
	json_object_set_new(p, "commit", json_string(QUERN_COMMIT));
	json_object_set_new(p, "compiler", json_string(QUERN_COMPILER));
	json_object_set_new(p, "flags", json_string(QUERN_FLAGS));
	json_object_set_new(p, "scene_hash", hash(quern_run_scene_hash(run)));
	json_object_set_new(p, "seed", json_integer(run->scene->general.seed));
	json_object_set_new(p, "plugins", plugins(run));
	if (run->replaced && *run->replaced) json_object_set_new(p, "plugins_replaced", replaced(run));
	return p;
}

bool quern_summary_write(
	quern_run *run, const quern_series *series, const char *status, double wall, char why[256]) {
	const quern_account a = quern_run_account(run);
	const uint32_t dim = (uint32_t)run->scene->general.dimension;
	const double mass = quern_account_of(&a, "mass"), owed = quern_account_of(&a, "owed");
	const double momentum[3] = { quern_account_of(&a, "momentum_x"), quern_account_of(&a, "momentum_y"),
		quern_account_of(&a, "momentum_z") };
	const int64_t peak = quern_platform_peak_memory();
	json_t *root = json_object();
	json_object_set_new(root, "status", json_string(status));
	if (run->message) json_object_set_new(root, "message", json_string(run->message));
	json_object_set_new(root, "name", json_string(run->scene->general.name));
	json_object_set_new(root, "steps", json_integer(run->clock.step));
	json_object_set_new(root, "substeps", json_integer(run->clock.substep));
	json_object_set_new(root, "settle_steps", json_integer(run->clock.settle_step));
	json_object_set_new(root, "time_end", number(quern_run_time(run)));
	json_object_set_new(root, "time_step", number(run->clock.dt));
	json_object_set_new(root, "step_limited_by", json_string(run->limit_reason));
	json_object_set_new(root, "wall_seconds", number(wall));
	json_object_set_new(root, "settle_seconds", number(run->settle_wall));
	json_object_set_new(root, "processor_seconds", number(run->processor));
	json_object_set_new(root, "settle_processor_seconds", number(run->settle_processor));
	json_object_set_new(root, "threads", json_integer(quern_pool_workers(run->pool)));
	put_counts(root, run);
	json_object_set_new(root, "seconds_by_stage", stages(run));
	json_object_set_new(root, "mass_initial", number(run->mass_initial));
	json_object_set_new(root, "mass_final", number(mass));
	json_object_set_new(root, "mass_ledger", number(owed));
	json_object_set_new(root, "mass_defect", number(quern_run_mass_defect(run, &a)));
	json_object_set_new(root, "invariant_defect", number(quern_account_of(&a, "defect")));
	json_object_set_new(root, "momentum", vector(momentum, dim));
	json_object_set_new(root, "energy",
		number(quern_account_of(&a, "kinetic") + quern_account_of(&a, "potential") +
			   quern_account_of(&a, "elastic")));
	json_object_set_new(root, "sums", sums(&a));
	json_object_set_new(root, "discrete_share", number(discrete_share(run, series, &a)));
	json_object_set_new(root, "peak_rss_bytes", json_integer(peak));
	json_object_set_new(root, "state_rss_bytes", json_integer(peak - run->rss_before));
	json_object_set_new(root, "observers", observers(run, series));
	json_object_set_new(root, "provenance", provenance(run));
	char *text = json_dumps(root, JSON_INDENT(2) | JSON_PRESERVE_ORDER | JSON_REAL_PRECISION(17));
	char *path = quern_format("%s/summary.json", run->folder);
	const bool good = text && quern_save_bytes(path, text, strlen(text), why);
	free(path);
	free(text);
	json_decref(root);
	return good;
}
