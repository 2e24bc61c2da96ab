/* SPDX-License-Identifier: MIT */
/* A continuum alone keeps its room as it flows, however its points lie, and flows as Bagnold's law has it: down a slope, periodic
 * along it. docs/theory/mpm.md, section 8; docs/decisions/0034-room-of-points.md */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <string.h>

static const double cell = 4e-3, diameter = 2e-3, gravity = 9.81, degree = 3.14159265358979312 / 180;
static const double slow = 0.218, fast = 0.945, number = 0.473, packed = 2004, solid = 2500;

typedef struct chute {
	int cells, along; /* over the depth; along the slope */
	double angle;     /* degrees */
	const char *material, *boundary, *transfer;
} chute;
static const char *const mu_i =
	"mu_i: {bulk_modulus: 1e5, diameter: 0.002, grain_density: 2500, critical_density: 2004, "
	"static_friction: 0.218, limit_friction: 0.945, inertial_number: 0.473}";

static quern_run *open_chute_with(const chute *c, const char *more) {
	const double depth = c->cells * cell, length = c->along * cell, angle = c->angle * degree;
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [%.17g, %.17g], time: {end: 100}, output: {every: 1},\n"
		"domain: {lower: [0, 0], upper: [%.17g, %.17g], periodic: [true, false]},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: %s}}],\n"
		"continuum: {cell: %.17g, transfer: %s, material: {%s}%s,\n"
		"  fill: [{region: {box: {lower: [0, 0], upper: [%.17g, %.17g]}}, stress: at_rest}]}}\n",
		gravity * sin(angle), -gravity * cos(angle), length, 2 * depth, c->boundary, cell, c->transfer,
		c->material, more, length, depth);
}

static quern_run *open_chute(const chute *c) { return open_chute_with(c, ""); }

/* ==== room ==== */

/* In [0, 1), from one call to the next. */
static double drawn(uint64_t *state) {
	*state = *state * 6364136223846793005u + 1442695040888963407u;
	return (double)(*state >> 11) / 9007199254740992.0;
}

/* Anywhere in the layer, and sheared. */
static void mix(quern_run *run, const chute *c, double shear) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	uint64_t state = 14;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		x.real[0][i] = drawn(&state) * c->along * cell;
		x.real[1][i] = (0.25 + drawn(&state) * (c->cells - 0.5)) * cell;
		v.real[0][i] = shear * x.real[1][i];
	}
}

/* Height of the middle of all mass over that of a layer with its density without stress, the mean of some looks. */
static double height(quern_run *run, const chute *c, double from, double until) {
	enum { LOOKS = 10 };
	double sum = 0;
	for (int k = 1; k <= LOOKS; k++) {
		harness_until(run, from + (until - from) * k / LOOKS);
		const quern_column x = harness_field(run, "point.position"), m = harness_field(run, "point.mass");
		double mass = 0, moment = 0;
		for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
			mass += m.real[0][i];
			moment += m.real[0][i] * x.real[1][i];
		}
		sum += moment / mass / (0.5 * mass / (packed * c->along * cell)) / LOOKS;
	}
	return sum;
}

static void mixed_points_keep_their_room(void **unused) {
	(void)unused;
	static const chute cases[] = { { 18, 8, 20, NULL, "{rough: 7.8}", "picflip" },
		{ 18, 8, 20, NULL, "{rough: 7.8}", "apic" },
		{ 18, 8, 20, "drucker_prager: {bulk_modulus: 1e5, density: 2004, friction: 0.364}", "sticky",
			"picflip" } };
	bool good = true;
	table_head("points at random in a layer that flows: height of its middle");
	for (int k = 0; k < 3; k++) {
		chute c = cases[k];
		if (!c.material) c.material = mu_i;
		quern_run *run = open_chute(&c);
		mix(run, &c, 30);
		good &= table_row(k == 0   ? "mu_i, picflip"
						  : k == 1 ? "mu_i, apic"
								   : "drucker_prager",
			height(run, &c, 1.5, 2), 1, 0.02);
		harness_close(run);
	}
	const chute c = { 18, 8, 20, mu_i, "{rough: 7.8}", "picflip" };
	quern_run *run = open_chute_with(&c, ", follow: 0");
	mix(run, &c, 30);
	const double sunk = height(run, &c, 1.5, 2);
	table_note("mu_i whose density does not follow", sunk);
	harness_close(run);
	assert_true(good && sunk < 0.9);
}

