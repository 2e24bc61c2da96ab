/* SPDX-License-Identifier: MIT */
/* Bodies that move: where they are at a time, what a grain on them does, that what they give is booked to the end (impulse,
 * moment, work), and that the continuum goes with them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <math.h>
#include <string.h>

static const double pi = 3.141592653589793;

#define assert_near(found, wanted, tolerance)                                                                \
	do {                                                                                                     \
		if (!(fabs((found) - (wanted)) <= (tolerance)))                                                      \
			fail_msg(#found " is %.17g, and " #wanted " %.17g: apart by more than %.3g", (double)(found),    \
				(double)(wanted), (double)(tolerance));                                                      \
	} while (0)

/* ---- where they are ---- */

static quern_run *open_box(const char *motion, double every) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [-1, -1], upper: [1, 1]}, "
		"time: {end: 4, step: 0.01}, output: {every: %g, fields: [body.velocity, body.spin]},\n"
		"bodies: [{box: {lower: [0.1, 0.1], upper: [0.3, 0.2], motion: {%s}}}, {plane: {point: [0, -0.5], "
		"normal: [0, 1]}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: [], place: [{position: [-0.9, "
		"0.9]}]}}\n",
		every, motion);
}

/* A place of the body, as it stood at first, seen at time t. */
static void place_of(quern_run *run, double x, double y, double out[2]) {
	const quern_column at = harness_field(run, "body.position"), turn = harness_field(run, "body.turn");
	out[0] = at.real[0][0] + turn.real[0][0] * x + turn.real[1][0] * y;
	out[1] = at.real[1][0] + turn.real[2][0] * x + turn.real[3][0] * y;
}

static void they_are_where_their_keys_say(void **state) {
	static const struct {
		const char *motion;
		double time, middle[2], angle, velocity[2], spin; /* of the middle */
	} rows[] = {
		{ "velocity: [0.1, -0.2]", 1.5, { 0.35, -0.15 }, 0, { 0.1, -0.2 }, 0 },
		{ "velocity: [0.1, 0], from: 1, until: 2", 0.5, { 0.2, 0.15 }, 0, { 0, 0 }, 0 },
		{ "velocity: [0.1, 0], from: 1, until: 2", 1.5, { 0.25, 0.15 }, 0, { 0.1, 0 }, 0 },
		{ "velocity: [0.1, 0], from: 1, until: 2", 3, { 0.3, 0.15 }, 0, { 0, 0 }, 0 },
		{ "spin: 0.5", 2, { 0.2, 0.15 }, 1, { 0, 0 }, 0.5 },
		{ "sinus: {amplitude: [0, 0.1], frequency: 0.25}", 1, { 0.2, 0.25 }, 0, { 0, 0 }, 0 },
		{ "sinus: {amplitude: [0, 0.1], frequency: 0.25, phase: 90 deg}", 1, { 0.2, 0.05 }, 0,
			{ 0, -0.1 * 0.5 * 3.141592653589793 }, 0 },
		{ "sinus: {swing: 0.4, frequency: 0.5}", 2, { 0.2, 0.15 }, 0, { 0, 0 }, 0.4 * 3.141592653589793 },
		{ "table: [{time: 1}, {time: 2, shift: [0.2, 0.1], angle: 0.5}, {time: 3, shift: [0.2, 0]}]", 1.5,
			{ 0.3, 0.2 }, 0.25, { 0.2, 0.1 }, 0.5 },
		{ "table: [{time: 1}, {time: 2, shift: [0.2, 0.1], angle: 0.5}, {time: 3, shift: [0.2, 0]}]", 3.5,
			{ 0.4, 0.15 }, 0, { 0, 0 }, 0 },
		{ "velocity: [0.1, 0], spin: 1, about: [0, 0]", 1,
			{ 0.1 + 0.2 * 0.5403023058681398 - 0.15 * 0.8414709848078965,
				0.2 * 0.8414709848078965 + 0.15 * 0.5403023058681398 },
			1,
			{ 0.1 - (0.2 * 0.8414709848078965 + 0.15 * 0.5403023058681398),
				0.2 * 0.5403023058681398 - 0.15 * 0.8414709848078965 },
			1 },
	};
	(void)state;
	for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
		quern_run *run = open_box(rows[r].motion, 0.5);
		harness_until(run, rows[r].time);
		harness_look(run);
		double middle[2];
		place_of(run, 0.2, 0.15, middle);
		const quern_column at = harness_field(run, "body.position"), v = harness_field(run, "body.velocity"),
						   turn = harness_field(run, "body.turn"), spin = harness_field(run, "body.spin");
		assert_near(spin.real[0][0], rows[r].spin, 1e-12);
		assert_near(turn.real[0][0], cos(rows[r].angle), 1e-12);
		assert_near(turn.real[2][0], sin(rows[r].angle), 1e-12);
		/* that of the frame's origin, carried over to the middle */
		const double arm[2] = { middle[0] - at.real[0][0], middle[1] - at.real[1][0] };
		const double moves[2] = { v.real[0][0] - spin.real[0][0] * arm[1],
			v.real[1][0] + spin.real[0][0] * arm[0] };
		for (int k = 0; k < 2; k++) {
			assert_near(middle[k], rows[r].middle[k], 1e-12);
			assert_near(moves[k], rows[r].velocity[k], 1e-12);
		}
		assert_true(turn.real[0][1] == 1 && at.real[0][1] == 0 && v.real[0][1] == 0); /* the plane */
		harness_close(run);
	}
}

