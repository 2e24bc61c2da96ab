/* SPDX-License-Identifier: MIT */
#include "identity.h"
#include "start.h"
#include <stdlib.h>
#include <string.h>

enum { MOST_NAMED = 4 };

/* Keys that a run may change when it goes on. Results depend on none of the first ones; with output.every the steps
 * change a little, from then on. */
static const char *const may_change[] = { "name", "time.end", "output.compress", "checkpoint.every",
	"run.batch", "run.instructions", "output.every" };
enum { N_FREE = 6, N_MAY_CHANGE = 7 };

/* ---- the scene as a text ---- */

static char *contents_of(void *context, const char *path) {
	uint64_t hash;
	const quern_run *const *run = context;
	char *held = quern_start_held(*run, path);
	const bool good = quern_hash_file(held, 0, &hash);
	free(held);
	if (!good) return quern_format("a file that cannot be read");
	return quern_format("a file with the hash %016llx", (unsigned long long)hash);
}

static void drop(quern_node *map, const char *path) {
	const size_t n = strcspn(path, ".");
	for (size_t i = 0; map && map->kind == QUERN_NODE_MAP && i < map->n; i++) {
		quern_entry *e = &map->entries[i];
		if (strncmp(e->key, path, n) != 0 || e->key[n]) continue;
		if (path[n]) {
			drop(e->value, path + n + 1);
			return;
		}
		free(e->key);
		quern_node_destroy(e->value);
		memmove(e, e + 1, (--map->n - i) * sizeof *e);
		return;
	}
}

quern_node *quern_run_tree(const quern_run *run) {
	const quern_naming by_contents = { contents_of, &run };
	return quern_scene_tree(run->scene, &by_contents);
}

const char *quern_run_identity(quern_run *run) {
	if (run->identity) return run->identity;
	quern_node *root = quern_run_tree(run);
	quern_text whole = { 0 }, fixed = { 0 };
	quern_node_print(root, 0, &whole);
	for (int k = 0; k < N_FREE; k++) drop(root, may_change[k]);
	quern_node_print(root, 0, &fixed);
	quern_node_destroy(root);
	run->scene_hash = quern_hash(quern_text_string(&fixed), fixed.length);
	quern_text_finish(&fixed);
	return run->identity = whole.data;
}

uint64_t quern_run_scene_hash(quern_run *run) {
	quern_run_identity(run);
	return run->scene_hash;
}

/* ---- what differs between two ---- */

typedef struct {
	quern_text *allowed, *refused;
	size_t n_refused;
} differences;

static void say(quern_text *out, const quern_node *node) {
	char buffer[64];
	quern_text_add(out, "%s", node ? quern_node_say(node, buffer) : "not given");
}

static void note(differences *d, const char *path, const quern_node *was, const quern_node *is) {
	bool allowed = false;
	for (int k = 0; k < N_MAY_CHANGE; k++) allowed = allowed || !strcmp(may_change[k], path);
	if (!allowed && d->n_refused++ >= MOST_NAMED) return;
	quern_text *out = allowed ? d->allowed : d->refused;
	if (!allowed && out->length) quern_text_add(out, ", ");
	quern_text_add(out, "%s was ", path);
	say(out, was);
	quern_text_add(out, " and is ");
	say(out, is);
	if (allowed) quern_text_add(out, "\n");
}

static void compare(differences *d, const char *path, const quern_node *was, const quern_node *is);

static void compare_child(
	differences *d, const char *path, const char *key, const quern_node *was, const quern_node *is) {
	char *below = *path ? quern_format("%s.%s", path, key) : quern_copy(key);
	compare(d, below, was, is);
	free(below);
}

static void compare_maps(differences *d, const char *path, const quern_node *was, const quern_node *is) {
	for (size_t i = 0; i < was->n; i++)
		compare_child(
			d, path, was->entries[i].key, was->entries[i].value, quern_node_find(is, was->entries[i].key));
	for (size_t i = 0; i < is->n; i++)
		if (!quern_node_find(was, is->entries[i].key))
			compare_child(d, path, is->entries[i].key, NULL, is->entries[i].value);
}

static void compare_lists(differences *d, const char *path, const quern_node *was, const quern_node *is) {
	for (size_t i = 0; i < was->n || i < is->n; i++) {
		char number[24];
		snprintf(number, sizeof number, "%zu", i);
		compare_child(d, path, number, i < was->n ? was->entries[i].value : NULL,
			i < is->n ? is->entries[i].value : NULL);
	}
}

static void compare(differences *d, const char *path, const quern_node *was, const quern_node *is) {
	if (quern_node_is_null(was) && quern_node_is_null(is)) return;
	if (!was || !is || was->kind != is->kind) note(d, path, was, is);
	else if (was->kind == QUERN_NODE_MAP) compare_maps(d, path, was, is);
	else if (was->kind == QUERN_NODE_LIST) compare_lists(d, path, was, is);
	else if (strcmp(was->text, is->text) != 0) note(d, path, was, is);
}

static quern_tree *read_back(const char *text) {
	quern_report *report = quern_report_create();
	quern_tree *tree = quern_tree_parse("checkpoint", text, strlen(text), report);
	quern_report_destroy(report);
	return tree;
}

bool quern_identity_compare(const char *was, const char *is, quern_text *allowed, quern_text *refused) {
	quern_tree *a = read_back(was), *b = read_back(is);
	const bool good = a->root && b->root;
	differences d = { allowed, refused, 0 };
	if (good) compare(&d, "", a->root, b->root);
	if (d.n_refused > MOST_NAMED) quern_text_add(refused, " and %zu more", d.n_refused - MOST_NAMED);
	quern_tree_destroy(a);
	quern_tree_destroy(b);
	return good;
}

double quern_identity_every(const char *text) {
	quern_tree *tree = read_back(text);
	const quern_node *node =
		tree->root ? quern_node_find(quern_node_find(tree->root, "output"), "every") : NULL;
	const double every = node && node->kind == QUERN_NODE_SCALAR ? strtod(node->text, NULL) : 0;
	quern_tree_destroy(tree);
	return every;
}

/* ---- plugins ---- */

static uint64_t hash_of(const quern_plugin_file *file) {
	uint64_t hash = file->hash;
	const size_t n = strlen(file->path), suffix = strlen(".v3.so");
	if (file->level == 1 || n <= suffix) return hash;
	char *baseline = quern_format("%.*s.so", (int)(n - suffix), file->path);
	quern_hash_file(baseline, 0, &hash); /* if there is none, the loaded object stands for itself */
	free(baseline);
	return hash;
}

uint64_t *quern_plugin_hashes(const quern_loader *loader) {
	uint64_t *hashes = quern_take(quern_loader_count(loader), sizeof *hashes);
	for (size_t i = 0; i < quern_loader_count(loader); i++) hashes[i] = hash_of(quern_loader_at(loader, i));
	return hashes;
}

uint64_t quern_run_plugin(const quern_run *run, size_t i) { return run->plugins[i]; }
