/* SPDX-License-Identifier: MIT */
/* Shares of grains and continuum that vary across the hybrid zone: uniform motion passes, books stay closed whatever the
 * shares are, and they change at updates of the zones alone. docs/theory/hybrid.md, section 1 */
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
#include <unistd.h>

/* A block of grains in empty space, so loosely bound that nothing but the coupling acts on it. */
static quern_run *block(int dim, const char *hybrid) {
	return harness_open(1,
		"quern: 1\ndimension: %d\ngravity: %s\ndomain: {lower: %s, upper: %s}\ntime: {end: 0.1, step: 0.2 "
		"ms}\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}},\n"
		"  contact: {linear: {stiffness: 1e-12, restitution: 1, friction: 0}},\n"
		"  fill: {region: {box: {lower: %s, upper: %s}}, velocity: %s}}\n"
		"continuum: {cell: 4 mm, material: {mu_i: {bulk_modulus: 1e-9, critical_density: 1900}}}\n"
		"hybrid: {%s, substeps: 4, update: 16}\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[0.2, 0.12]" : "[0.1, 0.06, 0.06]", dim == 2 ? "[0.02, 0.02]" : "[0.012, 0.012, 0.012]",
		dim == 2 ? "[0.1, 0.08]" : "[0.05, 0.05, 0.05]", dim == 2 ? "[1.7, 0.6]" : "[1.7, 0.2, -0.1]",
		hybrid);
}

static const double speed[2][3] = { { 1.7, 0.6, 0 }, { 1.7, 0.2, -0.1 } };

static double worst_of(quern_run *run, const char *set, int dim) {
	char name[32];
	double worst = 0;
	snprintf(name, sizeof name, "%s.velocity", set);
	const quern_column u = harness_field(run, name);
	for (uint32_t i = 0; i < harness_count(run, set); i++)
		for (int k = 0; k < dim; k++) worst = fmax(worst, fabs(u.real[k][i] - speed[dim - 2][k]));
	return worst;
}

/* Grains and points whose share is neither one nor a half. */
static uint32_t on_a_ramp(quern_run *run, const char *set) {
	char name[32];
	uint32_t n = 0;
	snprintf(name, sizeof name, "%s.weight", set);
	const double *w = harness_field(run, name).real[0];
	for (uint32_t i = 0; i < harness_count(run, set); i++) n += w[i] != 1 && w[i] != 0.5;
	return n;
}

static double carried(quern_run *run) {
	static const char *const sets[] = { "grain", "point" };
	double sum = 0;
	for (int s = 0; s < 2; s++) {
		char name[32];
		snprintf(name, sizeof name, "%s.mass", sets[s]);
		const double *m = harness_field(run, name).real[0];
		snprintf(name, sizeof name, "%s.weight", sets[s]);
		const double *w = harness_field(run, name).real[0];
		for (uint32_t i = 0; i < harness_count(run, sets[s]); i++) sum += w[i] * m[i];
	}
	return sum;
}

/* The zone moves with the block, or the block through a zone that the scene has drawn, so that all of it is converted. */
static void uniform_motion_passes(void **state) {
	static const struct {
		int dim, steps;
		const char *name, *hybrid;
	} scenes[] = {
		{ 2, 100, "2-D, with the block",
			"weights: ramp, oracle: [{packing_fraction: {depth: 14 mm, half_width: 8 mm}}]" },
		{ 3, 60, "3-D, with the block",
			"weights: ramp, oracle: [{packing_fraction: {depth: 9 mm, half_width: 6 mm}}]" },
		{ 2, 200, "2-D, through a drawn ramp",
			"oracle: [{fixed: {half_spaces: [{point: [0.08, 0], normal: [1, 0]}], ramp: 16 mm}}]" },
		{ 2, 200, "2-D, the other way",
			"oracle: [{fixed: {half_spaces: [{point: [0.1, 0], normal: [-1, 0]}], ramp: 16 mm}}]" },
	};
	(void)state;
	bool good = true;
	table_head("uniform motion on a ramp: m/s off, of 1.8; books off");
	for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
		const int dim = scenes[k].dim;
		quern_run *run = block(dim, scenes[k].hybrid);
		harness_steps(run, scenes[k].steps);
		assert_true(on_a_ramp(run, "grain") > 50 && on_a_ramp(run, "point") > 50);
		good = table_row(scenes[k].name, fmax(worst_of(run, "grain", dim), worst_of(run, "point", dim)), 0,
				   1e-12) &&
			   good;
		good &= table_row("  mass", harness_field(run, "total.mass_defect").real[0][0], 0, 1e-12);
		good &= table_row("  momentum", harness_field(run, "total.momentum_defect").real[0][0], 0, 1e-12);
		table_note(
			"  mass carried, gained", carried(run) / harness_field(run, "total.mass_initial").real[0][0] - 1);
		harness_close(run);
	}
	assert_true(good);
}

