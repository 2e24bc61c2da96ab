/* SPDX-License-Identifier: MIT */
/* cell_grid - cells of one width over all grains, and the blocks they are gathered in. docs/theory/grains.md, section 4 */
#pragma once
#include <math.h>
#include <quern/neighbours.h>
#include <quern/space.h>

/* The cells cover the grains' bounding box, or the whole length of a periodic axis. */
typedef struct {
	quern_real lower[3], length[3]; /* m */
} extent;

typedef struct {
	uint32_t count[3];
	uint32_t n;                                 /* cells */
	quern_real lower[3], inverse[3], length[3]; /* m, 1/m, m; length: of a cell */
} cell_grid;

QUERN_INLINE extent extent_of(const quern_neighbour_job *job) {
	extent e = { .lower = { 0 } };
	for (uint32_t a = 0; a < job->dim; a++) {
		const quern_real *x = job->position[a];
		quern_real low = x[0], high = x[0];
		for (uint32_t i = 1; i < job->n; i++) {
			low = x[i] < low ? x[i] : low;
			high = x[i] > high ? x[i] : high;
		}
		e.lower[a] = job->periodic[a] ? job->lower[a] : low;
		e.length[a] = job->periodic[a] ? job->upper[a] - job->lower[a] : high - low;
	}
	return e;
}

/* Cells of that width at least. A few far flyers must not ask for more cells than there are grains to fill them: all are wider then. */
QUERN_INLINE cell_grid cell_grid_of(
	const quern_neighbour_job *job, const extent *e, quern_real width, uint32_t n_grains) {
	cell_grid g = { .count = { 1, 1, 1 }, .n = 1 };
	for (;; width *= 1.5) {
		quern_real total = 1;
		for (uint32_t a = 0; a < job->dim; a++) total *= floor(e->length[a] / width) + 1;
		if (!(total > 16.0 * n_grains + 4096)) break;
	}
	for (uint32_t a = 0; a < job->dim; a++) {
		const quern_real fit = floor(e->length[a] / width);
		const uint32_t whole = fit >= 1 ? (uint32_t)fit : 0;
		g.count[a] = !job->periodic[a] ? whole + 1 : whole ? whole : 1;
		g.lower[a] = e->lower[a];
		g.length[a] = job->periodic[a] ? e->length[a] / g.count[a] : width;
		g.inverse[a] = job->periodic[a] ? g.count[a] / e->length[a] : 1 / width;
		g.n *= g.count[a];
	}
	return g;
}

QUERN_INLINE uint32_t cell_along(const cell_grid *g, const quern_neighbour_job *job, uint32_t a, uint32_t i) {
	const int32_t c = quern_cell_along(job->position[a][i], g->lower[a], g->inverse[a]);
	return (uint32_t)quern_cell_held(c, (int32_t)g->count[a]);
}

QUERN_INLINE uint32_t cell_number(const cell_grid *g, const uint32_t c[3]) {
	return (c[2] * g->count[1] + c[1]) * g->count[0] + c[0];
}

QUERN_INLINE uint32_t cell_of(const cell_grid *g, const quern_neighbour_job *job, uint32_t i) {
	uint32_t c[3] = { 0 };
	for (uint32_t a = 0; a < job->dim; a++) c[a] = cell_along(g, job, a, i);
	return cell_number(g, c);
}

/* Grain i's key: its block of `edge` cells along each axis, and its cell's place there. */
QUERN_INLINE uint64_t block_key(
	const cell_grid *g, uint32_t edge, const quern_neighbour_job *job, uint32_t i) {
	const uint32_t bx = (g->count[0] + edge - 1) / edge, by = (g->count[1] + edge - 1) / edge;
	uint32_t c[3] = { 0 };
	for (uint32_t a = 0; a < job->dim; a++) c[a] = cell_along(g, job, a, i);
	const uint64_t block = ((uint64_t)(c[2] / edge) * by + c[1] / edge) * bx + c[0] / edge;
	const uint32_t place = ((c[2] % edge) * edge + c[1] % edge) * edge + c[0] % edge;
	return block << 32 | place;
}
