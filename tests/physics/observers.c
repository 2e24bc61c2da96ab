/* SPDX-License-Identifier: MIT */
/* Observers against closed forms: contacts of a flower and a pyramid, discs and spheres cut by the faces of boxes, fluxes
 * through planes, temperature and slope. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "seen.h"
#include "table.h"
#include <math.h>

static const double pi = 3.141592653589793;

/* Grains without gravity in a domain of one metre; `more` begins with the observers. */
static seen grains(int dim, const char *more, const char *place) {
	return watch(harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s%s,\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, overlap: {start: 0.1},\n"
		"  contact: {linear: {stiffness: 1e5, friction: 0, restitution: 1}}, place: [%s]}}\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[1, 1]" : "[1, 1, 1]", more, place));
}
#define ALONE "}, time: {end: 10}, output: {every: 10}, observe: "

/* ---- coordination ---- */

/* One grain with six around it, each of which touches three; one more beside them, and one alone. */
static void flower(void **state) {
	char place[1000];
	bool good = true;
	(void)state;
	int n = snprintf(place, sizeof place, "{position: [0.5, 0.5]}");
	for (int k = 0; k < 6; k++)
		n += snprintf(place + n, sizeof place - (size_t)n, ", {position: [%.17g, %.17g]}",
			0.5 + 0.0199 * cos(k * pi / 3), 0.5 + 0.0199 * sin(k * pi / 3));
	snprintf(place + n, sizeof place - (size_t)n, ", {position: [0.5396, 0.5]}, {position: [0.9, 0.9]}");
	seen s = grains(2,
		ALONE "[coordination, {coordination: {rattlers: false, label: without}}, {coordination: {label: "
			  "middle, region: {box: "
			  "{lower: [0.49, 0.49], upper: [0.51, 0.51]}}}}, {coordination: {label: nowhere, region: {box: "
			  "{lower: [0, 0], "
			  "upper: [0.1, 0.1]}}}}]",
		place);
	table_head("contacts per grain of a flower");
	good &= table_row("all", value(&s, "coordination.number"), 26.0 / 9, 1e-14);
	good &= table_row("rattlers", value(&s, "coordination.rattlers"), 2.0 / 9, 1e-14);
	good &= table_row("without them", value(&s, "without.number"), 24.0 / 7, 1e-14);
	good &= table_row("grains then", value(&s, "without.grains"), 7, 0);
	good &= table_row("in the middle", value(&s, "middle.number"), 6, 0);
	good &= table_row("where nothing is", value(&s, "nowhere.number"), 0, 0);
	leave(&s);
	assert_true(good);
}

/* Three spheres on the floor, one on top: three contacts between grains and one with the floor; the top has three. */
static void pyramid(void **state) {
	const double d = 0.0199, r = 0.01;
	bool good = true;
	(void)state;
	seen s = watch(harness_open(1,
		"{quern: 1, dimension: 3, gravity: [0, 0, 0], domain: {lower: [0, 0, 0], upper: [1, 1, 1]}, time: "
		"{end: 1},\n"
		"output: {every: 1}, observe: [coordination, {coordination: {rattlers: false, label: without}}],\n"
		"bodies: [{plane: {point: [0, 0, 0], normal: [0, 0, 1]}}],\n"
		"grains: {material: {density: 2500, radius: {mean: %g}}, overlap: {start: 0.1}, contact: {linear: "
		"{stiffness: 1e5}},\n"
		"  place: [{position: [0.5, 0.5, 0.0099]}, {position: [%.17g, 0.5, 0.0099]}, {position: [%.17g, "
		"%.17g, 0.0099]},\n"
		"    {position: [%.17g, %.17g, %.17g]}, {position: [0.8, 0.8, 0.0099]}]}}\n",
		r, 0.5 + d, 0.5 + d / 2, 0.5 + d * sqrt(0.75), 0.5 + d / 2, 0.5 + d * sqrt(0.75) / 3,
		0.0099 + d * sqrt(2.0 / 3)));
	table_head("contacts per grain of a pyramid on a floor, with a grain beside it");
	good &= table_row("all", value(&s, "coordination.number"), (3 * 4 + 3 + 1) / 5.0, 1e-14);
	good &= table_row("without the one beside it", value(&s, "without.number"), (3 * 4 + 3) / 4.0, 1e-14);
	leave(&s);
	assert_true(good);
}

