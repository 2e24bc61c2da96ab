/* SPDX-License-Identifier: MIT */
/* quern/columns.h - columns of whatever shape, for who calls plugins with parts of a set: from an entry on, or gathered by a list
 * and scattered again */
#pragma once
#include <quern/abi.h>

/* Columns of a batch that begins at entry `first` of the whole set. */
QUERN_INLINE quern_column quern_column_from(quern_column c, uint8_t shape, uint32_t first) {
	if (shape == QUERN_INDEX) {
		if (c.index) c.index += first;
	} else if (shape == QUERN_ID) {
		if (c.id) c.id += first;
	} else
		for (int k = 0; k < 9; k++)
			if (c.real[k]) c.real[k] += first;
	return c;
}

/* How many components a field of this shape has. */
QUERN_INLINE uint32_t quern_shape_size(uint8_t shape, uint32_t dim) {
	const uint32_t planar[] = { 0, 1, 2, 1, 3, 4, 1, 1 }, spatial[] = { 0, 1, 3, 3, 6, 9, 1, 1 };
	return shape > QUERN_ID ? 0 : (dim == 2 ? planar : spatial)[shape];
}

/* What a component of a new entry is: a row's `initial` is the diagonal's of SYMMETRIC and TENSOR, beside which they are 0. */
QUERN_INLINE quern_real quern_shape_initial(
	uint8_t shape, uint32_t dim, uint32_t component, quern_real initial) {
	const bool beside =
		(shape == QUERN_TENSOR && component % (dim + 1)) || (shape == QUERN_SYMMETRIC && component >= dim);
	return beside ? 0 : initial;
}

/* A column by its number, of whatever kind. */
static inline void *quern_component(const quern_column *c, uint8_t shape, uint32_t k) {
	if (shape == QUERN_INDEX) return c->index;
	if (shape == QUERN_ID) return c->id;
	return c->real[k];
}
static inline void quern_set_component(quern_column *c, uint8_t shape, uint32_t k, void *column) {
	if (shape == QUERN_INDEX) c->index = (int32_t *)column;
	else if (shape == QUERN_ID) c->id = (int64_t *)column;
	else c->real[k] = (quern_real *)column;
}

/* to[q] = from[begin + at[q]] */
static inline void quern_gather(
	uint8_t shape, void *to, const void *from, uint32_t begin, const int32_t *__restrict at, uint32_t n) {
	if (shape == QUERN_INDEX) {
		const int32_t *whole = (const int32_t *)from + begin;
		for (uint32_t q = 0; q < n; q++) ((int32_t *)to)[q] = whole[at[q]];
	} else if (shape == QUERN_ID) {
		const int64_t *whole = (const int64_t *)from + begin;
		for (uint32_t q = 0; q < n; q++) ((int64_t *)to)[q] = whole[at[q]];
	} else {
		const quern_real *__restrict whole = (const quern_real *)from + begin;
		quern_real *__restrict mine = (quern_real *)to;
		for (uint32_t q = 0; q < n; q++) mine[q] = whole[at[q]];
	}
}
/* to[begin + at[q]] = from[q]; an ID is the host's to give. */
static inline void quern_scatter(
	uint8_t shape, void *to, const void *from, uint32_t begin, const int32_t *__restrict at, uint32_t n) {
	if (shape == QUERN_INDEX) {
		int32_t *whole = (int32_t *)to + begin;
		for (uint32_t q = 0; q < n; q++) whole[at[q]] = ((const int32_t *)from)[q];
	} else if (shape != QUERN_ID) {
		quern_real *__restrict whole = (quern_real *)to + begin;
		const quern_real *__restrict mine = (const quern_real *)from;
		for (uint32_t q = 0; q < n; q++) whole[at[q]] = mine[q];
	}
}
