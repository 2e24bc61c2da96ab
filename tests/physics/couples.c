/* SPDX-License-Identifier: MIT */
/* Couples, which a law gives beside its force: grains that roll with resistance are slowed down as a couple of mu r f slows
 * them, none comes out of nothing, weights share them, and the energy that they store and take is in the books. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>

static const double gravity = 9.81, radius = 1e-3, resistance = 0.05;

/* A sphere is a hundredth as heavy as the same disc of one metre; softer laws let both lie as deep. */
static double stiffness(int dim) { return dim == 2 ? 1e4 : 100; } /* N/m */
#define ROLLING "{rolling: {stiffness: %g, damping: 0.001, friction: 0.05%s}}"
static const char *twisting(int dim) { return dim == 3 ? ", twisting_friction: 0.05" : ""; }

/* A disc or a sphere that rolls over a plane without slipping is slowed down by mu_r g m/(m + I/r^2), two thirds or five
 * sevenths of mu_r g. In 3-D it rolls askew to the axes. */
static void rolling_slows_down(void **state) {
	bool good = true;
	(void)state;
	table_head("deceleration of a grain that rolls, over mu_r g");
	for (int dim = 2; dim <= 3; dim++) {
		const double v = 0.5, along[3] = { dim == 2 ? 1 : 0.8, dim == 2 ? 0 : 0.6, 0 };
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s},\n"
			"time: {end: 1, step: 1e-6}, output: {every: 0.1, fields: [touch.couple]},\n"
			"bodies: [{plane: {point: %s, normal: %s}}],\n"
			"grains: {material: {density: 2500, radius: {mean: %g}},\n"
			"  contact: [{linear: {stiffness: %g, friction: 0.5}}, " ROLLING "],\n"
			"  place: [{position: %s, velocity: %s, spin: %s}]}}\n",
			dim, dim == 2 ? "[0, -9.81]" : "[0, 0, -9.81]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
			dim == 2 ? "[1, 0.1]" : "[1, 1, 0.1]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
			dim == 2 ? "[0, 1]" : "[0, 0, 1]", radius, stiffness(dim), stiffness(dim), twisting(dim),
			dim == 2 ? "[0.01, 0.000993]" : "[0.01, 0.01, 0.000999]", dim == 2 ? "[0.5, 0]" : "[0.4, 0.3, 0]",
			dim == 2 ? "[-500, 0]" : "[-300, 400, 0]");
		harness_until(run, 0.05); /* it has found its depth by then */
		const quern_column u = harness_field(run, "grain.velocity");
		double before = 0, after = 0;
		for (int k = 0; k < dim; k++) before += along[k] * u.real[k][0];
		const double begin = quern_run_time(run);
		harness_until(run, 0.25);
		const quern_column w = harness_field(run, "grain.velocity");
		for (int k = 0; k < dim; k++) after += along[k] * w.real[k][0];
		assert_true(before < v && after > 0.4 * v);
		good &= table_row(dim == 2 ? "disc" : "sphere",
			(before - after) / (quern_run_time(run) - begin) / (resistance * gravity),
			dim == 2 ? 2.0 / 3 : 5.0 / 7, 0.002);
		if (dim == 2) /* a couple of its own, not a force's: mu_r r m g */
			good &= table_row("couple over mu_r r m g",
				harness_field(run, "touch.couple").real[0][0] /
					(resistance * radius * gravity * 2500 * 3.141592653589793 * radius * radius),
				1, 0.01);
		harness_close(run);
	}
	assert_true(good);
}

/* Two grains of different sizes pressed together, without friction, turning against each other; with a weight each if
 * wanted. Where only couples act the spins' angular momentum, weighted, stays. */
static quern_run *pair(int dim, const char *observe) {
	return harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s},\n"
		"time: {end: 1, step: 2e-7}, output: {every: 0.1, fields: [grain.weight]}, observe: [%s],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, overlap: {start: 0.02},\n"
		"  contact: [{linear: {stiffness: %g, friction: 0, restitution: 0.9}}, " ROLLING "],\n"
		"  place: [{position: %s, spin: %s}, {position: %s, radius: 0.7 mm, spin: %s}]}}\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[0.02, 0.02]" : "[0.02, 0.02, 0.02]", observe, stiffness(dim), stiffness(dim),
		twisting(dim), dim == 2 ? "[0.01, 0.01]" : "[0.01, 0.01, 0.01]", dim == 2 ? "[3, 0]" : "[1, -2, 3]",
		dim == 2 ? "[0.01169, 0.01]" : "[0.0109757, 0.0109757, 0.0109757]",
		dim == 2 ? "[-20, 0]" : "[4, 5, -6]");
}

