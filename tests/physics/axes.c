/* SPDX-License-Identifier: MIT */
/* The names of the axes mean nothing: a scene whose axes are interchanged runs as before, component by component, grains and
 * continuum, contacts, bodies, fixed grains, seams, conversions and energies alike. Cells are so full that no choice among
 * their parts is left to the order of their numbers. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "scene_text.h"
#include "table.h"
#include <math.h>
#include <stdlib.h>
#include <unistd.h>

static const double radius = 1e-3, cell = 6e-3;

typedef struct order {
	int dim, axis[3]; /* the old axis k is called axis[k] */
	double hand;      /* -1: a right hand becomes a left one, which turns axial vectors round */
} order;

typedef struct setting {
	const char *name, *contact, *continuum,
		*transfer; /* continuum NULL: grains alone, with slanting bodies */
	bool periodic; /* along the first axis */
} setting;

static double uniform(void) { return (double)rand() / RAND_MAX - 0.5; }

static void permuted(const order *o, const double x[3], double y[3]) {
	y[2] = 0;
	for (int k = 0; k < o->dim; k++) y[o->axis[k]] = x[k];
}

static const char *say(const order *o, char out[120], const double x[3]) {
	double v[3];
	permuted(o, x, v);
	if (o->dim == 2) snprintf(out, 120, "[%.17g, %.17g]", v[0], v[1]);
	else snprintf(out, 120, "[%.17g, %.17g, %.17g]", v[0], v[1], v[2]);
	return out;
}

/* A shaken lattice on a fixed layer, sheared and spinning. */
static void write_grains(FILE *out, const order *o) {
	const double edge = 2 * radius * sqrt(2) * 0.999;
	const int across = 20, layers = o->dim == 2 ? 1 : across;
	srand(7);
	fprintf(out, o->dim == 2 ? "x y radius vx vy fixed\n" : "x y z radius vx vy vz fixed\n");
	for (int k = 0; k < layers; k++)
		for (int j = 0; j < across; j++)
			for (int i = 0; i < across; i++) {
				double x[3] = { 0.5 * edge * i + 0.0076, 0.5 * edge * j + 0.0076, 0.5 * edge * k + 0.0076 },
					   v[3], y[3], u[3];
				if ((i + j + k) % 2) continue;
				const double r = radius * (1 + 0.02 * uniform());
				for (int a = 0; a < o->dim; a++) x[a] += 0.02 * radius * uniform();
				v[0] = 3 * (x[1] - 0.02), v[1] = -2 * x[0] + 1.5 * x[2], v[2] = -0.1 + 2 * x[1] - x[0];
				for (int a = 0; a < o->dim; a++) v[a] = j ? v[a] + 0.01 * uniform() : 0;
				permuted(o, x, y), permuted(o, v, u);
				for (int a = 0; a < o->dim; a++) fprintf(out, "%.17g ", y[a]);
				fprintf(out, "%.17g ", r);
				for (int a = 0; a < o->dim; a++) fprintf(out, "%.17g ", u[a]);
				fprintf(out, "%d\n", j == 0);
			}
}

static void plane(text *t, const order *o, const double point[3], const double normal[3]) {
	char a[120], b[120];
	text_add(t, "  - plane: {point: %s, normal: %s}\n", say(o, a, point), say(o, b, normal));
}

/* For a hybrid planes on faces of cells, all around but for the top, which so is the only surface. */
static void add_bodies(text *t, const setting *s, const order *o) {
	char a[120], b[120];
	text_add(t, "bodies:\n");
	for (int k = 0; k < o->dim && s->continuum; k++) {
		double x[3] = { 0.006, 0.006, 0.006 }, n[3] = { 0 };
		if (k == 0 && s->periodic) continue;
		n[k] = 1;
		plane(t, o, x, n);
		x[k] = 0.036, n[k] = -1;
		if (k != 1) plane(t, o, x, n);
	}
	if (s->continuum) return;
	const double slope[3] = { 1, 2, o->dim == 2 ? 0 : 3 };
	plane(t, o, o->dim == 2 ? (const double[3]) { 0.02, 0.005, 0 } : (const double[3]) { 0.02, 0.01, 0.004 },
		slope);
	text_add(t, "  - box: {lower: %s, upper: %s, contact: {restitution: 0.2}}\n",
		say(o, a, (const double[3]) { 0.03, 0.01, 0.03 }),
		say(o, b, (const double[3]) { 0.034, 0.02, 0.034 }));
}

