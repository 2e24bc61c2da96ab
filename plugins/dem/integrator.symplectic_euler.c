/* SPDX-License-Identifier: MIT */
/* integrator.symplectic_euler - velocities first, positions with the new ones. docs/theory/grains.md, section 3 */
#include <quern/integrator.h>

typedef struct {
	int32_t unused;
} euler;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

QUERN_INLINE void close(const int dim, const quern_integrator_batch *b) {
	const quern_real dt = b->dt;
	const quern_real *restrict m = b->mass;
	for (int k = 0; k < dim; k++) {
		const quern_real *restrict f = b->force[k], *restrict x = b->position[k],
								   *restrict v = b->velocity[k];
		quern_real *restrict nx = b->new_position[k], *restrict nv = b->new_velocity[k];
		const quern_real g = b->gravity[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) {
			nv[i] = v[i] + dt * (f[i] / m[i] + g);
			nx[i] = x[i] + dt * nv[i];
		}
		if (b->mean_velocity[0])
			for (uint32_t i = 0; i < b->n; i++) b->mean_velocity[k][i] = 0.5 * (v[i] + nv[i]);
	}
	for (int k = 0; k < (dim == 3 ? 3 : 1) && b->torque[0]; k++) {
		const quern_real *restrict t = b->torque[k], *restrict w = b->spin[k], *restrict moment = b->inertia;
		quern_real *restrict nw = b->new_spin[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) nw[i] = w[i] + dt * t[i] / moment[i];
		if (b->mean_spin[0])
			for (uint32_t i = 0; i < b->n; i++) b->mean_spin[k][i] = 0.5 * (w[i] + nw[i]);
	}
}
static void close_2d(const void *self, const quern_integrator_batch *b) { (void)self, close(2, b); }
static void close_3d(const void *self, const quern_integrator_batch *b) { (void)self, close(3, b); }

static const quern_integrator_ops ops = { .size = sizeof ops, .close = { close_2d, close_3d } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "integrator.symplectic_euler",
	.brief = "Velocity, then position.",
	.doc = "First order in the presence of dashpots; one force evaluation per step and nothing to remember.",
	.instance_size = sizeof(euler),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
