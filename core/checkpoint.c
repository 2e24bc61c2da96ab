#include "checkpoint.h"
#include "config.h"
#include "h5.h"
#include "text.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ENTRIES = 1 << 30 };

/* Title, output and end may change between two parts of a run; so may what results do not depend on. */
uint64_t quern_checkpoint_key(const quern_scene *scene) {
	quern_general *g = (quern_general *)(uintptr_t)&scene->general;
	const quern_general kept = *g;
	g->name = "";
	g->end = g->checkpoint = 0;
	g->batch = 0;
	g->instructions = 0;
	g->compress = false;
	char *text = quern_scene_resolved(scene, NULL);
	*g = kept;
	const uint64_t key = quern_hash(text, strlen(text));
	free(text);
	return key;
}

static const struct {
	const char *name;
	size_t offset;
} counters[] = { { "step", offsetof(quern_clock, step) }, { "substep", offsetof(quern_clock, substep) },
	{ "settle_step", offsetof(quern_clock, settle_step) }, { "frame", offsetof(quern_clock, frame) },
	{ "at", offsetof(quern_clock, at) }, { "steps_in", offsetof(quern_clock, steps_in) },
	{ "settled", offsetof(quern_clock, settled) }, { "grain_steps", offsetof(quern_clock, grain_steps) },
	{ "point_steps", offsetof(quern_clock, point_steps) } };
enum { N_COUNTERS = sizeof counters / sizeof *counters };

static hid_t type_of(const quern_field *field) {
	return field->shape == QUERN_INDEX ? H5T_NATIVE_INT32
		   : field->shape == QUERN_ID  ? H5T_NATIVE_INT64
									   : H5T_NATIVE_DOUBLE;
}

static bool is_kept(const quern_store *store, const quern_field *field) {
	return !store->sets[field->set].rows && !field->local && (field->state || field->shape == QUERN_ID);
}

static void close_set(hid_t set) {
	if (set >= 0) H5Dclose(set);
}

/* ---- writing ---- */

static void write_set(quern_h5 *h, const quern_run *run, int s) {
	const quern_store *store = &run->plan->store;
	const quern_set_store *set = &store->sets[s];
	if (set->rows) return;
	const hid_t group = quern_h5_group(h, h->file, set->name);
	quern_h5_integer(h, group, "n", set->n);
	quern_h5_integer(h, group, "next_id", set->next_id);
	quern_h5_integer(h, group, "n_blocks", set->n_blocks);
	if (set->n_blocks)
		close_set(quern_h5_write(h, group, "block", H5T_NATIVE_UINT32, set->n_blocks + 1u, 1, set->block));
	for (size_t k = 0; k < store->n_fields; k++) {
		const quern_field *field = &store->fields[k];
		if (field->set != s || !is_kept(store, field)) continue;
		for (int c = 0; c < field->n_components; c++) {
			char name[64];
			snprintf(name, sizeof name, "%s.%d", strchr(field->name, '.') + 1, c);
			close_set(quern_h5_write(h, group, name, type_of(field), set->n, 1, field->data[field->now][c]));
		}
	}
	if (group >= 0) H5Gclose(group);
}

