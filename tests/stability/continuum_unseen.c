/* SPDX-License-Identifier: MIT */
/* What the grid does not see: points that cross its cells, motion and pressure below it, a point that only just reaches a
 * node. docs/stability.md, section 2 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "beyond.h"
#include "continuum.h"
#include "harness.h"
#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979312, cell = 0.1, bulk = 1e6, density = 1500;

typedef struct setting {
	const char *shape, *transfer;
} setting;

/* A periodic plane of ten cells by four, full of points that have no weight. */
static quern_run *open_plane(const setting *c, double modulus, double full, double step, bool watched) {
	char word[40];
	if (step > 0) snprintf(word, sizeof word, ", step: %g", step);
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [1, 0.4], periodic: [true, true]},\n"
		"time: {end: 1000%s}, output: {every: 1000},\n"
		"continuum: {cell: %g, shape: %s, transfer: {%s}%s,\n"
		"  material: {elastic: {bulk_modulus: %g, poisson: 0.3, density: 1500}},\n"
		"  fill: [{region: {box: {lower: [0, 0], upper: [%.17g, 0.4]}}}]}}\n",
		step > 0 ? word : "", cell, c->shape, c->transfer, watched ? "" : ", gain: 0", modulus, full);
}

/* ==== cells that are crossed ==== */

/* Columns of points 5/9 of a cell apart under one pressure, in uniform motion: nothing ever happens to them, but cells
 * hold now two columns and now one. */
static quern_run *open_crossing(const setting *c, double pressure, double speed, bool watched) {
	quern_run *run = open_plane(c, bulk, 0.9, 0, watched);
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
					   m = harness_field(run, "point.mass"), volume = harness_field(run, "point.volume"),
					   s = harness_field(run, "point.stress");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		x.real[0][i] /= 0.9, m.real[0][i] /= 0.9, volume.real[0][i] /= 0.9;
		s.real[0][i] = s.real[1][i] = -pressure;
		v.real[0][i] = speed;
	}
	harness_field(run, "total.unsorted").index[0] = 1;
	return run;
}

/* Over the wave speed. */
static double velocity_noise(quern_run *run, double mean) {
	const quern_column v = harness_field(run, "point.velocity");
	const uint32_t n = harness_count(run, "point");
	double sum = 0;
	for (uint32_t i = 0; i < n; i++) sum += pow(v.real[0][i] - mean, 2) + v.real[1][i] * v.real[1][i];
	return sqrt(sum / n) / continuum_wave(bulk, density, 2);
}

void cell_crossing(void **unused) {
	(void)unused;
	static const setting settings[] = { { "linear", "picflip: {rate: 0}" },
		{ "linear", "picflip: {rate: 30}" }, { "linear", "apic" }, { "gimp", "picflip: {rate: 0}" },
		{ "gimp", "picflip: {rate: 30}" }, { "gimp", "apic" }, { "bspline", "picflip: {rate: 0}" },
		{ "bspline", "picflip: {rate: 30}" }, { "bspline", "apic" } };
	const double pressure = 0.01 * bulk, speed = 0.02 * continuum_wave(bulk, density, 2),
				 cells = beyond_is_long() ? 40 : 10;
	double worst[9];
	beyond_table("Cells that are crossed: points 5/9 of a cell apart, under one pressure, in uniform motion",
		"shape | transfer | cells crossed | scatter of pressure over pressure | velocities that should be none, over the wave's | what Quern says");
	for (int k = 0; k < 9; k++) {
		quern_run *run = open_crossing(&settings[k], pressure, speed, false);
		double motion = 0;
		worst[k] = 0;
		for (int part = 1; part <= 27; part++) { /* anywhere in a cell */
			harness_until(run, part / 27.0 * cells * cell / speed);
			worst[k] = fmax(worst[k], continuum_pressure(run).rms / pressure);
			motion = fmax(motion, velocity_noise(run, speed));
		}
		harness_close(run);
		run = open_crossing(&settings[k], pressure, speed, true);
		while (quern_run_time(run) < cells * cell / speed && harness_try(run, 1) == QUERN_OK) {}
		beyond_row("%s | %s | %g | %.2g | %.2g | %s", settings[k].shape, settings[k].transfer, cells,
			worst[k], motion, beyond_message(run));
		/* hats with apic make energy at every crossing; nothing else does */
		if (k == 2 && beyond_is_long()) beyond_expect_culprit(run, "mpm.watch", "makes energy");
		else assert_int_equal(run->status, QUERN_OK);
		harness_close(run);
	}
	for (int k = 3; k < 9; k++)
		if (worst[k] > 0.05 || worst[k] > 0.25 * worst[k - (k < 6 ? 3 : 6)])
			fail_msg("%s, %s: pressure scatters by %g", settings[k].shape, settings[k].transfer, worst[k]);
}

