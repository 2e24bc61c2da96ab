/* SPDX-License-Identifier: MIT */
/* sort - a counting sort, and on it a stable sort of keys, as the order that remap() takes */
#pragma once
#include <quern/abi.h>

/* Lists 0 .. n - 1 by bucket, within each in `order`; NULL: in their own. Those of bucket b stand in `list` from begin[b] to
 * begin[b + 1]; whoever has a negative bucket is in none. `begin` holds n_buckets + 2 zeros at first. */
static inline void quern_bucket(uint32_t n, const int32_t *bucket, const uint32_t *order, uint32_t n_buckets,
	uint32_t *begin, int32_t *list) {
	for (uint32_t i = 0; i < n; i++)
		if (bucket[i] >= 0) begin[bucket[i] + 2]++;
	for (uint32_t b = 0; b < n_buckets; b++) begin[b + 2] += begin[b + 1];
	for (uint32_t q = 0; q < n; q++) {
		const uint32_t i = quern_nth(order, q);
		if (bucket[i] >= 0) list[begin[bucket[i] + 1]++] = (int32_t)i;
	}
}

enum { SORT_BITS = 11, SORT_DIGITS = 1 << SORT_BITS };

/* Bytes of `work` for n keys. */
static inline size_t quern_sort_bytes(uint32_t n) { return 3 * (size_t)n * sizeof(int32_t); }

/* from[i] becomes the index of the i-th smallest key, ties in `order`; NULL: in the old one. Radix by digits of 11 bits from the lowest
 * on, and only by those in which keys differ. */
static inline void quern_sort_order(
	uint32_t n, const uint64_t *key, const uint32_t *order, int32_t *from, void *work) {
	int32_t *digit = work, *list = digit + n, *before = list + n;
	uint64_t differ = 0;
	for (uint32_t i = 0; i < n; i++) {
		from[i] = (int32_t)quern_nth(order, i);
		differ |= key[i] ^ key[0];
	}
	for (int shift = 0; shift < 64; shift += SORT_BITS) {
		if (!(differ >> shift & (SORT_DIGITS - 1))) continue;
		for (uint32_t i = 0; i < n; i++) {
			before[i] = from[i];
			digit[i] = (int32_t)(key[from[i]] >> shift & (SORT_DIGITS - 1));
		}
		uint32_t begin[SORT_DIGITS + 2] = { 0 };
		quern_bucket(n, digit, NULL, SORT_DIGITS, begin, list);
		for (uint32_t i = 0; i < n; i++) from[i] = before[list[i]];
	}
}
