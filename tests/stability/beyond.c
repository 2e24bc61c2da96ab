/* SPDX-License-Identifier: MIT */
/* beyond - tables of what happened beyond a limit */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "beyond.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static FILE *page;
static bool longer;

bool beyond_begin(int argc, char **argv, const char *name) {
	const char *folder = NULL;
	for (int i = 1; i < argc; i++) {
		if (!strcmp(argv[i], "long")) longer = true;
		else if (!folder) folder = argv[i];
		else return false;
	}
	if (!folder) return true;
	char path[1024];
	snprintf(path, sizeof path, "%s/stability-%s.md", folder, name);
	page = fopen(path, "w");
	if (!page) return perror(path), false;
	const char *where = getenv("QUERN_PROVENANCE");
	fprintf(page, "<!-- written by tests/stability/%s.c: tools/stability -->\n", name);
	if (where && *where) fprintf(page, "\nMeasured on %s.\n", where);
	return true;
}

bool beyond_is_long(void) { return longer; }

static void put(const char *line) {
	printf("%s\n", line);
	if (page) fprintf(page, "%s\n", line);
}

void beyond_table(const char *title, const char *columns) {
	char rule[256] = "|";
	size_t n = 1;
	for (const char *c = columns; c; c = strchr(c + 1, '|'))
		if (n + 4 < sizeof rule) memcpy(rule + n, "---|", 5), n += 4;
	char line[1024];
	snprintf(line, sizeof line, "\n**%s**\n\n| %s |\n%s", title, columns, rule);
	put(line);
}

void beyond_row(const char *fmt, ...) {
	char cells[2048], line[2064];
	va_list list;
	va_start(list, fmt);
	vsnprintf(cells, sizeof cells, fmt, list);
	va_end(list);
	snprintf(line, sizeof line, "| %s |", cells);
	put(line);
}

void beyond_note(const char *fmt, ...) {
	char text[1024], line[1040];
	va_list list;
	va_start(list, fmt);
	vsnprintf(text, sizeof text, fmt, list);
	va_end(list);
	snprintf(line, sizeof line, "\n%s", text);
	put(line);
}

void beyond_end(void) {
	if (page) fclose(page);
	page = NULL;
}

const char *beyond_message(const quern_run *run) {
	return run->status == QUERN_OK ? "runs on" : run->message ? run->message : "stopped without a message";
}

void beyond_expect_culprit(const quern_run *run, const char *stage, const char *set) {
	if (run->status != QUERN_E_NUMERIC || !run->message || !strstr(run->message, stage) ||
		!strstr(run->message, set) || !strstr(run->message, "t = "))
		fail_msg("no failure of %s that names %s and a time: %s", stage, set, beyond_message(run));
}

void beyond_force_step(quern_run *run, double step) {
	run->scene->general.step = step;
	run->scene->general.force = true;
	quern_run_cut(run);
}
