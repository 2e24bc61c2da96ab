/* SPDX-License-Identifier: MIT */
/* transfer.counting - FLIP that remembers how often it was called and what it changed last. For tests. */
#include <quern/transfer.h>

typedef struct {
	int32_t unused;
} counting;
static const quern_param params[] = { QUERN_END_PARAMS };
enum { TRIPS, CHANGED };
static const quern_use uses[] = { { .field = "particle.trips",
									  .unit = "1",
									  .doc = "Times that this particle was served.",
									  .access = QUERN_UPDATE,
									  .shape = QUERN_INDEX,
									  .initial = 100 },
	{ .field = "particle.changed",
		.unit = "m/s",
		.doc = "Sum of the changes of velocity so far.",
		.access = QUERN_UPDATE,
		.shape = QUERN_VECTOR },
	QUERN_END_USES };

static void gather(const int dim, const quern_transfer_batch *b) {
	for (uint32_t i = 0; i < b->n; i++) {
		b->use[TRIPS].index[i]++;
		for (int k = 0; k < dim; k++) {
			b->velocity[k][i] += b->change[k][i];
			b->use[CHANGED].real[k][i] += b->change[k][i];
		}
	}
}
static void gather_2d(const void *self, const quern_transfer_batch *b) { (void)self, gather(2, b); }
static void gather_3d(const void *self, const quern_transfer_batch *b) { (void)self, gather(3, b); }

static const quern_transfer_ops ops = { .size = sizeof ops, .gather = { gather_2d, gather_3d } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "transfer.counting",
	.brief = "FLIP that counts, for tests.",
	.instance_size = sizeof(counting),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
