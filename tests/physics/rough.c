/* SPDX-License-Identifier: MIT */
/* Rough bodies: friction that grows with the speed of sliding as the material's own grows with its rate of shear, so that the
 * speed at the wall is the slip length over the rate beside it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "../../plugins/mpm/rough.h"
#include "harness.h"
#include "table.h"
#include <string.h>

static const double diameter = 2e-3, gravity = 9.81, degree = 3.14159265358979312 / 180;

/* ==== the law alone ==== */

/* The speed that is left obeys its equation, falls with what presses, and is none where slow friction holds. */
static void law_holds(void **unused) {
	(void)unused;
	const rough_law law = { .slow = 0.26, .fast = 0.6, .number = 0.36, .density = 2500 };
	double worst = 0;
	for (int a = -12; a <= 4; a++)
		for (int b = -12; b <= 4; b++)
			for (int c = -13; c <= 4; c++) {
				const double speed = pow(10, a), pressed = pow(10, b), half = c < -12 ? 0 : pow(10, c);
				const double left = rough_slide(&law, half, speed, pressed);
				if (speed <= law.slow * pressed) assert_true(left == 0);
				assert_true(left >= 0 && left <= speed);
				assert_true(rough_slide(&law, half, speed, 1.1 * pressed) <= left);
				if (!(left > 0)) continue;
				const double friction = law.slow + (law.fast - law.slow) * left / (left + half);
				worst = fmax(worst, fabs(left + pressed * friction - speed) / speed);
			}
	assert_true(table_row("what is left and what is taken are all", worst, 0, 1e-14));
	assert_true(rough_slide(&law, 0, 1, 0.5) == 1 - 0.5 * law.fast);
	assert_true(rough_slide(&law, 1, 0, 0) == 0);
}

/* ==== between two plates, of which one moves ==== */

typedef struct couette {
	uint32_t dim, workers;
	int cells, along, across; /* over the gap; axes of the motion and of the gap */
	double slip, drift;       /* diameters; m/s, of both plates */
	const char *own;          /* friction of the plates; NULL: the material's */
} couette;
static const double gap = 0.032, speed = 1, load = 1e3, bulk = 2e5, packed = 1975;

static const char *triple(char out[80], const couette *c, double along, double across, double rest) {
	double x[3] = { rest, rest, rest };
	x[c->along] = along;
	x[c->across] = across;
	if (c->dim == 2) snprintf(out, 80, "[%.17g, %.17g]", x[0], x[1]);
	else snprintf(out, 80, "[%.17g, %.17g, %.17g]", x[0], x[1], x[2]);
	return out;
}

/* No gravity and a gap that stays: the pressure is what the material begins with. */
static quern_run *open_couette(const couette *c) {
	char t[12][80];
	const double h = gap / c->cells;
	quern_run *run = harness_open(c->workers,
		"{quern: 1, dimension: %u, gravity: %s, domain: {lower: %s, upper: %s, periodic: %s},\n"
		"time: {end: 10}, output: {every: 0.1}, \n"
		"bodies: [{plane: {point: %s, normal: %s, boundary: {rough: %g%s}, motion: {velocity: %s}}},\n"
		"  {plane: {point: %s, normal: %s, boundary: {rough: %g%s}, motion: {velocity: %s}}}],\n"
		"continuum: {cell: %.17g, fill: [{region: {box: {lower: %s, upper: %s}}}],\n"
		"  material: {mu_i: {bulk_modulus: %g, diameter: %g, grain_density: 2500, critical_density: %g,\n"
		"    static_friction: 0.26, limit_friction: 0.6, inertial_number: 0.36}}}}\n",
		c->dim, triple(t[0], c, 0, 0, 0), triple(t[1], c, 0, 0, 0), triple(t[2], c, 4 * h, gap, 4 * h),
		c->dim == 2      ? c->along == 0 ? "[true, false]" : "[false, true]"
		: c->across == 0 ? "[false, true, true]"
		: c->across == 1 ? "[true, false, true]"
						 : "[true, true, false]",
		triple(t[3], c, 0, 0, 0), triple(t[4], c, 0, 1, 0), c->slip, c->own ? c->own : "",
		triple(t[5], c, c->drift, 0, 0), triple(t[6], c, 0, gap, 0), triple(t[7], c, 0, -1, 0), c->slip,
		c->own ? c->own : "", triple(t[8], c, speed + c->drift, 0, 0), h, triple(t[9], c, 0, 0, 0),
		triple(t[10], c, 4 * h, gap, 4 * h), bulk, diameter, packed);
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	const quern_column s = harness_field(run, "point.stress"), m = harness_field(run, "point.mass");
	const quern_column volume = harness_field(run, "point.volume");
	const double density = packed * exp(load / bulk);
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		v.real[c->along][i] = c->drift + speed * x.real[c->across][i] / gap;
		for (uint32_t k = 0; k < c->dim; k++) s.real[k][i] = -load;
		m.real[0][i] = density * volume.real[0][i];
	}
	return run;
}

