/* SPDX-License-Identifier: MIT */
/* Regions of any shape: all that is placed lies in them, as densely as in a box; points have the mass of the shape; what is above a
 * body lies on it; and sources pour into them, mixes by their shares of the mass. docs/theory/regions.md */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979312;

/* ==== shapes in a domain of 1 m, as distances in closed form ==== */

typedef struct shape {
	const char *name;
	uint32_t dim;
	const char *text;
	double (*distance)(const double x[3]); /* m, negative inside */
	double size, edge;                     /* m^dim, and of its surface in the domain less one dimension */
} shape;

static double of_disc(const double x[3]) { return hypot(x[0] - 0.5, x[1] - 0.45) - 0.35; }
static double of_ball(const double x[3]) { return hypot(hypot(x[0] - 0.5, x[1] - 0.45), x[2] - 0.55) - 0.35; }
/* Along (3, 0, 4)/5. */
static double of_can(const double x[3]) {
	const double d[3] = { x[0] - 0.5, x[1] - 0.5, x[2] - 0.5 }, h = 0.6 * d[0] + 0.8 * d[2];
	return fmax(hypot(0.8 * d[0] - 0.6 * d[2], d[1]) - 0.25, fabs(h) - 0.3);
}
/* Turned by 30 degrees. */
static double of_box(const double x[3]) {
	const double c = sqrt(0.75), p = x[0] - 0.5, q = x[1] - 0.5;
	return fmax(fabs(c * p + 0.5 * q) - 0.4, fabs(c * q - 0.5 * p) - 0.25);
}
/* A wedge with a notch, so that it is not convex. */
static double beyond(const double x[3], double px, double py, double qx, double qy) {
	return ((x[1] - py) * (qx - px) - (x[0] - px) * (qy - py)) / hypot(qx - px, qy - py);
}
static double of_notched(const double x[3]) {
	const double outer = fmax(
		fmax(-beyond(x, 0.1, 0.1, 0.9, 0.1), -beyond(x, 0.9, 0.1, 0.9, 0.9)), beyond(x, 0.1, 0.1, 0.9, 0.9));
	return fmax(outer, -fmax(-beyond(x, 0.9, 0.5, 0.6, 0.4), -beyond(x, 0.6, 0.4, 0.9, 0.3)));
}
/* What of the domain lies below a plane. */
static double of_half(const double x[3]) { return (x[0] + x[1] - 0.9) * sqrt(0.5); }
/* All of it but a disc. */
static double of_rest(const double x[3]) { return 0.3 - hypot(x[0] - 0.5, x[1] - 0.5); }

static const shape shapes[] = {
	{ "disc", 2, "sphere: {centre: [0.5, 0.45], radius: 0.35}", of_disc, 0.384845100064749,
		2.19911485751286 },
	{ "disc by cylinder", 2, "cylinder: {centre: [0.5, 0.45], radius: 0.35}", of_disc, 0.384845100064749,
		2.19911485751286 },
	{ "turned box", 2, "box: {lower: [0.1, 0.25], upper: [0.9, 0.75], turn: 30 degree}", of_box, 0.4, 2.6 },
	{ "notched wedge", 2,
		"polygon: {vertices: [[0.1, 0.1], [0.9, 0.1], [0.9, 0.3], [0.6, 0.4], [0.9, 0.5], [0.9, 0.9]]}",
		of_notched, 0.32 - 0.03, 1.4 + 2 * 0.316227766 + 1.131370850 },
	{ "below a plane", 2, "plane: {point: [0.9, 0], normal: [1, 1]}", of_half, 0.405, 1.272792206 },
	{ "around a disc", 2, "sphere: {centre: [0.5, 0.5], radius: 0.3, inside: true}", of_rest,
		1 - 0.282743338823081, 1.884955592153876 },
	{ "sphere", 3, "sphere: {centre: [0.5, 0.45, 0.55], radius: 0.35}", of_ball, 0.179594380030217,
		1.53938040025900 },
	{ "cylinder askew", 3, "cylinder: {centre: [0.5, 0.5, 0.5], radius: 0.25, axis: [3, 0, 4], length: 0.6}",
		of_can, 0.117809724509617, 1.33517687777566 },
};
enum { SHAPES = sizeof shapes / sizeof *shapes };

