/* SPDX-License-Identifier: MIT */
/* audit - the ledger's two invariants, asserted after every step: docs/theory/hybrid.md, section 5 */
#include "../common/outlets.h"
#include "../common/tally.h"
#include "hybrid.h"
#include <math.h>

static const quern_real tolerance = 1e-12;

typedef struct {
	quern_real mass, carried, momentum[3], owed_momentum[3];
	quern_real speed, kinetic; /* sums of w m |v| and w m v^2/2 */
	quern_real left, poured;   /* kg so far, through faces and by sources */
} sums;

/* ---- what a cloud carries ---- */

enum { CARRIED, SPEED, KINETIC, MOMENTUM, N_CARRIED = MOMENTUM + 3 };
_Static_assert((int)N_CARRIED <= (int)TALLY_SUMS, "");

typedef struct {
	const cloud *of;
	const quern_column *velocity;
	uint32_t dim;
} carrying;

QUERN_INLINE void add_carried(
	const carrying *c, uint32_t begin, uint32_t n, const uint32_t dim, quern_real out[TALLY_SUMS]) {
	for (uint32_t i = begin; i < begin + n; i++) {
		const quern_real mass = cloud_mass(c->of, i), square = cloud_square(c->velocity, i, dim);
		out[CARRIED] += mass;
		out[SPEED] += mass * sqrt(square);
		out[KINETIC] += mass * (0.5 * square);
		for (uint32_t k = 0; k < dim; k++) out[MOMENTUM + k] += mass * c->velocity->real[k][i];
	}
}

static void add_leaf(const void *what, uint32_t begin, uint32_t n, quern_real out[TALLY_SUMS]) {
	const carrying *c = what;
	if (c->dim == 2) add_carried(c, begin, n, 2, out);
	else add_carried(c, begin, n, 3, out);
}

static bool add_cloud(const quern_step *s, const cloud *of, const quern_column *velocity, sums *out) {
	const carrying c = { of, velocity, s->dim };
	quern_real all[TALLY_SUMS] = { 0 };
	if (!tally_set(s, of->set, add_leaf, &c, N_CARRIED, all)) return false;
	out->carried += all[CARRIED];
	out->speed += all[SPEED];
	out->kinetic += all[KINETIC];
	for (uint32_t k = 0; k < s->dim; k++) out->momentum[k] += all[MOMENTUM + k];
	return true;
}

/* ---- all that is summed ---- */

static uint32_t entries(const quern_step *s, const char *set) { return s->host->set(s->run, set).n; }

/* What leaves takes momentum along, what comes brings some. */
static quern_real flow(const quern_step *s, uint32_t axis) {
	const quern_column *u = s->use;
	return book_total(u[A_POURED_MOMENTUM].real[axis], entries(s, "grain_source")) -
		   book_total(u[A_GRAIN_LEFT_MOMENTUM].real[axis], outlet_faces(s)) -
		   book_total(u[A_POINT_LEFT_MOMENTUM].real[axis], outlet_faces(s));
}

/* Impulses that came from outside since the start: whatever body, face or fixed grain gave them, and what flows through
 * faces and out of sources. */
static quern_real impulse(const quern_step *s, uint32_t axis) {
	const quern_column *u = s->use;
	quern_real sum = u[A_GRAVITY].real[axis][0] + u[A_FACES].real[axis][0] + u[A_SUPPORT].real[axis][0];
	const uint32_t bodies = u[A_BODY].real[axis] ? s->host->set(s->run, "body").n : 0;
	for (uint32_t b = 0; b < bodies; b++) sum += u[A_BODY].real[axis][b];
	return u[A_PASSED].real[0] ? sum + flow(s, axis) : sum;
}

static bool take_sums(const quern_step *s, sums *out) {
	const quern_column *u = s->use;
	const cloud grains = { u[A_GRAIN_MASS].real[0], u[A_GRAIN_WEIGHT].real[0], u[A_GRAIN_FIXED].index,
		s->host->set(s->run, "grain").n, "grain" };
	const cloud points = { u[A_POINT_MASS].real[0], u[A_POINT_WEIGHT].real[0], NULL,
		s->host->set(s->run, "point").n, "point" };
	if (!add_cloud(s, &grains, &u[A_GRAIN_VELOCITY], out) ||
		!add_cloud(s, &points, &u[A_POINT_VELOCITY], out))
		return false;
	out->mass = out->carried + s->host->sum_set(s->run, "cell", u[A_OWED].real[0]);
	if (u[A_PASSED].real[0]) {
		out->poured = book_total(u[A_POURED].real[0], entries(s, "grain_source"));
		out->left = book_total(u[A_GRAIN_LEFT].real[0], outlet_faces(s)) +
					book_total(u[A_POINT_LEFT].real[0], outlet_faces(s));
	}
	for (uint32_t k = 0; k < s->dim; k++)
		out->owed_momentum[k] = s->host->sum_set(s->run, "cell", u[A_OWED_MOMENTUM].real[k]);
	return true;
}

