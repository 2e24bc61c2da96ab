/* SPDX-License-Identifier: MIT */
/* What a zone update makes of points that are too many in a cell, or too few: mass, momentum and volume are kept to
 * round-off, so is the sum of volume times stress, and a point that was open is open afterwards, as loose as before; in a cell that becomes
 * all continuum too. Stages themselves are called, between two steps, on points that the test has crowded or opened. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>
#include <quern/grid.h>
#include <quern/oracle.h>
#include <stdlib.h>
#include <string.h>

static const double cell = 4e-3, density = 1900;
static const char *const materials[] = { "mu_i: {bulk_modulus: 1e5, critical_density: 1900}",
	"drucker_prager: {bulk_modulus: 1e5, density: 1900}", "remembering: {bulk_modulus: 1e5, density: 1900}" };
enum { HYPER = 1, REMEMBERS };

static double uniform(void) {
	return (double)rand() / RAND_MAX;
} /* only how points are crowded hangs on it */

/* A block of grains that do not feel each other; after a few updates its inside is continuum. */
static quern_run *block(int dim, const char *material) {
	quern_run *run = harness_open(1,
		"quern: 1\ndimension: %d\ngravity: %s\ndomain: {lower: %s, upper: %s}\n"
		"time: {end: 1e-6, step: 1e-9}\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}},\n"
		"  contact: {linear: {stiffness: 1e-9, restitution: 1, friction: 0}},\n"
		"  fill: {region: {box: {lower: %s, upper: %s}}}}\n"
		"continuum: {cell: %g, material: {%s}}\n"
		"hybrid: {oracle: [{packing_fraction: {depth: 7 mm, half_width: 4 mm}}], substeps: 1, update: 1}\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[0.2, 0.12]" : "[0.08, 0.06, 0.06]", dim == 2 ? "[0.02, 0.02]" : "[0.012, 0.012, 0.012]",
		dim == 2 ? "[0.1, 0.08]" : "[0.052, 0.048, 0.048]", cell, material);
	harness_steps(run, 6);
	return run;
}

static void call(quern_run *run, const char *name) {
	for (size_t k = 0; k < run->plan->n_stages; k++) {
		const quern_plan_stage *stage = &run->plan->stages[k];
		if (strcmp(stage->name, name) != 0) continue;
		const quern_step step = quern_run_record(run, stage->section);
		if (stage->stage->run(stage->section->solver->self, &step) != QUERN_OK) fail_msg("%s", run->message);
	}
	quern_plan_refresh(run->plan);
}

/* Three of four points of a cell that holds continuum alone go to every fourth cell, whose points become many; those that stay
 * become few. Every point gets a mass, a volume, a velocity and a stress of its own; `open`: none. */
static void crowd(quern_run *run, int dim, bool hyper, bool open) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
					   m = harness_field(run, "point.mass"), volume = harness_field(run, "point.volume"),
					   s = harness_field(run, "point.stress"), w = harness_field(run, "point.weight");
	const quern_column j = hyper ? harness_field(run, "point.volume_strain") : m;
	const char *const owed[] = { "cell.owed", "cell.owed_momentum" };
	int first = 1 << 20;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		if (w.real[0][i] == 1) first = (int)fmin(first, floor(x.real[0][i] / cell));
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const int column = (int)floor(x.real[0][i] / cell) - first;
		if (w.real[0][i] == 1 && i % 4) x.real[0][i] -= (column % 4) * cell;
		m.real[0][i] *=
			(0.8 + 0.4 * uniform()) * (w.real[0][i] < 1 ? 0.5 : 1); /* no grains are lacking there */
		const double p = open ? 0 : 100 * uniform(), strain = open ? 0.3 * uniform() : -p / 1e5;
		volume.real[0][i] = m.real[0][i] / density * (1 + strain);
		for (int k = 0; k < (dim == 2 ? 3 : 6); k++)
			s.real[k][i] = k < dim ? -p : 0.1 * p * (uniform() - 0.5);
		if (hyper) j.real[0][i] = strain;
		for (int k = 0; k < dim; k++) v.real[k][i] = uniform() - 0.5;
	}
	for (int f = 0; f < 2; f++) { /* nobody owes anything: no mass comes or goes */
		const quern_column c = harness_field(run, owed[f]);
		for (int k = 0; k < (f ? dim : 1); k++)
			memset(c.real[k], 0, harness_count(run, "cell") * sizeof(double));
	}
}

