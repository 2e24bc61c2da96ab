#include "log.h"
#include "text.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

struct quern_log {
	FILE *file;
	bool quiet, terminal, dirty;
	double shown;
};

double quern_wall(void) {
	struct timespec t;
	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

quern_log *quern_log_create(const char *path, bool quiet, bool append) {
	quern_log *log = quern_take(1, sizeof *log);
	log->file = path ? fopen(path, append ? "a" : "w") : NULL;
	log->quiet = quiet;
	log->terminal = !quiet && isatty(STDERR_FILENO);
	return log;
}

static void wipe(quern_log *log) {
	if (log->dirty) fputs("\r\033[K", stderr);
	log->dirty = false;
}

void quern_log_destroy(quern_log *log) {
	if (!log) return;
	wipe(log);
	if (log->file) fclose(log->file);
	free(log);
}

void quern_log_addv(quern_log *log, int level, const char *fmt, va_list list) {
	quern_text text = { 0 };
	const char *mark = level > 1 ? "warning: " : "";
	quern_text_addv(&text, fmt, list);
	if (log->file) {
		fprintf(log->file, "%s%s\n", mark, quern_text_string(&text));
		fflush(log->file);
	}
	if (level > 1 || (level == 1 && !log->quiet)) {
		wipe(log);
		fprintf(stderr, "%s%s\n", mark, quern_text_string(&text));
	}
	quern_text_finish(&text);
}

void quern_log_add(quern_log *log, int level, const char *fmt, ...) {
	va_list list;
	va_start(list, fmt);
	quern_log_addv(log, level, fmt, list);
	va_end(list);
}

bool quern_log_due(const quern_log *log) { return log->terminal && quern_wall() - log->shown > 0.5; }

void quern_log_progress(quern_log *log, bool now, const char *fmt, ...) {
	if (!log->terminal || (!now && !quern_log_due(log))) return;
	va_list list;
	va_start(list, fmt);
	fputs("\r\033[K", stderr);
	vfprintf(stderr, fmt, list);
	va_end(list);
	fflush(stderr);
	log->shown = quern_wall();
	log->dirty = true;
}
