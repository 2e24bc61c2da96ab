/* SPDX-License-Identifier: MIT */
/* check.contact - laws between two grains: action and reaction, silence when apart, no energy out of nothing */
#include "check_impact.h"
#include <math.h>
#include <quern/check.h>
#include <quern/contact.h>
#include <stdlib.h>
#include <string.h>

enum { LOSSES_ONLY = 1 }; /* a pass */

static void call(const quern_check_kernel *k, const quern_check_batch *b) {
	const quern_contact_ops *ops = k->ops;
	const uint32_t dim = k->dim, turns = quern_check_axial(dim);
	quern_column use[QUERN_MOST_USES], use_second[QUERN_MOST_USES];
	quern_contact_batch batch = {
		.n = b->n, .cap = b->cap, .dt = k->dt, .use = use, .use_second = use_second
	};
	batch.overlap = quern_check_at(k, b, OVERLAP, 0);
	batch.radius = quern_check_at(k, b, RADIUS, 0);
	batch.mass = quern_check_at(k, b, MASS, 0);
	QUERN_CHECK_VECTOR(batch.normal, k, b, NORMAL, dim);
	QUERN_CHECK_VECTOR(batch.velocity, k, b, VELOCITY, dim);
	QUERN_CHECK_VECTOR(batch.spin, k, b, SPIN, turns);
	QUERN_CHECK_VECTOR(batch.turn, k, b, TURN, dim == 3 ? 3u : 0u);
	QUERN_CHECK_VECTOR(batch.mean_velocity, k, b, MEAN_VELOCITY, dim);
	QUERN_CHECK_VECTOR(batch.mean_spin, k, b, MEAN_SPIN, turns);
	QUERN_CHECK_VECTOR(batch.force, k, b, FORCE, dim);
	QUERN_CHECK_VECTOR(batch.couple, k, b, COUPLE, turns);
	QUERN_CHECK_VECTOR(batch.dashpot, k, b, DASHPOT, dim);
	batch.stored = quern_check_at(k, b, STORED, 0);
	batch.sheared = quern_check_at(k, b, SHEARED, 0);
	batch.rubbed = quern_check_at(k, b, RUBBED, 0);
	batch.losses_only = k->pass == LOSSES_ONLY;
	QUERN_CHECK_VECTOR(batch.drag_couple, k, b, DRAG_COUPLE, turns);
	k->host->columns(k, b, k->use, use);
	k->host->columns(k, b, k->use_second, use_second);
	ops->force[dim - 2](k->self, &batch);
}

static bool uses_field(const quern_check *c, const quern_check_instance *it, const char *field) {
	for (const quern_use *row = c->uses; row->field; row++)
		if (!strcmp(row->field, field) && c->host->counts(c, it, row)) return true;
	return false;
}

static quern_real step_of(const quern_check_kernel *k) {
	const quern_contact_ops *ops = k->ops;
	const quern_real period = ops->period ? ops->period(k->self, k->dim, quern_check_given(k, MASS, 0)[0],
												quern_check_given(k, RADIUS, 0)[0])
										  : 0;
	return period > 0 && isfinite(period) ? period / 50 : 1e-6;
}

/* Pairs of discs or spheres of 0.5 to 1.5 mm; every fifth is open. */
static void fill_pairs(const quern_check_kernel *k, uint64_t key) {
	for (uint32_t i = 0; i < k->n; i++) {
		double m[2], r[2], n[3];
		for (uint32_t s = 0; s < 2; s++) {
			r[s] = k->host->uniform(key, 2 * i + s, 0.5e-3, 1.5e-3);
			m[s] = 2500 * 3.141592653589793 * r[s] * r[s] * (k->dim == 3 ? 4.0 / 3 * r[s] : 1);
		}
		quern_check_given(k, RADIUS, 0)[i] = r[0] * r[1] / (r[0] + r[1]);
		quern_check_given(k, MASS, 0)[i] = m[0] * m[1] / (m[0] + m[1]);
		quern_check_given(k, OVERLAP, 0)[i] = (i % 5 ? 1 : -1) * k->host->uniform(key + 1, i, 0, 0.01) * r[0];
		k->host->direction(k->dim, key + 2, i, n);
		for (uint32_t c = 0; c < k->dim; c++) quern_check_given(k, NORMAL, c)[i] = n[c];
	}
	k->host->fill(k, VELOCITY, k->dim, key + 3, -0.1, 0.1);
	if (k->at[MEAN_VELOCITY] >= 0) k->host->fill(k, MEAN_VELOCITY, k->dim, key + 4, -0.1, 0.1);
}