/* ---- packing fraction ---- */

static double fraction_in(
	int dim, const double low[3], const double high[3], const char *periodic, const char *place) {
	char more[400];
	if (dim == 2)
		snprintf(more, sizeof more,
			"%s}, time: {end: 1}, output: {every: 1}, observe: {packing_fraction: {region: {box: "
			"{lower: "
			"[%.17g, %.17g], upper: [%.17g, %.17g]}}}}",
			periodic, low[0], low[1], high[0], high[1]);
	else
		snprintf(more, sizeof more,
			"%s}, time: {end: 1}, output: {every: 1}, observe: {packing_fraction: {region: {box: "
			"{lower: "
			"[%.17g, %.17g, %.17g], upper: [%.17g, %.17g, %.17g]}}}}",
			periodic, low[0], low[1], low[2], high[0], high[1], high[2]);
	seen s = grains(dim, more, place);
	double volume = value(&s, "packing_fraction.fraction");
	for (int k = 0; k < dim; k++) volume *= high[k] - low[k];
	leave(&s);
	return volume;
}

static void cut_discs(void **state) {
	const double r = 0.01, whole = pi * r * r, d = 0.3;
	const char *one = "{position: [0.5, 0.5]}";
	bool good = true;
	(void)state;
	table_head("area of a disc in a box, over that of the disc");
	good &= table_row("all of it",
		fraction_in(2, (double[3]) { 0.4, 0.4 }, (double[3]) { 0.6, 0.6 }, "", one) / whole, 1, 1e-13);
	good &= table_row("half",
		fraction_in(2, (double[3]) { 0.5, 0.4 }, (double[3]) { 0.6, 0.6 }, "", one) / whole, 0.5, 1e-13);
	good &= table_row("a quarter",
		fraction_in(2, (double[3]) { 0.4, 0.5 }, (double[3]) { 0.5, 0.6 }, "", one) / whole, 0.25, 1e-13);
	good &= table_row("a segment",
		fraction_in(2, (double[3]) { 0.4, 0.5 + d * r }, (double[3]) { 0.6, 0.6 }, "", one) / whole,
		(acos(d) - d * sqrt(1 - d * d)) / pi, 1e-12);
	good &= table_row("a square within",
		fraction_in(2, (double[3]) { 0.497, 0.497 }, (double[3]) { 0.503, 0.503 }, "", one) / 36e-6, 1,
		1e-12);
	good &= table_row("a corner that is not in it",
		fraction_in(2, (double[3]) { 0.5 + 0.8 * r, 0.5 + 0.7 * r }, (double[3]) { 0.6, 0.6 }, "", one), 0,
		1e-18);
	good &= table_row("through a periodic face",
		fraction_in(2, (double[3]) { 0.9, 0.4 }, (double[3]) { 1, 0.6 }, ", periodic: [true, false]",
			"{position: [0.003, 0.5]}") /
			whole,
		(acos(d) - d * sqrt(1 - d * d)) / pi, 1e-12);
	double sum = 0; /* four boxes around an odd point */
	for (int k = 0; k < 4; k++)
		sum += fraction_in(2, (double[3]) { k % 2 ? 0.5037 : 0.4, k / 2 ? 0.4955 : 0.4 },
			(double[3]) { k % 2 ? 0.6 : 0.5037, k / 2 ? 0.6 : 0.4955 }, "", one);
	good &= table_row("four boxes together", sum / whole, 1, 1e-12);
	assert_true(good);
}

/* The part of the unit sphere beyond x and y: in closed form with a third face through the middle alone, so by discs. */
static double beyond_edge(double x, double y) {
	enum { N = 200000 };
	double sum = 0;
	const double top = sqrt(1 - x * x - y * y);
	for (int k = 0; k < N; k++) {
		const double z = top * sin(pi / 2 * (k + 0.5) / N), c = sqrt(1 - z * z);
		const double area =
			0.5 * (c * c * (acos(x / c) - asin(y / c)) - x * sqrt(c * c - x * x) - y * sqrt(c * c - y * y)) +
			x * y;
		sum += area * top * cos(pi / 2 * (k + 0.5) / N) * pi / 2 / N;
	}
	return 2 * sum;
}

