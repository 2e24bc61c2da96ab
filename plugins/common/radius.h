/* SPDX-License-Identifier: MIT */
/* radius - the distribution of grain radii, by the number of the draw */
#pragma once
#include <quern/math.h>
#include <quern/solver.h>

/* kg of a sphere of that radius; in 2-D of a disc one metre deep. */
QUERN_INLINE quern_real quern_radius_mass(quern_real radius, quern_real density, uint32_t dim) {
	const quern_real area = 3.141592653589793 * radius * radius;
	return density * (dim == 2 ? area : 4.0 / 3 * area * radius);
}

/* The radius of a grain that weighs so much. */
QUERN_INLINE quern_real quern_radius_of_mass(quern_real mass, quern_real density, uint32_t dim) {
	const quern_real volume = mass / density / 3.141592653589793;
	return dim == 2 ? __builtin_sqrt(volume) : quern_cbrt(0.75 * volume);
}

/* Moment of inertia over mass times radius squared. */
QUERN_INLINE quern_real quern_radius_inertia(uint32_t dim) { return dim == 2 ? 0.5 : 0.4; }

enum { RADIUS_NORMAL, RADIUS_UNIFORM };

typedef struct radius_law {
	int32_t law;
	quern_real mean,
		spread; /* m; normal: standard deviation over mean, cut at two of them; uniform: half-width over mean */
	uint64_t stream;
} radius_law;

/* The radius of draw k: the same whenever it is asked for. */
quern_real quern_radius_draw(const radius_law *, const quern_host *, uint64_t k);
quern_real quern_radius_least(const radius_law *);
quern_real quern_radius_most(const radius_law *);
