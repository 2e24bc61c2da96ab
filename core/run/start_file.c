/* SPDX-License-Identifier: MIT */
#include "start_file.h"
#include "child.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MOST_ENTRIES = 1 << 30, MOST_TEXT = 1 << 26, SECONDS = 20, MOST_TRIES = 1000 };
static const int64_t most_id = (int64_t)1 << 53;

/* ---- frames ---- */

/* A checkpoint has its checksum in front. */
static bool is_plain_hdf5(const char *path) {
	static const char sign[8] = { '\x89', 'H', 'D', 'F', '\r', '\n', '\x1a', '\n' };
	char is[8] = "";
	const int fd = quern_open_file(path);
	const bool plain =
		fd >= 0 && read(fd, is, sizeof is) == (ssize_t)sizeof is && !memcmp(is, sign, sizeof is);
	if (fd >= 0) close(fd);
	return plain;
}

/* HDF5 opens files by their names alone, and what has that name may be another file by then: what is held is read from
 * memory. */
static hid_t open_image(int fd) {
	struct stat is;
	if (fstat(fd, &is) || is.st_size <= 0) return -1;
	const size_t size = (size_t)is.st_size;
	void *image = mmap(NULL, size, PROT_READ, MAP_PRIVATE, fd, 0);
	if (image == MAP_FAILED) return -1;
	const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
	hid_t file = -1;
	if (H5Pset_fapl_core(access, 1 << 20, 0) >= 0 && H5Pset_file_image(access, image, size) >= 0)
		file = H5Fopen("frame", H5F_ACC_RDONLY, access);
	H5Pclose(access);
	munmap(image, size);
	return file;
}

static hid_t open_plain(const char *path, const quern_held *held) {
	return held && held->file >= 0 ? open_image(held->file) : H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
}

static bool read_head(quern_start_file *f) {
	const hid_t file = f->h5.file;
	char is[32];
	quern_h5_read_text(file, "sections", f->sections, sizeof f->sections); /* older ones do not say */
	return quern_h5_read_text(file, "format", is, sizeof is) && !strcmp(is, "quern-frame 1") &&
		   quern_h5_read_integer(file, "dimension", &f->dimension) &&
		   quern_h5_read_number(file, "time", &f->time);
}

typedef struct {
	const char *path, *const *sets;
	const quern_held *held;
} trial;

static herr_t try_field(hid_t group, const char *name, const H5L_info_t *info, void *arg) {
	size_t rows, columns;
	(void)info;
	(void)arg;
	if (!quern_h5_read_size(group, name, &rows, &columns)) return 0;
	const hid_t set = H5Dopen2(group, name, H5P_DEFAULT), is = H5Dget_type(set);
	char source[64];
	quern_h5_read_text(set, "source", source, sizeof source);
	void *data = malloc(rows * columns * H5Tget_size(is) + 1);
	if (data) H5Dread(set, is, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
	free(data);
	H5Tclose(is);
	H5Dclose(set);
	return 0;
}

/* What the library prints as it crashes is nobody's sentence. */
static void try_reading(void *arg) {
	const trial *t = arg;
	if (!freopen("/dev/null", "w", stderr)) return;
	const hid_t file = open_plain(t->path, t->held);
	if (file >= 0) read_head(&(quern_start_file) { .h5 = { .file = file } });
	for (const char *const *set = t->sets; file >= 0 && *set; set++) {
		const hid_t group = quern_h5_find(file, *set);
		if (group < 0) continue;
		H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, NULL, try_field, NULL);
		H5Gclose(group);
	}
	if (file >= 0) H5Fclose(file);
}

/* A damaged file can make the library go round for ever. Whole ones are read far faster than 10 MB/s. */
static unsigned patience(const trial *t) {
	struct stat is;
	const bool known = t->held && t->held->file >= 0 ? !fstat(t->held->file, &is) : !stat(t->path, &is);
	return SECONDS + (known ? (unsigned)(is.st_size / 10000000) : 0);
}

static bool can_be_read(trial t, quern_text *why) {
	if (quern_child_is_one()) return true;
	const unsigned seconds = patience(&t);
	const quern_child how = quern_child_run(try_reading, &t, seconds);
	char what[80];
	if (how.end == QUERN_CHILD_DONE || how.end == QUERN_CHILD_NONE) return true;
	quern_child_say(&how, seconds, what);
	quern_text_add(why, "it is damaged: reading it %s", what);
	return false;
}

