/* SPDX-License-Identifier: MIT */
/* quern list, quern describe - what is installed and what a scene may say, from the tables of plugins and core */
#include "command.h"
#include "loader.h"
#include "options.h"
#include "param.h"
#include "scene.h"
#include "sections.h"
#include "text.h"
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const type_names[] = { "", "number", "whole number", "true or false", "text", "vector",
	"list" };

/* What can be known of its functions without the scene: a kind that a solver describes. */
static const quern_plugin_file *looked_at(
	quern_loader *loader, const quern_plugin_file *f, quern_report *report) {
	const quern_kind *kind = f ? quern_loader_kind(loader, f->table.kind) : NULL;
	return kind && !quern_loader_ops(loader, f, kind, report, (quern_mark) { 0 }) ? NULL : f;
}

static const quern_plugin_file *load(quern_loader *loader, const char *id, quern_report *report) {
	const char *name = quern_id_name(id);
	char *kind = quern_copy(id);
	kind[strcspn(kind, ".")] = 0;
	const quern_plugin_file *f = NULL;
	if (name) f = quern_loader_find(loader, kind, name, report, (quern_mark) { 0 });
	else quern_report_add(report, (quern_mark) { 0 }, "'%s' is no plugin id: KIND.NAME", id);
	free(kind);
	return looked_at(loader, f, report);
}

/* ---- list ---- */

static json_t *line_json(const quern_plugin_file *f) {
	return json_pack("{s:s, s:s, s:s, s:s}", "id", f->plugin.id, "brief",
		f->plugin.brief ? f->plugin.brief : "", "version", f->library->version, "file", f->path);
}