static quern_real *row_given(const quern_check_kernel *k, int32_t first, uint32_t component) {
	return k->host->column(k, first + (int32_t)component)->given;
}

/* Relative and mean spin, from each body's where the law reads it. */
static void fill_spins(const quern_check_kernel *k, uint64_t key) {
	const uint32_t turns = quern_check_axial(k->dim);
	const quern_use *rows = k->check->uses;
	for (uint32_t c = 0; c < turns; c++)
		for (uint32_t i = 0; i < k->n; i++) {
			double first = k->host->uniform(key, c * 65536 + i, -20, 20),
				   second = k->host->uniform(key + 1, c * 65536 + i, -20, 20);
			for (uint32_t r = 0; rows[r].field && r < QUERN_MOST_USES; r++) {
				if (k->use[r] < 0 || k->use_second[r] < 0 || strcmp(rows[r].field, "grain.spin") != 0)
					continue;
				row_given(k, k->use[r], c)[i] = first;
				row_given(k, k->use_second[r], c)[i] = second;
			}
			quern_check_given(k, SPIN, c)[i] = first - second;
			if (k->at[MEAN_SPIN] >= 0) quern_check_given(k, MEAN_SPIN, c)[i] = 0.9 * (first - second);
			if (k->dim == 3) quern_check_given(k, TURN, c)[i] = 0.5 * (first + second);
		}
}

enum { WITH_SPIN = 1, WITH_ENERGY = 2, VARIANTS = 4 };

/* Fields of grains stand on both sides, histories of the pair once, and the couple comes with the batch, beside the
 * force. */
static void add_uses(quern_check_kernel *k, bool optional) {
	const quern_use *rows = k->check->uses;
	for (uint32_t r = 0; rows[r].field && r < QUERN_MOST_USES; r++) {
		const bool hangs = rows[r].with || rows[r].flags & (QUERN_OPTIONAL | QUERN_WANTED);
		if (!strcmp(rows[r].field, "contact.couple") || (hangs && !optional)) continue;
		k->host->add_use(k, r, false);
		if (strncmp(rows[r].field, "contact.", 8) != 0) k->host->add_use(k, r, true);
	}
}

static quern_check_kernel *create(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, const char *name, uint32_t n) {
	quern_check_kernel *k = c->host->kernel_create(c, it, name, n);
	k->call = call;
	const uint32_t dim = it->dim, turns = quern_check_axial(dim);
	c->host->add(k, OVERLAP, "overlap", QUERN_CHECK_IN, 1);
	c->host->add(k, NORMAL, "normal", QUERN_CHECK_IN, dim);
	c->host->add(k, VELOCITY, "velocity", QUERN_CHECK_IN, dim);
	c->host->add(k, RADIUS, "radius", QUERN_CHECK_IN, 1);
	c->host->add(k, MASS, "mass", QUERN_CHECK_IN, 1);
	c->host->add(k, FORCE, "force", QUERN_CHECK_CHANGED, dim);
	const bool means = ((const quern_contact_ops *)c->ops)->means;
	if (means) c->host->add(k, MEAN_VELOCITY, "mean_velocity", QUERN_CHECK_IN, dim);
	add_uses(k, variant & WITH_SPIN);
	if (variant & WITH_SPIN || uses_field(c, it, "grain.spin")) {
		c->host->add(k, SPIN, "spin", QUERN_CHECK_IN, turns);
		if (dim == 3) c->host->add(k, TURN, "turn", QUERN_CHECK_IN, 3);
		if (means) c->host->add(k, MEAN_SPIN, "mean_spin", QUERN_CHECK_IN, turns);
		fill_spins(k, 40);
	}
	if (uses_field(c, it, "contact.couple")) c->host->add(k, COUPLE, "couple", QUERN_CHECK_CHANGED, turns);
	if (!(variant & WITH_ENERGY)) return k;
	if (k->at[COUPLE] >= 0) c->host->add(k, DRAG_COUPLE, "drag_couple", QUERN_CHECK_CHANGED, turns);
	c->host->add(k, DASHPOT, "dashpot", QUERN_CHECK_CHANGED, dim);
	c->host->add(k, STORED, "stored", QUERN_CHECK_CHANGED, 1);
	c->host->add(k, SHEARED, "sheared", QUERN_CHECK_CHANGED, 1);
	c->host->add(k, RUBBED, "rubbed", QUERN_CHECK_CHANGED, 1);
	return k;
}

