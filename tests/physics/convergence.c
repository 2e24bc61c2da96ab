/* SPDX-License-Identifier: MIT */
/* The order of all integrators: a contact that swings with and without its dashpot, one that swings along a wall
 * at rest and along one that is moved, and a rebound, whose force sets in with a jump. Errors are taken at a fixed time, and the step is halved. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "scene_text.h"
#include "table.h"

static const double pi = 3.14159265358979312, radius = 5e-3, stiffness = 1e5, density = 2500, gravity = 10;
static const char *const integrators[] = { "symplectic_euler", "velocity_verlet", "position_verlet" };
enum { EULER, INTEGRATORS = 3, HALVINGS = 5 };

static double order_of(int integrator) { return integrator == EULER ? 1 : 2; }

/* -ln e = 2 zeta arccos(zeta)/sqrt(1 - zeta^2), of an underdamped contact that never pulls */
static double damping_ratio(double e) {
	double low = 0, high = 1;
	while (high - low > 1e-15) {
		const double z = 0.5 * (low + high);
		if (2 * z * acos(z) / sqrt(1 - z * z) < -log(e)) low = z;
		else high = z;
	}
	return e < 1 ? low : 0;
}

static double mass(void) { return density * pi * radius * radius; }

typedef struct contact {
	int integrator;
	double restitution, friction, along; /* along: m/s^2, of gravity along the wall */
	double overlap;                      /* at the start, over that at rest */
	double swing;                        /* m, of the wall along itself, from rest */
} contact;

static double swing_rate(void) { return 0.4 * sqrt(stiffness / mass()); } /* rad/s */

/* One disc on a plane, already in contact; `steps` steps until `end`. */
static quern_run *open_contact(const contact *c, double end, int steps) {
	const double rest = mass() * gravity / stiffness;
	char motion[160] = "";
	if (c->swing > 0)
		snprintf(motion, sizeof motion,
			", motion: {sinus: {amplitude: [%.17g, 0], frequency: %.17g, phase: -90 deg}}", c->swing,
			swing_rate() / (2 * pi));
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [%.17g, %.17g], domain: {lower: [-1, -1], upper: [1, 1]},\n"
		"time: {end: %.17g, step: %.17g}, output: {every: %.17g},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1]%s}}],\n"
		"grains: {material: {density: %.17g, radius: {mean: %.17g}}, integrator: %s,\n"
		"  contact: {linear: {stiffness: %.17g, restitution: %.17g, friction: %.17g}},\n"
		"  place: [{position: [0, %.17g]}]}}\n",
		c->along, -gravity, end, end / steps, end, motion, density, radius, integrators[c->integrator],
		stiffness, c->restitution, c->friction, radius - c->overlap * rest);
}

static double position(const contact *c, double end, int steps, int axis) {
	quern_run *run = open_contact(c, end, steps);
	harness_steps(run, steps);
	const double x = harness_field(run, "grain.position").real[axis][0];
	harness_close(run);
	return x;
}

/* Rows of errors over `scale` with ever shorter steps, and the mean order of all halvings. */
static bool orders(const char *title, const double errors[HALVINGS], double scale, double asked) {
	char what[80];
	table_head(title);
	for (int k = 0; k < HALVINGS; k++) {
		snprintf(what, sizeof what, "error, step / %d", 1 << k);
		table_note(what, errors[k] / scale);
	}
	const double order = log(errors[0] / errors[HALVINGS - 1]) / log(2) / (HALVINGS - 1);
	return table_row("observed order", order, asked, 0.1);
}

/* m x'' = k (r - x) - c x' - m g, after so many periods of w: off by what */
static double swing_off(const contact *c, double periods, int halvings) {
	const double w = sqrt(stiffness / mass()), rest = mass() * gravity / stiffness,
				 z = damping_ratio(c->restitution), wd = w * sqrt(1 - z * z), end = periods * 2 * pi / w;
	const double now = cos(wd * end) + z * w / wd * sin(wd * end),
				 exact = radius - rest - 0.5 * rest * exp(-z * w * end) * now;
	const int steps = (int)lround(100 * periods) << halvings;
	return (position(c, end, steps, 1) - exact) / (0.5 * rest * exp(-z * w * end));
}

/* Errors a quarter of a period apart, since one of them may pass through zero. */
static void swinging(void **unused) {
	(void)unused;
	bool good = true;
	char what[80];
	for (int which = 0; which < 2 * INTEGRATORS; which++) {
		const bool damped = which >= INTEGRATORS;
		const contact c = { which % INTEGRATORS, damped ? 0.5 : 1, 0, 0, 1.5, 0 };
		double errors[HALVINGS];
		for (int k = 0; k < HALVINGS; k++) errors[k] = hypot(swing_off(&c, 2.3, k), swing_off(&c, 2.55, k));
		snprintf(what, sizeof what, "%s, swinging %s dashpot, over the amplitude", integrators[c.integrator],
			damped ? "with" : "without");
		good &= orders(what, errors, 1, order_of(c.integrator));
	}
	assert_true(good);
}

