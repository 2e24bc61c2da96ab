/* SPDX-License-Identifier: MIT */
/* integrate - moves the grains of one block, holds those that are fixed, and looks for those that are lost */
#include "packed.h"
#include <string.h>

/* The sum of n numbers, and the most of n that are not negative: at most GRAINS, in a tree of one shape for any n,
 * in which what is missing is 0. No number waits for all those before it. */
static void fill_up(quern_real *column, uint32_t n) {
	memset(column + n, 0, (GRAINS - n) * sizeof(quern_real));
}
static quern_real sum_up(quern_real *restrict column, uint32_t n) {
	fill_up(column, n);
	for (uint32_t half = GRAINS / 2; half; half /= 2) {
		const quern_real *upper = column + half;
		for (uint32_t i = 0; i < half; i++) column[i] += upper[i];
	}
	return column[0];
}
static quern_real most_of(quern_real *restrict column, uint32_t n) {
	fill_up(column, n);
	for (uint32_t half = GRAINS / 2; half; half /= 2) {
		const quern_real *upper = column + half;
		for (uint32_t i = 0; i < half; i++) column[i] = upper[i] > column[i] ? upper[i] : column[i];
	}
	return column[0];
}

/* The way since the last list and its square, if that is looked at here; how much of the velocity on the way of this step is kept on that of the
 * next; and 1 where a grain is lost: what leaves this stage must be finite, and slower than a radius per step. */
QUERN_INLINE void compare(const forces_shared *sh, const forces_work *w, uint32_t begin, uint32_t n,
	const int dim, const bool measured) {
	const quern_column *u = sh->use;
	const quern_real *restrict x = u[FORCE_POSITION].real[0] + begin,
							   *restrict y = u[FORCE_POSITION].real[1] + begin,
							   *restrict z = dim == 3 ? u[FORCE_POSITION].real[2] + begin : NULL;
	const quern_real *restrict ax = u[FORCE_ANCHOR].real[0] + begin,
							   *restrict ay = u[FORCE_ANCHOR].real[1] + begin,
							   *restrict az = dim == 3 ? u[FORCE_ANCHOR].real[2] + begin : NULL;
	const quern_real *restrict vx = u[FORCE_VELOCITY].real[0] + begin,
							   *restrict vy = u[FORCE_VELOCITY].real[1] + begin,
							   *restrict vz = dim == 3 ? u[FORCE_VELOCITY].real[2] + begin : NULL;
	const quern_real *restrict ox = w->grains[G_OLD_VELOCITY], *restrict oy = w->grains[G_OLD_VELOCITY + 1],
							   *restrict oz = w->grains[G_OLD_VELOCITY + 2];
	const quern_real *restrict mass = u[FORCE_MASS].real[0] + begin, *restrict radius =
																		 u[FORCE_RADIUS].real[0] + begin;
	const quern_real dt = sh->s->dt, waits = sh->waits;
	quern_real *restrict way = w->grains[G_WAY], *restrict kept = w->grains[G_KEPT],
						 *restrict whole = w->grains[G_WHOLE], *restrict lost = w->grains[G_LOST];
	quern_real *restrict along_x = w->grains[G_ALONG], *restrict along_y = w->grains[G_ALONG + 1],
						 *restrict along_z = w->grains[G_ALONG + 2];
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		const quern_vec now = { vx[i], vy[i], dim == 3 ? vz[i] : 0 },
						old = { ox[i], oy[i], dim == 3 ? oz[i] : 0 },
						next = quern_vec_axpy(waits, quern_vec_sub(now, old), now);
		const quern_real step = quern_vec_dot(now, now, dim) * dt * dt, most = radius[i] * radius[i];
		if (measured) {
			const quern_vec d = { x[i] - ax[i], y[i] - ay[i], dim == 3 ? z[i] - az[i] : 0 };
			way[i] = quern_vec_dot(d, d, dim);
			along_x[i] = d.x;
			along_y[i] = d.y;
			if (dim == 3) along_z[i] = d.z;
		}
		kept[i] = mass[i] * quern_vec_dot(old, next, dim);
		whole[i] = mass[i];
		lost[i] = step <= most ? 0 : 1; /* an unordered comparison finds a NaN too */
	}
}

