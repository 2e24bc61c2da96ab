/* SPDX-License-Identifier: MIT */
/* observer.momentum - the momentum that grains and points carry together */
#include "observers.h"
#include <quern/observer.h>

typedef struct {
	int32_t unused;
} observer;
static const quern_param params[] = { QUERN_END_PARAMS };
/* clang-format off */
#define OWN_USES(X) \
	X(GRAIN_VELOCITY, "grain.velocity", "m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(POINT_VELOCITY, "point.velocity", "m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL)
/* clang-format on */
QUERN_USE_ENUM_FROM(CLOUD_USES_ROWS, OWN_USES);
static const quern_use uses[] = { CLOUD_USES(QUERN_USE_ROW) OWN_USES(QUERN_USE_ROW) QUERN_END_USES };
static const quern_output outputs[] = { { .name = "x", .unit = "kg m/s", .doc = "Along x." },
	{ .name = "y", .unit = "kg m/s", .doc = "Along y." },
	{ .name = "z", .unit = "kg m/s", .doc = "Along z; 0 in 2-D." }, { .name = NULL } };

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	cloud_sums grains, points;
	(void)self;
	if (!observe_clouds(b, host, run, &grains, &points)) return QUERN_E_MEMORY;
	for (uint32_t k = 0; k < b->dim; k++) {
		CLOUD_ADD(&grains, i, b->use[GRAIN_VELOCITY].real[k][i], out[k]);
		CLOUD_ADD(&points, i, b->use[POINT_VELOCITY].real[k][i], out[k]);
	}
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.momentum",
	.brief = "The momentum that grains and points carry.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
