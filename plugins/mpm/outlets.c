/* SPDX-License-Identifier: MIT */
/* outlets - points that have passed an open face go. docs/theory/flow.md, section 1 */
#include "../common/outlets.h"
#include "mpm.h"

quern_status quern_mpm_outlets(const void *self, const quern_step *s) {
	const quern_column *u = s->use;
	const outlets o = { .set = "point",
		.of = { u[OUT_MASS].real[0], u[OUT_WEIGHT].real[0], NULL, s->host->set(s->run, "point").n, "point" },
		.position = &u[OUT_POSITION],
		.velocity = &u[OUT_VELOCITY],
		.energy = u[OUT_ENERGY].real[0],
		.moving = s->dt,
		.pull = u[OUT_PULL].real[0],
		.books = &u[LEFT_MASS] };
	(void)self;
	return quern_outlets_run(s, &o);
}
