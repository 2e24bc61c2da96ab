/* SPDX-License-Identifier: MIT */
/* check.integrator - steps in time: free flight is exact, a constant force gives its momentum, a spring keeps its
 * energy */
#include <math.h>
#include <quern/check.h>
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
enum { WITH_SPIN = 1, WITH_MEAN = 2, OPENS = 4, BETWEEN = 8, VARIANTS = 10 }; /* BETWEEN: `predict` */
static const double gravity[3] = { 0, -9.81, 0 };

static void call(const quern_check_kernel *k, const quern_check_batch *b) {
	const quern_integrator_ops *ops = k->ops;
	quern_column use[QUERN_MOST_USES];
	const uint32_t dim = k->dim, turns = quern_check_axial(dim);
	quern_integrator_batch batch = { .n = b->n, .cap = b->cap, .dt = k->dt, .use = use };
	for (uint32_t a = 0; a < dim; a++) batch.gravity[a] = k->more ? ((const double *)k->more)[a] : 0;
	QUERN_CHECK_VECTOR(batch.force, k, b, FORCE, dim);
	QUERN_CHECK_VECTOR(batch.torque, k, b, TORQUE, turns);
	batch.mass = quern_check_at(k, b, MASS, 0);
	batch.inertia = quern_check_at(k, b, INERTIA, 0);
	QUERN_CHECK_VECTOR(batch.position, k, b, POSITION, dim);
	QUERN_CHECK_VECTOR(batch.velocity, k, b, SPEED, dim);
	QUERN_CHECK_VECTOR(batch.spin, k, b, SPIN, turns);
	QUERN_CHECK_VECTOR(batch.new_position, k, b, NEW_POSITION, dim);
	QUERN_CHECK_VECTOR(batch.new_velocity, k, b, NEW_SPEED, dim);
	QUERN_CHECK_VECTOR(batch.new_spin, k, b, NEW_SPIN, turns);
	QUERN_CHECK_VECTOR(batch.mean_velocity, k, b, MEAN_SPEED, dim);
	QUERN_CHECK_VECTOR(batch.mean_spin, k, b, MEAN_SPIN, turns);
	k->host->columns(k, b, k->use, use);
	if (k->pass == BETWEEN) ops->predict[dim - 2](k->self, &batch);
	else (k->hook == QUERN_INTEGRATOR_OPEN ? ops->open : ops->close)[dim - 2](k->self, &batch);
}

/* The velocities that dashpots act on. */
static quern_check_kernel *create_between(
	const quern_check *c, const quern_check_instance *it, bool spin, uint32_t n) {
	const uint32_t dim = it->dim, turns = quern_check_axial(dim);
	quern_check_kernel *k = c->host->kernel_create(c, it, "predict", n);
	k->call = call;
	k->pass = BETWEEN;
	k->dt = 1e-4;
	c->host->add(k, POSITION, "position", QUERN_CHECK_IN, dim);
	c->host->add(k, SPEED, "velocity", QUERN_CHECK_IN, dim);
	c->host->add(k, NEW_SPEED, "new_velocity", QUERN_CHECK_OUT, dim);
	if (spin) c->host->add(k, SPIN, "spin", QUERN_CHECK_IN, turns);
	if (spin) c->host->add(k, NEW_SPIN, "new_spin", QUERN_CHECK_OUT, turns);
	c->host->add_uses(k, QUERN_INTEGRATOR_OPEN, spin);
	c->host->fill(k, POSITION, dim, 122, -1, 1);
	c->host->fill(k, SPEED, dim, 123, -1, 1);
	if (spin) c->host->fill(k, SPIN, turns, 124, -10, 10);
	return k;
}

