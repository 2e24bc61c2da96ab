/* SPDX-License-Identifier: MIT */
/* watch - energy that nobody has given, and material that is pressed too far, of a continuum alone: docs/theory/mpm.md, section 5 */
#include "../common/outlets.h"
#include "../common/rotation.h"
#include "../common/tally.h"
#include "mpm.h"

/* Steps from one look to the next: what explodes grows over many, and looks cost next to nothing. */
enum { WATCH_EVERY = 20 };

/* Over the density without stress: from the loosest packing of spheres to the densest one there is. Single points may be off by noise. */
static const quern_real pressed_to = 1.3, pressed_share = 0.01;

typedef struct looked {
	quern_real mass, kinetic, held; /* kg, J, J */
	quern_real height,
		power; /* J and W of gravity: along axes that end, and along periodic ones, where no height is known */
	quern_real pressed; /* kg of those that are denser than pressed_to */
} looked;

/* Gravity along the axes that are periodic, or along those that are not. */
static quern_vec gravity_along(const quern_step *s, bool periodic) {
	const quern_real *g = s->gravity;
	return (quern_vec) { s->periodic[0] == periodic ? g[0] : 0, s->periodic[1] == periodic ? g[1] : 0,
		s->dim == 3 && s->periodic[2] == periodic ? g[2] : 0 };
}

typedef struct {
	const quern_step *s;
	cloud points;
	quern_vec down, along; /* gravity, as above */
	quern_real softness, shear_softness;
	quern_real dense; /* kg/m^3 */
} looking;

enum { MASS, KINETIC, HELD, HEIGHT, POWER, PRESSED, N_LOOKED };
_Static_assert((int)N_LOOKED <= (int)TALLY_SUMS, "");

QUERN_INLINE void look_at(const looking *l, uint32_t begin, uint32_t n, const int dim, quern_real *out) {
	const quern_column *u = l->s->use;
	for (uint32_t i = begin; i < begin + n; i++) {
		const quern_real mass = cloud_mass(&l->points, i);
		const quern_vec x = QUERN_VEC_AT(u[WATCH_POSITION].real, i, dim),
						v = QUERN_VEC_AT(u[WATCH_VELOCITY].real, i, dim);
		const symmetric stress = SYMMETRIC_AT(u[WATCH_STRESS].real, i, dim);
		out[MASS] += mass;
		out[KINETIC] += mass * (0.5 * quern_vec_dot(v, v, dim));
		out[HELD] += mass * (u[WATCH_VOLUME].real[0][i] / u[WATCH_MASS].real[0][i] *
								symmetric_held(dim, l->softness, l->shear_softness, stress));
		out[HEIGHT] -= mass * quern_vec_dot(l->down, x, dim);
		out[POWER] += mass * quern_vec_dot(l->along, v, dim);
		out[PRESSED] += u[WATCH_MASS].real[0][i] > l->dense * u[WATCH_VOLUME].real[0][i] ? mass : 0;
	}
}

static void look_at_leaf(const void *what, uint32_t begin, uint32_t n, quern_real out[TALLY_SUMS]) {
	const looking *l = what;
	if (l->s->dim == 2) look_at(l, begin, n, 2, out);
	else look_at(l, begin, n, 3, out);
}

static bool look(const mpm *p, const quern_step *s, looked *out) {
	const quern_column *u = s->use;
	const looking l = { .s = s,
		.points = { u[WATCH_MASS].real[0], u[WATCH_WEIGHT].real[0], NULL, s->host->set(s->run, "point").n,
			"point" },
		.down = gravity_along(s, false),
		.along = gravity_along(s, true),
		.softness = 0.5 / p->bulk,
		.shear_softness = p->shear > 0 ? 0.5 / p->shear : 0,
		.dense = pressed_to * p->density };
	quern_real all[TALLY_SUMS] = { 0 };
	if (!tally_set(s, "point", look_at_leaf, &l, N_LOOKED, all)) return false;
	*out = (looked) { all[MASS], all[KINETIC], all[HELD], all[HEIGHT], all[POWER], all[PRESSED] };
	return true;
}

/* J that bodies have done so far. */
static quern_real by_bodies(const quern_step *s) {
	return book_total(s->use[WATCH_BODY_WORK].real[0], s->n_slot[SLOT_BODIES]);
}

/* The same, with what was poured, motion and height, less the height of what left: that its motion is gone only lowers the sum. */
static quern_real given(const quern_step *s) {
	const quern_column *u = s->use;
	const uint32_t sources = s->host->set(s->run, "point_source").n;
	return by_bodies(s) + book_total(u[WATCH_POURED].real[0], sources) +
		   book_total(u[WATCH_POURED_HEIGHT].real[0], sources) -
		   book_total(u[WATCH_LEFT_HEIGHT].real[0], outlet_faces(s));
}

