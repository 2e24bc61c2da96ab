/* SPDX-License-Identifier: MIT */
/* rotation - what is done with symmetric tensors, and a stress carried along with the material: what the materials
 * share. `dim` is a constant in every caller. docs/theory/materials.md, 1 and 2 */
#pragma once
#include "symmetric.h"
#include <quern/material.h>

typedef struct tensor {
	quern_real xx, xy, xz, yx, yy, yz, zx, zy, zz;
} tensor;

/* Entry i of TENSOR columns; a macro for the reason given in quern/vec.h. */
#define TENSOR_AT(columns, i, dim)                                                                           \
	((tensor) { (columns)[0][i], (columns)[1][i], (dim) == 3 ? (columns)[2][i] : 0, (columns)[dim][i],       \
		(columns)[(dim) + 1][i], (dim) == 3 ? (columns)[5][i] : 0, (dim) == 3 ? (columns)[6][i] : 0,         \
		(dim) == 3 ? (columns)[7][i] : 0, (dim) == 3 ? (columns)[8][i] : 0 })

/* wanted ? a : b */
QUERN_INLINE symmetric symmetric_select(bool wanted, symmetric a, symmetric b) {
	return (symmetric) { wanted ? a.xx : b.xx, wanted ? a.yy : b.yy, wanted ? a.zz : b.zz,
		wanted ? a.xy : b.xy, wanted ? a.yz : b.yz, wanted ? a.xz : b.xz };
}
/* f s + g I */
QUERN_INLINE symmetric symmetric_scale_shift(int dim, quern_real f, symmetric s, quern_real g) {
	return (
		symmetric) { f * s.xx + g, f * s.yy + g, dim == 3 ? f * s.zz + g : 0, f * s.xy, f * s.yz, f * s.xz };
}
QUERN_INLINE quern_real symmetric_mean(int dim, symmetric s) {
	return dim == 3 ? (s.xx + s.yy + s.zz) * (1.0 / 3) : (s.xx + s.yy) * 0.5;
}
QUERN_INLINE symmetric symmetric_deviator(int dim, symmetric s) {
	const quern_real mean = symmetric_mean(dim, s);
	return (symmetric) { s.xx - mean, s.yy - mean, dim == 3 ? s.zz - mean : 0, s.xy, s.yz, s.xz };
}
/* s:s/2; its root is the equivalent shear stress of a deviator */
QUERN_INLINE quern_real symmetric_half_square(int dim, symmetric s) {
	const quern_real plane = 0.5 * (s.xx * s.xx + s.yy * s.yy) + s.xy * s.xy;
	return dim == 3 ? plane + 0.5 * s.zz * s.zz + s.yz * s.yz + s.xz * s.xz : plane;
}

/* (1 + E) (s + t I) (1 + E)^T - t I, given s and `whole` = s + t I: what is small stays exact beside t. */
QUERN_INLINE symmetric pushed(int dim, symmetric s, symmetric whole, tensor e) {
	const symmetric w = whole;
	if (dim == 2) {
		const quern_real xx = e.xx * w.xx + e.xy * w.xy, xy = e.xx * w.xy + e.xy * w.yy;
		const quern_real yx = e.yx * w.xx + e.yy * w.xy, yy = e.yx * w.xy + e.yy * w.yy;
		return (symmetric) { s.xx + (2 * xx + (xx * e.xx + xy * e.xy)),
			s.yy + (2 * yy + (yx * e.yx + yy * e.yy)), 0, s.xy + ((xy + yx) + (xx * e.yx + xy * e.yy)), 0,
			0 };
	}
	const tensor m = { e.xx * w.xx + e.xy * w.xy + e.xz * w.xz, e.xx * w.xy + e.xy * w.yy + e.xz * w.yz,
		e.xx * w.xz + e.xy * w.yz + e.xz * w.zz, e.yx * w.xx + e.yy * w.xy + e.yz * w.xz,
		e.yx * w.xy + e.yy * w.yy + e.yz * w.yz, e.yx * w.xz + e.yy * w.yz + e.yz * w.zz,
		e.zx * w.xx + e.zy * w.xy + e.zz * w.xz, e.zx * w.xy + e.zy * w.yy + e.zz * w.yz,
		e.zx * w.xz + e.zy * w.yz + e.zz * w.zz };
	return (symmetric) { s.xx + (2 * m.xx + (m.xx * e.xx + m.xy * e.xy + m.xz * e.xz)),
		s.yy + (2 * m.yy + (m.yx * e.yx + m.yy * e.yy + m.yz * e.yz)),
		s.zz + (2 * m.zz + (m.zx * e.zx + m.zy * e.zy + m.zz * e.zz)),
		s.xy + ((m.xy + m.yx) + (m.xx * e.yx + m.xy * e.yy + m.xz * e.yz)),
		s.yz + ((m.yz + m.zy) + (m.yx * e.zx + m.yy * e.zy + m.yz * e.zz)),
		s.xz + ((m.xz + m.zx) + (m.xx * e.zx + m.xy * e.zy + m.xz * e.zz)) };
}

