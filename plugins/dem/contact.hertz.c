/* SPDX-License-Identifier: MIT */
/* contact.hertz - Hertz's normal force and Mindlin's tangential stiffness, from the constants of the grains' material.
 * docs/theory/contacts.md, section 3 */
#include <quern/contact.h>

typedef struct {
	quern_real young, poisson, restitution, friction, impact_speed; /* from the scene */
	quern_real modulus, shear, damping_ratio;                       /* E*, G* of two grains; zeta(e) */
} hertz;

static const quern_param params[] = { QUERN_PARAM(hertz, young, "Pa", "Young's modulus of the grains.",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e15),
	QUERN_PARAM(hertz, poisson, "1", "Poisson's ratio of the grains.", .def = 0.25, .min = -0.99, .max = 0.5),
	QUERN_PARAM(hertz, restitution, "1", "Normal restitution of a pair, exact for any masses and speeds.",
		.def = 0.5, .min = 0.01, .max = 1),
	QUERN_PARAM(hertz, friction, "1", "Coulomb coefficient; 0: no slip, no spin.", .def = 0.5, .max = 10),
	QUERN_PARAM(hertz, impact_speed, "m/s", "Largest speed of approach expected; sets the step.",
		.from = "scene.speed", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_END_PARAMS };

/* clang-format off */
#define USES(X) \
	X(SHEAR, "contact.shear", "N", QUERN_UPDATE, QUERN_AXIAL, .when = "friction", \
		.doc = "Elastic tangential force; 2-D: along the normal turned left.") \
	X(SPIN, "grain.spin", "rad/s", QUERN_READ, QUERN_AXIAL, .flags = QUERN_OTHERS | QUERN_EXISTS, .when = "friction", \
		.doc = "Angular velocity; a frictional contact turns its grains.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	hertz *law = self;
	if (!(law->impact_speed > 0))
		return setup->host->fail(
			err, QUERN_E_PARAM, "impact_speed", "must be given where there is no gravity");
	const quern_real rigidity = law->young / (2 * (1 + law->poisson));
	law->modulus = law->young / (2 * (1 - law->poisson * law->poisson));
	law->shear = rigidity / (2 * (2 - law->poisson));
	law->damping_ratio = quern_damping_ratio(law->restitution);
	return QUERN_OK;
}

/* Grains that roll as they are pushed along make a tangential spring act on m/3 (discs) or m/3.5 (spheres). */
QUERN_INLINE quern_real turning_of(uint32_t dim) { return dim == 2 ? 3 : 3.5; }

QUERN_INLINE void kernel(
	const int dim, const bool rough, const int energy, const hertz *self, const quern_contact_batch *b) {
	const hertz law = *self;
	const quern_real dt = b->dt, lag = b->lag, turning = turning_of((uint32_t)dim);
	const quern_real normal = 4.0 / 3 * law.modulus,
					 shear = 8 * law.shear;                           /* times sqrt(r d): k sqrt d and k_t */
	const quern_real loss_n = 2.2360679774997898 * law.damping_ratio, /* sqrt 5 zeta */
		loss_t =
			1.8257418583505537 * law.damping_ratio * __builtin_sqrt(shear / normal); /* 2 sqrt(5/6) zeta */
	const quern_real *restrict overlap = b->overlap, *restrict mass = b->mass, *restrict radius = b->radius;
	quern_real *const *history = rough ? b->use[SHEAR].real : NULL;
	if (rough && dim == 3) QUERN_TURN_SPRINGS(history, b);
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec n = QUERN_VEC_AT(b->normal, i, dim), v = QUERN_VEC_AT(b->velocity, i, dim),
						mean = QUERN_VEC_AT(b->mean_velocity, i, dim);
		const quern_real vn = quern_vec_dot(v, n, dim), mean_n = quern_vec_dot(mean, n, dim);
		/* "touches" is written d > 0 below: one truth value for all of it is what gcc does not vectorise */
		const bool touching = overlap[i] > 0;
		const quern_real d = touching ? overlap[i] : 0, root = __builtin_sqrt(radius[i] * d),
						 stiff = normal * root, kt = shear * root, elastic = stiff * d;
		const quern_onset onset = quern_first_touch(overlap[i], -mean_n, dt, 0.25);
		/* f_n = max(0, k d^(3/2) - sqrt 5 zeta sqrt(m k) d^(1/4) v_n) */
		const quern_real loss = __builtin_sqrt(mass[i] * stiff) * onset.weight,
						 damping = loss_n * loss * quern_dashpot_share(1.5 * stiff, mass[i], lag);
		const quern_real pushed = elastic - damping * vn, fn = pushed > 0 ? pushed : 0;
		quern_vec f = quern_vec_scale(fn, n), viscous = quern_vec_scale(fn - elastic, n);
		quern_real sheared = 0, rubbed = 0;
		if (rough) {
			/* k_t = 8 G* sqrt(r d); what is kept is the force, which an unloading contact gives up in proportion */
			const quern_vec vt = quern_vec_axpy(-vn, n, v), mean_t = quern_vec_axpy(-mean_n, n, mean);
			/* a pair that has opened gives up what its spring held when it still touched */
			const quern_real before = overlap[i] + mean_n * (touching ? onset.time : dt),
							 root_before = __builtin_sqrt(radius[i] * (before > 0 ? before : 0));
			const quern_real kt_before = shear * root_before;
			const quern_real one_over = kt > 0 ? 1 / (kt > 0 ? kt : 1) : 0;
			const quern_real shrink = root < root_before ? root / (root_before > 0 ? root_before : 1) : 1;
			const quern_real stiffness = 0.5 * (kt + kt_before),
							 shear_damping = loss_t * loss * quern_dashpot_share(turning * kt, mass[i], lag);
			quern_vec was, now, drag;
			if (dim == 3) was = QUERN_VEC_AT(history, i, 3);
			else was = (quern_vec) { -n.y * history[0][i], n.x * history[0][i], 0 };
			const quern_vec trial =
				quern_vec_axpy(onset.time * stiffness, mean_t, quern_vec_scale(shrink, was));
			const quern_vec g = quern_vec_scale(shear_damping, vt);
			const quern_cone cone = quern_cone_shares(trial, g, law.friction * fn);
			now = quern_vec_scale(d > 0 ? cone.spring : 0, trial);
			drag = quern_vec_scale(d > 0 ? cone.damper : 0, g);
			if (dim == 3) QUERN_VEC_PUT(history, i, now, 3);
			else history[0][i] = n.x * now.y - n.y * now.x;
			f = quern_vec_sub(f, quern_vec_add(now, drag));
			viscous = quern_vec_sub(viscous, drag);
			sheared = 0.5 * quern_vec_dot(now, now, 3) * one_over;
			const quern_real held =
				0.5 * quern_vec_dot(was, was, 3) * (kt_before > 0 ? 1 / (kt_before > 0 ? kt_before : 1) : 0);
			const quern_real work = 0.5 * onset.time * quern_vec_dot(quern_vec_add(was, now), mean_t, 3);
			rubbed = work + held - sheared;
		}
		b->force[0][i] += f.x;
		b->force[1][i] += f.y;
		if (dim == 3) b->force[2][i] += f.z;
		if (energy) {
			b->dashpot[0][i] += viscous.x;
			b->dashpot[1][i] += viscous.y;
			if (dim == 3) b->dashpot[2][i] += viscous.z;
			b->rubbed[i] += rubbed;
		}
		if (energy == QUERN_ALL_ENERGY) {
			b->stored[i] += 0.4 * elastic * d;
			b->sheared[i] += sheared;
		}
	}
}

