/* SPDX-License-Identifier: MIT */
/* The continuum solver against closed forms: waves at their speed, weight carried at rest, and no ghost of a volume left in
 * a body that flew apart and fell back. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "../../plugins/mpm/damp.h"
#include "harness.h"
#include "table.h"
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979312, gravity = 9.81, density = 1500;

/* Mass-weighted mean of one component. */
static double mean(quern_run *run, const char *field, int k) {
	const uint32_t n = harness_count(run, "point");
	const quern_column x = harness_field(run, field), m = harness_field(run, "point.mass");
	double sum = 0, mass = 0;
	for (uint32_t i = 0; i < n; i++) sum += m.real[0][i] * x.real[k][i], mass += m.real[0][i];
	return sum / mass;
}

/* ==== a bar, fixed at one end, in its longest mode ==== */

enum { BAR_LENGTH = 25 }; /* m; waves of 10 m/s, a period of 10 s */

typedef struct bar {
	double period, kept; /* kept: the fastest of the mean velocity after two periods, over the first */
} bar;

static bar ring(int cells, const char *shape, double speed, double damping) {
	const double h = (double)BAR_LENGTH / cells;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [%.17g, %.17g]},\n"
		"time: {end: 1000, step: %.17g, force: true}, output: {every: 100},\n"
		"bodies: [{plane: {point: [0, 0], normal: [1, 0], boundary: sticky}}],\n"
		"continuum: {cell: %.17g, damping: %.17g, material: {elastic: {bulk_modulus: 50, poisson: 0, density: 1}},\n"
		"  shape: %s, transfer: {picflip: {rate: 0}},\n"
		"  fill: [{region: {box: {lower: [0, 0], upper: [%d, %.17g]}}}]}}\n",
		(cells + 2) * h, 2 * h, 1.0 / cells, h, damping, shape, BAR_LENGTH, 2 * h);
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		v.real[0][i] = speed * sin(pi * x.real[0][i] / (2 * BAR_LENGTH));
	const double first = mean(run, "point.velocity", 0);
	double crossing[5] = { 0 }, last = first;
	bar out = { 0 };
	for (int k = 0; k < 5;) {
		harness_steps(run, 1);
		const double now = mean(run, "point.velocity", 0);
		if (k == 4) out.kept = fmax(out.kept, now / first);
		if ((now > 0) != (last > 0)) crossing[k++] = quern_run_time(run) - run->clock.dt * now / (now - last);
		last = now;
	}
	out.period = (crossing[4] - crossing[0]) / 2;
	harness_close(run);
	return out;
}

/* The wave speed is sqrt(E/rho) and the method is of second order. */
static void vibrating_bar(void **unused) {
	(void)unused;
	static const int cells[] = { 13, 26, 52, 104 };
	static const char *const shapes[] = { "gimp", "bspline", "linear" };
	bool good = true;
	for (int shape = 0; shape < 3; shape++) {
		double errors[4];
		char what[80];
		snprintf(what, sizeof what, "bar of 25 m, %s: period, s", shapes[shape]);
		table_head(what);
		for (int k = 0; k < (shape == 1 ? 3 : 4); k++) {
			const bar b = ring(cells[k], shapes[shape], 0.01, 0);
			errors[k] = b.period - 10;
			snprintf(what, sizeof what, "%d cells of two points", cells[k]);
			good &= table_row(what, b.period, 10, 0.1);
			good &= table_row("  share of the amplitude after two periods", b.kept, 1, 0.01);
			if (!k) continue;
			good &= table_row("  observed order", log(errors[k - 1] / errors[k]) / log(2), 2, 0.15);
		}
	}
	table_head("the same, at ten times the speed");
	good &= table_row("13 cells of two points", ring(13, "gimp", 0.1, 0).period, 10, 0.1);
	assert_true(good);
}

/* Dashpots of the time T take w^2 T/2 of the amplitude in a second. */
static void damped_bar(void **unused) {
	static const double times[] = { 0.01, 0.02, 0.05 };
	const double w = 2 * pi / 10, unseen = ring(26, "gimp", 0.01, 0).kept;
	bool good = true;
	(void)unused;
	table_head("bar with dashpots: share of the amplitude after two periods");
	for (size_t k = 0; k < sizeof times / sizeof *times; k++) {
		char what[80];
		snprintf(what, sizeof what, "damping %g s", times[k]);
		good &= table_row(
			what, ring(26, "gimp", 0.01, times[k]).kept / unseen, exp(-10 * w * w * times[k]), 0.005);
	}
	assert_true(good);
}