static quern_check_kernel *create(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	const uint32_t dim = it->dim, turns = quern_check_axial(dim);
	const bool open = variant & OPENS, spin = variant & WITH_SPIN;
	quern_check_kernel *k = c->host->kernel_create(c, it, open ? "open" : "close", n);
	k->call = call;
	k->dt = 1e-4;
	if (!open) c->host->add(k, FORCE, "force", QUERN_CHECK_IN, dim);
	if (!open && spin) c->host->add(k, TORQUE, "torque", QUERN_CHECK_IN, turns);
	if (!open) c->host->add(k, MASS, "mass", QUERN_CHECK_IN, 1);
	if (!open) c->host->add(k, INERTIA, "inertia", QUERN_CHECK_IN, 1);
	c->host->add(k, POSITION, "position", QUERN_CHECK_IN, dim);
	c->host->add(k, SPEED, "velocity", QUERN_CHECK_IN, dim);
	c->host->add(k, NEW_POSITION, "new_position", QUERN_CHECK_OUT, dim);
	c->host->add(k, NEW_SPEED, "new_velocity", QUERN_CHECK_OUT, dim);
	if (spin) c->host->add(k, SPIN, "spin", QUERN_CHECK_IN, turns);
	if (spin) c->host->add(k, NEW_SPIN, "new_spin", QUERN_CHECK_OUT, turns);
	if (!open && variant & WITH_MEAN) c->host->add(k, MEAN_SPEED, "mean_velocity", QUERN_CHECK_OUT, dim);
	if (!open && spin && variant & WITH_MEAN) c->host->add(k, MEAN_SPIN, "mean_spin", QUERN_CHECK_OUT, turns);
	c->host->add_uses(k, open ? QUERN_INTEGRATOR_OPEN : QUERN_INTEGRATOR_CLOSE, spin);
	for (uint32_t i = 0; i < n && !open; i++) {
		quern_check_given(k, MASS, 0)[i] = c->host->uniform(120, i, 0.5, 2);
		quern_check_given(k, INERTIA, 0)[i] = c->host->uniform(121, i, 0.1, 1);
	}
	c->host->fill(k, POSITION, dim, 122, -1, 1);
	c->host->fill(k, SPEED, dim, 123, -1, 1);
	if (spin) c->host->fill(k, SPIN, turns, 124, -10, 10);
	return k;
}

static quern_check_kernel *make(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	const quern_integrator_ops *ops = c->ops;
	if (variant >= VARIANTS || (variant & OPENS && !ops->open[it->dim - 2])) return NULL;
	if (variant & BETWEEN)
		return ops->predict[it->dim - 2] ? create_between(c, it, variant & WITH_SPIN, n) : NULL;
	quern_check_kernel *k = create(c, it, variant, n);
	k->more = gravity;
	if (variant & OPENS) return k;
	c->host->fill(k, FORCE, k->dim, 125, -1, 1);
	if (variant & WITH_SPIN) c->host->fill(k, TORQUE, quern_check_axial(k->dim), 126, -1, 1);
	return k;
}

/* ---- flights: open, forces, close, as the grains' solver does it ---- */

typedef struct {
	quern_check_kernel *open, *close; /* open: NULL if the integrator has none */
	quern_check_tally *way;
} flight;

static void copy_state(const quern_check_kernel *from, quern_check_kernel *to) {
	static const int old[] = { POSITION, SPEED, SPIN }, now[] = { NEW_POSITION, NEW_SPEED, NEW_SPIN };
	for (int s = 0; s < 3; s++)
		for (uint32_t a = 0; from->at[old[s]] >= 0 && a < (s == 2 ? quern_check_axial(from->dim) : from->dim);
			 a++)
			memcpy(quern_check_given(to, old[s], a), quern_check_found(from, now[s], a),
				from->n * sizeof(quern_real));
}

static void begin_flight(
	const quern_check *c, const quern_check_instance *it, uint32_t n, quern_check_tally *way, flight *f) {
	const bool opens = ((const quern_integrator_ops *)c->ops)->open[it->dim - 2] != NULL;
	f->way = way;
	f->close = create(c, it, WITH_SPIN, n);
	f->open = opens ? create(c, it, WITH_SPIN | OPENS, n) : NULL;
}

/* Springs are stretched by dt times the velocity that `open` leaves: it has moved the grains by that. What coasts leaves it as it was. */
static void compare_way(flight *f) {
	const quern_check_kernel *k = f->open;
	const quern_integrator_ops *ops = k->ops;
	const quern_real at = ops->at > 0 ? ops->at : 1;
	for (uint32_t a = 0; a < k->dim; a++)
		for (uint32_t i = 0; i < k->n; i++) {
			const double from = quern_check_given(k, POSITION, a)[i],
						 to = quern_check_found(k, NEW_POSITION, a)[i];
			const double left = quern_check_found(k, NEW_SPEED, a)[i];
			k->host->measure(f->way, fabs(to - from - at * k->dt * left), 1e-15 * (1 + fabs(from) + fabs(to)),
				"%u-D: open moves by %.15g m and leaves %.15g m/s", k->dim, to - from, left);
			if (!ops->coasts) continue;
			const double was = quern_check_given(k, SPEED, a)[i];
			k->host->measure(f->way, fabs(left - was), 0,
				"%u-D: open turns %.15g m/s into %.15g, and should coast", k->dim, was, left);
		}
	for (uint32_t a = 0; a < quern_check_axial(k->dim) && ops->coasts; a++)
		for (uint32_t i = 0; i < k->n; i++)
			k->host->measure(f->way,
				fabs(quern_check_found(k, NEW_SPIN, a)[i] - quern_check_given(k, SPIN, a)[i]), 0,
				"%u-D: open changes spins, and should coast", k->dim);
}