static quern_run *open_scene(const setting *s, const order *o) {
	char path[HARNESS_PATH], a[120], b[120], c[120];
	static text t;
	FILE *out = harness_file(path);
	write_grains(out, o);
	fclose(out);
	t.length = 0;
	text_add(&t,
		"quern: 1\ndimension: %d\ngravity: %s\ntime: {end: 0.1}\nobserve: [energy]\noutput: {fields: "
		"[total.kinetic, total.potential, body.impulse, total.support]}\n",
		o->dim, say(o, a, (const double[3]) { 1, -9.81, -2 }));
	text_add(&t, "domain: {lower: %s, upper: %s, periodic: [",
		say(o, b, (const double[3]) { s->periodic ? 0.006 : 0, 0, 0 }),
		say(o, c, (const double[3]) { s->periodic ? 0.036 : 0.042, 0.048, 0.054 }));
	for (int k = 0; k < o->dim; k++)
		text_add(&t, "%s%s", k ? ", " : "", s->periodic && k == o->axis[0] ? "true" : "false");
	text_add(&t, "]}\n");
	add_bodies(&t, s, o);
	text_add(&t,
		"grains: {material: {density: 2500, radius: {mean: %g}}, contact: [%s], overlap: {start: 10, most: "
		"0}, file: %s}\n",
		radius, s->contact, path);
	if (s->continuum)
		text_add(&t,
			"continuum: {cell: %g, material: {%s}, transfer: %s}\nhybrid: {oracle: [{packing_fraction: "
			"{depth: 7 mm, half_width: 6 mm}}], substeps: 4, update: 40}\n",
			cell, s->continuum, s->transfer);
	quern_run *run = harness_open(1, "%s", t.data);
	unlink(path);
	return run;
}

/* What is compared: named numbers, those with axes brought back to the old ones. */
typedef struct result {
	int n;
	double at[400];
} result;

static void add(result *r, double x) {
	assert_true(r->n < 400);
	r->at[r->n++] = x;
}

static double sum_of(quern_run *run, const char *set, const char *times, const char *field, int k) {
	char name[64];
	double sum = 0;
	snprintf(name, sizeof name, "%s.%s", set, field);
	const quern_column c = harness_field(run, name);
	snprintf(name, sizeof name, "%s.%s", set, times);
	const quern_column m = harness_field(run, name);
	snprintf(name, sizeof name, "%s.weight", set);
	const double *w = harness_has(run, name) ? harness_field(run, name).real[0] : NULL;
	for (uint32_t i = 0; i < harness_count(run, set); i++)
		sum += (w ? w[i] : 1) * m.real[0][i] * c.real[k][i];
	return sum;
}

static int component(int dim, int a, int b) {
	static const int space[3][3] = { { 0, 3, 5 }, { 3, 1, 4 }, { 5, 4, 2 } },
					 plane[2][2] = { { 0, 2 }, { 2, 1 } };
	return dim == 2 ? plane[a][b] : space[a][b];
}

