/* SPDX-License-Identifier: MIT */
/* observer.coordination - how many contacts that bear a force a grain has in the mean */
#include "observers.h"
#include "region.h"
#include <quern/vec.h>

typedef struct {
	observer_region region;
	bool rattlers;
} observer;
static const quern_param params[] = { REGION_PARAMS(observer, QUERN_MAYBE),
	QUERN_PARAM(observer, rattlers, NULL,
		"Count grains that bear nothing too; without them, neither they nor their contacts count.", .def = 1),
	QUERN_END_PARAMS };
/* clang-format off */
#define USES(X) \
	X(POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(WEIGHT, "grain.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(FIXED, "grain.fixed", "1", QUERN_READ, QUERN_INDEX, .flags = QUERN_OPTIONAL) \
	X(FIRST, "contact.first", "1", QUERN_READ, QUERN_INDEX, .flags = QUERN_OPTIONAL, .target = "grain") \
	X(SECOND, "contact.second", "1", QUERN_READ, QUERN_INDEX, .flags = QUERN_OPTIONAL, .target = "grain") \
	X(FORCE, "contact.force", "N", QUERN_READ, QUERN_VECTOR, .with = "contact.first") \
	X(TOUCHING, "touch.grain", "1", QUERN_READ, QUERN_INDEX, .flags = QUERN_OPTIONAL, .target = "grain") \
	X(TOUCH, "touch.force", "N", QUERN_READ, QUERN_VECTOR, .with = "touch.grain") \
	X(BOX, "total.box_length", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL)
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

enum { NUMBER, GRAINS, RATTLERS };
static const quern_output outputs[] = {
	{ .name = "number",
		.unit = "1",
		.doc = "Contacts with a force per grain, on grains and bodies; 0 without grains." },
	{ .name = "grains", .unit = "1", .doc = "Grains that count, with their weights." },
	{ .name = "rattlers", .unit = "1", .doc = "Share of the region's grains that bear nothing." },
	{ .name = NULL }
};

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	return region_init(&((observer *)self)->region, setup, err);
}

/* A contact that bears a force; on a body `second` is -1. */
typedef struct link {
	int32_t first, second;
} link;

static bool bears(const quern_column *force, uint32_t i, uint32_t dim) {
	return cloud_square(force, i, dim) > 0;
}

/* Pairs across blocks stand in both, and count where the first is at home. */
static uint32_t collect(const quern_observer_batch *b, const quern_host *host, quern_run *run, link *out) {
	const quern_column *u = b->use;
	const quern_set_view grains = host->set(run, "grain"), contacts = host->set(run, "contact");
	uint32_t n = 0;
	for (uint32_t block = 0; u[FIRST].index && block < contacts.n_blocks; block++)
		for (uint32_t q = contacts.block[block]; q < contacts.block[block + 1]; q++) {
			const int32_t i = u[FIRST].index[q];
			if (i < (int32_t)grains.block[block] || i >= (int32_t)grains.block[block + 1]) continue;
			if (bears(&u[FORCE], q, b->dim)) out[n++] = (link) { i, u[SECOND].index[q] };
		}
	for (uint32_t q = 0; u[TOUCHING].index && q < b->count[TOUCHING]; q++)
		if (bears(&u[TOUCH], q, b->dim)) out[n++] = (link) { u[TOUCHING].index[q], -1 };
	return n;
}

/* Contacts by grain, of those between grains that count. */
static void count_links(
	const link *it, uint32_t n, const int32_t *left_out, int32_t *number, uint32_t grains) {
	for (uint32_t i = 0; i < grains; i++) number[i] = 0;
	for (uint32_t q = 0; q < n; q++) {
		const int32_t i = it[q].first, j = it[q].second;
		if (left_out[i] || (j >= 0 && left_out[j])) continue;
		number[i]++;
		if (j >= 0) number[j]++;
	}
}

/* Who has fewer contacts than there are dimensions bears nothing, nor does what leans on such grains alone. */
static void leave_out(
	const quern_observer_batch *b, const link *it, uint32_t n, int32_t *left_out, int32_t *number) {
	const int32_t *fixed = b->use[FIXED].index, dim = (int32_t)b->dim;
	for (bool more = true; more;) {
		more = false;
		count_links(it, n, left_out, number, b->count[POSITION]);
		for (uint32_t i = 0; i < b->count[POSITION]; i++) {
			if (left_out[i] || number[i] >= dim || (fixed && fixed[i])) continue;
			left_out[i] = 1;
			more = true;
		}
	}
}

static void average(const observer *o, const quern_observer_batch *b, const int32_t *left_out,
	const int32_t *number, quern_real *term[3], quern_real *out, const quern_host *host, quern_run *run) {
	const quern_column *u = b->use;
	const uint32_t grains = b->count[POSITION];
	const bool still = !u[BOX].real[0];
	for (uint32_t i = 0; i < grains; i++) {
		const bool in = !(u[FIXED].index && u[FIXED].index[i]) &&
						region_holds(&o->region, u[POSITION].real, i, b->dim, still);
		const quern_real share = in ? (u[WEIGHT].real[0] ? u[WEIGHT].real[0][i] : 1) : 0;
		term[GRAINS][i] = o->rattlers || !left_out[i] ? share : 0;
		term[NUMBER][i] = term[GRAINS][i] * number[i];
		term[RATTLERS][i] = left_out[i] ? share : 0;
	}
	quern_real sum[3];
	for (int k = 0; k < 3; k++) sum[k] = host->sum_set(run, "grain", term[k]);
	const quern_real all = sum[GRAINS] + (o->rattlers ? 0 : sum[RATTLERS]);
	out[GRAINS] = sum[GRAINS];
	out[NUMBER] = sum[GRAINS] > 0 ? sum[NUMBER] / sum[GRAINS] : 0;
	out[RATTLERS] = all > 0 ? sum[RATTLERS] / all : 0;
}

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const observer *o = self;
	const uint32_t grains = b->use[POSITION].real[0] ? b->count[POSITION] : 0;
	const size_t most = (size_t)host->set(run, "contact").n + host->set(run, "touch").n;
	link *it = host->memory(run, (most + 1) * sizeof *it);
	int32_t *left_out = host->memory(run, (grains + (size_t)1) * sizeof *left_out),
			*number = host->memory(run, (grains + (size_t)1) * sizeof *number);
	quern_real *term[3];
	for (int k = 0; k < 3; k++)
		if (!(term[k] = host->memory(run, (grains + (size_t)1) * sizeof(quern_real)))) return QUERN_E_MEMORY;
	if (!it || !left_out || !number) return QUERN_E_MEMORY;
	if (!grains) return QUERN_OK;
	const uint32_t n = collect(b, host, run, it);
	leave_out(b, it, n, left_out, number);
	if (o->rattlers) {
		int32_t *nobody = host->memory(run, (grains + (size_t)1) * sizeof *nobody);
		if (!nobody) return QUERN_E_MEMORY;
		count_links(it, n, nobody, number, grains);
	}
	average(o, b, left_out, number, term, out, host, run);
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 2,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.coordination",
	.brief = "How many contacts that bear a force a grain has.",
	.doc = "A rattler has fewer of them than the scene has dimensions, or would if those that have were "
		   "taken out.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
