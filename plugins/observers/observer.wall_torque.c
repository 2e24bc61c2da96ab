/* SPDX-License-Identifier: MIT */
/* observer.wall_torque - the mean torque of the material on a body, between two observations. docs/theory/bodies.md,
 * section 3 */
#include "wall.h"

/* clang-format off */
#define USES(X) \
	X(TWIST, "body.twist", "N m s", QUERN_READ, QUERN_AXIAL, \
		.doc = "Moment about its pivot of what the body has given since the release.") \
	X(BEFORE, "body.twist_before", "N m s", QUERN_UPDATE, QUERN_AXIAL, .doc = "The same, at the last observation.") \
	X(SINCE, "body.twist_observed", "s", QUERN_UPDATE, QUERN_SCALAR, .doc = "Time of the last observation.") \
	X(TORQUE, "body.torque", "N m", QUERN_UPDATE, QUERN_AXIAL, \
		.doc = "Mean torque of the material between the last two observations.") \
	X(WORK, "body.work", "J", QUERN_READ, QUERN_SCALAR, .doc = "Done on the material since the release.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);
static const quern_output outputs[] = { { .name = "x", .unit = "N m", .doc = "About x; 0 in 2-D." },
	{ .name = "y", .unit = "N m", .doc = "About y; 0 in 2-D." },
	{ .name = "z", .unit = "N m", .doc = "About z." },
	{ .name = "work", .unit = "J", .doc = "Done by the body on the material so far." }, { .name = NULL } };

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const uint32_t turns = b->dim == 3 ? 3 : 1;
	const int32_t i = wall_take_stock(self, b, turns, host, run);
	if (i < 0) return QUERN_E_PARAM;
	for (uint32_t k = 0; k < turns; k++) out[b->dim == 3 ? k : 2] = b->use[TORQUE].real[k][i];
	out[3] = b->use[WORK].real[0][i];
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.wall_torque",
	.brief = "The mean torque on a body since the last observation, and the work that it does.",
	.doc = "About motion.about of the body, or its middle, or where it has none the scene's origin.",
	.instance_size = sizeof(observed_wall),
	.params = wall_params,
	.uses = uses,
	.init = wall_init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
