/* SPDX-License-Identifier: MIT */
/* mpm - the continuum solver's own parameters and its stages, shared by its source files */
#pragma once
#include "../bodies/bodies.h"
#include "../common/account.h"
#include "../common/source.h"
#include "../common/tools.h"
#include "rough.h"
#include "rows.h"
#include <quern/grid.h>
#include <quern/material.h>
#include <quern/shape.h>
#include <quern/strain.h>
#include <quern/transfer.h>

typedef struct mpm {
	quern_real cell, cut; /* from the scene */
	quern_real light;     /* what the shape asks for, where `cut` is 0 */
	int32_t points, rasterise, resample;
	int32_t per_axis; /* points of a cell, as they are made: of the fill, or of a hybrid's updates */
	quern_list fill, source;
	const char *from;
	bool outlets, sources, resamples;
	uint64_t stream;                            /* of random numbers */
	bool affine;                                /* points send their gradient, hybrid or not */
	bool matrix, moments;                       /* or what the transfer gives; whose moment can be kept */
	quern_real stiffness, bulk, shear, density; /* of the step limit */
	quern_real relief, answer; /* of the pressure to cells that are too full: over the bulk modulus, 1/s */
	quern_real follow;         /* of density, to the cell's: a rate over the shear rate */
	bool alone;                /* density follows without a hybrid: cells are counted here */
	bool counted;              /* steps are, to the next one that counts cells, and how points lie in them */
	quern_real spread;         /* of points over their cells: a rate over the shear rate */
	quern_real bears;          /* Pa, from where on they are: the weight of half a cell */
	quern_real rest, diameter, rest_rate; /* shear rate of what is at rest: over sqrt(g/D), 1/s */
	quern_real rest_alone;                /* 1/s: the same of a continuum alone, from sqrt(g/h) */
	quern_real share_wall, share_next;    /* of a wall's nodes */
	uint32_t dim;
	quern_real loosest; /* kg/m^3, of what bears */
	quern_real damping; /* s, of elastic waves */
	bool damped;
	bool rough, still;    /* whether a body is */
	quern_real gain;      /* of energy from nowhere that is allowed, over what lifts all by a cell */
	bool watches, moving; /* a continuum alone is watched; whether a body moves beside it */
	rough_law rubbing;
} mpm;

enum { STRESS_NONE, STRESS_AT_REST };
enum { STREAM_SOURCES, STREAM_FILLS };
enum { RASTERISE_AUTO, RASTERISE_PLAIN, RASTERISE_AFFINE };

typedef struct mpm_fill {
	quern_real lower[3], upper[3]; /* m, of the box around its region */
	quern_real velocity[3], lateral, jitter;
	int32_t stress;
	quern_list above;
} mpm_fill;

enum { SLOT_SOURCE_REGION, SLOT_REGION, SLOT_MATERIAL, SLOT_SHAPE, SLOT_TRANSFER, SLOT_STRAIN, SLOT_BODIES };

/* Lanes of a node's row (mass, momentum, held, force: in 2-D too the force has the second half) and of its motion
 * (velocity, change, density, grip). */
QUERN_INLINE uint32_t node_held(uint32_t dim) { return 1 + dim; }
QUERN_INLINE uint32_t node_force(uint32_t dim) { return 2 + dim; }
QUERN_INLINE uint32_t motion_change(uint32_t dim) { return dim; }
QUERN_INLINE uint32_t motion_density(uint32_t dim) { return 2 * dim; }
QUERN_INLINE uint32_t motion_grip(uint32_t dim) { return 2 * dim + 1; }

/* Density follows slowly, by the shear, and so are points spread: a continuum alone is counted in every so many steps. */
enum { COUNT_EVERY = 20 };

quern_status quern_mpm_fill(const void *self, const quern_step *);
/* The n points of another run's state, which are there before the fill: checks and adopts them. */
quern_status quern_mpm_begin(const mpm *, const quern_step *, uint32_t n);
quern_status quern_mpm_pour(const void *self, const quern_step *);
quern_status quern_mpm_resample(const void *self, const quern_step *);
quern_status quern_mpm_outlets(const void *self, const quern_step *);
quern_status quern_mpm_sort(const void *self, const quern_step *);
quern_status quern_mpm_scatter(const void *self, const quern_step *);
quern_status quern_mpm_nodes(const void *self, const quern_step *);
quern_status quern_mpm_walls(const void *self, const quern_step *);
quern_status quern_mpm_gather(const void *self, const quern_step *);
quern_status quern_mpm_hold(const void *self, const quern_step *);
quern_status quern_mpm_watch(const void *self, const quern_step *);
