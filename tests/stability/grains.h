/* SPDX-License-Identifier: MIT */
/* grains - what the files of this program share: one page of tables, docs/validation/stability-grains.md */
#pragma once
#include <run.h>

/* s: the longest step that is not refused. */
double grains_limit(quern_run *);
/* J: of motion, as if somebody looked now; NaN where the run ends because of that. */
double grains_kinetic(quern_run *);

/* ---- grains_modes.c: every way in which a contact swings ---- */
void every_mode(void **);
