/* SPDX-License-Identifier: MIT */
/* touches - grains of one block on bodies: geometry and motion, with the body for a second grain that never moves */
#include "forces.h"

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

/* Leaves the surface's velocity in that of the contact. */
static void geometry(const forces_shared *sh, forces_work *w, const contact_chunk *c) {
	static const quern_pose still = { .turn = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } };
	const quern_bound *bound = &sh->s->slot[SLOT_BODIES][c->body];
	const quern_body_ops *ops = bound->ops;
	quern_real *x[3] = { w->arm[1], w->force[0], w->force[1] }; /* free until the laws are called */
	for (uint32_t k = 0; k < sh->s->dim; k++)
		quern_gather(QUERN_VECTOR, x[k], sh->use[FORCE_OLD_POSITION].real[k], 0, w->first, c->n);
	for (uint32_t q = 0; q < c->n && ops->features; q++)
		w->feature[q] = sh->use[FORCE_FEATURE].index[c->begin + q];
	const quern_body_batch batch = { .n = c->n,
		.cap = sh->cap,
		.dim = sh->s->dim,
		.pose = &still,
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
}

/* v_c = v_i - v_body + w_i x b_i with b_i = -arm_i n */
QUERN_INLINE void motion(
	const forces_shared *sh, const forces_work *w, uint32_t n, const int dim, const bool spin) {
	quern_real *const *v = sh->use[FORCE_OLD_VELOCITY].real, *const *s = sh->use[FORCE_OLD_SPIN].real;
	for (uint32_t q = 0; q < n; q++) {
		const int32_t i = w->first[q];
		const quern_real arm = w->arm[0][q];
		const quern_vec normal = QUERN_VEC_AT(w->normal, q, dim);
		quern_vec at = quern_vec_sub(QUERN_VEC_AT(v, i, dim), QUERN_VEC_AT(w->velocity, q, dim));
		if (spin && dim == 2) {
			at.x += arm * s[0][i] * normal.y;
			at.y -= arm * s[0][i] * normal.x;
			w->spin[0][q] = s[0][i];
		}
		if (spin && dim == 3) {
			const quern_vec own = QUERN_VEC_AT(s, i, 3), half = quern_vec_scale(0.5, own);
			at = quern_vec_sub(at, quern_vec_scale(arm, quern_vec_cross(own, normal)));
			QUERN_VEC_PUT(w->spin, q, own, 3);
			QUERN_VEC_PUT(w->turn, q, half, 3);
		}
		QUERN_VEC_PUT(w->velocity, q, at, dim);
	}
}

static void move(const forces_shared *sh, const forces_work *w, uint32_t n) {
	if (sh->s->dim == 2) {
		if (sh->spin) motion(sh, w, n, 2, true);
		else motion(sh, w, n, 2, false);
	} else if (sh->spin) motion(sh, w, n, 3, true);
	else motion(sh, w, n, 3, false);
}

/* What the body gives. */
static void book_impulse(const forces_shared *sh, const forces_work *w, const contact_chunk *c) {
	const bool weighted = sh->use[FORCE_WEIGHT].real[0] != NULL;
	quern_real *impulse = sh->impulse + ((size_t)c->block * (sh->n_bodies + 1) + (uint32_t)c->body) * 3;
	for (uint32_t q = 0; q < c->n; q++)
		for (uint32_t k = 0; k < sh->s->dim; k++)
			impulse[k] += (weighted ? w->weight[q] : 1) * w->force[k][q] * sh->s->dt;
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
		const contact_chunk c = { b, body[begin], item, begin, n, n,
			quern_dem_held(sh, FORCE_TOUCH_SHEARED, begin) };
		load(sh, w, &c);
		geometry(sh, w, &c);
		move(sh, w, n);
		quern_dem_act(sh, w, &c, sums);
		book_impulse(sh, w, &c);
	}
}
