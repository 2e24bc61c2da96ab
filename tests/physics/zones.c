/* SPDX-License-Identifier: MIT */
/* Zones of the hybrid: which cells lie near a surface, and which is the nearest hybrid one. */
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

static const double cell = 4e-3;

/* The stage alone, between two steps. */
static void update(quern_run *run) {
	for (size_t k = 0; k < run->plan->n_stages; k++) {
		const quern_plan_stage *stage = &run->plan->stages[k];
		if (strcmp(stage->name, "hybrid.update") != 0) continue;
		const quern_step step = quern_run_record(run, stage->section);
		if (stage->stage->run(stage->section->solver->self, &step) != QUERN_OK) fail_msg("%s", run->message);
	}
	quern_plan_refresh(run->plan);
}

static int32_t cell_at(quern_run *run, double x, double y) {
	int32_t c[3];
	const quern_grid_view *g = quern_host_table.grid(run);
	assert_true(quern_grid_cell_at(g, (const double[3]) { x, y, 0 }, c));
	return quern_grid_entry(g, c);
}

/* What a discrete cell owes goes to the nearest hybrid one, be it 39 000 cells away: a heap at the lower end of a channel,
 * and single grains all along it. */
static void far_entries_find_a_cell(void **state) {
	char path[HARNESS_PATH];
	FILE *out = harness_file(path);
	(void)state;
	fprintf(out, "x y\n");
	for (int j = 0; j < 28; j++)
		for (int i = 0; i < 28; i++) fprintf(out, "%.17g %.17g\n", 0.002 * i + 0.002, 0.002 * j + 0.002);
	for (int i = 3; i < 5000; i++) fprintf(out, "%.17g 0.03\n", 0.032 * i + 0.016);
	fclose(out);
	quern_run *run = harness_open(1,
		"quern: 1\ndimension: 2\ngravity: [0, 0]\ndomain: {lower: [0, 0], upper: [160, 0.064]}\n"
		"time: {end: 1e-6, step: 1e-9}\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}},\n"
		"  contact: {linear: {stiffness: 1e-9, restitution: 1, friction: 0}}, file: %s}\n"
		"continuum: {cell: %g, material: {mu_i: {critical_density: 1900, bulk_modulus: 1e-6}}}\n"
		"hybrid: {oracle: [{packing_fraction: {depth: 10 mm, half_width: 4 mm}}], substeps: 1, update: 1}\n",
		path, cell);
	unlink(path);
	harness_steps(run, 3);
	const int32_t far = cell_at(run, 159.984, 0.03);
	assert_true(far >= 0);
	assert_int_equal(harness_field(run, "cell.zone").index[far], QUERN_DISCRETE);
	harness_field(run, "cell.owed").real[0][far] = 1e-6;
	update(run);
	assert_true(harness_field(run, "cell.owed").real[0][cell_at(run, 159.984, 0.03)] == 0);
	harness_close(run);
}

static double in_points(quern_run *run, int32_t c) {
	const quern_column x = harness_field(run, "point.position"), m = harness_field(run, "point.mass"),
					   w = harness_field(run, "point.weight");
	double sum = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		if (cell_at(run, x.real[0][i], x.real[1][i]) == c) sum += w.real[0][i] * m.real[0][i];
	return sum;
}

/* A file of grains, one in each cell. */
static void put_one_each(char path[HARNESS_PATH], int columns, int rows) {
	FILE *out = harness_file(path);
	fprintf(out, "x y\n");
	for (int j = 0; j < rows; j++)
		for (int i = 0; i < columns; i++) fprintf(out, "%.17g %.17g\n", (i + 0.3) * cell, (j + 0.3) * cell);
	fclose(out);
}

/* One grain in each of so many cells, which the oracle takes for hybrid ones, all or some of them. */
typedef struct sparse {
	const char *name, *periodic, *oracle, *weights;
	int columns, rows;
	double lacks[2], tolerance; /* grains, by turns; of those that a cell gets */
} sparse;

