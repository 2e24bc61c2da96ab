/* SPDX-License-Identifier: MIT */
/* rates - how fast the material of a cell deforms, what presses it together and how much it shakes, of both clouds.
 * docs/theory/hybrid.md, section 3 */
#include "update.h"
#include <math.h>

quern_real quern_hybrid_points_pressure(const update *d, uint32_t c, const quern_real *weight) {
	const uint32_t dim = d->s->dim;
	quern_real sum = 0, all = 0;
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
		const int32_t i = d->point[q];
		for (uint32_t k = 0; k < dim; k++) sum -= weight[i] * d->u[U_POINT_STRESS].real[k][i] / dim;
		all += weight[i];
	}
	return all > 0 ? sum / all : 0;
}

/* Pressure of both clouds in their shares; only the sum is the material's. */
static quern_real pressure_of(const update *d, uint32_t c) {
	quern_real stress[6], grains = 0;
	const quern_real share = 1 - old_share(d, (int32_t)c);
	quern_hybrid_contact_stress(d, c, stress);
	for (uint32_t k = 0; k < d->s->dim; k++) grains -= stress[k] / d->s->dim;
	return share * grains + (1 - share) * quern_hybrid_points_pressure(d, c, d->u[U_POINT_MASS].real[0]);
}

/* Gradient of what cells have along one axis; one-sided where one of the neighbours is empty. */
static quern_real slope(const update *d, const int32_t cell[3], uint32_t axis, const quern_real *of) {
	const int32_t here = quern_grid_entry(d->g, cell);
	const int32_t up = cell_beside(d, (uint32_t)here, axis, 1),
				  down = cell_beside(d, (uint32_t)here, axis, -1);
	const int32_t high = up >= 0 && d->mass[up] > 0 ? up : here,
				  low = down >= 0 && d->mass[down] > 0 ? down : here;
	const quern_real way = ((high != here) + (low != here)) * d->g->cell;
	return way > 0 ? (of[high] - of[low]) / way : 0;
}

/* What cells are judged by, by cell: what they have now, or its mean over the last updates. */
typedef struct {
	const quern_real *velocity[3], *pressure, *scatter; /* scatter: square of the velocities' spread */
} looked_at;

/* Shear rate of the mean velocities; `square` becomes the sum of squares of their gradient. */
static quern_real shear_rate(const update *d, const looked_at *v, const int32_t cell[3], quern_real *square) {
	const uint32_t dim = d->s->dim;
	quern_real l[3][3], sum = 0, trace = 0;
	*square = 0;
	for (uint32_t b = 0; b < dim; b++) {
		for (uint32_t a = 0; a < dim; a++) {
			l[a][b] = slope(d, cell, b, v->velocity[a]);
			*square += l[a][b] * l[a][b];
		}
		trace += l[b][b];
	}
	for (uint32_t a = 0; a < dim; a++)
		for (uint32_t b = 0; b < dim; b++) {
			const quern_real rate = 0.5 * (l[a][b] + l[b][a]) - (a == b ? trace / dim : 0);
			sum += rate * rate;
		}
	return sqrt(2 * sum);
}

/* Of one cell; columns that nobody reads are NULL. The spread of velocities in a cell is partly that of their mean, by
 * h^2/12 along each axis. */
static void rates_of(const update *d, const looked_at *v, uint32_t c, quern_real *rate) {
	const quern_column *u = d->u;
	quern_real *inertial = u[U_INERTIAL].real[0], *pressure = u[U_PRESSURE].real[0],
			   *agitation = u[U_AGITATION].real[0];
	int32_t cell[3];
	const bool there = quern_grid_cell_of(d->g, c, cell) && d->mass[c] > 0;
	quern_real square = 0;
	const quern_real shear = there ? shear_rate(d, v, cell, &square) : 0;
	if (rate) rate[c] = shear;
	if (!v->pressure) return;
	const quern_real p = there ? v->pressure[c] : 0, h = d->g->cell;
	const quern_real scatter = v->scatter[c] - h * h / 12 * square;
	const quern_real temperature = scatter > 0 ? scatter / d->s->dim : 0;
	if (inertial) inertial[c] = p > 0 ? shear * d->h->diameter * sqrt(d->h->density / p) : 0;
	if (pressure) pressure[c] = p;
	if (agitation) agitation[c] = p > 0 ? d->h->density * temperature / p : 0;
}

