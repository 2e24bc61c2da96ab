/* SPDX-License-Identifier: MIT */
/* Oracles that look at the flow: zones stand where fields of velocity and pressure, which are given, say so to the cell; how many
 * cells may change at once, and over how many updates and cells an oracle looks. */
#include <quern/oracle.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>
#include <quern/grid.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SIDE = 30 };
static const double cell = 4e-3, gravity = 9.81, rate = 100;

/* What is given in the row of cells number j. */
typedef struct {
	double velocity, pressure, scatter;
} given;
typedef given (*field)(int j);

/* A domain full of grains on a lattice, four in a cell, which no forces hold; the first updates make continuum of it. */
static quern_run *box(const char *oracle, const char *keys) {
	char path[HARNESS_PATH];
	FILE *out = harness_file(path);
	fprintf(out, "x y\n");
	for (int j = 0; j < 2 * SIDE; j++)
		for (int i = 0; i < 2 * SIDE; i++)
			fprintf(out, "%.17g %.17g\n", 0.002 * i + 0.001, 0.002 * j + 0.001);
	fclose(out);
	quern_run *run = harness_open(1,
		"quern: 1\ndimension: 2\ngravity: [0, -%g]\ndomain: {lower: [0, 0], upper: [0.12, 0.12]}\n"
		"time: {end: 1e-6, step: 1e-9}\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, file: %s, overlap: {most: 0},\n"
		"  contact: {linear: {stiffness: 1e-9, restitution: 1, friction: 0}}}\n"
		"continuum: {cell: %g, material: {mu_i: {critical_density: 1900, bulk_modulus: 1e-6}}}\n"
		"hybrid: {oracle: [{strain_rate: {%s, depth: 9 mm, half_width: 4 mm}}], substeps: 1, update: 1, "
		"gain: 0%s}\n",
		gravity, path, cell, oracle, keys);
	unlink(path);
	harness_steps(run, 4);
	return run;
}

/* Gives all that is in a row what shall be in it; scatter by turns up and down within each cell. */
static void give(quern_run *run, const char *set, field f) {
	char name[32];
	int seen[SIDE][SIDE] = { 0 };
	snprintf(name, sizeof name, "%s.position", set);
	const quern_column x = harness_field(run, name);
	snprintf(name, sizeof name, "%s.velocity", set);
	const quern_column v = harness_field(run, name);
	for (uint32_t i = 0; i < harness_count(run, set); i++) {
		const int column = (int)fmin(SIDE - 1, fmax(0, x.real[0][i] / cell));
		const int row = (int)fmin(SIDE - 1, fmax(0, x.real[1][i] / cell));
		const given g = f(row);
		v.real[0][i] = g.velocity;
		v.real[1][i] = seen[row][column]++ % 2 ? g.scatter : -g.scatter;
		if (strcmp(set, "point") != 0) continue;
		const quern_column stress = harness_field(run, "point.stress");
		for (int k = 0; k < 3; k++) stress.real[k][i] = k < 2 ? -g.pressure : 0;
	}
}

/* One update in a flow that is given: the stage alone, between two steps. */
static void update(quern_run *run, field f) {
	const quern_grid_view *g = quern_host_table.grid(run);
	const quern_column stress = harness_field(run, "cell.stress");
	give(run, "grain", f);
	give(run, "point", f);
	for (int j = 0; j < SIDE; j++)
		for (int i = 0; i < SIDE; i++) {
			const int32_t c = quern_grid_entry(g, (const int32_t[3]) { i, j, 0 });
			for (int k = 0; k < 3; k++) stress.real[k][c] = k < 2 ? -f(j).pressure : 0;
		}
	harness_field(run, "total.samples").real[0][0] = 1;
	for (size_t k = 0; k < run->plan->n_stages; k++) {
		const quern_plan_stage *stage = &run->plan->stages[k];
		if (strcmp(stage->name, "hybrid.update") != 0) continue;
		const quern_step step = quern_run_record(run, stage->section);
		if (stage->stage->run(stage->section->solver->self, &step) != QUERN_OK) fail_msg("%s", run->message);
	}
	quern_plan_refresh(run->plan);
}

static int32_t zone_at(quern_run *run, int i, int j) {
	return harness_field(run, "cell.zone")
		.index[quern_grid_entry(quern_host_table.grid(run), (const int32_t[3]) { i, j, 0 })];
}

