/* SPDX-License-Identifier: MIT */
#include "param.h"
#include "text.h"
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

const quern_param *quern_param_find(const quern_param *rows, const char *name) {
	for (; rows && rows->name; rows++)
		if (!strcmp(rows->name, name)) return rows;
	return NULL;
}

static bool is_prefix(const char *prefix, const char *name) {
	const size_t n = strlen(prefix);
	return !strncmp(prefix, name, n) && name[n] == '.';
}

/* One part of a path: a key of a map, or the number of a list's item. */
static const quern_entry *step_into(const quern_node *node, const char *part) {
	return node->kind == QUERN_NODE_LIST ? quern_node_item(node, part) : quern_node_entry(node, part);
}

/* The entry of a dotted name, or NULL; `mark` (NULL: not wanted) becomes that of the last part that is there. */
static const quern_entry *walk(const quern_node *node, const char *name, quern_mark *mark) {
	char part[64];
	while (node) {
		const size_t n = strcspn(name, ".");
		snprintf(part, sizeof part, "%.*s", (int)n, name);
		const quern_entry *entry = step_into(node, part);
		if (!entry && !strncmp(name, "0.", 2)) { /* the one item of a list, given without brackets */
			name += 2;
			continue;
		}
		if (!entry || quern_node_is_null(entry->value)) return NULL;
		if (mark) *mark = entry->value->mark;
		if (!name[n]) return entry;
		node = entry->value;
		name += n + 1;
	}
	return NULL;
}

quern_mark quern_param_mark(const quern_node *map, const char *name, quern_mark fallback) {
	if (name) walk(map, name, &fallback);
	return fallback;
}

double quern_param_default(const quern_param *row, uint32_t dim) {
	return dim == 2 && row->flags & QUERN_PLANAR ? row->planar : row->def;
}

/* 1e12 rather than 1000000000000 */
static void short_number(double value, char out[32]) {
	char text[32];
	quern_number(value, out);
	if (!(fabs(value) >= 1e6)) return;
	snprintf(text, sizeof text, "%.3g", value);
	if (strtod(text, NULL) != value) return;
	const size_t n = strcspn(text, "+"); /* 1e+06 */
	const char *power = text + n + strspn(text + n, "+0");
	snprintf(out, 32, "%.*s%.8s", (int)n, text, power);
}

void quern_param_range(const quern_param *row, char out[96]) {
	char low[32], high[32];
	*out = 0;
	if (row->min == row->max) return;
	short_number(row->min, low);
	short_number(row->max, high);
	if (row->type == QUERN_T_INT && row->max == row->min + 1) {
		snprintf(out, 96, "%s or %s", low, high);
		return;
	}
	const bool below = row->flags & QUERN_MAX_OPEN, above = row->flags & QUERN_MIN_OPEN;
	if (isinf(row->max)) snprintf(out, 96, above ? "above %s" : "at least %s", low);
	else if (above) snprintf(out, 96, "above %s and %s %s", low, below ? "below" : "at most", high);
	else if (below) snprintf(out, 96, "at least %s and below %s", low, high);
	else snprintf(out, 96, "between %s and %s", low, high);
}

static bool in_range(const quern_param *row, double x) {
	if (row->min == row->max) return true;
	if (row->flags & QUERN_MIN_OPEN ? x <= row->min : x < row->min) return false;
	return row->flags & QUERN_MAX_OPEN ? x < row->max : x <= row->max;
}

double quern_param_number(const quern_param *row, const void *instance) {
	const char *at = (const char *)instance + row->offset;
	switch (row->type) {
	case QUERN_T_REAL: return *(const quern_real *)(const void *)at;
	case QUERN_T_INT: return *(const int32_t *)(const void *)at;
	case QUERN_T_BOOL: return *(const bool *)(const void *)at;
	case QUERN_T_LIST: return ((const quern_list *)(const void *)at)->n;
	default: return NAN;
	}
}

/* ---- reading ---- */

