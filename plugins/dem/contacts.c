/* SPDX-License-Identifier: MIT */
/* contacts - what a chunk of contacts does, between grains or on a body: laws, sums in list order, losses */
#include "forces.h"
#include <string.h>

/* What sliding takes of n contacts, with their weights, and what springs give up that have opened since the last
 * step: no law sees that. The springs' energy is kept in `held`, by slot, which may be NULL. */
static void book_sliding(const forces_work *w, const quern_real *weight, quern_real *held, uint32_t n) {
	const quern_real *restrict overlap = w->overlap, *restrict sheared = w->sheared;
	const int32_t *restrict slot = w->slot;
	quern_real *restrict rubbed = w->rubbed, *restrict kept = held;
	for (uint32_t q = 0; q < n && weight; q++) rubbed[q] *= weight[q];
	if (!held) return;
	QUERN_SIMD
	for (uint32_t q = 0; q < n; q++) {
		const quern_real before = kept[slot[q]], now = weight ? weight[q] * sheared[q] : sheared[q];
		rubbed[q] += overlap[q] > 0 ? 0 : before;
		kept[slot[q]] = overlap[q] > 0 ? now : 0;
	}
}

/* Torque over lever: -(n x f), for the first and the second alike. */
QUERN_INLINE void torques(
	const forces_work *w, quern_real *const force[3], quern_real *const out[3], uint32_t n, const int dim) {
	const quern_real *restrict nx = w->normal[0], *restrict ny = w->normal[1], *restrict nz = w->normal[2];
	const quern_real *restrict fx = force[0], *restrict fy = force[1], *restrict fz = force[2];
	quern_real *restrict tx = out[0], *restrict ty = out[1], *restrict tz = out[2];
	if (dim == 2) {
		QUERN_SIMD
		for (uint32_t q = 0; q < n; q++) tx[q] = ny[q] * fx[q] - nx[q] * fy[q];
	} else {
		QUERN_SIMD
		for (uint32_t q = 0; q < n; q++) {
			tx[q] = nz[q] * fy[q] - ny[q] * fz[q];
			ty[q] = nx[q] * fz[q] - nz[q] * fx[q];
			tz[q] = ny[q] * fx[q] - nx[q] * fy[q];
		}
	}
}

/* ---- forces and torques to the rows of grains; a body has none, so that a contact on it is not `paired` ---- */

/* The row of a grain of the block; a partner outside has the spare row. */
QUERN_INLINE uint32_t row_of(int32_t grain, uint32_t begin, uint32_t end) {
	const uint32_t i = (uint32_t)grain - begin;
	return i < end - begin ? i : end - begin;
}

/* Numbers of a contact, times a factor each, join half a row. A whole row is wider than what most processors hold in one
 * register: put together from single numbers, it would go through memory and wait there. */
QUERN_INLINE void add_half(quern_real *row, const lanes4 *factor, const lanes4 *given) {
	*(lanes4 *)(void *)row += *factor * *given;
}

/* With books what dashpots give has the lanes behind, and what sliding takes, which has its weight already. */
QUERN_INLINE void add_2d(const forces_work *w, uint32_t begin, uint32_t end, uint32_t n, const bool spin,
	const bool weighted, const bool paired, const bool books) {
	static const lanes4 lever = { 0, 0, 1, 0 }, plain = { 1, 1, 0, 1 }, lever_on = { 0, 1, 0, 0 },
						plain_on = { 1, 0, 0, 0 }, own = { 0, 0, 1, 0 };
	for (uint32_t q = 0; q < n; q++) {
		quern_real *i = w->row[row_of(w->first[q], begin, end)],
				   *j = w->row[row_of(w->second[q], begin, end)];
		const quern_real share = weighted ? w->weight[q] : 1;
		const lanes4 f = share * (lanes4) { w->force[0][q], w->force[1][q], spin ? w->torque[0][q] : 0,
			books ? w->dashpot[0][q] : 0 };
		const lanes4 to_first = plain + w->arm[0][q] * lever;
		add_half(i, &to_first, &f);
		if (paired) {
			const lanes4 to_second = w->arm[1][q] * lever - plain;
			add_half(j, &to_second, &f);
		}
		if (!books) continue;
		const lanes4 all = share * (plain_on + lever_on) + own;
		const lanes4 d =
			all * (lanes4) { w->dashpot[1][q], spin ? w->drag_torque[0][q] : 0, w->rubbed[q], 0 };
		const lanes4 drag_first = plain_on + own + w->arm[0][q] * lever_on;
		add_half(i + 4, &drag_first, &d);
		if (!paired) continue;
		const lanes4 drag_second = w->arm[1][q] * lever_on - plain_on;
		add_half(j + 4, &drag_second, &d);
	}
}