QUERN_INLINE void force(const int dim, const void *self, const quern_contact_batch *b) {
	QUERN_CALL_LAW(kernel, dim, ((const hertz *)self)->friction > 0, self, b);
}
static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }
static void force_3d(const void *self, const quern_contact_batch *b) { force(3, self, b); }

/* The tangential mode is the faster one if k_t / k_n, the same along the whole contact, makes it so. */
static quern_real period(const void *self, uint32_t dim, quern_real mass, quern_real radius) {
	const hertz *law = self;
	const quern_real contact =
		2.8683 * quern_pow(mass * mass / (radius * law->modulus * law->modulus * law->impact_speed), 0.2);
	const quern_real turning = law->friction > 0 ? turning_of(dim) * 4 * law->shear / law->modulus : 0;
	return contact / __builtin_sqrt(turning > 1 ? turning : 1);
}

/* sqrt 5 zeta sqrt(m k) d^(1/4) over 2 sqrt(m k_n), k_n = (3/2) k sqrt d; and 2 sqrt(5/6) zeta sqrt(k_t m) over 2
 * sqrt(m k_t), on m/3 or m/3.5. */
static quern_real damping(const void *self, uint32_t dim) {
	const hertz *law = self;
	const quern_real share = 0.91287092917527686 * law->damping_ratio; /* sqrt(5/6) */
	return share * (law->friction > 0 ? __builtin_sqrt(turning_of(dim)) : 1);
}

/* dF/dd of F = k d^(3/2) at F = at_force: (3/2) k^(2/3) F^(1/3) */
static quern_real stiffness(const void *self, uint32_t dim, quern_real radius, quern_real at_force) {
	const hertz *law = self;
	(void)dim;
	const quern_real k = 4.0 / 3 * law->modulus * __builtin_sqrt(radius);
	return 1.5 * quern_cbrt(k * k * at_force);
}

static const quern_contact_ops ops = { .size = sizeof ops,
	.force = { force_2d, force_3d },
	.period = period,
	.stiffness = stiffness,
	.damping = damping,
	.means = 1 };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "contact.hertz",
	.brief = "Hertz and Mindlin, from material constants.",
	.doc = "Restitution does not depend on speed. In 2-D it is the sphere's law per metre of slab.",
	.cite = "Hertz 1882; Mindlin & Deresiewicz 1953; Tsuji et al. 1992",
	.instance_size = sizeof(hertz),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