typedef struct line {
	double at_wall, slope;
} line;

/* Speed over the gap, by least squares; all points but those next to the plates. */
static line fit(quern_run *run, const couette *c) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	double n = 0, sx = 0, sv = 0, sxx = 0, sxv = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double y = x.real[c->across][i] / gap - 0.5, u = v.real[c->along][i] - c->drift;
		if (fabs(y) > 0.5 - 1.0 / c->cells) continue;
		n++, sx += y, sv += u, sxx += y * y, sxv += y * u;
	}
	const double slope = (sxv - sx * sv / n) / (sxx - sx * sx / n), middle = (sv - slope * sx) / n;
	return (line) { middle - 0.5 * slope, slope / gap };
}

/* What the flow shows after it has become steady, the mean of ten looks: slip length in diameters. */
static line steady(const couette *c) {
	enum { LOOKS = 10 };
	quern_run *run = open_couette(c);
	line sum = { 0 };
	harness_until(run, 0.4);
	for (int k = 1; k <= LOOKS; k++) {
		harness_until(run, 0.4 + 0.02 * k);
		const line f = fit(run, c);
		sum.at_wall += f.at_wall / LOOKS;
		sum.slope += f.slope / LOOKS;
	}
	harness_close(run);
	return sum;
}
static double shown(const couette *c) {
	const line f = steady(c);
	return f.at_wall / f.slope / diameter;
}

/* Converges with the cells; a wall's first cell is off by an eighth of itself. */
static void slip_is_its_length(void **unused) {
	(void)unused;
	static const double lengths[] = { 0, 1, 2.5, 8 };
	bool good = true;
	char what[80];
	table_head("mu(I) between rough plates: speed at the wall over rate, diameters");
	for (int k = 0; k < 4; k++)
		for (int cells = 8; cells <= 32; cells *= 2) {
			const couette c = { 2, 1, cells, 0, 1, lengths[k], 0, NULL };
			snprintf(what, sizeof what, "slip length %g, %d cells", lengths[k], cells);
			good &= table_row(what, shown(&c), lengths[k], 0.03 * lengths[k] + 0.12 * gap / cells / diameter);
		}
	assert_true(good);
}

/* Plates with a friction of their own: what both bear is one stress, so that mu_w(v) = mu(I). */
static void plates_have_their_own(void **unused) {
	(void)unused;
	static const struct {
		const char *what, *own;
		double slow, fast, number;
	} rows[] = { { "slower friction", ", static_friction: 0.2, limit_friction: 0.6, inertial_number: 0.36",
					 0.2, 0.6, 0.36 },
		{ "all three", ", static_friction: 0.15, limit_friction: 0.8, inertial_number: 0.5", 0.15, 0.8,
			0.5 } };
	bool good = true;
	table_head("plates whose friction is their own: speed at the wall, m/s");
	for (int k = 0; k < 2; k++) {
		const couette c = {
			.dim = 2, .workers = 1, .cells = 16, .across = 1, .slip = 2.5, .own = rows[k].own
		};
		const line f = steady(&c);
		const double time = sqrt(2500 / load), inside = f.slope * diameter * time;
		const double friction = 0.26 + (0.6 - 0.26) / (1 + 0.36 / inside);
		const double number = rows[k].number * (friction - rows[k].slow) / (rows[k].fast - friction);
		good &= table_row(rows[k].what, f.at_wall, c.slip * number / time, 0.12 * gap / 16 * f.slope);
		assert_true(fabs(c.slip * number / time - c.slip * inside / time) >
					0.2 * f.at_wall); /* it makes a difference */
	}
	assert_true(good);
}

