/* SPDX-License-Identifier: MIT */
#include "loader.h"
#include "child.h"
#include "config.h"
#include "environment.h"
#include "file.h"
#include "level.h"
#include "platform.h"
#include "watch.h"
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <limits.h>
#include <link.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

const char *quern_shape_name(uint32_t shape) {
	static const char *const names[] = { NULL, "a scalar", "a vector", "an axial vector",
		"a symmetric tensor", "a tensor", "an index", "an id" };
	return shape < sizeof names / sizeof *names ? names[shape] : NULL;
}

const char *quern_id_name(const char *id) {
	char kind[24];
	const size_t n = strcspn(id, ".");
	snprintf(kind, sizeof kind, "%.*s", (int)n, id);
	return n < sizeof kind && quern_is_name(kind) && id[n] && quern_is_name(id + n + 1) ? id + n + 1 : NULL;
}

bool quern_id_is_of(const char *id, const char *kind) {
	const size_t n = strlen(kind);
	return !strncmp(id, kind, n) && id[n] == '.';
}

struct quern_loader {
	char **folders; /* of QUERN_PLUGIN_PATH */
	size_t n_folders, folders_capacity;
	char *own; /* the program's; NULL: there is none */
	quern_plugin_file **files;
	size_t n_files, files_capacity;
	quern_catalogue catalogue; /* once somebody has asked */
	int level;
	bool wary, asked; /* for sections */
};

static bool is_folder(const char *path) {
	struct stat s;
	return !stat(path, &s) && S_ISDIR(s.st_mode);
}

static void add_folder(quern_loader *loader, const char *path) {
	char real[PATH_MAX];
	if (!realpath(path, real) || !is_folder(real)) return;
	for (size_t i = 0; i < loader->n_folders; i++)
		if (!strcmp(loader->folders[i], real)) return;
	loader->folders =
		quern_grow(loader->folders, loader->n_folders, &loader->folders_capacity, sizeof(char *));
	loader->folders[loader->n_folders++] = quern_copy(real);
}

/* Where it is built the plugins lie in a folder beside the program. Installed, they are where the build was told, seen from
 * quern or from the programs beside it, so that the whole may be moved; last, where it was told in full. */
static char *own_folder(void) {
	static const char *const installed[] = { QUERN_PLUGINS_FROM_BIN, QUERN_PLUGINS_FROM_PROGRAMS };
	char *exe = quern_platform_program(), *found = NULL, real[PATH_MAX];
	char *slash = exe ? strrchr(exe, '/') : NULL;
	if (slash) *slash = 0;
	char *built = quern_format("%s/" QUERN_BUILT_HERE, exe ? exe : "");
	for (size_t k = 0; k < 3 && exe && !found; k++) {
		if (k == 0 && access(built, F_OK)) continue;
		char *folder = quern_format("%s/%s", exe, k == 0 ? "plugins" : installed[k - 1]);
		if (realpath(folder, real) && is_folder(real)) found = quern_copy(real);
		free(folder);
	}
	if (!found && is_folder(QUERN_PLUGINS_INSTALLED)) found = quern_copy(QUERN_PLUGINS_INSTALLED);
	free(built);
	free(exe);
	return found;
}

quern_loader *quern_loader_create(void) {
	quern_loader *loader = quern_take(1, sizeof *loader);
	quern_loader_limit(loader, 4);
	const char *path = getenv("QUERN_PLUGIN_PATH");
	char *copy = quern_copy(path ? path : ""), *rest = copy, *folder;
	while ((folder = strsep(&rest, ":")))
		if (*folder) add_folder(loader, folder);
	free(copy);
	loader->own = own_folder();
	return loader;
}

static void file_destroy(quern_plugin_file *file) {
	if (!file) return;
	for (size_t i = 0; i < file->n_views; i++) free(file->views[i].ops);
	free(file->views);
	free(file->path);
	quern_table_finish(&file->table);
	free(file);
}

/* Handles are left open on purpose: an unmapped plugin would take running code and sanitizer traces with it. */
void quern_loader_destroy(quern_loader *loader) {
	if (!loader) return;
	for (size_t i = 0; i < loader->n_files; i++) file_destroy(loader->files[i]);
	for (size_t i = 0; i < loader->n_folders; i++) free(loader->folders[i]);
	quern_catalogue_finish(&loader->catalogue);
	free(loader->files);
	free(loader->own);
	free(loader->folders);
	free(loader);
}

void quern_loader_limit(quern_loader *loader, int level) {
	const int best = quern_level_here();
	loader->level = level < best ? level : best;
}

void quern_loader_beware(quern_loader *loader) { loader->wary = true; }

