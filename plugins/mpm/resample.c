/* SPDX-License-Identifier: MIT */
/* resample - as many points in a cell as there were: where the material stretches holes are filled, where it crowds points join.
 * docs/theory/mpm.md, section 9 */
#include "../common/resample.h"
#include "../common/cover.h"
#include "../common/sort.h"
#include "mpm.h"
#include <stdlib.h>
#include <string.h>

/* Cells with less than half of the points that they had at first, and with more than twice as many, are looked after: a lattice that flows scatters by
 * one or two points a cell, which is nothing that has to be mended. */
enum { MOST_OVER_WANTED = 2 };

static uint32_t wanted_in(const mpm *p) {
	uint32_t n = 1;
	for (uint32_t k = 0; k < p->dim; k++) n *= (uint32_t)p->points;
	return n;
}

/* Whoever is in which cell; NULL without memory. */
static bool list_points(resample *r, uint32_t n) {
	const quern_step *s = r->s;
	const uint32_t n_cells = r->g->n_blocks * QUERN_BLOCK_CELLS;
	int32_t *cell_of = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	uint32_t *begin = s->host->memory(s->run, ((size_t)n_cells + 2) * sizeof(uint32_t));
	int32_t *point = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	r->drop = s->host->memory(s->run, ((size_t)n + 1) * sizeof(bool));
	if (!cell_of || !begin || !point || !r->drop) return false;
	quern_grid_cursor last = { .block = -1 };
	for (uint32_t i = 0; i < n; i++) {
		quern_real at[3];
		int32_t cell[3];
		quern_grid_position(r->g, r->position->real, i, at);
		quern_grid_cell_inside(r->g, at, cell);
		cell_of[i] = quern_grid_entry_near(r->g, &last, cell);
	}
	quern_bucket(n, cell_of, s->host->parts(s->run, "point")->entry, n_cells, begin, point);
	r->begin = begin, r->point = point;
	return true;
}

static uint32_t count_in(const resample *r, uint32_t c) { return r->begin[c + 1] - r->begin[c]; }

/* Of the room of the cells around it, within the domain, what their points claim from which on a cell is within the material: a surface, and the gap between
 * two bodies, are not. */
static const quern_real claimed = 0.75;

static bool is_inside(const resample *r, const quern_real *room, uint32_t c) {
	quern_real all = 0, held = 0;
	int32_t cell[3];
	quern_grid_cell_of(r->g, c, cell);
	for (int around = 0; around < (r->s->dim == 2 ? 9 : 27); around++) {
		int32_t beside[3] = { cell[0] + around % 3 - 1, cell[1] + around / 3 % 3 - 1,
			cell[2] + (r->s->dim == 3 ? around / 9 - 1 : 0) };
		if (!quern_grid_bring_back(r->g, beside)) continue;
		const int32_t entry = quern_grid_entry_back(r->g, beside);
		all += quern_grid_cell_volume(r->g);
		held += entry < 0 ? 0 : room[entry];
	}
	return held > claimed * all;
}

/* m^3, of the points in a cell. */
static void add_room(const resample *r, uint32_t n_cells, quern_real *room) {
	for (uint32_t c = 0; c < n_cells; c++)
		for (uint32_t q = r->begin[c]; q < r->begin[c + 1]; q++) room[c] += r->volume->real[0][r->point[q]];
}

/* The cell beside it that has most points, and as many as these; -1: none has. */
static int32_t richest_beside(const resample *r, uint32_t c, uint32_t least) {
	int32_t cell[3], best = -1;
	quern_grid_cell_of(r->g, c, cell);
	for (uint32_t k = 0; k < 2 * r->s->dim; k++) {
		int32_t beside[3] = { cell[0], cell[1], cell[2] };
		beside[k / 2] += k % 2 ? 1 : -1;
		if (!quern_grid_bring_back(r->g, beside)) continue;
		const int32_t entry = quern_grid_entry_back(r->g, beside);
		if (entry < 0 || count_in(r, (uint32_t)entry) < least) continue;
		if (best < 0 || count_in(r, (uint32_t)entry) > count_in(r, (uint32_t)best)) best = entry;
	}
	return best;
}

