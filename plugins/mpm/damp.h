/* SPDX-License-Identifier: MIT */
/* damp - dashpots beside the elastic stress, so that waves die as they do in grains. docs/theory/mpm.md, section 1 */
#pragma once
#include "../common/rotation.h"
#include <quern/grid.h>

/* W s - s W with the spin W of the gradient l: what a stress gains that turns with the material. */
QUERN_INLINE symmetric damp_turned(const int dim, symmetric s, tensor l) {
	const quern_real xy = 0.5 * (l.xy - l.yx), xz = dim == 3 ? 0.5 * (l.xz - l.zx) : 0,
					 yz = dim == 3 ? 0.5 * (l.yz - l.zy) : 0;
	return (symmetric) { 2 * (xy * s.xy + xz * s.xz), 2 * (yz * s.yz - xy * s.xy),
		-2 * (xz * s.xz + yz * s.yz), xy * (s.yy - s.xx) + xz * s.yz + yz * s.xz,
		yz * (s.zz - s.yy) - xy * s.xz - xz * s.xy, xz * (s.zz - s.xx) + xy * s.yz - yz * s.xy };
}

/* T/dt times what the stresses of n points have gained without their rotation, no larger than the stress itself: what is open, or
 * opens, has none. */
QUERN_INLINE void damp_chunk(const int dim, quern_real *const old[6], quern_real *const new[6],
	quern_real *const gradient[9], uint32_t n, quern_real dt, quern_real time, quern_real *const out[6]) {
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		const symmetric was = SYMMETRIC_AT(old, i, dim), is = SYMMETRIC_AT(new, i, dim),
						turned = damp_turned(dim, was, TENSOR_AT(gradient, i, dim));
		const quern_real f = time / dt;
		const symmetric gain = { f * (is.xx - was.xx - dt * turned.xx), f * (is.yy - was.yy - dt * turned.yy),
			dim == 3 ? f * (is.zz - was.zz - dt * turned.zz) : 0, f * (is.xy - was.xy - dt * turned.xy),
			dim == 3 ? f * (is.yz - was.yz - dt * turned.yz) : 0,
			dim == 3 ? f * (is.xz - was.xz - dt * turned.xz) : 0 };
		const quern_real there = symmetric_half_square(dim, is), size = symmetric_half_square(dim, gain),
						 part = size > there ? __builtin_sqrt(there / size) : 1;
		const symmetric damped = symmetric_scale_shift(dim, part, gain, 0);
		SYMMETRIC_PUT(out, i, damped, dim);
	}
}
