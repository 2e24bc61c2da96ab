/* SPDX-License-Identifier: MIT */
/* The stress that the hybrid samples from contacts: summed over all cells, times a cell's volume, it is minus the sum over
 * contacts of force times branch, symmetric, component by component in the order that quern/abi.h states. Two spheres
 * along many directions, a grain on a slanting plane and on a fixed grain, and lattices under every unit strain. */
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

static const double radius = 1e-3, stiffness = 1e5, cell = 4e-3;
static const double squeezed = 3e-3; /* overlap over a diameter */

/* xx yy xy | xx yy zz xy yz xz */
static const int planar[3][2] = { { 0, 0 }, { 1, 1 }, { 0, 1 } };
static const int spatial[6][2] = { { 0, 0 }, { 1, 1 }, { 2, 2 }, { 0, 1 }, { 1, 2 }, { 0, 2 } };
static const char *const planar_names[3] = { "xx", "yy", "xy" };
static const char *const spatial_names[6] = { "xx", "yy", "zz", "xy", "yz", "xz" };

typedef struct tensor {
	double at[3][3];
} tensor;

static void add_dyad(tensor *t, const double f[3], const double b[3]) {
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++) t->at[i][j] -= 0.5 * (f[i] * b[j] + f[j] * b[i]);
}

/* What the cells hold after one step so short that nothing moves, times their volume. */
static tensor sampled(quern_run *run, int dim) {
	const int(*axes)[2] = dim == 2 ? planar : spatial;
	const quern_column stress = harness_field(run, "cell.stress");
	const double volume = pow(cell, dim) / harness_field(run, "total.samples").real[0][0];
	tensor t = { { { 0 } } };
	for (uint32_t c = 0; c < harness_count(run, "cell"); c++)
		for (int k = 0; k < (dim == 2 ? 3 : 6); k++)
			t.at[axes[k][0]][axes[k][1]] += volume * stress.real[k][c];
	return t;
}

static double largest(const tensor *t) {
	double most = 0;
	for (int i = 0; i < 9; i++) most = fmax(most, fabs((&t->at[0][0])[i]));
	return most;
}

static bool compare(const char *what, int dim, const tensor *found, const tensor *asked) {
	const int(*axes)[2] = dim == 2 ? planar : spatial;
	const double size = largest(asked);
	bool good = size > 0;
	for (int k = 0; k < (dim == 2 ? 3 : 6); k++) {
		char name[80];
		snprintf(name, sizeof name, "%s: %s", what, (dim == 2 ? planar_names : spatial_names)[k]);
		const int i = axes[k][0], j = axes[k][1];
		good = table_row(name, found->at[i][j] / size, asked->at[i][j] / size, 1e-12) && good;
	}
	return good;
}

static void begin_scene(text *t, int dim, const char *more) {
	t->length = 0;
	text_add(t,
		"quern: 1\ndimension: %d\ngravity: %s\ndomain: {lower: %s, upper: %s}\n"
		"time: {end: 1e-12, step: 1e-14}\n%s"
		"continuum: {cell: %g, material: {mu_i: {critical_density: 1500}}}\n"
		"hybrid: {oracle: [{packing_fraction: {depth: 7 mm, half_width: 4 mm}}], substeps: 4}\n"
		"output: {fields: [contact.force]}\n"
		"grains:\n  material: {density: 2500, radius: {mean: %.17g}}\n"
		"  contact: {linear: {stiffness: %.17g, restitution: 1, friction: 0}}\n  place:\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[0.04, 0.04]" : "[0.04, 0.04, 0.04]", more, cell, radius, stiffness);
}

static void place(text *t, int dim, const double x[3], bool fixed) {
	text_add(t, "    - {position: [%.17g, %.17g", x[0], x[1]);
	if (dim == 3) text_add(t, ", %.17g", x[2]);
	text_add(t, "], fixed: %s}\n", fixed ? "true" : "false");
}

