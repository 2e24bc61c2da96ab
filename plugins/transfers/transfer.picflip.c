/* SPDX-License-Identifier: MIT */
/* transfer.picflip - keeps what lies below the grid (FLIP) and lets it decay at a rate (PIC).
 * docs/theory/transfers.md */
#include <quern/math.h>
#include <quern/transfer.h>

typedef struct {
	quern_real rate;
	quern_real flip; /* NaN unless the scene gives a share per step */
} picflip;
static const quern_param params[] = {
	QUERN_PARAM(picflip, rate, "1/s",
		"Rate at which motion below the grid decays: 0 is FLIP, 1e300 is PIC. Default: "
		"sqrt(g/L), L the height of the fill.",
		.from = "fill.rate", .max = 1e300),
	QUERN_PARAM(picflip, flip, "1",
		"In place of the rate: the share of FLIP in every step, whatever its length.",
		.flags = QUERN_MAYBE | QUERN_ADVANCED, .min = 0, .max = 1),
	QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

/* v = f (v + sum S dv) + (1 - f) sum S v_i with f = exp(-rate dt), so that the blend does not depend on the step. */
QUERN_INLINE void gather(const int dim, const picflip *self, const quern_transfer_batch *b) {
	const quern_real keep = self->flip == self->flip ? self->flip : quern_exp(-self->rate * b->dt);
	for (int k = 0; k < dim; k++) {
		quern_real *restrict v = b->velocity[k];
		const quern_real *restrict pic = b->pic[k], *restrict change = b->change[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) v[i] = keep * (v[i] + change[i]) + (1 - keep) * pic[i];
	}
}
static void gather_2d(const void *self, const quern_transfer_batch *b) { gather(2, self, b); }
static void gather_3d(const void *self, const quern_transfer_batch *b) { gather(3, self, b); }

static const quern_transfer_ops ops = { .size = sizeof ops, .gather = { gather_2d, gather_3d } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "transfer.picflip",
	.brief = "FLIP with a PIC share given as a rate.",
	.cite = "Brackbill & Ruppel 1986; Zhu & Bridson 2005",
	.instance_size = sizeof(picflip),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
