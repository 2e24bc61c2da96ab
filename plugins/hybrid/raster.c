/* SPDX-License-Identifier: MIT */
/* raster - grains to nodes: mass and momentum of those that meet continuum */
#include "lend.h"
#include "meet.h"
#include <string.h>

typedef struct {
	const hybrid *h;
	const quern_step *s;
	const quern_grid_view *g;
	cloud grains;
	residents at;
	const quern_row *node, *motion;
	quern_row *mixture;
} raster_work;

typedef struct {
	quern_row mass[QUERN_TILE_MOST], motion[QUERN_TILE_MOST], sum[QUERN_TILE_MOST];
	stencil stencil;
} raster_memory;

/* With an affine coupling a grain sends v + L (x_i - x), L of the continuum at its centre; where a node without
 * continuum is in reach, L is not known and taken as zero. */
QUERN_INLINE sent send_grain(
	const raster_work *w, const raster_memory *m, uint32_t k, uint32_t i, bool affine, const int dim) {
	const quern_real mass = cloud_mass(&w->grains, i);
	quern_real *const *u = w->s->use[R_VELOCITY].real;
	sent p = { 0 };
	p.base = PARTED(mass, mass * u[0][i], mass * u[1][i], dim == 3 ? mass * u[2][i] : 0);
	if (!affine) return p;
	quern_row v[4];
	stencil_gather(&m->stencil, k, m->motion, dim, true, v);
	for (int a = 0; a < dim; a++)
		p.lean[a] = PARTED(0, mass * v[1 + a][0], mass * v[1 + a][1], dim == 3 ? mass * v[1 + a][2] : 0);
	return p;
}

QUERN_INLINE void raster_block(const raster_work *w, raster_memory *m, uint32_t b, const int dim) {
	const uint32_t end = w->at.begin[b + 1];
	const int32_t span = (int32_t)w->g->span;
	const quern_real least = 0.01 * w->h->packed * quern_grid_cell_volume(w->g);
	if (!load_continuum(w->g, &w->at, w->node, b, m->mass)) return;
	if (w->h->affine) quern_tile_load(w->g, w->motion, b, m->motion);
	memset(m->sum, 0, w->g->tile_size * sizeof(quern_row));
	for (uint32_t i = w->at.begin[b]; i < end; i += STENCIL) {
		const uint32_t n = end - i < STENCIL ? end - i : STENCIL;
		const int32_t *grain = w->at.grain + i;
		stencil_make(
			w->g, &w->s->slot[SLOT_SHAPE][0], b, w->s->use[R_POSITION].real, 0, grain, n, &m->stencil);
		for (uint32_t k = 0; k < n; k++) {
			const company c = company_of(&m->stencil, k, m->mass, dim, span, least);
			if (!c.any || !(w->grains.weight[grain[k]] > 0)) continue;
			const sent p = send_grain(w, m, k, (uint32_t)grain[k], w->h->affine && c.all, dim);
			stencil_scatter(&m->stencil, k, &p, SENDS_ALONG, m->sum, dim, w->g->cell);
		}
	}
	quern_tile_add(w->g, w->mixture, b, m->sum);
}

static void raster_one(void *arg, uint32_t b, uint32_t next, uint32_t worker) {
	(void)next;
	const raster_work *w = arg;
	raster_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m) return;
	if (w->s->dim == 2) raster_block(w, m, b, 2);
	else raster_block(w, m, b, 3);
}

quern_status quern_hybrid_raster(const void *self, const quern_step *s) {
	const quern_column *u = s->use;
	raster_work w = { .h = self,
		.s = s,
		.g = s->host->grid(s->run),
		.grains = { .mass = u[R_MASS].real[0], .weight = u[R_WEIGHT].real[0] },
		.node = (const quern_row *)(void *)u[R_NODE].real[0],
		.motion = (const quern_row *)(void *)u[R_MOTION].real[0],
		.mixture = (quern_row *)(void *)u[R_MIXTURE].real[0] };
	const quern_status status = quern_hybrid_take_back(self, s);
	if (status != QUERN_OK) return status;
	if (!s->host->set(s->run, "point").n) return QUERN_OK;
	if (!quern_hybrid_residents(s, &u[R_POSITION], u[R_FIXED].index, &w.at)) return QUERN_E_MEMORY;
	stencil_by_colour(s, w.g, raster_one, &w);
	return QUERN_OK;
}
