/* SPDX-License-Identifier: MIT */
/* estimate - what a run will cost, before its first step */
#pragma once
#include "run.h"

typedef struct quern_estimate {
	double step, hard;                  /* s: the long step, and what is unstable */
	double steps, substeps;             /* that are left */
	double most_substeps;               /* that a long step has room for; 0: nobody asks */
	quern_own_steps own;                /* why so many */
	double settle_step, settle_steps;   /* s; 0 steps: nothing to settle */
	double settling, running;           /* s on one core */
	char reason[200], hard_reason[200]; /* what sets step and hard */
} quern_estimate;

/* After the set-up or a resume, of what is left. */
quern_estimate quern_estimate_of(quern_run *);
/* s on one core for one step of all entries that are counted, by the rough prices in the tables of their solvers: in substeps, or
 * else in whole steps of n substeps with all other work that solvers tell of, as if cells were so many times as wide. */
double quern_estimate_price(quern_run *, bool substeps, uint32_t n, double wider);
/* "less than 2 s", "about 3.5 h", "about 12 days" */
void quern_estimate_time(double seconds, char out[32]);
/* True if it takes more than a day on as many cores; then `say` has a sentence about why. */
bool quern_estimate_is_long(const quern_estimate *, uint32_t cores, char say[600]);
