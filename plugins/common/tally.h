/* SPDX-License-Identifier: MIT */
/* tally - several sums over the entries of a set in one pass over its blocks, by all threads; the same for any number of them */
#pragma once
#include <quern/solver.h>

enum { TALLY_SUMS = 8, TALLY_LEAF = 256 };

/* Adds what n entries from `begin` on have, TALLY_LEAF at most, to each of the sums. */
typedef void tally_leaf(const void *what, uint32_t begin, uint32_t n, quern_real out[TALLY_SUMS]);

typedef struct tally {
	tally_leaf *leaf;
	const void *what;
	const quern_parts *parts;
	uint32_t n_blocks, n_sums;
	quern_real *by_block[TALLY_SUMS]; /* in the order of places */
} tally;

/* In halves, as the host's sums: the round-off of many entries stays small. */
static inline void tally_entries(const tally *t, uint32_t begin, uint32_t n, quern_real out[TALLY_SUMS]) {
	quern_real upper[TALLY_SUMS] = { 0 };
	uint32_t half = TALLY_LEAF;
	if (n <= TALLY_LEAF) {
		t->leaf(t->what, begin, n, out);
		return;
	}
	while (half * 2 < n) half *= 2;
	tally_entries(t, begin, half, out);
	tally_entries(t, begin + half, n - half, upper);
	for (uint32_t k = 0; k < t->n_sums; k++) out[k] += upper[k];
}

static inline void tally_block(void *arg, uint32_t q, uint32_t worker) {
	const tally *t = arg;
	const uint32_t b = quern_nth(t->parts->by_place, q), *block = t->parts->block;
	quern_real out[TALLY_SUMS] = { 0 };
	(void)worker;
	tally_entries(t, block ? block[b] : 0, block ? block[b + 1] - block[b] : t->parts->owned, out);
	for (uint32_t k = 0; k < t->n_sums; k++) t->by_block[k][q] = out[k];
}

/* Adds the sums over a set to `out`. False if memory is gone. */
static inline bool tally_set(const quern_step *s, const char *set, tally_leaf *leaf, const void *what,
	uint32_t n_sums, quern_real *out) {
	tally t = { .leaf = leaf, .what = what, .parts = s->host->parts(s->run, set), .n_sums = n_sums };
	t.n_blocks = t.parts->block ? t.parts->n_blocks : 1;
	for (uint32_t k = 0; k < n_sums; k++) {
		t.by_block[k] = s->host->memory(s->run, ((size_t)t.n_blocks + 1) * sizeof(quern_real));
		if (!t.by_block[k]) return false;
	}
	s->host->parallel(s->run, t.n_blocks, tally_block, &t);
	for (uint32_t k = 0; k < n_sums; k++) out[k] += s->host->sum(s->run, t.n_blocks, t.by_block[k]);
	return true;
}
