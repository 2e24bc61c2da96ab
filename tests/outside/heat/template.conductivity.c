/* conductivity.my_name - falls with temperature, as that of a crystal does: k = k0 T0 / T.
 *
 * Called once a step with all points of the continuum, some sixty at a time. What else of a point is wanted, such as
 * its "particle.volume", is named in `uses` and comes in batch->use. */
#include <quern/conductivity.h>
#include <quern/math.h>

typedef struct {
	quern_real value, reference;
} crystal;

static const quern_param params[] = { QUERN_PARAM(crystal, value, "W/(m K)",
										  "Conductivity at the reference temperature.", .def = 2, .max = 1e6),
	QUERN_PARAM(crystal, reference, "K", "The temperature at which it has its value.", .def = 293.15,
		.min = 1, .max = 1e5),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static void conductivity(const void *self, const conductivity_batch *b) {
	const crystal p = *(const crystal *)self;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++)
		b->conductivity[i] = p.value * p.reference / quern_max(b->temperature[i], 1);
}

static const conductivity_ops ops = { .size = sizeof ops, .conductivity = conductivity };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "conductivity.my_name",
	.brief = "A conductivity that falls with temperature.",
	.instance_size = sizeof(crystal),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
