/* SPDX-License-Identifier: MIT */
/* account - what a solver of moving masses sums up, by the names that the program knows */
#pragma once
#include "cloud.h"

enum { SUM_MASS, SUM_MOMENTUM, SUM_KINETIC = SUM_MOMENTUM + 3, SUM_POTENTIAL, SUM_OWN };

/* The first rows of `sums`; what is the solver's own comes from SUM_OWN on. */
#define ACCOUNT_ROWS                                                                                         \
	{ .name = "mass", .unit = "kg", .doc = "Carried, weighted." },                                           \
		{ .name = "momentum_x", .unit = "kg m/s" }, { .name = "momentum_y", .unit = "kg m/s" },              \
		{ .name = "momentum_z", .unit = "kg m/s" }, { .name = "kinetic", .unit = "J" }, {                    \
		.name = "potential", .unit = "J", .doc = "In the field of gravity, from the origin on."              \
	}

/* Rows of what came and went. */
#define FLOW_ROWS                                                                                            \
	{ .name = "left", .unit = "kg", .doc = "Out through faces of the domain so far." }, {                    \
		.name = "poured", .unit = "kg", .doc = "In by sources so far."                                       \
	}

/* Adds mass, momentum and the energy of height. */
static inline void cloud_account(
	const cloud_sums *c, const quern_column *x, const quern_column *v, const quern_step *s, quern_real *out) {
	out[SUM_MASS] += cloud_total(c);
	for (uint32_t k = 0; k < s->dim; k++) CLOUD_ADD(c, i, v->real[k][i], out[SUM_MOMENTUM + k]);
	CLOUD_ADD(c, i, cloud_height(x, i, s->dim, s->gravity), out[SUM_POTENTIAL]);
}
