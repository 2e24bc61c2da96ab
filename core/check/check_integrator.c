/* SPDX-License-Identifier: MIT */
/* quern_check_integrator - steps in time: free flight is exact, a constant force gives its momentum, a spring keeps its energy */
#include "check.h"
#include <math.h>
#include <quern/integrator.h>
#include <stdlib.h>
#include <string.h>

enum {
	FORCE,
	TORQUE,
	MASS,
	INERTIA,
	POSITION,
	SPEED,
	SPIN,
	NEW_POSITION,
	NEW_SPEED,
	NEW_SPIN,
	MEAN_SPEED,
	MEAN_SPIN
};
enum { WITH_SPIN = 1, WITH_MEAN = 2, OPENS = 4, VARIANTS = 8 };
static const double gravity[3] = { 0, -9.81, 0 };

static void call(const check_kernel *k, const check_batch *b) {
	const quern_integrator_ops *ops = k->ops;
	quern_column use[CHECK_ROWS];
	const uint32_t dim = k->dim, turns = check_axial(dim);
	quern_integrator_batch batch = { .n = b->n, .cap = b->cap, .dt = k->dt, .use = use };
	for (uint32_t a = 0; a < dim; a++) batch.gravity[a] = k->more ? ((const double *)k->more)[a] : 0;
	CHECK_VECTOR(batch.force, k, b, FORCE, dim);
	CHECK_VECTOR(batch.torque, k, b, TORQUE, turns);
	batch.mass = check_at(k, b, MASS, 0);
	batch.inertia = check_at(k, b, INERTIA, 0);
	CHECK_VECTOR(batch.position, k, b, POSITION, dim);
	CHECK_VECTOR(batch.velocity, k, b, SPEED, dim);
	CHECK_VECTOR(batch.spin, k, b, SPIN, turns);
	CHECK_VECTOR(batch.new_position, k, b, NEW_POSITION, dim);
	CHECK_VECTOR(batch.new_velocity, k, b, NEW_SPEED, dim);
	CHECK_VECTOR(batch.new_spin, k, b, NEW_SPIN, turns);
	CHECK_VECTOR(batch.mean_velocity, k, b, MEAN_SPEED, dim);
	CHECK_VECTOR(batch.mean_spin, k, b, MEAN_SPIN, turns);
	quern_check_columns(k, b, k->use, use);
	(k->hook == QUERN_INTEGRATOR_OPEN ? ops->open : ops->close)[dim - 2](k->instance->self, &batch);
}

static void create(const check *c, const check_instance *it, uint32_t variant, uint32_t n, check_kernel *k) {
	const uint32_t dim = it->dim, turns = check_axial(dim);
	const bool open = variant & OPENS, spin = variant & WITH_SPIN;
	quern_check_kernel_init(k, c, it, open ? "open" : "close", n);
	k->call = call;
	k->dt = 1e-4;
	if (!open) quern_check_add(k, FORCE, "force", CHECK_IN, dim);
	if (!open && spin) quern_check_add(k, TORQUE, "torque", CHECK_IN, turns);
	if (!open) quern_check_add(k, MASS, "mass", CHECK_IN, 1);
	if (!open) quern_check_add(k, INERTIA, "inertia", CHECK_IN, 1);
	quern_check_add(k, POSITION, "position", CHECK_IN, dim);
	quern_check_add(k, SPEED, "velocity", CHECK_IN, dim);
	quern_check_add(k, NEW_POSITION, "new_position", CHECK_OUT, dim);
	quern_check_add(k, NEW_SPEED, "new_velocity", CHECK_OUT, dim);
	if (spin) quern_check_add(k, SPIN, "spin", CHECK_IN, turns);
	if (spin) quern_check_add(k, NEW_SPIN, "new_spin", CHECK_OUT, turns);
	if (!open && variant & WITH_MEAN) quern_check_add(k, MEAN_SPEED, "mean_velocity", CHECK_OUT, dim);
	if (!open && spin && variant & WITH_MEAN) quern_check_add(k, MEAN_SPIN, "mean_spin", CHECK_OUT, turns);
	quern_check_add_uses(k, open ? QUERN_INTEGRATOR_OPEN : QUERN_INTEGRATOR_CLOSE, spin, false);
	for (uint32_t i = 0; i < n && !open; i++) {
		quern_check_given(k, MASS, 0)[i] = quern_check_uniform(120, i, 0.5, 2);
		quern_check_given(k, INERTIA, 0)[i] = quern_check_uniform(121, i, 0.1, 1);
	}
	quern_check_fill(k, POSITION, dim, 122, -1, 1);
	quern_check_fill(k, SPEED, dim, 123, -1, 1);
	if (spin) quern_check_fill(k, SPIN, turns, 124, -10, 10);
}

