/* SPDX-License-Identifier: MIT */
/* packer.grid - grains at the first free node of a fine grid, from the side that lies away from the continuum.
 * docs/theory/packers.md, section 5 */
#include "queue.h"

typedef struct {
	quern_real spacing;
} grid;

static const quern_param params[] = { QUERN_PARAM(grid, spacing, "1",
										  "Between nodes, over the radius of the region's first grain.",
										  .def = 0.1, .min = 0.01, .max = 2),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* Grains near the region, near one plane or one row of nodes: those beyond are found by the job alone. Radii from 1/8 to 3 of the first one have a class each. */
enum { BLOCKERS = 1024, CLASSES = 24, MOST_LINES = 4096 };

typedef struct {
	quern_real begin, end; /* m along the row; nodes between are too near to a grain */
} shadow;

typedef struct {
	packing p;
	quern_real pitch[3], first; /* m; radius of the first grain */
	uint32_t lines[3];
	uint32_t axis[3];             /* the slowest first; along the last one nodes are in one row */
	bool back[3];                 /* by axis: from its upper end */
	uint32_t rows, full[CLASSES]; /* rows in which no grain of the class or a larger one has room */
	uint32_t plane;               /* that `beside` is of */
	uint32_t n_around, n_beside, n;
	grain around[BLOCKERS],
		beside
			[BLOCKERS]; /* that the grain that waits may touch: in the region; in a plane across the slowest axis */
	shadow shadow[BLOCKERS];
} nodes;

/* ==== in which order ==== */

/* Away from the continuum first, which is where upstream points; no neighbour is, or all are: from anywhere. */
static void choose_direction(const packing *p, quern_real way[3]) {
	quern_real u[4], length2 = 0;
	for (uint32_t k = 0; k < p->job->dim; k++) length2 += p->job->upstream[k] * p->job->upstream[k];
	for (int i = 0; i < 4 && !(length2 > 0); i += 2)
		p->job->host->random(p->job->stream, p->job->key, p->job->counter++, u + i);
	for (uint32_t k = 0; k < p->job->dim; k++) way[k] = length2 > 0 ? p->job->upstream[k] : 2 * u[k] - 1;
}

static void order_axes(nodes *g, const quern_real way[3]) {
	const uint32_t dim = g->p.job->dim;
	for (uint32_t k = 0; k < dim; k++) {
		uint32_t steeper = 0;
		for (uint32_t j = 0; j < dim; j++)
			steeper +=
				quern_abs(way[j]) > quern_abs(way[k]) || (quern_abs(way[j]) == quern_abs(way[k]) && j < k);
		g->axis[steeper] = k;
		g->back[k] = way[k] < 0;
	}
}

static void lay_out(nodes *g, quern_real spacing) {
	const quern_pack_job *job = g->p.job;
	g->first = g->p.radius;
	g->rows = 1;
	for (uint32_t k = 0; k < job->dim; k++) {
		const quern_real width = job->upper[k] - job->lower[k], wanted = width / (spacing * g->first);
		g->lines[k] = wanted < MOST_LINES - 1 ? (uint32_t)wanted + 1 : MOST_LINES;
		g->pitch[k] = width / g->lines[k];
	}
	for (uint32_t k = 0; k + 1 < job->dim; k++) g->rows *= g->lines[g->axis[k]];
	for (uint32_t c = 0; c < CLASSES; c++) g->full[c] = 0;
}

static quern_real line(const nodes *g, uint32_t axis, uint32_t i) {
	const uint32_t from = g->back[axis] ? g->lines[axis] - 1 - i : i;
	return g->p.job->lower[axis] + (from + 0.5) * g->pitch[axis];
}

/* ==== one row ==== */

static quern_real coordinate(const grain *g, uint32_t axis) { return (&g->at.x)[axis]; }

static void look_around(nodes *g) {
	const uint32_t n = queued(&g->p);
	g->n_around = 0;
	for (uint32_t i = 0; i < n && g->n_around < BLOCKERS; i++) {
		const grain one = in_queue(&g->p, i);
		if (reaches_region(&g->p, &one)) g->around[g->n_around++] = one;
	}
}

static quern_real reach_of(const nodes *g, const grain *one) {
	return one->radius + g->p.radius - 1e-9 * g->p.radius;
}

static void look_beside(nodes *g, quern_real x) {
	g->n_beside = 0;
	for (uint32_t i = 0; i < g->n_around; i++) {
		const grain *one = &g->around[i];
		if (quern_abs(coordinate(one, g->axis[0]) - x) < reach_of(g, one)) g->beside[g->n_beside++] = *one;
	}
}

static void cast_shadows(nodes *g, const quern_real x[3], uint32_t along) {
	g->n = 0;
	for (uint32_t i = 0; i < g->n_beside; i++) {
		const grain *one = &g->beside[i];
		const quern_real reach = reach_of(g, one);
		quern_real left = reach * reach;
		for (uint32_t k = 0; k < g->p.job->dim; k++) {
			const quern_real d = k == along ? 0 : x[k] - coordinate(one, k);
			left -= d * d;
		}
		if (!(left > 0)) continue;
		const quern_real half = __builtin_sqrt(left), middle = coordinate(one, along);
		g->shadow[g->n++] = (shadow) { middle - half, middle + half };
	}
}

/* The first node from `i` on that lies in no shadow; that of a shadow's end is tried by itself, whatever the division rounds to. */
static uint32_t first_clear(const nodes *g, uint32_t along, uint32_t i) {
	const uint32_t n = g->lines[along];
	for (uint32_t k = 0; k < g->n && i < n;) {
		const shadow *s = &g->shadow[k];
		const quern_real x = line(g, along, i);
		if (!(x > s->begin && x < s->end)) {
			k++;
			continue;
		}
		const quern_real nodes_left = (g->back[along] ? x - s->begin : s->end - x) / g->pitch[along];
		i += nodes_left > 1 ? nodes_left < n ? (uint32_t)nodes_left : n : 1;
		k = 0;
	}
	return i;
}

static bool try_row(nodes *g, uint32_t row) {
	const uint32_t dim = g->p.job->dim, along = g->axis[dim - 1];
	const uint32_t plane = dim == 2 ? row : row / g->lines[g->axis[1]];
	quern_real x[3] = { 0 };
	for (uint32_t k = dim - 1; k-- > 0; row /= g->lines[g->axis[k]])
		x[g->axis[k]] = line(g, g->axis[k], row % g->lines[g->axis[k]]);
	if (plane != g->plane) look_beside(g, x[g->axis[0]]);
	g->plane = plane;
	cast_shadows(g, x, along);
	for (uint32_t i = first_clear(g, along, 0); i < g->lines[along]; i = first_clear(g, along, i + 1)) {
		x[along] = line(g, along, i);
		if (offer(&g->p, (quern_vec) { x[0], x[1], x[2] })) return true;
	}
	return false;
}

/* ==== all rows ==== */

static quern_real least_of(const nodes *g, uint32_t class) { return g->first * (class + 1) / 8; }

/* Room never grows: where a small grain had none, a larger one need not look again. */
static bool try_rows(nodes *g) {
	const quern_real radius = g->p.radius;
	uint32_t row = 0;
	look_around(g);
	g->plane = UINT32_MAX;
	for (uint32_t c = 0; c < CLASSES; c++)
		if (least_of(g, c) <= radius && g->full[c] > row) row = g->full[c];
	while (row < g->rows && !try_row(g, row)) row++;
	for (uint32_t c = 0; c < CLASSES; c++)
		if (least_of(g, c) >= radius && row > g->full[c]) g->full[c] = row;
	return row < g->rows;
}

static void pack(const void *self, quern_pack_job *job) {
	nodes g;
	quern_real way[3];
	begin(&g.p, job, 0, 0);
	choose_direction(&g.p, way);
	order_axes(&g, way);
	lay_out(&g, ((const grid *)self)->spacing);
	while (!g.p.stopped && try_rows(&g)) continue;
}

static const quern_packer_ops ops = { .size = sizeof ops, .pack = { pack, pack } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "packer.grid",
	.brief = "Grains at the first free node of a fine grid, from the side away from the continuum.",
	.doc = "The grid's nodes lie much closer than grains do; `lattice` has a place for each grain.",
	.cite = "Chantharayukhonthorn 2019, section 6.2.2",
	.instance_size = sizeof(grid),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
