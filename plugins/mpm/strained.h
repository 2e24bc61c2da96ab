/* SPDX-License-Identifier: MIT */
/* strained - what a strain makes of velocity gradients: means over the points of a cell, and the gradients that volume and stress
 * see. docs/theory/mpm.md, section 10 */
#pragma once
#include "answer.h"

/* What carries nothing, and would not if it were dense: its volume is the grid's, and no mean is its affair. */
QUERN_INLINE bool is_open(const gather_work *w, uint32_t i) {
	const quern_real pressure = pressure_of(w, i);
	return pressure == 0 && w->s->use[GATHER_MASS].real[0][i] <
								closed_from(w->p, pressure) * w->s->use[GATHER_VOLUME].real[0][i];
}

/* m^3, of a point in a mean: as much as its stress pushes. */
QUERN_INLINE quern_real bearing_of(const gather_work *w, uint32_t i) {
	const quern_real *weight = w->points.weight, volume = w->s->use[GATHER_VOLUME].real[0][i];
	return is_open(w, i) ? 0 : weight ? weight[i] * volume : volume;
}

QUERN_INLINE quern_strain_batch strain_batch(
	const gather_work *w, gather_memory *m, quern_column *own, uint32_t begin, uint32_t n, const int dim) {
	const quern_bound *strain = &w->s->slot[SLOT_STRAIN][0];
	quern_strain_batch b = { .n = n, .cap = STENCIL, .dt = w->s->dt, .use = own };
	for (int k = 0; k < dim * dim; k++) b.gradient[k] = m->gradient[k];
	for (uint32_t r = 0; r < strain->n_uses; r++)
		own[r] = quern_column_from(strain->column[r], strain->uses[r].shape, begin);
	return b;
}

/* Of a chunk whose stencil stands: velocity gradients alone. */
QUERN_INLINE void slopes_chunk(gather_memory *m, uint32_t n, const int dim) {
	for (uint32_t i = 0; i < n; i++) {
		quern_row v[4];
		stencil_gather(&m->trip.stencil, i, m->tile, dim, true, v);
		for (int k = 0; k < dim; k++)
			for (int a = 0; a < dim; a++) m->gradient[dim * k + a][i] = v[1 + a][k];
	}
}

/* Means over cells, of all points of the block in their order, before the first of them moves. */
QUERN_INLINE void strain_block(const gather_work *w, gather_memory *m, uint32_t b, const int dim) {
	const quern_bound *strain = &w->s->slot[SLOT_STRAIN][0];
	const uint32_t means = w->strain->means, end = w->point[b + 1];
	quern_column own[QUERN_MOST_USES];
	memset(m->bearing, 0, sizeof m->bearing);
	memset(m->strained, 0, sizeof m->strained);
	for (uint32_t begin = w->point[b]; begin < end; begin += STENCIL) {
		const uint32_t n = end - begin < STENCIL ? end - begin : STENCIL;
		stencil_make(w->g, &w->s->slot[SLOT_SHAPE][0], b, w->s->use[GATHER_POSITION].real, begin, NULL, n,
			&m->trip.stencil);
		slopes_chunk(m, n, dim);
		quern_strain_batch batch = strain_batch(w, m, own, begin, n, dim);
		for (uint32_t k = 0; k < means; k++) batch.measured[k] = m->measured[k];
		w->strain->measure[dim - 2](strain->self, &batch);
		cells_of(w, b, m->trip.stencil.position, n, dim, m->cell);
		for (uint32_t i = 0; i < n; i++) {
			const uint32_t c = (uint32_t)m->cell[i];
			const quern_real bears = bearing_of(w, begin + i);
			m->bearing[c] += bears;
			for (uint32_t k = 0; k < means; k++) m->strained[k][c] += bears * m->measured[k][i];
		}
	}
	for (uint32_t c = 0; c < QUERN_BLOCK_CELLS; c++)
		for (uint32_t k = 0; k < means; k++)
			m->strained[k][c] = m->bearing[c] > 0 ? m->strained[k][c] / m->bearing[c] : 0;
}

/* From here on to the end of the material the gradient is the strain's; that of the nodes stays in `raw`. */
QUERN_INLINE void strain_chunk(
	const gather_work *w, gather_memory *m, uint32_t b, uint32_t begin, uint32_t n, const int dim) {
	const quern_bound *strain = &w->s->slot[SLOT_STRAIN][0];
	const uint32_t means = w->strain->means;
	quern_column own[QUERN_MOST_USES];
	quern_strain_batch batch = strain_batch(w, m, own, begin, n, dim);
	for (int k = 0; k < dim * dim; k++) memcpy(m->raw[k], m->gradient[k], n * sizeof(quern_real));
	if (means) cells_of(w, b, m->trip.stencil.position, n, dim, m->cell);
	for (uint32_t k = 0; k < means; k++) {
		for (uint32_t i = 0; i < n; i++) m->measured[k][i] = m->strained[k][m->cell[i]];
		batch.mean[k] = m->measured[k];
	}
	w->strain->apply[dim - 2](strain->self, &batch);
	for (uint32_t i = 0; i < n && means; i++)
		if (!(bearing_of(w, begin + i) > 0))
			for (int k = 0; k < dim * dim; k++) m->gradient[k][i] = m->raw[k][i];
}
