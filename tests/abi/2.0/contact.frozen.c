/* SPDX-License-Identifier: MIT */
/* contact.frozen - a spring that counts for how long a pair has touched: parameters, history, an own field, `period` alone */
#include <quern/contact.h>

typedef struct {
	quern_real stiffness;
	const char *title;
} frozen;

static const quern_param params[] = { QUERN_PARAM(frozen, stiffness, "N/m", "Force per overlap.", .def = 1e6,
										  .min = 1, .max = 1e12),
	QUERN_PARAM(frozen, title, NULL, "A text.", .text = "spring"), QUERN_END_PARAMS };
static const quern_use uses[] = { { .field = "contact.age",
									  .unit = "s",
									  .doc = "Time in touch.",
									  .access = QUERN_UPDATE,
									  .shape = QUERN_SCALAR,
									  .flags = QUERN_SHOWN },
	QUERN_END_USES };

static void force(const int dim, const void *self, const quern_contact_batch *b) {
	const quern_real stiffness = ((const frozen *)self)->stiffness;
	quern_real *age = b->use[0].real[0];
	for (uint32_t i = 0; i < b->n; i++) {
		const bool touching = b->overlap[i] > 0;
		const quern_real f = touching ? stiffness * b->overlap[i] : 0;
		for (int k = 0; k < dim; k++) b->force[k][i] += f * b->normal[k][i];
		if (b->stored) b->stored[i] += 0.5 * f * (touching ? b->overlap[i] : 0);
		age[i] = touching ? age[i] + b->dt : 0;
	}
}
static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }
static void force_3d(const void *self, const quern_contact_batch *b) { force(3, self, b); }

static quern_real period(const void *self, uint32_t dim, quern_real mass, quern_real radius) {
	(void)dim, (void)radius;
	return 3.141592653589793 * __builtin_sqrt(mass / ((const frozen *)self)->stiffness);
}

static const quern_contact_ops ops = {
	.size = sizeof ops, .force = { force_2d, force_3d }, .period = period
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 3,
	.dims = QUERN_2D | QUERN_3D,
	.id = "contact.frozen",
	.brief = "A spring.",
	.instance_size = sizeof(frozen),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "2.0", "MIT");
