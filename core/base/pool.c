/* SPDX-License-Identifier: MIT */
/* pool - threads that wait for work a short while, then sleep. docs/decisions/0018-threads.md */
#include "pool.h"
#include "platform.h"
#include "split.h"
#include "text.h"
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>

enum { PAUSES = 2000, YIELDS = 200 }; /* some 50 us of each */
enum { PARTS = 16 };                  /* one of so many is taken of what is left in a share */

typedef struct {
	_Alignas(64) void *memory;
	size_t bytes;
} scratch;

/* A worker's share of a round: the round's number in the high 32 bits of the ticket, how many indices are left in the low ones. */
typedef struct {
	_Alignas(64) _Atomic uint64_t ticket;
	_Atomic uint64_t took; /* of the processor's ticks, whoever did it */
	_Atomic uint32_t end;
} share;

typedef struct {
	quern_pool *pool;
	pthread_t thread;
	uint32_t number;
} helper;

/* A round is one call of quern_pool_each. Every worker has a share of the indices, nearly the same part of them in every round of as many, so that
 * what it worked on lies in its own cache the next time; who has done his own helps the others. What others did has to come back from their caches,
 * so shares are made to take as long as each other (split.h). Who takes indices by compare-and-swap has read
 * body, arg, n and the share's end of this round: the caller changes them only while none is left and all are done. So nobody waits for a thread that
 * has taken nothing: others do the work of one that sleeps, or that has to wait for a processor. */
struct quern_pool {
	_Alignas(64) _Atomic uint32_t round;
	_Alignas(64) _Atomic uint32_t done;
	_Alignas(64) _Atomic uint32_t n;
	void (*_Atomic body)(void *, uint32_t, uint32_t);
	void *_Atomic arg;
	_Atomic bool stop, caller_waits, busy, lacked;
	_Atomic uint32_t asleep, begun;
	pthread_mutex_t lock;
	pthread_cond_t work, end;
	uint32_t workers, started;
	helper *helpers;
	scratch *scratch;
	share *shares;
	quern_splits *splits;
};

/* Takes indices of one share until there is none left: several at once while there are many, since two threads that take and count in turn
 * wait for each other's caches, which costs more than the shortest work. */
static void take_from(quern_pool *p, uint32_t round, uint32_t owner, uint32_t worker) {
	share *own = &p->shares[owner];
	uint64_t ticket = atomic_load(&own->ticket);
	while (ticket >> 32 == round && (uint32_t)ticket) {
		const uint32_t left = (uint32_t)ticket, n = atomic_load(&p->n), taken = left / PARTS + 1;
		void (*body)(void *, uint32_t, uint32_t) = atomic_load(&p->body);
		void *arg = atomic_load(&p->arg);
		const uint32_t begin = atomic_load(&own->end) - left;
		if (!atomic_compare_exchange_weak(&own->ticket, &ticket, ticket - taken)) continue;
		const uint64_t began = quern_platform_ticks();
		for (uint32_t i = begin; i < begin + taken; i++) body(arg, i, worker);
		const uint64_t took = quern_platform_ticks() - began;
		atomic_fetch_add(&own->took, took >> 63 ? 0 : took); /* clocks of two processors may differ */
		if (atomic_fetch_add(&p->done, taken) + taken == n && atomic_load(&p->caller_waits)) {
			pthread_mutex_lock(&p->lock);
			pthread_cond_signal(&p->end);
			pthread_mutex_unlock(&p->lock);
		}
		ticket = atomic_load(&own->ticket);
	}
}

static void take_part(quern_pool *p, uint32_t round, uint32_t worker) {
	for (uint32_t k = 0; k < p->workers; k++) take_from(p, round, (worker + k) % p->workers, worker);
}

/* Looks for a change of `word` for a while: awake first, then giving way to whoever wants the processor. */
#define WAIT_WHILE(condition)                                                                                \
	for (int k = 0; (condition) && k < PAUSES + YIELDS; k++) {                                               \
		if (k < PAUSES) quern_platform_pause();                                                              \
		else sched_yield();                                                                                  \
	}