static void unknown_key(const quern_reading *r, const char *owner, const quern_param *rows,
	const char *prefix, const quern_entry *e, const char *const *also) {
	const char **known = NULL;
	size_t n = 0, capacity = 0;
	const size_t skip = *prefix ? strlen(prefix) + 1 : 0;
	char **parts = NULL;
	size_t n_parts = 0, parts_capacity = 0;
	for (const quern_param *row = rows; row && row->name; row++)
		if (!*prefix || is_prefix(prefix, row->name)) {
			char *part = quern_copy(row->name + skip);
			part[strcspn(part, ".")] = 0;
			parts = quern_grow(parts, n_parts, &parts_capacity, sizeof(char *));
			parts[n_parts++] = part;
			known = quern_grow(known, n + 1, &capacity, sizeof(char *));
			known[n++] = part;
		}
	for (const char *const *a = also; a && *a; a++) {
		if (*prefix ? !is_prefix(prefix, *a) : strchr(*a, '.') != NULL) continue;
		known = quern_grow(known, n + 1, &capacity, sizeof(char *));
		known[n++] = *a + skip;
	}
	quern_text list = { 0 };
	for (size_t i = 0; i < n; i++) {
		bool twice = false;
		for (size_t k = 0; k < i && !twice; k++) twice = !strcmp(known[k], known[i]);
		if (!twice) quern_text_add(&list, "%s%s", list.length ? ", " : "", known[i]);
	}
	known = quern_grow(known, n, &capacity, sizeof(char *));
	known[n] = NULL;
	const char *near = quern_nearest(e->key, known);
	if (near)
		quern_report_add(r->report, e->mark, "%s: unknown key '%s'; did you mean '%s'?", owner, e->key, near);
	else if (n)
		quern_report_add(r->report, e->mark, "%s: unknown key '%s'; it takes: %s", owner, e->key,
			quern_text_string(&list));
	else quern_report_add(r->report, e->mark, "%s: unknown key '%s'; it takes no keys", owner, e->key);
	quern_text_finish(&list);
	for (size_t i = 0; i < n_parts; i++) free(parts[i]);
	free(parts);
	free(known);
}

static bool in_list(const char *const *list, const char *name) {
	for (; list && *list; list++)
		if (!strcmp(*list, name)) return true;
	return false;
}

/* Refuses keys that no row knows; descends into maps that dotted rows open. */
static void check_keys(const quern_reading *r, const char *owner, const quern_param *rows,
	const quern_node *map, const char *prefix, const char *const *also) {
	for (size_t i = 0; i < map->n; i++) {
		const quern_entry *e = &map->entries[i];
		char *full = *prefix ? quern_format("%s.%s", prefix, e->key) : quern_copy(e->key);
		bool opens = false;
		for (const quern_param *row = rows; row && row->name; row++)
			opens = opens || is_prefix(full, row->name);
		if (!in_list(also, full)) {
			const bool row = quern_param_find(rows, full) != NULL;
			char say[64];
			if (opens && (e->value->kind == QUERN_NODE_MAP || !row)) {
				if (e->value->kind == QUERN_NODE_MAP) check_keys(r, owner, rows, e->value, full, also);
				else if (!quern_node_is_null(e->value))
					quern_report_add(r->report, e->value->mark, "%s: '%s' must be a map, not %s", owner, full,
						quern_node_say(e->value, say));
			} else if (!row) unknown_key(r, owner, rows, prefix, e, also);
		}
		free(full);
	}
}

void quern_params_check(const quern_reading *r, const char *owner, const quern_param *rows,
	const quern_node *map, const char *const *also) {
	check_keys(r, owner, rows, map, "", also);
}

/* What stands in quotes is text; only a quantity with its unit is text all the same. */
static bool is_quoted_number(const quern_node *node) {
	char *end;
	if (!node->quoted || !*node->text) return false;
	strtod(node->text, &end);
	return end != node->text && !end[strspn(end, " \t")];
}

static bool read_number(const quern_reading *r, const char *owner, const quern_param *row,
	const quern_node *node, double *value) {
	char why[160], range[96], say[64];
	if (node->kind != QUERN_NODE_SCALAR) {
		quern_report_add(r->report, node->mark, "%s: %s must be one number, not %s", owner, row->name,
			quern_node_say(node, say));
		return false;
	}
	if (!quern_quantity_read(r->units, node->text, row->unit ? row->unit : "1", value, why)) {
		quern_report_add(r->report, node->mark, "%s: %s: %s", owner, row->name, why);
		return false;
	}
	if (is_quoted_number(node)) {
		quern_report_add(r->report, node->mark, "%s: %s: \"%s\" in quotes is a text, not a number", owner,
			row->name, node->text);
		return false;
	}
	if (in_range(row, *value)) return true;
	quern_param_range(row, range);
	const bool scaled = row->unit && strcmp(row->unit, "1") != 0;
	quern_report_add(r->report, node->mark, "%s: %s is %s, must be %s%s%s", owner, row->name, node->text,
		range, scaled ? " " : "", scaled ? row->unit : "");
	return false;
}

