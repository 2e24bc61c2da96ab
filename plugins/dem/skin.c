/* SPDX-License-Identifier: MIT */
/* skin - how much of it has been used up since the list was made. docs/theory/grains.md, section 4 */
#include "forces.h"
#include <math.h>

void quern_dem_range(quern_real *restrict column, uint32_t n, quern_real *least, quern_real *most) {
	enum { LANES = 32 }; /* four times what a register holds: none waits for the one before it */
	quern_real low[LANES], high[LANES];
	for (uint32_t i = n; i % LANES; i++) column[i] = column[0];
	for (uint32_t k = 0; k < LANES; k++) low[k] = high[k] = column[k];
	for (uint32_t i = LANES; i < n; i += LANES) {
		const quern_real *restrict at = column + i; /* i + k might begin again at 0: gcc would gather */
		QUERN_SIMD
		for (uint32_t k = 0; k < LANES; k++) {
			low[k] = at[k] < low[k] ? at[k] : low[k];
			high[k] = at[k] > high[k] ? at[k] : high[k];
		}
	}
	for (uint32_t half = LANES / 2; half; half /= 2) {
		const quern_real *lower = low + half, *higher = high + half;
		for (uint32_t k = 0; k < half; k++) {
			low[k] = lower[k] < low[k] ? lower[k] : low[k];
			high[k] = higher[k] > high[k] ? higher[k] : high[k];
		}
	}
	*least = low[0], *most = high[0];
}

/* Half of how far two grains can have come nearer: half the diagonal of the box in which all ways lie. Grains that flow together have
 * come far, and no nearer. */
static quern_real nearer_by_half(const ways *of, uint32_t n, uint32_t dim) {
	quern_real square = 0;
	for (uint32_t k = 0; k < dim; k++) {
		quern_real least = of[0].along[k][0], most = of[0].along[k][1];
		for (uint32_t b = 1; b < n; b++) {
			const quern_real *range = of[b].along[k];
			least = range[0] < least ? range[0] : least;
			most = range[1] > most ? range[1] : most;
		}
		square += (most - least) * (most - least);
	}
	return square < INFINITY ? 0.5 * sqrt(square) : INFINITY; /* also where one is not a number */
}

quern_real quern_dem_used_of_skin(
	const quern_step *s, const ways *of, uint32_t n, quern_real farthest, quern_real swept, bool alone) {
	bool wraps =
		false; /* grains are brought back as a list is made, and nobody shall see them far outside of a periodic domain */
	for (uint32_t k = 0; k < s->dim; k++) wraps = wraps || s->periodic[k];
	const quern_real least = wraps ? 0.25 * farthest : 0,
					 pair = alone ? fmin(farthest, fmax(least, nearer_by_half(of, n, s->dim))) : farthest;
	return s->n_slot[SLOT_BODIES] ? fmax(pair, 0.5 * (farthest + swept)) : pair;
}