static void angular_momentum(quern_run *run, int dim, double out[3], double *size) {
	const quern_column s = harness_field(run, "grain.spin"), m = harness_field(run, "grain.mass"),
					   r = harness_field(run, "grain.radius"), w = harness_field(run, "grain.weight");
	*size = 0;
	for (int k = 0; k < (dim == 2 ? 1 : 3); k++) {
		out[k] = 0;
		for (uint32_t i = 0; i < 2; i++) {
			const double l = w.real[0][i] * m.real[0][i] * r.real[0][i] * r.real[0][i] * s.real[k][i];
			out[k] += l, *size += fabs(l);
		}
	}
}

static void couples_are_mutual(void **state) {
	static const double weights[][2] = { { 1, 1 }, { 0.5, 1 }, { 0.5, 0.5 } };
	bool good = true;
	(void)state;
	table_head("two grains that press: spin's angular momentum gained; difference of spins");
	for (int dim = 2; dim <= 3; dim++)
		for (int k = 0; k < 3; k++) {
			char name[80];
			double before[3], after[3], size, now;
			quern_run *run = pair(dim, "");
			harness_field(run, "grain.weight").real[0][0] = weights[k][0];
			harness_field(run, "grain.weight").real[0][1] = weights[k][1];
			const quern_column was = harness_field(run, "grain.spin");
			const double apart = was.real[0][0] - was.real[0][1];
			angular_momentum(run, dim, before, &size);
			harness_steps(run, 1500);
			angular_momentum(run, dim, after, &now);
			const quern_column is = harness_field(run, "grain.spin");
			snprintf(name, sizeof name, "%d-D, weights %g and %g", dim, weights[k][0], weights[k][1]);
			for (int c = 0; c < (dim == 2 ? 1 : 3); c++)
				good &= table_row(name, (after[c] - before[c]) / size, 0, 1e-14);
			const double left = (is.real[0][0] - is.real[0][1]) / apart;
			table_note("  left of their difference", left);
			assert_true(left < 0.999); /* or the test would not see a thing */
			harness_close(run);
		}
	assert_true(good);
}

/* All of a pair's energy, that which the couples store and take included: constant up to the integrator's error, which
 * falls with the step: that of the first order, which can be seen to fall. */
static double budget_gap(int dim, int n) {
	char step[32];
	snprintf(step, sizeof step, "%.17g", 1.6e-6 / n);
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s},\n"
		"time: {end: 1, step: %s}, output: {every: 0.1, fields: [total.kinetic, total.potential]}, observe: "
		"[energy],\n"
		"bodies: [{plane: {point: %s, normal: %s}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, integrator: symplectic_euler,\n"
		"  contact: [{linear: {stiffness: %g, friction: 0.3, restitution: 0.5}}, " ROLLING "],\n"
		"  place: [{position: %s, velocity: %s}, {position: %s, radius: 0.7 mm, spin: %s}]}}\n",
		dim, dim == 2 ? "[0, -9.81]" : "[0, 0, -9.81]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[0.05, 0.02]" : "[0.05, 0.02, 0.02]", step, dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[0, 1]" : "[0, 0, 1]", stiffness(dim), stiffness(dim), twisting(dim),
		dim == 2 ? "[0.01, 0.001001]" : "[0.01, 0.01, 0.001001]", dim == 2 ? "[0.06, 0]" : "[0.06, 0.01, 0]",
		dim == 2 ? "[0.013, 0.0008]" : "[0.013, 0.0101, 0.0008]", dim == 2 ? "[20, 0]" : "[5, 20, 10]");
	static const char *const parts[] = { "total.kinetic", "total.potential", "total.stored", "total.sheared",
		"total.damped", "total.rubbed" };
	double first = 0, worst = 0, kinetic = 0;
	for (int step_of = 0; quern_run_time(run) < 0.02; step_of++) {
		double sum = 0;
		harness_steps(run, 1);
		harness_look(run);
		for (int p = 0; p < 6; p++) sum += harness_field(run, parts[p]).real[0][0];
		if (step_of == 0) first = sum, kinetic = harness_field(run, parts[0]).real[0][0];
		worst = fmax(worst, fabs(sum - first));
	}
	const double rubbed = harness_field(run, "total.rubbed").real[0][0] / kinetic,
				 damped = harness_field(run, "total.damped").real[0][0] / kinetic;
	table_note(dim == 2 ? "2-D: lost to sliding and rolling" : "3-D: lost to sliding and rolling", rubbed);
	table_note("  lost in dashpots", damped);
	assert_true(rubbed > 0.02 && damped > 0.02); /* or the test would not see a thing */
	harness_close(run);
	return worst / kinetic;
}

static void energy_is_booked(void **state) {
	bool good = true;
	(void)state;
	table_head("energy not booked, over the kinetic one at the start");
	for (int dim = 2; dim <= 3; dim++) {
		const double coarse = budget_gap(dim, 1), fine = budget_gap(dim, 2);
		good &= table_row(dim == 2 ? "2-D, step of 1.6 us" : "3-D, step of 1.6 us", coarse, 0, 2e-3);
		good &= table_row("  half the step, over that", fine / coarse, 0.4, 0.2);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(rolling_slows_down),
		cmocka_unit_test(couples_are_mutual), cmocka_unit_test(energy_is_booked) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
