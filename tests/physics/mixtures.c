/* SPDX-License-Identifier: MIT */
/* Several materials: every pair of them has the restitution and the friction that are asked for it, between grains and on bodies;
 * the step is that of the stiffest pair; mixtures have their shares of the mass to a grain; and a flow keeps every grain what it is. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "scene_text.h"
#include "table.h"
#include <stdlib.h>
#include <string.h>
#include <text.h>

static const double pi = 3.14159265358979312;

/* ==== single impacts ==== */

/* What is asked, by the names of both; that of sand on sand is the default. The walls have their materials alone. */
typedef struct asked_pair {
	const char *one, *two;
	double restitution, friction;
} asked_pair;
static const asked_pair pairs[] = { { "sand", "sand", 0.5, 0.4 }, { "sand", "steel", 0.9, 0.2 },
	{ "steel", "steel", 0.7, 0.1 }, { "sand", "rubber", 0.3, 0.6 }, { "steel", "rubber", 0.8, 0.05 } };
enum { N_PAIRS = sizeof pairs / sizeof *pairs };

static const double radii[] = { 5e-3, 3e-3 };

static double radius_of(const char *material) { return radii[!strcmp(material, "steel")]; }

static const asked_pair *asked(const char *one, const char *two) {
	for (int k = 0; k < N_PAIRS; k++)
		if ((!strcmp(pairs[k].one, one) && !strcmp(pairs[k].two, two)) ||
			(!strcmp(pairs[k].one, two) && !strcmp(pairs[k].two, one)))
			return &pairs[k];
	return &pairs[0];
}

/* A pair that nothing is of would be refused. */
static void add_law(text *t, bool hertz, bool rubber) {
	text_add(t, "contact: {%s, restitution: 0.5, friction: 0.4}},\n  pairs: [",
		hertz ? "hertz: {young: 1e15, impact_speed: 1" : "linear: {stiffness: 1e13");
	for (int k = 1; k < (rubber ? N_PAIRS : 3); k++)
		text_add(t, "%s{between: [%s, %s], restitution: %g, friction: %g}", k > 1 ? ", " : "", pairs[k].two,
			pairs[k].one, pairs[k].restitution, pairs[k].friction);
	text_add(t, "],\n");
}

static void add_head(text *t, uint32_t dim, bool hertz, const char *body) {
	const char *zero = dim == 3 ? ", 0" : "";
	t->length = 0;
	text_add(
		t, "{quern: 1, dimension: %u, gravity: [0, 0%s], time: {end: 1}, output: {every: 1},\n", dim, zero);
	text_add(t, "domain: {lower: [-9, -9%s], upper: [9, 9%s]}, %s\n", dim == 3 ? ", -9" : "",
		dim == 3 ? ", 9" : "", body);
	text_add(t,
		"grains: {materials: {sand: {density: 2500, radius: {mean: %g}}, steel: {density: 7800, radius: "
		"{mean: %g}}},\n  ",
		radii[0], radii[1]);
	add_law(t, hertz, strstr(body, "rubber"));
}

static void add_grain(
	text *t, uint32_t dim, const char *material, double x, double y, double vx, double vy, bool more) {
	const char *zero = dim == 3 ? ", 0" : "";
	text_add(t, "    {position: [%.17g, %.17g%s], velocity: [%.17g, %.17g%s], material: %s}%s\n", x, y, zero,
		vx, vy, zero, material, more ? "," : "]}}");
}

typedef struct motion {
	double x, y; /* m/s */
} motion;

static motion motion_of(quern_run *run, int64_t id) {
	const quern_column v = harness_field(run, "grain.velocity");
	const int64_t *ids = harness_field(run, "grain.id").id;
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++)
		if (ids[i] == id) return (motion) { v.real[0][i], v.real[1][i] };
	fail_msg("there is no grain %lld", (long long)id);
	return (motion) { 0 };
}

