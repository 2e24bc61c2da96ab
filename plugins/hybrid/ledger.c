/* SPDX-License-Identifier: MIT */
/* ledger - what a cell holds but neither grains nor points carry: mass and momentum. docs/theory/hybrid.md, section 5 */
#include "lend.h"
#include <math.h>
#include <string.h>

bool quern_hybrid_is_owed(const quern_column *u, uint32_t c, uint32_t dim) {
	bool any = u[U_OWED].real[0][c] != 0;
	for (uint32_t k = 0; k < dim; k++) any = any || u[U_OWED_MOMENTUM].real[k][c] != 0;
	return any;
}

void quern_hybrid_book(const update *d, uint32_t c, quern_real mass, const quern_real v[3]) {
	d->u[U_OWED].real[0][c] += mass;
	for (uint32_t k = 0; k < d->s->dim; k++) d->u[U_OWED_MOMENTUM].real[k][c] += mass * v[k];
}

void quern_hybrid_pass(const update *d, uint32_t from, uint32_t to) {
	quern_real *mass = d->u[U_OWED].real[0];
	mass[to] += mass[from];
	mass[from] = 0;
	for (uint32_t k = 0; k < d->s->dim; k++) {
		quern_real *p = d->u[U_OWED_MOMENTUM].real[k];
		p[to] += p[from];
		p[from] = 0;
	}
}

/* ---- weights ---- */

/* kg/m^3: what is looser has no density but that of its stress; none has where flow has no density of its own. */
static quern_real loosest_flow(const update *d) {
	const quern_bound *material = &d->s->slot[SLOT_MATERIAL][0];
	const quern_material_ops *ops = material->ops;
	const quern_real least = ops->loosest ? ops->loosest(material->self) : d->h->packed;
	return least < d->h->packed ? least : INFINITY;
}

static bool presses(const update *d, int32_t i) {
	quern_real trace = 0;
	for (uint32_t k = 0; k < d->s->dim; k++) trace += d->u[U_POINT_STRESS].real[k][i];
	return trace < 0;
}

/* What is loose, bears nothing and is under no pressure stays as it is: closed, it would press at the first contraction, be the cell ever so loose. What
 * flows at a density of its own keeps its room. */
static void take_over_point(
	const update *d, int32_t i, quern_real share, const quern_real contact[6], quern_real loosest) {
	const uint32_t n = quern_shape_size(QUERN_SYMMETRIC, d->s->dim);
	const quern_real mass = d->u[U_POINT_MASS].real[0][i];
	quern_real *volume = &d->u[U_POINT_VOLUME].real[0][i], room = *volume;
	bool open = mass < (1 - 1e-9) * d->h->packed * room;
	for (uint32_t k = 0; k < n; k++) {
		quern_real *stress = &d->u[U_POINT_STRESS].real[k][i];
		open = open && *stress == 0;
		*stress = (1 - share) * contact[k] + share * *stress;
	}
	if (open && !presses(d, i)) {
		for (uint32_t k = 0; k < n; k++) d->u[U_POINT_STRESS].real[k][i] = 0;
		return;
	}
	quern_hybrid_assign(d, (uint32_t)i, 1);
	if (presses(d, i) && mass >= loosest * room) *volume = room;
}

/* Only the shares' sum is the material's stress; points that will carry all of it take it on. */
static void take_over_stress(const update *d, uint32_t c) {
	const uint32_t begin = d->point_begin[c], end = d->point_begin[c + 1];
	const quern_real share = old_share(d, (int32_t)c), loosest = loosest_flow(d);
	quern_real contact[6];
	if (begin == end || !quern_hybrid_mean_stress(d, c, contact)) return;
	for (uint32_t q = begin; q < end; q++) take_over_point(d, d->point[q], share, contact, loosest);
}

