/* SPDX-License-Identifier: MIT */
/* solver.mpm - the continuum: material points on a sparse grid. docs/theory/mpm.md */
#include "../common/fit.h"
#include "../common/height.h"
#include "../common/outlets.h"
#include "lattice.h"
#include <math.h>
#include <stdio.h>

static const char *const stresses[] = { "none", "at_rest", NULL };
static const char *const rasters[] = { "auto", "plain", "affine", NULL };
static const quern_param fill_rows[] = { REGION_ABOVE(mpm_fill),
	QUERN_PARAM(mpm_fill, velocity, "m/s", "Velocity at the start."),
	QUERN_PARAM(mpm_fill, jitter, "1",
		"Moves each point at the start along each axis at random, by at most this share of half the distance between points. With a "
		"small one, such as 0.001, several seeds show how much of a result is chance.",
		.max = 1),
	QUERN_PARAM(mpm_fill, stress, "1", "Stress at the start: none, or that of the weight above.",
		.choices = stresses),
	QUERN_PARAM(mpm_fill, lateral, "1", "Horizontal over vertical stress at rest.", .def = 0.6, .max = 10),
	QUERN_END_PARAMS };
static const quern_param source_rows[] = { SOURCE_KEYS(5), QUERN_END_PARAMS };
static const quern_param params[] = { QUERN_PARAM(mpm, cell, "m",
										  "Cell of the grid; the domain is a whole number of them.",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(mpm, points, "1", "Points per cell and axis at the start; a hybrid has 2.", .def = 2,
		.min = 1, .max = 8, .flags = QUERN_ONCE),
	QUERN_PARAM(mpm, fill, NULL, "Regions of material at the start; a hybrid starts from its grains alone.",
		.rows = fill_rows, .item_size = sizeof(mpm_fill), .flags = QUERN_ONCE),
	QUERN_PARAM(mpm, from, NULL,
		"A run whose points this one starts from: RUN for its last state, or RUN:FRAME for what a frame shows; its cell "
		"and points must be the same.",
		.flags = QUERN_FILE | QUERN_ONCE, .unless = "fill"),
	QUERN_PARAM(mpm, source, NULL, "Regions that pour material; in a hybrid its grains are poured alone.",
		.rows = source_rows, .item_size = sizeof(source)),
	QUERN_PARAM(mpm, rasterise, "1",
		"What points send to the nodes: their velocity (plain), or with it the velocity gradient of the last "
		"step, or what the transfer gives in its place (affine); auto: affine where a hybrid's coupling or "
		"the "
		"transfer asks for it.",
		.choices = rasters),
	QUERN_PARAM(mpm, affine, NULL, "Keep the gradient that points send; set by itself where one is needed.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, resample, "1",
		"Steps from one look at how many points cells hold to the next: holes within the material are filled from the points around, "
		"crowded points join; 0: never. A hybrid has its own.",
		.max = 1000000),
	QUERN_PARAM(mpm, resamples, NULL,
		"Look at how many points cells hold; set by itself where they are resampled.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, outlets, NULL,
		"Take out what passes an open face; set by itself where the domain has one.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, sources, NULL, "Keep books of sources; set by itself where there is one.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, relief, "1",
		"In a hybrid, stiffness of the least pressure of a cell too full, over the bulk modulus; 0: there is none.",
		.def = 0.3, .max = 1, .flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, answer, "1/s", "Rate at which the pressure rises to that.", .def = 300, .max = 1e9,
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, follow, "1",
		"Rate over the shear rate at which the density of points goes to their cell's, in a hybrid and in a material that "
		"flows; 0: it does not.",
		.def = 2, .max = 1e3, .flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, alone, NULL,
		"Count what cells hold; set by itself where density follows without a hybrid.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, counted, NULL,
		"Count the steps until cells are counted again, and how points lie in them; set by itself where density may follow.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, spread, "1",
		"Where density follows: rate over the shear rate at which points are spread over their cells; 0: they are not.",
		.def = 3, .max = 1e3, .flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, rest, "1",
		"In a hybrid, shear rate over sqrt(g/D) below which material is at rest and motion below the grid is stopped, of "
		"points and of the grains that meet them, and far above which volume answers; 0: neither is done. In a "
		"continuum alone over sqrt(g/h), of the cell h, and three times that much is where density follows.",
		.def = 0.003, .max = 1e6, .flags = QUERN_ADVANCED),
	QUERN_PARAM_AS(mpm, diameter, "grain.diameter", "m", "Mean diameter of the grains.",
		.from = "grain.diameter", .flags = QUERN_MAYBE | QUERN_ADVANCED, .max = 1e6),
	QUERN_PARAM(mpm, damping, "s",
		"Dashpots beside the elastic stress, over its moduli: waves of the angular frequency w lose w^2 times this of their energy in a "
		"second. A contact's dashpot over its stiffness is the order of what grains have.",
		.max = 1e6),
	QUERN_PARAM(mpm, damped, NULL, "Keep stresses of dashpots; set by itself where there is damping.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, cut, "1",
		"Share of a full cell's mass below which a node's force is limited; 0: that of the shape, 0.001, and for "
		"hats 1/8 over the points per cell and axis.",
		.max = 0.5, .flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, gain, "1",
		"In a continuum alone: energy that nobody has given, beyond as much again as there is, that ends the run, over what lifts all "
		"by a cell; 0: none does, and nobody tells of what is pressed too far. A hybrid has its own.",
		.def = 0.1, .max = 1e6, .flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, watches, NULL,
		"Look for energy that nobody has given, and for what is pressed too far; set by itself in a continuum alone.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, moving, NULL,
		"Ask for the work of bodies; set by itself where one moves and nobody else looks.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, rough, NULL,
		"Remember what rough bodies could still hold; set by itself where there is one.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(mpm, still, NULL, "Keep points out of bodies; set by itself where one stands still.",
		.flags = QUERN_ADVANCED),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static const quern_set sets[] = { { .name = "point",
									  .plural = "points",
									  .counted = 1,
									  .cost = { 32e-9, 70e-9 },
									  .doc = "Material points, sorted by grid block and cell." },
	{ .name = "node", .doc = "What points bring to the nodes.", .rows = 8 },
	{ .name = "motion", .doc = "How nodes move.", .rows = 8 },
	{ .name = "point_face",
		.plural = "point_faces",
		.doc = "What points took out through lower_x, upper_x, lower_y and so on.",
		.when = "outlets" },
	{ .name = "point_source",
		.plural = "point_sources",
		.doc = "What each source has poured.",
		.when = "sources" },
	{ .name = NULL } };

static quern_status place_fills(
	void *self, const quern_setup *, const quern_bound *shape, uint32_t n, quern_err *);
static quern_status place_sources(
	void *self, const quern_setup *, const quern_bound *shape, uint32_t n, quern_err *);

/* Regions first: plugins may take the height of the fill as a default. */
static const quern_slot slots[] = { { .name = "source.region",
										.kind = &quern_body_kind,
										.doc = "where it pours: in the shape of a body, such as {box: "
											   "{lower: ..., upper: ...}}",
										.stage = { "mpm.pour" },
										.filled = place_sources },
	{ .name = "fill.region",
		.kind = &quern_body_kind,
		.doc = "where material lies: in the shape of a body, such as {box: {lower: ..., upper: ...}}",
		.stage = { "mpm.fill" },
		.filled = place_fills },
	{ .name = "material",
		.kind = &quern_material_kind,
		.doc = "the constitutive model",
		.stage = { "mpm.gather", "mpm.fill" } },
	{ .name = "shape",
		.kind = &quern_shape_kind,
		.doc = "the shape functions",
		.def = "gimp",
		.stage = { "mpm.gather" } },
	{ .name = "transfer",
		.kind = &quern_transfer_kind,
		.doc = "from grid velocities to points",
		.def = "picflip",
		.stage = { "mpm.gather" },
		.particle = "point" },
	{ .name = "strain",
		.kind = &quern_strain_kind,
		.doc = "what of the velocity gradient goes into volume and stress",
		.def = "plain",
		.stage = { "mpm.gather" },
		.particle = "point" },
	{ .name = "bodies", .kind = &quern_body_kind, .list = 1, .stage = { "mpm.nodes" }, .same_as = "bodies" },
	{ .name = NULL } };

static const quern_use fill_uses[] = QUERN_USE_ROWS(FILL_USES);
static const quern_use pour_uses[] = QUERN_USE_ROWS(POUR_USES);
static const quern_use resample_uses[] = QUERN_USE_ROWS(RESAMPLE_USES);
static const quern_use outlet_uses[] = QUERN_USE_ROWS(OUTLET_USES);
static const quern_use hold_uses[] = QUERN_USE_ROWS(HOLD_USES);
static const quern_use sort_uses[] = QUERN_USE_ROWS(SORT_USES);
static const quern_use scatter_uses[] = QUERN_USE_ROWS(SCATTER_USES);
static const quern_use nodes_uses[] = QUERN_USE_ROWS(NODES_USES);
static const quern_use walls_uses[] = QUERN_USE_ROWS(WALLS_USES);
static const quern_use gather_uses[] = QUERN_USE_ROWS(GATHER_USES);
static const quern_use watch_uses[] = QUERN_USE_ROWS(WATCH_USES);

static const quern_stage stages[] = { { .name = "mpm.fill",
										  .doc = "Places the first points.",
										  .phase = QUERN_SETUP,
										  .uses = fill_uses,
										  .run = quern_mpm_fill },
	{ .name = "mpm.pour",
		.doc = "New points of sources.",
		.phase = QUERN_BEGIN,
		.flags = QUERN_SOMETIMES,
		.uses = pour_uses,
		.run = quern_mpm_pour,
		.when = "sources" },
	{ .name = "mpm.resample",
		.doc = "Fills holes between points, and joins points that crowd.",
		.phase = QUERN_BEGIN,
		.flags = QUERN_SOMETIMES,
		.uses = resample_uses,
		.run = quern_mpm_resample,
		.when = "resamples" },
	{ .name = "mpm.sort",
		.doc = "Orders points by block and cell, allocates blocks.",
		.phase = QUERN_DEPOSIT,
		.flags = QUERN_SOMETIMES,
		.uses = sort_uses,
		.run = quern_mpm_sort },
	{ .name = "mpm.scatter",
		.doc = "Points to nodes: mass, momentum, force.",
		.phase = QUERN_DEPOSIT,
		.uses = scatter_uses,
		.run = quern_mpm_scatter },
	{ .name = "mpm.nodes",
		.doc = "Grid velocities; bodies and faces.",
		.phase = QUERN_DEPOSIT,
		.uses = nodes_uses,
		.run = quern_mpm_nodes },
	{ .name = "mpm.walls",
		.doc = "Bodies and faces again, after a coupling.",
		.phase = QUERN_ADVANCE,
		.uses = walls_uses,
		.run = quern_mpm_walls },
	{ .name = "mpm.gather",
		.doc = "Nodes to points: velocity, position, volume, stress.",
		.phase = QUERN_ADVANCE,
		.uses = gather_uses,
		.run = quern_mpm_gather },
	{ .name = "mpm.hold",
		.doc = "Keeps points out of bodies.",
		.phase = QUERN_ADVANCE,
		.uses = hold_uses,
		.run = quern_mpm_hold,
		.when = "still" },
	{ .name = "mpm.outlets",
		.doc = "Takes out what has passed an open face.",
		.phase = QUERN_ADVANCE,
		.uses = outlet_uses,
		.run = quern_mpm_outlets,
		.when = "outlets" },
	{ .name = "mpm.watch",
		.doc = "Ends a run that has energy which nobody has given.",
		.phase = QUERN_END,
		.flags = QUERN_SOMETIMES,
		.uses = watch_uses,
		.run = quern_mpm_watch,
		.when = "watches" },
	{ .name = NULL } };

static quern_status place_sources(
	void *self, const quern_setup *setup, const quern_bound *shape, uint32_t n, quern_err *err) {
	mpm *p = self;
	if (quern_sources_place(&p->source, shape, REGION_OF_POINTS, setup, err) != QUERN_OK)
		return QUERN_E_PARAM;
	for (uint32_t i = 0; i < n; i++) {
		const source *item = quern_source_at(&p->source, i);
		const lattice l = lattice_of(p, item->lower, item->upper);
		char param[40];
		snprintf(param, sizeof param, "source.%u", i);
		if (l.wanted > MOST_POINTS)
			return setup->host->fail(err, QUERN_E_PARAM, param,
				"the region holds about %.2g points, more than %d: make cells larger", l.wanted, MOST_POINTS);
	}
	return QUERN_OK;
}

/* After the sources. */
static quern_status place_fills(
	void *self, const quern_setup *setup, const quern_bound *shape, uint32_t n, quern_err *err) {
	mpm *p = self;
	mpm_fill *fill = p->fill.items;
	fill_height loose = fill_height_of(setup);
	for (uint32_t i = 0; i < n; i++) {
		char param[40];
		snprintf(param, sizeof param, "fill.%u.region", i);
		if (quern_region_box(&shape[i], REGION_OF_POINTS, setup, param, err, fill[i].lower, fill[i].upper) !=
			QUERN_OK)
			return QUERN_E_PARAM;
		fill_height_add(&loose, fill[i].lower, fill[i].upper);
	}
	/* where nothing lies at first, what is poured piles up from the domain's end */
	for (uint32_t i = 0; i < p->source.n && !n; i++)
		fill_height_add(&loose, setup->lower, quern_source_at(&p->source, i)->upper);
	if (p->from) fill_height_add(&loose, setup->lower, setup->upper);
	const quern_real height = fill_height_all(&loose),
					 gravity = quern_gravity_size(setup->dim, setup->gravity);
	setup->host->publish(setup, "fill.height", "m", height);
	setup->host->publish(setup, "fill.rate", "1/s", height > 0 ? sqrt(gravity / height) : 0);
	return QUERN_OK;
}

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	mpm *p = self;
	p->dim = setup->dim;
	p->affine = p->rasterise == RASTERISE_AFFINE;
	for (uint32_t k = 0; k < p->dim; k++) {
		const quern_real cells = (setup->upper[k] - setup->lower[k]) / p->cell, whole = floor(cells + 0.5);
		if (whole < 1 || fabs(cells - whole) > 1e-6 * whole)
			return setup->host->fail(err, QUERN_E_PARAM, "cell",
				"the domain is %.6g cells wide along axis %u; it must be a whole number: make it %.6g m, or "
				"the cell %.6g m",
				cells, k, (whole < 1 ? 1 : whole) * p->cell,
				(setup->upper[k] - setup->lower[k]) / (whole < 1 ? 1 : whole));
	}
	const mpm_fill *fill = p->fill.items;
	for (uint32_t i = 0; i < p->fill.n; i++)
		if (quern_too_fast(fill[i].velocity, 1))
			return setup->host->fail(err, QUERN_E_PARAM, "fill", "the velocity is beyond that of light");
	if (p->from && setup->host->keeps(setup, "hybrid"))
		return setup->host->fail(err, QUERN_E_PARAM, "from",
			"a hybrid starts from its grains alone: give grains.from a run of grains");
	if (p->resample && setup->host->keeps(setup, "hybrid"))
		return setup->host->fail(err, QUERN_E_PARAM, "resample",
			"is for a continuum alone: a hybrid fills holes and joins points at its updates, as hybrid.update says");
	p->resamples = p->resamples || p->resample > 0;
	p->outlets = p->outlets || outlets_any(setup->open);
	p->watches = !setup->host->keeps(setup, "hybrid");
	/* in a hybrid there is none */
	const bool hybrid =
		setup->host->keeps(setup, "hybrid"); /* without one no mass comes to points but by flow */
	const quern_real gravity = quern_gravity_size(setup->dim, setup->gravity);
	p->rest_rate = hybrid && p->diameter > 0 ? p->rest * sqrt(gravity / p->diameter) : 0;
	p->rest_alone = p->rest * sqrt(gravity / p->cell);
	setup->host->publish(setup, "continuum.rest", "1/s", p->rest_rate);
	p->sources = (p->sources || p->source.n) && !setup->host->keeps(setup, "hybrid");
	p->stream = setup->stream;
	if (quern_sources_check(&p->source, setup, err) != QUERN_OK) return QUERN_E_PARAM;
	setup->host->publish(setup, "grid.cell", "m", p->cell);
	p->per_axis = hybrid ? 2 : p->points; /* a hybrid's updates make as many, whatever a fill would */
	setup->host->publish(setup, "continuum.half_width", "1", 0.5 / p->per_axis);
	return QUERN_OK;
}

/* A rough body rubs as the material does, or by a friction of its own that is of the same form; and none may end the continuum farther before itself than nodes see. */
static quern_status find_rough(mpm *p, const quern_setup *setup, const quern_bound *material,
	const quern_bound *body, uint32_t n, quern_err *err) {
	const quern_material_ops *ops = material->ops;
	char word[BODY_WORDS];
	for (uint32_t i = 0; i < n; i++) {
		if (isnan(((const body_item *)body[i].item)->slip)) continue;
		if (!ops->friction)
			return setup->host->fail(err, QUERN_E_PARAM, "material",
				"%s has no friction, which a rough boundary takes from the material: take mu_i, or another "
				"boundary for %s",
				material->id, quern_body_say(&body[i], i, word));
		p->rough = true;
	}
	for (uint32_t i = 0; i < n; i++) {
		const body_item *item = body[i].item;
		p->still = p->still || !quern_motion_is_any(&item->motion);
		if (!(item->displacement < p->cell))
			return setup->host->fail(err, QUERN_E_PARAM, "bodies",
				"the continuum would end %.3g m before %s, and cells of %.3g m do not know anything as far as "
				"that from a body: give a displacement that is less than a cell",
				item->displacement, quern_body_say(&body[i], i, word), p->cell);
	}
	rough_law *law = &p->rubbing;
	if (p->rough)
		ops->friction(material->self, setup->dim, &law->slow, &law->fast, &law->number, &law->density);
	return QUERN_OK;
}

static const quern_real recommended = 0.9; /* of the longest stable step */

/* m/s, of bodies from t = s->time on and of what sources pour. */
static quern_real fastest_given(const mpm *p, const quern_step *s) {
	quern_real square = 0;
	for (uint32_t i = 0; i < p->source.n && p->sources; i++) {
		const quern_real *v = quern_source_at(&p->source, i)->velocity;
		const quern_real v2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
		square = v2 > square ? v2 : square;
	}
	const quern_real bodies = quern_bodies_speed(s, SLOT_BODIES, s->time, INFINITY), poured = sqrt(square);
	return bodies > poured ? bodies : poured;
}

/* 1/s, of stress waves: omega^2 = chi max(d K, 2 G)/rho for any arrangement of points. */
static quern_real frequency(const mpm *p) {
	const quern_real modulus = p->dim * p->bulk > 2 * p->shear ? p->dim * p->bulk : 2 * p->shear;
	return sqrt(p->stiffness * modulus / p->loosest) / p->cell;
}

/* 1/s; with advection dt (omega/2 + |v|/h) < 1. Dashpots, which see the motion of the step before, ask for (omega dt)^2 + 2 T omega^2 dt < 4. */
static quern_real rate_at(const mpm *p, quern_real fastest) {
	const quern_real half = 0.5 * frequency(p), damped = half * p->damping;
	return half * (damped + sqrt(1 + damped * damped)) + fastest / p->cell;
}

static quern_status ready(void *self, const quern_setup *setup, const quern_bound *const *slot,
	const uint32_t *n_slot, quern_err *err) {
	mpm *p = self;
	const mpm_fill *fill = p->fill.items;
	for (uint32_t i = 0; i < p->fill.n; i++) {
		char param[40];
		snprintf(param, sizeof param, "fill.%u.above", i);
		if (quern_region_check_above(&fill[i].above, n_slot[SLOT_BODIES], setup, param, err) != QUERN_OK)
			return QUERN_E_PARAM;
	}
	if (setup->host->keeps(setup, "grains") && !setup->host->keeps(setup, "hybrid"))
		return setup->host->fail(err, QUERN_E_PARAM, NULL,
			"grains and continuum do not feel each other without a section hybrid; add it, or keep one of "
			"them "
			"with 'model: grains' or 'model: continuum'");
	p->moving = p->watches && quern_bodies_move(slot[SLOT_BODIES], n_slot[SLOT_BODIES]);
	const quern_strain_ops *strain = slot[SLOT_STRAIN]->ops;
	if (strain->means > QUERN_STRAIN_MOST || (strain->means > 0 && !strain->measure[setup->dim - 2]))
		return setup->host->fail(err, QUERN_E_PARAM, "strain",
			"%s asks for %u means, of at most %d, and must measure them", slot[SLOT_STRAIN]->id,
			strain->means, QUERN_STRAIN_MOST);
	const quern_bound *material = slot[SLOT_MATERIAL], *shape = slot[SLOT_SHAPE],
					  *transfer = slot[SLOT_TRANSFER];
	p->matrix = ((const quern_transfer_ops *)transfer->ops)->affine != 0;
	p->moments = p->matrix && fit_has_moments(shape, setup->dim);
	if (p->matrix && p->rasterise == RASTERISE_PLAIN)
		return setup->host->fail(err, QUERN_E_PARAM, "rasterise",
			"is plain, and %s makes a matrix that points send with their velocity: take auto", transfer->id);
	p->affine = p->affine || p->matrix;
	p->damped = p->damped || p->damping > 0;
	const quern_material_ops *ops = material->ops;
	ops->moduli(material->self, setup->dim, &p->bulk, &p->shear, &p->density);
	p->bears = 0.5 * p->density * quern_gravity_size(setup->dim, setup->gravity) * p->cell;
	p->loosest = ops->loosest ? ops->loosest(material->self) : p->density;
	const bool hybrid = setup->host->keeps(setup, "hybrid");
	p->alone = ops->friction && (p->follow > 0 || p->alone) && p->rest > 0 && !hybrid;
	/* in a hybrid always, so that a stage may spread points or not */
	p->counted = p->alone || (ops->friction && hybrid);
	((const quern_shape_ops *)shape->ops)->shares(shape->self, &p->share_wall, &p->share_next);
	p->stiffness = ((const quern_shape_ops *)shape->ops)->stiffness(shape->self);
	p->light = quern_shape_light(shape->ops, p->per_axis);
	if (find_rough(p, setup, material, slot[SLOT_BODIES], n_slot[SLOT_BODIES], err) != QUERN_OK)
		return QUERN_E_PARAM;
	setup->host->publish(setup, "continuum.density", "kg/m^3", p->density);
	setup->host->publish(setup, "continuum.bulk_modulus", "Pa", p->bulk);
	const quern_step before = quern_bodies_before(setup, slot, n_slot);
	setup->host->publish(setup, "continuum.step", "s", recommended / rate_at(p, fastest_given(p, &before)));
	return QUERN_OK;
}

static quern_real limit(const void *self, const quern_step *s, quern_real *hard, char reason[160]) {
	const mpm *p = self;
	const uint32_t n = s->host->set(s->run, "point").n;
	quern_real fastest = 0;
	for (uint32_t i = 0; i < n; i++) {
		const quern_real v2 = cloud_square(&s->use[FILL_VELOCITY], i, s->dim);
		fastest = v2 > fastest ? v2 : fastest;
	}
	const quern_real given = fastest_given(p, s);
	fastest = sqrt(fastest);
	fastest = given > fastest ? given : fastest;
	const quern_real rate = rate_at(p, fastest);
	snprintf(reason, 160, "stress waves of %s in cells of %.3g m%s", s->slot[SLOT_MATERIAL][0].id, p->cell,
		fastest > 0.5 * frequency(p) * p->cell ? " and the speed of points or bodies" : "");
	*hard = 1 / rate;
	return recommended / rate;
}

enum { SUM_ELASTIC = SUM_OWN, SUM_LEFT, SUM_POURED };
static const quern_output sums[] = { ACCOUNT_ROWS,
	{ .name = "elastic", .unit = "J", .doc = "Stored in the material, where energy is observed." }, FLOW_ROWS,
	{ .name = NULL } };

static void account(const void *self, const quern_step *s, quern_real *out) {
	const quern_column *u = s->use;
	const cloud points = { u[FILL_MASS].real[0], u[FILL_WEIGHT].real[0], NULL,
		s->host->set(s->run, "point").n, "point" };
	cloud_sums c;
	(void)self;
	out[SUM_LEFT] = book_total(u[FILL_LEFT].real[0], outlet_faces(s));
	out[SUM_POURED] = book_total(u[FILL_POURED].real[0], s->host->set(s->run, "point_source").n);
	if (!points.n || !cloud_open(&c, s->host, s->run, &points)) return;
	cloud_account(&c, &u[FILL_POSITION], &u[FILL_VELOCITY], s, out);
	CLOUD_ADD(&c, i, 0.5 * cloud_square(&u[FILL_VELOCITY], i, s->dim), out[SUM_KINETIC]);
	if (u[FILL_ENERGY].real[0]) CLOUD_ADD(&c, i, u[FILL_ENERGY].real[0][i], out[SUM_ELASTIC]);
}

static quern_real cell(const void *self) { return ((const mpm *)self)->cell; }

static quern_status accept(const void *self, const quern_step *s) {
	(void)self;
	if (quern_positions_hold(s, &s->use[FILL_POSITION], s->host->set(s->run, "point").n)) return QUERN_OK;
	return s->host->stop(
		s->run, QUERN_E_NUMERIC, NULL, -1, "point.position holds a position far outside of the domain");
}

static const char *const takes[] = { "point", NULL },
						 *const essential[] = { "point.position", "point.velocity", "point.mass",
							 "point.volume", "point.stress", NULL },
						 *const same[] = { "cell", "points", NULL }, *const unlike[] = { "hybrid", NULL };
static const char *const with[] = { "bodies", NULL }, *const after[] = { "bodies", "grains", NULL };

static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "continuum", .with = with,
	.after = after, .sets = sets, .slots = slots, .stages = stages, .sums = sums, .ready = ready,
	.limit = limit, .account = account, .cell = cell, .accept = accept, .from = "from", .takes = takes,
	.essential = essential, .same = same, .unlike = unlike };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 13,
	.dims = QUERN_2D | QUERN_3D,
	.id = "solver.mpm",
	.brief = "The continuum: material points on a sparse grid.",
	.doc = "Explicit, stress last; shape functions folded at walls; blocks of 64 cells allocated where there "
		   "is material.",
	.cite = "Sulsky et al. 1994; Bardenhagen & Kober 2004",
	.instance_size = sizeof(mpm),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
