/* SPDX-License-Identifier: MIT */
/* fill - the first points: a lattice in each region, with the stress of the overburden if wished */
#include "../common/height.h"
#include "../common/outlets.h"
#include "../common/stressed.h"
#include "lattice.h"
#include <math.h>
#include <stdio.h>

/* An item with the places of its lattice: which of them lie in the region, and how many of these lie above each. */
typedef struct {
	const mpm_fill *item;
	lattice lattice;
	bool *in;
	uint32_t *over; /* only where there shall be stress */
	uint32_t n;     /* points */
} filling;

/* m of material above a place. Where all places above it are filled that is the way to the end of the region's box. */
static quern_real depth_of(
	const filling *f, uint32_t i, uint32_t axis, quern_real gravity, const quern_real x[3]) {
	const lattice *l = &f->lattice;
	const uint32_t at[3] = { i % l->count[0], i / l->count[0] % l->count[1],
		i / (l->count[0] * l->count[1]) };
	const uint32_t levels = gravity < 0 ? l->count[axis] - 1 - at[axis] : at[axis];
	if (f->over[i] < levels) return (f->over[i] + 0.5) * l->spacing[axis];
	return gravity < 0 ? f->item->upper[axis] - x[axis] : x[axis] - f->item->lower[axis];
}

/* That of a layer that goes on sideways: what lies on a place weighs on it along all axes, and pushes across the steepest one
 * by `lateral` of that. */
static void weigh(const mpm *p, const quern_step *s, const filling *f, uint32_t place, const quern_real x[3],
	const quern_column *stress, uint32_t i) {
	static const uint32_t shear[3][3] = { { 0, 3, 5 }, { 3, 1, 4 }, { 5, 4, 2 } };
	const uint32_t axis = quern_vertical(s->dim, s->gravity);
	const quern_real g = s->gravity[axis], depth = depth_of(f, place, axis, g, x);
	const quern_real pressure = p->density * fabs(g) * depth;
	for (uint32_t k = 0; k < p->dim; k++) {
		stress->real[k][i] = -pressure * (k == axis ? 1 : f->item->lateral);
		if (k == axis || s->gravity[k] == 0) continue;
		stress->real[p->dim == 2 ? 2 : shear[axis][k]][i] =
			p->density * s->gravity[k] * (g < 0 ? depth : -depth);
	}
}

/* Against gravity, from the end on. */
static void count_over(const quern_step *s, filling *f) {
	const uint32_t axis = quern_vertical(s->dim, s->gravity), *count = f->lattice.count;
	const uint32_t stride = axis == 0 ? 1 : axis == 1 ? count[0] : count[0] * count[1];
	const bool up = s->gravity[axis] < 0;
	for (uint32_t k = 0; k < f->lattice.n; k++) {
		const uint32_t i = up ? f->lattice.n - 1 - k : k, at = i / stride % count[axis];
		const uint32_t next = up ? i + stride : i - stride;
		f->over[i] = at == (up ? count[axis] - 1 : 0) ? 0 : f->over[next] + f->in[next];
	}
}

/* A place of the lattice is filled if it lies in the region. */
static quern_status find_places(
	const mpm *p, const quern_step *s, uint32_t i, const body_pose *pose, filling *f) {
	const mpm_fill *item = (const mpm_fill *)p->fill.items + i;
	region where = quern_region_of(s, &s->slot[SLOT_REGION][i], item->lower, item->upper);
	const bool stressed = item->stress == STRESS_AT_REST;
	char param[40];
	quern_region_put_above(&where, s, &item->above, SLOT_BODIES, pose);
	*f = (filling) { .item = item, .lattice = lattice_of(p, item->lower, item->upper) };
	f->in = s->host->memory(s->run, (size_t)f->lattice.n + 1);
	f->over = stressed ? s->host->memory(s->run, ((size_t)f->lattice.n + 1) * sizeof *f->over) : NULL;
	if (!f->in || (stressed && !f->over)) return QUERN_E_MEMORY;
	for (uint32_t k = 0; k < f->lattice.n; k++) {
		quern_real x[3] = { 0 };
		lattice_place(&f->lattice, item->lower, k, p->dim, x);
		f->in[k] = quern_region_holds(&where, x);
		f->n += f->in[k];
	}
	if (stressed) count_over(s, f);
	if (f->n) return QUERN_OK;
	snprintf(param, sizeof param, "fill.%u.region", i);
	return s->host->stop(s->run, QUERN_E_PARAM, param, -1,
		"no point lies in the region%s: is it thinner than the points are apart, %.2g m?",
		item->above.n ? " and above that body" : "", p->cell / p->points);
}

