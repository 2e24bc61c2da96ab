/* SPDX-License-Identifier: MIT */
#include "relax.h"
#include <math.h>
#include <quern/space.h>
#include <stdlib.h>
#include <string.h>

/* Two grains, the second one of them maybe among those that stay; or a grain and a body. */
typedef struct {
	uint32_t one, other;
} pair;

typedef struct {
	pair *item;
	uint32_t n, cap;
} pairs;

/* Grains 0 .. n - 1 move, the others up to `all` stay. */
typedef struct {
	quern_relax_job *job;
	uint32_t dim, n, all;
	quern_spot *grain, *kept; /* as they are now; where they last were inside */
	quern_real *begin;        /* m: radius in the beginning */
	quern_real (*anchor)[3];  /* where they were when the lists were made */
	bool *gone;
	quern_images images;
	quern_real widest, skin; /* m: radius of the widest; what lists reach farther than touches do */
	pairs touching, leaning;
	bool failed;
} relaxing;

/* ==== lists of those that may touch ==== */

typedef struct {
	quern_real lower[3], inverse[3];
	int32_t count[3];
	bool periodic[3];
	uint32_t *begin, *grain; /* by cell; grains by their cells */
} cells;

static void add_pair(relaxing *r, pairs *list, uint32_t one, uint32_t other) {
	if (list->n == list->cap) {
		const uint32_t cap = list->cap ? 2 * list->cap : 4096;
		pair *grown = realloc(list->item, cap * sizeof *grown);
		r->failed = r->failed || !grown;
		if (!grown) return;
		list->item = grown;
		list->cap = cap;
	}
	list->item[list->n++] = (pair) { one, other };
}

static quern_real full_of(const relaxing *r, uint32_t i) {
	return i < r->n ? r->job->full[i] : r->grain[i].radius;
}

/* As many cells as grains at most, or nearly so, however far these lie apart. */
static void lay_out(const relaxing *r, cells *c) {
	const quern_real widest = 2 * r->widest + r->skin, all = r->all;
	const quern_real lines = 1 + (r->dim == 2 ? __builtin_sqrt(all) : cbrt(all));
	for (uint32_t k = 0; k < 3; k++) {
		c->lower[k] = 0, c->inverse[k] = 0, c->count[k] = 1, c->periodic[k] = false;
		if (k >= r->dim) continue;
		quern_real lower = r->grain[0].x[k], upper = lower;
		for (uint32_t i = 1; i < r->all; i++) {
			lower = fmin(lower, r->grain[i].x[k]);
			upper = fmax(upper, r->grain[i].x[k]);
		}
		c->periodic[k] = r->job->periodic[k];
		if (c->periodic[k]) lower = r->job->lower[k], upper = r->job->upper[k];
		const quern_real fit = fmin((upper - lower) / widest, 2 * lines);
		c->lower[k] = lower;
		c->count[k] = fit >= 1 ? (int32_t)fit : 1;
		c->inverse[k] = c->count[k] > 1 ? c->count[k] / (upper - lower) : 0;
	}
}

static int32_t line_of(const cells *c, uint32_t axis, quern_real x) {
	const int32_t i = (int32_t)floor((x - c->lower[axis]) * c->inverse[axis]), n = c->count[axis];
	if (c->periodic[axis]) return (i % n + n) % n;
	return i < 0 ? 0 : i >= n ? n - 1 : i;
}

static uint32_t cell_of(const cells *c, const int32_t at[3]) {
	return ((uint32_t)at[2] * (uint32_t)c->count[1] + (uint32_t)at[1]) * (uint32_t)c->count[0] +
		   (uint32_t)at[0];
}

static uint32_t cell_at(const cells *c, const quern_real x[3]) {
	const int32_t at[3] = { line_of(c, 0, x[0]), line_of(c, 1, x[1]), line_of(c, 2, x[2]) };
	return cell_of(c, at);
}

