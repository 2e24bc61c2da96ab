/* SPDX-License-Identifier: MIT */
/* quern - the program: its commands, and what it says of itself */
#include "command.h"
#include "commit.h"
#include "config.h"
#include "h5.h"
#include "platform.h"
#include "text.h"
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const quern_command *const commands[] = { &quern_command_run, &quern_command_plan, &quern_command_list,
	&quern_command_describe, &quern_command_schema, &quern_command_new, &quern_command_check };

enum { N_COMMANDS = sizeof commands / sizeof *commands };

static int help(FILE *out) {
	char **words = quern_program_words();
	fputs("quern " QUERN_VERSION "\n\n", out);
	for (size_t i = 0; i < N_COMMANDS; i++)
		fprintf(
			out, "  quern %s %s\n        %s\n", commands[i]->name, commands[i]->arguments, commands[i]->help);
	for (size_t i = 0; words[i]; i++)
		fprintf(out, "  quern %s ...\n        a program of its own, quern-%s\n", words[i], words[i]),
			free(words[i]);
	free(words);
	fputs("\nquern COMMAND --help says what a command takes.\n"
		  "Exit status: 0 done, 1 usage, 2 a bad scene, plugin or file, 3 the run failed, 4 files could not "
		  "be written,\n"
		  "130 interrupted with a checkpoint saved.\n",
		out);
	return QUERN_EXIT_DONE;
}

static int unknown(const char *name) {
	char **words = quern_program_words();
	const char **known = quern_take(N_COMMANDS + 1, sizeof *known);
	size_t n = 0, capacity = N_COMMANDS + 1;
	for (; n < N_COMMANDS; n++) known[n] = commands[n]->name;
	for (size_t i = 0; words[i]; i++) {
		known = quern_grow(known, n + 1, &capacity, sizeof *known);
		known[n++] = words[i];
	}
	known[n] = NULL;
	const char *near = quern_nearest(name, known);
	fprintf(stderr, "quern: unknown command '%s'%s%s%s; see quern --help\n", name,
		near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
	for (size_t i = 0; words[i]; i++) free(words[i]);
	free(words);
	free(known);
	return QUERN_EXIT_USAGE;
}

/* Takes this process's place; comes back if it cannot. */
static int become(const char *path, char **argv) {
	fflush(NULL);
	execv(path, argv);
	fprintf(stderr, "quern: error: %s cannot be started: %s\n", path, strerror(errno));
	return QUERN_EXIT_FAILED;
}

static int run(int argc, char **argv) {
	if (argc < 2) {
		help(stderr);
		return QUERN_EXIT_USAGE;
	}
	if (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h") || !strcmp(argv[1], "help")) return help(stdout);
	if (!strcmp(argv[1], "--version"))
		return puts("quern " QUERN_VERSION " (" QUERN_COMMIT ")"), QUERN_EXIT_DONE;
	for (size_t i = 0; i < N_COMMANDS; i++)
		if (!strcmp(commands[i]->name, argv[1])) return commands[i]->run(argc - 1, argv + 1);
	char *path = quern_program_find(argv[1]);
	const int status = path ? become(path, argv + 1) : unknown(argv[1]);
	free(path);
	return status;
}

int main(int argc, char **argv) {
	quern_platform_begin();
	quern_h5_begin();
	return quern_ended(run(argc, argv));
}
