/* SPDX-License-Identifier: MIT */
#include "observe.h"
#include "text.h"
#include "watch.h"
#include "wishes.h"
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <quern/columns.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LEAF = 256 };

static const quern_observer_ops *ops_of(const quern_run *run, size_t e) {
	return run->plan->observers[e]->bound.ops;
}

static uint32_t rows_of(const quern_observer_ops *ops) {
	uint32_t n = 0;
	while (ops->outputs[n].name) n++;
	return n;
}

const char *quern_observer_label(const quern_run *run, size_t e) {
	return ((const quern_observe_item *)run->scene->observe.filling[e].item)->label;
}

static quern_observed *add_column(quern_series *s, char *name, const char *unit) {
	s->column = quern_grow(s->column, s->n, &s->capacity, sizeof(quern_observed));
	s->column[s->n] = (quern_observed) {
		.name = name, .unit = quern_copy(unit && *unit ? unit : "1"), .least = INFINITY, .most = -INFINITY
	};
	return &s->column[s->n++];
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

static char *header_of(const quern_series *s) {
	quern_text text = { 0 };
	for (size_t c = 0; c < s->n; c++)
		quern_text_add(&text, "%s%s [%s]", c ? "," : "", s->column[c].name, s->column[c].unit);
	quern_text_add(&text, "\n");
	return text.data;
}

/* One row into the statistics; false if it is not what a run writes: a finite number for each column, and no more. */
static bool read_row(quern_series *s, char *line) {
	char *rest = line, *end;
	for (size_t c = 0; c < s->n; c++) {
		const char *word = strsep(&rest, ",");
		const double value = word ? strtod(word, &end) : NAN;
		if (!isfinite(value) || end == word || *end != (c + 1 < s->n ? 0 : '\n')) return false;
		note(&s->column[c], value);
	}
	return !rest;
}

/* Header and rows as far as they are wanted, read back into the statistics; returns where they end, -1 if they do not
 * stand there. */
static long read_back(quern_series *s, FILE *file, int64_t rows) {
	char *line = NULL, *header = header_of(s);
	size_t size = 0;
	bool good = getline(&line, &size, file) > 0 && !strcmp(line, header);
	for (int64_t k = 0; good && k < rows; k++) {
		const ssize_t length = getline(&line, &size, file);
		good = length > 0 && (size_t)length == strlen(line) && read_row(s, line);
	}
	free(line);
	free(header);
	return good ? ftell(file) : -1;
}

static quern_status unwritable(const quern_series *s, quern_run *run) {
	return quern_run_stop(run, QUERN_E_IO, "%s cannot be written: %s", s->path, strerror(errno));
}

/* Rows beyond the checkpoint belong to a part of the run that is computed again. */
static quern_status cut(quern_series *s, quern_run *run, int64_t rows) {
	FILE *file = fopen(s->path, "r+");
	if (!file && errno != ENOENT) return unwritable(s, run);
	const long end = file ? read_back(s, file, rows) : -1;
	const bool good = end >= 0 && !fflush(file) && !ftruncate(fileno(file), end);
	const bool closed = file && !fclose(file);
	s->rows = rows;
	if (end < 0)
		return quern_run_stop(run, QUERN_E_PARAM,
			"%s does not hold the %lld rows that the checkpoint counts: put it back, or start anew with "
			"--force",
			s->path, (long long)rows);
	return good && closed ? QUERN_OK : unwritable(s, run);
}

static quern_status write_header(const quern_series *s, quern_run *run) {
	char *header = header_of(s), why[256];
	const bool good = quern_save_bytes(s->path, header, strlen(header), why);
	free(header);
	return good ? QUERN_OK : quern_run_stop(run, QUERN_E_IO, "%s", why);
}

static void add_columns(quern_series *s, const quern_run *run) {
	add_column(s, quern_copy("time"), "s");
	add_column(s, quern_copy("step"), "1");
	for (size_t k = 0; k < run->plan->store.n_sets; k++)
		if (quern_set_is_counted(&run->plan->store.sets[k]))
			add_column(s, quern_copy(quern_set_plural(&run->plan->store.sets[k])), "1");
	s->n_outputs = quern_take(run->scene->observe.n, sizeof *s->n_outputs);
	for (size_t e = 0; e < run->scene->observe.n; e++) {
		const quern_observer_ops *ops = ops_of(run, e);
		const char *label = quern_observer_label(run, e);
		const uint32_t n = rows_of(ops);
		s->n_outputs[e] = n * quern_wish_repeats(&run->plan->observers[e]->bound);
		for (uint32_t k = 0; k < s->n_outputs[e]; k++) {
			const quern_output *out = &ops->outputs[k % n];
			char *name = ops->repeat ? quern_format("%s.%s_%u", label, out->name, k / n)
									 : quern_format("%s.%s", label, out->name);
			quern_observed *c = add_column(s, name, out->unit);
			c->output = c->name + strlen(label) + 1;
			c->observer = e;
		}
	}
}

quern_status quern_series_init(quern_series *s, quern_run *run, int64_t rows) {
	*s = (quern_series) { .path = run->folder ? quern_format("%s/series.csv", run->folder) : NULL };
	add_columns(s, run);
	if (!s->path) return QUERN_OK;
	return rows > 0 ? cut(s, run, rows) : write_header(s, run);
}

quern_status quern_series_flush(const quern_series *s, quern_run *run) {
	if (!s->path) return QUERN_OK;
	const int fd = open(s->path, O_RDONLY | O_CLOEXEC);
	const bool good = fd >= 0 && !fsync(fd);
	if (fd >= 0) close(fd);
	return good ? QUERN_OK : unwritable(s, run);
}

void quern_series_finish(quern_series *s) {
	if (!s) return;
	for (size_t c = 0; c < s->n; c++) {
		free(s->column[c].name);
		free(s->column[c].unit);
	}
	free(s->column);
	free(s->n_outputs);
	free(s->path);
	*s = (quern_series) { 0 };
}

/* ---- asking ---- */

typedef struct {
	const quern_bound *bound;
	const quern_observer_ops *ops;
	quern_observer_batch batch;
	uint32_t n_rows, n_outputs, n_leaves;
	uint32_t (*leaf)
		[2]; /* its first entry, and how many: a leaf lies in one block, and blocks come in the order of places */
	bool *along;         /* by use: its column runs along the set that `map` runs over */
	uint32_t *count;     /* by use: entries of its set */
	quern_column *shift; /* by worker, by use: the columns from the leaf's first entry on */
	double *partial;     /* by leaf, by output */
} asking;

static void ask_leaf(void *arg, uint32_t leaf, uint32_t worker) {
	const asking *a = arg;
	const uint32_t begin = a->leaf[leaf][0], n_uses = a->bound->n_uses;
	quern_column *own = a->shift + (size_t)worker * n_uses;
	quern_observer_batch b = a->batch;
	b.n = a->leaf[leaf][1];
	for (uint32_t r = 0; r < n_uses; r++)
		own[r] = a->along[r] ? quern_column_from(a->bound->column[r], a->bound->uses[r].shape, begin)
							 : a->bound->column[r];
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
					combine(a->ops->outputs[k % a->n_rows].combine, a->partial[(size_t)i * a->n_outputs + k],
						a->partial[(size_t)(i + step) * a->n_outputs + k]);
		out[k] = leaves ? a->partial[k] : 0;
	}
}

