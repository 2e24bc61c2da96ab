/* SPDX-License-Identifier: MIT */
#include "field.h"
#include "platform.h"
#include "text.h"
#include <quern/columns.h>
#include <stdlib.h>
#include <string.h>

enum { CHUNK = 4096 };

size_t quern_field_bytes(const quern_field *field) { return field->shape == QUERN_INDEX ? 4 : 8; }

const char *quern_set_plural(const quern_set_store *set) {
	if (set->table) return set->table->plural ? set->table->plural : set->name;
	return set->grid ? "cells" : set->name;
}

bool quern_set_is_counted(const quern_set_store *set) { return set->table && set->table->counted; }

void quern_store_init(quern_store *store, quern_pool *pool) { *store = (quern_store) { .pool = pool }; }

void quern_store_finish(quern_store *store) {
	if (!store) return;
	for (size_t i = 0; i < store->n_sets; i++) {
		free(store->sets[i].columns);
		free(store->sets[i].block);
		free(store->sets[i].by_place);
		free(store->sets[i].entry);
		free(store->sets[i].row);
	}
	free(store->fields);
	free(store->sets);
	*store = (quern_store) { 0 };
}

int quern_store_set(const quern_store *store, const char *name) {
	for (size_t i = 0; i < store->n_sets; i++)
		if (!strcmp(store->sets[i].name, name)) return (int)i;
	return -1;
}

int quern_store_field(const quern_store *store, const char *name) {
	for (size_t i = 0; i < store->n_fields; i++)
		if (!strcmp(store->fields[i].name, name)) return (int)i;
	return -1;
}

quern_column quern_field_column(const quern_store *store, const quern_field *field, uint8_t copy) {
	quern_column column = { .real = { NULL } };
	if (field->local) return column;
	const quern_set_store *set = &store->sets[field->set];
	if (set->rows)
		for (uint8_t k = 0; k < field->n_components; k++)
			column.real[k] = set->row ? set->row + field->lane + k : NULL;
	else if (field->shape == QUERN_INDEX) column.index = field->data[copy][0];
	else if (field->shape == QUERN_ID) column.id = field->data[copy][0];
	else
		for (uint8_t k = 0; k < field->n_components; k++) column.real[k] = field->data[copy][k];
	return column;
}

static double initial_of(const quern_field *field, int component) {
	const uint32_t dim =
		field->n_components == 3 || field->n_components == 4 ? 2 : 3; /* of a tensor of this many */
	return quern_shape_initial(field->shape, dim, (uint32_t)component, field->initial);
}

/* Loops walk through dozens of columns side by side: their beginnings lie 17 lines apart in the sets of a cache, so that they do not
 * push each other out. */
static size_t column_bytes(uint32_t cap, size_t bytes) {
	enum { LINE = 64, AROUND = 64 * LINE, APART = 17 * LINE };
	const size_t size = (((size_t)cap + QUERN_LANES) * bytes + LINE + LINE - 1) & ~(size_t)(LINE - 1);
	return size + (AROUND + APART - size % AROUND) % AROUND;
}

static bool owns(const quern_field *field, int set) { return field->set == set && !field->local; }

typedef struct {
	void **column;
	size_t bytes;
	bool carried;
} place;

/* Every column of a set, the spare one first; returns how many there are. */
static size_t places_of(quern_store *store, int set, place *out) {
	size_t n = 0;
	out[n++] = (place) { .column = &store->sets[set].spare, .bytes = 8 };
	for (size_t i = 0; i < store->n_fields; i++) {
		quern_field *field = &store->fields[i];
		if (!owns(field, set)) continue;
		for (int copy = 0; copy <= field->twice; copy++)
			for (uint8_t k = 0; k < field->n_components; k++)
				out[n++] = (place) { &field->data[copy][k], quern_field_bytes(field), true };
	}
	return n;
}

/* Columns of a set always have its capacity, so that they can trade places with the spare one; they lie in one block of memory, since
 * many small ones would have no large pages. All new ones have a place before an old one goes; but what a place takes up, it does as it is
 * written, and by then the column before it has gone: a set that grows is never there twice. What is ahead of its size is touched too, so that
 * it is little. */
