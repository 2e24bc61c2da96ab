/* SPDX-License-Identifier: MIT */
/* solver.dem - grains: discs and spheres with contact laws. docs/theory/grains.md */
#include "../common/height.h"
#include "../common/outlets.h"
#include "dem.h"
#include <math.h>
#include <quern/math.h>
#include <stdio.h>

static const char *const radius_laws[] = { "normal", "uniform", NULL };
static const quern_param fill_rows[] = { QUERN_PARAM_AS(dem_fill, lower, "region.box.lower", "m",
											 "Lower corner of the region of centres.",
											 .flags = QUERN_REQUIRED),
	QUERN_PARAM_AS(dem_fill, upper, "region.box.upper", "m",
		"Upper corner; may equal the lower one along an axis.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(dem_fill, velocity, "m/s", "Velocity at the start."),
	QUERN_PARAM(dem_fill, settle, NULL, "Let the grains come to rest before time starts."),
	QUERN_PARAM(dem_fill, fixed, NULL, "These grains never move: a rough floor."), QUERN_END_PARAMS };
static const quern_param place_rows[] = { QUERN_PARAM(
											  dem_place, position, "m", "Centre.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(dem_place, velocity, "m/s", "Velocity."),
	QUERN_PARAM(dem_place, spin, "rad/s", "Angular velocity; in 2-D the first number counts."),
	QUERN_PARAM(dem_place, radius, "m", "Radius; default: the mean.", .flags = QUERN_MAYBE | QUERN_MIN_OPEN,
		.max = 1e6),
	QUERN_PARAM(dem_place, fixed, NULL, "It never moves."), QUERN_END_PARAMS };
static const quern_param source_rows[] = SOURCE_ROWS(100);
static const quern_param params[] = { QUERN_PARAM_AS(dem, density, "material.density", "kg/m^3",
										  "Density of the grains' material.",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN | QUERN_ONCE, .max = 1e6),
	QUERN_PARAM_AS(dem, radii.mean, "material.radius.mean", "m", "Mean radius.",
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM_AS(dem, radii.spread, "material.radius.spread", "1",
		"Over the mean: standard deviation (normal, cut at two of them) or half-width (uniform).",
		.max = 0.45),
	QUERN_PARAM_AS(
		dem, radii.law, "material.radius.law", "1", "Distribution of radii.", .choices = radius_laws),
	QUERN_PARAM(
		dem, fill, NULL, "Regions to fill with grains.", .rows = fill_rows, .item_size = sizeof(dem_fill)),
	QUERN_PARAM(dem, place, NULL, "Single grains.", .rows = place_rows, .item_size = sizeof(dem_place)),
	QUERN_PARAM(dem, file, NULL, "Grains from a table with a header line: x y [z] radius [vx vy vz] [fixed].",
		.flags = QUERN_FILE),
	QUERN_PARAM(
		dem, source, NULL, "Regions that pour grains.", .rows = source_rows, .item_size = sizeof(source)),
	QUERN_PARAM(dem, skin, "1",
		"Verlet skin over the mean diameter; results do not depend on it, the cost does.", .def = 0.1,
		.planar = 0.2, .min = 0.001, .max = 2, .flags = QUERN_PLANAR | QUERN_ADVANCED),
	QUERN_PARAM_AS(dem, overlap_most, "overlap.most", "1",
		"Overlap over the smaller radius that ends the run where it lasts; 0: none does.", .def = 0.1,
		.max = 1e6),
	QUERN_PARAM_AS(dem, overlap_start, "overlap.start", "1",
		"Overlap over the smaller radius that grains of place and file may have at the start.", .def = 0.01,
		.max = 1e6),
	QUERN_PARAM_AS(dem, rest, "settle.energy", "1",
		"At rest when the mean kinetic energy of a grain is below this share of m g d.", .def = 1e-5,
		.flags = QUERN_MIN_OPEN, .max = 1),
	QUERN_PARAM_AS(dem, settle_step, "settle.step", "1",
		"Step while settling, over half the shortest period of a contact.", .def = 0.1, .max = 0.2,
		.flags = QUERN_MIN_OPEN),
	QUERN_PARAM_AS(dem, settle_most, "settle.most", "1",
		"Most steps of settling; then the run goes on with a warning.", .def = 1e6, .min = 1, .max = 2e9),
	QUERN_PARAM(dem, fixed, NULL,
		"Keep a flag for grains that do not move; set by itself where one is needed.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(dem, features, NULL,
		"Keep with every touch which feature of the body it is on; set by itself where bodies have several.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(dem, moving, NULL, "Watch how far bodies have moved; set by itself where one does.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(dem, outlets, NULL,
		"Take out what passes an open face; set by itself where the domain has one.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(dem, sources, NULL, "Keep books of sources; set by itself where there is one.",
		.flags = QUERN_ADVANCED),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static const quern_set sets[] = { { .name = "grain",
									  .plural = "grains",
									  .doc = "Discs or spheres, sorted by block and cell.",
									  .counted = 1,
									  .cost = { 40e-9, 100e-9 } },
	{ .name = "contact",
		.plural = "contacts",
		.doc = "Pairs of grains that are near; by block, pairs across blocks in both." },
	{ .name = "touch",
		.plural = "touches",
		.doc = "Grains near bodies, by block, body and grain.",
		.slot = "bodies" },
	{ .name = "grain_face",
		.plural = "grain_faces",
		.doc = "What grains took out through lower_x, upper_x, lower_y and so on.",
		.when = "outlets" },
	{ .name = "grain_source",
		.plural = "grain_sources",
		.doc = "What each source has poured.",
		.when = "sources" },
	{ .name = NULL } };

static const quern_slot slots[] = {
	{ .name = "contact",
		.kind = &quern_contact_kind,
		.doc = "a contact law, such as {linear: {stiffness: 1e6 N/m}}; forces of a list add up, [] is none",
		.list = 1,
		.required = 1,
		.stage = { "dem.forces" },
		.repeat = "contact",
		.again = "touch" },
	{ .name = "neighbours",
		.kind = &quern_neighbours_kind,
		.doc = "the search for near pairs",
		.def = "cells",
		.stage = { "dem.neighbours" } },
	{ .name = "integrator",
		.kind = &quern_integrator_kind,
		.doc = "the step in time",
		.def = "symplectic_euler",
		.stage = { "dem.forces", "dem.open" } },
	{ .name = "bodies", .kind = &quern_body_kind, .list = 1, .stage = { "dem.forces" }, .same_as = "bodies" },
	{ .name = "fill.packer",
		.kind = &quern_packer_kind,
		.doc = "who places the grains",
		.def = "two_point_tangent",
		.stage = { "dem.fill" } },
	{ .name = "settling",
		.kind = &quern_integrator_kind,
		.doc = "the step in time while settling",
		.def = "damped",
		.stage = { "dem.forces", "dem.open" } },
	{ .name = "source.packer",
		.kind = &quern_packer_kind,
		.doc = "who places the grains",
		.def = "random",
		.stage = { "dem.pour" } },
	{ .name = NULL }
};

static const quern_use fill_uses[] = QUERN_USE_ROWS(FILL_USES);
static const quern_use pour_uses[] = QUERN_USE_ROWS(POUR_USES);
static const quern_use outlet_uses[] = QUERN_USE_ROWS(OUTLET_USES);
static const quern_use open_uses[] = QUERN_USE_ROWS(OPEN_USES);
static const quern_use near_uses[] = QUERN_USE_ROWS(NEAR_USES);
static const quern_use force_uses[] = QUERN_USE_ROWS(FORCE_USES);
static const quern_use observe_uses[] = QUERN_USE_ROWS(OBSERVE_USES);

static const quern_stage stages[] = { { .name = "dem.fill",
										  .doc = "Places the first grains.",
										  .phase = QUERN_SETUP,
										  .uses = fill_uses,
										  .run = quern_dem_fill },
	{ .name = "dem.pour",
		.doc = "New grains of sources.",
		.phase = QUERN_BEGIN,
		.flags = QUERN_SOMETIMES,
		.uses = pour_uses,
		.run = quern_dem_pour,
		.when = "sources" },
	{ .name = "dem.open",
		.doc = "The integrator's part before the forces, if it has one.",
		.phase = QUERN_SUBSTEP,
		.flags = QUERN_SETTLES,
		.uses = open_uses,
		.run = quern_dem_open },
	{ .name = "dem.neighbours",
		.doc = "Sorts grains, lists near pairs, carries their history.",
		.phase = QUERN_SUBSTEP,
		.flags = QUERN_SOMETIMES | QUERN_SETTLES,
		.uses = near_uses,
		.run = quern_dem_neighbours },
	{ .name = "dem.forces",
		.doc = "Block by block: test, laws, sums, integration.",
		.phase = QUERN_SUBSTEP,
		.flags = QUERN_SETTLES,
		.uses = force_uses,
		.run = quern_dem_forces },
	{ .name = "dem.outlets",
		.doc = "Takes out what has passed an open face.",
		.phase = QUERN_SUBSTEP,
		.flags = QUERN_SETTLES,
		.uses = outlet_uses,
		.run = quern_dem_outlets,
		.when = "outlets" },
	{ .name = "dem.list",
		.doc = "The list of the release, before anything has moved.",
		.phase = QUERN_OUTPUT,
		.flags = QUERN_SOMETIMES,
		.uses = near_uses,
		.run = quern_dem_list },
	{ .name = "dem.observe",
		.doc = "Forces and energies of the state as it is.",
		.phase = QUERN_OUTPUT,
		.uses = observe_uses,
		.run = quern_dem_observe },
	{ .name = NULL } };

static quern_status refuse_settling(const dem *d, const quern_setup *setup, quern_err *err, const char *why) {
	const dem_fill *fill = d->fill.items;
	char param[40];
	uint32_t i = 0;
	while (i + 1 < d->fill.n && !fill[i].settle) i++;
	snprintf(param, sizeof param, "fill.%u.settle", i);
	return setup->host->fail(err, QUERN_E_PARAM, param, "%s", why);
}

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	dem *d = self;
	fill_height loose = fill_height_of(setup);
	d->dim = setup->dim;
	d->radii.stream = setup->stream;
	const dem_fill *fill = d->fill.items;
	for (uint32_t i = 0; i < d->fill.n; i++) {
		for (uint32_t k = 0; k < d->dim; k++) {
			if (!(fill[i].upper[k] >= fill[i].lower[k]))
				return setup->host->fail(err, QUERN_E_PARAM, "fill",
					"the region's upper corner must not be below the lower "
					"one; axis %u is",
					k);
			/* a rough floor may be let into a wall */
			const quern_real slack = fill[i].fixed ? setup->upper[k] - setup->lower[k] : 0;
			if (fill[i].lower[k] < setup->lower[k] - slack || fill[i].upper[k] > setup->upper[k] + slack)
				return setup->host->fail(
					err, QUERN_E_PARAM, "fill", "the region reaches out of the domain along axis %u", k);
		}
		if (quern_too_fast(fill[i].velocity, 1))
			return setup->host->fail(err, QUERN_E_PARAM, "fill", "the velocity is beyond that of light");
		if (!fill[i].fixed) fill_height_add(&loose, fill[i].lower, fill[i].upper);
		d->fixed = d->fixed || fill[i].fixed;
		d->settles = d->settles || fill[i].settle;
	}
	const dem_place *place = d->place.items;
	for (uint32_t i = 0; i < d->place.n; i++) d->fixed = d->fixed || place[i].fixed;
	if (!d->fill.n && !d->place.n && !d->file && !d->source.n)
		return setup->host->fail(err, QUERN_E_PARAM, NULL, "no grains: give fill, place, file or source");
	if (quern_sources_check(&d->source, true, setup, err) != QUERN_OK) return QUERN_E_PARAM;
	d->outlets = d->outlets || outlets_any(setup->open);
	d->sources = d->sources || d->source.n;
	setup->host->publish(setup, "grain.sources", "1", d->source.n);
	if (d->file) d->fixed = true; /* its header may say so */
	const quern_real gravity = quern_gravity_size(setup->dim, setup->gravity), diameter = 2 * d->radii.mean;
	if (d->settles && !(gravity > 0) && !setup->later)
		return refuse_settling(d, setup, err, "there is no gravity: nothing would come to rest by it");
	setup->host->publish(setup, "grain.settling_rate", "1/s", 0.1 * sqrt(gravity / diameter));
	setup->host->publish(setup, "grain.diameter", "m", diameter);
	/* points that are made of grains come by quadrants, two per cell and axis, whatever the continuum's own fill has */
	setup->host->publish(setup, "continuum.half_width", "1", 0.25);
	setup->host->publish(setup, "grain.density", "kg/m^3", d->density);
	setup->host->publish(setup, "grain.radius_spread", "1", d->radii.spread);
	setup->host->publish(setup, "grain.radius_law", "1", d->radii.law);
	const quern_real height = fill_height_all(&loose);
	d->height = height > 0 ? height : setup->upper[loose.axis] - setup->lower[loose.axis];
	setup->host->publish(setup, "fill.height", "m", d->height);
	setup->host->publish(setup, "fill.rate", "1/s", height > 0 ? sqrt(gravity / height) : 0);
	return QUERN_OK;
}

/* The largest grain that any source brings; a table that cannot be read is found later, with its place. */
static quern_real widest(const dem *d) {
	const dem_place *place = d->place.items;
	quern_real most = quern_radius_most(&d->radii);
	grain_table table = { 0 };
	char why[200];
	for (uint32_t i = 0; i < d->place.n; i++) most = place[i].radius > most ? place[i].radius : most;
	if (d->file && quern_grain_table_load(d->file, d->dim, &table, why))
		for (uint32_t i = 0; i < table.n; i++)
			most = table.grain[i].radius > most ? table.grain[i].radius : most;
	quern_grain_table_finish(&table);
	return most;
}

/* How far the law acts beyond touching, between two of the largest grains and of one on each body. */
static void find_reach(dem *d, const quern_bound *law, quern_real radius, uint32_t bodies) {
	const quern_contact_ops *ops = law->ops;
	quern_real reach = ops->reach(law->self, 0.5 * radius);
	for (uint32_t b = 0; b < bodies; b++) {
		const quern_real on_body = ops->reach(law->n_variant ? law->variant[b] : law->self, radius);
		reach = on_body > reach ? on_body : reach;
	}
	d->reach = reach > d->reach ? reach : d->reach;
}

/* A law that is bounded by the force of those before it in the list does nothing where there are none. */
static quern_status refuse_order(const quern_setup *setup, const quern_bound *law, quern_err *err) {
	return setup->host->fail(err, QUERN_E_PARAM, "contact",
		"%s does nothing at the head of the list: it is bounded by the normal force of the laws before it; "
		"put one "
		"that pushes there, such as linear",
		law->id);
}

/* A random packing's bulk modulus, from the affine estimates of docs/theory/grains.md, section 5, with what real
 * packings reach of them: 0.3 k_n for discs, 0.6 of z phi k_n / (3 pi D) for spheres (z = 5). */
static quern_status ready(void *self, const quern_setup *setup, const quern_bound *const *slot,
	const uint32_t *n_slot, quern_err *err) {
	dem *d = self;
	quern_real kn = 0, most = 0;
	if (d->settles && !n_slot[SLOT_CONTACT])
		return refuse_settling(d, setup, err, "without a contact law grains fall for ever: give contact one");
	if (n_slot[SLOT_CONTACT] && ((const quern_contact_ops *)slot[SLOT_CONTACT][0].ops)->follows)
		return refuse_order(setup, &slot[SLOT_CONTACT][0], err);
	d->features = false;
	d->moving = n_slot[SLOT_BODIES] && quern_bodies_move(slot[SLOT_BODIES], n_slot[SLOT_BODIES]);
	for (uint32_t b = 0; b < n_slot[SLOT_BODIES]; b++)
		d->features = d->features || ((const quern_body_ops *)slot[SLOT_BODIES][b].ops)->features;
	const quern_real packing = d->dim == 2 ? 0.82 : 0.60, diameter = 2 * d->radii.mean;
	const quern_real gravity = quern_gravity_size(setup->dim, setup->gravity);
	const quern_real pressure = packing * d->density * gravity * d->height;
	const quern_real force = pressure * diameter * (d->dim == 3 ? diameter : 1);
	for (uint32_t l = 0; l < n_slot[SLOT_CONTACT]; l++) {
		const quern_bound *law = &slot[SLOT_CONTACT][l];
		const quern_contact_ops *ops = law->ops;
		const quern_real k =
			ops->stiffness ? ops->stiffness(law->self, d->dim, 0.5 * d->radii.mean, 0.5 * force) : 0;
		kn += k;
		if (k > most) most = k, d->stiffest = law->id;
		if (ops->reach) find_reach(d, law, widest(d), n_slot[SLOT_BODIES]);
	}
	const quern_real bulk =
		d->dim == 2 ? 0.3 * kn : 0.6 * 5 * packing * kn / (3 * 3.141592653589793 * diameter);
	d->stiffness = kn;
	d->sinks = kn > 0 ? force / (kn * diameter) : 0;
	setup->host->publish(setup, "grain.stiffness", "N/m", kn);
	setup->host->publish(setup, "grain.bulk_modulus", "Pa", bulk);
	setup->host->publish(setup, "grain.packed_density", "kg/m^3", packing * d->density);
	setup->host->publish(setup, "grain.critical_density", "kg/m^3", (packing - 0.03) * d->density);
	return QUERN_OK;
}

/* ---- the step ---- */

/* A kind of contact as the step sees it: half the shortest period, the limit of the step, and the damping ratio at that
 * period. The stiffest of its laws gives the name. */
typedef struct {
	quern_real period, hard, damping;
	const char *law, *where, *body;
	uint32_t others; /* laws beside that one */
} contact_limit;

/* The fastest mode of a packing: a grain has several contacts. omega_max^2 = 6 k/m of a triangular lattice and 8 k/m
 * of a face-centred one are 3 and 4 times that of a pair. */
static quern_real crowding(uint32_t dim) { return dim == 2 ? 1.7320508075688772 : 2; }

/* All laws together: stiffnesses add up, and so do the squares of frequencies; damping coefficients too. */
static contact_limit all_laws(const quern_step *s, quern_real mass, quern_real radius, int32_t body) {
	contact_limit c = { .period = INFINITY, .hard = INFINITY };
	quern_real square = 0, drag = 0, shortest = INFINITY;
	uint32_t n = 0;
	for (uint32_t l = 0; l < s->n_slot[SLOT_CONTACT]; l++) {
		const quern_bound *law = &s->slot[SLOT_CONTACT][l];
		const quern_contact_ops *ops = law->ops;
		const void *self = body >= 0 && law->n_variant ? law->variant[body] : law->self;
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

/* 0.2 of the half-period, or the limit of explicit dashpots in a packing, omega dt < 2 (sqrt(1 + zeta^2) - zeta). */
static contact_limit limit_of(const quern_step *s, quern_real mass, quern_real radius, int32_t body) {
	contact_limit c = all_laws(s, mass, radius, body);
	const quern_real crowd = crowding(s->dim), zeta = crowd * c.damping;
	const quern_real damped = 2 * (sqrt(1 + zeta * zeta) - zeta) / crowd * c.period / 3.141592653589793;
	c.hard = damped < 0.2 * c.period ? damped : 0.2 * c.period;
	c.where = "of the lightest grain on ";
	c.body = body >= 0 ? s->slot[SLOT_BODIES][body].id : "";
	return c;
}

static void say_limit(
	const contact_limit *fast, const contact_limit *hard, bool by_period, char reason[160]) {
	const contact_limit *c = by_period ? fast : hard;
	const bool same = c->period == hard->period && c->damping == hard->damping;
	char others[24] = "", damped[120] = "";
	if (c->others) snprintf(others, sizeof others, " and %u more", c->others);
	if (hard->hard < 0.2 * hard->period)
		snprintf(damped, sizeof damped, "%s%s%s, damping ratio %.3g", same ? "" : "; hard limit ",
			same ? "" : hard->where, same ? "" : hard->body, hard->damping);
	snprintf(reason, 160, "%s%s %s%s, half-period %.3g s%s%s", c->law, others, c->where, c->body, c->period,
		by_period ? " / 50" : "", damped);
}

typedef struct {
	quern_real mass[2],
		radius; /* of the two lightest, the second infinite if there is one alone; of the lightest */
} lightest;

/* Before there are grains, and where sources bring more, what the distribution may bring. */
static lightest lightest_grains(const dem *d, const quern_step *s) {
	const uint32_t n = s->host->set(s->run, "grain").n;
	const quern_real *mass = s->use[FILL_MASS].real[0], *radius = s->use[FILL_RADIUS].real[0];
	const int32_t *fixed = s->use[FILL_FIXED].index;
	lightest l = { { INFINITY, INFINITY }, INFINITY };
	for (uint32_t i = 0; i < n; i++) {
		if (fixed && fixed[i]) continue;
		if (mass[i] < l.mass[0]) l.mass[1] = l.mass[0], l.mass[0] = mass[i], l.radius = radius[i];
		else if (mass[i] < l.mass[1]) l.mass[1] = mass[i];
	}
	if (isfinite(l.mass[0]) && !d->source.n) return l;
	const quern_real least = quern_radius_least(&d->radii),
					 light = quern_radius_mass(least, d->density, d->dim);
	if (light < l.mass[0]) l.mass[0] = light, l.radius = least;
	if (light < l.mass[1]) l.mass[1] = light;
	return l;
}

static contact_limit limit_of_pair(const quern_step *s, const lightest *l) {
	const bool two = isfinite(l->mass[1]);
	const quern_real pair = two ? l->mass[0] * l->mass[1] / (l->mass[0] + l->mass[1]) : l->mass[0];
	contact_limit c = limit_of(s, pair, 0.5 * l->radius, -1);
	c.where = two ? "between the two lightest grains" : "on the lightest grain";
	return c;
}

/* The stiffest contact is that of the two lightest grains, or of the lightest against a body. */
static quern_real limit(const void *self, const quern_step *s, quern_real *hard, char reason[160]) {
	const dem *d = self;
	const lightest l = lightest_grains(d, s);
	contact_limit fast = limit_of_pair(s, &l),
				  first = fast; /* the shortest; the first to fail when the step grows */
	for (uint32_t b = 0; b < s->n_slot[SLOT_BODIES]; b++) {
		const contact_limit c = limit_of(s, l.mass[0], l.radius, (int32_t)b);
		if (c.period < fast.period) fast = c;
		if (c.hard < first.hard) first = c;
	}
	*hard = first.hard;
	const bool by_period = fast.period / 50 <= 0.5 * first.hard;
	if (isfinite(fast.period)) say_limit(&fast, &first, by_period, reason);
	else snprintf(reason, 160, "grains without a contact law");
	if (s->settling && d->settle_step * fast.period < first.hard) return d->settle_step * fast.period;
	const quern_real chosen = by_period ? fast.period / 50 : 0.5 * first.hard;
	const quern_real speed =
		d->moving && !s->settling ? quern_bodies_speed(s, SLOT_BODIES, s->time, INFINITY) : 0;
	if (!(0.1 * l.radius < speed * chosen)) return chosen;
	snprintf(reason, 160, "bodies of %.3g m/s and grains of radius %.3g m", speed, l.radius);
	return 0.1 * l.radius / speed;
}

enum { SUM_DISCRETE = SUM_OWN, SUM_LEFT, SUM_POURED };
static const quern_output sums[] = { ACCOUNT_ROWS,
	{ .name = "discrete", .unit = "kg", .doc = "Carried by grains." }, FLOW_ROWS, { .name = NULL } };

static void account(const void *self, const quern_step *s, quern_real *out) {
	const quern_column *use = s->use;
	const cloud grains = dem_cloud(s, use[FILL_WEIGHT].real[0]);
	const quern_real *radius = use[FILL_RADIUS].real[0], turning = quern_radius_inertia(s->dim);
	const uint32_t n_spin = !use[FILL_SPIN].real[0] ? 0 : s->dim == 3 ? 3 : 1;
	cloud_sums c;
	(void)self;
	out[SUM_LEFT] = book_total(use[FILL_LEFT].real[0], outlet_faces(s));
	out[SUM_POURED] = book_total(use[FILL_POURED].real[0], s->host->set(s->run, "grain_source").n);
	if (!grains.n || !cloud_open(&c, s->host, s->run, &grains)) return;
	cloud_account(&c, &use[FILL_POSITION], &use[FILL_VELOCITY], s, out);
	out[SUM_DISCRETE] += cloud_total(&c);
	CLOUD_ADD(&c, i,
		0.5 * (cloud_square(&use[FILL_VELOCITY], i, s->dim) +
				  turning * radius[i] * radius[i] * cloud_square(&use[FILL_SPIN], i, n_spin)),
		out[SUM_KINETIC]);
}

/* Radii become numbers of cells too. A fixed grain may be a floor as wide as the domain, and rounder. */
static bool radii_hold(const quern_step *s, const quern_real *radius, uint32_t n) {
	quern_real widest = 0;
	for (uint32_t k = 0; k < s->dim; k++) widest = fmax(widest, s->upper[k] - s->lower[k]);
	for (uint32_t i = 0; i < n; i++)
		if (!(radius[i] > 0 && radius[i] <= 10 * widest)) return false;
	return true;
}

static quern_status accept(const void *self, const quern_step *s) {
	const uint32_t n = s->host->set(s->run, "grain").n;
	(void)self;
	if (!radii_hold(s, s->use[FILL_RADIUS].real[0], n))
		return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
			"grain.radius holds a radius of no grain, or far wider than the domain");
	if (!quern_positions_hold(s, &s->use[FILL_POSITION], n))
		return s->host->stop(
			s->run, QUERN_E_NUMERIC, NULL, -1, "grain.position holds a position far outside of the domain");
	return QUERN_OK;
}

static const char *const with[] = { "bodies", NULL };

static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "grains", .with = with, .after = with,
	.sets = sets, .slots = slots, .stages = stages, .sums = sums, .ready = ready, .limit = limit,
	.settled = quern_dem_settled, .account = account, .settling = quern_dem_settling, .accept = accept };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "solver.dem",
	.brief = "Grains: discs and spheres with contact laws.",
	.doc = "The discrete element method with linked cells, Verlet lists and batches of contacts.",
	.cite = "Cundall & Strack 1979",
	.instance_size = sizeof(dem),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
