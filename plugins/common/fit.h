/* SPDX-License-Identifier: MIT */
/* fit - a linear field fitted to what the nodes around a point say, and what becomes of its moment when the point moves.
 * docs/theory/transfers.md, section 4 */
#pragma once
#include "stencil.h"

/* For a chunk of points. */
typedef struct fit_memory {
	_Alignas(64) quern_real slope[3][3][STENCIL]; /* 1/m, in place of the functions' slopes: S (x_i - x)/D */
	quern_real moment[3][STENCIL];                /* D = sum S (x_i - x)^2, over the squared cell */
	quern_real fit[9][STENCIL], affine[9][STENCIL], shift[3][STENCIL];
	stencil there; /* where the points go */
} fit_memory;

/* D is taken for no less than this share of a squared cell. A point that nearly sits on a node, as gimp has it at a wall alone, hardly sees
 * another: what that one moves like is its own affair, and a slope that came of it would stay with the point. */
static const quern_real fit_least = 1.0 / 64;

/* D along an axis, over the squared cell, from the way to the first node, in cells, and the weights. */
QUERN_INLINE quern_real fit_moment(quern_real way, quern_real w0, quern_real w1, quern_real w2) {
	return w0 * way * way + w1 * (way + 1) * (way + 1) + w2 * (way + 2) * (way + 2);
}

/* The slopes of n points. Weights are complete, so that the sum of S (x_i - x) is zero: the middle one follows from the
 * others, and a uniform field has no slope to the last bit but one. */
QUERN_INLINE void fit_slopes(
	const stencil *s, uint32_t n, const int dim, quern_real inverse_cell, fit_memory *f) {
	for (int a = 0; a < dim; a++) {
		const int32_t *restrict first = s->first[a];
		const quern_real *restrict x = s->position[a], *restrict w0 = s->value[a][0],
								   *restrict w1 = s->value[a][1], *restrict w2 = s->value[a][2];
		quern_real *restrict f0 = f->slope[a][0], *restrict f1 = f->slope[a][1],
							 *restrict f2 = f->slope[a][2], *restrict moment = f->moment[a];
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			const quern_real way = first[i] - x[i] * inverse_cell, d = fit_moment(way, w0[i], w1[i], w2[i]);
			const quern_real held = d > fit_least ? d : fit_least, over = inverse_cell / held;
			const quern_real low = w0[i] * way * over, high = w2[i] * (way + 2) * over;
			moment[i] = held;
			f0[i] = low;
			f1[i] = -(low + high);
			f2[i] = high;
		}
	}
}

/* Whether D is something all over: at a node too, where that of hats vanishes. */
static inline bool fit_has_moments(const quern_bound *shape, uint32_t dim) {
	const quern_grid_view plain = { .cell = 1, .dim = dim, .periodic = { true, true, true } };
	stencil s = { .position = { { 2 }, { 2 }, { 2 } } };
	stencil_weigh(&plain, shape, EVERYWHERE, 1, &s);
	return fit_moment(s.first[0][0] - 2, s.value[0][0][0], s.value[0][1][0], s.value[0][2][0]) >= fit_least;
}

/* Whether a place, in cells from the grid's lower corner, is in the cell beside a wall of the domain. */
QUERN_INLINE bool fit_beside(const quern_grid_view *g, int axis, quern_real place) {
	return !g->periodic[axis] && ((place < 1) | (place > (quern_real)g->cells[axis] - 1));
}

/* D here over D there. Beside a wall, whose node turns with nobody, D vanishes towards it: a slope that grew by as much would take the point there ever
 * faster, and one that stayed would take another away from there ever faster. */
QUERN_INLINE void fit_shift(const quern_grid_view *g, uint32_t n, const int dim, fit_memory *f) {
	const quern_real inverse_cell = 1 / g->cell;
	for (int a = 0; a < dim; a++) {
		const stencil *s = &f->there;
		const int32_t *restrict first = s->first[a];
		const quern_real *restrict x = s->position[a], *restrict w0 = s->value[a][0],
								   *restrict w1 = s->value[a][1], *restrict w2 = s->value[a][2],
								   *restrict here = f->moment[a];
		quern_real *restrict shift = f->shift[a];
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			const quern_real place = x[i] * inverse_cell,
							 there = fit_moment(first[i] - place, w0[i], w1[i], w2[i]);
			const quern_real ratio = here[i] / (there > fit_least ? there : fit_least);
			shift[i] = (fit_beside(g, a, place) & (ratio > 1)) ? 1 : ratio;
		}
	}
}

/* Of a point that was to go to `there` along an axis and stays at `here` (m from the grid's lower corner): by what its slope changes. */
static inline quern_real fit_held(const quern_grid_view *g, const quern_bound *shape, int axis,
	quern_real there, quern_real here, stencil *s) {
	quern_real moment[2] = { 0 };
	if (fit_beside(g, axis, there / g->cell)) return 1;
	for (uint32_t a = 0; a < g->dim; a++) s->position[a][0] = s->position[a][1] = here;
	s->position[axis][0] = there;
	stencil_weigh(g, shape, EVERYWHERE, 2, s);
	for (int i = 0; i < 2; i++) {
		const quern_real way = s->first[axis][i] - s->position[axis][i] / g->cell;
		moment[i] = fmax(
			fit_least, fit_moment(way, s->value[axis][0][i], s->value[axis][1][i], s->value[axis][2][i]));
	}
	return fmin(1, moment[0] / moment[1]);
}
