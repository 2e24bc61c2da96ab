/* SPDX-License-Identifier: MIT */
/* couple - grains and continuum meet at the nodes: grains to nodes, an exchange of momentum, and back to the grains */
#include "../common/sort.h"
#include "../common/stencil.h"
#include "hybrid.h"
#include <math.h>
#include <string.h>

enum { N = QUERN_BLOCK_CELLS };

/* ---- which grains belong to which block ---- */

typedef struct {
	uint32_t *begin; /* by block, n_blocks + 1 */
	int32_t *grain;  /* moving grains, by block and then in their own order */
} residents;

/* A grain that has left the grid, or never was on it, meets no continuum. */
static int32_t block_of(
	const quern_grid_view *g, quern_real *const x[3], uint32_t i, quern_grid_cursor *last) {
	quern_real at[3];
	int32_t cell[3];
	quern_grid_position(g, x, i, at);
	if (!quern_grid_cell_at(g, at, cell)) return -1;
	const int32_t entry = quern_grid_entry_near(g, last, cell);
	return entry < 0 ? -1 : entry / N;
}

static bool find_residents(const quern_step *s, const quern_column *x, const int32_t *fixed, residents *r) {
	const quern_grid_view *g = s->host->grid(s->run);
	const uint32_t n = s->host->set(s->run, "grain").n;
	int32_t *block = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	r->begin = s->host->memory(s->run, ((size_t)g->n_blocks + 2) * sizeof(uint32_t));
	r->grain = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	if (!block || !r->begin || !r->grain) return false;
	quern_grid_cursor last = { .block = -1 };
	for (uint32_t i = 0; i < n; i++) block[i] = fixed && fixed[i] ? -1 : block_of(g, x->real, i, &last);
	quern_bucket(n, block, g->n_blocks, r->begin, r->grain);
	return true;
}

/* Seen from a grain: whether any node that it reaches holds continuum, and whether all hold more than the least. A node that
 * only the rim of a point reaches may move at any speed, and a grain would take its gradient from it with full weight. */
typedef struct {
	bool any, all;
} company;

QUERN_INLINE company company_of(
	const stencil *s, uint32_t i, const quern_row *tile, const int dim, int32_t span, quern_real least) {
	company c = { false, true };
	for (int z = 0; z < (dim == 3 ? 3 : 1); z++)
		for (int y = 0; y < 3; y++)
			for (int x = 0; x < 3; x++) {
				const quern_real w =
					s->value[0][x][i] * s->value[1][y][i] * (dim == 3 ? s->value[2][z][i] : 1);
				if (!(w > 0)) continue;
				const quern_real mass = tile[s->node[i] + (z * span + y) * span + x][0];
				c.any = c.any || mass > 0;
				c.all = c.all && mass > least;
			}
	return c;
}

static bool has_continuum(const quern_row *tile, uint32_t n) {
	for (uint32_t i = 0; i < n; i++)
		if (tile[i][0] > 0) return true;
	return false;
}

/* ---- grains to nodes ---- */

typedef struct {
	const hybrid *h;
	const quern_step *s;
	const quern_grid_view *g;
	residents at;
	const uint32_t *list;
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
	const raster_work *w, const raster_memory *m, uint32_t k, int32_t i, bool affine, const int dim) {
	const quern_column *u = w->s->use;
	const quern_real mass = u[R_WEIGHT].real[0][i] * u[R_MASS].real[0][i];
	sent p = { .base = { 0 } };
	p.base[0] = mass;
	for (int a = 0; a < dim; a++) p.base[1 + a] = mass * u[R_VELOCITY].real[a][i];
	if (!affine) return p;
	quern_row v[4];
	stencil_gather(&m->stencil, k, m->motion, dim, true, v, (int32_t)w->g->span);
	for (int a = 0; a < dim; a++)
		for (int c = 0; c < dim; c++) p.along[a][1 + c] = mass * v[1 + a][c];
	return p;
}

