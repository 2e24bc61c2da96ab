/* SPDX-License-Identifier: MIT */
/* oracle.strain_rate - grains where the flow shears fast. docs/theory/hybrid.md, section 3 */
#include "band.h"
#include <math.h>

typedef struct {
	quern_real shear_rate, inertial_number, release;
	oracle_band band;
	bool by_rate, by_number;
} shear;

static const quern_param params[] = { QUERN_PARAM(shear, shear_rate, "1/s",
										  "Shear rate from which on grains are wanted.",
										  .flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e12),
	QUERN_PARAM(shear, inertial_number, "1", "Inertial number from which on grains are wanted.",
		.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(shear, release, "1", "Grains stay until the flow is slower than this share of the threshold.",
		.def = 0.6, .min = 0, .max = 1, .flags = QUERN_MIN_OPEN),
	BAND_PARAMS(shear, "Distance from the fast region to the middle of the hybrid zone."),
	QUERN_PARAM(shear, by_rate, NULL, "Keep the shear rate; set by itself.", .flags = QUERN_ADVANCED),
	QUERN_PARAM(shear, by_number, NULL, "Keep the inertial number; set by itself.", .flags = QUERN_ADVANCED),
	QUERN_END_PARAMS };
/* clang-format off */
#define USES(X) \
	X(RATE, "cell.shear_rate", "1/s", QUERN_READ, QUERN_SCALAR, .when = "by_rate", \
		.doc = "Of the mean velocity of both.") \
	X(NUMBER, "cell.inertial_number", "1", QUERN_READ, QUERN_SCALAR, .when = "by_number", \
		.doc = "Shear rate times d sqrt(rho/p).")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	shear *p = self;
	p->by_rate = !isnan(p->shear_rate);
	p->by_number = !isnan(p->inertial_number);
	if (!p->by_rate && !p->by_number)
		return setup->host->fail(err, QUERN_E_PARAM, NULL, "give shear_rate, inertial_number or both");
	return band_check(&p->band, setup, err, "where the flow is fast");
}

/* Above the threshold: outside. A cell that has grains keeps them down to a lower one, so that it does not flicker. */
static void mark(const void *self, const quern_cell_batch *b) {
	const shear *p = self;
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real share = b->zone[i] == QUERN_CONTINUUM ? 1 : p->release;
		quern_real level = 1;
		if (p->by_rate) level = fmin(level, share - b->use[RATE].real[0][i] / p->shear_rate);
		if (p->by_number) level = fmin(level, share - b->use[NUMBER].real[0][i] / p->inertial_number);
		b->level[i] = level;
	}
}

static void decide(const void *self, const quern_cell_batch *b) {
	band_decide(&((const shear *)self)->band, b);
}

static const quern_oracle_ops ops = { .size = sizeof ops, .mark = mark, .decide = decide };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "oracle.strain_rate",
	.brief = "Grains where the flow shears fast.",
	.doc = "Cells whose shear rate or inertial number is above a threshold count as surface: shear bands and "
		   "jets are made of grains before they matter. Combine it with packing_fraction by a list.",
	.cite = "Yue et al. 2018, 8 (as future work); GDR MiDi 2004",
	.instance_size = sizeof(shear),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
