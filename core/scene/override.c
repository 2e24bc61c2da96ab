/* SPDX-License-Identifier: MIT */
/* override - plugins of a slot once more, with parameters that are given elsewhere: by an entry of another slot, for
 * what it meets; or by an item of a list beside the slot, for a case of its own; or by both, the entry's on top */
#include "section.h"
#include "text.h"
#include <stdlib.h>
#include <string.h>

static quern_node *scratch_map(quern_scene *s) {
	quern_tree *keep = quern_take(1, sizeof *keep);
	s->defaults = quern_grow(s->defaults, s->n_defaults, &s->defaults_capacity, sizeof(keep));
	s->defaults[s->n_defaults++] = keep;
	return keep->root = quern_node_create(QUERN_NODE_MAP);
}

static bool has_name(const quern_instance *it, const char *key) {
	return !strcmp(quern_id_name(it->file->plugin.id), key);
}

/* Lays what `over` (NULL: nothing) says to this plugin onto its parameters: keys that it has, but for those of `own`, and all that
 * stands under its name. */
static bool lay(quern_node *map, const quern_instance *it, const quern_node *over, const quern_param *own) {
	bool any = false;
	for (size_t e = 0; over && over->kind == QUERN_NODE_MAP && e < over->n; e++) {
		const quern_entry *entry = &over->entries[e];
		if (quern_rows_open(own, entry->key)) continue;
		const bool key = quern_rows_open(it->file->params, entry->key);
		if (key) quern_node_merge_entry(map, entry);
		else if (has_name(it, entry->key)) quern_node_merge(map, entry->value);
		any = any || key || has_name(it, entry->key);
	}
	return any;
}

/* The plugin with what either says to it; NULL if neither says anything. */
static quern_instance *once_more(quern_scene *s, const quern_instance *base, const quern_node *first,
	const quern_param *own, const quern_node *second, quern_mark mark) {
	quern_node *map = scratch_map(s);
	quern_node_merge(map, base->map);
	const bool one = lay(map, base, first, own), two = lay(map, base, second, NULL);
	return one || two ? quern_instance_again(s, base, map, mark) : NULL;
}

/* ---- what may stand there ---- */

/* How many plugins of the slot have this key. */
static size_t owners_of(const quern_slot_use *use, const char *key, const char *name[2]) {
	size_t n = 0;
	for (size_t j = 0; j < use->n; j++)
		if (quern_rows_open(use->filling[j].instance->file->params, key)) {
			if (n < 2) name[n] = quern_id_name(use->filling[j].instance->file->plugin.id);
			n++;
		}
	return n;
}

static bool is_named(const quern_slot_use *use, const char *key) {
	for (size_t j = 0; j < use->n; j++)
		if (has_name(use->filling[j].instance, key)) return true;
	return false;
}

static void check_map(quern_scene *s, const char *path, const quern_entry *e) {
	char say[64];
	if (e->value->kind != QUERN_NODE_MAP)
		quern_report_add(s->report, e->value->mark, "%s: '%s' must be a map of its parameters, not %s", path,
			e->key, quern_node_say(e->value, say));
}

/* ---- an entry of another slot ---- */

static const quern_slot_use *overriding(const quern_scene *s, const char *path) {
	for (size_t i = 0; i < s->n_sections; i++)
		for (size_t k = 0; k < s->sections[i].n_slots; k++) {
			const quern_slot_use *other = &s->sections[i].slots[k];
			if (other->slot->override && !other->borrowed && !strcmp(other->slot->override, path))
				return other;
		}
	return NULL;
}

/* What entry v of the other slot says to plugins of this one, or NULL. */
static const quern_node *given_by(const quern_slot_use *other, size_t v, const char *path) {
	return quern_node_find(other->filling[v].instance->map, strchr(path, '.') + 1);
}

/* The first plugin says what it takes. */
static void let_refuse(quern_scene *s, const quern_slot_use *use, quern_entry *e) {
	const quern_plugin_file *file = use->filling[0].instance->file;
	const quern_reading r = quern_scene_reading(s);
	const quern_node one = { .kind = QUERN_NODE_MAP, .entries = e, .n = 1 };
	quern_params_check(&r, file->plugin.id, file->params, &one, NULL);
}

