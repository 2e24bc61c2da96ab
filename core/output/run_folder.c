/* SPDX-License-Identifier: MIT */
#include "run_folder.h"
#include "folder.h"
#include "start.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

/* What a run leaves, in the order in which a message names it; files/ alone is no sign of a run. */
static const char *const names[] = { "scene.yaml", "input.yaml", "checkpoint.h5", "summary.json",
	"series.csv", "log.txt", "progress.json", "run.xdmf", "frames", "views", "files", NULL };
enum { SIGNS = 10 };

/* ---- who holds it ---- */

static char *in_folder(const quern_run_folder *f, const char *name) {
	return quern_format("%s/%s", f->path, name);
}

static bool is_same_file(int fd, const char *path) {
	struct stat a, b;
	return !fstat(fd, &a) && !stat(path, &b) && a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

static long holder_of(int fd) {
	char text[24] = "";
	const ssize_t n = pread(fd, text, sizeof text - 1, 0);
	return n > 0 ? strtol(text, NULL, 10) : 0;
}

/* The lock is the kernel's: it goes with the process. Who has held it before may have removed the file meanwhile. */
static int lock_file(const char *path, long *holder) {
	for (;;) {
		const int fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
		if (fd < 0) return -1;
		if (flock(fd, LOCK_EX | LOCK_NB)) {
			const int why = errno;
			*holder = holder_of(fd);
			close(fd);
			errno = why;
			return -1;
		}
		if (is_same_file(fd, path)) return fd;
		close(fd);
	}
}

bool quern_run_folder_take(quern_run_folder *f, const char *path, quern_text *why) {
	struct stat is;
	long holder = 0;
	*f = (quern_run_folder) { path, -1, stat(path, &is) != 0 };
	if (!quern_folder_make(path)) {
		quern_text_add(why, "the folder %s cannot be made: %s", path, strerror(errno));
		return false;
	}
	char *lock = in_folder(f, ".quern.lock");
	f->lock = lock_file(lock, &holder);
	if (f->lock < 0 && errno == EWOULDBLOCK)
		quern_text_add(why,
			"%s is in use by another run, process %ld: wait for it, or name another folder by -o", path,
			holder);
	else if (f->lock < 0) quern_text_add(why, "%s cannot be written: %s", lock, strerror(errno));
	else if (ftruncate(f->lock, 0) || dprintf(f->lock, "%ld\n", (long)getpid()) < 0) {
		quern_text_add(why, "%s cannot be written: %s", lock, strerror(errno));
		quern_run_folder_give_back(f);
	}
	free(lock);
	return f->lock >= 0;
}

void quern_run_folder_give_back(quern_run_folder *f) {
	if (f->lock < 0) return;
	char *lock = in_folder(f, ".quern.lock");
	unlink(lock);
	close(f->lock);
	f->lock = -1;
	if (f->made) rmdir(f->path);
	free(lock);
}

/* ---- what a run leaves ---- */

static bool ends_with(const char *name, const char *end) {
	const size_t n = strlen(name), m = strlen(end);
	return n >= m && !strcmp(name + n - m, end);
}

/* "000012.h5", "grains_000012.hdf": the number, with six digits or more and `end` behind it; -1: another name. */
static int64_t number_in(const char *name, const char *end) {
	const size_t digits = strspn(name, "0123456789");
	if (digits < 6 || digits > 18 || strcmp(name + digits, end) != 0) return -1;
	return strtoll(name, NULL, 10);
}

static int64_t frame_of(const char *name) { return number_in(name, ".h5"); }

static int64_t view_of(const char *name) {
	const char *rest = strrchr(name, '_');
	return rest && rest > name ? number_in(rest + 1, ".hdf") : -1;
}

/* "0123456789abcdef-table.txt": the name begins with the hash of what is in it. */
static bool is_copy_name(const char *name) {
	return strspn(name, "0123456789abcdef") >= 16 && name[16] == '-';
}

static bool is_copy(const char *path, const char *name) {
	uint64_t hash;
	char digits[20];
	if (!is_copy_name(name) || !quern_hash_file(path, 0, &hash)) return false;
	snprintf(digits, sizeof digits, "%016llx", (unsigned long long)hash);
	return !strncmp(digits, name, 16);
}

/* Whether a run has left that file in frames/, views/ or files/; half a file that it was killed over is one too. */
static bool is_left(const char *folder, const char *path, const char *name) {
	char *whole = quern_copy(name);
	const bool half = ends_with(whole, ".part");
	if (half) whole[strlen(whole) - strlen(".part")] = 0;
	const bool left = !strcmp(folder, "frames")  ? frame_of(whole) >= 0
					  : !strcmp(folder, "views") ? view_of(whole) >= 0 || ends_with(whole, ".hdf.series")
					  : half                     ? is_copy_name(whole)
												 : is_copy(path, name);
	free(whole);
	return left;
}

typedef void (*visitor)(void *context, const char *path, int64_t number);

static void visit_folder(const quern_run_folder *f, const char *folder, visitor visit, void *context) {
	char *inner = in_folder(f, folder);
	DIR *list = opendir(inner);
	struct dirent *entry;
	while (list && (entry = readdir(list))) {
		char *path = quern_format("%s/%s", inner, entry->d_name);
		const int64_t frame = frame_of(entry->d_name);
		if (is_left(folder, path, entry->d_name))
			visit(context, path, frame >= 0 ? frame : view_of(entry->d_name));
		free(path);
	}
	if (list) closedir(list);
	free(inner);
}

/* Every file that runs leave and that is there; `number`: of its frame, or -1. */
static void visit_all(const quern_run_folder *f, visitor visit, void *context) {
	struct stat is;
	for (const char *const *name = names; *name; name++) {
		char *path = in_folder(f, *name), *half = quern_format("%s.part", path);
		if (!stat(path, &is) && S_ISDIR(is.st_mode)) visit_folder(f, *name, visit, context);
		else if (!lstat(path, &is)) visit(context, path, -1);
		if (!lstat(half, &is)) visit(context, half, -1);
		free(path);
		free(half);
	}
}

/* ---- what must not be replaced ---- */

typedef struct {
	struct stat *at;
	size_t n, capacity;
} inputs;

static void add_input(inputs *in, const char *path) {
	in->at = quern_grow(in->at, in->n, &in->capacity, sizeof *in->at);
	in->n += !stat(path, &in->at[in->n]);
}

static char *note_input(void *context, const char *path) {
	add_input(context, path);
	return quern_copy(path);
}

/* The scene's own file and all that it names. */
static inputs inputs_of(const quern_scene *s) {
	inputs in = { NULL, 0, 0 };
	const quern_naming naming = { note_input, &in };
	if (s->tree->n_names) add_input(&in, s->tree->names[0]);
	quern_node_destroy(quern_scene_tree(s, &naming));
	return in;
}

static bool is_input(const inputs *in, const char *path) {
	struct stat is;
	if (stat(path, &is)) return false;
	for (size_t i = 0; i < in->n; i++)
		if (in->at[i].st_dev == is.st_dev && in->at[i].st_ino == is.st_ino) return true;
	return false;
}

/* The first line of a scene that a run has written ends with the checksum of the others: who changes it makes it his. */
static const char heading[] = "# The scene with every default, written by quern run; checksum ";
enum { HEADING = sizeof heading - 1 + 16 + 1 };

static bool is_own_scene(const char *path) {
	char line[HEADING + 1] = "";
	uint64_t hash;
	const int fd = quern_open_file(path);
	const bool whole = fd >= 0 && read(fd, line, HEADING) == HEADING;
	if (fd >= 0) close(fd);
	return whole && !strncmp(line, heading, sizeof heading - 1) && line[HEADING - 1] == '\n' &&
		   quern_hash_file(path, HEADING, &hash) && strtoull(line + sizeof heading - 1, NULL, 16) == hash;
}

typedef struct {
	const inputs *in;
	quern_text *why;
} looking;

static void look_at(void *context, const char *path, int64_t number) {
	const looking *l = context;
	(void)number;
	if (!l->why->length && is_input(l->in, path))
		quern_text_add(l->why,
			"%s belongs to the scene itself, and a run would replace it: name another folder by -o", path);
}

static bool list_left(const quern_run_folder *f, quern_text *list) {
	struct stat is;
	for (int k = 0; k < SIGNS; k++) {
		char *path = in_folder(f, names[k]);
		if (!lstat(path, &is)) quern_text_add(list, "%s%s", list->length ? ", " : "", names[k]);
		free(path);
	}
	return list->length > 0;
}

/* A scene in there that no run has written, or that somebody has changed, is nobody's to remove. */
static void keep_foreign_scene(const quern_run_folder *f, quern_text *why) {
	char *scene = in_folder(f, "scene.yaml"), *input = in_folder(f, "input.yaml");
	const bool own = is_own_scene(scene);
	const char *foreign = own ? NULL : !access(scene, F_OK) ? scene : !access(input, F_OK) ? input : NULL;
	if (foreign)
		quern_text_add(why,
			"%s is not what a run has left there, and a run would replace it: move it away, or name another "
			"folder by -o",
			foreign);
	free(scene);
	free(input);
}

bool quern_run_folder_is_free(
	const quern_run_folder *f, const quern_scene *scene, bool force, quern_text *why) {
	quern_text list = { 0 };
	inputs in = inputs_of(scene);
	looking l = { &in, why };
	visit_all(f, look_at, &l);
	free(in.at);
	if (!why->length && list_left(f, &list)) {
		if (force) keep_foreign_scene(f, why);
		else
			quern_text_add(why,
				"%s holds a run already (%s): go on with it by --resume, replace it by --force, or name "
				"another folder by -o",
				f->path, list.data);
	}
	quern_text_finish(&list);
	return !why->length;
}

static void find_later(void *context, const char *path, int64_t number) {
	(void)path;
	if (number > 0) *(bool *)context = true;
}

bool quern_run_folder_is_begun(const quern_run_folder *f, quern_text *why) {
	bool later = false;
	visit_folder(f, "frames", find_later, &later);
	keep_foreign_scene(f, why);
	if (later && !why->length)
		quern_text_add(why,
			"%s holds frames and no checkpoint.h5 to go on from: put it back, or start anew with --force",
			f->path);
	return !why->length;
}

/* ---- removing ---- */

static void remove_one(void *context, const char *path, int64_t number) {
	(void)number;
	if (!is_input(context, path)) unlink(path);
}

void quern_run_folder_clear(const quern_run_folder *f, const quern_scene *scene) {
	inputs in = inputs_of(scene);
	char *own = in_folder(f, "scene.yaml"), *input = in_folder(f, "input.yaml");
	if (is_input(&in, own)) add_input(&in, input); /* it is what that one was made from */
	visit_all(f, remove_one, &in);
	free(in.at);
	free(own);
	free(input);
	for (const char *const *name = names; *name; name++) {
		char *path = in_folder(f, *name);
		rmdir(path); /* stays where anything else is in it */
		free(path);
	}
}

static void remove_later(void *context, const char *path, int64_t number) {
	if (number >= *(const int64_t *)context) unlink(path);
}

void quern_run_folder_trim(const quern_run_folder *f, int64_t frames) {
	visit_folder(f, "frames", remove_later, &frames);
	visit_folder(f, "views", remove_later, &frames);
}

/* ---- the scene ---- */

typedef struct {
	const quern_run_folder *folder;
	const quern_run *run;
	char *why;
	bool failed;
} copying;

/* Copies a file that the scene names to files/, under its hash, and gives it that name. */
static char *copy_input(void *context, const char *path) {
	copying *c = context;
	uint64_t hash;
	char digits[20];
	const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path;
	char *held = quern_start_held(c->run, path);
	if (!quern_hash_file(held, 0, &hash)) {
		if (!c->failed) snprintf(c->why, 256, "%.180s cannot be read: %s", path, strerror(errno));
		c->failed = true;
		free(held);
		return quern_copy(path);
	}
	snprintf(digits, sizeof digits, "%016llx-", (unsigned long long)hash);
	if (!strncmp(base, digits, 17)) base += 17; /* a copy already */
	char *name = quern_format("files/%s%s", digits, base), *to = in_folder(c->folder, name);
	char *folder = in_folder(c->folder, "files");
	if (!c->failed && !is_copy(to, name + strlen("files/"))) {
		mkdir(folder, 0777);
		c->failed = !quern_save_copy(to, held, c->why);
	}
	free(held);
	free(folder);
	free(to);
	return name;
}

static bool save_resolved(const quern_run_folder *f, const quern_run *run, char why[256]) {
	copying c = { f, run, why, false };
	const quern_naming naming = { copy_input, &c };
	char *resolved = quern_scene_resolved(run->scene, &naming);
	char *text = quern_format(
		"%s%016llx\n%s", heading, (unsigned long long)quern_hash(resolved, strlen(resolved)), resolved);
	char *path = in_folder(f, "scene.yaml");
	/* one that somebody has changed is his */
	const bool replaced = access(path, F_OK) || is_own_scene(path);
	const bool good = !c.failed && (!replaced || quern_save_bytes(path, text, strlen(text), why));
	free(path);
	free(text);
	free(resolved);
	return good;
}

bool quern_run_folder_begin(const quern_run_folder *f, const quern_run *run, char why[256]) {
	const quern_scene *s = run->scene;
	inputs in = inputs_of(s);
	char *frames = in_folder(f, "frames"), *scene = in_folder(f, "scene.yaml"),
		 *input = in_folder(f, "input.yaml");
	bool good = !mkdir(frames, 0777) || errno == EEXIST;
	if (!good) snprintf(why, 256, "the folder %.180s cannot be made: %s", frames, strerror(errno));
	/* when it goes on from its own scene, a run still has the text that somebody wrote */
	const bool again = is_input(&in, scene) || is_input(&in, input);
	good = good && save_resolved(f, run, why);
	if (good && !again) good = quern_save_bytes(input, s->tree->source, s->tree->length, why);
	free(frames);
	free(scene);
	free(input);
	free(in.at);
	return good;
}
