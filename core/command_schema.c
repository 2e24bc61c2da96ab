/* quern schema - a JSON Schema of scenes from the rows of all installed plugins, for completion in editors */
#include "command.h"
#include "h5.h"
#include "options.h"
#include "scene.h"
#include "text.h"
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
	quern_loader *loader;
	quern_report *report;
	char **ids;
} context;

static json_t *row_schema(const quern_param *row, uint32_t dim);

/* The node of a dotted name, its maps opened on the way. */
static void put(json_t *properties, const char *name, json_t *value) {
	const size_t n = strcspn(name, ".");
	char part[64];
	snprintf(part, sizeof part, "%.*s", (int)n, name);
	if (!name[n]) {
		json_t *there = json_object_get(properties, part);
		if (there) json_decref(value); /* a choice beside its own map: the map's schema allows both */
		else json_object_set_new(properties, part, value);
		return;
	}
	json_t *map = json_object_get(properties, part), *inner = map ? json_object_get(map, "properties") : NULL;
	if (!inner) {
		inner = json_object();
		map = json_pack("{s:[s, s], s:o, s:b}", "type", "object", "string", "properties", inner,
			"additionalProperties", false);
		json_object_set_new(properties, part, map);
	}
	put(inner, name + n + 1, value);
}

static json_t *map_schema(const quern_param *rows, uint32_t dim) {
	json_t *properties = json_object();
	for (; rows && rows->name; rows++) put(properties, rows->name, row_schema(rows, dim));
	return properties;
}

static json_t *row_schema(const quern_param *row, uint32_t dim) {
	json_t *s = json_object();
	char *doc = quern_format("%s%s%s%s", row->doc ? row->doc : "",
		row->unit && strcmp(row->unit, "1") != 0 ? " [" : "",
		row->unit && strcmp(row->unit, "1") != 0 ? row->unit : "",
		row->unit && strcmp(row->unit, "1") != 0 ? "]" : "");
	json_object_set_new(s, "description", json_string(doc));
	free(doc);
	if (row->choices) {
		json_t *choices = json_array();
		for (const char *const *c = row->choices; *c; c++) json_array_append_new(choices, json_string(*c));
		json_object_set_new(s, "enum", choices);
	} else if (row->type == QUERN_T_REAL || row->type == QUERN_T_INT)
		json_object_set_new(s, "type", json_pack("[s, s]", "number", "string"));
	else if (row->type == QUERN_T_BOOL) json_object_set_new(s, "type", json_string("boolean"));
	else if (row->type == QUERN_T_TEXT) json_object_set_new(s, "type", json_string("string"));
	else if (row->type == QUERN_T_VECTOR) {
		json_object_set_new(s, "type", json_string("array"));
		json_object_set_new(s, "items", json_pack("{s:[s, s]}", "type", "number", "string"));
	} else {
		json_t *item = json_pack("{s:s, s:o}", "type", "object", "properties", map_schema(row->rows, dim));
		json_t *list = json_pack("{s:s, s:O}", "type", "array", "items", item);
		json_object_set_new(s, "anyOf", json_pack("[o, o]", item, list));
	}
	return s;
}

/* A plugin in a slot: its bare name, or one name with parameters. */
static json_t *kind_schema(const context *c, uint32_t kind, const quern_slot *slot) {
	json_t *names = json_array(), *properties = json_object();
	const char *prefix = quern_kind_name(kind);
	const size_t skip = strlen(prefix) + 1;
	for (size_t i = 0; c->ids[i]; i++) {
		if (strncmp(c->ids[i], prefix, skip - 1) != 0 || c->ids[i][skip - 1] != '.') continue;
		const quern_plugin_file *f =
			quern_loader_find(c->loader, (quern_kind)kind, c->ids[i] + skip, c->report, (quern_mark) { 0 });
		if (!f) continue;
		json_t *own = map_schema(f->params, 2);
		for (const quern_param *row = slot ? slot->rows : NULL; row && row->name; row++)
			put(own, row->name, row_schema(row, 2));
		if (slot && slot->override)
			json_object_set_new(own, strchr(slot->override, '.') + 1, json_pack("{s:s}", "type", "object"));
		json_array_append_new(names, json_string(c->ids[i] + skip));
		json_object_set_new(properties, c->ids[i] + skip,
			json_pack("{s:[s, s], s:s, s:o, s:b}", "type", "object", "null", "description",
				f->plugin.brief ? f->plugin.brief : "", "properties", own, "additionalProperties", false));
	}
	json_t *map = json_pack(
		"{s:s, s:o, s:b}", "type", "object", "properties", properties, "additionalProperties", false);
	return json_pack("{s:[o, o]}", "anyOf", json_pack("{s:o}", "enum", names), map);
}

