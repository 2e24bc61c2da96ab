/* SPDX-License-Identifier: MIT */
/* check - places, random numbers, tallies, and kernels called in batches with guards around every column */
#include "check.h"
#include "random.h"
#include "text.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void quern_check_environment(const check *c) {
	const char *changed = quern_environment_restore(c->home);
	if (changed && !*c->shared->left)
		snprintf(c->shared->left, sizeof c->shared->left, "%s.%s: changes %s",
			quern_id_name(c->file->plugin.id), c->shared->place, changed);
}

void quern_check_place(const check *c, const char *fmt, ...) {
	va_list list;
	if (quern_arithmetic() != c->home->arithmetic) quern_check_environment(c);
	va_start(list, fmt);
	vsnprintf(c->shared->place, sizeof c->shared->place, fmt, list);
	va_end(list);
}

double quern_check_uniform(uint64_t key, uint64_t counter, double low, double high) {
	double u[2];
	quern_random(0x71756572, key, counter, u);
	return low + u[0] * (high - low);
}

void quern_check_direction(uint32_t dim, uint64_t key, uint64_t counter, double out[3]) {
	double u[2];
	quern_random(0x6e, key, counter, u);
	const double angle = 2 * 3.141592653589793 * u[0], z = dim == 3 ? 2 * u[1] - 1 : 0, r = sqrt(1 - z * z);
	out[0] = r * cos(angle), out[1] = r * sin(angle), out[2] = z;
}

/* ---- tallies ---- */

static void note_failure(check_tally *t, const char *fmt, va_list list) {
	if (!t->failed++) vsnprintf(t->first, sizeof t->first, fmt, list);
}

void quern_check_expect(check_tally *t, bool good, const char *fmt, ...) {
	va_list list;
	t->tried++;
	if (good) return;
	va_start(list, fmt);
	note_failure(t, fmt, list);
	va_end(list);
}

void quern_check_measure(check_tally *t, double value, double allowed, const char *fmt, ...) {
	va_list list;
	t->tried++;
	if (!(value * t->allowed <= t->worst * allowed) || !(t->allowed > 0))
		t->worst = value, t->allowed = allowed;
	if (value <= allowed) return;
	va_start(list, fmt);
	note_failure(t, fmt, list);
	va_end(list);
}

void quern_check_tell(const check *c, const check_tally *t, const char *note, ...) {
	quern_text text = { 0 };
	if (t->failed) quern_text_add(&text, "%s (%u of %u cases)", t->first, t->failed, t->tried);
	else if (note) {
		va_list list;
		va_start(list, note);
		quern_text_addv(&text, note, list);
		va_end(list);
	} else quern_text_add(&text, "%u cases", t->tried);
	if (t->allowed > 0) quern_text_add(&text, "; worst %.2g, allowed %.2g", t->worst, t->allowed);
	printf("  %-7s %s: %s\n", t->failed ? "FAILED" : "ok", t->name, quern_text_string(&text));
	fflush(stdout);
	quern_text_finish(&text);
	c->shared->properties++;
	c->shared->failed += t->failed > 0;
}

/* ---- kernels ---- */

enum { GUARD = 64, POISON = 0xa5 };

static size_t entry_bytes(const check_column *c) { return c->integer ? sizeof(int32_t) : sizeof(quern_real); }

void quern_check_kernel_init(
	check_kernel *k, const check *c, const check_instance *instance, const char *name, uint32_t n) {
	*k = (check_kernel) { .check = c,
		.instance = instance,
		.name = name,
		.ops = c->ops,
		.dim = instance->dim,
		.n = n,
		.dt = 1e-5 };
	for (int i = 0; i < CHECK_NAMES; i++) k->at[i] = -1;
	for (int i = 0; i < CHECK_ROWS; i++) k->use[i] = k->use_second[i] = -1;
}

void quern_check_kernel_finish(check_kernel *k) {
	for (uint32_t i = 0; i < k->n_columns; i++) {
		free(k->column[i].given);
		free(k->column[i].found);
	}
	k->n_columns = 0;
}

