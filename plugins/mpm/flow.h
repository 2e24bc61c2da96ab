/* SPDX-License-Identifier: MIT */
/* flow - in which cells points are, and how far what they are a part of flows: for what is done to points as they are sheared */
#pragma once
#include "gather.h"
#include <math.h>

/* Of the block's cells, those that points (m from the grid's lower corner) are in, or the nearest to them: between sorts a point may be
 * beyond. */
QUERN_INLINE void cells_of(const gather_work *w, uint32_t b, quern_real position[3][STENCIL], uint32_t n,
	const int dim, int32_t *restrict cell) {
	const quern_real width = w->g->cell;
	const int32_t edge = (int32_t)w->g->edge;
	memset(cell, 0, n * sizeof *cell);
	for (int k = dim; k-- > 0;) {
		const int32_t begin = w->g->at[b][k] * edge, inside = w->g->cells[k] - begin;
		const quern_real most = (w->p->alone && inside < edge ? inside : edge) - 1;
		const quern_real *restrict at = position[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			const quern_real x = at[i] / width - begin;
			cell[i] = cell[i] * edge + (int32_t)(x > 0 ? (x < most ? x : most) : 0);
		}
	}
}

/* 0 at rest, 1 in flow, by the square of the shear rate. */
QUERN_INLINE quern_real flowing_share(quern_real still, quern_real rate2) {
	const quern_real fast = rate2 / (still * still), share = fast * fast / (1 + fast * fast);
	return still > 0 ? share : 1;
}

/* Where pressure is more than this part of the bulk modulus it presses by as much itself: those are waves, and not lost room. */
static const quern_real waves = 0.03;
/* What is shaken changes volume as much as shape, what flows hardly: weight of the former. */
static const quern_real shaken = 30;

/* 1/s: the shear rate of point i, as far as its shape changes and not its volume alone. */
QUERN_INLINE quern_real sheared_rate(const gather_memory *m, uint32_t i, quern_real rate2, const int dim) {
	quern_real trace = 0;
	for (int k = 0; k < dim; k++) trace += m->gradient[(dim + 1) * k][i];
	return rate2 > 0 ? sqrt(rate2) * (rate2 / (rate2 + shaken * trace * trace)) : 0;
}
