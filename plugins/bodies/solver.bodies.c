/* SPDX-License-Identifier: MIT */
/* solver.bodies - walls and bodies: who is there, and what impulse each has given to the material */
#include "bodies.h"
#include <string.h>

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
	QUERN_PARAM(body_item, name, NULL, "A word that messages call it by, and observers may: its own.",
		.flags = QUERN_MAYBE),
	QUERN_PARAM(body_item, material, NULL,
		"What it is made of: one of the grains' materials, or a word of its own that stands in grains.pairs.",
		.flags = QUERN_MAYBE),
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

enum { LONGEST_NAME = 40 };

static const char *name_of(const quern_bound *body) { return ((const body_item *)body->item)->name; }

static bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

static bool is_word(const char *name) {
	uint32_t n = 0;
	for (; name[n]; n++)
		if (n == LONGEST_NAME ||
			!(is_letter(name[n]) || (n && (name[n] == '_' || (name[n] >= '0' && name[n] <= '9')))))
			return false;
	return n > 0;
}

/* Names are words of their own, published as the number of the body. */
static quern_status name_body(const quern_setup *setup, const quern_bound *body, uint32_t i, quern_err *err) {
	const char *name = name_of(&body[i]), *dot = strchr(body[i].id, '.');
	char where[120], published[60];
	snprintf(where, sizeof where, "%u.%.60s.name", i, dot ? dot + 1 : body[i].id);
	if (!name) return QUERN_OK;
	if (!is_word(name))
		return setup->host->fail(err, QUERN_E_PARAM, where,
			"'%.60s' is no name: it must be letters, digits and '_', beginning with a letter, at most %d of "
			"them",
			name, LONGEST_NAME);
	for (uint32_t k = 0; k < i; k++)
		if (name_of(&body[k]) && !strcmp(name_of(&body[k]), name))
			return setup->host->fail(
				err, QUERN_E_PARAM, where, "body %u is called '%s' already: give each its own name", k, name);
	snprintf(published, sizeof published, "body.%s", name);
	setup->host->publish(setup, published, "1", i);
	return QUERN_OK;
}

static quern_status ready(void *self, const quern_setup *setup, const quern_bound *const *slot,
	const uint32_t *n_slot, quern_err *err) {
	(void)self;
	setup->host->publish(setup, "bodies.count", "1", n_slot[0]);
	quern_status status = QUERN_OK;
	for (uint32_t i = 0; i < n_slot[0]; i++)
		if (name_body(setup, slot[0], i, err) != QUERN_OK) status = QUERN_E_PARAM;
	return status;
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