static int add_column(check_kernel *k, const char *text, check_role role, bool integer) {
	check_column *c = &k->column[k->n_columns];
	*c = (check_column) { .name = text, .role = role, .integer = integer };
	c->given = quern_take(k->n, sizeof(quern_real));
	c->found = role == CHECK_IN ? NULL : quern_take(k->n, sizeof(quern_real));
	return (int)k->n_columns++;
}

int quern_check_add(check_kernel *k, int name, const char *text, check_role role, uint32_t count) {
	const int first = (int)k->n_columns;
	for (uint32_t i = 0; i < count; i++) add_column(k, text, role, false);
	return k->at[name] = first;
}

int quern_check_add_integers(check_kernel *k, int name, const char *text, check_role role) {
	return k->at[name] = add_column(k, text, role, true);
}

quern_real *quern_check_given(const check_kernel *k, int name, uint32_t component) {
	return k->at[name] < 0 ? NULL : k->column[k->at[name] + (int)component].given;
}

quern_real *quern_check_found(const check_kernel *k, int name, uint32_t component) {
	return k->at[name] < 0 ? NULL : k->column[k->at[name] + (int)component].found;
}

void quern_check_fill(
	const check_kernel *k, int name, uint32_t count, uint64_t key, double low, double high) {
	for (uint32_t c = 0; c < count; c++)
		for (uint32_t i = 0; i < k->n; i++)
			quern_check_given(k, name, c)[i] = quern_check_uniform(key, (uint64_t)c << 32 | i, low, high);
}

uint32_t quern_check_components(uint8_t shape, uint32_t dim) {
	static const uint8_t planar[] = { 0, 1, 2, 1, 3, 4, 1, 1 }, spatial[] = { 0, 1, 3, 3, 6, 9, 1, 1 };
	return shape > QUERN_ID ? 0 : (dim == 2 ? planar : spatial)[shape];
}

/* Fields that are read: of ordinary size, a unit vector where the unit is 1. Those that are changed: as new. */
static void fill_row(check_kernel *k, const quern_use *row, int first, uint64_t key) {
	const uint32_t count = quern_check_components(row->shape, k->dim);
	const bool fresh = row->access != QUERN_READ;
	const bool unit = row->shape == QUERN_VECTOR && (!row->unit || !strcmp(row->unit, "1"));
	const double size = quern_check_ordinary(k->check, row->unit);
	for (uint32_t i = 0; i < k->n; i++) {
		double direction[3];
		quern_check_direction(k->dim, key, i, direction);
		for (uint32_t c = 0; c < count; c++) {
			const check_column *column = &k->column[first + (int)c];
			const bool diagonal = (row->shape == QUERN_TENSOR && c % (k->dim + 1) == 0) ||
								  (row->shape == QUERN_SYMMETRIC && c < k->dim) ||
								  row->shape < QUERN_SYMMETRIC;
			const double x = fresh  ? (diagonal ? row->initial : 0)
							 : unit ? direction[c]
							 : row->shape == QUERN_SCALAR
								 ? quern_check_uniform(key, (uint64_t)c << 32 | i, 0.5 * size, 1.5 * size)
								 : quern_check_uniform(key, (uint64_t)c << 32 | i, -size, size);
			if (column->integer) ((int32_t *)column->given)[i] = fresh ? (int32_t)row->initial : 0;
			else ((quern_real *)column->given)[i] = x;
		}
	}
}

/* Two rows of one field are one column. */
static int same_field(const check_kernel *k, const quern_use *row, const int *use) {
	const quern_use *rows = k->check->file->uses;
	for (uint32_t r = 0; rows[r].field && r < CHECK_ROWS; r++)
		if (use[r] >= 0 && !strcmp(rows[r].field, row->field)) return use[r];
	return -1;
}

