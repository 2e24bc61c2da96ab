/* SPDX-License-Identifier: MIT */
/* region - the box that an observer looks at: centres in it count, from the lower faces on and without the upper ones */
#pragma once
#include <math.h>
#include <quern/abi.h>

typedef struct observer_region {
	quern_real lower[3], upper[3]; /* m; NaN: no bound */
} observer_region;

/* Rows for a member `region`, with flags: QUERN_MAYBE, or QUERN_REQUIRED where there must be one. */
#define REGION_PARAMS(T, flags_)                                                                             \
	QUERN_PARAM_AS(T, region.lower, "region.box.lower", "m", "Lower corner of the box that is looked at.",   \
		.flags = flags_),                                                                                    \
		QUERN_PARAM_AS(T, region.upper, "region.box.upper", "m", "Upper corner.", .flags = flags_)

static inline quern_status region_check(const observer_region *r, const quern_setup *setup, quern_err *err) {
	for (uint32_t k = 0; k < setup->dim; k++)
		if (!isnan(r->lower[k]) && !isnan(r->upper[k]) && !(r->upper[k] > r->lower[k]))
			return setup->host->fail(err, QUERN_E_PARAM, "region.box.upper",
				"must be above the lower corner along every axis; axis %u is not", k);
	return QUERN_OK;
}

QUERN_INLINE bool region_holds(const observer_region *r, quern_real *const *x, uint32_t i, uint32_t dim) {
	bool in = true;
	for (uint32_t k = 0; k < dim; k++) in = in && !(x[k][i] < r->lower[k]) && !(x[k][i] >= r->upper[k]);
	return in;
}
