/* SPDX-License-Identifier: MIT */
/* contact.linear - spring and dashpot, with a tangential spring and dashpot under a Coulomb cone.
 * docs/theory/contacts.md, section 2. Start here to write a law of your own. */
#include <quern/contact.h>

typedef struct {
	quern_real stiffness, restitution, friction, tangential_stiffness,
		tangential_damping; /* from the scene */
	quern_real loss;        /* gamma_n = loss sqrt(k m) */
} linear;

static const quern_param params[] = { QUERN_PARAM(linear, stiffness, "N/m", "Normal spring k_n.",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e15),
	QUERN_PARAM(linear, restitution, "1", "Normal restitution of a pair, exact for any masses.", .def = 0.5,
		.min = 0.01, .max = 1),
	QUERN_PARAM(linear, friction, "1", "Coulomb coefficient; 0: no slip, no spin.", .def = 0.5, .max = 10),
	QUERN_PARAM(linear, tangential_stiffness, "1", "k_t / k_n; the default gives both directions one period.",
		.def = 2.0 / 7, .planar = 1.0 / 3, .flags = QUERN_PLANAR | QUERN_MIN_OPEN, .max = 10),
	QUERN_PARAM(linear, tangential_damping, "1", "gamma_t / gamma_n.", .def = 2.0 / 7, .planar = 1.0 / 3,
		.flags = QUERN_PLANAR, .max = 10),
	QUERN_END_PARAMS };

enum { SLIP, SPIN };
static const quern_use uses[] = { { .field = "contact.slip",
									  .unit = "m",
									  .doc = "Tangential spring; 2-D: along the normal turned left.",
									  .access = QUERN_UPDATE,
									  .shape = QUERN_AXIAL,
									  .when = "friction" },
	{ .field = "grain.spin",
		.unit = "rad/s",
		.doc = "Angular velocity; a frictional contact turns its grains.",
		.access = QUERN_READ,
		.shape = QUERN_AXIAL,
		.flags = QUERN_OTHERS | QUERN_EXISTS,
		.when = "friction" },
	QUERN_END_USES };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	linear *law = self;
	(void)setup, (void)err;
	law->loss = 2 * quern_damping_ratio(law->restitution);
	return QUERN_OK;
}

/* Grains that roll as they are pushed along make a tangential spring act on m/3 (discs) or m/3.5 (spheres). */
QUERN_INLINE quern_real turning_of(uint32_t dim) { return dim == 2 ? 3 : 3.5; }

