/* SPDX-License-Identifier: MIT */
/* A continuum alone that looks after its points: where it is stretched no cell within it is left without one, where they crowd
 * they join, and mass, momentum, volume, the centre of mass and the sum of volume times stress stay to round-off over many thousands of
 * both. docs/theory/mpm.md, section 9 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <stdlib.h>
#include <string.h>

static const double cell = 0.1, density = 1500;

/* ==== a block that is drawn out ==== */

typedef struct counts {
	int holes, most; /* cells without a point between two that have some; points in the fullest */
	uint32_t points;
} counts;

/* Along x, in the rows of cells that the block takes. */
static counts count_cells(quern_run *run) {
	enum { WIDE = 64, HIGH = 64 };
	static int in[HIGH][WIDE];
	const quern_column x = harness_field(run, "point.position");
	counts c = { .points = harness_count(run, "point") };
	memset(in, 0, sizeof in);
	for (uint32_t i = 0; i < c.points; i++) in[(int)(x.real[1][i] / cell)][(int)(x.real[0][i] / cell)]++;
	for (int y = 0; y < HIGH; y++) {
		int first = WIDE, last = -1;
		for (int k = 0; k < WIDE; k++) {
			if (in[y][k]) last = k, first = first < k ? first : k;
			c.most = in[y][k] > c.most ? in[y][k] : c.most;
		}
		for (int k = first; k <= last; k++) c.holes += !in[y][k];
	}
	return c;
}

/* Hardly any stress, v = a (x, -y): after a while four times as long, and a quarter as high. */
static quern_run *open_stretched(int every) {
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [6, 3.2]}, time: {end: 1000, step: 2e-3},\n"
		"output: {every: 1000}, continuum: {cell: 0.1, resample: %d, transfer: apic,\n"
		"  material: {elastic: {bulk_modulus: 1e-3, density: 1500}},\n"
		"  fill: [{region: {box: {lower: [2.5, 1], upper: [3.5, 2]}}}]}}\n",
		every);
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
					   c = harness_field(run, "point.affine");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		v.real[0][i] = x.real[0][i] - 3, v.real[1][i] = -0.3 * (x.real[1][i] - 1.5);
		c.real[0][i] = 1, c.real[3][i] = -0.3;
	}
	return run;
}

static void stretched(void **unused) {
	(void)unused;
	counts c[2];
	bool good = true;
	double mass[2], length[2];
	table_head("a block that is drawn out to three times its length");
	for (int looks = 0; looks <= 1; looks++) {
		quern_run *run = open_stretched(looks ? 20 : 0);
		const double before = quern_run_carries(run, "mass");
		harness_until(run, 2);
		const quern_column x = harness_field(run, "point.position");
		double low = INFINITY, high = 0;
		for (uint32_t i = 0; i < harness_count(run, "point"); i++)
			low = fmin(low, x.real[0][i]), high = fmax(high, x.real[0][i]);
		c[looks] = count_cells(run), length[looks] = high - low;
		mass[looks] = quern_run_carries(run, "mass") / before;
		harness_close(run);
	}
	table_note("points, left alone", c[0].points);
	table_note("points, looked after", c[1].points);
	table_note("cells without a point, left alone", c[0].holes);
	good &=
		table_row("cells without a point, looked after", c[1].holes, 0, 0.1 * c[0].holes) && c[0].holes > 20;
	good &= table_row("length, over that of what is left alone", length[1] / length[0], 1, 0.02);
	good &= table_row("mass", mass[1], 1, 1e-13);
	good &= table_row("points in the fullest cell", c[1].most, 0, 8);
	assert_true(good);
}

/* ==== many thousands of partings and joinings ==== */

static const char *const materials[] = {
	"mu_i: {bulk_modulus: 1e5, diameter: 5e-3, grain_density: 2500, critical_density: 1500}",
	"drucker_prager: {bulk_modulus: 1e5, density: 1500}", "remembering: {bulk_modulus: 1e5, density: 1500}"
};
enum { HYPER = 1, REMEMBERS, MATERIALS };

