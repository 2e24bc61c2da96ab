/* SPDX-License-Identifier: MIT */
/* points - mass owed to the continuum becomes points, or joins those that are there; few are split, many are merged */
#include "../common/stressed.h"
#include "update.h"
#include <math.h>
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

/* Marks the parts whose middle cannot be seen from particle i of the cell, since a body is in the way, unless that is
 * true of all; returns how many are left. */
static uint32_t close_parts(
	const update *d, uint32_t c, const int32_t cell[3], quern_real *const x[3], int32_t i, bool closed[8]) {
	const quern_images images = quern_grid_images(d->g);
	const uint32_t parts = resample_parts(&d->points);
	uint32_t n = 0;
	for (uint32_t p = 0; p < parts; p++) {
		quern_real to[3], from[3] = { 0 };
		quern_resample_middle(&d->points, cell, p, to);
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
		held[quern_resample_part(&d->points, cell, d->u[U_GRAIN_POSITION].real, d->grain[q])] +=
			d->u[U_GRAIN_MASS].real[0][d->grain[q]];
}

/* As many points as the mass is worth, a power of two if bodies leave the room, where the grains are; one in every part of a cell
 * that has no grains, so that no part comes before another. */
void quern_hybrid_create(update *d, uint32_t c, quern_real mass, const quern_real v[3]) {
	const uint32_t parts = resample_parts(&d->points);
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
		point.volume = point.mass / d->h->packed;
		quern_resample_middle(&d->points, cell, best, point.position);
		memcpy(point.velocity, v, sizeof point.velocity);
		memcpy(point.stress, stress, sizeof stress);
		quern_resample_add(&d->points, &point);
	}
}

/* ---- few and many ---- */

/* An empty quadrant of a thinly populated cell gets a point that takes an equal share from each of the others. */
static bool split(update *d, uint32_t c) {
	const uint32_t n = d->point_begin[c + 1] - d->point_begin[c];
	resample_split how = { .weight = point_share(d, c) };
	int32_t cell[3];
	if (!n || n >= resample_parts(&d->points)) return false;
	quern_grid_cell_of(d->g, c, cell);
	close_parts(d, c, cell, d->u[U_POINT_POSITION].real, d->point[d->point_begin[c]], how.closed);
	weigh_parts(d, c, cell, how.held);
	return quern_resample_split(&d->points, c, &how);
}

static void begin_points(update *d) {
	const quern_column *u = d->u;
	d->points = (resample) { .s = d->s,
		.g = d->g,
		.position = &u[U_POINT_POSITION],
		.velocity = &u[U_POINT_VELOCITY],
		.mass = &u[U_POINT_MASS],
		.volume = &u[U_POINT_VOLUME],
		.stress = &u[U_POINT_STRESS],
		.weight = &u[U_POINT_WEIGHT],
		.begin = d->point_begin,
		.point = d->point,
		.nominal = d->nominal,
		.drop = d->drop_point };
}

quern_status quern_hybrid_points(update *d) {
	uint8_t *made = d->s->host->memory(d->s->run, (size_t)d->n_cells + 1);
	begin_points(d);
	const quern_status status = made ? quern_hybrid_absorb(d, made) : QUERN_E_MEMORY;
	for (uint32_t q = 0; q < d->n_cells && status == QUERN_OK; q++) {
		const uint32_t c = nth_cell(d, q);
		if (d->zone[c] == QUERN_DISCRETE || made[c] || split(d, c)) continue;
		if (d->point_begin[c + 1] - d->point_begin[c] > 3 * resample_parts(&d->points))
			quern_resample_join(&d->points, c);
	}
	return d->points.failed ? QUERN_E_MEMORY : status;
}

quern_status quern_hybrid_apply_points(update *d) {
	const quern_status status = quern_resample_apply(&d->points);
	if (status != QUERN_OK) return status;
	for (uint32_t i = 0; i < d->points.n_made; i++)
		if (d->points.made[i].parent < 0) quern_hybrid_assign(d, d->points.first + i, 1);
	if (d->points.first != d->n_points || d->points.n_made) d->u[U_UNSORTED].index[0] = 1;
	return QUERN_OK;
}
