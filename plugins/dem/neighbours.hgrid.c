/* SPDX-License-Identifier: MIT */
/* neighbours.hgrid - a hierarchical grid: every size of grains has cells of its own width. After Ogarko & Luding 2012.
 * docs/theory/grains.md, section 4 */
#include "cell_grid.h"
#include "levels.h"

typedef struct {
	int32_t unused;
} hgrid;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

typedef struct {
	level_set levels;
	cell_grid level[MOST_LEVELS];
	uint32_t first[MOST_LEVELS]; /* a level's first cell, in the row of all levels' cells */
	uint32_t n_cells;            /* of all levels */
	uint32_t edge;               /* of a block, in cells of the level with most grains */
} layout;

/* ---- levels and cells ---- */

/* What is as wide as the widest pair, rounding included. */
static quern_real widened(quern_real width) { return width * (1 + 1e-9); }

/* Cells along a block that would hold about as many grains as those of `cells` do of equal ones. */
static uint32_t edge_of(const level_set *levels, uint32_t dim) {
	const uint32_t least = dim == 2 ? 16 : 8, most = 64;
	uint32_t edge = least;
	while (edge < most && power(edge + 1, dim) < power(least, dim) * levels->room) edge++;
	return edge;
}

static layout layout_of(const quern_neighbour_job *job) {
	layout l = {
		.levels = levels_of(job->n, job->radius, job->reach, job->dim),
	};
	const extent e = extent_of(job);
	l.edge = edge_of(&l.levels, job->dim);
	for (uint32_t h = 0; h < l.levels.n; h++) {
		l.level[h] = cell_grid_of(job, &e, widened(2 * l.levels.most[h] + job->reach), l.levels.count[h]);
		l.first[h] = l.n_cells;
		l.n_cells += l.level[h].n;
	}
	return l;
}

/* ---- the index: grains by level and cell, with copies of what the search reads of them ---- */

typedef struct {
	const layout *l;
	uint32_t *start; /* [n_cells + 2] of each cell's grains */
	uint32_t *cell, *grain;
	quern_real *x[3], *radius;
} hindex;

static size_t bytes_of(const layout *l, const quern_neighbour_job *job) {
	return sizeof *l + ((size_t)job->dim + 1) * job->n * sizeof(quern_real) +
		   ((size_t)l->n_cells + 2 + 2 * (size_t)job->n) * sizeof(uint32_t);
}

static hindex index_at(void *memory, const quern_neighbour_job *job) {
	hindex at = { .l = memory };
	quern_real *real = (quern_real *)(void *)((layout *)memory + 1);
	for (uint32_t a = 0; a < job->dim; a++, real += job->n) at.x[a] = real;
	at.radius = real;
	at.start = (uint32_t *)(void *)(real + job->n);
	at.cell = at.start + at.l->n_cells + 2;
	at.grain = at.cell + job->n;
	return at;
}

static size_t keys(const void *self, const quern_neighbour_job *job, uint64_t *key) {
	(void)self;
	if (!job->n) return 0;
	const layout l = layout_of(job);
	const cell_grid *g = &l.level[l.levels.crowded];
	for (uint32_t i = 0; i < job->n; i++) key[i] = block_key(g, l.edge, job, i);
	return bytes_of(&l, job);
}

/* A counting sort by cell. */
static void index_levels(const void *self, const quern_neighbour_job *job) {
	(void)self;
	if (!job->n) return;
	*(layout *)job->memory = layout_of(job);
	const hindex at = index_at(job->memory, job);
	for (uint32_t i = 0; i < job->n; i++) {
		const uint32_t h = level_of(&at.l->levels, job->radius[i]);
		at.cell[i] = at.l->first[h] + cell_of(&at.l->level[h], job, i);
		at.start[at.cell[i] + 2]++;
	}
	for (uint32_t c = 0; c < at.l->n_cells; c++) at.start[c + 2] += at.start[c + 1];
	for (uint32_t i = 0; i < job->n; i++) {
		const uint32_t q = at.start[at.cell[i] + 1]++;
		at.grain[q] = i;
		at.radius[q] = job->radius[i];
		for (uint32_t a = 0; a < job->dim; a++) at.x[a][q] = job->position[a][i];
	}
}

/* ---- the search ---- */

/* Of two grains of one block the smaller one's level finds the larger, and of two of one level that of lower number. */
typedef enum { SAME, LARGER, SMALLER } whose;

typedef struct {
	const quern_neighbour_job *job;
	hindex at;
	quern_images images;
	uint32_t begin, end, n, cap;
	quern_pair *out;
} hunt;

/* Cells along an axis from `low` on, counted on beyond the last one of a ring. */
typedef struct {
	int32_t low, n, count;
} span;

static span span_of(const cell_grid *g, bool periodic, uint32_t a, quern_real x, quern_real width) {
	const int32_t count = (int32_t)g->count[a];
	int32_t low = quern_cell_along(x - width, g->lower[a], g->inverse[a]),
			high = quern_cell_along(x + width, g->lower[a], g->inverse[a]);
	if (!periodic) low = quern_cell_held(low, count), high = quern_cell_held(high, count);
	else if (high - low >= count) low = 0, high = count - 1;
	return (span) { low, high - low + 1, count };
}

