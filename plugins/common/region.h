/* SPDX-License-Identifier: MIT */
/* region - where a fill or a source puts material: the inside of the shape of a body, as far as it lies in the domain, and of that, if
 * wished, what lies above bodies of the scene. docs/theory/regions.md */
#pragma once
#include "../bodies/bodies.h"

typedef struct region {
	const quern_bound *shape;
	uint32_t dim;
	quern_real lower[3], upper[3]; /* m, of a box around it */
	quern_real slack;              /* m: a place so far outside is on the surface, but for rounding */
	/* ---- where it is above bodies ---- */
	const quern_list *above;  /* of region_floor; NULL: wherever it is */
	const quern_bound *body;  /* all bodies, */
	const body_pose *pose;    /* and where they are */
	quern_real down[3], deep; /* the direction of gravity; m, no way through the domain is longer */
} region;

/* An item of the key `above`: the number of a body. */
typedef struct region_floor {
	int32_t body;
} region_floor;
extern const quern_param quern_region_floors[];

/* The row of the key `above` of an item T. */
#define REGION_ABOVE(T)                                                                                      \
	QUERN_PARAM(T, above, NULL,                                                                              \
		"Only what lies above this body, or above one of these, against gravity: a name, a number, or "      \
		"several.",                                                                                          \
		.rows = quern_region_floors, .item_size = sizeof(region_floor), .max = 1000)

/* What it is for. Regions of points have a width along every axis. Those of fixed grains may reach beyond the domain by as much as that
 * is wide: a rough floor may be let into a wall. */
typedef enum { REGION_OF_GRAINS, REGION_OF_FIXED, REGION_OF_POINTS } region_use;

/* [setup] The box around a shape, cut by the domain where the shape goes on for ever; a shape that ends must end in the domain.
 * `param`: its key. */
quern_status quern_region_box(const quern_bound *shape, region_use, const quern_setup *, const char *param,
	quern_err *, quern_real lower[3], quern_real upper[3]);
/* [setup] Whether there are the bodies of `above`, and a gravity that says what above is. */
quern_status quern_region_check_above(
	const quern_list *above, uint32_t n_bodies, const quern_setup *, const char *param, quern_err *);

/* [stage] With the box that quern_region_box() has found. */
region quern_region_of(
	const quern_step *, const quern_bound *shape, const quern_real lower[3], const quern_real upper[3]);
/* [stage] From now on only what is above these bodies of a slot, where they are in `pose`. */
void quern_region_put_above(
	region *, const quern_step *, const quern_list *above, uint32_t slot, const body_pose *pose);

/* Whether a place of the box belongs to the region. */
bool quern_region_holds(const region *, const quern_real x[3]);
/* Where a box lies: none of it is in the region; surely all of it is; or it may be either. */
typedef enum { REGION_APART, REGION_AROUND, REGION_CROSSES } region_side;
region_side quern_region_side(const region *, const quern_real lower[3], const quern_real upper[3]);
