/* SPDX-License-Identifier: MIT */
/* A pair that has opened gives up what its springs still held: in that step nothing else is lost, no force acts, and the law has to be
 * asked though the pair is beyond its reach. Where nothing is lost along the normal and nothing slides that is all that is lost. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "scene_text.h"
#include "table.h"

static const double radius = 5e-3, stiffness = 1e5, rolling = 1e4, young = 1e7, poisson = 0.25;

typedef struct glance {
	uint32_t dim;
	bool hertz, wall, rolls, verlet;
	const char *name, *contact;
} glance;

/* A grain meets another one, or a wall, glancing and without losses along the normal. */
static quern_run *open_scene(const glance *g) {
	static text t;
	const bool deep = g->dim == 3;
	const char *zero = deep ? ", 0" : "";
	t.length = 0;
	text_add(&t,
		"{quern: 1, dimension: %u, gravity: [0, 0%s], time: {end: 1, step: 1e-5}, output: {every: 0.1},\n",
		g->dim, zero);
	text_add(&t, "domain: {lower: [-1, -1%s], upper: [1, 1%s]}, observe: [energy],\n", deep ? ", -1" : "",
		deep ? ", 1" : "");
	if (g->wall) text_add(&t, "bodies: [{plane: {point: [0, 0%s], normal: [-1, 0%s]}}],\n", zero, zero);
	text_add(&t,
		"grains: {material: {density: 2500, radius: {mean: %g}}, integrator: %s, overlap: {most: 0},\n",
		radius, g->verlet ? "position_verlet" : "symplectic_euler");
	text_add(&t, "  contact: [%s], place: [{position: [-0.0052, 0%s], velocity: [1, 0.7%s]}", g->contact,
		zero, deep ? ", 0.4" : "");
	if (!g->wall) text_add(&t, ", {position: [0.0052, 0%s], velocity: [-1, 0%s]}", zero, zero);
	text_add(&t, "]}}\n");
	return harness_open(1, "%s", t.data);
}

typedef struct state {
	double overlap, held, rubbed, damped; /* m where the last forces were; J */
} state;

static double square(quern_run *run, const glance *g, const char *history) {
	char field[32];
	double sum = 0;
	snprintf(field, sizeof field, "%s.%s", g->wall ? "touch" : "contact", history);
	const quern_column c = harness_field(run, field);
	for (uint32_t k = 0; k < (g->dim == 3 ? 3u : 1u); k++) sum += c.real[k][0] * c.real[k][0];
	return sum;
}

/* In the tangential spring, of this overlap: docs/theory/contacts.md, section 8. */
static double held(quern_run *run, const glance *g, double overlap) {
	if (!harness_count(run, g->wall ? "touch" : "contact")) return 0;
	const double rolled = g->rolls ? 0.5 * rolling * square(run, g, "roll") : 0;
	if (!g->hertz) return 0.5 * stiffness / 3 * square(run, g, "slip") + rolled;
	const double effective = g->wall ? radius : radius / 2,
				 shear = young / (2 * (1 + poisson)) / (2 * (2 - poisson));
	return overlap > 0 ? 0.5 * square(run, g, "shear") / (8 * shear * sqrt(effective * overlap)) : 0;
}

/* Where the next forces will be: position_verlet moves grains by half a step before. */
static double overlap_of(quern_run *run, const glance *g) {
	const quern_column x = harness_field(run, "grain.position"), v = harness_field(run, "grain.velocity");
	const double ahead = g->verlet ? 0.5 * run->clock.dt : 0;
	double square = 0;
	if (g->wall) return radius + x.real[0][0] + ahead * v.real[0][0];
	for (uint32_t k = 0; k < g->dim; k++)
		square += pow(x.real[k][0] - x.real[k][1] + ahead * (v.real[k][0] - v.real[k][1]), 2);
	return 2 * radius - sqrt(square);
}

static state step(quern_run *run, const glance *g) {
	state now = { .overlap = overlap_of(run, g) };
	harness_steps(run, 1);
	now.held = held(run, g, now.overlap);
	now.rubbed = harness_field(run, "total.rubbed").real[0][0];
	now.damped = harness_field(run, "total.damped").real[0][0];
	return now;
}

static bool opens(const glance *g, double tolerance) {
	char what[80];
	quern_run *run = open_scene(g);
	state before = step(run, g);
	bool touched = false, good = true;
	for (int k = 0; k < 1000; k++) {
		const state now = step(run, g);
		touched |= now.overlap > 0;
		if (touched && now.overlap <= 0) {
			snprintf(what, sizeof what, "%uD, %s, on a %s%s", g->dim, g->name, g->wall ? "wall" : "grain",
				g->verlet ? ", Verlet" : "");
			good &= table_row(what, (now.rubbed - before.rubbed) / before.held, 1, tolerance);
			good &= table_row("  still held", now.held, 0, 0);
			good &= table_row("  damped meanwhile", now.damped - before.damped, 0, 0);
			table_note("  held before it opened, over all that is rubbed", before.held / now.rubbed);
			harness_close(run);
			return good && before.held > 0;
		}
		before = now;
	}
	harness_close(run);
	return false;
}

static void what_opens_loses_its_spring(void **unused) {
#define LINEAR "stiffness: 1e5, restitution: 1, friction: 2, tangential_stiffness: 0.33333333333333333"
	static const char
		linear[] = "{linear: {" LINEAR "}}",
		plastic[] = "{plastic: {" LINEAR "}}",
		rolls[] = "{linear: {" LINEAR "}}, {rolling: {stiffness: 1e4, friction: 2}}",
		hertz[] = "{hertz: {young: 1e7, poisson: 0.25, restitution: 1, friction: 2, impact_speed: 1}}";
	bool good = true;
	(void)unused;
	table_head("lost as a pair opens, over what its springs held");
	for (int which = 0; which < 8; which++) {
		const uint32_t dim = which & 1 ? 3 : 2;
		const bool wall = which & 2, verlet = which & 4;
		good &= opens(&(glance) { dim, false, wall, false, verlet, "linear", linear }, 1e-12);
		good &= opens(&(glance) { dim, false, wall, true, verlet, "linear and rolling", rolls }, 1e-12);
		good &= opens(&(glance) { dim, false, wall, false, verlet, "plastic", plastic }, 1e-12);
		good &= opens(&(glance) { dim, true, wall, false, verlet, "Hertz", hertz }, 1e-3);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(what_opens_loses_its_spring) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
