/* SPDX-License-Identifier: MIT */
/* tangent - places that touch two grains, in 3-D three; a wall counts as one. docs/theory/packers.md, section 3 */
#pragma once
#include "queue.h"

/* ==== two grains: a pair of places in the plane, a ring in space ==== */

typedef struct {
	quern_vec middle, axis; /* axis: from the seed to the partner, not of unit length */
	quern_real height2;     /* m^2, from the axis to the places that touch both, squared */
	quern_real length2;     /* m^2, of the axis */
} saddle;

static inline saddle between(const packing *p, const grain *partner) {
	const quern_vec axis = quern_vec_sub(partner->at, p->seed.at);
	const quern_real a = touching(p, &p->seed), b = touching(p, partner), d2 = quern_vec_dot(axis, axis, 3);
	const quern_real along = 0.5 * (1 + (a * a - b * b) / d2);
	return (saddle) { quern_vec_axpy(along, axis, p->seed.at), axis, a * a - along * along * d2, d2 };
}

static inline bool offer_pair(packing *p, const grain *partner) {
	const saddle s = between(p, partner);
	if (!(s.height2 > 0)) return false;
	const quern_real side = __builtin_sqrt(s.height2 / s.length2);
	const quern_vec across = { -s.axis.y, s.axis.x, 0 };
	return offer(p, quern_vec_axpy(side, across, s.middle)) ||
		   offer(p, quern_vec_axpy(-side, across, s.middle));
}

/* ==== rings: the places that touch the seed in the plane, the seed and a partner in space ==== */

typedef struct {
	quern_vec middle, u, v; /* m; u, v: orthogonal, as long as the ring is wide */
} ring;

static inline ring around_seed(const packing *p) {
	const quern_real r = touching(p, &p->seed);
	return (ring) { p->seed.at, { r, 0, 0 }, { 0, r, 0 } };
}

/* Crossed with the coordinate axis that is farthest from it, the saddle's own axis gives a product that cannot
 * vanish. */
static inline ring around_saddle(const saddle *s) {
	const quern_real x = quern_abs(s->axis.x), y = quern_abs(s->axis.y), z = quern_abs(s->axis.z);
	const bool x_least = x <= y && x <= z, y_least = !x_least && y <= z;
	const quern_vec pole = { x_least ? 1 : 0, y_least ? 1 : 0, x_least || y_least ? 0 : 1 };
	const quern_vec u = quern_vec_cross(s->axis, pole), v = quern_vec_cross(s->axis, u);
	const quern_real scale = __builtin_sqrt(s->height2 / quern_vec_dot(u, u, 3));
	return (ring) { s->middle, quern_vec_scale(scale, u),
		quern_vec_scale(scale / __builtin_sqrt(s->length2), v) };
}

static inline quern_vec on_ring(const ring *r, quern_real angle) {
	return quern_vec_axpy(quern_cos(angle), r->u, quern_vec_axpy(quern_sin(angle), r->v, r->middle));
}

static inline bool sweep_ring(packing *p, const ring *r) {
	const quern_real start = random_angle(p), step = 6.283185307179586 / p->angles;
	for (int32_t i = 0; i < p->angles; i++)
		if (offer(p, on_ring(r, start + i * step))) return true;
	return false;
}

/* The wall's surface is known to the job alone, which says yes or no. */
static inline quern_vec bisect(packing *p, const ring *r, quern_real open, quern_real walled) {
	for (int k = 0; k < 40; k++) {
		const quern_real middle = 0.5 * (open + walled);
		if (probe(p, on_ring(r, middle)) == OPEN) open = middle;
		else walled = middle;
	}
	return on_ring(r, open);
}

/* A wall counts as one more grain to touch. */
static inline bool lean_on_wall(packing *p, const ring *r) {
	const quern_real start = random_angle(p), step = 6.283185307179586 / p->angles;
	quern_real before = start;
	standing was = probe(p, on_ring(r, before));
	for (int32_t i = 1; i <= p->angles; i++) {
		const quern_real angle = start + i * step;
		const standing is = probe(p, on_ring(r, angle));
		if (was == OPEN && is == WALLED && offer(p, bisect(p, r, before, angle))) return true;
		if (was == WALLED && is == OPEN && offer(p, bisect(p, r, angle, before))) return true;
		before = angle;
		was = is;
	}
	return false;
}

