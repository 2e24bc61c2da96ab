/* SPDX-License-Identifier: MIT */
/* contact.rolling - resistance to rolling and, in 3-D, to twisting: couples that no force goes with, by a spring and a
 * dashpot under a cone of the normal force of the laws before it in the list. docs/theory/contacts.md, section 4 */
#include <quern/contact.h>

typedef struct {
	quern_real stiffness, friction, damping, twisting_stiffness, twisting_friction; /* from the scene */
	quern_real loss; /* gamma = loss sqrt(k m) */
} rolling;

static const quern_param params[] = { QUERN_PARAM(rolling, stiffness, "N/m",
										  "Rolling spring k_r; a tenth of k_n or so leaves the step alone.",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e15),
	QUERN_PARAM(rolling, friction, "1", "Largest rolling force over the normal force; 0: rolls freely.",
		.def = 0.1, .max = 10),
	QUERN_PARAM(rolling, damping, "1", "Of rolling and twisting on a body, over the critical damping.",
		.def = 0.3, .max = 10),
	QUERN_PARAM(rolling, twisting_stiffness, "1", "k_o / k_r, of the twisting spring; 3-D.", .def = 1,
		.flags = QUERN_MIN_OPEN, .max = 10),
	QUERN_PARAM(rolling, twisting_friction, "1",
		"Largest twisting force over the normal force; 0: twists freely; 3-D.", .max = 10),
	QUERN_END_PARAMS };

/* clang-format off */
#define USES(X) \
	X(ROLL, "contact.roll", "m", QUERN_UPDATE, QUERN_AXIAL, .when = "friction", \
		.doc = "Rolling spring; 2-D: along the normal turned left.") \
	X(TWIST, "contact.twist", "m", QUERN_UPDATE, QUERN_SCALAR, .when = "twisting_friction", \
		.doc = "Twisting spring, about the normal.") \
	X(COUPLE, "contact.couple", "N m", QUERN_ADD, QUERN_AXIAL, .doc = "On the first.") \
	X(SPIN, "grain.spin", "rad/s", QUERN_READ, QUERN_AXIAL, .flags = QUERN_OTHERS | QUERN_EXISTS, .doc = "Angular velocity.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

/* Moment of inertia over mass and radius squared. */
static quern_real inertia(uint32_t dim) { return dim == 2 ? 0.5 : 0.4; }

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	rolling *law = self;
	if (setup->dim == 2 && law->twisting_friction > 0)
		return setup->host->fail(
			err, QUERN_E_PARAM, "twisting_friction", "discs in a plane do not twist: leave it out in 2-D");
	law->loss = 2 * law->damping * __builtin_sqrt(inertia(setup->dim));
	return QUERN_OK;
}

/* Along the one tangent (-n_y, n_x): v_r = r (w_i - w_j) x n is r times the relative spin. */
QUERN_INLINE void kernel_2d(const bool energy, const rolling *self, const quern_contact_batch *b) {
	const rolling law = *self;
	const quern_real dt = b->dt, k = law.stiffness, one_over_k = 1 / k;
	const quern_real *restrict overlap = b->overlap, *restrict mass = b->mass, *restrict radius = b->radius;
	quern_real *const *roll = b->use[ROLL].real;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec n = QUERN_VEC_AT(b->normal, i, 2), u = QUERN_VEC_AT(b->mean_velocity, i, 2);
		const quern_real pushed = b->force[0][i] * n.x + b->force[1][i] * n.y;
		const bool touching = overlap[i] > 0;
		const quern_onset onset = quern_first_touch(overlap[i], -quern_vec_dot(u, n, 2), dt, 0);
		const quern_real damping = law.loss * __builtin_sqrt(k * mass[i]) * onset.weight;
		const quern_real v = radius[i] * b->spin[0][i], was = roll[0][i];
		const quern_real trial = was + onset.time * radius[i] * b->mean_spin[0][i];
		quern_real spring;
		const quern_real total =
			quern_cone_planar(k * trial, damping * v, law.friction * (pushed > 0 ? pushed : 0), &spring);
		const quern_real now = touching ? spring * one_over_k : 0, f = touching ? total : 0;
		roll[0][i] = now;
		b->couple[0][i] -= radius[i] * f;
		if (energy) {
			b->drag_couple[0][i] -= radius[i] * (f - k * now);
			b->sheared[i] += 0.5 * k * now * now;
			b->rubbed[i] += 0.5 * k * (was + now) * (trial - now);
		}
	}
}