static quern_run *open_crowd(uint32_t dim, int material) {
	const bool deep = dim == 3;
	return harness_open(1,
		"{quern: 1, dimension: %u, gravity: [0, 0%s], domain: {lower: [0, 0%s], upper: [2, 1.2%s], periodic: [true, false%s]},\n"
		"time: {end: 1000, step: 1e-9}, output: {every: 1000},\n"
		"continuum: {cell: 0.1, resample: 1, material: {%s},\n"
		"  fill: [{region: {box: {lower: [0, 0%s], upper: [2, 1%s]}}}]}}\n",
		dim, deep ? ", 0" : "", deep ? ", 0" : "", deep ? ", 0.6" : "", deep ? ", true" : "",
		materials[material], deep ? ", 0" : "", deep ? ", 0.6" : "");
}

static double drawn(uint64_t *state) {
	*state = *state * 6364136223846793005u + 1442695040888963407u;
	return (double)(*state >> 11) / 9007199254740992.0;
}

/* Masses, volumes, velocities and stresses of their own; some have none. */
static void dress(quern_run *run, uint32_t dim, int material, uint64_t *state) {
	const quern_column v = harness_field(run, "point.velocity"), m = harness_field(run, "point.mass"),
					   volume = harness_field(run, "point.volume"), s = harness_field(run, "point.stress");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const bool open = drawn(state) < 0.3;
		const double p = open ? 0 : 100 * drawn(state);
		m.real[0][i] *= 0.8 + 0.4 * drawn(state);
		volume.real[0][i] = m.real[0][i] / density * (open ? 1 + drawn(state) : 1 - 1e-5 * p);
		for (uint32_t k = 0; k < (dim == 2 ? 3 : 6); k++)
			s.real[k][i] = k < dim ? -p : 0.1 * p * (drawn(state) - 0.5);
		for (uint32_t k = 0; k < dim; k++) v.real[k][i] = drawn(state) - 0.5;
		if (material == HYPER) harness_field(run, "point.volume_strain").real[0][i] = open ? 0.3 : -1e-5 * p;
	}
}

/* Each point anywhere in the layer. */
static void mix(quern_run *run, uint32_t dim, uint64_t *state) {
	const quern_column x = harness_field(run, "point.position");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		x.real[0][i] = 2 * drawn(state), x.real[1][i] = 1e-3 + 0.998 * drawn(state);
		if (dim == 3) x.real[2][i] = 0.6 * drawn(state);
	}
}

typedef struct sums {
	double mass, volume, momentum[3], stress[6], height, size, heat, strain, warmth;
} sums;

static sums sum(quern_run *run, uint32_t dim, int material) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
					   m = harness_field(run, "point.mass"), volume = harness_field(run, "point.volume"),
					   s = harness_field(run, "point.stress");
	sums out = { 0 };
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double mass = m.real[0][i];
		out.mass += mass, out.volume += volume.real[0][i], out.height += mass * x.real[1][i];
		for (uint32_t k = 0; k < dim; k++)
			out.momentum[k] += mass * v.real[k][i], out.size += fabs(mass * v.real[k][i]);
		for (uint32_t k = 0; k < (dim == 2 ? 3 : 6); k++) out.stress[k] += volume.real[0][i] * s.real[k][i];
		if (material == HYPER) out.strain += mass * harness_field(run, "point.volume_strain").real[0][i];
		if (material == REMEMBERS) {
			out.heat += harness_field(run, "point.heat").real[0][i];
			out.warmth += mass * harness_field(run, "point.warmth").real[0][i];
		}
	}
	return out;
}

/* The stage itself, between two steps. */
static void look(quern_run *run) {
	for (size_t k = 0; k < run->plan->n_stages; k++) {
		const quern_plan_stage *stage = &run->plan->stages[k];
		if (strcmp(stage->name, "mpm.resample") != 0) continue;
		quern_step step = quern_run_record(run, stage->section);
		step.step = step.stage_step + 1, step.use = stage->column;
		if (stage->stage->run(stage->section->solver->self, &step) != QUERN_OK) fail_msg("%s", run->message);
	}
	quern_plan_refresh(run->plan);
}