static const char *corner(uint32_t dim, bool upper) {
	return dim == 2 ? (upper ? "[1, 1]" : "[0, 0]") : (upper ? "[1, 1, 1]" : "[0, 0, 0]");
}

/* `what`: sections. */
static quern_run *open_in(uint32_t dim, const char *what) {
	return harness_open(1,
		"{quern: 1, dimension: %u, gravity: %s, domain: {lower: %s, upper: %s}, time: {end: 1}, output: "
		"{every: 1},\n%s}\n",
		dim, dim == 2 ? "[0, -10]" : "[0, 0, -10]", corner(dim, false), corner(dim, true), what);
}

static void place_at(quern_column at, uint32_t i, uint32_t dim, double x[3]) {
	for (uint32_t k = 0; k < 3; k++) x[k] = k < dim ? at.real[k][i] : 0;
}

/* ==== grains ==== */

/* By cells of the widest grain's diameter. */
static double deepest_overlap(quern_run *run, uint32_t dim, double widest) {
	const quern_column x = harness_field(run, "grain.position");
	const double *r = harness_field(run, "grain.radius").real[0];
	const uint32_t n = harness_count(run, "grain"), side = (uint32_t)(1 / widest) + 3;
	const size_t cells = (size_t)side * side * (dim == 3 ? side : 1);
	int32_t *head = malloc(cells * sizeof *head), *next = malloc((n + 1) * sizeof *next);
	double most = -INFINITY;
	assert_true(head && next);
	memset(head, 0xff, cells * sizeof *head);
	for (uint32_t i = 0; i < n; i++) {
		size_t c[3] = { 0 };
		for (uint32_t k = 0; k < dim; k++) c[k] = (size_t)(x.real[k][i] / widest) + 1;
		for (int o = 0; o < (dim == 3 ? 27 : 9); o++) {
			const size_t a = c[0] + (size_t)(o % 3) - 1, b = c[1] + (size_t)(o / 3 % 3) - 1,
						 e = dim == 3 ? c[2] + (size_t)(o / 9) - 1 : 0;
			for (int32_t j = head[(e * side + b) * side + a]; j >= 0; j = next[j]) {
				double d2 = 0;
				for (uint32_t k = 0; k < dim; k++) d2 += pow(x.real[k][i] - x.real[k][j], 2);
				most = fmax(most, (r[i] + r[j] - sqrt(d2)) / fmin(r[i], r[j]));
			}
		}
		int32_t *at = &head[((dim == 3 ? c[2] : 0) * side + c[1]) * side + c[0]];
		next[i] = *at, *at = (int32_t)i;
	}
	free(head);
	free(next);
	return most;
}

/* Packing fraction of what lies two diameters and more inside, where edges are not felt: by darts, in closed form. */
static double fraction_within(quern_run *run, const shape *s, double margin) {
	const quern_column at = harness_field(run, "grain.position");
	const double *r = harness_field(run, "grain.radius").real[0];
	double filled = 0, size = 0;
	enum { SIDE = 400 };
	const uint32_t n = s->dim == 2 ? SIDE * SIDE : 90 * 90 * 90, side = s->dim == 2 ? SIDE : 90;
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) {
		double x[3];
		place_at(at, i, s->dim, x);
		if (s->distance(x) < -margin) filled += s->dim == 2 ? pi * r[i] * r[i] : 4.0 / 3 * pi * pow(r[i], 3);
	}
	for (uint32_t i = 0; i < n; i++) {
		const double x[3] = { (i % side + 0.5) / side, (i / side % side + 0.5) / side,
			s->dim == 3 ? (i / side / side + 0.5) / side : 0 };
		bool in = s->distance(x) < -margin;
		for (uint32_t k = 0; k < s->dim; k++) in = in && x[k] > margin && x[k] < 1 - margin;
		size += in ? pow(1.0 / side, s->dim) : 0;
	}
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) { /* what is near the domain's own faces */
		double x[3];
		bool in = true;
		place_at(at, i, s->dim, x);
		for (uint32_t k = 0; k < s->dim; k++) in = in && x[k] > margin && x[k] < 1 - margin;
		if (!in && s->distance(x) < -margin)
			filled -= s->dim == 2 ? pi * r[i] * r[i] : 4.0 / 3 * pi * pow(r[i], 3);
	}
	return filled / size;
}

