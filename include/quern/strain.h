/* SPDX-License-Identifier: MIT */
/* quern/strain.h - the kind `strain`: what of the velocity gradient that points see on the grid goes into their volumes and stresses
 *
 * A strain may look beyond the point: it measures numbers at every point, gets back the means of them over the points of the same cell
 * that bear something, by volume, and changes gradients by these. The solver adds up, in the order of the points, so that
 * results depend neither on threads nor on how points are cut into batches. Positions, velocities and what points send to the nodes are
 * none of its affair: they see the gradient as it was.
 *
 * To be stable with the solver's step, the sum of volume times squared gradient over a cell must not grow; so that a cell fills the room
 * that its nodes give it, the sum of volume times trace must stay; and what moves with one gradient must keep it. */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Most numbers that are averaged. */
enum { QUERN_STRAIN_MOST = 4 };

typedef struct quern_strain_batch {
	uint32_t n, cap;
	quern_real dt;
	quern_real *gradient[9]; /* 1/s, L row-major dim x dim; `measure` leaves it alone, `apply` changes it */
	quern_real *measured[QUERN_STRAIN_MOST]; /* out of `measure`, the first `means`; NULL in `apply` */
	const quern_real
		*mean[QUERN_STRAIN_MOST]; /* of what was measured, over the point's cell; NULL in `measure` */
	const quern_column *use;      /* what is remembered in them is changed by `apply` alone */
} quern_strain_batch;

typedef struct quern_strain_ops {
	uint32_t size;
	uint32_t means; /* how many numbers are measured and averaged; 0: none, and `measure` is not called */
	void (*measure[2])(
		const void *self, const quern_strain_batch *); /* [batch] NULL where there are no means */
	void (*apply[2])(
		const void *self, const quern_strain_batch *); /* [batch] NULL: gradients stay as they are */
} quern_strain_ops;

QUERN_KIND(strain, quern_strain_ops, "What of the velocity gradient strains a continuum.",
	QUERN_EITHER(quern_strain_ops, measure), QUERN_EITHER(quern_strain_ops, apply));

#ifdef __cplusplus
}
#endif
