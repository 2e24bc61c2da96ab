/* SPDX-License-Identifier: MIT */
/* What must pass through the hybrid zone unchanged: uniform motion with every transfer and coupling, uniform strain rate and
 * rigid rotation with `affine`. And what must not be made there: momentum. docs/theory/hybrid.md, section 2 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const transfers[] = { "{picflip: {rate: 0}}", "{picflip: {rate: 1e300}}",
	"{picflip: {rate: 20}}", "mixed" };
#ifdef QUERN_EXACT
static const char *const couplings[] = { "affine", "lumped", "exact" };
#else
static const char *const couplings[] = { "affine", "lumped" };
#endif

/* A block of grains in empty space, so loosely bound that nothing but the coupling acts on it. */
static quern_run *block(int dim, const char *size, const char *oracle, const char *velocity, const char *time,
	const char *coupling, const char *transfer) {
	return harness_open(1,
		"quern: 1\ndimension: %d\ngravity: %s\ndomain: {lower: %s, upper: %s}\ntime: %s\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}},\n"
		"  contact: {linear: {stiffness: 1e-12, restitution: 1, friction: 0}},\n"
		"  fill: {region: {box: {lower: %s, upper: %s}}, velocity: %s}}\n"
		"continuum: {cell: 4 mm, material: {mu_i: {bulk_modulus: 1e-9, critical_density: 1900}}, transfer: "
		"%s}\n"
		"hybrid: {oracle: [{packing_fraction: %s}], substeps: 4, update: 8, coupling: %s, transfer: %s}\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[0.2, 0.12]" : "[0.08, 0.06, 0.06]", time,
		dim == 2 ? "[0.02, 0.02]" : "[0.012, 0.012, 0.012]", size, velocity, transfer, oracle, coupling,
		transfer);
}

static double worst_of(quern_run *run, const char *set, int dim, const double v[3]) {
	char name[32];
	double worst = 0;
	snprintf(name, sizeof name, "%s.velocity", set);
	const quern_column u = harness_field(run, name);
	for (uint32_t i = 0; i < harness_count(run, set); i++)
		for (int k = 0; k < dim; k++) worst = fmax(worst, fabs(u.real[k][i] - v[k]));
	return worst;
}

static uint32_t hybrid_grains(quern_run *run) {
	const quern_column w = harness_field(run, "grain.weight");
	uint32_t n = 0;
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) n += w.real[0][i] == 0.5;
	return n;
}

static void uniform_motion_is_unchanged(void **state) {
	static const double v[3] = { 1.7, 0.6, -0.4 };
	(void)state;
	bool good = true;
	table_head("uniform motion through the zone: m/s off, of 1.8");
	for (int dim = 2; dim <= 3; dim++)
		for (size_t c = 0; c < sizeof couplings / sizeof *couplings; c++)
			for (size_t t = 0; t < sizeof transfers / sizeof *transfers; t++) {
				char name[96];
				quern_run *run = block(dim, dim == 2 ? "[0.1, 0.08]" : "[0.04, 0.04, 0.04]",
					"{depth: 7 mm, half_width: 4 mm}", dim == 2 ? "[1.7, 0.6]" : "[1.7, 0.6, -0.4]",
					"{end: 0.02, step: 0.2 ms}", couplings[c], transfers[t]);
				harness_steps(run, dim == 2 ? 60 : 20);
				assert_true(hybrid_grains(run) > 50);
				assert_true(harness_count(run, "point") > 50);
				const double worst = fmax(worst_of(run, "grain", dim, v), worst_of(run, "point", dim, v));
				snprintf(name, sizeof name, "%d-D %s %s", dim, couplings[c], transfers[t]);
				good = table_row(name, worst, 0, 1e-12) && good;
				harness_close(run);
			}
	assert_true(good);
}

/* A layer that fills a periodic axis whose cells are no whole number of blocks, and crosses its seam one way or the other:
 * grains that have just gone through it still count as beyond it. The books are audited at every step. */
