/* SPDX-License-Identifier: MIT */
/* body.polygon - all that lies within a closed line of straight edges. docs/theory/bodies.md */
#include "outline.h"
#include "surface.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST_VERTICES = 4096 };

typedef struct {
	quern_list vertices;
	outline line;
} polygon;
typedef struct {
	quern_real at[3];
} vertex;

static const quern_param rows[] = { QUERN_PARAM(vertex, at, "m", "Where it is.", .flags = QUERN_REQUIRED),
	QUERN_END_PARAMS };
static const quern_param params[] = {
	QUERN_PARAM(polygon, vertices, "m", "Its vertices, either way round, such as [[0, 0], [1, 0], [0, 1]].",
		.flags = QUERN_REQUIRED, .rows = rows, .item_size = sizeof(vertex), .min = 3, .max = MOST_VERTICES),
	QUERN_END_PARAMS
};
static const quern_use uses[] = { QUERN_END_USES };

static quern_status refuse(
	outline_fault fault, const uint32_t what[2], const quern_setup *setup, quern_err *err) {
	char where[40];
	snprintf(where, sizeof where, "vertices.%u", what[0]);
	switch (fault) {
	case OUTLINE_DOUBLE:
		return setup->host->fail(
			err, QUERN_E_PARAM, where, "is the same point as vertex %u: leave one out", what[1]);
	case OUTLINE_FLAT:
		return setup->host->fail(
			err, QUERN_E_PARAM, "vertices", "enclose no area: a thin wall is body.segment");
	case OUTLINE_CROSSES:
		return setup->host->fail(err, QUERN_E_PARAM, where,
			"begins an edge that meets the edge from vertex %u on: give them in order round the polygon",
			what[1]);
	default: return setup->host->fail(err, QUERN_E_MEMORY, NULL, "out of memory");
	}
}

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	polygon *p = self;
	const vertex *given = p->vertices.items;
	uint32_t what[2] = { 0 };
	quern_real(*corner)[2] = malloc(p->vertices.n * sizeof *corner);
	if (!corner) return refuse(OUTLINE_MEMORY, what, setup, err);
	for (uint32_t i = 0; i < p->vertices.n; i++)
		for (uint32_t k = 0; k < 2; k++) corner[i][k] = given[i].at[k];
	const outline_fault fault = outline_create(p->vertices.n, (const quern_real(*)[2])corner, &p->line, what);
	free(corner);
	return fault ? refuse(fault, what, setup, err) : QUERN_OK;
}

static void finish(void *self) { outline_destroy(&((polygon *)self)->line); }

/* ---- the nearest place ---- */

enum { LANES = 64 };

/* For each of some places the nearest one so far: on an edge the way is its normal and the size the distance along it,
 * at a corner the way goes from there and the size is its sign. */
typedef struct {
	_Alignas(64) quern_real square[LANES], size[LANES], way[2][LANES], corner[LANES], chain[LANES];
} nearest;

typedef struct {
	_Alignas(64) quern_real place[2][LANES], wanted[LANES];
	nearest all, own; /* of the whole outline; of the wanted chain, of what faces the place */
} work;

static void begin(nearest *to) {
	for (uint32_t i = 0; i < LANES; i++) {
		to->square[i] = INFINITY;
		to->size[i] = to->way[0][i] = to->way[1][i] = to->corner[i] = to->chain[i] = 0;
	}
}

/* An edge with its corner; the other end is the next edge's. What lies nearest to an edge is outside if it is on the
 * side of its normal, to a corner if it is on the side of the mean of both normals (Baerentzen & Aanaes 2005). */
static void try_edge(const outline_edge *edge, uint32_t n, work *w) {
	const outline_edge e = *edge;
	const quern_real chain = e.chain, at_corner = e.at_corner < 0 ? e.chain : e.at_corner;
	nearest *to = &w->all;
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		const quern_real x = w->place[0][i] - e.corner[0], y = w->place[1][i] - e.corner[1];
		const quern_real s = x * e.along[0] + y * e.along[1], away = x * e.out[0] + y * e.out[1];
		const bool corner = s <= 0;
		const quern_real onto = s < e.length ? away * away : INFINITY, square = corner ? x * x + y * y : onto;
		const quern_real side = x * e.between[0] + y * e.between[1] < 0 ? -1 : 1;
		const bool nearer = square < to->square[i];
		to->square[i] = nearer ? square : to->square[i];
		to->size[i] = nearer ? (corner ? side : away) : to->size[i];
		to->way[0][i] = nearer ? (corner ? x : e.out[0]) : to->way[0][i];
		to->way[1][i] = nearer ? (corner ? y : e.out[1]) : to->way[1][i];
		to->corner[i] = nearer ? (corner ? 1 : 0) : to->corner[i];
		to->chain[i] = nearer ? (corner ? at_corner : chain) : to->chain[i];
	}
}