typedef struct looking {
	resample *r;
	const body_pose *pose;
	const quern_real *room; /* m^3 by cell, claimed by its points */
	uint32_t wanted;
	bool *gave; /* by cell: in this look, once at most: what its points have is not what it was */
} looking;

/* Whether a body cuts the cell: points that make room in it could end up there. */
static bool is_cut(const looking *w, const int32_t cell[3]) {
	const quern_step *s = w->r->s;
	const quern_grid_view *g = w->r->g;
	quern_real x[3];
	for (uint32_t k = 0; k < 3; k++) x[k] = k < s->dim ? g->lower[k] + (cell[k] + 0.5) * g->cell : 0;
	for (uint32_t b = 0; b < s->n_slot[SLOT_BODIES]; b++) {
		const quern_bound *body = &s->slot[SLOT_BODIES][b];
		const body_item *item = body->item;
		if (quern_body_meets_points(body, s->settling) &&
			quern_body_gap(body, &w->pose[b], s->dim, x, item->displacement, NULL) < 0.499 * g->cell)
			return true;
	}
	return false;
}

static void fill(const looking *w, uint32_t c, const int32_t cell[3]) {
	const int32_t from = count_in(w->r, c) ? (int32_t)c : richest_beside(w->r, c, (w->wanted + 1) / 2);
	int32_t other[3];
	if (from < 0 || w->gave[from] || is_cut(w, cell)) return;
	quern_grid_cell_of(w->r->g, (uint32_t)from, other);
	if (!is_cut(w, other))
		w->gave[from] = quern_resample_fill(w->r, (uint32_t)from, from == (int32_t)c ? -1 : (int32_t)c);
}

static void look_at(const looking *w, uint32_t c) {
	const uint32_t n = count_in(w->r, c);
	int32_t cell[3];
	if (!quern_grid_cell_of(w->r->g, c, cell)) return;
	if (2 * n < w->wanted && is_inside(w->r, w->room, c)) fill(w, c, cell);
	else if (n > MOST_OVER_WANTED * w->wanted && !w->gave[c]) {
		quern_resample_join(w->r, c);
		w->gave[c] = true;
	}
}

static quern_status look(const mpm *p, resample *r) {
	const uint32_t n_cells = r->g->n_blocks * QUERN_BLOCK_CELLS;
	bool *gave = r->s->host->memory(r->s->run, ((size_t)n_cells + 1) * sizeof(bool));
	quern_real *room = r->s->host->memory(r->s->run, ((size_t)n_cells + 1) * sizeof(quern_real));
	const looking w = { r, quern_body_poses_now(r->s, SLOT_BODIES), room, wanted_in(p), gave };
	if (!gave || !room || !w.pose) return QUERN_E_MEMORY;
	add_room(r, n_cells, room);
	for (uint32_t q = 0; q < n_cells; q++) look_at(&w, quern_grid_nth(r->g, q));
	return r->failed ? QUERN_E_MEMORY : QUERN_OK;
}

quern_status quern_mpm_resample(const void *self, const quern_step *s) {
	const mpm *p = self;
	const quern_column *u = s->use;
	const uint32_t n = s->host->set(s->run, "point").n;
	/* steps are counted through all stages of the scene; that which begins one is left out */
	if (!p->resample || !n || s->step == s->stage_step || (s->step + 1) % p->resample) return QUERN_OK;
	const cover c = { .point = u[RESAMPLE_POSITION], .grain = { .real = { NULL } } };
	quern_status status = quern_cover_sort(s, &c);
	if (status != QUERN_OK) return status;
	resample r = { .s = s,
		.g = s->host->grid(s->run),
		.position = &u[RESAMPLE_POSITION],
		.velocity = &u[RESAMPLE_VELOCITY],
		.mass = &u[RESAMPLE_MASS],
		.volume = &u[RESAMPLE_VOLUME],
		.stress = &u[RESAMPLE_STRESS],
		.weight = &u[RESAMPLE_WEIGHT] };
	r.nominal = p->density * quern_grid_cell_volume(r.g) / wanted_in(p);
	status = list_points(&r, n) ? look(p, &r) : QUERN_E_MEMORY;
	if (status == QUERN_OK) status = quern_resample_apply(&r);
	u[RESAMPLE_UNSORTED].index[0] = 1;
	free(r.made);
	return status;
}
