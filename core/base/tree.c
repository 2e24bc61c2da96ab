/* SPDX-License-Identifier: MIT */
#include "tree.h"
#include "text.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <yaml.h>

/* A scene is written by hand: these limits are far above any, and keep alias bombs and binary files harmless. */
enum { MAX_DEPTH = 32, MAX_NODES = 200000, MAX_BYTES = 16 << 20 };

typedef struct {
	char *name;
	quern_node *node;
} anchor;

typedef struct {
	yaml_parser_t yaml;
	quern_report *report;
	const char *file;
	bool option; /* text of the command line: marks carry no line */
	const char *data;
	size_t length;
	anchor *anchors;
	size_t n_anchors, anchors_capacity, n_nodes;
	quern_node dropped; /* values of keys that stand twice: an anchor in them may still be named */
	bool failed;
} reader;

void quern_node_destroy(quern_node *node) {
	if (!node) return;
	for (size_t i = 0; i < node->n; i++) {
		free(node->entries[i].key);
		quern_node_destroy(node->entries[i].value);
	}
	free(node->entries);
	free(node->text);
	free(node);
}

static quern_mark mark_of(const reader *r, yaml_mark_t mark) {
	if (r->option) return (quern_mark) { .file = r->file };
	return (quern_mark) { r->file, mark.line + 1, mark.column + 1 };
}

static quern_node *fail(reader *r, quern_mark mark, const char *message) {
	if (!r->failed) quern_report_add(r->report, mark, "%s", message);
	r->failed = true;
	return NULL;
}

static quern_node *take_node(reader *r, quern_node_kind kind, quern_mark mark) {
	if (++r->n_nodes > MAX_NODES)
		return fail(r, mark, "the scene has more than 200000 values, aliases counted");
	quern_node *node = quern_take(1, sizeof *node);
	node->kind = kind;
	node->mark = mark;
	return node;
}

/* Faults stand at the alias, everything else where the anchor has it. */
static quern_node *copy(reader *r, const quern_node *old, quern_mark alias) {
	quern_node *node = take_node(r, old->kind, alias);
	if (!node) return NULL;
	node->mark = old->mark;
	node->quoted = old->quoted;
	if (old->text) node->text = quern_copy(old->text);
	for (size_t i = 0; i < old->n; i++) {
		quern_node *value = copy(r, old->entries[i].value, alias);
		if (!value) return quern_node_destroy(node), NULL;
		node->entries = quern_grow(node->entries, node->n, &node->capacity, sizeof(quern_entry));
		node->entries[node->n++] = (quern_entry) {
			.key = old->entries[i].key ? quern_copy(old->entries[i].key) : NULL,
			.mark = old->entries[i].mark,
			.value = value,
		};
	}
	return node;
}

/* What libyaml says, and what helps; `begin`: the fault shows best where its context begins. */
static const struct {
	const char *problem, *context, *cure;
	bool begin;
} cures[] = {
	{ "could not find expected ':'", "while scanning a simple key",
		"a ':' with a blank after it is missing behind this key", true },
	{ "found unexpected end of stream", "while scanning a quoted scalar", "this quote is never closed",
		true },
	{ "did not find expected ',' or ']'", NULL, "a ',' is missing here, or a ']' that closes the list",
		false },
	{ "did not find expected ',' or '}'", NULL, "a ',' is missing here, or a '}' that closes the map",
		false },
	{ "did not find expected key", NULL, "this line does not stand below the keys of its map", false },
	{ "did not find expected '-' indicator", NULL, "this line does not stand below the items of its list",
		false },
	{ "mapping values are not allowed in this context", NULL,
		"a ':' after what is a value already: begin a new line, or put the text in quotes", false },
};

/* libyaml gives a byte that is no text by its offset alone. */
static yaml_mark_t mark_of_byte(const reader *r, size_t offset) {
	yaml_mark_t mark = { 0 };
	for (size_t i = 0; i < offset && i < r->length; i++) {
		const unsigned char c = (unsigned char)r->data[i];
		if (c == '\n') mark.line++, mark.column = 0;
		else mark.column += (c & 0xc0u) != 0x80u;
	}
	return mark;
}

