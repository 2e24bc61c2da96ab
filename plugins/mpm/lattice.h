/* SPDX-License-Identifier: MIT */
/* lattice - the places of points in a box: as many per axis as the cell and `points` say */
#pragma once
#include "mpm.h"

enum { MOST_POINTS = 1 << 30 };

typedef struct lattice {
	uint32_t count[3], n;
	quern_real spacing[3], wanted; /* how many points it would be, whether or not they can be counted */
} lattice;

static inline lattice lattice_of(const mpm *p, const quern_real lower[3], const quern_real upper[3]) {
	lattice l = { .count = { 1, 1, 1 }, .n = 1, .wanted = 1 };
	for (uint32_t k = 0; k < p->dim; k++) {
		const quern_real extent = upper[k] - lower[k], wanted = extent / p->cell * p->points;
		l.wanted *= wanted > 1 ? wanted : 1;
		if (l.wanted > MOST_POINTS) continue;
		l.count[k] = wanted > 1 ? (uint32_t)(wanted + 0.5) : 1;
		l.spacing[k] = extent / l.count[k];
		l.n *= l.count[k];
	}
	return l;
}

/* m^dim of one point. */
static inline quern_real lattice_volume(const lattice *l, uint32_t dim) {
	quern_real volume = 1;
	for (uint32_t k = 0; k < dim; k++) volume *= l->spacing[k];
	return volume;
}

static inline void lattice_place(
	const lattice *l, const quern_real lower[3], uint32_t i, uint32_t dim, quern_real x[3]) {
	const uint32_t at[3] = { i % l->count[0], i / l->count[0] % l->count[1],
		i / (l->count[0] * l->count[1]) };
	for (uint32_t k = 0; k < dim; k++) x[k] = lower[k] + (at[k] + 0.5) * l->spacing[k];
}
