/* SPDX-License-Identifier: MIT */
/* text - growing strings, and the nearest known name to a misspelt one */
#pragma once
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>

/* A string that grows; zero-initialised is empty and valid. */
typedef struct quern_text {
	char *data; /* NUL-terminated once anything was added; NULL before */
	size_t length, capacity;
} quern_text;

void quern_text_finish(quern_text *);
void quern_text_add(quern_text *, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
void quern_text_addv(quern_text *, const char *fmt, va_list) __attribute__((format(printf, 2, 0)));
/* "" if nothing was added */
const char *quern_text_string(const quern_text *);

/* Texts, and small structures of the set-up phase: where there is no memory for these, the program ends with a message
 * and status 3, the only place where the library does so. What grows with a scene or a file reports instead. */

/* malloc'ed printf; never NULL */
char *quern_format(const char *fmt, ...) __attribute__((format(printf, 1, 2)));
char *quern_copy(const char *);

/* zeroed memory, never NULL */
void *quern_take(size_t count, size_t size);
/* grows `*items` so that entry n exists; capacity doubles */
void *quern_grow(void *items, size_t n, size_t *capacity, size_t size);

/* The entry of `known` (NULL-terminated) that is most like `name`, or NULL if none is close. */
const char *quern_nearest(const char *name, const char *const *known);

/* The shortest decimal text that reads back as the same double. */
void quern_number(double value, char out[32]);

/* true if `name` is letters, digits and underscores, starting with a letter */
bool quern_is_name(const char *name);

/* true if the first parts of two dotted names are one: "time.end", "time" */
bool quern_same_head(const char *a, const char *b);
