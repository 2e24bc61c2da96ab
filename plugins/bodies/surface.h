/* SPDX-License-Identifier: MIT */
/* surface - the nearest place of a body's surface, between the scene and the body's own frame. docs/theory/bodies.md */
#pragma once
#include <quern/body.h>
#include <quern/vec.h>

/* Where a body is, read once before a loop: what a loop over columns stores might otherwise change it. */
typedef struct surface_pose {
	quern_real turn[9];
	quern_vec at, drift, spin;
} surface_pose;

QUERN_INLINE surface_pose surface_pose_of(const quern_pose *pose) {
	surface_pose p = { .at = QUERN_VEC_OF(pose->position),
		.drift = QUERN_VEC_OF(pose->velocity),
		.spin = QUERN_VEC_OF(pose->spin) };
	for (int k = 0; k < 9; k++) p.turn[k] = pose->turn[k];
	return p;
}

/* A place of the scene in the body's own frame. */
QUERN_INLINE quern_vec surface_inward(const surface_pose *p, quern_vec x) {
	return quern_vec_turn_back(p->turn, quern_vec_sub(x, p->at));
}

/* Of the surface `distance` back along the normal n from x; both of the scene. */
QUERN_INLINE quern_vec surface_velocity(
	const surface_pose *p, quern_vec x, quern_vec n, quern_real distance) {
	const quern_vec arm = quern_vec_sub(quern_vec_axpy(-distance, n, x), p->at);
	return quern_vec_add(p->drift, quern_vec_cross(p->spin, arm));
}

/* The square of a length below which a vector has no direction: nearer than that two places are one. */
QUERN_INLINE bool surface_has_way(quern_real square) { return square > 1e-280; }
