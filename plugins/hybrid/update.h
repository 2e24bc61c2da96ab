/* SPDX-License-Identifier: MIT */
/* update - what the parts of a zone update share: who is in which cell, what cells hold, and what shall come and go */
#pragma once
#include "../common/resample.h"
#include "hybrid.h"

typedef struct new_grain {
	quern_real position[3], velocity[3], spin[3], radius, mass, weight;
	int32_t cell;
} new_grain;

typedef struct update {
	const hybrid *h;
	const quern_step *s;
	const quern_grid_view *g;
	const quern_column *u;
	quern_images images;
	uint32_t n_cells, n_grains, n_points;
	/* by cell: the moving grains and the points in it */
	uint32_t *grain_begin, *point_begin;
	int32_t *grain, *point;
	cloud moving_grains, all_points; /* with the weights that they have now */
	const uint32_t *grain_order,
		*point_order; /* of the sets' entries, by the places of their blocks; NULL: their own */
	int32_t *grain_cell, *point_cell;        /* by particle: its cell, -1 for none and for fixed grains */
	quern_real *mass, *velocity[3], *spread; /* by cell: of both clouds, with the weights from before */
	quern_real *in_grains, *in_points; /* kg by cell, that grains and points carry with their new weights */
	int32_t *beside;                   /* by cell, down and up each axis: the next one */
	quern_real *wall, *open;  /* by cell: m from its centre to the nearest body; share that is open */
	bool *displaced;          /* by cell: whether a body with its surface before it takes some of it */
	const body_pose *pose;    /* by body */
	quern_real full, nominal; /* kg: of a full cell, of one point in it */
	int32_t *zone;            /* by cell: the new one; the old one stands in the field until the end */
	const int32_t *wish;      /* by cell: the zone that it goes to, in as many updates as it takes */
	quern_real *near;         /* by cell: m to the nearest surface of any oracle */
	quern_real *share;        /* by cell: the continuum's, in the new zone */
	quern_real *asked;        /* by cell: what oracles ask for in its place, -1: nothing; NULL: nobody asks */
	bool *drop_grain, *drop_point;
	resample points;
	new_grain *grains;
	uint32_t n_new_grains;
	uint32_t changed; /* cells that changed zone */
	bool failed;      /* memory ran out */
} update;

/* The q-th cell in the order of places: whoever adds up cell by cell, or makes something in them, takes them so. */
QUERN_INLINE uint32_t nth_cell(const update *d, uint32_t q) { return quern_grid_nth(d->g, q); }
/* Of a mean over about ten updates, that the newest one makes. */
#define NEWEST 0.1
/* Weights of points and of grains in a cell from now on. */
QUERN_INLINE quern_real point_share(const update *d, uint32_t c) { return d->share[c]; }
QUERN_INLINE quern_real grain_share(const update *d, uint32_t c) { return 1 - d->share[c]; }
/* The continuum's share as the fields have it: from before, until the update's end. */
QUERN_INLINE quern_real old_share(const update *d, int32_t c) {
	const quern_real *weight = d->u[U_WEIGHT].real[0];
	return weight ? weight[c] : zone_share(d->u[U_ZONE].index[c]);
}

void quern_hybrid_centre(const update *, const int32_t cell[3], quern_real x[3]);
/* The entry of the cell one step along an axis, -1 where there is none. */
QUERN_INLINE int32_t cell_beside(const update *d, uint32_t c, uint32_t axis, int step) {
	return d->beside[(size_t)c * 2 * d->s->dim + 2 * axis + (step > 0)];
}

/* ---- cells.c ---- */
quern_status quern_hybrid_sort(update *);
void quern_hybrid_averages(update *);
void quern_hybrid_fixed(update *);
void quern_hybrid_fractions(update *);
/* Mean over the samples, and over the room that bodies leave, of the contact stress in a cell; false if there is
 * none. */
bool quern_hybrid_contact_stress(const update *, uint32_t cell, quern_real stress[6]);
/* The same over the pairs of cells up to two to either side of it that both hold grains and half of what fills them: forces differ from chain to chain, and what
 * grows evenly with depth stays. */
bool quern_hybrid_mean_stress(const update *, uint32_t cell, quern_real stress[6]);
/* Normals of the zone at every particle. After the sets have their new order. */
quern_status quern_hybrid_normals(update *);

/* ---- rates.c ---- */
/* Pa: mean of a cell's points by a weight, their mass or volume; 0 without any. */
quern_real quern_hybrid_points_pressure(const update *, uint32_t cell, const quern_real *weight);
quern_status quern_hybrid_rates(update *);