static void cut_spheres(void **state) {
	const double r = 0.01, whole = 4.0 / 3 * pi * r * r * r, d = 0.3;
	const char *one = "{position: [0.5, 0.5, 0.5]}";
	bool good = true;
	(void)state;
	table_head("volume of a sphere in a box, over that of the sphere");
	good &= table_row("all of it",
		fraction_in(3, (double[3]) { 0.4, 0.4, 0.4 }, (double[3]) { 0.6, 0.6, 0.6 }, "", one) / whole, 1,
		1e-13);
	good &= table_row("an eighth",
		fraction_in(3, (double[3]) { 0.5, 0.4, 0.5 }, (double[3]) { 0.6, 0.5, 0.6 }, "", one) / whole, 0.125,
		1e-9);
	const double cap = 0.25 * (1 - d) * (1 - d) * (2 + d);
	for (int k = 0; k < 3; k++) {
		double low[3] = { 0.4, 0.4, 0.4 };
		low[k] = 0.5 + d * r;
		good &= table_row(
			"a cap", fraction_in(3, low, (double[3]) { 0.6, 0.6, 0.6 }, "", one) / whole, cap, 1e-8);
	}
	good &= table_row("a cube within",
		fraction_in(3, (double[3]) { 0.495, 0.495, 0.495 }, (double[3]) { 0.505, 0.505, 0.505 }, "", one) /
			1e-6,
		1, 1e-9);
	good &= table_row("beyond an edge",
		fraction_in(
			3, (double[3]) { 0.5 + 0.2 * r, 0.5 + 0.4 * r, 0.4 }, (double[3]) { 0.6, 0.6, 0.6 }, "", one) /
			whole,
		beyond_edge(0.2, 0.4) * 0.75 / pi, 1e-8);
	double sum = 0; /* eight boxes around an odd point */
	for (int k = 0; k < 8; k++)
		sum += fraction_in(3,
			(double[3]) { k % 2 ? 0.5037 : 0.4, k / 2 % 2 ? 0.4955 : 0.4, k / 4 ? 0.5061 : 0.4 },
			(double[3]) { k % 2 ? 0.6 : 0.5037, k / 2 % 2 ? 0.6 : 0.4955, k / 4 ? 0.6 : 0.5061 }, "", one);
	good &= table_row("eight boxes together", sum / whole, 1, 1e-8);
	assert_true(good);
}

/* ---- temperature ---- */

static void temperature(void **state) {
	bool good = true;
	(void)state;
	seen s = grains(2,
		ALONE
		"[granular_temperature, {granular_temperature: {label: left, region: {box: {lower: [0, 0], upper: "
		"[0.5, 1]}}}},\n"
		"{granular_temperature: {label: nowhere, region: {box: {lower: [0, 0], upper: [0.01, 0.01]}}}}]",
		"{position: [0.1, 0.5], velocity: [3, 1]}, {position: [0.2, 0.5], velocity: [1, 1]}, {position: "
		"[0.3, 0.5], velocity: "
		"[2, 5], radius: 0.02}, {position: [0.8, 0.5], velocity: [2, -3]}, {position: [0.9, 0.5], fixed: "
		"true}");
	table_head("granular temperature and mean velocity");
	good &=
		table_row("of four", value(&s, "granular_temperature.temperature"), (1 + 1 + 32) / 4.0 / 2, 1e-12);
	good &= table_row("their mean velocity", value(&s, "granular_temperature.x"), 2, 1e-14);
	good &= table_row("of three", value(&s, "left.temperature"), (2 + 32.0 / 3) / 3 / 2, 1e-12);
	good &= table_row("their mean velocity", value(&s, "left.y"), 7.0 / 3, 1e-14);
	good &= table_row("grains", value(&s, "left.grains"), 3, 0);
	good &= table_row("of none", value(&s, "nowhere.temperature"), 0, 0);
	leave(&s);
	assert_true(good);
}

