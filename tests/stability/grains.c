/* SPDX-License-Identifier: MIT */
/* Grains with steps beyond their limit: one contact that swings, and a bed at rest. docs/stability.md, section 1 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "beyond.h"
#include "grains.h"
#include "harness.h"
#include <math.h>

static const double radius = 1e-3, density = 2500, gravity = 9.81, pi = 3.14159265358979312;

static double total(quern_run *run, const char *name) { return harness_field(run, name).real[0][0]; }

/* Of motion, weight and springs, all at one time; NaN where the run ends because somebody looks. */
static double mechanical(quern_run *run) {
	if (quern_run_look(run) != QUERN_OK) return NAN;
	quern_plan_refresh(run->plan);
	return total(run, "total.kinetic") + total(run, "total.potential") + total(run, "total.stored") +
		   total(run, "total.sheared");
}

double grains_kinetic(quern_run *run) {
	if (quern_run_look(run) != QUERN_OK) return NAN;
	quern_plan_refresh(run->plan);
	return total(run, "total.kinetic");
}

double grains_limit(quern_run *run) {
	double hard;
	char reason[200], hard_reason[200];
	quern_run_limit(run, &hard, reason, hard_reason);
	return hard;
}

/* ==== one contact ==== */

typedef struct law {
	const char *name, *parameters;
	double load;  /* N that rest on the contact */
	double limit; /* of stability, over the hard limit */
} law;

/* A disc that rests on a plane, without friction and damping. linear: w^2 = k/m, the limit is 2/w = (2/pi) t_c. hertz: it
 * presses as deep as it would at the expected speed of impact, so that w^2 = (3/2) k sqrt(d)/m = (15/8) (v/d)^2, while
 * t_c = 2.943 d/v. */
static law laws(bool hertz) {
	const double mass = density * pi * radius * radius;
	static const double young = 1e7, poisson = 0.25, speed = 1;
	const double k = 4.0 / 3 * young / (2 * (1 - poisson * poisson)) * sqrt(radius);
	const double depth = pow(1.25 * mass * speed * speed / k, 0.4);
	return hertz ? (law) { "hertz",
		"hertz: {young: 1e7, poisson: 0.25, restitution: 1, friction: 0, impact_speed: 1}",
		k * depth * sqrt(depth), 2 / (sqrt(15.0 / 8) * 2.9433) / 0.2 }
				 : (law) { "linear", "linear: {stiffness: 1e5, restitution: 1, friction: 0}", 10,
					   2 / pi / 0.2 };
}

static double resting_depth(const law *l, bool hertz) {
	static const double young = 1e7, poisson = 0.25;
	const double k = 4.0 / 3 * young / (2 * (1 - poisson * poisson)) * sqrt(radius);
	return hertz ? pow(l->load / k, 2.0 / 3) : l->load / 1e5;
}

static quern_run *open_contact(const law *l, bool hertz) {
	const double mass = density * pi * radius * radius, depth = resting_depth(l, hertz);
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, %.17g], domain: {lower: [-1, -1], upper: [1, 100]},\n"
		"time: {end: 1000}, output: {every: 1000, fields: [grain.force]},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1]}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, contact: {%s}, overlap: {start: 3, most: "
		"0},\n"
		"  place: [{position: [0, %.17g]}]}, observe: [energy]}\n",
		-l->load / mass, l->parameters, radius - depth * (1 - 1e-3));
}

/* The way from the place of rest, farthest in each half of the steps, over that at the start. */
static double swing(quern_run *run, double rest, int64_t steps) {
	double farthest[2] = { 0 };
	for (int64_t i = 0; i < steps; i++) {
		if (harness_try(run, 1) != QUERN_OK) return INFINITY;
		const double way = fabs(harness_field(run, "grain.position").real[1][0] - rest);
		farthest[2 * i >= steps] = fmax(farthest[2 * i >= steps], way);
	}
	return farthest[1] / farthest[0];
}

static void contact_row(bool hertz, double factor) {
	const law l = laws(hertz);
	quern_run *run = open_contact(&l, hertz);
	const double depth = resting_depth(&l, hertz);
	const int64_t steps = beyond_is_long() ? 20000 : 4000;
	beyond_force_step(run, factor * grains_limit(run));
	const double growth = swing(run, radius - depth, steps);
	char kept[32] = "-";
	if (isfinite(growth)) snprintf(kept, sizeof kept, "%.4f", growth);
	beyond_row("%s | %.3g | %.3g | %s | %lld | %s", l.name, factor, factor / l.limit, kept,
		(long long)run->clock.step, beyond_message(run));
	/* below the limit the swing stays; above, the run ends */
	if (factor <= 1 && (run->status != QUERN_OK || growth > 1.05)) fail_msg("%s grows", l.name);
	if (factor > l.limit) beyond_expect_culprit(run, "dem.forces", "grain");
	harness_close(run);
}

