/* SPDX-License-Identifier: MIT */
/* update - the order of a zone update. docs/theory/hybrid.md, section 6, says why it is this one */
#include "update.h"
#include <math.h>
#include <stdio.h>
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
	if (status == QUERN_OK) status = quern_hybrid_weigh(d);
	if (status != QUERN_OK) return status;
	status = quern_hybrid_crowding(d);
	if (status == QUERN_OK) status = quern_hybrid_hand_over(d);
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

/* Of a full cell's mass: what is less, a grain that splashes, does not say how fast material is. */
static const quern_real least_told = 0.1;

/* Cells that the fastest material passes from one update to the next. */
static quern_real cells_passed(const update *d) {
	quern_real most = 0;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		quern_real v2 = 0;
		for (uint32_t k = 0; k < d->s->dim && d->mass[c] > least_told * d->full; k++)
			v2 += d->velocity[k][c] * d->velocity[k][c];
		most = fmax(most, v2);
	}
	return sqrt(most) * d->s->dt * d->h->every / d->g->cell;
}

typedef struct news {
	uint32_t changed;  /* cells that changed zone */
	quern_real passed; /* cells */
} news;

static quern_status once(const hybrid *h, const quern_step *s, news *n) {
	update d = { .h = h, .s = s };
	quern_status status = quern_hybrid_sort(&d);
	if (status == QUERN_OK) {
		d.full = h->packed * quern_grid_cell_volume(d.g);
		d.nominal = d.full / (s->dim == 2 ? 4 : 8);
		status = reckon(&d);
	}
	if (status == QUERN_OK && !s->use[U_UPDATES].index[0]) quern_hybrid_packing(&d);
	if (status == QUERN_OK) status = apply(&d);
	free(d.points.made);
	free(d.grains);
	n->changed += d.changed;
	if (status == QUERN_OK) n->passed = cells_passed(&d);
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

/* Booked to the last bit, and yet nobody moves it: what goes through cells unseen is owed where it was. */
static void warn_of_uncarried(const quern_step *s, quern_real off, quern_real passed) {
	quern_real *ever = &s->use[U_UNCARRIED].real[0][0];
	if (steps_passed(fabs(off)) > steps_passed(*ever)) {
		char why[160];
		if (off > 0)
			snprintf(why, sizeof why,
				"the ledger owes as much (sums.owed in summary.json), and takes it back where it can");
		else if (passed > 0.5)
			snprintf(why, sizeof why,
				"material goes %.2g cells from one update of the zones to the next; a smaller hybrid.update "
				"sees it pass",
				passed);
		else
			snprintf(why, sizeof why,
				"there is no room for it where it waits; quern calibrate says which density continuum.material "
				"takes, and another hybrid.packer may find room");
		s->host->log(s->run, 2,
			off < 0 ? "grains and points carry %.0f %% less than there is: the rest stands in the ledger; %s"
					: "grains and points carry %.0f %% more than there is: %s",
			100 * fabs(off), why);
	}
	*ever = fmax(*ever, fabs(off));
}

static void say(const quern_step *s, const news *n) {
	const quern_column *u = s->use;
	const quern_real passed = u[U_PASSED].real[0] ? u[U_PASSED].real[0][0] : 0;
	const quern_real all = u[U_MASS].real[0][0] - passed, whole = all > 0 ? all : 1;
	const quern_real off = all > 0 ? carried_mass(s) / whole - 1 : 0;
	quern_real entries = 0;
	const quern_parts *cells = s->host->parts(s->run, "cell");
	for (uint32_t q = 0; q < cells->n; q++) {
		const uint32_t c = quern_nth(cells->entry, q);
		entries += fabs(u[U_OWED].real[0][c]);
	}
	s->host->log(s->run, -1,
		"update %d at step %lld: %u cells changed zone, entries %.4f of the mass, carried mass %+.4f",
		u[U_UPDATES].index[0], (long long)s->step, n->changed, entries / whole, off);
	warn_of_uncarried(s, off, n->passed);
}

/* What left while the grains settled, less what sources have poured at once: books of what passes know of both. */
static quern_real passed_before(const quern_step *s) {
	return book_total(s->use[U_LEFT].real[0], s->host->set(s->run, "grain_face").n) -
		   book_total(s->use[U_POURED].real[0], s->host->set(s->run, "grain_source").n);
}

static void warn_of_narrow(const hybrid *h, const quern_step *s) {
	if (cells_are_narrow(h))
		s->host->log(s->run, 2,
			"the grid's cells (continuum.cell) are %.2f diameters of a grain wide: below 1.5 mass waits in entries "
			"and a bed at rest trembles and sinks; take 2 (docs/stability.md, section 5)",
			h->cell / h->diameter);
}

/* The first step only gathers contact stresses: without them new points would start unloaded. The first update then
 * runs twice, since no cell passes from grains to continuum in one. */
quern_status quern_hybrid_update(const void *self, const quern_step *s) {
	const hybrid *h = self;
	const quern_column *u = s->use;
	news n = { .changed = 0 };
	if (s->step == 0) {
		update d = { .h = h, .s = s };
		u[U_MASS].real[0][0] = carried_mass(s) + passed_before(s);
		warn_of_narrow(h, s);
		return quern_hybrid_sort(&d); /* so that there are cells to gather stress in */
	}
	if (!zones_are_due(h, s)) return QUERN_OK;
	quern_status status = once(h, s, &n);
	if (status == QUERN_OK && s->step == 1) status = once(h, s, &n);
	if (status != QUERN_OK) return status;
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, s->dim); k++)
		memset(u[U_STRESS].real[k], 0, s->host->set(s->run, "cell").n * sizeof(quern_real));
	u[U_SAMPLES].real[0][0] = 0;
	say(s, &n);
	return QUERN_OK;
}
