/* SPDX-License-Identifier: MIT */
#include "episodes.h"
#include "param.h"
#include "text.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char say_item[] = "{for: TIME, set: {path.to.key: value}}";

/* What belongs to the whole run: of the scene's own keys all that say so, its lists and its observers. */
static bool is_fixed(const char *path) {
	for (const quern_param *row = quern_general_rows; row->name; row++)
		if (row->flags & QUERN_ONCE && quern_same_head(row->name, path)) return true;
	for (const quern_general_list *l = quern_general_lists; l->name; l++)
		if (quern_same_head(l->name, path)) return true;
	return quern_same_head(quern_observe_slot.name, path);
}

/* A word in place of a number of a solver's own stands for what was published before the run, in all stages. */
static void keep_numbers(quern_scene *s, quern_tree *tree) {
	for (size_t i = 0; i < s->n_sections; i++) {
		const quern_section *section = &s->sections[i];
		const quern_param *row = section->solver->file->params;
		for (; section->node->kind == QUERN_NODE_MAP && row && row->name; row++) {
			const quern_node *node =
				row->type == QUERN_T_INT && row->text ? quern_node_find(section->node, row->name) : NULL;
			if (!node || node->kind != QUERN_NODE_SCALAR || !quern_is_name(node->text)) continue;
			char *path = quern_format("%s.%s", section->name, row->name),
				 *text = quern_format("%.0f", quern_param_number(row, section->solver->self));
			const quern_node number = { .kind = QUERN_NODE_SCALAR, .mark = node->mark, .text = text };
			quern_tree_replace(tree, path, &number, node->mark, s->report);
			free(path);
			free(text);
		}
	}
}

/* The scene with other values; NULL after a sentence. Its marks are those of the old one. */
static quern_scene *vary(quern_scene *s, const quern_node *set) {
	quern_tree *tree = quern_tree_copy(s->tree);
	const size_t before = quern_report_errors(s->report);
	keep_numbers(s, tree);
	for (size_t i = 0; i < set->n; i++) {
		const quern_entry *e = &set->entries[i];
		if (is_fixed(e->key))
			quern_report_add(s->report, e->mark, "stages: %s cannot change in the course of a run", e->key);
		else quern_tree_replace(tree, e->key, e->value, e->mark, s->report);
	}
	if (quern_report_errors(s->report) == before) {
		quern_scene *other = quern_scene_vary(s, tree);
		if (!quern_report_errors(other->report)) return other;
		quern_report_take(s->report, other->report);
		quern_scene_destroy(other);
		return NULL;
	}
	quern_tree_destroy(tree);
	return NULL;
}

/* Infinite where none is given; not a number after a sentence. */
static double length_of(quern_scene *s, const quern_entry *item) {
	const quern_node *node = quern_node_find(item->value, "for");
	char why[160], say[64];
	double length = INFINITY;
	if (!node) return INFINITY;
	if (node->kind != QUERN_NODE_SCALAR || !quern_quantity_read(s->units, node->text, "s", &length, why))
		quern_report_add(
			s->report, node->mark, "stages: for must be a time, not %s", quern_node_say(node, say));
	else if (!(length > 0 && isfinite(length)))
		quern_report_add(s->report, node->mark, "stages: for is %s, must be above 0 s", node->text);
	else return length;
	return NAN;
}

static bool check_keys(quern_scene *s, const quern_node *item) {
	char say[64];
	const quern_node *set = quern_node_find(item, "set");
	for (size_t i = 0; i < item->n; i++)
		if (strcmp(item->entries[i].key, "for") != 0 && strcmp(item->entries[i].key, "set") != 0) {
			quern_report_add(s->report, item->entries[i].mark, "stages: unknown key '%s'; it takes: for, set",
				item->entries[i].key);
			return false;
		}
	if (!set || set->kind == QUERN_NODE_MAP) return true;
	quern_report_add(s->report, set->mark, "stages: set must be a map of keys and values, not %s",
		quern_node_say(set, say));
	return false;
}

/* What differs from a frame's time, or from the end, by round-off alone is that time. */
static double snap(const quern_general *g, double time) {
	const double n = floor(time / g->every + 0.5), frame = n * g->every;
	if (fabs(time - g->end) <= 1e-9 * g->end) return g->end;
	return fabs(time - frame) <= 1e-9 * fmax(time, g->every) ? frame : time;
}

/* An episode lasts for its time, the last one to the end. */
static void read_item(quern_scene *s, const quern_node *list, size_t i, double *begin) {
	const quern_entry *item = &list->entries[i];
	const bool last = i + 1 == list->n;
	char say[64];
	if (item->value->kind != QUERN_NODE_MAP) {
		quern_report_add(s->report, item->value->mark, "stages: an entry must be %s, not %s", say_item,
			quern_node_say(item->value, say));
		return;
	}
	if (!check_keys(s, item->value)) return;
	const double length = length_of(s, item);
	const quern_node *set = quern_node_find(item->value, "set");
	if (!last && isinf(length))
		quern_report_add(
			s->report, item->value->mark, "stages: for is missing: all but the last one need it");
	quern_episode *e = &s->episodes[s->n_episodes++];
	*e = (quern_episode) { .begin = *begin, .scene = set ? vary(s, set) : NULL };
	*begin = isfinite(length) ? snap(&s->general, *begin + length) : *begin + length;
	if (!last && isfinite(*begin) && *begin >= s->general.end)
		quern_report_add(s->report, item->value->mark,
			"stages: this one would end at %.6g s, and time.end is %.6g s", *begin, s->general.end);
	if (last && isfinite(length) && fabs(*begin - s->general.end) > 1e-9 * s->general.end)
		quern_report_add(s->report, item->value->mark,
			"stages: the last one would end at %.6g s, and time.end is %.6g s: leave its 'for' out, or "
			"change one of them",
			*begin, s->general.end);
}

void quern_episodes_read(quern_scene *s) {
	const quern_node *list = s->tree->root ? quern_node_find(s->tree->root, "stages") : NULL;
	char say[64];
	double begin = 0;
	if (!list) return;
	if (list->kind != QUERN_NODE_LIST || !list->n) {
		quern_report_add(s->report, list->mark, "scene: stages must be a list of %s, not %s", say_item,
			quern_node_say(list, say));
		return;
	}
	s->episodes = quern_take(list->n, sizeof *s->episodes);
	for (size_t i = 0; i < list->n; i++) read_item(s, list, i, &begin);
}

int64_t quern_episode_at(const quern_scene *s, double time) {
	int64_t k = (int64_t)s->n_episodes - 1;
	while (k >= 0 && s->episodes[k].begin > time) k--;
	return k;
}

void quern_episodes_finish(quern_scene *s) {
	for (size_t i = 0; i < s->n_episodes; i++) quern_scene_destroy(s->episodes[i].scene);
	free(s->episodes);
}

void quern_episodes_write(const quern_scene *s, quern_node *root) {
	const quern_node *list = s->tree->root ? quern_node_find(s->tree->root, "stages") : NULL;
	if (!list || !s->n_episodes) return;
	quern_node *out = quern_node_put_list(root, "stages");
	for (size_t i = 0; i < list->n; i++) quern_node_merge(quern_node_append_map(out), list->entries[i].value);
}
