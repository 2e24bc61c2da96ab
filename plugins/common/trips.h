/* SPDX-License-Identifier: MIT */
/* trips - from nodes to particles through a transfer, and round trips before that: what a transfer sends goes to the
 * nodes with the particles' mass, and its echo comes back. For points and grains alike. */
#pragma once
#include "fit.h"
#include "tools.h"
#include <quern/transfer.h>
#include <string.h>

typedef struct trips {
	const quern_step *s;
	const quern_grid_view *g;
	const quern_bound *transfer;
	const quern_row *node; /* mass in lane 0 */
	quern_row *sent;       /* by node: in this round trip */
	quern_row *echo;       /* by node: what was sent in the last one, per mass; NULL before */
	uint32_t pass;
} trips;

/* A worker's. */
typedef struct trip_memory {
	quern_row sent[QUERN_TILE_MOST], echoes[QUERN_TILE_MOST];
	stencil stencil;
	_Alignas(64) quern_real pic[3][STENCIL], change[3][STENCIL], echo[3][STENCIL], send[3][STENCIL];
} trip_memory;

/* ---- block by block ---- */

static inline void trips_begin_block(const trips *t, trip_memory *m, uint32_t b, bool last) {
	if (t->echo) quern_tile_load(t->g, t->echo, b, m->echoes);
	if (!last) memset(m->sent, 0, t->g->tile_size * sizeof(quern_row));
}

static inline void trips_end_block(const trips *t, const trip_memory *m, uint32_t b, bool last) {
	if (!last) quern_tile_add(t->g, t->sent, b, m->sent);
}

/* ---- for n particles, whose stencil stands in the memory ---- */

/* What nodes say at particle i: its velocity from lane `from` on, and behind that the change. */
QUERN_INLINE void trips_hear(trip_memory *m, uint32_t i, const quern_row *row, int from, const int dim) {
	for (int k = 0; k < dim; k++) {
		m->pic[k][i] = (*row)[from + k];
		m->change[k][i] = (*row)[from + dim + k];
	}
}

QUERN_INLINE void trips_hear_echo(const trips *t, trip_memory *m, uint32_t n, const int dim) {
	for (uint32_t i = 0; i < n && t->echo; i++) {
		quern_row v[4];
		stencil_gather(&m->stencil, i, m->echoes, dim, false, v);
		for (int k = 0; k < dim; k++) m->echo[k][i] = v[0][k];
	}
}

/* `own`: the columns of the transfer's uses; `fit`: of a transfer that sends a matrix, else NULL. */
static inline void trips_call(const trips *t, trip_memory *m, fit_memory *fit, quern_real *const velocity[3],
	const quern_column *own, uint32_t n, bool last) {
	const uint32_t dim = t->s->dim;
	quern_transfer_batch b = { .n = n, .cap = STENCIL, .pass = t->pass, .dt = t->s->dt, .use = own };
	for (uint32_t k = 0; k < dim * dim && fit && last; k++)
		b.fit[k] = fit->fit[k], b.affine[k] = fit->affine[k], b.shift[k / dim] = fit->shift[k / dim];
	for (uint32_t k = 0; k < dim; k++) {
		b.pic[k] = m->pic[k];
		b.change[k] = m->change[k];
		b.echo[k] = t->echo ? m->echo[k] : NULL;
		b.send[k] = last ? NULL : m->send[k];
		b.velocity[k] = velocity[k];
	}
	((const quern_transfer_ops *)t->transfer->ops)->gather[dim - 2](t->transfer->self, &b);
}

/* What particle i, that carries so much mass, sends. */
QUERN_INLINE void trips_send(const trips *t, trip_memory *m, uint32_t i, quern_real mass, const int dim) {
	sent p = { 0 };
	p.base = PARTED(mass * m->send[0][i], mass * m->send[1][i], dim == 3 ? mass * m->send[2][i] : 0);
	stencil_scatter(&m->stencil, i, &p, SENDS_BASE, m->sent, dim, t->g->cell);
}

/* ---- all blocks ---- */

/* All round trips; `send` is what a block does in one, and afterwards the last pass is left to do. */
static inline quern_status trips_run(trips *t, stencil_body *send, void *arg) {
	const quern_step *s = t->s;
	const uint32_t passes = quern_transfer_trips(t->transfer->ops, t->transfer->self);
	const size_t nodes = (size_t)t->g->n_blocks * QUERN_BLOCK_CELLS;
	if (!passes) return QUERN_OK;
	quern_row *echo = s->host->memory(s->run, nodes * sizeof(quern_row));
	t->sent = s->host->memory(s->run, nodes * sizeof(quern_row));
	if (!t->sent || !echo) return QUERN_E_MEMORY;
	for (; t->pass < passes; t->pass++) {
		memset(t->sent, 0, nodes * sizeof(quern_row));
		stencil_by_colour(s, t->g, send, arg);
		for (size_t i = 0; i < nodes; i++)
			echo[i] = t->node[i][0] > NO_MASS ? t->sent[i] * (1 / t->node[i][0]) : (quern_row) { 0 };
		t->echo = echo;
	}
	return QUERN_OK;
}
