/* SPDX-License-Identifier: MIT */
#include "start.h"
#include "identity.h"
#include "start_file.h"
#include <stdlib.h>
#include <string.h>

typedef struct {
	quern_run *run;
	const quern_section *section;
	const char *path;
	quern_start_file file;
	quern_text why, lost; /* why it is refused; fields that begin anew */
} starting;

static const char *file_of(const quern_section *section) {
	const char *path = NULL;
	const quern_param *row =
		section->ops->from ? quern_param_find(section->solver->file->params, section->ops->from) : NULL;
	if (row) memcpy(&path, (const char *)section->solver->self + row->offset, sizeof path);
	return path;
}

/* ---- the files ---- */

void quern_start_hold(quern_run *run) {
	const size_t n = run->scene->n_sections;
	if (run->held) return;
	run->held = quern_take(n, sizeof *run->held);
	for (size_t i = 0; i < n; i++) run->held[i] = quern_start_file_hold(file_of(&run->scene->sections[i]));
}

void quern_start_let_go(quern_run *run) {
	for (size_t i = 0; run->held && i < run->scene->n_sections; i++) quern_start_file_let_go(&run->held[i]);
	free(run->held);
	run->held = NULL;
}

char *quern_start_held(const quern_run *run, const char *path) {
	for (size_t i = 0; run->held && i < run->scene->n_sections; i++)
		if (run->held[i].file >= 0 && !strcmp(run->held[i].path, path))
			return quern_start_file_name(&run->held[i]);
	return quern_copy(path);
}

/* Whether its entries point at what a slot holds. */
static bool hangs_on_slot(const quern_set_store *set) { return set->table && set->table->slot; }

/* ---- whether the two scenes fit ---- */

static const char *text_of(const quern_node *node) {
	return node && node->kind == QUERN_NODE_SCALAR ? node->text : "";
}

/* Item i of "materials.name", or the one value of "cell"; NULL where there is none. */
static const quern_node *value_of(const quern_node *section, const char *name, size_t i) {
	char head[64];
	snprintf(head, sizeof head, "%.*s", (int)strcspn(name, "."), name);
	const quern_node *node =
		section && section->kind == QUERN_NODE_MAP ? quern_node_find(section, head) : NULL;
	if (!strchr(name, '.')) return i ? NULL : node;
	if (!node || node->kind != QUERN_NODE_LIST || i >= node->n) return NULL;
	return quern_node_find(node->entries[i].value, strchr(name, '.') + 1);
}

static bool parameters_hold(starting *s, const quern_node *was, const quern_node *is) {
	for (const char *const *name = s->section->ops->same; name && *name; name++)
		for (size_t i = 0; value_of(was, *name, i); i++) {
			const quern_node *old = value_of(was, *name, i), *own = value_of(is, *name, i);
			if (!strcmp(text_of(old), text_of(own))) continue;
			quern_text_add(&s->why, "its %s.%s was %s and is %s here: it must be the same", s->section->name,
				*name, text_of(old), own ? text_of(own) : "not given");
			return false;
		}
	return true;
}

static bool says_section(const quern_start_file *f, const char *name) {
	char *word = quern_format(" %s ", name);
	const bool says = strstr(f->sections, word);
	free(word);
	return says;
}

static bool scenes_fit(starting *s) {
	const quern_node *root = s->file.scene->root;
	const int32_t dimension = s->run->scene->general.dimension;
	if (s->file.dimension != dimension) {
		quern_text_add(&s->why, "it is of a run in %lld dimensions, and this one has %d",
			(long long)s->file.dimension, dimension);
		return false;
	}
	const bool known = root && root->kind == QUERN_NODE_MAP;
	for (const char *const *name = s->section->ops->unlike; name && *name; name++)
		if (says_section(&s->file, *name) || (known && quern_node_find(root, *name))) {
			quern_text_add(&s->why,
				"it is of a run with a section %s, with which %s shared what it had: start from a run without",
				*name, s->section->name);
			return false;
		}
	if (!known) return true;
	quern_node *own = quern_run_tree(s->run);
	const bool good =
		parameters_hold(s, quern_node_find(root, s->section->name), quern_node_find(own, s->section->name));
	quern_node_destroy(own);
	return good;
}

