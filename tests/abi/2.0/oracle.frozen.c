/* SPDX-License-Identifier: MIT */
/* oracle.frozen - grains within a depth of a height along the last axis, and above it */
#include <quern/oracle.h>

typedef struct {
	quern_real height, depth;
} frozen;

static const quern_param params[] = { QUERN_PARAM(
										  frozen, height, "m", "Of the surface.", .min = -1e6, .max = 1e6),
	QUERN_PARAM(frozen, depth, "m", "Of the zone.", .def = 0.01, .max = 1e6), QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static void mark(const void *self, const quern_cell_batch *b) {
	for (uint32_t i = 0; i < b->n; i++)
		b->level[i] = ((const frozen *)self)->height - b->centre[b->dim - 1][i];
}

static void decide(const void *self, const quern_cell_batch *b) {
	const quern_real depth = ((const frozen *)self)->depth;
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real d = b->distance[i];
		b->wish[i] = d <= depth ? QUERN_DISCRETE : d <= depth + 2 * b->cell ? QUERN_HYBRID : QUERN_CONTINUUM;
	}
}

static const quern_oracle_ops ops = { .size = sizeof ops, .mark = mark, .decide = decide };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "oracle.frozen",
	.brief = "A layer of grains.",
	.instance_size = sizeof(frozen),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "2.0", "MIT");
