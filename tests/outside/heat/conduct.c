/* SPDX-License-Identifier: MIT */
/* conduct - a step of heat: points to nodes, flux between nodes, nodes to points. Sums are made block by block in
 * coloured order, so that they are the same for any number of threads */
#include "heat.h"
#include <math.h>
#include <string.h>

typedef struct {
	const heat *p;
	const quern_step *s;
	const quern_grid_view *g;
	const uint32_t *point, *list; /* partition of the points by block; blocks of this colour */
	quern_row *node;
	quern_real least; /* J/K below which a node counts for none */
	int32_t *bad;     /* by block: the first point without a sound number, or -1 */
} work;

typedef struct {
	quern_row tile[QUERN_TILE_MOST], sum[QUERN_TILE_MOST];
	weights weights;
	_Alignas(64) quern_real conductivity[CHUNK];
	reach reach;
} memory;

static work work_of(const heat *p, const quern_step *s, const quern_column node) {
	return (work) { .p = p,
		.s = s,
		.g = s->host->grid(s->run),
		.point = s->host->set(s->run, "point").block,
		.node = (quern_row *)(void *)node.real[0] };
}

/* No two blocks of a colour share a node. */
static void by_colour(work *w, void (*body)(void *, uint32_t, uint32_t)) {
	for (uint32_t c = 0; c < w->g->n_colours; c++) {
		w->list = w->g->by_colour + w->g->colour[c];
		w->s->host->parallel(w->s->run, w->g->colour[c + 1] - w->g->colour[c], body, w);
	}
}

static uint32_t chunk_of(const work *w, uint32_t b, uint32_t i) {
	return w->point[b + 1] - i < CHUNK ? w->point[b + 1] - i : CHUNK;
}

static quern_status prepare_faults(work *w) {
	w->bad = w->s->host->memory(w->s->run, w->g->n_blocks * sizeof *w->bad);
	for (uint32_t b = 0; w->bad && b < w->g->n_blocks; b++) w->bad[b] = -1;
	return w->bad ? QUERN_OK : QUERN_E_MEMORY;
}

static int32_t first_fault(const work *w) {
	for (uint32_t b = 0; b < w->g->n_blocks; b++)
		if (w->bad[b] >= 0) return w->bad[b];
	return -1;
}

/* ---- points to nodes ---- */

static void scatter_block(void *arg, uint32_t k, uint32_t worker) {
	const work *w = arg;
	const quern_column *u = w->s->use;
	const uint32_t b = w->list[k];
	memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m || w->point[b] == w->point[b + 1]) return;
	memset(m->sum, 0, w->g->tile_size * sizeof *m->sum);
	for (uint32_t i = w->point[b]; i < w->point[b + 1]; i += CHUNK) {
		const uint32_t n = chunk_of(w, b, i);
		heat_weights(w->g, &w->s->slot[SLOT_SHAPE][0], u[SCATTER_POSITION].real, i, n, &m->weights);
		for (uint32_t j = 0; j < n; j++) {
			const quern_real c = heat_capacity_of(w->p, u[SCATTER_MASS], u[SCATTER_WEIGHT], i + j);
			const quern_row sent = { c, c * u[SCATTER_TEMPERATURE].real[0][i + j] };
			heat_reach_tile(w->g, &m->weights, b, j, &m->reach);
			for (uint32_t q = 0; q < m->reach.n; q++) m->sum[m->reach.place[q]] += m->reach.value[q] * sent;
		}
	}
	quern_tile_add(w->g, w->node, b, m->sum);
}

quern_status heat_scatter(const void *self, const quern_step *s) {
	work w = work_of(self, s, s->use[SCATTER_CAPACITY]);
	if (s->host->set(s->run, "point").n) by_colour(&w, scatter_block);
	return QUERN_OK;
}

/* ---- flux ---- */

/* A node that all but nobody reaches has no temperature of its own. Its part goes to the point's nearest node, for the
 * gradient and for the flux alike: then slopes still sum to zero, and no heat is lost. */
static void leave_out(const work *w, const quern_row *tile, reach *r) {
	uint32_t near = 0;
	for (uint32_t q = 1; q < r->n; q++)
		if (r->value[q] > r->value[near]) near = q;
	for (uint32_t q = 0; q < r->n; q++) {
		if (tile[r->place[q]][LANE_CAPACITY] > w->least) continue;
		for (uint32_t a = 0; a < 3; a++) {
			r->slope[near][a] += r->slope[q][a];
			r->slope[q][a] = 0;
		}
	}
}

/* rate_i = -sum_p w V k grad S_i . grad T */
static void flux_of(const work *w, memory *m, quern_real size) {
	reach *r = &m->reach;
	quern_real gradient[3] = { 0 };
	leave_out(w, m->tile, r);
	for (uint32_t q = 0; q < r->n; q++) {
		const quern_row row = m->tile[r->place[q]];
		if (!(row[LANE_CAPACITY] > w->least)) continue;
		const quern_real temperature = row[LANE_HEAT] / row[LANE_CAPACITY];
		for (uint32_t a = 0; a < 3; a++) gradient[a] += r->slope[q][a] * temperature;
	}
	for (uint32_t q = 0; q < r->n; q++) {
		quern_real along = 0;
		for (uint32_t a = 0; a < 3; a++) along += r->slope[q][a] * gradient[a];
		m->sum[r->place[q]][LANE_RATE] -= size * along;
	}
}