/* The names that somebody has published as "SET.NAME", NULL-terminated. */
static const char **names_of(const quern_reading *r, const char *set, size_t *n) {
	const char **names = NULL;
	size_t capacity = 0;
	*n = 0;
	for (size_t i = 0; i < r->n_published; i++)
		if (is_prefix(set, r->published[i].name)) {
			names = quern_grow(names, *n + 1, &capacity, sizeof *names);
			names[(*n)++] = r->published[i].name + strlen(set) + 1;
		}
	names = quern_grow(names, *n, &capacity, sizeof *names);
	names[*n] = NULL;
	return names;
}

static void refuse_name(
	const quern_reading *r, const char *owner, const quern_param *row, const quern_node *node) {
	size_t n;
	const char **names = names_of(r, row->text, &n);
	const char *near = quern_nearest(node->text, names);
	quern_text cure = { 0 };
	if (near) quern_text_add(&cure, "did you mean '%s'?", near);
	else if (!n) quern_text_add(&cure, "give one this name, or its number here");
	for (size_t i = 0; i < n && !near; i++)
		quern_text_add(&cure, "%s%s", i ? ", " : "these have a name: ", names[i]);
	/* where there was a fault before, whoever has that name may have stopped at it */
	(quern_report_errors(r->report) ? quern_report_follow : quern_report_add)(r->report, node->mark,
		"%s: %s: no %s is called '%s'; %s", owner, row->name, row->text, node->text,
		quern_text_string(&cure));
	quern_text_finish(&cure);
	free(names);
}

/* A word in the place of a number: what somebody has published under it. False if there is no word. */
static bool read_name(const quern_reading *r, const char *owner, const quern_param *row,
	const quern_node *node, int32_t *member) {
	if (!row->text || node->kind != QUERN_NODE_SCALAR || !quern_is_name(node->text)) return false;
	for (size_t i = 0; i < r->n_published; i++) {
		const quern_published *p = &r->published[i];
		if (!is_prefix(row->text, p->name) || strcmp(p->name + strlen(row->text) + 1, node->text) != 0)
			continue;
		*member = (int32_t)p->value;
		return true;
	}
	refuse_name(r, owner, row, node);
	return true;
}

static void read_int(const quern_reading *r, const char *owner, const quern_param *row,
	const quern_node *node, int32_t *member) {
	double value;
	if (read_name(r, owner, row, node, member)) return;
	if (row->choices) {
		int32_t k = 0;
		char say[64];
		if (node->kind == QUERN_NODE_SCALAR)
			for (const char *const *c = row->choices; *c; c++, k++)
				if (!strcmp(*c, node->text)) {
					*member = k;
					return;
				}
		quern_text list = { 0 };
		for (const char *const *c = row->choices; *c; c++)
			quern_text_add(&list, "%s%s", list.length ? ", " : "", *c);
		const char *near = node->kind == QUERN_NODE_SCALAR ? quern_nearest(node->text, row->choices) : NULL;
		quern_report_add(r->report, node->mark, "%s: %s is %s, must be one of: %s%s%s%s", owner, row->name,
			quern_node_say(node, say), quern_text_string(&list), near ? "; did you mean '" : "",
			near ? near : "", near ? "'?" : "");
		quern_text_finish(&list);
		return;
	}
	if (!read_number(r, owner, row, node, &value)) return;
	if (value != trunc(value) || fabs(value) > INT32_MAX)
		quern_report_add(
			r->report, node->mark, "%s: %s is %s, must be a whole number", owner, row->name, node->text);
	else *member = (int32_t)value;
}

static void read_bool(
	const quern_reading *r, const char *owner, const quern_param *row, const quern_node *node, bool *member) {
	char say[64];
	if (!quern_node_bool(node, member))
		quern_report_add(r->report, node->mark, "%s: %s is %s, must be true or false", owner, row->name,
			quern_node_say(node, say));
}

