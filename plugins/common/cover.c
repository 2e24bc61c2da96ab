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

static quern_status cover_material(const quern_step *s, const cover *c, uint32_t n_points) {
	const quern_grid_view *g = s->host->grid(s->run);
	const uint32_t n_grains = c->grain.real[0] ? c->n_grains : 0, n = n_points + n_grains;
	uint64_t *key = s->host->memory(s->run, ((size_t)n + 1) * sizeof(uint64_t));
	uint64_t *sorted = s->host->memory(s->run, ((size_t)n + 1) * sizeof(uint64_t));
	uint64_t *work = s->host->memory(s->run, quern_sort_bytes(n));
	int32_t *from = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t)), (*block)[3];
	block = s->host->memory(s->run, ((size_t)n + g->n_blocks + 1) * sizeof *block);
	if (!key || !sorted || !work || !from || !block) return QUERN_E_MEMORY;
	uint32_t m = 0, place;
	for (uint32_t i = 0; i < n_points; i++) key[m++] = block_key(g, c->point.real, i, &place);
	for (uint32_t i = 0; i < n_grains; i++) {
		bool inside = true; /* fixed grains may lie below the floor */
		for (uint32_t k = 0; k < s->dim; k++)
			inside = inside && (s->periodic[k] || (c->grain.real[k][i] >= s->lower[k] &&
													  c->grain.real[k][i] <= s->upper[k]));
		if (inside) key[m++] = block_key(g, c->grain.real, i, &place);
	}
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
	quern_status status = bring_back(s, g, wanted, n);
	if (status == QUERN_OK) status = cover_material(s, wanted, n);
	if (status != QUERN_OK) return status;
	g = s->host->grid(s->run);
	uint64_t *key = s->host->memory(s->run, ((size_t)n + 1) * sizeof(uint64_t));
	uint64_t *work = s->host->memory(s->run, quern_sort_bytes(n));
	int32_t *from = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	uint32_t *block = s->host->memory(s->run, ((size_t)g->n_blocks + 2) * sizeof(uint32_t));
	if (!key || !work || !from || !block) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) {
		uint32_t place;
		const uint64_t coarse = block_key(g, wanted->point.real, i, &place);
		const int32_t at[3] = { (int32_t)(coarse & 0xfffff), (int32_t)(coarse >> 20 & 0xfffff),
			(int32_t)(coarse >> 40) };
		const int32_t b = quern_grid_block(g, at);
		key[i] = (uint64_t)b * QUERN_BLOCK_CELLS + place;
		block[b + 1]++;
	}
	for (uint32_t b = 0; b < g->n_blocks; b++) block[b + 1] += block[b];
	quern_sort_order(n, key, s->host->parts(s->run, "point")->entry, from, work);
	const quern_status sorted = s->host->remap(s->run, "point", n, from, g->n_blocks, block);
	return sorted == QUERN_OK ? s->host->arrange(s->run, "point", g->by_place) : sorted;
}
