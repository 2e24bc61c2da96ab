/* SPDX-License-Identifier: MIT */
/* quern_check_coupling - exchanges at nodes: momentum is kept, equal velocities stay, no energy is gained */
#include "check.h"
#include <math.h>
#include <quern/coupling.h>
#include <stdlib.h>

enum { MASS, OTHER_MASS, VELOCITY, OTHER };
enum { ORDINARY, UNEQUAL, TOGETHER, VARIANTS };

static void call(const check_kernel *k, const check_batch *b) {
	const quern_coupling_ops *ops = k->ops;
	quern_coupling_job job = { .dim = k->dim, .n = b->n };
	job.mass = check_at(k, b, MASS, 0);
	job.other_mass = check_at(k, b, OTHER_MASS, 0);
	CHECK_VECTOR(job.velocity, k, b, VELOCITY, k->dim);
	CHECK_VECTOR(job.other, k, b, OTHER, k->dim);
	ops->couple(k->instance->self, &job);
}

static bool make(const check *c, const check_instance *it, uint32_t variant, uint32_t n, check_kernel *k) {
	if (variant >= VARIANTS) return false;
	const double decades = variant == UNEQUAL ? 12 : 1;
	quern_check_kernel_init(k, c, it, "couple", n);
	k->call = call;
	quern_check_add(k, MASS, "mass", CHECK_IN, 1);
	quern_check_add(k, OTHER_MASS, "other_mass", CHECK_IN, 1);
	quern_check_add(k, VELOCITY, "velocity", CHECK_CHANGED, k->dim);
	quern_check_add(k, OTHER, "other", CHECK_CHANGED, k->dim);
	for (uint32_t i = 0; i < n; i++) {
		quern_check_given(k, MASS, 0)[i] = pow(10, quern_check_uniform(100, i, -decades, 0));
		quern_check_given(k, OTHER_MASS, 0)[i] = pow(10, quern_check_uniform(101, i, -decades, 0));
	}
	quern_check_fill(k, VELOCITY, k->dim, 102, -2, 2);
	quern_check_fill(k, OTHER, k->dim, variant == TOGETHER ? 102 : 103, -2, 2);
	return true;
}

static void check_node(const check_kernel *k, uint32_t variant, uint32_t i, check_tally t[3]) {
	const double m = quern_check_given(k, MASS, 0)[i], n = quern_check_given(k, OTHER_MASS, 0)[i];
	double before = 0, after = 0;
	for (uint32_t a = 0; a < k->dim; a++) {
		const double v = quern_check_given(k, VELOCITY, a)[i], w = quern_check_given(k, OTHER, a)[i];
		const double v1 = quern_check_found(k, VELOCITY, a)[i], w1 = quern_check_found(k, OTHER, a)[i];
		quern_check_measure(&t[0], fabs(m * v + n * w - m * v1 - n * w1) / (m * fabs(v) + n * fabs(w)), 1e-14,
			"%u-D: masses of %.3g and %.3g kg: momentum %.15g becomes %.15g kg m/s", k->dim, m, n,
			m * v + n * w, m * v1 + n * w1);
		if (variant == TOGETHER)
			quern_check_measure(&t[1], fabs(v1 - v) + fabs(w1 - w), 1e-14,
				"%u-D: %.15g m/s on both sides becomes %.15g and %.15g", k->dim, v, v1, w1);
		before += m * v * v + n * w * w;
		after += m * v1 * v1 + n * w1 * w1;
	}
	quern_check_measure(
		&t[2], after / before - 1, 1e-13, "%u-D: %.15g J become %.15g", k->dim, before / 2, after / 2);
}

static void law(const check *c) {
	check_tally t[3] = { { .name = "momentum node by node" }, { .name = "equal velocities stay" },
		{ .name = "no energy gained" } };
	check_kernel *k = malloc(sizeof *k);
	if (!k) abort();
	for (uint32_t dim = 2; dim <= 3; dim++) {
		check_instance it;
		if (!check_has_dim(c, dim)) continue;
		if (quern_check_instance_create(c, dim, 0, &it) == CHECK_READY)
			for (uint32_t variant = 0; make(c, &it, variant, 2000, k); variant++) {
				quern_check_run(k, 64, NULL);
				for (uint32_t i = 0; i < k->n; i++) check_node(k, variant, i, t);
				quern_check_kernel_finish(k);
			}
		quern_check_instance_finish(c, &it);
	}
	free(k);
	for (int i = 0; i < 3; i++) quern_check_tell(c, &t[i], NULL);
}

const check_kind quern_check_coupling = { .kind = &quern_coupling_kind, .make = make, .law = law };
