/* SPDX-License-Identifier: MIT */
/* wall - the body that an observer looks at, and rates of what it has given between two observations */
#pragma once
#include <math.h>
#include <quern/observer.h>

typedef struct observed_wall {
	int32_t body;
	quern_real bodies; /* there are */
} observed_wall;

static const quern_param wall_params[] = { QUERN_PARAM(observed_wall, body, "1",
											   "Name of the body, or its number in the scene's list, from 0.",
											   .text = "body", .max = 1e6),
	QUERN_PARAM(observed_wall, bodies, "1", "Bodies that there are.", .from = "bodies.count",
		.flags = QUERN_MAYBE | QUERN_ADVANCED, .max = 1e6),
	QUERN_END_PARAMS };

static inline quern_status wall_init(void *self, const quern_setup *setup, quern_err *err) {
	const observed_wall *o = self;
	if (isnan(o->bodies) || o->body < o->bodies) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, "body",
		"there is no body %d; the scene has %.0f, counted from 0", o->body, o->bodies);
}

/* Rows, one after the other: what the body has given, that at the last observation, the time of that, and the rate since, with
 * the other sign. Several observers may look at one body: the first of them at a time takes stock, and all say the same. Returns
 * the body, or -1 with the run stopped if there is none. */
static inline int32_t wall_take_stock(const void *self, const quern_observer_batch *b, uint32_t components,
	const quern_host *host, quern_run *run) {
	enum { GIVEN, BEFORE, SINCE, RATE };
	const quern_column *u = b->use;
	const int32_t i = ((const observed_wall *)self)->body;
	if ((uint32_t)i >= b->count[GIVEN]) {
		host->stop(run, QUERN_E_PARAM, NULL, -1, "there is no body %d; the scene has %u, counted from 0", i,
			b->count[GIVEN]);
		return -1;
	}
	const quern_real length = b->time - u[SINCE].real[0][i];
	for (uint32_t k = 0; k < components && length > 0; k++) {
		u[RATE].real[k][i] = (u[BEFORE].real[k][i] - u[GIVEN].real[k][i]) / length;
		u[BEFORE].real[k][i] = u[GIVEN].real[k][i];
	}
	if (length > 0) u[SINCE].real[0][i] = b->time;
	return i;
}
