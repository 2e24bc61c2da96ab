/* SPDX-License-Identifier: MIT */
/* quern check - conformance tests of one plugin, each group in a process of its own, so that a crash is one sentence */
#include "check.h"
#include "child.h"
#include "command.h"
#include "level.h"
#include "options.h"
#include <stdlib.h>

static const check_kind *const kinds[] = { &quern_check_contact, &quern_check_neighbours,
	&quern_check_integrator, &quern_check_body, &quern_check_material, &quern_check_shape,
	&quern_check_transfer, &quern_check_coupling, &quern_check_oracle, &quern_check_packer,
	&quern_check_observer };

static const check_kind *kind_of(const check *c) {
	for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
		if (quern_id_is_of(c->file->plugin.id, kinds[k]->kind->name)) return kinds[k];
	return NULL;
}

static void group_table(const check *c) { quern_check_table(c); }
static void group_parameters(const check *c) { quern_check_parameters(c, kind_of(c)); }
static void group_batches(const check *c) { quern_check_batches(c, kind_of(c)); }
static void group_law(const check *c) { kind_of(c)->law(c); }

/* ---- groups of tests, each in a child ---- */

typedef struct {
	const check *c;
	void (*group)(const check *);
} errand;

static void run_errand(void *arg) {
	const errand *e = arg;
	e->group(e->c);
	quern_check_environment(e->c);
}

/* A group of tests takes a few seconds; one that goes on for ever is stopped. */
static void run_group(const check *c, const char *name, void (*group)(const check *)) {
	errand e = { c, group };
	char what[80];
	quern_check_place(c, "its tables");
	const quern_child how = quern_child_run(run_errand, &e, c->seconds);
	if (how.end == QUERN_CHILD_DONE) return;
	quern_child_say(&how, c->seconds, what);
	printf("  FAILED  %s: %s: %s %s %s.%s\n", name, c->file->plugin.id, what,
		how.end == QUERN_CHILD_LATE ? "from" : "in", quern_id_name(c->file->plugin.id), c->shared->place);
	c->shared->properties++;
	c->shared->failed++;
}

static int run_checks(check *c) {
	const quern_plugin *p = &c->file->plugin;
	c->shared = quern_shared_take(sizeof *c->shared);
	if (!c->shared) return perror("quern check"), QUERN_EXIT_IO;
	quern_environment home = quern_environment_take();
	c->home = &home;
	printf("%s, %s\n", p->id, c->file->path);
	run_group(c, "tables", group_table);
	if (quern_id_is_of(p->id, quern_solver_kind.name)) run_group(c, "solver", quern_check_solver);
	else {
		run_group(c, "parameters", group_parameters);
		if (kind_of(c)->make) run_group(c, "batches", group_batches);
		run_group(c, "law", group_law);
	}
	check_tally left = { .name = "environment" };
	quern_check_expect(&left, !*c->shared->left, "%s", c->shared->left);
	quern_check_tell(c, &left, "arithmetic and the working folder are as they were after every call");
	const uint32_t n = c->shared->properties, failed = c->shared->failed;
	if (failed) printf("%s: %u of %u properties FAILED\n", p->id, failed, n);
	else printf("%s: %u properties, all ok\n", p->id, n);
	quern_environment_drop(&home);
	quern_shared_drop(c->shared, sizeof *c->shared);
	return failed ? QUERN_EXIT_SCENE : QUERN_EXIT_DONE;
}

/* ---- the command ---- */

static const quern_plugin_file *open_plugin(
	quern_loader *loader, const char *path, int64_t dimension, quern_report *report) {
	const quern_plugin_file *file = quern_loader_open(loader, path, report, (quern_mark) { 0 });
	if (!file) return NULL;
	if (file->level > quern_level_here())
		quern_report_add(report, (quern_mark) { 0 }, "%s is for x86-64-v%d, which this processor is not",
			path, file->level);
	else if (dimension && !(file->plugin.dims & (dimension == 2 ? QUERN_2D : QUERN_3D)))
		quern_report_add(
			report, (quern_mark) { 0 }, "%s does not work in %d dimensions", file->plugin.id, (int)dimension);
	else return file;
	return NULL;
}

static int check_plugin(int argc, char **argv) {
	quern_texts sets = { 0 };
	int64_t dimension = 0, seconds = 120;
	quern_words words = { .missing = "a plugin is missing", .least = 1, .most = 1 };
	const quern_option options[] = { QUERN_TEXTS(&sets, "set", "KEY=VALUE",
										 "a parameter of the plugin; may stand several times"),
		QUERN_NUMBER(&dimension, "dimension", 2, 3, "try this one alone; default: all it has"),
		QUERN_NUMBER(&seconds, "seconds", 1, 86400, "when a group of tests is stopped; default: 120"),
		QUERN_END_OPTIONS };
	int status = quern_options_read(&quern_command_check, options, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return free(sets.at), status;
	quern_report *report = quern_report_create();
	quern_tree *tree = quern_tree_parse("--set", "{}", 2, report);
	for (size_t i = 0; i < sets.n; i++) quern_tree_set(tree, sets.at[i], report);
	quern_loader *loader = quern_loader_create();
	check c = { .given = tree->root,
		.dimension = (uint32_t)dimension,
		.seconds = (unsigned)seconds,
		.units = quern_units_create() };
	quern_loader_beware(loader);
	if (!quern_report_errors(report)) c.file = open_plugin(loader, words.at[0], dimension, report);
	const check_kind *kind = c.file ? kind_of(&c) : NULL;
	if (c.file)
		c.ops = quern_loader_ops(
			loader, c.file, kind ? kind->kind : &quern_solver_kind, report, (quern_mark) { 0 });
	quern_report_print(report, stderr);
	status = c.ops ? run_checks(&c) : QUERN_EXIT_SCENE;
	quern_units_destroy(c.units);
	quern_loader_destroy(loader);
	quern_tree_destroy(tree);
	quern_report_destroy(report);
	free(sets.at);
	return status;
}

const quern_command quern_command_check = { "check", "PLUGIN.so [OPTION]...", "conformance tests of a plugin",
	check_plugin };
