/* SPDX-License-Identifier: MIT */
/* pairs - contacts between grains of one block: distance test, laws, sums in list order */
#include "forces.h"

/* Slots whose grains are within the laws' reach, in list order; and those whose spring was still loaded, so that what it
 * held is booked. */
QUERN_INLINE uint32_t compact(const forces_shared *sh, forces_work *w, uint32_t begin, uint32_t n,
	const quern_real *held, const int dim) {
	const quern_column at = sh->use[FORCE_OLD_POSITION];
	const quern_real *restrict x = at.real[0], *restrict y = at.real[1], *restrict z = at.real[2];
	const quern_real *restrict radius = sh->use[FORCE_RADIUS].real[0];
	const int32_t *restrict first = sh->use[FORCE_FIRST].index + begin, *restrict second =
																			sh->use[FORCE_SECOND].index +
																			begin;
	const quern_real reach = sh->d->reach;
	const quern_images p = sh->images;
	int32_t *restrict near = w->slot;
	uint32_t kept = 0;
	QUERN_SIMD
	for (uint32_t k = 0; k < n; k++) {
		const int32_t i = first[k], j = second[k];
		const quern_vec d =
			quern_vec_image((quern_vec) { x[i] - x[j], y[i] - y[j], dim == 3 ? z[i] - z[j] : 0 }, p, dim);
		const quern_real most = radius[i] + radius[j] + reach;
		near[k] = (quern_vec_dot(d, d, dim) < most * most);
	}
	if (held) {
		QUERN_SIMD
		for (uint32_t k = 0; k < n; k++) near[k] |= held[k] > 0;
	}
	for (uint32_t k = 0; k < n; k++) {
		const int32_t is = near[k];
		w->first[kept] = first[k];
		w->second[kept] = second[k];
		near[kept] = (int32_t)k;
		kept += (uint32_t)is;
	}
	return kept;
}

QUERN_INLINE void geometry(const forces_shared *sh, const forces_work *w, uint32_t n, const int dim) {
	const quern_column at = sh->use[FORCE_OLD_POSITION];
	const quern_real *restrict x = at.real[0], *restrict y = at.real[1], *restrict z = at.real[2];
	const quern_real *restrict radius = sh->use[FORCE_RADIUS].real[0];
	const int32_t *restrict first = w->first, *restrict second = w->second;
	const quern_images p = sh->images;
	quern_real *restrict overlap = w->overlap, *restrict effective = w->radius;
	quern_real *restrict nx = w->normal[0], *restrict ny = w->normal[1], *restrict nz = w->normal[2];
	quern_real *restrict arm_i = w->arm[0], *restrict arm_j = w->arm[1];
	QUERN_SIMD
	for (uint32_t q = 0; q < n; q++) {
		const int32_t i = first[q], j = second[q];
		const quern_vec d =
			quern_vec_image((quern_vec) { x[i] - x[j], y[i] - y[j], dim == 3 ? z[i] - z[j] : 0 }, p, dim);
		const quern_real ri = radius[i], rj = radius[j];
		const quern_real length = __builtin_sqrt(quern_vec_dot(d, d, dim)),
						 one_over = length > 0 ? 1 / length : 0;
		nx[q] = d.x * one_over;
		ny[q] = d.y * one_over;
		if (dim == 3) nz[q] = d.z * one_over;
		const quern_real o = ri + rj - length;
		overlap[q] = o;
		arm_i[q] = ri - 0.5 * o;
		arm_j[q] = rj - 0.5 * o;
		effective[q] = ri * rj / (ri + rj);
	}
}

/* v_c = v_i - v_j + w_i x b_i - w_j x b_j with b_i = -arm_i n, b_j = arm_j n */
QUERN_INLINE void motion(
	const forces_shared *sh, const forces_work *w, uint32_t n, const int dim, const bool spin) {
	const quern_column v = sh->use[FORCE_OLD_VELOCITY], s = sh->use[FORCE_OLD_SPIN];
	const quern_real *restrict u = v.real[0], *restrict uy = v.real[1], *restrict uz = v.real[2];
	const quern_real *restrict s0 = s.real[0], *restrict s1 = s.real[1], *restrict s2 = s.real[2];
	const int32_t *restrict first = w->first, *restrict second = w->second;
	const quern_real *restrict nx = w->normal[0], *restrict ny = w->normal[1], *restrict nz = w->normal[2];
	const quern_real *restrict arm_i = w->arm[0], *restrict arm_j = w->arm[1];
	quern_real *restrict vx = w->velocity[0], *restrict vy = w->velocity[1], *restrict vz = w->velocity[2];
	quern_real *restrict sx = w->spin[0], *restrict sy = w->spin[1], *restrict sz = w->spin[2];
	quern_real *restrict tx = w->turn[0], *restrict ty = w->turn[1], *restrict tz = w->turn[2];
	QUERN_SIMD
	for (uint32_t q = 0; q < n; q++) {
		const int32_t i = first[q], j = second[q];
		quern_real x = u[i] - u[j], y = uy[i] - uy[j], z = dim == 3 ? uz[i] - uz[j] : 0;
		if (spin && dim == 2) {
			const quern_real wi = s0[i], wj = s0[j], sum = arm_i[q] * wi + arm_j[q] * wj;
			x += sum * ny[q];
			y -= sum * nx[q];
			sx[q] = wi - wj;
		}
		if (spin && dim == 3) {
			const quern_vec wi = { s0[i], s1[i], s2[i] }, wj = { s0[j], s1[j], s2[j] };
			const quern_vec sum = { arm_i[q] * wi.x + arm_j[q] * wj.x, arm_i[q] * wi.y + arm_j[q] * wj.y,
				arm_i[q] * wi.z + arm_j[q] * wj.z };
			x -= sum.y * nz[q] - sum.z * ny[q];
			y -= sum.z * nx[q] - sum.x * nz[q];
			z -= sum.x * ny[q] - sum.y * nx[q];
			sx[q] = wi.x - wj.x, sy[q] = wi.y - wj.y, sz[q] = wi.z - wj.z;
			tx[q] = 0.5 * (wi.x + wj.x), ty[q] = 0.5 * (wi.y + wj.y), tz[q] = 0.5 * (wi.z + wj.z);
		}
		vx[q] = x;
		vy[q] = y;
		if (dim == 3) vz[q] = z;
	}
}

