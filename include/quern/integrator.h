/* SPDX-License-Identifier: MIT */
/* quern/integrator.h - the kind `integrator`: grains of one block; `close` runs fused with the sums, `open` (optional) before the forces */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { QUERN_INTEGRATOR_CLOSE, QUERN_INTEGRATOR_OPEN };

typedef struct quern_integrator_batch {
	uint32_t n, cap;
	quern_real dt, gravity[3];
	const quern_real *force[3],
		*torque[3];                   /* N, N m, weighted; torque NULL without spin; both NULL in `open` */
	const quern_real *mass, *inertia; /* kg, kg m^2, weighted like the force */
	const quern_real *position[3], *velocity[3], *spin[3];
	quern_real *new_position[3], *new_velocity[3], *new_spin[3];
	quern_real *mean_velocity[3],
		*mean_spin[3]; /* in `close` over the kick, so that force . mean * dt is the change of kinetic
	                                                energy; NULL unless energy is observed, and in `open` */
	const quern_column *use;
} quern_integrator_batch;

typedef struct quern_integrator_ops {
	uint32_t size;
	uint32_t damps; /* 1: takes energy away on purpose, for settling; what it takes stands in no budget */
	void (*close[2])(const void *self, const quern_integrator_batch *); /* [batch] */
	void (*open[2])(const void *self, const quern_integrator_batch *);  /* [batch] may be NULL */
	/* [batch] may be NULL: the velocities and spins, new_velocity and new_spin, that dashpots act on, for one whose `open` leaves those
	 * by which the grains have moved. Called between `open` and the forces, with the state, with the rows of QUERN_INTEGRATOR_OPEN
	 * in `use`, and with no force, mass or mean. NULL: dashpots act on the state. */
	void (*predict[2])(const void *self, const quern_integrator_batch *);
	/* For one with `open`: after which share of the step forces are evaluated; 0 counts as 1. `open` moves a grain by at * dt * the
	 * velocity that it leaves, and springs are stretched from one evaluation to the next by dt times that. Below 1 `close` gives
	 * the whole impulse of these forces, as one without `open` does; at 1 half of it, and `open` of the next step the other. */
	quern_real at;
	/* By which factor a damping ratio counts in the limit of the step, omega dt < 2 (sqrt(1 + zeta^2) - zeta) for dashpots that
	 * see the velocity of the step's beginning: 2 for one predicted by half a step; 0 counts as 1. docs/theory/grains.md, section 2 */
	quern_real damping;
	/* Recommended step over half the shortest period of a contact, at most 0.1; 0 counts as 0.02. docs/theory/grains.md, section 2 */
	quern_real step;
	/* By how much of its second derivative the velocity of `predict` is late, in dt^2: 1/2 where the last acceleration predicts it by half
	 * a step; at most 1. Laws may weaken their dashpots by it (quern_dashpot_share). 0, or no `predict`: it is not late. */
	quern_real lag;
	/* 1: `open` changes neither velocities nor spins. What it gives for velocities is not taken then, and it is called without spins. */
	uint32_t coasts;
} quern_integrator_ops;

/* After which share of the step forces are evaluated; below 1, all of their impulse is given in that step. */
QUERN_INLINE quern_real quern_integrator_ahead(const quern_integrator_ops *ops, uint32_t dim) {
	return !ops->open[dim - 2] ? 0 : ops->at > 0 ? ops->at : 1;
}

QUERN_KIND(integrator, quern_integrator_ops, "Grains moved on by forces.",
	QUERN_EACH(quern_integrator_ops, close), QUERN_EITHER(quern_integrator_ops, open),
	QUERN_EITHER(quern_integrator_ops, predict));

#ifdef __cplusplus
}
#endif
