/* SPDX-License-Identifier: MIT */
/* density - how dense the densest place is: what both clouds carry there over what would fill its open room without stress. A cell
 * of two diameters holds four discs, and its mass is chance; a window of hundreds of grains is not. docs/theory/hybrid.md, section 5 */
#include "../common/symmetric.h"
#include "update.h"
#include <math.h>
#include <stdio.h>

/* Grains of a window, and of one that walls and faces have cut. */
enum { GRAINS = 300, FEWEST = 100, WIDEST = 8, WORDS = 96 };

typedef struct looking {
	const update *d;
	uint32_t axis;    /* along which sums are being made */
	int reach;        /* cells to each side of a window's middle */
	quern_real least; /* kg that fill the smallest window which says something */
	/* by cell, before and after the present sums: kg carried; kg that would fill it without stress */
	quern_real *mass[2], *room[2];
} looking;

/* A window is a row of rows: sums along one axis after the other. What has no entry holds nothing, and ends a row. */
static void sum_block(void *arg, uint32_t b, uint32_t worker) {
	const looking *l = arg;
	(void)worker;
	for (uint32_t c = b * QUERN_BLOCK_CELLS; c < (b + 1) * QUERN_BLOCK_CELLS; c++) {
		quern_real mass = l->mass[0][c], room = l->room[0][c];
		for (int way = -1; way <= 1; way += 2) {
			int32_t at = cell_beside(l->d, c, l->axis, way);
			for (int k = 0; k < l->reach && at >= 0; k++) {
				mass += l->mass[0][at];
				room += l->room[0][at];
				at = cell_beside(l->d, (uint32_t)at, l->axis, way);
			}
		}
		l->mass[1][c] = mass;
		l->room[1][c] = room;
	}
}

static void sum_windows(looking *l) {
	const update *d = l->d;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		l->mass[0][c] = d->u[U_CARRIED].real[0][c];
		l->room[0][c] = d->u[U_ROOM].real[0][c];
	}
	for (l->axis = 0; l->axis < d->s->dim; l->axis++) {
		d->s->host->parallel(d->s->run, d->g->n_blocks, sum_block, l);
		for (uint32_t c = 0; c < d->n_cells; c++) {
			l->mass[0][c] = l->mass[1][c];
			l->room[0][c] = l->room[1][c];
		}
	}
}

/* Around an open cell with material; -1: no window is wide enough. */
static int32_t densest(const looking *l, quern_real *ratio) {
	const update *d = l->d;
	int32_t found = -1;
	for (uint32_t q = 0; q < d->n_cells; q++) {
		const uint32_t c = nth_cell(d, q);
		int32_t cell[3];
		if (!(d->u[U_CARRIED].real[0][c] > 0 && d->open[c] > 0.5 && l->room[0][c] >= l->least) ||
			!quern_grid_cell_of(d->g, c, cell))
			continue;
		if (l->mass[0][c] > *ratio * l->room[0][c])
			*ratio = l->mass[0][c] / l->room[0][c], found = (int32_t)c;
	}
	return found;
}

/* In flow a window's mass is noise from update to update too. Room is averaged with it: behind the face of a body that moves, the mass of before
 * would stand in cells that are closed by now. */
static void carry_on(const update *d) {
	quern_real *carried = d->u[U_CARRIED].real[0], *room = d->u[U_ROOM].real[0];
	const quern_real part = d->u[U_UPDATES].index[0] ? NEWEST : 1;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		carried[c] += part * (d->mass[c] - carried[c]);
		room[c] += part * (d->full * d->open[c] - room[c]);
	}
}

static bool begin(looking *l) {
	const update *d = l->d;
	const uint32_t dim = d->s->dim;
	const quern_real r = 0.5 * d->h->diameter, disc = 3.141592653589793 * r * r,
					 grain = d->h->density * (dim == 2 ? disc : 4.0 / 3 * r * disc);
	quern_real full = 0;
	for (l->reach = 0; l->reach < WIDEST && full < GRAINS * grain;) {
		const quern_real side = 2 * ++l->reach + 1;
		full = d->full * side * side * (dim == 3 ? side : 1);
	}
	l->least = fmin(FEWEST * grain, 0.5 * full);
	for (int k = 0; k < 2; k++) {
		l->mass[k] = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof(quern_real));
		l->room[k] = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof(quern_real));
	}
	return l->mass[0] && l->mass[1] && l->room[0] && l->room[1];
}

/* ---- what is said of it ---- */

