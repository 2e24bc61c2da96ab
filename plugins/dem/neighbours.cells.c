/* SPDX-License-Identifier: MIT */
/* neighbours.cells - linked cells as wide as the farthest pair; blocks of 16 x 16 or 8 x 8 x 8 of them.
 * docs/theory/grains.md, section 4 */
#include "../common/compress.h"
#include "cell_grid.h"

typedef struct {
	int32_t unused;
} cells;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static uint32_t edge_of(uint32_t dim) { return dim == 2 ? 16 : 8; }

static cell_grid layout_of(const quern_neighbour_job *job) {
	const extent e = extent_of(job);
	return cell_grid_of(job, &e, 2 * job->largest + job->reach, job->n);
}

static size_t keys(const void *self, const quern_neighbour_job *job, uint64_t *key) {
	(void)self;
	if (!job->n) return 0;
	const cell_grid l = layout_of(job);
	for (uint32_t i = 0; i < job->n; i++) key[i] = block_key(&l, edge_of(job->dim), job, i);
	return sizeof l + (size_t)l.n * 2 * sizeof(uint32_t);
}

/* Grains of one cell lie together after the sort: its first one and its count are all there is to keep. */
static void index_cells(const void *self, const quern_neighbour_job *job) {
	cell_grid *l = job->memory;
	uint32_t(*range)[2] = (uint32_t(*)[2])(void *)(l + 1);
	(void)self;
	if (!job->n) return;
	*l = layout_of(job);
	for (uint32_t i = 0; i < job->n; i++) {
		uint32_t *r = range[cell_of(l, job, i)];
		if (!r[1]) r[0] = i;
		r[1]++;
	}
}

/* The distinct cells beside c along an axis; three, or fewer at an edge or around a short periodic axis. */
static uint32_t beside(
	const cell_grid *l, const quern_neighbour_job *job, uint32_t a, uint32_t c, uint32_t out[3]) {
	const uint32_t count = l->count[a];
	uint32_t n = 0;
	if (a >= job->dim) return out[0] = 0, 1;
	if (job->periodic[a]) {
		out[n++] = c;
		if (count > 1) out[n++] = (c + 1) % count;
		if (count > 2) out[n++] = (c + count - 1) % count;
		return n;
	}
	if (c > 0) out[n++] = c - 1;
	out[n++] = c;
	if (c + 1 < count) out[n++] = c + 1;
	return n;
}

/* Grains that may be near those of one cell. */
enum { CANDIDATES = 128 };
typedef struct {
	uint32_t n;
	int32_t grain[CANDIDATES], near[CANDIDATES];
	_Alignas(64) quern_real x[CANDIDATES], y[CANDIDATES], z[CANDIDATES], radius[CANDIDATES];
} candidates;

/* Where pairs go, and those of which block are looked for: inside it those whose second grain comes later. */
typedef struct {
	const quern_neighbour_job *job;
	quern_images images;
	int32_t begin;
	uint32_t n, cap;
	quern_pair *out;
} finding;

/* Pairs of grain i and the candidates. */
QUERN_INLINE void find(finding *f, candidates *c, int32_t i, const int dim) {
	const quern_neighbour_job *job = f->job;
	const quern_vec at = { job->position[0][i], job->position[1][i], dim == 3 ? job->position[2][i] : 0 };
	const quern_real own = job->radius[i], beyond = job->reach;
	const quern_images images = f->images;
	const int32_t begin = f->begin;
	QUERN_SIMD
	for (uint32_t q = 0; q < c->n; q++) {
		const quern_vec apart = { at.x - c->x[q], at.y - c->y[q], dim == 3 ? at.z - c->z[q] : 0 };
		const quern_vec d = quern_vec_image(apart, images, dim);
		const quern_real reach = own + c->radius[q] + beyond;
		c->near[q] = (quern_vec_dot(d, d, dim) < reach * reach) & ((c->grain[q] < begin) | (c->grain[q] > i));
	}
	const uint32_t hits = quern_compress_numbers(c->n, c->near, c->near, NULL);
	for (uint32_t h = 0; h < hits; h++, f->n++)
		if (f->n < f->cap) f->out[f->n] = (quern_pair) { i, c->grain[c->near[h]] };
}

/* The same for all grains of a cell; then there is room for others. */
QUERN_INLINE void find_all(finding *f, candidates *c, uint32_t first, uint32_t last, const int dim) {
	for (uint32_t i = first; i < last; i++) find(f, c, (int32_t)i, dim);
	c->n = 0;
}

/* Pairs of the grains `first` .. `last` of a cell and those of one of its neighbours. */
QUERN_INLINE void beside_cell(
	finding *f, candidates *c, uint32_t first, uint32_t last, const uint32_t range[2], const int dim) {
	const quern_neighbour_job *job = f->job;
	for (uint32_t k = range[0]; k < range[0] + range[1]; k++) {
		if ((int32_t)k >= f->begin && k <= first) continue;
		if (c->n == CANDIDATES) find_all(f, c, first, last, dim);
		const uint32_t q = c->n++;
		c->grain[q] = (int32_t)k;
		c->x[q] = job->position[0][k];
		c->y[q] = job->position[1][k];
		if (dim == 3) c->z[q] = job->position[2][k];
		c->radius[q] = job->radius[k];
	}
}

/* Cell by cell: its grains have the same neighbours. */
QUERN_INLINE uint32_t find_pairs(
	const quern_neighbour_job *job, uint32_t b, uint32_t cap, quern_pair *out, const int dim) {
	const cell_grid *l = job->memory;
	const uint32_t(*range)[2] = (const uint32_t(*)[2])(const void *)(l + 1);
	const uint32_t end = job->block[b + 1];
	finding f = { .job = job,
		.images = quern_images_of(job->dim, job->lower, job->upper, job->periodic),
		.begin = (int32_t)job->block[b],
		.cap = cap,
		.out = out };
	candidates c;
	c.n = 0;
	for (uint32_t first = job->block[b], last; first < end; first = last) {
		uint32_t cell[3] = { 0 }, near[3][3], count[3];
		for (uint32_t a = 0; a < 3; a++) {
			if (a < job->dim) cell[a] = cell_along(l, job, a, first);
			count[a] = beside(l, job, a, cell[a], near[a]);
		}
		const uint32_t *own = range[cell_number(l, cell)];
		last = own[0] + own[1];
		for (uint32_t z = 0; z < count[2]; z++)
			for (uint32_t y = 0; y < count[1]; y++)
				for (uint32_t x = 0; x < count[0]; x++)
					beside_cell(&f, &c, first, last,
						range[(near[2][z] * l->count[1] + near[1][y]) * l->count[0] + near[0][x]], dim);
		find_all(&f, &c, first, last, dim);
	}
	return f.n;
}

static uint32_t pairs(
	const void *self, const quern_neighbour_job *job, uint32_t b, uint32_t cap, quern_pair *out) {
	(void)self;
	return job->dim == 2 ? find_pairs(job, b, cap, out, 2) : find_pairs(job, b, cap, out, 3);
}

static const quern_neighbour_ops ops = {
	.size = sizeof ops, .keys = keys, .index = index_cells, .pairs = pairs
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "neighbours.cells",
	.brief = "Linked cells.",
	.doc = "Cells as wide as the largest diameter and the reach of the list; best for radii that do not "
		   "differ much.",
	.instance_size = sizeof(cells),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
