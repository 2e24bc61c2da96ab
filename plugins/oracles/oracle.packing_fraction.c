/* SPDX-License-Identifier: MIT */
/* oracle.packing_fraction - grains near the free surface, continuum deep inside. docs/theory/hybrid.md, section 3 */
#include "band.h"
#include "named.h"

typedef struct {
	int32_t face;
} closed_face;
typedef struct {
	quern_real critical, count;
	oracle_band band;
	quern_list bodies, closed;
	bool walls, voids;
} surface;

static const char *const faces[] = { "lower_x", "upper_x", "lower_y", "upper_y", "lower_z", "upper_z", NULL };
static const quern_param closed_rows[] = { QUERN_PARAM(closed_face, face, "1", "One of them.",
											   .choices = faces, .flags = QUERN_REQUIRED),
	QUERN_END_PARAMS };
static const quern_param params[] = {
	QUERN_PARAM(surface, critical, "1", "Packing fraction of grains below which a cell is empty.", .def = 0.4,
		.min = 0, .max = 1, .flags = QUERN_MIN_OPEN | QUERN_MAX_OPEN),
	BAND_PARAMS(surface, "Depth of the middle of the hybrid zone below the surface."),
	QUERN_PARAM(surface, walls, NULL, "Walls and floors count as surface too, so that grains meet them."),
	NAMED_PARAMS(surface, "These bodies alone count as surface too, as all do with walls."),
	QUERN_PARAM(surface, closed, NULL,
		"Faces of the domain that count as closed: material that lies against them has no surface there.",
		.rows = closed_rows, .item_size = sizeof(closed_face), .max = 6),
	QUERN_PARAM(surface, voids, NULL,
		"Voids count as surface, connected with the outside or not: for a closed vessel."),
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
	const surface *p = self;
	const closed_face *c = p->closed.items;
	for (uint32_t i = 0; i < p->closed.n; i++) {
		const uint32_t axis = (uint32_t)c[i].face / 2;
		if (axis >= setup->dim)
			return setup->host->fail(
				err, QUERN_E_PARAM, "closed", "%s is no face of a domain in 2-D", faces[c[i].face]);
		if (setup->periodic[axis])
			return setup->host->fail(
				err, QUERN_E_PARAM, "closed", "%s is periodic, nothing lies against it", faces[c[i].face]);
	}
	if (p->walls && p->bodies.n)
		return setup->host->fail(
			err, QUERN_E_PARAM, "bodies", "does not go with walls, which means all of them: leave one out");
	const quern_status status = named_check(&p->bodies, p->count, setup, err);
	return status == QUERN_OK ? band_check(&p->band, setup, err, "at the surface") : status;
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
	const surface *p = self;
	return QUERN_SURFACE_FLOOD | (p->walls || p->bodies.n ? QUERN_SURFACE_WALLS : 0) |
		   (p->voids ? QUERN_SURFACE_VOIDS : 0);
}

static bool means(const void *self, uint32_t b) { return named_means(&((const surface *)self)->bodies, b); }

static uint32_t open_faces(const void *self) {
	const surface *p = self;
	const closed_face *c = p->closed.items;
	uint32_t open = ~0u;
	for (uint32_t i = 0; i < p->closed.n; i++) open &= ~(1u << c[i].face);
	return open;
}

static const quern_oracle_ops ops = {
	.size = sizeof ops, .mark = mark, .decide = decide, .surface = flags, .means = means, .faces = open_faces
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "oracle.packing_fraction",
	.brief = "Grains within a depth of the free surface.",
	.doc = "The surface is where the packing fraction falls below a critical one and open space is connected "
		   "with the outside; a void within does not count, unless the scene says so.",
	.cite = "Yue et al. 2018, 4.1",
	.instance_size = sizeof(surface),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
