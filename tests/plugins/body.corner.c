/* SPDX-License-Identifier: MIT */
/* body.corner - two planes that meet, feature 0 and feature 1: what lies behind either is inside. For tests. */
#include <math.h>
#include <quern/body.h>
#include <quern/vec.h>

typedef struct {
	quern_real point[3], first[3], second[3];
} corner;
static const quern_param params[] = {
	QUERN_PARAM(corner, point, "m", "A point on both planes.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(corner, first, "1", "Unit normal of feature 0.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(corner, second, "1", "Unit normal of feature 1.", .flags = QUERN_REQUIRED), QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

static void closest(const void *self, const quern_body_batch *b) {
	const corner *c = self;
	const int dim = (int)b->dim;
	const quern_vec o = QUERN_VEC_OF(c->point), n[2] = { QUERN_VEC_OF(c->first), QUERN_VEC_OF(c->second) };
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec d = quern_vec_sub(QUERN_VEC_AT(b->position, i, dim), o);
		const quern_real gap[2] = { quern_vec_dot(d, n[0], dim), quern_vec_dot(d, n[1], dim) };
		const int which = b->feature ? b->feature[i] : gap[1] < gap[0];
		const quern_vec zero = { 0, 0, 0 };
		b->gap[i] = gap[which] - b->radius[i];
		QUERN_VEC_PUT(b->normal, i, n[which], dim);
		QUERN_VEC_PUT(b->velocity, i, zero, dim);
	}
}

static uint32_t features(const void *self, const quern_pose *pose, const quern_real x[3], quern_real reach,
	uint32_t cap, int32_t *feature) {
	const corner *c = self;
	const quern_vec d = quern_vec_sub(QUERN_VEC_OF(x), QUERN_VEC_OF(c->point));
	uint32_t n = 0;
	(void)pose;
	for (int32_t f = 0; f < 2; f++) {
		const quern_vec normal = f ? QUERN_VEC_OF(c->second) : QUERN_VEC_OF(c->first);
		if (!(quern_vec_dot(d, normal, 3) < reach)) continue;
		if (n < cap) feature[n] = f;
		n++;
	}
	return n;
}

static void bounds(const void *self, uint32_t dim, quern_real lower[3], quern_real upper[3]) {
	(void)self;
	for (uint32_t k = 0; k < dim; k++) lower[k] = -INFINITY, upper[k] = INFINITY;
}

static const quern_body_ops ops = {
	.size = sizeof ops, .closest = closest, .features = features, .bounds = bounds
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "body.corner",
	.brief = "Two planes as the features of one body, for tests.",
	.instance_size = sizeof(corner),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