/* What the tangential impulse is over the normal one. */
static bool judge_friction(const char *title, double asked, motion before, motion after) {
	return table_row(title, fabs((after.y - before.y) / (after.x - before.x)), asked, 0.005);
}

/* All pairs of grains side by side, in both orders: head on, for their restitution, and with five times the speed along the
 * surface, for friction, where the normal turns a little while they touch. */
static bool grains_on_grains(uint32_t dim, bool hertz) {
	static const char *const names[] = { "sand", "steel" };
	static text t;
	bool good = true;
	char title[100];
	add_head(&t, dim, hertz, "");
	text_add(&t, "  place: [\n");
	for (int k = 0; k < 8; k++) {
		const char *one = names[k & 1], *two = names[k >> 1 & 1];
		add_grain(&t, dim, one, -radius_of(one) - 1e-9, k - 4, 0.5, k & 4 ? 5 : 0, true);
		add_grain(&t, dim, two, radius_of(two), k - 4, -0.5, 0, k < 7);
	}
	quern_run *run = harness_open(1, "%s", t.data);
	harness_steps(run, 600);
	for (int k = 0; k < 8; k++) {
		const char *one = names[k & 1], *two = names[k >> 1 & 1];
		const motion a = motion_of(run, 2 * k), b = motion_of(run, 2 * k + 1);
		snprintf(title, sizeof title, "%s on %s, %s", one, two, k & 4 ? "friction" : "restitution");
		if (k & 4) good &= judge_friction(title, asked(one, two)->friction, (motion) { 0.5, 5 }, a);
		else good &= table_row(title, b.x - a.x, asked(one, two)->restitution, 0.005);
	}
	harness_close(run);
	return good;
}

/* `body` at x = 0; `friction` < 0: what the pair says. */
static bool grains_on_a_body(
	uint32_t dim, bool hertz, const char *body, const char *material, double friction) {
	static const char *const names[] = { "sand", "steel" };
	static text t;
	bool good = true;
	char title[100];
	add_head(&t, dim, hertz, body);
	text_add(&t, "  place: [\n");
	for (int k = 0; k < 4; k++)
		add_grain(&t, dim, names[k & 1], -radius_of(names[k & 1]) - 1e-9, k - 4, 1, k & 2 ? 6 : 0, k < 3);
	quern_run *run = harness_open(1, "%s", t.data);
	harness_steps(run, 900);
	for (int k = 0; k < 4; k++) {
		const asked_pair *a = asked(names[k & 1], material);
		const motion after = motion_of(run, k);
		snprintf(title, sizeof title, "%s on a wall of %s, %s", names[k & 1], material,
			k & 2 ? "grazing: restitution" : "restitution");
		good &= table_row(title, -after.x, a->restitution, 0.005);
		if (k & 2)
			good &= judge_friction(
				"  friction", friction >= 0 ? friction : a->friction, (motion) { 1, 6 }, after);
	}
	harness_close(run);
	return good;
}

static void every_pair(void **unused) {
	static const char *const walls[][2] = { { "", "nothing said" }, { ", material: rubber", "rubber" },
		{ ", material: steel", "steel" } };
	bool good = true;
	char what[120];
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int hertz = 0; hertz <= 1; hertz++) {
			const char *zero = dim == 3 ? ", 0" : "";
			snprintf(what, sizeof what, "%s, %uD", hertz ? "hertz" : "linear", dim);
			table_head(what);
			good &= grains_on_grains(dim, hertz);
			for (int w = 0; w < 3; w++) {
				snprintf(what, sizeof what, "bodies: [{plane: {point: [0, 0%s], normal: [-1, 0%s]%s}}],",
					zero, zero, walls[w][0]);
				good &= grains_on_a_body(dim, hertz, what, walls[w][1], -1);
			}
			/* what a body says itself comes last */
			snprintf(what, sizeof what,
				"bodies: [{plane: {point: [0, 0%s], normal: [-1, 0%s], material: rubber, contact: {friction: "
				"0.25}}}],",
				zero, zero);
			good &= grains_on_a_body(dim, hertz, what, "rubber", 0.25);
		}
	assert_true(good);
}

