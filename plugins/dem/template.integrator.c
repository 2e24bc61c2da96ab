/* integrator.my_name - velocities first, positions with the new ones, and a drag that slows everything down.
 *
 * `close` gets forces and the old state of a batch of grains and writes the new state. A scheme that also acts before
 * the forces has an `open` as well, and keeps what it must remember in fields of its own, such as grain.acceleration. */
#include <quern/integrator.h>

typedef struct {
	quern_real drag;
} scheme;

static const quern_param params[] = { QUERN_PARAM(scheme, drag, "1/s",
										  "Rate at which motion decays; 0: none is lost.", .max = 1e9),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* Columns of one quantity, component by component; the loops vectorise. Drag is implicit, hence stable at any rate. */
QUERN_INLINE void close(const int dim, const void *self, const quern_integrator_batch *b) {
	const quern_real dt = b->dt, keep = 1 / (1 + ((const scheme *)self)->drag * dt);
	const quern_real *restrict mass = b->mass, *restrict inertia = b->inertia;
	for (int k = 0; k < dim; k++) {
		const quern_real *restrict f = b->force[k], *restrict x = b->position[k],
								   *restrict v = b->velocity[k];
		quern_real *restrict nx = b->new_position[k], *restrict nv = b->new_velocity[k];
		const quern_real g = b->gravity[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) {
			nv[i] = keep * (v[i] + dt * (f[i] / mass[i] + g));
			nx[i] = x[i] + dt * nv[i];
		}
		if (b->mean_velocity[0]) /* energy is observed */
			for (uint32_t i = 0; i < b->n; i++) b->mean_velocity[k][i] = 0.5 * (v[i] + nv[i]);
	}
	for (int k = 0; k < (dim == 3 ? 3 : 1) && b->torque[0]; k++) { /* only where grains spin */
		const quern_real *restrict t = b->torque[k], *restrict w = b->spin[k];
		quern_real *restrict nw = b->new_spin[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) nw[i] = keep * (w[i] + dt * t[i] / inertia[i]);
		if (b->mean_spin[0])
			for (uint32_t i = 0; i < b->n; i++) b->mean_spin[k][i] = 0.5 * (w[i] + nw[i]);
	}
}
static void close_2d(const void *self, const quern_integrator_batch *b) { close(2, self, b); }
static void close_3d(const void *self, const quern_integrator_batch *b) { close(3, self, b); }

static const quern_integrator_ops ops = { .size = sizeof ops, .close = { close_2d, close_3d } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "integrator.my_name",
	.brief = "Symplectic Euler with a drag.",
	.instance_size = sizeof(scheme),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
