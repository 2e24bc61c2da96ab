/* SPDX-License-Identifier: MIT */
#include "state.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ENTRIES = 1 << 30 };

hid_t quern_state_type(const quern_field *field) {
	return field->shape == QUERN_INDEX ? H5T_NATIVE_INT32
		   : field->shape == QUERN_ID  ? H5T_NATIVE_INT64
									   : H5T_NATIVE_DOUBLE;
}

int quern_state_columns(uint8_t shape, uint32_t dim, int from[9]) {
	static const int vector[2][3] = { { 0, 1, -1 }, { 0, 1, 2 } },
					 axial[2][3] = { { -1, -1, 0 }, { 0, 1, 2 } };
	static const int symmetric[2][6] = { { 0, 1, -1, 2, -1, -1 }, { 0, 1, 2, 3, 4, 5 } };
	static const int tensor[2][9] = { { 0, 1, -1, 2, 3, -1, -1, -1, -1 }, { 0, 1, 2, 3, 4, 5, 6, 7, 8 } };
	const uint32_t d = dim == 3;
	switch (shape) {
	case QUERN_VECTOR: memcpy(from, vector[d], sizeof vector[d]); return 3;
	case QUERN_AXIAL: memcpy(from, axial[d], sizeof axial[d]); return 3;
	case QUERN_SYMMETRIC: memcpy(from, symmetric[d], sizeof symmetric[d]); return 6;
	case QUERN_TENSOR: memcpy(from, tensor[d], sizeof tensor[d]); return 9;
	default: from[0] = 0; return 1;
	}
}

static bool is_column(const quern_store *store, const quern_field *field, int set, quern_state_picks picks) {
	return field->set == set && picks(field) && !store->sets[set].rows;
}

/* Rows are scratch of a step, unless somebody looks at them between two. */
static bool keeps_rows(const quern_store *store, int set, quern_state_picks picks) {
	for (size_t k = 0; k < store->n_fields && store->sets[set].rows; k++)
		if (store->fields[k].set == set && picks(&store->fields[k])) return true;
	return false;
}

