/* SPDX-License-Identifier: MIT */
/* material.frozen - a compressible fluid without friction: pressure from density */
#include <quern/material.h>

typedef struct {
	quern_real bulk_modulus, density;
} frozen;

static const quern_param params[] = { QUERN_PARAM(frozen, bulk_modulus, "Pa", "Stiffness.", .def = 50,
										  .min = 1, .max = 1e12),
	QUERN_PARAM(frozen, density, "kg/m^3", "Without stress.", .def = 1, .min = 1e-6, .max = 1e6),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static void update(const uint32_t dim, const void *self, const quern_material_batch *b) {
	const frozen *p = self;
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real strain = b->density[i] / p->density - 1;
		for (uint32_t k = 0; k < dim * (dim + 1) / 2; k++)
			b->stress[k][i] = k < dim ? -p->bulk_modulus * strain : 0;
		if (b->wave_speed) b->wave_speed[i] = __builtin_sqrt(p->bulk_modulus / p->density);
		if (b->energy) b->energy[i] = 0.5 * p->bulk_modulus * strain * strain / p->density;
	}
}
static void update_2d(const void *self, const quern_material_batch *b) { update(2, self, b); }
static void update_3d(const void *self, const quern_material_batch *b) { update(3, self, b); }

static void moduli(const void *self, uint32_t dim, quern_real *bulk, quern_real *shear, quern_real *density) {
	const frozen *p = self;
	(void)dim;
	*bulk = p->bulk_modulus, *shear = 0, *density = p->density;
}

static const quern_material_ops ops = { .size = sizeof ops,
	.update = { update_2d, update_3d },
	.assign = { update_2d, update_3d },
	.moduli = moduli };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "material.frozen",
	.brief = "A fluid.",
	.instance_size = sizeof(frozen),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "2.0", "MIT");