/* Whether a cell is on its way to all continuum. One that shall hold grains too keeps the mass of those that it has. */
static bool gains(const update *d, uint32_t c) {
	return d->wish[c] == QUERN_CONTINUUM && d->open[c] >= 0.125 && d->share[c] > old_share(d, (int32_t)c);
}

/* What grains give to the continuum, in the hats of the cells around that take some too, so that its centre stays: four discs lie anywhere in
 * a cell, and points are made in the same places of each. */
static void book_spread(const update *d, uint32_t c, uint32_t i, quern_real mass, const quern_real v[3]) {
	const uint32_t dim = d->s->dim;
	int32_t cell[3], step[3] = { 0 };
	quern_real part[3] = { 0 }, centre[3], left = mass;
	if (!gains(d, c) || !quern_grid_cell_of(d->g, c, cell)) {
		quern_hybrid_book(d, c, mass, v);
		return;
	}
	quern_hybrid_centre(d, cell, centre);
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real t = quern_image_at(d->u[U_GRAIN_POSITION].real[k][i], centre[k], d->images.half[k],
								 d->images.length[k]) -
							 centre[k];
		step[k] = t < 0 ? -1 : 1;
		part[k] = fabs(t) / d->g->cell;
	}
	for (uint32_t corner = 1; corner < 1u << dim; corner++) {
		int32_t at[3] = { cell[0], cell[1], cell[2] };
		quern_real w = mass, there[3];
		for (uint32_t k = 0; k < dim; k++) {
			w *= corner >> k & 1 ? part[k] : 1 - part[k];
			if (corner >> k & 1) at[k] += step[k];
		}
		quern_hybrid_centre(d, at, there);
		const int32_t to = quern_grid_entry_back(d->g, at);
		if (to < 0 || !gains(d, (uint32_t)to) || quern_hybrid_walled(d, NULL, c, centre, there)) continue;
		quern_hybrid_book(d, (uint32_t)to, w, v);
		left -= w;
	}
	quern_hybrid_book(d, c, left, v);
}

/* A particle gets the share of its cell, and what that changes is booked; returns its weight. */
static quern_real weigh(const update *d, uint32_t c, quern_real share, quern_real *weight, quern_real mass,
	quern_real *const v[3], uint32_t i, bool spread) {
	const quern_real change = share - weight[i];
	quern_real at[3] = { 0 };
	for (uint32_t k = 0; k < d->s->dim; k++) at[k] = v[k][i];
	if (change < 0 && spread) book_spread(d, c, i, -change * mass, at);
	else if (change != 0) quern_hybrid_book(d, c, -change * mass, at);
	return weight[i] = share;
}

quern_status quern_hybrid_weigh(update *d) {
	const quern_column *u = d->u;
	quern_real *old = d->s->host->memory(d->s->run, ((size_t)d->n_grains + 1) * sizeof(quern_real));
	if (!old) return QUERN_E_MEMORY;
	memcpy(old, u[U_GRAIN_WEIGHT].real[0], d->n_grains * sizeof(quern_real));
	for (uint32_t c = 0; c < d->n_cells; c++)
		if (u[U_ZONE].index[c] == QUERN_HYBRID && d->zone[c] == QUERN_CONTINUUM) take_over_stress(d, c);
	for (uint32_t q = 0; q < d->n_grains; q++) {
		const uint32_t i = quern_nth(d->grain_order, q);
		const quern_real mass = u[U_GRAIN_MASS].real[0][i];
		const int32_t c = d->grain_cell[i];
		if (c < 0) continue;
		const quern_real weight = weigh(d, (uint32_t)c, grain_share(d, (uint32_t)c),
			u[U_GRAIN_WEIGHT].real[0], mass, u[U_GRAIN_VELOCITY].real, i, true);
		d->drop_grain[i] = weight == 0;
		d->in_grains[c] += weight * mass;
	}
	quern_hybrid_lend(d, old);
	for (uint32_t q = 0; q < d->n_points; q++) {
		const uint32_t i = quern_nth(d->point_order, q);
		const quern_real mass = u[U_POINT_MASS].real[0][i];
		const int32_t c = d->point_cell[i];
		if (c < 0) continue;
		const quern_real weight = weigh(d, (uint32_t)c, point_share(d, (uint32_t)c),
			u[U_POINT_WEIGHT].real[0], mass, u[U_POINT_VELOCITY].real, i, false);
		d->drop_point[i] = weight == 0;
		d->in_points[c] += weight * mass;
	}
	return QUERN_OK;
}

