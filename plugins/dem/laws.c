/* SPDX-License-Identifier: MIT */
/* laws - a law's own columns gathered, the call, and what is put back */
#include "forces.h"
#include <string.h>

bool quern_dem_is_history(const quern_use *row) { return !strncmp(row->field, "contact.", 8); }

/* The row says that there are couples; they are the solver's own column. */
static bool is_couple(const quern_use *row) { return !strcmp(row->field, "contact.couple"); }

static bool is_known(const forces_shared *sh, const quern_real *column) {
	for (uint32_t h = 0; h < sh->n_history; h++)
		if (sh->history[h].column == column) return true;
	return false;
}

bool quern_dem_find_history(forces_shared *sh) {
	const quern_step *s = sh->s;
	size_t most = 1;
	for (uint32_t l = 0; l < sh->n_laws; l++) most += 9 * (size_t)s->slot[SLOT_CONTACT][l].n_uses;
	history_column *found = s->host->memory(s->run, most * sizeof *found);
	if (!found) return false;
	sh->history = found;
	for (uint32_t l = 0; l < sh->n_laws; l++)
		for (uint32_t r = 0; r < s->slot[SLOT_CONTACT][l].n_uses; r++) {
			const quern_use *row = &s->slot[SLOT_CONTACT][l].uses[r];
			const quern_column *columns = &s->slot[SLOT_CONTACT][l].column[r];
			const bool real = row->shape != QUERN_INDEX && row->shape != QUERN_ID;
			if (!real || !quern_dem_is_history(row) || is_couple(row)) continue;
			for (uint32_t k = 0; k < quern_shape_size(row->shape, s->dim); k++)
				if (columns->real[k] && !is_known(sh, columns->real[k]))
					found[sh->n_history++] = (history_column) { columns->real[k],
						quern_shape_initial(row->shape, s->dim, k, row->initial) };
		}
	return true;
}

#ifdef __AVX512VL__
/* Whether it is known bit by bit whose numbers these are, which is of use with AVX-512 alone. */
static bool by_bits(const contact_chunk *c, uint8_t shape) {
	return c->near && shape != QUERN_INDEX && shape != QUERN_ID;
}
#endif

static void recall(const forces_work *w, const contact_chunk *c, uint8_t shape, void *to, const void *whole) {
#ifdef __AVX512VL__
	if (by_bits(c, shape) && 3 * c->n > c->n_slots) { /* of a few one by one is faster */
		quern_compress_real(c->n_slots, c->near, (const quern_real *)whole + c->begin, to);
		return;
	}
#endif
	quern_gather(shape, to, whole, c->begin, w->slot, c->n);
}

/* Own columns of the contacts, or of both grains; against a body both are the first's. */
static void gather_rows(const forces_shared *sh, const forces_work *w, const contact_chunk *c,
	const quern_bound *law, law_row *rows, quern_column *use, quern_column *use_second) {
	const bool paired = c->body < 0;
	const quern_column *columns = paired ? law->column : law->again;
	for (uint32_t r = 0; r < law->n_uses; r++) {
		const quern_use *row = &law->uses[r];
		const bool history = quern_dem_is_history(row);
		use[r] = use_second[r] = (quern_column) { .real = { NULL } };
		for (uint32_t k = 0; k < quern_shape_size(row->shape, sh->s->dim) && !is_couple(row); k++) {
			const void *whole = quern_component(&columns[r], row->shape, k);
			if (!whole) continue;
			if (history) recall(w, c, row->shape, rows[r].mine[k], whole);
			else quern_gather(row->shape, rows[r].mine[k], whole, 0, w->first, c->n);
			quern_set_component(&use[r], row->shape, k, rows[r].mine[k]);
			if (history) continue;
			if (paired) quern_gather(row->shape, rows[r].other[k], whole, 0, w->second, c->n);
			quern_set_component(&use_second[r], row->shape, k, paired ? rows[r].other[k] : rows[r].mine[k]);
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

static void remember(const forces_work *w, const contact_chunk *c, uint8_t shape, quern_real initial,
	void *whole, const void *mine) {
#ifdef __AVX512VL__
	if (by_bits(c, shape)) {
		quern_expand_real(c->n_slots, c->near, mine, (quern_real *)whole + c->begin, initial);
		return;
	}
#endif
	if (c->n < c->n_slots) forget(shape, whole, c->begin, c->n_slots, initial);
	quern_scatter(shape, whole, mine, c->begin, w->slot, c->n);
}

/* Contacts that were left out forget, contacts that were kept remember. */
static void scatter_rows(const forces_shared *sh, const forces_work *w, const contact_chunk *c,
	const quern_bound *law, const law_row *rows) {
	const quern_column *columns = c->body < 0 ? law->column : law->again;
	for (uint32_t r = 0; r < law->n_uses; r++) {
		const quern_use *row = &law->uses[r];
		if (!quern_dem_is_history(row) || is_couple(row) || row->access == QUERN_READ) continue;
		for (uint32_t k = 0; k < quern_shape_size(row->shape, sh->s->dim); k++) {
			void *whole = quern_component(&columns[r], row->shape, k);
			if (!whole || row->shape == QUERN_ID) continue;
			remember(w, c, row->shape, quern_shape_initial(row->shape, sh->s->dim, k, row->initial), whole,
				rows[r].mine[k]);
		}
	}
}

/* Laws add to what they give. */
static void clear(quern_real *const *column, uint32_t count, uint32_t n) {
	for (uint32_t k = 0; k < count && column[k]; k++) memset(column[k], 0, n * sizeof(quern_real));
}
static void clear_given(const forces_work *w, uint32_t n, bool looks) {
	clear(w->force, 3, n);
	clear(w->couple, 3, n);
	clear(w->dashpot, 3, n);
	clear(w->drag_couple, 3, n);
	clear(&w->rubbed, 1, n);
	if (!looks) return;
	clear(&w->stored, 1, n);
	clear(&w->sheared, 1, n);
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
		.rubbed = w->rubbed,
		.losses_only = !sh->looks };
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
	return b;
}

static void give_means(const forces_work *w, bool asks, quern_contact_batch *b) {
	for (uint32_t k = 0; k < 3; k++) {
		b->mean_velocity[k] = asks ? w->mean_velocity[k] : NULL;
		b->mean_spin[k] = asks ? w->mean_spin[k] : NULL;
	}
}

void quern_dem_call_laws(const forces_shared *sh, forces_work *w, const contact_chunk *c) {
	quern_column use[QUERN_MOST_USES], use_second[QUERN_MOST_USES];
	const quern_integrator_ops *integrator = dem_integrator(sh->s)->ops;
	quern_contact_batch b = batch_of(sh, w, c->n);
	b.lag = sh->predicts ? integrator->lag * sh->s->dt * sh->s->dt : 0;
	law_row *rows = w->rows;
	b.use = use;
	b.use_second = use_second;
	clear_given(w, c->n, sh->looks);
	for (uint32_t l = 0; l < sh->n_laws; l++) {
		const quern_bound *law = &sh->s->slot[SLOT_CONTACT][l];
		const void *self = dem_law(law, c->item, c->body);
		const quern_contact_ops *ops = law->ops;
		gather_rows(sh, w, c, law, rows, use, use_second);
		give_means(w, ops->means, &b);
		if (c->n) ops->force[sh->s->dim - 2](self, &b);
		if (!sh->looks) scatter_rows(sh, w, c, law, rows);
		rows += law->n_uses;
	}
}
