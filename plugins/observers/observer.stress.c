/* SPDX-License-Identifier: MIT */
/* observer.stress - mean stress of grains in a region, from contacts and from velocities. docs/theory/grains.md, section 9
 *
 * s_ab = 1/V (sum over contacts of f_a l_b + sum over grains of m c_a c_b), where f acts on the first grain, l is the part in the region of
 * the branch from the second to the first, and c a velocity less the mean. Pressure counts as positive. */
#include "../common/cloud.h"
#include "observers.h"
#include "region.h"
#include <math.h>
#include <quern/math.h>

typedef struct {
	observer_region region;
	quern_real lower[3], upper[3]; /* m, of the region inside the domain as the scene has it */
	bool bounded[3], periodic[3];
} observer;
static const quern_param params[] = { REGION_PARAMS(observer, QUERN_MAYBE), QUERN_END_PARAMS };
/* clang-format off */
#define OWN_USES(X) \
	X(POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(VELOCITY, "grain.velocity", "m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(FIRST, "contact.first", "1", QUERN_READ, QUERN_INDEX, .flags = QUERN_OPTIONAL, .target = "grain") \
	X(SECOND, "contact.second", "1", QUERN_READ, QUERN_INDEX, .flags = QUERN_OPTIONAL, .target = "grain") \
	X(FORCE, "contact.force", "N", QUERN_READ, QUERN_VECTOR, .with = "contact.first") \
	X(BOX_LENGTH, "total.box_length", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(BOX_SPEED, "total.box_speed", "m/s", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(BOX_OFFSET, "total.box_offset", "m", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(BOX_SLIDE, "total.box_slide", "m/s", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL)
/* clang-format on */
QUERN_USE_ENUM_FROM(CLOUD_USES_ROWS, OWN_USES);
static const quern_use uses[] = { CLOUD_USES(QUERN_USE_ROW) OWN_USES(QUERN_USE_ROW) QUERN_END_USES };

enum { CONTACT, KINETIC = 9, PRESSURE = 15, FRICTION, GRAINS };
static const quern_output outputs[] = {
	{ .name = "xx",
		.unit = "Pa",
		.doc = "Of contacts: along x, by branches along x; in 2-D force per length." },
	{ .name = "xy", .unit = "Pa", .doc = "Along x, by branches along y." },
	{ .name = "xz", .unit = "Pa", .doc = "Along x, by branches along z; 0 in 2-D, like all with z." },
	{ .name = "yx", .unit = "Pa", .doc = "Along y, by branches along x." },
	{ .name = "yy", .unit = "Pa", .doc = "Along y, by branches along y." },
	{ .name = "yz", .unit = "Pa", .doc = "Along y, by branches along z." },
	{ .name = "zx", .unit = "Pa", .doc = "Along z, by branches along x." },
	{ .name = "zy", .unit = "Pa", .doc = "Along z, by branches along y." },
	{ .name = "zz", .unit = "Pa", .doc = "Along z, by branches along z." },
	{ .name = "kinetic_xx",
		.unit = "Pa",
		.doc = "Of velocities less their mean, and less the flow of a box that is strained." },
	{ .name = "kinetic_yy", .unit = "Pa", .doc = "The same along y." },
	{ .name = "kinetic_zz", .unit = "Pa", .doc = "The same along z." },
	{ .name = "kinetic_xy", .unit = "Pa", .doc = "Of both along x and y." },
	{ .name = "kinetic_yz", .unit = "Pa", .doc = "Of both along y and z." },
	{ .name = "kinetic_xz", .unit = "Pa", .doc = "Of both along x and z." },
	{ .name = "pressure", .unit = "Pa", .doc = "Mean of the normal stress of both along all axes." },
	{ .name = "friction", .unit = "1", .doc = "Minus xy over yy, of both; 0 where yy is." },
	{ .name = "grains", .unit = "1", .doc = "Grains that move in the region, with their weights." },
	{ .name = NULL }
};

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	observer *o = self;
	if (region_init(&o->region, setup, err) != QUERN_OK) return QUERN_E_PARAM;
	for (uint32_t k = 0; k < setup->dim; k++) {
		const quern_real lower = o->region.lower[k], upper = o->region.upper[k];
		o->periodic[k] = setup->periodic[k];
		o->lower[k] = isnan(lower) ? setup->lower[k] : fmax(lower, setup->lower[k]);
		o->upper[k] = isnan(upper) ? setup->upper[k] : fmin(upper, setup->upper[k]);
		o->bounded[k] = o->lower[k] > setup->lower[k] || o->upper[k] < setup->upper[k];
		if (!(o->upper[k] > o->lower[k]))
			return setup->host->fail(err, QUERN_E_PARAM, "region.box.upper",
				"the region lies outside of the domain along axis %u", k);
	}
	return QUERN_OK;
}

/* ---- where ---- */

/* The region now, and what lies between images: whole lengths along the axes, and for y an offset along x. */
typedef struct place {
	quern_real lower[3], upper[3], domain[3], length[3], speed[3], offset, slide, volume;
	bool bounded;
	uint32_t dim;
} place;

/* A box that is strained is taken whole: a part of it would not stay where it is. */
static place place_of(const observer *o, const quern_observer_batch *b) {
	const quern_column *u = b->use;
	const bool boxed = u[BOX_LENGTH].real[0] != NULL;
	place p = { .dim = b->dim, .volume = 1 };
	for (uint32_t k = 0; k < b->dim; k++) {
		p.lower[k] = o->lower[k], p.upper[k] = o->upper[k];
		p.domain[k] = b->lower[k];
		p.length[k] = o->periodic[k] ? b->upper[k] - b->lower[k] : 0;
		p.bounded = p.bounded || o->bounded[k];
		if (!boxed) continue;
		p.length[k] = u[BOX_LENGTH].real[k][0], p.speed[k] = u[BOX_SPEED].real[k][0];
		p.upper[k] = p.lower[k] + p.length[k];
	}
	if (boxed) p.offset = u[BOX_OFFSET].real[0][0], p.slide = u[BOX_SLIDE].real[0][0];
	for (uint32_t k = 0; k < b->dim; k++) p.volume *= p.upper[k] - p.lower[k];
	return p;
}

/* From the second to the first, as the nearest image lies. */
static void branch_of(const place *p, quern_real *const *x, uint32_t i, uint32_t j, quern_real l[3]) {
	for (uint32_t k = 0; k < p->dim; k++) l[k] = x[k][i] - x[k][j];
	if (p->length[1] > 0) {
		const quern_real n = quern_floor(l[1] / p->length[1] + 0.5);
		l[1] -= n * p->length[1];
		l[0] -= n * p->offset;
	}
	for (uint32_t k = 0; k < p->dim; k += 2)
		if (p->length[k] > 0) l[k] -= p->length[k] * quern_floor(l[k] / p->length[k] + 0.5);
}

/* The share of the line from `at` back along l that lies in the region. */
static quern_real inside(const place *p, const quern_real at[3], const quern_real l[3]) {
	quern_real from = 0, to = 1;
	for (uint32_t k = 0; k < p->dim; k++) {
		if (l[k] == 0) {
			if (!(at[k] >= p->lower[k] && at[k] < p->upper[k])) return 0;
			continue;
		}
		const quern_real a = (at[k] - p->lower[k]) / l[k], b = (at[k] - p->upper[k]) / l[k];
		from = quern_max(from, quern_min(a, b));
		to = quern_min(to, quern_max(a, b));
	}
	return to > from ? to - from : 0;
}

/* The same of all its images: of those that the region can see, since a line is shorter than half the domain, and begins in it or hardly
 * beside it. */
static quern_real share_of(const place *p, quern_real *const *x, uint32_t i, const quern_real l[3]) {
	quern_real sum = 0, at[3] = { 0 };
	int32_t most[3] = { 0 };
	if (!p->bounded) return 1;
	for (uint32_t k = 0; k < p->dim; k++) most[k] = p->length[k] > 0 ? 1 : 0;
	for (int32_t nz = -most[2]; nz <= most[2]; nz++)
		for (int32_t ny = -most[1]; ny <= most[1]; ny++)
			for (int32_t nx = -most[0]; nx <= most[0]; nx++) {
				const int32_t n[3] = { nx, ny, nz };
				for (uint32_t k = 0; k < p->dim; k++) at[k] = x[k][i] + n[k] * p->length[k];
				sum += inside(p, at, l);
			}
	return sum;
}

/* Whether a grain's centre is in the region, once it has been brought back into the domain. */
static bool holds(const place *p, quern_real *const *x, uint32_t i) {
	for (uint32_t k = 0; k < p->dim && p->bounded; k++) {
		const quern_real gone = p->length[k] > 0 ? quern_floor((x[k][i] - p->domain[k]) / p->length[k]) : 0;
		const quern_real at = x[k][i] - gone * p->length[k];
		if (!(at >= p->lower[k] && at < p->upper[k])) return false;
	}
	return true;
}

/* ---- sums ---- */

/* Pairs across blocks stand in both, and count where the first is at home. */
static quern_status add_contacts(
	const place *p, const quern_observer_batch *b, quern_real *out, const quern_host *host, quern_run *run) {
	const quern_column *u = b->use;
	const quern_set_view grains = host->set(run, "grain"), contacts = host->set(run, "contact");
	quern_real *term = host->memory(run, 9 * ((size_t)contacts.n + 1) * sizeof *term);
	const quern_real *weight = u[GRAIN_WEIGHT].real[0];
	const size_t n = contacts.n;
	if (!term) return QUERN_E_MEMORY;
	if (!u[FIRST].index || !u[FORCE].real[0]) return QUERN_OK;
	for (uint32_t block = 0; block < contacts.n_blocks; block++)
		for (uint32_t q = contacts.block[block]; q < contacts.block[block + 1]; q++) {
			const uint32_t i = (uint32_t)u[FIRST].index[q], j = (uint32_t)u[SECOND].index[q];
			quern_real l[3] = { 0 };
			if (i < grains.block[block] || i >= grains.block[block + 1] ||
				!(cloud_square(&u[FORCE], q, b->dim) > 0))
				continue;
			branch_of(p, u[POSITION].real, i, j, l);
			const quern_real share = share_of(p, u[POSITION].real, i, l),
							 carried = weight ? quern_min(weight[i], weight[j]) : 1;
			for (uint32_t k = 0; k < b->dim; k++)
				for (uint32_t m = 0; m < b->dim; m++)
					term[(3 * k + m) * n + q] = carried * share * u[FORCE].real[k][q] * l[m];
		}
	for (uint32_t k = 0; k < 9; k++)
		out[CONTACT + k] = host->sum_set(run, "contact", term + k * n) / p->volume;
	return QUERN_OK;
}

/* Velocity along an axis, less the flow of a box that is strained. */
static quern_real own_velocity(const place *p, const quern_column *u, uint32_t k, uint32_t i) {
	const quern_real v = u[VELOCITY].real[k][i];
	if (!u[BOX_LENGTH].real[0]) return v;
	const quern_real along = p->speed[k] / p->length[k],
					 across = k == 0 ? (p->slide - along * p->offset) / p->length[1] : 0;
	return v - along * (u[POSITION].real[k][i] - p->domain[k]) -
		   across * (u[POSITION].real[1][i] - p->domain[1]);
}

static quern_status add_velocities(
	const place *p, const quern_observer_batch *b, quern_real *out, const quern_host *host, quern_run *run) {
	static const int pair[6][2] = { { 0, 0 }, { 1, 1 }, { 2, 2 }, { 0, 1 }, { 1, 2 }, { 0, 2 } };
	const quern_column *u = b->use;
	const cloud grains = observed(b, false);
	cloud_sums c;
	quern_real mean[3] = { 0 };
	if (!cloud_open(&c, host, run, &grains)) return QUERN_E_MEMORY;
	quern_real *number = host->memory(run, ((size_t)grains.n + 1) * sizeof *number);
	if (!number) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < grains.n; i++) {
		const bool in = holds(p, u[POSITION].real, i);
		c.mass[i] = in ? c.mass[i] : 0;
		number[i] = in ? cloud_mass(&grains, i) / grains.mass[i] : 0;
	}
	out[GRAINS] = host->sum_set(run, "grain", number);
	const quern_real mass = cloud_total(&c);
	if (!(mass > 0)) return QUERN_OK;
	for (uint32_t k = 0; k < b->dim; k++) {
		CLOUD_ADD(&c, i, own_velocity(p, u, k, i), mean[k]);
		mean[k] /= mass;
	}
	for (int m = 0; m < 6; m++) {
		const uint32_t k = (uint32_t)pair[m][0], l = (uint32_t)pair[m][1];
		if (k >= b->dim || l >= b->dim) continue;
		CLOUD_ADD(&c, i, (own_velocity(p, u, k, i) - mean[k]) * (own_velocity(p, u, l, i) - mean[l]),
			out[KINETIC + m]);
		out[KINETIC + m] /= p->volume;
	}
	return QUERN_OK;
}

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const observer *o = self;
	const place p = place_of(o, b);
	if (!b->use[POSITION].real[0]) return QUERN_OK;
	if (p.bounded && b->use[BOX_LENGTH].real[0])
		return host->stop(run, QUERN_E_PARAM, NULL, -1,
			"observer.stress: a part of a box that is strained (grains.box) does not stay where it is: leave out region");
	const quern_status status = add_contacts(&p, b, out, host, run);
	if (status != QUERN_OK || add_velocities(&p, b, out, host, run) != QUERN_OK) return QUERN_E_MEMORY;
	for (uint32_t k = 0; k < b->dim; k++) out[PRESSURE] += (out[CONTACT + 4 * k] + out[KINETIC + k]) / b->dim;
	const quern_real normal = out[CONTACT + 4] + out[KINETIC + 1];
	if (normal != 0) out[FRICTION] = -(out[CONTACT + 1] + out[KINETIC + 3]) / normal;
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.stress",
	.brief = "Mean stress of grains in a region: of contacts, and of velocities beside it.",
	.doc =
		"Pressure is positive. Of contacts between grains; those on bodies have no part in it, so keep the region a diameter away from "
		"bodies. A mean flow that changes across the region counts in the kinetic part.",
	.cite = "Love 1927; Weber 1966; Irving & Kirkwood 1950",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