static quern_run *open_with(
	const sparse *l, const char *bodies, const char *packer, double radius, double gravity) {
	char path[HARNESS_PATH];
	put_one_each(path, l->columns, l->rows);
	quern_run *run = harness_open(1,
		"quern: 1\ndimension: 2\ngravity: [0, %g]\ndomain: {lower: [0, 0], upper: [%g, %g], periodic: [%s]}\n"
		"time: {end: 1e-6, step: 1e-9}\nbodies: [%s]\n"
		"grains: {material: {density: 2500, radius: {mean: %g}},\n"
		"  contact: {linear: {stiffness: 1e-9, restitution: 1, friction: 0}}, file: %s}\n"
		"continuum: {cell: %g, material: {mu_i: {critical_density: 1900, bulk_modulus: 1e-6}}}\n"
		"hybrid: {oracle: [{fixed: {%s}}], weights: %s, packer: %s, substeps: 1, update: 1}\n",
		-gravity, l->columns * cell, l->rows * cell, l->periodic, bodies, radius, path, cell, l->oracle,
		l->weights, packer);
	unlink(path);
	harness_steps(run, 4);
	return run;
}
static quern_run *open_sparse(const sparse *l) { return open_with(l, "", "two_point_tangent", cell / 4, 0); }

/* A plate along half of a box; a hybrid cell A far above it and one, B, just below. What is owed just above goes to A, whoever else owes
 * something: it is reached first. B is near in a straight line alone, and comes round the plate's end. */
static void plates_are_gone_round(void **state) {
	(void)state;
	for (int other = 0; other <= 1; other++) {
		static const sparse l = { "", "false, false",
			"otherwise: discrete, boxes: [{lower: [0.008, 0.052], upper: [0.012, 0.056], zone: hybrid},"
			" {lower: [0.008, 0.02], upper: [0.012, 0.0235], zone: hybrid}]",
			"half", 20, 14, { 0, 0 }, 0 };
		quern_run *run = open_with(
			&l, "{box: {lower: [-0.01, 0.0239], upper: [0.04, 0.0241]}}", "two_point_tangent", 0.8e-3, 0);
		const int32_t a = cell_at(run, 0.01, 0.054), b = cell_at(run, 0.01, 0.022),
					  owed = cell_at(run, 0.01, 0.03);
		assert_int_equal(harness_field(run, "cell.zone").index[a], QUERN_HYBRID);
		assert_int_equal(harness_field(run, "cell.zone").index[b], QUERN_HYBRID);
		const double before[2] = { in_points(run, a), in_points(run, b) };
		harness_field(run, "cell.owed").real[0][owed] = 1e-4;
		if (other) harness_field(run, "cell.owed").real[0][cell_at(run, 0.074, 0.006)] = 1e-12;
		update(run);
		assert_true(harness_field(run, "cell.owed").real[0][cell_at(run, 0.01, 0.03)] == 0);
		assert_true(fabs(in_points(run, cell_at(run, 0.01, 0.054)) - before[0] - 1e-4) < 1e-9);
		assert_true(fabs(in_points(run, cell_at(run, 0.01, 0.022)) - before[1]) < 1e-9);
		harness_close(run);
	}
}

/* Grains that a cell of the zone gets in one update, in the mean, where each lacks what its column and row say, and points bear a pressure. */
static double grains_got(quern_run *run, const sparse *l, double radius, double pressure, double *lacking) {
	const double mass = 2500 * 3.14159265358979312 * radius * radius;
	const uint32_t before = quern_host_table.set(run, "grain").n;
	int n = 0;
	*lacking = 0;
	for (int j = 0; j < l->rows; j++)
		for (int i = 0; i < l->columns; i++) {
			const int32_t c = cell_at(run, (i + 0.5) * cell, (j + 0.5) * cell);
			if (harness_field(run, "cell.zone").index[c] != QUERN_HYBRID) continue;
			harness_field(run, "cell.owed").real[0][c] += mass * l->lacks[(i + j) % 2];
			*lacking += l->lacks[(i + j) % 2];
			n++;
		}
	assert_true(n > 0);
	for (int k = 0; k < 2; k++)
		for (uint32_t i = 0; i < harness_count(run, "point") && pressure > 0; i++)
			harness_field(run, "point.stress").real[k][i] = -pressure;
	update(run);
	*lacking = fmax(0, *lacking / n);
	return (double)(quern_host_table.set(run, "grain").n - before) / n;
}

