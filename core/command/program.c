/* SPDX-License-Identifier: MIT */
/* programs beside quern - quern-WORD does `quern WORD` */
#include "command.h"
#include "config.h"
#include "platform.h"
#include "text.h"
#include <dirent.h>
#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- what all of them say ---- */

void quern_print_usage(const quern_command *command, FILE *out) {
	fprintf(out, "usage: quern %s %s", command->name, command->arguments);
}

int quern_usage(const quern_command *command, const char *fmt, ...) {
	va_list list;
	va_start(list, fmt);
	fprintf(stderr, "quern %s: ", command->name);
	vfprintf(stderr, fmt, list);
	va_end(list);
	fputc('\n', stderr);
	quern_print_usage(command, stderr);
	fprintf(stderr, "; see quern %s --help\n", command->name);
	return QUERN_EXIT_USAGE;
}

int quern_ended(int status) {
	if (!fflush(stdout) && !ferror(stdout)) return status;
	fprintf(stderr, "quern: error: the output cannot be written: %s\n", strerror(errno));
	return status == QUERN_EXIT_DONE ? QUERN_EXIT_IO : status;
}

/* ---- where they are ---- */

static const char prefix[] = "quern-";

/* Built in place, beside quern; installed, where the build was told. */
static char *folder_of(int k) {
	char *exe = quern_platform_program();
	if (!exe) return NULL;
	char *slash = strrchr(exe, '/');
	if (slash) *slash = 0;
	char *folder = k == 0 ? quern_copy(exe) : quern_format("%s/%s", exe, QUERN_PROGRAMS_FROM_BIN);
	free(exe);
	return folder;
}

static char *program_in(const char *folder, size_t length, const char *word) {
	char *path = quern_format("%.*s/%s%s", (int)length, folder, prefix, word);
	if (!access(path, X_OK)) return path;
	free(path);
	return NULL;
}

char *quern_program_find(const char *word) {
	char *found = NULL;
	if (!quern_is_name(word)) return NULL;
	for (int k = 0; k < 2 && !found; k++) {
		char *folder = folder_of(k);
		if (folder) found = program_in(folder, strlen(folder), word);
		free(folder);
	}
	for (const char *path = getenv("PATH"); path && !found;) {
		const size_t n = strcspn(path, ":");
		if (n) found = program_in(path, n, word);
		path = path[n] ? path + n + 1 : NULL;
	}
	return found;
}

static int by_name(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

char **quern_program_words(void) {
	char **words = NULL;
	size_t n = 0, capacity = 0;
	for (int k = 0; k < 2; k++) {
		char *folder = folder_of(k);
		DIR *dir = folder ? opendir(folder) : NULL;
		for (struct dirent *entry; dir && (entry = readdir(dir));) {
			const char *word = entry->d_name + sizeof prefix - 1;
			char *path = !strncmp(entry->d_name, prefix, sizeof prefix - 1) && quern_is_name(word)
							 ? program_in(folder, strlen(folder), word)
							 : NULL;
			if (!path) continue;
			free(path);
			words = quern_grow(words, n, &capacity, sizeof *words);
			words[n++] = quern_copy(word);
		}
		if (dir) closedir(dir);
		free(folder);
	}
	words = quern_grow(words, n, &capacity, sizeof *words);
	words[n] = NULL;
	qsort(words, n, sizeof *words, by_name); // a folder lists them in any order
	return words;
}