static uint32_t components_of(const quern_check_kernel *k, int name) {
	return name == FORCE || name == DASHPOT        ? k->dim
		   : name == COUPLE || name == DRAG_COUPLE ? quern_check_axial(k->dim)
												   : 1;
}

/* Forces and energies are added to; between steps they begin at zero again, while histories go on. */
static void clear_sums(const quern_check_kernel *k) {
	static const int sums[] = { FORCE, COUPLE, DASHPOT, STORED, SHEARED, RUBBED, DRAG_COUPLE };
	for (size_t s = 0; s < sizeof sums / sizeof *sums; s++)
		for (uint32_t c = 0; k->at[sums[s]] >= 0 && c < components_of(k, sums[s]); c++)
			memset(quern_check_given(k, sums[s], c), 0, k->n * sizeof(quern_real));
}

/* A law that is bounded by the force of those before it, or that does not push by itself, finds such a force: that of a spring along the
 * normal, without loss, whose half-period is 25 of the law's steps. */
static void lean(const quern_check_kernel *k) {
	const quern_contact_ops *ops = k->ops;
	const bool leans = ops->follows || !ops->stiffness;
	const double pace = 6.283185307179586 / (50 * step_of(k));
	const double stiffness = leans ? pace * pace * quern_check_given(k, MASS, 0)[0] : 0;
	for (uint32_t i = 0; i < k->n && leans; i++) {
		const double overlap = fmax(quern_check_given(k, OVERLAP, 0)[i], 0);
		for (uint32_t c = 0; c < k->dim; c++)
			quern_check_given(k, FORCE, c)[i] = stiffness * overlap * quern_check_given(k, NORMAL, c)[i];
		if (k->at[STORED] >= 0) quern_check_given(k, STORED, 0)[i] = 0.5 * stiffness * overlap * overlap;
	}
}

static void begin_step(const quern_check_kernel *k) {
	clear_sums(k);
	lean(k);
}

static void act(quern_check_kernel *k) {
	begin_step(k);
	k->host->run(k, 512, false);
}

static void next_step(quern_check_kernel *k) {
	act(k);
	k->host->advance(k);
}

static quern_check_kernel *make(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	if (variant >= VARIANTS) return NULL;
	quern_check_kernel *k = create(c, it, variant, "force", n);
	fill_pairs(k, 20);
	k->dt = step_of(k);
	for (int step = 0; step < 3; step++) next_step(k);
	begin_step(k);
	return k;
}

/* ---- what must hold ---- */

static double size_of(const quern_check_kernel *k, int name, uint32_t count, uint32_t i) {
	double sum = 0;
	for (uint32_t c = 0; k->at[name] >= 0 && c < count; c++) sum += pow(quern_check_found(k, name, c)[i], 2);
	return sqrt(sum);
}

static void negate(const quern_check_kernel *k, int name, uint32_t count) {
	for (uint32_t c = 0; k->at[name] >= 0 && c < count; c++)
		for (uint32_t i = 0; i < k->n; i++) quern_check_given(k, name, c)[i] *= -1;
}

/* The same pairs named the other way round. */
static void exchange(quern_check_kernel *k) {
	negate(k, NORMAL, k->dim);
	negate(k, VELOCITY, k->dim);
	negate(k, SPIN, quern_check_axial(k->dim));
	negate(k, MEAN_VELOCITY, k->dim);
	negate(k, MEAN_SPIN, quern_check_axial(k->dim));
	for (int r = 0; r < QUERN_MOST_USES; r++)
		if (k->use[r] >= 0 && k->use_second[r] >= 0) {
			const int32_t first = k->use[r];
			k->use[r] = k->use_second[r];
			k->use_second[r] = first;
		}
}

