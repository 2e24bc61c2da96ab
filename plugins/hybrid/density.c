/* SPDX-License-Identifier: MIT */
/* density - how dense the densest place is: what both clouds carry there over what would fill its open room without stress. A cell
 * of two diameters holds four discs, and its mass is chance; a window of hundreds of grains is not. docs/theory/hybrid.md, section 5 */
#include "../common/symmetric.h"
#include "update.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Grains of a window, and of one that walls and faces have cut. */
enum { GRAINS = 300, FEWEST = 100, WIDEST = 8, WORDS = 96 };
static const quern_real warned_from =
	0.05; /* above the stress-free density; and again at twice that, at four times ... */

typedef struct looking {
	const update *d;
	int reach;        /* cells to each side of a window's middle */
	quern_real least; /* kg that fill the smallest window which says something */
	quern_real *most; /* by block: the largest ratio of any window with its middle there */
	int32_t (*middle)[3];
} looking;

typedef struct window {
	quern_real mass, room;       /* kg: carried; what would fill it without stress */
	quern_real pressure, volume; /* of its points: Pa m^3, m^3 */
} window;

static void add_pressure(const update *d, uint32_t c, window *w) {
	for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
		const int32_t i = d->point[q];
		const symmetric t = SYMMETRIC_AT(d->u[U_POINT_STRESS].real, i, d->s->dim);
		const quern_real volume = d->u[U_POINT_WEIGHT].real[0][i] * d->u[U_POINT_VOLUME].real[0][i];
		w->pressure -= volume * (t.xx + t.yy + t.zz) / d->s->dim;
		w->volume += volume;
	}
}

/* What has no entry holds nothing, and nobody knows what of it is open. */
static window window_around(const looking *l, const int32_t cell[3], bool pressed) {
	const update *d = l->d;
	const int r = l->reach, depth = d->g->dim == 3 ? r : 0;
	quern_grid_cursor last = { .block = -1 };
	window w = { .mass = 0 };
	for (int z = -depth; z <= depth; z++)
		for (int y = -r; y <= r; y++)
			for (int x = -r; x <= r; x++) {
				int32_t at[3] = { cell[0] + x, cell[1] + y, cell[2] + z };
				const int32_t c =
					quern_grid_bring_back(d->g, at) ? quern_grid_entry_near(d->g, &last, at) : -1;
				if (c < 0) continue;
				w.mass += d->u[U_CARRIED].real[0][c];
				w.room += d->full * d->open[c];
				if (pressed) add_pressure(d, (uint32_t)c, &w);
			}
	return w;
}

static void look_at_block(void *arg, uint32_t b, uint32_t worker) {
	const looking *l = arg;
	(void)worker;
	l->most[b] = 0;
	for (uint32_t c = b * QUERN_BLOCK_CELLS; c < (b + 1) * QUERN_BLOCK_CELLS; c++) {
		int32_t cell[3];
		if (!quern_grid_cell_of(l->d->g, c, cell) || !(l->d->u[U_CARRIED].real[0][c] > 0)) continue;
		const window w = window_around(l, cell, false);
		if (!(w.room >= l->least && w.mass > l->most[b] * w.room)) continue;
		l->most[b] = w.mass / w.room;
		memcpy(l->middle[b], cell, sizeof cell);
	}
}

/* In flow a window's mass is noise from update to update too. */
static void carry_on(const update *d) {
	quern_real *carried = d->u[U_CARRIED].real[0];
	const quern_real part = d->u[U_UPDATES].index[0] ? NEWEST : 1;
	for (uint32_t c = 0; c < d->n_cells; c++) carried[c] += part * (d->mass[c] - carried[c]);
}

static bool begin(looking *l) {
	const update *d = l->d;
	const uint32_t dim = d->s->dim, blocks = d->g->n_blocks;
	const quern_real r = 0.5 * d->h->diameter, disc = 3.141592653589793 * r * r,
					 grain = d->h->density * (dim == 2 ? disc : 4.0 / 3 * r * disc);
	quern_real full = 0;
	for (l->reach = 0; l->reach < WIDEST && full < GRAINS * grain;) {
		const quern_real side = 2 * ++l->reach + 1;
		full = d->full * side * side * (dim == 3 ? side : 1);
	}
	l->least = fmin(FEWEST * grain, 0.5 * full);
	l->most = d->s->host->memory(d->s->run, ((size_t)blocks + 1) * sizeof *l->most);
	l->middle = d->s->host->memory(d->s->run, ((size_t)blocks + 1) * sizeof *l->middle);
	return l->most && l->middle;
}

/* ---- what is said of it ---- */

typedef struct found {
	quern_real ratio, pressed; /* over the stress-free density; what the points' pressure makes of it */
	quern_real width;          /* m */
	char place[WORDS];
} found;

static found tell(const looking *l, quern_real ratio, const int32_t cell[3]) {
	const update *d = l->d;
	const quern_bound *material = d->s->slot[SLOT_MATERIAL];
	const window w = window_around(l, cell, true);
	quern_real bulk, shear, density, x[3];
	((const quern_material_ops *)material->ops)->moduli(material->self, d->s->dim, &bulk, &shear, &density);
	found f = { .ratio = ratio, .width = (2 * l->reach + 1) * d->g->cell };
	f.pressed = 1 + (w.volume > 0 ? fmax(0, w.pressure / w.volume / bulk) : 0);
	quern_hybrid_centre(d, cell, x);
	if (d->s->dim == 2) snprintf(f.place, WORDS, "(%.4g, %.4g) m", x[0], x[1]);
	else snprintf(f.place, WORDS, "(%.4g, %.4g, %.4g) m", x[0], x[1], x[2]);
	return f;
}

/* What the user can do, by what has made most of it. */
static const char *remedy(const found *f) {
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
		"is; %s",
		f->place, f->width, f->ratio, d->h->packed, d->h->solid, remedy(f));
}

/* How many of 1.05, 1.1, 1.2, 1.4 ... are passed. */
static int steps_of(quern_real ratio) {
	int n = 0;
	for (quern_real above = warned_from; ratio - 1 > above && n < 8; above *= 2) n++;
	return n;
}

quern_status quern_hybrid_density(const update *d) {
	looking l = { .d = d };
	quern_real ratio = 0, *ever = d->u[U_DENSEST_EVER].real[0];
	const int32_t *cell = NULL;
	carry_on(d);
	if (!begin(&l)) return QUERN_E_MEMORY;
	d->s->host->parallel(d->s->run, d->g->n_blocks, look_at_block, &l);
	for (uint32_t q = 0; q < d->g->n_blocks; q++) {
		const uint32_t b = quern_nth(d->g->by_place, q);
		if (l.most[b] > ratio) ratio = l.most[b], cell = l.middle[b];
	}
	const bool more = steps_of(ratio) > steps_of(*ever),
			   solid = d->h->solid > d->h->packed && ratio * d->h->packed > d->h->solid;
	d->u[U_DENSEST].real[0][0] = ratio;
	*ever = fmax(*ever, ratio);
	if (!more && !solid) return QUERN_OK;
	const found f = tell(&l, ratio, cell);
	if (solid) return end(d, &f);
	warn(d, &f);
	return QUERN_OK;
}
