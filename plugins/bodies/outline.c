/* SPDX-License-Identifier: MIT */
#include "outline.h"
#include <math.h>
#include <quern/math.h>
#include <stdlib.h>

typedef const quern_real place[2];

/* Twice the area of a triangle, positive if it is passed counterclockwise. */
static quern_real area(place a, place b, place c) {
	return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Whether p, on the line through a and b, lies between them. */
static bool lies_between(place a, place b, place p) {
	for (int k = 0; k < 2; k++) {
		const quern_real low = a[k] < b[k] ? a[k] : b[k], high = a[k] < b[k] ? b[k] : a[k];
		if (p[k] < low || p[k] > high) return false;
	}
	return true;
}

/* Segments that cross or touch (Cormen et al., Introduction to Algorithms, section 33.1). */
static bool meet(place a, place b, place c, place d) {
	const quern_real of_a = area(c, d, a), of_b = area(c, d, b), of_c = area(a, b, c), of_d = area(a, b, d);
	if (((of_a > 0 && of_b < 0) || (of_a < 0 && of_b > 0)) &&
		((of_c > 0 && of_d < 0) || (of_c < 0 && of_d > 0)))
		return true;
	return (of_a == 0 && lies_between(c, d, a)) || (of_b == 0 && lies_between(c, d, b)) ||
		   (of_c == 0 && lies_between(a, b, c)) || (of_d == 0 && lies_between(a, b, d));
}

/* Neighbours share a corner, and more only if one goes back along the other. */
static bool folds(place a, place b, place c) {
	return area(a, b, c) == 0 && (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) < 0;
}

static outline_fault look_at(uint32_t n, const quern_real (*corner)[2], uint32_t what[2]) {
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t next = (i + 1) % n;
		const quern_real dx = corner[next][0] - corner[i][0], dy = corner[next][1] - corner[i][1];
		what[0] = i, what[1] = next;
		if (!(dx * dx + dy * dy > 1e-280)) return OUTLINE_DOUBLE;
	}
	bool flat = true;
	for (uint32_t i = 2; i < n; i++) flat = flat && area(corner[0], corner[1], corner[i]) == 0;
	if (flat) return OUTLINE_FLAT;
	for (uint32_t i = 0; i < n; i++)
		for (uint32_t j = i + 1; j < n; j++) {
			place *a = &corner[i], *b = &corner[(i + 1) % n], *c = &corner[j], *d = &corner[(j + 1) % n];
			what[0] = i, what[1] = j;
			const bool after = j == i + 1, before = (j + 1) % n == i;
			if (after && before) continue;
			if (after ? folds(*a, *b, *d) : before ? folds(*c, *d, *b) : meet(*a, *b, *c, *d))
				return OUTLINE_CROSSES;
		}
	return 0;
}

/* ---- edges ---- */

static void set_edge(outline_edge *e, place from, place to) {
	const quern_real dx = to[0] - from[0], dy = to[1] - from[1];
	e->length = sqrt(dx * dx + dy * dy);
	e->corner[0] = from[0], e->corner[1] = from[1];
	e->along[0] = dx / e->length, e->along[1] = dy / e->length;
	e->out[0] = e->along[1], e->out[1] = -e->along[0];
}

/* The angle by which the outline turns at the edge's corner, positive at an outer one. */
static quern_real turn_at(const outline_edge *before, const outline_edge *e) {
	const quern_real *a = before->along, *b = e->along;
	return quern_atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]);
}

static void set_between(const outline_edge *before, outline_edge *e) {
	const quern_real x = before->out[0] + e->out[0], y = before->out[1] + e->out[1];
	const quern_real length = sqrt(x * x + y * y);
	e->between[0] = length > 0 ? x / length : before->along[0]; /* a spike points along itself */
	e->between[1] = length > 0 ? y / length : before->along[1];
}

/* ---- chains ---- */