/* Which set each use is of, for every observer the same way. */
static void look_at_uses(asking *a, quern_run *run, size_t e) {
	for (uint32_t r = 0; r < a->bound->n_uses; r++) {
		char set[24];
		const char *field = run->plan->uses[run->plan->observers[e]->first_use + r].field;
		snprintf(set, sizeof set, "%.*s", (int)strcspn(field, "."), field);
		a->count[r] = quern_host_table.set(run, set).n;
		a->along[r] = a->ops->set && !strcmp(set, a->ops->set);
	}
}

static void cut_block(asking *a, uint32_t begin, uint32_t end) {
	for (; begin < end; begin += LEAF) {
		a->leaf[a->n_leaves][0] = begin;
		a->leaf[a->n_leaves++][1] = end - begin < LEAF ? end - begin : LEAF;
	}
}

static bool cut_set(asking *a, const quern_parts *p) {
	a->leaf = malloc(((size_t)p->owned / LEAF + p->n_blocks + 1) * sizeof *a->leaf);
	if (!a->leaf) return false;
	for (uint32_t q = 0; q < p->n_blocks; q++) {
		const uint32_t b = quern_nth(p->by_place, q);
		cut_block(a, p->block[b], p->block[b + 1]);
	}
	if (!p->n_blocks) cut_block(a, 0, p->owned);
	return true;
}

