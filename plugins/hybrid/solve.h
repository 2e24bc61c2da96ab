/* SPDX-License-Identifier: MIT */
/* solve - in place of raster, couple and back, where the coupling sees all at once */
#pragma once
#include "hybrid.h"

/* Rows of hybrid.back. */
quern_status quern_hybrid_solve(const hybrid *, const quern_step *);
/* Rows of hybrid.back. Grain i gets this velocity from the exchange; returns the square of its way since the last list. */
quern_real quern_hybrid_move(const hybrid *, const quern_step *, int32_t i, const quern_real velocity[3]);
