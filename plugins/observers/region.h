/* SPDX-License-Identifier: MIT */
/* region - the box that an observer looks at: centres in it count, from the lower faces on and without the upper ones */
#pragma once
#include <math.h>
#include <quern/abi.h>
#include <quern/space.h>

typedef struct observer_region {
	quern_real lower[3], upper[3]; /* m; NaN: no bound */
	quern_real low[3], high[3];    /* m, of region_init: bounds, or else the domain's faces at the start */
	quern_real length[3];          /* m, of the domain along periodic axes, else 0 */
} observer_region;

/* Rows for a member `region`, with flags: QUERN_MAYBE, or QUERN_REQUIRED where there must be one. */
#define REGION_PARAMS(T, flags_)                                                                             \
	QUERN_PARAM_AS(T, region.lower, "region.box.lower", "m", "Lower corner of the box that is looked at.",   \
		.flags = flags_),                                                                                    \
		QUERN_PARAM_AS(T, region.upper, "region.box.upper", "m", "Upper corner.", .flags = flags_)

/* Whether it has a width there, with the domain's face for a bound that it lacks. */
static inline quern_status region_has_width(
	const observer_region *r, uint32_t k, const quern_setup *setup, quern_err *err) {
	if (r->high[k] > r->low[k]) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, isnan(r->lower[k]) ? "region.box.upper" : "region.box.lower",
		"the region lies outside of the domain along axis %u", k);
}

static inline quern_status region_init(observer_region *r, const quern_setup *setup, quern_err *err) {
	for (uint32_t k = 0; k < setup->dim; k++) {
		r->low[k] = isnan(r->lower[k]) ? setup->lower[k] : r->lower[k];
		r->high[k] = isnan(r->upper[k]) ? setup->upper[k] : r->upper[k];
		r->length[k] = setup->periodic[k] ? setup->upper[k] - setup->lower[k] : 0;
		if (r->upper[k] <= r->lower[k])
			return setup->host->fail(err, QUERN_E_PARAM, "region.box.upper",
				"must be above the lower corner along every axis; axis %u is not", k);
		if (r->length[k] > 0 && region_has_width(r, k, setup, err) != QUERN_OK) return QUERN_E_PARAM;
	}
	return QUERN_OK;
}

/* Of one that must have a width, also where a bound is left to the domain. */
static inline quern_status region_init_wide(observer_region *r, const quern_setup *setup, quern_err *err) {
	if (region_init(r, setup, err) != QUERN_OK) return QUERN_E_PARAM;
	for (uint32_t k = 0; k < setup->dim; k++)
		if (region_has_width(r, k, setup, err) != QUERN_OK) return QUERN_E_PARAM;
	return QUERN_OK;
}

/* Of a place's images `length` apart that nearest to the middle of a span, since it may be a while until what has left a periodic domain is
 * brought back; 0: it has no others. */
QUERN_INLINE quern_real region_image(quern_real x, quern_real low, quern_real high, quern_real length) {
	const quern_real off = x - 0.5 * (low + high);
	return x + (quern_image_far(off, length) - off);
}

/* `still`: the domain keeps its shape, and its periodic faces bound what has no bound on one side; in one that is strained places count as
 * they are. */
QUERN_INLINE bool region_holds(
	const observer_region *r, quern_real *const *x, uint32_t i, uint32_t dim, bool still) {
	bool in = true;
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real length = still ? r->length[k] : 0;
		const bool below = !isnan(r->lower[k]), above = !isnan(r->upper[k]);
		if (!below && !above) continue;
		const quern_real at = region_image(x[k][i], r->low[k], r->high[k], length);
		in = in && !((below || length > 0) && at < r->low[k]) && !((above || length > 0) && at >= r->high[k]);
	}
	return in;
}
