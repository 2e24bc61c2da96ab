/* SPDX-License-Identifier: MIT */
/* oracle.packing_fraction - grains near the free surface, continuum deep inside. docs/theory/hybrid.md, section 3 */
#include "band.h"
#include "named.h"
#include "open.h"

typedef struct {
	quern_real critical, count;
	oracle_band band;
	quern_list bodies, closed;
	bool walls, voids;
} surface;

static const quern_param params[] = { OPEN_PARAM(surface),
	BAND_PARAMS(surface, "Depth of the middle of the hybrid zone below the surface."),
	QUERN_PARAM(surface, walls, NULL, "Walls and floors count as surface too, so that grains meet them."),
	NAMED_PARAMS(surface, "These bodies alone count as surface too, as all do with walls."),
	OPEN_FACES(surface, closed,
		"Faces of the domain that count as closed: material that lies against them has no surface there."),
	QUERN_PARAM(surface, voids, NULL,
		"Voids count as surface, connected with the outside or not: for a closed vessel."),
	QUERN_END_PARAMS };
QUERN_USE_ENUM(OPEN_USES);
static const quern_use uses[] = QUERN_USE_ROWS(OPEN_USES);

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	const surface *p = self;
	if (p->walls && p->bodies.n)
		return setup->host->fail(
			err, QUERN_E_PARAM, "bodies", "does not go with walls, which means all of them: leave one out");
	quern_status status = open_check(&p->closed, "closed", setup, err);
	if (status == QUERN_OK) status = named_check(&p->bodies, p->count, setup, err);
	return status == QUERN_OK ? band_check(&p->band, setup, err, "at the surface") : status;
}

static void mark(const void *self, const quern_cell_batch *b) {
	const surface *p = self;
	open_mark(p->critical, b->use[FRACTION].real[0], b);
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

static uint32_t open_faces(const void *self) { return ~open_bits(&((const surface *)self)->closed); }

static quern_real reach(const void *self) { return band_reach(&((const surface *)self)->band); }

static const quern_oracle_ops ops = { .size = sizeof ops,
	.mark = mark,
	.decide = decide,
	.surface = flags,
	.means = means,
	.faces = open_faces,
	.reach = reach };
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
