/* SPDX-License-Identifier: MIT */
/* What is written out is seen, not made: asking for a field changes no bit of a run, and does not turn a scene into
 * another one, such as a hybrid. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <observe.h>
#include <string.h>

static quern_run *grains(const char *fields) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [0.03, 0.05]},\n"
		"time: {end: 1}, output: {every: 0.1, fields: %s},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1]}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.001, spread: 0.1}}, integrator: "
		"velocity_verlet,\n"
		"  contact: {linear: {stiffness: 1e5}}, fill: {region: {box: {lower: [0.01, 0.001], upper: [0.02, "
		"0.01]}}}}}\n",
		fields);
}

/* Flows through a face that leads to the other side, where places round by when lists are made. */
static quern_run *flow(const char *fields) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [9.81, -9.81], domain: {lower: [0, 0], upper: [0.03, 0.05], periodic: [true, false]},\n"
		"time: {end: 1}, output: {every: 0.1, fields: %s},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1]}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.001, spread: 0.1}},\n"
		"  contact: {linear: {stiffness: 1e5}}, fill: {region: {box: {lower: [0, 0.001], upper: [0.03, 0.01]}},\n"
		"  velocity: [1, 0]}}}\n",
		fields);
}

static quern_run *continuum(const char *fields) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [0.4, 0.4]},\n"
		"time: {end: 1}, output: {every: 0.1, fields: %s},\n"
		"continuum: {cell: 0.02, material: {mu_i: {bulk_modulus: 1e5, diameter: 2 mm, grain_density: 2500,\n"
		"  critical_density: 1900}}, fill: {region: {box: {lower: [0, 0], upper: [0.1, 0.2]}}}}}\n",
		fields);
}

typedef struct scene {
	quern_run *(*open)(const char *fields);
	const char *set, *fields;
	int steps;
} scene;

static void compare_runs(const scene *s) {
	char name[40];
	quern_run *plain = s->open("[]"), *shown = s->open(s->fields);
	const uint32_t n = harness_count(plain, s->set);
	assert_true(n > 0);
	assert_int_equal(harness_count(shown, s->set), n);
	harness_steps(plain, s->steps);
	harness_steps(shown, s->steps);
	assert_int_equal(harness_count(shown, s->set), n);
	for (int f = 0; f < 2; f++) {
		snprintf(name, sizeof name, "%s.%s", s->set, f ? "position" : "velocity");
		for (int k = 0; k < 2; k++)
			assert_memory_equal(
				harness_field(plain, name).real[k], harness_field(shown, name).real[k], n * sizeof(double));
	}
	harness_close(plain);
	harness_close(shown);
}

/* A weight is 1 where nothing shares the mass. */
static void weights(void **state) {
	(void)state;
	compare_runs(
		&(scene) { grains, "grain", "[grain.weight, grain.force, contact.force, touch.force]", 200 });
	compare_runs(&(scene) { flow, "grain", "[grain.weight]", 2000 });
	compare_runs(&(scene) { continuum, "point", "[point.weight, point.gradient, point.pressure]", 200 });
}

/* Two observers of one body say the same: the weight that rests on it. */
static void two_observers_of_one_body(void **state) {
	const double weight = 9.81 * 2500 * 3.141592653589793 * 1e-6;
	bool good = true;
	quern_series series;
	(void)state;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [0.03, 0.05]},\n"
		"time: {end: 1}, output: {every: 0.1}, observe: [{wall_force: {body: 1}}, {wall_force: {body: 1}}],\n"
		"bodies: [{plane: {point: [0, 0], normal: [1, 0]}}, {plane: {point: [0, 0], normal: [0, 1]}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.001}}, contact: {linear: {stiffness: 1e4}},\n"
		"  place: [{position: [0.01, %.17g]}]}}\n",
		0.001 - weight / 1e4);
	assert_int_equal(quern_series_init(&series, run, 0), QUERN_OK);
	assert_int_equal(series.n, 3 + 2 * 3); /* time, step, grains; x, y, z of either */
	table_head("force of a grain on the floor over its weight, by two observers");
	harness_settle(run);
	for (int k = 0; k < 3; k++) {
		assert_int_equal(quern_series_add(&series, run), QUERN_OK);
		good &= table_row("first", series.column[4].last / weight, k ? -1 : 0, 1e-9);
		good &= table_row("second", series.column[7].last / weight, k ? -1 : 0, 1e-9);
		harness_steps(run, 100);
	}
	quern_series_finish(&series);
	harness_close(run);
	assert_true(good);
}

/* A spin whose energy is beyond all numbers, which no scene may begin with: the run's account says so. */
static void sums_are_finite(void **state) {
	(void)state;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [1, 1]},\n"
		"time: {end: 1}, output: {every: 0.1},\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: {linear: {stiffness: 1e5}},\n"
		"  place: [{position: [0.5, 0.5]}]}}\n");
	assert_int_equal(quern_run_check_account(run), QUERN_OK);
	harness_field(run, "grain.spin").real[0][0] = 1e300;
	assert_int_equal(quern_run_check_account(run), QUERN_E_NUMERIC);
	assert_non_null(strstr(run->message, "kinetic"));
	harness_close(run);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(weights),
		cmocka_unit_test(two_observers_of_one_body), cmocka_unit_test(sums_are_finite) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
