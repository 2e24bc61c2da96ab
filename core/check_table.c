/* check_table - what a plugin's tables say of it: names, units, ranges, uses */
#include "check_table.h"
#include "check.h"
#include "text.h"
#include <math.h>
#include <string.h>

bool check_is_unit(const check *c, const char *unit) {
	char text[96], why[160];
	double value;
	snprintf(text, sizeof text, "1 %s", unit ? unit : "?");
	return unit && (!strcmp(unit, "1") || quern_quantity_read(c->units, text, unit, &value, why));
}

/* ---- the plugin itself ---- */

static bool has_text(const char *text) { return text && *text; }

static void check_identity(const check *c, check_tally *t) {
	const quern_plugin *p = &c->file->plugin;
	const quern_library *lib = c->file->library;
	const char *slash = strrchr(c->file->path, '/'), *name = slash ? slash + 1 : c->file->path;
	const size_t n = strlen(p->id);
	check_expect(t, !strncmp(name, p->id, n) && name[n] == '.', "the file is %s, the id %s", name, p->id);
	check_expect(t, p->dims && !(p->dims & ~(uint32_t)(QUERN_2D | QUERN_3D)),
		"dims is %u, must be QUERN_2D, QUERN_3D or both", p->dims);
	check_expect(t, quern_is_name(p->id + strcspn(p->id, ".") + 1),
		"the name in %s must be letters, digits and underscores", p->id);
	check_expect(t, has_text(p->brief) && !strchr(p->brief, '\n'), "brief must be one line");
	check_expect(t, has_text(lib->version), "the library has no version");
	check_expect(t, has_text(lib->license), "the library has no licence");
	check_expect(t, p->instance_size > 0, "instance_size is 0");
	check_expect(t, (p->init != NULL) || !p->finish, "there is finish, but no init");
}

/* ---- parameters ---- */

static size_t type_size(const quern_param *row) {
	static const size_t sizes[] = { 0, sizeof(quern_real), sizeof(int32_t), sizeof(bool),
		sizeof(const char *), 3 * sizeof(quern_real), sizeof(quern_list) };
	return row->type > QUERN_T_LIST ? 0 : sizes[row->type];
}

static void check_default(check_tally *t, const quern_param *row) {
	const bool number = row->type == QUERN_T_REAL || row->type == QUERN_T_INT;
	if (!number || row->flags & (QUERN_REQUIRED | QUERN_MAYBE)) return;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const double x = quern_param_default(row, dim);
		uint32_t n = 0;
		while (row->choices && row->choices[n]) n++;
		if (row->choices)
			check_expect(t, x >= 0 && x < n, "%s: the default %g is no index of a choice", row->name, x);
		if (row->choices || row->min == row->max) continue;
		const bool low = row->flags & QUERN_MIN_OPEN ? x > row->min : x >= row->min;
		const bool high = row->flags & QUERN_MAX_OPEN ? x < row->max : x <= row->max;
		check_expect(t, low && high, "%s: the default %g is outside its own range", row->name, x);
	}
}

static bool same_name(const char *a, const char *b) {
	const size_t n = strlen(a);
	return !strcmp(a, b) || (!strncmp(a, b, n) && b[n] == '.');
}

void check_parameter_rows(const check *c, check_tally *t, const quern_param *rows, size_t size, int depth) {
	for (const quern_param *row = rows; row && row->name; row++) {
		const char *name = row->name;
		const size_t bytes = type_size(row);
		check_expect(t, bytes > 0, "%s: type %u is unknown", name, row->type);
		check_expect(t, row->offset + bytes <= size, "%s: bytes %u to %zu lie outside an instance of %zu",
			name, row->offset, row->offset + bytes, size);
		check_expect(t, bytes == 0 || row->offset % (bytes < 8 ? bytes : 8) == 0,
			"%s: offset %u is not aligned", name, row->offset);
		check_expect(t, has_text(row->doc), "%s: no doc", name);
		check_expect(t, !row->unit || check_is_unit(c, row->unit), "%s: '%s' is no unit", name, row->unit);
		check_expect(
			t, row->type != QUERN_T_REAL || row->unit, "%s: a number has a unit; \"1\" if it is pure", name);
		check_expect(t, row->min <= row->max && !isnan(row->min), "%s: min is above max", name);
		check_expect(t, !(row->flags & ~127u), "%s: flags %u are unknown", name, row->flags);
		check_expect(t, !row->choices || (row->type == QUERN_T_INT && row->choices[0]),
			"%s: choices are for whole numbers, and at least one", name);
		check_expect(
			t, !(row->flags & QUERN_FILE) || row->type == QUERN_T_TEXT, "%s: a file is a text", name);
		check_default(t, row);
		for (const quern_param *other = rows; other != row; other++) {
			/* "boundary" beside "boundary.frictional" is a choice or a map */
			const bool both = !strcmp(other->name, name) ||
							  (!row->choices && !other->choices &&
								  (same_name(other->name, name) || same_name(name, other->name)));
			check_expect(t, !both, "%s stands twice", name);
		}
		if (row->type != QUERN_T_LIST) continue;
		check_expect(
			t, row->rows && row->item_size && depth < 4, "%s: a list has rows and an item size", name);
		if (row->rows && depth < 4) check_parameter_rows(c, t, row->rows, row->item_size, depth + 1);
	}
}

