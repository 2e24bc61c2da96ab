/* SPDX-License-Identifier: MIT */
/* limit - the longest step: by the stiffest contact that the grains there are may have. docs/theory/grains.md, section 2 */
#include "dem.h"
#include <math.h>
#include <stdio.h>

/* A kind of contact as the step sees it: half the shortest period, the limit of the step, and the damping ratio at that
 * period. The stiffest of its laws gives the name. */
typedef struct {
	quern_real period, hard, damping;
	const char *law;
	char where[120]; /* between which grains, or of which on what */
	uint32_t others; /* laws beside that one */
} contact_limit;

/* The fastest mode of a packing: a grain has several contacts. omega_max^2 = 6 k/m of a triangular lattice and 8 k/m
 * of a face-centred one are 3 and 4 times that of a pair. */
static quern_real crowding(uint32_t dim) { return dim == 2 ? 1.7320508075688772 : 2; }

/* All laws together: stiffnesses add up, and so do the squares of frequencies; damping coefficients too. */
static contact_limit all_laws(
	const quern_step *s, quern_real mass, quern_real radius, int32_t item, int32_t body) {
	contact_limit c = { .period = INFINITY, .hard = INFINITY };
	quern_real square = 0, drag = 0, shortest = INFINITY;
	uint32_t n = 0;
	for (uint32_t l = 0; l < s->n_slot[SLOT_CONTACT]; l++) {
		const quern_bound *law = &s->slot[SLOT_CONTACT][l];
		const quern_contact_ops *ops = law->ops;
		const void *self = dem_law(law, item, body);
		if (!ops->period) continue;
		const quern_real t = ops->period(self, s->dim, mass, radius);
		const quern_real ratio = ops->damping ? ops->damping(self, s->dim) : 0;
		square += 1 / (t * t);
		drag += ratio / t;
		n++;
		if (t < shortest) shortest = t, c.law = law->id, c.damping = ratio;
	}
	c.period = n > 1 ? 1 / sqrt(square) : shortest;
	if (n > 1) c.damping = drag * c.period, c.others = n - 1;
	return c;
}

/* A dashpot that sees a predicted velocity counts more than one that sees the present one. */
static quern_real damping_factor(const quern_step *s) {
	const quern_integrator_ops *ops = dem_integrator(s)->ops;
	return ops->damping > 0 ? ops->damping : 1;
}

/* 0.2 of the half-period, or the limit of explicit dashpots in a packing, omega dt < 2 (sqrt(1 + zeta^2) - zeta). */
static contact_limit limit_of(
	const quern_step *s, quern_real mass, quern_real radius, int32_t item, int32_t body) {
	contact_limit c = all_laws(s, mass, radius, item, body);
	const quern_real crowd = crowding(s->dim), zeta = damping_factor(s) * crowd * c.damping;
	const quern_real damped = 2 * (sqrt(1 + zeta * zeta) - zeta) / crowd * c.period / 3.141592653589793;
	c.hard = damped < 0.2 * c.period ? damped : 0.2 * c.period;
	if (body >= 0)
		snprintf(c.where, sizeof c.where, "of the lightest grain on %.60s", s->slot[SLOT_BODIES][body].id);
	return c;
}

/* The recommended step over the half-period: the scene's word, or that of the integrator, whose order decides how many steps a
 * contact needs. */
static quern_real share_of(const dem *d, const quern_step *s) {
	const quern_integrator_ops *ops = dem_integrator(s)->ops;
	if (!isnan(d->step)) return d->step;
	return ops->step > 0 ? ops->step : 0.02;
}

