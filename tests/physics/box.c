/* SPDX-License-Identifier: MIT */
/* A periodic box that is strained: lists hold every pair that is near by any image, no place in it is other than the rest, its own flow
 * stays as it is, and momentum, energy, pressure and packing fraction are what its books and keys say. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "scene_text.h"
#include "seen.h"
#include "table.h"
#include <math.h>
#include <stdlib.h>

enum { MOST = 400 };

static double uniform(uint64_t *state) {
	uint64_t z = *state += 0x9e3779b97f4a7c15u; /* splitmix64 */
	z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
	z = (z ^ z >> 27) * 0x94d049bb133111ebu;
	return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

static double number(quern_run *run, const char *field, int k) {
	return harness_field(run, field).real[k][0];
}

/* The distance of the nearest of many images, whichever it is. */
static double nearest(int dim, const double d[3], const double length[3], double offset) {
	double best = INFINITY;
	for (int nz = dim == 3 ? -1 : 0; nz <= (dim == 3 ? 1 : 0); nz++)
		for (int ny = -2; ny <= 2; ny++)
			for (int nx = -4; nx <= 4; nx++) {
				const double x = d[0] + nx * length[0] + ny * offset, y = d[1] + ny * length[1],
							 z = dim == 3 ? d[2] + nz * length[2] : 0;
				best = fmin(best, sqrt(x * x + y * y + z * z));
			}
	return best;
}

/* ---- lists ---- */

static text scatter(int dim, double speed, const char *search, const char *integrator) {
	text t = { 0 };
	uint64_t state = 5 + (uint64_t)dim;
	const double size[3] = { 26, 15, 11 };
	text_add(&t,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s, periodic: %s},\n"
		"time: {end: 10, step: 1e-3}, output: {every: 10},\n"
		"grains: {material: {density: 1, radius: {mean: 0.8}}, contact: [], neighbours: %s, integrator: %s, skin: 0.2,\n"
		"  overlap: {start: 1e6}, box: {shear: 1.3, packing: 0.9, rate: 0.15}, place: [",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[26, 15]" : "[26, 15, 11]", dim == 2 ? "[true, true]" : "[true, true, true]", search,
		integrator);
	static double x[150][3];
	for (int i = 0; i < 150; i++) {
		double v[3];
		for (bool clear = false; !clear;) { /* no centre in another grain */
			clear = true;
			for (int k = 0; k < 3; k++)
				x[i][k] = size[k] * uniform(&state), v[k] = speed * (2 * uniform(&state) - 1);
			for (int j = 0; j < i; j++) {
				const double d[3] = { x[i][0] - x[j][0], x[i][1] - x[j][1], x[i][2] - x[j][2] };
				clear = clear && nearest(dim, d, size, 0) > 0.8;
			}
		}
		if (dim == 2)
			text_add(&t, "{position: [%.17g, %.17g], velocity: [%.17g, %.17g], radius: %.17g},", x[i][0],
				x[i][1], v[0], v[1], 0.3 + 0.5 * uniform(&state));
		else
			text_add(&t, "{position: [%.17g, %.17g, %.17g], velocity: [%.17g, %.17g, %.17g], radius: %.17g},",
				x[i][0], x[i][1], x[i][2], v[0], v[1], v[2], 0.3 + 0.5 * uniform(&state));
	}
	text_add(&t, "]}}");
	return t;
}

typedef struct tally {
	uint64_t listed, missing, strange, touching, unlisted, across;
} tally;

