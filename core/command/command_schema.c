/* SPDX-License-Identifier: MIT */
/* quern schema - a JSON Schema of scenes from the rows of all installed plugins, for completion in editors */
#include "command.h"
#include "h5.h"
#include "options.h"
#include "scene.h"
#include "sections.h"
#include "text.h"
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
	quern_loader *loader;
	quern_report *report;
	char **ids;
} context;

/* ---- objects ---- */

static json_t *object_schema(void) {
	return json_pack("{s:s, s:{}, s:b}", "type", "object", "properties", "additionalProperties", false);
}

static void require(json_t *object, const char *name) {
	json_t *list = json_object_get(object, "required"), *one;
	size_t i;
	if (!list) json_object_set_new(object, "required", list = json_array());
	json_array_foreach(list, i, one) if (!strcmp(json_string_value(one), name)) return;
	json_array_append_new(list, json_string(name));
}

/* The map that stands under a name, made if there is none; beside it may stand a word: "law", "law.key". */
static json_t *map_in(json_t *object, const char *name) {
	json_t *properties = json_object_get(object, "properties"), *there = json_object_get(properties, name),
		   *one;
	json_t *either = json_object_get(there, "anyOf");
	size_t i;
	if (json_object_get(there, "properties")) return there;
	json_array_foreach(either, i, one) if (json_object_get(one, "properties")) return one;
	json_t *map = object_schema();
	json_object_set_new(properties, name, there ? json_pack("{s:[O, o]}", "anyOf", there, map) : map);
	return map;
}

/* Puts a value under a dotted name, whose maps are opened on the way. */
static void put(json_t *object, const char *name, json_t *value, bool required) {
	const size_t n = strcspn(name, ".");
	char part[64];
	snprintf(part, sizeof part, "%.*s", (int)n, name);
	if (required) require(object, part);
	if (name[n]) {
		put(map_in(object, part), name + n + 1, value, required);
		return;
	}
	json_t *properties = json_object_get(object, "properties"), *there = json_object_get(properties, part);
	if (there) value = json_pack("{s:[o, O]}", "anyOf", value, there);
	json_object_set_new(properties, part, value);
}

/* ---- values ---- */

static json_t *defined(const char *name) {
	char *path = quern_format("#/definitions/%s", name);
	json_t *reference = json_pack("{s:s}", "$ref", path);
	free(path);
	return reference;
}

/* A bare number within its range, or a number with a unit, of which the editor only sees the form. */
static json_t *number_schema(const quern_param *row) {
	const char *type = row->type == QUERN_T_INT ? "integer" : "number";
	json_t *bare = json_pack("{s:s}", "type", type);
	const char *low = row->flags & QUERN_MIN_OPEN ? "exclusiveMinimum" : "minimum";
	const char *high = row->flags & QUERN_MAX_OPEN ? "exclusiveMaximum" : "maximum";
	if (row->min != row->max && isfinite(row->min)) json_object_set_new(bare, low, json_real(row->min));
	if (row->min != row->max && isfinite(row->max)) json_object_set_new(bare, high, json_real(row->max));
	return json_pack("{s:[o, o]}", "anyOf", bare, defined("quantity"));
}

static json_t *text_schema(const quern_param *row) {
	if (!row->unit || !strcmp(row->unit, "1")) return json_pack("{s:[s, s]}", "type", "string", "number");
	json_t *either =
		json_pack("[{s:s}, o]", "type", "number", defined("quantity")); /* or a word, such as auto */
	if (row->text) json_array_append_new(either, json_pack("{s:s}", "const", row->text));
	return json_pack("{s:o}", "anyOf", either);
}

static json_t *map_schema(const quern_param *rows);
static json_t *value_schema(const quern_param *row);
static json_t *row_schema(const quern_param *row);

/* A list whose items have names may be a map of them, too. */
static json_t *named_schema(const quern_param *row) {
	const quern_param *bare = quern_param_bare(row);
	json_t *item = object_schema();
	for (const quern_param *r = row->rows; r->name; r++)
		if (strcmp(r->name, row->text) != 0) put(item, r->name, row_schema(r), r->flags & QUERN_REQUIRED);
	if (bare) item = json_pack("{s:[o, o]}", "anyOf", item, value_schema(bare));
	return json_pack("{s:[{s:s, s:o}, {s:s, s:o}]}", "anyOf", "type", "object", "additionalProperties", item,
		"type", "array", "items", map_schema(row->rows));
}

