/* SPDX-License-Identifier: MIT */
/* A hybrid that is given what it is not made for: cells smaller than grains, zones too thin, a flow that is through the zone before anybody
 * has looked, a density that is not that of the grains, material that is all surface, mass for a full cell, grains that must grow in a
 * jam. docs/stability.md, section 5 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "beyond.h"
#include "harness.h"
#include "held.h"
#include "report.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double diameter = 2e-3, gravity = 9.81, width = 0.04;

/* A column of discs between walls; what is 0 or NULL is as in held.c. */
typedef struct column {
	const char *name;
	double height, cell, depth, half_width, packed, bulk;
	const char *hybrid, *grains; /* more keys */
	double jump;                 /* m: the zone goes so much deeper at once */
	bool brief;                  /* in the shorter version too */
	int seed;
} column;

/* What became of it. */
typedef struct outcome {
	double kinetic, top, carried, densest,
		share; /* last quarter, over m g d; diameters; worst; ever; of points */
	bool refused, warned, ended;
	char said[512];
} outcome;

static double else_of(double x, double otherwise) { return x > 0 ? x : otherwise; }

static void text_of(const column *c, char *out, size_t size) {
	const double height = else_of(c->height, 0.06), cell = else_of(c->cell, 4e-3);
	snprintf(out, size,
		"quern: 1\ndimension: 2\nseed: %d\ngravity: [0, -9.81]\n"
		"domain: {lower: [0, 0], upper: [%g, %.17g]}\ntime: {end: 1000}\noutput: {every: 1000}\n"
		"grains:\n  material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}}\n"
		"  integrator: symplectic_euler\n" /* its step is the unit of updates and growth here */
		"  contact: {linear: {stiffness: 1e6, restitution: 0.5, friction: 0.4}}\n"
		"  fill:\n    - {region: {box: {lower: [0, -0.7 mm], upper: [%g, -0.7 mm]}}, fixed: true}\n"
		"    - {region: {box: {lower: [0.001, 0.001], upper: [%g, %g]}}, settle: true}\n%s"
		"bodies:\n  - plane: {point: [0, 0], normal: [0, 1], boundary: sticky}\n"
		"  - plane: {point: [0, 0], normal: [1, 0], contact: {friction: 0}}\n"
		"  - plane: {point: [%g, 0], normal: [-1, 0], contact: {friction: 0}}\n"
		"continuum:\n  cell: %.17g\n  material: {mu_i: {bulk_modulus: %g, critical_density: %g}}\n"
		"hybrid:\n  oracle: [{packing_fraction: {depth: %g, half_width: %g}}]\n  substeps: 20\n  update: 400\n%s",
		c->seed ? c->seed : 7, width, floor(0.2 / cell) * cell, width, width - 0.001, height,
		c->grains ? c->grains : "", width, cell, else_of(c->bulk, 3e5), else_of(c->packed, 1975),
		else_of(c->depth, 0.014), else_of(c->half_width, 4e-3), c->hybrid ? c->hybrid : "");
}

/* The first of what is said, up to where it says what to do. */
static void keep(outcome *o, const char *text) {
	const char *mark = strstr(text, "error: "), *from = mark ? mark + 7 : text;
	if (!mark && strstr(text, "warning: ") == text) from = text + 9;
	const char *end = strpbrk(from, ";\n");
	const size_t n = end ? (size_t)(end - from) : strlen(from);
	if (!*o->said) snprintf(o->said, sizeof o->said, "%.*s", (int)n, from);
}

static void keep_fault(outcome *o, const quern_report *report) {
	char text[2048] = "";
	FILE *file = tmpfile();
	assert_non_null(file);
	quern_report_print(report, file);
	rewind(file);
	text[fread(text, 1, sizeof text - 1, file)] = '\0';
	fclose(file);
	o->refused = true;
	keep(o, text);
}

static void log_path(char path[HARNESS_PATH]) {
	snprintf(path, HARNESS_PATH, "/tmp/quern-%ld.log", (long)getpid());
}

