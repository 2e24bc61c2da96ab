/* SPDX-License-Identifier: MIT */
/* sample - contact stress by cell, for points that are made there: docs/theory/hybrid.md, section 4 */
#include "../common/symmetric.h"
#include "contacts.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of a contact: where it is, its force, and the branch that it acts along. */
typedef struct {
	quern_vec at, force, branch;
} sampled;

/* Cells around the contacts of a block, and what these give to each, component by component. */
typedef struct {
	int32_t low[3], size[3];
	size_t cells;
	quern_real *sum;
	bool any, failed;
} window;

enum { MOST_CELLS = 1 << 14 };

typedef struct {
	const quern_step *s;
	const quern_grid_view *g;
	quern_real one_over_volume;
	quern_grid_cursor last;
	const body_pose *pose; /* by body */
	contact_list list;
	window *window; /* by block of contacts */
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

/* Where a hat at x begins, in cells, and how far x lies on from the middle of its lowest cell. */
QUERN_INLINE void hat_at(
	const quern_grid_view *g, quern_vec at, int32_t low[3], quern_real part[3], const uint32_t dim) {
	const quern_real x[3] = { at.x, at.y, at.z };
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real t = (x[k] - g->lower[k]) / g->cell - 0.5, below = floor(t);
		low[k] = (int32_t)below;
		part[k] = t - below;
	}
}

/* -1/V (f b + b f)/2, shared out by hats centred at the cells: to the entries of the corners. */
QUERN_INLINE void share_out(quern_real *const stress[6], const int32_t entry[8], const quern_real part[3],
	quern_real one_over_volume, quern_vec f, quern_vec b, const uint32_t dim) {
	for (uint32_t corner = 0; corner < 1u << dim; corner++) {
		quern_real w = -one_over_volume;
		for (uint32_t k = 0; k < dim; k++) w *= corner >> k & 1 ? part[k] : 1 - part[k];
		if (entry[corner] < 0) continue;
		const symmetric share = symmetric_dyad(w, f, b);
		SYMMETRIC_ADD(stress, entry[corner], share, dim);
	}
}

/* What would go behind a wall stays before it. */
QUERN_INLINE void add_in(sampling *p, const sampled *c, const uint32_t dim) {
	int32_t low[3] = { 0 }, entry[8];
	quern_real part[3] = { 0 };
	hat_at(p->g, c->at, low, part, dim);
	corners_of(p, low, entry, dim);
	share_out(p->s->use[S_STRESS].real, entry, part, p->one_over_volume, c->force, c->branch, dim);
}

static void add(sampling *p, const sampled *c) {
	if (p->s->dim == 2) add_in(p, c, 2);
	else add_in(p, c, 3);
}

/* The branch goes from centre to centre, or between a centre and the contact where the other grain is fixed: that one
 * is a wall. */
QUERN_INLINE bool sample_of(const sampling *p, uint32_t b, uint32_t q, sampled *out, const uint32_t dim) {
	const quern_column *u = p->s->use;
	const int32_t *fixed = u[S_FIXED].index;
	contact_seen c;
	if (!contact_at(&p->list, b, q, &c) || !(c.force2 > 0) || !(c.distance2 > 0)) return false;
	const quern_real ri = u[S_RADIUS].real[0][c.first], rj = u[S_RADIUS].real[0][c.second];
	const quern_real share = ri / (ri + rj);
	const bool held_i = fixed && fixed[c.first], held_j = fixed && fixed[c.second];
	const quern_real branch = held_j ? share : held_i ? 1 - share : 1;
	const quern_vec centre = QUERN_VEC_AT(u[S_POSITION].real, c.first, dim);
	*out = (sampled) { quern_vec_axpy(-share, c.way, centre), c.force, quern_vec_scale(branch, c.way) };
	return true;
}

/* ---- the contacts of a block, in a window of cells of their own: sums do not depend on who is at work, and entries are looked for once a cell ---- */

QUERN_INLINE void find_window(const sampling *p, uint32_t b, window *w, const uint32_t dim) {
	const uint32_t *block = p->list.contacts.block;
	sampled c;
	for (uint32_t k = 0; k < dim; k++) w->low[k] = INT32_MAX, w->size[k] = INT32_MIN;
	for (uint32_t q = block[b]; q < block[b + 1]; q++) {
		int32_t low[3] = { 0 };
		quern_real part[3];
		if (!sample_of(p, b, q, &c, dim)) continue;
		hat_at(p->g, c.at, low, part, dim);
		for (uint32_t k = 0; k < dim; k++) {
			w->low[k] = low[k] < w->low[k] ? low[k] : w->low[k];
			w->size[k] = low[k] > w->size[k] ? low[k] : w->size[k];
		}
		w->any = true;
	}
	w->cells = 1;
	for (uint32_t k = 0; k < dim && w->any; k++) {
		w->size[k] += 2 - w->low[k];
		w->cells *= (size_t)w->size[k];
	}
}

