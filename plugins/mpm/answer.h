/* SPDX-License-Identifier: MIT */
/* answer - volume that answers to how full cells are: what a cell holds, the pressure that it lacks, and densities of points that follow its
 * own. docs/theory/hybrid.md, section 5; docs/theory/mpm.md, section 8 */
#pragma once
#include "flow.h"
#include "spread.h"
#include <math.h>

/* Of the shear rate of what is at rest: where material flows for certain. What is alone has no noise of grains and conversions. */
static const quern_real flowing = 30, flowing_alone = 3;
/* Of densities within a cell: a rate over that at which they go to what the cell holds. */
static const quern_real evening = 10;
/* What is counted in one cell is noise of some percent, the mean of those around of less: what that one has beyond `noise_around` is followed faster
 * by a factor, up to `most_around`. */
static const quern_real noise_around = 0.02, most_around = 0.03, faster_around = 10;
/* Of a cell's excess: below, there is a surface; above, no more counts. */
static const quern_real most_excess = 0.1;
/* What is full, over what was full at first: that varies by so much. */
static const quern_real dead_band = 1.01;

static quern_real pressure_of(const gather_work *w, uint32_t i) {
	quern_real pressure = 0;
	for (uint32_t k = 0; k < w->s->dim; k++) pressure -= w->s->use[GATHER_STRESS].real[k][i] / w->s->dim;
	return pressure;
}

QUERN_INLINE void pressures_of(
	const gather_work *w, uint32_t begin, uint32_t n, const int dim, quern_real *restrict pressure) {
	memset(pressure, 0, n * sizeof *pressure);
	for (int k = 0; k < dim; k++) {
		const quern_real *restrict stress = w->s->use[GATHER_STRESS].real[k] + begin;
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) pressure[i] -= stress[i] / dim;
	}
}

/* On the grid in the middle of a cell: the mean of its corners. */
static quern_real centre_density(const gather_work *w, const gather_memory *m, uint32_t place) {
	const uint32_t dim = w->s->dim, edge = w->g->edge;
	const uint32_t at[3] = { place % edge, place / edge % edge, place / edge / edge };
	quern_real sum = 0;
	for (uint32_t corner = 0; corner < 1u << dim; corner++) {
		uint32_t node = 0;
		for (uint32_t k = dim; k-- > 0;) node = node * w->g->span + at[k] + 1 + (corner >> k & 1);
		sum += m->tile[node][motion_density(dim)];
	}
	return sum / (1u << dim);
}

/* Whether every node of the domain that hats around the cell's centre reach up to knows a density: at a surface or a body some do not, and what
 * is counted there lacks what the body or the air holds. */
static bool surrounded(const gather_work *w, const gather_memory *m, uint32_t b, uint32_t c) {
	const quern_grid_view *g = w->g;
	const uint32_t dim = w->s->dim, edge = g->edge, at[3] = { c % edge, c / edge % edge, c / edge / edge };
	for (uint32_t near = 0; near < 1u << 2 * dim; near++) {
		uint32_t node = 0;
		for (uint32_t k = dim; k-- > 0;) node = node * g->span + at[k] + (near >> 2 * k & 3);
		if (m->tile[node][motion_density(dim)] > 0 && !m->silent[node]) continue;
		bool outside = false;
		for (uint32_t k = 0; k < dim; k++) {
			/* the tile begins a cell before the block */
			const int32_t place = g->at[b][k] * (int32_t)edge + (int32_t)(at[k] + (near >> 2 * k & 3)) - 1;
			outside = outside || (!g->periodic[k] && (place < 0 || place > g->cells[k]));
		}
		if (!outside) return false;
	}
	return true;
}

/* Of a cell's density, what is measured in the cell itself, and not on the grid. */
static const quern_real own_part = 0.25, own_part_alone = 0.5;

/* The grid's density in the middle of a cell is smooth, but the same where full cells and empty ones take turns; what is counted in
 * a cell is neither. A continuum alone is counted by hats around the centres of cells (scatter.c), and `inside` is whether that one is. */