static bool compare(const sums *was, const sums *now, uint32_t dim, int material) {
	bool good = table_row("  mass", now->mass / was->mass, 1, 1e-13);
	good &= table_row("  volume", now->volume / was->volume, 1, 1e-13);
	good &= table_row("  height of the middle", now->height / was->height, 1, 1e-13);
	for (uint32_t k = 0; k < dim; k++)
		good &= table_row("  momentum gained", (now->momentum[k] - was->momentum[k]) / was->size, 0, 1e-13);
	for (uint32_t k = 0; k < (dim == 2 ? 3 : 6); k++)
		good &= table_row("  volume times stress, over that of xx",
			(now->stress[k] - was->stress[k]) / was->stress[0], 0, 1e-13);
	if (material == HYPER) good &= table_row("  mean volume strain", now->strain / was->strain, 1, 1e-12);
	if (material == REMEMBERS) good &= table_row("  heat", now->heat / was->heat, 1, 1e-13);
	if (material == REMEMBERS) good &= table_row("  mean warmth", now->warmth / was->warmth, 1, 1e-13);
	return good;
}

/* What is new has its own age; all others get 50. Returns how many were new. */
static double age(quern_run *run) {
	const quern_column c = harness_field(run, "point.age");
	double n = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) n += c.real[0][i] != 50, c.real[0][i] = 50;
	return n;
}

/* Points are mixed again and again, so that there are always cells with few and with many; each material sees the same, and one of them tells what is
 * new. */
static bool try_crowd(uint32_t dim, int material) {
	uint64_t state = 14;
	quern_run *run = open_crowd(dim, material);
	char name[80];
	harness_steps(run, 1);
	dress(run, dim, material, &state);
	if (material == REMEMBERS) age(run);
	double parted = 0, joined = 0;
	bool good = true;
	sums first = sum(run, dim, material), now = first;
	for (int round = 0; round < (dim == 2 ? 850 : 400); round++) {
		mix(run, dim, &state);
		first.height += sum(run, dim, material).height - now.height; /* mixing moves the middle */
		const uint32_t before = harness_count(run, "point");
		look(run);
		now = sum(run, dim, material);
		if (material != REMEMBERS) continue;
		const double new = age(run);
		parted += new, joined += new + before - harness_count(run, "point");
	}
	snprintf(
		name, sizeof name, "%u-D %.*s", dim, (int)strcspn(materials[material], ":"), materials[material]);
	table_note(name, harness_count(run, "point"));
	if (material == REMEMBERS) {
		table_note("  parted", parted);
		table_note("  joined", joined);
		good &= parted + joined > 1e4 && joined > 300;
	}
	good &= compare(&first, &now, dim, material);
	harness_close(run);
	return good;
}

static void many_times(void **unused) {
	(void)unused;
	bool good = true;
	table_head("points parted and joined, again and again: after over before");
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int material = 0; material < MATERIALS; material++) good &= try_crowd(dim, material);
	assert_true(good);
}

/* ==== bodies ==== */

/* A plate that takes half of a row of cells, with points above and below it: cells that it cuts hold few, and what is new there is not put into
 * it. */
static void not_into_bodies(void **unused) {
	(void)unused;
	uint64_t state = 14;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [2, 1.2], periodic: [true, false]},\n"
		"time: {end: 1000, step: 1e-9}, output: {every: 1000},\n"
		"bodies: [{box: {lower: [0.3, 0.55], upper: [1.7, 0.6], boundary: slip}}],\n"
		"continuum: {cell: 0.1, resample: 1, material: {%s}, fill: [{region: {box: {lower: [0, 0], upper: [2, 1]}}}]}}\n",
		materials[0]);
	int within = 0, near = 0;
	uint32_t before = 0;
	harness_steps(run, 1);
	for (int round = 0; round < 200; round++) {
		quern_column x = harness_field(run, "point.position");
		before = harness_count(run, "point");
		for (uint32_t i = 0; i < before; i++) do
				x.real[0][i] = 2 * drawn(&state), x.real[1][i] = 1e-3 + 0.998 * drawn(&state);
			while (x.real[0][i] > 0.3 && x.real[0][i] < 1.7 && x.real[1][i] > 0.55 && x.real[1][i] < 0.6);
		look(run);
		x = harness_field(run, "point.position");
		for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
			const bool beside = x.real[0][i] > 0.31 && x.real[0][i] < 1.69;
			within += beside && x.real[1][i] > 0.551 && x.real[1][i] < 0.599;
			near += beside && x.real[1][i] > 0.5 && x.real[1][i] <= 0.551;
		}
	}
	table_head("a plate among points, 200 looks");
	table_note("points beside it in the cells that it cuts", near);
	assert_true(table_row("points in it", within, 0, 0) && near > 1000);
	harness_close(run);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(stretched), cmocka_unit_test(many_times),
		cmocka_unit_test(not_into_bodies) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