/* Turned inwards by less than this, a corner is a rounding of the outline rather than a place to touch two edges. */
static const quern_real slight = 0.017453292519943295; /* rad, a degree */
static const quern_real half_turn = 3.14159265358979;  /* and a little less */

/* Corners where a chain ends, by the number of the edge that begins there; the first is one. The outline of one chain is
 * convex, but for a degree, and turns by less than half a turn: no place has two nearest points on it. */
static void cut(const outline *o, uint32_t first, bool *ends) {
	quern_real turned = 0, most = 0;
	for (uint32_t k = 0; k < o->n; k++) {
		const uint32_t i = (first + k) % o->n;
		turned += turn_at(&o->edge[(i + o->n - 1) % o->n], &o->edge[i]);
		most = turned > most ? turned : most;
		ends[i] = k == 0 || turned < most - slight || turned >= half_turn;
		if (ends[i]) turned = most = 0;
	}
}

/* The corner that is turned inwards most; a convex outline has none. */
static bool find_inmost(const outline *o, uint32_t *at) {
	quern_real least = -slight;
	bool found = false;
	for (uint32_t i = 0; i < o->n; i++) {
		const quern_real turn = turn_at(&o->edge[(i + o->n - 1) % o->n], &o->edge[i]);
		if (turn < least) least = turn, *at = i, found = true;
	}
	return found;
}

static void name_chains(outline *o, uint32_t first, const bool *ends) {
	int32_t chain = -1;
	for (uint32_t k = 0; k < o->n; k++) {
		const uint32_t i = (first + k) % o->n;
		if (ends[i] || chain < 0) chain++;
		o->edge[i].chain = chain;
	}
	o->n_chains = (uint32_t)chain + 1;
	for (uint32_t i = 0; i < o->n; i++) {
		outline_edge *e = &o->edge[i];
		const outline_edge *before = &o->edge[(i + o->n - 1) % o->n];
		const bool outer = turn_at(before, e) >= 0;
		e->at_corner = outer ? before->chain : -1;
		e->inner = !outer && ends[i];
	}
}

static bool make_chains(outline *o) {
	uint32_t first = 0;
	bool *ends = calloc(o->n, sizeof *ends);
	if (!ends) return false;
	if (find_inmost(o, &first)) cut(o, first, ends); /* else it is one chain, however far it turns */
	name_chains(o, first, ends);
	free(ends);
	return true;
}

/* ---- all of it ---- */

static bool is_clockwise(uint32_t n, const quern_real (*corner)[2]) {
	quern_real whole = 0;
	for (uint32_t i = 1; i + 1 < n; i++) whole += area(corner[0], corner[i], corner[i + 1]);
	return whole < 0;
}

outline_fault outline_create(uint32_t n, const quern_real (*corner)[2], outline *o, uint32_t what[2]) {
	const outline_fault fault = look_at(n, corner, what);
	if (fault) return fault;
	*o = (outline) { .edge = calloc(n, sizeof *o->edge), .n = n };
	if (!o->edge) return OUTLINE_MEMORY;
	const bool back = is_clockwise(n, corner);
	for (uint32_t i = 0; i < n; i++)
		set_edge(&o->edge[i], corner[back ? n - 1 - i : i], corner[back ? (2 * n - 2 - i) % n : (i + 1) % n]);
	for (uint32_t i = 0; i < n; i++) set_between(&o->edge[(i + n - 1) % n], &o->edge[i]);
	for (int k = 0; k < 2; k++) {
		o->lower[k] = o->upper[k] = corner[0][k];
		for (uint32_t i = 1; i < n; i++) {
			o->lower[k] = corner[i][k] < o->lower[k] ? corner[i][k] : o->lower[k];
			o->upper[k] = corner[i][k] > o->upper[k] ? corner[i][k] : o->upper[k];
		}
	}
	if (make_chains(o)) return 0;
	outline_destroy(o);
	return OUTLINE_MEMORY;
}

void outline_destroy(outline *o) {
	if (!o) return;
	free(o->edge);
	*o = (outline) { 0 };
}