typedef struct sums {
	double mass, volume, momentum[3], stress[6], strain, size; /* size: of the momentum's parts */
} sums;

static sums sum(quern_run *run, int dim, bool hyper) {
	const quern_column v = harness_field(run, "point.velocity"), m = harness_field(run, "point.mass"),
					   volume = harness_field(run, "point.volume"), s = harness_field(run, "point.stress"),
					   w = harness_field(run, "point.weight");
	const quern_column j = hyper ? harness_field(run, "point.volume_strain") : m;
	sums out = { 0 };
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double mass = w.real[0][i] * m.real[0][i], room = w.real[0][i] * volume.real[0][i];
		out.mass += mass;
		out.volume += room;
		if (hyper) out.strain += mass * j.real[0][i];
		for (int k = 0; k < dim; k++) {
			out.momentum[k] += mass * v.real[k][i];
			out.size += fabs(mass * v.real[k][i]);
		}
		for (int k = 0; k < (dim == 2 ? 3 : 6); k++) out.stress[k] += room * s.real[k][i];
	}
	return out;
}

/* Looseness of the loosest and the densest point, and the largest stress. */
static void look(quern_run *run, int dim, double *loose, double *dense, double *stress) {
	const quern_column m = harness_field(run, "point.mass"), volume = harness_field(run, "point.volume"),
					   s = harness_field(run, "point.stress");
	*loose = *stress = 0, *dense = INFINITY;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double room = volume.real[0][i] * density / m.real[0][i];
		*loose = fmax(*loose, room), *dense = fmin(*dense, room);
		for (int k = 0; k < (dim == 2 ? 3 : 6); k++) *stress = fmax(*stress, fabs(s.real[k][i]));
	}
}

/* ---- what a material of somebody else remembers, by the rules that it states ---- */

typedef struct memories {
	quern_column heat, warmth, mark, age, mass;
	uint32_t n;
} memories;

static memories memories_of(quern_run *run) {
	return (memories) { harness_field(run, "point.heat"), harness_field(run, "point.warmth"),
		harness_field(run, "point.mark"), harness_field(run, "point.age"), harness_field(run, "point.mass"),
		harness_count(run, "point") };
}

/* As much heat a kilogram for every point, a mark of each, all of one age. */
static void remember(quern_run *run) {
	const memories m = memories_of(run);
	for (uint32_t i = 0; i < m.n; i++) {
		m.heat.real[0][i] = 1000 * m.mass.real[0][i];
		m.warmth.real[0][i] = 300 + uniform();
		m.mark.real[0][i] = i;
		m.age.real[0][i] = 50;
	}
}

static double warmth(quern_run *run) {
	const memories m = memories_of(run);
	const quern_column w = harness_field(run, "point.weight");
	double sum = 0;
	for (uint32_t i = 0; i < m.n; i++) sum += w.real[0][i] * m.mass.real[0][i] * m.warmth.real[0][i];
	return sum;
}

/* Heat a kilogram is what it was for each, whoever has parted or joined; marks are those there were; parts are new. */
static bool still_remember(quern_run *run, uint32_t n, double warm) {
	const memories m = memories_of(run);
	double worst = 0;
	bool good = true;
	uint32_t parts = 0;
	for (uint32_t i = 0; i < m.n; i++) {
		const double mark = m.mark.real[0][i], age = m.age.real[0][i];
		worst = fmax(worst, fabs(m.heat.real[0][i] / (1000 * m.mass.real[0][i]) - 1));
		good &= mark >= 0 && mark < n && mark == floor(mark) && (age == 50 || age == 7);
		parts += age == 7;
	}
	printf("  %u of %u points are parts of others\n", parts, m.n);
	good &= parts > 0 && table_row("  heat a kilogram, worst", worst, 0, 1e-13);
	return table_row("  mean warmth", warmth(run) / warm, 1, 1e-13) && good;
}

