/* SPDX-License-Identifier: MIT */
/* drive_walk - step by step along a path: strains as given, and those that are sought by Newton's method */
#include "drive.h"
#include <math.h>
#include <quern/columns.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_TRIES = 40, MOST_HALVINGS = 20 };
static const double most_strain = 0.2; /* of one step: beyond, a point could turn inside out */

typedef struct {
	drive_point *point;
	const drive_path *path;
	uint32_t n, tries;                  /* unknowns; evaluations in this step */
	int unknown[DRIVE_MOST_COMPONENTS]; /* a component, or -1: the strain of all that are alike */
	double given[DRIVE_MOST_COMPONENTS], target[DRIVE_MOST_COMPONENTS], pressure; /* of this step */
	double dt, largest;                                                           /* stress so far */
	double total[DRIVE_MOST_COMPONENTS];                                          /* strain so far */
} walk;

typedef struct {
	double x[DRIVE_MOST_COMPONENTS], r[DRIVE_MOST_COMPONENTS], size;
} guess;

/* ---- one step ---- */

static void whole_strain(const walk *w, const double *x, double *strain) {
	memcpy(strain, w->given, sizeof w->given);
	for (uint32_t k = 0; k < w->n; k++)
		for (uint32_t c = 0; c < quern_drive_components(w->path->dim); c++)
			if (w->unknown[k] == (int)c || (w->unknown[k] < 0 && w->path->control[c] == DRIVE_ALIKE))
				strain[c] = x[k];
}

/* What stresses lack of what is asked, and the largest of that; NaN counts as infinite. */
static void evaluate(walk *w, guess *g) {
	double strain[DRIVE_MOST_COMPONENTS];
	whole_strain(w, g->x, strain);
	quern_drive_point_step(w->point, w->path, strain, w->dt);
	w->tries++;
	g->size = 0;
	for (uint32_t k = 0; k < w->n; k++) {
		const int c = w->unknown[k];
		g->r[k] = c < 0 ? w->pressure - quern_drive_point_pressure(w->point)
						: w->point->stress[c][0] - w->target[c];
		g->size = isfinite(g->r[k]) ? fmax(g->size, fabs(g->r[k])) : INFINITY;
	}
}

/* Gauss' method with the largest pivot; false where the matrix is singular. */
static bool solve(uint32_t n, double a[][DRIVE_MOST_COMPONENTS], double *b) {
	for (uint32_t k = 0; k < n; k++) {
		uint32_t best = k;
		for (uint32_t i = k + 1; i < n; i++)
			if (fabs(a[i][k]) > fabs(a[best][k])) best = i;
		if (!(fabs(a[best][k]) > 0)) return false;
		for (uint32_t j = 0; j < n; j++) {
			const double keep = a[k][j];
			a[k][j] = a[best][j], a[best][j] = keep;
		}
		const double keep = b[k];
		b[k] = b[best], b[best] = keep;
		for (uint32_t i = k + 1; i < n; i++) {
			const double f = a[i][k] / a[k][k];
			for (uint32_t j = k; j < n; j++) a[i][j] -= f * a[k][j];
			b[i] -= f * b[k];
		}
	}
	for (uint32_t k = n; k-- > 0;) {
		for (uint32_t j = k + 1; j < n; j++) b[k] -= a[k][j] * b[j];
		b[k] /= a[k][k];
		if (!isfinite(b[k])) return false;
	}
	return true;
}

/* Stresses over strains by differences, small beside the step. */
static void slopes(walk *w, const guess *at, double a[][DRIVE_MOST_COMPONENTS]) {
	double size = 1e-9;
	for (uint32_t c = 0; c < DRIVE_MOST_COMPONENTS; c++) size = fmax(size, fabs(w->given[c]));
	for (uint32_t k = 0; k < w->n; k++) size = fmax(size, fabs(at->x[k]));
	const double h = 1e-5 * size;
	for (uint32_t k = 0; k < w->n; k++) {
		guess g = *at;
		g.x[k] += h;
		evaluate(w, &g);
		for (uint32_t i = 0; i < w->n; i++) a[i][k] = (g.r[i] - at->r[i]) / h;
	}
}

/* Where no slope leads anywhere, as out of an open state, the elastic one does. */
static void elastic_way(const walk *w, const guess *at, double *way) {
	for (uint32_t k = 0; k < w->n; k++)
		way[k] = at->r[k] / (w->point->material->bulk + w->point->material->shear);
}

static double allowed(const walk *w) {
	return fmax(drive_tolerance * w->largest, drive_floor * w->point->material->bulk);
}

