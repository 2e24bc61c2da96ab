/* SPDX-License-Identifier: MIT */
/* open - surfaces with open space: where the packing fraction is low, and which way they look. What oracles that look for such
 * have in common */
#pragma once
#include <quern/oracle.h>

/* clang-format off */
#define OPEN_USES(X) \
	X(FRACTION, "cell.packing_fraction", "1", QUERN_READ, QUERN_SCALAR, \
		.doc = "Of grains; 1 where the continuum fills the cell.")
/* clang-format on */

/* Row for a member `critical`. */
#define OPEN_PARAM(T)                                                                                        \
	QUERN_PARAM(T, critical, "1", "Packing fraction of grains below which a cell is empty.", .def = 0.4,     \
		.min = 0, .max = 1, .flags = QUERN_MIN_OPEN | QUERN_MAX_OPEN)

static inline void open_mark(quern_real critical, const quern_real *fraction, const quern_cell_batch *b) {
	quern_real *restrict level = b->level;
	for (uint32_t i = 0; i < b->n; i++) level[i] = fraction[i] - critical;
}

/* ---- faces of the domain, as a scene lists them ---- */

typedef struct open_face {
	int32_t face;
} open_face;
static const char *const open_names[] = { "lower_x", "upper_x", "lower_y", "upper_y", "lower_z", "upper_z",
	NULL };
static const quern_param open_rows[] = { QUERN_PARAM(open_face, face, "1", "One of them.",
											 .choices = open_names, .flags = QUERN_REQUIRED),
	QUERN_END_PARAMS };

/* Row for a list of them; the variadic part is what they are. */
#define OPEN_FACES(T, member, ...)                                                                           \
	QUERN_PARAM(T, member, NULL, __VA_ARGS__, .rows = open_rows, .item_size = sizeof(open_face), .max = 6)

static inline quern_status open_check(
	const quern_list *faces, const char *key, const quern_setup *setup, quern_err *err) {
	const open_face *f = faces->items;
	for (uint32_t i = 0; i < faces->n; i++) {
		const uint32_t axis = (uint32_t)f[i].face / 2;
		if (axis >= setup->dim)
			return setup->host->fail(
				err, QUERN_E_PARAM, key, "%s is no face of a domain in 2-D", open_names[f[i].face]);
		if (setup->periodic[axis])
			return setup->host->fail(
				err, QUERN_E_PARAM, key, "%s is periodic, nothing lies against it", open_names[f[i].face]);
	}
	return QUERN_OK;
}

static inline uint32_t open_bits(const quern_list *faces) {
	const open_face *f = faces->items;
	uint32_t bits = 0;
	for (uint32_t i = 0; i < faces->n; i++) bits |= 1u << f[i].face;
	return bits;
}