/* Between what ways along each axis those of a block's grains lie. */
static void spread(const forces_shared *sh, uint32_t b, uint32_t begin, uint32_t n, const forces_work *w) {
	for (uint32_t k = 0; k < sh->s->dim; k++) {
		quern_real *range = sh->ways[b].along[k], least, most;
		quern_dem_range(w->grains[G_ALONG + k], n, &least, &most);
		const bool first = begin == sh->grain[b];
		range[0] = first || least < range[0] ? least : range[0];
		range[1] = first || most > range[1] ? most : range[1];
	}
}

/* How far grains have come since the last list. An integrator in two parts has that looked at after the first of them, which is when it decides
 * about a list. */
static void measure_ways(
	const forces_shared *sh, uint32_t b, uint32_t begin, uint32_t n, const forces_work *w) {
	if (sh->boxed) {
		quern_real *const *to = sh->use[FORCE_POSITION].real;
		quern_dem_box_ways(&sh->box_then, &sh->use[FORCE_BOX_LISTED], begin, n,
			(quern_real *const[3]) { to[0] + begin, to[1] + begin, sh->s->dim == 3 ? to[2] + begin : NULL },
			sh->use[FORCE_ANCHOR].real, w->grains[G_WAY]);
	}
	const quern_real farthest = most_of(w->grains[G_WAY], n);
	sh->farthest[b] = farthest > sh->farthest[b] ? farthest : sh->farthest[b];
	spread(sh, b, begin, n, w);
}

static void check_grains(
	const forces_shared *sh, uint32_t b, uint32_t begin, uint32_t n, const forces_work *w) {
	const bool flat = sh->s->dim == 2;
	quern_real none, lost;
	if (flat && sh->opens) compare(sh, w, begin, n, 2, false);
	else if (flat) compare(sh, w, begin, n, 2, true);
	else if (sh->opens) compare(sh, w, begin, n, 3, false);
	else compare(sh, w, begin, n, 3, true);
	if (!sh->opens) measure_ways(sh, b, begin, n, w);
	quern_dem_range(w->grains[G_LOST], n, &none, &lost);
	for (uint32_t i = 0; lost > 0 && i < n && sh->bad[b] < 0; i++)
		if (w->grains[G_LOST][i] > 0) sh->bad[b] = (int32_t)(begin + i);
	sh->turned[2 * b] += sum_up(w->grains[G_KEPT], n);
	sh->turned[2 * b + 1] += sum_up(w->grains[G_WHOLE], n);
}

/* Forces and torques from rows to columns, and what turns and resists. */
static void load_grains(
	const forces_shared *sh, const forces_work *w, uint32_t begin, uint32_t row, uint32_t n) {
	const quern_column *u = sh->use;
	const quern_real *restrict mass = u[FORCE_MASS].real[0] + begin, *restrict radius =
																		 u[FORCE_RADIUS].real[0] + begin;
	const quern_real *weight = u[FORCE_WEIGHT].real[0], turning = quern_radius_inertia(sh->s->dim);
	quern_real *restrict m = w->grains[G_MASS], *restrict inertia = w->grains[G_INERTIA];
	const lanes4 *half = (const lanes4 *)(const void *)w->row[row];
	for (uint32_t i = 0; i < n; i += 4, half += 8) { /* rows behind the last one are there to be looked at */
		lanes4 column[4];
		packed_turn((const lanes4[4]) { half[0], half[2], half[4], half[6] }, column);
		for (uint32_t k = 0; k < 2; k++) packed_put(w->grains[G_FORCE + k] + i, &column[k]);
		packed_put(w->grains[sh->s->dim == 2 ? G_TORQUE : G_FORCE + 2] + i, &column[2]);
		if (sh->s->dim == 2) continue;
		packed_put(w->grains[G_TORQUE] + i, &column[3]);
		packed_turn((const lanes4[4]) { half[1], half[3], half[5], half[7] }, column);
		for (uint32_t k = 0; k < 2; k++) packed_put(w->grains[G_TORQUE + 1 + k] + i, &column[k]);
	}
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) m[i] = mass[i];
	for (uint32_t i = 0; i < n && weight; i++) m[i] = weight[begin + i] * mass[i];
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) inertia[i] = turning * m[i] * radius[i] * radius[i];
}

