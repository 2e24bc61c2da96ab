#include "observe.h"
#include "text.h"
#include "watch.h"
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LEAF = 256, MOST_OUTPUTS = 32, FIXED_COLUMNS = 4 };

static const quern_observer_ops *ops_of(const quern_run *run, size_t e) {
	return run->plan->observers[e]->bound->ops;
}

static uint32_t outputs_of(const quern_observer_ops *ops) {
	uint32_t n = 0;
	while (ops->outputs[n].name && n < MOST_OUTPUTS) n++;
	return n;
}

static void add_column(quern_series *s, const char *prefix, const char *name, const char *unit) {
	s->column = quern_grow(s->column, s->n, &s->capacity, sizeof(quern_observed));
	s->column[s->n++] =
		(quern_observed) { .name = prefix ? quern_format("%s.%s", prefix, name) : quern_copy(name),
			.unit = quern_copy(unit && *unit ? unit : "1"),
			.least = INFINITY,
			.most = -INFINITY };
}

static void note(quern_observed *c, double value) {
	if (!c->n) c->first = value;
	c->last = value;
	c->least = value < c->least ? value : c->least;
	c->most = value > c->most ? value : c->most;
	c->sum += value;
	c->n++;
}

/* ---- the file ---- */

/* Rows beyond the checkpoint belong to a part of the run that is computed again. */
static bool cut(quern_series *s, int64_t rows) {
	FILE *file = fopen(s->path, "r+");
	char *line = NULL;
	size_t size = 0;
	long end = 0;
	bool good = file != NULL;
	for (int64_t k = -1; good && k < rows; k++) {
		good = getline(&line, &size, file) > 0;
		end = ftell(file);
		char *rest = line, *word;
		for (size_t c = 0; good && k >= 0 && c < s->n && (word = strsep(&rest, ",")); c++)
			note(&s->column[c], strtod(word, NULL));
	}
	free(line);
	if (file) good = good && !fflush(file) && !ftruncate(fileno(file), end);
	if (file && fclose(file)) good = false;
	s->rows = rows;
	return good;
}

static bool write_header(const quern_series *s) {
	FILE *file = fopen(s->path, "w");
	if (!file) return false;
	for (size_t c = 0; c < s->n; c++)
		fprintf(file, "%s%s [%s]", c ? "," : "", s->column[c].name, s->column[c].unit);
	fputc('\n', file);
	const bool good = !ferror(file);
	return !fclose(file) && good;
}

quern_status quern_series_init(quern_series *s, quern_run *run, int64_t rows) {
	*s = (quern_series) { .path = run->folder ? quern_format("%s/series.csv", run->folder) : NULL };
	add_column(s, NULL, "time", "s");
	add_column(s, NULL, "step", "1");
	add_column(s, NULL, "grains", "1");
	add_column(s, NULL, "points", "1");
	for (size_t e = 0; e < run->scene->observe.n; e++) {
		const char *name = strchr(run->plan->observers[e]->bound->id, '.') + 1;
		const quern_output *out = ops_of(run, e)->outputs;
		for (uint32_t k = 0; k < outputs_of(ops_of(run, e)); k++)
			add_column(s, name, out[k].name, out[k].unit);
	}
	if (!s->path) return QUERN_OK;
	if (rows > 0 ? cut(s, rows) : write_header(s)) return QUERN_OK;
	return quern_run_stop(run, QUERN_E_IO, "%s cannot be written: %s", s->path, strerror(errno));
}

void quern_series_finish(quern_series *s) {
	if (!s) return;
	for (size_t c = 0; c < s->n; c++) {
		free(s->column[c].name);
		free(s->column[c].unit);
	}
	free(s->column);
	free(s->path);
	*s = (quern_series) { 0 };
}

/* ---- asking ---- */

typedef struct {
	const quern_bound *bound;
	const quern_observer_ops *ops;
	quern_observer_batch batch;
	uint32_t n, n_outputs;
	double *partial;
} asking;

static void ask_leaf(void *arg, uint32_t leaf, uint32_t worker) {
	const asking *a = arg;
	quern_column own[MOST_OUTPUTS];
	quern_observer_batch b = a->batch;
	(void)worker;
	const uint32_t begin = leaf * LEAF;
	b.n = a->n - begin < LEAF ? a->n - begin : LEAF;
	for (uint32_t r = 0; r < a->bound->n_uses && r < MOST_OUTPUTS; r++) {
		const quern_use *row = &a->bound->uses[r];
		const bool total = !strncmp(row->field, "total.", 6);
		own[r] = a->bound->column[r];
		if (total) continue;
		if (row->shape == QUERN_INDEX) {
			if (own[r].index) own[r].index += begin;
		} else if (row->shape == QUERN_ID) {
			if (own[r].id) own[r].id += begin;
		} else
			for (int k = 0; k < 9; k++)
				if (own[r].real[k]) own[r].real[k] += begin;
	}
	b.use = own;
	a->ops->map(a->bound->self, &b, a->partial + (size_t)leaf * a->n_outputs);
}

