/* SPDX-License-Identifier: MIT */
/* material.drucker_prager - hyperelastic up to a Coulomb-like yield stress, flow without change of volume, no
 * tension. docs/theory/materials.md, section 4
 *
 * What is kept is small where strains are, J - 1 and the stress, whose deviator is G/J times dev b of the isochoric strain b, so that
 * the yield stress is met to round-off at any pressure; b = dev b + t I follows from det b = 1. */
#include "../common/rotation.h"
#include <quern/material.h>
#include <quern/math.h>

typedef struct {
	quern_real bulk_modulus, poisson, friction, density; /* from the scene */
	quern_real shear;                                    /* G */
} drucker_prager;

static const quern_param params[] = { QUERN_PARAM(drucker_prager, bulk_modulus, "Pa",
										  "Bulk modulus K; in 2-D lambda + G.", .from = "grain.bulk_modulus",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e15),
	QUERN_PARAM(drucker_prager, poisson, "1", "Poisson's ratio; sets the shear modulus.", .def = 0.3,
		.min = -0.9, .max = 0.49),
	QUERN_PARAM(drucker_prager, friction, "1", "mu, largest shear stress over pressure.", .def = 0.3819,
		.planar = 0.26, .flags = QUERN_PLANAR, .max = 10),
	QUERN_PARAM(drucker_prager, density, "kg/m^3", "rho_0, below which the material is open.",
		.from = "grain.critical_density", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_END_PARAMS };

/* clang-format off */
#define USES(X) \
	X(VOLUME, "point.volume_strain", "1", QUERN_UPDATE, QUERN_SCALAR, .rule = QUERN_MEANS, \
		.doc = "J - 1, elastic; positive while the point is open.") \
	X(ASSIGNED_VOLUME, "point.volume_strain", "1", QUERN_WRITE, QUERN_SCALAR, .hook = QUERN_MATERIAL_ASSIGN, \
		.doc = "From stress.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	drucker_prager *law = self;
	(void)err;
	law->shear = shear_modulus(setup->dim, law->bulk_modulus, law->poisson);
	return QUERN_OK;
}

QUERN_INLINE quern_real symmetric_determinant(symmetric s) {
	return s.xx * (s.yy * s.zz - s.yz * s.yz) - s.xy * (s.xy * s.zz - s.yz * s.xz) +
		   s.xz * (s.xy * s.yz - s.yy * s.xz);
}

/* One step of Halley's method on f(y) = (1 + y)^3 - q (1 + y) + det - 1 = 0, with 1 - 1 taken out: y - f f'/(f'^2 - f f''/2) */
QUERN_INLINE quern_real excess_step(quern_real y, quern_real q, quern_real det) {
	const quern_real t = 1 + y, value = y * (3 + y * (3 + y)) - (q * t - det), slope = 3 * t * t - q;
	return y - value * slope / (slope * slope - 3 * value * t);
}

/* t - 1 of det(s + t I) = 1 for a deviator s, q = s:s/2. In 3-D it is the largest root that makes s + t I positive:
 * with r^2 = q/3 it lies between r, beyond which the cubic rises, and sqrt(1 + 4 r^2). Steps from above are monotone; three
 * are enough for any r below 1/2, four up to 1, and with r = 2 they leave 2e-12. */
QUERN_INLINE quern_real isochoric_excess(const int dim, symmetric s) {
	const quern_real q = symmetric_half_square(dim, s);
	if (dim == 2) return q / (1 + __builtin_sqrt(1 + q));
	const quern_real det = symmetric_determinant(s), above = 4.0 / 3 * q;
	quern_real y = above / (1 + __builtin_sqrt(1 + above));
	y = excess_step(excess_step(y, q, det), q, det);
	return excess_step(excess_step(y, q, det), q, det);
}

/* t, where only the sum of s and t I is asked for */
QUERN_INLINE quern_real isochoric_mean(const int dim, symmetric s) {
	return dim == 2 ? __builtin_sqrt(1 + symmetric_half_square(dim, s)) : 1 + isochoric_excess(dim, s);
}

/* det(1 + A) - 1 */
QUERN_INLINE quern_real volume_change(const int dim, tensor a) {
	const quern_real plane = a.xx * a.yy - a.xy * a.yx;
	if (dim == 2) return (a.xx + a.yy) + plane;
	const quern_real yz = a.yy * a.zz - a.yz * a.zy, xz = a.xx * a.zz - a.xz * a.zx;
	const quern_real det =
		a.xx * yz - a.xy * (a.yx * a.zz - a.yz * a.zx) + a.xz * (a.yx * a.zy - a.yy * a.zx);
	return (a.xx + a.yy + a.zz) + ((plane + yz + xz) + det);
}

/* (J^2 - 1)/2 - ln J at J = 1 + e. With s = e/(2 + e), ln J = 2 (s + s^3/3 + s^5/5 + ...) and e - 2 s = e s. */
QUERN_INLINE quern_real volume_energy(quern_real e) {
	const quern_real s = e / (2 + e), z = s * s;
	const quern_real series =
		quern_horner(z, 1.0 / 3, 1.0 / 5, 1.0 / 7, quern_horner(z, 1.0 / 9, 1.0 / 11, 1.0 / 13, 0));
	const quern_real near = e * s + 0.5 * e * e - 2 * s * z * series;
	const quern_real far = e + 0.5 * e * e - quern_log(1 + e);
	return quern_abs(e) < 0.125 ? near : far;
}

/* dev b of the isochoric strain, from what is kept: J/G dev sigma */
QUERN_INLINE symmetric isochoric_deviator(
	const int dim, symmetric stress, quern_real e, quern_real softness) {
	return symmetric_scale_shift(dim, (1 + e) * softness, symmetric_deviator(dim, stress), 0);
}

/* W = K/2 ((J^2 - 1)/2 - ln J) + G/2 (tr b - d), of a unit of volume without stress */
QUERN_INLINE void put_outputs(const int dim, const drucker_prager *law, const quern_real *restrict strain,
	const quern_material_batch *b) {
	put_wave_speeds(dim, law->bulk_modulus, law->shear, law->density, b);
	const quern_real bulk = 0.5 * law->bulk_modulus / law->density,
					 shear = 0.5 * dim * law->shear / law->density;
	const quern_real softness = 1 / law->shear;
	quern_real *restrict energy = b->energy;
	if (!energy) return;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const symmetric s = isochoric_deviator(dim, SYMMETRIC_AT(b->stress, i, dim), strain[i], softness);
		const quern_real e = strain[i] < 0 ? strain[i] : 0;
		energy[i] = bulk * volume_energy(e) + shear * isochoric_excess(dim, s);
	}
}

