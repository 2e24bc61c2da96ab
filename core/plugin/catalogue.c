/* SPDX-License-Identifier: MIT */
#include "catalogue.h"
#include "child.h"
#include "environment.h"
#include "loader.h"
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

enum { SECONDS = 20, MOST_TEXT = 1 << 20 };

/* What a child has found out, a line each, in words without spaces:
 *   solver NAME STEPS SECTION (or -), set NAME (of the last solver), kind NAME BYTES, function NAME OFFSET DIM REQUIRED (of the last
 *   kind), fault NAME SENTENCE */
typedef struct {
	uint32_t at;     /* which object is being asked */
	uint32_t length; /* of what is whole */
	char text[MOST_TEXT];
} answers;

typedef struct {
	char *const *ids, *const *paths;
	size_t n;
	answers *to;
} asking;

/* ---- in the child ---- */

static void say_solver(const quern_table *t, quern_text *out) {
	const quern_solver_ops *ops = t->plugin.ops;
	quern_text_add(out, "solver %s %d %s\n", quern_id_name(t->plugin.id), quern_solver_steps(ops),
		ops->section ? ops->section : "-");
	for (const quern_set *set = ops->sets; set->name; set++) quern_text_add(out, "set %s\n", set->name);
	for (const quern_slot *slot = ops->slots; slot->name; slot++) {
		quern_text_add(out, "kind %s %u\n", slot->kind->name, slot->kind->ops_size);
		for (const quern_function *f = slot->kind->functions; f->name; f++)
			quern_text_add(out, "function %s %u %u %u\n", f->name, f->offset, f->dim, f->required);
	}
}

/* One that calls itself otherwise than its file is called can be asked for under no name. */
static void ask_object(const char *id, const char *path, quern_text *out) {
	quern_environment before = quern_environment_take();
	void *handle = dlopen(path, RTLD_LAZY | RTLD_LOCAL);
	const quern_library *lib = handle ? dlsym(handle, QUERN_LIBRARY_SYMBOL) : NULL;
	quern_text why = { 0 };
	quern_table table = { .kind = "" };
	const bool read = lib && quern_table_read(&table, lib, &why);
	if (!handle) quern_text_add(&why, "cannot be loaded: %s", dlerror());
	else if (!lib) quern_text_add(&why, "exports no " QUERN_LIBRARY_SYMBOL);
	if (read && !strcmp(table.plugin.id, id)) say_solver(&table, out);
	else if (!read) quern_text_add(out, "fault %s plugin %s %s\n", id, path, quern_text_string(&why));
	quern_table_finish(&table);
	quern_text_finish(&why);
	if (handle) dlclose(handle);
	quern_environment_restore(&before);
	quern_environment_drop(&before);
}

static void one_line(char *text) {
	for (; *text; text++)
		if (*text == '\n' && text[1]) *text = ' ';
}

static void ask_from(void *arg) {
	const asking *a = arg;
	for (; a->to->at < a->n; a->to->at++) {
		quern_text out = { 0 };
		ask_object(a->ids[a->to->at], a->paths[a->to->at], &out);
		if (out.length && !strncmp(out.data, "fault ", 6)) one_line(out.data);
		if (out.length && out.length < MOST_TEXT - a->to->length) {
			memcpy(a->to->text + a->to->length, out.data, out.length + 1);
			a->to->length += (uint32_t)out.length;
		}
		quern_text_finish(&out);
	}
}

/* ---- what was said ---- */

static void add_unreadable(quern_catalogue *c, const char *solver, char *why) {
	c->unreadable =
		quern_grow(c->unreadable, c->n_unreadable, &c->unreadable_capacity, sizeof *c->unreadable);
	c->unreadable[c->n_unreadable++] = (quern_unreadable) { quern_copy(solver), why };
}

static void add_solver(quern_catalogue *c, char *rest) {
	const char *name = strsep(&rest, " "), *steps = strsep(&rest, " ");
	c->solvers = quern_grow(c->solvers, c->n_solvers, &c->solvers_capacity, sizeof *c->solvers);
	c->solvers[c->n_solvers++] =
		(quern_section_of) { .section = strcmp(rest, "-") != 0 ? quern_copy(rest) : NULL,
			.solver = quern_copy(name),
			.steps = *steps == '1' };
}

static void add_set(quern_catalogue *c, const char *name) {
	quern_section_of *s = &c->solvers[c->n_solvers - 1];
	size_t capacity = s->n_sets;
	s->sets = quern_grow(s->sets, s->n_sets, &capacity, sizeof *s->sets);
	s->sets[s->n_sets++] = quern_copy(name);
}