#define ALL "otherwise: hybrid"
#define BAND "ramp: 24 mm, boxes: [{lower: [0, 0], upper: [8 mm, 1], zone: discrete}]"
/* Cells that each lack a share of a grain get as many grains as all of them lack, to two thirds of a grain in a block of nine (or of the six
 * that there are), most of them though none lacks a whole one; and none where others beside them have as much too much. */
static void debts_round_together(void **state) {
	static const sparse of[] = {
		{ "cells lack 0.2 of a grain", "true, true", ALL, "half", 16, 16, { 0.2, 0.2 }, 0.667 / 9 },
		{ "0.4", "true, true", ALL, "half", 16, 16, { 0.4, 0.4 }, 0.667 / 9 },
		{ "0.8", "true, true", ALL, "half", 16, 16, { 0.8, 0.8 }, 0.667 / 9 },
		{ "1.3", "true, true", ALL, "half", 16, 16, { 1.3, 1.3 }, 0.667 / 9 },
		{ "0.3 and 0.9 by turns", "true, true", ALL, "half", 16, 16, { 0.3, 0.9 }, 0.667 / 9 },
		{ "have 0.4 too much", "true, true", ALL, "half", 16, 16, { -0.4, -0.4 }, 0 },
		{ "lack and have 1.2 too much by turns", "true, true", ALL, "half", 16, 16, { 1.2, -1.2 }, 0 },
		{ "two rows that repeat: 0.4", "true, true", ALL, "half", 64, 2, { 0.4, 0.4 }, 0.667 / 6 },
		{ "1.3", "true, true", ALL, "half", 64, 2, { 1.3, 1.3 }, 0.667 / 6 },
		{ "shares by a ramp: 0.4", "false, true", BAND, "ramp", 16, 32, { 0.4, 0.4 }, 0.667 / 9 },
		{ "0.1 and 1.9 by turns", "false, true", BAND, "ramp", 16, 32, { 0.1, 1.9 }, 0.667 / 9 },
	};
	bool good = true;
	(void)state;
	table_head("grains that a cell gets, beside what it lacks");
	for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
		quern_run *run = open_sparse(&of[k]);
		double lacking;
		const double got = grains_got(run, &of[k], cell / 4, 0, &lacking);
		good &= table_row(of[k].name, got, lacking, of[k].tolerance);
		harness_close(run);
	}
	assert_true(good);
}

/* A plate, an eighth of a cell thick, within the cells of the last column, and grains on its left alone: what these cells lack becomes grains on
 * that side. The other one has room for as many, which darts and holes find; places that touch grains never do. */
static void plates_are_not_passed(void **state) {
	static const char *const packers[] = { "random", "two_point_tangent", "expand" };
	(void)state;
	for (size_t k = 0; k < sizeof packers / sizeof *packers; k++) {
		static const sparse l = { "", "false, false", "otherwise: hybrid", "half", 5, 9, { 0, 0 }, 0 };
		quern_run *run =
			open_with(&l, "{box: {lower: [0.018, -0.01], upper: [0.0185, 0.05]}}", packers[k], 0.4e-3, 0);
		const uint32_t before = harness_count(run, "grain");
		for (int j = 0; j < 9; j++)
			harness_field(run, "cell.owed").real[0][cell_at(run, 0.0165, (j + 0.5) * cell)] +=
				4 * 2500 * 3.14159265358979312 * 0.16e-6;
		update(run);
		const quern_column x = harness_field(run, "grain.position");
		assert_true(harness_count(run, "grain") >= before + 9);
		for (uint32_t i = 0; i < harness_count(run, "grain"); i++) assert_true(x.real[0][i] < 0.018);
		harness_close(run);
	}
}

#define ALONE "otherwise: discrete, boxes: [{lower: [0.016, 0.016], upper: [0.02, 0.02], zone: "
/* Beside grains in a square lattice there is one full place in a cell, and two holes. Of the two grains that each cell lacks all of one goes into a
 * hole, to grow, and no fewer do where some cells are to have a third by rounding, which waits: but for what these take of what their blocks lack. Where
 * points bear more than the weight of a layer, a third one goes into the other hole; not where they bear less, or nothing weighs. */
