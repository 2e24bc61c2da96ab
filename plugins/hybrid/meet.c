/* SPDX-License-Identifier: MIT */
#include "meet.h"
#include "../common/sort.h"

/* A grain that has left the grid, or never was on it, meets no continuum. */
static int32_t block_of(
	const quern_grid_view *g, quern_real *const x[3], uint32_t i, quern_grid_cursor *last) {
	quern_real at[3];
	int32_t cell[3];
	quern_grid_position(g, x, i, at);
	if (!quern_grid_cell_at(g, at, cell)) return -1;
	const int32_t entry = quern_grid_entry_near(g, last, cell);
	return entry < 0 ? -1 : entry / QUERN_BLOCK_CELLS;
}

bool quern_hybrid_residents(
	const quern_step *s, const quern_column *position, const int32_t *fixed, residents *r) {
	const quern_grid_view *g = s->host->grid(s->run);
	const uint32_t n = s->host->set(s->run, "grain").n;
	int32_t *block = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	r->begin = s->host->memory(s->run, ((size_t)g->n_blocks + 2) * sizeof(uint32_t));
	r->grain = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	if (!block || !r->begin || !r->grain) return false;
	quern_grid_cursor last = { .block = -1 };
	for (uint32_t i = 0; i < n; i++)
		block[i] = fixed && fixed[i] ? -1 : block_of(g, position->real, i, &last);
	quern_bucket(n, block, s->host->parts(s->run, "grain")->entry, g->n_blocks, r->begin, r->grain);
	return true;
}