size_t quern_loader_count(const quern_loader *loader) { return loader->n_files; }
const quern_plugin_file *quern_loader_at(const quern_loader *loader, size_t i) { return loader->files[i]; }

/* ---- reading one library ---- */

static const char *no_library(void *handle, char why[160]) {
	for (unsigned v = 1; v < 10; v++) {
		char symbol[32];
		snprintf(symbol, sizeof symbol, "quern_library_%u", v);
		if (!dlsym(handle, symbol)) continue;
		snprintf(why, 160,
			"is built for interface %u, this program speaks %u: rebuild the plugin with its header", v,
			QUERN_ABI_MAJOR);
		return why;
	}
	return "exports no " QUERN_LIBRARY_SYMBOL
		   ", so it is no Quern plugin: end its source with QUERN_LIBRARY(...)";
}

static const quern_plugin_file *refuse(
	quern_report *report, quern_mark mark, const char *path, const char *why) {
	quern_report_add(report, mark, "plugin %s %s", path, why);
	return NULL;
}

static int note_end(struct dl_phdr_info *info, size_t size, void *to) {
	quern_plugin_file *file = to;
	(void)size;
	if (info->dlpi_addr != file->begin) return 0;
	for (int i = 0; i < info->dlpi_phnum; i++) {
		const uintptr_t end = file->begin + info->dlpi_phdr[i].p_vaddr + info->dlpi_phdr[i].p_memsz;
		if (info->dlpi_phdr[i].p_type == PT_LOAD && end > file->end) file->end = end;
	}
	return 1;
}

static void note_place(quern_plugin_file *file, void *handle) {
	struct link_map *map;
	if (dlinfo(handle, RTLD_DI_LINKMAP, &map)) return;
	file->begin = map->l_addr;
	dl_iterate_phdr(note_end, file);
}

/* Adds the plugin behind the library's table, or refuses it. */
static const quern_plugin_file *add_file(quern_loader *loader, const char *path, int level, void *handle,
	const quern_library *lib, quern_report *report, quern_mark mark) {
	quern_plugin_file *file = quern_take(1, sizeof *file);
	quern_table *t = &file->table;
	quern_text why = { 0 };
	file->path = quern_copy(path);
	if (!quern_table_read(t, lib, &why)) {
		refuse(report, mark, path, quern_text_string(&why));
		quern_text_finish(&why);
		file_destroy(file);
		return NULL;
	}
	note_place(file, handle);
	quern_hash_file(path, 0, &file->hash);
	file->level = level;
	file->library = &t->library;
	file->plugin = t->plugin;
	file->params = t->params;
	file->uses = t->uses;
	file->n_params = t->n_params;
	file->n_uses = t->n_uses;
	loader->files = quern_grow(loader->files, loader->n_files, &loader->files_capacity, sizeof(file));
	return loader->files[loader->n_files++] = file;
}

