/* SPDX-License-Identifier: MIT */
/* grow - grains that were put into holes too small for them grow to the radius that goes with their mass. docs/theory/hybrid.md,
 * section 4 */
#include "hybrid.h"
#include <math.h>
#include <stdlib.h>

/* Of a radius: what a grain may overlap another one as it grows. */
static const quern_real most_overlap = 0.015;

static bool shall_grow(const hybrid *h, const quern_step *s, uint32_t i) {
	const quern_column *u = s->use;
	if (u[G_FIXED].index && u[G_FIXED].index[i]) return false;
	return u[G_MASS].real[0][i] > quern_radius_mass(u[G_RADIUS].real[0][i], h->density, s->dim) * (1 + 1e-9);
}

/* Of one that shall not grow nothing is noted. */
static void note(quern_real *worst, int32_t i, quern_real overlap) {
	if (overlap > worst[i]) worst[i] = overlap;
}

/* Of grains that shall grow; NaN stands at all others. Who has no entry in the list has nobody near, as long as a step of growth is short
 * beside the list's skin; it is not if `growth` is only some hundred grain steps. */
static void find_overlaps(const quern_step *s, quern_real *worst) {
	const quern_column *u = s->use;
	const uint32_t n = s->host->set(s->run, "contact").n;
	const quern_images images = quern_images_of(s->dim, s->lower, s->upper, s->periodic);
	for (uint32_t c = 0; c < n; c++) {
		const int32_t i = u[G_FIRST].index[c], j = u[G_SECOND].index[c];
		quern_real d2 = 0;
		if (isnan(worst[i]) && isnan(worst[j])) continue;
		for (uint32_t k = 0; k < s->dim; k++) {
			const quern_real *x = u[G_POSITION].real[k],
							 d = quern_image(x[i] - x[j], images.half[k], images.length[k]);
			d2 += d * d;
		}
		const quern_real overlap = u[G_RADIUS].real[0][i] + u[G_RADIUS].real[0][j] - sqrt(d2);
		note(worst, i, overlap);
		note(worst, j, overlap);
	}
}

/* By how much its radius grows, m. */
static quern_real grow(const hybrid *h, const quern_step *s, uint32_t i, quern_real worst) {
	quern_real *radius = s->use[G_RADIUS].real[0];
	const quern_real now = radius[i],
					 room = 0.5 * (most_overlap * now - worst), /* the other one may grow as well */
		whole = quern_radius_of_mass(s->use[G_MASS].real[0][i], h->density, s->dim),
					 step = 0.5 * h->diameter * (quern_real)h->substeps / (quern_real)h->growth;
	if (!(room > 0)) return 0;
	const quern_real then = now + fmin(room, step);
	radius[i] = then < whole ? then : whole;
	return radius[i] - now;
}

quern_status quern_hybrid_grow(const void *self, const quern_step *s) {
	const hybrid *h = self;
	const uint32_t n = s->host->set(s->run, "grain").n;
	quern_real farthest = 0;
	uint32_t first = h->growth > 0 ? 0 : n;
	while (first < n && !shall_grow(h, s, first)) first++;
	if (first == n) return QUERN_OK;
	quern_real *worst = s->host->memory(s->run, n * sizeof *worst);
	if (!worst) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) worst[i] = i >= first && shall_grow(h, s, i) ? -INFINITY : NAN;
	find_overlaps(s, worst);
	for (uint32_t i = 0; i < n; i++)
		if (!isnan(worst[i])) farthest = fmax(farthest, grow(h, s, i, worst[i]));
	s->use[G_GROWN].real[0][0] += farthest;
	return QUERN_OK;
}
