/* SPDX-License-Identifier: MIT */
/* quern_check_scene - a solver at work: the first steps of a scene, and the same bits with other threads, other
 * batches, and from checkpoints on the way
 *
 * The first run, on one thread, notes its state at the end and leaves checkpoints. Each comparison is made in a
 * process of its own, so that what a plugin keeps outside of its fields is not there. */
#include "check.h"
#include "checkpoint.h"
#include "log.h"
#include "run.h"
#include "text.h"
#include "watch.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* In the task's folder: halfway through settling, and through the steps. */
static const char *const checkpoints[] = { "settling.h5", "steps.h5" };

/* ---- whose call it is ---- */

/* Every call of a plugin is named, and must leave the environment as it was. */
static void see(void *arg, const char *plugin, const char *function) {
	const check *c = arg;
	if (!plugin) quern_check_environment(c);
	else if (strchr(function, '.')) /* a stage has its solver's name */
		snprintf(c->shared->place, sizeof c->shared->place, "%s", function);
	else
		snprintf(c->shared->place, sizeof c->shared->place, "%s.%s",
			quern_id_name(plugin) ? quern_id_name(plugin) : plugin, function);
}

/* ---- one run ---- */

typedef struct {
	const check *c;
	quern_run *run;
	bool saves;                             /* leaves checkpoints */
	quern_check_tally *steps, *sums, *mass; /* NULL: of a run that is only compared */
} short_run;

/* That very object: the folder comes first if nobody looks there, and the instruction set is its own. */
static quern_scene *read_scene(const check *c, const char *more) {
	const check_task *task = c->task;
	size_t n = 0;
	while (task->sets && task->sets[n]) n++;
	const char **sets = quern_take(n + 3, sizeof *sets);
	char *folder = quern_copy(task->path), *level = quern_format("run.instructions=v%d", c->file->level);
	char *slash = strrchr(folder, '/');
	if (slash) *slash = 0;
	for (size_t i = 0; i < n; i++) sets[i] = task->sets[i];
	sets[n++] = level;
	sets[n] = more;
	quern_loader *loader = quern_loader_create();
	if (!quern_loader_searches(loader, folder)) {
		const char *path = getenv("QUERN_PLUGIN_PATH");
		char *longer = quern_format("%s:%s", folder, path ? path : "");
		setenv("QUERN_PLUGIN_PATH", longer, 1);
		free(longer);
	}
	quern_loader_destroy(loader);
	quern_scene *scene = quern_scene_read(task->scene, sets, &quern_host_table);
	free(level);
	free(folder);
	free(sets);
	return scene;
}

static bool has_solver(const check *c, const quern_scene *scene) {
	for (size_t i = 0; i < scene->n_sections; i++) {
		const quern_plugin_file *f = scene->sections[i].solver->file;
		if (!strcmp(f->plugin.id, c->file->plugin.id) && f->hash == c->file->hash) return true;
	}
	return false;
}

/* Of the scene as it is given, but for what the options say; NULL after a sentence in `why`. */
static quern_run *create_run(const check *c, uint32_t threads, const char *more, quern_text *why) {
	quern_scene *scene = read_scene(c, more);
	if (!quern_report_errors(scene->report) && !has_solver(c, scene)) {
		quern_text_add(why, "%s does not run %s, or takes it from elsewhere", c->task->scene, c->task->path);
		quern_scene_destroy(scene);
		return NULL;
	}
	quern_run *run = quern_report_errors(scene->report) ? NULL : quern_run_create(scene, threads);
	if (run && !quern_report_errors(scene->report)) {
		run->folder = quern_copy(c->task->folder);
		run->log = quern_log_create(true);
		return run;
	}
	const size_t faults = quern_report_print(scene->report, stderr);
	quern_text_add(why, "%s cannot be used: %zu fault%s", c->task->scene, faults, faults == 1 ? "" : "s");
	if (run) quern_run_destroy(run);
	else quern_scene_destroy(scene);
	return NULL;
}

static const char *why_of(const quern_run *run) { return run->message ? run->message : "it failed"; }

