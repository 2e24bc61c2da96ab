/* SPDX-License-Identifier: MIT */
/* quern/grid.h - the sparse grid as a solver sees it: rows of eight numbers per node, one dense tile per block */
#pragma once
#include <quern/space.h>
#include <string.h>

/* One node of a row set. */
typedef quern_real quern_row __attribute__((vector_size(64)));

enum { QUERN_BLOCK_CELLS = 64, QUERN_TILE_MOST = 512 };

/* Volume of a cell, m^3; in 2-D its area times a metre. */
QUERN_INLINE quern_real quern_grid_cell_volume(const quern_grid_view *g) {
	return g->dim == 2 ? g->cell * g->cell : g->cell * g->cell * g->cell;
}

/* ==== cells of positions ==== */

/* Along a periodic axis the domain is as long as its cells. */
QUERN_INLINE quern_images quern_grid_images(const quern_grid_view *g) {
	quern_images p;
	for (uint32_t k = 0; k < 3; k++)
		quern_images_set(&p, k, k < g->dim && g->periodic[k], g->cells[k] * g->cell);
	return p;
}

/* Cell of a position along one axis, counted from the domain's lower corner. */
QUERN_INLINE int32_t quern_grid_cell(const quern_grid_view *g, uint32_t axis, quern_real x) {
	return quern_cell_along(x, g->lower[axis], 1 / g->cell);
}

/* Brings a cell back through periodic faces; false if it lies beyond another face. */
QUERN_INLINE bool quern_grid_bring_back(const quern_grid_view *g, int32_t cell[3]) {
	bool inside = true;
	for (uint32_t k = 0; k < g->dim; k++) {
		if (g->periodic[k]) cell[k] = quern_cell_wrapped(cell[k], g->cells[k]);
		inside = inside && cell[k] >= 0 && cell[k] < g->cells[k];
	}
	return inside;
}

/* Of a cell beyond a face the nearest before it. */
QUERN_INLINE void quern_grid_hold(const quern_grid_view *g, int32_t cell[3]) {
	for (uint32_t k = 0; k < g->dim; k++) cell[k] = quern_cell_held(cell[k], g->cells[k]);
}

/* Cell of a position, wrapped along periodic axes; false outside the domain. A period may be longer than its cells by a millionth: what lies
 * there belongs to the last of them. */
QUERN_INLINE bool quern_grid_cell_at(const quern_grid_view *g, const quern_real x[3], int32_t cell[3]) {
	for (uint32_t k = 0; k < 3; k++) {
		cell[k] = k < g->dim ? quern_grid_cell(g, k, x[k]) : 0;
		if (k < g->dim && g->periodic[k] && cell[k] == g->cells[k] &&
			x[k] - g->lower[k] < (1 + 1e-6) * g->cells[k] * g->cell)
			cell[k]--;
	}
	return quern_grid_bring_back(g, cell);
}

/* The same; of what lies beyond another face, or on an upper one, the cell before it. */
QUERN_INLINE void quern_grid_cell_inside(const quern_grid_view *g, const quern_real x[3], int32_t cell[3]) {
	if (!quern_grid_cell_at(g, x, cell)) quern_grid_hold(g, cell);
}

/* Position i of a set's columns, with a z of 0 in 2-D. */
QUERN_INLINE void quern_grid_position(
	const quern_grid_view *g, quern_real *const x[3], uint32_t i, quern_real at[3]) {
	for (uint32_t k = 0; k < 3; k++) at[k] = k < g->dim ? x[k][i] : 0;
}

/* The number of a cell among all of the domain, and back. */
QUERN_INLINE int32_t quern_grid_number(const quern_grid_view *g, const int32_t cell[3]) {
	return (cell[2] * g->cells[1] + cell[1]) * g->cells[0] + cell[0];
}
QUERN_INLINE void quern_grid_numbered(const quern_grid_view *g, int32_t number, int32_t cell[3]) {
	cell[0] = number % g->cells[0];
	cell[1] = number / g->cells[0] % g->cells[1];
	cell[2] = number / g->cells[0] / g->cells[1];
}

/* ==== entries of cells ==== */

/* The block at these block coordinates, or -1 where there is none. */
static inline int32_t quern_grid_block(const quern_grid_view *g, const int32_t at[3]) {
	int32_t low = 0, high = (int32_t)g->n_blocks - 1;
	while (low <= high) {
		const int32_t middle = (low + high) / 2;
		const uint32_t b = quern_nth(g->by_place, (uint32_t)middle);
		int order = 0;
		for (int k = 2; k >= 0 && !order; k--) order = (g->at[b][k] > at[k]) - (g->at[b][k] < at[k]);
		if (!order) return (int32_t)b;
		if (order < 0) low = middle + 1;
		else high = middle - 1;
	}
	return -1;
}

