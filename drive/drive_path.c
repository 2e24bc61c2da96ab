/* SPDX-License-Identifier: MIT */
#include "drive.h"
#include "quantity.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const spatial[] = { "xx", "yy", "zz", "xy", "yz", "xz" }, *const planar[] = { "xx", "yy",
	"xy" };

const char *quern_drive_component(uint32_t dim, uint32_t c) { return (dim == 2 ? planar : spatial)[c]; }

void quern_drive_axes(uint32_t dim, uint32_t c, uint32_t axis[2]) {
	const char *name = quern_drive_component(dim, c);
	for (int k = 0; k < 2; k++) axis[k] = (uint32_t)(name[k] - 'x');
}

uint32_t quern_drive_components(uint32_t dim) { return dim == 2 ? 3 : 6; }

void quern_drive_path_finish(drive_path *p) {
	free(p->leg);
	p->leg = NULL;
}

/* ---- paths by name ---- */

typedef enum { ISOTROPIC, OEDOMETRIC, SIMPLE_SHEAR, TRIAXIAL, TENSION, N_PATHS } kind;
const char *const quern_drive_paths[] = { "isotropic", "oedometric", "simple_shear", "triaxial", "tension",
	NULL };

/* How far where nobody says; the pressure to begin with, over the bulk modulus. */
static const double usual_way[] = { 0.01, 0.01, 0.1, 0.1, 0.01 }, usual_pressure[] = { 0, 0, 1e-3, 1e-3, 0 };
static const double usual_rate = 0.01, usual_time = 10; /* 1/s, s */

static bool read_ways(const char *option, const char *text, const char *unit, quern_units *units, double *way,
	uint32_t *n, quern_text *why) {
	char *copy = quern_copy(text), *rest = copy, broken[160];
	bool good = true;
	*n = 0;
	for (char *word; good && (word = strsep(&rest, ","));) {
		good = *n < DRIVE_MOST_LEGS && quern_quantity_read(units, word, unit, &way[*n], broken);
		if (!good)
			quern_text_add(why, "--%s %s: %s", option, text, *n < DRIVE_MOST_LEGS ? broken : "too many");
		else ++*n;
	}
	free(copy);
	return good;
}

/* Which components are driven, and how. */
static void set_controls(drive_path *p, kind which, const drive_wish *w) {
	const uint32_t dim = p->dim, last = dim - 1, n = quern_drive_components(dim);
	const drive_control driven = w->stress ? DRIVE_STRESS : DRIVE_STRAIN;
	for (uint32_t c = 0; c < n; c++) p->control[c] = DRIVE_STRAIN;
	p->follow = (int)last;
	p->sign = which == SIMPLE_SHEAR || which == TENSION ? 1 : -1;
	p->pressed = (which == ISOTROPIC && w->stress) ||
				 (which == SIMPLE_SHEAR && w->hold && !strcmp(w->hold, "pressure"));
	for (uint32_t c = 0; c < dim; c++) {
		if (p->pressed) p->control[c] = DRIVE_ALIKE;
		else if (which == TRIAXIAL || which == TENSION) p->control[c] = c == last ? driven : DRIVE_STRESS;
	}
	if (which == OEDOMETRIC) p->control[last] = driven;
	if (which != SIMPLE_SHEAR) return;
	const uint32_t shear = n - 1; /* xy of the plane, xz of space: layers slide along x */
	p->control[shear] = driven;
	p->slide[shear] = true;
	p->follow = (int)shear;
}

static drive_leg leg_of(const drive_path *p, kind which, const drive_leg *start, double way) {
	drive_leg leg = *start;
	if (which == ISOTROPIC && p->pressed) leg.pressure = way;
	else if (which == ISOTROPIC)
		for (uint32_t c = 0; c < p->dim; c++) leg.target[c] = p->sign * way;
	else leg.target[p->follow] = p->sign * way;
	return leg;
}

static const char *refusal(kind which, const drive_wish *w) {
	if (w->strain && w->stress) return "give --strain or --stress, not both";
	if (w->stress && isfinite(w->rate))
		return "--rate is of paths by strain; a path by stress takes --time for each piece";
	if (!w->stress && isfinite(w->time)) return "--time is of paths by stress; a path by strain takes --rate";
	if (w->hold && which != SIMPLE_SHEAR) return "--hold is of simple_shear alone";
	if (w->hold && strcmp(w->hold, "volume") != 0 && strcmp(w->hold, "pressure") != 0)
		return "--hold is volume or pressure";
	return NULL;
}

/* The state that a path by name begins with: the same pressure all around. */
static void set_start(drive_path *p, double pressure) {
	p->start = (drive_leg) { .pressure = pressure };
	for (uint32_t c = 0; c < p->dim; c++) p->start.target[c] = -pressure;
}

static bool put_legs(
	drive_path *p, kind which, const drive_wish *w, const double *way, uint32_t n, quern_text *why) {
	drive_leg start = p->start;
	for (uint32_t c = 0; c < quern_drive_components(p->dim); c++)
		if (p->control[c] != DRIVE_STRESS) start.target[c] = 0;
	const double rate = isfinite(w->rate) ? w->rate : usual_rate,
				 time = isfinite(w->time) ? w->time : usual_time;
	double at = 0, now = 0;
	p->leg = quern_take(n, sizeof *p->leg);
	for (uint32_t k = 0; k < n; k++) {
		if (!w->stress && way[k] == now)
			return quern_text_add(
					   why, "--strain: two ways after each other are %g, and the first begins at 0", now),
				   false;
		at += w->stress ? time : fabs(way[k] - now) / rate;
		p->leg[k] = leg_of(p, which, &start, way[k]);
		p->leg[k].time = at;
		now = way[k];
	}
	p->n = n;
	return true;
}

bool quern_drive_path_make(
	drive_path *p, const drive_wish *w, uint32_t dim, quern_units *units, quern_text *why) {
	kind which = 0;
	*p = (drive_path) { .dim = dim, .follow = -1, .steps = (uint32_t)w->steps };
	while (which < N_PATHS && strcmp(quern_drive_paths[which], w->name) != 0) which++;
	if (which == N_PATHS) return quern_text_add(why, "there is no path '%s'", w->name), false;
	const char *refused = refusal(which, w);
	if (refused) return quern_text_add(why, "%s", refused), false;
	set_controls(p, which, w);
	set_start(p, isfinite(w->pressure) ? w->pressure : usual_pressure[which] * w->bulk);
	double *way = quern_take(DRIVE_MOST_LEGS, sizeof *way);
	uint32_t n = 1;
	*way = usual_way[which];
	bool good = true;
	if (w->strain) good = read_ways("strain", w->strain, "1", units, way, &n, why);
	if (w->stress) good = read_ways("stress", w->stress, "Pa", units, way, &n, why);
	good = good && put_legs(p, which, w, way, n, why);
	free(way);
	return good;
}
