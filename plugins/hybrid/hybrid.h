/* SPDX-License-Identifier: MIT */
/* hybrid - the parameters of the hybrid solver and its stages, shared by its source files */
#pragma once
#include "../bodies/bodies.h"
#include "../common/account.h"
#include "../common/radius.h"
#include "../common/tools.h"
#include "rows.h"
#include <quern/coupling.h>
#include <quern/grid.h>
#include <quern/integrator.h>
#include <quern/material.h>
#include <quern/oracle.h>
#include <quern/packer.h>
#include <quern/shape.h>
#include <quern/transfer.h>

typedef struct hybrid {
	int32_t substeps, update, samples, average, growth; /* from the scene */
	quern_real hysteresis, gain, most_density;
	quern_real step, grain_step,
		continuum_step; /* s, published, for `substeps: auto`; NaN: unknown, or counted already */
	quern_real diameter, density, solid, packed, law_number; /* of the grains, published by their solver */
	radius_law radii;                  /* of grains that enrich cells: a stream of their own */
	uint32_t dim, every, sample_every; /* steps */
	bool affine, solves; /* of the coupling: both clouds send their gradient; it sees all at once */
	quern_real ahead;    /* after which share of a substep the grains' integrator gives its impulse */
	quern_real rest;     /* 1/s: shear rate of what is at rest */
	quern_real cell;     /* m: of the grid */
	bool moving;         /* some bodies do */
	int32_t weights;
	bool ramped;             /* shares of hybrid cells are a field: cell.weight */
	quern_real most_changes; /* of the cells with material, in an update */
	int32_t oracle_cells;    /* along each axis of the blocks that oracles' levels are averaged over */
	bool averages;           /* oracles see means over some updates */
	bool marks;              /* what oracles marked is kept: cell.marked */
	bool passes;             /* books are kept of what leaves and comes */
	quern_real pourings;     /* sources of grains */
} hybrid;

enum { WEIGHTS_HALF, WEIGHTS_RAMP };

/* slots, in the order of the solver's table */
enum {
	SLOT_ORACLE,
	SLOT_PACKER,
	SLOT_COUPLING,
	SLOT_MATERIAL,
	SLOT_SHAPE,
	SLOT_TRANSFER,
	SLOT_BODIES,
	SLOT_INTEGRATOR
};

/* Lanes of a mixture row: mass, momentum, change of velocity. */
QUERN_INLINE uint32_t mixture_change(uint32_t dim) { return 1 + dim; }

quern_status quern_hybrid_update(const void *self, const quern_step *);
/* The share of the mass that grains carry, for who watches a run. */
void quern_hybrid_look(const void *self, const quern_step *, quern_real *out);
quern_status quern_hybrid_sample(const void *self, const quern_step *);
quern_status quern_hybrid_raster(const void *self, const quern_step *);
quern_status quern_hybrid_couple(const void *self, const quern_step *);
quern_status quern_hybrid_back(const void *self, const quern_step *);
quern_status quern_hybrid_grow(const void *self, const quern_step *);
quern_status quern_hybrid_audit(const void *self, const quern_step *);
/* s that coupling and books take in a long step on one core, about: see quern_solver_ops.work. */
quern_real quern_hybrid_work(const void *self, const quern_step *, quern_real wider);
/* Rows of the audit: J that grains and points have in their springs and in turning, an upper bound. */
quern_real quern_hybrid_held(const quern_step *);
/* Rows of the audit: from now on motion is judged by what there is now. */
void quern_hybrid_begin_gain(const quern_step *, quern_real kinetic);
/* The same where there is less by now than there could be: what friction has taken does not pay for what a step makes. */
void quern_hybrid_lower_gain(const quern_step *, quern_real kinetic);
/* Rows of the audit: ends the run if grains and points, which carry so much mass, move with more energy than there was,
 * gravity has given and `gain` allows. */
quern_status quern_hybrid_judge_gain(
	const hybrid *, const quern_step *, quern_real kinetic, quern_real carried);

/* The clouds with rows of the update, until a set changes. */
QUERN_INLINE cloud moving_grains(const quern_step *s) {
	return (cloud) { s->use[U_GRAIN_MASS].real[0], s->use[U_GRAIN_WEIGHT].real[0],
		s->use[U_GRAIN_FIXED].index, s->host->set(s->run, "grain").n, "grain" };
}
QUERN_INLINE cloud all_points(const quern_step *s) {
	return (cloud) { s->use[U_POINT_MASS].real[0], s->use[U_POINT_WEIGHT].real[0], NULL,
		s->host->set(s->run, "point").n, "point" };
}

/* Whether zones are looked at in this step; not in the very first, which gathers contact stresses. */
QUERN_INLINE bool zones_are_due(const hybrid *h, const quern_step *s) {
	return s->step > 0 && (s->step - 1) % h->every == 0;
}

/* Narrower cells say too little of how full they are. */
QUERN_INLINE bool cells_are_narrow(const hybrid *h) { return h->cell > 0 && h->cell < 1.5 * h->diameter; }

/* The continuum's share in a cell of that zone, where there are no ramps. */
QUERN_INLINE quern_real zone_share(int32_t zone) {
	return zone == QUERN_DISCRETE ? 0 : zone == QUERN_HYBRID ? 0.5 : 1;
}
