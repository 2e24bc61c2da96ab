/* SPDX-License-Identifier: MIT */
/* The stress observer against closed forms: two grains pressed together, wherever they are and whatever of their branch a region holds; a
 * column's weight; velocities. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "seen.h"
#include "table.h"
#include <math.h>

static const double radius = 0.01, stiffness = 1e5;

static const char *const names[9] = { "stress.xx", "stress.xy", "stress.xz", "stress.yx", "stress.yy",
	"stress.yz", "stress.zx", "stress.zy", "stress.zz" };

/* In a domain of one metre, periodic or not; `region` in YAML or empty. */
static seen two(int dim, bool periodic, const char *region, const double at[3], const double by[3]) {
	char place[400];
	if (dim == 2)
		snprintf(place, sizeof place, "{position: [%.17g, %.17g]}, {position: [%.17g, %.17g]}", at[0], at[1],
			fmod(at[0] + by[0], 1), fmod(at[1] + by[1], 1));
	else
		snprintf(place, sizeof place, "{position: [%.17g, %.17g, %.17g]}, {position: [%.17g, %.17g, %.17g]}",
			at[0], at[1], at[2], fmod(at[0] + by[0], 1), fmod(at[1] + by[1], 1), fmod(at[2] + by[2], 1));
	return watch(harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s, periodic: %s},\n"
		"time: {end: 10}, output: {every: 10}, observe: [{stress: {%s}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, overlap: {start: 0.5, most: 0},\n"
		"  contact: {linear: {stiffness: 1e5, friction: 0, restitution: 1}}, place: [%s]}}\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[1, 1]" : "[1, 1, 1]",
		periodic ? (dim == 2 ? "[true, true]" : "[true, true, true]")
				 : (dim == 2 ? "[false, false]" : "[false, false, false]"),
		region, place));
}

/* f l/V n n of a part of the branch, in a region of that volume. */
static bool compare(seen *s, const char *what, int dim, const double by[3], double share, double volume) {
	double length = 0, worst = 0;
	for (int k = 0; k < dim; k++) length += by[k] * by[k];
	length = sqrt(length);
	const double f = stiffness * (2 * radius - length), all = f * length / volume;
	for (int k = 0; k < 9; k++) {
		const double wanted = all * share * by[k / 3] * by[k % 3] / (length * length);
		worst = fmax(worst, fabs(value(s, names[k]) - wanted));
	}
	return table_row(what, worst / all, 0, 1e-10);
}

static void pressed(void **state) {
	bool good = true;
	(void)state;
	table_head("stress of two grains, off by, over force times branch over volume");
	for (int dim = 2; dim <= 3; dim++) {
		const double by[3] = { 0.012, 0.011, dim == 3 ? 0.009 : 0 }, middle[3] = { 0.4, 0.5, 0.6 },
					 corner[3] = { 0.995, 0.993, 0.996 };
		const char *more = dim == 2 ? "" : ", 0", *most = dim == 2 ? "" : ", 1";
		char region[200];
		for (int periodic = 0; periodic < 2; periodic++) {
			seen s = two(dim, periodic, "", middle, by);
			good &= compare(&s, periodic ? "in a periodic domain" : "in a domain", dim, by, 1, 1);
			leave(&s);
			snprintf(region, sizeof region, "region: {box: {lower: [0, 0.45%s], upper: [1, 0.504%s]}}", more,
				most);
			s = two(dim, periodic, region, middle, by);
			good &= compare(&s, "  the part of the branch in a region", dim, by, 4.0 / 11, 0.054);
			leave(&s);
			snprintf(region, sizeof region, "region: {box: {lower: [0.405, 0.504%s], upper: [0.6, 0.9%s]}}",
				more, most);
			s = two(dim, periodic, region, middle, by);
			good &= compare(&s, "  the other, cut along x too", dim, by, 1 - 5.0 / 12, 0.195 * 0.396);
			leave(&s);
		}
		seen s = two(dim, true, "", corner, by);
		good &= compare(&s, "across a corner of a periodic domain", dim, by, 1, 1);
		leave(&s);
		snprintf(region, sizeof region, "region: {box: {lower: [0, 0%s], upper: [0.5, 1%s]}}", more, most);
		s = two(dim, true, region, corner, by);
		good &= compare(&s, "  what of it is behind the face", dim, by, 7.0 / 12, 0.5);
		leave(&s);
		snprintf(region, sizeof region, "region: {box: {lower: [0.5, 0.5%s], upper: [1, 1%s]}}", more, most);
		s = two(dim, true, region, corner, by);
		good &= compare(&s, "  what of it is before both", dim, by, 5.0 / 12, 0.25);
		leave(&s);
	}
	assert_true(good);
}

