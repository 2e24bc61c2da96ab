/* SPDX-License-Identifier: MIT */
/* energy - what dashpots and sliding take in every step, and what there is when somebody looks. docs/theory/contacts.md,
 * section 5.
 *
 * Forces of dashpots are added up beside all forces, since a dashpot's work is its force times the mean velocity of the
 * kick, which is known only after the sum. What sliding takes goes to the first grain of a pair, in a lane of its row. */
#include "forces.h"

enum { LANES = 8 };

/* A sum in an order that no vector width changes. */
QUERN_INLINE quern_real lane_sum(const quern_real *restrict x, uint32_t n) {
	quern_real lane[LANES] = { 0 };
	uint32_t i = 0;
	for (; i + LANES <= n; i += LANES)
		for (uint32_t l = 0; l < LANES; l++) lane[l] += x[i + l];
	for (uint32_t l = 0; i + l < n; l++) lane[l] += x[i + l];
	return ((lane[0] + lane[4]) + (lane[2] + lane[6])) + ((lane[1] + lane[5]) + (lane[3] + lane[7]));
}

/* ---- contacts ---- */

void quern_dem_look(const forces_shared *sh, const forces_work *w, quern_real *held, uint32_t n,
	uint32_t begin, uint32_t end, quern_real *sums) {
	for (uint32_t q = 0; q < n; q++) {
		const uint32_t i = (uint32_t)w->first[q];
		const quern_real share = sh->use[FORCE_WEIGHT].real[0] ? w->weight[q] : 1;
		if (held) held[w->slot[q]] = w->overlap[q] > 0 ? share * w->sheared[q] : 0;
		if (i < begin || i >= end) continue;
		sums[E_STORED] += share * w->stored[q];
		sums[E_SHEARED] += share * w->sheared[q];
	}
}

/* ---- grains ---- */

static bool is_fixed(const forces_shared *sh, uint32_t i) {
	return sh->use[FORCE_FIXED].index && sh->use[FORCE_FIXED].index[i];
}

QUERN_INLINE void lose(const forces_work *w, uint32_t row, uint32_t n, const int dim, const bool spin) {
	const quern_real(*restrict drag)[8] =
		(const quern_real(*)[8])(const void *)((dim == 2 ? w->row : w->drag_row) + row);
	const quern_real *restrict vx = w->grains[G_MEAN], *restrict vy = w->grains[G_MEAN + 1],
							   *restrict vz = w->grains[G_MEAN + 2];
	const quern_real *restrict sx = w->grains[G_MEAN_SPIN], *restrict sy = w->grains[G_MEAN_SPIN + 1],
							   *restrict sz = w->grains[G_MEAN_SPIN + 2];
	quern_real *restrict work = w->grains[G_LOST], *restrict rubbed = w->grains[G_LOST + 1];
	const int lane = dim == 2 ? LANE_DRAG : 0;
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		const quern_real *d = drag[i] + lane;
		quern_real sum = d[0] * vx[i] + d[1] * vy[i];
		if (dim == 3) sum += d[2] * vz[i];
		if (spin) sum += d[dim] * sx[i];
		if (spin && dim == 3) sum += d[4] * sy[i] + d[5] * sz[i];
		work[i] = -sum;
		rubbed[i] = drag[i][LANE_RUBBED];
	}
}

void quern_dem_lose(const forces_shared *sh, const forces_work *w, uint32_t begin, uint32_t row, uint32_t n,
	quern_real *sums) {
	quern_real *work = w->grains[G_LOST];
	if (sh->s->dim == 2 && sh->spin) lose(w, row, n, 2, true);
	else if (sh->s->dim == 2) lose(w, row, n, 2, false);
	else if (sh->spin) lose(w, row, n, 3, true);
	else lose(w, row, n, 3, false);
	for (uint32_t i = 0; i < n && sh->use[FORCE_FIXED].index; i++)
		if (is_fixed(sh, begin + i)) work[i] = 0;
	sums[E_DAMPED] += lane_sum(work, n) * sh->s->dt;
	sums[E_RUBBED] += lane_sum(w->grains[G_LOST + 1], n);
}

void quern_dem_have(
	const forces_shared *sh, const forces_work *w, uint32_t begin, uint32_t n, quern_real *sums) {
	const quern_column *u = sh->use;
	const uint32_t dim = sh->s->dim, n_spin = sh->spin ? (dim == 3 ? 3 : 1) : 0;
	for (uint32_t i = 0; i < n; i++) {
		quern_real v2 = 0, s2 = 0, height = 0;
		if (is_fixed(sh, begin + i)) continue;
		for (uint32_t k = 0; k < dim; k++) {
			v2 += w->grains[G_MEAN + k][i] * w->grains[G_MEAN + k][i];
			height -= sh->s->gravity[k] * u[FORCE_OLD_POSITION].real[k][begin + i];
		}
		for (uint32_t k = 0; k < n_spin; k++)
			s2 += w->grains[G_MEAN_SPIN + k][i] * w->grains[G_MEAN_SPIN + k][i];
		sums[E_KINETIC] += 0.5 * (w->grains[G_MASS][i] * v2 + w->grains[G_INERTIA][i] * s2);
		sums[E_POTENTIAL] += w->grains[G_MASS][i] * height;
	}
}
