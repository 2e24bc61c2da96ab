/* SPDX-License-Identifier: MIT */
/* packing - whether the continuum is given the density that settled grains have. docs/calibration.md */
#include "update.h"
#include <math.h>

/* Cells: one of two diameters varies by a tenth. Of a few what is far off can be told. */
enum { MANY = 50, FEWEST = 10 };
#define AWAY 4 /* diameters from a body, beside which grains pack more loosely */
#define OFF 0.01
#define FAR_OFF 0.1
#define MOST_COMPRESSED                                                                                      \
	0.05 /* a continuum that gives way more is softer than grains, and its modulus says nothing of them */
#define AT_REST 1e-3 /* kinetic energy over m g d, above what settling leaves */
#define BORNE                                                                                                \
	1 /* pressure over rho g d: a second layer of grains bears more, and what has been let go bears nothing */

/* What is deep in the grains: neither near the surface, where oracles keep them, nor near a body. */
static bool is_bulk(const update *d, uint32_t c) {
	return d->zone[c] != QUERN_DISCRETE && d->point_begin[c] == d->point_begin[c + 1] &&
		   d->wall[c] > AWAY * d->h->diameter + d->g->cell;
}

void quern_hybrid_add_to_bed(const update *d, uint32_t c, bed *sum) {
	quern_real stress[6], v2 = d->spread[c] * d->spread[c];
	quern_hybrid_contact_stress(d, c, stress);
	for (uint32_t k = 0; k < d->s->dim; k++) {
		sum->pressure -= stress[k] / d->s->dim;
		v2 += d->velocity[k][c] * d->velocity[k][c];
	}
	sum->kinetic += 0.5 * d->mass[c] * v2;
	sum->mass += d->mass[c];
	sum->cells++;
}

bool quern_hybrid_is_at_rest(const update *d, const bed *sum) {
	const quern_real weight = quern_gravity_size(d->s->dim, d->s->gravity) * d->h->diameter;
	return weight > 0 && sum->kinetic <= AT_REST * sum->mass * weight &&
		   sum->pressure >= BORNE * sum->cells * d->h->packed * weight;
}

/* Grains under their weight are a little denser than the continuum without stress: by p/K. Where they still move, or
 * there are few of them, nobody knows. */
void quern_hybrid_packing(const update *d) {
	const hybrid *h = d->h;
	const quern_bound *material = d->s->slot[SLOT_MATERIAL];
	quern_real bulk, shear, density;
	bed sum = { 0 };
	for (uint32_t q = 0; q < d->n_cells; q++) {
		const uint32_t c = nth_cell(d, q);
		if (is_bulk(d, c)) quern_hybrid_add_to_bed(d, c, &sum);
	}
	if (sum.cells < FEWEST || cells_are_narrow(h) || !quern_hybrid_is_at_rest(d, &sum)) return;
	((const quern_material_ops *)material->ops)->moduli(material->self, d->s->dim, &bulk, &shear, &density);
	const quern_real compressed = fmax(0, sum.pressure / sum.cells) / bulk;
	if (compressed > MOST_COMPRESSED) return;
	const quern_real found = sum.mass / (sum.cells * quern_grid_cell_volume(d->g)) / (1 + compressed);
	const quern_real off = h->packed / found - 1;
	if (fabs(off) > (sum.cells < MANY ? FAR_OFF : OFF))
		d->s->host->log(d->s->run, 2,
			"the continuum's density is %.4g kg/m^3, and these grains have settled at %.4g, without what their "
			"weight compresses: %.1f %% %s; quern calibrate measures it, docs/calibration.md",
			h->packed, found, 100 * fabs(off), off < 0 ? "too little" : "too much");
}
