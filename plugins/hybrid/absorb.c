/* SPDX-License-Identifier: MIT */
/* absorb - what grains have no room for goes to the points of its cell, within bounds, and from there to the cells beside it.
 * docs/theory/hybrid.md, section 5 */
#include "update.h"
#include <math.h>
#include <string.h>

enum { SWEEPS = 4 };

/* Shares of what points carry, of what a cell shall carry, between which they may be changed. */
static const quern_real least_kept = 0.3, least_shared = 0.5, most_shared = 1.6, least_alone = 0.6,
						most_alone = 1.6;
/* Of a full cell's mass: points that carry less are not pushed; a rounding error would move them. For the same reason no debt makes
 * them lighter than `least_left`: one that nobody else takes would have a share of them at each update, without end. */
static const quern_real least_pushed = 0.01, least_left = 0.02;
/* Of sqrt(g D): what an update may change in velocity where all moves alike. */
static const quern_real nudge = 0.04;

typedef struct {
	update *d;
	quern_real *before;  /* kg by cell: carried by points as the sweeps begin */
	uint8_t *made;       /* by cell: points were made there */
	quern_real *next[4]; /* by cell: what is owed after a sweep: kg, and kg m/s */
	quern_real speed;    /* m/s */
} absorbing;

static void bounds_of(const absorbing *a, uint32_t c, quern_real *low, quern_real *high) {
	const update *d = a->d;
	const quern_real now = d->in_points[c], room = cell_room(d, c) - d->in_grains[c];
	if (d->zone[c] == QUERN_HYBRID) {
		const quern_real whole = point_share(d, c) * cell_holds(d, c);
		*low = fmax(least_shared * whole, least_kept * a->before[c]);
		*high = fmin(most_shared * whole, room);
	} else {
		*low = least_alone * a->before[c];
		*high = a->before[c] > 0 ? fmin(most_alone * a->before[c], room) : room;
	}
	*low = fmin(fmax(*low, least_left * point_share(d, c) * cell_room(d, c)), now);
	*high = fmax(*high, now);
}

/* Of the mass that is owed: what is there moves at. */
static quern_real owed_velocity(const update *d, uint32_t c, uint32_t k) {
	if (d->mass[c] > 0) return d->velocity[k][c];
	const quern_real mass = d->u[U_OWED].real[0][c];
	return mass != 0 ? d->u[U_OWED_MOMENTUM].real[k][c] / mass : 0;
}

/* Mass and volume change in proportion; stress, velocity and history stay. */
static void scale(const update *d, uint32_t c, quern_real factor) {
	const quern_column *u = d->u;
	const quern_real weight = point_share(d, c);
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
		const int32_t i = d->point[q];
		const quern_real old = u[U_POINT_MASS].real[0][i], new = factor *old;
		quern_real v[3] = { 0 };
		for (uint32_t k = 0; k < d->s->dim; k++) v[k] = u[U_POINT_VELOCITY].real[k][i];
		d->s->host->give(d->s->run, "point", (uint32_t)i, QUERN_NO_TARGET, 1 - factor, 0);
		u[U_POINT_MASS].real[0][i] = new;
		u[U_POINT_VOLUME].real[0][i] *= factor;
		quern_hybrid_book(d, c, -weight * (new - old), v);
	}
}

static void create(const absorbing *a, uint32_t c, quern_real most) {
	update *d = a->d;
	const quern_real owed = d->u[U_OWED].real[0][c], given = fmin(owed, most), weight = point_share(d, c);
	quern_real v[3] = { 0 };
	if (!(given > 0.4 * d->nominal * weight)) return;
	for (uint32_t k = 0; k < d->s->dim; k++) v[k] = owed_velocity(d, c, k);
	quern_hybrid_create(d, c, given / weight, v);
	quern_hybrid_book(d, c, -given, v);
	d->in_points[c] = given;
	a->made[c] = 1;
}

static void absorb(const absorbing *a, uint32_t c) {
	const update *d = a->d;
	const quern_real now = d->in_points[c], owed = d->u[U_OWED].real[0][c];
	quern_real low, high;
	if (owed == 0 || a->made[c]) return;
	bounds_of(a, c, &low, &high);
	if (!(now > 0)) {
		create(a, c, high);
		return;
	}
	const quern_real then = fmin(fmax(now + owed, low), high);
	if (then == now) return;
	scale(d, c, then / now);
	d->in_points[c] = then;
}

/* ---- on to the next cells ---- */

/* How much fuller than a neighbour a cell with a surplus is, or emptier than it one with a debt. Where less than half of a cell
 * is, its surface is: nothing is moved beyond. */
static quern_real slope_to(const update *d, uint32_t c, int32_t n) {
	if (n < 0 || d->zone[n] == QUERN_DISCRETE) return 0;
	const quern_real there = cell_holds(d, (uint32_t)n) / cell_room(d, (uint32_t)n),
					 fuller = cell_holds(d, c) / cell_room(d, c) - there;
	return there < 0.5 ? 0 : fmax(0, d->u[U_OWED].real[0][c] > 0 ? fuller : -fuller);
}

