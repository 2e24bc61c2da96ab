/* SPDX-License-Identifier: MIT */
/* Bodies against closed forms and against a dense sampling of their surfaces; grains that rebound from them; their names. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "ask_body.h"
#include "harness.h"
#include "table.h"
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979312;

static quern_run *open_body(int dim, const char *body) {
	return harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s}, time: {end: 1}, output: "
		"{every: 1},\n"
		"bodies: [%s],\ngrains: {material: {density: 2500, radius: {mean: 1 mm}}, contact: {linear: "
		"{stiffness: 1e5}},"
		" place: [{position: %s, fixed: true}]}}\n",
		dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[-5, -5]" : "[-5, -5, -5]",
		dim == 2 ? "[5, 5]" : "[5, 5, 5]", body, dim == 2 ? "[4.5, 4.5]" : "[4.5, 4.5, 4.5]");
}

/* ==== closed forms ==== */

static double length_of(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

static double to_line(place p, place a, place b) {
	double ab[3], ap[3], along = 0, square = 0;
	for (int k = 0; k < 3; k++) {
		ab[k] = b.x[k] - a.x[k], ap[k] = p.x[k] - a.x[k];
		along += ab[k] * ap[k], square += ab[k] * ab[k];
	}
	const double share = fmin(1, fmax(0, along / square));
	for (int k = 0; k < 3; k++) ap[k] -= share * ab[k];
	return length_of(ap);
}

/* Not convex: a bowl with a spike below it, and a vertex on a straight edge. */
static const place outline[] = { { { -1, 1, 0 } }, { { -1.2, -0.5, 0 } }, { { -0.2, -0.6, 0 } },
	{ { 0, -1.4, 0 } }, { { 0.1, -0.6, 0 } }, { { 0.6, -0.6, 0 } }, { { 1.1, -0.6, 0 } }, { { 1, 1, 0 } },
	{ { 0.7, 1, 0 } }, { { 0.3, -0.1, 0 } }, { { -0.4, -0.2, 0 } }, { { -0.7, 0.9, 0 } } };
enum { CORNERS = sizeof outline / sizeof *outline };

/* Inside by the angle that the outline passes through, seen from there. */
static double of_polygon(place p) {
	double least = INFINITY, angle = 0;
	for (int i = 0; i < CORNERS; i++) {
		const place a = outline[i], b = outline[(i + 1) % CORNERS];
		const double ax = a.x[0] - p.x[0], ay = a.x[1] - p.x[1], bx = b.x[0] - p.x[0], by = b.x[1] - p.x[1];
		least = fmin(least, to_line(p, a, b));
		angle += atan2(ax * by - ay * bx, ax * bx + ay * by);
	}
	return fabs(angle) > pi ? -least : least;
}

static double of_segment(place p) {
	return to_line(p, (place) { { -0.5, 0.2, 0 } }, (place) { { 0.7, -0.4, 0 } }) - 0.1;
}
static double of_rod(place p) {
	return to_line(p, (place) { { -0.5, 0.2, -0.3 } }, (place) { { 0.7, -0.4, 0.4 } }) - 0.15;
}

/* About z by 30 degrees; about (1, 1, 1) by 120, which swaps x, y and z. */
static double of_sides(const double d[3], const double half[3], int dim) {
	double out[3] = { 0 }, most = -INFINITY;
	for (int k = 0; k < dim; k++) {
		const double q = fabs(d[k]) - half[k];
		out[k] = fmax(0, q), most = fmax(most, q);
	}
	return most > 0 ? length_of(out) : most;
}
static double of_box_2d(place p) {
	const double c = cos(pi / 6), s = sin(pi / 6), x = p.x[0] - 0.1, y = p.x[1] + 0.2;
	return of_sides((double[3]) { c * x + s * y, c * y - s * x }, (double[3]) { 0.6, 0.3 }, 2);
}
static double of_box_3d(place p) {
	return of_sides((double[]) { p.x[1] + 0.2, p.x[2], p.x[0] - 0.1 }, (double[]) { 0.6, 0.3, 0.2 }, 3);
}

static double of_disc(place p) { return hypot(p.x[0] - 0.1, p.x[1] + 0.2) - 0.7; }
static double of_drum_2d(place p) { return -of_disc(p); }
static double of_ball(place p) {
	return length_of((double[3]) { p.x[0] - 0.1, p.x[1] + 0.2, p.x[2] - 0.3 }) - 0.7;
}
static double of_bowl(place p) { return -of_ball(p); }
static double of_cylinder(place p) { return hypot(p.x[1] + 0.2, p.x[2]) - 0.7; }
static double of_drum(place p) { return -of_cylinder(p); }
/* Along (0, 3, 4)/5. */
static double of_can(place p) {
	const double x = p.x[0] - 0.1, y = p.x[1] + 0.2, z = p.x[2], h = 0.6 * y + 0.8 * z, w = 0.8 * y - 0.6 * z;
	const double past = hypot(x, w) - 0.7, above = fabs(h) - 0.5;
	return past > 0 || above > 0 ? hypot(fmax(0, past), fmax(0, above)) : fmax(past, above);
}
static double of_closed_drum(place p) { return -of_can(p); }

/* ==== surfaces, densely ==== */

typedef struct cloud {
	place *at;
	size_t n, cap;
	double apart; /* no place of the surface is farther from one of these */
} cloud;

static void put(cloud *c, double x, double y, double z) {
	if (c->n == c->cap) {
		c->cap = c->cap ? 2 * c->cap : 1024;
		c->at = realloc(c->at, c->cap * sizeof *c->at);
		assert_non_null(c->at);
	}
	c->at[c->n++] = (place) { { x, y, z } };
}

static void put_line(cloud *c, place a, place b) {
	double way[3];
	for (int k = 0; k < 3; k++) way[k] = b.x[k] - a.x[k];
	const int n = (int)ceil(length_of(way) / c->apart);
	for (int i = 0; i <= n; i++)
		put(c, a.x[0] + way[0] * i / n, a.x[1] + way[1] * i / n, a.x[2] + way[2] * i / n);
}

/* A strip: the line from a to b and all its copies up to a + across. */
static void put_face(cloud *c, place a, place b, place across) {
	const int n = (int)ceil(length_of(across.x) / c->apart);
	for (int i = 0; i <= n; i++) {
		place from = a, to = b;
		for (int k = 0; k < 3; k++) from.x[k] += across.x[k] * i / n, to.x[k] += across.x[k] * i / n;
		put_line(c, from, to);
	}
}

/* A circle about the axis u = v x w. */
static void put_circle(cloud *c, place o, place v, place w, double radius) {
	const int n = (int)ceil(2 * pi * radius / c->apart) + 3;
	for (int i = 0; i < n; i++) {
		const double p = radius * cos(2 * pi * i / n), q = radius * sin(2 * pi * i / n);
		put(c, o.x[0] + p * v.x[0] + q * w.x[0], o.x[1] + p * v.x[1] + q * w.x[1],
			o.x[2] + p * v.x[2] + q * w.x[2]);
	}
}

static void put_polygon(cloud *c) {
	for (int i = 0; i < CORNERS; i++) put_line(c, outline[i], outline[(i + 1) % CORNERS]);
}
static void put_box_2d(cloud *c) {
	const double u = 0.6 * cos(pi / 6), v = 0.6 * sin(pi / 6), p = -0.3 * sin(pi / 6), q = 0.3 * cos(pi / 6);
	const place corner[4] = { { { 0.1 - u - p, -0.2 - v - q, 0 } }, { { 0.1 + u - p, -0.2 + v - q, 0 } },
		{ { 0.1 + u + p, -0.2 + v + q, 0 } }, { { 0.1 - u + p, -0.2 - v + q, 0 } } };
	for (int i = 0; i < 4; i++) put_line(c, corner[i], corner[(i + 1) % 4]);
}
static void put_box_3d(cloud *c) {
	const double h[3] = { 0.2, 0.6, 0.3 }, o[3] = { 0.1, -0.2, 0 };
	for (int k = 0; k < 3; k++)
		for (int side = -1; side <= 1; side += 2) {
			const int m = (k + 1) % 3, n = (k + 2) % 3;
			place a = { { o[0], o[1], o[2] } }, b, across = { { 0 } };
			a.x[k] += side * h[k], a.x[m] -= h[m], a.x[n] -= h[n];
			b = a;
			b.x[m] += 2 * h[m], across.x[n] = 2 * h[n];
			put_face(c, a, b, across);
		}
}
static void put_disc(cloud *c) {
	put_circle(c, (place) { { 0.1, -0.2, 0 } }, (place) { { 1, 0, 0 } }, (place) { { 0, 1, 0 } }, 0.7);
}
static void put_ball(cloud *c) {
	const int n = (int)ceil(0.7 * pi / c->apart) + 1;
	for (int i = 0; i <= n; i++)
		put_circle(c, (place) { { 0.1, -0.2, 0.3 + 0.7 * cos(pi * i / n) } }, (place) { { 1, 0, 0 } },
			(place) { { 0, 1, 0 } }, 0.7 * sin(pi * i / n));
}
/* A plate is a box without a thickness. */
static double of_plate(place p) {
	return of_sides((double[3]) { p.x[0] - 0.1, p.x[1] + 0.2, p.x[2] - 0.3 }, (double[3]) { 0.6, 0.4, 0 }, 3);
}
static void put_plate(cloud *c) {
	put_face(c, (place) { { -0.5, -0.6, 0.3 } }, (place) { { 0.7, -0.6, 0.3 } }, (place) { { 0, 0.8, 0 } });
}
/* As far as places that are asked for can see. */
static void put_cylinder(cloud *c) {
	for (double x = -3.2; x < 3.2; x += c->apart)
		put_circle(c, (place) { { x, -0.2, 0 } }, (place) { { 0, 1, 0 } }, (place) { { 0, 0, 1 } }, 0.7);
}
static void put_can(cloud *c) {
	const place v = { { 1, 0, 0 } }, w = { { 0, 0.8, -0.6 } };
	const int n = (int)ceil(1 / c->apart), m = (int)ceil(0.7 / c->apart);
	for (int i = 0; i <= n; i++) {
		const double h = -0.5 + (double)i / n;
		put_circle(c, (place) { { 0.1, -0.2 + 0.6 * h, 0.8 * h } }, v, w, 0.7);
	}
	for (int i = 0; i <= m; i++)
		for (int side = -1; side <= 1; side += 2)
			put_circle(c, (place) { { 0.1, -0.2 + side * 0.3, side * 0.4 } }, v, w, 0.7 * i / m);
}
/* Two circles or spheres round the ends, without what lies within the wall, and its sides. */
static void put_round(cloud *c, place a, place b, double radius, double (*of)(place), bool flat) {
	cloud all = { .apart = c->apart };
	double u[3];
	for (int k = 0; k < 3; k++) u[k] = b.x[k] - a.x[k];
	const double length = length_of(u);
	place v = { { -u[1] / length, u[0] / length, 0 } }, w;
	const double flatness = hypot(v.x[0], v.x[1]);
	v.x[0] /= flatness, v.x[1] /= flatness;
	for (int k = 0; k < 3; k++) u[k] /= length;
	for (int k = 0; k < 3; k++)
		w.x[k] = u[(k + 1) % 3] * v.x[(k + 2) % 3] - u[(k + 2) % 3] * v.x[(k + 1) % 3];
	const int n = (int)ceil((length + 2 * radius) / c->apart * 3);
	for (int i = 0; i <= n; i++) { /* even along the ends' arcs: s is an angle there */
		const double arc = radius * pi / 2, s = (length + 2 * arc) * i / n;
		const double turn = s < arc            ? s / radius
							: s > length + arc ? (length + 2 * arc - s) / radius
											   : pi / 2;
		const double along = s < arc            ? -radius * cos(turn)
							 : s > length + arc ? length + radius * cos(turn)
												: s - arc;
		place o;
		for (int k = 0; k < 3; k++) o.x[k] = a.x[k] + along * u[k];
		if (!flat) put_circle(&all, o, v, w, radius * sin(turn));
		for (int side = -1; flat && side <= 1; side += 2)
			put(&all, o.x[0] + side * radius * sin(turn) * v.x[0],
				o.x[1] + side * radius * sin(turn) * v.x[1], 0);
	}
	for (size_t i = 0; i < all.n; i++) {
		assert_true(fabs(of(all.at[i])) < 1e-12);
		put(c, all.at[i].x[0], all.at[i].x[1], all.at[i].x[2]);
	}
	free(all.at);
}
static void put_segment(cloud *c) {
	put_round(c, (place) { { -0.5, 0.2, 0 } }, (place) { { 0.7, -0.4, 0 } }, 0.1, of_segment, true);
}
static void put_rod(cloud *c) {
	put_round(c, (place) { { -0.5, 0.2, -0.3 } }, (place) { { 0.7, -0.4, 0.4 } }, 0.15, of_rod, false);
}

/* ==== the bodies ==== */

#define POLYGON                                                                                              \
	"polygon: {vertices: [[-1, 1], [-1.2, -0.5], [-0.2, -0.6], [0, -1.4], [0.1, -0.6], [0.6, -0.6], "        \
	"[1.1, -0.6], [1, 1], [0.7, 1], [0.3, -0.1], [-0.4, -0.2], [-0.7, 0.9]]}"
/* The same the other way round. */
#define NOGYLOP                                                                                              \
	"polygon: {vertices: [[-0.7, 0.9], [-0.4, -0.2], [0.3, -0.1], [0.7, 1], [1, 1], [1.1, -0.6], "           \
	"[0.6, -0.6], [0.1, -0.6], [0, -1.4], [-0.2, -0.6], [-1.2, -0.5], [-1, 1]]}"

typedef struct shape {
	const char *name;
	int dim;
	const char *text;
	double (*distance)(place);
	void (*surface)(cloud *);
	place before; /* somewhere in the material */
} shape;
static const shape shapes[] = {
	{ "segment", 2, "segment: {from: [-0.5, 0.2], to: [0.7, -0.4], thickness: 0.2}", of_segment, put_segment,
		{ { 0.4, 0.5, 0 } } },
	{ "segment, 3-D", 3, "segment: {from: [-0.5, 0.2, -0.3], to: [0.7, -0.4, 0.4], thickness: 0.3}", of_rod,
		put_rod, { { 0.3, 0.5, 0.4 } } },
	{ "turned box", 2, "box: {lower: [-0.5, -0.5], upper: [0.7, 0.1], turn: 30 degree}", of_box_2d,
		put_box_2d, { { 0.3, 0.6, 0 } } },
	{ "turned box, 3-D", 3,
		"box: {lower: [-0.5, -0.5, -0.2], upper: [0.7, 0.1, 0.2], turn: 120 degree, axis: [1, 1, 1]}",
		of_box_3d, put_box_3d, { { 0.2, 0.1, 0.7 } } },
	{ "disc", 2, "cylinder: {centre: [0.1, -0.2], radius: 0.7}", of_disc, put_disc, { { 0.9, 0.6, 0 } } },
	{ "hollow disc", 2, "cylinder: {centre: [0.1, -0.2], radius: 0.7, inside: true}", of_drum_2d, put_disc,
		{ { 0.3, 0.1, 0 } } },
	{ "cylinder", 3, "cylinder: {centre: [0.1, -0.2, 0], radius: 0.7, axis: [2, 0, 0]}", of_cylinder,
		put_cylinder, { { 0.2, 0.4, 0.8 } } },
	{ "drum", 3, "cylinder: {centre: [0.1, -0.2, 0], radius: 0.7, axis: [2, 0, 0], inside: true}", of_drum,
		put_cylinder, { { 0.2, 0.1, 0.2 } } },
	{ "cylinder with ends", 3, "cylinder: {centre: [0.1, -0.2, 0], radius: 0.7, axis: [0, 3, 4], length: 1}",
		of_can, put_can, { { 0.2, 0.6, 0.8 } } },
	{ "closed drum", 3,
		"cylinder: {centre: [0.1, -0.2, 0], radius: 0.7, axis: [0, 3, 4], length: 1, inside: true}",
		of_closed_drum, put_can, { { 0.3, -0.1, 0.1 } } },
	{ "sphere in 2-D", 2, "sphere: {centre: [0.1, -0.2], radius: 0.7}", of_disc, put_disc,
		{ { 0.9, 0.6, 0 } } },
	{ "hollow sphere in 2-D", 2, "sphere: {centre: [0.1, -0.2], radius: 0.7, inside: true}", of_drum_2d,
		put_disc, { { 0.3, 0.1, 0 } } },
	{ "sphere", 3, "sphere: {centre: [0.1, -0.2, 0.3], radius: 0.7}", of_ball, put_ball,
		{ { 0.5, 0.4, 0.9 } } },
	{ "hollow sphere", 3, "sphere: {centre: [0.1, -0.2, 0.3], radius: 0.7, inside: true}", of_bowl, put_ball,
		{ { 0.3, 0.1, 0.2 } } },
	{ "plate", 3, "box: {lower: [-0.5, -0.6, 0.3], upper: [0.7, 0.2, 0.3]}", of_plate, put_plate,
		{ { 0.2, 0.1, 0.6 } } },
	{ "polygon", 2, POLYGON, of_polygon, put_polygon, { { 0, 0.2, 0 } } },
	{ "polygon, clockwise", 2, NOGYLOP, of_polygon, put_polygon, { { 0.5, -1, 0 } } },
};
enum { SHAPES = sizeof shapes / sizeof *shapes };

/* ==== distance and normal ==== */

static double uniform(uint64_t *state, double low, double high) {
	*state = *state * 6364136223846793005u + 1442695040888963407u;
	return low + (high - low) * (double)(*state >> 11) * 0x1p-53;
}

static size_t nearest(const cloud *c, place p, double *distance) {
	size_t best = 0;
	*distance = INFINITY;
	for (size_t i = 0; i < c->n; i++) {
		const double *a = c->at[i].x;
		const double square = (a[0] - p.x[0]) * (a[0] - p.x[0]) + (a[1] - p.x[1]) * (a[1] - p.x[1]) +
							  (a[2] - p.x[2]) * (a[2] - p.x[2]);
		if (square < *distance) *distance = square, best = i;
	}
	*distance = sqrt(*distance);
	return best;
}

typedef struct worst {
	double form, sampling, foot, ray;
} worst;

/* Against the closed form, the nearest sample, what the body says of the place that it calls nearest, and the way from
 * the nearest sample as a normal, where that is far enough to have a direction. */
static void look(const quern_run *run, const shape *s, const cloud *c, place p, worst *w) {
	double normal[3], there[3], by;
	const double gap = ask(run, NULL, p, normal);
	place foot = p;
	for (int k = 0; k < 3; k++) foot.x[k] -= gap * normal[k];
	const place sample = c->at[nearest(c, p, &by)];
	w->form = fmax(w->form, fabs(gap - s->distance(p)));
	w->sampling = fmax(w->sampling, fmax(fabs(gap) - by, by - fabs(gap) - c->apart) / c->apart);
	w->foot = fmax(w->foot, fabs(ask(run, NULL, foot, there)));
	double along = 0, other;
	nearest(c, foot, &other);
	w->sampling = fmax(w->sampling, other / c->apart - 1);
	for (int k = 0; k < 3; k++) along += (p.x[k] - sample.x[k]) * normal[k];
	if (fabs(gap) > 0.2) w->ray = fmax(w->ray, fabs(along / (gap > 0 ? by : -by) - 1));
}

static void surfaces(void **state) {
	(void)state;
	bool good = true;
	char what[80];
	table_head("distance to 400 places of 1 m, and the normal there");
	for (int i = 0; i < SHAPES; i++) {
		const shape *s = &shapes[i];
		quern_run *run = open_body(s->dim, s->text);
		cloud c = { .apart = s->dim == 2 ? 2e-4 : 1.5e-2 };
		worst w = { 0 };
		uint64_t seed = 12345;
		s->surface(&c);
		for (int k = 0; k < 400; k++) {
			place p = { { 0 } };
			for (int a = 0; a < s->dim; a++) p.x[a] = uniform(&seed, -1.6, 1.6);
			look(run, s, &c, p, &w);
		}
		snprintf(what, sizeof what, "%s: off the closed form, m", s->name);
		good &= table_row(what, w.form, 0, 1e-14);
		good &= table_row("  of the nearest place off the surface, m", w.foot, 0, 1e-14);
		good &= table_row("  off the nearest sample, of their spacing", fmax(0, w.sampling), 0, 1e-9);
		good &= table_row("  cosine of normal and way from there, less 1", w.ray, 0, pow(c.apart / 0.2, 2));
		harness_close(run);
		free(c.at);
	}
	assert_true(good);
}

/* Every feature that faces a place is as far as its face, and the nearest is the body's own gap. */
static void features(void **state) {
	(void)state;
	static const quern_pose still = { .turn = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } };
	quern_run *run = open_body(2, POLYGON);
	const quern_instance *it = body_of(run, 0)->instance;
	uint64_t seed = 99;
	double worst_gap = 0;
	for (int k = 0; k < 4000; k++) {
		place p = { { uniform(&seed, -1.6, 1.6), uniform(&seed, -1.6, 1.6), 0 } };
		int32_t list[64];
		double normal[3], least = INFINITY;
		const double gap = ask(run, NULL, p, normal);
		const uint32_t n =
			((const quern_body_ops *)it->ops)->features(it->self, &still, p.x, fabs(gap) + 1e-9, 64, list);
		assert_true(n >= 1 && n <= 4);
		for (uint32_t f = 0; f < n; f++) {
			for (uint32_t g = 0; g < f; g++) assert_int_not_equal(list[f], list[g]);
			least = fmin(least, ask(run, &list[f], p, normal));
		}
		worst_gap = fmax(worst_gap, fabs(least - gap));
	}
	table_head("features of a polygon, at 4000 places");
	assert_true(table_row("nearest of them less nearest place, m", worst_gap, 0, 1e-14));
	harness_close(run);
}

