/* oracle.my_name - grains above a height, continuum below it, and a zone of both in between.
 *
 * An oracle is asked twice. `mark` says which cells are inside, level > 0; from their surface the solver measures the
 * distance inwards. `decide` then wishes a zone for each cell. Where several oracles speak, the least continuous wish
 * wins; what it takes to change slowly is the solver's. */
#include <quern/oracle.h>

typedef struct {
	quern_real height, depth;
} layer;

static const quern_param params[] = { QUERN_PARAM(layer, height, "m",
										  "Above it, along the last axis, everything is grains.",
										  .flags = QUERN_REQUIRED, .min = -1e6, .max = 1e6),
	QUERN_PARAM(layer, depth, "m", "Of the hybrid zone below that height; two cells at least.",
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_END_PARAMS };

/* An oracle that looks at the state names it here: "cell.packing_fraction", "cell.shear_rate". */
static const quern_use uses[] = { QUERN_END_USES };

static void mark(const void *self, const quern_cell_batch *b) {
	const quern_real height = ((const layer *)self)->height, *up = b->centre[b->dim - 1];
	for (uint32_t i = 0; i < b->n; i++) b->level[i] = height - up[i];
}

static void decide(const void *self, const quern_cell_batch *b) {
	const layer *p = self;
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real d = b->distance[i];
		b->wish[i] = d <= 0 ? QUERN_DISCRETE : d <= p->depth ? QUERN_HYBRID : QUERN_CONTINUUM;
	}
}

/* Below, all wishes are the same: distances need not be known. */
static quern_real reach(const void *self) { return ((const layer *)self)->depth; }

static const quern_oracle_ops ops = { .size = sizeof ops, .mark = mark, .decide = decide, .reach = reach };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "oracle.my_name",
	.brief = "Grains above a height.",
	.instance_size = sizeof(layer),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
