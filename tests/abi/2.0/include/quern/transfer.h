/* SPDX-License-Identifier: MIT */
/* quern/transfer.h - the kind `transfer`: maps what the solver gathered from nodes onto particle velocities; never sees the grid, so
 * that it serves points and grains alike. A point's position is the solver's: x += dt pic. */
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
} quern_transfer_batch;

typedef struct quern_transfer_ops {
	uint32_t size;
	uint32_t passes;                                                   /* extra round trips; 0: none */
	void (*gather[2])(const void *self, const quern_transfer_batch *); /* [batch] */
} quern_transfer_ops;

QUERN_KIND(transfer, quern_transfer_ops, "New velocities of particles, from what nodes say.",
	QUERN_EACH(quern_transfer_ops, gather));

#ifdef __cplusplus
}
#endif