/* ---- grains ---- */

/* A wall that comes with V throws a grain at rest off with (1 + e) V, as a grain that comes with -V rebounds from a wall at
 * rest: the laws are the same in a frame that moves along. */
static void a_wall_that_comes_is_a_grain_that_comes(void **state) {
	const double speed = 0.5, e = 0.6;
	(void)state;
	for (int dim = 2; dim <= 3; dim++) {
		double left[2];
		for (int moves = 0; moves < 2; moves++) {
			char motion[60] = "";
			if (moves)
				snprintf(
					motion, sizeof motion, ", motion: {velocity: [%g, 0%s]}", speed, dim == 3 ? ", 0" : "");
			const char *z = dim == 3 ? ", 0" : "", *low = dim == 3 ? ", -1" : "", *up = dim == 3 ? ", 1" : "";
			quern_run *run = harness_open(1,
				"{quern: 1, dimension: %d, gravity: [0, 0%s], domain: {lower: [-1, -1%s], upper: [1, 1%s]}, "
				"time: {end: 0.05}, output: {every: 0.05},\n"
				"bodies: [{plane: {point: [0, 0%s], normal: [1, 0%s]%s}}],\n"
				"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: {linear: {stiffness: %g, "
				"restitution: %g, friction: 0.3}},\n"
				"  place: [{position: [0.011, 0.1%s], velocity: [%g, 0.2%s]}]}}\n",
				dim, z, low, up, z, z, motion, dim == 2 ? 1e6 : 1e4, e, z, moves ? 0.0 : -speed, z);
			harness_until(run, 0.05);
			const quern_column v = harness_field(run, "grain.velocity");
			left[moves] = v.real[0][0] - (moves ? speed : 0);
			assert_near(left[moves], e * speed, 0.005 * speed);
			harness_close(run);
		}
		assert_near(left[0], left[1], 1e-9 * speed);
	}
}

/* Against a wall that swings, an elastic grain's rebound converges with the order of the integrator, since wall and grain are
 * looked at at one time. */
static double rebound(const char *integrator, double step) {
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [-1, -1], upper: [1, 1]}, time: {end: "
		"0.08, step: %.17g}, "
		"output: {every: 0.08},\n"
		"bodies: [{plane: {point: [0, 0], normal: [1, 0], motion: {sinus: {amplitude: [0.02, 0], frequency: "
		"5}}}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: {linear: {stiffness: 1e5, "
		"restitution: 1, friction: "
		"0}}, integrator: %s, place: [{position: [0.03, 0.1], velocity: [-0.5, 0]}]}}\n",
		step, integrator);
	harness_until(run, 0.08);
	const double v = harness_field(run, "grain.velocity").real[0][0];
	harness_close(run);
	return v;
}