/* The list is that of the places where it was made, by images as they were then; it still holds every pair that touches now. */
static void compare_list(quern_run *run, int dim, tally *t) {
	static bool is_listed[MOST][MOST];
	const uint32_t n = harness_count(run, "grain"), pairs = harness_count(run, "contact");
	const quern_column anchor = harness_field(run, "grain.anchor"), x = harness_field(run, "grain.position"),
					   radius = harness_field(run, "grain.radius");
	double then[3], now[3];
	for (int k = 0; k < dim; k++)
		then[k] = number(run, "total.box_listed", k), now[k] = number(run, "total.box_length", k);
	const double offset_then = number(run, "total.box_listed_offset", 0),
				 offset = number(run, "total.box_offset", 0);
	memset(is_listed, 0, sizeof is_listed);
	for (uint32_t q = 0; q < pairs; q++) {
		const int32_t i = harness_field(run, "contact.first").index[q],
					  j = harness_field(run, "contact.second").index[q];
		is_listed[i][j] = is_listed[j][i] = true;
	}
	for (uint32_t i = 0; i < n; i++)
		for (uint32_t j = 0; j < i; j++) {
			double d[3] = { 0 }, e[3] = { 0 }, straight = 0;
			for (int k = 0; k < dim; k++)
				d[k] = anchor.real[k][i] - anchor.real[k][j], e[k] = x.real[k][i] - x.real[k][j];
			for (int k = 0; k < dim; k++) straight += d[k] * d[k];
			const double both = radius.real[0][i] + radius.real[0][j],
						 far = nearest(dim, d, then, offset_then);
			t->listed += is_listed[i][j];
			t->missing += !is_listed[i][j] && far < both + 0.32 - 1e-9;
			t->strange += is_listed[i][j] && far > both + 0.32 + 1e-9;
			t->across += is_listed[i][j] && straight > 4 * far * far;
			const bool touches = nearest(dim, e, now, offset) < both;
			t->touching += touches;
			t->unlisted += touches && !is_listed[i][j];
		}
}

static void lists(void **state) {
	static const char *const searches[] = { "cells", "hgrid", "all_pairs" }, *const integrators[] = {
		"symplectic_euler", "velocity_verlet", "position_verlet"
	};
	bool good = true;
	(void)state;
	table_head("pairs of a sheared box that shrinks, against all images: missing, too far, not listed");
	for (int dim = 2; dim <= 3; dim++)
		for (int k = 0; k < 3; k++) {
			/* where nothing but the box moves grains, it alone makes lists stale */
			const text t = scatter(dim, k == 2 ? 0 : 1, searches[k], integrators[k]);
			quern_run *run = harness_open(1, "%s", t.data);
			tally of = { 0 };
			for (int step = 0; step < 400; step++) {
				harness_steps(run, step % 2 ? 7 : 1);
				compare_list(run, dim, &of);
			}
			char name[80];
			snprintf(name, sizeof name, "%d-D, %s, %s", dim, searches[k], integrators[k]);
			table_note(name, (double)of.listed);
			table_note("  of these by another image", (double)of.across);
			good &= of.touching > 1000 && of.across > of.listed / 20;
			good &= table_row("  missing", (double)of.missing, 0, 0);
			good &= table_row("  too far", (double)of.strange, 0, 0);
			good &= table_row("  touching and not listed", (double)of.unlisted, 0, 0);
			harness_close(run);
		}
	assert_true(good);
}

/* ---- no place is other than the rest ---- */

/* Two grains that shear brings together after the image across y has gone by several lengths: as they are or moved by (x, y). */
static quern_run *pair_at(int dim, double x, double y, const char *integrator) {
	const double size[3] = { 1, 0.6, 0.5 }, at[2][3] = { { 0.35, 0.27, 0.25 }, { 0.71, 0.33, 0.25 } };
	text t = { 0 };
	text_add(&t,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s, periodic: %s},\n"
		"time: {end: 100, step: 2e-3}, output: {every: 100, fields: [contact.force]},\n"
		"grains: {material: {density: 2500, radius: {mean: 0.05}}, integrator: %s,\n"
		"  contact: {linear: {stiffness: 1e4, friction: 0.5, restitution: 0.7}}, box: {shear: -1}, place: [",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[1, 0.6]" : "[1, 0.6, 0.5]", dim == 2 ? "[true, true]" : "[true, true, true]",
		integrator);
	for (int i = 0; i < 2; i++) {
		const double p[3] = { fmod(at[i][0] + x, size[0]), fmod(at[i][1] + y, size[1]), at[i][2] };
		if (dim == 2) text_add(&t, "{position: [%.17g, %.17g]},", p[0], p[1]);
		else text_add(&t, "{position: [%.17g, %.17g, %.17g]},", p[0], p[1], p[2]);
	}
	text_add(&t, "]}}");
	return harness_open(1, "%s", t.data);
}

