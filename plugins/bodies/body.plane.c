/* SPDX-License-Identifier: MIT */
/* body.plane - a half-space: everything on the side that the normal does not point to. docs/theory/bodies.md */
#include <math.h>
#include <quern/body.h>
#include <quern/vec.h>

typedef struct {
	quern_real point[3], normal[3];
} plane;

static const quern_param params[] = { QUERN_PARAM(
										  plane, point, "m", "A point on it.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(
		plane, normal, "1", "Out of the body, towards the material; any length.", .flags = QUERN_REQUIRED),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	plane *p = self;
	quern_real length = 0;
	for (uint32_t k = 0; k < 3; k++) length += p->normal[k] * p->normal[k];
	length = sqrt(length);
	if (!(length > 0)) return setup->host->fail(err, QUERN_E_PARAM, "normal", "has no length");
	for (uint32_t k = 0; k < 3; k++) p->normal[k] = p->normal[k] == 0 ? 0 : p->normal[k] / length;
	return QUERN_OK;
}

QUERN_INLINE void kernel(const int dim, const plane *p, const quern_body_batch *b) {
	const quern_pose *pose = b->pose;
	const quern_vec at = QUERN_VEC_OF(pose->position), drift = QUERN_VEC_OF(pose->velocity),
					spin = QUERN_VEC_OF(pose->spin);
	const quern_vec n = quern_vec_turn(pose->turn, QUERN_VEC_OF(p->normal));
	const quern_vec o = quern_vec_add(quern_vec_turn(pose->turn, QUERN_VEC_OF(p->point)), at);
	const quern_real *restrict radius = b->radius;
	quern_real *restrict gap = b->gap;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec x = QUERN_VEC_AT(b->position, i, dim);
		const quern_real distance = quern_vec_dot(quern_vec_sub(x, o), n, dim);
		const quern_vec arm = quern_vec_sub(quern_vec_axpy(-distance, n, x), at);
		const quern_vec v = quern_vec_add(drift, quern_vec_cross(spin, arm));
		gap[i] = distance - radius[i];
		QUERN_VEC_PUT(b->normal, i, n, dim);
		QUERN_VEC_PUT(b->velocity, i, v, dim);
	}
}

static void closest(const void *self, const quern_body_batch *b) {
	if (b->dim == 2) kernel(2, self, b);
	else kernel(3, self, b);
}

/* Only a plane across an axis has a bounding box with a finite side. */
static void bounds(const void *self, uint32_t dim, quern_real lower[3], quern_real upper[3]) {
	const plane *p = self;
	for (uint32_t k = 0; k < dim; k++) {
		lower[k] = p->normal[k] < -1 + 1e-12 ? p->point[k] : -INFINITY;
		upper[k] = p->normal[k] > 1 - 1e-12 ? p->point[k] : INFINITY;
	}
}

static const quern_body_ops ops = { .size = sizeof ops, .closest = closest, .bounds = bounds };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "body.plane",
	.brief = "A half-space.",
	.doc = "Unbounded. For the continuum it folds the shape functions where it lies on a face of the domain.",
	.instance_size = sizeof(plane),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
