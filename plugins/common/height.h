/* SPDX-License-Identifier: MIT */
/* height - how high the material lies at the start: the extent of all loose fills together along the axis on which
 * gravity is strongest. One definition for whoever needs it. */
#pragma once
#include <math.h>
#include <quern/solver.h>

/* The axis along which gravity acts most; the last one where there is none. */
static inline uint32_t quern_vertical(uint32_t dim, const quern_real gravity[3]) {
	uint32_t axis = dim - 1;
	for (uint32_t k = 0; k < dim; k++)
		if (fabs(gravity[k]) > fabs(gravity[axis])) axis = k;
	return axis;
}

typedef struct fill_height {
	uint32_t axis;
	quern_real lower, upper; /* m, of all boxes so far */
} fill_height;

static inline fill_height fill_height_of(const quern_setup *setup) {
	return (fill_height) { quern_vertical(setup->dim, setup->gravity), INFINITY, -INFINITY };
}
static inline void fill_height_add(fill_height *h, const quern_real lower[3], const quern_real upper[3]) {
	h->lower = lower[h->axis] < h->lower ? lower[h->axis] : h->lower;
	h->upper = upper[h->axis] > h->upper ? upper[h->axis] : h->upper;
}
/* m; 0 if there is no fill */
static inline quern_real fill_height_all(const fill_height *h) {
	return h->upper > h->lower ? h->upper - h->lower : 0;
}