/* Loading runs nothing of ours, but it runs what the plugin's compiler and its libraries have put there. */
static void *open_object(const char *path, const char **changed) {
	quern_environment e = quern_environment_take();
	quern_watch_enter(path, "its start-up code");
	void *handle = dlopen(path, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
	quern_watch_leave();
	*changed = quern_environment_restore(&e);
	quern_environment_drop(&e);
	return handle;
}

/* ---- asking a child first ---- */

typedef struct {
	const char *path;
	volatile bool *mapped;
} question;

static void ask(void *arg) {
	const question *q = arg;
	const char *changed;
	void *handle = open_object(q->path, &changed);
	*q->mapped = true;
	const quern_library *lib = handle ? dlsym(handle, QUERN_LIBRARY_SYMBOL) : NULL;
	quern_text why = { 0 };
	quern_table table;
	if (lib)
		quern_table_read(&table, lib, &why), quern_table_finish(&table); /* what it says, it says again */
	quern_text_finish(&why);
}

bool quern_loader_survives(const char *path, quern_report *report, quern_mark mark) {
	enum { SECONDS = 20 };
	char what[80];
	question q = { path, quern_shared_take(sizeof(bool)) };
	if (!q.mapped) return false;
	const quern_child how = quern_child_run(ask, &q, SECONDS);
	quern_child_say(&how, SECONDS, what);
	if (how.end != QUERN_CHILD_DONE)
		quern_report_add(report, mark, "plugin %s %s while %s", path, what,
			*q.mapped ? "its tables were read" : "it was loaded");
	quern_shared_drop((void *)(uintptr_t)q.mapped, sizeof(bool));
	return how.end == QUERN_CHILD_DONE;
}

static const quern_plugin_file *open_level(
	quern_loader *loader, const char *path, int level, quern_report *report, quern_mark mark) {
	char why[160];
	const char *changed;
	for (size_t i = 0; i < loader->n_files; i++)
		if (!strcmp(loader->files[i]->path, path)) return loader->files[i];
	if (loader->wary && !quern_loader_survives(path, report, mark)) return NULL;
	void *handle = open_object(path, &changed);
	if (!handle) {
		char *text = quern_format("cannot be loaded: %s; rebuild it, or install what it needs", dlerror());
		refuse(report, mark, path, text);
		free(text);
		return NULL;
	}
	if (changed) {
		char *text = quern_format(
			"changes %s when it is loaded, where a plugin runs nothing; -ffast-math at its link would",
			changed);
		refuse(report, mark, path, text);
		free(text);
		return NULL;
	}
	void *symbol = dlsym(handle, QUERN_LIBRARY_SYMBOL);
	if (!symbol) return refuse(report, mark, path, no_library(handle, why));
	return add_file(loader, path, level, handle, symbol, report, mark);
}

static int level_of(const char *path) {
	const size_t n = strlen(path);
	if (n > 6 && !strcmp(path + n - 6, ".v3.so")) return 3;
	if (n > 6 && !strcmp(path + n - 6, ".v4.so")) return 4;
	return 1;
}

const quern_plugin_file *quern_loader_open(
	quern_loader *loader, const char *path, quern_report *report, quern_mark mark) {
	char real[PATH_MAX];
	if (!realpath(path, real)) return refuse(report, mark, path, strerror(errno));
	return open_level(loader, real, level_of(real), report, mark);
}

/* ---- finding ---- */

static char *best_file(const quern_loader *loader, const char *folder, const char *id, int *level) {
	static const struct {
		int level;
		const char *suffix;
	} forms[] = { { 4, ".v4.so" }, { 3, ".v3.so" }, { 1, ".so" } };
	for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
		if (forms[i].level > loader->level) continue;
		char *path = quern_format("%s/%s%s", folder, id, forms[i].suffix);
		if (!access(path, F_OK)) {
			*level = forms[i].level;
			return path;
		}
		free(path);
	}
	return NULL;
}

static void unknown(
	quern_loader *loader, const char *kind, const char *name, quern_report *report, quern_mark mark) {
	char **ids = quern_loader_ids(loader);
	const size_t skip = strlen(kind) + 1;
	const char **names = NULL;
	size_t n = 0, capacity = 0;
	quern_text list = { 0 };
	for (size_t i = 0; ids[i]; i++)
		if (!strncmp(ids[i], kind, skip - 1) && ids[i][skip - 1] == '.') {
			names = quern_grow(names, n + 1, &capacity, sizeof(char *));
			names[n++] = ids[i] + skip;
			quern_text_add(&list, "%s%s", list.length ? ", " : "", ids[i] + skip);
		}
	names = quern_grow(names, n, &capacity, sizeof(char *));
	names[n] = NULL;
	const char *near = quern_nearest(name, names), *elsewhere = NULL;
	for (size_t i = 0; ids[i] && !elsewhere; i++)
		if (!quern_id_is_of(ids[i], quern_check_kind.name) && !strcmp(quern_id_name(ids[i]), name))
			elsewhere = ids[i];
	if (elsewhere)
		quern_report_add(report, mark, "'%s' is %s; here a plugin of kind %s is wanted: %s", name, elsewhere,
			kind, n ? quern_text_string(&list) : "none is installed");
	else if (near) quern_report_add(report, mark, "unknown %s '%s'; did you mean '%s'?", kind, name, near);
	else if (n)
		quern_report_add(
			report, mark, "unknown %s '%s'; installed: %s", kind, name, quern_text_string(&list));
	else
		quern_report_add(report, mark,
			"no %s is installed; is the program beside its plugins, or QUERN_PLUGIN_PATH set?", kind);
	quern_text_finish(&list);
	free(names);
	quern_loader_free_ids(ids);
}

/* The object of that id in the folders of the path, where it may stand once, or else in the program's own. */
static char *find_object(
	const quern_loader *loader, const char *id, int *level, quern_report *report, quern_mark mark) {
	char *found = NULL;
	for (size_t i = 0; i < loader->n_folders; i++) {
		char *path = best_file(loader, loader->folders[i], id, level);
		if (path && found) {
			quern_report_add(
				report, mark, "%s is offered twice, by %s and by %s: remove one", id, found, path);
			*level = 0;
			free(path);
			return found;
		}
		if (path) found = path;
	}
	return found || !loader->own ? found : best_file(loader, loader->own, id, level);
}