static bool try_crowd(int dim, int which, bool open) {
	const bool hyper = which == HYPER, remembers = which == REMEMBERS;
	char name[80];
	bool good = true;
	srand(7);
	quern_run *run = block(dim, materials[which]);
	crowd(run, dim, hyper, open);
	double loose, dense, stress;
	look(run, dim, &loose, &dense, &stress);
	if (remembers) remember(run);
	const sums before = sum(run, dim, hyper);
	const double warm = remembers ? warmth(run) : 0;
	const uint32_t n = harness_count(run, "point");
	uint32_t most = n, least = n;
	for (int k = 0; k < 6; k++) {
		call(run, "hybrid.update");
		const uint32_t now = harness_count(run, "point");
		most = now > most ? now : most, least = now < least ? now : least;
	}
	const sums after = sum(run, dim, hyper);
	snprintf(name, sizeof name, "%d-D %.*s, %s: mass", dim, (int)strcspn(materials[which], ":"),
		materials[which], open ? "open" : "closed");
	good &= table_row(name, after.mass / before.mass, 1, 1e-13);
	good &= table_row("  volume", after.volume / before.volume, 1, 1e-13);
	for (int k = 0; k < dim; k++)
		good &=
			table_row("  momentum gained", (after.momentum[k] - before.momentum[k]) / before.size, 0, 1e-13);
	if (remembers) good &= still_remember(run, n, warm);
	if (hyper) good &= table_row("  mean volume strain", after.strain / before.strain, 1, 1e-12);
	for (int k = 0; k < (dim == 2 ? 3 : 6) && !open; k++)
		good &= table_row("  volume times stress, gained over that of xx",
			(after.stress[k] - before.stress[k]) / before.stress[0], 0, 1e-13);
	if (open) { /* as loose as before, every one of them, and without stress */
		double loose_now, dense_now, stress_now;
		look(run, dim, &loose_now, &dense_now, &stress_now);
		good &= loose_now <= loose * (1 + 1e-14) && dense_now >= dense * (1 - 1e-14);
		good &= table_row("  stress of open points, Pa", stress_now, 0, 0);
		const quern_column j = hyper ? harness_field(run, "point.volume_strain") : (quern_column) { 0 };
		for (uint32_t i = 0; hyper && i < harness_count(run, "point"); i++) good &= j.real[0][i] > 0;
	}
	printf("  %u points, at least %u, at most %u in six updates\n", n, least, most);
	assert_true(least < n || most > n); /* or the test would not see a thing */
	harness_close(run);
	return good;
}

static void many_and_few(void **state) {
	bool good = true;
	(void)state;
	table_head("splitting and merging, six updates: after over before");
	for (int dim = 2; dim <= 3; dim++)
		for (int which = 0; which <= REMEMBERS; which++)
			for (int open = 0; open <= 1; open++) good &= try_crowd(dim, which, open);
	assert_true(good);
}

static int32_t cell_of(quern_run *run, const quern_column *x, uint32_t i, int dim) {
	const quern_grid_view *g = quern_host_table.grid(run);
	quern_real at[3] = { 0 };
	int32_t c[3];
	for (int k = 0; k < dim; k++) at[k] = x->real[k][i];
	assert_true(quern_grid_cell_at(g, at, c));
	return quern_grid_entry(g, c);
}

