/* SPDX-License-Identifier: MIT */
/* held - what an elastic stress holds */
#pragma once
#include "symmetric.h"
#include <math.h>

/* J/m^3: p^2/2K + s:s/4G, of small strains. */
QUERN_INLINE quern_real held_by_stress(symmetric t, uint32_t dim, quern_real bulk, quern_real shear) {
	const quern_real p = -(t.xx + t.yy + t.zz) / dim;
	const quern_real all =
		t.xx * t.xx + t.yy * t.yy + t.zz * t.zz + 2 * (t.xy * t.xy + t.yz * t.yz + t.xz * t.xz);
	const quern_real deviator = fmax(all - dim * p * p, 0);
	return 0.5 * p * p / bulk + (shear > 0 ? 0.25 * deviator / shear : 0);
}
