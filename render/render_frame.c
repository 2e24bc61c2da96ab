/* SPDX-License-Identifier: MIT */
#include "child.h"
#include "exit.h"
#include "h5.h"
#include "render.h"
#include "run.h"
#include "text.h"
#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- which frame ---- */

/* The numbers of the first and last frame; false if there is none. */
static bool frames_of(const char *folder, int64_t *first, int64_t *last) {
	char *path = quern_format("%s/frames", folder);
	DIR *list = opendir(path);
	struct dirent *entry;
	bool any = false;
	while (list && (entry = readdir(list))) {
		char *end;
		const long long number = strtoll(entry->d_name, &end, 10);
		if (end == entry->d_name || strcmp(end, ".h5") != 0 || number < 0) continue;
		if (!any || number < *first) *first = number;
		if (!any || number > *last) *last = number;
		any = true;
	}
	if (list) closedir(list);
	free(path);
	return any;
}

/* ---- columns ---- */

double *quern_render_table(hid_t group, const char *name, size_t rows, size_t *columns) {
	size_t n;
	if (!quern_h5_read_size(group, name, &n, columns) || n != rows || !*columns) return NULL;
	double *table =
		n < SIZE_MAX / sizeof(double) / *columns ? calloc(n * *columns + 1, sizeof(double)) : NULL;
	if (!table) return NULL;
	const hid_t set = H5Dopen2(group, name, H5P_DEFAULT);
	if (n && H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, table) < 0) {
		free(table);
		table = NULL;
	}
	H5Dclose(set);
	return table;
}

/* One number for each, or NULL; one that is there and cannot be used is damage. */
static double *read_column(hid_t group, const char *name, render_cloud *cloud) {
	size_t columns = 0;
	if (!cloud->n || H5Lexists(group, name, H5P_DEFAULT) <= 0) return NULL;
	double *table = quern_render_table(group, name, cloud->n, &columns);
	cloud->unreadable |= !table || columns != 1;
	return table;
}

/* Positions, and nothing else yet; an empty cloud if the group is missing. */
static void read_positions(hid_t group, render_cloud *cloud) {
	size_t rows, columns;
	if (group < 0 || H5Lexists(group, "position", H5P_DEFAULT) <= 0) return;
	double *table = NULL;
	if (quern_h5_read_size(group, "position", &rows, &columns) && columns == 3)
		table = quern_render_table(group, "position", rows, &columns);
	cloud->unreadable = !table;
	for (size_t i = 0; table && i < 3 * rows; i++) cloud->unreadable |= !(fabs(table[i]) <= RENDER_FAR);
	if (cloud->unreadable) {
		free(table);
		return;
	}
	cloud->n = rows;
	cloud->position = (double(*)[3])(void *)table;
	cloud->size = quern_take(rows + 1, sizeof(double));
}

static void read_grains(hid_t group, render_cloud *cloud) {
	read_positions(group, cloud);
	double *radius = read_column(group, "radius", cloud);
	double *weight = read_column(group, "weight", cloud);
	double *fixed = read_column(group, "fixed", cloud);
	cloud->sort = quern_take(cloud->n + 1, 1);
	for (size_t i = 0; i < cloud->n; i++) {
		cloud->size[i] = radius ? radius[i] : 0;
		cloud->unreadable |= !(cloud->size[i] >= 0 && cloud->size[i] <= RENDER_FAR);
		if (weight && weight[i] < 1) cloud->sort[i] = RENDER_SHARED;
		if (fixed && fixed[i] != 0) cloud->sort[i] = RENDER_FIXED;
	}
	free(radius);
	free(weight);
	free(fixed);
}

/* Spray has an open volume, which says nothing about how much is there: it is not drawn larger than the rest. */
static void limit_sizes(render_cloud *cloud) {
	double *sorted = quern_take(cloud->n + 1, sizeof(double));
	memcpy(sorted, cloud->size, cloud->n * sizeof(double));
	const double most = 1.2 * quern_render_quantile(sorted, cloud->n, 0.5);
	for (size_t i = 0; i < cloud->n; i++)
		if (!(cloud->size[i] < most)) cloud->size[i] = most;
	free(sorted);
}

