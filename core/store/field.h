/* SPDX-License-Identifier: MIT */
/* field - sets of entities and their columns: allocated, carried, reordered, and nothing else; what a column means is
 * for the plugins to know */
#pragma once
#include "pool.h"
#include <quern/abi.h>
#include <quern/solver.h>

typedef struct quern_field {
	char name[56]; /* SET.NAME */
	const char *unit, *doc;
	int set, target; /* indices of sets; target -1 unless INDEX into one */
	uint8_t shape, n_components, rule;
	bool twice;    /* read from one copy, written to the other, then swapped */
	bool state;    /* a step goes on from it */
	bool settles;  /* changed while settling */
	bool kept;     /* checkpointed: state, and what is looked at between steps */
	bool local;    /* born and used up within one stage: a worker's scratch, no memory here */
	bool shown;    /* in every frame */
	uint32_t lane; /* of a row set */
	double initial;
	void *data[2][9];
	uint8_t now; /* which copy is current */
} quern_field;

typedef struct quern_set_store {
	char name[24];
	uint32_t n, cap, rows, lanes;
	uint32_t n_blocks, block_cap;
	uint32_t *block;
	uint32_t *by_place, *entry; /* see quern_parts */
	quern_parts parts;          /* as it was asked for last */
	double *row;                /* of a row set: n rows of 8 */
	int64_t next_id;
	void *columns;          /* where those of all fields and the spare one lie */
	void *spare;            /* of 8 bytes: the other half of a reordering */
	bool grid;              /* entries belong to grid blocks: cells and nodes */
	const quern_set *table; /* the solver's row; NULL: the host's own */
	int64_t stepped;        /* steps of entries so far, where the row says that they are counted */
} quern_set_store;

typedef struct quern_store {
	quern_set_store *sets;
	quern_field *fields;
	size_t n_sets, n_fields, sets_capacity, fields_capacity;
	quern_pool *pool;
	uint64_t version; /* grows whenever a column may have moved */
} quern_store;

size_t quern_field_bytes(const quern_field *); /* of one component of one entry */

/* A set as people call it: its plural. */
const char *quern_set_plural(const quern_set_store *);
bool quern_set_is_counted(const quern_set_store *);

void quern_store_init(quern_store *, quern_pool *);
void quern_store_finish(quern_store *);
int quern_store_set(const quern_store *, const char *name);   /* -1: none */
int quern_store_field(const quern_store *, const char *name); /* -1: none */
quern_column quern_field_column(const quern_store *, const quern_field *, uint8_t copy);

/* All that follow return QUERN_E_MEMORY if memory is gone, and leave a store that can be looked at and saved: what it
 * was, but that entries whose target is gone may still be there with QUERN_NO_TARGET. */

/* A set of n entries at their initial values; ids are numbered on. Old contents are lost. */
quern_status quern_store_fill(quern_store *, int set, uint32_t n);
/* New entry i is old entry from[i], or fresh if from[i] < 0; block may be NULL. See quern_host.remap. */
quern_status quern_store_remap(
	quern_store *, int set, uint32_t n, const int32_t *from, uint32_t n_blocks, const uint32_t *block);
/* Rows are transient: they are made to fit and hold zeros. */
quern_status quern_store_rows(quern_store *, int set, uint32_t n);
quern_status quern_store_partition(quern_store *, int set, uint32_t n_blocks, const uint32_t *block);
/* The order of the places of a set's blocks, as quern_host.arrange takes it; it goes when the set is cut anew. QUERN_E_FIELD: it is none. */
quern_status quern_store_arrange(quern_store *, int set, const uint32_t *by_place);
const quern_parts *quern_store_parts(quern_store *, int set);
/* As quern_host.give. */
void quern_store_give(quern_store *, int set, uint32_t from, int32_t to, double part, double share);
/* As quern_host.sum_set. */
double quern_store_sum(const quern_store *, int set, const double *);
size_t quern_store_bytes(const quern_store *);
