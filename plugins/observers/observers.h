/* SPDX-License-Identifier: MIT */
/* observers - what several observers look at: the grains and points that are carried, and how much of each */
#pragma once
#include "../common/tools.h"
#include <quern/observer.h>

/* The first rows of every observer of both clouds, in this order. */
#define CLOUD_USES                                                                                           \
	F("grain.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL),                                \
		F("grain.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL),                           \
		F("grain.fixed", "1", QUERN_READ, QUERN_INDEX, .flags = QUERN_OPTIONAL),                             \
		F("point.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL),                            \
		F("point.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL)
enum { GRAIN_MASS, GRAIN_WEIGHT, GRAIN_FIXED, POINT_MASS, POINT_WEIGHT, CLOUD_ROWS };

/* kg that grain or point i carries; 0 for a fixed grain. */
QUERN_INLINE quern_real carried(const quern_observer_batch *b, bool point, uint32_t i) {
	const quern_column *u = b->use;
	const quern_real *weight = u[point ? POINT_WEIGHT : GRAIN_WEIGHT].real[0];
	if (!point && u[GRAIN_FIXED].index && u[GRAIN_FIXED].index[i]) return 0;
	return (weight ? weight[i] : 1) * u[point ? POINT_MASS : GRAIN_MASS].real[0][i];
}
/* Entries of a cloud; 0 if this scene has none. */
QUERN_INLINE uint32_t cloud_size(const quern_observer_batch *b, bool point) {
	return b->use[point ? POINT_MASS : GRAIN_MASS].real[0] ? b->count[point ? POINT_MASS : GRAIN_MASS] : 0;
}

/* Sum over a cloud of mass times value(i); NaN if memory is gone, which stops the run. */
#define CLOUD_SUM(batch, host, run, point, i, value, out)                                                    \
	do {                                                                                                     \
		const uint32_t n_ = cloud_size(batch, point);                                                        \
		quern_real *term_ = (host)->memory(run, ((size_t)n_ + 1) * sizeof(quern_real));                      \
		if (!term_) return QUERN_E_MEMORY;                                                                   \
		for (uint32_t i = 0; i < n_; i++) term_[i] = carried(batch, point, i) * (value);                     \
		(out) += (host)->sum(run, n_, term_);                                                                \
	} while (0)