static void reaction(quern_check_kernel *k, quern_check_kernel *other, quern_check_tally *t) {
	exchange(other);
	for (int step = 0; step < 8; step++) {
		act(k), act(other);
		for (uint32_t i = 0; i < k->n; i++) {
			const double force = size_of(k, FORCE, k->dim, i) + 1e-30,
						 couple = size_of(k, COUPLE, quern_check_axial(k->dim), i) + 1e-30;
			for (uint32_t c = 0; c < k->dim; c++)
				k->host->measure(t,
					fabs(quern_check_found(k, FORCE, c)[i] + quern_check_found(other, FORCE, c)[i]) / force,
					1e-10,
					"%u-D: the force on the second body is not minus that on the first: %.9g and %.9g N",
					k->dim, quern_check_found(k, FORCE, c)[i], quern_check_found(other, FORCE, c)[i]);
			for (uint32_t c = 0; k->at[COUPLE] >= 0 && c < quern_check_axial(k->dim); c++)
				k->host->measure(t,
					fabs(quern_check_found(k, COUPLE, c)[i] + quern_check_found(other, COUPLE, c)[i]) /
						couple,
					1e-10, "%u-D: the couple on the second body is not minus that on the first", k->dim);
		}
		k->host->advance(k), k->host->advance(other);
	}
}

/* A law adds: what stood there stays. */
static void added_to(quern_check_kernel *k, int name, quern_check_tally *t) {
	act(k);
	quern_real *alone = k->host->memory(k->n, sizeof(quern_real));
	memcpy(alone, quern_check_found(k, name, 0), k->n * sizeof(quern_real));
	begin_step(k);
	for (uint32_t i = 0; i < k->n; i++) quern_check_given(k, name, 0)[i] += 3;
	k->host->run(k, 512, false);
	for (uint32_t i = 0; i < k->n; i++)
		k->host->measure(t, fabs(quern_check_found(k, name, 0)[i] - alone[i] - 3) / (fabs(alone[i]) + 3),
			1e-14, "%u-D: the %s is written over what another law has added", k->dim,
			k->host->column(k, k->at[name])->name);
	free(alone);
}

static void addition(quern_check_kernel *k, quern_check_tally *t) {
	added_to(k, FORCE, t);
	if (k->at[COUPLE] >= 0) added_to(k, COUPLE, t);
}

/* Without a force of the laws before it, such a law gives nothing. */
static void alone(quern_check_kernel *k, quern_check_tally *t) {
	const quern_contact_ops *ops = k->ops;
	if (!ops->follows) return;
	clear_sums(k);
	k->host->run(k, 512, false);
	for (uint32_t i = 0; i < k->n; i++) {
		const double force = size_of(k, FORCE, k->dim, i),
					 couple = size_of(k, COUPLE, quern_check_axial(k->dim), i);
		k->host->expect(t, force == 0 && couple == 0,
			"%u-D: a force of %.3g N, a couple of %.3g N m where no law before it gives a force", k->dim,
			force, couple);
	}
}

/* All pairs part in one step, with the velocities that this takes. */
static void part(quern_check_kernel *k) {
	const quern_contact_ops *ops = k->ops;
	for (uint32_t i = 0; i < k->n; i++) {
		const quern_real radius = quern_check_given(k, RADIUS, 0)[i];
		const quern_real reach = ops->reach ? ops->reach(k->self, radius) : 0;
		quern_real *overlap = &quern_check_given(k, OVERLAP, 0)[i];
		const quern_real to = -reach - (i % 3 ? 1e-3 * radius : 0), speed = (*overlap - to) / k->dt;
		for (uint32_t c = 0; c < k->dim; c++) {
			const quern_real v = speed * quern_check_given(k, NORMAL, c)[i];
			quern_check_given(k, VELOCITY, c)[i] = v;
			if (k->at[MEAN_VELOCITY] >= 0) quern_check_given(k, MEAN_VELOCITY, c)[i] = v;
		}
		*overlap = to;
	}
}

/* Where nobody asks for what springs hold, all else is the same. */
static void only_losses(quern_check_kernel *k, quern_check_tally *t) {
	static const int given[] = { FORCE, COUPLE, DASHPOT, DRAG_COUPLE, RUBBED };
	for (size_t g = 0; g < sizeof given / sizeof *given; g++)
		for (uint32_t c = 0; k->at[given[g]] >= 0 && c < components_of(k, given[g]); c++) {
			act(k);
			quern_real *all = k->host->memory(k->n, sizeof *all);
			memcpy(all, quern_check_found(k, given[g], c), k->n * sizeof *all);
			k->pass = LOSSES_ONLY;
			act(k);
			k->pass = 0;
			for (uint32_t i = 0; i < k->n; i++) {
				const quern_real is = quern_check_found(k, given[g], c)[i];
				k->host->expect(t, is == all[i],
					"%u-D: %s is %.17g where losses alone are asked for, else %.17g", k->dim,
					k->host->column(k, k->at[given[g]])->name, is, all[i]);
			}
			free(all);
		}
}