/* A frame of a run lies in RUN/frames; elsewhere it is a copy, and what lies beside that is another scene. */
static quern_tree *scene_beside(const char *path, quern_report *report) {
	static const char own[] = "frames";
	enum { LENGTH = sizeof own - 1 };
	const char *slash = strrchr(path, '/');
	const size_t n = slash ? (size_t)(slash - path) : 0;
	if (n < LENGTH || strncmp(slash - LENGTH, own, LENGTH) != 0) return NULL;
	if (n > LENGTH && slash[-LENGTH - 1] != '/') return NULL;
	char *name = quern_format("%.*s/../scene.yaml", (int)n, path);
	quern_tree *tree = access(name, R_OK) ? NULL : quern_tree_read(name, report);
	free(name);
	return tree;
}

static bool open_frame(
	quern_start_file *f, const char *path, const quern_held *held, const char *const *sets, quern_text *why) {
	f->frame = true;
	if (!can_be_read((trial) { path, sets, held }, why)) return false;
	f->h5.file = open_plain(path, held);
	const bool good = f->h5.file >= 0 && read_head(f);
	if (!good) return quern_text_add(why, "it is no frame of this program, or it is damaged"), false;
	quern_report *report = quern_report_create();
	f->scene = scene_beside(path, report);
	quern_report_destroy(report);
	return true;
}

/* ---- checkpoints ---- */

static quern_tree *read_scene(hid_t file) {
	size_t n = 0, columns = 0;
	if (!quern_h5_read_size(file, "scene", &n, &columns) || n > MOST_TEXT) return NULL;
	char *text = quern_take(n + 1, 1);
	quern_report *report = quern_report_create();
	quern_tree *tree = quern_h5_read(file, "scene", H5T_NATIVE_UINT8, n, 1, text)
						   ? quern_tree_parse("scene", text, n, report)
						   : NULL;
	quern_report_destroy(report);
	free(text);
	return tree;
}

static bool read_time(quern_start_file *f) {
	double begin, end, dt;
	int64_t at, steps_in;
	const hid_t file = f->h5.file;
	if (!quern_h5_read_number(file, "begin", &begin) || !quern_h5_read_number(file, "end", &end) ||
		!quern_h5_read_number(file, "dt", &dt) || !quern_h5_read_integer(file, "at", &at) ||
		!quern_h5_read_integer(file, "steps_in", &steps_in))
		return false;
	f->time = at == steps_in ? end : begin + (double)at * dt;
	return true;
}

static bool open_checkpoint(quern_start_file *f, const char *path, const quern_held *held, quern_text *why) {
	char is[32], broken[256];
	if (held && held->h5 >= 0) f->h5.file = H5Freopen(held->h5);
	else if (!quern_h5_open(&f->h5, path, broken)) return quern_text_add(why, "%s", broken), false;
	const hid_t file = f->h5.file;
	bool good = quern_h5_read_text(file, "format", is, sizeof is) && !strcmp(is, "quern-checkpoint 3");
	f->scene = good ? read_scene(file) : NULL;
	const quern_node *dimension =
		f->scene && f->scene->root ? quern_node_find(f->scene->root, "dimension") : NULL;
	good = good && read_time(f) && dimension && dimension->kind == QUERN_NODE_SCALAR;
	if (good) f->dimension = strtoll(dimension->text, NULL, 10);
	else quern_text_add(why, "it is no checkpoint of this program");
	return good;
}

/* ---- one moment of a run that is still at work ---- */

char *quern_start_file_name(const quern_held *held) { return quern_format("/proc/self/fd/%d", held->file); }

/* HDF5 opens files by their names alone, so that the one which was opened may be another by then. */
static bool open_held(quern_held *held, const char *path) {
	char why[256];
	quern_h5 h;
	held->file = quern_open_file(path);
	if (held->file < 0) return true;
	char *name = quern_start_file_name(held);
	const bool frame = is_plain_hdf5(name);
	if (!frame && quern_h5_open(&h, name, why)) held->h5 = h.file;
	free(name);
	struct stat is, was;
	return frame || held->h5 >= 0 || stat(path, &is) || fstat(held->file, &was) || is.st_ino == was.st_ino;
}

