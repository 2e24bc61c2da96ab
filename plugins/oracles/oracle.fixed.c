/* SPDX-License-Identifier: MIT */
/* oracle.fixed - zones that the scene draws. docs/theory/hybrid.md, section 3 */
#include <math.h>
#include <quern/math.h>
#include <quern/oracle.h>

typedef struct {
	quern_real lower[3], upper[3];
	int32_t zone;
} box;
typedef struct {
	quern_real centre[3], radius;
	int32_t zone;
} sphere;
typedef struct {
	quern_real point[3], normal[3];
	int32_t zone;
} half_space;
typedef struct {
	quern_list boxes, spheres, half_spaces;
	int32_t otherwise;
	quern_real ramp, cell;
	quern_real length[3];    /* m, of the domain along periodic axes, else 0 */
	quern_real domain[2][3]; /* m, its corners; infinite along periodic axes */
} fixed;

static const char *const zones[] = { "discrete", "hybrid", "continuum", NULL };
#define ZONE_ROW(T) QUERN_PARAM(T, zone, "1", "What is in it.", .choices = zones)
static const quern_param box_rows[] = { QUERN_PARAM(
											box, lower, "m", "Lower corner.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(
		box, upper, "m", "Upper corner; the box may reach out of the domain.", .flags = QUERN_REQUIRED),
	ZONE_ROW(box), QUERN_END_PARAMS };
static const quern_param sphere_rows[] = { QUERN_PARAM(sphere, centre, "m", "Centre; in 2-D it is a disc.",
											   .flags = QUERN_REQUIRED),
	QUERN_PARAM(sphere, radius, "m", "Radius.", .flags = QUERN_REQUIRED | QUERN_MIN_OPEN, .max = 1e6),
	ZONE_ROW(sphere), QUERN_END_PARAMS };
static const quern_param half_space_rows[] = { QUERN_PARAM(half_space, point, "m", "A place on its face.",
												   .flags = QUERN_REQUIRED),
	QUERN_PARAM(half_space, normal, "1", "Out of it, of any length.", .flags = QUERN_REQUIRED),
	ZONE_ROW(half_space), QUERN_END_PARAMS };
static const quern_param params[] = { QUERN_PARAM(fixed, boxes, NULL, "Boxes along the axes.",
										  .rows = box_rows, .item_size = sizeof(box)),
	QUERN_PARAM(fixed, spheres, NULL, "Spheres.", .rows = sphere_rows, .item_size = sizeof(sphere)),
	QUERN_PARAM(fixed, half_spaces, NULL, "All that lies behind a plane.", .rows = half_space_rows,
		.item_size = sizeof(half_space)),
	QUERN_PARAM(fixed, otherwise, "1",
		"The zone elsewhere. Where regions overlap the least continuous one counts.", .choices = zones,
		.def = QUERN_CONTINUUM),
	QUERN_PARAM(fixed, ramp, "m",
		"How far the hybrid zone reaches from grains into the continuum, whose share grows on that way from "
		"none to all; 0: it is only where it is drawn. It begins at the face of each region by itself: let "
		"regions that shall be one overlap by as much.",
		.max = 1e6),
	QUERN_PARAM(
		fixed, cell, "m", "Cell of the grid.", .from = "grid.cell", .flags = QUERN_MAYBE | QUERN_ADVANCED),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static quern_status check_boxes(const fixed *p, const quern_setup *setup, quern_err *err) {
	const box *b = p->boxes.items;
	for (uint32_t i = 0; i < p->boxes.n; i++)
		for (uint32_t k = 0; k < setup->dim; k++)
			if (!(b[i].upper[k] > b[i].lower[k]))
				return setup->host->fail(err, QUERN_E_PARAM, "boxes",
					"the upper corner of box %u must be above the lower one; axis %u is not", i, k);
	return QUERN_OK;
}

/* Normals become unit vectors. */
static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	fixed *p = self;
	half_space *h = p->half_spaces.items;
	for (uint32_t i = 0; i < p->half_spaces.n; i++) {
		quern_real size = 0, sum = 0;
		for (uint32_t k = 0; k < setup->dim; k++) size = quern_max(size, quern_abs(h[i].normal[k]));
		if (!(size > 0))
			return setup->host->fail(
				err, QUERN_E_PARAM, "half_spaces", "the normal of half space %u has no length", i);
		for (uint32_t k = 0; k < setup->dim; k++) sum += h[i].normal[k] / size * (h[i].normal[k] / size);
		for (uint32_t k = 0; k < setup->dim; k++) {
			h[i].normal[k] = h[i].normal[k] / size / sqrt(sum);
			if (setup->periodic[k] && h[i].normal[k] != 0)
				return setup->host->fail(err, QUERN_E_PARAM, "half_spaces",
					"half space %u ends along axis %u, along which the domain is periodic: draw a box", i, k);
		}
	}
	for (uint32_t k = 0; k < setup->dim; k++) {
		p->length[k] = setup->periodic[k] ? setup->upper[k] - setup->lower[k] : 0;
		p->domain[0][k] = setup->periodic[k] ? -INFINITY : setup->lower[k];
		p->domain[1][k] = setup->periodic[k] ? INFINITY : setup->upper[k];
	}
	if (p->ramp > 0 && p->ramp < (1 - 1e-9) * p->cell)
		return setup->host->fail(err, QUERN_E_PARAM, "ramp",
			"must be a cell at least, %.4g m, or 0: a narrower zone is none in places", p->cell);
	return check_boxes(p, setup, err);
}

