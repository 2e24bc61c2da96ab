/* SPDX-License-Identifier: MIT */
/* check - the services that conformance tests get: places, random numbers, tallies, and kernels called in batches with
 * guards around every column */
#include "check.h"
#include "random.h"
#include "text.h"
#include <math.h>
#include <quern/columns.h>
#include <stdlib.h>
#include <string.h>

static const check *inside(const quern_check *c) { return (const check *)(const void *)c; }

void quern_check_environment(const check *c) {
	const char *changed = quern_environment_restore(c->home);
	if (changed && !*c->shared->left)
		snprintf(c->shared->left, sizeof c->shared->left, "%s: changes %s", c->shared->place, changed);
}

/* If the last call has changed arithmetic, that is noted and put back. */
void quern_check_place(const quern_check *open, const char *fmt, ...) {
	const check *c = inside(open);
	va_list list;
	if (quern_arithmetic() != c->home->arithmetic) quern_check_environment(c);
	char *to = c->shared->place;
	const size_t size = sizeof c->shared->place;
	const int n = snprintf(to, size, "%s.", quern_id_name(open->id));
	va_start(list, fmt);
	if (n > 0 && (size_t)n < size) vsnprintf(to + n, size - (size_t)n, fmt, list);
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

bool quern_check_is_unit(const quern_check *c, const char *unit) {
	char text[96], why[160];
	double value;
	snprintf(text, sizeof text, "1 %s", unit ? unit : "?");
	return unit && (!strcmp(unit, "1") || quern_quantity_read(inside(c)->units, text, unit, &value, why));
}

int quern_check_mass_power(const quern_check *c, const char *unit) {
	return quern_units_mass(inside(c)->units, unit ? unit : "1");
}

static void *memory(size_t n, size_t size) { return quern_take(n, size); }

static void parallel(const quern_check *c, uint32_t n, void (*body)(void *, uint32_t, uint32_t), void *arg) {
	quern_pool_each(inside(c)->pool, n, body, arg);
}

/* ---- tallies ---- */

static void note_failure(quern_check_tally *t, const char *fmt, va_list list) {
	if (!t->failed++) vsnprintf(t->first, sizeof t->first, fmt, list);
}

void quern_check_expect(quern_check_tally *t, bool good, const char *fmt, ...) {
	va_list list;
	t->tried++;
	if (good) return;
	va_start(list, fmt);
	note_failure(t, fmt, list);
	va_end(list);
}

void quern_check_measure(quern_check_tally *t, double value, double allowed, const char *fmt, ...) {
	va_list list;
	t->tried++;
	if (!(value * t->allowed <= t->worst * allowed) || !(t->allowed > 0))
		t->worst = value, t->allowed = allowed;
	if (value <= allowed) return;
	va_start(list, fmt);
	note_failure(t, fmt, list);
	va_end(list);
}

/* "ok  name: figure" */
void quern_check_tell(const quern_check *c, const quern_check_tally *t, const char *note, ...) {
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
	inside(c)->shared->properties++;
	inside(c)->shared->failed += t->failed > 0;
}

void quern_check_note(const char *text) {
	printf("  %-7s %s\n", "note", text);
	fflush(stdout);
}

/* ---- kernels ---- */

enum { GUARD = 64, POISON = 0xa5 };

static check_kernel *own(quern_check_kernel *k) { return (check_kernel *)(void *)k; }
static const check_kernel *own_const(const quern_check_kernel *k) {
	return (const check_kernel *)(const void *)k;
}
static const quern_use *rows_of(const quern_check_kernel *k) { return inside(k->check)->file->uses; }

size_t quern_check_entry_bytes(const quern_check_column *c) {
	return c->integer ? sizeof(int32_t) : sizeof(quern_real);
}

static quern_check_kernel *kernel_create(
	const quern_check *c, const quern_check_instance *instance, const char *name, uint32_t n) {
	check_kernel *k = quern_take(1, sizeof *k);
	k->open = (quern_check_kernel) { .check = c,
		.host = c->host,
		.instance = instance,
		.self = instance->self,
		.ops = c->ops,
		.name = name,
		.dim = instance->dim,
		.n = n,
		.at = k->at,
		.use = k->use,
		.use_second = k->use_second,
		.dt = 1e-5 };
	for (int i = 0; i < QUERN_CHECK_NAMES; i++) k->at[i] = -1;
	for (int i = 0; i < CHECK_ROWS; i++) k->use[i] = k->use_second[i] = -1;
	return &k->open;
}

void quern_check_kernel_destroy(quern_check_kernel *open) {
	check_kernel *k = own(open);
	for (uint32_t i = 0; k && i < k->open.n_columns; i++) {
		free(k->column[i].given);
		free(k->column[i].found);
	}
	free(k);
}

/* A test that asks for what cannot be has a fault of its own, and is told so as of a crash. */
_Noreturn static void refuse(const quern_check_kernel *k, const char *what, const char *text) {
	quern_check_place(k->check, "%s, where the test of its kind asks for %s: %.60s", k->name, what, text);
	abort();
}

static int32_t add_column(check_kernel *k, const char *text, uint32_t role, bool integer) {
	if (k->open.n_columns == CHECK_COLUMNS) refuse(&k->open, "more columns than there may be", text);
	quern_check_column *c = &k->column[k->open.n_columns];
	*c = (quern_check_column) { .name = text, .role = role, .integer = integer };
	c->given = quern_take(k->open.n, sizeof(quern_real));
	c->found = role == QUERN_CHECK_IN ? NULL : quern_take(k->open.n, sizeof(quern_real));
	return (int32_t)k->open.n_columns++;
}

static void add_named(
	quern_check_kernel *open, int name, const char *text, uint32_t role, uint32_t count, bool integer) {
	check_kernel *k = own(open);
	if (name < 0 || name >= QUERN_CHECK_NAMES) refuse(open, "a column by a number that is too large", text);
	const int32_t first = (int32_t)k->open.n_columns;
	for (uint32_t i = 0; i < count; i++) add_column(k, text, role, integer);
	if (count) k->at[name] = first;
}

static void add(quern_check_kernel *k, int name, const char *text, quern_check_role role, uint32_t count) {
	add_named(k, name, text, role, count, false);
}

static void add_integers(quern_check_kernel *k, int name, const char *text, quern_check_role role) {
	add_named(k, name, text, role, 1, true);
}

static const quern_check_column *column(const quern_check_kernel *k, int32_t number) {
	return &own_const(k)->column[number];
}

static void fill(
	const quern_check_kernel *k, int name, uint32_t count, uint64_t key, double low, double high) {
	for (uint32_t c = 0; c < count; c++)
		for (uint32_t i = 0; i < k->n; i++)
			quern_check_given(k, name, c)[i] = quern_check_uniform(key, (uint64_t)c << 32 | i, low, high);
}

static uint32_t components_of(uint32_t shape, uint32_t dim) { return quern_shape_size((uint8_t)shape, dim); }

/* Fields that are read: of ordinary size, a unit vector where the unit is 1. Those that are changed: as new. */
static void fill_row(check_kernel *k, const quern_use *row, int first, uint64_t key) {
	const uint32_t dim = k->open.dim, count = quern_shape_size((uint8_t)row->shape, dim);
	const bool fresh = row->access != QUERN_READ;
	const bool unit = row->shape == QUERN_VECTOR && (!row->unit || !strcmp(row->unit, "1"));
	const double size = quern_check_ordinary(k->open.check, row->unit);
	for (uint32_t i = 0; i < k->open.n; i++) {
		double direction[3];
		quern_check_direction(dim, key, i, direction);
		for (uint32_t c = 0; c < count; c++) {
			const quern_check_column *to = &k->column[first + (int)c];
			const double x = fresh  ? quern_shape_initial(row->shape, dim, c, row->initial)
							 : unit ? direction[c]
							 : row->shape == QUERN_SCALAR
								 ? quern_check_uniform(key, (uint64_t)c << 32 | i, 0.5 * size, 1.5 * size)
								 : quern_check_uniform(key, (uint64_t)c << 32 | i, -size, size);
			if (to->integer) ((int32_t *)to->given)[i] = fresh ? (int32_t)row->initial : 0;
			else ((quern_real *)to->given)[i] = x;
		}
	}
}

/* Two rows of one field are one column. */
static int32_t same_field(const check_kernel *k, const quern_use *row, const int32_t *use) {
	const quern_use *rows = rows_of(&k->open);
	for (uint32_t r = 0; rows[r].field && r < CHECK_ROWS; r++)
		if (use[r] >= 0 && !strcmp(rows[r].field, row->field)) return use[r];
	return -1;
}

static void add_use(quern_check_kernel *open, uint32_t r, bool second) {
	static const uint32_t roles[] = { QUERN_CHECK_IN, QUERN_CHECK_IN, QUERN_CHECK_OUT, QUERN_CHECK_CHANGED,
		QUERN_CHECK_CHANGED };
	check_kernel *k = own(open);
	const quern_use *row = &rows_of(open)[r];
	int32_t *use = second ? k->use_second : k->use;
	if (row->shape == QUERN_ID || row->flags & QUERN_EXISTS ||
		!quern_check_counts(open->check, open->instance, row))
		return;
	use[r] = same_field(k, row, use);
	if (use[r] >= 0) return;
	use[r] = (int32_t)open->n_columns;
	for (uint32_t c = 0; c < quern_shape_size((uint8_t)row->shape, open->dim); c++)
		add_column(k, row->field, roles[row->access], row->shape == QUERN_INDEX);
	fill_row(k, row, use[r], 1000 + r * 2 + second);
}

static void add_uses(quern_check_kernel *k, uint32_t hook, bool optional) {
	const quern_use *rows = rows_of(k);
	k->hook = hook;
	for (uint32_t r = 0; rows[r].field && r < CHECK_ROWS; r++) {
		const bool hangs = rows[r].with || rows[r].flags & (QUERN_OPTIONAL | QUERN_WANTED);
		if (rows[r].hook == hook && (optional || !hangs)) add_use(k, r, false);
	}
}

/* Columns of the rows, each `at` its number and from entry `begin` on. */
static void columns_at(
	const quern_check_kernel *k, void *const *at, uint32_t begin, const int32_t *use, quern_column *out) {
	const quern_use *rows = rows_of(k);
	for (uint32_t r = 0; r < CHECK_ROWS; r++) out[r] = (quern_column) { .real = { NULL } };
	for (uint32_t r = 0; rows[r].field && r < CHECK_ROWS; r++) {
		if (use[r] < 0) continue;
		if (rows[r].shape == QUERN_INDEX) out[r].index = (int32_t *)at[use[r]] + begin;
		else
			for (uint32_t c = 0; c < quern_shape_size(rows[r].shape, k->dim); c++)
				out[r].real[c] = (quern_real *)at[use[r] + (int)c] + begin;
	}
}

static void columns(
	const quern_check_kernel *k, const quern_check_batch *b, const int32_t *use, quern_column *out) {
	columns_at(k, b->at, 0, use, out);
}

static void given_columns(
	const quern_check_kernel *k, uint32_t begin, const int32_t *use, quern_column *out) {
	void *at[CHECK_COLUMNS];
	for (uint32_t c = 0; c < k->n_columns; c++) at[c] = own_const(k)->column[c].given;
	columns_at(k, at, begin, use, out);
}

/* ---- calls ---- */

enum { THREADS = 4 };

typedef struct {
	check_kernel *k;
	uint32_t cut;
	size_t stride;
	char **memory; /* by worker */
	uint32_t *overrun, *changed, *environment;
	const char **culprit;
} runner;

static void load_column(
	const quern_check_column *c, char *to, uint32_t begin, uint32_t n, uint32_t cap, size_t stride) {
	const size_t size = quern_check_entry_bytes(c);
	memset(to - GUARD, POISON, stride);
	if (c->role == QUERN_CHECK_OUT) {
		memset(to, 0xff, cap * size); /* NaN: what is not written shows */
		return;
	}
	memcpy(to, (const char *)c->given + begin * size, n * size);
	for (uint32_t i = n; i < cap; i++) /* harmless: the last one again */
		memcpy(to + i * size, (const char *)c->given + (begin + n - 1) * size, size);
}

/* The first one is that byte, and each is like the one before. */
static bool is_filled(const char *bytes, size_t n, unsigned char byte) {
	return !n || ((unsigned char)*bytes == byte && !memcmp(bytes, bytes + 1, n - 1));
}

/* Whether what load_column() has put behind the batch is there, before cap and beyond. */
static bool is_left(const runner *r, const quern_check_column *c, const char *from, uint32_t begin,
	uint32_t n, uint32_t cap) {
	const size_t size = quern_check_entry_bytes(c);
	const char *behind = from + n * size, *last = (const char *)c->given + (begin + n - 1) * size;
	bool same = is_filled(from - GUARD, GUARD, POISON) &&
				is_filled(from + cap * size, r->stride - GUARD - cap * size, POISON);
	if (c->role == QUERN_CHECK_OUT) return same && is_filled(behind, (cap - n) * size, 0xff);
	for (uint32_t i = n; i < cap; i++, behind += size) same = same && !memcmp(behind, last, size);
	return same;
}

static void store_column(runner *r, uint32_t worker, const quern_check_column *c, const char *from,
	uint32_t begin, uint32_t n, uint32_t cap) {
	const size_t size = quern_check_entry_bytes(c);
	if (!is_left(r, c, from, begin, n, cap)) r->overrun[worker]++, r->culprit[worker] = c->name;
	if (c->found) memcpy((char *)c->found + begin * size, from, n * size);
	else if (memcmp((const char *)c->given + begin * size, from, n * size) != 0)
		r->changed[worker]++, r->culprit[worker] = c->name;
}

static void run_piece(void *arg, uint32_t piece, uint32_t worker) {
	runner *r = arg;
	check_kernel *k = r->k;
	void *at[CHECK_COLUMNS];
	const uint32_t begin = piece * r->cut, n = k->open.n - begin < r->cut ? k->open.n - begin : r->cut;
	const uint32_t cap = (n + QUERN_LANES - 1) / QUERN_LANES * QUERN_LANES;
	for (uint32_t c = 0; c < k->open.n_columns; c++) {
		char *to = r->memory[worker] + c * r->stride + GUARD;
		load_column(&k->column[c], to, begin, n, cap, r->stride);
		at[c] = to;
	}
	const quern_check_batch b = { .n = n, .cap = cap, .at = at };
	const unsigned before = quern_arithmetic();
	k->open.call(&k->open, &b);
	if (quern_arithmetic() != before) r->environment[worker]++, quern_arithmetic_set(before);
	for (uint32_t c = 0; c < k->open.n_columns; c++)
		store_column(r, worker, &k->column[c], at[c], begin, n, cap);
}

static void run_pieces(runner *r, bool threads) {
	const check_kernel *k = r->k;
	const quern_check *c = k->open.check;
	const uint32_t all = k->open.n, pieces = (all + r->cut - 1) / r->cut;
	quern_check_place(c, "%s, %u-D, while n = %u", k->open.name, k->open.dim, r->cut < all ? r->cut : all);
	if (threads) {
		quern_pool_each(inside(c)->pool, pieces, run_piece, r);
		return;
	}
	for (uint32_t i = 0; i < pieces; i++) {
		const uint32_t n = all - i * r->cut < r->cut ? all - i * r->cut : r->cut;
		if (n != r->cut) quern_check_place(c, "%s, %u-D, while n = %u", k->open.name, k->open.dim, n);
		run_piece(r, i, 0);
	}
}

void quern_check_run(quern_check_kernel *open, uint32_t cut, bool threads) {
	check_kernel *k = own(open);
	const uint32_t workers = threads ? THREADS : 1, size = open->check->instance_size;
	const uint32_t cap = (cut + QUERN_LANES - 1) / QUERN_LANES * QUERN_LANES;
	char *part[THREADS] = { NULL };
	uint32_t overrun[THREADS] = { 0 }, changed[THREADS] = { 0 }, environment[THREADS] = { 0 };
	const char *culprit[THREADS] = { NULL };
	runner r = { k, cut, ((size_t)cap * sizeof(quern_real) + 2 * GUARD + 63) & ~(size_t)63, part, overrun,
		changed, environment, culprit };
	void *self = quern_take(1, size);
	memcpy(self, open->self, size);
	for (uint32_t w = 0; w < workers; w++) {
		part[w] = aligned_alloc(64, r.stride * (k->open.n_columns + 1));
		if (!part[w]) abort();
	}
	run_pieces(&r, threads);
	k->altered += memcmp(self, open->self, size) != 0;
	for (uint32_t w = 0; w < workers; w++) {
		k->overrun += overrun[w];
		k->changed += changed[w];
		k->environment += environment[w];
		if (culprit[w]) k->culprit = culprit[w];
		free(part[w]);
	}
	free(self);
}

static void advance(quern_check_kernel *k) {
	for (uint32_t c = 0; c < k->n_columns; c++) {
		const quern_check_column *one = &own(k)->column[c];
		if (one->role == QUERN_CHECK_CHANGED)
			memcpy(one->given, one->found, k->n * quern_check_entry_bytes(one));
	}
}

static void carry(const quern_check_kernel *from, quern_check_kernel *to) {
	const quern_use *rows = rows_of(from);
	for (uint32_t r = 0; rows[r].field && r < CHECK_ROWS; r++)
		for (uint32_t q = 0; rows[q].field && q < CHECK_ROWS; q++) {
			if (from->use[r] < 0 || to->use[q] < 0 || strcmp(rows[r].field, rows[q].field) != 0) continue;
			for (uint32_t c = 0; c < quern_shape_size(rows[r].shape, from->dim); c++) {
				const quern_check_column *a = column(from, from->use[r] + (int)c),
										 *b = column(to, to->use[q] + (int)c);
				if (a->found) memcpy(b->given, a->found, from->n * quern_check_entry_bytes(a));
			}
		}
}

bool quern_check_finite(const quern_check_kernel *k, const char **name) {
	for (uint32_t c = 0; c < k->n_columns; c++) {
		const quern_check_column *one = &own_const(k)->column[c];
		for (uint32_t i = 0; i < k->n && one->found && !one->integer; i++)
			if (!isfinite(((const quern_real *)one->found)[i])) return *name = one->name, false;
	}
	return true;
}

/* ---- the table ---- */

const quern_check_host quern_check_services = {
	.abi = QUERN_ABI,
	.place = quern_check_place,
	.expect = quern_check_expect,
	.measure = quern_check_measure,
	.tell = quern_check_tell,
	.memory = memory,
	.uniform = quern_check_uniform,
	.direction = quern_check_direction,
	.ordinary = quern_check_ordinary,
	.is_unit = quern_check_is_unit,
	.mass_power = quern_check_mass_power,
	.parallel = parallel,
	.instance_create = quern_check_instance_create,
	.instance_scaled = quern_check_instance_scaled,
	.instance_destroy = quern_check_instance_destroy,
	.settings = quern_check_settings,
	.counts = quern_check_counts,
	.kernel_create = kernel_create,
	.kernel_destroy = quern_check_kernel_destroy,
	.add = add,
	.add_integers = add_integers,
	.add_uses = add_uses,
	.add_use = add_use,
	.column = column,
	.fill = fill,
	.run = quern_check_run,
	.advance = advance,
	.carry = carry,
	.finite = quern_check_finite,
	.columns = columns,
	.given_columns = given_columns,
	.components = components_of,
};
