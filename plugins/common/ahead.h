/* SPDX-License-Identifier: MIT */
/* ahead - asks memory for the next chunk of a large set while this one is worked on: each of its columns begins on a page of its own in every
 * block, where no processor foresees what is wanted next */
#pragma once
#include <quern/columns.h>
#include <quern/solver.h>

/* A set of less than so many bytes stays in caches, which need not be asked. */
enum { AHEAD_MOST = 64, AHEAD_BYTES = 8 << 20 };

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

/* Those from `begin` on, `most` of them and none beyond `end`. */
QUERN_INLINE void ahead_ask(const ahead *a, uint32_t begin, uint32_t end, uint32_t most) {
	enum { LINE = 64 / sizeof(quern_real) };
	const uint32_t n = begin >= end ? 0 : end - begin < most ? end - begin : most;
	for (uint32_t c = 0; c < a->n; c++)
		for (uint32_t i = 0; i < n; i += LINE) __builtin_prefetch(a->column[c] + begin + i);
}