/* Kinetic energy of a block at random velocities after 300 steps, over that at the start. The step is `part` of the longest one,
 * (w dt)^2 + 2 T w^2 dt = 4 with w^2 = (28/3) d K/rho h^2. */
static double shake(double damping, double part, bool three) {
	const double w2 = 28.0 / 3 * (three ? 3 : 2) * 50,
				 step = part * (sqrt(damping * damping + 4 / w2) - damping);
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: %d, gravity: [0, 0%s], domain: {lower: [0, 0%s], upper: [12, 12%s], periodic: [true, true%s]},\n"
		"time: {end: 1000, step: %.17g, force: true}, output: {every: 100},\n"
		"continuum: {cell: 1, damping: %g, material: {elastic: {bulk_modulus: 50, density: 1}}, transfer: {picflip: {rate: 0}},\n"
		"  fill: [{region: {box: {lower: [0, 0%s], upper: [12, 12%s]}}}]}}\n",
		three ? 3 : 2, three ? ", 0" : "", three ? ", 0" : "", three ? ", 12" : "", three ? ", true" : "",
		step, damping, three ? ", 0" : "", three ? ", 12" : "");
	const quern_column v = harness_field(run, "point.velocity");
	const uint32_t n = harness_count(run, "point"), dim = three ? 3 : 2;
	double first = 0, last = 0;
	for (uint32_t i = 0; i < n; i++)
		for (uint32_t k = 0; k < dim; k++) {
			v.real[k][i] = 1e-5 * (sin(37.7 * i * i + 11 * k) + sin(12.9 * i + k));
			first += v.real[k][i] * v.real[k][i];
		}
	harness_steps(run, 300);
	const quern_column u = harness_field(run, "point.velocity");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		for (uint32_t k = 0; k < dim; k++) last += u.real[k][i] * u.real[k][i];
	harness_close(run);
	return last / first;
}

/* What dashpots see is the motion of the step before, and with them the step has to be shorter. */
static void step_with_dashpots(void **unused) {
	static const double times[] = { 0, 0.01, 0.1 };
	(void)unused;
	table_head("kinetic energy after 300 steps, over that at first");
	for (int k = 0; k < 6; k++) {
		const bool three = k % 2;
		const double held = shake(times[k / 2], 0.9, three);
		char what[80];
		snprintf(
			what, sizeof what, "%s, damping %g s, 0.9 of the limit", three ? "3-D" : "2-D", times[k / 2]);
		table_note(what, held);
		assert_true(held < 1.1);
	}
}

/* What dashpots leave out of a stress's gain is what a stress gains that turns with the material: R s R^T with R = 1 + dt W. */
static void dashpots_leave_turning_out(void **unused) {
	static const double s[3][3] = { { -3, 0.7, 0.4 }, { 0.7, -5, -0.9 }, { 0.4, -0.9, -2 } }, dt = 1e-7;
	static const int at[6][2] = { { 0, 0 }, { 1, 1 }, { 2, 2 }, { 0, 1 }, { 1, 2 }, { 0, 2 } };
	(void)unused;
	for (int axis = 0; axis < 3; axis++) {
		const int a = (axis + 1) % 3, b = (axis + 2) % 3;
		double l[3][3] = { { 0.3, 0.2, -0.1 }, { 0.2, -0.5, 0.4 },
			{ -0.1, 0.4, 0.6 } }; /* strain does not count */
		double r[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };
		l[a][b] -= 2, l[b][a] += 2;
		r[a][b] -= 2 * dt, r[b][a] += 2 * dt;
		const symmetric turned =
			damp_turned(3, (symmetric) { s[0][0], s[1][1], s[2][2], s[0][1], s[1][2], s[0][2] },
				(tensor) { .xx = l[0][0],
					.xy = l[0][1],
					.xz = l[0][2],
					.yx = l[1][0],
					.yy = l[1][1],
					.yz = l[1][2],
					.zx = l[2][0],
					.zy = l[2][1],
					.zz = l[2][2] });
		const double found[6] = { turned.xx, turned.yy, turned.zz, turned.xy, turned.yz, turned.xz };
		for (int k = 0; k < 6; k++) {
			double gain = -s[at[k][0]][at[k][1]];
			for (int i = 0; i < 3; i++)
				for (int j = 0; j < 3; j++) gain += r[at[k][0]][i] * s[i][j] * r[at[k][1]][j];
			assert_true(fabs(gain / dt - found[k]) < 1e-5);
		}
	}
}

