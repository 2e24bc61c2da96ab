/* SPDX-License-Identifier: MIT */
/* Bridges of liquid: grains that bounce without loss lose the work of a bridge, those that are too slow stay, and a bed of wet grains has the
 * same bits for any number of threads and any search. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "scene_text.h"
#include "table.h"

/* ==== a bounce ==== */

enum { PHASES = 8 };
static const double radius = 1e-3, liquid = 0.02, angle = 0.3;
typedef enum { EQUAL, UNEQUAL, WALL, PARTNERS } partner;

typedef struct bounce {
	uint32_t dim;
	const char *integrator;
	partner with;
	double tension, speed;
} bounce;

static double second_radius(const bounce *c) { return c->with == UNEQUAL ? 2 * radius : radius; }

static double mass_of(const bounce *c, double r) {
	return 2500 * 3.141592653589793 * r * r * (c->dim == 3 ? 4.0 / 3 * r : 1);
}
/* Effective mass and radius R. */
static double mass(const bounce *c) {
	const double a = mass_of(c, radius), b = mass_of(c, second_radius(c));
	return c->with == WALL ? a : a * b / (a + b);
}
static double size(const bounce *c) {
	const double a = radius, b = second_radius(c);
	return c->with == WALL ? 2 * a : 2 * a * b / (a + b);
}

/* From touching to where the bridge breaks, by the closed form. */
static double work(const bounce *c) {
	const double root = sqrt(10 - 1.05 * 1.05), broken = (1 + 0.5 * angle) * cbrt(liquid) / sqrt(liquid);
	return 2 * 3.141592653589793 * c->tension * cos(angle) * size(c) * size(c) * sqrt(liquid) * 2 / root *
		   (atan((1.05 + 5 * broken) / root) - atan(1.05 / root));
}

/* Pairs side by side, or grains before a wall, number k a share k/PHASES of a step's way farther apart, beyond a bridge's reach. */
static quern_run *open_scene(const bounce *c, int n, const char *step, double dt) {
	static text t;
	const char *more = c->dim == 3 ? ", 0" : "";
	const double other = second_radius(c), m1 = mass_of(c, radius), m2 = mass_of(c, other);
	t.length = 0;
	text_add(&t, "{quern: 1, dimension: %u, gravity: [0, 0%s], ", c->dim, more);
	text_add(&t, "domain: {lower: [-0.1, -0.1%s], upper: [0.1, 0.3%s]},\n", c->dim == 3 ? ", -0.05" : "",
		c->dim == 3 ? ", 0.05" : "");
	text_add(&t,
		"time: {end: 1, step: %s}, output: {every: 1, fields: [total.kinetic]}, observe: [energy],\n", step);
	if (c->with == WALL)
		text_add(&t, "bodies: [{plane: {point: [0, 0%s], normal: [-1, 0%s]}}],\n", more, more);
	text_add(&t, "grains: {material: {density: 2500, radius: {mean: %g}}, integrator: %s, step: 0.02,\n",
		radius, c->integrator);
	text_add(
		&t, "  contact: [{linear: {stiffness: %g, restitution: 1, friction: 0}},\n", c->dim == 2 ? 1e5 : 1e3);
	text_add(&t, "    {cohesive: {surface_tension: %.17g, liquid: %g, angle: %g}}],\n  place: [\n",
		c->tension, liquid, angle);
	for (int k = 0; k < n; k++) {
		const double gap = 0.4 * size(c) + (double)k / n * dt * c->speed, y = 0.02 * k;
		const double share = c->with == WALL ? 1 : m2 / (m1 + m2); /* at rest together */
		text_add(&t, "%s{position: [%.17g, %.17g%s], velocity: [%.17g, 0%s], radius: %.17g}", k ? ",\n" : "",
			-radius - gap, y, more, share * c->speed, more, radius);
		if (c->with != WALL)
			text_add(&t, ",\n{position: [%.17g, %.17g%s], velocity: [%.17g, 0%s], radius: %.17g}", other, y,
				more, (share - 1) * c->speed, more, other);
	}
	text_add(&t, "]}}\n");
	return harness_open(1, "%s", t.data);
}