static void explain(reader *r) {
	const yaml_parser_t *y = &r->yaml;
	const char *problem = y->problem ? y->problem : "it cannot be read", *cure = problem;
	yaml_mark_t at = y->problem ? y->problem_mark : y->context_mark;
	if (y->error == YAML_READER_ERROR) at = mark_of_byte(r, y->problem_offset);
	else if (y->error == YAML_SCANNER_ERROR && at.index < r->length && r->data[at.index] == '\t')
		cure = "a tab: lines are indented with blanks";
	for (size_t i = 0; i < sizeof cures / sizeof *cures; i++) {
		if (strcmp(problem, cures[i].problem) != 0) continue;
		if (cures[i].context && (!y->context || strcmp(y->context, cures[i].context) != 0)) continue;
		cure = cures[i].cure;
		if (cures[i].begin) at = y->context_mark;
	}
	quern_report_add(r->report, mark_of(r, at), "not valid YAML: %s", cure);
}

static bool next(reader *r, yaml_event_t *event) {
	if (yaml_parser_parse(&r->yaml, event)) return true;
	if (!r->failed) explain(r);
	r->failed = true;
	return false;
}

static quern_node *value(reader *r, yaml_event_t *event, int depth);

static void keep(quern_node *node, char *key, quern_mark mark, quern_node *child) {
	node->entries = quern_grow(node->entries, node->n, &node->capacity, sizeof(quern_entry));
	node->entries[node->n++] = (quern_entry) { key, mark, child };
}

static int by_key(const void *pa, const void *pb) {
	const quern_entry *a = *(const quern_entry *const *)pa, *b = *(const quern_entry *const *)pb;
	const int order = strcmp(a->key, b->key);
	return order ? order : a < b ? -1 : 1;
}

/* Of a key that stands several times the first counts. */
static void drop_repeated(reader *r, quern_node *map) {
	const quern_entry **sorted = quern_take(map->n, sizeof *sorted), *first = NULL;
	bool *again = quern_take(map->n, sizeof *again);
	for (size_t i = 0; i < map->n; i++) sorted[i] = &map->entries[i];
	qsort(sorted, map->n, sizeof *sorted, by_key);
	for (size_t i = 0; i < map->n; i++) {
		if (!first || strcmp(first->key, sorted[i]->key) != 0) {
			first = sorted[i];
			continue;
		}
		again[sorted[i] - map->entries] = true;
		quern_report_add(r->report, sorted[i]->mark,
			"'%s' stands twice in this map; first at line %zu: remove one", first->key, first->mark.line);
	}
	size_t kept = 0;
	for (size_t i = 0; i < map->n; i++) {
		if (again[i]) free(map->entries[i].key), keep(&r->dropped, NULL, map->mark, map->entries[i].value);
		else map->entries[kept++] = map->entries[i];
	}
	map->n = kept;
	free(sorted);
	free(again);
}

static bool children(reader *r, quern_node *node, int depth) {
	const bool map = node->kind == QUERN_NODE_MAP;
	for (;;) {
		yaml_event_t event;
		char *key = NULL;
		quern_mark mark;
		if (!next(r, &event)) return false;
		mark = mark_of(r, event.start_mark);
		if (event.type == (map ? YAML_MAPPING_END_EVENT : YAML_SEQUENCE_END_EVENT)) {
			yaml_event_delete(&event);
			if (map) drop_repeated(r, node);
			return true;
		}
		if (map) {
			if (event.type != YAML_SCALAR_EVENT) {
				yaml_event_delete(&event);
				return fail(r, mark, "a key must be a word") != NULL;
			}
			key = quern_copy((const char *)event.data.scalar.value);
			yaml_event_delete(&event);
			if (!next(r, &event)) return free(key), false;
		}
		quern_node *child = value(r, &event, depth + 1);
		if (!child) return free(key), false;
		keep(node, key, mark, child);
	}
}

static void remember(reader *r, const yaml_char_t *name, quern_node *node) {
	if (!name || !node) return;
	r->anchors = quern_grow(r->anchors, r->n_anchors, &r->anchors_capacity, sizeof(anchor));
	r->anchors[r->n_anchors++] = (anchor) { quern_copy((const char *)name), node };
}