/* Where one pair alone is rough, springs and spins exist for it; the others stay smooth. */
static void one_rough_pair(void **unused) {
	static text t;
	bool good = true;
	(void)unused;
	table_head("friction, where that of sand and steel alone is not 0");
	t.length = 0;
	text_add(&t, "{quern: 1, dimension: 3, gravity: [0, 0, 0], domain: {lower: [-9, -9, -9], upper: [9, 9, "
				 "9]}, time: {end: 1},\n"
				 "output: {every: 1}, grains: {materials: {sand: {density: 2500, radius: {mean: 5 mm}}, "
				 "steel: {density: 7800, "
				 "radius: {mean: 3 mm}}},\n"
				 "contact: {linear: {stiffness: 1e13, restitution: 1, friction: 0}}, pairs: {between: "
				 "[steel, sand], friction: "
				 "0.3},\n  place: [\n");
	add_grain(&t, 3, "sand", -5e-3 - 1e-9, 0, 0.5, 5, true);
	add_grain(&t, 3, "steel", 3e-3, 0, -0.5, 0, true);
	add_grain(&t, 3, "sand", -5e-3 - 1e-9, 1, 0.5, 5, true);
	add_grain(&t, 3, "sand", 5e-3, 1, -0.5, 0, false);
	quern_run *run = harness_open(1, "%s", t.data);
	harness_steps(run, 600);
	good &= judge_friction("sand on steel", 0.3, (motion) { 0.5, 5 }, motion_of(run, 0));
	good &= judge_friction("sand on sand", 0, (motion) { 0.5, 5 }, motion_of(run, 2));
	assert_true(harness_has(run, "contact.slip"));
	harness_close(run);
	assert_true(good);
}

/* ==== the step ==== */

static double step_of(const char *more, const char *pair, const char *place, char reason[200]) {
	double hard;
	char hard_reason[200];
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 3, gravity: [0, 0, 0], domain: {lower: [-1, -1, -1], upper: [1, 1, 1]}, time: "
		"{end: 1}, %s\n"
		"grains: {materials: {sand: {density: 2500, radius: {mean: 5 mm}}, steel: {density: 7800, radius: "
		"{mean: 3 mm}}},\n"
		"  contact: {linear: {stiffness: 1e5, friction: 0, restitution: 1}}, pairs: [%s], place: [%s]}}\n",
		more, pair, place);
	const double dt = quern_run_limit(run, &hard, reason, hard_reason);
	harness_close(run);
	return dt;
}

/* A 20th of half the period of the pair whose ratio of mass to stiffness is the least. */
static void steps(void **unused) {
	static const char four[] =
		"{position: [0, 0, 0], material: sand}, {position: [0.1, 0, 0], material: sand}, {position: "
		"[0.2, 0, 0], material: steel}, {position: [0.3, 0, 0], material: steel}";
	static const char floor[] =
		"{position: [0, 0, 0], material: sand}, {position: [0.1, 0, 0], material: sand}, {position: "
		"[0.2, 0, 0], material: steel, fixed: true}";
	static const char wall[] =
		"bodies: [{plane: {point: [-0.5, 0, 0], normal: [1, 0, 0], material: rubber}}],";
	const double sand = 2500 * 4.0 / 3 * pi * 125e-9, steel = 7800 * 4.0 / 3 * pi * 27e-9;
	const struct {
		const char *more, *pair, *place, *says;
		double mass, stiffness;
	} cases[] = { { "", "", four, "two lightest grains of steel", steel / 2, 1e5 },
		{ "", "{between: [sand, sand], stiffness: 1e6}", four, "two lightest grains of sand", sand / 2, 1e6 },
		{ "", "{between: [sand, steel], stiffness: 1e6}", four, "lightest grains of sand and steel",
			sand * steel / (sand + steel), 1e6 },
		{ "", "{between: [steel, sand], stiffness: 1e6}", floor, "lightest grains of sand and steel", sand,
			1e6 },
		{ wall, "{between: [rubber, sand], stiffness: 1e7}", four, "of the lightest grain on body.plane",
			sand, 1e7 } };
	bool good = true;
	char reason[200];
	(void)unused;
	table_head("the step, s");
	for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
		const double dt = step_of(cases[k].more, cases[k].pair, cases[k].place, reason);
		const double wanted = pi * sqrt(cases[k].mass / cases[k].stiffness) / 20;
		good &= table_row(cases[k].says, dt, wanted, 1e-12 * wanted);
		if (!strstr(reason, cases[k].says)) fail_msg("'%s' does not say '%s'", reason, cases[k].says);
	}
	assert_true(good);
}

