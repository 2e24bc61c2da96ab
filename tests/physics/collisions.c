/* SPDX-License-Identifier: MIT */
/* Restitution measured against restitution asked: pairs of equal and of unequal grains and grains on a wall, with both
 * laws, all integrators and in both dimensions, at the default step and in every phase of it in which a pair may
 * happen to touch. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "scene_text.h"
#include "table.h"
#include <math.h>
#include <string.h>

enum { PHASES = 32 };
static const double radius = 5e-3, speed = 1; /* m, m/s: of approach */

typedef enum { EQUAL, UNEQUAL, WALL } partner;

typedef struct collision {
	uint32_t dim;
	bool hertz;
	const char *integrator;
	partner with;
	double restitution;
} collision;

static double second_radius(const collision *c) {
	return c->with == UNEQUAL ? radius * pow(10, 1.0 / c->dim) : radius; /* ten times the mass */
}

/* `n` collisions side by side, far from each other; number k begins k/n of a step's way farther away. The wall's normal
 * is x, like that of the pairs. */
static quern_run *open_scene(const collision *c, int n, const char *step, double dt) {
	static text t;
	const char *more = c->dim == 3 ? ", 0" : "", *low = c->dim == 3 ? ", -0.05" : "",
			   *high = c->dim == 3 ? ", 0.05" : "";
	const double other = second_radius(c);
	t.length = 0;
	text_add(&t, "{quern: 1, dimension: %u, gravity: [0, 0%s], ", c->dim, more);
	text_add(&t, "domain: {lower: [-5, -0.1%s], upper: [5, 3%s]},\n", low, high);
	text_add(&t, "time: {end: %.17g, step: %s}, output: {every: %.17g},\n", 1000 * dt, step, dt);
	if (c->with == WALL)
		text_add(&t, "bodies: [{plane: {point: [0, 0%s], normal: [-1, 0%s]}}],\n", more, more);
	text_add(&t, "grains:\n  {material: {density: 2500, radius: {mean: %.17g}},\n", radius);
	if (c->hertz)
		text_add(&t, "  contact: {hertz: {young: 1e8, poisson: 0.25, friction: 0, restitution: %.17g, ",
			c->restitution);
	else text_add(&t, "  contact: {linear: {stiffness: 1e6, friction: 0, restitution: %.17g", c->restitution);
	text_add(&t, "%s}},\n", c->hertz ? "impact_speed: 1" : "");
	text_add(&t, "  integrator: %s,\n  place: [\n", c->integrator);
	for (int k = 0; k < n; k++) {
		const double gap = (2 + (double)k / n) * dt * speed, y = 0.08 * k, share = c->with == WALL ? 1 : 0.5;
		text_add(&t, "%s{position: [%.17g, %.17g%s], velocity: [%.17g, 0%s], radius: %.17g}", k ? ",\n" : "",
			-radius - share * gap, y, more, share * speed, more, radius);
		if (c->with != WALL)
			text_add(&t, ",\n{position: [%.17g, %.17g%s], velocity: [%.17g, 0%s], radius: %.17g}",
				other + share * gap, y, more, -share * speed, more, other);
	}
	text_add(&t, "]}}\n");
	return harness_open(1, "%s", t.data);
}

/* The step that the program takes by itself for one such collision. */
static double default_step(const collision *c) {
	double hard;
	char reason[200], hard_reason[200];
	quern_run *run = open_scene(c, 1, "auto", 1);
	const double dt = quern_run_limit(run, &hard, reason, hard_reason);
	harness_close(run);
	return dt;
}

/* The measured restitution that is farthest from the asked one, over all phases of first touch. */
static double worst_restitution(const collision *c) {
	char step[32];
	const double dt = default_step(c);
	snprintf(step, sizeof step, "%.17g", dt);
	quern_run *run = open_scene(c, PHASES, step, dt);
	harness_steps(run, 150); /* three half-periods: all have parted */
	const uint32_t n = harness_count(run, "grain");
	const quern_column v = harness_field(run, "grain.velocity"), id = harness_field(run, "grain.id");
	double end[2 * PHASES] = { 0 }, worst = c->restitution;
	for (uint32_t i = 0; i < n; i++) end[id.id[i]] = v.real[0][i];
	for (int k = 0; k < PHASES; k++) {
		const double e = c->with == WALL ? -end[k] / speed : (end[2 * k + 1] - end[2 * k]) / speed;
		if (!(fabs(e - c->restitution) <= fabs(worst - c->restitution))) worst = e;
	}
	harness_close(run);
	return worst;
}

/* Within 0.01 of what is asked by the scheme of first order, within 0.005 by those of second. */
static bool collide(collision c) {
	static const double asked[] = { 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1 };
	static const char *const names[] = { "equal grains", "grains of mass 1 and 10", "a grain and a wall" };
	const double within = strcmp(c.integrator, "symplectic_euler") == 0 ? 0.01 : 0.005;
	double worst = 0;
	bool good = true;
	char what[80];
	for (c.dim = 2; c.dim <= 3; c.dim++) {
		snprintf(what, sizeof what, "%s, %s, %uD, worst of %d phases", c.hertz ? "hertz" : "linear",
			c.integrator, c.dim, PHASES);
		table_head(what);
		for (c.with = EQUAL; c.with <= WALL; c.with++)
			for (size_t k = 0; k < sizeof asked / sizeof *asked; k++) {
				c.restitution = asked[k];
				const double found = worst_restitution(&c);
				worst = fmax(worst, fabs(found - asked[k]));
				good &= table_row(names[c.with], found, asked[k], within);
			}
	}
	table_note("farthest from what is asked", worst);
	return good;
}

static bool with(const char *integrator) {
	const bool linear = collide((collision) { .integrator = integrator });
	return collide((collision) { .hertz = true, .integrator = integrator }) && linear;
}
static void with_euler(void **unused) { (void)unused, assert_true(with("symplectic_euler")); }
static void with_velocity_verlet(void **unused) { (void)unused, assert_true(with("velocity_verlet")); }
static void with_position_verlet(void **unused) { (void)unused, assert_true(with("position_verlet")); }

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(with_euler), cmocka_unit_test(with_velocity_verlet),
		cmocka_unit_test(with_position_verlet) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