static void force_of(quern_run *run, int dim, double f[3]) {
	f[0] = f[1] = f[2] = 0;
	if (!harness_count(run, "contact")) return;
	for (int k = 0; k < dim; k++) f[k] = harness_field(run, "contact.force").real[k][0];
}

static void across_the_seam(void **state) {
	static const char *const integrators[] = { "symplectic_euler", "velocity_verlet", "position_verlet" };
	bool good = true;
	(void)state;
	table_head("two grains in shear, and the same moved by (0.23, 0.3): across the image's seam");
	for (int dim = 2; dim <= 3; dim++)
		for (int a = 0; a < 3; a++) {
			quern_run *one = pair_at(dim, 0, 0, integrators[a]),
					  *two = pair_at(dim, 0.23, 0.3, integrators[a]);
			double most = 0, off = 0, offset = 0;
			int steps = 0;
			for (int step = 0; step < 6000; step++) {
				double f[3], g[3];
				harness_steps(one, 1);
				harness_steps(two, 1);
				force_of(one, dim, f);
				force_of(two, dim, g);
				const double size = sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
				if (size > 0 && steps++ == 0) offset = number(two, "total.box_offset", 0);
				most = fmax(most, size);
				for (int k = 0; k < dim; k++) off = fmax(off, fabs(f[k] - g[k]));
			}
			char name[80];
			snprintf(name, sizeof name, "%d-D, %s: steps with a force", dim, integrators[a]);
			table_note(name, steps);
			table_note("  offset at the first touch, m", offset);
			good &= steps > 8 && fabs(offset) > 0.05;
			good &= table_row("  difference of forces, over the largest", off / most, 0, 1e-8);
			harness_close(one);
			harness_close(two);
		}
	assert_true(good);
}

/* ---- its own flow ---- */

