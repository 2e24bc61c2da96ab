/* SPDX-License-Identifier: MIT */
/* levels - which radii share a level of a hierarchical grid. Radii are counted in bins, eight to a factor of two; of all ways to cut
 * the row of bins into levels the one is taken whose search costs least. docs/theory/grains.md, section 4 */
#pragma once
#include <quern/abi.h>
#include <string.h>

enum { MOST_LEVELS = 32 };

/* Level h holds the grains with most[h - 1] < radius <= most[h]; no level is empty, and the last one has the largest grain. */
typedef struct level_set {
	uint32_t n;
	uint32_t crowded; /* the level with most grains; of several the lowest */
	uint32_t count[MOST_LEVELS];
	quern_real most[MOST_LEVELS]; /* m, rising */
	quern_real
		room; /* that a grain takes in the mean, over that of one as large as any of the crowded level */
} level_set;

QUERN_INLINE uint32_t level_of(const level_set *levels, quern_real radius) {
	uint32_t h = 0;
	while (h + 1 < levels->n && radius > levels->most[h]) h++;
	return h;
}

enum { BINS = 128, BIN_SHIFT = 49 }; /* of a number's bits, the exponent and three of the mantissa */

typedef struct {
	uint32_t n;
	uint32_t below[BINS + 1]; /* grains in all bins before this one */
	quern_real most[BINS];    /* m, largest radius; rising */
	quern_real room;          /* m^dim, that all grains take as a packing */
	quern_real reach;
	uint32_t dim;
} radius_bins;

static inline uint64_t bin_of(quern_real radius) {
	uint64_t bits;
	memcpy(&bits, &radius, sizeof bits);
	return bits >> BIN_SHIFT;
}

static inline quern_real power(quern_real x, uint32_t dim) { return dim == 2 ? x * x : x * x * x; }

/* m^dim, in a packing. */
static inline quern_real room_of(quern_real radius, uint32_t dim) {
	return (dim == 2 ? 3.141592653589793 / 0.82 : 4.1887902047863905 / 0.6) * power(radius, dim);
}

/* Grains smaller than a 65 000th of the largest one share the first bin. */
static inline void count_radii(uint32_t n, const quern_real *radius, radius_bins *b) {
	uint32_t number[BINS] = { 0 };
	quern_real largest = 0, most[BINS] = { 0 };
	for (uint32_t i = 0; i < n; i++) largest = radius[i] > largest ? radius[i] : largest;
	const uint64_t last = bin_of(largest);
	for (uint32_t i = 0; i < n; i++) {
		const uint64_t down = last - bin_of(radius[i]), k = down < BINS ? BINS - 1 - down : 0;
		number[k]++;
		most[k] = radius[i] > most[k] ? radius[i] : most[k];
	}
	for (uint32_t k = 0; k < BINS; k++) {
		if (!number[k]) continue;
		b->most[b->n] = most[k];
		b->below[b->n + 1] = b->below[b->n] + number[k];
		b->room += number[k] * room_of(most[k], b->dim);
		b->n++;
	}
}

/* In units of one distance test: grains in bins from .. to - 1 as a level, which look at each other, and looks between them and all that are
 * smaller. To begin with a level takes LOOK, with a row of its cells ROW, as timed by tests/bench/searches.c. */
static inline quern_real cost_of_level(const radius_bins *b, uint32_t from, uint32_t to) {
	const quern_real LOOK = 40, ROW = 5;
	const quern_real own = b->below[to] - b->below[from], smaller = b->below[from];
	/* of one grain, how many lie in a cell's room */
	const quern_real dense = power(2 * b->most[to - 1] + b->reach, b->dim) / b->room;
	const quern_real look = own * (LOOK + power(3, b->dim - 1) * ROW + power(3, b->dim) * own * dense);
	if (!(smaller > 0)) return look;
	const quern_real up = smaller * (LOOK + power(2.5, b->dim - 1) * ROW + power(2.5, b->dim) * own * dense);
	const quern_real down = own * (LOOK + power(1.5, b->dim) * smaller * dense * (1 + ROW));
	return look + up + down;
}

/* cut[j] is where the last level of the first j bins begins, in the cheapest way to divide them. */
static inline void divide_radii(const radius_bins *b, uint32_t cut[BINS + 1]) {
	quern_real best[BINS + 1] = { 0 };
	for (uint32_t j = 1; j <= b->n; j++) {
		best[j] = __builtin_inf();
		for (uint32_t i = 0; i < j; i++) {
			const quern_real all = best[i] + cost_of_level(b, i, j);
			if (all < best[j]) best[j] = all, cut[j] = i;
		}
	}
}

/* The levels for which a search is expected to cost least; n > 0 radii (m, positive) in any order give the same ones. `reach` (m)
 * beyond touching is that of the pairs wanted. */
static inline level_set levels_of(uint32_t n, const quern_real *radius, quern_real reach, uint32_t dim) {
	radius_bins b = { .reach = reach, .dim = dim };
	uint32_t cut[BINS + 1] = { 0 }, end[MOST_LEVELS] = { 0 };
	level_set levels = { 0 };
	count_radii(n, radius, &b);
	divide_radii(&b, cut);
	for (uint32_t j = b.n; j > 0;
		 j = cut[j]) { /* from the largest down; those beyond the last level join it */
		if (levels.n < MOST_LEVELS) end[levels.n++] = j;
	}
	for (uint32_t h = 0, from = 0; h < levels.n; h++) {
		const uint32_t to = end[levels.n - 1 - h];
		levels.most[h] = b.most[to - 1];
		levels.count[h] = b.below[to] - b.below[from];
		if (levels.count[h] > levels.count[levels.crowded]) levels.crowded = h;
		from = to;
	}
	levels.room = b.room / (n * room_of(levels.most[levels.crowded], dim));
	return levels;
}
