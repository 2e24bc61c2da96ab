/* SPDX-License-Identifier: MIT */
/* observer.temperature - mean, least and largest temperature of the points */
#include <quern/observer.h>

typedef struct {
	int32_t unused;
} observer;
static const quern_param params[] = { QUERN_END_PARAMS };

enum { TEMPERATURE, MASS, WEIGHT };
/* optional all of them: the twin of pure grains has no points, that of pure continuum no temperature */
#define USE(field_, unit_)                                                                                   \
	{ .field = field_, .unit = unit_, .access = QUERN_READ, .shape = QUERN_SCALAR, .flags = QUERN_OPTIONAL }
static const quern_use uses[] = { USE("point.temperature", "K"), USE("point.mass", "kg"),
	USE("point.weight", "1"), QUERN_END_USES };

enum { MEAN, LEAST, MOST };
static const quern_output outputs[] = { { "mean", "K", "By mass. All are zero where there is none.",
											QUERN_SUM, 0 },
	{ "min", "K", "Of the coldest point.", QUERN_MIN, 0 },
	{ "max", "K", "Of the hottest point.", QUERN_MAX, 0 }, { .name = NULL } };

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const quern_real *temperature = b->use[TEMPERATURE].real[0], *weight = b->use[WEIGHT].real[0];
	const uint32_t n = temperature ? b->count[TEMPERATURE] : 0;
	quern_real *mass = host->memory(run, n * sizeof *mass), *heat = host->memory(run, n * sizeof *heat);
	(void)self;
	if (!mass || !heat) return QUERN_E_MEMORY;
	out[MEAN] = out[LEAST] = out[MOST] = 0;
	for (uint32_t i = 0; i < n; i++) {
		const quern_real t = temperature[i];
		mass[i] = b->use[MASS].real[0][i] * (weight ? weight[i] : 1);
		heat[i] = mass[i] * t;
		out[LEAST] = !i || t < out[LEAST] ? t : out[LEAST];
		out[MOST] = !i || t > out[MOST] ? t : out[MOST];
	}
	const quern_real all = host->sum(run, n, mass);
	out[MEAN] = all > 0 ? host->sum(run, n, heat) / all : 0;
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.temperature",
	.brief = "Mean, least and largest temperature of the points.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