/* ==== a standing wave, ten cells long ==== */

enum { WAVE_CELLS = 10, WAVE_STEPS = 200 }; /* to a length; to a period */

typedef struct wave {
	double kept; /* largest velocity in the last period of five over that in the first */
	int steps;   /* between them */
} wave;

static wave ripple(const char *transfer) {
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [%d, 2], periodic: [true, "
		"true]},\n"
		"time: {end: 1000, step: %.17g, force: true}, output: {every: 100},\n"
		"continuum: {cell: 1, shape: gimp, material: {elastic: {bulk_modulus: 50, poisson: 0, density: 1}},\n"
		"  transfer: {%s}, fill: [{region: {box: {lower: [0, 0], upper: [%d, 2]}}}]}}\n",
		WAVE_CELLS, 1.0 / WAVE_STEPS, transfer, WAVE_CELLS);
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	const uint32_t n = harness_count(run, "point");
	double first = 0, last = 0;
	wave out = { 0 };
	for (uint32_t i = 0; i < n; i++) v.real[0][i] = 1e-3 * sin(2 * pi * x.real[0][i] / WAVE_CELLS);
	for (int step = 0; step < 5 * WAVE_STEPS; step++) {
		double sum = 0;
		harness_steps(run, 1);
		const quern_column y = harness_field(run, "point.position"), u = harness_field(run, "point.velocity");
		for (uint32_t i = 0; i < n; i++) sum += u.real[0][i] * sin(2 * pi * y.real[0][i] / WAVE_CELLS);
		if (step < WAVE_STEPS) first = fmax(first, fabs(sum));
		if (step >= 4 * WAVE_STEPS && fabs(sum) > last) last = fabs(sum), out.steps = step;
	}
	harness_close(run);
	out.kept = last / first;
	return out;
}

/* Of a velocity that varies like cos kx, two points of gimp per cell a quarter of a cell from their nodes, a round trip to the grid
 * leaves A = 5/8 + 3/8 cos kh; XPIC of order m takes (1 - A)^m of it in every step, half of that from the amplitude of
 * a wave, whose energy is in motion half of the time. What FLIP takes comes from the stress, which is updated last. */
static void xpic_damps_less_by_order(void **unused) {
	static const int orders[] = { 1, 2, 3, 5 };
	(void)unused;
	const double unseen = 0.375 * (1 - cos(2 * pi / WAVE_CELLS));
	const double flip = ripple("picflip: {rate: 0}").kept;
	double kept[4];
	bool good = true;
	table_head("a wave of ten cells, 200 steps a period: kept after four periods");
	for (int k = 0; k < 4; k++) {
		char what[40];
		snprintf(what, sizeof what, "xpic: {order: %d}", orders[k]);
		const wave w = ripple(what);
		const double asked = flip * exp(-0.5 * w.steps * pow(unseen, orders[k]));
		kept[k] = w.kept;
		good &= table_row(what, w.kept, asked, fmax(0.02 * asked, 1e-3));
		if (k) good &= kept[k] > kept[k - 1];
	}
	table_note("picflip: {rate: 0} (FLIP)", flip);
	table_note("picflip: {rate: 1e300} (PIC)", ripple("picflip: {rate: 1e300}").kept);
	table_note("apic", ripple("apic: {}").kept);
	assert_true(good);
}

/* ==== weight ==== */

typedef struct material {
	const char *name, *parameters;
} material;
static const material materials[] = { { "elastic", "density: 1500" }, { "drucker_prager", "density: 1500" },
	{ "mu_i", "diameter: 5e-3, grain_density: 2450, critical_density: 1500" } };
enum { ELASTIC, DRUCKER_PRAGER, MU_I, MATERIALS };

enum { COLUMN_CELLS = 20 };

