/* SPDX-License-Identifier: MIT */
/* How a scene starts: how high its material lies, and what of it may stand where. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>
#include <string.h>

static double published(const quern_run *run, const char *name) {
	for (size_t i = 0; i < run->scene->n_published; i++)
		if (!strcmp(run->scene->published[i].name, name)) return run->scene->published[i].value;
	fail_msg("nobody publishes %s", name);
	return NAN;
}

/* The height of a fill is its extent along gravity, of all loose fills together, for grains and continuum alike: what is
 * wide is not high. The bulk modulus of grains with a Hertz law follows it. */
static void height_is_along_gravity(void **state) {
	static const struct {
		const char *name, *gravity, *fills;
		double height;
	} scenes[] = { { "a wide bed", "[0, -9.81]", "{region: {box: {lower: [0, 0], upper: [1, 0.05]}}}", 0.05 },
		{ "the same, gravity askew", "[3.36, -9.22]", "{region: {box: {lower: [0, 0], upper: [1, 0.05]}}}",
			0.05 },
		{ "the same, gravity along x", "[9.81, 0]", "{region: {box: {lower: [0, 0], upper: [1, 0.05]}}}", 1 },
		{ "two layers", "[0, -9.81]",
			"{region: {box: {lower: [0, 0.05], upper: [1, 0.1]}}}, {region: {box: {lower: [0, 0], upper: [1, "
			"0.05]}}}",
			0.1 } };
	bool good = true;
	(void)state;
	table_head("height of the fill, m; PIC rate over sqrt(g/L)");
	for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++)
		for (int grains = 0; grains <= 1; grains++) {
			char body[400];
			snprintf(body, sizeof body,
				grains ? "grains: {material: {density: 2500, radius: {mean: 5 mm}},\n"
						 "  contact: {linear: {stiffness: 1e6}}, fill: [%s]}\n"
					   : "continuum: {cell: 0.05, material: {elastic: {bulk_modulus: 1e6, density: 1500}}, "
						 "fill: [%s]}\n",
				scenes[k].fills);
			quern_run *run = harness_open(1,
				"quern: 1\ndimension: 2\ngravity: %s\ndomain: {lower: [0, 0], upper: [1, 1]}\ntime: {end: "
				"1}\n%s",
				scenes[k].gravity, body);
			const double height = published(run, "fill.height"), rate = published(run, "fill.rate");
			good &= table_row(scenes[k].name, height, scenes[k].height, 1e-12);
			good &=
				table_row(grains ? "  grains" : "  continuum", rate / sqrt(9.81 / scenes[k].height), 1, 1e-3);
			harness_close(run);
		}
	assert_true(good);
}

/* The stiffness of a Hertz contact under the weight of the fill is that under its whole height, whatever the order of the
 * fills: with it goes the bulk modulus that a continuum takes. */
static void stiffness_is_that_of_the_whole(void **state) {
#define LAYER(from, to) "{region: {box: {lower: [0, " from "], upper: [0.2, " to "]}}}"
	static const char *const fills[] = { LAYER("0", "0.2"), (LAYER("0", "0.15") ", " LAYER("0.15", "0.2")),
		(LAYER("0.15", "0.2") ", " LAYER("0", "0.15")) };
	double bulk[3];
	(void)state;
	for (int k = 0; k < 3; k++) {
		quern_run *run = harness_open(1,
			"quern: 1\ndimension: 2\ngravity: [0, -9.81]\ndomain: {lower: [0, 0], upper: [1, 1]}\ntime: "
			"{end: "
			"1}\ngrains: {material: {density: 2500, radius: {mean: 5 mm}}, contact: {hertz: {young: 1e8}}, "
			"fill: "
			"[%s]}\n",
			fills[k]);
		bulk[k] = published(run, "grain.bulk_modulus");
		harness_close(run);
	}
	assert_true(bulk[0] > 0 && fabs(bulk[1] / bulk[0] - 1) < 1e-12 && fabs(bulk[2] / bulk[0] - 1) < 1e-12);
}

