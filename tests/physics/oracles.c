/* SPDX-License-Identifier: MIT */
/* Oracles that look at places: zones stand where the scene draws them or where bodies are, and an oracle hears of time, gravity
 * and bodies, and says which faces and bodies are surface to it. */
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
#include <unistd.h>

static const double cell = 4e-3, pi = 3.14159265358979312;

typedef double (*way_of)(double x, double y);

/* A domain full of grains on a lattice, four in a cell, but where it is solid; without forces. Four steps, so that updates are
 * over. */
static quern_run *box(const char *bodies, way_of solid, const char *oracle, const char *weights) {
	char path[HARNESS_PATH];
	FILE *out = harness_file(path);
	fprintf(out, "x y\n");
	for (int j = 0; j < 60; j++)
		for (int i = 0; i < 60; i++) {
			const double x = 0.002 * i + 0.001, y = 0.002 * j + 0.001;
			if (!solid || solid(x, y) > 0.0011) fprintf(out, "%.17g %.17g\n", x, y);
		}
	fclose(out);
	quern_run *run = harness_open(1,
		"quern: 1\ndimension: 2\ngravity: [0, 0]\ndomain: {lower: [0, 0], upper: [0.12, 0.12]}\n"
		"time: {end: 1e-6, step: 1e-9}\nbodies: [%s]\n"
		"grains: {material: {density: 2500, radius: {mean: 0.999 mm}}, file: %s,\n"
		"  contact: {linear: {stiffness: 1e-9, restitution: 1, friction: 0}}}\n"
		"continuum: {cell: %g, material: {mu_i: {critical_density: 1900, bulk_modulus: 1e-6}}}\n"
		"hybrid: {oracle: [%s], substeps: 1, update: 1, weights: %s}\n",
		bodies, path, cell, oracle, weights);
	unlink(path);
	harness_steps(run, 4);
	return run;
}

/* Cells whose zone is not what the distance says, and the worst share of those that are hybrid. A cell whose centre is within
 * `slack` of a border may have either zone; what lies in a body has none. */
static int misplaced(
	quern_run *run, way_of way, way_of solid, double discrete, double width, double slack, double *off) {
	const int32_t *zone = harness_field(run, "cell.zone").index;
	const quern_grid_view *g = quern_host_table.grid(run);
	const double *share = harness_has(run, "cell.weight") ? harness_field(run, "cell.weight").real[0] : NULL;
	int wrong = 0, seen[3] = { 0 };
	*off = 0;
	for (int j = 0; j < 30; j++)
		for (int i = 0; i < 30; i++) {
			const double x = (i + 0.5) * cell, y = (j + 0.5) * cell, d = way(x, y) - discrete;
			const int32_t c = quern_grid_entry(g, (const int32_t[3]) { i, j, 0 });
			if ((solid && solid(x, y) < cell) || fabs(d) < slack || fabs(d - width) < slack) continue;
			const int32_t asked = d <= 0 ? QUERN_DISCRETE : d < width ? QUERN_HYBRID : QUERN_CONTINUUM;
			wrong += zone[c] != asked;
			seen[asked]++;
			if (share && asked == QUERN_HYBRID)
				*off = fmax(*off, fabs(share[c] - fmax(0.02, fmin(0.98, 0.5 - 0.5 * cos(pi * d / width)))));
		}
	for (int k = 0; k < 3; k++) assert_true(seen[k] > 10);
	return wrong;
}

static double left_of_box(double x, double y) {
	const double a = fmax(x - 0.04, 0), b = fmax(y - 0.06, 0);
	return a > 0 || b > 0 ? hypot(a, b) : fmax(x - 0.04, y - 0.06);
}
static double from_disc(double x, double y) { return hypot(x - 0.06, y - 0.06) - 0.02; }
static double behind_plane(double x, double y) { return 0.6 * (x - 0.05) + 0.8 * (y - 0.05); }
static double into_corner(double x, double y) { return fmin(0.06 - x, 0.1 - y); }
static double into_box(double x, double y) { return fmin(fmin(x - 0.03, 0.1 - x), fmin(y - 0.02, 0.1 - y)); }