static void read_points(hid_t group, render_cloud *cloud, int dimension) {
	read_positions(group, cloud);
	double *volume = read_column(group, "volume", cloud);
	for (size_t i = 0; i < cloud->n; i++) {
		cloud->size[i] = volume ? (dimension == 2 ? sqrt(volume[i]) : cbrt(volume[i])) : 0;
		cloud->unreadable |= !(cloud->size[i] >= 0 && cloud->size[i] <= RENDER_FAR);
	}
	if (volume && !cloud->unreadable) limit_sizes(cloud);
	free(volume);
}

/* Cells follow each other along x inside a block: the smallest step is a cell's edge. */
static double read_cells(hid_t group, render_cloud *cloud) {
	double edge = INFINITY;
	read_positions(group, cloud);
	double *zone = read_column(group, "zone", cloud);
	if (zone) cloud->sort = quern_take(cloud->n + 1, 1);
	for (size_t i = 0; i + 1 < cloud->n; i++) {
		const double step = cloud->position[i + 1][0] - cloud->position[i][0];
		if (step > 0 && step < edge) edge = step;
	}
	for (size_t i = 0; i < cloud->n; i++) {
		cloud->size[i] = isfinite(edge) ? edge : 0;
		if (zone) cloud->sort[i] = (uint8_t)(zone[i] > 0 && zone[i] < 3 ? zone[i] : 0);
	}
	free(zone);
	return isfinite(edge) ? edge : 0;
}

/* ---- the field that colours ---- */

typedef struct {
	char set[24], name[64];
	int component; /* -1: the magnitude */
} wanted_field;

/* "SET.NAME.COMPONENT", with the first and the last part left out if one wishes. */
static wanted_field parse_field(const char *text) {
	static const char *const sets[] = { "grain.", "point.", "cell." };
	static const char *const components[] = { "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz" };
	wanted_field w = { .component = -1 };
	for (int k = 0; k < 3; k++)
		if (!strncmp(text, sets[k], strlen(sets[k]))) {
			snprintf(w.set, sizeof w.set, "%.*s", (int)strcspn(text, "."), text);
			text += strlen(sets[k]);
		}
	snprintf(w.name, sizeof w.name, "%s", text);
	char *dot = strrchr(w.name, '.');
	for (int k = 0; dot && k < 9; k++)
		if (!strcmp(dot + 1, components[k])) w.component = k < 3 ? k : k - 3;
	if (dot && w.component >= 0) *dot = 0;
	return w;
}

/* A byte that is no UTF-8 would end all drawing. */
static void make_legible(char *text) {
	for (unsigned char *c = (unsigned char *)text; *c;) {
		const int more = *c < 0x80 ? 0 : *c >= 0xc2 && *c < 0xe0 ? 1 : *c >= 0xe0 && *c < 0xf0 ? 2 : 3;
		bool good = *c >= 0x20 && *c != 0x7f && *c < 0xf5 && (*c < 0x80 || *c >= 0xc2);
		for (int k = 1; good && k <= more; k++) good = (c[k] & 0xc0) == 0x80;
		good = good && !(*c == 0xe0 && c[1] < 0xa0) && !(*c == 0xed && c[1] >= 0xa0) &&
			   !(*c == 0xf0 && c[1] < 0x90) && !(*c == 0xf4 && c[1] >= 0x90);
		if (!good) *c = '?';
		c += good ? more + 1 : 1;
	}
}

/* Of a dataset, so that it can be printed. */
static void read_unit(hid_t group, const char *name, char *out, size_t size) {
	const hid_t set = H5Dopen2(group, name, H5P_DEFAULT);
	if (!quern_h5_read_text(set, "unit", out, size)) snprintf(out, size, "1");
	make_legible(out);
	H5Dclose(set);
}

