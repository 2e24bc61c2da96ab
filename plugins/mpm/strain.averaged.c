/* SPDX-License-Identifier: MIT */
/* strain.averaged - the points of a cell change volume at one rate, the mean of theirs. docs/theory/mpm.md, section 10 */
#include <quern/strain.h>

typedef struct {
	int32_t unused;
} averaged;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

QUERN_INLINE void trace(const int dim, const quern_strain_batch *b, quern_real *restrict out) {
	const quern_real *restrict xx = b->gradient[0], *restrict yy = b->gradient[dim + 1],
							   *restrict zz = b->gradient[dim * dim - 1];
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) out[i] = dim == 2 ? xx[i] + yy[i] : xx[i] + yy[i] + zz[i];
}

static void measure_2d(const void *self, const quern_strain_batch *b) {
	(void)self;
	trace(2, b, b->measured[0]);
}
static void measure_3d(const void *self, const quern_strain_batch *b) {
	(void)self;
	trace(3, b, b->measured[0]);
}

/* L += (mean tr L - tr L)/d I */
QUERN_INLINE void apply(const int dim, const quern_strain_batch *b) {
	quern_real *restrict xx = b->gradient[0], *restrict yy = b->gradient[dim + 1],
						 *restrict zz = b->gradient[dim * dim - 1];
	const quern_real *restrict mean = b->mean[0];
	const quern_real part = 1.0 / dim;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real own = dim == 2 ? xx[i] + yy[i] : xx[i] + yy[i] + zz[i],
						 more = part * (mean[i] - own);
		xx[i] += more, yy[i] += more;
		if (dim == 3) zz[i] += more;
	}
}
static void apply_2d(const void *self, const quern_strain_batch *b) {
	(void)self;
	apply(2, b);
}
static void apply_3d(const void *self, const quern_strain_batch *b) {
	(void)self;
	apply(3, b);
}

static const quern_strain_ops ops = {
	.size = sizeof ops, .means = 1, .measure = { measure_2d, measure_3d }, .apply = { apply_2d, apply_3d }
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "strain.averaged",
	.brief =
		"The points of a cell change volume at one rate, the mean of theirs, so that flow which keeps volume does not lock.",
	.cite = "Hughes 1980; Coombs et al. 2018",
	.instance_size = sizeof(averaged),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
