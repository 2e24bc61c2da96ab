/* SPDX-License-Identifier: MIT */
/* outlets - grains that have passed an open face go. docs/theory/flow.md, section 1 */
#include "../common/outlets.h"
#include "dem.h"

quern_status quern_dem_outlets(const void *self, const quern_step *s) {
	const quern_column *u = s->use;
	const outlets o = { .set = "grain",
		.of = { u[OUT_MASS].real[0], u[OUT_WEIGHT].real[0], u[OUT_FIXED].index,
			s->host->set(s->run, "grain").n, "grain" },
		.position = &u[OUT_POSITION],
		.velocity = &u[OUT_VELOCITY],
		.spin = &u[OUT_SPIN],
		.radius = u[OUT_RADIUS].real[0],
		.lent = &u[OUT_LENT],
		.moving = ((quern_real)s->within + 1) * s->dt,
		.pull = s->settling ? NULL : u[OUT_PULL].real[0],
		.books = &u[LEFT_MASS] };
	(void)self;
	return quern_outlets_run(s, &o);
}