static void rounding_takes_no_holes(void **state) {
	static const double layer = 1900 * 9.81 * 2.1e-3;
	static const double lacks[] = { 2, 2.4, 2.4, 2.4, 2.4 }, gravity[] = { 0, 0, 9.81, 0, 9.81 },
						pressure[] = { 0, 0, 0.9 * layer, 1.1 * layer, 1.1 * layer };
	double got[5], lacking;
	(void)state;
	for (int k = 0; k < 5; k++) {
		const sparse of = { "", "true, true", ALL, "half", 16, 16, { lacks[k], lacks[k] }, 0 };
		quern_run *run = open_with(&of, "", "expand", 1.05e-3, gravity[k]);
		got[k] = grains_got(run, &of, 1.05e-3, pressure[k], &lacking);
		harness_close(run);
	}
	printf("  cells that lack 2 and 2.4 grains get %g and %g, %g and %g; pressed ones %g\n", got[0], got[1],
		got[2], got[3], got[4]);
	assert_true(got[0] == 2 && got[1] > 0.9 * got[0]);
	assert_true(got[2] == got[1] && got[3] == got[1]);
	assert_true(got[4] > got[1] + 0.3);
}

/* A cell alone among discrete ones owes more than it holds, and nobody takes that: its points get lighter, but not without end, and all that is
 * neither theirs nor the grains' stays owed. */
static void debts_leave_points(void **state) {
	static const sparse of[] = {
		{ "hybrid", "false, false", ALONE "hybrid}]", "half", 9, 9, { 0, 0 }, 0 },
		{ "continuum", "false, false", ALONE "continuum}]", "half", 9, 9, { 0, 0 }, 0 },
	};
	(void)state;
	for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
		quern_run *run = open_sparse(&of[k]);
		const int32_t c = cell_at(run, 0.018, 0.018);
		const double before = in_points(run, c), debt = -0.02, full = 1900 * cell * cell;
		assert_true(before > 0.1 * full);
		harness_field(run, "cell.owed").real[0][c] += debt;
		for (int j = 0; j < 60; j++) update(run);
		const double left = in_points(run, c);
		assert_true(left < 0.5 * before);
		assert_true(left > 0.01 * full);
		assert_true(fabs(left + harness_field(run, "cell.owed").real[0][c] - before - debt) < 1e-12);
		harness_close(run);
	}
}

/* A box whose walls cut its cells, or are a quarter of a cell thick, filled with grains: `walls` is false, so that only the
 * top is a surface. Below its zone no grain is left, along the walls and the floor neither. */
static void walls_are_no_surface(void **state) {
	static const struct {
		const char *name, *bodies;
		double left, right, floor;
	} boxes[] = {
		{ "planes on cell faces",
			"{plane: {point: [0.008, 0], normal: [1, 0]}}, {plane: {point: [0.112, 0], normal: [-1, 0]}}, "
			"{plane: "
			"{point: [0, 0.008], normal: [0, 1]}}",
			0.008, 0.112, 0.008 },
		{ "planes that halve cells",
			"{plane: {point: [0.006, 0], normal: [1, 0]}}, {plane: {point: [0.114, 0], normal: [-1, 0]}}, "
			"{plane: "
			"{point: [0, 0.006], normal: [0, 1]}}",
			0.006, 0.114, 0.006 },
		{ "planes that leave two fifths",
			"{plane: {point: [0.0064, 0], normal: [1, 0]}}, {plane: {point: [0.1136, 0], normal: [-1, 0]}}, "
			"{plane: {point: [0, 0.0064], normal: [0, 1]}}",
			0.0064, 0.1136, 0.0064 },
		{ "thin boxes",
			"{box: {lower: [0.007, 0], upper: [0.008, 0.12]}}, {box: {lower: [0.112, 0], upper: [0.113, "
			"0.12]}}, "
			"{box: {lower: [0, 0.007], upper: [0.12, 0.008]}}",
			0.008, 0.112, 0.008 },
		{ "thin boxes within cells",
			"{box: {lower: [0.0055, 0], upper: [0.0065, 0.12]}}, {box: {lower: [0.1135, 0], upper: [0.1145, "
			"0.12]}}, {box: {lower: [0, 0.0055], upper: [0.12, 0.0065]}}",
			0.0065, 0.1135, 0.0065 },
	};
	const double top = 0.08;
	bool good = true;
	(void)state;
	table_head("grains left below the zone of the free surface");
	for (size_t k = 0; k < sizeof boxes / sizeof *boxes; k++) {
		quern_run *run = harness_open(1,
			"quern: 1\ndimension: 2\ngravity: [0, 0]\ndomain: {lower: [0, 0], upper: [0.12, 0.12]}\n"
			"time: {end: 1e-6, step: 1e-9}\nbodies: [%s]\n"
			"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}},\n"
			"  contact: {linear: {stiffness: 1e-9, restitution: 1, friction: 0}},\n"
			"  fill: {region: {box: {lower: [%g, %g], upper: [%g, %g]}}}}\n"
			"continuum: {cell: %g, material: {mu_i: {critical_density: 1900, bulk_modulus: 1e-6}}}\n"
			"hybrid: {oracle: [{packing_fraction: {depth: 12 mm, half_width: 4 mm}}], substeps: 1, update: "
			"1}\n",
			boxes[k].bodies, boxes[k].left, boxes[k].floor, boxes[k].right, top, cell);
		harness_steps(run, 4);
		const quern_column x = harness_field(run, "grain.position");
		int left = 0;
		for (uint32_t i = 0; i < harness_count(run, "grain"); i++) left += x.real[1][i] < top - 0.026;
		good &= table_row(boxes[k].name, left, 0, 0);
		const quern_column p = harness_field(run, "point.position"); /* and no point was made within a wall */
		for (uint32_t i = 0; i < harness_count(run, "point"); i++)
			assert_true(p.real[0][i] > boxes[k].left && p.real[0][i] < boxes[k].right &&
						p.real[1][i] > boxes[k].floor);
		assert_true(harness_count(run, "point") > 500);
		harness_close(run);
	}
	assert_true(good);
}

