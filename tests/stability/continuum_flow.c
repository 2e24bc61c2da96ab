/* SPDX-License-Identifier: MIT */
/* Material that flows, breaks apart, meets walls and other material, and material that hardly changes its volume.
 * docs/stability.md, section 2 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "beyond.h"
#include "continuum.h"
#include "harness.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double gravity = 9.81, degree = 3.14159265358979312 / 180;

/* ==== a chute ==== */

static const double slow = 0.218, fast = 0.945, number = 0.473, packed = 2004, solid = 2500, diameter = 2e-3,
					cell = 4e-3, angle = 20;
enum { DEEP = 8, ALONG = 4 };

typedef struct chute {
	const char *material, *shape, *transfer;
	double bulk;
	int points;
} chute;

static quern_run *open_chute(const chute *c) {
	const double depth = DEEP * cell, length = ALONG * cell;
	char law[300];
	if (!strcmp(c->material, "mu_i"))
		snprintf(law, sizeof law,
			"mu_i: {bulk_modulus: %g, diameter: %g, grain_density: %g, critical_density: %g, static_friction: %g, "
			"limit_friction: %g, inertial_number: %g}",
			c->bulk, diameter, solid, packed, slow, fast, number);
	else
		snprintf(law, sizeof law, "drucker_prager: {bulk_modulus: %g, density: %g, friction: %.17g}", c->bulk,
			packed, tan(angle * degree));
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [%.17g, %.17g], time: {end: 1000}, output: {every: 1000},\n"
		"domain: {lower: [0, 0], upper: [%.17g, %.17g], periodic: [true, false]},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: sticky}}],\n"
		"continuum: {cell: %g, points: %d, shape: %s, transfer: {%s}, material: {%s},\n"
		"  fill: [{region: {box: {lower: [0, 0], upper: [%.17g, %.17g]}}, stress: at_rest}]}}\n",
		gravity * sin(angle * degree), -gravity * cos(angle * degree), length, 1.5 * depth, cell, c->points,
		c->shape, c->transfer, law, length, depth);
}

/* m/s: steady flow at one inertial number (Bagnold). */
static double law_of_bagnold(double y) {
	const double depth = DEEP * cell, slope = tan(angle * degree), left = depth > y ? depth - y : 0;
	return 2.0 / 3 * number * (slope - slow) / (fast - slope) / diameter *
		   sqrt(packed / solid * gravity * cos(angle * degree)) * (depth * sqrt(depth) - left * sqrt(left));
}

static void begin_flow(quern_run *run) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) v.real[0][i] = law_of_bagnold(x.real[1][i]);
}

typedef struct noise {
	double off, across,
		pressure; /* of the velocity from the law and across the flow, of pressure from the weight: rms over rms */
} noise;

static noise noise_of(quern_run *run) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
					   s = harness_field(run, "point.stress");
	double law2 = 0, off2 = 0, across2 = 0, weight2 = 0, beside2 = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double law = law_of_bagnold(x.real[1][i]), left = DEEP * cell - x.real[1][i],
					 weight = packed * gravity * cos(angle * degree) * (left > 0 ? left : 0),
					 pressure = -0.5 * (s.real[0][i] + s.real[1][i]);
		law2 += law * law, weight2 += weight * weight;
		off2 += (v.real[0][i] - law) * (v.real[0][i] - law);
		across2 += v.real[1][i] * v.real[1][i];
		beside2 += (pressure - weight) * (pressure - weight);
	}
	return (noise) { sqrt(off2 / law2), sqrt(across2 / law2), sqrt(beside2 / weight2) };
}

/* Means of some looks in the second half of so many seconds; stops where the run does. */
static noise flow_for(quern_run *run, double time) {
	noise mean = { 0, 0, 0 };
	int n = 0;
	for (int look = 0; look < 20; look++) {
		while (run->status == QUERN_OK && quern_run_time(run) < time * (0.5 + (look + 1) / 40.0))
			harness_try(run, 1);
		if (run->status != QUERN_OK) break;
		const noise now = noise_of(run);
		mean.off += now.off, mean.across += now.across, mean.pressure += now.pressure, n++;
	}
	if (n) mean.off /= n, mean.across /= n, mean.pressure /= n;
	return mean;
}

