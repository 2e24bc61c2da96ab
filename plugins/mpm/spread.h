/* SPDX-License-Identifier: MIT */
/* spread - points of a cell that is sheared are spread over its width. A flow gathers them in layers a cell apart, which no node sees, and where
 * they lie pressure and friction are off. docs/theory/mpm.md, section 8 */
#pragma once
#include "flow.h"
#include <math.h>
#include <quern/math.h>

/* Rows that their weight has pressed lie off the middle by some hundredths of a cell, and are spread all the same. */
static const quern_real pressed_off = 0.02;
/* Of a move: from wherever in a cell, a fifth of the way to its face is left. */
static const quern_real most_pull = 0.2;

/* How far along an axis a point (m from the grid's lower corner) is from the middle of its cell, in cells; the block's first cell is `begin`. Between sorts one
 * may be beyond its block's cells, and is in none of them: more than half. Beyond the end of a period narrower than a block, in a continuum alone, the last cell stands for the first. */
QUERN_INLINE quern_real spread_offset(quern_real position, quern_real cell, int32_t begin, quern_real edge) {
	const quern_real t = position / cell - begin;
	return ((t >= 0) & (t < edge)) ? t - quern_floor(t) - 0.5 : 1;
}

/* Mean square of the way from the middle, over that of what is everywhere alike (1/12): of points in the middles of equal parts, as at first. */
QUERN_INLINE quern_real spread_even(const gather_work *w) {
	const quern_real one = 1.0 / w->p->per_axis;
	return 1 - one * one;
}

/* One point's moments along each axis to the cells around it: sharp along that axis, and by hats around the middles of cells across, so that none
 * comes and goes where points pass from cell to cell. */
QUERN_INLINE void spread_send(const gather_work *w, quern_row *tile, uint32_t b, const quern_real place[3],
	quern_real mass, const int dim) {
	const quern_grid_view *g = w->g;
	const quern_real even = spread_even(w);
	uint32_t own[3] = { 0 }, to[3][2];
	quern_real off[3], part[3][2];
	for (int k = 0; k < dim; k++) {
		/* the tile begins a cell before the block */
		const quern_real t = place[k] / g->cell - g->at[b][k] * (int32_t)g->edge + 1;
		const int32_t here = t > 0 ? (int32_t)t : 0;
		own[k] = (uint32_t)here;
		off[k] = t - here - 0.5;
		stencil_cells(g, b, k, place[k], to[k], part[k]);
	}
	for (int k = 0; k < dim; k++)
		for (int corner = 0; corner < 1 << (dim - 1); corner++) {
			uint32_t node = 0;
			quern_real share = mass;
			for (int a = dim, across = dim - 1; a-- > 0;) {
				const int side = a == k ? 0 : corner >> --across & 1;
				node = node * g->span + (a == k ? own[k] : to[a][side]);
				share *= a == k ? 1 : part[a][side];
			}
			tile[node][2 * k] += share * off[k];
			tile[node][2 * k + 1] += share * (12 * off[k] * off[k] - even);
		}
}

static void spread_scatter(void *arg, uint32_t b, uint32_t next, uint32_t worker) {
	(void)next;
	const gather_work *w = arg;
	gather_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m || w->point[b] == w->point[b + 1]) return;
	memset(m->tile, 0, w->g->tile_size * sizeof(quern_row));
	for (uint32_t i = w->point[b]; i < w->point[b + 1]; i++) {
		quern_real place[3];
		for (uint32_t k = 0; k < w->s->dim; k++)
			place[k] = w->s->use[GATHER_POSITION].real[k][i] - w->g->lower[k];
		if (w->s->dim == 2) spread_send(w, m->tile, b, place, w->s->use[GATHER_MASS].real[0][i], 2);
		else spread_send(w, m->tile, b, place, w->s->use[GATHER_MASS].real[0][i], 3);
	}
	quern_tile_add(w->g, w->moment, b, m->tile);
}

QUERN_INLINE quern_real spread_beyond(quern_real mean) {
	return mean > pressed_off ? mean - pressed_off : mean < -pressed_off ? mean + pressed_off : 0;
}

