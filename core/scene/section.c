/* SPDX-License-Identifier: MIT */
#include "section.h"
#include "environment.h"
#include "text.h"
#include "watch.h"
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* ---- instances ---- */

/* NULL after one sentence if there is no memory for what the plugin keeps: how much that is, is its own to say. */
static quern_instance *instance_create(
	quern_scene *s, const quern_plugin_file *file, const quern_node *map, quern_mark mark, const char *path) {
	const size_t size = ((size_t)file->plugin.instance_size + 127u) & ~(size_t)63;
	void *self = aligned_alloc(64, size);
	if (!self) {
		quern_report_add(s->report, mark, "%s: out of memory: it wants %u bytes for itself", file->plugin.id,
			file->plugin.instance_size);
		return NULL;
	}
	quern_instance *it = quern_take(1, sizeof *it);
	it->file = file;
	it->map = map;
	it->mark = mark;
	it->path = quern_copy(path);
	it->self = memset(self, 0, size);
	s->instances = quern_grow(s->instances, s->n_instances, &s->instances_capacity, sizeof(it));
	s->instances[s->n_instances++] = it;
	return it;
}

static void instance_read(quern_scene *s, quern_instance *it, const char *const *also) {
	const quern_reading r = quern_scene_reading(s);
	if (!(it->file->plugin.dims & (s->general.dimension == 2 ? QUERN_2D : QUERN_3D)))
		quern_report_add(s->report, it->mark, "%s does not work in %d dimensions", it->file->plugin.id,
			s->general.dimension);
	quern_params_read(&r, it->file->plugin.id, it->file->params, it->map, it->mark, also, it->self);
}

static quern_status call_init(quern_scene *s, quern_instance *it) {
	quern_err err = { s->report, it->map, it->mark, it->file->plugin.id };
	const quern_setup setup = quern_scene_setup(s, it->path);
	quern_environment before = quern_environment_take();
	quern_watch_enter(it->file->plugin.id, "init");
	const quern_status status = it->file->plugin.init(it->self, &setup, &err);
	quern_watch_leave();
	const char *changed = quern_environment_restore(&before);
	quern_environment_drop(&before);
	if (!changed) return status;
	it->ready = status == QUERN_OK;
	return quern_scene_fail(
		&err, QUERN_E_PARAM, NULL, "init changes %s for the whole program: let it put that back", changed);
}

/* A faulty parameter must not reach init, which may rely on the ranges of its rows; nor must a faulty domain. */
static void instance_init(quern_scene *s, quern_instance *it, size_t errors_before) {
	if (quern_report_errors(s->report) != errors_before || !s->sound) return;
	if (it->file->plugin.init) {
		if (call_init(s, it) != QUERN_OK) {
			if (quern_report_errors(s->report) == errors_before)
				quern_report_add(s->report, it->mark, "%s: cannot be set up", it->file->plugin.id);
			return;
		}
	}
	it->ready = true;
}

/* ---- slots ---- */

typedef struct {
	const char *name;
	quern_node *map;
	quern_mark mark;
} choice;

/* Two keys side by side are mostly a name and a parameter that belongs below it. */
static void refuse_entry(
	quern_scene *s, const char *path, size_t i, const quern_node *item, const char *kind) {
	const quern_entry *keys = item->entries;
	if (item->kind == QUERN_NODE_MAP && item->n > 1)
		quern_report_add(s->report, keys[1].mark,
			"%s: an entry is a name, or one name with its parameters, and here '%.40s' stands beside '%.40s'; a parameter belongs below "
			"its name (%s.%zu.%.40s.%.40s), and another %s is an entry of its own",
			path, keys[1].key, keys[0].key, path, i, keys[0].key, keys[1].key, kind);
	else
		quern_report_add(
			s->report, item->mark, "%s: an entry is a name, or one name with its parameters", path);
}

