/* SPDX-License-Identifier: MIT */
/* body.sphere - a sphere, in 2-D a disc, or all but what lies in it: a bowl without a rim. docs/theory/bodies.md */
#include "surface.h"
#include <math.h>

typedef struct {
	quern_real centre[3], radius;
	bool inside;
} sphere;

static const quern_param params[] = {
	QUERN_PARAM(sphere, centre, "m", "Its centre.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(sphere, radius, "m", "Radius.", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = INFINITY),
	QUERN_PARAM(sphere, inside, NULL, "The material is inside, and all around it is solid."), QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

/* From the centre all directions are as good: there it is x. */
QUERN_INLINE void kernel(const int dim, const sphere *p, const quern_body_batch *b) {
	const surface_pose pose = surface_pose_of(b->pose);
	const quern_vec centre = QUERN_VEC_OF(p->centre);
	const quern_real side = p->inside ? -1 : 1, size = p->radius;
	const quern_real *restrict radius = b->radius;
	quern_real *restrict gap = b->gap;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec x = QUERN_VEC_AT(b->position, i, dim);
		const quern_vec d = quern_vec_sub(surface_inward(&pose, x), centre);
		const quern_real square = quern_vec_dot(d, d, dim);
		const bool apart = surface_has_way(square);
		const quern_real away = apart ? __builtin_sqrt(square) : 0, one_over = apart ? side / away : 0;
		const quern_vec own = { apart ? d.x * one_over : side, d.y * one_over, d.z * one_over };
		const quern_real distance = side * (away - size);
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
	const sphere *p = self;
	for (uint32_t k = 0; k < dim; k++) {
		lower[k] = p->inside ? -INFINITY : p->centre[k] - p->radius;
		upper[k] = p->inside ? INFINITY : p->centre[k] + p->radius;
	}
}

static const quern_body_ops ops = { .size = sizeof ops, .closest = closest, .bounds = bounds };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "body.sphere",
	.brief = "A sphere, in 2-D a disc; hollow, a bowl that closes above.",
	.instance_size = sizeof(sphere),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