/* `dim`, `rough`, `energy` and `late` are constants in every caller, so dead branches vanish and names stay in the debugger. */
QUERN_INLINE void springs(const int dim, const bool rough, const int energy, const bool late,
	const linear *self, const quern_contact_batch *b) {
	const linear law = *self;
	const quern_real dt = b->dt, kn = law.stiffness, kt = law.tangential_stiffness * kn, one_over_kt = 1 / kt;
	const quern_real lag = b->lag, tangential = law.tangential_damping, turning = turning_of((uint32_t)dim);
	const quern_real *restrict overlap = b->overlap, *restrict mass = b->mass;
	quern_real *const *slip = rough ? b->use[SLIP].real : NULL;
	if (rough && dim == 3) QUERN_TURN_SPRINGS(slip, b);
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec n = QUERN_VEC_AT(b->normal, i, dim), v = QUERN_VEC_AT(b->velocity, i, dim),
						mean = QUERN_VEC_AT(b->mean_velocity, i, dim);
		const quern_real d = overlap[i], vn = quern_vec_dot(v, n, dim), mean_n = quern_vec_dot(mean, n, dim);
		const bool touching = d > 0;
		const quern_onset onset = quern_first_touch(d, -mean_n, dt, 0);
		const quern_real loss = law.loss * __builtin_sqrt(kn * mass[i]) * onset.weight;
		const quern_real share = late ? quern_dashpot_share(kn, mass[i], lag) : 1,
						 shear_share = late ? quern_dashpot_share(turning * kt, mass[i], lag) : 1;
		const quern_real damping = loss * share, shear_damping = tangential * loss * shear_share;
		/* f_n = max(0, k_n d - gamma_n v_n) */
		const quern_real pushed = kn * d - damping * vn, fn = (touching & (pushed > 0)) ? pushed : 0;
		quern_vec f = quern_vec_scale(fn, n), viscous = quern_vec_scale(fn - (touching ? kn * d : 0), n);
		quern_real sheared = 0, rubbed = 0;
		if (rough && dim == 3) {
			/* xi' = v_t in the tangent plane; |k_t s xi + gamma_t v_t| = mu f_n */
			const quern_vec vt = quern_vec_axpy(-vn, n, v), mean_t = quern_vec_axpy(-mean_n, n, mean);
			const quern_vec was = QUERN_VEC_AT(slip, i, 3);
			const quern_vec trial = quern_vec_axpy(onset.time, mean_t, was);
			const quern_vec a = quern_vec_scale(kt, trial), g = quern_vec_scale(shear_damping, vt);
			const quern_cone cone = quern_cone_shares(a, g, law.friction * fn);
			const quern_vec now = quern_vec_scale(touching ? cone.spring : 0, trial);
			const quern_vec drag = quern_vec_scale(touching ? cone.damper : 0, g);
			QUERN_VEC_PUT(slip, i, now, 3);
			f = quern_vec_sub(f, quern_vec_axpy(kt, now, drag));
			viscous = quern_vec_sub(viscous, drag);
			sheared = 0.5 * kt * quern_vec_dot(now, now, 3);
			const quern_vec slid = quern_vec_sub(trial, now);
			rubbed = 0.5 * kt * quern_vec_dot(quern_vec_add(was, now), slid, 3);
		}
		if (rough && dim == 2) { /* the same along the one tangent (-n_y, n_x) */
			const quern_real vt = n.x * v.y - n.y * v.x, was = slip[0][i];
			const quern_real trial = was + onset.time * (n.x * mean.y - n.y * mean.x);
			quern_real spring;
			const quern_real total =
				quern_cone_planar(kt * trial, shear_damping * vt, law.friction * fn, &spring);
			const quern_real now = touching ? spring * one_over_kt : 0, ft = touching ? total : 0;
			slip[0][i] = now;
			f.x += ft * n.y;
			f.y -= ft * n.x;
			viscous.x += (ft - kt * now) * n.y;
			viscous.y -= (ft - kt * now) * n.x;
			sheared = 0.5 * kt * now * now;
			rubbed = 0.5 * kt * (was + now) * (trial - now);
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
			b->stored[i] += touching ? 0.5 * kn * d * d : 0;
			b->sheared[i] += sheared;
		}
	}
}

/* Where nothing is late both shares are 1, and two divisions less are made. */
QUERN_INLINE void kernel(
	const int dim, const bool rough, const int energy, const linear *self, const quern_contact_batch *b) {
	if (b->lag > 0) springs(dim, rough, energy, true, self, b);
	else springs(dim, rough, energy, false, self, b);
}
QUERN_INLINE void force(const int dim, const void *self, const quern_contact_batch *b) {
	QUERN_CALL_LAW(kernel, dim, ((const linear *)self)->friction > 0, self, b);
}
static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }
static void force_3d(const void *self, const quern_contact_batch *b) { force(3, self, b); }

/* pi/omega of the stiffest mode */
static quern_real period(const void *self, uint32_t dim, quern_real mass, quern_real radius) {
	const linear *law = self;
	(void)radius;
	const quern_real turning = law->friction > 0 ? turning_of(dim) * law->tangential_stiffness : 0;
	return 3.14159265358979312 * __builtin_sqrt(mass / (law->stiffness * (turning > 1 ? turning : 1)));
}

/* Of the normal mode, and of the tangential one. */
static quern_real damping(const void *self, uint32_t dim) {
	const linear *law = self;
	const quern_real share =
		law->tangential_damping * __builtin_sqrt(turning_of(dim) / law->tangential_stiffness);
	return 0.5 * law->loss * (law->friction > 0 && share > 1 ? share : 1);
}

static quern_real stiffness(const void *self, uint32_t dim, quern_real radius, quern_real at_force) {
	(void)dim, (void)radius, (void)at_force;
	return ((const linear *)self)->stiffness;
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
	.id = "contact.linear",
	.brief = "Linear spring and dashpot with Coulomb friction.",
	.doc = "The normal force is never attractive, and the restitution asked for is the one that is found, "
		   "for any "
		   "pair of masses.",
	.cite = "Cundall & Strack 1979; Schwager & Poeschel 2007",
	.instance_size = sizeof(linear),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