/* Grains that nothing acts on keep to the box's own flow, wherever they go and through whatever face. */
static void own_flow(void **state) {
	static const char *const integrators[] = { "symplectic_euler", "velocity_verlet", "position_verlet" };
	bool good = true;
	(void)state;
	table_head("grains at rest in a box that shears and shrinks, against its own flow");
	for (int a = 0; a < 3; a++) {
		text t = { 0 };
		uint64_t seed = 3;
		text_add(&t,
			"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [-1, 2], upper: [25, 17], periodic: [true, true]},\n"
			"time: {end: 100, step: 1e-3}, output: {every: 100},\n"
			"grains: {material: {density: 1, radius: {mean: 0.01}}, contact: [], integrator: %s,\n"
			"  overlap: {start: 1e6}, box: {shear: 0.7, packing: 2e-4, rate: 0.1}, place: [",
			integrators[a]);
		for (int i = 0; i < 100; i++)
			text_add(&t, "{position: [%.17g, %.17g]},", -1 + 26 * uniform(&seed), 2 + 15 * uniform(&seed));
		text_add(&t, "]}}");
		quern_run *run = harness_open(1, "%s", t.data);
		harness_steps(run, 1);
		double beside = 0, spread = 0;
		for (int k = 0; k < 60; k++) {
			harness_steps(run, 100);
			const quern_column x = harness_field(run, "grain.position"),
							   v = harness_field(run, "grain.velocity");
			const double lx = number(run, "total.box_length", 0), ly = number(run, "total.box_length", 1);
			const double vx = number(run, "total.box_speed", 0), vy = number(run, "total.box_speed", 1);
			const double gradient[3] = { vx / lx, vy / ly,
				(number(run, "total.box_slide", 0) - vx / lx * number(run, "total.box_offset", 0)) / ly };
			double c0[2];
			for (uint32_t i = 0; i < 100; i++) {
				const double c[2] = { v.real[0][i] - gradient[0] * x.real[0][i] - gradient[2] * x.real[1][i],
					v.real[1][i] - gradient[1] * x.real[1][i] };
				if (!i) c0[0] = c[0], c0[1] = c[1];
				beside = fmax(beside, fmax(fabs(c[0] - c0[0]), fabs(c[1] - c0[1])));
				spread = fmax(spread, fabs(v.real[0][i]));
			}
		}
		const double packing = 100 * 3.141592653589793 * 1e-4 /
							   (number(run, "total.box_length", 0) * number(run, "total.box_length", 1));
		table_note(integrators[a], spread);
		good &= spread > 2;
		good &= table_row("  velocities beside it, m/s", beside, 0, 1e-11);
		good &= table_row("  packing fraction over what was asked", packing / 2e-4, 1, 1e-12);
		good &= table_row("  speed of the lengths then", number(run, "total.box_speed", 1), 0, 0);
		good &= table_row("  shear strain", number(run, "total.box_strain", 0), 0.7 * 6.001, 1e-9);
		harness_close(run);
	}
	assert_true(good);
}

/* ---- books ---- */

static quern_run *dense(int dim, const char *integrator, double step) {
	return harness_open(1,
		"{quern: 1, dimension: %d, seed: 2, gravity: %s, domain: {lower: %s, upper: %s, periodic: %s},\n"
		"time: {end: 1, step: %g}, output: {every: 1, fields: [total.kinetic, total.stored, total.sheared]},\n"
		"observe: [energy, stress, momentum, box],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 20 %%, law: uniform}}, integrator: %s,\n"
		"  contact: {linear: {stiffness: 1e5, restitution: 0.3, friction: 0.4}}, overlap: {most: 0.3},\n"
		"  fill: {region: {box: {lower: %s, upper: %s}}}, box: {shear: %s, pressure: %s, along: %s}}}\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[30 mm, 24 mm]" : "[12 mm, 11 mm, 10 mm]",
		dim == 2 ? "[true, true]" : "[true, true, true]", step, integrator, dim == 2 ? "[0, 0]" : "[0, 0, 0]",
		dim == 2 ? "[30 mm, 24 mm]" : "[12 mm, 11 mm, 10 mm]", dim == 2 ? "60" : "600",
		dim == 2 ? "500" : "5e4", dim == 2 ? "y" : "all");
}

static double budget(quern_run *run) {
	static const char *const kinds[] = { "total.kinetic", "total.stored", "total.sheared", "total.damped",
		"total.rubbed" };
	double sum = -number(run, "total.box_work", 0);
	harness_look(run);
	for (int k = 0; k < 5; k++) sum += number(run, kinds[k], 0);
	return sum;
}

