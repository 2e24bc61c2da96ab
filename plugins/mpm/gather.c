/* SPDX-License-Identifier: MIT */
/* gather - nodes to points, chunk by chunk: velocity, position, volume, stress */
#include "../common/stencil.h"
#include "mpm.h"
#include <math.h>
#include <string.h>

typedef struct {
	const quern_step *s;
	const quern_grid_view *g;
	const uint32_t *point, *list;
	const quern_row *motion, *node;
	quern_row *trip; /* by node: what points send in this round trip */
	quern_row *echo; /* by node: what they sent in the last one, per mass */
	uint32_t pass, passes;
	int32_t *bad, *moved; /* by block: first bad point or -1; whether one has left the tile */
} gather_work;

typedef struct {
	quern_row tile[QUERN_TILE_MOST], other[QUERN_TILE_MOST], trip[QUERN_TILE_MOST];
	stencil stencil;
	_Alignas(64) quern_real pic[3][STENCIL], change[3][STENCIL], gradient[9][STENCIL], grid_density[STENCIL],
		density[STENCIL], moved[STENCIL], echo[3][STENCIL], send[3][STENCIL], wave[STENCIL], energy[STENCIL];
} gather_memory;

/* What the nodes say at the points of a chunk. */
QUERN_INLINE void collect_chunk(
	const gather_work *w, gather_memory *m, uint32_t n, const int dim, const bool slopes) {
	for (uint32_t i = 0; i < n; i++) {
		quern_row v[4];
		stencil_gather(&m->stencil, i, m->tile, dim, slopes, v, (int32_t)w->g->span);
		for (int k = 0; k < dim; k++) {
			m->pic[k][i] = v[0][k];
			m->change[k][i] = v[0][dim + k];
			for (int a = 0; a < dim && slopes; a++) m->gradient[dim * k + a][i] = v[1 + a][k];
		}
		m->grid_density[i] = v[0][2 * dim];
	}
	for (uint32_t i = 0; i < n && w->echo; i++) {
		quern_row v[4];
		stencil_gather(&m->stencil, i, m->other, dim, false, v, (int32_t)w->g->span);
		for (int k = 0; k < dim; k++) m->echo[k][i] = v[0][k];
	}
}

static void call_transfer(const gather_work *w, gather_memory *m, uint32_t begin, uint32_t n, bool last) {
	const quern_bound *transfer = &w->s->slot[SLOT_TRANSFER][0];
	const uint32_t dim = w->s->dim;
	quern_column own[QUERN_MOST_USES];
	quern_transfer_batch b = { .n = n, .cap = STENCIL, .pass = w->pass, .dt = w->s->dt, .use = own };
	for (uint32_t r = 0; r < transfer->n_uses; r++)
		own[r] = quern_column_from(transfer->column[r], transfer->uses[r].shape, begin);
	for (uint32_t k = 0; k < dim; k++) {
		b.pic[k] = m->pic[k];
		b.change[k] = m->change[k];
		b.echo[k] = w->echo ? m->echo[k] : NULL;
		b.send[k] = last ? NULL : m->send[k];
		b.velocity[k] = w->s->use[GATHER_VELOCITY].real[k] + begin;
	}
	((const quern_transfer_ops *)transfer->ops)->gather[dim - 2](transfer->self, &b);
}

