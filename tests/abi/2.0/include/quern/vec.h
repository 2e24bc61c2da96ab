/* SPDX-License-Identifier: MIT */
/* quern/vec.h - small vectors by value. A struct of scalars, never an array: loops over it vectorise. In 2-D z stays
 * zero, and `dim` is a constant in every caller, so what a plane does not need vanishes. */
#pragma once
#include <quern/abi.h>

typedef struct quern_vec {
	quern_real x, y, z;
} quern_vec;

/* Entry i of a vector column. Macros, because what a QUERN_SIMD loop promises about memory does not reach into the
 * functions it calls: clang then compares every pointer with every other, and gives up when there are many. */
#define QUERN_VEC_AT(columns, i, dim)                                                                        \
	QUERN_VALUE(quern_vec, (columns)[0][i], (columns)[1][i], (dim) == 3 ? (columns)[2][i] : 0)
/* The vector that an array of three holds. */
#define QUERN_VEC_OF(array) QUERN_VALUE(quern_vec, (array)[0], (array)[1], (array)[2])
#define QUERN_VEC_PUT(columns, i, v, dim)                                                                    \
	do {                                                                                                     \
		(columns)[0][i] = (v).x;                                                                             \
		(columns)[1][i] = (v).y;                                                                             \
		if ((dim) == 3) (columns)[2][i] = (v).z;                                                             \
	} while (0)

QUERN_INLINE quern_vec quern_vec_add(quern_vec a, quern_vec b) {
	return QUERN_VALUE(quern_vec, a.x + b.x, a.y + b.y, a.z + b.z);
}
QUERN_INLINE quern_vec quern_vec_sub(quern_vec a, quern_vec b) {
	return QUERN_VALUE(quern_vec, a.x - b.x, a.y - b.y, a.z - b.z);
}
QUERN_INLINE quern_vec quern_vec_scale(quern_real s, quern_vec a) {
	return QUERN_VALUE(quern_vec, s * a.x, s * a.y, s * a.z);
}
/* s a + b */
QUERN_INLINE quern_vec quern_vec_axpy(quern_real s, quern_vec a, quern_vec b) {
	return QUERN_VALUE(quern_vec, s * a.x + b.x, s * a.y + b.y, s * a.z + b.z);
}
QUERN_INLINE quern_real quern_vec_dot(quern_vec a, quern_vec b, int dim) {
	const quern_real plane = a.x * b.x + a.y * b.y;
	return dim == 3 ? plane + a.z * b.z : plane;
}
QUERN_INLINE quern_vec quern_vec_cross(quern_vec a, quern_vec b) {
	return QUERN_VALUE(quern_vec, a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
/* A row-major matrix times a vector, and its transpose times a vector: with a pose's turn, from body to scene and
 * back. */
QUERN_INLINE quern_vec quern_vec_turn(const quern_real m[9], quern_vec a) {
	return QUERN_VALUE(quern_vec, m[0] * a.x + m[1] * a.y + m[2] * a.z, m[3] * a.x + m[4] * a.y + m[5] * a.z,
		m[6] * a.x + m[7] * a.y + m[8] * a.z);
}
QUERN_INLINE quern_vec quern_vec_turn_back(const quern_real m[9], quern_vec a) {
	return QUERN_VALUE(quern_vec, m[0] * a.x + m[3] * a.y + m[6] * a.z, m[1] * a.x + m[4] * a.y + m[7] * a.z,
		m[2] * a.x + m[5] * a.y + m[8] * a.z);
}
