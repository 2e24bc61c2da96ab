/* SPDX-License-Identifier: MIT */
/* One contact in each way in which it swings, with each integrator: steps from a hundredth of its duration to all of it.
 * docs/stability.md, section 1 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "beyond.h"
#include "grains.h"
#include "harness.h"
#include <math.h>

static const double radius = 1e-3, density = 2500, stiffness = 1e5, young = 1e11, poisson = 0.25,
					pi = 3.14159265358979312;

enum { NORMAL, TANGENTIAL, ROLLING };
typedef struct mode {
	const char *name, *laws;
	int way;
	bool hertz;
} mode;

/* Nothing is damped: what a mode gains, the step has made. Friction is as large as can be, so that nothing slips at first. */
static const mode modes[] = {
	{ "linear, normal", "{linear: {stiffness: 1e5, restitution: 1, friction: 0}}", NORMAL, false },
	{ "linear, tangential", "{linear: {stiffness: 1e5, restitution: 1, friction: 10}}", TANGENTIAL, false },
	{ "hertz, normal", "{hertz: {young: 1e11, poisson: 0.25, restitution: 1, friction: 0, impact_speed: 1}}",
		NORMAL, true },
	{ "hertz, tangential",
		"{hertz: {young: 1e11, poisson: 0.25, restitution: 1, friction: 10, impact_speed: 1}}", TANGENTIAL,
		true },
	{ "rolling",
		"{linear: {stiffness: 1e5, restitution: 1, friction: 0}}, {rolling: {stiffness: 1e5, friction: 10, damping: 0}}",
		ROLLING, false },
};
static const char *const integrators[] = { "symplectic_euler", "velocity_verlet", "position_verlet" };

static double mass(void) { return density * pi * radius * radius; }

/* Of Hertz's law, N/m^(3/2). */
static double hertz(void) { return 4.0 / 3 * young / (2 * (1 - poisson * poisson)) * sqrt(radius); }

/* The overlap at rest, small beside the radius, which is the lever; with Hertz as deep as at the expected speed, 1 m/s. */
static double depth_of(const mode *m) { return m->hertz ? pow(1.25 * mass() / hertz(), 0.4) : 1e-5; }

/* The square of the frequency. Spin makes a tangential spring act on a third of a disc's mass, and one of rolling on half of it. */
static double frequency2(const mode *m) {
	const double normal = m->hertz ? 1.5 * hertz() * sqrt(depth_of(m)) : stiffness;
	switch (m->way) {
	case NORMAL: return normal / mass();
	case TANGENTIAL: return 3 * normal * (m->hertz ? 2 * (1 - poisson) / (2 - poisson) : 1.0 / 3) / mass();
	default: return 2 * stiffness / mass();
	}
}

static quern_run *open_mode(const mode *m, const char *integrator) {
	const double depth = depth_of(m), load = m->hertz ? hertz() * depth * sqrt(depth) : stiffness * depth;
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, %.17g], domain: {lower: [-1, -1], upper: [1, 100]},\n"
		"time: {end: 1000}, output: {every: 1000, fields: [total.kinetic]},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1]}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, contact: [%s], integrator: %s,\n"
		"  overlap: {start: 3, most: 0}, place: [{position: [0, %.17g]}]}, observe: [energy]}\n",
		-load / mass(), m->laws, integrator, radius - depth);
}

/* The mode alone, as fast as it passes its rest when it swings by a thousandth of the overlap; J that it has. */
static double push(quern_run *run, const mode *m) {
	const double way = 1e-3 * depth_of(m) * sqrt(frequency2(m)), inertia = 0.5 * mass() * radius * radius;
	const quern_column v = harness_field(run, "grain.velocity");
	if (m->way == NORMAL) v.real[1][0] = way;
	if (m->way == TANGENTIAL) v.real[0][0] = way / 3;
	const double turn = m->way == NORMAL ? 0 : (m->way == TANGENTIAL ? 2.0 / 3 : 1) * way / radius;
	if (turn > 0) harness_field(run, "grain.spin").real[0][0] = turn;
	return 0.5 * mass() * (v.real[0][0] * v.real[0][0] + v.real[1][0] * v.real[1][0]) +
		   0.5 * inertia * turn * turn;
}

static void mode_row(const mode *m, const char *integrator, double share) {
	quern_run *run = open_mode(m, integrator);
	const double contact = 5 * grains_limit(run), first = push(run, m),
				 over = share * contact * sqrt(frequency2(m)) / 2;
	double most = 0;
	beyond_force_step(run, share * contact);
	for (int i = 0; i < 1000 && run->status == QUERN_OK && harness_try(run, 1) == QUERN_OK; i++)
		most = fmax(most, grains_kinetic(run) / first);
	beyond_row("%s | %s | %.3g | %.3g | %.3g | %lld | %s", m->name, integrator, share, over, most,
		(long long)run->clock.step, beyond_message(run));
	if (share <= 0.2 && (run->status != QUERN_OK || most > 1.2)) fail_msg("%s gains energy", m->name);
	/* within it energies swing about what they were, beyond it they grow */
	if ((over < 0.96 && most > 20) || (over > 1.05 && !(most > 1000)))
		fail_msg("%s with %s: the limit is elsewhere", m->name, integrator);
	/* nothing watches a grain that only turns to and fro */
	if (over > 1.02 && m->way == NORMAL) beyond_expect_culprit(run, "dem.forces", "grain");
	harness_close(run);
}

void every_mode(void **unused) {
	static const double shares[] = { 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7,
		0.8, 1 };
	(void)unused;
	beyond_table(
		"One undamped contact in each way in which it swings, a thousand steps: t_c is the duration from which the step is taken",
		"mode | integrator | step over t_c | over theory's limit | largest kinetic energy over the first | steps | what Quern says");
	for (size_t m = 0; m < sizeof modes / sizeof *modes; m++)
		for (int k = 0; k < 3; k++)
			for (size_t i = 0; i < sizeof shares / sizeof *shares; i++)
				mode_row(&modes[m], integrators[k], shares[i]);
}