static quern_status reserve(quern_store *store, int set, uint32_t n) {
	quern_set_store *s = &store->sets[set];
	if (n <= s->cap && s->spare) return QUERN_OK;
	if (n > UINT32_MAX / 2) return QUERN_E_MEMORY;
	const uint32_t cap = n + n / 16 + 64;
	place *places = calloc(store->n_fields * 18 + 1, sizeof *places);
	const size_t n_places = places ? places_of(store, set, places) : 0;
	size_t bytes = 0;
	for (size_t i = 0; i < n_places; i++) bytes += column_bytes(cap, places[i].bytes);
	char *columns = places ? quern_platform_memory(bytes) : NULL, *at = columns;
	if (!columns) return free(places), QUERN_E_MEMORY;
	for (size_t i = 0; i < n_places; i++) {
		const place *p = &places[i];
		const size_t size = column_bytes(cap, p->bytes),
					 kept = p->carried && *p->column ? s->n * p->bytes : 0;
		if (kept) memcpy(at, *p->column, kept);
		memset(at + kept, 0, size - kept);
		if (*p->column) quern_platform_forget(*p->column, s->cap * p->bytes);
		*p->column = at;
		at += size;
	}
	free(places);
	free(s->columns);
	s->columns = columns;
	store->version++;
	s->cap = cap;
	return QUERN_OK;
}

typedef struct {
	const quern_field *field;
	const int32_t *from;
	const void *old;
	void *new;
	double initial;
	int64_t first_id;
	uint32_t n;
	bool all; /* every entry was one before */
} permutation;

/* Where an entry's value comes from: another one, or -1; what a part gets only by give(), or never, from nowhere. */
static int32_t source(const quern_field *field, int32_t from) {
	if (from >= -1) return from;
	return field->rule == QUERN_SUMS || field->rule == QUERN_OWN ? from : -2 - from;
}

static void permute(void *arg, uint32_t chunk, uint32_t worker) {
	const permutation *p = arg;
	const uint32_t begin = chunk * CHUNK, end = begin + CHUNK < p->n ? begin + CHUNK : p->n;
	(void)worker;
	if (p->field->shape == QUERN_INDEX) {
		const int32_t *old = p->old;
		int32_t *new = p->new;
		for (uint32_t i = begin; i < end; i++) {
			const int32_t from = source(p->field, p->from[i]);
			new[i] = from >= 0 ? old[from] : (int32_t)p->initial;
		}
	} else if (p->field->shape == QUERN_ID) {
		const int64_t *old = p->old;
		int64_t *new = p->new;
		for (uint32_t i = begin; i < end; i++) new[i] = p->from[i] >= 0 ? old[p->from[i]] : -1;
	} else if (p->all) {
		const double *restrict old = p->old;
		double *restrict new = p->new;
		const int32_t *restrict from = p->from;
		for (uint32_t i = begin; i < end; i++) new[i] = old[from[i]];
	} else {
		const double *old = p->old;
		double *new = p->new;
		for (uint32_t i = begin; i < end; i++) {
			const int32_t from = source(p->field, p->from[i]);
			new[i] = from >= 0 ? old[from] : from < -1 && p->field->rule == QUERN_SUMS ? 0 : p->initial;
		}
	}
}

/* New ids count on in the order of the new entries: the same for any number of workers. */
static void number_new(quern_set_store *s, int64_t *id, uint32_t n) {
	for (uint32_t i = 0; i < n; i++)
		if (id[i] < 0) id[i] = s->next_id++;
}

/* ---- blocks ---- */

static void forget_places(quern_set_store *s) {
	free(s->by_place);
	free(s->entry);
	s->by_place = s->entry = NULL;
}

static quern_status reserve_blocks(quern_set_store *s, uint32_t n_blocks) {
	if (n_blocks < s->block_cap) return QUERN_OK;
	const size_t cap = ((size_t)n_blocks + 64) * 2;
	uint32_t *grown = cap > UINT32_MAX ? NULL : realloc(s->block, cap * sizeof(uint32_t));
	if (!grown) return QUERN_E_MEMORY;
	s->block = grown;
	s->block_cap = (uint32_t)cap;
	return QUERN_OK;
}

static void put_blocks(quern_set_store *s, uint32_t n_blocks, const uint32_t *block) {
	forget_places(s);
	if (block) memmove(s->block, block, ((size_t)n_blocks + 1) * sizeof(uint32_t));
	s->n_blocks = block ? n_blocks : 0;
}

quern_status quern_store_partition(quern_store *store, int set, uint32_t n_blocks, const uint32_t *block) {
	quern_set_store *s = &store->sets[set];
	const quern_status status = block ? reserve_blocks(s, n_blocks) : QUERN_OK;
	if (status == QUERN_OK) put_blocks(s, n_blocks, block);
	return status;
}

/* Each block once, and no other. */
static bool is_order(const quern_set_store *s, const uint32_t *by_place) {
	bool *seen = calloc((size_t)s->n_blocks + 1, sizeof(bool)), good = seen;
	for (uint32_t q = 0; q < s->n_blocks && good; q++) {
		good = by_place[q] < s->n_blocks && !seen[by_place[q]];
		if (good) seen[by_place[q]] = true;
	}
	free(seen);
	return good;
}

