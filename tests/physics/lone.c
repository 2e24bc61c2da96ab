/* SPDX-License-Identifier: MIT */
/* A lone point at a wall: whatever slope of the velocity it sends, on its way there, away from there or held at a floor between nodes, no
 * energy comes from nowhere. docs/theory/transfers.md, section 4 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>
#include <stdio.h>

typedef struct place {
	const char *name;
	double floor; /* m; below 0: a face of the domain */
	double above; /* m, of the point */
	double speed, slope;
	double gain; /* at most, of energy; at floors gimp's D is something between h^2/8 and h^2/4 */
} place;

static const double cell = 0.1;

/* The point moves and stretches along y, and is drawn out along x too. */
static quern_run *open_point(const place *p, const char *shape) {
	char body[100] = "";
	const double floor = fmax(p->floor, 0);
	if (p->floor >= 0)
		snprintf(body, sizeof body, "bodies: [{plane: {point: [0, %g], normal: [0, 1], boundary: slip}}], ",
			floor);
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [4, 2]}, time: {end: 100, step: 1e-3},\n"
		"output: {fields: [point.affine]}, %s\n"
		"continuum: {cell: %g, shape: %s, transfer: apic, material: {drucker_prager: {bulk_modulus: 1e3, density: 1000}},\n"
		"  fill: [{region: {box: {lower: [1, 0.9], upper: [1.05, 0.95]}}}]}}\n",
		body, cell, shape);
	assert_int_equal(harness_count(run, "point"), 1);
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
					   c = harness_field(run, "point.affine");
	x.real[0][0] = 1.03;
	x.real[1][0] = floor + p->above;
	v.real[0][0] = 0.3;
	v.real[1][0] = p->speed;
	c.real[0][0] = 1;
	c.real[1][0] = 5;
	c.real[3][0] = p->slope;
	return run;
}

/* Twice the energy of what the nodes move, over the mass: that of the point and of what it sends beside its velocity. */
static double energy_of(quern_run *run) {
	const quern_column mass = harness_field(run, "node.mass"), v = harness_field(run, "motion.velocity");
	const uint32_t nodes = quern_host_table.grid(run)->n_blocks * 64;
	double sum = 0, whole = 0;
	for (uint32_t i = 0; i < nodes; i++) {
		const double m = mass.real[0][8 * i], x = v.real[0][8 * i], y = v.real[0][8 * i + 1];
		if (!(m > 0)) continue;
		sum += m * (x * x + y * y);
		whole += m;
	}
	return sum / whole;
}

/* What it gains, over what it had in the first step. */
static double gain_of(quern_run *run, double *farthest) {
	double first = 0, most = 0;
	*farthest = 0;
	for (int step = 0; step < 3000; step++) {
		harness_steps(run, 1);
		const double energy = energy_of(run);
		if (!step) first = energy;
		most = fmax(most, energy / first);
		*farthest = fmax(*farthest, harness_field(run, "point.position").real[1][0]);
	}
	return most - 1;
}

static void no_energy_at_walls(void **unused) {
	static const char *const shapes[] = { "gimp", "bspline" }; /* linear ones have no moment to keep */
	static const place places[] = {
		{ "towards a face", -1, 0.09, -0.2, 0, 0 },
		{ "away from a face", -1, 0.01, 0.2, 20, 0 },
		{ "held at a floor on nodes", 0.5, 0.004, -0.1, -0.5, 0.02 },
		{ "held at one between nodes", 0.535, 0.001, -0.1, -0.5, 0.02 },
		{ "away from one between nodes", 0.535, 0.001, 0.1, 5, 0.4 },
	};
	(void)unused;
	bool good = true;
	table_head("a lone point with apic at a wall: energy that it gains in three seconds, over the first");
	for (size_t k = 0; k < sizeof places / sizeof *places; k++)
		for (int s = 0; s < 2; s++) {
			char what[80];
			double farthest;
			quern_run *run = open_point(&places[k], shapes[s]);
			snprintf(what, sizeof what, "%s, %s", places[k].name, shapes[s]);
			good &= table_row(what, gain_of(run, &farthest), 0, s ? 1e-9 : fmax(places[k].gain, 1e-9));
			table_note("  highest place, m", farthest);
			harness_close(run);
		}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(no_energy_at_walls) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
