/* SPDX-License-Identifier: MIT */
/* observer.runout - how far and how high the material lies, by quantiles of the connected mass */
#include "../common/height.h"
#include "observers.h"
#include <math.h>
#include <quern/observer.h>
#include <stdlib.h>

typedef struct {
	int32_t axis;
	quern_real origin, quantile, gap, diameter;
} observer;
static const quern_param params[] = { QUERN_PARAM(observer, axis, "1", "Axis of the run-out: 0 x, 1 y, 2 z.",
										  .max = 2),
	QUERN_PARAM(observer, origin, "m", "Where the run-out begins."),
	QUERN_PARAM(observer, quantile, "1", "Share of the connected mass that front and height enclose.",
		.def = 0.99, .min = 0, .max = 1, .flags = QUERN_MIN_OPEN),
	QUERN_PARAM(observer, gap, "m",
		"Mass is connected while no wider gap along the axis separates it; default: 3 diameters.",
		.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(observer, diameter, "m", "Mean diameter of the grains.", .from = "grain.diameter",
		.flags = QUERN_MAYBE | QUERN_ADVANCED),
	QUERN_END_PARAMS };
/* clang-format off */
#define OWN_USES(X) \
	X(GRAIN_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(POINT_POSITION, "point.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL)
/* clang-format on */
QUERN_USE_ENUM_FROM(CLOUD_USES_ROWS, OWN_USES);
static const quern_use uses[] = { CLOUD_USES(QUERN_USE_ROW) OWN_USES(QUERN_USE_ROW) QUERN_END_USES };
static const quern_output outputs[] = {
	{ .name = "front", .unit = "m", .doc = "Quantile of the connected mass, from the origin." },
	{ .name = "height",
		.unit = "m",
		.doc = "Quantile of the connected mass against gravity, from the domain's lower end." },
	{ .name = "foremost", .unit = "m", .doc = "The farthest grain or point, from the origin." },
	{ .name = "connected", .unit = "1", .doc = "Connected mass over all mass." }, { .name = NULL }
};

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	observer *o = self;
	if ((uint32_t)o->axis >= setup->dim)
		return setup->host->fail(
			err, QUERN_E_PARAM, "axis", "must be less than %u in this scene", setup->dim);
	if (isnan(o->gap)) o->gap = isnan(o->diameter) ? INFINITY : 3 * o->diameter;
	return QUERN_OK;
}

typedef struct {
	quern_real along, up, mass;
	uint32_t number;
} item;

static int order(quern_real a, quern_real b, uint32_t i, uint32_t j) {
	if (a != b) return a < b ? -1 : 1;
	return i < j ? -1 : i > j;
}
static int by_along(const void *a, const void *b) {
	const item *x = a, *y = b;
	return order(x->along, y->along, x->number, y->number);
}
static int by_up(const void *a, const void *b) {
	const item *x = a, *y = b;
	return order(x->up, y->up, x->number, y->number);
}

static uint32_t collect(
	const observer *o, const quern_observer_batch *b, const quern_host *host, quern_run *run, item *out) {
	const uint32_t up = quern_vertical(b->dim, b->gravity);
	const bool down = b->gravity[up] > 0; /* gravity points to higher coordinates */
	uint32_t n = 0;
	for (int point = 0; point < 2; point++) {
		const quern_column *x = &b->use[point ? POINT_POSITION : GRAIN_POSITION];
		const cloud c = observed(b, point);
		const uint32_t *order = c.n ? host->parts(run, c.set)->entry : NULL;
		for (uint32_t q = 0; q < c.n; q++) {
			const uint32_t i = quern_nth(order, q);
			const quern_real m = cloud_mass(&c, i);
			if (!(m > 0)) continue;
			const quern_real h = down ? b->upper[up] - x->real[up][i] : x->real[up][i] - b->lower[up];
			out[n] = (item) { x->real[o->axis][i] - o->origin, h, m, n };
			n++;
		}
	}
	return n;
}

static quern_real quantile(const item *it, uint32_t n, quern_real wanted, bool up) {
	quern_real sum = 0;
	for (uint32_t i = 0; i < n; i++) {
		sum += it[i].mass;
		if (sum >= wanted) return up ? it[i].up : it[i].along;
	}
	return n ? (up ? it[n - 1].up : it[n - 1].along) : 0;
}

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const observer *o = self;
	const size_t most = (size_t)observed(b, false).n + observed(b, true).n;
	item *it = host->memory(run, (most + 1) * sizeof(item));
	quern_real all = 0, mass = 0;
	uint32_t connected = 0;
	if (!it) return QUERN_E_MEMORY;
	const uint32_t n = collect(o, b, host, run, it);
	qsort(it, n, sizeof *it, by_along);
	for (uint32_t i = 0; i < n; i++) {
		const bool next = connected == i && (!i || it[i].along - it[i - 1].along <= o->gap);
		all += it[i].mass;
		if (next) connected++, mass += it[i].mass;
	}
	if (!n) return QUERN_OK;
	out[0] = quantile(it, connected, o->quantile * mass, false);
	out[2] = it[n - 1].along;
	out[3] = mass / all;
	qsort(it, connected, sizeof *it, by_up);
	out[1] = quantile(it, connected, o->quantile * mass, true);
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.runout",
	.brief = "How far and how high the material lies.",
	.doc = "Front and height enclose a share of the connected mass; single grains that ran ahead count in "
		   "`foremost` alone.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
