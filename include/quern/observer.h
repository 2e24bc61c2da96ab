/* SPDX-License-Identifier: MIT */
/* quern/observer.h - the kind `observer`: partial results of leaves of 256 entries, combined in a fixed tree; or `whole` for what
 * needs everything at once */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct quern_observer_batch {
	uint32_t n, dim; /* entries of this leaf, part of a block of the set; `whole`: 0 */
	quern_real time, gravity[3], lower[3], upper[3];
	/* by row of `uses`; in `map` the columns of `set` begin at the leaf's first entry, others are whole */
	const quern_column *use;
	const uint32_t *count; /* `whole`: entries by row of `uses`; NULL in `map` */
} quern_observer_batch;

typedef struct quern_observer_ops {
	uint32_t size, output_size;  /* of this table, and of one of `outputs` */
	const char *set;             /* that `map` runs over; NULL: `whole` */
	const quern_output *outputs; /* NULL-name terminated; what comes out must be finite */
	void (*map)(
		const void *self, const quern_observer_batch *, quern_real *partial); /* [batch] one per output */
	quern_status (*whole)(const void *self, const quern_observer_batch *, quern_real *out, const quern_host *,
		quern_run *); /* [stage] */
	/* since 2.1: [setup] how often `outputs` come, 1 to 1000, all of them each time, with _0, _1, ... after their names, such as
	 * a profile's bins; NULL: once, as they are called */
	uint32_t (*repeat)(const void *self);
} quern_observer_ops;

QUERN_KIND(observer, quern_observer_ops, "Numbers about a state, a row each time.",
	QUERN_OPTIONALLY(quern_observer_ops, map), QUERN_OPTIONALLY(quern_observer_ops, whole),
	QUERN_OPTIONALLY(quern_observer_ops, repeat));

#ifdef __cplusplus
}
#endif