/* A pair whose first grain has the lower id; the second may be fixed: then the branch ends at the contact. */
static bool pair_is_right(int dim, const double way[3], bool fixed) {
	static text scene;
	const double distance = 2 * radius * (1 - squeezed), middle[3] = { 0.0183, 0.0211, 0.0197 };
	const double length = sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
	double x[2][3], force[3], branch[3];
	tensor asked = { { { 0 } } };
	char name[80];
	for (int k = 0; k < 3; k++) {
		const double n = way[k] / length;
		x[0][k] = middle[k] + 0.5 * distance * n;
		x[1][k] = middle[k] - 0.5 * distance * n;
		force[k] = stiffness * 2 * radius * squeezed * n;
		branch[k] = (fixed ? 0.5 : 1) * distance * n;
	}
	begin_scene(&scene, dim, "");
	place(&scene, dim, x[0], false);
	place(&scene, dim, x[1], fixed);
	quern_run *run = harness_open(1, "%s", scene.data);
	harness_steps(run, 1);
	const tensor found = sampled(run, dim);
	harness_close(run);
	add_dyad(&asked, force, branch);
	snprintf(name, sizeof name, "%d-D pair along (%g %g %g)%s", dim, way[0], way[1], way[2],
		fixed ? ", one fixed" : "");
	return compare(name, dim, &found, &asked);
}

static void pairs_of_grains(void **state) {
	static const double ways[][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 1, 1, 0 }, { 1, -2, 0 }, { 0, 0, 1 },
		{ 1, 0, 1 }, { 0, 1, 1 }, { 1, 2, 3 }, { -3, 1, 2 } };
	bool good = true;
	(void)state;
	table_head("contact stress of a pair, over its largest component");
	for (int dim = 2; dim <= 3; dim++)
		for (size_t k = 0; k < (dim == 2 ? 4 : sizeof ways / sizeof *ways); k++) {
			good = pair_is_right(dim, ways[k], false) && good;
			good = pair_is_right(dim, ways[k], true) && good;
		}
	assert_true(good);
}

/* A grain pressed into a slanting plane: the branch goes from the surface to the
 * centre. */
static void grains_on_planes(void **state) {
	static const double ways[][3] = { { 1, 2, 0 }, { 1, 2, -2 } };
	static text scene;
	bool good = true;
	(void)state;
	table_head("contact stress of a grain on a plane, over its largest component");
	for (int dim = 2; dim <= 3; dim++) {
		const double *way = ways[dim - 2], length = sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
		const double at[3] = { 0.02, 0.02, 0.02 };
		const double overlap = 2 * radius * squeezed;
		double x[3] = { 0 }, force[3] = { 0 }, branch[3] = { 0 };
		char plane[200];
		tensor asked = { { { 0 } } };
		for (int k = 0; k < dim; k++) {
			const double n = way[k] / length;
			x[k] = at[k] + (radius - overlap) * n;
			force[k] = stiffness * overlap * n;
			branch[k] = (radius - overlap) * n;
		}
		if (dim == 2)
			snprintf(plane, sizeof plane, "bodies: [{plane: {point: [0.02, 0.02], normal: [%g, %g]}}]\n",
				way[0], way[1]);
		else
			snprintf(plane, sizeof plane,
				"bodies: [{plane: {point: [0.02, 0.02, 0.02], normal: [%g, %g, %g]}}]\n", way[0], way[1],
				way[2]);
		begin_scene(&scene, dim, plane);
		place(&scene, dim, x, false);
		quern_run *run = harness_open(1, "%s", scene.data);
		harness_steps(run, 1);
		const tensor found = sampled(run, dim);
		harness_close(run);
		add_dyad(&asked, force, branch);
		good = compare(dim == 2 ? "2-D" : "3-D", dim, &found, &asked) && good;
	}
	assert_true(good);
}

/* ---- lattices ---- */

enum { MOST = 400 };

/* Triangular in the plane, face-centred cubic in space: neighbours at one distance. */
static int lattice(int dim, double x[MOST][3]) {
	const double d = 2 * radius, edge = d * sqrt(2), low = 0.012;
	int n = 0;
	if (dim == 2) {
		for (int j = 0; j < 8; j++)
			for (int i = 0; i < 8; i++, n++)
				x[n][0] = low + d * (i + 0.5 * (j % 2)), x[n][1] = low + d * sqrt(0.75) * j, x[n][2] = 0;
		return n;
	}
	for (int k = 0; k < 8; k++)
		for (int j = 0; j < 8; j++)
			for (int i = 0; i < 8; i++) {
				if ((i + j + k) % 2) continue;
				x[n][0] = low + 0.5 * edge * i, x[n][1] = low + 0.5 * edge * j,
				x[n++][2] = low + 0.5 * edge * k;
			}
	return n;
}