static void one_contact(void **unused) {
	static const double factors[] = { 0.1, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4 };
	(void)unused;
	beyond_table("One undamped contact that swings about its rest",
		"law | step over hard limit | over theory's limit | second half over first | steps | what Quern "
		"says");
	for (int hertz = 0; hertz <= 1; hertz++) {
		for (size_t i = 0; i < sizeof factors / sizeof *factors; i++) contact_row(hertz, factors[i]);
		contact_row(hertz, 1.03 * laws(hertz).limit);
	}
}

/* ==== one collision ==== */

/* Restitution of two equal discs that hit each other head-on without damping, with so many steps in a contact's
 * duration; `phase` of a step later. */
static double rebound(double steps, double phase) {
	static const double k = 1e5, speed = 0.1;
	const double mass = density * pi * radius * radius, step = pi * sqrt(0.5 * mass / k) / steps;
	const double half_gap = speed * step * (1 + phase);
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [-1, -1], upper: [1, 1]},\n"
		"time: {end: 1000}, output: {every: 1000}, grains: {material: {density: 2500, radius: {mean: 1 "
		"mm}},\n"
		"  contact: {linear: {stiffness: 1e5, restitution: 1, friction: 0}}, overlap: {most: 0},\n"
		"  place: [{position: [%.17g, 0], velocity: [0.1, 0]}, {position: [%.17g, 0], velocity: [-0.1, "
		"0]}]}}\n",
		-radius - half_gap, radius + half_gap);
	beyond_force_step(run, step);
	harness_steps(run, (int64_t)(2 * steps) + 8);
	const quern_column v = harness_field(run, "grain.velocity");
	const double after = v.real[0][1] - v.real[0][0];
	harness_close(run);
	return after / (2 * speed);
}

/* The page's figures, grains.md, section 2. */
static void one_collision(void **unused) {
	static const struct {
		double steps, most;
	} rows[] = { { 50, 1.0002 }, { 10, 1.003 }, { 5, 1.02 }, { 4, 1.04 } };
	enum { PHASES = 32 };
	(void)unused;
	beyond_table("A head-on collision without damping: restitution over 32 phases of the step",
		"step over t_c | step over hard limit | least | most");
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		double least = INFINITY, most = 0;
		for (int k = 0; k < PHASES; k++) {
			const double e = rebound(rows[i].steps, (double)k / PHASES);
			least = fmin(least, e);
			most = fmax(most, e);
		}
		beyond_row("1/%g | %.3g | %.4f | %.4f", rows[i].steps, 5 / rows[i].steps, least, most);
		if (!(most < rows[i].most)) fail_msg("a collision gains energy: %g at t_c/%g", most, rows[i].steps);
	}
}

/* ==== a bed ==== */

typedef struct bed {
	const char *name, *contact, *integrator;
	uint32_t dim;
	double sound; /* nothing is gained up to this factor */
	double seen[2],
		failing; /* the run ends between these two factors, and from that one on: in between it may boil */
} bed;

static quern_run *open_bed(const bed *b) {
	const char *zero = b->dim == 3 ? "0, " : "", *deep = b->dim == 3 ? "0.01, " : "";
	const char *wide = b->dim == 3 ? "0.012" : "0.03", *periodic = b->dim == 3 ? "true, " : "";
	return harness_open(1,
		"{quern: 1, dimension: %u, seed: 3, gravity: [0, %s-9.81],\n"
		"domain: {lower: [0, %s0], upper: [%s, %s0.2], periodic: [true, %sfalse]},\n"
		"time: {end: 1000}, output: {every: 1000, fields: [total.kinetic, total.potential]},\n"
		"bodies: [{plane: {point: [0, %s0], normal: [0, %s1]}}, {plane: {point: [0, %s0.2], normal: [0, "
		"%s-1]}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm, spread: 0.2}}, contact: {%s}, integrator: "
		"%s,\n"
		"  fill: [{region: {box: {lower: [0, %s0.001], upper: [%s, %s0.02]}}, settle: true}]}, observe: "
		"[energy]}\n",
		b->dim, zero, zero, wide, deep, periodic, zero, zero, zero, zero, b->contact, b->integrator, zero,
		wide, deep);
}

