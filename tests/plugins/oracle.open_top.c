/* SPDX-License-Identifier: MIT */
/* oracle.open_top - grains near the upper face of the domain and near the bodies that are meant, whatever else there is; says
 * what it was told. For tests. */
#include <quern/oracle.h>

typedef struct {
	quern_real depth, share;
	int32_t body;
	bool all_faces;
} open_top;
static const quern_param params[] = { QUERN_PARAM(open_top, depth, "m", "Of grains.", .def = 8e-3, .max = 1),
	QUERN_PARAM(
		open_top, share, "1", "Of the continuum in hybrid cells, three cells deep.", .def = 0.5, .max = 1),
	QUERN_PARAM(open_top, body, "1", "Which is meant.", .def = 1e6, .max = 1e6),
	QUERN_PARAM(open_top, all_faces, NULL, "All faces of the domain are open."), QUERN_END_PARAMS };
enum { FRACTION, TOLD };
static const quern_use uses[] = { { .field = "cell.packing_fraction",
									  .unit = "1",
									  .doc = "Of grains; 1 where the continuum fills the cell.",
									  .access = QUERN_READ,
									  .shape = QUERN_SCALAR },
	{ .field = "cell.told",
		.unit = "1",
		.doc = "Time, step, gravity along y, and gap to the body that is meant.",
		.access = QUERN_UPDATE,
		.shape = QUERN_TENSOR },
	QUERN_END_USES };

static void mark(const void *self, const quern_cell_batch *b) {
	quern_real *const *told = b->use[TOLD].real;
	(void)self;
	for (uint32_t i = 0; i < b->n; i++) {
		b->level[i] = b->use[FRACTION].real[0][i] - 0.4;
		told[0][i] = b->time, told[1][i] = b->dt, told[2][i] = b->gravity[1], told[3][i] = b->gap[i];
	}
}
static void decide(const void *self, const quern_cell_batch *b) {
	const open_top *p = self;
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real way = b->distance[i] - p->depth;
		b->wish[i] = way <= 0 ? QUERN_DISCRETE : way <= 3 * b->cell ? QUERN_HYBRID : QUERN_CONTINUUM;
		b->weight[i] = b->wish[i] == QUERN_HYBRID ? p->share : -1;
	}
}
static uint32_t surface(const void *self) { return (void)self, QUERN_SURFACE_FLOOD | QUERN_SURFACE_WALLS; }
static uint32_t wants(const void *self) { return (void)self, QUERN_ORACLE_GAP | QUERN_ORACLE_WEIGHT; }
static bool means(const void *self, uint32_t b) { return (int32_t)b == ((const open_top *)self)->body; }
static uint32_t faces(const void *self) { return ((const open_top *)self)->all_faces ? 63 : 8; }

static const quern_oracle_ops ops = { .size = sizeof ops,
	.mark = mark,
	.decide = decide,
	.surface = surface,
	.wants = wants,
	.means = means,
	.faces = faces };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D,
	.id = "oracle.open_top",
	.brief = "Grains near the upper face, for tests.",
	.instance_size = sizeof(open_top),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
