/* observe - asks the scene's observers, keeps series.csv and what the summary says of each column */
#pragma once
#include "run.h"

typedef struct quern_observed {
	char *name, *unit; /* "energy.kinetic", "J" */
	double first, last, least, most, sum;
	int64_t n;
} quern_observed;

typedef struct quern_series {
	quern_observed *column;
	size_t n, capacity;
	int64_t rows;
	char *path; /* NULL: nothing is written */
} quern_series;

/* A series with the columns of the run's observers. `rows` > 0 goes on after so many rows of DIR/series.csv: later
 * ones are cut off, and the statistics are made again from those kept. QUERN_E_IO with run->message on a fault. */
quern_status quern_series_init(quern_series *, quern_run *, int64_t rows);
void quern_series_finish(quern_series *);
/* One row, of the state as it is. */
quern_status quern_series_add(quern_series *, quern_run *);