/* A column of one metre between slip walls. */
static quern_run *column(
	int which, const char *shape, const char *boundary, const char *stress, double rate) {
	const double h = 1.0 / COLUMN_CELLS;
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [%.17g, %.17g]},\n"
		"time: {end: 1000}, output: {every: 0.1},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: %s}}],\n"
		"continuum: {cell: %.17g, shape: %s, material: {%s: {bulk_modulus: 1e7, %s}}, transfer: {picflip: {rate: %g}},\n"
		"  fill: [{region: {box: {lower: [0, 0], upper: [%.17g, 1]}}, stress: %s, lateral: 0.7}]}}\n",
		4 * h, 1 + 2 * h, boundary, h, shape, materials[which].name, materials[which].parameters, rate, 4 * h,
		stress);
}

/* Worst relative gap between a cell's mean vertical stress and rho g times its depth, from the floor up to the cell that
 * is `top` below the surface's. */
static double weight_gap(quern_run *run, int top) {
	double sum[COLUMN_CELLS + 2] = { 0 }, height[COLUMN_CELLS + 2] = { 0 }, worst = 0;
	int n[COLUMN_CELLS + 2] = { 0 };
	const quern_column x = harness_field(run, "point.position"), s = harness_field(run, "point.stress");
	const double surface = 2 * mean(run, "point.position", 1);
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const int cell = (int)(x.real[1][i] * COLUMN_CELLS);
		sum[cell] += s.real[1][i], height[cell] += x.real[1][i], n[cell]++;
	}
	for (int k = 0; k < COLUMN_CELLS - top; k++)
		worst = fmax(worst, fabs(sum[k] / n[k] / (density * gravity * (surface - height[k] / n[k])) + 1));
	return worst;
}

/* B-splines see a surface a quarter of a cell beside it: of the little that the topmost cell bears that is some percent. */
static const char *const both_shapes[] = { "gimp", "bspline" };

/* A column under its own weight stays at rest and carries it, every cell its own. */
static void weight_at_rest(void **unused) {
	(void)unused;
	bool good = true;
	char what[80];
	table_head("at rest from the start, 1 s: gap over rho g depth");
	for (int which = 0; which < MATERIALS; which++)
		for (int k = 0; k < 4; k++) {
			const char *floor = k % 2 ? "sticky" : "slip", *shape = both_shapes[k / 2];
			quern_run *run = column(which, shape, floor, "at_rest", 0);
			harness_until(run, 1);
			snprintf(what, sizeof what, "%s, %s, on a %s floor", materials[which].name, shape, floor);
			good &= table_row(what, weight_gap(run, k / 2), 0, 0.01);
			harness_close(run);
		}
	assert_true(good);
}

/* A layer on a slope, periodic along it: with the stress of its weight it stays where it is, sheared; from nothing it falls into
 * motion. Gravity along each axis in turn, up and down, and askew along the others, on a slope of 45 degrees as much as along the last. */
