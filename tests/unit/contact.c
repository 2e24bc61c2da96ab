/* SPDX-License-Identifier: MIT */
/* What contact laws share: the Coulomb cone. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <quern/contact.h>
#include <stdio.h>
#include <stdlib.h>

static double uniform(void) { return 2.0 * rand() / RAND_MAX - 1; }
static quern_vec some(double size) {
	return (quern_vec) { size * uniform(), size * uniform(), size * uniform() };
}
static double length(quern_vec v) { return sqrt(quern_vec_dot(v, v, 3)); }
static quern_vec total(quern_vec a, quern_vec b, quern_cone c) {
	return quern_vec_axpy(c.spring, a, quern_vec_scale(c.damper, b));
}

/* Along one line, by hand: what is left of the spring, as a share, and of the sum. */
static void closed_forms(void **state) {
	static const struct {
		double a, b, cap, share, sum;
	} cases[] = { { 1, 1, 3, 1, 2 }, /* inside */
		{ 4, 1, 2, 0.25, 2 },        /* the spring gives way */
		{ -4, -1, 2, 0.25, -2 }, { 4, -1, 2, 0.75, 2 }, { 4, 0, 1, 0.25, 1 },
		{ 4, -2, 1, 0.75, 1 }, /* the dashpot alone is beyond the cone, the sum keeps its side */
		{ -4, 2, 1, 0.75, -1 }, { 2, -2, 1, 1, 0 }, { 4, 2, 1, 0, 1 }, { 4, -8, 1, 0.25, -1 },
		{ 1, -4, 3, 1, -3 }, { 0, 5, 2, 1, 2 }, { 3, 1, 0, 0, 0 }, { 3, -5, 0, 0, 0 } };
	static const quern_vec ways[] = { { 1, 0, 0 }, { 0.6, -0.8, 0 }, { 2.0 / 3, 1.0 / 3, -2.0 / 3 } };
	(void)state;
	for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
		double spring;
		const double sum = quern_cone_planar(cases[k].a, cases[k].b, cases[k].cap, &spring);
		assert_true(fabs(sum - cases[k].sum) < 1e-15);
		assert_true(fabs(spring - cases[k].share * cases[k].a) < 1e-15);
		for (size_t w = 0; w < sizeof ways / sizeof *ways; w++) { /* the same in space */
			const quern_vec a = quern_vec_scale(cases[k].a, ways[w]),
							b = quern_vec_scale(cases[k].b, ways[w]);
			const quern_cone c = quern_cone_shares(a, b, cases[k].cap);
			const quern_vec left = quern_vec_axpy(-cases[k].sum, ways[w], total(a, b, c));
			assert_true(length(left) < 1e-14);
			if (cases[k].a != 0) assert_true(fabs(c.spring - cases[k].share) < 1e-14);
		}
	}
}

/* Whatever the two are: outside the cone the total comes to lie on it, shares are shares, and where the spring alone can do
 * it the dashpot stays and no larger share of the spring would do. */
static void always_on_the_cone(void **state) {
	int met = 0, clipped = 0;
	(void)state;
	srand(3);
	for (int k = 0; k < 200000; k++) {
		const quern_vec a = some(pow(10, 2 * uniform())), b = some(pow(10, 2 * uniform()));
		const double cap = pow(10, 2 * uniform());
		const quern_cone c = quern_cone_shares(a, b, cap);
		const double before = length(quern_vec_add(a, b)), after = length(total(a, b, c));
		assert_true(c.spring >= 0 && c.spring <= 1 && c.damper >= 0 && c.damper <= 1);
		if (before <= cap) {
			assert_true(c.spring == 1 && c.damper == 1);
			continue;
		}
		assert_true(fabs(after / cap - 1) < 1e-10);
		if (c.damper == 1) {
			met++;
			const quern_cone more = { c.spring + 1e-6 * (1 - c.spring), 1 };
			assert_true(length(total(a, b, more)) >= after * (1 - 1e-12));
		} else clipped++;
	}
	assert_true(met > 10000 && clipped > 10000);
}

/* How far the total is from the cone, over the larger of the two forces. */
static double off_the_cone(quern_vec a, quern_vec b, double cap) {
	const quern_cone c = quern_cone_shares(a, b, cap);
	assert_true(c.spring >= 0 && c.spring <= 1 && c.damper >= 0 && c.damper <= 1);
	if (length(quern_vec_add(a, b)) <= cap) return 0;
	return fabs(length(total(a, b, c)) - cap) / fmax(length(a), length(b));
}

/* Where digits are lost: both nearly opposite, or nearly at right angles and the dashpot's nearly as large as the cone. */
static void to_the_last_digits(void **state) {
	static const quern_vec spring = { 0x1.18df7fb68b2b2p-2, 0x1.3fddc901757afp+3, 0 },
						   dashpot = { -0x1.ffceae3b9c70bp-1, 0x1.c16a5c7c05dc3p-6, 0 };
	double worst = off_the_cone(spring, dashpot, 1);
	(void)state;
	srand(7);
	for (int k = 0; k < 200000; k++) {
		const quern_vec a = some(pow(10, uniform())), way = some(1);
		const double small = pow(10, -8 * fabs(uniform()) - 1);
		const quern_vec aside = quern_vec_axpy(-quern_vec_dot(way, a, 3) / quern_vec_dot(a, a, 3), a, way);
		const quern_vec opposite = quern_vec_axpy(-2 * fabs(uniform()), a, quern_vec_scale(small, aside)),
						across = quern_vec_axpy(small * uniform(), a, aside);
		worst = fmax(worst, off_the_cone(a, opposite, small * pow(10, 2 * fabs(uniform()))));
		worst = fmax(worst, off_the_cone(a, across, length(across) * (1 + 1e-15 * (k % 7))));
	}
	assert_true(worst < 4e-15);
}

/* A small change of either force or of the cap changes the result by little: there is no jump between the cases. */
static void without_a_jump(void **state) {
	double worst = 0;
	(void)state;
	srand(5);
	for (int k = 0; k < 200000; k++) {
		const quern_vec a = some(1), b = some(k % 2 ? 1 : 0.3);
		const double cap = 0.05 + fabs(uniform()), d = 1e-9;
		const quern_vec near_a = quern_vec_add(a, some(d)), near_b = quern_vec_add(b, some(d));
		const quern_cone one = quern_cone_shares(a, b, cap),
						 other = quern_cone_shares(near_a, near_b, cap + d * uniform());
		const double jump = length(quern_vec_sub(total(a, b, one), total(near_a, near_b, other)));
		worst = fmax(worst, jump);
	}
	assert_true(worst < 1e-4); /* the root of a small number grows fast; a jump would be of the size of 0.1 */
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(closed_forms), cmocka_unit_test(always_on_the_cone),
		cmocka_unit_test(to_the_last_digits), cmocka_unit_test(without_a_jump) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
