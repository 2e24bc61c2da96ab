/* SPDX-License-Identifier: MIT */
/* neighbours.all_pairs - every pair is looked at: the reference that faster searches are held against */
#include <quern/neighbours.h>
#include <quern/space.h>

typedef struct {
	int32_t unused;
} all_pairs;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static size_t keys(const void *self, const quern_neighbour_job *job, uint64_t *key) {
	(void)self;
	for (uint32_t i = 0; i < job->n; i++) key[i] = 0;
	return 0;
}

static uint32_t pairs(
	const void *self, const quern_neighbour_job *job, uint32_t b, uint32_t cap, quern_pair *out) {
	const uint32_t begin = job->block[b], end = job->block[b + 1];
	const quern_images images = quern_images_of(job->dim, job->lower, job->upper, job->periodic);
	uint32_t n = 0;
	(void)self;
	for (uint32_t i = begin; i < end; i++)
		for (uint32_t k = 0; k < job->n; k++) {
			quern_real d2 = 0;
			if (k >= begin && k <= i) continue; /* inside the block each pair comes once */
			for (uint32_t a = 0; a < job->dim; a++) {
				const quern_real d =
					quern_image(job->position[a][i] - job->position[a][k], images.half[a], images.length[a]);
				d2 += d * d;
			}
			const quern_real reach = job->radius[i] + job->radius[k] + job->reach;
			if (!(d2 < reach * reach)) continue;
			if (n < cap) out[n] = (quern_pair) { (int32_t)i, (int32_t)k };
			n++;
		}
	return n;
}

static const quern_neighbour_ops ops = { .size = sizeof ops, .keys = keys, .pairs = pairs };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "neighbours.all_pairs",
	.brief = "Every pair, by brute force.",
	.doc = "For tests and for a handful of grains: its cost grows with the square of their number.",
	.instance_size = sizeof(all_pairs),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
