/* SPDX-License-Identifier: MIT */
/* contact.cohesive - bridges of liquid: a pull that begins when two grains touch and ends when they are too far apart. Stands in a list
 * beside a law that pushes. docs/theory/contacts.md, section 6 */
#include <quern/contact.h>

typedef struct {
	quern_real surface_tension, angle, liquid; /* from the scene */
	quern_real pull;                           /* N/m, 2 pi gamma cos theta */
	quern_real rupture;                        /* distance at which a bridge breaks, over R */
	quern_real steep;                          /* sqrt(R^3/V) */
} cohesive;

static const quern_param params[] = { QUERN_PARAM(cohesive, surface_tension, "N/m",
										  "Of the liquid; water has 0.072 N/m.",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e9),
	QUERN_PARAM(
		cohesive, angle, "rad", "At which the liquid meets the grains; 0: wets them all over.", .max = 1.2),
	QUERN_PARAM(cohesive, liquid, "1",
		"Volume of a bridge over R^3, R the harmonic mean of both radii, and twice the radius on a body.",
		.def = 0.01, .min = 1e-6, .max = 0.1),
	QUERN_END_PARAMS };

/* clang-format off */
#define USES(X) \
	X(BRIDGE, "contact.bridge", "1", QUERN_UPDATE, QUERN_SCALAR, .doc = "1: liquid spans the gap.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	cohesive *law = self;
	(void)setup, (void)err;
	law->pull = 2 * 3.14159265358979312 * law->surface_tension * quern_cos(law->angle);
	law->rupture = (1 + 0.5 * law->angle) * quern_cbrt(law->liquid);
	law->steep = 1 / __builtin_sqrt(law->liquid);
	return QUERN_OK;
}

static quern_real reach(const void *self, quern_real radius) {
	return ((const cohesive *)self)->rupture * (2 * radius);
}

/* Angle of the slope t >= 0: that of an eighth of it by a series, whose rest is below 5e-16. */
QUERN_INLINE quern_real angle_of(quern_real t) {
	const quern_real t2 = t / (1 + __builtin_sqrt(1 + t * t)), t4 = t2 / (1 + __builtin_sqrt(1 + t2 * t2)),
					 t8 = t4 / (1 + __builtin_sqrt(1 + t4 * t4)), z = -t8 * t8;
	return 8 * t8 *
		   quern_horner(z, 1, 1.0 / 3, 1.0 / 5,
			   quern_horner(
				   z, 1.0 / 7, 1.0 / 9, 1.0 / 11, quern_horner(z, 1.0 / 13, 1.0 / 15, 1.0 / 17, 1.0 / 19)));
}

/* Integral of 1/(1 + 1.05 s + 2.5 s^2) from s = low to high: the angle between 1.05 + 5 s and the root of 4 2.5 - 1.05^2, twice. */
QUERN_INLINE quern_real integral(quern_real low, quern_real high) {
	const quern_real one_over = 1 / 2.982867747654931; /* of that root */
	const quern_real a = (1.05 + 5 * low) * one_over, b = (1.05 + 5 * high) * one_over;
	return 2 * one_over * angle_of((b - a) / (1 + a * b));
}

/* A pull that jumps acts for the time on its side of the jump: in the first evaluation with liquid, and in the last before it breaks. */
QUERN_INLINE quern_real share_of_step(
	quern_real overlap, quern_real parted, quern_real apart, quern_real left, quern_real dt, bool first) {
	const quern_real way = apart * dt;
	const bool leaves = way > left;
	const quern_real last = 0.5 + left / (leaves ? way : 1);
	/* half a step more than the way of one: a pair that was apart by a rounding has come no farther */
	const bool comes = first & (overlap < 1.5 * -parted * dt);
	const quern_real begun = 0.5 + quern_first_touch(overlap, -parted, dt, 0).time / dt;
	return comes ? begun : leaves ? last : 1;
}

QUERN_INLINE void kernel(
	const int dim, const bool energy, const cohesive *self, const quern_contact_batch *b) {
	const cohesive law = *self;
	const quern_real *restrict overlap = b->overlap, *restrict radius = b->radius;
	quern_real *restrict bridge = b->use[BRIDGE].real[0];
	const quern_real broken = law.rupture * law.steep;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec n = QUERN_VEC_AT(b->normal, i, dim), v = QUERN_VEC_AT(b->velocity, i, dim),
						mean = QUERN_VEC_AT(b->mean_velocity, i, dim);
		const quern_real r = 2 * radius[i], d = overlap[i], gap = d < 0 ? -d : 0;
		const quern_real left = law.rupture * r - gap, was = bridge[i];
		const quern_real there = d > 0 ? 1 : (left > 0 ? was : 0);
		/* f = 2 pi R gamma cos theta/(1 + 1.05 s + 2.5 s^2), s = gap sqrt(R/V) */
		const quern_real s = gap * law.steep / r, full = law.pull * r / (1 + s * (1.05 + 2.5 * s));
		const quern_real weight = share_of_step(
			d, quern_vec_dot(mean, n, dim), quern_vec_dot(v, n, dim), left, b->dt, (d > 0) & (was <= 0));
		const quern_real f = there > 0 ? weight * full : 0; /* what is broken may have any weight */
		bridge[i] = there;
		b->force[0][i] -= f * n.x;
		b->force[1][i] -= f * n.y;
		if (dim == 3) b->force[2][i] -= f * n.z;
		if (energy) { /* nothing where the bridge breaks, so that what it makes of motion when it forms is lost */
			const quern_real scale = law.pull * r * r / law.steep, work = scale * integral(s, broken);
			b->stored[i] -= there * (work + (d > 0 ? full * d : 0));
			b->rubbed[i] += was <= 0 ? there * work : 0;
		}
	}
}

static void force_2d(const void *self, const quern_contact_batch *b) {
	if (b->stored) kernel(2, true, self, b);
	else kernel(2, false, self, b);
}
static void force_3d(const void *self, const quern_contact_batch *b) {
	if (b->stored) kernel(3, true, self, b);
	else kernel(3, false, self, b);
}

/* pi/omega where the pull changes fastest over the gap: 1.224 is the most that d/ds 1/(1 + 1.05 s + 2.5 s^2) comes to. */
static quern_real period(const void *self, uint32_t dim, quern_real mass, quern_real radius) {
	const cohesive *law = self;
	(void)dim, (void)radius;
	return 3.14159265358979312 * __builtin_sqrt(mass / (1.224 * law->pull * law->steep));
}

static const quern_contact_ops ops = {
	.size = sizeof ops, .force = { force_2d, force_3d }, .period = period, .reach = reach, .means = 1
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "contact.cohesive",
	.brief = "Bridges of liquid, which form when grains touch and break when they are too far apart.",
	.doc =
		"A pull alone: it stands in a list beside a law that pushes, such as linear, hertz or plastic. In 2-D it is the sphere's law "
		"per metre of slab.",
	.cite = "Willett et al. 2000; Lian, Thornton & Adams 1993",
	.instance_size = sizeof(cohesive),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
