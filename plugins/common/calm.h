/* SPDX-License-Identifier: MIT */
/* calm - where material is at rest, motion below the grid is stopped; where it flows, it is left alone. For points and grains
 * alike, block by block, so that the momentum of each block stays. docs/theory/hybrid.md, section 2 */
#pragma once
#include "cloud.h"
#include "stencil.h"

typedef struct calm {
	quern_real rate;  /* 1/s: sheared much more slowly, material is at rest; 0: none ever is */
	quern_real share; /* of what lies below the grid, that a step takes at rest */
	/* by particle, of this step: what is taken of it, 0 where nothing is; m/s that the grid's velocity differs by */
	quern_real *part, *lag[3];
} calm;

static inline quern_status calm_init(calm *c, const quern_step *s, uint32_t n) {
	if (!(c->rate > 0)) return QUERN_OK;
	c->part = s->host->memory(s->run, ((size_t)n + 1) * sizeof(quern_real));
	bool good = c->part;
	for (uint32_t k = 0; k < s->dim && good; k++)
		good = (c->lag[k] = s->host->memory(s->run, ((size_t)n + 1) * sizeof(quern_real)));
	return good ? QUERN_OK : QUERN_E_MEMORY;
}

/* 2 D : D */
QUERN_INLINE quern_real calm_shear(quern_real gradient[9][STENCIL], uint32_t i, const uint32_t dim) {
	quern_real sum = 0;
	for (uint32_t a = 0; a < dim; a++)
		for (uint32_t b = 0; b < dim; b++) {
			const quern_real d = 0.5 * (gradient[dim * a + b][i] + gradient[dim * b + a][i]);
			sum += 2 * d * d;
		}
	return sum;
}

/* Particle i, entry `to`, whose grid has this gradient, by component, and velocity there. */
QUERN_INLINE void calm_note(const calm *c, uint32_t i, uint32_t to, quern_real gradient[9][STENCIL],
	quern_real pic[3][STENCIL], quern_real *const velocity[3], const uint32_t dim) {
	const quern_real square = calm_shear(gradient, i, dim) / (c->rate * c->rate), fast = 1 + square * square;
	c->part[to] = c->share / (fast * fast);
	for (uint32_t k = 0; k < dim; k++) c->lag[k][to] = pic[k][i] - velocity[k][to];
}

/* Those of a block; `entry` NULL: the n from the first on. */
QUERN_INLINE void calm_block(const calm *c, const cloud *of, const int32_t *entry, uint32_t first, uint32_t n,
	quern_real *const velocity[3], const uint32_t dim) {
	quern_real whole = 0, mean[3] = { 0 };
	for (uint32_t q = 0; q < n; q++) {
		const uint32_t i = entry ? (uint32_t)entry[q] : first + q;
		const quern_real mass = cloud_mass(of, i) * c->part[i];
		whole += mass;
		for (uint32_t k = 0; k < dim; k++) mean[k] += mass * c->lag[k][i];
	}
	for (uint32_t k = 0; k < dim; k++) mean[k] = whole > 0 ? mean[k] / whole : 0;
	for (uint32_t q = 0; q < n; q++) {
		const uint32_t i = entry ? (uint32_t)entry[q] : first + q;
		for (uint32_t k = 0; k < dim; k++) velocity[k][i] += c->part[i] * (c->lag[k][i] - mean[k]);
	}
}
