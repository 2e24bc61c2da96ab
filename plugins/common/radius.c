/* SPDX-License-Identifier: MIT */
#include "radius.h"
#include <quern/math.h>

quern_real quern_radius_least(const radius_law *law) {
	return law->mean * (1 - law->spread * (law->law == RADIUS_NORMAL ? 2 : 1));
}

quern_real quern_radius_most(const radius_law *law) {
	return law->mean * (1 + law->spread * (law->law == RADIUS_NORMAL ? 2 : 1));
}

/* Box and Muller 1958; a draw beyond two standard deviations is repeated, which truncates without distorting. */
static quern_real normal(const radius_law *law, const quern_host *host, uint64_t k) {
	for (uint64_t attempt = 0;; attempt++) {
		quern_real u[2];
		host->random(law->stream, k, attempt, u);
		const quern_real size = __builtin_sqrt(-2 * quern_log(1 - u[0]));
		const quern_real z = size * quern_cos(6.283185307179586 * u[1]);
		if (z >= -2 && z <= 2) return z;
	}
}

quern_real quern_radius_draw(const radius_law *law, const quern_host *host, uint64_t k) {
	if (law->spread == 0) return law->mean;
	if (law->law == RADIUS_NORMAL) return law->mean * (1 + law->spread * normal(law, host, k));
	quern_real u[2];
	host->random(law->stream, k, 0, u);
	return law->mean * (1 + law->spread * (2 * u[0] - 1));
}
