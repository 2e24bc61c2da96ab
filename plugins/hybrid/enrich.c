/* SPDX-License-Identifier: MIT */
/* enrich - mass owed to the grains becomes grains: a packer places them, the flow around gives them their motion */
#include "../common/placer.h"
#include "update.h"
#include <math.h>
#include <quern/math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SEEDS = 4096 };

typedef struct {
	update *d;
	placer placer;
	quern_spot *seed;
	uint64_t draws;
	uint32_t c;                    /* the cell that is being enriched */
	quern_real lower[3], upper[3]; /* of it */
	quern_real rest;               /* kg still owed to it */
	uint32_t first;                /* of its grains among the new ones */
} enriching;

static quern_real mass_of(const hybrid *h, quern_real r) { return quern_radius_mass(r, h->density, h->dim); }

static quern_real waiting(const enriching *e) {
	return quern_radius_draw(&e->d->h->radii, e->d->s->host, e->draws);
}

/* Half a grain over would never be paid back: a grain is placed while more than all of it is owed. */
static bool is_owed(const enriching *e) {
	return e->rest > grain_share(e->d, e->c) * mass_of(e->d->h, waiting(e));
}

/* ---- what a packer may ask ---- */

static quern_real job_radius(quern_pack_job *job) { return waiting(job->scene); }

static bool job_inside(const quern_pack_job *job, const quern_real x[3]) {
	const enriching *e = job->scene;
	for (uint32_t k = 0; k < e->d->s->dim; k++)
		if (x[k] < e->lower[k] || x[k] >= e->upper[k]) return false;
	return true;
}

static bool job_free(const quern_pack_job *job, const quern_spot *spot) {
	return quern_placer_free(&((const enriching *)job->scene)->placer, spot);
}

static bool job_place(quern_pack_job *job, const quern_spot *spot) {
	enriching *e = job->scene;
	update *d = e->d;
	if (d->n_new_grains == d->cap_grains) {
		const uint32_t cap = d->cap_grains ? 2 * d->cap_grains : 256;
		new_grain *grown = realloc(d->grains, cap * sizeof(new_grain));
		if (!grown) return d->failed = true, false;
		d->grains = grown;
		d->cap_grains = cap;
	}
	new_grain *g = &d->grains[d->n_new_grains++];
	*g = (new_grain) { .radius = spot->radius, .weight = grain_share(d, e->c), .cell = (int32_t)e->c };
	memcpy(g->position, spot->x, sizeof g->position);
	quern_placer_add(&e->placer, spot);
	e->rest -= g->weight * mass_of(d->h, g->radius);
	e->draws++;
	d->failed = d->failed || e->placer.failed;
	return !d->failed && is_owed(e);
}

