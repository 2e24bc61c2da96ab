/* SPDX-License-Identifier: MIT */
/* Flow that keeps its volume, in a material that hardly changes it: what is nearly incompressible must not be stiffer than its shear. A standing wave of
 * shear has its period whatever the bulk modulus; points that each keep their volume make it too short. docs/theory/mpm.md, section 10 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"

static const double
	pi = 3.14159265358979312,
	amplitude = 1e-4, /* m/s: no point goes anywhere */
	part = 0.3,
	stiff =
		49.6; /* of a cell in a step; bulk modulus over that of shear, the most that Poisson's ratio allows in 3-D */
static const char *const strains[] = { "plain", "averaged" };
enum { PLAIN, AVERAGED, STRAINS, RESOLUTIONS = 3 };

/* A unit square, and in 3-D a slab two cells thick, periodic all round; density 1. */
static quern_run *open_square(uint32_t dim, const char *strain, const char *shape, int cells, double bulk,
	double shear, uint32_t workers) {
	const double h = 1.0 / cells, nu2 = (bulk - shear) / (bulk + shear),
				 nu3 = (3 * bulk - 2 * shear) / (6 * bulk + 2 * shear);
	char thick[40] = "";
	if (dim == 3) snprintf(thick, sizeof thick, ", %.17g", 2 * h);
	return harness_open(workers,
		"{quern: 1, dimension: %u, gravity: [0, 0%s], domain: {lower: [0, 0%s], upper: [1, 1%s], periodic: [true, true%s]},\n"
		"time: {end: 1000, step: %.17g, force: true}, output: {every: 1000},\n"
		"continuum: {cell: %.17g, strain: %s, material: {elastic: {bulk_modulus: %.17g, poisson: %.17g, density: 1}},\n"
		"  shape: %s, transfer: {picflip: {rate: 0}}, fill: [{region: {box: {lower: [0, 0%s], upper: [1, 1%s]}}}]}}\n",
		dim, dim == 3 ? ", 0" : "", dim == 3 ? ", 0" : "", thick, dim == 3 ? ", true" : "",
		part * h / sqrt(stiff + 2), h, strain, bulk, dim == 2 ? nu2 : nu3, shape, dim == 3 ? ", 0" : "",
		thick);
}

/* ==== a standing wave of shear ==== */

static void mode(const quern_column *x, uint32_t i, double out[2]) {
	const double a = 2 * pi * x->real[0][i], b = 2 * pi * x->real[1][i];
	out[0] = sin(a) * cos(b), out[1] = -cos(a) * sin(b);
}

static double projected(quern_run *run) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
					   m = harness_field(run, "point.mass");
	double sum = 0, u[2];
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		mode(&x, i, u);
		sum += m.real[0][i] * (v.real[0][i] * u[0] + v.real[1][i] * u[1]);
	}
	return sum;
}

static double pressure(quern_run *run, uint32_t dim) {
	const quern_column s = harness_field(run, "point.stress");
	const uint32_t n = harness_count(run, "point");
	double sum = 0;
	for (uint32_t i = 0; i < n; i++) {
		double p = 0;
		for (uint32_t k = 0; k < dim; k++) p -= s.real[k][i] / dim;
		sum += p * p;
	}
	return sqrt(sum / n);
}

typedef struct heard {
	double stiffness, pressure; /* over the exact one; over the largest shear stress */
} heard;

/* v = A (sin kx cos ky, -cos kx sin ky) cos wt with w^2 = 2 G k^2/rho, and no pressure, until it first stands still. */
static heard listen(uint32_t dim, const char *strain, const char *shape, int cells, double ratio) {
	const double omega = 2 * pi * sqrt(2), dt = part / cells / sqrt(stiff + 2);
	quern_run *run = open_square(dim, strain, shape, cells, ratio, 1, 1);
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		double u[2];
		mode(&x, i, u);
		for (int k = 0; k < 2; k++) v.real[k][i] = amplitude * u[k];
	}
	double was = projected(run), now = was, t = 0;
	while (now > 0 && t < 1) {
		was = now, t += dt;
		harness_steps(run, 1);
		now = projected(run);
	}
	/* velocities stand half a step behind */
	const double stood = t - dt * now / (now - was) - 0.5 * dt, fast = 0.5 * pi / omega / stood;
	const heard h = { fast * fast, pressure(run, dim) / (4 * pi * amplitude / omega) };
	harness_close(run);
	return h;
}

static const char *const shapes[] = { "gimp", "linear", "bspline" };
enum { SHAPES = 3, SMOOTH = 2 };

/* Plain points raise the stiffness by what their cells lack of freedom, and press within a cell by as much as they are sheared; averaged ones have the
 * period of a material that is soft to pressure, and an error of second order in the cell. */