/* ==== mixtures ==== */

static const double densities[] = { 2500, 7800, 1200 }, shares[] = { 0.45, 0.3, 0.25 };

static quern_run *mix(uint32_t dim, const char *packer, int seed) {
	const char *low = dim == 3 ? ", 0" : "", *high = dim == 3 ? ", 0.03" : "";
	return harness_open(1,
		"{quern: 1, dimension: %u, seed: %d, gravity: [0, 0%s], domain: {lower: [0, 0%s], upper: [0.1, "
		"0.05%s]},\n"
		"time: {end: 1}, grains: {materials: {sand: {density: %g, radius: {mean: 1 mm, spread: 10 %%}},\n"
		"  steel: {density: %g, radius: {mean: 0.7 mm}}, cork: {density: %g, radius: {mean: 1.6 mm, spread: "
		"20 %%, law: "
		"uniform}}},\n"
		"  contact: {linear: {stiffness: 1e5}},\n"
		"  fill: {region: {box: {lower: [0.002, 0.002%s], upper: [0.098, 0.048%s]}}, packer: %s,\n"
		"    mix: {sand: %g %%, steel: %g %%, cork: %g %%}}}}\n",
		dim, seed, low, low, high, densities[0], densities[1], densities[2], dim == 3 ? ", 0.002" : "",
		dim == 3 ? ", 0.028" : "", packer, 100 * shares[0], 100 * shares[1], 100 * shares[2]);
}

typedef struct census {
	double mass[3], left[3], heaviest; /* kg; of what lies in the left half */
	int n[3];
} census;

static census count(quern_run *run) {
	const int32_t *material = harness_field(run, "grain.material").index;
	const double *mass = harness_field(run, "grain.mass").real[0],
				 *x = harness_field(run, "grain.position").real[0];
	census c = { 0 };
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) {
		const int k = material[i];
		c.mass[k] += mass[i];
		c.left[k] += x[i] < 0.05 ? mass[i] : 0;
		c.n[k]++;
		c.heaviest = fmax(c.heaviest, mass[i]);
	}
	return c;
}

static void mixtures(void **unused) {
	static const char *const names[] = { "sand", "steel", "cork" };
	bool good = true;
	char what[100];
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int how = 0; how < 4; how++) {
			const char *packer = how & 1 ? "random" : "two_point_tangent";
			quern_run *run = mix(dim, packer, 1 + (how >> 1));
			const census c = count(run);
			const double whole = c.mass[0] + c.mass[1] + c.mass[2], left = c.left[0] + c.left[1] + c.left[2];
			snprintf(what, sizeof what, "%s, %uD, %d grains: share of the mass", packer, dim,
				c.n[0] + c.n[1] + c.n[2]);
			table_head(what);
			assert_true(c.n[0] + c.n[1] + c.n[2] > 300);
			for (int k = 0; k < 3; k++) {
				good &= table_row(names[k], c.mass[k] / whole, shares[k], c.heaviest / whole);
				good &= table_row("  in the left half", c.left[k] / left, shares[k], 0.06);
			}
			harness_close(run);
		}
	assert_true(good);
}