/* ==== motion that no node sees ==== */

static const setting transfers[] = { { "gimp", "picflip: {rate: 0}" }, { "gimp", "picflip: {rate: 3}" },
	{ "gimp", "picflip: {rate: 30}" }, { "gimp", "picflip: {flip: 0.95}" },
	{ "gimp", "picflip: {rate: 1e300}" }, { "gimp", "apic" }, { "gimp", "xpic: {order: 2}" },
	{ "gimp", "xpic: {order: 5}" } };
enum { TRANSFERS = sizeof transfers / sizeof *transfers };

/* Columns of points that go up and down in turn: at every node they cancel. */
void unseen_motion(void **unused) {
	(void)unused;
	static const double rates[TRANSFERS] = { 0, 3, 30, -1, INFINITY, INFINITY, INFINITY, INFINITY };
	const double speed = 1e-3, step = 1e-3;
	beyond_table("Motion that no node sees: columns of points that go up and down in turn",
		"transfer | velocity kept after one step of 1 ms | after 100 steps | should be");
	for (int k = 0; k < TRANSFERS; k++) {
		quern_run *run = open_plane(&transfers[k], bulk, 1, step, true);
		quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
		for (uint32_t i = 0; i < harness_count(run, "point"); i++)
			v.real[1][i] = (int)floor(2 * x.real[0][i] / cell) % 2 ? speed : -speed;
		const double before = quern_run_carries(run, "kinetic");
		harness_steps(run, 1);
		const double once = sqrt(quern_run_carries(run, "kinetic") / before);
		harness_steps(run, 99);
		const double kept = sqrt(quern_run_carries(run, "kinetic") / before),
					 asked = rates[k] < 0 ? pow(0.95, 100) : exp(-rates[k] * 100 * step);
		beyond_row("%s | %.4g | %.4g | %.4g", transfers[k].transfer, once, kept, asked);
		if (fabs(kept - asked) > 1e-9) fail_msg("%s keeps %g, not %g", transfers[k].transfer, kept, asked);
		harness_close(run);
	}
}

/* Every point its own velocity: what the grid sees of it becomes waves, what it does not see stays what the transfer makes of it. */
void random_motion(void **unused) {
	(void)unused;
	static const int looks[] = { 1, 10, 100, 1000, 10000 };
	const int n = beyond_is_long() ? 5 : 4;
	const double speed = 1e-3 * continuum_wave(bulk, density, 2);
	beyond_table("Random velocities of points in a periodic plane",
		"transfer | kinetic energy over the first after 1 step | 10 | 100 | 1000 | 10000 | scatter of pressure over rho c v at the end");
	for (int k = 0; k < TRANSFERS; k++) {
		quern_run *run = open_plane(&transfers[k], bulk, 1, 0, true);
		const quern_column v = harness_field(run, "point.velocity");
		uint64_t state = 14;
		char kept[5][16] = { "", "", "", "", "" };
		double last = 1;
		for (uint32_t i = 0; i < harness_count(run, "point"); i++)
			for (int a = 0; a < 2; a++) v.real[a][i] = speed * (2 * continuum_drawn(&state) - 1);
		const double before = quern_run_carries(run, "kinetic");
		for (int look = 0, step = 0; look < n; step = looks[look++]) {
			harness_steps(run, looks[look] - step);
			last = quern_run_carries(run, "kinetic") / before;
			snprintf(kept[look], sizeof kept[look], "%.2g", last);
			if (last > 1) fail_msg("%s: random motion gains energy, %g", transfers[k].transfer, last);
		}
		beyond_row("%s | %s | %s | %s | %s | %s | %.2g", transfers[k].transfer, kept[0], kept[1], kept[2],
			kept[3], kept[4],
			continuum_pressure(run).rms / (density * continuum_wave(bulk, density, 2) * speed / sqrt(1.5)));
		harness_close(run);
	}
}

