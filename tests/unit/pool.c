/* SPDX-License-Identifier: MIT */
/* Workers: every index once, scratch of one's own, sums that do not depend on how many there are. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <platform.h>
#include <pool.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { N = 5000 };

typedef struct {
	quern_pool *pool;
	uint32_t count[N], wrong;
} tally;

static void touch(void *arg, uint32_t i, uint32_t worker) {
	tally *t = arg;
	uint32_t *mine = quern_pool_scratch(t->pool, worker, 256);
	t->count[i]++;
	if (worker >= quern_pool_workers(t->pool) || !mine || (uintptr_t)mine % 64) t->wrong = 1;
	mine[0] = i;
	for (int k = 0; k < 100; k++)
		if (((volatile uint32_t *)mine)[0] != i) t->wrong = 1;
}

static void every_index_once(void **state) {
	static const uint32_t workers[] = { 1, 2, 4, 7 };
	(void)state;
	for (size_t w = 0; w < 4; w++) {
		tally *t = calloc(1, sizeof *t);
		assert_non_null(t);
		t->pool = quern_pool_create(workers[w]);
		assert_int_equal(quern_pool_workers(t->pool), workers[w]);
		quern_pool_each(t->pool, N, touch, t);
		quern_pool_each(t->pool, 0, touch, t);
		for (int i = 0; i < N; i++) assert_int_equal(t->count[i], 1);
		assert_int_equal(t->wrong, 0);
		quern_pool_destroy(t->pool);
		free(t);
	}
}

static void count_one(void *arg, uint32_t i, uint32_t worker) {
	(void)worker;
	atomic_fetch_add(&((_Atomic int *)arg)[i], 1);
}

/* Threads that come late, sleep, or are woken in between take no index of another round: rounds of changing length, each
 * with counts of its own, some after a pause that lets all of them fall asleep. */
static void run_rounds(uint32_t rounds, uint32_t least, uint32_t span) {
	const size_t most = least + span;
	quern_pool *pool = quern_pool_create(4);
	_Atomic int *all = calloc(rounds * most, sizeof *all);
	assert_non_null(all);
	for (uint32_t r = 0; r < rounds; r++) {
		quern_pool_each(pool, least + r * 7 % span, count_one, all + r * most);
		if (r % (rounds / 5) == 0) nanosleep(&(struct timespec) { .tv_nsec = 3000000 }, NULL);
	}
	for (uint32_t r = 0; r < rounds; r++)
		for (uint32_t i = 0; i < most; i++) assert_int_equal(all[r * most + i], i < least + r * 7 % span);
	free(all);
	quern_pool_destroy(pool);
}

/* Indices are taken one by one in the first, several at once in the second. */
static void rounds_do_not_mix(void **state) {
	(void)state;
	run_rounds(20000, 2, 13);
	run_rounds(2000, 100, 300);
}

/* Nobody waits for a thread that has taken nothing: here none exists any more, as in a process that was forked. */
static void caller_does_it_alone(void **state) {
	(void)state;
	quern_pool *pool = quern_pool_create(3);
	_Atomic int own[16] = { 0 };
	/* helpers go to sleep: one that was about to would leave the child a lock that nobody gives back */
	nanosleep(&(struct timespec) { .tv_nsec = 200000000 }, NULL);
	const pid_t child = fork();
	if (child == 0) {
		quern_pool_each(pool, 16, count_one, own);
		for (int i = 0; i < 16; i++)
			if (own[i] != 1) _exit(1);
		_exit(0);
	}
	int status = -1;
	assert_int_equal(waitpid(child, &status, 0), child);
	assert_int_equal(status, 0);
	quern_pool_destroy(pool);
}

static int end_of(void (*work)(void)) {
	const pid_t child = fork();
	int status = -1;
	if (child == 0) {
		work();
		_exit(0);
	}
	assert_int_equal(waitpid(child, &status, 0), child);
	return status;
}

#ifndef QUERN_SANITIZED
static void on_crash(int number) { _exit(number == SIGSEGV ? 42 : 1); }

static void use_up_the_stack(void *arg, uint32_t i, uint32_t worker) {
	(void)arg, (void)i;
	while (!worker) sched_yield();
	for (;;) *(volatile char *)__builtin_alloca(4096) = 1;
}

