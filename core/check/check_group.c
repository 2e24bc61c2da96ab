/* SPDX-License-Identifier: MIT */
/* quern_check_plugin - groups of tests, each in a process of its own that loads the plugin for itself: a crash, an
 * endless loop, an exit() is one sentence, and the other groups go on */
#include "check.h"
#include "child.h"
#include "exit.h"
#include "level.h"
#include "text.h"
#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef void group(const check *);

typedef struct {
	const check_task *task;
	check_shared *shared;
	quern_environment *home;
	quern_loader *loader; /* which has asked all solvers; every child has its own copy */
	group *group;         /* NULL: looks what the plugin is, and says so in `shared` */
} errand;

/* ---- in the child ---- */

static const quern_plugin_file *open_plugin(
	quern_loader *loader, const check_task *task, quern_report *report) {
	const uint32_t dim = task->dimension;
	const quern_plugin_file *file = quern_loader_open(loader, task->path, report, (quern_mark) { 0 });
	if (!file) return NULL;
	if (file->level > quern_level_here())
		quern_report_add(report, (quern_mark) { 0 }, "%s is for x86-64-v%d, which this processor is not",
			task->path, file->level);
	else if (dim && !(file->plugin.dims & (dim == 2 ? QUERN_2D : QUERN_3D)))
		quern_report_add(
			report, (quern_mark) { 0 }, "%s does not work in %u dimensions", file->plugin.id, dim);
	else if (task->scene && !quern_id_is_of(file->plugin.id, quern_solver_kind.name))
		quern_report_add(
			report, (quern_mark) { 0 }, "--scene is for solvers, and %s is none", file->plugin.id);
	else return file;
	return NULL;
}

/* NULL also if there is none, which is no fault. */
static const quern_plugin_file *find_test(quern_loader *loader, const char *kind, quern_report *report) {
	char **ids = quern_loader_ids(loader), *id = quern_format("%s.%s", quern_check_kind.name, kind);
	bool there = false;
	for (size_t i = 0; ids[i]; i++) there = there || !strcmp(ids[i], id);
	quern_loader_free_ids(ids);
	free(id);
	return there ? quern_loader_find(loader, quern_check_kind.name, kind, report, (quern_mark) { 0 }) : NULL;
}

/* What the plugin's functions are is known to the test of its kind, or else to solvers that call the kind. */
static bool view(check *c, quern_loader *loader, quern_report *report) {
	const char *kind = c->file->table.kind;
	const quern_plugin_file *test = find_test(loader, kind, report);
	if (test) c->test = quern_loader_ops(loader, test, &quern_check_kind, report, (quern_mark) { 0 });
	if (quern_report_errors(report)) return false;
	const quern_kind *known = c->test ? c->test->kind : quern_loader_kind(loader, kind);
	if (known) c->open.ops = quern_loader_ops(loader, c->file, known, report, (quern_mark) { 0 });
	if (test) c->open.uses = quern_table_uses_for(&c->file->table, test->library);
	return !quern_report_errors(report);
}

static bool begin(check *c, quern_loader *loader, quern_report *report) {
	c->file = open_plugin(loader, c->task, report);
	if (!c->file) return false;
	c->open = (quern_check) { .host = &quern_check_services,
		.id = c->file->plugin.id,
		.init = &quern_check_init_services,
		.dims = c->file->plugin.dims,
		.instance_size = c->file->plugin.instance_size };
	return view(c, loader, report);
}

static void look(const check *c) {
	snprintf(c->shared->id, sizeof c->shared->id, "%s", c->open.id);
	c->shared->solver = quern_id_is_of(c->open.id, quern_solver_kind.name);
	c->shared->tested = c->test != NULL;
	c->shared->makes = c->test && c->test->make;
}

static void in_child(void *arg) {
	const errand *e = arg;
	quern_loader *loader = e->loader;
	quern_report *report = quern_report_create();
	check c = {
		.task = e->task, .loader = loader, .shared = e->shared, .home = e->home, .units = quern_units_create()
	};
	if (begin(&c, loader, report)) {
		enum { WORKERS = 4 };
		c.pool = quern_pool_create(WORKERS);
		(e->group ? e->group : look)(&c);
		quern_check_environment(&c);
		quern_pool_destroy(c.pool);
	} else if (e->group) e->shared->properties++, e->shared->failed++; /* it is another one than before */
	quern_report_print(report, stderr);
	free((void *)(uintptr_t)c.open.uses);
	quern_units_destroy(c.units);
	quern_report_destroy(report);
}

