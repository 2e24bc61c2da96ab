/* SPDX-License-Identifier: MIT */
/* What is seen when somebody looks is the state as it is: before the first step too, whatever near grains do; of bodies that
 * are there alone. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>

/* A grain near the floor, however slowly it comes, feels nothing of it: its kinetic energy is what it was given. */
static void near_and_slow(void **state) {
	static const double speeds[] = { 1e-3, 1e-9, 1e-13, 1e-100, 1e-300, 4e-324 };
	static const char *const laws[] = { "linear: {stiffness: 1e6}", "hertz: {young: 1e9, impact_speed: 1}" };
	bool good = true;
	(void)state;
	table_head("kinetic energy of a grain above the floor, over what it was given");
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int law = 0; law < 2; law++)
			for (size_t k = 0; k < sizeof speeds / sizeof *speeds; k++) {
				const char *more = dim == 2 ? "" : ", 0";
				quern_run *run = harness_open(1,
					"{quern: 1, dimension: %u, gravity: [0, 0%s], domain: {lower: [0, 0%s], upper: [1, "
					"1%s]},\n"
					"time: {end: 1, step: 1e-7}, output: {every: 0.1, fields: [total.kinetic, "
					"total.sheared]},\n"
					"bodies: [{plane: {point: [0, 0%s], normal: [0, 1%s]}}],\n"
					"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: {%s},\n"
					"  place: [{position: [0.5, 0.0105%s], velocity: [1, %.17g%s]}]}}\n",
					dim, more, more, dim == 2 ? "" : ", 1", more, more, laws[law], dim == 2 ? "" : ", 0.5",
					-speeds[k], dim == 2 ? "" : ", 0.25");
				harness_settle(run);
				const double m = harness_field(run, "grain.mass").real[0][0];
				char name[80];
				snprintf(name, sizeof name, "%u-D %.5s, %g m/s", dim, laws[law], speeds[k]);
				harness_look(run);
				good &= table_row(name, harness_field(run, "total.kinetic").real[0][0] / (0.5 * m),
					dim == 2 ? 1 : 1.0625, 1e-5);
				harness_steps(run, 3);
				harness_look(run);
				good &= table_row(name, harness_field(run, "total.kinetic").real[0][0] / (0.5 * m),
					dim == 2 ? 1 : 1.0625, 1e-5);
				harness_close(run);
			}
	assert_true(good);
}

/* A gate that is there while grains settle is gone at the release: nothing leans on it any more. */
static void a_gate_is_gone(void **state) {
	(void)state;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [9.81, -9.81], domain: {lower: [0, 0], upper: [1, 1]},\n"
		"time: {end: 1}, output: {every: 0.1, fields: [total.stored, total.kinetic, touch.force]}, observe: "
		"[energy],\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1]}}, {plane: {point: [0.5, 0], normal: [-1, 0], "
		"while: settling}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: {linear: {stiffness: 1e6, "
		"friction: 0}},\n"
		"  fill: [{region: {box: {lower: [0.48, 0.011], upper: [0.48, 0.011]}}, settle: true}]}}\n");
	harness_settle(run);
	harness_look(run);
	const double m = harness_field(run, "grain.mass").real[0][0], f = m * 9.81;
	table_head("stored at the release, over that of the floor");
	assert_true(
		table_row("stored", harness_field(run, "total.stored").real[0][0] / (0.5 * f * f / 1e6), 1, 1e-2));
	harness_close(run);
}

/* The square of the tangential spring of the one grain, moved on by so many seconds of the slip at the floor, whose normal is y. */
static double stretched(quern_run *run, int dim, double time) {
	const quern_column slip = harness_field(run, "touch.slip"), spin = harness_field(run, "grain.spin"),
					   v = harness_field(run, "grain.velocity");
	const double height = harness_field(run, "grain.position").real[1][0], arm = 0.5 * (0.01 + height);
	const double turns = spin.real[dim == 2 ? 0 : 2][0], along = v.real[0][0] + arm * turns;
	if (dim == 2) return pow(slip.real[0][0] - time * along, 2); /* the tangent is -x */
	const double across = v.real[2][0] - arm * spin.real[0][0];
	return pow(slip.real[0][0] + time * along, 2) + pow(slip.real[1][0], 2) +
		   pow(slip.real[2][0] + time * across, 2);
}

/* Velocity Verlet asks for forces at the positions that it leaves, and moves tangential springs to them: who looks must not
 * move them once more. Position Verlet goes on by half a step after that, and so must who looks. What springs hold is k_t xi^2/2. */
static void springs_stay(void **state) {
	static const char *const scenes[] = { "2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [1, 1]}",
		"3, gravity: [0, -9.81, 0], domain: {lower: [0, 0, 0], upper: [1, 1, 1]}" };
	static const char *const integrators[] = { "velocity_verlet", "position_verlet" };
	static const double later[] = { 0, 1e-6 }; /* s */
	bool good = true;
	(void)state;
	for (int which = 0; which < 4; which++) {
		const int dim = 2 + which % 2, with = which / 2;
		const char *more = dim == 2 ? "" : ", 0";
		char what[80];
		snprintf(what, sizeof what, "energy of a tangential spring over k_t xi^2/2, %s", integrators[with]);
		table_head(what);
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: %s, time: {end: 1, step: 2e-6}, output: {every: 0.1}, observe: [energy],\n"
			"bodies: [{plane: {point: [0, 0%s], normal: [0, 1%s]}}], grains: {integrator: %s,\n"
			"  material: {density: 2500, radius: {mean: 0.01}}, contact: {linear: {stiffness: 1e5, friction: "
			"10, tangential_stiffness: 0.5}},\n"
			"  place: [{position: [0.5, 0.00995%s], velocity: [0.01, 0%s]}]}}\n",
			scenes[dim - 2], more, more, integrators[with], dim == 2 ? "" : ", 0.5", more);
		for (int k = 0; k < 5; k++) {
			harness_steps(run, 7);
			harness_look(run);
			good &= table_row(dim == 2 ? "2-D" : "3-D",
				harness_field(run, "total.sheared").real[0][0] /
					(0.5 * 0.5e5 * stretched(run, dim, later[with])),
				1, 1e-12);
		}
		harness_close(run);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(near_and_slow), cmocka_unit_test(a_gate_is_gone),
		cmocka_unit_test(springs_stay) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