static void read_vector(const quern_reading *r, const char *owner, const quern_param *row,
	const quern_node *node, quern_real *member) {
	char say[64];
	if (node->kind != QUERN_NODE_LIST || node->n != r->dim) {
		quern_report_add(r->report, node->mark,
			"%s: %s must be a list of %u numbers, one per dimension, not %s", owner, row->name, r->dim,
			quern_node_say(node, say));
		return;
	}
	for (uint32_t k = 0; k < r->dim; k++) read_number(r, owner, row, node->entries[k].value, &member[k]);
	for (uint32_t k = r->dim; k < 3; k++) member[k] = 0;
}

/* A file is named from the scene's folder, so that a scene works from wherever it is run. */
char *quern_param_path(const quern_node *node) {
	const char *scene = node->mark.file, *slash = scene ? strrchr(scene, '/') : NULL;
	const bool relative = node->text[0] != '/' && slash && node->mark.line;
	return relative ? quern_format("%.*s/%s", (int)(slash - scene), scene, node->text)
					: quern_copy(node->text);
}

static const char *read_text(
	const quern_reading *r, const char *owner, const quern_param *row, const quern_node *node) {
	if (!(row->flags & QUERN_FILE) || !r->tree) return node->text;
	char *path = quern_param_path(node);
	struct stat is;
	if (access(path, R_OK) || stat(path, &is))
		quern_report_add(
			r->report, node->mark, "%s: %s: cannot read '%s': %s", owner, row->name, path, strerror(errno));
	else if (!S_ISREG(is.st_mode))
		quern_report_add(r->report, node->mark, "%s: %s: '%s' is %s; a file is wanted", owner, row->name,
			path, S_ISDIR(is.st_mode) ? "a folder" : "no regular file");
	const char *kept = quern_tree_keep(r->tree, path);
	free(path);
	return kept;
}

const quern_param *quern_param_bare(const quern_param *list) {
	const quern_param *only = NULL;
	for (const quern_param *row = list->rows; row && row->name; row++) {
		if (list->text && !strcmp(row->name, list->text)) continue;
		if (only) return NULL;
		only = row;
	}
	return only && only->type != QUERN_T_LIST ? only : NULL;
}

static quern_entry entry_of(const char *key, const quern_node *value, quern_mark mark) {
	return (
		quern_entry) { .key = (char *)(uintptr_t)key, .value = (quern_node *)(uintptr_t)value, .mark = mark };
}

static void read_item(const quern_reading *r, const char *owner, const quern_param *list,
	const quern_node *item, const char *const *also, void *instance) {
	const quern_param *bare = quern_param_bare(list);
	if (bare && item->kind != QUERN_NODE_MAP) {
		quern_entry one = entry_of(bare->name, item, item->mark);
		const quern_node map = { .kind = QUERN_NODE_MAP, .mark = item->mark, .entries = &one, .n = 1 };
		quern_params_read(r, owner, list->rows, &map, item->mark, also, instance);
	} else quern_params_read(r, owner, list->rows, item, item->mark, also, instance);
}

/* An item whose name is its key in a map: as if the name stood in it. */
static void read_named(const quern_reading *r, const char *owner, const quern_param *list,
	const quern_entry *named, const char *const *also, void *instance) {
	const quern_node *value = named->value;
	const quern_param *bare = quern_param_bare(list);
	const bool map = value->kind == QUERN_NODE_MAP, alone = !map && bare && !quern_node_is_null(value);
	char say[64];
	if (!map && !alone && !quern_node_is_null(value)) {
		quern_report_add(r->report, value->mark, "%s: '%s' must be a map, not %s", owner, named->key,
			quern_node_say(value, say));
		return;
	}
	const quern_node name = {
		.kind = QUERN_NODE_SCALAR, .quoted = true, .mark = named->mark, .text = named->key
	};
	quern_entry *entries = quern_take(value->n + 2, sizeof *entries);
	quern_node item = { .kind = QUERN_NODE_MAP, .mark = named->mark, .entries = entries };
	entries[item.n++] = entry_of(list->text, &name, named->mark);
	if (alone) entries[item.n++] = entry_of(bare->name, value, value->mark);
	for (size_t i = 0; map && i < value->n; i++) {
		if (!strcmp(value->entries[i].key, list->text))
			quern_report_add(r->report, value->entries[i].mark, "%s: '%s' has its %s already: its key", owner,
				named->key, list->text);
		else entries[item.n++] = value->entries[i];
	}
	quern_params_read(r, owner, list->rows, &item, named->mark, also, instance);
	free(entries);
}

