/* SPDX-License-Identifier: MIT */
/* oracle.strain_rate - grains where the flow shears fast. docs/theory/hybrid.md, section 3 */
#include "band.h"
#include <math.h>
#include <quern/math.h>

typedef struct {
	quern_real shear_rate, rate_change, inertial_number, release;
	quern_real least_pressure, most_agitation, diameter, density;
	oracle_band band;
	bool by_rate, by_change, by_number;
} shear;

static const quern_param params[] = { QUERN_PARAM(shear, shear_rate, "1/s",
										  "Shear rate from which on grains are wanted.",
										  .flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e12),
	QUERN_PARAM(shear, rate_change, "1/s",
		"Change of the shear rate over a grain's diameter from which on grains are wanted.",
		.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e12),
	QUERN_PARAM(shear, inertial_number, "1", "Inertial number from which on grains are wanted.",
		.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(shear, release, "1",
		"What has become fast counts as such until the flow is slower than this share of each threshold.",
		.def = 0.6, .min = 0, .max = 1, .flags = QUERN_MIN_OPEN),
	QUERN_PARAM(shear, least_pressure, "Pa",
		"Below this pressure contacts do not last, and what is fast stays fast, what is slow slow. Default: "
		"what two layers of grains weigh, 2 rho g d.",
		.flags = QUERN_MAYBE, .max = 1e15),
	QUERN_PARAM(shear, most_agitation, "1",
		"Likewise where rho T/p is above this, T the granular temperature: grains collide there and do not "
		"rub.",
		.def = 0.5, .max = 1e6, .flags = QUERN_MIN_OPEN),
	BAND_PARAMS(shear, "Distance from the fast region to the middle of the hybrid zone."),
	QUERN_PARAM_AS(shear, diameter, "grain.diameter", "m", "Mean diameter of the grains.",
		.from = "grain.diameter", .flags = QUERN_MAYBE | QUERN_ADVANCED, .max = 1e6),
	QUERN_PARAM_AS(shear, density, "grain.density", "kg/m^3", "Density of their material.",
		.from = "grain.density", .flags = QUERN_MAYBE | QUERN_ADVANCED, .max = 1e6),
	QUERN_PARAM(shear, by_rate, NULL, "Keep the shear rate; set by itself.", .flags = QUERN_ADVANCED),
	QUERN_PARAM(shear, by_change, NULL, "Keep its change; set by itself.", .flags = QUERN_ADVANCED),
	QUERN_PARAM(shear, by_number, NULL, "Keep the inertial number; set by itself.", .flags = QUERN_ADVANCED),
	QUERN_END_PARAMS };
/* clang-format off */
#define USES(X) \
	X(PRESSURE, "cell.pressure", "Pa", QUERN_READ, QUERN_SCALAR, .doc = "Of contacts and points, in their shares.") \
	X(AGITATION, "cell.agitation", "1", QUERN_READ, QUERN_SCALAR, \
		.doc = "Grain density times granular temperature over the pressure; 0 without pressure.") \
	X(RATE, "cell.shear_rate", "1/s", QUERN_READ, QUERN_SCALAR, .when = "by_rate", \
		.doc = "Of the mean velocity of both.") \
	X(CHANGE, "cell.rate_change", "1/s", QUERN_READ, QUERN_SCALAR, .when = "by_change", \
		.doc = "Of the shear rate over a mean diameter.") \
	X(NUMBER, "cell.inertial_number", "1", QUERN_READ, QUERN_SCALAR, .when = "by_number", \
		.doc = "Shear rate times d sqrt(rho/p).")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	shear *p = self;
	p->by_rate = !isnan(p->shear_rate);
	p->by_change = !isnan(p->rate_change);
	p->by_number = !isnan(p->inertial_number);
	if (!p->by_rate && !p->by_change && !p->by_number)
		return setup->host->fail(
			err, QUERN_E_PARAM, NULL, "give a threshold: shear_rate, rate_change or inertial_number");
	return band_check(&p->band, setup, err, "where the flow is fast");
}

static quern_real floor_of(const shear *p, const quern_real g[3]) {
	const quern_real layers = 2 * p->density * p->diameter * sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
	return !isnan(p->least_pressure) ? p->least_pressure : isnan(layers) ? 0 : layers;
}

/* The largest of the rates, each over its threshold. */
static quern_real speed(const shear *p, const quern_column *use, uint32_t i) {
	quern_real most = 0;
	if (p->by_rate) most = quern_max(most, use[RATE].real[0][i] / p->shear_rate);
	if (p->by_change) most = quern_max(most, use[CHANGE].real[0][i] / p->rate_change);
	if (p->by_number) most = quern_max(most, use[NUMBER].real[0][i] / p->inertial_number);
	return most;
}

/* Fast is outside. A cell that was fast stays so down to a lower threshold, so that it does not flicker; where contacts do not
 * last, as in free fall, it stays what it was: rates say nothing of friction there. */
static void mark(const void *self, const quern_cell_batch *b) {
	const shear *p = self;
	const quern_real least = floor_of(p, b->gravity), *pressure = b->use[PRESSURE].real[0],
					 *agitation = b->use[AGITATION].real[0];
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real threshold = b->marked[i] ? p->release : 1;
		const bool last = pressure[i] > 0 && pressure[i] >= least && agitation[i] <= p->most_agitation;
		b->level[i] = last ? threshold - speed(p, b->use, i) : b->marked[i] ? -1 : 1;
	}
}

static void decide(const void *self, const quern_cell_batch *b) {
	band_decide(&((const shear *)self)->band, b);
}

static uint32_t wants(const void *self) {
	(void)self;
	return QUERN_ORACLE_MARKED;
}

static quern_real reach(const void *self) { return band_reach(&((const shear *)self)->band); }

static const quern_oracle_ops ops = {
	.size = sizeof ops, .mark = mark, .decide = decide, .wants = wants, .reach = reach
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 2,
	.dims = QUERN_2D | QUERN_3D,
	.id = "oracle.strain_rate",
	.brief = "Grains where the flow shears fast.",
	.doc =
		"Cells whose shear rate, its change over a diameter or inertial number is above a threshold count as "
		"surface, where contacts last: shear bands are made of grains before they matter. Combine it with "
		"packing_fraction by a list.",
	.cite = "Yue et al. 2018, 8 (as future work); GDR MiDi 2004",
	.instance_size = sizeof(shear),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
