/* SPDX-License-Identifier: MIT */
/* A list of laws: as many as a scene names, each with up to sixteen rows of its own, of every kind. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "scene_text.h"
#include "table.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Two grains and a floor, all in touch; the second grain may be fixed. Steps so short that nothing moves. */
static quern_run *touching(int dim, const char *laws, bool fixed) {
	return harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s},\n"
		"time: {end: 1e-6, step: 1e-9}, output: {fields: [contact.force, touch.force, contact.age, "
		"touch.age,\n"
		"  contact.mark0, contact.mark28, touch.mark0, touch.mark28]},\n"
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

/* A step is limited by all laws together: twelve springs with their dashpots have the limits of the one that they make up,
 * which is seven times as stiff as the stiffest of them. */
static void steps_see_every_law(void **state) {
	static text laws;
	bool good = true;
	(void)state;
	table_head("limits of the step by twelve springs, over those by one");
	for (int dim = 2; dim <= 3; dim++)
		for (int strong = 0; strong < 2; strong++) {
			double step[2], hard[2];
			char reason[200], hard_reason[200];
			for (int many = 0; many < 2; many++) {
				laws.length = 0;
				/* dashpots add up to that of the sum if stiffnesses are equal and each damps by 1/sqrt(12) */
				for (int k = 0; k < (many ? 12 : 1); k++)
					text_add(&laws, "{linear: {stiffness: %d, restitution: %s, friction: 0}}, ",
						many ? 6500 : 78000,
						!strong ? "1"
						: many  ? "0.26639"
								: "0.05");
				text_add(&laws, "marking");
				quern_run *run = touching(dim, laws.data, false);
				step[many] = quern_run_limit(run, &hard[many], reason, hard_reason);
				harness_close(run);
			}
			good &= table_row("recommended", step[1] / step[0], 1, strong ? 1e-3 : 1e-12);
			good &= table_row("hard", hard[1] / hard[0], 1, strong ? 1e-3 : 1e-12);
		}
	assert_true(good);
}

/* The sentence about a limit names the contact that sets it: here a floor that damps, where grains bounce. */
static void limits_name_their_contact(void **state) {
	char reason[200], hard_reason[200];
	double hard;
	(void)state;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [1, 1]}, time: {end: 1},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1]}},\n"
		"  {box: {lower: [0, 0], upper: [0.1, 0.1], contact: {restitution: 0.01}}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, contact: {linear: {stiffness: 1e5, "
		"restitution: 0.9}},\n  place: [{position: [0.5, 0.5]}, {position: [0.6, 0.5]}]}}\n");
	quern_run_limit(run, &hard, reason, hard_reason);
	assert_non_null(strstr(hard_reason, "on body.box"));
	assert_non_null(strstr(hard_reason, "damping ratio"));
	assert_null(strstr(hard_reason, "two lightest"));
	harness_close(run);
}

/* Entry of the list whose mark is there. */
static int entry_with(quern_run *run, const char *set, double mark) {
	char name[40];
	snprintf(name, sizeof name, "%s.mark0", set);
	for (uint32_t i = 0; i < harness_count(run, set); i++)
		if (harness_field(run, name).real[0][i] == mark) return (int)i;
	return -1;
}

/* A law that counts steps in an INDEX, reads ids and flags, and fills 29 more columns finds all of them its own. */
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
			assert_true(harness_field(run, "contact.mark28").real[0][pair] == 29 + (fixed ? 2e6 : 0));
			assert_true(harness_field(run, "touch.mark28").real[0][floor] == 28);
			if (!fixed)
				assert_true(entry_with(run, "touch", 1001) >= 0); /* of a body both ids are the first's */
			for (uint32_t i = 0; i < harness_count(run, "contact"); i++)
				if ((int)i != pair) {
					assert_int_equal(harness_field(run, "contact.age").index[i], -1);
					assert_true(harness_field(run, "contact.mark28").real[0][i] == -29);
				}
			harness_close(run);
		}
}

/* A law that acts at a distance reaches as far as the largest grains need it, wherever they come from, and as far as any
 * body's own parameters say: just within its range it pulls. */
static void laws_reach_the_farthest(void **state) {
	static const double mean = 1e-3, large = 5e-3;
	bool good = true;
	(void)state;
	table_head("pull of 2 N at a distance");
	for (int from_file = 0; from_file <= 1; from_file++) {
		char path[HARNESS_PATH], source[160];
		const double apart = 2 * large + 0.99 * 0.5 * (0.5 * large);
		if (from_file) {
			FILE *out = harness_file(path);
			fprintf(out, "x y radius\n0.02 0.05 %g\n%.17g 0.05 %g\n", large, 0.02 + apart, large);
			fclose(out);
			snprintf(source, sizeof source, "file: %s", path);
		} else
			snprintf(source, sizeof source,
				"place: [{position: [0.02, 0.05], radius: %g}, {position: [%.17g, 0.05], radius: %g}]", large,
				0.02 + apart, large);
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [0.1, 0.1]},\n"
			"time: {end: 1e-6, step: 1e-9}, output: {fields: [contact.force]},\n"
			"grains: {material: {density: 2500, radius: {mean: %g}}, contact: {pulling: {force: 2}}, %s}}\n",
			mean, source);
		if (from_file) unlink(path);
		harness_steps(run, 1);
		assert_int_equal(harness_count(run, "contact"), 1);
		good &= table_row(from_file ? "two large grains of a file" : "two large grains",
			fabs(harness_field(run, "contact.force").real[0][0]), 2, 1e-12);
		harness_close(run);
	}
	for (int own = 0; own <= 1; own++) { /* a range of 0.5 is the law's, of 4 the body's */
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [0.1, 0.1]},\n"
			"time: {end: 1e-6, step: 1e-9}, output: {fields: [touch.force]},\n"
			"bodies: [{plane: {point: [0, 0], normal: [0, 1]%s}}],\n"
			"grains: {material: {density: 2500, radius: {mean: %g}}, contact: {pulling: {force: 2}},\n"
			"  place: [{position: [0.02, %.17g]}]}}\n",
			own ? ", contact: {range: 4}" : "", mean, mean * (1 + 0.99 * (own ? 4 : 0.5)));
		harness_steps(run, 1);
		assert_int_equal(harness_count(run, "touch"), 1);
		good &= table_row(own ? "a body with a range of its own" : "a body",
			-harness_field(run, "touch.force").real[1][0], 2, 1e-12);
		harness_close(run);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(every_law_counts),
		cmocka_unit_test(steps_see_every_law), cmocka_unit_test(limits_name_their_contact),
		cmocka_unit_test(rows_of_every_kind), cmocka_unit_test(laws_reach_the_farthest) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
