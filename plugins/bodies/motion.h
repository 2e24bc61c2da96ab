/* SPDX-License-Identifier: MIT */
/* motion - where a body is at a time, and how fast it moves: a function of its keys and of time alone, so that nothing is stored
 * and nothing drifts. docs/theory/bodies.md, section 3 */
#pragma once
#include <math.h>
#include <quern/body.h>
#include <quern/solver.h>

/* Keys `motion` of a body. What stands there adds up; all turning is about one axis. */
typedef struct body_motion {
	quern_real velocity[3], spin;                     /* m/s, rad/s, from `from` until `until` */
	quern_real amplitude[3], swing, frequency, phase; /* m, rad, 1/s, rad: of a to and fro */
	quern_list table;                                 /* of body_place */
	quern_real axis[3], about[3]; /* of any length; a place of the body at first. NaN: along z, its middle */
	quern_real from, until;       /* s */
} body_motion;

/* What a body turns about: a unit vector, and a place as it stands at first. */
typedef struct body_pivot {
	quern_real axis[3], about[3];
} body_pivot;

/* A row of the table: how far the body has come, and turned. Between two of them straight. */
typedef struct body_place {
	quern_real time, shift[3], angle; /* s, m, rad */
} body_place;

/* A pose, and the place that the body turns about, of which its torque is told. */
typedef struct body_pose {
	quern_pose pose;
	quern_real pivot[3];
	bool moves;   /* it is under way now */
	bool repeats; /* through periodic faces: it is the image nearest to a place that counts there */
	quern_real middle[3], length[3]; /* of its bounding box; of the domain where it repeats, else 0 */
} body_pose;

/* Where a body is that never moves and never repeats. */
extern const body_pose quern_motion_still;

/* Whether the body ever moves. */
bool quern_motion_is_any(const body_motion *);
/* Where it is at `time`, with the velocities of time `rate`. */
void quern_motion_at(const body_motion *, const body_pivot *, quern_real time, quern_real rate, body_pose *);
/* False where the body has no middle and its motion names no place: along that axis `about` is then 0. */
bool quern_motion_pivot(const body_motion *, const quern_bound *body, uint32_t dim, body_pivot *);
/* Notes along which periodic axes the body repeats: those that it does not fill from end to end. */
void quern_motion_repeat(body_pose *, const quern_bound *body, uint32_t dim, const quern_real lower[3],
	const quern_real upper[3], const bool periodic[3]);
/* A place as the image nearest to it sees it. */
QUERN_INLINE quern_real quern_motion_bring(const body_pose *p, uint32_t k, quern_real x) {
	const quern_real length = p->length[k];
	return length > 0 ? x - length * floor((x - p->middle[k]) / length + 0.5) : x;
}
/* The same of n places, from columns to columns. */
static inline void quern_motion_bring_all(
	const body_pose *p, uint32_t dim, uint32_t n, const quern_real *const from[3], quern_real *const to[3]) {
	for (uint32_t k = 0; k < dim; k++)
		for (uint32_t i = 0; i < n; i++) to[k][i] = quern_motion_bring(p, k, from[k][i]);
}
/* m/s, no less than the speed of any place of the body at any time between these two; where it has no bounds, of any place in
 * the domain as it stood at first. */
quern_real quern_motion_speed(
	const body_motion *, const quern_bound *body, const quern_step *, quern_real from, quern_real to);