/* Neither the third dimension nor what the axes are called nor a motion of all makes a difference. */
static void everywhere_the_same(void **unused) {
	(void)unused;
	static const struct {
		const char *what;
		couette c;
	} rows[] = { { "axes exchanged", { 2, 1, 16, 1, 0, 2.5, 0, NULL } },
		{ "plates that move both ways", { 2, 1, 16, 0, 1, 2.5, -0.5, NULL } },
		{ "3-D, along x between y", { 3, 1, 16, 0, 1, 2.5, 0, NULL } },
		{ "3-D, along z between x", { 3, 1, 16, 2, 0, 2.5, 0, NULL } },
		{ "3-D, along y between z", { 3, 1, 16, 1, 2, 2.5, 0, NULL } } };
	const couette plane = { 2, 1, 16, 0, 1, 2.5, 0, NULL };
	const double wanted = shown(&plane);
	bool good = true;
	table_head("the same in other ways: diameters");
	for (int k = 0; k < 5; k++) good &= table_row(rows[k].what, shown(&rows[k].c), wanted, 0.15);
	assert_true(good);
}

/* To the bit, with any number of workers. */
static void workers_do_not_matter(void **unused) {
	(void)unused;
	quern_run *run[2];
	for (int k = 0; k < 2; k++) {
		const couette c = { 3, k ? 4 : 1, 8, 0, 1, 2.5, 0, NULL };
		run[k] = open_couette(&c);
		harness_until(run[k], 0.02);
	}
	assert_int_equal(harness_count(run[0], "point"), harness_count(run[1], "point"));
	for (int axis = 0; axis < 3; axis++)
		assert_memory_equal(harness_field(run[0], "point.velocity").real[axis],
			harness_field(run[1], "point.velocity").real[axis],
			harness_count(run[0], "point") * sizeof(quern_real));
	for (int k = 0; k < 2; k++) harness_close(run[k]);
}

/* ==== a layer on an incline ==== */

/* Gravity is turned; what the layer does is said by its floor alone where the layer itself would hold. */
static quern_run *open_layer(double angle, double slip, const char *own, const char *material) {
	const double c = cos(angle * degree), s = sin(angle * degree);
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [%.17g, %.17g], domain: {lower: [0, 0], upper: [0.016, 0.048], periodic: "
		"[true, false]},\n"
		"time: {end: 10}, output: {every: 0.1, fields: [body.impulse]},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: {rough: %g%s}}}],\n"
		"continuum: {cell: 0.004, fill: [{region: {box: {lower: [0, 0], upper: [0.016, 0.04]}}, stress: at_rest,\n"
		"  lateral: 1}], material: {%s}}}\n",
		gravity * s, -gravity * c, slip, own, material);
}

static double mean_speed(quern_run *run) {
	const quern_column v = harness_field(run, "point.velocity"), m = harness_field(run, "point.mass");
	double sum = 0, mass = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		sum += m.real[0][i] * v.real[0][i];
		mass += m.real[0][i];
	}
	return sum / mass;
}

static const char soft[] =
	"mu_i: {bulk_modulus: 2e5, diameter: 0.002, grain_density: 2500, critical_density: 1975, "
	"static_friction: 0.3, limit_friction: 0.6, inertial_number: 0.36}";
static const char plain[] = "drucker_prager: {bulk_modulus: 2e5, density: 1975, friction: 0.3}";

/* Below the angle of its slow friction (16.7 degrees) the layer stays, and its floor takes all of its weight. */
static bool stays(const char *what, const char *material) {
	quern_run *run = open_layer(15, 4, "", material);
	harness_until(run, 0.3);
	const double creep = mean_speed(run);
	const double x = harness_field(run, "body.impulse").real[0][0],
				 y = harness_field(run, "body.impulse").real[1][0];
	harness_close(run);
	printf("  %s\n", what);
	bool good = table_row("  held below its angle: speed, m/s", creep, 0, 2e-3);
	good &= table_row("  what the floor bears, along over across", -x / y, tan(15 * degree), 2e-3);
	return good;
}