/* How much the rate changes over a grain's diameter. */
static quern_real change_of(const update *d, uint32_t c, const quern_real *rate) {
	int32_t cell[3];
	quern_real square = 0;
	if (!(d->mass[c] > 0) || !quern_grid_cell_of(d->g, c, cell)) return 0;
	for (uint32_t k = 0; k < d->s->dim; k++) {
		const quern_real along = slope(d, cell, k, rate);
		square += along * along;
	}
	return d->h->diameter * sqrt(square);
}

/* The mean of a number over the last updates, of as many as there have been since the cell was empty. */
static void follow(quern_real *mean, quern_real now, int32_t n) { *mean += (now - *mean) / n; }

static void follow_all(const update *d, const quern_real *pressure, const quern_real *scatter) {
	const quern_column *u = d->u;
	int32_t *n = u[U_AVERAGED].index;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		n[c] = !(d->mass[c] > 0) ? 0 : n[c] < d->h->average ? n[c] + 1 : d->h->average;
		if (!n[c]) continue;
		for (uint32_t k = 0; k < d->s->dim; k++)
			follow(&u[U_MEAN_VELOCITY].real[k][c], d->velocity[k][c], n[c]);
		follow(&u[U_MEAN_PRESSURE].real[0][c], pressure[c], n[c]);
		follow(&u[U_MEAN_SCATTER].real[0][c], scatter[c], n[c]);
	}
}

/* Grains of a cell are few: their mean velocity is noise where the flow is slow, and its mean over time less so. */
static bool look(update *d, looked_at *v) {
	const quern_column *u = d->u;
	const size_t size = ((size_t)d->n_cells + 1) * sizeof(quern_real);
	const bool averages = u[U_AVERAGED].index;
	*v = (looked_at) { .pressure = NULL };
	for (uint32_t k = 0; k < d->s->dim; k++)
		v->velocity[k] = averages ? u[U_MEAN_VELOCITY].real[k] : d->velocity[k];
	if (!averages && !u[U_INERTIAL].real[0] && !u[U_PRESSURE].real[0] && !u[U_AGITATION].real[0]) return true;
	quern_real *pressure = d->s->host->memory(d->s->run, size),
			   *scatter = d->s->host->memory(d->s->run, size);
	if (!pressure || !scatter) return false;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		pressure[c] = d->mass[c] > 0 ? pressure_of(d, c) : 0;
		scatter[c] = d->spread[c] * d->spread[c];
	}
	if (averages) follow_all(d, pressure, scatter);
	v->pressure = averages ? u[U_MEAN_PRESSURE].real[0] : pressure;
	v->scatter = averages ? u[U_MEAN_SCATTER].real[0] : scatter;
	return true;
}

quern_status quern_hybrid_rates(update *d) {
	const quern_column *u = d->u;
	quern_real *rate = u[U_SHEAR_RATE].real[0], *change = u[U_RATE_CHANGE].real[0];
	looked_at v;
	if (!rate && !change && !u[U_INERTIAL].real[0] && !u[U_PRESSURE].real[0] && !u[U_AGITATION].real[0])
		return QUERN_OK;
	if (!rate && change) rate = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof *rate);
	if ((!rate && change) || !look(d, &v)) return QUERN_E_MEMORY;
	for (uint32_t c = 0; c < d->n_cells; c++) rates_of(d, &v, c, rate);
	for (uint32_t c = 0; c < d->n_cells && change; c++) change[c] = change_of(d, c, rate);
	return QUERN_OK;
}
