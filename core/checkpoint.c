#include "checkpoint.h"
#include "config.h"
#include "h5.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ENTRIES = 1 << 30, MOST_TEXT = 1 << 26 };
static const char format[] = "quern-checkpoint 2";

#define COUNTER(member)                                                                                      \
	{ #member, offsetof(quern_clock, member) }
static const struct {
	const char *name;
	size_t offset;
} counters[] = { COUNTER(step), COUNTER(substep), COUNTER(settle_step), COUNTER(frame), COUNTER(at),
	COUNTER(steps_in), COUNTER(settled), COUNTER(grain_steps), COUNTER(point_steps) };
enum { N_COUNTERS = sizeof counters / sizeof *counters };

#define NUMBER(name_, member)                                                                                \
	{ name_, offsetof(quern_run, member) }
static const struct {
	const char *name;
	size_t offset;
} numbers[] = { NUMBER("dt", clock.dt), NUMBER("settle_dt", clock.settle_dt), NUMBER("begin", clock.begin),
	NUMBER("end", clock.end), NUMBER("wall", wall_before), NUMBER("settle_wall", settle_wall),
	NUMBER("mass_initial", mass_initial) };
enum { N_NUMBERS = sizeof numbers / sizeof *numbers };

static int64_t *counter(quern_run *run, size_t i) {
	return (int64_t *)(void *)((char *)&run->clock + counters[i].offset);
}
static double *number(quern_run *run, size_t i) {
	return (double *)(void *)((char *)run + numbers[i].offset);
}

static hid_t type_of(const quern_field *field) {
	return field->shape == QUERN_INDEX ? H5T_NATIVE_INT32
		   : field->shape == QUERN_ID  ? H5T_NATIVE_INT64
									   : H5T_NATIVE_DOUBLE;
}

static bool is_column(const quern_store *store, const quern_field *field, int set) {
	return field->set == set && field->kept && !store->sets[set].rows;
}

/* Rows are scratch of a step, unless somebody looks at them between two. */
static bool keeps_rows(const quern_store *store, int set) {
	for (size_t k = 0; k < store->n_fields && store->sets[set].rows; k++)
		if (store->fields[k].set == set && store->fields[k].kept) return true;
	return false;
}

static void component_name(const quern_field *field, int component, char out[64]) {
	snprintf(out, 64, "%s.%d", strchr(field->name, '.') + 1, component);
}

static void close_set(hid_t set) {
	if (set >= 0) H5Dclose(set);
}

/* ---- what state may hold ---- */

/* Numbers are finite, but where a new entry's is not: then that value stands for "not yet". */
static bool numbers_hold(const quern_store *store, const quern_field *field) {
	const uint32_t n = store->sets[field->set].n;
	for (uint8_t c = 0; c < field->n_components; c++) {
		const quern_real *value = field->data[field->now][c], initial = field->initial;
		for (uint32_t i = 0; i < n; i++)
			if (!isfinite(value[i]) && !(isnan(value[i]) ? isnan(initial) : value[i] == initial))
				return false;
	}
	return true;
}

/* Positions become numbers of cells. A fixed grain may lie outside of the domain by as much as that is wide. */
static bool positions_hold(const quern_run *run, const quern_field *field) {
	const quern_general *g = &run->scene->general;
	const uint32_t n = run->plan->store.sets[field->set].n;
	if (field->shape != QUERN_VECTOR || strcmp(strchr(field->name, '.'), ".position") != 0) return true;
	for (uint8_t k = 0; k < field->n_components; k++) {
		const double width = g->upper[k] - g->lower[k];
		const quern_real *x = field->data[field->now][k];
		for (uint32_t i = 0; i < n; i++)
			if (!(x[i] >= g->lower[k] - 1.5 * width && x[i] <= g->upper[k] + 1.5 * width)) return false;
	}
	return true;
}

/* Indices are followed blindly later on, so they are looked at now. */
static bool indices_hold(const quern_store *store, const quern_field *field) {
	const int32_t *index = field->data[field->now][0];
	const uint32_t n = store->sets[field->set].n, most = store->sets[field->target].n;
	for (uint32_t i = 0; i < n; i++)
		if ((index[i] < 0 || (uint32_t)index[i] >= most) &&
			!(index[i] == QUERN_NO_TARGET && field->initial == QUERN_NO_TARGET))
			return false;
	return true;
}

/* A number is given once, in the order of counting. */
static bool ids_hold(const quern_set_store *set, const quern_field *field) {
	const int64_t *id = field->data[field->now][0];
	for (uint32_t i = 0; i < set->n; i++)
		if (id[i] < 0 || id[i] >= set->next_id) return false;
	return true;
}

/* NULL, or what is wrong with a field. What is only looked at may hold anything: no step goes on from it. */
static const char *fault_in(const quern_run *run, const quern_field *field) {
	const quern_store *store = &run->plan->store;
	if (!field->kept || store->sets[field->set].rows) return NULL;
	if (field->shape == QUERN_ID)
		return ids_hold(&store->sets[field->set], field) ? NULL : "a number that was never given";
	if (field->shape == QUERN_INDEX)
		return field->target < 0 || indices_hold(store, field) ? NULL : "an index out of its set";
	if (!field->state) return NULL;
	if (!numbers_hold(store, field)) return "a number that is not finite";
	return positions_hold(run, field) ? NULL : "a position far outside of the domain";
}

/* ---- writing ---- */

static void write_set(quern_h5 *h, const quern_run *run, int s) {
	const quern_store *store = &run->plan->store;
	const quern_set_store *set = &store->sets[s];
	char name[64];
	if (set->rows && !keeps_rows(store, s)) return;
	const hid_t group = quern_h5_group(h, h->file, set->name);
	quern_h5_integer(h, group, "n", set->n);
	quern_h5_integer(h, group, "next_id", set->next_id);
	quern_h5_integer(h, group, "n_blocks", set->n_blocks);
	if (set->rows) close_set(quern_h5_write(h, group, "row", H5T_NATIVE_DOUBLE, set->n, 8, set->row));
	if (set->n_blocks)
		close_set(quern_h5_write(h, group, "block", H5T_NATIVE_UINT32, set->n_blocks + 1u, 1, set->block));
	for (size_t k = 0; k < store->n_fields; k++) {
		const quern_field *field = &store->fields[k];
		if (!is_column(store, field, s)) continue;
		for (int c = 0; c < field->n_components; c++) {
			component_name(field, c, name);
			close_set(quern_h5_write(h, group, name, type_of(field), set->n, 1, field->data[field->now][c]));
		}
	}
	if (group >= 0) H5Gclose(group);
}

static void write_text(quern_h5 *h, const char *name, const char *text) {
	close_set(quern_h5_write(h, h->file, name, H5T_NATIVE_UINT8, strlen(text), 1, text));
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
	write_plugins(h, run);
	if (!run->has_grid) return;
	const uint32_t n = run->grid.view.n_blocks;
	close_set(quern_h5_write(h, h->file, "blocks", H5T_NATIVE_INT32, n, 3, run->grid.at));
	close_set(quern_h5_write(h, h->file, "asked", H5T_NATIVE_UINT8, n, 1, run->grid.asked));
}

quern_status quern_checkpoint_write(quern_run *run, int64_t rows) {
	quern_h5 h;
	char why[256] = "out of memory";
	if (!run->folder) return QUERN_OK;
	for (size_t k = 0; k < run->plan->store.n_fields; k++) {
		const char *fault = fault_in(run, &run->plan->store.fields[k]);
		if (fault)
			return quern_run_stop(run, QUERN_E_NUMERIC, "%s holds %s at t = %.6g s (step %lld)",
				run->plan->store.fields[k].name, fault, quern_run_time(run), (long long)run->clock.step);
	}
	char *path = quern_format("%s/checkpoint.h5", run->folder);
	bool good = quern_h5_create(&h, run->scene->general.compress, 512);
	if (good) {
		write_run(&h, run, rows);
		for (int s = 0; s < (int)run->plan->store.n_sets; s++) write_set(&h, run, s);
		good = quern_h5_save(&h, path, why);
	}
	free(path);
	return good ? QUERN_OK : quern_run_stop(run, QUERN_E_IO, "%s", why);
}

/* ---- reading ---- */

static bool fault(quern_text *why, const char *what, const char *name) {
	quern_text_add(why, "the checkpoint does not fit this scene: %s of %s", what, name);
	return false;
}

static bool read_partition(quern_run *run, hid_t group, int s, uint32_t n, quern_text *why) {
	quern_store *store = &run->plan->store;
	const char *name = store->sets[s].name;
	int64_t n_blocks = -1;
	if (!quern_h5_read_integer(group, "n_blocks", &n_blocks) || n_blocks < 0 || n_blocks > MOST_ENTRIES)
		return fault(why, "n_blocks", name);
	if (!n_blocks) return true;
	uint32_t *block = malloc(((size_t)n_blocks + 1) * sizeof(uint32_t));
	bool good = block && quern_h5_read(group, "block", H5T_NATIVE_UINT32, (size_t)n_blocks + 1, 1, block);
	good = good && block[0] == 0 && block[n_blocks] == n;
	for (int64_t b = 0; good && b < n_blocks; b++) good = block[b] <= block[b + 1];
	good = good && quern_store_partition(store, s, (uint32_t)n_blocks, block) == QUERN_OK;
	free(block);
	return good || fault(why, "the partition", name);
}

static bool read_fields(quern_run *run, hid_t group, int s, quern_text *why) {
	quern_store *store = &run->plan->store;
	char name[64];
	for (size_t k = 0; k < store->n_fields; k++) {
		quern_field *field = &store->fields[k];
		if (!is_column(store, field, s)) continue;
		for (int c = 0; c < field->n_components; c++) {
			component_name(field, c, name);
			if (!quern_h5_read(group, name, type_of(field), store->sets[s].n, 1, field->data[field->now][c]))
				return fault(why, name, store->sets[s].name);
		}
	}
	return true;
}

/* Memory is taken only for what the file does hold. */
static bool sizes_hold(const quern_store *store, hid_t group, int s, int64_t n) {
	for (size_t k = 0; k < store->n_fields; k++) {
		const quern_field *field = &store->fields[k];
		char name[64];
		size_t rows = 0, columns = 0;
		if (!is_column(store, field, s)) continue;
		component_name(field, 0, name);
		if (!quern_h5_read_size(group, name, &rows, &columns) || rows != (size_t)n) return false;
	}
	return true;
}

static bool read_columns(quern_run *run, hid_t group, int s, int64_t n, quern_text *why) {
	quern_store *store = &run->plan->store;
	return quern_store_fill(store, s, (uint32_t)n) == QUERN_OK &&
		   read_partition(run, group, s, (uint32_t)n, why) && read_fields(run, group, s, why);
}

static bool read_set(quern_run *run, quern_h5 *h, int s, quern_text *why) {
	quern_store *store = &run->plan->store;
	quern_set_store *set = &store->sets[s];
	int64_t n = -1, next_id = -1;
	if (set->rows && !keeps_rows(store, s)) return true;
	const hid_t group = quern_h5_find(h->file, set->name);
	if (group < 0) return fault(why, "the set", set->name);
	bool good = quern_h5_read_integer(group, "n", &n) && quern_h5_read_integer(group, "next_id", &next_id) &&
				n >= 0 && n <= MOST_ENTRIES && next_id >= 0;
	if (good && set->grid) good = n == (int64_t)run->grid.view.n_blocks * 64 || n == 0;
	good = good && (set->rows ? set->n == n : sizes_hold(store, group, s, n));
	if (!good) fault(why, "the size", set->name);
	else if (!set->rows) good = read_columns(run, group, s, n, why);
	else if (n)
		good = quern_h5_read(group, "row", H5T_NATIVE_DOUBLE, set->n, 8, set->row) ||
			   fault(why, "rows", set->name);
	set->next_id = next_id;
	H5Gclose(group);
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
			quern_store_rows(&run->plan->store, (int)s, (uint32_t)rows * 64) != QUERN_OK)
			return fault(why, "memory", run->plan->store.sets[s].name);
	return true;
}

