/* SPDX-License-Identifier: MIT */
/* solver.heat - conduction of heat through the continuum: a field of its own, carried by points that another solver
 * moves */
#include "heat.h"
#include <math.h>
#include <stdio.h>

#define USE(field_, unit_, access_, ...)                                                                     \
	{ .field = field_, .unit = unit_, .access = access_, .shape = __VA_ARGS__ }

enum { AT_FIRST = 293150 }; /* mK, of what is new */

static const quern_param hot_rows[] = { QUERN_PARAM(
											hot_region, lower, "m", "Lower corner.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(hot_region, upper, "m", "Upper corner.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(hot_region, temperature, "K", "Of the points that are there at the start.",
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e5),
	QUERN_END_PARAMS };
static const quern_param sensor_rows[] = {
	QUERN_PARAM(sensor, position, "m", "Where it is.", .flags = QUERN_REQUIRED), QUERN_END_PARAMS
};
static const quern_param params[] = { QUERN_PARAM(heat, capacity, "J/(kg K)",
										  "Heat capacity of the continuum.", .def = 800, .max = 1e6,
										  .flags = QUERN_MIN_OPEN),
	QUERN_PARAM(heat, hot, NULL,
		"Regions that are not at 293.15 K at the start; the last one that holds a point counts.",
		.rows = hot_rows, .item_size = sizeof(hot_region)),
	QUERN_PARAM(heat, sensors, NULL, "Places at which temperature is measured.", .rows = sensor_rows,
		.item_size = sizeof(sensor)),
	QUERN_PARAM(heat, density, "kg/m^3", "Of the continuum, for the step where there are no points yet.",
		.from = "continuum.density", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN | QUERN_ADVANCED, .max = 1e6),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static const quern_set sets[] = { { .name = "thermal", .doc = "Heat at the nodes.", .rows = 8 },
	{ .name = "sensor",
		.plural = "sensors",
		.counted = 1,
		.cost = { 100e-9, 300e-9 },
		.doc = "Places at which temperature is measured." },
	{ .name = NULL } };

static const quern_slot slots[] = { { .name = "conductivity",
										.kind = &quern_conductivity_kind,
										.doc = "how well the material conducts",
										.def = "constant",
										.stage = { "heat.flux" },
										.particle = "point" },
	{ .name = "shape", .kind = &quern_shape_kind, .stage = { "heat.scatter" }, .same_as = "continuum.shape" },
	{ .name = NULL } };

/* ---- stages ---- */

#define BEGIN_USES                                                                                           \
	USE("point.position", "m", QUERN_READ, QUERN_VECTOR),                                                    \
		USE("point.temperature", "K", QUERN_UPDATE, QUERN_SCALAR, .flags = QUERN_SHOWN,                      \
			.initial = 1e-3 * AT_FIRST, .doc = "Temperature."),                                              \
		USE("point.mass", "kg", QUERN_READ, QUERN_SCALAR),                                                   \
		USE("point.volume", "m^3", QUERN_READ, QUERN_SCALAR),                                                \
		USE("point.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL),                         \
		USE("total.heated", "1", QUERN_UPDATE, QUERN_INDEX, .doc = "1: what is hot at the start has been.")
static const quern_use fill_uses[] = { BEGIN_USES,
	USE("sensor.position", "m", QUERN_WRITE, QUERN_VECTOR, .flags = QUERN_SHOWN, .doc = "Position."),
	USE("sensor.temperature", "K", QUERN_UPDATE, QUERN_SCALAR, .flags = QUERN_SHOWN,
		.initial = 1e-3 * AT_FIRST, .doc = "Temperature that it reads."),
	QUERN_END_USES };
static const quern_use begin_uses[] = { BEGIN_USES, QUERN_END_USES };
static const quern_use scatter_uses[] = { USE("point.position", "m", QUERN_READ, QUERN_VECTOR),
	USE("point.temperature", "K", QUERN_READ, QUERN_SCALAR),
	USE("point.mass", "kg", QUERN_READ, QUERN_SCALAR),
	USE("point.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL),
	USE("thermal.capacity", "J/K", QUERN_ADD, QUERN_SCALAR, .doc = "Weighted heat capacity."),
	USE("thermal.heat", "J", QUERN_ADD, QUERN_SCALAR, .doc = "Weighted heat, from 0 K on."), QUERN_END_USES };
static const quern_use flux_uses[] = { USE("point.position", "m", QUERN_READ, QUERN_VECTOR),
	USE("point.temperature", "K", QUERN_READ, QUERN_SCALAR),
	USE("point.mass", "kg", QUERN_READ, QUERN_SCALAR), USE("point.volume", "m^3", QUERN_READ, QUERN_SCALAR),
	USE("point.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL),
	USE("thermal.capacity", "J/K", QUERN_READ, QUERN_SCALAR),
	USE("thermal.heat", "J", QUERN_READ, QUERN_SCALAR),
	USE("thermal.rate", "W", QUERN_ADD, QUERN_SCALAR, .doc = "Heat that flows in."), QUERN_END_USES };
/* before the points are moved: with the weights with which they were sent */
static const quern_use gather_uses[] = { USE("point.position", "m", QUERN_READ, QUERN_VECTOR,
											 .flags = QUERN_BEFORE),
	USE("point.temperature", "K", QUERN_UPDATE, QUERN_SCALAR),
	USE("thermal.capacity", "J/K", QUERN_READ, QUERN_SCALAR),
	USE("thermal.rate", "W", QUERN_READ, QUERN_SCALAR), QUERN_END_USES };
static const quern_use measure_uses[] = { USE("sensor.position", "m", QUERN_READ, QUERN_VECTOR),
	USE("sensor.temperature", "K", QUERN_UPDATE, QUERN_SCALAR),
	USE("thermal.capacity", "J/K", QUERN_READ, QUERN_SCALAR),
	USE("thermal.heat", "J", QUERN_READ, QUERN_SCALAR), USE("thermal.rate", "W", QUERN_READ, QUERN_SCALAR),
	QUERN_END_USES };

static bool holds(const hot_region *r, const quern_column *x, uint32_t i, uint32_t dim) {
	for (uint32_t k = 0; k < dim; k++)
		if (!(x->real[k][i] >= r->lower[k] && x->real[k][i] <= r->upper[k])) return false;
	return true;
}

/* Once, as soon as there are points: a hybrid's come with its first update, after the set-up. */
static quern_status begin(const void *self, const quern_step *s) {
	const heat *p = self;
	const hot_region *hot = p->hot.items;
	const uint32_t n = s->host->set(s->run, "point").n;
	if (s->use[BEGIN_HEATED].index[0] || !n) return QUERN_OK;
	s->use[BEGIN_HEATED].index[0] = 1;
	for (uint32_t r = 0; r < p->hot.n; r++) {
		uint32_t found = 0;
		for (uint32_t i = 0; i < n; i++) {
			if (!holds(&hot[r], &s->use[BEGIN_POSITION], i, s->dim)) continue;
			s->use[BEGIN_TEMPERATURE].real[0][i] = hot[r].temperature;
			found++;
		}
		if (!found) s->host->log(s->run, 2, "region %u of heat.hot holds no points", r);
	}
	return QUERN_OK;
}

static quern_status fill(const void *self, const quern_step *s) {
	const quern_status status = heat_place_sensors(self, s);
	return status == QUERN_OK ? begin(self, s) : status;
}

static const quern_stage stages[] = { { .name = "heat.fill",
										  .doc = "What is hot, and where sensors are.",
										  .phase = QUERN_SETUP,
										  .uses = fill_uses,
										  .run = fill },
	{ .name = "heat.begin",
		.doc = "What is hot among the first points, if they come late.",
		.phase = QUERN_BEGIN,
		.flags = QUERN_SOMETIMES,
		.uses = begin_uses,
		.run = begin },
	{ .name = "heat.scatter",
		.doc = "Points to nodes: capacity, heat.",
		.phase = QUERN_DEPOSIT,
		.uses = scatter_uses,
		.run = heat_scatter },
	{ .name = "heat.flux",
		.doc = "Heat that flows between nodes.",
		.phase = QUERN_EXCHANGE,
		.uses = flux_uses,
		.run = heat_flux },
	{ .name = "heat.gather",
		.doc = "Nodes to points: change of temperature.",
		.phase = QUERN_ADVANCE,
		.uses = gather_uses,
		.run = heat_gather },
	{ .name = "heat.measure",
		.doc = "What sensors read.",
		.phase = QUERN_END,
		.uses = measure_uses,
		.run = heat_measure },
	{ .name = NULL } };

/* ---- what is given, and what it allows ---- */

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	const heat *p = self;
	const hot_region *hot = p->hot.items;
	const sensor *sensors = p->sensors.items;
	for (uint32_t k = 0; k < setup->dim; k++) {
		for (uint32_t i = 0; i < p->hot.n; i++)
			if (!(hot[i].upper[k] > hot[i].lower[k]))
				return setup->host->fail(err, QUERN_E_PARAM, "hot",
					"the upper corner must be above the lower one; axis %u is not", k);
		for (uint32_t i = 0; i < p->sensors.n; i++)
			if (!(sensors[i].position[k] >= setup->lower[k] && sensors[i].position[k] <= setup->upper[k]))
				return setup->host->fail(err, QUERN_E_PARAM, "sensors",
					"sensor %u lies outside of the domain along axis %u", i, k);
	}
	return QUERN_OK;
}

static quern_status ready(void *self, const quern_setup *setup, const quern_bound *const *slot,
	const uint32_t *n_slot, quern_err *err) {
	const quern_bound *shape = slot[SLOT_SHAPE];
	(void)setup, (void)n_slot, (void)err;
	((heat *)self)->stiffness = ((const quern_shape_ops *)shape->ops)->stiffness(shape->self);
	return QUERN_OK;
}

/* m^2/s, the largest of all points. Where there are none yet, it is that of the material at rest, unless the law looks
 * at more than temperature: that is in columns that have no entries. */
static quern_real diffusivity(const heat *p, const quern_step *s) {
	const quern_bound *law = &s->slot[SLOT_CONDUCTIVITY][0];
	const quern_column *u = s->use;
	const quern_real new = 1e-3 * AT_FIRST;
	const uint32_t n = s->host->set(s->run, "point").n;
	_Alignas(64) quern_real found[CHUNK];
	quern_real most = 0;
	for (uint32_t i = 0; i < n; i += CHUNK) {
		const uint32_t m = n - i < CHUNK ? n - i : CHUNK;
		heat_conductivity(law, u[BEGIN_TEMPERATURE].real[0], i, m, found);
		for (uint32_t j = 0; j < m; j++) {
			const quern_real own =
				found[j] * u[BEGIN_VOLUME].real[0][i + j] / (p->capacity * u[BEGIN_MASS].real[0][i + j]);
			most = own > most ? own : most;
		}
	}
	if (n || law->n_uses) return most;
	heat_conductivity(law, &new, 0, 1, found);
	return found[0] / (p->capacity * p->density);
}

/* No arrangement of points decays faster than chi alpha/h^2, with the shape's chi: it bounds the same sum of squared
 * slopes as for stress waves. Explicit steps bear twice the time of that. */
static quern_real limit(const void *self, const quern_step *s, quern_real *hard, char reason[160]) {
	const heat *p = self;
	const quern_real cell = s->host->grid(s->run)->cell;
	const quern_real rate = p->stiffness * diffusivity(p, s) / (cell * cell);
	snprintf(reason, 160, "conduction of heat in cells of %.3g m", cell);
	*hard = rate > 0 ? 2 / rate : INFINITY;
	return rate > 0 ? 1 / rate : INFINITY;
}

static const quern_output sums[] = { { .name = "heat", .unit = "J", .doc = "Of the points, from 0 K on." },
	{ .name = NULL } };

static void account(const void *self, const quern_step *s, quern_real *sum) {
	const uint32_t n = s->host->set(s->run, "point").n;
	quern_real *own = s->host->memory(s->run, n * sizeof *own);
	for (uint32_t i = 0; own && i < n; i++)
		own[i] = heat_capacity_of(self, s->use[BEGIN_MASS], s->use[BEGIN_WEIGHT], i) *
				 s->use[BEGIN_TEMPERATURE].real[0][i];
	if (own) sum[0] = s->host->sum(s->run, n, own);
}

/* From a file any place may come, and places become numbers of cells. */
static quern_status accept(const void *self, const quern_step *s) {
	const uint32_t n = s->host->set(s->run, "sensor").n;
	(void)self;
	for (uint32_t k = 0; k < s->dim; k++)
		for (uint32_t i = 0; i < n; i++) {
			const quern_real x = s->use[FILL_PLACE].real[k][i];
			if (!(x >= s->lower[k] && x <= s->upper[k]))
				return s->host->stop(s->run, QUERN_E_NUMERIC, "sensor", i, "lies outside of the domain");
		}
	return QUERN_OK;
}

static const char *const needs[] = { "continuum", NULL }, *const after[] = { "hybrid", NULL };

static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "heat", .needs = needs, .after = after,
	.sets = sets, .slots = slots, .stages = stages, .sums = sums, .ready = ready, .limit = limit,
	.account = account, .accept = accept };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "solver.heat",
	.brief = "Conduction of heat through the continuum.",
	.doc = "Points carry temperature, nodes exchange heat, points take the nodes' change. All faces are "
		   "insulated. A point that is made of grains is at 293.15 K.",
	.instance_size = sizeof(heat),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