/* Two grains that touch have gone through a periodic face, but are not brought back yet: they belong to the regions beyond it. */
static void through_a_face(void **state) {
	bool good = true;
	(void)state;
	seen s = grains(2,
		", periodic: [true, false]}, time: {end: 10}, output: {every: 10}, observe: ["
		"{granular_temperature: {label: heat, region: {box: {lower: [0, 0], upper: [0.5, 1]}}}},\n"
		"{granular_temperature: {label: heat_open, region: {box: {upper: [0.5, 1]}}}},\n"
		"{granular_temperature: {label: heat_there, region: {box: {lower: [0.5, 0], upper: [1, 1]}}}},\n"
		"{coordination: {label: touch, region: {box: {lower: [0, 0], upper: [0.5, 1]}}}},\n"
		"{coordination: {label: touch_there, region: {box: {lower: [0.5, 0]}}}},\n"
		"{repose: {width: 0.1, label: slope}}, {repose: {from: 0, to: 0.5, label: slope_part}}]",
		"{position: [0.9996, 0.5], velocity: [1, 0]}, {position: [0.9996, 0.5199], velocity: [1, 0]}");
	harness_steps(s.run, 2);
	look(&s);
	const quern_column x = harness_field(s.run, "grain.position");
	table_head("two grains that have just gone through a periodic face");
	good &= table_row("not brought back", x.real[0][0] > 1 && x.real[0][1] > 1, 1, 0);
	good &= table_row("grains in the region", value(&s, "heat.grains"), 2, 0);
	good &= table_row("  with one bound", value(&s, "heat_open.grains"), 2, 0);
	good &= table_row("  where they were", value(&s, "heat_there.grains"), 0, 0);
	good &= table_row("  that may touch", value(&s, "touch.grains"), 2, 0);
	good &= table_row("  contacts of each", value(&s, "touch.number"), 1, 1e-15);
	good &= table_row("  where they were", value(&s, "touch_there.grains"), 0, 0);
	good &= table_row("columns of the surface", value(&s, "slope.columns"), 1, 0);
	good &= table_row("  of its first half", value(&s, "slope_part.columns"), 1, 0);
	leave(&s);
	assert_true(good);
}

/* ---- flux ---- */

static void flux_of_grains(void **state) {
	const double m = 2500 * pi * 1e-4;
	bool good = true;
	(void)state;
	seen s = grains(2,
		ALONE "[{flux: {at: 0.5}}, {flux: {at: 0.5, label: below, section: {lower: [0, 0], upper: [0, "
			  "0.35]}}}, {flux: {axis: 1, "
			  "at: 0.55, label: up}}, {flux: {at: 0.2, label: nothing}}]",
		"{position: [0.45, 0.1], velocity: [1, 0]}, {position: [0.48, 0.3], velocity: [0.5, 1]}, {position: "
		"[0.53, 0.5], "
		"velocity: [-1, 0]}, {position: [0.4, 0.8], velocity: [0.1, 0]}, {position: [0.7, 0.5], velocity: "
		"[0, 2]}");
	table_head("flux of grains through planes, over what goes");
	good &= table_row("at the start", value(&s, "flux.mass"), 0, 0);
	harness_until(s.run, 0.1);
	look(&s);
	const double t = quern_run_time(s.run);
	good &= table_row("mass", value(&s, "flux.mass") * t / m, 1, 1e-12);
	good &= table_row("count", value(&s, "flux.count") * t, 1, 1e-12);
	good &= table_row("momentum along x", value(&s, "flux.x") * t / m, 1 + 0.5 + 1, 1e-12);
	good &= table_row("momentum along y", value(&s, "flux.y") * t / m, 1, 1e-12);
	good &= table_row("through the lower part", value(&s, "below.mass") * t / m, 2, 1e-12);
	good &= table_row("upwards", value(&s, "up.mass") * t / m, 1, 1e-12);
	good &= table_row("where nothing goes", value(&s, "nothing.mass"), 0, 0);
	harness_until(s.run, 0.2);
	look(&s);
	good &= table_row("later, when all have passed", value(&s, "flux.mass"), 0, 0);
	leave(&s);
	assert_true(good);
}

