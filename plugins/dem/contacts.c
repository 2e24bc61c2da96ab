/* SPDX-License-Identifier: MIT */
/* contacts - what a chunk of contacts does, between grains or on a body: laws, sums in list order, losses */
#include "packed.h"
#include <string.h>

/* ---- forces and torques to the rows of grains; a body has none, so that a contact on it is not `paired` ---- */

/* The row of a grain of the block; a partner outside has the spare row. */
QUERN_INLINE uint32_t row_of(int32_t grain, uint32_t begin, uint32_t end) {
	const uint32_t i = (uint32_t)grain - begin;
	return i < end - begin ? i : end - begin;
}

/* Four contacts at once: columns become rows in registers, four numbers at a time. A row of eight is wider than what most processors
 * hold in one register, and put together from single numbers it would go through memory and wait there. */
QUERN_INLINE lanes4 *half(quern_real *row) { return (lanes4 *)(void *)row; }

/* What a contact gives to its first grain is `given` times `share` for a force and times `arm`, its lever with the share, for a torque;
 * to the second the force comes with the other sign. */
typedef struct contact_share {
	quern_real share, arm_first, arm_second;
} contact_share;
QUERN_INLINE contact_share share_of(
	const forces_work *w, uint32_t q, const bool weighted, const bool paired) {
	const quern_real share = weighted ? w->weight[q] : 1, first = w->arm[0][q],
					 second = paired ? w->arm[1][q] : 0;
	return (contact_share) { share, weighted ? share * first : first, weighted ? share * second : second };
}

/* With books what dashpots give has the lanes behind, and what sliding takes. */
QUERN_INLINE void add_2d(const forces_work *w, uint32_t begin, uint32_t end, uint32_t n, const bool spin,
	const bool weighted, const bool paired, const bool books) {
	const lanes4 none = { 0 };
	for (uint32_t at = 0; at < n; at += 4) {
		const lanes4 nx = *packed_at(w->normal[0] + at), ny = *packed_at(w->normal[1] + at),
					 fx = *packed_at(w->force[0] + at), fy = *packed_at(w->force[1] + at),
					 dx = books ? *packed_at(w->dashpot[0] + at) : none,
					 dy = books ? *packed_at(w->dashpot[1] + at) : none,
					 slid = books ? *packed_at(w->rubbed + at) : none;
		lanes4 f[4], d[4];
		packed_turn((const lanes4[4]) { fx, fy, spin ? ny * fx - nx * fy : none, dx }, f);
		packed_turn((const lanes4[4]) { dy, spin ? ny * dx - nx * dy : none, slid, none }, d);
		for (uint32_t k = 0; k < 4 && at + k < n; k++) {
			const uint32_t q = at + k;
			const contact_share c = share_of(w, q, weighted, paired);
			const quern_real s = c.share, a = c.arm_first, b = c.arm_second;
			quern_real *i = w->row[row_of(w->first[q], begin, end)],
					   *j = w->row[row_of(w->second[q], begin, end)];
			*half(i) += (lanes4) { s, s, a, s } * f[k];
			if (books) *half(i + 4) += (lanes4) { s, a, s, 0 } * d[k];
			if (paired) *half(j) += (lanes4) { -s, -s, b, -s } * f[k];
			if (paired && books) *half(j + 4) += (lanes4) { -s, b, 0, 0 } * d[k];
		}
	}
}

/* In three dimensions the dashpots' force begins in the lanes that a torque leaves free, and goes on in a row of its own. What
 * sliding takes is added up along the list, whose order no chunk changes. */