/* True if the group has the field and its values were taken. */
static bool take_values(hid_t group, const wanted_field *w, render_cloud *cloud, render_frame *f) {
	size_t columns;
	double *table = cloud->n ? quern_render_table(group, w->name, cloud->n, &columns) : NULL;
	if (!table || (w->component >= 0 && columns == 1) || w->component >= (int)columns ||
		!strcmp(w->name, "position")) {
		free(table);
		return false;
	}
	cloud->value = quern_take(cloud->n, sizeof(double));
	for (size_t i = 0; i < cloud->n; i++) {
		const double *row = table + i * columns;
		double square = 0;
		for (size_t c = 0; c < columns; c++) /* what stands off a tensor's diagonal stands for two */
			square += (columns == 6 && c > 2 ? 2 : 1) * row[c] * row[c];
		cloud->value[i] = columns == 1 ? row[0] : w->component >= 0 ? row[w->component] : sqrt(square);
	}
	f->signs = columns == 1 || w->component >= 0;
	read_unit(group, w->name, f->unit, sizeof f->unit);
	free(table);
	return true;
}

static bool take_vectors(hid_t group, const wanted_field *w, render_cloud *cloud, render_frame *f) {
	size_t columns;
	double *table = cloud->n ? quern_render_table(group, w->name, cloud->n, &columns) : NULL;
	if (!table || columns != 3 || w->component >= 0 || !strcmp(w->name, "position")) {
		free(table);
		return false;
	}
	cloud->vector = (double(*)[3])(void *)table;
	read_unit(group, w->name, f->vector_unit, sizeof f->vector_unit);
	return true;
}

typedef struct {
	quern_text list;
	size_t columns; /* 0: any number of them */
} field_list;

static herr_t note_field(hid_t group, const char *name, const H5L_info_t *info, void *arg) {
	field_list *of = arg;
	quern_text *list = &of->list;
	char path[128] = "";
	size_t rows, columns;
	(void)info;
	H5Iget_name(group, path, sizeof path);
	if (!strcmp(name, "position") || !quern_h5_read_size(group, name, &rows, &columns)) return 0;
	if (of->columns && columns != of->columns) return 0;
	quern_text_add(list, "%s%.*s.%s", list->length ? ", " : "", (int)strlen(path) - 2, path + 1, name);
	return 0;
}

static int no_such_field(
	const hid_t group[3], const char *field, const char *path, bool vectors, quern_text *why) {
	field_list of = { .columns = vectors ? 3 : 0 };
	for (int k = 0; k < 3; k++)
		if (group[k] >= 0) H5Literate(group[k], H5_INDEX_NAME, H5_ITER_INC, NULL, note_field, &of);
	quern_text_add(why, "%s has no %s '%s' that could be drawn; it has %s", path,
		vectors ? "vectors" : "field", field, of.list.length ? quern_text_string(&of.list) : "none");
	quern_text_finish(&of.list);
	return QUERN_EXIT_USAGE;
}

/* Takes what colours the frame, or its arrows, from all sets that are meant. */
static bool take_field(render_frame *f, const hid_t group[3], const char *field,
	bool (*take)(hid_t, const wanted_field *, render_cloud *, render_frame *), char name[64]) {
	render_cloud *cloud[3] = { &f->grains, &f->points, &f->cells };
	static const char *const sets[3] = { "grain", "point", "cell" };
	const wanted_field w = parse_field(field);
	bool any = false;
	for (int k = 0; k < 3; k++) {
		/* cells hide what is in them: only where they are asked for */
		const bool wanted = *w.set ? !strcmp(w.set, sets[k]) : k < 2;
		if (wanted && group[k] >= 0) any = take(group[k], &w, cloud[k], f) || any;
	}
	if (any) snprintf(name, 64, "%.63s", field);
	return any;
}

