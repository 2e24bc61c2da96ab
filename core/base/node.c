/* SPDX-License-Identifier: MIT */
/* nodes of a tree - built, merged and printed */
#include "text.h"
#include "tree.h"
#include <stdlib.h>
#include <string.h>

quern_node *quern_node_create(quern_node_kind kind) {
	quern_node *node = quern_take(1, sizeof *node);
	node->kind = kind;
	return node;
}

static quern_node *attach(quern_node *parent, const char *key, quern_node *child) {
	parent->entries = quern_grow(parent->entries, parent->n, &parent->capacity, sizeof(quern_entry));
	parent->entries[parent->n++] = (quern_entry) { .key = key ? quern_copy(key) : NULL, .value = child };
	return child;
}

static quern_node *put(quern_node *map, const char *name, quern_node *child) {
	char part[64];
	for (;;) {
		const size_t n = strcspn(name, ".");
		snprintf(part, sizeof part, "%.*s", (int)n, name);
		if (!name[n]) return attach(map, part, child);
		const quern_entry *entry = quern_node_entry(map, part);
		if (entry && entry->value->kind != QUERN_NODE_MAP) { /* a choice gives way to the map beside it */
			quern_node *value = entry->value;
			free(value->text);
			value->text = NULL;
			value->kind = QUERN_NODE_MAP;
		}
		map = entry ? entry->value : attach(map, part, quern_node_create(QUERN_NODE_MAP));
		name += n + 1;
	}
}

quern_node *quern_node_put(quern_node *map, const char *name, const char *text) {
	quern_node *node = quern_node_create(QUERN_NODE_SCALAR);
	node->text = quern_copy(text);
	return put(map, name, node);
}

quern_node *quern_node_put_quoted(quern_node *map, const char *name, const char *text) {
	quern_node *node = quern_node_put(map, name, text);
	node->quoted = true;
	return node;
}

quern_node *quern_node_put_list(quern_node *map, const char *name) {
	return put(map, name, quern_node_create(QUERN_NODE_LIST));
}

quern_node *quern_node_put_map(quern_node *map, const char *name) {
	return put(map, name, quern_node_create(QUERN_NODE_MAP));
}

quern_node *quern_node_append(quern_node *list, const char *text) {
	quern_node *node = quern_node_create(QUERN_NODE_SCALAR);
	node->text = quern_copy(text);
	return attach(list, NULL, node);
}

quern_node *quern_node_append_map(quern_node *list) {
	return attach(list, NULL, quern_node_create(QUERN_NODE_MAP));
}

quern_node *quern_node_copy(const quern_node *old) {
	quern_node *node = quern_node_create(old->kind);
	node->quoted = old->quoted;
	node->mark = old->mark;
	if (old->text) node->text = quern_copy(old->text);
	for (size_t i = 0; i < old->n; i++) {
		attach(node, old->entries[i].key, quern_node_copy(old->entries[i].value));
		node->entries[i].mark = old->entries[i].mark;
	}
	return node;
}

void quern_node_merge_entry(quern_node *map, const quern_entry *entry) {
	const quern_entry *found = quern_node_entry(map, entry->key);
	if (found && found->value->kind == QUERN_NODE_MAP && entry->value->kind == QUERN_NODE_MAP) {
		quern_node_merge(found->value, entry->value);
	} else if (found) {
		quern_entry *mine = &map->entries[found - map->entries];
		quern_node_destroy(mine->value);
		mine->value = quern_node_copy(entry->value);
		mine->mark = entry->mark;
	} else {
		attach(map, entry->key, quern_node_copy(entry->value));
		map->entries[map->n - 1].mark = entry->mark;
	}
}

void quern_node_merge(quern_node *map, const quern_node *over) {
	for (size_t i = 0; over && over->kind == QUERN_NODE_MAP && i < over->n; i++)
		quern_node_merge_entry(map, &over->entries[i]);
}

/* One character of UTF-8, and how many bytes it has. */
static int character_at(const char *text, unsigned *code) {
	const unsigned char *c = (const unsigned char *)text;
	const int n = *c < 0xc0 ? 1 : *c < 0xe0 ? 2 : *c < 0xf0 ? 3 : 4;
	*code = n == 1 ? *c : *c & (0xffu >> (n + 1));
	for (int i = 1; i < n; i++) {
		if ((c[i] & 0xc0u) != 0x80u) return 1;
		*code = *code << 6 | (c[i] & 0x3fu);
	}
	return n;
}

/* Control characters, line separators and the like do not come back as they are. */
static bool must_be_escaped(unsigned code) {
	return code < 32 || (code >= 0x7f && code < 0xa0) || code == 0x2028 || code == 0x2029 || code == 0xfeff ||
		   code == 0xfffe || code == 0xffff;
}

static void print_scalar(const quern_node *node, quern_text *out) {
	/* a plain text may have stood where a comma or a bracket means nothing */
	if (!node->quoted && !node->text[strcspn(node->text, ",[]{}#:\n\"'")]) {
		quern_text_add(out, "%s", node->text);
		return;
	}
	quern_text_add(out, "\"");
	unsigned code;
	for (const char *c = node->text; *c; c += character_at(c, &code)) {
		const int n = character_at(c, &code);
		if (*c == '"' || *c == '\\') quern_text_add(out, "\\%c", *c);
		else if (must_be_escaped(code)) quern_text_add(out, "\\u%04x", code);
		else quern_text_add(out, "%.*s", n, c);
	}
	quern_text_add(out, "\"");
}

static bool is_flat(const quern_node *node) {
	for (size_t i = 0; i < node->n; i++)
		if (node->entries[i].value->kind != QUERN_NODE_SCALAR) return false;
	return node->kind == QUERN_NODE_LIST;
}

void quern_node_print(const quern_node *node, int indent, quern_text *out) {
	if (node->kind == QUERN_NODE_SCALAR) {
		print_scalar(node, out);
		return;
	}
	if (!node->n || is_flat(node)) {
		quern_text_add(out, node->kind == QUERN_NODE_LIST ? "[" : "{");
		for (size_t i = 0; i < node->n; i++) {
			if (i) quern_text_add(out, ", ");
			print_scalar(node->entries[i].value, out);
		}
		quern_text_add(out, node->kind == QUERN_NODE_LIST ? "]" : "}");
		return;
	}
	for (size_t i = 0; i < node->n; i++) {
		const quern_node *child = node->entries[i].value;
		if (i || out->length) quern_text_add(out, "\n%*s", 2 * indent, "");
		if (node->kind == QUERN_NODE_LIST) quern_text_add(out, "-");
		else quern_text_add(out, "%s:", node->entries[i].key);
		if (child->kind == QUERN_NODE_SCALAR || !child->n || is_flat(child)) quern_text_add(out, " ");
		quern_node_print(child, indent + 1, out);
	}
}
