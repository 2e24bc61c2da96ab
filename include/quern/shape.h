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
	const quern_real *position[3]; /* m from the grid's lower corner; by round-off it may lie beyond a wall */
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
	/* Of a full cell's mass, at most 0.1: the force of a node that holds less is limited to what it would be with that. For two points per cell and axis;
	 * the fewer there are, the more. 0 counts as 0.001, for any number: more is asked for where slopes do not vanish with the functions, so that a
	 * node may feel a full force however little it holds. */
	quern_real light;
} quern_shape_ops;

/* The share of a full cell's mass below which a node is light, with so many points per cell and axis. */
QUERN_INLINE quern_real quern_shape_light(const quern_shape_ops *ops, quern_real points) {
	return ops->light > 0 ? ops->light * 2 / points : 1e-3;
}

QUERN_KIND(shape, quern_shape_ops, "Weights of grid nodes at a particle.",
	QUERN_ONE(quern_shape_ops, weights), QUERN_ONE(quern_shape_ops, shares),
	QUERN_ONE(quern_shape_ops, stiffness), QUERN_OPTIONALLY(quern_shape_ops, beyond));

#ifdef __cplusplus
}
#endif
