/* transfer.my_name - what the grid tells a point is blended: its change of velocity, and at a rate its velocity.
 *
 * A transfer sees batches of points, or of grains. The solver has gathered at each the grid's velocity (`pic`) and how
 * much the grid's velocity has changed (`change`); the transfer makes the new velocity of it. */
#include <quern/math.h>
#include <quern/transfer.h>

typedef struct {
	quern_real rate;
} blend;

static const quern_param params[] = {
	QUERN_PARAM(blend, rate, "1/s", "At which what the grid does not see decays; 0: never.", .max = 1e300),
	QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

/* The share of a step is exp(-rate dt), so that the result hardly depends on the length of the steps. */
QUERN_INLINE void gather(const int dim, const void *self, const quern_transfer_batch *b) {
	const quern_real keep = quern_exp(-((const blend *)self)->rate * b->dt);
	for (int k = 0; k < dim; k++) {
		const quern_real *restrict pic = b->pic[k], *restrict change = b->change[k];
		quern_real *restrict v = b->velocity[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < b->n; i++) v[i] = keep * (v[i] + change[i]) + (1 - keep) * pic[i];
	}
}
static void gather_2d(const void *self, const quern_transfer_batch *b) { gather(2, self, b); }
static void gather_3d(const void *self, const quern_transfer_batch *b) { gather(3, self, b); }

static const quern_transfer_ops ops = { .size = sizeof ops, .gather = { gather_2d, gather_3d } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "transfer.my_name",
	.brief = "FLIP that decays to PIC at a rate.",
	.instance_size = sizeof(blend),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