QUERN_INLINE void raster_block(const raster_work *w, raster_memory *m, uint32_t b, const int dim) {
	const uint32_t begin = w->at.begin[b], end = w->at.begin[b + 1];
	const quern_real least = 0.01 * w->h->packed * quern_grid_cell_volume(w->g);
	if (begin == end) return;
	quern_tile_load(w->g, w->node, b, m->mass);
	if (!has_continuum(m->mass, w->g->tile_size)) return;
	if (w->h->affine) quern_tile_load(w->g, w->motion, b, m->motion);
	memset(m->sum, 0, w->g->tile_size * sizeof(quern_row));
	for (uint32_t i = begin; i < end; i += STENCIL) {
		const uint32_t n = end - i < STENCIL ? end - i : STENCIL;
		const int32_t *grain = w->at.grain + i;
		stencil_make(
			w->g, &w->s->slot[SLOT_SHAPE][0], b, w->s->use[R_POSITION].real, 0, grain, n, &m->stencil);
		for (uint32_t k = 0; k < n; k++) {
			const company c = company_of(&m->stencil, k, m->mass, dim, (int32_t)w->g->span, least);
			if (!c.any || !(w->s->use[R_WEIGHT].real[0][grain[k]] > 0)) continue;
			const sent p = send_grain(w, m, k, grain[k], w->h->affine && c.all, dim);
			stencil_scatter(
				&m->stencil, k, &p, &(quern_row) { 0 }, m->sum, dim, w->g->cell, (int32_t)w->g->span);
		}
	}
	quern_tile_add(w->g, w->mixture, b, m->sum);
}

static void raster_one(void *arg, uint32_t i, uint32_t worker) {
	const raster_work *w = arg;
	raster_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m) return;
	if (w->s->dim == 2) raster_block(w, m, w->list[i], 2);
	else raster_block(w, m, w->list[i], 3);
}

quern_status quern_hybrid_raster(const void *self, const quern_step *s) {
	raster_work w = { .h = self,
		.s = s,
		.g = s->host->grid(s->run),
		.node = (const quern_row *)(void *)s->use[R_NODE].real[0],
		.motion = (const quern_row *)(void *)s->use[R_MOTION].real[0],
		.mixture = (quern_row *)(void *)s->use[R_MIXTURE].real[0] };
	if (!s->host->set(s->run, "point").n) return QUERN_OK;
	if (!find_residents(s, &s->use[R_POSITION], s->use[R_FIXED].index, &w.at)) return QUERN_E_MEMORY;
	for (uint32_t c = 0; c < w.g->n_colours; c++) {
		w.list = w.g->by_colour + w.g->colour[c];
		s->host->parallel(s->run, w.g->colour[c + 1] - w.g->colour[c], raster_one, &w);
	}
	return QUERN_OK;
}

/* ---- at the nodes ---- */

typedef struct {
	const quern_step *s;
	const quern_row *node;
	quern_row *motion, *mixture;
	quern_real *energy, *defect; /* by block: of the inelastic exchange; of its momentum, relative */
} couple_work;

typedef struct {
	_Alignas(64) quern_real mass[N], other_mass[N], velocity[3][N], other[3][N], before[3][N], was[3][N];
	uint32_t node[N];
} couple_memory;

static uint32_t common_nodes(const couple_work *w, couple_memory *m, uint32_t b) {
	const uint32_t dim = w->s->dim;
	uint32_t n = 0;
	for (uint32_t i = 0; i < N; i++) {
		const size_t k = (size_t)b * N + i;
		if (!(w->node[k][0] > 0) || !(w->mixture[k][0] > 0)) continue;
		m->node[n] = i;
		m->mass[n] = w->node[k][0];
		m->other_mass[n] = w->mixture[k][0];
		for (uint32_t a = 0; a < dim; a++) {
			m->velocity[a][n] = m->before[a][n] = w->motion[k][a];
			m->other[a][n] = m->was[a][n] = w->mixture[k][1 + a] / w->mixture[k][0];
		}
		n++;
	}
	return n;
}

