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

enum { CHUNK = 4096 };

typedef struct {
	const quern_grid_view *g;
	const quern_column *position;
	const int32_t *fixed;
	int32_t *block; /* by grain */
	uint32_t n;
} finding;

static void find_chunk(void *arg, uint32_t chunk, uint32_t worker) {
	const finding *f = arg;
	const uint32_t begin = chunk * CHUNK, end = begin + CHUNK < f->n ? begin + CHUNK : f->n;
	quern_grid_cursor last = { .block = -1 };
	(void)worker;
	for (uint32_t i = begin; i < end; i++)
		f->block[i] = f->fixed && f->fixed[i] ? -1 : block_of(f->g, f->position->real, i, &last);
}

bool quern_hybrid_residents(
	const quern_step *s, const quern_column *position, const int32_t *fixed, residents *r) {
	const quern_grid_view *g = s->host->grid(s->run);
	const uint32_t n = s->host->set(s->run, "grain").n;
	int32_t *block = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	r->begin = s->host->memory(s->run, ((size_t)g->n_blocks + 2) * sizeof(uint32_t));
	r->grain = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	if (!block || !r->begin || !r->grain) return false;
	finding f = { g, position, fixed, block, n };
	s->host->parallel(s->run, (n + CHUNK - 1) / CHUNK, find_chunk, &f);
	quern_bucket(n, block, s->host->parts(s->run, "grain")->entry, g->n_blocks, r->begin, r->grain);
	return true;
}