/* ==== a point that only just reaches a node ==== */

typedef struct reach {
	const char *shape, *cut;
	double far; /* cells from the point to the farthest node that it reaches */
} reach;

/* One point alone in a wide grid, under pressure, its farthest nodes `deep` cells within its reach. */
static quern_run *open_lone(const reach *r, double deep, double pressure) {
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [1, 1]},\n"
		"time: {end: 1000}, output: {every: 1000, fields: [total.faces]},\n"
		"continuum: {cell: %g, shape: %s, cut: %s, transfer: {picflip: {rate: 0}},\n"
		"  material: {elastic: {bulk_modulus: 1e6, poisson: 0.3, density: 1500}},\n"
		"  fill: [{region: {box: {lower: [0.5, 0.5], upper: [0.55, 0.55]}}}]}}\n",
		cell, r->shape, r->cut);
	assert_int_equal(harness_count(run, "point"), 1);
	const quern_column x = harness_field(run, "point.position"), s = harness_field(run, "point.stress");
	for (int a = 0; a < 2; a++) x.real[a][0] = (5 + r->far - deep) * cell, s.real[a][0] = -pressure;
	harness_field(run, "total.unsorted").index[0] = 1;
	return run;
}

void lone_point(void **unused) {
	(void)unused;
	static const reach reaches[] = { { "linear", "1e-12", 1 }, { "linear", "0.0625", 1 },
		{ "gimp", "1e-12", 1.25 }, { "gimp", "1e-3", 1.25 }, { "bspline", "1e-12", 1.5 },
		{ "bspline", "1e-3", 1.5 } };
	const double pressure = 1e-3 * bulk;
	beyond_table("A lone point under a pressure of K/1000, one recommended step",
		"shape, cut | 1e-9 of a cell within the reach of a node: volume after over before, less one | velocity gained over the wave's | worst of all depths, 1e-12 to 0.1 | what Quern says");
	for (int k = 0; k < 6; k++) {
		double worst = 0, first = 0, speed = 0;
		char said[200] = "runs on";
		for (int d = -12; d <= -1; d++) {
			quern_run *run = open_lone(&reaches[k], pow(10, d), pressure);
			const double before = harness_field(run, "point.volume").real[0][0];
			harness_try(run, 1);
			if (!k && d == -9) beyond_expect_culprit(run, "mpm.gather", "point");
			else if (k && run->status != QUERN_OK) fail_msg("%s: %s", reaches[k].shape, beyond_message(run));
			if (d == -9) snprintf(said, sizeof said, "%s", beyond_message(run));
			const quern_column v = harness_field(run, "point.velocity");
			const double grown = harness_field(run, "point.volume").real[0][0] / before - 1,
						 fast = hypot(v.real[0][0], v.real[1][0]) / continuum_wave(bulk, density, 2);
			if (d == -9) first = grown, speed = fast;
			worst = fmax(worst, fabs(grown));
			if (k && (fabs(grown) > 0.01 || fast > 1e-3))
				fail_msg("%s: a lone point is thrown", reaches[k].shape);
			harness_close(run);
		}
		beyond_row(
			"%s, %s | %.2g | %.2g | %.2g | %s", reaches[k].shape, reaches[k].cut, first, speed, worst, said);
	}
}

/* ==== a share of PIC is a viscosity ==== */

/* Share of a wave with k waves in a cell that points a quarter and three quarters of a cell from nodes keep in a round trip: the
 * eigenvalue of the pair of waves that nodes cannot tell apart. */
