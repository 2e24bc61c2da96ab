/* SPDX-License-Identifier: MIT */
/* oracle.packing_fraction - grains near the free surface, continuum deep inside. docs/theory/hybrid.md, section 3 */
#include <quern/oracle.h>

typedef struct {
	quern_real critical, depth, half_width, cell;
	bool walls;
} surface;

static const quern_param params[] = {
	QUERN_PARAM(surface, critical, "1", "Packing fraction of grains below which a cell is empty.", .def = 0.4,
		.min = 0, .max = 1, .flags = QUERN_MIN_OPEN | QUERN_MAX_OPEN),
	QUERN_PARAM(surface, depth, "m", "Depth of the middle of the hybrid zone below the surface.",
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(surface, half_width, "m", "Half the width of the hybrid zone; a cell at least.",
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(
		surface, cell, "m", "Cell of the grid.", .from = "grid.cell", .flags = QUERN_MAYBE | QUERN_ADVANCED),
	QUERN_PARAM(surface, walls, NULL, "Walls and floors count as surface too, so that grains meet them."),
	QUERN_END_PARAMS
};
enum { FRACTION };
static const quern_use uses[] = { { .field = "cell.packing_fraction",
									  .unit = "1",
									  .doc = "Of grains; 1 where the continuum fills the cell.",
									  .access = QUERN_READ,
									  .shape = QUERN_SCALAR },
	QUERN_END_USES };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	const surface *p = self;
	if (p->half_width < (1 - 1e-9) * p->cell)
		return setup->host->fail(err, QUERN_E_PARAM, "half_width",
			"must be a cell at least, %.4g m: a narrower zone is none in places", p->cell);
	if (p->depth > p->half_width) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, "half_width",
		"must be less than the depth, %.4g m: grains must be left at the surface", p->depth);
}

static void mark(const void *self, const quern_cell_batch *b) {
	const surface *p = self;
	const quern_real critical = p->critical, *restrict fraction = b->use[FRACTION].real[0];
	quern_real *restrict level = b->level;
	for (uint32_t i = 0; i < b->n; i++) level[i] = fraction[i] - critical;
}

static void decide(const void *self, const quern_cell_batch *b) {
	const surface *p = self;
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real d = b->distance[i] - p->depth;
		b->wish[i] = d < -p->half_width   ? QUERN_DISCRETE
					 : d <= p->half_width ? QUERN_HYBRID
										  : QUERN_CONTINUUM;
	}
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
		   "with the "
		   "outside; a void within does not count.",
	.cite = "Yue et al. 2018, 4.1",
	.instance_size = sizeof(surface),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