static quern_real density_of(
	const gather_work *w, const gather_memory *m, uint32_t b, uint32_t c, bool *inside) {
	const quern_real *fullness = w->s->use[GATHER_FULLNESS].real[0];
	const quern_real centre = centre_density(w, m, c);
	*inside = (w->p->alone || w->moment) && surrounded(w, m, b, c);
	if (w->p->alone) {
		if (!*inside) return centre;
		const quern_row *node = w->trips.node + (size_t)b * QUERN_BLOCK_CELLS + c;
		return centre +
			   own_part_alone * ((*node)[node_held(w->s->dim)] / quern_grid_cell_volume(w->g) - centre);
	}
	const quern_real counted = fullness ? fullness[b * QUERN_BLOCK_CELLS + c] : 0;
	return counted > 0 ? centre + own_part * (counted * w->p->density - centre) : centre;
}

/* Of the density from which on a point bears: one less dense is open, its volume is the grid's. What presses may be as loose as the loosest flow. */
static const quern_real dense = 0.98;
QUERN_INLINE quern_real closed_from(const mpm *p, quern_real pressure) {
	return dense * (pressure > 0 ? p->loosest : p->density);
}

/* Over the cells of the block that touch a cell, and itself, the mean beyond noise; of those that lie inside, since at a surface or a body it is off for
 * reasons of its own. */
QUERN_INLINE quern_real mean_excess(const gather_work *w, const gather_memory *m, uint32_t c, const int dim) {
	const int32_t edge = (int32_t)w->g->edge,
				  at[3] = { (int32_t)c % edge, (int32_t)c / edge % edge, (int32_t)c / edge / edge };
	const int32_t deep = dim == 3 ? 1 : 0;
	quern_real sum = 0;
	uint32_t n = 0;
	for (int32_t z = at[2] - deep; z <= at[2] + deep; z++)
		for (int32_t y = at[1] - 1; y <= at[1] + 1; y++)
			for (int32_t x = at[0] - 1; x <= at[0] + 1; x++) {
				if (x < 0 || y < 0 || z < 0 || x >= edge || y >= edge || z >= edge) continue;
				const int32_t there = (z * edge + y) * edge + x;
				const quern_real excess = m->excess[there];
				const bool counts = m->inside[there] && excess >= -most_excess;
				const quern_real held = excess < most_excess ? excess : most_excess;
				sum += counts ? held : 0;
				n += counts;
			}
	return n ? fmin(fmax(0, sum / n - noise_around), most_around) : 0;
}

/* What cells hold more than their points know. */
QUERN_INLINE void find_excess(const gather_work *w, gather_memory *m, const int dim) {
	for (uint32_t c = 0; c < QUERN_BLOCK_CELLS; c++)
		m->excess[c] = m->mean[c] > 0 && m->level[c] > 0 ? m->held[c] / m->mean[c] - 1 : -1;
	for (uint32_t c = 0; c < QUERN_BLOCK_CELLS; c++)
		m->excess_around[c] = m->inside[c] && m->excess[c] >= -most_excess && m->level[c] < waves * w->p->bulk
								  ? mean_excess(w, m, c, dim)
								  : 0;
}

/* The points of a chunk, to what their cells have. */
QUERN_INLINE void level_chunk(
	const gather_work *w, gather_memory *m, uint32_t b, uint32_t begin, uint32_t n, const int dim) {
	const quern_real *restrict mass = w->s->use[GATHER_MASS].real[0] + begin,
							   *restrict volume = w->s->use[GATHER_VOLUME].real[0] + begin;
	quern_real(*place)[STENCIL] = m->trip.stencil.position;
	quern_real pressure[STENCIL], presses[STENCIL], closed[STENCIL];
	for (int k = 0; k < dim; k++) {
		const quern_real *restrict position = w->s->use[GATHER_POSITION].real[k] + begin;
		for (uint32_t i = 0; i < n; i++) place[k][i] = position[i] - w->g->lower[k];
	}
	cells_of(w, b, place, n, dim, m->cell);
	pressures_of(w, begin, n, dim, pressure);
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		presses[i] = volume[i] * pressure[i];
		closed[i] = mass[i] < closed_from(w->p, pressure[i]) * volume[i] ? 0 : 1;
	}
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t c = (uint32_t)m->cell[i];
		m->level[c] += presses[i];
		m->mean[c] += closed[i] * mass[i];
		m->room[c] += closed[i] * volume[i];
		m->loose[c] += (1 - closed[i]) * volume[i];
	}
}

