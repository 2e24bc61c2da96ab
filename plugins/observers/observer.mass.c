/* SPDX-License-Identifier: MIT */
/* observer.mass - the mass that grains and points carry */
#include "observers.h"
#include <quern/observer.h>

typedef struct {
	int32_t unused;
} observer;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = QUERN_USE_ROWS(CLOUD_USES);
static const quern_output outputs[] = { { .name = "carried", .unit = "kg", .doc = "By both." },
	{ .name = "grains", .unit = "kg", .doc = "By grains, weighted, without fixed ones." },
	{ .name = "points", .unit = "kg", .doc = "By points, weighted." }, { .name = NULL } };

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	cloud_sums grains, points;
	(void)self;
	if (!observe_clouds(b, host, run, &grains, &points)) return QUERN_E_MEMORY;
	out[1] = cloud_total(&grains);
	out[2] = cloud_total(&points);
	out[0] = out[1] + out[2];
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.mass",
	.brief = "The mass that grains and points carry.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