static void a_wall_and_a_grain_are_at_one_time(void **state) {
	(void)state;
	const double right = rebound("velocity_verlet", 1e-6);
	double error[3];
	for (int k = 0; k < 3; k++) error[k] = fabs(rebound("velocity_verlet", 8e-5 / (1 << k)) - right);
	print_message("elastic rebound from a swinging wall: %.9g m/s, off by %.2g, %.2g, %.2g\n", right,
		error[0], error[1], error[2]);
	assert_true(right > 0.6 && error[0] > 3 * error[1] && error[1] > 3 * error[2] && error[0] < 1e-3);
}

/* A wall that sets off late, or leaps in its table, limits the step from the beginning: nothing is run through. */
static void nothing_is_run_through(void **state) {
	static const char *const courses[] = { "velocity: [20, 0], from: 0.01",
		"sinus: {amplitude: [0.05, 0], frequency: 60, phase: -90 deg}",
		"table: [{time: 0.01}, {time: 0.012, shift: [0.05, 0]}]" };
	(void)state;
	for (size_t k = 0; k < sizeof courses / sizeof *courses; k++) {
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [-1, -1], upper: [10, 1]}, time: "
			"{end: 0.02}, output: "
			"{every: 0.02},\n"
			"bodies: [{box: {lower: [-0.05, -0.1], upper: [0, 0.1], motion: {%s}}}],\n"
			"grains: {material: {density: 2500, radius: {mean: 0.01}}, overlap: {most: 0}, contact: {linear: "
			"{stiffness: 1e8, "
			"restitution: 1, friction: 0}}, place: [{position: [0.0101, 0]}]}, observe: [energy, "
			"{wall_torque: {body: 0}}]}\n",
			courses[k]);
		harness_until(run, 0.02);
		const double v = harness_field(run, "grain.velocity").real[0][0],
					 m = harness_field(run, "grain.mass").real[0][0];
		const double work = harness_field(run, "body.work").real[0][0];
		print_message("%s: the grain leaves with %.4g m/s, of %.6g J work %.6g\n", courses[k], v,
			0.5 * m * v * v, work);
		assert_true(v > 10);
		assert_near(0.5 * m * v * v, work, 0.02 * work);
		harness_close(run);
	}
}

/* What a body is told to have given is what the grains have got: momentum, moment about its pivot, and work. */
static double kinetic(quern_run *run, int dim, double momentum[3], double moment[3], const double pivot[3]) {
	const quern_column x = harness_field(run, "grain.position"), v = harness_field(run, "grain.velocity"),
					   m = harness_field(run, "grain.mass"), r = harness_field(run, "grain.radius");
	const bool spins = harness_has(run, "grain.spin");
	const quern_column w = spins ? harness_field(run, "grain.spin") : (quern_column) { .real = { NULL } };
	const double share = dim == 2 ? 0.5 : 0.4;
	double sum = 0;
	memset(momentum, 0, 3 * sizeof *momentum);
	memset(moment, 0, 3 * sizeof *moment);
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) {
		double a[3] = { 0 }, u[3] = { 0 }, s[3] = { 0 };
		for (int k = 0; k < dim; k++) a[k] = x.real[k][i] - pivot[k], u[k] = v.real[k][i];
		if (spins && dim == 2) s[2] = w.real[0][i];
		else
			for (int k = 0; k < 3 && spins; k++) s[k] = w.real[k][i];
		const double mass = m.real[0][i], inertia = share * mass * r.real[0][i] * r.real[0][i];
		for (int k = 0; k < 3; k++) {
			const int p = (k + 1) % 3, q = (k + 2) % 3;
			momentum[k] += mass * u[k];
			moment[k] += mass * (a[p] * u[q] - a[q] * u[p]) + inertia * s[k];
			sum += 0.5 * mass * u[k] * u[k] + 0.5 * inertia * s[k] * s[k];
		}
	}
	return sum;
}

