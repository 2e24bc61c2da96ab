/* Workers: every index once, scratch of one's own, sums that do not depend on how many there are. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <pool.h>
#include <stdlib.h>
#include <string.h>

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
	const struct CMUnitTest tests[] = { cmocka_unit_test(every_index_once), cmocka_unit_test(scratch_grows),
		cmocka_unit_test(tree_sums) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
