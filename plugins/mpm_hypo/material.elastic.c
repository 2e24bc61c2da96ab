/* SPDX-License-Identifier: MIT */
/* material.elastic - linear hypoelasticity: it carries tension, and nothing yields. docs/theory/materials.md, section
 * 2. Start here to write a material of your own. */
#include "../common/rotation.h"
#include <quern/material.h>
#include <quern/math.h>

typedef struct {
	quern_real bulk_modulus, poisson, density; /* from the scene */
	quern_real shear;                          /* G */
} elastic;

static const quern_param params[] = { QUERN_PARAM(elastic, bulk_modulus, "Pa",
										  "Bulk modulus K; in 2-D lambda + G.", .from = "grain.bulk_modulus",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e15),
	QUERN_PARAM(elastic, poisson, "1", "Poisson's ratio; sets the shear modulus.", .def = 0.3, .min = -0.9,
		.max = 0.49),
	QUERN_PARAM(elastic, density, "kg/m^3", "Density without stress.",
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	elastic *law = self;
	(void)err;
	law->shear = shear_modulus(setup->dim, law->bulk_modulus, law->poisson);
	return QUERN_OK;
}

QUERN_INLINE void put_outputs(const int dim, const elastic *law, const quern_material_batch *b) {
	put_wave_speeds(dim, law->bulk_modulus, law->shear, 0, b);
	put_hypoelastic_energies(dim, law->bulk_modulus, law->shear, b);
}

QUERN_INLINE void update(const int dim, const void *self, const quern_material_batch *b) {
	const elastic law = *(const elastic *)self;
	const quern_real dt = b->dt, shear = law.shear, lambda = law.bulk_modulus - 2 * shear / dim;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const symmetric old = SYMMETRIC_AT(b->stress, i, dim);
		const tensor l = TENSOR_AT(b->gradient, i, dim);
		const symmetric stress = elastic_trial(dim, old, l, dt, shear, lambda);
		SYMMETRIC_PUT(b->stress, i, stress, dim);
	}
	put_outputs(dim, &law, b);
}
static void update_2d(const void *self, const quern_material_batch *b) { update(2, self, b); }
static void update_3d(const void *self, const quern_material_batch *b) { update(3, self, b); }

/* The stress is all there is; rho = rho_0 e^(p/K) belongs to it. */
QUERN_INLINE void assign(const int dim, const void *self, const quern_material_batch *b) {
	const elastic law = *(const elastic *)self;
	const quern_real softness = 1 / law.bulk_modulus;
	quern_real *restrict density = b->density;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const symmetric stress = SYMMETRIC_AT(b->stress, i, dim);
		density[i] = law.density * quern_exp(-symmetric_mean(dim, stress) * softness);
	}
	put_outputs(dim, &law, b);
}
static void assign_2d(const void *self, const quern_material_batch *b) { assign(2, self, b); }
static void assign_3d(const void *self, const quern_material_batch *b) { assign(3, self, b); }

static void moduli(const void *self, uint32_t dim, quern_real *bulk, quern_real *shear, quern_real *density) {
	const elastic *law = self;
	(void)dim;
	*bulk = law->bulk_modulus;
	*shear = law->shear;
	*density = law->density;
}

static const quern_material_ops ops = { .size = sizeof ops,
	.update = { update_2d, update_3d },
	.assign = { assign_2d, assign_3d },
	.moduli = moduli };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "material.elastic",
	.brief = "Linear elasticity in rates.",
	.doc =
		"The stress turns with the material and grows with the strain rate. It holds under tension, and the "
		"point never opens: for bars, waves and tests, not for sand. Stretched to less than 0.81 of its density it "
		"needs a shorter step than the recommended one.",
	.cite = "Truesdell & Noll 1965; Hughes & Winget 1980",
	.instance_size = sizeof(elastic),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
