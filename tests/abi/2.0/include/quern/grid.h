/* SPDX-License-Identifier: MIT */
/* quern/grid.h - the sparse grid as a solver sees it: rows of eight numbers per node, one dense tile per block */
#pragma once
#include <quern/abi.h>

/* One node of a row set. */
typedef quern_real quern_row __attribute__((vector_size(64)));

enum { QUERN_BLOCK_CELLS = 64, QUERN_TILE_MOST = 512 };

/* Volume of a cell, m^3; in 2-D its area times a metre. */
QUERN_INLINE quern_real quern_grid_cell_volume(const quern_grid_view *g) {
	return g->dim == 2 ? g->cell * g->cell : g->cell * g->cell * g->cell;
}

/* Cell of a position along one axis, counted from the domain's lower corner. */
QUERN_INLINE int32_t quern_grid_cell(const quern_grid_view *g, uint32_t axis, quern_real x) {
	const quern_real t = (x - g->lower[axis]) * (1 / g->cell);
	const int32_t down = (int32_t)t;
	return down - (t < (quern_real)down);
}

/* Cell of a position, wrapped along periodic axes; false outside the domain. */
QUERN_INLINE bool quern_grid_cell_at(const quern_grid_view *g, const quern_real x[3], int32_t cell[3]) {
	bool inside = true;
	for (uint32_t k = 0; k < 3; k++) {
		cell[k] = 0;
		if (k >= g->dim) continue;
		int32_t c = quern_grid_cell(g, k, x[k]);
		if (g->periodic[k]) {
			c %= g->cells[k];
			c = c < 0 ? c + g->cells[k] : c;
		}
		cell[k] = c;
		inside = inside && c >= 0 && c < g->cells[k];
	}
	return inside;
}

/* The block at these block coordinates, or -1 where there is none. */
static inline int32_t quern_grid_block(const quern_grid_view *g, const int32_t at[3]) {
	int32_t low = 0, high = (int32_t)g->n_blocks - 1;
	while (low <= high) {
		const int32_t middle = (low + high) / 2;
		int order = 0;
		for (int k = 2; k >= 0 && !order; k--)
			order = (g->at[middle][k] > at[k]) - (g->at[middle][k] < at[k]);
		if (!order) return middle;
		if (order < 0) low = middle + 1;
		else high = middle - 1;
	}
	return -1;
}

/* Entry of a cell in the set "cell", or of the node at its lower corner in a row set; -1 where it does not exist. */
static inline int32_t quern_grid_entry(const quern_grid_view *g, const int32_t cell[3]) {
	const int32_t edge = (int32_t)g->edge;
	int32_t at[3], place = 0;
	for (int k = 2; k >= 0; k--) {
		at[k] = cell[k] / edge;
		place = place * edge + cell[k] % edge;
		if (cell[k] < 0) return -1;
	}
	const int32_t b = quern_grid_block(g, at);
	return b < 0 ? -1 : b * QUERN_BLOCK_CELLS + place;
}

/* Copies the nodes that block b's tile covers; nodes that do not exist are zero. */
QUERN_INLINE void quern_tile_load(
	const quern_grid_view *g, const quern_row *rows, uint32_t b, quern_row *tile) {
	const int32_t *entry = g->tile + (size_t)b * g->tile_size;
	for (uint32_t i = 0; i < g->tile_size; i++)
		tile[i] = entry[i] < 0 ? QUERN_VALUE(quern_row, 0) : rows[entry[i]];
}

/* Adds a tile to its nodes; call it colour by colour, so that no two blocks add to one node at once. */
QUERN_INLINE void quern_tile_add(
	const quern_grid_view *g, quern_row *rows, uint32_t b, const quern_row *tile) {
	const int32_t *entry = g->tile + (size_t)b * g->tile_size;
	for (uint32_t i = 0; i < g->tile_size; i++)
		if (entry[i] >= 0) rows[entry[i]] += tile[i];
}

/* Position of node or cell corner k of block b, in metres. */
QUERN_INLINE void quern_grid_corner(const quern_grid_view *g, uint32_t b, uint32_t k, quern_real x[3]) {
	const uint32_t place[3] = { k % g->edge, k / g->edge % g->edge,
		g->dim == 3 ? k / (g->edge * g->edge) : 0 };
	for (uint32_t a = 0; a < 3; a++)
		x[a] = a < g->dim
				   ? g->lower[a] + g->cell * (quern_real)(g->at[b][a] * (int32_t)g->edge + (int32_t)place[a])
				   : 0;
}