/* One block: the kind, room for its functions, their names. The longest table that any solver knows is kept. */
static quern_kind *add_kind(quern_catalogue *c, char *rest) {
	enum { MOST = 64 };
	const char *name = strsep(&rest, " ");
	const uint32_t size = (uint32_t)strtoul(rest, NULL, 10);
	size_t i = 0;
	while (i < c->n_kinds && strcmp(c->kinds[i]->name, name) != 0) i++;
	if (i < c->n_kinds && c->kinds[i]->ops_size >= size) return NULL;
	quern_kind *own = quern_take(1, sizeof *own + (MOST + 1) * sizeof(quern_function) + (MOST + 1) * 24);
	quern_function *functions = (quern_function *)(void *)(own + 1);
	char *names = (char *)(functions + MOST + 1);
	snprintf(names, 24, "%s", name);
	*own = (quern_kind) { sizeof *own, sizeof *functions, names, NULL, size, 0, functions };
	if (i < c->n_kinds) free(c->kinds[i]);
	else c->kinds = quern_grow(c->kinds, c->n_kinds++, &c->kinds_capacity, sizeof *c->kinds);
	return c->kinds[i] = own;
}

static void add_function(quern_kind *kind, char *rest) {
	enum { MOST = 64 };
	quern_function *functions = (quern_function *)(void *)(kind + 1);
	char *names = (char *)(functions + MOST + 1);
	size_t n = 0;
	while (functions[n].name) n++;
	if (n >= MOST) return;
	char *own = names + (n + 1) * 24;
	unsigned offset, dim, required;
	if (sscanf(rest, "%23s %u %u %u", own, &offset, &dim, &required) != 4) return;
	functions[n] = (quern_function) { own, offset, (uint8_t)dim, (uint8_t)required, 0 };
}

static void read_lines(quern_catalogue *c, char *text) {
	quern_kind *kind = NULL;
	for (char *line; (line = strsep(&text, "\n")) && *line;) {
		const char *what = strsep(&line, " ");
		if (!strcmp(what, "solver")) add_solver(c, line);
		else if (!strcmp(what, "set")) add_set(c, line);
		else if (!strcmp(what, "kind")) kind = add_kind(c, line);
		else if (!strcmp(what, "function") && kind) add_function(kind, line);
		else if (!strcmp(what, "fault")) {
			const char *id = strsep(&line, " ");
			add_unreadable(c, quern_id_name(id), quern_copy(line));
		}
	}
}

/* ---- asking ---- */

static int by_section(const void *a, const void *b) {
	const quern_section_of *x = a, *y = b;
	const int order = strcmp(x->section ? x->section : "", y->section ? y->section : "");
	return order ? order : strcmp(x->solver, y->solver);
}

/* As many children as objects that end one, and one more. */
static void ask_children(quern_catalogue *c, asking *a) {
	while (a->to->at < a->n) {
		char what[80];
		const quern_child how = quern_child_run(ask_from, a, SECONDS);
		if (how.end == QUERN_CHILD_DONE) return;
		quern_child_say(&how, SECONDS, what);
		add_unreadable(c, quern_id_name(a->ids[a->to->at]),
			quern_format(
				"plugin %s %s while it was asked which section it reads", a->paths[a->to->at], what));
		a->to->at++;
	}
}

void quern_catalogue_ask(quern_catalogue *c, char *const *ids, char *const *paths, size_t n) {
	asking a = { ids, paths, n, quern_shared_take(sizeof(answers)) };
	if (!a.to) return;
	if (quern_child_is_one()) ask_from(&a); /* it may not have a child */
	else ask_children(c, &a);
	read_lines(c, a.to->text);
	if (c->n_solvers) qsort(c->solvers, c->n_solvers, sizeof *c->solvers, by_section);
	quern_shared_drop(a.to, sizeof(answers));
}

void quern_catalogue_finish(quern_catalogue *c) {
	for (size_t i = 0; i < c->n_solvers; i++) {
		quern_section_of *s = &c->solvers[i];
		for (size_t k = 0; k < s->n_sets; k++) free(s->sets[k]);
		free(s->sets);
		free(s->section);
		free(s->solver);
	}
	for (size_t i = 0; i < c->n_kinds; i++) free(c->kinds[i]);
	for (size_t i = 0; i < c->n_unreadable; i++) free(c->unreadable[i].solver), free(c->unreadable[i].why);
	free(c->solvers);
	free(c->kinds);
	free(c->unreadable);
	*c = (quern_catalogue) { .n_solvers = 0 };
}

const quern_kind *quern_catalogue_kind(const quern_catalogue *c, const char *name) {
	for (size_t i = 0; i < c->n_kinds; i++)
		if (!strcmp(c->kinds[i]->name, name)) return c->kinds[i];
	return NULL;
}
