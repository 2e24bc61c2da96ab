/* SPDX-License-Identifier: MIT */
#include "checkpoint.h"
#include "config.h"
#include "state.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ENTRIES = 1 << 30, MOST_TEXT = 1 << 26 };
static const char format[] = "quern-checkpoint 3";
static const int64_t most_count = (int64_t)1
								  << 53; /* beyond, whole numbers are no longer exact in a step's time */

#define COUNTER(member)                                                                                      \
	{ #member, offsetof(quern_clock, member) }
static const struct {
	const char *name;
	size_t offset;
} counters[] = { COUNTER(step), COUNTER(substep), COUNTER(settle_step), COUNTER(frame), COUNTER(at),
	COUNTER(steps_in), COUNTER(settled) };
enum { N_COUNTERS = sizeof counters / sizeof *counters };

#define NUMBER(name_, member)                                                                                \
	{ name_, offsetof(quern_run, member) }
static const struct {
	const char *name;
	size_t offset;
} numbers[] = { NUMBER("dt", clock.dt), NUMBER("settle_dt", clock.settle_dt), NUMBER("begin", clock.begin),
	NUMBER("end", clock.end), NUMBER("wall", wall_before), NUMBER("settle_wall", settle_wall),
	NUMBER("mass_initial", mass_initial), NUMBER("processor", processor),
	NUMBER("settle_processor", settle_processor) };
/* files of before the processor's time was counted have the first ones alone */
enum { N_NUMBERS = sizeof numbers / sizeof *numbers, N_ALWAYS = N_NUMBERS - 2 };

static int64_t *counter(quern_run *run, size_t i) {
	return (int64_t *)(void *)((char *)&run->clock + counters[i].offset);
}
static double *number(quern_run *run, size_t i) {
	return (double *)(void *)((char *)run + numbers[i].offset);
}

static bool kept(const quern_field *field) { return field->kept; }

/* ---- writing ---- */

static void write_text(quern_h5 *h, const char *name, const char *text) {
	quern_h5_put(h, h->file, name, H5T_NATIVE_UINT8, strlen(text), 1, text);
}

static void write_plugins(quern_h5 *h, const quern_run *run) {
	const hid_t all = quern_h5_group(h, h->file, "plugins");
	for (size_t i = 0; i < quern_loader_count(run->scene->loader); i++) {
		const quern_plugin_file *f = quern_loader_at(run->scene->loader, i);
		const hid_t one = quern_h5_group(h, all, f->plugin.id);
		quern_h5_text(h, one, "version", f->library->version);
		quern_h5_integer(h, one, "revision", f->plugin.revision);
		quern_h5_integer(h, one, "hash", (int64_t)quern_run_plugin(run, i));
		if (one >= 0) H5Gclose(one);
	}
	if (all >= 0) H5Gclose(all);
}

static void write_run(quern_h5 *h, quern_run *run, int64_t rows) {
	quern_h5_text(h, h->file, "format", format);
	quern_h5_text(h, h->file, "program", "quern " QUERN_VERSION);
	quern_h5_integer(h, h->file, "rows", rows);
	for (size_t i = 0; i < N_COUNTERS; i++) quern_h5_integer(h, h->file, counters[i].name, *counter(run, i));
	for (size_t i = 0; i < N_NUMBERS; i++) quern_h5_number(h, h->file, numbers[i].name, *number(run, i));
	write_text(h, "scene", quern_run_identity(run));
	write_text(h, "replaced", run->replaced ? run->replaced : "");
	write_text(h, "limited_by", run->limit_reason);
	write_plugins(h, run);
	const hid_t stepped = quern_h5_group(h, h->file, "stepped");
	for (size_t s = 0; s < run->plan->store.n_sets; s++) {
		const quern_set_store *set = &run->plan->store.sets[s];
		if (quern_set_is_counted(set)) quern_h5_integer(h, stepped, set->name, set->stepped);
	}
	if (stepped >= 0) H5Gclose(stepped);
	if (!run->has_grid) return;
	const uint32_t n = run->grid.view.n_blocks;
	quern_h5_put(h, h->file, "blocks", H5T_NATIVE_INT32, n, 3, run->grid.at);
	quern_h5_put(h, h->file, "asked", H5T_NATIVE_UINT8, n, 1, run->grid.asked);
}

quern_status quern_checkpoint_write(quern_run *run, int64_t rows) {
	quern_h5 h;
	char why[256] = "out of memory";
	const double wall = quern_wall(), used = quern_processor();
	if (!run->folder) return QUERN_OK;
	for (size_t k = 0; k < run->plan->store.n_fields; k++) {
		const char *fault = quern_state_fault(run, &run->plan->store.fields[k]);
		if (fault)
			return quern_run_stop(run, QUERN_E_NUMERIC, "%s holds %s at t = %.6g s (step %lld)",
				run->plan->store.fields[k].name, fault, quern_run_time(run), (long long)run->clock.step);
	}
	quern_text wrong = { 0 };
	const bool accepted = quern_run_accept(run, &wrong);
	if (!accepted)
		quern_run_stop(run, QUERN_E_NUMERIC, "%s, at t = %.6g s (step %lld)", quern_text_string(&wrong),
			quern_run_time(run), (long long)run->clock.step);
	quern_text_finish(&wrong);
	if (!accepted) return QUERN_E_NUMERIC;
	char *path = quern_format("%s/checkpoint.h5", run->folder);
	quern_run_rest(run);
	bool good = quern_h5_create(&h, run->scene->general.compress, 512);
	if (good) {
		for (int s = 0; s < (int)run->plan->store.n_sets; s++) quern_state_write(&h, run, s, kept);
		/* what that has cost is a part of the run to whoever goes on from here; this process books it later */
		const double wall_before = run->wall_before, processor = run->processor;
		run->wall_before += quern_wall() - wall;
		run->processor += quern_processor() - used;
		write_run(&h, run, rows);
		run->wall_before = wall_before;
		run->processor = processor;
		good = quern_h5_save(&h, path, why);
	}
	free(path);
	return good ? QUERN_OK : quern_run_stop(run, QUERN_E_IO, "%s", why);
}

/* ---- reading ---- */

static bool fault(quern_text *why, const char *what, const char *name) {
	quern_text_add(why, "it does not fit this scene: %s of %s", what, name);
	return false;
}

/* Rows are scratch, unless somebody looks at them between steps. */
static bool is_in_file(const quern_store *store, int set) {
	bool any = !store->sets[set].rows;
	for (size_t k = 0; k < store->n_fields && !any; k++)
		any = store->fields[k].set == set && store->fields[k].kept;
	return any;
}

static bool give_room(quern_run *run, quern_h5 *h, int s, bool *had, quern_text *why) {
	quern_set_store *set = &run->plan->store.sets[s];
	quern_state_group g;
	if (set->rows || !is_in_file(&run->plan->store, s)) return true;
	if (!quern_state_find(run, h->file, s, kept, &g, why)) return false;
	quern_state_leave(&g);
	if (set->n == g.n) return true;
	*had = false;
	return quern_store_fill(&run->plan->store, s, g.n) == QUERN_OK || fault(why, "the memory", set->name);
}

/* What points into a set goes when that is made anew, so that a solver's sets may have to be made in another order than
 * it names them: as often as there are sets. */
static bool make_room(quern_run *run, quern_h5 *h, quern_text *why) {
	const int n = (int)run->plan->store.n_sets;
	bool had = false;
	for (int pass = 0; pass <= n && !had; pass++) {
		had = true;
		for (int s = 0; s < n; s++)
			if (!give_room(run, h, s, &had, why)) return false;
	}
	return had || fault(why, "the size", "sets that point into each other");
}

static bool read_set(quern_run *run, quern_h5 *h, int s, quern_text *why) {
	quern_state_group g;
	if (!is_in_file(&run->plan->store, s)) return true;
	if (!quern_state_find(run, h->file, s, kept, &g, why)) return false;
	const bool good = quern_state_read(run, &g, s, kept, why);
	quern_state_leave(&g);
	return good;
}

static bool read_grid(quern_run *run, quern_h5 *h, quern_text *why) {
	size_t rows = 0, columns = 0;
	if (!run->has_grid) return true;
	if (!quern_h5_read_size(h->file, "blocks", &rows, &columns) || rows > MOST_ENTRIES / 64)
		return fault(why, "blocks", "the grid");
	int32_t(*at)[3] = quern_take(rows, sizeof *at);
	uint8_t *asked = quern_take(rows, 1);
	bool good = quern_h5_read(h->file, "blocks", H5T_NATIVE_INT32, rows, 3, at) &&
				quern_h5_read(h->file, "asked", H5T_NATIVE_UINT8, rows, 1, asked);
	for (size_t b = 0; good && b < rows; b++)
		for (int k = 0; k < 3; k++) good = good && at[b][k] >= 0 && at[b][k] < run->grid.blocks[k];
	good = good && quern_grid_restore(&run->grid, (uint32_t)rows, (const int32_t(*)[3])at, asked) == QUERN_OK;
	free(at);
	free(asked);
	if (!good) return fault(why, "blocks", "the grid");
	for (size_t s = 0; s < run->plan->store.n_sets; s++)
		if (run->plan->store.sets[s].rows &&
			(quern_store_rows(&run->plan->store, (int)s, (uint32_t)rows * 64) != QUERN_OK ||
				quern_grid_cut(&run->grid, &run->plan->store, (int)s) != QUERN_OK))
			return fault(why, "memory", run->plan->store.sets[s].name);
	return true;
}

/* Counters fit each other: a run that is not settled has no frame, an interval is as long as its steps. */
static bool clock_holds(const quern_run *run, int64_t rows) {
	const quern_clock *c = &run->clock;
	const double length = c->end - c->begin, steps = (double)c->steps_in * c->dt;
	for (size_t i = 0; i < N_COUNTERS; i++) {
		const int64_t value = *(const int64_t *)(const void *)((const char *)c + counters[i].offset);
		if (value < -(counters[i].offset == offsetof(quern_clock, frame)) || value > most_count) return false;
	}
	for (size_t i = 0; i < N_NUMBERS; i++) {
		const double value = *(const double *)(const void *)((const char *)run + numbers[i].offset);
		if (!isfinite(value) || value < 0) return false;
	}
	if (c->settled > 1 || rows != c->frame + 1 || c->end < c->begin) return false;
	if (!c->settled && c->frame >= 0) return false;
	if (c->frame < 0 && (c->step || c->steps_in || c->end > 0)) return false;
	if (!c->steps_in) return !c->at && c->end == c->begin;
	return c->at < c->steps_in && c->at <= c->step && fabs(steps - length) <= 1e-9 * length;
}

static bool read_clock(quern_run *run, quern_h5 *h, int64_t *rows, quern_text *why) {
	bool good = quern_h5_read_integer(h->file, "rows", rows);
	for (size_t i = 0; i < N_COUNTERS; i++)
		good = good && quern_h5_read_integer(h->file, counters[i].name, counter(run, i));
	for (size_t i = 0; i < N_NUMBERS; i++)
		good = good && (quern_h5_read_number(h->file, numbers[i].name, number(run, i)) || i >= N_ALWAYS);
	const hid_t stepped = quern_h5_find(h->file, "stepped");
	for (size_t s = 0; s < run->plan->store.n_sets; s++) {
		quern_set_store *set = &run->plan->store.sets[s];
		if (quern_set_is_counted(set))
			good = good && stepped >= 0 && quern_h5_read_integer(stepped, set->name, &set->stepped) &&
				   set->stepped >= 0 && set->stepped <= most_count;
	}
	if (stepped >= 0) H5Gclose(stepped);
	return (good && clock_holds(run, *rows)) || fault(why, "the counters", "the run");
}

/* malloc'ed; NULL if it is not there. */
static char *read_text(quern_h5 *h, const char *name) {
	size_t n = 0, columns = 0;
	if (!quern_h5_read_size(h->file, name, &n, &columns) || n > MOST_TEXT) return NULL;
	char *text = quern_take(n + 1, 1);
	if (quern_h5_read(h->file, name, H5T_NATIVE_UINT8, n, 1, text)) return text;
	free(text);
	return NULL;
}

static void read_reason(quern_run *run, quern_h5 *h) {
	char *reason = read_text(h, "limited_by");
	snprintf(run->limit_reason, sizeof run->limit_reason, "%s", reason ? reason : "");
	free(reason);
}

/* ---- whether it is this run's ---- */

static bool read_scene(quern_run *run, quern_h5 *h, quern_text *said, quern_text *why) {
	quern_general *g = &run->scene->general;
	quern_text refused = { 0 };
	char *was = read_text(h, "scene");
	if (was && !g->every_given) { /* where the scene leaves it open, it stays what it was */
		const double every = quern_identity_every(was);
		if (every > 0) g->every = every;
	}
	if (!was || !quern_identity_compare(was, quern_run_identity(run), said, &refused))
		quern_text_add(why, "it does not hold its scene");
	else if (refused.length)
		quern_text_add(why,
			"it belongs to another scene: %s; only name, time.end, output.every, output.compress, "
			"checkpoint.every and run may change",
			refused.data);
	quern_text_finish(&refused);
	free(was);
	return !why->length;
}

/* "PLUGIN was 0.1.0, revision 1, and is 0.2.0, revision 2": nothing if it is the one that wrote the file. */
static void compare_plugin(hid_t group, const quern_plugin_file *f, uint64_t is, quern_text *out) {
	char version[64] = "not there";
	int64_t revision = 0, was = 0;
	const bool there = group >= 0 && quern_h5_read_text(group, "version", version, sizeof version) &&
					   quern_h5_read_integer(group, "revision", &revision) &&
					   quern_h5_read_integer(group, "hash", &was);
	if (there && (uint64_t)was == is) return;
	quern_text_add(out, "%s%s was %s", out->length ? "; " : "", f->plugin.id, version);
	if (there) quern_text_add(out, ", revision %lld (%016llx)", (long long)revision, (unsigned long long)was);
	quern_text_add(out, " and is %s, revision %u (%016llx)", f->library->version, f->plugin.revision,
		(unsigned long long)is);
}

static bool read_plugins(quern_run *run, quern_h5 *h, bool force, quern_text *said, quern_text *why) {
	quern_text others = { 0 };
	const hid_t all = quern_h5_find(h->file, "plugins");
	for (size_t i = 0; i < quern_loader_count(run->scene->loader); i++) {
		const quern_plugin_file *f = quern_loader_at(run->scene->loader, i);
		const hid_t one = all < 0 ? -1 : quern_h5_find(all, f->plugin.id);
		compare_plugin(one, f, quern_run_plugin(run, i), &others);
		if (one >= 0) H5Gclose(one);
	}
	if (all >= 0) H5Gclose(all);
	run->replaced = read_text(h, "replaced");
	if (others.length && !force)
		quern_text_add(why, "other plugins wrote it: %s; to go on with these, add --force", others.data);
	else if (others.length) {
		char *before = run->replaced;
		run->replaced = quern_format(
			"%sfrom step %lld on: %s\n", before ? before : "", (long long)run->clock.step, others.data);
		quern_text_add(said, "%s\n", others.data);
		free(before);
	}
	quern_text_finish(&others);
	return !why->length;
}

static bool is_checkpoint(quern_h5 *h, quern_text *why) {
	char is[32];
	if (quern_h5_read_text(h->file, "format", is, sizeof is) && !strcmp(is, format)) return true;
	quern_text_add(why, "it is no checkpoint of this program");
	return false;
}

static bool rejoin(quern_run *run, quern_text *why) {
	if (quern_run_rejoin(run)) return true;
	quern_text_add(why, "time.end is %.9g s, and the run has come to %.9g s already", run->scene->general.end,
		quern_run_time(run));
	return false;
}

static bool read_all(
	quern_run *run, quern_h5 *h, bool force, int64_t *rows, quern_text *said, quern_text *why) {
	quern_store *store = &run->plan->store;
	if (!is_checkpoint(h, why) || !read_scene(run, h, said, why) || !read_clock(run, h, rows, why) ||
		!read_plugins(run, h, force, said, why) || !read_grid(run, h, why) || !make_room(run, h, why))
		return false;
	for (int s = 0; s < (int)store->n_sets; s++)
		if (!read_set(run, h, s, why)) return false;
	for (size_t k = 0; k < store->n_fields; k++) {
		const char *wrong = quern_state_fault(run, &store->fields[k]);
		if (wrong) return fault(why, wrong, store->fields[k].name);
	}
	read_reason(run, h);
	return rejoin(run, why);
}

/* What is carried, owed and has left is what the run began with and what was poured, but for round-off. */
static bool mass_holds(quern_run *run, quern_text *why) {
	const quern_account a = quern_run_account(run);
	return fabs(quern_run_mass_defect(run, &a)) <= 1e-6 || fault(why, "the masses", "the run");
}

quern_status quern_checkpoint_read(
	quern_run *run, const char *path, bool force, int64_t *rows, quern_text *said, quern_text *why) {
	quern_h5 h;
	char unreadable[256];
	if (!quern_h5_open(&h, path, unreadable)) return quern_text_add(why, "%s", unreadable), QUERN_E_IO;
	const bool good = read_all(run, &h, force, rows, said, why);
	quern_h5_close(&h);
	if (!good) return QUERN_E_IO;
	quern_text wrong = { 0 };
	const bool accepted = quern_run_accept(run, &wrong);
	if (!accepted) quern_text_add(why, "it does not fit this scene: %s", quern_text_string(&wrong));
	quern_text_finish(&wrong);
	if (!accepted) return QUERN_E_IO;
	return mass_holds(run, why) ? QUERN_OK : QUERN_E_IO;
}
