/* SPDX-License-Identifier: MIT */
/* quern plan - everything short of running: what is loaded, in which order it works, what is allocated and what not */
#include "command.h"
#include "config.h"
#include "estimate.h"
#include "options.h"
#include "prospect.h"
#include "run.h"
#include "sections.h"
#include "text.h"
#include "watch.h"
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static json_t *number(double x) { return isfinite(x) ? json_real(x) : json_null(); }

/* ---- what the plan says, once for people and programs ---- */

static json_t *plugins_of(const quern_run *run) {
	json_t *list = json_array();
	for (size_t i = 0; i < quern_loader_count(run->scene->loader); i++) {
		const quern_plugin_file *f = quern_loader_at(run->scene->loader, i);
		json_array_append_new(
			list, json_pack("{s:s, s:s, s:i}", "id", f->plugin.id, "file", f->path, "level", f->level));
	}
	return list;
}

static json_t *stages_of(const quern_run *run) {
	json_t *list = json_array();
	for (size_t o = 0; o < run->plan->n_stages; o++) {
		const quern_plan_stage *s = &run->plan->stages[run->plan->order[o]];
		json_t *one = json_pack("{s:s, s:s, s:b}", "name", s->name, "phase", quern_phase_names[s->phase],
			"sometimes", s->sometimes);
		if (s->doc) json_object_set_new(one, "doc", json_string(s->doc));
		json_array_append_new(list, one);
	}
	return list;
}

static json_t *fields_of(const quern_run *run, int set) {
	json_t *list = json_array();
	for (size_t i = 0; i < run->plan->store.n_fields; i++) {
		const quern_field *f = &run->plan->store.fields[i];
		if (f->set != set) continue;
		json_array_append_new(list,
			json_pack("{s:s, s:s, s:i, s:b, s:b, s:b}", "name", f->name, "unit", f->unit ? f->unit : "1",
				"components", f->n_components, "state", f->state, "twice", f->twice, "scratch", f->local));
	}
	return list;
}

static json_t *sets_of(const quern_run *run) {
	json_t *list = json_array();
	for (size_t s = 0; s < run->plan->store.n_sets; s++) {
		const quern_set_store *set = &run->plan->store.sets[s];
		json_t *fields = fields_of(run, (int)s);
		if (!json_array_size(fields)) {
			json_decref(fields);
			continue;
		}
		const size_t bytes = set->rows ? 64 : quern_plan_entry_bytes(run->plan, (int)s);
		json_array_append_new(list, json_pack("{s:s, s:i, s:b, s:o}", "name", set->name, "bytes_per_entry",
										(int)bytes, "rows", set->rows != 0, "fields", fields));
	}
	return list;
}

/* Parts of the vocabulary that this scene does without. */
static json_t *skipped(const quern_run *run) {
	json_t *list = json_array();
	const quern_catalogue *known = quern_loader_catalogue(run->scene->loader);
	for (size_t i = 0; i < known->n_solvers; i++)
		if (quern_section_is_claimed(&known->solvers[i]) &&
			!quern_scene_section(run->scene, known->solvers[i].section))
			json_array_append_new(list, json_string(known->solvers[i].section));
	if (!run->has_grid) json_array_append_new(list, json_string("grid"));
	return list;
}

/* How many there are of what is counted, by what people call it. */
static json_t *entries_of(const quern_run *run) {
	json_t *all = json_object();
	for (size_t k = 0; k < run->plan->store.n_sets; k++) {
		const quern_set_store *set = &run->plan->store.sets[k];
		if (quern_set_is_counted(set)) json_object_set_new(all, quern_set_plural(set), json_integer(set->n));
	}
	return all;
}

/* When each begins, and what it sets. */
static json_t *scene_stages_of(const quern_run *run) {
	json_t *list = json_array();
	const quern_node *items = quern_node_find(run->scene->tree->root, "stages");
	for (size_t k = 0; k < run->scene->n_episodes; k++) {
		const quern_node *set = quern_node_find(items->entries[k].value, "set");
		json_t *sets = json_object();
		for (size_t i = 0; set && i < set->n; i++) {
			quern_text text = { 0 };
			quern_node_print(set->entries[i].value, 0, &text);
			json_object_set_new(sets, set->entries[i].key, json_string(quern_text_string(&text)));
			quern_text_finish(&text);
		}
		json_array_append_new(
			list, json_pack("{s:f, s:o}", "begin", run->scene->episodes[k].begin, "set", sets));
	}
	return list;
}

/* Takes two steps: what comes before it has been asked. */
static json_t *expected_of(quern_run *run, const quern_estimate *before) {
	const quern_prospect p = quern_prospect_of(run, before);
	if (!p.known) return NULL;
	json_t *all = json_pack("{s:o, s:s, s:f, s:f, s:f}", "entries", entries_of(run), "in_substeps", p.who,
		"share", p.discrete, "cost", p.ratio, "cost_with_most_substeps", p.best);
	json_object_set_new(all, "wide_cell", json_real(2 * p.cell));
	json_object_set_new(all, "wide_substeps", json_integer((json_int_t)p.wide_substeps));
	json_object_set_new(all, "cost_with_wide_cell", json_real(p.wide));
	return all;
}