/* By numbers that belong to the place. */
static void move_off(const mpm *p, const quern_step *s, const filling *f, uint32_t place, quern_real x[3]) {
	const quern_real most = 0.5 * f->item->jitter;
	const uint64_t key = (uint64_t)(f->item - (const mpm_fill *)p->fill.items) << 32 | place;
	quern_real u[4];
	for (uint64_t pair = 0; pair < 2; pair++)
		s->host->random(p->stream + STREAM_FILLS, key, pair, u + 2 * pair);
	for (uint32_t k = 0; k < p->dim; k++) x[k] += most * (2 * u[k] - 1) * f->lattice.spacing[k];
}

static void place(const mpm *p, const quern_step *s, const filling *f, uint32_t i) {
	const quern_column *u = s->use;
	const quern_real volume = lattice_volume(&f->lattice, p->dim);
	for (uint32_t q = 0; q < f->lattice.n; q++) {
		quern_real x[3] = { 0 };
		if (!f->in[q]) continue;
		lattice_place(&f->lattice, f->item->lower, q, p->dim, x);
		if (f->item->jitter > 0) move_off(p, s, f, q, x);
		for (uint32_t k = 0; k < p->dim; k++) {
			u[FILL_POSITION].real[k][i] = x[k];
			u[FILL_VELOCITY].real[k][i] = f->item->velocity[k];
		}
		u[FILL_MASS].real[0][i] = p->density * volume;
		u[FILL_VOLUME].real[0][i] = volume;
		if (f->item->stress == STRESS_AT_REST) weigh(p, s, f, q, x, &u[FILL_STRESS], i);
		i++;
	}
}

/* ---- what bodies leave of it ---- */

enum { CHUNK = 64 };

typedef struct {
	_Alignas(64) quern_real position[3][CHUNK], radius[CHUNK], gap[CHUNK], normal[3][CHUNK],
		velocity[3][CHUNK];
} near_points;

/* Marks the points that lie in a body; returns how many were not marked before. */
static uint32_t mark_inside(
	const quern_step *s, const quern_bound *body, const body_pose *pose, uint32_t n, bool *inside) {
	near_points w;
	uint32_t found = 0;
	for (uint32_t q = 0; q < CHUNK; q++) w.radius[q] = ((const body_item *)body->item)->displacement;
	for (uint32_t i = 0; i < n; i += CHUNK) {
		const uint32_t m = n - i < CHUNK ? n - i : CHUNK;
		quern_body_batch batch = {
			.n = m, .cap = CHUNK, .dim = s->dim, .pose = &pose->pose, .radius = w.radius, .gap = w.gap
		};
		for (uint32_t k = 0; k < s->dim; k++) {
			for (uint32_t q = 0; q < m; q++)
				w.position[k][q] = quern_motion_bring(pose, k, s->use[FILL_POSITION].real[k][i + q]);
			batch.position[k] = w.position[k];
			batch.normal[k] = w.normal[k];
			batch.velocity[k] = w.velocity[k];
		}
		((const quern_body_ops *)body->ops)->closest(body->self, &batch);
		for (uint32_t q = 0; q < m; q++) {
			if (inside[i + q] || !(w.gap[q] < 0)) continue;
			inside[i + q] = true;
			found++;
		}
	}
	return found;
}

