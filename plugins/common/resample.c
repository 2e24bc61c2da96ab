/* SPDX-License-Identifier: MIT */
#include "resample.h"
#include "renew.h"
#include "tools.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void quern_resample_add(resample *r, const new_point *p) {
	if (r->n_made == r->cap) {
		const uint32_t cap = r->cap ? 2 * r->cap : 1024;
		new_point *grown = realloc(r->made, cap * sizeof(new_point));
		if (!grown) {
			r->failed = true;
			return;
		}
		r->made = grown;
		r->cap = cap;
	}
	r->made[r->n_made++] = *p;
}

uint32_t quern_resample_part(const resample *r, const int32_t cell[3], quern_real *const x[3], int32_t i) {
	uint32_t part = 0;
	for (uint32_t k = 0; k < r->s->dim; k++) {
		const quern_real around = r->g->periodic[k] ? (quern_real)r->g->cells[k] : INFINITY;
		const quern_real t = (x[k][i] - r->g->lower[k]) / r->g->cell - cell[k];
		part |= (uint32_t)(quern_image_at(t, 0.5, 0.5 * around, around) >= 0.5) << k;
	}
	return part;
}

void quern_resample_middle(const resample *r, const int32_t cell[3], uint32_t part, quern_real x[3]) {
	for (uint32_t k = 0; k < 3; k++)
		x[k] = k < r->s->dim ? r->g->lower[k] + (cell[k] + (part >> k & 1 ? 0.75 : 0.25)) * r->g->cell : 0;
}

/* ---- few ---- */

static quern_real mass_held(const resample *r, uint32_t c) {
	quern_real sum = 0;
	for (uint32_t q = r->begin[c]; q < r->begin[c + 1]; q++) sum += r->mass->real[0][r->point[q]];
	return sum;
}

/* From a part's middle to the nearest point of the cell, squared, in cells. */
static quern_real loneliness(const resample *r, uint32_t c, const int32_t cell[3], uint32_t part) {
	const quern_images images = quern_grid_images(r->g);
	quern_real to[3], least = INFINITY;
	quern_resample_middle(r, cell, part, to);
	for (uint32_t q = r->begin[c]; q < r->begin[c + 1]; q++) {
		quern_real d2 = 0;
		for (uint32_t k = 0; k < r->s->dim; k++) {
			const quern_real way =
				quern_image(r->position->real[k][r->point[q]] - to[k], images.half[k], images.length[k]) /
				r->g->cell;
			d2 += way * way;
		}
		least = fmin(least, d2);
	}
	return least;
}

/* The part that is farthest from all points, of those as far the one that holds most; the number of parts if all are taken. */
static uint32_t loneliest(const resample *r, uint32_t c, const int32_t cell[3], const resample_split *how) {
	const uint32_t parts = resample_parts(r);
	bool taken[8] = { false };
	quern_real most = 0;
	uint32_t best = parts;
	memcpy(taken, how->closed, sizeof taken);
	for (uint32_t q = r->begin[c]; q < r->begin[c + 1]; q++)
		taken[quern_resample_part(r, cell, r->position->real, r->point[q])] = true;
	for (uint32_t p = 0; p < parts; p++) {
		const quern_real far = taken[p] ? 0 : loneliness(r, c, cell, p);
		const bool alike = best < parts && fabs(far - most) < 1e-9;
		if (taken[p] || (alike ? how->held[p] <= how->held[best] : far <= most)) continue;
		most = far, best = p;
	}
	return best;
}

/* Takes this share of every point of the cell. */
static void take_shares(const resample *r, uint32_t c, quern_real share, new_point *p) {
	const uint32_t dim = r->s->dim, parts = quern_shape_size(QUERN_SYMMETRIC, dim);
	quern_real heaviest = 0;
	for (uint32_t q = r->begin[c]; q < r->begin[c + 1]; q++) {
		const int32_t i = r->point[q];
		quern_real *mass = &r->mass->real[0][i], *volume = &r->volume->real[0][i];
		const quern_real given = share * *mass, room = share * *volume;
		if (p->parent < 0 || *mass > heaviest) p->parent = i, heaviest = *mass;
		for (uint32_t k = 0; k < dim; k++) p->velocity[k] += given * r->velocity->real[k][i];
		for (uint32_t k = 0; k < parts; k++) p->stress[k] += room * r->stress->real[k][i];
		p->mass += given;
		p->volume += room;
		*mass -= given;
		*volume -= room;
	}
	for (uint32_t k = 0; k < dim; k++) p->velocity[k] /= p->mass;
	for (uint32_t k = 0; k < parts; k++) p->stress[k] /= p->volume;
}