/* The same scene has the same mixture, another seed another one. */
static void seeds(void **unused) {
	uint32_t n[3];
	int32_t *material[3];
	(void)unused;
	for (int k = 0; k < 3; k++) {
		quern_run *run = mix(2, "two_point_tangent", k == 2 ? 8 : 7);
		n[k] = harness_count(run, "grain");
		material[k] = malloc(n[k] * sizeof(int32_t));
		assert_non_null(material[k]);
		memcpy(material[k], harness_field(run, "grain.material").index, n[k] * sizeof(int32_t));
		harness_close(run);
	}
	assert_true(n[0] == n[1] && !memcmp(material[0], material[1], n[0] * sizeof(int32_t)));
	assert_true(n[0] != n[2] || memcmp(material[0], material[2], n[0] * sizeof(int32_t)));
	for (int k = 0; k < 3; k++) free(material[k]);
}

/* Two materials that differ in nothing are one: the same grains, and the same bits as they fall. */
static quern_run *fall(const char *materials, const char *of) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, -0.01], upper: [0.05, 0.06]}, "
		"time: {end: 1},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1]}}, {plane: {point: [0, 0], normal: [1, 0], contact: "
		"{friction: 0}}},\n"
		"  {plane: {point: [0.05, 0], normal: [-1, 0]}}],\n"
		"grains: {%s, contact: {linear: {stiffness: 4e5}}, fill: {region: {box: {lower: [0.002, 0.002], "
		"upper: [0.048, "
		"0.05]}}%s}}}\n",
		materials, of);
}

static void one_and_the_same(void **unused) {
	quern_run *one = fall("material: {density: 2500, radius: {mean: 1 mm, spread: 20 %}}", "");
	quern_run *two =
		fall("materials: {a: {density: 2500, radius: {mean: 1 mm, spread: 20 %}}, b: {density: 2500, radius: "
			 "{mean: 1 mm, spread: 20 %}}}",
			", mix: {a: 50 %, b: 50 %}");
	(void)unused;
	harness_steps(one, 5000);
	harness_steps(two, 5000);
	const uint32_t n = harness_count(one, "grain");
	assert_int_equal(n, harness_count(two, "grain"));
	assert_true(n > 300);
	for (uint32_t k = 0; k < 2; k++)
		assert_memory_equal(harness_field(one, "grain.position").real[k],
			harness_field(two, "grain.position").real[k], n * sizeof(double));
	assert_false(harness_has(one, "grain.material"));
	assert_true(harness_has(two, "grain.material"));
	harness_close(one);
	harness_close(two);
}

/* ==== a flow ==== */

typedef struct known {
	double mass, radius, x;
	int32_t material;
} known;

static void look(quern_run *run, known *of) {
	const quern_column m = harness_field(run, "grain.mass"), r = harness_field(run, "grain.radius"),
					   x = harness_field(run, "grain.position");
	const int64_t *id = harness_field(run, "grain.id").id;
	const int32_t *material = harness_field(run, "grain.material").index;
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++)
		of[id[i]] = (known) { m.real[0][i], r.real[0][i], x.real[0][i], material[i] };
}