static bool sort_cells(const relaxing *r, cells *c) {
	const size_t n = (size_t)c->count[0] * (size_t)c->count[1] * (size_t)c->count[2];
	c->begin = calloc(n + 2, sizeof *c->begin);
	c->grain = malloc((r->all + (size_t)1) * sizeof *c->grain);
	if (!c->begin || !c->grain) return false;
	for (uint32_t i = 0; i < r->all; i++) c->begin[cell_at(c, r->grain[i].x) + 2]++;
	for (size_t k = 0; k < n; k++) c->begin[k + 2] += c->begin[k + 1];
	for (uint32_t i = 0; i < r->all; i++) c->grain[c->begin[cell_at(c, r->grain[i].x) + 1]++] = i;
	return true;
}

static quern_real between(const relaxing *r, uint32_t i, uint32_t j, quern_real way[3]) {
	quern_real d2 = 0;
	for (uint32_t k = 0; k < r->dim; k++) {
		way[k] = quern_image_far(r->grain[i].x[k] - r->grain[j].x[k], r->images.length[k]);
		d2 += way[k] * way[k];
	}
	return d2;
}

static void list_cell(relaxing *r, const cells *c, uint32_t i, uint32_t cell) {
	quern_real way[3];
	for (uint32_t q = c->begin[cell]; q < c->begin[cell + 1]; q++) {
		const uint32_t j = c->grain[q];
		if (j <= i || r->gone[j]) continue;
		const quern_real reach = full_of(r, i) + full_of(r, j) + r->skin;
		if (between(r, i, j, way) < reach * reach) add_pair(r, &r->touching, i, j);
	}
}

/* Along a short periodic axis the cells below and above may be one, or the own. */
static void list_grain(relaxing *r, const cells *c, uint32_t i) {
	int32_t first[3] = { 0 }, times[3] = { 1, 1, 1 };
	for (uint32_t k = 0; k < r->dim; k++) {
		const int32_t at = line_of(c, k, r->grain[i].x[k]), n = c->count[k];
		first[k] = c->periodic[k] ? at - 1 : at > 0 ? at - 1 : 0;
		times[k] = c->periodic[k] ? (n < 3 ? n : 3) : (at + 1 < n ? at + 2 : n) - first[k];
	}
	for (int32_t z = 0; z < times[2]; z++)
		for (int32_t y = 0; y < times[1]; y++)
			for (int32_t x = 0; x < times[0]; x++) {
				const int32_t at[3] = { (first[0] + x + c->count[0]) % c->count[0],
					(first[1] + y + c->count[1]) % c->count[1], (first[2] + z + c->count[2]) % c->count[2] };
				list_cell(r, c, i, cell_of(c, at));
			}
}

static void list_bodies(relaxing *r, uint32_t i) {
	quern_spot spot = r->grain[i];
	quern_real normal[3];
	spot.radius = full_of(r, i);
	for (uint32_t b = 0; b < r->job->n_bodies; b++)
		if (r->job->gap(r->job, b, &spot, normal) < r->skin) add_pair(r, &r->leaning, i, b);
}

static void make_lists(relaxing *r) {
	cells c = { .begin = NULL };
	r->touching.n = r->leaning.n = 0;
	lay_out(r, &c);
	r->failed = r->failed || !sort_cells(r, &c);
	for (uint32_t i = 0; i < r->n && !r->failed; i++) {
		memcpy(r->anchor[i], r->grain[i].x, sizeof r->anchor[i]);
		if (r->gone[i]) continue;
		list_grain(r, &c, i);
		list_bodies(r, i);
	}
	free(c.begin);
	free(c.grain);
}

static bool lists_are_old(const relaxing *r) {
	for (uint32_t i = 0; i < r->n; i++) {
		quern_real d2 = 0;
		for (uint32_t k = 0; k < r->dim; k++) {
			const quern_real d = quern_image_far(r->grain[i].x[k] - r->anchor[i][k], r->images.length[k]);
			d2 += d * d;
		}
		if (!r->gone[i] && d2 > 0.25 * r->skin * r->skin) return true;
	}
	return false;
}

/* ==== one sweep ==== */

/* A little farther than touching, so that few sweeps leave no overlap at all where there is room. */
static const quern_real apart = 1 + 1e-4;
/* Over-relaxation: what is too dense over many grains spreads in a seventh of the sweeps. */
static const quern_real further = 1.8;

