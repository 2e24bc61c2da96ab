/* SPDX-License-Identifier: MIT */
/* account - what a solver of moving masses sums up, by the names that the program knows */
#pragma once
#include <quern/solver.h>

enum { SUM_MASS, SUM_MOMENTUM, SUM_KINETIC = SUM_MOMENTUM + 3, SUM_POTENTIAL, SUM_OWN };

/* The first rows of `sums`; what is the solver's own comes from SUM_OWN on. */
#define ACCOUNT_ROWS                                                                                         \
	{ .name = "mass", .unit = "kg", .doc = "Carried, weighted." },                                           \
		{ .name = "momentum_x", .unit = "kg m/s" }, { .name = "momentum_y", .unit = "kg m/s" },              \
		{ .name = "momentum_z", .unit = "kg m/s" }, { .name = "kinetic", .unit = "J" }, {                    \
		.name = "potential", .unit = "J", .doc = "In the field of gravity, from the origin on."              \
	}
