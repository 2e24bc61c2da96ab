/* points - mass owed to the continuum becomes points, or joins those that are there; few are split, many are merged */
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
		quern_real t = (x[k][i] - d->g->lower[k]) / d->g->cell - cell[k];
		if (d->g->periodic[k] && t < -1) t += d->g->cells[k];
		if (d->g->periodic[k] && t > 2) t -= d->g->cells[k];
		part |= (uint32_t)(t >= 0.5) << k;
	}
	return part;
}

static void part_centre(const update *d, const int32_t cell[3], uint32_t part, quern_real x[3]) {
	for (uint32_t k = 0; k < 3; k++)
		x[k] = k < d->s->dim ? d->g->lower[k] + (cell[k] + (part >> k & 1 ? 0.75 : 0.25)) * d->g->cell : 0;
}

/* As many points as the mass is worth, a power of two, where the grains are. */
static void create(update *d, uint32_t c, quern_real mass, const quern_real v[3]) {
	const uint32_t parts = parts_of(d);
	uint32_t count = 1;
	int32_t cell[3];
	quern_real held[8] = { 0 };
	bool taken[8] = { false };
	quern_hybrid_cell(d, c, cell);
	while (count < parts && mass / d->nominal >= 1.5 * count) count *= 2;
	for (uint32_t q = d->grain_begin[c]; q < d->grain_begin[c + 1]; q++)
		held[part_of(d, cell, d->u[U_GRAIN_POSITION].real, d->grain[q])] +=
			d->u[U_GRAIN_MASS].real[0][d->grain[q]];
	for (uint32_t k = 0; k < count; k++) {
		uint32_t best = parts;
		for (uint32_t p = 0; p < parts; p++)
			if (!taken[p] && (best == parts || held[p] > held[best])) best = p;
		taken[best] = true;
		new_point point = { .mass = mass / count, .weight = point_share(d->zone[c]), .cell = (int32_t)c };
		part_centre(d, cell, best, point.position);
		memcpy(point.velocity, v, sizeof point.velocity);
		quern_hybrid_contact_stress(d, c, point.stress);
		add_point(d, &point);
	}
}

/* ---- giving and taking ---- */

static void draw(const update *d, uint32_t c, quern_real mass, const quern_real v[3]) {
	d->u[U_POINT_OWED].real[0][c] -= mass;
	for (uint32_t k = 0; k < d->s->dim; k++) d->u[U_POINT_OWED_MOMENTUM].real[k][c] -= mass * v[k];
}

/* Mass and volume grow in proportion; stress and history stay. */
static void grow(update *d, uint32_t c, quern_real mass, quern_real held, const quern_real v[3]) {
	const quern_column *u = d->u;
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
		const int32_t i = d->point[q];
		const quern_real m = u[U_POINT_MASS].real[0][i], more = mass * m / held;
		for (uint32_t k = 0; k < d->s->dim; k++) {
			quern_real *p = &u[U_POINT_VELOCITY].real[k][i];
			*p = (m * *p + more * v[k]) / (m + more);
		}
		u[U_POINT_MASS].real[0][i] = m + more;
		u[U_POINT_VOLUME].real[0][i] *= (m + more) / m;
	}
}

static void shrink(update *d, uint32_t c, quern_real mass, quern_real held) {
	const quern_column *u = d->u;
	const quern_real wanted = 1 + mass / held, factor = wanted > 0.7 ? wanted : 0.7,
					 weight = point_share(d->zone[c]);
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
		const int32_t i = d->point[q];
		const quern_real old = u[U_POINT_MASS].real[0][i], new = factor *old;
		quern_real v[3] = { 0 };
		for (uint32_t k = 0; k < d->s->dim; k++) v[k] = u[U_POINT_VELOCITY].real[k][i];
		u[U_POINT_MASS].real[0][i] = new;
		u[U_POINT_VOLUME].real[0][i] *= factor;
		draw(d, c, weight * (new - old), v);
	}
}

static quern_real mass_held(const update *d, uint32_t c) {
	quern_real sum = 0;
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++)
		sum += d->u[U_POINT_MASS].real[0][d->point[q]];
	return sum;
}

static void settle(update *d, uint32_t c) {
	const quern_real weight = point_share(d->zone[c]), owed = d->u[U_POINT_OWED].real[0][c],
					 mass = owed / weight;
	const quern_real held = mass_held(d, c);
	quern_real v[3] = { 0 };
	quern_hybrid_owed_velocity(d, c, owed, d->u[U_POINT_OWED_MOMENTUM], v);
	if (owed > 0 && held > 0) {
		grow(d, c, mass, held, v);
		draw(d, c, owed, v);
	} else if (owed > 0 && mass >= 0.4 * d->nominal) {
		create(d, c, mass, v);
		draw(d, c, owed, v);
	} else if (owed < 0 && held > 0) shrink(d, c, mass, held);
}

/* ---- few and many ---- */

