/* SPDX-License-Identifier: MIT */
/* table - what a plugin says of itself, asked once, when it is loaded, and copied into the host's own layout
 *
 * Rows are read with the plugin's strides and ops by their size, so that a plugin built with an older, shorter header is
 * taken: what it does not know is zero. Nothing that the plugin has written is indexed, called or read as a text before
 * it was looked at here. Where a pointer leads cannot be asked: that takes a child, see child.h. */
#pragma once
#include "text.h"
#include <quern/check.h>
#include <quern/observer.h>
#include <quern/solver.h>

/* Most sums that the account of a solver may give, and that all of them may give together. */
enum { QUERN_MOST_SUMS = 64 };

/* The copies; all of them belong to `owned`. */
typedef struct quern_table {
	quern_library library; /* texts that are missing are "" */
	quern_plugin plugin;   /* params and uses are copies; ops too, of kinds that the program itself calls */
	char kind[24];         /* the first word of its id */
	quern_param *params;
	quern_use *uses;
	size_t n_params, n_uses;
	void **owned;
	size_t n_owned, capacity;
} quern_table;

/* Reads all that hangs on the library. False after one sentence in `why` that begins with a verb: "has no ..."; what was
 * copied so far is then to be finished all the same. */
bool quern_table_read(quern_table *, const quern_library *, quern_text *why);
void quern_table_finish(quern_table *);

/* The uses as a plugin of that library reads them, with its stride: a solver looks at those of the plugins in its slots.
 * free() it. */
quern_use *quern_table_uses_for(const quern_table *, const quern_library *reader);

/* The ops as a caller who knows the kind so far reads them: what an older plugin lacks is zero. Every function that the kind
 * requires for the plugin's dimensions is there. NULL after "has a faulty table: ..."; free() it. */
void *quern_table_ops_for(const quern_table *, const quern_kind *, quern_text *why);