/* The zone that row j has if those are fast whose letter is #: two cells of hybrid zone behind one of grains. */
static int asked_zone(const char *fast, int j) {
	int way = SIDE;
	for (int k = 0; k < SIDE; k++)
		if (fast[k] == '#' && (k > j ? k - j : j - k) < way) way = k > j ? k - j : j - k;
	return way <= 1 ? QUERN_DISCRETE : way <= 3 ? QUERN_HYBRID : QUERN_CONTINUUM;
}

/* `least`: hybrid after a first update from continuum, which goes no farther. */
static int misplaced(quern_run *run, const char *fast, int least) {
	int wrong = 0;
	for (int j = 0; j < SIDE; j++) {
		const int asked = asked_zone(fast, j);
		for (int i = 0; i < SIDE; i++) wrong += zone_at(run, i, j) != (asked < least ? least : asked);
	}
	return wrong;
}

/* A band from row 12 to row 17 that shears, between two blocks. Over two cells its edges are seen at three quarters of the rate
 * within the band and at one outside. */
static double sheared(int j, double of) { return of * rate * cell * fmax(0, fmin(6, j + 0.5 - 12)); }
static double below_top(int j) { return 1900 * gravity * cell * (SIDE - j - 0.5); }
static given band(int j) { return (given) { sheared(j, 1), 1000, 0 }; }
static given slower_band(int j) { return (given) { sheared(j, 0.7), 1000, 0 }; }
static given slow_band(int j) { return (given) { sheared(j, 0.4), 1000, 0 }; }
static given loose_slow_band(int j) { return (given) { sheared(j, 0.4), 10, 0 }; }
static given fast_band(int j) { return (given) { sheared(j, 1.5), 1000, 0 }; }
static given falling(int j) { return (given) { 100 * rate * cell * j, 0, 0 }; }
static given falling_with_noise(int j) { return (given) { 100 * rate * cell * j, j % 3 ? 20 : 90, 0 }; }
static given bed(int j) { return (given) { rate * cell * j, below_top(j), 0 }; }
/* rho T/p = 2500 (0.5 s)^2/2/1000: the cell's whole scatter goes up and down, half of T each way */
static given shaken(int j) { return (given) { sheared(j, 1), 1000, j < 15 ? 0.9 : 0.3 }; }
static given at_rest(int j) { return (void)j, (given) { 0, 1000, 0 }; }

#define NONE ".............................."
static const struct {
	const char *name, *oracle, *fast; /* rows from the lowest on */
	field flow;
} flows[] = {
	{ "a band, by its rate", "shear_rate: 90", ".............####.............", band },
	{ "a band, by half its rate", "shear_rate: 50", "............######............", band },
	{ "a band, by its edges", "rate_change: 15", "...........##....##...........", band },
	{ "a band, by its inertial number", "inertial_number: 0.3", ".............####.............", band },
	{ "a band, by its rate and its edges", "shear_rate: 90, rate_change: 15",
		"...........########...........", band },
	/* I = 10 sqrt(Pa/p); the top row has 37 Pa, below the floor of 98 Pa, the next one 112 Pa */
	{ "a bed, by its inertial number", "inertial_number: 0.3", "...............##############.", bed },
	/* 0 would ask for the shear of what presses by a rounding error, as in the box before anything is given */
	{ "a bed, without a floor", "inertial_number: 0.3, least_pressure: 1e-9 Pa",
		"...............###############", bed },
	{ "a bed, with a floor of 300 Pa", "inertial_number: 0.3, least_pressure: 300 Pa",
		"...............###########....", bed },
	{ "free fall, a hundred times as fast", "shear_rate: 90, inertial_number: 0.3", NONE, falling },
	{ "free fall with noise in the pressure", "shear_rate: 90, inertial_number: 0.3", NONE,
		falling_with_noise },
	{ "a band whose lower half is a gas", "shear_rate: 90", "...............##.............", shaken },
	{ "a band that is a gas to a low limit", "shear_rate: 90, most_agitation: 0.05", NONE, shaken },
};

/* From all continuum, in a flow that does not change. */
static void flows_that_are_fast(void **state) {
	(void)state;
	bool good = true;
	table_head("cells in another zone than the flow says");
	for (size_t k = 0; k < sizeof flows / sizeof *flows; k++) {
		quern_run *run = box(flows[k].oracle, "");
		good &= table_row(flows[k].name, misplaced(run, NONE, QUERN_DISCRETE), 0, 0);
		update(run, flows[k].flow);
		good &= table_row("  after an update", misplaced(run, flows[k].fast, QUERN_HYBRID), 0, 0);
		for (int n = 0; n < 2; n++) update(run, flows[k].flow);
		if (flows[k].flow != shaken) /* cells of few grains have a mean that is not what was given */
			good &= table_row("  after three", misplaced(run, flows[k].fast, QUERN_DISCRETE), 0, 0);
		harness_close(run);
	}
	assert_true(good);
}

