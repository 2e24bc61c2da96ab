/* SPDX-License-Identifier: MIT */
/* material.mu_i - hypoelastic up to a yield stress that grows with the inertial number, no tension, and no stress below
 * the critical density. docs/theory/materials.md, section 3 */
#include "../common/rotation.h"
#include <quern/material.h>
#include <quern/math.h>

typedef struct {
	quern_real bulk_modulus, poisson, static_friction, limit_friction, inertial_number, diameter,
		grain_density, critical_density, flow_density, dilation, pressure_rate; /* from the scene */
	quern_real shear;                                                           /* G */
} mu_i;

/* Of flow that goes to a density of its own: by what share of it that falls at most; pressure over K for each unit of slow shear, and of what the
 * density is off by as a share; by what share the pressure changes in a step at most. */
static const quern_real widest = 0.2, steepness = 20, step_most = 0.5;

static const quern_param params[] = { QUERN_PARAM(mu_i, bulk_modulus, "Pa",
										  "Bulk modulus K; in 2-D lambda + G.", .from = "grain.bulk_modulus",
										  .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e15),
	QUERN_PARAM(
		mu_i, poisson, "1", "Poisson's ratio; sets the shear modulus.", .def = 0.3, .min = -0.9, .max = 0.49),
	QUERN_PARAM(mu_i, static_friction, "1", "mu_s, friction of slow flow.", .def = 0.3819, .planar = 0.26,
		.flags = QUERN_PLANAR, .max = 10),
	QUERN_PARAM(mu_i, limit_friction, "1", "mu_2, friction of fast flow; mu_s: no dependence on the rate.",
		.def = 0.6435, .planar = 0.60, .flags = QUERN_PLANAR, .max = 10),
	QUERN_PARAM(mu_i, inertial_number, "1", "I_0, half-way between the two; 0: friction is mu_2.",
		.def = 0.279, .planar = 0.36, .flags = QUERN_PLANAR, .max = 100),
	QUERN_PARAM(mu_i, diameter, "m", "Mean diameter of the grains.", .from = "grain.diameter",
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(mu_i, grain_density, "kg/m^3", "Density of a grain.", .from = "grain.density",
		.flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(mu_i, critical_density, "kg/m^3",
		"Below it the material is open and carries no stress, but for what flows at flow_density.",
		.from = "grain.critical_density", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(mu_i, flow_density, "kg/m^3",
		"Density without stress that slow flow comes to; 0: flow keeps the density that it has.", .max = 1e6),
	QUERN_PARAM(mu_i, dilation, "1",
		"How much looser than that flow is for each unit of the inertial number, as a share of it.",
		.max = 10),
	QUERN_PARAM(mu_i, pressure_rate, "1/s", "beta, pull of the pressure towards K ln(rho/rho_c).", .max = 1e9,
		.flags = QUERN_ADVANCED),
	QUERN_END_PARAMS };

/* clang-format off */
#define USES(X) \
	X(SHEAR_RATE, "point.shear_rate", "1/s", QUERN_WRITE, QUERN_SCALAR, .flags = QUERN_OPTIONAL, \
		.doc = "Equivalent plastic shear rate; of an open point the whole one.")
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	mu_i *law = self;
	const quern_host *host = setup->host;
	if (law->limit_friction < law->static_friction)
		return host->fail(err, QUERN_E_PARAM, "limit_friction",
			"%g is below static_friction, %g; friction must not fall with the rate", law->limit_friction,
			law->static_friction);
	if (law->critical_density > law->grain_density)
		return host->fail(err, QUERN_E_PARAM, "critical_density",
			"%g kg/m^3 is above the density of a grain, %g", law->critical_density, law->grain_density);
	if (law->flow_density > law->grain_density)
		return host->fail(err, QUERN_E_PARAM, "flow_density", "%g kg/m^3 is above the density of a grain, %g",
			law->flow_density, law->grain_density);
	if (law->flow_density > 0 && law->flow_density < 0.5 * law->critical_density)
		return host->fail(err, QUERN_E_PARAM, "flow_density",
			"%g kg/m^3 is less than half of critical_density, %g: no sand flows so loosely",
			law->flow_density, law->critical_density);
	if (law->dilation > 0 && !(law->flow_density > 0))
		return host->fail(
			err, QUERN_E_PARAM, "dilation", "says how much looser than flow_density flow is: give that too");
	if (law->flow_density > 0 && law->pressure_rate > 0)
		return host->fail(err, QUERN_E_PARAM, "pressure_rate",
			"pulls pressure to what critical_density says, and flow_density to another one: give one of them");
	law->shear = shear_modulus(setup->dim, law->bulk_modulus, law->poisson);
	return QUERN_OK;
}

/* The root of (tau - S_0) a = (S_2 - tau) (trial - tau) between S_0 and the smaller of S_2 and `trial`, for trial >
 * S_0. From S_0 up, with both ends measured from there, nothing cancels: at S_2 = S_0 it is S_0, at a = 0 the smaller
 * end. */
QUERN_INLINE quern_real flow_stress(quern_real s0, quern_real s2, quern_real trial, quern_real a) {
	const quern_real u = s2 - s0, v = trial - s0, apart = u - v;
	const quern_real root = __builtin_sqrt(apart * apart + a * (a + 2 * (u + v)));
	return s0 + 2 * u * v / (u + v + a + root);
}

QUERN_INLINE quern_real within(quern_real x, quern_real most) {
	return x < -most ? -most : x < most ? x : most;
}

/* kg/m^3: what is looser bears nothing, however it flows. */
QUERN_INLINE quern_real loosest_of(const mu_i *law) {
	const quern_real flow = law->flow_density * (1 - (law->dilation > 0 ? widest : 0));
	return flow > 0 && flow < law->critical_density ? flow : law->critical_density;
}

/* By which factor the pressure p of a point changes that shears by `strain`, and the density from which on such a flow bears. Its inertial number is
 * that of the pressure around it, to first order that of the point's own, and at the end of the step: if a mean alone counted, which follows late,
 * waves of pressure and density would grow; if the root of the point's own did, what scatters would be too loose in the mean. What stretches along
 * the flow's own axis shears faster: were the pressure to gain more by that than the stretching takes, the flow would not resist being squeezed. */
typedef struct {
	quern_real grown, least;
} dilatancy;
QUERN_INLINE dilatancy dilate(
	const mu_i *law, quern_real p, quern_real around, quern_real rho, quern_real strain, quern_real number) {
	const quern_real loose = law->dilation * number, answers = 0.5 * loose * p / around,
					 own = 1.5 * loose - answers, wide = own > 0 ? own < widest ? own : widest : 0;
	/* e^share to second order: where flow is no looser for being fast, waves are not to grow */
	const quern_real share = p / law->bulk_modulus,
					 flow = law->flow_density * (1 - wide) * (1 + share * (1 + 0.5 * share));
	const quern_real off = rho / flow - 1,
					 pace = steepness / (1 + steepness * (wide / (1 - wide) + quern_abs(off))),
					 gain = pace * law->bulk_modulus * strain,
					 more = gain * off / (p + gain * (answers + share));
	const quern_real least = law->flow_density * (1 - (loose < widest ? loose : widest));
	return (dilatancy) { 1 + within(more, step_most),
		least < law->critical_density ? least : law->critical_density };
}

QUERN_INLINE void put_outputs(const int dim, const mu_i *law, const quern_material_batch *b) {
	put_wave_speeds(dim, law->bulk_modulus, law->shear, loosest_of(law), b);
	put_hypoelastic_energies(dim, law->bulk_modulus, law->shear, b);
}

/* `dim`, `rated`, `relaxed`, `mean` and `dilates` are constants in every caller. */
QUERN_INLINE void kernel(const int dim, const bool rated, const bool relaxed, const bool mean,
	const bool dilates, const mu_i *self, const quern_material_batch *b) {
	const mu_i law = *self;
	const quern_real dt = b->dt, shear = law.shear, lambda = law.bulk_modulus - 2 * shear / dim;
	const quern_real mu_s = law.static_friction, mu_2 = law.limit_friction;
	const quern_real thick = law.diameter * __builtin_sqrt(law.grain_density);
	const quern_real slowness = shear * law.inertial_number * dt / thick; /* a over sqrt p */
	const quern_real per_strain = dt > 0 ? 1 / (shear * dt) : 0;
	const quern_real critical = law.critical_density, one_over_critical = 1 / critical,
					 loosest = loosest_of(&law);
	const quern_real pull = relaxed ? 1 - quern_exp(-law.pressure_rate * dt) : 0;
	const quern_real *restrict grid_density = b->grid_density, *restrict mean_pressure = b->mean_pressure;
	quern_real *restrict density = b->density, *restrict rate = rated ? b->use[SHEAR_RATE].real[0] : NULL;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const symmetric old = SYMMETRIC_AT(b->stress, i, dim);
		const tensor l = TENSOR_AT(b->gradient, i, dim);
		symmetric trial = elastic_trial(dim, old, l, dt, shear, lambda);
		const quern_real rho = density[i];
		if (relaxed) { /* p += (1 - e^(-beta dt)) (max(0, K ln(rho/rho_c)) - p) */
			const quern_real target = law.bulk_modulus * quern_log(rho * one_over_critical);
			const quern_real more = pull * ((target > 0 ? target : 0) + symmetric_mean(dim, trial));
			trial = symmetric_scale_shift(dim, 1, trial, -more);
		}
		const quern_real p = -symmetric_mean(dim, trial);
		const symmetric s = symmetric_deviator(dim, trial);
		const quern_real tau = __builtin_sqrt(symmetric_half_square(dim, s));
		const bool flows = tau > mu_s * p;
		const bool known = mean && mean_pressure[i] > 0;
		const quern_real around = known ? mean_pressure[i] : p; /* of the inertial number */
		const quern_real flow = flow_stress(mu_s * p, mu_2 * p, tau, slowness * __builtin_sqrt(around));
		quern_real grown = 1, least = critical;
		bool bore = false;
		if (dilates) {
			const bool slides = flows & (p > 0);
			const quern_real now = (tau - (slides ? flow : 0)) * per_strain;
			const dilatancy d =
				dilate(&law, slides ? p : law.bulk_modulus, slides ? around : law.bulk_modulus, rho, now * dt,
					(slides | known) ? now * thick / __builtin_sqrt(around) : 0);
			grown = slides ? d.grown : 1;
			least = known ? d.least : critical;
			bore = (symmetric_mean(dim, old) < 0) & (rho >= loosest);
		}
		/* what flows bears though it is looser than what lies still; what has come to rest so goes on to bear */
		const bool dilute = (rho < least) & !bore, open = dilute | (p <= 0);
		/* an elastic stress keeps its bits, so that a point at rest stays as it is */
		const symmetric closed =
			symmetric_select(flows, symmetric_scale_shift(dim, grown * (flow / tau), s, -(grown * p)), trial);
		const symmetric stress = symmetric_select(open, (symmetric) { 0, 0, 0, 0, 0, 0 }, closed);
		SYMMETRIC_PUT(b->stress, i, stress, dim);
		const quern_real loose = grid_density[i] < least ? grid_density[i] : least;
		density[i] = dilute ? loose : rho;
		if (rated) rate[i] = (tau - (open ? 0 : flows ? flow : tau)) * per_strain;
	}
	put_outputs(dim, &law, b);
}

QUERN_INLINE void update_as(
	const int dim, const bool rated, const bool mean, const mu_i *self, const quern_material_batch *b) {
	if (self->flow_density > 0) kernel(dim, rated, false, mean, true, self, b);
	else if (self->pressure_rate > 0) kernel(dim, rated, true, mean, false, self, b);
	else kernel(dim, rated, false, mean, false, self, b);
}

QUERN_INLINE void update(const int dim, const void *self, const quern_material_batch *b) {
	const bool rated = b->use[SHEAR_RATE].real[0] != NULL, mean = b->mean_pressure != NULL;
	if (rated && mean) update_as(dim, true, true, self, b);
	else if (rated) update_as(dim, true, false, self, b);
	else if (mean) update_as(dim, false, true, self, b);
	else update_as(dim, false, false, self, b);
}
static void update_2d(const void *self, const quern_material_batch *b) { update(2, self, b); }
static void update_3d(const void *self, const quern_material_batch *b) { update(3, self, b); }

/* Whatever the rate was, no flow carries more than mu_2 p. */
QUERN_INLINE void assign(const int dim, const void *self, const quern_material_batch *b) {
	const mu_i law = *(const mu_i *)self;
	const quern_real softness = 1 / law.bulk_modulus;
	quern_real *restrict density = b->density;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const symmetric given = SYMMETRIC_AT(b->stress, i, dim), s = symmetric_deviator(dim, given);
		const quern_real p = -symmetric_mean(dim, given), limit = law.limit_friction * p;
		const quern_real tau = __builtin_sqrt(symmetric_half_square(dim, s));
		const bool pressed = p > 0;
		const symmetric held =
			symmetric_select(tau > limit, symmetric_scale_shift(dim, limit / tau, s, -p), given);
		const symmetric stress = symmetric_select(pressed, held, (symmetric) { 0, 0, 0, 0, 0, 0 });
		SYMMETRIC_PUT(b->stress, i, stress, dim);
		density[i] = law.critical_density * quern_exp((pressed ? p : 0) * softness);
	}
	put_outputs(dim, &law, b);
}
static void assign_2d(const void *self, const quern_material_batch *b) { assign(2, self, b); }
static void assign_3d(const void *self, const quern_material_batch *b) { assign(3, self, b); }

