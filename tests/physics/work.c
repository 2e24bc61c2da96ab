/* SPDX-License-Identifier: MIT */
/* Where the energy of grains goes: the change of kinetic energy in a step is the work of the contacts and of gravity, what
 * dashpots take is what the program books, and the books of a whole collapse close. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <quern/vec.h>

static const double poisson = 0.25, gravity = 9.81;

/* A sphere is a hundredth as heavy as the same disc of one metre: softer laws keep the steps as long. */
static double stiffness(uint32_t dim) { return dim == 2 ? 1e5 : 2e3; } /* N/m */
static double young(uint32_t dim) { return dim == 2 ? 1e7 : 1e6; }     /* Pa */

typedef enum {
	LINEAR,
	HERTZ,
	PLASTIC,
	COHESIVE,
	LAWS
} law; /* cohesive: with a linear spring that has no dashpot */
static const char *const law_names[] = { "linear", "hertz", "plastic", "cohesive" };

typedef enum { EULER, VELOCITY, POSITION, INTEGRATORS } integrator;
static const char *const integrator_names[] = { "symplectic_euler", "velocity_verlet", "position_verlet" };

typedef struct heap {
	uint32_t dim;
	law by;
	integrator with;
	double width, height; /* m, of the column */
	const char *step;
} heap;

/* A column of grains of one centimetre, packed without contact forces, on a rough floor and against a wall: it gives way
 * at once. In 3-D it is a slab between smooth walls. */
static quern_run *open_scene(const heap *h) {
	static const char *const laws[] = { "{linear: {stiffness: %g, friction: 0.4, restitution: 0.4}}",
		"{hertz: {young: %g, poisson: 0.25, friction: 0.4, restitution: 0.4, impact_speed: 2}}",
		"{plastic: {stiffness: %g, friction: 0.4, restitution: 0.4}}",
		"[{linear: {stiffness: %g, friction: 0.4, restitution: 1}}, {cohesive: {surface_tension: %g}}]" };
	char words[160];
	/* a bridge pulls twice as much as a grain weighs, or a quarter of that in 3-D */
	const double tension = h->dim == 2 ? 120 : 0.1;
	snprintf(words, sizeof words, laws[h->by], h->by == HERTZ ? young(h->dim) : stiffness(h->dim), tension);
	const double top = h->height + 0.1;
	/* a bridge that tears is a jump of the force */
	const char *const finer = h->by == COHESIVE ? ", step: 0.02" : "";
	if (h->dim == 2)
		return harness_open(1,
			"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [2, %.17g]},\n"
			"time: {end: 100, step: %s}, output: {every: 10, fields: [contact.force, touch.force, "
			"total.kinetic,\n"
			"  total.potential]}, observe: [energy],\n"
			"bodies: [{plane: {point: [0, 0], normal: [0, 1]}}, {plane: {point: [0, 0], normal: [1, 0]}}],\n"
			"grains: {material: {density: 2500, radius: {mean: 0.005, spread: 0.2, law: uniform}}, overlap: "
			"{most: 0},\n"
			"  contact: %s, integrator: %s%s,\n"
			"  fill: [{region: {box: {lower: [0, 0], upper: [1, 0]}}, fixed: true},\n"
			"    {region: {box: {lower: [0, 0.01], upper: [%.17g, %.17g]}}}]}}\n",
			top, h->step, words, integrator_names[h->with], finer, h->width, h->height);
	return harness_open(1,
		"{quern: 1, dimension: 3, gravity: [0, -9.81, 0], domain: {lower: [0, 0, 0], upper: [2, %.17g, "
		"0.05]},\n"
		"time: {end: 100, step: %s}, output: {every: 10, fields: [contact.force, touch.force, "
		"total.kinetic,\n"
		"  total.potential]}, observe: [energy],\n"
		"bodies: [{plane: {point: [0, 0, 0], normal: [0, 1, 0]}}, {plane: {point: [0, 0, 0], normal: [1, 0, "
		"0]}},\n"
		"  {plane: {point: [0, 0, 0], normal: [0, 0, 1], contact: {friction: 0}}},\n"
		"  {plane: {point: [0, 0, 0.05], normal: [0, 0, -1], contact: {friction: 0}}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.005, spread: 0.2, law: uniform}}, overlap: "
		"{most: 0},\n"
		"  contact: %s, integrator: %s%s,\n"
		"  fill: [{region: {box: {lower: [0, 0, 0.005], upper: [0.6, 0, 0.045]}}, fixed: true},\n"
		"    {region: {box: {lower: [0, 0.01, 0.005], upper: [%.17g, %.17g, 0.045]}}}]}}\n",
		top, h->step, words, integrator_names[h->with], finer, h->width, h->height);
}

