/* resolved - the scene with every default written out, so that it reruns the same */
#include "scene.h"
#include "text.h"
#include <stdlib.h>
#include <string.h>

static const char *bare(const char *id) { return strchr(id, '.') + 1; }

static void put_filling(
	const quern_scene *s, const quern_slot *slot, const quern_filling *f, quern_node *parent) {
	const quern_instance *it = f->instance;
	quern_node *map = quern_node_put_map(parent, bare(it->file->plugin.id));
	quern_params_write(it->file->params, it->self, (uint32_t)s->general.dimension, map);
	if (slot->rows) quern_params_write(slot->rows, f->item, (uint32_t)s->general.dimension, map);
	if (!slot->override) return;
	const char *key = strchr(slot->override, '.') + 1;
	const quern_node *over = quern_node_find(it->map, key);
	if (over) quern_node_merge(quern_node_put_map(map, key), over);
}

static void put_slot(const quern_scene *s, const quern_slot_use *use, quern_node *section) {
	const quern_slot *slot = use->slot;
	if (use->borrowed || !use->n) return;
	const char *dot = strchr(slot->name, '.');
	if (dot) { /* one in each item of a list that was written before */
		char *list = quern_copy(slot->name);
		list[dot - slot->name] = 0;
		quern_node *items = quern_node_find(section, list);
		for (size_t i = 0; items && i < use->n && i < items->n; i++)
			put_filling(s, slot, &use->filling[i], quern_node_put_map(items->entries[i].value, dot + 1));
		free(list);
	} else if (slot->list) {
		quern_node *list =
			section->kind == QUERN_NODE_LIST ? section : quern_node_put_list(section, slot->name);
		for (size_t i = 0; i < use->n; i++)
			put_filling(s, slot, &use->filling[i], quern_node_append_map(list));
	} else put_filling(s, slot, &use->filling[0], quern_node_put_map(section, slot->name));
}

static void put_section(const quern_scene *s, const quern_section *section, quern_node *root) {
	const bool list = section->node->kind == QUERN_NODE_LIST;
	quern_node *node =
		list ? quern_node_put_list(root, section->name) : quern_node_put_map(root, section->name);
	if (!list) {
		const quern_instance *solver = section->solver;
		quern_node_put(node, "solver", bare(solver->file->plugin.id));
		quern_params_write(solver->file->params, solver->self, (uint32_t)s->general.dimension, node);
	}
	for (size_t k = 0; k < section->n_slots; k++) put_slot(s, &section->slots[k], node);
}

char *quern_scene_resolved(const quern_scene *s) {
	quern_node *root = quern_node_create(QUERN_NODE_MAP);
	quern_text text = { 0 };
	quern_params_write(quern_general_rows, &s->general, (uint32_t)s->general.dimension, root);
	quern_node *periodic = quern_node_put_list(root, "domain.periodic");
	for (int k = 0; k < s->general.dimension; k++)
		quern_node_append(periodic, s->general.periodic[k] ? "true" : "false");
	quern_node *fields = quern_node_put_list(root, "output.fields");
	for (size_t k = 0; k < s->n_fields; k++) quern_node_append(fields, s->fields[k]);
	for (size_t i = 0; i < s->n_sections; i++) put_section(s, &s->sections[i], root);
	put_slot(s, &s->observe, root);
	quern_node_print(root, 0, &text);
	quern_text_add(&text, "\n");
	quern_node_destroy(root);
	return text.data;
}
