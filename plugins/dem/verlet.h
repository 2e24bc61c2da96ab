/* SPDX-License-Identifier: MIT */
/* verlet - what velocity_verlet and position_verlet share: the last acceleration that they remember, and the velocity that it predicts
 * half a step on, for dashpots. docs/theory/grains.md, section 3 */
#pragma once
#include <quern/integrator.h>

typedef struct {
	int32_t unused;
} verlet;
static const quern_param params[] = { QUERN_END_PARAMS };

/* Of a new grain no acceleration is known: NaN. */
/* clang-format off */
#define USES(X) \
	X(ACCELERATION, "grain.acceleration", "m/s^2", QUERN_UPDATE, QUERN_VECTOR, .initial = __builtin_nan(""), \
		.doc = "Of the last step, gravity included; NaN: not known yet.") \
	X(SPIN_ACCELERATION, "grain.spin_acceleration", "rad/s^2", QUERN_UPDATE, QUERN_AXIAL, .with = "grain.spin", \
		.initial = __builtin_nan(""), .doc = "Of the last step; NaN: not known yet.") \
	X(OPEN_ACCELERATION, "grain.acceleration", "m/s^2", QUERN_READ, QUERN_VECTOR, .hook = QUERN_INTEGRATOR_OPEN) \
	X(OPEN_SPIN_ACCELERATION, "grain.spin_acceleration", "rad/s^2", QUERN_READ, QUERN_AXIAL, .with = "grain.spin", \
		.hook = QUERN_INTEGRATOR_OPEN)
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

/* v + dt a / 2, of the velocity that `open` has left. */
QUERN_INLINE void predict(const int dim, const quern_integrator_batch *b) {
	const quern_real half = 0.5 * b->dt;
	for (int k = 0; k < dim; k++) {
		const quern_real *restrict a = b->use[OPEN_ACCELERATION].real[k], *restrict v = b->velocity[k];
		quern_real *restrict nv = b->new_velocity[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) nv[i] = v[i] + (a[i] == a[i] ? half * a[i] : 0);
	}
	for (int k = 0; k < (dim == 3 ? 3 : 1) && b->spin[0]; k++) {
		const quern_real *restrict a = b->use[OPEN_SPIN_ACCELERATION].real[k], *restrict w = b->spin[k];
		quern_real *restrict nw = b->new_spin[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) nw[i] = w[i] + (a[i] == a[i] ? half * a[i] : 0);
	}
}
static void predict_2d(const void *self, const quern_integrator_batch *b) { (void)self, predict(2, b); }
static void predict_3d(const void *self, const quern_integrator_batch *b) { (void)self, predict(3, b); }