/* ==== one step ==== */

enum { MOST = 2048 };

/* The state of all grains by their ids. */
typedef struct state {
	quern_vec x[MOST], v[MOST], w[MOST];
} state;

static quern_vec vector_at(quern_column c, uint32_t i, uint32_t dim) {
	return (quern_vec) { c.real[0][i], c.real[1][i], dim == 3 ? c.real[2][i] : 0 };
}
static quern_vec axial_at(quern_column c, uint32_t i, uint32_t dim) {
	return dim == 3 ? vector_at(c, i, 3) : (quern_vec) { 0, 0, c.real[0][i] };
}

static void read_state(quern_run *run, uint32_t dim, state *s) {
	const quern_column x = harness_field(run, "grain.position"), v = harness_field(run, "grain.velocity"),
					   w = harness_field(run, "grain.spin"), id = harness_field(run, "grain.id");
	const uint32_t n = harness_count(run, "grain");
	assert_true(n < MOST);
	for (uint32_t i = 0; i < n; i++) {
		const int64_t k = id.id[i];
		assert_true(k < MOST);
		s->x[k] = vector_at(x, i, dim);
		s->v[k] = vector_at(v, i, dim);
		s->w[k] = axial_at(w, i, dim);
	}
}

typedef struct look {
	const heap *h;
	quern_run *run;
	const state *at, *mean; /* where forces were evaluated; velocities averaged over the kick */
	quern_column id, radius, mass, fixed;
	double work, drag, size; /* J: of contacts, of their dashpots, sum of magnitudes */
} look;

/* Work of one contact with force f on grain i, and on grain j (a body: none) the opposite; `spring` is the elastic part
 * of f. */
static void add_contact(look *l, int64_t i, int64_t j, quern_vec n, double arm_i, double arm_j, quern_vec f,
	quern_vec spring, double dt) {
	const quern_vec vi = l->mean->v[i], wi = l->mean->w[i];
	const quern_vec none = { 0, 0, 0 }, vj = j < 0 ? none : l->mean->v[j], wj = j < 0 ? none : l->mean->w[j];
	quern_vec v = quern_vec_sub(vi, vj);
	v = quern_vec_axpy(-arm_i, quern_vec_cross(wi, n), v);
	v = quern_vec_axpy(-arm_j, quern_vec_cross(wj, n), v);
	const double work = quern_vec_dot(f, v, 3) * dt;
	l->work += work;
	l->size += fabs(work);
	l->drag += quern_vec_dot(quern_vec_sub(f, spring), v, 3) * dt;
}

/* The elastic part of a contact's force f from its overlap and its history after the step; laws without a dashpot have no other. */
static quern_vec spring_force(
	const look *l, quern_vec f, quern_vec n, double overlap, double radius, quern_vec history) {
	if (l->h->by == PLASTIC || l->h->by == COHESIVE) return f;
	if (l->h->by == HERTZ) {
		const double k = 4.0 / 3 * young(l->h->dim) / (2 * (1 - poisson * poisson)) * sqrt(radius);
		return quern_vec_axpy(-1, history, quern_vec_scale(k * overlap * sqrt(overlap), n));
	}
	const double share = l->h->dim == 2 ? 1.0 / 3 : 2.0 / 7, k = stiffness(l->h->dim);
	return quern_vec_axpy(-share * k, history, quern_vec_scale(k * overlap, n));
}

