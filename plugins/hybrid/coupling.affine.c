/* SPDX-License-Identifier: MIT */
/* coupling.affine - the same exchange of momentum at each node, between clouds that send v + L (x_i - x): so both speak
 * of the velocity at the node, and strain rates and rotations pass unchanged. docs/theory/hybrid.md, section 2 */
#include "exchange.h"
#include <quern/coupling.h>

typedef struct {
	int32_t unused;
} coupling;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { { .field = "point.affine",
									  .unit = "1/s",
									  .doc = "Velocity gradient of the last step, sent with the velocity.",
									  .access = QUERN_READ,
									  .shape = QUERN_TENSOR },
	QUERN_END_USES };

static void couple(const void *self, const quern_coupling_job *job) { (void)self, exchange(job); }

static const quern_coupling_ops ops = { .size = sizeof ops, .affine = 1, .couple = couple };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "coupling.affine",
	.brief = "An exchange between velocities at the same place.",
	.doc = "Exact for uniform motion, uniform strain rate and rigid rotation.",
	.instance_size = sizeof(coupling),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
