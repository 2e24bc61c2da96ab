/* SPDX-License-Identifier: MIT */
/* quern new - a plugin of one's own, from a template that works */
#include "command.h"
#include "folder.h"
#include "loader.h"
#include "options.h"
#include "templates.h"
#include "text.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LONGEST_NAME = 48 };

/* ---- what is asked for ---- */

static bool is_plain(const char *name) {
	const size_t n = strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789_");
	return *name >= 'a' && *name <= 'z' && !name[n] && n <= LONGEST_NAME;
}

static int check_kind(const char *kind) {
	const char *names[32] = { NULL };
	size_t n = 0;
	quern_text all = { 0 };
	for (const quern_template *t = quern_templates; t->name && n < 31; t++) {
		if (strcmp(t->name + strlen(t->name) - 2, ".c") != 0) continue;
		char *name = quern_copy(t->name);
		name[strlen(name) - 2] = 0;
		names[n++] = name;
		quern_text_add(&all, "%s%s", all.length ? ", " : "", name);
	}
	int status = QUERN_EXIT_DONE;
	const char *near = quern_nearest(kind, names);
	if (near && !strcmp(near, kind)) near = NULL;
	else if (near)
		status = quern_usage(&quern_command_new, "unknown kind '%s'; did you mean '%s'?", kind, near);
	else
		status =
			quern_usage(&quern_command_new, "unknown kind '%s'; there are %s", kind, quern_text_string(&all));
	for (size_t i = 0; i < n; i++) free((void *)(uintptr_t)names[i]);
	quern_text_finish(&all);
	return status;
}

/* Two plugins of one kind and name would stand in each other's way as soon as both are on the search path. */
static int check_name(const char *kind, const char *name) {
	if (!is_plain(name))
		return quern_usage(&quern_command_new,
			"'%s' is no name: small letters, digits and underscores, a letter first", name);
	if (!strcmp(name, "v3") || !strcmp(name, "v4"))
		return quern_usage(&quern_command_new, "'%s' stands for an instruction set: take another name", name);
	quern_loader *loader = quern_loader_create();
	char **ids = quern_loader_ids(loader), *id = quern_format("%s.%s", kind, name);
	int status = QUERN_EXIT_DONE;
	for (size_t i = 0; ids[i]; i++)
		if (!strcmp(ids[i], id))
			status = quern_usage(&quern_command_new, "%s is installed already: take another name", id);
	free(id);
	quern_loader_free_ids(ids);
	quern_loader_destroy(loader);
	return status;
}

/* ---- files ---- */

static char *filled_in(const char *template, const char *kind, const char *name) {
	const quern_template *t = quern_templates;
	quern_text text = { 0 };
	while (t->name && strcmp(t->name, template) != 0) t++;
	for (const char *const *line = t->lines; line && *line; line++) {
		const char *rest = *line;
		for (const char *mark; (mark = strstr(rest, "my_")) != NULL; rest = mark) {
			const bool is_kind = !strncmp(mark, "my_kind", 7), is_name = !strncmp(mark, "my_name", 7);
			quern_text_add(&text, "%.*s%s", (int)(mark - rest), rest,
				is_kind   ? kind
				: is_name ? name
						  : "my_");
			mark += is_kind || is_name ? 7 : 3;
		}
		quern_text_add(&text, "%s\n", rest);
	}
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

static int write_all(const char *folder, const char *kind, const char *name) {
	char *template[3] = { quern_format("%s.c", kind), quern_copy("meson.build.txt"),
		quern_copy("README.md.txt") };
	char *path[3] = { quern_format("%s/%s.%s.c", folder, kind, name), quern_format("%s/meson.build", folder),
		quern_format("%s/README.md", folder) };
	int status = quern_folder_make(folder) ? QUERN_EXIT_DONE : refuse(folder);
	for (int k = 0; k < 3 && status == QUERN_EXIT_DONE; k++)
		if (!access(path[k], F_OK)) {
			fprintf(stderr, "quern new: %s is there already, and nothing was written\n", path[k]);
			status = QUERN_EXIT_IO;
		}
	for (int k = 0; k < 3; k++) {
		char *text = filled_in(template[k], kind, name);
		if (status == QUERN_EXIT_DONE) status = write_file(path[k], text);
		free(text);
		free(template[k]);
		free(path[k]);
	}
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
	status = check_kind(kind);
	if (status == QUERN_EXIT_DONE) status = check_name(kind, name);
	if (status != QUERN_EXIT_DONE) return status;
	char *folder = out ? quern_copy(out) : quern_format("%s.%s", kind, name);
	status = write_all(folder, kind, name);
	if (status == QUERN_EXIT_DONE) printf("\ncd %s && meson setup build && ninja -C build\n", folder);
	free(folder);
	return status;
}

const quern_command quern_command_new = { "new", "KIND NAME [-o DIR]", "a plugin of your own from a template",
	make_plugin };
