/* SPDX-License-Identifier: MIT */
/* check.shape - shape functions: they sum to one, reproduce a line, know their slopes and stay inside walls */
#include <math.h>
#include <quern/check.h>
#include <quern/shape.h>
#include <stdlib.h>

enum { POSITION, FIRST_X, FIRST_Y, FIRST_Z, VALUE, SLOPE };
enum { CELLS = 12 };
static const double cell = 4e-3;

static const int32_t walls[][2] = { { INT32_MIN, INT32_MAX }, { 0, CELLS }, { 0, INT32_MAX },
	{ INT32_MIN, CELLS } };

static void call(const quern_check_kernel *k, const quern_check_batch *b) {
	const quern_shape_ops *ops = k->ops;
	quern_shape_batch batch = { .n = b->n, .cap = b->cap, .dim = k->dim, .inverse_cell = 1 / cell };
	for (uint32_t a = 0; a < k->dim; a++) {
		batch.position[a] = quern_check_at(k, b, POSITION, a);
		batch.first[a] = quern_check_integers_at(k, b, FIRST_X + (int)a);
		for (uint32_t node = 0; node < 3; node++) {
			batch.value[a][node] = quern_check_at(k, b, VALUE, 3 * a + node);
			batch.slope[a][node] = quern_check_at(k, b, SLOPE, 3 * a + node);
		}
		for (int side = 0; side < 2; side++) batch.wall[a][side] = walls[k->pass][side];
	}
	ops->weights(k->self, &batch);
}

/* Everywhere, close to walls, on nodes, and beyond walls by round-off. */
static double place(const quern_check_host *host, uint64_t key, uint32_t i) {
	const double whole = floor(host->uniform(key + 9, i, 0, CELLS + 0.999));
	if (i % 64 == 16) return -1e-15 * cell;
	if (i % 64 == 32) return (CELLS + 4e-15) * cell;
	if (i % 16 == 0) return whole * cell;
	if (i % 4 == 1) return host->uniform(key, i, 0, 0.6 * cell);
	if (i % 4 == 2) return CELLS * cell - host->uniform(key, i, 0, 0.6 * cell);
	return host->uniform(key, i, 0, CELLS * cell);
}

static quern_check_kernel *make(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	if (variant >= sizeof walls / sizeof *walls) return NULL;
	quern_check_kernel *k = c->host->kernel_create(c, it, "weights", n);
	k->call = call;
	k->pass = variant;
	c->host->add(k, POSITION, "position", QUERN_CHECK_IN, k->dim);
	for (uint32_t a = 0; a < k->dim; a++) {
		c->host->add_integers(k, FIRST_X + (int)a, "first", QUERN_CHECK_OUT);
		for (uint32_t i = 0; i < n; i++) quern_check_given(k, POSITION, a)[i] = place(c->host, 80 + a, i);
	}
	c->host->add(k, VALUE, "value", QUERN_CHECK_OUT, 3 * k->dim);
	c->host->add(k, SLOPE, "slope", QUERN_CHECK_OUT, 3 * k->dim);
	return k;
}

typedef struct {
	quern_check_tally unity, line, slopes, support, smooth, shares;
} tallies;

static void check_point(const quern_check_kernel *k, uint32_t a, uint32_t i, tallies *t) {
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
		k->host->expect(&t->support, !used || !beyond,
			"%u-D: at x = %.6g cells node %d, behind a wall, has weight %.3g", k->dim, at, index, v);
		k->host->expect(&t->support, !used || (index >= floor(at) - 1 && index <= floor(at) + 2),
			"%u-D: at x = %.6g cells node %d has weight: farther than a tile reaches", k->dim, at, index);
		k->host->expect(&t->support, v >= -1e-12, "%u-D: at x = %.6g cells a weight of %.3g", k->dim, at, v);
	}
	k->host->measure(
		&t->unity, fabs(sum - 1), 1e-13, "%u-D: at x = %.6g cells weights sum to %.15g", k->dim, at, sum);
	k->host->measure(
		&t->line, fabs(line), 1e-13, "%u-D: at x = %.6g cells a line is off by %.3g", k->dim, at, line);
	k->host->measure(&t->line, fabs(gradient - 1), 1e-12,
		"%u-D: at x = %.6g cells the slope of a line is %.15g", k->dim, at, gradient);
	k->host->measure(
		&t->slopes, fabs(slopes), 1e-12, "%u-D: at x = %.6g cells slopes sum to %.3g", k->dim, at, slopes);
}

