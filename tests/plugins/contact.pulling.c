/* SPDX-License-Identifier: MIT */
/* contact.pulling - a constant pull between grains that are apart by less than a share of the effective radius. For tests. */
#include <quern/contact.h>
#include <quern/vec.h>

typedef struct {
	quern_real force, range; /* N, 1 */
} pulling;
static const quern_param params[] = { QUERN_PARAM(pulling, force, "N", "The pull.", .def = 1, .max = 1e9),
	QUERN_PARAM(pulling, range, "1", "Reach over the effective radius.", .def = 0.5, .max = 10),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static void pull(const int dim, const void *self, const quern_contact_batch *b) {
	const pulling *law = self;
	for (uint32_t i = 0; i < b->n; i++) {
		const bool near = b->overlap[i] <= 0 && -b->overlap[i] < law->range * b->radius[i];
		for (int k = 0; k < dim; k++) b->force[k][i] -= near ? law->force * b->normal[k][i] : 0;
	}
}
static void pull_2d(const void *self, const quern_contact_batch *b) { pull(2, self, b); }
static void pull_3d(const void *self, const quern_contact_batch *b) { pull(3, self, b); }

static quern_real period(const void *self, uint32_t dim, quern_real mass, quern_real radius) {
	(void)self, (void)dim, (void)mass, (void)radius;
	return 1;
}
static quern_real reach(const void *self, quern_real radius) {
	return ((const pulling *)self)->range * radius;
}

static const quern_contact_ops ops = {
	.size = sizeof ops, .force = { pull_2d, pull_3d }, .period = period, .reach = reach
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "contact.pulling",
	.brief = "A pull at a distance, for tests.",
	.instance_size = sizeof(pulling),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