void quern_check_add_uses(check_kernel *k, uint32_t hook, bool optional, bool second) {
	static const check_role roles[] = { CHECK_IN, CHECK_IN, CHECK_OUT, CHECK_CHANGED, CHECK_CHANGED };
	const quern_use *rows = k->check->file->uses;
	k->hook = hook;
	for (uint32_t r = 0; rows[r].field && r < CHECK_ROWS; r++) {
		const quern_use *row = &rows[r];
		if (row->hook != hook || row->shape == QUERN_ID) continue;
		if (!strcmp(row->field, "contact.couple")) continue; /* a batch brings it, beside the force */
		if ((row->with || row->flags & (QUERN_OPTIONAL | QUERN_WANTED)) && !optional) continue;
		if (!quern_check_counts(k->check, k->instance, row)) continue;
		for (uint32_t side = 0; side <= second; side++) {
			int *use = side ? k->use_second : k->use;
			const bool history = !strncmp(row->field, "contact.", 8);
			if (side && history) continue;
			use[r] = same_field(k, row, use);
			if (use[r] >= 0) continue;
			use[r] = (int)k->n_columns;
			for (uint32_t c = 0; c < quern_check_components(row->shape, k->dim); c++)
				add_column(k, row->field, roles[row->access], row->shape == QUERN_INDEX);
			fill_row(k, row, use[r], 1000 + r * 2 + side);
		}
	}
}

void quern_check_columns(
	const check_kernel *k, const check_batch *b, const int *use, quern_column out[CHECK_ROWS]) {
	const quern_use *rows = k->check->file->uses;
	for (uint32_t r = 0; r < CHECK_ROWS; r++) out[r] = (quern_column) { .real = { NULL } };
	for (uint32_t r = 0; rows[r].field && r < CHECK_ROWS; r++) {
		if (use[r] < 0) continue;
		if (rows[r].shape == QUERN_INDEX) out[r].index = b->at[use[r]];
		else
			for (uint32_t c = 0; c < quern_check_components(rows[r].shape, k->dim); c++)
				out[r].real[c] = b->at[use[r] + (int)c];
	}
}

/* ---- calls ---- */

typedef struct {
	check_kernel *k;
	uint32_t cut;
	size_t stride;
	char **memory; /* by worker */
	uint32_t *overrun, *changed, *environment;
	const char **culprit;
} runner;

static void load_column(
	const check_column *c, char *to, uint32_t begin, uint32_t n, uint32_t cap, size_t stride) {
	const size_t size = entry_bytes(c);
	memset(to - GUARD, POISON, stride);
	if (c->role == CHECK_OUT) {
		memset(to, 0xff, cap * size); /* NaN: what is not written shows */
		return;
	}
	memcpy(to, (const char *)c->given + begin * size, n * size);
	for (uint32_t i = n; i < cap; i++) /* harmless: the last one again */
		memcpy(to + i * size, (const char *)c->given + (begin + n - 1) * size, size);
}

/* The first byte is, and each is like the one before. */
static bool is_poison(const char *bytes, size_t n) {
	return (unsigned char)*bytes == POISON && !memcmp(bytes, bytes + 1, n - 1);
}

static void store_column(runner *r, uint32_t worker, const check_column *c, const char *from, uint32_t begin,
	uint32_t n, uint32_t cap) {
	const size_t size = entry_bytes(c);
	const size_t after = r->stride - GUARD - cap * size;
	if (!is_poison(from - GUARD, GUARD) || !is_poison(from + cap * size, after))
		r->overrun[worker]++, r->culprit[worker] = c->name;
	if (c->found) memcpy((char *)c->found + begin * size, from, n * size);
	else if (memcmp((const char *)c->given + begin * size, from, n * size) != 0)
		r->changed[worker]++, r->culprit[worker] = c->name;
}

