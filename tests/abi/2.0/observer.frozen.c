/* SPDX-License-Identifier: MIT */
/* observer.frozen - how many grains there are, and the highest one's centre: sums and maxima over leaves, two outputs */
#include <quern/observer.h>

typedef struct {
	int32_t unused;
} frozen;

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = {
	{ .field = "grain.position", .unit = "m", .access = QUERN_READ, .shape = QUERN_VECTOR }, QUERN_END_USES
};
static const quern_output outputs[] = { { "count", "1", "Grains.", QUERN_SUM, 0 },
	{ "top", "m", "Of the highest centre.", QUERN_MAX, 0 }, { NULL, NULL, NULL, 0, 0 } };

static void map(const void *self, const quern_observer_batch *b, quern_real *partial) {
	(void)self;
	partial[0] = b->n;
	partial[1] = -__builtin_inf();
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real height = b->use[0].real[b->dim - 1][i];
		if (height > partial[1]) partial[1] = height;
	}
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .set = "grain", .outputs = outputs, .map = map
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.frozen",
	.brief = "Counts grains.",
	.instance_size = sizeof(frozen),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "2.0", "MIT");
