/* SPDX-License-Identifier: MIT */
/* quern_check_shape - shape functions: they sum to one, reproduce a line, know their slopes and stay inside walls */
#include "check.h"
#include <math.h>
#include <quern/shape.h>
#include <stdlib.h>

enum { POSITION, FIRST_X, FIRST_Y, FIRST_Z, VALUE, SLOPE };
enum { CELLS = 12 };
static const double cell = 4e-3;

static const int32_t walls[][2] = { { INT32_MIN, INT32_MAX }, { 0, CELLS }, { 0, INT32_MAX },
	{ INT32_MIN, CELLS } };

static void call(const check_kernel *k, const check_batch *b) {
	const quern_shape_ops *ops = k->ops;
	quern_shape_batch batch = { .n = b->n, .cap = b->cap, .dim = k->dim, .inverse_cell = 1 / cell };
	for (uint32_t a = 0; a < k->dim; a++) {
		batch.position[a] = check_at(k, b, POSITION, a);
		batch.first[a] = check_at(k, b, FIRST_X + (int)a, 0);
		for (uint32_t node = 0; node < 3; node++) {
			batch.value[a][node] = check_at(k, b, VALUE, 3 * a + node);
			batch.slope[a][node] = check_at(k, b, SLOPE, 3 * a + node);
		}
		for (int side = 0; side < 2; side++) batch.wall[a][side] = walls[k->pass][side];
	}
	ops->weights(k->instance->self, &batch);
}

/* Everywhere, close to walls and on nodes. */
static double place(uint64_t key, uint32_t i) {
	const double whole = floor(quern_check_uniform(key + 9, i, 0, CELLS + 0.999));
	if (i % 16 == 0) return whole * cell;
	if (i % 4 == 1) return quern_check_uniform(key, i, 0, 0.6 * cell);
	if (i % 4 == 2) return CELLS * cell - quern_check_uniform(key, i, 0, 0.6 * cell);
	return quern_check_uniform(key, i, 0, CELLS * cell);
}

static bool make(const check *c, const check_instance *it, uint32_t variant, uint32_t n, check_kernel *k) {
	if (variant >= sizeof walls / sizeof *walls) return false;
	quern_check_kernel_init(k, c, it, "weights", n);
	k->call = call;
	k->pass = variant;
	quern_check_add(k, POSITION, "position", CHECK_IN, k->dim);
	for (uint32_t a = 0; a < k->dim; a++) {
		quern_check_add_integers(k, FIRST_X + (int)a, "first", CHECK_OUT);
		for (uint32_t i = 0; i < n; i++) quern_check_given(k, POSITION, a)[i] = place(80 + a, i);
	}
	quern_check_add(k, VALUE, "value", CHECK_OUT, 3 * k->dim);
	quern_check_add(k, SLOPE, "slope", CHECK_OUT, 3 * k->dim);
	return true;
}

typedef struct {
	check_tally unity, line, slopes, support, smooth, shares;
} tallies;

static void check_point(const check_kernel *k, uint32_t a, uint32_t i, tallies *t) {
	const int32_t first = ((const int32_t *)(const void *)quern_check_found(k, FIRST_X + (int)a, 0))[i];
	const double x = quern_check_given(k, POSITION, a)[i], at = x / cell;
	double sum = 0, line = 0, slopes = 0, gradient = 0;
	for (uint32_t node = 0; node < 3; node++) {
		const double v = quern_check_found(k, VALUE, 3 * a + node)[i],
					 g = quern_check_found(k, SLOPE, 3 * a + node)[i];
		const int32_t index = first + (int32_t)node;
		sum += v, slopes += g * cell;
		line += v * (index - at), gradient += g * cell * (index - at);
		const bool used = v != 0 || g != 0;
		const bool beyond = (walls[k->pass][0] != INT32_MIN && index < 0) ||
							(walls[k->pass][1] != INT32_MAX && index > CELLS);
		quern_check_expect(&t->support, !used || !beyond,
			"%u-D: at x = %.6g cells node %d, behind a wall, has weight %.3g", k->dim, at, index, v);
		quern_check_expect(&t->support, !used || (index >= floor(at) - 1 && index <= floor(at) + 2),
			"%u-D: at x = %.6g cells node %d has weight: farther than a tile reaches", k->dim, at, index);
		quern_check_expect(
			&t->support, v >= -1e-12, "%u-D: at x = %.6g cells a weight of %.3g", k->dim, at, v);
	}
	quern_check_measure(
		&t->unity, fabs(sum - 1), 1e-13, "%u-D: at x = %.6g cells weights sum to %.15g", k->dim, at, sum);
	quern_check_measure(
		&t->line, fabs(line), 1e-13, "%u-D: at x = %.6g cells a line is off by %.3g", k->dim, at, line);
	quern_check_measure(&t->line, fabs(gradient - 1), 1e-12,
		"%u-D: at x = %.6g cells the slope of a line is %.15g", k->dim, at, gradient);
	quern_check_measure(
		&t->slopes, fabs(slopes), 1e-12, "%u-D: at x = %.6g cells slopes sum to %.3g", k->dim, at, slopes);
}