quern_status quern_store_arrange(quern_store *store, int set, const uint32_t *by_place) {
	quern_set_store *s = &store->sets[set];
	if (by_place && (!s->n_blocks || !is_order(s, by_place))) return QUERN_E_FIELD;
	uint32_t *places = by_place ? malloc(((size_t)s->n_blocks + 1) * sizeof(uint32_t)) : NULL;
	uint32_t *entry = by_place ? malloc(((size_t)s->n + 1) * sizeof(uint32_t)) : NULL, n = 0;
	if (by_place && (!places || !entry)) return free(places), free(entry), QUERN_E_MEMORY;
	for (uint32_t q = 0; by_place && q < s->n_blocks; q++) {
		places[q] = by_place[q];
		for (uint32_t i = s->block[places[q]]; i < s->block[places[q] + 1]; i++) entry[n++] = i;
	}
	forget_places(s);
	s->by_place = places;
	s->entry = entry;
	return QUERN_OK;
}

const quern_parts *quern_store_parts(quern_store *store, int set) {
	quern_set_store *s = &store->sets[set];
	s->parts = (quern_parts) { sizeof s->parts, s->n, s->n, s->n_blocks, s->n_blocks ? s->block : NULL,
		s->by_place, s->entry };
	return &s->parts;
}

/* As quern_tree_sum, with a block's sum for a number. */
static double sum_blocks(const quern_set_store *s, uint32_t first, uint32_t n, const double *values) {
	double sum = 0;
	if (n <= 256) {
		for (uint32_t q = first; q < first + n; q++) {
			const uint32_t b = quern_nth(s->by_place, q);
			sum += quern_tree_sum(s->block[b + 1] - s->block[b], values + s->block[b]);
		}
		return sum;
	}
	uint32_t half = 256;
	while (half * 2 < n) half *= 2;
	return sum_blocks(s, first, half, values) + sum_blocks(s, first + half, n - half, values);
}

double quern_store_sum(const quern_store *store, int set, const double *values) {
	const quern_set_store *s = &store->sets[set];
	return s->n_blocks ? sum_blocks(s, 0, s->n_blocks, values) : quern_tree_sum(s->n, values);
}

static quern_status drop(quern_store *store, int set, const bool *gone);

/* Every index into `target`, which had old_n entries, follows inverse[old] = new; entries that lost their target go. If
 * there is no memory to let them go, they stay and point at nothing. */
static quern_status follow(quern_store *store, int target, uint32_t old_n, const int32_t *inverse) {
	quern_status status = QUERN_OK;
	for (size_t s = 0; s < store->n_sets; s++) {
		const uint32_t n = store->sets[s].n;
		bool *gone = NULL;
		for (size_t i = 0; i < store->n_fields; i++) {
			quern_field *field = &store->fields[i];
			if (!owns(field, (int)s) || field->shape != QUERN_INDEX || field->target != target) continue;
			int32_t *index = field->data[field->now][0];
			for (uint32_t k = 0; k < n; k++) {
				if (index[k] == QUERN_NO_TARGET) continue;
				index[k] = index[k] >= 0 && (uint32_t)index[k] < old_n ? inverse[index[k]] : QUERN_NO_TARGET;
				if (index[k] >= 0) continue;
				if (!gone) gone = calloc(n, sizeof(bool));
				if (gone) gone[k] = true;
				else status = QUERN_E_MEMORY;
			}
		}
		if (gone && drop(store, (int)s, gone) != QUERN_OK) status = QUERN_E_MEMORY;
		free(gone);
	}
	return status;
}

static quern_status drop(quern_store *store, int set, const bool *gone) {
	quern_set_store *s = &store->sets[set];
	int32_t *from = malloc((size_t)s->n * sizeof(int32_t)); /* something is gone, so n > 0 */
	uint32_t *block = s->n_blocks ? malloc(((size_t)s->n_blocks + 1) * sizeof(uint32_t)) : NULL;
	if (!from || (s->n_blocks && !block)) return free(from), free(block), QUERN_E_MEMORY;
	uint32_t n = 0, b = 0;
	for (uint32_t i = 0; i < s->n; i++) {
		while (block && b < s->n_blocks && s->block[b] <= i) block[b++] = n;
		if (!gone[i]) from[n++] = (int32_t)i;
	}
	for (; block && b <= s->n_blocks; b++) block[b] = n;
	uint32_t *places = s->by_place;
	s->by_place = NULL;
	quern_status status = quern_store_remap(store, set, n, from, s->n_blocks, block);
	if (status != QUERN_OK && s->n != n) s->by_place = places, places = NULL; /* nothing has gone */
	if (status == QUERN_OK && places) status = quern_store_arrange(store, set, places);
	free(places);
	free(from);
	free(block);
	return status;
}

static bool is_target(const quern_store *store, int set) {
	for (size_t i = 0; i < store->n_fields; i++)
		if (store->fields[i].target == set && !store->fields[i].local) return true;
	return false;
}

