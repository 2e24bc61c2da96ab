/* SPDX-License-Identifier: MIT */
/* report - every fault found in a scene, each with its place; printed together, in the order of the file */
#pragma once
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

/* A place in a scene or in an option of the command line. Lines and columns count from 1; 0: no place. */
typedef struct quern_mark {
	const char *file;
	size_t line, column;
} quern_mark;

typedef struct quern_report quern_report;

quern_report *quern_report_create(void);
void quern_report_destroy(quern_report *);

/* Adds one fault. A message says what was found and what is allowed, in one sentence without a full stop. */
void quern_report_add(quern_report *, quern_mark, const char *fmt, ...) __attribute__((format(printf, 3, 4)));
/* A fault that may follow from others: it counts as they do, and is printed only where there is no other. */
void quern_report_follow(quern_report *, quern_mark, const char *fmt, ...)
	__attribute__((format(printf, 3, 4)));
/* A hint that does not stop the run. */
void quern_report_warn(quern_report *, quern_mark, const char *fmt, ...)
	__attribute__((format(printf, 3, 4)));

size_t quern_report_errors(const quern_report *);
/* Takes over all that another one has. */
void quern_report_take(quern_report *, quern_report *from);
/* file:line:column: error: message, with the line and a caret below where the file can be read; returns how many faults
 * were shown */
size_t quern_report_print(const quern_report *, FILE *);
