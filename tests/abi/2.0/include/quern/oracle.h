/* SPDX-License-Identifier: MIT */
/* quern/oracle.h - the kind `oracle`: local marks; the solver then builds the distance inwards from the marked surface; then local
 * decisions */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { QUERN_DISCRETE, QUERN_HYBRID, QUERN_CONTINUUM };
enum {
	QUERN_SURFACE_FLOOD = 1, /* outside counts only where it is connected with an open boundary */
	QUERN_SURFACE_WALLS = 2  /* walls and bodies count as surface */
};

typedef struct quern_cell_batch {
	uint32_t n, cap, dim, pad;
	quern_real cell;             /* m */
	const quern_real *centre[3]; /* m */
	const quern_real
		*distance;       /* m inwards from this oracle's surface, to the cell's centre; NULL while marking */
	const int32_t *zone; /* old */
	const quern_column *use; /* cell.* of this batch */
	quern_real *level;       /* marking: > 0 inside, <= 0 outside; its zero contour is the surface */
	int32_t *wish;           /* deciding: zone; the least continuous of all oracles wins */
} quern_cell_batch;

typedef struct quern_oracle_ops {
	uint32_t size, pad;
	void (*mark)(const void *self, const quern_cell_batch *);   /* [batch] */
	void (*decide)(const void *self, const quern_cell_batch *); /* [batch] */
	uint32_t (*surface)(const void *self);                      /* [setup] QUERN_SURFACE_*; NULL: 0 */
} quern_oracle_ops;

QUERN_KIND(oracle, quern_oracle_ops, "Where grains are needed.", QUERN_ONE(quern_oracle_ops, mark),
	QUERN_ONE(quern_oracle_ops, decide), QUERN_OPTIONALLY(quern_oracle_ops, surface));

#ifdef __cplusplus
}
#endif
