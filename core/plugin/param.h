/* SPDX-License-Identifier: MIT */
/* param - from the rows of a plugin's table to its instance and back */
#pragma once
#include "quantity.h"
#include "report.h"
#include "tree.h"
#include <quern/abi.h>

/* A published number that rows with `from` take as their default. */
typedef struct quern_published {
	const char *name, *unit;
	double value;
} quern_published;

typedef struct quern_reading {
	quern_report *report;
	quern_units *units;
	uint32_t dim;
	const quern_published *published;
	size_t n_published;
	quern_tree *tree; /* keeps the paths of files; NULL: files are taken as they are written */
} quern_reading;

/* Fills `instance` from `map` (NULL or null: defaults alone). `owner` names the plugin in messages, `mark` is
 * where it stands. Keys that `rows` do not know are faults unless they are in `also` (full dotted names,
 * NULL-terminated, may be NULL). Lists are allocated; quern_params_finish frees them. */
void quern_params_read(const quern_reading *, const char *owner, const quern_param *rows,
	const quern_node *map, quern_mark mark, const char *const *also, void *instance);
/* The check for unknown keys alone. */
void quern_params_check(const quern_reading *, const char *owner, const quern_param *rows,
	const quern_node *map, const char *const *also);
void quern_params_finish(const quern_param *rows, void *instance);

/* What a file that a parameter names is called in what is written: malloc'ed. */
typedef struct quern_naming {
	char *(*name)(void *context, const char *path);
	void *context;
} quern_naming;
/* Writes every value of the instance into a map, in SI. A number that is not finite is left out: no scene can give one,
 * so that it stands for what the plugin makes of a missing value. `naming` NULL: files are called what they are. */
void quern_params_write(
	const quern_param *rows, const void *instance, uint32_t dim, const quern_naming *, quern_node *map);

/* The row that may stand for a whole item of a list, which has no other but the one that takes a map's keys; or NULL. */
const quern_param *quern_param_bare(const quern_param *list);
/* The path of the file that a scene's value names; malloc'ed. */
char *quern_param_path(const quern_node *);
const quern_param *quern_param_find(const quern_param *rows, const char *name);
/* the value of a number, bool or choice; NaN for other types */
double quern_param_number(const quern_param *, const void *instance);
double quern_param_default(const quern_param *, uint32_t dim);
/* "between 0 and 1", "above 0", "" */
void quern_param_range(const quern_param *, char out[96]);

/* Where a dotted name stands ("list.0.key"), or as much of it as there is; else `fallback`. */
quern_mark quern_param_mark(const quern_node *map, const char *name, quern_mark fallback);
