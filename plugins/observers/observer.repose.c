/* SPDX-License-Identifier: MIT */
/* observer.repose - the slope of the free surface along an axis, by least squares over the tops of columns */
#include "../common/height.h"
#include "observers.h"
#include "region.h"
#include <quern/math.h>

typedef struct {
	int32_t axis;
	quern_real from, to, width, diameter, cell;
	quern_real lower[3], upper[3]; /* m, of the domain, or of the span along its axis */
	quern_real length[3];          /* m, of the domain along periodic axes, else 0 */
} observer;
static const quern_param params[] = {
	QUERN_PARAM(observer, axis, "1", "Axis along which the surface falls or rises: 0 x, 1 y, 2 z.", .max = 2),
	QUERN_PARAM(
		observer, from, "m", "Where the span begins; default: with the domain.", .flags = QUERN_MAYBE),
	QUERN_PARAM(observer, to, "m", "Where it ends.", .flags = QUERN_MAYBE),
	QUERN_PARAM(observer, width, "m",
		"Of a column, whose highest grain or point is its top; default: 2 diameters, or a cell without "
		"grains.",
		.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(observer, diameter, "m", "Mean diameter of the grains.", .from = "grain.diameter",
		.flags = QUERN_MAYBE | QUERN_ADVANCED),
	QUERN_PARAM(
		observer, cell, "m", "Cell of the grid.", .from = "grid.cell", .flags = QUERN_MAYBE | QUERN_ADVANCED),
	QUERN_END_PARAMS
};
/* clang-format off */
#define OWN_USES(X) \
	X(GRAIN_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(GRAIN_RADIUS, "grain.radius", "m", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(POINT_POSITION, "point.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(POINT_VOLUME, "point.volume", "m^3", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(BOX, "total.box_length", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL)
/* clang-format on */
QUERN_USE_ENUM_FROM(CLOUD_USES_ROWS, OWN_USES);
static const quern_use uses[] = { CLOUD_USES(QUERN_USE_ROW) OWN_USES(QUERN_USE_ROW) QUERN_END_USES };

enum { ANGLE, RISE, ROUGHNESS, COLUMNS };
static const quern_output outputs[] = {
	{ .name = "angle",
		.unit = "rad",
		.doc = "Of the surface to the horizontal, above 0 where it rises along the axis." },
	{ .name = "middle",
		.unit = "m",
		.doc = "Height of the fitted line in the middle of its columns, against gravity." },
	{ .name = "roughness", .unit = "m", .doc = "Root of the mean square of tops less line." },
	{ .name = "columns",
		.unit = "1",
		.doc = "Columns with a top; with fewer than two along the axis all else is 0." },
	{ .name = NULL }
};

/* As many columns along an axis as would make sense in a table of all. */
enum { MOST = 1 << 20 };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	observer *o = self;
	if ((uint32_t)o->axis >= setup->dim)
		return setup->host->fail(
			err, QUERN_E_PARAM, "axis", "must be less than %u in this scene", setup->dim);
	if ((uint32_t)o->axis == quern_vertical(setup->dim, setup->gravity))
		return setup->host->fail(err, QUERN_E_PARAM, "axis",
			"gravity is strongest along it: the surface rises across, not along it");
	for (uint32_t k = 0; k < setup->dim; k++) {
		o->lower[k] = setup->lower[k], o->upper[k] = setup->upper[k];
		o->length[k] = setup->periodic[k] ? setup->upper[k] - setup->lower[k] : 0;
	}
	if (!isnan(o->from)) o->lower[o->axis] = o->from;
	if (!isnan(o->to)) o->upper[o->axis] = o->to;
	if (!(o->upper[o->axis] > o->lower[o->axis]))
		return setup->host->fail(err, QUERN_E_PARAM, "to", "the span ends before it begins");
	if (isnan(o->width)) o->width = isnan(o->diameter) ? o->cell : 2 * o->diameter;
	if (isnan(o->width))
		return setup->host->fail(
			err, QUERN_E_PARAM, "width", "must be given: there are neither grains nor a grid");
	quern_real columns = 1;
	for (uint32_t k = 0; k < setup->dim; k++)
		if (k != quern_vertical(setup->dim, setup->gravity))
			columns *= 1 + (o->upper[k] - o->lower[k]) / o->width;
	if (columns <= MOST) return QUERN_OK;
	return setup->host->fail(
		err, QUERN_E_PARAM, "width", "makes %.3g columns of the span, more than %d", columns, (int)MOST);
}

typedef struct column {
	quern_real x, top; /* of the highest; against gravity */
	bool taken;
} column;

typedef struct table {
	column *at;
	uint32_t up, n[3], all; /* along the vertical: 1 */
	bool down;              /* gravity points to higher coordinates */
} table;

static bool make_table(
	const observer *o, const quern_observer_batch *b, const quern_host *host, quern_run *run, table *t) {
	t->up = quern_vertical(b->dim, b->gravity);
	t->down = b->gravity[t->up] > 0;
	t->all = 1;
	for (uint32_t k = 0; k < b->dim; k++) {
		t->n[k] = k == t->up ? 1 : 1 + (uint32_t)((o->upper[k] - o->lower[k]) / o->width);
		t->all *= t->n[k];
	}
	t->at = host->memory(run, t->all * sizeof *t->at);
	return t->at != NULL;
}

/* Half of its mass at least must be there; what is fixed is ground, not surface. */
static void add_tops(const observer *o, const quern_observer_batch *b, bool point, table *t) {
	quern_real *const *x = b->use[point ? POINT_POSITION : GRAIN_POSITION].real;
	const quern_real *size = b->use[point ? POINT_VOLUME : GRAIN_RADIUS].real[0];
	const cloud c = observed(b, point);
	for (uint32_t i = 0; i < c.n; i++) {
		uint32_t place = 0;
		quern_real at[3] = { 0 };
		bool in = cloud_mass(&c, i) >= 0.5 * c.mass[i];
		for (uint32_t k = b->dim; k-- > 0 && in;) {
			if (k == t->up) continue;
			at[k] = region_image(x[k][i], o->lower[k], o->upper[k], o->length[k]);
			in = at[k] >= o->lower[k] && at[k] < o->upper[k];
			if (in) place = place * t->n[k] + (uint32_t)((at[k] - o->lower[k]) / o->width);
		}
		if (!in) continue;
		const quern_real half =
			!point ? size[i] : 0.5 * (b->dim == 2 ? __builtin_sqrt(size[i]) : quern_cbrt(size[i]));
		const quern_real top =
			(t->down ? b->upper[t->up] - x[t->up][i] : x[t->up][i] - b->lower[t->up]) + half;
		const column *old =
			&t->at[place]; /* of equals the one with the lower coordinate, whatever the order */
		if (old->taken && (top < old->top || (top == old->top && at[o->axis] >= old->x))) continue;
		t->at[place] = (column) { at[o->axis], top, true };
	}
}

/* The line through the middle of all tops. */
static void fit(const table *t, quern_real *out) {
	quern_real n = 0, x = 0, y = 0, xx = 0, xy = 0, rest = 0;
	for (uint32_t k = 0; k < t->all; k++)
		if (t->at[k].taken) n++, x += t->at[k].x, y += t->at[k].top;
	out[COLUMNS] = n;
	if (!(n > 0)) return;
	x /= n, y /= n;
	for (uint32_t k = 0; k < t->all; k++)
		if (t->at[k].taken) {
			const quern_real d = t->at[k].x - x;
			xx += d * d;
			xy += d * (t->at[k].top - y);
		}
	if (!(xx > 0)) return;
	for (uint32_t k = 0; k < t->all; k++)
		if (t->at[k].taken) {
			const quern_real off = t->at[k].top - y - xy / xx * (t->at[k].x - x);
			rest += off * off;
		}
	out[ANGLE] = quern_atan2(xy, xx);
	out[RISE] = y;
	out[ROUGHNESS] = __builtin_sqrt(rest / n);
}

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	table t;
	if (refuse_box(&b->use[BOX], "observer.repose", host, run) != QUERN_OK) return QUERN_E_PARAM;
	if (!make_table(self, b, host, run, &t)) return QUERN_E_MEMORY;
	add_tops(self, b, false, &t);
	add_tops(self, b, true, &t);
	fit(&t, out);
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 2,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.repose",
	.brief = "The slope of the free surface along an axis.",
	.doc = "A line by least squares through the tops of columns. A grain in flight is its column's top: look "
		   "when all is "
		   "at rest.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