static double combine(uint32_t how, double a, double b) {
	if (how == QUERN_MAX) return a > b ? a : b;
	if (how == QUERN_MIN) return a < b ? a : b;
	return a + b;
}

/* Pairs of leaves, pairs of pairs: the same tree for any number of workers. */
static void fold(const asking *a, uint32_t leaves, double *out) {
	for (uint32_t k = 0; k < a->n_outputs; k++) {
		for (uint32_t step = 1; step < leaves; step *= 2)
			for (uint32_t i = 0; i + step < leaves; i += 2 * step)
				a->partial[(size_t)i * a->n_outputs + k] =
					combine(a->ops->outputs[k].combine, a->partial[(size_t)i * a->n_outputs + k],
						a->partial[(size_t)(i + step) * a->n_outputs + k]);
		out[k] = leaves ? a->partial[k] : 0;
	}
}

static quern_status ask(quern_run *run, size_t e, double *out) {
	const quern_bound *bound = run->plan->observers[e]->bound;
	const quern_general *g = &run->scene->general;
	asking a = { .bound = bound, .ops = bound->ops, .n_outputs = outputs_of(bound->ops) };
	a.batch = (quern_observer_batch) {
		.dim = (uint32_t)g->dimension, .time = quern_run_time(run), .use = bound->column
	};
	memcpy(a.batch.gravity, g->gravity, sizeof a.batch.gravity);
	memcpy(a.batch.lower, g->lower, sizeof a.batch.lower);
	memcpy(a.batch.upper, g->upper, sizeof a.batch.upper);
	if (!a.ops->set) {
		uint32_t count[MOST_OUTPUTS] = { 0 };
		for (uint32_t r = 0; r < bound->n_uses && r < MOST_OUTPUTS; r++) {
			char set[24];
			const char *field = run->plan->uses[run->plan->observers[e]->first_use + r].field;
			snprintf(set, sizeof set, "%.*s", (int)strcspn(field, "."), field);
			count[r] = quern_host_table.set(run, set).n;
		}
		a.batch.count = count;
		return a.ops->whole(bound->self, &a.batch, out, &quern_host_table, run);
	}
	a.n = quern_host_table.set(run, a.ops->set).n;
	const uint32_t leaves = (a.n + LEAF - 1) / LEAF;
	a.partial = malloc(((size_t)leaves + 1) * a.n_outputs * sizeof(double));
	if (!a.partial) return QUERN_E_MEMORY;
	quern_pool_each(run->pool, leaves, ask_leaf, &a);
	fold(&a, leaves, out);
	free(a.partial);
	return QUERN_OK;
}

static bool write_row(const quern_series *s) {
	FILE *file = fopen(s->path, "a");
	if (!file) return false;
	for (size_t c = 0; c < s->n; c++) {
		char number[32];
		quern_number(s->column[c].last, number);
		fprintf(file, "%s%s", c ? "," : "", number);
	}
	fputc('\n', file);
	const bool good = !fflush(file) && !ferror(file);
	return !fclose(file) && good;
}

quern_status quern_series_add(quern_series *s, quern_run *run) {
	size_t c = 0;
	quern_plan_refresh(run->plan);
	note(&s->column[c++], quern_run_time(run));
	note(&s->column[c++], (double)run->clock.step);
	note(&s->column[c++], quern_host_table.set(run, "grain").n);
	note(&s->column[c++], quern_host_table.set(run, "point").n);
	for (size_t e = 0; e < run->scene->observe.n; e++) {
		double out[MOST_OUTPUTS] = { 0 };
		quern_watch_enter(run->plan->observers[e]->bound->id, ops_of(run, e)->map ? "map" : "whole");
		const quern_status status = ask(run, e, out);
		quern_watch_leave();
		if (status != QUERN_OK)
			return quern_run_stop(run, status, "%s failed", run->plan->observers[e]->bound->id);
		for (uint32_t k = 0; k < outputs_of(ops_of(run, e)); k++) note(&s->column[c++], out[k]);
	}
	s->rows++;
	if (s->path && !write_row(s))
		return quern_run_stop(run, QUERN_E_IO, "%s cannot be written: %s", s->path, strerror(errno));
	return QUERN_OK;
}
