/* SPDX-License-Identifier: MIT */
/* drive_table - a path from a table: way points over time */
#include "drive.h"
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_COLUMNS = 16, MOST_WORD = 64 };
static const double most_value = 1e30;

/* What a column says: of a component its strain, slide or stress; or the time, or the mean pressure. */
typedef enum { TIME, PRESSURE, STRAIN, SLIDE, STRESS } meaning;
static const struct {
	const char *name, *unit;
} words[] = { { "time", "s" }, { "pressure", "Pa" }, { "strain_", "1" }, { "shear_", "1" },
	{ "stress_", "Pa" } };

typedef struct {
	meaning what;
	uint32_t component;
	char name[MOST_WORD];
} column;

typedef struct {
	const char *at, *end;
	size_t line;
	column column[MOST_COLUMNS];
	uint32_t n, dim;
	quern_text *why;
} reader;

static bool fault(reader *r, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
static bool fault(reader *r, const char *fmt, ...) {
	va_list list;
	quern_text_add(r->why, "line %zu: ", r->line);
	va_start(list, fmt);
	quern_text_addv(r->why, fmt, list);
	va_end(list);
	return false;
}

/* ---- lines and words ---- */

/* The next line that holds something, without what # begins; false at the end. */
static bool next_line(reader *r, const char **begin, const char **end) {
	while (r->at < r->end) {
		const char *stop = memchr(r->at, '\n', (size_t)(r->end - r->at));
		if (!stop) stop = r->end;
		const char *from = r->at, *hash = memchr(from, '#', (size_t)(stop - from)), *to = hash ? hash : stop;
		r->at = stop < r->end ? stop + 1 : stop;
		r->line++;
		while (from < to && strchr(" \t\r", *from) && *from) from++;
		if (from == to) continue;
		*begin = from, *end = to;
		return true;
	}
	return false;
}

/* Up to the next comma, without blanks around; false if there is none left. One that is too long ends in dots, as no name or number does. */
static bool next_word(const char **at, const char *end, char out[MOST_WORD]) {
	if (!*at) return false;
	const char *stop = memchr(*at, ',', (size_t)(end - *at)), *from = *at, *to = stop ? stop : end;
	*at = stop ? stop + 1 : NULL;
	while (from < to && strchr(" \t\r", *from) && *from) from++;
	while (to > from && strchr(" \t\r", to[-1]) && to[-1]) to--;
	const size_t n = (size_t)(to - from) < MOST_WORD - 1 ? (size_t)(to - from) : MOST_WORD - 1;
	for (size_t k = 0; k < n; k++) out[k] = from[k] >= ' ' && from[k] < 127 ? from[k] : '?';
	out[n] = 0;
	if ((size_t)(to - from) > n) memcpy(out + n - 3, "...", 3);
	return true;
}

/* ---- the line of names ---- */

static bool name_component(reader *r, column *c) {
	const char *which = strchr(c->name, '_') + 1;
	for (c->component = 0; c->component < quern_drive_components(r->dim); c->component++)
		if (!strcmp(quern_drive_component(r->dim, c->component), which)) return true;
	return false;
}

/* "stress_xx", or "stress_xx [Pa]" as what this program writes. */
static bool name_column(reader *r, char *text, column *c) {
	char *unit = strstr(text, " [");
	if (unit) *unit = 0, unit += 2;
	const size_t n = unit ? strlen(unit) : 0;
	snprintf(c->name, sizeof c->name, "%s", text);
	for (size_t k = 0; k < sizeof words / sizeof *words; k++) {
		const size_t length = strlen(words[k].name);
		const bool whole = words[k].name[length - 1] != '_';
		if (whole ? strcmp(words[k].name, text) != 0 : strncmp(words[k].name, text, length) != 0) continue;
		c->what = (meaning)k;
		if (!whole && !name_component(r, c)) break;
		if (c->what == SLIDE && c->component < r->dim) break;
		if (unit && (n < 2 || strlen(words[k].unit) != n - 1 || memcmp(unit, words[k].unit, n - 1) != 0))
			return fault(r, "column '%s' is in %s, not in [%s", c->name, words[k].unit, unit);
		return true;
	}
	return fault(r,
		"unknown column '%s'; known in %u-D: time, pressure, strain_xx and the others of the strain, shear_%s and the other "
		"slides, stress_xx and the others of the stress",
		c->name, r->dim, r->dim == 2 ? "xy" : "xz");
}

static bool read_names(reader *r) {
	const char *at, *end;
	char text[MOST_WORD];
	if (!next_line(r, &at, &end)) return quern_text_add(r->why, "there is nothing in it"), false;
	while (next_word(&at, end, text)) {
		if (r->n == MOST_COLUMNS) return fault(r, "there are more than %d columns", MOST_COLUMNS);
		column *c = &r->column[r->n];
		if (!name_column(r, text, c)) return false;
		for (uint32_t k = 0; k < r->n; k++)
			if (r->column[k].what >= STRAIN && c->what >= STRAIN && r->column[k].component == c->component)
				return fault(r, "columns '%s' and '%s' both give component %s", r->column[k].name, c->name,
					quern_drive_component(r->dim, c->component));
			else if (r->column[k].what == c->what && c->what < STRAIN)
				return fault(r, "column '%s' stands twice", c->name);
		r->n++;
	}
	return true;
}

static bool set_controls(reader *r, drive_path *p) {
	bool time = false, named[DRIVE_MOST_COMPONENTS] = { false }, left = false;
	for (uint32_t k = 0; k < r->n; k++) {
		const column *c = &r->column[k];
		if (c->what == TIME) time = true;
		else if (c->what == PRESSURE) p->pressed = true;
		else {
			p->control[c->component] = c->what == STRESS ? DRIVE_STRESS : DRIVE_STRAIN;
			p->slide[c->component] = c->what == SLIDE;
			named[c->component] = true;
		}
	}
	if (!time) return fault(r, "there is no column 'time'");
	if (r->n < 2) return fault(r, "there is no column beside 'time'");
	for (uint32_t c = 0; c < p->dim && p->pressed; c++)
		if (!named[c]) p->control[c] = DRIVE_ALIKE, left = true;
	if (p->pressed && !left)
		return fault(r, "beside 'pressure' one of the normal components at least must stand in no column");
	return true;
}

/* ---- the others ---- */

static bool read_number(reader *r, const column *c, const char *text, double *value) {
	char *end;
	*value = strtod(text, &end);
	if (end == text || *end) return fault(r, "column '%s': '%s' is no number", c->name, text);
	if (!isfinite(*value) || fabs(*value) > most_value)
		return fault(r, "column '%s': '%s' is no finite number below %g", c->name, text, most_value);
	return true;
}

static bool read_row(reader *r, const char *at, const char *end, drive_leg *leg) {
	char text[MOST_WORD];
	uint32_t k = 0;
	double value;
	for (; next_word(&at, end, text); k++) {
		if (k >= r->n) return fault(r, "there are more words than the %u columns", r->n);
		const column *c = &r->column[k];
		if (!read_number(r, c, text, &value)) return false;
		if (c->what == TIME) leg->time = value;
		else if (c->what == PRESSURE) leg->pressure = value;
		else leg->target[c->component] = value;
	}
	return k == r->n || fault(r, "there are %u words, and %u columns", k, r->n);
}

/* The row of time 0 says what stresses there are; normal components that no column gives a stress share alike what is left to the mean pressure. */
static bool begin_with(reader *r, drive_path *p, const drive_leg *leg) {
	for (uint32_t k = 0; k < r->n; k++) {
		const column *c = &r->column[k];
		if ((c->what == STRAIN || c->what == SLIDE) && leg->target[c->component] != 0)
			return fault(r, "column '%s' must be 0 at time 0: strains count from there", c->name);
		if (c->what == STRESS) p->start.target[c->component] = leg->target[c->component];
	}
	if (!p->pressed) return true;
	double rest = p->dim * leg->pressure;
	uint32_t others = 0;
	for (uint32_t c = 0; c < p->dim; c++)
		if (p->control[c] != DRIVE_STRESS) others++;
		else rest += p->start.target[c];
	for (uint32_t c = 0; c < p->dim; c++)
		if (p->control[c] != DRIVE_STRESS) p->start.target[c] = -rest / others;
	return true;
}

static bool read_rows(reader *r, drive_path *p) {
	const char *at, *end;
	size_t capacity = 0;
	double now = 0;
	for (bool first = true; next_line(r, &at, &end); first = false) {
		drive_leg leg = { .time = 0 };
		if (!read_row(r, at, end, &leg)) return false;
		if (first && leg.time == 0) {
			if (!begin_with(r, p, &leg)) return false;
			continue;
		}
		if (!(leg.time > now)) return fault(r, "time %g s does not come after %g s", leg.time, now);
		if (p->n == DRIVE_MOST_LEGS) return fault(r, "there are more than %d rows", DRIVE_MOST_LEGS);
		p->leg = quern_grow(p->leg, p->n, &capacity, sizeof *p->leg);
		p->leg[p->n++] = leg;
		now = leg.time;
	}
	return p->n > 0 || fault(r, "no row comes after time 0");
}

bool quern_drive_table_read(
	const char *text, size_t length, uint32_t dim, double pressure, drive_path *p, quern_text *why) {
	reader r = { .at = text, .end = text + length, .dim = dim, .why = why };
	*p = (drive_path) { .dim = dim, .follow = -1 };
	for (uint32_t c = 0; c < dim; c++) p->start.target[c] = -pressure;
	const bool good = read_names(&r) && set_controls(&r, p) && read_rows(&r, p);
	if (!good) quern_drive_path_finish(p);
	double sum = 0;
	for (uint32_t c = 0; c < dim; c++) sum += p->start.target[c];
	p->start.pressure = -sum / dim;
	return good;
}
