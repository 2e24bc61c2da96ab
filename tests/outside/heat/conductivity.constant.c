/* SPDX-License-Identifier: MIT */
/* conductivity.constant - the same at any temperature */
#include "conductivity.h"

typedef struct {
	quern_real value;
} constant;
static const quern_param params[] = {
	QUERN_PARAM(constant, value, "W/(m K)", "Conductivity.", .def = 0.3, .max = 1e6), QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

static void conductivity(const void *self, const conductivity_batch *b) {
	const quern_real value = ((const constant *)self)->value;
	quern_real *restrict out = b->conductivity;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) out[i] = value;
}

static const conductivity_ops ops = { .size = sizeof ops, .conductivity = conductivity };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "conductivity.constant",
	.brief = "One conductivity for all temperatures.",
	.instance_size = sizeof(constant),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
