/* SPDX-License-Identifier: MIT */
/* Plugins of one's own in a hybrid: a transfer that remembers, of points and of grains alike: what it writes is there the next
 * time; and a coupling that sees all nodes and grains at once. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include <math.h>

/* A block in free flight, grains and continuum: after n steps without an update every grain that was in the zone all the
 * time has been served n times, and its velocity is what it was plus all that the transfer has given. */
static void transfers_remember(void **state) {
	(void)state;
	for (int dim = 2; dim <= 3; dim++) {
		quern_run *run = harness_open(1,
			"quern: 1\ndimension: %d\ngravity: %s\ndomain: {lower: %s, upper: %s}\n"
			"time: {end: 1, step: 1e-5}\n"
			"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}},\n"
			"  contact: {linear: {stiffness: 1e-9, restitution: 1, friction: 0}},\n"
			"  fill: {region: {box: {lower: %s, upper: %s}}}}\n"
			"continuum: {cell: 4 mm, material: {mu_i: {bulk_modulus: 1e-6, critical_density: 1900}}, "
			"transfer: "
			"counting}\n"
			"hybrid: {oracle: [{packing_fraction: {depth: 7 mm, half_width: 4 mm}}], substeps: 1, update: "
			"1000, transfer: counting}\n"
			"output: {fields: [grain.trips, point.trips, grain.changed]}\n",
			dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
			dim == 2 ? "[0.2, 0.12]" : "[0.08, 0.06, 0.06]",
			dim == 2 ? "[0.02, 0.02]" : "[0.012, 0.012, 0.012]",
			dim == 2 ? "[0.1, 0.08]" : "[0.04, 0.04, 0.04]");
		harness_steps(run, 2);
		const quern_column v = harness_field(run, "grain.velocity");
		for (uint32_t i = 0; i < harness_count(run, "grain"); i++) /* the points stand still */
			for (int k = 0; k < dim; k++) v.real[k][i] = 0.01 * (k + 1);
		harness_field(run, "total.audits").index[0] = 0; /* the books begin anew */
		const quern_column before = harness_field(run, "grain.changed");
		for (uint32_t i = 0; i < harness_count(run, "grain"); i++)
			for (int k = 0; k < dim; k++) before.real[k][i] = 0;
		harness_steps(run, 10);
		const quern_column w = harness_field(run, "grain.weight"), u = harness_field(run, "grain.velocity"),
						   changed = harness_field(run, "grain.changed");
		uint32_t served = 0;
		for (uint32_t i = 0; i < harness_count(run, "grain"); i++) {
			if (w.real[0][i] != 0.5) continue;
			const int32_t trips = harness_field(run, "grain.trips").index[i];
			assert_in_range(trips, 110, 112); /* ten now, and two at the most before */
			for (int k = 0; k < dim; k++)
				assert_true(fabs(u.real[k][i] - 0.01 * (k + 1) - changed.real[k][i]) < 1e-13);
			served += changed.real[0][i] != 0;
		}
		assert_true(served > 50);
		for (uint32_t i = 0; i < harness_count(run, "point"); i++)
			assert_in_range(harness_field(run, "point.trips").index[i], 110, 112);
		harness_close(run);
	}
}

/* A block of grains that fly through the continuum that half of them have become, under gravity. */
static quern_run *stir(int dim, const char *coupling) {
	return harness_open(1,
		"quern: 1\ndimension: %d\ngravity: %s\ndomain: {lower: %s, upper: %s}\n"
		"time: {end: 1, step: 1e-4}\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}},\n"
		"  contact: {linear: {stiffness: 1e-9, restitution: 1, friction: 0}},\n"
		"  fill: {region: {box: {lower: %s, upper: %s}}}}\n"
		"continuum: {cell: 4 mm, rest: 0, material: {mu_i: {bulk_modulus: 1e-6, critical_density: 1900}}}\n"
		"hybrid: {oracle: [{packing_fraction: {depth: 7 mm, half_width: 4 mm}}], substeps: 2, update: 1000, "
		"coupling: "
		"%s}\n"
		"observe: [energy]\n",
		dim, dim == 2 ? "[0, -9.81]" : "[0, 0, -9.81]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[0.2, 0.12]" : "[0.08, 0.06, 0.06]", dim == 2 ? "[0.02, 0.02]" : "[0.012, 0.012, 0.012]",
		dim == 2 ? "[0.1, 0.08]" : "[0.04, 0.04, 0.04]", coupling);
}

/* What exchanges node by node can be said as one system: velocities and places of both clouds, and the energy taken, are the
 * same but for round-off. */
static void systems_suffice(void **state) {
	static const char *const couplings[] = { "lumped", "all_at_once" };
	(void)state;
	for (int dim = 2; dim <= 3; dim++) {
		quern_run *run[2];
		for (int c = 0; c < 2; c++) {
			run[c] = stir(dim, couplings[c]);
			harness_steps(run[c], 2);
			const quern_column v = harness_field(run[c], "grain.velocity"),
							   id = harness_field(run[c], "grain.position");
			for (uint32_t i = 0; i < harness_count(run[c], "grain"); i++) /* they stir the points */
				for (int k = 0; k < dim; k++) v.real[k][i] = 0.1 * sin(300 * id.real[(k + 1) % dim][i] + k);
			harness_field(run[c], "total.audits").index[0] = 0; /* the books begin anew */
			harness_steps(run[c], 20);
			assert_true(harness_field(run[c], "total.momentum_defect").real[0][0] < 1e-12);
		}
		static const char *const fields[][2] = { { "grain", "grain.velocity" }, { "grain", "grain.position" },
			{ "point", "point.velocity" }, { "point", "point.position" } };
		double worst = 0;
		for (int f = 0; f < 4; f++) {
			const quern_column a = harness_field(run[0], fields[f][1]),
							   b = harness_field(run[1], fields[f][1]);
			assert_int_equal(harness_count(run[0], fields[f][0]), harness_count(run[1], fields[f][0]));
			for (uint32_t i = 0; i < harness_count(run[0], fields[f][0]); i++)
				for (int k = 0; k < dim; k++) worst = fmax(worst, fabs(a.real[k][i] - b.real[k][i]));
		}
		const double one = harness_field(run[0], "total.exchanged").real[0][0],
					 two = harness_field(run[1], "total.exchanged").real[0][0];
		printf("  %d-D: velocities and places differ by %.2g, of 0.1 m/s; energy taken %.9g and %.9g J\n",
			dim, worst, one, two);
		assert_true(worst < 1e-13);
		assert_true(one > 0 && fabs(two / one - 1) < 0.2);
		harness_close(run[0]);
		harness_close(run[1]);
	}
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(transfers_remember),
		cmocka_unit_test(systems_suffice) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
