/* SPDX-License-Identifier: MIT */
/* The spring that yields: restitution, which is sqrt(k_1/k_2) at any speed, with closed books, and the step. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "scene_text.h"
#include "table.h"

enum { PHASES = 8 };
static const double radius = 5e-3;
typedef enum { EQUAL, UNEQUAL, WALL, PARTNERS } partner;

typedef struct collision {
	uint32_t dim;
	const char *integrator;
	partner with;
	double restitution, speed;
	bool rolls;
} collision;

/* Pairs side by side, number k a share k/PHASES of a step's way farther apart. The faster, the stiffer: all get as deep. */
static quern_run *open_scene(const collision *c, int n, const char *step, double dt) {
	static text t;
	const char *more = c->dim == 3 ? ", 0" : "";
	const double other = c->with == UNEQUAL ? radius * pow(10, 1.0 / c->dim) : radius;
	t.length = 0;
	text_add(&t, "{quern: 1, dimension: %u, gravity: [0, 0%s], ", c->dim, more);
	text_add(&t, "domain: {lower: [-5, -0.1%s], upper: [5, 3%s]},\n", c->dim == 3 ? ", -0.05" : "",
		c->dim == 3 ? ", 0.05" : "");
	text_add(&t,
		"time: {end: %.17g, step: %s}, output: {every: %.17g, fields: [total.kinetic]}, observe: [energy],\n",
		1e4 * dt, step, dt);
	if (c->with == WALL)
		text_add(&t, "bodies: [{plane: {point: [0, 0%s], normal: [-1, 0%s]}}],\n", more, more);
	text_add(&t, "grains:\n  {material: {density: 2500, radius: {mean: %.17g}},\n", radius);
	const double stiffness = (c->dim == 2 ? 1e6 : 1e4) * c->speed * c->speed;
	text_add(&t, "  contact: [{plastic: {stiffness: %.17g, restitution: %.17g, friction: %d}}", stiffness,
		c->restitution, c->rolls);
	if (c->rolls) text_add(&t, ", {rolling: {stiffness: %.17g}}", 0.1 * stiffness);
	text_add(&t, "],\n");
	text_add(&t, "  integrator: %s,\n  step: 0.02,\n  place: [\n", c->integrator);
	for (int k = 0; k < n; k++) {
		const double gap = (2 + (double)k / n) * dt * c->speed, y = 0.08 * k,
					 share = c->with == WALL ? 1 : 0.5;
		text_add(&t, "%s{position: [%.17g, %.17g%s], velocity: [%.17g, 0%s], radius: %.17g}", k ? ",\n" : "",
			-radius - share * gap, y, more, share * c->speed, more, radius);
		if (c->with != WALL)
			text_add(&t, ",\n{position: [%.17g, %.17g%s], velocity: [%.17g, 0%s], radius: %.17g}",
				other + share * gap, y, more, -share * c->speed, more, other);
	}
	text_add(&t, "]}}\n");
	return harness_open(1, "%s", t.data);
}

static double default_step(const collision *c) {
	double hard;
	char reason[200], hard_reason[200];
	quern_run *run = open_scene(c, 1, "auto", 1e-4);
	const double dt = quern_run_limit(run, &hard, reason, hard_reason);
	harness_close(run);
	return dt;
}

typedef struct outcome {
	double restitution, unbooked; /* the worst of all phases; of the energy at the start */
} outcome;

static double all_energy(quern_run *run) {
	static const char *const parts[] = { "kinetic", "stored", "sheared", "damped", "rubbed" };
	double sum = 0;
	harness_look(run);
	for (int p = 0; p < 5; p++) {
		char name[32];
		snprintf(name, sizeof name, "total.%s", parts[p]);
		sum += harness_field(run, name).real[0][0];
	}
	return sum;
}

static outcome collide(const collision *c) {
	char step[32];
	const double dt = default_step(c);
	snprintf(step, sizeof step, "%.17g", dt);
	quern_run *run = open_scene(c, PHASES, step, dt);
	harness_steps(run, 1);
	const double energy = all_energy(run);
	harness_steps(run, 100 + (int64_t)(30 / c->restitution));
	const quern_column v = harness_field(run, "grain.velocity"), id = harness_field(run, "grain.id");
	double end[2 * PHASES] = { 0 };
	outcome out = { c->restitution, fabs(all_energy(run) / energy - 1) };
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) end[id.id[i]] = v.real[0][i];
	for (int k = 0; k < PHASES; k++) {
		const double e = (c->with == WALL ? -end[k] : end[2 * k + 1] - end[2 * k]) / c->speed;
		if (!(fabs(e - c->restitution) <= fabs(out.restitution - c->restitution))) out.restitution = e;
	}
	harness_close(run);
	return out;
}

static void gives_back_what_is_asked(void **unused) {
	(void)unused;
	static const double asked[] = { 0.05, 0.2, 0.5, 0.8, 1 };
	static const char *const names[] = { "equal grains", "grains of mass 1 and 10", "a grain and a wall" };
	static const char *const integrators[] = { "symplectic_euler", "velocity_verlet", "position_verlet" };
	bool good = true;
	char what[80];
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int with = 0; with < 3; with++) {
			snprintf(what, sizeof what, "%s, %uD, worst of %d phases", integrators[with], dim, PHASES);
			table_head(what);
			for (int p = EQUAL; p < PARTNERS; p++)
				for (size_t k = 0; k < sizeof asked / sizeof *asked; k++) {
					const collision c = { dim, integrators[with], (partner)p, asked[k], k % 2 ? 0.01 : 10,
						p == EQUAL };
					const outcome o = collide(&c);
					snprintf(what, sizeof what, "%s%s, %g m/s", names[p],
						c.rolls ? " that resist rolling" : "", c.speed);
					good &= table_row(what, o.restitution, asked[k], 0.001);
					good &= table_row("  energy not booked", o.unbooked, 0, 1e-4);
				}
		}
	assert_true(good);
}

/* The step that is taken by itself goes by the stiffer branch. */
static void steps_go_by_unloading(void **unused) {
	(void)unused;
	bool good = true;
	table_head("half-period over pi e sqrt(m/k_1)");
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const collision c = { dim, "symplectic_euler", WALL, 0.3, 1, false };
		const double mass = 2500 * 3.141592653589793 * radius * radius * (dim == 3 ? 4.0 / 3 * radius : 1);
		const double asked = 3.141592653589793 * 0.3 * sqrt(mass / (dim == 2 ? 1e6 : 1e4));
		good &= table_row(
			dim == 2 ? "a disc on a wall" : "a sphere on a wall", 50 * default_step(&c) / asked, 1, 1e-12);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(gives_back_what_is_asked),
		cmocka_unit_test(steps_go_by_unloading) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
