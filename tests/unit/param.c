/* SPDX-License-Identifier: MIT */
/* Rows of parameters: from a map to an instance and back. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <param.h>
#include <stdlib.h>
#include <string.h>
#include <text.h>

typedef struct {
	quern_real at[3];
} item;

typedef struct {
	quern_real stiffness, angle, maybe, height;
	int32_t count, law;
	bool on;
	const char *name;
	quern_real corner[3];
	quern_list items;
} sample;

static const char *const laws[] = { "normal", "uniform", NULL };
static const quern_param item_rows[] = { QUERN_PARAM(item, at, "m", "Place.", .flags = QUERN_REQUIRED),
	QUERN_END_PARAMS };
static const quern_param rows[] = {
	QUERN_PARAM(sample, stiffness, "N/m", "Spring.", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e9),
	QUERN_PARAM(sample, angle, "rad", "Angle.", .def = 1, .planar = 2, .flags = QUERN_PLANAR),
	QUERN_PARAM(sample, maybe, "1", "Perhaps.", .flags = QUERN_MAYBE, .min = 0, .max = 1),
	QUERN_PARAM(sample, height, "m", "Height.", .from = "scene.height"),
	QUERN_PARAM_AS(sample, count, "number.of", "1", "Count.", .def = 3, .min = 1, .max = 10),
	QUERN_PARAM(sample, law, "1", "Law.", .choices = laws), QUERN_PARAM(sample, on, NULL, "Switch."),
	QUERN_PARAM(sample, name, NULL, "Name.", .text = "nobody"),
	QUERN_PARAM(sample, corner, "m", "Corner.", .def = 0.5),
	QUERN_PARAM(sample, items, NULL, "Items.", .rows = item_rows, .item_size = sizeof(item)), QUERN_END_PARAMS
};

static const quern_published published = { "scene.height", "m", 0.25 };

typedef struct {
	quern_report *report;
	quern_units *units;
	quern_tree *tree;
	sample s;
} reading;

static reading read_text(const char *text, uint32_t dim) {
	reading r = { .report = quern_report_create(), .units = quern_units_create() };
	r.tree = quern_tree_parse("t.yaml", text, strlen(text), r.report);
	const quern_reading how = { r.report, r.units, dim, &published, 1, r.tree };
	quern_params_read(&how, "sample", rows, r.tree->root, (quern_mark) { "t.yaml", 1, 1 }, NULL, &r.s);
	return r;
}

static void finish(reading *r) {
	quern_params_finish(rows, &r->s);
	quern_tree_destroy(r->tree);
	quern_units_destroy(r->units);
	quern_report_destroy(r->report);
}

static void defaults(void **state) {
	(void)state;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		reading r = read_text("stiffness: 1 kN/m\n", dim);
		assert_int_equal(quern_report_errors(r.report), 0);
		assert_true(r.s.stiffness == 1000);
		assert_true(r.s.angle == (dim == 2 ? 2 : 1));
		assert_true(isnan(r.s.maybe));
		assert_true(r.s.height == 0.25);
		assert_int_equal(r.s.count, 3);
		assert_int_equal(r.s.law, 0);
		assert_false(r.s.on);
		assert_string_equal(r.s.name, "nobody");
		assert_true(r.s.corner[1] == 0.5 && r.s.corner[2] == (dim == 3 ? 0.5 : 0));
		assert_int_equal(r.s.items.n, 0);
		finish(&r);
	}
}

static void values(void **state) {
	reading r = read_text(
		"stiffness: 5\nangle: \"180 deg\"\nmaybe: 50 %\nheight: 1 cm\nnumber: {of: 7}\nlaw: uniform\n"
		"on: true\nname: 'x'\ncorner: [1 mm, 2 mm]\nitems: [{at: [1, 2]}, {at: [3, 4]}]\n",
		2);
	(void)state;
	assert_int_equal(quern_report_errors(r.report), 0);
	assert_true(fabs(r.s.angle - 3.141592653589793) < 1e-12);
	assert_true(r.s.maybe == 0.5 && r.s.height == 0.01);
	assert_int_equal(r.s.count, 7);
	assert_int_equal(r.s.law, 1);
	assert_true(r.s.on);
	assert_true(r.s.corner[0] == 1e-3 && r.s.corner[1] == 2e-3 && r.s.corner[2] == 0);
	assert_int_equal(r.s.items.n, 2);
	assert_true(((const item *)r.s.items.items)[1].at[1] == 4);
	finish(&r);
}

/* Each text has exactly one fault, which the message names. */
static void faults(void **state) {
	static const char *const cases[][2] = { { "{}", "'stiffness' is missing: Spring [N/m]" },
		{ "stifness: 5", "unknown key 'stifness'; did you mean 'stiffness'?" },
		{ "stiffness: 0", "stiffness is 0, must be above 0 and at most 1e9 N/m" },
		{ "stiffness: [1]", "must be one number" }, { "stiffness: 1\nmaybe: 2", "must be between 0 and 1" },
		{ "stiffness: 1\nnumber: 7", "'number' must be a map" },
		{ "stiffness: 1\nnumber: {of: 2.5}", "must be a whole number" },
		{ "stiffness: 1\nlaw: normla", "must be one of: normal, uniform; did you mean 'normal'?" },
		{ "stiffness: 1\non: maybe", "must be true or false" },
		{ "stiffness: 1\non: 'true'", "must be true or false" },
		{ "stiffness: '5'", "\"5\" in quotes is a text, not a number" },
		{ "stiffness: 1\nnumber: {of: \"5 \"}", "in quotes is a text, not a number" },
		{ "stiffness: 1\nname: [x]", "must be a text, not a list of 1" },
		{ "stiffness: 1\ncorner: [1, 2, 3]",
			"must be a list of 2 numbers, one per dimension, not a list of 3" },
		{ "stiffness: 1\nitems: {at: [1, kg]}", "'kg' is no number" },
		{ "stiffness: 1\nitems: [{}]", "sample.items: 'at' is missing" },
		{ "[1]", "takes a map of parameters" } };
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		reading r = read_text(cases[i][0], 2);
		char *text = NULL;
		size_t size = 0;
		FILE *out = open_memstream(&text, &size);
		quern_report_print(r.report, out);
		fclose(out);
		if (quern_report_errors(r.report) != 1 || !strstr(text, cases[i][1]))
			fail_msg("%s\nshould be one fault: %s", text, cases[i][1]);
		free(text);
		finish(&r);
	}
}