/* ==== rebound ==== */

/* A hard grain of 1 m/s, shot at the place that is nearest to one in the material. */
static double bounce(const shape *s, double *sideways) {
	quern_run *run = open_body(s->dim, s->text);
	const double radius = 5e-3;
	double n[3];
	place at = s->before;
	const double gap = ask(run, NULL, at, n);
	harness_close(run);
	for (int k = 0; k < 3; k++) at.x[k] -= (gap - radius - 1e-9) * n[k];
	char position[120], velocity[120];
	snprintf(position, sizeof position, s->dim == 2 ? "[%.17g, %.17g]" : "[%.17g, %.17g, %.17g]", at.x[0],
		at.x[1], at.x[2]);
	snprintf(velocity, sizeof velocity, s->dim == 2 ? "[%.17g, %.17g]" : "[%.17g, %.17g, %.17g]", -n[0],
		-n[1], -n[2]);
	run = harness_open(1,
		"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s}, time: {end: 1}, output: "
		"{every: 1},\n"
		"bodies: [%s],\ngrains: {material: {density: 2500, radius: {mean: %.17g}},\n"
		"contact: {linear: {stiffness: 1e10, restitution: 0.7, friction: 0.3}}, place: [{position: %s, "
		"velocity: "
		"%s}]}}\n",
		s->dim, s->dim == 2 ? "[0, 0]" : "[0, 0, 0]", s->dim == 2 ? "[-2, -2]" : "[-2, -2, -2]",
		s->dim == 2 ? "[2, 2]" : "[2, 2, 2]", s->text, radius, position, velocity);
	harness_steps(run, 300);
	const quern_column v = harness_field(run, "grain.velocity");
	double out = 0, square = 0;
	for (int k = 0; k < s->dim; k++) out += v.real[k][0] * n[k], square += v.real[k][0] * v.real[k][0];
	*sideways = sqrt(fmax(0, square - out * out));
	harness_close(run);
	return out;
}

