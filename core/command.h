/* command - what the program does from the command line; each returns the exit status */
#pragma once

enum {
	QUERN_EXIT_DONE,
	QUERN_EXIT_USAGE,
	QUERN_EXIT_SCENE,
	QUERN_EXIT_FAILED,
	QUERN_EXIT_IO,
	QUERN_EXIT_INTERRUPTED = 130
};

int quern_command_run(int argc, char **argv);
int quern_command_plan(int argc, char **argv);
int quern_command_list(int argc, char **argv);
int quern_command_describe(int argc, char **argv);
int quern_command_schema(int argc, char **argv);
int quern_command_new(int argc, char **argv);
int quern_command_check(int argc, char **argv);
int quern_command_render(int argc, char **argv);

/* A line to stderr that ends with how to get help; returns QUERN_EXIT_USAGE. */
int quern_usage(const char *command, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