static void push(relaxing *r, const pair *p) {
	quern_spot *a = &r->grain[p->one], *b = &r->grain[p->other];
	quern_real way[3];
	if (r->gone[p->one] || r->gone[p->other]) return;
	const quern_real d2 = between(r, p->one, p->other, way), reach = (a->radius + b->radius) * apart;
	if (!(d2 < reach * reach) || !(d2 > 0)) return;
	const quern_real d = __builtin_sqrt(d2), share = p->other < r->n ? 0.5 * further : 1;
	for (uint32_t k = 0; k < r->dim; k++) {
		const quern_real by = share * (reach - d) / d * way[k];
		a->x[k] += by;
		if (p->other < r->n) b->x[k] -= by;
	}
}

static void push_off(relaxing *r, const pair *p) {
	quern_spot *a = &r->grain[p->one];
	quern_real normal[3];
	if (r->gone[p->one]) return;
	const quern_real gap = r->job->gap(r->job, p->other, a, normal);
	for (uint32_t k = 0; k < r->dim && gap < 0; k++) a->x[k] -= gap * apart * normal[k];
}

/* What has been pushed over the region's edge goes along it, or stays. */
static void keep_inside(relaxing *r, uint32_t i) {
	quern_spot *a = &r->grain[i];
	for (uint32_t k = 0; k < r->dim; k++) {
		const quern_real length = r->images.length[k];
		if (!r->job->periodic[k]) continue;
		if (a->x[k] < r->job->lower[k]) a->x[k] += length;
		if (a->x[k] >= r->job->upper[k]) a->x[k] -= length;
	}
	for (uint32_t k = 0; k <= r->dim && !r->job->inside(r->job, a->x); k++) {
		quern_spot along = *a;
		if (k < r->dim) along.x[k] = r->kept[i].x[k];
		else memcpy(along.x, r->kept[i].x, sizeof along.x);
		if (k == r->dim || r->job->inside(r->job, along.x)) *a = along;
	}
	r->kept[i] = *a;
}

static void sweep(relaxing *r) {
	if (lists_are_old(r)) make_lists(r);
	for (uint32_t q = 0; q < r->touching.n; q++) push(r, &r->touching.item[q]);
	for (uint32_t q = 0; q < r->leaning.n; q++) push_off(r, &r->leaning.item[q]);
	for (uint32_t i = 0; i < r->n; i++)
		if (!r->gone[i]) keep_inside(r, i);
}

/* ==== what is left ==== */

/* Over the smaller radius. */
static quern_real overlap_of(const relaxing *r, const pair *p) {
	const quern_spot *a = &r->grain[p->one], *b = &r->grain[p->other];
	quern_real way[3];
	if (r->gone[p->one] || r->gone[p->other]) return 0;
	return (a->radius + b->radius - __builtin_sqrt(between(r, p->one, p->other, way))) /
		   fmin(a->radius, b->radius);
}

static quern_real overlap_with(const relaxing *r, const pair *p) {
	const quern_spot *a = &r->grain[p->one];
	quern_real normal[3];
	return r->gone[p->one] ? 0 : -r->job->gap(r->job, p->other, a, normal) / a->radius;
}

static quern_real worst(relaxing *r) {
	quern_real most = 0;
	if (lists_are_old(r)) make_lists(r);
	for (uint32_t q = 0; q < r->touching.n; q++) most = fmax(most, overlap_of(r, &r->touching.item[q]));
	for (uint32_t q = 0; q < r->leaning.n; q++) most = fmax(most, overlap_with(r, &r->leaning.item[q]));
	return most;
}

static bool settle(relaxing *r, int32_t sweeps, quern_real overlap) {
	for (int32_t k = 0; k < sweeps && !r->failed; k++) {
		if (k % 10 == 0 && worst(r) <= overlap) return true;
		sweep(r);
	}
	return r->failed || worst(r) <= overlap;
}

typedef struct {
	quern_real overlap;
	uint32_t one, other; /* the second: all of them that move, if it is a body */
} excess;

/* The worst first, and of those that are alike the one that was placed last. */
static int by_overlap(const void *a, const void *b) {
	const excess *x = a, *y = b;
	if (x->overlap != y->overlap) return x->overlap < y->overlap ? 1 : -1;
	if (x->one != y->one) return x->one < y->one ? 1 : -1;
	return (x->other < y->other) - (x->other > y->other);
}

