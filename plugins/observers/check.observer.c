/* SPDX-License-Identifier: MIT */
/* check.observer - numbers about a whole set: what leaves give does not depend on who computes them, and sums of parts
 * are sums of the whole */
#include <math.h>
#include <quern/check.h>
#include <quern/observer.h>
#include <stdlib.h>
#include <string.h>

enum { LEAF = 256, ENTRIES = 2000 };

static const quern_output *output(const quern_check *c, uint32_t i) {
	const quern_observer_ops *ops = c->ops;
	return (const quern_output *)(const void *)((const char *)ops->outputs + (size_t)i * ops->output_size);
}

static uint32_t outputs(const quern_check *c) {
	uint32_t n = 0;
	while (output(c, n)->name) n++;
	return n;
}

/* How many numbers an instance gives: `outputs`, as often as they come. */
static uint32_t numbers(const quern_check_kernel *k) {
	const quern_observer_ops *ops = k->ops;
	return outputs(k->check) * (ops->repeat ? ops->repeat(k->self) : 1);
}

static const quern_output *output_of(const quern_check_kernel *k, uint32_t i) {
	return output(k->check, i % outputs(k->check));
}

static void nothing(const quern_check_kernel *k, const quern_check_batch *b) { (void)k, (void)b; }

static quern_check_kernel *create(const quern_check *c, const quern_check_instance *it, bool optional) {
	quern_check_kernel *k = c->host->kernel_create(c, it, "map", ENTRIES);
	k->call = nothing;
	k->host->add_uses(k, 0, optional);
	return k;
}

/* Partials of entries [begin, begin + n), with a guard behind them. */
static bool map(const quern_check_kernel *k, uint32_t begin, uint32_t n, quern_real *partial) {
	const quern_observer_ops *ops = k->ops;
	quern_column use[QUERN_MOST_USES];
	k->host->given_columns(k, begin, k->use, use);
	quern_observer_batch batch = { .n = n, .dim = k->dim, .time = 0.25, .upper = { 1, 1, 1 }, .use = use };
	const uint32_t count = numbers(k);
	batch.gravity[k->dim - 1] = -9.81;
	memset(partial, 0xff, count * sizeof *partial);
	partial[count] = 12345;
	k->host->place(k->check, "map, %u-D, while n = %u", k->dim, n);
	ops->map(k->self, &batch, partial);
	return partial[count] == 12345;
}

static double combined(uint32_t how, double a, double b) {
	if (how == QUERN_SUM) return a + b;
	return how == QUERN_MAX ? (a > b ? a : b) : (a < b ? a : b);
}

typedef struct {
	quern_check_tally cuts, threads, guards, finite;
} tallies;

static void total(const quern_check_kernel *k, uint32_t cut, quern_real *sum, quern_real *size, tallies *t) {
	const uint32_t count = numbers(k);
	quern_real *partial = k->host->memory(count + 1, sizeof *partial);
	for (uint32_t begin = 0; begin < ENTRIES; begin += cut) {
		const uint32_t n = ENTRIES - begin < cut ? ENTRIES - begin : cut;
		k->host->expect(&t->guards, map(k, begin, n, partial),
			"%u-D: more partials are written than there are outputs", k->dim);
		for (uint32_t o = 0; o < count; o++) {
			k->host->expect(&t->finite, isfinite(partial[o]), "%u-D: %s of %u entries is not finite", k->dim,
				output_of(k, o)->name, n);
			sum[o] = begin ? combined(output_of(k, o)->combine, sum[o], partial[o]) : partial[o];
			size[o] = (begin ? size[o] : 0) + fabs(partial[o]);
		}
	}
	free(partial);
}

typedef struct {
	const quern_check_kernel *k;
	quern_real *partial;
} leaves;

static void one_leaf(void *arg, uint32_t i, uint32_t worker) {
	const leaves *l = arg;
	(void)worker;
	const uint32_t begin = i * LEAF, n = ENTRIES - begin < LEAF ? ENTRIES - begin : LEAF;
	map(l->k, begin, n, l->partial + i * (numbers(l->k) + 1));
}