static bool strained_lattice_is_right(int dim, int k) {
	static text scene;
	static double x[MOST][3];
	const int(*axes)[2] = dim == 2 ? planar : spatial;
	const int n = lattice(dim, x);
	tensor strain = { { { 0 } } }, asked = { { { 0 } } };
	char name[80];
	strain.at[axes[k][0]][axes[k][1]] += 0.5 * 1e-3;
	strain.at[axes[k][1]][axes[k][0]] += 0.5 * 1e-3;
	begin_scene(&scene, dim, "");
	for (int p = 0; p < n; p++) {
		double y[3];
		for (int a = 0; a < dim; a++) {
			y[a] = (1 - squeezed) * (x[p][a] - 0.02) + 0.02;
			for (int b = 0; b < dim; b++) y[a] -= strain.at[a][b] * (x[p][b] - 0.02);
		}
		place(&scene, dim, y, false);
		for (int a = 0; a < dim; a++) x[p][a] = y[a];
	}
	int contacts = 0;
	for (int p = 0; p < n; p++)
		for (int q = p + 1; q < n; q++) {
			double b[3] = { 0 }, f[3] = { 0 }, d2 = 0;
			for (int a = 0; a < dim; a++) b[a] = x[p][a] - x[q][a], d2 += b[a] * b[a];
			const double d = sqrt(d2), overlap = 2 * radius - d;
			if (!(overlap > 0)) continue;
			for (int a = 0; a < dim; a++) f[a] = stiffness * overlap * b[a] / d;
			add_dyad(&asked, f, b);
			contacts++;
		}
	assert_true(contacts > 2 * n);
	quern_run *run = harness_open(1, "%s", scene.data);
	harness_steps(run, 1);
	const tensor found = sampled(run, dim);
	harness_close(run);
	snprintf(name, sizeof name, "%d-D strained by %s, %d contacts", dim,
		(dim == 2 ? planar_names : spatial_names)[k], contacts);
	return compare(name, dim, &found, &asked);
}

static void strained_lattices(void **state) {
	bool good = true;
	(void)state;
	table_head("contact stress of a lattice, over its largest component");
	for (int dim = 2; dim <= 3; dim++)
		for (int k = 0; k < (dim == 2 ? 3 : 6); k++) good = strained_lattice_is_right(dim, k) && good;
	assert_true(good);
}

/* ---- beside bodies ---- */

static void update(quern_run *run) {
	for (size_t k = 0; k < run->plan->n_stages; k++) {
		const quern_plan_stage *stage = &run->plan->stages[k];
		if (strcmp(stage->name, "hybrid.update") != 0) continue;
		const quern_step step = quern_run_record(run, stage->section);
		if (stage->stage->run(stage->section->solver->self, &step) != QUERN_OK) fail_msg("%s", run->message);
	}
	quern_plan_refresh(run->plan);
}

/* Of the points in a row of cells, and of all grains above the middle of their room, for a metre of the bed. */
static double pressed(quern_run *run, int row) {
	const quern_column x = harness_field(run, "point.position"), stress = harness_field(run, "point.stress");
	double sum = 0;
	int n = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		if ((int)floor(x.real[1][i] / cell) == row) sum -= stress.real[1][i], n++;
	assert_true(n > 0);
	return sum / n;
}

static double weight_above(quern_run *run, double height, double width) {
	const quern_column x = harness_field(run, "grain.position"), m = harness_field(run, "grain.mass");
	double sum = 0;
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++)
		if (x.real[1][i] > height) sum += m.real[0][i] * 9.81 / width;
	return sum;
}

/* A bed of discs at rest on a floor that lies so many cells above the domain's face: over its three lowest rows, vertical stress of new
 * points over the weight above them. */
