/* SPDX-License-Identifier: MIT */
/* Open faces let material out and sources bring it in: what passes is booked, and the books close over grains and over
 * points to round-off. docs/theory/flow.md */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "scene_text.h"
#include "table.h"
#include <observe.h>
#include <string.h>

static const char *const faces[] = { "lower_x", "upper_x", "lower_y", "upper_y", "lower_z", "upper_z" };

static double total(quern_run *run, const char *field, int component, uint32_t n) {
	const quern_column c = harness_field(run, field);
	double sum = 0;
	for (uint32_t i = 0; i < n; i++) sum += c.real[component][i];
	return sum;
}

/* ---- grains that fly out through each face ---- */

enum { MOST = 6 };

typedef struct {
	double x[3], v[3], mass;
	int face;
} flyer;

/* The same steps as the program's: v += dt g, then x += dt v, until it is outside. */
static void fly(flyer *f, int dim, const double g[3], double dt) {
	for (f->face = -1; f->face < 0;)
		for (int k = 0; k < dim; k++) {
			f->v[k] += dt * g[k];
			f->x[k] += dt * f->v[k];
			if (k < dim - 1) continue;
			for (int a = dim - 1; a >= 0; a--)
				if (f->x[a] < 0 || f->x[a] > 1) f->face = 2 * a + (f->x[a] > 1);
		}
}

static quern_run *open_flight(int dim, uint32_t workers, flyer f[MOST], const double g[3]) {
	text t = { 0 };
	text_add(&t,
		"{quern: 1, dimension: %d, gravity: [%.17g, %.17g%s], time: {end: 10, step: 0.001}, output: {every: "
		"10},\n",
		dim, g[0], g[1], dim == 3 ? ", 0" : "");
	text_add(&t, "domain: {lower: [0, 0%s], upper: [1, 1%s], open: [", dim == 3 ? ", 0" : "",
		dim == 3 ? ", 1" : "");
	for (int k = 0; k < 2 * dim; k++) text_add(&t, "%s%s", k ? ", " : "", faces[k]);
	text_add(&t, "]},\ngrains: {material: {density: 2500, radius: {mean: 0.01}}, contact: [], place: [");
	for (int i = 0; i < 2 * dim; i++) {
		f[i] = (flyer) { .mass = 2500 * 3.141592653589793 * 1e-4 * (dim == 2 ? 1 : 4.0 / 3 * 0.01) };
		text_add(&t, "%s{position: [", i ? ", " : "");
		for (int k = 0; k < dim; k++)
			text_add(&t, "%s%.17g", k ? ", " : "", f[i].x[k] = 0.3 + 0.03 * i + 0.1 * k);
		text_add(&t, "], velocity: [");
		for (int k = 0; k < dim; k++)
			text_add(&t, "%s%.17g", k ? ", " : "", f[i].v[k] = k == i / 2 ? (i % 2 ? 4 : -4) : 0.1 * (i - 2));
		text_add(&t, "]}");
	}
	text_add(&t, "]}}\n");
	return harness_open(workers, "%s", t.data);
}

/* One grain through every face: its mass, number and momentum are that face's, to the bits that the steps leave. */
static void grains_leave(void **state) {
	const double g[3] = { 0.3, -1.7, 0 };
	bool good = true;
	(void)state;
	for (int dim = 2; dim <= 3; dim++) {
		flyer f[MOST];
		char what[80];
		quern_run *run = open_flight(dim, 1, f, g);
		harness_settle(run);
		harness_until(run, 0.5);
		assert_int_equal(harness_count(run, "grain"), 0);
		snprintf(what, sizeof what, "a grain through each face of a box in %d-D: booked over its own", dim);
		table_head(what);
		for (int i = 0; i < 2 * dim; i++) {
			fly(&f[i], dim, g, 0.001);
			assert_int_equal(f[i].face, i);
			good &=
				table_row(faces[i], harness_field(run, "grain_face.mass").real[0][i] / f[i].mass, 1, 1e-12);
			good &= table_row("  count", harness_field(run, "grain_face.count").real[0][i], 1, 0);
			for (int k = 0; k < dim; k++)
				good &= table_row("  momentum over 4 m/s of it less the flight's",
					harness_field(run, "grain_face.momentum").real[k][i] / (4 * f[i].mass) - f[i].v[k] / 4, 0,
					1e-12);
		}
		harness_close(run);
	}
	assert_true(good);
}