/* ---- uses ---- */

static bool is_field(const char *field) {
	const size_t n = strcspn(field, ".");
	return n > 0 && n < 24 && field[n] && strlen(field) < 56 && quern_is_name(field + n + 1);
}

void check_use_rows(const check *c, check_tally *t, const quern_use *rows, const quern_param *params) {
	const bool solver = c->file->plugin.kind == QUERN_SOLVER;
	for (const quern_use *row = rows; row && row->field; row++) {
		const char *name = row->field;
		bool told = false;
		check_expect(t, is_field(name), "'%s' is no SET.NAME", name);
		check_expect(t, row->access >= QUERN_READ && row->access <= QUERN_ADD, "%s: access %u is unknown",
			name, row->access);
		check_expect(t, row->shape >= QUERN_SCALAR && row->shape <= QUERN_ID, "%s: shape %u is unknown", name,
			row->shape);
		check_expect(t, row->unit && check_is_unit(c, row->unit), "%s: '%s' is no unit", name,
			row->unit ? row->unit : "");
		check_expect(t, !(row->flags & ~31u), "%s: flags %u are unknown", name, row->flags);
		check_expect(t, row->hook < 3, "%s: hook %u is unknown", name, row->hook);
		check_expect(t, !row->when || quern_param_find(params, row->when), "%s: there is no parameter '%s'",
			name, row->when);
		check_expect(t, !row->with || is_field(row->with), "%s: 'with' is no SET.NAME", name);
		check_expect(t, !row->target || row->shape == QUERN_INDEX, "%s: only an index has a target", name);
		check_expect(t, row->access == QUERN_READ || !(row->flags & (QUERN_OTHERS | QUERN_BEFORE)),
			"%s: OTHERS and BEFORE are for what is read", name);
		for (const quern_use *other = rows; other->field; other++) {
			if (strcmp(other->field, name) != 0) continue;
			told = told || has_text(other->doc);
			check_expect(t, other->shape == row->shape, "%s has two shapes", name);
			check_expect(t, !other->unit || !row->unit || quern_units_equal(c->units, other->unit, row->unit),
				"%s has two units", name);
		}
		check_expect(
			t, solver || row->access == QUERN_READ || told, "%s: no doc, though it is changed here", name);
	}
}

/* ---- functions ---- */

static void check_functions(const check *c, check_tally *t) {
	/* the functions that a kind must have: words of its table, by dimension where there are two */
	static const struct {
		uint32_t kind, first, count;
	} wanted[] = { { QUERN_CONTACT, 1, 2 }, { QUERN_INTEGRATOR, 1, 2 }, { QUERN_MATERIAL, 1, 4 },
		{ QUERN_TRANSFER, 1, 2 }, { QUERN_PACKER, 1, 2 } };
	const quern_plugin *p = &c->file->plugin;
	const char *ops = p->ops;
	uint32_t size;
	memcpy(&size, ops, sizeof size);
	check_expect(t, size >= 16 && size < 4096, "ops has size %u: set .size = sizeof ops", size);
	for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++)
		for (uint32_t k = 0; wanted[i].kind == p->kind && k < wanted[i].count; k++) {
			void *function;
			const size_t at = (wanted[i].first + k) * sizeof(void *);
			if (at + sizeof function > size) continue;
			memcpy(&function, ops + at, sizeof function);
			check_expect(
				t, function || !check_has_dim(c, 2 + k % 2), "ops lacks a function for %u-D", 2 + k % 2);
		}
}

void check_table(const check *c) {
	const quern_plugin *p = &c->file->plugin;
	check_tally identity = { .name = "identity" }, params = { .name = "parameter rows" },
				uses = { .name = "uses" };
	check_place(c, "its tables");
	check_identity(c, &identity);
	check_functions(c, &identity);
	check_tell(c, &identity, "%s %s, %s", p->id, c->file->library->version, c->file->library->license);
	check_parameter_rows(c, &params, c->file->params, p->instance_size, 0);
	check_tell(c, &params, "%zu rows, %u bytes", c->file->n_params, p->instance_size);
	check_use_rows(c, &uses, c->file->uses, c->file->params);
	check_tell(c, &uses, "%zu rows", c->file->n_uses);
}