static void run_piece(void *arg, uint32_t piece, uint32_t worker) {
	runner *r = arg;
	check_kernel *k = r->k;
	const uint32_t begin = piece * r->cut, n = k->n - begin < r->cut ? k->n - begin : r->cut;
	check_batch b = { .n = n, .cap = (n + QUERN_LANES - 1) / QUERN_LANES * QUERN_LANES };
	for (uint32_t c = 0; c < k->n_columns; c++) {
		char *column = r->memory[worker] + c * r->stride + GUARD;
		load_column(&k->column[c], column, begin, n, b.cap, r->stride);
		b.at[c] = column;
	}
	const unsigned before = quern_arithmetic();
	k->call(k, &b);
	if (quern_arithmetic() != before) r->environment[worker]++, quern_arithmetic_set(before);
	for (uint32_t c = 0; c < k->n_columns; c++)
		store_column(r, worker, &k->column[c], b.at[c], begin, n, b.cap);
}

void quern_check_run(check_kernel *k, uint32_t cut, quern_pool *pool) {
	enum { MOST = 16 };
	const uint32_t workers = pool ? quern_pool_workers(pool) : 1, size = k->check->file->plugin.instance_size;
	const uint32_t cap = (cut + QUERN_LANES - 1) / QUERN_LANES * QUERN_LANES;
	char *memory[MOST] = { NULL };
	uint32_t overrun[MOST] = { 0 }, changed[MOST] = { 0 }, environment[MOST] = { 0 };
	const char *culprit[MOST] = { NULL };
	runner r = { k, cut, ((size_t)cap * sizeof(quern_real) + 2 * GUARD + 63) & ~(size_t)63, memory, overrun,
		changed, environment, culprit };
	void *self = quern_take(1, size);
	memcpy(self, k->instance->self, size);
	for (uint32_t w = 0; w < workers && w < MOST; w++) {
		memory[w] = aligned_alloc(64, r.stride * (k->n_columns + 1));
		if (!memory[w]) abort();
	}
	quern_check_place(k->check, "%s, %u-D, while n = %u", k->name, k->dim, cut < k->n ? cut : k->n);
	const uint32_t pieces = (k->n + cut - 1) / cut;
	if (pool) quern_pool_each(pool, pieces, run_piece, &r);
	else
		for (uint32_t i = 0; i < pieces; i++) {
			const uint32_t n = k->n - i * cut < cut ? k->n - i * cut : cut;
			if (n != cut) quern_check_place(k->check, "%s, %u-D, while n = %u", k->name, k->dim, n);
			run_piece(&r, i, 0);
		}
	k->altered += memcmp(self, k->instance->self, size) != 0;
	for (uint32_t w = 0; w < workers && w < MOST; w++) {
		k->overrun += overrun[w];
		k->changed += changed[w];
		k->environment += environment[w];
		if (culprit[w]) k->culprit = culprit[w];
		free(memory[w]);
	}
	free(self);
}

void quern_check_advance(check_kernel *k) {
	for (uint32_t c = 0; c < k->n_columns; c++)
		if (k->column[c].role == CHECK_CHANGED)
			memcpy(k->column[c].given, k->column[c].found, k->n * entry_bytes(&k->column[c]));
}

void quern_check_carry(const check_kernel *from, check_kernel *to) {
	const quern_use *rows = from->check->file->uses;
	for (uint32_t r = 0; rows[r].field && r < CHECK_ROWS; r++)
		for (uint32_t q = 0; rows[q].field && q < CHECK_ROWS; q++) {
			if (from->use[r] < 0 || to->use[q] < 0 || strcmp(rows[r].field, rows[q].field) != 0) continue;
			for (uint32_t c = 0; c < quern_check_components(rows[r].shape, from->dim); c++) {
				const check_column *a = &from->column[from->use[r] + (int)c],
								   *b = &to->column[to->use[q] + (int)c];
				if (a->found) memcpy(b->given, a->found, from->n * entry_bytes(a));
			}
		}
}

bool quern_check_finite(const check_kernel *k, const char **column) {
	for (uint32_t c = 0; c < k->n_columns; c++) {
		const check_column *one = &k->column[c];
		for (uint32_t i = 0; i < k->n && one->found && !one->integer; i++)
			if (!isfinite(((const quern_real *)one->found)[i])) return *column = one->name, false;
	}
	return true;
}