/* The mean pressure of each cell's points, by volume, and the density of each cell. Points that lie loose and bear nothing are a part of what flows
 * where the cell is full; in one that is not they are spray beside it. */
QUERN_INLINE void level_block(const gather_work *w, gather_memory *m, uint32_t b, const int dim) {
	memset(m->level, 0, sizeof m->level);
	memset(m->room, 0, sizeof m->room);
	memset(m->loose, 0, sizeof m->loose);
	memset(m->mean, 0, sizeof m->mean);
	for (uint32_t begin = w->point[b]; begin < w->point[b + 1]; begin += STENCIL) {
		const uint32_t rest = w->point[b + 1] - begin;
		level_chunk(w, m, b, begin, rest < STENCIL ? rest : STENCIL, dim);
	}
	for (uint32_t c = 0; c < QUERN_BLOCK_CELLS; c++) {
		const bool any = m->room[c] + m->loose[c] > 0;
		m->inside[c] = false;
		m->held[c] = any ? density_of(w, m, b, c, &m->inside[c]) : 0;
		m->mean[c] = m->room[c] > 0 ? m->mean[c] / m->room[c] : 0;
		const quern_real room = m->room[c] + (m->held[c] > closed_from(w->p, m->level[c]) ? m->loose[c] : 0);
		m->level[c] = room > 0 ? m->level[c] / room : 0;
	}
	if (w->p->alone) find_excess(w, m, dim);
}

/* Points do not feel that they lie one upon the other: as material is sheared, their densities go to the mean of their cell's points, and that goes
 * to the cell's, a part for each unit of shear; if each went to the grid's at its own place it would take over that one's noise. A cell that
 * bears nothing has no friction to lose, and one whose points are far denser than it is at a surface. Returned: by what share a point's density
 * grows in this step, with `part` of what its cell has more. */
QUERN_INLINE quern_real follow_cell(
	quern_real level, quern_real held, quern_real mean, quern_real own, quern_real part, quern_real solid) {
	const quern_real off = held / mean - 1, even = 1 - own / mean, evened = evening * part,
					 counted = off < -0.1  ? 0
							   : off < 0.1 ? off
										   : 0.1,
					 grown = part / (1 + part) * counted + evened / (1 + evened) * even;
	const bool follows = (level > 0) & (own >= solid) & (mean > 0);
	return follows ? grown : 0;
}

/* A continuum alone: densities of points go to the mean of their cell's, which keeps the volume of all, much faster
 * than that goes to what the cell holds. Each by itself would take over the noise of its own gradient. `own`, beside the cell's
 * level and mean, is the point's density; `shear` how far it is sheared until cells are counted again. */
QUERN_INLINE quern_real follow_alone(quern_real follow, quern_real level, quern_real mean, quern_real own,
	quern_real excess, quern_real excess_around, quern_real closed, quern_real shear) {
	const quern_real evened = evening * follow * shear, part = follow * shear, soon = faster_around * part,
					 high = excess < most_excess ? excess : most_excess,
					 counted = excess < -most_excess ? 0 : high;
	const quern_real grown = evened / (1 + evened) * (1 - own / mean) + part / (1 + part) * counted +
							 soon / (1 + soon) * excess_around;
	const bool follows = (shear > 0) & (level > 0) & (mean > 0) & (own >= closed);
	return follows ? grown : 0;
}

/* Mass that came where there was no room has brought its volume along, and does not press: what pressure lacks comes as a compression
 * beside that of the flow, where material flows, so that it holds for every material. */
