/* SPDX-License-Identifier: MIT */
/* observer.wall_force - the mean force of the material on a body, between two observations */
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
	X(IMPULSE, "body.impulse", "N s", QUERN_READ, QUERN_VECTOR, .doc = "Given to the material since the release.") \
	X(BEFORE, "body.impulse_before", "N s", QUERN_UPDATE, QUERN_VECTOR, .doc = "The same, at the last observation.") \
	X(SINCE, "body.observed", "s", QUERN_UPDATE, QUERN_SCALAR, .doc = "Time of the last observation.") \
	X(FORCE, "body.force", "N", QUERN_UPDATE, QUERN_VECTOR, \
		.doc = "Mean force of the material between the last two observations.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);
static const quern_output outputs[] = { { .name = "x", .unit = "N", .doc = "Along x." },
	{ .name = "y", .unit = "N", .doc = "Along y." },
	{ .name = "z", .unit = "N", .doc = "Along z; 0 in 2-D." }, { .name = NULL } };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	const observer *o = self;
	if (isnan(o->bodies)) return QUERN_OK;
	if (o->body < o->bodies) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, "body",
		"there is no body %d; the scene has %.0f, counted from 0", o->body, o->bodies);
}

/* Several observers may look at one body: the first of them at a time takes stock, and all say the same. */
static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const observer *o = self;
	const quern_column *u = b->use;
	const uint32_t i = (uint32_t)o->body;
	if (i >= b->count[IMPULSE])
		return host->stop(run, QUERN_E_PARAM, NULL, -1,
			"wall_force: there is no body %d; the scene has %u, counted from 0", o->body, b->count[IMPULSE]);
	const quern_real length = b->time - u[SINCE].real[0][i];
	for (uint32_t k = 0; k < b->dim && length > 0; k++) {
		u[FORCE].real[k][i] = (u[BEFORE].real[k][i] - u[IMPULSE].real[k][i]) / length;
		u[BEFORE].real[k][i] = u[IMPULSE].real[k][i];
	}
	if (length > 0) u[SINCE].real[0][i] = b->time;
	for (uint32_t k = 0; k < b->dim; k++) out[k] = u[FORCE].real[k][i];
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.wall_force",
	.brief = "The mean force on a body since the last observation.",
	.doc = "From the impulses that grains and continuum have exchanged with it, so that no peak is missed.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
