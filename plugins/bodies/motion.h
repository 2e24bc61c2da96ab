/* SPDX-License-Identifier: MIT */
/* motion - where a body is at a time, and how fast it moves: a function of its keys and of time alone, so that nothing is stored
 * and nothing drifts. docs/theory/bodies.md, section 3 */
#pragma once
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
	bool moves; /* it is under way now */
} body_pose;

/* Whether the body ever moves. */
bool quern_motion_is_any(const body_motion *);
/* Where it is at `time`, with the velocities of time `rate`. */
void quern_motion_at(const body_motion *, const body_pivot *, quern_real time, quern_real rate, body_pose *);
/* False where the body has no middle and its motion names no place: along that axis `about` is then 0. */
bool quern_motion_pivot(const body_motion *, const quern_bound *body, uint32_t dim, body_pivot *);
/* Most that any place of it within a domain moves in a second at these velocities: m/s. */
quern_real quern_motion_speed(
	const body_pose *, uint32_t dim, const quern_real lower[3], const quern_real upper[3]);