/* A box turns in a cloud of grains without gravity, and hits them. With elastic contacts and no friction lost energy is
 * none, and with both it is booked. */
static void what_a_turning_box_gives_is_booked(void **state) {
	static const double pivot[3] = { 0.1, 0.1, 0.1 };
	(void)state;
	for (int dim = 2; dim <= 3; dim++)
		for (int lossy = 0; lossy < 2; lossy++) {
			const char *z = dim == 3 ? ", 0.1" : "", *none = dim == 3 ? ", 0" : "",
					   *up = dim == 3 ? ", 0.2" : "";
			quern_run *run = harness_open(2,
				"{quern: 1, dimension: %d, gravity: [0, 0%s], domain: {lower: [-1, -1%s], upper: [1, 1%s]}, "
				"time: {end: 0.03}, output: {every: 0.03},\n"
				"bodies: [{box: {lower: [0.06, 0.09%s], upper: [0.14, 0.11%s], motion: {spin: 20%s}}}],\n"
				"grains: {material: {density: 2500, radius: {mean: 4 mm, spread: 10 %%}}, contact: {linear: "
				"{stiffness: "
				"%g, restitution: %g, friction: %g}},\n"
				"  fill: [{region: {box: {lower: [0.02, 0.115%s], upper: [0.18, 0.16%s]}}}]},\n"
				"observe: [energy, {wall_torque: {body: 0}}, {wall_force: {body: 0}}]}\n",
				dim, none, dim == 3 ? ", -1" : "", dim == 3 ? ", 1" : "", dim == 3 ? ", 0.06" : "",
				dim == 3 ? ", 0.14" : "", dim == 3 ? ", axis: [0.1, 0.2, 1]" : "", dim == 2 ? 1e6 : 1e4,
				lossy ? 0.5 : 1.0, lossy ? 0.4 : 0.0, dim == 3 ? ", 0.07" : "", dim == 3 ? ", 0.13" : "");
			double before[3], after[3], turned[3], turns[3];
			(void)z, (void)up;
			const double at_first = kinetic(run, dim, before, turned, pivot);
			assert_true(at_first == 0);
			harness_until(run, 0.03);
			harness_look(run);
			const double has = kinetic(run, dim, after, turns, pivot);
			const quern_column impulse = harness_field(run, "body.impulse"),
							   twist = harness_field(run, "body.twist");
			double push = 0, moment = 0;
			for (int k = 0; k < dim; k++) push += fabs(after[k]);
			for (int k = 0; k < 3; k++) moment += fabs(turns[k]);
			assert_true(push > 0 && moment > 0);
			for (int k = 0; k < dim; k++) assert_near(impulse.real[k][0], after[k], 1e-12 * push);
			for (int k = dim == 2 ? 2 : 0; k < 3; k++)
				assert_near(twist.real[dim == 2 ? 0 : k][0], turns[k], 1e-10 * moment);
			const double work = harness_field(run, "body.work").real[0][0];
			const double lost =
				harness_field(run, "total.damped").real[0][0] + harness_field(run, "total.rubbed").real[0][0];
			const double held = harness_field(run, "total.stored").real[0][0] +
								harness_field(run, "total.sheared").real[0][0];
			print_message(
				"dimension %d, %s: work %.6g J, motion %.6g, springs %.3g, losses %.6g, off by %.2g\n", dim,
				lossy ? "with losses" : "elastic", work, has, held, lost, (has + held + lost - work) / work);
			assert_near(has + held + lost, work, 1e-3 * work);
			assert_true(lossy || fabs(lost) < 1e-3 * work);
			harness_close(run);
		}
}

