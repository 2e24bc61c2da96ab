/* SPDX-License-Identifier: MIT */
/* dem - the grain solver's own parameters and the rows of its stages, shared by its source files */
#pragma once
#include "../bodies/bodies.h"
#include "../common/cloud.h"
#include "../common/radius.h"
#include "../common/tools.h"

typedef struct dem {
	quern_real density, skin, rest, settle_step; /* from the scene */
	radius_law radii;
	quern_list fill, place;
	const char *file;
	quern_real overlap_most, overlap_start; /* over the smaller radius */
	int32_t settle_most;
	bool fixed;    /* some grains do not move */
	bool features; /* some bodies have several */
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
enum { SLOT_CONTACT, SLOT_NEIGHBOURS, SLOT_INTEGRATOR, SLOT_BODIES, SLOT_PACKER, SLOT_SETTLING };

/* rows of dem.fill */
enum {
	FILL_POSITION,
	FILL_VELOCITY,
	FILL_RADIUS,
	FILL_MASS,
	FILL_SPIN,
	FILL_WEIGHT,
	FILL_FIXED,
	FILL_ID,
	FILL_DISPLACEMENT
};
/* rows of dem.open */
enum { OPEN_POSITION, OPEN_VELOCITY, OPEN_SPIN, OPEN_ANCHOR, OPEN_FIXED, OPEN_DISPLACEMENT };
/* rows of dem.neighbours */
enum {
	NEAR_POSITION,
	NEAR_RADIUS,
	NEAR_ID,
	NEAR_FIXED,
	NEAR_DISPLACEMENT,
	NEAR_ANCHOR,
	NEAR_FIRST,
	NEAR_SECOND,
	NEAR_GRAIN,
	NEAR_BODY,
	NEAR_FEATURE
};
/* rows of dem.forces and dem.observe */
enum {
	FORCE_OLD_POSITION,
	FORCE_OLD_VELOCITY,
	FORCE_OLD_SPIN,
	FORCE_POSITION,
	FORCE_VELOCITY,
	FORCE_SPIN,
	FORCE_RADIUS,
	FORCE_MASS,
	FORCE_WEIGHT,
	FORCE_FIXED,
	FORCE_FIRST,
	FORCE_SECOND,
	FORCE_GRAIN,
	FORCE_BODY,
	FORCE_FEATURE,
	FORCE_CONTACT,
	FORCE_TOUCH,
	FORCE_CONTACT_COUPLE,
	FORCE_TOUCH_COUPLE,
	FORCE_SUM,
	FORCE_CONTACT_SHEARED,
	FORCE_TOUCH_SHEARED,
	FORCE_ID,
	N_COMMON_FORCE_ROWS
};
enum {
	FORCE_ANCHOR = N_COMMON_FORCE_ROWS,
	FORCE_DISPLACEMENT,
	FORCE_IMPULSE,
	FORCE_SUPPORT,
	FORCE_DAMPED,
	FORCE_RUBBED,
	FORCE_TREMBLING,
	FORCE_DEEP_FIRST,
	FORCE_DEEP_SECOND,
	FORCE_DEEP_TIME
};
enum { OBSERVE_KINETIC = N_COMMON_FORCE_ROWS, OBSERVE_POTENTIAL, OBSERVE_STORED, OBSERVE_SHEARED };

/* The integrator of this step. */
QUERN_INLINE const quern_bound *dem_integrator(const quern_step *s) {
	return &s->slot[s->settling ? SLOT_SETTLING : SLOT_INTEGRATOR][0];
}

/* moment of inertia over mass times radius squared */
QUERN_INLINE quern_real dem_inertia(uint32_t dim) { return dim == 2 ? 0.5 : 0.4; }

/* The grains with rows of dem.fill; `weight` NULL: all of what each is. */
QUERN_INLINE cloud dem_cloud(const quern_step *s, const quern_real *weight) {
	return (cloud) { s->use[FILL_MASS].real[0], weight, s->use[FILL_FIXED].index,
		s->host->set(s->run, "grain").n };
}

quern_status quern_dem_fill(const void *self, const quern_step *);
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
