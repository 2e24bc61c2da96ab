/* SPDX-License-Identifier: MIT */
/* meet - which grains belong to which block of the grid, and which of them meet continuum there */
#pragma once
#include "../common/stencil.h"
#include "hybrid.h"

typedef struct residents {
	uint32_t *begin; /* by block, n_blocks + 1 */
	int32_t *grain;  /* moving grains, by block and then in their own order */
} residents;

/* False if memory is gone. */
bool quern_hybrid_residents(
	const quern_step *, const quern_column *position, const int32_t *fixed, residents *);

/* Seen from a grain: whether any node that it reaches holds continuum, and whether all hold more than the least. A node
 * that only the rim of a point reaches may move at any speed, and a grain would take its gradient from it with full
 * weight. */
typedef struct company {
	bool any, all;
} company;

QUERN_INLINE company company_of(
	const stencil *s, uint32_t i, const quern_row *tile, const int dim, int32_t span, quern_real least) {
	company c = { false, true };
	for (int z = 0; z < (dim == 3 ? 3 : 1); z++)
		for (int y = 0; y < 3; y++)
			for (int x = 0; x < 3; x++) {
				const quern_real w =
					s->value[0][x][i] * s->value[1][y][i] * (dim == 3 ? s->value[2][z][i] : 1);
				if (!(w > 0)) continue;
				const quern_real mass = tile[s->node[i] + (z * span + y) * span + x][0];
				c.any = c.any || mass > 0;
				c.all = c.all && mass > least;
			}
	return c;
}

/* Loads the masses of a block's tile; false if grains there meet nobody. */
QUERN_INLINE bool load_continuum(
	const quern_grid_view *g, const residents *r, const quern_row *node, uint32_t b, quern_row *tile) {
	if (r->begin[b] == r->begin[b + 1]) return false;
	quern_tile_load(g, node, b, tile);
	for (uint32_t i = 0; i < g->tile_size; i++)
		if (tile[i][0] > 0) return true;
	return false;
}