/* Weight and slope of one node at one place. */
static double weight_of(const quern_check_kernel *k, uint32_t i, int32_t node, double *slope) {
	const int32_t first = ((const int32_t *)(const void *)quern_check_found(k, FIRST_X, 0))[i];
	*slope = 0;
	if (node < first || node > first + 2) return 0;
	*slope = quern_check_found(k, SLOPE, (uint32_t)(node - first))[i];
	return quern_check_found(k, VALUE, (uint32_t)(node - first))[i];
}

/* Nodes from a wall on, and places from which on their functions are summed up, in cells. */
enum { NEAR = 4, CUTS = 17 };
/* The whole of a function is its integral; parts may be those of boxes that points stand for. */
static const double most_of_boxes = 0.05;
static double cut_at(int cut) { return 0.25 * (cut - CUTS / 2); }

/* Integrals over the nodes at a wall, and slopes as the mean of derivatives: both by walking from node to node. */
static void check_walk(const quern_check *c, const quern_check_instance *it, tallies *t) {
	enum { STEPS = 6000 };
	quern_check_kernel *k = make(c, it, 1, STEPS);
	const quern_shape_ops *ops = c->ops;
	double above[NEAR][CUTS] = { { 0 } }, before[CELLS + 1], share[2], slope;
	for (uint32_t i = 0; i < STEPS; i++)
		quern_check_given(k, POSITION, 0)[i] = (i + 0.5) * CELLS * cell / STEPS;
	c->host->run(k, 512, false);
	for (uint32_t i = 0; i < STEPS; i++)
		for (int32_t node = 0; node <= CELLS; node++) {
			const double v = weight_of(k, i, node, &slope), way = CELLS * cell / STEPS;
			for (int cut = 0; cut < CUTS && node < NEAR; cut++)
				if ((i + 0.5) * CELLS / STEPS - node > cut_at(cut)) above[node][cut] += v * CELLS / STEPS;
			if (i) /* a jump shows as a change that no slope within reach explains */
				c->host->measure(&t->smooth, fabs(v - before[node]), 2.5 * way / cell,
					"%u-D: the weight of node %d jumps by %.3g at x = %.6g cells", it->dim, node,
					v - before[node], (double)i * CELLS / STEPS);
			before[node] = v;
		}
	ops->shares(it->self, &share[0], &share[1]);
	for (int node = 0; node < 2; node++)
		c->host->measure(&t->shares, fabs(above[node][0] - share[node]), 1e-4,
			"%u-D: shares() says %.6g of a cell, the integral %.6g", it->dim, share[node], above[node][0]);
	for (int node = 0; node < NEAR && ops->beyond; node++)
		for (int cut = 0; cut < CUTS; cut++) {
			const double part = ops->beyond(it->self, node, cut_at(cut)),
						 allowed = cut ? most_of_boxes : 1e-4;
			c->host->measure(&t->shares, fabs(above[node][cut] - part), allowed,
				"%u-D: %d cells above a wall beyond() says %.6g from %.2f cells on, the integral %.6g",
				it->dim, node, part, cut_at(cut), above[node][cut]);
		}
	c->host->expect(&t->shares, ops->stiffness(it->self) > 0 && isfinite(ops->stiffness(it->self)),
		"stiffness is %.3g", ops->stiffness(it->self));
	c->host->expect(&t->shares, ops->light >= 0 && ops->light <= 0.1,
		"a node is light below %.3g of a cell, of 0 to 0.1", ops->light);
	c->host->kernel_destroy(k);
}

static void law(const quern_check *c) {
	tallies t = { { .name = "partition of unity" }, { .name = "linear completeness" },
		{ .name = "slopes sum to zero" }, { .name = "support and walls" }, { .name = "no jumps" },
		{ .name = "shares and stiffness" } };
	quern_check_kernel *k;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		quern_check_instance *it = c->host->instance_create(c, dim, 0);
		if (it) {
			for (uint32_t variant = 0; (k = make(c, it, variant, 2000)); variant++) {
				c->host->run(k, 512, false);
				for (uint32_t a = 0; a < dim; a++)
					for (uint32_t i = 0; i < k->n; i++) check_point(k, a, i, &t);
				c->host->kernel_destroy(k);
			}
			check_walk(c, it, &t);
		}
		c->host->instance_destroy(it);
	}
	c->host->tell(c, &t.unity, NULL);
	c->host->tell(c, &t.line, NULL);
	c->host->tell(c, &t.slopes, NULL);
	c->host->tell(c, &t.support, NULL);
	c->host->tell(c, &t.smooth, NULL);
	c->host->tell(c, &t.shares, NULL);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = {
	.size = sizeof ops, .kind = &quern_shape_kind, .make = make, .law = law
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.shape",
	.brief = "Shape functions: they sum to one, reproduce a line, know their slopes and stay inside walls.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
