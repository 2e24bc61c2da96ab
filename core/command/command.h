/* SPDX-License-Identifier: MIT */
/* command - what a program does from the command line */
#pragma once
#include "exit.h"
#include <stdio.h>

/* "quern NAME ARGUMENTS" and what it does; `run` returns the exit status, argv[0] is the name. */
typedef struct quern_command {
	const char *name, *arguments, *help;
	int (*run)(int argc, char **argv);
} quern_command;

extern const quern_command quern_command_run, quern_command_plan, quern_command_list, quern_command_describe,
	quern_command_schema, quern_command_new, quern_command_check; /* of quern */

/* "usage: quern COMMAND ...", without the end of the line. */
void quern_print_usage(const quern_command *, FILE *);
/* A sentence to stderr, and below it how to get help; returns QUERN_EXIT_USAGE. */
int quern_usage(const quern_command *, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
/* The status that a program ends with: what was printed but could not be written, to a full disk, is not done. */
int quern_ended(int status);

/* The program that does `quern WORD`, if WORD is none of quern's own commands: quern-WORD, as in git. It is looked for beside
 * quern, where it is built or installed, and then on PATH. free(); NULL: there is none. */
char *quern_program_find(const char *word);
/* The words of those that stand beside quern, NULL-terminated; free() each and the list. */
char **quern_program_words(void);