/* A grain that runs through periodic faces goes through each plane once a round. */
static void flux_of_a_round(void **state) {
	const double m = 2500 * pi * 1e-4;
	bool good = true;
	double inner = 0, face = 0;
	(void)state;
	seen s = grains(2,
		", periodic: [true, false]}, time: {end: 10}, output: {every: 10}, observe: [{flux: {at: 0.95}}, "
		"{flux: {at: 0, label: "
		"face}}]",
		"{position: [0.5, 0.5], velocity: [-2, 0]}");
	double before = 0;
	for (int k = 1; k <= 20; k++) {
		harness_until(s.run, 0.1 * k);
		look(&s);
		const double t = quern_run_time(s.run);
		inner += value(&s, "flux.mass") * (t - before), face += value(&s, "face.mass") * (t - before),
			before = t;
	}
	table_head("mass through a plane in four rounds, over that of the grain");
	good &= table_row("within the domain", inner / m, -4, 1e-9);
	good &= table_row("at its face", face / m, -4, 1e-9);
	leave(&s);
	assert_true(good);
}

/* Of a block of points that flies through a plane: what is beyond it later. */
static void flux_of_points(void **state) {
	bool good = true;
	double sum = 0, before = 0;
	(void)state;
	seen s =
		watch(harness_open(1, "{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: "
							  "[1, 1]}, time: {end: 1}, output: {every: 1},\n"
							  "observe: [{flux: {at: 0.31}}, {packing_fraction: {grain_density: 2000, "
							  "region: {box: {lower: [0.31, 0], upper: [1, "
							  "1]}}}}, coordination, granular_temperature, repose],\n"
							  "continuum: {cell: 0.02, material: {elastic: {bulk_modulus: 1e4, poisson: 0.2, "
							  "density: 1000}}, fill: {region: {box: {lower: "
							  "[0.1, 0.4], upper: [0.3, 0.6]}}, velocity: [1, 0.1]}}}\n"));
	for (int k = 1; k <= 4; k++) {
		harness_until(s.run, 0.03 * k);
		look(&s);
		sum += value(&s, "flux.mass") * (quern_run_time(s.run) - before), before = quern_run_time(s.run);
		assert_true(fabs(value(&s, "flux.x") - value(&s, "flux.mass")) < 1e-6 * value(&s, "flux.mass"));
	}
	const quern_column x = harness_field(s.run, "point.position"), m = harness_field(s.run, "point.mass");
	double beyond = 0, solid = 0;
	for (uint32_t i = 0; i < harness_count(s.run, "point"); i++)
		if (x.real[0][i] >= 0.31) beyond += m.real[0][i];
	solid = value(&s, "packing_fraction.points") * 0.69 * 2000;
	table_head("mass of points beyond a plane, over 1000 kg/m^3");
	good &= table_row("that flowed through it", sum / beyond, 1, 1e-12);
	good &= table_row(
		"in the box there, by volume", solid / (1000 * 0.2 * (quern_run_time(s.run) - 0.01)), 1, 1e-6);
	good &= table_row("contacts", value(&s, "coordination.number"), 0, 0);
	leave(&s);
	assert_true(good);
}

/* ---- profile ---- */

/* Two slabs along x cut a grain off its middle by 0.3 of its radius; a second grain reaches through a periodic face. Shares are
 * those of segments and caps; what all slabs hold is the mass. */
