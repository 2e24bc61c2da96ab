/* SPDX-License-Identifier: MIT */
#include "sections.h"
#include "section.h"
#include "text.h"
#include <stdlib.h>
#include <string.h>

/* One section that stands in the scene. */
typedef struct {
	const quern_entry *entry;
	const quern_plugin_file *file; /* its solver; NULL until somebody needs it, or if there is none */
	bool kept, asked, read;
} part;

typedef struct {
	quern_scene *scene;
	part part[QUERN_MOST_SECTIONS];
	size_t n;
	bool failed; /* a fault that hides others: no more than that is said */
} parts;

/* ---- which keys are sections ---- */

static const char *named_solver(const quern_node *section) {
	const quern_node *solver =
		section && section->kind == QUERN_NODE_MAP ? quern_node_find(section, "solver") : NULL;
	return solver && solver->kind == QUERN_NODE_SCALAR ? solver->text : NULL;
}

/* Whether the scene itself reads what stands there: a row or a list of its own begins with this word, or its
 * observers do. */
static bool is_key_of_scene(const char *key) {
	for (const quern_general_list *l = quern_general_lists; l->name; l++)
		if (quern_same_head(l->name, key)) return true;
	return quern_rows_open(quern_general_rows, key) || !strcmp(key, quern_observe_slot.name);
}

bool quern_section_is_claimed(const quern_section_of *s) {
	return s->section && !is_key_of_scene(s->section);
}

static bool is_section(quern_scene *s, const quern_entry *e) {
	const quern_catalogue *known = quern_loader_catalogue(s->loader);
	if (is_key_of_scene(e->key)) return false;
	if (named_solver(e->value)) return true;
	for (size_t i = 0; i < known->n_solvers; i++)
		if (quern_section_is_claimed(&known->solvers[i]) && !strcmp(known->solvers[i].section, e->key))
			return true;
	return false;
}

static const char **append(const char **list, size_t *n, size_t *capacity, const char *word) {
	list = quern_grow(list, *n + 1, capacity, sizeof *list);
	list[(*n)++] = word;
	list[*n] = NULL;
	return list;
}

const char **quern_sections_known(quern_scene *s, const quern_node *root) {
	const char **also = NULL;
	size_t n = 0, capacity = 0;
	const quern_catalogue *known = quern_loader_catalogue(s->loader);
	for (const quern_general_list *l = quern_general_lists; l->name; l++)
		also = append(also, &n, &capacity, l->name);
	also = append(also, &n, &capacity, quern_observe_slot.name);
	for (size_t i = 0; i < known->n_solvers; i++)
		if (quern_section_is_claimed(&known->solvers[i]))
			also = append(also, &n, &capacity, known->solvers[i].section);
	for (size_t i = 0; i < root->n; i++)
		if (!is_key_of_scene(root->entries[i].key) && named_solver(root->entries[i].value))
			also = append(also, &n, &capacity, root->entries[i].key);
	return also;
}

static void gather(parts *p, const quern_node *root) {
	for (size_t i = 0; i < root->n; i++) {
		const quern_entry *e = &root->entries[i];
		if (quern_node_is_null(e->value) || !is_section(p->scene, e)) continue;
		if (p->n == QUERN_MOST_SECTIONS) {
			quern_report_add(p->scene->report, e->mark, "scene: more than %d sections", QUERN_MOST_SECTIONS);
			return;
		}
		p->part[p->n++] = (part) { .entry = e };
	}
}

static part *find(parts *p, const char *name) {
	for (size_t i = 0; i < p->n; i++)
		if (!strcmp(p->part[i].entry->key, name)) return &p->part[i];
	return NULL;
}

/* ---- solvers ---- */

/* The one that claims the section; NULL after one sentence if several do. */
static const char *default_solver(quern_scene *s, const part *it) {
	const char *found = NULL;
	const quern_catalogue *known = quern_loader_catalogue(s->loader);
	for (size_t i = 0; i < known->n_solvers; i++) {
		const quern_section_of *one = &known->solvers[i];
		if (!one->section || strcmp(one->section, it->entry->key) != 0) continue;
		if (found) {
			quern_report_add(s->report, it->entry->mark,
				"section %s is claimed by solver.%s and solver.%s: say which, %s: {solver: %s, ...}",
				it->entry->key, found, one->solver, it->entry->key, found);
			return NULL;
		}
		found = one->solver;
	}
	return found;
}

static const quern_solver_ops *solver_of(parts *p, part *it) {
	if (!it->asked) {
		quern_scene *s = p->scene;
		const char *given = named_solver(it->entry->value);
		const quern_node *said =
			it->entry->value->kind == QUERN_NODE_MAP ? quern_node_find(it->entry->value, "solver") : NULL;
		if (said && !given)
			quern_report_add(s->report, said->mark, "%s: solver must be the name of one", it->entry->key);
		const char *name = given ? given : default_solver(s, it);
		const quern_mark mark = given ? quern_node_find(it->entry->value, "solver")->mark : it->entry->mark;
		it->asked = true;
		if (name) it->file = quern_loader_find(s->loader, quern_solver_kind.name, name, s->report, mark);
		p->failed = p->failed || !it->file;
	}
	return it->file ? it->file->plugin.ops : NULL;
}

/* ---- which of them take part ---- */

static void keep(parts *p, part *it);

static void keep_all(parts *p, const char *const *names) {
	for (; names && *names; names++) {
		part *other = find(p, *names);
		if (other && !other->kept) keep(p, other);
	}
}