static void bear(double floor_at, int seed, double ratio[3]) {
	const double width = 0.06, base = floor_at * cell;
	double weight[3];
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, seed: %d, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [%g, 0.06], "
		"periodic: [true, false]},\ntime: {end: 10}, bodies: [{plane: {point: [0, %g], normal: [0, 1]}}],\n"
		"continuum: {cell: %g, material: {elastic: {bulk_modulus: 1e6, density: 1900}}},\n"
		"hybrid: {oracle: [{packing_fraction: {depth: 9 mm, half_width: 4 mm}}], substeps: 4},\n"
		"grains: {material: {density: 2500, radius: {mean: %g, spread: 0.2}}, contact: {linear: {stiffness: 1e6}},\n"
		"  settle: {energy: 1e-8}, fill: {region: {box: {lower: [0, %g], upper: [%g, %g]}}, settle: true}}}\n",
		seed, width, base, cell, radius, base + radius, width, base + 0.03);
	harness_settle(run);
	harness_steps(run, 1);
	const int first = (int)floor(floor_at);
	for (int k = 0; k < 3; k++)
		weight[k] = weight_above(run, 0.5 * (fmax((first + k) * cell, base) + (first + k + 1) * cell), width);
	update(run);
	for (int k = 0; k < 3; k++) ratio[k] = pressed(run, first + k) / weight[k];
	harness_close(run);
}

/* On a face of the domain, on a body on a face of cells, and on bodies that cut their cells: points made in a bed bear what lies above them, in
 * the lowest cells too. Of a cell that is open to a quarter the room is known to a fifth, and few grains are in it: one bed may be off by a third. */
static void beds_bear_their_weight(void **state) {
	static const double floors[] = { 0, 1, 1.25, 1.5, 1.75 }; /* cells */
	bool good = true;
	(void)state;
	table_head("vertical stress of new points over the weight above them, of four beds on the last floor");
	for (size_t f = 0; f < sizeof floors / sizeof *floors; f++) {
		const int seeds = floors[f] > 1.5 ? 4 : 1;
		double mean[3] = { 0 };
		for (int seed = 1; seed <= seeds; seed++) {
			double ratio[3];
			bear(floors[f], seed, ratio);
			for (int k = 0; k < 3; k++) mean[k] += ratio[k] / seeds;
			table_note("  row 0 of one", ratio[0]);
		}
		for (int k = 0; k < 3; k++) {
			char name[80];
			snprintf(name, sizeof name, "floor at %g cells, row %d", floors[f], k);
			good &= table_row(name, mean[k], 1, 0.12);
		}
	}
	assert_true(good);
}

/* The update that comes after a step lends what contacts bore at that step's end, in a late step as in the first. */
static void forces_kept_for_updates(void **state) {
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [0.04, 0.06], periodic: [true, false]},\n"
		"time: {end: 10}, bodies: [{plane: {point: [0, 0], normal: [0, 1]}}],\n"
		"continuum: {cell: %g, material: {elastic: {bulk_modulus: 1e6, density: 1900}}},\n"
		"hybrid: {oracle: [{packing_fraction: {depth: 9 mm, half_width: 4 mm}}], substeps: 4, update: 12},\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, contact: {linear: {stiffness: 1e5, restitution: 0.5}},\n"
		"  fill: [{region: {box: {lower: [0, 1 mm], upper: [0.04, 0.04]}}, settle: false}]}}\n",
		cell);
	(void)state;
	for (int k = 0; k < 40; k++) {
		harness_steps(run, 3); /* an update comes in every third step, after the first */
		if (k == 0) harness_steps(run, 1);
		const quern_column force = harness_field(run, "contact.force"),
						   borne = harness_field(run, "contact.borne");
		double off = 0, most = 0;
		for (uint32_t i = 0; i < harness_count(run, "contact"); i++)
			for (int a = 0; a < 2; a++) {
				off = fmax(off, fabs(force.real[a][i] - borne.real[a][i]));
				most = fmax(most, fabs(force.real[a][i]));
			}
		if (k == 39) table_note("largest force, N", most);
		assert_true(off == 0 && (k < 39 || most > 0));
	}
	harness_close(run);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(forces_kept_for_updates),
		cmocka_unit_test(pairs_of_grains), cmocka_unit_test(grains_on_planes),
		cmocka_unit_test(strained_lattices), cmocka_unit_test(beds_bear_their_weight) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