/* ---- a heap ---- */

enum { ACROSS = 200, UP = 50 };

/* Of squares with sides of two cells: what they hold, and the volume that their points believe to have. */
typedef struct heap {
	double mass[ACROSS][UP], volume[ACROSS][UP];
} heap;

static bool is_full(const heap *h, int i, int j) { return h->mass[i][j] > 0.75 * packed * 4 * cell * cell; }

/* Density by places over that of the points' volumes, of squares that lie among full ones. */
static double density_by_places(quern_run *run, int *squares) {
	const quern_column x = harness_field(run, "point.position"), m = harness_field(run, "point.mass"),
					   v = harness_field(run, "point.volume");
	static heap h;
	double mass = 0, volume = 0;
	memset(&h, 0, sizeof h);
	for (uint32_t k = 0; k < harness_count(run, "point"); k++) {
		const int i = (int)(x.real[0][k] / (2 * cell)), j = (int)(x.real[1][k] / (2 * cell));
		assert_true(i >= 0 && i < ACROSS && j >= 0 && j < UP);
		h.mass[i][j] += m.real[0][k], h.volume[i][j] += v.real[0][k];
	}
	*squares = 0;
	for (int i = 1; i < ACROSS - 1; i++)
		for (int j = 1; j < UP - 1; j++) {
			bool inside = true;
			for (int a = -1; a <= 1; a++)
				for (int b = -1; b <= 1; b++) inside = inside && is_full(&h, i + a, j + b);
			if (!inside) continue;
			mass += h.mass[i][j], volume += h.volume[i][j];
			(*squares)++;
		}
	return mass / (*squares * 4 * cell * cell) / (mass / volume);
}

static const char *const loosening =
	"mu_i: {bulk_modulus: 3e5, diameter: 0.002, grain_density: 2500, critical_density: 2004, static_friction: 0.25, "
	"limit_friction: 0.75, inertial_number: 0.33, flow_density: 2040, dilation: 0.384}";

/* A column that collapses stretches and stops, and its points lose their order fastest of all. */
static void heaps_keep_their_room(void **unused) {
	(void)unused;
	const struct {
		const char *name, *material, *transfer;
	} cases[] = { { "mu_i, picflip", loosening, "picflip" }, { "mu_i, apic", loosening, "apic" },
		{ "drucker_prager, picflip", "drucker_prager: {bulk_modulus: 3e5, density: 2004, friction: 0.366}",
			"picflip" } };
	bool good = true;
	table_head("a column that has collapsed: density by places over that of its points' volumes");
	for (int k = 0; k < 3; k++) {
		int squares;
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: 2, gravity: [0, -9.81], time: {end: 100}, output: {every: 1},\n"
			"domain: {lower: [0, 0], upper: [1.6, 0.4]},\n"
			"bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: {rough: 6.5}}}, {plane: {point: [0, 0], normal: [1, 0]}}],\n"
			"continuum: {cell: %g, transfer: %s, material: {%s},\n"
			"  fill: [{region: {box: {lower: [0, 0], upper: [0.14, 0.28]}}, stress: at_rest}]}}\n",
			cell, cases[k].transfer, cases[k].material);
		harness_until(run, 0.7);
		good &= table_row(cases[k].name, density_by_places(run, &squares), 1, 0.04);
		assert_true(squares > 50);
		harness_close(run);
	}
	assert_true(good);
}

/* Of a column that falls apart, kinetic energy over the potential energy that it has lost, after 40 ms. */
static double energy_gained(const char *material, const char *step) {
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], time: {end: 0.04%s}, output: {every: 1},\n"
		"domain: {lower: [0, 0], upper: [0.4, 0.2]},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: {rough: 6.5}}}, {plane: {point: [0, 0], normal: [1, 0]}}],\n"
		"continuum: {cell: 0.002, material: {%s},\n"
		"  fill: [{region: {box: {lower: [0, 0], upper: [0.07, 0.14]}}, stress: at_rest}]}}\n",
		step, material);
	double kinetic = 0, potential = 0;
	for (int after = 0; after < 2; after++) {
		const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
						   m = harness_field(run, "point.mass");
		for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
			const double vx = v.real[0][i], vy = v.real[1][i];
			potential += (after ? -1 : 1) * m.real[0][i] * gravity * x.real[1][i];
			kinetic += after * m.real[0][i] * (vx * vx + vy * vy) / 2;
		}
		if (!after) harness_until(run, 0.04);
	}
	harness_close(run);
	return kinetic / potential;
}

