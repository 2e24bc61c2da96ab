/* A list of laws: as many as a scene names, each with up to sixteen rows of its own, of every kind. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include "text.h"

/* Two grains and a floor, all in touch; the second grain may be fixed. Steps so short that nothing moves. */
static quern_run *touching(int dim, const char *laws, bool fixed) {
	return harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s},\n"
		"time: {end: 1e-6, step: 1e-9}, output: {fields: [contact.force, touch.force, contact.age, "
		"touch.age,\n"
		"  contact.mark0, contact.mark12, touch.mark0, touch.mark12]},\n"
		"bodies: [{plane: {point: %s, normal: %s}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, contact: [%s],\n"
		"  place: [{position: [0.01, %s0.00099]}, {position: [0.01199, %s0.00099], fixed: %s},\n"
		"    {position: [0.015, %s0.005]}]}}\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[0.02, 0.01]" : "[0.02, 0.02, 0.01]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[0, 1]" : "[0, 0, 1]", laws, dim == 2 ? "" : "0.01, ", dim == 2 ? "" : "0.01, ",
		fixed ? "true" : "false", dim == 2 ? "" : "0.01, ");
}

/* Twelve springs of 1, 2, ... 12 kN/m are one of 78 kN/m. */
static void every_law_counts(void **state) {
	static text laws;
	bool good = true;
	(void)state;
	for (int k = 1; k <= 12; k++)
		text_add(&laws, "{linear: {stiffness: %d, restitution: 1, friction: 0}}, ", 1000 * k);
	text_add(&laws, "marking");
	table_head("twelve springs of 1 to 12 kN/m: force over overlap, N/m");
	for (int dim = 2; dim <= 3; dim++) {
		quern_run *run = touching(dim, laws.data, false);
		harness_steps(run, 1);
		const quern_column pair = harness_field(run, "contact.force"),
						   floor = harness_field(run, "touch.force");
		good &= table_row("a pair", fabs(pair.real[0][0]) / 1e-5, 78e3, 1e-6);
		good &= table_row("a grain on a plane", floor.real[dim - 1][0] / 1e-5, 78e3, 1e-6);
		harness_close(run);
	}
	assert_true(good);
}

/* Entry of the list whose mark is there. */
static int entry_with(quern_run *run, const char *set, double mark) {
	char name[40];
	snprintf(name, sizeof name, "%s.mark0", set);
	for (uint32_t i = 0; i < harness_count(run, set); i++)
		if (harness_field(run, name).real[0][i] == mark) return (int)i;
	return -1;
}

/* A law that counts steps in an INDEX, reads ids and flags, and fills thirteen more columns finds all of them its own. */
static void rows_of_every_kind(void **state) {
	(void)state;
	for (int dim = 2; dim <= 3; dim++)
		for (int fixed = 0; fixed <= 1; fixed++) {
			/* a second law of another kind behind it must not disturb it */
			quern_run *run = touching(dim, "marking, {linear: {stiffness: 1000}}", fixed);
			harness_steps(run, 5);
			const int pair = entry_with(run, "contact", 1 + (fixed ? 2e6 : 0)),
					  floor = entry_with(run, "touch", 0);
			assert_true(pair >= 0 && floor >= 0);
			assert_int_equal(harness_field(run, "contact.age").index[pair], 4);
			assert_int_equal(harness_field(run, "touch.age").index[floor], 4);
			assert_true(harness_field(run, "contact.mark12").real[0][pair] == 13 + (fixed ? 2e6 : 0));
			assert_true(harness_field(run, "touch.mark12").real[0][floor] == 12);
			if (!fixed)
				assert_true(entry_with(run, "touch", 1001) >= 0); /* of a body both ids are the first's */
			for (uint32_t i = 0; i < harness_count(run, "contact"); i++)
				if ((int)i != pair) {
					assert_int_equal(harness_field(run, "contact.age").index[i], -1);
					assert_true(harness_field(run, "contact.mark12").real[0][i] == -13);
				}
			harness_close(run);
		}
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(every_law_counts),
		cmocka_unit_test(rows_of_every_kind) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
