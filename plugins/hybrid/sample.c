/* SPDX-License-Identifier: MIT */
/* sample - contact stress by cell, for points that are made there: docs/theory/hybrid.md, section 4 */
#include "../common/symmetric.h"
#include "hybrid.h"
#include <math.h>
#include <string.h>

enum { N = QUERN_BLOCK_CELLS };

typedef struct {
	const quern_step *s;
	const quern_grid_view *g;
	quern_real one_over_volume;
	int32_t block, at[3]; /* where the last contact was */
} sampling;

/* Entry of a cell; neighbours in space are mostly neighbours in the list, so the last block is tried first. */
static int32_t entry_of(sampling *p, int32_t cell[3]) {
	const int32_t edge = (int32_t)p->g->edge;
	int32_t at[3], place = 0;
	for (int k = 2; k >= 0; k--) {
		const uint32_t axis = (uint32_t)k;
		if (axis < p->g->dim && p->g->periodic[k]) cell[k] = (cell[k] + p->g->cells[k]) % p->g->cells[k];
		else if (axis < p->g->dim) { /* what would go behind a wall stays before it */
			cell[k] = cell[k] < 0 ? 0 : cell[k];
			cell[k] = cell[k] < p->g->cells[k] ? cell[k] : p->g->cells[k] - 1;
		}
		at[k] = cell[k] / edge;
		place = place * edge + cell[k] % edge;
	}
	if (p->block < 0 || memcmp(at, p->at, sizeof at) != 0) {
		p->block = quern_grid_block(p->g, at);
		memcpy(p->at, at, sizeof at);
	}
	return p->block < 0 ? -1 : p->block * N + place;
}

/* -1/V (f b + b f)/2, shared out by hats centred at the cells. */
static void add(sampling *p, const quern_real x[3], const quern_real f[3], const quern_real b[3]) {
	const uint32_t dim = p->s->dim;
	const quern_column *stress = &p->s->use[S_STRESS];
	int32_t low[3] = { 0 };
	quern_real part[3] = { 0 };
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real t = (x[k] - p->g->lower[k]) / p->g->cell - 0.5;
		low[k] = (int32_t)floor(t);
		part[k] = t - floor(t);
	}
	for (uint32_t corner = 0; corner < 1u << dim; corner++) {
		int32_t cell[3] = { 0 };
		quern_real w = -p->one_over_volume;
		for (uint32_t k = 0; k < dim; k++) {
			cell[k] = low[k] + (int32_t)(corner >> k & 1);
			w *= corner >> k & 1 ? part[k] : 1 - part[k];
		}
		const int32_t c = entry_of(p, cell);
		if (c < 0) continue;
		const symmetric share = symmetric_dyad(w, QUERN_VEC_OF(f), QUERN_VEC_OF(b));
		SYMMETRIC_ADD(stress->real, c, share, dim);
	}
}

/* Pairs across blocks stand in both; they count where the first is at home. */
static void sample_contacts(sampling *p) {
	const quern_step *s = p->s;
	const quern_column *u = s->use;
	const quern_set_view contacts = s->host->set(s->run, "contact"), grains = s->host->set(s->run, "grain");
	const int32_t *fixed = u[S_FIXED].index;
	for (uint32_t b = 0; b < contacts.n_blocks; b++)
		for (uint32_t q = contacts.block[b]; q < contacts.block[b + 1]; q++) {
			const int32_t i = u[S_FIRST].index[q], j = u[S_SECOND].index[q];
			quern_real n[3] = { 0 }, x[3] = { 0 }, f[3] = { 0 }, distance2 = 0, force2 = 0;
			if (i < (int32_t)grains.block[b] || i >= (int32_t)grains.block[b + 1]) continue;
			for (uint32_t k = 0; k < s->dim; k++) {
				const quern_real length = s->upper[k] - s->lower[k];
				f[k] = u[S_FORCE].real[k][q];
				n[k] = u[S_POSITION].real[k][i] - u[S_POSITION].real[k][j];
				if (s->periodic[k]) n[k] -= length * floor(n[k] / length + 0.5);
				distance2 += n[k] * n[k];
				force2 += f[k] * f[k];
			}
			if (!(force2 > 0) || !(distance2 > 0)) continue;
			const quern_real ri = u[S_RADIUS].real[0][i], rj = u[S_RADIUS].real[0][j], share = ri / (ri + rj);
			const bool held_i = fixed && fixed[i], held_j = fixed && fixed[j];
			const quern_real branch = held_j ? share : held_i ? 1 - share : 1;
			for (uint32_t k = 0; k < s->dim; k++) {
				x[k] = u[S_POSITION].real[k][i] - share * n[k];
				n[k] *= branch;
			}
			add(p, x, f, n);
		}
}

/* Touches with bodies: the branch goes from the surface to the grain's centre. */
static void sample_touches(sampling *p) {
	const quern_step *s = p->s;
	const quern_column *u = s->use;
	for (uint32_t q = 0; q < s->host->set(s->run, "touch").n; q++) {
		const int32_t i = u[S_TOUCH_GRAIN].index[q];
		const quern_bound *body = &s->slot[SLOT_BODIES][u[S_TOUCH_BODY].index[q]];
		const quern_real radius = u[S_RADIUS].real[0][i];
		quern_real f[3] = { 0 }, x[3] = { 0 }, branch[3], force2 = 0;
		for (uint32_t k = 0; k < s->dim; k++) {
			f[k] = u[S_TOUCH_FORCE].real[k][q];
			x[k] = u[S_POSITION].real[k][i];
			force2 += f[k] * f[k];
		}
		if (!(force2 > 0)) continue;
		const bool several = ((const quern_body_ops *)body->ops)->features;
		const int32_t *feature = several ? u[S_TOUCH_FEATURE].index + q : NULL;
		const quern_real gap = quern_body_gap_of(body, feature, s->dim, x, radius, branch);
		for (uint32_t k = 0; k < s->dim; k++) {
			branch[k] *= radius + gap;
			x[k] -= branch[k];
		}
		add(p, x, f, branch);
	}
}

quern_status quern_hybrid_sample(const void *self, const quern_step *s) {
	const hybrid *h = self;
	/* the first update comes after one step: it too must find a sample */
	const bool first = s->step == 0 && s->substep + 1 == s->n_substeps;
	if (s->settling || ((s->substep + 1) % h->sample_every && !first)) return QUERN_OK;
	sampling p = { .s = s, .g = s->host->grid(s->run), .block = -1 };
	p.one_over_volume = 1 / quern_grid_cell_volume(p.g);
	sample_contacts(&p);
	if (s->use[S_TOUCH_FORCE].real[0]) sample_touches(&p);
	s->use[S_SAMPLES].real[0][0]++;
	return QUERN_OK;
}
