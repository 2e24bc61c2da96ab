/* SPDX-License-Identifier: MIT */
/* crowding - how full the neighbourhood of a cell is, of both clouds and of what is owed, and how full the cell itself is now. The latter varies by a fifth
 * with the grains that happen to lie there; for the former cells around it and updates before count too. docs/theory/hybrid.md, section 5 */
#include "update.h"
#include <math.h>
#include <string.h>

enum {
	N = QUERN_BLOCK_CELLS,
	FAR = 2,     /* cells */
	ENOUGH = 30, /* cells; one by itself is off by some percent */
};

/* A cell that bodies leave less of has too little in it to be measured. */
static const quern_real least_open = 0.5;

/* Entry of the cell that lies `step` from one of that block, -1 for none; false beyond a face. */
static bool find_around(
	const update *d, uint32_t block, const int32_t cell[3], const int step[3], int32_t *entry) {
	quern_grid_cursor near = { .block = (int32_t)block };
	int32_t at[3] = { cell[0] + step[0], cell[1] + step[1], cell[2] + step[2] };
	if (!quern_grid_bring_back(d->g, at)) return false;
	memcpy(near.at, d->g->at[block], sizeof near.at);
	*entry = quern_grid_entry_near(d->g, &near, at);
	return true;
}

static quern_real crowding_of(const update *d, uint32_t block, const int32_t cell[3]) {
	const int depth = d->s->dim == 3 ? 1 : 0;
	quern_real holds = 0, room = 0;
	for (int z = -depth; z <= depth; z++)
		for (int y = -1; y <= 1; y++)
			for (int x = -1; x <= 1; x++) {
				int32_t c;
				if (!find_around(d, block, cell, (int[3]) { x, y, z }, &c)) continue;
				room += d->full * (c >= 0 ? d->open[c] : 1);
				if (c >= 0) holds += cell_holds(d, (uint32_t)c);
			}
	return room > 0 ? holds / room : 0;
}

/* ---- what is full ---- */

/* Whether material is all around a cell, two cells far: its surface, or spray, says nothing of how densely it lies. What is beyond a face, or behind the surface of
 * a body, does not count. */
static bool is_within(const update *d, uint32_t block, uint32_t c) {
	const int depth = d->s->dim == 3 ? FAR : 0;
	int32_t cell[3], i;
	if (!(d->mass[c] > 0) || d->open[c] < 1 || !quern_grid_cell_of(d->g, c, cell)) return false;
	for (int z = -depth; z <= depth; z++)
		for (int y = -FAR; y <= FAR; y++)
			for (int x = -FAR; x <= FAR; x++)
				if (find_around(d, block, cell, (int[3]) { x, y, z }, &i) &&
					(i < 0 || (d->open[i] > least_open && !(d->mass[i] > 0))))
					return false;
	return true;
}

typedef struct {
	const update *d;
	bool *within; /* by cell */
} looking;

static void look_at_block(void *arg, uint32_t b, uint32_t worker) {
	const looking *w = arg;
	(void)worker;
	for (uint32_t c = b * N; c < (b + 1) * N; c++) w->within[c] = is_within(w->d, b, c);
}

static bool is_continuum(const update *d, uint32_t c) {
	return d->zone[c] == QUERN_CONTINUUM && d->mass[c] > 0;
}

typedef struct {
	bed bed;
	quern_real crowding; /* sum over its cells */
} bulk;

static void add_to_bulk(const update *d, uint32_t c, bulk *sum) {
	quern_hybrid_add_to_bed(d, c, &sum->bed);
	sum->crowding += d->u[U_CROWDING].real[0][c];
}

/* Sand that moves or falls, and a few cells, do not say how densely sand has settled: then it is the continuum without stress. */
static quern_real full_of(const update *d, const bulk *found) {
	const bool settled = found->bed.cells >= ENOUGH && quern_hybrid_is_at_rest(d, &found->bed);
	return settled ? found->crowding / found->bed.cells : 1;
}

/* Grains settle more densely or more loosely than the scene's continuum: what they were like when there first was one is full. Where that is of few cells, of one splash
 * perhaps, all that lies within the material are asked. */
static quern_status measure_full(const update *d) {
	bulk continuum = { .crowding = 0 }, all = { .crowding = 0 };
	bool any = false;
	for (uint32_t c = 0; c < d->n_cells; c++) any = any || is_continuum(d, c);
	if (!any) return QUERN_OK;
	looking w = { d, d->s->host->memory(d->s->run, (size_t)d->n_cells + 1) };
	if (!w.within) return QUERN_E_MEMORY;
	d->s->host->parallel(d->s->run, d->g->n_blocks, look_at_block, &w);
	for (uint32_t q = 0; q < d->n_cells; q++) {
		const uint32_t c = nth_cell(d, q);
		if (!w.within[c]) continue;
		add_to_bulk(d, c, &all);
		if (is_continuum(d, c)) add_to_bulk(d, c, &continuum);
	}
	d->u[U_FULL].real[0][0] = full_of(d, continuum.bed.cells >= ENOUGH ? &continuum : &all);
	return QUERN_OK;
}

static void crowd_block(void *arg, uint32_t b, uint32_t worker) {
	const update *d = arg;
	quern_real *crowding = d->u[U_CROWDING].real[0], *fullness = d->u[U_FULLNESS].real[0];
	(void)worker;
	for (uint32_t c = b * N; c < (b + 1) * N; c++) {
		int32_t cell[3];
		if (!quern_grid_cell_of(d->g, c, cell)) continue;
		const quern_real now = crowding_of(d, b, cell);
		crowding[c] += (crowding[c] > 0 ? NEWEST : 1) * (now - crowding[c]);
		fullness[c] = d->open[c] > least_open ? cell_holds(d, c) / (d->full * d->open[c]) : 0;
	}
}

quern_status quern_hybrid_crowding(update *d) {
	d->s->host->parallel(d->s->run, d->g->n_blocks, crowd_block, d);
	return d->u[U_FULL].real[0][0] > 0 ? QUERN_OK : measure_full(d);
}