/* Whatever an oracle gives, nothing at all to one of the clouds included, and while shares jump at every update. */
static void any_shares_keep_the_books(void **state) {
	static const double shares[] = { 0, 1e-9, 0.1, 0.9, 1 };
	(void)state;
	bool good = true;
	table_head("books off, of mass and of momentum");
	for (size_t k = 0; k <= sizeof shares / sizeof *shares; k++) {
		char name[40] = "another one at every update";
		quern_run *run = block(2, "oracle: [{open_top: {depth: 8 mm, all_faces: true}}]");
		for (int step = 0; step < 120; step++) {
			const double share = k < 5 ? shares[k] : fmod(0.37 * (step / 4), 1);
			*harness_param(run, "oracle.open_top", "share") = share;
			harness_steps(run, 1);
		}
		if (k < 5) snprintf(name, sizeof name, "%g for the continuum", shares[k]);
		assert_true(on_a_ramp(run, "grain") > 50 && on_a_ramp(run, "point") > 50);
		good &= table_row(name, harness_field(run, "total.mass_defect").real[0][0], 0, 1e-12);
		good &= table_row("  momentum", harness_field(run, "total.momentum_defect").real[0][0], 0, 1e-12);
		good &= table_row("  uniform motion, m/s off",
			fmax(worst_of(run, "grain", 2), worst_of(run, "point", 2)), 0, 1e-12);
		harness_close(run);
	}
	assert_true(good);
}

static int by_size(const void *a, const void *b) {
	const double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

static uint32_t sorted_weights(quern_run *run, const char *field, const char *set, double *out) {
	const uint32_t n = harness_count(run, set);
	memcpy(out, harness_field(run, field).real[0], n * sizeof *out);
	qsort(out, n, sizeof *out, by_size);
	return n;
}

/* Particles move across the ramp between updates and keep what they carry. */
static void shares_change_at_updates_alone(void **state) {
	static const char *const names[][2] = { { "grain.weight", "grain" }, { "point.weight", "point" } };
	double before[2][8192], after[8192];
	(void)state;
	quern_run *run =
		block(2, "oracle: [{fixed: {half_spaces: [{point: [0.08, 0], normal: [1, 0]}], ramp: 16 mm}}]");
	harness_steps(run, 42); /* updates come after steps 1, 5, 9, ... */
	int changes = 0;
	for (int step = 42; step < 58; step++) {
		uint32_t n[2];
		for (int s = 0; s < 2; s++) {
			assert_true(harness_count(run, names[s][1]) <= 8192);
			n[s] = sorted_weights(run, names[s][0], names[s][1], before[s]);
		}
		const int32_t updates = harness_field(run, "total.updates").index[0];
		harness_steps(run, 1);
		const bool updated = harness_field(run, "total.updates").index[0] != updates;
		for (int s = 0; s < 2; s++) {
			const uint32_t now = sorted_weights(run, names[s][0], names[s][1], after);
			const bool same = now == n[s] && !memcmp(after, before[s], now * sizeof *after);
			assert_true(same || updated);
			changes += !same;
		}
	}
	assert_true(changes >= 6);
	harness_close(run);
}

/* ==== a wave meets the zone ==== */

static const double spacing = 2e-3, cell = 4e-3, stiffness = 1e5, density = 2500;

/* A square lattice of touching discs, half a percent overlapped, in a strip that repeats itself; what lies between 0.1 and 0.7 m
 * stays grains, then come zones of so many cells, and the rest is an elastic continuum of the same modulus, k, and density. */
static quern_run *strip(int cells, const char *weights, const char *coupling) {
	char path[HARNESS_PATH];
	FILE *out = harness_file(path);
	const double radius = 0.5 * spacing * 1.005, width = cells * cell;
	const double mass = density * 3.14159265358979312 * radius * radius;
	fprintf(out, "x y\n");
	for (int j = 0; j < 4; j++)
		for (int i = 0; i < 500; i++) fprintf(out, "%.17g %.17g\n", (i + 0.5) * spacing, (j + 0.5) * spacing);
	fclose(out);
	quern_run *run = harness_open(1,
		"quern: 1\ndimension: 2\ngravity: [0, 0]\n"
		"domain: {lower: [0, 0], upper: [1, 0.008], periodic: [true, true]}\ntime: {end: 1, step: 1e-4}\n"
		"grains: {material: {density: %.17g, radius: {mean: %.17g}}, file: %s,\n"
		"  contact: {linear: {stiffness: %.17g, restitution: 1, friction: 0}}}\n"
		"continuum: {cell: %.17g, transfer: {picflip: {rate: 0}},\n"
		"  material: {elastic: {bulk_modulus: %.17g, poisson: 0, density: %.17g}}}\n"
		"hybrid: {oracle: [{fixed: {boxes: [{lower: [0.1, -1], upper: [0.7, 1]},\n"
		"  {lower: [%.17g, -1], upper: [0.7, 1], zone: hybrid}, {lower: [0.1, -1], upper: [%.17g, 1], zone: "
		"hybrid}]}}],\n"
		"  weights: %s, substeps: 10, update: 1000000000, coupling: %s}\n",
		density, radius, path, stiffness, cell, 0.5 * stiffness, mass / (spacing * spacing), 0.1 - width,
		0.7 + width, weights, coupling);
	unlink(path);
	harness_steps(run, 2);
	return run;
}

enum { ROW = 500, ROWS = 4 };

/* By place in the lattice. */
static void velocities(quern_run *run, double out[ROW * ROWS]) {
	const quern_column x = harness_field(run, "grain.position"), v = harness_field(run, "grain.velocity");
	memset(out, 0, ROW * ROWS * sizeof *out);
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) {
		const int column = (int)(x.real[0][i] / spacing), row = (int)(x.real[1][i] / spacing);
		if (column < ROW && row < ROWS) out[row * ROW + column] = v.real[0][i];
	}
}