static void flux_block(void *arg, uint32_t k, uint32_t worker) {
	const work *w = arg;
	const quern_column *u = w->s->use;
	const quern_real *weight = u[FLUX_WEIGHT].real[0];
	const uint32_t b = w->list[k];
	memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m || w->point[b] == w->point[b + 1]) return;
	quern_tile_load(w->g, w->node, b, m->tile);
	memset(m->sum, 0, w->g->tile_size * sizeof *m->sum);
	for (uint32_t i = w->point[b]; i < w->point[b + 1]; i += CHUNK) {
		const uint32_t n = chunk_of(w, b, i);
		heat_weights(w->g, &w->s->slot[SLOT_SHAPE][0], u[FLUX_POSITION].real, i, n, &m->weights);
		heat_conductivity(
			&w->s->slot[SLOT_CONDUCTIVITY][0], u[FLUX_TEMPERATURE].real[0], i, n, m->conductivity);
		for (uint32_t j = 0; j < n; j++) {
			const quern_real given = m->conductivity[j], one = weight ? weight[i + j] : 1;
			if (!(given >= 0 && given < INFINITY) && w->bad[b] < 0) w->bad[b] = (int32_t)(i + j);
			heat_reach_tile(w->g, &m->weights, b, j, &m->reach);
			flux_of(w, m, one * u[FLUX_VOLUME].real[0][i + j] * given);
		}
	}
	quern_tile_add(w->g, w->node, b, m->sum);
}

quern_status heat_flux(const void *self, const quern_step *s) {
	work w = work_of(self, s, s->use[FLUX_CAPACITY]);
	const uint32_t n = s->host->set(s->run, "point").n;
	if (!n) return QUERN_OK;
	for (uint32_t i = 0; i < n; i++) {
		const quern_real own = heat_capacity_of(w.p, s->use[FLUX_MASS], s->use[FLUX_WEIGHT], i);
		w.least = own > w.least ? own : w.least;
	}
	w.least *= 1e-12;
	if (prepare_faults(&w) != QUERN_OK) return QUERN_E_MEMORY;
	by_colour(&w, flux_block);
	const int32_t bad = first_fault(&w);
	if (bad < 0) return QUERN_OK;
	return s->host->stop(s->run, QUERN_E_NUMERIC, "point", bad,
		"%s gives no conductivity that is finite and not negative at %.6g K",
		s->slot[SLOT_CONDUCTIVITY][0].id, s->use[FLUX_TEMPERATURE].real[0][bad]);
}

/* ---- nodes to points ---- */

/* The change alone, so that what the nodes cannot tell apart stays with the points. */
static void gather_block(void *arg, uint32_t b, uint32_t worker) {
	const work *w = arg;
	const quern_column *u = w->s->use;
	memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m || w->point[b] == w->point[b + 1]) return;
	quern_tile_load(w->g, w->node, b, m->tile);
	for (uint32_t i = w->point[b]; i < w->point[b + 1]; i += CHUNK) {
		const uint32_t n = chunk_of(w, b, i);
		heat_weights(w->g, &w->s->slot[SLOT_SHAPE][0], u[GATHER_POSITION].real, i, n, &m->weights);
		for (uint32_t j = 0; j < n; j++) {
			quern_real *temperature = &u[GATHER_TEMPERATURE].real[0][i + j], change = 0;
			heat_reach_tile(w->g, &m->weights, b, j, &m->reach);
			for (uint32_t q = 0; q < m->reach.n; q++) {
				const quern_row row = m->tile[m->reach.place[q]];
				if (row[LANE_RATE] != 0)
					change += m->reach.value[q] * (w->s->dt * row[LANE_RATE] / row[LANE_CAPACITY]);
			}
			*temperature += change;
			if (!(*temperature >= 0 && *temperature < INFINITY) && w->bad[b] < 0)
				w->bad[b] = (int32_t)(i + j);
		}
	}
}

quern_status heat_gather(const void *self, const quern_step *s) {
	work w = work_of(self, s, s->use[GATHER_CAPACITY]);
	if (!s->host->set(s->run, "point").n) return QUERN_OK;
	if (prepare_faults(&w) != QUERN_OK) return QUERN_E_MEMORY;
	s->host->parallel(s->run, w.g->n_blocks, gather_block, &w);
	const int32_t bad = first_fault(&w);
	if (bad < 0) return QUERN_OK;
	return s->host->stop(s->run, QUERN_E_NUMERIC, "point", bad,
		"point.temperature is %.6g K after conduction: is the step of %.3g s too long?",
		s->use[GATHER_TEMPERATURE].real[0][bad], s->dt);
}