/* The fractions are those of docs/theory/packers.md for boxes. */
static void grains(void **unused) {
	bool good = true;
	char what[120], text[600];
	(void)unused;
	for (int how = 0; how < 2; how++)
		for (int i = 0; i < SHAPES; i++) {
			const shape *s = &shapes[i];
			const double radius = s->dim == 2 ? 4e-3 : 1.2e-2,
						 packed[2][2] = { { 0.785, 0.56 }, { 0.465, 0.266 } };
			double farthest = -INFINITY, x[3];
			snprintf(text, sizeof text,
				"grains: {material: {density: 2500, radius: {mean: %g, spread: 10 %%}}, contact: {linear: "
				"{stiffness: 1e7}},\n  fill: {region: {%s}, packer: %s}}",
				radius, s->text, how ? "random" : "two_point_tangent");
			quern_run *run = open_in(s->dim, text);
			const uint32_t n = harness_count(run, "grain");
			for (uint32_t g = 0; g < n; g++) {
				place_at(harness_field(run, "grain.position"), g, s->dim, x);
				farthest = fmax(farthest, s->distance(x));
			}
			snprintf(
				what, sizeof what, "%s, %s, %u grains", s->name, how ? "random" : "two_point_tangent", n);
			table_head(what);
			good &= table_row("the farthest centre is outside by, m", fmax(farthest, 0), 0, 1e-12);
			good &=
				table_row("deepest overlap", fmax(deepest_overlap(run, s->dim, 2.4 * radius), 0), 0, 1e-9);
			good &= table_row(
				"fraction within", fraction_within(run, s, 4 * radius), packed[how][s->dim - 2], 0.02);
			harness_close(run);
		}
	assert_true(good);
}

/* ==== points ==== */

static double points_of(const shape *s, double cell, double *farthest, uint32_t *n) {
	char text[400];
	snprintf(text, sizeof text,
		"continuum: {cell: %.17g, material: {elastic: {bulk_modulus: 1e6, density: 1500}}, fill: {region: "
		"{%s}}}",
		cell, s->text);
	quern_run *run = open_in(s->dim, text);
	const double *mass = harness_field(run, "point.mass").real[0],
				 *volume = harness_field(run, "point.volume").real[0];
	double sum = 0, x[3];
	*n = harness_count(run, "point");
	*farthest = -INFINITY;
	for (uint32_t i = 0; i < *n; i++) {
		place_at(harness_field(run, "point.position"), i, s->dim, x);
		*farthest = fmax(*farthest, s->distance(x));
		sum += mass[i];
		assert_true(fabs(mass[i] / volume[i] - 1500) < 1e-9);
	}
	harness_close(run);
	return sum;
}