/* The shipped scene, for a hundred thousand steps of shear: who mixes stays what it is. */
static void keeps_its_grains(void **unused) {
	static const char *const sets[] = { "time.end=10 s", "output.every=1 s", NULL };
	enum { MOST = 2000 };
	static known before[MOST], after[MOST];
	char path[400];
	(void)unused;
	snprintf(path, sizeof path, "%s/configs/mixture.yaml", getenv("QUERN_SOURCE"));
	quern_run *run = harness_open_file(1, path, sets);
	const uint32_t n = harness_count(run, "grain");
	assert_true(n > 200 && n < MOST);
	look(run, before);
	harness_steps(run, 50000);
	const double *v = harness_field(run, "grain.velocity").real[0];
	double fastest = 0;
	for (uint32_t i = 0; i < n; i++) fastest = fmax(fastest, v[i]);
	harness_steps(run, 50000);
	assert_int_equal(harness_count(run, "grain"), n);
	look(run, after);
	census c = count(run);
	table_head("100000 steps down an incline");
	table_note("grains of sand", c.n[0]);
	table_note("grains of steel", c.n[1]);
	table_note("fastest at half time, m/s", fastest);
	assert_true(c.n[0] > 50 && c.n[1] > 50 && fastest > 0.1);
	for (uint32_t i = 0; i < n; i++)
		assert_true(before[i].mass == after[i].mass && before[i].radius == after[i].radius &&
					before[i].material == after[i].material);
	harness_close(run);
}

/* ==== the books ==== */

static double all_energy(quern_run *run) {
	static const char *const parts[] = { "total.kinetic", "total.potential", "total.stored", "total.sheared",
		"total.damped", "total.rubbed" };
	double sum = 0;
	harness_look(run);
	for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) sum += harness_field(run, parts[k]).real[0][0];
	return sum;
}

/* A column of sand, steel and cork collapses onto rubber and against steel: what is gone is in the books of dashpots and sliding,
 * also where a batch ends between two pairs of materials, and where springs of one pair are softer than those of another. */
static void books(void **unused) {
	(void)unused;
	quern_run *run = harness_open(2,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, -0.01], upper: [0.2, 0.1]}, time: "
		"{end: 10},\n"
		"output: {every: 1, fields: [total.kinetic, total.potential]}, observe: [energy], run: {batch: 64},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], material: rubber}}, {plane: {point: [0, 0], "
		"normal: [1, 0], "
		"material: steel}}],\n"
		"grains: {materials: {sand: {density: 2500, radius: {mean: 1.5 mm, spread: 10 %%}},\n"
		"  steel: {density: 7800, radius: {mean: 1 mm}}, cork: {density: 300, radius: {mean: 2 mm}}},\n"
		"  contact: [{linear: {stiffness: 1e5, restitution: 0.6, friction: 0.3}}, {rolling: {stiffness: "
		"1e4}}],\n"
		"  pairs: [{between: [sand, steel], linear: {stiffness: 2e5, friction: 0.1}}, {between: [cork, "
		"cork], rolling: {friction: "
		"0}, restitution: 0.2},\n"
		"    {between: [rubber, sand], restitution: 0.3}, {between: [cork, steel], linear: {friction: 0}}],\n"
		"  fill: {region: {box: {lower: [0.003, 0.003], upper: [0.05, 0.07]}}, mix: {sand: 50 %%, steel: 40 "
		"%%, cork: 10 "
		"%%}}}}\n");
	harness_steps(run, 1);
	const double before = all_energy(run), high = harness_field(run, "total.potential").real[0][0];
	double worst = 0;
	for (int k = 0; k < 100; k++) {
		harness_steps(run, 100);
		worst = fmax(worst, fabs(all_energy(run) - before));
	}
	const double released = high - harness_field(run, "total.potential").real[0][0];
	table_head("a collapse of three materials");
	table_note("grains", harness_count(run, "grain"));
	table_note("rubbed, over the potential energy released",
		harness_field(run, "total.rubbed").real[0][0] / released);
	assert_true(table_row("energy that is in no book, over that", worst / released, 0, 1e-3));
	harness_close(run);
}

/* ==== grains that are given ==== */