/* Discs on each other bear what lies above. */
static void column(void **state) {
	enum { DISCS = 6 };
	char place[600], observe[1200];
	int n = 0, m = 0;
	bool good = true;
	(void)state;
	for (int k = 0; k < DISCS; k++)
		n += snprintf(place + n, sizeof place - (size_t)n, "{position: [0.05, %.17g]},", 0.01 + 0.02 * k);
	for (int k = 0; k + 1 < DISCS; k++)
		m += snprintf(observe + m, sizeof observe - (size_t)m,
			"{stress: {label: at_%d, region: {box: {lower: [0.03, %g], upper: [0.08, %g]}}}},", k,
			0.016 + 0.02 * k, 0.024 + 0.02 * k);
	seen s = watch(harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -10], domain: {lower: [0, 0], upper: [0.1, 0.2]}, time: {end: 10},\n"
		"output: {every: 10}, bodies: [{plane: {point: [0, 0], normal: [0, 1]}}], observe: [%s],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, place: [%s],\n"
		"  contact: {linear: {stiffness: 1e6, friction: 0, restitution: 0.05}}}}\n",
		observe, place));
	harness_until(s.run, 1);
	look(&s);
	const double weight = 10 * harness_field(s.run, "grain.mass").real[0][0];
	table_head("what a column of discs bears, over the weight above");
	for (int k = 0; k + 1 < DISCS; k++) {
		char name[40];
		snprintf(name, sizeof name, "at_%d.yy", k);
		good &= table_row(name, value(&s, name) * 0.05 / (weight * (DISCS - 1 - k)), 1, 1e-9);
		snprintf(name, sizeof name, "at_%d.xx", k);
		good &= table_row(name, value(&s, name), 0, 0);
	}
	leave(&s);
	assert_true(good);
}

/* sum m c c/V, in 3-D, of three grains of which the region holds two. */
static void velocities(void **state) {
	bool good = true;
	(void)state;
	seen s = watch(harness_open(1,
		"{quern: 1, dimension: 3, gravity: [0, 0, 0], domain: {lower: [0, 0, 0], upper: [1, 1, 1]}, time: {end: 10},\n"
		"output: {every: 10}, observe: [{stress: {region: {box: {lower: [0, 0, 0], upper: [0.5, 1, 1]}}}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: {linear: {stiffness: 1e5}},\n"
		"  place: [{position: [0.1, 0.1, 0.1], velocity: [7, 1, 4]}, {position: [0.2, 0.1, 0.1], velocity: [3, 3, -2]},\n"
		"    {position: [0.7, 0.1, 0.1], velocity: [10, 20, 30]}]}}\n"));
	static const char *const kinds[] = { "xx", "yy", "zz", "xy", "yz", "xz" };
	static const double wanted[] = { 8, 2, 18, -4, -6, 12 };
	const double m = harness_field(s.run, "grain.mass").real[0][0];
	table_head("stress of two grains' velocities, times the volume over a grain's mass");
	for (int k = 0; k < 6; k++) {
		char name[40];
		snprintf(name, sizeof name, "stress.kinetic_%s", kinds[k]);
		good &= table_row(name, value(&s, name) * 0.5 / m, wanted[k], 1e-12);
	}
	good &= table_row("grains", value(&s, "stress.grains"), 2, 0);
	leave(&s);
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(pressed), cmocka_unit_test(column),
		cmocka_unit_test(velocities) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
