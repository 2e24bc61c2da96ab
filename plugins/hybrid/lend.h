/* SPDX-License-Identifier: MIT */
/* lend - what the coupling gives to grains ahead */
#pragma once
#include "update.h"

/* s: the time for which an impulse that is spread evenly over a long step has moved a grain by its end. */
quern_real quern_hybrid_path(const hybrid *, const quern_step *);
/* Rows of hybrid.raster: grains are as if they had had nothing from the coupling in this step. */
quern_status quern_hybrid_take_back(const hybrid *, const quern_step *);
/* What contacts bore of a grain with the old weights, and no longer do, is lent to it. */
void quern_hybrid_lend(const update *, const quern_real *old);
