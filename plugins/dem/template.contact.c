/* contact.my_name - a spring and a dashpot, and a drag along the contact that never exceeds friction.
 *
 * A law sees batches of pairs. For each it adds a force on the first grain; the second gets the opposite, and torques,
 * weights and energies are the solver's business. A law must not depend on other pairs, and must scale: with stiffness
 * and mass doubled, all forces double. */
#include <quern/contact.h>
#include <quern/math.h>
#include <quern/vec.h>

/* What the scene gives comes first, then what init makes of it. */
typedef struct {
	quern_real stiffness, damping, friction;
} law;

/* One row per parameter: the scene reader, `quern describe` and the editor's schema are fed by it. */
static const quern_param params[] = { QUERN_PARAM(law, stiffness, "N/m", "Force per overlap.",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e15),
	QUERN_PARAM(law, damping, "1", "Of the normal dashpot; 1: a pair hardly rebounds.", .def = 0.2, .max = 1),
	QUERN_PARAM(law, friction, "1", "Most drag over normal force; 0: no drag.", .def = 0.5, .max = 10),
	QUERN_END_PARAMS };

/* Friction turns grains: a spin must exist, though the law does not look at it. History of a contact would be one more row, "contact.NAME", QUERN_UPDATE. */
static const quern_use uses[] = { { .field = "grain.spin",
									  .unit = "rad/s",
									  .doc = "Angular velocity; a frictional contact turns its grains.",
									  .access = QUERN_READ,
									  .shape = QUERN_AXIAL,
									  .flags = QUERN_OTHERS | QUERN_EXISTS,
									  .when = "friction" },
	QUERN_END_USES };

/* `dim` is a constant in both callers, so that each gets a loop of its own. */
QUERN_INLINE void force(const int dim, const void *self, const quern_contact_batch *b) {
	const law p = *(const law *)self;
	const quern_real *restrict overlap = b->overlap, *restrict mass = b->mass;
	const bool energy = b->stored != NULL; /* somebody observes it */
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec n = QUERN_VEC_AT(b->normal, i, dim), v = QUERN_VEC_AT(b->velocity, i, dim);
		const bool touching = overlap[i] > 0;
		const quern_real approach = -quern_vec_dot(v, n, dim),
						 spring = touching ? p.stiffness * overlap[i] : 0;
		const quern_real viscosity = 2 * p.damping * __builtin_sqrt(p.stiffness * mass[i]);
		/* pushes, never pulls */
		const quern_real pushed = quern_max(spring + viscosity * approach, 0), normal = touching ? pushed : 0;
		/* against the sliding velocity: the normal dashpot's, until friction is less */
		const quern_vec slide = quern_vec_axpy(approach, n, v);
		const quern_real speed = __builtin_sqrt(quern_vec_dot(slide, slide, dim));
		const quern_real most = p.friction * normal, wanted = viscosity * speed * (1.0 / 4);
		const quern_real drag = quern_min(wanted, most) / (speed > 0 ? speed : 1);
		const quern_vec f = quern_vec_axpy(normal, n, quern_vec_scale(-drag, slide));
		b->force[0][i] += f.x;
		b->force[1][i] += f.y;
		if (dim == 3) b->force[2][i] += f.z;
		if (!energy) continue;
		const quern_vec lost = quern_vec_axpy(-spring, n, f); /* all but the spring */
		b->dashpot[0][i] += lost.x;
		b->dashpot[1][i] += lost.y;
		if (dim == 3) b->dashpot[2][i] += lost.z;
		b->stored[i] += 0.5 * spring * (touching ? overlap[i] : 0);
	}
}
static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }
static void force_3d(const void *self, const quern_contact_batch *b) { force(3, self, b); }

/* Half a period of the undamped pair: the step in time follows from it. */
static quern_real period(const void *self, uint32_t dim, quern_real mass, quern_real radius) {
	(void)dim, (void)radius;
	return 3.141592653589793 * __builtin_sqrt(mass / ((const law *)self)->stiffness);
}

static quern_real stiffness(const void *self, uint32_t dim, quern_real radius, quern_real at_force) {
	(void)dim, (void)radius, (void)at_force;
	return ((const law *)self)->stiffness;
}

static const quern_contact_ops ops = {
	.size = sizeof ops, .force = { force_2d, force_3d }, .period = period, .stiffness = stiffness
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "contact.my_name",
	.brief = "A spring and a dashpot with viscous friction.",
	.instance_size = sizeof(law),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