void flow_over_step(void **unused) {
	(void)unused;
	static const double factors[] = { 0.25, 0.5, 0.9, 1, 1.25, 1.5, 1.75, 2, 2.5, 3 };
	static const chute rows[] = { { "mu_i", "gimp", "apic", 1e5, 2 },
		{ "mu_i", "gimp", "picflip: {rate: 0}", 1e5, 2 }, { "drucker_prager", "gimp", "apic", 1e5, 2 },
		{ "drucker_prager", "gimp", "picflip: {rate: 0}", 1e5, 2 } };
	beyond_table("A layer of eight cells that flows down 20 degrees, begun with Bagnold's velocity",
		"material | transfer | step over hard limit | velocity off the law | velocity across the flow | pressure off the weight, each rms over rms | what Quern says");
	for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
		for (size_t i = 0; i < sizeof factors / sizeof *factors; i++) {
			quern_run *run = open_chute(&rows[k]);
			begin_flow(run);
			beyond_force_step(run, factors[i] * continuum_limit(run));
			const noise n = flow_for(run, 1);
			beyond_row("%s | %s | %g | %.2g | %.2g | %.2g | %s", rows[k].material, rows[k].transfer,
				factors[i], n.off, n.across, n.pressure, beyond_message(run));
			if (factors[i] <= 1.25 &&
				(run->status != QUERN_OK || n.off > 0.06 || n.across > 0.01 || n.pressure > 0.12))
				fail_msg("%s, %s: the flow is not what it should be", rows[k].material, rows[k].transfer);
			if (factors[i] >= 3) beyond_expect_culprit(run, "mpm.gather", "point");
			harness_close(run);
		}
}

void stiff_flow(void **unused) {
	(void)unused;
	static const char *const shapes[] = { "linear", "gimp", "bspline" };
	beyond_table("The same layer, ever stiffer: flow that hardly changes its volume",
		"shape | points per cell and axis | bulk modulus over the floor's pressure | velocity off the law | across the flow | pressure off the weight");
	for (int k = 0; k < 3; k++)
		for (int points = 1; points <= 4; points++)
			for (double bulk = 1e5; bulk < 2e7; bulk *= 10) {
				const chute c = { "mu_i", shapes[k], "apic", bulk, points };
				quern_run *run = open_chute(&c);
				begin_flow(run);
				const noise n = flow_for(run, beyond_is_long() ? 0.5 : 0.1);
				beyond_row("%s | %d | %.2g | %.2g | %.2g | %.2g", shapes[k], points,
					bulk / (packed * gravity * cos(angle * degree) * DEEP * cell), n.off, n.across,
					n.pressure);
				if (k == 1 && points > 1 && (n.off > 0.02 || n.pressure > 0.12))
					fail_msg("a stiff flow is off by %g", n.off);
				harness_close(run);
			}
}

/* ==== a column that slumps ==== */

/* A metre high and half as wide, on a sticky floor, ever stiffer: a flow across cells that keeps its volume. */
static quern_run *open_slump(const char *shape, int points, double bulk) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [3, 1.2]}, time: {end: 1000},\n"
		"output: {every: 1000}, bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: sticky}}],\n"
		"continuum: {cell: 0.05, points: %d, shape: %s, material: {drucker_prager: {bulk_modulus: %g, density: 1500, friction: 0.4}},\n"
		"  fill: [{region: {box: {lower: [0, 0], upper: [0.5, 1]}}, stress: at_rest}]}}\n",
		points, shape, bulk);
}

/* Of the points' pressure about the mean of their cell, over the mean of all. */
static double cell_noise(quern_run *run, double h) {
	enum { WIDE = 128, MOST = WIDE * WIDE };
	static double sum[MOST];
	static int count[MOST];
	const quern_column x = harness_field(run, "point.position"), s = harness_field(run, "point.stress");
	const uint32_t n = harness_count(run, "point");
	double square = 0, mean = 0;
	memset(sum, 0, sizeof sum), memset(count, 0, sizeof count);
	for (int pass = 0; pass < 2; pass++)
		for (uint32_t i = 0; i < n; i++) {
			const int c = (int)(x.real[1][i] / h) * WIDE + (int)(x.real[0][i] / h);
			const double p = -0.5 * (s.real[0][i] + s.real[1][i]);
			assert_true(c >= 0 && c < MOST);
			if (!pass) sum[c] += p, count[c]++, mean += p / n;
			else square += pow(p - sum[c] / count[c], 2) / n;
		}
	return sqrt(square) / mean;
}