static excess *list_excess(relaxing *r, quern_real overlap, uint32_t *n) {
	excess *list = malloc(((size_t)r->touching.n + r->leaning.n + 1) * sizeof *list);
	*n = 0;
	r->failed = r->failed || !list;
	for (uint32_t q = 0; q < r->touching.n && list; q++) {
		const pair *p = &r->touching.item[q];
		const quern_real by = overlap_of(r, p);
		if (by > overlap) list[(*n)++] = (excess) { by, p->one, p->other < r->n ? p->other : p->one };
	}
	for (uint32_t q = 0; q < r->leaning.n && list; q++) {
		const pair *p = &r->leaning.item[q];
		const quern_real by = overlap_with(r, p);
		if (by > overlap) list[(*n)++] = (excess) { by, p->one, p->one };
	}
	if (list) qsort(list, *n, sizeof *list, by_overlap);
	return list;
}

/* Of each pair the later one, whose place was chosen after the other's; of the worst pairs only, since each that goes makes room for
 * several. */
static void take_away(relaxing *r, quern_real overlap, uint32_t most) {
	uint32_t n;
	excess *list = list_excess(r, overlap, &n);
	for (uint32_t q = 0; q < n && most; q++) {
		if (r->gone[list[q].one] || r->gone[list[q].other]) continue;
		r->gone[list[q].other] = true;
		most--;
	}
	free(list);
}

static void grow(relaxing *r, quern_real share) {
	for (uint32_t i = 0; i < r->n; i++)
		r->grain[i].radius =
			share < 1 ? r->begin[i] + share * (r->job->full[i] - r->begin[i]) : r->job->full[i];
}

/* ==== all of it ==== */

static bool begin(relaxing *r, quern_relax_job *job) {
	const size_t all = (size_t)job->n + job->n_around;
	*r = (relaxing) { .job = job, .dim = job->dim, .n = job->n, .all = (uint32_t)all };
	r->images = quern_images_of(job->dim, job->lower, job->upper, job->periodic);
	r->grain = malloc((all + 1) * sizeof *r->grain);
	r->kept = malloc(((size_t)job->n + 1) * sizeof *r->kept);
	r->begin = malloc(((size_t)job->n + 1) * sizeof *r->begin);
	r->anchor = malloc(((size_t)job->n + 1) * sizeof *r->anchor);
	r->gone = calloc(all + 1, sizeof *r->gone);
	if (!r->grain || !r->kept || !r->begin || !r->anchor || !r->gone) return false;
	memcpy(r->grain, job->spot, job->n * sizeof *r->grain);
	memcpy(r->kept, job->spot, job->n * sizeof *r->kept);
	if (job->n_around) memcpy(r->grain + job->n, job->around, job->n_around * sizeof *r->grain);
	for (uint32_t i = 0; i < r->n; i++) r->begin[i] = r->grain[i].radius;
	for (uint32_t i = 0; i < r->all; i++) r->widest = fmax(r->widest, full_of(r, i));
	r->skin = 0.3 * r->widest;
	make_lists(r);
	return !r->failed;
}

static void finish(relaxing *r) {
	free(r->grain);
	free(r->kept);
	free(r->begin);
	free(r->anchor);
	free(r->gone);
	free(r->touching.item);
	free(r->leaning.item);
}

quern_status quern_packer_relax(quern_relax_job *job, int32_t sweeps, quern_real overlap) {
	enum { ROUNDS = 60 };
	relaxing r;
	if (!job->n) return QUERN_OK;
	bool good = begin(&r, job), done = false;
	for (int32_t k = 1; k <= sweeps && good; k++) {
		grow(&r, (quern_real)k / sweeps);
		sweep(&r);
		good = !r.failed;
	}
	for (int k = 0; k < ROUNDS && good && !done; k++) {
		done = settle(&r, k ? sweeps : 10 * sweeps, overlap);
		if (!done) take_away(&r, overlap, k + 1 < ROUNDS ? 1 + job->n / 64 : UINT32_MAX);
		good = !r.failed;
	}
	for (uint32_t i = 0; i < job->n && good; i++) {
		job->spot[i] = r.grain[i];
		job->spot[i].radius = r.gone[i] ? 0 : job->full[i];
	}
	finish(&r);
	return good ? QUERN_OK : QUERN_E_MEMORY;
}
