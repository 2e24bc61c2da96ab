/* SPDX-License-Identifier: MIT */
/* observer.wall_force - the mean force of the material on a body, between two observations */
#include "wall.h"

/* clang-format off */
#define USES(X) \
	X(IMPULSE, "body.impulse", "N s", QUERN_READ, QUERN_VECTOR, .doc = "Given to the material since the release.") \
	X(BEFORE, "body.impulse_before", "N s", QUERN_UPDATE, QUERN_VECTOR, .doc = "The same, at the last observation.") \
	X(SINCE, "body.observed", "s", QUERN_UPDATE, QUERN_SCALAR, .doc = "Time of the last observation.") \
	X(FORCE, "body.force", "N", QUERN_UPDATE, QUERN_VECTOR, \
		.doc = "Mean force of the material between the last two observations.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);
static const quern_output outputs[] = { { .name = "x", .unit = "N", .doc = "Along x." },
	{ .name = "y", .unit = "N", .doc = "Along y." },
	{ .name = "z", .unit = "N", .doc = "Along z; 0 in 2-D." }, { .name = NULL } };

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const int32_t i = wall_take_stock(self, b, b->dim, host, run);
	for (uint32_t k = 0; k < b->dim && i >= 0; k++) out[k] = b->use[FORCE].real[k][i];
	return i < 0 ? QUERN_E_PARAM : QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.wall_force",
	.brief = "The mean force on a body since the last observation.",
	.doc = "From the impulses that grains and continuum have exchanged with it, so that no peak is missed.",
	.instance_size = sizeof(observed_wall),
	.params = wall_params,
	.uses = uses,
	.init = wall_init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