static void bed_row(const bed *b, double factor) {
	quern_run *run = open_bed(b);
	double unit = 0, moving = 0, gained = 0;
	harness_steps(run, 1);
	const quern_column mass = harness_field(run, "grain.mass");
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) unit += mass.real[0][i] * gravity * 2 * radius;
	beyond_force_step(run, factor * grains_limit(run));
	harness_steps(run, 1);
	const double before = mechanical(run);
	/* a bed with strong dashpots trembles for thousands of steps before that is told from its settling */
	const int64_t few = factor >= b->seen[0] ? 10000 : 4000;
	for (int64_t i = beyond_is_long() && b->dim == 2 ? 20000 : few;
		 i > 0 && run->status == QUERN_OK && harness_try(run, 1) == QUERN_OK; i--) {
		gained = fmax(gained, mechanical(run) - before);
		moving = fmax(moving, total(run, "total.kinetic"));
	}
	beyond_row("%s | %.3g | %.2g | %.2g | %lld | %s", b->name, factor, moving / unit, gained / unit,
		(long long)run->clock.step, beyond_message(run));
	if (factor <= 0.1 && gained > 1e-6 * unit) fail_msg("%s: energy at the recommended step", b->name);
	if (factor <= b->sound && (run->status != QUERN_OK || gained > 1e-5 * unit))
		fail_msg("%s: energy below the hard limit", b->name);
	if ((factor >= b->seen[0] && factor <= b->seen[1]) || factor >= b->failing)
		beyond_expect_culprit(run, "dem.", "grain");
	harness_close(run);
}

#define LINEAR(e) "linear: {stiffness: 1e5, restitution: " #e ", friction: 0.5}"
static const bed beds[] = { { "linear, e = 0.5", LINEAR(0.5), "symplectic_euler", 2, 1.25, { 2, 2 }, 3 },
	{ "linear, e = 0.1", LINEAR(0.1), "symplectic_euler", 2, 1.25, { 2, 2 }, 2 },
	{ "hertz, e = 0.5", "hertz: {young: 1e9, friction: 0.5}", "symplectic_euler", 2, 1.25, { 6, 6 }, 6 } };
static const bed more_beds[] = { { "linear, e = 0.9", LINEAR(0.9), "symplectic_euler", 2, 1.25, { 4, 4 }, 4 },
	{ "linear, e = 0.5, velocity Verlet", LINEAR(0.5), "velocity_verlet", 2, 1.5, { 2, 2 }, 2 },
	{ "linear, e = 0.1, velocity Verlet", LINEAR(0.1), "velocity_verlet", 2, 1.5, { 2, 3 }, 6 },
	{ "linear, e = 0.5, position Verlet", LINEAR(0.5), "position_verlet", 2, 1.5, { 2, 2 }, 2 },
	{ "linear, e = 0.1, position Verlet", LINEAR(0.1), "position_verlet", 2, 1.5, { 2, 3 }, 6 },
	{ "hertz, e = 0.5, velocity Verlet", "hertz: {young: 1e9, friction: 0.5}", "velocity_verlet", 2, 2.5,
		{ 3, 3 }, 8 },
	{ "hertz, e = 0.5, position Verlet", "hertz: {young: 1e9, friction: 0.5}", "position_verlet", 2, 2.5,
		{ 3, 3 }, 8 },
	{ "plastic, e = 0.5", "plastic: {stiffness: 1e5, restitution: 0.5, friction: 0.5}", "symplectic_euler", 2,
		1.25, { 8, 8 }, 8 },
	{ "linear, e = 0.5, 3-D", LINEAR(0.5), "symplectic_euler", 3, 1, { 4, 4 }, 4 } };

/* Of most beds the shorter version looks at both sides alone. */
static bool is_wanted(const bed *b, double factor) {
	if (!beyond_is_long()) return factor == b->sound || factor == b->seen[0] || factor == b->failing;
	return b->dim == 2 || factor == floor(factor);
}

static void bed_at_rest(void **unused) {
	static const double factors[] = { 0.05, 0.1, 0.5, 0.75, 0.9, 1, 1.25, 1.5, 2, 2.5, 3, 4, 6, 8 };
	(void)unused;
	beyond_table("A bed at rest: energies over m g d of all grains",
		"contact | step over hard limit | largest kinetic energy | energy gained | steps | what Quern says");
	for (size_t k = 0; k < sizeof beds / sizeof *beds; k++)
		for (size_t i = 0; i < sizeof factors / sizeof *factors; i++) bed_row(&beds[k], factors[i]);
	for (size_t k = 0; k < sizeof more_beds / sizeof *more_beds; k++)
		for (size_t i = 0; i < sizeof factors / sizeof *factors; i++)
			if (is_wanted(&more_beds[k], factors[i])) bed_row(&more_beds[k], factors[i]);
}

int main(int argc, char **argv) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(one_contact), cmocka_unit_test(every_mode),
		cmocka_unit_test(one_collision), cmocka_unit_test(bed_at_rest) };
	if (!beyond_begin(argc, argv, "grains")) return 2;
	const int failed = cmocka_run_group_tests(tests, NULL, NULL);
	beyond_end();
	return failed;
}