/* NULL if it is refused. */
static quern_run *open_text(const char *text, outcome *o) {
	char path[HARNESS_PATH];
	if (getenv("QUERN_PLUGINS_DIR")) setenv("QUERN_PLUGIN_PATH", getenv("QUERN_PLUGINS_DIR"), 1);
	quern_scene *scene = quern_scene_parse("column.yaml", text, strlen(text), &quern_host_table);
	quern_run *run = quern_report_errors(scene->report) ? NULL : quern_run_create(scene, 1);
	if (!run || quern_report_errors(scene->report)) {
		keep_fault(o, scene->report);
		return NULL;
	}
	if (quern_run_setup(run) != QUERN_OK) fail_msg("%s", run->message);
	log_path(path);
	run->log = quern_log_create(true, false);
	quern_log_open(run->log, path, false);
	return run;
}

/* Warnings and the reason of the end, and what there was. */
static void close_run(quern_run *run, outcome *o) {
	char path[HARNESS_PATH], text[4096] = "";
	o->densest = harness_field(run, "total.densest_ever").real[0][0];
	o->ended = run->status != QUERN_OK;
	o->warned = quern_log_warnings(run->log) > 0;
	if (o->ended) keep(o, run->message);
	quern_log_destroy(run->log);
	run->log = NULL;
	log_path(path);
	FILE *file = fopen(path, "r");
	assert_non_null(file);
	text[fread(text, 1, sizeof text - 1, file)] = '\0';
	fclose(file);
	unlink(path);
	const char *warning = strstr(text, "warning: ");
	if (warning) keep(o, warning);
	harness_close(run);
}

/* ==== a column at rest ==== */

static double share_of_points(quern_run *run) {
	const quern_column w = harness_field(run, "point.weight"), m = harness_field(run, "point.mass");
	const double all = quern_run_carries(run, "mass");
	double sum = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) sum += w.real[0][i] * m.real[0][i];
	return all > 0 ? sum / all : 0;
}

static double poured(quern_run *run) {
	return harness_has(run, "grain_source.mass") ? harness_field(run, "grain_source.mass").real[0][0] : 0;
}

/* Runs on until then, or to its end; at a quarter of it the zone jumps. */
static void go_on(quern_run *run, double time, double jump, outcome *o) {
	const double mass = quern_run_carries(run, "mass");
	const held h = { .run = run };
	const double top = held_top(&h);
	bool jumped = !(jump > 0);
	while (run->status == QUERN_OK && quern_run_time(run) < time) {
		if (!jumped && quern_run_time(run) > 0.25 * time) {
			*harness_param(run, "oracle.packing_fraction", "depth") += jump;
			jumped = true;
		}
		if (harness_try(run, 1) != QUERN_OK) break;
		const double carried = quern_run_carries(run, "mass") / (mass + poured(run)) - 1;
		o->carried = fabs(carried) > fabs(o->carried) ? carried : o->carried;
		if (quern_run_time(run) > 0.75 * time)
			o->kinetic = fmax(o->kinetic, quern_run_carries(run, "kinetic") / (mass * gravity * diameter));
	}
	o->share = share_of_points(run);
	o->top = (held_top(&h) - top) / diameter;
}

static outcome row(const column *c) {
	char text[3000];
	outcome o = { .kinetic = 0 };
	text_of(c, text, sizeof text);
	quern_run *run = open_text(text, &o);
	if (!run) {
		beyond_row("%s | | | | | | refuses: %s", c->name, o.said);
		return o;
	}
	harness_settle(run);
	go_on(run, beyond_is_long() ? 0.2 : 0.1, c->jump, &o);
	close_run(run, &o);
	beyond_row("%s | %.1e | %+.2f | %+.4f | %.3f | %.2f | %s%s", c->name, o.kinetic, o.top, o.carried,
		o.densest, o.share,
		o.ended    ? "ends: "
		: o.warned ? "warns: "
				   : "nothing",
		o.said);
	return o;
}