static void couple_block(void *arg, uint32_t b, uint32_t worker) {
	const couple_work *w = arg;
	const uint32_t dim = w->s->dim;
	couple_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	const uint32_t n = m ? common_nodes(w, m, b) : 0;
	if (!n) return;
	quern_coupling_job job = { .dim = dim, .n = n, .mass = m->mass, .other_mass = m->other_mass };
	for (uint32_t a = 0; a < dim; a++) job.velocity[a] = m->velocity[a], job.other[a] = m->other[a];
	const quern_bound *coupling = &w->s->slot[SLOT_COUPLING][0];
	((const quern_coupling_ops *)coupling->ops)->couple(coupling->self, &job);
	for (uint32_t q = 0; q < n; q++) {
		const size_t k = (size_t)b * N + m->node[q];
		const quern_real sum = m->mass[q] + m->other_mass[q];
		quern_real gap2 = 0;
		for (uint32_t a = 0; a < dim; a++) {
			const quern_real made = m->mass[q] * (m->velocity[a][q] - m->before[a][q]) +
									m->other_mass[q] * (m->other[a][q] - m->was[a][q]);
			const quern_real there =
				m->mass[q] * fabs(m->before[a][q]) + m->other_mass[q] * fabs(m->was[a][q]);
			if (fabs(made) > w->defect[b] * there) w->defect[b] = fabs(made) / there;
			const quern_real gap = m->before[a][q] - m->was[a][q];
			w->motion[k][a] = m->velocity[a][q];
			w->motion[k][dim + a] += m->velocity[a][q] - m->before[a][q];
			w->mixture[k][mixture_change(dim) + a] = m->other[a][q] - m->was[a][q];
			gap2 += gap * gap;
		}
		w->motion[k][2 * dim] *= sum / m->mass[q]; /* the density of both clouds */
		w->energy[b] += 0.5 * m->mass[q] * m->other_mass[q] / sum * gap2;
	}
}

quern_status quern_hybrid_couple(const void *self, const quern_step *s) {
	const quern_grid_view *g = s->host->grid(s->run);
	couple_work w = { .s = s,
		.node = (const quern_row *)(void *)s->use[C_NODE].real[0],
		.motion = (quern_row *)(void *)s->use[C_MOTION].real[0],
		.mixture = (quern_row *)(void *)s->use[C_MIXTURE].real[0] };
	(void)self;
	w.energy = s->host->memory(s->run, ((size_t)g->n_blocks + 1) * sizeof(quern_real));
	w.defect = s->host->memory(s->run, ((size_t)g->n_blocks + 1) * sizeof(quern_real));
	if (!w.energy || !w.defect) return QUERN_E_MEMORY;
	s->host->parallel(s->run, g->n_blocks, couple_block, &w);
	quern_real *worst = s->use[C_EXCHANGE].real[0];
	*worst = 0;
	for (uint32_t b = 0; b < g->n_blocks; b++) *worst = w.defect[b] > *worst ? w.defect[b] : *worst;
	if (s->use[C_ENERGY].real[0]) s->use[C_ENERGY].real[0][0] += s->host->sum(s->run, g->n_blocks, w.energy);
	return QUERN_OK;
}

/* ---- back to the grains ---- */

typedef struct {
	const hybrid *h;
	const quern_step *s;
	const quern_grid_view *g;
	residents at;
	const uint32_t *list;
	const quern_row *node, *mixture;
	quern_row *trip, *echo;
	uint32_t pass, passes;
	quern_real *farthest; /* by block */
} back_work;

typedef struct {
	quern_row mass[QUERN_TILE_MOST], mixture[QUERN_TILE_MOST], other[QUERN_TILE_MOST], trip[QUERN_TILE_MOST];
	stencil stencil;
	_Alignas(64) quern_real pic[3][STENCIL], change[3][STENCIL], echo[3][STENCIL], send[3][STENCIL],
		velocity[3][STENCIL];
	quern_real rows[QUERN_MOST_USES][9][STENCIL];
	int32_t grain[STENCIL];
} back_memory;

/* Grains of a chunk that were coupled, their velocities, and what the nodes say at their centres. */
QUERN_INLINE uint32_t load_coupled(
	const back_work *w, back_memory *m, uint32_t b, uint32_t begin, uint32_t n, const int dim) {
	const quern_column *u = w->s->use;
	const int32_t span = (int32_t)w->g->span;
	uint32_t kept = 0;
	stencil_make(
		w->g, &w->s->slot[SLOT_SHAPE][0], b, u[B_POSITION].real, 0, w->at.grain + begin, n, &m->stencil);
	for (uint32_t k = 0; k < n; k++) {
		const int32_t i = w->at.grain[begin + k];
		if (company_of(&m->stencil, k, m->mass, dim, span, 0).any && u[B_WEIGHT].real[0][i] > 0)
			m->grain[kept++] = i;
	}
	stencil_make(w->g, &w->s->slot[SLOT_SHAPE][0], b, u[B_POSITION].real, 0, m->grain, kept, &m->stencil);
	for (uint32_t k = 0; k < kept; k++) {
		quern_row v[4];
		stencil_gather(&m->stencil, k, m->mixture, dim, false, v, span);
		for (int a = 0; a < dim; a++) {
			m->velocity[a][k] = u[B_VELOCITY].real[a][m->grain[k]];
			m->pic[a][k] = v[0][1 + a];
			m->change[a][k] = v[0][1 + dim + a];
		}
		if (!w->echo) continue;
		stencil_gather(&m->stencil, k, m->other, dim, false, v, span);
		for (int a = 0; a < dim; a++) m->echo[a][k] = v[0][a];
	}
	return kept;
}