/* Along a way, as far as it helps; whether it does. */
static bool go(walk *w, guess *at, const double *way) {
	double part = 1;
	for (uint32_t k = 0; k < w->n; k++)
		if (fabs(way[k]) * part > most_strain) part = most_strain / fabs(way[k]);
	for (int half = 0; half < MOST_HALVINGS; half++, part *= 0.5) {
		guess g = *at;
		bool there = true;
		for (uint32_t k = 0; k < w->n; k++) {
			g.x[k] -= part * way[k];
			there &= fabs(g.x[k]) <= most_strain;
		}
		if (!there) continue;
		evaluate(w, &g);
		if (g.size < at->size) return *at = g, true;
	}
	return false;
}

/* Newton's method, with as much of each way as brings the residual down. The point is left in the state of what was found. */
static bool seek(walk *w, guess *at) {
	evaluate(w, at);
	for (int k = 0; k < MOST_TRIES && at->size > allowed(w); k++) {
		double a[DRIVE_MOST_COMPONENTS][DRIVE_MOST_COMPONENTS], way[DRIVE_MOST_COMPONENTS];
		slopes(w, at, a);
		memcpy(way, at->r, sizeof way);
		if (!solve(w->n, a, way)) elastic_way(w, at, way);
		if (go(w, at, way)) continue;
		elastic_way(w, at, way);
		if (!go(w, at, way)) return false;
	}
	return at->size <= allowed(w);
}

/* ---- the record ---- */

static void add_column(drive_record *r, const char *name, const char *component, const char *unit) {
	quern_text_add(
		&r->head, "%s%s%s%s [%s]", r->n_columns++ ? "," : "", name, *component ? "_" : "", component, unit);
}

static const char *component_of(uint8_t shape, uint32_t dim, uint32_t c) {
	static const char *const vector[] = { "x", "y", "z" }, *const plane[] = { "xx", "xy", "yx", "yy" },
							 *const space[] = { "xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz" };
	if (shape == QUERN_SYMMETRIC) return quern_drive_component(dim, c);
	if (shape == QUERN_TENSOR) return (dim == 2 ? plane : space)[c];
	return shape == QUERN_VECTOR || (shape == QUERN_AXIAL && dim == 3) ? vector[c] : "";
}

static void put_head(drive_record *r, const drive_point *p, const drive_path *path) {
	const uint32_t dim = path->dim, n = quern_drive_components(dim);
	add_column(r, "time", "", "s");
	if (path->follow >= 0) add_column(r, "strain", "", "1");
	for (uint32_t c = 0; c < n; c++) add_column(r, "strain", quern_drive_component(dim, c), "1");
	for (uint32_t c = 0; c < n; c++) add_column(r, "stress", quern_drive_component(dim, c), "Pa");
	add_column(r, "pressure", "", "Pa");
	add_column(r, "shear_stress", "", "Pa");
	add_column(r, "shear_strain", "", "1");
	add_column(r, "friction", "", "1");
	add_column(r, "volume", "", "1");
	add_column(r, "density", "", "kg/m^3");
	add_column(r, "energy", "", "J/kg");
	add_column(r, "wave_speed", "", "m/s");
	for (uint32_t f = 0; f < p->n_fields; f++)
		for (uint32_t c = 0; c < quern_shape_size(p->field[f].shape, dim); c++)
			add_column(r, p->field[f].name, component_of(p->field[f].shape, dim, c), p->field[f].unit);
}

static double *put_fields(const drive_point *p, double *out) {
	for (uint32_t f = 0; f < p->n_fields; f++)
		for (uint32_t c = 0; c < quern_shape_size(p->field[f].shape, p->material->dim); c++)
			*out++ = p->field[f].column.real[c][0];
	return out;
}

static void put_row(drive_record *r, const walk *w, double time) {
	const drive_point *p = w->point;
	const uint32_t dim = w->path->dim, n = quern_drive_components(dim);
	double strain[DRIVE_MOST_COMPONENTS], stress[DRIVE_MOST_COMPONENTS];
	for (uint32_t c = 0; c < n; c++)
		strain[c] = w->total[c] * (w->path->slide[c] ? 0.5 : 1), stress[c] = p->stress[c][0];
	const double pressure = quern_drive_point_pressure(p), shear = quern_drive_shear_of(dim, stress);
	r->data = quern_grow(r->data, (r->n_rows + 1) * r->n_columns, &r->capacity, sizeof *r->data);
	double *out = r->data + r->n_rows++ * r->n_columns;
	*out++ = time;
	if (w->path->follow >= 0) *out++ = w->path->sign * w->total[w->path->follow];
	for (uint32_t c = 0; c < n; c++) *out++ = strain[c];
	for (uint32_t c = 0; c < n; c++) *out++ = stress[c];
	*out++ = pressure;
	*out++ = shear;
	*out++ = 2 * quern_drive_shear_of(dim, strain);
	*out++ = pressure > 0 ? shear / pressure : 0;
	*out++ = p->volume;
	*out++ = p->density[0];
	*out++ = p->energy[0];
	*out++ = p->wave_speed[0];
	put_fields(p, out);
}