/* A plugin in a scene is a bare name, or a map of one name to its parameters. */
static size_t choices_of(
	quern_scene *s, const char *path, quern_node *node, bool list, choice **out, const char *kind) {
	size_t n = 0, capacity = 0;
	char say[64];
	*out = NULL;
	if (node->kind == QUERN_NODE_SCALAR) {
		*out = quern_grow(*out, n, &capacity, sizeof(choice));
		(*out)[n++] = (choice) { node->text, NULL, node->mark };
	} else if (node->kind == QUERN_NODE_MAP) {
		if (node->n != 1 && !list)
			quern_report_add(
				s->report, node->mark, "%s: one %s is wanted here, found %zu", path, kind, node->n);
		for (size_t i = 0; i < node->n && (list || node->n == 1); i++) {
			*out = quern_grow(*out, n, &capacity, sizeof(choice));
			(*out)[n++] = (choice) { node->entries[i].key,
				quern_node_is_null(node->entries[i].value) ? NULL : node->entries[i].value,
				node->entries[i].mark };
		}
	} else if (!list) {
		quern_report_add(s->report, node->mark, "%s: one %s is wanted here, not %s", path, kind,
			quern_node_say(node, say));
	} else {
		for (size_t i = 0; i < node->n; i++) {
			quern_node *item = node->entries[i].value;
			choice *one = NULL;
			if (item->kind == QUERN_NODE_LIST || (item->kind == QUERN_NODE_MAP && item->n != 1)) {
				refuse_entry(s, path, i, item, kind);
				continue;
			}
			if (choices_of(s, path, item, false, &one, kind) == 1) {
				*out = quern_grow(*out, n, &capacity, sizeof(choice));
				(*out)[n++] = *one;
			}
			free(one);
		}
	}
	return n;
}

static const char **first_parts(const quern_param *rows, size_t *n, const char **list, size_t *capacity) {
	for (; rows && rows->name; rows++) {
		list = quern_grow(list, *n + 1, capacity, sizeof(char *));
		list[(*n)++] = rows->name;
	}
	return list;
}

bool quern_rows_open(const quern_param *rows, const char *key) {
	const size_t n = strlen(key);
	for (; rows && rows->name; rows++)
		if (!strncmp(rows->name, key, n) && (!rows->name[n] || rows->name[n] == '.')) return true;
	return false;
}

/* An entry's map holds the plugin's keys, the slot's own and those that override another slot. */
static void read_entry(quern_scene *s, const quern_slot *slot, quern_filling *f) {
	quern_instance *it = f->instance;
	const char **also = NULL;
	size_t n = 0, capacity = 0;
	also = first_parts(slot->rows, &n, also, &capacity);
	for (size_t i = 0; i < n; i++) { /* first parts alone: what lies deeper is the slot's to check */
		const char *dot = strchr(also[i], '.');
		if (dot)
			for (size_t k = 0; it->map && it->map->kind == QUERN_NODE_MAP && k < it->map->n; k++)
				if (!strncmp(it->map->entries[k].key, also[i], (size_t)(dot - also[i])) &&
					!it->map->entries[k].key[dot - also[i]])
					also[i] = it->map->entries[k].key;
	}
	also = quern_grow(also, n + 2, &capacity, sizeof(char *));
	if (slot->override) also[n++] = strchr(slot->override, '.') + 1;
	also[n] = NULL;
	instance_read(s, it, also);
	if (slot->rows) {
		const quern_reading r = quern_scene_reading(s);
		const bool map = it->map && it->map->kind == QUERN_NODE_MAP;
		size_t m = 0;
		for (size_t i = 0; map && i < it->map->n; i++)
			if (!quern_rows_open(slot->rows, it->map->entries[i].key)) {
				also = quern_grow(also, m + 1, &capacity, sizeof(char *));
				also[m++] = it->map->entries[i].key;
			}
		also = quern_grow(also, m, &capacity, sizeof(char *));
		also[m] = NULL;
		f->item = quern_take(1, slot->item_size);
		quern_params_read(&r, it->file->plugin.id, slot->rows, map ? it->map : NULL, it->mark, also, f->item);
	}
	free(also);
}