/* Blocks have 2^shift cells along each axis, which is their `edge`: quotients and rests without dividing. */
QUERN_INLINE int quern_block_shift(uint32_t dim) { return dim == 2 ? 3 : 2; }

/* Where somebody looked last; neighbours in space are mostly neighbours in the list, too. Begins as { -1 }. */
typedef struct quern_grid_cursor {
	int32_t block, at[3];
} quern_grid_cursor;

/* Entry of a cell in the set "cell", or of the node at its lower corner in a row set; -1 where it does not exist. The
 * last block is tried first. */
static inline int32_t quern_grid_entry_near(
	const quern_grid_view *g, quern_grid_cursor *last, const int32_t cell[3]) {
	const int shift = quern_block_shift(g->dim);
	const int32_t rest = (1 << shift) - 1;
	int32_t at[3], place = 0;
	bool same = last->block >= 0;
	for (int k = 2; k >= 0; k--) {
		at[k] = cell[k] >> shift;
		place = place << shift | (cell[k] & rest);
		same = same && at[k] == last->at[k];
		if (cell[k] < 0) return -1;
	}
	if (!same) {
		last->block = quern_grid_block(g, at);
		for (int k = 0; k < 3; k++) last->at[k] = at[k];
	}
	return last->block < 0 ? -1 : last->block * QUERN_BLOCK_CELLS + place;
}

static inline int32_t quern_grid_entry(const quern_grid_view *g, const int32_t cell[3]) {
	quern_grid_cursor none = { -1, { 0, 0, 0 } };
	return quern_grid_entry_near(g, &none, cell);
}

/* The entry of a cell that may lie beyond a periodic face, through which it is brought back; -1 where it does not
 * exist. */
QUERN_INLINE int32_t quern_grid_entry_back(const quern_grid_view *g, int32_t cell[3]) {
	return quern_grid_bring_back(g, cell) ? quern_grid_entry(g, cell) : -1;
}

/* The cell of an entry, or the node at its lower corner; false for what a block has beyond the domain's end. */
QUERN_INLINE bool quern_grid_cell_of(const quern_grid_view *g, uint32_t entry, int32_t cell[3]) {
	const int shift = quern_block_shift(g->dim);
	const uint32_t b = entry / QUERN_BLOCK_CELLS, k = entry % QUERN_BLOCK_CELLS, rest = (1u << shift) - 1;
	const uint32_t place[3] = { k & rest, k >> shift & rest, k >> 2 * shift };
	bool inside = true;
	for (uint32_t a = 0; a < 3; a++) {
		cell[a] = a < g->dim ? g->at[b][a] * (1 << shift) + (int32_t)place[a] : 0;
		inside = inside && cell[a] < g->cells[a];
	}
	return inside;
}

/* The q-th entry in the order of the blocks' places. */
QUERN_INLINE uint32_t quern_grid_nth(const quern_grid_view *g, uint32_t q) {
	return quern_nth(g->by_place, q / QUERN_BLOCK_CELLS) * QUERN_BLOCK_CELLS + q % QUERN_BLOCK_CELLS;
}

/* Position of an entry's node, the lower corner of its cell, in metres. */
QUERN_INLINE void quern_grid_corner(const quern_grid_view *g, uint32_t entry, quern_real x[3]) {
	int32_t cell[3];
	quern_grid_cell_of(g, entry, cell);
	for (uint32_t a = 0; a < 3; a++) x[a] = a < g->dim ? g->lower[a] + g->cell * cell[a] : 0;
}

/* ==== tiles ==== */

/* Copies the nodes that block b's tile covers; nodes that do not exist are zero. */
QUERN_INLINE void quern_tile_load(
	const quern_grid_view *g, const quern_row *rows, uint32_t b, quern_row *tile) {
	const int32_t *entry = g->tile + (size_t)b * g->tile_size;
	const quern_row none = { 0 };
	for (uint32_t i = 0; i < g->tile_size; i++) /* a chosen value would pass through memory */
		memcpy(tile + i, entry[i] < 0 ? &none : rows + entry[i], sizeof none);
}

/* Adds a tile to its nodes; call it colour by colour, so that no two blocks add to one node at once. */
QUERN_INLINE void quern_tile_add(
	const quern_grid_view *g, quern_row *rows, uint32_t b, const quern_row *tile) {
	const int32_t *entry = g->tile + (size_t)b * g->tile_size;
	for (uint32_t i = 0; i < g->tile_size; i++)
		if (entry[i] >= 0) rows[entry[i]] += tile[i];
}
