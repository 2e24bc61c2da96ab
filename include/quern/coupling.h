/* SPDX-License-Identifier: MIT */
/* quern/coupling.h - the kind `coupling`: what continuum and grains bring to the nodes of one grid block, or of all blocks at
 * once */
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

/* Since 2.1. All nodes with continuum that grains reach, and all these grains. Grain g reaches the nodes
 * node[row[g]] .. node[row[g + 1] - 1]: a sparse matrix by rows. */
typedef struct quern_coupling_system {
	uint32_t dim, n_nodes, n_grains, pad;
	quern_real dt;              /* s, of the continuum's step */
	const quern_real *mass;     /* kg, by node: weighted, of the continuum; more than 0 */
	quern_real *velocity[3];    /* m/s, by node: of the continuum after forces, in and out */
	const uint32_t *row, *node; /* n_grains + 1; by entry of the matrix */
	const quern_real
		*value; /* by entry: of the shape function; a row sums to 1 if all its nodes hold continuum */
	const quern_real *way[3];                    /* m, by entry: from the grain to the node */
	const quern_real *grain_mass, *grain_weight; /* kg, not weighted; its share, more than 0 */
	quern_real *grain_velocity[3];               /* m/s, in and out */
	const quern_host *host;
	quern_run *run;
} quern_coupling_system;

typedef struct quern_coupling_ops {
	uint32_t size, affine; /* affine: 1 lets both clouds send v + L (x_i - x) */
	void (*couple)(
		const void *self, const quern_coupling_job *); /* [batch] conserves mass * velocity, node by node */
	/* since 2.1: [stage] once a step, in place of `couple` and of the grains' transfer; conserves the sum of
	 * mass * velocity over nodes and of grain_weight * grain_mass * grain_velocity over grains. May be NULL */
	quern_status (*solve)(const void *self, const quern_coupling_system *);
} quern_coupling_ops;

QUERN_KIND(coupling, quern_coupling_ops, "What grains and continuum exchange at a node.",
	QUERN_ONE(quern_coupling_ops, couple), QUERN_OPTIONALLY(quern_coupling_ops, solve));

#ifdef __cplusplus
}
#endif
