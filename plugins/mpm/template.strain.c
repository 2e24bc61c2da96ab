/* strain.my_name - what changes volume is in part the mean of the cell's points.
 *
 * A strain changes velocity gradients before volume and stress see them. It measures numbers at every point, the solver takes their means
 * over the points of a cell, by volume, and `apply` changes each gradient by them. A strain without `measure` has no means, and
 * looks at single points. */
#include <quern/strain.h>

typedef struct {
	quern_real part;
} blended;
static const quern_param params[] = {
	QUERN_PARAM(blended, part, "1", "Share of the mean.", .def = 0.5, .max = 1), QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

QUERN_INLINE quern_real trace(const int dim, const quern_strain_batch *b, uint32_t i) {
	quern_real sum = 0;
	for (int k = 0; k < dim; k++) sum += b->gradient[(dim + 1) * k][i];
	return sum;
}

QUERN_INLINE void measure(const int dim, const quern_strain_batch *b) {
	for (uint32_t i = 0; i < b->n; i++) b->measured[0][i] = trace(dim, b, i);
}
static void measure_2d(const void *self, const quern_strain_batch *b) {
	(void)self;
	measure(2, b);
}
static void measure_3d(const void *self, const quern_strain_batch *b) {
	(void)self;
	measure(3, b);
}

QUERN_INLINE void apply(const int dim, const blended *self, const quern_strain_batch *b) {
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real more = self->part * (b->mean[0][i] - trace(dim, b, i)) / dim;
		for (int k = 0; k < dim; k++) b->gradient[(dim + 1) * k][i] += more;
	}
}
static void apply_2d(const void *self, const quern_strain_batch *b) { apply(2, self, b); }
static void apply_3d(const void *self, const quern_strain_batch *b) { apply(3, self, b); }

static const quern_strain_ops ops = {
	.size = sizeof ops, .means = 1, .measure = { measure_2d, measure_3d }, .apply = { apply_2d, apply_3d }
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "strain.my_name",
	.brief = "A part of the mean change of volume of the cell's points.",
	.instance_size = sizeof(blended),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
