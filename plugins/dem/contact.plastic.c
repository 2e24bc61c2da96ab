/* SPDX-License-Identifier: MIT */
/* contact.plastic - a spring that yields: soft while the overlap is the greatest so far, stiff below that. Walton & Braun's law, with a
 * tangential spring under a Coulomb cone. docs/theory/contacts.md, section 5 */
#include <quern/contact.h>

typedef struct {
	quern_real stiffness, restitution, friction, tangential_stiffness; /* from the scene */
	quern_real unloading;                                              /* N/m, k_2 */
	quern_real lasting; /* of the greatest overlap, what stays as a dent: 1 - k_1/k_2 */
} plastic;

static const quern_param params[] = { QUERN_PARAM(plastic, stiffness, "N/m",
										  "Normal spring k_1 of a contact that is pressed deeper than ever.",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e15),
	QUERN_PARAM(plastic, restitution, "1",
		"Normal restitution of a pair, exact for any masses and speeds: the spring below the greatest overlap is k_2 = "
		"k_1/e^2.",
		.def = 0.5, .min = 0.05, .max = 1),
	QUERN_PARAM(plastic, friction, "1", "Coulomb coefficient; 0: no slip, no spin.", .def = 0.5, .max = 10),
	QUERN_PARAM(plastic, tangential_stiffness, "1", "k_t / k_1.", .def = 2.0 / 7, .planar = 1.0 / 3,
		.flags = QUERN_PLANAR | QUERN_MIN_OPEN, .max = 10),
	QUERN_END_PARAMS };

/* clang-format off */
#define USES(X) \
	X(DEEPEST, "contact.deepest", "m", QUERN_UPDATE, QUERN_SCALAR, .doc = "Greatest overlap since the pair has touched.") \
	X(SLIP, "contact.slip", "m", QUERN_UPDATE, QUERN_AXIAL, .when = "friction", \
		.doc = "Tangential spring; 2-D: along the normal turned left.") \
	X(SPIN, "grain.spin", "rad/s", QUERN_READ, QUERN_AXIAL, .flags = QUERN_OTHERS | QUERN_EXISTS, .when = "friction", \
		.doc = "Angular velocity; a frictional contact turns its grains.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	plastic *law = self;
	(void)setup, (void)err;
	const quern_real share = law->restitution * law->restitution; /* k_1/k_2 */
	law->unloading = law->stiffness / share;
	law->lasting = 1 - share;
	return QUERN_OK;
}

/* `dim`, `rough` and `energy` are constants in every caller. */
QUERN_INLINE void kernel(
	const int dim, const bool rough, const int energy, const plastic *self, const quern_contact_batch *b) {
	const plastic law = *self;
	const quern_real dt = b->dt, k1 = law.stiffness, k2 = law.unloading;
	const quern_real kt = law.tangential_stiffness * k1, one_over_kt = 1 / kt,
					 yields = 0.5 * k1 * law.lasting;
	const quern_real *restrict overlap = b->overlap;
	quern_real *restrict deepest = b->use[DEEPEST].real[0];
	quern_real *const *slip = rough ? b->use[SLIP].real : NULL;
	if (rough && dim == 3) QUERN_TURN_SPRINGS(slip, b);
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec n = QUERN_VEC_AT(b->normal, i, dim), v = QUERN_VEC_AT(b->mean_velocity, i, dim);
		const quern_real d = overlap[i], vn = quern_vec_dot(v, n, dim), before = deepest[i];
		const bool touching = d > 0;
		const quern_real deeper = d > before ? d : before, most = touching ? deeper : 0;
		/* f_n = max(0, k_2 (d - d_0)), d_0 = (1 - k_1/k_2) d_max: k_1 d where d = d_max */
		const quern_real give = d - law.lasting * most, spring = (touching & (give > 0)) ? give : 0;
		const quern_real fn = k2 * spring;
		quern_vec f = quern_vec_scale(fn, n);
		quern_real sheared = 0, rubbed = touching ? yields * (most * most - before * before) : 0;
		deepest[i] = most;
		if (rough) {
			const quern_onset onset = quern_first_touch(d, -vn, dt, 0);
			const quern_real cap = law.friction * fn;
			if (dim == 3) {
				/* xi' = v_t in the tangent plane; |k_t s xi| = mu f_n */
				const quern_vec vt = quern_vec_axpy(-vn, n, v);
				const quern_vec was = QUERN_VEC_AT(slip, i, 3), trial = quern_vec_axpy(onset.time, vt, was);
				const quern_cone cone =
					quern_cone_shares(quern_vec_scale(kt, trial), (quern_vec) { 0, 0, 0 }, cap);
				const quern_vec now = quern_vec_scale(touching ? cone.spring : 0, trial);
				QUERN_VEC_PUT(slip, i, now, 3);
				f = quern_vec_axpy(-kt, now, f);
				sheared = 0.5 * kt * quern_vec_dot(now, now, 3);
				const quern_vec slid = quern_vec_sub(trial, now);
				rubbed += 0.5 * kt * quern_vec_dot(quern_vec_add(was, now), slid, 3);
			} else { /* the same along the one tangent (-n_y, n_x) */
				const quern_real vt = n.x * v.y - n.y * v.x, was = slip[0][i], trial = was + onset.time * vt;
				quern_real left;
				quern_cone_planar(kt * trial, 0, cap, &left);
				const quern_real now = touching ? left * one_over_kt : 0;
				slip[0][i] = now;
				f.x += kt * now * n.y;
				f.y -= kt * now * n.x;
				sheared = 0.5 * kt * now * now;
				rubbed += 0.5 * kt * (was + now) * (trial - now);
			}
		}
		b->force[0][i] += f.x;
		b->force[1][i] += f.y;
		if (dim == 3) b->force[2][i] += f.z;
		if (energy) { b->rubbed[i] += rubbed; }
		if (energy == QUERN_ALL_ENERGY) {
			b->stored[i] += 0.5 * k2 * spring * spring;
			b->sheared[i] += sheared;
		}
	}
}

QUERN_INLINE void force(const int dim, const void *self, const quern_contact_batch *b) {
	QUERN_CALL_LAW(kernel, dim, ((const plastic *)self)->friction > 0, self, b);
}
static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }
static void force_3d(const void *self, const quern_contact_batch *b) { force(3, self, b); }

/* pi/omega of the stiffest mode: unloading, or the tangential spring, which acts on m/3 (discs) or m/3.5 (spheres). */
static quern_real period(const void *self, uint32_t dim, quern_real mass, quern_real radius) {
	const plastic *law = self;
	(void)radius;
	const quern_real turning =
		law->friction > 0 ? (dim == 2 ? 3 : 3.5) * law->tangential_stiffness * law->stiffness : 0;
	return 3.14159265358979312 * __builtin_sqrt(mass / (turning > law->unloading ? turning : law->unloading));
}

/* Of a contact that is pressed as it never was. */
static quern_real stiffness(const void *self, uint32_t dim, quern_real radius, quern_real at_force) {
	(void)dim, (void)radius, (void)at_force;
	return ((const plastic *)self)->stiffness;
}

static const quern_contact_ops ops = {
	.size = sizeof ops, .force = { force_2d, force_3d }, .period = period, .stiffness = stiffness, .means = 1
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "contact.plastic",
	.brief = "A spring that yields, and remembers how deep it has been.",
	.doc =
		"Soft while pressed deeper than ever, stiff when let go: what is lost does not depend on speed. Without a dashpot.",
	.cite = "Walton & Braun 1986; Luding 2008",
	.instance_size = sizeof(plastic),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