quern_held quern_start_file_hold(const char *path) {
	quern_held held = { .path = path, .file = -1, .h5 = -1 };
	for (int k = 0; path && k < MOST_TRIES && !open_held(&held, path); k++) quern_start_file_let_go(&held);
	return held;
}

void quern_start_file_let_go(quern_held *held) {
	if (held->h5 >= 0) H5Fclose(held->h5);
	if (held->file >= 0) close(held->file);
	held->h5 = held->file = -1;
}

/* ---- both ---- */

bool quern_start_file_open(
	quern_start_file *f, const char *path, const quern_held *held, const char *const *sets, quern_text *why) {
	*f = (quern_start_file) { .h5 = { .file = -1 } };
	char *name = held && held->file >= 0 ? quern_start_file_name(held) : quern_copy(path);
	const bool good =
		is_plain_hdf5(name) ? open_frame(f, path, held, sets, why) : open_checkpoint(f, path, held, why);
	if (!f->scene) f->scene = quern_take(1, sizeof *f->scene);
	free(name);
	return good;
}

void quern_start_file_finish(quern_start_file *f) {
	quern_h5_close(&f->h5);
	quern_tree_destroy(f->scene);
	f->scene = NULL;
}

static const char *name_of(const quern_field *field) { return strchr(field->name, '.') + 1; }

/* Every set that is shown shows where its entries are or what they point at: any of its fields says how many there are. */
static herr_t note_rows(hid_t group, const char *name, const H5L_info_t *info, void *arg) {
	size_t rows, columns;
	(void)info;
	if (!quern_h5_read_size(group, name, &rows, &columns)) return 0;
	*(size_t *)arg = rows;
	return 1;
}

hid_t quern_start_file_set(
	const quern_start_file *f, const quern_set_store *set, uint32_t *n, int64_t *next_id) {
	const hid_t group = quern_h5_find(f->h5.file, f->frame ? quern_set_plural(set) : set->name);
	int64_t entries = -1;
	size_t rows = SIZE_MAX;
	*next_id = 0;
	if (group < 0) return -1;
	if (f->frame) {
		H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, NULL, note_rows, &rows);
		entries = rows <= MOST_ENTRIES ? (int64_t)rows : -1;
	} else if (!quern_h5_read_integer(group, "n", &entries) ||
			   !quern_h5_read_integer(group, "next_id", next_id) || *next_id < 0 || *next_id > most_id)
		entries = -1;
	*n = (uint32_t)entries;
	if (entries >= 0 && entries <= MOST_ENTRIES) return group;
	H5Gclose(group);
	return -1;
}

static const char *dataset(const quern_start_file *f, const quern_field *field, int component, char out[64]) {
	if (f->frame) snprintf(out, 64, "%s", name_of(field));
	else snprintf(out, 64, "%s.%d", name_of(field), component);
	return out;
}

bool quern_start_file_has(const quern_start_file *f, hid_t group, const quern_field *field) {
	char name[64];
	return H5Lexists(group, dataset(f, field, 0, name), H5P_DEFAULT) > 0;
}

bool quern_start_file_holds(const quern_start_file *f, hid_t group, const quern_field *field, uint32_t n) {
	char name[64];
	size_t rows, columns;
	return quern_h5_read_size(group, dataset(f, field, 0, name), &rows, &columns) && rows == n;
}

/* Vectors have three columns in a frame. */
static bool read_table(const quern_start_file *f, hid_t group, const quern_field *field, uint32_t n) {
	int from[9];
	const size_t columns = (size_t)quern_state_columns(field->shape, (uint32_t)f->dimension, from);
	size_t rows = 0, is = 0;
	if (!quern_h5_read_size(group, name_of(field), &rows, &is) || rows != n || is != columns) return false;
	double *table = quern_take((size_t)n * columns, sizeof *table);
	const bool good = quern_h5_read(group, name_of(field), H5T_NATIVE_DOUBLE, n, columns, table);
	for (size_t c = 0; good && c < columns; c++)
		for (size_t i = 0; from[c] >= 0 && i < n; i++)
			((double *)field->data[field->now][from[c]])[i] = table[i * columns + c];
	free(table);
	return good;
}

