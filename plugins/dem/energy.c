/* SPDX-License-Identifier: MIT */
/* energy - what dashpots and sliding take in every step, and what there is when somebody looks.
 * docs/theory/contacts.md, section 8. Forces of dashpots are added up beside all forces, since a dashpot's work is
 * its force times the mean velocity of the kick, which is known only after the sum. What sliding takes goes to the
 * first grain of a pair, in a lane of its row. */
#include "forces.h"

/* ---- contacts ---- */

void quern_dem_look(const forces_shared *sh, const forces_work *w, const contact_chunk *c, quern_real *sums) {
	const uint32_t begin = sh->grain[c->block], end = sh->grain[c->block + 1];
	for (uint32_t q = 0; q < c->n; q++) {
		const uint32_t i = (uint32_t)w->first[q];
		const quern_real share = sh->use[FORCE_WEIGHT].real[0] ? w->weight[q] : 1;
		if (c->held) c->held[w->slot[q]] = w->overlap[q] > 0 ? share * w->sheared[q] : 0;
		if (i < begin || i >= end) continue;
		sums[E_STORED] += share * w->stored[q];
		sums[E_SHEARED] += share * w->sheared[q];
	}
}

/* ---- grains ---- */

static bool is_fixed(const forces_shared *sh, uint32_t i) {
	return sh->use[FORCE_FIXED].index && sh->use[FORCE_FIXED].index[i];
}

/* -sum F.v of the dashpots in the lanes of forces and torques, and what sliding took in its own. Four sums go side by
 * side, so that none waits for the one before. */
QUERN_INLINE void lose(const forces_work *w, const int32_t *fixed, uint32_t row, uint32_t n, const int dim,
	const bool spin, lanes8 *out) {
	const quern_real(*restrict drag)[8] =
		(const quern_real(*)[8])(const void *)((dim == 2 ? w->row : w->drag_row) + row);
	const quern_real *restrict vx = w->grains[G_MEAN], *restrict vy = w->grains[G_MEAN + 1],
							   *restrict vz = w->grains[G_MEAN + 2];
	const quern_real *restrict sx = w->grains[G_MEAN_SPIN], *restrict sy = w->grains[G_MEAN_SPIN + 1],
							   *restrict sz = w->grains[G_MEAN_SPIN + 2];
	static const lanes8 slid = { 0, 0, 0, 0, 0, 0, 1, 0 };
	lanes8 sum[4] = { { 0 } };
	for (uint32_t i = 0; i < n; i++) {
		lanes8 v = slid;
		if (fixed && fixed[i]) v = slid;
		else if (dim == 2) v = (lanes8) { 0, 0, 0, -vx[i], -vy[i], spin ? -sx[i] : 0, 1, 0 };
		else
			v = (lanes8) { -vx[i], -vy[i], -vz[i], spin ? -sx[i] : 0, spin ? -sy[i] : 0, spin ? -sz[i] : 0, 1,
				0 };
		sum[i % 4] += *(const lanes8 *)(const void *)drag[i] * v;
	}
	*out = (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

void quern_dem_lose(const forces_shared *sh, const forces_work *w, uint32_t begin, uint32_t row, uint32_t n,
	quern_real *sums) {
	const int32_t *fixed = sh->use[FORCE_FIXED].index ? sh->use[FORCE_FIXED].index + begin : NULL;
	const bool flat = sh->s->dim == 2;
	lanes8 of;
	if (flat && sh->spin) lose(w, fixed, row, n, 2, true, &of);
	else if (flat) lose(w, fixed, row, n, 2, false, &of);
	else if (sh->spin) lose(w, fixed, row, n, 3, true, &of);
	else lose(w, fixed, row, n, 3, false, &of);
	const quern_real damped =
		flat ? (of[3] + of[4]) + of[5] : ((of[0] + of[1]) + of[2]) + ((of[3] + of[4]) + of[5]);
	sums[E_DAMPED] += damped * sh->s->dt;
	sums[E_RUBBED] += of[LANE_RUBBED];
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
