/* SPDX-License-Identifier: MIT */
/* plan - from declared uses to stages in order, fields that exist, and conflicts refused by name */
#pragma once
#include "field.h"
#include "scene.h"

typedef struct quern_plan_use {
	const quern_use *row;
	char field[56];    /* "particle." and repeated sets resolved */
	const char *owner; /* a stage, or a plugin in its slot */
	quern_mark mark;
	int stage;              /* -1: called by nobody here */
	int target;             /* index of its field in the store; -1: the row does not count */
	const quern_slot *slot; /* in which its plugin sits; NULL: a stage's own, or an observer's */
	int bound;              /* of the plan's plugins, the one that has it */
	bool counts;
} quern_plan_use;

typedef struct quern_plan_stage {
	const char *name, *doc;
	const quern_stage *stage; /* NULL: an observer's */
	const quern_section *section;
	const quern_filling *observer;
	quern_phase phase;
	int solver, sequence, order; /* order: place in the step, from 0 */
	bool sometimes, settles;
	size_t first_use, n_uses; /* its own rows in plan->uses */
	quern_column *column;
	int *swaps, *zeros;  /* fields to swap after, to zero before; -1 ends */
	int *zeros_settling; /* to zero before, until the release */
	double seconds;
} quern_plan_stage;

/* A plugin in a slot with its columns; what bound.column and bound.again point to is kept fresh. */
typedef struct quern_plan_bound {
	quern_bound bound;             /* its solver has a copy, as long as the solver knows it */
	size_t first_use, first_again; /* into plan->uses; first_again == SIZE_MAX: no repeat */
	quern_column *column, *again;
	quern_use *uses; /* with the stride of whoever calls it */
	const void **variant, **refined;
} quern_plan_bound;

/* A column that shows one of the two copies of a field. */
typedef struct quern_plan_link {
	quern_column *column;
	size_t use;                    /* in plan->uses */
	const quern_plan_stage *stage; /* whose own it is; NULL: a plugin's in its slot */
} quern_plan_link;

typedef struct quern_plan {
	const quern_scene *scene;
	quern_store store;
	quern_plan_use *uses;
	size_t n_uses, uses_capacity;
	quern_plan_stage *stages;
	size_t n_stages, stages_capacity;
	int *order;                /* stages in the order of a step */
	quern_plan_bound **bounds; /* all */
	size_t n_bounds, bounds_capacity;
	void **slots[QUERN_MOST_SECTIONS]; /* by section: by slot: bounds with the stride of the solver */
	uint32_t *n_slot[QUERN_MOST_SECTIONS];
	quern_plan_bound **observers; /* by entry of scene->observe */
	uint64_t fresh;               /* store version of the columns */
	quern_plan_link *links;       /* by field: those of field k begin at first_link[k] */
	size_t *first_link;
} quern_plan;

/* Faults go to the scene's report. Never NULL. */
quern_plan *quern_plan_create(const quern_scene *, quern_pool *);
void quern_plan_destroy(quern_plan *);

/* Renews every column pointer if the store has changed. */
void quern_plan_refresh(quern_plan *);
/* Other copies of these fields are current from now on, -1 ends; columns that are fresh stay so. */
void quern_plan_swap(quern_plan *, const int *fields);

extern const char *const quern_phase_names[];
/* Whether a use by a stage that settles changes its field then. */
bool quern_plan_settles(const quern_use *);
/* Bytes of one entry of a set, of what is stored. */
size_t quern_plan_entry_bytes(const quern_plan *, int set);
