/* body.my_name - a disc or sphere; hollow, it is a drum with the grains inside.
 *
 * A body is geometry alone. Given places, it tells how far its surface is, which way that faces, and how fast it moves
 * there; contact laws and the continuum's walls both live on that. The pose, that is where it is and how it moves, is
 * the host's. */
#include <math.h>
#include <quern/body.h>
#include <quern/vec.h>

typedef struct {
	quern_real centre[3], radius;
	bool hollow;
} ball;

static const quern_param params[] = { QUERN_PARAM(ball, centre, "m", "Centre.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(ball, radius, "m", "Radius.", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(ball, hollow, NULL, "What is outside is solid, and the grains are inside."),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

QUERN_INLINE void kernel(const int dim, const ball *p, const quern_body_batch *b) {
	const quern_pose *pose = b->pose;
	const quern_vec origin = QUERN_VEC_OF(pose->position), drift = QUERN_VEC_OF(pose->velocity),
					spin = QUERN_VEC_OF(pose->spin);
	const quern_vec centre = quern_vec_add(origin, quern_vec_turn(pose->turn, QUERN_VEC_OF(p->centre)));
	const quern_real side = p->hollow ? -1 : 1, size = p->radius;
	const quern_real *restrict radius = b->radius;
	quern_real *restrict gap = b->gap;
	for (uint32_t i = 0; i < b->n; i++) {
		quern_vec way = quern_vec_sub(QUERN_VEC_AT(b->position, i, dim), centre);
		if (dim == 2) way.z = 0;
		const quern_real distance = __builtin_sqrt(quern_vec_dot(way, way, dim));
		const bool central = !(distance > 0); /* no way is the nearest: take one */
		const quern_real scale = 1 / (central ? 1 : distance);
		const quern_vec out = { way.x * scale, central ? 1 : way.y * scale, way.z * scale };
		const quern_vec arm = quern_vec_sub(quern_vec_axpy(size, out, centre), origin);
		const quern_vec velocity = quern_vec_add(drift, quern_vec_cross(spin, arm));
		gap[i] = side * (distance - size) - radius[i];
		QUERN_VEC_PUT(b->normal, i, quern_vec_scale(side, out), dim);
		QUERN_VEC_PUT(b->velocity, i, velocity, dim);
	}
}

static void closest(const void *self, const quern_body_batch *b) {
	if (b->dim == 2) kernel(2, self, b);
	else kernel(3, self, b);
}

/* The box that holds all that is solid. */
static void bounds(const void *self, uint32_t dim, quern_real lower[3], quern_real upper[3]) {
	const ball *p = self;
	for (uint32_t k = 0; k < dim; k++) {
		lower[k] = p->hollow ? -INFINITY : p->centre[k] - p->radius;
		upper[k] = p->hollow ? INFINITY : p->centre[k] + p->radius;
	}
}

static const quern_body_ops ops = { .size = sizeof ops, .closest = closest, .bounds = bounds };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "body.my_name",
	.brief = "A disc or sphere, solid or hollow.",
	.instance_size = sizeof(ball),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
