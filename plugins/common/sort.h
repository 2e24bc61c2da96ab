/* SPDX-License-Identifier: MIT */
/* sort - a stable sort of keys, as the order that remap() takes */
#pragma once
#include <stddef.h>
#include <stdint.h>

/* from[i] becomes the index of the i-th smallest key, ties in the old order; `work` holds 2 n keys and n indices.
 * Radix by bytes, and only over those bytes in which keys differ. */
static inline void quern_sort_order(uint32_t n, const uint64_t *key, int32_t *from, uint64_t *work) {
	uint64_t *a = work, *b = work + n, all_and = ~(uint64_t)0, all_or = 0;
	int32_t *x = from, *y = (int32_t *)(void *)(work + 2 * (size_t)n);
	for (uint32_t i = 0; i < n; i++) {
		a[i] = key[i];
		x[i] = (int32_t)i;
		all_and &= key[i];
		all_or |= key[i];
	}
	for (int shift = 0; shift < 64; shift += 11) {
		uint32_t count[2049] = { 0 };
		if (!((all_and ^ all_or) >> shift & 2047)) continue;
		for (uint32_t i = 0; i < n; i++) count[(a[i] >> shift & 2047) + 1]++;
		for (int k = 0; k < 2048; k++) count[k + 1] += count[k];
		for (uint32_t i = 0; i < n; i++) {
			const uint32_t to = count[a[i] >> shift & 2047]++;
			b[to] = a[i];
			y[to] = x[i];
		}
		uint64_t *swap = a;
		a = b;
		b = swap;
		int32_t *turn = x;
		x = y;
		y = turn;
	}
	if (x != from)
		for (uint32_t i = 0; i < n; i++) from[i] = x[i];
}

/* Bytes of `work` for n keys. */
static inline size_t quern_sort_bytes(uint32_t n) {
	return ((size_t)n + 1) * (2 * sizeof(uint64_t) + sizeof(int32_t));
}
