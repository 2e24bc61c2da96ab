/* SPDX-License-Identifier: MIT */
/* The order of the continuum with finer cells, of all shape functions: a manufactured motion, whose body force is chosen so that it is the
 * exact one, and a column that bears its weight, while points cross from cell to cell. docs/theory/mpm.md, section 7 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
static const double pi = 3.14159265358979312;
static const char *const shapes[] = { "gimp", "bspline" };
enum { GIMP, BSPLINE, SHAPES, HALVINGS = 4 };

/* Points begin in the middles of quarters of cells, which are farther apart than any error: where one began is known by that. */
static double lattice(double near, double h) { return (floor(near / (0.5 * h)) + 0.5) * 0.5 * h; }

static double order_of(const double *errors, int from) {
	return log(errors[from] / errors[HALVINGS - 1]) / log(2) / (HALVINGS - 1 - from);
}

static bool at_least(const char *what, double measured, double least) {
	const bool good = measured >= least;
	printf("  %-58s %13.6g   at least %2.4g%s\n", what, measured, least, good ? "" : "  <- out");
	return good;
}

static void tell(const char *what, const char *shape, const double *errors) {
	char title[140];
	snprintf(title, sizeof title, "%s, %s", what, shape);
	table_head(title);
	for (int k = 0; k < HALVINGS; k++) {
		snprintf(title, sizeof title, "%d cells: error over the size", 8 << k);
		table_note(title, errors[k]);
	}
}

/* ==== a manufactured motion ==== */

/* u_i = A_i sin(pi X_i) sin(pi t) in the unit square (after Kamojjala et al. 2015, for this material), and in its mirror images:
 * no wall pulls. The stress of
 * stretches F_i along the axes is s_i = 2 G ln F_i + lambda ln J; on a face that moved along i alone what acts per area at the start
 * is s_i J/F_i, and J/F_i does not depend on X_i. */
static const double bulk = 1, poisson = 0.3, half = 1; /* s, of a period */
static double amplitude[2];

static double wave(double t) { return sin(pi * t); }

/* Where the point was that is at x now. */
static double origin(double x, int i, double t) {
	double at = x;
	for (int k = 0; k < 3; k++)
		at -= (at + amplitude[i] * sin(pi * at) * wave(t) - x) /
			  (1 + pi * amplitude[i] * cos(pi * at) * wave(t));
	return at;
}

/* The body force per mass that makes the motion the exact one. */
static void force(const double x[2], double t, double out[2]) {
	const double modulus =
		bulk + bulk * (1 - poisson) / (1 + poisson); /* lambda + 2 G; in 2-D K = lambda + G */
	double f[2], u[2];
	for (int a = 0; a < 2; a++) {
		const double phase = pi * origin(x[a], a, t), size = amplitude[a] * wave(t);
		f[a] = 1 + pi * size * cos(phase), u[a] = size * sin(phase);
	}
	for (int a = 0; a < 2; a++) out[a] = pi * pi * u[a] * (modulus * f[1 - a] / f[a] - 1);
}

/* What the points are off by, squared, and how far they are displaced. */
static void compare(quern_run *run, double h, double t, double *off, double *size) {
	const quern_column x = harness_field(run, "point.position");
	const uint32_t n = harness_count(run, "point");
	for (uint32_t i = 0; i < n; i++)
		for (int a = 0; a < 2; a++) {
			const double was = lattice(origin(x.real[a][i], a, t), h),
						 u = amplitude[a] * sin(pi * was) * wave(t);
			*off += pow(x.real[a][i] - was - u, 2), *size += u * u;
		}
}

/* Half a step apart, velocities and places are of second order in time. Errors are those of the whole time, since at one moment
 * two of them may cancel. */
static double manufactured(const char *shape, int cells) {
	const double h = 1.0 / cells, dt = 0.2 * h;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [2, 2], periodic: [true, true]},\n"
		"time: {end: 10, step: %.17g, force: true}, output: {every: 10},\n"
		"continuum: {cell: %.17g, gain: 0, material: {elastic: {bulk_modulus: %.17g, poisson: %.17g, density: 1}},\n" /* forces of the test's own */
		"  shape: %s, transfer: {picflip: {rate: 0}}, fill: [{region: {box: {lower: [0, 0], upper: [2, 2]}}}]}}\n",
		dt, h, bulk, poisson, shape);
	const uint32_t n = harness_count(run, "point");
	quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	for (uint32_t i = 0; i < n; i++)
		for (int a = 0; a < 2; a++)
			v.real[a][i] = amplitude[a] * pi * sin(pi * x.real[a][i]) * cos(pi * 0.5 * dt);
	const int steps = (int)floor(half / dt + 0.5);
	double off = 0, size = 0;
	for (int k = 0; k < steps; k++) {
		x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
		for (uint32_t i = 0; i < n; i++) {
			const double at[2] = { x.real[0][i], x.real[1][i] };
			double f[2];
			force(at, k * dt, f);
			for (int a = 0; a < 2; a++) v.real[a][i] += dt * f[a];
		}
		harness_steps(run, 1);
		if ((k + 1) % (steps / 8) == 0) compare(run, h, (k + 1) * dt, &off, &size);
	}
	harness_close(run);
	return sqrt(off / size);
}

