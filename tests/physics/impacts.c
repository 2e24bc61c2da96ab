/* SPDX-License-Identifier: MIT */
/* Single impacts in closed form, after the benchmark of Chung & Ooi, Granul. Matter 13 (2011) 643: the peak of an elastic
 * collision, oblique impacts that slide, and spins that a contact must not change. All at the default step. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"

static const double pi = 3.14159265358979312;

/* ==== peaks ==== */

typedef struct peak {
	const char *what;
	bool wall;
	double radius, density, young, poisson, speed; /* speed of approach */
	double overlap, force, time;                   /* asked: m, N, s */
} peak;

/* Two spheres, or one on a rigid plane, which is one of its own material with twice the modulus. Largest overlap and
 * force, and for how long they touch. */
static peak collide(const peak *p) {
	peak out = { 0 };
	const double gap = 1e-4 * p->overlap, half = p->wall ? 0 : 0.5;
	char other[200] = "", plane[100] = "";
	if (p->wall)
		snprintf(plane, sizeof plane, "bodies: [{plane: {point: [0, 0, 0], normal: [-1, 0, 0]}}],\n");
	else
		snprintf(other, sizeof other, ", {position: [%.17g, 0, 0], velocity: [%.17g, 0, 0]}",
			p->radius + half * gap, -half * p->speed);
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 3, gravity: [0, 0, 0], domain: {lower: [-2, -1, -1], upper: [2, 1, 1]},\n"
		"time: {end: 1}, output: {every: 0.01, fields: [contact.force, touch.force]}, %s\n"
		"grains: {material: {density: %.17g, radius: {mean: %.17g}},\n"
		"  contact: {hertz: {young: %.17g, poisson: %.17g, friction: 0, restitution: 1, impact_speed: "
		"%.17g}},\n"
		"  place: [{position: [%.17g, 0, 0], velocity: [%.17g, 0, 0]}%s]}}\n",
		plane, p->density, p->radius, (p->wall ? 2 : 1) * p->young, p->poisson, p->speed,
		-p->radius - (1 - half) * gap, (1 - half) * p->speed, other);
	double last = 0;
	for (int k = 0; k < 70; k++) {
		harness_steps(run, 1);
		const quern_column x = harness_field(run, "grain.position");
		const double far = p->wall ? -x.real[0][0] : fabs(x.real[0][0] - x.real[0][1]);
		const double overlap = (p->wall ? 1 : 2) * p->radius - far, dt = run->clock.dt;
		const char *set = p->wall ? "touch" : "contact";
		if (harness_count(run, set))
			out.force = fmax(
				out.force, fabs(harness_field(run, p->wall ? "touch.force" : "contact.force").real[0][0]));
		out.overlap = fmax(out.overlap, overlap);
		/* both ends between two steps, where the overlap is nearly linear in time */
		if (overlap > 0 && last <= 0) out.time -= k * dt + dt * (0 - last) / (overlap - last);
		if (overlap <= 0 && last > 0) out.time += k * dt + dt * last / (last - overlap);
		last = overlap;
	}
	harness_close(run);
	return out;
}

static void peaks(void **unused) {
	(void)unused;
	static const peak asked[] = {
		{ "glass on glass", false, 0.01, 2800, 4.8e10, 0.2, 20, 274.113e-6, 10696.9, 40.295e-6 },
		{ "limestone on limestone", false, 0.01, 2500, 2e10, 0.25, 20, 368.304e-6, 7108.24, 54.141e-6 },
		{ "aluminium alloy on a plane", true, 0.1, 2699, 7e10, 0.3, 0.2, 49.7172e-6, 11369.9, 730.84e-6 },
		{ "magnesium alloy on a plane", true, 0.1, 1800, 4e10, 0.35, 0.2, 52.1233e-6, 7232.68, 766.21e-6 },
	};
	bool good = true;
	table_head("elastic collisions of spheres, hertz");
	for (size_t k = 0; k < sizeof asked / sizeof *asked; k++) {
		const peak *a = &asked[k], m = collide(a);
		printf("  %s\n", a->what);
		good &= table_row("  largest overlap, m", m.overlap, a->overlap, 0.005 * a->overlap);
		good &= table_row("  largest force, N", m.force, a->force, 0.005 * a->force);
		good &= table_row("  duration, s", m.time, a->time, 0.005 * a->time);
	}
	assert_true(good);
}

/* ==== oblique ==== */

typedef struct oblique {
	uint32_t dim;
	bool hertz;
	double restitution, friction, angle; /* angle: degrees from the normal */
} oblique;

typedef struct rebound {
	double normal, tangential, turning; /* m/s, m/s, m/s: of the surface by spin */
} rebound;

