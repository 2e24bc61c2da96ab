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

static uint32_t pairs(
	const void *self, const quern_neighbour_job *job, uint32_t b, uint32_t cap, quern_pair *out) {
	const layout *l = job->memory;
	const uint32_t(*range)[2] = (const uint32_t(*)[2])(const void *)(l + 1);
	const uint32_t begin = job->block[b], end = job->block[b + 1];
	const quern_images images = quern_images_of(job->dim, job->lower, job->upper, job->periodic);
	uint32_t n = 0;
	(void)self;
	for (uint32_t i = begin; i < end; i++) {
		uint32_t near[3][3], count[3];
		for (uint32_t a = 0; a < 3; a++)
			count[a] = beside(l, job, a, a < job->dim ? cell_along(l, job, a, i) : 0, near[a]);
		for (uint32_t z = 0; z < count[2]; z++)
			for (uint32_t y = 0; y < count[1]; y++)
				for (uint32_t x = 0; x < count[0]; x++) {
					const uint32_t *r =
						range[(near[2][z] * l->count[1] + near[1][y]) * l->count[0] + near[0][x]];
					for (uint32_t k = r[0]; k < r[0] + r[1]; k++) {
						if (k >= begin && k <= i) continue;
						quern_real d2 = 0;
						for (uint32_t a = 0; a < job->dim; a++) {
							const quern_real d = quern_image(
								job->position[a][i] - job->position[a][k], images.half[a], images.length[a]);
							d2 += d * d;
						}
						const quern_real reach = job->radius[i] + job->radius[k] + job->reach;
						if (!(d2 < reach * reach)) continue;
						if (n < cap) out[n] = (quern_pair) { (int32_t)i, (int32_t)k };
						n++;
					}
				}
	}
	return n;
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
