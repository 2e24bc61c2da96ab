/* SPDX-License-Identifier: MIT */
#include "cover.h"
#include "sort.h"
#include "tools.h"
#include <string.h>

static quern_status bring_back(const quern_step *s, const quern_grid_view *g, const cover *c, uint32_t n) {
	for (uint32_t k = 0; k < s->dim; k++) {
		quern_real *x = c->point.real[k];
		const quern_real lower = s->lower[k], upper = s->upper[k], slack = 1e-6 * g->cell;
		for (uint32_t i = 0; i < n; i++) {
			if (s->periodic[k]) x[i] = quern_brought_back(x[i], lower, upper);
			else if (!(x[i] >= lower - slack && x[i] <= upper + slack))
				return s->host->stop(s->run, QUERN_E_NUMERIC, "point", i,
					"left the domain along axis %u, at %.6g m: the step is too long or the material unstable",
					k, x[i]);
		}
	}
	return QUERN_OK;
}

/* Points on a wall belong to the cell inside; one that is farther out than round-off has left. */
static uint64_t block_key(const quern_grid_view *g, quern_real *const x[3], uint32_t i, uint32_t *place) {
	quern_real at[3];
	int32_t cell[3];
	uint64_t key = 0;
	*place = 0;
	quern_grid_position(g, x, i, at);
	quern_grid_cell_inside(g, at, cell);
	for (uint32_t k = g->dim; k-- > 0;) {
		key = key << 20 | (uint32_t)cell[k] / g->edge;
		*place = *place * g->edge + (uint32_t)cell[k] % g->edge;
	}
	return key;
}

/* Distinct blocks of sorted keys; 20 bits hold every block along an axis. */
static uint32_t list_blocks(const quern_grid_view *g, uint32_t n, const uint64_t *key, int32_t (*block)[3]) {
	uint32_t m = 0;
	for (uint32_t i = 0; i < n; i++) {
		if (i && key[i] == key[i - 1]) continue;
		for (uint32_t k = 0; k < 3; k++)
			block[m][k] = k < g->dim ? (int32_t)(key[i] >> (20 * k) & 0xfffff) : 0;
		m++;
	}
	return m;
}

/* ---- keys of many, on all threads ---- */

enum { CHUNK = 4096 };
static const uint64_t nowhere = UINT64_MAX;

typedef struct {
	const quern_step *s;
	const quern_grid_view *g;
	quern_real *const *x;
	uint32_t n;
	bool strict; /* what lies outside the domain has no block: fixed grains may be below the floor */
	uint64_t *key;
	uint8_t *place; /* NULL: not asked for */
} keying;

static bool is_inside(const keying *w, uint32_t i) {
	bool inside = true;
	for (uint32_t k = 0; k < w->s->dim; k++)
		inside =
			inside && (w->s->periodic[k] || (w->x[k][i] >= w->s->lower[k] && w->x[k][i] <= w->s->upper[k]));
	return inside;
}

static void key_chunk(void *arg, uint32_t chunk, uint32_t worker) {
	const keying *w = arg;
	const uint32_t begin = chunk * CHUNK, end = begin + CHUNK < w->n ? begin + CHUNK : w->n;
	(void)worker;
	for (uint32_t i = begin; i < end; i++) {
		uint32_t place = 0;
		w->key[i] = w->strict && !is_inside(w, i) ? nowhere : block_key(w->g, w->x, i, &place);
		if (w->place) w->place[i] = (uint8_t)place;
	}
}

static void find_keys(const keying *w) {
	w->s->host->parallel(w->s->run, (w->n + CHUNK - 1) / CHUNK, key_chunk, (void *)(uintptr_t)w);
}

/* ---- blocks to cover ---- */