/* Where an endless recursion leaves no stack, a handler needs one of its own: the thread's own first bytes. */
static void *help(void *arg) {
#ifndef QUERN_SANITIZED
	_Alignas(64) char crash[1 << 16];
	const stack_t own = { .ss_sp = crash, .ss_size = sizeof crash };
	sigaltstack(&own, NULL);
#endif
	const helper *h = arg;
	quern_pool *p = h->pool;
	uint32_t round = 0;
	atomic_fetch_add(&p->begun, 1);
	for (;;) {
		WAIT_WHILE(atomic_load(&p->round) == round && !atomic_load(&p->stop))
		if (atomic_load(&p->round) == round) {
			pthread_mutex_lock(&p->lock);
			atomic_fetch_add(&p->asleep, 1);
			while (atomic_load(&p->round) == round && !atomic_load(&p->stop))
				pthread_cond_wait(&p->work, &p->lock);
			atomic_fetch_sub(&p->asleep, 1);
			pthread_mutex_unlock(&p->lock);
		}
		if (atomic_load(&p->stop)) return NULL;
		round = atomic_load(&p->round);
		take_part(p, round, h->number);
	}
}

static void wake(quern_pool *p) {
	if (!atomic_load(&p->asleep)) return;
	pthread_mutex_lock(&p->lock);
	pthread_cond_broadcast(&p->work);
	pthread_mutex_unlock(&p->lock);
}

/* Signals are the main thread's, but for those that a thread makes itself. */
static void start(quern_pool *p) {
	static const int own[] = { SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS };
	sigset_t others, before;
	sigfillset(&others);
	for (size_t i = 0; i < sizeof own / sizeof *own; i++) sigdelset(&others, own[i]);
	pthread_sigmask(SIG_SETMASK, &others, &before);
	for (uint32_t i = 1; i < p->workers; i++) {
		helper *h = &p->helpers[p->started];
		*h = (helper) { .pool = p, .number = i };
		if (pthread_create(&h->thread, NULL, help, h)) break;
		p->started++;
	}
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	p->workers = p->started + 1;
#ifdef QUERN_SANITIZED /* a child that is forked while a thread begins would find the sanitizer's allocator locked */
	while (atomic_load(&p->begun) < p->started) sched_yield();
#endif
}

static uint32_t wished(uint32_t workers) {
	const char *text = getenv("OMP_NUM_THREADS");
	char *end = NULL;
	const long asked = text ? strtol(text, &end, 10) : 0;
	if (!workers && asked > 0 && (!*end || *end == ','))
		workers = asked < QUERN_SPLIT_WORKERS ? (uint32_t)asked : QUERN_SPLIT_WORKERS;
	if (!workers) workers = quern_platform_processors();
	return workers < QUERN_SPLIT_WORKERS ? workers : QUERN_SPLIT_WORKERS;
}

quern_pool *quern_pool_create(uint32_t workers) {
	quern_pool *p = aligned_alloc(64, sizeof *p);
	if (!p) return NULL;
	*p = (quern_pool) { .workers = wished(workers) };
	p->scratch = aligned_alloc(64, p->workers * sizeof(scratch));
	p->shares = aligned_alloc(64, p->workers * sizeof(share));
	p->helpers = calloc(p->workers, sizeof(helper));
	if (!p->scratch || !p->shares || !p->helpers)
		return free(p->scratch), free(p->shares), free(p->helpers), free(p), NULL;
	for (uint32_t i = 0; i < p->workers; i++) {
		p->scratch[i] = (scratch) { 0 };
		p->shares[i] = (share) { 0 };
	}
	pthread_mutex_init(&p->lock, NULL);
	pthread_cond_init(&p->work, NULL);
	pthread_cond_init(&p->end, NULL);
	start(p);
	p->splits = quern_splits_create(p->workers);
	if (p->splits) return p;
	quern_pool_destroy(p);
	return NULL;
}

