/* SPDX-License-Identifier: MIT */
/* solver.frozen - a bakery: two sets, a list of recipes that fills a slot twice, stages in three phases, sums, a limit */
#include "recipe.h"
#include <quern/solver.h>

typedef struct {
	int32_t loaves;
	quern_real dough;
} bakery;
typedef struct {
	quern_real times;
} entry;

static const quern_param params[] = { QUERN_PARAM(
										  bakery, loaves, "1", "How many.", .def = 100, .min = 1, .max = 1e6),
	QUERN_PARAM(bakery, dough, "kg", "Of each.", .def = 1, .max = 10), QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_param rows[] = { QUERN_PARAM(entry, times, "1", "How often a step.", .def = 1, .max = 9),
	QUERN_END_PARAMS };
static const quern_set sets[] = {
	{ .name = "loaf", .doc = "Loaves.", .plural = "loaves", .counted = 1, .cost = { 1e-9, 1e-9 } },
	{ .name = "crumb", .doc = "What falls off." }, { .name = NULL }
};
enum { SLOT_RECIPE };
static const quern_slot slots[] = { { .name = "recipe",
										.doc = "what becomes of the dough, one after the other",
										.kind = &quern_recipe_kind,
										.list = 1,
										.def = "frozen",
										.stage = { "bakery.knead" },
										.rows = rows,
										.item_size = sizeof(entry) },
	{ .name = NULL } };

#define DOUGH(access_)                                                                                       \
	{                                                                                                        \
		.field = "loaf.dough", .unit = "kg", .doc = "What is left.", .access = access_,                      \
		.shape = QUERN_SCALAR, .flags = QUERN_SHOWN                                                          \
	}
static const quern_use fill_uses[] = { DOUGH(QUERN_WRITE), QUERN_END_USES };
static const quern_use knead_uses[] = { DOUGH(QUERN_UPDATE), QUERN_END_USES };

static quern_status fill(const void *self, const quern_step *s) {
	const bakery *p = self;
	int32_t *from = s->host->memory(s->run, (size_t)p->loaves * sizeof *from);
	if (!from) return QUERN_E_MEMORY;
	for (int32_t i = 0; i < p->loaves; i++) from[i] = -1;
	if (s->host->remap(s->run, "loaf", (uint32_t)p->loaves, from, 0, NULL) != QUERN_OK) return QUERN_E_MEMORY;
	for (int32_t i = 0; i < p->loaves; i++) s->use[0].real[0][i] = p->dough;
	return QUERN_OK;
}

static quern_status knead(const void *self, const quern_step *s) {
	(void)self;
	for (uint32_t k = 0; k < s->n_slot[SLOT_RECIPE]; k++) {
		const quern_bound *recipe = &s->slot[SLOT_RECIPE][k];
		const quern_recipe_ops *ops = recipe->ops;
		const uint32_t n = s->host->set(s->run, "loaf").n;
		const quern_recipe_batch b = { n, n, s->dt, s->use[0].real[0], recipe->column };
		for (int times = 0; times < (int)((const entry *)recipe->item)->times; times++)
			ops->knead(recipe->self, &b);
	}
	return QUERN_OK;
}

static const quern_stage stages[] = { { .name = "bakery.fill",
										  .doc = "Puts the loaves out.",
										  .phase = QUERN_SETUP,
										  .uses = fill_uses,
										  .run = fill },
	{ .name = "bakery.knead",
		.doc = "Follows the recipes.",
		.phase = QUERN_SUBSTEP,
		.uses = knead_uses,
		.run = knead },
	{ .name = NULL } };

static const quern_output sums[] = { { .name = "dough", .unit = "kg", .doc = "In all loaves." },
	{ .name = "largest", .unit = "kg", .doc = "The largest loaf.", .combine = QUERN_MAX }, { .name = NULL } };

static void account(const void *self, const quern_step *s, quern_real *sum) {
	const uint32_t n = s->host->set(s->run, "loaf").n;
	(void)self;
	sum[0] = s->host->sum(s->run, n, s->use[0].real[0]);
	for (uint32_t i = 0; i < n; i++)
		if (s->use[0].real[0][i] > sum[1]) sum[1] = s->use[0].real[0][i];
}

static quern_real limit(const void *self, const quern_step *s, quern_real *hard, char reason[160]) {
	(void)self;
	const quern_recipe_ops *ops = s->slot[SLOT_RECIPE][0].ops;
	reason[0] = 'p', reason[1] = 0;
	*hard = __builtin_inf();
	return ops->patience ? ops->patience(s->slot[SLOT_RECIPE][0].self) : 1;
}

static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "bakery", .sets = sets, .slots = slots,
	.stages = stages, .sums = sums, .limit = limit, .account = account };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "solver.frozen",
	.brief = "A bakery.",
	.instance_size = sizeof(bakery),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "2.0", "MIT");