static int take_fields(
	render_frame *f, const hid_t group[3], const char *path, const render_wish *wish, quern_text *why) {
	const char *field = wish->field ? wish->field : wish->chains ? NULL : "velocity";
	if (field && !take_field(f, group, field, take_values, f->field) && wish->field)
		return no_such_field(group, field, path, false, why);
	if (wish->vectors && !take_field(f, group, wish->vectors, take_vectors, f->vector_field))
		return no_such_field(group, wish->vectors, path, true, why);
	return QUERN_EXIT_DONE;
}

/* ---- all of it ---- */

static bool read_head(hid_t file, render_frame *f) {
	char format[32] = "";
	int64_t dimension = 0;
	const bool good = quern_h5_read_text(file, "format", format, sizeof format) &&
					  !strncmp(format, "quern-frame ", 12) && quern_h5_read_number(file, "time", &f->time) &&
					  isfinite(f->time) && quern_h5_read_integer(file, "dimension", &dimension) &&
					  dimension >= 2 && dimension <= 3;
	f->dimension = (int)dimension;
	quern_h5_read_text(file, "name", f->name, sizeof f->name);
	make_legible(f->name);
	return good;
}

/* Where bodies are, if they move. */
static void read_poses(hid_t file, render_frame *f) {
	const hid_t group = quern_h5_find(file, "bodies");
	size_t rows = 0, columns = 0;
	double *position = NULL, *turn = NULL;
	if (group < 0) return;
	if (quern_h5_read_size(group, "position", &rows, &columns) && rows && columns == 3)
		position = quern_render_table(group, "position", rows, &columns);
	if (position) turn = quern_render_table(group, "turn", rows, &columns);
	if (turn && columns == 9) {
		f->pose = quern_take(rows, sizeof *f->pose);
		f->n_poses = rows;
	}
	for (size_t i = 0; i < 9 * f->n_poses; i++)
		if (!(fabs(turn[i]) <= 2) || (i < 3 * f->n_poses && !(fabs(position[i]) < RENDER_FAR)))
			f->n_poses = 0; /* damaged */
	for (size_t b = 0; b < f->n_poses; b++) {
		memcpy(f->pose[b].position, position + 3 * b, sizeof f->pose[b].position);
		memcpy(f->pose[b].turn, turn + 9 * b, sizeof f->pose[b].turn);
		if (f->dimension == 2) f->pose[b].turn[8] = 1;
	}
	free(position);
	free(turn);
	H5Gclose(group);
}

static int read_clouds(
	render_frame *f, hid_t file, const char *path, const render_wish *wish, quern_text *why) {
	const hid_t group[3] = { quern_h5_find(file, "grains"), quern_h5_find(file, "points"),
		quern_h5_find(file, "cells") };
	int status = QUERN_EXIT_DONE;
	read_grains(group[0], &f->grains);
	read_points(group[1], &f->points, f->dimension);
	f->cell = read_cells(group[2], &f->cells);
	if (f->grains.unreadable || f->points.unreadable || f->cells.unreadable) {
		quern_text_add(why, "%s is damaged: its positions or sizes cannot be read, or are none", path);
		status = QUERN_EXIT_SCENE;
	} else if (!f->grains.n && !f->points.n) {
		quern_text_add(why, "%s holds neither grains nor points", path);
		status = QUERN_EXIT_SCENE;
	} else status = take_fields(f, group, path, wish, why);
	if (status == QUERN_EXIT_DONE && wish->chains && !quern_render_links_read(f, file, path, why))
		status = QUERN_EXIT_SCENE;
	for (int k = 0; k < 3; k++)
		if (group[k] >= 0) H5Gclose(group[k]);
	read_poses(file, f);
	return status;
}

/* Bodies and the domain stand in the run's own scene. A picture can do without. */
static quern_scene *scene_of(const char *folder) {
	char *path = quern_format("%s/scene.yaml", folder);
	quern_scene *scene = quern_scene_read(path, (const char *const[]) { NULL }, &quern_host_table);
	if (!quern_report_errors(scene->report)) return free(path), scene;
	quern_report_print(scene->report, stderr);
	fprintf(stderr, "quern render: domain and bodies are left out, since %s cannot be read\n", path);
	quern_scene_destroy(scene);
	free(path);
	return NULL;
}