void quern_drive_record_finish(drive_record *r) {
	quern_text_finish(&r->head);
	free(r->data);
}

/* ---- the walk ---- */

static void find_unknowns(walk *w) {
	const drive_path *p = w->path;
	for (uint32_t c = 0; c < quern_drive_components(p->dim); c++)
		if (p->control[c] == DRIVE_STRESS) w->unknown[w->n++] = (int)c;
	if (p->pressed) w->unknown[w->n++] = -1;
}

/* What this step is given: a part of the way from one way point to the next. */
static void set_step(walk *w, const drive_leg *from, const drive_leg *to, uint32_t k) {
	const uint32_t steps = w->path->steps;
	const double part = (double)(k + 1) / steps;
	w->dt = (to->time - from->time) / steps;
	w->pressure = from->pressure + part * (to->pressure - from->pressure);
	for (uint32_t c = 0; c < quern_drive_components(w->path->dim); c++) {
		w->given[c] = 0;
		w->target[c] = from->target[c] + part * (to->target[c] - from->target[c]);
		if (w->path->control[c] == DRIVE_STRAIN) w->given[c] = (to->target[c] - from->target[c]) / steps;
	}
}

static bool step_is_small(const walk *w, double time, quern_text *why) {
	for (uint32_t c = 0; c < DRIVE_MOST_COMPONENTS; c++)
		if (fabs(w->given[c]) > most_strain) {
			quern_text_add(why, "after %g s a step strains by %g, more than %g; give more --steps", time,
				w->given[c], most_strain);
			return false;
		}
	return true;
}

static bool fail(const walk *w, const guess *g, double time, quern_text *why) {
	const drive_point *p = w->point;
	const int c = w->n ? w->unknown[0] : 0;
	if (!w->n || !isfinite(g->size))
		return quern_text_add(
				   why, "at %g s the stress is not a number after %s", time, p->material->file->plugin.id),
			   false;
	quern_text_add(why,
		"at %g s no strain gives the %s that is asked for: %g Pa are left of it after %u tries, and %.2g would do; "
		"%s may not bear it, or takes smaller steps, --steps",
		time, c < 0 ? "pressure" : "stress", g->size, w->tries, allowed(w), p->material->file->plugin.id);
	return false;
}

static bool is_finite(const drive_point *p) {
	double sum = p->density[0] + p->volume;
	for (uint32_t c = 0; c < quern_drive_components(p->material->dim); c++) sum += p->stress[c][0];
	return isfinite(sum);
}

static void take(walk *w, const guess *g) {
	double strain[DRIVE_MOST_COMPONENTS];
	whole_strain(w, g->x, strain);
	for (uint32_t c = 0; c < quern_drive_components(w->path->dim); c++) {
		w->total[c] = w->path->control[c] == DRIVE_STRAIN ? w->target[c] : w->total[c] + strain[c];
		w->largest = fmax(w->largest, fabs(w->point->stress[c][0]));
	}
	quern_drive_point_keep(w->point);
}

static bool walk_leg(
	walk *w, const drive_leg *from, const drive_leg *to, guess *g, drive_record *r, quern_text *why) {
	for (uint32_t k = 0; k < w->path->steps; k++) {
		const double time = from->time + (to->time - from->time) * (k + 1) / w->path->steps;
		set_step(w, from, to, k);
		if (!step_is_small(w, time, why)) return false;
		w->tries = 0;
		if (!seek(w, g) || !is_finite(w->point)) {
			quern_drive_point_back(w->point); /* to what the last row has */
			return fail(w, g, time, why);
		}
		r->most_tries = w->tries > r->most_tries ? w->tries : r->most_tries;
		take(w, g);
		put_row(r, w, time);
	}
	return true;
}

bool quern_drive_walk(drive_point *point, const drive_path *path, drive_record *r, quern_text *why) {
	walk w = { .point = point, .path = path };
	guess g = { .size = 0 };
	drive_leg from = path->start;
	find_unknowns(&w);
	put_head(r, point, path);
	put_row(r, &w, 0);
	for (uint32_t c = 0; c < quern_drive_components(path->dim); c++) {
		w.largest = fmax(w.largest, fabs(point->stress[c][0]));
		if (path->control[c] == DRIVE_STRAIN) from.target[c] = 0;
	}
	for (uint32_t k = 0; k < path->n; k++) {
		for (uint32_t c = 0; c < DRIVE_MOST_COMPONENTS; c++)
			if (path->control[c] == DRIVE_STRESS) w.largest = fmax(w.largest, fabs(path->leg[k].target[c]));
		if (path->pressed) w.largest = fmax(w.largest, fabs(path->leg[k].pressure));
		if (!walk_leg(&w, &from, &path->leg[k], &g, r, why)) return false;
		memset(&g, 0, sizeof g);
		from = path->leg[k];
	}
	return true;
}
