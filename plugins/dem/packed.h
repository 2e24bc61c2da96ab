/* SPDX-License-Identifier: MIT */
/* packed - what contacts ask of grains, in rows made anew in every step: a contact reads two rows of each grain where columns
 * would have it read ten numbers in ten places, which for a partner in another block are as many waits for memory */
#pragma once
#include "forces.h"

/* Place and motion. 3-D: x y z r; vx vy vz m, wx wy wz 0. 2-D: x y r m; vx vy w 0. The mass of a fixed grain has a minus sign. */
QUERN_INLINE size_t packed_motions(int dim) { return dim == 3 ? 2 : 1; }

/* Four rows become four columns. */
QUERN_INLINE void packed_turn(const lanes4 row[4], lanes4 column[4]) {
	const lanes4 a = __builtin_shufflevector(row[0], row[1], 0, 4, 2, 6),
				 b = __builtin_shufflevector(row[0], row[1], 1, 5, 3, 7),
				 c = __builtin_shufflevector(row[2], row[3], 0, 4, 2, 6),
				 d = __builtin_shufflevector(row[2], row[3], 1, 5, 3, 7);
	column[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
	column[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
	column[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
	column[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

/* The rows at four places, `stride` apart, and their columns. */
QUERN_INLINE void packed_rows(const lanes4 *from, size_t stride, const int32_t *at, lanes4 row[4]) {
	for (int k = 0; k < 4; k++) row[k] = from[(size_t)at[k] * stride];
}
QUERN_INLINE void packed_columns(const lanes4 *from, size_t stride, const int32_t *at, lanes4 column[4]) {
	lanes4 row[4];
	packed_rows(from, stride, at, row);
	packed_turn(row, column);
}
/* Four numbers of a column of the set, from any entry on. */
typedef quern_real lanes4_anywhere __attribute__((vector_size(32), aligned(8)));
QUERN_INLINE const lanes4_anywhere *packed_anywhere(const quern_real *from) {
	return (const lanes4_anywhere *)(const void *)from;
}
/* Four numbers of a column, or half of a row. */
QUERN_INLINE const lanes4 *packed_at(const quern_real *from) { return (const lanes4 *)(const void *)from; }
QUERN_INLINE void packed_put(quern_real *to, const lanes4 *column) { *(lanes4 *)(void *)to = *column; }
