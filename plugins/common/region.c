/* SPDX-License-Identifier: MIT */
#include "region.h"
#include "tools.h"

const quern_param quern_region_floors[] = {
	QUERN_PARAM(region_floor, body, "1", "Name of the body, or its number in the scene's list, from 0.",
		.text = "body", .flags = QUERN_REQUIRED, .max = 1e6),
	QUERN_END_PARAMS
};

static quern_real gap_of(const region *r, const quern_real x[3]) {
	return quern_body_gap(r->shape, &quern_motion_still, r->dim, x, 0, NULL);
}

quern_status quern_region_box(const quern_bound *shape, region_use use, const quern_setup *setup,
	const char *param, quern_err *err, quern_real lower[3], quern_real upper[3]) {
	for (uint32_t k = 0; k < 3; k++) lower[k] = upper[k] = 0;
	((const quern_body_ops *)shape->ops)->bounds(shape->self, setup->dim, lower, upper);
	for (uint32_t k = 0; k < setup->dim; k++) {
		const quern_real low = setup->lower[k], high = setup->upper[k];
		const quern_real slack = use == REGION_OF_FIXED ? high - low : 1e-9 * (high - low);
		if (!(lower[k] <= high + slack) || !(upper[k] >= low - slack))
			return setup->host->fail(err, QUERN_E_PARAM, param, "the region lies outside of the domain");
		if ((isfinite(lower[k]) && lower[k] < low - slack) || (isfinite(upper[k]) && upper[k] > high + slack))
			return setup->host->fail(
				err, QUERN_E_PARAM, param, "the region reaches out of the domain along axis %u", k);
		const bool cut = use == REGION_OF_GRAINS; /* no centre may be outside, be it by rounding */
		if (isinf(lower[k]) || (cut && lower[k] < low)) lower[k] = low;
		if (isinf(upper[k]) || (cut && upper[k] > high)) upper[k] = high;
		if (!(use == REGION_OF_POINTS ? upper[k] > lower[k] : upper[k] >= lower[k]))
			return setup->host->fail(err, QUERN_E_PARAM, param, "the region has no width along axis %u", k);
	}
	return QUERN_OK;
}

quern_status quern_region_check_above(
	const quern_list *above, uint32_t n_bodies, const quern_setup *setup, const char *param, quern_err *err) {
	const region_floor *floor = above->items;
	if (above->n && !(quern_gravity_size(setup->dim, setup->gravity) > 0))
		return setup->host->fail(
			err, QUERN_E_PARAM, param, "there is no gravity to say what lies above: leave it out");
	for (uint32_t i = 0; i < above->n; i++)
		if ((uint32_t)floor[i].body >= n_bodies)
			return setup->host->fail(err, QUERN_E_PARAM, param,
				"there is no body %d; the scene has %u, counted from 0", floor[i].body, n_bodies);
	return QUERN_OK;
}

region quern_region_of(
	const quern_step *s, const quern_bound *shape, const quern_real lower[3], const quern_real upper[3]) {
	region r = { .shape = shape, .dim = s->dim };
	quern_real largest = 0;
	for (uint32_t k = 0; k < s->dim; k++) {
		r.lower[k] = lower[k], r.upper[k] = upper[k];
		largest = fmax(largest, fmax(fabs(lower[k]), fabs(upper[k])));
	}
	r.slack = 1e-12 * largest;
	return r;
}

void quern_region_put_above(
	region *r, const quern_step *s, const quern_list *above, uint32_t slot, const body_pose *pose) {
	const quern_real gravity = quern_gravity_size(s->dim, s->gravity);
	quern_real square = 0;
	if (!above->n || !(gravity > 0)) return;
	for (uint32_t k = 0; k < s->dim; k++) {
		r->down[k] = s->gravity[k] / gravity;
		square += (s->upper[k] - s->lower[k]) * (s->upper[k] - s->lower[k]);
	}
	r->deep = sqrt(square);
	r->above = above;
	r->body = s->slot[slot];
	r->pose = pose;
}

static quern_real gap_to(const region *r, int32_t b, const quern_real x[3]) {
	return quern_body_gap(&r->body[b], &r->pose[b], r->dim, x, 0, NULL);
}

/* Down from a place outside of it, each time as far as the body surely is not (Hart 1996, Vis. Comput. 12:527). What passes nearer
 * than a hundred thousandth of the domain has met it. */
static bool falls_on(const region *r, int32_t b, const quern_real x[3]) {
	const quern_real near = 1e-5 * r->deep;
	quern_real at[3] = { x[0], x[1], x[2] }, way = 0, gap = gap_to(r, b, at);
	while (gap > near && way < r->deep) {
		way += gap;
		for (uint32_t k = 0; k < r->dim; k++) at[k] = x[k] + way * r->down[k];
		gap = gap_to(r, b, at);
	}
	return gap <= near;
}

/* Above one of them, and in none. */
static bool is_above(const region *r, const quern_real x[3]) {
	const region_floor *floor = r->above->items;
	bool on = false;
	for (uint32_t i = 0; i < r->above->n; i++)
		if (gap_to(r, floor[i].body, x) < 0) return false;
	for (uint32_t i = 0; i < r->above->n && !on; i++) on = falls_on(r, floor[i].body, x);
	return on;
}

bool quern_region_holds(const region *r, const quern_real x[3]) {
	for (uint32_t k = 0; k < r->dim; k++)
		if (!(x[k] >= r->lower[k] && x[k] <= r->upper[k])) return false;
	return gap_of(r, x) <= r->slack && (!r->above || is_above(r, x));
}

region_side quern_region_side(const region *r, const quern_real lower[3], const quern_real upper[3]) {
	quern_real middle[3] = { 0 }, square = 0;
	for (uint32_t k = 0; k < r->dim; k++) {
		const quern_real half = 0.5 * (upper[k] - lower[k]);
		middle[k] = lower[k] + half;
		square += half * half;
	}
	const quern_real gap = gap_of(r, middle), half = (1 + 1e-9) * sqrt(square);
	if (gap > half + r->slack) return REGION_APART;
	return gap < -half && !r->above ? REGION_AROUND : REGION_CROSSES;
}