/* A point is there if its place is: the mass is off by what cells at the edge have too much and too little, which cancel in part. */
static void points(void **unused) {
	bool good = true;
	char what[80];
	(void)unused;
	table_head("mass of points over that of the shape, less 1");
	for (int i = 0; i < SHAPES; i++) {
		const shape *s = &shapes[i];
		const int finest = s->dim == 2 ? 4 : 2;
		double off[5] = { 0 }, farthest;
		uint32_t n = 0;
		for (int level = 0; level <= finest; level++) {
			const double cell = 1 / (10.0 * (1 << level));
			off[level] = points_of(s, cell, &farthest, &n) / (1500 * s->size) - 1;
			snprintf(what, sizeof what, "%s, %g cells across, %u points", s->name, 1 / cell, n);
			/* half a row of points along the whole surface, which an edge through places of the lattice has too much */
			good &= table_row(what, off[level], 0, 0.25 * cell * s->edge / s->size + 1e-12);
			good &= farthest <= 1e-12;
		}
		snprintf(what, sizeof what, "  order of the worst of two");
		const double first = fmax(fabs(off[0]), fabs(off[1])),
					 last = fmax(fabs(off[finest - 1]), fabs(off[finest]));
		const double order = log(first / last) / log(2) / (finest - 1);
		table_note(what, order);
		good &= order > 0.99;
	}
	assert_true(good);
}

/* The stress of what lies above, also under a round top: the mean of a disc's vertical stress is that of its weight. */
static void weight(void **unused) {
	bool good = true;
	(void)unused;
	quern_run *run = open_in(2,
		"continuum: {cell: 0.005, material: {elastic: {bulk_modulus: 1e6, density: 1500}}, fill: {region: "
		"{sphere: {centre: [0.5, 0.45], radius: 0.35}}, stress: at_rest}}");
	const quern_column x = harness_field(run, "point.position"), stress = harness_field(run, "point.stress");
	double worst = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double p = x.real[0][i] - 0.5, q = x.real[1][i] - 0.45;
		const double top = sqrt(fmax(0, 0.35 * 0.35 - p * p));
		worst = fmax(worst, fabs(-stress.real[1][i] / 15000 - (top - q)));
	}
	table_head("a disc at rest");
	good &= table_row("depth by the vertical stress less that by the shape, m", worst, 0, 0.005 / 2 + 1e-12);
	harness_close(run);
	assert_true(good);
}

/* ==== above a body ==== */

#define SLOPE                                                                                                \
	"bodies: [{polygon: {vertices: [[0, 0], [1, 0], [1, 0.5]], name: slope}}, {plane: {point: [0, 0], "      \
	"normal: [1, 0]}}],\n"
#define SHELF "bodies: [{segment: {from: [0.2, 0.4], to: [0.6, 0.4], thickness: 0, name: shelf}}],\n"