/* What no scene can name is left out unless it is asked for. */
static int list_plugins(int argc, char **argv) {
	bool json = false, all = false;
	quern_words words = { 0 };
	const quern_option options[] = {
		QUERN_FLAG(&all, "all", "also conformance tests, which `quern check` calls and no scene names"),
		QUERN_FLAG(&json, "json", "for programs"), QUERN_END_OPTIONS
	};
	int status = quern_options_read(&quern_command_list, options, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return status;
	quern_loader *loader = quern_loader_create();
	quern_report *report = quern_report_create();
	quern_loader_beware(loader);
	char **ids = quern_loader_ids(loader);
	json_t *list = json_array();
	quern_loader_report_strays(loader, report);
	for (size_t i = 0; ids[i]; i++) {
		if (!all && quern_id_is_of(ids[i], quern_check_kind.name)) continue;
		const quern_plugin_file *f = load(loader, ids[i], report);
		if (f && json) json_array_append_new(list, line_json(f));
		else if (f) printf("%-32s %s\n", f->plugin.id, f->plugin.brief ? f->plugin.brief : "");
	}
	if (json) json_dumpf(list, stdout, JSON_INDENT(2) | JSON_PRESERVE_ORDER), puts("");
	json_decref(list);
	quern_report_print(report, stderr);
	status = quern_report_errors(report) ? QUERN_EXIT_SCENE : QUERN_EXIT_DONE;
	quern_loader_free_ids(ids);
	quern_report_destroy(report);
	quern_loader_destroy(loader);
	return status;
}

/* ---- describe ---- */

static json_t *params_json(const quern_param *);

static json_t *default_json(const quern_param *row) {
	if (row->flags & (QUERN_REQUIRED | QUERN_MAYBE) || row->from) return NULL;
	if (row->choices) return json_string(row->choices[(int)row->def]);
	if (row->type == QUERN_T_BOOL) return json_boolean(row->def != 0);
	if (row->type == QUERN_T_TEXT) return row->text ? json_string(row->text) : NULL;
	return row->type == QUERN_T_REAL || row->type == QUERN_T_INT ? json_real(row->def) : NULL;
}

static json_t *param_json(const quern_param *row) {
	char range[96];
	json_t *one = json_pack(
		"{s:s, s:s, s:s}", "name", row->name, "type", type_names[row->type], "doc", row->doc ? row->doc : "");
	if (row->unit) json_object_set_new(one, "unit", json_string(row->unit));
	json_object_set_new(one, "required", json_boolean(row->flags & QUERN_REQUIRED));
	json_object_set_new(one, "advanced", json_boolean(row->flags & QUERN_ADVANCED));
	json_object_set_new(one, "once", json_boolean(row->flags & QUERN_ONCE));
	quern_param_range(row, range);
	if (*range) json_object_set_new(one, "range", json_string(range));
	if (row->from) json_object_set_new(one, "from", json_string(row->from));
	if (row->unless) json_object_set_new(one, "unless", json_string(row->unless));
	if (row->type == QUERN_T_LIST && row->text) json_object_set_new(one, "named_by", json_string(row->text));
	json_object_set_new(one, "default", default_json(row)); /* NULL sets nothing */
	if (row->type == QUERN_T_REAL || row->type == QUERN_T_INT) {
		if (row->flags & QUERN_PLANAR) json_object_set_new(one, "default_2d", json_real(row->planar));
		if (row->min != row->max) {
			json_object_set_new(one, "min", json_real(row->min));
			json_object_set_new(one, "max", json_real(row->max));
		}
	}
	if (row->choices) {
		json_t *choices = json_array();
		for (const char *const *c = row->choices; *c; c++) json_array_append_new(choices, json_string(*c));
		json_object_set_new(one, "choices", choices);
	}
	if (row->rows) json_object_set_new(one, "rows", params_json(row->rows));
	return one;
}

static json_t *params_json(const quern_param *row) {
	json_t *rows = json_array();
	for (; row && row->name; row++) json_array_append_new(rows, param_json(row));
	return rows;
}

static void print_param(const quern_param *row, int indent) {
	char range[96], number[32];
	quern_param_range(row, range);
	printf("%*s%-*s %s", indent, "", 26 - indent, row->name,
		row->unit && strcmp(row->unit, "1") != 0 ? row->unit : "");
	if (row->choices) {
		printf(" {");
		for (const char *const *c = row->choices; *c; c++) printf("%s%s", c == row->choices ? "" : ", ", *c);
		printf("}");
	} else printf(" %s", row->type == QUERN_T_LIST && row->text ? "map or list" : type_names[row->type]);
	if (*range) printf(", %s", range);
	if (row->from) printf("; default: %s", row->from);
	else if (row->flags & QUERN_REQUIRED)
		printf("; required%s%s", row->unless ? " without " : "", row->unless ? row->unless : "");
	else if (row->choices) printf("; default: %s", row->choices[(int)row->def]);
	else if (row->type == QUERN_T_BOOL) printf("; default: %s", row->def != 0 ? "true" : "false");
	else if (row->type == QUERN_T_TEXT && row->text) printf("; default: %s", row->text);
	else if (row->type == QUERN_T_REAL || row->type == QUERN_T_INT) {
		if (row->flags & QUERN_MAYBE) printf("; may be left out");
		else {
			quern_number(row->def, number);
			printf("; default: %s", number);
			if (row->flags & QUERN_PLANAR) quern_number(row->planar, number), printf(" (2-D: %s)", number);
		}
	}
	if (row->flags & QUERN_ONCE) printf("; no stage changes it");
	printf("\n%*s    %s\n", indent, "", row->doc ? row->doc : "");
	for (const quern_param *r = row->rows; r && r->name; r++) print_param(r, indent + 4);
}

static const char *const access_names[] = { "", "reads", "writes", "updates", "adds to" };

static void print_uses(const quern_use *row) {
	for (; row && row->field; row++) {
		printf("  %-8s %s", access_names[row->access], row->field);
		if (row->when) printf(" if %s", row->when);
		if (row->with) printf(" with %s", row->with);
		if (row->flags & QUERN_OPTIONAL) printf(" (if it exists)");
		puts("");
	}
}

static void print_sums(const quern_output *o) {
	if (o && o->name) puts("\nsums in summary.json");
	for (; o && o->name; o++)
		printf("  %-16s %-8s %s\n", o->name, o->unit ? o->unit : "1", o->doc ? o->doc : "");
}

static void print_sections(const char *what, const char *const *names) {
	if (!names) return;
	printf("%-10s", what);
	for (; *names; names++) printf(" %s", *names);
	puts("");
}

static void print_solver(const quern_solver_ops *ops) {
	printf("\nsection    %s\n", ops->section ? ops->section : "whichever names it by `solver:`");
	print_sections("needs", ops->needs);
	print_sections("with", ops->with);
	print_sections("after", ops->after);
	puts("\nsets");
	for (const quern_set *s = ops->sets; s->name; s++)
		printf("  %-16s %s%s\n", s->name, s->doc ? s->doc : "", s->counted ? " Counted." : "");
	puts("\nslots");
	for (const quern_slot *s = ops->slots; s && s->name; s++) {
		if (s->same_as) continue;
		printf("  %-16s %s: %s%s%s%s%s\n", *s->name ? s->name : "(the section)", s->kind->name,
			s->doc ? s->doc : "", s->def ? "; default: " : "", s->def ? s->def : "",
			s->refine ? "; its keys may stand in the items of " : "", s->refine ? s->refine : "");
		for (const quern_param *row = s->rows; row && row->name; row++) print_param(row, 6);
	}
	puts("\nstages");
	for (const quern_stage *s = ops->stages; s && s->name; s++)
		printf("  %-20s %s\n", s->name, s->doc ? s->doc : "");
	print_sums(ops->sums);
}

static void print_outputs(const quern_observer_ops *ops) {
	puts("\ncolumns of series.csv");
	for (const quern_output *o = ops->outputs; o && o->name; o++)
		printf("  %-14s %-8s %s\n", o->name, o->unit ? o->unit : "1", o->doc ? o->doc : "");
}

static void print_plugin(const quern_plugin_file *f) {
	const quern_plugin *p = &f->plugin;
	printf("%s %s - %s\n", p->id, f->library->version, p->brief ? p->brief : "");
	if (p->doc) printf("\n%s\n", p->doc);
	printf("\ndimensions %s%s%s\n", p->dims & QUERN_2D ? "2" : "",
		p->dims == (QUERN_2D | QUERN_3D) ? " and " : "", p->dims & QUERN_3D ? "3" : "");
	if (p->cite) printf("source     %s\n", p->cite);
	printf("file       %s\nlicence    %s\n", f->path, f->library->license);
	if (p->params->name) puts("\nparameters");
	for (const quern_param *row = p->params; row->name; row++)
		if (!(row->flags & QUERN_ADVANCED)) print_param(row, 2);
	bool advanced = false;
	for (const quern_param *row = p->params; row->name; row++)
		if (row->flags & QUERN_ADVANCED) {
			if (!advanced) puts("\nadvanced");
			advanced = true;
			print_param(row, 2);
		}
	if (p->uses->field) puts("\nfields");
	print_uses(p->uses);
	if (quern_id_is_of(p->id, quern_solver_kind.name)) print_solver(p->ops);
	if (quern_id_is_of(p->id, quern_observer_kind.name)) print_outputs(p->ops);
}

/* The keys of a scene that belong to no section. */
static void print_scene(quern_loader *loader) {
	const quern_catalogue *known = quern_loader_catalogue(loader);
	puts("scene - the keys of a scene that belong to no section\n\nkeys");
	for (const quern_param *row = quern_general_rows; row->name; row++) print_param(row, 2);
	for (const quern_general_list *l = quern_general_lists; l->name; l++)
		printf("  %-24s  list of %s; no stage changes it\n      %s\n", l->name, l->item, l->doc);
	puts("\nsections");
	for (size_t i = 0; i < known->n_solvers; i++)
		if (quern_section_is_claimed(&known->solvers[i]))
			printf("  %-24s  quern describe %s\n", known->solvers[i].section, known->solvers[i].section);
	printf("  %-24s  observers, one or a list; each takes `label`\n", quern_observe_slot.name);
}

static json_t *slots_json(const quern_solver_ops *ops) {
	json_t *slots = json_array();
	for (const quern_slot *s = ops->slots; s && s->name; s++)
		if (!s->same_as)
			json_array_append_new(
				slots, json_pack("{s:s, s:s, s:s, s:b, s:b, s:s*, s:s*, s:o}", "name", s->name, "kind",
						   s->kind->name, "doc", s->doc ? s->doc : "", "list", (int)s->list, "required",
						   !s->def && (!s->list || s->required), "default", s->def, "refine", s->refine,
						   "rows", params_json(s->rows)));
	return slots;
}

static json_t *outputs_json(const quern_output *o) {
	json_t *outputs = json_array();
	for (; o && o->name; o++)
		json_array_append_new(outputs, json_pack("{s:s, s:s, s:s}", "name", o->name, "unit",
										   o->unit ? o->unit : "1", "doc", o->doc ? o->doc : ""));
	return outputs;
}

static json_t *uses_json(const quern_use *row) {
	json_t *uses = json_array();
	for (; row->field; row++)
		json_array_append_new(uses, json_pack("{s:s, s:s, s:s}", "field", row->field, "access",
										access_names[row->access], "unit", row->unit ? row->unit : "1"));
	return uses;
}

static json_t *sets_json(const quern_solver_ops *ops) {
	json_t *sets = json_array();
	for (const quern_set *s = ops->sets; s->name; s++)
		json_array_append_new(sets,
			json_pack("{s:s, s:s, s:s, s:b}", "name", s->name, "plural", s->plural ? s->plural : s->name,
				"doc", s->doc ? s->doc : "", "counted", (int)s->counted));
	return sets;
}

static json_t *stages_json(const quern_solver_ops *ops) {
	json_t *stages = json_array();
	for (const quern_stage *s = ops->stages; s->name; s++)
		json_array_append_new(stages, json_pack("{s:s, s:s, s:o}", "name", s->name, "doc",
										  s->doc ? s->doc : "", "uses", uses_json(s->uses)));
	return stages;
}

static void put_solver(json_t *all, const quern_solver_ops *ops) {
	json_object_set_new(all, "section", ops->section ? json_string(ops->section) : json_null());
	json_object_set_new(all, "slots", slots_json(ops));
	json_object_set_new(all, "sets", sets_json(ops));
	json_object_set_new(all, "stages", stages_json(ops));
	json_object_set_new(all, "sums", outputs_json(ops->sums));
}

static json_t *scene_json(quern_loader *loader) {
	const quern_catalogue *known = quern_loader_catalogue(loader);
	json_t *keys = params_json(quern_general_rows), *sections = json_object();
	for (const quern_general_list *l = quern_general_lists; l->name; l++)
		json_array_append_new(
			keys, json_pack("{s:s, s:s+, s:s, s:b, s:b, s:b}", "name", l->name, "type", "list of ", l->item,
					  "doc", l->doc, "required", 0, "advanced", 0, "once", 1));
	for (size_t i = 0; i < known->n_solvers; i++)
		if (quern_section_is_claimed(&known->solvers[i]))
			json_object_set_new(
				sections, known->solvers[i].section, json_sprintf("solver.%s", known->solvers[i].solver));
	return json_pack("{s:s, s:o, s:o, s:o}", "id", "scene", "params", keys, "sections", sections, "observe",
		params_json(quern_observe_slot.rows));
}

static json_t *plugin_json(const quern_plugin_file *f) {
	const quern_plugin *p = &f->plugin;
	json_t *params = params_json(p->params), *uses = uses_json(p->uses);
	json_t *all = json_pack("{s:s, s:s, s:s, s:s, s:s, s:s, s:s, s:i, s:o, s:o}", "id", p->id, "brief",
		p->brief ? p->brief : "", "doc", p->doc ? p->doc : "", "cite", p->cite ? p->cite : "", "version",
		f->library->version, "license", f->library->license, "file", f->path, "dims", (int)p->dims, "params",
		params, "uses", uses);
	if (quern_id_is_of(p->id, quern_solver_kind.name)) put_solver(all, p->ops);
	if (quern_id_is_of(p->id, quern_observer_kind.name))
		json_object_set_new(all, "outputs", outputs_json(((const quern_observer_ops *)p->ops)->outputs));
	return all;
}

/* The section's solver, or NULL. */
static const char *solver_of(quern_loader *loader, const char *section) {
	const quern_catalogue *known = quern_loader_catalogue(loader);
	for (size_t i = 0; i < known->n_solvers; i++)
		if (quern_section_is_claimed(&known->solvers[i]) && !strcmp(known->solvers[i].section, section))
			return known->solvers[i].solver;
	return NULL;
}

/* A bare name is enough where only one kind has it. */
static const quern_plugin_file *find(quern_loader *loader, const char *name, quern_report *report) {
	if (strchr(name, '/'))
		return looked_at(loader, quern_loader_open(loader, name, report, (quern_mark) { 0 }), report);
	if (strchr(name, '.')) return load(loader, name, report);
	const char *solver = solver_of(loader, name);
	if (solver) return quern_loader_find(loader, quern_solver_kind.name, solver, report, (quern_mark) { 0 });
	char **ids = quern_loader_ids(loader);
	const quern_plugin_file *found = NULL;
	size_t n = 0;
	quern_text all = { 0 };
	for (size_t i = 0; ids[i]; i++)
		if (!quern_id_is_of(ids[i], quern_check_kind.name) && !strcmp(quern_id_name(ids[i]), name))
			quern_text_add(&all, "%s%s", n++ ? ", " : "", ids[i]);
	if (n == 1) found = load(loader, quern_text_string(&all), report);
	else if (n)
		quern_report_add(
			report, (quern_mark) { 0 }, "'%s' is several plugins: %s", name, quern_text_string(&all));
	else {
		const char *near = quern_nearest(name, (const char *const *)ids);
		quern_report_add(report, (quern_mark) { 0 }, "no plugin '%s'; see quern list%s%s", name,
			near ? ", or did you mean " : "", near ? near : "");
	}
	quern_text_finish(&all);
	quern_loader_free_ids(ids);
	return found;
}

static int describe_one(int argc, char **argv) {
	bool json = false;
	quern_words words = { .missing = "a plugin, a section or `scene` is missing", .least = 1, .most = 1 };
	const quern_option options[] = { QUERN_FLAG(&json, "json", "for programs"), QUERN_END_OPTIONS };
	const int status = quern_options_read(&quern_command_describe, options, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return status;
	quern_loader *loader = quern_loader_create();
	quern_report *report = quern_report_create();
	quern_loader_beware(loader);
	const bool scene = !strcmp(words.at[0], "scene");
	const quern_plugin_file *f = scene ? NULL : find(loader, words.at[0], report);
	if (json && (f || scene)) {
		json_t *root = scene ? scene_json(loader) : plugin_json(f);
		json_dumpf(root, stdout, JSON_INDENT(2) | JSON_PRESERVE_ORDER), puts("");
		json_decref(root);
	} else if (scene) print_scene(loader);
	else if (f) print_plugin(f);
	quern_report_print(report, stderr);
	quern_report_destroy(report);
	quern_loader_destroy(loader);
	return f || scene ? QUERN_EXIT_DONE : QUERN_EXIT_SCENE;
}

const quern_command quern_command_list = { "list", "[--all] [--json]", "installed plugins", list_plugins };

const quern_command quern_command_describe = { "describe", "NAME [--json]",
	"keys, units, ranges, sources of a plugin, a section, or `scene`", describe_one };
