/* SPDX-License-Identifier: MIT */
/* catalogue - what the installed solvers say of themselves: sections, sets, kinds. Asked in a child, so that no object is mapped
 * here for it, and none that crashes, hangs or changes arithmetic at its start does any harm. */
#pragma once
#include "plugin_table.h"

/* A solver, the section that it reads by itself, and the sets that it makes. */
typedef struct quern_section_of {
	char *section; /* NULL: it reads sections that name it, and no other */
	char *solver;
	char **sets;
	size_t n_sets;
	bool steps; /* it has something to do in a step */
} quern_section_of;

/* A solver that cannot be asked. */
typedef struct quern_unreadable {
	char *solver, *why; /* "plugin FILE has a faulty table: ..." */
} quern_unreadable;

typedef struct quern_catalogue {
	quern_section_of *solvers; /* sorted by section, then by name; those without a section come first */
	size_t n_solvers, solvers_capacity;
	quern_kind **kinds; /* that they call; all that hangs on one is in its own memory */
	size_t n_kinds, kinds_capacity;
	quern_unreadable *unreadable;
	size_t n_unreadable, unreadable_capacity;
} quern_catalogue;

/* The solvers of these ids, each in the object at `path`. */
void quern_catalogue_ask(quern_catalogue *, char *const *ids, char *const *paths, size_t n);
void quern_catalogue_finish(quern_catalogue *);
/* NULL if no solver calls such plugins. */
const quern_kind *quern_catalogue_kind(const quern_catalogue *, const char *name);
