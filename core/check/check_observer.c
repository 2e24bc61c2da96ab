/* SPDX-License-Identifier: MIT */
/* quern_check_observer - numbers about a whole set: what leaves give does not depend on who computes them, and sums of parts
 * are sums of the whole */
#include "check.h"
#include "check_table.h"
#include "text.h"
#include <math.h>
#include <quern/observer.h>
#include <stdlib.h>
#include <string.h>

enum { LEAF = 256, ENTRIES = 2000 };

static uint32_t outputs(const check *c) {
	const quern_observer_ops *ops = c->ops;
	uint32_t n = 0;
	while (ops->outputs && ops->outputs[n].name) n++;
	return n;
}

static void nothing(const check_kernel *k, const check_batch *b) { (void)k, (void)b; }

static void create(const check *c, const check_instance *it, bool optional, check_kernel *k) {
	quern_check_kernel_init(k, c, it, "map", ENTRIES);
	k->call = nothing;
	quern_check_add_uses(k, 0, optional, false);
}

/* Partials of entries [begin, begin + n), with a guard behind them. */
static bool map(const check_kernel *k, uint32_t begin, uint32_t n, quern_real *partial) {
	const quern_observer_ops *ops = k->ops;
	quern_column use[CHECK_ROWS];
	check_batch b = { .n = n, .cap = n };
	for (uint32_t c = 0; c < k->n_columns; c++)
		b.at[c] = k->column[c].integer ? (void *)((int32_t *)k->column[c].given + begin)
									   : (void *)((quern_real *)k->column[c].given + begin);
	quern_check_columns(k, &b, k->use, use);
	quern_observer_batch batch = { .n = n, .dim = k->dim, .time = 0.25, .upper = { 1, 1, 1 }, .use = use };
	const uint32_t count = outputs(k->check);
	batch.gravity[k->dim - 1] = -9.81;
	memset(partial, 0xff, count * sizeof *partial);
	partial[count] = 12345;
	quern_check_place(k->check, "map, %u-D, while n = %u", k->dim, n);
	ops->map(k->instance->self, &batch, partial);
	return partial[count] == 12345;
}

static double combined(uint32_t how, double a, double b) {
	if (how == QUERN_SUM) return a + b;
	return how == QUERN_MAX ? (a > b ? a : b) : (a < b ? a : b);
}

typedef struct {
	check_tally cuts, threads, guards, finite;
} tallies;

static void total(const check_kernel *k, uint32_t cut, quern_real *sum, quern_real *size, tallies *t) {
	const quern_observer_ops *ops = k->ops;
	const uint32_t count = outputs(k->check);
	quern_real *partial = quern_take(count + 1, sizeof *partial);
	for (uint32_t begin = 0; begin < ENTRIES; begin += cut) {
		const uint32_t n = ENTRIES - begin < cut ? ENTRIES - begin : cut;
		quern_check_expect(&t->guards, map(k, begin, n, partial),
			"%u-D: more partials are written than there are outputs", k->dim);
		for (uint32_t o = 0; o < count; o++) {
			quern_check_expect(&t->finite, isfinite(partial[o]), "%u-D: %s of %u entries is not finite",
				k->dim, ops->outputs[o].name, n);
			sum[o] = begin ? combined(ops->outputs[o].combine, sum[o], partial[o]) : partial[o];
			size[o] = (begin ? size[o] : 0) + fabs(partial[o]);
		}
	}
	free(partial);
}

typedef struct {
	const check_kernel *k;
	quern_real *partial;
} leaves;

static void one_leaf(void *arg, uint32_t i, uint32_t worker) {
	const leaves *l = arg;
	(void)worker;
	const uint32_t begin = i * LEAF, n = ENTRIES - begin < LEAF ? ENTRIES - begin : LEAF;
	map(l->k, begin, n, l->partial + i * (outputs(l->k->check) + 1));
}

static void try_threads(const check_kernel *k, tallies *t) {
	const uint32_t n = (ENTRIES + LEAF - 1) / LEAF, count = outputs(k->check) + 1;
	leaves alone = { k, quern_take(n * count, sizeof(quern_real)) },
		   many = { k, quern_take(n * count, sizeof(quern_real)) };
	quern_pool *pool = quern_pool_create(4);
	for (uint32_t i = 0; i < n; i++) one_leaf(&alone, i, 0);
	for (int turn = 0; turn < 8; turn++) {
		quern_pool_each(pool, n, one_leaf, &many);
		quern_check_expect(&t->threads, !memcmp(alone.partial, many.partial, n * count * sizeof(quern_real)),
			"%u-D: a leaf differs when several threads map", k->dim);
	}
	quern_pool_destroy(pool);
	free(alone.partial), free(many.partial);
}

static void try_map(const check *c, const check_instance *it, bool optional, tallies *t) {
	static const uint32_t cuts[] = { 1, 7, 64 };
	const quern_observer_ops *ops = c->ops;
	const uint32_t count = outputs(c);
	quern_real *sums = quern_take(4 * count, sizeof *sums);
	check_kernel *k = malloc(sizeof *k);
	if (!k) abort();
	create(c, it, optional, k);
	total(k, LEAF, sums, sums + count, t);
	for (size_t i = 0; i < sizeof cuts / sizeof *cuts; i++) {
		total(k, cuts[i], sums + 2 * count, sums + 3 * count, t);
		for (uint32_t o = 0; o < count; o++)
			quern_check_measure(&t->cuts, fabs(sums[2 * count + o] - sums[o]) / (sums[count + o] + 1e-300),
				1e-11, "%u-D: %s is %.12g from leaves of 256 and %.12g from leaves of %u", it->dim,
				ops->outputs[o].name, sums[o], sums[2 * count + o], cuts[i]);
	}
	try_threads(k, t);
	quern_check_kernel_finish(k);
	free(k), free(sums);
}

static void check_outputs(const check *c) {
	check_tally t = { .name = "outputs" };
	const quern_observer_ops *ops = c->ops;
	for (const quern_output *o = ops->outputs; o && o->name; o++) {
		quern_check_expect(&t, o->doc && *o->doc, "%s: no doc", o->name);
		quern_check_expect(
			&t, quern_check_is_unit(c, o->unit), "%s: '%s' is no unit", o->name, o->unit ? o->unit : "");
		for (const quern_output *other = ops->outputs; other != o; other++)
			quern_check_expect(&t, strcmp(other->name, o->name) != 0, "%s stands twice", o->name);
	}
	quern_check_tell(c, &t, "%u of them%s", outputs(c),
		ops->whole ? "; whole() needs a running scene and is not called" : "");
}

static void law(const check *c) {
	tallies t = { { .name = "partition" }, { .name = "threads" }, { .name = "guards" },
		{ .name = "finite" } };
	const quern_observer_ops *ops = c->ops;
	check_outputs(c);
	for (uint32_t dim = 2; dim <= 3 && ops->map; dim++) {
		check_instance it;
		if (!check_has_dim(c, dim)) continue;
		if (quern_check_instance_create(c, dim, 0, &it) == CHECK_READY)
			for (int optional = 0; optional < 2; optional++) try_map(c, &it, optional, &t);
		quern_check_instance_finish(c, &it);
	}
	if (!ops->map) return;
	quern_check_tell(c, &t.cuts, "leaves of 1, 7, 64 and 256 entries");
	quern_check_tell(c, &t.threads, NULL);
	quern_check_tell(c, &t.guards, NULL);
	quern_check_tell(c, &t.finite, NULL);
}

const check_kind quern_check_observer = { .kind = &quern_observer_kind, .law = law };