static void slabs(void **state) {
	(void)state;
	for (int dim = 2; dim <= 3; dim++) {
		seen s = grains(dim,
			dim == 2 ? ", periodic: [true, false]}, time: {end: 10}, output: {every: 10}, observe: [mass, "
					   "{profile: {bins: 4}}]"
					 : ", periodic: [true, false, false]}, time: {end: 10}, output: {every: 10}, observe: "
					   "[mass, {profile: {bins: 4}}]",
			dim == 2 ? "{position: [0.253, 0.5], velocity: [1, 2]}, {position: [0.998, 0.2], velocity: [3, "
					   "0]}, {position: [0.2, 0.2], velocity: [-1, 0]}"
					 : "{position: [0.253, 0.5, 0.5], velocity: [1, 2, 3]}, {position: [0.998, 0.2, 0.2], "
					   "velocity: [3, 0, 0]}, {position: [0.2, 0.2, 0.2], velocity: [-1, 0, 1]}");
		const double mass = 2500 * pi * 1e-4 * (dim == 2 ? 1 : 4.0 / 3 * 0.01), volume = 0.25;
		const double t = 0.3, low = dim == 2 ? (acos(t) - t * sqrt(1 - t * t)) / pi
											 : 0.25 * (2 + t) * (1 - t) * (1 - t);
		const double u = 0.2, over = dim == 2 ? (acos(u) - u * sqrt(1 - u * u)) / pi
											  : 0.25 * (2 + u) * (1 - u) * (1 - u);
		const double m0 = low + over + 1, x0 = (low * 1 + over * 3 - 1) / m0;
		assert_true(table_row("density of the first slab", value(&s, "profile.density_0"), m0 * mass / volume,
			1e-12 * mass / volume));
		assert_true(table_row("density of the second", value(&s, "profile.density_1"),
			(1 - low) * mass / volume, 1e-12 * mass / volume));
		assert_true(table_row("density of the third", value(&s, "profile.density_2"), 0, 0));
		assert_true(table_row("density of the last", value(&s, "profile.density_3"),
			(1 - over) * mass / volume, 1e-12 * mass / volume));
		assert_true(table_row("mean velocity of the first", value(&s, "profile.x_0"), x0, 1e-12));
		assert_true(table_row("mean velocity of the last", value(&s, "profile.x_3"), 3, 1e-12));
		const double z0 = dim == 2 ? 0 : (low * 3 + 1) / m0, y0 = low * 2 / m0;
		const double square = (low * (1 + 4 + (dim == 3) * 9) + over * 9 + 1 + (dim == 3)) / m0;
		assert_true(table_row("temperature of the first", value(&s, "profile.temperature_0"),
			(square - x0 * x0 - y0 * y0 - z0 * z0) / dim, 1e-12));
		assert_true(table_row("temperature of the last", value(&s, "profile.temperature_3"), 0, 1e-24));
		leave(&s);
	}
}

/* A block of points that moves by shear: every slab has the block's density and the velocity in its middle. */
static void slabs_of_points(void **state) {
	(void)state;
	seen s = watch(harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [1, 1]}, time: {end: 1}, "
		"output: {every: 1},\n"
		"observe: [{profile: {axis: 1, bins: 3, region: {box: {lower: [0.2, 0.2], upper: [0.6, 0.5]}}}}],\n"
		"continuum: {cell: 0.1, material: {elastic: {bulk_modulus: 1000, poisson: 0.2, density: 1200}}, "
		"fill: {region: {box: "
		"{lower: [0.2, 0.2], upper: [0.6, 0.4]}}, velocity: [0.5, -1]}}}\n"));
	assert_true(table_row("density of the first slab", value(&s, "profile.density_0"), 1200, 1e-9));
	assert_true(table_row("density of the second", value(&s, "profile.density_1"), 1200, 1e-9));
	assert_true(table_row("density of the empty one", value(&s, "profile.density_2"), 0, 0));
	assert_true(table_row("velocity along x", value(&s, "profile.x_1"), 0.5, 1e-14));
	assert_true(table_row("velocity along y", value(&s, "profile.y_0"), -1, 1e-14));
	leave(&s);
}

/* ---- slope ---- */