static void call_transfer(const back_work *w, back_memory *m, uint32_t n, bool last) {
	const quern_bound *transfer = &w->s->slot[SLOT_TRANSFER][0];
	const uint32_t dim = w->s->dim;
	quern_column own[QUERN_MOST_USES];
	quern_transfer_batch t = { .n = n, .cap = STENCIL, .pass = w->pass, .dt = w->s->dt, .use = own };
	for (uint32_t r = 0; r < transfer->n_uses; r++) {
		const uint8_t shape = transfer->uses[r].shape;
		own[r] = (quern_column) { .real = { NULL } };
		for (uint32_t k = 0; k < quern_shape_size(shape, dim); k++) {
			const void *whole = quern_component(&transfer->column[r], shape, k);
			if (!whole) continue;
			quern_gather(shape, m->rows[r][k], whole, 0, m->grain, n);
			quern_set_component(&own[r], shape, k, m->rows[r][k]);
		}
	}
	for (uint32_t a = 0; a < dim; a++) {
		t.pic[a] = m->pic[a];
		t.change[a] = m->change[a];
		t.echo[a] = w->echo ? m->echo[a] : NULL;
		t.send[a] = last ? NULL : m->send[a];
		t.velocity[a] = m->velocity[a];
	}
	((const quern_transfer_ops *)transfer->ops)->gather[dim - 2](transfer->self, &t);
	for (uint32_t r = 0; r < transfer->n_uses; r++) {
		const uint8_t shape = transfer->uses[r].shape;
		for (uint32_t k = 0; k < quern_shape_size(shape, dim) && transfer->uses[r].access != QUERN_READ;
			 k++) {
			void *whole = quern_component(&transfer->column[r], shape, k);
			if (whole) quern_scatter(shape, whole, m->rows[r][k], 0, m->grain, n);
		}
	}
}

/* The impulse is spread over the substeps: the path of a grain is moved by (n + 1)/(2 n) dt dv. With the whole dt dv
 * the scheme is unstable: docs/theory/hybrid.md, section 2. */
static void move_grains(const back_work *w, back_memory *m, uint32_t b, uint32_t n) {
	const quern_column *u = w->s->use;
	const quern_real share = 0.5 * (w->h->substeps + 1) / w->h->substeps * w->s->dt;
	for (uint32_t k = 0; k < n; k++) {
		const int32_t i = m->grain[k];
		quern_real way = 0;
		for (uint32_t a = 0; a < w->s->dim; a++) {
			const quern_real jump = m->velocity[a][k] - u[B_VELOCITY].real[a][i];
			u[B_VELOCITY].real[a][i] = m->velocity[a][k];
			u[B_POSITION].real[a][i] += share * jump;
			const quern_real d = u[B_POSITION].real[a][i] - u[B_ANCHOR].real[a][i];
			way += d * d;
		}
		w->farthest[b] = way > w->farthest[b] ? way : w->farthest[b];
	}
}