static void recurse_for_ever(void) {
	const struct sigaction action = { .sa_handler = on_crash, .sa_flags = SA_ONSTACK };
	sigaction(SIGSEGV, &action, NULL);
	quern_pool_each(quern_pool_create(2), 2, use_up_the_stack, NULL);
}

/* A handler of crashes can speak where a thread has no stack left. */
static void crash_has_a_stack(void **state) {
	(void)state;
	const int status = end_of(recurse_for_ever);
	assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 42);
}
#endif

static void call_again(void *arg, uint32_t i, uint32_t worker) {
	_Atomic int own[16] = { 0 };
	(void)i, (void)worker;
	quern_pool_each(arg, 1, count_one, own);
}

static void call_within(uint32_t workers, uint32_t n) {
	quern_pool *pool = quern_pool_create(workers);
	fclose(stderr); /* it complains */
	quern_pool_each(pool, n, call_again, pool);
}
static void one_within(void) { call_within(1, 1); }
static void many_within(void) { call_within(2, 8); }

/* With two workers a body that calls would hang: it ends the program with one as well, so that its author learns of it. */
static void body_may_not_call(void **state) {
	(void)state;
	for (int k = 0; k < 2; k++) {
		const int status = end_of(k ? many_within : one_within);
		assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT);
	}
}

/* The number of workers can be had from the environment, where batch systems put it; nonsense there is passed over. */
static void environment_is_heard(void **state) {
	(void)state;
	setenv("OMP_NUM_THREADS", "3", 1);
	quern_pool *pool = quern_pool_create(0);
	assert_int_equal(quern_pool_workers(pool), 3);
	quern_pool_destroy(pool);
	pool = quern_pool_create(2);
	assert_int_equal(quern_pool_workers(pool), 2);
	quern_pool_destroy(pool);
	setenv("OMP_NUM_THREADS", "many", 1);
	pool = quern_pool_create(0);
	assert_int_equal(quern_pool_workers(pool), quern_platform_processors());
	quern_pool_destroy(pool);
	unsetenv("OMP_NUM_THREADS");
}

static void scratch_grows(void **state) {
	quern_pool *pool = quern_pool_create(2);
	(void)state;
	char *small = quern_pool_scratch(pool, 0, 100);
	memset(small, 1, 100);
	assert_ptr_equal(quern_pool_scratch(pool, 0, 50), small); /* kept until asked for more */
	char *large = quern_pool_scratch(pool, 0, 1 << 20);
	memset(large, 2, 1 << 20);
	assert_ptr_not_equal(quern_pool_scratch(pool, 1, 100), large);
	quern_pool_destroy(pool);
}

static void tree_sums(void **state) {
	enum { MOST = 3000 };
	double *x = malloc(MOST * sizeof *x);
	(void)state;
	assert_non_null(x);
	for (int i = 0; i < MOST; i++) x[i] = 1 / (1.0 + i);
	assert_true(quern_tree_sum(0, x) == 0);
	assert_true(quern_tree_sum(1, x) == 1);
	for (size_t n = 1; n < MOST; n += 97) {
		long double exact = 0;
		for (size_t i = 0; i < n; i++) exact += x[i];
		assert_true(fabs(quern_tree_sum(n, x) - (double)exact) <= 1e-14 * (double)exact);
	}
	/* a leaf's sum does not change what the leaves before it give */
	assert_true(quern_tree_sum(512, x) == quern_tree_sum(256, x) + quern_tree_sum(256, x + 256));
	assert_true(quern_tree_sum(700, x) == quern_tree_sum(512, x) + quern_tree_sum(188, x + 512));
	free(x);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(every_index_once),
		cmocka_unit_test(rounds_do_not_mix), cmocka_unit_test(caller_does_it_alone),
#ifndef QUERN_SANITIZED
		cmocka_unit_test(crash_has_a_stack),
#endif
		cmocka_unit_test(body_may_not_call), cmocka_unit_test(environment_is_heard),
		cmocka_unit_test(scratch_grows), cmocka_unit_test(tree_sums) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
