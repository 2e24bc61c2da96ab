/* SPDX-License-Identifier: MIT */
/* quern/neighbours.h - the kind `neighbours`: sort keys, then the candidate pairs of one block */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct quern_pair {
	int32_t first, second;
} quern_pair;

typedef struct quern_neighbour_job {
	uint32_t n, dim;
	const quern_real *position[3], *radius;
	quern_real largest;            /* m, largest radius */
	quern_real reach;              /* m beyond touching: skin plus the laws' reach */
	quern_real lower[3], upper[3]; /* m, the domain; matters along periodic axes */
	bool periodic[3];
	uint32_t n_blocks; /* after `keys`: the partition of the sorted grains */
	const uint32_t *block;
	void *memory; /* zeroed, as many bytes as `keys` asked for */
} quern_neighbour_job;

typedef struct quern_neighbour_ops {
	uint32_t size, pad;
	/* [stage] A key per grain: the block in the high 32 bits, the place inside it in the low ones. The solver
	 * sorts grains by key, ties in the old order. Returns the bytes of memory wanted by the other two. */
	size_t (*keys)(const void *self, const quern_neighbour_job *, uint64_t *key);
	void (*index)(const void *self, const quern_neighbour_job *); /* [stage] after the sort; may be NULL */
	/* [batch] Every pair of distinct grains closer than r1 + r2 + reach with at least one of them in block b,
	 * each once, `first` in block b, in any order. Returns how many there are; writes at most `cap`. */
	uint32_t (*pairs)(const void *self, const quern_neighbour_job *, uint32_t b, uint32_t cap, quern_pair *);
} quern_neighbour_ops;

QUERN_KIND(neighbours, quern_neighbour_ops, "Which pairs of grains may be close.",
	QUERN_ONE(quern_neighbour_ops, keys), QUERN_OPTIONALLY(quern_neighbour_ops, index),
	QUERN_ONE(quern_neighbour_ops, pairs));

#ifdef __cplusplus
}
#endif