QUERN_INLINE void answer_chunk(
	const gather_work *w, gather_memory *m, uint32_t b, uint32_t begin, uint32_t n, const int dim) {
	const mpm *p = w->p;
	const quern_real dt = w->s->dt, bulk = p->bulk, follow = p->follow * dt, full = w->full,
					 solid = closed_from(p, 0), soft = closed_from(p, 1), still = w->still,
					 stiff = p->relief * bulk, soon = fmin(1, p->answer * dt);
	const quern_real *crowding = w->s->use[GATHER_CROWDING].real[0] + (size_t)b * QUERN_BLOCK_CELLS;
	quern_real crowded[STENCIL], holds[STENCIL], lack[STENCIL], mean[STENCIL], pressed[STENCIL];
	cells_of(w, b, m->trip.stencil.position, n, dim, m->cell);
	pressures_of(w, begin, n, dim, pressed);
	for (uint32_t i = 0; i < n; i++) {
		crowded[i] = crowding[m->cell[i]];
		holds[i] = m->held[m->cell[i]];
		mean[i] = m->mean[m->cell[i]];
		m->mean_pressure[i] = m->level[m->cell[i]];
	}
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		quern_real trace = 0;
		for (int k = 0; k < dim; k++) trace += m->gradient[(dim + 1) * k][i];
		const quern_real closed = pressed[i] > 0 ? soft : solid,
						 pressure = pressed[i] - bulk * trace * dt; /* what the flow itself will make of it */
		const quern_real rate2 = calm_shear(m->gradient, i, (uint32_t)dim),
						 flows = flowing_share(still, rate2);
		/* of the deformation, what changes shape: what only changes volume does not even out densities */
		const quern_real shape = rate2 / (rate2 > 0 ? rate2 + shaken * trace * trace : 1);
		const quern_real followed = flows * follow_cell(m->mean_pressure[i], holds[i], mean[i], m->density[i],
												follow * sqrt(rate2) * shape, closed);
		/* a crowded cell's least pressure; at rest no mass arrives, and a bed is denser here than there */
		const quern_real least = stiff * (crowded[i] - full);
		const bool short_of = (least > 0) & (least > pressure);
		const quern_real lacks = short_of ? soon * (least - pressure) : 0;
		m->density[i] *= 1 + followed;
		lack[i] = flows * lacks + bulk * followed;
	}
	for (int k = 0; k < dim; k++) {
		quern_real *restrict l = m->gradient[(dim + 1) * k], *restrict kept = m->kept[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			kept[i] = l[i];
			l[i] -= lack[i] / (bulk * dt * dim);
		}
	}
}

/* A continuum alone: how fast each density will follow until cells are counted again, and the mean pressure around. */
QUERN_INLINE void measure_chunk(
	const gather_work *w, gather_memory *m, uint32_t b, uint32_t begin, uint32_t n, const int dim) {
	const quern_real still = w->still, time = w->s->dt * COUNT_EVERY, follow = w->p->follow,
					 solid = closed_from(w->p, 0), soft = closed_from(w->p, 1);
	quern_real *restrict following = w->s->use[GATHER_FOLLOWING].real[0] + begin,
						 *restrict around = w->s->use[GATHER_AROUND].real[0] + begin;
	quern_real pressure[STENCIL], mean[STENCIL], excess[STENCIL], excess_around[STENCIL];
	cells_of(w, b, m->trip.stencil.position, n, dim, m->cell);
	pressures_of(w, begin, n, dim, pressure);
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t c = (uint32_t)m->cell[i];
		around[i] = m->level[c];
		mean[i] = m->mean[c];
		excess[i] = m->excess[c];
		excess_around[i] = m->excess_around[c];
	}
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		const quern_real rate2 = calm_shear(m->gradient, i, (uint32_t)dim),
						 shear = sheared_rate(m, i, rate2, dim) * time,
						 closed = pressure[i] > 0 ? soft : solid,
						 grown = follow_alone(follow, around[i], mean[i], m->density[i], excess[i],
							 excess_around[i], closed, shear);
		following[i] = flowing_share(still, rate2) * (grown / time);
	}
}

/* The density and, as a compression beside that of the flow, the pressure with it. */
static void follow_chunk(const gather_work *w, gather_memory *m, uint32_t begin, uint32_t n) {
	const uint32_t dim = w->s->dim;
	const quern_real *restrict following = w->s->use[GATHER_FOLLOWING].real[0] + begin;
	for (uint32_t k = 0; k < dim; k++) {
		quern_real *restrict l = m->gradient[(dim + 1) * k], *restrict kept = m->kept[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			kept[i] = l[i];
			l[i] -= following[i] / dim;
		}
	}
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) m->density[i] *= 1 + w->s->dt * following[i];
}
