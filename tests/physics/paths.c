/* SPDX-License-Identifier: MIT */
/* Laws with a memory, one contact alone along a path of the overlap: forces in closed form, and what they do against what they book. */
#include <quern/contact.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "plugin_alone.h"
#include "table.h"
#include <stdlib.h>

/* ==== one contact ==== */

static const double radius = 1e-3, mass = 1e-3; /* effective */

typedef struct contact {
	const alone *law;
	double memory, force, stored, rubbed, dt, apart; /* apart: rate of the distance, m/s */
} contact;

/* One evaluation at this overlap; `rubbed` grows by what is lost in it. */
static void press(contact *c, uint32_t dim, double overlap) {
	const quern_contact_ops *ops = c->law->plugin->ops;
	double normal[3] = { 1, 0, 0 }, velocity[3] = { c->apart, 0, 0 };
	double force[3] = { 0 }, dashpot[3] = { 0 }, stored = 0, sheared = 0, rubbed = 0;
	quern_column use[3] = { { .real = { &c->memory } } };
	quern_contact_batch b = { .n = 1,
		.cap = 1,
		.dt = c->dt,
		.overlap = &overlap,
		.radius = &radius,
		.mass = &mass,
		.use = use,
		.use_second = use,
		.stored = &stored,
		.sheared = &sheared,
		.rubbed = &rubbed };
	for (uint32_t k = 0; k < dim; k++) {
		b.normal[k] = &normal[k], b.velocity[k] = b.mean_velocity[k] = &velocity[k];
		b.force[k] = &force[k], b.dashpot[k] = &dashpot[k];
	}
	ops->force[dim - 2](c->law->self, &b);
	for (uint32_t k = 0; k < dim; k++) assert_true(dashpot[k] == 0 && (k == 0 || force[k] == 0));
	c->force = force[0];
	c->stored = stored;
	c->rubbed += rubbed;
}

/* ==== plastic ==== */

static const double k1 = 1e5, asked_e = 0.4; /* N/m */

/* Way points of the overlap over the first maximum D, and the force there over k_1 D; between them the force is straight. With e = 0.4 what
 * stays as a dent is 0.84 of the greatest overlap. */
static const double path[][2] = { { 0, 0 }, { 1, 1 }, { 0.84, 0 }, { 0.3, 0 }, { 0.84, 0 }, { 0.92, 0.5 },
	{ 0.84, 0 }, { 1, 1 }, { 2, 2 }, { 1.68, 0 }, { 0.84, 0 }, { 1.68, 0 }, { 1.84, 1 } };

static void plastic_yields(void **unused) {
	(void)unused;
	enum { PARTS = 64, POINTS = sizeof path / sizeof *path };
	const double most = 1e-5, unit = k1 * most;
	bool good = true;
	table_head("pressed to D, let go, pressed again, to 2 D");
	for (uint32_t dim = 2; dim <= 3; dim++) {
		alone law = alone_make("contact.plastic", dim,
			(alone_value[]) {
				{ "stiffness", k1 }, { "restitution", asked_e }, { "friction", 0 }, { NULL, 0 } });
		contact c = { .law = &law, .dt = 1e-6 };
		double gap = 0, books = 0, work = 0, before = 0, was = 0;
		for (size_t p = 1; p < POINTS; p++)
			for (int t = 1; t <= PARTS; t++) {
				const double share = (double)t / PARTS;
				const double d = most * (path[p - 1][0] + share * (path[p][0] - path[p - 1][0]));
				const double asked = unit * (path[p - 1][1] + share * (path[p][1] - path[p - 1][1]));
				press(&c, dim, d);
				work += 0.5 * (c.force + before) * (d - was);
				gap = fmax(gap, fabs(c.force - asked) / unit);
				books = fmax(books, fabs(work - c.stored - c.rubbed) / (unit * most));
				before = c.force, was = d;
			}
		const double lost = c.rubbed;
		press(&c, dim, -1e-9);
		good &= table_row(
			dim == 2 ? "2D: force over k_1 D, worst gap" : "3D: force over k_1 D, worst gap", gap, 0, 1e-12);
		good &= table_row("  work less what is stored and lost, over k_1 D^2", books, 0, 1e-12);
		good &= table_row("  lost over k_1 (2 D)^2 (1 - e^2)/2",
			lost / (2 * unit * most * (1 - asked_e * asked_e)), 1, 1e-12);
		good &= table_row("  greatest overlap once apart", c.memory, 0, 0);
		good &= table_row("  force once apart", c.force, 0, 0);
		free(law.self);
	}
	assert_true(good);
}