/* What the scene draws is where it draws it, with a cosine of the way to the grains as the continuum's share. */
static void drawn_zones(void **state) {
	static const struct {
		const char *oracle;
		way_of way;
		double width;
	} scenes[] = {
		{ "{fixed: {boxes: [{lower: [-1, -1], upper: [0.04, 0.06]}], ramp: 0.016}}", left_of_box, 0.016 },
		{ "{fixed: {spheres: [{centre: [0.06, 0.06], radius: 0.02}], ramp: 0.02}}", from_disc, 0.02 },
		{ "{fixed: {half_spaces: [{point: [0.05, 0.05], normal: [3, 4]}], ramp: 0.018}}", behind_plane,
			0.018 },
		{ "{fixed: {boxes: [{lower: [0.03, 0.02], upper: [0.1, 0.1], zone: continuum}], otherwise: discrete, "
		  "ramp: 0.012}}",
			into_box, 0.012 },
		/* where it lies on the domain's own faces it has none */
		{ "{fixed: {boxes: [{lower: [0, -1], upper: [0.06, 0.1], zone: continuum}], otherwise: discrete, "
		  "ramp: 0.012}}",
			into_corner, 0.012 },
	};
	(void)state;
	bool good = true;
	table_head("cells in another zone than was drawn; worst share");
	for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
		double off;
		quern_run *run = box("", NULL, scenes[k].oracle, "half");
		/* depths within the box are negative outside */
		const int wrong = misplaced(run, scenes[k].way, NULL, 0, scenes[k].width, 1e-9, &off);
		good &= table_row(scenes[k].oracle, wrong, 0, 0);
		good &= table_row("  share", off, 0, 1e-12);
		harness_close(run);
	}
	assert_true(good);
}

/* With `weights: ramp` the cells of a drawn zone get shares by their place between its sides; half shares else. */
static void ramps_across_a_zone(void **state) {
	(void)state;
	bool good = true;
	table_head("share of the continuum in the cells across a zone");
	for (int ramp = 0; ramp <= 1; ramp++) {
		quern_run *run = box("", NULL,
			"{fixed: {boxes: [{lower: [-1, -1], upper: [0.04, 1]}, {lower: [0, -1], upper: [0.056, 1], zone: "
			"hybrid}]}}",
			ramp ? "ramp" : "half");
		const quern_grid_view *g = quern_host_table.grid(run);
		for (int k = -1; k <= 4; k++) {
			char name[40];
			const int32_t c = quern_grid_entry(g, (const int32_t[3]) { 10 + k, 15, 0 });
			const double asked = k < 0 ? 0 : k > 3 ? 1 : 0.5 - 0.5 * cos(pi * (k + 0.5) / 4);
			snprintf(name, sizeof name, "cell %d behind the grains", k + 1);
			if (ramp) good &= table_row(name, harness_field(run, "cell.weight").real[0][c], asked, 1e-12);
		}
		assert_true(ramp || !harness_has(run, "cell.weight"));
		harness_close(run);
	}
	assert_true(good);
}

static double from_floor(double x, double y) { return (void)x, y - 0.008; }
static double from_rod(double x, double y) { return hypot(x - 0.06, y - 0.06) - 0.01; }
static double from_either(double x, double y) { return fmin(from_floor(x, y), from_rod(x, y)); }

/* Grains within 10 mm of a body, a hybrid zone of 8 mm behind: of all bodies, or of the one that has been named. */
static void zones_near_bodies(void **state) {
	static const char bodies[] = "{plane: {point: [0, 0.008], normal: [0, 1], name: floor}}, "
								 "{cylinder: {centre: [0.06, 0.06], radius: 0.01, name: rod}}";
	static const struct {
		const char *which;
		way_of way;
	} scenes[] = { { "", from_either }, { ", bodies: [{body: rod}]", from_rod },
		{ ", bodies: [{body: 0}]", from_floor } };
	(void)state;
	bool good = true;
	table_head("cells in another zone than their distance from bodies says");
	for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
		char oracle[120];
		double off;
		snprintf(oracle, sizeof oracle, "{near_bodies: {distance: 10 mm, width: 8 mm%s}}", scenes[k].which);
		quern_run *run = box(bodies, from_either, oracle, "half");
		/* within the hysteresis a zone stays what it was: discrete at first */
		good &= table_row(
			oracle, misplaced(run, scenes[k].way, from_either, 0.01, 0.008, 0.75e-3 + 1e-9, &off), 0, 0);
		harness_close(run);
	}
	assert_true(good);
}