/* Entry q in the order of the places of the set's blocks, which alone says nothing of how the run had numbered these; a frame has
 * it already. NULL: the order of the file. */
static uint32_t *order_of(const quern_start_file *f, hid_t group, uint32_t n) {
	size_t blocks = 0, columns = 0;
	if (f->frame || !quern_h5_read_size(group, "by_place", &blocks, &columns) || blocks > MOST_ENTRIES)
		return NULL;
	uint32_t *place = quern_take(blocks + 1, sizeof *place), *block = quern_take(blocks + 2, sizeof *block);
	uint32_t *order = quern_take((size_t)n + 1, sizeof *order), q = 0;
	bool *seen = quern_take((size_t)n + 1, sizeof *seen);
	bool good = quern_h5_read(group, "by_place", H5T_NATIVE_UINT32, blocks, 1, place) &&
				quern_h5_read(group, "block", H5T_NATIVE_UINT32, blocks + 1, 1, block);
	for (size_t k = 0; good && k < blocks; k++) {
		good = place[k] < blocks && block[place[k] + 1] <= n;
		for (uint32_t i = good ? block[place[k]] : 0; good && i < block[place[k] + 1]; i++)
			if ((good = q < n && !seen[i])) seen[i] = true, order[q++] = i;
	}
	free(seen);
	free(place);
	free(block);
	if (good && q == n) return order;
	free(order);
	return NULL;
}

static void bring_in_order(void *column, size_t bytes, const uint32_t *order, uint32_t n) {
	char *was = quern_take((size_t)n + 1, bytes);
	memcpy(was, column, n * bytes);
	for (uint32_t q = 0; q < n; q++) memcpy((char *)column + q * bytes, was + order[q] * bytes, bytes);
	free(was);
}

/* Indices into a set that was brought in order. */
static void follow(const quern_start_file *f, const quern_set_store *of, int32_t *index, uint32_t n) {
	uint32_t m = 0;
	int64_t next_id;
	const hid_t group = quern_start_file_set(f, of, &m, &next_id);
	uint32_t *order = group >= 0 ? order_of(f, group, m) : NULL;
	int32_t *at = order ? quern_take((size_t)m + 1, sizeof *at) : NULL;
	for (uint32_t q = 0; order && q < m; q++) at[order[q]] = (int32_t)q;
	for (uint32_t i = 0; order && i < n; i++)
		if (index[i] >= 0 && (uint32_t)index[i] < m) index[i] = at[index[i]];
	if (group >= 0) H5Gclose(group);
	free(order);
	free(at);
}

bool quern_start_file_read(
	const quern_start_file *f, hid_t group, const quern_store *store, const quern_field *field, uint32_t n) {
	const bool whole = field->shape == QUERN_INDEX || field->shape == QUERN_ID;
	char name[64];
	if (f->frame && !whole) return read_table(f, group, field, n);
	uint32_t *order = order_of(f, group, n);
	bool good = true;
	for (int c = 0; c < field->n_components && good; c++) {
		void *column = field->data[field->now][c];
		good = quern_h5_read(group, dataset(f, field, c, name), quern_state_type(field), n, 1, column);
		if (good && order) bring_in_order(column, quern_field_bytes(field), order, n);
	}
	free(order);
	if (good && !f->frame && field->shape == QUERN_INDEX && field->target >= 0)
		follow(f, &store->sets[field->target], field->data[field->now][0], n);
	return good;
}

bool quern_start_file_knows(
	const quern_start_file *f, hid_t group, const quern_field *field, const char *plugin) {
	char source[64] = "";
	if (!f->frame) {
		const hid_t all = quern_h5_find(f->h5.file, "plugins");
		const bool there = all >= 0 && H5Lexists(all, plugin, H5P_DEFAULT) > 0;
		if (all >= 0) H5Gclose(all);
		return there;
	}
	const hid_t set = H5Dopen2(group, name_of(field), H5P_DEFAULT);
	const bool same =
		set >= 0 && quern_h5_read_text(set, "source", source, sizeof source) && !strcmp(source, plugin);
	if (set >= 0) H5Dclose(set);
	return same;
}