/* x += dt sum S v; V *= det(1 + dt L); true density m/V */
QUERN_INLINE void move_chunk(
	const gather_work *w, gather_memory *m, uint32_t b, uint32_t begin, uint32_t n, const int dim) {
	const quern_column *u = w->s->use;
	const quern_real dt = w->s->dt;
	const quern_real *restrict mass = u[GATHER_MASS].real[0] + begin;
	quern_real *restrict volume = u[GATHER_VOLUME].real[0] + begin, *restrict density = m->density,
						 *restrict moved = m->moved;
	const quern_real *restrict l0 = m->gradient[0], *restrict l1 = m->gradient[1],
							   *restrict l2 = m->gradient[2];
	const quern_real *restrict l3 = m->gradient[3], *restrict l4 = m->gradient[4],
							   *restrict l5 = m->gradient[5];
	const quern_real *restrict l6 = m->gradient[6], *restrict l7 = m->gradient[7],
							   *restrict l8 = m->gradient[8];
	for (int k = 0; k < dim; k++) {
		quern_real *restrict x = u[GATHER_POSITION].real[k] + begin;
		const quern_real *restrict v = m->pic[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) x[i] += dt * v[i];
		for (uint32_t i = 0; i < n; i++)
			if (!stencil_holds(w->g, b, (uint32_t)k, x[i])) w->moved[b] = 1;
	}
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		quern_real det;
		if (dim == 2) det = (1 + dt * l0[i]) * (1 + dt * l3[i]) - dt * l1[i] * dt * l2[i];
		else {
			const quern_real a = 1 + dt * l0[i], e = 1 + dt * l4[i], k = 1 + dt * l8[i];
			det = a * (e * k - dt * l5[i] * dt * l7[i]) -
				  dt * l1[i] * (dt * l3[i] * k - dt * l5[i] * dt * l6[i]) +
				  dt * l2[i] * (dt * l3[i] * dt * l7[i] - e * dt * l6[i]);
		}
		volume[i] *= det;
		moved[i] = volume[i];
		density[i] = mass[i] / volume[i];
	}
}

static void call_material(const gather_work *w, gather_memory *m, uint32_t begin, uint32_t n) {
	const quern_bound *material = &w->s->slot[SLOT_MATERIAL][0];
	const quern_column *u = w->s->use;
	const uint32_t dim = w->s->dim;
	quern_column own[QUERN_MOST_USES];
	quern_material_batch b = { .n = n,
		.cap = STENCIL,
		.dt = w->s->dt,
		.grid_density = m->grid_density,
		.density = m->density,
		.use = own };
	for (uint32_t k = 0; k < dim * dim; k++) b.gradient[k] = m->gradient[k];
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, dim); k++)
		b.stress[k] = u[GATHER_STRESS].real[k] + begin;
	if (u[GATHER_WAVE].real[0]) b.wave_speed = u[GATHER_WAVE].real[0] + begin;
	if (u[GATHER_ENERGY].real[0]) b.energy = u[GATHER_ENERGY].real[0] + begin;
	for (uint32_t r = 0; r < material->n_uses; r++)
		own[r] = quern_column_from(material->column[r], material->uses[r].shape, begin);
	((const quern_material_ops *)material->ops)->update[dim - 2](material->self, &b);
}

/* What the material left: volume from its density, what is stored for others, and whether all is sound. */
static void finish_chunk(
	const gather_work *w, const gather_memory *m, uint32_t b, uint32_t begin, uint32_t n) {
	const quern_column *u = w->s->use;
	const uint32_t dim = w->s->dim;
	const quern_real *restrict mass = u[GATHER_MASS].real[0] + begin, most = w->g->cell / w->s->dt;
	quern_real *restrict volume = u[GATHER_VOLUME].real[0] + begin;
	/* whatever a material makes of a negative density, a point that was turned inside out stays so */
	for (uint32_t i = 0; i < n; i++) volume[i] = m->moved[i] > 0 ? mass[i] / m->density[i] : m->moved[i];
	for (int row = GATHER_GRADIENT; row <= GATHER_AFFINE; row++)
		for (uint32_t k = 0; k < dim * dim && u[row].real[0]; k++)
			memcpy(u[row].real[k] + begin, m->gradient[k], n * sizeof(quern_real));
	for (uint32_t i = 0; i < n && u[GATHER_PRESSURE].real[0]; i++) {
		quern_real trace = 0;
		for (uint32_t k = 0; k < dim; k++) trace += u[GATHER_STRESS].real[k][begin + i];
		u[GATHER_PRESSURE].real[0][begin + i] = -trace / dim;
	}
	for (uint32_t i = 0; i < n; i++) {
		quern_real speed2 = 0, sum = volume[i];
		for (uint32_t k = 0; k < dim; k++) speed2 += m->pic[k][i] * m->pic[k][i];
		for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, dim); k++)
			sum += fabs(u[GATHER_STRESS].real[k][begin + i]);
		if (speed2 <= most * most && sum < INFINITY && volume[i] > 0) continue;
		if (w->bad[b] < 0) w->bad[b] = (int32_t)(begin + i);
	}
}

