/* SPDX-License-Identifier: MIT */
#include "settled.h"
#include "config.h"
#include "folder.h"
#include "identity.h"
#include "state.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char format[] = "quern-settled 1";
static const double worth = 5e6; /* entries times steps: a tenth of a second */
static const double most_bytes = 2147483648.0;

static bool settles(const quern_field *field) { return field->settles || field->shape == QUERN_ID; }

/* ---- what a settled state depends on ---- */

/* A section that settles, or has a say in how others do. */
static bool acts(const quern_plan *plan, const quern_section *section) {
	for (size_t i = 0; i < plan->n_uses; i++) {
		const quern_plan_use *u = &plan->uses[i];
		if (u->target < 0 || u->stage < 0 || plan->stages[u->stage].section != section) continue;
		if (plan->stages[u->stage].settles && quern_plan_settles(u->row)) return true;
	}
	return section->ops->settled != NULL;
}

/* Sections that act while settling, and those whose plugins they borrow. */
static bool concerns(const quern_run *run, const quern_section *section) {
	const quern_scene *scene = run->scene;
	for (size_t i = 0; i < scene->n_sections; i++) {
		const quern_section *s = &scene->sections[i];
		if (!acts(run->plan, s)) continue;
		if (s == section) return true;
		for (size_t k = 0; k < s->n_slots; k++) {
			const char *from = s->slots[k].slot->same_as;
			const size_t n = strlen(section->name);
			if (from && !strncmp(from, section->name, n) && (!from[n] || from[n] == '.')) return true;
		}
	}
	return false;
}

static void add_plugin(const quern_run *run, const quern_plugin_file *file, quern_text *out) {
	for (size_t i = 0; i < quern_loader_count(run->scene->loader); i++)
		if (quern_loader_at(run->scene->loader, i) == file)
			quern_text_add(
				out, "%s %016llx\n", file->plugin.id, (unsigned long long)quern_run_plugin(run, i));
}

static void add_section(
	const quern_run *run, const quern_section *section, const quern_node *root, quern_text *out) {
	quern_text_add(out, "%s\n", section->name);
	const quern_node *node = quern_node_find(root, section->name);
	if (node) quern_node_print(node, 1, out);
	quern_text_add(out, "\n");
	add_plugin(run, section->solver->file, out);
	for (size_t k = 0; k < section->n_slots; k++)
		for (size_t i = 0; i < section->slots[k].n; i++)
			add_plugin(run, section->slots[k].filling[i].instance->file, out);
}

static bool is_meant(const quern_run *run, int set) {
	for (size_t k = 0; k < run->plan->store.n_fields; k++)
		if (run->plan->store.fields[k].set == set && run->plan->store.fields[k].settles) return true;
	return false;
}

/* Read by a stage that settles, or by a plugin that it calls, and set up by a section that the key does not hold. */
static bool is_given(const quern_run *run, int field) {
	const quern_plan *plan = run->plan;
	bool read = false, given = false;
	for (size_t i = 0; i < plan->n_uses; i++) {
		const quern_plan_use *u = &plan->uses[i];
		if (u->target != field || u->stage < 0) continue;
		const quern_plan_stage *stage = &plan->stages[u->stage];
		const bool reads = u->row->access == QUERN_READ || u->row->access == QUERN_UPDATE;
		const bool writes = stage->phase == QUERN_SETUP && u->row->access != QUERN_READ;
		read = read || (stage->settles && reads);
		given = given || (writes && stage->section && !concerns(run, stage->section));
	}
	return read && given;
}

/* Whoever has had a hand in the set-up: what settles begins with these numbers. */
static uint64_t beginning(const quern_run *run) {
	const quern_store *store = &run->plan->store;
	uint64_t hash = quern_hash("", 0);
	for (size_t k = 0; k < store->n_fields; k++) {
		const quern_field *field = &store->fields[k];
		const quern_set_store *set = &store->sets[field->set];
		const bool begins = field->shape == QUERN_ID || (field->settles && field->state);
		if (field->local || set->rows || !(is_given(run, (int)k) || (begins && is_meant(run, field->set))))
			continue;
		hash = quern_hash_more(hash, field->name, strlen(field->name));
		for (uint8_t c = 0; c < field->n_components; c++)
			hash = quern_hash_more(hash, field->data[field->now][c], set->n * quern_field_bytes(field));
	}
	return hash;
}

