/* SPDX-License-Identifier: MIT */
/* quern/transfer.h - the kind `transfer`: maps what the solver gathered from nodes onto particle velocities; never sees the grid, so
 * that it serves points and grains alike. A point's position is the solver's: x += dt pic.
 *
 * Every pass is a call. What a transfer remembers in fields of its own it changes in the last one alone. */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct quern_transfer_batch {
	uint32_t n, cap, pass, pad; /* pass counts round trips; the last one writes velocity */
	quern_real dt;
	const quern_real *pic[3];    /* m/s, sum S v_i */
	const quern_real *change[3]; /* m/s, sum S (v_i - v_i before forces and coupling) */
	const quern_real *echo[3];   /* m/s, what the last pass sent, gone to the grid and back; NULL in pass 0 */
	quern_real *send[3];         /* m/s, what to send next; NULL in the last pass */
	quern_real *velocity[3];     /* m/s, in: old, out (last pass only): new */
	const quern_column *use;
	/* Since 2.1. The last three are NULL but in the last pass of a transfer whose table says `affine`; row-major.
	 * With B = sum S v_i (x_i - x) and D = sum S (x_i - x)^2, axis by axis: the slope B/D of the linear field around
	 * the point, 1/s; D over what it will be where the point goes in this step, 1 where shape functions have no D
	 * all over; and out, 1/s, the matrix C with which the point sends velocity + C (x_i - x) in the next step. B/D
	 * keeps slopes, and that times `shift` keeps B, the moment. */
	const quern_real *fit[9], *shift[3];
	quern_real *affine[9];
} quern_transfer_batch;

typedef struct quern_transfer_ops {
	uint32_t size;
	uint32_t passes;                                                   /* extra round trips; 0: none */
	void (*gather[2])(const void *self, const quern_transfer_batch *); /* [batch] */
	/* since 2.1: [setup] extra round trips of an instance, in place of `passes`; may be NULL */
	uint32_t (*trips)(const void *self);
	/* since 2.1; 1: is told `fit` and writes `affine`; for points alone, since grains send no matrix */
	uint32_t affine;
	uint32_t pad;
} quern_transfer_ops;

/* Extra round trips. */
static inline uint32_t quern_transfer_trips(const quern_transfer_ops *ops, const void *self) {
	return ops->trips ? ops->trips(self) : ops->passes;
}

QUERN_KIND(transfer, quern_transfer_ops, "New velocities of particles, from what nodes say.",
	QUERN_EACH(quern_transfer_ops, gather), QUERN_OPTIONALLY(quern_transfer_ops, trips));

#ifdef __cplusplus
}
#endif