/* The run's plugins of that slot are the first ones here, in the same order. */
static bool slot_holds(const starting *s, const char *slot) {
	const quern_slot_use *use = NULL;
	for (size_t k = 0; k < s->section->n_slots; k++)
		if (!strcmp(s->section->slots[k].slot->name, slot)) use = &s->section->slots[k];
	if (!use || !s->file.scene->root || s->file.scene->root->kind != QUERN_NODE_MAP) return false;
	const char *at = use->slot->same_as ? use->slot->same_as : use->path;
	char *head = quern_format("%.*s", (int)strcspn(at, "."), at);
	const quern_node *list = quern_node_find(s->file.scene->root, head);
	free(head);
	if (list && strchr(at, '.')) list = quern_node_find(list, strchr(at, '.') + 1);
	if (!list || list->kind != QUERN_NODE_LIST || list->n > use->n) return false;
	for (size_t i = 0; i < list->n; i++) {
		const quern_node *item = list->entries[i].value;
		if (item->kind != QUERN_NODE_MAP || !item->n ||
			strcmp(item->entries[0].key, quern_id_name(use->filling[i].instance->file->plugin.id)) != 0)
			return false;
	}
	return true;
}

/* ---- fields ---- */

/* The use that makes a field, be it a stage's or a plugin's. */
static const quern_plan_use *maker_of(const quern_plan *plan, size_t field) {
	for (size_t i = 0; i < plan->n_uses; i++)
		if (plan->uses[i].target == (int)field && plan->uses[i].row->access != QUERN_READ)
			return &plan->uses[i];
	return NULL;
}

static bool is_plugin(const quern_scene *scene, const char *owner) {
	for (size_t i = 0; i < quern_loader_count(scene->loader); i++)
		if (!strcmp(quern_loader_at(scene->loader, i)->plugin.id, owner)) return true;
	return false;
}

/* Whether the file has what this field means here. */
static bool is_given(const starting *s, hid_t group, size_t k) {
	const quern_field *field = &s->run->plan->store.fields[k];
	const quern_plan_use *maker = maker_of(s->run->plan, k);
	if (!quern_start_file_has(&s->file, group, field)) return false;
	return !maker || !is_plugin(s->run->scene, maker->owner) ||
		   quern_start_file_knows(&s->file, group, field, maker->owner);
}

static bool is_essential(const starting *s, const quern_field *field) {
	for (const char *const *name = s->section->ops->essential; *name; name++)
		if (!strcmp(*name, field->name)) return true;
	return field->shape == QUERN_INDEX && field->target >= 0 && field->initial != QUERN_NO_TARGET;
}

/* What is worth a word: state of this section's own that is not there. What a stage keeps and a checkpoint does not have was
 * not needed, and so is what it is at the start; the same goes for what every frame shows. */
static void note_lost(starting *s, size_t k) {
	const quern_field *field = &s->run->plan->store.fields[k];
	const quern_plan_use *maker = maker_of(s->run->plan, k);
	if (!field->state || !maker || maker->stage < 0 ||
		s->run->plan->stages[maker->stage].section != s->section)
		return;
	const bool plugin = is_plugin(s->run->scene, maker->owner);
	const bool asked =
		s->file.frame && maker->row->flags & QUERN_OPTIONAL && !(maker->row->flags & QUERN_SHOWN);
	if (!plugin && !asked) return;
	quern_text_add(&s->lost, "%s%s", s->lost.length ? ", " : "", field->name);
	if (plugin) quern_text_add(&s->lost, " of %s", maker->owner);
}

static bool is_meant(const quern_field *field, int set) {
	return field->set == set && !field->local && (field->kept || field->shape == QUERN_ID);
}

/* False where a set cannot stand without what is missing; `why` says so of the first set. */
static bool all_essential(starting *s, hid_t group, int set) {
	const quern_store *store = &s->run->plan->store;
	for (size_t k = 0; k < store->n_fields; k++) {
		const quern_field *field = &store->fields[k];
		if (field->set != set || field->local || !is_essential(s, field) || is_given(s, group, k)) continue;
		quern_text_add(&s->why, "it holds no %s%s", field->name,
			s->file.frame ? ": a frame has what output.fields of its scene names, a checkpoint has all" : "");
		return false;
	}
	return true;
}

/* Memory is taken only for what the file does hold. */
static bool sizes_hold(starting *s, hid_t group, int set, uint32_t n) {
	const quern_store *store = &s->run->plan->store;
	for (size_t k = 0; k < store->n_fields; k++) {
		const quern_field *field = &store->fields[k];
		if (!is_meant(field, set) || !is_given(s, group, k) ||
			quern_start_file_holds(&s->file, group, field, n))
			continue;
		return quern_text_add(&s->why, "it is damaged: %s does not fit its set", field->name), false;
	}
	return true;
}

