/* SPDX-License-Identifier: MIT */
/* recipe.frozen - loses a share per second, and counts the steps in a field of its own */
#include "recipe.h"

typedef struct {
	quern_real loss;
} frozen;

static const quern_param params[] = {
	QUERN_PARAM(frozen, loss, "1/s", "Share that goes.", .def = 0.5, .max = 1), QUERN_END_PARAMS
};
static const quern_use uses[] = { { .field = "loaf.kneaded",
									  .unit = "1",
									  .doc = "Steps.",
									  .access = QUERN_UPDATE,
									  .shape = QUERN_SCALAR,
									  .initial = 1 },
	QUERN_END_USES };

static void knead(const void *self, const quern_recipe_batch *b) {
	for (uint32_t i = 0; i < b->n; i++) {
		b->dough[i] -= b->dt * ((const frozen *)self)->loss * b->dough[i];
		b->use[0].real[0][i] += 1;
	}
}

static const quern_recipe_ops ops = { .size = sizeof ops, .knead = knead };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "recipe.frozen",
	.brief = "Half a loaf a second.",
	.instance_size = sizeof(frozen),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "2.0", "MIT");
