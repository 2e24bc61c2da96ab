/* SPDX-License-Identifier: MIT */
/* wishes - what solvers and observers wish of the run as a whole: one grid for all, one number of substeps, so many
 * columns */
#pragma once
#include "plan.h"

/* m, of the shared grid's cells; 0: nobody has a wish. */
double quern_wish_cell(const quern_scene *);
/* Of a step; 1 where nobody has a wish. */
uint32_t quern_wish_substeps(const quern_scene *);
/* How often an observer's outputs come, 1 to 1000. */
uint32_t quern_wish_repeats(const quern_bound *observer);

/* A fault of the scene for each wish that is not that of a solver before it. `grid`: there is one, and somebody must
 * give its cells. */
void quern_wishes_check(const quern_scene *, bool grid);