static uint32_t cell_at(const span *s, int32_t t) {
	const int32_t c = s->low + t;
	return (uint32_t)(c < 0 ? c + s->count : c >= s->count ? c - s->count : c);
}

/* Whether no image of any grain in these cells is nearer than the grain itself. */
static bool is_plain(const span *s, quern_real length, quern_real half) {
	return s->low >= 0 && s->low + s->n <= s->count && (s->n + 1) * length < half;
}

QUERN_INLINE bool is_wanted(const hunt *s, uint32_t i, uint32_t k, const whose of) {
	const bool inside = k - s->begin < s->end - s->begin;
	return of == SAME ? !inside || k > i : of == LARGER || !inside;
}

/* Entries from .. to - 1 of the index. */
QUERN_INLINE void look_along(
	hunt *s, uint32_t i, uint32_t from, uint32_t to, const int dim, const bool plain, const whose of) {
	const quern_neighbour_job *job = s->job;
	for (uint32_t q = from; q < to; q++) {
		quern_real d2 = 0;
		for (int a = 0; a < dim; a++) {
			const quern_real d = job->position[a][i] - s->at.x[a][q];
			const quern_real near = plain ? d : quern_image(d, s->images.half[a], s->images.length[a]);
			d2 += near * near;
		}
		const quern_real reach = job->radius[i] + s->at.radius[q] + job->reach;
		if (!(d2 < reach * reach)) continue;
		const uint32_t k = s->at.grain[q];
		if (!is_wanted(s, i, k, of)) continue;
		if (s->n < s->cap) s->out[s->n] = (quern_pair) { (int32_t)i, (int32_t)k };
		s->n++;
	}
}

/* A row of cells is one stretch of the index, or two where it goes through the seam. */
QUERN_INLINE void look_at(
	hunt *s, uint32_t level, const span *along, uint32_t i, const int dim, const bool plain, const whose of) {
	const cell_grid *g = &s->at.l->level[level];
	const uint32_t *first = s->at.start + s->at.l->first[level];
	const span *x = &along[0];
	const int32_t deep = dim == 3 ? along[2].n : 1;
	for (int32_t tz = 0; tz < deep; tz++)
		for (int32_t ty = 0; ty < along[1].n; ty++) {
			const uint32_t z = dim == 3 ? cell_at(&along[2], tz) : 0;
			const uint32_t *start = first + (z * g->count[1] + cell_at(&along[1], ty)) * g->count[0];
			const uint32_t begin = cell_at(x, 0), end = begin + (uint32_t)x->n;
			const uint32_t over = end > g->count[0] ? end - g->count[0] : 0;
			look_along(s, i, start[begin], start[end - over], dim, plain, of);
			if (over) look_along(s, i, start[0], start[over], dim, plain, of);
		}
}

QUERN_INLINE void look(hunt *s, uint32_t level, uint32_t i, const int dim, const whose of) {
	const quern_neighbour_job *job = s->job;
	const cell_grid *g = &s->at.l->level[level];
	const quern_real width = widened(job->radius[i] + s->at.l->levels.most[level] + job->reach);
	span along[3];
	bool plain = true;
	for (uint32_t a = 0; a < (uint32_t)dim; a++) {
		along[a] = span_of(g, job->periodic[a], a, job->position[a][i], width);
		plain = plain && is_plain(&along[a], g->length[a], s->images.half[a]);
	}
	if (plain) look_at(s, level, along, i, dim, true, of);
	else look_at(s, level, along, i, dim, false, of);
}

QUERN_INLINE void search(hunt *s, const int dim) {
	const level_set *levels = &s->at.l->levels;
	for (uint32_t i = s->begin; i < s->end; i++) {
		const uint32_t own = level_of(levels, s->job->radius[i]);
		for (uint32_t h = 0; h < own; h++) look(s, h, i, dim, SMALLER);
		look(s, own, i, dim, SAME);
		for (uint32_t h = own + 1; h < levels->n; h++) look(s, h, i, dim, LARGER);
	}
}

static uint32_t pairs(
	const void *self, const quern_neighbour_job *job, uint32_t b, uint32_t cap, quern_pair *out) {
	hunt s = { .job = job,
		.at = index_at(job->memory, job),
		.images = quern_images_of(job->dim, job->lower, job->upper, job->periodic),
		.begin = job->block[b],
		.end = job->block[b + 1],
		.cap = cap,
		.out = out };
	(void)self;
	if (job->dim == 2) search(&s, 2);
	else search(&s, 3);
	return s.n;
}

static const quern_neighbour_ops ops = {
	.size = sizeof ops, .keys = keys, .index = index_levels, .pairs = pairs
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "neighbours.hgrid",
	.brief = "A hierarchical grid, for grains of very different sizes.",
	.doc =
		"Levels of cells follow from the sizes that are there; grains of one size have one level. Finds the pairs that "
		"cells finds.",
	.cite = "Ogarko & Luding 2012",
	.instance_size = sizeof(hgrid),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
