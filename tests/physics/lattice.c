/* SPDX-License-Identifier: MIT */
/* Lattices of grains: as many as their formulas say, each with its neighbours; the same however a region is cut; and moved within
 * their gaps alone. docs/theory/packers.md, section 4 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <stdlib.h>

static const double pi = 3.14159265358979312;

/* A domain of one metre; `fill`: items of the list. */
static quern_run *open_lattice(uint32_t dim, double radius, double spread, const char *fill) {
	return harness_open(1,
		"{quern: 1, dimension: %u, gravity: %s, domain: {lower: %s, upper: %s}, time: {end: 1}, output: "
		"{every: 1},\n"
		"grains: {material: {density: 2500, radius: {mean: %.17g, spread: %.17g, law: uniform}}, contact: "
		"{linear: {stiffness: 1e7}}, fill: [%s]}}\n",
		dim, dim == 2 ? "[0, -10]" : "[0, 0, -10]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[1, 1]" : "[1, 1, 1]", radius, spread, fill);
}

static const char *whole(uint32_t dim) {
	return dim == 2 ? "region: {box: {lower: [0, 0], upper: [1, 1]}}"
					: "region: {box: {lower: [0, 0, 0], upper: [1, 1, 1]}}";
}

typedef struct lattice {
	const char *name, *form;
	uint32_t dim, neighbours;
	double fraction; /* where nearest neighbours touch */
} lattice;
static const lattice lattices[] = { { "triangular", "fcc", 2, 6, 0.906899682117109 },
	{ "triangular by hcp", "hcp", 2, 6, 0.906899682117109 }, { "square", "cubic", 2, 4, 0.785398163397448 },
	{ "face-centred cubic", "fcc", 3, 12, 0.740480489693061 },
	{ "hexagonal close packed", "hcp", 3, 12, 0.740480489693061 },
	{ "simple cubic", "cubic", 3, 6, 0.523598775598299 } };
enum { LATTICES = sizeof lattices / sizeof *lattices };

static double apart(quern_column x, uint32_t dim, uint32_t i, uint32_t j) {
	double d2 = 0;
	for (uint32_t k = 0; k < dim; k++) d2 += pow(x.real[k][i] - x.real[k][j], 2);
	return sqrt(d2);
}

/* Of grains farther than `margin` from all faces: whether each has so many others at a distance of a, and none nearer. */
static bool look(
	quern_run *run, const lattice *l, double a, double margin, double *nearest, double *density) {
	const quern_column x = harness_field(run, "grain.position");
	const uint32_t n = harness_count(run, "grain");
	uint32_t inner = 0;
	bool good = true;
	*nearest = INFINITY;
	for (uint32_t i = 0; i < n; i++) {
		uint32_t touching = 0;
		bool in = true;
		for (uint32_t k = 0; k < l->dim; k++) in = in && fabs(x.real[k][i] - 0.5) < 0.5 - margin;
		for (uint32_t j = 0; j < n && in; j++) {
			if (i == j) continue;
			const double d = apart(x, l->dim, i, j);
			*nearest = fmin(*nearest, d);
			touching += d < a * (1 + 1e-9);
		}
		good = good && (!in || touching == l->neighbours);
		inner += in;
	}
	*density = inner / pow(1 - 2 * margin, l->dim);
	return good;
}

static void densities(void **unused) {
	bool good = true;
	char fill[300];
	(void)unused;
	table_head("lattices of 1 m: fraction of grains within over what touching ones have");
	for (int i = 0; i < LATTICES; i++) {
		const lattice *l = &lattices[i];
		const double radius = l->dim == 2 ? 0.0101 : 0.0257;
		for (int wide = 0; wide < 2; wide++) {
			const double a = 2 * radius * (wide ? 1.25 : 1);
			double nearest, density;
			snprintf(fill, sizeof fill, "{%s, packer: {lattice: {form: %s%s}}}", whole(l->dim), l->form, "");
			if (wide)
				snprintf(fill, sizeof fill, "{%s, packer: {lattice: {form: %s, spacing: %.17g}}}",
					whole(l->dim), l->form, a);
			quern_run *run = open_lattice(l->dim, radius, 0, fill);
			good &= look(run, l, a, 1.5 * a, &nearest, &density);
			const double size = l->dim == 2 ? pi * radius * radius : 4.0 / 3 * pi * pow(radius, 3);
			/* an edge cuts off or adds half a row */
			good &= table_row(
				l->name, density * size / l->fraction * pow(wide ? 1.25 : 1, l->dim), 1, l->dim * 0.9 * a);
			good &= table_row("  nearest neighbours, over the spacing", nearest / a, 1, 1e-12);
			harness_close(run);
		}
	}
	assert_true(good);
}

static int by_place(const void *one, const void *two) {
	const double *a = one, *b = two;
	for (int k = 0; k < 3; k++)
		if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
	return 0;
}

