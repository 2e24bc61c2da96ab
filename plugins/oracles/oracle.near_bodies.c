/* SPDX-License-Identifier: MIT */
/* oracle.near_bodies - a body always meets grains. docs/theory/hybrid.md, section 3 */
#include "named.h"

typedef struct {
	quern_real distance, width, cell, count;
	quern_list bodies;
} near_bodies;

static const quern_param params[] = {
	QUERN_PARAM(near_bodies, distance, "m",
		"From a body to the centre of a cell: up to here there are grains alone.",
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(near_bodies, width, "m", "Of the hybrid zone behind; a cell at least.",
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(near_bodies, cell, "m", "Cell of the grid.", .from = "grid.cell",
		.flags = QUERN_MAYBE | QUERN_ADVANCED),
	NAMED_PARAMS(near_bodies, "Which bodies; none: all of them."), QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	const near_bodies *p = self;
	if (p->width < (1 - 1e-9) * p->cell)
		return setup->host->fail(err, QUERN_E_PARAM, "width",
			"must be a cell at least, %.4g m: a narrower zone is none in places", p->cell);
	return named_check(&p->bodies, p->count, setup, err);
}

static void mark(const void *self, const quern_cell_batch *b) {
	(void)self;
	for (uint32_t i = 0; i < b->n; i++) b->level[i] = 1; /* the gap is known without a surface */
}

static void decide(const void *self, const quern_cell_batch *b) {
	const near_bodies *p = self;
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real way = b->gap[i] - p->distance;
		b->wish[i] = way <= 0 ? QUERN_DISCRETE : way <= p->width ? QUERN_HYBRID : QUERN_CONTINUUM;
	}
}

static uint32_t wants(const void *self) {
	(void)self;
	return QUERN_ORACLE_GAP;
}

static bool means(const void *self, uint32_t b) {
	return named_means(&((const near_bodies *)self)->bodies, b);
}

static const quern_oracle_ops ops = {
	.size = sizeof ops, .mark = mark, .decide = decide, .wants = wants, .means = means
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "oracle.near_bodies",
	.brief = "Grains near bodies.",
	.doc = "Cells within a distance of a body are made of grains, then a hybrid zone follows; where no body "
		   "is near, others in the list of oracles have their say.",
	.cite = "Yue et al. 2018, 8 (as future work)",
	.instance_size = sizeof(near_bodies),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