/* From the first step on, which brings the box's own flow. */
static void books(void **state) {
	static const char *const integrators[] = { "symplectic_euler", "velocity_verlet", "position_verlet" };
	bool good = true;
	(void)state;
	table_head("a dense box that shears under pressure, to a strain of 1.2");
	for (int dim = 2; dim <= 3; dim++)
		for (int a = 0; a < 3; a++) {
			double off[2], work = 0;
			for (int half = 0; half < 2; half++) {
				const int64_t steps = half ? 8000 : 4000;
				seen s = watch(dense(dim, integrators[a], (dim == 2 ? 5e-6 : 5e-7) / (half ? 2 : 1)));
				harness_steps(s.run, 1);
				const double start = budget(s.run), was = number(s.run, "total.box_work", 0);
				harness_steps(s.run, steps);
				off[half] = budget(s.run) - start;
				work = number(s.run, "total.box_work", 0) - was;
				look(&s);
				double momentum = 0, size = 0;
				for (int k = 0; k < dim; k++) {
					static const char *const names[] = { "momentum.x", "momentum.y", "momentum.z" },
											 *const given[] = { "box.impulse_x", "box.impulse_y",
												 "box.impulse_z" };
					momentum = fmax(momentum, fabs(value(&s, names[k]) - value(&s, given[k])));
				}
				const quern_column m = harness_field(s.run, "grain.mass"),
								   v = harness_field(s.run, "grain.velocity");
				for (uint32_t i = 0; i < harness_count(s.run, "grain"); i++)
					size += m.real[0][i] * fabs(v.real[0][i]);
				if (!half)
					good &=
						table_row("  momentum less what the box gave, over all", momentum / size, 0, 1e-13);
				leave(&s);
			}
			char name[80];
			snprintf(name, sizeof name, "%d-D, %s: work of the box, J", dim, integrators[a]);
			table_note(name, work);
			good &= table_row("  energy less that work, over it", off[0] / work, 0, 1e-3);
			good &= table_row("  the same with half the step", off[1] / work, 0, 5e-4);
		}
	assert_true(good);
}

/* ---- pressure ---- */

/* Without friction and shear grains come to rest, and bear what they are asked to. */
static void pressure(void **state) {
	bool good = true;
	(void)state;
	table_head("stress of grains that a box was closed on, over what was asked");
	for (int dim = 2; dim <= 3; dim++)
		for (int y = 0; y < 2; y++) {
			const double asked = dim == 2 ? 200 : 2e4;
			seen s = watch(harness_open(1,
				"{quern: 1, dimension: %d, seed: 4, gravity: %s, domain: {lower: %s, upper: %s, periodic: %s},\n"
				"time: {end: 1}, output: {every: 1}, observe: [stress, box],\n"
				"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 20 %%, law: uniform}},\n"
				"  contact: {linear: {stiffness: 1e5, restitution: 0.1, friction: 0}},\n"
				"  fill: {packer: random, region: {box: {lower: %s, upper: %s}}},\n"
				"  box: {pressure: %g, along: %s}}}\n",
				dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
				dim == 2 ? "[30 mm, 30 mm]" : "[12 mm, 12 mm, 12 mm]",
				dim == 2 ? "[true, true]" : "[true, true, true]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
				dim == 2 ? "[30 mm, 30 mm]" : "[12 mm, 12 mm, 12 mm]", asked, y ? "y" : "all"));
			const double before = value(&s, "box.packing");
			harness_until(s.run, dim == 2 ? 0.5 : 0.12);
			look(&s);
			const double xx = value(&s, "stress.xx"), yy = value(&s, "stress.yy"),
						 zz = value(&s, "stress.zz");
			const double found = y ? yy : (xx + yy + zz) / dim;
			char name[80];
			snprintf(name, sizeof name, "%d-D, %s: packing fraction before", dim, y ? "y" : "all");
			table_note(name, before);
			table_note("  and after", value(&s, "box.packing"));
			good &= table_row("  mean normal stress of contacts", found / asked, 1, 1e-2);
			good &=
				table_row("  normal stress of velocities", value(&s, "stress.kinetic_yy") / asked, 0, 1e-3);
			good &=
				table_row("  xy less yx", (value(&s, "stress.xy") - value(&s, "stress.yx")) / asked, 0, 1e-9);
			good &= fabs(value(&s, "box.x") - (dim == 2 ? 0.03 : 0.012)) > 1e-4 || y;
			leave(&s);
		}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(lists),
		cmocka_unit_test(across_the_seam),
		cmocka_unit_test(own_flow),
		cmocka_unit_test(books),
		cmocka_unit_test(pressure),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
