/* SPDX-License-Identifier: MIT */
/* conductivity.linear - k = k0 (1 + b (T - T0)), and never less than nothing */
#include "conductivity.h"
#include <quern/math.h>

typedef struct {
	quern_real value, slope, reference;
} linear;
static const quern_param params[] = { QUERN_PARAM(linear, value, "W/(m K)",
										  "Conductivity at the reference temperature.", .def = 0.3,
										  .max = 1e6),
	QUERN_PARAM(linear, slope, "1/K", "Relative change with temperature.", .def = 1e-3, .min = -1, .max = 1),
	QUERN_PARAM(
		linear, reference, "K", "The temperature at which it has its value.", .def = 293.15, .max = 1e5),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static void conductivity(const void *self, const conductivity_batch *b) {
	const linear p = *(const linear *)self;
	const quern_real *restrict temperature = b->temperature;
	quern_real *restrict out = b->conductivity;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++)
		out[i] = p.value * quern_max(0, 1 + p.slope * (temperature[i] - p.reference));
}

static const conductivity_ops ops = { .size = sizeof ops, .conductivity = conductivity };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "conductivity.linear",
	.brief = "A conductivity that rises or falls with temperature.",
	.instance_size = sizeof(linear),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
