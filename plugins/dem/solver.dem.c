/* SPDX-License-Identifier: MIT */
/* solver.dem - grains: discs and spheres with contact laws. docs/theory/grains.md */
#include "../common/height.h"
#include "../common/outlets.h"
#include "box.h"
#include "dem.h"
#include <math.h>
#include <quern/math.h>
#include <stdio.h>

static const char *const radius_laws[] = { "normal", "uniform", NULL };
static const quern_param mix_rows[] = { QUERN_PARAM_AS(dem_share, name, "material", NULL, "Which material.",
											.flags = QUERN_REQUIRED),
	QUERN_PARAM(dem_share, share, "1", "Of the mass.", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1),
	QUERN_END_PARAMS };
#define BLEND_ROWS(T)                                                                                        \
	QUERN_PARAM_AS(T, of.material, "material", NULL, "Of which material they are; default: the first.",      \
		.flags = QUERN_MAYBE, .unless = "mix"),                                                              \
		QUERN_PARAM_AS(T, of.mix, "mix", NULL,                                                               \
			"Of which materials they are, by share of the mass: {sand: 70 %, steel: 30 %}.",                 \
			.rows = mix_rows, .item_size = sizeof(dem_share), .text = "material", .max = MOST_MATERIALS)
static const quern_param fill_rows[] = { REGION_ABOVE(dem_fill),
	QUERN_PARAM(dem_fill, velocity, "m/s", "Velocity at the start."),
	QUERN_PARAM(dem_fill, settle, NULL, "Let the grains come to rest before time starts."),
	QUERN_PARAM(dem_fill, fixed, NULL, "These grains never move: a rough floor."), BLEND_ROWS(dem_fill),
	QUERN_END_PARAMS };