/* The open neighbour with most in it, -1 if there is none. */
static int32_t fullest_beside(const update *d, const int32_t cell[3]) {
	const int depth = d->s->dim == 3 ? 1 : 0;
	int32_t best = -1;
	for (int z = -depth; z <= depth; z++)
		for (int y = -1; y <= 1; y++)
			for (int x = -1; x <= 1; x++) {
				int32_t at[3] = { cell[0] + x, cell[1] + y, cell[2] + z };
				const int32_t c = quern_grid_entry_back(d->g, at);
				if (c >= 0 && d->open[c] > 0 && d->mass[c] > 0 && (best < 0 || d->mass[c] > d->mass[best]))
					best = c;
			}
	return best;
}

/* Points reach behind walls that are not across an axis: what such a one held in a cell without any room is owed by the cell before the
 * wall, or, where nothing is there, by the fullest one beside it. */
static void bring_out(const update *d, uint32_t c) {
	int32_t cell[3], before[3];
	quern_real x[3];
	if (!quern_grid_cell_of(d->g, c, cell)) return;
	quern_hybrid_open_place(d, c, cell, x);
	for (uint32_t k = 0; k < 3; k++)
		before[k] = k < d->s->dim ? (int32_t)floor((x[k] - d->g->lower[k]) / d->g->cell) : 0;
	int32_t to = quern_grid_entry_back(d->g, before);
	if (to < 0 || !(d->open[to] > 0 && d->mass[to] > 0)) to = fullest_beside(d, cell);
	if (to >= 0) quern_hybrid_pass(d, c, (uint32_t)to);
}

static bool owed_by_grains(const update *d, uint32_t c) {
	return d->zone[c] == QUERN_DISCRETE && quern_hybrid_is_owed(d->u, c, d->s->dim);
}

/* Grains are only placed where the continuum is near: a discrete cell gives its entry to the hybrid one that reaches it first, through no
 * body; where there is none the entry waits. */
quern_status quern_hybrid_hand_over(update *d) {
	bool *source = d->s->host->memory(d->s->run, (size_t)d->n_cells + 1), any = false;
	bool *open = d->s->host->memory(d->s->run, (size_t)d->n_cells + 1);
	bool *asked = d->s->host->memory(d->s->run, (size_t)d->n_cells + 1);
	int32_t *nearest = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof(int32_t));
	if (!source || !open || !asked || !nearest) return QUERN_E_MEMORY;
	for (uint32_t q = 0; q < d->n_cells; q++) {
		const uint32_t c = nth_cell(d, q);
		if (owed_by_grains(d, c) && !(d->open[c] > 0)) bring_out(d, c);
	}
	for (uint32_t c = 0; c < d->n_cells; c++) {
		source[c] = d->zone[c] == QUERN_HYBRID && d->open[c] > 0;
		open[c] = d->open[c] > 0;
		asked[c] = open[c] && owed_by_grains(d, c);
		any = any || asked[c];
	}
	if (!any) return QUERN_OK;
	const quern_status status = quern_hybrid_nearest(d, source, open, asked, nearest);
	if (status != QUERN_OK) return status;
	for (uint32_t q = 0; q < d->n_cells; q++) {
		const uint32_t c = nth_cell(d, q);
		if (nearest[c] >= 0) quern_hybrid_pass(d, c, (uint32_t)nearest[c]);
	}
	return QUERN_OK;
}