/* What is fast stays so down to the share `release` of its threshold, and as long as its contacts do not last. */
static void what_is_fast_stays_fast(void **state) {
	static const char fast[] = ".............####.............";
	static const struct {
		const char *name, *fast;
		field flow;
	} course[] = { { "slower, from all continuum", NONE, slower_band }, { "fast", fast, band },
		{ "slower", fast, slower_band }, { "slow, without pressure", fast, loose_slow_band },
		{ "slow", NONE, slow_band }, { "at rest", NONE, at_rest } };
	(void)state;
	bool good = true;
	quern_run *run = box("shear_rate: 90", "");
	table_head("cells in another zone than the flow and what it was say");
	for (size_t k = 0; k < sizeof course / sizeof *course; k++) {
		for (int n = 0; n < 3; n++) update(run, course[k].flow);
		good &= table_row(course[k].name, misplaced(run, course[k].fast, QUERN_DISCRETE), 0, 0);
	}
	harness_close(run);
	assert_true(good);
}

/* Grains beside continuum, without a zone between. */
static int bare_edges(quern_run *run) {
	int bare = 0;
	for (int j = 0; j + 1 < SIDE; j++)
		for (int i = 0; i < SIDE; i++) bare += abs(zone_at(run, i, j) - zone_at(run, i, j + 1)) == 2;
	return bare;
}

/* 0.05 of 900 cells are 45. A band becomes grains from its middle on, and continuum again from outside, as wide as without a
 * limit, and at no time do grains lie beside continuum. */
static void as_many_changes_as_are_allowed(void **state) {
	static const char fast[] = ".............####.............";
	(void)state;
	bool good = true;
	table_head("a limit of 45 changes of cells in an update");
	for (int limited = 0; limited <= 1; limited++) {
		quern_run *run = box("shear_rate: 90", limited ? ", most_changes: 0.05" : "");
		int32_t before[SIDE][SIDE], most = 0, bare = 0, first = 0;
		good &= table_row(limited ? "limited: rest of the first update" : "free: rest of the first update",
			misplaced(run, NONE, QUERN_DISCRETE), 0, 0);
		for (int n = 0; n < 30; n++) {
			int32_t changed = 0;
			for (int j = 0; j < SIDE; j++)
				for (int i = 0; i < SIDE; i++) before[j][i] = zone_at(run, i, j);
			if (n == 15)
				good &=
					table_row("  cells in another zone after 15", misplaced(run, fast, QUERN_DISCRETE), 0, 0);
			update(run, n < 15 ? band : at_rest);
			for (int j = 0; j < SIDE; j++)
				for (int i = 0; i < SIDE; i++) {
					changed += zone_at(run, i, j) != before[j][i];
					if (!n) first += zone_at(run, i, j) == QUERN_HYBRID && j >= 13 && j <= 16;
				}
			most = changed > most ? changed : most;
			bare += bare_edges(run);
		}
		good &= table_row("  after 15 more at rest", misplaced(run, NONE, QUERN_DISCRETE), 0, 0);
		good &= table_row("  most changes in one", most, limited ? 45 : 300, 0);
		good &= table_row("  of the first, in the band itself", first, limited ? 45 : 120, 0);
		good &= table_row("  grains beside continuum", bare, 0, 0);
		harness_close(run);
	}
	assert_true(good);
}

/* With `average: 2` the rates are those of a mean to which each update adds a half: of 0, 1.5 and 0.4 it is 0.575. */
static void flows_are_averaged(void **state) {
	(void)state;
	bool good = true;
	table_head("shear rate in the middle of a band that flickers, over the steady one");
	for (int n = 1; n <= 2; n++) {
		quern_run *run = box("shear_rate: 1e9", n == 2 ? ", average: 2" : "");
		update(run, fast_band);
		update(run, slow_band);
		const int32_t c = quern_grid_entry(quern_host_table.grid(run), (const int32_t[3]) { 15, 15, 0 });
		good &= table_row(n == 2 ? "average of two" : "as it is",
			harness_field(run, "cell.shear_rate").real[0][c] / rate, n == 2 ? 0.575 : 0.4, 1e-12);
		good &= table_row(
			"  pressure", harness_field(run, "cell.pressure").real[0][c], n == 2 ? 750 : 1000, 1e-9);
		harness_close(run);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(flows_that_are_fast),
		cmocka_unit_test(what_is_fast_stays_fast), cmocka_unit_test(as_many_changes_as_are_allowed),
		cmocka_unit_test(flows_are_averaged) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
