/* SPDX-License-Identifier: MIT */
/* integrator.position_verlet - half a way, the whole kick, half a way: second order, also with dashpots, which see the velocity that
 * the last acceleration predicts. docs/theory/grains.md, section 3 */
#include "verlet.h"

/* x += dt v / 2. The first dashpots of a new grain see its velocity as it is, an error of second order, once; springs that it has at the
 * start are stretched by half a step too much. */
QUERN_INLINE void open(const int dim, const quern_integrator_batch *b) {
	const quern_real half = 0.5 * b->dt;
	for (int k = 0; k < dim; k++) {
		const quern_real *restrict x = b->position[k], *restrict v = b->velocity[k];
		quern_real *restrict nx = b->new_position[k], *restrict nv = b->new_velocity[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) {
			nx[i] = x[i] + half * v[i];
			nv[i] = v[i];
		}
	}
	for (int k = 0; k < (dim == 3 ? 3 : 1) && b->spin[0]; k++)
		for (uint32_t i = 0; i < b->n; i++) b->new_spin[k][i] = b->spin[k][i];
}

/* v += dt a, x += dt v / 2 */
QUERN_INLINE void close(const int dim, const quern_integrator_batch *b) {
	const quern_real dt = b->dt, half = 0.5 * dt;
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
			nv[i] = v[i] + dt * now;
			nx[i] = x[i] + half * nv[i];
			a[i] = now;
		}
		if (b->mean_velocity[0])
			for (uint32_t i = 0; i < b->n; i++) b->mean_velocity[k][i] = 0.5 * (v[i] + nv[i]);
	}
	for (int k = 0; k < (dim == 3 ? 3 : 1) && b->torque[0]; k++) {
		const quern_real *restrict t = b->torque[k], *restrict w = b->spin[k], *restrict moment = b->inertia;
		quern_real *restrict nw = b->new_spin[k], *restrict a = b->use[SPIN_ACCELERATION].real[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) {
			const quern_real now = t[i] / moment[i];
			nw[i] = w[i] + dt * now;
			a[i] = now;
		}
		if (b->mean_spin[0])
			for (uint32_t i = 0; i < b->n; i++) b->mean_spin[k][i] = 0.5 * (w[i] + nw[i]);
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
	.at = 0.5,
	.step = 0.05,
	.coasts = 1 };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 2,
	.dims = QUERN_2D | QUERN_3D,
	.id = "integrator.position_verlet",
	.brief = "Half a way, a kick, half a way: second order.",
	.doc =
		"One evaluation a step, in its middle. The path is that of velocity_verlet with forces half a step later. All of a kick "
		"is given in its step, as the books of a hybrid need it. Remembers the last acceleration, for dashpots.",
	.cite = "Tuckerman, Berne & Martyna 1992",
	.instance_size = sizeof(verlet),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