static void say_limit(const contact_limit *fast, const contact_limit *hard, quern_real share, bool by_period,
	char reason[160]) {
	const contact_limit *c = by_period ? fast : hard;
	const bool same = c->period == hard->period && c->damping == hard->damping;
	char others[24] = "", damped[120] = "", parts[24] = "";
	if (by_period) snprintf(parts, sizeof parts, " / %.3g", 1 / share);
	if (c->others) snprintf(others, sizeof others, " and %u more", c->others);
	if (hard->hard < 0.2 * hard->period)
		snprintf(damped, sizeof damped, "%s%.80s, damping ratio %.3g", same ? "" : "; hard limit ",
			same ? "" : hard->where, hard->damping);
	snprintf(
		reason, 160, "%s%s %s, half-period %.3g s%s%s", c->law, others, c->where, c->period, parts, damped);
}

typedef struct {
	quern_real mass[2],
		radius; /* of the two lightest that move, the second infinite if there is one alone; of the lightest */
	bool fixed; /* there are grains that do not move */
} lightest;

static void look_for_lightest(const quern_step *s, lightest *of) {
	const uint32_t n = s->host->set(s->run, "grain").n;
	const quern_real *mass = s->use[FILL_MASS].real[0], *radius = s->use[FILL_RADIUS].real[0];
	const int32_t *fixed = s->use[FILL_FIXED].index, *material = s->use[FILL_MATERIAL].index;
	for (uint32_t i = 0; i < n; i++) {
		lightest *l = &of[material ? material[i] : 0];
		if (fixed && fixed[i]) l->fixed = true;
		else if (mass[i] < l->mass[0]) l->mass[1] = l->mass[0], l->mass[0] = mass[i], l->radius = radius[i];
		else if (mass[i] < l->mass[1]) l->mass[1] = mass[i];
	}
}

/* What a distribution may bring of a material. */
static void expect(const dem *d, lightest *l, uint32_t k) {
	const quern_real least = quern_radius_least(&d->material[k].radii),
					 light = quern_radius_mass(least, d->material[k].density, d->dim);
	if (light < l->mass[0]) l->mass[0] = light, l->radius = least;
	if (light < l->mass[1]) l->mass[1] = light;
}

/* By material. Before there are grains, what the distributions may bring; and what sources will. */
static void lightest_grains(const dem *d, const quern_step *s, lightest *of) {
	bool any = false;
	for (uint32_t k = 0; k < d->n_materials; k++)
		of[k] = (lightest) { .mass = { INFINITY, INFINITY }, .radius = INFINITY };
	look_for_lightest(s, of);
	for (uint32_t k = 0; k < d->n_materials; k++) any = any || isfinite(of[k].mass[0]);
	for (uint32_t k = 0; k < d->n_materials; k++)
		if (!any || quern_dem_pours(d, k)) expect(d, &of[k], k);
}

static contact_limit limit_of_two(const dem *d, const quern_step *s, const lightest *l, uint32_t k) {
	const bool two = isfinite(l->mass[1]);
	const quern_real pair = two ? l->mass[0] * l->mass[1] / (l->mass[0] + l->mass[1]) : l->mass[0];
	/* to a fixed grain, however large, one that touches it is as if it were a wall */
	contact_limit c = limit_of(s, pair, two ? 0.5 * l->radius : l->radius, d->pair[k][k], -1);
	const char *name = d->n_materials > 1 ? d->material[k].name : NULL;
	snprintf(c.where, sizeof c.where,
		two ? "between the two lightest grains%s%.40s" : "on the lightest grain%s%.40s", name ? " of " : "",
		name ? name : "");
	return c;
}

/* Of grains of two materials. To a fixed grain that one touches it is as if it were a wall. */
static contact_limit limit_of_pair(
	const dem *d, const quern_step *s, const lightest *of, uint32_t k, uint32_t l) {
	const lightest *a = &of[k], *b = &of[l];
	const bool two = isfinite(a->mass[0]) && isfinite(b->mass[0]);
	const lightest *one = isfinite(a->mass[0]) ? a : b;
	contact_limit c = limit_of(s, two ? a->mass[0] * b->mass[0] / (a->mass[0] + b->mass[0]) : one->mass[0],
		two ? a->radius * b->radius / (a->radius + b->radius) : one->radius, d->pair[k][l], -1);
	snprintf(c.where, sizeof c.where, "between the lightest grains of %.40s and %.40s", d->material[k].name,
		d->material[l].name);
	return c;
}

