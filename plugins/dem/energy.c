/* SPDX-License-Identifier: MIT */
/* energy - what dashpots and sliding take in every step, and what there is when somebody looks.
 * docs/theory/contacts.md, section 8. Forces of dashpots are added up beside all forces, since a dashpot's work is
 * its force times the mean velocity of the kick, which is known only after the sum. What sliding takes of a pair
 * is booked with its first grain. */
#include "packed.h"

/* ---- contacts ---- */

void quern_dem_look(const forces_shared *sh, const forces_work *w, const contact_chunk *c, quern_real *sums) {
	const uint32_t begin = sh->grain[c->block], end = sh->grain[c->block + 1];
	for (uint32_t q = 0; q < c->n; q++) {
		const uint32_t i = (uint32_t)w->first[q];
		const quern_real share = sh->use[FORCE_WEIGHT].real[0] ? w->weight[q] : 1;
		if (i < begin || i >= end) continue;
		sums[E_STORED] += share * w->stored[q];
		sums[E_SHEARED] += share * w->sheared[q];
	}
}

/* ---- grains ---- */

static bool is_fixed(const forces_shared *sh, uint32_t i) {
	return sh->use[FORCE_FIXED].index && sh->use[FORCE_FIXED].index[i];
}

/* -F.v of the dashpots, and in 2-D what sliding took: lanes of rows (forces.h) times velocities or 1, four grains at once. Four sums go
 * side by side, so that none waits for the one before. */
QUERN_INLINE void lose(const forces_work *w, const int32_t *fixed, uint32_t row, uint32_t n, const int dim,
	const bool spin, lanes4 *low_out, lanes4 *high_out) {
	const lanes4 none = { 0 }, one = { 1, 1, 1, 1 }, slid = { 0, 0, dim == 2 ? 1 : 0, 0 };
	lanes4 low[4] = { { 0 } }, high[4] = { { 0 } };
	for (uint32_t i = 0; i < n; i += 4) {
		lanes4 v[3], s[3], by_low[4], by_high[4];
		for (int k = 0; k < 3; k++) {
			v[k] = k < dim ? -*packed_at(w->grains[G_MEAN + k] + i) : none;
			s[k] = spin && k < (dim == 3 ? 3 : 1) ? -*packed_at(w->grains[G_MEAN_SPIN + k] + i) : none;
		}
		if (dim == 2) {
			packed_turn((const lanes4[4]) { none, none, none, v[0] }, by_low);
			packed_turn((const lanes4[4]) { v[1], s[0], one, none }, by_high);
		} else {
			packed_turn((const lanes4[4]) { v[2], s[0], s[1], s[2] }, by_low);
			packed_turn((const lanes4[4]) { none, none, v[0], v[1] }, by_high);
		}
		for (uint32_t k = 0; k < 4 && i + k < n; k++) {
			const bool holds = fixed && fixed[i + k];
			const quern_real *mine = w->row[row + i + k], *drag = dim == 2 ? mine : w->drag_row[row + i + k];
			low[k] += *packed_at(drag) * (holds ? none : by_low[k]);
			high[k] += *packed_at(mine + 4) * (holds ? slid : by_high[k]);
		}
	}
	*low_out = (low[0] + low[2]) + (low[1] + low[3]);
	*high_out = (high[0] + high[2]) + (high[1] + high[3]);
}

void quern_dem_lose(const forces_shared *sh, const forces_work *w, uint32_t begin, uint32_t row, uint32_t n,
	quern_real *sums) {
	const int32_t *fixed = sh->use[FORCE_FIXED].index ? sh->use[FORCE_FIXED].index + begin : NULL;
	const bool flat = sh->s->dim == 2;
	lanes4 low, high;
	if (flat && sh->spin) lose(w, fixed, row, n, 2, true, &low, &high);
	else if (flat) lose(w, fixed, row, n, 2, false, &low, &high);
	else if (sh->spin) lose(w, fixed, row, n, 3, true, &low, &high);
	else lose(w, fixed, row, n, 3, false, &low, &high);
	const quern_real damped =
		flat ? (low[3] + high[0]) + high[1] : ((high[2] + high[3]) + low[0]) + ((low[1] + low[2]) + low[3]);
	sums[E_DAMPED] += damped * sh->s->dt;
	if (flat) sums[E_RUBBED] += high[LANE_RUBBED - 4];
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
