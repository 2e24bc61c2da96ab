/* SPDX-License-Identifier: MIT */
/* grid - the sparse grid: which blocks exist, which nodes a block's tile reaches, which blocks may add at once */
#pragma once
#include "field.h"

typedef struct quern_grid {
	quern_grid_view view;
	int32_t blocks[3];        /* per axis: as many as hold a node of the domain */
	uint32_t *axis_colour[3]; /* by block coordinate; NULL: parity */
	int32_t (*at)[3];
	uint8_t *asked;
	int32_t *tile;
	uint32_t *colour, *by_colour, *by_place; /* by_place NULL: they are in order */
	int32_t *slot;                           /* hash table of block indices, -1 free */
	uint32_t n_slots;
	bool
		covers; /* its blocks are those asked for and their neighbours: not so where a file says which they are */
} quern_grid;

/* Domain and cell size; QUERN_E_PARAM if the grid would have more than 2^22 cells along an axis, or 2^31 in all:
 * blocks have 20 bits along an axis, and cells are numbered. */
quern_status quern_grid_init(quern_grid *, uint32_t dim, double cell, const double lower[3],
	const double upper[3], const bool periodic[3]);
void quern_grid_finish(quern_grid *);

/* Makes the grid hold exactly these blocks and their neighbours. Sets marked `grid` in the store follow: cells keep
 * their fields, rows are cleared. Blocks outside the domain are ignored. */
quern_status quern_grid_cover(quern_grid *, quern_store *, uint32_t n, const int32_t (*block)[3]);
/* Takes the blocks as they are, complete and in whatever order: a checkpoint's. Cells are not carried. */
quern_status quern_grid_restore(quern_grid *, uint32_t n, const int32_t (*block)[3], const uint8_t *asked);
/* A set of cells or of nodes is cut as the grid is. */
quern_status quern_grid_cut(const quern_grid *, quern_store *, int set);
int32_t quern_grid_find(const quern_grid *, const int32_t at[3]); /* -1: not allocated */
