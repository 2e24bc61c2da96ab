/* SPDX-License-Identifier: MIT */
/* touches - grains of one block on bodies: geometry and motion, with the body for a second grain that never moves */
#include "packed.h"
#include <string.h>

/* The same grain stands for both, since whatever a law asks of the second it gets from the first. */
static void load(const forces_shared *sh, forces_work *w, const contact_chunk *c) {
	const quern_column *u = sh->use;
	const int32_t *grain = u[FORCE_GRAIN].index + c->begin;
	const quern_real *weight = u[FORCE_WEIGHT].real[0];
	for (uint32_t q = 0; q < c->n; q++) {
		const int32_t i = grain[q];
		w->first[q] = w->second[q] = i;
		w->slot[q] = (int32_t)q;
		w->radius[q] = u[FORCE_RADIUS].real[0][i];
		w->mass[q] = u[FORCE_MASS].real[0][i];
		if (weight) w->weight[q] = weight[i];
	}
}

/* A body that turns is faster at its surface than half an overlap away, in the middle of the contact. */
static void to_the_middle(const forces_work *w, const quern_pose *pose, uint32_t n, uint32_t dim) {
	const quern_vec spin = QUERN_VEC_OF(pose->spin);
	for (uint32_t q = 0; q < n; q++) {
		const quern_real overlap = w->overlap[q] > 0 ? w->overlap[q] : 0;
		const quern_vec v = quern_vec_axpy(-0.5 * overlap,
			quern_vec_cross(spin, QUERN_VEC_AT(w->normal, q, dim)), QUERN_VEC_AT(w->velocity, q, dim));
		QUERN_VEC_PUT(w->velocity, q, v, dim);
	}
}

/* Of the surface's velocity since the last forces, which is that in the middle of that time; x are the grains' centres. */
static void surface_means(
	const forces_shared *sh, const forces_work *w, const contact_chunk *c, quern_real *const x[3]) {
	const quern_pose *now = &sh->pose[c->body].pose, *middle = &sh->mean_pose[c->body].pose;
	const uint32_t dim = sh->s->dim;
	for (uint32_t k = 0; k < dim; k++) memcpy(w->mean_velocity[k], w->velocity[k], c->n * sizeof(quern_real));
	if (!sh->pose[c->body].moves && !sh->mean_pose[c->body].moves) return; /* it may just have stopped */
	const quern_vec drift = quern_vec_sub(QUERN_VEC_OF(middle->velocity), QUERN_VEC_OF(now->velocity)),
					turn = quern_vec_sub(QUERN_VEC_OF(middle->spin), QUERN_VEC_OF(now->spin));
	for (uint32_t q = 0; q < c->n; q++) {
		const quern_vec at =
			quern_vec_axpy(-w->arm[0][q], QUERN_VEC_AT(w->normal, q, dim), QUERN_VEC_AT(x, q, dim));
		const quern_vec more =
			quern_vec_add(drift, quern_vec_cross(turn, quern_vec_sub(at, QUERN_VEC_OF(now->position))));
		const quern_vec mean = quern_vec_add(QUERN_VEC_AT(w->mean_velocity, q, dim), more);
		QUERN_VEC_PUT(w->mean_velocity, q, mean, dim);
	}
}

/* Leaves the surface's velocity in that of the contact. */
static void geometry(const forces_shared *sh, forces_work *w, const contact_chunk *c) {
	const body_pose *at = &sh->pose[c->body];
	const quern_bound *bound = &sh->s->slot[SLOT_BODIES][c->body];
	const quern_body_ops *ops = bound->ops;
	quern_real *x[3] = { w->arm[1], w->force[0], w->force[1] }; /* free until the laws are called */
	for (uint32_t k = 0; k < sh->s->dim; k++)
		quern_gather(QUERN_VECTOR, x[k], sh->use[FORCE_OLD_POSITION].real[k], 0, w->first, c->n);
	if (at->repeats)
		quern_motion_bring_all(at, sh->s->dim, c->n, (const quern_real *const[3]) { x[0], x[1], x[2] }, x);
	for (uint32_t q = 0; q < c->n && ops->features; q++)
		w->feature[q] = sh->use[FORCE_FEATURE].index[c->begin + q];
	const quern_body_batch batch = { .n = c->n,
		.cap = sh->cap,
		.dim = sh->s->dim,
		.pose = &at->pose,
		.radius = w->radius,
		.feature = ops->features ? w->feature : NULL,
		.position = { x[0], x[1], x[2] },
		.gap = w->overlap,
		.normal = { w->normal[0], w->normal[1], w->normal[2] },
		.velocity = { w->velocity[0], w->velocity[1], w->velocity[2] } };
	ops->closest(bound->self, &batch);
	for (uint32_t q = 0; q < c->n; q++) {
		const quern_real gap =
			w->overlap[q]; /* a feature that is elsewhere may say infinity: no arm is as long */
		w->overlap[q] = gap < 1e100 ? -gap : -1e100;
		w->arm[0][q] = w->radius[q] - 0.5 * w->overlap[q];
	}
	if (at->moves) to_the_middle(w, &at->pose, c->n, sh->s->dim);
	for (uint32_t k = 0; k < sh->s->dim && at->moves && w->wall[0]; k++)
		memcpy(w->wall[k], w->velocity[k], c->n * sizeof(quern_real));
	if (sh->mean) surface_means(sh, w, c, x);
}