/* ---- a heap that runs out over an edge ---- */

static quern_run *open_spill(uint32_t workers, uint32_t batch) {
	return harness_open(workers,
		"{quern: 1, dimension: 2, seed: 4, gravity: [0, -9.81], time: {end: 1}, output: {every: 0.3, fields: "
		"[body.impulse]}, run: "
		"{batch: %u},\n"
		"domain: {lower: [0, -0.05], upper: [0.1, 0.1], open: [lower_y, upper_x]},\n"
		"bodies: [{plane: {point: [0, 0], normal: [1, 0]}}, {segment: {from: [0, 0], to: [0.07, 0]}}],\n"
		"observe: [energy], grains: {material: {density: 2500, radius: {mean: 0.001}}, contact: {linear: "
		"{stiffness: 1e5}}, overlap: {most: 0},\n"
		"  fill: {region: {box: {lower: [0.001, 0.001], upper: [0.06, 0.03]}}}}}\n",
		batch);
}

/* Grains of one size, so that rounding has the same sign every time: mass and momentum of what is there and what has left
 * are what there was and what bodies and gravity gave. */
static void spills_close(void **state) {
	quern_run *run = open_spill(1, 256);
	(void)state;
	harness_settle(run);
	const double whole = quern_run_carries(run, "mass");
	double pull = 0;
	while (quern_run_time(run) < 0.28) {
		const double before = quern_run_carries(run, "mass");
		harness_steps(run, 1);
		pull += before * 9.81 * run->clock.dt;
	}
	const double left = total(run, "grain_face.mass", 0, 4), count = total(run, "grain_face.count", 0, 4);
	const double round_off =
		1e-12 + 1.2e-16 * (double)run->clock.substep; /* of every v += g dt, as the audit of hybrids */
	table_head("a fill that spills over an edge: books over what there was");
	table_note("share that has left", left / whole);
	bool good = table_row(
		"mass that is there and that has left", (quern_run_carries(run, "mass") + left) / whole, 1, 1e-12);
	good &= table_row(
		"mass over the number that has left", left / (count * 2500 * 3.141592653589793e-6), 1, 1e-12);
	const quern_account a = quern_run_account(run);
	good &= table_row("defect of the account", quern_run_mass_defect(run, &a), 0, 1e-12);
	const double up = quern_run_carries(run, "momentum_y") + total(run, "grain_face.momentum", 1, 4) + pull -
					  total(run, "body.impulse", 1, 2);
	good &= table_row("momentum along y, over that of gravity", up / pull, 0, round_off);
	const double along = quern_run_carries(run, "momentum_x") + total(run, "grain_face.momentum", 0, 4) -
						 total(run, "body.impulse", 0, 2);
	good &= table_row("momentum along x, over that of gravity", along / pull, 0, round_off);
	assert_true(count > 50);
	harness_close(run);
	assert_true(good);
}

/* Which grains are left, and where, does not depend on threads or batches. */
static void spills_are_the_same(void **state) {
	quern_run *one = open_spill(1, 256), *two = open_spill(2, 16);
	(void)state;
	harness_until(one, 0.2);
	harness_until(two, 0.2);
	const uint32_t n = harness_count(one, "grain");
	assert_int_equal(harness_count(two, "grain"), n);
	for (int k = 0; k < 2; k++)
		assert_memory_equal(harness_field(one, "grain.position").real[k],
			harness_field(two, "grain.position").real[k], n * sizeof(double));
	assert_memory_equal(
		harness_field(one, "grain.id").id, harness_field(two, "grain.id").id, n * sizeof(int64_t));
	assert_memory_equal(harness_field(one, "grain_face.mass").real[0],
		harness_field(two, "grain_face.mass").real[0], 4 * sizeof(double));
	harness_close(one);
	harness_close(two);
}

/* ---- points ---- */

