/* SPDX-License-Identifier: MIT */
/* split - a round's indices in shares that take as long as each other, by what rounds of as many indices took so far */
#pragma once
#include <stdint.h>

enum { QUERN_SPLIT_WORKERS = 256 }; /* at most */

typedef struct quern_splits quern_splits;

/* NULL if there is no memory. */
quern_splits *quern_splits_create(uint32_t workers);
void quern_splits_destroy(quern_splits *);

/* Where shares begin in a round of n indices, one more for the end: `workers` + 1 numbers, until the next call. In the first rounds of as
 * many shares are equal, or as those of a length much like it; they stay as they are where that is good enough. */
const uint32_t *quern_splits_begin(quern_splits *, uint32_t n);

/* What each share of that round took, in any unit. */
void quern_splits_took(quern_splits *, const uint64_t *took);
