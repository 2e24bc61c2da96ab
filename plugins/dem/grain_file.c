/* SPDX-License-Identifier: MIT */
/* grain_file - a table of grains: a header line of column names, then one line per grain; commas or blanks between */
#include "dem.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_COLUMNS = 16, MOST_BYTES = 1 << 30 };
static const char *const names[] = { "x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz", "radius", "fixed",
	"w", "material" };
enum { COLUMN_WZ = 8, COLUMN_RADIUS, COLUMN_FIXED, COLUMN_W, COLUMN_MATERIAL, N_NAMES };
/* By dimension, as bits: in the plane a grain turns about z alone, which may be called w. */
static const uint32_t unknown[] = { 1u << 2 | 1u << 5 | 1u << 6 | 1u << 7, 1u << COLUMN_W };

typedef struct {
	const char *at, *end;
	size_t line;
} cursor;

/* The next word of this line, or false at its end. What is too long is neither a number nor a name: it ends in "..". */
static bool word(cursor *c, char out[64]) {
	while (c->at < c->end && (*c->at == ' ' || *c->at == '\t' || *c->at == ',' || *c->at == '\r')) c->at++;
	size_t n = 0;
	while (c->at < c->end && !strchr(" \t,\r\n", *c->at) && *c->at) {
		if (n < 63) out[n++] = *c->at;
		else out[61] = out[62] = '.';
		c->at++;
	}
	out[n] = 0;
	return n > 0;
}

static bool holds_something(const cursor *c) {
	const char *p = c->at;
	while (p < c->end && (*p == ' ' || *p == '\t' || *p == '\r' || *p == ',')) p++;
	return p < c->end && *p != '\n' && *p != '#';
}

/* Goes to the next line that holds something; false at the end. Whatever a word does not take ends the line. */
static bool next_line(cursor *c) {
	for (;;) {
		while (c->at < c->end && *c->at != '\n') c->at++;
		if (c->at >= c->end) return false;
		c->at++;
		c->line++;
		if (holds_something(c)) return true;
	}
}

static bool header(cursor *c, uint32_t dim, int column[MOST_COLUMNS], int *n, char why[200]) {
	char text[64];
	uint32_t seen = 0;
	*n = 0;
	while (word(c, text)) {
		int k = 0;
		while (k < N_NAMES && strcmp(names[k], text) != 0) k++;
		if (k == N_NAMES || *n == MOST_COLUMNS || unknown[dim - 2] >> k & 1) {
			snprintf(why, 200, "line %zu: unknown column '%.40s'; known: %s radius fixed material", c->line,
				text, dim == 2 ? "x y vx vy w" : "x y z vx vy vz wx wy wz");
			return false;
		}
		k = dim == 2 && k == COLUMN_WZ ? COLUMN_W : k;
		if (seen & 1u << k) {
			snprintf(why, 200, "line %zu: column '%s' stands twice", c->line, text);
			return false;
		}
		seen |= 1u << k;
		column[(*n)++] = k;
	}
	const uint32_t wanted = dim == 2 ? 3u : 7u;
	if ((seen & wanted) == wanted) return true;
	snprintf(why, 200, "line %zu: the header must name %s", c->line, dim == 2 ? "x and y" : "x, y and z");
	return false;
}

static void put(dem_place *g, int column, double value) {
	if (column < 3) g->position[column] = value;
	else if (column < 6) g->velocity[column - 3] = value;
	else if (column < COLUMN_RADIUS) g->spin[column - 6] = value;
	else if (column == COLUMN_RADIUS) g->radius = value;
	else if (column == COLUMN_W) g->spin[0] = value;
	else g->fixed = value != 0;
}

static bool row(cursor *c, const dem *d, const int *column, int n, dem_place *g, char why[200]) {
	char text[64];
	*g = (dem_place) { .radius = NAN };
	for (int k = 0; k < n; k++) {
		char *end;
		if (!word(c, text)) {
			snprintf(why, 200, "line %zu: %d numbers are wanted, found %d", c->line, n, k);
			return false;
		}
		if (column[k] == COLUMN_MATERIAL) {
			g->kind = quern_dem_material(d, text);
			if (g->kind >= 0) continue;
			snprintf(why, 200, "line %zu: no material is called '%.40s'", c->line, text);
			return false;
		}
		const double value = strtod(text, &end);
		if (*end || !isfinite(value) || (column[k] == COLUMN_RADIUS && !(value > 0))) {
			snprintf(why, 200, "line %zu: column %s: '%.40s' is no %s", c->line, names[column[k]], text,
				column[k] == COLUMN_RADIUS ? "number above 0" : "number");
			return false;
		}
		put(g, column[k], value);
	}
	if (!word(c, text)) return true;
	snprintf(why, 200, "line %zu: more than %d numbers", c->line, n);
	return false;
}

bool quern_grain_table_read(const char *data, size_t length, const dem *d, grain_table *t, char why[200]) {
	cursor c = { data, data + length, 1 };
	int column[MOST_COLUMNS], n;
	if (length && !holds_something(&c) && !next_line(&c)) {
		snprintf(why, 200, "the table is empty");
		return false;
	}
	if (!header(&c, d->dim, column, &n, why)) return false;
	while (next_line(&c)) {
		if (t->n == t->cap) {
			const uint32_t cap = t->cap ? 2 * t->cap : 256;
			dem_place *grown = realloc(t->grain, cap * sizeof(dem_place));
			if (!grown) {
				snprintf(why, 200, "out of memory");
				return false;
			}
			t->grain = grown;
			t->cap = cap;
		}
		if (!row(&c, d, column, n, &t->grain[t->n], why)) return false;
		t->n++;
	}
	if (t->n) return true;
	snprintf(why, 200, "the table holds no grain");
	return false;
}

bool quern_grain_table_load(const char *path, const dem *d, grain_table *t, char why[200]) {
	FILE *file = fopen(path, "rb");
	char *data = NULL;
	size_t n = 0, cap = 0;
	if (!file) {
		snprintf(why, 200, "cannot be opened: %s", strerror(errno));
		return false;
	}
	for (;;) {
		if (n == cap) {
			cap = cap ? 2 * cap : 1 << 16;
			char *grown = cap > MOST_BYTES ? NULL : realloc(data, cap);
			if (!grown) break;
			data = grown;
		}
		const size_t got = fread(data + n, 1, cap - n, file);
		if (!got) break;
		n += got;
	}
	const bool whole = feof(file) && !ferror(file);
	fclose(file);
	bool good = false;
	if (whole) good = quern_grain_table_read(data, n, d, t, why);
	else snprintf(why, 200, "cannot be read: it is larger than 1 GiB, or reading fails");
	free(data);
	return good;
}

void quern_grain_table_finish(grain_table *t) {
	if (!t) return;
	free(t->grain);
	*t = (grain_table) { 0 };
}