/* What is carried is finite, and none of the mass is lost, at any time. */
static void look_at_sums(const short_run *s) {
	if (!s->sums) return;
	const quern_account a = quern_run_account(s->run);
	const double begun = s->run->mass_initial, time = quern_run_time(s->run);
	const double now = quern_account_of(&a, "mass") + quern_account_of(&a, "owed");
	const double passed = quern_account_of(&a, "left") - quern_account_of(&a, "poured");
	for (size_t k = 0; k < a.n; k++)
		quern_check_expect(s->sums, isfinite(a.sum[k].value), "the sum %s is %g at t = %.6g s", a.sum[k].name,
			a.sum[k].value, time);
	if (begun > 0)
		quern_check_measure(s->mass, fabs(quern_run_mass_defect(s->run, &a)), 1e-9,
			"mass and what is owed are %.12g kg at t = %.6g s, %.12g kg have left beyond what was poured, "
			"and it was %.12g kg after the set-up",
			now, time, passed, begun);
}

static void save(const short_run *s, const char *name) {
	if (!s->saves || quern_checkpoint_write(s->run, s->run->clock.frame + 1) != QUERN_OK) return;
	char *from = quern_format("%s/checkpoint.h5", s->run->folder),
		 *to = quern_format("%s/%s", s->run->folder, name);
	if (rename(from, to)) quern_run_stop(s->run, QUERN_E_IO, "%s cannot be written", to);
	free(from);
	free(to);
}

/* Settling that takes longer is broken off: its state is as good as any to go on from. */
static void settle(const short_run *s) {
	quern_clock *c = &s->run->clock;
	const int64_t most = s->c->task->steps;
	while (!c->settled && s->run->status == QUERN_OK) {
		if (c->settle_step == most / 2) save(s, checkpoints[0]);
		if (c->settle_step >= most) c->settled = 1;
		else if (quern_run_next(s->run) == QUERN_SETTLING) look_at_sums(s);
	}
}

static void step_on(const short_run *s) {
	quern_run *run = s->run;
	const int64_t most = s->c->task->steps;
	bool saved = run->clock.step >= most / 2;
	while (run->status == QUERN_OK) {
		const bool frame = quern_run_awaits_frame(run);
		if (!saved && !frame && run->clock.step >= most / 2) save(s, checkpoints[1]), saved = true;
		if (!frame && run->clock.step >= most) return;
		const quern_event event = quern_run_next(run);
		if (event == QUERN_OVER || event == QUERN_STOPPED) return;
		if (event == QUERN_FRAME_IS_DUE) quern_run_frame(run), quern_run_look(run);
		look_at_sums(s);
	}
}

static void go(const short_run *s) {
	settle(s);
	step_on(s);
	if (s->steps) quern_check_expect(s->steps, s->run->status == QUERN_OK, "%s", why_of(s->run));
}

/* ---- states ---- */

__attribute__((format(printf, 3, 4))) static void add_part(
	check_state *state, uint64_t hash, const char *fmt, ...) {
	va_list list;
	if (state->n == sizeof state->part / sizeof *state->part) return;
	va_start(list, fmt);
	vsnprintf(state->part[state->n].name, sizeof state->part->name, fmt, list);
	va_end(list);
	state->part[state->n++].hash = hash;
}

static void add_set(check_state *state, const quern_set_store *set) {
	const uint64_t sizes[] = { set->n, (uint64_t)set->next_id, set->n_blocks };
	const uint64_t hash = quern_hash(sizes, sizeof sizes);
	const size_t blocks = set->n_blocks ? (set->n_blocks + 1u) * sizeof *set->block : 0;
	add_part(state, blocks ? quern_hash_more(hash, set->block, blocks) : hash, "the set %s", set->name);
}

/* Fields of a set in rows are one part. */
static void add_field(check_state *state, const quern_store *store, const quern_field *field) {
	const quern_set_store *set = &store->sets[field->set];
	uint64_t hash = quern_hash("", 0);
	if (set->rows) hash = quern_hash_more(hash, set->row, (size_t)set->n * 8 * sizeof *set->row);
	else
		for (uint8_t c = 0; c < field->n_components && set->n; c++)
			hash = quern_hash_more(hash, field->data[field->now][c], set->n * quern_field_bytes(field));
	add_part(state, hash, "%s", field->name);
}

/* All that a run goes on from, and what is looked at between steps. */
static void note_state(quern_run *run, check_state *state) {
	const quern_store *store = &run->plan->store;
	const quern_account a = quern_run_account(run);
	state->n = 0;
	add_part(state, quern_hash(&run->clock, sizeof run->clock), "the clock");
	if (run->has_grid)
		add_part(state, quern_hash(run->grid.at, run->grid.view.n_blocks * sizeof *run->grid.at), "the grid");
	for (size_t s = 0; s < store->n_sets; s++) add_set(state, &store->sets[s]);
	for (size_t k = 0; k < store->n_fields; k++)
		if (store->fields[k].kept) add_field(state, store, &store->fields[k]);
	for (size_t k = 0; k < a.n; k++)
		add_part(state, quern_hash(&a.sum[k].value, sizeof(double)), "the sum %s", a.sum[k].name);
}

