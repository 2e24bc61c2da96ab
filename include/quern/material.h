/* SPDX-License-Identifier: MIT */
/* quern/material.h - the kind `material`: points in place, once a step, after the grid's velocity; stress is state, also of a
 * hyperelastic law */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { QUERN_MATERIAL_UPDATE, QUERN_MATERIAL_ASSIGN };

typedef struct quern_material_batch {
	uint32_t n, cap;
	quern_real dt;
	const quern_real *gradient[9];  /* 1/s, L row-major dim x dim */
	const quern_real *grid_density; /* kg/m^3, of the mixture at the point, unweighted */
	quern_real *density;    /* kg/m^3, in: true m/V after V *= det(1 + dt L); out: what the point has from now
	                                    on, so that a point that is open can follow grid_density */
	quern_real *stress[6];  /* Pa, Cauchy, tension positive; in and out */
	quern_real *wave_speed; /* m/s, out; NULL if not wanted */
	quern_real *energy;     /* J/kg stored, out; NULL if not wanted */
	const quern_column *use;
	/* since 2.1; NULL: none. Pa, before the step or some steps ago: the mean of the point's cell. Where points lie without order their pressures
	 * scatter by as much as they are, and a friction that is not linear in them comes out too low; 0 where all are open */
	const quern_real *mean_pressure;
} quern_material_batch;

typedef struct quern_material_ops {
	uint32_t size, pad;
	void (*update[2])(const void *self, const quern_material_batch *); /* [batch] hook 0 */
	/* [batch] hook 1: history from stress. Tension is clipped, the stress returned to the yield surface; density comes
	 * out as that of the point under this stress. gradient and grid_density are NULL, dt is 0. */
	void (*assign[2])(const void *self, const quern_material_batch *);
	/* [setup] moduli for step limits (Pa) and the density without stress (kg/m^3) */
	void (*moduli)(const void *self, uint32_t dim, quern_real *bulk, quern_real *shear, quern_real *density);
	/* since 2.1; NULL: none. [setup] shear stress over pressure in steady flow, slow + (fast - slow)/(1 + number/I) with the
	 * inertial number I = rate x diameter x sqrt(density/pressure); density, kg/m^3, is that of a grain, or the
	 * material's own where it knows no grains */
	void (*friction)(const void *self, uint32_t dim, quern_real *slow, quern_real *fast, quern_real *number,
		quern_real *density);
	/* since 2.1; NULL: the density without stress. [setup] kg/m^3, at most that density: what is looser
	 * bears nothing, however it flows. The limit of the step holds down to it */
	quern_real (*loosest)(const void *self);
} quern_material_ops;

QUERN_KIND(material, quern_material_ops, "The stress of a continuum.", QUERN_EACH(quern_material_ops, update),
	QUERN_EACH(quern_material_ops, assign), QUERN_ONE(quern_material_ops, moduli));

#ifdef __cplusplus
}
#endif