static void above(void **unused) {
	bool good = true;
	uint32_t n = 0;
	double lowest = INFINITY, x[3], mass = 0, least = INFINITY, most = -INFINITY;
	(void)unused;
	table_head("above a slope, and above a shelf");
	quern_run *run = open_in(2,
		SLOPE "grains: {material: {density: 2500, radius: {mean: 1 cm}}, contact: {linear: {stiffness: "
			  "1e7, friction: 0.5}}, fill: "
			  "{region: {box: {lower: [0.2, 0], upper: [0.8, 0.6]}}, above: slope, settle: true}}");
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) {
		place_at(harness_field(run, "grain.position"), i, 2, x);
		lowest = fmin(lowest, (x[1] - 0.5 * x[0]) / sqrt(1.25));
	}
	good &= table_row("grains: lowest centre over the slope, radii", lowest / 1e-2, 1, 0.05);
	harness_settle(run);
	uint32_t on = 0;
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) {
		place_at(harness_field(run, "grain.position"), i, 2, x);
		const double gap = (x[1] - 0.5 * x[0]) / sqrt(1.25) / 1e-2 - 1;
		least = fmin(least, gap), on += fabs(gap) < 0.01;
	}
	good &= table_row("  settled: deepest in the slope, radii", -least, 0, 0.01);
	table_note("  grains that lie on it", on);
	good &= on > 20;
	harness_close(run);
	for (int level = 0; level < 3; level++) {
		char text[600];
		const double cell = 0.02 / (1 << level), wanted = 1500 * (0.6 * 0.6 - 0.5 * 0.5 * (0.64 - 0.04));
		snprintf(text, sizeof text,
			SLOPE "continuum: {cell: %g, material: {elastic: {bulk_modulus: 1e6, density: 1500}}, fill: "
				  "{region: {box: {lower: [0.2, 0], upper: [0.8, 0.6]}}, above: [0]}}",
			cell);
		run = open_in(2, text);
		mass = 0, n = harness_count(run, "point");
		for (uint32_t i = 0; i < n; i++) mass += harness_field(run, "point.mass").real[0][i];
		snprintf(text, sizeof text, "points, %g m: mass over that of the shape", cell);
		good &= table_row(text, mass / wanted, 1, 0.5 * cell);
		harness_close(run);
	}
	run = open_in(2, SHELF "grains: {material: {density: 2500, radius: {mean: 5 mm}}, contact: {linear: "
						   "{stiffness: 1e7}}, fill: "
						   "{region: {box: {lower: [0.1, 0.1], upper: [0.9, 0.8]}}, above: shelf}}");
	n = harness_count(run, "grain");
	lowest = least = INFINITY;
	for (uint32_t i = 0; i < n; i++) {
		place_at(harness_field(run, "grain.position"), i, 2, x);
		lowest = fmin(lowest, x[1]), least = fmin(least, x[0]), most = fmax(most, x[0]);
	}
	good &= table_row("shelf: lowest centre, m", lowest, 0.405, 0.001);
	good &= table_row("  leftmost", least, 0.2, 0.002);
	good &= table_row("  rightmost", most, 0.6, 0.002);
	good &= table_row("  grains, over those of a box as large", n * pi * 25e-6 / (0.4 * 0.4), 0.78, 0.03);
	harness_close(run);
	assert_true(good);
}

/* ==== sources ==== */

static const double parts[] = { 0.45, 0.3, 0.25 };

static quern_run *pour(const char *materials, const char *of) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [0.4, 0.6], open: "
		"[lower_y]}, "
		"time: {end: 10}, output: {every: 10},\n"
		"grains: {%s, contact: {linear: {stiffness: 1e5}},\n"
		"  source: [{region: {sphere: {centre: [0.1, 0.5], radius: 0.05}}, rate: 100, velocity: [0, -2]%s},\n"
		"    {region: {polygon: {vertices: [[0.25, 0.4], [0.35, 0.4], [0.3, 0.5]]}}, rate: 60, velocity: [0, "
		"-2]}]}}\n",
		materials, of);
}

/* Of the first source, that is: on the left. */
static void count_poured(
	quern_run *run, int64_t *seen, double mass[3], double *heaviest, double *outside, int *others) {
	const quern_column x = harness_field(run, "grain.position");
	const int64_t *id = harness_field(run, "grain.id").id;
	const int32_t *material = harness_field(run, "grain.material").index;
	int64_t newest = *seen;
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) {
		const double m = harness_field(run, "grain.mass").real[0][i], p = x.real[0][i], q = x.real[1][i];
		if (id[i] < *seen) continue;
		newest = id[i] >= newest ? id[i] + 1 : newest;
		*heaviest = fmax(*heaviest, m);
		if (p < 0.2) {
			mass[material[i]] += m;
			*outside = fmax(*outside, hypot(p - 0.1, q - 0.5) - 0.05);
		} else {
			*others += material[i] != 0;
			*outside = fmax(*outside,
				fmax(0.4 - q, fmax((q - 0.4) - 2 * (p - 0.25), (q - 0.4) - 2 * (0.35 - p)) / sqrt(5)));
		}
	}
	*seen = newest;
}

