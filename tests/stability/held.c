/* SPDX-License-Identifier: MIT */
/* held - a hybrid column held by walls on both sides */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "beyond.h"
#include "harness.h"
#include "held.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double diameter = 2e-3, gravity = 9.81;

static double step_limit(quern_run *run, const char *section, double *hard) {
	const quern_section *s = quern_scene_section(run->scene, section);
	const quern_step step = quern_run_record(run, s);
	char reason[160];
	return s->ops->limit(s->solver->self, &step, hard, reason);
}

held held_open(double width, double height, int substeps, const char *packer, int seed) {
	held h = { .width = width };
	h.run = harness_open(1,
		"quern: 1\ndimension: 2\nseed: %d\ngravity: [0, -9.81]\n"
		"domain: {lower: [0, 0], upper: [%g, 0.2]}\ntime: {end: 1000}\noutput: {every: 1000}\n"
		"grains:\n  material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}}\n"
		"  integrator: symplectic_euler\n" /* of which the limits here were measured */
		"  contact: {linear: {stiffness: 1e6, restitution: 0.5, friction: 0.4}}\n"
		"  fill:\n    - {region: {box: {lower: [0, -0.7 mm], upper: [%g, -0.7 mm]}}, fixed: true}\n"
		"    - {region: {box: {lower: [0.001, 0.001], upper: [%g, %g]}}, settle: true}\n"
		"bodies:\n  - plane: {point: [0, 0], normal: [0, 1], boundary: sticky}\n"
		"  - plane: {point: [0, 0], normal: [1, 0], contact: {friction: 0}}\n"
		"  - plane: {point: [%g, 0], normal: [-1, 0], contact: {friction: 0}}\n"
		"continuum:\n  cell: 4 mm\n  material: {mu_i: {bulk_modulus: 3e5, diameter: 2 mm, grain_density: "
		"2500, "
		"critical_density: 1975}}\n"
		"hybrid:\n  oracle: [{packing_fraction: {depth: 14 mm, half_width: 4 mm}}]\n"
		"  substeps: %d\n  packer: %s\n  update: 400\n  growth: 7000\n",
		seed, width, width, width - 0.001, height, width, substeps, packer);
	harness_settle(h.run);
	h.weight = quern_run_carries(h.run, "mass") * gravity;
	h.unit = h.weight * diameter;
	double hard;
	h.grain_step = step_limit(h.run, "grains", &hard);
	step_limit(h.run, "continuum", &h.continuum_limit);
	beyond_force_step(h.run, substeps * h.grain_step);
	return h;
}

double held_kinetic(const held *h) { return quern_run_carries(h->run, "kinetic") / h->unit; }

typedef struct layer {
	double height, mass;
} layer;

static int by_height(const void *a, const void *b) {
	const double x = ((const layer *)a)->height, y = ((const layer *)b)->height;
	return (x > y) - (x < y);
}

static uint32_t collect(quern_run *run, const char *set, layer *out) {
	char name[3][32];
	static const char *const fields[] = { "position", "mass", "weight" };
	for (int k = 0; k < 3; k++) snprintf(name[k], sizeof name[k], "%s.%s", set, fields[k]);
	const quern_column x = harness_field(run, name[0]), m = harness_field(run, name[1]),
					   w = harness_field(run, name[2]);
	const uint32_t n = harness_count(run, set);
	for (uint32_t i = 0; i < n; i++)
		out[i] = (layer) { x.real[1][i], x.real[1][i] > 0 ? m.real[0][i] * w.real[0][i] : 0 };
	return n;
}

double held_top(const held *h) {
	const size_t most = (size_t)harness_count(h->run, "grain") + harness_count(h->run, "point");
	layer *all = calloc(most + 1, sizeof *all);
	assert_non_null(all);
	uint32_t n = collect(h->run, "grain", all);
	n += collect(h->run, "point", all + n);
	qsort(all, n, sizeof *all, by_height);
	double mass = 0, below = 0, top = 0;
	for (uint32_t i = 0; i < n; i++) mass += all[i].mass;
	for (uint32_t i = 0; i < n && below < 0.99 * mass; i++) below += all[i].mass, top = all[i].height;
	free(all);
	return top;
}

double held_support(const held *h) {
	return harness_field(h->run, "body.impulse").real[1][0] +
		   harness_field(h->run, "total.support").real[1][0];
}

double held_middle(double *rest, int n) {
	for (int i = 1; i < n; i++)
		for (int k = i; k > 0 && rest[k] < rest[k - 1]; k--) {
			const double swap = rest[k];
			rest[k] = rest[k - 1], rest[k - 1] = swap;
		}
	return rest[n / 2];
}