static void component_name(const quern_field *field, int component, char out[64]) {
	snprintf(out, 64, "%s.%d", strchr(field->name, '.') + 1, component);
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
const char *quern_state_fault(const quern_run *run, const quern_field *field) {
	const quern_store *store = &run->plan->store;
	if (!field->kept || store->sets[field->set].rows) return NULL;
	if (field->shape == QUERN_ID)
		return ids_hold(&store->sets[field->set], field) ? NULL : "a number that was never given";
	if (field->shape == QUERN_INDEX)
		return field->target < 0 || indices_hold(store, field) ? NULL : "an index out of its set";
	if (!field->state) return NULL;
	return numbers_hold(store, field) ? NULL : "a number that is not finite";
}

/* ---- writing ---- */

void quern_state_write(quern_h5 *h, const quern_run *run, int s, quern_state_picks picks) {
	const quern_store *store = &run->plan->store;
	const quern_set_store *set = &store->sets[s];
	char name[64];
	if (set->rows && !keeps_rows(store, s, picks)) return;
	const hid_t group = quern_h5_group(h, h->file, set->name);
	quern_h5_integer(h, group, "n", set->n);
	quern_h5_integer(h, group, "next_id", set->next_id);
	const uint32_t n_blocks = set->grid ? 0 : set->n_blocks; /* cells are cut as the grid is */
	quern_h5_integer(h, group, "n_blocks", n_blocks);
	if (set->rows) quern_h5_put(h, group, "row", H5T_NATIVE_DOUBLE, set->n, 8, set->row);
	if (n_blocks) quern_h5_put(h, group, "block", H5T_NATIVE_UINT32, n_blocks + 1u, 1, set->block);
	if (n_blocks && set->by_place)
		quern_h5_put(h, group, "by_place", H5T_NATIVE_UINT32, set->n_blocks, 1, set->by_place);
	for (size_t k = 0; k < store->n_fields; k++) {
		const quern_field *field = &store->fields[k];
		if (!is_column(store, field, s, picks)) continue;
		for (int c = 0; c < field->n_components; c++) {
			component_name(field, c, name);
			quern_h5_put(h, group, name, quern_state_type(field), set->n, 1, field->data[field->now][c]);
		}
	}
	if (group >= 0) H5Gclose(group);
}

/* ---- reading ---- */

static bool fault(quern_text *why, const char *what, const char *name) {
	quern_text_add(why, "it does not fit this scene: %s of %s", what, name);
	return false;
}

/* Blocks whose places come in another order than they do say so. */
static bool read_places(quern_store *store, hid_t group, int s, uint32_t n) {
	if (H5Lexists(group, "by_place", H5P_DEFAULT) <= 0) return true;
	uint32_t *place = malloc((size_t)n * sizeof(uint32_t));
	const bool good = place && quern_h5_read(group, "by_place", H5T_NATIVE_UINT32, n, 1, place) &&
					  quern_store_arrange(store, s, place) == QUERN_OK;
	free(place);
	return good;
}

static bool read_partition(quern_run *run, hid_t group, int s, quern_text *why) {
	quern_store *store = &run->plan->store;
	const quern_set_store *set = &store->sets[s];
	int64_t n_blocks = -1;
	if (!quern_h5_read_integer(group, "n_blocks", &n_blocks) || n_blocks < 0 || n_blocks > MOST_ENTRIES)
		return fault(why, "n_blocks", set->name);
	if (set->grid && set->n)
		return quern_grid_cut(&run->grid, store, s) == QUERN_OK || fault(why, "memory", set->name);
	if (!n_blocks) return true;
	size_t rows = 0, columns = 0; /* memory is taken only for what the file does hold */
	if (!quern_h5_read_size(group, "block", &rows, &columns) || rows != (size_t)n_blocks + 1)
		return fault(why, "the partition", set->name);
	uint32_t *block = malloc(((size_t)n_blocks + 1) * sizeof(uint32_t));
	bool good = block && quern_h5_read(group, "block", H5T_NATIVE_UINT32, (size_t)n_blocks + 1, 1, block);
	good = good && block[0] == 0 && block[n_blocks] == set->n;
	for (int64_t b = 0; good && b < n_blocks; b++) good = block[b] <= block[b + 1];
	good = good && quern_store_partition(store, s, (uint32_t)n_blocks, block) == QUERN_OK &&
		   read_places(store, group, s, (uint32_t)n_blocks);
	free(block);
	return good || fault(why, "the partition", set->name);
}

static bool read_fields(quern_store *store, hid_t group, int s, quern_state_picks picks, quern_text *why) {
	char name[64];
	for (size_t k = 0; k < store->n_fields; k++) {
		quern_field *field = &store->fields[k];
		if (!is_column(store, field, s, picks)) continue;
		for (int c = 0; c < field->n_components; c++) {
			component_name(field, c, name);
			if (!quern_h5_read(
					group, name, quern_state_type(field), store->sets[s].n, 1, field->data[field->now][c]))
				return fault(why, name, store->sets[s].name);
		}
	}
	return true;
}

/* Memory is taken only for what the file does hold. */
static bool sizes_hold(const quern_store *store, hid_t group, int s, int64_t n, quern_state_picks picks) {
	for (size_t k = 0; k < store->n_fields; k++) {
		const quern_field *field = &store->fields[k];
		char name[64];
		size_t rows = 0, columns = 0;
		if (!is_column(store, field, s, picks)) continue;
		component_name(field, 0, name);
		if (!quern_h5_read_size(group, name, &rows, &columns) || rows != (size_t)n) return false;
	}
	return true;
}

bool quern_state_find(
	const quern_run *run, hid_t file, int s, quern_state_picks picks, quern_state_group *g, quern_text *why) {
	const quern_store *store = &run->plan->store;
	const quern_set_store *set = &store->sets[s];
	*g = (quern_state_group) { .at = quern_h5_find(file, set->name) };
	if (g->at < 0) return fault(why, "the set", set->name);
	int64_t n = -1;
	bool good = quern_h5_read_integer(g->at, "n", &n) &&
				quern_h5_read_integer(g->at, "next_id", &g->next_id) && n >= 0 && n <= MOST_ENTRIES &&
				g->next_id >= 0;
	if (good && set->grid) good = n == (int64_t)run->grid.view.n_blocks * 64 || n == 0;
	good = good && (set->rows ? set->n == n : sizes_hold(store, g->at, s, n, picks));
	g->n = (uint32_t)n;
	if (good) return true;
	quern_state_leave(g);
	return fault(why, "the size", set->name);
}

void quern_state_leave(quern_state_group *g) {
	if (g->at >= 0) H5Gclose(g->at);
	g->at = -1;
}

bool quern_state_read(
	quern_run *run, const quern_state_group *g, int s, quern_state_picks picks, quern_text *why) {
	quern_store *store = &run->plan->store;
	quern_set_store *set = &store->sets[s];
	set->next_id = g->next_id;
	if (!set->rows) return read_partition(run, g->at, s, why) && read_fields(store, g->at, s, picks, why);
	return !g->n || !keeps_rows(store, s, picks) ||
		   quern_h5_read(g->at, "row", H5T_NATIVE_DOUBLE, set->n, 8, set->row) ||
		   fault(why, "rows", set->name);
}
