/* SPDX-License-Identifier: MIT */
/* gain - motion that nobody has given: docs/theory/hybrid.md, section 5 */
#include "../common/rotation.h"
#include "contacts.h"

/* A spring that stiffens holds less than half of force times overlap, and the tangential one about as much again. */
static quern_real in_contacts(const quern_step *s) {
	const contact_list list = contacts_of(s, A_FORCE, A_FIRST, A_SECOND, A_GRAIN_POSITION);
	const quern_real *radius = s->use[A_GRAIN_RADIUS].real[0];
	quern_real sum = 0;
	contact_seen c;
	const uint32_t *by_place = s->host->parts(s->run, "contact")->by_place;
	for (uint32_t k = 0; k < list.contacts.n_blocks; k++) {
		const uint32_t b = quern_nth(by_place, k);
		for (uint32_t q = list.contacts.block[b]; q < list.contacts.block[b + 1]; q++) {
			if (!contact_at(&list, b, q, &c)) continue;
			const quern_real overlap = radius[c.first] + radius[c.second] - sqrt(c.distance2);
			if (overlap > 0) sum += sqrt(c.force2) * overlap;
		}
	}
	return sum;
}

static quern_real in_spins(const quern_step *s) {
	const quern_column *u = s->use;
	const quern_real share = 0.5 * quern_radius_inertia(s->dim);
	const quern_parts *grains = s->host->parts(s->run, "grain");
	quern_real sum = 0;
	for (uint32_t q = 0; u[A_GRAIN_SPIN].real[0] && q < grains->n; q++) {
		const uint32_t i = quern_nth(grains->entry, q);
		const quern_real r = u[A_GRAIN_RADIUS].real[0][i],
						 m = u[A_GRAIN_WEIGHT].real[0][i] * u[A_GRAIN_MASS].real[0][i];
		for (uint32_t k = 0; k < (s->dim == 3 ? 3 : 1); k++)
			sum += share * m * r * r * u[A_GRAIN_SPIN].real[k][i] * u[A_GRAIN_SPIN].real[k][i];
	}
	return sum;
}

static quern_real in_points(const quern_step *s) {
	const quern_column *u = s->use;
	const quern_bound *material = &s->slot[SLOT_MATERIAL][0];
	quern_real bulk, shear, density, sum = 0;
	((const quern_material_ops *)material->ops)->moduli(material->self, s->dim, &bulk, &shear, &density);
	const quern_real softness = 0.5 / bulk, shear_softness = shear > 0 ? 0.5 / shear : 0;
	const int dim = (int)s->dim;
	const quern_parts *points = s->host->parts(s->run, "point");
	for (uint32_t q = 0; q < points->n; q++) {
		const uint32_t i = quern_nth(points->entry, q);
		sum += u[A_POINT_WEIGHT].real[0][i] * u[A_POINT_VOLUME].real[0][i] *
			   symmetric_held(dim, softness, shear_softness, SYMMETRIC_AT(u[A_POINT_STRESS].real, i, dim));
	}
	return sum;
}

quern_real quern_hybrid_held(const quern_step *s) { return in_contacts(s) + in_spins(s) + in_points(s); }

/* What bodies have done, if any moves. */
static quern_real by_bodies(const quern_step *s) {
	const quern_real *work = s->use[A_BODY_WORK].real[0];
	quern_real sum = 0;
	for (uint32_t b = 0; b < s->n_slot[SLOT_BODIES] && work; b++) sum += work[b];
	return sum;
}

static quern_real poured(const quern_step *s) {
	return book_total(s->use[A_POURED_ENERGY].real[0], s->host->set(s->run, "grain_source").n);
}

void quern_hybrid_begin_gain(const quern_step *s, quern_real kinetic) {
	s->use[A_ENERGY].real[0][0] = kinetic + quern_hybrid_held(s) - poured(s);
	s->use[A_WORK].real[0][0] = -by_bodies(s);
}

/* What there can be: at first or when it was poured, and what gravity and bodies have given. */
static quern_real there_can_be(const quern_step *s) {
	return s->use[A_ENERGY].real[0][0] + poured(s) + fmax(s->use[A_WORK].real[0][0] + by_bodies(s), 0);
}

void quern_hybrid_lower_gain(const quern_step *s, quern_real kinetic) {
	if (kinetic + quern_hybrid_held(s) < there_can_be(s)) quern_hybrid_begin_gain(s, kinetic);
}

/* Bodies that stand still do no work, contacts and the coupling take energy. Twice what there can be, since a
 * conversion may make some; what lifts all by a diameter, since steps within their limits keep energy about as well
 * as that; and, where nothing pulls, what round-off moves: a millionth of a diameter in a step. */
quern_status quern_hybrid_judge_gain(
	const hybrid *h, const quern_step *s, quern_real kinetic, quern_real carried) {
	const quern_real still = 1e-6 * h->diameter / s->dt;
	const quern_real lift = h->gain * quern_gravity_size(s->dim, s->gravity) * h->diameter;
	const quern_real slack = carried * (lift + 0.5 * still * still);
	if (!(h->gain > 0) || kinetic <= 2 * there_can_be(s) + slack) return QUERN_OK;
	return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
		"grains and points move with %.3g J, though they had %.3g J when last looked at or when they were poured, and "
		"gravity and bodies have given %.3g J since: steps of %.3g s make energy, they are too long, or "
		"grains grow too fast in a jam (hybrid.growth); hybrid.gain says what is allowed",
		kinetic, s->use[A_ENERGY].real[0][0] + poured(s), s->use[A_WORK].real[0][0] + by_bodies(s), s->dt);
}
