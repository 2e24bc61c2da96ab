/* SPDX-License-Identifier: MIT */
/* ask_body - how far a place is from a body of a scene, by the body's own word */
#pragma once
#include "harness.h"
#include <quern/body.h>

typedef struct place {
	double x[3];
} place;

static inline const quern_filling *body_of(const quern_run *run, size_t b) {
	return &quern_scene_section(run->scene, "bodies")->slots[0].filling[b];
}

/* Distance to the nearest place of a scene's first body or to one of its features, and the normal there. */
static inline double ask(const quern_run *run, const int32_t *feature, place at, double normal[3]) {
	static const quern_pose still = { .turn = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } };
	_Alignas(64) double x[3][8], radius[8] = { 0 }, gap[8], n[3][8], v[3][8];
	_Alignas(64) int32_t which[8] = { feature ? *feature : 0 };
	const uint32_t dim = (uint32_t)run->scene->general.dimension;
	for (int k = 0; k < 3; k++)
		for (int i = 0; i < 8; i++) x[k][i] = at.x[k];
	const quern_body_batch batch = { .n = 1,
		.cap = 8,
		.dim = dim,
		.pose = &still,
		.position = { x[0], x[1], x[2] },
		.radius = radius,
		.feature = feature ? which : NULL,
		.gap = gap,
		.normal = { n[0], n[1], n[2] },
		.velocity = { v[0], v[1], v[2] } };
	const quern_instance *it = body_of(run, 0)->instance;
	((const quern_body_ops *)it->ops)->closest(it->self, &batch);
	for (uint32_t k = 0; k < 3; k++) normal[k] = k < dim ? n[k][0] : 0;
	return gap[0];
}
