/* SPDX-License-Identifier: MIT */
/* cover - which grid blocks the material needs, and points in the order of blocks and cells */
#pragma once
#include <quern/grid.h>
#include <quern/solver.h>

typedef struct cover {
	quern_column point, grain; /* positions; grain.real[0] NULL: points alone count */
	uint32_t n_grains;
	/* Blocks that were asked for before stay if this says so (their cells hold state); NULL: they go with the
	 * material. */
	bool (*holds)(const void *arg, uint32_t block);
	const void *arg;
} cover;

/* Brings points back through periodic faces, makes the grid cover all material, and sorts points by block and cell.
 * The set "point" is partitioned by grid block afterwards. */
quern_status quern_cover_sort(const quern_step *, const cover *);