/* Of a grain, by `rows` of motion (packed.h), or as it is where there are none. */
QUERN_INLINE void motion_of(const forces_shared *sh, const lanes4 *rows, int32_t i, quern_vec *v,
	quern_vec *spin, const int dim, const bool spins) {
	const quern_column *u = sh->use;
	*spin = (quern_vec) { 0, 0, 0 };
	if (!rows) {
		*v = QUERN_VEC_AT(u[FORCE_OLD_VELOCITY].real, i, dim);
		if (spins && dim == 2) spin->z = u[FORCE_OLD_SPIN].real[0][i];
		if (spins && dim == 3) *spin = QUERN_VEC_AT(u[FORCE_OLD_SPIN].real, i, 3);
		return;
	}
	const lanes4 *row = &rows[packed_motions(dim) * (size_t)i];
	*v = (quern_vec) { row[0][0], row[0][1], dim == 3 ? row[0][2] : 0 };
	if (spins && dim == 2) spin->z = row[0][2];
	if (spins && dim == 3) *spin = (quern_vec) { row[1][0], row[1][1], row[1][2] };
}

/* v_c = v_i - v_body + w_i x b_i with b_i = -arm_i n; `velocity` comes with v_body. */
QUERN_INLINE void motion(const forces_shared *sh, const lanes4 *rows, const forces_work *w,
	quern_real *const velocity[3], quern_real *const turning[3], uint32_t n, const int dim,
	const bool spins) {
	for (uint32_t q = 0; q < n; q++) {
		const quern_real arm = w->arm[0][q];
		const quern_vec normal = QUERN_VEC_AT(w->normal, q, dim);
		quern_vec own, spin;
		motion_of(sh, rows, w->first[q], &own, &spin, dim, spins);
		quern_vec at = quern_vec_sub(own, QUERN_VEC_AT(velocity, q, dim));
		if (spins && dim == 2) {
			at.x += arm * spin.z * normal.y;
			at.y -= arm * spin.z * normal.x;
			turning[0][q] = spin.z;
		}
		if (spins && dim == 3) {
			const quern_vec half = quern_vec_scale(0.5, spin);
			at = quern_vec_sub(at, quern_vec_scale(arm, quern_vec_cross(spin, normal)));
			QUERN_VEC_PUT(turning, q, spin, 3);
			QUERN_VEC_PUT(w->turn, q, half, 3);
		}
		QUERN_VEC_PUT(velocity, q, at, dim);
	}
}

/* A law sees how a grain turns against what it touches. */
static void turn_with(
	const forces_work *w, quern_real *const turning[3], const quern_pose *pose, uint32_t n, uint32_t dim) {
	for (uint32_t q = 0; q < n; q++)
		for (uint32_t k = 0; k < (dim == 3 ? 3u : 1u); k++) {
			const quern_real of = pose->spin[dim == 3 ? k : 2];
			turning[k][q] -= of;
			if (dim == 3) w->turn[k][q] += 0.5 * of;
		}
}

/* By rows of motion, or NULL, and against a body in this pose. */
static void move(const forces_shared *sh, const lanes4 *rows, const forces_work *w,
	quern_real *const velocity[3], quern_real *const turning[3], const body_pose *pose, uint32_t n) {
	const uint32_t dim = sh->s->dim;
	if (dim == 2) {
		if (sh->spin) motion(sh, rows, w, velocity, turning, n, 2, true);
		else motion(sh, rows, w, velocity, turning, n, 2, false);
	} else if (sh->spin) motion(sh, rows, w, velocity, turning, n, 3, true);
	else motion(sh, rows, w, velocity, turning, n, 3, false);
	if (sh->spin && pose->moves) turn_with(w, turning, &pose->pose, n, dim);
}

/* ---- what the body gives ---- */

static void book_impulse(const forces_shared *sh, const forces_work *w, const contact_chunk *c) {
	const bool weighted = sh->use[FORCE_WEIGHT].real[0] != NULL;
	quern_real *impulse = body_booked(&sh->books_of_bodies, c->block, (uint32_t)c->body) + B_IMPULSE;
	for (uint32_t q = 0; q < c->n; q++)
		for (uint32_t k = 0; k < sh->s->dim; k++)
			impulse[k] += (weighted ? w->weight[q] : 1) * w->force[k][q] * sh->s->dt;
}