QUERN_INLINE void add_3d(const forces_work *w, uint32_t begin, uint32_t end, uint32_t n, const bool spin,
	const bool weighted, const bool paired, const bool books) {
	static const lanes4 lever = { 0, 0, 0, 1 }, plain = { 1, 1, 1, 0 }, lever_on = { 1, 1, 0, 0 },
						own = { 0, 0, 1, 0 };
	for (uint32_t q = 0; q < n; q++) {
		const uint32_t i = row_of(w->first[q], begin, end), j = row_of(w->second[q], begin, end);
		const quern_real share = weighted ? w->weight[q] : 1, arm_i = w->arm[0][q],
						 arm_j = paired ? w->arm[1][q] : 0;
		const lanes4 first = share * (plain + arm_i * lever), first_on = share * (arm_i * lever_on),
					 second = share * (arm_j * lever - plain), second_on = share * (arm_j * lever_on);
		const lanes4 f = { w->force[0][q], w->force[1][q], w->force[2][q], spin ? w->torque[0][q] : 0 };
		const lanes4 f_on = { spin ? w->torque[1][q] : 0, spin ? w->torque[2][q] : 0, 0, 0 };
		add_half(w->row[i], &first, &f);
		if (spin) add_half(w->row[i] + 4, &first_on, &f_on);
		if (paired) add_half(w->row[j], &second, &f);
		if (paired && spin) add_half(w->row[j] + 4, &second_on, &f_on);
		if (!books) continue;
		const lanes4 d = { w->dashpot[0][q], w->dashpot[1][q], w->dashpot[2][q],
			spin ? w->drag_torque[0][q] : 0 };
		const lanes4 d_on = { spin ? w->drag_torque[1][q] : 0, spin ? w->drag_torque[2][q] : 0, w->rubbed[q],
			0 };
		const lanes4 first_own = first_on + own;
		add_half(w->drag_row[i], &first, &d);
		add_half(w->drag_row[i] + 4, &first_own, &d_on);
		if (paired) add_half(w->drag_row[j], &second, &d);
		if (paired && spin) add_half(w->drag_row[j] + 4, &second_on, &d_on);
	}
}

QUERN_INLINE void add_forces(const forces_work *w, uint32_t first, uint32_t last, uint32_t n, const int dim,
	const bool spin, const bool weighted, const bool paired, const bool books) {
	if (dim == 3) add_3d(w, first, last, n, spin, weighted, paired, books);
	else add_2d(w, first, last, n, spin, weighted, paired, books);
}

/* Couples have rows of their own, with what damps from lane 3 on: a sum that took a chunk's torques and then its couples
 * would depend on where chunks are cut. */
static void add_couples(const forces_work *w, const quern_real *weight, uint32_t lane,
	quern_real *const couple[3], uint32_t first, uint32_t last, uint32_t n, uint32_t turns, bool paired) {
	quern_real(*row)[8] = w->couple_row;
	for (uint32_t q = 0; q < n; q++) {
		const uint32_t i = row_of(w->first[q], first, last), j = row_of(w->second[q], first, last);
		const quern_real share = weight ? weight[q] : 1;
		for (uint32_t k = 0; k < turns; k++) {
			row[i][lane + k] += share * couple[k][q];
			if (paired) row[j][lane + k] -= share * couple[k][q];
		}
	}
}