/* A pulse of 20 diameters that starts 0.15 m before the zone: the largest velocity that comes back over that which arrives, in
 * a run with a pulse less one without, where the edges of the zone come to rest. */
static double reflected(int cells, const char *weights, const char *coupling) {
	const double radius = 0.5 * spacing * 1.005, mass = density * 3.14159265358979312 * radius * radius;
	const double pace = sqrt(stiffness / (mass / (spacing * spacing))), start = 0.55, half = 0.02, top = 1e-3;
	double back = 0, now[2][ROW * ROWS];
	quern_run *run[2] = { strip(cells, weights, coupling), strip(cells, weights, coupling) };
	const quern_column x = harness_field(run[0], "grain.position"),
					   v = harness_field(run[0], "grain.velocity");
	for (uint32_t i = 0; i < harness_count(run[0], "grain"); i++) {
		const double way = (x.real[0][i] - start) / half;
		if (fabs(way) < 1) v.real[0][i] += top * pow(cos(0.5 * 3.14159265358979312 * way), 2);
	}
	for (int k = 0; k < 2; k++) harness_field(run[k], "total.audits").index[0] = 0; /* the books begin anew */
	const double since = quern_run_time(run[0]);
	for (double gone = 0; gone < 0.36; gone = pace * (quern_run_time(run[0]) - since)) {
		for (int k = 0; k < 2; k++) harness_steps(run[k], 1);
		for (int k = 0; k < 2; k++) velocities(run[k], now[k]);
		for (int i = 250; i < 300 && gone > 0.1; i++)
			for (int j = 0; j < ROWS; j++) back = fmax(back, fabs(now[0][j * ROW + i] - now[1][j * ROW + i]));
	}
	for (int k = 0; k < 2; k++) harness_close(run[k]);
	return back / (0.5 * top);
}

/* A zone of half shares has two edges that a wave feels; on a ramp of four cells a fiftieth comes back at most. */
static void waves_pass_a_ramp(void **state) {
	static const int cells[] = { 2, 4, 6, 8 };
	(void)state;
	double half[4], ramp[4];
	bool good = true;
	table_head("a pulse of 20 diameters on a zone: share that comes back");
	for (int k = 0; k < 4; k++) {
		char name[40];
		half[k] = reflected(cells[k], "half", "affine");
		ramp[k] = reflected(cells[k], "ramp", "affine");
		snprintf(name, sizeof name, "%d cells, half shares", cells[k]);
		table_note(name, half[k]);
		snprintf(name, sizeof name, "%d cells, a ramp", cells[k]);
		if (cells[k] < 4) table_note(name, ramp[k]);
		else good &= table_row(name, ramp[k], 0, 0.02);
		good &= ramp[k] < 0.5 * half[k];
	}
	assert_true(good);
}

#ifdef QUERN_EXACT
/* Grains that move with the continuum make the zone's first cells stiffer; on a ramp of four cells a twentieth comes back at most,
 * and less from a wider one. */
static void waves_pass_where_all_is_solved_at_once(void **state) {
	(void)state;
	table_head("the same with coupling.exact");
	const double narrow = reflected(4, "ramp", "exact"), wide = reflected(8, "ramp", "exact");
	bool good = table_row("4 cells, a ramp", narrow, 0, 0.05);
	good = table_row("8 cells, a ramp", wide, 0, 0.02) && good;
	assert_true(good);
}
#endif

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(uniform_motion_passes),
		cmocka_unit_test(any_shares_keep_the_books), cmocka_unit_test(shares_change_at_updates_alone),
#ifdef QUERN_EXACT
		cmocka_unit_test(waves_pass_where_all_is_solved_at_once),
#endif
		cmocka_unit_test(waves_pass_a_ramp) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
