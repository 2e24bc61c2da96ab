/* SPDX-License-Identifier: MIT */
/* quern_check_table - what a plugin's tables say of it beyond what the loader asks: docs, units, ranges, one meaning
 * each */
#include "check_table.h"
#include "check.h"
#include "text.h"
#include <math.h>
#include <string.h>

/* ---- the plugin itself ---- */

static bool has_text(const char *text) { return text && *text; }

static void check_identity(const check *c, quern_check_tally *t) {
	const quern_plugin *p = &c->file->plugin;
	const quern_library *lib = c->file->library;
	const char *slash = strrchr(c->file->path, '/'), *name = slash ? slash + 1 : c->file->path;
	const size_t n = strlen(p->id);
	quern_check_expect(
		t, !strncmp(name, p->id, n) && name[n] == '.', "the file is %s, the id %s", name, p->id);
	quern_check_expect(t, has_text(p->brief) && !strchr(p->brief, '\n'), "brief must be one line");
	quern_check_expect(t, has_text(lib->version), "the library has no version");
	quern_check_expect(t, has_text(lib->license), "the library has no licence");
	quern_check_expect(t, (p->init != NULL) || !p->finish, "there is finish, but no init");
}

/* ---- parameters ---- */

static void check_default(quern_check_tally *t, const quern_param *row) {
	const bool number = row->type == QUERN_T_REAL || row->type == QUERN_T_INT;
	if (!number || row->choices || row->min == row->max || row->from) return;
	if (row->flags & (QUERN_REQUIRED | QUERN_MAYBE)) return;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const double x = quern_param_default(row, dim);
		const bool low = row->flags & QUERN_MIN_OPEN ? x > row->min : x >= row->min;
		const bool high = row->flags & QUERN_MAX_OPEN ? x < row->max : x <= row->max;
		quern_check_expect(t, low && high, "%s: the default %g is outside its own range", row->name, x);
	}
}

static bool same_name(const char *a, const char *b) {
	const size_t n = strlen(a);
	return !strcmp(a, b) || (!strncmp(a, b, n) && b[n] == '.');
}

void quern_check_parameter_rows(const check *c, quern_check_tally *t, const quern_param *rows) {
	for (const quern_param *row = rows; row && row->name; row++) {
		const char *name = row->name;
		quern_check_expect(t, has_text(row->doc), "%s: no doc", name);
		quern_check_expect(t, !row->unit || quern_check_is_unit(&c->open, row->unit), "%s: '%s' is no unit",
			name, row->unit);
		quern_check_expect(
			t, row->type != QUERN_T_REAL || row->unit, "%s: a number has a unit; \"1\" if it is pure", name);
		check_default(t, row);
		for (const quern_param *other = rows; other != row; other++) {
			/* "law" beside "law.key" is a choice or a map */
			const bool both = !strcmp(other->name, name) ||
							  (!row->choices && !other->choices &&
								  (same_name(other->name, name) || same_name(name, other->name)));
			quern_check_expect(t, !both, "%s stands twice", name);
		}
		quern_check_parameter_rows(c, t, row->rows);
	}
}

/* ---- uses ---- */

void quern_check_use_rows(const check *c, quern_check_tally *t, const quern_use *rows) {
	const bool solver = quern_id_is_of(c->file->plugin.id, quern_solver_kind.name);
	for (const quern_use *row = rows; row && row->field; row++) {
		const char *name = row->field;
		bool told = false;
		quern_check_expect(t, row->unit && quern_check_is_unit(&c->open, row->unit), "%s: '%s' is no unit",
			name, row->unit ? row->unit : "");
		for (const quern_use *other = rows; other->field; other++) {
			if (strcmp(other->field, name) != 0) continue;
			told = told || has_text(other->doc);
			quern_check_expect(t, other->shape == row->shape, "%s has two shapes", name);
			quern_check_expect(t,
				!other->unit || !row->unit || quern_units_equal(c->units, other->unit, row->unit),
				"%s has two units", name);
		}
		quern_check_expect(
			t, solver || row->access == QUERN_READ || told, "%s: no doc, though it is changed here", name);
	}
}

/* ---- what the installed solvers say of the same fields ---- */

static void compare_rows(const check *c, quern_check_tally *t, const char *field, const quern_use *row,
	const quern_plugin_file *solver) {
	const quern_solver_ops *ops = solver->plugin.ops;
	for (const quern_stage *s = ops->stages; s && s->name; s++)
		for (const quern_use *own = s->uses; own->field; own++) {
			if (strcmp(own->field, field) != 0) continue;
			quern_check_expect(t, own->shape == row->shape, "%s is %s here, and %s to %s", row->field,
				quern_shape_name(row->shape), quern_shape_name(own->shape), solver->plugin.id);
			quern_check_expect(t,
				!own->unit || !row->unit || quern_units_equal(c->units, own->unit, row->unit),
				"%s is in %s here, and in %s to %s", row->field, row->unit, own->unit, solver->plugin.id);
		}
}

/* "particle.*" is what a slot for this kind makes of it. */
static void compare_particle(
	const check *c, quern_check_tally *t, const quern_use *row, const quern_plugin_file *solver) {
	const quern_solver_ops *ops = solver->plugin.ops;
	for (const quern_slot *s = ops->slots; s && s->name; s++) {
		char field[64];
		if (!s->particle || !quern_id_is_of(c->file->plugin.id, s->kind->name)) continue;
		snprintf(field, sizeof field, "%.24s.%.32s", s->particle, row->field + 9);
		compare_rows(c, t, field, row, solver);
	}
}

/* Those that could be asked: what is wrong with another one is no fault of this plugin. */
static void compare_with_solvers(const check *c, quern_check_tally *t) {
	const quern_catalogue *known = quern_loader_catalogue(c->loader);
	quern_report *report = quern_report_create();
	for (size_t i = 0; i < known->n_solvers; i++) {
		const char *name = known->solvers[i].solver;
		if (!strcmp(quern_id_name(c->file->plugin.id), name) &&
			quern_id_is_of(c->file->plugin.id, quern_solver_kind.name))
			continue;
		const quern_plugin_file *solver =
			quern_loader_find(c->loader, quern_solver_kind.name, name, report, (quern_mark) { 0 });
		for (const quern_use *row = c->file->uses; solver && row->field; row++) {
			compare_rows(c, t, row->field, row, solver);
			if (!strncmp(row->field, "particle.", 9)) compare_particle(c, t, row, solver);
		}
	}
	quern_report_destroy(report);
}

void quern_check_table(const check *c) {
	const quern_plugin *p = &c->file->plugin;
	quern_check_tally identity = { .name = "identity" }, params = { .name = "parameter rows" },
					  uses = { .name = "uses" };
	quern_check_place(&c->open, "its tables");
	check_identity(c, &identity);
	quern_check_tell(
		&c->open, &identity, "%s %s, %s", p->id, c->file->library->version, c->file->library->license);
	quern_check_parameter_rows(c, &params, c->file->params);
	quern_check_tell(&c->open, &params, "%zu rows, %u bytes", c->file->n_params, p->instance_size);
	quern_check_use_rows(c, &uses, c->file->uses);
	quern_check_place(&c->open, "its tables, held against those of installed solvers");
	compare_with_solvers(c, &uses);
	quern_check_tell(&c->open, &uses, "%zu rows", c->file->n_uses);
}