static json_t *whole(quern_run *run) {
	const quern_general *g = &run->scene->general;
	json_t *root = json_object();
	json_object_set_new(root, "name", json_string(g->name));
	json_object_set_new(root, "dimension", json_integer(g->dimension));
	json_object_set_new(root, "plugins", plugins_of(run));
	json_object_set_new(root, "stages", stages_of(run));
	if (run->scene->n_episodes) json_object_set_new(root, "scene_stages", scene_stages_of(run));
	json_object_set_new(root, "sets", sets_of(run));
	json_object_set_new(root, "skipped", skipped(run));
	json_object_set_new(root, "entries", entries_of(run));
	const quern_estimate e = quern_estimate_of(run);
	json_object_set_new(root, "step", number(e.step));
	json_object_set_new(root, "step_set_by", json_string(e.reason));
	json_object_set_new(root, "step_limit", number(e.hard));
	json_object_set_new(root, "step_limit_set_by", json_string(e.hard_reason));
	json_object_set_new(root, "substeps", json_integer((json_int_t)e.substeps));
	if (e.most_substeps > 0) {
		json_object_set_new(root, "most_substeps", json_integer((json_int_t)e.most_substeps));
		char why[480];
		snprintf(why, sizeof why, "%.4g s, set by %s, over %.4g s, set by %s", e.own.step, e.own.step_reason,
			e.own.substep, e.own.substep_reason);
		json_object_set_new(root, "most_substeps_set_by", json_string(why));
	}
	json_object_set_new(root, "steps", number(e.steps));
	json_object_set_new(root, "settling_steps", number(e.settle_steps));
	json_object_set_new(root, "estimated_core_seconds", number(e.running));
	json_object_set_new(root, "estimated_settling_core_seconds", number(e.settling));
	json_object_set_new(root, "bytes", json_integer((json_int_t)quern_store_bytes(&run->plan->store)));
	json_object_set_new(root, "expected", expected_of(run, &e)); /* NULL sets nothing */
	return root;
}

/* ---- for people ---- */

static const char *text_of(const json_t *o, const char *key) {
	return json_string_value(json_object_get(o, key));
}
static double number_of(const json_t *o, const char *key) {
	return json_number_value(json_object_get(o, key));
}

static void print_stages(const json_t *root) {
	const char *last = "";
	size_t i;
	json_t *s;
	puts("\na step, in order (? not every time)");
	json_array_foreach(json_object_get(root, "stages"), i, s) {
		const char *phase = text_of(s, "phase");
		const bool several = !strcmp(phase, quern_phase_names[QUERN_SUBSTEP]);
		if (strcmp(phase, last) != 0) {
			printf("%s  %s", *last ? "\n" : "", phase);
			if (several) printf(" x %.0f", number_of(root, "substeps"));
			printf(":");
		}
		printf(" %s%s", text_of(s, "name"), json_is_true(json_object_get(s, "sometimes")) ? "?" : "");
		last = phase;
	}
	puts("");
}

static void print_sets(const json_t *root) {
	size_t i, k;
	json_t *set, *f;
	puts("\nfields (* state: checkpointed; x2: kept twice; ~ scratch of one stage, not stored)");
	json_array_foreach(json_object_get(root, "sets"), i, set) {
		printf("  %s, %.0f bytes%s\n   ", text_of(set, "name"), number_of(set, "bytes_per_entry"),
			json_is_true(json_object_get(set, "rows")) ? " per node" : " each");
		json_array_foreach(json_object_get(set, "fields"), k, f)
			printf(" %s[%.0f]%s%s%s", strchr(text_of(f, "name"), '.') + 1, number_of(f, "components"),
				json_is_true(json_object_get(f, "twice")) ? "x2" : "",
				json_is_true(json_object_get(f, "state")) ? "*" : "",
				json_is_true(json_object_get(f, "scratch")) ? "~" : "");
		puts("");
	}
}

static void print_scene_stages(json_t *list) {
	size_t i;
	json_t *one, *value;
	const char *key;
	if (list) puts("\nstages of the scene");
	json_array_foreach(list, i, one) {
		printf("  %zu, from %.6g s on:%s", i, number_of(one, "begin"),
			json_object_size(json_object_get(one, "set")) ? "" : " as the scene stands");
		json_object_foreach(json_object_get(one, "set"), key, value)
			printf(" %s: %s;", key, json_string_value(value));
		puts("");
	}
}

/* Fewer substeps than there is room for cost more long steps than needed; more make the short ones shorter than needed. */
static void print_substeps(const json_t *root) {
	const double n = number_of(root, "substeps"), most = number_of(root, "most_substeps");
	if (most > 0)
		printf("room for %.0f substeps: a step of %s\n", most, text_of(root, "most_substeps_set_by"));
	if (most > 0 && n != most)
		printf(
			n < most
				? "%.0f substeps would fit into a step\n"
				: "no more than %.0f substeps fit into a step, so that these are shorter than they need to be\n",
			most);
}

