/* SPDX-License-Identifier: MIT */
#include "frame.h"
#include "config.h"
#include "h5.h"
#include "identity.h"
#include "sidecar.h"
#include "state.h"
#include <stdlib.h>
#include <string.h>

static const char *maker(const quern_plan *p, int field) {
	for (size_t i = 0; i < p->n_uses; i++)
		if (p->uses[i].target == field && p->uses[i].row->access != QUERN_READ) return p->uses[i].owner;
	return "quern";
}

static void describe(quern_h5 *h, hid_t set, const char *unit, const char *doc, const char *source) {
	if (set < 0) return;
	quern_h5_text(h, set, "unit", unit ? unit : "1");
	quern_h5_text(h, set, "description", doc ? doc : "");
	quern_h5_text(h, set, "source", source);
	H5Dclose(set);
}

/* A field as its entries come in the file: in the order of their blocks' places, however the set is cut. */
typedef struct {
	const quern_field *field;
	const uint32_t *entry, *place; /* the order of the set; where an entry of the target stands in the file */
	uint32_t n_place;
	int columns, from[9];
} shown;

/* Indices into a set, counted as its entries come in the file. */
static void make_indices(const void *what, size_t first, size_t n, void *rows) {
	const shown *w = what;
	const int32_t *index = w->field->data[w->field->now][0];
	int32_t *out = rows;
	for (size_t q = 0; q < n; q++) {
		const int32_t i = index[quern_nth(w->entry, first + q)];
		out[q] = w->place && i >= 0 && (uint32_t)i < w->n_place ? (int32_t)w->place[i] : i;
	}
}

static void make_ids(const void *what, size_t first, size_t n, void *rows) {
	const shown *w = what;
	const int64_t *id = w->field->data[w->field->now][0];
	int64_t *out = rows;
	for (size_t q = 0; q < n; q++) out[q] = id[quern_nth(w->entry, first + q)];
}

static void make_numbers(const void *what, size_t first, size_t n, void *rows) {
	const shown *w = what;
	double *out = rows;
	for (int c = 0; c < w->columns; c++) {
		const double *column = w->from[c] < 0 ? NULL : w->field->data[w->field->now][w->from[c]];
		for (size_t q = 0; q < n; q++)
			out[q * (size_t)w->columns + (size_t)c] = column ? column[quern_nth(w->entry, first + q)] : 0;
	}
}

static uint32_t *places_of(const quern_set_store *set) {
	uint32_t *place = set->entry ? quern_take(set->n, sizeof *place) : NULL;
	for (uint32_t q = 0; place && q < set->n; q++) place[set->entry[q]] = q;
	return place;
}

static void write_field(quern_h5 *h, hid_t group, const quern_run *run, int k, size_t n) {
	const quern_store *store = &run->plan->store;
	const quern_field *field = &store->fields[k];
	const char *name = strchr(field->name, '.') + 1;
	shown w = { .field = field, .entry = store->sets[field->set].entry };
	hid_t set;
	if (field->shape == QUERN_INDEX) {
		const quern_set_store *target = field->target < 0 ? NULL : &store->sets[field->target];
		uint32_t *place = target ? places_of(target) : NULL;
		w.place = place, w.n_place = target ? target->n : 0;
		set = quern_h5_write(h, group, name, H5T_NATIVE_INT32, n, 1, make_indices, &w);
		free(place);
	} else if (field->shape == QUERN_ID) {
		set = quern_h5_write(h, group, name, H5T_NATIVE_INT64, n, 1, make_ids, &w);
	} else {
		w.columns = quern_state_columns(field->shape, (uint32_t)run->scene->general.dimension, w.from);
		set = quern_h5_write(h, group, name, H5T_NATIVE_DOUBLE, n, (size_t)w.columns, make_numbers, &w);
	}
	describe(h, set, field->unit, field->doc, maker(run->plan, k));
}