static void mixes(void **unused) {
	static const char *const names[] = { "sand", "steel", "cork" };
	static const char all[] =
		"materials: {sand: {density: 2500, radius: {mean: 1 mm, spread: 10 %}}, steel: {density: 7800, "
		"radius: "
		"{mean: 0.7 mm}}, cork: {density: 1200, radius: {mean: 1.6 mm, spread: 20 %, law: uniform}}}";
	double mass[3] = { 0 }, heaviest = 0, worst = 0, outside = 0;
	int64_t seen = 0;
	int others = 0;
	bool good = true;
	(void)unused;
	quern_run *run = pour(all, ", mix: {sand: 45 %, steel: 30 %, cork: 25 %}");
	double poured = 0;
	while (seen < 5000) {
		harness_steps(run, 1); /* each source looks every hundred steps; what is new has gone one step */
		const double *count = harness_field(run, "grain_source.count").real[0];
		if (count[0] + count[1] == poured) continue;
		poured = count[0] + count[1];
		count_poured(run, &seen, mass, &heaviest, &outside, &others);
		const double whole = mass[0] + mass[1] + mass[2];
		for (int k = 0; k < 3; k++) worst = fmax(worst, fabs(mass[k] - parts[k] * whole) / heaviest);
	}
	const double whole = mass[0] + mass[1] + mass[2];
	table_head("5000 grains of two sources");
	for (int k = 0; k < 3; k++) {
		const double booked = harness_field(run, "grain_share.mass").real[0][k];
		good &= table_row(names[k], mass[k] / whole, parts[k], heaviest / whole);
		good &= table_row("  in the books, over what was seen", booked / mass[k], 1, 1e-12);
	}
	good &= table_row("worst at any time, over the heaviest grain: below", worst, 0.5, 0.5);
	good &= table_row("farthest centre outside, m: a step's way", outside, 0, 1e-4);
	assert_int_equal(others, 0);
	assert_true(good);
	harness_close(run);
}

/* Two materials that differ in nothing are one. */
static void one_and_the_same(void **unused) {
	quern_run *one = pour("material: {density: 2500, radius: {mean: 1 mm, spread: 20 %}}", "");
	quern_run *two = pour("materials: {a: {density: 2500, radius: {mean: 1 mm, spread: 20 %}}, b: {density: "
						  "2500, radius: {mean: 1 mm, spread: 20 %}}}",
		", mix: {a: 20 %, b: 80 %}");
	(void)unused;
	harness_until(one, 0.1);
	harness_until(two, 0.1);
	const uint32_t n = harness_count(one, "grain");
	assert_int_equal(n, harness_count(two, "grain"));
	assert_true(n > 200);
	for (uint32_t k = 0; k < 2; k++)
		assert_memory_equal(harness_field(one, "grain.position").real[k],
			harness_field(two, "grain.position").real[k], n * sizeof(double));
	assert_false(harness_has(one, "grain_share.mass"));
	harness_close(one);
	harness_close(two);
}

/* Points of a source stay in its region, too. */
static void poured_points(void **unused) {
	bool good = true;
	(void)unused;
	quern_run *run = open_in(2,
		"continuum: {cell: 0.02, material: {elastic: {bulk_modulus: 1e4, density: 1500}}, source: {region: "
		"{sphere: {centre: [0.5, 0.5], radius: 0.1}}, keep: full, velocity: [0, 0]}}");
	harness_steps(run, 1);
	const uint32_t n = harness_count(run, "point");
	double mass = 0, farthest = 0;
	for (uint32_t i = 0; i < n; i++) {
		double x[3];
		place_at(harness_field(run, "point.position"), i, 2, x);
		farthest = fmax(farthest, hypot(x[0] - 0.5, x[1] - 0.5) - 0.1);
		mass += harness_field(run, "point.mass").real[0][i];
	}
	table_head("points poured into a disc");
	good &= table_row("farthest outside, m: a step's way", farthest, 0, 1e-4);
	good &= table_row("mass over that of the disc", mass / (1500 * pi * 0.01), 1, 0.06);
	harness_close(run);
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(grains),
		cmocka_unit_test(points),
		cmocka_unit_test(weight),
		cmocka_unit_test(above),
		cmocka_unit_test(mixes),
		cmocka_unit_test(one_and_the_same),
		cmocka_unit_test(poured_points),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
