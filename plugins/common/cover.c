/* SPDX-License-Identifier: MIT */
#include "cover.h"
#include "sort.h"
#include "tools.h"
#include <string.h>

/* Blocks that were looked for, one for each of their places modulo four along the axes, so that neighbours do not turn each other out. */
typedef struct {
	uint64_t key[64]; /* of the block, plus one */
	int32_t block[64];
} memory;

static const uint64_t nowhere = UINT64_MAX;

typedef struct {
	const quern_step *s;
	const quern_grid_view *g;
	const cover *c;
	uint32_t n, tasks;     /* points; parts that they are cut into */
	const uint32_t *order; /* of points; NULL: their own */
	uint64_t *key;         /* of a point: its block's by place, later by number in the grid */
	uint8_t *place;        /* of a point in its block */
	uint8_t *seen;         /* tasks times blocks of the grid: something lies there */
	uint8_t *out;          /* of a task: a point has left the domain */
	uint32_t *strays;      /* of a task: what lies where no block is, or more */
	uint32_t *count;       /* tasks times blocks: points, later where the next one of them goes */
	int32_t *list, *from;  /* points by block, and by block and place */
	uint32_t *block;       /* where the points of a block begin */
} work;

/* 20 bits hold every block along an axis. */
static uint64_t block_key(const quern_grid_view *g, quern_real *const x[3], uint32_t i, uint32_t *place) {
	const int shift = quern_block_shift(g->dim);
	const uint32_t rest = (1u << shift) - 1;
	quern_real at[3];
	int32_t cell[3];
	uint64_t key = 0;
	*place = 0;
	quern_grid_position(g, x, i, at);
	quern_grid_cell_inside(g, at, cell);
	for (uint32_t k = g->dim; k-- > 0;) {
		key = key << 20 | (uint32_t)cell[k] >> shift;
		*place = *place << shift | ((uint32_t)cell[k] & rest);
	}
	return key;
}

static void block_of(uint64_t key, int32_t at[3]) {
	for (int k = 0; k < 3; k++) at[k] = (int32_t)(key >> (20 * k) & 0xfffff);
}

static int32_t look_up(const quern_grid_view *g, memory *m, uint64_t key) {
	const uint64_t slot = (key & 3) | (key >> 18 & 12) | (key >> 36 & 48);
	if (m->key[slot] == key + 1) return m->block[slot];
	int32_t at[3];
	block_of(key, at);
	m->key[slot] = key + 1;
	return m->block[slot] = quern_grid_block(g, at);
}

static uint32_t begin_of(uint32_t task, uint32_t tasks, uint32_t n) {
	return (uint32_t)((uint64_t)n * task / tasks);
}

/* ---- where all are ---- */

/* So many points are looked at together. */
enum { LOT = 256 };

/* Brings points back along a periodic axis; nearly all of those outside are so by less than a period. */
static void bring_back(quern_real *restrict x, uint32_t n, quern_real lower, quern_real upper) {
	const quern_real length = upper - lower;
	int far = 0;
#pragma omp simd reduction(| : far)
	for (uint32_t i = 0; i < n; i++) {
		const quern_real y = x[i] >= upper ? x[i] - length : x[i];
		x[i] = y < lower ? y + length : y;
		far |= (x[i] >= upper) | (x[i] < lower);
	}
	for (uint32_t i = 0; i < n && far; i++) x[i] = quern_brought_back(x[i], lower, upper);
}

/* Cells along an axis. A point on a face or farther out by round-off belongs to the cell inside, and so does what a periodic axis is longer than its cells:
 * in the first cell it would have no place, since it is not moved there. False where one has left. */
