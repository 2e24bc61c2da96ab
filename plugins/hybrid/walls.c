/* SPDX-License-Identifier: MIT */
/* walls - bodies as cells see them, with the continuum's surface: how far the nearest one is, how much of a cell is open, and what
 * stands between two cells. docs/theory/hybrid.md, section 3 */
#include "update.h"
#include <math.h>
#include <string.h>

enum { N = QUERN_BLOCK_CELLS }; /* cells of a block, and places in a cell */

typedef struct {
	_Alignas(64) quern_real position[3][N], own[3][N], radius[N], gap[N], normal[3][N], velocity[3][N],
		least[N];
	bool displaced[N]; /* whether the nearest body has its surface before it */
} places;

/* Gap of every place to the nearest body that is meant and there now; infinite where there is none. */
static void nearest_bodies(const update *d, const bool *meant, places *p) {
	quern_body_batch batch = { .n = N, .cap = N, .dim = d->s->dim, .radius = p->radius, .gap = p->gap };
	for (uint32_t k = 0; k < d->s->dim; k++) {
		batch.normal[k] = p->normal[k];
		batch.velocity[k] = p->velocity[k];
	}
	for (uint32_t i = 0; i < N; i++) p->least[i] = INFINITY, p->displaced[i] = false;
	for (uint32_t b = 0; b < d->s->n_slot[SLOT_BODIES]; b++) {
		const quern_bound *body = &d->s->slot[SLOT_BODIES][b];
		if (!quern_body_is_there(body, d->s->settling) || (meant && !meant[b])) continue;
		batch.pose = &d->pose[b].pose;
		quern_motion_bring_all(&d->pose[b], d->s->dim, N,
			(const quern_real *const[3]) { p->position[0], p->position[1], p->position[2] },
			(quern_real *const[3]) { p->own[0], p->own[1], p->own[2] });
		for (uint32_t k = 0; k < d->s->dim; k++) batch.position[k] = p->own[k];
		const quern_real out = ((const body_item *)body->item)->displacement;
		for (uint32_t i = 0; i < N; i++) p->radius[i] = out;
		((const quern_body_ops *)body->ops)->closest(body->self, &batch);
		for (uint32_t i = 0; i < N; i++) {
			if (!(p->gap[i] < p->least[i])) continue;
			p->least[i] = p->gap[i];
			p->displaced[i] = out > 0;
		}
	}
}

/* The share of a cell that lies in no body, by 8 x 8 or 4 x 4 x 4 places. Before a displaced surface, a small part of a cell away from the body's own, each
 * stands for a cube around it, which is exact for a plane across an axis; plates and seams between bodies have no such thing. */
static quern_real open_share(const update *d, const int32_t cell[3], places *p, bool *displaced) {
	const uint32_t dim = d->s->dim, side = dim == 2 ? 8 : 4;
	const quern_real apart = d->g->cell / side, rounding = 1e-9;
	quern_real open = 0;
	for (uint32_t i = 0; i < N; i++) {
		const uint32_t at[3] = { i % side, i / side % side, i / (side * side) };
		for (uint32_t k = 0; k < dim; k++)
			p->position[k][i] = d->g->lower[k] + (cell[k] + (at[k] + 0.5) / side) * d->g->cell;
	}
	nearest_bodies(d, NULL, p);
	*displaced = false;
	for (uint32_t i = 0; i < N; i++) {
		const quern_real part = p->displaced[i] ? 0.5 + p->least[i] / apart : p->least[i] >= 0;
		open += part >= 1 ? 1 : part > 0 ? part : 0;
		*displaced = *displaced || (part < 1 - rounding && p->displaced[i]);
	}
	return open < N * rounding ? 0 : open > N - N * rounding ? 1 : open / N;
}

/* Of the centres of block b's cells. */
static void gaps_of_block(const update *d, const bool *meant, uint32_t b, places *p, quern_real *gap) {
	int32_t cell[3];
	for (uint32_t i = 0; i < N; i++) {
		quern_real x[3];
		quern_grid_cell_of(d->g, b * N + i, cell);
		quern_hybrid_centre(d, cell, x);
		for (uint32_t k = 0; k < d->s->dim; k++) p->position[k][i] = x[k];
	}
	nearest_bodies(d, meant, p);
	for (uint32_t i = 0; i < N; i++) gap[i] = p->least[i];
}

typedef struct {
	const update *d;
	const bool *meant;
	quern_real *gap;
	bool *failed; /* by block */
} measuring;

static void measure_block(void *arg, uint32_t b, uint32_t worker) {
	const measuring *w = arg;
	places *p = w->d->s->host->scratch(w->d->s->run, worker, sizeof *p);
	w->failed[b] = !p;
	if (p) gaps_of_block(w->d, w->meant, b, p, w->gap + (size_t)b * N);
}

static void open_block(void *arg, uint32_t b, uint32_t worker) {
	const measuring *w = arg;
	const update *d = w->d;
	const quern_real reach = 0.5 * sqrt(d->s->dim) * d->g->cell, *gap = w->gap + (size_t)b * N;
	places *p = d->s->host->scratch(d->s->run, worker, sizeof *p);
	quern_real *open = d->open + (size_t)b * N;
	bool *displaced = d->displaced + (size_t)b * N;
	int32_t cell[3];
	w->failed[b] = !p;
	for (uint32_t i = 0; i < N && p; i++) {
		open[i] = gap[i] > 0 ? 1 : 0;
		if (fabs(gap[i]) < reach && quern_grid_cell_of(d->g, b * N + i, cell))
			open[i] = open_share(d, cell, p, &displaced[i]);
	}
}

