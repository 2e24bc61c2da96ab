/* SPDX-License-Identifier: MIT */
/* scatter - points to nodes: mass, momentum and internal force in one row, block by block in coloured order */
#include "../common/ahead.h"
#include "../common/stencil.h"
#include "../common/symmetric.h"
#include "mpm.h"
#include <string.h>

typedef struct {
	const quern_step *s;
	const quern_grid_view *g;
	const uint32_t *point; /* partition by block */
	quern_row *node;
	bool counts; /* what cells hold */
	ahead ahead; /* columns of points, and nodes */
} scatter_work;

/* Of a chunk: mass and momentum; volume times stress, negative; mass times velocity gradient. */
typedef struct {
	quern_row tile[QUERN_TILE_MOST];
	stencil stencil;
	_Alignas(64) quern_real base[4][STENCIL], push[6][STENCIL], along[9][STENCIL];
} scatter_memory;

QUERN_INLINE void times(
	quern_real *restrict to, const quern_real *restrict by, const quern_real *restrict column, uint32_t n) {
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) to[i] = by[i] * column[i];
}

QUERN_INLINE void add_times(
	quern_real *restrict to, const quern_real *restrict by, const quern_real *restrict column, uint32_t n) {
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) to[i] += by[i] * column[i];
}

/* Column by column: point by point each would wait for memory in its turn. */
QUERN_INLINE void load_chunk(
	const quern_column *u, scatter_memory *m, uint32_t begin, uint32_t n, const int dim, const bool affine) {
	const quern_real *weight = u[SCATTER_WEIGHT].real[0];
	quern_real part[STENCIL], less[STENCIL], volume[STENCIL];
	for (uint32_t i = 0; i < n; i++) part[i] = weight ? weight[begin + i] : 1;
	for (uint32_t i = 0; i < n; i++) less[i] = -part[i];
	times(m->base[0], part, u[SCATTER_MASS].real[0] + begin, n);
	times(volume, less, u[SCATTER_VOLUME].real[0] + begin, n);
	for (int k = 0; k < dim; k++) times(m->base[1 + k], m->base[0], u[SCATTER_VELOCITY].real[k] + begin, n);
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, (uint32_t)dim); k++) {
		times(m->push[k], volume, u[SCATTER_STRESS].real[k] + begin, n);
		if (u[SCATTER_DASHPOT].real[0]) add_times(m->push[k], volume, u[SCATTER_DASHPOT].real[k] + begin, n);
	}
	for (int k = 0; k < dim * dim && affine; k++)
		times(m->along[k], m->base[0], u[SCATTER_AFFINE].real[k] + begin, n);
}

QUERN_INLINE sent send_point(scatter_memory *m, uint32_t i, const int dim, const bool affine) {
	quern_real *const push[] = { m->push[0], m->push[1], m->push[2], m->push[3], m->push[4], m->push[5] };
	const symmetric t = SYMMETRIC_AT(push, i, dim);
	sent p = { 0 };
	quern_real l[3][3] = { { 0 } }; /* m (v + L (x_i - x)) */
	for (int k = 0; k < dim * dim && affine; k++) l[k % dim][k / dim] = m->along[k][i];
	if (dim == 2) {
		p.base = PARTED(m->base[0][i], m->base[1][i], m->base[2][i]);
		p.lean[0] = PARTED(0, l[0][0], l[0][1], 0, t.xx, t.xy);
		p.lean[1] = PARTED(0, l[1][0], l[1][1], 0, t.xy, t.yy);
	} else {
		p.base = PARTED(m->base[0][i], m->base[1][i], m->base[2][i], m->base[3][i]);
		p.lean[0] = PARTED(0, l[0][0], l[0][1], l[0][2], 0, t.xx, t.xy, t.xz);
		p.lean[1] = PARTED(0, l[1][0], l[1][1], l[1][2], 0, t.xy, t.yy, t.yz);
		p.lean[2] = PARTED(0, l[2][0], l[2][1], l[2][2], 0, t.xz, t.yz, t.zz);
	}
	return p;
}