static quern_node *alias(reader *r, const char *name, quern_mark mark) {
	for (size_t i = r->n_anchors; i-- > 0;)
		if (!strcmp(r->anchors[i].name, name)) return copy(r, r->anchors[i].node, mark);
	if (!r->failed) quern_report_add(r->report, mark, "'*%s' names no anchor that stands before it", name);
	r->failed = true;
	return NULL;
}

/* Takes over the event. */
static quern_node *value(reader *r, yaml_event_t *event, int depth) {
	const quern_mark mark = mark_of(r, event->start_mark);
	quern_node *node = NULL;
	if (depth > MAX_DEPTH) fail(r, mark, "nested deeper than 32 levels");
	else switch (event->type) {
		case YAML_ALIAS_EVENT: node = alias(r, (const char *)event->data.alias.anchor, mark); break;
		case YAML_SCALAR_EVENT:
			node = take_node(r, QUERN_NODE_SCALAR, mark);
			if (!node) break;
			if (strlen((const char *)event->data.scalar.value) != event->data.scalar.length) {
				quern_node_destroy(node);
				node = fail(r, mark, "a value with a zero byte in it");
				break;
			}
			node->text = quern_copy((const char *)event->data.scalar.value);
			node->quoted = event->data.scalar.style != YAML_PLAIN_SCALAR_STYLE;
			remember(r, event->data.scalar.anchor, node);
			break;
		case YAML_SEQUENCE_START_EVENT:
		case YAML_MAPPING_START_EVENT:
			node = take_node(
				r, event->type == YAML_MAPPING_START_EVENT ? QUERN_NODE_MAP : QUERN_NODE_LIST, mark);
			if (node && !children(r, node, depth)) {
				quern_node_destroy(node);
				node = NULL;
			}
			/* remembered only when complete, so an alias inside its own anchor finds nothing */
			remember(r,
				event->type == YAML_MAPPING_START_EVENT ? event->data.mapping_start.anchor
														: event->data.sequence_start.anchor,
				node);
			break;
		default: fail(r, mark, "the scene ends too early"); break;
		}
	yaml_event_delete(event);
	return node;
}

static quern_node *document(reader *r) {
	quern_node *root = NULL;
	for (bool more = true; more && !r->failed;) {
		yaml_event_t event;
		if (!next(r, &event)) break;
		const quern_mark mark = mark_of(r, event.start_mark);
		switch (event.type) {
		case YAML_STREAM_END_EVENT:
			more = false;
			yaml_event_delete(&event);
			break;
		case YAML_STREAM_START_EVENT:
		case YAML_DOCUMENT_START_EVENT:
			if (root && event.type == YAML_DOCUMENT_START_EVENT)
				fail(r, mark, "a second document begins here: a scene is one");
			yaml_event_delete(&event);
			break;
		case YAML_DOCUMENT_END_EVENT: yaml_event_delete(&event); break;
		default: root = value(r, &event, 0); break;
		}
	}
	for (size_t i = 0; i < r->n_anchors; i++) free(r->anchors[i].name);
	free(r->anchors);
	for (size_t i = 0; i < r->dropped.n; i++) quern_node_destroy(r->dropped.entries[i].value);
	free(r->dropped.entries);
	if (r->failed) {
		quern_node_destroy(root);
		root = NULL;
	}
	return root;
}

const char *quern_tree_keep(quern_tree *tree, const char *name) {
	tree->names = quern_grow(tree->names, tree->n_names, &tree->names_capacity, sizeof(char *));
	return tree->names[tree->n_names++] = quern_copy(name);
}

static quern_node *parse(
	quern_tree *tree, const char *name, const char *data, size_t length, bool option, quern_report *report) {
	reader r = { .report = report,
		.file = quern_tree_keep(tree, name),
		.option = option,
		.data = data,
		.length = length };
	if (!yaml_parser_initialize(&r.yaml)) return NULL;
	yaml_parser_set_input_string(&r.yaml, (const unsigned char *)data, length);
	quern_node *root = document(&r);
	yaml_parser_delete(&r.yaml);
	return root;
}

quern_tree *quern_tree_parse(const char *name, const char *data, size_t length, quern_report *report) {
	quern_tree *tree = quern_take(1, sizeof *tree);
	tree->source = memcpy(quern_take(length + 1, 1), data, length);
	tree->length = length;
	tree->root = parse(tree, name, data, length, false, report);
	if (!tree->root && !quern_report_errors(report))
		quern_report_add(report, (quern_mark) { .file = tree->names[0] }, "the scene is empty");
	return tree;
}

