/* SPDX-License-Identifier: MIT */
/* Resistance to rolling and twisting: what rolls and what twists stops where a constant couple stops it, the springs swing
 * as fast and die down as quickly as the step's limit supposes, books close, and bits do not depend on threads or units. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>
#include <string.h>

static const double pi = 3.141592653589793, gravity = 9.81, radius = 1e-3, density = 2500, young = 1e9;

/* A sphere is a hundredth as heavy as the same disc of one metre; softer laws let both lie as deep. */
static double stiffness(int dim) { return dim == 2 ? 1e5 : 1000; } /* N/m */
static double inertia(int dim) { return dim == 2 ? 0.5 : 0.4; }    /* over m r^2 */
static double mass(int dim) { return density * pi * radius * radius * (dim == 2 ? 1 : 4.0 / 3 * radius); }

typedef struct words {
	char text[100];
} words;

static words vector(int dim, double x, double y, double z) {
	words w;
	if (dim == 2) snprintf(w.text, sizeof w.text, "[%.17g, %.17g]", x, y);
	else snprintf(w.text, sizeof w.text, "[%.17g, %.17g, %.17g]", x, y, z);
	return w;
}

/* About z in both dimensions, about y in 3-D. */
static words spin_of(int dim, double about_y, double about_z) {
	return dim == 2 ? vector(2, about_z, 0, 0) : vector(3, 0, about_y, about_z);
}

/* The law that pushes, and how deep a grain lies in a plane by its weight. */
static words pushing(int dim, bool hertz, double *depth) {
	words w;
	const double weight = mass(dim) * gravity, plate = young / (2 * (1 - 0.25 * 0.25));
	if (hertz) snprintf(w.text, sizeof w.text, "hertz: {young: %g, friction: 0.5}", young);
	else snprintf(w.text, sizeof w.text, "linear: {stiffness: %g, friction: 0.5}", stiffness(dim));
	*depth = hertz ? cbrt(pow(0.75 * weight / (plate * sqrt(radius)), 2)) : weight / stiffness(dim);
	return w;
}

/* One grain at rest on a plane y = 0, but for a velocity along x and a spin; the plane may be a grain that never moves. */
typedef struct start {
	int dim;
	bool hertz, on_grain;
	const char *law, *rolling; /* NULL: the pushing law above */
	double velocity, about_y, about_z;
} start;

static quern_run *lay(const start *s) {
	const int dim = s->dim;
	double depth;
	const words law = pushing(dim, s->hertz, &depth), spin = spin_of(dim, s->about_y, s->about_z);
	const words at = vector(dim, 0.05, s->on_grain ? 0.01 + 2 * radius - depth : radius - depth, 0.05);
	const words below = vector(dim, 0.05, s->on_grain ? 0.01 : 0.09, 0.05);
	return harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s}, time: {end: 1}, output: "
		"{every: 1},\n"
		"bodies: [{plane: {point: %s, normal: %s}}],\n"
		"grains: {material: {density: %g, radius: {mean: %g}}, contact: [{%s}, {rolling: {%s}}],\n"
		"  place: [{position: %s, velocity: %s, spin: %s}, {position: %s, fixed: true}]}}\n",
		dim, vector(dim, 0, -gravity, 0).text, vector(dim, 0, 0, 0).text, vector(dim, 0.1, 0.1, 0.1).text,
		vector(dim, 0, 0, 0).text, vector(dim, 0, 1, 0).text, density, radius, s->law ? s->law : law.text,
		s->rolling, at.text, vector(dim, s->velocity, 0, 0).text, spin.text, below.text);
}

static double spin_about(quern_run *run, int dim, int axis) {
	return harness_field(run, "grain.spin").real[dim == 2 ? 0 : axis][0];
}

/* m v' = -F and q m r^2 w' = F r - mu_r m g r with v = w r: v' = -mu_r g/(1 + q). */
static void rolling_stops(void **state) {
	const double v = 0.1, resistance = 0.1;
	bool good = true;
	(void)state;
	table_head("way until a grain that rolls has stopped, over v^2 (1 + q)/(2 mu_r g)");
	for (int dim = 2; dim <= 3; dim++)
		for (int hertz = 0; hertz < 2; hertz++) {
			char rolling[80], name[60];
			snprintf(
				rolling, sizeof rolling, "stiffness: %g, friction: %g", 0.3 * stiffness(dim), resistance);
			const start s = {
				.dim = dim, .hertz = hertz, .rolling = rolling, .velocity = v, .about_z = -v / radius
			};
			quern_run *run = lay(&s);
			const double way = v * v * (1 + inertia(dim)) / (2 * resistance * gravity),
						 time = v * (1 + inertia(dim)) / (resistance * gravity);
			harness_until(run, 1.3 * time);
			const double x = harness_field(run, "grain.position").real[0][0] - 0.05;
			snprintf(name, sizeof name, "%s, %s", dim == 2 ? "disc" : "sphere", hertz ? "hertz" : "linear");
			good &= table_row(name, x / way, 1, 0.01);
			good &= table_row("  its speed then, over that at the start",
				harness_field(run, "grain.velocity").real[0][0] / v, 0, 1e-3);
			harness_close(run);
		}
	assert_true(good);
}