/* Heights of what came and went are booked along all axes, and those along a periodic one have no meaning. */
static bool cannot_tell(const quern_step *s) {
	const quern_vec along = gravity_along(s, true);
	const bool passes = s->use[WATCH_POURED].real[0] || s->use[WATCH_LEFT_HEIGHT].real[0];
	return passes && quern_vec_dot(along, along, (int)s->dim) > 0;
}

/* Once more from here: what was held before may be worth more by the values of a new stage. */
static void begin(const quern_step *s, quern_real all) {
	const quern_column *u = s->use;
	u[WATCH_BEGUN].index[0] = 1;
	u[WATCH_LEAST].real[0][0] = all;
	u[WATCH_WORK].real[0][0] = 0;
	u[WATCH_MOST].real[0][0] = 0;
	u[WATCH_GIVEN].real[0][0] = given(s);
}

/* Flow and friction take energy and nobody makes any: what there is, less what was given, does not rise but by what a step is off. As much
 * again as moves and is held is allowed, since apic hides some of what points do in their gradients for a while; a quarter of the most that was
 * ever held, whose sum is that of small strains; a tenth of what bodies have done; what lifts all by a part of a cell and, where nothing
 * pulls, what round-off moves; and the round-off of these sums. */
static quern_real allowed(const mpm *p, const quern_step *s, const looked *now, quern_real work) {
	const quern_real still = 1e-6 * p->cell / s->dt,
					 lift = p->gain * quern_gravity_size(s->dim, s->gravity) * p->cell;
	return 0.25 * s->use[WATCH_MOST].real[0][0] + 0.1 * fabs(by_bodies(s)) +
		   now->mass * (lift + 0.5 * still * still) +
		   1e-9 * (fabs(work) + fabs(now->height) + now->kinetic + now->held);
}

static quern_status judge(const mpm *p, const quern_step *s, const looked *now) {
	const quern_column *u = s->use;
	const quern_real work = u[WATCH_WORK].real[0][0] + given(s) - u[WATCH_GIVEN].real[0][0];
	const quern_real there = now->kinetic + now->held, own = there + now->height - work;
	quern_real *least = u[WATCH_LEAST].real[0], *most = u[WATCH_MOST].real[0];
	*least = own < *least ? own : *least;
	*most = now->held > *most ? now->held : *most;
	const quern_real made = own - *least;
	if (made <= there - made + allowed(p, s, now, work)) return QUERN_OK;
	return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
		"the continuum makes energy: its motion and stress hold %.3g J, and there are %.3g J more in all than there were and than came "
		"since; take a shorter step, or another shape or transfer; continuum.gain says how much is allowed",
		there, made);
}

/* Stress grows with the strain alone, so that nothing keeps sand from becoming denser than its grains. */
static void tell_of_pressed(const mpm *p, const quern_step *s, const looked *now) {
	int32_t *said = s->use[WATCH_PRESSED].index;
	if (*said || !(now->pressed > pressed_share * now->mass)) return;
	*said = 1;
	s->host->log(s->run, 2,
		"at t = %.6g s %.3g %% of the continuum is more than %g times as dense as without stress, %.4g kg/m^3: no packing of grains "
		"is so dense, and stress that grows with the strain alone does not hold there; give continuum.material a greater "
		"bulk_modulus, or a gentler load",
		s->time, 100 * now->pressed / now->mass, pressed_to, p->density);
}

quern_status quern_mpm_watch(const void *self, const quern_step *s) {
	const mpm *p = self;
	const quern_column *u = s->use;
	const bool tells = !cannot_tell(s),
			   anew = tells && (!u[WATCH_BEGUN].index[0] || s->step == s->stage_step);
	if (!(p->gain > 0) || (!anew && s->step % WATCH_EVERY)) return QUERN_OK;
	looked now = { .mass = 0 };
	if (!look(p, s, &now)) return QUERN_E_MEMORY;
	tell_of_pressed(p, s, &now);
	if (!tells) return QUERN_OK;
	quern_real *power = u[WATCH_POWER].real[0], *time = u[WATCH_TIME].real[0];
	if (anew) begin(s, now.kinetic + now.held + now.height);
	else u[WATCH_WORK].real[0][0] += 0.5 * (*power + now.power) * (s->time - *time);
	*power = now.power;
	*time = s->time;
	return judge(p, s, &now);
}
