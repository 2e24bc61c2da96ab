/* SPDX-License-Identifier: MIT */
/* A continuum that moves without being deformed, fast or hardly, and points on faces: nothing comes of it but the motion, with any shape, any
 * transfer, and in any place of points. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"

/* `more`: rows of the section beside shape and transfer. */
static quern_run *drift_off(uint32_t dim, const char *shape, const char *transfer, const char *more) {
	return harness_open(1,
		"{quern: 1, dimension: %u, gravity: %s, domain: {lower: %s, upper: %s}, time: {end: 1000}, output: {every: 0.1},\n"
		"continuum: {cell: 0.1, shape: %s, transfer: {%s}, %s,\n"
		"  fill: [{region: {box: {lower: %s, upper: %s}}}]}}\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[2, 2]" : "[2, 2, 2]", shape, transfer, more,
		dim == 2 ? "[0.63, 0.63]" : "[0.63, 0.63, 0.63]", dim == 2 ? "[1.43, 1.43]" : "[1.03, 1.03, 1.03]");
}

/* The largest change of velocity over speed, stress over the bulk modulus, and change of density, at `share` of 0.5 m/s and more. */
static void drifted(quern_run *run, uint32_t dim, double share, double change[3]) {
	const double speed[3] = { 0.3 * share, 0.4 * share, dim == 3 ? -0.2 * share : 0 },
				 whole = hypot(hypot(speed[0], speed[1]), speed[2]);
	const quern_column v = harness_field(run, "point.velocity");
	const uint32_t n = harness_count(run, "point");
	for (uint32_t k = 0; k < dim; k++)
		for (uint32_t i = 0; i < n; i++) v.real[k][i] = speed[k];
	harness_until(run, 0.9);
	const quern_column now = harness_field(run, "point.velocity"), s = harness_field(run, "point.stress"),
					   volume = harness_field(run, "point.volume"), m = harness_field(run, "point.mass");
	for (uint32_t i = 0; i < n; i++) {
		double gap = 0;
		for (uint32_t k = 0; k < dim; k++) gap = hypot(gap, now.real[k][i] - speed[k]);
		change[0] = fmax(change[0], gap / whole);
		for (uint32_t k = 0; k < (dim == 2 ? 3u : 6u); k++)
			change[1] = fmax(change[1], fabs(s.real[k][i]) / 1e5);
		change[2] = fmax(change[2], fabs(m.real[0][i] / volume.real[0][i] / 1000 - 1));
	}
}

/* A block in uniform motion crosses cells and blocks of the grid and stays what it was, without stress, whatever moves it. */
static void uniform_motion(void **unused) {
	static const char *const shapes[] = { "gimp", "bspline", "linear" };
	static const char *const all[] = { "picflip: {rate: 0}", "picflip: {rate: 3}", "picflip: {rate: 1e300}",
		"picflip: {flip: 0.95}", "apic: {}", "xpic: {order: 3}" };
	(void)unused;
	bool good = true;
	table_head("uniform motion for 0.9 s, 4.5 cells: change");
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int k = 0; k < 3; k++)
			for (int t = 0; t < 6; t++) {
				char what[80];
				double change[3] = { 0 };
				quern_run *run = drift_off(
					dim, shapes[k], all[t], "material: {elastic: {bulk_modulus: 1e5, density: 1000}}");
				drifted(run, dim, 1, change);
				snprintf(what, sizeof what, "%u-D, %s, %s", dim, shapes[k], all[t]);
				good &= table_row(what, change[0], 0, 1e-12);
				good &= table_row("  stress over the bulk modulus", change[1], 0, 1e-12);
				good &= table_row("  density", change[2], 0, 1e-12);
				harness_close(run);
			}
	assert_true(good);
}

/* Slow ones stay where a row of points has just come over a face, and pulls at nodes that hold next to nothing: hats, whose slope does not
 * vanish there, bear it for one point and two along the side of a cell, and for any Poisson's ratio. */
static void slow_motion(void **unused) {
	static const char *const all[] = { "picflip: {rate: 0}", "picflip: {rate: 30}", "apic: {}" };
	static const double shares[] = { 0.03, 3e-4 };
	(void)unused;
	bool good = true;
	table_head("hats in slow uniform motion for 0.9 s: change");
	for (int c = 0; c < 48; c++) {
		const uint32_t dim = c % 2 ? 3 : 2;
		const double share = shares[c / 2 % 2], poisson = c / 4 % 2 ? 0.3 : 0;
		const int points = 1 + c / 8 % 2;
		char what[120];
		double change[3] = { 0 };
		snprintf(what, sizeof what,
			"material: {elastic: {bulk_modulus: 1e5, density: 1000, poisson: %g}}, points: %d", poisson,
			points);
		quern_run *run = drift_off(dim, "linear", all[c / 16], what);
		drifted(run, dim, share, change);
		snprintf(what, sizeof what, "%u-D, %d points, nu %g, %g m/s, %s", dim, points, poisson, 0.5 * share,
			all[c / 16]);
		good &= table_row(what, fmax(change[0], fmax(change[1], change[2])), 0, 1e-12);
		harness_close(run);
	}
	assert_true(good);
}

/* Points on a face of the domain, and as near to it as numbers go on either side, that fly against it: none leaves, and
 * none ends the run. Of sand: a single elastic one, whose wall pulls it back, is thrown off. */
static void points_at_faces(void **unused) {
	static const char *const shapes[] = { "gimp", "bspline", "linear" };
	static const char *const all[] = { "picflip: {rate: 0}", "picflip: {rate: 30}", "apic: {}" };
	(void)unused;
	bool good = true;
	table_head("points at faces, 400 steps: farthest outside over the cell");
	for (int k = 0; k < 3; k++)
		for (int t = 0; t < 3; t++) {
			char what[80];
			double out = 0;
			quern_run *run = drift_off(
				2, shapes[k], all[t], "material: {drucker_prager: {bulk_modulus: 1e5, density: 1000}}");
			const quern_column x = harness_field(run, "point.position"),
							   v = harness_field(run, "point.velocity");
			const double edge[2][3] = { { 0, nextafter(0, 1), nextafter(0, -1) },
				{ 2, nextafter(2, 0), nextafter(2, 3) } };
			for (uint32_t q = 0; q < 12; q++) { /* lone ones: no two meet */
				const uint32_t i = 21 * q, axis = q % 2, upper = q / 2 % 2;
				x.real[axis][i] = edge[upper][q / 4];
				v.real[axis][i] = upper ? 0.1 : -0.1;
				v.real[1 - axis][i] = 0.01;
			}
			harness_field(run, "total.unsorted").index[0] = 1;
			for (int step = 0; step < 400; step++) {
				harness_steps(run, 1);
				const quern_column now = harness_field(run, "point.position");
				for (uint32_t i = 0; i < harness_count(run, "point"); i++)
					for (int a = 0; a < 2; a++)
						out = fmax(out, fmax(-now.real[a][i], now.real[a][i] - 2) / 0.1);
			}
			snprintf(what, sizeof what, "%s, %s", shapes[k], all[t]);
			good &= table_row(what, out, 0, 1e-12);
			harness_close(run);
		}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(uniform_motion), cmocka_unit_test(slow_motion),
		cmocka_unit_test(points_at_faces) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