static void head(const char *title, const char *first) {
	char columns[400];
	snprintf(columns, sizeof columns,
		"%s | kinetic energy over m g d, last quarter | top, diameters | carried mass off, worst | densest place "
		"| share of points | what Quern says",
		first);
	beyond_table(title, columns);
}

static bool counts(const column *c) { return c->brief || beyond_is_long(); }

/* As a hybrid that measures its grains' density sees rest (plugins/hybrid/packing.c). Of 48 such beds, of 12 seeds, the one that moves most
 * has 7e-4; one that trembles has 1e-2 and more. */
static void rests(const char *name, const outcome *o) {
	if (o->refused || o->ended) fail_msg("%s: %s", name, o->said);
	if (!(o->kinetic < 1e-3 && fabs(o->top) < 0.5 && fabs(o->carried) < 0.02))
		fail_msg("%s does not rest: %g, %g, %g", name, o->kinetic, o->top, o->carried);
}

static void says(const char *name, const outcome *o, const char *what) {
	if (!strstr(o->said, what)) fail_msg("%s: '%s' instead of '%s'", name, o->said, what);
}

/* A cell that holds no grain, or more than has room, says nothing of how full it is. */
static void small_cells(void **state) {
	static const column of[] = { { "8 mm, 4 diameters", .cell = 8e-3, .half_width = 8e-3, .depth = 0.02 },
		{ "5 mm, 2.5 diameters", .cell = 5e-3, .half_width = 5e-3 },
		{ "4 mm, 2 diameters", .cell = 4e-3, .brief = true }, { "3.08 mm, 1.5 diameters", .cell = 0.04 / 13 },
		{ "2.5 mm, 1.25 diameters", .cell = 2.5e-3, .brief = true }, { "2 mm, 1 diameter", .cell = 2e-3 },
		{ "1 mm, half a diameter", .cell = 1e-3, .brief = true } };
	(void)state;
	head("Cells smaller than a grain: a column at rest", "cell");
	for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
		if (!counts(&of[k])) continue;
		const outcome o = row(&of[k]);
		if (of[k].cell >= 3e-3) rests(of[k].name, &o);
		else if (of[k].cell >= 2e-3) says(of[k].name, &o, "diameters of a grain wide");
		else if (!o.refused) fail_msg("%s is taken", of[k].name);
	}
}

static void thin_zones(void **state) {
	static const column of[] = { { "24 mm, ramp", .half_width = 12e-3, .hybrid = "  weights: ramp\n" },
		{ "16 mm, ramp", .half_width = 8e-3, .hybrid = "  weights: ramp\n" },
		{ "12 mm, ramp", .half_width = 6e-3, .hybrid = "  weights: ramp\n" },
		{ "8 mm, half shares", .half_width = 4e-3 },
		{ "8 mm, ramp", .half_width = 4e-3, .hybrid = "  weights: ramp\n", .brief = true },
		{ "6 mm, ramp", .half_width = 3e-3, .hybrid = "  weights: ramp\n", .brief = true },
		{ "8 mm, 3 mm below the surface", .half_width = 4e-3, .depth = 3e-3, .brief = true } };
	(void)state;
	head("A zone thinner than its ramp: a column at rest, cells of 4 mm", "zone");
	for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
		if (!counts(&of[k])) continue;
		const outcome o = row(&of[k]);
		if (of[k].half_width < 4e-3) says(of[k].name, &o, "must be a cell at least");
		else if (of[k].depth > 0) says(of[k].name, &o, "must be less than the depth");
		else rests(of[k].name, &o);
	}
}

static void other_densities(void **state) {
	static const column of[] = { { "1400 kg/m^3", .packed = 1400, .brief = true }, { "1700", .packed = 1700 },
		{ "1900", .packed = 1900 }, { "2000", .packed = 2000, .brief = true }, { "2100", .packed = 2100 },
		{ "2300", .packed = 2300, .brief = true },
		{ "2000, bulk modulus 3000 Pa", .packed = 2000, .bulk = 3e3, .brief = true } };
	(void)state;
	head(
		"A jump of density: these grains settle at about 2000 kg/m^3, and the continuum is given another density",
		"given");
	for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
		if (!counts(&of[k])) continue;
		const outcome o = row(&of[k]);
		if (of[k].bulk > 0 || of[k].packed < 1950) says(of[k].name, &o, "times as dense as the continuum");
		else if (of[k].packed > 2250) says(of[k].name, &o, "these grains have settled at");
		else rests(of[k].name, &o);
	}
}

