/* SPDX-License-Identifier: MIT */
/* books - what has gone through a face or come out of a source so far: mass, momentum, number and energy. docs/theory/flow.md */
#pragma once
#include <quern/solver.h>

/* The rows of a solver's stage that keep one book, in this order from row PREFIX_MASS on; an entry of SET for every face or
 * every source. WHEN: the solver's parameter on which SET hangs too. */
/* clang-format off */
#define BOOK_ROWS(X, PREFIX, SET, WHEN) \
	X(PREFIX##_MASS, SET ".mass", "kg", QUERN_UPDATE, QUERN_SCALAR, .when = WHEN, .doc = "Carried, so far.") \
	X(PREFIX##_MOMENTUM, SET ".momentum", "kg m/s", QUERN_UPDATE, QUERN_VECTOR, .when = WHEN, \
		.doc = "Of that mass, so far.") \
	X(PREFIX##_COUNT, SET ".count", "1", QUERN_UPDATE, QUERN_SCALAR, .when = WHEN, \
		.doc = "Entries so far, each by its weight.") \
	X(PREFIX##_ENERGY, SET ".energy", "J", QUERN_UPDATE, QUERN_SCALAR, .when = WHEN, .flags = QUERN_OPTIONAL, \
		.doc = "Of their motion and in them, so far.") \
	X(PREFIX##_POTENTIAL, SET ".potential", "J", QUERN_UPDATE, QUERN_SCALAR, .when = WHEN, .flags = QUERN_OPTIONAL, \
		.doc = "-m g x of them, so far.") \
	X(PREFIX##_MASS_REST, SET ".mass_rest", "kg", QUERN_UPDATE, QUERN_SCALAR, .when = WHEN, \
		.doc = "What the last bit of the mass does not hold.") \
	X(PREFIX##_MOMENTUM_REST, SET ".momentum_rest", "kg m/s", QUERN_UPDATE, QUERN_VECTOR, .when = WHEN, \
		.doc = "What the last bit of the momentum does not hold.")
#define PULL_USE \
	"total.outlet_pull", "kg s", QUERN_UPDATE, QUERN_SCALAR, .flags = QUERN_OPTIONAL | QUERN_RELEASED, \
	.doc = "Of what has left in this step: mass times how long gravity has acted on it."
#define WAITING_USE(SET) \
	SET ".waiting", "kg", QUERN_UPDATE, QUERN_SCALAR, .when = "sources", .doc = "Due, and without room."
#define DUE_USE(SET) \
	SET ".due", "kg", QUERN_UPDATE, QUERN_SCALAR, .when = "sources", .doc = "Shall have been poured by the last look."
#define LOOKED_USE(SET) \
	SET ".looked", "s", QUERN_UPDATE, QUERN_SCALAR, .when = "sources", .doc = "Time of the last look."
#define LATE_USE(SET) \
	SET ".late", "1", QUERN_UPDATE, QUERN_INDEX, .when = "sources", .doc = "1: some has waited, which was said."
/* clang-format on */
enum {
	BOOK_MASS,
	BOOK_MOMENTUM,
	BOOK_COUNT,
	BOOK_ENERGY,
	BOOK_POTENTIAL,
	BOOK_MASS_REST,
	BOOK_MOMENTUM_REST
};

typedef struct booking {
	quern_real mass, momentum[3], count, energy, potential;
} booking;

/* Adds x; `rest` keeps what is lost by rounding (Knuth's two-sum), since equal masses added one by one would err by the same
 * share of a bit each time. */
QUERN_INLINE void book_number(quern_real *sum, quern_real *rest, quern_real x) {
	const quern_real add = x + *rest, before = *sum, after = before + add, part = after - before;
	*rest = (before - (after - part)) + (add - part);
	*sum = after;
}

/* Into entry i of the book whose rows begin at `row`. */
static inline void book_add(const quern_column *row, uint32_t i, uint32_t dim, const booking *b) {
	book_number(&row[BOOK_MASS].real[0][i], &row[BOOK_MASS_REST].real[0][i], b->mass);
	for (uint32_t k = 0; k < dim; k++)
		book_number(&row[BOOK_MOMENTUM].real[k][i], &row[BOOK_MOMENTUM_REST].real[k][i], b->momentum[k]);
	row[BOOK_COUNT].real[0][i] += b->count;
	if (row[BOOK_ENERGY].real[0]) row[BOOK_ENERGY].real[0][i] += b->energy;
	if (row[BOOK_POTENTIAL].real[0]) row[BOOK_POTENTIAL].real[0][i] += b->potential;
}

/* Of n entries together; 0 where there is no such column. */
QUERN_INLINE quern_real book_total(const quern_real *column, uint32_t n) {
	quern_real sum = 0;
	for (uint32_t i = 0; column && i < n; i++) sum += column[i];
	return sum;
}

/* The set of a book, with n empty entries. */
static inline quern_status book_open(const quern_step *s, const char *set, uint32_t n) {
	int32_t *from = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) from[i] = -1;
	return s->host->remap(s->run, set, n, from, 0, NULL);
}