/* m_i m_j/(m_i + m_j), where a fixed grain counts as a wall; weight min(w_i, w_j). */
static void masses(const forces_shared *sh, const forces_work *w, uint32_t n) {
	const quern_real *restrict mass = sh->use[FORCE_MASS].real[0], *restrict weight =
																	   sh->use[FORCE_WEIGHT].real[0];
	const int32_t *restrict fixed = sh->use[FORCE_FIXED].index, *restrict first = w->first,
							*restrict second = w->second;
	quern_real *restrict out = w->mass, *restrict share = w->weight;
	QUERN_SIMD
	for (uint32_t q = 0; q < n; q++) {
		const quern_real a = mass[first[q]], b = mass[second[q]];
		out[q] = a * b / (a + b);
	}
	if (fixed)
		for (uint32_t q = 0; q < n; q++) {
			out[q] = fixed[first[q]] ? mass[second[q]] : out[q];
			out[q] = fixed[second[q]] ? mass[first[q]] : out[q];
		}
	if (weight)
		for (uint32_t q = 0; q < n; q++) {
			const quern_real a = weight[first[q]], b = weight[second[q]];
			share[q] = a < b ? a : b;
		}
}

/* ---- sums ---- */
/* The row of a grain of the block; a partner outside has the spare row. */
QUERN_INLINE uint32_t row_of(int32_t grain, uint32_t begin, uint32_t end) {
	const uint32_t i = (uint32_t)grain - begin;
	return i < end - begin ? i : end - begin;
}

QUERN_INLINE void add_2d(
	const forces_work *w, uint32_t begin, uint32_t end, uint32_t n, const bool spin, const bool weighted) {
	for (uint32_t q = 0; q < n; q++) {
		quern_real *i = w->row[row_of(w->first[q], begin, end)],
				   *j = w->row[row_of(w->second[q], begin, end)];
		const quern_real share = weighted ? w->weight[q] : 1;
		const quern_real x = share * w->force[0][q], y = share * w->force[1][q],
						 t = spin ? share * w->torque[0][q] : 0;
		i[0] += x, i[1] += y;
		j[0] -= x, j[1] -= y;
		if (spin) i[2] += w->arm[0][q] * t, j[2] += w->arm[1][q] * t;
	}
}

/* The same, with what dashpots give in the lanes behind, and what sliding takes, which has its weight already. */
QUERN_INLINE void add_books_2d(
	const forces_work *w, uint32_t begin, uint32_t end, uint32_t n, const bool spin, const bool weighted) {
	static const lanes8 lever = { 0, 0, 1, 0, 0, 1, 0, 0 }, plain = { 1, 1, 0, 1, 1, 0, 1, 0 },
						against = { -1, -1, 0, -1, -1, 0, 0, 0 }, all = { 1, 1, 1, 1, 1, 1, 0, 0 },
						own = { 0, 0, 0, 0, 0, 0, 1, 0 };
	for (uint32_t q = 0; q < n; q++) {
		quern_real *i = w->row[row_of(w->first[q], begin, end)],
				   *j = w->row[row_of(w->second[q], begin, end)];
		const lanes8 f = { w->force[0][q], w->force[1][q], spin ? w->torque[0][q] : 0, w->dashpot[0][q],
			w->dashpot[1][q], spin ? w->drag_torque[0][q] : 0, w->rubbed[q], 0 };
		const lanes8 given = weighted ? (w->weight[q] * all + own) * f : f;
		*(lanes8 *)(void *)i += (plain + w->arm[0][q] * lever) * given;
		*(lanes8 *)(void *)j += (against + w->arm[1][q] * lever) * given;
	}
}