static void add_filling(quern_scene *s, quern_slot_use *use, const choice *c) {
	if (!c->name) return;
	const quern_kind *kind = use->slot->kind;
	const quern_plugin_file *file = quern_loader_find(s->loader, kind->name, c->name, s->report, c->mark);
	const void *ops = file ? quern_loader_ops(s->loader, file, kind, s->report, c->mark) : NULL;
	quern_instance *it = ops ? instance_create(s, file, c->map, c->mark, use->path) : NULL;
	if (!it) return;
	it->ops = ops;
	use->filling = quern_grow(use->filling, use->n, &use->capacity, sizeof(quern_filling));
	quern_filling *f = &use->filling[use->n++];
	*f = (quern_filling) { .instance = it, .ops = ops };
	const size_t before = quern_report_errors(s->report);
	read_entry(s, use->slot, f);
	instance_init(s, f->instance, before);
}

static quern_node *default_node(quern_scene *s, const char *text, quern_mark mark) {
	quern_tree *tree = quern_tree_parse("default", text, strlen(text), s->report);
	s->defaults = quern_grow(s->defaults, s->n_defaults, &s->defaults_capacity, sizeof(tree));
	s->defaults[s->n_defaults++] = tree;
	if (tree->root) tree->root->mark = mark;
	for (size_t i = 0; tree->root && i < tree->root->n; i++) tree->root->entries[i].mark = mark;
	return tree->root;
}

static const quern_slot_use *find_slot(const quern_scene *s, const char *path) {
	for (size_t i = 0; i < s->n_sections; i++)
		for (size_t k = 0; k < s->sections[i].n_slots; k++)
			if (!strcmp(s->sections[i].slots[k].path, path)) return &s->sections[i].slots[k];
	return NULL;
}

/* The plugins of another section's slot, called from here too, as this solver knows their kind. */
static void borrow(quern_scene *s, quern_slot_use *use, const quern_slot_use *same, quern_mark mark) {
	const quern_kind *kind = use->slot->kind;
	if (strcmp(kind->name, same->slot->kind->name) != 0) {
		quern_report_add(s->report, mark, "%s: slot %s holds %s, and this solver takes %s there", use->path,
			same->path, same->slot->kind->name, kind->name);
		return;
	}
	use->filling = quern_take(same->n, sizeof *use->filling);
	for (size_t i = 0; i < same->n; i++) {
		use->filling[i] = same->filling[i];
		use->filling[i].ops =
			quern_loader_ops(s->loader, same->filling[i].instance->file, kind, s->report, mark);
	}
	use->n = same->n;
}

void quern_slot_fill(quern_scene *s, quern_slot_use *use, quern_node *node, quern_mark mark) {
	const quern_slot *slot = use->slot;
	if (!node && slot->def) node = default_node(s, slot->def, mark);
	if (!node && (!slot->list || slot->required))
		quern_report_add(s->report, mark, "%s is missing: %s", use->path, slot->doc ? slot->doc : "");
	if (!node) return;
	choice *choices;
	const size_t n = choices_of(s, use->path, node, slot->list, &choices, slot->kind->name);
	for (size_t i = 0; i < n; i++) add_filling(s, use, &choices[i]);
	free(choices);
}

/* "fill.packer": one plugin for each item of the solver's list "fill". */
static void fill_items(quern_scene *s, quern_section *section, quern_slot_use *use) {
	const char *dot = strchr(use->slot->name, '.');
	char *list_name = quern_copy(use->slot->name);
	list_name[dot - use->slot->name] = 0;
	const quern_param *row = quern_param_find(section->solver->file->params, list_name);
	quern_node *node = quern_node_find(section->node, list_name);
	const quern_list *list =
		row ? (const quern_list *)(const void *)((char *)section->solver->self + row->offset) : NULL;
	for (uint32_t i = 0; list && i < list->n; i++) {
		quern_node *item = node && node->kind == QUERN_NODE_LIST ? node->entries[i].value : node;
		quern_slot_fill(s, use, quern_node_find(item, dot + 1), item ? item->mark : section->mark);
	}
	free(list_name);
}

quern_instance *quern_instance_again(
	quern_scene *s, const quern_instance *base, const quern_node *map, quern_mark mark) {
	quern_instance *it = instance_create(s, base->file, map, mark, base->path);
	if (!it) return NULL;
	it->ops = base->ops;
	const size_t before = quern_report_errors(s->report);
	instance_read(s, it, NULL);
	instance_init(s, it, before);
	return it;
}