static void layer_at_rest(void **unused) {
	(void)unused;
	bool good = true;
	table_head("a layer on a slope, 0.1 s: speed over that of a free fall");
	for (int dim = 2; dim <= 3; dim++)
		for (int axis = 0; axis < dim; axis++)
			for (int up = 0; up < 2; up++)
				for (int way = 0; way < (axis == dim - 1 ? 4 : 2); way++) {
					const bool rests = way % 2, alike = way > 1;
					double g[3], low[3] = { 0, 0, 0 }, high[3] = { 0.4, 0.4, 0.4 }, from[3] = { 0, 0, 0 },
								 to[3] = { 0.4, 0.4, 0.4 }, at[3] = { 0, 0, 0 }, normal[3] = { 0, 0, 0 };
					const char *around[3] = { "true", "true", "true" };
					for (int k = 0; k < 3; k++) g[k] = k == axis ? (up ? 9 : -9) : alike ? 9 : 2.0 + k;
					high[axis] = 1.2, to[axis] = up ? 1.2 : 1, from[axis] = up ? 0.2 : 0;
					at[axis] = up ? 1.2 : 0, normal[axis] = up ? -1 : 1, around[axis] = "false";
					const double *of[7] = { g, low, high, at, normal, from, to };
					char word[7][80], loops[40];
					for (int w = 0; w < 7; w++) {
						if (dim == 2) snprintf(word[w], sizeof word[w], "[%g, %g]", of[w][0], of[w][1]);
						else snprintf(word[w], sizeof word[w], "[%g, %g, %g]", of[w][0], of[w][1], of[w][2]);
					}
					if (dim == 2) snprintf(loops, sizeof loops, "[%s, %s]", around[0], around[1]);
					else snprintf(loops, sizeof loops, "[%s, %s, %s]", around[0], around[1], around[2]);
					quern_run *run = harness_open(1,
						"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s, periodic: "
						"%s}, time: {end: 1},\n"
						"output: {every: 0.1}, bodies: [{plane: {point: %s, normal: %s, boundary: "
						"sticky}}],\n"
						"continuum: {cell: 0.1, material: {elastic: {bulk_modulus: 1e7, poisson: 0.3, "
						"density: 1000}}, transfer: "
						"{picflip: {rate: 0}},\n  fill: {region: {box: {lower: %s, upper: %s}}, stress: %s, "
						"lateral: 0.5}}}\n",
						dim, word[0], word[1], word[2], loops, word[3], word[4], word[5], word[6],
						rests ? "at_rest" : "none");
					harness_until(run, 0.1);
					const quern_column v = harness_field(run, "point.velocity");
					double most = 0, fall = 0;
					for (uint32_t i = 0; i < harness_count(run, "point"); i++)
						for (int k = 0; k < dim; k++) most = fmax(most, fabs(v.real[k][i]));
					for (int k = 0; k < dim; k++) fall = fmax(fall, fabs(g[k]) * 0.1);
					char what[80];
					snprintf(what, sizeof what, "%d-D, axis %d, %s%s, %s", dim, axis, up ? "up" : "down",
						alike ? ", no more than along others" : "", rests ? "at rest" : "from nothing");
					if (rests) good &= table_row(what, most / fall, 0, 0.01);
					else table_note(what, most / fall), good &= most / fall > 0.02;
					harness_close(run);
				}
	assert_true(good);
}

/* Gravity switched on at once makes the column ring; where that has died down it carries the same stress. */
static void weight_after_ringing(void **unused) {
	(void)unused;
	bool good = true;
	char what[80];
	table_head("gravity switched on, PIC, 4 s: gap over rho g depth");
	for (int which = 0; which < MATERIALS; which++)
		for (int k = 0; k < 2; k++) {
			/* a rebound opens the top of what yields, and half a cell of it then lies loose */
			const int top = (which == DRUCKER_PRAGER ? 3 : 0) + k;
			quern_run *run = column(which, both_shapes[k], "sticky", "none", 1e300);
			harness_until(run, 4);
			snprintf(what, sizeof what, "%s, %s, all but %d cells at the top", materials[which].name,
				both_shapes[k], top);
			/* what yields keeps stresses that take turns from cell to cell, where no node of B-splines feels them: some percent */
			if (k && which == DRUCKER_PRAGER) table_note(what, weight_gap(run, top));
			else good &= table_row(what, weight_gap(run, top), 0, 0.01);
			harness_close(run);
		}
	assert_true(good);
}

/* ==== thrown up ==== */

typedef struct toss {
	double base, spread; /* m/s, 1/s: v = base + spread * height */
	double rate;         /* of the transfer, 1/s */
	const char *what;
} toss;

/* A block of one metre between slip walls goes up and comes down; asked is the height it had. */
static bool throw_block(int which, int cells, uint32_t dim, const toss *t) {
	const double h = 1.0 / cells, wide = 4 * h;
	const char *zero = dim == 3 ? ", 0" : "";
	char depth[32] = "", what[80];
	if (dim == 3) snprintf(depth, sizeof depth, ", %.17g", wide);
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: %u, gravity: [0, -9.81%s],\n"
		"domain: {lower: [0, 0%s], upper: [%.17g, 3%s]}, time: {end: 1000}, output: {every: 0.02},\n"
		"bodies: [{plane: {point: [0, 0%s], normal: [0, 1%s], boundary: sticky}}],\n"
		"continuum: {cell: %.17g, material: {%s: {bulk_modulus: 1e6, %s}}, transfer: {picflip: {rate: %g}},\n"
		"  fill: [{region: {box: {lower: [0, 0%s], upper: [%.17g, 1%s]}}}]}}\n",
		dim, zero, zero, wide, depth, zero, zero, h, materials[which].name, materials[which].parameters,
		t->rate, zero, wide, depth);
	const uint32_t n = harness_count(run, "point");
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	for (uint32_t i = 0; i < n; i++) v.real[1][i] = t->base + t->spread * x.real[1][i];
	double most = 0;
	for (int k = 1; k <= 200; k++) {
		double volume = 0;
		harness_until(run, 0.02 * k);
		const quern_column now = harness_field(run, "point.volume");
		for (uint32_t i = 0; i < n; i++) volume += now.real[0][i];
		most = fmax(most, volume / (wide * (dim == 3 ? wide : 1)));
	}
	snprintf(
		what, sizeof what, "%s, %uD, %d cells, %s, x%.2f", materials[which].name, dim, cells, t->what, most);
	const bool good = table_row(what, 2 * mean(run, "point.position", 1), 1, 0.05);
	harness_close(run);
	return good;
}

