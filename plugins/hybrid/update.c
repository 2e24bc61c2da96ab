/* SPDX-License-Identifier: MIT */
/* update - the order of a zone update. docs/theory/hybrid.md, section 6, says why it is this one */
#include "update.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Zones from the state as it is, then weights, then books, then material that comes and goes. */
static quern_status reckon(update *d) {
	quern_hybrid_averages(d);
	d->pose = quern_body_poses_now(d->s, SLOT_BODIES);
	if (!d->pose) return QUERN_E_MEMORY;
	quern_status status = quern_hybrid_walls(d);
	if (status != QUERN_OK) return status;
	quern_hybrid_fixed(d);
	status = quern_hybrid_density(d);
	if (status != QUERN_OK) return status;
	quern_hybrid_fractions(d);
	if (d->failed) return QUERN_E_MEMORY;
	status = quern_hybrid_rates(d);
	if (status == QUERN_OK) status = quern_hybrid_zones(d);
	if (status == QUERN_OK) status = quern_hybrid_limit_changes(d);
	if (status == QUERN_OK) status = quern_hybrid_shares(d);
	if (status != QUERN_OK) return status;
	quern_hybrid_weigh(d);
	quern_hybrid_crowding(d);
	status = quern_hybrid_hand_over(d);
	if (status == QUERN_OK) status = quern_hybrid_grains(d);
	if (status == QUERN_OK) status = quern_hybrid_points(d);
	return d->failed ? QUERN_E_MEMORY : status;
}

static quern_status apply(update *d) {
	memcpy(d->u[U_ZONE].index, d->zone, d->n_cells * sizeof(int32_t));
	if (d->u[U_WEIGHT].real[0]) memcpy(d->u[U_WEIGHT].real[0], d->share, d->n_cells * sizeof(quern_real));
	quern_status status = quern_hybrid_apply_grains(d);
	if (status == QUERN_OK) status = quern_hybrid_apply_points(d);
	return status == QUERN_OK ? quern_hybrid_normals(d) : status;
}

static quern_status once(const hybrid *h, const quern_step *s, uint32_t *changed) {
	update d = { .h = h, .s = s };
	quern_status status = quern_hybrid_sort(&d);
	if (status == QUERN_OK) {
		d.full = h->packed * quern_grid_cell_volume(d.g);
		d.nominal = d.full / (s->dim == 2 ? 4 : 8);
		status = reckon(&d);
	}
	if (status == QUERN_OK && !s->use[U_UPDATES].index[0]) quern_hybrid_packing(&d);
	if (status == QUERN_OK) status = apply(&d);
	free(d.points);
	free(d.grains);
	*changed += d.changed;
	s->use[U_UPDATES].index[0]++;
	return status;
}

/* ---- what the log says ---- */

static quern_real carried_mass(const quern_step *s) {
	const cloud clouds[2] = { moving_grains(s), all_points(s) };
	quern_real sum = 0;
	for (int k = 0; k < 2; k++) {
		const uint32_t *order = s->host->parts(s->run, clouds[k].set)->entry;
		for (uint32_t q = 0; q < clouds[k].n; q++) sum += cloud_mass(&clouds[k], quern_nth(order, q));
	}
	return sum;
}

void quern_hybrid_look(const void *self, const quern_step *s, quern_real *out) {
	const cloud grains = moving_grains(s);
	const quern_real all = carried_mass(s);
	quern_real sum = 0;
	(void)self;
	for (uint32_t i = 0; i < grains.n; i++) sum += cloud_mass(&grains, i);
	out[0] = all > 0 ? 100 * sum / all : NAN;
}

static void say(const quern_step *s, uint32_t changed) {
	const quern_column *u = s->use;
	const quern_real passed = u[U_PASSED].real[0] ? u[U_PASSED].real[0][0] : 0;
	const quern_real all = u[U_MASS].real[0][0] - passed, whole = all > 0 ? all : 1;
	quern_real entries = 0;
	const quern_parts *cells = s->host->parts(s->run, "cell");
	for (uint32_t q = 0; q < cells->n; q++) {
		const uint32_t c = quern_nth(cells->entry, q);
		entries += fabs(u[U_OWED].real[0][c]);
	}
	s->host->log(s->run, -1,
		"update %d at step %lld: %u cells changed zone, entries %.4f of the mass, carried mass %+.4f",
		u[U_UPDATES].index[0], (long long)s->step, changed, entries / whole,
		all > 0 ? carried_mass(s) / whole - 1 : 0);
}

/* What left while the grains settled, less what sources have poured at once: books of what passes know of both. */
static quern_real passed_before(const quern_step *s) {
	return book_total(s->use[U_LEFT].real[0], s->host->set(s->run, "grain_face").n) -
		   book_total(s->use[U_POURED].real[0], s->host->set(s->run, "grain_source").n);
}

/* The first step only gathers contact stresses: without them new points would start unloaded. The first update then
 * runs twice, since no cell passes from grains to continuum in one. */
quern_status quern_hybrid_update(const void *self, const quern_step *s) {
	const hybrid *h = self;
	const quern_column *u = s->use;
	uint32_t changed = 0;
	if (s->step == 0) {
		update d = { .h = h, .s = s };
		u[U_MASS].real[0][0] = carried_mass(s) + passed_before(s);
		return quern_hybrid_sort(&d); /* so that there are cells to gather stress in */
	}
	if ((s->step - 1) % h->every) return QUERN_OK;
	quern_status status = once(h, s, &changed);
	if (status == QUERN_OK && s->step == 1) status = once(h, s, &changed);
	if (status != QUERN_OK) return status;
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, s->dim); k++)
		memset(u[U_STRESS].real[k], 0, s->host->set(s->run, "cell").n * sizeof(quern_real));
	u[U_SAMPLES].real[0][0] = 0;
	say(s, changed);
	return QUERN_OK;
}