static void seams_leak_nothing(void **state) {
	static const char *const across[] = { "[-1.7, 0.1]", "[1.7, 0.1]", "[0.1, -1.7, 0.2]",
		"[0.1, 1.7, 0.2]" };
	static const double speed[][3] = { { -1.7, 0.1, 0 }, { 1.7, 0.1, 0 }, { 0.1, -1.7, 0.2 },
		{ 0.1, 1.7, 0.2 } };
	(void)state;
	bool good = true;
	table_head("uniform motion through a seam: m/s off, of 1.7; impulse made, of the momentum");
	for (int k = 0; k < 4; k++) {
		const int dim = 2 + k / 2;
		quern_run *run = harness_open(1,
			"quern: 1\ndimension: %d\ngravity: %s\ndomain: {lower: %s, upper: %s, periodic: %s}\n"
			"time: {end: 0.02, step: 0.2 ms}\n"
			"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}},\n"
			"  contact: {linear: {stiffness: 1e-12, restitution: 1, friction: 0}},\n"
			"  fill: {region: {box: {lower: %s, upper: %s}}, velocity: %s}}\n"
			"continuum: {cell: 4 mm, material: {mu_i: {bulk_modulus: 1e-9, critical_density: 1900}}}\n"
			"hybrid: {oracle: [{packing_fraction: {depth: 7 mm, half_width: 4 mm}}], substeps: 4, update: "
			"16}\n",
			dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
			dim == 2 ? "[0.1, 0.12]" : "[0.08, 0.02, 0.06]",
			dim == 2 ? "[true, false]" : "[false, true, false]", dim == 2 ? "[0, 0.02]" : "[0.012, 0, 0.012]",
			dim == 2 ? "[0.1, 0.08]" : "[0.06, 0.02, 0.04]", across[k]);
		harness_steps(run, 80);
		assert_true(hybrid_grains(run) > 50);
		assert_true(harness_count(run, "point") > 50);
		const double worst =
			fmax(worst_of(run, "grain", dim, speed[k]), worst_of(run, "point", dim, speed[k]));
		good = table_row(across[k], worst, 0, 1e-12) && good;
		good = table_row("", harness_field(run, "total.momentum_defect").real[0][0], 0, 1e-12) && good;
		harness_close(run);
	}
	assert_true(good);
}

/* v = L (x - c) in both clouds, and the points know their L. Steps so short that nothing moves. */
static void impose(quern_run *run, int dim, const double l[3][3], const double centre[3]) {
	static const char *const sets[] = { "grain", "point" };
	for (int s = 0; s < 2; s++) {
		char name[32];
		snprintf(name, sizeof name, "%s.position", sets[s]);
		const quern_column x = harness_field(run, name);
		snprintf(name, sizeof name, "%s.velocity", sets[s]);
		const quern_column v = harness_field(run, name);
		for (uint32_t i = 0; i < harness_count(run, sets[s]); i++)
			for (int k = 0; k < dim; k++) {
				v.real[k][i] = 0;
				for (int j = 0; j < dim; j++) v.real[k][i] += l[k][j] * (x.real[j][i] - centre[j]);
			}
	}
	harness_field(run, "total.audits").index[0] = 0; /* the books begin anew */
	if (!harness_has(run, "point.affine")) return;
	const quern_column a = harness_field(run, "point.affine");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		for (int k = 0; k < dim * dim; k++) a.real[k][i] = l[k / dim][k % dim];
}

/* True if there are points within reach on both sides along every axis. A grain with a node without continuum in reach
 * does not know L, and it disturbs those with whom it shares nodes: they all are nearer to the points' rim. */
