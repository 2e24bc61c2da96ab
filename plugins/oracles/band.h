/* SPDX-License-Identifier: MIT */
/* band - the hybrid zone as a band at a depth below a surface: what oracles that mark one have in common */
#pragma once
#include <quern/oracle.h>

typedef struct oracle_band {
	quern_real depth, half_width, cell; /* m */
} oracle_band;

/* Rows for a member `band`, of which `text` says what its depth is. */
#define BAND_PARAMS(T, text)                                                                                 \
	QUERN_PARAM_AS(T, band.depth, "depth", "m", text, .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6), \
		QUERN_PARAM_AS(T, band.half_width, "half_width", "m",                                                \
			"Half the width of the hybrid zone; a cell at least.", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, \
			.max = 1e6),                                                                                     \
		QUERN_PARAM_AS(T, band.cell, "cell", "m", "Cell of the grid.", .from = "grid.cell",                  \
			.flags = QUERN_MAYBE | QUERN_ADVANCED)

/* `where` grains must be left. */
static inline quern_status band_check(
	const oracle_band *z, const quern_setup *setup, quern_err *err, const char *where) {
	if (z->half_width < (1 - 1e-9) * z->cell)
		return setup->host->fail(err, QUERN_E_PARAM, "half_width",
			"must be a cell at least, %.4g m: a narrower zone is none in places", z->cell);
	if (z->depth > z->half_width) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, "half_width",
		"must be less than the depth, %.4g m: grains must be left %s", z->depth, where);
}

/* All below is continuum. */
static inline quern_real band_reach(const oracle_band *z) { return z->depth + z->half_width; }

static inline void band_decide(const oracle_band *z, const quern_cell_batch *b) {
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real d = b->distance[i] - z->depth;
		b->wish[i] = d < -z->half_width   ? QUERN_DISCRETE
					 : d <= z->half_width ? QUERN_HYBRID
										  : QUERN_CONTINUUM;
	}
}