static double from_top(double x, double y) { return (void)x, 0.12 - y; }
static double from_sides(double x, double y) { return fmin(fmin(x, 0.12 - x), fmin(y, 0.12 - y)); }
static double from_rods(double x, double y) {
	return fmin(from_rod(x, y), fmax(fabs(x - 0.016) - 0.004, fabs(y - 0.035) - 0.015));
}
static double from_top_or_rod(double x, double y) { return fmin(from_top(x, y), from_rod(x, y)); }

/* An oracle says which faces of the domain are open, and which bodies are surface; it hears of time, gravity and the gap to
 * these. The domain is full to its faces. */
static void faces_and_bodies_that_are_meant(void **state) {
	static const char rods[] = "{cylinder: {centre: [0.06, 0.06], radius: 0.01}}, "
							   "{box: {lower: [0.012, 0.02], upper: [0.02, 0.05]}}";
	static const struct {
		const char *name, *oracle;
		way_of way;
	} scenes[] = { { "the upper face", "{open_top: {}}", from_top },
		{ "all faces", "{open_top: {all_faces: true}}", from_sides },
		{ "the upper face and a rod", "{open_top: {body: 0}}", from_top_or_rod } };
	(void)state;
	bool good = true;
	table_head("cells in another zone than their distance from what is meant says");
	for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
		const way_of solid = k == 2 ? from_rods : NULL;
		double off;
		quern_run *run = box(k == 2 ? rods : "", solid, scenes[k].oracle, "half");
		const double slack = k == 2 ? 1.1 * cell : 0.75e-3 + 1e-9; /* steps count from cell to cell */
		good &= table_row(
			scenes[k].name, misplaced(run, scenes[k].way, solid, 0.008, 3 * cell, slack, &off), 0, 0);
		const quern_column told = harness_field(run, "cell.told");
		const quern_grid_view *g = quern_host_table.grid(run);
		const int32_t c = quern_grid_entry(g, (const int32_t[3]) { 25, 20, 0 });
		const double gap = hypot(0.102 - 0.06, 0.082 - 0.06) - 0.01;
		good &=
			table_row("  time over that of the last step", told.real[0][c] / (3 * run->clock.dt), 1, 1e-12);
		good &= table_row("  step", told.real[1][c] / run->clock.dt, 1, 1e-12);
		good &= table_row("  gap, inverse", 1 / told.real[3][c], k == 2 ? 1 / gap : 0, 1e-9);
		harness_close(run);
	}
	assert_true(good);
}

static double from_top_or_rods(double x, double y) { return fmin(from_top(x, y), from_rods(x, y)); }

static double from_square(double x, double y, double half) {
	const double a = fabs(x - 0.06) - half, b = fabs(y - 0.06) - half;
	return a > 0 && b > 0 ? hypot(a, b) : fmax(a, b);
}
static double from_void(double x, double y) { return from_square(x, y, 0.012); }
/* Takes the grains in it and none beside it. */
static double in_void(double x, double y) { return from_square(x, y, 0.0109); }

/* The scene says which faces of the domain, which bodies and whether voids are surface to packing_fraction: grains down to
 * 8 mm below, a hybrid zone of 12 mm. The domain is full to its faces. */
