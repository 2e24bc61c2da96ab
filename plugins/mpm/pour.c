/* SPDX-License-Identifier: MIT */
/* pour - sources of points: what is due goes to free places of a lattice. docs/theory/flow.md, section 3 */
#include "../common/placer.h"
#include "../common/sort.h"
#include "../common/stressed.h"
#include "lattice.h"
#include <math.h>

typedef struct {
	const mpm *p;
	const quern_step *s;
	const source *item;
	region region;
	uint32_t i; /* number of the source */
	lattice lattice;
	quern_real mass, radius; /* kg of one point; m, a little less than half the way between places */
	placer placer;           /* what is near the region: points as grains that do not overlap */
	int32_t *way;            /* in which order places are tried; then those that were taken */
	uint32_t n;              /* of these */
} pouring;

static void begin(pouring *w, uint32_t i) {
	const uint32_t dim = w->s->dim;
	quern_real least = INFINITY;
	w->i = i, w->n = 0;
	w->item = quern_source_at(&w->p->source, i);
	w->region = quern_region_of(w->s, &w->s->slot[SLOT_SOURCE_REGION][i], w->item->lower, w->item->upper);
	w->lattice = lattice_of(w->p, w->item->lower, w->item->upper);
	w->mass = w->p->density * lattice_volume(&w->lattice, dim);
	for (uint32_t k = 0; k < dim; k++) least = fmin(least, w->lattice.spacing[k]);
	w->radius = 0.4995 * least; /* round-off must not keep neighbours apart */
}

/* Whether a point is in the way of a place in the region. */
static bool is_near(const pouring *w, const quern_real x[3]) {
	const quern_step *s = w->s;
	for (uint32_t k = 0; k < s->dim; k++) {
		const quern_real half = 0.5 * (w->item->upper[k] - w->item->lower[k]),
						 middle = w->item->lower[k] + half;
		const quern_real length = s->periodic[k] ? s->upper[k] - s->lower[k] : 0;
		if (fabs(quern_image_far(x[k] - middle, length)) > half + 2 * w->radius) return false;
	}
	return true;
}

static bool gather_near(pouring *w) {
	const quern_step *s = w->s;
	if (quern_placer_init(&w->placer, s->dim, s->lower, s->upper, s->periodic, w->radius) != QUERN_OK ||
		!quern_placer_bodies(&w->placer, s, SLOT_BODIES, true))
		return false;
	for (uint32_t i = 0; i < s->host->set(s->run, "point").n; i++) {
		quern_spot spot = { .radius = w->radius };
		for (uint32_t k = 0; k < s->dim; k++) spot.x[k] = s->use[POUR_POSITION].real[k][i];
		if (is_near(w, spot.x)) quern_placer_add(&w->placer, &spot);
	}
	return !w->placer.failed;
}

/* An order that is drawn anew each time, so that no corner of the region is filled first. */
static bool draw_way(pouring *w) {
	const quern_step *s = w->s;
	const uint32_t n = w->lattice.n;
	uint64_t *key = s->host->memory(s->run, ((size_t)n + 1) * sizeof *key);
	void *work = s->host->memory(s->run, quern_sort_bytes(n));
	w->way = s->host->memory(s->run, ((size_t)n + 1) * sizeof *w->way);
	if (!key || !work || !w->way) return false;
	for (uint32_t k = 0; k < n; k++) {
		quern_real u[2];
		s->host->random(w->p->stream + STREAM_SOURCES, (uint64_t)w->i << 32 | k, (uint64_t)s->step, u);
		key[k] = (uint64_t)(u[0] * 0x1p32);
	}
	quern_sort_order(n, key, NULL, w->way, work);
	return true;
}

/* Takes places while a whole point is due; returns what is still due. */
static quern_real take_places(pouring *w, quern_real rest) {
	for (uint32_t q = 0; q < w->lattice.n && rest >= w->mass && !w->placer.failed; q++) {
		quern_spot spot = { .radius = w->radius };
		lattice_place(&w->lattice, w->item->lower, (uint32_t)w->way[q], w->s->dim, spot.x);
		if (!quern_region_holds(&w->region, spot.x) || !quern_placer_free(&w->placer, &spot)) continue;
		quern_placer_add(&w->placer, &spot);
		w->way[w->n++] = w->way[q];
		rest -= w->mass;
	}
	return rest;
}

static void write_points(const pouring *w, uint32_t old) {
	const quern_step *s = w->s;
	const quern_column *u = s->use;
	for (uint32_t q = 0; q < w->n; q++) {
		quern_real x[3];
		booking b = { .mass = w->mass, .count = 1 };
		lattice_place(&w->lattice, w->item->lower, (uint32_t)w->way[q], s->dim, x);
		for (uint32_t k = 0; k < s->dim; k++) {
			const quern_real v = w->item->velocity[k];
			u[POUR_POSITION].real[k][old + q] = x[k];
			u[POUR_VELOCITY].real[k][old + q] = v;
			b.momentum[k] = w->mass * v;
			b.energy += 0.5 * w->mass * v * v;
			b.potential -= w->mass * s->gravity[k] * x[k];
		}
		u[POUR_POINT_MASS].real[0][old + q] = w->mass;
		u[POUR_VOLUME].real[0][old + q] = w->mass / w->p->density;
		book_add(&u[POURED_MASS], w->i, s->dim, &b);
	}
	/* without stress no energy is stored, and the gathering says in every step what is */
	const stressed_points points = {
		.mass = u[POUR_POINT_MASS], .volume = u[POUR_VOLUME], .stress = u[POUR_STRESS]
	};
	quern_stressed_assign(&points, &s->slot[SLOT_MATERIAL][0], s->dim, old, w->n);
}

static quern_status add_points(const pouring *w) {
	const quern_step *s = w->s;
	uint32_t old;
	const quern_status status = quern_source_room(s, "point", "points", w->n, &old);
	if (status != QUERN_OK) return status;
	write_points(w, old);
	s->use[POUR_UNSORTED].index[0] = 1;
	return QUERN_OK;
}

static quern_status pour_one(pouring *w) {
	const quern_step *s = w->s;
	quern_real rest =
		quern_source_due(w->item, s->time, w->i, &s->use[POUR_DUE]) - s->use[POURED_MASS].real[0][w->i];
	if (rest >= w->mass) {
		const bool good = draw_way(w) && gather_near(w);
		if (good) rest = take_places(w, rest);
		const bool failed = !good || w->placer.failed;
		quern_placer_finish(&w->placer);
		if (failed) return QUERN_E_MEMORY;
	}
	quern_source_note(s, w->i, "continuum", w->item, rest >= w->mass ? rest : 0, &s->use[POUR_WAITING]);
	const quern_status status = w->n ? add_points(w) : QUERN_OK;
	quern_source_even(w->item, w->i, &s->use[POUR_DUE], &s->use[POURED_MASS]);
	return status;
}

/* In a hybrid grains are poured, and its oracle decides what becomes of them. */
quern_status quern_mpm_pour(const void *self, const quern_step *s) {
	pouring w = { .p = self, .s = s };
	/* as many as the scene itself has, whatever one of its stages says */
	const uint32_t n = s->host->set(s->run, "point_source").n;
	quern_status status = QUERN_OK;
	for (uint32_t i = 0; i < w.p->source.n && i < n && status == QUERN_OK; i++) {
		begin(&w, i);
		if (quern_source_acts(w.item, s)) status = pour_one(&w);
	}
	return status;
}
