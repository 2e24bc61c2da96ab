/* SPDX-License-Identifier: MIT */
/* The densest place of a hybrid: what is found for grains on a lattice, whose density is known, beside walls and around a patch that
 * is denser; the warning and the end of the run. docs/theory/hybrid.md, section 5 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>
#include <string.h>
#include <unistd.h>

static const double cell = 4e-3, diameter = 2e-3, solid = 2500;
enum { SIDE = 9 }; /* cells of a window in 2-D; 5 in 3-D */

typedef struct layout {
	int dim, cells;
	double wall;   /* m: how far a plane stands within the domain on each side of x; 0: none, x is periodic */
	int more;      /* grains of a patch's cell beyond the four of any other */
	double packed; /* kg/m^3: without stress */
	const char *zone;
} layout;

static void put_lattice(FILE *out, const layout *l) {
	const int n = 2 * l->cells, skipped = (int)(l->wall / diameter);
	for (int k = 0; k < (l->dim == 3 ? n : 1); k++)
		for (int j = 0; j < n; j++)
			for (int i = skipped; i < n - skipped; i++) {
				fprintf(out, "%.17g %.17g", (i + 0.5) * diameter, (j + 0.5) * diameter);
				if (l->dim == 3) fprintf(out, " %.17g", (k + 0.5) * diameter);
				fprintf(out, "\n");
			}
}

/* Between those of the lattice, from the patch's third cell on along each axis. */
static void put_patch(FILE *out, const layout *l) {
	for (int j = 0; j < SIDE; j++)
		for (int i = 0; i < SIDE; i++)
			for (int k = 0; k < l->more; k++)
				fprintf(out, "%.17g %.17g\n", (3 + i + 0.25 + 0.5 * k) * cell + 0.5e-3, (3 + j + 0.5) * cell);
}

static quern_run *open_lattice(const layout *l) {
	char path[HARNESS_PATH], walls[200] = "";
	FILE *out = harness_file(path);
	const double size = l->cells * cell;
	fprintf(out, l->dim == 3 ? "x y z\n" : "x y\n");
	put_lattice(out, l);
	put_patch(out, l);
	fclose(out);
	if (l->wall > 0)
		snprintf(walls, sizeof walls,
			"bodies: [{plane: {point: [%g, 0], normal: [1, 0]}}, {plane: {point: [%g, 0], normal: [-1, 0]}}]\n",
			l->wall, size - l->wall);
	const char *periodic = l->dim == 3 ? "true, true, true" : l->wall > 0 ? "false, true" : "true, true";
	char upper[60], lower[40];
	snprintf(lower, sizeof lower, l->dim == 3 ? "0, 0, 0" : "0, 0");
	snprintf(upper, sizeof upper, l->dim == 3 ? "%g, %g, %g" : "%g, %g", size, size, size);
	quern_run *run = harness_open(1,
		"quern: 1\ndimension: %d\ngravity: [%s]\ndomain: {lower: [%s], upper: [%s], periodic: [%s]}\n"
		"time: {end: 1e-6, step: 1e-9}\n%s"
		"grains: {material: {density: %g, radius: {mean: 1 mm}}, overlap: {start: 10, most: 0},\n"
		"  contact: {linear: {stiffness: 1e-9, restitution: 1, friction: 0}}, file: %s}\n"
		"continuum: {cell: %g, material: {mu_i: {critical_density: %g, bulk_modulus: 1e-6}}}\n"
		"hybrid: {oracle: [{fixed: {otherwise: %s}}], substeps: 1, update: 1}\n",
		l->dim, lower, lower, upper, periodic, walls, solid, path, cell, l->packed, l->zone);
	unlink(path);
	run->log = quern_log_create(true, false);
	return run;
}

static double densest(quern_run *run) { return harness_field(run, "total.densest").real[0][0]; }

/* A lattice of touching grains fills pi/4 or pi/6, wherever the walls are; with a patch as wide as a window the patch counts. */
static void ratio_is_that_of_the_lattice(void **state) {
	static const struct {
		const char *name;
		layout of;
		double wanted, tolerance;
	} of[] = {
		{ "lattice of discs", { 2, 16, 0, 0, 1900, "discrete" }, 0.785398163397448 * 2500 / 1900, 1e-12 },
		{ "of spheres", { 3, 6, 0, 0, 1300, "discrete" }, 0.523598775598299 * 2500 / 1300, 1e-12 },
		{ "between walls", { 2, 16, 4e-3, 0, 1900, "discrete" }, 0.785398163397448 * 2500 / 1900, 1e-12 },
		{ "walls that halve cells", { 2, 16, 6e-3, 0, 1900, "discrete" }, 0.785398163397448 * 2500 / 1900,
			1e-12 },
		{ "half grains, half continuum", { 2, 16, 0, 0, 1900, "hybrid" }, 0.785398163397448 * 2500 / 1900,
			1e-12 },
		{ "a patch of five grains a cell", { 2, 16, 0, 1, 2000, "discrete" },
			1.25 * 0.785398163397448 * 2500 / 2000, 1e-12 },
	};
	bool good = true;
	(void)state;
	table_head("density of the densest place over the stress-free one");
	for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
		quern_run *run = open_lattice(&of[k].of);
		harness_steps(run, 20);
		good &= table_row(of[k].name, densest(run), of[k].wanted, of[k].tolerance);
		harness_close(run);
	}
	assert_true(good);
}

/* Nothing at 1.03; one warning at 1.23, however many updates find it again. */
static void warns_once(void **state) {
	const layout sound = { 2, 16, 0, 0, 1900, "discrete" }, dense = { 2, 16, 0, 1, 2000, "discrete" };
	quern_run *run = open_lattice(&sound);
	(void)state;
	harness_steps(run, 10);
	assert_int_equal(quern_log_warnings(run->log), 0);
	harness_close(run);
	run = open_lattice(&dense);
	harness_steps(run, 10);
	assert_int_equal(quern_log_warnings(run->log), 1);
	harness_close(run);
}

/* Six grains on the room of four are denser than solid: the run ends, and says where. */
static void ends_above_the_solid(void **state) {
	const layout l = { 2, 16, 0, 2, 2000, "discrete" };
	quern_run *run = open_lattice(&l);
	(void)state;
	assert_int_equal(harness_try(run, 3), QUERN_E_NUMERIC);
	print_message("%s\n", run->message);
	assert_non_null(strstr(run->message, "hybrid.update, at t = "));
	assert_non_null(strstr(run->message, "around (0.03, 0.03) m"));
	assert_non_null(strstr(run->message, "1.47 times"));
	assert_non_null(strstr(run->message, "2500 kg/m^3"));
	harness_close(run);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(ratio_is_that_of_the_lattice),
		cmocka_unit_test(warns_once), cmocka_unit_test(ends_above_the_solid) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
