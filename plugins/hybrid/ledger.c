/* SPDX-License-Identifier: MIT */
/* ledger - what grains and points owe each other, by cell: mass and momentum. docs/theory/hybrid.md, section 5 */
#include "update.h"
#include <math.h>
#include <string.h>

/* One entry: mass and momentum in two columns. */
typedef struct {
	quern_real *mass, *const *momentum;
} entry;

static entry grain_entry(const update *d) {
	return (entry) { d->u[U_GRAIN_OWED].real[0], d->u[U_GRAIN_OWED_MOMENTUM].real };
}
static entry point_entry(const update *d) {
	return (entry) { d->u[U_POINT_OWED].real[0], d->u[U_POINT_OWED_MOMENTUM].real };
}

static void shift(entry e, uint32_t to, entry from, uint32_t c, uint32_t dim) {
	e.mass[to] += from.mass[c];
	from.mass[c] = 0;
	for (uint32_t k = 0; k < dim; k++) {
		e.momentum[k][to] += from.momentum[k][c];
		from.momentum[k][c] = 0;
	}
}

bool quern_hybrid_is_owed(const quern_real *mass, quern_real *const *momentum, uint32_t cell, uint32_t dim) {
	bool any = mass[cell] != 0;
	for (uint32_t k = 0; k < dim; k++) any = any || momentum[k][cell] != 0;
	return any;
}

static bool is_empty(entry e, uint32_t c, uint32_t dim) {
	return !quern_hybrid_is_owed(e.mass, e.momentum, c, dim);
}

/* ---- entries move with the material ---- */

typedef struct {
	const int32_t *home; /* by particle: linear cell of the last update, -1: new */
	const int32_t *now;  /* by particle: its cell */
	const uint32_t *order;
	cloud of;
} movers;

static int32_t home_entry(const update *d, int32_t home) {
	int32_t cell[3];
	if (home < 0) return -1;
	quern_grid_numbered(d->g, home, cell);
	return quern_grid_entry(d->g, cell);
}

static void give_share(update *d, entry e, const entry old, uint32_t from, uint32_t to, quern_real share) {
	e.mass[from] -= share * old.mass[from];
	e.mass[to] += share * old.mass[from];
	for (uint32_t k = 0; k < d->s->dim; k++) {
		e.momentum[k][from] -= share * old.momentum[k][from];
		e.momentum[k][to] += share * old.momentum[k][from];
	}
}

static entry copy_of(update *d, entry e, quern_real *momentum[3]) {
	const size_t bytes = ((size_t)d->n_cells + 1) * sizeof(quern_real);
	entry copy = { d->s->host->memory(d->s->run, bytes), momentum };
	d->failed = d->failed || !copy.mass;
	if (copy.mass) memcpy(copy.mass, e.mass, d->n_cells * sizeof(quern_real));
	for (uint32_t k = 0; k < d->s->dim; k++) {
		momentum[k] = d->s->host->memory(d->s->run, bytes);
		d->failed = d->failed || !momentum[k];
		if (momentum[k]) memcpy(momentum[k], e.momentum[k], d->n_cells * sizeof(quern_real));
	}
	return copy;
}

static void let_go(update *d, entry e, const entry old, uint32_t c, quern_real share) {
	const quern_column *u = d->u;
	const quern_real mass = share * old.mass[c];
	e.mass[c] -= mass;
	book_number(&u[U_OWED_LEFT].real[0][0], &u[U_OWED_LEFT_REST].real[0][0], mass);
	for (uint32_t k = 0; k < d->s->dim; k++) {
		const quern_real momentum = share * old.momentum[k][c];
		e.momentum[k][c] -= momentum;
		book_number(&u[U_OWED_LEFT_MOMENTUM].real[k][0], &u[U_OWED_LEFT_MOMENTUM_REST].real[k][0], momentum);
	}
}

/* What has left the domain since the last update took its share along: what is missing of the mass that was at home in a
 * cell then. Leaves that mass in `of_home`; a billionth of it is round-off. */
