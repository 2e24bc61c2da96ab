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
	QUERN_SURFACE_WALLS = 2, /* walls and bodies count as surface */
	QUERN_SURFACE_VOIDS = 4  /* since 2.1: with FLOOD, outside counts also where it is not connected */
};
/* since 2.1: what an oracle wants in its batches */
enum { QUERN_ORACLE_GAP = 1, QUERN_ORACLE_WEIGHT = 2, QUERN_ORACLE_MARKED = 4 };

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
	/* since 2.1, up to the end */
	quern_real time, dt;   /* s; dt of the continuum's step */
	quern_real gravity[3]; /* m/s^2 */
	/* m from the cell's centre to the nearest of the bodies that this oracle means and that are there now, less than 0
	 * inside, infinite where there is none; moved by up to half the hysteresis while deciding, as distance is. NULL where
	 * the oracle does not want it */
	const quern_real *gap;
	/* deciding: the continuum's share in the cell if it becomes hybrid, from 0 to 1; the least of all oracles wins; -1:
	 * what the solver takes. NULL where the oracle does not want it */
	quern_real *weight;
	/* marking: 1 where this oracle's level was 0 or less at the last update and there has been material since, else 0; only
	 * the first 31 oracles of a list have this memory. NULL where the oracle does not want it */
	const int32_t *marked;
} quern_cell_batch;

typedef struct quern_oracle_ops {
	uint32_t size, pad;
	void (*mark)(const void *self, const quern_cell_batch *);   /* [batch] */
	void (*decide)(const void *self, const quern_cell_batch *); /* [batch] */
	uint32_t (*surface)(const void *self);                      /* [setup] QUERN_SURFACE_*; NULL: 0 */
	/* since 2.1, up to the end */
	uint32_t (*wants)(const void *self); /* [setup] QUERN_ORACLE_*; NULL: 0 */
	/* [setup] whether the oracle means body number b of the scene: `gap` leads to those alone, and of walls these alone
	 * count as surface. NULL: all */
	bool (*means)(const void *self, uint32_t b);
	/* [setup] faces of the domain beyond which is open space, bit 2 axis for the lower and 2 axis + 1 for the upper
	 * one; others count as closed, though no body stands there. NULL: all */
	uint32_t (*faces)(const void *self);
	/* [setup] ways that a surface with open space must look, bits as of `faces`, to count: 8, the upper face along y,
	 * means tops alone. Walls look all ways. NULL: all */
	uint32_t (*looks)(const void *self);
	/* [setup] m: whatever is farther from the surface than this, `decide` answers as it does at an infinite distance; so that
	 * the solver need not measure. NULL: it may ask for any */
	quern_real (*reach)(const void *self);
} quern_oracle_ops;

QUERN_KIND(oracle, quern_oracle_ops, "Where grains are needed.", QUERN_ONE(quern_oracle_ops, mark),
	QUERN_ONE(quern_oracle_ops, decide), QUERN_OPTIONALLY(quern_oracle_ops, surface),
	QUERN_OPTIONALLY(quern_oracle_ops, wants), QUERN_OPTIONALLY(quern_oracle_ops, means),
	QUERN_OPTIONALLY(quern_oracle_ops, faces), QUERN_OPTIONALLY(quern_oracle_ops, looks),
	QUERN_OPTIONALLY(quern_oracle_ops, reach));

#ifdef __cplusplus
}
#endif
