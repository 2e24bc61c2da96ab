/* SPDX-License-Identifier: MIT */
/* points - mass owed to the continuum becomes points, or joins those that are there; few are split, many are merged */
#include "../common/renew.h"
#include "../common/stressed.h"
#include "update.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- state from stress ---- */

void quern_hybrid_assign(const update *d, uint32_t begin, uint32_t n) {
	const quern_column *u = d->u;
	const stressed_points points = {
		.mass = u[U_POINT_MASS], .volume = u[U_POINT_VOLUME], .stress = u[U_POINT_STRESS]
	};
	quern_stressed_assign(&points, &d->s->slot[SLOT_MATERIAL][0], d->s->dim, begin, n);
}

/* ---- new ones ---- */

static void add_point(update *d, const new_point *p) {
	if (d->n_new_points == d->cap_points) {
		const uint32_t cap = d->cap_points ? 2 * d->cap_points : 1024;
		new_point *grown = realloc(d->points, cap * sizeof(new_point));
		if (!grown) {
			d->failed = true;
			return;
		}
		d->points = grown;
		d->cap_points = cap;
	}
	d->points[d->n_new_points++] = *p;
}

static uint32_t parts_of(const update *d) { return d->s->dim == 2 ? 4 : 8; }

/* Quadrant or octant of a cell that a position lies in. */
static uint32_t part_of(const update *d, const int32_t cell[3], quern_real *const x[3], int32_t i) {
	uint32_t part = 0;
	for (uint32_t k = 0; k < d->s->dim; k++) {
		const quern_real around = d->g->periodic[k] ? (quern_real)d->g->cells[k] : INFINITY;
		const quern_real t = (x[k][i] - d->g->lower[k]) / d->g->cell - cell[k];
		part |= (uint32_t)(quern_image_at(t, 0.5, 0.5 * around, around) >= 0.5) << k;
	}
	return part;
}

static void part_centre(const update *d, const int32_t cell[3], uint32_t part, quern_real x[3]) {
	for (uint32_t k = 0; k < 3; k++)
		x[k] = k < d->s->dim ? d->g->lower[k] + (cell[k] + (part >> k & 1 ? 0.75 : 0.25)) * d->g->cell : 0;
}

/* Marks the parts whose middle cannot be seen from particle i of the cell, since a body is in the way, unless that is
 * true of all; returns how many are left. */
static uint32_t close_parts(
	const update *d, uint32_t c, const int32_t cell[3], quern_real *const x[3], int32_t i, bool closed[8]) {
	const quern_images images = quern_grid_images(d->g);
	const uint32_t parts = parts_of(d);
	uint32_t n = 0;
	for (uint32_t p = 0; p < parts; p++) {
		quern_real to[3], from[3] = { 0 };
		part_centre(d, cell, p, to);
		for (uint32_t k = 0; k < d->s->dim; k++) {
			from[k] = quern_image_at(x[k][i], to[k], images.half[k], images.length[k]);
		}
		closed[p] = quern_hybrid_walled(d, NULL, c, from, to);
		n += !closed[p];
	}
	if (!n) memset(closed, 0, parts * sizeof *closed);
	return n ? n : parts;
}

static void weigh_parts(const update *d, uint32_t c, const int32_t cell[3], quern_real held[8]) {
	for (uint32_t q = d->grain_begin[c]; q < d->grain_begin[c + 1]; q++)
		held[part_of(d, cell, d->u[U_GRAIN_POSITION].real, d->grain[q])] +=
			d->u[U_GRAIN_MASS].real[0][d->grain[q]];
}

/* As many points as the mass is worth, a power of two if bodies leave the room, where the grains are; one in every part of a cell
 * that has no grains, so that no part comes before another. */
void quern_hybrid_create(update *d, uint32_t c, quern_real mass, const quern_real v[3]) {
	const uint32_t parts = parts_of(d);
	uint32_t count = 1;
	int32_t cell[3];
	quern_real held[8] = { 0 };
	bool taken[8] = { false };
	quern_grid_cell_of(d->g, c, cell);
	const bool any = d->grain_begin[c + 1] > d->grain_begin[c];
	const uint32_t open =
		any ? close_parts(d, c, cell, d->u[U_GRAIN_POSITION].real, d->grain[d->grain_begin[c]], taken)
			: parts;
	weigh_parts(d, c, cell, held);
	while (any && count < parts && mass / d->nominal >= 1.5 * count) count *= 2;
	count = any && count < open ? count : open;
	quern_real stress[6];
	quern_hybrid_mean_stress(d, c, stress);
	for (uint32_t k = 0; k < count; k++) {
		uint32_t best = parts;
		for (uint32_t p = 0; p < parts; p++)
			if (!taken[p] && (best == parts || held[p] > held[best])) best = p;
		taken[best] = true;
		new_point point = {
			.mass = mass / count, .weight = point_share(d, c), .cell = (int32_t)c, .parent = -1
		};
		part_centre(d, cell, best, point.position);
		memcpy(point.velocity, v, sizeof point.velocity);
		memcpy(point.stress, stress, sizeof stress);
		add_point(d, &point);
	}
}

