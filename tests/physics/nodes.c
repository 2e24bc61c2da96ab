/* SPDX-License-Identifier: MIT */
/* Nodes at bodies: what is full beside a wall is full on the grid too, however the wall stands to the nodes, since a node's volume is
 * what the body leaves of it; and a node that has none of its own says nothing. Nor does it look thin or dense between faces of the domain that
 * are a few cells apart. docs/theory/mpm.md, sections 2 and 3 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>
#include <quern/grid.h>
#include <stdio.h>

static const double cell = 0.1, filled = 1000;

typedef struct wall {
	const char *name;
	int dim;
	double point[3], normal[3];
	bool
		corner; /* another wall stands on x = 0.425; at the domain's faces and corners nodes are looked at too */
	double
		tolerance; /* of the density: of the hat's share, of points that the wall cuts off or leaves, of folded functions on a lattice */
} wall;

static quern_run *open_wall(const wall *w, const char *shape) {
	char point[80], normal[80], corner[100] = "";
	const char *form = w->dim == 3 ? "[%.17g, %.17g, %.17g]" : "[%.17g, %.17g]";
	snprintf(point, sizeof point, form, w->point[0], w->point[1], w->point[2]);
	snprintf(normal, sizeof normal, form, w->normal[0], w->normal[1], w->normal[2]);
	if (w->corner)
		snprintf(corner, sizeof corner, ", {plane: {point: %s, normal: %s, boundary: slip}}",
			w->dim == 2 ? "[0.425, 0]" : "[0.425, 0, 0]", w->dim == 2 ? "[1, 0]" : "[1, 0, 0]");
	return harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s},\n"
		"time: {end: 1e-6, step: 1e-9}, output: {fields: [motion.density]},\n"
		"bodies: [{plane: {point: %s, normal: %s, boundary: slip}}%s],\n"
		"continuum: {cell: %g, points: %d, shape: %s, material: {elastic: {bulk_modulus: 1, density: %g}},\n"
		"  fill: [{region: {box: {lower: %s, upper: %s}}}]}}\n",
		w->dim, w->dim == 2 ? "[0, 0]" : "[0, 0, 0]", w->dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		w->dim == 2 ? "[1, 1]" : "[1, 1, 1]", point, normal, corner, cell, w->dim == 2 ? 8 : 4, shape, filled,
		w->dim == 2 ? "[0, 0]" : "[0, 0, 0]", w->dim == 2 ? "[1, 1]" : "[1, 1, 1]");
}

/* Over the cell's size: how far a node stands before the nearest wall. */
static double before(const wall *w, const double x[3]) {
	double gap = 0;
	for (int k = 0; k < w->dim; k++) gap += (x[k] - w->point[k]) * w->normal[k] / cell;
	return w->corner ? fmin(gap, (x[0] - 0.425) / cell) : gap;
}

typedef struct found {
	double worst,
		silent; /* |density over the points' less 1|; how far before the wall a node without a density stands */
	int nodes;
} found;

/* Of nodes that a wall may reach. */
static found look(quern_run *run, const wall *w) {
	const quern_column row = harness_field(run, "motion.density");
	const quern_grid_view *g = quern_host_table.grid(run);
	const int edge = (int)g->edge;
	found f = { 0, -INFINITY, 0 };
	for (uint32_t i = 0; i < g->n_blocks * 64; i++) {
		const int k = (int)i % 64, at[3] = { g->at[i / 64][0] * edge + k % edge,
			g->at[i / 64][1] * edge + k / edge % edge, g->at[i / 64][2] * edge + k / (edge * edge) };
		const double x[3] = { at[0] * cell, at[1] * cell, at[2] * cell }, gap = before(w, x),
					 density = row.real[0][8 * i];
		bool inside = gap < 2 && gap > -1;
		for (int a = 0; a < w->dim; a++)
			inside = inside && (w->corner ? at[a] <= 10 : at[a] >= 2 && at[a] <= 8);
		if (!inside) continue;
		if (density > 0) f.worst = fmax(f.worst, fabs(density / filled - 1)), f.nodes++;
		else f.silent = fmax(f.silent, gap);
	}
	return f;
}

static void full_at_walls(void **state) {
	static const double c20 = 0.9396926207859084, s20 = 0.3420201433256687, half = 0.7071067811865476,
						third = 0.5773502691896258;
	static const wall walls[] = {
		{ "2-D, on nodes", 2, { 0, 0.3, 0 }, { 0, 1, 0 }, false, 1e-12 },
		{ "a quarter of a cell behind them", 2, { 0, 0.325, 0 }, { 0, 1, 0 }, false, 1e-12 },
		{ "three quarters", 2, { 0, 0.375, 0 }, { 0, 1, 0 }, false, 1e-12 },
		{ "20 degrees", 2, { 0, 0.2, 0 }, { -s20, c20, 0 }, false, 0.01 },
		{ "45 degrees, nearly through nodes", 2, { 0, 0.1 + 0.1 / 16, 0 }, { -half, half, 0 }, false, 0.01 },
		{ "a corner", 2, { 0, 0.325, 0 }, { 0, 1, 0 }, true, 0.012 },
		{ "3-D, on nodes", 3, { 0, 0.3, 0 }, { 0, 1, 0 }, false, 1e-12 },
		{ "between nodes", 3, { 0, 0, 0.375 }, { 0, 0, 1 }, false, 1e-12 },
		{ "along no axis", 3, { 0.45, 0.45, 0.45 }, { third, third, third }, false, 0.03 },
		{ "a corner", 3, { 0, 0.325, 0 }, { 0, 1, 0 }, true, 0.012 },
	};
	bool good = true;
	(void)state;
	table_head("density on the grid at walls over that of the points, less 1: worst node");
	for (size_t k = 0; k < 2 * (sizeof walls / sizeof *walls); k++) {
		const wall *w = &walls[k / 2];
		char what[80];
		snprintf(what, sizeof what, "%s, %s", w->name, k % 2 ? "bspline" : "gimp");
		quern_run *run = open_wall(w, k % 2 ? "bspline" : "gimp");
		harness_steps(run, 1);
		const found f = look(run, w);
		good &= table_row(what, f.worst, 0, k % 2 ? fmax(w->tolerance + 2e-3, 3e-3) : w->tolerance);
		table_note("  farthest node that says nothing, cells before the wall", f.silent);
		good &= f.silent < 0 && f.nodes > 10;
		harness_close(run);
	}
	assert_true(good);
}