static bool read_fields(starting *s, hid_t group, int set, uint32_t n) {
	quern_store *store = &s->run->plan->store;
	for (size_t k = 0; k < store->n_fields; k++) {
		const quern_field *field = &store->fields[k];
		if (!is_meant(field, set)) continue;
		if (!is_given(s, group, k)) note_lost(s, k);
		else if (quern_start_file_read(&s->file, group, store, field, n)) s->run->taken[k] = true;
		else return quern_text_add(&s->why, "it is damaged: %s does not fit its set", field->name), false;
	}
	return true;
}

static int by_size(const void *a, const void *b) {
	const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
	return (x > y) - (x < y);
}

/* Numbers are given once, also where all that had one have left; frames do not say which was the last. */
static bool number(starting *s, int set, int64_t next_id) {
	quern_store *store = &s->run->plan->store;
	quern_set_store *of = &store->sets[set];
	of->next_id = next_id;
	for (size_t k = 0; k < store->n_fields; k++) {
		const quern_field *field = &store->fields[k];
		if (!is_meant(field, set) || field->shape != QUERN_ID || !s->run->taken[k] || !of->n) continue;
		int64_t *sorted = quern_take(of->n, sizeof *sorted);
		memcpy(sorted, field->data[field->now][0], of->n * sizeof *sorted);
		qsort(sorted, of->n, sizeof *sorted, by_size);
		const int64_t last = sorted[of->n - 1];
		bool good = sorted[0] >= 0 && last < (int64_t)1 << 53 && (s->file.frame || last < next_id);
		for (uint32_t i = 1; i < of->n && good; i++) good = sorted[i] > sorted[i - 1];
		free(sorted);
		if (s->file.frame) of->next_id = last + 1;
		if (!good)
			return quern_text_add(&s->why, "it is damaged: two entries have one %s", field->name), false;
	}
	return true;
}

static bool fields_hold(starting *s, int set) {
	const quern_store *store = &s->run->plan->store;
	for (size_t k = 0; k < store->n_fields; k++) {
		if (store->fields[k].set != set || !s->run->taken[k]) continue;
		const char *fault = quern_state_fault(s->run, &store->fields[k]);
		if (!fault) continue;
		quern_text_add(&s->why, "it is damaged: %s holds %s", store->fields[k].name, fault);
		return false;
	}
	return true;
}

/* ---- sets ---- */

/* `first`: without it there is nothing to start from; another set is left empty where it cannot be taken. */
static bool take_set(starting *s, int set, bool first) {
	quern_store *store = &s->run->plan->store;
	const char *slot = store->sets[set].table ? store->sets[set].table->slot : NULL;
	uint32_t n = 0;
	int64_t next_id = 0;
	/* a frame that was copied does not know its scene any more: what hangs on a slot begins anew in any case */
	const bool strange = slot && (s->file.frame || !slot_holds(s, slot));
	const hid_t group = strange ? -1 : quern_start_file_set(&s->file, &store->sets[set], &n, &next_id);
	bool there = group >= 0 && all_essential(s, group, set);
	if (first && group < 0) quern_text_add(&s->why, "it holds no %s", quern_set_plural(&store->sets[set]));
	if (!first && !there) {
		quern_text_finish(&s->why);
		quern_text_add(&s->lost, "%sall %s", s->lost.length ? ", " : "", quern_set_plural(&store->sets[set]));
	}
	bool good = (there || !first) && (!there || sizes_hold(s, group, set, n));
	if (there && good && quern_store_fill(store, set, n) != QUERN_OK)
		good = false, quern_text_add(&s->why, "there is no memory for %u entries", n);
	else if (there && good)
		good = read_fields(s, group, set, n) && number(s, set, next_id) && fields_hold(s, set);
	if (group >= 0) H5Gclose(group);
	return good;
}

static void tell(const starting *s, bool rest) {
	quern_run *run = s->run;
	const char *const *takes = s->section->ops->takes;
	if (!run->log) return;
	const quern_set_store *set = &run->plan->store.sets[quern_store_set(&run->plan->store, takes[0])];
	if (!rest)
		quern_log_add(run->log, 1, "%s: %u %s from %s, at its t = %.6g s", s->section->name, set->n,
			quern_set_plural(set), s->path, s->file.time);
	if (s->lost.length)
		quern_log_add(run->log, 1, "%s: not in %s, or of others than here, so that it begins anew: %s",
			s->section->name, s->path, s->lost.data);
}

static bool take_sets(starting *s, bool rest) {
	const quern_store *store = &s->run->plan->store;
	const char *const *takes = s->section->ops->takes;
	for (size_t i = 0; takes[i]; i++) {
		const int set = quern_store_set(store, takes[i]);
		if (set >= 0 && hangs_on_slot(&store->sets[set]) == rest && !take_set(s, set, i == 0)) return false;
	}
	return true;
}

