#include "pool.h"
#include "text.h"
#include <omp.h>
#include <stdlib.h>

typedef struct {
	_Alignas(64) void *memory;
	size_t bytes;
} scratch;

struct quern_pool {
	uint32_t workers;
	scratch *scratch;
};

quern_pool *quern_pool_create(uint32_t workers) {
	quern_pool *pool = quern_take(1, sizeof *pool);
	pool->workers = workers ? workers : (uint32_t)omp_get_num_procs();
	if (pool->workers > 256) pool->workers = 256;
	pool->scratch = aligned_alloc(64, pool->workers * sizeof(scratch));
	if (!pool->scratch) abort();
	for (uint32_t i = 0; i < pool->workers; i++) pool->scratch[i] = (scratch) { 0 };
	return pool;
}

void quern_pool_destroy(quern_pool *pool) {
	if (!pool) return;
	for (uint32_t i = 0; i < pool->workers; i++) free(pool->scratch[i].memory);
	free(pool->scratch);
	free(pool);
}

uint32_t quern_pool_workers(const quern_pool *pool) { return pool->workers; }

void quern_pool_each(quern_pool *pool, uint32_t n, void (*body)(void *, uint32_t, uint32_t), void *arg) {
	if (pool->workers == 1 || n < 2) {
		for (uint32_t i = 0; i < n; i++) body(arg, i, 0);
		return;
	}
#pragma omp parallel for schedule(dynamic, 1) num_threads(pool->workers)
	for (uint32_t i = 0; i < n; i++) body(arg, i, (uint32_t)omp_get_thread_num());
}

void *quern_pool_scratch(quern_pool *pool, uint32_t worker, size_t bytes) {
	scratch *own = &pool->scratch[worker];
	if (own->bytes >= bytes) return own->memory;
	free(own->memory);
	own->bytes = (bytes + bytes / 4 + 4095) & ~(size_t)4095;
	own->memory = aligned_alloc(64, own->bytes);
	if (!own->memory) own->bytes = 0;
	return own->memory;
}

double quern_tree_sum(size_t n, const double *values) {
	if (n <= 256) {
		double sum = 0;
		for (size_t i = 0; i < n; i++) sum += values[i];
		return sum;
	}
	size_t half = 256; /* the largest power of two times 256 below n */
	while (half * 2 < n) half *= 2;
	return quern_tree_sum(half, values) + quern_tree_sum(n - half, values + half);
}
