/* SPDX-License-Identifier: MIT */
/* solve - a coupling that sees all nodes and grains at once: what they bring to it, and what it changes. docs/theory/hybrid.md,
 * section 2 */
#include "solve.h"
#include "meet.h"
#include <math.h>

enum { N = QUERN_BLOCK_CELLS };

typedef struct {
	const hybrid *h;
	const quern_step *s;
	const quern_grid_view *g;
	residents at;
	const quern_row *node;
	quern_row *motion;
	int32_t *number; /* by entry of the nodes: among those that are coupled; -1: not yet one */
	uint32_t n_nodes, n_grains, n_values; /* coupled */
	uint32_t *entry;                      /* by node */
	quern_real *mass, *velocity[3], *before[3];
	int32_t *grain; /* by grain: its entry */
	quern_real *grain_mass, *grain_weight, *grain_velocity[3];
	uint32_t *row, *node_of; /* by grain and one more; by value */
	quern_real *value, *way[3];
} solve_work;

typedef struct {
	quern_row mass[QUERN_TILE_MOST];
	stencil stencil;
} solve_memory;

static void *take(const solve_work *w, size_t n, size_t size) {
	return w->s->host->memory(w->s->run, (n + 1) * size);
}

/* ---- what grains and nodes bring ---- */

static uint32_t number_of(solve_work *w, int32_t entry) {
	if (w->number[entry] < 0) {
		w->number[entry] = (int32_t)w->n_nodes;
		w->entry[w->n_nodes++] = (uint32_t)entry;
	}
	return (uint32_t)w->number[entry];
}

/* The row of grain k of the stencil; `write`: it is written, else counted alone. */
static uint32_t add_row(solve_work *w, const solve_memory *m, uint32_t b, uint32_t k, bool write) {
	const int dim = (int)w->s->dim;
	const int32_t span = (int32_t)w->g->span, *tile = w->g->tile + (size_t)b * w->g->tile_size;
	const stencil *s = &m->stencil;
	uint32_t n = 0;
	for (int i = 0; i < (dim == 3 ? 27 : 9); i++) {
		const int at[3] = { i % 3, i / 3 % 3, i / 9 };
		const int32_t place = s->node[k] + (at[2] * span + at[1]) * span + at[0];
		quern_real value = 1;
		for (int a = 0; a < dim; a++) value *= s->value[a][at[a]][k];
		if (!(value > 0) || !(m->mass[place][0] > 0)) continue;
		const uint32_t q = w->n_values + n++;
		if (!write) continue;
		w->node_of[q] = number_of(w, tile[place]);
		w->value[q] = value;
		for (int a = 0; a < dim; a++)
			w->way[a][q] = (s->first[a][k] + at[a]) * w->g->cell - s->position[a][k];
	}
	return n;
}

/* Grains that meet continuum, block by block; the first time they are counted. */
static bool add_rows(solve_work *w, bool write) {
	const quern_step *s = w->s;
	const quern_real *weight = s->use[B_WEIGHT].real[0];
	solve_memory *m = s->host->scratch(s->run, 0, sizeof *m);
	if (!m) return false;
	w->n_grains = w->n_values = 0;
	for (uint32_t q = 0; q < w->g->n_blocks; q++) {
		const uint32_t b = quern_nth(w->g->by_place, q);
		if (!load_continuum(w->g, &w->at, w->node, b, m->mass)) continue;
		for (uint32_t i = w->at.begin[b]; i < w->at.begin[b + 1]; i += STENCIL) {
			const uint32_t left = w->at.begin[b + 1] - i, n = left < STENCIL ? left : STENCIL;
			const int32_t *grain = w->at.grain + i;
			stencil_make(w->g, &s->slot[SLOT_SHAPE][0], b, s->use[B_POSITION].real, 0, grain, n, &m->stencil);
			for (uint32_t k = 0; k < n; k++) {
				const uint32_t more = weight[grain[k]] > 0 ? add_row(w, m, b, k, write) : 0;
				if (!more) continue;
				if (write) w->row[w->n_grains] = w->n_values, w->grain[w->n_grains] = grain[k];
				w->n_grains++;
				w->n_values += more;
			}
		}
	}
	if (write) w->row[w->n_grains] = w->n_values;
	return true;
}

static bool make_room(solve_work *w) {
	const size_t entries = (size_t)w->g->n_blocks * N, grains = w->n_grains, values = w->n_values;
	bool good =
		(w->number = take(w, entries, sizeof(int32_t))) && (w->entry = take(w, entries, sizeof(uint32_t))) &&
		(w->grain = take(w, grains, sizeof(int32_t))) && (w->row = take(w, grains + 1, sizeof(uint32_t))) &&
		(w->node_of = take(w, values, sizeof(uint32_t))) &&
		(w->value = take(w, values, sizeof(quern_real))) &&
		(w->grain_mass = take(w, grains, sizeof(quern_real))) &&
		(w->grain_weight = take(w, grains, sizeof(quern_real)));
	for (uint32_t a = 0; a < w->s->dim; a++)
		good = good && (w->way[a] = take(w, values, sizeof(quern_real))) &&
			   (w->grain_velocity[a] = take(w, grains, sizeof(quern_real)));
	for (size_t i = 0; i < entries && good; i++) w->number[i] = -1;
	return good;
}