static bool make(const check *c, const check_instance *it, uint32_t variant, uint32_t n, check_kernel *k) {
	const quern_integrator_ops *ops = c->ops;
	if (variant >= VARIANTS || (variant & OPENS && !ops->open[it->dim - 2])) return false;
	create(c, it, variant, n, k);
	k->more = gravity;
	if (variant & OPENS) return true;
	quern_check_fill(k, FORCE, k->dim, 125, -1, 1);
	if (variant & WITH_SPIN) quern_check_fill(k, TORQUE, check_axial(k->dim), 126, -1, 1);
	return true;
}

/* ---- flights: open, forces, close, as the grains' solver does it ---- */

typedef struct {
	check_kernel open, close;
	bool opens;
} flight;

static void copy_state(const check_kernel *from, check_kernel *to) {
	static const int old[] = { POSITION, SPEED, SPIN }, now[] = { NEW_POSITION, NEW_SPEED, NEW_SPIN };
	for (int s = 0; s < 3; s++)
		for (uint32_t a = 0; from->at[old[s]] >= 0 && a < (s == 2 ? check_axial(from->dim) : from->dim); a++)
			memcpy(quern_check_given(to, old[s], a), quern_check_found(from, now[s], a),
				from->n * sizeof(quern_real));
}

static void begin_flight(const check *c, const check_instance *it, uint32_t n, flight *f) {
	f->opens = ((const quern_integrator_ops *)c->ops)->open[it->dim - 2] != NULL;
	create(c, it, WITH_SPIN, n, &f->close);
	if (f->opens) create(c, it, WITH_SPIN | OPENS, n, &f->open);
}

static void before_forces(flight *f) {
	if (!f->opens) return;
	quern_check_carry(&f->close, &f->open);
	quern_check_run(&f->open, 128, NULL);
	copy_state(&f->open, &f->close);
}

static void after_forces(flight *f) {
	quern_check_run(&f->close, 128, NULL);
	quern_check_advance(&f->close);
	copy_state(&f->close, &f->close);
	if (f->opens) copy_state(&f->close, &f->open);
}

static void end_flight(flight *f) {
	quern_check_kernel_finish(&f->close);
	if (f->opens) quern_check_kernel_finish(&f->open);
}

/* History of a step that has not been is as new. */
static void first_history(flight *f) {
	for (uint32_t c = 0; c < f->close.n_columns; c++) {
		check_column *column = &f->close.column[c];
		if (column->found) memcpy(column->found, column->given, f->close.n * sizeof(quern_real));
	}
}

enum { BODIES = 64, STEPS = 200 };

static bool damps(const check *c) { return ((const quern_integrator_ops *)c->ops)->damps != 0; }

/* What damps may be slower than Newton's law, never faster, and goes where the force points: from rest. */
static void damped(const check *c, const check_instance *it, double force, check_tally *t) {
	flight *f = malloc(sizeof *f);
	if (!f) abort();
	begin_flight(c, it, BODIES, f);
	check_kernel *k = &f->close;
	for (uint32_t a = 0; a < k->dim; a++)
		for (uint32_t i = 0; i < BODIES; i++)
			quern_check_given(k, FORCE, a)[i] = force * (a + 1), quern_check_given(k, SPEED, a)[i] = 0;
	first_history(f);
	for (int step = 0; step < STEPS; step++) before_forces(f), after_forces(f);
	for (uint32_t a = 0; a < k->dim; a++)
		for (uint32_t i = 0; i < BODIES; i++) {
			const double v = quern_check_given(k, SPEED, a)[i];
			const double most = force * (a + 1) / quern_check_given(k, MASS, 0)[i] * STEPS * k->dt;
			const double off = v > most ? v - most : v < 0 || (force > 0 && v == 0) ? 1 + fabs(v) : 0;
			quern_check_measure(t, off, 1e-12 * most,
				"%u-D: from rest, a force of %.3g N gives %.15g m/s, at most %.15g", k->dim, force, v, most);
		}
	end_flight(f);
	free(f);
}

