/* SPDX-License-Identifier: MIT */
/* work - what coupling and books cost, from the numbers of entries: for estimates. docs/bench.md says how it was measured */
#include "hybrid.h"
#include <math.h>

enum { GRAIN, POINT, NODE, ENTRIES };
/* s that a grain's step takes, as solver.dem has it, in 2-D and 3-D; below, costs of an entry in units of that, beside what solver.dem and solver.mpm
 * reckon: grains of a hybrid lie in smaller sets; points send gradients, follow their cell's density and come to rest. */
static const quern_real grain_step[2] = { 28e-9, 56e-9 };
static const quern_real in_a_substep[ENTRIES] = { [GRAIN] = 0.2 };
static const quern_real in_a_step[ENTRIES] = { [GRAIN] = 3.3, [POINT] = 0.8, [NODE] = 0.55 };
static const quern_real in_an_update[ENTRIES] = { [GRAIN] = 14, [POINT] = 3.5, [NODE] = 8 };
static const quern_real in_a_sample = 2.3; /* a grain */

quern_real quern_hybrid_work(const void *self, const quern_step *s, quern_real wider) {
	const hybrid *h = self;
	const quern_real fewer = 1 / (s->dim == 2 ? wider * wider : wider * wider * wider);
	const quern_real every = floor((quern_real)h->update / s->n_substeps),
					 updates = 1 / (every > 1 ? every : 1); /* in a long step */
	const quern_real n[ENTRIES] = { [GRAIN] = s->host->set(s->run, "grain").n,
		[POINT] = fewer * s->host->set(s->run, "point").n,
		[NODE] = fewer * QUERN_BLOCK_CELLS * s->host->grid(s->run)->n_blocks };
	quern_real sum = n[GRAIN] * in_a_sample * h->samples * updates;
	for (int k = 0; k < ENTRIES; k++)
		sum += n[k] * (in_a_substep[k] * s->n_substeps + in_a_step[k] + in_an_update[k] * updates);
	return grain_step[s->dim - 2] * sum;
}
