/* SPDX-License-Identifier: MIT */
/* shape.bspline - the quadratic B-spline: a hat averaged over a whole cell. At walls the nodes outside are folded back, which
 * leaves the hat and keeps completeness. docs/theory/mpm.md, section 2 */
#include "cut_hat.h"
#include <quern/math.h>
#include <quern/shape.h>

typedef struct {
	int32_t unused;
} bspline;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* With f in [1/2, 3/2) the way from the lowest of three nodes, in cells: (3/2 - f)^2/2, the rest, (f - 1/2)^2/2. The
 * middle weight follows from the others: they sum to one and their slopes to zero. */
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
		const bool low = b->wall[a][0] != INT32_MIN, high = b->wall[a][1] != INT32_MAX;
		const quern_real lowest = low ? (quern_real)b->wall[a][0] : -0x1p40,
						 highest = high ? (quern_real)b->wall[a][1] : 0x1p40;
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) {
			const quern_real t = x[i] * inverse, base = quern_floor(t - 0.5), f = t - base;
			const quern_real before = 1.5 - f, behind = f - 0.5;
			const quern_real a0 = 0.5 * before * before, a2 = 0.5 * behind * behind;
			/* folding within half a cell of a wall: S_0 += 2 S_-1, S_1 -= S_-1 gives 1 - t and t */
			const bool at_low = t<lowest + 0.5, at_high = t> highest - 0.5, folded = at_low | at_high;
			const quern_real start = at_low ? lowest : at_high ? highest - 1 : base, hat = t - start;
			first[i] = (int32_t)start;
			w0[i] = folded ? 1 - hat : a0;
			w1[i] = folded ? hat : 1 - a0 - a2;
			w2[i] = folded ? 0 : a2;
			g0[i] = (folded ? -1 : -before) * inverse;
			g1[i] = (folded ? 1 : before - behind) * inverse;
			g2[i] = (folded ? 0 : behind) * inverse;
		}
	}
}

/* The integrals of the folded functions: h/2 + h/24 on the wall, h - h/24 next to it. */
static void shares(const void *self, quern_real *wall, quern_real *next) {
	(void)self;
	*wall = 0.5 + 1.0 / 24;
	*next = 1 - 1.0 / 24;
}

static quern_real beyond(const void *self, int32_t to_wall, quern_real from) {
	(void)self;
	return to_wall > 1 ? cut_hat_averaged(0.5, from) : cut_hat_folded(0.5, to_wall, from);
}

/* chi h^2 of omega^2 = chi max(d K, 2 G)/rho, for any arrangement of points: docs/theory/mpm.md, section 5 */
static quern_real stiffness(const void *self) {
	(void)self;
	return 6;
}

static const quern_shape_ops ops = {
	.size = sizeof ops, .weights = weights, .shares = shares, .beyond = beyond, .stiffness = stiffness
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 2,
	.dims = QUERN_2D | QUERN_3D,
	.id = "shape.bspline",
	.brief = "Quadratic B-splines, folded at walls.",
	.doc =
		"Slopes are continuous everywhere, whatever the number of points in a cell. A point is seen by three nodes per axis "
		"wherever it lies, so that stresses are smoother than with gimp, and surfaces wider by up to a quarter of a cell.",
	.cite = "Steffen, Kirby & Berzins 2008",
	.instance_size = sizeof(bspline),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
