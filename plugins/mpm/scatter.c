/* SPDX-License-Identifier: MIT */
/* scatter - points to nodes: mass, momentum and internal force in one row, block by block in coloured order */
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
} scatter_work;

typedef struct {
	quern_row tile[QUERN_TILE_MOST];
	stencil stencil;
} scatter_memory;

QUERN_INLINE sent send_point(const quern_column *u, uint32_t i, const int dim) {
	const quern_real weight = u[SCATTER_WEIGHT].real[0] ? u[SCATTER_WEIGHT].real[0][i] : 1;
	const quern_real m = weight * u[SCATTER_MASS].real[0][i], volume = -weight * u[SCATTER_VOLUME].real[0][i];
	quern_real *const *v = u[SCATTER_VELOCITY].real;
	const symmetric t = SYMMETRIC_AT(u[SCATTER_STRESS].real, i, dim);
	quern_real *const *l = u[SCATTER_AFFINE].real; /* m (v + L (x_i - x)) */
	sent p;
	if (dim == 2) {
		p.base = PARTED(m, m * v[0][i], m * v[1][i]);
		p.slope[0] = PARTED(0, 0, 0, volume * t.xx, volume * t.xy);
		p.slope[1] = PARTED(0, 0, 0, volume * t.xy, volume * t.yy);
		p.slope[2] = PARTED(0);
	} else {
		p.base = PARTED(m, m * v[0][i], m * v[1][i], m * v[2][i]);
		p.slope[0] = PARTED(0, 0, 0, 0, volume * t.xx, volume * t.xy, volume * t.xz);
		p.slope[1] = PARTED(0, 0, 0, 0, volume * t.xy, volume * t.yy, volume * t.yz);
		p.slope[2] = PARTED(0, 0, 0, 0, volume * t.xz, volume * t.yz, volume * t.zz);
	}
	for (int a = 0; a < 3; a++)
		p.along[a] = !l[0] || a >= dim
						 ? PARTED(0)
						 : PARTED(0, m * l[a][i], m * l[dim + a][i], dim == 3 ? m * l[2 * dim + a][i] : 0);
	return p;
}

/* Each point in parts to the cells whose centres are around it; their rows are those of the nodes at their lower corners. What a face of the
 * domain leaves without a cell goes to the one beside it. */
QUERN_INLINE void count_point(
	const scatter_work *w, scatter_memory *m, uint32_t b, uint32_t i, quern_real mass, const int dim) {
	const quern_grid_view *g = w->g;
	uint32_t to[3][2];
	quern_real part[3][2];
	for (int k = 0; k < dim; k++) {
		const int32_t begins = g->at[b][k] * (int32_t)g->edge;
		/* the tile begins a cell before the block, and centres lie half a cell above nodes */
		const quern_real x = m->stencil.position[k][i] / g->cell - begins + 0.5;
		const int32_t below = x > 0 ? (int32_t)x : 0, cell = begins + below - 1;
		to[k][0] = (uint32_t)(!g->periodic[k] && cell < 0 ? below + 1 : below);
		to[k][1] = (uint32_t)(!g->periodic[k] && cell + 1 >= g->cells[k] ? below : below + 1);
		part[k][1] = x - below;
		part[k][0] = 1 - part[k][1];
	}
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

QUERN_INLINE void scatter_block(const scatter_work *w, scatter_memory *m, uint32_t b, const int dim) {
	const quern_column *u = w->s->use;
	const uint32_t begin = w->point[b], end = w->point[b + 1];
	const quern_row split =
		dim == 2 ? (quern_row) { 0, 0, 0, 1, 1, 0, 0, 0 } : (quern_row) { 0, 0, 0, 0, 1, 1, 1, 0 };
	if (begin == end) return;
	memset(m->tile, 0, w->g->tile_size * sizeof(quern_row));
	for (uint32_t i = begin; i < end; i += STENCIL) {
		const uint32_t n = end - i < STENCIL ? end - i : STENCIL;
		stencil_make(w->g, &w->s->slot[SLOT_SHAPE][0], b, u[SCATTER_POSITION].real, i, NULL, n, &m->stencil);
		for (uint32_t k = 0; k < n; k++) {
			const sent p = send_point(u, i + k, dim);
			stencil_scatter(&m->stencil, k, &p, &split, m->tile, dim, w->g->cell, (int32_t)w->g->span);
			if (w->counts) count_point(w, m, b, k, u[SCATTER_MASS].real[0][i + k], dim);
		}
	}
	quern_tile_add(w->g, w->node, b, m->tile);
}

static void scatter_2d(void *arg, uint32_t b, uint32_t worker) {
	const scatter_work *w = arg;
	scatter_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (m) scatter_block(w, m, b, 2);
}
static void scatter_3d(void *arg, uint32_t b, uint32_t worker) {
	const scatter_work *w = arg;
	scatter_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (m) scatter_block(w, m, b, 3);
}

quern_status quern_mpm_scatter(const void *self, const quern_step *s) {
	const quern_set_view points = s->host->set(s->run, "point");
	scatter_work w = { .s = s,
		.g = s->host->grid(s->run),
		.point = points.block,
		.node = (quern_row *)(void *)s->use[SCATTER_NODE_MASS].real[0] };
	if (((const mpm *)self)->alone) {
		int32_t *uncounted = s->use[SCATTER_UNCOUNTED].index;
		/* a stage of the scene begins as a scene that starts from the state before it would */
		w.counts = s->step == s->stage_step || *uncounted % COUNT_EVERY == 0;
		*uncounted = w.counts ? 1 : *uncounted + 1;
	}
	if (points.n) stencil_by_colour(s, w.g, s->dim == 2 ? scatter_2d : scatter_3d, &w);
	return QUERN_OK;
}
