/* SPDX-License-Identifier: MIT */
/* What a plan expects of a run: its arithmetic, on numbers chosen by hand, and its counts, of a column that becomes a hybrid. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include <math.h>
#include <prospect.h>
#include <string.h>

static void assert_near(double a, double b, double most) {
	if (!(fabs(a - b) <= most)) fail_msg("%.17g, and %.17g", a, b);
}

static void ratios_by_hand(void **unused) {
	(void)unused;
	/* ten substeps for 1 each and a long step for 10, against 4 a substep */
	assert_near(quern_prospect_ratio(10, 1, 10, 1e-6, 1, 4), 0.5, 1e-15);
	/* of a long step's ten substeps only five fit: they are half as long, and all of it is done twice as often */
	assert_near(quern_prospect_ratio(10, 1, 10, 1e-6, 5e-6, 4), 1, 1e-15);
	/* as many as fit are best: fewer share the long step's price, more are shorter than need be */
	const double best = quern_prospect_ratio(40, 1, 10, 1e-6, 40e-6, 4);
	for (int n = 1; n < 100; n++) assert_true(quern_prospect_ratio(n, 1, 10, 1e-6, 40e-6, 4) >= best);
	/* nothing but substeps, and as many entries as alone */
	assert_near(quern_prospect_ratio(7, 4, 0, 1e-6, 1, 4), 1, 1e-15);
}

static quern_run *column(uint32_t workers) {
	return harness_open(workers,
		"quern: 1\ndimension: 2\ngravity: [0, -9.81]\ndomain: {lower: [0, 0], upper: [0.08, 0.08], periodic: [true, false]}\ntime: {end: 0.05}\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}}, contact: {linear: {stiffness: 3e5, friction: 0.4}},\n"
		"  fill: {region: {box: {lower: [0, 0.001], upper: [0.08, 0.06]}}}}\n"
		"bodies:\n  - plane: {point: [0, 0], normal: [0, 1], boundary: sticky}\n"
		"continuum: {cell: 4 mm, material: mu_i}\n"
		"hybrid: {oracle: [{packing_fraction: {depth: 10 mm, half_width: 4 mm}}], substeps: 20}\n");
}

static void prices_follow_counts(void **unused) {
	quern_run *run = column(1);
	(void)unused;
	const uint32_t all = harness_count(run, "grain");
	const double before = quern_estimate_price(run, true, 1, 1);
	const quern_estimate e = quern_estimate_of(run);
	const quern_prospect p = quern_prospect_of(run, &e);
	const uint32_t grains = harness_count(run, "grain"), points = harness_count(run, "point");
	assert_true(p.known && points > 500 && grains < all / 2);
	const uint32_t n = (uint32_t)e.substeps;
	const double substep = quern_estimate_price(run, true, 1, 1),
				 step = quern_estimate_price(run, false, n, 1);
	assert_near(substep / before, (double)grains / all, 1e-12);
	assert_true(step > 0 && p.ratio < 1 && p.ratio > (double)grains / all);
	assert_near(
		p.ratio, quern_prospect_ratio(e.substeps, substep, step, e.own.substep, e.own.step, before), 1e-12);
	/* cells twice as wide: a quarter of the points and nodes, and as many grains as before */
	const double wide = quern_estimate_price(run, false, n, 2);
	assert_true(wide < 0.7 * step && wide > 0.25 * step);
	assert_near(p.wide_substeps, floor(2 * e.own.step / e.own.substep * (1 + 1e-9)), 0);
	/* rows of 4 mm: the surface lies lower in a loose fill than where it was filled to */
	assert_in_range((int)(100 * p.discrete), 20, 30);
	harness_close(run);
}

static void the_same_on_any_number_of_threads(void **unused) {
	quern_prospect p[2];
	(void)unused;
	for (int k = 0; k < 2; k++) {
		quern_run *run = column(k ? 3 : 1);
		const quern_estimate e = quern_estimate_of(run);
		p[k] = quern_prospect_of(run, &e);
		harness_close(run);
	}
	assert_true(p[0].ratio == p[1].ratio && p[0].best == p[1].best && p[0].wide == p[1].wide &&
				p[0].discrete == p[1].discrete);
}

static void what_takes_long_is_not_tried(void **unused) {
	quern_run *run = column(1);
	(void)unused;
	quern_estimate e = quern_estimate_of(run);
	e.substeps = 1e9;
	assert_false(quern_prospect_of(run, &e).known);
	assert_true(run->clock.step == 0);
	harness_close(run);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(ratios_by_hand),
		cmocka_unit_test(prices_follow_counts), cmocka_unit_test(the_same_on_any_number_of_threads),
		cmocka_unit_test(what_takes_long_is_not_tried) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
