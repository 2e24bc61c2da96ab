/* SPDX-License-Identifier: MIT */
/* sensors - places that stay where they are, and the temperature of the continuum there */
#include "heat.h"

quern_status heat_place_sensors(const heat *p, const quern_step *s) {
	const sensor *given = p->sensors.items;
	int32_t *from = s->host->memory(s->run, p->sensors.n * sizeof *from);
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < p->sensors.n; i++) from[i] = -1;
	const quern_status status = s->host->remap(s->run, "sensor", p->sensors.n, from, 0, NULL);
	for (uint32_t i = 0; status == QUERN_OK && i < p->sensors.n; i++)
		for (uint32_t k = 0; k < s->dim; k++) s->use[FILL_PLACE].real[k][i] = given[i].position[k];
	return status;
}

/* Entry of a node in the row set, periodic axes wrapped; -1 where there is none. */
static int32_t entry_of(const quern_grid_view *g, const int32_t node[3]) {
	int32_t at[3];
	for (uint32_t a = 0; a < 3; a++) {
		at[a] = node[a];
		if (a < g->dim && g->periodic[a]) at[a] = (at[a] % g->cells[a] + g->cells[a]) % g->cells[a];
	}
	return quern_grid_entry(g, at);
}

/* Where there is no continuum, the last reading stands. */
quern_status heat_measure(const void *self, const quern_step *s) {
	const quern_grid_view *g = s->host->grid(s->run);
	const uint32_t n = s->host->set(s->run, "sensor").n;
	const quern_row *rows = (const quern_row *)(const void *)s->use[MEASURE_CAPACITY].real[0];
	weights *w = s->host->scratch(s->run, 0, sizeof *w);
	reach r;
	(void)self;
	if (!w) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) {
		quern_real sum = 0, all = 0;
		heat_weights(g, &s->slot[SLOT_SHAPE][0], s->use[MEASURE_PLACE].real, i, 1, w);
		heat_reach(g, w, 0, &r);
		for (uint32_t q = 0; q < r.n; q++) {
			const int32_t e = r.value[q] > 0 ? entry_of(g, r.at[q]) : -1;
			if (e < 0 || !(rows[e][LANE_CAPACITY] > 0)) continue;
			sum += r.value[q] * (rows[e][LANE_HEAT] + s->dt * rows[e][LANE_RATE]) / rows[e][LANE_CAPACITY];
			all += r.value[q];
		}
		if (all > 1e-6) s->use[MEASURE_READING].real[0][i] = sum / all;
	}
	return QUERN_OK;
}
