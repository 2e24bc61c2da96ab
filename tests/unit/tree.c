/* SPDX-License-Identifier: MIT */
/* Trees: marks, limits, --set, and what is written reads back as the same. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdlib.h>
#include <string.h>
#include <text.h>
#include <time.h>
#include <tree.h>

typedef struct {
	quern_report *report;
	quern_tree *tree;
} document;

static document parse(const char *text) {
	document d = { .report = quern_report_create() };
	d.tree = quern_tree_parse("t.yaml", text, strlen(text), d.report);
	return d;
}

static void finish(document *d) {
	quern_tree_destroy(d->tree);
	quern_report_destroy(d->report);
}

/* Everything reported, as one string; free() it. */
static char *said(const document *d) {
	char *data = NULL;
	size_t size = 0;
	FILE *out = open_memstream(&data, &size);
	assert_non_null(out);
	quern_report_print(d->report, out);
	fclose(out);
	return data;
}

static const quern_node *at(const quern_node *node, const char *path) {
	char *copy = quern_copy(path), *rest = copy, *key;
	while (node && (key = strsep(&rest, ".")))
		node = node->kind == QUERN_NODE_LIST ? node->entries[strtoul(key, NULL, 10)].value
											 : quern_node_find(node, key);
	free(copy);
	return node;
}

static void marks(void **state) {
	document d = parse("a: 1\nb:\n  c: [x, 'y', {d: 4}]\n  e: ~\n");
	(void)state;
	assert_int_equal(quern_report_errors(d.report), 0);
	const quern_node *y = at(d.tree->root, "b.c.1"), *four = at(d.tree->root, "b.c.2.d");
	assert_string_equal(y->text, "y");
	assert_true(y->quoted);
	assert_int_equal(y->mark.line, 3);
	assert_int_equal(y->mark.column, 10);
	assert_string_equal(y->mark.file, "t.yaml");
	assert_string_equal(four->text, "4");
	assert_int_equal(four->mark.column, 19);
	const quern_entry *b = quern_node_entry(d.tree->root, "b");
	assert_int_equal(b->mark.line, 2);
	assert_null(quern_node_find(at(d.tree->root, "b"), "e"));
	assert_non_null(quern_node_entry(at(d.tree->root, "b"), "e"));
	finish(&d);
}

static void aliases(void **state) {
	document d = parse("a: &x {b: 1}\nc: *x\n");
	(void)state;
	assert_string_equal(at(d.tree->root, "c.b")->text, "1");
	assert_int_equal(at(d.tree->root, "c.b")->mark.line, 1); /* a fault stands where the value does */
	assert_ptr_not_equal(at(d.tree->root, "c"), at(d.tree->root, "a"));
	finish(&d);
}

static void faults(void **state) {
	static const struct {
		const char *text, *place, *message;
	} cases[] = { { "a: [1", "t.yaml:2:1:", "missing here" },
		{ "a: 1\na: 2\n", "t.yaml:2:1:", "first at line 1" }, { "a: *b\n", "t.yaml:1:4:", "names no anchor" },
		{ "", "t.yaml:", "empty" }, { "a: \"\\0\"\n", "t.yaml:1:4:", "zero byte" },
		{ "a: 'b\n", "t.yaml:1:4:", "quote is never closed" }, { "a:\n\t- b\n", "t.yaml:2:1:", "a tab" },
		{ "a: 1\n---\nb: 2\n", "t.yaml:2:1:", "second document" },
		{ "a: b\x01\n", "t.yaml:1:5:", "control characters" } };
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		document d = parse(cases[i].text);
		char *text = said(&d);
		if (!strstr(text, cases[i].place) || !strstr(text, cases[i].message))
			fail_msg("%s\nis not at %s or does not say '%s'", text, cases[i].place, cases[i].message);
		free(text);
		finish(&d);
	}
}

static void limits(void **state) {
	char deep[200];
	(void)state;
	for (int n = 30; n <= 40; n += 10) {
		memset(deep, '[', (size_t)n);
		memset(deep + n, ']', (size_t)n);
		deep[2 * n] = 0;
		document d = parse(deep);
		assert_int_equal(quern_report_errors(d.report), n > 32);
		finish(&d);
	}
}

static void set_values(void **state) {
	document d = parse("a: {b: 1, c: [1, {d: 2}]}\nlaw: linear\n");
	static const char *const options[] = { "a.b=5 mm", "a.c.1.d=[3, 4]", "a.new.deep=6", "law.linear.k=7",
		"a.c.0=", "e={f: 8}" };
	(void)state;
	for (size_t i = 0; i < sizeof options / sizeof *options; i++)
		quern_tree_set(d.tree, options[i], d.report);
	assert_int_equal(quern_report_errors(d.report), 0);
	assert_string_equal(at(d.tree->root, "a.b")->text, "5 mm");
	assert_string_equal(at(d.tree->root, "a.c.1.d.1")->text, "4");
	assert_string_equal(at(d.tree->root, "a.new.deep")->text, "6");
	assert_string_equal(at(d.tree->root, "law.linear.k")->text, "7"); /* a bare name is opened */
	assert_true(quern_node_is_null(at(d.tree->root, "a.c.0")));
	assert_string_equal(at(d.tree->root, "e.f")->text, "8");
	assert_string_equal(at(d.tree->root, "a.b")->mark.file, "--set a.b=5 mm");
	assert_int_equal(at(d.tree->root, "a.b")->mark.line, 0);
	finish(&d);
}