static void before_forces(flight *f) {
	if (!f->open) return;
	f->open->host->carry(f->close, f->open);
	f->open->host->run(f->open, 128, false);
	compare_way(f);
	copy_state(f->open, f->close);
}

static void after_forces(flight *f) {
	f->close->host->run(f->close, 128, false);
	f->close->host->advance(f->close);
	copy_state(f->close, f->close);
	if (f->open) copy_state(f->close, f->open);
}

static void end_flight(flight *f) {
	f->close->host->kernel_destroy(f->open);
	f->close->host->kernel_destroy(f->close);
}

/* History of a step that has not been is as new. */
static void first_history(flight *f) {
	for (uint32_t c = 0; c < f->close->n_columns; c++) {
		const quern_check_column *column = f->close->host->column(f->close, (int32_t)c);
		if (column->found) memcpy(column->found, column->given, f->close->n * sizeof(quern_real));
	}
}

enum { BODIES = 64, STEPS = 200 };

static bool damps(const quern_check *c) { return ((const quern_integrator_ops *)c->ops)->damps != 0; }

/* What damps may be slower than Newton's law, never faster, and goes where the force points: from rest. */
static void damped(const quern_check *c, const quern_check_instance *it, double force, quern_check_tally *t,
	quern_check_tally *way) {
	flight f;
	begin_flight(c, it, BODIES, way, &f);
	const quern_check_kernel *k = f.close;
	for (uint32_t a = 0; a < k->dim; a++)
		for (uint32_t i = 0; i < BODIES; i++)
			quern_check_given(k, FORCE, a)[i] = force * (a + 1), quern_check_given(k, SPEED, a)[i] = 0;
	first_history(&f);
	for (int step = 0; step < STEPS; step++) before_forces(&f), after_forces(&f);
	for (uint32_t a = 0; a < k->dim; a++)
		for (uint32_t i = 0; i < BODIES; i++) {
			const double v = quern_check_given(k, SPEED, a)[i];
			const double most = force * (a + 1) / quern_check_given(k, MASS, 0)[i] * STEPS * k->dt;
			const double off = v > most ? v - most : v < 0 || (force > 0 && v == 0) ? 1 + fabs(v) : 0;
			c->host->measure(t, off, 1e-12 * most,
				"%u-D: from rest, a force of %.3g N gives %.15g m/s, at most %.15g", k->dim, force, v, most);
		}
	end_flight(&f);
}

static void constant(const quern_check *c, const quern_check_instance *it, double force, quern_check_tally *t,
	quern_check_tally *way) {
	flight f;
	begin_flight(c, it, BODIES, way, &f);
	const quern_check_kernel *k = f.close;
	quern_real *start = c->host->memory(3 * 3 * BODIES, sizeof *start);
	for (uint32_t a = 0; a < k->dim; a++)
		for (uint32_t i = 0; i < BODIES; i++) {
			quern_check_given(k, FORCE, a)[i] = force * (a + 1);
			start[a * BODIES + i] = quern_check_given(k, POSITION, a)[i];
			start[(3 + a) * BODIES + i] = quern_check_given(k, SPEED, a)[i];
		}
	for (uint32_t a = 0; a < quern_check_axial(k->dim); a++)
		for (uint32_t i = 0; i < BODIES; i++) {
			quern_check_given(k, TORQUE, a)[i] = force;
			start[(6 + a) * BODIES + i] = quern_check_given(k, SPIN, a)[i];
		}
	first_history(&f);
	for (int step = 0; step < STEPS; step++) before_forces(&f), after_forces(&f);
	const double time = STEPS * k->dt;
	for (uint32_t i = 0; i < BODIES; i++) {
		const double m = quern_check_given(k, MASS, 0)[i], inertia = quern_check_given(k, INERTIA, 0)[i];
		for (uint32_t a = 0; a < k->dim; a++) {
			const double kick = force * (a + 1) / m, v = start[(3 + a) * BODIES + i] + kick * time;
			const double x =
				start[a * BODIES + i] + start[(3 + a) * BODIES + i] * time + 0.5 * kick * time * time;
			c->host->measure(t, fabs(quern_check_given(k, SPEED, a)[i] - v), 1e-12 * (1 + fabs(v)),
				"%u-D: a force of %.3g N gives %.15g m/s, should give %.15g", k->dim, force,
				quern_check_given(k, SPEED, a)[i], v);
			c->host->measure(t, fabs(quern_check_given(k, POSITION, a)[i] - x),
				1e-12 + fabs(kick) * time * k->dt,
				"%u-D: a force of %.3g N leads to %.15g m, should lead to %.15g", k->dim, force,
				quern_check_given(k, POSITION, a)[i], x);
		}
		for (uint32_t a = 0; a < quern_check_axial(k->dim); a++) {
			const double w = start[(6 + a) * BODIES + i] + force / inertia * time;
			c->host->measure(t, fabs(quern_check_given(k, SPIN, a)[i] - w), 1e-12 * (1 + fabs(w)),
				"%u-D: a torque of %.3g N m gives %.15g rad/s, should give %.15g", k->dim, force,
				quern_check_given(k, SPIN, a)[i], w);
		}
	}
	free(start);
	end_flight(&f);
}

