/* SPDX-License-Identifier: MIT */
/* gather - what the parts of the way from nodes to points share */
#pragma once
#include "../common/ahead.h"
#include "../common/calm.h"
#include "../common/cloud.h"
#include "../common/trips.h"
#include "mpm.h"

typedef struct gather_work {
	const mpm *p;
	const quern_step *s;
	const quern_grid_view *g;
	const uint32_t *point;
	cloud points;
	const quern_row *motion;
	trips trips;
	calm calm;
	bool answers;          /* volume does, to how full cells are */
	bool counts;           /* the same of a continuum alone, in this step */
	bool spreads;          /* points are */
	bool gives;            /* gradients are stored for others */
	quern_row *moment;     /* by cell, in steps that count where they are: spread.h */
	const body_pose *pose; /* by body, for that */
	const quern_strain_ops *strain;
	quern_real full;      /* from there on a cell is crowded */
	quern_real still;     /* 1/s: sheared much faster, material flows */
	ahead ahead;          /* columns of points, and nodes */
	int32_t *bad, *moved; /* by block: first bad point or -1; whether one has left the tile */
} gather_work;

typedef struct gather_memory {
	quern_row tile[QUERN_TILE_MOST];
	trip_memory trip;
	_Alignas(64) quern_real gradient[9][STENCIL], grid_density[STENCIL], density[STENCIL], moved[STENCIL];
	_Alignas(64) quern_real kept[3][STENCIL], mean_pressure[STENCIL], stress[6][STENCIL];
	/* by cell of the block: Pa and m^3 of its points, m^3 of those that are open, kg/m^3 of what it holds and of its points that
	 * are not open */
	quern_real level[QUERN_BLOCK_CELLS], room[QUERN_BLOCK_CELLS], loose[QUERN_BLOCK_CELLS],
		held[QUERN_BLOCK_CELLS], mean[QUERN_BLOCK_CELLS];
	/* a continuum alone: by what share a cell holds more than its points know, and the mean of that around it */
	quern_real excess[QUERN_BLOCK_CELLS], excess_around[QUERN_BLOCK_CELLS];
	bool inside[QUERN_BLOCK_CELLS];          /* away from surfaces and bodies */
	quern_real cut[3][2][QUERN_BLOCK_CELLS]; /* by axis and side: the share of a cell that a body takes */
	/* of what a strain measures: at points, and by cell the mean over what bears, and the volume of that; the gradient as nodes say it */
	_Alignas(64) quern_real measured[QUERN_STRAIN_MOST][STENCIL], raw[9][STENCIL];
	quern_real strained[QUERN_STRAIN_MOST][QUERN_BLOCK_CELLS], bearing[QUERN_BLOCK_CELLS];
	fit_memory fit;                   /* where the transfer asks for it */
	int32_t cell[STENCIL];            /* of the block, by point of a chunk */
	quern_real said[QUERN_TILE_MOST]; /* kg/m^3 at the tile's nodes */
	bool silent[QUERN_TILE_MOST];     /* those that bodies leave no room */
} gather_memory;