static quern_status ask_all(asking *a, quern_run *run, double *out) {
	a->batch.count = a->ops->set ? NULL : a->count;
	if (!a->ops->set) return a->ops->whole(a->bound->self, &a->batch, out, &quern_host_table, run);
	const quern_parts *p = quern_host_table.parts(run, a->ops->set);
	const bool good = !p || cut_set(a, p);
	if (good) a->partial = malloc(((size_t)a->n_leaves * a->n_outputs + 1) * sizeof(double));
	if (a->partial) {
		quern_pool_each(run->pool, a->n_leaves, ask_leaf, a);
		fold(a, a->n_leaves, out);
	}
	const quern_status status = a->partial ? QUERN_OK : QUERN_E_MEMORY;
	free(a->leaf);
	free(a->partial);
	return status;
}

static quern_status ask(quern_run *run, size_t e, uint32_t n_outputs, double *out) {
	const quern_bound *bound = &run->plan->observers[e]->bound;
	const quern_general *g = &run->plan->scene->general;
	const size_t n_uses = (size_t)bound->n_uses + 1;
	asking a = { .bound = bound, .ops = bound->ops, .n_rows = rows_of(bound->ops), .n_outputs = n_outputs };
	a.batch = (quern_observer_batch) {
		.dim = (uint32_t)g->dimension, .time = quern_run_time(run), .use = bound->column
	};
	memcpy(a.batch.gravity, g->gravity, sizeof a.batch.gravity);
	memcpy(a.batch.lower, g->lower, sizeof a.batch.lower);
	memcpy(a.batch.upper, g->upper, sizeof a.batch.upper);
	a.along = calloc(n_uses, sizeof *a.along);
	a.count = calloc(n_uses, sizeof *a.count);
	a.shift = calloc(n_uses * quern_pool_workers(run->pool), sizeof *a.shift);
	quern_status status = QUERN_E_MEMORY;
	if (a.along && a.count && a.shift) {
		look_at_uses(&a, run, e);
		status = ask_all(&a, run, out);
	}
	free(a.along);
	free(a.count);
	free(a.shift);
	return status;
}

/* Numbers that are not finite come out nowhere: they end the run, which says whose they are. */
static quern_status take_answers(quern_series *s, quern_run *run, size_t e, size_t first, const double *out) {
	for (uint32_t k = 0; k < s->n_outputs[e]; k++) {
		if (!isfinite(out[k]))
			return quern_run_stop(run, QUERN_E_NUMERIC,
				"observer %s: column %s is %s at t = %.6g s (step %lld)", quern_observer_label(run, e),
				s->column[first + k].name, isnan(out[k]) ? "not a number" : "infinite", quern_run_time(run),
				(long long)run->clock.step);
		note(&s->column[first + k], out[k]);
	}
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
	for (size_t k = 0; k < run->plan->store.n_sets; k++)
		if (quern_set_is_counted(&run->plan->store.sets[k]))
			note(&s->column[c++], run->plan->store.sets[k].n);
	for (size_t e = 0; e < run->scene->observe.n; e++) {
		const uint32_t n = s->n_outputs[e];
		double *out = calloc(n + 1u, sizeof *out);
		quern_watch_enter(run->plan->observers[e]->bound.id, ops_of(run, e)->map ? "map" : "whole");
		quern_status status = out ? ask(run, e, n, out) : QUERN_E_MEMORY;
		quern_watch_leave();
		if (status == QUERN_OK) status = take_answers(s, run, e, c, out);
		free(out);
		c += n;
		if (status != QUERN_OK)
			return quern_run_stop(run, status, "observer %s: %s", quern_observer_label(run, e),
				status == QUERN_E_MEMORY ? "out of memory" : "failed");
	}
	s->rows++;
	return !s->path || write_row(s) ? QUERN_OK : unwritable(s, run);
}