/* A grain rests on a floor that begins to move along: friction takes it with it, mu g t at first, and no faster than the
 * floor in the end. Then it rolls: a disc on a belt that is faster by c has v = c/3 where it rolls. */
static void a_belt_takes_a_grain_along(void **state) {
	const double speed = 0.3, friction = 0.2, gravity = 9.81, radius = 0.005, stiffness = 1e6;
	const double depth = 2500 * pi * radius * radius * gravity / stiffness,
				 slides = speed / (3 * friction * gravity);
	(void)state;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, %g], domain: {lower: [-1, -1], upper: [1, 1]}, time: {end: "
		"0.2}, "
		"output: {every: 0.01},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], motion: {velocity: [%g, 0]}}}],\n"
		"grains: {material: {density: 2500, radius: {mean: %g}}, contact: {linear: {stiffness: %g, "
		"restitution: 0.5, "
		"friction: %g}}, place: [{position: [0, %.17g]}]}}\n",
		-gravity, speed, radius, stiffness, friction, radius - depth);
	harness_until(run, 0.03);
	assert_true(0.03 < slides);
	assert_near(harness_field(run, "grain.velocity").real[0][0], friction * gravity * 0.03, 2e-3 * speed);
	harness_until(run, 0.2);
	assert_near(harness_field(run, "grain.velocity").real[0][0], speed / 3, 1e-3 * speed);
	harness_close(run);
}

