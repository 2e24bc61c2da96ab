/* observer.my_name - how high grains reach, how fast the fastest is, and how many move.
 *
 * An observer's outputs become columns of series.csv and an entry in summary.json. `map` makes partial results of a few
 * hundred entries of one set; the host combines them, always in the same order. What needs everything at once has a
 * `whole` instead, and no set. */
#include <quern/math.h>
#include <quern/observer.h>
#include <quern/vec.h>

typedef struct {
	quern_real speed;
} motion;

static const quern_param params[] = { QUERN_PARAM(motion, speed, "m/s",
										  "From which on a grain counts as moving.", .def = 1e-3, .max = 1e9),
	QUERN_END_PARAMS };

enum { POSITION, VELOCITY };
static const quern_use uses[] = {
	{ .field = "grain.position", .unit = "m", .access = QUERN_READ, .shape = QUERN_VECTOR },
	{ .field = "grain.velocity", .unit = "m/s", .access = QUERN_READ, .shape = QUERN_VECTOR }, QUERN_END_USES
};

enum { TOP, FASTEST, MOVING };
static const quern_output outputs[] = { { "top", "m", "Highest centre, along the last axis.", QUERN_MAX, 0 },
	{ "fastest", "m/s", "Largest speed.", QUERN_MAX, 0 },
	{ "moving", "1", "Number of grains that move.", QUERN_SUM, 0 }, { .name = NULL } };

static void map(const void *self, const quern_observer_batch *b, quern_real *partial) {
	const quern_real threshold = ((const motion *)self)->speed;
	const quern_real *up = b->use[POSITION].real[b->dim - 1];
	quern_real *const *velocity = b->use[VELOCITY].real;
	partial[TOP] = -quern_infinity();
	partial[FASTEST] = partial[MOVING] = 0;
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec v = QUERN_VEC_AT(velocity, i, b->dim);
		const quern_real speed = __builtin_sqrt(quern_vec_dot(v, v, (int)b->dim));
		partial[TOP] = quern_max(partial[TOP], up[i]);
		partial[FASTEST] = quern_max(partial[FASTEST], speed);
		partial[MOVING] += speed >= threshold ? 1 : 0;
	}
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .set = "grain", .outputs = outputs, .map = map
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.my_name",
	.brief = "Height and motion of the grains.",
	.instance_size = sizeof(motion),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