static void constant(const check *c, const check_instance *it, double force, check_tally *t) {
	flight *f = malloc(sizeof *f);
	if (!f) abort();
	begin_flight(c, it, BODIES, f);
	check_kernel *k = &f->close;
	quern_real *start = malloc(3 * 3 * BODIES * sizeof *start);
	if (!start) abort();
	for (uint32_t a = 0; a < k->dim; a++)
		for (uint32_t i = 0; i < BODIES; i++) {
			quern_check_given(k, FORCE, a)[i] = force * (a + 1);
			start[a * BODIES + i] = quern_check_given(k, POSITION, a)[i];
			start[(3 + a) * BODIES + i] = quern_check_given(k, SPEED, a)[i];
		}
	for (uint32_t a = 0; a < check_axial(k->dim); a++)
		for (uint32_t i = 0; i < BODIES; i++) {
			quern_check_given(k, TORQUE, a)[i] = force;
			start[(6 + a) * BODIES + i] = quern_check_given(k, SPIN, a)[i];
		}
	first_history(f);
	for (int step = 0; step < STEPS; step++) before_forces(f), after_forces(f);
	const double time = STEPS * k->dt;
	for (uint32_t i = 0; i < BODIES; i++) {
		const double m = quern_check_given(k, MASS, 0)[i], inertia = quern_check_given(k, INERTIA, 0)[i];
		for (uint32_t a = 0; a < k->dim; a++) {
			const double kick = force * (a + 1) / m, v = start[(3 + a) * BODIES + i] + kick * time;
			const double x =
				start[a * BODIES + i] + start[(3 + a) * BODIES + i] * time + 0.5 * kick * time * time;
			quern_check_measure(t, fabs(quern_check_given(k, SPEED, a)[i] - v), 1e-12 * (1 + fabs(v)),
				"%u-D: a force of %.3g N gives %.15g m/s, should give %.15g", k->dim, force,
				quern_check_given(k, SPEED, a)[i], v);
			quern_check_measure(t, fabs(quern_check_given(k, POSITION, a)[i] - x),
				1e-12 + fabs(kick) * time * k->dt,
				"%u-D: a force of %.3g N leads to %.15g m, should lead to %.15g", k->dim, force,
				quern_check_given(k, POSITION, a)[i], x);
		}
		for (uint32_t a = 0; a < check_axial(k->dim); a++) {
			const double w = start[(6 + a) * BODIES + i] + force / inertia * time;
			quern_check_measure(t, fabs(quern_check_given(k, SPIN, a)[i] - w), 1e-12 * (1 + fabs(w)),
				"%u-D: a torque of %.3g N m gives %.15g rad/s, should give %.15g", k->dim, force,
				quern_check_given(k, SPIN, a)[i], w);
		}
	}
	free(start);
	end_flight(f);
	free(f);
}

/* Ten periods on a spring, 100 steps each. */
static void spring(const check *c, const check_instance *it, check_tally *t) {
	flight *f = malloc(sizeof *f);
	double before = 0, after = 0;
	if (!f) abort();
	begin_flight(c, it, 1, f);
	check_kernel *k = &f->close;
	const double m = quern_check_given(k, MASS, 0)[0],
				 stiffness = m * pow(2 * 3.141592653589793 / (100 * k->dt), 2);
	for (uint32_t a = 0; a < k->dim; a++)
		before += 0.5 * m * pow(quern_check_given(k, SPEED, a)[0], 2) +
				  0.5 * stiffness * pow(quern_check_given(k, POSITION, a)[0], 2);
	first_history(f);
	for (int step = 0; step < 1000; step++) {
		before_forces(f);
		for (uint32_t a = 0; a < k->dim; a++)
			quern_check_given(k, FORCE, a)[0] = -stiffness * quern_check_given(k, POSITION, a)[0];
		after_forces(f);
	}
	for (uint32_t a = 0; a < k->dim; a++)
		after += 0.5 * m * pow(quern_check_given(k, SPEED, a)[0], 2) +
				 0.5 * stiffness * pow(quern_check_given(k, POSITION, a)[0], 2);
	const double gained = after / before - 1;
	quern_check_measure(t, damps(c) ? fmax(gained, 0) : fabs(gained), damps(c) ? 0 : 0.1,
		"%u-D: ten periods of a spring turn %.6g J into %.6g", k->dim, before, after);
	end_flight(f);
	free(f);
}

static void law(const check *c) {
	check_tally drift = { .name = "no force" }, push = { .name = "constant force" },
				ring = { .name = "a spring" };
	for (uint32_t dim = 2; dim <= 3; dim++) {
		check_instance it;
		if (!check_has_dim(c, dim)) continue;
		if (quern_check_instance_create(c, dim, 0, &it) == CHECK_READY) {
			(damps(c) ? damped : constant)(c, &it, 0, &drift);
			(damps(c) ? damped : constant)(c, &it, 3, &push);
			spring(c, &it, &ring);
		}
		quern_check_instance_finish(c, &it);
	}
	quern_check_tell(c, &drift, NULL);
	quern_check_tell(c, &push, NULL);
	quern_check_tell(c, &ring, NULL);
}

const check_kind quern_check_integrator = { .kind = &quern_integrator_kind, .make = make, .law = law };
