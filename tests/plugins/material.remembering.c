/* SPDX-License-Identifier: MIT */
/* material.remembering - a liquid whose points remember four things, one by each rule; it never changes them itself */
#include <quern/material.h>
#include <quern/math.h>

typedef struct {
	quern_real bulk_modulus, density;
} liquid;

static const quern_param params[] = { QUERN_PARAM(liquid, bulk_modulus, "Pa",
										  "Stiffness K; 100 times the largest pressure is enough.",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e15),
	QUERN_PARAM(liquid, density, "kg/m^3", "Density rho_0 without pressure.",
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_END_PARAMS };
#define ROW(name, unit_, doc_, rule_, initial_)                                                              \
	{                                                                                                        \
		.field = "point." name, .unit = unit_, .doc = doc_, .access = QUERN_UPDATE, .shape = QUERN_SCALAR,   \
		.flags = QUERN_SHOWN, .rule = rule_, .initial = initial_                                             \
	}
static const quern_use uses[] = { ROW("heat", "J", "An amount.", QUERN_SUMS, 1),
	ROW("warmth", "K", "Per mass.", QUERN_MEANS, 2), ROW("mark", "1", "What the whole had.", QUERN_KEEPS, 3),
	ROW("age", "s", "Its own.", QUERN_OWN, 7), QUERN_END_USES };

/* Components in 2-D: xx yy xy; in 3-D: xx yy zz xy yz xz. The first `dim` stand on the diagonal. */
QUERN_INLINE void put_pressure(const int dim, const quern_material_batch *b, uint32_t i, quern_real p) {
	for (int k = 0; k < (dim == 2 ? 3 : 6); k++) b->stress[k][i] = k < dim ? -p : 0;
}

/* Speed of sound and stored energy per mass, the integral of p/rho^2; either may be unwanted. */
QUERN_INLINE void put_outputs(const liquid *m, const quern_material_batch *b, uint32_t i) {
	const quern_real rho = b->density[i], ratio = rho > m->density ? rho / m->density : 1;
	if (b->wave_speed) b->wave_speed[i] = __builtin_sqrt(m->bulk_modulus / (m->density * ratio));
	if (b->energy) b->energy[i] = m->bulk_modulus / m->density * (1 - (1 + quern_log(ratio)) / ratio);
}

QUERN_INLINE void update(const int dim, const void *self, const quern_material_batch *b) {
	const liquid *m = self;
	for (uint32_t i = 0; i < b->n; i++) {
		const bool open = b->density[i] < m->density;
		const quern_real loose = quern_min(b->grid_density[i], m->density);
		/* spray follows the grid's density, so that it is found as dense as it is when it meets the rest again */
		b->density[i] = open ? loose : b->density[i];
		put_pressure(dim, b, i, open ? 0 : m->bulk_modulus * quern_log(b->density[i] / m->density));
		put_outputs(m, b, i);
	}
}
static void update_2d(const void *self, const quern_material_batch *b) { update(2, self, b); }
static void update_3d(const void *self, const quern_material_batch *b) { update(3, self, b); }

/* A new point under a given stress: what the liquid cannot bear is left out, and the density is made to fit. */
QUERN_INLINE void assign(const int dim, const void *self, const quern_material_batch *b) {
	const liquid *m = self;
	for (uint32_t i = 0; i < b->n; i++) {
		quern_real trace = 0;
		for (int k = 0; k < dim; k++) trace += b->stress[k][i];
		const quern_real p = quern_max(-trace / dim, 0);
		put_pressure(dim, b, i, p);
		b->density[i] = m->density * quern_exp(p / m->bulk_modulus);
		put_outputs(m, b, i);
	}
}
static void assign_2d(const void *self, const quern_material_batch *b) { assign(2, self, b); }
static void assign_3d(const void *self, const quern_material_batch *b) { assign(3, self, b); }

/* The step in time follows from these. */
static void moduli(const void *self, uint32_t dim, quern_real *bulk, quern_real *shear, quern_real *density) {
	const liquid *m = self;
	(void)dim;
	*bulk = m->bulk_modulus;
	*shear = 0;
	*density = m->density;
}

static const quern_material_ops ops = { .size = sizeof ops,
	.update = { update_2d, update_3d },
	.assign = { assign_2d, assign_3d },
	.moduli = moduli };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "material.remembering",
	.brief = "A liquid that remembers.",
	.instance_size = sizeof(liquid),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
