/* SPDX-License-Identifier: MIT */
/* order - stages in the order of a step, and what that implies for each field: state or scratch, kept twice or once, zeroed
 * before, swapped after */
#pragma once
#include "plan.h"

/* Once sets, stages, fields and uses are there. Faults go to the scene's report. */
void quern_plan_order(quern_plan *);
/* A field exists because this use cannot do without it. */
bool quern_plan_demands(const quern_plan_use *);

/* It does more than read; it gives every entry its next value. */
static inline bool quern_use_changes(const quern_use *row) { return row->access != QUERN_READ; }
static inline bool quern_use_renews(const quern_use *row) {
	return row->access == QUERN_UPDATE || row->access == QUERN_WRITE;
}