/* Fixed grains stay; what they take up is an impulse on the others. */
static void hold_fixed(
	const forces_shared *sh, const forces_work *w, uint32_t b, uint32_t begin, uint32_t n) {
	const quern_column *u = sh->use;
	const int32_t *fixed = u[FORCE_FIXED].index;
	quern_real *support = body_booked(&sh->books_of_bodies, b, sh->n_bodies);
	int32_t any = 0;
	for (uint32_t i = 0; i < n && fixed; i++) any |= fixed[begin + i];
	for (uint32_t i = 0; i < n && any; i++) {
		if (!fixed[begin + i]) continue;
		for (uint32_t k = 0; k < sh->s->dim; k++) {
			support[k] -= w->grains[G_FORCE + k][i] * sh->s->dt;
			u[FORCE_POSITION].real[k][begin + i] = w->grains[G_OLD_POSITION + k][i];
			u[FORCE_VELOCITY].real[k][begin + i] = w->grains[G_OLD_VELOCITY + k][i];
		}
		for (uint32_t k = 0; k < (sh->s->dim == 3 ? 3u : 1u) && sh->spin; k++)
			u[FORCE_SPIN].real[k][begin + i] = w->grains[G_OLD_SPIN + k][i];
	}
}

/* The integrator's own columns: in place, or copies while nothing moves. */
static void own_columns(const forces_shared *sh, const forces_work *w, const quern_bound *bound,
	uint32_t begin, uint32_t n, quern_column *own) {
	for (uint32_t r = 0; r < bound->n_uses; r++) {
		const uint8_t shape = bound->uses[r].shape;
		own[r] = quern_column_from(bound->column[r], shape, begin);
		for (uint32_t k = 0; k < quern_shape_size(shape, sh->s->dim) && sh->looks; k++) {
			const void *whole = quern_component(&own[r], shape, k);
			if (!whole) continue;
			memcpy(w->own[r][k], whole, n * (shape == QUERN_INDEX ? sizeof(int32_t) : sizeof(quern_real)));
			quern_set_component(&own[r], shape, k, w->own[r][k]);
		}
	}
}

/* What a coupling will give in this step, ahead. */
static void add_lent(const forces_shared *sh, const forces_work *w, uint32_t begin, uint32_t n) {
	const quern_real *restrict m = w->grains[G_MASS];
	for (uint32_t k = 0; k < sh->s->dim && sh->use[FORCE_LENT].real[0]; k++) {
		const quern_real *restrict lent = sh->use[FORCE_LENT].real[k] + begin;
		quern_real *restrict f = w->grains[G_FORCE + k];
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) f[i] += m[i] * lent[i];
	}
}

/* n numbers as they are, where they can be read when the column has new ones: there is no second copy of it. */
static const quern_real *keep_old(quern_real *to, const quern_real *column, uint32_t n) {
	return memcpy(to, column, n * sizeof(quern_real));
}

