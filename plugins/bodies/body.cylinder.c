/* SPDX-License-Identifier: MIT */
/* body.cylinder - a disc or a cylinder, or all but what lies in it: a drum. docs/theory/bodies.md */
#include "surface.h"
#include <math.h>

typedef struct {
	quern_real centre[3], radius, axis[3], length;
	bool inside;
	quern_real aside[3], half; /* a unit vector across the axis; half the length, infinite without ends */
} cylinder;

static const quern_param params[] = { QUERN_PARAM(cylinder, centre, "m",
										  "Of the disc, or a point in the middle of the axis.",
										  .flags = QUERN_REQUIRED),
	QUERN_PARAM(cylinder, radius, "m", "Radius.", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = INFINITY),
	QUERN_PARAM(
		cylinder, axis, "1", "Along it, in 3-D, of any length; left out, along z.", .flags = QUERN_MAYBE),
	QUERN_PARAM(cylinder, length, "m", "From end to end, in 3-D; left out, it has no ends.",
		.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = INFINITY),
	QUERN_PARAM(cylinder, inside, NULL,
		"The material is inside, as in a drum, and all around it is solid; with a length, caps close it."),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* What a grain in a closed drum may touch at the same time. */
enum { SHELL, LOWER_CAP, UPPER_CAP, FACES };

static bool is_closed_drum(const cylinder *p) { return p->inside && isfinite(p->half); }

/* Any direction across the axis will do: that of the coordinate which it is farthest from. */
static void find_aside(cylinder *p) {
	const quern_real *a = p->axis;
	uint32_t least = 0;
	for (uint32_t k = 1; k < 3; k++) least = fabs(a[k]) < fabs(a[least]) ? k : least;
	const quern_real across = sqrt(1 - a[least] * a[least]);
	for (uint32_t k = 0; k < 3; k++) p->aside[k] = ((k == least ? 1 : 0) - a[least] * a[k]) / across;
}

static quern_status init_plane(cylinder *p, const quern_setup *setup, quern_err *err) {
	if (!isnan(p->axis[0]))
		return setup->host->fail(
			err, QUERN_E_PARAM, "axis", "has no meaning in 2-D, where it is a disc: leave it out");
	if (!isnan(p->length))
		return setup->host->fail(
			err, QUERN_E_PARAM, "length", "has no meaning in 2-D, where it is a disc: leave it out");
	p->half = INFINITY;
	p->aside[0] = 1;
	return QUERN_OK;
}

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	cylinder *p = self;
	if (setup->dim == 2) return init_plane(p, setup, err);
	if (isnan(p->axis[0])) p->axis[0] = p->axis[1] = 0, p->axis[2] = 1;
	const quern_real square = quern_vec_dot(QUERN_VEC_OF(p->axis), QUERN_VEC_OF(p->axis), 3);
	if (!surface_has_way(square)) return setup->host->fail(err, QUERN_E_PARAM, "axis", "has no length");
	for (uint32_t k = 0; k < 3; k++) p->axis[k] = p->axis[k] == 0 ? 0 : p->axis[k] / sqrt(square);
	p->half = isnan(p->length) ? INFINITY : 0.5 * p->length;
	find_aside(p);
	return QUERN_OK;
}

/* A place seen from the cylinder: how far it is beyond the shell and beyond the nearer end, and which way these are. */
typedef struct {
	quern_vec out, up;      /* unit, from the axis and towards that end */
	quern_real past, above; /* m, negative: within */
} seen;

QUERN_INLINE seen look(
	const int dim, quern_vec d, quern_vec axis, quern_vec aside, quern_real radius, quern_real half) {
	const quern_real h = dim == 3 ? quern_vec_dot(d, axis, 3) : 0, up = h < 0 ? -1 : 1;
	const quern_vec way = dim == 3 ? quern_vec_axpy(-h, axis, d) : d;
	const quern_real square = quern_vec_dot(way, way, dim);
	const bool apart = surface_has_way(square);
	const quern_real away = apart ? __builtin_sqrt(square) : 0, one_over = apart ? 1 / away : 0;
	const quern_vec out = { apart ? way.x * one_over : aside.x, apart ? way.y * one_over : aside.y,
		apart ? way.z * one_over : aside.z };
	return (seen) { out, quern_vec_scale(up, axis), away - radius, dim == 3 ? up * h - half : -INFINITY };
}

/* The solid's distance, as that of a box in the half-plane through axis and place; the drum's is the opposite. Of a
 * closed drum's faces each is a plane or a shell that goes on beyond its edge, since from within no edge is met. */