QUERN_INLINE void fill_window(const sampling *p, uint32_t b, window *w, const uint32_t dim) {
	const uint32_t *block = p->list.contacts.block;
	quern_real *stress[6] = { NULL };
	int32_t way[8];
	sampled c;
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, dim); k++) stress[k] = w->sum + k * w->cells;
	for (uint32_t corner = 0; corner < 1u << dim; corner++) {
		way[corner] = 0;
		for (uint32_t k = dim; k-- > 0;) way[corner] = way[corner] * w->size[k] + (int32_t)(corner >> k & 1);
	}
	for (uint32_t q = block[b]; q < block[b + 1]; q++) {
		int32_t low[3] = { 0 }, entry[8], first = 0;
		quern_real part[3];
		if (!sample_of(p, b, q, &c, dim)) continue;
		hat_at(p->g, c.at, low, part, dim);
		for (uint32_t k = dim; k-- > 0;) first = first * w->size[k] + low[k] - w->low[k];
		for (uint32_t corner = 0; corner < 1u << dim; corner++) entry[corner] = first + way[corner];
		share_out(stress, entry, part, p->one_over_volume, c.force, c.branch, dim);
	}
}

QUERN_INLINE void sample_block(const sampling *p, uint32_t b, const uint32_t dim) {
	window *w = &p->window[b];
	*w = (window) { .size = { 1, 1, 1 } };
	find_window(p, b, w, dim);
	if (!w->any || w->cells > MOST_CELLS) return;
	w->sum = calloc(w->cells, quern_shape_size(QUERN_SYMMETRIC, dim) * sizeof(quern_real));
	w->failed = !w->sum;
	if (w->sum) fill_window(p, b, w, dim);
}

static void sample_one(void *arg, uint32_t b, uint32_t worker) {
	const sampling *p = arg;
	(void)worker;
	if (p->s->dim == 2) sample_block(p, b, 2);
	else sample_block(p, b, 3);
}

static void add_window(sampling *p, const window *w) {
	const uint32_t dim = p->s->dim, parts = quern_shape_size(QUERN_SYMMETRIC, dim);
	for (size_t i = 0; i < w->cells; i++) {
		size_t rest = i;
		int32_t cell[3] = { 0 };
		for (uint32_t k = 0; k < dim; k++) {
			cell[k] = w->low[k] + (int32_t)(rest % (size_t)w->size[k]);
			rest /= (size_t)w->size[k];
		}
		if (!quern_grid_bring_back(p->g, cell)) quern_grid_hold(p->g, cell);
		const int32_t entry = quern_grid_entry_near(p->g, &p->last, cell);
		for (uint32_t k = 0; k < parts && entry >= 0; k++)
			p->s->use[S_STRESS].real[k][entry] += w->sum[k * w->cells + i];
	}
}

/* Where the grains of a block lie far from each other, one by one. */
static void add_block(sampling *p, uint32_t b) {
	const uint32_t *block = p->list.contacts.block;
	sampled c;
	for (uint32_t q = block[b]; q < block[b + 1]; q++)
		if (sample_of(p, b, q, &c, p->s->dim)) add(p, &c);
}

static quern_status sample_contacts(sampling *p) {
	const quern_step *s = p->s;
	const uint32_t *by_place = s->host->parts(s->run, "contact")->by_place, n = p->list.contacts.n_blocks;
	bool failed = false;
	p->window = s->host->memory(s->run, ((size_t)n + 1) * sizeof *p->window);
	if (!p->window) return QUERN_E_MEMORY;
	s->host->parallel(s->run, n, sample_one, p);
	for (uint32_t q = 0; q < n; q++) {
		const uint32_t b = quern_nth(by_place, q);
		window *w = &p->window[b];
		failed = failed || w->failed;
		if (w->sum) add_window(p, w);
		else if (w->any) add_block(p, b);
		free(w->sum);
	}
	return failed ? QUERN_E_MEMORY : QUERN_OK;
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
	add(p, &(sampled) { quern_vec_sub(centre, branch), f, branch });
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
	p.list = contacts_of(s, S_FORCE, S_FIRST, S_SECOND, S_POSITION);
	if (sample_contacts(&p) != QUERN_OK) return QUERN_E_MEMORY;
	const quern_parts *touches = s->host->parts(s->run, "touch");
	for (uint32_t q = 0; s->use[S_TOUCH_FORCE].real[0] && q < touches->n; q++)
		sample_touch(&p, quern_nth(touches->entry, q));
	s->use[S_SAMPLES].real[0][0]++;
	return QUERN_OK;
}