static quern_real mass_held(const update *d, uint32_t c) {
	quern_real sum = 0;
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++)
		sum += d->u[U_POINT_MASS].real[0][d->point[q]];
	return sum;
}

/* ---- few and many: what parts and joins keeps mass, momentum and volume, and with them the density: an open point
 * stays open. Stress is the mean by volume, so that the sum of V sigma stays. Whatever else a point remembers follows the rules of
 * its fields; of joined points the heavier one stays. ---- */

/* From a part's middle to the nearest point of the cell, squared, in cells. */
static quern_real loneliness(const update *d, uint32_t c, const int32_t cell[3], uint32_t part) {
	const quern_images images = quern_grid_images(d->g);
	quern_real to[3], least = INFINITY;
	part_centre(d, cell, part, to);
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
		quern_real d2 = 0;
		for (uint32_t k = 0; k < d->s->dim; k++) {
			const quern_real way = quern_image(d->u[U_POINT_POSITION].real[k][d->point[q]] - to[k],
									   images.half[k], images.length[k]) /
								   d->g->cell;
			d2 += way * way;
		}
		least = fmin(least, d2);
	}
	return least;
}

/* The part that is farthest from all points, of those as far the one with most grains; `parts` if all are taken. */
static uint32_t loneliest(const update *d, uint32_t c, const int32_t cell[3], const bool taken[8]) {
	const uint32_t parts = parts_of(d);
	quern_real held[8] = { 0 }, most = 0;
	uint32_t best = parts;
	weigh_parts(d, c, cell, held);
	for (uint32_t p = 0; p < parts; p++) {
		const quern_real far = taken[p] ? 0 : loneliness(d, c, cell, p);
		const bool alike = best < parts && fabs(far - most) < 1e-9;
		if (taken[p] || (alike ? held[p] <= held[best] : far <= most)) continue;
		most = far, best = p;
	}
	return best;
}

/* An empty quadrant of a thinly populated cell gets a point that takes an equal share from each of the others. */
static void split(update *d, uint32_t c) {
	const quern_column *u = d->u;
	const uint32_t n = d->point_begin[c + 1] - d->point_begin[c], parts = parts_of(d);
	const quern_real held = mass_held(d, c), share = 1.0 / (n + 1);
	int32_t cell[3];
	bool taken[8] = { false };
	if (!n || n >= parts || held * share < 0.25 * d->nominal) return;
	quern_grid_cell_of(d->g, c, cell);
	close_parts(d, c, cell, u[U_POINT_POSITION].real, d->point[d->point_begin[c]], taken);
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++)
		taken[part_of(d, cell, u[U_POINT_POSITION].real, d->point[q])] = true;
	const uint32_t free_part = loneliest(d, c, cell, taken);
	if (free_part == parts) return;
	new_point point = { .weight = point_share(d, c), .cell = (int32_t)c, .parent = -1 };
	part_centre(d, cell, free_part, point.position);
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
		const int32_t i = d->point[q];
		quern_real *mass = &u[U_POINT_MASS].real[0][i], *volume = &u[U_POINT_VOLUME].real[0][i];
		const quern_real given = share * *mass, room = share * *volume;
		if (point.parent < 0 || *mass > u[U_POINT_MASS].real[0][point.parent]) point.parent = i;
		for (uint32_t k = 0; k < d->s->dim; k++) point.velocity[k] += given * u[U_POINT_VELOCITY].real[k][i];
		for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, d->s->dim); k++)
			point.stress[k] += room * u[U_POINT_STRESS].real[k][i];
		point.mass += given;
		point.volume += room;
		*mass -= given;
		*volume -= room;
	}
	for (uint32_t k = 0; k < d->s->dim; k++) point.velocity[k] /= point.mass;
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, d->s->dim); k++)
		point.stress[k] /= point.volume;
	add_point(d, &point);
}

bool quern_hybrid_presses(const update *d, int32_t i) {
	quern_real trace = 0;
	for (uint32_t k = 0; k < d->s->dim; k++) trace += d->u[U_POINT_STRESS].real[k][i];
	return trace < 0;
}

/* The nearest point of the cell, if there is one then of those that are open or closed like it. */
static int32_t partner_of(const update *d, uint32_t c, int32_t light) {
	const quern_column *x = &d->u[U_POINT_POSITION];
	const bool closed = quern_hybrid_presses(d, light);
	int32_t near = -1;
	quern_real least = INFINITY;
	bool unlike = true;
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
		const int32_t i = d->point[q];
		const bool other = quern_hybrid_presses(d, i) != closed;
		quern_real d2 = 0;
		if (i == light) continue;
		for (uint32_t k = 0; k < d->s->dim; k++)
			d2 += (x->real[k][i] - x->real[k][light]) * (x->real[k][i] - x->real[k][light]);
		if (other > unlike || (other == unlike && d2 >= least)) continue;
		least = d2, near = i, unlike = other;
	}
	return near;
}