static void moduli(const void *self, uint32_t dim, quern_real *bulk, quern_real *shear, quern_real *density) {
	const mu_i *law = self;
	(void)dim;
	*bulk = law->bulk_modulus;
	*shear = law->shear;
	*density = law->critical_density;
}

static void friction(const void *self, uint32_t dim, quern_real *slow, quern_real *fast, quern_real *number,
	quern_real *density) {
	const mu_i *law = self;
	(void)dim;
	*slow = law->static_friction;
	*fast = law->limit_friction;
	*number = law->inertial_number;
	*density = law->grain_density;
}

static quern_real loosest(const void *self) { return loosest_of(self); }

static const quern_material_ops ops = { .size = sizeof ops,
	.update = { update_2d, update_3d },
	.assign = { assign_2d, assign_3d },
	.moduli = moduli,
	.friction = friction,
	.loosest = loosest };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 4,
	.dims = QUERN_2D | QUERN_3D,
	.id = "material.mu_i",
	.brief = "Grains as a fluid whose friction grows with the rate of flow: mu(I).",
	.doc =
		"Elastic in rates below the yield stress. Above it the shear stress over the pressure is mu(I), "
		"solved "
		"implicitly, so that viscosity never limits the step. It resists no tension, and below the critical "
		"density nothing: such a point takes its volume from the grid until it is dense again. With flow_density "
		"what flows comes to a density of its own, the looser the faster it flows, and bears there.",
	.cite = "Dunatunga & Kamrin 2015; Jop, Forterre & Pouliquen 2006; Pailha & Pouliquen 2009",
	.instance_size = sizeof(mu_i),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