/* The same scene seen from a train: floor, walls and grains all move with it, and nothing else is different. */
static void lists_follow_what_moves(void **state) {
	const double speed = 3;
	double place[2][2][40];
	uint32_t n = 0;
	(void)state;
	for (int train = 0; train < 2; train++) {
		const double v = train ? speed : 0;
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: 2, seed: 3, gravity: [0, -9.81], domain: {lower: [-1, -1], upper: [1, "
			"1]}, time: {end: 0.1}, "
			"output: {every: 0.01},\n"
			"bodies: [{plane: {point: [0, 0], normal: [0, 1], motion: {velocity: [%g, 0]}}}, {plane: {point: "
			"[-0.05, 0], "
			"normal: [1, 0], motion: {velocity: [%g, 0]}}}, {plane: {point: [0.05, 0], normal: [-1, 0], "
			"motion: {velocity: [%g, 0]}}}],\n"
			"grains: {material: {density: 2500, radius: {mean: 5 mm, spread: 10 %%}}, contact: {linear: "
			"{stiffness: 1e5, "
			"restitution: 0.5, friction: 0.4}},\n"
			"  fill: [{region: {box: {lower: [-0.044, 0.02], upper: [0.044, 0.05]}}, velocity: [%g, 0]}]}}\n",
			v, v, v, v);
		harness_until(run, 0.1);
		n = harness_count(run, "grain");
		assert_true(n > 20 && n <= 40);
		const int64_t *id = harness_field(run, "grain.id").id;
		for (uint32_t i = 0; i < n; i++)
			for (int k = 0; k < 2; k++)
				place[train][k][id[i]] = harness_field(run, "grain.position").real[k][i] - (k ? 0 : v * 0.1);
		harness_close(run);
	}
	for (uint32_t i = 0; i < n; i++)
		for (int k = 0; k < 2; k++) assert_near(place[0][k][i], place[1][k][i], 1e-6 * 0.005);
}

/* A paddle that turns and travels through periodic faces gives the same as one in the middle of the domain, to the last digits: to
 * grains on both sides of the seam, and to the nodes of a continuum there. */
static void what_moves_comes_back_through_periodic_faces(void **state) {
	(void)state;
	for (int continuum = 0; continuum < 2; continuum++) {
		double velocity[2][3][200], work[2], twist[2];
		uint32_t n = 0;
		for (int seam = 0; seam < 2; seam++) {
			const double x = seam ? 0.96 : 0.36;
			char what[400];
			if (continuum)
				snprintf(what, sizeof what,
					"continuum: {cell: 0.05, material: {elastic: {bulk_modulus: 1e4, poisson: 0.2, density: "
					"1000}}, "
					"fill: [{region: {box: {lower: [%g, 0.3], upper: [%g, 0.6]}}}%s]}",
					seam ? 0.8 : 0.2, seam ? 1.0 : 0.5,
					seam ? ", {region: {box: {lower: [0, 0.3], upper: [0.1, 0.6]}}}" : "");
			else
				snprintf(what, sizeof what,
					"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: {linear: {stiffness: "
					"1e5, restitution: 0.5, "
					"friction: 0.4}}, place: [{position: [%g, 0.53]}, {position: [%g, 0.47]}, {position: "
					"[%g, 0.53]}, {position: "
					"[%g, 0.53]}]}",
					x - 0.02, fmod(x + 0.06, 1), fmod(x + 0.05, 1), x);
			quern_run *run = harness_open(1,
				"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [1, 1], periodic: "
				"[true, false]}, "
				"time: {end: 0.2}, output: {every: 0.2},\n"
				"bodies: [{box: {lower: [%g, 0.49], upper: [%g, 0.51], boundary: sticky, motion: {velocity: "
				"[0.3, 0.05], spin: 5}}}],\n"
				"observe: [{wall_torque: {body: 0}}], %s}\n",
				x - 0.08, x + 0.08, what);
			harness_until(run, 0.2);
			const char *set = continuum ? "point" : "grain";
			char field[40];
			n = harness_count(run, set);
			assert_true(n > 2 && n <= 200);
			snprintf(field, sizeof field, "%s.velocity", set);
			const quern_column v = harness_field(run, field);
			snprintf(field, sizeof field, "%s.position", set);
			const quern_column at = harness_field(run, field);
			/* in the order of places as seen from the paddle's start */
			uint32_t order[200];
			for (uint32_t i = 0; i < n; i++) order[i] = i;
			for (uint32_t i = 1; i < n; i++)
				for (uint32_t k = i; k > 0; k--) {
					double a[2], b[2];
					for (int c = 0; c < 2; c++) {
						const double shift = c == 0 ? x - 0.5 : 0;
						a[c] = at.real[c][order[k - 1]] - shift, b[c] = at.real[c][order[k]] - shift;
						if (c == 0) a[c] -= floor(a[c]), b[c] -= floor(b[c]);
					}
					if (a[1] < b[1] - 1e-7 || (a[1] < b[1] + 1e-7 && a[0] < b[0])) break;
					const uint32_t t = order[k];
					order[k] = order[k - 1], order[k - 1] = t;
				}
			for (uint32_t i = 0; i < n; i++)
				for (int c = 0; c < 2; c++) velocity[seam][c][i] = v.real[c][order[i]];
			work[seam] = harness_field(run, "body.work").real[0][0];
			twist[seam] = harness_field(run, "body.twist").real[0][0];
			harness_close(run);
		}
		print_message("%s: work %.9g and %.9g J, moment %.9g and %.9g N m s\n",
			continuum ? "continuum" : "grains", work[0], work[1], twist[0], twist[1]);
		assert_true(work[0] > 0);
		assert_near(work[1], work[0], 1e-6 * work[0]);
		assert_near(twist[1], twist[0], 1e-6 * fabs(twist[0]));
		for (uint32_t i = 0; i < n; i++)
			for (int c = 0; c < 2; c++) assert_near(velocity[1][c][i], velocity[0][c][i], 1e-5);
	}
}

/* ---- the continuum ---- */

/* An elastic block sticks to a floor that sets off with a steady velocity: once its swinging has died down it goes along
 * with the floor, and what the floor gave is its momentum. Set off together it moves as one from the first step. */
static void an_elastic_block_goes_with_its_floor(void **state) {
	const double speed = 0.2;
	(void)state;
	quern_run *run = harness_open(2,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [-1, 0], upper: [3, 1]}, time: {end: 2}, "
		"output: {every: 0.1, fields: [point.stress]},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: sticky, motion: {velocity: [%g, 0]}}}],\n"
		"continuum: {cell: 0.1, material: {elastic: {bulk_modulus: 1000, poisson: 0.2, density: 1000}}, "
		"transfer: {picflip: {rate: 0}}, fill: {region: {box: {lower: [0, 0], upper: [0.6, 0.4]}}, velocity: "
		"[%g, 0]}},\n"
		"observe: [energy, {wall_torque: {body: 0}}, {wall_force: {body: 0}}]}\n",
		speed, speed);
	harness_until(run, 2);
	const quern_column v = harness_field(run, "point.velocity"), stress = harness_field(run, "point.stress");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		assert_near(v.real[0][i], speed, 1e-13);
		assert_near(v.real[1][i], 0, 1e-13);
		for (int k = 0; k < 3; k++) assert_near(stress.real[k][i], 0, 1e-9);
	}
	harness_close(run);
}