static void shear_wave(void **unused) {
	(void)unused;
	bool good = true;
	for (int shape = 0; shape < SHAPES; shape++) {
		double error[RESOLUTIONS];
		for (int k = 0; k < RESOLUTIONS; k++) {
			char title[80];
			snprintf(title, sizeof title, "standing wave of shear, %s, %d cells", shapes[shape], 8 << k);
			table_head(title);
			const heard soft = listen(3, strains[AVERAGED], shapes[shape], 8 << k, 2),
						plain = listen(3, strains[PLAIN], shapes[shape], 8 << k, stiff),
						averaged = listen(3, strains[AVERAGED], shapes[shape], 8 << k, stiff);
			table_note("K = 50 G, plain: stiffness over that of shear", plain.stiffness);
			table_note("K = 50 G, plain: pressure over shear stress", plain.pressure);
			/* splines hardly lock: the slopes of a cell's points are nearly one */
			good &= shape == SMOOTH || (plain.stiffness / soft.stiffness > 1.04 && plain.pressure > 0.5);
			table_note("K = 50 G, averaged: stiffness over that of shear", averaged.stiffness);
			good &= table_row("  over that of K = 2 G", averaged.stiffness / soft.stiffness, 1, 1e-3);
			good &= table_row("  pressure over shear stress", averaged.pressure, 0, 1e-3);
			error[k] = 1 - averaged.stiffness;
		}
		good &= table_row("  order of the last two", log(error[1] / error[2]) / log(2), 2, 0.15);
	}
	assert_true(good);
}

/* ==== what a cell keeps ==== */

/* Volumes of points after a step over those before, less one; a point's cell is that in which it began. */
static void swell(uint32_t dim, const char *strain, double *gain, uint32_t *n, int cells) {
	quern_run *run = open_square(dim, strain, "gimp", cells, 2, 1, 1);
	quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	*n = harness_count(run, "point");
	for (uint32_t i = 0; i < *n; i++) {
		const double a = 2 * pi * x.real[0][i], b = 2 * pi * x.real[1][i];
		v.real[0][i] = amplitude * sin(a + 0.3) * cos(b), v.real[1][i] = amplitude * cos(2 * a) * sin(b + 1);
	}
	x = harness_field(run, "point.volume");
	const double before = x.real[0][0];
	harness_steps(run, 1);
	x = harness_field(run, "point.volume");
	for (uint32_t i = 0; i < *n; i++) gain[i] = x.real[0][i] / before - 1;
	harness_close(run);
}

/* All points of a cell change volume alike, by the mean of what each would; with four or eight points of one volume that is one sum. */
static void means_of_cells(void **unused) {
	enum { CELLS = 8, MOST = CELLS * CELLS * 2 * 8 };
	(void)unused;
	static double gain[STRAINS][MOST], mean[STRAINS][CELLS * CELLS * 2];
	bool good = true;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		uint32_t n = 0;
		double worst = 0, apart = 0, size = 0, plain_apart = 0;
		const uint32_t each = dim == 2 ? 4 : 8;
		for (int s = 0; s < STRAINS; s++) swell(dim, strains[s], gain[s], &n, CELLS);
		assert_true(n <= MOST);
		/* points are sorted by cell */
		for (int s = 0; s < STRAINS; s++)
			for (uint32_t c = 0; c < n / each; c++) {
				mean[s][c] = 0;
				for (uint32_t i = 0; i < each; i++) mean[s][c] += gain[s][c * each + i] / each;
			}
		for (uint32_t i = 0; i < n; i++) {
			size = fmax(size, fabs(mean[PLAIN][i / each]));
			worst = fmax(worst, fabs(mean[AVERAGED][i / each] - mean[PLAIN][i / each]));
			apart = fmax(apart, fabs(gain[AVERAGED][i] - mean[AVERAGED][i / each]));
			plain_apart = fmax(plain_apart, fabs(gain[PLAIN][i] - mean[PLAIN][i / each]));
		}
		table_head(dim == 2 ? "volumes after a step, 2-D" : "volumes after a step, 3-D");
		table_note("plain: points apart from their cell's mean, over the largest", plain_apart / size);
		good &= plain_apart > 0.1 * size;
		good &= table_row("averaged: the same", apart / size, 0, 1e-4);
		good &= table_row("means of cells, averaged against plain", worst / size, 0, 1e-4);
	}
	assert_true(good);
}

/* ==== threads ==== */

static void same_bits(void **unused) {
	(void)unused;
	quern_column c[2];
	quern_run *run[2];
	for (int k = 0; k < 2; k++) {
		run[k] = open_square(3, "averaged", "gimp", 16, 20, 1, k ? 3 : 1);
		const quern_column x = harness_field(run[k], "point.position"),
						   v = harness_field(run[k], "point.velocity");
		for (uint32_t i = 0; i < harness_count(run[k], "point"); i++)
			v.real[0][i] = sin(2 * pi * x.real[1][i]), v.real[1][i] = 0.3 * cos(4 * pi * x.real[0][i]);
		harness_steps(run[k], 60);
		c[k] = harness_field(run[k], "point.stress");
	}
	for (int k = 0; k < 6; k++)
		assert_memory_equal(
			c[0].real[k], c[1].real[k], harness_count(run[0], "point") * sizeof *c[0].real[k]);
	for (int k = 0; k < 2; k++) harness_close(run[k]);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(shear_wave), cmocka_unit_test(means_of_cells),
		cmocka_unit_test(same_bits) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
