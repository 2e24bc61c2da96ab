#include "field.h"
#include "text.h"
#include <stdlib.h>
#include <string.h>

enum { CHUNK = 4096 };

uint8_t quern_components(uint8_t shape, uint32_t dim) {
	static const uint8_t planar[] = { 0, 1, 2, 1, 3, 4, 1, 1 }, spatial[] = { 0, 1, 3, 3, 6, 9, 1, 1 };
	return shape > QUERN_ID ? 0 : (dim == 2 ? planar : spatial)[shape];
}

size_t quern_field_bytes(const quern_field *field) { return field->shape == QUERN_INDEX ? 4 : 8; }

void quern_store_init(quern_store *store, quern_pool *pool) { *store = (quern_store) { .pool = pool }; }

void quern_store_finish(quern_store *store) {
	if (!store) return;
	for (size_t i = 0; i < store->n_fields; i++)
		for (int copy = 0; copy < 2; copy++)
			for (int k = 0; k < 9; k++) free(store->fields[i].data[copy][k]);
	for (size_t i = 0; i < store->n_sets; i++) {
		free(store->sets[i].block);
		free(store->sets[i].row);
		free(store->sets[i].spare[0]);
		free(store->sets[i].spare[1]);
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

/* Diagonal components of a tensor take `initial`, the others start at zero. */
static double initial_of(const quern_field *field, int component) {
	const bool symmetric = field->shape == QUERN_SYMMETRIC, tensor = field->shape == QUERN_TENSOR;
	const int dim = field->n_components == 3 || field->n_components == 4 ? 2 : 3;
	if (symmetric) return component < dim ? field->initial : 0;
	if (tensor) return component % (dim + 1) == 0 ? field->initial : 0;
	return field->initial;
}

static void *take_column(uint32_t cap, size_t bytes) {
	const size_t size = (((size_t)cap + QUERN_LANES) * bytes + 127) & ~(size_t)63;
	void *column = aligned_alloc(64, size);
	if (column) memset(column, 0, size);
	return column;
}

static bool owns(const quern_field *field, int set) { return field->set == set && !field->local; }

/* Columns of a set always have its capacity, so that they can trade places with the spare ones. */
static quern_status reserve(quern_store *store, int set, uint32_t n) {
	quern_set_store *s = &store->sets[set];
	if (n <= s->cap && s->spare[0]) return QUERN_OK;
	const uint32_t cap = n + n / 4 + 64;
	bool failed = false;
	for (int k = 0; k < 2; k++) {
		free(s->spare[k]);
		s->spare[k] = take_column(cap, k ? 4 : 8);
		failed = failed || !s->spare[k];
	}
	for (size_t i = 0; i < store->n_fields; i++) {
		quern_field *field = &store->fields[i];
		if (!owns(field, set)) continue;
		for (int copy = 0; copy <= field->twice; copy++)
			for (uint8_t k = 0; k < field->n_components; k++) {
				void *column = take_column(cap, quern_field_bytes(field));
				failed = failed || !column;
				if (column && field->data[copy][k])
					memcpy(column, field->data[copy][k], (size_t)s->n * quern_field_bytes(field));
				free(field->data[copy][k]);
				field->data[copy][k] = column;
			}
	}
	store->version++;
	s->cap = failed ? 0 : cap;
	return failed ? QUERN_E_MEMORY : QUERN_OK;
}

typedef struct {
	const quern_field *field;
	const int32_t *from;
	const void *old;
	void *new;
	double initial;
	int64_t first_id;
	uint32_t n;
} permutation;

/* Where an entry comes from: another one, or -1. */
static int32_t source(int32_t from) { return from < -1 ? -2 - from : from; }

static void permute(void *arg, uint32_t chunk, uint32_t worker) {
	const permutation *p = arg;
	const uint32_t begin = chunk * CHUNK, end = begin + CHUNK < p->n ? begin + CHUNK : p->n;
	(void)worker;
	if (p->field->shape == QUERN_INDEX) {
		const int32_t *old = p->old;
		int32_t *new = p->new;
		for (uint32_t i = begin; i < end; i++) {
			const int32_t from = source(p->from[i]);
			new[i] = from >= 0 ? old[from] : (int32_t)p->initial;
		}
	} else if (p->field->shape == QUERN_ID) {
		const int64_t *old = p->old;
		int64_t *new = p->new;
		for (uint32_t i = begin; i < end; i++) new[i] = p->from[i] >= 0 ? old[p->from[i]] : -1;
	} else {
		const double *old = p->old;
		double *new = p->new;
		for (uint32_t i = begin; i < end; i++) {
			const int32_t from = source(p->from[i]);
			new[i] = from >= 0 ? old[from] : p->initial;
		}
	}
}

/* New ids count on in the order of the new entries: the same for any number of workers. */
static void number_new(quern_set_store *s, int64_t *id, uint32_t n) {
	for (uint32_t i = 0; i < n; i++)
		if (id[i] < 0) id[i] = s->next_id++;
}

quern_status quern_store_partition(quern_store *store, int set, uint32_t n_blocks, const uint32_t *block) {
	quern_set_store *s = &store->sets[set];
	if (!block) {
		s->n_blocks = 0;
		return QUERN_OK;
	}
	if (n_blocks + 1 > s->block_cap) {
		uint32_t *grown = realloc(s->block, ((size_t)n_blocks + 64) * 2 * sizeof(uint32_t));
		if (!grown) return QUERN_E_MEMORY;
		s->block = grown;
		s->block_cap = (n_blocks + 64) * 2;
	}
	memmove(s->block, block, ((size_t)n_blocks + 1) * sizeof(uint32_t));
	s->n_blocks = n_blocks;
	return QUERN_OK;
}

static quern_status drop(quern_store *store, int set, const bool *gone);

/* Every index into `target` follows inverse[old] = new; entries that lost their target go. */
static quern_status follow(quern_store *store, int target, const int32_t *inverse) {
	for (size_t s = 0; s < store->n_sets; s++) {
		const uint32_t n = store->sets[s].n;
		bool *gone = NULL;
		for (size_t i = 0; i < store->n_fields; i++) {
			quern_field *field = &store->fields[i];
			if (!owns(field, (int)s) || field->shape != QUERN_INDEX || field->target != target) continue;
			int32_t *index = field->data[field->now][0];
			for (uint32_t k = 0; k < n; k++) {
				index[k] = inverse[index[k]];
				if (index[k] >= 0) continue;
				if (!gone) gone = calloc(n, sizeof(bool));
				if (!gone) return QUERN_E_MEMORY;
				gone[k] = true;
			}
		}
		const quern_status status = gone ? drop(store, (int)s, gone) : QUERN_OK;
		free(gone);
		if (status != QUERN_OK) return status;
	}
	return QUERN_OK;
}

static quern_status drop(quern_store *store, int set, const bool *gone) {
	quern_set_store *s = &store->sets[set];
	int32_t *from = malloc((size_t)s->n * sizeof(int32_t) + 4);
	uint32_t *block = s->n_blocks ? malloc(((size_t)s->n_blocks + 1) * sizeof(uint32_t)) : NULL;
	if (!from || (s->n_blocks && !block)) return free(from), free(block), QUERN_E_MEMORY;
	uint32_t n = 0, b = 0;
	for (uint32_t i = 0; i < s->n; i++) {
		while (block && b < s->n_blocks && s->block[b] <= i) block[b++] = n;
		if (!gone[i]) from[n++] = (int32_t)i;
	}
	for (; block && b <= s->n_blocks; b++) block[b] = n;
	const quern_status status = quern_store_remap(store, set, n, from, s->n_blocks, block);
	free(from);
	free(block);
	return status;
}

static bool is_target(const quern_store *store, int set) {
	for (size_t i = 0; i < store->n_fields; i++)
		if (store->fields[i].target == set && !store->fields[i].local) return true;
	return false;
}

quern_status quern_store_remap(
	quern_store *store, int set, uint32_t n, const int32_t *from, uint32_t n_blocks, const uint32_t *block) {
	const uint32_t old_n = store->sets[set].n;
	quern_status status = reserve(store, set, n > old_n ? n : old_n);
	if (status != QUERN_OK) return status;
	quern_set_store *s = &store->sets[set];
	const uint32_t chunks = (n + CHUNK - 1) / CHUNK;
	for (size_t i = 0; i < store->n_fields; i++) {
		quern_field *field = &store->fields[i];
		if (!owns(field, set)) continue;
		const int spare = field->shape == QUERN_INDEX;
		for (uint8_t k = 0; k < field->n_components; k++) {
			void **column = &field->data[field->now][k];
			permutation p = { field, from, *column, s->spare[spare], initial_of(field, k), s->next_id, n };
			quern_pool_each(store->pool, chunks, permute, &p);
			s->spare[spare] = *column;
			*column = p.new;
			if (field->shape == QUERN_ID) number_new(s, *column, n);
		}
	}
	s->n = n;
	store->version++;
	status = quern_store_partition(store, set, n_blocks, block);
	if (status != QUERN_OK || !is_target(store, set)) return status;
	int32_t *inverse = malloc((size_t)old_n * sizeof(int32_t) + 4);
	if (!inverse) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < old_n; i++) inverse[i] = -1;
	for (uint32_t i = 0; i < n; i++)
		if (from[i] >= 0) inverse[from[i]] = (int32_t)i;
	status = follow(store, set, inverse);
	free(inverse);
	return status;
}

quern_status quern_store_fill(quern_store *store, int set, uint32_t n) {
	int32_t *from = malloc((size_t)n * sizeof(int32_t) + 4);
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) from[i] = -1;
	const quern_status status = quern_store_remap(store, set, n, from, 0, NULL);
	free(from);
	return status;
}

quern_status quern_store_rows(quern_store *store, int set, uint32_t n) {
	quern_set_store *s = &store->sets[set];
	if (n > s->cap) {
		free(s->row);
		s->cap = n + n / 4 + 64;
		s->row = aligned_alloc(64, (size_t)s->cap * 64);
		if (!s->row) return s->cap = 0, QUERN_E_MEMORY;
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
		bytes += store->sets[i].rows ? (size_t)store->sets[i].cap * 64 : (size_t)store->sets[i].cap * 12;
	return bytes;
}
