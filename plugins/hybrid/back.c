/* SPDX-License-Identifier: MIT */
/* back - what the exchange has changed, from the nodes to the grains, through a transfer */
#include "../common/calm.h"
#include "../common/trips.h"
#include "lend.h"
#include "meet.h"
#include "solve.h"
#include <math.h>

typedef struct {
	const hybrid *h;
	const quern_step *s;
	const quern_grid_view *g;
	cloud grains;
	residents at;
	const quern_row *node, *mixture;
	trips trips;
	calm calm;
	int32_t *coupled;     /* by block, from where its residents begin: those that are */
	quern_real *then[3];  /* by grain that is coupled: its new velocity */
	quern_real *farthest; /* by block */
} back_work;

typedef struct {
	quern_row mass[QUERN_TILE_MOST], mixture[QUERN_TILE_MOST];
	trip_memory trip;
	_Alignas(64) quern_real velocity[3][STENCIL], gradient[9][STENCIL];
	quern_real rows[QUERN_MOST_USES][9][STENCIL];
	int32_t grain[STENCIL];
} back_memory;

/* Momentum to the velocity after the exchange. */
QUERN_INLINE void load_mixture(const back_work *w, back_memory *m, uint32_t b, const int dim) {
	quern_tile_load(w->g, w->mixture, b, m->mixture);
	for (uint32_t i = 0; i < w->g->tile_size; i++) {
		const quern_real one_over = m->mixture[i][0] > NO_MASS ? 1 / m->mixture[i][0] : 0;
		for (int a = 0; a < dim; a++)
			m->mixture[i][1 + a] = m->mixture[i][1 + a] * one_over + m->mixture[i][1 + dim + a];
	}
}

/* Those of n grains that were coupled. */
QUERN_INLINE uint32_t find_coupled(
	const back_work *w, back_memory *m, uint32_t b, const int32_t *grain, uint32_t n, const int dim) {
	const quern_bound *shape = &w->s->slot[SLOT_SHAPE][0];
	quern_real *const *x = w->s->use[B_POSITION].real;
	uint32_t kept = 0;
	stencil_make(w->g, shape, b, x, 0, grain, n, &m->trip.stencil);
	for (uint32_t k = 0; k < n; k++)
		if (company_of(&m->trip.stencil, k, m->mass, dim, (int32_t)w->g->span, 0).any &&
			w->grains.weight[grain[k]] > 0)
			m->grain[kept++] = grain[k];
	if (kept < n) stencil_make(w->g, shape, b, x, 0, m->grain, kept, &m->trip.stencil);
	return kept;
}

/* Their velocities, and what the nodes say at their centres. */
QUERN_INLINE void load_coupled(const back_work *w, back_memory *m, uint32_t n, const int dim) {
	for (uint32_t k = 0; k < n; k++) {
		quern_row v[4];
		const bool slopes = w->h->rest > 0;
		stencil_gather(&m->trip.stencil, k, m->mixture, dim, slopes, v);
		for (int c = 0; c < dim && slopes; c++)
			for (int a = 0; a < dim; a++) m->gradient[dim * c + a][k] = v[1 + a][1 + c];
		trips_hear(&m->trip, k, &v[0], 1, dim);
		for (int a = 0; a < dim; a++) m->velocity[a][k] = w->s->use[B_VELOCITY].real[a][m->grain[k]];
	}
	trips_hear_echo(&w->trips, &m->trip, n, dim);
}

/* With the transfer's own rows, gathered and put back. */
static void call_transfer(const back_work *w, back_memory *m, uint32_t n, bool last) {
	const quern_bound *transfer = w->trips.transfer;
	quern_real *velocity[3] = { m->velocity[0], m->velocity[1], m->velocity[2] };
	quern_column own[QUERN_MOST_USES];
	for (uint32_t r = 0; r < transfer->n_uses; r++) {
		const uint8_t shape = transfer->uses[r].shape;
		own[r] = (quern_column) { .real = { NULL } };
		for (uint32_t k = 0; k < quern_shape_size(shape, w->s->dim); k++) {
			const void *whole = quern_component(&transfer->column[r], shape, k);
			if (!whole) continue;
			quern_gather(shape, m->rows[r][k], whole, 0, m->grain, n);
			quern_set_component(&own[r], shape, k, m->rows[r][k]);
		}
	}
	trips_call(&w->trips, &m->trip, NULL, velocity, own, n, last);
	for (uint32_t r = 0; r < transfer->n_uses; r++) {
		const uint8_t shape = transfer->uses[r].shape;
		if (transfer->uses[r].access == QUERN_READ) continue;
		for (uint32_t k = 0; k < quern_shape_size(shape, w->s->dim); k++) {
			void *whole = quern_component(&transfer->column[r], shape, k);
			if (whole) quern_scatter(shape, whole, m->rows[r][k], 0, m->grain, n);
		}
	}
}

/* The impulse is spread over the substeps: the path of a grain is moved by (n + 1 - 2 a)/(2 n) dt dv, if it gets the impulse of a
 * substep after the share a of that. With the whole dt dv the scheme is unstable: docs/theory/hybrid.md, section 2. */
quern_real quern_hybrid_move(const hybrid *h, const quern_step *s, int32_t i, const quern_real velocity[3]) {
	const quern_column *u = s->use;
	const quern_real share = quern_hybrid_path(h, s);
	quern_real way = 0;
	for (uint32_t a = 0; a < s->dim; a++) {
		const quern_real jump = velocity[a] - u[B_VELOCITY].real[a][i];
		u[B_VELOCITY].real[a][i] = velocity[a];
		u[B_POSITION].real[a][i] += share * jump;
		u[B_LENT].real[a][i] = jump / s->dt;
		const quern_real d = u[B_POSITION].real[a][i] - u[B_ANCHOR].real[a][i];
		way += d * d;
	}
	return way;
}

