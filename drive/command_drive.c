/* SPDX-License-Identifier: MIT */
/* quern drive - reads what to do, walks, writes the table, and has the chart drawn by `quern chart` */
#include "drive.h"
#include "file.h"
#include "options.h"
#include "quantity.h"
#include "watch.h"
#include <errno.h>
#include <math.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { MOST_TABLE = 1 << 26 };

typedef struct {
	const char *material, *scene, *path, *out, *curve, *strain, *stress, *hold, *pressure, *rate, *time;
	quern_texts sets;
	int64_t dimension, steps;
} options;

/* ---- the command line ---- */

static bool ends_with(const char *text, const char *end) {
	const size_t n = strlen(text), m = strlen(end);
	return n > m && !strcmp(text + n - m, end);
}

static bool is_table(const options *o) { return strchr(o->path, '/') || strchr(o->path, '.'); }

static int check_path(const options *o) {
	const quern_command *us = &quern_command_drive;
	if (!o->path)
		return quern_usage(us,
			"--path is missing: isotropic, oedometric, simple_shear, triaxial, tension or a table, FILE.csv");
	if (is_table(o)) {
		const char *const both[] = { o->strain ? "strain" : NULL, o->stress ? "stress" : NULL,
			o->hold ? "hold" : NULL, o->rate ? "rate" : NULL, o->time ? "time" : NULL };
		for (size_t k = 0; k < sizeof both / sizeof *both; k++)
			if (both[k])
				return quern_usage(
					us, "--%s does not go with a table, which says all of that itself", both[k]);
		return QUERN_OPTIONS_READ;
	}
	for (size_t k = 0; quern_drive_paths[k]; k++)
		if (!strcmp(quern_drive_paths[k], o->path)) return QUERN_OPTIONS_READ;
	const char *near = quern_nearest(o->path, quern_drive_paths);
	if (near) return quern_usage(us, "there is no path '%s', did you mean '%s'?", o->path, near);
	return quern_usage(us,
		"there is no path '%s': sand is pressed on an isotropic one from all sides, on an oedometric one between sides "
		"that hold, on a triaxial one between sides that press; there are simple_shear, tension, and tables, whose "
		"names end with .csv",
		o->path);
}

static int check(const options *o) {
	const quern_command *us = &quern_command_drive;
	static const char *const forms[] = { ".csv", ".svg", ".png", ".pdf" };
	bool known = false;
	if (!o->material && !o->scene)
		return quern_usage(us, "a material is missing, such as mu_i, or --scene FILE");
	if (o->material && o->scene) return quern_usage(us, "give a material or --scene, not both");
	if (o->scene && o->dimension) return quern_usage(us, "--dimension is the scene's own, with --scene");
	for (size_t k = 0; k < sizeof forms / sizeof *forms; k++) known |= ends_with(o->out, forms[k]);
	if (!known)
		return quern_usage(
			us, "-o %s: the name must end with .svg, .png, .pdf, or with .csv for the table alone", o->out);
	return check_path(o);
}