/* Whether grains of both are there, of which some move. */
static bool may_meet(const lightest *a, const lightest *b) {
	const bool one = isfinite(a->mass[0]), two = isfinite(b->mass[0]);
	return (one && (two || b->fixed)) || (two && a->fixed);
}

static void take_shorter(contact_limit *fast, contact_limit *first, const contact_limit *c) {
	if (c->period < fast->period) *fast = *c;
	if (c->hard < first->hard) *first = *c;
}

/* The stiffest contact is that of the two lightest grains of a pair of materials, or of the lightest against a body: the shortest,
 * and the first to fail when the step grows. */
static void find_limits(
	const dem *d, const quern_step *s, const lightest *l, contact_limit *fast, contact_limit *first) {
	contact_limit c;
	for (uint32_t k = 0; k < d->n_materials; k++) {
		/* a grain that is alone of its material meets none of it */
		const bool others = d->n_materials == 1 || isfinite(l[k].mass[1]) || l[k].fixed;
		if (isfinite(l[k].mass[0]) && others) c = limit_of_two(d, s, &l[k], k), take_shorter(fast, first, &c);
		for (uint32_t m = k + 1; m < d->n_materials; m++)
			if (may_meet(&l[k], &l[m])) c = limit_of_pair(d, s, l, k, m), take_shorter(fast, first, &c);
	}
	for (uint32_t b = 0; b < s->n_slot[SLOT_BODIES]; b++)
		for (uint32_t k = 0; k < d->n_materials; k++) {
			if (!isfinite(l[k].mass[0])) continue;
			c = limit_of(s, l[k].mass[0], l[k].radius, d->on_body[b * d->n_materials + k], (int32_t)b);
			take_shorter(fast, first, &c);
		}
}

static quern_real limit_of_lightest(
	const dem *d, const quern_step *s, const lightest *l, quern_real *hard, char reason[160]) {
	contact_limit fast = { .period = INFINITY, .hard = INFINITY }, first = fast;
	quern_real least = INFINITY;
	find_limits(d, s, l, &fast, &first);
	for (uint32_t k = 0; k < d->n_materials; k++) least = fmin(least, l[k].radius);
	*hard = first.hard;
	const quern_real share = share_of(d, s);
	const bool by_period = share * fast.period <= 0.5 * first.hard;
	if (isfinite(fast.period)) say_limit(&fast, &first, share, by_period, reason);
	else snprintf(reason, 160, "grains without a contact law");
	if (s->settling) {
		const quern_real wanted = d->settle_step * fast.period;
		return wanted <= first.hard ? wanted : 0.5 * first.hard;
	}
	const quern_real chosen = by_period ? share * fast.period : 0.5 * first.hard;
	const quern_real speed = d->moving ? quern_bodies_speed(s, SLOT_BODIES, s->time, INFINITY) : 0;
	if (!(0.1 * least < speed * chosen)) return chosen;
	snprintf(reason, 160, "bodies of %.3g m/s and grains of radius %.3g m", speed, least);
	return 0.1 * least / speed;
}

quern_real quern_dem_limit(const void *self, const quern_step *s, quern_real *hard, char reason[160]) {
	lightest l[MOST_MATERIALS];
	lightest_grains(self, s, l);
	return limit_of_lightest(self, s, l, hard, reason);
}

quern_real quern_dem_expected_step(const dem *d, const quern_step *s, uint64_t expected) {
	lightest l[MOST_MATERIALS];
	quern_real hard;
	char reason[160];
	for (uint32_t k = 0; k < d->n_materials; k++) {
		l[k] = (lightest) { .mass = { INFINITY, INFINITY }, .radius = INFINITY, .fixed = d->fixed };
		if (expected >> k & 1) expect(d, &l[k], k);
	}
	return limit_of_lightest(d, s, l, &hard, reason);
}