static bool spread_measure(gather_work *w) {
	const size_t size = (size_t)w->g->n_blocks * QUERN_BLOCK_CELLS * sizeof(quern_row);
	w->moment = w->s->host->memory(w->s->run, size);
	if (!w->moment) return false;
	memset(w->moment, 0, size);
	w->pose = quern_body_poses_now(w->s, SLOT_BODIES);
	if (!w->pose) return false;
	stencil_by_colour(w->s, w->g, spread_scatter, w);
	return true;
}

static quern_real spread_gap(
	const gather_work *w, uint32_t j, const quern_real x[3], quern_real beyond, quern_real normal[3]) {
	const quern_bound *body = &w->s->slot[SLOT_BODIES][j];
	const quern_real displacement = ((const body_item *)body->item)->displacement;
	return quern_body_gap(body, &w->pose[j], w->s->dim, x, displacement + beyond, normal);
}

/* Points of a cell that a body cuts across an axis are off its middle, and have to be; where it cuts along no axis, or is thin, they are left alone. */
static void spread_cut_cell(
	const gather_work *w, gather_memory *m, uint32_t j, uint32_t c, const quern_real x[3]) {
	quern_real normal[3], deep[3] = { 0 };
	const quern_real half = 0.5 * w->g->cell, gap = spread_gap(w, j, x, 0, normal),
					 cut = 0.5 - gap / w->g->cell;
	bool across = false;
	if (!(cut > 1e-6)) return;
	for (uint32_t k = 0; k < w->s->dim; k++) deep[k] = x[k] - half * normal[k];
	const bool solid = fabs(spread_gap(w, j, deep, 0, NULL) - (gap - half)) < 1e-6 * half;
	for (uint32_t k = 0; k < w->s->dim; k++) {
		quern_real *share = &m->cut[k][normal[k] < 0][c];
		if (fabs(normal[k]) < 1 - 1e-9) continue;
		*share = fmax(*share, cut);
		across = solid;
	}
	m->inside[c] = across && cut < 1;
}

/* Where the mean of points in order is along an axis, over the mass of a whole cell, in cells from its middle. */
QUERN_INLINE quern_real spread_wanted(quern_real low, quern_real high) {
	return 0.5 * (low - high) * (1 - low - high);
}

static void spread_find_cut(const gather_work *w, gather_memory *m, uint32_t b) {
	const quern_grid_view *g = w->g;
	memset(m->cut, 0, sizeof m->cut);
	for (uint32_t j = 0; j < w->s->n_slot[SLOT_BODIES]; j++) {
		quern_real x[3] = { 0 };
		if (!quern_body_meets_points(&w->s->slot[SLOT_BODIES][j], w->s->settling)) continue;
		quern_grid_corner(g, b * QUERN_BLOCK_CELLS, x);
		for (uint32_t k = 0; k < w->s->dim; k++) x[k] += 0.5 * g->edge * g->cell;
		if (spread_gap(w, j, x, 0.9 * g->edge * g->cell, NULL) > 0) continue;
		for (uint32_t c = 0; c < QUERN_BLOCK_CELLS; c++) {
			if (!m->inside[c]) continue;
			quern_grid_corner(g, b * QUERN_BLOCK_CELLS + c, x);
			for (uint32_t k = 0; k < w->s->dim; k++) x[k] += 0.5 * g->cell;
			spread_cut_cell(w, m, j, c, x);
		}
	}
}

/* Of a chunk's points: the square of the shear rate, by what share they are spread until cells are counted again, 0 for those that stay, and the mass
 * of their cell. */
typedef struct spread_points {
	quern_real rate2[STENCIL], part[STENCIL], full[STENCIL];
} spread_points;

/* Points of a hybrid's zone stay: grains lie between them. */
QUERN_INLINE void spread_parts(
	const gather_work *w, gather_memory *m, uint32_t begin, uint32_t n, const int dim, spread_points *of) {
	const quern_real time = w->s->dt * COUNT_EVERY, by = w->p->spread * time, still = w->still,
					 volume = quern_grid_cell_volume(w->g), least = w->p->bears, most = waves * w->p->bulk;
	const quern_real *weight = w->points.weight;
	quern_real level[STENCIL], spreads[STENCIL];
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t c = (uint32_t)m->cell[i];
		level[i] = m->level[c];
		of->full[i] = m->held[c] * volume;
		spreads[i] = m->inside[c] && !(weight && weight[begin + i] < 1);
	}
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		const quern_real rate2 = calm_shear(m->gradient, i, (uint32_t)dim),
						 part = by * flowing_share(still, rate2) * sheared_rate(m, i, rate2, dim);
		const bool goes =
			(spreads[i] > 0) & (level[i] > least) & (level[i] < most) & (of->full[i] > 0) & (part > 0);
		of->rate2[i] = rate2;
		of->part[i] = goes ? part : 0;
	}
}