/* Whether every point of the cell can spare its share. */
static bool can_give(const resample *r, uint32_t c) {
	const uint32_t n = r->begin[c + 1] - r->begin[c];
	return n && !(mass_held(r, c) * (1.0 / (n + 1)) < 0.25 * r->nominal);
}

static void part_from(resample *r, uint32_t c, new_point *p) {
	take_shares(r, c, 1.0 / (r->begin[c + 1] - r->begin[c] + 1), p);
	quern_resample_add(r, p);
}

bool quern_resample_split(resample *r, uint32_t c, const resample_split *how) {
	int32_t cell[3];
	if (!can_give(r, c)) return false;
	quern_grid_cell_of(r->g, c, cell);
	const uint32_t part = loneliest(r, c, cell, how);
	if (part == resample_parts(r)) return false;
	new_point p = { .weight = how->weight, .cell = (int32_t)c, .parent = -1 };
	quern_resample_middle(r, cell, part, p.position);
	part_from(r, c, &p);
	return true;
}

/* The way from the middle of a cell's mass to a place. */
static void way_from(const resample *r, uint32_t c, const quern_real to[3], quern_real way[3]) {
	const quern_images images = quern_grid_images(r->g);
	const quern_real held = mass_held(r, c);
	for (uint32_t k = 0; k < r->s->dim; k++) {
		quern_real moment = 0;
		for (uint32_t q = r->begin[c]; q < r->begin[c + 1]; q++)
			moment += r->mass->real[0][r->point[q]] * quern_image(to[k] - r->position->real[k][r->point[q]],
														  images.half[k], images.length[k]);
		way[k] = moment / held;
	}
}

/* How much of the steps -way/n all points of a cell can go without leaving it. */
static quern_real free_share(const resample *r, uint32_t c, const int32_t cell[3], const quern_real way[3]) {
	const uint32_t n = r->begin[c + 1] - r->begin[c];
	quern_real most = 1;
	for (uint32_t k = 0; k < r->s->dim; k++) {
		const quern_real low = r->g->lower[k] + cell[k] * r->g->cell, step = way[k] / n;
		for (uint32_t q = r->begin[c]; q < r->begin[c + 1]; q++) {
			const quern_real x = r->position->real[k][r->point[q]],
							 room =
								 fmax(0, step > 0 ? x - low
												  : low + r->g->cell - x); /* by rounding it may be outside */
			if (fabs(step) * most > room) most = room / fabs(step);
		}
	}
	return most;
}

/* Whether so much of a way is a quarter of a cell: nearer to those that gave, a new point would be no use. */
static bool is_apart(const resample *r, quern_real part, const quern_real way[3]) {
	quern_real square = 0;
	for (uint32_t k = 0; k < r->s->dim; k++) square += part * way[k] * part * way[k];
	return square >= 0.0625 * r->g->cell * r->g->cell;
}

bool quern_resample_fill(resample *r, uint32_t c, int32_t into) {
	const resample_split how = { .weight = 1 };
	const uint32_t n = r->begin[c + 1] - r->begin[c];
	quern_real to[3], way[3] = { 0 };
	int32_t cell[3];
	if (!can_give(r, c)) return false;
	quern_grid_cell_of(r->g, c, cell);
	if (into < 0) {
		const uint32_t part = loneliest(r, c, cell, &how);
		if (part == resample_parts(r)) return false;
		quern_resample_middle(r, cell, part, to);
	} else {
		int32_t other[3];
		quern_grid_cell_of(r->g, (uint32_t)into, other);
		for (uint32_t k = 0; k < 3; k++) to[k] = r->g->lower[k] + (other[k] + 0.5) * r->g->cell;
	}
	way_from(r, c, to, way);
	const quern_real part = free_share(r, c, cell, way);
	if (!(into < 0 ? is_apart(r, part * (1 + 1.0 / n), way) : part >= 0.5)) return false;
	new_point p = { .weight = how.weight, .cell = (int32_t)c, .parent = -1 };
	for (uint32_t k = 0; k < r->s->dim; k++) {
		p.position[k] = to[k] - (1 - part) * way[k];
		for (uint32_t q = r->begin[c]; q < r->begin[c + 1]; q++)
			r->position->real[k][r->point[q]] -= part * way[k] / n;
	}
	part_from(r, c, &p);
	return true;
}