/* What of a fill lies in a body that acts on the continuum is left out, and no more: the mass is that of the room. */
static void points_in_bodies_are_left_out(void **state) {
	static const struct {
		const char *name, *bodies;
		double room; /* m^2, of the fill's 0.64 */
	} scenes[] = { { "no body", "", 0.64 },
		{ "a plane under it", "{plane: {point: [0, 0.3], normal: [0, 1]}}", 0.8 * 0.6 },
		{ "an oblique plane", "{plane: {point: [0.1, 0.1], normal: [1, 1]}}", 0.64 },
		{ "a plane through its corners", "{plane: {point: [0.5, 0.5], normal: [1, 1]}}", 0.34 },
		{ "a box within", "{box: {lower: [0.3, 0.3], upper: [0.5, 0.6]}}", 0.64 - 0.06 },
		{ "two that overlap",
			"{box: {lower: [0.3, 0.3], upper: [0.5, 0.6]}}, {plane: {point: [0, 0.4], normal: [0, 1]}}",
			0.8 * 0.5 - 0.2 * 0.2 },
		{ "one of settling", "{plane: {point: [0, 0.3], normal: [0, 1], while: settling}}", 0.64 },
		{ "one that does nothing to the grid", "{plane: {point: [0, 0.3], normal: [0, 1], boundary: none}}",
			0.64 } };
	bool good = true;
	(void)state;
	table_head("mass of a fill over its density, m^2");
	for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [1, 1]}, time: "
			"{end: "
			"1},\nbodies: [%s],\ncontinuum: {cell: 0.1, material: {elastic: {bulk_modulus: 1e6, density: "
			"1500}},\n  fill: [{region: {box: {lower: [0.1, 0.1], upper: [0.9, 0.5]}}}, {region: {box: "
			"{lower: "
			"[0.1, 0.5], upper: [0.9, 0.9]}}}]}}\n",
			scenes[k].bodies);
		const quern_column m = harness_field(run, "point.mass");
		double mass = 0;
		for (uint32_t i = 0; i < harness_count(run, "point"); i++) mass += m.real[0][i];
		good &= table_row(scenes[k].name, mass / 1500, scenes[k].room, 1e-9);
		harness_close(run);
	}
	assert_true(good);
}

/* Places of the points of a lattice of 10 to a side in a unit square, which are moved off theirs by `jitter`. */
static void lattice_places(double jitter, int seed, double x[2][100]) {
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, seed: %d, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [1, 1]}, time: {end: 1},\n"
		"continuum: {cell: 0.2, material: {elastic: {bulk_modulus: 1e6, density: 1500}}, fill: {jitter: %g, "
		"region: {box: {lower: [0, 0], upper: [1, 1]}}}}}\n",
		seed, jitter);
	const quern_column places = harness_field(run, "point.position");
	assert_int_equal(harness_count(run, "point"), 100);
	for (int k = 0; k < 2; k++)
		for (int i = 0; i < 100; i++) x[k][i] = places.real[k][i];
	harness_close(run);
}

/* Points may be moved off their lattice: by no more than is asked, to all sides alike, another way with another seed, and always the
 * same way with the same. */
static void points_off_their_places(void **state) {
	double plain[2][100], moved[2][100], again[2][100], other[2][100];
	(void)state;
	lattice_places(0, 1, plain);
	lattice_places(0.5, 1, moved);
	lattice_places(0.5, 1, again);
	lattice_places(0.5, 2, other);
	assert_memory_equal(moved, again, sizeof moved);
	double both = 0; /* axes have numbers of their own */
	for (int i = 0; i < 100; i++)
		both += (moved[0][i] - plain[0][i]) * (moved[1][i] - plain[1][i]) / (0.025 * 0.025 * 100);
	assert_true(fabs(both) < 0.1);
	for (int k = 0; k < 2; k++) {
		double sum = 0, square = 0, least = 1;
		for (int i = 0; i < 100; i++) {
			const double off = (moved[k][i] - plain[k][i]) / (0.5 * 0.1 * 0.5);
			assert_true(fabs(off) <= 1 + 1e-9);
			sum += off / 100, square += off * off / 100;
			least = fmin(least, fabs(moved[k][i] - other[k][i]));
		}
		assert_true(fabs(sum) < 0.2 && fabs(square - 1.0 / 3) < 0.1 && least > 0);
	}
}

/* What plan and run say about settling is within a factor of three of what it takes, in steps: it scales with the height
 * of the fill and with the step. A tenth of the stiffness needs a third of the steps. */