/* Forces and torques to the grains of a block, and with them, if they are booked, losses. */
QUERN_INLINE void add_all(const forces_shared *sh, const forces_work *w, const contact_chunk *c,
	const int dim, const bool spin, const bool paired) {
	const quern_real *weight = sh->use[FORCE_WEIGHT].real[0] ? w->weight : NULL;
	const uint32_t first = sh->grain[c->block], last = sh->grain[c->block + 1], turns = dim == 3 ? 3 : 1;
	if (spin) torques(w, w->force, w->torque, c->n, dim);
	if (sh->books && spin) torques(w, w->dashpot, w->drag_torque, c->n, dim);
	if (sh->books) book_sliding(w, weight, c->held, c->n);
	if (sh->books && weight) add_forces(w, first, last, c->n, dim, spin, true, paired, true);
	else if (sh->books) add_forces(w, first, last, c->n, dim, spin, false, paired, true);
	else if (weight) add_forces(w, first, last, c->n, dim, spin, true, paired, false);
	else add_forces(w, first, last, c->n, dim, spin, false, paired, false);
	if (!spin || !sh->couple) return;
	add_couples(w, weight, 0, w->couple, first, last, c->n, turns, paired);
	if (sh->books) add_couples(w, weight, 3, w->drag_couple, first, last, c->n, turns, paired);
}

QUERN_INLINE void add_both(
	const forces_shared *sh, const forces_work *w, const contact_chunk *c, const int dim, const bool spin) {
	if (c->body < 0) add_all(sh, w, c, dim, spin, true);
	else add_all(sh, w, c, dim, spin, false);
}

void quern_dem_fold_couples(const forces_shared *sh, const forces_work *w, uint32_t n) {
	const uint32_t dim = sh->s->dim, turns = dim == 3 ? 3 : 1;
	for (uint32_t i = 0; i < n && w->couple_row && sh->spin; i++)
		for (uint32_t k = 0; k < turns; k++) {
			w->row[i][dim + k] += w->couple_row[i][k];
			if (sh->books && dim == 2) w->row[i][LANE_DRAG + 2] += w->couple_row[i][3];
			if (sh->books && dim == 3) w->drag_row[i][3 + k] += w->couple_row[i][3 + k];
		}
}

/* ---- the chunk ---- */

/* Stores what the contacts kept were given, such as their force; the others get zero. */
static void keep(const forces_work *w, const contact_chunk *c, quern_real *const given[3], quern_column out,
	uint32_t components) {
	for (uint32_t k = 0; k < components && out.real[0]; k++) {
		quern_real *to = out.real[k] + c->begin;
		memset(to, 0, c->n_slots * sizeof(quern_real));
		for (uint32_t q = 0; q < c->n && given[k]; q++) to[w->slot[q]] = given[k][q];
	}
}

quern_real *quern_dem_held(const forces_shared *sh, int row, uint32_t begin) {
	quern_real *held = sh->use[row].real[0];
	return held && (sh->books || sh->starts) ? held + begin : NULL;
}

void quern_dem_act(const forces_shared *sh, forces_work *w, const contact_chunk *c, quern_real *sums) {
	const uint32_t dim = sh->s->dim;
	const bool paired = c->body < 0;
	quern_dem_call_laws(sh, w, c);
	if (sh->deep) quern_dem_check_contacts(sh, w, c);
	if (sh->boxed && !sh->looks) quern_dem_box_book(sh, w, c, sums);
	if (dim == 2 && sh->spin) add_both(sh, w, c, 2, true);
	else if (dim == 2) add_both(sh, w, c, 2, false);
	else if (sh->spin) add_both(sh, w, c, 3, true);
	else add_both(sh, w, c, 3, false);
	keep(w, c, w->force, sh->use[paired ? FORCE_CONTACT : FORCE_TOUCH], dim);
	keep(w, c, w->couple, sh->use[paired ? FORCE_CONTACT_COUPLE : FORCE_TOUCH_COUPLE], dim == 3 ? 3 : 1);
	if (sh->looks) quern_dem_look(sh, w, c, sums);
}
