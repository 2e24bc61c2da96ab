/* SPDX-License-Identifier: MIT */
/* ahead - asks memory for the next chunk of a large set while this one is worked on, and for the next block's nodes: each of a set's columns begins on a page
 * of its own in every block. Who has much to do with a point in turn is served by what processors foresee: gather in 2-D asks for nodes alone. */
#pragma once
#include "stencil.h"
#include <quern/columns.h>

/* A set of less than so many bytes stays in caches, which need not be asked. */
enum { AHEAD_MOST = 64, AHEAD_BYTES = 4 << 20, AHEAD_LINE = 64 / sizeof(quern_real) };

typedef struct ahead {
	const quern_real *column[AHEAD_MOST];
	uint32_t n;
	bool asks; /* for these, and for nodes */
} ahead;

/* The parts of a use in real numbers that are there, once each. Parts beyond the most are not asked for, and are read all the same. */
static inline void ahead_add(ahead *a, const quern_column *use) {
	for (uint32_t k = 0; k < 9 && a->n < AHEAD_MOST; k++) {
		bool known = !use->real[k];
		for (uint32_t c = 0; c < a->n; c++) known = known || a->column[c] == use->real[k];
		if (!known) a->column[a->n++] = use->real[k];
	}
}

/* When all columns of a set of n entries are there. */
static inline void ahead_end(ahead *a, uint32_t n) {
	a->asks = (size_t)n * a->n * sizeof(quern_real) >= AHEAD_BYTES;
	if (!a->asks) a->n = 0;
}

/* What is still to be asked for beside a chunk: of what follows it, and of the next block's nodes. */
typedef struct ahead_at {
	uint32_t column, entry, end; /* whose turn it is, of which entry; the first that is not asked for */
	uint32_t each;               /* lines that are asked for at a time */
	const int32_t *node, *last;  /* in the next block's tile */
} ahead_at;

/* Beside those n of block b that begin at entry i; `first`: of each block. A block's later chunks go on among the nodes where those before have ended. */
QUERN_INLINE ahead_at ahead_from(const ahead *a, const quern_grid_view *g, const uint32_t *first, uint32_t b,
	uint32_t next, uint32_t i, uint32_t n) {
	const uint32_t after = i + n < first[b + 1] ? i + n : first[next], all = first[g->n_blocks],
				   size = g->tile_size, asked = i - first[b] < size ? i - first[b] : size;
	const int32_t *tile = g->tile + (size_t)next * size;
	return QUERN_VALUE(ahead_at, 0, after, after + STENCIL < all ? after + STENCIL : all,
		(a->n + AHEAD_LINE - 1) / AHEAD_LINE, tile + asked, tile + (a->asks ? size : asked));
}

/* With each of STENCIL particles: its part of the lines of what follows, and one node. A processor waits once it has asked for some tens of
 * lines that have not come yet, so they are asked for in turn with other work. */
QUERN_INLINE void ahead_ask(const ahead *a, const quern_row *rows, ahead_at *at) {
	for (uint32_t k = 0; k < at->each && at->entry < at->end; k++) {
		__builtin_prefetch(a->column[at->column] + at->entry);
		if (++at->column == a->n) at->column = 0, at->entry += AHEAD_LINE;
	}
	if (at->node == at->last) return;
	const int32_t entry = *at->node++;
	__builtin_prefetch(rows + (entry < 0 ? 0 : entry));
}
