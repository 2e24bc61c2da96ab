/* SPDX-License-Identifier: MIT */
/* heat - what the source files of solver.heat share: the numbers of rows, and points with the nodes that they reach */
#pragma once
#include "conductivity.h"
#include <quern/grid.h>
#include <quern/shape.h>
#include <quern/solver.h>

typedef struct heat {
	quern_real capacity, density; /* J/(kg K); kg/m^3, where there are no points yet */
	quern_list hot, sensors;
	quern_real stiffness; /* of the shape */
} heat;

typedef struct {
	quern_real lower[3], upper[3], temperature;
} hot_region;
typedef struct {
	quern_real position[3];
} sensor;

enum { SLOT_CONDUCTIVITY, SLOT_SHAPE };

/* Rows of the stages' uses. */
enum {
	BEGIN_POSITION,
	BEGIN_TEMPERATURE,
	BEGIN_MASS,
	BEGIN_VOLUME,
	BEGIN_WEIGHT,
	BEGIN_HEATED,
	FILL_PLACE, /* of the stage in the set-up alone */
	FILL_READING
};
enum { SCATTER_POSITION, SCATTER_TEMPERATURE, SCATTER_MASS, SCATTER_WEIGHT, SCATTER_CAPACITY, SCATTER_HEAT };
enum {
	FLUX_POSITION,
	FLUX_TEMPERATURE,
	FLUX_MASS,
	FLUX_VOLUME,
	FLUX_WEIGHT,
	FLUX_CAPACITY,
	FLUX_HEAT,
	FLUX_RATE
};
enum { GATHER_POSITION, GATHER_TEMPERATURE, GATHER_CAPACITY, GATHER_RATE };
enum { MEASURE_PLACE, MEASURE_READING, MEASURE_CAPACITY, MEASURE_HEAT, MEASURE_RATE };

/* Lanes of a node's row, in the order in which the stages name them. */
enum { LANE_CAPACITY, LANE_HEAT, LANE_RATE };

/* ---- points and the nodes that they reach: nodes.c ---- */

enum { CHUNK = 64, MOST_NODES = 27 };

/* Weights of a chunk of points, as the shape gives them: separable. */
typedef struct {
	_Alignas(64) quern_real position[3][CHUNK], value[3][3][CHUNK], slope[3][3][CHUNK];
	int32_t first[3][CHUNK];
} weights;

/* One point's nodes: places in its block's tile, or on the grid; weights and their gradients. */
typedef struct {
	uint32_t n;
	int32_t at[MOST_NODES][3]; /* node of the grid */
	int32_t place[MOST_NODES]; /* in the tile */
	quern_real value[MOST_NODES], slope[MOST_NODES][3];
} reach;

/* Entries begin .. begin + n of the columns x. */
void heat_weights(const quern_grid_view *, const quern_bound *shape, quern_real *const x[3], uint32_t begin,
	uint32_t n, weights *);
void heat_reach(const quern_grid_view *, const weights *, uint32_t i, reach *);
/* The same with places in the tile of block b. */
void heat_reach_tile(const quern_grid_view *, const weights *, uint32_t b, uint32_t i, reach *);

/* J/K of a point. */
QUERN_INLINE quern_real heat_capacity_of(
	const heat *p, const quern_column mass, const quern_column weight, uint32_t i) {
	return p->capacity * mass.real[0][i] * (weight.real[0] ? weight.real[0][i] : 1);
}

/* ---- the law ---- */

/* W/(m K) of n <= CHUNK entries from `begin` on. */
void heat_conductivity(
	const quern_bound *law, const quern_real *temperature, uint32_t begin, uint32_t n, quern_real out[CHUNK]);

quern_status heat_scatter(const void *self, const quern_step *);
quern_status heat_flux(const void *self, const quern_step *);
quern_status heat_gather(const void *self, const quern_step *);
quern_status heat_place_sensors(const heat *, const quern_step *);
quern_status heat_measure(const void *self, const quern_step *);