/* Once all nodes have a number. */
static bool load(solve_work *w) {
	const quern_column *u = w->s->use;
	bool good = (w->mass = take(w, w->n_nodes, sizeof(quern_real)));
	for (uint32_t a = 0; a < w->s->dim; a++)
		good = good && (w->velocity[a] = take(w, w->n_nodes, sizeof(quern_real))) &&
			   (w->before[a] = take(w, w->n_nodes, sizeof(quern_real)));
	if (!good) return false;
	for (uint32_t i = 0; i < w->n_nodes; i++) {
		w->mass[i] = w->node[w->entry[i]][0];
		for (uint32_t a = 0; a < w->s->dim; a++)
			w->before[a][i] = w->velocity[a][i] = w->motion[w->entry[i]][a];
	}
	for (uint32_t k = 0; k < w->n_grains; k++) {
		const int32_t i = w->grain[k];
		w->grain_mass[k] = u[B_MASS].real[0][i];
		w->grain_weight[k] = u[B_WEIGHT].real[0][i];
		for (uint32_t a = 0; a < w->s->dim; a++) w->grain_velocity[a][k] = u[B_VELOCITY].real[a][i];
	}
	return true;
}

static quern_status call(const solve_work *w) {
	const quern_bound *coupling = &w->s->slot[SLOT_COUPLING][0];
	quern_coupling_system c = { .dim = w->s->dim,
		.n_nodes = w->n_nodes,
		.n_grains = w->n_grains,
		.dt = w->s->dt,
		.mass = w->mass,
		.row = w->row,
		.node = w->node_of,
		.value = w->value,
		.grain_mass = w->grain_mass,
		.grain_weight = w->grain_weight,
		.host = w->s->host,
		.run = w->s->run };
	for (uint32_t a = 0; a < c.dim; a++) {
		c.velocity[a] = w->velocity[a];
		c.way[a] = w->way[a];
		c.grain_velocity[a] = w->grain_velocity[a];
	}
	return ((const quern_coupling_ops *)coupling->ops)->solve(coupling->self, &c);
}

/* ---- what has become of it ---- */

typedef struct {
	quern_real made, there, taken; /* kg m/s that came from nowhere, and of all; J */
} verdict;

QUERN_INLINE void judge(verdict *v, quern_real mass, quern_real before, quern_real after) {
	v->made += mass * (after - before);
	v->there += mass * fabs(before);
	v->taken += 0.5 * mass * (before * before - after * after);
}

static verdict store(const solve_work *w, uint32_t a) {
	const quern_column *u = w->s->use;
	verdict v = { 0, 0, 0 };
	for (uint32_t i = 0; i < w->n_nodes; i++) {
		const quern_real now = w->velocity[a][i], before = w->before[a][i];
		judge(&v, w->mass[i], before, now);
		w->motion[w->entry[i]][a] = now;
		w->motion[w->entry[i]][w->s->dim + a] += now - before;
	}
	for (uint32_t k = 0; k < w->n_grains; k++)
		judge(&v, w->grain_weight[k] * w->grain_mass[k], u[B_VELOCITY].real[a][w->grain[k]],
			w->grain_velocity[a][k]);
	return v;
}

static void move_all(const solve_work *w) {
	quern_real farthest = 0;
	for (uint32_t k = 0; k < w->n_grains; k++) {
		quern_real velocity[3] = { 0 };
		for (uint32_t a = 0; a < w->s->dim; a++) velocity[a] = w->grain_velocity[a][k];
		const quern_real way = quern_hybrid_move(w->h, w->s, w->grain[k], velocity);
		farthest = way > farthest ? way : farthest;
	}
	quern_real *displacement = w->s->use[B_DISPLACEMENT].real[0];
	*displacement = sqrt(farthest) > *displacement ? sqrt(farthest) : *displacement;
}

/* Sums over all, not node by node: what a system keeps is the momentum of all together. */
static void close_books(const solve_work *w) {
	const quern_column *u = w->s->use;
	quern_real worst = 0, taken = 0;
	for (uint32_t a = 0; a < w->s->dim; a++) {
		const verdict v = store(w, a);
		if (!(fabs(v.made) <= worst * v.there)) worst = v.there > 0 ? fabs(v.made) / v.there : INFINITY;
		taken += v.taken;
	}
	u[B_EXCHANGE].real[0][0] = worst;
	if (u[B_ENERGY].real[0]) u[B_ENERGY].real[0][0] += taken;
	move_all(w);
}

quern_status quern_hybrid_solve(const hybrid *h, const quern_step *s) {
	const quern_column *u = s->use;
	solve_work w = { .h = h,
		.s = s,
		.g = s->host->grid(s->run),
		.node = (const quern_row *)(void *)u[B_NODE].real[0],
		.motion = (quern_row *)(void *)u[B_MOTION].real[0] };
	u[B_EXCHANGE].real[0][0] = 0;
	if (!s->host->set(s->run, "point").n) return QUERN_OK;
	if (!quern_hybrid_residents(s, &u[B_POSITION], u[B_FIXED].index, &w.at) || !add_rows(&w, false) ||
		!make_room(&w) || !add_rows(&w, true) || !load(&w))
		return QUERN_E_MEMORY;
	if (!w.n_grains) return QUERN_OK;
	const quern_status status = call(&w);
	if (status == QUERN_OK) close_books(&w);
	return status;
}