/* What springs held when a pair still touched is lost as it opens. */
static void opening(quern_check_kernel *k, quern_check_tally *t) {
	quern_real *held = k->host->memory(k->n, sizeof *held);
	act(k);
	memcpy(held, quern_check_found(k, SHEARED, 0), k->n * sizeof *held);
	k->host->advance(k);
	part(k);
	next_step(k);
	for (uint32_t i = 0; i < k->n; i++) {
		const quern_real lost = quern_check_found(k, RUBBED, 0)[i];
		k->host->measure(t, fabs(lost - held[i]) / (held[i] + 1e-30), 1e-9,
			"%u-D: a pair that opens books %.9g J of the %.9g J that its springs held", k->dim, lost,
			held[i]);
	}
	free(held);
}

/* After it has opened a pair is silent, and has forgotten all. */
static void apart(quern_check_kernel *k, quern_check_tally *t) {
	const quern_use *rows = k->check->uses;
	act(k);
	for (uint32_t i = 0; i < k->n; i++) {
		const bool silent =
			size_of(k, FORCE, k->dim, i) == 0 && size_of(k, COUPLE, quern_check_axial(k->dim), i) == 0;
		k->host->expect(t, silent,
			"%u-D: a force of %.3g N, a couple of %.3g N m between bodies that are apart", k->dim,
			size_of(k, FORCE, k->dim, i), size_of(k, COUPLE, quern_check_axial(k->dim), i));
		const double energy = size_of(k, STORED, 1, i) + size_of(k, SHEARED, 1, i) + size_of(k, RUBBED, 1, i);
		k->host->expect(
			t, energy == 0, "%u-D: an energy of %.3g J between bodies that are apart", k->dim, energy);
	}
	for (uint32_t r = 0; rows[r].field && r < QUERN_MOST_USES; r++) {
		if (k->use[r] < 0 || rows[r].access == QUERN_READ || strncmp(rows[r].field, "contact.", 8) != 0)
			continue;
		for (uint32_t c = 0; c < k->host->components(rows[r].shape, k->dim); c++)
			for (uint32_t i = 0; i < k->n; i++) {
				const quern_real is =
					((const quern_real *)k->host->column(k, k->use[r] + (int32_t)c)->found)[i];
				k->host->expect(t, is == rows[r].initial || (c && is == 0),
					"%u-D: %s of bodies apart is %.3g, not as new", k->dim, rows[r].field, is);
			}
	}
}

static void losses(quern_check_kernel *k, quern_check_tally *t) {
	for (int step = 0; step < 8; step++) {
		act(k);
		for (uint32_t i = 0; i < k->n; i++) {
			double power = 0, scale = 1e-300, speed = 0, turning = 0, spin = 0;
			for (uint32_t c = 0; c < k->dim; c++) {
				power += quern_check_found(k, DASHPOT, c)[i] * quern_check_given(k, VELOCITY, c)[i];
				speed += fabs(quern_check_given(k, VELOCITY, c)[i]);
			}
			scale += speed * (size_of(k, FORCE, k->dim, i) + size_of(k, DASHPOT, k->dim, i));
			k->host->measure(
				t, power / scale, 1e-12, "%u-D: the dashpot drives the bodies, with %.3g W", k->dim, power);
			for (uint32_t c = 0; k->at[DRAG_COUPLE] >= 0 && c < quern_check_axial(k->dim); c++) {
				turning += quern_check_found(k, DRAG_COUPLE, c)[i] * quern_check_given(k, SPIN, c)[i];
				spin += fabs(quern_check_given(k, SPIN, c)[i]);
			}
			scale = 1e-300 + spin * (size_of(k, COUPLE, quern_check_axial(k->dim), i) +
										size_of(k, DRAG_COUPLE, quern_check_axial(k->dim), i));
			k->host->measure(t, turning / scale, 1e-12,
				"%u-D: the couple that damps drives the bodies, with %.3g W", k->dim, turning);
			/* what a normal spring stores may be negative: grains that attract each other */
			k->host->expect(t, quern_check_found(k, SHEARED, 0)[i] >= 0,
				"%u-D: a tangential spring stores %.3g J", k->dim, quern_check_found(k, SHEARED, 0)[i]);
		}
		k->host->advance(k);
	}
}