void quern_slot_refuse_key(quern_scene *s, const quern_slot_use *use, const quern_param *own,
	const char *path, const quern_entry *entry) {
	const quern_reading r = quern_scene_reading(s);
	const quern_node one = { .kind = QUERN_NODE_MAP, .entries = (quern_entry *)(uintptr_t)entry, .n = 1 };
	const char **also = NULL;
	size_t n = 0, capacity = 0;
	for (size_t j = 0; j < use->n; j++) {
		const quern_plugin_file *file = use->filling[j].instance->file;
		also = first_parts(file->params, &n, also, &capacity);
		also = quern_grow(also, n + 1, &capacity, sizeof(char *));
		also[n++] = quern_id_name(file->plugin.id);
	}
	also = quern_grow(also, n, &capacity, sizeof(char *));
	also[n] = NULL;
	quern_params_check(&r, path, own, &one, also);
	free(also);
}

/* ---- sections ---- */

/* What the items of a list take besides their rows is for the plugins of the slot that it refines to check. */
static const char **refining_keys(quern_scene *s, const quern_node *node, const quern_slot *slot,
	const quern_param *own, const char **also, size_t *n, size_t *capacity) {
	const bool list = node && node->kind == QUERN_NODE_LIST;
	for (size_t i = 0; node && i < (list ? node->n : 1); i++) {
		const quern_node *item = list ? node->entries[i].value : node;
		for (size_t e = 0; item->kind == QUERN_NODE_MAP && e < item->n; e++) {
			if (quern_rows_open(own, item->entries[e].key)) continue;
			char *name = quern_format("%s.%s", slot->refine, item->entries[e].key);
			also = quern_grow(also, *n + 1, capacity, sizeof(char *));
			also[(*n)++] = quern_tree_keep(s->tree, name);
			free(name);
		}
	}
	return also;
}

static const char **section_also(
	quern_scene *s, const quern_section *section, const quern_node *node, size_t *n) {
	const char **also = NULL;
	size_t capacity = 0;
	*n = 0;
	for (const quern_slot *slot = section->ops->slots; slot && slot->name; slot++) {
		if (slot->same_as || !*slot->name) continue;
		also = quern_grow(also, *n + 2, &capacity, sizeof(char *));
		also[(*n)++] = slot->name;
		const quern_param *row =
			slot->refine ? quern_param_find(section->solver->file->params, slot->refine) : NULL;
		if (row)
			also = refining_keys(s, quern_node_find(node, slot->refine), slot, row->rows, also, n, &capacity);
	}
	also = quern_grow(also, *n + 1, &capacity, sizeof(char *));
	also[(*n)++] = "solver";
	also[*n] = NULL;
	return also;
}

const void **quern_filling_refined(const quern_filling *f) {
	const size_t n = f->n_refined * (1 + f->n_variant);
	const void **refined = n ? quern_take(n, sizeof(void *)) : NULL;
	for (size_t i = 0; i < n; i++) refined[i] = f->refined[i]->self;
	return refined;
}

/* The plugins of a slot as its solver sees them: with its strides, in memory that finish_slot frees. */
static void *bind_slot(const quern_section *section, const quern_slot_use *use) {
	const size_t stride = section->ops->bound_size;
	char *bound = quern_take(use->n, stride);
	for (size_t i = 0; i < use->n; i++) {
		const quern_filling *f = &use->filling[i];
		const quern_plugin_file *file = f->instance->file;
		const void **variant = quern_take(f->n_variant, sizeof(void *));
		for (size_t v = 0; v < f->n_variant; v++)
			variant[v] = f->variant[v] ? f->variant[v]->self : f->instance->self;
		const quern_bound own = { .self = f->instance->self,
			.ops = f->ops,
			.item = f->item,
			.variant = variant,
			.uses = quern_table_uses_for(&file->table, section->solver->file->library),
			.n_uses = (uint32_t)file->n_uses,
			.id = file->plugin.id,
			.path = use->path,
			.n_variant = (uint32_t)f->n_variant,
			.refined = quern_filling_refined(f),
			.n_refined = (uint32_t)f->n_refined };
		memcpy(bound + i * stride, &own, stride < sizeof own ? stride : sizeof own);
	}
	return bound;
}