static json_t *list_schema(const quern_param *row) {
	const quern_param *bare = quern_param_bare(row);
	if (row->text) return named_schema(row);
	json_t *item = map_schema(row->rows);
	if (bare) item = json_pack("{s:[o, o]}", "anyOf", item, value_schema(bare)); /* or the value alone */
	json_t *list = json_pack("{s:s, s:O}", "type", "array", "items", item);
	if (row->min != row->max && isfinite(row->max)) {
		json_object_set_new(list, "minItems", json_integer((json_int_t)row->min));
		json_object_set_new(list, "maxItems", json_integer((json_int_t)row->max));
	}
	if (row->min == row->max || row->min <= 1) return json_pack("{s:[o, o]}", "anyOf", item, list);
	json_decref(item);
	return list;
}

static json_t *words_schema(const quern_param *row) {
	json_t *words = json_array();
	for (const char *const *c = row->choices; *c; c++) json_array_append_new(words, json_string(*c));
	return json_pack("{s:o}", "enum", words);
}

static json_t *value_schema(const quern_param *row) {
	switch (row->type) {
	case QUERN_T_INT:
		if (row->text) return json_pack("{s:[o, {s:s}]}", "anyOf", number_schema(row), "type", "string");
		return row->choices ? words_schema(row) : number_schema(row);
	case QUERN_T_BOOL: return defined("switch");
	case QUERN_T_TEXT: return text_schema(row);
	case QUERN_T_VECTOR:
		return json_pack("{s:s, s:o, s:i, s:i}", "type", "array", "items", number_schema(row), "minItems", 2,
			"maxItems", 3);
	case QUERN_T_LIST: return list_schema(row);
	default: return number_schema(row);
	}
}

static json_t *default_of(const quern_param *row) {
	const bool planar = row->flags & QUERN_PLANAR && row->planar != row->def;
	if (row->flags & (QUERN_REQUIRED | QUERN_MAYBE) || row->from || planar) return NULL;
	switch (row->type) {
	case QUERN_T_INT:
		return row->choices ? json_string(row->choices[(int)row->def]) : json_integer((json_int_t)row->def);
	case QUERN_T_REAL: return isfinite(row->def) ? json_real(row->def) : NULL;
	case QUERN_T_BOOL: return json_boolean(row->def != 0);
	case QUERN_T_TEXT: return row->text ? json_string(row->text) : NULL;
	default: return NULL;
	}
}

static json_t *row_schema(const quern_param *row) {
	json_t *s = value_schema(row), *def = default_of(row);
	const bool unit = row->unit && strcmp(row->unit, "1") != 0;
	char *doc =
		quern_format("%s%s%s%s%s%s%s", row->doc ? row->doc : "", unit ? " [" : "", unit ? row->unit : "",
			unit ? "]" : "", row->from ? " Default: " : "", row->from ? row->from : "", row->from ? "." : "");
	if (json_object_get(s, "$ref")) s = json_pack("{s:[o]}", "allOf", s); /* a reference has no neighbours */
	json_object_set_new(s, "description", json_string(doc));
	if (def) json_object_set_new(s, "default", def);
	free(doc);
	return s;
}

static void put_rows(json_t *object, const quern_param *rows) {
	for (; rows && rows->name; rows++)
		put(object, rows->name, row_schema(rows),
			rows->flags & QUERN_REQUIRED && !rows->from && !rows->unless);
}

static void require_all(json_t *object, const char *name) {
	const size_t n = strcspn(name, ".");
	char part[64];
	snprintf(part, sizeof part, "%.*s", (int)n, name);
	require(object, part);
	if (name[n]) require_all(map_in(object, part), name + n + 1);
}

static void append_once(json_t *list, json_t *value) {
	json_t *one;
	size_t i;
	json_array_foreach(list, i, one) if (json_equal(one, value)) return;
	json_array_append(list, value);
}

/* Of a key that is required unless there is another, and that other one, one must be given; so of each such pair. */
static void require_either(json_t *object, const quern_param *row) {
	const size_t n = strcspn(row->name, ".");
	char part[64];
	snprintf(part, sizeof part, "%.*s", (int)n, row->name);
	json_t *all = json_object_get(object, "allOf");
	if (!all) json_object_set_new(object, "allOf", all = json_array());
	json_t *either = json_pack("{s:[{s:[s]}, {s:[s]}]}", "anyOf", "required", part, "required", row->unless);
	append_once(all, either);
	json_decref(either);
	if (row->name[n]) require_all(map_in(object, part), row->name + n + 1);
}

static json_t *map_schema(const quern_param *rows) {
	json_t *object = object_schema();
	put_rows(object, rows);
	return object;
}

