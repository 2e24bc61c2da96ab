/* SPDX-License-Identifier: MIT */
/* quern/space.h - where things are: cells along a line, and nearest images where the domain is periodic */
#pragma once
#include <quern/vec.h>

/* ==== cells along a line ==== */

/* Cell of a place: how many lie between it and `lower`, where `inverse` of them fit into a metre; negative below. */
QUERN_INLINE int32_t quern_cell_along(quern_real x, quern_real lower, quern_real inverse) {
	const quern_real t = (x - lower) * inverse;
	const int32_t down = (int32_t)t;
	return down - (t < (quern_real)down);
}

/* The same cell as one of 0 .. n - 1, where the line closes to a ring of n. */
QUERN_INLINE int32_t quern_cell_wrapped(int32_t c, int32_t n) {
	const int32_t rest = c % n;
	return rest < 0 ? rest + n : rest;
}

/* The nearest of the cells 0 .. n - 1. */
QUERN_INLINE int32_t quern_cell_held(int32_t c, int32_t n) { return c < 0 ? 0 : c < n ? c : n - 1; }

/* ==== nearest images ==== */

/* Half of the domain's length and the length, by axis; infinite and 0 where it is not periodic: no kernel has to
 * ask. */
typedef struct quern_images {
	quern_real half[3], length[3];
} quern_images;

/* Axis k for a domain of that length. */
QUERN_INLINE void quern_images_set(quern_images *p, uint32_t k, bool periodic, quern_real length) {
	p->half[k] = periodic ? 0.5 * length : __builtin_inf();
	p->length[k] = periodic ? length : 0;
}

QUERN_INLINE quern_images quern_images_of(
	uint32_t dim, const quern_real lower[3], const quern_real upper[3], const bool periodic[3]) {
	quern_images p;
	for (uint32_t k = 0; k < 3; k++) quern_images_set(&p, k, k < dim && periodic[k], upper[k] - lower[k]);
	return p;
}

/* Of the images of x the one nearest to `origin`, from which x is no farther than one and a half lengths. */
QUERN_INLINE quern_real quern_image_at(quern_real x, quern_real origin, quern_real half, quern_real length) {
	const quern_real low = x - origin > half ? x - length : x;
	return low - origin < -half ? low + length : low;
}

/* The same of a difference, in one component and in all. */
QUERN_INLINE quern_real quern_image(quern_real d, quern_real half, quern_real length) {
	return quern_image_at(d, 0, half, length);
}
/* The same of any difference, however many lengths it is; length 0: not periodic. */
QUERN_INLINE quern_real quern_image_far(quern_real d, quern_real length) {
	if (!(length > 0)) return d;
	const quern_real t = d / length + 0.5, down = (quern_real)(int64_t)t;
	return d - length * (down - (t < down ? 1 : 0));
}
QUERN_INLINE quern_vec quern_vec_image(quern_vec d, quern_images p, int dim) {
	return QUERN_VALUE(quern_vec, quern_image(d.x, p.half[0], p.length[0]),
		quern_image(d.y, p.half[1], p.length[1]), dim == 3 ? quern_image(d.z, p.half[2], p.length[2]) : 0);
}
