/* SPDX-License-Identifier: MIT */
/* coupling.all_at_once - what coupling.lumped does node by node, from the system of all nodes and grains: grains bring mass
 * and momentum to nodes, each node exchanges, and grains take the nodes' change. For tests. */
#include <quern/coupling.h>

typedef struct {
	int32_t unused;
} coupling;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static void couple(const void *self, const quern_coupling_job *job) {
	(void)self;
	for (uint32_t k = 0; k < job->dim; k++) job->velocity[k][0] = __builtin_nan(""); /* nobody calls this */
}

static quern_status solve(const void *self, const quern_coupling_system *c) {
	quern_real *mass = c->host->memory(c->run, (c->n_nodes + 1u) * sizeof(quern_real));
	quern_real *change = c->host->memory(c->run, (c->n_nodes + 1u) * sizeof(quern_real));
	(void)self;
	if (!mass || !change) return QUERN_E_MEMORY;
	for (uint32_t g = 0; g < c->n_grains; g++)
		for (uint32_t q = c->row[g]; q < c->row[g + 1]; q++)
			mass[c->node[q]] += c->value[q] * c->grain_weight[g] * c->grain_mass[g];
	for (uint32_t k = 0; k < c->dim; k++) {
		for (uint32_t i = 0; i < c->n_nodes; i++) change[i] = 0;
		for (uint32_t g = 0; g < c->n_grains; g++)
			for (uint32_t q = c->row[g]; q < c->row[g + 1]; q++)
				change[c->node[q]] +=
					c->value[q] * c->grain_weight[g] * c->grain_mass[g] * c->grain_velocity[k][g];
		for (uint32_t i = 0; i < c->n_nodes; i++) {
			const quern_real other = change[i] / mass[i], all = mass[i] + c->mass[i];
			const quern_real impulse = c->mass[i] / all * mass[i] * (other - c->velocity[k][i]);
			c->velocity[k][i] += impulse / c->mass[i];
			change[i] = -impulse / mass[i];
		}
		for (uint32_t g = 0; g < c->n_grains; g++)
			for (uint32_t q = c->row[g]; q < c->row[g + 1]; q++)
				c->grain_velocity[k][g] += c->value[q] * change[c->node[q]];
	}
	return QUERN_OK;
}

static const quern_coupling_ops ops = { .size = sizeof ops, .couple = couple, .solve = solve };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "coupling.all_at_once",
	.brief = "An exchange at each node, of the whole system, for tests.",
	.instance_size = sizeof(coupling),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