/* A block that is at rest first: impulse of the floor is the block's momentum. Work is its energy, but for what is lost in
 * every step where nodes take the floor's velocity at once: first order in the step. */
static double lost_share(double step) {
	const double speed = 0.2;
	quern_run *run = harness_open(2,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [-1, 0], upper: [3, 1]}, time: {end: 0.4, "
		"step: %g}, "
		"output: {every: 0.1, fields: [total.faces]},\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: sticky, motion: {sinus: {amplitude: [%g, "
		"0], "
		"frequency: 0.5, phase: 90 deg}}}}],\n"
		"continuum: {cell: 0.1, material: {elastic: {bulk_modulus: 1000, poisson: 0.2, density: 1000}}, "
		"transfer: {picflip: {rate: 0}}, fill: {region: {box: {lower: [0, 0], upper: [0.6, 0.4]}}}},\n"
		"observe: [energy, {wall_torque: {body: 0}}, {wall_force: {body: 0}}]}\n",
		step, speed / pi);
	harness_until(run, 0.4);
	harness_look(run);
	const quern_column v = harness_field(run, "point.velocity"), m = harness_field(run, "point.mass"),
					   energy = harness_field(run, "point.energy");
	double momentum = 0, has = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		momentum += m.real[0][i] * v.real[0][i];
		has += m.real[0][i] *
			   (0.5 * (v.real[0][i] * v.real[0][i] + v.real[1][i] * v.real[1][i]) + energy.real[0][i]);
	}
	const double given = harness_field(run, "body.impulse").real[0][0],
				 light = harness_field(run, "total.faces").real[0][0]; /* by the limit on light nodes */
	const double work = harness_field(run, "body.work").real[0][0];
	print_message("step %.4g s: impulse %.6g N s, momentum %.6g; work %.6g J, energy %.6g, off by %.2g\n",
		step, given + light, momentum, work, has, (has - work) / work);
	assert_near(given + light, momentum, 1e-12 * fabs(momentum));
	harness_close(run);
	return (work - has) / work;
}

static void a_floor_that_sets_off_books_what_it_gives(void **state) {
	(void)state;
	const double coarse = lost_share(4e-3), middle = lost_share(2e-3), fine = lost_share(1e-3);
	(void)middle;
	assert_true(fabs(fine) < 0.01);
	assert_true(coarse / fine > 3);
}

int main(void) {
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(they_are_where_their_keys_say),
		cmocka_unit_test(a_wall_that_comes_is_a_grain_that_comes),
		cmocka_unit_test(a_wall_and_a_grain_are_at_one_time),
		cmocka_unit_test(nothing_is_run_through),
		cmocka_unit_test(what_a_turning_box_gives_is_booked),
		cmocka_unit_test(a_belt_takes_a_grain_along),
		cmocka_unit_test(lists_follow_what_moves),
		cmocka_unit_test(what_moves_comes_back_through_periodic_faces),
		cmocka_unit_test(an_elastic_block_goes_with_its_floor),
		cmocka_unit_test(a_floor_that_sets_off_books_what_it_gives),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
