/* SPDX-License-Identifier: MIT */
/* ahead - asks memory for the next chunk of a large set while this one is worked on: each of its columns begins on a page of its own in every
 * block, where no processor foresees what is wanted next */
#pragma once
#include "stencil.h"
#include <quern/columns.h>

/* A set of less than so many bytes stays in caches, which need not be asked. */
enum {
	AHEAD_MOST = 64,
	AHEAD_BYTES = 4 << 20,
	AHEAD_LINE = 64 / sizeof(quern_real),
	AHEAD_LINES = STENCIL / AHEAD_LINE
};

typedef struct ahead {
	const quern_real *column[AHEAD_MOST];
	uint32_t n;
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
	if ((size_t)n * a->n * sizeof(quern_real) < AHEAD_BYTES) a->n = 0;
}

/* What follows a chunk: the entries from `begin` on, of `n` in the set, and nodes of the next block. */
typedef struct ahead_at {
	uint32_t begin, n, next, rows; /* rows: nodes that have been asked for with the chunks before */
} ahead_at;

/* Behind those n of block b that begin at entry i; `first`: of each block. */
QUERN_INLINE ahead_at ahead_from(
	const quern_grid_view *g, const uint32_t *first, uint32_t b, uint32_t next, uint32_t i, uint32_t n) {
	const uint32_t after = i + n < first[b + 1] ? i + n : first[next];
	return QUERN_VALUE(ahead_at, after, first[g->n_blocks], next, i - first[b]);
}

/* With the particle `part` of a chunk: its part of the lines of the next one and, in 3-D, one node of the next block's tile. In a plane all nodes are few enough to
 * be near anyway. A processor waits once it has asked for some tens of lines that have not come yet, so they are asked for in turn with other work. */
QUERN_INLINE void ahead_ask(const ahead *a, const quern_grid_view *g, const quern_row *rows,
	const ahead_at *at, uint32_t part, const int dim) {
	const uint32_t i = at->begin + part % AHEAD_LINES * AHEAD_LINE, row = at->rows + part;
	for (uint32_t c = part / AHEAD_LINES; c < a->n && i < at->n; c += AHEAD_LINES)
		__builtin_prefetch(a->column[c] + i);
	if (dim == 2 || !a->n || row >= g->tile_size) return;
	const int32_t entry = g->tile[(size_t)at->next * g->tile_size + row];
	__builtin_prefetch(rows + (entry < 0 ? 0 : entry));
}
