/* SPDX-License-Identifier: MIT */
/* shape.linear - hats: two nodes per axis. Their slopes jump at cell faces; for comparison. docs/theory/mpm.md */
#include <quern/math.h>
#include <quern/shape.h>

typedef struct {
	int32_t unused;
} linear;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static void weights(const void *self, const quern_shape_batch *b) {
	const quern_real inverse = b->inverse_cell;
	(void)self;
	for (uint32_t a = 0; a < b->dim; a++) {
		const quern_real *restrict x = b->position[a];
		int32_t *restrict first = b->first[a];
		quern_real *restrict w0 = b->value[a][0], *restrict w1 = b->value[a][1],
							 *restrict w2 = b->value[a][2];
		quern_real *restrict g0 = b->slope[a][0], *restrict g1 = b->slope[a][1],
							 *restrict g2 = b->slope[a][2];
		/* a point on a wall, or beyond it by round-off, belongs to the cell inside */
		const quern_real last = b->wall[a][1] == INT32_MAX ? 0x1p40 : (quern_real)(b->wall[a][1] - 1),
						 least = b->wall[a][0] == INT32_MIN ? -0x1p40 : (quern_real)b->wall[a][0];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) {
			const quern_real t = x[i] * inverse, cell = quern_floor(t), held = cell > last ? last : cell,
							 base = held < least ? least : held;
			first[i] = (int32_t)base;
			w1[i] = t - base;
			w0[i] = 1 - (t - base);
			w2[i] = 0;
			g0[i] = -inverse;
			g1[i] = inverse;
			g2[i] = 0;
		}
	}
}

static void shares(const void *self, quern_real *wall, quern_real *next) {
	(void)self;
	*wall = 0.5;
	*next = 1;
}

/* No bound holds for every arrangement of points, since a node of little mass may feel a full force. This one, a
 * Courant number of 0.5, is what two points per cell and axis bear in practice. */
static quern_real stiffness(const void *self) {
	(void)self;
	return 16;
}

static const quern_shape_ops ops = {
	.size = sizeof ops, .weights = weights, .shares = shares, .stiffness = stiffness, .light = 0.0625
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 3,
	.dims = QUERN_2D | QUERN_3D,
	.id = "shape.linear",
	.brief = "Linear hats.",
	.doc = "Forces jump when a point crosses a cell face. For comparison; take gimp for work.",
	.instance_size = sizeof(linear),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
