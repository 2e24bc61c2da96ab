/* SPDX-License-Identifier: MIT */
/* Grains on the corners of bodies: they roll over outer ones without a kick, rest in inner ones, touch both faces there, and swing
 * in a drum. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "ask_body.h"
#include "harness.h"
#include "table.h"
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979312;

/* ==== over a corner ==== */

typedef struct passing {
	double energy, off,
		time;     /* worst error of energy over what falls; worst distance from the path over R; s */
	double speed; /* m/s, at the end */
} passing;

static const double size = 5e-3, gravity = 9.81, start = 0.1; /* m, m/s^2, m/s */

/* The energy of the grain on a spring of that stiffness. */
static double energy_of(quern_run *run, double stiffness, double mass) {
	const quern_column x = harness_field(run, "grain.position"), v = harness_field(run, "grain.velocity");
	double n[3];
	const double deep = fmax(0, size - ask(run, NULL, (place) { { x.real[0][0], x.real[1][0], 0 } }, n));
	return 0.5 * mass * (pow(v.real[0][0], 2) + pow(v.real[1][0], 2)) + mass * gravity * x.real[1][0] +
		   0.5 * stiffness * deep * deep;
}

/* Along a level edge to a corner at the origin where the outline falls by the angle; from 1 mm before it until the
 * centre is as far beyond it along the next edge. */
static passing pass(double angle, double friction) {
	const double mass = 2500 * pi * size * size, stiffness = 1e7, rest = mass * gravity / stiffness;
	const double c = cos(angle), s = sin(angle);
	passing p = { 0 };
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [-1, -1], upper: [1, 1]}, time: {end: "
		"1},\n"
		"output: {every: 1}, bodies: [polygon: {vertices: [[-0.1, 0], [-0.1, -0.3], [%.17g, %.17g], [0, "
		"0]]}],\n"
		"grains: {material: {density: 2500, radius: {mean: 5 mm}}, contact: {linear: {stiffness: 1e7, "
		"restitution: 1, "
		"friction: %g}}, integrator: velocity_verlet,\n"
		"  place: [{position: [-0.001, %.17g], velocity: [%.17g, 0], spin: [%.17g, 0]}]}}\n",
		0.1 * c, -0.1 * s, friction, size - rest, start, friction > 0 ? -start / size : 0);
	const double before = energy_of(run, stiffness, mass), falls = mass * gravity * size;
	double entered = -1, left = -1;
	for (int k = 0; k < 200000; k++) {
		harness_steps(run, 1);
		const quern_column at = harness_field(run, "grain.position"),
						   v = harness_field(run, "grain.velocity");
		const double x = at.real[0][0], y = at.real[1][0], along = c * x - s * y, out = s * x + c * y;
		const double far = x < 0 ? y : along > 0 ? out : hypot(x, y);
		const double time = (double)run->clock.step * run->clock.dt;
		if (x >= 0 && entered < 0) entered = time - x / v.real[0][0];
		if (along >= 0 && left < 0) left = time - along / (c * v.real[0][0] - s * v.real[1][0]);
		p.off = fmax(p.off, fabs(far / size - 1));
		if (!(friction > 0))
			p.energy = fmax(p.energy, fabs(energy_of(run, stiffness, mass) - before) / falls);
		p.speed = hypot(v.real[0][0], v.real[1][0]);
		if (along > 1e-3) break;
	}
	p.time = left - entered;
	harness_close(run);
	return p;
}

/* Of turning about the corner: R phi' = sqrt(v^2 + 2 b g R (1 - cos phi)), b = 1 sliding, 2/3 rolling; by Simpson's
 * rule. */
static double time_about(double angle, double share) {
	enum { N = 1000 };
	double sum = 0;
	for (int i = 0; i <= N; i++) {
		const double phi = angle * i / N,
					 v = sqrt(start * start + 2 * share * gravity * size * (1 - cos(phi)));
		sum += (i == 0 || i == N ? 1 : i % 2 ? 4 : 2) * size / v;
	}
	return sum * angle / (3 * N);
}

static void over_corners(void **state) {
	(void)state;
	bool good = true;
	char what[80];
	for (int rolls = 0; rolls <= 1; rolls++) {
		const double share = rolls ? 2.0 / 3 : 1;
		table_head(rolls ? "a disc that rolls over an outer corner"
						 : "a disc that slides over an outer corner without friction");
		for (int degrees = 10; degrees <= 30; degrees += 10) {
			const double angle = degrees * pi / 180;
			const passing p = pass(angle, rolls ? 0.8 : 0);
			const double fall = size * (1 - cos(angle)) + 1e-3 * sin(angle);
			snprintf(what, sizeof what, "%d degrees: time about the corner, s", degrees);
			good &= table_row(what, p.time, time_about(angle, share), 2e-4 * p.time);
			good &= table_row("  off the path, of the radius", p.off, 0, 2e-4);
			good &= table_row("  speed beyond it, m/s", p.speed,
				sqrt(start * start + 2 * share * gravity * fall), rolls ? 2e-3 * start : 2e-4);
			if (!rolls) good &= table_row("  energy lost, of m g R", p.energy, 0, 1e-6);
		}
	}
	assert_true(good);
}