/* Neighbours in a list mostly lie in one block: of such only the first counts. Returns how many are left. */
static uint32_t leave_out_repeats(uint32_t n, uint64_t *key) {
	uint32_t m = 0;
	for (uint32_t i = 0; i < n; i++)
		if (key[i] != nowhere && (!m || key[m - 1] != key[i])) key[m++] = key[i];
	return m;
}

static quern_status cover_material(
	const quern_step *s, const cover *c, uint32_t n_points, const uint64_t *of_points) {
	const quern_grid_view *g = s->host->grid(s->run);
	const uint32_t n_grains = c->grain.real[0] ? c->n_grains : 0, n = n_points + n_grains;
	uint64_t *key = s->host->memory(s->run, ((size_t)n + 1) * sizeof(uint64_t));
	if (!key) return QUERN_E_MEMORY;
	memcpy(key, of_points, n_points * sizeof(uint64_t));
	find_keys(&(keying) { s, g, c->grain.real, n_grains, true, key + n_points, NULL });
	const uint32_t m = leave_out_repeats(n, key);
	uint64_t *sorted = s->host->memory(s->run, ((size_t)m + 1) * sizeof(uint64_t));
	uint64_t *work = s->host->memory(s->run, quern_sort_bytes(m));
	int32_t *from = s->host->memory(s->run, ((size_t)m + 1) * sizeof(int32_t)), (*block)[3];
	block = s->host->memory(s->run, ((size_t)m + g->n_blocks + 1) * sizeof *block);
	if (!sorted || !work || !from || !block) return QUERN_E_MEMORY;
	quern_sort_order(m, key, NULL, from, work);
	for (uint32_t i = 0; i < m; i++) sorted[i] = key[from[i]];
	uint32_t blocks = list_blocks(g, m, sorted, block);
	for (uint32_t b = 0; c->holds && b < g->n_blocks; b++)
		if (g->asked[b] && c->holds(c->arg, b)) memcpy(block[blocks++], g->at[b], sizeof *block);
	return s->host->cover(s->run, blocks, (const int32_t(*)[3])block);
}

quern_status quern_cover_sort(const quern_step *s, const cover *wanted) {
	const uint32_t n = s->host->set(s->run, "point").n;
	const quern_grid_view *g = s->host->grid(s->run);
	uint64_t *key = s->host->memory(s->run, ((size_t)n + 1) * sizeof(uint64_t));
	uint8_t *place = s->host->memory(s->run, (size_t)n + 1);
	quern_status status = key && place ? bring_back(s, g, wanted, n) : QUERN_E_MEMORY;
	if (status != QUERN_OK) return status;
	find_keys(&(keying) { s, g, wanted->point.real, n, false, key, place });
	status = cover_material(s, wanted, n, key);
	if (status != QUERN_OK) return status;
	g = s->host->grid(s->run);
	uint64_t *work = s->host->memory(s->run, quern_sort_bytes(n));
	int32_t *from = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	uint32_t *block = s->host->memory(s->run, ((size_t)g->n_blocks + 2) * sizeof(uint32_t));
	if (!work || !from || !block) return QUERN_E_MEMORY;
	uint64_t last = nowhere;
	int32_t b = -1;
	for (uint32_t i = 0; i < n; i++) {
		const int32_t at[3] = { (int32_t)(key[i] & 0xfffff), (int32_t)(key[i] >> 20 & 0xfffff),
			(int32_t)(key[i] >> 40) };
		if (key[i] != last) b = quern_grid_block(g, at);
		last = key[i];
		key[i] = (uint64_t)b * QUERN_BLOCK_CELLS + place[i];
		block[b + 1]++;
	}
	for (uint32_t q = 0; q < g->n_blocks; q++) block[q + 1] += block[q];
	quern_sort_order(n, key, s->host->parts(s->run, "point")->entry, from, work);
	const quern_status sorted = s->host->remap(s->run, "point", n, from, g->n_blocks, block);
	return sorted == QUERN_OK ? s->host->arrange(s->run, "point", g->by_place) : sorted;
}