static bool anything_settles(const quern_scene *scene) {
	for (size_t i = 0; i < scene->n_sections; i++)
		if (scene->sections[i].ops->settled) return true;
	return false;
}

char *quern_settled_key(const quern_run *run) {
	static const char *const keys[] = { "dimension", "seed", "gravity", "domain" };
	uint64_t program = 0;
	quern_text out = { 0 };
	if (!anything_settles(run->scene)) return NULL;
	quern_hash_file("/proc/self/exe", 0, &program);
	quern_text_add(&out, "quern " QUERN_VERSION " %016llx\n", (unsigned long long)program);
	quern_node *root = quern_run_tree(run);
	for (size_t k = 0; k < sizeof keys / sizeof *keys; k++) {
		const quern_node *node = quern_node_find(root, keys[k]);
		quern_text_add(&out, "%s\n", keys[k]);
		if (node) quern_node_print(node, 1, &out);
		quern_text_add(&out, "\n");
	}
	for (size_t i = 0; i < run->scene->n_sections; i++) {
		const quern_section *section = &run->scene->sections[i];
		if (concerns(run, section)) add_section(run, section, root, &out);
	}
	quern_node_destroy(root);
	quern_text_add(&out, "beginning %016llx\n", (unsigned long long)beginning(run));
	return out.data;
}

/* NULL where QUERN_CACHE is empty, or no home is known: then nothing is kept. */
static char *cache_folder(void) {
	const char *own = getenv("QUERN_CACHE"), *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
	if (own) return *own ? quern_copy(own) : NULL;
	if (cache && *cache == '/') return quern_format("%s/quern", cache);
	return home && *home == '/' ? quern_format("%s/.cache/quern", home) : NULL;
}

/* ---- taking ---- */

static int id_field(const quern_store *store, int set) {
	for (int k = 0; k < (int)store->n_fields; k++)
		if (store->fields[k].set == set && store->fields[k].shape == QUERN_ID && !store->fields[k].local)
			return k;
	return -1;
}

typedef struct {
	int64_t id;
	int32_t at;
} numbered;

static int by_number(const void *a, const void *b) {
	const int64_t x = ((const numbered *)a)->id, y = ((const numbered *)b)->id;
	return (x > y) - (x < y);
}

/* In the order of their numbers, which may be anything below 2^53: no table has room for all. */
static numbered *in_order(const int64_t *id, uint32_t n) {
	numbered *list = malloc(((size_t)n + 1) * sizeof *list);
	for (uint32_t i = 0; list && i < n; i++) list[i] = (numbered) { id[i], (int32_t)i };
	if (list) qsort(list, n, sizeof *list, by_number);
	return list;
}

static bool match(const int64_t *is, const int64_t *wanted, uint32_t n, int32_t *from) {
	numbered *here = in_order(is, n), *there = in_order(wanted, n);
	bool good = here && there;
	for (uint32_t i = 0; good && i < n; i++) {
		good = here[i].id == there[i].id && (!i || there[i].id > there[i - 1].id);
		from[there[i].at] = here[i].at;
	}
	free(here);
	free(there);
	return good;
}

/* Nothing of an entry is as it was before settling, so that it does not matter which one it was. */
static bool all_settles(const quern_store *store, int set) {
	for (size_t k = 0; k < store->n_fields; k++)
		if (store->fields[k].set == set && store->fields[k].state && !store->fields[k].settles) return false;
	return true;
}

/* Where each entry of the file stands in the set as the set-up has left it: what settling leaves alone goes along with the
 * number. NULL if they are not the same entries. */
