/* SPDX-License-Identifier: MIT */
/* integrator.damped - for coming to rest: symplectic Euler with a drag and a local damping. docs/theory/grains.md,
 * section 6 */
#include <quern/integrator.h>

typedef struct {
	quern_real drag, local;
} damped;
static const quern_param params[] = { QUERN_PARAM(damped, drag, "1/s", "Viscous drag on velocity and spin.",
										  .from = "grain.settling_rate", .max = 1e9),
	QUERN_PARAM(damped, local, "1",
		"Share of the force on a grain that is taken off while it works, and added while it brakes.",
		.def = 0.05, .max = 0.95),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* A force (per mass) after local damping, and the new velocity. The drag is taken implicitly: stable for any rate. */
QUERN_INLINE quern_real kick(quern_real v, quern_real a, quern_real dt, quern_real local, quern_real keep) {
	const quern_real against = a * v > 0 ? -local : local;
	return (v + dt * a * (1 + (v != 0 ? against : 0))) * keep;
}

QUERN_INLINE void close(const int dim, const damped *d, const quern_integrator_batch *b) {
	const quern_real dt = b->dt, local = d->local, keep = 1 / (1 + dt * d->drag);
	const quern_real *restrict m = b->mass;
	for (int k = 0; k < dim; k++) {
		const quern_real *restrict f = b->force[k], *restrict x = b->position[k],
								   *restrict v = b->velocity[k];
		quern_real *restrict nx = b->new_position[k], *restrict nv = b->new_velocity[k];
		const quern_real g = b->gravity[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) {
			nv[i] = kick(v[i], f[i] / m[i] + g, dt, local, keep);
			nx[i] = x[i] + dt * nv[i];
		}
		if (b->mean_velocity[0])
			for (uint32_t i = 0; i < b->n; i++) b->mean_velocity[k][i] = 0.5 * (v[i] + nv[i]);
	}
	for (int k = 0; k < (dim == 3 ? 3 : 1) && b->torque[0]; k++) {
		const quern_real *restrict t = b->torque[k], *restrict w = b->spin[k], *restrict moment = b->inertia;
		quern_real *restrict nw = b->new_spin[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) nw[i] = kick(w[i], t[i] / moment[i], dt, local, keep);
		if (b->mean_spin[0])
			for (uint32_t i = 0; i < b->n; i++) b->mean_spin[k][i] = 0.5 * (w[i] + nw[i]);
	}
}
static void close_2d(const void *self, const quern_integrator_batch *b) { close(2, self, b); }
static void close_3d(const void *self, const quern_integrator_batch *b) { close(3, self, b); }

static const quern_integrator_ops ops = { .size = sizeof ops, .damps = 1, .close = { close_2d, close_3d } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "integrator.damped",
	.brief = "Symplectic Euler that takes energy away: for settling.",
	.doc = "Local damping acts on every oscillation alike, however slow; the drag limits the speed of "
		   "falling grains.",
	.cite = "Cundall 1987",
	.instance_size = sizeof(damped),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