/* What was pulled apart in flight is as dense as before once it lies on the floor again. */
static void thrown_and_fallen(void **unused) {
	(void)unused;
	static const toss tosses[] = { { 3, 0, 3, "whole, 3/s" }, { 0, 4.4, 3, "apart, 3/s" },
		{ 0, 4.4, 0, "apart, FLIP" }, { 2, 2, 3, "both, 3/s" } };
	bool good = true;
	table_head("thrown up; xN: largest volume in flight. Height, m");
	for (int which = DRUCKER_PRAGER; which <= MU_I; which++) {
		for (int cells = 10; cells <= 20; cells += 10)
			for (int k = 0; k < 4; k++) good &= throw_block(which, cells, 2, &tosses[k]);
		good &= throw_block(which, 10, 3, &tosses[1]);
	}
	assert_true(good);
}

/* ==== a lattice of points as the grid sees it ==== */

/* Particles of gimp, as wide as their points are apart, fill space: for any number of points per cell and axis every node that is
 * wholly within them has the density of the points. */
static void lattice_is_uniform(void **state) {
	(void)state;
	bool good = true;
	table_head("density on the grid over that of the points, less 1: worst node inside");
	for (int dim = 2; dim <= 3; dim++)
		for (int points = 1; points <= 4; points++) {
			char name[40];
			quern_run *run = harness_open(1,
				"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s},\n"
				"time: {end: 1e-6, step: 1e-9}, output: {fields: [motion.density]},\n"
				"continuum: {cell: 0.1, shape: gimp, points: %d, material: {elastic: {bulk_modulus: 1, density: 1000}},\n"
				"  fill: [{region: {box: {lower: %s, upper: %s}}}]}}\n",
				dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
				dim == 2 ? "[1, 1]" : "[1, 1, 1]", points, dim == 2 ? "[0.2, 0.2]" : "[0.2, 0.2, 0.2]",
				dim == 2 ? "[0.8, 0.8]" : "[0.8, 0.8, 0.8]");
			harness_steps(run, 1);
			const quern_column row = harness_field(run, "motion.density");
			const quern_grid_view *g = quern_host_table.grid(run);
			const int edge = (int)g->edge;
			double worst = 0;
			for (uint32_t i = 0; i < g->n_blocks * 64; i++) {
				const int k = (int)i % 64, at[3] = { g->at[i / 64][0] * edge + k % edge,
					g->at[i / 64][1] * edge + k / edge % edge, g->at[i / 64][2] * edge + k / (edge * edge) };
				bool inside = true;
				for (int a = 0; a < dim; a++) inside = inside && at[a] >= 3 && at[a] <= 7;
				if (inside) worst = fmax(worst, fabs(row.real[0][8 * i] / 1000 - 1));
			}
			snprintf(name, sizeof name, "%d-D, %d per cell and axis", dim, points);
			good &= table_row(name, worst, 0, 1e-12);
			harness_close(run);
		}
	assert_true(good);
}

/* ==== what ends a run ==== */