static int32_t *places(quern_run *run, const quern_state_group *g, int set) {
	quern_store *store = &run->plan->store;
	const int id = id_field(store, set);
	const uint32_t n = store->sets[set].n;
	int32_t *from = malloc(((size_t)g->n + 1) * sizeof *from);
	bool good = from && (id < 0 || (n == g->n && g->next_id == store->sets[set].next_id));
	for (uint32_t i = 0; good && id < 0 && i < g->n; i++) from[i] = n == g->n ? (int32_t)i : -1;
	good = good && (id >= 0 || n == g->n || n == 0 || all_settles(store, set));
	if (good && id >= 0) {
		char name[64];
		int64_t *wanted = malloc(((size_t)n + 1) * sizeof *wanted);
		snprintf(name, sizeof name, "%s.0", strchr(store->fields[id].name, '.') + 1);
		good = wanted && quern_h5_read(g->at, name, H5T_NATIVE_INT64, n, 1, wanted) &&
			   match(store->fields[id].data[store->fields[id].now][0], wanted, n, from);
		free(wanted);
	}
	if (good) return from;
	free(from);
	return NULL;
}

typedef struct {
	int set;
	quern_state_group group;
	int32_t *from;
} taking;

/* Everything is looked at before anything is changed. */
static bool look(quern_run *run, quern_h5 *h, const char *depends, taking *t, size_t *n) {
	const quern_store *store = &run->plan->store;
	quern_text why = { 0 };
	char is[32];
	size_t length = 0, columns = 0;
	bool good = quern_h5_read_text(h->file, "format", is, sizeof is) && !strcmp(is, format) &&
				quern_h5_read_size(h->file, "depends", &length, &columns) && length == strlen(depends);
	char *text = good ? quern_take(length + 1, 1) : NULL;
	good = good && quern_h5_read(h->file, "depends", H5T_NATIVE_UINT8, length, 1, text) &&
		   !memcmp(text, depends, length);
	free(text);
	for (int s = 0; good && s < (int)store->n_sets; s++) {
		if (!is_meant(run, s)) continue;
		taking *one = &t[*n];
		*one = (taking) { .set = s };
		good = !store->sets[s].rows && quern_state_find(run, h->file, s, settles, &one->group, &why);
		*n += good;
		one->from = good ? places(run, &one->group, s) : NULL;
		good = good && one->from;
	}
	quern_text_finish(&why);
	return good;
}

static bool read_clock(quern_run *run, quern_h5 *h) {
	quern_clock *c = &run->clock;
	const int64_t most = (int64_t)1 << 53; /* as in a checkpoint */
	int64_t steps = 0;
	double dt = 0;
	if (!quern_h5_read_integer(h->file, "steps", &steps) || !quern_h5_read_number(h->file, "dt", &dt) ||
		steps < 1 || steps > most || !(dt >= 0 && dt < 1e300))
		return false;
	c->settle_step = steps;
	c->settle_dt = dt;
	return true;
}

/* Indices follow what they point at, so that all sets have their order before one is read. */
static bool read_sets(quern_run *run, const taking *t, size_t n, quern_text *why) {
	quern_store *store = &run->plan->store;
	for (size_t i = 0; i < n; i++)
		if (quern_store_remap(store, t[i].set, t[i].group.n, t[i].from, 0, NULL) != QUERN_OK)
			return quern_text_add(why, "there is no memory for it"), false;
	for (size_t i = 0; i < n; i++)
		if (!quern_state_read(run, &t[i].group, t[i].set, settles, why)) return false;
	for (size_t k = 0; k < store->n_fields; k++) {
		const char *fault = store->fields[k].settles ? quern_state_fault(run, &store->fields[k]) : NULL;
		if (!fault) continue;
		quern_text_add(why, "%s holds %s", store->fields[k].name, fault);
		return false;
	}
	return true;
}

static bool take_from(quern_run *run, const char *path, const char *depends) {
	quern_h5 h;
	char unreadable[256];
	quern_text why = { 0 };
	size_t n = 0;
	if (access(path, F_OK) || !quern_h5_open(&h, path, unreadable)) return false;
	taking *t = quern_take(run->plan->store.n_sets, sizeof *t);
	bool good = look(run, &h, depends, t, &n) && read_clock(run, &h);
	if (good && !(read_sets(run, t, n, &why) && quern_run_accept(run, &why))) {
		quern_run_stop(
			run, QUERN_E_IO, "%s: %s; remove it, or go without by --no-cache", path, quern_text_string(&why));
		good = false;
	}
	for (size_t i = 0; i < n; i++) quern_state_leave(&t[i].group), free(t[i].from);
	free(t);
	quern_h5_close(&h);
	quern_text_finish(&why);
	if (!good) return false;
	run->clock.settled = 1;
	quern_plan_refresh(run->plan);
	utimensat(AT_FDCWD, path, NULL, 0);
	return true;
}