/* ---- walls.c ---- */
quern_status quern_hybrid_walls(update *);
/* By cell: m from its centre to the nearest of the bodies that are `meant`, by their number; NULL: of all. */
quern_status quern_hybrid_gaps(const update *, const bool *meant, quern_real *gap);
/* A place in the open part of a cell: its centre, or before the surface behind which that lies. */
void quern_hybrid_open_place(const update *, uint32_t entry, const int32_t cell[3], quern_real x[3]);
/* Whether one of these bodies stands between two places, one of them in that cell and the other in it or in one beside
 * it, be it ever so thin. */
bool quern_hybrid_walled(
	const update *, const bool *meant, uint32_t entry, const quern_real from[3], const quern_real to[3]);
/* Whether something that is in a cell sees a place in it past all bodies; true as well where no body is near, or nothing there. */
bool quern_hybrid_seen(const update *, uint32_t cell, const quern_real x[3]);

/* ---- zones.c ---- */
quern_status quern_hybrid_zones(update *);
/* By cell that is asked for: the cell with `source` set that reaches it first in the order of distances between centres, from cell to cell with `through` and through no body;
 * -1 if there is none, or nobody asks. */
quern_status quern_hybrid_nearest(
	update *, const bool *source, const bool *through, const bool *asked, int32_t *nearest);
/* By cell with `through` set: m from its centre to the nearest cell with `source` set, from cell to cell with
 * `through`. */
quern_status quern_hybrid_distance(update *, const bool *source, const bool *through, quern_real *distance);

/* ---- changes.c ---- */
/* Takes back what would change beyond `most_changes`. */
quern_status quern_hybrid_limit_changes(update *);

/* ---- packing.c ---- */
/* What grains in some cells have: kg, J, and the sum over cells of their pressures, Pa. */
typedef struct bed {
	uint32_t cells;
	quern_real mass, kinetic, pressure;
} bed;
void quern_hybrid_add_to_bed(const update *, uint32_t cell, bed *);
/* Whether they lie on each other, and move with no more energy than settling leaves. */
bool quern_hybrid_is_at_rest(const update *, const bed *);
/* Of the first update, once there are zones: warns if settled grains have another density than the continuum. */
void quern_hybrid_packing(const update *);

/* ---- shares.c ---- */
quern_status quern_hybrid_shares(update *);

/* ---- ledger.c ---- */
/* Whether an entry holds anything, mass or momentum, be it less than nothing. */
bool quern_hybrid_is_owed(const quern_column *, uint32_t cell, uint32_t dim);
/* Adds to a cell's entry what is carried no longer, or takes from it what is carried now. */
void quern_hybrid_book(const update *, uint32_t cell, quern_real mass, const quern_real v[3]);
void quern_hybrid_pass(const update *, uint32_t from, uint32_t to);
quern_status quern_hybrid_weigh(update *);
quern_status quern_hybrid_hand_over(update *);
/* All that a cell holds: carried by either, or owed. */
QUERN_INLINE quern_real cell_holds(const update *d, uint32_t c) {
	return d->in_grains[c] + d->in_points[c] + d->u[U_OWED].real[0][c];
}
/* kg that can be in a cell before it is full: a tenth more than the continuum without stress. */
QUERN_INLINE quern_real cell_room(const update *d, uint32_t c) {
	return 1.1 * d->full * (d->open[c] > 0.125 ? d->open[c] : 0.125);
}

/* ---- crowding.c ---- */
quern_status quern_hybrid_crowding(update *);

/* How many of 0.05, 0.1, 0.2, 0.4 ... are passed: whoever warns does so again at each. */
QUERN_INLINE int steps_passed(quern_real part) {
	int n = 0;
	for (quern_real step = 0.05; part > step && n < 8; step *= 2) n++;
	return n;
}

/* ---- density.c ---- */
/* Looks for the densest place; warns where it is too dense, and ends the run where no packing is as dense. */
quern_status quern_hybrid_density(const update *);

/* ---- points.c ---- */
quern_status quern_hybrid_points(update *);
/* As many points as the mass is worth, in a cell that has none. */
void quern_hybrid_create(update *, uint32_t cell, quern_real mass, const quern_real v[3]);
void quern_hybrid_assign(const update *, uint32_t begin, uint32_t n);
quern_status quern_hybrid_apply_points(update *);

/* ---- absorb.c ---- */
/* `made`: by cell, all false; true afterwards where points are new. */
quern_status quern_hybrid_absorb(update *, uint8_t *made);

/* ---- surroundings.c ---- */
/* Velocity and spin of a new grain: those of what moves around it. */
void quern_hybrid_motion(const update *, new_grain *);

/* ---- enrich.c ---- */
quern_status quern_hybrid_grains(update *);
quern_status quern_hybrid_apply_grains(update *);
