/* shape.my_name - hats: along each axis a point belongs to the two nodes around it, by its distance from them.
 *
 * Weights along the axes are multiplied by the solver. Of three nodes from `first` on they must sum to one, and their
 * slopes to zero, also next to walls, which lie on node lines and beyond which there is no node. */
#include <quern/math.h>
#include <quern/shape.h>

typedef struct {
	int32_t unused;
} hat;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static void weights(const void *self, const quern_shape_batch *b) {
	const quern_real inverse = b->inverse_cell;
	(void)self;
	for (uint32_t a = 0; a < b->dim; a++) {
		/* a point on a wall, or beyond it by round-off, belongs to the cell inside */
		const quern_real last = b->wall[a][1] == INT32_MAX ? 0x1p40 : (quern_real)(b->wall[a][1] - 1),
						 least = b->wall[a][0] == INT32_MIN ? -0x1p40 : (quern_real)b->wall[a][0];
		const quern_real *restrict x = b->position[a];
		quern_real *const *value = b->value[a], *const *slope = b->slope[a];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) {
			const quern_real t = x[i] * inverse, cell = quern_max(quern_min(quern_floor(t), last), least);
			b->first[a][i] = (int32_t)cell;
			value[0][i] = 1 - (t - cell);
			value[1][i] = t - cell;
			value[2][i] = 0;
			slope[0][i] = -inverse;
			slope[1][i] = inverse;
			slope[2][i] = 0;
		}
	}
}

/* A node on a wall has half a hat. */
static void shares(const void *self, quern_real *wall, quern_real *next) {
	(void)self;
	*wall = 0.5;
	*next = 1;
}

/* chi h^2 of omega^2 = chi max(d K, 2 G)/rho, the highest frequency of the grid: the step in time follows from it. */
static quern_real stiffness(const void *self) {
	(void)self;
	return 16;
}

static const quern_shape_ops ops = {
	.size = sizeof ops, .weights = weights, .shares = shares, .stiffness = stiffness
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "shape.my_name",
	.brief = "Linear hats.",
	.instance_size = sizeof(hat),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
