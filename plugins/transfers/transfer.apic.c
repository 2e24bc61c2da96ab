/* SPDX-License-Identifier: MIT */
/* transfer.apic - PIC that carries the linear part of the field around a point, and with it the angular momentum.
 * docs/theory/transfers.md, section 4 */
#include <quern/transfer.h>

typedef struct {
	bool moment;
} apic;
static const quern_param params[] = { QUERN_PARAM(apic, moment, NULL,
										  "Keep the moment of what a point sends while it moves, and so the "
										  "angular momentum; false: keep the slope.",
										  .def = 1, .flags = QUERN_ADVANCED),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* v = sum S v_i, C = B/D' with B = sum S v_i (x_i - x) and D' = sum S (x_i - x)^2 where the point will be. */
QUERN_INLINE void gather(const int dim, const apic *self, const quern_transfer_batch *b) {
	for (int k = 0; k < dim; k++) {
		quern_real *restrict v = b->velocity[k];
		const quern_real *restrict pic = b->pic[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) v[i] = pic[i];
		for (int a = 0; a < dim; a++) {
			quern_real *restrict c = b->affine[dim * k + a];
			const quern_real *restrict fit = b->fit[dim * k + a], *restrict shift = b->shift[a];
			const bool moment = self->moment;
			QUERN_SIMD
			for (uint32_t i = 0; i < b->n; i++) c[i] = moment ? fit[i] * shift[i] : fit[i];
		}
	}
}
static void gather_2d(const void *self, const quern_transfer_batch *b) { gather(2, self, b); }
static void gather_3d(const void *self, const quern_transfer_batch *b) { gather(3, self, b); }

static const quern_transfer_ops ops = { .size = sizeof ops, .gather = { gather_2d, gather_3d }, .affine = 1 };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "transfer.apic",
	.brief = "PIC with the linear field around each point: keeps angular momentum.",
	.doc = "Points send v + C (x_i - x). What neither that nor the grid shows is gone after a step. For "
		   "points; grains send no matrix.",
	.cite = "Jiang et al. 2015; Jiang et al. 2017",
	.instance_size = sizeof(apic),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