/* A block of points that moves out through one face as if there were none. */
static bool stream(int dim, int face) {
	const int axis = face / 2, sign = face % 2 ? 1 : -1;
	text t = { 0 };
	char velocity[40], what[80];
	snprintf(velocity, sizeof velocity, "%d, %d%s%s", axis == 0 ? sign : 0, axis == 1 ? sign : 0,
		dim == 3 ? ", " : "", dim == 3 ? axis == 2 ? face % 2 ? "1" : "-1" : "0" : "");
	text_add(&t,
		"{quern: 1, dimension: %d, gravity: [0, 0%s], time: {end: 1}, output: {every: 1, fields: "
		"[total.faces]},\n",
		dim, dim == 3 ? ", 0" : "");
	text_add(&t, "domain: {lower: [0, 0%s], upper: [1, 1%s], open: [%s]},\n", dim == 3 ? ", 0" : "",
		dim == 3 ? ", 1" : "", faces[face]);
	text_add(&t,
		"continuum: {cell: 0.1, material: {elastic: {bulk_modulus: 1e5, density: 1000}},\n"
		"  fill: {region: {box: {lower: [0.3, 0.3%s], upper: [0.7, 0.7%s]}}, velocity: [%s]}}}\n",
		dim == 3 ? ", 0.3" : "", dim == 3 ? ", 0.7" : "", velocity);
	quern_run *run = harness_open(1, "%s", t.data);
	const char *const momenta[] = { "momentum_x", "momentum_y", "momentum_z" };
	const double whole = quern_run_carries(run, "mass"), begun = quern_run_carries(run, momenta[axis]);
	harness_until(run, 0.5);
	const double half = harness_field(run, "point_face.mass").real[0][face] / whole;
	snprintf(what, sizeof what, "a block of points through %s in %d-D", faces[face], dim);
	table_head(what);
	bool good = table_row("half of it has left when its middle should", half, 0.5, 0.13);
	const double momentum = quern_run_carries(run, momenta[axis]) +
							harness_field(run, "point_face.momentum").real[axis][face] -
							harness_field(run, "total.faces").real[axis][0];
	good &= table_row("momentum, there and left, less the impulses of nodes", momentum / begun, 1, 1e-12);
	good &= table_row("velocity of what is there",
		quern_run_carries(run, momenta[axis]) / quern_run_carries(run, "mass") * sign, 1, 1e-9);
	harness_until(run, 0.8);
	assert_int_equal(harness_count(run, "point"), 0);
	good &= table_row(
		"mass that has left", harness_field(run, "point_face.mass").real[0][face] / whole, 1, 1e-12);
	harness_close(run);
	return good;
}

static void points_leave(void **state) {
	bool good = true;
	(void)state;
	for (int dim = 2; dim <= 3; dim++)
		for (int face = 0; face < 2 * dim; face++) good &= stream(dim, face);
	assert_true(good);
}

/* A block that falls through the floor: what is still there falls as freely as before, and the books hold gravity. */
static void points_fall(void **state) {
	quern_run *run =
		harness_open(1, "{quern: 1, dimension: 2, gravity: [0, -10], time: {end: 1}, output: {every: 1, "
						"fields: [total.faces]},\n"
						"domain: {lower: [0, 0], upper: [1, 1], open: [lower_y]},\n"
						"continuum: {cell: 0.1, material: {elastic: {bulk_modulus: 1e5, density: 1000}},\n"
						"  fill: {region: {box: {lower: [0.3, 0.1], upper: [0.7, 0.6]}}}}}\n");
	const double whole = quern_run_carries(run, "mass");
	double pull = 0;
	(void)state;
	while (quern_run_time(run) < 0.3) {
		const double before = quern_run_carries(run, "mass");
		harness_steps(run, 1);
		pull += before * 10 * run->clock.dt;
	}
	const double left = total(run, "point_face.mass", 0, 4), there = quern_run_carries(run, "mass");
	const double momentum = quern_run_carries(run, "momentum_y");
	table_head("a block of points that falls through an open floor");
	table_note("share that has left", left / whole);
	bool good = table_row("mass, there and left", (there + left) / whole, 1, 1e-12);
	good &= table_row(
		"velocity of what is there over g t", -momentum / there / (10 * quern_run_time(run)), 1, 1e-9);
	good &= table_row("momentum, there and left, over that of gravity",
		(momentum + total(run, "point_face.momentum", 1, 4) - harness_field(run, "total.faces").real[1][0]) /
			pull,
		-1, 1e-12);
	assert_true(left > 0.3 * whole && there > 0.1 * whole);
	harness_close(run);
	assert_true(good);
}

