/* SPDX-License-Identifier: MIT */
/* observer.discrete_share - the share of the mass that grains carry: sum of w m over all carried mass */
#include "observers.h"
#include <quern/observer.h>

typedef struct {
	int32_t unused;
} observer;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = QUERN_USE_ROWS(CLOUD_USES);
static const quern_output outputs[] = {
	{ .name = "share", .unit = "1", .doc = "Of the carried mass, by grains." }, { .name = NULL }
};

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	cloud_sums grains, points;
	(void)self;
	if (!observe_clouds(b, host, run, &grains, &points)) return QUERN_E_MEMORY;
	const quern_real discrete = cloud_total(&grains), all = discrete + cloud_total(&points);
	out[0] = all > 0 ? discrete / all : 0;
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.discrete_share",
	.brief = "The share of the mass that grains carry.",
	.doc = "The summary's discrete_share is its mean over the observations.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