static quern_vec history_at(const look *l, quern_column c, uint32_t q, quern_vec n) {
	if (l->h->dim == 3) return vector_at(c, q, 3);
	return (quern_vec) { -n.y * c.real[0][q], n.x * c.real[0][q], 0 };
}

/* Pairs across two blocks are listed in both: here they count in that of their first grain. */
static void add_pairs(look *l, double dt) {
	const quern_column f = harness_field(l->run, "contact.force"),
					   first = harness_field(l->run, "contact.first"),
					   second = harness_field(l->run, "contact.second");
	const quern_column history = harness_field(l->run, l->h->by == HERTZ ? "contact.shear" : "contact.slip");
	const quern_set_view pairs = quern_host_table.set(l->run, "contact"),
						 grains = quern_host_table.set(l->run, "grain");
	for (uint32_t b = 0; b < pairs.n_blocks; b++)
		for (uint32_t q = pairs.block[b]; q < pairs.block[b + 1]; q++) {
			const uint32_t a = (uint32_t)first.index[q], c = (uint32_t)second.index[q];
			if (a < grains.block[b] || a >= grains.block[b + 1]) continue;
			const int64_t i = l->id.id[a], j = l->id.id[c];
			const double ri = l->radius.real[0][a], rj = l->radius.real[0][c];
			const quern_vec d = quern_vec_sub(l->at->x[i], l->at->x[j]);
			const double length = sqrt(quern_vec_dot(d, d, 3)), overlap = ri + rj - length;
			if (overlap <= 0 && l->h->by != COHESIVE) continue;
			const quern_vec n = quern_vec_scale(1 / length, d), force = vector_at(f, q, l->h->dim);
			const quern_vec spring =
				spring_force(l, force, n, overlap, ri * rj / (ri + rj), history_at(l, history, q, n));
			add_contact(l, i, j, n, ri - 0.5 * overlap, rj - 0.5 * overlap, force, spring, dt);
		}
}

static void add_touches(look *l, double dt) {
	static const quern_vec normals[] = { { 0, 1, 0 }, { 1, 0, 0 }, { 0, 0, 1 }, { 0, 0, -1 } };
	const quern_column f = harness_field(l->run, "touch.force"), grain = harness_field(l->run, "touch.grain"),
					   body = harness_field(l->run, "touch.body");
	const quern_column history = harness_field(l->run, l->h->by == HERTZ ? "touch.shear" : "touch.slip");
	for (uint32_t q = 0; q < harness_count(l->run, "touch"); q++) {
		const uint32_t a = (uint32_t)grain.index[q];
		const int64_t i = l->id.id[a];
		const quern_vec n = normals[body.index[q]];
		const double r = l->radius.real[0][a], shift = body.index[q] == 3 ? 0.05 : 0;
		const double overlap = r - (quern_vec_dot(l->at->x[i], n, 3) + shift);
		if (overlap <= 0 && l->h->by != COHESIVE) continue;
		const quern_vec force = vector_at(f, q, l->h->dim);
		const quern_vec spring = spring_force(l, force, n, overlap, r, history_at(l, history, q, n));
		add_contact(l, i, -1, n, r - 0.5 * overlap, 0, force, spring, dt);
	}
}

/* Kinetic energy of what moves, with the velocities of `s`. */
static double kinetic(const look *l, const state *s) {
	double sum = 0;
	for (uint32_t i = 0; i < harness_count(l->run, "grain"); i++) {
		const int64_t k = l->id.id[i];
		const double m = l->mass.real[0][i], r = l->radius.real[0][i];
		if (l->fixed.index[i]) continue;
		sum += 0.5 * m * quern_vec_dot(s->v[k], s->v[k], 3);
		sum += 0.5 * (l->h->dim == 2 ? 0.5 : 0.4) * m * r * r * quern_vec_dot(s->w[k], s->w[k], 3);
	}
	return sum;
}