static char *path_of(const char *folder, const char *depends) {
	return quern_format(
		"%s/settled-%016llx.h5", folder, (unsigned long long)quern_hash(depends, strlen(depends)));
}

bool quern_settled_take(quern_run *run, const char *key) {
	char *folder = cache_folder(), *path = folder ? path_of(folder, key) : NULL;
	const bool taken = path && take_from(run, path, key);
	if (taken)
		quern_log_add(
			run->log, 1, "settled already: %lld steps, from %s", (long long)run->clock.settle_step, path);
	free(path);
	free(folder);
	return taken;
}

/* ---- keeping ---- */

typedef struct {
	char *path;
	double used, bytes; /* s since 1970 */
} kept;

static int by_use(const void *a, const void *b) {
	const double x = ((const kept *)a)->used, y = ((const kept *)b)->used;
	return (x < y) - (x > y);
}

static void drop_old(const char *folder) {
	DIR *d = opendir(folder);
	kept *all = NULL;
	size_t n = 0, capacity = 0;
	double sum = 0;
	for (struct dirent *e; d && (e = readdir(d));) {
		struct stat is;
		if (strncmp(e->d_name, "settled-", 8) != 0) continue;
		char *path = quern_format("%s/%s", folder, e->d_name);
		if (stat(path, &is)) {
			free(path);
			continue;
		}
		all = quern_grow(all, n, &capacity, sizeof *all);
		all[n++] = (kept) { path, (double)is.st_mtim.tv_sec + 1e-9 * (double)is.st_mtim.tv_nsec,
			(double)is.st_size };
	}
	if (d) closedir(d);
	if (n) qsort(all, n, sizeof *all, by_use);
	for (size_t i = 0; i < n; i++) {
		sum += all[i].bytes;
		if (i && sum > most_bytes) unlink(all[i].path);
		free(all[i].path);
	}
	free(all);
}

static bool worth_it(const quern_run *run) {
	double most = 0;
	for (size_t s = 0; s < run->plan->store.n_sets; s++)
		if (is_meant(run, (int)s) && run->plan->store.sets[s].n > most) most = run->plan->store.sets[s].n;
	return most * (double)run->clock.settle_step >= worth;
}

/* Under a name of its own until it is whole: another run may be keeping the same state. */
static bool write_to(quern_run *run, const char *path, const char *key, char why[256]) {
	quern_h5 h;
	quern_run_rest(run);
	if (!quern_h5_create(&h, true, 512)) return snprintf(why, 256, "out of memory"), false;
	quern_h5_text(&h, h.file, "format", format);
	quern_h5_put(&h, h.file, "depends", H5T_NATIVE_UINT8, strlen(key), 1, key);
	quern_h5_integer(&h, h.file, "steps", run->clock.settle_step);
	quern_h5_number(&h, h.file, "dt", run->clock.settle_dt);
	for (int s = 0; s < (int)run->plan->store.n_sets; s++)
		if (is_meant(run, s)) quern_state_write(&h, run, s, settles);
	char *own = quern_format("%s.%ld", path, (long)getpid());
	bool good = quern_h5_save(&h, own, why);
	if (good && rename(own, path)) {
		snprintf(why, 256, "%.180s cannot be written: %s", path, strerror(errno));
		unlink(own);
		good = false;
	}
	free(own);
	return good;
}

void quern_settled_keep(quern_run *run, const char *key) {
	char *folder = worth_it(run) ? cache_folder() : NULL, *path = folder ? path_of(folder, key) : NULL;
	char why[256];
	if (path && !quern_folder_make(folder))
		quern_log_add(run->log, 0, "settled state not kept: %s: %s", folder, strerror(errno));
	else if (path && !write_to(run, path, key, why))
		quern_log_add(run->log, 0, "settled state not kept: %s", why);
	else if (path) {
		quern_log_add(run->log, 0, "settled state kept in %s", path);
		drop_old(folder);
	}
	free(path);
	free(folder);
}
