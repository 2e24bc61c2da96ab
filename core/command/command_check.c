/* SPDX-License-Identifier: MIT */
/* quern check - conformance tests of one plugin */
#include "check.h"
#include "command.h"
#include "options.h"
#include "text.h"
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* A folder for what a scene's run leaves; NULL, with a sentence said, if there can be none. */
static char *make_folder(void) {
	const char *place = getenv("TMPDIR");
	char *folder = quern_format("%s/quern-check-XXXXXX", place && *place ? place : "/tmp");
	if (mkdtemp(folder)) return folder;
	fprintf(stderr, "quern check: %s cannot be made: %s\n", folder, strerror(errno));
	free(folder);
	return NULL;
}

static void remove_folder(char *folder) {
	static const char *const names[] = { "settling.h5", "steps.h5", "checkpoint.h5", "checkpoint.h5.part" };
	for (size_t i = 0; folder && i < sizeof names / sizeof *names; i++) {
		char *path = quern_format("%s/%s", folder, names[i]);
		unlink(path);
		free(path);
	}
	if (folder) rmdir(folder);
	free(folder);
}

/* The object's own path, whatever its name was. */
static int check_object(check_task *task, const char *path) {
	char real[PATH_MAX];
	if (!realpath(path, real)) {
		fprintf(stderr, "quern check: error: plugin %s %s\n", path, strerror(errno));
		return QUERN_EXIT_SCENE;
	}
	char *folder = task->scene ? make_folder() : NULL;
	task->path = real;
	task->folder = folder;
	const int status = task->scene && !folder ? QUERN_EXIT_IO : quern_check_plugin(task);
	remove_folder(folder);
	return status;
}

static int check_plugin(int argc, char **argv) {
	quern_texts sets = { 0 };
	int64_t dimension = 0, seconds = 120, steps = 40;
	check_task task = { .path = NULL };
	quern_words words = { .missing = "a plugin is missing", .least = 1, .most = 1 };
	const quern_option options[] = {
		QUERN_TEXTS(&sets, "set", "KEY=VALUE",
			"a parameter of the plugin, or with --scene a key of the scene; may stand several times"),
		QUERN_NUMBER(&dimension, "dimension", 2, 3, "try this one alone; default: all it has"),
		QUERN_TEXT(
			&task.scene, 0, "scene", "FILE", "for a solver: run the first steps of this scene with it"),
		QUERN_NUMBER(&steps, "steps", 2, 1000000, "how many of the scene, and of its settling; default: 40"),
		QUERN_NUMBER(&seconds, "seconds", 1, 86400, "when a group of tests is stopped; default: 120"),
		QUERN_END_OPTIONS
	};
	int status = quern_options_read(&quern_command_check, options, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return free(sets.at), status;
	quern_report *report = quern_report_create();
	quern_tree *tree = quern_tree_parse("--set", "{}", 2, report);
	for (size_t i = 0; i < sets.n && !task.scene; i++) quern_tree_set(tree, sets.at[i], report);
	task.given = tree->root;
	task.sets = task.scene ? sets.at : NULL;
	task.dimension = (uint32_t)dimension;
	task.seconds = (unsigned)seconds;
	task.steps = steps;
	status = QUERN_EXIT_SCENE;
	if (quern_report_errors(report)) quern_report_print(report, stderr);
	else status = check_object(&task, words.at[0]);
	quern_tree_destroy(tree);
	quern_report_destroy(report);
	free(sets.at);
	return status;
}

const quern_command quern_command_check = { "check", "PLUGIN.so [OPTION]...", "conformance tests of a plugin",
	check_plugin };