static void integrate(const forces_shared *sh, const forces_work *w, uint32_t begin, uint32_t n) {
	const quern_bound *bound = dem_integrator(sh->s);
	const quern_column *u = sh->use;
	const uint32_t dim = sh->s->dim, n_spin = sh->spin ? (dim == 3 ? 3 : 1) : 0;
	const bool means = sh->books || sh->looks;
	quern_column own[QUERN_MOST_USES];
	quern_integrator_batch batch = { .n = n,
		.cap = GRAINS,
		.dt = sh->s->dt,
		.mass = w->grains[G_MASS],
		.inertia = w->grains[G_INERTIA],
		.use = own };
	own_columns(sh, w, bound, begin, n, own);
	for (uint32_t k = 0; k < dim; k++) {
		batch.gravity[k] = sh->s->gravity[k];
		batch.force[k] = w->grains[G_FORCE + k];
		batch.position[k] = keep_old(w->grains[G_OLD_POSITION + k], u[FORCE_OLD_POSITION].real[k] + begin, n);
		batch.velocity[k] = keep_old(w->grains[G_OLD_VELOCITY + k], u[FORCE_OLD_VELOCITY].real[k] + begin, n);
		batch.new_position[k] = sh->looks ? w->grains[G_NEW_POSITION + k] : u[FORCE_POSITION].real[k] + begin;
		batch.new_velocity[k] = sh->looks ? w->grains[G_NEW_VELOCITY + k] : u[FORCE_VELOCITY].real[k] + begin;
		if (means) batch.mean_velocity[k] = w->grains[G_MEAN + k];
	}
	for (uint32_t k = 0; k < n_spin; k++) {
		batch.torque[k] = w->grains[G_TORQUE + k];
		batch.spin[k] = keep_old(w->grains[G_OLD_SPIN + k], u[FORCE_OLD_SPIN].real[k] + begin, n);
		batch.new_spin[k] = sh->looks ? w->grains[G_NEW_SPIN + k] : u[FORCE_SPIN].real[k] + begin;
		if (means) batch.mean_spin[k] = w->grains[G_MEAN_SPIN + k];
	}
	((const quern_integrator_ops *)bound->ops)->close[dim - 2](bound->self, &batch);
}

/* Who looks between steps wants velocities in the middle of a kick. An integrator that moves a part of the way after it leaves such. */
static void look_at_motion(const forces_shared *sh, const forces_work *w, uint32_t begin, uint32_t n) {
	const quern_column *u = sh->use;
	const uint32_t dim = sh->s->dim, n_spin = sh->spin ? (dim == 3 ? 3 : 1) : 0;
	if (!(quern_integrator_ahead(dem_integrator(sh->s)->ops, dim) > 0)) {
		integrate(sh, w, begin, n);
		return;
	}
	for (uint32_t k = 0; k < dim; k++)
		memcpy(w->grains[G_MEAN + k], u[FORCE_OLD_VELOCITY].real[k] + begin, n * sizeof(quern_real));
	for (uint32_t k = 0; k < n_spin; k++)
		memcpy(w->grains[G_MEAN_SPIN + k], u[FORCE_OLD_SPIN].real[k] + begin, n * sizeof(quern_real));
}

void quern_dem_integrate(const forces_shared *sh, forces_work *w, uint32_t b, quern_real *sums) {
	const quern_column *sum = &sh->use[FORCE_SUM];
	for (uint32_t begin = sh->grain[b], end = sh->grain[b + 1]; begin < end; begin += GRAINS) {
		const uint32_t n = end - begin < GRAINS ? end - begin : GRAINS, row = begin - sh->grain[b];
		load_grains(sh, w, begin, row, n);
		for (uint32_t k = 0; k < sh->s->dim && sum->real[0]; k++)
			memcpy(sum->real[k] + begin, w->grains[G_FORCE + k], n * sizeof(quern_real));
		add_lent(sh, w, begin, n);
		if (sh->looks) {
			look_at_motion(sh, w, begin, n);
			quern_dem_have(sh, w, begin, n, sums);
			continue;
		}
		integrate(sh, w, begin, n);
		hold_fixed(sh, w, b, begin, n);
		if (sh->books) quern_dem_lose(sh, w, begin, row, n, sums);
		check_grains(sh, b, begin, n, w);
	}
}
