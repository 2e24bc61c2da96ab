/* SPDX-License-Identifier: MIT */
/* books - what bodies give to the material in a step: by block, so that sums do not depend on who did what.
 * docs/theory/bodies.md, section 3 */
#pragma once
#include <quern/solver.h>
#include <quern/vec.h>

/* Impulse, its moment about the pivot, and work. */
enum { B_IMPULSE, B_TWIST = 3, B_WORK = 6, N_BOOKED };

typedef struct body_books {
	quern_real *all;   /* [block][body][N_BOOKED] */
	uint32_t n_bodies; /* of the scene, and one more: what else holds the material, such as fixed grains */
} body_books;

/* Nothing booked yet, until the stage returns; false if memory is gone. */
static inline bool body_books_open(body_books *b, const quern_step *s, uint32_t n_blocks, uint32_t n_bodies) {
	b->n_bodies = n_bodies + 1;
	b->all =
		(quern_real *)s->host->memory(s->run, (size_t)n_blocks * b->n_bodies * N_BOOKED * sizeof(quern_real));
	return b->all != NULL;
}

QUERN_INLINE quern_real *body_booked(const body_books *b, uint32_t block, uint32_t body) {
	return b->all + ((size_t)block * b->n_bodies + body) * N_BOOKED;
}

/* A moment's components as an axial field has them. */
QUERN_INLINE void body_book_twist(quern_real *booked, quern_vec moment, quern_real share, uint32_t dim) {
	if (dim == 3) booked[B_TWIST] += share * moment.x, booked[B_TWIST + 1] += share * moment.y;
	booked[B_TWIST + (dim == 3 ? 2 : 0)] += share * moment.z;
}

/* Adds n numbers from `first` on of what was booked to an entry of a field, if there is such a field. */
static inline void body_books_add(
	const quern_column *to, uint32_t entry, const quern_real *booked, uint32_t first, uint32_t n) {
	for (uint32_t k = 0; k < n && to->real[0]; k++) to->real[k][entry] += booked[first + k];
}

/* Block after block, by their places, into fields of the bodies; what else holds into `rest`, one entry. Each may not exist. */
static inline void body_books_close(const body_books *b, const quern_step *s, uint32_t n_blocks,
	const uint32_t *by_place, const quern_column *impulse, const quern_column *twist,
	const quern_column *work, const quern_column *rest) {
	const uint32_t turns = s->dim == 3 ? 3 : 1;
	for (uint32_t q = 0; q < n_blocks; q++) {
		const uint32_t block = quern_nth(by_place, q);
		for (uint32_t body = 0; body + 1 < b->n_bodies; body++) {
			const quern_real *booked = body_booked(b, block, body);
			body_books_add(impulse, body, booked, B_IMPULSE, s->dim);
			body_books_add(twist, body, booked, B_TWIST, turns);
			body_books_add(work, body, booked, B_WORK, 1);
		}
		body_books_add(rest, 0, body_booked(b, block, b->n_bodies - 1), B_IMPULSE, s->dim);
	}
}