static void rebounds(void **state) {
	(void)state;
	bool good = true;
	char what[80];
	table_head("a grain of 1 m/s on each body, restitution 0.7: afterwards, m/s");
	for (int i = 0; i < SHAPES; i++) {
		double sideways;
		snprintf(what, sizeof what, "%s: along the normal", shapes[i].name);
		good &= table_row(what, bounce(&shapes[i], &sideways), 0.7, 0.005);
		good &= table_row("  and across", sideways, 0, 1e-6);
	}
	assert_true(good);
}

/* ==== names ==== */

static void names(void **state) {
	(void)state;
	quern_run *run =
		harness_open(1, "{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [1, "
						"1]}, time: {end: 1},\n"
						"output: {every: 1}, bodies: [{plane: {point: [0, 0], normal: [0, 1]}},\n"
						"  {box: {lower: [0.5, 0], upper: [0.6, 0.1], name: step_2}}, {segment: {from: [0, "
						"0.9], to: [0.1, 1], name: "
						"Gate}}],\n"
						"grains: {material: {density: 2500, radius: {mean: 1 mm}}, contact: {linear: "
						"{stiffness: 1e5}}, place: "
						"[{position: [0.2, 0.2]}]},\n"
						"observe: [{wall_force: {body: step_2}}, {wall_force: {body: Gate, label: gate}}, "
						"{wall_force: {body: 1, label: "
						"one}}, {wall_force: {label: none}}]}\n");
	static const int32_t asked[] = { 1, 2, 1, 0 };
	for (size_t e = 0; e < 4; e++) {
		const quern_instance *it = run->scene->observe.filling[e].instance;
		const quern_param *row = quern_param_find(it->file->params, "body");
		assert_int_equal((int32_t)quern_param_number(row, it->self), asked[e]);
	}
	harness_close(run);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(surfaces), cmocka_unit_test(features),
		cmocka_unit_test(rebounds), cmocka_unit_test(names) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