static void settling_is_estimated(void **state) {
	static const struct {
		const char *name, *dim, *gravity, *upper, *body, *fill, *stiffness;
	} beds[] = { { "5 discs high", "2", "0, -9.81", "0.02, 0.1", "[0, 0], normal: [0, 1]",
					 "{lower: [0, 0], upper: [0.02, 0.01]}", "1e5" },
		{ "40 discs high", "2", "0, -9.81", "0.02, 0.1", "[0, 0], normal: [0, 1]",
			"{lower: [0, 0], upper: [0.02, 0.08]}", "1e5" },
		{ "5 spheres high", "3", "0, 0, -9.81", "0.01, 0.01, 0.1", "[0, 0, 0], normal: [0, 0, 1]",
			"{lower: [0, 0, 0], upper: [0.01, 0.01, 0.01]}", "1e3" },
		{ "the same, a tenth as stiff", "3", "0, 0, -9.81", "0.01, 0.01, 0.1", "[0, 0, 0], normal: [0, 0, 1]",
			"{lower: [0, 0, 0], upper: [0.01, 0.01, 0.01]}", "1e2" } };
	(void)state;
	bool good = true;
	table_head("steps of settling over the estimate, its logarithm to base 3");
	for (size_t k = 0; k < sizeof beds / sizeof *beds; k++) {
		quern_run *run = harness_open(1,
			"quern: 1\ndimension: %s\ngravity: [%s]\ndomain: {lower: [%s], upper: [%s], periodic: [%s]}\n"
			"time: {end: 1}\nbodies: [{plane: {point: %s}}]\n"
			"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 0.2}},\n"
			"  contact: {linear: {stiffness: %s, friction: 0.5}}, fill: {region: {box: %s}, settle: true}}\n",
			beds[k].dim, beds[k].gravity, *beds[k].dim == '2' ? "0, 0" : "0, 0, 0", beds[k].upper,
			*beds[k].dim == '2' ? "true, false" : "true, true, false", beds[k].body, beds[k].stiffness,
			beds[k].fill);
		double dt;
		const double about = quern_run_settling(run, &dt);
		harness_settle(run);
		good &= table_row(beds[k].name, log((double)run->clock.settle_step / about) / log(3), 0, 1);
		harness_close(run);
	}
	assert_true(good);
}

/* s, of the step with which spheres settle, by restitution and by what the scene asks for; and of the step with which they run. */
static double settling_step(double restitution, double asked, double *running) {
	double dt;
	quern_run *run = harness_open(1,
		"quern: 1\ndimension: 3\ngravity: [0, 0, -9.81]\ntime: {end: 1}\n"
		"domain: {lower: [0, 0, 0], upper: [0.01, 0.01, 0.1], periodic: [true, true, false]}\n"
		"bodies: [{plane: {point: [0, 0, 0], normal: [0, 0, 1]}}]\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, settle: {step: %g, most: 5},\n"
		"  contact: {linear: {stiffness: 1e3, restitution: %g, friction: 0.5}},\n"
		"  fill: {region: {box: {lower: [0, 0, 0], upper: [0.01, 0.01, 0.01]}}, settle: true}}\n",
		asked, restitution);
	quern_run_settling(run, &dt);
	harness_settle(run);
	harness_steps(run, 1);
	*running = run->clock.dt;
	harness_close(run);
	return dt;
}

/* Settling takes the step that is asked for, up to the limit; half of the limit where dashpots put that below. By default it is never shorter than the step of
 * the run. */
static void settling_takes_its_step(void **state) {
	double running;
	(void)state;
	const double tenth = settling_step(0.9, 0.1, &running);
	assert_true(fabs(settling_step(0.9, 0.05, &running) / tenth - 0.5) < 1e-9);
	assert_true(fabs(settling_step(0.9, 0.2, &running) / tenth - 2) < 1e-9);
	const double before = settling_step(0.25, 0.1, &running);
	for (double e = 0.19; e > 0.1; e -= 0.04) {
		const double now = settling_step(e, 0.1, &running);
		assert_true(now < before && now > 0.25 * before);
		assert_true(now >= running);
	}
}

/* Grains are looked at once in a contact's duration, however many steps that has: here 2^32. */
static void steps_may_be_as_short(void **state) {
	static const char *const levels[] = { "v1", "auto" };
	(void)state;
	for (int k = 0; k < 2; k++) {
		quern_run *run = harness_open(1,
			"quern: 1\ndimension: 2\ngravity: [0, -9.81]\ndomain: {lower: [0, 0], upper: [0.1, 0.1]}\ntime: "
			"{end: "
			"1}\nrun: {instructions: %s}\ngrains: {material: {density: 2500, radius: {mean: 1 mm}},\n"
			"  contact: {linear: {stiffness: 1e5}}, settle: {step: 2.3283064365386963e-10, most: 400},\n"
			"  fill: {region: {box: {lower: [0.01, 0.01], upper: [0.012, 0.012]}}, settle: true}}\n",
			levels[k]);
		harness_settle(run);
		assert_int_equal(run->clock.settle_step, 400);
		harness_close(run);
	}
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(height_is_along_gravity),
		cmocka_unit_test(stiffness_is_that_of_the_whole), cmocka_unit_test(points_in_bodies_are_left_out),
		cmocka_unit_test(settling_is_estimated), cmocka_unit_test(settling_takes_its_step),
		cmocka_unit_test(points_off_their_places), cmocka_unit_test(steps_may_be_as_short) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
