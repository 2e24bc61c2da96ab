/* tools - what several solvers need and no plugin author would miss */
#pragma once
#include <quern/abi.h>

/* A row of a use table: field, unit, access, shape, and then designated members as wanted. */
#define F(field_, unit_, access_, ...)                                                                       \
	{ .field = field_, .unit = unit_, .access = access_, .shape = __VA_ARGS__ }

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

QUERN_INLINE uint32_t quern_shape_size(uint8_t shape, uint32_t dim) {
	const uint32_t planar[] = { 0, 1, 2, 1, 3, 4, 1, 1 }, spatial[] = { 0, 1, 3, 3, 6, 9, 1, 1 };
	return (dim == 2 ? planar : spatial)[shape];
}
