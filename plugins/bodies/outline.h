/* SPDX-License-Identifier: MIT */
/* outline - the edges of a polygon, and the chains of them that a grain touches in one place: docs/theory/bodies.md */
#pragma once
#include <quern/abi.h>

typedef enum {
	OUTLINE_CROSSES = 1, /* two of its edges meet away from a common corner */
	OUTLINE_FLAT,        /* it holds no area */
	OUTLINE_DOUBLE,      /* two corners that follow each other are one */
	OUTLINE_MEMORY
} outline_fault;

/* From its corner on, counterclockwise. */
typedef struct outline_edge {
	quern_real corner[2], along[2], out[2]; /* m; unit vectors along it and out of the polygon */
	quern_real length;                      /* m */
	quern_real between
		[2]; /* unit: the mean of `out` here and of the edge before; what lies on its side is outside */
	int32_t chain, at_corner; /* chains of the edge, and of its corner; -1: no grain touches that */
	int32_t inner;            /* its corner is an inside one between two chains */
	int32_t pad;
} outline_edge;

typedef struct outline {
	outline_edge *edge;
	uint32_t n, n_chains;
	quern_real lower[2], upper[2];
} outline;

/* n corners x, y, either way round. On a fault, what = the numbers of the corners at fault; nothing is kept then. */
outline_fault outline_create(uint32_t n, const quern_real (*corner)[2], outline *, uint32_t what[2]);
void outline_destroy(outline *);
