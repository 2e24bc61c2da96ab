/* SPDX-License-Identifier: MIT */
/* strain.plain - every point is strained by the velocity gradient at its own place */
#include <quern/strain.h>

typedef struct {
	int32_t unused;
} plain;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static const quern_strain_ops ops = { .size = sizeof ops };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "strain.plain",
	.brief = "Every point is strained by the velocity gradient at its own place.",
	.instance_size = sizeof(plain),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
