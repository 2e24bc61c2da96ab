/* SPDX-License-Identifier: MIT */
/* integrate - moves the grains of one block, holds those that are fixed, and looks for those that are lost */
#include "forces.h"
#include <math.h>
#include <string.h>

/* How much of the old velocity the new one keeps. */
static void compare_velocities(const forces_shared *sh, uint32_t b, uint32_t begin, uint32_t n) {
	const quern_column *u = sh->use;
	const quern_real *restrict mass = u[FORCE_MASS].real[0] + begin;
	quern_real turned = 0, whole = 0;
	for (uint32_t k = 0; k < sh->s->dim; k++) {
		const quern_real *restrict old = u[FORCE_OLD_VELOCITY].real[k] + begin;
		const quern_real *restrict now = u[FORCE_VELOCITY].real[k] + begin;
		for (uint32_t i = 0; i < n; i++) turned += mass[i] * old[i] * now[i];
	}
	for (uint32_t i = 0; i < n; i++) whole += mass[i];
	sh->turned[2 * b] += turned;
	sh->turned[2 * b + 1] += whole;
}

/* What leaves this stage must be finite, and slower than a radius per step. */
static void check_grains(
	const forces_shared *sh, uint32_t b, uint32_t begin, uint32_t n, const forces_work *w) {
	const quern_column *u = sh->use;
	const quern_real *restrict radius = u[FORCE_RADIUS].real[0] + begin;
	const quern_real dt = sh->s->dt;
	quern_real farthest = sh->farthest[b];
	quern_real *restrict way = w->grains[G_WAY], *restrict fast = w->grains[G_WAY + 1];
	memset(way, 0, n * sizeof(quern_real));
	memset(fast, 0, n * sizeof(quern_real));
	for (uint32_t k = 0; k < sh->s->dim; k++) {
		const quern_real *restrict x = u[FORCE_POSITION].real[k] + begin, *restrict v =
																			  u[FORCE_VELOCITY].real[k] +
																			  begin;
		const quern_real *restrict anchor = u[FORCE_ANCHOR].real[k] + begin;
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			const quern_real d = x[i] - anchor[i];
			way[i] += d * d;
			fast[i] += v[i] * v[i];
		}
	}
	/* an unordered comparison finds a NaN too */
	for (uint32_t i = 0; i < n; i++) {
		const quern_real step = fast[i] * dt * dt, most = radius[i] * radius[i];
		farthest = way[i] > farthest ? way[i] : farthest;
		if (!(step <= most) && sh->bad[b] < 0) sh->bad[b] = (int32_t)(begin + i);
	}
	sh->farthest[b] = farthest;
}

static void load_grains(
	const forces_shared *sh, const forces_work *w, uint32_t begin, uint32_t row, uint32_t n) {
	const quern_column *u = sh->use;
	const uint32_t dim = sh->s->dim, n_spin = sh->spin ? (dim == 3 ? 3 : 1) : 0;
	const quern_real *weight = u[FORCE_WEIGHT].real[0], turning = quern_radius_inertia(dim);
	for (uint32_t i = 0; i < n; i++) {
		const quern_real m = (weight ? weight[begin + i] : 1) * u[FORCE_MASS].real[0][begin + i];
		const quern_real r = u[FORCE_RADIUS].real[0][begin + i];
		w->grains[G_MASS][i] = m;
		w->grains[G_INERTIA][i] = turning * m * r * r;
		for (uint32_t k = 0; k < dim; k++) w->grains[G_FORCE + k][i] = w->row[row + i][k];
		for (uint32_t k = 0; k < n_spin; k++) w->grains[G_TORQUE + k][i] = w->row[row + i][dim + k];
	}
}

/* Fixed grains stay; what they take up is an impulse on the others. */
static void hold_fixed(
	const forces_shared *sh, const forces_work *w, uint32_t b, uint32_t begin, uint32_t n) {
	const quern_column *u = sh->use;
	const int32_t *fixed = u[FORCE_FIXED].index;
	quern_real *support = body_booked(&sh->books_of_bodies, b, sh->n_bodies);
	for (uint32_t i = 0; i < n && fixed; i++) {
		if (!fixed[begin + i]) continue;
		for (uint32_t k = 0; k < sh->s->dim; k++) {
			support[k] -= w->grains[G_FORCE + k][i] * sh->s->dt;
			u[FORCE_POSITION].real[k][begin + i] = u[FORCE_OLD_POSITION].real[k][begin + i];
			u[FORCE_VELOCITY].real[k][begin + i] = u[FORCE_OLD_VELOCITY].real[k][begin + i];
		}
		for (uint32_t k = 0; k < (sh->s->dim == 3 ? 3u : 1u) && sh->spin; k++)
			u[FORCE_SPIN].real[k][begin + i] = u[FORCE_OLD_SPIN].real[k][begin + i];
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
		batch.position[k] = u[FORCE_OLD_POSITION].real[k] + begin;
		batch.velocity[k] = u[FORCE_OLD_VELOCITY].real[k] + begin;
		batch.new_position[k] = sh->looks ? w->grains[G_NEW_POSITION + k] : u[FORCE_POSITION].real[k] + begin;
		batch.new_velocity[k] = sh->looks ? w->grains[G_NEW_VELOCITY + k] : u[FORCE_VELOCITY].real[k] + begin;
		if (means) batch.mean_velocity[k] = w->grains[G_MEAN + k];
	}
	for (uint32_t k = 0; k < n_spin; k++) {
		batch.torque[k] = w->grains[G_TORQUE + k];
		batch.spin[k] = u[FORCE_OLD_SPIN].real[k] + begin;
		batch.new_spin[k] = sh->looks ? w->grains[G_NEW_SPIN + k] : u[FORCE_SPIN].real[k] + begin;
		if (means) batch.mean_spin[k] = w->grains[G_MEAN_SPIN + k];
	}
	((const quern_integrator_ops *)bound->ops)->close[dim - 2](bound->self, &batch);
}

void quern_dem_integrate(const forces_shared *sh, forces_work *w, uint32_t b, quern_real *sums) {
	const quern_column *sum = &sh->use[FORCE_SUM];
	for (uint32_t begin = sh->grain[b], end = sh->grain[b + 1]; begin < end; begin += GRAINS) {
		const uint32_t n = end - begin < GRAINS ? end - begin : GRAINS, row = begin - sh->grain[b];
		load_grains(sh, w, begin, row, n);
		for (uint32_t k = 0; k < sh->s->dim && sum->real[0]; k++)
			memcpy(sum->real[k] + begin, w->grains[G_FORCE + k], n * sizeof(quern_real));
		integrate(sh, w, begin, n);
		if (sh->looks) {
			quern_dem_have(sh, w, begin, n, sums);
			continue;
		}
		hold_fixed(sh, w, b, begin, n);
		if (sh->books) quern_dem_lose(sh, w, begin, row, n, sums);
		check_grains(sh, b, begin, n, w);
		compare_velocities(sh, b, begin, n);
	}
}
