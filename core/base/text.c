/* SPDX-License-Identifier: MIT */
#include "text.h"
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void out_of_memory(void) {
	fputs("quern: out of memory\n", stderr);
	fflush(NULL);
	_Exit(3); /* without what watches over plugins: whoever is being called has not ended the program */
}

void *quern_take(size_t count, size_t size) {
	void *memory = calloc(count ? count : 1, size ? size : 1);
	if (!memory) out_of_memory();
	return memory;
}

void *quern_grow(void *items, size_t n, size_t *capacity, size_t size) {
	if (n < *capacity) return items;
	size_t wanted = *capacity ? *capacity : 8;
	while (wanted <= n) wanted *= 2;
	void *grown = realloc(items, wanted * size);
	if (!grown) out_of_memory();
	memset((char *)grown + *capacity * size, 0, (wanted - *capacity) * size);
	*capacity = wanted;
	return grown;
}

void quern_text_finish(quern_text *text) {
	if (!text) return;
	free(text->data);
	*text = (quern_text) { 0 };
}

void quern_text_addv(quern_text *text, const char *fmt, va_list list) {
	va_list again;
	va_copy(again, list);
	const int n = vsnprintf(NULL, 0, fmt, again);
	va_end(again);
	if (n < 0) return;
	text->data = quern_grow(text->data, text->length + (size_t)n, &text->capacity, 1);
	vsnprintf(text->data + text->length, (size_t)n + 1, fmt, list);
	text->length += (size_t)n;
}

void quern_text_add(quern_text *text, const char *fmt, ...) {
	va_list list;
	va_start(list, fmt);
	quern_text_addv(text, fmt, list);
	va_end(list);
}

const char *quern_text_string(const quern_text *text) { return text->data ? text->data : ""; }

char *quern_format(const char *fmt, ...) {
	quern_text text = { 0 };
	va_list list;
	va_start(list, fmt);
	quern_text_addv(&text, fmt, list);
	va_end(list);
	return text.data ? text.data : quern_copy("");
}

char *quern_copy(const char *string) {
	const size_t n = strlen(string) + 1;
	return memcpy(quern_take(n, 1), string, n);
}

/* Optimal string alignment: insertions, deletions, substitutions and swaps of neighbours cost one. */
static size_t distance(const char *a, const char *b) {
	enum { LIMIT = 64 };
	const size_t n = strlen(a), m = strlen(b);
	if (n > LIMIT || m > LIMIT) return LIMIT;
	size_t row[3][LIMIT + 1];
	for (size_t j = 0; j <= m; j++) row[0][j] = j;
	for (size_t i = 1; i <= n; i++) {
		size_t *now = row[i % 3], *last = row[(i - 1) % 3], *older = row[(i + 1) % 3];
		now[0] = i;
		for (size_t j = 1; j <= m; j++) {
			const bool same = tolower((unsigned char)a[i - 1]) == tolower((unsigned char)b[j - 1]);
			size_t best = last[j - 1] + !same;
			if (last[j] + 1 < best) best = last[j] + 1;
			if (now[j - 1] + 1 < best) best = now[j - 1] + 1;
			if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] && older[j - 2] + 1 < best)
				best = older[j - 2] + 1;
			now[j] = best;
		}
	}
	return row[n % 3][m];
}

const char *quern_nearest(const char *name, const char *const *known) {
	const char *best = NULL;
	size_t least = strlen(name) / 3 + 2;
	for (; *known; known++) {
		const size_t d = distance(name, *known);
		if (d < least) least = d, best = *known;
	}
	if (best || strlen(name) < 3) return best;
	return NULL;
}

void quern_number(double value, char out[32]) {
	if (value == trunc(value) && fabs(value) < 1e15) {
		snprintf(out, 32, "%.0f", value == 0 ? 0 : value);
		return;
	}
	for (int digits = 1; digits <= 17; digits++) {
		snprintf(out, 32, "%.*g", digits, value);
		if (strtod(out, NULL) == value || isnan(value)) return;
	}
}

bool quern_is_name(const char *name) {
	if (!isalpha((unsigned char)name[0])) return false;
	for (; *name; name++)
		if (!isalnum((unsigned char)*name) && *name != '_') return false;
	return true;
}

bool quern_same_head(const char *a, const char *b) {
	const size_t n = strcspn(a, ".");
	return n == strcspn(b, ".") && !strncmp(a, b, n);
}