static json_t *slot_schema(const context *c, uint32_t kind, bool list, const quern_slot *slot) {
	json_t *one = kind_schema(c, kind, slot);
	if (!list) return one;
	return json_pack("{s:[o, o]}", "anyOf", one, json_pack("{s:s, s:O}", "type", "array", "items", one));
}

static json_t *section_schema(const context *c, const char *solver) {
	const quern_plugin_file *f =
		quern_loader_find(c->loader, QUERN_SOLVER, solver, c->report, (quern_mark) { 0 });
	if (!f) return json_object();
	const quern_solver_ops *ops = f->plugin.ops;
	json_t *properties = map_schema(f->params, 2);
	json_object_set_new(properties, "solver", json_pack("{s:s}", "type", "string"));
	for (const quern_slot *s = ops->slots; s && s->name; s++) {
		if (s->same_as) continue;
		if (!*s->name) {
			json_decref(properties);
			return slot_schema(c, s->kind, true, s);
		}
		const char *dot = strchr(s->name, '.');
		if (!dot) json_object_set_new(properties, s->name, slot_schema(c, s->kind, s->list != 0, s));
		else { /* into the item of the list it belongs to */ char *list = quern_copy(s->name);
			list[dot - s->name] = 0;
			json_t *item = json_array_get(json_object_get(json_object_get(properties, list), "anyOf"), 0);
			if (item)
				json_object_set_new(
					json_object_get(item, "properties"), dot + 1, slot_schema(c, s->kind, false, s));
			free(list);
		}
	}
	return json_pack("{s:s, s:s, s:o, s:b}", "type", "object", "description", f->plugin.brief, "properties",
		properties, "additionalProperties", false);
}

static json_t *scene_schema(const context *c) {
	json_t *properties = map_schema(quern_general_rows, 2), *required = json_array();
	put(properties, "domain.periodic",
		json_pack("{s:s, s:{s:s}}", "type", "array", "items", "type", "boolean"));
	put(properties, "output.fields", json_pack("{s:s, s:{s:s}}", "type", "array", "items", "type", "string"));
	for (const quern_section_name *n = quern_section_names; n->section; n++)
		json_object_set_new(properties, n->section, section_schema(c, n->solver));
	json_object_set_new(properties, "observe", slot_schema(c, QUERN_OBSERVER, true, NULL));
	const char *const needed[] = { "quern", "dimension", "gravity", "domain", "time" };
	for (size_t i = 0; i < sizeof needed / sizeof *needed; i++)
		json_array_append_new(required, json_string(needed[i]));
	return json_pack("{s:s, s:s, s:s, s:o, s:o, s:b}", "$schema", "http://json-schema.org/draft-07/schema#",
		"title", "Quern scene", "type", "object", "properties", properties, "required", required,
		"additionalProperties", false);
}

int quern_command_schema(int argc, char **argv) {
	const char *out = NULL;
	quern_words words = { 0 };
	const quern_option options[] = { QUERN_TEXT(&out, 'o', "output", "FILE", "where to write it"),
		QUERN_END_OPTIONS };
	int status = quern_options_read("schema", options, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return status;
	context c = { quern_loader_create(), quern_report_create(), NULL };
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
