/* radius - the distribution of grain radii, by the number of the draw */
#pragma once
#include <quern/abi.h>

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