/* The same for a chain alone, and for what faces the place: an edge if its foot lies on it and the place before it, a
 * corner if both feet lie on it. At an inside corner an edge goes on into the solid as far as the place lies before its
 * neighbour: so a grain that climbs the neighbour leaves it as it would leave a plane. */
static void try_facing(
	const outline_edge *before, const outline_edge *edge, const outline_edge *after, uint32_t n, work *w) {
	const outline_edge b = *before, e = *edge, a = *after;
	const quern_real chain = e.chain, at_corner = e.at_corner, slack = 1e-9 * e.length;
	const bool from_inner = e.inner, to_inner = a.inner;
	nearest *to = &w->own;
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		const quern_real x = w->place[0][i] - e.corner[0], y = w->place[1][i] - e.corner[1];
		const quern_real s = x * e.along[0] + y * e.along[1], away = x * e.out[0] + y * e.out[1];
		const quern_real past = x * b.along[0] + y * b.along[1], over = x * b.out[0] + y * b.out[1];
		const quern_real ax = w->place[0][i] - a.corner[0], ay = w->place[1][i] - a.corner[1];
		const quern_real on = ax * a.along[0] + ay * a.along[1], above = ax * a.out[0] + ay * a.out[1];
		const bool foot = (s > 0) & (s < e.length);
		const bool early = from_inner & (s <= 0) & (past < 0) & (past > -b.length) & (over >= 0);
		const bool late = to_inner & (s >= e.length) & (on > 0) & (on < a.length) & (above >= 0);
		const bool faces = (w->wanted[i] == chain) & (away >= 0) & (foot | early | late);
		const bool corner = (w->wanted[i] == at_corner) & (s <= slack) & (past >= -slack);
		const quern_real by_edge = faces ? away * away : INFINITY,
						 by_corner = corner ? x * x + y * y : INFINITY;
		const bool edge_first = by_edge <= by_corner;
		const quern_real square = edge_first ? by_edge : by_corner;
		const bool nearer = square < to->square[i];
		to->square[i] = nearer ? square : to->square[i];
		to->size[i] = nearer ? (edge_first ? away : 1) : to->size[i];
		to->way[0][i] = nearer ? (edge_first ? e.out[0] : x) : to->way[0][i];
		to->way[1][i] = nearer ? (edge_first ? e.out[1] : y) : to->way[1][i];
		to->corner[i] = nearer ? (edge_first ? 0 : 1) : to->corner[i];
	}
}

/* Leaves the distance for the size, and the normal for the way. */
static void settle(nearest *to, uint32_t n) {
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		const bool corner = to->corner[i] > 0, has_way = surface_has_way(to->square[i]);
		const quern_real size = to->size[i], x = to->way[0][i], y = to->way[1][i];
		const quern_real away = has_way ? __builtin_sqrt(to->square[i]) : 0,
						 scale = has_way ? size / away : 0;
		to->size[i] = corner ? size * away : size;
		to->way[0][i] = !corner ? x : has_way ? x * scale : 1;
		to->way[1][i] = !corner ? y : has_way ? y * scale : 0;
	}
}

/* A chain that does not face the place is out of reach, whatever the radius; a place inside is that chain's whose edge
 * is nearest. */
static void choose(const quern_real *restrict radius, uint32_t n, work *w) {
	nearest *all = &w->all;
	const nearest *own = &w->own;
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		const quern_real distance = all->size[i], far = __builtin_fabs(distance) + 2 * radius[i];
		const bool inside = distance < 0, here = inside & (all->chain[i] == w->wanted[i]);
		const bool faces = !inside & (own->square[i] < INFINITY);
		all->size[i] = here ? distance : faces ? own->size[i] : far;
		all->way[0][i] = faces ? own->way[0][i] : all->way[0][i];
		all->way[1][i] = faces ? own->way[1][i] : all->way[1][i];
	}
}