quern_status quern_checkpoint_write(quern_run *run, int64_t rows) {
	quern_h5 h;
	char why[256] = "out of memory";
	if (!run->folder) return QUERN_OK;
	char *path = quern_format("%s/checkpoint.h5", run->folder);
	bool good = quern_h5_create(&h, run->scene->general.compress, 512);
	if (good) {
		quern_h5_text(&h, h.file, "format", "quern-checkpoint 1");
		quern_h5_text(&h, h.file, "program", "quern " QUERN_VERSION);
		quern_h5_integer(&h, h.file, "key", (int64_t)quern_checkpoint_key(run->scene));
		quern_h5_integer(&h, h.file, "rows", rows);
		for (size_t i = 0; i < N_COUNTERS; i++)
			quern_h5_integer(&h, h.file, counters[i].name,
				*(const int64_t *)(const void *)((const char *)&run->clock + counters[i].offset));
		quern_h5_number(&h, h.file, "dt", run->clock.dt);
		quern_h5_number(&h, h.file, "settle_dt", run->clock.settle_dt);
		quern_h5_number(&h, h.file, "begin", run->clock.begin);
		quern_h5_number(&h, h.file, "end", run->clock.end);
		quern_h5_number(&h, h.file, "wall", run->wall_before);
		quern_h5_number(&h, h.file, "settle_wall", run->settle_wall);
		quern_h5_number(&h, h.file, "mass_initial", run->mass_initial);
		if (run->has_grid) {
			const uint32_t n = run->grid.view.n_blocks;
			close_set(quern_h5_write(&h, h.file, "blocks", H5T_NATIVE_INT32, n, 3, run->grid.at));
			close_set(quern_h5_write(&h, h.file, "asked", H5T_NATIVE_UINT8, n, 1, run->grid.asked));
		}
		for (int s = 0; s < (int)run->plan->store.n_sets; s++) write_set(&h, run, s);
		good = quern_h5_save(&h, path, why);
	}
	free(path);
	return good ? QUERN_OK : quern_run_stop(run, QUERN_E_IO, "%s", why);
}

/* ---- reading ---- */

static bool fault(char why[256], const char *what, const char *name) {
	snprintf(why, 256, "the checkpoint does not fit this scene: %s of %s", what, name);
	return false;
}