/* Velocity Verlet's kicks are centred on the step's end: half a kick leads to the state that lasts until the next. */
static void half_kick(look *l, state *s, double dt) {
	const quern_column a = harness_field(l->run, "grain.acceleration"),
					   t = harness_field(l->run, "grain.spin_acceleration");
	for (uint32_t i = 0; i < harness_count(l->run, "grain"); i++) {
		const int64_t k = l->id.id[i];
		s->v[k] = quern_vec_axpy(0.5 * dt, vector_at(a, i, l->h->dim), s->v[k]);
		s->w[k] = quern_vec_axpy(0.5 * dt, axial_at(t, i, l->h->dim), s->w[k]);
	}
}

/* Position Verlet's forces are those of the middle of the way: half a step from the last state. */
static void half_a_way(const look *l, state *s, double dt) {
	for (uint32_t i = 0; i < harness_count(l->run, "grain"); i++) {
		const int64_t k = l->id.id[i];
		s->x[k] = quern_vec_axpy(0.5 * dt, s->v[k], s->x[k]);
	}
}

typedef struct gap {
	double work, damped; /* the worst of all steps, over the kinetic energy */
} gap;

/* One step: `before` holds the last one's outcome, and gets this one's. */
static gap follow_step(quern_run *run, const heap *h, state *before, bool compare) {
	static state now, mean, middle;
	const double damped = harness_field(run, "total.damped").real[0][0];
	harness_steps(run, 1);
	const double dt = run->clock.dt;
	look l = { .h = h, .run = run };
	l.id = harness_field(run, "grain.id");
	l.radius = harness_field(run, "grain.radius");
	l.mass = harness_field(run, "grain.mass");
	l.fixed = harness_field(run, "grain.fixed");
	read_state(run, h->dim, &now);
	mean = now;
	if (h->with == VELOCITY) half_kick(&l, &now, dt);
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++) {
		const int64_t k = l.id.id[i];
		if (h->with != VELOCITY) {
			mean.v[k] = quern_vec_scale(0.5, quern_vec_add(before->v[k], now.v[k]));
			mean.w[k] = quern_vec_scale(0.5, quern_vec_add(before->w[k], now.w[k]));
		}
		if (l.fixed.index[i]) mean.v[k] = mean.w[k] = (quern_vec) { 0, 0, 0 };
		else l.work -= l.mass.real[0][i] * gravity * mean.v[k].y * dt;
	}
	middle = *before;
	if (h->with == POSITION) half_a_way(&l, &middle, dt);
	l.at = h->with == VELOCITY ? &now : &middle;
	l.mean = &mean;
	gap g = { 0, 0 };
	if (compare) {
		const double was = kinetic(&l, before), is = kinetic(&l, &now);
		add_pairs(&l, dt);
		add_touches(&l, dt);
		g.work = fabs(is - was - l.work) / is;
		g.damped = fabs(harness_field(run, "total.damped").real[0][0] - damped + l.drag) / is;
	}
	*before = now;
	return g;
}

static void every_step(void **unused) {
	(void)unused;
	static state before;
	bool good = true;
	char what[80];
	table_head("work of a step, worst gap of 500 steps over kinetic energy");
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int which = 0; which < INTEGRATORS * LAWS; which++) {
			const heap h = { dim, (law)(which % LAWS), (integrator)(which / LAWS), dim == 2 ? 0.2 : 0.08,
				dim == 2 ? 0.2 : 0.1, "auto" };
			if (dim == 3 && h.with == POSITION && h.by != LINEAR) continue;
			gap worst = { 0, 0 };
			quern_run *run = open_scene(&h);
			harness_until(run, 0.1);
			read_state(run, dim, &before);
			follow_step(run, &h, &before, false);
			for (int k = 0; k < 500; k++) {
				const gap g = follow_step(run, &h, &before, true);
				worst.work = fmax(worst.work, g.work);
				worst.damped = fmax(worst.damped, g.damped);
			}
			snprintf(what, sizeof what, "%s, %s, %uD, %u grains: kinetic", law_names[h.by],
				integrator_names[h.with], dim, harness_count(run, "grain"));
			good &= table_row(what, worst.work, 0, 1e-12);
			good &= table_row("  booked as damped", worst.damped, 0, 1e-12);
			harness_close(run);
		}
	assert_true(good);
}

