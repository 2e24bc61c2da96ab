/* solver.my_name - grains that fly and bounce off the lower end of the domain, and never meet each other.
 *
 *     grains: {solver: my_name, count: 1000, radius: 1 mm}
 *
 * A solver owns sets of entities and stages that work on their fields. Nothing is allocated by hand: a field exists
 * because a stage names it, and is written out, saved and restored because of how stages use it. The order of stages
 * follows from their phases. */
#include <quern/solver.h>
#include <stdio.h>

typedef struct {
	int32_t count; /* from the scene */
	quern_real radius, density, bounce;
	uint64_t stream; /* of random numbers */
} flight;

static const quern_param params[] = { QUERN_PARAM(flight, count, "1", "Number of grains.", .def = 1000,
										  .min = 1, .max = 1e8),
	QUERN_PARAM(flight, radius, "m", "Radius.", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(flight, density, "kg/m^3", "Density of a grain.", .def = 2500, .min = 0, .max = 1e6,
		.flags = QUERN_MIN_OPEN),
	QUERN_PARAM(flight, bounce, "1", "Speed after a bounce over that before.", .def = 0.8, .max = 1),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static const quern_set sets[] = { { .name = "grain",
									  .plural = "grains",
									  .doc = "Discs or spheres.",
									  .counted = 1,
									  .cost = { 10e-9, 15e-9 } },
	{ .name = NULL } };
static const quern_slot slots[] = { { .name = NULL } }; /* places for plugins of other kinds */

/* A row per field and stage; their numbers index step->use. */
enum { FILL_POSITION, FILL_VELOCITY, FILL_RADIUS };
static const quern_use fill_uses[] = { { .field = "grain.position",
										   .unit = "m",
										   .doc = "Centre.",
										   .access = QUERN_WRITE,
										   .shape = QUERN_VECTOR,
										   .flags = QUERN_SHOWN },
	{ .field = "grain.velocity",
		.unit = "m/s",
		.doc = "Velocity.",
		.access = QUERN_WRITE,
		.shape = QUERN_VECTOR },
	{ .field = "grain.radius",
		.unit = "m",
		.doc = "Radius.",
		.access = QUERN_WRITE,
		.shape = QUERN_SCALAR,
		.flags = QUERN_SHOWN },
	QUERN_END_USES };

enum { MOVE_POSITION, MOVE_VELOCITY, MOVE_RADIUS };
static const quern_use move_uses[] = {
	{ .field = "grain.position", .unit = "m", .access = QUERN_UPDATE, .shape = QUERN_VECTOR },
	{ .field = "grain.velocity", .unit = "m/s", .access = QUERN_UPDATE, .shape = QUERN_VECTOR },
	{ .field = "grain.radius", .unit = "m", .access = QUERN_READ, .shape = QUERN_SCALAR }, QUERN_END_USES
};

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	(void)err;
	((flight *)self)->stream = setup->stream;
	return QUERN_OK;
}

/* New entries are made by remap, from[i] = -1; then there are columns to write. */
static quern_status fill(const void *self, const quern_step *s) {
	const flight *p = self;
	const uint32_t n = (uint32_t)p->count;
	int32_t *from = s->host->memory(s->run, n * sizeof(int32_t));
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) from[i] = -1;
	const quern_status status = s->host->remap(s->run, "grain", n, from, 0, NULL);
	if (status != QUERN_OK) return status;
	for (uint32_t i = 0; i < n; i++) {
		quern_real u[4];
		s->host->random(p->stream, i, 0, u);
		s->host->random(p->stream, i, 1, u + 2);
		for (uint32_t k = 0; k < s->dim; k++) {
			const quern_real room = s->upper[k] - s->lower[k] - 2 * p->radius;
			s->use[FILL_POSITION].real[k][i] = s->lower[k] + p->radius + u[k] * (room > 0 ? room : 0);
			s->use[FILL_VELOCITY].real[k][i] = 0;
		}
		s->use[FILL_RADIUS].real[0][i] = p->radius;
	}
	return QUERN_OK;
}

enum { CHUNK = 1024 };

typedef struct {
	const flight *self;
	const quern_step *step;
	uint32_t n;
} moving;

