/* SPDX-License-Identifier: MIT */
#include "log.h"
#include "text.h"
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

struct quern_log {
	FILE *file;
	quern_text kept; /* lines from before there was a file */
	int fault, warnings;
	bool quiet, verbose, terminal, dirty;
};

static double seconds_of(clockid_t clock) {
	struct timespec t;
	clock_gettime(clock, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double quern_wall(void) { return seconds_of(CLOCK_MONOTONIC); }
double quern_processor(void) { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }

quern_log *quern_log_create(bool quiet, bool verbose) {
	quern_log *log = quern_take(1, sizeof *log);
	log->quiet = quiet;
	log->verbose = verbose;
	log->terminal = !quiet && isatty(STDERR_FILENO);
	return log;
}

static void note_fault(quern_log *log, bool failed) {
	if (failed && !log->fault) log->fault = errno ? errno : EIO;
}

int quern_log_fault(const quern_log *log) { return log->fault; }
int quern_log_warnings(const quern_log *log) { return log->warnings; }

static void put(quern_log *log, const char *line) {
	if (!log->file) quern_text_add(&log->kept, "%s", line);
	else note_fault(log, fputs(line, log->file) < 0 || fflush(log->file));
}

void quern_log_open(quern_log *log, const char *path, bool append) {
	log->file = fopen(path, append ? "a" : "w");
	note_fault(log, !log->file);
	if (log->file) put(log, quern_text_string(&log->kept));
	quern_text_finish(&log->kept);
}

static void wipe(quern_log *log) {
	if (log->dirty) fputs("\r\033[K", stderr);
	log->dirty = false;
}

void quern_log_destroy(quern_log *log) {
	if (!log) return;
	wipe(log);
	if (log->file) fclose(log->file);
	quern_text_finish(&log->kept);
	free(log);
}

void quern_log_addv(quern_log *log, int level, const char *fmt, va_list list) {
	if (level < 0 && !log->verbose) return;
	quern_text text = { 0 };
	const char *mark = level > 1 ? "warning: " : "";
	log->warnings += level > 1;
	quern_text_add(&text, "%s", mark);
	quern_text_addv(&text, fmt, list);
	quern_text_add(&text, "\n");
	put(log, text.data);
	if (level > 1 || (level == 1 && !log->quiet)) {
		wipe(log);
		fputs(text.data, stderr);
	}
	quern_text_finish(&text);
}

void quern_log_add(quern_log *log, int level, const char *fmt, ...) {
	va_list list;
	va_start(list, fmt);
	quern_log_addv(log, level, fmt, list);
	va_end(list);
}

/* Columns of the terminal, which a line that is written anew must not pass. */
static int width(void) {
	struct winsize size = { 0 };
	return !ioctl(STDERR_FILENO, TIOCGWINSZ, &size) && size.ws_col > 1 ? size.ws_col - 1 : 159;
}

void quern_log_progress(quern_log *log, const char *fmt, ...) {
	if (!log->terminal) return;
	quern_text line = { 0 };
	va_list list;
	va_start(list, fmt);
	quern_text_addv(&line, fmt, list);
	va_end(list);
	fprintf(stderr, "\r\033[K%.*s", width(), quern_text_string(&line));
	fflush(stderr);
	quern_text_finish(&line);
	log->dirty = true;
}