/* From a middle to x, or to the image of x that is nearest to it. */
static quern_real way_from(const fixed *p, uint32_t k, quern_real middle, quern_real x) {
	const quern_real way = x - middle, length = p->length[k];
	return length > 0 ? way - length * quern_floor(way / length + 0.5) : way;
}

/* m from the surface of a region to x: less than 0 inside. Faces that lie on the domain's are none: nothing is beyond. */
static quern_real from_box(const fixed *p, const box *b, const quern_real x[3], uint32_t dim) {
	quern_real inside = -INFINITY, outside2 = 0;
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real half = 0.5 * (b->upper[k] - b->lower[k]),
						 at = way_from(p, k, b->lower[k] + half, x[k]);
		const bool around = p->length[k] > 0 && 2 * half >= p->length[k];
		const quern_real below = around || b->lower[k] <= p->domain[0][k] ? -INFINITY : -half - at;
		const quern_real above = around || b->upper[k] >= p->domain[1][k] ? -INFINITY : at - half;
		const quern_real way = quern_max(below, above), out = quern_max(way, 0);
		inside = quern_max(inside, way);
		outside2 += out * out;
	}
	return inside > 0 ? sqrt(outside2) : inside;
}
static quern_real from_sphere(const fixed *p, const sphere *s, const quern_real x[3], uint32_t dim) {
	quern_real sum = 0;
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real way = way_from(p, k, s->centre[k], x[k]);
		sum += way * way;
	}
	return sqrt(sum) - s->radius;
}
static quern_real from_half_space(const half_space *h, const quern_real x[3], uint32_t dim) {
	quern_real sum = 0;
	for (uint32_t k = 0; k < dim; k++) sum += h->normal[k] * (x[k] - h->point[k]);
	return sum;
}

/* What the regions say of a place. */
typedef struct {
	int32_t zone;           /* 3: in none of them */
	quern_real to_discrete; /* m to the nearest that is discrete */
	quern_real depth;       /* m within those that are not */
} place;

static void meet(place *at, quern_real distance, int32_t zone) {
	if (zone == QUERN_DISCRETE) at->to_discrete = quern_min(at->to_discrete, distance);
	else at->depth = quern_max(at->depth, -distance);
	if (distance <= 0 && zone < at->zone) at->zone = zone;
}

static place look(const fixed *p, const quern_real x[3], uint32_t dim) {
	const box *b = p->boxes.items;
	const sphere *s = p->spheres.items;
	const half_space *h = p->half_spaces.items;
	place at = { 3, INFINITY, -INFINITY };
	for (uint32_t i = 0; i < p->boxes.n; i++) meet(&at, from_box(p, &b[i], x, dim), b[i].zone);
	for (uint32_t i = 0; i < p->spheres.n; i++) meet(&at, from_sphere(p, &s[i], x, dim), s[i].zone);
	for (uint32_t i = 0; i < p->half_spaces.n; i++) meet(&at, from_half_space(&h[i], x, dim), h[i].zone);
	if (at.zone == 3) at.zone = p->otherwise;
	if (p->otherwise == QUERN_DISCRETE) at.to_discrete = quern_min(at.to_discrete, at.depth);
	return at;
}

static void mark(const void *self, const quern_cell_batch *b) {
	(void)self;
	for (uint32_t i = 0; i < b->n; i++) b->level[i] = 1; /* no surface: distances are infinite */
}

/* The share is 1/2 - 1/2 cos(pi way/ramp); hybrid regions leave it to the solver. */
static void decide(const void *self, const quern_cell_batch *b) {
	const fixed *p = self;
	for (uint32_t i = 0; i < b->n; i++) {
		quern_real x[3] = { 0 };
		for (uint32_t k = 0; k < b->dim; k++) x[k] = b->centre[k][i];
		const place at = look(p, x, b->dim);
		const bool between = at.zone == QUERN_CONTINUUM && at.to_discrete < p->ramp;
		b->wish[i] = between ? QUERN_HYBRID : at.zone;
		if (b->weight)
			b->weight[i] =
				between ? 0.5 - 0.5 * quern_cos(3.14159265358979312 * at.to_discrete / p->ramp) : -1;
	}
}

static uint32_t wants(const void *self) { return ((const fixed *)self)->ramp > 0 ? QUERN_ORACLE_WEIGHT : 0; }

static const quern_oracle_ops ops = { .size = sizeof ops, .mark = mark, .decide = decide, .wants = wants };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "oracle.fixed",
	.brief = "Zones that the scene draws.",
	.doc = "Boxes, spheres and half spaces, each with its zone, whatever flows through them; between grains "
		   "and continuum a ramp if wished. A cell belongs to a region that holds its centre.",
	.instance_size = sizeof(fixed),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