static void load_tiles(const gather_work *w, gather_memory *m, uint32_t b) {
	quern_tile_load(w->g, w->motion, b, m->tile);
	if (w->echo) quern_tile_load(w->g, w->echo, b, m->other);
}

QUERN_INLINE void gather_block(const gather_work *w, gather_memory *m, uint32_t b, const int dim) {
	const uint32_t begin = w->point[b], end = w->point[b + 1];
	if (begin == end) return;
	load_tiles(w, m, b);
	for (uint32_t i = begin; i < end; i += STENCIL) {
		const uint32_t n = end - i < STENCIL ? end - i : STENCIL;
		stencil_make(
			w->g, &w->s->slot[SLOT_SHAPE][0], b, w->s->use[GATHER_POSITION].real, i, NULL, n, &m->stencil);
		collect_chunk(w, m, n, dim, true);
		call_transfer(w, m, i, n, true);
		move_chunk(w, m, b, i, n, dim);
		call_material(w, m, i, n);
		finish_chunk(w, m, b, i, n);
	}
}

/* One round trip: each point's transfer says what to send, and it goes to the nodes with the point's mass. */
QUERN_INLINE void send_block(const gather_work *w, gather_memory *m, uint32_t b, const int dim) {
	const quern_column *u = w->s->use;
	const uint32_t begin = w->point[b], end = w->point[b + 1];
	if (begin == end) return;
	load_tiles(w, m, b);
	memset(m->trip, 0, w->g->tile_size * sizeof(quern_row));
	for (uint32_t i = begin; i < end; i += STENCIL) {
		const uint32_t n = end - i < STENCIL ? end - i : STENCIL;
		stencil_make(w->g, &w->s->slot[SLOT_SHAPE][0], b, u[GATHER_POSITION].real, i, NULL, n, &m->stencil);
		collect_chunk(w, m, n, dim, false);
		call_transfer(w, m, i, n, false);
		for (uint32_t k = 0; k < n; k++) {
			const quern_real mass = u[GATHER_MASS].real[0][i + k] *
									(u[GATHER_WEIGHT].real[0] ? u[GATHER_WEIGHT].real[0][i + k] : 1);
			sent p = { .base = { 0 } };
			for (int a = 0; a < dim; a++) p.base[a] = mass * m->send[a][k];
			stencil_scatter(
				&m->stencil, k, &p, &(quern_row) { 0 }, m->trip, dim, w->g->cell, (int32_t)w->g->span);
		}
	}
	quern_tile_add(w->g, w->trip, b, m->trip);
}

static void run_block(void *arg, uint32_t i, uint32_t worker, bool last) {
	const gather_work *w = arg;
	const uint32_t b = w->list ? w->list[i] : i;
	gather_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m) w->bad[b] = 0;
	else if (w->s->dim == 2) {
		if (last) gather_block(w, m, b, 2);
		else send_block(w, m, b, 2);
	} else if (last) gather_block(w, m, b, 3);
	else send_block(w, m, b, 3);
}
static void gather_one(void *arg, uint32_t i, uint32_t worker) { run_block(arg, i, worker, true); }
static void send_one(void *arg, uint32_t i, uint32_t worker) { run_block(arg, i, worker, false); }

static quern_status round_trip(gather_work *w, quern_row *trip, quern_row *echo) {
	const quern_step *s = w->s;
	const size_t nodes = (size_t)w->g->n_blocks * QUERN_BLOCK_CELLS;
	memset(trip, 0, nodes * sizeof(quern_row));
	w->trip = trip;
	for (uint32_t c = 0; c < w->g->n_colours; c++) {
		w->list = w->g->by_colour + w->g->colour[c];
		s->host->parallel(s->run, w->g->colour[c + 1] - w->g->colour[c], send_one, w);
	}
	w->list = NULL;
	for (size_t i = 0; i < nodes; i++)
		echo[i] = w->node[i][0] > 0 ? trip[i] * (1 / w->node[i][0]) : (quern_row) { 0 };
	w->echo = echo;
	return QUERN_OK;
}