/* ---- sources ---- */

static quern_run *open_source(uint32_t workers, uint32_t batch, const char *section) {
	return harness_open(workers,
		"{quern: 1, dimension: 2, seed: 9, gravity: [0, 0], time: {end: 1}, output: {every: 0.5}, run: "
		"{batch: %u},\n"
		"domain: {lower: [0, 0], upper: [0.2, 0.1], open: [upper_x]}, observe: [energy, outflow], %s}\n",
		batch, section);
}

static const char grains[] = "grains: {material: {density: 2500, radius: {mean: 0.001, spread: 0.1}}, "
							 "contact: {linear: {stiffness: 1e4}},\n"
							 "  source: [{region: {box: {lower: [0.01, 0.02], upper: [0.03, 0.08]}}, rate: "
							 "5, velocity: [0.5, 0], from: 0.1}]}";
static const char points[] =
	"continuum: {cell: 0.01, material: {elastic: {bulk_modulus: 1e4, density: 1000}},\n"
	"  source: {region: {box: {lower: [0.01, 0.02], upper: [0.03, 0.08]}}, rate: 5, velocity: [0.5, 0], "
	"from: 0.1, every: 1}}";

/* What is poured follows the rate to within one entry; what is there, has left and was poured agree. */
static bool pour(const char *section, const char *set, double largest, int every) {
	char mass[40], momentum[40], face[40], what[80];
	quern_run *run = open_source(1, 256, section);
	bool good = true;
	snprintf(mass, sizeof mass, "%s_source.mass", set);
	snprintf(momentum, sizeof momentum, "%s_source.momentum", set);
	snprintf(face, sizeof face, "%s_face.mass", set);
	snprintf(what, sizeof what, "a source of %ss at 5 kg/s from 0.1 s on", set);
	table_head(what);
	for (double time = 0.05; time < 0.75; time += 0.2) {
		harness_until(run, time);
		const double poured = harness_field(run, mass).real[0][0],
					 due = time > 0.1 ? 5 * (quern_run_time(run) - 0.1) : 0;
		good &=
			table_row("poured, kg", poured, due - 0.5 * largest, 0.5 * largest + 5 * every * run->clock.dt);
	}
	const double poured = harness_field(run, mass).real[0][0], left = total(run, face, 0, 4);
	table_note("of which have left, kg", left);
	assert_true(left > 0);
	good &=
		table_row("there and left over poured", (quern_run_carries(run, "mass") + left) / poured, 1, 1e-12);
	good &= table_row("its momentum", harness_field(run, momentum).real[0][0] / (0.5 * poured), 1, 1e-12);
	const quern_account a = quern_run_account(run);
	good &= table_row("defect of the account", quern_run_mass_defect(run, &a), 0, 1e-12);
	harness_close(run);
	return good;
}

static void sources_pour(void **state) {
	(void)state;
	const bool good = pour(grains, "grain", 2500 * 3.141592653589793 * 1.44e-6, 100);
	assert_true(pour(points, "point", 1000 * 25e-6, 1) && good);
}

/* A stage of the scene that doubles the rate does so from then on. */
static void rates_change(void **state) {
	char section[600];
	bool good = true;
	(void)state;
	table_head("sources at 5 kg/s from 0.1 s on, at 10 kg/s from 0.3 s on");
	for (int c = 0; c < 2; c++) {
		snprintf(section, sizeof section, "%s, stages: [{for: 0.3}, {set: {%s.rate: 10}}]",
			c ? points : grains, c ? "continuum.source" : "grains.source.0");
		quern_run *run = open_source(1, 256, section);
		harness_until(run, 0.5);
		const double due = 5 * 0.2 + 10 * (quern_run_time(run) - 0.3),
					 poured = quern_run_carries(run, "poured");
		const double slack = c ? 0.025 + 10 * run->clock.dt : 0.012 + 10 * 100 * run->clock.dt;
		good &= table_row(c ? "points, kg" : "grains, kg", poured, due, slack);
		harness_close(run);
	}
	assert_true(good);
}