/* Of solvers that hand work to each other: what the first steps have shown. */
static void print_expected(const json_t *root) {
	const json_t *e = json_object_get(root, "expected");
	const char *name;
	json_t *n;
	if (!e) return;
	printf("expected once it runs:");
	json_object_foreach(json_object_get(e, "entries"), name, n)
		printf(" %s %.0f,", name, json_number_value(n));
	printf(" %s carry %.0f %% of the mass\n", text_of(e, "in_substeps"), 100 * number_of(e, "share"));
	printf("cost over %s alone: about %.2f; with %.0f substeps %.2f, and with cells of %.4g m and %.0f "
		   "substeps %.2f\n",
		text_of(e, "in_substeps"), number_of(e, "cost"), number_of(root, "most_substeps"),
		number_of(e, "cost_with_most_substeps"), number_of(e, "wide_cell"), number_of(e, "wide_substeps"),
		number_of(e, "cost_with_wide_cell"));
}

static void print(json_t *root) {
	const char *name;
	size_t i;
	json_t *one;
	printf("%s, %.0f-D\n\nplugins\n", text_of(root, "name"), number_of(root, "dimension"));
	json_array_foreach(json_object_get(root, "plugins"), i, one)
		printf("  %-32s %s\n", text_of(one, "id"), text_of(one, "file"));
	print_stages(root);
	print_sets(root);
	print_scene_stages(json_object_get(root, "scene_stages"));
	printf("\nleft out:%s", json_array_size(json_object_get(root, "skipped")) ? "" : " nothing");
	json_array_foreach(json_object_get(root, "skipped"), i, one) printf(" %s", json_string_value(one));
	puts("");
	json_object_foreach(json_object_get(root, "entries"), name, one)
		printf("%s %.0f, ", name, json_number_value(one));
	printf("%.3g MB\n", number_of(root, "bytes") * 1e-6);
	printf("step %.4g s, set by %s\n", number_of(root, "step"), text_of(root, "step_set_by"));
	if (json_is_number(json_object_get(root, "step_limit")))
		printf("unstable beyond %.4g s: %s\n", number_of(root, "step_limit"),
			text_of(root, "step_limit_set_by"));
	char settling[32], running[32];
	quern_estimate_time(number_of(root, "estimated_settling_core_seconds"), settling);
	quern_estimate_time(number_of(root, "estimated_core_seconds"), running);
	if (number_of(root, "settling_steps") > 0)
		printf("settling: some %.2g steps, %s on one core\n", number_of(root, "settling_steps"), settling);
	printf("%.0f steps of %.0f substeps, %s on one core\n", number_of(root, "steps"),
		number_of(root, "substeps"), running);
	print_substeps(root);
	print_expected(root);
}

static quern_status check_step(quern_run *run) {
	char reason[200], hard_reason[200];
	double hard;
	const double limit = quern_run_limit(run, &hard, reason, hard_reason);
	return quern_run_check_step(run, hard, hard_reason, limit);
}

static void warn_of_length(quern_run *run) {
	const quern_estimate e = quern_estimate_of(run);
	char say[600];
	if (quern_estimate_is_long(&e, quern_pool_workers(run->pool), say)) fprintf(stderr, "warning: %s\n", say);
}

static int plan_scene(int argc, char **argv) {
	quern_texts sets = { 0 };
	quern_words words = { .missing = "a scene is missing", .least = 1, .most = 1 };
	bool json = false;
	const quern_option options[] = { QUERN_TEXTS(&sets, "set", "PATH=VALUE",
										 "a key of the scene; may stand several times"),
		QUERN_FLAG(&json, "json", "for programs"), QUERN_END_OPTIONS };
	int status = quern_options_read(&quern_command_plan, options, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return free(sets.at), status;
	status = QUERN_EXIT_DONE;
	quern_watch_begin();
	quern_scene *scene = quern_scene_read(words.at[0], sets.at, &quern_host_table);
	quern_run *run = quern_report_errors(scene->report) ? NULL : quern_run_create(scene, 0);
	quern_report_print(scene->report, stderr);
	if (!run || quern_report_errors(scene->report)) status = QUERN_EXIT_SCENE;
	else if (quern_run_setup(run) != QUERN_OK || check_step(run) != QUERN_OK) {
		quern_run_complain(run, stderr);
		status = run->status == QUERN_E_PARAM ? QUERN_EXIT_SCENE : QUERN_EXIT_FAILED;
	} else {
		warn_of_length(run);
		json_t *root = whole(run);
		if (json) json_dumpf(root, stdout, JSON_INDENT(2) | JSON_PRESERVE_ORDER), puts("");
		else print(root);
		json_decref(root);
	}
	if (run) quern_run_destroy(run);
	else quern_scene_destroy(scene);
	free(sets.at);
	return status;
}

const quern_command quern_command_plan = { "plan", "SCENE.yaml [OPTION]...", "everything short of running",
	plan_scene };