/* A fill may reach into bodies: what lies in one that acts on the continuum after the release is left out, and said. */
static quern_status clip(const quern_step *s, uint32_t *n) {
	bool *inside = s->host->memory(s->run, (size_t)*n + 1);
	int32_t *from = s->host->memory(s->run, ((size_t)*n + 1) * sizeof(int32_t));
	uint32_t kept = 0;
	const body_pose *pose = quern_body_poses_now(s, SLOT_BODIES);
	if (!inside || !from || !pose) return QUERN_E_MEMORY;
	for (uint32_t b = 0; b < s->n_slot[SLOT_BODIES]; b++) {
		const quern_bound *body = &s->slot[SLOT_BODIES][b];
		if (!quern_body_meets_points(body, false)) continue;
		const uint32_t found = mark_inside(s, body, &pose[b], *n, inside);
		char which[BODY_WORDS];
		quern_body_say(body, b, which);
		if (found == *n)
			return s->host->stop(s->run, QUERN_E_PARAM, "fill", -1, "lies in %s, with all its points", which);
		if (found)
			s->host->log(
				s->run, 2, "%u of %u points of continuum.fill lie in %s, and are left out", found, *n, which);
	}
	for (uint32_t i = 0; i < *n; i++)
		if (!inside[i]) from[kept++] = (int32_t)i;
	if (kept == *n) return QUERN_OK;
	*n = kept;
	if (!kept) return s->host->stop(s->run, QUERN_E_PARAM, "fill", -1, "lies in bodies with all its points");
	return s->host->remap(s->run, "point", kept, from, 0, NULL);
}

/* ---- the stage ---- */

static quern_status check_count(const mpm *p, const quern_step *s) {
	const mpm_fill *item = p->fill.items;
	quern_real wanted = 0;
	for (uint32_t f = 0; f < p->fill.n && wanted <= MOST_POINTS; f++)
		wanted += lattice_of(p, item[f].lower, item[f].upper).wanted;
	if (wanted > MOST_POINTS)
		return s->host->stop(s->run, QUERN_E_PARAM, "fill", -1,
			"asks for about %.2g points, more than %d: make cells larger", wanted, MOST_POINTS);
	if (p->fill.n || p->source.n) return QUERN_OK;
	return s->host->stop(s->run, QUERN_E_PARAM, NULL, -1, "no points: give fill, from or source");
}

static quern_status place_all(const mpm *p, const quern_step *s, uint32_t *total) {
	filling *all = s->host->memory(s->run, ((size_t)p->fill.n + 1) * sizeof *all);
	const body_pose *pose = quern_body_poses_now(s, SLOT_BODIES);
	if (!all || !pose) return QUERN_E_MEMORY;
	quern_status status = check_count(p, s);
	for (uint32_t f = 0; f < p->fill.n && status == QUERN_OK; f++) {
		status = find_places(p, s, f, pose, &all[f]);
		*total += all[f].n;
	}
	if (status != QUERN_OK) return status;
	int32_t *from = s->host->memory(s->run, ((size_t)*total + 1) * sizeof(int32_t));
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < *total; i++) from[i] = -1;
	status = s->host->remap(s->run, "point", *total, from, 0, NULL);
	for (uint32_t f = 0, first = 0; f < p->fill.n && status == QUERN_OK; first += all[f++].n)
		place(p, s, &all[f], first);
	return status == QUERN_OK && *total ? clip(s, total) : status;
}

static quern_status open_books(const mpm *p, const quern_step *s) {
	const quern_status status = p->outlets ? book_open(s, "point_face", outlet_faces(s)) : QUERN_OK;
	return status == QUERN_OK && p->sources ? book_open(s, "point_source", p->source.n) : status;
}

/* A hybrid starts from all grains: its oracle decides where points go. */
quern_status quern_mpm_fill(const void *self, const quern_step *s) {
	const mpm *p = self;
	uint32_t total = 0;
	s->use[FILL_UNSORTED].index[0] = 1;
	if (p->rasterise == RASTERISE_PLAIN && s->use[FILL_AFFINE].real[0])
		return s->host->stop(s->run, QUERN_E_PARAM, "rasterise", -1,
			"is plain, and the hybrid's coupling compares velocities at one place, for which points must "
			"send their gradient: take affine, or hybrid.coupling: lumped");
	quern_status status = open_books(p, s);
	if (s->host->has(s->run, "hybrid") || status != QUERN_OK) return status;
	if (p->from) return quern_mpm_begin(p, s, s->host->set(s->run, "point").n);
	status = place_all(p, s, &total);
	if (status != QUERN_OK) return status;
	s->host->log(s->run, 0, "%u points placed", total);
	const quern_column *u = s->use;
	const stressed_points points = {
		.mass = u[FILL_MASS], .volume = u[FILL_VOLUME], .stress = u[FILL_STRESS], .energy = u[FILL_ENERGY]
	};
	quern_stressed_assign(&points, &s->slot[SLOT_MATERIAL][0], s->dim, 0, total);
	return QUERN_OK;
}
