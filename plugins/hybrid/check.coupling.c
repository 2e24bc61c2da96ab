/* SPDX-License-Identifier: MIT */
/* check.coupling - exchanges at nodes: momentum is kept, equal velocities stay, no energy is gained */
#include <math.h>
#include <quern/check.h>
#include <quern/coupling.h>
#include <stdlib.h>

enum { MASS, OTHER_MASS, VELOCITY, OTHER };
enum { ORDINARY, UNEQUAL, TOGETHER, VARIANTS };

static void call(const quern_check_kernel *k, const quern_check_batch *b) {
	const quern_coupling_ops *ops = k->ops;
	quern_coupling_job job = { .dim = k->dim, .n = b->n };
	job.mass = quern_check_at(k, b, MASS, 0);
	job.other_mass = quern_check_at(k, b, OTHER_MASS, 0);
	QUERN_CHECK_VECTOR(job.velocity, k, b, VELOCITY, k->dim);
	QUERN_CHECK_VECTOR(job.other, k, b, OTHER, k->dim);
	ops->couple(k->self, &job);
}

static quern_check_kernel *make(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	if (variant >= VARIANTS) return NULL;
	const double decades = variant == UNEQUAL ? 12 : 1;
	quern_check_kernel *k = c->host->kernel_create(c, it, "couple", n);
	k->call = call;
	c->host->add(k, MASS, "mass", QUERN_CHECK_IN, 1);
	c->host->add(k, OTHER_MASS, "other_mass", QUERN_CHECK_IN, 1);
	c->host->add(k, VELOCITY, "velocity", QUERN_CHECK_CHANGED, k->dim);
	c->host->add(k, OTHER, "other", QUERN_CHECK_CHANGED, k->dim);
	for (uint32_t i = 0; i < n; i++) {
		quern_check_given(k, MASS, 0)[i] = pow(10, c->host->uniform(100, i, -decades, 0));
		quern_check_given(k, OTHER_MASS, 0)[i] = pow(10, c->host->uniform(101, i, -decades, 0));
	}
	c->host->fill(k, VELOCITY, k->dim, 102, -2, 2);
	c->host->fill(k, OTHER, k->dim, variant == TOGETHER ? 102 : 103, -2, 2);
	return k;
}

static void check_node(const quern_check_kernel *k, uint32_t variant, uint32_t i, quern_check_tally t[3]) {
	const double m = quern_check_given(k, MASS, 0)[i], n = quern_check_given(k, OTHER_MASS, 0)[i];
	double before = 0, after = 0;
	for (uint32_t a = 0; a < k->dim; a++) {
		const double v = quern_check_given(k, VELOCITY, a)[i], w = quern_check_given(k, OTHER, a)[i];
		const double v1 = quern_check_found(k, VELOCITY, a)[i], w1 = quern_check_found(k, OTHER, a)[i];
		k->host->measure(&t[0], fabs(m * v + n * w - m * v1 - n * w1) / (m * fabs(v) + n * fabs(w)), 1e-14,
			"%u-D: masses of %.3g and %.3g kg: momentum %.15g becomes %.15g kg m/s", k->dim, m, n,
			m * v + n * w, m * v1 + n * w1);
		if (variant == TOGETHER)
			k->host->measure(&t[1], fabs(v1 - v) + fabs(w1 - w), 1e-14,
				"%u-D: %.15g m/s on both sides becomes %.15g and %.15g", k->dim, v, v1, w1);
		before += m * v * v + n * w * w;
		after += m * v1 * v1 + n * w1 * w1;
	}
	k->host->measure(
		&t[2], after / before - 1, 1e-13, "%u-D: %.15g J become %.15g", k->dim, before / 2, after / 2);
}

static void law(const quern_check *c) {
	quern_check_tally t[3] = { { .name = "momentum node by node" }, { .name = "equal velocities stay" },
		{ .name = "no energy gained" } };
	for (uint32_t dim = 2; dim <= 3; dim++) {
		quern_check_instance *it = c->host->instance_create(c, dim, 0);
		quern_check_kernel *k;
		for (uint32_t variant = 0; it && (k = make(c, it, variant, 2000)); variant++) {
			c->host->run(k, 64, false);
			for (uint32_t i = 0; i < k->n; i++) check_node(k, variant, i, t);
			c->host->kernel_destroy(k);
		}
		c->host->instance_destroy(it);
	}
	for (int i = 0; i < 3; i++) c->host->tell(c, &t[i], NULL);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = {
	.size = sizeof ops, .kind = &quern_coupling_kind, .make = make, .law = law
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.coupling",
	.brief = "Exchanges at nodes: momentum is kept, equal velocities stay, no energy is gained.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