/* Counters fit each other: a run that is not settled has no frame, an interval is as long as its steps. */
static bool clock_holds(const quern_run *run, int64_t rows) {
	const quern_clock *c = &run->clock;
	const int64_t most = (int64_t)1 << 53; /* whole numbers beyond are no longer exact in a step's time */
	const double length = c->end - c->begin, steps = (double)c->steps_in * c->dt;
	for (size_t i = 0; i < N_COUNTERS; i++) {
		const int64_t value = *(const int64_t *)(const void *)((const char *)c + counters[i].offset);
		if (value < -(counters[i].offset == offsetof(quern_clock, frame)) || value > most) return false;
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
		good = good && quern_h5_read_number(h->file, numbers[i].name, number(run, i));
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

/* "contact.linear was 0.1.0, revision 1, and is 0.2.0, revision 2": nothing if it is the one that wrote the file. */
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
		!read_plugins(run, h, force, said, why) || !read_grid(run, h, why))
		return false;
	for (int s = 0; s < (int)store->n_sets; s++)
		if (!read_set(run, h, s, why)) return false;
	for (size_t k = 0; k < store->n_fields; k++) {
		const char *wrong = fault_in(run, &store->fields[k]);
		if (wrong) return fault(why, wrong, store->fields[k].name);
	}
	return rejoin(run, why);
}

quern_status quern_checkpoint_read(
	quern_run *run, const char *path, bool force, int64_t *rows, quern_text *said, quern_text *why) {
	quern_h5 h;
	char unreadable[256];
	if (!quern_h5_open(&h, path, unreadable)) return quern_text_add(why, "%s", unreadable), QUERN_E_IO;
	const bool good = read_all(run, &h, force, rows, said, why);
	quern_h5_close(&h);
	if (!good) return QUERN_E_IO;
	quern_plan_refresh(run->plan);
	return QUERN_OK;
}
