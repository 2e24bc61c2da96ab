/* SPDX-License-Identifier: MIT */
/* sample - contact stress by cell, for points that are made there: docs/theory/hybrid.md, section 4 */
#include "../common/symmetric.h"
#include "contacts.h"
#include <math.h>
#include <string.h>

typedef struct {
	const quern_step *s;
	const quern_grid_view *g;
	quern_real one_over_volume;
	quern_grid_cursor last;
	const body_pose *pose; /* by body */
} sampling;

/* Entries of the cells at the corners of a hat, -1 for none. In the midst of a block one is looked for, and the others are
 * steps away. */
QUERN_INLINE void corners_of(sampling *p, const int32_t low[3], int32_t entry[8], const uint32_t dim) {
	const int shift = quern_block_shift(dim);
	const int32_t last = (1 << shift) - 1;
	bool together = true;
	for (uint32_t k = 0; k < dim; k++)
		together = together && low[k] >= 0 && (low[k] & last) != last && low[k] + 1 < p->g->cells[k];
	if (together) {
		const int32_t first = quern_grid_entry_near(p->g, &p->last, low);
		for (uint32_t corner = 0; corner < 1u << dim; corner++) {
			int32_t way = 0;
			for (uint32_t k = dim; k-- > 0;) way = way << shift | (int32_t)(corner >> k & 1);
			entry[corner] = first < 0 ? -1 : first + way;
		}
		return;
	}
	for (uint32_t corner = 0; corner < 1u << dim; corner++) {
		int32_t cell[3] = { 0 };
		for (uint32_t k = 0; k < dim; k++) cell[k] = low[k] + (int32_t)(corner >> k & 1);
		if (!quern_grid_bring_back(p->g, cell)) quern_grid_hold(p->g, cell);
		entry[corner] = quern_grid_entry_near(p->g, &p->last, cell);
	}
}

QUERN_INLINE void add_in(sampling *p, quern_vec at, quern_vec f, quern_vec b, const uint32_t dim) {
	const quern_real x[3] = { at.x, at.y, at.z };
	const quern_column *stress = &p->s->use[S_STRESS];
	int32_t low[3] = { 0 }, entry[8];
	quern_real part[3] = { 0 };
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real t = (x[k] - p->g->lower[k]) / p->g->cell - 0.5, below = floor(t);
		low[k] = (int32_t)below;
		part[k] = t - below;
	}
	corners_of(p, low, entry, dim);
	for (uint32_t corner = 0; corner < 1u << dim; corner++) {
		quern_real w = -p->one_over_volume;
		for (uint32_t k = 0; k < dim; k++) w *= corner >> k & 1 ? part[k] : 1 - part[k];
		if (entry[corner] < 0) continue;
		const symmetric share = symmetric_dyad(w, f, b);
		SYMMETRIC_ADD(stress->real, entry[corner], share, dim);
	}
}

/* -1/V (f b + b f)/2, shared out by hats centred at the cells; what would go behind a wall stays before it. */
static void add(sampling *p, quern_vec at, quern_vec f, quern_vec b) {
	if (p->s->dim == 2) add_in(p, at, f, b, 2);
	else add_in(p, at, f, b, 3);
}

/* The branch goes from centre to centre, or between a centre and the contact where the other grain is fixed: that one
 * is a wall. */
static void sample_contact(sampling *p, const contact_seen *c) {
	const quern_column *u = p->s->use;
	const int32_t *fixed = u[S_FIXED].index;
	if (!(c->force2 > 0) || !(c->distance2 > 0)) return;
	const quern_real ri = u[S_RADIUS].real[0][c->first], rj = u[S_RADIUS].real[0][c->second];
	const quern_real share = ri / (ri + rj);
	const bool held_i = fixed && fixed[c->first], held_j = fixed && fixed[c->second];
	const quern_real branch = held_j ? share : held_i ? 1 - share : 1;
	const quern_vec centre = QUERN_VEC_AT(u[S_POSITION].real, c->first, p->s->dim);
	add(p, quern_vec_axpy(-share, c->way, centre), c->force, quern_vec_scale(branch, c->way));
}

static void sample_contacts(sampling *p) {
	const contact_list list = contacts_of(p->s, S_FORCE, S_FIRST, S_SECOND, S_POSITION);
	contact_seen c;
	const uint32_t *by_place = p->s->host->parts(p->s->run, "contact")->by_place;
	for (uint32_t k = 0; k < list.contacts.n_blocks; k++) {
		const uint32_t b = quern_nth(by_place, k);
		for (uint32_t q = list.contacts.block[b]; q < list.contacts.block[b + 1]; q++)
			if (contact_at(&list, b, q, &c)) sample_contact(p, &c);
	}
}

/* On a body the branch goes from the surface to the grain's centre. */
static void sample_touch(sampling *p, uint32_t q) {
	const quern_step *s = p->s;
	const quern_column *u = s->use;
	const int32_t i = u[S_TOUCH_GRAIN].index[q];
	const int32_t k = u[S_TOUCH_BODY].index[q];
	const quern_bound *body = &s->slot[SLOT_BODIES][k];
	const quern_vec f = QUERN_VEC_AT(u[S_TOUCH_FORCE].real, q, s->dim),
					centre = QUERN_VEC_AT(u[S_POSITION].real, i, s->dim);
	if (!(quern_vec_dot(f, f, 3) > 0)) return;
	const bool several = ((const quern_body_ops *)body->ops)->features;
	const int32_t *feature = several ? u[S_TOUCH_FEATURE].index + q : NULL;
	const quern_real x[3] = { centre.x, centre.y, centre.z }, radius = u[S_RADIUS].real[0][i];
	quern_real normal[3];
	const quern_real gap = quern_body_gap_of(body, &p->pose[k], feature, s->dim, x, radius, normal);
	const quern_vec branch = quern_vec_scale(radius + gap, QUERN_VEC_OF(normal));
	add(p, quern_vec_sub(centre, branch), f, branch);
}

/* Looks at the grains between two steps write forces of their own. */
static void keep_forces(const quern_step *s) {
	const uint32_t n = s->host->set(s->run, "contact").n;
	for (uint32_t k = 0; k < s->dim; k++)
		memcpy(s->use[S_BORNE].real[k], s->use[S_FORCE].real[k], n * sizeof(quern_real));
}

quern_status quern_hybrid_sample(const void *self, const quern_step *s) {
	const hybrid *h = self;
	if (!s->settling && s->step % h->every == 0 && s->within + 1 == s->n_substeps) keep_forces(s);
	/* the first update comes after one step: it too must find a sample */
	const bool first = s->step == 0 && s->substep + 1 == s->n_substeps;
	if (s->settling || ((s->substep + 1) % h->sample_every && !first)) return QUERN_OK;
	sampling p = { .s = s, .g = s->host->grid(s->run), .last = { .block = -1 } };
	p.one_over_volume = 1 / quern_grid_cell_volume(p.g);
	p.pose = quern_body_poses_now(s, SLOT_BODIES);
	if (!p.pose) return QUERN_E_MEMORY;
	sample_contacts(&p);
	const quern_parts *touches = s->host->parts(s->run, "touch");
	for (uint32_t q = 0; s->use[S_TOUCH_FORCE].real[0] && q < touches->n; q++)
		sample_touch(&p, quern_nth(touches->entry, q));
	s->use[S_SAMPLES].real[0][0]++;
	return QUERN_OK;
}