static quern_status each_block(const measuring *w, void (*task)(void *, uint32_t, uint32_t)) {
	const quern_step *s = w->d->s;
	measuring own = *w;
	own.failed = s->host->memory(s->run, (size_t)own.d->g->n_blocks + 1);
	if (!own.failed) return QUERN_E_MEMORY;
	s->host->parallel(s->run, own.d->g->n_blocks, task, &own);
	for (uint32_t b = 0; b < own.d->g->n_blocks; b++)
		if (own.failed[b]) return QUERN_E_MEMORY;
	return QUERN_OK;
}

quern_status quern_hybrid_gaps(const update *d, const bool *meant, quern_real *gap) {
	return each_block(&(measuring) { .d = d, .meant = meant, .gap = gap }, measure_block);
}

quern_status quern_hybrid_walls(update *d) {
	const measuring w = { .d = d, .gap = d->wall };
	const quern_status status = each_block(&w, measure_block);
	return status == QUERN_OK ? each_block(&w, open_block) : status;
}

/* Gap of a place to the nearest body that is meant and there now, and that one's normal if it is asked for: to where the continuum ends before it,
 * or `bare`, to the body itself. */
static quern_real gap_at(
	const update *d, const bool *meant, const quern_real x[3], bool bare, quern_real normal[3]) {
	quern_real least = INFINITY;
	for (uint32_t b = 0; b < d->s->n_slot[SLOT_BODIES]; b++) {
		const quern_bound *body = &d->s->slot[SLOT_BODIES][b];
		quern_real n[3] = { 0 };
		if (!quern_body_is_there(body, d->s->settling) || (meant && !meant[b])) continue;
		const quern_real out = bare ? 0 : ((const body_item *)body->item)->displacement,
						 gap = quern_body_gap(body, &d->pose[b], d->s->dim, x, out, normal ? n : NULL);
		if (!(gap < least)) continue;
		least = gap;
		if (normal) memcpy(normal, n, sizeof n);
	}
	return least;
}

/* Of a cell's size: from so far before a surface on, a place is in the open. */
static const quern_real clear = 0.1;

/* Out of one body it may come into another, so it is tried a few times. */
void quern_hybrid_open_place(const update *d, uint32_t c, const int32_t cell[3], quern_real x[3]) {
	quern_hybrid_centre(d, cell, x);
	for (int tries = 0; tries < 4 && d->wall[c] < clear * d->g->cell; tries++) {
		quern_real normal[3] = { 0 };
		const quern_real out = clear * d->g->cell - gap_at(d, NULL, x, false, normal);
		if (!(out > 0)) return;
		for (uint32_t k = 0; k < d->s->dim; k++) x[k] += out * normal[k];
	}
}

/* How far from a place no body can be, from what a cell's centre knows. */
static quern_real free_way(const update *d, uint32_t entry, const quern_real x[3]) {
	int32_t cell[3];
	quern_real centre[3], aside = 0;
	if (!quern_grid_cell_of(d->g, entry, cell)) return 0;
	quern_hybrid_centre(d, cell, centre);
	for (uint32_t k = 0; k < d->s->dim; k++) aside += (x[k] - centre[k]) * (x[k] - centre[k]);
	return fmax(d->wall[entry] - sqrt(aside), 0);
}

/* Goes along the line by steps as long as nothing can be in the way, so that no wall is too thin. */
static bool is_walled(const update *d, const bool *meant, uint32_t entry, const quern_real from[3],
	const quern_real to[3], bool bare) {
	const quern_real near = 1e-6 * d->g->cell;
	quern_real length = 0, way;
	if (d->wall[entry] >= 2 * d->g->cell) return false; /* within a cell, or from centre to centre */
	for (uint32_t k = 0; k < d->s->dim; k++) length += (to[k] - from[k]) * (to[k] - from[k]);
	length = sqrt(length);
	way = free_way(d, entry, from);
	if (way <= near) way = 0;
	for (int i = 0; i < 64 && way < length; i++) {
		quern_real x[3] = { 0 };
		for (uint32_t k = 0; k < d->s->dim; k++) x[k] = from[k] + way / length * (to[k] - from[k]);
		const quern_real gap = gap_at(d, meant, x, bare, NULL);
		if (gap <= near) return true;
		way += gap;
	}
	return false;
}

bool quern_hybrid_walled(
	const update *d, const bool *meant, uint32_t entry, const quern_real from[3], const quern_real to[3]) {
	return is_walled(d, meant, entry, from, to, false);
}

/* Whether x is seen from particle i; one that lies in a body itself, as points may, sees nothing and does not count. */
static bool seen_from(
	const update *d, uint32_t c, const quern_real x[3], quern_real *const *all, int32_t i, bool *any) {
	const quern_images images = quern_grid_images(d->g);
	quern_real from[3] = { 0 };
	for (uint32_t k = 0; k < d->s->dim; k++)
		from[k] = quern_image_at(all[k][i], x[k], images.half[k], images.length[k]);
	if (gap_at(d, NULL, from, true, NULL) <= 1e-6 * d->g->cell) return false;
	*any = true;
	return !is_walled(d, NULL, c, from, x, true);
}

bool quern_hybrid_seen(const update *d, uint32_t c, const quern_real x[3]) {
	const uint32_t *begin[2] = { d->grain_begin, d->point_begin };
	const int32_t *of[2] = { d->grain, d->point };
	quern_real *const *at[2] = { d->u[U_GRAIN_POSITION].real, d->u[U_POINT_POSITION].real };
	bool any = false;
	if (d->wall[c] >= 0.5 * sqrt(d->s->dim) * d->g->cell) return true;
	for (int which = 0; which < 2; which++)
		for (uint32_t q = begin[which][c]; q < begin[which][c + 1]; q++)
			if (seen_from(d, c, x, at[which], of[which][q], &any)) return true;
	return !any;
}