/* As a frame calls the sets. */
static const char **groups_of(const starting *s) {
	const quern_store *store = &s->run->plan->store;
	const char *const *takes = s->section->ops->takes;
	size_t n = 0, found = 0;
	while (takes[n]) n++;
	const char **names = quern_take(n + 1, sizeof *names);
	for (size_t i = 0; i < n; i++) {
		const int set = quern_store_set(store, takes[i]);
		if (set >= 0) names[found++] = quern_set_plural(&store->sets[set]);
	}
	return names;
}

static bool is_same(const quern_node *a, const quern_node *b) {
	if (!a || !b || a->kind != b->kind) return a == b;
	if (a->kind == QUERN_NODE_SCALAR) return !strcmp(a->text, b->text);
	if (a->n != b->n) return false;
	for (size_t i = 0; i < a->n; i++)
		if ((a->kind == QUERN_NODE_MAP && strcmp(a->entries[i].key, b->entries[i].key) != 0) ||
			!is_same(a->entries[i].value, b->entries[i].value))
			return false;
	return true;
}

static bool knows(const starting *s, const char *id) {
	/* frames do not say who took part */
	return !s->file.frame && quern_start_file_knows(&s->file, -1, NULL, id);
}

/* Which plugins in this section's own slots took part and stood there as they do here. Others are another section's, which may
 * have started from another run. */
static void note_plugins(starting *s) {
	bool *took = s->run->taken + s->run->plan->store.n_fields, *seen;
	const quern_loader *loader = s->run->scene->loader;
	const size_t n = quern_loader_count(loader);
	quern_node *root = quern_run_tree(s->run);
	const quern_node *own = quern_node_find(root, s->section->name);
	const quern_node *was =
		s->file.scene->root ? quern_node_find(s->file.scene->root, s->section->name) : NULL;
	seen = quern_take(n, sizeof *seen);
	for (size_t k = 0; k < s->section->n_slots && own; k++) {
		const quern_slot_use *use = &s->section->slots[k];
		if (use->slot->same_as) continue;
		const bool same =
			was && is_same(quern_node_find(own, use->slot->name), quern_node_find(was, use->slot->name));
		for (size_t j = 0; j < use->n; j++)
			for (size_t i = 0; i < n; i++) {
				if (quern_loader_at(loader, i) != use->filling[j].instance->file) continue;
				took[i] = same && knows(s, quern_loader_at(loader, i)->plugin.id) && (took[i] || !seen[i]);
				seen[i] = true;
			}
	}
	free(seen);
	quern_node_destroy(root);
}

static quern_status start(quern_run *run, const quern_section *section, const char *path, bool rest) {
	starting s = { .run = run, .section = section, .path = path };
	const char **groups = groups_of(&s);
	const quern_held *held = run->held ? &run->held[section - run->scene->sections] : NULL;
	const bool good =
		quern_start_file_open(&s.file, path, held, groups, &s.why) && scenes_fit(&s) && take_sets(&s, rest);
	if (good) tell(&s, rest), note_plugins(&s);
	else {
		char *param = quern_format("%s.%s", section->name, section->ops->from);
		quern_run_refuse(run, param, "%s: %s", path, quern_text_string(&s.why));
		free(param);
	}
	quern_plan_refresh(run->plan);
	quern_start_file_finish(&s.file);
	quern_text_finish(&s.why);
	quern_text_finish(&s.lost);
	free(groups);
	return run->status;
}

static quern_status start_all(quern_run *run, bool rest) {
	for (size_t i = 0; i < run->scene->n_sections && run->status == QUERN_OK; i++) {
		const char *path = file_of(&run->scene->sections[i]);
		if (!path) continue;
		if (!run->taken)
			run->taken =
				quern_take(run->plan->store.n_fields + quern_loader_count(run->scene->loader), sizeof(bool));
		start(run, &run->scene->sections[i], path, rest);
	}
	return run->status;
}

quern_status quern_start_read(quern_run *run) { return start_all(run, false); }
quern_status quern_start_read_rest(quern_run *run) { return start_all(run, true); }

bool quern_start_took(quern_run *run, const char *name) {
	const int k = run->taken ? quern_store_field(&run->plan->store, name) : -1;
	if (k >= 0 || !run->taken) return k >= 0 && run->taken[k];
	for (size_t i = 0; i < quern_loader_count(run->scene->loader); i++)
		if (!strcmp(quern_loader_at(run->scene->loader, i)->plugin.id, name))
			return run->taken[run->plan->store.n_fields + i];
	return false;
}