static double all_energy(quern_run *run) {
	static const char *const parts[] = { "kinetic", "stored", "damped", "rubbed" };
	double sum = 0;
	harness_look(run);
	for (int p = 0; p < 4; p++) {
		char name[32];
		snprintf(name, sizeof name, "total.%s", parts[p]);
		sum += harness_field(run, name).real[0][0];
	}
	return sum;
}

typedef struct outcome {
	double kept,
		unbooked; /* of the energy of approach: what is left, the worst of all phases; what no book has */
	int bridges;
} outcome;

static outcome collide(const bounce *c, double asked) {
	double hard;
	char step[32], reason[200], hard_reason[200];
	quern_run *run = open_scene(c, 1, "auto", 1e-6);
	const double dt = quern_run_limit(run, &hard, reason, hard_reason);
	harness_close(run);
	snprintf(step, sizeof step, "%.17g", dt);
	run = open_scene(c, PHASES, step, dt);
	harness_steps(run, 1);
	const double energy = all_energy(run);
	harness_until(run, 3 * size(c) / c->speed + 200 * dt);
	const quern_column v = harness_field(run, "grain.velocity"), id = harness_field(run, "grain.id");
	double end[2 * PHASES] = { 0 };
	outcome out = { asked, fabs(all_energy(run) / energy - 1), 0 };
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) end[id.id[i]] = v.real[0][i];
	for (int k = 0; k < PHASES; k++) {
		const double e = (c->with == WALL ? -end[k] : end[2 * k + 1] - end[2 * k]) / c->speed;
		if (!(fabs(e * e - asked) <= fabs(out.kept - asked))) out.kept = e * e;
	}
	const char *set = c->with == WALL ? "touch" : "contact",
			   *name = c->with == WALL ? "touch.bridge" : "contact.bridge";
	for (uint32_t k = 0; k < harness_count(run, set); k++)
		out.bridges += harness_field(run, name).real[0][k] > 0;
	harness_close(run);
	return out;
}

static void bounces_lose_the_bridge(void **unused) {
	(void)unused;
	static const char *const names[] = { "equal grains", "grains of radius 1 and 2", "a grain and a wall" };
	static const char *const integrators[] = { "symplectic_euler", "velocity_verlet", "position_verlet" };
	static const double shares[] = { 0, 0.1, 0.5, 0.9 }; /* of the energy of approach, that a bridge takes */
	bool good = true;
	char what[80];
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int with = 0; with < (dim == 2 ? 3 : 2); with++) {
			snprintf(what, sizeof what, "energy left, %s, %uD, worst of %d phases", integrators[with], dim,
				PHASES);
			table_head(what);
			for (int p = EQUAL; p < PARTNERS; p++)
				for (size_t k = 0; k < sizeof shares / sizeof *shares; k++) {
					bounce c = { dim, integrators[with], (partner)p, 1, 0.05 };
					const double approach = 0.5 * mass(&c) * c.speed * c.speed;
					c.tension = k ? shares[k] * approach / work(&c) : 1e-12 * approach / work(&c);
					const outcome o = collide(&c, 1 - shares[k]);
					good &= table_row(names[p], o.kept, 1 - shares[k], 0.002);
					good &= table_row("  not booked", o.unbooked, 0, 1e-4);
					good &= table_row("  bridges left", o.bridges, 0, 0);
				}
		}
	assert_true(good);
}

/* What has less energy than a bridge takes never gets away, whoever pushes, and its bridge lasts. */
static void slow_grains_stay(void **unused) {
	(void)unused;
	bool good = true;
	table_head("approach with 0.8 of a bridge's work: bridges that last");
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int p = EQUAL; p < PARTNERS; p++) {
			bounce c = { dim, "symplectic_euler", (partner)p, 1, 0.05 };
			c.tension = 0.5 * mass(&c) * c.speed * c.speed / 0.8 / work(&c);
			good &= table_row(dim == 2 ? "discs" : "spheres", collide(&c, 0).bridges, PHASES, 0);
		}
	assert_true(good);
}

/* ==== a bed ==== */

