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

/* Indices into a set, counted as its entries come in the file; `entry` and `of`: the orders of the set and of that one. */
static int32_t *indices_of(
	const quern_field *field, const uint32_t *entry, size_t n, const quern_set_store *of) {
	const int32_t *index = field->data[field->now][0];
	int32_t *out = quern_take(n, sizeof *out);
	uint32_t *place = of && of->entry ? quern_take(of->n, sizeof *place) : NULL;
	for (uint32_t q = 0; place && q < of->n; q++) place[of->entry[q]] = q;
	for (size_t q = 0; q < n; q++) {
		const int32_t i = index[quern_nth(entry, q)];
		out[q] = place && i >= 0 && (uint32_t)i < of->n ? (int32_t)place[i] : i;
	}
	free(place);
	return out;
}

static int64_t *ids_of(const quern_field *field, const uint32_t *entry, size_t n) {
	const int64_t *id = field->data[field->now][0];
	int64_t *out = quern_take(n, sizeof *out);
	for (size_t q = 0; q < n; q++) out[q] = id[quern_nth(entry, q)];
	return out;
}

/* Entries come in the order of their blocks' places, however the set is cut. */
static void write_field(quern_h5 *h, hid_t group, const quern_run *run, int k, size_t n) {
	const quern_store *store = &run->plan->store;
	const quern_field *field = &store->fields[k];
	const uint32_t *entry = store->sets[field->set].entry;
	const char *name = strchr(field->name, '.') + 1;
	hid_t set;
	if (field->shape == QUERN_INDEX) {
		int32_t *index = indices_of(field, entry, n, field->target < 0 ? NULL : &store->sets[field->target]);
		set = quern_h5_write(h, group, name, H5T_NATIVE_INT32, n, 1, index);
		free(index);
	} else if (field->shape == QUERN_ID) {
		int64_t *id = ids_of(field, entry, n);
		set = quern_h5_write(h, group, name, H5T_NATIVE_INT64, n, 1, id);
		free(id);
	} else {
		int from[9];
		const int columns = quern_state_columns(field->shape, (uint32_t)run->scene->general.dimension, from);
		double *table = quern_take(n * (size_t)columns, sizeof(double));
		for (int c = 0; c < columns; c++) {
			const double *column = from[c] < 0 ? NULL : field->data[field->now][from[c]];
			for (size_t i = 0; i < n; i++)
				table[i * (size_t)columns + (size_t)c] = column ? column[quern_nth(entry, i)] : 0;
		}
		set = quern_h5_write(h, group, name, H5T_NATIVE_DOUBLE, n, (size_t)columns, table);
		free(table);
	}
	describe(h, set, field->unit, field->doc, maker(run->plan, k));
}

static void write_centres(quern_h5 *h, hid_t group, const quern_run *run, size_t n) {
	const quern_grid_view *v = &run->grid.view;
	double *table = quern_take(n * 3, sizeof(double));
	for (size_t i = 0; i < n; i++) {
		const uint32_t place = (uint32_t)(i % 64), b = quern_nth(v->by_place, (uint32_t)(i / 64));
		const uint32_t at[3] = { place % v->edge, place / v->edge % v->edge,
			v->dim == 3 ? place / (v->edge * v->edge) : 0 };
		for (uint32_t k = 0; k < v->dim; k++)
			table[3 * i + k] =
				v->lower[k] + v->cell * (v->at[b][k] * (int32_t)v->edge + (int32_t)at[k] + 0.5);
	}
	describe(h, quern_h5_write(h, group, "position", H5T_NATIVE_DOUBLE, n, 3, table), "m",
		"Centre of the cell.", "quern");
	free(table);
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