/* The first part that is not the same, or NULL. */
static const char *differs(const check_state *a, const check_state *b) {
	for (uint32_t i = 0; i < a->n && i < b->n; i++)
		if (strcmp(a->part[i].name, b->part[i].name) != 0 || a->part[i].hash != b->part[i].hash)
			return a->part[i].name;
	return a->n == b->n ? NULL : "the number of fields";
}

/* ---- comparisons ---- */

/* The first run's end is what this one's must be. `from`: a checkpoint to go on from; NULL: the beginning. */
static void compare(const check *c, uint32_t threads, const char *more, const char *from, const char *what,
	quern_check_tally *t) {
	quern_text why = { 0 }, said = { 0 };
	int64_t rows;
	quern_run *run = create_run(c, threads, more, &why);
	check_state *state = quern_take(1, sizeof *state);
	if (run && from) quern_checkpoint_read(run, from, false, &rows, &said, &why);
	else if (run) quern_run_setup(run);
	if (run && !why.length) go(&(short_run) { .c = c, .run = run });
	if (run && !why.length && run->status == QUERN_OK) note_state(run, state);
	const char *other = state->n ? differs(&c->shared->state, state) : NULL;
	quern_check_expect(t, state->n && !other, "%s%s%s", what, other ? " gives other bits of " : ": ",
		other        ? other
		: why.length ? quern_text_string(&why)
		: run        ? why_of(run)
					 : "it failed");
	quern_run_destroy(run);
	quern_text_finish(&why);
	quern_text_finish(&said);
	free(state);
}

void quern_check_scene(const check *c) {
	quern_check_tally setup = { .name = "set-up" }, steps = { .name = "steps" }, sums = { .name = "sums" },
					  mass = { .name = "mass" };
	quern_text why = { 0 };
	quern_watch_follow(see, (void *)(uintptr_t)c);
	quern_run *run = create_run(c, 1, NULL, &why);
	const bool good = run && quern_run_setup(run) == QUERN_OK;
	quern_check_expect(&setup, good, "%s", run ? why_of(run) : quern_text_string(&why));
	const short_run s = { c, run, true, &steps, &sums, &mass };
	if (good) look_at_sums(&s), go(&s);
	if (good && run->status == QUERN_OK) note_state(run, &c->shared->state);
	quern_check_tell(&c->open, &setup, "%s", c->task->scene);
	if (good) {
		quern_check_tell(&c->open, &steps, "%lld, after %lld of settling", (long long)run->clock.step,
			(long long)run->clock.settle_step);
		quern_check_tell(&c->open, &sums, NULL);
		if (mass.tried) quern_check_tell(&c->open, &mass, NULL);
	}
	quern_run_destroy(run);
	quern_text_finish(&why);
}

void quern_check_scene_threads(const check *c) {
	quern_check_tally t = { .name = "threads" };
	quern_watch_follow(see, (void *)(uintptr_t)c);
	for (int turn = 0; turn < 2; turn++) compare(c, 4, NULL, NULL, "a run on 4 threads", &t);
	quern_check_tell(&c->open, &t, "1 and 4 give the same bits");
}

void quern_check_scene_batches(const check *c) {
	quern_check_tally t = { .name = "batches" };
	quern_watch_follow(see, (void *)(uintptr_t)c);
	compare(c, 1, "run.batch=8", NULL, "a run with batches of 8", &t);
	compare(c, 1, "run.batch=256", NULL, "a run with batches of 256", &t);
	quern_check_tell(&c->open, &t, "8 and 256 entities in one give the same bits");
}

void quern_check_scene_resume(const check *c) {
	quern_check_tally t = { .name = "resume" };
	quern_watch_follow(see, (void *)(uintptr_t)c);
	for (size_t i = 0; i < sizeof checkpoints / sizeof *checkpoints; i++) {
		char *path = quern_format("%s/%s", c->task->folder, checkpoints[i]);
		FILE *there = fopen(path, "rb");
		if (there) {
			fclose(there);
			compare(c, 1, NULL, path,
				i ? "going on from a checkpoint between two steps"
				  : "going on from a checkpoint while settling",
				&t);
		}
		free(path);
	}
	if (!t.tried) quern_check_note("resume was not tried: the run is over before half of --steps");
	else quern_check_tell(&c->open, &t, "going on from a checkpoint gives the same bits");
}