/* A point that one step turns inside out, det(1 + dt L) = -1/2, ends the run, whatever its material makes of it. */
static void inside_out_ends_the_run(void **state) {
	static const char *const laws[] = { "elastic: {bulk_modulus: 1, density: 1000}",
		"drucker_prager: {bulk_modulus: 1, density: 1000}",
		"mu_i: {bulk_modulus: 1, diameter: 2 mm, grain_density: 2500, critical_density: 1000}" };
	const double dt = 1e-3;
	(void)state;
	for (int dim = 2; dim <= 3; dim++)
		for (int m = 0; m < 3; m++) {
			quern_run *run = harness_open(1,
				"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s},\n"
				"time: {end: 1, step: %g, force: true}, output: {every: 0.1},\n"
				"continuum: {cell: 0.1, rasterise: affine, material: {%s},\n"
				"  fill: [{region: {box: {lower: %s, upper: %s}}}]}}\n",
				dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
				dim == 2 ? "[1, 1]" : "[1, 1, 1]", dt, laws[m], dim == 2 ? "[0.4, 0.4]" : "[0.4, 0.4, 0.4]",
				dim == 2 ? "[0.5, 0.5]" : "[0.5, 0.5, 0.5]");
			const quern_column x = harness_field(run, "point.position"),
							   v = harness_field(run, "point.velocity"),
							   l = harness_field(run, "point.affine");
			for (uint32_t i = 0; i < harness_count(run, "point"); i++)
				l.real[0][i] = -1.5 / dt, v.real[0][i] = l.real[0][i] * (x.real[0][i] - 0.45);
			assert_int_equal(harness_try(run, 1), QUERN_E_NUMERIC);
			assert_non_null(strstr(run->message, "inside out"));
			harness_close(run);
		}
}

/* ==== a grid that goes with its material ==== */

/* A block that crosses a domain of 700 cells has no more blocks of the grid than it needs, wherever it has been: a step
 * costs the same at the end as at the start. */
static void grid_follows_the_block(void **state) {
	(void)state;
	bool good = true;
	table_head("blocks of the grid that a block of 16 cells has");
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [14, 0.4]},\n"
		"time: {end: 10}, output: {every: 1}, observe: [mass],\n"
		"continuum: {cell: 0.02, material: {elastic: {bulk_modulus: 100, density: 1000}},\n"
		"  fill: [{region: {box: {lower: [0.14, 0.14], upper: [0.22, 0.22]}}, velocity: [5, 0]}]}}\n");
	uint32_t most = 0, at_last = 0;
	assert_int_equal(harness_count(run, "point"), 64);
	while (quern_run_time(run) < 2.7) {
		harness_steps(run, 20);
		at_last = harness_count(run, "cell") / 64;
		most = at_last > most ? at_last : most;
	}
	good &= table_row("at most", most, 8, 8); /* it lies in four at most, which have twelve neighbours */
	good &= table_row("after 13.5 m", at_last, 12, 4);
	harness_close(run);
	assert_true(good);
}

/* A point less than half an ulp below a periodic face is brought back to the lower face, not to the upper one, which is
 * beyond the last cell. */
static void seams_keep_points_inside(void **state) {
	(void)state;
	quern_run *run =
		harness_open(1, "{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [0.8, "
						"0.8], periodic: [true, "
						"true]},\n"
						"time: {end: 1, step: 1e-4}, output: {every: 0.1},\n"
						"continuum: {cell: 0.1, material: {elastic: {bulk_modulus: 1, density: 1000}},\n"
						"  fill: [{region: {box: {lower: [0, 0], upper: [0.8, 0.8]}}}]}}\n");
	const quern_column x = harness_field(run, "point.position");
	x.real[0][0] = -1e-30, x.real[1][5] = -1e-18, x.real[0][9] = 0.8;
	harness_steps(run, 1);
	const quern_column now = harness_field(run, "point.position");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		for (int k = 0; k < 2; k++) assert_true(now.real[k][i] >= 0 && now.real[k][i] < 0.8);
	harness_close(run);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(vibrating_bar), cmocka_unit_test(damped_bar),
		cmocka_unit_test(step_with_dashpots), cmocka_unit_test(dashpots_leave_turning_out),
		cmocka_unit_test(xpic_damps_less_by_order), cmocka_unit_test(weight_at_rest),
		cmocka_unit_test(layer_at_rest), cmocka_unit_test(weight_after_ringing),
		cmocka_unit_test(thrown_and_fallen), cmocka_unit_test(lattice_is_uniform),
		cmocka_unit_test(inside_out_ends_the_run), cmocka_unit_test(grid_follows_the_block),
		cmocka_unit_test(seams_keep_points_inside) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
