/* SPDX-License-Identifier: MIT */
/* loader - finds plugins by kind and name, maps exactly the object that is asked for, and never unmaps it; what the installed
 * solvers say of themselves is asked elsewhere, see catalogue.h */
#pragma once
#include "catalogue.h"
#include "report.h"

/* The ops of a plugin in the eyes of one caller. */
typedef struct quern_plugin_view {
	const quern_kind *kind;
	void *ops;
} quern_plugin_view;

/* A plugin as the host sees it: its tables are copies in the host's own layout, see table.h. */
typedef struct quern_plugin_file {
	char *path;
	uint64_t hash;                /* FNV-1a of the file */
	uintptr_t begin, end;         /* where it is mapped */
	int level;                    /* 1: any x86-64, 3: x86-64-v3, 4: x86-64-v4 */
	const quern_library *library; /* of the table, like what follows */
	quern_plugin plugin;          /* `revision` is the author's count of changes */
	const quern_param *params;
	const quern_use *uses;
	size_t n_params, n_uses;
	quern_plugin_view *views;
	size_t n_views, views_capacity;
	quern_table table;
} quern_plugin_file;

typedef struct quern_loader quern_loader;

/* Searches the folders of QUERN_PLUGIN_PATH, and then, for what none of them has, the program's own: "plugins" beside the
 * program, or else where it is installed. */
quern_loader *quern_loader_create(void);
void quern_loader_destroy(quern_loader *);

/* The highest instruction set (1, 3 or 4) that shall be taken, if the processor has it. */
void quern_loader_limit(quern_loader *, int level);
/* From now on a child loads every plugin and reads its tables first, so that one which crashes, hangs or ends the program
 * at that is one sentence. */
void quern_loader_beware(quern_loader *);
/* The same of one object by its path: false after one sentence. Nothing is loaded here. */
bool quern_loader_survives(const char *path, quern_report *, quern_mark);

/* The plugin of that kind and bare name, or NULL after one sentence in the report. */
const quern_plugin_file *quern_loader_find(
	quern_loader *, const char *kind, const char *name, quern_report *, quern_mark);
/* One object by its path, whatever its name; NULL after one sentence. */
const quern_plugin_file *quern_loader_open(quern_loader *, const char *path, quern_report *, quern_mark);

/* Its ops as a caller knows the kind, see quern_table_ops_for; NULL after one sentence. They and `kind` live as long as the
 * loader. */
const void *quern_loader_ops(
	quern_loader *, const quern_plugin_file *, const quern_kind *, quern_report *, quern_mark);

/* What the installed solvers say of themselves; asked once. */
const quern_catalogue *quern_loader_catalogue(quern_loader *);
/* A sentence for each solver that could not be asked. */
void quern_loader_report_unreadable(quern_loader *, quern_report *, quern_mark);
/* Whether any of its stages runs in a step. */
bool quern_solver_steps(const quern_solver_ops *);
/* A kind by its name, as whoever calls such plugins describes it; NULL if no installed solver does. */
const quern_kind *quern_loader_kind(quern_loader *, const char *name);
/* Whether plugins are looked for in this folder. */
bool quern_loader_searches(const quern_loader *, const char *folder);
/* The path of a file that lies among the plugins, such as a template; NULL if there is none; free() it. */
char *quern_loader_data(const quern_loader *, const char *name);
/* The words for which there is such a file, PREFIXwordSUFFIX, sorted; free with quern_loader_free_ids. */
char **quern_loader_words(const quern_loader *, const char *prefix, const char *suffix);

/* What is mapped so far, in the order of loading. */
size_t quern_loader_count(const quern_loader *);
const quern_plugin_file *quern_loader_at(const quern_loader *, size_t);

/* Every id in the search path, sorted, NULL-terminated; free with quern_loader_free_ids. Loads nothing. */
char **quern_loader_ids(const quern_loader *);
/* One sentence for every object there whose name begins with a word and is no id, so that nobody can ask for it. */
void quern_loader_report_strays(quern_loader *, quern_report *);
void quern_loader_free_ids(char **);

/* NAME of KIND.NAME; NULL if it is no id */
const char *quern_id_name(const char *id);
bool quern_id_is_of(const char *id, const char *kind);
/* "an axial vector"; NULL if there is no such shape */
const char *quern_shape_name(uint32_t shape);