/* A table says by name of what each grain is; who has no radius has its material's, who has no material the first one's. */
static void given(void **unused) {
	char path[HARNESS_PATH];
	FILE *file = harness_file(path);
	(void)unused;
	fputs("x y radius material vx\n0.1 0.1 0.002 steel 1\n0.2 0.1 0.003 sand 2\n", file);
	fclose(file);
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [1, 1]}, time: {end: 1},\n"
		"grains: {materials: {sand: {density: 2500, radius: {mean: 5 mm}}, steel: {density: 7800, radius: "
		"{mean: 4 mm}}},\n"
		"  contact: {linear: {stiffness: 1e5}}, file: %s,\n"
		"  place: [{position: [0.5, 0.5], material: steel}, {position: [0.7, 0.5]}]}}\n",
		path);
	remove(path);
	static const struct {
		double radius, density;
		int32_t material;
	} wanted[] = { { 4e-3, 7800, 1 }, { 5e-3, 2500, 0 }, { 2e-3, 7800, 1 }, { 3e-3, 2500, 0 } };
	const int64_t *id = harness_field(run, "grain.id").id;
	const int32_t *material = harness_field(run, "grain.material").index;
	assert_int_equal(harness_count(run, "grain"), 4);
	for (uint32_t i = 0; i < 4; i++) {
		const double radius = harness_field(run, "grain.radius").real[0][i];
		assert_int_equal(material[i], wanted[id[i]].material);
		assert_true(radius == wanted[id[i]].radius);
		assert_true(fabs(harness_field(run, "grain.mass").real[0][i] /
							 (wanted[id[i]].density * pi * radius * radius) -
						 1) < 1e-14);
	}
	harness_close(run);
}

/* A file may say anything: a grain of no material is refused before it is looked up. */
static void refused(void **unused) {
	quern_text wrong = { 0 };
	(void)unused;
	quern_run *run = mix(2, "random", 1);
	assert_true(quern_run_accept(run, &wrong));
	harness_field(run, "grain.material").index[5] = 3;
	assert_false(quern_run_accept(run, &wrong));
	assert_non_null(strstr(quern_text_string(&wrong), "grain.material holds the number of no material"));
	quern_text_finish(&wrong);
	harness_close(run);
}

/* ==== bits ==== */

static void position_of(quern_run *run, double *out) {
	const quern_column x = harness_field(run, "grain.position");
	const int64_t *id = harness_field(run, "grain.id").id;
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++)
		for (uint32_t k = 0; k < 2; k++) out[2 * id[i] + k] = x.real[k][i];
}

/* The order of contacts in a list, the cuts of batches and the number of threads are nobody's business. */
static void same_bits(void **unused) {
	static const struct {
		uint32_t workers;
		const char *set;
	} ways[] = { { 1, "run.batch=256" }, { 2, "run.batch=256" }, { 1, "run.batch=8" }, { 2, "run.batch=41" },
		{ 1, "grains.neighbours=all_pairs" } };
	enum { MOST = 2000 };
	static double first[2 * MOST], other[2 * MOST];
	char path[400];
	(void)unused;
	snprintf(path, sizeof path, "%s/configs/mixture.yaml", getenv("QUERN_SOURCE"));
	for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
		const char *const sets[] = { ways[k].set, NULL };
		quern_run *run = harness_open_file(ways[k].workers, path, sets);
		const uint32_t n = harness_count(run, "grain");
		assert_true(n < MOST);
		harness_steps(run, 4000);
		position_of(run, k ? other : first);
		if (k && memcmp(first, other, n * 2 * sizeof(double)) != 0) fail_msg("%s: other bits", ways[k].set);
		harness_close(run);
	}
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(every_pair), cmocka_unit_test(one_rough_pair),
		cmocka_unit_test(steps), cmocka_unit_test(mixtures), cmocka_unit_test(seeds),
		cmocka_unit_test(one_and_the_same), cmocka_unit_test(keeps_its_grains), cmocka_unit_test(books),
		cmocka_unit_test(given), cmocka_unit_test(refused), cmocka_unit_test(same_bits) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