/* A number that another part of the scene gives is never 0 because nobody gives it: the scene must, unless the row says
 * what stands in its place or that it may be left out. */
static void from_nobody(void **state) {
	static const struct {
		uint8_t flags;
		quern_real def;
		size_t faults;
		quern_real value;
	} cases[] = { { 0, 0, 1, NAN }, { QUERN_REQUIRED, 0, 1, NAN }, { QUERN_REQUIRED, 3, 1, NAN },
		{ 0, 3, 0, 3 }, { QUERN_MAYBE, 0, 0, NAN } };
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		const quern_param row[] = { QUERN_PARAM(sample, height, "m", "Height.", .from = "nobody.knows",
										.flags = cases[i].flags, .def = cases[i].def),
			QUERN_END_PARAMS };
		quern_report *report = quern_report_create();
		const quern_reading how = { report, NULL, 2, &published, 1, NULL };
		sample s = { 0 };
		quern_params_read(&how, "sample", row, NULL, (quern_mark) { 0 }, NULL, &s);
		assert_int_equal(quern_report_errors(report), cases[i].faults);
		if (!cases[i].faults)
			assert_true(isnan(cases[i].value) ? isnan(s.height) : s.height == cases[i].value);
		quern_report_destroy(report);
	}
}

static void writes(void **state) {
	reading r = read_text("{stiffness: 0.1, corner: [1, 2], items: [{at: [1, 2]}], name: 'a \"b\"'}", 2);
	quern_node *map = quern_node_create(QUERN_NODE_MAP);
	quern_text out = { 0 };
	(void)state;
	quern_params_write(rows, &r.s, 2, NULL, map);
	quern_node_print(map, 0, &out);
	reading again = read_text(quern_text_string(&out), 2);
	assert_int_equal(quern_report_errors(again.report), 0);
	assert_true(again.s.stiffness == 0.1 && again.s.corner[1] == 2 && isnan(again.s.maybe));
	assert_string_equal(again.s.name, "a \"b\"");
	assert_int_equal(again.s.items.n, 1);
	quern_text_finish(&out);
	quern_node_destroy(map);
	finish(&again);
	finish(&r);
}

/* ---- lists whose items have names, items that are one value, keys that exclude each other ---- */

typedef struct {
	const char *word;
	quern_real share;
} part;
typedef struct {
	quern_real alone;
	quern_list parts, words;
} mixed;

