/* SPDX-License-Identifier: MIT */
/* transfer.xpic - PIC of a higher order: takes what the grid does not show, and leaves the more of what it shows the higher
 * the order is. docs/theory/transfers.md, section 5 */
#include <quern/transfer.h>

enum { MOST = 10 }; /* round-off grows with the binomials */

typedef struct {
	int32_t order;
	quern_real factor[MOST]; /* by power of A: of (1 - A)^(order - 1) */
} xpic;
static const quern_param params[] = {
	QUERN_PARAM(xpic, order, "1",
		"1: PIC. Each order more costs a round trip to the grid and damps slow waves less.", .def = 2,
		.min = 1, .max = MOST),
	QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	xpic *p = self;
	(void)setup, (void)err;
	p->factor[0] = 1;
	for (int j = 1; j < p->order; j++) p->factor[j] = p->factor[j - 1] * (j - p->order) / j;
	return QUERN_OK;
}

/* With A what a round trip does, e = v - A v what the grid does not show of a velocity, and m the order:
 * v + change - (1 - A)^m v = pic - ((1 - A)^(m - 1) - 1) e. The polynomial goes by Horner's rule, since of former trips
 * nobody remembers more than the last echo; A v is pic - change. */
QUERN_INLINE void gather(const int dim, const xpic *self, const quern_transfer_batch *b) {
	for (int k = 0; k < dim; k++) {
		quern_real *restrict v = b->velocity[k], *restrict send = b->send[k];
		const quern_real *restrict pic = b->pic[k], *restrict change = b->change[k],
								   *restrict echo = b->echo[k];
		const quern_real factor = send ? self->factor[(uint32_t)self->order - 1 - b->pass] : 0;
		if (send && echo) {
			QUERN_SIMD
			for (uint32_t i = 0; i < b->n; i++) send[i] = factor * (v[i] + change[i] - pic[i]) + echo[i];
		} else if (send) {
			QUERN_SIMD
			for (uint32_t i = 0; i < b->n; i++) send[i] = factor * (v[i] + change[i] - pic[i]);
		} else if (echo) {
			QUERN_SIMD
			for (uint32_t i = 0; i < b->n; i++) v[i] = pic[i] - echo[i];
		} else {
			QUERN_SIMD
			for (uint32_t i = 0; i < b->n; i++) v[i] = pic[i];
		}
	}
}
static void gather_2d(const void *self, const quern_transfer_batch *b) { gather(2, self, b); }
static void gather_3d(const void *self, const quern_transfer_batch *b) { gather(3, self, b); }

static uint32_t trips(const void *self) { return (uint32_t)((const xpic *)self)->order - 1; }

static const quern_transfer_ops ops = {
	.size = sizeof ops, .gather = { gather_2d, gather_3d }, .trips = trips
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "transfer.xpic",
	.brief = "PIC of a higher order.",
	.doc = "Noise that the grid does not show is gone after a step, as with PIC; waves that it resolves are "
		   "damped less the higher the order is.",
	.cite = "Hammerquist & Nairn 2017; Nairn & Hammerquist 2021",
	.instance_size = sizeof(xpic),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