static void law(const check *c) { c->test->law(&c->open); }

/* ---- in the parent ---- */

static void run_group(const errand *e, const char *name, group *tests) {
	errand one = *e;
	char what[80];
	one.group = tests;
	snprintf(e->shared->place, sizeof e->shared->place, "%s.its tables", quern_id_name(e->shared->id));
	const quern_child how = quern_child_run(in_child, &one, e->task->seconds);
	if (how.end == QUERN_CHILD_DONE) return;
	quern_child_say(&how, e->task->seconds, what);
	printf("  FAILED  %s: %s: %s %s %s.\n", name, e->shared->id, what,
		how.end == QUERN_CHILD_LATE ? "from" : "in", e->shared->place);
	e->shared->properties++;
	e->shared->failed++;
}

/* Whether the plugin can be loaded and is what can be checked; all that is wrong is said. */
static bool look_first(const errand *e) {
	quern_report *report = quern_report_create();
	errand first = *e;
	bool good = quern_loader_survives(e->task->path, report, (quern_mark) { 0 });
	if (good) {
		const quern_child how = quern_child_run(in_child, &first, e->task->seconds);
		char what[80];
		quern_child_say(&how, e->task->seconds, what);
		good = how.end == QUERN_CHILD_DONE;
		if (!good)
			quern_report_add(
				report, (quern_mark) { 0 }, "plugin %s %s while it was loaded", e->task->path, what);
	}
	quern_report_print(report, stderr);
	quern_report_destroy(report);
	return good && *e->shared->id;
}

static void run_solver(const errand *e) {
	run_group(e, "solver", quern_check_solver);
	if (!e->task->scene) {
		quern_check_note("with --scene FILE.yaml, a scene that names it, it runs: set-up, steps, sums, mass, "
						 "threads, batches, resume");
		return;
	}
	run_group(e, "scene", quern_check_scene);
	if (!e->shared->state.n) return; /* there is nothing to compare with */
	run_group(e, "threads", quern_check_scene_threads);
	run_group(e, "batches", quern_check_scene_batches);
	run_group(e, "resume", quern_check_scene_resume);
}

static void run_groups(const errand *e) {
	const check_shared *s = e->shared;
	run_group(e, "tables", quern_check_table);
	if (s->solver) run_solver(e);
	else if (s->tested) {
		run_group(e, "parameters", quern_check_parameters);
		if (s->makes) run_group(e, "batches", quern_check_batches);
		run_group(e, "law", law);
	} else if (quern_id_is_of(s->id, quern_check_kind.name))
		quern_check_note("a conformance test is tried by the plugins of its kind");
	else {
		char text[160];
		snprintf(text, sizeof text, "check.%.*s is not installed: what holds for its kind was not tried",
			(int)strcspn(s->id, "."), s->id);
		quern_check_note(text);
	}
}

static int sum_up(const errand *e) {
	check_shared *s = e->shared;
	const check c = { .shared = s };
	quern_check_tally left = { .name = "environment" };
	quern_check_expect(&left, !*s->left, "%s", s->left);
	quern_check_tell(&c.open, &left, "arithmetic and the working folder are as they were after every call");
	if (s->failed) printf("%s: %u of %u properties FAILED\n", s->id, s->failed, s->properties);
	else printf("%s: %u properties, all ok\n", s->id, s->properties);
	return s->failed ? QUERN_EXIT_SCENE : QUERN_EXIT_DONE;
}

int quern_check_plugin(const check_task *task) {
	errand e = { .task = task, .shared = quern_shared_take(sizeof *e.shared) };
	if (!e.shared) return perror("quern check"), QUERN_EXIT_IO;
	quern_environment home = quern_environment_take();
	int status = QUERN_EXIT_SCENE;
	e.home = &home;
	e.loader = quern_loader_create();
	quern_loader_catalogue(e.loader); /* a child may have no child of its own to ask */
	if (look_first(&e)) {
		printf("%s, %s\n", e.shared->id, task->path);
		run_groups(&e);
		status = sum_up(&e);
	}
	quern_loader_destroy(e.loader);
	quern_environment_drop(&home);
	quern_shared_drop(e.shared, sizeof *e.shared);
	return status;
}
