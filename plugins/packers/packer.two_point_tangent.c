/* SPDX-License-Identifier: MIT */
/* packer.two_point_tangent - grains that touch two others, in 3-D three; a wall counts as one.
 * docs/theory/packers.md, section 3 */
#include "tangent.h"

typedef struct {
	int32_t trials, angles;
} two_point_tangent;

static const quern_param params[] = { QUERN_PARAM(two_point_tangent, trials, "1",
										  "Darts for the first grain of a region that would stay empty.",
										  .def = 20, .min = 1, .max = 100000),
	QUERN_PARAM(two_point_tangent, angles, "1", "Places tried around a grain that has too few neighbours.",
		.def = 36, .min = 3, .max = 100000),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static void pack(const void *self, quern_pack_job *job) {
	const two_point_tangent *t = self;
	packing p;
	begin(&p, job, t->trials, t->angles);
	pack_tangent(&p);
}

static const quern_packer_ops ops = { .size = sizeof ops, .pack = { pack, pack } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "packer.two_point_tangent",
	.brief = "Grains that touch two others, in 3-D three: nearly as dense as grains at rest.",
	.doc = "Grows the region from the grains in and around it. A grain with too few neighbours first gets "
		   "one at `angles` places around it; a dart is thrown only where a region would stay empty.",
	.cite = "Chantharayukhonthorn 2019, section 6.2.4",
	.instance_size = sizeof(two_point_tangent),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