/* q m r^2 w' = -mu_o m g r */
static void twisting_stops(void **state) {
	const double w = 50, resistance = 0.02;
	bool good = true;
	(void)state;
	table_head("angle until a sphere that twists has stopped, over w^2 q r/(2 mu_o g)");
	for (int hertz = 0; hertz < 2; hertz++) {
		char rolling[120];
		snprintf(rolling, sizeof rolling,
			"stiffness: %g, friction: 0, twisting_friction: %g, twisting_stiffness: 0.5", 0.3 * stiffness(3),
			resistance);
		const start s = { .dim = 3, .hertz = hertz, .rolling = rolling, .about_y = w };
		quern_run *run = lay(&s);
		const double time = w * inertia(3) * radius / (resistance * gravity);
		double angle = 0, before = 0;
		while (quern_run_time(run) < 1.3 * time) {
			harness_steps(run, 1);
			angle += spin_about(run, 3, 1) * (quern_run_time(run) - before);
			before = quern_run_time(run);
		}
		good &= table_row(hertz ? "hertz" : "linear", angle / (0.5 * w * time), 1, 0.01);
		good &= table_row("  its spin then, over that at the start", spin_about(run, 3, 1) / w, 0, 1e-3);
		harness_close(run);
	}
	assert_true(good);
}

typedef struct swing {
	double half_period, decay; /* s; of the amplitude in that time */
} swing;

/* A smooth grain that swings about a contact: from the way between the first two extremes of its spin. */
static swing swing_of(const start *s, int axis, double expected) {
	quern_run *run = lay(s);
	double at[3] = { 0 }, size[3] = { 0 }, past = 0, is = spin_about(run, s->dim, axis), time = 0;
	for (int found = 0; found < 3 && time < 10 * expected;) {
		const double before = is;
		harness_steps(run, 1);
		time = quern_run_time(run);
		is = spin_about(run, s->dim, axis);
		if (time > 0.1 * expected && past != 0 && (is - before) * past < 0)
			at[found] = time, size[found++] = before;
		past = is - before;
	}
	harness_close(run);
	return (swing) { at[2] - at[1], -size[2] / size[1] };
}

/* omega^2 = k/(q m) on a body, a quarter of it on an equal grain that never moves. */
static void springs_swing(void **state) {
	const double ratio = 0.2;
	bool good = true;
	(void)state;
	table_head("half-period of rolling and twisting over pi sqrt(q m/k); decay");
	for (int dim = 2; dim <= 3; dim++)
		for (int way = 0; way < (dim == 2 ? 2 : 3);
			 way++) { /* rolls on a body, on a grain; twists on a body */
			char rolling[120], law[60], name[60];
			const double k = 0.1 * stiffness(dim),
						 expected = pi * sqrt(inertia(dim) * mass(dim) / k) * (way == 1 ? 2 : 1);
			snprintf(law, sizeof law, "linear: {stiffness: %g, friction: 0}", stiffness(dim));
			snprintf(rolling, sizeof rolling, "stiffness: %g, damping: %g, friction: 10%s", k, ratio,
				dim == 3 ? ", twisting_friction: 10" : "");
			const start s = { .dim = dim,
				.on_grain = way == 1,
				.law = law,
				.rolling = rolling,
				.about_y = way == 2 ? 0.2 : 0,
				.about_z = way == 2 ? 0 : 0.2 };
			/* the same dashpot on half the frequency is half as large a share of the critical one */
			const double zeta = way == 1 ? 0.5 * ratio : ratio, root = sqrt(1 - zeta * zeta);
			const swing found = swing_of(&s, way == 2 ? 1 : 2, expected);
			snprintf(name, sizeof name, "%d-D, %s", dim,
				way == 2 ? "twists on a body"
				: way    ? "rolls on a grain"
						 : "rolls on a body");
			good &= table_row(name, found.half_period * root / expected, 1, 0.03);
			good &= table_row(
				"  decay over exp(-pi zeta/sqrt(1 - zeta^2))", found.decay / exp(-pi * zeta / root), 1, 0.03);
		}
	assert_true(good);
}

/* ---- heaps ---- */

typedef struct heap {
	int dim;
	bool hertz;
	double factor; /* of all masses and stiffnesses */
	uint32_t workers, batch;
} heap;