/* ==== cohesive ==== */

static const double tension = 0.072, angle = 0.4, liquid = 0.02;

/* 2 pi R gamma cos theta/(1 + 1.05 s + 2.5 s^2), s = gap sqrt(R/V) */
static double bridge_at(double gap) {
	const double big = 2 * radius, s = gap / big / sqrt(liquid);
	return 2 * 3.141592653589793 * big * tension * cos(angle) / (1 + 1.05 * s + 2.5 * s * s);
}

/* By Simpson's rule. */
static double work_between(double low, double high) {
	enum { PARTS = 20000 };
	double sum = 0;
	for (int k = 0; k <= PARTS; k++)
		sum += bridge_at(low + (high - low) * k / PARTS) * (k == 0 || k == PARTS ? 1 : k % 2 ? 4 : 2);
	return sum * (high - low) / PARTS / 3;
}

/* Comes from afar, touches, goes away beyond where the bridge breaks, and comes back. */
static void bridges_form_and_break(void **unused) {
	(void)unused;
	bool good = true;
	const double rupture = (1 + 0.5 * angle) * cbrt(liquid) * 2 * radius;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		alone law = alone_make("contact.cohesive", dim,
			(alone_value[]) {
				{ "surface_tension", tension }, { "angle", angle }, { "liquid", liquid }, { NULL, 0 } });
		const quern_contact_ops *ops = law.plugin->ops;
		contact c = { .law = &law, .dt = 1e-9 };
		double before = 0, force = 0, books = 0;
		table_head(dim == 2 ? "a bridge, 2D" : "a bridge, 3D");
		good &= table_row("reach over where it breaks", ops->reach(law.self, radius) / rupture, 1, 1e-14);
		for (int k = 0; k <= 100; k++) {
			press(&c, dim, -rupture * (1.5 - 0.015 * k) - 1e-12);
			before = fmax(before, fabs(c.force) + fabs(c.stored) + c.memory);
		}
		good &= table_row("force, energy and memory before touching", before, 0, 0);
		press(&c, dim, 0.5e-5);
		const double whole = work_between(0, rupture), formed = c.rubbed;
		good &=
			table_row("lost when it forms, over its work up to where it breaks", formed / whole, 1, 1e-10);
		for (int k = -10; k < 100; k++) {
			const double gap = rupture * k / 100, deep = gap < 0 ? gap : 0;
			press(&c, dim, -gap);
			force = fmax(force, fabs(c.force / bridge_at(fmax(gap, 0)) + 1));
			books = fmax(
				books, fabs(c.stored + work_between(fmax(gap, 0), rupture) - deep * bridge_at(0)) / whole);
		}
		good &= table_row("pull over that in closed form, worst gap", force, 0, 1e-13);
		good &= table_row("stored, over minus the work that is left, worst gap", books, 0, 1e-10);
		good &= table_row("nothing more is lost", (c.rubbed - formed) / whole, 0, 0);
		press(&c, dim, -rupture * (1 + 1e-9)); /* the test reckons where it breaks by other roundings */
		good &= table_row("force once broken", fabs(c.force) + fabs(c.stored) + c.memory, 0, 0);
		press(&c, dim, -0.1 * rupture);
		good &= table_row("force when near again", fabs(c.force) + fabs(c.stored) + c.memory, 0, 0);
		good &= table_row("nothing is lost by breaking", (c.rubbed - formed) / whole, 0, 0);
		free(law.self);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(plastic_yields),
		cmocka_unit_test(bridges_form_and_break) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