void stiff_slump(void **unused) {
	(void)unused;
	static const char *const shapes[] = { "linear", "gimp", "bspline" };
	beyond_table("A column that slumps, ever stiffer: where it is after 0.4 s",
		"shape | points per cell and axis | bulk modulus over rho g H | fallen, of its middle, mm | front, m | scatter of pressure within cells over the mean");
	for (int k = 0; k < 3; k++)
		for (int points = 1; points <= 3; points++) {
			double soft = 0;
			for (double bulk = 1e6; bulk < (beyond_is_long() ? 2e8 : 2e7); bulk *= 10) {
				quern_run *run = open_slump(shapes[k], points, bulk);
				double fallen = 0.5, front = 0;
				harness_until(run, 0.4);
				const quern_column x = harness_field(run, "point.position");
				const uint32_t n = harness_count(run, "point");
				for (uint32_t i = 0; i < n; i++)
					fallen -= x.real[1][i] / n, front = fmax(front, x.real[0][i]);
				beyond_row("%s | %d | %.2g | %.1f | %.3f | %.2g", shapes[k], points, bulk / (1500 * gravity),
					1e3 * fallen, front, cell_noise(run, 0.05));
				if (!(soft > 0)) soft = fallen;
				if (k && points > 1 && fabs(fallen / soft - 1) > 0.05)
					fail_msg("%s: stiff sand falls otherwise", shapes[k]);
				harness_close(run);
			}
		}
}

/* ==== layers of one cell ==== */

typedef struct layer {
	const char *name, *law;
	double deep;  /* cells */
	double angle; /* degrees */
	int points;
} layer;

static quern_run *open_layer(const layer *l) {
	const double turn = l->angle * degree, length = ALONG * cell;
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [%.17g, %.17g], time: {end: 1000}, output: {every: 1000, fields: "
		"[body.impulse]},\n"
		"domain: {lower: [0, 0], upper: [%.17g, %.17g], periodic: [true, false]},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: {frictional: 0.4}}}],\n"
		"continuum: {cell: %g, points: %d, transfer: apic, material: {%s},\n"
		"  fill: [{region: {box: {lower: [0, 0], upper: [%.17g, %.17g]}}, stress: at_rest}]}}\n",
		gravity * sin(turn), -gravity * cos(turn), length, 4 * cell, cell, l->points, l->law, length,
		l->deep * cell);
}

static double mean_of(quern_run *run, const char *field, int axis) {
	const quern_column c = harness_field(run, field);
	const uint32_t n = harness_count(run, "point");
	double sum = 0;
	for (uint32_t i = 0; i < n; i++) sum += c.real[axis][i] / n;
	return sum;
}

/* Rests below the angle of friction, and slides as a block above it. */
static void layer_row(const layer *l, double until) {
	const double turn = l->angle * degree, pull = gravity * (sin(turn) - 0.4 * cos(turn));
	quern_run *run = open_layer(l);
	const double before = mean_of(run, "point.position", 1);
	harness_until(run, 0.25 * until);
	const double from = quern_run_time(run), early = harness_field(run, "body.impulse").real[1][0];
	harness_until(run, until);
	const double to = quern_run_time(run), late = harness_field(run, "body.impulse").real[1][0],
				 weight = quern_run_carries(run, "mass") * gravity * cos(turn),
				 push = fabs(late - early) / weight / (to - from),
				 depth = mean_of(run, "point.position", 1) / before,
				 speed = mean_of(run, "point.velocity", 0);
	beyond_row("%s | %g | %g | %d | %.4f | %.3f | %.3g | %.3g", l->name, l->deep, l->angle, l->points, push,
		depth, speed, fmax(pull, 0) * to);
	if (fabs(push - 1) > 2e-3 || fabs(depth - 1) > 0.03 ||
		fabs(speed - fmax(pull, 0) * to) > 0.01 * fabs(pull) * to)
		fail_msg("%s, %g cells deep at %g degrees", l->name, l->deep, l->angle);
	harness_close(run);
}