/* ---- many ---- */

static bool presses(const resample *r, int32_t i) {
	quern_real trace = 0;
	for (uint32_t k = 0; k < r->s->dim; k++) trace += r->stress->real[k][i];
	return trace < 0;
}

/* The nearest point of the cell, if there is one then of those that are open or closed like it. */
static int32_t partner_of(const resample *r, uint32_t c, int32_t light) {
	const quern_column *x = r->position;
	const bool closed = presses(r, light);
	int32_t near = -1;
	quern_real least = INFINITY;
	bool unlike = true;
	for (uint32_t q = r->begin[c]; q < r->begin[c + 1]; q++) {
		const int32_t i = r->point[q];
		const bool other = presses(r, i) != closed;
		quern_real d2 = 0;
		if (i == light) continue;
		for (uint32_t k = 0; k < r->s->dim; k++)
			d2 += (x->real[k][i] - x->real[k][light]) * (x->real[k][i] - x->real[k][light]);
		if (other > unlike || (other == unlike && d2 >= least)) continue;
		least = d2, near = i, unlike = other;
	}
	return near;
}

void quern_resample_join(resample *r, uint32_t c) {
	const uint32_t dim = r->s->dim;
	int32_t light = -1;
	for (uint32_t q = r->begin[c]; q < r->begin[c + 1]; q++)
		if (light < 0 || r->mass->real[0][r->point[q]] < r->mass->real[0][light]) light = r->point[q];
	const int32_t near = partner_of(r, c, light);
	const quern_real a = r->mass->real[0][near], b = r->mass->real[0][light];
	const quern_real va = r->volume->real[0][near], vb = r->volume->real[0][light];
	for (uint32_t k = 0; k < dim; k++) {
		quern_real *v = r->velocity->real[k], *x = r->position->real[k];
		v[near] = (a * v[near] + b * v[light]) / (a + b);
		x[near] = (a * x[near] + b * x[light]) / (a + b);
	}
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, dim); k++) {
		quern_real *stress = r->stress->real[k];
		stress[near] = (va * stress[near] + vb * stress[light]) / (va + vb);
	}
	r->s->host->give(r->s->run, "point", (uint32_t)light, near, 1, b / (a + b));
	r->mass->real[0][near] = a + b;
	r->volume->real[0][near] = va + vb;
	r->drop[light] = true;
}

/* ---- the set itself ---- */

/* What a part remembers, from all points of its cell that have each given as much of themselves. `now`: by old entry. */
static void take_part(const resample *r, const new_point *p, uint32_t to, const int32_t *now) {
	const uint32_t begin = r->begin[p->cell], end = r->begin[p->cell + 1];
	quern_real mass = 0;
	for (uint32_t q = begin; q < end; q++) {
		const uint32_t i = (uint32_t)now[r->point[q]];
		const quern_real m = r->mass->real[0][i];
		mass += m;
		r->s->host->give(r->s->run, "point", i, (int32_t)to, 1.0 / (end - begin + 1), m / mass);
	}
}

static void write_point(const resample *r, const new_point *p, uint32_t to) {
	for (uint32_t k = 0; k < r->s->dim; k++) {
		r->position->real[k][to] = p->position[k];
		r->velocity->real[k][to] = p->velocity[k];
	}
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, r->s->dim); k++)
		r->stress->real[k][to] = p->stress[k];
	r->mass->real[0][to] = p->mass;
	r->volume->real[0][to] = p->volume;
	if (r->weight->real[0]) r->weight->real[0][to] = p->weight;
}

quern_status quern_resample_apply(resample *r) {
	const quern_step *s = r->s;
	const uint32_t n = s->host->set(s->run, "point").n;
	int32_t *parent = s->host->memory(s->run, ((size_t)r->n_made + 1) * sizeof(int32_t));
	int32_t *now = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	if (!parent || !now) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < r->n_made; i++) parent[i] = r->made[i].parent;
	renewal renewed = { .set = "point", .drop = r->drop, .n_new = r->n_made, .parent = parent, .now = now };
	const quern_status status = quern_renew(s, &renewed);
	if (status != QUERN_OK) return status;
	r->first = renewed.first;
	for (uint32_t i = 0; i < r->n_made; i++) {
		write_point(r, &r->made[i], r->first + i);
		if (r->made[i].parent >= 0) take_part(r, &r->made[i], r->first + i, now);
	}
	return QUERN_OK;
}
