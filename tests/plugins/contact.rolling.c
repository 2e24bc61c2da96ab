/* SPDX-License-Identifier: MIT */
/* contact.rolling - resistance to rolling, as a couple that no force goes with: spring and dashpot along the rolling
 * velocity v_r = r (w_i - w_j) x n under a cone of mu_r times the normal force of the laws before it in the list. For
 * tests: after Luding, Granul. Matter 10 (2008) 235. */
#include <quern/contact.h>

typedef struct {
	quern_real stiffness, damping, friction; /* N/m, N s/m, 1 */
} rolling;
static const quern_param params[] = { QUERN_PARAM(rolling, stiffness, "N/m", "Rolling spring.",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e15),
	QUERN_PARAM(rolling, damping, "N s/m", "Rolling dashpot.", .max = 1e9),
	QUERN_PARAM(
		rolling, friction, "1", "Largest rolling force over the normal force.", .def = 0.1, .max = 10),
	QUERN_END_PARAMS };
enum { ROLL, COUPLE, SPIN };
static const quern_use uses[] = { { .field = "contact.roll",
									  .unit = "m",
									  .doc = "Rolling spring; 2-D: along the normal turned left.",
									  .access = QUERN_UPDATE,
									  .shape = QUERN_AXIAL },
	{ .field = "contact.couple",
		.unit = "N m",
		.doc = "On the first.",
		.access = QUERN_ADD,
		.shape = QUERN_AXIAL },
	{ .field = "grain.spin",
		.unit = "rad/s",
		.access = QUERN_READ,
		.shape = QUERN_AXIAL,
		.flags = QUERN_OTHERS },
	QUERN_END_USES };

QUERN_INLINE void force(const int dim, const void *self, const quern_contact_batch *b) {
	const rolling law = *(const rolling *)self;
	quern_real *const *roll = b->use[ROLL].real;
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec n = QUERN_VEC_AT(b->normal, i, dim), f = QUERN_VEC_AT(b->force, i, dim);
		const quern_vec spin = dim == 3 ? QUERN_VEC_AT(b->spin, i, 3) : (quern_vec) { 0, 0, b->spin[0][i] };
		const bool touching = b->overlap[i] > 0;
		const quern_vec v = quern_vec_scale(b->radius[i], quern_vec_cross(spin, n));
		const quern_vec was = dim == 3 ? quern_into_plane((quern_vec) { roll[0][i], roll[1][i], roll[2][i] },
											 n, quern_vec_dot(QUERN_VEC_AT(b->turn, i, 3), n, 3) * b->dt)
									   : quern_vec_scale(roll[0][i], (quern_vec) { -n.y, n.x, 0 });
		const quern_vec trial = quern_vec_axpy(b->dt, v, was);
		const quern_real normal = quern_vec_dot(f, n, 3), cap = law.friction * (normal > 0 ? normal : 0);
		const quern_vec a = quern_vec_scale(law.stiffness, trial), g = quern_vec_scale(law.damping, v);
		const quern_cone cone = quern_cone_shares(a, g, cap);
		const quern_vec now = quern_vec_scale(touching ? cone.spring : 0, trial);
		const quern_vec drag = quern_vec_scale(touching ? -cone.damper : 0, g);
		const quern_vec all = quern_vec_axpy(-law.stiffness, now, drag);
		const quern_vec couple = quern_vec_scale(b->radius[i], quern_vec_cross(n, all));
		const quern_vec damps = quern_vec_scale(b->radius[i], quern_vec_cross(n, drag));
		if (dim == 3) QUERN_VEC_PUT(roll, i, now, 3);
		else roll[0][i] = n.x * now.y - n.y * now.x;
		for (int k = 0; k < (dim == 3 ? 3 : 1); k++) {
			const quern_real c[3] = { couple.x, couple.y, couple.z }, d[3] = { damps.x, damps.y, damps.z };
			b->couple[k][i] += c[dim == 3 ? k : 2];
			if (b->drag_couple[0]) b->drag_couple[k][i] += d[dim == 3 ? k : 2];
		}
		if (!b->stored) continue;
		b->sheared[i] += 0.5 * law.stiffness * quern_vec_dot(now, now, 3);
		b->rubbed[i] += touching ? 0.5 * law.stiffness *
									   quern_vec_dot(quern_vec_add(was, now), quern_vec_sub(trial, now), 3)
								 : 0;
	}
}
static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }
static void force_3d(const void *self, const quern_contact_batch *b) { force(3, self, b); }

/* A disc's moment is m r^2/2, so that the spring acts on half the mass; a sphere's on 2/5 of it. */
static quern_real period(const void *self, uint32_t dim, quern_real mass, quern_real radius) {
	(void)radius;
	const quern_real share = dim == 2 ? 0.5 : 0.4;
	return 3.14159265358979312 * __builtin_sqrt(share * mass / ((const rolling *)self)->stiffness);
}

static const quern_contact_ops ops = {
	.size = sizeof ops, .force = { force_2d, force_3d }, .period = period
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "contact.rolling",
	.brief = "Resistance to rolling, for tests.",
	.instance_size = sizeof(rolling),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