/* ---- the motion of the flow around ---- */

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
	const cloud grains = moving_grains(d->s), points = all_points(d->s);
	for (uint32_t q = d->grain_begin[c]; q < d->grain_begin[c + 1]; q++) {
		const uint32_t i = (uint32_t)d->grain[q];
		look_at(d, &u[U_GRAIN_POSITION], &u[U_GRAIN_VELOCITY], cloud_mass(&grains, i), i, at, sum);
	}
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
		const uint32_t i = (uint32_t)d->point[q];
		look_at(d, &u[U_POINT_POSITION], &u[U_POINT_VELOCITY], cloud_mass(&points, i), i, at, sum);
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
static void set_motion(const update *d, new_grain *g) {
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

/* ---- one cell ---- */

/* The packer's grains together get the momentum that was owed; what they draw is booked. */
static void settle(enriching *e) {
	update *d = e->d;
	const uint32_t dim = d->s->dim;
	quern_real *owed = d->u[U_GRAIN_OWED].real[0];
	quern_real mass = 0, momentum[3] = { 0 }, wanted[3] = { 0 };
	quern_hybrid_owed_velocity(d, e->c, owed[e->c], d->u[U_GRAIN_OWED_MOMENTUM], wanted);
	for (uint32_t i = e->first; i < d->n_new_grains; i++) {
		const quern_real m = mass_of(d->h, d->grains[i].radius);
		set_motion(d, &d->grains[i]);
		mass += m;
		for (uint32_t k = 0; k < dim; k++) momentum[k] += m * d->grains[i].velocity[k];
	}
	for (uint32_t i = e->first; i < d->n_new_grains; i++) {
		new_grain *g = &d->grains[i];
		const quern_real m = g->weight * mass_of(d->h, g->radius);
		owed[e->c] -= m;
		for (uint32_t k = 0; k < dim; k++) {
			g->velocity[k] += wanted[k] - momentum[k] / mass;
			d->u[U_GRAIN_OWED_MOMENTUM].real[k][e->c] -= m * g->velocity[k];
		}
	}
}

/* Unit vector towards the neighbours that are pure continuum; zero if there are none, or all around. */
static void find_upstream(const update *d, const int32_t cell[3], quern_real upstream[3]) {
	quern_real length = 0;
	int32_t other[3];
	for (uint32_t k = 0; k < d->s->dim; k++) {
		for (int step = -1; step <= 1; step += 2) {
			const int32_t c = quern_hybrid_beside(d, cell, k, step, other);
			if (c >= 0 && d->zone[c] == QUERN_CONTINUUM) upstream[k] += step;
		}
		length += upstream[k] * upstream[k];
	}
	for (uint32_t k = 0; k < d->s->dim && length > 0; k++) upstream[k] /= sqrt(length);
}

static void enrich_cell(enriching *e, uint32_t c) {
	update *d = e->d;
	const quern_bound *packer = &d->s->slot[SLOT_PACKER][0];
	int32_t cell[3];
	e->c = c;
	e->rest = d->u[U_GRAIN_OWED].real[0][c];
	e->first = d->n_new_grains;
	if (!is_owed(e) || !quern_grid_cell_of(d->g, c, cell)) return;
	for (uint32_t k = 0; k < 3; k++) {
		e->lower[k] = k < d->s->dim ? d->g->lower[k] + cell[k] * d->g->cell : 0;
		e->upper[k] = k < d->s->dim ? e->lower[k] + d->g->cell : 0;
	}
	quern_pack_job job = { .dim = d->s->dim,
		.stream = d->h->radii.stream + 1,
		.host = d->s->host,
		.key = (uint64_t)quern_grid_number(d->g, cell),
		.counter = (uint64_t)d->u[U_UPDATES].index[0] << 32,
		.seed = e->seed,
		.radius = job_radius,
		.inside = job_inside,
		.free = job_free,
		.place = job_place,
		.scene = e };
	memcpy(job.lower, e->lower, sizeof job.lower);
	memcpy(job.upper, e->upper, sizeof job.upper);
	find_upstream(d, cell, job.upstream);
	const uint32_t n = quern_placer_near(
		&e->placer, e->lower, e->upper, 2 * quern_radius_most(&d->h->radii), e->seed, MOST_SEEDS);
	job.n_seed = n < MOST_SEEDS ? n : MOST_SEEDS;
	((const quern_packer_ops *)packer->ops)->pack[d->s->dim - 2](packer->self, &job);
	settle(e);
}

/* ---- all cells, in their order ---- */

static bool place_obstacles(enriching *e) {
	const update *d = e->d;
	const quern_step *s = d->s;
	quern_real most = quern_radius_most(&d->h->radii);
	for (uint32_t i = 0; i < d->n_grains; i++)
		most = d->u[U_GRAIN_RADIUS].real[0][i] > most ? d->u[U_GRAIN_RADIUS].real[0][i] : most;
	e->seed = s->host->memory(s->run, MOST_SEEDS * sizeof(quern_spot));
	if (!e->seed ||
		quern_placer_init(&e->placer, s->dim, s->lower, s->upper, s->periodic, most) != QUERN_OK ||
		!quern_placer_bodies(&e->placer, s, SLOT_BODIES, false))
		return false;
	for (uint32_t i = 0; i < d->n_grains; i++) {
		quern_spot spot = { .radius = d->u[U_GRAIN_RADIUS].real[0][i] };
		if (d->drop_grain[i]) continue;
		for (uint32_t k = 0; k < s->dim; k++) spot.x[k] = d->u[U_GRAIN_POSITION].real[k][i];
		quern_placer_add(&e->placer, &spot);
	}
	return !e->placer.failed;
}

quern_status quern_hybrid_grains(update *d) {
	enriching e = { .d = d, .draws = (uint64_t)d->u[U_DRAWS].index[0] };
	bool any = false;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		e.c = c;
		e.rest = d->u[U_GRAIN_OWED].real[0][c];
		any = any || (d->zone[c] == QUERN_HYBRID && is_owed(&e));
	}
	if (!any) return QUERN_OK;
	d->failed = d->failed || !place_obstacles(&e);
	for (uint32_t c = 0; c < d->n_cells && !d->failed; c++)
		if (d->zone[c] == QUERN_HYBRID) enrich_cell(&e, c);
	d->u[U_DRAWS].index[0] = (int32_t)e.draws;
	quern_placer_finish(&e.placer);
	return d->failed ? QUERN_E_MEMORY : QUERN_OK;
}

/* ---- the set itself ---- */

quern_status quern_hybrid_apply_grains(update *d) {
	const quern_step *s = d->s;
	uint32_t kept = 0;
	int32_t *from = s->host->memory(s->run, ((size_t)d->n_grains + d->n_new_grains + 1) * sizeof(int32_t));
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < d->n_grains; i++)
		if (!d->drop_grain[i]) from[kept++] = (int32_t)i;
	if (kept == d->n_grains && !d->n_new_grains) return QUERN_OK;
	for (uint32_t i = 0; i < d->n_new_grains; i++) from[kept + i] = -1;
	const quern_status status = s->host->remap(s->run, "grain", kept + d->n_new_grains, from, 0, NULL);
	if (status != QUERN_OK) return status;
	const quern_column *u = d->u;
	for (uint32_t i = 0; i < d->n_new_grains; i++) {
		const new_grain *g = &d->grains[i];
		const uint32_t to = kept + i;
		for (uint32_t k = 0; k < s->dim; k++) {
			u[U_GRAIN_POSITION].real[k][to] = g->position[k];
			u[U_GRAIN_VELOCITY].real[k][to] = g->velocity[k];
		}
		for (uint32_t k = 0; u[U_GRAIN_SPIN].real[0] && k < (s->dim == 3 ? 3u : 1u); k++)
			u[U_GRAIN_SPIN].real[k][to] = g->spin[k];
		u[U_GRAIN_RADIUS].real[0][to] = g->radius;
		u[U_GRAIN_MASS].real[0][to] = mass_of(d->h, g->radius);
		u[U_GRAIN_WEIGHT].real[0][to] = g->weight;
	}
	u[U_DISPLACEMENT].real[0][0] = INFINITY; /* the list names grains that are gone, and misses new ones */
	return QUERN_OK;
}
