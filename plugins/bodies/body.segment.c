/* SPDX-License-Identifier: MIT */
/* body.segment - all that lies within half a thickness of the line between two points. docs/theory/bodies.md */
#include "surface.h"
#include <math.h>

typedef struct {
	quern_real from[3], to[3], thickness;
	quern_real axis[3], aside[3], length; /* unit vectors along it and across */
} segment;

static const quern_param params[] = { QUERN_PARAM(segment, from, "m", "One end.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(segment, to, "m", "The other end.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(segment, thickness, "m",
		"Of the wall, or the rod's diameter; ends are round, with half of it beyond the points.", .min = 0,
		.max = INFINITY),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* Across a rod any direction will do: that of the axis which it is farthest from. */
static void find_aside(segment *p, uint32_t dim) {
	const quern_real *a = p->axis;
	uint32_t least = 0;
	if (dim == 2) {
		p->aside[0] = -a[1], p->aside[1] = a[0];
		return;
	}
	for (uint32_t k = 1; k < 3; k++) least = fabs(a[k]) < fabs(a[least]) ? k : least;
	const quern_real across = sqrt(1 - a[least] * a[least]);
	for (uint32_t k = 0; k < 3; k++) p->aside[k] = ((k == least ? 1 : 0) - a[least] * a[k]) / across;
}

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	segment *p = self;
	quern_real square = 0;
	for (uint32_t k = 0; k < 3; k++) square += (p->to[k] - p->from[k]) * (p->to[k] - p->from[k]);
	p->length = sqrt(square);
	if (!surface_has_way(square))
		return setup->host->fail(err, QUERN_E_PARAM, "to", "is the same point as `from`: they must be apart");
	for (uint32_t k = 0; k < 3; k++) p->axis[k] = (p->to[k] - p->from[k]) / p->length;
	find_aside(p, setup->dim);
	return QUERN_OK;
}

/* Without a thickness it has two sides all the same: the normal is on that of the place. */
QUERN_INLINE void kernel(const int dim, const segment *p, const quern_body_batch *b) {
	const surface_pose pose = surface_pose_of(b->pose);
	const quern_vec from = QUERN_VEC_OF(p->from), axis = QUERN_VEC_OF(p->axis),
					aside = QUERN_VEC_OF(p->aside);
	const quern_real length = p->length, half = 0.5 * p->thickness;
	const quern_real *restrict radius = b->radius;
	quern_real *restrict gap = b->gap;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec x = QUERN_VEC_AT(b->position, i, dim);
		const quern_vec d = quern_vec_sub(surface_inward(&pose, x), from);
		const quern_real s = quern_vec_dot(d, axis, dim), along = s < 0 ? 0 : s > length ? length : s;
		const quern_vec way = quern_vec_axpy(-along, axis, d);
		const quern_real square = quern_vec_dot(way, way, dim);
		const bool apart = surface_has_way(square);
		const quern_real away = apart ? __builtin_sqrt(square) : 0, one_over = apart ? 1 / away : 0;
		const quern_vec own = { apart ? way.x * one_over : aside.x, apart ? way.y * one_over : aside.y,
			apart ? way.z * one_over : aside.z };
		const quern_real distance = away - half;
		const quern_vec n = quern_vec_turn(pose.turn, own), v = surface_velocity(&pose, x, n, distance);
		gap[i] = distance - radius[i];
		QUERN_VEC_PUT(b->normal, i, n, dim);
		QUERN_VEC_PUT(b->velocity, i, v, dim);
	}
}

static void closest(const void *self, const quern_body_batch *b) {
	if (b->dim == 2) kernel(2, self, b);
	else kernel(3, self, b);
}

static void bounds(const void *self, uint32_t dim, quern_real lower[3], quern_real upper[3]) {
	const segment *p = self;
	for (uint32_t k = 0; k < dim; k++) {
		lower[k] = (p->from[k] < p->to[k] ? p->from[k] : p->to[k]) - 0.5 * p->thickness;
		upper[k] = (p->from[k] < p->to[k] ? p->to[k] : p->from[k]) + 0.5 * p->thickness;
	}
}

static const quern_body_ops ops = { .size = sizeof ops, .closest = closest, .bounds = bounds };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "body.segment",
	.brief = "A straight wall between two points, in 3-D a rod.",
	.doc =
		"It keeps grains out on both sides, thin as it may be. The continuum sees it only where nodes of "
		"the grid "
		"lie in it, and a node of a slip, frictional or rough wall holds what comes from the nearer side: for that it must be about two cells thick, one where it is sticky.",
	.cite = "Ericson 2005, section 5.1.2",
	.instance_size = sizeof(segment),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