QUERN_INLINE void update(const int dim, const void *self, const quern_material_batch *b) {
	const drucker_prager law = *(const drucker_prager *)self;
	const quern_real dt = b->dt, shear = law.shear, softness = 1 / shear, half_bulk = 0.5 * law.bulk_modulus,
					 full = law.density;
	const quern_real *restrict grid_density = b->grid_density;
	quern_real *restrict strain = b->use[VOLUME].real[0], *restrict density = b->density;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		/* f = 1 + A; J* = J det f, b* = f b f^T/det(f)^(2/d) */
		const tensor l = TENSOR_AT(b->gradient, i, dim);
		const tensor a = { dt * l.xx, dt * l.xy, dt * l.xz, dt * l.yx, dt * l.yy, dt * l.yz, dt * l.zx,
			dt * l.zy, dt * l.zz };
		const symmetric was = isochoric_deviator(dim, SYMMETRIC_AT(b->stress, i, dim), strain[i], softness);
		const quern_real change = volume_change(dim, a);
		const symmetric whole = symmetric_scale_shift(dim, 1, was, isochoric_mean(dim, was));
		const quern_real edge = dim == 2 ? 1 : quern_cbrt(1 + change);
		const quern_real wide = dim == 2 ? 1 + change : edge * edge;
		const symmetric trial = symmetric_deviator(dim, pushed(dim, was, whole, a));
		const quern_real e = strain[i] + (1 + strain[i]) * change;
		/* Kirchhoff: p = K/2 (1 - J^2), tau = G sqrt(s:s/2) <= mu p */
		const quern_real p = -half_bulk * e * (2 + e), limit = law.friction * p;
		/* the part of the trial that is left, 1/wide, or limit/tau of that: one quotient */
		const quern_real wide_tau = shear * __builtin_sqrt(symmetric_half_square(dim, trial));
		const bool open = e > 0, yields = wide_tau > limit * wide;
		const quern_real left = (yields ? limit : 1) / (yields ? wide_tau : wide);
		const symmetric back = symmetric_scale_shift(dim, left, trial, 0);
		const symmetric now = symmetric_select(open, (symmetric) { 0, 0, 0, 0, 0, 0 }, back);
		/* an open point's volume is the grid's: J = max(1, rho_0/rho_g) */
		const quern_real rho = grid_density[i], loose = rho < full ? rho : full;
		const quern_real quotient = (open ? full - loose : 1) / (open ? loose : 1 + e);
		strain[i] = open ? quotient : e;
		density[i] = open ? loose : density[i];
		const quern_real one_over_j = open ? 0 : quotient;
		const symmetric stress = symmetric_scale_shift(dim, shear * one_over_j, now, -p * one_over_j);
		SYMMETRIC_PUT(b->stress, i, stress, dim);
	}
	put_outputs(dim, &law, strain, b);
}
static void update_2d(const void *self, const quern_material_batch *b) { update(2, self, b); }
static void update_3d(const void *self, const quern_material_batch *b) { update(3, self, b); }

