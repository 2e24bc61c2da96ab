/* SPDX-License-Identifier: MIT */
/* body.box - a solid rectangle or cuboid, along the axes of its pose or turned. docs/theory/bodies.md */
#include <math.h>
#include <quern/body.h>
#include <quern/math.h>
#include <quern/vec.h>

typedef struct {
	quern_real lower[3], upper[3];
	quern_real angle, axis[3]; /* rad; NaN: not given */
	quern_real turn[9];        /* row-major, from the box's own axes to the body's */
	bool turned;
} box;

static const quern_param params[] = { QUERN_PARAM(box, lower, "m", "Lower corner, before any turn.",
										  .flags = QUERN_REQUIRED),
	QUERN_PARAM(box, upper, "m",
		"Upper corner, before any turn; may equal the lower one along an axis: a plate without an inside.",
		.flags = QUERN_REQUIRED),
	QUERN_PARAM_AS(box, angle, "turn", "rad",
		"By which it is turned about its middle; counterclockwise, in 3-D seen against the axis.",
		.flags = QUERN_MAYBE, .min = -1e4, .max = 1e4),
	QUERN_PARAM(box, axis, "1", "In 3-D, about which it is turned; of any length.", .flags = QUERN_MAYBE),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* Rodrigues: n n^T + cos a (1 - n n^T) + sin a [n x] */
static void set_turn(box *p, const quern_real n[3], quern_real angle) {
	const quern_real c = quern_cos(angle), s = quern_sin(angle);
	for (uint32_t i = 0; i < 3; i++)
		for (uint32_t j = 0; j < 3; j++) p->turn[3 * i + j] = n[i] * n[j] * (1 - c) + (i == j ? c : 0);
	for (uint32_t i = 0; i < 3; i++) {
		const uint32_t j = (i + 1) % 3, k = (i + 2) % 3;
		p->turn[3 * k + j] += n[i] * s;
		p->turn[3 * j + k] -= n[i] * s;
	}
	p->turned = true;
}

static quern_status find_turn(box *p, const quern_setup *setup, quern_err *err) {
	quern_real about[3] = { 0, 0, 1 };
	const bool axis = !isnan(p->axis[0]);
	if (axis && setup->dim == 2)
		return setup->host->fail(
			err, QUERN_E_PARAM, "axis", "is across the plane in 2-D: leave it out, and give turn alone");
	if (setup->dim == 3 && axis != !isnan(p->angle))
		return setup->host->fail(err, QUERN_E_PARAM, axis ? "axis" : "turn",
			axis ? "comes with turn, the angle about it, such as 30 degree"
				 : "comes with axis, what it is turned about, such as [0, 0, 1]");
	if (isnan(p->angle)) return QUERN_OK;
	if (axis) {
		const quern_real length = sqrt(quern_vec_dot(QUERN_VEC_OF(p->axis), QUERN_VEC_OF(p->axis), 3));
		if (!(length > 0)) return setup->host->fail(err, QUERN_E_PARAM, "axis", "has no length");
		for (uint32_t k = 0; k < 3; k++) about[k] = p->axis[k] = p->axis[k] == 0 ? 0 : p->axis[k] / length;
	}
	set_turn(p, about, p->angle);
	return QUERN_OK;
}

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	const box *p = self;
	for (uint32_t k = 0; k < setup->dim; k++)
		if (!(p->upper[k] >= p->lower[k]))
			return setup->host->fail(err, QUERN_E_PARAM, "upper", "must not be below lower along axis %u", k);
	return find_turn(self, setup, err);
}

/* Outside, the way to the nearest point of the box; inside, to the nearest face. Both by selects. */
QUERN_INLINE void kernel(const int dim, const bool turned, const box *p, const quern_body_batch *b) {
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
		const quern_vec from = quern_vec_sub(quern_vec_turn_back(pose->turn, quern_vec_sub(x, at)), middle);
		const quern_vec d = turned ? quern_vec_turn_back(p->turn, from) : from;
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
		const quern_vec along = { sx * (inside ? ix : ox * one_over), sy * (inside ? iy : oy * one_over),
			sz * (inside ? iz : oz * one_over) };
		const quern_vec own = turned ? quern_vec_turn(p->turn, along) : along;
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
	const bool turned = ((const box *)self)->turned;
	if (b->dim == 2) {
		if (turned) kernel(2, true, self, b);
		else kernel(2, false, self, b);
	} else if (turned) kernel(3, true, self, b);
	else kernel(3, false, self, b);
}

static void bounds(const void *self, uint32_t dim, quern_real lower[3], quern_real upper[3]) {
	const box *p = self;
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real middle = 0.5 * (p->lower[k] + p->upper[k]);
		quern_real reach = 0;
		for (uint32_t j = 0; j < dim && p->turned; j++)
			reach += fabs(p->turn[3 * k + j]) * 0.5 * (p->upper[j] - p->lower[j]);
		lower[k] = p->turned ? middle - reach : p->lower[k];
		upper[k] = p->turned ? middle + reach : p->upper[k];
	}
}

static const quern_body_ops ops = { .size = sizeof ops, .closest = closest, .bounds = bounds };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "body.box",
	.brief = "A solid box, along the axes of its pose or turned about its middle.",
	.instance_size = sizeof(box),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
