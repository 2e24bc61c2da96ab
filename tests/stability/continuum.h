/* SPDX-License-Identifier: MIT */
/* continuum - what the files of this program share: one page of tables, docs/validation/stability-continuum.md */
#pragma once
#include <run.h>

/* s: of the continuum, as its points are now. */
double continuum_limit(quern_run *);
/* m/s: of pressure waves in `elastic`, Poisson's ratio 0.3, in the plane or in space. */
double continuum_wave(double bulk, double density, uint32_t dim);
/* In [0, 1), from one call to the next. */
double continuum_drawn(uint64_t *state);

typedef struct scatter {
	double mean, rms; /* of minus the mean normal stress, Pa; of what is beside the mean */
} scatter;
scatter continuum_pressure(quern_run *);

/* ---- continuum_unseen.c: what the grid does not see ---- */
void cell_crossing(void **);
void unseen_motion(void **);
void random_motion(void **);
void lone_point(void **);
void share_as_viscosity(void **);

/* ---- continuum_flow.c: material that flows, breaks apart and meets walls ---- */
void flow_over_step(void **);
void stiff_flow(void **);
void stiff_slump(void **);
void thin_layers(void **);
void thrown_apart(void **);
void impacts(void **);
