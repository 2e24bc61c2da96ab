/* SPDX-License-Identifier: MIT */
#include "report.h"
#include "text.h"
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

typedef enum { FAULT, FOLLOWS, WARNING } severity;

typedef struct {
	quern_mark mark;
	char *text;
	severity severity;
	size_t order;
} entry;

struct quern_report {
	entry *entries;
	size_t n, capacity, errors, follow;
};

quern_report *quern_report_create(void) { return quern_take(1, sizeof(quern_report)); }

void quern_report_destroy(quern_report *report) {
	if (!report) return;
	for (size_t i = 0; i < report->n; i++) free(report->entries[i].text);
	free(report->entries);
	free(report);
}

static void add(quern_report *report, quern_mark mark, severity kind, const char *fmt, va_list list) {
	quern_text text = { 0 };
	quern_text_addv(&text, fmt, list);
	report->entries = quern_grow(report->entries, report->n, &report->capacity, sizeof(entry));
	report->entries[report->n] = (entry) { mark, text.data ? text.data : quern_copy(""), kind, report->n };
	report->n++;
	report->errors += kind != WARNING;
	report->follow += kind == FOLLOWS;
}

void quern_report_add(quern_report *report, quern_mark mark, const char *fmt, ...) {
	va_list list;
	va_start(list, fmt);
	add(report, mark, FAULT, fmt, list);
	va_end(list);
}

void quern_report_follow(quern_report *report, quern_mark mark, const char *fmt, ...) {
	va_list list;
	va_start(list, fmt);
	add(report, mark, FOLLOWS, fmt, list);
	va_end(list);
}

void quern_report_warn(quern_report *report, quern_mark mark, const char *fmt, ...) {
	va_list list;
	va_start(list, fmt);
	add(report, mark, WARNING, fmt, list);
	va_end(list);
}

void quern_report_take(quern_report *report, quern_report *from) {
	for (size_t i = 0; i < from->n; i++) {
		report->entries = quern_grow(report->entries, report->n, &report->capacity, sizeof(entry));
		report->entries[report->n] = from->entries[i];
		report->entries[report->n].order = report->n;
		report->n++;
	}
	report->errors += from->errors;
	report->follow += from->follow;
	from->n = from->errors = from->follow = 0;
}

size_t quern_report_errors(const quern_report *report) { return report->errors; }

static int by_place(const void *pa, const void *pb) {
	const entry *a = pa, *b = pb;
	const int file = strcmp(a->mark.file ? a->mark.file : "", b->mark.file ? b->mark.file : "");
	if (file) return file;
	if (a->mark.line != b->mark.line) return a->mark.line < b->mark.line ? -1 : 1;
	if (a->mark.column != b->mark.column) return a->mark.column < b->mark.column ? -1 : 1;
	return a->order < b->order ? -1 : 1;
}

/* The file whose lines are shown, read from top to bottom once, since faults are sorted. */
typedef struct {
	FILE *file;
	const char *name;
	char *line;
	size_t size, number;
} source;

static bool go_to(source *s, quern_mark mark) {
	if (!s->name || strcmp(s->name, mark.file) != 0) {
		if (s->file) fclose(s->file);
		s->file = fopen(mark.file, "r");
		s->name = mark.file;
		s->number = 0;
	}
	while (s->file && s->number < mark.line) {
		if (getline(&s->line, &s->size, s->file) < 0) return false;
		s->number++;
	}
	return s->file != NULL;
}

/* Tabs are kept above the caret, so that it stands under the right letter. */
static void show_line(source *s, quern_mark mark, FILE *out) {
	if (!mark.line || !go_to(s, mark)) return;
	const size_t n = strcspn(s->line, "\n");
	if (n >= 400) return;
	fprintf(out, "  %.*s\n  ", (int)n, s->line);
	for (size_t i = 0; i + 1 < mark.column && i < n; i++) fputc(s->line[i] == '\t' ? '\t' : ' ', out);
	fputs("^\n", out);
}

size_t quern_report_print(const quern_report *report, FILE *out) {
	entry *sorted = quern_take(report->n, sizeof(entry));
	source file = { 0 };
	size_t faults = 0;
	if (report->n) memcpy(sorted, report->entries, report->n * sizeof(entry));
	qsort(sorted, report->n, sizeof(entry), by_place);
	for (size_t i = 0; i < report->n; i++) {
		const entry *e = &sorted[i];
		if (e->severity == FOLLOWS && report->errors > report->follow) continue;
		if (i && e->mark.line == e[-1].mark.line && e->mark.column == e[-1].mark.column &&
			!strcmp(e->text, e[-1].text))
			continue; /* an alias repeats its anchor's faults */
		if (e->mark.file) fprintf(out, "%s:", e->mark.file);
		if (e->mark.line) fprintf(out, "%zu:%zu:", e->mark.line, e->mark.column);
		fprintf(out, "%s%s: %s\n", e->mark.file ? " " : "", e->severity == WARNING ? "warning" : "error",
			e->text);
		show_line(&file, e->mark, out);
		faults += e->severity != WARNING;
	}
	if (file.file) fclose(file.file);
	free(file.line);
	free(sorted);
	return faults;
}
