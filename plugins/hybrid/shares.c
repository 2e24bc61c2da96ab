/* SPDX-License-Identifier: MIT */
/* shares - how much of a hybrid cell's material the continuum carries: half, or more of it the farther away the grains'
 * side is. docs/theory/hybrid.md, section 1 */
#include "update.h"
#include <math.h>
#include <quern/math.h>

static const quern_real pi = 3.14159265358979312;

/* A cloud that carries next to nothing of a cell would be given all that it is owed many times over. */
static const quern_real least = 0.02;

/* In the middle both ways are as long; half a zone farther on one of them is none. Where the zone has no other end,
 * there is nothing to lead to. */
static quern_real ramp(quern_real to_discrete, quern_real to_continuum) {
	if (!(to_discrete + to_continuum < INFINITY)) return 0.5;
	return 0.5 - 0.5 * quern_cos(pi * to_discrete / (to_discrete + to_continuum));
}

static void *take(const update *d, size_t size) {
	return d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * size);
}

/* Ways lead through the zone alone, to the nearest cell of either kind that holds something. */
static quern_status ramp_zone(update *d) {
	bool *discrete = take(d, sizeof(bool)), *continuum = take(d, sizeof(bool)), *zone = take(d, sizeof(bool));
	quern_real *to_discrete = take(d, sizeof(quern_real)), *to_continuum = take(d, sizeof(quern_real));
	if (!discrete || !continuum || !zone || !to_discrete || !to_continuum) return QUERN_E_MEMORY;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		zone[c] = d->zone[c] == QUERN_HYBRID;
		discrete[c] = d->zone[c] == QUERN_DISCRETE && d->mass[c] > 0;
		continuum[c] = d->zone[c] == QUERN_CONTINUUM;
	}
	quern_status status = quern_hybrid_distance(d, discrete, zone, to_discrete);
	if (status == QUERN_OK) status = quern_hybrid_distance(d, continuum, zone, to_continuum);
	for (uint32_t c = 0; c < d->n_cells && status == QUERN_OK; c++)
		if (zone[c]) d->share[c] = ramp(to_discrete[c], to_continuum[c]);
	return status;
}

quern_status quern_hybrid_shares(update *d) {
	quern_status status = QUERN_OK;
	for (uint32_t c = 0; c < d->n_cells; c++) d->share[c] = zone_share(d->zone[c]);
	if (!d->h->ramped) return QUERN_OK;
	if (d->h->weights == WEIGHTS_RAMP) status = ramp_zone(d);
	for (uint32_t c = 0; c < d->n_cells; c++) {
		if (d->zone[c] != QUERN_HYBRID) continue;
		const quern_real own = d->share[c], asked = d->asked[c] >= 0 ? d->asked[c] : own;
		const quern_real share = d->h->weights == WEIGHTS_RAMP ? quern_min(own, asked) : asked;
		d->share[c] = quern_clamp(share, least, 1 - least);
	}
	return status;
}