static int parse(options *o, int argc, char **argv) {
	quern_words words = { .missing = "a material is missing", .most = 1 };
	const quern_option known[] = { QUERN_TEXT(&o->path, 0, "path", "PATH",
									   "isotropic, oedometric, simple_shear, triaxial, tension, or FILE.csv"),
		QUERN_TEXTS(&o->sets, "set", "KEY=VALUE",
			"a parameter of the material, or with --scene a key of the scene; may stand several times"),
		QUERN_TEXT(&o->scene, 0, "scene", "FILE", "take the material of this scene's continuum"),
		QUERN_NUMBER(&o->dimension, "dimension", 2, 3, "default: 3"),
		QUERN_TEXT(&o->strain, 0, "strain", "X[,X]",
			"how far, and on to where: 5%,0; default: 1 %, of shear and triaxial 10 %"),
		QUERN_TEXT(&o->stress, 0, "stress", "X[,X]", "the same by stress: 200kPa"),
		QUERN_TEXT(&o->pressure, 0, "pressure", "X",
			"to begin with, all around; default: 0, of shear and triaxial a thousandth of the bulk modulus"),
		QUERN_TEXT(&o->hold, 0, "hold", "WHAT", "of simple_shear: volume, the default, or pressure"),
		QUERN_TEXT(&o->rate, 0, "rate", "X", "of the strain: 5 1/s; default: 0.01 1/s"),
		QUERN_TEXT(&o->time, 0, "time", "X", "of a path by stress: for each piece; default: 10 s"),
		QUERN_NUMBER(&o->steps, "steps", 1, DRIVE_MOST_STEPS, "of each piece; default: 1000"),
		QUERN_TEXT(&o->curve, 0, "curve", "X,Y[,Y]",
			"columns of the table to draw; default: shear stress and pressure"),
		QUERN_TEXT(&o->out, 'o', "output", "FILE",
			"picture, .svg, .png or .pdf, with the table beside it, or .csv; default: drive.svg"),
		QUERN_END_OPTIONS };
	const int status = quern_options_read(&quern_command_drive, known, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return status;
	o->material = words.n ? words.at[0] : NULL;
	return check(o);
}

/* ---- the path ---- */

static bool read_number(quern_units *units, const char *option, const char *text, const char *unit,
	double least, bool open, double *value, quern_text *why) {
	char broken[160];
	if (!text) return true;
	if (!quern_quantity_read(units, text, unit, value, broken))
		return quern_text_add(why, "--%s: %s", option, broken), false;
	if (*value > least || (!open && *value == least)) return true;
	quern_text_add(why, "--%s %s: it must be %s %g", option, text, open ? "above" : "at least", least);
	return false;
}

/* All bytes that a file of `size` still has; -1 with errno. */
static ssize_t read_bytes(int fd, char *data, size_t size) {
	size_t length = 0;
	while (length < size) {
		const ssize_t n = read(fd, data + length, size - length);
		if (n < 0 && errno != EINTR) return -1;
		if (n == 0) break;
		if (n > 0) length += (size_t)n;
	}
	return (ssize_t)length;
}

/* The file's bytes; NULL with one sentence. */
static char *read_file(const char *path, size_t *length, quern_text *why) {
	struct stat is = { 0 };
	ssize_t found = -1;
	char *data = NULL;
	const int fd = quern_open_file(path);
	if (fd >= 0 && !fstat(fd, &is) && is.st_size <= MOST_TABLE) {
		data = quern_take((size_t)is.st_size + 1, 1);
		found = read_bytes(fd, data, (size_t)is.st_size);
	}
	if (is.st_size > MOST_TABLE) quern_text_add(why, "%s: a table has at most %d bytes", path, MOST_TABLE);
	else if (found < 0) quern_text_add(why, "%s: %s", path, strerror(errno));
	if (fd >= 0) close(fd);
	if (found >= 0) return *length = (size_t)found, data;
	free(data);
	return NULL;
}

static bool read_table(
	const options *o, const drive_material *m, double pressure, drive_path *path, quern_text *why) {
	size_t length = 0;
	char *data = read_file(o->path, &length, why);
	if (!data) return false;
	quern_text broken = { 0 };
	const bool good = quern_drive_table_read(data, length, m->dim, pressure, path, &broken);
	if (!good) quern_text_add(why, "%s: %s", o->path, quern_text_string(&broken));
	quern_text_finish(&broken);
	free(data);
	path->steps = (uint32_t)o->steps;
	return good;
}

static bool make_path(const options *o, const drive_material *m, drive_path *path, quern_text *why) {
	drive_wish w = { .name = o->path,
		.strain = o->strain,
		.stress = o->stress,
		.hold = o->hold,
		.pressure = NAN,
		.rate = NAN,
		.time = NAN,
		.bulk = m->bulk,
		.steps = o->steps };
	*path = (drive_path) { .n = 0 };
	if (!read_number(m->units, "pressure", o->pressure, "Pa", 0, false, &w.pressure, why) ||
		!read_number(m->units, "rate", o->rate, "1/s", 0, true, &w.rate, why) ||
		!read_number(m->units, "time", o->time, "s", 0, true, &w.time, why))
		return false;
	if (is_table(o) ? !read_table(o, m, isfinite(w.pressure) ? w.pressure : 0, path, why)
					: !quern_drive_path_make(path, &w, m->dim, m->units, why))
		return false;
	if ((uint64_t)path->n * path->steps <= DRIVE_MOST_STEPS) return true;
	quern_text_add(why, "%u pieces of %u steps are more than %d steps; give fewer --steps", path->n,
		path->steps, DRIVE_MOST_STEPS);
	return false;
}

/* ---- what comes of it ---- */

static bool write_table(const drive_record *r, const char *path, char why[256]) {
	quern_text text = { 0 };
	char number[32];
	quern_text_add(&text, "%s\n", quern_text_string(&r->head));
	for (size_t i = 0; i < r->n_rows; i++)
		for (size_t c = 0; c < r->n_columns; c++) {
			quern_number(r->data[i * r->n_columns + c], number);
			quern_text_add(&text, "%s%c", number, c + 1 < r->n_columns ? ',' : '\n');
		}
	const bool good = quern_save_bytes(path, text.data, text.length, why);
	quern_text_finish(&text);
	return good;
}

static int run_chart(const char *program, char *const *words) {
	extern char **environ;
	pid_t child;
	int status;
	fflush(NULL);
	const int failed = posix_spawn(&child, program, NULL, NULL, words, environ);
	if (failed) {
		fprintf(stderr, "quern drive: error: %s cannot be started: %s\n", program, strerror(failed));
		return QUERN_EXIT_FAILED;
	}
	while (waitpid(child, &status, 0) < 0)
		if (errno != EINTR) return QUERN_EXIT_FAILED;
	return WIFEXITED(status) ? WEXITSTATUS(status) : QUERN_EXIT_FAILED;
}

static int draw(const options *o, const drive_material *m, const char *table) {
	char *program = quern_program_find("chart");
	if (!program) {
		fprintf(stderr, "quern drive: error: there is no quern-chart to draw %s; %s has the numbers\n",
			o->out, table);
		return QUERN_EXIT_IO;
	}
	const char *curve = o->curve      ? o->curve
						: is_table(o) ? "time,shear_stress,pressure"
									  : "strain,shear_stress,pressure";
	char *title = quern_format("%s, %s, %u-D", m->file->plugin.id, o->path, m->dim);
	char *words[] = { program, quern_copy(table), quern_copy("--table"), quern_copy(curve),
		quern_copy("--title"), title, quern_copy("-o"), quern_copy(o->out), NULL };
	const int status = run_chart(program, words);
	for (char **word = words; *word; word++) free(*word);
	return status;
}

static void tell(const drive_record *r, const drive_material *m, const drive_point *p) {
	double stress[DRIVE_MOST_COMPONENTS] = { 0 };
	for (uint32_t c = 0; c < quern_drive_components(m->dim); c++) stress[c] = p->stress[c][0];
	printf(
		"%s, %u-D: %zu steps, at most %u call%s of it in one; at the end pressure %.6g Pa, shear stress %.6g Pa, volume %.6g of "
		"that at the beginning\n",
		m->file->plugin.id, m->dim, r->n_rows - 1, r->most_tries, r->most_tries == 1 ? "" : "s",
		quern_drive_point_pressure(p), quern_drive_shear_of(m->dim, stress), p->volume);
}

/* The table's name: what the picture is called, with another end. */
static char *table_name(const options *o) {
	return quern_format("%.*s.csv", (int)(strrchr(o->out, '.') - o->out), o->out);
}

static int save(const options *o, const drive_material *m, const drive_record *r, const drive_point *p) {
	char broken[256] = "", *table = table_name(o);
	int status = QUERN_EXIT_IO;
	if (!write_table(r, table, broken)) fprintf(stderr, "quern drive: error: %s\n", broken);
	else {
		tell(r, m, p);
		puts(table);
		status = ends_with(o->out, ".csv") ? QUERN_EXIT_DONE : draw(o, m, table);
	}
	free(table);
	return status;
}

/* Also of a path that the material does not bear to its end there are a table and a picture. */
static int walk(const options *o, const drive_material *m, const drive_path *path, quern_text *why) {
	drive_point point;
	drive_record record = { .n_rows = 0 };
	int status = QUERN_EXIT_SCENE;
	if (quern_drive_point_begin(&point, m, path, why)) {
		const bool whole = quern_drive_walk(&point, path, &record, why);
		status = save(o, m, &record, &point);
		if (!whole) status = QUERN_EXIT_FAILED;
	}
	quern_drive_record_finish(&record);
	quern_drive_point_finish(&point);
	return status;
}

static int do_drive(int argc, char **argv) {
	options o = { .steps = 1000, .out = "drive.svg" };
	int status = parse(&o, argc, argv);
	if (status != QUERN_OPTIONS_READ) return free(o.sets.at), status;
	drive_material m;
	drive_path path = { .n = 0 };
	quern_text why = { 0 };
	const bool open =
		o.scene ? quern_drive_material_of(&m, o.scene, &o.sets)
				: quern_drive_material_open(&m, o.material, o.dimension ? (uint32_t)o.dimension : 3, &o.sets);
	status = QUERN_EXIT_SCENE;
	if (open) {
		quern_watch_begin(); // not before: while plugins are looked at, a copy of the process loads them
		quern_watch_know(m.scene ? m.scene->loader : m.loader);
		if (make_path(&o, &m, &path, &why)) status = walk(&o, &m, &path, &why);
	}
	if (why.length) fprintf(stderr, "quern drive: error: %s\n", quern_text_string(&why));
	quern_watch_know(NULL);
	quern_text_finish(&why);
	quern_drive_path_finish(&path);
	quern_drive_material_finish(&m);
	free(o.sets.at);
	return status;
}

const quern_command quern_command_drive = { "drive", "MATERIAL --path PATH [OPTION]...",
	"a material point along a path of strain or stress", do_drive };