/* What flows makes no motion out of nothing: were pressure to grow where flow stretches, waves would, the more the smaller cells are and the less a
 * long step damps them (with a quarter of it, 21 times what weight gave). */
static void flow_makes_no_energy(void **unused) {
	(void)unused;
	const struct {
		const char *name, *material;
	} cases[] = { { "mu_i", mu_i }, { "mu_i with dilation", loosening },
		{ "drucker_prager", "drucker_prager: {bulk_modulus: 3e5, density: 2004, friction: 0.366}" } };
	bool good = true;
	table_head("a column in cells as wide as a grain: kinetic energy over what weight gave");
	for (int k = 0; k < 3; k++) {
		char name[60];
		const double usual = energy_gained(cases[k].material, ""),
					 fine = energy_gained(cases[k].material, ", step: 1.5e-5");
		good &= table_row(cases[k].name, usual, 0, 0.95);
		snprintf(name, sizeof name, "%s, a quarter of the step", cases[k].name);
		good &= table_row(name, fine, usual, 0.02);
	}
	assert_true(good);
}

/* ==== Bagnold ==== */

/* Where all of the layer flows at one inertial number, v = 2/3 I/D sqrt(phi g cos) (H^1.5 - (H - y)^1.5). */
static double bagnold(const chute *c, double inertial, double y) {
	const double depth = c->cells * cell, angle = c->angle * degree, left = depth > y ? depth - y : 0;
	return 2.0 / 3 * inertial / diameter * sqrt(packed / solid * gravity * cos(angle)) *
		   (depth * sqrt(depth) - left * sqrt(left));
}

static double inertial_of(const chute *c) {
	const double slope = tan(c->angle * degree);
	return number * (slope - slow) / (fast - slope);
}

/* Root mean square difference over that of the law. */
static double off(quern_run *run, const chute *c) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	double wrong = 0, whole = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double law = bagnold(c, inertial_of(c), x.real[1][i]), d = v.real[0][i] - law;
		wrong += d * d, whole += law * law;
	}
	return sqrt(wrong / whole);
}

static double energy(quern_run *run) {
	const quern_column v = harness_field(run, "point.velocity");
	double sum = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		sum += v.real[0][i] * v.real[0][i] + v.real[1][i] * v.real[1][i];
	return sum;
}

static void begin(quern_run *run, const chute *c, double inertial) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		v.real[0][i] = bagnold(c, inertial, x.real[1][i]);
}

/* ---- flow at a density of its own ---- */

/* In steady flow the whole layer has one inertial number, and so one density but for what pressure adds. If pressure answered to density with a mean of
 * the pressure alone, waves of both would grow, and swell the layer by a tenth. It begins with the speed of that number: from rest it takes tens of
 * seconds to come to it. */
static void flow_has_its_density(void **unused) {
	(void)unused;
	static const char *const transfers[] = { "picflip", "apic" };
	const double a = 0.384, mu_s = 0.25, mu_2 = 0.75, i0 = 0.33;
	bool good = true;
	table_head("steady flow at its own density: height of its middle");
	for (int k = 0; k < 2; k++) {
		const chute c = { 18, 8, 20, loosening, "{rough: 7.8}", transfers[k] };
		const double slope = tan(c.angle * degree), inertial = i0 * (slope - mu_s) / (mu_2 - slope),
					 pressure = 0.5 * packed * gravity * cos(c.angle * degree) * c.cells * cell;
		quern_run *run = open_chute(&c);
		begin(run, &c, inertial);
		good &= table_row(transfers[k], height(run, &c, 2, 4),
			packed / (2040 * (1 - a * inertial) * (1 + pressure / 3e5)), 0.01);
		harness_close(run);
	}
	assert_true(good);
}

