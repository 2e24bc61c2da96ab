/* SPDX-License-Identifier: MIT */
/* solver.bodies - walls and bodies: who is there, and what impulse each has given to the material */
#include "bodies.h"

typedef struct {
	int32_t unused;
} bodies;

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static const char *const whens[] = { "always", "settling", "running", NULL };
static const char *const boundaries[] = { "slip", "sticky", "none", NULL };
static const quern_param rows[] = { QUERN_PARAM_AS(body_item, when, "while", "1",
										"When it is there; a gate is there while settling.",
										.choices = whens),
	QUERN_PARAM(body_item, boundary, "1", "What it does to the continuum's grid.", .choices = boundaries),
	QUERN_PARAM_AS(body_item, friction, "boundary.frictional", "1",
		"Coulomb friction on the continuum's grid, in place of slip or sticky.", .flags = QUERN_MAYBE,
		.min = 0, .max = 100),
	QUERN_END_PARAMS };

static const quern_set sets[] = {
	{ .name = "body", .plural = "bodies", .doc = "Walls and bodies, in the order of the scene." },
	{ .name = NULL }
};
static const quern_slot slots[] = { { .name = "",
										.kind = &quern_body_kind,
										.doc = "Bodies.",
										.list = 1,
										.stage = { "bodies.place" },
										.override = "grains.contact",
										.rows = rows,
										.item_size = sizeof(body_item) },
	{ .name = NULL } };

static const quern_use place_uses[] = { { .field = "body.impulse",
											.unit = "N s",
											.doc = "Given to the material since the release.",
											.access = QUERN_WRITE,
											.shape = QUERN_VECTOR,
											.flags = QUERN_OPTIONAL },
	QUERN_END_USES };

static quern_status ready(void *self, const quern_setup *setup, const quern_bound *const *slot,
	const uint32_t *n_slot, quern_err *err) {
	(void)self, (void)slot, (void)err;
	setup->host->publish(setup, "bodies.count", "1", n_slot[0]);
	return QUERN_OK;
}

static quern_status place(const void *self, const quern_step *s) {
	const uint32_t n = s->n_slot[0];
	int32_t *from = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	(void)self;
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) from[i] = -1;
	return s->host->remap(s->run, "body", n, from, 0, NULL);
}

static const quern_stage stages[] = { { .name = "bodies.place",
										  .doc = "One entry per body.",
										  .phase = QUERN_SETUP,
										  .uses = place_uses,
										  .run = place },
	{ .name = NULL } };

static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "bodies", .sets = sets, .slots = slots,
	.stages = stages, .ready = ready };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "solver.bodies",
	.brief = "Walls and bodies.",
	.doc = "Owns the set of bodies; grains and continuum look at the same ones.",
	.instance_size = sizeof(bodies),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