static void measure(quern_run *run, const order *o, bool hybrid, result *r) {
	static const char *const sets[] = { "grain", "point" };
	static const char *const totals[] = { "kinetic", "potential", "stored", "sheared", "damped", "rubbed",
		"exchanged" };
	r->n = 0;
	for (int s = 0; s < 1 + hybrid; s++) {
		add(r, harness_count(run, sets[s]));
		for (int k = 0; k < o->dim; k++) {
			add(r, sum_of(run, sets[s], "mass", "velocity", o->axis[k]));
			add(r, sum_of(run, sets[s], "mass", "position", o->axis[k]));
		}
	}
	for (int k = 0; k < (o->dim == 3 ? 3 : 1); k++)
		add(r, o->hand * sum_of(run, "grain", "mass", "spin", o->dim == 3 ? o->axis[k] : 0));
	for (int a = 0; a < o->dim && hybrid; a++)
		for (int b = 0; b < o->dim; b++) {
			add(r, sum_of(run, "point", "mass", "affine", o->axis[a] * o->dim + o->axis[b]));
			if (b >= a)
				add(r, sum_of(run, "point", "volume", "stress", component(o->dim, o->axis[a], o->axis[b])));
		}
	for (int k = 0; k < 6 + hybrid; k++) {
		char name[40];
		snprintf(name, sizeof name, "total.%s", totals[k]);
		add(r, harness_field(run, name).real[0][0]);
	}
	const quern_column impulse = harness_field(run, "body.impulse"),
					   support = harness_field(run, "total.support");
	for (int k = 0; k < o->dim; k++) {
		for (uint32_t b = 0; b < harness_count(run, "body"); b++) add(r, impulse.real[o->axis[k]][b]);
		add(r, support.real[o->axis[k]][0]);
	}
}

static double difference(const result *a, const result *b) {
	double worst = 0;
	assert_int_equal(a->n, b->n);
	for (int i = 0; i < a->n; i++)
		worst = fmax(worst, fabs(a->at[i] - b->at[i]) / (a->at[i] != 0 ? fabs(a->at[i]) : 1));
	return worst;
}

static result after(const setting *s, const order *o, int64_t steps) {
	result r;
	quern_run *run = open_scene(s, o);
	harness_steps(run, steps);
	harness_look(run);
	measure(run, o, s->continuum, &r);
	harness_close(run);
	return r;
}

static void axes_are_alike(void **state) {
	static const order as_it_is[] = { { 2, { 0, 1, 2 }, 1 }, { 3, { 0, 1, 2 }, 1 } };
	static const order others[] = { { 2, { 1, 0, 2 }, -1 }, { 3, { 1, 2, 0 }, 1 }, { 3, { 2, 1, 0 }, -1 } };
	static const char linear[] = "{linear: {stiffness: 1e4, restitution: 0.5}}",
					  hertz[] = "{hertz: {young: 1e6, impact_speed: 1}}";
	static const setting settings[] = { { "grains, linear", linear, NULL, NULL, false },
		{ "grains, hertz", hertz, NULL, NULL, false },
		{ "grains, linear, periodic", linear, NULL, NULL, true },
		{ "mu_i", linear, "mu_i: {bulk_modulus: 1e5, critical_density: 1350}", "picflip", false },
		{ "mu_i, periodic", linear, "mu_i: {bulk_modulus: 1e5, critical_density: 1350}", "picflip", true },
		{ "drucker_prager", hertz, "drucker_prager: {bulk_modulus: 1e5, density: 1350}", "mixed", false } };
	bool good = true;
	(void)state;
	table_head("largest difference under another order of axes, relative");
	for (size_t s = 0; s < sizeof settings / sizeof *settings; s++)
		for (int dim = 2; dim <= 3; dim++) {
			const int64_t steps = settings[s].continuum ? 7 : 30;
			const result plain = after(&settings[s], &as_it_is[dim - 2], steps);
			for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
				char name[80];
				if (others[k].dim != dim) continue;
				const result turned = after(&settings[s], &others[k], steps);
				snprintf(name, sizeof name, "%d-D, %s", dim, settings[s].name);
				good &= table_row(name, difference(&plain, &turned), 0, 1e-9);
			}
		}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(axes_are_alike) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