QUERN_INLINE quern_vec couple_at(quern_real *const couple[3], uint32_t q, uint32_t dim) {
	if (!couple[0]) return (quern_vec) { 0, 0, 0 };
	return dim == 3 ? QUERN_VEC_AT(couple, q, 3) : (quern_vec) { 0, 0, couple[0][q] };
}

/* A grain's centre, as the body's nearest image sees it. */
QUERN_INLINE quern_vec place_of(const forces_shared *sh, const contact_chunk *c, int32_t grain) {
	quern_real x[3] = { 0 };
	for (uint32_t k = 0; k < sh->s->dim; k++)
		x[k] = quern_motion_bring(&sh->pose[c->body], k, sh->use[FORCE_OLD_POSITION].real[k][grain]);
	return QUERN_VEC_OF(x);
}

/* About the pivot, of the force in the middle of the contact. */
static void book_twist(const forces_shared *sh, const forces_work *w, const contact_chunk *c) {
	const bool weighted = sh->use[FORCE_WEIGHT].real[0] != NULL;
	const uint32_t dim = sh->s->dim;
	const quern_vec pivot = QUERN_VEC_OF(sh->pose[c->body].pivot);
	quern_real *booked = body_booked(&sh->books_of_bodies, c->block, (uint32_t)c->body);
	for (uint32_t q = 0; q < c->n; q++) {
		const quern_vec x = place_of(sh, c, w->first[q]);
		const quern_vec at = quern_vec_axpy(-w->arm[0][q], QUERN_VEC_AT(w->normal, q, dim), x);
		const quern_vec moment =
			quern_vec_add(quern_vec_cross(quern_vec_sub(at, pivot), QUERN_VEC_AT(w->force, q, dim)),
				couple_at(w->couple, q, dim));
		const quern_real share = (weighted ? w->weight[q] : 1) * sh->s->dt;
		body_book_twist(booked, moment, share, dim);
	}
}

/* Power of a force and a couple where the body moves. */
QUERN_INLINE quern_real power(const forces_work *w, quern_real *const force[3], quern_real *const couple[3],
	quern_vec spin, uint32_t q, uint32_t dim) {
	return quern_vec_dot(QUERN_VEC_AT(force, q, dim), QUERN_VEC_AT(w->wall, q, dim), 3) +
		   quern_vec_dot(couple_at(couple, q, dim), spin, 3);
}

/* What a dashpot takes goes with the speed against the body; of that the grain's part is booked with the grain. */
static void book_work(
	const forces_shared *sh, const forces_work *w, const contact_chunk *c, quern_real *sums) {
	const bool weighted = sh->use[FORCE_WEIGHT].real[0] != NULL;
	const quern_vec spin = QUERN_VEC_OF(sh->pose[c->body].pose.spin);
	quern_real *work = body_booked(&sh->books_of_bodies, c->block, (uint32_t)c->body) + B_WORK;
	for (uint32_t q = 0; q < c->n; q++) {
		const quern_real share = (weighted ? w->weight[q] : 1) * sh->s->dt;
		if (sh->works) *work += share * power(w, w->force, w->couple, spin, q, sh->s->dim);
		if (sh->books) sums[E_DAMPED] += share * power(w, w->dashpot, w->drag_couple, spin, q, sh->s->dim);
	}
}

static void book(const forces_shared *sh, const forces_work *w, const contact_chunk *c, quern_real *sums) {
	book_impulse(sh, w, c);
	if (sh->twists) book_twist(sh, w, c);
	if (sh->pose[c->body].moves && w->wall[0]) book_work(sh, w, c, sums);
}

static int32_t item_at(const forces_shared *sh, uint32_t k) {
	return dem_item_on(sh->d, sh->material, sh->use[FORCE_GRAIN].index[k], sh->use[FORCE_BODY].index[k]);
}

/* A chunk is of one body, and of grains that have the same parameters on it. */
void quern_dem_touches(const forces_shared *sh, forces_work *w, uint32_t b, quern_real *sums) {
	const int32_t *body = sh->use[FORCE_BODY].index;
	for (uint32_t begin = sh->touch[b], end = sh->touch[b + 1], n; begin < end; begin += n) {
		const int32_t item = item_at(sh, begin);
		for (n = 1; begin + n < end && n < sh->cap && body[begin + n] == body[begin]; n++)
			if (sh->material && item_at(sh, begin + n) != item) break;
		const contact_chunk c = { b, body[begin], item, begin, n, n, NULL };
		load(sh, w, &c);
		geometry(sh, w, &c);
		move(sh, sh->predicts ? sh->motion : NULL, w, w->velocity, w->spin, &sh->pose[c.body], n);
		if (sh->mean) move(sh, NULL, w, w->mean_velocity, w->mean_spin, &sh->mean_pose[c.body], n);
		quern_dem_act(sh, w, &c, sums);
		book(sh, w, &c, sums);
	}
}