/* Those beyond their block's cells along an axis stay as well. */
QUERN_INLINE void spread_offsets(const gather_work *w, const gather_memory *m, uint32_t b, uint32_t n,
	const int k, quern_real *restrict off, quern_real *restrict part) {
	const int32_t begin = w->g->at[b][k] * (int32_t)w->g->edge;
	const quern_real cell = w->g->cell,
					 edge = (quern_real)w->g->edge, *restrict place = m->trip.stencil.position[k];
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		off[i] = spread_offset(place[i], cell, begin, edge);
		part[i] = off[i] < 1 ? part[i] : 0;
	}
}

QUERN_INLINE void spread_along(const gather_work *w, const gather_memory *m, uint32_t b, uint32_t n,
	const int k, const spread_points *of, const quern_real *restrict off, quern_real *restrict rate) {
	const quern_real time = w->s->dt * COUNT_EVERY, cell = w->g->cell;
	const quern_row *moment = w->moment + (size_t)b * QUERN_BLOCK_CELLS;
	quern_real sum[STENCIL], squares[STENCIL], wanted[STENCIL];
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t c = (uint32_t)m->cell[i];
		sum[i] = moment[c][2 * k];
		squares[i] = moment[c][2 * k + 1];
		wanted[i] = spread_wanted(m->cut[k][0][c], m->cut[k][1][c]);
	}
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		const quern_real mean = sum[i] / of->full[i] - wanted[i], wide = squares[i] / of->full[i],
						 passes = m->trip.pic[k][i] / cell, part = of->part[i],
						 share = part / (1 + part) * (of->rate2[i] / (of->rate2[i] + passes * passes)),
						 pull = share * (spread_beyond(mean) + wide * off[i]),
						 held = pull > -most_pull ? pull < most_pull ? pull : most_pull : -most_pull;
		rate[i] = part > 0 ? -held / time : 0;
	}
}

/* How fast the points of a chunk will go until cells are counted again: means to the middle of the cell and mean squares to those of the start, by a part
 * for each unit of shear, and little along an axis along which the flow takes points through cells anyway. */
QUERN_INLINE void spread_chunk(
	const gather_work *w, gather_memory *m, uint32_t b, uint32_t begin, uint32_t n, const int dim) {
	spread_points of;
	quern_real off[3][STENCIL];
	cells_of(w, b, m->trip.stencil.position, n, dim, m->cell);
	spread_parts(w, m, begin, n, dim, &of);
	for (int k = 0; k < dim; k++) spread_offsets(w, m, b, n, k, off[k], of.part);
	for (int k = 0; k < dim; k++)
		spread_along(w, m, b, n, k, &of, off[k], w->s->use[GATHER_SPREADING].real[k] + begin);
}

/* Nothing is moved across a face. Updates of zones come between counts: who has come into one stays from then on. */
static void spread_move(const gather_work *w, const gather_memory *m, uint32_t begin, uint32_t n) {
	const quern_real dt = w->s->dt, cell = w->g->cell, inverse = 1 / cell;
	const quern_real *weight = w->points.weight ? w->points.weight + begin : NULL;
	for (uint32_t k = 0; k < w->s->dim; k++) {
		const quern_real *restrict rate = w->s->use[GATHER_SPREADING].real[k] + begin, *restrict place =
																						   m->trip.stencil
																							   .position[k];
		quern_real *restrict x = w->s->use[GATHER_POSITION].real[k] + begin;
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			const quern_real t = place[i] * inverse, off = t - quern_floor(t) - 0.5,
							 here = weight && weight[i] < 1 ? 0 : rate[i];
			x[i] += dt * here * (1 - 4 * off * off) * cell;
		}
	}
}
