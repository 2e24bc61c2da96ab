/* SPDX-License-Identifier: MIT */
/* touches - grains of one block on bodies: the same laws, with the body for a second grain that never moves */
#include "forces.h"

/* One body's grains of this block: the same laws, with the body for a second grain that never moves. */
QUERN_INLINE void touch_body(const forces_shared *sh, forces_work *w, uint32_t body, uint32_t begin,
	uint32_t n, const int dim, const bool spin) {
	static const quern_pose still = { .turn = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } };
	const quern_bound *bound = &sh->s->slot[SLOT_BODIES][body];
	const quern_column *u = sh->use;
	const int32_t *restrict grain = u[FORCE_GRAIN].index + begin;
	const quern_real *weight = u[FORCE_WEIGHT].real[0];
	quern_real *x[3] = { w->arm[1], w->force[0], w->force[1] }; /* free until the laws are called */
	for (uint32_t q = 0; q < n; q++) {
		const int32_t i = grain[q];
		w->first[q] = w->second[q] = i;
		w->slot[q] = (int32_t)q;
		w->radius[q] = u[FORCE_RADIUS].real[0][i];
		w->mass[q] = u[FORCE_MASS].real[0][i];
		if (weight) w->weight[q] = weight[i];
		for (int k = 0; k < dim; k++) x[k][q] = u[FORCE_OLD_POSITION].real[k][i];
	}
	const quern_body_ops *ops = bound->ops;
	for (uint32_t q = 0; q < n && ops->features; q++) w->feature[q] = u[FORCE_FEATURE].index[begin + q];
	const quern_body_batch batch = { .n = n,
		.cap = sh->cap,
		.dim = (uint32_t)dim,
		.pose = &still,
		.radius = w->radius,
		.feature = ops->features ? w->feature : NULL,
		.position = { x[0], x[1], x[2] },
		.gap = w->overlap,
		.normal = { w->normal[0], w->normal[1], w->normal[2] },
		.velocity = { w->velocity[0], w->velocity[1], w->velocity[2] } };
	ops->closest(bound->self, &batch);
	for (uint32_t q = 0; q < n; q++) {
		const int32_t i = grain[q];
		w->overlap[q] = -w->overlap[q];
		const quern_real arm = w->radius[q] - 0.5 * w->overlap[q];
		quern_real *v[3] = { w->velocity[0], w->velocity[1], w->velocity[2] };
		for (int k = 0; k < dim; k++) v[k][q] = u[FORCE_OLD_VELOCITY].real[k][i] - v[k][q];
		w->arm[0][q] = arm;
		if (spin && dim == 2) {
			const quern_real turning = u[FORCE_OLD_SPIN].real[0][i];
			v[0][q] += arm * turning * w->normal[1][q];
			v[1][q] -= arm * turning * w->normal[0][q];
			w->spin[0][q] = turning;
		}
		if (spin && dim == 3) {
			const quern_vec s = { u[FORCE_OLD_SPIN].real[0][i], u[FORCE_OLD_SPIN].real[1][i],
				u[FORCE_OLD_SPIN].real[2][i] };
			const quern_vec c =
				quern_vec_cross(s, (quern_vec) { w->normal[0][q], w->normal[1][q], w->normal[2][q] });
			v[0][q] -= arm * c.x, v[1][q] -= arm * c.y, v[2][q] -= arm * c.z;
			w->spin[0][q] = s.x, w->spin[1][q] = s.y, w->spin[2][q] = s.z;
			w->turn[0][q] = 0.5 * s.x, w->turn[1][q] = 0.5 * s.y, w->turn[2][q] = 0.5 * s.z;
		}
	}
}