QUERN_INLINE void add_3d(const forces_work *w, uint32_t begin, uint32_t end, uint32_t n, const bool spin,
	const bool weighted, const bool paired, const bool books, quern_real *rubbed) {
	const lanes4 none = { 0 };
	quern_real slid = *rubbed;
	for (uint32_t at = 0; at < n; at += 4) {
		const lanes4 nx = *packed_at(w->normal[0] + at), ny = *packed_at(w->normal[1] + at),
					 nz = *packed_at(w->normal[2] + at);
		const lanes4 fx = *packed_at(w->force[0] + at), fy = *packed_at(w->force[1] + at),
					 fz = *packed_at(w->force[2] + at);
		const lanes4 dx = books ? *packed_at(w->dashpot[0] + at) : none,
					 dy = books ? *packed_at(w->dashpot[1] + at) : none,
					 dz = books ? *packed_at(w->dashpot[2] + at) : none;
		lanes4 f[4], f_on[4], d[4];
		packed_turn((const lanes4[4]) { fx, fy, fz, spin ? nz * fy - ny * fz : none }, f);
		packed_turn(
			(const lanes4[4]) { spin ? nx * fz - nz * fx : none, spin ? ny * fx - nx * fy : none, dx, dy },
			f_on);
		packed_turn((const lanes4[4]) { dz, spin ? nz * dy - ny * dz : none, spin ? nx * dz - nz * dx : none,
						spin ? ny * dx - nx * dy : none },
			d);
		for (uint32_t k = 0; k < 4 && at + k < n; k++) {
			const uint32_t q = at + k, i = row_of(w->first[q], begin, end),
						   j = row_of(w->second[q], begin, end);
			const contact_share c = share_of(w, q, weighted, paired);
			const quern_real s = c.share, a = c.arm_first, b = c.arm_second;
			*half(w->row[i]) += (lanes4) { s, s, s, a } * f[k];
			if (spin || books) *half(w->row[i] + 4) += (lanes4) { a, a, s, s } * f_on[k];
			if (books) *half(w->drag_row[i]) += (lanes4) { s, a, a, a } * d[k];
			if (books) slid += i < end - begin ? s * w->rubbed[q] : 0;
			if (!paired) continue;
			*half(w->row[j]) += (lanes4) { -s, -s, -s, b } * f[k];
			if (spin || books) *half(w->row[j] + 4) += (lanes4) { b, b, -s, -s } * f_on[k];
			if (books) *half(w->drag_row[j]) += (lanes4) { -s, b, b, b } * d[k];
		}
	}
	*rubbed = slid;
}

QUERN_INLINE void add_forces(const forces_work *w, uint32_t first, uint32_t last, uint32_t n, const int dim,
	const bool spin, const bool weighted, const bool paired, const bool books, quern_real *rubbed) {
	if (dim == 3) add_3d(w, first, last, n, spin, weighted, paired, books, rubbed);
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
	quern_real *sums, const int dim, const bool spin, const bool paired) {
	const quern_real *weight = sh->use[FORCE_WEIGHT].real[0] ? w->weight : NULL;
	const uint32_t first = sh->grain[c->block], last = sh->grain[c->block + 1], turns = dim == 3 ? 3 : 1;
	if (sh->books && weight) add_forces(w, first, last, c->n, dim, spin, true, paired, true, &sums[E_RUBBED]);
	else if (sh->books) add_forces(w, first, last, c->n, dim, spin, false, paired, true, &sums[E_RUBBED]);
	else if (weight) add_forces(w, first, last, c->n, dim, spin, true, paired, false, &sums[E_RUBBED]);
	else add_forces(w, first, last, c->n, dim, spin, false, paired, false, &sums[E_RUBBED]);
	if (!spin || !sh->couple) return;
	add_couples(w, weight, 0, w->couple, first, last, c->n, turns, paired);
	if (sh->books) add_couples(w, weight, 3, w->drag_couple, first, last, c->n, turns, paired);
}

QUERN_INLINE void add_both(const forces_shared *sh, const forces_work *w, const contact_chunk *c,
	quern_real *sums, const int dim, const bool spin) {
	if (c->body < 0) add_all(sh, w, c, sums, dim, spin, true);
	else add_all(sh, w, c, sums, dim, spin, false);
}

void quern_dem_fold_couples(const forces_shared *sh, const forces_work *w, uint32_t n) {
	const uint32_t dim = sh->s->dim, turns = dim == 3 ? 3 : 1;
	for (uint32_t i = 0; i < n && w->couple_row && sh->spin; i++)
		for (uint32_t k = 0; k < turns; k++) {
			w->row[i][dim + k] += w->couple_row[i][k];
			if (sh->books && dim == 2) w->row[i][LANE_DRAG + 2] += w->couple_row[i][3];
			if (sh->books && dim == 3) w->drag_row[i][1 + k] += w->couple_row[i][3 + k];
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

void quern_dem_act(const forces_shared *sh, forces_work *w, const contact_chunk *c, quern_real *sums) {
	const uint32_t dim = sh->s->dim;
	const bool paired = c->body < 0;
	quern_dem_call_laws(sh, w, c);
	if (sh->deep) quern_dem_check_contacts(sh, w, c);
	if (sh->boxed && !sh->looks) quern_dem_box_book(sh, w, c, sums);
	if (dim == 2 && sh->spin) add_both(sh, w, c, sums, 2, true);
	else if (dim == 2) add_both(sh, w, c, sums, 2, false);
	else if (sh->spin) add_both(sh, w, c, sums, 3, true);
	else add_both(sh, w, c, sums, 3, false);
	keep(w, c, w->force, sh->use[paired ? FORCE_CONTACT : FORCE_TOUCH], dim);
	keep(w, c, w->couple, sh->use[paired ? FORCE_CONTACT_COUPLE : FORCE_TOUCH_COUPLE], dim == 3 ? 3 : 1);
	if (sh->looks) quern_dem_look(sh, w, c, sums);
}