/* ==== at rest in an inner corner ==== */

/* Faces at these angles to the level, left and right; forces from the equilibrium of three forces in a plane. */
static const double left_angle = 30, right_angle = 50;

static bool rest_in(const char *title, const char *bodies, bool features_too) {
	const double mass = 2500 * pi * size * size, a = left_angle * pi / 180, b = right_angle * pi / 180;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [-1, -1], upper: [1, 1]}, time: {end: "
		"1},\n"
		"output: {every: 1, fields: [touch.force]}, bodies: [%s],\n"
		"grains: {material: {density: 2500, radius: {mean: 5 mm}}, contact: {linear: {stiffness: 1e6, "
		"restitution: "
		"0.1, friction: 0}},\n"
		"  place: [{position: [0.001, 0.01]}]}}\n",
		bodies);
	harness_until(run, 0.6);
	bool good = true;
	uint32_t found = 0;
	const quern_column f = harness_field(run, "touch.force");
	table_head(title);
	for (uint32_t i = 0; i < harness_count(run, "touch"); i++) {
		const double force = hypot(f.real[0][i], f.real[1][i]);
		if (!(force > 0)) continue;
		const bool left = f.real[0][i] > 0;
		const double asked = mass * gravity * sin(left ? b : a) / sin(a + b);
		good &= table_row(left ? "on the left, N" : "on the right, N", force, asked, 1e-6 * asked);
		good &= table_row("  its angle to the upright, degrees",
			atan2(fabs(f.real[0][i]), f.real[1][i]) * 180 / pi, left ? left_angle : right_angle, 1e-9);
		found++;
	}
	good &= found == 2 && harness_has(run, "touch.feature") == features_too;
	harness_close(run);
	return good;
}

static void inner_corners(void **state) {
	(void)state;
	const double a = left_angle * pi / 180, b = right_angle * pi / 180;
	char text[700];
	snprintf(text, sizeof text,
		"{segment: {from: [0, 0], to: [%.17g, %.17g]}}, {segment: {from: [%.17g, %.17g], to: [0, 0]}}",
		-0.1 * cos(a), 0.1 * sin(a), 0.1 * cos(b), 0.1 * sin(b));
	bool good = rest_in("at rest between two segments", text, false);
	snprintf(text, sizeof text,
		"polygon: {vertices: [[-0.1, -0.1], [0.1, -0.1], [%.17g, %.17g], [0, 0], [%.17g, %.17g]]}",
		0.1 * cos(b), 0.1 * sin(b), -0.1 * cos(a), 0.1 * sin(a));
	good &= rest_in("at rest in the inner corner of a polygon", text, true);
	assert_true(good);
}

/* Discs that roll with friction into an inner corner, up its wall and out again, on one polygon and on two planes: what
 * the touches remember is theirs, so that both move alike. */
static quern_run *roll(const char *bodies) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [-0.01, -0.01], upper: [0.05, 0.05]}, "
		"time: "
		"{end: 1},\n"
		"output: {every: 0.1}, bodies: [%s],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, contact: {linear: {stiffness: 1e4, "
		"friction: "
		"0.5}},\n"
		"  place: [{position: [0.004, 0.001], velocity: [-0.3, 0], spin: [300, 0]}, {position: [0.008, "
		"0.0013], "
		"velocity: [-0.3, 0], radius: 1.3 mm}, {position: [0.001, 0.003]}]}}\n",
		bodies);
}

static void inner_corner_like_planes(void **state) {
	(void)state;
	quern_run *planes =
		roll("{plane: {point: [0, 0], normal: [0, 1]}}, {plane: {point: [0, 0], normal: [1, 0]}}");
	quern_run *polygon =
		roll("polygon: {vertices: [[-0.01, -0.01], [0.05, -0.01], [0.05, 0], [0, 0], [0, 0.05], "
			 "[-0.01, 0.05]]}");
	for (int k = 0; k < 3000; k++) {
		harness_steps(planes, 1);
		harness_steps(polygon, 1);
		for (int a = 0; a < 2; a++)
			for (int i = 0; i < 3; i++) {
				assert_true(harness_field(planes, "grain.position").real[a][i] ==
							harness_field(polygon, "grain.position").real[a][i]);
				assert_true(harness_field(planes, "grain.velocity").real[a][i] ==
							harness_field(polygon, "grain.velocity").real[a][i]);
			}
	}
	harness_close(planes);
	harness_close(polygon);
}

