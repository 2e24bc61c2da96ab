/* SPDX-License-Identifier: MIT */
/* grow - grains that were put into holes too small for them grow to the radius that goes with their mass. docs/theory/hybrid.md,
 * section 4 */
#include "hybrid.h"
#include <math.h>
#include <stdlib.h>

/* Of a radius: what a grain may overlap another one as it grows. */
static const quern_real most_overlap = 0.015;

static void note(quern_real *worst, int32_t i, quern_real overlap) {
	if (overlap > worst[i]) worst[i] = overlap;
}

/* Who has no entry in the list has nobody near, as long as a step of growth is short beside the list's skin; it is not if `growth` is only some hundred grain steps. */
static void find_overlaps(const quern_step *s, quern_real *worst, uint32_t grains) {
	const quern_column *u = s->use;
	const uint32_t n = s->host->set(s->run, "contact").n;
	const quern_images images = quern_images_of(s->dim, s->lower, s->upper, s->periodic);
	for (uint32_t i = 0; i < grains; i++) worst[i] = -INFINITY;
	for (uint32_t c = 0; c < n; c++) {
		const int32_t i = u[G_FIRST].index[c], j = u[G_SECOND].index[c];
		quern_real d2 = 0;
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

quern_status quern_hybrid_grow(const void *self, const quern_step *s) {
	const hybrid *h = self;
	const quern_column *u = s->use;
	const uint32_t n = s->host->set(s->run, "grain").n;
	quern_real *worst = NULL, farthest = 0;
	for (uint32_t i = 0; i < n && h->growth > 0; i++) {
		const quern_real mass = u[G_MASS].real[0][i], now = u[G_RADIUS].real[0][i];
		if (u[G_FIXED].index && u[G_FIXED].index[i]) continue;
		if (mass <= quern_radius_mass(now, h->density, s->dim) * (1 + 1e-9)) continue;
		if (!worst) {
			worst = s->host->memory(s->run, n * sizeof *worst);
			if (!worst) return QUERN_E_MEMORY;
			find_overlaps(s, worst, n);
		}
		const quern_real room = 0.5 * (most_overlap * now - worst[i]); /* the other one may grow as well */
		if (!(room > 0)) continue;
		const quern_real whole = quern_radius_of_mass(mass, h->density, s->dim),
						 then = now + fmin(room, 0.5 * h->diameter * (quern_real)h->substeps /
													 (quern_real)h->growth);
		u[G_RADIUS].real[0][i] = then < whole ? then : whole;
		farthest = fmax(farthest, u[G_RADIUS].real[0][i] - now);
	}
	u[G_GROWN].real[0][0] += farthest;
	return QUERN_OK;
}