static void surfaces_that_are_asked_for(void **state) {
	static const char rods[] = "{cylinder: {centre: [0.06, 0.06], radius: 0.01, name: rod}}, "
							   "{box: {lower: [0.012, 0.02], upper: [0.02, 0.05]}}";
	static const char all_but_top[] = "closed: [lower_x, upper_x, lower_y]";
	static const struct {
		const char *name, *bodies, *keys;
		way_of way, solid;
	} scenes[] = { { "all faces, as nothing is said", "", "", from_sides, NULL },
		{ "the upper face, others are closed", "", all_but_top, from_top, NULL },
		{ "the upper face and a rod", rods, "closed: [lower_x, upper_x, lower_y], bodies: [rod]",
			from_top_or_rod, from_rods },
		{ "the upper face and a rod by its number", rods,
			"closed: [lower_x, upper_x, lower_y], bodies: [{body: 0}]", from_top_or_rod, from_rods },
		{ "the upper face and all bodies", rods, "closed: [lower_x, upper_x, lower_y], walls: true",
			from_top_or_rods, from_rods },
		{ "the upper face and no body", rods, all_but_top, from_top, from_rods },
		{ "a void, all faces are closed", "", "closed: [lower_x, upper_x, lower_y, upper_y], voids: true",
			from_void, in_void } };
	(void)state;
	bool good = true;
	table_head("cells in another zone than their distance from what is surface says");
	for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
		char oracle[200];
		double off;
		snprintf(oracle, sizeof oracle, "{packing_fraction: {depth: 14 mm, half_width: 6 mm%s%s}}",
			scenes[k].keys[0] ? ", " : "", scenes[k].keys);
		quern_run *run = box(scenes[k].bodies, scenes[k].solid, oracle, "half");
		const bool round = scenes[k].solid == from_rods; /* steps count from cell to cell */
		const double slack = round ? 1.1 * cell : 0.75e-3 + 1e-9;
		good &= table_row(
			scenes[k].name, misplaced(run, scenes[k].way, scenes[k].solid, 0.008, 0.012, slack, &off), 0, 0);
		harness_close(run);
	}
	assert_true(good);
}

/* A void in the middle of a closed box is not connected with the outside: without `voids` there is no surface at all, and all
 * of it becomes continuum. */
static void closed_boxes_have_no_surface(void **state) {
	(void)state;
	quern_run *run = box("", in_void,
		"{packing_fraction: {depth: 14 mm, half_width: 6 mm, closed: [lower_x, upper_x, lower_y, upper_y]}}",
		"half");
	const int32_t *zone = harness_field(run, "cell.zone").index;
	const quern_grid_view *g = quern_host_table.grid(run);
	int other = 0;
	for (int j = 0; j < 30; j++)
		for (int i = 0; i < 30; i++)
			if (from_void((i + 0.5) * cell, (j + 0.5) * cell) > 0)
				other += zone[quern_grid_entry(g, (const int32_t[3]) { i, j, 0 })] != QUERN_CONTINUUM;
	table_head("cells that are not continuum in a closed box with a void");
	assert_true(table_row("cells", other, 0, 0));
	harness_close(run);
}

static double from_right(double x, double y) { return (void)y, 0.12 - x; }
static double from_top_or_right(double x, double y) { return fmin(0.12 - x, 0.12 - y); }

/* Only the surfaces that the scene chooses count to layered, by the way they look, by a face or by a body. */
static void layers_below_chosen_surfaces(void **state) {
	static const char rods[] = "{cylinder: {centre: [0.06, 0.06], radius: 0.01, name: rod}}, "
							   "{box: {lower: [0.012, 0.02], upper: [0.02, 0.05]}}";
	static const struct {
		const char *name, *bodies, *keys;
		way_of way, solid;
	} scenes[] = { { "towards the top", "", "toward: [0, 1]", from_top, NULL },
		{ "towards the top, 24 degrees off", "", "toward: [-0.4, 0.9]", from_top, NULL },
		{ "at the right face", "", "faces: [upper_x]", from_right, NULL },
		{ "towards a corner", "", "toward: [1, 1]", from_top_or_right, NULL },
		{ "the top and a face", "", "toward: [0, 3], faces: [upper_x]", from_top_or_right, NULL },
		{ "the top beside bodies", rods, "toward: [0, 1]", from_top, from_rods },
		{ "a rod", rods, "bodies: [rod]", from_rod, from_rods },
		{ "the top and a rod", rods, "toward: [0, 1], bodies: [rod]", from_top_or_rod, from_rods } };
	(void)state;
	bool good = true;
	table_head("cells in another zone than their distance from what is chosen says");
	for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
		char oracle[200];
		double off;
		snprintf(oracle, sizeof oracle, "{layered: {depth: 18 mm, half_width: 6 mm, %s}}", scenes[k].keys);
		quern_run *run = box(scenes[k].bodies, scenes[k].solid, oracle, "half");
		const bool round = scenes[k].solid == from_rods; /* steps count from cell to cell */
		const double slack = round ? 1.1 * cell : 0.75e-3 + 1e-9;
		good &= table_row(
			scenes[k].name, misplaced(run, scenes[k].way, scenes[k].solid, 0.012, 0.012, slack, &off), 0, 0);
		harness_close(run);
	}
	assert_true(good);
}