void thin_layers(void **unused) {
	(void)unused;
	static const layer laws[] = {
		{ "drucker_prager", "drucker_prager: {bulk_modulus: 1e5, density: 2004, friction: 0.4}", 0, 0, 0 },
		{ "mu_i",
			"mu_i: {bulk_modulus: 1e5, diameter: 2e-3, grain_density: 2500, critical_density: 2004, static_friction: "
			"0.4, limit_friction: 0.945, inertial_number: 0.473}",
			0, 0, 0 }
	};
	static const double deep[] = { 0.5, 1, 2 }, angles[] = { 15, 27 };
	beyond_table("Thin layers on a slope, friction 0.4 within and of the floor",
		"material | cells deep | slope, degrees | points per cell and axis | floor's push over weight | depth after over before | speed, m/s | of a block that slides");
	for (int m = 0; m < 2; m++)
		for (int d = 0; d < 3; d++)
			for (int a = 0; a < 2; a++)
				for (int points = deep[d] < 1 ? 2 : 1; points <= 2; points++) {
					const layer l = { laws[m].name, laws[m].law, deep[d], angles[a], points };
					layer_row(&l, beyond_is_long() ? 2 : 0.5);
				}
}

/* ==== apart and together ==== */

static const char *const sands[] = { "drucker_prager: {bulk_modulus: 1e6, density: 1500}",
	"mu_i: {bulk_modulus: 1e6, diameter: 5e-3, grain_density: 2450, critical_density: 1500}" };

/* A block of one metre between slip walls is pulled apart in flight, v = 4.4 y, and falls back: its height is what it was. */
static void toss_row(int sand, const char *shape, const char *transfer) {
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [0.4, 3]}, time: {end: 1000},\n"
		"output: {every: 1000}, bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: sticky}}],\n"
		"continuum: {cell: 0.1, shape: %s, transfer: {%s}, material: {%s},\n"
		"  fill: [{region: {box: {lower: [0, 0], upper: [0.4, 1]}}}]}}\n",
		shape, transfer, sands[sand]);
	const uint32_t n = harness_count(run, "point");
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	double most = 0;
	for (uint32_t i = 0; i < n; i++) v.real[1][i] = 4.4 * x.real[1][i];
	for (int look = 1; look <= 40; look++) {
		harness_until(run, 0.1 * look);
		most = fmax(most, mean_of(run, "point.volume", 0) * n / 0.4);
	}
	const double height = 2 * mean_of(run, "point.position", 1);
	beyond_row("%s | %s | %s | %.2f | %.3f", sand ? "mu_i" : "drucker_prager", shape, transfer, most, height);
	if (most < 1.5 || fabs(height - 1) > 0.05) fail_msg("%s, %s: %g m high", shape, transfer, height);
	harness_close(run);
}

void thrown_apart(void **unused) {
	(void)unused;
	static const char *const shapes[] = { "gimp", "bspline", "linear" };
	static const char *const transfers[] = { "picflip: {rate: 0}", "picflip: {rate: 3}", "apic",
		"xpic: {order: 2}", "xpic: {order: 5}" };
	beyond_table("Pulled apart in flight and fallen back",
		"material | shape | transfer | largest volume over the first | height over the first");
	for (int m = 0; m < 2; m++)
		for (int k = 0; k < 3; k++)
			for (int t = 0; t < 5; t++) toss_row(m, shapes[k], transfers[t]);
}

/* ==== walls that are hit ==== */

/* A block of 0.4 m flies along x into the face of a closed domain, without weight, and off again; other faces are too far away to be met. */
static quern_run *open_impact(const char *law, const char *transfer, double speed) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [6, 27]}, time: {end: 1000},\n"
		"output: {every: 1000, fields: [total.faces, point.energy]},\n"
		"continuum: {cell: 0.05, transfer: {%s}, material: {%s},\n"
		"  fill: [{region: {box: {lower: [0.1, 13.3], upper: [0.5, 13.7]}}, velocity: [%g, 0]}]}}\n",
		transfer, law, -speed);
}

