/* SPDX-License-Identifier: MIT */
/* Shares of a round: all indices, each once; of as much work each before long, wherever that lies; and they stay then. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <split.h>
#include <stdio.h>
#include <string.h>

enum { MOST = 8 };

/* Ticks of index i of n: heavy below, as in a flow whose upper part hardly touches, with a light one now and then. */
static double heavy_below(uint32_t i, uint32_t n) {
	return (i < n / 4 ? 9000 : 1000) * (i % 5 == 4 ? 0.2 : 1);
}
static double one_heavy(uint32_t i, uint32_t n) { return i == n / 2 ? 400.0 * n : 1000; }
static double even(uint32_t i, uint32_t n) { return (void)i, (void)n, 100; }
static double last_one(uint32_t i, uint32_t n) { return i + 1 == n ? 1e6 : 1; }
static double none(uint32_t i, uint32_t n) { return (void)i, (void)n, 0; }

static void whole(const uint32_t *begin, uint32_t workers, uint32_t n) {
	assert_int_equal(begin[0], 0);
	assert_int_equal(begin[workers], n);
	for (uint32_t w = 0; w < workers; w++) assert_true(begin[w] <= begin[w + 1]);
}

/* One round in which everybody does his own; the most that one took over the mean. */
static double round_of(
	quern_splits *s, uint32_t workers, uint32_t n, double (*cost)(uint32_t, uint32_t), double late) {
	const uint32_t *begin = quern_splits_begin(s, n);
	uint64_t took[MOST] = { 0 };
	double most = 0, all = 0;
	whole(begin, workers, n);
	for (uint32_t w = 0; w < workers; w++) {
		double sum = w == 0 ? late : 0;
		for (uint32_t i = begin[w]; i < begin[w + 1]; i++) sum += cost(i, n);
		took[w] = (uint64_t)sum;
		most = fmax(most, sum), all += sum;
	}
	quern_splits_took(s, took);
	return all > 0 ? most * workers / all : 1;
}

/* After many rounds shares take as long as each other, but for three of the heaviest indices, and stay. */
static void settles(uint32_t workers, uint32_t n, double (*cost)(uint32_t, uint32_t)) {
	quern_splits *s = quern_splits_create(workers);
	double all = 0, heaviest = 0;
	uint32_t before[MOST + 1];
	assert_non_null(s);
	for (uint32_t i = 0; i < n; i++) all += cost(i, n), heaviest = fmax(heaviest, cost(i, n));
	const double first = round_of(s, workers, n, cost, 0);
	for (int r = 0; r < 3000; r++) round_of(s, workers, n, cost, 0);
	const double last = round_of(s, workers, n, cost, 0);
	if (workers == 2) printf("%u of %u: %.2f times the mean at first, %.3f then\n", n, workers, first, last);
	assert_true(last <= 1 + 3 * heaviest * workers / all);
	memcpy(before, quern_splits_begin(s, n), (workers + 1) * sizeof *before);
	for (int r = 0; r < 400; r++) {
		round_of(s, workers, n, cost, 0);
		for (uint32_t w = 0; w <= workers; w++)
			assert_true(fabs((double)quern_splits_begin(s, n)[w] - before[w]) <= fmax(1, n / 100.0));
	}
	quern_splits_destroy(s);
}

static void work_is_even(void **state) {
	static const uint32_t lengths[] = { 75, 400, 5000 };
	(void)state;
	for (uint32_t workers = 1; workers <= MOST; workers++)
		for (size_t k = 0; k < 3; k++) {
			settles(workers, lengths[k], heavy_below);
			settles(workers, lengths[k], one_heavy);
		}
}

/* A set that has a few more or fewer blocks begins as it was. */
static void alike_is_known(void **state) {
	(void)state;
	quern_splits *s = quern_splits_create(2);
	for (int r = 0; r < 1000; r++) round_of(s, 2, 400, heavy_below, 0);
	const uint32_t middle = quern_splits_begin(s, 400)[1];
	assert_true(middle > 60 && middle < 90);
	assert_int_equal(quern_splits_begin(s, 420)[1], middle * 420 / 400);
	assert_int_equal(quern_splits_begin(s, 500)[1], 250);
	quern_splits_destroy(s);
}

/* A thread that loses its processor once in a while moves shares a little. */
static void late_ones_are_no_work(void **state) {
	(void)state;
	quern_splits *s = quern_splits_create(2);
	for (int r = 0; r < 2000; r++) {
		round_of(s, 2, 400, even, r % 40 == 7 ? 1e7 : 0);
		const uint32_t middle = quern_splits_begin(s, 400)[1];
		assert_true(middle > 160 && middle < 210);
	}
	quern_splits_destroy(s);
}

/* Rounds of many lengths, more than are known at once, and such as have less than an index for each, or no work at all. */
static void all_lengths(void **state) {
	(void)state;
	quern_splits *s = quern_splits_create(7);
	for (uint32_t r = 0; r < 20000; r++) round_of(s, 7, r % 41, r % 3 ? last_one : none, 0);
	for (uint32_t r = 0; r < 2000;
		 r++) { /* as many as there can be: borders come from and go to their last ones */
		const uint32_t n = UINT32_MAX - r / 1000;
		uint64_t took[7];
		whole(quern_splits_begin(s, n), 7, n);
		for (uint32_t w = 0; w < 7; w++) took[w] = (r / 400 % 2 ? w * w * w : 6 - w) * 1000;
		quern_splits_took(s, took);
	}
	quern_splits_destroy(s);
	quern_splits_destroy(NULL);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(work_is_even),
		cmocka_unit_test(late_ones_are_no_work), cmocka_unit_test(alike_is_known),
		cmocka_unit_test(all_lengths) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