/* inverse[old] = new, or no target; NULL if memory is gone. */
static int32_t *invert(uint32_t old_n, uint32_t n, const int32_t *from) {
	int32_t *inverse = malloc(old_n ? (size_t)old_n * sizeof(int32_t) : 1);
	for (uint32_t i = 0; i < old_n && inverse; i++) inverse[i] = QUERN_NO_TARGET;
	for (uint32_t i = 0; i < n && inverse; i++)
		if (from[i] >= 0) inverse[from[i]] = (int32_t)i;
	return inverse;
}

static void permute_columns(quern_store *store, int set, uint32_t n, const int32_t *from) {
	quern_set_store *s = &store->sets[set];
	bool all = true;
	for (uint32_t i = 0; i < n && all; i++) all = from[i] >= 0;
	for (size_t i = 0; i < store->n_fields; i++) {
		quern_field *field = &store->fields[i];
		if (!owns(field, set)) continue;
		for (uint8_t k = 0; k < field->n_components; k++) {
			void **column = &field->data[field->now][k];
			permutation p = { field, from, *column, s->spare, initial_of(field, k), s->next_id, n, all };
			quern_pool_each(store->pool, (n + CHUNK - 1) / CHUNK, permute, &p);
			if (field->shape == QUERN_INDEX) { /* its own place is too narrow for others */
				memcpy(*column, p.new, n * sizeof(int32_t));
				continue;
			}
			s->spare = *column;
			*column = p.new;
			if (field->shape == QUERN_ID) number_new(s, *column, n);
		}
	}
	s->n = n;
	store->version++;
}

/* What takes memory comes first, so that without any the store is as it was. */
quern_status quern_store_remap(
	quern_store *store, int set, uint32_t n, const int32_t *from, uint32_t n_blocks, const uint32_t *block) {
	quern_set_store *s = &store->sets[set];
	const uint32_t old_n = s->n;
	const bool followed = is_target(store, set);
	int32_t *inverse = followed ? invert(old_n, n, from) : NULL;
	quern_status status = followed && !inverse ? QUERN_E_MEMORY : QUERN_OK;
	if (status == QUERN_OK) status = reserve(store, set, n > old_n ? n : old_n);
	if (status == QUERN_OK && block) status = reserve_blocks(s, n_blocks);
	if (status == QUERN_OK) {
		permute_columns(store, set, n, from);
		put_blocks(s, n_blocks, block);
		if (followed) status = follow(store, set, old_n, inverse);
	}
	free(inverse);
	return status;
}

void quern_store_give(quern_store *store, int set, uint32_t from, int32_t to, double part, double share) {
	const quern_set_store *s = &store->sets[set];
	if (s->rows || from >= s->n || (to >= 0 && (uint32_t)to >= s->n)) return;
	for (size_t i = 0; i < store->n_fields; i++) {
		quern_field *field = &store->fields[i];
		if (!owns(field, set) || (field->rule != QUERN_SUMS && field->rule != QUERN_MEANS)) continue;
		for (uint8_t k = 0; k < field->n_components; k++) {
			double *x = field->data[field->now][k];
			if (field->rule == QUERN_MEANS && to >= 0) x[to] += share * (x[from] - x[to]);
			if (field->rule == QUERN_MEANS) continue;
			const double given = part * x[from];
			if (to >= 0) x[to] += given;
			x[from] -= given;
		}
	}
}

quern_status quern_store_fill(quern_store *store, int set, uint32_t n) {
	int32_t *from = malloc(n ? (size_t)n * sizeof(int32_t) : 1);
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) from[i] = -1;
	const quern_status status = quern_store_remap(store, set, n, from, 0, NULL);
	free(from);
	return status;
}

quern_status quern_store_rows(quern_store *store, int set, uint32_t n) {
	quern_set_store *s = &store->sets[set];
	if (n > s->cap) {
		const size_t cap = (size_t)n + n / 4 + 64;
		double *row = cap > UINT32_MAX ? NULL : quern_platform_memory(cap * 64);
		if (!row) return QUERN_E_MEMORY;
		free(s->row);
		s->row = row;
		s->cap = (uint32_t)cap;
	}
	s->n = n;
	if (s->row) memset(s->row, 0, (size_t)n * 64);
	store->version++;
	return QUERN_OK;
}

size_t quern_store_bytes(const quern_store *store) {
	size_t bytes = 0;
	for (size_t i = 0; i < store->n_fields; i++) {
		const quern_field *field = &store->fields[i];
		const quern_set_store *s = &store->sets[field->set];
		if (!field->local && !s->rows)
			bytes += (size_t)s->cap * field->n_components * quern_field_bytes(field) * (field->twice ? 2 : 1);
	}
	for (size_t i = 0; i < store->n_sets; i++)
		bytes += store->sets[i].rows ? (size_t)store->sets[i].cap * 64 : (size_t)store->sets[i].cap * 8;
	return bytes;
}
