/* SPDX-License-Identifier: MIT */
/* Silos with a floor of boxes: no point is ever in one of them, whatever their edges are between nodes, and what leaves goes
 * through the opening. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"

static const double cell = 4e-3, top = 0.04, under = 0.032; /* of the floor */

typedef struct silo {
	const char *what;
	uint32_t dim, workers;
	double edge; /* m, where the opening begins */
	bool hybrid;
} silo;

static quern_run *open_silo(const silo *s) {
	const double end = 0.048 - s->edge;
	const char *material =
		"continuum: {cell: 0.004, %s material: {mu_i: {bulk_modulus: 1e5, diameter: 0.002, "
		"grain_density: 2500, critical_density: 1975}}}";
	char continuum[400];
	const char *fill = s->dim == 2
						   ? "fill: [{region: {box: {lower: [0, 0.04], upper: [0.048, 0.1]}}}],"
						   : "fill: [{region: {box: {lower: [0, 0.04, 0], upper: [0.048, 0.08, 0.008]}}}],";
	snprintf(continuum, sizeof continuum, material, s->hybrid ? "" : fill);
	if (s->dim == 3)
		return harness_open(s->workers,
			"{quern: 1, dimension: 3, gravity: [0, -9.81, 0], time: {end: 10}, output: {every: 0.1},\n"
			"domain: {lower: [0, 0, 0], upper: [0.048, 0.12, 0.008], open: [lower_y], periodic: [false, false, true]},\n"
			"bodies: [{box: {lower: [-0.02, %g, -1], upper: [%g, %g, 1], boundary: sticky}},\n"
			"  {box: {lower: [%g, %g, -1], upper: [0.1, %g, 1], boundary: sticky}}],\n%s}\n",
			under, s->edge, top, end, under, top, continuum);
	return harness_open(s->workers,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], time: {end: 10}, output: {every: 0.1},\n"
		"domain: {lower: [0, 0], upper: [0.048, 0.16], open: [lower_y]},\n"
		"bodies: [{box: {lower: [-0.02, %g], upper: [%g, %g], boundary: sticky}},\n"
		"  {box: {lower: [%g, %g], upper: [0.1, %g], boundary: {rough: 1}}},\n"
		"  {plane: {point: [0, 0], normal: [1, 0]}}, {plane: {point: [0.048, 0], normal: [-1, 0]}}],\n"
		"%s%s}\n",
		under, s->edge, top, end, under, top, continuum,
		s->hybrid
			? ",\ngrains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %}}, "
			  "overlap: {most: 0}, contact: {linear: {stiffness: 2e5, friction: 0.4}}, fill: {region: {box: {lower: "
			  "[0.001, 0.041], upper: [0.047, 0.12]}}}},\nhybrid: {substeps: 10, update: 100, oracle: "
			  "[{packing_fraction: {depth: 6 mm, half_width: 4 mm}}]}"
			: "");
}

/* Depth of the deepest point in a box, m. */
static double deepest(quern_run *run, const silo *s) {
	const quern_column x = harness_field(run, "point.position");
	double most = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double y = x.real[1][i],
					 from_edge = fmax(s->edge - x.real[0][i], x.real[0][i] - (0.048 - s->edge));
		most = fmax(most, fmin(fmin(top - y, y - under), from_edge));
	}
	return most;
}

static double mass_of(quern_run *run) {
	const quern_column m = harness_field(run, "point.mass");
	double sum = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) sum += m.real[0][i];
	return sum;
}

static bool watch(const silo *s, double time) {
	quern_run *run = open_silo(s);
	double deep = 0;
	const double before = mass_of(run);
	while (quern_run_time(run) < time) {
		harness_steps(run, 1);
		deep = fmax(deep, deepest(run, s));
	}
	const double left = s->hybrid ? 0 : 1 - mass_of(run) / before;
	const uint32_t n = harness_count(run, "point");
	harness_close(run);
	bool good = table_row(s->what, deep / cell, 0, 0);
	table_note("  points at the end", n);
	if (s->hybrid) return good && n > 100;
	table_note("  share of the mass that has left", left);
	return good && left > 0 && left < 0.9;
}

static void no_point_in_a_floor(void **unused) {
	(void)unused;
	static const silo silos[] = { { "2-D, edges on nodes", 2, 1, 0.016, false },
		{ "edges a quarter of a cell behind nodes", 2, 1, 0.017, false },
		{ "edges in the middle of cells", 2, 2, 0.018, false },
		{ "a hole of one cell between nodes", 2, 1, 0.022, false },
		{ "3-D, edges on nodes", 3, 2, 0.016, false }, { "3-D, between nodes", 3, 1, 0.0155, false },
		{ "hybrid, edges on nodes", 2, 1, 0.016, true },
		{ "hybrid, a hole of one cell between nodes", 2, 1, 0.022, true } };
	bool good = true;
	table_head("silos: how deep points are in the floor, cells");
	for (int k = 0; k < 8; k++) good &= watch(&silos[k], silos[k].dim == 2 ? 0.25 : 0.15);
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(no_point_in_a_floor) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