/* Weight and slope of one node at one place. */
static double weight_of(const check_kernel *k, uint32_t i, int32_t node, double *slope) {
	const int32_t first = ((const int32_t *)(const void *)quern_check_found(k, FIRST_X, 0))[i];
	*slope = 0;
	if (node < first || node > first + 2) return 0;
	*slope = quern_check_found(k, SLOPE, (uint32_t)(node - first))[i];
	return quern_check_found(k, VALUE, (uint32_t)(node - first))[i];
}

/* Integrals over the nodes at a wall, and slopes as the mean of derivatives: both by walking from node to node. */
static void check_walk(const check *c, const check_instance *it, tallies *t) {
	enum { STEPS = 6000 };
	check_kernel *k = malloc(sizeof *k);
	if (!k) abort();
	const quern_shape_ops *ops = c->ops;
	double sum[2] = { 0 }, before[CELLS + 1], share[2], slope;
	make(c, it, 1, STEPS, k);
	for (uint32_t i = 0; i < STEPS; i++)
		quern_check_given(k, POSITION, 0)[i] = (i + 0.5) * CELLS * cell / STEPS;
	quern_check_run(k, 512, NULL);
	for (uint32_t i = 0; i < STEPS; i++)
		for (int32_t node = 0; node <= CELLS; node++) {
			const double v = weight_of(k, i, node, &slope), way = CELLS * cell / STEPS;
			if (node < 2) sum[node] += v * CELLS / STEPS;
			if (i) /* a jump shows as a change that no slope within reach explains */
				quern_check_measure(&t->smooth, fabs(v - before[node]), 2.5 * way / cell,
					"%u-D: the weight of node %d jumps by %.3g at x = %.6g cells", it->dim, node,
					v - before[node], (double)i * CELLS / STEPS);
			before[node] = v;
		}
	ops->shares(it->self, &share[0], &share[1]);
	for (int i = 0; i < 2; i++)
		quern_check_measure(&t->shares, fabs(sum[i] - share[i]), 1e-4,
			"%u-D: shares() says %.6g of a cell, the integral %.6g", it->dim, share[i], sum[i]);
	quern_check_expect(&t->shares, ops->stiffness(it->self) > 0 && isfinite(ops->stiffness(it->self)),
		"stiffness is %.3g", ops->stiffness(it->self));
	quern_check_kernel_finish(k);
	free(k);
}

static void law(const check *c) {
	tallies t = { { .name = "partition of unity" }, { .name = "linear completeness" },
		{ .name = "slopes sum to zero" }, { .name = "support and walls" }, { .name = "no jumps" },
		{ .name = "shares and stiffness" } };
	check_kernel *k = malloc(sizeof *k);
	if (!k) abort();
	for (uint32_t dim = 2; dim <= 3; dim++) {
		check_instance it;
		if (!check_has_dim(c, dim)) continue;
		if (quern_check_instance_create(c, dim, 0, &it) == CHECK_READY) {
			for (uint32_t variant = 0; make(c, &it, variant, 2000, k); variant++) {
				quern_check_run(k, 512, NULL);
				for (uint32_t a = 0; a < dim; a++)
					for (uint32_t i = 0; i < k->n; i++) check_point(k, a, i, &t);
				quern_check_kernel_finish(k);
			}
			check_walk(c, &it, &t);
		}
		quern_check_instance_finish(c, &it);
	}
	free(k);
	quern_check_tell(c, &t.unity, NULL);
	quern_check_tell(c, &t.line, NULL);
	quern_check_tell(c, &t.slopes, NULL);
	quern_check_tell(c, &t.support, NULL);
	quern_check_tell(c, &t.smooth, NULL);
	quern_check_tell(c, &t.shares, NULL);
}

const check_kind quern_check_shape = { .kind = &quern_shape_kind, .make = make, .law = law };
