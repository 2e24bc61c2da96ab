/* SPDX-License-Identifier: MIT */
/* source - a region that pours material: its keys, and how much is due. docs/theory/flow.md */
#pragma once
#include "books.h"
#include "region.h"

enum { SOURCE_BY_RATE, SOURCE_FULL };

typedef struct source {
	quern_real lower[3], upper[3]; /* m, of the box around its region */
	quern_real velocity[3];
	quern_real rate, from, until, most; /* kg/s; s; s; kg; NaN: the scene says nothing */
	int32_t keep, every;
} source;

extern const char *const quern_source_keeps[];
/* The keys of an item of a solver's list `source`, beside those of its slots; its struct begins with this one. Without being told it
 * looks for room every EVERY short steps. */
/* clang-format off */
#define SOURCE_KEYS(EVERY) \
	QUERN_PARAM(source, velocity, "m/s", "Velocity of what is poured."), \
	QUERN_PARAM(source, rate, "kg/s", "Mass poured per second; in 2-D of a slab one metre thick.", \
		.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e12), \
	QUERN_PARAM(source, keep, "1", \
		"What is kept: the rate, so that mass without room waits; or the region full, whatever that takes.", \
		.choices = quern_source_keeps), \
	QUERN_PARAM(source, from, "s", "When it begins.", .max = 1e12), \
	QUERN_PARAM(source, until, "s", "When it ends; default: never.", .flags = QUERN_MAYBE | QUERN_MIN_OPEN, \
		.max = 1e12), \
	QUERN_PARAM_AS(source, most, "mass", "kg", "Mass after which it ends; default: none.", \
		.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e12), \
	QUERN_PARAM(source, every, "1", "Short steps between two looks for room.", .def = EVERY, .min = 1, \
		.max = 1e6, .flags = QUERN_ADVANCED)
/* clang-format on */

static inline const source *quern_source_at(const quern_list *list, uint32_t i) {
	return (const source *)(const void *)((const char *)list->items + (size_t)i * list->item_size);
}
/* [setup] Times in order, and a rate where one is needed. */
quern_status quern_sources_check(const quern_list *, const quern_setup *, quern_err *);
/* [setup] Where they are: the shapes of their regions, one by one. */
quern_status quern_sources_place(
	quern_list *, const quern_bound *shape, region_use, const quern_setup *, quern_err *);
/* Whether the source looks for room in this step. */
bool quern_source_acts(const source *, const quern_step *);
/* kg that shall have been poured by now; infinite where the region is kept full. Entry i of rows of DUE_USE and LOOKED_USE. */
quern_real quern_source_due(const source *, quern_real time, uint32_t i, const quern_column *row);
/* A source that keeps its region full is due nothing else: what it has poured is not held against a rate that a stage brings. */
void quern_source_even(const source *, uint32_t i, const quern_column *due, const quern_column *poured);
/* Room for n fresh entries behind the `old` ones of a set; the run is stopped where there is none. `what`: its plural. */
quern_status quern_source_room(
	const quern_step *, const char *set, const char *what, uint32_t n, uint32_t *old);
/* Notes what of source i of a section is due and has no room, and says so once: rows of WAITING_USE and LATE_USE. */
void quern_source_note(const quern_step *, uint32_t i, const char *section, const source *,
	quern_real waiting, const quern_column *row);
