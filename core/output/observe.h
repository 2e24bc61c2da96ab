/* SPDX-License-Identifier: MIT */
/* observe - asks the scene's observers, keeps series.csv and what the summary says of each column */
#pragma once
#include "run.h"

typedef struct quern_observed {
	char *name, *unit;  /* "energy.damped", "J" */
	const char *output; /* "damped"; NULL: of no observer */
	size_t observer;    /* in the scene's list */
	double first, last, least, most, sum;
	int64_t n;
} quern_observed;

typedef struct quern_series {
	quern_observed *column;
	size_t n, capacity;
	uint32_t *n_outputs; /* by observer: columns that are its own */
	int64_t rows;
	char *path; /* NULL: nothing is written */
} quern_series;

const char *quern_observer_label(const quern_run *, size_t observer);

/* A series with the columns of the run's observers. `rows` > 0 goes on after so many rows of DIR/series.csv: later
 * ones are cut off, and the statistics are made again from those kept. QUERN_E_IO with run->message if the file cannot be
 * written, QUERN_E_PARAM if it does not hold the rows. */
quern_status quern_series_init(quern_series *, quern_run *, int64_t rows);
void quern_series_finish(quern_series *);
/* The rows so far are on the disk. */
quern_status quern_series_flush(const quern_series *, quern_run *);
/* One row, of the state as it is. A number that is not finite ends the run instead: QUERN_E_NUMERIC. */
quern_status quern_series_add(quern_series *, quern_run *);