static void all_surface(void **state) {
	static const column of[] = { { "10 mm", .height = 0.01, .brief = true }, { "20 mm", .height = 0.02 },
		{ "30 mm", .height = 0.03, .brief = true } };
	(void)state;
	head("Material that is all surface: the zone's middle would lie 14 mm below it", "height");
	for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
		if (!counts(&of[k])) continue;
		const outcome o = row(&of[k]);
		rests(of[k].name, &o);
		if (of[k].height < 0.014 && o.share != 0) fail_msg("%s: there are points", of[k].name);
	}
}

static void full_cells(void **state) {
	static const column of[] = {
		{ "within the continuum",
			.grains = "  source: [{region: {box: {lower: [0.01, 0.01], upper: [0.03, 0.03]}}, rate: 1}]\n",
			.brief = true },
		{ "across the zone",
			.grains = "  source: [{region: {box: {lower: [0.01, 0.03], upper: [0.03, 0.05]}}, rate: 1}]\n" },
		{ "above all",
			.grains =
				"  source: [{region: {box: {lower: [0.005, 0.08], upper: [0.035, 0.1]}}, rate: 10, velocity: [0, -0.5]}]\n" }
	};
	(void)state;
	head("Mass poured into full cells: a source in a column at rest", "source");
	for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
		if (!counts(&of[k])) continue;
		const outcome o = row(&of[k]);
		if (of[k].brief) {
			rests(of[k].name, &o);
			says(of[k].name, &o, "has no room");
		}
	}
}

/* In a hundred steps grains of some seeds tremble, and how much is chance: with seeds 1 to 9 up to 0.2 m g d, in the middle 0.02. */
static void hundred_steps(void) {
	static const column of[] = { { "100", .jump = 0.02, .hybrid = "  growth: 100\n" },
		{ "100, seed 1", .jump = 0.02, .hybrid = "  growth: 100\n", .seed = 1 },
		{ "100, seed 2", .jump = 0.02, .hybrid = "  growth: 100\n", .seed = 2 } };
	double kinetic[sizeof of / sizeof *of];
	for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
		const outcome o = row(&of[k]);
		if (o.ended || !(fabs(o.carried) < 0.02 && o.densest < 1.15))
			fail_msg("%s: %g, %g %s", of[k].name, o.carried, o.densest, o.said);
		kinetic[k] = o.kinetic;
	}
	const double middle = held_middle(kinetic, sizeof of / sizeof *of);
	if (!(middle < 0.1)) fail_msg("growth in 100 steps: %g", middle);
}

static void growth_in_a_jam(void **state) {
	static const column of[] = { { "7000 steps", .jump = 0.02, .hybrid = "  growth: 7000\n", .brief = true },
		{ "700", .jump = 0.02, .hybrid = "  growth: 700\n" },
		{ "1", .jump = 0.02, .hybrid = "  growth: 1\n" },
		{ "none grows", .jump = 0.02, .hybrid = "  growth: 0\n" },
		{ "7000, packer expand", .jump = 0.02, .hybrid = "  packer: expand\n  growth: 7000\n" },
		{ "1, packer expand", .jump = 0.02, .hybrid = "  packer: expand\n  growth: 1\n" } };
	(void)state;
	head(
		"Growth in a jam: the zone jumps down by ten diameters at once, and grains grow by a radius in so many steps",
		"growth");
	for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
		if (!counts(&of[k])) continue;
		const outcome o = row(&of[k]);
		/* in one step: in a jam of some seeds that makes energy, in others grains tremble with some tenths of m g d */
		const bool at_once = of[k].hybrid && strstr(of[k].hybrid, "growth: 1\n");
		if (at_once && o.ended) says(of[k].name, &o, "grains grow too fast");
		else if (at_once && o.kinetic < 1 && fabs(o.carried) < 0.02) continue;
		else if (o.ended || !(o.kinetic < 0.1 && fabs(o.carried) < 0.02 && o.densest < 1.15))
			fail_msg("%s: %g, %g, %g %s", of[k].name, o.kinetic, o.carried, o.densest, o.said);
	}
	hundred_steps();
}

