/* SPDX-License-Identifier: MIT */
/* bodies - what every body takes besides its own shape; the keys of a scene's `bodies` entries */
#pragma once
#include "motion.h"
#include <math.h>
#include <stdio.h>

enum { BODY_ALWAYS, BODY_SETTLING, BODY_RUNNING, BODY_NEVER };
enum { BOUNDARY_SLIP, BOUNDARY_STICKY, BOUNDARY_NONE };

typedef struct body_item {
	int32_t when;        /* BODY_* */
	int32_t boundary;    /* BOUNDARY_* on the continuum's grid */
	quern_real friction; /* of the boundary; NaN: the choice above holds */
	const char *name;    /* NULL: it has none */
	body_motion motion;
	const char *material;          /* a word; NULL: it has none */
	quern_real slip;               /* grain diameters, of a rough boundary; NaN: it is none */
	quern_real slow, fast, number; /* of a rough boundary's own mu(I): mu_s, mu_2, I_0; NaN: the material's */
	quern_real displacement; /* m, by which the continuum's surface lies before its own; 0 if it has none */
} body_item;

enum { BODY_WORDS = 120 };

/* What messages call body number i of the scene: "body 'floor', a body.plane", or by its number. */
static inline const char *quern_body_say(const quern_bound *body, uint32_t i, char out[BODY_WORDS]) {
	const char *name = ((const body_item *)body->item)->name;
	if (name) snprintf(out, BODY_WORDS, "body '%.50s', a %.50s", name, body->id);
	else snprintf(out, BODY_WORDS, "body %u, a %.50s", i, body->id);
	return out;
}

QUERN_INLINE bool quern_body_is_there(const quern_bound *body, bool settling) {
	const int32_t when = ((const body_item *)body->item)->when;
	return when == BODY_ALWAYS || (when != BODY_NEVER && (when == BODY_SETTLING) == settling);
}

/* And whether a continuum meets it. */
QUERN_INLINE bool quern_body_meets_points(const quern_bound *body, bool settling) {
	const body_item *item = body->item;
	return quern_body_is_there(body, settling) && !(item->boundary == BOUNDARY_NONE && isnan(item->friction));
}

/* Poses of all bodies of a slot, with the velocities of the time `rate`, until the stage returns; NULL: no memory. While
 * settling time has not begun. A body that never moves is where the scene put it, to the bit. */
static inline body_pose *quern_body_poses(
	const quern_step *s, uint32_t slot, quern_real time, quern_real rate) {
	const uint32_t n = s->n_slot[slot];
	body_pose *all = (body_pose *)s->host->memory(s->run, ((size_t)n + 1) * sizeof(body_pose));
	for (uint32_t b = 0; b < n && all; b++) {
		const body_motion *motion = &((const body_item *)s->slot[slot][b].item)->motion;
		body_pivot pivot;
		quern_motion_pivot(motion, &s->slot[slot][b], s->dim, &pivot);
		all[b] = quern_motion_still;
		for (int k = 0; k < 3; k++) all[b].pivot[k] = pivot.about[k];
		if (!quern_motion_is_any(motion)) continue;
		quern_motion_at(motion, &pivot, s->settling ? 0 : time, rate, &all[b]);
		if (!s->settling) continue;
		for (int k = 0; k < 3; k++) all[b].pose.velocity[k] = all[b].pose.spin[k] = 0;
		all[b].moves = false;
	}
	for (uint32_t b = 0; b < n && all; b++)
		quern_motion_repeat(&all[b], &s->slot[slot][b], s->dim, s->lower, s->upper, s->periodic);
	return all;
}

/* The same as they are now: at the beginning of this substep, or of the step. */
static inline body_pose *quern_body_poses_now(const quern_step *s, uint32_t slot) {
	const quern_real now = s->time + (quern_real)s->within * s->dt;
	return quern_body_poses(s, slot, now, now);
}

/* m/s, no less than the speed of any place of any body between two times. */
static inline quern_real quern_bodies_speed(
	const quern_step *s, uint32_t slot, quern_real from, quern_real to) {
	quern_real most = 0;
	for (uint32_t b = 0; b < s->n_slot[slot]; b++) {
		const body_motion *motion = &((const body_item *)s->slot[slot][b].item)->motion;
		if (!quern_motion_is_any(motion)) continue;
		const quern_real speed = quern_motion_speed(motion, &s->slot[slot][b], s, from, to);
		most = speed > most ? speed : most;
	}
	return most;
}

/* A step at t = 0 as far as the set-up knows it, for what looks at slots, gravity and domain alone. */
static inline quern_step quern_bodies_before(
	const quern_setup *setup, const quern_bound *const *slot, const uint32_t *n_slot) {
	quern_step s = {
		.dim = setup->dim, .slot = slot, .n_slot = n_slot, .host = setup->host, .stage_step = -1
	};
	for (uint32_t k = 0; k < 3; k++) {
		s.gravity[k] = setup->gravity[k];
		s.lower[k] = setup->lower[k], s.upper[k] = setup->upper[k];
		s.periodic[k] = setup->periodic[k];
	}
	return s;
}

/* Whether any body of a slot ever moves. */
static inline bool quern_bodies_move(const quern_bound *body, uint32_t n) {
	for (uint32_t b = 0; b < n; b++)
		if (quern_motion_is_any(&((const body_item *)body[b].item)->motion)) return true;
	return false;
}

/* Gap of one sphere to a body, or to one of its features, and the normal there (may be NULL). */
static inline quern_real quern_body_gap_of(const quern_bound *body, const body_pose *pose,
	const int32_t *feature, uint32_t dim, const quern_real x[3], quern_real radius, quern_real normal[3]) {
	_Alignas(64) quern_real at[3][QUERN_LANES], r[QUERN_LANES], gap[QUERN_LANES], n[3][QUERN_LANES],
		v[3][QUERN_LANES];
	_Alignas(64) int32_t which[QUERN_LANES];
	for (uint32_t i = 0; i < QUERN_LANES; i++) {
		for (uint32_t k = 0; k < 3; k++) at[k][i] = k < dim ? quern_motion_bring(pose, k, x[k]) : 0;
		r[i] = radius;
		which[i] = feature ? *feature : 0;
	}
	const quern_body_batch batch = { .n = 1,
		.cap = QUERN_LANES,
		.dim = dim,
		.pose = &pose->pose,
		.position = { at[0], at[1], at[2] },
		.radius = r,
		.feature = feature ? which : NULL,
		.gap = gap,
		.normal = { n[0], n[1], n[2] },
		.velocity = { v[0], v[1], v[2] } };
	((const quern_body_ops *)body->ops)->closest(body->self, &batch);
	for (uint32_t k = 0; normal && k < 3; k++) normal[k] = k < dim ? n[k][0] : 0;
	return gap[0];
}

/* The same to its nearest place. */
static inline quern_real quern_body_gap(const quern_bound *body, const body_pose *pose, uint32_t dim,
	const quern_real x[3], quern_real radius, quern_real normal[3]) {
	return quern_body_gap_of(body, pose, NULL, dim, x, radius, normal);
}
