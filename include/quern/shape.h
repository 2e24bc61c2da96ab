/* SPDX-License-Identifier: MIT */
/* quern/shape.h - the kind `shape`: separable weights of a chunk, three nodes per axis (unused ones zero) */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct quern_shape_batch {
	uint32_t n, cap, dim, pad;
	quern_real inverse_cell;       /* 1/m */
	const quern_real *position[3]; /* m from the grid's lower corner */
	int32_t wall
		[3]
		[2]; /* node index of walls on node lines, INT32_MIN and INT32_MAX where there is none within two cells */
	int32_t *first[3];       /* lowest node of the support; after folding never beyond a wall's far side */
	quern_real *value[3][3]; /* [axis][node] */
	quern_real *slope[3][3]; /* 1/m */
} quern_shape_batch;

typedef struct quern_shape_ops {
	uint32_t size, pad;
	void (*weights)(
		const void *self, const quern_shape_batch *); /* [batch] completeness up to the walls, 1e-13 */
	/* [setup] the volume of a node on a wall and of the next one, over that of a node inside */
	void (*shares)(const void *self, quern_real *wall, quern_real *next);
	quern_real (*stiffness)(
		const void *self); /* [setup] chi h^2 of the step limit, model of docs/theory/mpm.md */
	/* [step] may be NULL, for that of hats: of a node that stands `to_wall` cells above a wall (many: above none), the volume above the place that is `from` cells above the
	 * node (negative: below it), over that of a node inside; nothing is below the wall */
	quern_real (*beyond)(const void *self, int32_t to_wall, quern_real from);
} quern_shape_ops;

QUERN_KIND(shape, quern_shape_ops, "Weights of grid nodes at a particle.",
	QUERN_ONE(quern_shape_ops, weights), QUERN_ONE(quern_shape_ops, shares),
	QUERN_ONE(quern_shape_ops, stiffness), QUERN_OPTIONALLY(quern_shape_ops, beyond));

#ifdef __cplusplus
}
#endif