static bool find_cells(const work *w, uint32_t k, uint32_t begin, uint32_t n, int32_t *restrict cell) {
	const quern_step *s = w->s;
	quern_real *restrict x = w->c->point.real[k] + begin;
	const quern_real lower = s->lower[k], upper = s->upper[k], inverse = 1 / w->g->cell,
					 slack = 1e-6 * w->g->cell, origin = w->g->lower[k];
	const int32_t cells = w->g->cells[k];
	int left = 0;
	if (s->periodic[k]) bring_back(x, n, lower, upper);
#pragma omp simd reduction(| : left)
	for (uint32_t i = 0; i < n; i++) {
		const bool in = (x[i] >= lower - slack) & (x[i] <= upper + slack);
		cell[i] = quern_cell_held(quern_cell_along(in ? x[i] : lower, origin, inverse), cells);
		left |= !in;
	}
	return !left;
}

/* Keys and places of a lot; false where a point has left. */
static bool find_lot(const work *w, uint32_t begin, uint32_t n) {
	const int shift = quern_block_shift(w->g->dim);
	const int32_t rest = (1 << shift) - 1;
	uint64_t *restrict key = w->key + begin;
	uint8_t *restrict place = w->place + begin;
	bool inside = true;
	for (uint32_t k = 0; k < w->g->dim; k++) {
		int32_t cell[LOT];
		inside = find_cells(w, k, begin, n, cell) && inside;
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			key[i] |= (uint64_t)(cell[i] >> shift) << (20 * k);
			place[i] = (uint8_t)(place[i] | (cell[i] & rest) << (shift * (int)k));
		}
	}
	return inside;
}

static void find_points(void *arg, uint32_t task, uint32_t worker) {
	const work *w = arg;
	const uint32_t end = begin_of(task + 1, w->tasks, w->n);
	uint8_t *seen = w->seen + (size_t)task * w->g->n_blocks;
	memory m = { { 0 }, { 0 } };
	uint64_t last = nowhere;
	(void)worker;
	for (uint32_t begin = begin_of(task, w->tasks, w->n), n; begin < end; begin += n) {
		n = end - begin < LOT ? end - begin : LOT;
		if (!find_lot(w, begin, n)) w->out[task] = 1;
		for (uint32_t i = begin; i < begin + n; i++) {
			if (w->key[i] == last) continue;
			const int32_t b = look_up(w->g, &m, last = w->key[i]);
			if (b < 0) w->strays[task]++;
			else seen[b] = 1;
		}
	}
}

/* What lies outside the domain has no block: fixed grains may be below the floor. */
static bool is_inside(const work *w, uint32_t i) {
	bool inside = true;
	for (uint32_t k = 0; k < w->s->dim; k++) {
		const quern_real x = w->c->grain.real[k][i];
		inside = inside && (w->s->periodic[k] || (x >= w->s->lower[k] && x <= w->s->upper[k]));
	}
	return inside;
}

static uint32_t grains(const work *w) { return w->c->grain.real[0] ? w->c->n_grains : 0; }

static void find_grains(void *arg, uint32_t task, uint32_t worker) {
	const work *w = arg;
	const uint32_t end = begin_of(task + 1, w->tasks, grains(w));
	uint8_t *seen = w->seen + (size_t)task * w->g->n_blocks;
	memory m = { { 0 }, { 0 } };
	(void)worker;
	for (uint32_t i = begin_of(task, w->tasks, grains(w)), place; i < end; i++) {
		if (!is_inside(w, i)) continue;
		const int32_t b = look_up(w->g, &m, block_key(w->g, w->c->grain.real, i, &place));
		if (b < 0) w->strays[task]++;
		else seen[b] = 1;
	}
}

static bool any(const uint8_t *flag, uint32_t n) {
	uint8_t found = 0;
	for (uint32_t t = 0; t < n; t++) found |= flag[t];
	return found;
}