static bool read_partition(quern_run *run, hid_t group, int s, uint32_t n, char why[256]) {
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

/* Indices are followed blindly later on, so they are looked at now. */
static bool indices_hold(const quern_store *store, const quern_field *field, uint32_t n) {
	const int32_t *index = field->data[field->now][0];
	for (uint32_t i = 0; i < n; i++)
		if (index[i] < 0 || (uint32_t)index[i] >= store->sets[field->target].n) return false;
	return true;
}

/* No state of a run that goes on is infinite or undefined, but for sums of the run as a whole. */
static bool numbers_hold(const quern_store *store, const quern_field *field, uint32_t n) {
	const bool whole = !strcmp(store->sets[field->set].name, "total");
	for (uint8_t c = 0; c < field->n_components; c++) {
		const quern_real *value = field->data[field->now][c];
		for (uint32_t i = 0; i < n; i++)
			if (isnan(value[i]) || (!whole && isinf(value[i]))) return false;
	}
	return true;
}

static bool values_hold(const quern_store *store, const quern_field *field, char why[256]) {
	const uint32_t n = store->sets[field->set].n;
	if (!is_kept(store, field) || field->shape == QUERN_ID) return true;
	if (field->shape != QUERN_INDEX)
		return numbers_hold(store, field, n) || fault(why, "a number that is not finite", field->name);
	return field->target < 0 || indices_hold(store, field, n) ||
		   fault(why, "an index out of its set", field->name);
}

static bool read_fields(quern_run *run, hid_t group, int s, char why[256]) {
	quern_store *store = &run->plan->store;
	for (size_t k = 0; k < store->n_fields; k++) {
		quern_field *field = &store->fields[k];
		if (field->set != s || !is_kept(store, field)) continue;
		for (int c = 0; c < field->n_components; c++) {
			char name[64];
			snprintf(name, sizeof name, "%s.%d", strchr(field->name, '.') + 1, c);
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
		if (field->set != s || !is_kept(store, field)) continue;
		snprintf(name, sizeof name, "%s.0", strchr(field->name, '.') + 1);
		if (!quern_h5_read_size(group, name, &rows, &columns) || rows != (size_t)n) return false;
	}
	return true;
}

static bool read_set(quern_run *run, quern_h5 *h, int s, char why[256]) {
	quern_store *store = &run->plan->store;
	int64_t n = -1, next_id = -1;
	if (store->sets[s].rows) return true;
	const hid_t group = quern_h5_find(h->file, store->sets[s].name);
	if (group < 0) return fault(why, "the set", store->sets[s].name);
	bool good = quern_h5_read_integer(group, "n", &n) && quern_h5_read_integer(group, "next_id", &next_id) &&
				n >= 0 && n <= MOST_ENTRIES && next_id >= 0;
	if (good && store->sets[s].grid) good = n == (int64_t)run->grid.view.n_blocks * 64 || n == 0;
	good = good && sizes_hold(store, group, s, n);
	if (!good) fault(why, "the size", store->sets[s].name);
	good = good && quern_store_fill(store, s, (uint32_t)n) == QUERN_OK &&
		   read_partition(run, group, s, (uint32_t)n, why) && read_fields(run, group, s, why);
	store->sets[s].next_id = next_id;
	H5Gclose(group);
	return good;
}

static bool read_grid(quern_run *run, quern_h5 *h, char why[256]) {
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

static bool read_clock(quern_run *run, quern_h5 *h, int64_t *rows, char why[256]) {
	quern_clock *c = &run->clock;
	bool good = quern_h5_read_integer(h->file, "rows", rows) && *rows >= 0;
	for (size_t i = 0; i < N_COUNTERS; i++)
		good = good && quern_h5_read_integer(
						   h->file, counters[i].name, (int64_t *)(void *)((char *)c + counters[i].offset));
	good = good && quern_h5_read_number(h->file, "dt", &c->dt) &&
		   quern_h5_read_number(h->file, "settle_dt", &c->settle_dt) &&
		   quern_h5_read_number(h->file, "begin", &c->begin) &&
		   quern_h5_read_number(h->file, "end", &c->end) &&
		   quern_h5_read_number(h->file, "wall", &run->wall_before) &&
		   quern_h5_read_number(h->file, "settle_wall", &run->settle_wall) &&
		   quern_h5_read_number(h->file, "mass_initial", &run->mass_initial);
	good = good && c->step >= 0 && c->substep >= 0 && c->settle_step >= 0 && c->frame >= -1 && c->at >= 0 &&
		   c->at <= c->steps_in && (c->settled == 0 || c->settled == 1) && isfinite(c->dt) && c->dt >= 0 &&
		   isfinite(c->settle_dt) && c->settle_dt >= 0;
	return good || fault(why, "the counters", "the run");
}

static bool read_all(quern_run *run, quern_h5 *h, int64_t *rows, char why[256]) {
	char format[32];
	int64_t key = 0;
	quern_store *store = &run->plan->store;
	if (!quern_h5_read_text(h->file, "format", format, sizeof format) ||
		strcmp(format, "quern-checkpoint 1") != 0 || !quern_h5_read_integer(h->file, "key", &key)) {
		snprintf(why, 256, "it is no checkpoint of this program");
		return false;
	}
	if ((uint64_t)key != quern_checkpoint_key(run->scene)) {
		snprintf(why, 256,
			"it belongs to another scene: only title, end, output.compress, checkpoint and run may change");
		return false;
	}
	if (!read_clock(run, h, rows, why) || !read_grid(run, h, why)) return false;
	for (int s = 0; s < (int)store->n_sets; s++)
		if (!read_set(run, h, s, why)) return false;
	for (size_t k = 0; k < store->n_fields; k++)
		if (!values_hold(store, &store->fields[k], why)) return false;
	if (quern_run_rejoin(run)) return true;
	snprintf(why, 256, "time.end is %.9g s, and the run has come to %.9g s already", run->scene->general.end,
		quern_run_time(run));
	return false;
}

quern_status quern_checkpoint_read(quern_run *run, const char *path, int64_t *rows, char why[256]) {
	quern_h5 h;
	if (!quern_h5_open(&h, path, why)) return QUERN_E_IO;
	const bool good = read_all(run, &h, rows, why);
	quern_h5_close(&h);
	if (!good) return QUERN_E_IO;
	quern_plan_refresh(run->plan);
	return QUERN_OK;
}
