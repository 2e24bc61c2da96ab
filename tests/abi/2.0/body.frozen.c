/* SPDX-License-Identifier: MIT */
/* body.frozen - the half-space below a height along the last axis */
#include <quern/body.h>

typedef struct {
	quern_real height;
} frozen;

static const quern_param params[] = {
	QUERN_PARAM(frozen, height, "m", "Of its surface.", .min = -1e6, .max = 1e6), QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

static void closest(const void *self, const quern_body_batch *b) {
	const uint32_t up = b->dim - 1;
	for (uint32_t i = 0; i < b->n; i++) {
		b->gap[i] = b->position[up][i] - ((const frozen *)self)->height - b->radius[i];
		for (uint32_t k = 0; k < b->dim; k++) b->normal[k][i] = k == up, b->velocity[k][i] = 0;
	}
}

static void bounds(const void *self, uint32_t dim, quern_real lower[3], quern_real upper[3]) {
	for (uint32_t k = 0; k < dim; k++) {
		lower[k] = -__builtin_inf();
		upper[k] = k == dim - 1 ? ((const frozen *)self)->height : __builtin_inf();
	}
}

static const quern_body_ops ops = { .size = sizeof ops, .closest = closest, .bounds = bounds };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "body.frozen",
	.brief = "A floor.",
	.instance_size = sizeof(frozen),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "2.0", "MIT");
