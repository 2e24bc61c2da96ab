/* SPDX-License-Identifier: MIT */
/* quern new - a plugin of one's own, from the template of its kind, a file among the plugins */
#include "command.h"
#include "folder.h"
#include "loader.h"
#include "options.h"
#include "text.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { LONGEST_NAME = 48, LARGEST = 1 << 20 };

/* ---- what is asked for ---- */

static bool is_plain(const char *name) {
	const size_t n = strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789_");
	return *name >= 'a' && *name <= 'z' && !name[n] && n <= LONGEST_NAME;
}

static int check_kind(const quern_loader *loader, const char *kind) {
	char **kinds = quern_loader_words(loader, "template.", ".c");
	quern_text all = { 0 };
	int status = QUERN_EXIT_DONE;
	for (size_t i = 0; kinds[i]; i++) quern_text_add(&all, "%s%s", i ? ", " : "", kinds[i]);
	const char *near = quern_nearest(kind, (const char *const *)kinds);
	if (near && strcmp(near, kind) != 0)
		status = quern_usage(&quern_command_new, "unknown kind '%s'; did you mean '%s'?", kind, near);
	else if (!near)
		status =
			quern_usage(&quern_command_new, "unknown kind '%s'; there are %s", kind, quern_text_string(&all));
	quern_loader_free_ids(kinds);
	quern_text_finish(&all);
	return status;
}

/* Two plugins of one kind and name would stand in each other's way as soon as both are on the search path. */
static int check_name(const quern_loader *loader, const char *kind, const char *name) {
	if (!is_plain(name))
		return quern_usage(&quern_command_new,
			"'%s' is no name: small letters, digits and underscores, a letter first", name);
	if (!strcmp(name, "v3") || !strcmp(name, "v4"))
		return quern_usage(&quern_command_new, "'%s' stands for an instruction set: take another name", name);
	char **ids = quern_loader_ids(loader), *id = quern_format("%s.%s", kind, name);
	int status = QUERN_EXIT_DONE;
	for (size_t i = 0; ids[i]; i++)
		if (!strcmp(ids[i], id))
			status = quern_usage(&quern_command_new, "%s is installed already: take another name", id);
	free(id);
	quern_loader_free_ids(ids);
	return status;
}

/* ---- files ---- */

/* The file as a text; NULL after a sentence. */
static char *read_template(const quern_loader *loader, const char *name) {
	char *path = quern_loader_data(loader, name), *text = NULL;
	FILE *file = path ? fopen(path, "rb") : NULL;
	struct stat is;
	if (file && !fstat(fileno(file), &is) && is.st_size < LARGEST) {
		text = quern_take((size_t)is.st_size + 1, 1);
		text[fread(text, 1, (size_t)is.st_size, file)] = 0;
	} else
		fprintf(
			stderr, "quern new: %s cannot be read; is the program beside its plugins?\n", path ? path : name);
	if (file) fclose(file);
	free(path);
	return text;
}

/* With the kind and the name in place of the words that stand for them. */
static char *filled_in(const char *template, const char *kind, const char *name) {
	quern_text text = { 0 };
	const char *rest = template;
	for (const char *mark; (mark = strstr(rest, "my_")) != NULL; rest = mark) {
		const bool is_kind = !strncmp(mark, "my_kind", 7), is_name = !strncmp(mark, "my_name", 7);
		quern_text_add(&text, "%.*s%s", (int)(mark - rest), rest, is_kind ? kind : is_name ? name : "my_");
		mark += is_kind || is_name ? 7 : 3;
	}
	quern_text_add(&text, "%s", rest);
	return text.data;
}

static int refuse(const char *path) {
	fprintf(stderr, "quern new: %s cannot be written: %s\n", path, strerror(errno));
	return QUERN_EXIT_IO;
}

/* Never into a file that is there. */
static int write_file(const char *path, const char *text) {
	const int fd = open(path, O_WRONLY | O_CREAT | O_EXCL, 0666);
	const size_t length = strlen(text);
	if (fd < 0) return refuse(path);
	const ssize_t n = write(fd, text, length);
	if (close(fd) || n != (ssize_t)length) return refuse(path);
	puts(path);
	return QUERN_EXIT_DONE;
}

enum { FILES = 3 };

static int write_files(const char *folder, const char *const *name, char *const *text) {
	char *path[FILES];
	int status = quern_folder_make(folder) ? QUERN_EXIT_DONE : refuse(folder);
	for (int k = 0; k < FILES; k++) path[k] = quern_format("%s/%s", folder, name[k]);
	for (int k = 0; k < FILES && status == QUERN_EXIT_DONE; k++)
		if (!access(path[k], F_OK)) {
			fprintf(stderr, "quern new: %s is there already, and nothing was written\n", path[k]);
			status = QUERN_EXIT_IO;
		}
	for (int k = 0; k < FILES; k++) {
		if (status == QUERN_EXIT_DONE) status = write_file(path[k], text[k]);
		free(path[k]);
	}
	return status;
}

static int write_all(const quern_loader *loader, const char *folder, const char *kind, const char *name) {
	char *template = quern_format("template.%s.c", kind), *source = quern_format("%s.%s.c", kind, name);
	const char *const from[FILES] = { template, "template.meson.build.txt", "template.README.md.txt" };
	const char *const to[FILES] = { source, "meson.build", "README.md" };
	char *text[FILES] = { NULL };
	bool good = true;
	for (int k = 0; k < FILES && good; k++) {
		char *raw = read_template(loader, from[k]);
		good = raw != NULL;
		if (good) text[k] = filled_in(raw, kind, name);
		free(raw);
	}
	const int status = good ? write_files(folder, to, text) : QUERN_EXIT_IO;
	for (int k = 0; k < FILES; k++) free(text[k]);
	free(template);
	free(source);
	return status;
}

static int make_plugin(int argc, char **argv) {
	const char *out = NULL;
	quern_words words = { .missing = "a kind and a name are missing", .least = 2, .most = 2 };
	const quern_option options[] = {
		QUERN_TEXT(&out, 'o', "output", "DIR", "the folder to make; default: KIND.NAME"), QUERN_END_OPTIONS
	};
	int status = quern_options_read(&quern_command_new, options, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return status;
	const char *kind = words.at[0], *name = words.at[1];
	char *folder = out ? quern_copy(out) : quern_format("%s.%s", kind, name);
	quern_loader *loader = quern_loader_create();
	status = check_kind(loader, kind);
	if (status == QUERN_EXIT_DONE) status = check_name(loader, kind, name);
	if (status == QUERN_EXIT_DONE) status = write_all(loader, folder, kind, name);
	if (status == QUERN_EXIT_DONE) printf("\ncd %s && meson setup build && ninja -C build\n", folder);
	quern_loader_destroy(loader);
	free(folder);
	return status;
}

const quern_command quern_command_new = { "new", "KIND NAME [-o DIR]", "a plugin of your own from a template",
	make_plugin };
