/* SPDX-License-Identifier: MIT */
/* beyond - tables of what happened beyond a limit: to the terminal and, where a folder is given, as a page of Markdown */
#pragma once
#include <run.h>

/* Reads `PROGRAM [long] [FOLDER]`. The page is FOLDER/stability-NAME.md. False if a word is not understood or the page
 * cannot be written. */
bool beyond_begin(int argc, char **argv, const char *name);
/* Whether the longer version is asked for. */
bool beyond_is_long(void);
/* A table's title, and its columns with a bar between any two. */
void beyond_table(const char *title, const char *columns);
/* Cells with bars between them. */
void beyond_row(const char *fmt, ...) __attribute__((format(printf, 1, 2)));
/* A sentence between the tables. */
void beyond_note(const char *fmt, ...) __attribute__((format(printf, 1, 2)));
void beyond_end(void);

/* Why the run ended, or that it did not. */
const char *beyond_message(const quern_run *);
/* What it says if it was stopped by this stage, naming this set; fails the test if not. */
void beyond_expect_culprit(const quern_run *, const char *stage, const char *set);

/* From now on steps of this many seconds, beyond any limit too. */
void beyond_force_step(quern_run *, double step);