static void keep_grains(const back_work *w, back_memory *m, uint32_t n, int32_t *coupled) {
	for (uint32_t k = 0; k < n; k++) {
		for (uint32_t a = 0; a < w->s->dim; a++) w->then[a][m->grain[k]] = m->velocity[a][k];
		coupled[k] = m->grain[k];
		if (w->calm.part)
			calm_note(&w->calm, k, (uint32_t)m->grain[k], m->gradient, m->trip.pic, w->then, w->s->dim);
	}
}

static void move_grains(const back_work *w, uint32_t b, const int32_t *coupled, uint32_t n) {
	if (w->calm.part) calm_block(&w->calm, &w->grains, coupled, 0, n, w->then, w->s->dim);
	for (uint32_t k = 0; k < n; k++) {
		quern_real velocity[3] = { 0 };
		for (uint32_t a = 0; a < w->s->dim; a++) velocity[a] = w->then[a][coupled[k]];
		const quern_real way = quern_hybrid_move(w->h, w->s, coupled[k], velocity);
		w->farthest[b] = way > w->farthest[b] ? way : w->farthest[b];
	}
}

QUERN_INLINE void back_block(const back_work *w, back_memory *m, uint32_t b, const int dim, const bool last) {
	const uint32_t end = w->at.begin[b + 1];
	int32_t *coupled = w->coupled + w->at.begin[b];
	uint32_t n_coupled = 0;
	if (!load_continuum(w->g, &w->at, w->node, b, m->mass)) return;
	load_mixture(w, m, b, dim);
	trips_begin_block(&w->trips, &m->trip, b, last);
	for (uint32_t i = w->at.begin[b]; i < end; i += STENCIL) {
		const uint32_t most = end - i < STENCIL ? end - i : STENCIL;
		const uint32_t n = find_coupled(w, m, b, w->at.grain + i, most, dim);
		if (!n) continue;
		load_coupled(w, m, n, dim);
		call_transfer(w, m, n, last);
		if (last) keep_grains(w, m, n, coupled + n_coupled);
		n_coupled += n;
		for (uint32_t k = 0; k < n && !last; k++)
			trips_send(&w->trips, &m->trip, k, cloud_mass(&w->grains, (uint32_t)m->grain[k]), dim);
	}
	if (last) move_grains(w, b, coupled, n_coupled);
	trips_end_block(&w->trips, &m->trip, b, last);
}

static void back_run(void *arg, uint32_t b, uint32_t worker, bool last) {
	const back_work *w = arg;
	back_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m) return;
	if (w->s->dim == 2) {
		if (last) back_block(w, m, b, 2, true);
		else back_block(w, m, b, 2, false);
	} else if (last) back_block(w, m, b, 3, true);
	else back_block(w, m, b, 3, false);
}
static void back_one(void *arg, uint32_t b, uint32_t worker) { back_run(arg, b, worker, true); }
static void send_one(void *arg, uint32_t b, uint32_t next, uint32_t worker) {
	(void)next;
	back_run(arg, b, worker, false);
}

quern_status quern_hybrid_back(const void *self, const quern_step *s) {
	const quern_column *u = s->use;
	back_work w = { .h = self,
		.s = s,
		.g = s->host->grid(s->run),
		.grains = { .mass = u[B_MASS].real[0], .weight = u[B_WEIGHT].real[0] },
		.node = (const quern_row *)(void *)u[B_NODE].real[0],
		.mixture = (const quern_row *)(void *)u[B_MIXTURE].real[0] };
	w.trips = (trips) { .s = s, .g = w.g, .transfer = &s->slot[SLOT_TRANSFER][0], .node = w.mixture };
	if (w.h->solves) return quern_hybrid_solve(w.h, s);
	if (!s->host->set(s->run, "point").n) return QUERN_OK;
	if (!quern_hybrid_residents(s, &u[B_POSITION], u[B_FIXED].index, &w.at)) return QUERN_E_MEMORY;
	w.farthest = s->host->memory(s->run, ((size_t)w.g->n_blocks + 1) * sizeof(quern_real));
	w.coupled = s->host->memory(s->run, ((size_t)w.at.begin[w.g->n_blocks] + 1) * sizeof(int32_t));
	/* grains whose cloud ends have nothing below them that holds them one by one: at rest they move as the grid does */
	w.calm = (calm) { .rate = w.h->rest, .share = 1 };
	const uint32_t n = s->host->set(s->run, "grain").n;
	bool good = w.farthest && w.coupled && calm_init(&w.calm, s, n) == QUERN_OK;
	for (uint32_t a = 0; a < s->dim && good; a++)
		good = (w.then[a] = s->host->memory(s->run, ((size_t)n + 1) * sizeof(quern_real)));
	if (!good || trips_run(&w.trips, send_one, &w) != QUERN_OK) return QUERN_E_MEMORY;
	s->host->parallel(s->run, w.g->n_blocks, back_one, &w);
	quern_real *farthest = u[B_DISPLACEMENT].real[0];
	for (uint32_t b = 0; b < w.g->n_blocks; b++) {
		const quern_real way = sqrt(w.farthest[b]);
		*farthest = way > *farthest ? way : *farthest;
	}
	return QUERN_OK;
}
