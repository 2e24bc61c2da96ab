/* SPDX-License-Identifier: MIT */
/* shape.gimp - uniform generalised interpolation: hats averaged over a particle of half-width l. At walls the nodes
 * outside are folded back, which leaves the hat and keeps completeness. docs/theory/mpm.md, section 2 */
#include "cut_hat.h"
#include <quern/math.h>
#include <quern/shape.h>

typedef struct {
	quern_real half_width;
} gimp;
static const quern_param params[] = { QUERN_PARAM(gimp, half_width, "1",
										  "Half-width of a particle over the cell; default: half the way "
										  "between points at the start, 1/4 for two "
										  "per cell and axis, so that the particles fill space.",
										  .from = "continuum.half_width", .def = 0.25, .min = 0.05,
										  .max = 0.5),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* With f in [l, 1 + l) the way from the lowest node, in cells, and l < 1/2, that node is seen from beyond l. The
 * middle weight follows from the others: they sum to one and their slopes to zero. */
QUERN_INLINE void weights_along(
	const quern_real l, const quern_shape_batch *b, uint32_t a, const bool walls) {
	const quern_real inverse = b->inverse_cell, quarter = 1 / (4 * l);
	const quern_real *restrict x = b->position[a];
	int32_t *restrict first = b->first[a];
	quern_real *restrict w0 = b->value[a][0], *restrict w1 = b->value[a][1], *restrict w2 = b->value[a][2];
	quern_real *restrict g0 = b->slope[a][0], *restrict g1 = b->slope[a][1], *restrict g2 = b->slope[a][2];
	const bool low = b->wall[a][0] != INT32_MIN, high = b->wall[a][1] != INT32_MAX;
	const quern_real lowest = low ? (quern_real)b->wall[a][0] : -0x1p40,
					 highest = high ? (quern_real)b->wall[a][1] : 0x1p40;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real t = x[i] * inverse, base = quern_floor(t - l), f = t - base;
		const quern_real near = 1 + l - f, beyond = f - (1 - l), far = beyond > 0 ? beyond : 0;
		const bool linear = f < 1 - l;
		const quern_real a0 = linear ? 1 - f : near * near * quarter, a2 = far * far * quarter;
		const quern_real d0 = linear ? -1 : -2 * near * quarter, d2 = 2 * far * quarter;
		/* folding at a wall closer than l: S_0 += 2 S_-1, S_1 -= S_-1 gives 1 - t and t */
		const bool at_low = walls & (t < lowest + l), at_high = walls & (t > highest - l),
				   folded = at_low | at_high;
		const quern_real start = at_low ? lowest : at_high ? highest - 1 : base, hat = t - start;
		first[i] = (int32_t)start;
		w0[i] = folded ? 1 - hat : a0;
		w1[i] = folded ? hat : 1 - a0 - a2;
		w2[i] = folded ? 0 : a2;
		g0[i] = (folded ? -1 : d0) * inverse;
		g1[i] = (folded ? 1 : -(d0 + d2)) * inverse;
		g2[i] = (folded ? 0 : d2) * inverse;
	}
}

static void weights(const void *self, const quern_shape_batch *b) {
	const quern_real l = ((const gimp *)self)->half_width;
	for (uint32_t a = 0; a < b->dim; a++)
		if (b->wall[a][0] != INT32_MIN || b->wall[a][1] != INT32_MAX) weights_along(l, b, a, true);
		else weights_along(l, b, a, false);
}

/* The integrals of the folded functions: h/2 + l^2/(6h) on the wall, h - l^2/(6h) next to it. */
static void shares(const void *self, quern_real *wall, quern_real *next) {
	const quern_real l = ((const gimp *)self)->half_width;
	*wall = 0.5 + l * l / 6;
	*next = 1 - l * l / 6;
}

/* Points stand for boxes: where those fill a region the sum over them is the integral of the hat over it. */
static quern_real beyond(const void *self, int32_t to_wall, quern_real from) {
	return to_wall > 1 ? cut_hat_beyond(from)
					   : cut_hat_folded(((const gimp *)self)->half_width, to_wall, from);
}

/* chi h^2 of omega^2 = chi max(d K, 2 G)/rho, for any arrangement of points: docs/theory/mpm.md, section 5 */
static quern_real stiffness(const void *self) {
	const quern_real l = ((const gimp *)self)->half_width;
	return 1 / l + 1 / (l * (1 - l));
}

static const quern_shape_ops ops = {
	.size = sizeof ops, .weights = weights, .shares = shares, .beyond = beyond, .stiffness = stiffness
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 2,
	.dims = QUERN_2D | QUERN_3D,
	.id = "shape.gimp",
	.brief = "Generalised interpolation (uGIMP), folded at walls.",
	.cite = "Bardenhagen & Kober 2004",
	.instance_size = sizeof(gimp),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