static const struct {
	const char *name, *law;
	double bulk;
} targets[] = { { "elastic", "elastic: {bulk_modulus: 1e6, poisson: 0.3, density: 1500}", 1e6 },
	{ "elastic", "elastic: {bulk_modulus: 1e7, poisson: 0.3, density: 1500}", 1e7 },
	{ "drucker_prager", "drucker_prager: {bulk_modulus: 1e6, density: 1500}", 1e6 },
	{ "drucker_prager", "drucker_prager: {bulk_modulus: 1e7, density: 1500}", 1e7 },
	{ "mu_i", "mu_i: {bulk_modulus: 1e6, diameter: 5e-3, grain_density: 2450, critical_density: 1500}", 1e6 },
	{ "mu_i", "mu_i: {bulk_modulus: 1e7, diameter: 5e-3, grain_density: 2450, critical_density: 1500}",
		1e7 } };
enum { TARGETS = sizeof targets / sizeof *targets, SANDS = 2 };

static double densest(quern_run *run) {
	const quern_column volume = harness_field(run, "point.volume"), mass = harness_field(run, "point.mass");
	double most = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		most = fmax(most, mass.real[0][i] / volume.real[0][i]);
	return most;
}

/* Whether all points are more than a cell from the faces that are not to be hit. */
static bool is_free(quern_run *run) {
	const quern_column x = harness_field(run, "point.position");
	bool free = true;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		free &= x.real[0][i] < 6 - 0.05 && x.real[1][i] > 0.05 && x.real[1][i] < 27 - 0.05;
	return free;
}

/* Sand gains no energy, slower than its waves it goes on, and momentum is what the wall gave. An elastic law in rates knows no energy under such strains. */
static void impact_row(int m, double speed, const char *transfer) {
	quern_run *run = open_impact(targets[m].law, transfer, speed);
	const double mass = quern_run_carries(run, "mass"), first = quern_run_carries(run, "kinetic"),
				 before = quern_run_carries(run, "momentum_x"),
				 wave = continuum_wave(targets[m].bulk, 1500, 2);
	double dense = 0, most = 0;
	for (int look = 1; look <= 100 && run->status == QUERN_OK; look++) {
		while (run->status == QUERN_OK && quern_run_time(run) < 0.05 * look / speed) harness_try(run, 1);
		dense = fmax(dense, densest(run) / 1500);
		most = fmax(most, (quern_run_carries(run, "kinetic") + quern_run_carries(run, "elastic")) / first);
	}
	const double gap =
		quern_run_carries(run, "momentum_x") - before - harness_field(run, "total.faces").real[0][0];
	const bool told = harness_field(run, "total.watch_pressed").index[0];
	beyond_row("%s, %g MPa | %g | %.2g | %s | %.3g | %.2g | %.3g | %.1g | %s", targets[m].name,
		1e-6 * targets[m].bulk, speed, speed / wave, transfer, dense,
		quern_run_carries(run, "kinetic") / first, most, fabs(gap) / (mass * speed),
		told && run->status == QUERN_OK ? "warns of its density" : beyond_message(run));
	/* a point now and then is denser for longer than twenty steps, a hundredth of all not before 1.6 */
	if ((run->status == QUERN_OK && dense > 1.6 && !told) || (dense < 1.25 && told))
		fail_msg("%s at %g m/s, %g times its density", targets[m].law, speed, dense);
	if (!is_free(run)) fail_msg("%s at %g m/s meets another face", targets[m].law, speed);
	if (fabs(gap) > 1e-12 * mass * speed || most > (m < SANDS ? 1.15 : 1 + 1e-9) ||
		(speed < wave && run->status != QUERN_OK))
		fail_msg("%s at %g m/s with %s: %s", targets[m].law, speed, transfer, beyond_message(run));
	harness_close(run);
}

void impacts(void **unused) {
	(void)unused;
	static const char *const transfers[] = { "picflip: {rate: 0}", "picflip: {rate: 30}", "apic",
		"xpic: {order: 2}" };
	beyond_table("A block of eight cells that hits a wall",
		"material, bulk modulus | m/s | over the wave's | transfer | densest point over density | kinetic energy after over before | the most of it and of elastic energy | gap of momentum | what Quern says");
	for (int m = 0; m < TARGETS; m++)
		for (double speed = 10; speed <= 40; speed *= 4)
			for (int t = 0; t < 4; t++) impact_row(m, speed, transfers[t]);
}