static quern_status lost(const gather_work *w, int32_t i) {
	const quern_step *s = w->s;
	const quern_column *u = s->use;
	const quern_real volume = u[GATHER_VOLUME].real[0][i], x = u[GATHER_POSITION].real[0][i],
					 y = u[GATHER_POSITION].real[1][i];
	const char *material = s->slot[SLOT_MATERIAL][0].id;
	quern_real v2 = 0, stress = 0;
	for (uint32_t k = 0; k < s->dim; k++) v2 += u[GATHER_VELOCITY].real[k][i] * u[GATHER_VELOCITY].real[k][i];
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, s->dim); k++)
		stress += fabs(u[GATHER_STRESS].real[k][i]);
	if (!isfinite(v2))
		return s->host->stop(s->run, QUERN_E_NUMERIC, "point", i,
			"point.velocity is not a number after %s: is the step of %.3g s too long?", material, s->dt);
	if (!(volume > 0 && volume < INFINITY))
		return s->host->stop(s->run, QUERN_E_NUMERIC, "point", i,
			"point.volume at (%.4g, %.4g) m is turned inside out by one step of %.3g s (%s): unstable, or "
			"the step is "
			"too long",
			x, y, s->dt, material);
	if (!isfinite(stress))
		return s->host->stop(s->run, QUERN_E_NUMERIC, "point", i,
			"point.stress at (%.4g, %.4g) m is not a number after %s: is the step of %.3g s too long?", x, y,
			material, s->dt);
	return s->host->stop(s->run, QUERN_E_NUMERIC, "point", i,
		"at (%.4g, %.4g) m, point.velocity %.3g m/s, goes farther than a cell in one step of %.3g s (%s): "
		"unstable, or "
		"the step is too long",
		x, y, sqrt(v2), s->dt, material);
}

quern_status quern_mpm_gather(const void *self, const quern_step *s) {
	const quern_set_view points = s->host->set(s->run, "point");
	gather_work w = { .s = s,
		.g = s->host->grid(s->run),
		.point = points.block,
		.motion = (const quern_row *)(const void *)s->use[GATHER_MOTION].real[0],
		.node = (const quern_row *)(const void *)s->use[GATHER_NODE].real[0],
		.passes = ((const quern_transfer_ops *)s->slot[SLOT_TRANSFER][0].ops)->passes };
	(void)self;
	if (!points.n) return QUERN_OK;
	const size_t row_bytes = (size_t)w.g->n_blocks * QUERN_BLOCK_CELLS * sizeof(quern_row);
	w.bad = s->host->memory(s->run, w.g->n_blocks * sizeof(int32_t));
	w.moved = s->host->memory(s->run, w.g->n_blocks * sizeof(int32_t));
	quern_row *trip = w.passes ? s->host->memory(s->run, row_bytes) : NULL;
	quern_row *echo = w.passes ? s->host->memory(s->run, row_bytes) : NULL;
	if (!w.bad || !w.moved || (w.passes && (!trip || !echo))) return QUERN_E_MEMORY;
	for (uint32_t b = 0; b < w.g->n_blocks; b++) w.bad[b] = -1;
	for (; w.pass < w.passes; w.pass++) round_trip(&w, trip, echo);
	s->host->parallel(s->run, w.g->n_blocks, gather_one, &w);
	for (uint32_t b = 0; b < w.g->n_blocks; b++)
		if (w.bad[b] >= 0) return lost(&w, w.bad[b]);
	for (uint32_t b = 0; b < w.g->n_blocks; b++)
		if (w.moved[b]) s->use[GATHER_UNSORTED].index[0] = 1;
	return QUERN_OK;
}
