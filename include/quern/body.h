/* SPDX-License-Identifier: MIT */
/* quern/body.h - the kind `body`: geometry only; pose and motion are the host's, so that scripted and free bodies share it, and so do regions
 * of fills and sources, which are where a body at rest would be solid: gap <= 0, as far as that is within bounds() */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct quern_pose {
	quern_real position[3], turn[9], velocity[3], spin[3]; /* turn: row-major, body to scene */
} quern_pose;

typedef struct quern_body_batch {
	uint32_t n, cap, dim, pad;
	const quern_pose *pose;
	const quern_real *position[3], *radius; /* of grains; grid nodes come with what they keep from it */
	const int32_t *feature;  /* which face, edge or vertex, from `features`; NULL: the nearest */
	quern_real *gap;         /* m, distance to the surface minus radius; negative: overlap or inside */
	quern_real *normal[3];   /* unit, out of the body */
	quern_real *velocity[3]; /* m/s, of the surface at the nearest place */
} quern_body_batch;

typedef struct quern_body_ops {
	uint32_t size, pad;
	void (*closest)(const void *self, const quern_body_batch *); /* [batch] */
	/* [batch] features of this body, numbers from 0 on, whose surface may lie within `reach` of x; returns how many
	 * there are, and writes at most `cap`. A grain touches each of them that closest() finds near, with a history for
	 * each. NULL: the body is one feature, its nearest place */
	uint32_t (*features)(const void *self, const quern_pose *, const quern_real x[3], quern_real reach,
		uint32_t cap, int32_t *feature);
	/* [setup] box around it in its own frame, infinite where unbounded */
	void (*bounds)(const void *self, uint32_t dim, quern_real lower[3], quern_real upper[3]);
} quern_body_ops;

QUERN_KIND(body, quern_body_ops, "The shape of a rigid boundary.", QUERN_ONE(quern_body_ops, closest),
	QUERN_OPTIONALLY(quern_body_ops, features), QUERN_ONE(quern_body_ops, bounds));

#ifdef __cplusplus
}
#endif