/* Whether a wall stands between a cell and its neighbour along axis k / 2. */
static bool is_walled(const update *d, uint32_t c, const int32_t cell[3], uint32_t k, int32_t n) {
	quern_real from[3], there[3];
	int32_t beside[3] = { cell[0], cell[1], cell[2] };
	beside[k / 2] += k % 2 ? 1 : -1; /* not brought back into a periodic domain: the line goes straight */
	quern_hybrid_open_place(d, c, cell, from);
	quern_hybrid_open_place(d, (uint32_t)n, beside, there);
	return quern_hybrid_walled(d, NULL, c, from, there);
}

/* What momentum there is beside that of the mass belongs to that mass and to the points alike: if all of it stayed, a debt many
 * times their mass would throw them to and fro. */
static void put(const absorbing *a, uint32_t to, uint32_t from, quern_real part) {
	const update *d = a->d;
	const quern_real mass = d->u[U_OWED].real[0][from],
					 share = fabs(mass) / (fabs(mass) + d->in_points[from]);
	a->next[0][to] += part * mass;
	a->next[0][from] -= part * mass;
	for (uint32_t k = 0; k < d->s->dim; k++) {
		const quern_real plain = mass * owed_velocity(d, from, k),
						 given = part * (plain + share * (d->u[U_OWED_MOMENTUM].real[k][from] - plain));
		a->next[1 + k][to] += given;
		a->next[1 + k][from] -= given;
	}
}

/* A surplus goes where less is, a debt where more is, among cells with continuum, as much as the difference is large. */
static void pass_from(const absorbing *a, uint32_t c) {
	const update *d = a->d;
	quern_real part[6], sum = 0;
	int32_t cell[3], to[6];
	if (d->u[U_OWED].real[0][c] == 0 || d->zone[c] == QUERN_DISCRETE || !quern_grid_cell_of(d->g, c, cell))
		return;
	for (uint32_t k = 0; k < 2 * d->s->dim; k++) {
		to[k] = cell_beside(d, c, k / 2, k % 2 ? 1 : -1);
		part[k] = slope_to(d, c, to[k]);
		if (part[k] > 0 && is_walled(d, c, cell, k, to[k])) part[k] = 0;
		sum += part[k];
	}
	for (uint32_t k = 0; k < 2 * d->s->dim && sum > 0; k++)
		if (part[k] > 0) put(a, (uint32_t)to[k], c, part[k] / sum);
}

static void pass_on(const absorbing *a) {
	const update *d = a->d;
	const size_t bytes = d->n_cells * sizeof(quern_real);
	for (uint32_t k = 0; k <= d->s->dim; k++)
		memcpy(a->next[k], k ? d->u[U_OWED_MOMENTUM].real[k - 1] : d->u[U_OWED].real[0], bytes);
	for (uint32_t q = 0; q < d->n_cells; q++) pass_from(a, nth_cell(d, q));
	memcpy(d->u[U_OWED].real[0], a->next[0], bytes);
	for (uint32_t k = 0; k < d->s->dim; k++) memcpy(d->u[U_OWED_MOMENTUM].real[k], a->next[1 + k], bytes);
}

/* ---- momentum ---- */

/* What is owed in momentum beside that of the mass that is owed, in steps that are no more than noise. */
static void push(const absorbing *a, uint32_t c) {
	const update *d = a->d;
	const quern_column *u = d->u;
	const uint32_t dim = d->s->dim;
	const quern_real mass = d->in_points[c], most = 0.5 * d->spread[c] + a->speed;
	const quern_real all = mass + fabs(u[U_OWED].real[0][c]);
	quern_real dv[3] = { 0 }, size = 0;
	if (!(mass > least_pushed * point_share(d, c) * d->full) || a->made[c]) return;
	for (uint32_t k = 0; k < dim; k++) {
		dv[k] = (u[U_OWED_MOMENTUM].real[k][c] - u[U_OWED].real[0][c] * owed_velocity(d, c, k)) / all;
		size += dv[k] * dv[k];
	}
	if (size == 0) return;
	const quern_real part = size > most * most ? most / sqrt(size) : 1;
	for (uint32_t k = 0; k < dim; k++) {
		for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++)
			u[U_POINT_VELOCITY].real[k][d->point[q]] += part * dv[k];
		u[U_OWED_MOMENTUM].real[k][c] -= part * dv[k] * mass;
	}
}

quern_status quern_hybrid_absorb(update *d, uint8_t *made) {
	const quern_real gravity = quern_gravity_size(d->s->dim, d->s->gravity);
	absorbing a = { .d = d, .made = made, .speed = nudge * sqrt(gravity * d->h->diameter) };
	a.before = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof(quern_real));
	bool good = a.before;
	for (uint32_t k = 0; k <= d->s->dim && good; k++)
		good = (a.next[k] = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof(quern_real)));
	if (!good) return QUERN_E_MEMORY;
	memcpy(a.before, d->in_points, d->n_cells * sizeof(quern_real));
	for (int sweep = 0; sweep < SWEEPS; sweep++) {
		if (sweep) pass_on(&a);
		for (uint32_t q = 0; q < d->n_cells; q++)
			if (d->zone[nth_cell(d, q)] != QUERN_DISCRETE) absorb(&a, nth_cell(d, q));
	}
	for (uint32_t c = 0; c < d->n_cells; c++)
		if (d->zone[c] != QUERN_DISCRETE) push(&a, c);
	return QUERN_OK;
}