/* ---- plugins ---- */

static json_t *plugin_schema(const quern_plugin_file *f, const quern_slot *slot) {
	json_t *own = map_schema(f->params);
	if (slot) put_rows(own, slot->rows);
	if (slot && slot->override)
		put(own, strchr(slot->override, '.') + 1, json_pack("{s:s}", "type", "object"), false);
	json_object_set_new(own, "description", json_string(f->plugin.brief ? f->plugin.brief : ""));
	return own;
}

/* A plugin in a slot: its bare name, if nothing of it must be given, or one name with parameters. */
static json_t *kind_schema(const context *c, const char *kind, bool list, const quern_slot *slot) {
	json_t *names = json_array(), *map = object_schema();
	const size_t skip = strlen(kind) + 1;
	for (size_t i = 0; c->ids[i]; i++) {
		if (!quern_id_is_of(c->ids[i], kind)) continue;
		const quern_plugin_file *f =
			quern_loader_find(c->loader, kind, c->ids[i] + skip, c->report, (quern_mark) { 0 });
		if (!f) continue;
		json_t *own = plugin_schema(f, slot);
		if (!json_object_get(own, "required")) {
			json_array_append_new(names, json_string(c->ids[i] + skip));
			own = json_pack("{s:[o, {s:s}]}", "anyOf", own, "type", "null");
		}
		put(map, c->ids[i] + skip, own, false);
	}
	json_object_set_new(map, "minProperties", json_integer(1));
	if (!list) json_object_set_new(map, "maxProperties", json_integer(1));
	return json_pack("{s:[{s:o}, o]}", "anyOf", "enum", names, map);
}

static json_t *slot_schema(const context *c, const char *kind, bool list, const quern_slot *slot) {
	if (!list) return kind_schema(c, kind, false, slot);
	return json_pack("{s:[o, {s:s, s:o}]}", "anyOf", kind_schema(c, kind, true, slot), "type", "array",
		"items", kind_schema(c, kind, false, slot));
}

/* The objects that items of a list may be, each once: alone, in the list, or in a map by name. */
static void gather_items(json_t *items, json_t *schema) {
	json_t *one, *each = json_object_get(schema, "additionalProperties");
	size_t i;
	if (json_object_get(schema, "properties")) {
		json_array_foreach(items, i, one) if (one == schema) return;
		json_array_append(items, schema);
		return;
	}
	json_array_foreach(json_object_get(schema, "anyOf"), i, one) gather_items(items, one);
	if (json_object_get(schema, "items")) gather_items(items, json_object_get(schema, "items"));
	if (json_is_object(each)) gather_items(items, each);
}

/* An array to decref. */
static json_t *items_of(json_t *section, const char *list) {
	json_t *items = json_array();
	gather_items(items, json_object_get(json_object_get(section, "properties"), list));
	return items;
}

/* "fill.packer" stands in the items of the list "fill". */
static void put_slot(json_t *section, const quern_slot *s, json_t *value) {
	const bool required = !s->def && (!s->list || s->required);
	const char *dot = strchr(s->name, '.');
	json_t *one;
	size_t i;
	if (!dot) {
		put(section, s->name, value, required);
		return;
	}
	char *list = quern_copy(s->name);
	list[dot - s->name] = 0;
	json_t *items = items_of(section, list);
	json_array_foreach(items, i, one) put(one, dot + 1, json_incref(value), required);
	json_decref(items);
	json_decref(value);
	free(list);
}

/* Items take keys of whatever plugins there are. */
static void open_items(json_t *section, const char *list) {
	json_t *items = items_of(section, list), *one;
	size_t i;
	json_array_foreach(items, i, one) json_object_set_new(one, "additionalProperties", json_true());
	json_decref(items);
}

static json_t *section_schema(const context *c, const char *solver) {
	const quern_plugin_file *f =
		quern_loader_find(c->loader, quern_solver_kind.name, solver, c->report, (quern_mark) { 0 });
	if (!f) return json_object();
	const quern_solver_ops *ops = f->plugin.ops;
	json_t *section = map_schema(f->params);
	for (const quern_param *row = f->params; row->name; row++)
		if (row->unless && row->flags & QUERN_REQUIRED) require_either(section, row);
	put(section, "solver", json_pack("{s:s}", "const", solver), false);
	json_object_set_new(section, "description", json_string(f->plugin.brief ? f->plugin.brief : ""));
	for (const quern_slot *s = ops->slots; s && s->name; s++) {
		if (s->same_as) continue;
		if (!*s->name) {
			json_decref(section);
			return slot_schema(c, s->kind->name, true, s);
		}
		if (s->refine) open_items(section, s->refine);
		put_slot(section, s, slot_schema(c, s->kind->name, s->list != 0, s));
	}
	/* of another solver's keys nothing is known here */
	json_t *other = json_pack("{s:s, s:[s], s:{s:{s:{s:s}}}}", "type", "object", "required", "solver",
		"properties", "solver", "not", "const", solver);
	return json_pack("{s:o, s:{s:s}, s:o}", "if", other, "then", "type", "object", "else", section);
}

