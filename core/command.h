/* command - what the program does from the command line; each returns the exit status */
#pragma once
#include <stdio.h>

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

/* "usage: quern COMMAND ...", without the end of the line. */
void quern_print_usage(const char *command, FILE *);
/* A sentence to stderr, and below it how to get help; returns QUERN_EXIT_USAGE. */
int quern_usage(const char *command, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