static void bagnold_stays(void **unused) {
	(void)unused;
	static const char *const transfers[] = { "apic", "{picflip: {rate: 0}}" };
	bool good = true;
	table_head("begun with Bagnold's velocity, off after 0.5 s");
	for (int k = 0; k < 2; k++) {
		const chute c = { 20, 4, 20, mu_i, "sticky", transfers[k] };
		quern_run *run = open_chute(&c);
		begin(run, &c, inertial_of(&c));
		harness_until(run, 0.5);
		good &= table_row(transfers[k], off(run, &c), 0, 0.02);
		harness_close(run);
	}
	assert_true(good);
}

/* Off its place by a thousandth of a cell, as in a run that has a seed. */
static void jitter(quern_run *run) {
	const quern_column x = harness_field(run, "point.position");
	uint64_t state = 5;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		for (int k = 0; k < 2; k++) x.real[k][i] += (drawn(&state) - 0.5) * 1e-3 * cell;
}

enum { ROWS = 10 };

/* Of rows two cells high, means over many looks: root mean square difference over that of the law. */
static double rows_off(quern_run *run, const chute *c, double from, double until) {
	enum { LOOKS = 50 };
	double speed[ROWS] = { 0 }, law[ROWS] = { 0 }, wrong = 0, whole = 0;
	for (int k = 1; k <= LOOKS; k++) {
		harness_until(run, from + (until - from) * k / LOOKS);
		const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
		for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
			const int row = (int)fmin(ROWS - 1, x.real[1][i] / (2 * cell));
			speed[row] += v.real[0][i];
			law[row] += bagnold(c, inertial_of(c), x.real[1][i]);
		}
	}
	for (int r = 0; r < ROWS; r++) {
		wrong += (speed[r] / law[r] - 1) * (speed[r] / law[r] - 1) * law[r] * law[r];
		whole += law[r] * law[r];
	}
	return sqrt(wrong / whole);
}

/* With points that are spread and with those that are not. */
static void look_at_both(const chute *c, double (*look)(quern_run *, const chute *, double, double),
	double from, double until, double found[2]) {
	for (int k = 0; k < 2; k++) {
		quern_run *run = open_chute_with(c, k ? ", spread: 0" : "");
		jitter(run);
		found[k] = look(run, c, from, until);
		harness_close(run);
	}
}

/* A flow gathers points in layers a cell apart, where pressure and friction are off. */
static void bagnold_lasts(void **unused) {
	(void)unused;
	const chute c[] = { { 20, 4, 20, mu_i, "sticky", "{picflip: {rate: 0}}, shape: gimp" },
		{ 20, 4, 20, mu_i, "sticky", "picflip, shape: bspline" } };
	bool good = true;
	table_head("from rest, 20 cells deep, ten seconds later: velocity by row, off");
	for (int k = 0; k < 2; k++) {
		double found[2];
		look_at_both(&c[k], rows_off, 10, 14, found);
		good &= table_row(k ? "B-splines and picflip, spread" : "gimp and FLIP, spread", found[0], 0, 0.02);
		table_note("not spread", found[1]);
		good &= found[1] > 0.03;
	}
	assert_true(good);
}

/* The layers of unspread points carry more than they weigh, and swell. Their centre is to be where that of a layer is that its weight presses. */
static void flow_does_not_swell(void **unused) {
	(void)unused;
	static const char *const stiff =
		"mu_i: {bulk_modulus: 3e5, diameter: 0.002, grain_density: 2500, critical_density: 2004, static_friction: 0.218, "
		"limit_friction: 0.945, inertial_number: 0.473}";
	const chute c = { 20, 8, 20, stiff, "sticky", "apic" };
	const double pressed = 1 - 2.0 / 3 * packed * gravity * cos(c.angle * degree) * c.cells * cell / 3e5;
	double found[2];
	table_head("from rest, 20 cells deep, stiffer, apic: height of its middle after 4 to 6 s");
	look_at_both(&c, height, 4, 6, found);
	const bool good = table_row("spread", found[0], pressed, 0.003);
	table_note("not spread", found[1]);
	assert_true(good && found[1] > pressed + 0.01);
}

static void bagnold_is_reached(void **unused) {
	(void)unused;
	const chute c = { 8, 4, 20, mu_i, "sticky", "apic" };
	quern_run *run = open_chute(&c);
	harness_until(run, 2);
	table_head("from rest, 8 cells deep, off");
	const bool good = table_row("after 2 s", off(run, &c), 0, 0.02);
	harness_close(run);
	assert_true(good);
}

