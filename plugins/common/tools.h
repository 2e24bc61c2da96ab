/* SPDX-License-Identifier: MIT */
/* tools - what several solvers need and no plugin author would miss */
#pragma once
#include <quern/columns.h>
#include <quern/solver.h>

/* kg, of a node: less has no inverse, or one that is no number once it is multiplied. A particle on a wall leaves such to the next node. */
#define NO_MASS 1e-290

/* Faster than light by v, or by v times a length: what such a number stands for is not known, but its energy is
 * none. */
static inline bool quern_too_fast(const quern_real v[3], quern_real times) {
	const quern_real light = 299792458;
	quern_real sum = 0;
	for (uint32_t k = 0; k < 3; k++) sum += v[k] / light * times * (v[k] / light * times);
	return !(sum < 1);
}

/* m/s^2 */
static inline quern_real quern_gravity_size(uint32_t dim, const quern_real gravity[3]) {
	quern_real sum = 0;
	for (uint32_t k = 0; k < dim; k++) sum += gravity[k] * gravity[k];
	return __builtin_sqrt(sum);
}

/* Brought back through a periodic face, and inside: what is less than half an ulp below `lower` would round to
 * `upper`. Points may have gone by several periods of a domain that is narrower than a block of cells. */
static inline quern_real quern_brought_back(quern_real x, quern_real lower, quern_real upper) {
	const quern_real length = upper - lower;
	x = x >= upper ? x - length : x;
	x = x < lower ? x + length : x;
	if (x >= upper || x < lower) x -= length * __builtin_floor((x - lower) / length);
	return x >= upper || x < lower ? lower : x;
}

/* Positions become numbers of cells, so none may be far outside: what is fixed may lie beyond the domain by as much as that
 * is wide. */
static inline bool quern_positions_hold(const quern_step *s, const quern_column *x, uint32_t n) {
	for (uint32_t k = 0; k < s->dim; k++) {
		const quern_real width = s->upper[k] - s->lower[k];
		for (uint32_t i = 0; i < n; i++)
			if (!(x->real[k][i] >= s->lower[k] - 1.5 * width && x->real[k][i] <= s->upper[k] + 1.5 * width))
				return false;
	}
	return true;
}