/* ---- the whole ---- */

/* One of the core's own lists, with what is said of it there. */
static void put_list(json_t *scene, const char *name, json_t *value) {
	for (const quern_general_list *l = quern_general_lists; l->name; l++)
		if (!strcmp(l->name, name)) json_object_set_new(value, "description", json_string(l->doc));
	put(scene, name, value, false);
}

static json_t *scene_schema(const context *c) {
	json_t *scene = map_schema(quern_general_rows);
	put_list(scene, "domain.periodic",
		json_pack("{s:s, s:o, s:i, s:i}", "type", "array", "items", defined("switch"), "minItems", 2,
			"maxItems", 3));
	json_t *faces = json_array();
	for (int k = 0; k < 6; k++) json_array_append_new(faces, json_string(quern_face_name(k % 2, k / 2)));
	put_list(scene, "domain.open",
		json_pack("{s:s, s:{s:o}, s:i}", "type", "array", "items", "enum", faces, "maxItems", 6));
	put_list(scene, "output.fields", json_pack("{s:s, s:{s:s}}", "type", "array", "items", "type", "string"));
	put_list(scene, "stages",
		json_pack("{s:s, s:i, s:{s:s, s:b, s:{s:{s:[{s:s, s:f}, o]}, s:{s:s}}}}", "type", "array", "minItems",
			1, "items", "type", "object", "additionalProperties", false, "properties", "for", "anyOf", "type",
			"number", "exclusiveMinimum", 0.0, defined("quantity"), "set", "type", "object"));
	const quern_catalogue *known = quern_loader_catalogue(c->loader);
	for (size_t i = 0; i < known->n_solvers; i++)
		if (quern_section_is_claimed(&known->solvers[i]))
			put(scene, known->solvers[i].section, section_schema(c, known->solvers[i].solver), false);
	put(scene, "observe", slot_schema(c, quern_observer_kind.name, true, &quern_observe_slot), false);
	json_object_set_new(scene, "$schema", json_string("http://json-schema.org/draft-07/schema#"));
	json_object_set_new(scene, "title", json_string("Quern scene"));
	json_object_set_new(scene, "definitions",
		json_pack("{s:{s:s, s:s, s:s}, s:{s:[b, b, s, s, s, s]}}", "quantity", "type", "string", "pattern",
			"^[+-]?([0-9]+[.]?[0-9]*|[.][0-9]+)([eE][+-]?[0-9]+)?([ \\t]*([^0-9 \\t+.,-].*|1/.*))?$",
			"description", "A number, with a unit if it is not in SI: 5 mm.", "switch", "enum", true, false,
			"yes", "no", "on", "off"));
	return scene;
}

static int write_schema(int argc, char **argv) {
	const char *out = NULL;
	quern_words words = { 0 };
	const quern_option options[] = { QUERN_TEXT(&out, 'o', "output", "FILE", "where to write it"),
		QUERN_END_OPTIONS };
	int status = quern_options_read(&quern_command_schema, options, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return status;
	context c = { quern_loader_create(), quern_report_create(), NULL };
	quern_loader_beware(c.loader);
	c.ids = quern_loader_ids(c.loader);
	json_t *schema = scene_schema(&c);
	char *text = json_dumps(schema, JSON_INDENT(1) | JSON_PRESERVE_ORDER);
	char why[256];
	status = quern_report_errors(c.report) ? QUERN_EXIT_SCENE : QUERN_EXIT_DONE;
	quern_report_print(c.report, stderr);
	if (!out) puts(text);
	else if (!quern_save_bytes(out, text, strlen(text), why)) {
		fprintf(stderr, "quern: error: %s\n", why);
		status = QUERN_EXIT_IO;
	}
	free(text);
	json_decref(schema);
	quern_loader_free_ids(c.ids);
	quern_report_destroy(c.report);
	quern_loader_destroy(c.loader);
	return status;
}

const quern_command quern_command_schema = { "schema", "[-o FILE]", "JSON Schema of scenes, for editors",
	write_schema };
