/* SPDX-License-Identifier: MIT */
/* A body of several features, here a corner of two planes: a grain touches each with a history of its own, so that it moves
 * as between two bodies of one plane each, to the last bit. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include <string.h>

/* Three grains that roll over a floor into a wall, climb it a little by their spin, and come back. */
static quern_run *roll(int dim, const char *bodies) {
	return harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s},\n"
		"time: {end: 1}, output: {every: 0.1},\nbodies: [%s],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, contact: {linear: {stiffness: %g, "
		"friction: "
		"0.5}},\n"
		"  place: [{position: %s, velocity: %s, spin: %s}, {position: %s, velocity: %s, radius: 1.3 mm},\n"
		"    {position: %s}]}}\n",
		dim, dim == 2 ? "[0, -9.81]" : "[0, 0, -9.81]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[0.05, 0.05]" : "[0.05, 0.05, 0.05]", bodies, dim == 2 ? 1e4 : 100,
		dim == 2 ? "[0.004, 0.001]" : "[0.004, 0.01, 0.001]", dim == 2 ? "[-0.3, 0]" : "[-0.3, 0.02, 0]",
		dim == 2 ? "[300, 0]" : "[20, -300, 10]", dim == 2 ? "[0.008, 0.0013]" : "[0.008, 0.0102, 0.0013]",
		dim == 2 ? "[-0.3, 0]" : "[-0.3, 0, 0.01]", dim == 2 ? "[0.001, 0.003]" : "[0.001, 0.01, 0.003]");
}

static quern_run *roll_on_planes(int dim) {
	return roll(
		dim, dim == 2 ? "{plane: {point: [0, 0], normal: [0, 1]}}, {plane: {point: [0, 0], normal: [1, 0]}}"
					  : "{plane: {point: [0, 0, 0], normal: [0, 0, 1]}}, {plane: {point: [0, 0, 0], "
						"normal: [1, 0, 0]}}");
}

static quern_run *roll_in_corner(int dim) {
	return roll(dim, dim == 2 ? "{corner: {point: [0, 0], first: [0, 1], second: [1, 0]}}"
							  : "{corner: {point: [0, 0, 0], first: [0, 0, 1], second: [1, 0, 0]}}");
}

static void assert_same(quern_run *a, quern_run *b, const char *field, int components) {
	for (int k = 0; k < components; k++)
		assert_memory_equal(harness_field(a, field).real[k], harness_field(b, field).real[k],
			harness_count(a, "grain") * sizeof(double));
}

static bool remembers(quern_run *run, int dim, uint32_t i, int32_t feature) {
	const quern_column slip = harness_field(run, "touch.slip");
	bool any = false;
	for (int k = 0; k < (dim == 2 ? 1 : 3); k++) any = any || slip.real[k][i] != 0;
	return any && harness_field(run, "touch.feature").index[i] == feature;
}

/* Touches of one grain with both features, both with something to remember. */
static bool in_both(quern_run *run, int dim) {
	const int32_t *grain = harness_field(run, "touch.grain").index;
	const uint32_t n = harness_count(run, "touch");
	for (uint32_t i = 0; i < n; i++)
		for (uint32_t j = 0; j < n; j++)
			if (grain[i] == grain[j] && remembers(run, dim, i, 0) && remembers(run, dim, j, 1)) return true;
	return false;
}

static void each_feature_remembers(void **state) {
	(void)state;
	for (int dim = 2; dim <= 3; dim++) {
		quern_run *planes = roll_on_planes(dim), *corner = roll_in_corner(dim);
		bool both = false, apart = false;
		for (int k = 0; k < 600; k++) {
			harness_steps(planes, 5);
			harness_steps(corner, 5);
			assert_same(planes, corner, "grain.position", dim);
			assert_same(planes, corner, "grain.velocity", dim);
			assert_same(planes, corner, "grain.spin", dim == 2 ? 1 : 3);
			both = both || in_both(corner, dim);
			apart = apart || (both && !in_both(corner, dim));
		}
		assert_true(both && apart); /* one was in the corner, with two histories, and has rolled away again */
		assert_false(harness_has(planes, "touch.feature"));
		harness_close(planes);
		harness_close(corner);
	}
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(each_feature_remembers) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
