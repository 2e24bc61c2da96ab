/* What is written out is seen, not made: asking for a field changes no bit of a run, and does not turn a scene into
 * another one, such as a hybrid. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
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
} scene;

static void compare_runs(const scene *s) {
	char name[40];
	quern_run *plain = s->open("[]"), *shown = s->open(s->fields);
	const uint32_t n = harness_count(plain, s->set);
	assert_true(n > 0);
	assert_int_equal(harness_count(shown, s->set), n);
	harness_steps(plain, 200);
	harness_steps(shown, 200);
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
	compare_runs(&(scene) { grains, "grain", "[grain.weight, grain.force, contact.force, touch.force]" });
	compare_runs(&(scene) { continuum, "point", "[point.weight, point.gradient, point.pressure]" });
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(weights) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
