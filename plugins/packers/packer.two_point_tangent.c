/* SPDX-License-Identifier: MIT */
/* packer.two_point_tangent - grains that touch two others, in 3-D three; a wall counts as one.
 * docs/theory/packers.md, section 3 */
#include <quern/math.h>
#include <quern/packer.h>
#include <quern/vec.h>

typedef struct {
	int32_t trials, angles;
} two_point_tangent;

static const quern_param params[] = { QUERN_PARAM(two_point_tangent, trials, "1",
										  "Darts for the first grain of a region that would stay empty.",
										  .def = 20, .min = 1, .max = 100000),
	QUERN_PARAM(two_point_tangent, angles, "1", "Places tried around a grain that has too few neighbours.",
		.def = 36, .min = 3, .max = 100000),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* What fits on a worker's stack. A region that would take more grains is filled that far; neighbours beyond NEAR
 * are no partners, and overlaps with them are found by the job alone. */
enum { PLACED = 2048, NEAR = 256 };

typedef struct {
	quern_vec at;
	quern_real radius;
} grain;

typedef struct {
	const two_point_tangent *self;
	quern_pack_job *job;
	quern_real radius;    /* m, of the grain that waits */
	bool stopped, walled; /* walled: a wall or body refused a place beside the seed */
	grain seed;
	uint32_t n_placed, n_near;
	grain near[NEAR]; /* every grain that one touching the seed may touch too */
	grain placed[PLACED];
} packing;

/* ==== the queue: the job's seeds, then what was placed ==== */

static uint32_t queued(const packing *p) { return p->job->n_seed + p->n_placed; }

static grain in_queue(const packing *p, uint32_t i) {
	if (i >= p->job->n_seed) return p->placed[i - p->job->n_seed];
	const quern_spot *s = &p->job->seed[i];
	return (grain) { { s->x[0], s->x[1], p->job->dim == 3 ? s->x[2] : 0 }, s->radius };
}

static quern_real distance2(quern_vec a, quern_vec b) {
	const quern_vec d = quern_vec_sub(a, b);
	return quern_vec_dot(d, d, 3);
}

/* How far x lies outside an interval. */
static quern_real beyond(quern_real x, quern_real lower, quern_real upper) {
	return quern_max(quern_max(lower - x, x - upper), 0);
}

static bool reaches_region(const packing *p, const grain *g) {
	const quern_real *lower = p->job->lower, *upper = p->job->upper, reach = g->radius + p->radius;
	const quern_vec gap = { beyond(g->at.x, lower[0], upper[0]), beyond(g->at.y, lower[1], upper[1]),
		p->job->dim == 3 ? beyond(g->at.z, lower[2], upper[2]) : 0 };
	return quern_vec_dot(gap, gap, 3) <= reach * reach;
}

/* Can one grain touch both? */
static bool in_reach(const packing *p, const grain *a, const grain *b) {
	const quern_real reach = a->radius + b->radius + 2 * p->radius;
	return distance2(a->at, b->at) < reach * reach;
}

static bool gather(packing *p, uint32_t i) {
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

static bool in_box(const packing *p, const quern_real x[3]) {
	for (uint32_t k = 0; k < p->job->dim; k++)
		if (!(x[k] >= p->job->lower[k] && x[k] <= p->job->upper[k])) return false;
	return true;
}

/* The job's own test knows all grains and bodies and costs accordingly; most places fail already here. */
static bool clear_of_near(const packing *p, quern_vec at) {
	for (uint32_t k = 0; k < p->n_near; k++) {
		const quern_real reach = p->near[k].radius + p->radius - 1e-9 * p->radius;
		if (distance2(p->near[k].at, at) < reach * reach) return false;
	}
	return true;
}

typedef enum { TAKEN, WALLED, OPEN } standing;

/* WALLED: grains would let it in, but the job does not, so that a wall or body must be there. */
static standing probe(packing *p, quern_vec at) {
	const quern_pack_job *job = p->job;
	const quern_spot spot = { .x = { at.x, at.y, at.z }, .radius = p->radius };
	if (!in_box(p, spot.x) || !clear_of_near(p, at) || !job->inside(job, spot.x)) return TAKEN;
	if (job->free(job, &spot)) return OPEN;
	p->walled = true;
	return WALLED;
}

/* True if the grain that waited was placed there; then another one waits, and `near` is out of date. */
static bool offer(packing *p, quern_vec at) {
	quern_pack_job *job = p->job;
	const quern_spot spot = { .x = { at.x, at.y, at.z }, .radius = p->radius };
	if (probe(p, at) != OPEN) return false;
	p->placed[p->n_placed++] = (grain) { at, p->radius };
	p->stopped = !job->place(job, &spot) || p->n_placed == PLACED;
	if (!p->stopped) p->radius = job->radius(job);
	return true;
}

/* From a grain's centre to that of one touching it, longer by so much that rounding never makes it an overlap. */
static quern_real touching(const packing *p, const grain *g) { return (g->radius + p->radius) * (1 + 1e-12); }

static quern_real random_angle(const packing *p) {
	quern_real u[2];
	p->job->host->random(p->job->stream, p->job->key, p->job->counter++, u);
	return 6.283185307179586 * u[0];
}

/* ==== two grains: a pair of places in the plane, a ring in space ==== */

typedef struct {
	quern_vec middle, axis; /* axis: from the seed to the partner, not of unit length */
	quern_real height2;     /* m^2, from the axis to the places that touch both, squared */
	quern_real length2;     /* m^2, of the axis */
} saddle;

static saddle between(const packing *p, const grain *partner) {
	const quern_vec axis = quern_vec_sub(partner->at, p->seed.at);
	const quern_real a = touching(p, &p->seed), b = touching(p, partner), d2 = quern_vec_dot(axis, axis, 3);
	const quern_real along = 0.5 * (1 + (a * a - b * b) / d2);
	return (saddle) { quern_vec_axpy(along, axis, p->seed.at), axis, a * a - along * along * d2, d2 };
}

static bool offer_pair(packing *p, const grain *partner) {
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

static ring around_seed(const packing *p) {
	const quern_real r = touching(p, &p->seed);
	return (ring) { p->seed.at, { r, 0, 0 }, { 0, r, 0 } };
}

/* Crossed with the coordinate axis that is farthest from it, the saddle's own axis gives a product that cannot
 * vanish. */
static ring around_saddle(const saddle *s) {
	const quern_real x = quern_abs(s->axis.x), y = quern_abs(s->axis.y), z = quern_abs(s->axis.z);
	const bool x_least = x <= y && x <= z, y_least = !x_least && y <= z;
	const quern_vec pole = { x_least ? 1 : 0, y_least ? 1 : 0, x_least || y_least ? 0 : 1 };
	const quern_vec u = quern_vec_cross(s->axis, pole), v = quern_vec_cross(s->axis, u);
	const quern_real scale = __builtin_sqrt(s->height2 / quern_vec_dot(u, u, 3));
	return (ring) { s->middle, quern_vec_scale(scale, u),
		quern_vec_scale(scale / __builtin_sqrt(s->length2), v) };
}

static quern_vec on_ring(const ring *r, quern_real angle) {
	return quern_vec_axpy(quern_cos(angle), r->u, quern_vec_axpy(quern_sin(angle), r->v, r->middle));
}

static bool sweep_ring(packing *p, const ring *r) {
	const quern_real start = random_angle(p), step = 6.283185307179586 / p->self->angles;
	for (int32_t i = 0; i < p->self->angles; i++)
		if (offer(p, on_ring(r, start + i * step))) return true;
	return false;
}

/* The wall's surface is known to the job alone, which says yes or no. */
static quern_vec bisect(packing *p, const ring *r, quern_real open, quern_real walled) {
	for (int k = 0; k < 40; k++) {
		const quern_real middle = 0.5 * (open + walled);
		if (probe(p, on_ring(r, middle)) == OPEN) open = middle;
		else walled = middle;
	}
	return on_ring(r, open);
}

/* A wall counts as one more grain to touch. */
static bool lean_on_wall(packing *p, const ring *r) {
	const quern_real start = random_angle(p), step = 6.283185307179586 / p->self->angles;
	quern_real before = start;
	standing was = probe(p, on_ring(r, before));
	for (int32_t i = 1; i <= p->self->angles; i++) {
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
static bool sweep_sphere(packing *p) {
	const quern_real start = random_angle(p);
	for (int32_t i = 0; i < p->self->angles; i++) {
		const quern_real angle = start + i * 2.399963229728653;
		const quern_real z = 1 - (2 * i + 1) / (quern_real)p->self->angles,
						 across = __builtin_sqrt(1 - z * z);
		const quern_vec out = { across * quern_cos(angle), across * quern_sin(angle), z };
		if (offer(p, quern_vec_axpy(touching(p, &p->seed), out, p->seed.at))) return true;
	}
	return false;
}

/* ==== three grains: trilateration ==== */

/* x = seed + s u + t v + w u x v with u, v the ways to partner and third: the distances fix x.u and x.v, hence s and
 * t, and what is then left of the distance to the seed is w. */
static bool offer_corners(packing *p, const grain *partner, const grain *third) {
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

static bool add_beside_2d(packing *p) {
	const ring around = around_seed(p);
	for (uint32_t k = 0; k < p->n_near; k++)
		if (offer_pair(p, &p->near[k])) return true;
	if (!p->n_near) return sweep_ring(p, &around);
	return p->walled && lean_on_wall(p, &around);
}

static bool sweep_rings(packing *p, bool (*sweep)(packing *, const ring *)) {
	for (uint32_t k = 0; k < p->n_near; k++) {
		const saddle s = between(p, &p->near[k]);
		if (!(s.height2 > 0)) continue;
		const ring around = around_saddle(&s);
		if (sweep(p, &around)) return true;
	}
	return false;
}

static bool add_beside_3d(packing *p) {
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
static void walk(packing *p, uint32_t from, bool (*add_beside)(packing *)) {
	for (uint32_t i = from; i < queued(p) && !p->stopped; i++)
		while (!p->stopped && gather(p, i) && add_beside(p)) continue;
}

static bool empty(const packing *p) {
	for (uint32_t i = 0; i < p->job->n_seed; i++)
		if (in_box(p, p->job->seed[i].x)) return false;
	return !p->n_placed;
}

static void throw_darts(packing *p) {
	quern_pack_job *job = p->job;
	for (int32_t t = 0; t < p->self->trials; t++) {
		quern_real u[4] = { 0 }, x[3] = { 0 };
		job->host->random(job->stream, job->key, job->counter++, u);
		if (job->dim == 3) job->host->random(job->stream, job->key, job->counter++, u + 2);
		for (uint32_t k = 0; k < job->dim; k++) x[k] = job->lower[k] + u[k] * (job->upper[k] - job->lower[k]);
		if (offer(p, (quern_vec) { x[0], x[1], x[2] })) return;
	}
}

static void pack(const void *self, quern_pack_job *job, bool (*add_beside)(packing *)) {
	packing p; /* not cleared: it is large, and only what is counted is read */
	p.self = self;
	p.job = job;
	p.radius = job->radius(job);
	p.stopped = p.walled = false;
	p.n_placed = p.n_near = 0;
	walk(&p, 0, add_beside);
	if (!empty(&p)) return;
	p.n_near = 0;
	throw_darts(&p);
	walk(&p, job->n_seed, add_beside);
}

static void pack_2d(const void *self, quern_pack_job *job) { pack(self, job, add_beside_2d); }
static void pack_3d(const void *self, quern_pack_job *job) { pack(self, job, add_beside_3d); }

static const quern_packer_ops ops = { .size = sizeof ops, .pack = { pack_2d, pack_3d } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "packer.two_point_tangent",
	.brief = "Grains that touch two others, in 3-D three: nearly as dense as grains at rest.",
	.doc = "Grows the region from the grains in and around it. A grain with too few neighbours first gets "
		   "one at `angles` places around it; a dart is thrown only where a region would stay empty.",
	.cite = "Chantharayukhonthorn 2019, section 6.2.4",
	.instance_size = sizeof(two_point_tangent),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
