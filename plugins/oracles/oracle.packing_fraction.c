/* SPDX-License-Identifier: MIT */
/* oracle.packing_fraction - grains near the free surface, continuum deep inside. docs/theory/hybrid.md, section 3 */
#include "band.h"

typedef struct {
	quern_real critical;
	oracle_band band;
	bool walls;
} surface;

static const quern_param params[] = {
	QUERN_PARAM(surface, critical, "1", "Packing fraction of grains below which a cell is empty.", .def = 0.4,
		.min = 0, .max = 1, .flags = QUERN_MIN_OPEN | QUERN_MAX_OPEN),
	BAND_PARAMS(surface, "Depth of the middle of the hybrid zone below the surface."),
	QUERN_PARAM(surface, walls, NULL, "Walls and floors count as surface too, so that grains meet them."),
	QUERN_END_PARAMS
};
/* clang-format off */
#define USES(X) \
	X(FRACTION, "cell.packing_fraction", "1", QUERN_READ, QUERN_SCALAR, \
		.doc = "Of grains; 1 where the continuum fills the cell.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	return band_check(&((const surface *)self)->band, setup, err, "at the surface");
}

static void mark(const void *self, const quern_cell_batch *b) {
	const surface *p = self;
	const quern_real critical = p->critical, *restrict fraction = b->use[FRACTION].real[0];
	quern_real *restrict level = b->level;
	for (uint32_t i = 0; i < b->n; i++) level[i] = fraction[i] - critical;
}

static void decide(const void *self, const quern_cell_batch *b) {
	band_decide(&((const surface *)self)->band, b);
}

static uint32_t flags(const void *self) {
	return QUERN_SURFACE_FLOOD | (((const surface *)self)->walls ? QUERN_SURFACE_WALLS : 0);
}

static const quern_oracle_ops ops = { .size = sizeof ops, .mark = mark, .decide = decide, .surface = flags };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "oracle.packing_fraction",
	.brief = "Grains within a depth of the free surface.",
	.doc = "The surface is where the packing fraction falls below a critical one and open space is connected "
		   "with the outside; a void within does not count.",
	.cite = "Yue et al. 2018, 4.1",
	.instance_size = sizeof(surface),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
