/* SPDX-License-Identifier: MIT */
/* host - the table of services that plugins get */
#include "platform.h"
#include "random.h"
#include "run.h"
#include "start.h"
#include "text.h"
#include <stdlib.h>
#include <string.h>

/* Without a log, as in `plan`, a warning goes to the terminal all the same. */
static void host_log(quern_run *run, int level, const char *fmt, ...) {
	va_list list;
	if (run->mute) return;
	va_start(list, fmt);
	if (run->log) quern_log_addv(run->log, level, fmt, list);
	else if (level >= 2) {
		fputs("warning: ", stderr);
		vfprintf(stderr, fmt, list);
		fputs("\n", stderr);
	}
	va_end(list);
}

static void host_parallel(quern_run *run, uint32_t n, void (*body)(void *, uint32_t, uint32_t), void *arg) {
	quern_pool_each(run->pool, n, body, arg);
}

static uint32_t host_workers(quern_run *run) { return quern_pool_workers(run->pool); }

static void *host_scratch(quern_run *run, uint32_t worker, size_t bytes) {
	return quern_pool_scratch(run->pool, worker, bytes);
}

/* One block of memory is reused from stage to stage; what did not fit makes it larger the next time. */
static void *host_memory(quern_run *run, size_t bytes) {
	quern_arena *a = &run->arena;
	if (bytes > SIZE_MAX / 2) return NULL;
	const size_t size = bytes ? (bytes + 63) & ~(size_t)63 : 64; /* of nothing too there is an address */
	void *memory;
	if (size <= a->capacity - a->used) {
		memory = a->data + a->used;
		a->used += size;
	} else {
		if (a->used < a->capacity) quern_platform_forget(a->data + a->used, a->capacity - a->used);
		a->capacity = a->used; /* what is left of the block has no use before it is made anew */
		memory = quern_platform_memory(size);
		if (!memory) return NULL;
		a->extra = quern_grow(a->extra, a->n_extra, &a->extra_capacity, sizeof(void *));
		a->extra[a->n_extra++] = memory;
		a->extra_bytes += size;
	}
	return memset(memory, 0, size);
}

static quern_real host_sum(quern_run *run, size_t n, const quern_real *values) {
	(void)run;
	return quern_tree_sum(n, values);
}

static quern_status host_stop(
	quern_run *run, quern_status status, const char *set, int64_t id, const char *fmt, ...) {
	quern_text text = { 0 };
	va_list list;
	va_start(list, fmt);
	quern_text_addv(&text, fmt, list);
	va_end(list);
	if (status == QUERN_E_PARAM) {
		quern_run_refuse(run, set, "%s", quern_text_string(&text));
		quern_text_finish(&text);
		return status;
	}
	char number[40] = "";
	if (id >= 0) snprintf(number, sizeof number, " %lld", (long long)id);
	quern_run_stop(
		run, status, "%s%s%s%s%s", set ? set : "", number, set ? ": " : "", quern_text_string(&text), "");
	quern_text_finish(&text);
	return status;
}

static quern_set_view host_set(quern_run *run, const char *name) {
	const int i = quern_store_set(&run->plan->store, name);
	if (i < 0) return (quern_set_view) { 0 };
	const quern_set_store *s = &run->plan->store.sets[i];
	return (quern_set_view) { s->n, s->cap, s->n_blocks, s->n_blocks ? s->block : NULL };
}

static quern_status host_remap(quern_run *run, const char *set, uint32_t n, const int32_t *from,
	uint32_t n_blocks, const uint32_t *block) {
	const int i = quern_store_set(&run->plan->store, set);
	if (i < 0) return quern_run_stop(run, QUERN_E_FIELD, "%s: no set of that name", set);
	const quern_status status = quern_store_remap(&run->plan->store, i, n, from, n_blocks, block);
	if (status == QUERN_E_MEMORY)
		return quern_run_stop(run, status, "out of memory for %u entries of %s", n, set);
	quern_plan_refresh(run->plan);
	return status;
}

static const quern_grid_view *host_grid(quern_run *run) { return run->has_grid ? &run->grid.view : NULL; }

static quern_status host_cover(quern_run *run, uint32_t n, const int32_t (*block)[3]) {
	const quern_status status = quern_grid_cover(&run->grid, &run->plan->store, n, block);
	if (status == QUERN_E_MEMORY)
		return quern_run_stop(run, status, "out of memory for a grid of %u blocks", n);
	quern_plan_refresh(run->plan);
	return status;
}

static const void *host_extension(const char *id) {
	(void)id;
	return NULL;
}

static bool host_has(quern_run *run, const char *section) {
	return quern_scene_section(run->scene, section) != NULL;
}

static const quern_parts *host_parts(quern_run *run, const char *name) {
	const int i = quern_store_set(&run->plan->store, name);
	return i < 0 ? NULL : quern_store_parts(&run->plan->store, i);
}

static quern_status host_arrange(quern_run *run, const char *set, const uint32_t *by_place) {
	const int i = quern_store_set(&run->plan->store, set);
	if (i < 0) return quern_run_stop(run, QUERN_E_FIELD, "%s: no set of that name", set);
	const quern_status status = quern_store_arrange(&run->plan->store, i, by_place);
	if (status == QUERN_E_FIELD)
		return quern_run_stop(
			run, status, "%s: the order of its blocks does not hold each of them once", set);
	if (status == QUERN_E_MEMORY)
		return quern_run_stop(run, status, "out of memory for the blocks of %s", set);
	return status;
}

static quern_real host_sum_set(quern_run *run, const char *set, const quern_real *values) {
	const int i = quern_store_set(&run->plan->store, set);
	return i < 0 ? 0 : quern_store_sum(&run->plan->store, i, values);
}

static void host_give(
	quern_run *run, const char *set, uint32_t from, int32_t to, quern_real part, quern_real share) {
	const int i = quern_store_set(&run->plan->store, set);
	if (i >= 0) quern_store_give(&run->plan->store, i, from, to, part, share);
}

const quern_host quern_host_table = {
	.abi = QUERN_ABI,
	.fail = quern_scene_fail,
	.publish = quern_scene_publish,
	.random = quern_random,
	.log = host_log,
	.parallel = host_parallel,
	.workers = host_workers,
	.scratch = host_scratch,
	.memory = host_memory,
	.sum = host_sum,
	.stop = host_stop,
	.set = host_set,
	.remap = host_remap,
	.grid = host_grid,
	.cover = host_cover,
	.extension = host_extension,
	.has = host_has,
	.keeps = quern_scene_keeps,
	.parts = host_parts,
	.arrange = host_arrange,
	.sum_set = host_sum_set,
	.give = host_give,
	.taken = quern_start_took,
};
