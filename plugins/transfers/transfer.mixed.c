/* SPDX-License-Identifier: MIT */
/* transfer.mixed - PIC along the normal of the hybrid zone, FLIP along its tangents; what this takes from one particle
 * goes back through the grid, so that momentum is kept where the normal turns. docs/theory/transfers.md */
#include <quern/transfer.h>
#include <quern/vec.h>

typedef struct {
	int32_t unused;
} mixed;
static const quern_param params[] = { QUERN_END_PARAMS };
/* clang-format off */
#define USES(X) \
	X(NORMAL, "particle.zone_normal", "1", QUERN_READ, QUERN_VECTOR, \
		.doc = "Unit normal of the zone's level set; zero away from it.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

/* r = n (n . (v_flip - v_pic)); first pass sends r, the last one sets v = v_flip - r + sum S R_i, R_i = sum S m
 * r/m_i */
QUERN_INLINE void gather(const int dim, const bool last, const quern_transfer_batch *b) {
	quern_real *const *normal = b->use[NORMAL].real;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec n = QUERN_VEC_AT(normal, i, dim);
		const quern_vec flip =
			quern_vec_add(QUERN_VEC_AT(b->velocity, i, dim), QUERN_VEC_AT(b->change, i, dim));
		const quern_vec way = quern_vec_sub(flip, QUERN_VEC_AT(b->pic, i, dim));
		const quern_vec r = quern_vec_scale(quern_vec_dot(n, way, dim), n);
		if (last) {
			const quern_vec back = QUERN_VEC_AT(b->echo, i, dim);
			const quern_vec v = quern_vec_add(quern_vec_sub(flip, r), back);
			QUERN_VEC_PUT(b->velocity, i, v, dim);
		} else {
			QUERN_VEC_PUT(b->send, i, r, dim);
		}
	}
}
static void gather_2d(const void *self, const quern_transfer_batch *b) {
	(void)self;
	if (b->send[0]) gather(2, false, b);
	else gather(2, true, b);
}
static void gather_3d(const void *self, const quern_transfer_batch *b) {
	(void)self;
	if (b->send[0]) gather(3, false, b);
	else gather(3, true, b);
}

static const quern_transfer_ops ops = { .size = sizeof ops, .passes = 1, .gather = { gather_2d, gather_3d } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "transfer.mixed",
	.brief = "PIC along the zone's normal, FLIP along its tangents, momentum given back.",
	.cite = "Chantharayukhonthorn 2019, 6.3.2",
	.instance_size = sizeof(mixed),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