/* Runs on any worker, on grains that no other worker has. */
static void move_chunk(void *arg, uint32_t chunk, uint32_t worker) {
	const moving *m = arg;
	const quern_step *s = m->step;
	const uint32_t begin = chunk * CHUNK, end = m->n - begin < CHUNK ? m->n : begin + CHUNK, up = s->dim - 1;
	(void)worker;
	for (uint32_t i = begin; i < end; i++) {
		const quern_real floor = s->lower[up] + s->use[MOVE_RADIUS].real[0][i];
		for (uint32_t k = 0; k < s->dim; k++) {
			s->use[MOVE_VELOCITY].real[k][i] += s->dt * s->gravity[k];
			s->use[MOVE_POSITION].real[k][i] += s->dt * s->use[MOVE_VELOCITY].real[k][i];
		}
		quern_real *x = &s->use[MOVE_POSITION].real[up][i], *v = &s->use[MOVE_VELOCITY].real[up][i];
		if (*x < floor && *v < 0) {
			*x = floor;
			*v *= -m->self->bounce;
		}
	}
}

static quern_status move(const void *self, const quern_step *s) {
	moving m = { self, s, s->host->set(s->run, "grain").n };
	s->host->parallel(s->run, (m.n + CHUNK - 1) / CHUNK, move_chunk, &m);
	return QUERN_OK;
}

static const quern_stage stages[] = { { .name = "my_name.fill",
										  .doc = "Places the grains.",
										  .phase = QUERN_SETUP,
										  .uses = fill_uses,
										  .run = fill },
	{ .name = "my_name.move",
		.doc = "Gravity, motion, the floor.",
		.phase = QUERN_SUBSTEP,
		.uses = move_uses,
		.run = move },
	{ .name = NULL } };

/* The step that is asked for unless the scene gives one: a fall by one radius in the first ten steps. */
static quern_real limit(const void *self, const quern_step *s, quern_real *hard, char reason[160]) {
	quern_real g2 = 0;
	for (uint32_t k = 0; k < s->dim; k++) g2 += s->gravity[k] * s->gravity[k];
	snprintf(reason, 160, "the fall of a grain");
	const quern_real gravity = __builtin_sqrt(g2);
	*hard = __builtin_inf(); /* never unstable */
	return 0.1 * __builtin_sqrt(2 * ((const flight *)self)->radius / (gravity > 0 ? gravity : 1));
}

/* What the solver carries goes to the summary, and guards against lost mass. */
enum { MASS, DISCRETE, MOMENTUM, KINETIC = MOMENTUM + 3, POTENTIAL };
static const quern_output sums[] = { { .name = "mass", .unit = "kg", .doc = "Carried." },
	{ .name = "discrete", .unit = "kg", .doc = "Carried by grains." },
	{ .name = "momentum_x", .unit = "kg m/s" }, { .name = "momentum_y", .unit = "kg m/s" },
	{ .name = "momentum_z", .unit = "kg m/s" }, { .name = "kinetic", .unit = "J" },
	{ .name = "potential", .unit = "J" }, { .name = NULL } };

static void account(const void *self, const quern_step *s, quern_real *sum) {
	const flight *p = self;
	const uint32_t n = s->host->set(s->run, "grain").n, *order = s->host->parts(s->run, "grain")->entry;
	const quern_real area = 3.141592653589793 * p->radius * p->radius;
	const quern_real mass = p->density * (s->dim == 2 ? area : 4.0 / 3 * area * p->radius);
	sum[MASS] = sum[DISCRETE] = n * mass;
	for (uint32_t q = 0; q < n; q++) /* by place: a sum must not depend on the numbers of entries */
		for (uint32_t k = 0; k < s->dim; k++) {
			const uint32_t i = quern_nth(order, q);
			const quern_real x = s->use[FILL_POSITION].real[k][i], v = s->use[FILL_VELOCITY].real[k][i];
			sum[MOMENTUM + k] += mass * v;
			sum[KINETIC] += 0.5 * mass * v * v;
			sum[POTENTIAL] -= mass * s->gravity[k] * x;
		}
}

static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .sets = sets, .slots = slots, .stages = stages,
	.limit = limit, .sums = sums, .account = account };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "solver.my_name",
	.brief = "Grains that fly, fall and bounce.",
	.instance_size = sizeof(flight),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