static quern_status name_lost(const work *w) {
	const quern_step *s = w->s;
	const quern_real slack = 1e-6 * w->g->cell;
	for (uint32_t k = 0; k < s->dim; k++)
		for (uint32_t i = 0; i < w->n; i++) {
			const quern_real x = w->c->point.real[k][i];
			if (x >= s->lower[k] - slack && x <= s->upper[k] + slack) continue;
			return s->host->stop(s->run, QUERN_E_NUMERIC, "point", i,
				"left the domain along axis %u, at %.6g m: the step is too long or the material unstable", k,
				x);
		}
	return QUERN_E_NUMERIC;
}

/* ---- blocks to cover ---- */

/* Adds a key where no block is, unless it was the last one. */
static uint32_t add_stray(const work *w, memory *m, uint64_t key, uint64_t *stray, uint32_t n) {
	if (look_up(w->g, m, key) < 0 && (!n || stray[n - 1] != key)) stray[n++] = key;
	return n;
}

static uint32_t list_strays(const work *w, uint64_t *stray) {
	memory m = { { 0 }, { 0 } };
	uint32_t n = 0, place;
	for (uint32_t i = 0; i < w->n; i++) n = add_stray(w, &m, w->key[i], stray, n);
	for (uint32_t i = 0; i < grains(w); i++)
		if (is_inside(w, i)) n = add_stray(w, &m, block_key(w->g, w->c->grain.real, i, &place), stray, n);
	return n;
}

/* Blocks that the grid does not have, once each. */
static quern_status add_strays(const work *w, size_t most, int32_t (*block)[3], uint32_t *blocks) {
	const quern_step *s = w->s;
	uint64_t *stray = s->host->memory(s->run, most * sizeof *stray);
	const uint32_t n = stray ? list_strays(w, stray) : 0;
	void *sorting = s->host->memory(s->run, quern_sort_bytes(n));
	int32_t *from = s->host->memory(s->run, ((size_t)n + 1) * sizeof *from);
	if (!stray || !sorting || !from) return QUERN_E_MEMORY;
	quern_sort_order(n, stray, NULL, from, sorting);
	for (uint32_t i = 0; i < n; i++)
		if (!i || stray[from[i]] != stray[from[i - 1]]) block_of(stray[from[i]], block[(*blocks)++]);
	return QUERN_OK;
}

static quern_status cover_material(const work *w) {
	const quern_step *s = w->s;
	const quern_grid_view *g = w->g;
	size_t strays = 0;
	for (uint32_t t = 0; t < w->tasks; t++) strays += w->strays[t];
	int32_t(*block)[3] = s->host->memory(s->run, (g->n_blocks + strays + 1) * sizeof *block);
	if (!block) return QUERN_E_MEMORY;
	uint32_t blocks = 0;
	for (uint32_t b = 0; b < g->n_blocks; b++) {
		bool wanted = w->c->holds && g->asked[b] && w->c->holds(w->c->arg, b);
		for (uint32_t t = 0; t < w->tasks && !wanted; t++) wanted = w->seen[(size_t)t * g->n_blocks + b];
		if (wanted) memcpy(block[blocks++], g->at[b], sizeof *block);
	}
	const quern_status status = strays ? add_strays(w, strays, block, &blocks) : QUERN_OK;
	return status == QUERN_OK ? s->host->cover(s->run, blocks, (const int32_t(*)[3])block) : status;
}

/* ---- points in order ---- */

static void count_points(void *arg, uint32_t task, uint32_t worker) {
	const work *w = arg;
	const uint32_t end = begin_of(task + 1, w->tasks, w->n);
	uint32_t *count = w->count + (size_t)task * w->g->n_blocks;
	memory m = { { 0 }, { 0 } };
	uint64_t last = nowhere;
	int32_t b = -1;
	(void)worker;
	for (uint32_t q = begin_of(task, w->tasks, w->n); q < end; q++) {
		const uint32_t i = quern_nth(w->order, q);
		if (w->key[i] != last) b = look_up(w->g, &m, last = w->key[i]);
		w->key[i] = (uint64_t)b;
		count[b]++;
	}
}

