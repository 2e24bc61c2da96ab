/* SPDX-License-Identifier: MIT */
/* work - what coupling and books cost, from the numbers of entries: for estimates. docs/bench.md says how it was measured */
#include "hybrid.h"

enum { GRAIN, POINT, NODE, ENTRIES };
/* s that a grain's step takes, as solver.dem has it, in 2-D and 3-D; below, costs of an entry in units of that. Beside what solver.mpm
 * reckons for points those of a hybrid send gradients, follow their cell's density and come to rest. */
static const quern_real grain_step[2] = { 40e-9, 100e-9 };
static const quern_real in_a_step[ENTRIES] = { [GRAIN] = 4, [POINT] = 0.9, [NODE] = 0.2 };
static const quern_real in_an_update[ENTRIES] = { [GRAIN] = 38, [POINT] = 4, [NODE] = 3.3 };

quern_real quern_hybrid_work(const void *self, const quern_step *s, quern_real wider) {
	const hybrid *h = self;
	const quern_real fewer = 1 / (s->dim == 2 ? wider * wider : wider * wider * wider);
	const quern_real updates = (quern_real)s->n_substeps / h->update;
	const quern_real n[ENTRIES] = { [GRAIN] = s->host->set(s->run, "grain").n,
		[POINT] = fewer * s->host->set(s->run, "point").n,
		[NODE] = fewer * QUERN_BLOCK_CELLS * s->host->grid(s->run)->n_blocks };
	quern_real sum = 0;
	for (int k = 0; k < ENTRIES; k++) sum += n[k] * (in_a_step[k] + in_an_update[k] * updates);
	return grain_step[s->dim - 2] * sum;
}
