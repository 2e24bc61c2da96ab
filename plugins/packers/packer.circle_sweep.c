/* SPDX-License-Identifier: MIT */
/* packer.circle_sweep - grains at the first free of many places around those that are there, evenly spread on circles, in 3-D on
 * spheres. docs/theory/packers.md, section 6 */
#include "queue.h"

typedef struct {
	int32_t angles, trials;
} circle_sweep;

static const quern_param params[] = { QUERN_PARAM(circle_sweep, angles, "1",
										  "Places tried around a grain; in 3-D as many as lie no farther "
										  "from each other: their square over pi.",
										  .def = 36, .min = 3, .max = 1000),
	QUERN_PARAM(circle_sweep, trials, "1", "Darts for the first grain of a region that would stay empty.",
		.def = 20, .min = 1, .max = 100000),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* Unit vector to the i-th of n places around a grain. On a sphere, steps of equal height turned by the golden angle. */
static quern_vec way(uint32_t dim, int32_t i, int32_t n, quern_real start) {
	const quern_real angle = start + i * (dim == 2 ? 6.283185307179586 / n : 2.399963229728653);
	const quern_real z = dim == 2 ? 0 : 1 - (2 * i + 1) / (quern_real)n, across = __builtin_sqrt(1 - z * z);
	return (quern_vec) { across * quern_cos(angle), across * quern_sin(angle), z };
}

/* Every place of the circle is tried once, by whichever grain waits when its turn comes. */
static void sweep(packing *p, uint32_t i) {
	const int32_t n =
		p->job->dim == 2 ? p->angles : (int32_t)(p->angles * (quern_real)p->angles / 3.14159265358979312);
	if (!gather(p, i)) return;
	const quern_real start = random_angle(p);
	for (int32_t k = 0; k < n && !p->stopped; k++)
		if (offer(p, quern_vec_axpy(touching(p, &p->seed), way(p->job->dim, k, n, start), p->seed.at)) &&
			!p->stopped && !gather(p, i))
			return;
}

static void walk(packing *p, uint32_t from) {
	for (uint32_t i = from; i < queued(p) && !p->stopped; i++) sweep(p, i);
}

static void pack(const void *self, quern_pack_job *job) {
	const circle_sweep *c = self;
	packing p;
	begin(&p, job, c->trials, c->angles);
	walk(&p, 0);
	if (!empty(&p)) return;
	p.n_near = 0;
	throw_darts(&p);
	walk(&p, job->n_seed);
}

static const quern_packer_ops ops = { .size = sizeof ops, .pack = { pack, pack } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "packer.circle_sweep",
	.brief = "Grains that touch one other, at the first free place around it.",
	.doc =
		"Between `random` and `two_point_tangent` in density and in cost. More angles are denser and slower.",
	.cite = "Chantharayukhonthorn 2019, section 6.2.3",
	.instance_size = sizeof(circle_sweep),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
