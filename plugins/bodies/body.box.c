/* SPDX-License-Identifier: MIT */
/* body.box - a solid rectangle or cuboid, along the axes of its pose. docs/theory/bodies.md */
#include <math.h>
#include <quern/body.h>
#include <quern/vec.h>

typedef struct {
	quern_real lower[3], upper[3];
} box;

static const quern_param params[] = { QUERN_PARAM(box, lower, "m", "Lower corner.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(box, upper, "m", "Upper corner.", .flags = QUERN_REQUIRED), QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	const box *p = self;
	for (uint32_t k = 0; k < setup->dim; k++)
		if (!(p->upper[k] > p->lower[k]))
			return setup->host->fail(err, QUERN_E_PARAM, "upper", "must be above lower along axis %u", k);
	return QUERN_OK;
}

/* Outside, the way to the nearest point of the box; inside, to the nearest face. Both by selects. */
QUERN_INLINE void kernel(const int dim, const box *p, const quern_body_batch *b) {
	const quern_real *restrict radius = b->radius;
	quern_real *restrict gap = b->gap;
	const quern_pose *pose = b->pose;
	const quern_vec at = QUERN_VEC_OF(pose->position), drift = QUERN_VEC_OF(pose->velocity),
					spin = QUERN_VEC_OF(pose->spin);
	const quern_vec middle = { 0.5 * (p->lower[0] + p->upper[0]), 0.5 * (p->lower[1] + p->upper[1]),
		0.5 * (p->lower[2] + p->upper[2]) };
	const quern_vec half = { 0.5 * (p->upper[0] - p->lower[0]), 0.5 * (p->upper[1] - p->lower[1]),
		0.5 * (p->upper[2] - p->lower[2]) };
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec x = QUERN_VEC_AT(b->position, i, dim);
		const quern_vec d = quern_vec_sub(quern_vec_turn_back(pose->turn, quern_vec_sub(x, at)), middle);
		const quern_real sx = d.x < 0 ? -1 : 1, sy = d.y < 0 ? -1 : 1, sz = d.z < 0 ? -1 : 1;
		const quern_real qx = sx * d.x - half.x, qy = sy * d.y - half.y,
						 qz = dim == 3 ? sz * d.z - half.z : -INFINITY;
		const quern_real ox = qx > 0 ? qx : 0, oy = qy > 0 ? qy : 0, oz = qz > 0 ? qz : 0;
		const quern_real away = __builtin_sqrt(ox * ox + oy * oy + oz * oz),
						 one_over = away > 0 ? 1 / away : 0;
		const quern_real most = qx > qy ? (qx > qz ? qx : qz) : (qy > qz ? qy : qz);
		const bool inside = !(away > 0);
		const quern_real ix = qx == most ? 1 : 0, iy = qx != most && qy == most ? 1 : 0,
						 iz = qx != most && qy != most ? 1 : 0;
		const quern_vec own = { sx * (inside ? ix : ox * one_over), sy * (inside ? iy : oy * one_over),
			sz * (inside ? iz : oz * one_over) };
		const quern_real distance = inside ? most : away;
		const quern_vec n = quern_vec_turn(pose->turn, own);
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

static void bounds(const void *self, uint32_t dim, quern_real lower[3], quern_real upper[3]) {
	const box *p = self;
	for (uint32_t k = 0; k < dim; k++) lower[k] = p->lower[k], upper[k] = p->upper[k];
}

static const quern_body_ops ops = { .size = sizeof ops, .closest = closest, .bounds = bounds };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "body.box",
	.brief = "A solid box, along the axes of its pose.",
	.instance_size = sizeof(box),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