static const quern_param part_rows[] = { QUERN_PARAM(part, word, NULL, "Its name.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(part, share, "1", "Share.", .flags = QUERN_REQUIRED, .max = 1), QUERN_END_PARAMS };
static const quern_param word_rows[] = { QUERN_PARAM(part, word, NULL, "A word.", .flags = QUERN_REQUIRED),
	QUERN_END_PARAMS };
static const quern_param mixed_rows[] = {
	QUERN_PARAM(mixed, alone, "m", "One for all.", .flags = QUERN_REQUIRED, .unless = "parts"),
	QUERN_PARAM(mixed, parts, NULL, "Parts.", .rows = part_rows, .item_size = sizeof(part), .text = "word"),
	QUERN_PARAM(mixed, words, NULL, "Words.", .rows = word_rows, .item_size = sizeof(part)), QUERN_END_PARAMS
};

typedef struct {
	char *said;
	size_t faults;
	mixed m;
	quern_tree *tree;
} mixture;

static mixture read_mixture(const char *text) {
	quern_report *report = quern_report_create();
	quern_units *units = quern_units_create();
	mixture r = { .tree = quern_tree_parse("t.yaml", text, strlen(text), report) };
	const quern_reading how = { report, units, 2, NULL, 0, r.tree };
	size_t size = 0;
	quern_params_read(&how, "m", mixed_rows, r.tree->root, (quern_mark) { "t.yaml", 1, 1 }, NULL, &r.m);
	FILE *out = open_memstream(&r.said, &size);
	quern_report_print(report, out);
	fclose(out);
	r.faults = quern_report_errors(report);
	quern_units_destroy(units);
	quern_report_destroy(report);
	return r;
}

static void forget(mixture *r) {
	free(r->said);
	quern_params_finish(mixed_rows, &r->m);
	quern_tree_destroy(r->tree);
}

/* A map of names, a list of items that have one, and single values for whole items mean the same. */
static void named_items(void **state) {
	static const char *const forms[] = { "parts: {sand: 70 %, rock: {share: 0.3}}\nwords: [a, b]",
		"parts: [{word: sand, share: 0.7}, {share: 30 %, word: rock}]\nwords: [{word: a}, b]" };
	(void)state;
	for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
		mixture r = read_mixture(forms[i]);
		if (r.faults) fail_msg("%s", r.said);
		const part *parts = r.m.parts.items, *words = r.m.words.items;
		assert_true(r.m.parts.n == 2 && r.m.words.n == 2 && isnan(r.m.alone));
		assert_string_equal(parts[0].word, "sand");
		assert_string_equal(parts[1].word, "rock");
		assert_true(fabs(parts[0].share - 0.7) < 1e-15 && fabs(parts[1].share - 0.3) < 1e-15);
		assert_string_equal(words[0].word, "a");
		assert_string_equal(words[1].word, "b");
		forget(&r);
	}
}

static void named_faults(void **state) {
	static const char *const cases[][2] = { { "{}", "'alone' is missing: One for all [m]" },
		{ "parts: {}", "'alone' is missing" }, { "parts: []", "'alone' is missing" },
		{ "alone: 1\nparts: {a: 1}", "alone does not go with parts: give one of them" },
		{ "parts: {a: {}}", "m.parts: 'share' is missing" },
		{ "parts: {a: }", "m.parts: 'share' is missing" },
		{ "parts: {a: {share: 1, word: b}}", "m.parts: 'a' has its word already: its key" },
		{ "parts: {a: 2}", "m.parts: share is 2, must be between 0 and 1" },
		{ "parts: {a: {shrae: 1}}", "unknown key 'shrae'; did you mean 'share'?" },
		{ "parts: [{share: 1}]", "m.parts: 'word' is missing" },
		{ "alone: 1\nwords: [[a]]", "must be a text" } };
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		mixture r = read_mixture(cases[i][0]);
		if (r.faults != 1 || !strstr(r.said, cases[i][1]))
			fail_msg("%s\nshould be one fault: %s", r.said, cases[i][1]);
		forget(&r);
	}
}

/* What is written reads back, also where a default must not stand beside what excludes it. */
static void named_writes(void **state) {
	static const char *const forms[] = { "alone: 3", "parts: {a: 0.25, b: 0.75}\nwords: [c]" };
	(void)state;
	for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
		mixture r = read_mixture(forms[i]);
		quern_node *map = quern_node_create(QUERN_NODE_MAP);
		quern_text out = { 0 };
		quern_params_write(mixed_rows, &r.m, 2, NULL, map);
		quern_node_print(map, 0, &out);
		mixture again = read_mixture(quern_text_string(&out));
		if (again.faults) fail_msg("%s\nin\n%s", again.said, out.data);
		assert_true(again.m.parts.n == r.m.parts.n && again.m.words.n == r.m.words.n);
		assert_true(i ? ((const part *)again.m.parts.items)[1].share == 0.75 : again.m.alone == 3);
		quern_text_finish(&out);
		quern_node_destroy(map);
		forget(&again);
		forget(&r);
	}
}

static void marks(void **state) {
	reading r = read_text("stiffness: 1\nnumber:\n  of: 2\n", 2);
	(void)state;
	assert_int_equal(quern_param_mark(r.tree->root, "number.of", (quern_mark) { 0 }).line, 3);
	assert_int_equal(quern_param_mark(r.tree->root, "corner", (quern_mark) { .line = 9 }).line, 9);
	assert_true(quern_param_number(quern_param_find(rows, "number.of"), &r.s) == 2);
	assert_null(quern_param_find(rows, "number"));
	finish(&r);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(defaults), cmocka_unit_test(values),
		cmocka_unit_test(faults), cmocka_unit_test(from_nobody), cmocka_unit_test(writes),
		cmocka_unit_test(marks), cmocka_unit_test(named_items), cmocka_unit_test(named_faults),
		cmocka_unit_test(named_writes) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