/* Impacts at all angles, from touching to apart, or until those that attract each other stick: motion must not gain energy, but for what
 * springs have lent it. */
static void impacts(
	const quern_check *c, const quern_check_instance *it, quern_check_tally *t, quern_check_tally *books) {
	enum { PAIRS = 128, STEPS = 3000 };
	quern_check_kernel *k = create(c, it, WITH_ENERGY, "force in an impact", PAIRS);
	impact *p = c->host->memory(PAIRS, sizeof *p);
	double(*n)[3] = c->host->memory(PAIRS, sizeof *n), (*arm)[2] = c->host->memory(PAIRS, sizeof *arm);
	for (uint32_t i = 0; i < PAIRS; i++) begin_impact(k, i, &p[i]), give_impact(k, i, &p[i], n[i], arm[i]);
	k->dt = step_of(k) / 10;
	for (uint32_t step = 0; step < STEPS; step++) {
		for (uint32_t i = 0; i < PAIRS; i++) give_impact(k, i, &p[i], n[i], arm[i]);
		next_step(k);
		for (uint32_t i = 0; i < PAIRS; i++) {
			keep_books(k, i, &p[i]);
			take_impact(k, i, &p[i], n[i], arm[i]);
		}
	}
	for (uint32_t i = 0; i < PAIRS; i++) give_impact(k, i, &p[i], n[i], arm[i]);
	next_step(k);
	for (uint32_t i = 0; i < PAIRS; i++) {
		const double end = (motion_energy(k, &p[i]) + quern_check_found(k, STORED, 0)[i] +
							   quern_check_found(k, SHEARED, 0)[i]) /
						   p[i].energy;
		c->host->measure(t, end - 1, 5e-3, "%u-D: an impact ends with %.4f of its energy", it->dim, end);
		c->host->measure(books, (p[i].most - p[i].energy) / fmax(p[i].energy, p[i].fastest), 0.02,
			"%u-D: during an impact the books hold %.4f of its energy", k->dim, p[i].most / p[i].energy);
	}
	c->host->kernel_destroy(k);
	free(p), free(n), free(arm);
}

/* A law of couples or of adhesion alone has no spring, and then it may be without a period. */
static void constants(const quern_check_kernel *k, quern_check_tally *t) {
	const quern_contact_ops *ops = k->ops;
	const void *self = k->self;
	const quern_real mass = quern_check_given(k, MASS, 0)[0], radius = quern_check_given(k, RADIUS, 0)[0];
	const quern_real stiffness = ops->stiffness ? ops->stiffness(self, k->dim, radius, 1) : 0;
	const quern_real period = ops->period ? ops->period(self, k->dim, mass, radius) : INFINITY;
	const quern_real reach = ops->reach ? ops->reach(self, radius) : 0;
	k->host->expect(
		t, stiffness >= 0 && isfinite(stiffness), "%u-D: stiffness is %.3g N/m", k->dim, stiffness);
	k->host->expect(t, period > 0, "%u-D: period is %.3g s", k->dim, period);
	k->host->expect(t, !(stiffness > 0) || isfinite(period),
		"%u-D: there is a spring of %.3g N/m and no period, so nothing limits the step", k->dim, stiffness);
	k->host->expect(t, reach >= 0 && isfinite(reach), "%u-D: reach is %.3g m", k->dim, reach);
}

/* ---- the same with all masses, stiffnesses and other parameters that contain a mass in another proportion ---- */

enum { FACTOR = 64 }; /* its square and cube roots are whole, so that only a law's own roundings differ */

static void scale_masses(const quern_check_kernel *k) {
	const quern_use *rows = k->check->uses;
	for (uint32_t i = 0; i < k->n; i++) quern_check_given(k, MASS, 0)[i] *= FACTOR;
	for (uint32_t r = 0; rows[r].field && r < QUERN_MOST_USES; r++) {
		const double factor = pow(FACTOR, k->host->mass_power(k->check, rows[r].unit));
		const int32_t *uses[] = { k->use, k->use_second };
		for (int side = 0; side < 2; side++)
			for (uint32_t c = 0; uses[side][r] >= 0 && c < k->host->components(rows[r].shape, k->dim); c++) {
				const quern_check_column *column = k->host->column(k, uses[side][r] + (int32_t)c);
				for (uint32_t i = 0; i < k->n && !column->integer; i++)
					((quern_real *)column->given)[i] *= factor;
			}
	}
}

