/* SPDX-License-Identifier: MIT */
/* observer.wall_torque - the mean torque of the material on a body, between two observations. docs/theory/bodies.md,
 * section 3 */
#include "observers.h"
#include <math.h>
#include <quern/observer.h>

typedef struct {
	int32_t body;
	quern_real bodies; /* there are */
} observer;
static const quern_param params[] = { QUERN_PARAM(observer, body, "1",
										  "Name of the body, or its number in the scene's list, from 0.",
										  .text = "body", .max = 1e6),
	QUERN_PARAM(observer, bodies, "1", "Bodies that there are.", .from = "bodies.count",
		.flags = QUERN_MAYBE | QUERN_ADVANCED, .max = 1e6),
	QUERN_END_PARAMS };
/* clang-format off */
#define USES(X) \
	X(TWIST, "body.twist", "N m s", QUERN_READ, QUERN_AXIAL, \
		.doc = "Moment about its pivot of what the body has given since the release.") \
	X(BEFORE, "body.twist_before", "N m s", QUERN_UPDATE, QUERN_AXIAL, .doc = "The same, at the last observation.") \
	X(SINCE, "body.twist_observed", "s", QUERN_UPDATE, QUERN_SCALAR, .doc = "Time of the last observation.") \
	X(TORQUE, "body.torque", "N m", QUERN_UPDATE, QUERN_AXIAL, \
		.doc = "Mean torque of the material between the last two observations.") \
	X(WORK, "body.work", "J", QUERN_READ, QUERN_SCALAR, .doc = "Done on the material since the release.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);
static const quern_output outputs[] = { { .name = "x", .unit = "N m", .doc = "About x; 0 in 2-D." },
	{ .name = "y", .unit = "N m", .doc = "About y; 0 in 2-D." },
	{ .name = "z", .unit = "N m", .doc = "About z." },
	{ .name = "work", .unit = "J", .doc = "Done by the body on the material so far." }, { .name = NULL } };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	const observer *o = self;
	if (isnan(o->bodies) || o->body < o->bodies) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, "body",
		"there is no body %d; the scene has %.0f, counted from 0", o->body, o->bodies);
}

/* Several observers may look at one body: the first of them at a time takes stock, and all say the same. */
static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const observer *o = self;
	const quern_column *u = b->use;
	const uint32_t i = (uint32_t)o->body, turns = b->dim == 3 ? 3 : 1;
	if (i >= b->count[TWIST])
		return host->stop(run, QUERN_E_PARAM, NULL, -1,
			"wall_torque: there is no body %d; the scene has %u, counted from 0", o->body, b->count[TWIST]);
	const quern_real length = b->time - u[SINCE].real[0][i];
	for (uint32_t k = 0; k < turns && length > 0; k++) {
		u[TORQUE].real[k][i] = (u[BEFORE].real[k][i] - u[TWIST].real[k][i]) / length;
		u[BEFORE].real[k][i] = u[TWIST].real[k][i];
	}
	if (length > 0) u[SINCE].real[0][i] = b->time;
	for (uint32_t k = 0; k < turns; k++) out[b->dim == 3 ? k : 2] = u[TORQUE].real[k][i];
	out[3] = u[WORK].real[0][i];
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.wall_torque",
	.brief = "The mean torque on a body since the last observation, and the work that it does.",
	.doc = "About motion.about of the body, or its middle, or where it has none the scene's origin.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