static double (*places(quern_run *run, uint32_t dim, uint32_t *n))[3] {
	const quern_column x = harness_field(run, "grain.position");
	*n = harness_count(run, "grain");
	double(*all)[3] = calloc(*n + 1, sizeof *all);
	assert_non_null(all);
	for (uint32_t i = 0; i < *n; i++)
		for (uint32_t k = 0; k < dim; k++) all[i][k] = x.real[k][i];
	qsort(all, *n, sizeof *all, by_place);
	return all;
}

/* One region and two halves of it, of which one has other cells: the same grains, moved alike. */
static void cuts(void **unused) {
	static const char *const halves[2][2] = { { "box: {lower: [0, 0], upper: [0.37, 1]}",
												  "box: {lower: [0.37, 0], upper: [1, 1]}" },
		{ "box: {lower: [0, 0, 0], upper: [0.37, 1, 1]}", "box: {lower: [0.37, 0, 0], upper: [1, 1, 1]}" } };
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const char *packer = dim == 2
								 ? "packer: {lattice: {spacing: 26 mm, jitter: 80 %, origin: [0.003, 0.002]}}"
								 : "packer: {lattice: {spacing: 66 mm, jitter: 80 %, form: hcp}}";
		char fill[2][500];
		uint32_t n[2];
		double(*all[2])[3];
		snprintf(fill[0], sizeof fill[0], "{%s, %s}", whole(dim), packer);
		snprintf(fill[1], sizeof fill[1], "{region: {%s}, %s}, {region: {%s}, %s}", halves[dim - 2][0],
			packer, halves[dim - 2][1], packer);
		for (int k = 0; k < 2; k++) {
			quern_run *run = open_lattice(dim, dim == 2 ? 0.01 : 0.025, 0.2, fill[k]);
			all[k] = places(run, dim, &n[k]);
			harness_close(run);
		}
		assert_true(n[0] > 1000);
		assert_int_equal(n[0], n[1]);
		assert_memory_equal(all[0], all[1], n[0] * sizeof *all[0]);
		free(all[0]);
		free(all[1]);
	}
}

/* Evenly in a disc or a ball as wide as half the gap between the widest: the mean square of the way is a half or three fifths of
 * its radius squared. */
static void jitter(void **unused) {
	bool good = true;
	char fill[300];
	(void)unused;
	table_head("jitter");
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int full = 0; full < 2; full++) {
			const double radius = dim == 2 ? 0.005 : 0.02, a = 2.6 * radius, share = full ? 1 : 0.4,
						 reach = 0.5 * share * (a - 2.2 * radius);
			snprintf(fill, sizeof fill, "{%s, packer: {lattice: {spacing: %.17g, jitter: %g, form: cubic}}}",
				whole(dim), a, share);
			quern_run *run = open_lattice(dim, radius, 0.1, fill);
			const quern_column x = harness_field(run, "grain.position");
			const double *r = harness_field(run, "grain.radius").real[0];
			const uint32_t n = harness_count(run, "grain");
			double square = 0, most = 0, mean[3] = { 0 }, overlap = -INFINITY;
			for (uint32_t i = 0; i < n; i++) {
				double way2 = 0;
				for (uint32_t k = 0; k < dim; k++) {
					const double way = x.real[k][i] - a * floor(x.real[k][i] / a + 0.5);
					way2 += way * way, mean[k] += way / n;
				}
				square += way2 / n, most = fmax(most, sqrt(way2));
				for (uint32_t j = 0; j < i; j++) overlap = fmax(overlap, r[i] + r[j] - apart(x, dim, i, j));
			}
			/* grains beside the faces are inside only if they go that way */
			good &= table_row("mean square of the way, over the radius squared", square / (reach * reach),
				dim == 2 ? 0.5 : 0.6, 0.03);
			good &= table_row("  the farthest, over the radius", most / reach, 1, 0.02);
			good &= table_row("  the mean along x", mean[0] / reach, 0, 0.05);
			good &= table_row("  overlap over a radius", fmax(overlap / radius, 0), 0, 1e-9);
			harness_close(run);
		}
	assert_true(good);
}

/* In a shape, above a floor, of two materials: nobody overlaps and the lattice is full. */
static void in_a_sphere(void **unused) {
	bool good = true;
	(void)unused;
	quern_run *run = open_lattice(
		3, 0.01, 0, "{region: {sphere: {centre: [0.5, 0.5, 0.5], radius: 0.3}}, packer: lattice}");
	const uint32_t n = harness_count(run, "grain");
	const double wanted = 0.740480489693061 * 0.027 / 1e-6;
	table_head("a sphere of spheres");
	good &= table_row("grains over those of the volume", n / wanted, 1, 0.01);
	harness_close(run);
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(densities),
		cmocka_unit_test(cuts),
		cmocka_unit_test(jitter),
		cmocka_unit_test(in_a_sphere),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
