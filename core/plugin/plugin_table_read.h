/* SPDX-License-Identifier: MIT */
/* table_read - the parts of reading a table, shared by table.c and table_ops.c */
#pragma once
#include "plugin_table.h"

/* Most rows, choices and levels of a table; a table that goes on beyond them has lost its end. */
enum {
	QUERN_MOST_ROWS = 256,
	QUERN_MOST_CHOICES = 64,
	QUERN_MOST_DEPTH = 4,
	QUERN_LONGEST_NAME = 63,
	QUERN_LARGEST_INSTANCE = 1 << 24
};

typedef struct quern_table_reader {
	quern_table *table;
	quern_text *why;
	size_t rows; /* of parameters so far, over all lists */
} quern_table_reader;

/* False after "has a faulty table: ...". */
bool quern_table_refuse(quern_table_reader *, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
void *quern_table_keep(quern_table_reader *, size_t bytes); /* zeroed, owned by the table */
/* A text of at most `longest` bytes without control characters; NULL: true. */
bool quern_table_text(const char *text, size_t longest);
/* Rows of an instance or an item of `bytes`; `of` names them in messages. */
bool quern_table_params(quern_table_reader *, const char *of, const quern_param *rows, uint64_t bytes,
	uint32_t depth, quern_param **copy, size_t *n);
bool quern_table_uses(quern_table_reader *, const char *of, const quern_use *rows, size_t most,
	const quern_param *params, quern_use **copy, size_t *n);
/* Copies the ops of table->plugin, with what a solver or an observer hangs on them. */
bool quern_table_ops(quern_table_reader *, const void *ops);
