/* SPDX-License-Identifier: MIT */
/* source - a region that pours material: its keys, and how much is due. docs/theory/flow.md */
#pragma once
#include "books.h"

enum { SOURCE_BY_RATE, SOURCE_FULL };

typedef struct source {
	quern_real lower[3], upper[3], velocity[3];
	quern_real rate, from, until, most; /* kg/s; s; s; kg; NaN: the scene says nothing */
	int32_t keep, every;
} source;

/* The keys of an item of a solver's list `source`. */
extern const quern_param quern_source_rows[];

/* [setup] Regions in the domain, times in order, a rate where one is needed; `flat`: a region may be as thin as it likes. */
quern_status quern_sources_check(const quern_list *, bool flat, const quern_setup *, quern_err *);
/* Whether the source looks for room in this step. */
bool quern_source_acts(const source *, const quern_step *);
/* kg that shall have been poured by now; infinite where the region is kept full. */
quern_real quern_source_due(const source *, quern_real time);
/* Notes what of source i of a section is due and has no room, and says so once: rows of WAITING_USE and LATE_USE. */
void quern_source_note(const quern_step *, uint32_t i, const char *section, const source *,
	quern_real waiting, const quern_column *row);