/* The same of a heap on fixed grains, one cell deep, that reach out from under it into the open: what they leave is as full as
 * elsewhere, and the open does not come in between them. */
static void rough_floors_are_no_surface(void **state) {
	static const double thick[] = { 0, 0.002, 0.004 };
	bool good = true;
	(void)state;
	table_head("cells above a rough floor, below the zones of top and slope, that are no continuum");
	for (size_t k = 0; k < sizeof thick / sizeof *thick; k++) {
		char floor[160] = "", name[40];
		if (k)
			snprintf(floor, sizeof floor,
				"{region: {box: {lower: [0, 0.001], upper: [0.16, %g]}}, fixed: true}, ", thick[k] - 0.001);
		quern_run *run = harness_open(1,
			"quern: 1\ndimension: 2\ngravity: [0, 0]\ndomain: {lower: [0, 0], upper: [0.16, 0.08]}\n"
			"time: {end: 1e-6, step: 1e-9}\nbodies: [{plane: {point: [0, 0], normal: [0, 1]}}, {plane: "
			"{point: [0, "
			"0], normal: [1, 0]}}]\n"
			"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}},\n"
			"  contact: {linear: {stiffness: 1e-9, restitution: 1, friction: 0}},\n"
			"  fill: [%s{region: {box: {lower: [0, %g], upper: [0.08, 0.05]}}}]}\n"
			"continuum: {cell: %g, material: {mu_i: {critical_density: 1900, bulk_modulus: 1e-6}}}\n"
			"hybrid: {oracle: [{packing_fraction: {depth: 10 mm, half_width: 4 mm}}], substeps: 1, update: "
			"1}\n",
			floor, thick[k] + 0.001, cell);
		harness_steps(run, 4);
		int others = 0;
		for (int j = 1; j < 6; j++)
			for (int i = 5; i < 14; i++)
				others +=
					harness_field(run, "cell.zone").index[cell_at(run, (i + 0.5) * cell, (j + 0.5) * cell)] !=
					QUERN_CONTINUUM;
		snprintf(name, sizeof name, "%zu layers of fixed grains", k);
		good &= table_row(name, others, 0, 0);
		harness_close(run);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(far_entries_find_a_cell),
		cmocka_unit_test(plates_are_gone_round), cmocka_unit_test(debts_round_together),
		cmocka_unit_test(plates_are_not_passed), cmocka_unit_test(rounding_takes_no_holes),
		cmocka_unit_test(debts_leave_points), cmocka_unit_test(walls_are_no_surface),
		cmocka_unit_test(rough_floors_are_no_surface) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