const quern_plugin_file *quern_loader_find(
	quern_loader *loader, const char *kind, const char *name, quern_report *report, quern_mark mark) {
	char *id = quern_format("%s.%s", kind, name);
	int level = 1;
	char *found = quern_is_name(name) ? find_object(loader, id, &level, report, mark) : NULL;
	const quern_plugin_file *file = NULL;
	if (!found) unknown(loader, kind, name, report, mark);
	else if (level) file = open_level(loader, found, level, report, mark);
	if (file && strcmp(file->plugin.id, id) != 0) {
		quern_report_add(report, mark, "plugin %s calls itself %s: name the file %s.so", found,
			file->plugin.id, file->plugin.id);
		file = NULL;
	}
	free(found);
	free(id);
	return file;
}

/* ---- what there is ---- */

static int by_name(const void *a, const void *b) {
	return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* KIND.NAME of "KIND.NAME.v3.so", or NULL if that is no object whose name begins with a word. */
static char *id_of_object(const char *name) {
	const size_t length = strlen(name), n = strcspn(name, ".");
	if (length < 4 || strcmp(name + length - 3, ".so") != 0) return NULL;
	char *id = quern_copy(name);
	id[n] = 0;
	const bool word = quern_is_name(id);
	memcpy(id, name, n + 1);
	id[length - (level_of(name) == 1 ? 3 : 6)] = 0;
	if (word) return id;
	free(id);
	return NULL;
}

typedef void visitor(void *to, const char *folder, const char *object, char *id);

/* Visits every object of every folder; the visitor takes the id over. */
static void visit(const quern_loader *loader, visitor *see, void *to) {
	for (size_t i = 0; i <= loader->n_folders; i++) {
		const char *path = i < loader->n_folders ? loader->folders[i] : loader->own;
		DIR *folder = path ? opendir(path) : NULL;
		struct dirent *entry;
		while (folder && (entry = readdir(folder))) {
			char *id = id_of_object(entry->d_name);
			if (id) see(to, path, entry->d_name, id);
		}
		if (folder) closedir(folder);
	}
}

typedef struct {
	char **at;
	size_t n, capacity;
} id_list;

static void add_id(id_list *list, char *id) {
	list->at = quern_grow(list->at, list->n + 1, &list->capacity, sizeof(char *));
	list->at[list->n++] = id;
}

static void collect(void *to, const char *folder, const char *object, char *id) {
	(void)folder, (void)object;
	if (quern_id_name(id)) add_id(to, id);
	else free(id);
}

/* Each once, NULL-terminated. */
static char **sorted(id_list *list) {
	size_t kept = 0;
	list->at = quern_grow(list->at, list->n, &list->capacity, sizeof(char *));
	qsort(list->at, list->n, sizeof(char *), by_name);
	for (size_t i = 0; i < list->n; i++) {
		if (kept && !strcmp(list->at[kept - 1], list->at[i])) free(list->at[i]);
		else list->at[kept++] = list->at[i];
	}
	list->at[kept] = NULL;
	return list->at;
}

/* One for the objects of all instruction sets. */
char **quern_loader_ids(const quern_loader *loader) {
	id_list list = { 0 };
	visit(loader, collect, &list);
	return sorted(&list);
}

typedef struct {
	quern_loader *loader;
	quern_report *report;
} stray_report;

/* What has no second word is a library of somebody's, unless the word is a kind. */
static void report_stray(void *to, const char *folder, const char *object, char *id) {
	const stray_report *r = to;
	if (!quern_id_name(id) && (strchr(id, '.') || quern_loader_kind(r->loader, id)))
		quern_report_add(r->report, (quern_mark) { 0 },
			"plugin %s/%s cannot be asked for by its name: call it KIND.NAME.so, NAME in letters, digits and "
			"underscores",
			folder, object);
	free(id);
}

void quern_loader_report_strays(quern_loader *loader, quern_report *report) {
	stray_report r = { loader, report };
	visit(loader, report_stray, &r);
}

void quern_loader_free_ids(char **ids) {
	for (size_t i = 0; ids && ids[i]; i++) free(ids[i]);
	free(ids);
}

/* ---- as a caller sees it ---- */

const void *quern_loader_ops(quern_loader *loader, const quern_plugin_file *of, const quern_kind *kind,
	quern_report *report, quern_mark mark) {
	quern_plugin_file *file = NULL;
	quern_text why = { 0 };
	for (size_t i = 0; i < loader->n_files; i++)
		if (loader->files[i] == of) file = loader->files[i];
	for (size_t i = 0; file && i < file->n_views; i++)
		if (file->views[i].kind == kind) return file->views[i].ops;
	void *ops = file ? quern_table_ops_for(&file->table, kind, &why) : NULL;
	if (!ops) refuse(report, mark, of->path, quern_text_string(&why));
	quern_text_finish(&why);
	if (!ops) return NULL;
	file->views = quern_grow(file->views, file->n_views, &file->views_capacity, sizeof *file->views);
	file->views[file->n_views++] = (quern_plugin_view) { kind, ops };
	return ops;
}

/* ---- which solver reads which section ---- */

bool quern_solver_steps(const quern_solver_ops *ops) {
	for (const quern_stage *stage = ops->stages; stage->name; stage++)
		if (stage->phase > QUERN_SETUP && stage->phase < QUERN_OUTPUT) return true;
	return false;
}

/* Objects that are offered twice are nobody's until they are asked for by their name. */
static void ask_solvers(quern_loader *loader) {
	if (loader->asked) return;
	quern_report *nobody = quern_report_create();
	char **ids = quern_loader_ids(loader), **paths = NULL, **solvers = NULL;
	size_t n = 0, capacity = 0, also = 0;
	for (size_t i = 0; ids[i]; i++) {
		int level = 1;
		if (!quern_id_is_of(ids[i], quern_solver_kind.name)) continue;
		char *path = find_object(loader, ids[i], &level, nobody, (quern_mark) { 0 });
		if (!path) continue;
		paths = quern_grow(paths, n, &capacity, sizeof *paths);
		solvers = quern_grow(solvers, n, &also, sizeof *solvers);
		paths[n] = path;
		solvers[n++] = ids[i];
	}
	if (n) quern_catalogue_ask(&loader->catalogue, solvers, paths, n);
	for (size_t i = 0; i < n; i++) free(paths[i]);
	free(paths);
	free(solvers);
	quern_loader_free_ids(ids);
	quern_report_destroy(nobody);
	loader->asked = true;
}

const quern_catalogue *quern_loader_catalogue(quern_loader *loader) {
	ask_solvers(loader);
	return &loader->catalogue;
}

const quern_kind *quern_loader_kind(quern_loader *loader, const char *name) {
	static const quern_kind *const own[] = { &quern_solver_kind, &quern_observer_kind, &quern_check_kind };
	for (size_t i = 0; i < sizeof own / sizeof *own; i++)
		if (!strcmp(own[i]->name, name)) return own[i];
	return quern_catalogue_kind(quern_loader_catalogue(loader), name);
}

void quern_loader_report_unreadable(quern_loader *loader, quern_report *report, quern_mark mark) {
	const quern_catalogue *c = quern_loader_catalogue(loader);
	for (size_t i = 0; i < c->n_unreadable; i++) quern_report_add(report, mark, "%s", c->unreadable[i].why);
}

/* ---- other files ---- */

bool quern_loader_searches(const quern_loader *loader, const char *folder) {
	char real[PATH_MAX];
	bool found = false;
	if (!realpath(folder, real)) return false;
	for (size_t i = 0; i < loader->n_folders; i++) found = found || !strcmp(loader->folders[i], real);
	return found || (loader->own && !strcmp(loader->own, real));
}

char *quern_loader_data(const quern_loader *loader, const char *name) {
	for (size_t i = 0; i <= loader->n_folders; i++) {
		const char *folder = i < loader->n_folders ? loader->folders[i] : loader->own;
		char *path = folder ? quern_format("%s/%s", folder, name) : NULL;
		if (path && !access(path, R_OK)) return path;
		free(path);
	}
	return NULL;
}

/* Adds the word between prefix and suffix of every name in a folder. */
static void collect_words(const char *path, const char *prefix, const char *suffix, id_list *list) {
	const size_t before = strlen(prefix), after = strlen(suffix);
	DIR *folder = opendir(path);
	for (struct dirent *entry; folder && (entry = readdir(folder));) {
		const size_t n = strlen(entry->d_name);
		if (n <= before + after || strncmp(entry->d_name, prefix, before) != 0 ||
			strcmp(entry->d_name + n - after, suffix) != 0)
			continue;
		char *word = quern_copy(entry->d_name + before);
		word[n - before - after] = 0;
		if (quern_is_name(word)) add_id(list, word);
		else free(word);
	}
	if (folder) closedir(folder);
}

char **quern_loader_words(const quern_loader *loader, const char *prefix, const char *suffix) {
	id_list list = { 0 };
	for (size_t i = 0; i <= loader->n_folders; i++) {
		const char *folder = i < loader->n_folders ? loader->folders[i] : loader->own;
		if (folder) collect_words(folder, prefix, suffix, &list);
	}
	return sorted(&list);
}
