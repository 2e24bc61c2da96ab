/* SPDX-License-Identifier: MIT */
/* seen - a run whose observers are asked by the names of their columns */
#pragma once
#include "harness.h"
#include <observe.h>
#include <string.h>

/* A run and what its observers say now. */
typedef struct seen {
	quern_run *run;
	quern_series series;
} seen;

static inline void look(seen *s) {
	harness_look(s->run);
	assert_int_equal(quern_series_add(&s->series, s->run), QUERN_OK);
}

static inline seen watch(quern_run *run) {
	seen s = { .run = run };
	assert_int_equal(quern_series_init(&s.series, run, 0), QUERN_OK);
	look(&s);
	return s;
}

static inline double value(const seen *s, const char *column) {
	for (size_t c = 0; c < s->series.n; c++)
		if (!strcmp(s->series.column[c].name, column)) return s->series.column[c].last;
	fail_msg("no column %s", column);
	return 0;
}

static inline void leave(seen *s) {
	quern_series_finish(&s->series);
	harness_close(s->run);
}
