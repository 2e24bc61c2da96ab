/* SPDX-License-Identifier: MIT */
/* A flow gathers the points of a hybrid's continuum in layers a cell apart, as it does those of a continuum alone; spread over their cells they
 * are as many in the middles of cells as near to the planes of nodes. docs/theory/mpm.md, section 8 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>

static const double cell = 4e-3;

/* A layer 24 grains deep on a rough floor that flows down 22 degrees, its zone near the surface. */
static quern_run *open_chute(double spread) {
	return harness_open(1,
		"{quern: 1, dimension: 2, seed: 5, gravity: [0, -9.81], time: {end: 10}, output: {every: 10},\n"
		"stages: [{set: {gravity: [3.6749, -9.0956]}}],\n"
		"domain: {lower: [0, 0], upper: [0.032, 0.1], periodic: [true, false]},\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%, law: normal}}, overlap: {most: 50 %%},\n"
		"  contact: {linear: {stiffness: 1e5, restitution: 0.5, friction: 0.4}},\n"
		"  fill: [{region: {box: {lower: [0, -0.7 mm], upper: [0.032, -0.7 mm]}}, fixed: true},\n"
		"    {region: {box: {lower: [0, 0.001], upper: [0.032, 0.05]}}, settle: true}]},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: {rough: 7.4}, displacement: 0.65 mm}}],\n"
		"continuum: {cell: %g, spread: %g, material: {mu_i: {critical_density: 1999, flow_density: 2037, dilation: 0.385,\n"
		"  static_friction: 0.2175, limit_friction: 0.812, inertial_number: 0.358, bulk_modulus: 0.67e5, diameter: 2 mm, grain_density: 2500}}},\n"
		"hybrid: {oracle: [{packing_fraction: {depth: 8 mm, half_width: 4 mm}}], substeps: auto}}\n",
		cell, spread);
}

/* The share of points, of the rows of cells from the second to the sixth, that lie in the middle half of their cell's height. */
static double in_the_middle(quern_run *run) {
	const quern_column x = harness_field(run, "point.position");
	uint32_t middle = 0, n = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double t = x.real[1][i] / cell;
		if (!(t >= 1 && t < 6)) continue;
		n++;
		middle += fabs(t - floor(t) - 0.5) < 0.25;
	}
	return n > 50 ? (double)middle / n : 0;
}

/* Of ten looks in the third second. */
static double mean_middle(double spread) {
	quern_run *run = open_chute(spread);
	double sum = 0;
	for (int look = 1; look <= 10; look++) {
		harness_until(run, 2 + 0.1 * look);
		sum += in_the_middle(run) / 10;
	}
	harness_close(run);
	return sum;
}

static void points_are_spread(void **unused) {
	(void)unused;
	table_head("points of a hybrid's chute in the middle halves of their cells");
	const double gathered = mean_middle(0);
	const bool good = table_row("spread", mean_middle(3), 0.5, 0.1);
	table_note("not spread", gathered);
	assert_true(good && gathered < 0.3);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(points_are_spread) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
