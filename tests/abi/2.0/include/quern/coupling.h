/* SPDX-License-Identifier: MIT */
/* quern/coupling.h - the kind `coupling`: what continuum and grains bring to the nodes of one grid block */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct quern_coupling_job {
	uint32_t dim, n; /* nodes */
	const quern_real *mass,
		*other_mass;         /* kg, weighted: continuum, grains; coupled where both are positive */
	quern_real *velocity[3]; /* m/s, of the continuum after forces: in and out */
	quern_real *other[3];    /* m/s, of the grains: in and out */
} quern_coupling_job;

typedef struct quern_coupling_ops {
	uint32_t size, affine; /* affine: 1 lets both clouds send v + L (x_i - x) */
	void (*couple)(
		const void *self, const quern_coupling_job *); /* [batch] conserves mass * velocity, node by node */
} quern_coupling_ops;

QUERN_KIND(coupling, quern_coupling_ops, "What grains and continuum exchange at a node.",
	QUERN_ONE(quern_coupling_ops, couple));

#ifdef __cplusplus
}
#endif
