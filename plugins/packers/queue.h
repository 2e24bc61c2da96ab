/* SPDX-License-Identifier: MIT */
/* queue - the grains of a region that is being packed: those around it at the start, then those placed, one after the other; and whether
 * the one that waits fits beside them. docs/theory/packers.md, section 3 */
#pragma once
#include <quern/math.h>
#include <quern/packer.h>
#include <quern/vec.h>

/* What fits on a worker's stack. A region that would take more grains is filled that far; neighbours beyond NEAR
 * are no partners, and overlaps with them are found by the job alone. */
enum { PLACED = 2048, NEAR = 256 };

typedef struct {
	quern_vec at;
	quern_real radius;
} grain;

typedef struct {
	quern_pack_job *job;
	int32_t trials, angles; /* darts for a first grain; places around one that has too few neighbours */
	quern_real part;        /* of its radius that a grain is placed with */
	quern_real radius;      /* m, of the grain that waits, times that */
	bool stopped, walled;   /* walled: a wall or body refused a place beside the seed */
	grain seed;
	uint32_t n_placed, n_near;
	grain near[NEAR]; /* every grain that one touching the seed may touch too */
	grain placed[PLACED];
} packing;

/* ==== the queue: the job's seeds, then what was placed ==== */

static inline uint32_t queued(const packing *p) { return p->job->n_seed + p->n_placed; }

static inline grain in_queue(const packing *p, uint32_t i) {
	if (i >= p->job->n_seed) return p->placed[i - p->job->n_seed];
	const quern_spot *s = &p->job->seed[i];
	return (grain) { { s->x[0], s->x[1], p->job->dim == 3 ? s->x[2] : 0 }, s->radius };
}

static inline quern_real distance2(quern_vec a, quern_vec b) {
	const quern_vec d = quern_vec_sub(a, b);
	return quern_vec_dot(d, d, 3);
}

/* How far x lies outside an interval. */
static inline quern_real beyond(quern_real x, quern_real lower, quern_real upper) {
	return quern_max(quern_max(lower - x, x - upper), 0);
}

static inline bool reaches_region(const packing *p, const grain *g) {
	const quern_real *lower = p->job->lower, *upper = p->job->upper, reach = g->radius + p->radius;
	const quern_vec gap = { beyond(g->at.x, lower[0], upper[0]), beyond(g->at.y, lower[1], upper[1]),
		p->job->dim == 3 ? beyond(g->at.z, lower[2], upper[2]) : 0 };
	return quern_vec_dot(gap, gap, 3) <= reach * reach;
}

/* Can one grain touch both? */
static inline bool in_reach(const packing *p, const grain *a, const grain *b) {
	const quern_real reach = a->radius + b->radius + 2 * p->radius;
	return distance2(a->at, b->at) < reach * reach;
}

static inline bool gather(packing *p, uint32_t i) {
	const uint32_t n = queued(p);
	p->seed = in_queue(p, i);
	p->n_near = 0;
	p->walled = false;
	if (!reaches_region(p, &p->seed)) return false;
	for (uint32_t k = 0; k < n && p->n_near < NEAR; k++) {
		const grain g = in_queue(p, k);
		if (k != i && in_reach(p, &p->seed, &g) && reaches_region(p, &g)) p->near[p->n_near++] = g;
	}
	return true;
}

/* ==== one place for the grain that waits ==== */

static inline bool in_box(const packing *p, const quern_real x[3]) {
	for (uint32_t k = 0; k < p->job->dim; k++)
		if (!(x[k] >= p->job->lower[k] && x[k] <= p->job->upper[k])) return false;
	return true;
}

/* The job's own test knows all grains and bodies and costs accordingly; most places fail already here. */
static inline bool clear_of_near(const packing *p, quern_vec at) {
	for (uint32_t k = 0; k < p->n_near; k++) {
		const quern_real reach = p->near[k].radius + p->radius - 1e-9 * p->radius;
		if (distance2(p->near[k].at, at) < reach * reach) return false;
	}
	return true;
}

typedef enum { TAKEN, WALLED, OPEN } standing;

/* WALLED: grains would let it in, but the job does not, so that a wall or body must be there. */
static inline standing probe(packing *p, quern_vec at) {
	const quern_pack_job *job = p->job;
	const quern_spot spot = { .x = { at.x, at.y, at.z }, .radius = p->radius };
	if (!in_box(p, spot.x) || !clear_of_near(p, at) || !job->inside(job, spot.x)) return TAKEN;
	if (job->free(job, &spot)) return OPEN;
	p->walled = true;
	return WALLED;
}

/* True if the grain that waited was placed there; then another one waits, and `near` is out of date. */
static inline bool offer(packing *p, quern_vec at) {
	quern_pack_job *job = p->job;
	const quern_spot spot = { .x = { at.x, at.y, at.z }, .radius = p->radius };
	if (probe(p, at) != OPEN) return false;
	p->placed[p->n_placed++] = (grain) { at, p->radius };
	p->stopped = !job->place(job, &spot) || p->n_placed == PLACED;
	if (!p->stopped) p->radius = p->part * job->radius(job);
	return true;
}

/* From a grain's centre to that of one touching it, longer by so much that rounding never makes it an overlap. */
static inline quern_real touching(const packing *p, const grain *g) {
	return (g->radius + p->radius) * (1 + 1e-12);
}

static inline quern_real random_angle(const packing *p) {
	quern_real u[2];
	p->job->host->random(p->job->stream, p->job->key, p->job->counter++, u);
	return 6.283185307179586 * u[0];
}

/* ==== the first grain ==== */

static inline bool empty(const packing *p) {
	for (uint32_t i = 0; i < p->job->n_seed; i++)
		if (in_box(p, p->job->seed[i].x)) return false;
	return !p->n_placed;
}

static inline void throw_darts(packing *p) {
	quern_pack_job *job = p->job;
	for (int32_t t = 0; t < p->trials; t++) {
		quern_real u[4] = { 0 }, x[3] = { 0 };
		job->host->random(job->stream, job->key, job->counter++, u);
		if (job->dim == 3) job->host->random(job->stream, job->key, job->counter++, u + 2);
		for (uint32_t k = 0; k < job->dim; k++) x[k] = job->lower[k] + u[k] * (job->upper[k] - job->lower[k]);
		if (offer(p, (quern_vec) { x[0], x[1], x[2] })) return;
	}
}

/* Not cleared: it is large, and only what is counted is read. */
static inline void begin(packing *p, quern_pack_job *job, int32_t trials, int32_t angles) {
	p->job = job;
	p->trials = trials;
	p->angles = angles;
	p->part = 1;
	p->radius = job->radius(job);
	p->stopped = p->walled = false;
	p->n_placed = p->n_near = 0;
}
