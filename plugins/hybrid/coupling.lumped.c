/* SPDX-License-Identifier: MIT */
/* coupling.lumped - an inelastic exchange of momentum at each node. docs/theory/hybrid.md, section 2 */
#include "exchange.h"
#include <quern/coupling.h>

typedef struct {
	int32_t unused;
} coupling;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static void couple(const void *self, const quern_coupling_job *job) { (void)self, exchange(job); }

static const quern_coupling_ops ops = { .size = sizeof ops, .affine = 0, .couple = couple };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "coupling.lumped",
	.brief = "An inelastic collision at each node.",
	.doc = "Exact for uniform motion alone: under a strain rate or a rotation it changes grains by up to "
		   "0.15 |L| h.",
	.cite = "Yue et al. 2018",
	.instance_size = sizeof(coupling),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
