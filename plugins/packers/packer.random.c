/* SPDX-License-Identifier: MIT */
/* packer.random - darts thrown at the region until too many in a row miss. docs/theory/packers.md, section 2 */
#include <quern/packer.h>

typedef struct {
	int32_t trials;
} darts;

static const quern_param params[] = { QUERN_PARAM(darts, trials, "1",
										  "Darts per grain; the region is left when all of them miss.",
										  .def = 20, .min = 1, .max = 100000),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static void aim(quern_pack_job *job, quern_real x[3]) {
	quern_real u[4] = { 0 };
	job->host->random(job->stream, job->key, job->counter++, u);
	if (job->dim == 3) job->host->random(job->stream, job->key, job->counter++, u + 2);
	for (uint32_t k = 0; k < job->dim; k++) x[k] = job->lower[k] + u[k] * (job->upper[k] - job->lower[k]);
}

/* The radius stands before the first dart and outlives the last one: a radius drawn anew for every dart would let
 * small grains in more often than the law says. */
static bool throw_grain(const darts *p, quern_pack_job *job, quern_spot *spot) {
	*spot = (quern_spot) { .radius = job->radius(job) };
	for (int32_t t = 0; t < p->trials; t++) {
		aim(job, spot->x);
		if (job->inside(job, spot->x) && job->free(job, spot)) return true;
	}
	return false;
}

static void pack(const void *self, quern_pack_job *job) {
	quern_spot spot;
	while (throw_grain(self, job, &spot) && job->place(job, &spot)) continue;
}

static const quern_packer_ops ops = { .size = sizeof ops, .pack = { pack, pack } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "packer.random",
	.brief = "Darts: grains at random places, wherever they fit.",
	.doc =
		"Leaves a packing far below that of grains at rest. The simplest packer, and the measure of others.",
	.cite = "Yue et al. 2018; Chantharayukhonthorn 2019, section 6.2.1",
	.instance_size = sizeof(darts),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