/* ==== no partner: the sphere around the seed ==== */

/* Steps of equal height turned by the golden angle cover a sphere evenly. */
static inline bool sweep_sphere(packing *p) {
	const quern_real start = random_angle(p);
	for (int32_t i = 0; i < p->angles; i++) {
		const quern_real angle = start + i * 2.399963229728653;
		const quern_real z = 1 - (2 * i + 1) / (quern_real)p->angles, across = __builtin_sqrt(1 - z * z);
		const quern_vec out = { across * quern_cos(angle), across * quern_sin(angle), z };
		if (offer(p, quern_vec_axpy(touching(p, &p->seed), out, p->seed.at))) return true;
	}
	return false;
}

/* ==== three grains: trilateration ==== */

/* x = seed + s u + t v + w u x v with u, v the ways to partner and third: the distances fix x.u and x.v, hence s and
 * t, and what is then left of the distance to the seed is w. */
static inline bool offer_corners(packing *p, const grain *partner, const grain *third) {
	const quern_vec u = quern_vec_sub(partner->at, p->seed.at), v = quern_vec_sub(third->at, p->seed.at);
	const quern_vec normal = quern_vec_cross(u, v);
	const quern_real uu = quern_vec_dot(u, u, 3), uv = quern_vec_dot(u, v, 3), vv = quern_vec_dot(v, v, 3);
	const quern_real nn = quern_vec_dot(normal, normal, 3);
	if (!(nn > 0)) return false;
	const quern_real a = touching(p, &p->seed), b = touching(p, partner), c = touching(p, third);
	const quern_real on_u = 0.5 * (a * a - b * b + uu), on_v = 0.5 * (a * a - c * c + vv);
	const quern_real s = (on_u * vv - on_v * uv) / nn, t = (on_v * uu - on_u * uv) / nn;
	const quern_real w2 = (a * a - (s * on_u + t * on_v)) / nn;
	if (!(w2 > 0)) return false;
	const quern_real w = __builtin_sqrt(w2);
	const quern_vec foot = quern_vec_axpy(s, u, quern_vec_axpy(t, v, p->seed.at));
	return offer(p, quern_vec_axpy(w, normal, foot)) || offer(p, quern_vec_axpy(-w, normal, foot));
}

/* ==== the walk ==== */

static inline bool add_beside_2d(packing *p) {
	const ring around = around_seed(p);
	for (uint32_t k = 0; k < p->n_near; k++)
		if (offer_pair(p, &p->near[k])) return true;
	if (!p->n_near) return sweep_ring(p, &around);
	return p->walled && lean_on_wall(p, &around);
}

static inline bool sweep_rings(packing *p, bool (*sweep)(packing *, const ring *)) {
	for (uint32_t k = 0; k < p->n_near; k++) {
		const saddle s = between(p, &p->near[k]);
		if (!(s.height2 > 0)) continue;
		const ring around = around_saddle(&s);
		if (sweep(p, &around)) return true;
	}
	return false;
}

static inline bool add_beside_3d(packing *p) {
	bool cornered = false;
	if (!p->n_near) return sweep_sphere(p);
	for (uint32_t k = 0; k < p->n_near; k++)
		for (uint32_t m = k + 1; m < p->n_near; m++) {
			if (!in_reach(p, &p->near[k], &p->near[m])) continue;
			cornered = true;
			if (offer_corners(p, &p->near[k], &p->near[m])) return true;
		}
	if (!cornered) return sweep_rings(p, sweep_ring);
	return p->walled && sweep_rings(p, lean_on_wall);
}

/* A seed is done when the grain that waits fits nowhere beside it. The neighbours are gathered anew for every grain,
 * since the one just placed is among them and the next one has another radius. */
static inline void walk(packing *p, uint32_t from, bool (*add_beside)(packing *)) {
	for (uint32_t i = from; i < queued(p) && !p->stopped; i++)
		while (!p->stopped && gather(p, i) && add_beside(p)) continue;
}

/* Grows the region from all grains around it; from a dart only if it would stay empty. */
static inline void pack_tangent(packing *p) {
	bool (*add_beside)(packing *) = p->job->dim == 2 ? add_beside_2d : add_beside_3d;
	walk(p, 0, add_beside);
	if (!empty(p)) return;
	p->n_near = 0;
	throw_darts(p);
	walk(p, p->job->n_seed, add_beside);
}