static const quern_param place_rows[] = { QUERN_PARAM(
											  dem_place, position, "m", "Centre.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(dem_place, velocity, "m/s", "Velocity."),
	QUERN_PARAM(dem_place, spin, "rad/s", "Angular velocity; in 2-D the first number counts."),
	QUERN_PARAM(dem_place, radius, "m", "Radius; default: the mean.", .flags = QUERN_MAYBE | QUERN_MIN_OPEN,
		.max = 1e6),
	QUERN_PARAM(dem_place, fixed, NULL, "It never moves."),
	QUERN_PARAM(
		dem_place, material, NULL, "Of which material it is; default: the first.", .flags = QUERN_MAYBE),
	QUERN_END_PARAMS };
#define MATERIAL_ROWS(T, member, before, ...)                                                                \
	QUERN_PARAM_AS(T, member density, before "density", "kg/m^3", "Density of the grains' material.",        \
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN | QUERN_ONCE, .max = 1e6, __VA_ARGS__),                     \
		QUERN_PARAM_AS(T, member radii.mean, before "radius.mean", "m", "Mean radius.",                      \
			.flags = QUERN_REQUIRED | QUERN_MIN_OPEN | QUERN_ONCE, .max = 1e6, __VA_ARGS__),                 \
		QUERN_PARAM_AS(T, member radii.spread, before "radius.spread", "1",                                  \
			"Over the mean: standard deviation (normal, cut at two of them) or half-width (uniform).",       \
			.flags = QUERN_ONCE, .max = 0.45, __VA_ARGS__),                                                  \
		QUERN_PARAM_AS(T, member radii.law, before "radius.law", "1", "Distribution of radii.",              \
			.flags = QUERN_ONCE, .choices = radius_laws, __VA_ARGS__)
static const quern_param material_rows[] = { QUERN_PARAM(dem_material, name, NULL,
												 "What the material is called.", .flags = QUERN_REQUIRED),
	MATERIAL_ROWS(dem_material, , "", .pad = 0), QUERN_END_PARAMS };
static const quern_param word_rows[] = { QUERN_PARAM(dem_word, name, NULL,
											 "A material of grains or of a body.", .flags = QUERN_REQUIRED),
	QUERN_END_PARAMS };
static const quern_param pair_rows[] = {
	QUERN_PARAM(dem_pair, between, NULL, "Two materials, of which one at least is of grains: [sand, steel].",
		.rows = word_rows, .item_size = sizeof(dem_word), .flags = QUERN_REQUIRED),
	QUERN_END_PARAMS
};
static const quern_param source_rows[] = { SOURCE_KEYS(40), BLEND_ROWS(dem_source), QUERN_END_PARAMS };
static const quern_param params[] = { MATERIAL_ROWS(dem, alone., "material.", .unless = "materials"),
	QUERN_PARAM(dem, materials, NULL,
		"Several materials, by name: {sand: {density: ..., radius: ...}, ...}. The first stands for all "
		"where a number "
		"such as `grain.diameter` is taken.",
		.rows = material_rows, .item_size = sizeof(dem_material), .text = "name", .max = MOST_MATERIALS,
		.flags = QUERN_ONCE),
	QUERN_PARAM(dem, pairs, NULL,
		"Pairs of materials whose contacts have parameters of their own, such as {between: [sand, steel], "
		"friction: 0.2}.",
		.rows = pair_rows, .item_size = sizeof(dem_pair), .max = 256),
	QUERN_PARAM(dem, fill, NULL, "Regions to fill with grains.", .rows = fill_rows,
		.item_size = sizeof(dem_fill), .flags = QUERN_ONCE),
	QUERN_PARAM(dem, place, NULL, "Single grains.", .rows = place_rows, .item_size = sizeof(dem_place),
		.flags = QUERN_ONCE),
	QUERN_PARAM(dem, file, NULL,
		"Grains from a table with a header line: x y radius [vx vy] [w] in 2-D, x y z radius [vx vy vz] [wx wy wz] in 3-D, then [fixed] "
		"[material].",
		.flags = QUERN_FILE | QUERN_ONCE),
	QUERN_PARAM(dem, from, NULL,
		"A run whose grains this one starts from, before all others: RUN for its last state, with the history of "
		"contacts, or RUN:FRAME for what a frame shows.",
		.flags = QUERN_FILE | QUERN_ONCE),
	QUERN_PARAM(
		dem, source, NULL, "Regions that pour grains.", .rows = source_rows, .item_size = sizeof(dem_source)),
	QUERN_PARAM(dem, skin, "1",
		"Verlet skin over the mean diameter; what it changes of results is their last digits, in a periodic domain or a hybrid. The cost depends on it.",
		.def = 0.1, .planar = 0.4, .min = 0.001, .max = 2, .flags = QUERN_PLANAR | QUERN_ADVANCED),
	QUERN_PARAM(dem, step, "1",
		"Recommended step over half the shortest period of a contact; default: the integrator's own.",
		.max = 0.1, .flags = QUERN_MAYBE | QUERN_MIN_OPEN | QUERN_ADVANCED),
	QUERN_PARAM_AS(dem, overlap_most, "overlap.most", "1",
		"Overlap over the smaller radius that ends the run where it lasts; 0: none does.", .def = 0.1,
		.max = 1e6),
	QUERN_PARAM_AS(dem, overlap_start, "overlap.start", "1",
		"Overlap over the smaller radius that grains of place and file may have at the start.", .def = 0.01,
		.max = 1e6),
	QUERN_PARAM_AS(dem, rest, "settle.energy", "1",
		"At rest when the mean kinetic energy of a grain stays below this share of m g d.", .def = 1e-5,
		.flags = QUERN_MIN_OPEN, .max = 1),
	QUERN_PARAM_AS(dem, settle_step, "settle.step", "1",
		"Step while settling, over half the shortest period of a contact; half of the limit where that is lower.",
		.def = 0.1, .max = 0.2, .flags = QUERN_MIN_OPEN),
	QUERN_PARAM_AS(dem, settle_most, "settle.most", "1",
		"Most steps of settling; then the run goes on with a warning.", .def = 1e6, .min = 1, .max = 2e9),
	DEM_BOX_PARAMS,
	QUERN_PARAM(dem, fixed, NULL,
		"Keep a flag for grains that do not move; set by itself where one is needed.",
		.flags = QUERN_ADVANCED),
	QUERN_PARAM(dem, mixed, NULL,
		"Keep of which material each grain is; set by itself where there are several.",
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
	QUERN_PARAM(dem, blends, NULL,
		"Keep what sources have poured of each material; set by itself where one pours a mix.",
		.flags = QUERN_ADVANCED),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static const quern_set sets[] = { { .name = "grain",
									  .plural = "grains",
									  .doc = "Discs or spheres, sorted by block and cell.",
									  .counted = 1,
									  .cost = { 28e-9, 56e-9 } },
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
	{ .name = "grain_share",
		.plural = "grain_shares",
		.doc = "What each source has poured of each material, source by source.",
		.when = "blends" },
	{ .name = NULL } };

static quern_status place_fills(
	void *self, const quern_setup *, const quern_bound *shape, uint32_t n, quern_err *);
static quern_status place_sources(
	void *self, const quern_setup *, const quern_bound *shape, uint32_t n, quern_err *);

/* Regions first: plugins may take the height of the fill as a default. */
static const quern_slot slots[] = {
	{ .name = "fill.region",
		.kind = &quern_body_kind,
		.doc = "where centres lie: in the shape of a body, such as {box: {lower: ..., upper: ...}}",
		.stage = { "dem.fill" },
		.filled = place_fills },
	{ .name = "source.region",
		.kind = &quern_body_kind,
		.doc = "where new centres lie: in the shape of a body, such as {box: {lower: ..., upper: ...}}",
		.stage = { "dem.pour" },
		.filled = place_sources },
	{ .name = "contact",
		.kind = &quern_contact_kind,
		.doc = "a contact law, such as {linear: {stiffness: 1e6 N/m}}; forces of a list add up, [] is none",
		.list = 1,
		.required = 1,
		.stage = { "dem.forces" },
		.repeat = "contact",
		.again = "touch",
		.refine = "pairs" },
	{ .name = "neighbours",
		.kind = &quern_neighbours_kind,
		.doc = "the search for near pairs",
		.def = "cells",
		.stage = { "dem.neighbours" } },
	{ .name = "integrator",
		.kind = &quern_integrator_kind,
		.doc = "the step in time",
		.def = "position_verlet",
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
static const quern_use strain_uses[] = QUERN_USE_ROWS(STRAIN_USES);
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
	{ .name = "dem.strain",
		.doc = "How fast the box changes, and the box's own flow to the grains.",
		.phase = QUERN_SUBSTEP,
		.uses = strain_uses,
		.run = quern_dem_box_strain,
		.when = "boxed" },
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

/* m, of the fills, or of the domain where there are none. */
static void publish_height(dem *d, const quern_setup *setup, const fill_height *loose) {
	const quern_real height = fill_height_all(loose),
					 gravity = quern_gravity_size(setup->dim, setup->gravity);
	d->height = height > 0 ? height : setup->upper[loose->axis] - setup->lower[loose->axis];
	setup->host->publish(setup, "fill.height", "m", d->height);
	setup->host->publish(setup, "fill.rate", "1/s", height > 0 || d->from ? sqrt(gravity / d->height) : 0);
}

static quern_status place_fills(
	void *self, const quern_setup *setup, const quern_bound *shape, uint32_t n, quern_err *err) {
	dem *d = self;
	dem_fill *fill = d->fill.items;
	fill_height loose = fill_height_of(setup);
	for (uint32_t i = 0; i < n; i++) {
		const region_use use = fill[i].fixed ? REGION_OF_FIXED : REGION_OF_GRAINS;
		char param[40];
		snprintf(param, sizeof param, "fill.%u.region", i);
		if (quern_region_box(&shape[i], use, setup, param, err, fill[i].lower, fill[i].upper) != QUERN_OK)
			return QUERN_E_PARAM;
		if (!fill[i].fixed) fill_height_add(&loose, fill[i].lower, fill[i].upper);
	}
	publish_height(d, setup, &loose);
	return QUERN_OK;
}

static quern_status place_sources(
	void *self, const quern_setup *setup, const quern_bound *shape, uint32_t n, quern_err *err) {
	(void)n;
	return quern_sources_place(&((dem *)self)->source, shape, REGION_OF_GRAINS, setup, err);
}

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	dem *d = self;
	d->dim = setup->dim;
	if (quern_dem_name_materials(d, setup, err) != QUERN_OK) return QUERN_E_PARAM;
	const dem_fill *fill = d->fill.items;
	for (uint32_t i = 0; i < d->fill.n; i++) {
		if (quern_too_fast(fill[i].velocity, 1))
			return setup->host->fail(err, QUERN_E_PARAM, "fill", "the velocity is beyond that of light");
		d->fixed = d->fixed || fill[i].fixed;
		d->settles = d->settles || fill[i].settle;
	}
	const dem_place *place = d->place.items;
	for (uint32_t i = 0; i < d->place.n; i++) d->fixed = d->fixed || place[i].fixed;
	if (!d->fill.n && !d->place.n && !d->file && !d->from && !d->source.n)
		return setup->host->fail(
			err, QUERN_E_PARAM, NULL, "no grains: give fill, place, file, from or source");
	if (quern_sources_check(&d->source, setup, err) != QUERN_OK) return QUERN_E_PARAM;
	if (quern_dem_box_check(d, setup, err) != QUERN_OK) return QUERN_E_PARAM;
	d->outlets = d->outlets || outlets_any(setup->open);
	d->sources = d->sources || d->source.n;
	setup->host->publish(setup, "grain.sources", "1", d->source.n);
	if (d->file || d->from) d->fixed = true; /* its header, or the other run, may say so */
	const quern_real gravity = quern_gravity_size(setup->dim, setup->gravity), diameter = dem_diameter(d);
	if (d->settles && !(gravity > 0) && !setup->later)
		return refuse_settling(d, setup, err, "there is no gravity: nothing would come to rest by it");
	setup->host->publish(setup, "grain.settling_rate", "1/s", 0.1 * sqrt(gravity / diameter));
	setup->host->publish(setup, "grain.diameter", "m", diameter);
	setup->host->publish(setup, "grain.widest", "m", 2 * quern_dem_most(d, NULL));
	/* points that are made of grains come by quadrants, two per cell and axis, whatever the continuum's own fill has */
	setup->host->publish(setup, "continuum.half_width", "1", 0.25);
	setup->host->publish(setup, "grain.density", "kg/m^3", d->material[0].density);
	quern_real densest = 0;
	for (uint32_t k = 0; k < d->n_materials; k++) densest = fmax(densest, d->material[k].density);
	setup->host->publish(setup, "grain.densest", "kg/m^3", densest);
	setup->host->publish(setup, "grain.radius_spread", "1", d->material[0].radii.spread);
	setup->host->publish(setup, "grain.radius_law", "1", d->material[0].radii.law);
	return QUERN_OK;
}

static void finish(void *self) { quern_dem_part(self); }

/* The largest grain that any source brings; a table that cannot be read is found later, with its place. */
static quern_real widest(const dem *d) {
	const dem_place *place = d->place.items;
	quern_real most = 0;
	grain_table table = { 0 };
	char why[200];
	for (uint32_t k = 0; k < d->n_materials; k++) most = fmax(most, quern_radius_most(&d->material[k].radii));
	for (uint32_t i = 0; i < d->place.n; i++) most = place[i].radius > most ? place[i].radius : most;
	if (d->file && quern_grain_table_load(d->file, d, &table, why))
		for (uint32_t i = 0; i < table.n; i++)
			most = table.grain[i].radius > most ? table.grain[i].radius : most;
	quern_grain_table_finish(&table);
	return most;
}

/* How far the law acts beyond touching, between two of the largest grains and of one on each body, in every case. */
static void find_reach(dem *d, const quern_bound *law, quern_real radius, uint32_t bodies) {
	const quern_contact_ops *ops = law->ops;
	for (int32_t item = -1; item < (int32_t)law->n_refined; item++)
		for (int32_t body = -1; body < (int32_t)bodies; body++) {
			const quern_real reach = ops->reach(dem_law(law, item, body), body < 0 ? 0.5 * radius : radius);
			const quern_real more =
				reach * (1 + 1e-12); /* whoever is near for the law is so here, however both round */
			d->reach = more > d->reach ? more : d->reach;
		}
}

/* A law that is bounded by the force of those before it in the list does nothing where there are none. */
static quern_status refuse_order(const quern_setup *setup, const quern_bound *law, quern_err *err) {
	return setup->host->fail(err, QUERN_E_PARAM, "contact",
		"%s does nothing at the head of the list: it is bounded by the normal force of the laws before it; "
		"put one "
		"that pushes there, such as linear",
		law->id);
}

/* N/m of all laws between grains of a pair of materials, and who is the stiffest of them. */
static quern_real stiffness_of(const dem *d, const quern_bound *law, uint32_t n_laws, int32_t item,
	quern_real radius, quern_real force, const char **stiffest) {
	quern_real sum = 0, most = 0;
	for (uint32_t l = 0; l < n_laws; l++) {
		const quern_contact_ops *ops = law[l].ops;
		const quern_real k =
			ops->stiffness ? ops->stiffness(dem_law(&law[l], item, -1), d->dim, radius, force) : 0;
		sum += k;
		if (k > most) most = k, *stiffest = law[l].id;
	}
	return sum;
}

/* Of a random packing. */
static quern_real packing_of(uint32_t dim) { return dim == 2 ? 0.82 : 0.60; }

/* N between grains at the bottom of the fill, were it all of that density. */
static quern_real force_under(
	const dem *d, const quern_setup *setup, quern_real density, quern_real diameter) {
	const quern_real gravity = quern_gravity_size(setup->dim, setup->gravity);
	const quern_real pressure = packing_of(d->dim) * density * gravity * d->height;
	return pressure * diameter * (d->dim == 3 ? diameter : 1);
}

/* Whether a fill of loose grains, or a source, brings a material. */
static bool is_in_bed(const dem *d, uint32_t k) {
	const dem_fill *fill = d->fill.items;
	for (uint32_t i = 0; i < d->fill.n; i++)
		if (!fill[i].fixed && fill[i].of.share[k] > 0) return true;
	return quern_dem_pours(d, k) || d->n_materials == 1;
}

/* How far the softest pair of materials gives way under the fill, were it all of the densest. */
static void find_sinking(dem *d, const quern_setup *setup, const quern_bound *law, uint32_t n_laws) {
	quern_real density = 0;
	for (uint32_t k = 0; k < d->n_materials; k++)
		if (is_in_bed(d, k)) density = fmax(density, d->material[k].density);
	for (uint32_t k = 0; k < d->n_materials; k++)
		for (uint32_t l = k; l < d->n_materials; l++) {
			if (!is_in_bed(d, k) || !is_in_bed(d, l)) continue;
			const quern_real a = d->material[k].radii.mean, b = d->material[l].radii.mean;
			const quern_real force = force_under(d, setup, density, a + b);
			const char *stiffest = NULL;
			const quern_real stiffness = stiffness_of(
				d, law, n_laws, d->pair[k][l], k == l ? 0.5 * a : a * b / (a + b), 0.5 * force, &stiffest);
			const quern_real sinks = stiffness > 0 ? force / (stiffness * (a + b)) : 0;
			if (sinks > d->sinks) d->sinks = sinks, d->stiffness = stiffness, d->stiffest = stiffest;
		}
}

/* A random packing's bulk modulus, from the affine estimates of docs/theory/grains.md, section 5, with what real
 * packings reach of them: 0.3 k_n for discs, 0.6 of z phi k_n / (3 pi D) for spheres (z = 5). */
static void publish_packing(const dem *d, const quern_setup *setup, const quern_bound *law, uint32_t n_laws) {
	const quern_real packing = packing_of(d->dim), diameter = dem_diameter(d),
					 density = d->material[0].density;
	const quern_real force = force_under(d, setup, density, diameter);
	const char *stiffest;
	const quern_real kn =
		stiffness_of(d, law, n_laws, d->pair[0][0], 0.25 * diameter, 0.5 * force, &stiffest);
	const quern_real bulk =
		d->dim == 2 ? 0.3 * kn : 0.6 * 5 * packing * kn / (3 * 3.141592653589793 * diameter);
	setup->host->publish(setup, "grain.stiffness", "N/m", kn);
	setup->host->publish(setup, "grain.bulk_modulus", "Pa", bulk);
	setup->host->publish(setup, "grain.packed_density", "kg/m^3", packing * density);
	setup->host->publish(setup, "grain.critical_density", "kg/m^3", (packing - 0.03) * density);
}

/* For who counts these steps before there are grains, and a word for that who lets them be counted. */
static void publish_step(
	const dem *d, const quern_setup *setup, const quern_bound *const *slot, const uint32_t *n_slot) {
	const quern_step s = quern_bodies_before(setup, slot, n_slot);
	uint64_t expected = 0;
	for (uint32_t k = 0; k < d->n_materials; k++) expected |= (uint64_t)is_in_bed(d, k) << k;
	const quern_real step = quern_dem_expected_step(d, &s, expected ? expected : UINT64_MAX);
	if (isfinite(step)) setup->host->publish(setup, "grain.step", "s", step);
	setup->host->publish(setup, "substeps.auto", "1", 0);
}

static quern_status check_above(const dem *d, const quern_setup *setup, uint32_t n_bodies, quern_err *err) {
	const dem_fill *fill = d->fill.items;
	quern_status status = QUERN_OK;
	for (uint32_t i = 0; i < d->fill.n && status == QUERN_OK; i++) {
		char param[40];
		snprintf(param, sizeof param, "fill.%u.above", i);
		status = quern_region_check_above(&fill[i].above, n_bodies, setup, param, err);
	}
	return status;
}

static quern_status ready(void *self, const quern_setup *setup, const quern_bound *const *slot,
	const uint32_t *n_slot, quern_err *err) {
	dem *d = self;
	const quern_bound *law = slot[SLOT_CONTACT];
	if (d->settles && !n_slot[SLOT_CONTACT])
		return refuse_settling(d, setup, err, "without a contact law grains fall for ever: give contact one");
	if (n_slot[SLOT_CONTACT] && ((const quern_contact_ops *)law[0].ops)->follows)
		return refuse_order(setup, &law[0], err);
	const quern_status status = quern_dem_pair_up(d, setup, slot[SLOT_BODIES], n_slot[SLOT_BODIES], err);
	if (status != QUERN_OK) return status;
	if (check_above(d, setup, n_slot[SLOT_BODIES], err) != QUERN_OK) return QUERN_E_PARAM;
	if (quern_dem_box_bodies(d, setup, n_slot[SLOT_BODIES], err) != QUERN_OK) return QUERN_E_PARAM;
	d->features = false;
	d->moving = n_slot[SLOT_BODIES] && quern_bodies_move(slot[SLOT_BODIES], n_slot[SLOT_BODIES]);
	for (uint32_t b = 0; b < n_slot[SLOT_BODIES]; b++)
		d->features = d->features || ((const quern_body_ops *)slot[SLOT_BODIES][b].ops)->features;
	for (uint32_t l = 0; l < n_slot[SLOT_CONTACT]; l++) {
		if (!((const quern_contact_ops *)law[l].ops)->reach) continue;
		if (!(d->largest > 0)) d->largest = widest(d);
		find_reach(d, &law[l], d->largest, n_slot[SLOT_BODIES]);
	}
	find_sinking(d, setup, law, n_slot[SLOT_CONTACT]);
	publish_packing(d, setup, law, n_slot[SLOT_CONTACT]);
	publish_step(d, setup, slot, n_slot);
	return QUERN_OK;
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
	const dem *d = self;
	const uint32_t n = s->host->set(s->run, "grain").n;
	const int32_t *material = s->use[FILL_MATERIAL].index;
	for (uint32_t i = 0; i < n && material; i++)
		if (material[i] < 0 || material[i] >= (int32_t)d->n_materials)
			return s->host->stop(
				s->run, QUERN_E_NUMERIC, NULL, -1, "grain.material holds the number of no material");
	if (!radii_hold(s, s->use[FILL_RADIUS].real[0], n))
		return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
			"grain.radius holds a radius of no grain, or far wider than the domain");
	if (d->boxed && !quern_dem_box_holds(s))
		return s->host->stop(
			s->run, QUERN_E_NUMERIC, NULL, -1, "total.box_length and its like hold the numbers of no box");
	quern_step now = *s;
	for (uint32_t k = 0; k < s->dim && d->boxed; k++)
		now.upper[k] = s->lower[k] + s->use[FILL_BOX_LENGTH].real[k][0];
	if (!quern_positions_hold(&now, &s->use[FILL_POSITION], n))
		return s->host->stop(
			s->run, QUERN_E_NUMERIC, NULL, -1, "grain.position holds a position far outside of the domain");
	return QUERN_OK;
}

static const char *const with[] = { "bodies", NULL };
static const char *const takes[] = { "grain", "contact", "touch", NULL },
						 *const essential[] = { "grain.position", "grain.velocity", "grain.radius",
							 "grain.id", NULL },
						 *const same[] = { "materials.name", NULL }, *const unlike[] = { "hybrid", NULL };

static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "grains", .with = with, .after = with,
	.sets = sets, .slots = slots, .stages = stages, .sums = sums, .ready = ready, .limit = quern_dem_limit,
	.settled = quern_dem_settled, .account = account, .settling = quern_dem_settling, .accept = accept,
	.looks = quern_dem_looks, .look = quern_dem_look_at_run, .from = "from", .takes = takes,
	.essential = essential, .same = same, .unlike = unlike };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 4,
	.dims = QUERN_2D | QUERN_3D,
	.id = "solver.dem",
	.brief = "Grains: discs and spheres with contact laws.",
	.doc = "The discrete element method with linked cells, Verlet lists and batches of contacts.",
	.cite = "Cundall & Strack 1979",
	.instance_size = sizeof(dem),
	.params = params,
	.uses = uses,
	.init = init,
	.finish = finish,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