/* Grains that fall on each other, on a floor and against a wall. */
static quern_run *pour(const heap *h) {
	const int dim = h->dim;
	words law;
	if (h->hertz)
		snprintf(law.text, sizeof law.text, "hertz: {young: %.17g, impact_speed: 1}",
			h->factor * (dim == 2 ? 5e8 : 5e7));
	else snprintf(law.text, sizeof law.text, "linear: {stiffness: %.17g}", h->factor * stiffness(dim));
	return harness_open(h->workers,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s}, time: {end: 1},\n"
		"output: {every: 1, fields: [total.kinetic, total.potential]}, observe: [energy], run: {batch: %u},\n"
		"bodies: [{plane: {point: %s, normal: %s}}, {plane: {point: %s, normal: %s}}],\n"
		"grains: {material: {density: %.17g, radius: {mean: %g, spread: 0.2}},\n"
		"  contact: [{%s}, {rolling: {stiffness: %.17g, friction: 0.1%s}}],\n"
		"  fill: {region: {box: {lower: %s, upper: %s}}}}}\n",
		dim, vector(dim, 0.5, -gravity, 0.3).text, vector(dim, 0, 0, -0.05).text,
		vector(dim, 0.2, 0.1, 0.05).text, h->batch, vector(dim, 0, 0, 0).text, vector(dim, 0, 1, 0).text,
		vector(dim, 0, 0, 0).text, vector(dim, 1, 0, 0).text, h->factor * density, radius, law.text,
		0.2 * h->factor * stiffness(dim), dim == 3 ? ", twisting_friction: 0.05" : "",
		vector(dim, 0.002, 0.002, -0.004).text, dim == 2 ? "[0.02, 0.03]" : "[0.01, 0.02, 0.004]");
}

static double all_energy(quern_run *run) {
	static const char *const parts[] = { "total.kinetic", "total.potential", "total.stored", "total.sheared",
		"total.damped", "total.rubbed" };
	double sum = 0;
	harness_look(run);
	for (int p = 0; p < 6; p++) sum += harness_field(run, parts[p]).real[0][0];
	return sum;
}

static void books_close(void **state) {
	bool good = true;
	(void)state;
	table_head("energy not booked in a collapse, over the potential energy released");
	for (int dim = 2; dim <= 3; dim++)
		for (int hertz = 0; hertz < 2; hertz++) {
			const heap h = { dim, hertz, 1, 1, 256 };
			char name[60];
			quern_run *run = pour(&h);
			double first = 0, high = 0, worst = 0;
			for (int look = 0; quern_run_time(run) < 0.15; look++) {
				harness_steps(run, look ? 50 : 1);
				const double sum = all_energy(run);
				if (!look) first = sum, high = harness_field(run, "total.potential").real[0][0];
				worst = fmax(worst, fabs(sum - first));
			}
			const double released = high - harness_field(run, "total.potential").real[0][0];
			snprintf(name, sizeof name, "%d-D, %s, %u grains", dim, hertz ? "hertz" : "linear",
				harness_count(run, "grain"));
			good &= table_row(name, worst / released, 0, 1e-3);
			table_note(
				"  rubbed, by sliding and rolling", harness_field(run, "total.rubbed").real[0][0] / released);
			assert_true(harness_field(run, "total.rubbed").real[0][0] >
						0.02 * released); /* or the test would not see a thing */
			harness_close(run);
		}
	assert_true(good);
}

/* After 0.05 s: the same bits of positions and spins. */
static void same_bits(const heap *a, const heap *b) {
	quern_run *one = pour(a), *other = pour(b);
	const uint32_t n = harness_count(one, "grain");
	assert_int_equal(harness_count(other, "grain"), n);
	harness_until(one, 0.05), harness_until(other, 0.05);
	for (int k = 0; k < a->dim; k++)
		assert_memory_equal(harness_field(one, "grain.position").real[k],
			harness_field(other, "grain.position").real[k], n * sizeof(double));
	for (int k = 0; k < (a->dim == 2 ? 1 : 3); k++)
		assert_memory_equal(harness_field(one, "grain.spin").real[k],
			harness_field(other, "grain.spin").real[k], n * sizeof(double));
	harness_close(one), harness_close(other);
}

static void bits_do_not_depend_on_threads(void **state) {
	(void)state;
	for (int dim = 2; dim <= 3; dim++)
		same_bits(&(heap) { dim, false, 1, 1, 256 }, &(heap) { dim, false, 1, 3, 8 });
}

/* With 64 times all masses and stiffnesses, whose roots are whole, every force is 64 times as large and no grain goes
 * elsewhere. */
static void forces_are_homogeneous(void **state) {
	(void)state;
	for (int dim = 2; dim <= 3; dim++)
		same_bits(&(heap) { dim, false, 1, 1, 256 }, &(heap) { dim, false, 64, 1, 256 });
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(rolling_stops), cmocka_unit_test(twisting_stops),
		cmocka_unit_test(springs_swing), cmocka_unit_test(books_close),
		cmocka_unit_test(bits_do_not_depend_on_threads), cmocka_unit_test(forces_are_homogeneous) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