/* Gravity aslant to the axis presses a grain onto shell and cap. */
static void drum_corner(void **state) {
	(void)state;
	const double mass = 2500 * 4 * pi / 3 * size * size * size;
	quern_run *run = harness_open(1, "{quern: 1, dimension: 3, gravity: [-3, 0, -9], domain: {lower: [-1, "
									 "-1, -1], upper: [1, 1, 1]}, time: {end: 1},\n"
									 "output: {every: 1, fields: [touch.force]}, bodies: [cylinder: {centre: "
									 "[0, 0, 0], radius: 20 mm, axis: [1, 0, "
									 "0], length: 40 mm, inside: true}],\n"
									 "grains: {material: {density: 2500, radius: {mean: 5 mm}}, contact: "
									 "{linear: {stiffness: 1e5, restitution: "
									 "0.1, friction: 0}},\n"
									 "  place: [{position: [-0.0149, 0, -0.0149]}]}}\n");
	harness_until(run, 0.3);
	bool good = true;
	uint32_t found = 0;
	const quern_column f = harness_field(run, "touch.force");
	table_head("at rest in the edge of a closed drum");
	for (uint32_t i = 0; i < harness_count(run, "touch"); i++) {
		const bool cap = f.real[0][i] > 0, shell = f.real[2][i] > 0;
		if (!cap && !shell) continue;
		found++;
		good &= cap != shell && table_row(cap ? "on the cap, N" : "on the shell, N", f.real[cap ? 0 : 2][i],
									mass * (cap ? 3 : 9), 1e-6 * mass * 9);
	}
	harness_close(run);
	assert_true(good && found == 2);
}

/* ==== in a drum ==== */

/* The period of small swings, with the next term of its series. */
static double swing(int dim, double drum, double amplitude) {
	const double arm = drum - size;
	char centre[40], lower[60], upper[60], place_text[120], body[160];
	snprintf(centre, sizeof centre, dim == 2 ? "[0, 0]" : "[0, 0, 0]");
	snprintf(lower, sizeof lower, dim == 2 ? "[-1, -1]" : "[-1, -1, -1]");
	snprintf(upper, sizeof upper, dim == 2 ? "[1, 1]" : "[1, 1, 1]");
	snprintf(place_text, sizeof place_text, dim == 2 ? "[%.17g, %.17g]" : "[%.17g, %.17g, 0]",
		arm * sin(amplitude), -arm * cos(amplitude));
	snprintf(body, sizeof body, "cylinder: {centre: %s, radius: %.17g, inside: true}", centre, drum);
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s}, time: {end: 10}, output: "
		"{every: 10},\n"
		"bodies: [%s],\ngrains: {material: {density: 2500, radius: {mean: 5 mm}}, contact: {linear: "
		"{stiffness: %g, "
		"restitution: 0.3, friction: 0}},\n"
		"  place: [{position: %s}]}}\n",
		dim, dim == 2 ? "[0, -9.81]" : "[0, -9.81, 0]", lower, upper, body, dim == 2 ? 1e6 : 1e4, place_text);
	double last = 1, first = -1, latest = 0;
	int passed = 0;
	for (int k = 0; k < 1000000 && passed < 9; k++) {
		harness_steps(run, 1);
		const double x = harness_field(run, "grain.position").real[0][0];
		const double v = harness_field(run, "grain.velocity").real[0][0];
		if (x * last < 0) {
			latest = (double)run->clock.step * run->clock.dt - x / v;
			if (first < 0) first = latest;
			passed++;
		}
		last = x;
	}
	harness_close(run);
	return (latest - first) / 4;
}

static void pendulum(void **state) {
	(void)state;
	bool good = true;
	const double drum = 0.04, amplitude = 0.03;
	const double asked = 2 * pi * sqrt((drum - size) / gravity) * (1 + amplitude * amplitude / 16);
	table_head("a grain that slides in a drum without friction");
	good &= table_row("period in 2-D, s", swing(2, drum, amplitude), asked, 2e-4 * asked);
	good &= table_row("period in 3-D, s", swing(3, drum, amplitude), asked, 2e-4 * asked);
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(over_corners), cmocka_unit_test(inner_corners),
		cmocka_unit_test(inner_corner_like_planes), cmocka_unit_test(drum_corner),
		cmocka_unit_test(pendulum) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