/* tr sigma/d = K/2 (J - 1/J), dev sigma = G/J dev b */
QUERN_INLINE void assign(const int dim, const void *self, const quern_material_batch *b) {
	const drucker_prager law = *(const drucker_prager *)self;
	const quern_real softness = 1 / law.bulk_modulus;
	quern_real *restrict strain = b->use[ASSIGNED_VOLUME].real[0], *restrict density = b->density;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const symmetric given = SYMMETRIC_AT(b->stress, i, dim), s = symmetric_deviator(dim, given);
		const quern_real p = -symmetric_mean(dim, given), limit = law.friction * p;
		const quern_real tau = __builtin_sqrt(symmetric_half_square(dim, s));
		const bool pressed = p > 0;
		const quern_real share = pressed ? tau > limit ? limit / tau : 1 : 0;
		const quern_real kept = pressed ? p : 0, x = kept * softness;
		const quern_real e = x * x / (1 + __builtin_sqrt(1 + x * x)) - x; /* J = sqrt(1 + x^2) - x */
		const symmetric stress = symmetric_scale_shift(dim, share, s, -kept);
		SYMMETRIC_PUT(b->stress, i, stress, dim);
		strain[i] = e;
		density[i] = law.density / (1 + e);
	}
	put_outputs(dim, &law, strain, b);
}
static void assign_2d(const void *self, const quern_material_batch *b) { assign(2, self, b); }
static void assign_3d(const void *self, const quern_material_batch *b) { assign(3, self, b); }

static void moduli(const void *self, uint32_t dim, quern_real *bulk, quern_real *shear, quern_real *density) {
	const drucker_prager *law = self;
	(void)dim;
	*bulk = law->bulk_modulus;
	*shear = law->shear;
	*density = law->density;
}

static void friction(const void *self, uint32_t dim, quern_real *slow, quern_real *fast, quern_real *number,
	quern_real *density) {
	const drucker_prager *law = self;
	(void)dim;
	*slow = *fast = law->friction;
	*number = 0;
	*density = law->density;
}

static const quern_material_ops ops = { .size = sizeof ops,
	.update = { update_2d, update_3d },
	.assign = { assign_2d, assign_3d },
	.moduli = moduli,
	.friction = friction };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 4,
	.dims = QUERN_2D | QUERN_3D,
	.id = "material.drucker_prager",
	.brief = "Hyperelastic with Drucker and Prager's yield stress, one friction for every rate.",
	.doc =
		"Stress follows from a stored energy, for strains of any size. The yield stress is friction times "
		"pressure, and flow keeps the volume. Stretched beyond its density without stress a point is open: "
		"it carries nothing, and takes its volume from the grid until it is dense again.",
	.cite = "Yue et al. 2018; Simo 1992",
	.instance_size = sizeof(drucker_prager),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
