/* SPDX-License-Identifier: MIT */
/* nodes - what plugins in the slots are called with: chunks of points, aligned and filled up */
#include "heat.h"

/* Lanes up to the capacity hold the last point again: a kernel may compute them. */
static void take(const quern_real *from, quern_real shift, uint32_t n, quern_real *to) {
	for (uint32_t i = 0; i < CHUNK; i++) to[i] = from[i < n ? i : n - 1] - shift;
}

void heat_weights(const quern_grid_view *g, const quern_bound *shape, quern_real *const x[3], uint32_t begin,
	uint32_t n, weights *w) {
	quern_shape_batch b = { .n = n, .cap = CHUNK, .dim = g->dim, .inverse_cell = 1 / g->cell };
	for (uint32_t a = 0; a < g->dim; a++) {
		take(x[a] + begin, g->lower[a], n, w->position[a]);
		b.position[a] = w->position[a];
		b.wall[a][0] = g->periodic[a] ? INT32_MIN : 0;
		b.wall[a][1] = g->periodic[a] ? INT32_MAX : g->cells[a];
		b.first[a] = w->first[a];
		for (int k = 0; k < 3; k++) {
			b.value[a][k] = w->value[a][k];
			b.slope[a][k] = w->slope[a][k];
		}
	}
	((const quern_shape_ops *)shape->ops)->weights(shape->self, &b);
}

void heat_reach(const quern_grid_view *g, const weights *w, uint32_t i, reach *r) {
	r->n = g->dim == 3 ? 27 : 9;
	for (uint32_t q = 0; q < r->n; q++) {
		const uint32_t at[3] = { q % 3, q / 3 % 3, q / 9 };
		r->value[q] = 1;
		for (uint32_t a = 0; a < g->dim; a++) {
			r->at[q][a] = w->first[a][i] + (int32_t)at[a];
			r->value[q] *= w->value[a][at[a]][i];
			r->slope[q][a] = 1;
			for (uint32_t k = 0; k < g->dim; k++)
				r->slope[q][a] *= k == a ? w->slope[k][at[k]][i] : w->value[k][at[k]][i];
		}
		for (uint32_t a = g->dim; a < 3; a++) r->at[q][a] = 0, r->slope[q][a] = 0;
	}
}

void heat_reach_tile(const quern_grid_view *g, const weights *w, uint32_t b, uint32_t i, reach *r) {
	heat_reach(g, w, i, r);
	for (uint32_t q = 0; q < r->n; q++) {
		r->place[q] = 0;
		for (uint32_t a = g->dim; a-- > 0;)
			r->place[q] = r->place[q] * (int32_t)g->span + r->at[q][a] - (g->at[b][a] * (int32_t)g->edge - 1);
	}
}

static quern_column column_from(quern_column c, uint8_t shape, uint32_t begin) {
	if (shape == QUERN_INDEX) c.index = c.index ? c.index + begin : NULL;
	else if (shape == QUERN_ID) c.id = c.id ? c.id + begin : NULL;
	else
		for (int k = 0; k < 9; k++) c.real[k] = c.real[k] ? c.real[k] + begin : NULL;
	return c;
}

void heat_conductivity(const quern_bound *law, const quern_real *temperature, uint32_t begin, uint32_t n,
	quern_real out[CHUNK]) {
	_Alignas(64) quern_real given[CHUNK];
	quern_column own[QUERN_MOST_USES];
	for (uint32_t r = 0; r < law->n_uses; r++)
		own[r] = column_from(law->column[r], law->uses[r].shape, begin);
	take(temperature + begin, 0, n, given);
	const conductivity_batch b = {
		.n = n, .cap = CHUNK, .temperature = given, .conductivity = out, .use = own
	};
	((const conductivity_ops *)law->ops)->conductivity(law->self, &b);
}