static void unbind_slot(const quern_section *section, const quern_slot_use *use, char *bound) {
	for (size_t i = 0; i < use->n; i++) {
		quern_bound own = { 0 };
		const size_t stride = section->ops->bound_size;
		memcpy(&own, bound + i * stride, stride < sizeof own ? stride : sizeof own);
		free((void *)(uintptr_t)own.variant);
		free((void *)(uintptr_t)own.refined);
		free((void *)(uintptr_t)own.uses);
	}
	free(bound);
}

/* Before later slots are filled. A faulty parameter must not reach the solver, which may rely on the ranges of its rows. */
static void tell_filled(
	quern_scene *s, quern_section *section, const quern_slot_use *use, size_t errors_before) {
	if (!use->slot->filled || !section->solver->ready || quern_report_errors(s->report) != errors_before)
		return;
	const quern_setup setup = quern_scene_setup(s, section->name);
	quern_err err = { s->report, section->node, section->mark, section->solver->file->plugin.id };
	quern_bound *bound = bind_slot(section, use);
	quern_watch_enter(section->solver->file->plugin.id, "filled");
	const quern_status status =
		use->slot->filled(section->solver->self, &setup, bound, (uint32_t)use->n, &err);
	quern_watch_leave();
	if (status != QUERN_OK && quern_report_errors(s->report) == errors_before)
		quern_report_add(s->report, section->mark, "%s: cannot be set up", use->path);
	unbind_slot(section, use, (char *)bound);
}

static void section_ready(quern_scene *s, quern_section *section) {
	if (!section->ops->ready || quern_report_errors(s->report)) return;
	const quern_setup setup = quern_scene_setup(s, section->name);
	quern_err err = { s->report, section->node, section->mark, section->solver->file->plugin.id };
	const quern_bound **slots = quern_take(section->n_slots, sizeof(*slots));
	uint32_t *counts = quern_take(section->n_slots, sizeof(uint32_t));
	for (size_t k = 0; k < section->n_slots; k++) {
		slots[k] = bind_slot(section, &section->slots[k]);
		counts[k] = (uint32_t)section->slots[k].n;
	}
	quern_watch_enter(section->solver->file->plugin.id, "ready");
	const quern_status status = section->ops->ready(section->solver->self, &setup, slots, counts, &err);
	quern_watch_leave();
	if (status != QUERN_OK && !quern_report_errors(s->report))
		quern_report_add(s->report, section->mark, "%s: cannot be set up", section->name);
	for (size_t k = 0; k < section->n_slots; k++)
		unbind_slot(section, &section->slots[k], (char *)(uintptr_t)slots[k]);
	free(slots);
	free(counts);
}

/* Of a section that is itself a list: what is left of a map once `solver` has been read. */
static quern_node *without_solver(quern_scene *s, quern_node *node) {
	const quern_node *named = quern_node_find(node, "solver");
	if (!named || named->kind != QUERN_NODE_SCALAR) return node;
	quern_tree *keep = quern_take(1, sizeof *keep);
	s->defaults = quern_grow(s->defaults, s->n_defaults, &s->defaults_capacity, sizeof(keep));
	s->defaults[s->n_defaults++] = keep;
	keep->root = quern_node_create(QUERN_NODE_MAP);
	keep->root->mark = node->mark;
	for (size_t i = 0; i < node->n; i++)
		if (strcmp(node->entries[i].key, "solver") != 0)
			quern_node_merge_entry(keep->root, &node->entries[i]);
	return keep->root;
}

static bool is_folder(const char *path) {
	struct stat is;
	return !stat(path, &is) && S_ISDIR(is.st_mode);
}