static void compare_scaled(const quern_check_kernel *k, const quern_check_kernel *big, quern_check_tally *t) {
	static const int sums[] = { FORCE, COUPLE, DASHPOT, STORED, SHEARED, RUBBED };
	for (size_t s = 0; s < sizeof sums / sizeof *sums; s++) {
		const uint32_t count = components_of(k, sums[s]);
		for (uint32_t i = 0; k->at[sums[s]] >= 0 && i < k->n; i++) {
			const double size = size_of(k, sums[s], count, i) + 1e-30;
			for (uint32_t c = 0; c < count; c++) {
				const double is = quern_check_found(big, sums[s], c)[i] / FACTOR,
							 was = quern_check_found(k, sums[s], c)[i];
				k->host->measure(t, fabs(is - was) / size, 1e-9,
					"%u-D: with %d times all masses and stiffnesses %s is %.9g times as large", k->dim,
					FACTOR, k->host->column(k, k->at[sums[s]])->name, FACTOR * is / was);
			}
		}
	}
}

static void homogeneous(const quern_check *c, const quern_check_instance *it, quern_check_tally *t) {
	quern_check_instance *scaled = c->host->instance_scaled(c, it, FACTOR);
	if (!scaled) return;
	quern_check_kernel *k = create(c, it, WITH_SPIN | WITH_ENERGY, "force", 500),
					   *big = create(c, scaled, WITH_SPIN | WITH_ENERGY, "force", 500);
	fill_pairs(k, 30), fill_pairs(big, 30);
	k->dt = big->dt = step_of(k);
	scale_masses(big);
	for (int step = 0; step < 3; step++) {
		next_step(k), next_step(big);
		compare_scaled(k, big, t);
	}
	c->host->kernel_destroy(k), c->host->kernel_destroy(big);
	c->host->instance_destroy(scaled);
}

typedef struct {
	quern_check_tally reacts, adds, silent, lost, whole, limits, books, scaled, follows;
} tallies;

static void try_instance(const quern_check *c, const quern_check_instance *it, tallies *t) {
	quern_check_kernel *k[2]; /* from the first touch on, since a history need not turn round with the pair */
	for (int i = 0; i < 2; i++) {
		k[i] = create(c, it, WITH_ENERGY, "force", 500);
		fill_pairs(k[i], 30);
		k[i]->dt = step_of(k[i]);
	}
	constants(k[0], &t->limits);
	reaction(k[0], k[1], &t->reacts);
	addition(k[0], &t->adds);
	alone(k[0], &t->follows);
	losses(k[0], &t->lost);
	only_losses(k[0], &t->books);
	opening(k[0], &t->books);
	apart(k[0], &t->silent);
	c->host->kernel_destroy(k[0]), c->host->kernel_destroy(k[1]);
	impacts(c, it, &t->whole, &t->books);
	homogeneous(c, it, &t->scaled);
}

static void law(const quern_check *c) {
	tallies t = { { .name = "action and reaction" }, { .name = "laws add up" },
		{ .name = "silence when apart" }, { .name = "dashpots only take" },
		{ .name = "impacts gain no energy" }, { .name = "period, stiffness, reach" },
		{ .name = "books of energy" }, { .name = "homogeneous in (stiffness, mass)" },
		{ .name = "nothing without a force" } };
	for (uint32_t dim = 2; dim <= 3; dim++) {
		quern_check_instance *it = c->host->instance_create(c, dim, 0);
		if (it) try_instance(c, it, &t);
		c->host->instance_destroy(it);
	}
	c->host->tell(c, &t.limits, NULL);
	c->host->tell(c, &t.reacts, NULL);
	c->host->tell(c, &t.adds, NULL);
	c->host->tell(c, &t.silent, NULL);
	if (t.follows.tried) c->host->tell(c, &t.follows, NULL);
	c->host->tell(c, &t.lost, NULL);
	c->host->tell(c, &t.whole, NULL);
	c->host->tell(c, &t.books, NULL);
	c->host->tell(c, &t.scaled,
		t.scaled.tried ? NULL : "not tried: init refuses the parameters of %d times the mass", FACTOR);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = {
	.size = sizeof ops, .kind = &quern_contact_kind, .make = make, .law = law
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.contact",
	.brief = "Laws between two grains: action and reaction, silence when apart, no energy out of nothing.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