/* NULL if it is all there, else why it is not. A pipe is refused: it could block, and a message reads the file once
 * more, to show the line that it is about. */
static const char *read_bytes(int fd, quern_text *text) {
	char buffer[65536];
	struct stat is;
	ssize_t n = -1;
	if (fstat(fd, &is)) return strerror(errno);
	if (!S_ISREG(is.st_mode) && !S_ISDIR(is.st_mode)) return "it is no regular file";
	while (text->length <= MAX_BYTES && (n = read(fd, buffer, sizeof buffer)) > 0) {
		text->data = quern_grow(text->data, text->length + (size_t)n, &text->capacity, 1);
		memcpy(text->data + text->length, buffer, (size_t)n);
		text->length += (size_t)n;
	}
	if (text->length > MAX_BYTES) return "it is larger than 16 MiB, so it is no scene";
	return n < 0 ? strerror(errno) : NULL;
}

quern_tree *quern_tree_read(const char *path, quern_report *report) {
	quern_text text = { 0 };
	quern_tree *tree = NULL;
	const int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
	const char *why = fd < 0 ? strerror(errno) : read_bytes(fd, &text);
	if (why)
		quern_report_add(
			report, (quern_mark) { .file = path }, "cannot be %s: %s", fd < 0 ? "opened" : "read", why);
	else tree = quern_tree_parse(path, text.data ? text.data : "", text.length, report);
	if (fd >= 0) close(fd);
	quern_text_finish(&text);
	return tree ? tree : quern_take(1, sizeof *tree);
}

void quern_tree_destroy(quern_tree *tree) {
	if (!tree) return;
	quern_node_destroy(tree->root);
	for (size_t i = 0; i < tree->n_names; i++) free(tree->names[i]);
	free(tree->names);
	free(tree->source);
	free(tree);
}

bool quern_node_is_null(const quern_node *node) {
	if (!node || node->kind != QUERN_NODE_SCALAR || node->quoted) return !node;
	return !*node->text || !strcmp(node->text, "~") || !strcmp(node->text, "null");
}

bool quern_node_bool(const quern_node *node, bool *value) {
	static const char *const words[][3] = { { "false", "False", "FALSE" }, { "no", "No", "NO" },
		{ "off", "Off", "OFF" }, { "true", "True", "TRUE" }, { "yes", "Yes", "YES" }, { "on", "On", "ON" } };
	if (node->kind != QUERN_NODE_SCALAR || node->quoted) return false;
	for (size_t i = 0; i < 18; i++)
		if (!strcmp(words[i / 3][i % 3], node->text)) return *value = i >= 9, true;
	return false;
}

const quern_entry *quern_node_item(const quern_node *list, const char *number) {
	const size_t n = strspn(number, "0123456789");
	if (list->kind != QUERN_NODE_LIST || !n || n > 9 || number[n] || (*number == '0' && n > 1)) return NULL;
	const size_t k = strtoul(number, NULL, 10);
	return k < list->n ? &list->entries[k] : NULL;
}

const quern_entry *quern_node_entry(const quern_node *map, const char *key) {
	if (!map || map->kind != QUERN_NODE_MAP) return NULL;
	for (size_t i = 0; i < map->n; i++)
		if (!strcmp(map->entries[i].key, key)) return &map->entries[i];
	return NULL;
}

quern_node *quern_node_find(const quern_node *map, const char *key) {
	const quern_entry *entry = quern_node_entry(map, key);
	return entry && !quern_node_is_null(entry->value) ? entry->value : NULL;
}

const char *quern_node_say(const quern_node *node, char buffer[64]) {
	if (quern_node_is_null(node)) return "nothing";
	if (node->kind == QUERN_NODE_MAP) return "a map";
	if (node->kind == QUERN_NODE_LIST) {
		snprintf(buffer, 64, "a list of %zu", node->n);
		return buffer;
	}
	snprintf(buffer, 64, "'%.40s%s'", node->text, strlen(node->text) > 40 ? "..." : "");
	return buffer;
}

/* The one thing in a list's item, {kind: {name: one, ...}}, by its name, "one", or by what it is if no other is:
 * "kind". */