QUERN_INLINE void add_touches(const forces_shared *sh, const forces_work *w, quern_real (*row)[8],
	uint32_t lane, quern_real *const force[3], quern_real *const torque[3], uint32_t first, uint32_t n,
	const int dim, const bool spin) {
	const bool weighted = sh->use[FORCE_WEIGHT].real[0] != NULL;
	for (uint32_t q = 0; q < n; q++) {
		quern_real *r = row[(uint32_t)w->first[q] - first];
		const quern_real share = weighted ? w->weight[q] : 1;
		for (int k = 0; k < dim; k++) r[(int)lane + k] += share * force[k][q];
		for (int k = 0; k < (dim == 3 ? 3 : 1) && spin; k++)
			r[(int)lane + dim + k] += share * w->arm[0][q] * torque[k][q];
	}
}

QUERN_INLINE void add_losses(const forces_shared *sh, const forces_work *w, quern_real *held, int32_t body,
	uint32_t first, uint32_t last, uint32_t n, const int dim, const bool spin) {
	quern_real(*row)[8] = dim == 2 ? w->row : w->drag_row;
	const uint32_t lane = dim == 2 ? LANE_DRAG : 0;
	if (spin) dem_torques(w, w->dashpot, w->drag_torque, n, dim);
	add_touches(sh, w, row, lane, w->dashpot, w->drag_torque, first, n, dim, spin);
	if (spin && sh->couple)
		quern_dem_add_couples(sh, w, row, lane + (uint32_t)dim, w->drag_couple, body, first, last, n);
	dem_rub(w, sh->use[FORCE_WEIGHT].real[0] ? w->weight : NULL, held, n);
	for (uint32_t q = 0; q < n; q++) row[(uint32_t)w->first[q] - first][LANE_RUBBED] += w->rubbed[q];
}

QUERN_INLINE void block(
	const forces_shared *sh, forces_work *w, uint32_t b, quern_real *sums, const int dim, const bool spin) {
	const int32_t *body = sh->use[FORCE_BODY].index;
	const uint32_t first = sh->grain[b], last = sh->grain[b + 1];
	for (uint32_t begin = sh->touch[b], end = sh->touch[b + 1], n; begin < end; begin += n) {
		for (n = 1; begin + n < end && n < sh->cap && body[begin + n] == body[begin]; n++) {}
		touch_body(sh, w, (uint32_t)body[begin], begin, n, dim, spin);
		quern_dem_call_laws(sh, w, body[begin], begin, n, n);
		if (sh->deep) quern_dem_check_contacts(sh, w, b, body[begin], n);
		if (spin) dem_torques(w, w->force, w->torque, n, dim);
		add_touches(sh, w, w->row, 0, w->force, w->torque, first, n, dim, spin);
		if (spin && sh->couple)
			quern_dem_add_couples(sh, w, w->row, (uint32_t)dim, w->couple, body[begin], first, last, n);
		quern_dem_keep(w, w->force, sh->use[FORCE_TOUCH], (uint32_t)dim, begin, n, n);
		quern_dem_keep(w, w->couple, sh->use[FORCE_TOUCH_COUPLE], dim == 3 ? 3 : 1, begin, n, n);
		quern_real *impulse = sh->impulse + ((size_t)b * (sh->n_bodies + 1) + (uint32_t)body[begin]) * 3;
		for (uint32_t q = 0; q < n; q++)
			for (int k = 0; k < dim; k++)
				impulse[k] += (sh->use[FORCE_WEIGHT].real[0] ? w->weight[q] : 1) * w->force[k][q] * sh->s->dt;
		quern_real *held = sh->use[FORCE_TOUCH_SHEARED].real[0];
		held = held && (sh->books || sh->starts) ? held + begin : NULL;
		if (sh->books) add_losses(sh, w, held, body[begin], first, last, n, dim, spin);
		if (sh->looks) quern_dem_look(sh, w, held, n, first, last, sums);
	}
}

void quern_dem_touches(const forces_shared *sh, forces_work *w, uint32_t b, quern_real *sums) {
	if (sh->s->dim == 2) {
		if (sh->spin) block(sh, w, b, sums, 2, true);
		else block(sh, w, b, sums, 2, false);
	} else if (sh->spin) block(sh, w, b, sums, 3, true);
	else block(sh, w, b, sums, 3, false);
}