static void release(update *d, entry grains, const entry old_grains, entry points, const entry old_points,
	quern_real *of_home) {
	const quern_real *before = d->u[U_HOME_MASS].real[0];
	for (uint32_t q = 0; before && q < d->n_cells; q++) {
		const uint32_t c = nth_cell(d, q);
		const quern_real gone = before[c] - of_home[c];
		if (!(gone > 1e-9 * before[c])) continue;
		let_go(d, grains, old_grains, c, gone / before[c]);
		let_go(d, points, old_points, c, gone / before[c]);
		of_home[c] = before[c];
	}
}

/* A particle that has left a cell takes its share of what the cell owed: by mass, of both clouds together. */
void quern_hybrid_move_entries(update *d) {
	const quern_column *u = d->u;
	const movers clouds[2] = { { u[U_GRAIN_HOME].index, d->grain_cell, d->grain_order, moving_grains(d->s) },
		{ u[U_POINT_HOME].index, d->point_cell, d->point_order, all_points(d->s) } };
	quern_real *of_home = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof(quern_real));
	quern_real *grain_momentum[3] = { NULL }, *point_momentum[3] = { NULL };
	const entry grains = grain_entry(d), points = point_entry(d);
	const entry old_grains = copy_of(d, grains, grain_momentum),
				old_points = copy_of(d, points, point_momentum);
	if (!of_home || d->failed) {
		d->failed = true;
		return;
	}
	for (const movers *m = clouds; m < clouds + 2; m++)
		for (uint32_t q = 0; q < m->of.n; q++) {
			const uint32_t i = quern_nth(m->order, q);
			const int32_t home = m->now[i] < 0 ? -1 : home_entry(d, m->home[i]);
			if (home >= 0) of_home[home] += cloud_mass(&m->of, i);
		}
	release(d, grains, old_grains, points, old_points, of_home);
	for (const movers *m = clouds; m < clouds + 2; m++)
		for (uint32_t q = 0; q < m->of.n; q++) {
			const uint32_t i = quern_nth(m->order, q);
			const int32_t now = m->now[i], home = now < 0 ? -1 : home_entry(d, m->home[i]);
			if (home < 0 || home == now || !(of_home[home] > 0)) continue;
			if (is_empty(old_grains, (uint32_t)home, d->s->dim) &&
				is_empty(old_points, (uint32_t)home, d->s->dim))
				continue;
			const quern_real share = cloud_mass(&m->of, i) / of_home[home];
			give_share(d, grains, old_grains, (uint32_t)home, (uint32_t)now, share);
			give_share(d, points, old_points, (uint32_t)home, (uint32_t)now, share);
		}
}

/* ---- weights ---- */

static void book(entry e, uint32_t c, quern_real change, quern_real mass, quern_real *const v[3], uint32_t i,
	uint32_t dim) {
	e.mass[c] -= change * mass;
	for (uint32_t k = 0; k < dim; k++) e.momentum[k][c] -= change * mass * v[k][i];
}

/* Only the shares' sum is the material's stress; points that will carry all of it take it on. */
static void take_over_stress(const update *d, uint32_t c) {
	quern_real contact[6];
	const uint32_t n = quern_shape_size(QUERN_SYMMETRIC, d->s->dim), begin = d->point_begin[c],
				   end = d->point_begin[c + 1];
	const quern_real share = old_share(d, (int32_t)c);
	if (begin == end || !quern_hybrid_contact_stress(d, c, contact)) return;
	for (uint32_t q = begin; q < end; q++)
		for (uint32_t k = 0; k < n; k++) {
			quern_real *stress = &d->u[U_POINT_STRESS].real[k][d->point[q]];
			*stress = (1 - share) * contact[k] + share * *stress;
		}
	quern_hybrid_assign(d, (uint32_t)d->point[begin], end - begin); /* points of a cell lie together */
}