/* Counts become places: block by block, and within one what the first task found comes first. */
static void add_up(const work *w) {
	const uint32_t n_blocks = w->g->n_blocks;
	uint32_t sum = 0;
	for (uint32_t b = 0; b < n_blocks; b++) {
		w->block[b] = sum;
		for (uint32_t t = 0; t < w->tasks; t++) {
			uint32_t *count = &w->count[(size_t)t * n_blocks + b];
			const uint32_t n = *count;
			*count = sum;
			sum += n;
		}
	}
	w->block[n_blocks] = sum;
}

static void list_points(void *arg, uint32_t task, uint32_t worker) {
	const work *w = arg;
	const uint32_t end = begin_of(task + 1, w->tasks, w->n);
	uint32_t *next = w->count + (size_t)task * w->g->n_blocks;
	(void)worker;
	for (uint32_t q = begin_of(task, w->tasks, w->n); q < end; q++) {
		const uint32_t i = quern_nth(w->order, q);
		w->list[next[w->key[i]]++] = (int32_t)i;
	}
}

static void order_block(void *arg, uint32_t b, uint32_t worker) {
	const work *w = arg;
	uint32_t next[QUERN_BLOCK_CELLS] = { 0 }, sum = w->block[b];
	(void)worker;
	for (uint32_t k = w->block[b]; k < w->block[b + 1]; k++) next[w->place[w->list[k]]]++;
	for (uint32_t c = 0; c < QUERN_BLOCK_CELLS; c++) {
		const uint32_t n = next[c];
		next[c] = sum;
		sum += n;
	}
	for (uint32_t k = w->block[b]; k < w->block[b + 1]; k++)
		w->from[next[w->place[w->list[k]]]++] = w->list[k];
}

static quern_status order_points(work *w) {
	const quern_step *s = w->s;
	const quern_host *host = s->host;
	const uint32_t n_blocks = w->g->n_blocks;
	w->order = host->parts(s->run, "point")->entry;
	w->count = host->memory(s->run, ((size_t)w->tasks * n_blocks + 1) * sizeof *w->count);
	w->block = host->memory(s->run, ((size_t)n_blocks + 1) * sizeof *w->block);
	w->list = host->memory(s->run, ((size_t)w->n + 1) * sizeof *w->list);
	w->from = host->memory(s->run, ((size_t)w->n + 1) * sizeof *w->from);
	if (!w->count || !w->block || !w->list || !w->from) return QUERN_E_MEMORY;
	host->parallel(s->run, w->tasks, count_points, w);
	add_up(w);
	host->parallel(s->run, w->tasks, list_points, w);
	host->parallel(s->run, n_blocks, order_block, w);
	const quern_status sorted = host->remap(s->run, "point", w->n, w->from, n_blocks, w->block);
	return sorted == QUERN_OK ? host->arrange(s->run, "point", w->g->by_place) : sorted;
}

quern_status quern_cover_sort(const quern_step *s, const cover *wanted) {
	const quern_host *host = s->host;
	work w = { .s = s, .g = host->grid(s->run), .c = wanted, .n = host->set(s->run, "point").n };
	w.tasks = host->workers(s->run);
	w.key = host->memory(s->run, ((size_t)w.n + 1) * sizeof *w.key);
	w.place = host->memory(s->run, (size_t)w.n + 1);
	w.seen = host->memory(s->run, (size_t)w.tasks * w.g->n_blocks + 1);
	w.strays = host->memory(s->run, w.tasks * sizeof *w.strays);
	w.out = host->memory(s->run, w.tasks);
	if (!w.key || !w.place || !w.seen || !w.strays || !w.out) return QUERN_E_MEMORY;
	host->parallel(s->run, w.tasks, find_points, &w);
	if (any(w.out, w.tasks)) return name_lost(&w);
	host->parallel(s->run, w.tasks, find_grains, &w);
	const quern_status status = cover_material(&w);
	w.g = host->grid(s->run);
	return status == QUERN_OK ? order_points(&w) : status;
}
