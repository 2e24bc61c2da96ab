/* SPDX-License-Identifier: MIT */
/* integrator.velocity_verlet - second order, also with dashpots, which see v + dt a, the velocity that the old acceleration
 * predicts. docs/theory/grains.md, section 3 */
#include "verlet.h"

/* A new grain is moved with its velocity in its first step and kicked once, which costs an error of second order, once.
 * v becomes that of the middle of the step, v + dt a / 2, by which x moves. */
QUERN_INLINE void open(const int dim, const quern_integrator_batch *b) {
	const quern_real dt = b->dt, half = 0.5 * dt;
	for (int k = 0; k < dim; k++) {
		const quern_real *restrict a = b->use[OPEN_ACCELERATION].real[k], *restrict x = b->position[k];
		const quern_real *restrict v = b->velocity[k];
		quern_real *restrict nx = b->new_position[k], *restrict nv = b->new_velocity[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) {
			const quern_real middle = v[i] + (a[i] == a[i] ? half * a[i] : 0);
			nv[i] = middle;
			nx[i] = x[i] + dt * middle;
		}
	}
	for (int k = 0; k < (dim == 3 ? 3 : 1) && b->spin[0]; k++) {
		const quern_real *restrict a = b->use[OPEN_SPIN_ACCELERATION].real[k], *restrict w = b->spin[k];
		quern_real *restrict nw = b->new_spin[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) nw[i] = w[i] + (a[i] == a[i] ? half * a[i] : 0);
	}
}

/* The other half of the kick. */
QUERN_INLINE void close(const int dim, const quern_integrator_batch *b) {
	const quern_real dt = b->dt;
	const quern_real *restrict m = b->mass;
	for (int k = 0; k < dim; k++) {
		const quern_real *restrict f = b->force[k], *restrict x = b->position[k],
								   *restrict v = b->velocity[k];
		quern_real *restrict nx = b->new_position[k], *restrict nv = b->new_velocity[k];
		quern_real *restrict a = b->use[ACCELERATION].real[k];
		const quern_real g = b->gravity[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) {
			const quern_real now = f[i] / m[i] + g;
			nv[i] = v[i] + (a[i] == a[i] ? 0.5 * dt * now : dt * now);
			nx[i] = x[i];
			a[i] = now;
		}
		if (b->mean_velocity[0]) /* the kick around this evaluation is centred on it */
			for (uint32_t i = 0; i < b->n; i++) b->mean_velocity[k][i] = nv[i];
	}
	for (int k = 0; k < (dim == 3 ? 3 : 1) && b->torque[0]; k++) {
		const quern_real *restrict t = b->torque[k], *restrict w = b->spin[k], *restrict moment = b->inertia;
		quern_real *restrict nw = b->new_spin[k], *restrict a = b->use[SPIN_ACCELERATION].real[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) {
			const quern_real now = t[i] / moment[i];
			nw[i] = w[i] + (a[i] == a[i] ? 0.5 * dt * now : dt * now);
			a[i] = now;
		}
		if (b->mean_spin[0])
			for (uint32_t i = 0; i < b->n; i++) b->mean_spin[k][i] = nw[i];
	}
}

static void open_2d(const void *self, const quern_integrator_batch *b) { (void)self, open(2, b); }
static void open_3d(const void *self, const quern_integrator_batch *b) { (void)self, open(3, b); }
static void close_2d(const void *self, const quern_integrator_batch *b) { (void)self, close(2, b); }
static void close_3d(const void *self, const quern_integrator_batch *b) { (void)self, close(3, b); }

static const quern_integrator_ops ops = { .size = sizeof ops,
	.close = { close_2d, close_3d },
	.open = { open_2d, open_3d },
	.predict = { predict_2d, predict_3d },
	.damping = 2,
	.lag = 0.5,
	.at = 1,
	.step = 0.05 };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "integrator.velocity_verlet",
	.brief = "Second order, with one evaluation a step.",
	.doc =
		"Dashpots act on the predicted velocity and springs move by the mean one, which keeps the order. Remembers the last "
		"acceleration.",
	.cite = "Swope et al. 1982",
	.instance_size = sizeof(verlet),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