/* A disc that rolls swings in its tangential spring: xi'' = g_x - x_w'' - w^2 xi with w^2 = (k_t/m)(1 + m b^2/I), m x'' = m g_x -
 * k_t xi. Either gravity along a wall at rest, or a wall that is moved by x_w = A (1 - cos W t): then xi'' + w^2 xi = -A W^2 cos W t,
 * xi = B (cos W t - cos w t) with B = -A W^2/(w^2 - W^2). */
static double rolling_to(const contact *c, double end) {
	const double lever = 1 - 0.5 * mass() * gravity / stiffness / radius, kt = stiffness / 3 / mass();
	const double w2 = kt * (1 + 2 * lever * lever), share = kt / w2, swing = share * c->along / w2,
				 w = sqrt(w2);
	const double wall = swing_rate(), forced = -c->swing * wall * wall / (w2 - wall * wall);
	/* x'' = -k_t/m xi twice integrated from rest */
	const double driven = -kt * forced * ((1 - cos(wall * end)) / (wall * wall) - (1 - cos(w * end)) / w2);
	return 0.5 * c->along * (1 - share) * end * end + swing * (1 - cos(w * end)) + driven;
}

static void rolling(void **unused) {
	(void)unused;
	bool good = true;
	char what[80];
	const double kt = stiffness / 3 / mass(), end = 2.3 * 2 * pi / sqrt(3 * kt);
	for (int which = 0; which < 2 * INTEGRATORS; which++) {
		const bool moved = which >= INTEGRATORS;
		const contact c = { which % INTEGRATORS, 1, 5, moved ? 0 : 1, 1, moved ? 1e-4 : 0 };
		const double exact = rolling_to(&c, end), scale = moved ? c.swing : c.along / (9 * kt);
		double errors[HALVINGS];
		for (int k = 0; k < HALVINGS; k++) errors[k] = fabs(position(&c, end, 230 << k, 0) - exact);
		snprintf(what, sizeof what, "%s, rolling on%s, over the amplitude", integrators[c.integrator],
			moved ? " a wall that is moved" : "");
		good &= orders(what, errors, scale, order_of(c.integrator));
	}
	assert_true(good);
}

/* ---- rebounds ---- */

enum { PHASES = 32 };

/* The worst error of restitution of discs that fall on the plane in all phases of the step. */
static double rebound_error(int integrator, double asked, double step) {
	static text t;
	double worst = 0;
	t.length = 0;
	text_add(&t, "{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [-1, -1], upper: [3, 1]},\n");
	text_add(&t, "time: {end: %.17g, step: %.17g, force: true}, output: {every: %.17g},\n", 1e4 * step, step,
		1e4 * step);
	text_add(&t, "bodies: [{plane: {point: [0, 0], normal: [0, 1]}}],\n");
	text_add(&t, "grains: {material: {density: %.17g, radius: {mean: %.17g}}, integrator: %s,\n", density,
		radius, integrators[integrator]);
	text_add(&t, "  contact: {linear: {stiffness: %.17g, restitution: %.17g, friction: 0}}, place: [",
		stiffness, asked);
	for (int k = 0; k < PHASES; k++)
		text_add(&t, "%s{position: [%.17g, %.17g], velocity: [0, -1]}", k ? ",\n" : "", 0.05 * k,
			radius + (2 + (double)k / PHASES) * step);
	text_add(&t, "]}}\n");
	quern_run *run = harness_open(1, "%s", t.data);
	harness_steps(run, 5 + (int64_t)(4 * sqrt(mass() / stiffness) / step));
	for (uint32_t i = 0; i < PHASES; i++)
		worst = fmax(worst, fabs(harness_field(run, "grain.velocity").real[1][i] - asked));
	harness_close(run);
	return worst;
}

static void rebounding(void **unused) {
	(void)unused;
	bool good = true;
	char what[80];
	for (int which = 0; which < 2 * INTEGRATORS; which++) {
		const int integrator = which % INTEGRATORS;
		const double asked = which >= INTEGRATORS ? 0.5 : 0.2, half_period = pi * sqrt(mass() / stiffness);
		double errors[HALVINGS];
		for (int k = 0; k < HALVINGS; k++)
			errors[k] = rebound_error(integrator, asked, half_period / (25 << k));
		snprintf(what, sizeof what, "%s, restitution %g, worst of %d phases", integrators[integrator], asked,
			PHASES);
		good &= orders(what, errors, 1, order_of(integrator));
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(swinging), cmocka_unit_test(rolling),
		cmocka_unit_test(rebounding) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