static void set_faults(void **state) {
	static const char *const options[] = { "a", "=1", "a.b.c=1", "l.9=1", "l.x=1", "l.00=1", "l.+0=1",
		"l. 0=1", "a=[1", "" };
	(void)state;
	for (size_t i = 0; i < sizeof options / sizeof *options; i++) {
		document d = parse("a: {b: 1}\nl: [1, 2]\n");
		quern_tree_set(d.tree, options[i], d.report);
		if (quern_report_errors(d.report) != 1) fail_msg("--set %s is not refused", options[i]);
		char *text = said(&d);
		assert_non_null(strstr(text, "--set "));
		free(text);
		finish(&d);
	}
}

static void writes(void **state) {
	quern_node *map = quern_node_create(QUERN_NODE_MAP);
	quern_text out = { 0 };
	(void)state;
	quern_node_put(map, "a.b", "1");
	quern_node_put(map, "a.c", "2");
	quern_node_put_quoted(map, "name", "say \"x\": \\ y\n");
	quern_node *list = quern_node_put_list(map, "list");
	quern_node_append(list, "3");
	quern_node_put(quern_node_append_map(list), "d", "4");
	quern_node_print(map, 0, &out);
	document d = parse(quern_text_string(&out));
	assert_int_equal(quern_report_errors(d.report), 0);
	assert_string_equal(at(d.tree->root, "a.c")->text, "2");
	assert_string_equal(at(d.tree->root, "name")->text, "say \"x\": \\ y\n");
	assert_string_equal(at(d.tree->root, "list.1.d")->text, "4");
	quern_text_finish(&out);
	quern_node_destroy(map);
	finish(&d);
}

/* true and false have YAML's six words in three spellings each, and none of them in quotes. */
static void booleans(void **state) {
	static const struct {
		const char *text;
		int value; /* -1: none */
	} cases[] = { { "true", 1 }, { "Yes", 1 }, { "ON", 1 }, { "false", 0 }, { "no", 0 }, { "Off", 0 },
		{ "tRue", -1 }, { "y", -1 }, { "1", -1 }, { "'true'", -1 }, { "[true]", -1 }, { "", -1 } };
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char text[32];
		bool value = false;
		snprintf(text, sizeof text, "a: %s", cases[i].text);
		document d = parse(text);
		const bool is = quern_node_bool(quern_node_entry(d.tree->root, "a")->value, &value);
		if (is != (cases[i].value >= 0) || (is && value != cases[i].value))
			fail_msg("%s is taken for %d", text, is ? value : -1);
		finish(&d);
	}
}

/* Items of a list have one name each: their number as people write it. */
static void items(void **state) {
	static const char *const none[] = { "00", "01", "+0", "-0", " 0", "0 ", "", "0x0", "2", "4294967296",
		"99999999999999999999" };
	(void)state;
	document d = parse("[a, b]");
	assert_string_equal(quern_node_item(d.tree->root, "1")->value->text, "b");
	for (size_t i = 0; i < sizeof none / sizeof *none; i++)
		if (quern_node_item(d.tree->root, none[i])) fail_msg("'%s' names an item", none[i]);
	finish(&d);
}

/* Of a key that stands several times the first counts, every other one is a fault with its place, and an anchor in it may
 * still be named. The cost is that of sorting: it took minutes when every key was held against all others. */
static void repeated_keys(void **state) {
	enum { KEYS = 60000 };
	quern_text text = { 0 };
	(void)state;
	document d = parse("a: 1\nb: 2\na: &x 3\nc: *x\na: 4\n");
	assert_int_equal(quern_report_errors(d.report), 2);
	assert_string_equal(at(d.tree->root, "a")->text, "1");
	assert_string_equal(at(d.tree->root, "c")->text, "3");
	assert_int_equal(d.tree->root->n, 3);
	finish(&d);
	for (int k = 0; k < KEYS; k++) quern_text_add(&text, "k%d: 1\n", k % (KEYS - 1));
	const clock_t begin = clock();
	d = parse(quern_text_string(&text));
	assert_int_equal(quern_report_errors(d.report), 1);
	assert_true(clock() - begin < 5 * CLOCKS_PER_SEC);
	finish(&d);
	quern_text_finish(&text);
}

static void merges(void **state) {
	document base = parse("a: {b: 1, c: 2}\nd: 3\n"), over = parse("a: {c: 4}\nd: {e: 5}\nf: 6\n");
	(void)state;
	quern_node_merge(base.tree->root, over.tree->root);
	assert_string_equal(at(base.tree->root, "a.b")->text, "1");
	assert_string_equal(at(base.tree->root, "a.c")->text, "4");
	assert_string_equal(at(base.tree->root, "d.e")->text, "5");
	assert_string_equal(at(base.tree->root, "f")->text, "6");
	finish(&base);
	finish(&over);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(marks), cmocka_unit_test(aliases),
		cmocka_unit_test(faults), cmocka_unit_test(limits), cmocka_unit_test(set_values),
		cmocka_unit_test(set_faults), cmocka_unit_test(booleans), cmocka_unit_test(items),
		cmocka_unit_test(repeated_keys), cmocka_unit_test(writes), cmocka_unit_test(merges) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
