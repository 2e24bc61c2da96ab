#include "loader.h"
#include "config.h"
#include "text.h"
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

const char *const quern_kind_names[] = { "solver", "contact", "neighbours", "integrator", "body", "material",
	"shape", "transfer", "coupling", "oracle", "packer", "observer", NULL };

const char *quern_kind_name(uint32_t kind) {
	return kind > 0 && kind < QUERN_KINDS ? quern_kind_names[kind - 1] : NULL;
}

uint32_t quern_kind_of(const char *name) {
	for (uint32_t k = 1; k < QUERN_KINDS; k++)
		if (!strcmp(quern_kind_names[k - 1], name)) return k;
	return 0;
}

struct quern_loader {
	char **folders;
	size_t n_folders, folders_capacity;
	quern_plugin_file **files;
	size_t n_files, files_capacity;
	int level;
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

/* Built in place, the plugins lie beside the program; installed, where the build was told. */
static void add_own_folder(quern_loader *loader) {
	char exe[PATH_MAX];
	const ssize_t n = readlink("/proc/self/exe", exe, sizeof exe - 1);
	if (n <= 0) return;
	exe[n] = 0;
	char *slash = strrchr(exe, '/');
	if (slash) *slash = 0;
	char *beside = quern_format("%s/plugins", exe);
	char *installed = quern_format("%s/%s", exe, QUERN_PLUGINS_FROM_BIN);
	char *above = quern_format("%s/../plugins", exe); /* test programs live one folder deeper */
	if (is_folder(beside)) add_folder(loader, beside);
	else if (is_folder(installed)) add_folder(loader, installed);
	else add_folder(loader, above);
	free(beside);
	free(installed);
	free(above);
}

int quern_loader_best_level(void) {
	__builtin_cpu_init();
	const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
					__builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
	const bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
					__builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
					__builtin_cpu_supports("avx512vl");
	return v4 ? 4 : v3 ? 3 : 1;
}

quern_loader *quern_loader_create(void) {
	quern_loader *loader = quern_take(1, sizeof *loader);
	loader->level = quern_loader_best_level();
	const char *path = getenv("QUERN_PLUGIN_PATH");
	char *copy = quern_copy(path ? path : ""), *rest = copy, *folder;
	while ((folder = strsep(&rest, ":")))
		if (*folder) add_folder(loader, folder);
	free(copy);
	add_own_folder(loader);
	return loader;
}

static void file_destroy(quern_plugin_file *file) {
	if (!file) return;
	free(file->path);
	free(file->params);
	free(file->uses);
	free(file);
}

/* Handles are left open on purpose: an unmapped plugin would take running code and sanitizer traces with it. */
void quern_loader_destroy(quern_loader *loader) {
	if (!loader) return;
	for (size_t i = 0; i < loader->n_files; i++) file_destroy(loader->files[i]);
	for (size_t i = 0; i < loader->n_folders; i++) free(loader->folders[i]);
	free(loader->files);
	free(loader->folders);
	free(loader);
}

void quern_loader_limit(quern_loader *loader, int level) {
	const int best = quern_loader_best_level();
	loader->level = level < best ? level : best;
}

size_t quern_loader_count(const quern_loader *loader) { return loader->n_files; }
const quern_plugin_file *quern_loader_at(const quern_loader *loader, size_t i) { return loader->files[i]; }

/* ---- reading one library ---- */

static uint64_t hash_file(const char *path) {
	uint64_t hash = 1469598103934665603u;
	FILE *file = fopen(path, "rb");
	unsigned char buffer[65536];
	size_t n;
	if (!file) return 0;
	while ((n = fread(buffer, 1, sizeof buffer, file)) > 0)
		for (size_t i = 0; i < n; i++) hash = (hash ^ buffer[i]) * 1099511628211u;
	fclose(file);
	return hash;
}

/* Rows of `stride` bytes in the plugin become rows of `size` bytes here; what the plugin does not know is 0. */
static void *copy_rows(const void *rows, size_t stride, size_t size, size_t *n) {
	size_t capacity = 0;
	char *out = NULL;
	*n = 0;
	for (const char *row = rows; rows; row += stride, (*n)++) {
		out = quern_grow(out, *n, &capacity, size);
		memset(out + *n * size, 0, size);
		memcpy(out + *n * size, row, stride < size ? stride : size);
		if (!*(const char *const *)(const void *)row) break;
	}
	return out;
}

static const char *no_library(void *handle, char why[160]) {
	for (unsigned v = 2; v < 10; v++) {
		char symbol[32];
		snprintf(symbol, sizeof symbol, "quern_library_%u", v);
		if (!dlsym(handle, symbol)) continue;
		snprintf(why, 160,
			"is built for interface %u, this program speaks %u: rebuild the plugin with its header", v,
			QUERN_ABI_MAJOR);
		return why;
	}
	return "exports no quern_library_1, so it is no Quern plugin: end its source with QUERN_LIBRARY(...)";
}

static const char *bad_library(const quern_library *lib, char why[160]) {
	if (lib->size < sizeof(quern_library) || lib->abi >> 16 != QUERN_ABI_MAJOR ||
		(lib->abi & 0xffffu) > QUERN_ABI_MINOR) {
		snprintf(why, 160,
			"is built for interface %u.%u, this program speaks %u.%u: rebuild it with this header",
			lib->abi >> 16, lib->abi & 0xffffu, QUERN_ABI_MAJOR, QUERN_ABI_MINOR);
		return why;
	}
	if (lib->real_size != sizeof(quern_real) || lib->lanes != QUERN_LANES)
		return "is built for another number format: rebuild it with this program's header";
	const quern_plugin *p = lib->plugin;
	if (!p || p->size < sizeof(quern_plugin) || !p->id || !p->ops || !p->params || !p->uses)
		return "describes no plugin: its table lacks id, params, uses or ops";
	const char *kind = quern_kind_name(p->kind);
	const char *dot = strchr(p->id, '.');
	if (!kind || !dot || strncmp(p->id, kind, strlen(kind)) != 0 || p->id[strlen(kind)] != '.')
		return "has an id that does not begin with its kind: name it KIND.NAME";
	return NULL;
}

static unsigned control_word(void) { return __builtin_ia32_stmxcsr(); }

static const quern_plugin_file *refuse(
	quern_report *report, quern_mark mark, const char *path, const char *why) {
	quern_report_add(report, mark, "plugin %s %s", path, why);
	return NULL;
}

static quern_plugin_file *file_create(const char *path, int level, const quern_library *lib) {
	quern_plugin_file *file = quern_take(1, sizeof *file);
	file->path = quern_copy(path);
	file->hash = hash_file(path);
	file->level = level;
	file->library = lib;
	memcpy(&file->plugin, lib->plugin,
		lib->plugin->size < sizeof(quern_plugin) ? lib->plugin->size : sizeof(quern_plugin));
	file->params = copy_rows(lib->plugin->params, lib->param_size, sizeof(quern_param), &file->n_params);
	file->uses = copy_rows(lib->plugin->uses, lib->use_size, sizeof(quern_use), &file->n_uses);
	file->plugin.params = file->params;
	file->plugin.uses = file->uses;
	return file;
}

static const quern_plugin_file *open_level(
	quern_loader *loader, const char *path, int level, quern_report *report, quern_mark mark) {
	char why[160];
	for (size_t i = 0; i < loader->n_files; i++)
		if (!strcmp(loader->files[i]->path, path)) return loader->files[i];
	const unsigned before = control_word();
	void *handle = dlopen(path, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
	const unsigned after = control_word();
	if (after != before) __builtin_ia32_ldmxcsr(before);
	if (!handle) {
		char *text = quern_format("cannot be loaded: %s; rebuild it, or install what it needs", dlerror());
		refuse(report, mark, path, text);
		free(text);
		return NULL;
	}
	/* the low six bits are flags raised by arithmetic, the others change its results */
	if ((after ^ before) & ~63u)
		return refuse(report, mark, path,
			"changes the processor's floating-point state when loaded: link it without -ffast-math");
	void *symbol = dlsym(handle, "quern_library_1");
	if (!symbol) return refuse(report, mark, path, no_library(handle, why));
	const quern_library *lib = symbol;
	const char *bad = bad_library(lib, why);
	if (bad) return refuse(report, mark, path, bad);
	quern_plugin_file *file = file_create(path, level, lib);
	loader->files = quern_grow(loader->files, loader->n_files, &loader->files_capacity, sizeof(file));
	loader->files[loader->n_files++] = file;
	return file;
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
	for (size_t i = 0; ids[i] && !elsewhere; i++) {
		const char *dot = strchr(ids[i], '.');
		if (dot && !strcmp(dot + 1, name)) elsewhere = ids[i];
	}
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

const quern_plugin_file *quern_loader_find(
	quern_loader *loader, quern_kind kind, const char *name, quern_report *report, quern_mark mark) {
	char *id = quern_format("%s.%s", quern_kind_name(kind), name);
	char *found = NULL;
	int level = 1;
	bool twice = false;
	for (size_t i = 0; i < loader->n_folders && quern_is_name(name); i++) {
		int other = 1;
		char *path = best_file(loader, loader->folders[i], id, &other);
		if (path && found) {
			quern_report_add(
				report, mark, "%s is offered twice, by %s and by %s: remove one", id, found, path);
			twice = true;
			free(path);
		} else if (path) {
			found = path;
			level = other;
		}
	}
	const quern_plugin_file *file = NULL;
	if (!found) unknown(loader, quern_kind_name(kind), name, report, mark);
	else if (!twice) file = open_level(loader, found, level, report, mark);
	if (file && strcmp(file->plugin.id, id) != 0) {
		quern_report_add(report, mark, "plugin %s calls itself %s: name the file %s.so", found,
			file->plugin.id, file->plugin.id);
		file = NULL;
	}
	free(found);
	free(id);
	return file;
}

static int by_name(const void *a, const void *b) {
	return strcmp(*(const char *const *)a, *(const char *const *)b);
}

char **quern_loader_ids(const quern_loader *loader) {
	char **ids = NULL;
	size_t n = 0, capacity = 0, kept = 0;
	for (size_t i = 0; i < loader->n_folders; i++) {
		DIR *folder = opendir(loader->folders[i]);
		struct dirent *entry;
		while (folder && (entry = readdir(folder))) {
			const size_t length = strlen(entry->d_name);
			const char *dot = strchr(entry->d_name, '.');
			if (!dot || length < 4 || strcmp(entry->d_name + length - 3, ".so") != 0) continue;
			char *id = quern_copy(entry->d_name);
			id[length - (level_of(id) == 1 ? 3 : 6)] = 0;
			char *kind = quern_copy(id);
			kind[dot - entry->d_name] = 0;
			const bool ours = quern_kind_of(kind) != 0;
			free(kind);
			if (!ours) {
				free(id);
				continue;
			}
			ids = quern_grow(ids, n + 1, &capacity, sizeof(char *));
			ids[n++] = id;
		}
		if (folder) closedir(folder);
	}
	ids = quern_grow(ids, n, &capacity, sizeof(char *));
	qsort(ids, n, sizeof(char *), by_name);
	for (size_t i = 0; i < n; i++) { /* one line for the objects of all instruction sets */
		if (kept && !strcmp(ids[kept - 1], ids[i])) free(ids[i]);
		else ids[kept++] = ids[i];
	}
	ids[kept] = NULL;
	return ids;
}

void quern_loader_free_ids(char **ids) {
	for (size_t i = 0; ids && ids[i]; i++) free(ids[i]);
	free(ids);
}