/* Between sorts points may be beyond a periodic face, where a picture has no place. */
static void come_back(const quern_general *g, render_cloud *cloud) {
	for (int k = 0; k < g->dimension; k++) {
		const double length = g->upper[k] - g->lower[k];
		for (size_t i = 0; i < cloud->n && g->periodic[k]; i++) {
			double *at = &cloud->position[i][k];
			*at -= length * floor((*at - g->lower[k]) / length);
		}
	}
}

int quern_render_frame_read_file(
	render_frame *f, const char *path, int64_t number, const render_wish *wish, quern_text *why) {
	*f = (render_frame) { .number = number };
	const hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
	int status = QUERN_EXIT_SCENE;
	if (file < 0) quern_text_add(why, "%s cannot be read: it is missing or damaged", path);
	else if (!read_head(file, f)) quern_text_add(why, "%s is no frame of this program, or is damaged", path);
	else status = read_clouds(f, file, path, wish, why);
	if (file >= 0) H5Fclose(file);
	return status;
}

/* ---- damage ---- */

typedef struct {
	const char *path;
	const render_wish *wish;
} trial;

/* What the library prints as it crashes is nobody's sentence. */
static void try_reading(void *arg) {
	const trial *t = arg;
	render_frame f;
	quern_text why = { 0 };
	if (!freopen("/dev/null", "w", stderr)) return;
	quern_render_frame_read_file(&f, t->path, 0, t->wish, &why);
	quern_text_finish(&why);
	quern_render_frame_finish(&f);
}

/* Frames have no checksum, and a damaged one can crash the library that reads it: so a child reads it first. */
static bool is_readable(const char *path, const render_wish *wish, quern_text *why) {
	enum { SECONDS = 600 };
	char what[80];
	trial t = { path, wish };
	const quern_child how = quern_child_run(try_reading, &t, SECONDS);
	if (how.end != QUERN_CHILD_CRASHED && how.end != QUERN_CHILD_LATE) return true;
	quern_child_say(&how, SECONDS, what);
	quern_text_add(why, "%s is damaged: reading it %s", path, what);
	return false;
}

/* ---- a run's ---- */

int64_t quern_render_frame_last(const char *folder) {
	int64_t first, last;
	return frames_of(folder, &first, &last) ? last : -1;
}

int quern_render_frame_read(
	render_frame *f, const char *folder, int64_t number, const render_wish *wish, quern_text *why) {
	int64_t first = 0, last = 0;
	*f = (render_frame) { .number = number };
	if (!frames_of(folder, &first, &last)) {
		quern_text_add(why, "%s/frames holds no frames: name the folder of a run", folder);
		return QUERN_EXIT_SCENE;
	}
	if (number < 0) number = last;
	if (number < first || number > last) {
		quern_text_add(why, "%s has no frame %lld; its frames are %lld to %lld", folder, (long long)number,
			(long long)first, (long long)last);
		return QUERN_EXIT_SCENE;
	}
	char *path = quern_format("%s/frames/%06lld.h5", folder, (long long)number);
	const int status = is_readable(path, wish, why) ? quern_render_frame_read_file(f, path, number, wish, why)
													: QUERN_EXIT_SCENE;
	if (status == QUERN_EXIT_DONE) f->scene = scene_of(folder);
	if (f->scene) come_back(&f->scene->general, &f->points);
	if (status == QUERN_EXIT_DONE) quern_render_links_mend(f);
	free(path);
	return status;
}

static void finish_cloud(render_cloud *cloud) {
	free(cloud->position);
	free(cloud->size);
	free(cloud->value);
	free(cloud->vector);
	free(cloud->sort);
}

void quern_render_frame_finish(render_frame *f) {
	finish_cloud(&f->grains);
	finish_cloud(&f->points);
	finish_cloud(&f->cells);
	free(f->pose);
	free(f->link);
	if (f->scene) quern_scene_destroy(f->scene);
}