/* In a crowded cell the lightest point joins its nearest neighbour. */
static void merge(update *d, uint32_t c) {
	const quern_column *u = d->u;
	const uint32_t begin = d->point_begin[c], end = d->point_begin[c + 1], dim = d->s->dim;
	int32_t light = -1;
	if (end - begin <= 3 * parts_of(d)) return;
	for (uint32_t q = begin; q < end; q++)
		if (light < 0 || u[U_POINT_MASS].real[0][d->point[q]] < u[U_POINT_MASS].real[0][light])
			light = d->point[q];
	const int32_t near = partner_of(d, c, light);
	const quern_real a = u[U_POINT_MASS].real[0][near], b = u[U_POINT_MASS].real[0][light];
	const quern_real va = u[U_POINT_VOLUME].real[0][near], vb = u[U_POINT_VOLUME].real[0][light];
	for (uint32_t k = 0; k < dim; k++) {
		quern_real *v = u[U_POINT_VELOCITY].real[k], *x = u[U_POINT_POSITION].real[k];
		v[near] = (a * v[near] + b * v[light]) / (a + b);
		x[near] = (a * x[near] + b * x[light]) / (a + b);
	}
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, dim); k++) {
		quern_real *stress = u[U_POINT_STRESS].real[k];
		stress[near] = (va * stress[near] + vb * stress[light]) / (va + vb);
	}
	d->s->host->give(d->s->run, "point", (uint32_t)light, near, 1, b / (a + b));
	u[U_POINT_MASS].real[0][near] = a + b;
	u[U_POINT_VOLUME].real[0][near] = va + vb;
	d->drop_point[light] = true;
}

quern_status quern_hybrid_points(update *d) {
	uint8_t *made = d->s->host->memory(d->s->run, (size_t)d->n_cells + 1);
	const quern_status status = made ? quern_hybrid_absorb(d, made) : QUERN_E_MEMORY;
	for (uint32_t q = 0; q < d->n_cells && status == QUERN_OK; q++) {
		const uint32_t c = nth_cell(d, q), before = d->n_new_points;
		if (d->zone[c] == QUERN_DISCRETE || made[c]) continue;
		split(d, c);
		if (d->n_new_points == before) merge(d, c);
	}
	return status;
}

/* ---- the set itself ---- */

/* What a part remembers, from all points of its cell that have each given as much of themselves. `now`: by old entry. */
static void take_part(const update *d, const new_point *p, uint32_t to, const int32_t *now) {
	const uint32_t begin = d->point_begin[p->cell], end = d->point_begin[p->cell + 1];
	quern_real mass = 0;
	for (uint32_t q = begin; q < end; q++) {
		const uint32_t i = (uint32_t)now[d->point[q]];
		const quern_real m = d->u[U_POINT_MASS].real[0][i];
		mass += m;
		d->s->host->give(d->s->run, "point", i, (int32_t)to, 1.0 / (end - begin + 1), m / mass);
	}
}

quern_status quern_hybrid_apply_points(update *d) {
	const quern_step *s = d->s;
	const uint32_t dim = s->dim;
	int32_t *parent = s->host->memory(s->run, ((size_t)d->n_new_points + 1) * sizeof(int32_t));
	int32_t *now = s->host->memory(s->run, ((size_t)d->n_points + 1) * sizeof(int32_t));
	if (!parent || !now) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < d->n_new_points; i++) parent[i] = d->points[i].parent;
	renewal r = {
		.set = "point", .drop = d->drop_point, .n_new = d->n_new_points, .parent = parent, .now = now
	};
	const quern_status status = quern_renew(s, &r);
	if (status != QUERN_OK) return status;
	const quern_column *u = d->u;
	for (uint32_t i = 0; i < d->n_new_points; i++) {
		const new_point *p = &d->points[i];
		const uint32_t to = r.first + i;
		for (uint32_t k = 0; k < dim; k++) {
			u[U_POINT_POSITION].real[k][to] = p->position[k];
			u[U_POINT_VELOCITY].real[k][to] = p->velocity[k];
		}
		for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, dim); k++)
			u[U_POINT_STRESS].real[k][to] = p->stress[k];
		u[U_POINT_MASS].real[0][to] = p->mass;
		u[U_POINT_VOLUME].real[0][to] = p->parent < 0 ? p->mass / d->h->packed : p->volume;
		u[U_POINT_WEIGHT].real[0][to] = p->weight;
		if (p->parent < 0) quern_hybrid_assign(d, to, 1);
		else take_part(d, p, to, now);
	}
	if (r.first != d->n_points || d->n_new_points) u[U_UNSORTED].index[0] = 1;
	return QUERN_OK;
}