/* Below the friction of slow flow a layer that flows comes to rest, above that of fast flow it goes ever faster. */
static void slopes_decide(void **unused) {
	(void)unused;
	const chute gentle = { 8, 4, atan(slow) / degree - 2, mu_i, "sticky", "apic" },
				steep = { 8, 4, atan(fast) / degree + 2, mu_i, "sticky", "apic" },
				middle = { 8, 4, 20, NULL, NULL, NULL };
	table_head("two degrees below and above the range of flow");
	quern_run *run = open_chute(&gentle);
	begin(run, &middle, inertial_of(&middle));
	const double before = energy(run);
	harness_until(run, 2);
	bool good = table_row("below: energy after 2 s over that before", energy(run) / before, 0, 1e-6);
	harness_close(run);
	run = open_chute(&steep);
	harness_until(run, 1);
	const double one = sqrt(energy(run));
	harness_until(run, 2);
	const double two = sqrt(energy(run)),
				 least = gravity * (sin(steep.angle * degree) - fast * cos(steep.angle * degree)),
				 gained = (two - one) / sqrt(harness_count(run, "point"));
	table_note("above: velocity gained in the second second, m/s", gained);
	table_note("what friction leaves of gravity at the least", least);
	good &= gained > least;
	harness_close(run);
	assert_true(good);
}

/* ==== periods narrower than a block of cells ==== */

enum { MOST = 64 };

/* Of points on a lattice: how far they are off it, m; and the most and least in a column. */
static double off_lattice(quern_run *run, int columns, double apart, int most_least[2]) {
	const quern_column x = harness_field(run, "point.position");
	int count[MOST] = { 0 };
	double worst = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double t = (x.real[0][i] - x.real[0][0]) / apart, whole = floor(t + 0.5);
		worst = fmax(worst, fabs(t - whole) * apart);
		count[((int)whole % columns + columns) % columns]++;
	}
	most_least[0] = 0, most_least[1] = INT32_MAX;
	for (int k = 0; k < columns; k++) {
		if (count[k] > most_least[0]) most_least[0] = count[k];
		if (count[k] < most_least[1]) most_least[1] = count[k];
	}
	return worst;
}

/* What flies round a period of one to four cells, many times within its block, stays a lattice: whoever is brought back at last has gone by
 * several periods. */
static void narrow_periods(void **unused) {
	(void)unused;
	const double wide = 0.1, speed = 1.03;
	bool good = true;
	table_head("lattices that fly round narrow periods: off the lattice, cells");
	for (int dim = 2; dim <= 3; dim++)
		for (int cells = 1; cells <= (dim == 2 ? 4 : 2); cells++) {
			char name[40];
			int count[2];
			quern_run *run = harness_open(1,
				"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: [%g, %s], periodic: %s},\n"
				"time: {end: 10, step: 5e-3}, output: {every: 1},\n"
				"continuum: {cell: %g, material: {elastic: {bulk_modulus: 1000, density: 1000}},\n"
				"  fill: [{region: {box: {lower: %s, upper: [%g, %s]}}, velocity: %s}]}}\n",
				dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]", cells * wide,
				dim == 2 ? "0.4" : "0.2, 0.2", dim == 2 ? "[true, true]" : "[true, true, true]", wide,
				dim == 2 ? "[0, 0]" : "[0, 0, 0]", cells * wide, dim == 2 ? "0.4" : "0.2, 0.2",
				dim == 2 ? "[1.03, 0]" : "[1.03, 0, 0]");
			harness_until(run, 5);
			const double off = off_lattice(run, 2 * cells, wide / 2, count);
			snprintf(name, sizeof name, "%d-D, %d cells, %.0f times round", dim, cells,
				5 * speed / (cells * wide));
			good &= table_row(name, off / wide, 0, 1e-9) && count[0] == count[1];
			harness_close(run);
		}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(narrow_periods),
		cmocka_unit_test(mixed_points_keep_their_room), cmocka_unit_test(heaps_keep_their_room),
		cmocka_unit_test(flow_makes_no_energy), cmocka_unit_test(flow_has_its_density),
		cmocka_unit_test(bagnold_stays), cmocka_unit_test(bagnold_lasts),
		cmocka_unit_test(flow_does_not_swell), cmocka_unit_test(bagnold_is_reached),
		cmocka_unit_test(slopes_decide) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
