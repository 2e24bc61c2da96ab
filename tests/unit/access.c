/* SPDX-License-Identifier: MIT */
/* What a stage changes it declares: each stage of a scene is called by itself, and every field that is another one after it
 * than before must stand among its uses, or those of the plugins that it calls, as more than read. The scenes have one
 * grain or one point, so that sorting moves nothing, and things for every stage to do: one is beyond a periodic face. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include <stdlib.h>
#include <string.h>

static bool declares(const quern_plan *p, int stage, int field) {
	for (size_t i = 0; i < p->n_uses; i++)
		if (p->uses[i].stage == stage && p->uses[i].target == field && p->uses[i].row->access != QUERN_READ)
			return true;
	return false;
}

/* All bytes of all fields, one after the other; at[k] is where field k begins. */
static char *copy_fields(const quern_store *s, size_t *at) {
	size_t size = 0;
	char *copy = NULL;
	for (size_t k = 0; k < s->n_fields; k++) {
		const quern_field *f = &s->fields[k];
		const uint32_t n = s->sets[f->set].n;
		const quern_column c = quern_field_column(s, f, f->now);
		at[k] = size;
		for (int i = 0; i < f->n_components && !f->local; i++) {
			const size_t bytes = s->sets[f->set].rows ? 0 : n * quern_field_bytes(f);
			const void *from = f->shape == QUERN_INDEX ? (void *)c.index
							   : f->shape == QUERN_ID  ? (void *)c.id
													   : (void *)c.real[i];
			copy = realloc(copy, size + bytes + 1);
			assert_non_null(copy);
			if (bytes) memcpy(copy + size, from, bytes);
			size += bytes;
		}
	}
	at[s->n_fields] = size;
	return copy;
}

static void call(quern_run *run, int stage) {
	quern_plan_stage *s = &run->plan->stages[stage];
	quern_plan_refresh(run->plan);
	quern_step step = quern_run_record(run, s->section);
	step.use = s->column;
	assert_int_equal(s->stage->run(s->section->solver->self, &step), QUERN_OK);
	quern_plan_swap(run->plan, s->swaps);
}

static void look(quern_run *run) {
	const quern_plan *p = run->plan;
	size_t *before = calloc(p->store.n_fields + 1, sizeof *before),
		   *after = calloc(p->store.n_fields + 1, sizeof *after);
	for (size_t o = 0; o < p->n_stages; o++) {
		const int s = p->order[o];
		if (!p->stages[s].stage || p->stages[s].phase == QUERN_SETUP) continue;
		char *was = copy_fields(&p->store, before);
		call(run, s);
		char *is = copy_fields(&p->store, after);
		for (size_t k = 0; k < p->store.n_fields; k++) {
			const size_t n = before[k + 1] - before[k];
			if (n != after[k + 1] - after[k]) continue; /* a list of another length */
			if (memcmp(was + before[k], is + after[k], n) && !declares(p, s, (int)k))
				fail_msg("%s changes %s and does not say so", p->stages[s].name, p->store.fields[k].name);
		}
		free(was);
		free(is);
	}
	free(before);
	free(after);
}

static void grains_declare(void **state) {
	(void)state;
	for (int verlet = 0; verlet <= 1; verlet++) {
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: 2, gravity: [1, -9.81], domain: {lower: [0, 0], upper: [0.1, 0.1], "
			"periodic: [true, false]},\n"
			"time: {end: 1}, output: {fields: [touch.force, grain.force, body.impulse]}, observe: [energy, "
			"mass],\n"
			"bodies: [{plane: {point: [0, 0], normal: [0, 1]}}],\n"
			"grains: {material: {density: 2500, radius: {mean: 0.001}}, contact: {linear: {stiffness: "
			"1e5}},\n"
			"  integrator: %s, place: [{position: [0.05, 0.000999], velocity: [1, 0], spin: [3, 0]}]}}\n",
			verlet ? "velocity_verlet" : "symplectic_euler");
		harness_steps(run, 3);
		for (int k = 0; k < 3; k++) {
			harness_field(run, "grain.position").real[0][0] = 0.1 + 1e-5;
			harness_field(run, "total.displacement").real[0][0] = 1;
			look(run);
		}
		harness_close(run);
	}
}

static void points_declare(void **state) {
	(void)state;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [1, -9.81], domain: {lower: [0, 0], upper: [0.8, 0.8], periodic: "
		"[true, false]},\n"
		"time: {end: 1}, output: {fields: [point.pressure, point.gradient, point.wave_speed, total.faces]}, "
		"observe: [energy],\n"
		"bodies: [{plane: {point: [0, 0.3], normal: [0, 1]}}],\n"
		"continuum: {cell: 0.1, points: 1, rasterise: affine, material: {drucker_prager: {bulk_modulus: "
		"1e5,\n"
		"  density: 1500}}, fill: {region: {box: {lower: [0.3, 0.3], upper: [0.4, 0.4]}}, velocity: [1, "
		"-1]}}}\n");
	harness_steps(run, 3);
	for (int k = 0; k < 3; k++) {
		harness_field(run, "point.position").real[0][0] = 0.8 + 1e-5;
		harness_field(run, "total.unsorted").index[0] = 1;
		look(run);
	}
	harness_close(run);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(grains_declare), cmocka_unit_test(points_declare) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
