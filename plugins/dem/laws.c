/* SPDX-License-Identifier: MIT */
/* laws - what pairs and touches share: a law's own columns gathered, the call, and what is put back */
#include "forces.h"
#include <string.h>

bool quern_dem_is_history(const quern_use *row) { return !strncmp(row->field, "contact.", 8); }

/* The row says that there are couples; they are the solver's own column. */
static bool is_couple(const quern_use *row) { return !strcmp(row->field, "contact.couple"); }

/* Own columns of the contacts, or of both grains; against a body both are the first's. */
static void gather_rows(const forces_shared *sh, const forces_work *w, const quern_bound *law, law_row *rows,
	bool against_body, uint32_t begin, uint32_t n, quern_column *use, quern_column *use_second) {
	const quern_column *columns = against_body ? law->again : law->column;
	for (uint32_t r = 0; r < law->n_uses; r++) {
		const quern_use *row = &law->uses[r];
		const bool history = quern_dem_is_history(row);
		use[r] = use_second[r] = (quern_column) { .real = { NULL } };
		for (uint32_t k = 0; k < quern_shape_size(row->shape, sh->s->dim) && !is_couple(row); k++) {
			const void *whole = quern_component(&columns[r], row->shape, k);
			if (!whole) continue;
			quern_gather(
				row->shape, rows[r].mine[k], whole, history ? begin : 0, history ? w->slot : w->first, n);
			quern_set_component(&use[r], row->shape, k, rows[r].mine[k]);
			if (history) continue;
			if (!against_body) quern_gather(row->shape, rows[r].other[k], whole, 0, w->second, n);
			quern_set_component(
				&use_second[r], row->shape, k, against_body ? rows[r].mine[k] : rows[r].other[k]);
		}
	}
}

static void forget(uint8_t shape, void *column, uint32_t begin, uint32_t n, quern_real initial) {
	if (shape == QUERN_INDEX) {
		int32_t *restrict to = (int32_t *)column + begin;
		for (uint32_t q = 0; q < n; q++) to[q] = (int32_t)initial;
	} else {
		quern_real *restrict to = (quern_real *)column + begin;
		for (uint32_t q = 0; q < n; q++) to[q] = initial;
	}
}

/* Contacts that were left out forget, contacts that were kept remember. */
static void scatter_rows(const forces_shared *sh, const forces_work *w, const quern_bound *law,
	const law_row *rows, bool against_body, uint32_t begin, uint32_t n_slots, uint32_t n) {
	const quern_column *columns = against_body ? law->again : law->column;
	for (uint32_t r = 0; r < law->n_uses; r++) {
		const quern_use *row = &law->uses[r];
		if (!quern_dem_is_history(row) || is_couple(row) || row->access == QUERN_READ) continue;
		for (uint32_t k = 0; k < quern_shape_size(row->shape, sh->s->dim); k++) {
			void *whole = quern_component(&columns[r], row->shape, k);
			if (!whole || row->shape == QUERN_ID) continue;
			forget(row->shape, whole, begin, n_slots, row->initial);
			quern_scatter(row->shape, whole, rows[r].mine[k], begin, w->slot, n);
		}
	}
}

static void clear(quern_real *const *column, uint32_t count, uint32_t n) {
	for (uint32_t k = 0; k < count && column[k]; k++) memset(column[k], 0, n * sizeof(quern_real));
}

static quern_contact_batch batch_of(const forces_shared *sh, const forces_work *w, uint32_t n) {
	quern_contact_batch b = { .n = n,
		.cap = sh->cap,
		.dt = sh->dt,
		.overlap = w->overlap,
		.radius = w->radius,
		.mass = w->mass,
		.stored = w->stored,
		.sheared = w->sheared,
		.rubbed = w->rubbed };
	for (uint32_t k = 0; k < 3; k++) {
		b.normal[k] = w->normal[k];
		b.velocity[k] = w->velocity[k];
		b.spin[k] = w->spin[k];
		b.turn[k] = w->turn[k];
		b.force[k] = w->force[k];
		b.couple[k] = w->couple[k];
		b.dashpot[k] = w->dashpot[k];
		b.drag_couple[k] = w->drag_couple[k];
	}
	clear(w->force, 3, n);
	clear(w->couple, 3, n);
	clear(w->dashpot, 3, n);
	clear(w->drag_couple, 3, n);
	clear(&w->stored, 1, n);
	clear(&w->sheared, 1, n);
	clear(&w->rubbed, 1, n);
	return b;
}

void quern_dem_call_laws(
	const forces_shared *sh, forces_work *w, int32_t body, uint32_t begin, uint32_t n_slots, uint32_t n) {
	quern_column use[QUERN_MOST_USES], use_second[QUERN_MOST_USES];
	quern_contact_batch b = batch_of(sh, w, n);
	law_row *rows = w->rows;
	b.use = use;
	b.use_second = use_second;
	for (uint32_t l = 0; l < sh->n_laws; l++) {
		const quern_bound *law = &sh->s->slot[SLOT_CONTACT][l];
		const void *self = body >= 0 && law->n_variant ? law->variant[body] : law->self;
		gather_rows(sh, w, law, rows, body >= 0, begin, n, use, use_second);
		if (n) ((const quern_contact_ops *)law->ops)->force[sh->s->dim - 2](self, &b);
		if (!sh->looks) scatter_rows(sh, w, law, rows, body >= 0, begin, n_slots, n);
		rows += law->n_uses;
	}
}

void quern_dem_add_couples(const forces_shared *sh, const forces_work *w, quern_real (*row)[8], uint32_t lane,
	quern_real *const couple[3], int32_t body, uint32_t first, uint32_t last, uint32_t n) {
	const bool weighted = sh->use[FORCE_WEIGHT].real[0] != NULL;
	const uint32_t spare = last - first, dim = sh->s->dim, turns = dim == 3 ? 3 : 1;
	for (uint32_t q = 0; q < n; q++) {
		const uint32_t i = (uint32_t)w->first[q] - first, j = (uint32_t)w->second[q] - first;
		const quern_real share = weighted ? w->weight[q] : 1;
		for (uint32_t k = 0; k < turns; k++) {
			row[i < spare ? i : spare][lane + k] += share * couple[k][q];
			if (body < 0) row[j < spare ? j : spare][lane + k] -= share * couple[k][q];
		}
	}
}

void quern_dem_keep(const forces_work *w, quern_real *const given[3], quern_column out, uint32_t components,
	uint32_t begin, uint32_t n_slots, uint32_t n) {
	for (uint32_t k = 0; k < components && out.real[0]; k++) {
		memset(out.real[k] + begin, 0, n_slots * sizeof(quern_real));
		for (uint32_t q = 0; q < n && given[k]; q++) out.real[k][begin + (uint32_t)w->slot[q]] = given[k][q];
	}
}
