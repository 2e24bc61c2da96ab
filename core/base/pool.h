/* SPDX-License-Identifier: MIT */
/* pool - the only place that knows about threads */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct quern_pool quern_pool;

/* `workers` counts the calling thread, 256 at most; 0: OMP_NUM_THREADS if that is a number, else as many as the process may
 * use. Threads that cannot be started are done without. NULL if there is no memory. */
quern_pool *quern_pool_create(uint32_t workers);
void quern_pool_destroy(quern_pool *);
uint32_t quern_pool_workers(const quern_pool *);

/* Calls body(arg, i, worker) once for every i < n. Which worker gets which i is not determined, so a body writes
 * nothing that another i reads or writes. Only one thread may call it, and no body: that ends the
 * program. */
void quern_pool_each(
	quern_pool *, uint32_t n, void (*body)(void *arg, uint32_t i, uint32_t worker), void *arg);

/* Memory of one worker, at least `bytes`, 64-byte aligned, kept between calls; NULL if there is none. */
void *quern_pool_scratch(quern_pool *, uint32_t worker, size_t bytes);

/* Between calls: whether some worker got none since this was asked last. */
bool quern_pool_lacked(quern_pool *);

/* Between calls: what lies in the memory of all workers goes back to the system until it is written again. */
void quern_pool_rest(quern_pool *);

/* The sum over a fixed binary tree of leaves of 256, whatever the number of workers. */
double quern_tree_sum(size_t n, const double *values);