/* ==== a whole collapse ==== */

static const char *const kinds[] = { "kinetic", "potential", "stored", "sheared", "damped", "rubbed" };
enum { POTENTIAL = 1, KINDS = 6 };

static void read_books(quern_run *run, double out[KINDS + 1]) {
	harness_look(run);
	out[KINDS] = 0;
	for (int k = 0; k < KINDS; k++) {
		char name[32];
		snprintf(name, sizeof name, "total.%s", kinds[k]);
		out[k] = harness_field(run, name).real[0][0];
		out[KINDS] += out[k];
	}
}

/* The change of all kinds over what falling has released, in 0.5 s; those of each kind in `by_kind`, which may be NULL. */
static double collapse(const heap *h, double by_kind[KINDS], uint32_t *grains) {
	double begin[KINDS + 1], end[KINDS + 1];
	quern_run *run = open_scene(h);
	harness_steps(run, 1);
	read_books(run, begin);
	harness_until(run, 0.5);
	read_books(run, end);
	*grains = harness_count(run, "grain");
	harness_close(run);
	const double released = begin[POTENTIAL] - end[POTENTIAL];
	for (int k = 0; by_kind && k < KINDS; k++) by_kind[k] = (end[k] - begin[k]) / released;
	return (end[KINDS] - begin[KINDS]) / released;
}

static void whole_collapse(void **unused) {
	(void)unused;
	bool good = true;
	char what[80];
	table_head("a collapse of 0.5 s: change over the potential energy released");
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int which = 0; which < INTEGRATORS * LAWS; which++) {
			const heap h = { dim, (law)(which % LAWS), (integrator)(which / LAWS), dim == 2 ? 0.2 : 0.08,
				dim == 2 ? 0.26 : 0.13, "auto" };
			if (dim == 3 && h.with != EULER && h.by != LINEAR) continue;
			double by_kind[KINDS];
			uint32_t grains;
			const double sum = collapse(&h, by_kind, &grains);
			snprintf(what, sizeof what, "%s, %s, %uD, %u grains: sum", law_names[h.by],
				integrator_names[h.with], dim, grains);
			/* the Verlets take steps twice as long */
			good &= table_row(what, sum, 0, h.with == EULER || h.by == COHESIVE ? 0.0005 : 0.001);
			for (int k = 0; k < KINDS; k++) {
				snprintf(what, sizeof what, "  %s", kinds[k]);
				table_note(what, by_kind[k]);
			}
		}
	assert_true(good);
}

/* The error of the budget falls faster than the step, over three halvings, however the heaps come to lie, which differs
 * from step to step. */
static void budget_converges(void **unused) {
	(void)unused;
	double sum[4];
	char what[80], step[32];
	uint32_t grains;
	table_head("the same, discs, linear, euler, over the step");
	for (int k = 0; k < 4; k++) {
		snprintf(step, sizeof step, "%.17g", 8e-5 / (1 << k));
		const heap h = { 2, LINEAR, EULER, 0.2, 0.26, step };
		sum[k] = collapse(&h, NULL, &grains);
		snprintf(what, sizeof what, "step %.3g s", 8e-5 / (1 << k));
		table_note(what, sum[k]);
	}
	const double order = log2(fabs(sum[0] / sum[3])) / 3;
	assert_true(table_row("order over three halvings", order, 1.5, 0.3));
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(every_step), cmocka_unit_test(whole_collapse),
		cmocka_unit_test(budget_converges) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