/* Each point in parts to the cells whose middles are around it. */
QUERN_INLINE void count_point(
	const scatter_work *w, scatter_memory *m, uint32_t b, uint32_t i, quern_real mass, const int dim) {
	const quern_grid_view *g = w->g;
	uint32_t to[3][2];
	quern_real part[3][2];
	for (int k = 0; k < dim; k++) stencil_cells(g, b, k, m->stencil.position[k][i], to[k], part[k]);
	for (int corner = 0; corner < 1 << dim; corner++) {
		uint32_t node = 0;
		quern_real share = mass;
		for (int k = dim; k-- > 0;) {
			node = node * g->span + to[k][corner >> k & 1];
			share *= part[k][corner >> k & 1];
		}
		m->tile[node][node_held((uint32_t)dim)] += share;
	}
}

QUERN_INLINE void scatter_block(
	const scatter_work *w, scatter_memory *m, uint32_t b, uint32_t next, const int dim, const bool affine) {
	const quern_column *u = w->s->use;
	const uint32_t begin = w->point[b], end = w->point[b + 1];
	if (begin == end) return;
	memset(m->tile, 0, w->g->tile_size * sizeof(quern_row));
	for (uint32_t i = begin; i < end; i += STENCIL) {
		const uint32_t n = end - i < STENCIL ? end - i : STENCIL;
		ahead_at at = ahead_from(&w->ahead, w->g, w->point, b, next, i, n);
		stencil_make(w->g, &w->s->slot[SLOT_SHAPE][0], b, u[SCATTER_POSITION].real, i, NULL, n, &m->stencil);
		load_chunk(u, m, i, n, dim, affine);
		for (uint32_t k = 0; k < n; k++) {
			ahead_ask(&w->ahead, w->node, &at);
			const sent p = send_point(m, k, dim, affine);
			stencil_scatter(&m->stencil, k, &p, affine ? SENDS_SLOPE | SENDS_ALONG : SENDS_SLOPE, m->tile,
				dim, w->g->cell);
			if (w->counts) count_point(w, m, b, k, u[SCATTER_MASS].real[0][i + k], dim);
		}
		for (uint32_t k = n; k < STENCIL; k++) ahead_ask(&w->ahead, w->node, &at);
	}
	quern_tile_add(w->g, w->node, b, m->tile);
}

static void scatter_one(void *arg, uint32_t b, uint32_t next, uint32_t worker) {
	const scatter_work *w = arg;
	const bool affine = w->s->use[SCATTER_AFFINE].real[0];
	scatter_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m) return;
	if (w->s->dim == 2) {
		if (affine) scatter_block(w, m, b, next, 2, true);
		else scatter_block(w, m, b, next, 2, false);
	} else if (affine) scatter_block(w, m, b, next, 3, true);
	else scatter_block(w, m, b, next, 3, false);
}

quern_status quern_mpm_scatter(const void *self, const quern_step *s) {
	const quern_set_view points = s->host->set(s->run, "point");
	scatter_work w = { .s = s,
		.g = s->host->grid(s->run),
		.point = points.block,
		.node = (quern_row *)(void *)s->use[SCATTER_NODE_MASS].real[0] };
	for (uint32_t k = SCATTER_POSITION; k <= SCATTER_AFFINE; k++) ahead_add(&w.ahead, &s->use[k]);
	ahead_end(&w.ahead, points.n);
	const mpm *p = self;
	if (p->counted) {
		int32_t *uncounted = s->use[SCATTER_UNCOUNTED].index;
		/* a stage of the scene begins as a scene that starts from the state before it would */
		const bool due = s->step == s->stage_step || *uncounted % COUNT_EVERY == 0;
		*uncounted = due ? 1 : *uncounted + 1;
		w.counts = due && p->alone;
	}
	if (points.n) stencil_by_colour(s, w.g, scatter_one, &w);
	return QUERN_OK;
}