/* ==== a flow through a zone that stands ==== */

static void fast_flow(void **state) {
	static const double speed[] = { 0.5, 2, 5, 10, 20, 50 };
	(void)state;
	beyond_table(
		"A zone that stands in a fast flow: a layer of discs flies through 60 mm of continuum, an update every 400 grain steps",
		"m/s | cells of 4 mm between two updates | top, diameters | carried mass off, worst | at the end | densest place | share of points | what Quern says");
	for (size_t k = 0; k < sizeof speed / sizeof *speed; k++) {
		char text[3000];
		outcome o = { .kinetic = 0 };
		if (!beyond_is_long() && speed[k] != 5 && speed[k] != 20) continue;
		snprintf(text, sizeof text,
			"quern: 1\ndimension: 2\nseed: 7\ngravity: [0, 0]\n"
			"domain: {lower: [0, 0], upper: [0.16, 0.08], periodic: [true, false]}\ntime: {end: 1000}\noutput: {every: 1000}\n"
			"grains:\n  material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}}\n"
			"  integrator: symplectic_euler\n"
			"  contact: {linear: {stiffness: 1e6, restitution: 0.5, friction: 0.4}}\n"
			"  fill: {region: {box: {lower: [0, 0.02], upper: [0.16, 0.06]}}, velocity: [%g, 0]}\n"
			"continuum:\n  cell: 4 mm\n  material: {mu_i: {bulk_modulus: 3e5, critical_density: 2075}}\n"
			"hybrid:\n  oracle: [{fixed: {otherwise: discrete, boxes: [{lower: [0, 0], upper: [0.04, 0.08], zone: discrete}, "
			"{lower: [0.04, 0], upper: [0.05, 0.08], zone: hybrid}, {lower: [0.05, 0], upper: [0.11, 0.08], zone: continuum}, "
			"{lower: [0.11, 0], upper: [0.12, 0.08], zone: hybrid}, {lower: [0.12, 0], upper: [0.16, 0.08], zone: discrete}]}}]\n"
			"  substeps: 20\n  update: 400\n",
			speed[k]);
		quern_run *run = open_text(text, &o);
		if (!run) fail_msg("%s", o.said);
		const double mass = quern_run_carries(run, "mass");
		harness_try(run, 1);
		const double cells = speed[k] * run->clock.dt / 20 * 400 / 4e-3;
		go_on(run, fmin(0.32 / speed[k], 0.1), 0, &o);
		const double left = quern_run_carries(run, "mass") / mass - 1;
		close_run(run, &o);
		beyond_row("%g | %.2f | %+.2f | %+.4f | %+.4f | %.3f | %.2f | %s%s", speed[k], cells, o.top,
			o.carried, left, o.densest, o.share,
			o.ended    ? "ends: "
			: o.warned ? "warns: "
					   : "nothing",
			o.said);
		if (speed[k] > 15) says("a fast flow", &o, "grains and points carry");
		else if (speed[k] < 8 && o.warned) fail_msg("a slow flow: %s", o.said);
	}
}

int main(int argc, char **argv) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(small_cells), cmocka_unit_test(thin_zones),
		cmocka_unit_test(fast_flow), cmocka_unit_test(other_densities), cmocka_unit_test(all_surface),
		cmocka_unit_test(full_cells), cmocka_unit_test(growth_in_a_jam) };
	if (!beyond_begin(argc, argv, "hybrid")) return 2;
	const int failed = cmocka_run_group_tests(tests, NULL, NULL);
	beyond_end();
	return failed;
}
