/* SPDX-License-Identifier: MIT */
/* couple - an exchange of momentum at the nodes where grains and continuum meet */
#include "hybrid.h"
#include <math.h>

enum { N = QUERN_BLOCK_CELLS };

typedef struct {
	const hybrid *h;
	const quern_step *s;
	const quern_row *node;
	quern_row *motion, *mixture;
	quern_real *energy, *defect; /* by block: of the inelastic exchange; of its momentum, relative */
} couple_work;

/* Nodes of a block that hold both: velocities after the exchange and before. */
typedef struct {
	_Alignas(64) quern_real mass[N], other_mass[N], velocity[3][N], other[3][N], before[3][N], was[3][N];
	uint32_t node[N], n;
} common_nodes;

static void load(const couple_work *w, common_nodes *m, uint32_t b) {
	const uint32_t dim = w->s->dim;
	m->n = 0;
	for (uint32_t i = 0; i < N; i++) {
		const size_t k = (size_t)b * N + i;
		const uint32_t q = m->n;
		if (!(w->node[k][0] > 0) || !(w->mixture[k][0] > 0)) continue;
		m->node[q] = i;
		m->mass[q] = w->node[k][0];
		m->other_mass[q] = w->mixture[k][0];
		for (uint32_t a = 0; a < dim; a++) {
			m->velocity[a][q] = m->before[a][q] = w->motion[k][a];
			m->other[a][q] = m->was[a][q] = w->mixture[k][1 + a] / w->mixture[k][0];
		}
		m->n++;
	}
}

static void call(const couple_work *w, common_nodes *m) {
	const quern_bound *coupling = &w->s->slot[SLOT_COUPLING][0];
	quern_coupling_job job = { .dim = w->s->dim, .n = m->n, .mass = m->mass, .other_mass = m->other_mass };
	for (uint32_t a = 0; a < job.dim; a++) job.velocity[a] = m->velocity[a], job.other[a] = m->other[a];
	((const quern_coupling_ops *)coupling->ops)->couple(coupling->self, &job);
}

/* Momentum that the exchange has made at node q, over what there was: the worst component. */
static quern_real defect_of(const common_nodes *m, uint32_t q, uint32_t dim, quern_real worst) {
	for (uint32_t a = 0; a < dim; a++) {
		const quern_real made = m->mass[q] * (m->velocity[a][q] - m->before[a][q]) +
								m->other_mass[q] * (m->other[a][q] - m->was[a][q]);
		const quern_real there = m->mass[q] * fabs(m->before[a][q]) + m->other_mass[q] * fabs(m->was[a][q]);
		if (fabs(made) > worst * there) worst = fabs(made) / there;
	}
	return worst;
}

/* J that an inelastic exchange at node q takes. */
static quern_real energy_of(const common_nodes *m, uint32_t q, uint32_t dim) {
	quern_real gap2 = 0;
	for (uint32_t a = 0; a < dim; a++) {
		const quern_real gap = m->before[a][q] - m->was[a][q];
		gap2 += gap * gap;
	}
	return 0.5 * m->mass[q] * m->other_mass[q] / (m->mass[q] + m->other_mass[q]) * gap2;
}

static void store(const couple_work *w, const common_nodes *m, uint32_t b, uint32_t q) {
	const uint32_t dim = w->s->dim;
	const size_t k = (size_t)b * N + m->node[q];
	for (uint32_t a = 0; a < dim; a++) {
		w->motion[k][a] = m->velocity[a][q];
		w->motion[k][dim + a] += m->velocity[a][q] - m->before[a][q];
		w->mixture[k][mixture_change(dim) + a] = m->other[a][q] - m->was[a][q];
	}
	w->motion[k][2 * dim] *= (m->mass[q] + m->other_mass[q]) / m->mass[q]; /* the density of both clouds */
}

static void couple_block(void *arg, uint32_t b, uint32_t worker) {
	const couple_work *w = arg;
	common_nodes *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m) return;
	load(w, m, b);
	if (m->n && !w->h->solves) call(w, m);
	for (uint32_t q = 0; q < m->n; q++) {
		store(w, m, b, q);
		w->defect[b] = defect_of(m, q, w->s->dim, w->defect[b]);
		w->energy[b] += w->h->solves ? 0 : energy_of(m, q, w->s->dim);
	}
}

quern_status quern_hybrid_couple(const void *self, const quern_step *s) {
	const quern_grid_view *g = s->host->grid(s->run);
	couple_work w = { .h = self,
		.s = s,
		.node = (const quern_row *)(void *)s->use[C_NODE].real[0],
		.motion = (quern_row *)(void *)s->use[C_MOTION].real[0],
		.mixture = (quern_row *)(void *)s->use[C_MIXTURE].real[0] };
	w.energy = s->host->memory(s->run, ((size_t)g->n_blocks + 1) * sizeof(quern_real));
	w.defect = s->host->memory(s->run, ((size_t)g->n_blocks + 1) * sizeof(quern_real));
	if (!w.energy || !w.defect) return QUERN_E_MEMORY;
	s->host->parallel(s->run, g->n_blocks, couple_block, &w);
	quern_real *worst = s->use[C_EXCHANGE].real[0];
	*worst = 0;
	quern_real taken = 0;
	for (uint32_t q = 0; q < g->n_blocks; q++) {
		const uint32_t b = quern_nth(g->by_place, q);
		*worst = w.defect[b] > *worst ? w.defect[b] : *worst;
		taken += w.energy[b];
	}
	if (s->use[C_ENERGY].real[0]) s->use[C_ENERGY].real[0][0] += taken;
	return QUERN_OK;
}
