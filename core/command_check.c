/* quern check - conformance tests of one plugin, each group in a process of its own, so that a crash is one sentence */
#include "check.h"
#include "command.h"
#include "options.h"
#include "text.h"
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

/* A group of tests takes a few seconds; one that goes on for ever is stopped. */
static int64_t seconds = 120;

static const check_kind *const kinds[QUERN_KINDS] = { [QUERN_CONTACT] = &check_contact,
	[QUERN_NEIGHBOURS] = &check_neighbours,
	[QUERN_INTEGRATOR] = &check_integrator,
	[QUERN_BODY] = &check_body,
	[QUERN_MATERIAL] = &check_material,
	[QUERN_SHAPE] = &check_shape,
	[QUERN_TRANSFER] = &check_transfer,
	[QUERN_COUPLING] = &check_coupling,
	[QUERN_ORACLE] = &check_oracle,
	[QUERN_PACKER] = &check_packer,
	[QUERN_OBSERVER] = &check_observer };

static void group_table(const check *c) { check_table(c); }
static void group_parameters(const check *c) { check_parameters(c, kinds[c->file->plugin.kind]); }
static void group_batches(const check *c) { check_batches(c, kinds[c->file->plugin.kind]); }
static void group_law(const check *c) { kinds[c->file->plugin.kind]->law(c); }

static const char *signal_name(int number) {
	switch (number) {
	case SIGSEGV: return "SIGSEGV";
	case SIGBUS: return "SIGBUS";
	case SIGFPE: return "SIGFPE";
	case SIGILL: return "SIGILL";
	case SIGABRT: return "SIGABRT";
	default: return strsignal(number);
	}
}

static void tell_end(const check *c, const char *group, int status) {
	const char *id = c->file->plugin.id, *name = strchr(id, '.') + 1;
	const check_shared *s = c->shared;
	if (WIFEXITED(status) && !WEXITSTATUS(status)) return;
	if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM)
		printf("  FAILED  %s: %s: did not come back within %d s from %s.%s\n", group, id, (int)seconds, name,
			s->place);
	else if (WIFSIGNALED(status))
		printf("  FAILED  %s: %s: crashed (%s) in %s.%s\n", group, id, signal_name(WTERMSIG(status)), name,
			s->place);
	else printf("  FAILED  %s: %s: ended the program in %s.%s\n", group, id, name, s->place);
	c->shared->properties++;
	c->shared->failed++;
}

/* The child returns through _exit, so that nothing of the parent is closed or written twice. */
static void run_group(const check *c, const char *name, void (*group)(const check *)) {
	int status = 0;
	fflush(stdout);
	check_place(c, "its tables");
	const pid_t child = fork();
	if (child < 0) {
		perror("quern check: fork");
		exit(QUERN_EXIT_IO);
	}
	if (!child) {
		alarm((unsigned)seconds);
		group(c);
		fflush(stdout);
		_exit(0);
	}
	while (waitpid(child, &status, 0) < 0) continue;
	tell_end(c, name, status);
}

static int run_checks(check *c) {
	const quern_plugin *p = &c->file->plugin;
	c->shared = mmap(NULL, sizeof *c->shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (c->shared == MAP_FAILED) return perror("quern check: mmap"), QUERN_EXIT_IO;
	printf("%s, %s\n", p->id, c->file->path);
	run_group(c, "tables", group_table);
	if (p->kind == QUERN_SOLVER) run_group(c, "solver", check_solver);
	else {
		run_group(c, "parameters", group_parameters);
		if (kinds[p->kind]->make) run_group(c, "batches", group_batches);
		run_group(c, "law", group_law);
	}
	const uint32_t n = c->shared->properties, failed = c->shared->failed;
	if (failed) printf("%s: %u of %u properties FAILED\n", p->id, failed, n);
	else printf("%s: %u properties, all ok\n", p->id, n);
	munmap(c->shared, sizeof *c->shared);
	return failed ? QUERN_EXIT_SCENE : QUERN_EXIT_DONE;
}

static const quern_plugin_file *open_plugin(quern_loader *loader, const char *path, quern_report *report) {
	const size_t n = strlen(path);
	const quern_plugin_file *file = quern_loader_open(loader, path, report, (quern_mark) { 0 });
	if (!file || file->level <= quern_loader_best_level()) return file;
	quern_report_add(report, (quern_mark) { 0 }, "%.*s is for x86-64-v%d, which this processor is not",
		(int)n, path, file->level);
	return NULL;
}

int quern_command_check(int argc, char **argv) {
	quern_texts sets = { 0 };
	quern_words words = { .missing = "a plugin is missing", .least = 1, .most = 1 };
	const quern_option options[] = { QUERN_TEXTS(&sets, "set", "KEY=VALUE",
										 "a parameter of the plugin; may stand several times"),
		QUERN_NUMBER(&seconds, "seconds", 1, 86400, "when a group of tests is stopped; default: 120"),
		QUERN_END_OPTIONS };
	int status = quern_options_read("check", options, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return free(sets.at), status;
	quern_report *report = quern_report_create();
	quern_tree *tree = quern_tree_parse("--set", "{}", 2, report);
	for (size_t i = 0; i < sets.n; i++) quern_tree_set(tree, sets.at[i], report);
	quern_loader *loader = quern_loader_create();
	check c = { .given = tree->root, .units = quern_units_create() };
	if (!quern_report_errors(report)) c.file = open_plugin(loader, words.at[0], report);
	quern_report_print(report, stderr);
	status = c.file ? run_checks(&c) : QUERN_EXIT_SCENE;
	quern_units_destroy(c.units);
	quern_loader_destroy(loader);
	quern_tree_destroy(tree);
	quern_report_destroy(report);
	free(sets.at);
	return status;
}
