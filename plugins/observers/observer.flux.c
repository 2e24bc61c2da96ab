/* SPDX-License-Identifier: MIT */
/* observer.flux - mass and momentum per second through a plane across an axis, between two observations */
#include "observers.h"
#include "region.h"
#include <quern/space.h>

typedef struct {
	int32_t axis;
	quern_real at;
	observer_region region;         /* of the plane */
	quern_real length[3], lower[3]; /* m, of periodic axes, else 0; of the domain */
} observer;
static const quern_param params[] = { QUERN_PARAM(observer, axis, "1",
										  "Axis that the plane stands across: 0 x, 1 y, 2 z.", .max = 2),
	QUERN_PARAM(observer, at, "m", "Where the plane cuts the axis.", .flags = QUERN_REQUIRED),
	QUERN_PARAM_AS(observer, region.lower, "section.lower", "m",
		"Lower corner of the part of the plane that counts; the number along the axis does not.",
		.flags = QUERN_MAYBE),
	QUERN_PARAM_AS(observer, region.upper, "section.upper", "m", "Upper corner.", .flags = QUERN_MAYBE),
	QUERN_END_PARAMS };
/* Observers of all planes share what was seen: where everything is now, and where it was the time before. */
/* clang-format off */
#define OWN_USES(X) \
	X(GRAIN_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(GRAIN_VELOCITY, "grain.velocity", "m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(POINT_POSITION, "point.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(POINT_VELOCITY, "point.velocity", "m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(GRAIN_SEEN, "grain.seen", "m", QUERN_UPDATE, QUERN_VECTOR, .with = "grain.mass", .initial = INFINITY, \
		.doc = "Position at the last observation; infinite: there was none.") \
	X(GRAIN_SEEN_BEFORE, "grain.seen_before", "m", QUERN_UPDATE, QUERN_VECTOR, .with = "grain.mass", \
		.initial = INFINITY, .doc = "Position at the observation before that.") \
	X(POINT_SEEN, "point.seen", "m", QUERN_UPDATE, QUERN_VECTOR, .with = "point.mass", .initial = INFINITY, \
		.doc = "Position at the last observation; infinite: there was none.") \
	X(POINT_SEEN_BEFORE, "point.seen_before", "m", QUERN_UPDATE, QUERN_VECTOR, .with = "point.mass", \
		.initial = INFINITY, .doc = "Position at the observation before that.") \
	X(SEEN, "total.seen", "s", QUERN_UPDATE, QUERN_SCALAR, .initial = -1, \
		.doc = "Time of the last observation; -1: there was none.") \
	X(SEEN_BEFORE, "total.seen_before", "s", QUERN_UPDATE, QUERN_SCALAR, .initial = -1, \
		.doc = "Time of the observation before that.") \
	X(BOX, "total.box_length", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL)
/* clang-format on */
QUERN_USE_ENUM_FROM(CLOUD_USES_ROWS, OWN_USES);
static const quern_use uses[] = { CLOUD_USES(QUERN_USE_ROW) OWN_USES(QUERN_USE_ROW) QUERN_END_USES };

enum { MASS, MOMENTUM, GRAINS = MOMENTUM + 3, POINTS, COUNT };
static const quern_output outputs[] = {
	{ .name = "mass",
		.unit = "kg/s",
		.doc = "Of both, towards higher coordinates less that towards lower ones." },
	{ .name = "x", .unit = "N", .doc = "Momentum along x that it carries, per second." },
	{ .name = "y", .unit = "N", .doc = "Along y." },
	{ .name = "z", .unit = "N", .doc = "Along z; 0 in 2-D." },
	{ .name = "grains", .unit = "kg/s", .doc = "Of the mass, by grains." },
	{ .name = "points", .unit = "kg/s", .doc = "Of the mass, by points." },
	{ .name = "count", .unit = "1/s", .doc = "Grains per second, with their weights." }, { .name = NULL }
};

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	observer *o = self;
	if ((uint32_t)o->axis >= setup->dim)
		return setup->host->fail(
			err, QUERN_E_PARAM, "axis", "must be less than %u in this scene", setup->dim);
	for (uint32_t k = 0; k < setup->dim; k++) {
		o->length[k] = setup->periodic[k] ? setup->upper[k] - setup->lower[k] : 0;
		o->lower[k] = setup->lower[k];
		if (k == (uint32_t)o->axis || isnan(o->region.lower[k]) || isnan(o->region.upper[k])) continue;
		if (!(o->region.upper[k] > o->region.lower[k]))
			return setup->host->fail(err, QUERN_E_PARAM, "section.upper",
				"must be above the lower corner along the axes of the plane; axis %u is not", k);
	}
	if (o->at >= setup->lower[o->axis] && o->at <= setup->upper[o->axis]) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, "at", "the plane is out of the domain, %.4g to %.4g m",
		setup->lower[o->axis], setup->upper[o->axis]);
}

/* The first observer at a time takes stock for all. */
static void take_stock(const quern_observer_batch *b) {
	static const int rows[2][3] = { { GRAIN_POSITION, GRAIN_SEEN, GRAIN_SEEN_BEFORE },
		{ POINT_POSITION, POINT_SEEN, POINT_SEEN_BEFORE } };
	const quern_column *u = b->use;
	for (int c = 0; c < 2; c++)
		for (uint32_t k = 0; k < b->dim && u[rows[c][0]].real[0] && u[rows[c][1]].real[0]; k++)
			for (uint32_t i = 0; i < b->count[rows[c][0]]; i++) {
				u[rows[c][2]].real[k][i] = u[rows[c][1]].real[k][i];
				u[rows[c][1]].real[k][i] = u[rows[c][0]].real[k][i];
			}
	u[SEEN_BEFORE].real[0][0] = u[SEEN].real[0][0];
	u[SEEN].real[0][0] = b->time;
}

/* 1 or -1 if entry i has gone through the plane on the straight, and through its section; 0 otherwise. Through a periodic
 * face the shorter way is taken, and the plane is at every period. */
static int crossed(
	const observer *o, quern_real *const *from, quern_real *const *to, uint32_t i, uint32_t dim) {
	quern_real way[3] = { 0 };
	for (uint32_t k = 0; k < dim; k++) {
		if (!isfinite(from[k][i])) return 0;
		way[k] = to[k][i] - from[k][i];
		way[k] = quern_image_far(way[k], o->length[k]);
	}
	const uint32_t a = (uint32_t)o->axis;
	const quern_real period = o->length[a], x = from[a][i], y = x + way[a];
	const quern_real shift = period > 0 ? period * floor((0.5 * (x + y) - o->at) / period + 0.5) : 0;
	const quern_real at = o->at + shift; /* the nearest of the planes */
	const int side = (y >= at) - (x >= at);
	for (uint32_t k = 0; k < dim && side; k++) {
		quern_real there = from[k][i] + way[k] * ((at - x) / way[a]);
		if (k == a) continue;
		if (o->length[k] > 0) there -= o->length[k] * floor((there - o->lower[k]) / o->length[k]);
		if (there < o->region.lower[k] || there >= o->region.upper[k]) return 0;
	}
	return side;
}

static bool flow(const observer *o, const quern_observer_batch *b, bool point, quern_real *out,
	const quern_host *host, quern_run *run) {
	const quern_column *u = b->use, *v = &u[point ? POINT_VELOCITY : GRAIN_VELOCITY];
	quern_real *const *from = u[point ? POINT_SEEN_BEFORE : GRAIN_SEEN_BEFORE].real;
	quern_real *const *to = u[point ? POINT_SEEN : GRAIN_SEEN].real;
	const cloud c = observed(b, point);
	cloud_sums s;
	if (!cloud_open(&s, host, run, &c)) return false;
	const quern_real length = u[SEEN].real[0][0] - u[SEEN_BEFORE].real[0][0];
	if (!(u[SEEN_BEFORE].real[0][0] >= 0 && length > 0) || !c.n || !from[0]) return true;
	for (uint32_t i = 0; i < c.n; i++) s.mass[i] *= crossed(o, from, to, i, b->dim) / length;
	const quern_real mass = cloud_total(&s);
	out[MASS] += mass;
	out[point ? POINTS : GRAINS] = mass;
	for (uint32_t k = 0; k < b->dim; k++) CLOUD_ADD(&s, i, v->real[k][i], out[MOMENTUM + k]);
	if (!point) CLOUD_ADD(&s, i, 1 / c.mass[i], out[COUNT]);
	return true;
}

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	if (refuse_box(&b->use[BOX], "observer.flux", host, run) != QUERN_OK) return QUERN_E_PARAM;
	const observer *o = self;
	if (b->time != b->use[SEEN].real[0][0]) take_stock(b);
	return flow(o, b, false, out, host, run) && flow(o, b, true, out, host, run) ? QUERN_OK : QUERN_E_MEMORY;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.flux",
	.brief = "Mass and momentum per second through a plane.",
	.doc = "Net, from where everything was at the last observation: what went through and came back does not "
		   "count.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
