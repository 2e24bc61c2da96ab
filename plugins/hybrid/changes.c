/* SPDX-License-Identifier: MIT */
/* changes - of the cells that would change zone in an update, those that may: the scene says how many. docs/theory/hybrid.md,
 * section 3 */
#include "update.h"
#include <stdlib.h>

typedef struct {
	quern_real distance; /* m, from the surface; with a minus sign where the farthest comes first */
	uint32_t cell, place;
	int32_t turn;
} change;

/* Cells that become hybrid make the zone wider, those that leave it make it narrower: in this order grains and continuum never
 * come to lie side by side. Towards grains before towards continuum, each from the zone's edge onwards. */
static int32_t turn_of(int32_t old, int32_t new) { return 2 * (new != QUERN_HYBRID) + (new > old); }

static int sooner(const void *left, const void *right) {
	const change *a = left, *b = right;
	if (a->turn != b->turn) return a->turn < b->turn ? -1 : 1;
	if (a->distance != b->distance) return a->distance < b->distance ? -1 : 1;
	return a->place < b->place ? -1 : a->place > b->place;
}

/* Nobody is in an empty cell, and at the first update there is no zone yet that could change too fast. */
quern_status quern_hybrid_limit_changes(update *d) {
	const int32_t *zone = d->u[U_ZONE].index;
	uint32_t n = 0, filled = 0;
	if (!(d->h->most_changes < 1) || d->s->step <= 1) return QUERN_OK;
	change *all = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof *all);
	if (!all) return QUERN_E_MEMORY;
	for (uint32_t q = 0; q < d->n_cells; q++) {
		const uint32_t c = nth_cell(d, q);
		if (!(d->mass[c] > 0)) continue;
		filled++;
		if (d->zone[c] == zone[c]) continue;
		const bool grains = d->zone[c] < zone[c];
		all[n++] = (change) { grains ? d->near[c] : -d->near[c], c, q, turn_of(zone[c], d->zone[c]) };
	}
	const quern_real share = d->h->most_changes * filled;
	const uint32_t most = share > 1 ? (uint32_t)share : 1;
	if (n <= most) return QUERN_OK;
	qsort(all, n, sizeof *all, sooner);
	for (uint32_t i = most; i < n; i++) {
		d->zone[all[i].cell] = zone[all[i].cell];
		d->changed--;
	}
	return QUERN_OK;
}