static quern_run *pour(int dim, const char *search, int workers, int batch) {
	const bool deep = dim == 3;
	return harness_open((uint32_t)workers,
		"{quern: 1, dimension: %d, seed: 3, gravity: [2, -9.81%s], domain: {lower: [0, 0%s], upper: [%s], periodic: [true, false%s]},\n"
		"time: {end: 1, step: 2e-6}, output: {every: 0.01}, run: {batch: %d},\n"
		"bodies: [{plane: {point: [0, 0%s], normal: [0, 1%s]}}],\n"
		"grains: {materials: {sand: {density: 2500, radius: {mean: 1 mm, spread: 0.2}}, dust: {density: 2500, radius: {mean: 0.25 mm}}},\n"
		"  contact: [{plastic: {stiffness: %g}}, {rolling: {stiffness: %g, friction: 0.2}}, {cohesive: {surface_tension: %g, liquid: 0.05}}],\n"
		"  neighbours: %s, overlap: {most: 0},\n"
		"  fill: [{region: {box: {lower: [0, 0%s], upper: [%s]}}, velocity: [0, -0.2%s], mix: {sand: 70 %%, dust: 30 %%}}]}}\n",
		dim, deep ? ", 0" : "", deep ? ", 0" : "", deep ? "0.01, 0.05, 0.01" : "0.02, 0.05",
		deep ? ", true" : "", batch, deep ? ", 0" : "", deep ? ", 0" : "", deep ? 1e3 : 1e5,
		deep ? 100.0 : 1e4, deep ? 0.05 : 5, search, deep ? ", 0" : "",
		deep ? "0.01, 0.008, 0.01" : "0.02, 0.02", deep ? ", 0" : "");
}

static uint32_t numbers_that_differ(quern_run *one, quern_run *other, int dim) {
	static const char *const fields[] = { "grain.position", "grain.velocity", "grain.spin" };
	const uint32_t n = harness_count(one, "grain");
	const int64_t *a = harness_field(one, "grain.id").id, *b = harness_field(other, "grain.id").id;
	uint32_t different = 0, at[8192];
	assert_true(n < 8192 && n == harness_count(other, "grain"));
	for (uint32_t i = 0; i < n; i++) at[b[i]] = i;
	for (int f = 0; f < 3; f++)
		for (int k = 0; k < (f == 2 && dim == 2 ? 1 : dim); k++) {
			const double *x = harness_field(one, fields[f]).real[k],
						 *y = harness_field(other, fields[f]).real[k];
			for (uint32_t i = 0; i < n; i++) different += x[i] != y[at[a[i]]];
		}
	return different;
}

/* Wet sand and dust that yield and resist rolling; lists are remade on the way, with bridges in them. */
static void bits_are_the_same(void **unused) {
	(void)unused;
	bool good = true;
	table_head("wet sand and dust, 800 steps: numbers that differ");
	for (int dim = 2; dim <= 3; dim++) {
		quern_run *one = pour(dim, "cells", 1, 256), *threads = pour(dim, "cells", 3, 8),
				  *search = pour(dim, "hgrid", 1, 256);
		double bridges = 0, apart = 0;
		harness_steps(one, 800), harness_steps(threads, 800), harness_steps(search, 800);
		good &=
			table_row("with three threads and another batch", numbers_that_differ(one, threads, dim), 0, 0);
		good &= table_row("with a hierarchical grid", numbers_that_differ(one, search, dim), 0, 0);
		for (uint32_t k = 0; k < harness_count(one, "contact"); k++) {
			const bool is = harness_field(one, "contact.bridge").real[0][k] > 0;
			bridges += is, apart += is && harness_field(one, "contact.deepest").real[0][k] == 0;
		}
		table_note("  grains", harness_count(one, "grain"));
		table_note("  bridges", bridges);
		table_note("  of these between grains that are apart", apart);
		assert_true(bridges > 100 && apart > 10); /* or the test would not see a thing */
		harness_close(one), harness_close(threads), harness_close(search);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(bounces_lose_the_bridge),
		cmocka_unit_test(slow_grains_stay), cmocka_unit_test(bits_are_the_same) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