/* Pa, mean over the points of a window; negative where there are none. */
static quern_real pressure_around(const looking *l, const int32_t cell[3]) {
	const update *d = l->d;
	const int r = l->reach, depth = d->g->dim == 3 ? r : 0;
	quern_real sum = 0, volume = 0;
	for (int z = -depth; z <= depth; z++)
		for (int y = -r; y <= r; y++)
			for (int x = -r; x <= r; x++) {
				int32_t at[3] = { cell[0] + x, cell[1] + y, cell[2] + z };
				const int32_t c = quern_grid_entry_back(d->g, at);
				for (uint32_t q = c < 0 ? 0 : d->point_begin[c]; c >= 0 && q < d->point_begin[c + 1]; q++) {
					const int32_t i = d->point[q];
					const symmetric t = SYMMETRIC_AT(d->u[U_POINT_STRESS].real, i, d->s->dim);
					const quern_real own = d->u[U_POINT_WEIGHT].real[0][i] * d->u[U_POINT_VOLUME].real[0][i];
					sum -= own * (t.xx + t.yy + t.zz) / d->s->dim;
					volume += own;
				}
			}
	return volume > 0 ? fmax(0, sum / volume) : -1;
}

typedef struct found {
	quern_real ratio, pressed; /* over the stress-free density; what the points' pressure makes of it */
	quern_real width;          /* m */
	bool grains_alone;
	char place[WORDS];
} found;

static found tell(const looking *l, quern_real ratio, uint32_t entry) {
	const update *d = l->d;
	const quern_bound *material = d->s->slot[SLOT_MATERIAL];
	quern_real bulk, shear, density, x[3];
	int32_t cell[3];
	found f = { .ratio = ratio, .width = (2 * l->reach + 1) * d->g->cell };
	quern_grid_cell_of(d->g, entry, cell);
	((const quern_material_ops *)material->ops)->moduli(material->self, d->s->dim, &bulk, &shear, &density);
	const quern_real pressure = pressure_around(l, cell);
	f.grains_alone = pressure < 0;
	f.pressed = 1 + fmax(0, pressure) / bulk;
	quern_hybrid_centre(d, cell, x);
	if (d->s->dim == 2) snprintf(f.place, WORDS, "(%.4g, %.4g) m", x[0], x[1]);
	else snprintf(f.place, WORDS, "(%.4g, %.4g, %.4g) m", x[0], x[1], x[2]);
	return f;
}

/* What the user can do, by what has made most of it. */
static const char *remedy(const found *f) {
	if (f->grains_alone)
		return "only grains are there: quern calibrate says whether these grains have the density that "
			   "continuum.material is given, and contacts that are too soft for what they bear let them lie one in "
			   "another (grains.contact)";
	if (f->pressed - 1 > 0.5 * (f->ratio - 1))
		return "its pressure makes most of that: give continuum.material a greater bulk_modulus";
	return "more mass is there than has room: quern calibrate says whether these grains have the density that "
		   "continuum.material is given, and continuum.relief and continuum.follow must not be 0 "
		   "(docs/stability.md, section 5)";
}

static void warn(const update *d, const found *f) {
	d->s->host->log(d->s->run, 2,
		"around %s, as a mean over %.3g m and ten updates, material is %.2f times as dense as the continuum "
		"without stress, %.4g kg/m^3; %s",
		f->place, f->width, f->ratio, d->h->packed, remedy(f));
}

static quern_status end(const update *d, const found *f) {
	return d->s->host->stop(d->s->run, QUERN_E_NUMERIC, NULL, -1,
		"around %s, as a mean over %.3g m and ten updates, material is %.2f times as dense as the continuum "
		"without stress, %.4g kg/m^3, and denser than what grains consist of, %.4g kg/m^3, which no packing "
		"is (hybrid.most_density); %s",
		f->place, f->width, f->ratio, d->h->packed, d->h->solid, remedy(f));
}

/* A continuum that is itself as dense as what grains consist of is a test's, and says nothing. */
static bool is_solid(const hybrid *h, quern_real ratio) {
	return h->most_density > 0 && h->solid > h->packed && ratio * h->packed > h->most_density * h->solid;
}

quern_status quern_hybrid_density(const update *d) {
	looking l = { .d = d };
	quern_real ratio = 0, *ever = d->u[U_DENSEST_EVER].real[0];
	carry_on(d);
	if (!begin(&l)) return QUERN_E_MEMORY;
	sum_windows(&l);
	const int32_t c = densest(&l, &ratio);
	const bool more = steps_passed(ratio - 1) > steps_passed(*ever - 1), solid = is_solid(d->h, ratio);
	d->u[U_DENSEST].real[0][0] = ratio;
	*ever = fmax(*ever, ratio);
	if (!more && !solid) return QUERN_OK;
	const found f = tell(&l, ratio, (uint32_t)c);
	if (solid) return end(d, &f);
	warn(d, &f);
	return QUERN_OK;
}