static void slopes(void **state) {
	char place[6000];
	const double slope = 0.4;
	bool good = true;
	(void)state;
	table_head("angle of a surface, over that of its line");
	for (int dim = 2; dim <= 3; dim++) {
		int n = 0;
		for (int k = 0; k < 20; k++)
			for (int z = 0; z < (dim == 3 ? 2 : 1);
				 z++) { /* on the line and below it, a gap, a grain that never moves */
				const double x = 0.12 + 0.03 * k, y = 0.3 + slope * x;
				for (int below = 0; below < 2; below++)
					if (dim == 2)
						n += snprintf(place + n, sizeof place - (size_t)n, "{position: [%.17g, %.17g]}, ", x,
							y - 0.1 * below);
					else
						n += snprintf(place + n, sizeof place - (size_t)n,
							"{position: [%.17g, %.17g, %.17g]}, ", x, y - 0.1 * below, 0.2 + 0.5 * z);
			}
		snprintf(place + n, sizeof place - (size_t)n,
			dim == 2 ? "{position: [0.5, 0.95], fixed: true}" : "{position: [0.5, 0.95, 0.5], fixed: true}");
		seen s = watch(harness_open(1,
			"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s}, time: {end: 1}, output: "
			"{every: 1},\n"
			"observe: [{repose: {width: 0.01}}, {repose: {from: 0.2, to: 0.4, label: part}}, {repose: {from: "
			"0.9, label: "
			"nowhere}}],\n"
			"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: [], place: [%s]}}\n",
			dim, dim == 2 ? "[0, -9.81]" : "[0, -9.81, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
			dim == 2 ? "[1, 1]" : "[1, 1, 1]", place));
		good &= table_row(dim == 2 ? "2-D" : "3-D", value(&s, "repose.angle") / atan(slope), 1, 1e-12);
		good &= table_row("  columns", value(&s, "repose.columns"), dim == 2 ? 20 : 40, 0);
		good &= table_row("  middle", value(&s, "repose.middle"), 0.31 + slope * (0.12 + 0.03 * 9.5), 1e-12);
		good &= table_row("  roughness", value(&s, "repose.roughness"), 0, 1e-12);
		good &= table_row("  of a part", value(&s, "part.angle") / atan(slope), 1, 1e-12);
		good &= table_row("  of none", value(&s, "nowhere.angle"), 0, 0);
		leave(&s);
	}
	assert_true(good);
}

/* Steps of a continuum, one per column; with gravity to higher coordinates they fall where they would rise. */
static void slope_of_points(void **state) {
	bool good = true;
	(void)state;
	table_head("slope of steps of points");
	for (int up = 0; up < 2; up++) {
		seen s = watch(harness_open(1,
			"{quern: 1, dimension: 2, gravity: [0, %s], domain: {lower: [0, 0], upper: [0.4, 0.4]}, time: "
			"{end: 1},\n"
			"output: {every: 1}, observe: [{repose: {width: 0.04}}],\n"
			"continuum: {cell: 0.02, material: {elastic: {bulk_modulus: 1e6, poisson: 0.2, density: 1000}}, "
			"fill: "
			"[\n"
			"  {region: {box: {lower: [0, 0], upper: [0.04, 0.04]}}}, {region: {box: {lower: [0.04, 0], "
			"upper: [0.08, 0.06]}}},\n"
			"  {region: {box: {lower: [0.08, 0], upper: [0.12, 0.08]}}}]}}\n",
			up ? "9.81" : "-9.81"));
		if (!up) good &= table_row("that rise", tan(value(&s, "repose.angle")), 0.5, 1e-12);
		else good &= table_row("upside down, flat", tan(value(&s, "repose.angle")), 0, 1e-12);
		good &= table_row("  columns", value(&s, "repose.columns"), 3, 0);
		good &= table_row("  middle", value(&s, "repose.middle"), up ? 0.4 : 0.06, 1e-12);
		leave(&s);
	}
	assert_true(good);
}

/* ---- two of a kind ---- */

