/* SPDX-License-Identifier: MIT */
/* The same bits with one worker and with many, in process: what a thread sanitizer looks at. Conversions happen. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static quern_run *column(uint32_t workers, int dim) {
	const bool flat = dim == 2;
	return harness_open(workers,
		"quern: 1\ndimension: %d\ngravity: %s\ndomain: {lower: %s, upper: %s, periodic: %s}\ntime: {end: "
		"0.05}\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}},\n"
		"  contact: {linear: {stiffness: 1e5, friction: 0.4}},\n"
		"  fill: {region: {box: {lower: %s, upper: %s}}, velocity: %s}}\n"
		"bodies:\n  - plane: {point: %s, normal: %s, boundary: sticky}\n"
		"continuum: {cell: 4 mm, material: mu_i}\n"
		"hybrid: {oracle: [{packing_fraction: {depth: 6 mm, half_width: 4 mm}}], substeps: 4, update: 20, "
		"hysteresis: 0}\n"
		"observe: [energy, mass]\n",
		dim, flat ? "[0, -9.81]" : "[0, 0, -9.81]", flat ? "[0, 0]" : "[0, 0, 0]",
		flat ? "[0.16, 0.08]" : "[0.08, 0.02, 0.06]", flat ? "[false, false]" : "[false, true, false]",
		flat ? "[0.01, 0.001]" : "[0.01, 0, 0.001]", flat ? "[0.09, 0.06]" : "[0.05, 0.02, 0.03]",
		flat ? "[0.5, 0]" : "[0.5, 0.1, 0]", flat ? "[0, 0]" : "[0, 0, 0]", flat ? "[0, 1]" : "[0, 0, 1]");
}

static void compare(quern_run *a, quern_run *b) {
	const quern_store *p = &a->plan->store, *q = &b->plan->store;
	assert_int_equal(p->n_fields, q->n_fields);
	for (size_t k = 0; k < p->n_fields; k++) {
		const quern_field *f = &p->fields[k], *g = &q->fields[k];
		const quern_set_store *set = &p->sets[f->set];
		assert_int_equal(set->n, q->sets[g->set].n);
		if (f->local || set->rows) continue;
		for (uint8_t c = 0; c < f->n_components; c++)
			if (memcmp(f->data[f->now][c], g->data[g->now][c], set->n * quern_field_bytes(f)) != 0)
				fail_msg("%s differs after %lld steps", f->name, (long long)a->clock.step);
	}
}

typedef struct conversions {
	uint32_t points, grains; /* made since the release, each of the other */
} conversions;

/* Half of the steps, and as many with the continuum begun farther down. Nothing enters or leaves the box: more points are
 * points made of grains, more grains are grains made of points. */
static conversions go_on(quern_run *run, int64_t steps) {
	conversions made = { 0 };
	double *depth = harness_param(run, "oracle.packing_fraction", "depth");
	harness_settle(run);
	for (int64_t i = 0; i < steps; i++) {
		const uint32_t points = harness_count(run, "point"), grains = harness_count(run, "grain");
		if (i == steps / 2) *depth *= 2;
		harness_steps(run, 1);
		const uint32_t more_points = harness_count(run, "point"), more_grains = harness_count(run, "grain");
		if (more_points > points) made.points += more_points - points;
		if (more_grains > grains) made.grains += more_grains - grains;
	}
	return made;
}

static void the_same_bits(int dim, int64_t steps) {
	quern_run *one = column(1, dim);
	const conversions made = go_on(one, steps);
	printf("  %d-D: %u points and %u grains made\n", dim, made.points, made.grains);
	assert_true(made.points > 100 && made.grains > 100);
	for (uint32_t workers = 2; workers <= 3; workers++) {
		quern_run *many = column(workers, dim);
		go_on(many, steps);
		compare(one, many);
		harness_close(many);
	}
	harness_close(one);
}

static void in_a_plane(void **state) {
	(void)state;
	the_same_bits(2, 60);
}
static void in_space(void **state) {
	(void)state;
	the_same_bits(3, 30);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(in_a_plane), cmocka_unit_test(in_space) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