static void check_length(
	const quern_reading *r, const char *owner, const quern_param *row, const quern_node *node, uint32_t n) {
	char range[96];
	if (!node || in_range(row, n)) return;
	quern_param_range(row, range);
	quern_report_add(r->report, node->mark, "%s: %s has %u item%s, must have %s", owner, row->name, n,
		n == 1 ? "" : "s", range);
}

static void read_list(const quern_reading *r, const char *owner, const quern_param *row,
	const quern_node *node, const char *const *also, quern_list *list) {
	const bool named = node && row->text && node->kind == QUERN_NODE_MAP;
	const bool many = node && (named || node->kind == QUERN_NODE_LIST);
	const char **inner = NULL;
	size_t k = 0, capacity = 0;
	for (const char *const *a = also; a && *a; a++)
		if (is_prefix(row->name, *a)) {
			inner = quern_grow(inner, k + 1, &capacity, sizeof *inner);
			inner[k++] = *a + strlen(row->name) + 1;
		}
	inner = quern_grow(inner, k, &capacity, sizeof *inner);
	inner[k] = NULL;
	char *name = quern_format("%s.%s", owner, row->name);
	list->n = !node ? 0 : many ? (uint32_t)node->n : 1;
	list->item_size = row->item_size;
	list->items = quern_take(list->n, row->item_size);
	check_length(r, owner, row, node, list->n);
	for (uint32_t i = 0; i < list->n; i++) {
		void *item = (char *)list->items + (size_t)i * row->item_size;
		if (named) read_named(r, name, row, &node->entries[i], inner, item);
		else read_item(r, name, row, many ? node->entries[i].value : node, inner, item);
	}
	free(inner);
	free(name);
}

/* A number that must be given is NaN until it is. */
static void set_default(const quern_reading *r, const quern_param *row, void *member) {
	const bool number = row->type == QUERN_T_REAL || row->type == QUERN_T_VECTOR;
	const bool required = number && row->flags & QUERN_REQUIRED;
	const double def = required ? NAN : quern_param_default(row, r->dim);
	const bool maybe = row->flags & QUERN_MAYBE;
	switch (row->type) {
	case QUERN_T_REAL: *(quern_real *)member = maybe ? NAN : def; break;
	case QUERN_T_INT: *(int32_t *)member = maybe ? INT32_MIN : (int32_t)def; break;
	case QUERN_T_BOOL: *(bool *)member = def != 0; break;
	case QUERN_T_TEXT: *(const char **)member = row->text; break;
	case QUERN_T_VECTOR:
		for (uint32_t k = 0; k < 3; k++) ((quern_real *)member)[k] = maybe ? NAN : k < r->dim ? def : 0;
		break;
	default: break;
	}
}

static bool is_a_part(const quern_param *rows, const char *key, const char *const *also) {
	const size_t n = strlen(key);
	for (; rows && rows->name; rows++)
		for (const char *part = rows->name; part; part = strchr(part, '.') ? strchr(part, '.') + 1 : NULL)
			if (!strncmp(part, key, n) && (!part[n] || part[n] == '.')) return true;
	return in_list(also, key);
}

/* What is missing may have been found already: on the way to it stands something else than a map, or in its place a
 * misspelt name. */
static bool is_known_fault(
	const quern_param *rows, const quern_node *map, const char *name, const char *const *also) {
	char part[64], above[64] = "";
	const char *rest = name;
	for (;;) {
		const size_t n = strcspn(rest, ".");
		snprintf(part, sizeof part, "%.*s", (int)n, rest);
		if (quern_node_is_null(map)) return false;
		if (map->kind != QUERN_NODE_MAP) return !quern_param_find(rows, above);
		if (!rest[n]) break;
		rest += n + 1;
		snprintf(above, sizeof above, "%.*s", (int)(rest - 1 - name), name);
		const quern_entry *entry = quern_node_entry(map, part);
		if (!entry) break;
		map = entry->value;
	}
	for (size_t i = 0; i < map->n; i++)
		if (!is_a_part(rows, map->entries[i].key, also) &&
			quern_nearest(map->entries[i].key, (const char *const[]) { part, NULL }))
			return true;
	return false;
}