QUERN_INLINE void write_out(const quern_body_batch *b, const surface_pose *at, const work *w) {
	const surface_pose pose = *at;
	const quern_real *restrict radius = b->radius;
	quern_real *restrict gap = b->gap;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec x = QUERN_VEC_AT(b->position, i, 2);
		const quern_vec own = { w->all.way[0][i], w->all.way[1][i], 0 };
		const quern_real distance = w->all.size[i];
		const quern_vec n = quern_vec_turn(pose.turn, own), v = surface_velocity(&pose, x, n, distance);
		gap[i] = distance - radius[i];
		QUERN_VEC_PUT(b->normal, i, n, 2);
		QUERN_VEC_PUT(b->velocity, i, v, 2);
	}
}

QUERN_INLINE void load(const quern_body_batch *b, const surface_pose *at, work *w) {
	const surface_pose pose = *at;
	QUERN_SIMD
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec x = QUERN_VEC_AT(b->position, i, 2), d = surface_inward(&pose, x);
		w->place[0][i] = d.x;
		w->place[1][i] = d.y;
	}
	for (uint32_t i = 0; i < b->n && b->feature; i++) w->wanted[i] = b->feature[i];
	begin(&w->all);
	if (b->feature) begin(&w->own);
}

/* As many as fit into the work. */
static void find(const outline *o, const quern_body_batch *b) {
	const surface_pose pose = surface_pose_of(b->pose);
	work w;
	load(b, &pose, &w);
	for (uint32_t e = 0; e < o->n; e++) try_edge(&o->edge[e], b->n, &w);
	settle(&w.all, b->n);
	for (uint32_t e = 0; e < o->n && b->feature; e++)
		try_facing(&o->edge[e ? e - 1 : o->n - 1], &o->edge[e], &o->edge[e + 1 < o->n ? e + 1 : 0], b->n, &w);
	if (b->feature) {
		settle(&w.own, b->n);
		choose(b->radius, b->n, &w);
	}
	write_out(b, &pose, &w);
}

static void closest(const void *self, const quern_body_batch *b) {
	for (uint32_t from = 0; from < b->n; from += LANES) {
		quern_body_batch part = *b;
		part.n = b->n - from < LANES ? b->n - from : LANES;
		part.radius += from;
		part.gap += from;
		if (b->feature) part.feature += from;
		for (uint32_t k = 0; k < 2; k++) {
			part.position[k] += from;
			part.normal[k] += from;
			part.velocity[k] += from;
		}
		find(&((const polygon *)self)->line, &part);
	}
}

/* Of an edge from end to end, whichever way it faces: a grain may move before it is asked for again. */
static quern_real square_to(const outline_edge *e, quern_vec x) {
	const quern_real dx = x.x - e->corner[0], dy = x.y - e->corner[1];
	const quern_real s = dx * e->along[0] + dy * e->along[1], on = s < 0 ? 0 : s > e->length ? e->length : s;
	const quern_real wx = dx - on * e->along[0], wy = dy - on * e->along[1];
	return wx * wx + wy * wy;
}

/* Edges of a chain follow each other, round the end of the list too. */
static uint32_t features(const void *self, const quern_pose *pose, const quern_real x[3], quern_real reach,
	uint32_t cap, int32_t *feature) {
	const outline *o = &((const polygon *)self)->line;
	const surface_pose at = surface_pose_of(pose);
	const quern_vec d = surface_inward(&at, QUERN_VEC_OF(x));
	int32_t first = -1, last = -1;
	uint32_t n = 0;
	for (uint32_t e = 0; e < o->n; e++) {
		const int32_t chain = o->edge[e].chain;
		if (chain == last || chain == first || !(square_to(&o->edge[e], d) < reach * reach)) continue;
		if (n < cap) feature[n] = chain;
		if (!n) first = chain;
		last = chain;
		n++;
	}
	return n;
}

static void bounds(const void *self, uint32_t dim, quern_real lower[3], quern_real upper[3]) {
	const outline *o = &((const polygon *)self)->line;
	for (uint32_t k = 0; k < dim; k++) lower[k] = o->lower[k], upper[k] = o->upper[k];
}

static const quern_body_ops ops = {
	.size = sizeof ops, .closest = closest, .features = features, .bounds = bounds
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D,
	.id = "body.polygon",
	.brief = "A solid polygon, convex or not.",
	.doc = "In an inside corner a grain touches both edges; over an outer one it rolls without a jump.",
	.cite = "Baerentzen & Aanaes 2005, IEEE Trans. Vis. Comput. Graph. 11:243",
	.instance_size = sizeof(polygon),
	.params = params,
	.uses = uses,
	.init = init,
	.finish = finish,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