/* Planes within or on faces of the domain that are `across` cells apart. */
static void put_planes(char *text, size_t size, int kind, int dim, int across) {
	const char *form = dim == 2 ? "{plane: {point: [0, %g], normal: [0, %d], boundary: slip}}"
								: "{plane: {point: [0, %g, 0], normal: [0, %d, 0], boundary: slip}}";
	char low[120], high[120];
	snprintf(low, sizeof low, form, kind == 2 ? 0.5 * cell : 0, 1);
	snprintf(high, sizeof high, form, across * cell, -1);
	snprintf(text, size, "%s%s%s", kind ? low : "", kind == 1 ? ", " : "", kind == 1 ? high : "");
}

/* Worst node of a full domain that is `across` cells wide between two faces: with nothing on them, with planes on both, or with one plane that
 * halves the first cell. */
static double worst_between(int dim, int across, const char *shape, int kind) {
	char upper[80], planes[300];
	put_planes(planes, sizeof planes, kind, dim, across);
	snprintf(upper, sizeof upper, dim == 2 ? "[0.4, %g]" : "[0.4, %g, 0.4]", across * cell);
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s},\n"
		"time: {end: 1e-6, step: 1e-9}, output: {fields: [motion.density]}, bodies: [%s],\n"
		"continuum: {cell: %g, points: %d, shape: %s, material: {elastic: {bulk_modulus: 1, density: %g}},\n"
		"  fill: [{region: {box: {lower: %s, upper: %s}}}]}}\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]", upper, planes, cell, 2,
		shape, filled, dim == 2 ? "[0, 0]" : "[0, 0, 0]", upper);
	harness_steps(run, 1);
	const quern_column row = harness_field(run, "motion.density");
	double worst = 0;
	int nodes = 0;
	for (uint32_t i = 0; i < quern_host_table.grid(run)->n_blocks * 64; i++) {
		const double density = row.real[0][8 * i];
		if (!(density > 0)) continue; /* beyond the domain */
		const double off = fabs(density / filled - 1);
		if (!(off <= worst)) worst = off;
		nodes++;
	}
	harness_close(run);
	return nodes == 5 * (across + 1) * (dim == 3 ? 5 : 1) ? worst : INFINITY;
}

/* At any face and corner sums over a lattice differ a little from the integrals of folded functions: no more where there is another face. */
static void full_between_faces(void **state) {
	bool good = true;
	(void)state;
	table_head("worst density between two faces: beyond that of a wide domain");
	for (int k = 0; k < 12; k++) {
		static const char *const kinds[] = { "", ", planes on them", ", half a cell less" };
		const int dim = 2 + k / 6, kind = k % 3;
		const char *shape = k / 3 % 2 ? "bspline" : "gimp";
		const double wide = worst_between(dim, 5, shape, kind);
		for (int across = 1; across <= 3; across++) {
			char what[80];
			snprintf(what, sizeof what, "%d-D, %s, %d cells apart%s", dim, shape, across, kinds[kind]);
			const double beyond = worst_between(dim, across, shape, kind) - wide;
			good &= table_row(what, beyond < 0 ? 0 : beyond, 0, 1e-12);
		}
	}
	assert_true(good);
}

/* A node a cell before a plane and a cell before a face of the domain, which is none of the plane's. */
static void full_between_plane_and_face(void **state) {
	bool good = true;
	(void)state;
	table_head("density a cell before a plane and a cell before a face");
	for (int k = 0; k < 2; k++) {
		const wall w = { "", 2, { 0, 0.8, 0 }, { 0, 1, 0 }, false, 0 };
		quern_run *run = open_wall(&w, k ? "bspline" : "gimp");
		double worst = 0;
		harness_steps(run, 1);
		const quern_grid_view *g = quern_host_table.grid(run);
		for (int x = 2; x <= 8; x++) {
			const int32_t i = quern_grid_entry(g, (const int32_t[3]) { x, 9, 0 });
			assert_true(i >= 0);
			worst = fmax(worst, fabs(harness_field(run, "motion.density").real[0][8 * i] / filled - 1));
		}
		good &= table_row(k ? "bspline, off by" : "gimp, off by", worst, 0, k ? 3e-3 : 1e-3);
		harness_close(run);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(full_at_walls), cmocka_unit_test(full_between_faces),
		cmocka_unit_test(full_between_plane_and_face) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
