/* SPDX-License-Identifier: MIT */
/* check.strain - cells of points with gradients of their own: one gradient for all stays, a cell takes the room that it took, and gradients do
 * not grow */
#include <math.h>
#include <quern/check.h>
#include <quern/strain.h>
#include <stdlib.h>

enum { GRADIENT, MEASURED, MEAN };
enum { MEASURE, APPLY, VARIANTS };
enum { CELLS = 200, EACH = 8, POINTS = CELLS * EACH };

static void call(const quern_check_kernel *k, const quern_check_batch *b) {
	const quern_strain_ops *ops = k->ops;
	quern_column use[QUERN_MOST_USES];
	quern_strain_batch batch = { .n = b->n, .cap = b->cap, .dt = k->dt, .use = use };
	QUERN_CHECK_VECTOR(batch.gradient, k, b, GRADIENT, k->dim * k->dim);
	if (quern_check_has(k, MEASURED)) QUERN_CHECK_VECTOR(batch.measured, k, b, MEASURED, ops->means);
	if (quern_check_has(k, MEAN)) QUERN_CHECK_VECTOR(batch.mean, k, b, MEAN, ops->means);
	k->host->columns(k, b, k->use, use);
	(k->pass == MEASURE ? ops->measure : ops->apply)[k->dim - 2](k->self, &batch);
}

static bool has(const quern_check *c, uint32_t variant, uint32_t dim) {
	const quern_strain_ops *ops = c->ops;
	/* the solver refuses one with more means than there is room for, or with means and nothing that measures */
	if (ops->means > QUERN_STRAIN_MOST || (ops->means > 0 && !ops->measure[dim - 2])) return false;
	return variant == MEASURE ? ops->means > 0 : ops->apply[dim - 2] != NULL;
}

static quern_check_kernel *create(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	const uint32_t means = ((const quern_strain_ops *)c->ops)->means;
	quern_check_kernel *k = c->host->kernel_create(c, it, variant == MEASURE ? "measure" : "apply", n);
	k->call = call;
	k->pass = variant;
	c->host->add(
		k, GRADIENT, "gradient", variant == MEASURE ? QUERN_CHECK_IN : QUERN_CHECK_CHANGED, k->dim * k->dim);
	c->host->fill(k, GRADIENT, k->dim * k->dim, 110, -1, 1);
	if (variant == MEASURE) c->host->add(k, MEASURED, "measured", QUERN_CHECK_OUT, means);
	else if (means) c->host->add(k, MEAN, "mean", QUERN_CHECK_IN, means);
	if (variant == APPLY && means) c->host->fill(k, MEAN, means, 111, -1, 1);
	c->host->add_uses(k, 0, true);
	return k;
}

static quern_check_kernel *make(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	uint32_t there = 0;
	for (uint32_t v = 0; v < VARIANTS; v++)
		if (has(c, v, it->dim) && there++ == variant) return create(c, it, v, n);
	return NULL;
}

/* m^3, of a point. */
static double room(const quern_check_host *host, uint32_t i) { return host->uniform(112, i, 0.2, 2); }

/* What the solver does: means of what is measured, by volume, over the cells of EACH points. */
static void give_means(
	const quern_check *c, const quern_check_kernel *measured, const quern_check_kernel *k) {
	for (uint32_t a = 0; a < ((const quern_strain_ops *)c->ops)->means; a++)
		for (uint32_t cell = 0; cell < CELLS; cell++) {
			double sum = 0, all = 0;
			for (uint32_t i = cell * EACH; i < (cell + 1) * EACH; i++) {
				sum += room(c->host, i) * quern_check_found(measured, MEASURED, a)[i];
				all += room(c->host, i);
			}
			for (uint32_t i = cell * EACH; i < (cell + 1) * EACH; i++)
				quern_check_given(k, MEAN, a)[i] = sum / all;
		}
}

/* Every second cell has one gradient. */
static void even_out(const quern_check_kernel *k) {
	for (uint32_t a = 0; a < k->dim * k->dim; a++)
		for (uint32_t i = 0; i < POINTS; i++)
			if (i / EACH % 2)
				quern_check_given(k, GRADIENT, a)[i] = quern_check_given(k, GRADIENT, a)[i / EACH * EACH];
}

typedef struct {
	quern_check_tally uniform, volume, power;
} tallies;

static void check_cell(const quern_check_kernel *k, uint32_t cell, tallies *t) {
	double before = 0, after = 0, square = 0, squared = 0, moved = 0, size = 0;
	for (uint32_t i = cell * EACH; i < (cell + 1) * EACH; i++)
		for (uint32_t a = 0; a < k->dim * k->dim; a++) {
			const double was = quern_check_given(k, GRADIENT, a)[i],
						 is = quern_check_found(k, GRADIENT, a)[i], v = room(k->host, i);
			const bool trace = a % (k->dim + 1) == 0;
			before += trace ? v * was : 0, after += trace ? v * is : 0, size += v * fabs(was);
			square += v * was * was, squared += v * is * is;
			moved = fmax(moved, fabs(is - was));
		}
	if (cell % 2)
		k->host->measure(&t->uniform, moved, 1e-13,
			"%u-D: one gradient for all points of a cell moves by %.3g 1/s", k->dim, moved);
	k->host->measure(&t->volume, fabs(after - before) / size, 1e-13,
		"%u-D: the volume of a cell grew by %.15g m^3/s, and grows by %.15g", k->dim, before, after);
	k->host->measure(&t->power, squared / square - 1, 1e-13,
		"%u-D: volume times squared gradient was %.9g in a cell, and is %.9g", k->dim, square, squared);
}

static void law(const quern_check *c) {
	tallies t = { { .name = "one gradient for all stays" }, { .name = "volume of cells" },
		{ .name = "gradients do not grow" } };
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (uint64_t setting = 0; setting < c->host->settings(c); setting++) {
			quern_check_instance *it = c->host->instance_create(c, dim, setting);
			if (it && has(c, APPLY, dim)) {
				quern_check_kernel *k = create(c, it, APPLY, POINTS);
				even_out(k);
				if (has(c, MEASURE, dim)) {
					quern_check_kernel *measured = create(c, it, MEASURE, POINTS);
					even_out(measured);
					c->host->run(measured, 64, false);
					give_means(c, measured, k);
					c->host->kernel_destroy(measured);
				}
				c->host->run(k, 64, false);
				for (uint32_t cell = 0; cell < CELLS; cell++) check_cell(k, cell, &t);
				c->host->kernel_destroy(k);
			}
			c->host->instance_destroy(it);
		}
	c->host->tell(c, &t.uniform, NULL);
	c->host->tell(c, &t.volume, NULL);
	c->host->tell(c, &t.power, NULL);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = {
	.size = sizeof ops, .kind = &quern_strain_kind, .make = make, .law = law
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.strain",
	.brief = "Gradients of the points of a cell: one for all stays, volume is kept, and they do not grow.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