static void check_given(
	quern_scene *s, const quern_slot_use *use, const quern_slot_use *other, const quern_node *given) {
	const char *key = strchr(use->path, '.') + 1, *name[2];
	char say[64];
	if (given->kind != QUERN_NODE_MAP) {
		quern_report_add(s->report, given->mark, "%s: '%s' must be a map of parameters to override, not %s",
			other->path, key, quern_node_say(given, say));
		return;
	}
	for (size_t e = 0; e < given->n; e++) {
		if (owners_of(use, given->entries[e].key, name) || !use->n) continue;
		if (is_named(use, given->entries[e].key)) check_map(s, other->path, &given->entries[e]);
		else let_refuse(s, use, &given->entries[e]);
	}
}

static void fill_variants(quern_scene *s, quern_slot_use *use, const quern_slot_use *other) {
	for (size_t j = 0; j < use->n; j++) {
		use->filling[j].n_variant = other->n;
		use->filling[j].variant = quern_take(other->n, sizeof(quern_instance *));
	}
	for (size_t v = 0; v < other->n; v++) {
		const quern_node *given = given_by(other, v, use->path);
		if (!given) continue;
		check_given(s, use, other, given);
		for (size_t j = 0; j < use->n; j++)
			use->filling[j].variant[v] =
				once_more(s, use->filling[j].instance, NULL, NULL, given, given->mark);
	}
}

/* ---- an item of a list beside the slot ---- */

/* Every key belongs to one plugin alone. */
static void check_item(quern_scene *s, const quern_slot_use *use, const quern_param *own, const char *path,
	const quern_node *item) {
	bool any = false;
	for (size_t e = 0; e < item->n; e++) {
		const quern_entry *entry = &item->entries[e];
		const char *name[2];
		if (quern_rows_open(own, entry->key)) continue;
		const size_t n = owners_of(use, entry->key, name);
		any = true;
		if (n > 1)
			quern_report_add(s->report, entry->mark,
				"%s: '%s' is a key of %s and of %s: say whose, %s: {%s: ...}", path, entry->key, name[0],
				name[1], name[0], entry->key);
		else if (!n && is_named(use, entry->key)) check_map(s, path, entry);
		else if (!n) quern_slot_refuse_key(s, use, own, path, entry);
	}
	if (!any && use->n)
		quern_report_add(s->report, item->mark, "%s: this item changes nothing: give keys of %s", path,
			use->filling[0].instance->file->plugin.id);
}

static void refine_by(quern_scene *s, quern_slot_use *use, const quern_slot_use *other,
	const quern_param *own, const quern_node *item, size_t i) {
	for (size_t j = 0; j < use->n; j++) {
		quern_filling *f = &use->filling[j];
		quern_instance **at = f->refined + i * (1 + f->n_variant);
		at[0] = once_more(s, f->instance, item, own, NULL, item->mark);
		for (size_t v = 0; v < f->n_variant; v++) {
			const quern_node *given = given_by(other, v, use->path);
			const bool both = at[0] && f->variant[v];
			at[1 + v] = both            ? once_more(s, f->instance, item, own, given, item->mark)
						: f->variant[v] ? f->variant[v]
										: at[0];
			if (!at[1 + v]) at[1 + v] = f->instance;
		}
		if (!at[0]) at[0] = f->instance;
	}
}

static void fill_refined(
	quern_scene *s, const quern_section *section, quern_slot_use *use, const quern_slot_use *other) {
	const quern_param *row = quern_param_find(section->solver->file->params, use->slot->refine);
	const quern_node *node = quern_node_find(section->node, use->slot->refine);
	const bool list = node && node->kind == QUERN_NODE_LIST;
	const size_t n = !node ? 0 : list ? node->n : 1;
	char *path = quern_format("%s.%s", section->name, use->slot->refine);
	for (size_t j = 0; j < use->n; j++) {
		quern_filling *f = &use->filling[j];
		f->n_refined = n;
		f->refined = quern_take(n * (1 + f->n_variant), sizeof(quern_instance *));
	}
	for (size_t i = 0; i < n; i++) {
		const quern_node *item = list ? node->entries[i].value : node;
		if (item->kind == QUERN_NODE_MAP) check_item(s, use, row->rows, path, item);
		refine_by(s, use, other, row->rows, item, i);
	}
	free(path);
}

void quern_slot_override(quern_scene *s, const quern_section *section, quern_slot_use *use) {
	const quern_slot_use *other = overriding(s, use->path);
	if (other) fill_variants(s, use, other);
	if (use->slot->refine) fill_refined(s, section, use, other);
}