QUERN_INLINE void kernel(const int dim, const bool faces, const cylinder *p, const quern_body_batch *b) {
	const surface_pose pose = surface_pose_of(b->pose);
	const quern_vec centre = QUERN_VEC_OF(p->centre), aside = QUERN_VEC_OF(p->aside),
					axis = dim == 3 ? QUERN_VEC_OF(p->axis) : (quern_vec) { 0, 0, 0 };
	const quern_real side = p->inside ? -1 : 1, size = p->radius, half = p->half;
	const quern_real *restrict radius = b->radius;
	const int32_t *restrict feature = b->feature;
	quern_real *restrict gap = b->gap;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec x = QUERN_VEC_AT(b->position, i, dim);
		const quern_vec d = quern_vec_sub(surface_inward(&pose, x), centre);
		const seen s = look(dim, d, axis, aside, size, half);
		const quern_real op = s.past > 0 ? s.past : 0, oa = s.above > 0 ? s.above : 0;
		const quern_real away = __builtin_sqrt(op * op + oa * oa), one_over = away > 0 ? 1 / away : 0;
		const bool within = !(away > 0), shell = s.past > s.above;
		quern_real distance = within ? (shell ? s.past : s.above) : away;
		quern_real share = within ? (shell ? 1 : 0) : op * one_over,
				   rest = within ? (shell ? 0 : 1) : oa * one_over;
		if (faces) {
			const quern_real which = feature[i], h = quern_vec_dot(d, axis, 3), up = h < 0 ? -1 : 1;
			const quern_real end = which == LOWER_CAP ? -1 : 1;
			distance = which == SHELL ? s.past : end * h - half;
			share = which == SHELL ? 1 : 0;
			rest = which == SHELL ? 0 : end * up;
		}
		distance *= side;
		const quern_vec own =
			quern_vec_scale(side, quern_vec_axpy(share, s.out, quern_vec_scale(rest, s.up)));
		const quern_vec n = quern_vec_turn(pose.turn, own), v = surface_velocity(&pose, x, n, distance);
		gap[i] = distance - radius[i];
		QUERN_VEC_PUT(b->normal, i, n, dim);
		QUERN_VEC_PUT(b->velocity, i, v, dim);
	}
}

static void closest(const void *self, const quern_body_batch *b) {
	if (b->dim == 2) kernel(2, false, self, b);
	else if (b->feature && is_closed_drum(self)) kernel(3, true, self, b);
	else kernel(3, false, self, b);
}

/* All but the closed drum have one surface without inner edges. */
static uint32_t features(const void *self, const quern_pose *pose, const quern_real x[3], quern_real reach,
	uint32_t cap, int32_t *feature) {
	const cylinder *p = self;
	uint32_t n = 0;
	if (!is_closed_drum(p)) {
		if (cap) feature[0] = 0;
		return 1;
	}
	const surface_pose at = surface_pose_of(pose);
	const quern_vec d = quern_vec_sub(surface_inward(&at, QUERN_VEC_OF(x)), QUERN_VEC_OF(p->centre));
	const quern_vec axis = QUERN_VEC_OF(p->axis);
	const quern_real h = quern_vec_dot(d, axis, 3);
	const seen s = look(3, d, axis, QUERN_VEC_OF(p->aside), p->radius, p->half);
	const quern_real distance[FACES] = { -s.past, p->half + h, p->half - h };
	for (int32_t f = 0; f < FACES; f++) {
		if (!(distance[f] < reach)) continue;
		if (n < cap) feature[n] = f;
		n++;
	}
	return n;
}

/* Without ends it goes on wherever the axis has a part. */
static void bounds(const void *self, uint32_t dim, quern_real lower[3], quern_real upper[3]) {
	const cylinder *p = self;
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real a = dim == 3 ? p->axis[k] : 0, square = 1 - a * a;
		const quern_real along = a == 0 ? 0 : fabs(a) * p->half;
		const quern_real reach = p->inside ? INFINITY : along + p->radius * sqrt(square > 0 ? square : 0);
		lower[k] = p->centre[k] - reach;
		upper[k] = p->centre[k] + reach;
	}
}

static const quern_body_ops ops = {
	.size = sizeof ops, .closest = closest, .features = features, .bounds = bounds
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "body.cylinder",
	.brief = "A disc in 2-D, a cylinder in 3-D; hollow, a drum.",
	.doc = "In a closed drum a grain may touch the shell and the caps at once.",
	.cite = "Hart 1996, Vis. Comput. 12:527",
	.instance_size = sizeof(cylinder),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
