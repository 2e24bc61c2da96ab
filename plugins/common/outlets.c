/* SPDX-License-Identifier: MIT */
#include "outlets.h"
#include "radius.h"
#include "renew.h"
#include <math.h>

/* The face that entry i has passed, the first in their order; -1: none. What is fixed stays wherever it is. */
static int32_t passed(const quern_step *s, const outlets *o, uint32_t i) {
	if (o->of.fixed && o->of.fixed[i]) return -1;
	for (uint32_t k = 0; k < s->dim; k++) {
		const quern_real x = o->position->real[k][i];
		if (s->open[0][k] && x < s->lower[k]) return (int32_t)(2 * k);
		if (s->open[1][k] && x > s->upper[k]) return (int32_t)(2 * k + 1);
	}
	return -1;
}

/* Seldom does anybody leave, so that a look along the columns comes first. */
static bool any_outside(const quern_step *s, const outlets *o) {
	int outside = 0;
	for (uint32_t k = 0; k < s->dim; k++) {
		if (!s->open[0][k] && !s->open[1][k]) continue;
		const quern_real *restrict x = o->position->real[k];
		const quern_real lower = s->open[0][k] ? s->lower[k] : -INFINITY,
						 upper = s->open[1][k] ? s->upper[k] : INFINITY;
		for (uint32_t i = 0; i < o->of.n; i++) outside |= (x[i] < lower) | (x[i] > upper);
	}
	return outside;
}

static void book_entry(const quern_step *s, const outlets *o, uint32_t i, uint32_t face) {
	const quern_real mass = cloud_mass(&o->of, i);
	booking b = { .mass = mass, .count = o->of.weight ? o->of.weight[i] : 1 };
	quern_real each = o->energy ? o->energy[i] : 0;
	for (uint32_t k = 0; k < s->dim; k++) {
		const quern_real lent = o->lent && o->lent->real[0] ? o->moving * o->lent->real[k][i] : 0,
						 v = o->velocity->real[k][i] - lent;
		b.momentum[k] = mass * v;
		each += 0.5 * v * v;
	}
	if (o->spin && o->spin->real[0])
		each += 0.5 * quern_radius_inertia(s->dim) * o->radius[i] * o->radius[i] *
				cloud_square(o->spin, i, s->dim == 3 ? 3 : 1);
	b.energy = mass * each;
	b.potential = mass * cloud_height(o->position, i, s->dim, s->gravity);
	book_add(o->books, face, s->dim, &b);
	if (o->pull) *o->pull += mass * o->moving;
}

quern_status quern_outlets_run(const quern_step *s, const outlets *o) {
	if (!any_outside(s, o)) return QUERN_OK;
	const quern_parts *p = s->host->parts(s->run, o->set);
	bool *drop = s->host->memory(s->run, (size_t)p->n + 1);
	if (!drop) return QUERN_E_MEMORY;
	for (uint32_t q = 0; q < p->n; q++) {
		const uint32_t i = quern_nth(p->entry, q);
		const int32_t face = passed(s, o, i);
		drop[i] = face >= 0;
		if (drop[i]) book_entry(s, o, i, (uint32_t)face);
	}
	return quern_renew(s, &(renewal) { .set = o->set, .drop = drop });
}
