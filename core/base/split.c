/* SPDX-License-Identifier: MIT */
#include "split.h"
#include <stdlib.h>

enum {
	LENGTHS = 16, /* so many lengths of rounds are known at once */
	ROUNDS = 16,  /* shares change after so many rounds, in which short ones count for little */
	WORST = 4 /* times what the others took in the mean: a thread that has lost its processor is no work */
};

typedef struct {
	uint32_t n, rounds; /* n = 0: none */
	uint64_t used;      /* when last */
	uint32_t *begin;    /* [workers + 1] */
	double *took;       /* [workers], in the rounds so far */
} split;

struct quern_splits {
	uint32_t workers;
	uint64_t calls;
	split *now; /* of the last round */
	split lengths[LENGTHS];
};

quern_splits *quern_splits_create(uint32_t workers) {
	quern_splits *s = calloc(1, sizeof *s);
	if (!s) return NULL;
	s->workers = workers;
	for (int k = 0; k < LENGTHS; k++) {
		s->lengths[k].begin = calloc(workers + 1, sizeof(uint32_t));
		s->lengths[k].took = calloc(workers, sizeof(double));
		if (s->lengths[k].begin && s->lengths[k].took) continue;
		quern_splits_destroy(s);
		return NULL;
	}
	return s;
}

void quern_splits_destroy(quern_splits *s) {
	if (!s) return;
	for (int k = 0; k < LENGTHS; k++) free(s->lengths[k].begin), free(s->lengths[k].took);
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

static void forget(split *one, uint32_t workers) {
	one->rounds = 0;
	for (uint32_t w = 0; w < workers; w++) one->took[w] = 0;
}

const uint32_t *quern_splits_begin(quern_splits *s, uint32_t n) {
	split *one = s->now = find(s, n);
	one->used = ++s->calls;
	if (one->n != n || !n) {
		one->n = n;
		forget(one, s->workers);
		for (uint32_t w = 0; w <= s->workers; w++) one->begin[w] = (uint32_t)((uint64_t)n * w / s->workers);
	}
	return one->begin;
}

/* Where the work of all shares, taken as even within each, has come to that part of the whole. */
static double place_of(const split *one, uint32_t workers, double part, double all) {
	double before = 0;
	uint32_t w = 0;
	while (w + 1 < workers && before + one->took[w] < part * all) before += one->took[w++];
	const double length = one->begin[w + 1] - one->begin[w];
	return one->begin[w] + (one->took[w] > 0 ? length * (part * all - before) / one->took[w] : 0);
}

/* Half of the way to where shares took the same: what is measured is noisy. One index more or less is left to who is done first, so that the
 * same ones stay with the same thread. */
static void move(const quern_splits *s, split *one) {
	double all = 0, place[QUERN_SPLIT_WORKERS];
	for (uint32_t w = 0; w < s->workers; w++) all += one->took[w];
	for (uint32_t w = 1; w < s->workers && all > 0; w++)
		place[w] = place_of(one, s->workers, (double)w / s->workers, all);
	for (uint32_t w = 1; w < s->workers && all > 0; w++) {
		const double way = place[w] - one->begin[w];
		if (way < 2 && way > -2) continue;
		const uint32_t moved = (uint32_t)(one->begin[w] + way / 2), least = one->begin[w - 1];
		one->begin[w] = moved < least ? least : moved > one->n ? one->n : moved;
	}
	/* where one stayed that another passed */
	for (uint32_t w = s->workers - 1; w > 0; w--)
		if (one->begin[w] > one->begin[w + 1]) one->begin[w] = one->begin[w + 1];
}

void quern_splits_took(quern_splits *s, const uint64_t *took) {
	split *one = s->now;
	double all = 0;
	for (uint32_t w = 0; w < s->workers; w++) all += (double)took[w];
	for (uint32_t w = 0; w < s->workers && s->workers > 1; w++) {
		const double own = (double)took[w], most = WORST * (all - own) / (s->workers - 1);
		one->took[w] += own > most && most > 0 ? most : own;
	}
	if (++one->rounds < ROUNDS) return;
	move(s, one);
	forget(one, s->workers);
}
