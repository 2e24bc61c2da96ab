/* SPDX-License-Identifier: MIT */
/* Room without material costs nothing: a block that flies through a domain of 10^9 cells has as many nodes around it at any time as in a
 * domain that it nearly fills, they come and go with it, and it moves alike. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>

enum { LOOKS = 12, STEPS = 20 };

/* Nodes at each look, and the farthest that a point is from where it should be, in cells. A block of 8 cells a side flies 24 along x in a
 * domain from `low` to `high` cells along every axis. */
static double fly(int low, int high, double nodes[LOOKS]) {
	quern_run *run = harness_open(0,
		"{quern: 1, dimension: 3, gravity: [0, 0, 0], domain: {lower: [%d, %d, %d], upper: [%d, %d, %d]},\n"
		"time: {end: 1, step: 1e-3}, continuum: {cell: 1, material: {elastic: {bulk_modulus: 1e4, density: 1500}},\n"
		"  fill: {velocity: [100, 0, 0], region: {box: {lower: [3, 3, 3], upper: [11, 11, 11]}}}}}\n",
		low, low, low, high, high, high);
	const uint32_t n = harness_count(run, "point");
	double first = 0, off = 0;
	for (int look = 0; look < LOOKS; look++) {
		double mean = 0;
		harness_steps(run, STEPS);
		nodes[look] = harness_count(run, "node");
		const quern_column x = harness_field(run, "point.position");
		for (uint32_t i = 0; i < n; i++) mean += x.real[0][i] / n;
		if (look == 0) first = mean;
		off = fmax(off, fabs(mean - first - look * STEPS * 0.1));
	}
	assert_int_equal(n, 16 * 16 * 16);
	harness_close(run);
	return off;
}

static void room_costs_nothing(void **unused) {
	double small[LOOKS], large[LOOKS], most = 0;
	bool good = true;
	(void)unused;
	const double near = fly(-8, 48, small), far = fly(-496, 504, large);
	table_head("a block that flies 24 cells: off its way, cells; nodes in 10^9 cells less those in 56^3");
	good &= table_row("56^3 cells", near, 0, 1e-9);
	good &= table_row("10^9 cells", far, 0, 1e-9);
	for (int k = 0; k < LOOKS; k++) {
		most = fmax(most, fabs(large[k] - small[k]));
		good &=
			small[k] > 0 && large[k] <= 20 * 20 * 20; /* five blocks of four a side: none is kept behind */
	}
	good &= table_row("nodes", most, 0, 0.5);
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(room_costs_nothing) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
