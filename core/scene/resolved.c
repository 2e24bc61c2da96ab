/* SPDX-License-Identifier: MIT */
/* resolved - the scene with every default written out, so that it reruns the same */
#include "episodes.h"
#include "section.h"
#include "text.h"
#include <stdlib.h>
#include <string.h>

typedef struct {
	const quern_scene *scene;
	const quern_naming *naming;
} writing;

static void put_params(const writing *w, const quern_param *rows, const void *instance, quern_node *map) {
	quern_params_write(rows, instance, (uint32_t)w->scene->general.dimension, w->naming, map);
}

/* True if a plugin in that slot takes a file under that key. */
static bool takes_file(const quern_scene *s, const char *path, const char *key) {
	for (size_t k = 0; k < s->n_instances; k++) {
		const quern_instance *it = s->instances[k];
		const quern_param *row = strcmp(it->path, path) ? NULL : quern_param_find(it->file->params, key);
		if (row && row->flags & QUERN_FILE) return true;
	}
	return false;
}

/* Files are called otherwise, also in the map of one plugin of several. */
static void name_files(const writing *w, const char *slot, quern_node *map) {
	for (size_t i = 0; i < map->n && w->naming; i++) {
		quern_node *value = map->entries[i].value;
		if (value->kind == QUERN_NODE_MAP) name_files(w, slot, value);
		if (value->kind != QUERN_NODE_SCALAR || !takes_file(w->scene, slot, map->entries[i].key)) continue;
		char *path = quern_param_path(value);
		free(value->text);
		value->text = w->naming->name(w->naming->context, path);
		value->quoted = true;
		free(path);
	}
}

/* What overrides another slot is written as the scene gives it, but for files. */
static void put_override(const writing *w, const quern_slot *slot, const quern_filling *f, quern_node *map) {
	const char *key = strchr(slot->override, '.') + 1;
	const quern_node *over = quern_node_find(f->instance->map, key);
	if (!over) return;
	quern_node *copy = quern_node_put_map(map, key);
	quern_node_merge(copy, over);
	name_files(w, slot->override, copy);
}

/* So is what the items of a list, which has been written before, say to the plugins of a slot. */
static void put_refined(
	const writing *w, const quern_slot_use *use, const quern_section *section, quern_node *node) {
	const quern_param *row = quern_param_find(section->solver->file->params, use->slot->refine);
	const quern_node *given = quern_node_find(section->node, use->slot->refine);
	const quern_node *written = quern_node_find(node, use->slot->refine);
	for (size_t i = 0; given && written && i < written->n; i++) {
		const quern_node *item = given->kind == QUERN_NODE_LIST ? given->entries[i].value : given;
		quern_node *keys = quern_node_create(QUERN_NODE_MAP);
		for (size_t e = 0; e < item->n; e++)
			if (!quern_rows_open(row->rows, item->entries[e].key))
				quern_node_merge_entry(keys, &item->entries[e]);
		name_files(w, use->path, keys);
		quern_node_merge(written->entries[i].value, keys);
		quern_node_destroy(keys);
	}
}

static void put_filling(
	const writing *w, const quern_slot *slot, const quern_filling *f, quern_node *parent) {
	const quern_instance *it = f->instance;
	quern_node *map = quern_node_put_map(parent, quern_id_name(it->file->plugin.id));
	put_params(w, it->file->params, it->self, map);
	if (slot->rows) put_params(w, slot->rows, f->item, map);
	if (slot->override) put_override(w, slot, f, map);
}

static void put_slot(const writing *w, const quern_slot_use *use, quern_node *section) {
	const quern_slot *slot = use->slot;
	if (use->borrowed || !use->n) return;
	const char *dot = strchr(slot->name, '.');
	if (dot) { /* one in each item of a list that was written before */
		char *list = quern_copy(slot->name);
		list[dot - slot->name] = 0;
		quern_node *items = quern_node_find(section, list);
		for (size_t i = 0; items && i < use->n && i < items->n; i++)
			put_filling(w, slot, &use->filling[i], quern_node_put_map(items->entries[i].value, dot + 1));
		free(list);
	} else if (slot->list) {
		quern_node *list =
			section->kind == QUERN_NODE_LIST ? section : quern_node_put_list(section, slot->name);
		for (size_t i = 0; i < use->n; i++)
			put_filling(w, slot, &use->filling[i], quern_node_append_map(list));
	} else put_filling(w, slot, &use->filling[0], quern_node_put_map(section, slot->name));
}

static void put_section(const writing *w, const quern_section *section, quern_node *root) {
	const bool list = section->node->kind == QUERN_NODE_LIST;
	quern_node *node =
		list ? quern_node_put_list(root, section->name) : quern_node_put_map(root, section->name);
	if (!list) {
		const quern_instance *solver = section->solver;
		quern_node_put(node, "solver", quern_id_name(solver->file->plugin.id));
		put_params(w, solver->file->params, solver->self, node);
	}
	for (size_t k = 0; k < section->n_slots; k++) {
		put_slot(w, &section->slots[k], node);
		if (section->slots[k].slot->refine) put_refined(w, &section->slots[k], section, node);
	}
}

quern_node *quern_scene_tree(const quern_scene *s, const quern_naming *naming) {
	const writing w = { s, naming };
	quern_node *root = quern_node_create(QUERN_NODE_MAP);
	put_params(&w, quern_general_rows, &s->general, root);
	quern_node *periodic = quern_node_put_list(root, "domain.periodic");
	for (int k = 0; k < s->general.dimension; k++)
		quern_node_append(periodic, s->general.periodic[k] ? "true" : "false");
	quern_node *open = quern_node_put_list(root, "domain.open");
	for (int k = 0; k < 2 * s->general.dimension; k++)
		if (s->general.open[k % 2][k / 2]) quern_node_append(open, quern_face_name(k % 2, k / 2));
	quern_node *fields = quern_node_put_list(root, "output.fields");
	for (size_t k = 0; k < s->n_fields; k++) quern_node_append(fields, s->fields[k]);
	for (size_t i = 0; i < s->n_sections; i++) put_section(&w, &s->sections[i], root);
	put_slot(&w, &s->observe, root);
	quern_episodes_write(s, root);
	return root;
}

char *quern_scene_resolved(const quern_scene *s, const quern_naming *naming) {
	quern_node *root = quern_scene_tree(s, naming);
	quern_text text = { 0 };
	quern_node_print(root, 0, &text);
	quern_text_add(&text, "\n");
	quern_node_destroy(root);
	return text.data;
}
