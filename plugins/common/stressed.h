/* SPDX-License-Identifier: MIT */
/* stressed - points whose stress is given: the rest of their state by the material's state-from-stress */
#pragma once
#include <quern/material.h>
#include <quern/solver.h>

/* Whole columns of the set; energy.real[0] may be NULL. */
typedef struct stressed_points {
	quern_column mass, volume, stress, energy;
} stressed_points;

/* Gives the points begin .. begin + n the history, volume and energy that go with their stress: density is what the
 * material says, mass stays. One thread; calls with other points may run beside it. */
void quern_stressed_assign(
	const stressed_points *, const quern_bound *material, uint32_t dim, uint32_t begin, uint32_t n);
