/* SPDX-License-Identifier: MIT */
/* neighbours.cells - linked cells as wide as the farthest pair; blocks of 16 x 16 or 8 x 8 x 8 of them.
 * docs/theory/grains.md, section 4 */
#include <math.h>
#include <quern/neighbours.h>
#include <quern/space.h>

typedef struct {
	int32_t unused;
} cells;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

/* The cells cover the grains' bounding box, or the whole length of a periodic axis. */
typedef struct {
	uint32_t count[3];
	uint32_t n;
	quern_real lower[3], inverse[3]; /* 1/m */
	uint32_t edge;                   /* cells of a block along an axis */
} layout;

static layout layout_of(const quern_neighbour_job *job) {
	layout l = { .count = { 1, 1, 1 }, .n = 1, .edge = job->dim == 2 ? 16 : 8 };
	quern_real least = 2 * job->largest + job->reach;
	quern_real lower[3] = { 0 }, length[3] = { 0 };
	for (uint32_t a = 0; a < job->dim; a++) {
		const quern_real *x = job->position[a];
		quern_real low = x[0], high = x[0];
		for (uint32_t i = 1; i < job->n; i++) {
			low = x[i] < low ? x[i] : low;
			high = x[i] > high ? x[i] : high;
		}
		lower[a] = job->periodic[a] ? job->lower[a] : low;
		length[a] = job->periodic[a] ? job->upper[a] - job->lower[a] : high - low;
	}
	/* a few far flyers must not ask for more cells than there are grains to fill them: widen the cells instead */
	for (;; least *= 1.5) {
		quern_real total = 1;
		for (uint32_t a = 0; a < job->dim; a++) total *= floor(length[a] / least) + 1;
		if (total <= 16.0 * job->n + 4096) break;
	}
	for (uint32_t a = 0; a < job->dim; a++) {
		const quern_real fit = floor(length[a] / least);
		l.count[a] = job->periodic[a] ? (fit < 1 ? 1 : (uint32_t)fit) : (uint32_t)fit + 1;
		l.lower[a] = lower[a];
		l.inverse[a] = job->periodic[a] ? l.count[a] / length[a] : 1 / least;
		l.n *= l.count[a];
	}
	return l;
}

static uint32_t cell_along(const layout *l, const quern_neighbour_job *job, uint32_t a, uint32_t i) {
	const int32_t c = quern_cell_along(job->position[a][i], l->lower[a], l->inverse[a]);
	return (uint32_t)quern_cell_held(c, (int32_t)l->count[a]);
}

static size_t keys(const void *self, const quern_neighbour_job *job, uint64_t *key) {
	(void)self;
	if (!job->n) return 0;
	const layout l = layout_of(job);
	const uint32_t bx = (l.count[0] + l.edge - 1) / l.edge, by = (l.count[1] + l.edge - 1) / l.edge;
	for (uint32_t i = 0; i < job->n; i++) {
		uint32_t c[3] = { 0 };
		for (uint32_t a = 0; a < job->dim; a++) c[a] = cell_along(&l, job, a, i);
		const uint64_t block = ((uint64_t)(c[2] / l.edge) * by + c[1] / l.edge) * bx + c[0] / l.edge;
		const uint32_t place = ((c[2] % l.edge) * l.edge + c[1] % l.edge) * l.edge + c[0] % l.edge;
		key[i] = block << 32 | place;
	}
	return sizeof(layout) + ((size_t)l.n + 1) * 2 * sizeof(uint32_t);
}

/* Grains of one cell lie together after the sort: its first one and its count are all there is to keep. */
static void index_cells(const void *self, const quern_neighbour_job *job) {
	layout *l = job->memory;
	uint32_t(*range)[2] = (uint32_t(*)[2])(void *)(l + 1);
	(void)self;
	if (!job->n) return;
	*l = layout_of(job);
	for (uint32_t i = 0; i < job->n; i++) {
		uint32_t c[3] = { 0 };
		for (uint32_t a = 0; a < job->dim; a++) c[a] = cell_along(l, job, a, i);
		uint32_t *r = range[(c[2] * l->count[1] + c[1]) * l->count[0] + c[0]];
		if (!r[1]) r[0] = i;
		r[1]++;
	}
}

/* The distinct cells beside c along an axis; three, or fewer at an edge or around a short periodic axis. */
static uint32_t beside(
	const layout *l, const quern_neighbour_job *job, uint32_t a, uint32_t c, uint32_t out[3]) {
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
	int32_t grain[CANDIDATES], near[CANDIDATES], hit[CANDIDATES];
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
	uint32_t hits = 0;
	QUERN_SIMD
	for (uint32_t q = 0; q < c->n; q++) {
		const quern_vec apart = { at.x - c->x[q], at.y - c->y[q], dim == 3 ? at.z - c->z[q] : 0 };
		const quern_vec d = quern_vec_image(apart, images, dim);
		const quern_real reach = own + c->radius[q] + beyond;
		c->near[q] = (quern_vec_dot(d, d, dim) < reach * reach) & ((c->grain[q] < begin) | (c->grain[q] > i));
	}
	for (uint32_t q = 0; q < c->n; q++) {
		c->hit[hits] = (int32_t)q;
		hits += (uint32_t)c->near[q];
	}
	for (uint32_t h = 0; h < hits; h++, f->n++)
		if (f->n < f->cap) f->out[f->n] = (quern_pair) { i, c->grain[c->hit[h]] };
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
	const layout *l = job->memory;
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
		const uint32_t *own = range[(cell[2] * l->count[1] + cell[1]) * l->count[0] + cell[0]];
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
