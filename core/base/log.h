/* SPDX-License-Identifier: MIT */
/* log - log.txt, warnings, and the progress line of the terminal */
#pragma once
#include <stdarg.h>
#include <stdbool.h>

typedef struct quern_log quern_log;

/* `quiet`: warnings alone reach the terminal; `verbose`: what is said again and again is kept too. Lines are kept until there is a file. */
quern_log *quern_log_create(bool quiet, bool verbose);
void quern_log_destroy(quern_log *);
/* The file, with the lines so far; `append`: behind what an old one holds. */
void quern_log_open(quern_log *, const char *path, bool append);
/* 0, or the errno of the first line that could not be written. */
int quern_log_fault(const quern_log *);
/* How many warnings there were. */
int quern_log_warnings(const quern_log *);
/* level -1: file alone, and only if asked for, 0: file alone, 1: terminal too, 2: a warning */
void quern_log_add(quern_log *, int level, const char *fmt, ...) __attribute__((format(printf, 3, 4)));
void quern_log_addv(quern_log *, int level, const char *fmt, va_list) __attribute__((format(printf, 3, 0)));
/* Rewrites the line at the bottom of the terminal, cut to its width; nothing where there is no terminal. */
void quern_log_progress(quern_log *, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
double quern_wall(void);      /* s, monotonic */
double quern_processor(void); /* s that this process has used, all threads together */
