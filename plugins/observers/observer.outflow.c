/* SPDX-License-Identifier: MIT */
/* observer.outflow - what has left through open faces of the domain, and what sources have poured. docs/theory/flow.md */
#include "../common/books.h"
#include <quern/observer.h>

typedef struct {
	int32_t face; /* FACE_ALL, or 1 + the number of one */
	uint32_t dim;
} observer;

enum { FACE_ALL };
static const char *const faces[] = { "all", "lower_x", "upper_x", "lower_y", "upper_y", "lower_z", "upper_z",
	NULL };

static const quern_param params[] = {
	QUERN_PARAM(observer, face, "1", "The face that is looked at.", .choices = faces), QUERN_END_PARAMS
};
/* Observers of all faces share what was seen: the mass by face at this observation and at the one before. */
/* clang-format off */
#define FACE_USES(X, P, SET) \
	X(P##_MASS, SET ".mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(P##_MOMENTUM, SET ".momentum", "kg m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(P##_COUNT, SET ".count", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(P##_SEEN, SET ".seen", "kg", QUERN_UPDATE, QUERN_SCALAR, .with = SET ".mass", \
		.doc = "Mass at the last observation.") \
	X(P##_SEEN_BEFORE, SET ".seen_before", "kg", QUERN_UPDATE, QUERN_SCALAR, .with = SET ".mass", \
		.doc = "Mass at the observation before that.")
#define OWN_USES(X) \
	FACE_USES(X, GRAIN, "grain_face") \
	FACE_USES(X, POINT, "point_face") \
	X(GRAINS_POURED, "grain_source.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(GRAINS_WAITING, "grain_source.waiting", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(POINTS_POURED, "point_source.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(POINTS_WAITING, "point_source.waiting", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(SEEN, "total.outflow_seen", "s", QUERN_UPDATE, QUERN_SCALAR, .initial = -1, \
		.doc = "Time of the last observation; -1: there was none.") \
	X(SEEN_BEFORE, "total.outflow_seen_before", "s", QUERN_UPDATE, QUERN_SCALAR, .initial = -1, \
		.doc = "Time of the observation before that.")
/* clang-format on */
QUERN_USE_ENUM(OWN_USES);
static const quern_use uses[] = QUERN_USE_ROWS(OWN_USES);

enum { MASS, RATE, GRAINS, POINTS, COUNT, MOMENTUM, POURED = MOMENTUM + 3, WAITING };
static const quern_output outputs[] = { { .name = "mass", .unit = "kg", .doc = "Has left so far, carried." },
	{ .name = "rate", .unit = "kg/s", .doc = "Left since the last observation, per second; at the first 0." },
	{ .name = "grains", .unit = "kg", .doc = "Of the mass, in grains." },
	{ .name = "points", .unit = "kg", .doc = "Of the mass, in points." },
	{ .name = "count", .unit = "1", .doc = "Grains that have left so far, each by its weight." },
	{ .name = "x", .unit = "kg m/s", .doc = "Momentum along x of what has left." },
	{ .name = "y", .unit = "kg m/s", .doc = "Along y." },
	{ .name = "z", .unit = "kg m/s", .doc = "Along z; 0 in 2-D." },
	{ .name = "poured", .unit = "kg", .doc = "Poured by all sources so far, whatever the face." },
	{ .name = "waiting", .unit = "kg", .doc = "Due at all sources, and without room." }, { .name = NULL } };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	observer *o = self;
	const int32_t face = o->face - 1;
	o->dim = setup->dim;
	if (face < 0 || ((uint32_t)face < 2 * setup->dim && setup->open[face % 2][face / 2])) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, "face",
		"%s is not open in this scene: name it in domain.open, or look at another one", faces[o->face]);
}

/* The first observer at a time takes stock for all. */
static void take_stock(const quern_observer_batch *b) {
	const quern_column *u = b->use;
	for (int row = GRAIN_MASS; row <= POINT_MASS; row += POINT_MASS - GRAIN_MASS)
		for (uint32_t i = 0; u[row].real[0] && i < b->count[row]; i++) {
			u[row + GRAIN_SEEN_BEFORE].real[0][i] = u[row + GRAIN_SEEN].real[0][i];
			u[row + GRAIN_SEEN].real[0][i] = u[row].real[0][i];
		}
	u[SEEN_BEFORE].real[0][0] = u[SEEN].real[0][0];
	u[SEEN].real[0][0] = b->time;
}

/* Of all faces, or of the one that is meant. */
static quern_real sum(const observer *o, const quern_real *column) {
	quern_real all = 0;
	for (uint32_t i = 0; column && i < 2 * o->dim; i++)
		if (o->face == FACE_ALL || (uint32_t)o->face - 1 == i) all += column[i];
	return all;
}

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const observer *o = self;
	const quern_column *u = b->use;
	(void)host, (void)run;
	if (b->time != u[SEEN].real[0][0]) take_stock(b);
	const quern_real length = u[SEEN].real[0][0] - u[SEEN_BEFORE].real[0][0];
	const bool again = u[SEEN_BEFORE].real[0][0] >= 0 && length > 0;
	for (int row = GRAIN_MASS; row <= POINT_MASS; row += POINT_MASS - GRAIN_MASS) {
		if (!u[row].real[0]) continue;
		const quern_real mass = sum(o, u[row].real[0]);
		out[row == GRAIN_MASS ? GRAINS : POINTS] = mass;
		out[MASS] += mass;
		if (again)
			out[RATE] +=
				(sum(o, u[row + GRAIN_SEEN].real[0]) - sum(o, u[row + GRAIN_SEEN_BEFORE].real[0])) / length;
		for (uint32_t k = 0; k < o->dim; k++) out[MOMENTUM + k] += sum(o, u[row + GRAIN_MOMENTUM].real[k]);
	}
	out[COUNT] = sum(o, u[GRAIN_COUNT].real[0]);
	for (int row = GRAINS_POURED; row <= POINTS_WAITING; row++)
		out[(row - GRAINS_POURED) % 2 ? WAITING : POURED] += book_total(u[row].real[0], b->count[row]);
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.outflow",
	.brief = "What has left through open faces, and what sources have poured.",
	.doc = "Of one face or of all. A face lets material out where domain.open names it.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
