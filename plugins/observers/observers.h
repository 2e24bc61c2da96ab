/* SPDX-License-Identifier: MIT */
/* observers - what several observers look at: the grains and points that are carried, and how much of each */
#pragma once
#include "../common/cloud.h"
#include "../common/tools.h"
#include <quern/observer.h>

/* The first rows of every observer of both clouds. */
/* clang-format off */
#define CLOUD_USES(X) \
	X(GRAIN_MASS, "grain.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(GRAIN_WEIGHT, "grain.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(GRAIN_FIXED, "grain.fixed", "1", QUERN_READ, QUERN_INDEX, .flags = QUERN_OPTIONAL) \
	X(POINT_MASS, "point.mass", "kg", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(POINT_WEIGHT, "point.weight", "1", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL)
/* clang-format on */
QUERN_USE_ENUM(CLOUD_USES);

/* A cloud, empty if this scene has none. */
QUERN_INLINE cloud observed(const quern_observer_batch *b, bool point) {
	const quern_column *u = b->use;
	const uint32_t row = point ? POINT_MASS : GRAIN_MASS;
	return (cloud) { u[row].real[0], u[point ? POINT_WEIGHT : GRAIN_WEIGHT].real[0],
		point ? NULL : u[GRAIN_FIXED].index, u[row].real[0] ? b->count[row] : 0, point ? "point" : "grain" };
}

/* For observers that count images of a domain which keeps its shape; `box`: the column of total.box_length. */
static inline quern_status refuse_box(
	const quern_column *box, const char *id, const quern_host *host, quern_run *run) {
	if (!box->real[0]) return QUERN_OK;
	return host->stop(run, QUERN_E_PARAM, NULL, -1,
		"observe: %s looks at a domain that keeps its shape, and grains.box strains it: take observer.box and "
		"observer.stress",
		id);
}

/* Both, for sums; false if memory is gone. */
static inline bool observe_clouds(const quern_observer_batch *b, const quern_host *host, quern_run *run,
	cloud_sums *grains, cloud_sums *points) {
	const cloud both[2] = { observed(b, false), observed(b, true) };
	return cloud_open(grains, host, run, &both[0]) && cloud_open(points, host, run, &both[1]);
}
