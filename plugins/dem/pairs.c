/* SPDX-License-Identifier: MIT */
/* pairs - contacts between grains of one block: the distance test, geometry and motion */
#include "forces.h"

/* Slots whose grains are within the laws' reach, in list order; and those whose spring was still loaded, so that what
 * it held is booked. */
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

static int32_t item_at(const forces_shared *sh, uint32_t k) {
	return dem_item(sh->d, sh->material, sh->use[FORCE_FIRST].index[k], sh->use[FORCE_SECOND].index[k]);
}

/* How many of n entries of the list have the parameters of the first: they are sorted by that, so that the end is found by
 * halving. */
static uint32_t alike(const forces_shared *sh, uint32_t begin, uint32_t n) {
	uint32_t low = 1, high = n;
	if (!sh->material) return n;
	const int32_t item = item_at(sh, begin);
	while (low < high) {
		const uint32_t middle = low + (high - low + 1) / 2;
		if (item_at(sh, begin + middle - 1) == item) low = middle;
		else high = middle - 1;
	}
	return low;
}

QUERN_INLINE void block(
	const forces_shared *sh, forces_work *w, uint32_t b, quern_real *sums, const int dim, const bool spin) {
	for (uint32_t begin = sh->contact[b], end = sh->contact[b + 1], n; begin < end; begin += n) {
		n = alike(sh, begin, end - begin < sh->cap ? end - begin : sh->cap);
		contact_chunk c = { .block = b,
			.body = -1,
			.item = item_at(sh, begin),
			.begin = begin,
			.n_slots = n,
			.held = quern_dem_held(sh, FORCE_CONTACT_SHEARED, begin) };
		c.n = compact(sh, w, begin, c.n_slots, c.held, dim);
		geometry(sh, w, c.n, dim);
		motion(sh, w, c.n, dim, spin);
		masses(sh, w, c.n);
		quern_dem_act(sh, w, &c, sums);
	}
}

void quern_dem_pairs(const forces_shared *sh, forces_work *w, uint32_t b, quern_real *sums) {
	if (sh->s->dim == 2) {
		if (sh->spin) block(sh, w, b, sums, 2, true);
		else block(sh, w, b, sums, 2, false);
	} else if (sh->spin) block(sh, w, b, sums, 3, true);
	else block(sh, w, b, sums, 3, false);
}
