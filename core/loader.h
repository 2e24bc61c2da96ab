/* loader - finds plugins by kind and name, maps exactly the object that is asked for, and never unmaps it */
#pragma once
#include "report.h"
#include <quern/abi.h>

/* A plugin as the host sees it: tables copied with the plugin's own strides, so that rows may grow. */
typedef struct quern_plugin_file {
	char *path;
	uint64_t hash; /* FNV-1a of the file */
	int level;     /* 1: any x86-64, 3: x86-64-v3, 4: x86-64-v4 */
	const quern_library *library;
	quern_plugin plugin; /* params and uses point to the copies */
	quern_param *params;
	quern_use *uses;
	size_t n_params, n_uses;
} quern_plugin_file;

typedef struct quern_loader quern_loader;

/* Searches the folders of QUERN_PLUGIN_PATH, then "plugins" beside the program, then the installed folder. */
quern_loader *quern_loader_create(void);
void quern_loader_destroy(quern_loader *);

/* The best instruction set of this processor (1, 3 or 4), and the highest that shall be taken. */
int quern_loader_best_level(void);
void quern_loader_limit(quern_loader *, int level);

/* The plugin of that kind and bare name, or NULL after one sentence in the report. */
const quern_plugin_file *quern_loader_find(
	quern_loader *, quern_kind, const char *name, quern_report *, quern_mark);
/* One object by its path, whatever its name; NULL after one sentence. */
const quern_plugin_file *quern_loader_open(quern_loader *, const char *path, quern_report *, quern_mark);

/* What is mapped so far, in the order of loading. */
size_t quern_loader_count(const quern_loader *);
const quern_plugin_file *quern_loader_at(const quern_loader *, size_t);

/* Every id in the search path, sorted, NULL-terminated; free with quern_loader_free_ids. Loads nothing. */
char **quern_loader_ids(const quern_loader *);
void quern_loader_free_ids(char **);

/* "contact"; NULL if there is no such kind */
const char *quern_kind_name(uint32_t kind);
uint32_t quern_kind_of(const char *name);    /* 0: none */
extern const char *const quern_kind_names[]; /* NULL-terminated, without the zeroth */