void quern_hybrid_weigh(update *d) {
	const quern_column *u = d->u;
	const uint32_t dim = d->s->dim;
	for (uint32_t c = 0; c < d->n_cells; c++)
		if (u[U_ZONE].index[c] == QUERN_HYBRID && d->zone[c] == QUERN_CONTINUUM) take_over_stress(d, c);
	for (uint32_t q = 0; q < d->n_grains; q++) {
		const uint32_t i = quern_nth(d->grain_order, q);
		const int32_t c = d->grain_cell[i];
		if (c < 0) continue;
		const quern_real weight = grain_share(d, (uint32_t)c), change = weight - u[U_GRAIN_WEIGHT].real[0][i];
		if (change != 0)
			book(point_entry(d), (uint32_t)c, change, u[U_GRAIN_MASS].real[0][i], u[U_GRAIN_VELOCITY].real, i,
				dim);
		u[U_GRAIN_WEIGHT].real[0][i] = weight;
		d->drop_grain[i] = weight == 0;
	}
	for (uint32_t q = 0; q < d->n_points; q++) {
		const uint32_t i = quern_nth(d->point_order, q);
		const int32_t c = d->point_cell[i];
		const quern_real weight = c < 0 ? u[U_POINT_WEIGHT].real[0][i] : point_share(d, (uint32_t)c);
		const quern_real change = weight - u[U_POINT_WEIGHT].real[0][i];
		if (change != 0)
			book(grain_entry(d), (uint32_t)c, change, u[U_POINT_MASS].real[0][i], u[U_POINT_VELOCITY].real, i,
				dim);
		u[U_POINT_WEIGHT].real[0][i] = weight;
		d->drop_point[i] = weight == 0;
	}
}

/* ---- settling ---- */

/* On a ramp both clouds go on together and change their shares: what one of them gains the other has lost. */
static void cancel(entry one, entry other, uint32_t c, uint32_t dim) {
	const bool against = (one.mass[c] > 0 && other.mass[c] < 0) || (one.mass[c] < 0 && other.mass[c] > 0);
	if (!against) return;
	if (fabs(one.mass[c]) > fabs(other.mass[c])) shift(one, c, other, c, dim);
	else shift(other, c, one, c, dim);
}

/* In a pure cell only one cloud is left to give to, and what the other owes it is set against what it is owed. */
void quern_hybrid_net(update *d) {
	const entry points = point_entry(d), grains = grain_entry(d);
	for (uint32_t c = 0; c < d->n_cells; c++) {
		if (d->zone[c] == QUERN_CONTINUUM) shift(points, c, grains, c, d->s->dim);
		else if (d->zone[c] == QUERN_DISCRETE) shift(grains, c, points, c, d->s->dim);
		else if (d->h->ramped) cancel(points, grains, c, d->s->dim);
	}
}

/* Grains are only placed where the continuum is near: a discrete cell gives its entry to the nearest hybrid one. */
quern_status quern_hybrid_hand_over(update *d) {
	bool *source = d->s->host->memory(d->s->run, (size_t)d->n_cells + 1), any = false;
	int32_t *nearest = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof(int32_t));
	const entry grains = grain_entry(d);
	if (!source || !nearest) return QUERN_E_MEMORY;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		source[c] = d->zone[c] == QUERN_HYBRID;
		any = any || (d->zone[c] == QUERN_DISCRETE && !is_empty(grains, c, d->s->dim));
	}
	if (!any) return QUERN_OK;
	const quern_status status = quern_hybrid_nearest(d, source, nearest);
	if (status != QUERN_OK) return status;
	for (uint32_t q = 0; q < d->n_cells; q++) {
		const uint32_t c = nth_cell(d, q);
		if (d->zone[c] == QUERN_DISCRETE && !is_empty(grains, c, d->s->dim) && nearest[c] >= 0)
			shift(grains, (uint32_t)nearest[c], grains, c, d->s->dim);
	}
	return QUERN_OK;
}

void quern_hybrid_owed_velocity(
	const update *d, uint32_t c, quern_real mass, const quern_column momentum, quern_real v[3]) {
	quern_real away = 0;
	for (uint32_t k = 0; k < d->s->dim; k++) {
		v[k] = mass != 0 ? momentum.real[k][c] / mass : 0;
		away += (v[k] - d->velocity[k][c]) * (v[k] - d->velocity[k][c]);
	}
	if (fabs(mass) >= 0.02 * d->full && sqrt(away) <= 2 * d->spread[c]) return;
	for (uint32_t k = 0; k < d->s->dim; k++) v[k] = d->velocity[k][c];
}