QUERN_INLINE void kernel_3d(const bool rolls, const bool twists, const bool energy, const rolling *self,
	const quern_contact_batch *b) {
	const rolling law = *self;
	const quern_real dt = b->dt, k = law.stiffness, ko = law.twisting_stiffness * k, one_over_ko = 1 / ko;
	const quern_real *restrict overlap = b->overlap, *restrict mass = b->mass, *restrict radius = b->radius;
	quern_real *const *roll = b->use[ROLL].real, *const *twist = b->use[TWIST].real;
	if (rolls) QUERN_TURN_SPRINGS(roll, b);
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec n = QUERN_VEC_AT(b->normal, i, 3), u = QUERN_VEC_AT(b->mean_velocity, i, 3);
		const quern_vec f = QUERN_VEC_AT(b->force, i, 3), spin = QUERN_VEC_AT(b->spin, i, 3),
						mean = QUERN_VEC_AT(b->mean_spin, i, 3);
		const quern_real r = radius[i], pushed = quern_vec_dot(f, n, 3), normal = pushed > 0 ? pushed : 0;
		const bool touching = overlap[i] > 0;
		const quern_onset onset = quern_first_touch(overlap[i], -quern_vec_dot(u, n, 3), dt, 0);
		quern_vec couple = { 0, 0, 0 }, drag_couple = { 0, 0, 0 };
		quern_real sheared = 0, rubbed = 0;
		if (rolls) {
			const quern_vec v = quern_vec_scale(r, quern_vec_cross(spin, n)),
							mean_v = quern_vec_scale(r, quern_vec_cross(mean, n));
			const quern_vec was = QUERN_VEC_AT(roll, i, 3);
			const quern_vec trial = quern_vec_axpy(onset.time, mean_v, was), a = quern_vec_scale(k, trial);
			const quern_vec g = quern_vec_scale(law.loss * __builtin_sqrt(k * mass[i]) * onset.weight, v);
			const quern_cone cone = quern_cone_shares(a, g, law.friction * normal);
			const quern_vec now = quern_vec_scale(touching ? cone.spring : 0, trial);
			const quern_vec drag = quern_vec_scale(touching ? cone.damper : 0, g);
			QUERN_VEC_PUT(roll, i, now, 3);
			couple = quern_vec_scale(-r, quern_vec_cross(n, quern_vec_axpy(k, now, drag)));
			drag_couple = quern_vec_scale(-r, quern_vec_cross(n, drag));
			const quern_vec slid = quern_vec_sub(trial, now);
			sheared = 0.5 * k * quern_vec_dot(now, now, 3);
			rubbed = 0.5 * k * quern_vec_dot(quern_vec_add(was, now), slid, 3);
		}
		if (twists) { /* the same about the normal: v_o = r (w_i - w_j).n */
			const quern_real v = r * quern_vec_dot(spin, n, 3), was = twist[0][i],
							 trial = was + onset.time * r * quern_vec_dot(mean, n, 3);
			quern_real spring;
			const quern_real total =
				quern_cone_planar(ko * trial, law.loss * __builtin_sqrt(ko * mass[i]) * onset.weight * v,
					law.twisting_friction * normal, &spring);
			const quern_real now = touching ? spring * one_over_ko : 0, all = touching ? total : 0;
			twist[0][i] = now;
			couple = quern_vec_axpy(-r * all, n, couple);
			drag_couple = quern_vec_axpy(-r * (all - ko * now), n, drag_couple);
			sheared += 0.5 * ko * now * now;
			rubbed += 0.5 * ko * (was + now) * (trial - now);
		}
		b->couple[0][i] += couple.x;
		b->couple[1][i] += couple.y;
		b->couple[2][i] += couple.z;
		if (energy) {
			b->drag_couple[0][i] += drag_couple.x;
			b->drag_couple[1][i] += drag_couple.y;
			b->drag_couple[2][i] += drag_couple.z;
			b->sheared[i] += sheared;
			b->rubbed[i] += rubbed;
		}
	}
}

static void force_2d(const void *self, const quern_contact_batch *b) {
	if (!(((const rolling *)self)->friction > 0)) return;
	if (b->stored) kernel_2d(true, self, b);
	else kernel_2d(false, self, b);
}

QUERN_INLINE void force(const bool rolls, const bool twists, const void *self, const quern_contact_batch *b) {
	if (b->stored) kernel_3d(rolls, twists, true, self, b);
	else kernel_3d(rolls, twists, false, self, b);
}
static void force_3d(const void *self, const quern_contact_batch *b) {
	const rolling *law = self;
	const bool twists = law->twisting_friction > 0;
	if (law->friction > 0 && twists) force(true, true, self, b);
	else if (law->friction > 0) force(true, false, self, b);
	else if (twists) force(false, true, self, b);
}

/* pi/omega on a body, where omega^2 = k/(q m) with the moment of inertia q m r^2; between grains the mode is slower. */
static quern_real period(const void *self, uint32_t dim, quern_real mass, quern_real radius) {
	const rolling *law = self;
	const quern_real rolls = law->friction > 0 ? 1 : 0,
					 twists = law->twisting_friction > 0 ? law->twisting_stiffness : 0;
	(void)radius;
	return 3.14159265358979312 *
		   __builtin_sqrt(inertia(dim) * mass / (law->stiffness * (twists > rolls ? twists : rolls)));
}

/* Rolling and twisting are damped alike, each over its own critical damping. */
static quern_real damping(const void *self, uint32_t dim) {
	(void)dim;
	return ((const rolling *)self)->damping;
}

static const quern_contact_ops ops = { .size = sizeof ops,
	.follows = 1,
	.force = { force_2d, force_3d },
	.period = period,
	.damping = damping,
	.means = 1 };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "contact.rolling",
	.brief = "Resistance to rolling and twisting, as couples.",
	.doc = "It stands in a list behind a law that pushes, such as linear or hertz, whose normal force bounds "
		   "it.",
	.cite = "Luding 2008; Ai, Chen, Rotter & Ooi 2011",
	.instance_size = sizeof(rolling),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