/* Four grains on the left, of which two touch, and two on the right: observers of one kind, each with its own half. */
static void halves(void **state) {
	const double r = 0.01, m = 2500 * pi * r * r, area = 0.5;
	bool good = true;
	(void)state;
#define LEFT "region: {box: {lower: [0, 0], upper: [0.5, 1]}}}}, "
#define RIGHT "region: {box: {lower: [0.5, 0], upper: [1, 1]}}}}, "
	seen s = grains(2,
		ALONE "[{packing_fraction: {label: full_l, " LEFT "{packing_fraction: {label: full_r, " RIGHT
			  "{coordination: {label: touch_l, " LEFT "{coordination: {label: touch_r, " RIGHT
			  "{granular_temperature: {label: heat_l, " LEFT "{granular_temperature: {label: heat_r, " RIGHT
			  "{profile: {bins: 2}}, {profile: {axis: 1, bins: 2, label: rows}}]",
		"{position: [0.2, 0.5], velocity: [1, 0]}, {position: [0.3, 0.5], velocity: [-1, 0]}, {position: "
		"[0.2, 0.2]}, {position: [0.2199, 0.2]}, {position: [0.7, 0.5], velocity: [0, 2]}, {position: [0.8, "
		"0.5]}");
	table_head("two observers of a kind, each of its own half");
	good &= table_row("packing fraction, left", value(&s, "full_l.fraction"), 4 * pi * r * r / area, 1e-14);
	good &= table_row("  right", value(&s, "full_r.fraction"), 2 * pi * r * r / area, 1e-14);
	good &= table_row("contacts per grain, left", value(&s, "touch_l.number"), 0.5, 0);
	good &= table_row("  right", value(&s, "touch_r.number"), 0, 0);
	good &= table_row("temperature, left", value(&s, "heat_l.temperature"), 0.25, 1e-15);
	good &= table_row("  right", value(&s, "heat_r.temperature"), 0.5, 1e-15);
	good &= table_row("density, left", value(&s, "profile.density_0"), 4 * m / area, 1e-12);
	good &= table_row("  right", value(&s, "profile.density_1"), 2 * m / area, 1e-12);
	good &= table_row("  below", value(&s, "rows.density_0"), (2 + 4 * 0.5) * m / area, 1e-12);
	good &= table_row("  above", value(&s, "rows.density_1"), 4 * 0.5 * m / area, 1e-12);
	leave(&s);
	assert_true(good);
}

/* A wall with the velocity U hits a grain at rest, which leaves with (1 + e) U: the wall has given m (1 + e) U and has done U
 * times that. Two walls, each with its own observers. */
static void work_of_two_walls(void **state) {
	const double speed[] = { 0.2, -0.3 }, e = 0.5, m = 2500 * pi * 1e-4;
	bool good = true;
	(void)state;
	seen s = watch(harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [1, 1]}, time: {end: 1}, "
		"output: {every: 1},\n"
		"observe: [energy, {wall_force: {body: left}}, {wall_force: {body: right}}, {wall_torque: {body: "
		"left}}, {wall_torque: {body: right}}],\n"
		"bodies: [{plane: {name: left, point: [0, 0], normal: [1, 0], motion: {velocity: [0.2, 0]}}},\n"
		"  {plane: {name: right, point: [1, 0], normal: [-1, 0], motion: {velocity: [-0.3, 0]}}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: {linear: {stiffness: 1e5, "
		"friction: 0, restitution: 0.5}},\n"
		"  place: [{position: [0.02, 0.5]}, {position: [0.98, 0.5]}]}}\n"));
	harness_until(s.run, 0.2);
	look(&s);
	const double *v = harness_field(s.run, "grain.velocity").real[0], t = quern_run_time(s.run);
	const char *const force[] = { "wall_force.x", "wall_force_2.x" }, *const work[] = { "wall_torque.work",
		"wall_torque_2.work" };
	double all = 0;
	table_head("two walls that hit a grain each");
	for (int k = 0; k < 2; k++) {
		const double given = m * v[k];
		good &= table_row("velocity over that of the wall", v[k] / speed[k], 1 + e, 0.005);
		good &= table_row("  impulse over momentum", -value(&s, force[k]) * t / given, 1, 1e-9);
		good &= table_row("  work over U times momentum", value(&s, work[k]) / (speed[k] * given), 1, 1e-6);
		all += value(&s, work[k]);
	}
	good &= table_row("work of both, as energy has it", -value(&s, "energy.driven") / all, 1, 1e-12);
	leave(&s);
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(flower), cmocka_unit_test(pyramid),
		cmocka_unit_test(cut_discs), cmocka_unit_test(cut_spheres), cmocka_unit_test(temperature),
		cmocka_unit_test(through_a_face), cmocka_unit_test(flux_of_grains), cmocka_unit_test(flux_of_a_round),
		cmocka_unit_test(flux_of_points), cmocka_unit_test(slabs), cmocka_unit_test(slabs_of_points),
		cmocka_unit_test(slopes), cmocka_unit_test(slope_of_points), cmocka_unit_test(halves),
		cmocka_unit_test(work_of_two_walls) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
