/* SPDX-License-Identifier: MIT */
/* cloud - grains or points as what they carry: how much each does, and sums over all */
#pragma once
#include <quern/solver.h>

typedef struct cloud {
	const quern_real *mass, *weight; /* kg; the share of it that is carried, NULL: all */
	const int32_t *fixed;            /* not 0: it carries nothing; NULL: all move */
	uint32_t n;
	const char *set; /* "grain", "point" */
} cloud;

/* kg that entry i carries. */
QUERN_INLINE quern_real cloud_mass(const cloud *c, uint32_t i) {
	return (c->fixed && c->fixed[i] ? 0 : 1) * (c->weight ? c->weight[i] : 1) * c->mass[i];
}

/* ---- sums, in the host's fixed order over the set ---- */

typedef struct cloud_sums {
	const quern_host *host;
	quern_run *run;
	const char *set;
	uint32_t n;
	quern_real *mass, *term; /* by entry */
} cloud_sums;

/* False if memory is gone. */
static inline bool cloud_open(cloud_sums *c, const quern_host *host, quern_run *run, const cloud *of) {
	*c = (cloud_sums) { host, run, of->set, of->n, NULL, NULL };
	c->mass = host->memory(run, ((size_t)of->n + 1) * sizeof(quern_real));
	c->term = host->memory(run, ((size_t)of->n + 1) * sizeof(quern_real));
	if (!c->mass || !c->term) return false;
	for (uint32_t i = 0; i < of->n; i++) c->mass[i] = cloud_mass(of, i);
	return true;
}

static inline quern_real cloud_total(const cloud_sums *c) {
	return c->n ? c->host->sum_set(c->run, c->set, c->mass) : 0;
}

/* Adds to `out` the sum of mass times `value`, an expression of i. */
#define CLOUD_ADD(sums, i, value, out)                                                                       \
	do {                                                                                                     \
		const cloud_sums *sums_ = (sums);                                                                    \
		for (uint32_t i = 0; i < sums_->n; i++) sums_->term[i] = sums_->mass[i] * (value);                   \
		if (sums_->n) (out) += sums_->host->sum_set(sums_->run, sums_->set, sums_->term);                    \
	} while (0)

/* ---- what is summed ---- */

/* The square of vector i, of n components. */
QUERN_INLINE quern_real cloud_square(const quern_column *v, uint32_t i, uint32_t n) {
	quern_real sum = 0;
	for (uint32_t k = 0; k < n; k++) sum += v->real[k][i] * v->real[k][i];
	return sum;
}

/* J/kg that position i has by gravity. */
QUERN_INLINE quern_real cloud_height(
	const quern_column *x, uint32_t i, uint32_t dim, const quern_real gravity[3]) {
	quern_real sum = 0;
	for (uint32_t k = 0; k < dim; k++) sum -= gravity[k] * x->real[k][i];
	return sum;
}
