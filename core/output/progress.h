/* SPDX-License-Identifier: MIT */
/* progress - what a run says while it goes: a line on the terminal that is written anew, and progress.json for programs */
#pragma once
#include "run.h"

typedef struct quern_progress {
	double next;  /* on the clock: when to look again */
	double begin; /* on the clock, and the steps that there were then: what the rate is of */
	int64_t step;
	bool settling; /* whether these were steps of settling */
} quern_progress;

/* Whether it is time for quern_progress_tell: after half a second, and two hundred times as long as it took last. */
bool quern_progress_due(const quern_progress *);
/* Looks at the run between two steps, which changes nothing of it; `wall`: s that it has taken in all. */
void quern_progress_tell(quern_progress *, quern_run *, double wall);
/* The last word: progress.json of a run that has ended, "done" or what summary.json calls it. */
void quern_progress_end(quern_progress *, quern_run *, const char *status, double wall);
