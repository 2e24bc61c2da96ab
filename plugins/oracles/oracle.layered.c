/* SPDX-License-Identifier: MIT */
/* oracle.layered - grains below some surfaces, chosen by the scene, and nowhere else. docs/theory/hybrid.md, section 3 */
#include "band.h"
#include "named.h"
#include "open.h"
#include <math.h>

typedef struct {
	quern_real critical, count, toward[3];
	oracle_band band;
	quern_list bodies, faces;
	uint32_t looks;
} layered;

static const quern_param params[] = { OPEN_PARAM(layered),
	BAND_PARAMS(layered, "Depth of the middle of the hybrid zone below the surfaces that count."),
	QUERN_PARAM(layered, toward, NULL,
		"Surfaces that look this way count, by up to 60 degrees off: [0, 1] means those on top. Default, where "
		"neither this nor faces nor bodies are given: against gravity.",
		.flags = QUERN_MAYBE),
	OPEN_FACES(layered, faces,
		"Surfaces that look at these faces of the domain count, and material that lies against one of them has "
		"one there."),
	NAMED_PARAMS(layered, "These bodies count as surface."), QUERN_END_PARAMS };
QUERN_USE_ENUM(OPEN_USES);
static const quern_use uses[] = QUERN_USE_ROWS(OPEN_USES);

/* Faces of cells look along the axes. A slope is made of steps, of which those that look nearest to where it does count. */
static uint32_t ways(const quern_real toward[3], uint32_t dim) {
	quern_real size = 0, sum = 0;
	uint32_t bits = 0;
	for (uint32_t k = 0; k < dim; k++) size = fmax(size, fabs(toward[k]));
	for (uint32_t k = 0; k < dim && size > 0; k++) sum += toward[k] / size * (toward[k] / size);
	for (uint32_t k = 0; k < dim && size > 0; k++) {
		const quern_real cosine = toward[k] / size / sqrt(sum);
		if (fabs(cosine) > 0.5 - 1e-9) bits |= 1u << (2 * k + (cosine > 0));
	}
	return bits;
}

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	layered *p = self;
	const bool given = !isnan(p->toward[0]), nothing = !given && !p->faces.n && !p->bodies.n;
	const quern_real up[3] = { -setup->gravity[0], -setup->gravity[1], -setup->gravity[2] };
	const uint32_t toward = given ? ways(p->toward, setup->dim) : nothing ? ways(up, setup->dim) : 0;
	if ((given || nothing) && !toward)
		return setup->host->fail(err, QUERN_E_PARAM, given ? "toward" : NULL,
			given ? "has no length: give a direction"
				  : "say which surfaces count, since no gravity does: toward a direction, faces or bodies");
	p->looks = toward | open_bits(&p->faces);
	quern_status status = open_check(&p->faces, "faces", setup, err);
	if (status == QUERN_OK) status = named_check(&p->bodies, p->count, setup, err);
	return status == QUERN_OK ? band_check(&p->band, setup, err, "at the surface") : status;
}

static void mark(const void *self, const quern_cell_batch *b) {
	open_mark(((const layered *)self)->critical, b->use[FRACTION].real[0], b);
}

static void decide(const void *self, const quern_cell_batch *b) {
	band_decide(&((const layered *)self)->band, b);
}

static uint32_t flags(const void *self) {
	return QUERN_SURFACE_FLOOD | (((const layered *)self)->bodies.n ? QUERN_SURFACE_WALLS : 0);
}

static bool means(const void *self, uint32_t b) { return named_means(&((const layered *)self)->bodies, b); }

static uint32_t looks(const void *self) { return ((const layered *)self)->looks; }

static quern_real reach(const void *self) { return band_reach(&((const layered *)self)->band); }

static const quern_oracle_ops ops = { .size = sizeof ops,
	.mark = mark,
	.decide = decide,
	.surface = flags,
	.means = means,
	.looks = looks,
	.reach = reach };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "oracle.layered",
	.brief = "Grains within a depth of the surfaces that the scene chooses.",
	.doc =
		"Surfaces count by the way they look, by the face of the domain that they look at, or because they are "
		"of a body that is named; at all others, walls and floors among them, the continuum goes up to the "
		"surface.",
	.cite = "Yue et al. 2018, 4.1",
	.instance_size = sizeof(layered),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