QUERN_INLINE void add_3d(const forces_work *w, uint32_t begin, uint32_t end, uint32_t n, const bool spin,
	const bool weighted, const bool books) {
	static const lanes8 lever = { 0, 0, 0, 1, 1, 1, 0, 0 }, plain = { 1, 1, 1, 0, 0, 0, 0, 0 },
						own = { 0, 0, 0, 0, 0, 0, 1, 0 };
	for (uint32_t q = 0; q < n; q++) {
		const uint32_t i = row_of(w->first[q], begin, end), j = row_of(w->second[q], begin, end);
		const quern_real share = weighted ? w->weight[q] : 1;
		const lanes8 to_first = share * (plain + w->arm[0][q] * lever),
					 to_second = share * (w->arm[1][q] * lever - plain);
		const lanes8 f = { w->force[0][q], w->force[1][q], w->force[2][q], spin ? w->torque[0][q] : 0,
			spin ? w->torque[1][q] : 0, spin ? w->torque[2][q] : 0, 0, 0 };
		*(lanes8 *)(void *)w->row[i] += to_first * f;
		*(lanes8 *)(void *)w->row[j] += to_second * f;
		if (!books) continue;
		const lanes8 d = { w->dashpot[0][q], w->dashpot[1][q], w->dashpot[2][q],
			spin ? w->drag_torque[0][q] : 0, spin ? w->drag_torque[1][q] : 0, spin ? w->drag_torque[2][q] : 0,
			w->rubbed[q], 0 };
		*(lanes8 *)(void *)w->drag_row[i] += (to_first + own) * d;
		*(lanes8 *)(void *)w->drag_row[j] += to_second * d;
	}
}

QUERN_INLINE void add_pairs(const forces_work *w, uint32_t first, uint32_t last, uint32_t n, const int dim,
	const bool spin, const bool weighted, const bool books) {
	if (dim == 3) add_3d(w, first, last, n, spin, weighted, books);
	else if (books) add_books_2d(w, first, last, n, spin, weighted);
	else add_2d(w, first, last, n, spin, weighted);
}

/* Forces and torques to the grains of a block, and with them, if they are booked, losses. */
QUERN_INLINE void add_all(const forces_shared *sh, const forces_work *w, quern_real *held, uint32_t first,
	uint32_t last, uint32_t n, const int dim, const bool spin) {
	const quern_real *weight = sh->use[FORCE_WEIGHT].real[0] ? w->weight : NULL;
	if (spin) dem_torques(w, w->force, w->torque, n, dim);
	if (sh->books && spin) dem_torques(w, w->dashpot, w->drag_torque, n, dim);
	if (sh->books) dem_rub(w, weight, held, n);
	if (sh->books && weight) add_pairs(w, first, last, n, dim, spin, true, true);
	else if (sh->books) add_pairs(w, first, last, n, dim, spin, false, true);
	else if (weight) add_pairs(w, first, last, n, dim, spin, true, false);
	else add_pairs(w, first, last, n, dim, spin, false, false);
	if (!spin || !sh->couple) return;
	quern_dem_add_couples(sh, w, w->row, (uint32_t)dim, w->couple, -1, first, last, n);
	if (sh->books)
		quern_dem_add_couples(sh, w, dim == 2 ? w->row : w->drag_row, dim == 2 ? LANE_DRAG + 2 : 3,
			w->drag_couple, -1, first, last, n);
}

QUERN_INLINE void block(
	const forces_shared *sh, forces_work *w, uint32_t b, quern_real *sums, const int dim, const bool spin) {
	const uint32_t first = sh->grain[b], last = sh->grain[b + 1];
	for (uint32_t begin = sh->contact[b], end = sh->contact[b + 1]; begin < end; begin += sh->cap) {
		const uint32_t n_slots = end - begin < sh->cap ? end - begin : sh->cap;
		quern_real *held = sh->use[FORCE_CONTACT_SHEARED].real[0];
		held = held && (sh->books || sh->starts) ? held + begin : NULL;
		const uint32_t n = compact(sh, w, begin, n_slots, held, dim);
		geometry(sh, w, n, dim);
		motion(sh, w, n, dim, spin);
		masses(sh, w, n);
		quern_dem_call_laws(sh, w, -1, begin, n_slots, n);
		if (sh->deep) quern_dem_check_contacts(sh, w, b, -1, n);
		add_all(sh, w, held, first, last, n, dim, spin);
		quern_dem_keep(w, w->force, sh->use[FORCE_CONTACT], (uint32_t)dim, begin, n_slots, n);
		quern_dem_keep(w, w->couple, sh->use[FORCE_CONTACT_COUPLE], dim == 3 ? 3 : 1, begin, n_slots, n);
		if (sh->looks) quern_dem_look(sh, w, held, n, first, last, sums);
	}
}

void quern_dem_pairs(const forces_shared *sh, forces_work *w, uint32_t b, quern_real *sums) {
	if (sh->s->dim == 2) {
		if (sh->spin) block(sh, w, b, sums, 2, true);
		else block(sh, w, b, sums, 2, false);
	} else if (sh->spin) block(sh, w, b, sums, 3, true);
	else block(sh, w, b, sums, 3, false);
}