/* What a part keeps of the point that it was split from is that of the heaviest of those that gave it mass. */
static void parts_remember_the_heaviest(void **state) {
	bool good = true;
	(void)state;
	table_head("points that a cell's points were split from");
	for (int dim = 2; dim <= 3; dim++) {
		srand(7);
		quern_run *run = block(dim, materials[REMEMBERS]);
		crowd(run, dim, false, false);
		remember(run);
		const quern_column x = harness_field(run, "point.position"), m = harness_field(run, "point.mass");
		const uint32_t n = harness_count(run, "point");
		int32_t *home = malloc(n * sizeof *home);
		double *mass = malloc(n * sizeof *mass);
		uint32_t parts = 0, lighter = 0;
		assert_true(home && mass);
		for (uint32_t i = 0; i < n; i++) home[i] = cell_of(run, &x, i, dim), mass[i] = m.real[0][i];
		call(run, "hybrid.update");
		const memories now = memories_of(run);
		for (uint32_t i = 0; i < now.n; i++) {
			if (now.age.real[0][i] != 7) continue;
			const uint32_t from = (uint32_t)now.mark.real[0][i];
			uint32_t heaviest = from;
			for (uint32_t k = 0; k < n; k++)
				if (home[k] == home[from] && mass[k] > mass[heaviest]) heaviest = k;
			parts++, lighter += heaviest != from;
		}
		printf("  %d-D: %u parts\n", dim, parts);
		assert_true(parts > 20);
		good &= table_row("  of a lighter one", lighter, 0, 0);
		free(home), free(mass);
		harness_close(run);
	}
	assert_true(good);
}

/* ---- cells that become all continuum ---- */

/* Cells of the inside are halves once more, of grains that all lack, and their points are open. Returns how many points those are. */
static uint32_t halve(quern_run *run, int dim, bool hyper, double room) {
	const quern_column zone = harness_field(run, "cell.zone"), owed = harness_field(run, "cell.owed"),
					   w = harness_field(run, "point.weight"), m = harness_field(run, "point.mass"),
					   x = harness_field(run, "point.position"), s = harness_field(run, "point.stress"),
					   volume = harness_field(run, "point.volume");
	uint32_t n = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		if (w.real[0][i] < 1) continue;
		const int32_t c = cell_of(run, &x, i, dim);
		zone.index[c] = QUERN_HYBRID;
		w.real[0][i] = 0.5;
		owed.real[0][c] += 0.5 * m.real[0][i];
		volume.real[0][i] = room * m.real[0][i] / density;
		if (hyper) harness_field(run, "point.volume_strain").real[0][i] = room - 1;
		for (int k = 0; k < (dim == 2 ? 3 : 6); k++) s.real[k][i] = 0;
		n++;
	}
	return n;
}

/* What is open and under no pressure is open afterwards, as loose as before; closed, it would press at its first contraction. */
static void open_ones_stay_open(void **state) {
	bool good = true;
	(void)state;
	table_head("open points of cells that become all continuum");
	for (int dim = 2; dim <= 3; dim++)
		for (int hyper = 0; hyper <= 1; hyper++) {
			quern_run *run = block(dim, materials[hyper]);
			const uint32_t halves = halve(run, dim, hyper, 1.25);
			uint32_t n = 0;
			double least = INFINITY, most = 0, strain = 0;
			harness_field(run, "total.samples").real[0][0] = 1; /* of contacts that bear nothing */
			call(run, "hybrid.update");
			const quern_column w = harness_field(run, "point.weight"), m = harness_field(run, "point.mass"),
							   volume = harness_field(run, "point.volume");
			for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
				if (w.real[0][i] < 1) continue;
				const double room = volume.real[0][i] * density / m.real[0][i];
				least = fmin(least, room), most = fmax(most, room), n++;
				if (hyper)
					strain = fmax(strain, fabs(harness_field(run, "point.volume_strain").real[0][i] - 0.25));
			}
			printf("  %d-D, %s: %u of %u points are all continuum\n", dim, hyper ? "drucker_prager" : "mu_i",
				n, halves);
			good &= n > halves / 2;
			good &= table_row("  room of the densest", least, 1.25, 1e-12);
			good &= table_row("  of the loosest", most, 1.25, 1e-12);
			if (hyper) good &= table_row("  volume strain, off by", strain, 0, 1e-12);
			harness_close(run);
		}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(many_and_few),
		cmocka_unit_test(parts_remember_the_heaviest), cmocka_unit_test(open_ones_stay_open) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
