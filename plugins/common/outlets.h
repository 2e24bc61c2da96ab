/* SPDX-License-Identifier: MIT */
/* outlets - entries whose centre has passed an open face of the domain are taken out and booked. docs/theory/flow.md */
#pragma once
#include "books.h"
#include "cloud.h"

/* Faces are numbered lower_x, upper_x, lower_y and so on: 2 axis + side. */
QUERN_INLINE uint32_t outlet_faces(const quern_step *s) { return 2 * s->dim; }

/* Whether any face of the domain is open. */
QUERN_INLINE bool outlets_any(const bool open[2][3]) {
	bool any = false;
	for (int k = 0; k < 3; k++) any = any || open[0][k] || open[1][k];
	return any;
}

/* Beyond a face that is closed, where nothing may be; what is no number is beyond every one. */
QUERN_INLINE bool outlet_refuses(const quern_step *s, uint32_t axis, quern_real x) {
	const bool below = !(x >= s->lower[axis]) && !(x < s->lower[axis] && s->open[0][axis]);
	const bool above = !(x <= s->upper[axis]) && !(x > s->upper[axis] && s->open[1][axis]);
	return !s->periodic[axis] && (below || above);
}

typedef struct outlets {
	const char *set;
	cloud of;
	const quern_column *position, *velocity, *spin; /* spin NULL or without columns: nothing turns */
	const quern_real *radius, *energy;              /* m, of what turns; J/kg stored, NULL: nothing is */
	const quern_column *lent;  /* m/s^2 in v that is no motion of its own; NULL or without columns: none */
	quern_real moving;         /* s since gravity began to act in this long step */
	quern_real *pull;          /* kg s, sum of mass times `moving`; NULL: nobody asks */
	const quern_column *books; /* first row of the book of faces */
} outlets;

/* [stage] Entries that go keep the others' order, and lists that point at the set lose what pointed at them. */
quern_status quern_outlets_run(const quern_step *, const outlets *);
