/* SPDX-License-Identifier: MIT */
/* kit - a small run of every part, from which the targets take the files that they damage */
#pragma once
#include <run.h>

/* A run of grains, continuum and hybrid whose set-up has not begun. */
quern_run *kit_open(void);
/* Settles nothing, and takes steps as a run would. */
void kit_steps(quern_run *, int n);
/* One that has done its set-up and some steps, in a folder of its own that is kept in memory if that can be. */
quern_run *kit_run(const char *name, int n);
/* The same of another run. */
quern_run *kit_run_of(const char *name, quern_run *, int n);
void kit_close(quern_run *);
