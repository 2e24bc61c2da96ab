/* SPDX-License-Identifier: MIT */
/* text - a scene's text written piece by piece */
#pragma once
#include <assert.h>
#include <stdarg.h>
#include <stdio.h>

typedef struct text {
	size_t length;
	char data[1 << 16];
} text;

__attribute__((format(printf, 2, 3))) static inline void text_add(text *t, const char *fmt, ...) {
	va_list list;
	va_start(list, fmt);
	const int n = vsnprintf(t->data + t->length, sizeof t->data - t->length, fmt, list);
	va_end(list);
	assert(n >= 0 && (size_t)n < sizeof t->data - t->length);
	t->length += (size_t)n;
}
