/* SPDX-License-Identifier: MIT */
/* Guards that look at grains now and then: contacts that lie deep for long, grains behind a body's surface or out of the
 * domain, and spins that no step resolves. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double radius = 0.01, density = 2500, gravity = 9.81, width = 0.2;

static double weight(uint32_t dim) {
	return gravity * density * (dim == 2 ? M_PI * radius * radius : 4 * M_PI / 3 * radius * radius * radius);
}

/* A grain that just touches what is below it, a floor or a grain that is fixed, and falls onto it with this speed. */
static quern_run *open_scene(uint32_t dim, bool floor, double stiffness, double speed, const char *more) {
	const double y = floor ? radius : 3 * radius;
	char fixed[80] = "", body[80] = "";
	if (!floor)
		snprintf(
			fixed, sizeof fixed, "{position: [0.1, %g%s], fixed: true}, ", radius, dim == 3 ? ", 0.1" : "");
	else
		snprintf(body, sizeof body, "{plane: {point: [0, 0%s], normal: [0, 1%s]}}", dim == 3 ? ", 0" : "",
			dim == 3 ? ", 0" : "");
	/* soft as these are, a longer step would end at a move of a radius before anybody looks how deep they lie */
	return harness_open(1,
		"{quern: 1, dimension: %u, gravity: [0, %g%s], domain: {lower: [0, -1%s], upper: [%g, 99%s]},\n"
		"time: {end: 10}, output: {every: 0.1}, bodies: [%s],\n"
		"grains: {material: {density: %g, radius: {mean: %g}}, contact: {linear: {stiffness: %.17g}}, step: 0.02, %s\n"
		"  place: [%s{position: [0.1, %.17g%s], velocity: [0, %g%s]}]}}\n",
		dim, -gravity, dim == 3 ? ", 0" : "", dim == 3 ? ", 0" : "", width, dim == 3 ? ", 0.2" : "", body,
		density, radius, stiffness, more, fixed, y, dim == 3 ? ", 0.1" : "", -speed, dim == 3 ? ", 0" : "");
}

/* How the run ends after a second: with words about all of these, or well if there are none. */
static void ends(quern_run *run, const char *first, const char *second) {
	quern_status status = QUERN_OK;
	while (status == QUERN_OK && quern_run_time(run) < 1) status = harness_try(run, 100);
	if (status != (first ? QUERN_E_NUMERIC : QUERN_OK)) fail_msg("%s", run->message);
	if (first && !(strstr(run->message, first) && strstr(run->message, second))) fail_msg("%s", run->message);
	harness_close(run);
}

/* No frame shows a centre behind a surface, also in a run so short that no step has looked for it. */
static void what_is_shown(void **state) {
	(void)state;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const double k = weight(dim) / radius;
		quern_run *run = open_scene(dim, true, k / 20, 0, "");
		assert_int_equal(harness_try(run, 30), QUERN_OK);
		assert_int_equal(quern_run_look(run), QUERN_E_NUMERIC);
		if (!strstr(run->message, "behind the surface")) fail_msg("%s", run->message);
		harness_close(run);
	}
}

/* A grain whose weight presses it deep into what bears it ends the run, with the names of both and the stiffness; one that
 * lies less deep does not. A floor that bears nothing is fallen through, and said so at once. */
static void what_lies_deep(void **state) {
	(void)state;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const double k = weight(dim) / radius;
		ends(open_scene(dim, true, k / 0.2, 0, ""), "body 0, a body.plane, by", "contact.linear");
		ends(open_scene(dim, false, k / 0.2, 0, ""), "overlaps grain 1 by", "for long");
		ends(open_scene(dim, true, k / 0.04, 0, ""), NULL, NULL);
		ends(open_scene(dim, false, k / 0.04, 0, ""), NULL, NULL);
		ends(open_scene(dim, true, k / 20, 0, ""), "behind the surface", "stiffness");
		ends(open_scene(dim, true, k / 0.2, 0, "overlap: {most: 0.5},"), NULL, NULL);
		ends(open_scene(dim, true, k / 0.2, 0, "overlap: {most: 0},"), NULL, NULL);
	}
}

/* An impact may go almost half a radius deep, since it does not last. */
static void what_strikes(void **state) {
	(void)state;
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int floor = 0; floor <= 1; floor++) {
			const double k = 1e4 * weight(dim) / radius,
						 speed = 0.7 * radius * sqrt(k * gravity / weight(dim));
			quern_run *run = open_scene(dim, floor, k, speed, "");
			double deepest = 0;
			while (quern_run_time(run) < 3e-3) {
				harness_steps(run, 1);
				const double y = harness_field(run, "grain.position").real[1][floor ? 0 : 1];
				deepest = fmax(deepest, (floor ? radius : 3 * radius) - y);
			}
			assert_true(deepest > 0.4 * radius);
			ends(run, NULL, NULL);
		}
}

/* A grain that is out of the domain when frames and observers look ends the run, though no list was remade since. */
static void what_is_out(void **state) {
	(void)state;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [1, 1]},\n"
		"time: {end: 1e-3, step: 1e-5}, output: {every: 1e-3},\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: {linear: {stiffness: 1e5}},\n"
		"  place: [{position: [0.5, 0.5]}, {position: [0.99955, 0.5], velocity: [0.5, 0]}]}}\n");
	assert_int_equal(harness_try(run, 99), QUERN_OK);
	const quern_column x = harness_field(run, "grain.position");
	assert_true(fmax(x.real[0][0], x.real[0][1]) > 1);
	assert_int_equal(harness_try(run, 1), QUERN_E_NUMERIC);
	assert_non_null(strstr(run->message, "left the domain along axis 0"));
	harness_close(run);
}

/* A spin that turns a grain by more than a radian in a step, or that is not a number, ends the run. */
static void what_spins(void **state) {
	(void)state;
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int k = 0; k < 2; k++) {
			quern_run *run = open_scene(dim, true, 1e6, 0, "");
			harness_steps(run, 1);
			harness_field(run, "grain.spin").real[0][0] = k ? NAN : 1e9;
			assert_int_equal(harness_try(run, 50), QUERN_E_NUMERIC);
			assert_non_null(strstr(run->message, k ? "not a number" : "spin"));
			harness_close(run);
		}
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(what_lies_deep), cmocka_unit_test(what_is_shown),
		cmocka_unit_test(what_strikes), cmocka_unit_test(what_is_out), cmocka_unit_test(what_spins) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
