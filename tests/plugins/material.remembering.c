/* SPDX-License-Identifier: MIT */
/* material.remembering - points keep their stress, and remember four things, one by each rule, which it never changes itself */
#include <quern/material.h>

typedef struct {
	quern_real bulk_modulus, density;
} remembering;

static const quern_param params[] = { QUERN_PARAM(remembering, bulk_modulus, "Pa", "Stiffness.",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e15),
	QUERN_PARAM(
		remembering, density, "kg/m^3", "Density.", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_END_PARAMS };

#define ROW(name, unit_, doc_, rule_, initial_)                                                              \
	{                                                                                                        \
		.field = "point." name, .unit = unit_, .doc = doc_, .access = QUERN_UPDATE, .shape = QUERN_SCALAR,   \
		.flags = QUERN_SHOWN, .rule = rule_, .initial = initial_                                             \
	}
static const quern_use uses[] = { ROW("heat", "J", "An amount.", QUERN_SUMS, 1),
	ROW("warmth", "K", "Per mass.", QUERN_MEANS, 2), ROW("mark", "1", "What the whole had.", QUERN_KEEPS, 3),
	ROW("age", "s", "Its own.", QUERN_OWN, 7), QUERN_END_USES };

static void update(const void *self, const quern_material_batch *b) {
	const remembering *m = self;
	for (uint32_t i = 0; i < b->n; i++) {
		if (b->wave_speed) b->wave_speed[i] = __builtin_sqrt(m->bulk_modulus / m->density);
		if (b->energy) b->energy[i] = 0;
	}
}

static void assign(const void *self, const quern_material_batch *b) {
	for (uint32_t i = 0; i < b->n; i++) b->density[i] = ((const remembering *)self)->density;
	update(self, b);
}

static void moduli(const void *self, uint32_t dim, quern_real *bulk, quern_real *shear, quern_real *density) {
	const remembering *m = self;
	(void)dim;
	*bulk = m->bulk_modulus;
	*shear = 0;
	*density = m->density;
}

static const quern_material_ops ops = {
	.size = sizeof ops, .update = { update, update }, .assign = { assign, assign }, .moduli = moduli
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "material.remembering",
	.brief = "What points remember.",
	.instance_size = sizeof(remembering),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