/* R s R^T with R = (1 - dt W/2)^-1 (1 + dt W/2), W = (L - L^T)/2: orthogonal for any step. By way of R - 1, so that
 * what rounding does to a small turn is small too, and no turn leaves the bits alone. */
QUERN_INLINE symmetric rotated(int dim, symmetric s, tensor l, quern_real dt) {
	const quern_real quarter = 0.25 * dt, az = quarter * (l.yx - l.xy);
	if (dim == 2) { /* by twice the angle: xx and yy change by opposite amounts */
		const quern_real sine = 2 * az / (1 + az * az), cosine = 1 - sine * az;
		const quern_real half = 0.5 * (s.xx - s.yy);
		const quern_real change = -2 * sine * (cosine * s.xy + sine * half);
		const quern_real shear = 2 * sine * (cosine * half - sine * s.xy);
		return (symmetric) { s.xx + change, s.yy - change, 0, s.xy + shear, 0, 0 };
	}
	const quern_real ax = quarter * (l.zy - l.yz), ay = quarter * (l.xz - l.zx);
	/* R - 1 = 2 (A + A^2)/(1 + a.a), where A x = a cross x */
	const quern_real k = 2 / (1 + (ax * ax + ay * ay + az * az));
	const quern_real kx = k * ax, ky = k * ay, kz = k * az, xy = kx * ay, yz = ky * az, xz = kx * az;
	const quern_real xx = kx * ax, yy = ky * ay, zz = kz * az;
	const tensor e = { -(yy + zz), xy - kz, xz + ky, xy + kz, -(xx + zz), yz - kx, xz - ky, yz + kx,
		-(xx + yy) };
	return pushed(3, s, symmetric_deviator(3, s), e); /* R (p I) R^T = p I */
}

/* The elastic trial R s R^T + dt (2 G D + lambda tr(D) I), D = (L + L^T)/2 */
QUERN_INLINE symmetric elastic_trial(
	int dim, symmetric s, tensor l, quern_real dt, quern_real shear, quern_real lambda) {
	const symmetric r = rotated(dim, s, l, dt);
	const quern_real g = dt * shear, g2 = 2 * g,
					 volume = dt * lambda * (dim == 3 ? l.xx + l.yy + l.zz : l.xx + l.yy);
	return (symmetric) { r.xx + (g2 * l.xx + volume), r.yy + (g2 * l.yy + volume),
		dim == 3 ? r.zz + (g2 * l.zz + volume) : 0, r.xy + g * (l.xy + l.yx),
		dim == 3 ? r.yz + g * (l.yz + l.zy) : 0, dim == 3 ? r.xz + g * (l.xz + l.zx) : 0 };
}

/* G from K and Poisson's ratio; in 2-D that of a plane world: nu < 1 and K = lambda + G */
QUERN_INLINE quern_real shear_modulus(uint32_t dim, quern_real bulk, quern_real poisson) {
	return dim == 2 ? bulk * (1 - poisson) / (1 + poisson) : 1.5 * bulk * (1 - 2 * poisson) / (1 + poisson);
}

/* c = sqrt((K + 2 (d - 1)/d G)/rho), where rho counts at least `least`: an open point must not shorten the step */
QUERN_INLINE void put_wave_speeds(
	int dim, quern_real bulk, quern_real shear, quern_real least, const quern_material_batch *b) {
	const quern_real modulus = bulk + 2 * (dim - 1) / (quern_real)dim * shear;
	const quern_real *restrict density = b->density;
	quern_real *restrict speed = b->wave_speed;
	if (!speed) return;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++)
		speed[i] = __builtin_sqrt(modulus / (density[i] > least ? density[i] : least));
}

/* J/m^3 that a stress holds, of small strains: p^2/2K + tau^2/2G; `softness` 1/2K, `shear_softness` 1/2G */
QUERN_INLINE quern_real symmetric_held(int dim, quern_real softness, quern_real shear_softness, symmetric s) {
	const quern_real mean = symmetric_mean(dim, s);
	return softness * mean * mean + shear_softness * symmetric_half_square(dim, symmetric_deviator(dim, s));
}

/* What a hypoelastic stress stores */
QUERN_INLINE void put_hypoelastic_energies(
	int dim, quern_real bulk, quern_real shear, const quern_material_batch *b) {
	const quern_real softness = 0.5 / bulk, shear_softness = 0.5 / shear;
	const quern_real *restrict density = b->density;
	quern_real *restrict energy = b->energy;
	if (!energy) return;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++)
		energy[i] =
			symmetric_held(dim, softness, shear_softness, SYMMETRIC_AT(b->stress, i, dim)) / density[i];
}