/* New entries are the same ones for any number of threads and any batch. */
static void sources_are_the_same(void **state) {
	(void)state;
	for (int c = 0; c < 2; c++) {
		const char *section = c ? points : grains, *set = c ? "point" : "grain";
		char name[40];
		quern_run *one = open_source(1, 256, section), *two = open_source(2, 16, section);
		harness_until(one, 0.4);
		harness_until(two, 0.4);
		const uint32_t n = harness_count(one, set);
		assert_true(n > 50);
		assert_int_equal(harness_count(two, set), n);
		snprintf(name, sizeof name, "%s.position", set);
		for (int k = 0; k < 2; k++)
			assert_memory_equal(
				harness_field(one, name).real[k], harness_field(two, name).real[k], n * sizeof(double));
		harness_close(one);
		harness_close(two);
	}
}

/* No two newcomers overlap: grains that drift apart at one speed have no energy in their contacts, ever. And what is brought in
 * and taken out is all that changes the budget of energy. */
static void budget_closes(void **state) {
	quern_run *run = open_source(1, 256, grains);
	quern_series series;
	bool good = true;
	(void)state;
	assert_int_equal(quern_series_init(&series, run, 0), QUERN_OK);
	table_head("budget of energy of a source and an outlet, over what was brought");
	for (double time = 0.1; time < 0.75; time += 0.15) {
		harness_until(run, time);
		harness_look(run);
		assert_int_equal(quern_series_add(&series, run), QUERN_OK);
		double budget = NAN, stored = NAN;
		for (size_t c = 0; c < series.n; c++) {
			if (!strcmp(series.column[c].name, "energy.budget")) budget = series.column[c].last;
			if (!strcmp(series.column[c].name, "energy.stored")) stored = series.column[c].last;
		}
		const double brought = 0.5 * 0.25 * quern_run_carries(run, "poured") + 1e-300;
		good &= table_row("budget", budget / brought, 0, 1e-12);
		good &= table_row("in springs", stored / brought, 0, 1e-12);
	}
	quern_series_finish(&series);
	harness_close(run);
	assert_true(good);
}

/* A region that is kept full holds no more than fits; a rate beyond what there is room for waits. */
static void full_and_late(void **state) {
	static const char *const source =
		"grains: {material: {density: 2500, radius: {mean: 0.001}}, contact: {linear: {stiffness: 1e4}},\n"
		"  source: {region: {box: {lower: [0.01, 0.02], upper: [0.03, 0.04]}}, %s}}";
	char section[400];
	bool good = true;
	(void)state;
	table_head("sources that stand still in a region of 10 x 10 diameters, and a radius around");
	for (int c = 0; c < 3; c++) {
		snprintf(section, sizeof section, source,
			c == 0   ? "keep: full, packer: two_point_tangent"
			: c == 1 ? "keep: full, mass: 0.1"
					 : "rate: 100");
		quern_run *run = open_source(1, 256, section);
		harness_until(run, 0.05);
		const uint32_t n = harness_count(run, "grain");
		const double mass = 2500 * 3.141592653589793e-6, poured = quern_run_carries(run, "poured");
		const double waiting = harness_field(run, "grain_source.waiting").real[0][0];
		const double late =
			(100 * run->clock.dt + mass / 100) / quern_run_time(run); /* since the last look */
		if (c == 0) good &= table_row("kept full: packing fraction", n * mass / 2500 / 4.84e-4, 0.78, 0.06);
		if (c == 1) good &= table_row("kept full up to a mass: poured", poured, 0.1 - 0.5 * mass, 0.5 * mass);
		if (c == 2)
			good &= table_row("a rate: poured and waiting over due",
				(poured + waiting) / (100 * quern_run_time(run)), 1 - 0.5 * late, 0.5 * late);
		if (c == 2) good &= table_row("  of which waits", waiting > 4, 1, 0);
		harness_close(run);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(grains_leave), cmocka_unit_test(spills_close),
		cmocka_unit_test(spills_are_the_same), cmocka_unit_test(points_leave), cmocka_unit_test(points_fall),
		cmocka_unit_test(sources_pour), cmocka_unit_test(rates_change),
		cmocka_unit_test(sources_are_the_same), cmocka_unit_test(budget_closes),
		cmocka_unit_test(full_and_late) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