static void missing(const quern_reading *r, const char *owner, const quern_param *row, quern_mark mark) {
	const char *doc = row->doc ? row->doc : "";
	const size_t n = strlen(doc);
	const bool stop = n && doc[n - 1] == '.', unit = row->unit && strcmp(row->unit, "1") != 0;
	/* whoever would give it may have stopped at a fault of its own */
	(row->from ? quern_report_follow : quern_report_add)(r->report, mark,
		"%s: '%s' is missing: %.*s%s%s%s%s%s", owner, row->name, (int)(n - stop), doc, unit ? " [" : "",
		unit ? row->unit : "", unit ? "]" : "", row->from ? "; nothing in this scene gives " : "",
		row->from ? row->from : "");
}

/* The value of a row that the scene leaves out; false if it must not be. */
static bool left_out(const quern_reading *r, const quern_param *row, void *member) {
	set_default(r, row, member);
	if (row->from && row->type == QUERN_T_REAL) {
		for (size_t i = 0; i < r->n_published; i++)
			if (!strcmp(r->published[i].name, row->from)) {
				*(quern_real *)member = r->published[i].value;
				return true;
			}
	}
	const bool nowhere = row->from && !(row->flags & QUERN_MAYBE) && quern_param_default(row, r->dim) == 0;
	return !(row->flags & QUERN_REQUIRED) && !nowhere;
}

/* Whether the key that a row must not stand beside is given; an empty list is none. */
static bool is_excluded(const quern_node *map, const quern_param *row) {
	const quern_entry *other = row->unless ? walk(map, row->unless, NULL) : NULL;
	return other && (other->value->kind == QUERN_NODE_SCALAR || other->value->n);
}

static void refuse_both(
	const quern_reading *r, const char *owner, const quern_param *row, const quern_node *node) {
	quern_report_add(
		r->report, node->mark, "%s: %s does not go with %s: give one of them", owner, row->name, row->unless);
}

void quern_params_read(const quern_reading *r, const char *owner, const quern_param *rows,
	const quern_node *map, quern_mark mark, const char *const *also, void *instance) {
	char say[64];
	const quern_node *given = map;
	if (map && !quern_node_is_null(map)) {
		if (map->kind == QUERN_NODE_MAP) check_keys(r, owner, rows, map, "", also);
		else {
			quern_report_add(r->report, map->mark, "%s takes a map of parameters, not %s", owner,
				quern_node_say(map, say));
			map = NULL;
		}
	}
	for (const quern_param *row = rows; row && row->name; row++) {
		void *member = (char *)instance + row->offset;
		const quern_entry *entry = walk(map, row->name, NULL);
		const quern_node *node = entry ? entry->value : NULL;
		bool opens = false; /* "law" beside "law.key": a map is for the others */
		for (const quern_param *other = rows; other->name; other++)
			opens = opens || is_prefix(row->name, other->name);
		if (node && opens && node->kind == QUERN_NODE_MAP) node = NULL;
		const bool excluded = is_excluded(map, row);
		if (node && excluded) refuse_both(r, owner, row, node);
		if (!node && !left_out(r, row, member) && !excluded && !is_known_fault(rows, given, row->name, also))
			missing(r, owner, row, mark);
		if (row->type == QUERN_T_LIST) {
			read_list(r, owner, row, node, also, member);
			continue;
		}
		if (!node) continue;
		set_default(r, row, member); /* so that a faulty value leaves something sane behind */
		switch (row->type) {
		case QUERN_T_REAL: read_number(r, owner, row, node, member); break;
		case QUERN_T_INT: read_int(r, owner, row, node, member); break;
		case QUERN_T_BOOL: read_bool(r, owner, row, node, member); break;
		case QUERN_T_VECTOR: read_vector(r, owner, row, node, member); break;
		case QUERN_T_TEXT:
			if (node->kind == QUERN_NODE_SCALAR) *(const char **)member = read_text(r, owner, row, node);
			else
				quern_report_add(r->report, node->mark, "%s: %s must be a text, not %s", owner, row->name,
					quern_node_say(node, say));
			break;
		default: break;
		}
	}
}

void quern_params_finish(const quern_param *rows, void *instance) {
	for (; rows && rows->name; rows++)
		if (rows->type == QUERN_T_LIST) {
			quern_list *list = (quern_list *)(void *)((char *)instance + rows->offset);
			for (uint32_t i = 0; i < list->n; i++)
				quern_params_finish(rows->rows, (char *)list->items + (size_t)i * list->item_size);
			free(list->items);
			*list = (quern_list) { 0 };
		}
}