void quern_pool_destroy(quern_pool *p) {
	if (!p) return;
	atomic_store(&p->stop, true);
	wake(p);
	for (uint32_t i = 0; i < p->started; i++) pthread_join(p->helpers[i].thread, NULL);
	for (uint32_t i = 0; i < p->workers; i++) free(p->scratch[i].memory);
	pthread_mutex_destroy(&p->lock);
	pthread_cond_destroy(&p->work);
	pthread_cond_destroy(&p->end);
	free(p->scratch);
	free(p->shares);
	free(p->helpers);
	quern_splits_destroy(p->splits);
	free(p);
}

uint32_t quern_pool_workers(const quern_pool *p) { return p->workers; }

/* The last index may be with a thread that has lost its processor: then the caller gives up its own. */
static void wait_for_all(quern_pool *p, uint32_t n) {
	WAIT_WHILE(atomic_load(&p->done) < n)
	if (atomic_load(&p->done) == n) return;
	pthread_mutex_lock(&p->lock);
	atomic_store(&p->caller_waits, true);
	while (atomic_load(&p->done) < n) pthread_cond_wait(&p->end, &p->lock);
	atomic_store(&p->caller_waits, false);
	pthread_mutex_unlock(&p->lock);
}

static void share_out(quern_pool *p, uint32_t round, uint32_t n) {
	const uint32_t *begin = quern_splits_begin(p->splits, n);
	for (uint32_t w = 0; w < p->workers; w++) {
		share *own = &p->shares[w];
		atomic_store(&own->took, 0);
		atomic_store(&own->end, begin[w + 1]);
		atomic_store(&own->ticket, (uint64_t)round << 32 | (begin[w + 1] - begin[w]));
	}
}

static void run_round(quern_pool *p, uint32_t n, void (*body)(void *, uint32_t, uint32_t), void *arg) {
	const uint32_t round = atomic_load(&p->round) + 1;
	uint64_t took[QUERN_SPLIT_WORKERS];
	atomic_store(&p->done, 0);
	atomic_store(&p->body, body);
	atomic_store(&p->arg, arg);
	atomic_store(&p->n, n);
	share_out(p, round, n);
	atomic_store(&p->round, round);
	wake(p);
	take_part(p, round, 0);
	wait_for_all(p, n);
	for (uint32_t w = 0; w < p->workers; w++) took[w] = atomic_load(&p->shares[w].took);
	quern_splits_took(p->splits, took);
}

/* A call within a call would do its work on one thread, and wait for ever on more: nobody shall rely on it. */
void quern_pool_each(quern_pool *p, uint32_t n, void (*body)(void *, uint32_t, uint32_t), void *arg) {
	if (atomic_exchange(&p->busy, true)) {
		fputs("quern: parallel() was called within parallel()\n", stderr);
		abort();
	}
	if (p->workers > 1 && n > 1) run_round(p, n, body, arg);
	else
		for (uint32_t i = 0; i < n; i++) body(arg, i, 0);
	atomic_store(&p->busy, false);
}

void *quern_pool_scratch(quern_pool *p, uint32_t worker, size_t bytes) {
	scratch *own = &p->scratch[worker];
	if (own->bytes >= bytes) return own->memory;
	free(own->memory);
	own->bytes = (bytes + bytes / 4 + 4095) & ~(size_t)4095;
	own->memory = quern_platform_memory(own->bytes);
	if (!own->memory) {
		own->bytes = 0;
		atomic_store(&p->lacked, true);
	}
	return own->memory;
}

bool quern_pool_lacked(quern_pool *p) { return atomic_exchange(&p->lacked, false); }

void quern_pool_rest(quern_pool *p) {
	for (uint32_t w = 0; w < p->workers; w++)
		if (p->scratch[w].memory) quern_platform_forget(p->scratch[w].memory, p->scratch[w].bytes);
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
