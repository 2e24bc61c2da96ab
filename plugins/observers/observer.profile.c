/* SPDX-License-Identifier: MIT */
/* observer.profile - density, velocity and its scatter in slabs side by side along an axis. docs/observers.md */
#include "observers.h"
#include "region.h"
#include <math.h>
#include <quern/math.h>
#include <quern/space.h>

typedef struct {
	observer_region region;
	int32_t axis, bins;
} observer;
static const quern_param params[] = { QUERN_PARAM(observer, axis, "1",
										  "Axis across which the slabs lie: 0 x, 1 y, 2 z.", .max = 2),
	QUERN_PARAM(observer, bins, "1", "How many slabs, of equal width.", .def = 20, .min = 1, .max = 200),
	REGION_PARAMS(observer, QUERN_MAYBE), QUERN_END_PARAMS };
/* clang-format off */
#define OWN_USES(X) \
	X(GRAIN_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(GRAIN_VELOCITY, "grain.velocity", "m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(GRAIN_RADIUS, "grain.radius", "m", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(POINT_POSITION, "point.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(POINT_VELOCITY, "point.velocity", "m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(POINT_VOLUME, "point.volume", "m^3", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(BOX, "total.box_length", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL)
/* clang-format on */
QUERN_USE_ENUM_FROM(CLOUD_USES_ROWS, OWN_USES);
static const quern_use uses[] = { CLOUD_USES(QUERN_USE_ROW) OWN_USES(QUERN_USE_ROW) QUERN_END_USES };

enum { DENSITY, X, Y, Z, TEMPERATURE, N_OUTPUTS };
static const quern_output outputs[] = {
	{ .name = "density", .unit = "kg/m^3", .doc = "Mass in the slab over its volume, grains and points." },
	{ .name = "x", .unit = "m/s", .doc = "Mean velocity along x, by mass; 0 where the slab is empty." },
	{ .name = "y", .unit = "m/s", .doc = "Along y." },
	{ .name = "z", .unit = "m/s", .doc = "Along z; 0 in 2-D." },
	{ .name = "temperature",
		.unit = "m^2/s^2",
		.doc = "Mean square of v less the slab's mean, over the dimensions, by mass." },
	{ .name = NULL }
};

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	observer *o = self;
	if ((uint32_t)o->axis >= setup->dim)
		return setup->host->fail(
			err, QUERN_E_PARAM, "axis", "must be less than %u in this scene", setup->dim);
	return region_init_wide(&o->region, setup, err);
}

/* The share of a disc, a sphere or a cube of half a width `size` that is below t, from -1 to 1 of it. */
QUERN_INLINE quern_real below(quern_real t, bool round, uint32_t dim) {
	const quern_real at = quern_clamp(t, -1, 1);
	if (!round) return 0.5 * (1 + at);
	if (dim == 3) return 0.25 * (2 + 3 * at - at * at * at);
	return 0.5 + (at * __builtin_sqrt(1 - at * at) + quern_asin(at)) * 0.3183098861837907;
}

typedef struct {
	const observer *o;
	uint32_t dim;
	quern_real low, width; /* m, of the slabs */
	quern_real (*bin)[N_OUTPUTS];
	bool again; /* means are known: what differs from them is summed up */
} slabs;

/* A part of an entry's mass joins a slab. */
static void join(const slabs *s, int64_t k, quern_real mass, quern_real *const *v, uint32_t i) {
	quern_real *bin = s->bin[k];
	for (uint32_t c = 0; c < s->dim; c++) {
		const quern_real off = v[c][i] - bin[X + c];
		if (s->again) bin[TEMPERATURE] += mass * off * off;
		else bin[X + c] += mass * v[c][i];
	}
	if (!s->again) bin[DENSITY] += mass;
}

/* An entry, as it stands at `x` along the axis, and what of it reaches through a periodic face. */
static void share_out(const slabs *s, quern_real x, quern_real size, bool round, quern_real mass,
	quern_real *const *v, uint32_t i) {
	const quern_real length = s->o->region.length[s->o->axis];
	for (int image = length > 0 ? -1 : 0; image <= (length > 0 ? 1 : 0); image++) {
		const quern_real at = x + image * length;
		const int64_t from = (int64_t)floor((at - size - s->low) / s->width),
					  to = (int64_t)floor((at + size - s->low) / s->width);
		for (int64_t k = from < 0 ? 0 : from; k <= to && k < s->o->bins; k++) {
			const quern_real lower = s->low + (quern_real)k * s->width;
			const quern_real part = below((lower + s->width - at) / size, round, s->dim) -
									below((lower - at) / size, round, s->dim);
			if (part > 0) join(s, k, part * mass, v, i);
		}
	}
}

/* Where an entry stands. */
static quern_real place_of(const observer *o, quern_real *const *x, uint32_t i, uint32_t k) {
	const observer_region *r = &o->region;
	return region_image(x[k][i], r->low[k], r->high[k], r->length[k]);
}

/* Across the slabs an entry counts if its centre is in the region; along the axis with what of it is in each. */
static bool is_beside(const observer *o, quern_real *const *x, uint32_t i, uint32_t dim) {
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real at = place_of(o, x, i, k);
		if (k != (uint32_t)o->axis && !(at >= o->region.low[k] && at <= o->region.high[k])) return false;
	}
	return true;
}

/* `order`: of the entries. */
static void add_all(const slabs *s, const cloud *c, const uint32_t *order, const quern_column *x,
	const quern_column *v, const quern_real *radius, const quern_real *volume) {
	for (uint32_t q = 0; q < c->n; q++) {
		const uint32_t i = quern_nth(order, q);
		const quern_real mass = cloud_mass(c, i);
		if (!(mass > 0) || !is_beside(s->o, x->real, i, s->dim)) continue;
		const quern_real size =
			radius ? radius[i] : 0.5 * (s->dim == 2 ? __builtin_sqrt(volume[i]) : quern_cbrt(volume[i]));
		if (size > 0)
			share_out(
				s, place_of(s->o, x->real, i, (uint32_t)s->o->axis), size, radius != NULL, mass, v->real, i);
	}
}

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	if (refuse_box(&b->use[BOX], "observer.profile", host, run) != QUERN_OK) return QUERN_E_PARAM;
	const observer *o = self;
	const quern_column *u = b->use;
	const cloud grains = observed(b, false), points = observed(b, true);
	const uint32_t axis = (uint32_t)o->axis;
	slabs s = { o, b->dim, o->region.low[axis], (o->region.high[axis] - o->region.low[axis]) / o->bins,
		(quern_real(*)[N_OUTPUTS])(void *)out, false };
	quern_real volume = s.width;
	const uint32_t *grain = grains.n ? host->parts(run, grains.set)->entry : NULL,
				   *point = points.n ? host->parts(run, points.set)->entry : NULL;
	for (uint32_t k = 0; k < b->dim; k++)
		if (k != axis) volume *= o->region.high[k] - o->region.low[k];
	for (int pass = 0; pass < 2; pass++) {
		s.again = pass;
		add_all(&s, &grains, grain, &u[GRAIN_POSITION], &u[GRAIN_VELOCITY], u[GRAIN_RADIUS].real[0], NULL);
		add_all(&s, &points, point, &u[POINT_POSITION], &u[POINT_VELOCITY], NULL, u[POINT_VOLUME].real[0]);
		for (int32_t k = 0; k < o->bins && !pass; k++)
			for (uint32_t c = X; c <= Z; c++)
				s.bin[k][c] = s.bin[k][DENSITY] > 0 ? s.bin[k][c] / s.bin[k][DENSITY] : 0;
	}
	for (int32_t k = 0; k < o->bins; k++) {
		if (s.bin[k][DENSITY] > 0) s.bin[k][TEMPERATURE] /= s.bin[k][DENSITY] * b->dim;
		s.bin[k][DENSITY] /= volume;
	}
	return QUERN_OK;
}

static uint32_t repeat(const void *self) { return (uint32_t)((const observer *)self)->bins; }

static const quern_observer_ops ops = { .size = sizeof ops,
	.output_size = sizeof(quern_output),
	.outputs = outputs,
	.whole = whole,
	.repeat = repeat };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.profile",
	.brief = "Density, velocity and its scatter in slabs along an axis.",
	.doc = "A grain that two slabs cut counts in each with what of it is inside, a point as a cube of its "
		   "volume. Fixed grains do "
		   "not count.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
