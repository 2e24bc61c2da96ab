/* SPDX-License-Identifier: MIT */
/* bodies - what every body takes besides its own shape; the keys of a scene's `bodies` entries */
#pragma once
#include <math.h>
#include <quern/body.h>
#include <quern/solver.h>
#include <stdio.h>

enum { BODY_ALWAYS, BODY_SETTLING, BODY_RUNNING };
enum { BOUNDARY_SLIP, BOUNDARY_STICKY, BOUNDARY_NONE };

typedef struct body_item {
	int32_t when;         /* BODY_* */
	int32_t boundary;     /* BOUNDARY_* on the continuum's grid */
	quern_real friction;  /* of the boundary; NaN: the choice above holds */
	const char *name;     /* NULL: it has none */
	const char *material; /* a word; NULL: it has none */
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
	return when == BODY_ALWAYS || (when == BODY_SETTLING) == settling;
}

/* Gap of one sphere to a body that stands where the scene put it, or to one of its features, and the normal there
 * (may be NULL). */
static inline quern_real quern_body_gap_of(const quern_bound *body, const int32_t *feature, uint32_t dim,
	const quern_real x[3], quern_real radius, quern_real normal[3]) {
	static const quern_pose still = { .turn = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } };
	_Alignas(64) quern_real at[3][QUERN_LANES], r[QUERN_LANES], gap[QUERN_LANES], n[3][QUERN_LANES],
		v[3][QUERN_LANES];
	_Alignas(64) int32_t which[QUERN_LANES];
	for (uint32_t i = 0; i < QUERN_LANES; i++) {
		for (uint32_t k = 0; k < 3; k++) at[k][i] = k < dim ? x[k] : 0;
		r[i] = radius;
		which[i] = feature ? *feature : 0;
	}
	const quern_body_batch batch = { .n = 1,
		.cap = QUERN_LANES,
		.dim = dim,
		.pose = &still,
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
static inline quern_real quern_body_gap(
	const quern_bound *body, uint32_t dim, const quern_real x[3], quern_real radius, quern_real normal[3]) {
	return quern_body_gap_of(body, NULL, dim, x, radius, normal);
}