static double acceleration(double angle, double slip, const char *own, const char *material) {
	quern_run *run = open_layer(angle, slip, own, material);
	harness_until(run, 0.1);
	const double before = mean_speed(run), begin = quern_run_time(run);
	harness_until(run, 0.2);
	const double out = (mean_speed(run) - before) / (quern_run_time(run) - begin);
	harness_close(run);
	return out;
}

static void layers_on_inclines(void **unused) {
	(void)unused;
	bool good = true;
	table_head("a layer on a rough incline");
	good &= stays("mu_i", soft);
	good &= stays("drucker_prager", plain);
	for (int angle = 20; angle <= 40; angle += 10) {
		char what[80];
		snprintf(what, sizeof what, "one friction for all speeds, %d degrees: acceleration, m/s^2", angle);
		const double wanted = gravity * (sin(angle * degree) - 0.3 * cos(angle * degree));
		good &= table_row(what, acceleration(angle, 4, "", plain), wanted, 0.02 * wanted);
	}
	/* with a slip length beyond all speeds the floor has slow friction alone */
	good &= table_row("slow friction alone, 25 degrees: acceleration, m/s^2", acceleration(25, 1e6, "", soft),
		gravity * (sin(25 * degree) - 0.3 * cos(25 * degree)), 0.02);
	/* a floor with less friction than the layer, which goes as one piece */
	const char *own = ", static_friction: 0.2, limit_friction: 0.2, inertial_number: 0.3";
	const double wanted = gravity * (sin(15 * degree) - 0.2 * cos(15 * degree));
	good &= table_row("friction of the floor's own, mu_i, 15 degrees: acceleration, m/s^2",
		acceleration(15, 4, own, soft), wanted, 0.02 * wanted);
	good &= table_row("friction of the floor's own, drucker_prager, the same",
		acceleration(15, 4, own, plain), wanted, 0.02 * wanted);
	assert_true(good);
}

/* Settled grains that slide without friction on the floor hang on a continuum of half their weight, everywhere. Before the
 * coupling the floor holds the continuum with room to spare; that rest must hold the grains after it, or all creeps. */
static void floor_holds_grains_too(void **unused) {
	(void)unused;
	enum { LOOKS = 20 };
	const double angle = 9 * degree;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [%.17g, %.17g], domain: {lower: [0, 0], upper: [0.04, 0.06], periodic: [true, "
		"false]},\n"
		"time: {end: 10}, output: {every: 0.1}, bodies: [{plane: {point: [0, 0], normal: [0, 1], while: settling}},\n"
		"  {plane: {point: [0, 0], normal: [0, 1], boundary: {rough: 4}, contact: {friction: 0}, while: running}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}}, overlap: {most: 0},\n"
		"  contact: {linear: {stiffness: 2e5, friction: 0.4}}, fill: {region: {box: {lower: [0, 0], upper: [0.04, 0.035]}},\n"
		"  settle: true}}, continuum: {cell: 0.004, material: {%s}}, hybrid: {substeps: 20,\n"
		"  oracle: [{fixed: {boxes: [{lower: [-1, -1], upper: [1, 1], zone: hybrid}]}}]}}\n",
		gravity * sin(angle), -gravity * cos(angle), soft);
	harness_settle(run);
	harness_until(run, 0.2);
	double creep = 0;
	for (int k = 1; k <= LOOKS; k++) {
		harness_until(run, 0.2 + 0.01 * k);
		creep += mean_speed(run) / LOOKS;
	}
	harness_close(run);
	table_head("a layer of grains and continuum on an incline of 9 degrees");
	assert_true(table_row("mean speed of the continuum, m/s", creep, 0, 2e-4));
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(law_holds), cmocka_unit_test(slip_is_its_length),
		cmocka_unit_test(plates_have_their_own), cmocka_unit_test(everywhere_the_same),
		cmocka_unit_test(workers_do_not_matter), cmocka_unit_test(layers_on_inclines),
		cmocka_unit_test(floor_holds_grains_too) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