/* A hard grain of 1 m/s on a plane across y. */
static rebound hit(const oblique *o) {
	const double angle = o->angle * pi / 180, radius = 5e-3;
	const char *zero = o->dim == 3 ? ", 0" : "", *one = o->dim == 3 ? ", 1" : "";
	char law[200];
	snprintf(law, sizeof law, "%s restitution: %.17g, friction: %.17g}",
		o->hertz ? "hertz: {young: 1e13, impact_speed: 1," : "linear: {stiffness: 1e10,", o->restitution,
		o->friction);
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: %u, gravity: [0, 0%s], domain: {lower: [-1, -1%s], upper: [1, 1%s]},\n"
		"time: {end: 1}, output: {every: 1}, bodies: [{plane: {point: [0, 0%s], normal: [0, 1%s]}}],\n"
		"grains: {material: {density: 2500, radius: {mean: %.17g}}, contact: {%s},\n"
		"  place: [{position: [0, %.17g%s], velocity: [%.17g, %.17g%s]}]}}\n",
		o->dim, zero, o->dim == 3 ? ", -1" : "", one, zero, zero, radius, law, radius + 1e-9, zero,
		sin(angle), -cos(angle), zero);
	harness_steps(run, 300);
	const quern_column v = harness_field(run, "grain.velocity"), w = harness_field(run, "grain.spin");
	const rebound r = { v.real[1][0], v.real[0][0], w.real[o->dim == 3 ? 2 : 0][0] * radius };
	harness_close(run);
	return r;
}

/* Where the contact slides to its end it takes mu times the normal impulse, v_t' = v_t - mu (v_n + v_n'), and turns by
 * r w' = -(m r^2/I) mu (v_n + v_n'). The overlap, here 0.001 r, makes levers shorter than r by half of itself. */
static void oblique_impacts(void **unused) {
	(void)unused;
	static const double restitutions[] = { 0.98, 0.5 };
	bool good = true;
	char what[80];
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int which = 0; which < 4; which++) {
			oblique o = { dim, which & 1, restitutions[which >> 1], 0.2, 0 };
			const double factor = dim == 2 ? 3 : 3.5, e = o.restitution,
						 limit = factor * o.friction * (1 + e);
			snprintf(what, sizeof what, "%s, %uD, restitution %g, friction 0.2: m/s",
				o.hertz ? "hertz" : "linear", dim, e);
			table_head(what);
			for (double times = 1.1; times < 10; times *= 2) {
				o.angle = atan(times * limit) * 180 / pi;
				const rebound r = hit(&o);
				const double vn = cos(o.angle * pi / 180), vt = sin(o.angle * pi / 180);
				const double impulse = o.friction * (vn + r.normal);
				snprintf(what, sizeof what, "%.1f degrees: tangential", o.angle);
				good &= table_row(what, r.tangential, vt - impulse, 0.002 * vt);
				good &= table_row(
					"  surface by spin", r.turning, -(factor - 1) * impulse, 0.002 * (factor - 1) * impulse);
			}
		}
	assert_true(good);
}

/* ==== spins ==== */

/* Surfaces that roll on each other exchange nothing but the normal impulse. */
static void opposite_spins(void **unused) {
	(void)unused;
	bool good = true;
	char what[80];
	table_head("two spheres of opposite spin, 0.2 m/s each: after the collision");
	for (int hertz = 0; hertz <= 1; hertz++) {
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: 3, gravity: [0, 0, 0], domain: {lower: [-1, -1, -1], upper: [1, 1, 1]},\n"
			"time: {end: 1}, output: {every: 1}, grains: {material: {density: 2700, radius: {mean: 0.1}},\n"
			"  contact: {%s, restitution: 0.5, friction: 0.4}},\n"
			"  place: [{position: [-0.1001, 0, 0], velocity: [0.2, 0, 0], spin: [0, 3, 5]},\n"
			"    {position: [0.1001, 0, 0], velocity: [-0.2, 0, 0], spin: [0, -3, -5]}]}}\n",
			hertz ? "hertz: {young: 7e8, poisson: 0.33, impact_speed: 0.4" : "linear: {stiffness: 1e6");
		harness_steps(run, 300);
		const quern_column v = harness_field(run, "grain.velocity"), w = harness_field(run, "grain.spin");
		printf("  %s\n", hertz ? "hertz" : "linear");
		for (int i = 0; i < 2; i++) {
			const double sign = harness_field(run, "grain.id").id[i] == 0 ? 1 : -1;
			snprintf(what, sizeof what, "  %s: normal velocity, m/s", sign > 0 ? "first" : "second");
			good &= table_row(what, v.real[0][i], -0.1 * sign, 0.002);
			good &= table_row("    tangential velocity", hypot(v.real[1][i], v.real[2][i]), 0, 1e-14);
			good &= table_row("    spin about y, 1/s", w.real[1][i], 3 * sign, 1e-13);
			good &= table_row("    spin about z, 1/s", w.real[2][i], 5 * sign, 1e-13);
		}
		harness_close(run);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(peaks), cmocka_unit_test(oblique_impacts),
		cmocka_unit_test(opposite_spins) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