static void try_threads(const quern_check_kernel *k, tallies *t) {
	const uint32_t n = (ENTRIES + LEAF - 1) / LEAF, count = numbers(k) + 1;
	leaves alone = { k, k->host->memory(n * count, sizeof(quern_real)) },
		   many = { k, k->host->memory(n * count, sizeof(quern_real)) };
	for (uint32_t i = 0; i < n; i++) one_leaf(&alone, i, 0);
	for (int turn = 0; turn < 8; turn++) {
		k->host->parallel(k->check, n, one_leaf, &many);
		k->host->expect(&t->threads, !memcmp(alone.partial, many.partial, n * count * sizeof(quern_real)),
			"%u-D: a leaf differs when several threads map", k->dim);
	}
	free(alone.partial), free(many.partial);
}

static void try_map(const quern_check *c, const quern_check_instance *it, bool optional, tallies *t) {
	static const uint32_t cuts[] = { 1, 7, 64 };
	quern_check_kernel *k = create(c, it, optional);
	const uint32_t count = numbers(k);
	quern_real *sums = c->host->memory(4 * count, sizeof *sums);
	total(k, LEAF, sums, sums + count, t);
	for (size_t i = 0; i < sizeof cuts / sizeof *cuts; i++) {
		total(k, cuts[i], sums + 2 * count, sums + 3 * count, t);
		for (uint32_t o = 0; o < count; o++)
			c->host->measure(&t->cuts, fabs(sums[2 * count + o] - sums[o]) / (sums[count + o] + 1e-300),
				1e-11, "%u-D: %s is %.12g from leaves of 256 and %.12g from leaves of %u", it->dim,
				output_of(k, o)->name, sums[o], sums[2 * count + o], cuts[i]);
	}
	try_threads(k, t);
	c->host->kernel_destroy(k);
	free(sums);
}

static void check_outputs(const quern_check *c) {
	quern_check_tally t = { .name = "outputs" };
	const quern_observer_ops *ops = c->ops;
	for (uint32_t i = 0; i < outputs(c); i++) {
		const quern_output *o = output(c, i);
		c->host->expect(&t, o->doc && *o->doc, "%s: no doc", o->name);
		c->host->expect(
			&t, c->host->is_unit(c, o->unit), "%s: '%s' is no unit", o->name, o->unit ? o->unit : "");
		for (uint32_t k = 0; k < i; k++)
			c->host->expect(&t, strcmp(output(c, k)->name, o->name) != 0, "%s stands twice", o->name);
	}
	c->host->tell(c, &t, "%u of them%s", outputs(c),
		ops->whole ? "; whole() needs a running scene and is not called" : "");
}

static void check_repeat(const quern_check *c) {
	quern_check_tally t = { .name = "repeat" };
	const quern_observer_ops *ops = c->ops;
	if (!ops->repeat) return;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		quern_check_instance *it = c->host->instance_create(c, dim, 0);
		const uint32_t n = it ? ops->repeat(it->self) : 1;
		c->host->expect(&t, n >= 1 && n <= 1000, "%u-D: outputs come %u times, not 1 to 1000", dim, n);
		c->host->instance_destroy(it);
	}
	c->host->tell(c, &t, NULL);
}

static void law(const quern_check *c) {
	tallies t = { { .name = "partition" }, { .name = "threads" }, { .name = "guards" },
		{ .name = "finite" } };
	const quern_observer_ops *ops = c->ops;
	check_outputs(c);
	check_repeat(c);
	for (uint32_t dim = 2; dim <= 3 && ops->map; dim++) {
		quern_check_instance *it = c->host->instance_create(c, dim, 0);
		if (it)
			for (int optional = 0; optional < 2; optional++) try_map(c, it, optional, &t);
		c->host->instance_destroy(it);
	}
	if (!ops->map) return;
	c->host->tell(c, &t.cuts, "leaves of 1, 7, 64 and 256 entries");
	c->host->tell(c, &t.threads, NULL);
	c->host->tell(c, &t.guards, NULL);
	c->host->tell(c, &t.finite, NULL);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = { .size = sizeof ops, .kind = &quern_observer_kind, .law = law };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.observer",
	.brief = "Numbers about a set: sums of parts are sums of the whole, whoever computes them.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
