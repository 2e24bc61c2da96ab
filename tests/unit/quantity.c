/* SPDX-License-Identifier: MIT */
/* Numbers with units: what is read, and what is refused with a reason. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <quantity.h>
#include <string.h>

static int open_units(void **state) { return *state = quern_units_create(), 0; }
static int close_units(void **state) { return quern_units_destroy(*state), 0; }

static void reads(void **state) {
	static const struct {
		const char *text, *unit;
		double value;
	} cases[] = { { "5", "m", 5 }, { "5 mm", "m", 5e-3 }, { "5mm", "m", 5e-3 },
		{ "-2.5e-1 um", "m", -2.5e-7 }, { "70 GPa", "Pa", 70e9 }, { "1e5 N/m", "N/m", 1e5 },
		{ "10 %", "1", 0.1 }, { "24 deg", "rad", 0.41887902047863906 }, { "1500 kg/m^3", "kg/m^3", 1500 },
		{ "2.5 g/cm^3", "kg/m^3", 2500 }, { "9.81 m s-2", "m/s^2", 9.81 }, { "3 1/s", "1/s", 3 },
		{ "3 Hz", "1/s", 3 }, { "5 min", "s", 300 }, { "+.5", "1", 0.5 }, { "2 N m", "J", 2 },
		{ "0", "s", 0 }, { "1e-320", "m", 1e-320 } };
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char why[160] = "";
		double value = NAN;
		if (!quern_quantity_read(*state, cases[i].text, cases[i].unit, &value, why))
			fail_msg("%s as %s: %s", cases[i].text, cases[i].unit, why);
		if (fabs(value - cases[i].value) > 1e-14 * fabs(cases[i].value))
			fail_msg("%s is %.17g %s, should be %.17g", cases[i].text, value, cases[i].unit, cases[i].value);
	}
}

static void refuses(void **state) {
	static const struct {
		const char *text, *unit, *why;
	} cases[] = { { "", "m", "is no number" }, { "five", "m", "'five' is no number" },
		{ "nan", "1", "is no number" }, { ".inf", "1", "is no number" }, { "inf", "1", "is no number" },
		{ "0x10", "1", "is no decimal number" }, { "1e400", "m", "is too large" },
		{ "1e308 km", "m", "is too large" }, { "1e-400", "s", "is too small" },
		{ "5 kg", "m", "'kg' cannot be turned into m" }, { "5 mmm", "m", "'mmm' is no unit; m is wanted" },
		{ "5 m", "1", "cannot be turned into a pure number" }, { "5 %", "m", "'%' cannot be turned into m" },
		{ "30 deg", "1", "cannot be turned into a pure number" }, { "20 degC", "K", "has an offset" },
		{ "2 3", "1", "'3' is no unit" }, { "2 3 m", "m", "is no unit" }, { "0,1 s", "s", "a decimal comma" },
		{ "5 -m", "m", "is no unit" }, { "1 m", "s", "cannot be turned into s" },
		{ "- 5", "m", "is no number" }, { "5 m;", "m", "is no unit" } };
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char why[160] = "";
		double value;
		if (quern_quantity_read(*state, cases[i].text, cases[i].unit, &value, why))
			fail_msg("'%s' is taken for %g %s", cases[i].text, value, cases[i].unit);
		if (!strstr(why, cases[i].why))
			fail_msg("'%s': '%s' does not say '%s'", cases[i].text, why, cases[i].why);
	}
}

static void long_text(void **state) {
	char text[4000], why[160];
	double value;
	memset(text, 'x', sizeof text);
	text[0] = '1', text[1] = ' ', text[sizeof text - 1] = 0;
	assert_false(quern_quantity_read(*state, text, "m", &value, why));
	assert_true(strlen(why) < sizeof why);
}

static void equal_units(void **state) {
	assert_true(quern_units_equal(*state, "m/s", "m s-1"));
	assert_true(quern_units_equal(*state, "N m", "J"));
	assert_true(quern_units_equal(*state, "", "1"));
	assert_false(quern_units_equal(*state, "m", "mm"));
	assert_false(quern_units_equal(*state, "m", "s"));
	assert_false(quern_units_equal(*state, "nonsense", "m"));
}

static void masses(void **state) {
	static const struct {
		const char *unit;
		int power;
	} cases[] = { { "1", 0 }, { "m/s", 0 }, { "kg", 1 }, { "g", 1 }, { "N/m", 1 }, { "kg/m^3", 1 },
		{ "J/kg", 0 }, { "1/Pa", -1 }, { "kg2", 2 }, { "deg", 0 }, { "nonsense", 0 } };
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		if (quern_units_mass(*state, cases[i].unit) != cases[i].power)
			fail_msg("%s has kg^%d", cases[i].unit, quern_units_mass(*state, cases[i].unit));
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(reads), cmocka_unit_test(refuses),
		cmocka_unit_test(long_text), cmocka_unit_test(equal_units), cmocka_unit_test(masses) };
	return cmocka_run_group_tests(tests, open_units, close_units);
}
