/* coupling.my_name - continuum and grains exchange momentum at each node until a share of their difference is gone.
 *
 * A coupling sees the nodes of one block of the grid, with masses and velocities of both, and changes the velocities. It
 * must keep the momentum of each node: what one gets, the other gives. */
#include <quern/coupling.h>

typedef struct {
	quern_real share;
} exchange;

static const quern_param params[] = { QUERN_PARAM(exchange, share, "1",
										  "Of the difference in velocity that goes in a step; 1: all.",
										  .def = 1, .min = 0, .max = 1, .flags = QUERN_MIN_OPEN),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* Where only one of them is, there is nothing to exchange. */
static void couple(const void *self, const quern_coupling_job *job) {
	const quern_real share = ((const exchange *)self)->share;
	const quern_real *restrict m = job->mass, *restrict n = job->other_mass;
	for (uint32_t k = 0; k < job->dim; k++) {
		quern_real *restrict v = job->velocity[k], *restrict other = job->other[k];
		for (uint32_t i = 0; i < job->n; i++) {
			const bool both = m[i] > 0 && n[i] > 0;
			const quern_real sum = both ? m[i] + n[i] : 1;
			const quern_real impulse = both ? share * (m[i] * n[i] / sum) * (other[i] - v[i]) : 0;
			v[i] += impulse / (both ? m[i] : 1);
			other[i] -= impulse / (both ? n[i] : 1);
		}
	}
}

static const quern_coupling_ops ops = { .size = sizeof ops, .couple = couple };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "coupling.my_name",
	.brief = "An exchange of a share of the difference.",
	.instance_size = sizeof(exchange),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
