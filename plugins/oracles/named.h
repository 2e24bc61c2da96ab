/* SPDX-License-Identifier: MIT */
/* named - the bodies that an oracle means, as a scene lists them: names, or numbers in the scene's list */
#pragma once
#include <math.h>
#include <quern/oracle.h>

typedef struct named_body {
	int32_t body;
} named_body;

static const quern_param named_rows[] = { QUERN_PARAM(named_body, body, "1",
											  "Name of the body, or its number in the scene's list, from 0.",
											  .text = "body", .max = 1e6, .flags = QUERN_REQUIRED),
	QUERN_END_PARAMS };

/* Rows for a member `bodies`, and for `count`, how many the scene has; the variadic part is what `bodies` are, and other
 * members of the row. */
#define NAMED_PARAMS(T, ...)                                                                                 \
	QUERN_PARAM(T, bodies, NULL, __VA_ARGS__, .rows = named_rows, .item_size = sizeof(named_body)),          \
		QUERN_PARAM(T, count, "1", "Bodies that there are.", .from = "bodies.count",                         \
			.flags = QUERN_MAYBE | QUERN_ADVANCED, .max = 1e6)

static inline quern_status named_check(
	const quern_list *bodies, quern_real count, const quern_setup *setup, quern_err *err) {
	const named_body *n = bodies->items;
	for (uint32_t i = 0; i < bodies->n && !isnan(count); i++)
		if (n[i].body >= count)
			return setup->host->fail(err, QUERN_E_PARAM, "bodies",
				"there is no body %d; the scene has %.0f, counted from 0", n[i].body, count);
	return QUERN_OK;
}

/* Whether the list has body number b, or is empty and stands for all. */
static inline bool named_means(const quern_list *bodies, uint32_t b) {
	const named_body *n = bodies->items;
	for (uint32_t i = 0; i < bodies->n; i++)
		if (n[i].body == (int32_t)b) return true;
	return !bodies->n;
}
