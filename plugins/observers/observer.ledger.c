/* SPDX-License-Identifier: MIT */
/* observer.ledger - what grains and continuum owe each other, and how well mass is carried. docs/theory/hybrid.md, 5 */
#include "observers.h"
#include <math.h>
#include <quern/observer.h>

typedef struct {
	int32_t unused;
} observer;
static const quern_param params[] = { QUERN_END_PARAMS };
/* clang-format off */
#define OWN_USES(X) \
	X(OWED, "cell.owed", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(MASS, "total.mass_initial", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(MASS_DEFECT, "total.mass_defect", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(MOMENTUM_DEFECT, "total.momentum_defect", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(EXCHANGE_DEFECT, "total.exchange_defect", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(DENSEST, "total.densest", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(PASSED, "total.passed", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL)
/* clang-format on */
QUERN_USE_ENUM_FROM(CLOUD_USES_ROWS, OWN_USES);
static const quern_use uses[] = { CLOUD_USES(QUERN_USE_ROW) OWN_USES(QUERN_USE_ROW) QUERN_END_USES };
static const quern_output outputs[] = {
	{ .name = "entries", .unit = "1", .doc = "Sum of |entries| over the mass." },
	{ .name = "carried",
		.unit = "1",
		.doc = "Carried mass over that at the release, with what was poured and without what has left, minus "
			   "1." },
	{ .name = "owed", .unit = "kg", .doc = "Sum of all entries." },
	{ .name = "mass_defect", .unit = "1", .doc = "Of the mass invariant: the worst so far." },
	{ .name = "momentum_defect", .unit = "1", .doc = "Of the momentum invariant: the worst so far." },
	{ .name = "exchange_defect",
		.unit = "1",
		.doc = "Of the coupling's momentum, in the last step: the worst node." },
	{ .name = "densest",
		.unit = "1",
		.doc = "Density of the densest place over the continuum's without stress, at the last update." },
	{ .name = NULL }
};

/* Without a hybrid there is no ledger: nothing is owed, nothing is missing. */
static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const quern_column *u = b->use;
	const uint32_t n = u[OWED].real[0] ? b->count[OWED] : 0;
	quern_real *size = host->memory(run, ((size_t)n + 1) * sizeof(quern_real));
	cloud_sums grains, points;
	(void)self;
	if (!u[OWED].real[0]) return QUERN_OK;
	const quern_real mass = u[MASS].real[0][0] - (u[PASSED].real[0] ? u[PASSED].real[0][0] : 0);
	if (!(mass > 0)) return QUERN_OK;
	if (!size || !observe_clouds(b, host, run, &grains, &points)) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) size[i] = fabs(u[OWED].real[0][i]);
	out[0] = host->sum_set(run, "cell", size) / mass;
	out[1] = (cloud_total(&grains) + cloud_total(&points)) / mass - 1;
	out[2] = host->sum_set(run, "cell", u[OWED].real[0]);
	for (int k = 0; k < 4; k++) out[3 + k] = u[MASS_DEFECT + k].real[0][0];
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 2,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.ledger",
	.brief = "What grains and continuum owe each other.",
	.doc = "The invariants hold to round-off by honest booking; the entries and the carried mass measure "
		   "quality.",
	.cite = "Chantharayukhonthorn 2019, 6.1",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