/* Where a run stands for its state: RUN for its checkpoint, RUN:FRAME for a frame. A file is taken as it is. */
static void name_state(quern_node *node) {
	char *path = quern_param_path(node), *colon = strrchr(node->text, ':'), *name = NULL;
	const bool numbered = colon && colon[1] && strspn(colon + 1, "0123456789") == strlen(colon + 1);
	if (is_folder(path)) name = quern_format("%s/checkpoint.h5", node->text);
	else if (numbered && strlen(colon) < 18) {
		const size_t behind = strlen(colon), length = strlen(path) - behind;
		path[length] = 0;
		if (is_folder(path))
			name = quern_format(
				"%.*s/frames/%06lld.h5", (int)(colon - node->text), node->text, strtoll(colon + 1, NULL, 10));
	}
	free(path);
	if (!name) return;
	free(node->text);
	node->text = name;
	node->quoted = true;
}

void quern_section_read(quern_scene *s, const quern_plugin_file *file, const quern_entry *entry) {
	quern_node *node = entry->value;
	const quern_solver_ops *starts = file->plugin.ops;
	quern_node *from = starts->from ? quern_node_find(node, starts->from) : NULL;
	if (from && from->kind == QUERN_NODE_SCALAR && *from->text) name_state(from);
	const bool map = node->kind == QUERN_NODE_MAP;
	quern_instance *solver = instance_create(s, file, map ? node : NULL, entry->mark, entry->key);
	if (!solver) return;
	solver->ops = file->plugin.ops;
	quern_section *section = &s->sections[s->n_sections++];
	*section = (quern_section) {
		.name = entry->key, .node = node, .mark = entry->mark, .ops = file->plugin.ops, .solver = solver
	};
	for (const quern_slot *slot = section->ops->slots; slot->name; slot++) section->n_slots++;
	section->slots = quern_take(section->n_slots, sizeof(quern_slot_use));
	bool is_list = false; /* the section is itself the list of its one slot */
	for (size_t k = 0; k < section->n_slots; k++) {
		quern_slot_use *use = &section->slots[k];
		use->slot = &section->ops->slots[k];
		use->path = *use->slot->name ? quern_format("%s.%s", section->name, use->slot->name)
									 : quern_copy(section->name);
		is_list = is_list || !*use->slot->name;
	}
	char say[64];
	if (!map && !is_list) {
		quern_report_add(
			s->report, node->mark, "%s must be a map, not %s", section->name, quern_node_say(node, say));
		for (size_t k = 0; k < section->n_slots; k++) free(section->slots[k].path);
		free(section->slots);
		s->n_sections--;
		return;
	}
	size_t n;
	const char **also = section_also(s, section, map ? node : NULL, &n);
	const size_t before = quern_report_errors(s->report);
	if (is_list) section->solver->map = NULL;
	quern_node *rest = is_list && map ? without_solver(s, node) : node;
	instance_read(s, section->solver, also);
	instance_init(s, section->solver, before);
	free(also);
	for (size_t k = 0; k < section->n_slots; k++) {
		quern_slot_use *use = &section->slots[k];
		const quern_slot *slot = use->slot;
		if (slot->same_as) {
			const quern_slot_use *same = find_slot(s, slot->same_as);
			use->borrowed = true;
			if (same) borrow(s, use, same, section->mark);
		} else if (!*slot->name) quern_slot_fill(s, use, rest, section->mark);
		else if (strchr(slot->name, '.')) fill_items(s, section, use);
		else quern_slot_fill(s, use, quern_node_find(node, slot->name), section->mark);
		if (!slot->same_as) quern_slot_override(s, section, use);
		tell_filled(s, section, use, before);
	}
	section_ready(s, section);
}

void quern_slot_finish(quern_slot_use *use) {
	free(use->path);
	if (use->borrowed) {
		free(use->filling);
		return;
	}
	for (size_t i = 0; i < use->n; i++) {
		free(use->filling[i].variant);
		free(use->filling[i].refined);
		if (use->slot->rows && use->filling[i].item)
			quern_params_finish(use->slot->rows, use->filling[i].item);
		free(use->filling[i].item);
	}
	free(use->filling);
}

void quern_instance_destroy(quern_instance *it) {
	if (!it) return;
	if (it->ready && it->file->plugin.finish) {
		quern_watch_enter(it->file->plugin.id, "finish");
		it->file->plugin.finish(it->self);
		quern_watch_leave();
	}
	quern_params_finish(it->file->params, it->self);
	free(it->self);
	free(it->path);
	free(it);
}
