/* SPDX-License-Identifier: MIT */
/* solver.hybrid - who is where: zones, conversions, the coupling of grains and continuum. docs/theory/hybrid.md */
#include "../common/outlets.h"
#include "hybrid.h"
#include <math.h>

static const char *const weightings[] = { "half", "ramp", NULL };
enum { MOST_SUBSTEPS = 10000 };
static const quern_param params[] = {
	QUERN_PARAM(hybrid, substeps, "1",
		"Grain steps per step of the continuum; auto: as many as fit into one, chosen "
		"once before the run. scene.yaml has the number.",
		.text = "substeps", .def = 10, .min = 1, .max = MOST_SUBSTEPS),
	QUERN_PARAM(
		hybrid, update, "1", "Grain steps between updates of the zones.", .def = 160, .min = 1, .max = 1e9),
	QUERN_PARAM(hybrid, samples, "1", "Samples of the contact stress between updates.", .def = 8, .min = 1,
		.max = 10000, .flags = QUERN_ADVANCED),
	QUERN_PARAM(hybrid, hysteresis, "1", "Mean diameters by which a surface must move before a zone follows.",
		.def = 0.75, .max = 100, .flags = QUERN_ADVANCED),
	QUERN_PARAM(hybrid, growth, "1",
		"Grain steps in which the radius of a grain that was put into a hole too small for it grows by the mean "
		"radius; 0: none is put there.",
		.def = 2800, .max = 1e9),
	QUERN_PARAM(hybrid, gain, "1",
		"Motion beyond twice what there was at the last update and gravity gave since that ends the run, over what lifts all "
		"by a diameter; 0: none does.",
		.def = 1, .max = 1e6, .flags = QUERN_ADVANCED),
	QUERN_PARAM(hybrid, most_density, "1",
		"Density of a place, both clouds together, that ends the run, over that of what grains consist of; 0: "
		"none does.",
		.def = 1, .max = 1e6, .flags = QUERN_ADVANCED),
	QUERN_PARAM(hybrid, weights, "1",
		"Shares of grains and continuum in the hybrid zone: half each, or a ramp across it, from all grains "
		"to all "
		"continuum; a ramp needs three or four cells.",
		.choices = weightings),
	QUERN_PARAM(hybrid, ramped, NULL, "Keep shares by cell; set by itself where they are not all a half.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(hybrid, average, "1",
		"Updates over which the velocity and the pressure of cells are averaged for oracles that look at the "
		"flow: single ones are noise where it is slow.",
		.def = 1, .min = 1, .max = 1e6),
	QUERN_PARAM(hybrid, most_changes, "1",
		"Share of the cells with material that may change zone in one update; others wait. Not at the first one.",
		.def = 1, .min = 0, .max = 1, .flags = QUERN_MIN_OPEN),
	QUERN_PARAM(hybrid, oracle_cells, "1",
		"Cells along each axis of the blocks over which levels of oracles are averaged: 1, 2 or 4.", .def = 1,
		.min = 1, .max = 4),
	QUERN_PARAM(hybrid, averages, NULL, "Keep means; set by itself where they are asked for.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(hybrid, marks, NULL, "Keep what oracles have marked; set by itself where one wants to know.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(
		hybrid, solves, NULL, "The coupling sees all nodes at once; set by itself.", .flags = QUERN_ADVANCED),
	QUERN_PARAM_AS(hybrid, step, "time_step", "s", "The scene's own long step, if it gives one.",
		.from = "scene.step", .max = 1e12, .flags = QUERN_MAYBE | QUERN_MIN_OPEN | QUERN_ADVANCED),
	QUERN_PARAM_AS(hybrid, grain_step, "grain.step", "s", "Recommended step of the grains.",
		.from = "grain.step", .max = 1e12, .flags = QUERN_MAYBE | QUERN_MIN_OPEN | QUERN_ADVANCED),
	QUERN_PARAM_AS(hybrid, continuum_step, "continuum.step", "s", "Recommended step of the continuum.",
		.from = "continuum.step", .max = 1e12, .flags = QUERN_MAYBE | QUERN_MIN_OPEN | QUERN_ADVANCED),
	QUERN_PARAM_AS(hybrid, diameter, "grain.diameter", "m", "Mean diameter of grains that are placed.",
		.from = "grain.diameter", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN | QUERN_ADVANCED, .max = 1e6),
	QUERN_PARAM_AS(hybrid, radii.spread, "grain.spread", "1", "Spread of their radii.",
		.from = "grain.radius_spread", .max = 0.45, .flags = QUERN_ADVANCED),
	QUERN_PARAM_AS(hybrid, law_number, "grain.law", "1", "0: normal, cut at two deviations; 1: uniform.",
		.from = "grain.radius_law", .max = 1, .flags = QUERN_ADVANCED),
	QUERN_PARAM_AS(hybrid, density, "grain.density", "kg/m^3", "Density of their material.",
		.from = "grain.density", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN | QUERN_ADVANCED, .max = 1e6),
	QUERN_PARAM_AS(hybrid, solid, "grain.densest", "kg/m^3", "The largest density of any of their materials.",
		.from = "grain.densest", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN | QUERN_ADVANCED, .max = 1e6),
	QUERN_PARAM_AS(hybrid, packed, "packed_density", "kg/m^3", "Density of the continuum without stress.",
		.from = "continuum.density", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN | QUERN_ADVANCED, .max = 1e6),
	QUERN_PARAM_AS(hybrid, rest, "continuum.rest", "1/s", "Shear rate of what is at rest.",
		.from = "continuum.rest", .flags = QUERN_ADVANCED, .max = 1e300),
	QUERN_PARAM(
		hybrid, cell, "m", "Cell of the grid.", .from = "grid.cell", .flags = QUERN_MAYBE | QUERN_ADVANCED),
	QUERN_PARAM(hybrid, moving, NULL, "Ask for the work of bodies; set by itself where one moves.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(hybrid, passes, NULL,
		"Keep books of what leaves and comes; set by itself where a face is open or a source pours.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM_AS(hybrid, pourings, "grain.sources", "1", "How many sources of grains there are.",
		.from = "grain.sources", .max = 1e9, .flags = QUERN_ADVANCED),
	QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

static const quern_set sets[] = { { .name = "mixture", .doc = "What grains bring to the nodes.", .rows = 8 },
	{ .name = "waiting", .doc = "New grains that have not found room yet." }, { .name = NULL } };

static const quern_slot slots[] = {
	{ .name = "oracle",
		.kind = &quern_oracle_kind,
		.doc = "who says where grains are needed; the least continuous wish wins",
		.list = 1,
		.stage = { "hybrid.update" } },
	{ .name = "packer",
		.kind = &quern_packer_kind,
		.doc = "who places new grains",
		.def = "two_point_tangent",
		.stage = { "hybrid.update" } },
	{ .name = "coupling",
		.kind = &quern_coupling_kind,
		.doc = "how grains and continuum meet at a node",
		.def = "affine",
		.stage = { "hybrid.couple" } },
	{ .name = "material",
		.kind = &quern_material_kind,
		.stage = { NULL, "hybrid.update" }, /* moduli, for the audit, are no stage's */
		.same_as = "continuum.material" },
	{ .name = "shape",
		.kind = &quern_shape_kind,
		.stage = { "hybrid.raster" },
		.same_as = "continuum.shape" },
	{ .name = "transfer",
		.kind = &quern_transfer_kind,
		.doc = "from the nodes back to the grains",
		.def = "picflip: {rate: 0}",
		.stage = { "hybrid.back" },
		.particle = "grain" },
	{ .name = "bodies",
		.kind = &quern_body_kind,
		.list = 1,
		.stage = { "hybrid.update" },
		.same_as = "bodies" },
	{ .name = "integrator",
		.kind = &quern_integrator_kind,
		.stage = { NULL, NULL, "hybrid.back" }, /* none of its calls: when it acts counts there */
		.same_as = "grains.integrator" },
	{ .name = NULL }
};

static const quern_use update_uses[] = QUERN_USE_ROWS(UPDATE_USES);
static const quern_use sample_uses[] = QUERN_USE_ROWS(SAMPLE_USES);
static const quern_use raster_uses[] = QUERN_USE_ROWS(RASTER_USES);
static const quern_use couple_uses[] = QUERN_USE_ROWS(COUPLE_USES);
static const quern_use back_uses[] = QUERN_USE_ROWS(BACK_USES);
static const quern_use grow_uses[] = QUERN_USE_ROWS(GROW_USES);
static const quern_use audit_uses[] = QUERN_USE_ROWS(AUDIT_USES);

static const quern_stage stages[] = { { .name = "hybrid.update",
										  .doc = "Zones, weights, books, new grains and points.",
										  .phase = QUERN_BEGIN,
										  .flags = QUERN_SOMETIMES,
										  .uses = update_uses,
										  .run = quern_hybrid_update },
	{ .name = "hybrid.sample",
		.doc = "Contact stress by cell.",
		.phase = QUERN_SUBSTEP,
		.flags = QUERN_SOMETIMES,
		.uses = sample_uses,
		.run = quern_hybrid_sample },
	{ .name = "hybrid.raster",
		.doc = "Grains to nodes.",
		.phase = QUERN_EXCHANGE,
		.uses = raster_uses,
		.run = quern_hybrid_raster },
	{ .name = "hybrid.couple",
		.doc = "Exchange of momentum at the nodes.",
		.phase = QUERN_EXCHANGE,
		.uses = couple_uses,
		.run = quern_hybrid_couple },
	{ .name = "hybrid.back",
		.doc = "What the coupling changed, to the grains.",
		.phase = QUERN_EXCHANGE,
		.uses = back_uses,
		.run = quern_hybrid_back },
	{ .name = "hybrid.grow",
		.doc = "Grains in holes too small for them grow.",
		.phase = QUERN_END,
		.uses = grow_uses,
		.run = quern_hybrid_grow },
	{ .name = "hybrid.audit",
		.doc = "Asserts the ledger's invariants.",
		.phase = QUERN_END,
		.uses = audit_uses,
		.run = quern_hybrid_audit },
	{ .name = NULL } };

/* `auto`: as many of the grains' recommended steps as fit into the continuum's, so that neither is shorter than it need be, and into a
 * long step that the scene gives as many as leave none of them longer. docs/theory/hybrid.md, section 7 */
static quern_status choose_substeps(hybrid *h, const quern_setup *setup, quern_err *err) {
	if (setup->later)
		return setup->host->fail(err, QUERN_E_PARAM, "substeps",
			"auto is chosen once, before the run: a stage keeps that number, or gives one of its own");
	if (isnan(h->grain_step) || isnan(h->continuum_step))
		return setup->host->fail(err, QUERN_E_PARAM, "substeps",
			"auto has nothing to count: no contact law of the grains limits their step; give a number");
	const quern_real slack = 1e-9, n = isnan(h->step) ? floor(h->continuum_step / h->grain_step * (1 + slack))
													  : ceil(h->step / h->grain_step * (1 - slack));
	h->substeps = n < 1 ? 1 : n < MOST_SUBSTEPS ? (int32_t)n : MOST_SUBSTEPS;
	return QUERN_OK;
}

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	hybrid *h = self;
	if (!h->substeps && choose_substeps(h, setup, err) != QUERN_OK) return QUERN_E_PARAM;
	h->step = h->grain_step = h->continuum_step = NAN; /* what is made anew is not kept in scene.yaml */
	if (h->oracle_cells == 3)
		return setup->host->fail(err, QUERN_E_PARAM, "oracle_cells",
			"must be 1, 2 or 4, as many as go into the side of a block of cells");
	if (h->cell > 0 && h->cell < (1 - 1e-9) * h->diameter)
		return setup->host->fail(err, QUERN_E_PARAM, NULL,
			"the grid's cells (continuum.cell) are %.4g m wide, and grains %.4g m: a cell smaller than a grain "
			"holds none or more than there is room for, so that nobody knows how full it is; take two diameters, one "
			"and a half at least",
			h->cell, h->diameter);
	h->dim = setup->dim;
	h->radii.mean = 0.5 * h->diameter;
	h->radii.law = h->law_number > 0.5 ? RADIUS_UNIFORM : RADIUS_NORMAL;
	h->radii.stream = setup->stream;
	h->passes = h->passes || outlets_any(setup->open) || h->pourings > 0;
	h->averages = h->averages || h->average > 1;
	h->every = (uint32_t)(h->update / h->substeps);
	if (!h->every) h->every = 1;
	h->sample_every = h->every * (uint32_t)h->substeps / (uint32_t)h->samples;
	if (!h->sample_every) h->sample_every = 1;
	return QUERN_OK;
}

/* What any of the oracles wants. */
static uint32_t wants_of(const quern_bound *oracle, uint32_t n) {
	uint32_t wants = 0;
	for (uint32_t o = 0; o < n; o++) {
		const quern_oracle_ops *ops = oracle[o].ops;
		if (ops->wants) wants |= ops->wants(oracle[o].self);
	}
	return wants;
}

static quern_status ready(void *self, const quern_setup *setup, const quern_bound *const *slot,
	const uint32_t *n_slot, quern_err *err) {
	hybrid *h = self;
	if (!n_slot[SLOT_ORACLE])
		return setup->host->fail(
			err, QUERN_E_PARAM, NULL, "give an oracle: without one nobody says where grains are needed");
	if (((const quern_transfer_ops *)slot[SLOT_TRANSFER][0].ops)->affine)
		return setup->host->fail(err, QUERN_E_PARAM, "transfer",
			"%s makes a matrix that grains have no way to send: take picflip, mixed or xpic here",
			slot[SLOT_TRANSFER][0].id);
	h->moving = quern_bodies_move(slot[SLOT_BODIES], n_slot[SLOT_BODIES]);
	h->affine = ((const quern_coupling_ops *)slot[SLOT_COUPLING][0].ops)->affine != 0;
	h->solves = ((const quern_coupling_ops *)slot[SLOT_COUPLING][0].ops)->solve != NULL;
	h->ahead = quern_integrator_ahead(slot[SLOT_INTEGRATOR][0].ops, h->dim);
	const uint32_t wants = wants_of(slot[SLOT_ORACLE], n_slot[SLOT_ORACLE]);
	h->ramped = h->ramped || h->weights == WEIGHTS_RAMP || wants & QUERN_ORACLE_WEIGHT;
	h->marks = h->marks || wants & QUERN_ORACLE_MARKED;
	return QUERN_OK;
}

static uint32_t substeps(const void *self) { return (uint32_t)((const hybrid *)self)->substeps; }

enum { SUM_OWED, SUM_OWED_MOMENTUM, SUM_DEFECT = SUM_OWED_MOMENTUM + 3, SUM_DENSEST };
static const quern_output sums[] = {
	{ .name = "owed", .unit = "kg", .doc = "The ledger's sum over all cells." },
	{ .name = "owed_momentum_x", .unit = "kg m/s" }, { .name = "owed_momentum_y", .unit = "kg m/s" },
	{ .name = "owed_momentum_z", .unit = "kg m/s" },
	{ .name = "defect", .unit = "1", .doc = "Of the ledger's invariants so far.", .combine = QUERN_MAX },
	{ .name = "densest",
		.unit = "1",
		.doc = "Density of the densest place so far over the continuum's without stress.",
		.combine = QUERN_MAX },
	{ .name = NULL }
};

static const quern_output looks[] = {
	{ .name = "discrete", .unit = "%", .doc = "Share of the mass that grains carry." }, { .name = NULL }
};

static void account(const void *self, const quern_step *s, quern_real *out) {
	const quern_column *u = s->use;
	(void)self;
	out[SUM_OWED] = s->host->sum_set(s->run, "cell", u[U_OWED].real[0]);
	for (uint32_t k = 0; k < s->dim; k++)
		out[SUM_OWED_MOMENTUM + k] = s->host->sum_set(s->run, "cell", u[U_OWED_MOMENTUM].real[k]);
	const quern_real mass = u[U_MASS_DEFECT].real[0][0], momentum = u[U_MOMENTUM_DEFECT].real[0][0];
	out[SUM_DEFECT] = mass > momentum ? mass : momentum;
	out[SUM_DENSEST] = u[U_DENSEST_EVER].real[0][0];
}

static const char *const needs[] = { "grains", "continuum", NULL }, *const with[] = { "bodies", NULL };

static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "hybrid", .needs = needs, .with = with,
	.after = with, .sets = sets, .slots = slots, .stages = stages, .sums = sums, .ready = ready,
	.substeps = substeps, .account = account, .looks = looks, .look = quern_hybrid_look,
	.work = quern_hybrid_work };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 12,
	.dims = QUERN_2D | QUERN_3D,
	.id = "solver.hybrid",
	.brief = "Grains where they matter, continuum everywhere else.",
	.doc = "Zones by oracles, conversions with a ledger of mass and momentum, coupling at the nodes of the "
		   "grid.",
	.cite = "Yue et al. 2018; Chantharayukhonthorn 2019",
	.instance_size = sizeof(hybrid),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