QUERN_INLINE void back_block(const back_work *w, back_memory *m, uint32_t b, const int dim, const bool last) {
	const uint32_t begin = w->at.begin[b], end = w->at.begin[b + 1];
	if (begin == end) return;
	quern_tile_load(w->g, w->node, b, m->mass);
	if (!has_continuum(m->mass, w->g->tile_size)) return;
	quern_tile_load(w->g, w->mixture, b, m->mixture);
	if (w->echo) quern_tile_load(w->g, w->echo, b, m->other);
	if (!last) memset(m->trip, 0, w->g->tile_size * sizeof(quern_row));
	for (uint32_t i = 0; i < w->g->tile_size; i++) { /* momentum to the velocity after the exchange */
		const quern_real one_over = m->mixture[i][0] > 0 ? 1 / m->mixture[i][0] : 0;
		for (int a = 0; a < dim; a++)
			m->mixture[i][1 + a] = m->mixture[i][1 + a] * one_over + m->mixture[i][1 + dim + a];
	}
	for (uint32_t i = begin; i < end; i += STENCIL) {
		const uint32_t n = load_coupled(w, m, b, i, end - i < STENCIL ? end - i : STENCIL, dim);
		if (!n) continue;
		call_transfer(w, m, n, last);
		if (last) move_grains(w, m, b, n);
		for (uint32_t k = 0; k < n && !last; k++) {
			const quern_real mass =
				w->s->use[B_MASS].real[0][m->grain[k]] * w->s->use[B_WEIGHT].real[0][m->grain[k]];
			sent p = { .base = { 0 } };
			for (int a = 0; a < dim; a++) p.base[a] = mass * m->send[a][k];
			stencil_scatter(
				&m->stencil, k, &p, &(quern_row) { 0 }, m->trip, dim, w->g->cell, (int32_t)w->g->span);
		}
	}
	if (!last) quern_tile_add(w->g, w->trip, b, m->trip);
}

static void back_run(void *arg, uint32_t i, uint32_t worker, bool last) {
	const back_work *w = arg;
	const uint32_t b = w->list ? w->list[i] : i;
	back_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m) return;
	if (w->s->dim == 2) {
		if (last) back_block(w, m, b, 2, true);
		else back_block(w, m, b, 2, false);
	} else if (last) back_block(w, m, b, 3, true);
	else back_block(w, m, b, 3, false);
}
static void back_one(void *arg, uint32_t i, uint32_t worker) { back_run(arg, i, worker, true); }
static void send_one(void *arg, uint32_t i, uint32_t worker) { back_run(arg, i, worker, false); }

static void round_trip(back_work *w, quern_row *trip, quern_row *echo) {
	const size_t nodes = (size_t)w->g->n_blocks * N;
	memset(trip, 0, nodes * sizeof(quern_row));
	w->trip = trip;
	for (uint32_t c = 0; c < w->g->n_colours; c++) {
		w->list = w->g->by_colour + w->g->colour[c];
		w->s->host->parallel(w->s->run, w->g->colour[c + 1] - w->g->colour[c], send_one, w);
	}
	w->list = NULL;
	for (size_t i = 0; i < nodes; i++)
		echo[i] = w->mixture[i][0] > 0 ? trip[i] * (1 / w->mixture[i][0]) : (quern_row) { 0 };
	w->echo = echo;
}

quern_status quern_hybrid_back(const void *self, const quern_step *s) {
	back_work w = { .h = self,
		.s = s,
		.g = s->host->grid(s->run),
		.node = (const quern_row *)(void *)s->use[B_NODE].real[0],
		.mixture = (const quern_row *)(void *)s->use[B_MIXTURE].real[0],
		.passes = ((const quern_transfer_ops *)s->slot[SLOT_TRANSFER][0].ops)->passes };
	if (!s->host->set(s->run, "point").n) return QUERN_OK;
	if (!find_residents(s, &s->use[B_POSITION], s->use[B_FIXED].index, &w.at)) return QUERN_E_MEMORY;
	const size_t bytes = (size_t)w.g->n_blocks * N * sizeof(quern_row);
	w.farthest = s->host->memory(s->run, ((size_t)w.g->n_blocks + 1) * sizeof(quern_real));
	quern_row *trip = w.passes ? s->host->memory(s->run, bytes) : NULL,
			  *echo = w.passes ? s->host->memory(s->run, bytes) : NULL;
	if (!w.farthest || (w.passes && (!trip || !echo))) return QUERN_E_MEMORY;
	for (; w.pass < w.passes; w.pass++) round_trip(&w, trip, echo);
	s->host->parallel(s->run, w.g->n_blocks, back_one, &w);
	quern_real *farthest = s->use[B_DISPLACEMENT].real[0];
	for (uint32_t b = 0; b < w.g->n_blocks; b++) {
		const quern_real way = sqrt(w.farthest[b]);
		*farthest = way > *farthest ? way : *farthest;
	}
	return QUERN_OK;
}