static bool is_inside(quern_run *run, int dim, const quern_column *x, uint32_t i, double cells) {
	const double h = 0.004;
	const quern_column p = harness_field(run, "point.position");
	bool side[6] = { false };
	for (uint32_t q = 0; q < harness_count(run, "point"); q++) {
		double way[3] = { 0 }, across[3] = { 0 };
		for (int k = 0; k < dim; k++) way[k] = p.real[k][q] - x->real[k][i];
		for (int k = 0; k < dim; k++)
			for (int j = 0; j < dim; j++) across[k] = j == k ? across[k] : fmax(across[k], fabs(way[j]));
		for (int k = 0; k < dim; k++)
			if (across[k] < h && fabs(way[k]) > cells * h) side[2 * k + (way[k] > 0)] = true;
	}
	for (int k = 0; k < 2 * dim; k++)
		if (!side[k]) return false;
	return true;
}

/* Largest change of a hybrid grain's velocity in one step, over |L| h, away from the rim. */
static double disturbed(int dim, const char *coupling, const double l[3][3], double cells) {
	const double centre[3] = { 0.06, 0.05, 0.026 }, h = 0.004;
	double worst = 0, size = 0;
	uint32_t seen = 0;
	quern_run *run = block(dim, dim == 2 ? "[0.12, 0.1]" : "[0.056, 0.056, 0.056]",
		dim == 2 ? "{depth: 14 mm, half_width: 10 mm}" : "{depth: 8 mm, half_width: 7 mm}",
		dim == 2 ? "[0, 0]" : "[0, 0, 0]", "{end: 1 ns, step: 0.02 ns}", coupling, "{picflip: {rate: 0}}");
	harness_steps(run, 2);
	impose(run, dim, l, centre);
	const uint32_t n = harness_count(run, "grain");
	double *before = malloc((size_t)n * 3 * sizeof(double));
	assert_non_null(before);
	const quern_column old = harness_field(run, "grain.velocity");
	for (uint32_t i = 0; i < n; i++)
		for (int k = 0; k < dim; k++) before[3 * i + (uint32_t)k] = old.real[k][i];
	harness_steps(run, 1);
	const quern_column now = harness_field(run, "grain.velocity"), x = harness_field(run, "grain.position"),
					   w = harness_field(run, "grain.weight");
	for (int k = 0; k < dim * dim; k++) size = fmax(size, fabs(l[k / dim][k % dim]));
	for (uint32_t i = 0; i < n; i++) {
		if (w.real[0][i] != 0.5 || !is_inside(run, dim, &x, i, cells)) continue;
		seen++;
		for (int k = 0; k < dim; k++) worst = fmax(worst, fabs(now.real[k][i] - before[3 * i + (uint32_t)k]));
	}
	free(before);
	harness_close(run);
	assert_true(seen > 50);
	return worst / (size * h);
}

#ifdef QUERN_EXACT
/* One system for all: a grain at the rim that is held in part disturbs all others, by a tenth as much a cell farther. Where all
 * of each grain's reach is continuum nothing is off: tests/physics/exact.c */
static bool exact_forgets_the_rim(int dim, const char *flow, const double l[3][3]) {
	char name[96];
	snprintf(name, sizeof name, "%d-D exact, %s", dim, flow);
	const double near = disturbed(dim, "exact", l, 2.6);
	bool good = table_row(name, near, 0, 1e-4);
	if (dim == 2)
		good = table_row("  a cell farther, over that", disturbed(dim, "exact", l, 3.6) / near, 0.1, 0.05) &&
			   good;
	return good;
}
#endif