static void make_centres(const void *what, size_t first, size_t n, void *rows) {
	const quern_grid_view *v = what;
	double *out = rows;
	memset(out, 0, n * 3 * sizeof *out);
	for (size_t q = 0; q < n; q++) {
		const uint32_t i = (uint32_t)(first + q), place = i % 64, b = quern_nth(v->by_place, i / 64);
		const uint32_t at[3] = { place % v->edge, place / v->edge % v->edge,
			v->dim == 3 ? place / (v->edge * v->edge) : 0 };
		for (uint32_t k = 0; k < v->dim; k++)
			out[3 * q + k] = v->lower[k] + v->cell * (v->at[b][k] * (int32_t)v->edge + (int32_t)at[k] + 0.5);
	}
}

static void write_centres(quern_h5 *h, hid_t group, const quern_run *run, size_t n) {
	describe(h, quern_h5_write(h, group, "position", H5T_NATIVE_DOUBLE, n, 3, make_centres, &run->grid.view),
		"m", "Centre of the cell.", "quern");
}

/* What something points at goes with it. */
static bool is_shown(const quern_store *store, const quern_field *field) {
	bool any = field->shown;
	for (size_t i = 0; i < store->n_fields && !any && field->target >= 0; i++)
		any = store->fields[i].set == field->set && store->fields[i].shown;
	return any && !field->local && !store->sets[field->set].rows;
}

static void write_set(quern_h5 *h, const quern_run *run, int s) {
	const quern_store *store = &run->plan->store;
	const quern_set_store *set = &store->sets[s];
	bool any = false;
	for (size_t k = 0; k < store->n_fields; k++)
		any = any || (store->fields[k].set == s && is_shown(store, &store->fields[k]));
	if (!any) return;
	const hid_t group = quern_h5_group(h, h->file, quern_set_plural(set));
	char position[40];
	snprintf(position, sizeof position, "%s.position", set->name);
	const int first = quern_store_field(store, position);
	if (set->grid) write_centres(h, group, run, set->n);
	if (first >= 0) write_field(h, group, run, first, set->n);
	for (int k = 0; k < (int)store->n_fields; k++)
		if (store->fields[k].set == s && k != first && is_shown(store, &store->fields[k]))
			write_field(h, group, run, k, set->n);
	if (group >= 0) H5Gclose(group);
}

static void provenance(quern_h5 *h, quern_run *run) {
	quern_h5_text(h, h->file, "format", "quern-frame 1");
	quern_h5_number(h, h->file, "time", quern_run_time(run));
	quern_h5_integer(h, h->file, "step", run->clock.step);
	quern_h5_integer(h, h->file, "dimension", run->scene->general.dimension);
	quern_h5_text(h, h->file, "name", run->scene->general.name);
	quern_text sections = { 0 };
	for (size_t i = 0; i < run->scene->n_sections; i++)
		quern_text_add(&sections, "%s%s ", i ? "" : " ", run->scene->sections[i].name);
	quern_h5_text(h, h->file, "sections", quern_text_string(&sections));
	quern_text_finish(&sections);
	quern_h5_text(h, h->file, "program", "quern " QUERN_VERSION);
	quern_h5_text(h, h->file, "compiler", QUERN_COMPILER);
	quern_h5_text(h, h->file, "flags", QUERN_FLAGS);
	quern_h5_integer(h, h->file, "seed", run->scene->general.seed);
	quern_h5_integer(h, h->file, "scene_hash", (int64_t)quern_run_scene_hash(run));
}

quern_status quern_frame_write(quern_run *run, int64_t frame) {
	quern_h5 h;
	char why[256];
	if (!run->folder) return QUERN_OK;
	char *path = quern_format("%s/frames/%06lld.h5", run->folder, (long long)frame);
	quern_run_rest(run);
	bool good = quern_h5_create(&h, run->scene->general.compress, 0);
	if (good) {
		provenance(&h, run);
		for (int s = 0; s < (int)run->plan->store.n_sets; s++) write_set(&h, run, s);
	}
	good = quern_h5_save(&h, path, why) && quern_sidecars_add(run->sidecars, frame, why);
	free(path);
	return good ? QUERN_OK : quern_run_stop(run, QUERN_E_IO, "%s", why);
}
