/* SPDX-License-Identifier: MIT */
/* rough - Coulomb's law at a rough body, whose friction grows with the speed of sliding as that of the material grows with
 * the rate of shear. docs/theory/mpm.md, section 3 */
#pragma once
#include <math.h>
#include <quern/abi.h>

typedef struct rough_law {
	quern_real slow, fast, number, density; /* of quern_material_ops.friction */
} rough_law;

/* m/s, the speed at which friction is half-way between slow and fast: slip, in diameters, over the inertial time. */
QUERN_INLINE quern_real rough_half(const rough_law *law, quern_real slip, quern_real pressure) {
	return slip * law->number * sqrt(pressure / law->density);
}

/* What is left of a speed along the body after a change of velocity `pressed` towards it, all >= 0: the root s of
 *   s = speed - pressed (slow + (fast - slow) s/(s + half)),
 * by the new speed, so that no step is too long; 0 where slow friction alone holds. */
QUERN_INLINE quern_real rough_slide(
	const rough_law *law, quern_real half, quern_real speed, quern_real pressed) {
	const quern_real free = speed - pressed * law->slow; /* under slow friction alone */
	if (!(free > 0)) return 0;
	const quern_real b = half + pressed * (law->fast - law->slow) - free,
					 root = sqrt(b * b + 4 * free * half);
	return b > 0 ? 2 * free * half / (b + root) : 0.5 * (root - b); /* nothing cancels */
}