/* Ten periods on a spring, 100 steps each. */
static void spring(
	const quern_check *c, const quern_check_instance *it, quern_check_tally *t, quern_check_tally *way) {
	flight f;
	double before = 0, after = 0;
	begin_flight(c, it, 1, way, &f);
	const quern_check_kernel *k = f.close;
	const double m = quern_check_given(k, MASS, 0)[0],
				 stiffness = m * pow(2 * 3.141592653589793 / (100 * k->dt), 2);
	for (uint32_t a = 0; a < k->dim; a++)
		before += 0.5 * m * pow(quern_check_given(k, SPEED, a)[0], 2) +
				  0.5 * stiffness * pow(quern_check_given(k, POSITION, a)[0], 2);
	first_history(&f);
	for (int step = 0; step < 1000; step++) {
		before_forces(&f);
		for (uint32_t a = 0; a < k->dim; a++)
			quern_check_given(k, FORCE, a)[0] = -stiffness * quern_check_given(k, POSITION, a)[0];
		after_forces(&f);
	}
	for (uint32_t a = 0; a < k->dim; a++)
		after += 0.5 * m * pow(quern_check_given(k, SPEED, a)[0], 2) +
				 0.5 * stiffness * pow(quern_check_given(k, POSITION, a)[0], 2);
	const double gained = after / before - 1;
	c->host->measure(t, damps(c) ? fmax(gained, 0) : fabs(gained), damps(c) ? 0 : 0.1,
		"%u-D: ten periods of a spring turn %.6g J into %.6g", k->dim, before, after);
	end_flight(&f);
}

static void law(const quern_check *c) {
	quern_check_tally drift = { .name = "no force" }, push = { .name = "constant force" },
					  ring = { .name = "a spring" }, way = { .name = "moved by the velocity" },
					  late = { .name = "late by" };
	const quern_integrator_ops *ops = c->ops;
	const bool sound =
		ops->lag >= 0 && ops->lag <= 1 && (!(ops->lag > 0) || ops->predict[0] || ops->predict[1]);
	c->host->measure(&late, sound ? 0 : 1, 0, "lag is %.6g, of 0 to 1, and of `predict` alone", ops->lag);
	for (uint32_t dim = 2; dim <= 3; dim++) {
		quern_check_instance *it = c->host->instance_create(c, dim, 0);
		if (it) {
			(damps(c) ? damped : constant)(c, it, 0, &drift, &way);
			(damps(c) ? damped : constant)(c, it, 3, &push, &way);
			spring(c, it, &ring, &way);
		}
		c->host->instance_destroy(it);
	}
	c->host->tell(c, &drift, NULL);
	c->host->tell(c, &push, NULL);
	c->host->tell(c, &ring, NULL);
	c->host->tell(c, &late, NULL);
	if (way.tried) c->host->tell(c, &way, NULL);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = {
	.size = sizeof ops, .kind = &quern_integrator_kind, .make = make, .law = law
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.integrator",
	.brief = "Steps in time: free flight, constant forces, a spring.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