/* A leak shows in the step that makes it. What adds up over a run is also the round-off of every v += g dt, which has
 * the same sign for long: half a unit in the last place for each grain step is allowed on top. */
static quern_status judge_momentum(const quern_step *s, const sums *now) {
	const quern_column *u = s->use;
	quern_real off = 0, leak = 0, pull = 0, passed = 0;
	for (uint32_t k = 0; k < s->dim; k++) {
		const quern_real left =
			now->momentum[k] + now->owed_momentum[k] - impulse(s, k) - u[A_MOMENTUM].real[k][0];
		off = fmax(off, fabs(left));
		leak = fmax(leak, fabs(left - u[A_LEFT].real[k][0]));
		pull = fmax(pull, fabs(u[A_GRAVITY].real[k][0]));
		if (u[A_PASSED].real[0])
			passed = fmax(passed, fabs(book_total(u[A_POURED_MOMENTUM].real[k], entries(s, "grain_source"))));
		u[A_LEFT].real[k][0] = left;
	}
	quern_real *scale = u[A_SCALE].real[0], *worst = u[A_MOMENTUM_DEFECT].real[0];
	*scale = fmax(*scale, now->speed);
	const quern_real size = *scale + pull + passed, allowed = tolerance + 1.2e-16 * (quern_real)s->substep;
	if (!(size > 0)) return QUERN_OK;
	*worst = fmax(*worst, off / size);
	if (!(leak <= tolerance * size))
		return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
			"this step has changed the momentum of grains, points and entries by %.3g of it beyond all "
			"impulses",
			leak / size);
	if (!(off <= allowed * size))
		return s->host->stop(
			s->run, QUERN_E_NUMERIC, NULL, -1, "the ledger of momentum is off by %.3g of it", off / size);
	return QUERN_OK;
}

static quern_status judge(const quern_step *s, const sums *now) {
	const quern_column *u = s->use;
	quern_real *worst = u[A_MASS_DEFECT].real[0];
	const quern_real whole = u[A_MASS].real[0][0] + now->poured;
	const quern_real mass_defect = whole > 0 ? fabs((now->mass + now->left) / whole - 1) : 0;
	*worst = fmax(*worst, mass_defect);
	if (!(mass_defect <= tolerance))
		return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
			"the ledger of mass is off by %.3g of the mass: what grains, points and entries hold is no "
			"longer "
			"constant",
			mass_defect);
	if (!(u[A_EXCHANGE].real[0][0] <= tolerance))
		return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
			"the coupling does not keep momentum: a node is off by %.3g of its own",
			u[A_EXCHANGE].real[0][0]);
	return judge_momentum(s, now);
}

static void begin(const quern_step *s, const sums *now) {
	const quern_column *u = s->use;
	u[A_AUDITS].index[0] = 1;
	u[A_MASS].real[0][0] = now->mass + now->left - now->poured;
	quern_hybrid_begin_gain(s, now->kinetic);
	for (uint32_t k = 0; k < s->dim; k++) {
		u[A_MOMENTUM].real[k][0] = now->momentum[k] + now->owed_momentum[k] - impulse(s, k);
		u[A_LEFT].real[k][0] = 0;
	}
}

/* Of what has left in this step gravity has had a part. */
static void book_flow(const quern_step *s, const sums *now) {
	const quern_column *u = s->use;
	if (!u[A_PASSED].real[0]) return;
	u[A_PASSED].real[0][0] = now->left - now->poured;
	for (uint32_t k = 0; k < s->dim && u[A_AUDITS].index[0]; k++)
		u[A_GRAVITY].real[k][0] += u[A_PULL].real[0][0] * s->gravity[k];
	u[A_PULL].real[0][0] = 0;
}

quern_status quern_hybrid_audit(const void *self, const quern_step *s) {
	const quern_column *u = s->use;
	sums now = { .mass = 0 };
	if (!take_sums(s, &now)) return QUERN_E_MEMORY;
	book_flow(s, &now);
	if (!u[A_AUDITS].index[0]) begin(s, &now);
	else
		for (uint32_t k = 0; k < s->dim; k++) {
			u[A_GRAVITY].real[k][0] += now.carried * s->gravity[k] * s->dt;
			u[A_WORK].real[0][0] += now.momentum[k] * s->gravity[k] * s->dt;
		}
	/* what was held before may be worth more by the values of a new stage */
	if (s->step == s->stage_step && s->step) quern_hybrid_begin_gain(s, now.kinetic);
	quern_status status = judge(s, &now);
	if (status == QUERN_OK) status = quern_hybrid_judge_gain(self, s, now.kinetic, now.carried);
	if (zones_are_due(self, s)) quern_hybrid_lower_gain(s, now.kinetic);
	return status;
}