/* An empty quadrant of a thinly populated cell gets a point that takes an equal share from each of the others. */
static void split(update *d, uint32_t c) {
	const quern_column *u = d->u;
	const uint32_t n = d->point_begin[c + 1] - d->point_begin[c], parts = parts_of(d);
	const quern_real held = mass_held(d, c), share = 1.0 / (n + 1);
	int32_t cell[3];
	bool taken[8] = { false };
	uint32_t free_part = parts;
	if (!n || n >= parts || held * share < 0.25 * d->nominal) return;
	quern_hybrid_cell(d, c, cell);
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++)
		taken[part_of(d, cell, u[U_POINT_POSITION].real, d->point[q])] = true;
	for (uint32_t p = parts; p-- > 0;)
		if (!taken[p]) free_part = p;
	if (free_part == parts) return;
	new_point point = { .mass = held * share, .weight = point_share(d->zone[c]), .cell = (int32_t)c };
	part_centre(d, cell, free_part, point.position);
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
		const int32_t i = d->point[q];
		const quern_real given = u[U_POINT_MASS].real[0][i] * share;
		for (uint32_t k = 0; k < d->s->dim; k++)
			point.velocity[k] += given * u[U_POINT_VELOCITY].real[k][i] / point.mass;
		for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, d->s->dim); k++)
			point.stress[k] += given * u[U_POINT_STRESS].real[k][i] / point.mass;
		u[U_POINT_MASS].real[0][i] -= given;
		u[U_POINT_VOLUME].real[0][i] *= 1 - share;
	}
	add_point(d, &point);
}

/* In a crowded cell the lightest point joins its nearest neighbour; mass, momentum and volume are kept. */
static void merge(update *d, uint32_t c) {
	const quern_column *u = d->u;
	const uint32_t begin = d->point_begin[c], end = d->point_begin[c + 1], dim = d->s->dim;
	int32_t light = -1, near = -1;
	quern_real least = INFINITY;
	if (end - begin <= 3 * parts_of(d)) return;
	for (uint32_t q = begin; q < end; q++)
		if (light < 0 || u[U_POINT_MASS].real[0][d->point[q]] < u[U_POINT_MASS].real[0][light])
			light = d->point[q];
	for (uint32_t q = begin; q < end; q++) {
		quern_real d2 = 0;
		if (d->point[q] == light) continue;
		for (uint32_t k = 0; k < dim; k++) {
			const quern_real x =
				u[U_POINT_POSITION].real[k][d->point[q]] - u[U_POINT_POSITION].real[k][light];
			d2 += x * x;
		}
		if (d2 < least) least = d2, near = d->point[q];
	}
	const quern_real a = u[U_POINT_MASS].real[0][near], b = u[U_POINT_MASS].real[0][light];
	const quern_real va = u[U_POINT_VOLUME].real[0][near], vb = u[U_POINT_VOLUME].real[0][light];
	for (uint32_t k = 0; k < dim; k++) {
		u[U_POINT_VELOCITY].real[k][near] =
			(a * u[U_POINT_VELOCITY].real[k][near] + b * u[U_POINT_VELOCITY].real[k][light]) / (a + b);
		u[U_POINT_POSITION].real[k][near] =
			(a * u[U_POINT_POSITION].real[k][near] + b * u[U_POINT_POSITION].real[k][light]) / (a + b);
	}
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, dim); k++)
		u[U_POINT_STRESS].real[k][near] =
			(va * u[U_POINT_STRESS].real[k][near] + vb * u[U_POINT_STRESS].real[k][light]) / (va + vb);
	u[U_POINT_MASS].real[0][near] = a + b;
	u[U_POINT_VOLUME].real[0][near] = va + vb;
	quern_hybrid_assign(d, (uint32_t)near, 1);
	d->drop_point[light] = true;
}

void quern_hybrid_points(update *d) {
	for (uint32_t c = 0; c < d->n_cells; c++) {
		if (d->zone[c] == QUERN_DISCRETE) continue;
		const uint32_t before = d->n_new_points;
		if (d->u[U_POINT_OWED].real[0][c] != 0) settle(d, c);
		if (d->n_new_points == before) split(d, c);
		if (d->n_new_points == before) merge(d, c);
	}
}

/* ---- the set itself ---- */

quern_status quern_hybrid_apply_points(update *d) {
	const quern_step *s = d->s;
	const uint32_t dim = s->dim;
	uint32_t kept = 0;
	int32_t *from = s->host->memory(s->run, ((size_t)d->n_points + d->n_new_points + 1) * sizeof(int32_t));
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < d->n_points; i++)
		if (!d->drop_point[i]) from[kept++] = (int32_t)i;
	for (uint32_t i = 0; i < d->n_new_points; i++) from[kept + i] = -1;
	const quern_status status = s->host->remap(s->run, "point", kept + d->n_new_points, from, 0, NULL);
	if (status != QUERN_OK) return status;
	const quern_column *u = d->u;
	for (uint32_t i = 0; i < d->n_new_points; i++) {
		const new_point *p = &d->points[i];
		const uint32_t to = kept + i;
		for (uint32_t k = 0; k < dim; k++) {
			u[U_POINT_POSITION].real[k][to] = p->position[k];
			u[U_POINT_VELOCITY].real[k][to] = p->velocity[k];
		}
		for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, dim); k++)
			u[U_POINT_STRESS].real[k][to] = p->stress[k];
		u[U_POINT_MASS].real[0][to] = p->mass;
		u[U_POINT_VOLUME].real[0][to] = p->mass / d->h->packed;
		u[U_POINT_WEIGHT].real[0][to] = p->weight;
	}
	quern_hybrid_assign(d, kept, d->n_new_points);
	u[U_UNSORTED].index[0] = 1;
	return QUERN_OK;
}