static void affine_keeps_strain_and_rotation(void **state) {
	static const struct {
		const char *name;
		double l[3][3];
	} flows[] = { { "rigid rotation", { { 0, -1e-3, 0 }, { 1e-3, 0, 0 }, { 0, 0, 0 } } },
		{ "pure strain", { { 1e-3, 4e-4, 0 }, { 4e-4, -7e-4, 0 }, { 0, 0, 2e-4 } } },
		{ "simple shear", { { 0, 1e-3, 0 }, { 0, 0, 0 }, { 0, 0, 0 } } } };
	(void)state;
	bool good = true;
	table_head("a grain in the zone, changed by one exchange, over |L| h");
	for (int dim = 2; dim <= 3; dim++)
		for (size_t f = 0; f < sizeof flows / sizeof *flows; f++) {
			char name[96];
			snprintf(name, sizeof name, "%d-D affine, %s", dim, flows[f].name);
			good = table_row(name, disturbed(dim, "affine", flows[f].l, 2.6), 0, 1e-12) && good;
#ifdef QUERN_EXACT
			good = exact_forgets_the_rim(dim, flows[f].name, flows[f].l) && good;
#endif
			const double lumped = disturbed(dim, "lumped", flows[f].l, 2.6);
			snprintf(name, sizeof name, "%d-D lumped, %s: not kept", dim, flows[f].name);
			table_note(name, lumped);
			assert_true(lumped > 1e-3); /* or the test would not see a thing */
		}
	assert_true(good);
}

/* Points are given another velocity, and grains that carry a half are pulled along: as if each of the n substeps had given them an n-th of
 * that. The share of dt dv by which their paths are moved is (n + 1)/(2 n), or one half where the kick is in the middle of a step. */
static void paths_have_the_impulse(void **state) {
	static const char *const integrators[] = { "symplectic_euler", "position_verlet" };
	static const double shares[] = { 5.0 / 8, 0.5 };
	static double x0[4096], v0[4096];
	bool good = true;
	(void)state;
	table_head("4 substeps: shift of a grain's path over dt dv");
	for (int with = 0; with < 2; with++) {
		quern_run *run = harness_open(1,
			"quern: 1\ndimension: 2\ngravity: [0, 0]\ndomain: {lower: [0, 0], upper: [0.2, 0.12]}\n"
			"time: {end: 0.1, step: 0.2 ms}\n"
			"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}}, integrator: %s,\n"
			"  contact: {linear: {stiffness: 1e-12, restitution: 1, friction: 0}},\n"
			"  fill: {region: {box: {lower: [0.02, 0.02], upper: [0.1, 0.08]}}, velocity: [0.3, 0.1]}}\n"
			"continuum: {cell: 4 mm, material: {mu_i: {bulk_modulus: 1e-9, critical_density: 1900}}}\n"
			"hybrid: {oracle: [{packing_fraction: {depth: 7 mm, half_width: 4 mm}}], substeps: 4, update: 16}\n",
			integrators[with]);
		harness_steps(run, 2);
		const quern_column u = harness_field(run, "point.velocity");
		for (uint32_t i = 0; i < harness_count(run, "point"); i++) u.real[0][i] += 0.2;
		harness_field(run, "total.audits").index[0] = 0; /* the books begin anew */
		const int64_t *id = harness_field(run, "grain.id").id;
		for (uint32_t i = 0; i < harness_count(run, "grain"); i++) {
			assert_true(id[i] < 4096);
			x0[id[i]] = harness_field(run, "grain.position").real[0][i];
			v0[id[i]] = harness_field(run, "grain.velocity").real[0][i];
		}
		harness_steps(run, 1);
		const double dt = run->clock.dt;
		uint32_t pulled = 0;
		double worst = shares[with];
		id = harness_field(run, "grain.id").id;
		for (uint32_t i = 0; i < harness_count(run, "grain"); i++) {
			const double dv = harness_field(run, "grain.velocity").real[0][i] - v0[id[i]],
						 dx = harness_field(run, "grain.position").real[0][i] - x0[id[i]] - dt * v0[id[i]];
			if (!(dv > 0.01)) continue;
			pulled++;
			if (!(fabs(dx / (dt * dv) - shares[with]) <= fabs(worst - shares[with]))) worst = dx / (dt * dv);
		}
		assert_true(pulled > 50);
		good = table_row(integrators[with], worst, shares[with], 1e-9) && good;
		harness_close(run);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(paths_have_the_impulse),
		cmocka_unit_test(uniform_motion_is_unchanged), cmocka_unit_test(seams_leak_nothing),
		cmocka_unit_test(affine_keeps_strain_and_rotation) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