/* A column in the middle of the domain, with a loose row of cells along its sides, one grain in each. */
static double in_column(double x, double y) {
	const double a = fabs(x - 0.06);
	const bool loose = a > 0.02 && a < 0.024 && fmod(x, 0.004) < 0.002 && fmod(y, 0.004) < 0.002;
	return y < 0.08 && (a < 0.02 || loose) ? 1 : -1;
}

/* At its sides, which do not count, the continuum goes up to the surface; what lies loose before it stays grains. */
static void other_sides_are_none(void **state) {
	(void)state;
	quern_run *run =
		box("", in_column, "{layered: {depth: 14 mm, half_width: 6 mm, toward: [0, 1]}}", "half");
	const int32_t *zone = harness_field(run, "cell.zone").index;
	const quern_grid_view *g = quern_host_table.grid(run);
	int side = 0, inside = 0;
	for (int j = 0; j < 20; j++)
		for (int i = 9; i < 21; i++) {
			const double way = 0.08 - (j + 0.5) * cell;
			const int32_t z = zone[quern_grid_entry(g, (const int32_t[3]) { i, j, 0 })];
			const bool loose = i == 9 || i == 20;
			if (loose) side += z != QUERN_DISCRETE;
			else inside += z != (way <= 0.008 ? QUERN_DISCRETE : way < 0.02 ? QUERN_HYBRID : QUERN_CONTINUUM);
		}
	table_head("cells of a column in another zone than the way from its top says");
	bool good = table_row("inside", inside, 0, 0);
	good &= table_row("loose at the sides", side, 0, 0);
	harness_close(run);
	assert_true(good);
}

static double from_lowered_top(double x, double y) { return (void)x, 0.112 - y; }
static double in_hole(double x, double y) { return fmax(fabs(x - 0.05), fabs(y - 0.118)) - 0.0009; }
static double above_top(double x, double y) { return (void)x, 0.1169 - y; }
static double top_row(double x, double y) { return x > 0 ? above_top(x, y) : 0; }

/* With `oracle_cells: 2` a hole of one cell in the surface is none, since the block of four that it is in is full to three
 * quarters; a row that is missing is one of two, and takes the other one along. */
static void surfaces_of_blocks(void **state) {
	static const struct {
		const char *name, *weights;
		way_of way, solid;
		bool same;
	} scenes[] = { { "a hole, by cells", "half", from_top, in_hole, false },
		{ "a hole, by blocks", "half, oracle_cells: 2", from_top, in_hole, true },
		{ "half a row is missing, by blocks", "half, oracle_cells: 2", from_lowered_top, top_row, true },
		{ "half a row is missing, by cells", "half", from_lowered_top, top_row, false } };
	(void)state;
	bool good = true;
	table_head("cells in another zone than their distance from the surface says");
	for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
		double off;
		quern_run *run = box("", scenes[k].solid,
			"{packing_fraction: {depth: 14 mm, half_width: 6 mm, closed: [lower_x, upper_x, lower_y]}}",
			scenes[k].weights);
		const int wrong = misplaced(run, scenes[k].way, NULL, 0.008, 0.012, 0.75e-3 + 1e-9, &off);
		if (scenes[k].same) good &= table_row(scenes[k].name, wrong, 0, 0);
		else {
			table_note(scenes[k].name, wrong);
			good &= wrong > 0;
		}
		harness_close(run);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(drawn_zones), cmocka_unit_test(ramps_across_a_zone),
		cmocka_unit_test(zones_near_bodies), cmocka_unit_test(faces_and_bodies_that_are_meant),
		cmocka_unit_test(surfaces_that_are_asked_for), cmocka_unit_test(closed_boxes_have_no_surface),
		cmocka_unit_test(layers_below_chosen_surfaces), cmocka_unit_test(other_sides_are_none),
		cmocka_unit_test(surfaces_of_blocks) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
