/* SPDX-License-Identifier: MIT */
/* hybrid - the parameters of the hybrid solver and the rows of its stages, shared by its source files */
#pragma once
#include "../bodies/bodies.h"
#include "../common/cloud.h"
#include "../common/radius.h"
#include "../common/tools.h"
#include <quern/grid.h>

typedef struct hybrid {
	int32_t substeps, update, samples; /* from the scene */
	quern_real hysteresis, guard, gain;
	quern_real diameter, density, packed, law_number; /* of the grains, published by their solver */
	radius_law radii;                                 /* of grains that enrich cells: a stream of their own */
	uint32_t dim, every, sample_every;                /* steps */
	bool affine;
} hybrid;

/* slots, in the order of the solver's table */
enum { SLOT_ORACLE, SLOT_PACKER, SLOT_COUPLING, SLOT_MATERIAL, SLOT_SHAPE, SLOT_TRANSFER, SLOT_BODIES };

/* rows of hybrid.update, which sees everything */
enum {
	U_GRAIN_POSITION,
	U_GRAIN_VELOCITY,
	U_GRAIN_SPIN,
	U_GRAIN_RADIUS,
	U_GRAIN_MASS,
	U_GRAIN_WEIGHT,
	U_GRAIN_FIXED,
	U_GRAIN_HOME,
	U_GRAIN_NORMAL,
	U_POINT_POSITION,
	U_POINT_VELOCITY,
	U_POINT_MASS,
	U_POINT_VOLUME,
	U_POINT_STRESS,
	U_POINT_WEIGHT,
	U_POINT_HOME,
	U_POINT_NORMAL,
	U_ZONE,
	U_FRACTION,
	U_SHEAR_RATE,
	U_INERTIAL,
	U_GRAIN_OWED,
	U_POINT_OWED,
	U_GRAIN_OWED_MOMENTUM,
	U_POINT_OWED_MOMENTUM,
	U_STRESS,
	U_SAMPLES,
	U_DRAWS,
	U_UPDATES,
	U_MASS,
	U_DISPLACEMENT,
	U_UNSORTED,
	U_MASS_DEFECT,
	U_MOMENTUM_DEFECT
};
/* rows of hybrid.sample */
enum {
	S_FORCE,
	S_FIRST,
	S_SECOND,
	S_TOUCH_FORCE,
	S_TOUCH_GRAIN,
	S_TOUCH_BODY,
	S_POSITION,
	S_RADIUS,
	S_FIXED,
	S_STRESS,
	S_SAMPLES,
	S_TOUCH_FEATURE
};
/* rows of hybrid.raster, hybrid.couple and hybrid.back */
enum { R_POSITION, R_VELOCITY, R_MASS, R_WEIGHT, R_FIXED, R_NODE, R_MOTION, R_MIXTURE };
enum { C_NODE, C_MOTION, C_MIXTURE, C_EXCHANGE, C_ENERGY };
enum { B_POSITION, B_VELOCITY, B_MASS, B_WEIGHT, B_FIXED, B_ANCHOR, B_NODE, B_MIXTURE, B_DISPLACEMENT };
/* rows of hybrid.audit */
enum {
	A_GRAIN_VELOCITY,
	A_GRAIN_MASS,
	A_GRAIN_WEIGHT,
	A_GRAIN_FIXED,
	A_POINT_VELOCITY,
	A_POINT_MASS,
	A_POINT_WEIGHT,
	A_GRAIN_OWED,
	A_POINT_OWED,
	A_GRAIN_OWED_MOMENTUM,
	A_POINT_OWED_MOMENTUM,
	A_BODY,
	A_FACES,
	A_SUPPORT,
	A_EXCHANGE,
	A_GRAVITY,
	A_MASS,
	A_MOMENTUM,
	A_SCALE,
	A_LEFT,
	A_AUDITS,
	A_MASS_DEFECT,
	A_MOMENTUM_DEFECT,
	A_ENERGY,
	A_WORK,
	A_FORCE,
	A_FIRST,
	A_SECOND,
	A_GRAIN_POSITION,
	A_GRAIN_RADIUS,
	A_GRAIN_SPIN,
	A_POINT_VOLUME,
	A_POINT_STRESS
};

/* Lanes of a mixture row: mass, momentum, change of velocity. */
QUERN_INLINE uint32_t mixture_change(uint32_t dim) { return 1 + dim; }

quern_status quern_hybrid_update(const void *self, const quern_step *);
quern_status quern_hybrid_sample(const void *self, const quern_step *);
quern_status quern_hybrid_raster(const void *self, const quern_step *);
quern_status quern_hybrid_couple(const void *self, const quern_step *);
quern_status quern_hybrid_back(const void *self, const quern_step *);
quern_status quern_hybrid_audit(const void *self, const quern_step *);
/* Rows of the audit: J that grains and points have in their springs and in turning, an upper bound. */
quern_real quern_hybrid_held(const quern_step *);
/* Rows of the audit: ends the run if grains and points, which carry so much mass, move with more energy than there was,
 * gravity has given and `gain` allows. */
quern_status quern_hybrid_judge_gain(
	const hybrid *, const quern_step *, quern_real kinetic, quern_real carried);

/* The clouds with rows of the update, until a set changes. */
QUERN_INLINE cloud moving_grains(const quern_step *s) {
	return (cloud) { s->use[U_GRAIN_MASS].real[0], s->use[U_GRAIN_WEIGHT].real[0],
		s->use[U_GRAIN_FIXED].index, s->host->set(s->run, "grain").n };
}
QUERN_INLINE cloud all_points(const quern_step *s) {
	return (cloud) { s->use[U_POINT_MASS].real[0], s->use[U_POINT_WEIGHT].real[0], NULL,
		s->host->set(s->run, "point").n };
}

/* Weight of a grain or a point in a cell of that zone. */
QUERN_INLINE quern_real grain_share(int32_t zone) {
	return zone == QUERN_DISCRETE ? 1 : zone == QUERN_HYBRID ? 0.5 : 0;
}
QUERN_INLINE quern_real point_share(int32_t zone) { return 1 - grain_share(zone); }