static quern_entry *called(quern_node *list, const char *name) {
	quern_entry *found = NULL;
	size_t n = 0;
	for (size_t i = 0; i < list->n; i++) {
		quern_node *item = list->entries[i].value;
		if (item->kind != QUERN_NODE_MAP || item->n != 1) continue;
		const quern_node *own = quern_node_find(item->entries[0].value, "name");
		if (own && own->kind == QUERN_NODE_SCALAR && !strcmp(own->text, name)) return &item->entries[0];
		if (!strcmp(item->entries[0].key, name)) found = &item->entries[0], n++;
	}
	return n == 1 ? found : NULL;
}

/* One step of a path: the entry of that name or index, made if it is a map's new key. NULL: no such item. */
static quern_entry *descend(quern_node *node, const char *key, quern_mark mark) {
	if (node->kind == QUERN_NODE_LIST) {
		const quern_entry *item = quern_node_item(node, key);
		return item ? &node->entries[item - node->entries] : called(node, key);
	}
	if (node->kind == QUERN_NODE_SCALAR) { /* a plugin's bare name is opened: word -> {word: {}} */
		const bool bare = !strcmp(node->text, key);
		if (!bare && !quern_node_is_null(node)) return NULL;
		free(node->text);
		node->text = NULL;
		node->kind = QUERN_NODE_MAP;
	}
	const quern_entry *found = quern_node_entry(node, key);
	if (!found) {
		quern_node *empty = quern_take(1, sizeof *empty);
		empty->mark = mark;
		empty->text = quern_copy("");
		node->entries = quern_grow(node->entries, node->n, &node->capacity, sizeof(quern_entry));
		node->entries[node->n++] = (quern_entry) { quern_copy(key), mark, empty };
		found = &node->entries[node->n - 1];
	}
	return &node->entries[found - node->entries];
}

/* The entry at the end of a path, made where it is not there; NULL after one sentence if it cannot be reached. */
static quern_entry *reach(quern_tree *tree, const char *where, quern_mark mark, quern_report *report) {
	char *path = quern_copy(where), *rest = path, *key;
	quern_node *node = tree->root;
	quern_entry *entry = NULL;
	while ((key = strsep(&rest, "."))) {
		entry = descend(node, key, mark);
		if (!entry) {
			char say[64];
			quern_report_add(report, mark, "'%s' cannot be reached: above it stands %s%s", key,
				quern_node_say(node, say),
				node->kind == QUERN_NODE_LIST
					? " (name its items by number, from 0, by their 'name', or by what only one of them is)"
					: "");
			break;
		}
		node = entry->value;
	}
	free(path);
	return entry;
}

void quern_tree_replace(
	quern_tree *tree, const char *path, const quern_node *value, quern_mark mark, quern_report *report) {
	quern_entry *entry = tree->root ? reach(tree, path, mark, report) : NULL;
	if (!entry) return;
	quern_node *given = quern_node_copy(value);
	entry->mark = mark;
	quern_node_destroy(entry->value);
	entry->value = given;
}

quern_tree *quern_tree_copy(const quern_tree *tree) {
	quern_tree *copy = quern_take(1, sizeof *copy);
	if (tree->root) copy->root = quern_node_copy(tree->root);
	return copy;
}

void quern_tree_set(quern_tree *tree, const char *assignment, quern_report *report) {
	const char *equals = strchr(assignment, '=');
	char *option = quern_format("--set %s", assignment);
	const quern_mark mark = { .file = quern_tree_keep(tree, option) };
	free(option);
	if (!equals || equals == assignment) {
		quern_report_add(report, mark, "is not of the form path.to.key=value");
		return;
	}
	if (!tree->root) return;
	char *path = quern_format("%.*s", (int)(equals - assignment), assignment);
	quern_entry *entry = reach(tree, path, mark, report);
	free(path);
	if (!entry) return;
	quern_node *given = parse(tree, mark.file, equals + 1, strlen(equals + 1), true, report);
	if (!given && !quern_report_errors(report)) { /* an empty value is null */
		given = quern_take(1, sizeof *given);
		given->mark = mark;
		given->text = quern_copy("");
	}
	if (given) {
		entry->mark = mark;
		quern_node_destroy(entry->value);
		entry->value = given;
	}
}
