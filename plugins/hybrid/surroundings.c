/* SPDX-License-Identifier: MIT */
/* surroundings - how the flow around a new grain moves: its velocity and its spin. docs/theory/hybrid.md, section 4 */
#include "update.h"
#include <math.h>
#include <quern/math.h>

typedef struct {
	quern_real weight, velocity[3], moment[3][3]; /* sums over w, w v, w v_i x_j */
	quern_real way[3];
} surroundings;

static void look_at(const update *d, const quern_column *x, const quern_column *v, quern_real mass,
	uint32_t i, const quern_real at[3], surroundings *sum) {
	const uint32_t dim = d->s->dim;
	const quern_real inverse = 1 / d->h->diameter;
	quern_real r[3] = { 0 }, r2 = 0;
	for (uint32_t k = 0; k < dim; k++) {
		r[k] = quern_image(x->real[k][i] - at[k], d->images.half[k], d->images.length[k]);
		r2 += r[k] * r[k] * inverse * inverse;
	}
	if (r2 > 36) return;
	const quern_real w = mass * quern_exp(-0.5 * r2);
	sum->weight += w;
	for (uint32_t k = 0; k < dim; k++) {
		sum->velocity[k] += w * v->real[k][i];
		sum->way[k] += w * r[k];
		for (uint32_t j = 0; j < dim; j++) sum->moment[k][j] += w * v->real[k][i] * r[j];
	}
}

static void look_into(const update *d, uint32_t c, const quern_real at[3], surroundings *sum) {
	const quern_column *u = d->u;
	for (uint32_t q = d->grain_begin[c]; q < d->grain_begin[c + 1]; q++) {
		const uint32_t i = (uint32_t)d->grain[q];
		look_at(d, &u[U_GRAIN_POSITION], &u[U_GRAIN_VELOCITY], cloud_mass(&d->moving_grains, i), i, at, sum);
	}
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
		const uint32_t i = (uint32_t)d->point[q];
		look_at(d, &u[U_POINT_POSITION], &u[U_POINT_VELOCITY], cloud_mass(&d->all_points, i), i, at, sum);
	}
}

static void look_around(const update *d, const quern_real at[3], surroundings *sum) {
	const quern_real reach = 6 * d->h->diameter;
	int32_t low[3] = { 0 }, high[3] = { 0 };
	*sum = (surroundings) { .weight = 0 };
	for (uint32_t k = 0; k < d->s->dim; k++) {
		low[k] = quern_grid_cell(d->g, k, at[k] - reach);
		high[k] = quern_grid_cell(d->g, k, at[k] + reach);
		if (d->g->periodic[k] && high[k] - low[k] >= d->g->cells[k]) low[k] = 0, high[k] = d->g->cells[k] - 1;
	}
	for (int32_t z = low[2]; z <= high[2]; z++)
		for (int32_t y = low[1]; y <= high[1]; y++)
			for (int32_t x = low[0]; x <= high[0]; x++) {
				const int32_t c = quern_grid_entry_back(d->g, (int32_t[3]) { x, y, z });
				if (c >= 0) look_into(d, (uint32_t)c, at, sum);
			}
}

/* Velocity: the mean under a Gaussian of one diameter; spin: half the curl of that mean as a field. */
void quern_hybrid_motion(const update *d, new_grain *g) {
	const quern_real inverse2 = 1 / (d->h->diameter * d->h->diameter);
	quern_real slope[3][3] = { { 0 } };
	surroundings sum;
	look_around(d, g->position, &sum);
	if (!(sum.weight > 0)) return;
	for (uint32_t k = 0; k < d->s->dim; k++) g->velocity[k] = sum.velocity[k] / sum.weight;
	for (uint32_t k = 0; k < d->s->dim; k++)
		for (uint32_t j = 0; j < d->s->dim; j++)
			slope[k][j] = (sum.moment[k][j] - g->velocity[k] * sum.way[j]) * inverse2 / sum.weight;
	if (d->s->dim == 2) g->spin[0] = 0.5 * (slope[1][0] - slope[0][1]);
	else
		for (uint32_t k = 0; k < 3; k++)
			g->spin[k] = 0.5 * (slope[(k + 2) % 3][(k + 1) % 3] - slope[(k + 1) % 3][(k + 2) % 3]);
}
