/* SPDX-License-Identifier: MIT */
#include "split.h"
#include <stdbool.h>
#include <stdlib.h>

enum {
	LENGTHS = 16, /* so many lengths of rounds are known at once */
	ROUNDS = 16,  /* shares change after so many rounds, in which short ones count for little */
	WORST = 4, /* times what the others took in the mean: a thread that has lost its processor is no work */
	ALIKE = 8  /* a length that is off by one part of so many has shares in the same places */
};

/* Where a share begins, and how it comes there. */
typedef struct {
	uint32_t at;
	double pace; /* of the way to where it should be: less where the last step went too far */
	double way;  /* of the last step */
	double took; /* by the share, in the rounds so far */
} border;

typedef struct {
	uint32_t n, rounds; /* n = 0: none */
	uint64_t used;      /* when last */
	border *border;     /* [workers + 1] */
} split;

struct quern_splits {
	uint32_t workers;
	uint64_t calls;
	split *now; /* of the last round */
	split lengths[LENGTHS];
	uint32_t *begin; /* [workers + 1], as they are given out */
};

quern_splits *quern_splits_create(uint32_t workers) {
	quern_splits *s = calloc(1, sizeof *s);
	if (!s) return NULL;
	s->workers = workers;
	bool whole = (s->begin = calloc(workers + 1, sizeof *s->begin)) != NULL;
	for (int k = 0; k < LENGTHS; k++)
		whole = (s->lengths[k].border = calloc(workers + 1, sizeof(border))) != NULL && whole;
	if (whole) return s;
	quern_splits_destroy(s);
	return NULL;
}

void quern_splits_destroy(quern_splits *s) {
	if (!s) return;
	for (int k = 0; k < LENGTHS; k++) free(s->lengths[k].border);
	free(s->begin);
	free(s);
}

/* The one of this length, or the one that was not asked for longest. */
static split *find(quern_splits *s, uint32_t n) {
	split *oldest = &s->lengths[0];
	for (int k = 0; k < LENGTHS; k++) {
		split *one = &s->lengths[k];
		if (one->n == n) return one;
		if (one->used < oldest->used) oldest = one;
	}
	return oldest;
}

static uint32_t difference(uint32_t a, uint32_t b) { return a > b ? a - b : b - a; }

/* The most alike in length, if one is. */
static const split *find_alike(const quern_splits *s, uint32_t n) {
	const split *best = NULL;
	for (int k = 0; k < LENGTHS; k++) {
		const split *one = &s->lengths[k];
		if (!one->n || difference(one->n, n) > n / ALIKE) continue;
		if (!best || difference(one->n, n) < difference(best->n, n)) best = one;
	}
	return best;
}

/* Blocks of a set become more or fewer, and their work stays where it is. */
static void begin_length(const quern_splits *s, split *one, uint32_t n) {
	const split *alike = find_alike(s, n);
	const uint32_t length = alike ? alike->n : s->workers;
	for (uint32_t w = 0; w <= s->workers; w++) {
		const uint64_t at = alike ? alike->border[w].at : w;
		one->border[w] = (border) { .at = (uint32_t)(at * n / length), .pace = 0.5 };
	}
	one->n = n;
	one->rounds = 0;
}

const uint32_t *quern_splits_begin(quern_splits *s, uint32_t n) {
	split *one = s->now = find(s, n);
	if (one->n != n || !n) begin_length(s, one, n);
	one->used = ++s->calls;
	for (uint32_t w = 0; w <= s->workers; w++) s->begin[w] = one->border[w].at;
	return s->begin;
}

/* Where the work of all shares, taken as even within each, has come to that part of the whole. */
static double place_of(const split *one, uint32_t workers, double part, double all) {
	const border *b = one->border;
	double before = 0;
	uint32_t w = 0;
	while (w + 1 < workers && before + b[w].took < part * all) before += b[w++].took;
	const double length = b[w + 1].at - b[w].at;
	return b[w].at + (b[w].took > 0 ? length * (part * all - before) / b[w].took : 0);
}

/* Half of the way, since what is measured is noisy; less from time to time where it goes back and forth about an index that has much of the
 * work. Two indices more or fewer are left to who is done first, so that the same ones stay with the same thread. */
static uint32_t step(border *b, double place, uint32_t n) {
	const double way = place - b->at;
	if (way < 2 && way > -2) return b->at;
	b->pace = way * b->way < 0 ? 0.5 * b->pace : 1.25 * b->pace < 0.5 ? 1.25 * b->pace : 0.5;
	b->way = way;
	const double moved = b->at + b->pace * way + 0.5;
	return moved < 0 ? 0 : moved < n ? (uint32_t)moved : n;
}

static void move(const quern_splits *s, split *one) {
	double all = 0, place[QUERN_SPLIT_WORKERS];
	for (uint32_t w = 0; w < s->workers; w++) all += one->border[w].took;
	for (uint32_t w = 1; w < s->workers && all > 0; w++)
		place[w] = place_of(one, s->workers, (double)w / s->workers, all);
	for (uint32_t w = 1; w < s->workers && all > 0; w++) {
		border *b = &one->border[w];
		const uint32_t moved = step(b, place[w], one->n), least = b[-1].at;
		b->at = moved > least ? moved : least;
	}
	for (uint32_t w = 0; w < s->workers; w++) one->border[w].took = 0;
	one->rounds = 0;
}

void quern_splits_took(quern_splits *s, const uint64_t *took) {
	split *one = s->now;
	uint64_t all = 0;
	for (uint32_t w = 0; w < s->workers; w++) all += took[w];
	for (uint32_t w = 0; w < s->workers; w++) {
		const double own = (double)took[w], others = (double)(all - took[w]),
					 most = s->workers > 1 ? WORST * others / (s->workers - 1) : 0;
		one->border[w].took += own > most && most > 0 ? most : own;
	}
	if (++one->rounds == ROUNDS) move(s, one);
}