static void keep(parts *p, part *it) {
	it->kept = true;
	const quern_solver_ops *ops = solver_of(p, it);
	if (!ops) return;
	keep_all(p, ops->needs);
	keep_all(p, ops->with);
}

static void refuse_model(const parts *p, quern_mark mark) {
	quern_text names = { 0 };
	for (size_t i = 0; i < p->n; i++) quern_text_add(&names, "%s%s", i ? ", " : "", p->part[i].entry->key);
	quern_report_add(p->scene->report, mark,
		"scene: model is '%s', must be all, or a section of this scene, which then runs with what it needs: "
		"%s",
		p->scene->general.model, p->n ? quern_text_string(&names) : "there is none");
	quern_text_finish(&names);
}

static void choose(parts *p, const quern_node *root) {
	quern_scene *s = p->scene;
	const bool whole = quern_scene_is_whole(s);
	part *only = whole ? NULL : find(p, s->general.model);
	for (size_t i = 0; i < p->n && whole; i++) keep(p, &p->part[i]);
	if (only) keep(p, only);
	else if (!whole) refuse_model(p, quern_param_mark(root, "model", root->mark)), p->failed = true;
	for (size_t i = 0; i < p->n; i++)
		if (p->part[i].kept) s->kept[s->n_kept++] = p->part[i].entry->key;
}

/* ---- in which order ---- */

static part *waited_for(parts *p, const char *const *names) {
	for (; names && *names; names++) {
		part *other = find(p, *names);
		if (other && other->kept && other->file && !other->read) return other;
	}
	return NULL;
}

/* The first by name of those that wait for nobody, so that the order in the file does not matter. */
static part *next(parts *p, part **stuck) {
	part *best = NULL;
	*stuck = NULL;
	for (size_t i = 0; i < p->n; i++) {
		part *it = &p->part[i];
		if (!it->kept || !it->file || it->read) continue;
		const quern_solver_ops *ops = it->file->plugin.ops;
		*stuck = it;
		if (waited_for(p, ops->needs) || waited_for(p, ops->after)) continue;
		if (!best || strcmp(it->entry->key, best->entry->key) < 0) best = it;
	}
	return best;
}

/* Following who waits for whom, as often as there are sections, one ends in the circle. */
static part *in_circle(parts *p, part *it) {
	for (size_t k = 0; k < p->n; k++) {
		const quern_solver_ops *ops = it->file->plugin.ops;
		part *next = waited_for(p, ops->needs);
		if (!next) next = waited_for(p, ops->after);
		if (next) it = next;
	}
	return it;
}

/* Without what it lives on, only the absence of that is worth a message. */
static bool lacks(const parts *p, const part *it) {
	const char *const *needs = ((const quern_solver_ops *)it->file->plugin.ops)->needs;
	const char *missing = NULL;
	quern_text all = { 0 };
	for (size_t k = 0; needs && needs[k]; k++) {
		quern_text_add(&all, "%s%s", k ? " and " : "", needs[k]);
		if (!missing && !quern_scene_section(p->scene, needs[k])) missing = needs[k];
	}
	if (missing)
		quern_report_add(p->scene->report, it->entry->mark, "scene: %s needs %s; %s is missing",
			it->entry->key, quern_text_string(&all), missing);
	quern_text_finish(&all);
	return missing != NULL;
}

static void read_all(parts *p) {
	for (part *it, *stuck; (it = next(p, &stuck)) || stuck;) {
		if (!it) {
			stuck = in_circle(p, stuck);
			quern_report_add(p->scene->report, stuck->entry->mark,
				"section %s waits for another one that waits for it: their solvers contradict each other",
				stuck->entry->key);
			p->failed = true;
			return;
		}
		const size_t before = p->scene->n_sections;
		it->read = true;
		if (p->failed || !lacks(p, it)) quern_section_read(p->scene, it->file, it->entry);
		p->failed = p->failed || p->scene->n_sections == before;
	}
}

/* ---- what is left ---- */

static void refuse_stillness(quern_scene *s, quern_mark mark) {
	const quern_catalogue *known = quern_loader_catalogue(s->loader);
	quern_text names = { 0 };
	for (size_t i = 0; i < s->n_sections; i++)
		if (quern_solver_steps(s->sections[i].ops)) return;
	for (size_t i = 0; i < known->n_solvers; i++)
		if (quern_section_is_claimed(&known->solvers[i]) && known->solvers[i].steps)
			quern_text_add(&names, "%s%s", names.length ? ", " : "", known->solvers[i].section);
	quern_report_add(s->report, mark, "scene: nothing to simulate: add a section of these: %s",
		names.length ? names.data : "none, since no solver is installed");
	quern_text_finish(&names);
}

/* A key that nobody knows may be that of a solver which cannot be asked. */
static bool has_strange_key(quern_scene *s, const quern_node *root) {
	for (size_t i = 0; i < root->n; i++)
		if (!is_key_of_scene(root->entries[i].key) && !is_section(s, &root->entries[i])) return true;
	return false;
}

void quern_sections_read(quern_scene *s, quern_node *root) {
	parts p = { .scene = s };
	gather(&p, root);
	choose(&p, root);
	read_all(&p);
	if (!p.failed) refuse_stillness(s, root->mark);
	if (has_strange_key(s, root)) quern_loader_report_unreadable(s->loader, s->report, root->mark);
}
