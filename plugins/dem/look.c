/* SPDX-License-Identifier: MIT */
/* look - what a run of grains says while it goes: how far it is from rest, what a grain has, how deep contacts are */
#include "box.h"
#include "dem.h"
#include <math.h>
#include <quern/space.h>

enum { KINETIC, RESIDUAL, OVERLAP };
const quern_output quern_dem_looks[] = {
	{ .name = "kinetic", .unit = "J/grain", .doc = "Kinetic energy of a grain that moves, in the mean." },
	{ .name = "residual",
		.unit = "1",
		.doc = "While settling: the same over m g d and over settle.energy; at rest when it stays below 1." },
	{ .name = "overlap", .unit = "%", .doc = "Of two grains, over the smaller radius: the largest." },
	{ .name = NULL }
};

/* J of all grains that move, and their number; without spin, as settling looks at it. */
static quern_real kinetic(const quern_step *s, quern_real *mass, uint32_t *n) {
	const cloud grains = dem_cloud(s, NULL);
	cloud_sums c;
	quern_real energy = 0;
	*mass = 0;
	*n = 0;
	if (!grains.n || !cloud_open(&c, s->host, s->run, &grains)) return 0;
	for (uint32_t i = 0; i < grains.n; i++) *mass += c.mass[i], *n += c.mass[i] > 0;
	CLOUD_ADD(&c, i, 0.5 * cloud_square(&s->use[FILL_VELOCITY], i, s->dim), energy);
	return energy;
}

static quern_real deepest(const dem *d, const quern_step *s) {
	const dem_box box = d->boxed ? dem_box_at(s, &s->use[FILL_BOX_LENGTH]) : (dem_box) { .dim = 0 };
	const quern_column *u = s->use;
	const uint32_t n = u[FILL_FIRST].index ? s->host->set(s->run, "contact").n : 0;
	quern_real most = 0;
	for (uint32_t q = 0; q < n; q++) {
		const int32_t i = u[FILL_FIRST].index[q], j = u[FILL_SECOND].index[q];
		const quern_real a = u[FILL_RADIUS].real[0][i], b = u[FILL_RADIUS].real[0][j];
		quern_real square = 0, apart[3] = { 0 }, crossed[3];
		for (uint32_t k = 0; k < s->dim; k++) {
			const quern_real length = s->upper[k] - s->lower[k];
			apart[k] = u[FILL_POSITION].real[k][i] - u[FILL_POSITION].real[k][j];
			if (s->periodic[k] && !d->boxed && fabs(apart[k]) > 0.5 * length)
				apart[k] = length - fabs(apart[k]);
		}
		if (d->boxed) dem_box_image(&box, (int)s->dim, apart, crossed);
		for (uint32_t k = 0; k < s->dim; k++) square += apart[k] * apart[k];
		if (square >= (a + b) * (a + b)) continue;
		most = fmax(most, (a + b - sqrt(square)) / fmin(a, b));
	}
	return most;
}

void quern_dem_look_at_run(const void *self, const quern_step *s, quern_real *out) {
	const dem *d = self;
	const quern_real scale = quern_gravity_size(d->dim, s->gravity) * dem_diameter(d);
	quern_real mass;
	uint32_t n;
	const quern_real energy = kinetic(s, &mass, &n);
	out[KINETIC] = n ? energy / n : NAN;
	out[RESIDUAL] = s->settling && mass > 0 && scale > 0 ? energy / (mass * scale * d->rest) : NAN;
	out[OVERLAP] = 100 * deepest(d, s);
}
