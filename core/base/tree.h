/* SPDX-License-Identifier: MIT */
/* tree - a YAML document as a tree that remembers where every key and value stood */
#pragma once
#include "report.h"
#include <stdbool.h>

typedef enum { QUERN_NODE_SCALAR, QUERN_NODE_LIST, QUERN_NODE_MAP } quern_node_kind;

typedef struct quern_node quern_node;
typedef struct quern_entry {
	char *key; /* NULL in a list */
	quern_mark mark;
	quern_node *value;
} quern_entry;

struct quern_node {
	quern_node_kind kind;
	bool
		quoted; /* a scalar in quotes is text: never null, a bare number, true or false; "5 mm" is text anyway */
	quern_mark mark;
	char *text; /* scalar */
	quern_entry *entries;
	size_t n, capacity;
};

/* A parsed document owns its nodes and the file names of its marks. */
typedef struct quern_tree {
	quern_node *root; /* NULL if the document could not be read */
	char **names;
	size_t n_names, names_capacity;
	char *source; /* the text it was read from, `length` bytes; NULL if it was not read */
	size_t length;
} quern_tree;

/* Reads a regular file; faults (syntax, duplicate keys, too deep, too many aliases, too large) go to the report. */
quern_tree *quern_tree_read(const char *path, quern_report *);
quern_tree *quern_tree_parse(const char *name, const char *data, size_t length, quern_report *);
void quern_tree_destroy(quern_tree *);
/* A copy of the text that lives as long as the tree. */
const char *quern_tree_keep(quern_tree *, const char *);

/* Applies "path.to.key=value" with value in YAML; null removes the key. Items of a list are named by their number from
 * 0, written as people do: 7, not 07 or +7, or by the one thing in them: its `name`,
 * or what it is if no other item is that. Faults are reported under the
 * option's own text. */
void quern_tree_set(quern_tree *, const char *assignment, quern_report *);
/* The same with a value that is there: a copy of it takes the place, and the mark. */
void quern_tree_replace(quern_tree *, const char *path, const quern_node *value, quern_mark, quern_report *);
/* A tree of its own, whose marks name files by texts of the old one, which must live on. */
quern_tree *quern_tree_copy(const quern_tree *);

/* The value of a key, or NULL; NULL also where the value is null. */
quern_node *quern_node_find(const quern_node *map, const char *key);
const quern_entry *quern_node_entry(const quern_node *map, const char *key);
bool quern_node_is_null(const quern_node *);
/* The item of a list that is named by its number from 0, or NULL. */
const quern_entry *quern_node_item(const quern_node *list, const char *number);
/* true, yes and on, or false, no and off, as YAML has them: in small letters, with a capital, or in capitals. False if it
 * is none of them. */
bool quern_node_bool(const quern_node *, bool *value);

/* Building and writing: a dotted name opens maps on its way. Each returns the new node, owned by its parent. */
quern_node *quern_node_create(quern_node_kind);
void quern_node_destroy(quern_node *);
quern_node *quern_node_copy(const quern_node *);
quern_node *quern_node_put(quern_node *map, const char *name, const char *text);
quern_node *quern_node_put_quoted(quern_node *map, const char *name, const char *text);
quern_node *quern_node_put_list(quern_node *map, const char *name);
quern_node *quern_node_put_map(quern_node *map, const char *name);
quern_node *quern_node_append(quern_node *list, const char *text);
quern_node *quern_node_append_map(quern_node *list);
/* Lays the entries of `over` (NULL: none) onto a map, map by map. */
void quern_node_merge(quern_node *map, const quern_node *over);
void quern_node_merge_entry(quern_node *map, const quern_entry *);
struct quern_text;
void quern_node_print(const quern_node *, int indent, struct quern_text *);

/* "a map", "a list of 3", "'text'": for messages; valid until the next call with the same buffer */
const char *quern_node_say(const quern_node *, char buffer[64]);
