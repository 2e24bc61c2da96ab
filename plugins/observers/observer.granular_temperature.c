/* SPDX-License-Identifier: MIT */
/* observer.granular_temperature - how much the velocities of grains differ from their mean */
#include "observers.h"
#include "region.h"

typedef struct {
	observer_region region;
} observer;
static const quern_param params[] = { REGION_PARAMS(observer, QUERN_MAYBE), QUERN_END_PARAMS };
/* clang-format off */
#define OWN_USES(X) \
	X(POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(VELOCITY, "grain.velocity", "m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(BOX, "total.box_length", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL)
/* clang-format on */
QUERN_USE_ENUM_FROM(CLOUD_USES_ROWS, OWN_USES);
static const quern_use uses[] = { CLOUD_USES(QUERN_USE_ROW) OWN_USES(QUERN_USE_ROW) QUERN_END_USES };

enum { TEMPERATURE, MEAN, GRAINS = MEAN + 3 };
static const quern_output outputs[] = {
	{ .name = "temperature",
		.unit = "m^2/s^2",
		.doc = "Mean square of v - <v> over the dimensions; 0 without grains." },
	{ .name = "x", .unit = "m/s", .doc = "Mean velocity along x." },
	{ .name = "y", .unit = "m/s", .doc = "Along y." },
	{ .name = "z", .unit = "m/s", .doc = "Along z; 0 in 2-D." },
	{ .name = "grains", .unit = "1", .doc = "Grains in the region, with their weights." }, { .name = NULL }
};

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	return region_init(&((observer *)self)->region, setup, err);
}

/* Each grain counts as one, whatever its mass. */
static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const observer *o = self;
	quern_real *const *x = b->use[POSITION].real, *const *v = b->use[VELOCITY].real;
	const cloud grains = observed(b, false);
	const bool still = !b->use[BOX].real[0];
	cloud_sums s;
	if (!cloud_open(&s, host, run, &grains)) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < grains.n; i++)
		s.mass[i] =
			region_holds(&o->region, x, i, b->dim, still) ? cloud_mass(&grains, i) / grains.mass[i] : 0;
	const quern_real n = out[GRAINS] = cloud_total(&s);
	if (!(n > 0)) return QUERN_OK;
	for (uint32_t k = 0; k < b->dim; k++) {
		CLOUD_ADD(&s, i, v[k][i], out[MEAN + k]);
		out[MEAN + k] /= n;
	}
	for (uint32_t k = 0; k < b->dim; k++)
		CLOUD_ADD(&s, i, (v[k][i] - out[MEAN + k]) * (v[k][i] - out[MEAN + k]), out[TEMPERATURE]);
	out[TEMPERATURE] /= n * b->dim;
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 2,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.granular_temperature",
	.brief = "How much the velocities of grains differ from their mean.",
	.doc = "A mean flow that changes across the region counts as heat: take regions that are thin along its "
		   "gradient. Points have no temperature, since their velocity is a mean already.",
	.cite = "Goldhirsch 2008",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