/* Of one amplitude: the order from the coarsest to the finest cells, and what each of them is off by. */
static double order_of_motion(int shape, double size, double errors[HALVINGS]) {
	char what[100];
	amplitude[0] = size, amplitude[1] = -size;
	for (int k = 0; k < HALVINGS; k++) errors[k] = manufactured(shapes[shape], 8 << k);
	snprintf(what, sizeof what, "a manufactured motion, amplitude %g", size);
	tell(what, shapes[shape], errors);
	table_note("  order of the last two", order_of(errors, HALVINGS - 2));
	return order_of(errors, 0);
}

/* Of second order where the amplitude is small. In larger ones four points a cell are too few to sum up what a cell holds once they have moved,
 * and the order is lost. Hats have none once points cross from cell to cell. */
static void manufactured_motion(void **unused) {
	(void)unused;
	bool good = true;
	double errors[SHAPES][HALVINGS], larger[HALVINGS];
	for (int shape = 0; shape < SHAPES; shape++)
		good &= at_least("  order, 8 to 64 cells", order_of_motion(shape, 0.02, errors[shape]), 1.8);
	for (int k = 0; k < 2; k++)
		table_note("  order, 8 to 64 cells", order_of_motion(GIMP, k ? 0.1 : 0.05, larger));
	amplitude[0] = 0.02, amplitude[1] = -0.02;
	table_head("the same with linear hats, amplitude 0.02");
	good &= at_least("32 cells: error over that of gimp", manufactured("linear", 32) / errors[GIMP][2], 5);
	assert_true(good);
}

/* ==== a column that bears its weight ==== */

/* The place at the start of what is at y now; k: weight of the column over its modulus. */
static double height(double y, double k) { return 1 + log(y * k + exp(-k)) / k; }
static double sunk(double was, double k) { return (exp(k * (was - 1)) - exp(-k)) / k; }

/* The sides are held, so the area stays, and whatever the law and the compression the stress is that of the weight above: -rho g (H - Y) of what
 * was at Y at the start. Motion is damped as fast as a column can come to rest. */
static double weight(const char *shape, int cells, double k, double *displacement) {
	const double h = 1.0 / cells, modulus = 2, g = k * modulus, dt = 0.4 * h / sqrt(modulus);
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, %.17g], domain: {lower: [0, 0], upper: [%.17g, 1.25], periodic: [true, false]},\n"
		"time: {end: 1000, step: %.17g, force: true}, output: {every: 100},\n"
		"continuum: {cell: %.17g, material: {elastic: {bulk_modulus: 1, poisson: 0, density: 1}},\n"
		"  shape: %s, transfer: {picflip: {rate: 0}}, fill: [{region: {box: {lower: [0, 0], upper: [%.17g, 1]}}}]}}\n",
		-g, 2 * h, dt, h, shape, 2 * h);
	const uint32_t n = harness_count(run, "point");
	const double rate = 0.5 * pi * sqrt(modulus), keep = 1 - rate * dt;
	double sum = 0, size = 0, off = 0, way = 0;
	for (int step = 0; step < (int)(24 / rate / dt); step++) {
		harness_steps(run, 1);
		const quern_column v = harness_field(run, "point.velocity");
		for (uint32_t i = 0; i < n; i++) v.real[0][i] *= keep, v.real[1][i] *= keep;
	}
	const quern_column s = harness_field(run, "point.stress"), x = harness_field(run, "point.position");
	for (uint32_t i = 0; i < n; i++) {
		const double was = lattice(height(x.real[1][i], k), h), asked = -g * (1 - was), now = sunk(was, k);
		off += pow(x.real[1][i] - now, 2), way += pow(now - was, 2);
		sum += pow(s.real[1][i] - asked, 2), size += asked * asked;
	}
	harness_close(run);
	*displacement = sqrt(off / way);
	return sqrt(sum / size);
}

/* With little weight no point leaves its cell: displacements are of second order, and stresses of points of order one and a half with the
 * splines. With much, points lie irregularly in their cells: then the error stays what that makes of it. */
static void column_of_weight(void **unused) {
	(void)unused;
	bool good = true;
	for (int shape = 0; shape < SHAPES; shape++) {
		double little[HALVINGS], much[HALVINGS], displaced[HALVINGS], far[HALVINGS];
		for (int k = 0; k < HALVINGS; k++) little[k] = weight(shapes[shape], 8 << k, 0.0015, &displaced[k]);
		tell("displacements of a column of little weight", shapes[shape], displaced);
		good &= at_least("  order", order_of(displaced, 0), 1.9);
		tell("stresses of a column of little weight", shapes[shape], little);
		good &= at_least("  order", order_of(little, 0), shape == BSPLINE ? 1.4 : 0.9);
		for (int k = 0; k < HALVINGS; k++) much[k] = weight(shapes[shape], 8 << k, 0.15, &far[k]);
		tell("displacements of a column of much weight", shapes[shape], far);
		tell("stresses of a column of much weight", shapes[shape], much);
		good &= table_row("  of the finest cells", much[HALVINGS - 1], 0, 0.03);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(manufactured_motion),
		cmocka_unit_test(column_of_weight) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
