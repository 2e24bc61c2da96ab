/* SPDX-License-Identifier: MIT */
/* check.conductivity - conductivities are numbers that conduct, at any temperature and with any parameters */
#include "conductivity.h"
#include <quern/check.h>

enum { TEMPERATURE, CONDUCTIVITY };

static void call(const quern_check_kernel *k, const quern_check_batch *b) {
	const conductivity_ops *ops = k->ops;
	quern_column own[QUERN_MOST_USES];
	k->host->columns(k, b, k->use, own);
	const conductivity_batch batch = { .n = b->n,
		.cap = b->cap,
		.temperature = quern_check_at(k, b, TEMPERATURE, 0),
		.conductivity = quern_check_at(k, b, CONDUCTIVITY, 0),
		.use = own };
	ops->conductivity(k->self, &batch);
}

static quern_check_kernel *make(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	if (variant) return NULL;
	quern_check_kernel *k = c->host->kernel_create(c, it, "conductivity", n);
	k->call = call;
	c->host->add(k, TEMPERATURE, "temperature", QUERN_CHECK_IN, 1);
	c->host->add(k, CONDUCTIVITY, "conductivity", QUERN_CHECK_OUT, 1);
	c->host->add_uses(k, 0, true);
	c->host->fill(k, TEMPERATURE, 1, 1, 200, 600);
	return k;
}

/* From a kelvin to what melts all rock. */
static void law(const quern_check *c) {
	enum { POINTS = 300, MIXTURES = 100 };
	quern_check_tally sound = { .name = "finite and not negative" };
	const uint64_t settings = c->host->settings(c) + MIXTURES;
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (uint64_t setting = 0; setting < settings; setting++) {
			quern_check_instance *it = c->host->instance_create(c, dim, setting);
			if (!it) continue;
			quern_check_kernel *k = make(c, it, 0, POINTS);
			c->host->fill(k, TEMPERATURE, 1, setting, 1, 3000);
			c->host->run(k, 64, false);
			for (uint32_t i = 0; i < POINTS; i++) {
				const quern_real found = quern_check_found(k, CONDUCTIVITY, 0)[i];
				c->host->expect(&sound, found >= 0 && found < __builtin_inf(),
					"%u-D: at %.6g K the conductivity is %.6g W/(m K)", dim,
					quern_check_given(k, TEMPERATURE, 0)[i], found);
			}
			c->host->kernel_destroy(k);
			c->host->instance_destroy(it);
		}
	c->host->tell(c, &sound, NULL);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = {
	.size = sizeof ops, .kind = &quern_conductivity_kind, .make = make, .law = law
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.conductivity",
	.brief = "Conductivities: finite and not negative at any temperature.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
