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
/* Crowding that is more comes of what waits for room. */
static const quern_real most_told = 1.2;

static quern_real crowding_of(const update *d, uint32_t block, const int32_t cell[3]) {
	const quern_grid_view *g = d->g;
	quern_grid_cursor home = { .block = (int32_t)block };
	const int depth = g->dim == 3 ? 1 : 0;
	quern_real holds = 0, room = 0;
	memcpy(home.at, g->at[block], sizeof home.at);
	for (int z = -depth; z <= depth; z++)
		for (int y = -1; y <= 1; y++)
			for (int x = -1; x <= 1; x++) {
				const int step[3] = { x, y, z };
				int32_t at[3] = { 0 };
				bool beyond = false;
				for (uint32_t k = 0; k < g->dim; k++) {
					at[k] = cell[k] + step[k];
					beyond = beyond || (!g->periodic[k] && (at[k] < 0 || at[k] >= g->cells[k]));
				}
				quern_grid_cursor near = home;
				const int32_t c =
					beyond || !quern_grid_bring_back(g, at) ? -1 : quern_grid_entry_near(g, &near, at);
				if (!beyond) room += d->full * (c >= 0 ? d->open[c] : 1);
				if (c >= 0) holds += cell_holds(d, (uint32_t)c);
			}
	return room > 0 ? holds / room : 0;
}

/* ---- what is full ---- */

/* Whether material is all around a cell, two cells far: its surface, or spray, says nothing of how densely it lies. What is beyond a face, or behind the surface of
 * a body, does not count. */
static bool is_within(const update *d, uint32_t block, uint32_t c) {
	const quern_grid_view *g = d->g;
	quern_grid_cursor home = { .block = (int32_t)block };
	const int depth = g->dim == 3 ? FAR : 0;
	int32_t cell[3];
	if (!(d->mass[c] > 0) || d->open[c] < 1 || !quern_grid_cell_of(g, c, cell)) return false;
	memcpy(home.at, g->at[block], sizeof home.at);
	for (int z = -depth; z <= depth; z++)
		for (int y = -FAR; y <= FAR; y++)
			for (int x = -FAR; x <= FAR; x++) {
				int32_t at[3] = { cell[0] + x, cell[1] + y, cell[2] + z };
				quern_grid_cursor near = home;
				if (!quern_grid_bring_back(g, at)) continue;
				const int32_t i = quern_grid_entry_near(g, &near, at);
				if (i < 0 || (d->open[i] > least_open && !(d->mass[i] > 0))) return false;
			}
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
	sum->crowding += fmin(d->u[U_CROWDING].real[0][c], most_told);
}

/* Where sand moves or falls it may be looser than it will be: then no less than the continuum without stress, and as long as there is little continuum the densest that all
 * of it has been. */
static void set_full(const update *d, const bulk *continuum, const bulk *all) {
	quern_real *full = d->u[U_FULL].real[0];
	const bool known = continuum->bed.cells >= ENOUGH, first = !(*full > 0);
	const bulk *found = known ? continuum : all;
	const quern_real mean = found->bed.cells >= ENOUGH ? found->crowding / found->bed.cells : 1;
	*full = known && first && quern_hybrid_is_at_rest(d, &found->bed) ? mean : fmax(1, fmax(*full, mean));
	d->u[U_FULL_RISING].index[0] = !known;
}

/* Grains settle more densely or more loosely than the scene's continuum: what they were like when there first was one is full. */
static quern_status measure_full(const update *d) {
	bulk continuum = { .crowding = 0 }, all = { .crowding = 0 };
	looking w = { d, d->s->host->memory(d->s->run, (size_t)d->n_cells + 1) };
	bool any = false;
	for (uint32_t c = 0; c < d->n_cells; c++) any = any || is_continuum(d, c);
	if (!any) return QUERN_OK;
	if (!w.within) return QUERN_E_MEMORY;
	d->s->host->parallel(d->s->run, d->g->n_blocks, look_at_block, &w);
	for (uint32_t q = 0; q < d->n_cells; q++) {
		const uint32_t c = nth_cell(d, q);
		if (!w.within[c]) continue;
		add_to_bulk(d, c, &all);
		if (is_continuum(d, c)) add_to_bulk(d, c, &continuum);
	}
	set_full(d, &continuum, &all);
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
	const bool asked = !(d->u[U_FULL].real[0][0] > 0) || d->u[U_FULL_RISING].index[0];
	return asked ? measure_full(d) : QUERN_OK;
}