static double round_trip(const char *shape, double k) {
	static const double weights[2][3] = { { 0.75, 0.25, 0 }, { 0.6875, 0.28125, 0.03125 } };
	const double *w = weights[strcmp(shape, "bspline") == 0], turn = 2 * pi * k / 4;
	double seen = 0, alias = 0;
	for (int j = 0; j < 3; j++) {
		seen += w[j] * cos((2 * j + 1) * turn);
		alias += w[j] * cos((2 * j + 1) * (turn - 0.5 * pi));
	}
	return seen * seen + alias * alias;
}

/* Of a velocity across the plane that varies along it as sin x. */
static double amplitude(quern_run *run) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	const uint32_t n = harness_count(run, "point");
	double sum = 0;
	for (uint32_t i = 0; i < n; i++) sum += 2 * v.real[1][i] * sin(2 * pi * x.real[0][i]) / n;
	return sum;
}

/* 1/s: at which a wave of ten cells dies out that no stress drives, once it is what a round trip leaves in its form. */
static double decay(const setting *c, double step) {
	quern_run *run = open_plane(c, 1e-6, 1, step, true);
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		v.real[1][i] = 1e-3 * sin(2 * pi * x.real[0][i]);
	const int steps = (int)(0.2 / step + 0.5);
	harness_steps(run, steps);
	const double before = amplitude(run);
	harness_steps(run, steps);
	const double after = amplitude(run);
	harness_close(run);
	return log(before / after) / (steps * step);
}

/* A step keeps 1 - taken of a wave of which a round trip keeps 1 - unseen. */
typedef struct damping {
	setting c;
	double rate, share; /* of PIC, 1/s and in a step */
	int order;          /* of XPIC; 0: of neither, nothing is taken */
} damping;

static double taken(const damping *d, double step, double unseen) {
	if (d->order) return pow(unseen, d->order);
	return (d->share > 0 ? d->share : 1 - exp(-d->rate * step)) * unseen;
}

void share_as_viscosity(void **unused) {
	(void)unused;
	static const damping rows[] = { { { "gimp", "picflip: {rate: 3}" }, 3, 0, 0 },
		{ { "gimp", "picflip: {rate: 30}" }, 30, 0, 0 }, { { "bspline", "picflip: {rate: 30}" }, 30, 0, 0 },
		{ { "gimp", "picflip: {flip: 0.95}" }, 0, 0.05, 0 }, { { "gimp", "xpic: {order: 2}" }, 0, 0, 2 },
		{ { "gimp", "xpic: {order: 5}" }, 0, 0, 5 }, { { "bspline", "xpic: {order: 2}" }, 0, 0, 2 },
		{ { "gimp", "picflip: {rate: 0}" }, 0, 0, 0 }, { { "gimp", "apic" }, 0, 0, 0 } };
	static const double steps[] = { 1e-3, 2.5e-4 };
	const double wave = 2 * pi;
	beyond_table(
		"A share of PIC is a viscosity: a wave of ten cells, across its direction, that no stress drives",
		"shape | transfer | step, ms | viscosity, mm^2/s | by the formula | over r h^2");
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
		for (int k = 0; k < 2; k++) {
			const double found = decay(&rows[i].c, steps[k]) / (wave * wave),
						 asked = -log1p(-taken(&rows[i], steps[k], 1 - round_trip(rows[i].c.shape, cell))) /
								 steps[k] / (wave * wave);
			char over[16] = "";
			if (rows[i].rate > 0) snprintf(over, sizeof over, "%.3f", found / (rows[i].rate * cell * cell));
			beyond_row("%s | %s | %g | %.4g | %.4g | %s", rows[i].c.shape, rows[i].c.transfer, 1e3 * steps[k],
				1e6 * found, 1e6 * asked, over);
			if (fabs(found - asked) > 2e-3 * asked + 1e-9)
				fail_msg("%s: %g, not %g", rows[i].c.transfer, found, asked);
		}
}
