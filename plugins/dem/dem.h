/* SPDX-License-Identifier: MIT */
/* dem - the grain solver's own parameters and its stages, shared by its source files */
#pragma once
#include "../bodies/bodies.h"
#include "../common/account.h"
#include "../common/radius.h"
#include "../common/source.h"
#include "../common/tools.h"
#include "rows.h"
#include <quern/contact.h>
#include <quern/integrator.h>
#include <quern/neighbours.h>
#include <quern/packer.h>

typedef struct dem {
	quern_real density, skin, rest, settle_step; /* from the scene */
	radius_law radii;
	quern_list fill, place, source;
	const char *file;
	quern_real overlap_most, overlap_start; /* over the smaller radius */
	int32_t settle_most;
	bool fixed;    /* some grains do not move */
	bool features; /* some bodies have several */
	bool moving;   /* some bodies do */
	bool outlets, sources;
	bool settles;
	quern_real reach;  /* m, of the laws beyond touching */
	quern_real height; /* m, of the fill, or of the domain where there is none */
	quern_real sinks,
		stiffness;        /* overlap under the fill's weight over the diameter; N/m, of all laws there */
	const char *stiffest; /* of the laws */
	uint32_t dim;
} dem;

typedef struct dem_fill {
	quern_real lower[3], upper[3], velocity[3];
	bool settle, fixed;
} dem_fill;

typedef struct dem_place {
	quern_real position[3], velocity[3], spin[3], radius;
	bool fixed;
} dem_place;

/* slots, in the order of the solver's table */
enum {
	SLOT_CONTACT,
	SLOT_NEIGHBOURS,
	SLOT_INTEGRATOR,
	SLOT_BODIES,
	SLOT_PACKER,
	SLOT_SETTLING,
	SLOT_SOURCE_PACKER
};

/* The integrator of this step. */
QUERN_INLINE const quern_bound *dem_integrator(const quern_step *s) {
	return &s->slot[s->settling ? SLOT_SETTLING : SLOT_INTEGRATOR][0];
}

/* The grains with rows of dem.fill; `weight` NULL: all of what each is. */
QUERN_INLINE cloud dem_cloud(const quern_step *s, const quern_real *weight) {
	return (cloud) { s->use[FILL_MASS].real[0], weight, s->use[FILL_FIXED].index,
		s->host->set(s->run, "grain").n };
}

quern_status quern_dem_fill(const void *self, const quern_step *);
quern_status quern_dem_pour(const void *self, const quern_step *);
quern_status quern_dem_outlets(const void *self, const quern_step *);
quern_status quern_dem_open(const void *self, const quern_step *);
quern_status quern_dem_neighbours(const void *self, const quern_step *);
quern_status quern_dem_forces(const void *self, const quern_step *);
/* Ends the run for a grain that is out of the domain along an axis. */
quern_status quern_dem_left(const quern_step *, int64_t id, uint32_t axis, quern_real x);
quern_status quern_dem_list(const void *self, const quern_step *);
quern_status quern_dem_observe(const void *self, const quern_step *);
bool quern_dem_settled(const void *self, const quern_step *);
quern_real quern_dem_settling(const void *self, const quern_step *);

/* ---- grain_file.c ---- */
typedef struct grain_table {
	dem_place *grain;
	uint32_t n, cap;
} grain_table;
/* Reads "x y [z] radius ..." columns; on a fault returns false with one sentence in `why`. Velocities, spins and
 * `fixed` may be left out; a missing radius is NaN. */
bool quern_grain_table_read(const char *data, size_t length, uint32_t dim, grain_table *, char why[200]);
bool quern_grain_table_load(const char *path, uint32_t dim, grain_table *, char why[200]);
void quern_grain_table_finish(grain_table *);
