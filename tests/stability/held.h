/* SPDX-License-Identifier: MIT */
/* held - a hybrid column held by walls on both sides, which must not move */
#pragma once
#include <run.h>

typedef struct held {
	quern_run *run;
	double width;                       /* m */
	double grain_step, continuum_limit; /* s: recommended; hard */
	double unit, weight;                /* J: m g d of all grains; N: of the whole column */
} held;

/* Settled; a long step is `substeps` recommended grain steps from now on, whatever the continuum says of it. */
held held_open(double width, double height, int substeps, const char *packer, int seed);
/* Moving grains' and points' kinetic energy over m g d. */
double held_kinetic(const held *);
/* Height that 99 % of the carried mass lie below, m. */
double held_top(const held *);
/* Upward impulse that floor and fixed grains have given so far, N s. */
double held_support(const held *);
/* Of how n columns rest the middle one counts: some tremble by chance for as long again. Sorts them. */
double held_middle(double *rest, int n);
