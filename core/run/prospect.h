/* SPDX-License-Identifier: MIT */
/* prospect - what a run whose solvers hand work to each other will hold and cost, found by its own first two steps */
#pragma once
#include "estimate.h"

typedef struct quern_prospect {
	/* False: nobody takes long steps beside those who take substeps, these do not carry all mass at the start, or the two steps
	 * failed or would take half a minute. */
	bool known;
	const char *who; /* take substeps: what a scene calls the entries of the first set of those that do */
	double discrete; /* share of the mass that they carry, after two steps */
	double ratio;    /* cost over that of these alone: with the scene's own substeps, */
	double best;     /* with as many as fit, */
	double wide;     /* and with cells twice as wide and as many as fit then */
	double substeps, wide_substeps; /* how many these are */
	double cell;                    /* m, as the scene has it */
} quern_prospect;

/* Of a run that was set up and whose estimate is `before`. Takes two long steps without settling first, from the state as the set-up
 * has left it; the run is good for no more than to be looked at and destroyed afterwards. The same for any number of threads. */
quern_prospect quern_prospect_of(quern_run *, const quern_estimate *before);
/* Cost of a second of scene time over that of `alone`, a substep's price of those alone who take them: (n a + b)/(dt_long) over
 * alone/dt_short, where a and b (s) are the prices of a substep and of a long step. The long step is as long as n of the own short ones,
 * no longer than the own long one; prices as quern_estimate_price gives them. */
double quern_prospect_ratio(
	double n, double substep_price, double step_price, double own_substep, double own_step, double alone);
