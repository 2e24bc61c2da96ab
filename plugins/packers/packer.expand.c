/* SPDX-License-Identifier: MIT */
/* packer.expand - grains that begin smaller than they are and grow: all together in a fill, in a hybrid those that were put into the
 * largest holes. docs/theory/packers.md, section 7 */
#include "relax.h"
#include "tangent.h"

typedef struct {
	quern_real start, least, overlap;
	int32_t sweeps, trials, angles;
} expand;

static const quern_param params[] = {
	QUERN_PARAM(expand, start, "1",
		"Share of its radius that a grain of a fill begins with: the less, the denser the "
		"fill.",
		.def = 0.98, .min = 0.5, .max = 1),
	QUERN_PARAM(expand, least, "1",
		"Least share of its radius that a grain of a hybrid begins with where no full one has room.",
		.def = 0.5, .min = 0.1, .max = 1),
	QUERN_PARAM(expand, sweeps, "1", "Steps in which the grains of a fill grow.", .def = 200, .min = 1,
		.max = 1000000),
	QUERN_PARAM(expand, overlap, "1",
		"What grains of a fill may overlap at the end, over the smaller radius.", .def = 0.002, .min = 1e-6,
		.max = 0.01),
	QUERN_PARAM(expand, trials, "1", "Darts for the first grain of a region that would stay empty.",
		.def = 20, .min = 1, .max = 100000),
	QUERN_PARAM(expand, angles, "1", "Places tried around a grain that has too few neighbours.", .def = 36,
		.min = 3, .max = 100000),
	QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

/* ==== the largest hole, on nodes ==== */

enum { NODES = 4096, AROUND = 1024 };

typedef struct {
	packing *p;
	uint32_t lines[3], n_nodes, n_around;
	quern_real pitch[3];
	quern_real room[NODES]; /* m: radius of the largest grain there; below 0: none */
	grain around[AROUND];
} holes;

static quern_real room_at(const holes *h, quern_vec at) {
	quern_real least = 1e300;
	for (uint32_t i = 0; i < h->n_around; i++) {
		const quern_real d2 = distance2(at, h->around[i].at), reach = least + h->around[i].radius;
		if (!(d2 < reach * reach)) continue;
		const quern_real room = __builtin_sqrt(d2) - h->around[i].radius;
		least = room < least ? room : least;
	}
	return least;
}

static quern_vec node(const holes *h, uint32_t i) {
	const quern_real *lower = h->p->job->lower;
	const uint32_t x = i % h->lines[0], y = i / h->lines[0] % h->lines[1], z = i / h->lines[0] / h->lines[1];
	return (quern_vec) { lower[0] + (x + 0.5) * h->pitch[0], lower[1] + (y + 0.5) * h->pitch[1],
		h->p->job->dim == 3 ? lower[2] + (z + 0.5) * h->pitch[2] : 0 };
}

/* A quarter of a radius apart, or as far as the nodes suffice. */
static void lay_out(holes *h) {
	const quern_pack_job *job = h->p->job;
	const uint32_t most = job->dim == 2 ? 64 : 16;
	h->n_nodes = 1;
	for (uint32_t k = 0; k < 3; k++) {
		h->lines[k] = 1;
		h->pitch[k] = 0;
		if (k >= job->dim) continue;
		const quern_real width = job->upper[k] - job->lower[k], wanted = width / (0.25 * h->p->radius);
		h->lines[k] = wanted < most - 1 ? (uint32_t)wanted + 1 : most;
		h->pitch[k] = width / h->lines[k];
		h->n_nodes *= h->lines[k];
	}
}

static void look_around(holes *h) {
	const uint32_t n = queued(h->p);
	h->n_around = 0;
	for (uint32_t i = 0; i < n && h->n_around < AROUND; i++) {
		const grain one = in_queue(h->p, i);
		if (reaches_region(h->p, &one)) h->around[h->n_around++] = one;
	}
}

static bool is_inside(const holes *h, quern_vec at) {
	const quern_real x[3] = { at.x, at.y, at.z };
	return in_box(h->p, x) && h->p->job->inside(h->p->job, x);
}

static void measure_rooms(holes *h) {
	for (uint32_t i = 0; i < h->n_nodes; i++) {
		const quern_vec at = node(h, i);
		h->room[i] = is_inside(h, at) ? room_at(h, at) : -1;
	}
}

/* Up the gradient by steps along the axes that grow shorter. */
static quern_vec climb(const holes *h, quern_vec at) {
	quern_real best = room_at(h, at);
	for (quern_real step = 0.5; step > 1e-5; step *= 0.5)
		for (uint32_t way = 0, still = 0; still < 2 * h->p->job->dim;
			 way = (way + 1) % (2 * h->p->job->dim), still++) {
			const quern_real by = way % 2 ? -step : step;
			const quern_vec next = { at.x + (way / 2 == 0 ? by * h->pitch[0] : 0),
				at.y + (way / 2 == 1 ? by * h->pitch[1] : 0), at.z + (way / 2 == 2 ? by * h->pitch[2] : 0) };
			const quern_real room = is_inside(h, next) ? room_at(h, next) : -1;
			if (!(room > best)) continue;
			best = room;
			at = next;
			still = 0;
		}
	return at;
}

/* ==== the waiting grain into it ==== */

static bool is_free(const holes *h, quern_vec at, quern_real radius) {
	const quern_spot spot = { .x = { at.x, at.y, at.z }, .radius = radius };
	return h->p->job->free(h->p->job, &spot);
}

/* Bodies are known to the job alone, which says yes or no. 0: less than `least` is free. */
static quern_real free_radius(const holes *h, quern_vec at, quern_real least, quern_real most) {
	if (most < least || !is_free(h, at, least)) return 0;
	if (is_free(h, at, most)) return most;
	for (int k = 0; k < 20; k++) {
		const quern_real middle = 0.5 * (least + most);
		if (is_free(h, at, middle)) least = middle;
		else most = middle;
	}
	return least;
}

static void put(holes *h, quern_vec at, quern_real radius) {
	packing *p = h->p;
	quern_pack_job *job = p->job;
	const quern_spot spot = { .x = { at.x, at.y, at.z }, .radius = radius };
	p->placed[p->n_placed++] = (grain) { at, radius };
	p->stopped = !job->place(job, &spot) || p->n_placed == PLACED;
	if (!p->stopped) p->radius = job->radius(job);
}

/* Rooms shrink only by what is put there. */
static bool fill_largest(holes *h, quern_real least) {
	for (;;) {
		uint32_t best = 0;
		for (uint32_t i = 1; i < h->n_nodes; i++)
			if (h->room[i] > h->room[best]) best = i;
		/* a hole's middle lies off the nearest node by less than half a pitch along each axis */
		const quern_real slack = h->pitch[0] + h->pitch[1] + h->pitch[2];
		if (h->room[best] + 0.5 * slack < least * h->p->radius || h->room[best] < 0) return false;
		const quern_vec at = climb(h, node(h, best));
		const quern_real room = room_at(h, at) * (1 - 1e-12);
		const quern_real radius =
			free_radius(h, at, least * h->p->radius, room < h->p->radius ? room : h->p->radius);
		h->room[best] = -1;
		if (!(radius > 0)) continue;
		put(h, at, radius);
		return true;
	}
}

static void fill_holes(packing *p, quern_real least) {
	holes h;
	h.p = p;
	lay_out(&h);
	while (!p->stopped) {
		look_around(&h);
		measure_rooms(&h);
		if (!fill_largest(&h, least)) return;
	}
}

/* ==== the packer ==== */

static void pack(const void *self, quern_pack_job *job) {
	const expand *e = self;
	packing p;
	begin(&p, job, e->trials, e->angles);
	if (job->growth == QUERN_GROWS_TOGETHER) p.part = e->start;
	p.radius *= p.part;
	pack_tangent(&p);
	if (job->growth == QUERN_GROWS_ALONE) fill_holes(&p, e->least);
}

static quern_status relax(const void *self, quern_relax_job *job) {
	const expand *e = self;
	return quern_packer_relax(job, e->sweeps, e->overlap);
}

static const quern_packer_ops ops = {
	.size = sizeof ops, .shrinks = 1, .pack = { pack, pack }, .relax = relax
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "packer.expand",
	.brief = "Grains that begin smaller and grow: as dense as grains at rest.",
	.doc =
		"In a fill all grains are placed as by `two_point_tangent`, a little too small, and then grow while they push each other "
		"apart. In a hybrid, where mass is owed and no full grain has room, a grain goes into the largest hole and grows "
		"while the run goes on (`hybrid.growth`). In a source it is `two_point_tangent`.",
	.cite = "Lubachevsky & Stillinger 1990; Chantharayukhonthorn 2019, section 6.2.4",
	.instance_size = sizeof(expand),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
