/* SPDX-License-Identifier: MIT */
/* Grains on an incline: the angle at which they begin to slide, held from turning and free to roll, and how fast they
 * go below and above it. The incline is a plane across y, and gravity is turned. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "scene_text.h"
#include "table.h"

static const double radius = 5e-3, gravity = 9.81, degree = 3.14159265358979312 / 180;

typedef struct incline {
	uint32_t dim;
	bool hertz, held;
	double friction;
} incline;

enum { ROW = 4 };
/* Neighbours in a row push on each other with many times their weight. */
static const double squeeze = 0.02;

/* One grain; or a closed row of them around a periodic axis, squeezed together. Where two grains of the row touch, they
 * would have to slip on each other for all to turn one way, and the squeeze allows that only under a load much greater
 * than the incline's friction: the row moves as one body that does not turn, and no grain carries another. */
static quern_run *open_scene(const incline *c, double angle) {
	static text t;
	const bool deep = c->dim == 3;
	const int n = c->held ? ROW : 1;
	const double length = c->held ? n * 2 * radius * (1 - squeeze) : 10;
	t.length = 0;
	text_add(&t, "{quern: 1, dimension: %u, gravity: [%.17g, %.17g%s],\n", c->dim, gravity * sin(angle),
		-gravity * cos(angle), deep ? ", 0" : "");
	text_add(&t, "domain: {lower: [0, -0.1%s], upper: [%.17g, 0.1%s], periodic: [%s, false%s]},\n",
		deep ? ", -0.1" : "", length, deep ? ", 0.1" : "", c->held ? "true" : "false", deep ? ", false" : "");
	text_add(&t, "time: {end: 10}, output: {every: 0.01, fields: [touch.force]},\n");
	text_add(&t, "bodies: [{plane: {point: [0, 0%s], normal: [0, 1%s], contact: {friction: %.17g}}}],\n",
		deep ? ", 0" : "", deep ? ", 0" : "", c->friction);
	text_add(&t,
		"grains:\n  {material: {density: 2500, radius: {mean: %.17g}}, overlap: {start: 0.1}, contact: ",
		radius);
	text_add(&t, c->hertz ? "{hertz: {young: 1e9, friction: 0.5, restitution: 0.2}},\n"
						  : "{linear: {stiffness: 1e6, friction: 0.5, restitution: 0.2}},\n");
	text_add(&t, "  place: [");
	for (int k = 0; k < n; k++)
		text_add(&t, "%s{position: [%.17g, %.17g%s]}", k ? ", " : "", (k + 0.5) * length / n, radius,
			deep ? ", 0" : "");
	text_add(&t, "]}}\n");
	return harness_open(1, "%s", t.data);
}

/* Mean accelerations, m/s^2: along the incline, of the surface by turning, of the contact by both. */
typedef struct motion {
	double along, turning, slip;
} motion;

static double mean(quern_run *run, const char *field, int k) {
	const quern_column x = harness_field(run, field);
	double sum = 0;
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) sum += x.real[k][i];
	return sum / harness_count(run, "grain");
}

/* From when the start has died away. */
static motion slide(const incline *c, double angle) {
	const int axis = c->dim == 3 ? 2 : 0;
	quern_run *run = open_scene(c, angle);
	harness_until(run, 0.03);
	const double v = mean(run, "grain.velocity", 0), w = mean(run, "grain.spin", axis);
	const double begin = quern_run_time(run);
	harness_until(run, 0.07);
	const double span = quern_run_time(run) - begin;
	motion m = { (mean(run, "grain.velocity", 0) - v) / span,
		(mean(run, "grain.spin", axis) - w) * radius / span, 0 };
	m.slip = m.along + m.turning;
	harness_close(run);
	return m;
}

/* The angle in degrees above which the contact slides faster and faster. */
static double threshold(const incline *c) {
	double low = 0, high = 89 * degree;
	while (high - low > 0.04 * degree) {
		const double middle = 0.5 * (low + high);
		if (slide(c, middle).slip > 1e-3 * gravity) high = middle;
		else low = middle;
	}
	return 0.5 * (low + high) / degree;
}

/* Tangent of the angle of sliding over friction: the share of the slope that friction has to hold is that part of it
 * which does not go into rolling. */
static double factor(const incline *c) { return c->held ? 1 : c->dim == 2 ? 3 : 3.5; }

static bool find_thresholds(bool held) {
	static const double frictions[] = { 0.15, 0.5 };
	bool good = true;
	char what[80];
	table_head(
		held ? "held from turning: angle of sliding, degrees" : "free to roll: angle of sliding, degrees");
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int hertz = 0; hertz <= 1; hertz++)
			for (int k = 0; k < 2; k++) {
				const incline c = { dim, hertz, held, frictions[k] };
				snprintf(
					what, sizeof what, "%s, %uD, friction %g", hertz ? "hertz" : "linear", dim, frictions[k]);
				good &= table_row(what, threshold(&c), atan(factor(&c) * frictions[k]) / degree, 0.2);
			}
	return good;
}

static void sliding_when_held(void **unused) {
	(void)unused;
	assert_true(find_thresholds(true));
}
static void sliding_when_rolling(void **unused) {
	(void)unused;
	assert_true(find_thresholds(false));
}

/* On either side of the threshold the accelerations are those of a rigid grain, but for the overlap, which shortens the
 * lever by half of itself. */
static void accelerations(void **unused) {
	(void)unused;
	bool good = true;
	char what[80];
	table_head("acceleration over g: along the incline, of the surface by turning");
	for (int held = 0; held <= 1; held++)
		for (uint32_t dim = 2; dim <= 3; dim++)
			for (int side = -1; side <= 1; side += 2) {
				const incline c = { dim, false, held, 0.3 };
				const double inertia = dim == 2 ? 0.5 : 0.4,
							 angle = atan(factor(&c) * c.friction) + side * 5 * degree;
				const double rubbing = c.friction * cos(angle), sliding = sin(angle) - rubbing;
				const double along = side > 0 ? sliding : held ? 0 : sin(angle) / (1 + inertia);
				const double turning = held ? 0 : side > 0 ? -rubbing / inertia : -along;
				const motion m = slide(&c, angle);
				snprintf(what, sizeof what, "%s, %uD, 5 degrees %s", held ? "held" : "free", dim,
					side > 0 ? "above" : "below");
				good &= table_row(what, m.along / gravity, along, 5e-4);
				good &= table_row("", m.turning / gravity, turning, 5e-4);
			}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(sliding_when_held),
		cmocka_unit_test(sliding_when_rolling), cmocka_unit_test(accelerations) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
