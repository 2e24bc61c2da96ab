/* SPDX-License-Identifier: MIT */
#include "placer.h"
#include "tools.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t hash(const int32_t c[3]) {
	return ((uint32_t)c[0] * 73856093u) ^ ((uint32_t)c[1] * 19349663u) ^ ((uint32_t)c[2] * 83492791u);
}

quern_status quern_placer_init(placer *p, uint32_t dim, const quern_real lower[3], const quern_real upper[3],
	const bool periodic[3], quern_real most) {
	*p = (placer) { .dim = dim, .n_heads = 1024 };
	for (uint32_t k = 0; k < 3; k++) {
		p->inverse[k] = 1 / (2 * most);
		p->half[k] = INFINITY;
		if (k >= dim) continue;
		p->lower[k] = lower[k];
		p->length[k] = upper[k] - lower[k];
		p->periodic[k] = periodic[k];
		if (!periodic[k]) continue;
		const quern_real cells = floor(p->length[k] / (2 * most));
		p->half[k] = 0.5 * p->length[k];
		p->wrap[k] = cells < 1 ? 1 : (int32_t)cells;
		p->inverse[k] = p->wrap[k] / p->length[k];
	}
	p->head = malloc(p->n_heads * sizeof(int32_t));
	if (!p->head) return QUERN_E_MEMORY;
	memset(p->head, 0xff, p->n_heads * sizeof(int32_t));
	return QUERN_OK;
}

bool quern_placer_bodies(placer *p, const quern_step *s, uint32_t slot, bool nodes) {
	const size_t n = (size_t)s->n_slot[slot] + 1;
	quern_bound *body = s->host->memory(s->run, n * sizeof(quern_bound));
	body_pose *pose = quern_body_poses_now(s, slot);
	if (!body || !pose) return false;
	p->n_bodies = 0;
	p->nodes = nodes;
	for (uint32_t b = 0; b < s->n_slot[slot]; b++) {
		const quern_bound *here = &s->slot[slot][b];
		if (!(nodes ? quern_body_meets_points : quern_body_is_there)(here, s->settling)) continue;
		pose[p->n_bodies] = pose[b];
		body[p->n_bodies++] = s->slot[slot][b];
	}
	p->body = body;
	p->pose = pose;
	return true;
}

void quern_placer_finish(placer *p) {
	if (!p) return;
	free(p->spot);
	free(p->next);
	free(p->head);
	*p = (placer) { 0 };
}

void quern_placer_empty(placer *p) {
	p->n = 0;
	memset(p->head, 0xff, p->n_heads * sizeof(int32_t));
}

/* Cell of a place, and a cell brought back through a periodic face. Neighbours are counted in cells: a place that is a
 * cell's width away may round into the cell beyond. */
static int32_t cell_at(const placer *p, uint32_t k, quern_real x) {
	return quern_cell_along(x, p->lower[k], p->inverse[k]);
}
static int32_t wrapped(const placer *p, uint32_t k, int32_t c) {
	return p->periodic[k] ? quern_cell_wrapped(c, p->wrap[k]) : c;
}
static int32_t cell_of(const placer *p, uint32_t k, quern_real x) { return wrapped(p, k, cell_at(p, k, x)); }

/* Of any image: whoever places a grain may have gone round a periodic domain. */
static quern_real nearest_image(const placer *p, uint32_t k, quern_real d) {
	return quern_image_far(d, p->periodic[k] ? p->length[k] : 0);
}

static void link_spot(placer *p, uint32_t i) {
	int32_t c[3] = { 0 };
	for (uint32_t k = 0; k < p->dim; k++) c[k] = cell_of(p, k, p->spot[i].x[k]);
	int32_t *head = &p->head[hash(c) & (p->n_heads - 1)];
	p->next[i] = *head;
	*head = (int32_t)i;
}

static void grow(placer *p) {
	const uint32_t cap = p->cap ? p->cap * 2 : 1024;
	quern_spot *spot = realloc(p->spot, cap * sizeof(quern_spot));
	if (spot) p->spot = spot;
	int32_t *next = realloc(p->next, cap * sizeof(int32_t));
	if (next) p->next = next;
	int32_t *head = realloc(p->head, (size_t)cap * 2 * sizeof(int32_t));
	if (head) p->head = head;
	p->failed = p->failed || !spot || !next || !head;
	if (p->failed) return;
	p->cap = cap;
	p->n_heads = cap * 2;
	memset(p->head, 0xff, p->n_heads * sizeof(int32_t));
	for (uint32_t i = 0; i < p->n; i++) link_spot(p, i);
}

void quern_placer_add(placer *p, const quern_spot *s) {
	if (p->n == p->cap) grow(p);
	if (p->failed) return;
	p->spot[p->n] = *s;
	link_spot(p, p->n++);
}

/* Between centres, of nearest images. */
static quern_real distance2(const placer *p, const quern_spot *a, const quern_spot *b) {
	quern_real d2 = 0;
	for (uint32_t k = 0; k < p->dim; k++) {
		const quern_real d = nearest_image(p, k, a->x[k] - b->x[k]);
		d2 += d * d;
	}
	return d2;
}

bool quern_placer_overlaps(const placer *p, const quern_spot *a, const quern_spot *b) {
	const quern_real reach = (a->radius + b->radius) - 1e-9 * a->radius;
	return distance2(p, a, b) < reach * reach;
}

/* Over the smaller radius. */
static quern_real overlap_of(const placer *p, const quern_spot *a, const quern_spot *b) {
	return (a->radius + b->radius - sqrt(distance2(p, a, b))) /
		   (a->radius < b->radius ? a->radius : b->radius);
}

static bool meets_body(const placer *p, const quern_spot *s) {
	static const body_pose still = { .pose = { .turn = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } } };
	for (uint32_t b = 0; b < p->n_bodies; b++) {
		const body_pose *pose = p->pose ? &p->pose[b] : &still;
		const quern_real reach =
			s->radius + (p->nodes ? ((const body_item *)p->body[b].item)->displacement : 0);
		if (quern_body_gap(&p->body[b], pose, p->dim, s->x, reach, NULL) < -1e-9 * s->radius) return true;
	}
	return false;
}

/* Cells are at least a largest diameter wide, so only the nearest ones can hold a neighbour. Along a short periodic
 * axis two offsets may name the same cell; looking twice does no harm. */
bool quern_placer_free(const placer *p, const quern_spot *s) {
	const int depth = p->dim == 3 ? 1 : 0;
	int32_t middle[3] = { 0 };
	for (uint32_t k = 0; k < p->dim; k++) middle[k] = cell_at(p, k, s->x[k]);
	for (int z = -depth; z <= depth; z++)
		for (int y = -1; y <= 1; y++)
			for (int x = -1; x <= 1; x++) {
				const int offset[3] = { x, y, z };
				int32_t c[3] = { 0 };
				for (uint32_t k = 0; k < p->dim; k++) c[k] = wrapped(p, k, middle[k] + offset[k]);
				for (int32_t i = p->head[hash(c) & (p->n_heads - 1)]; i >= 0; i = p->next[i])
					if (quern_placer_overlaps(p, s, &p->spot[i])) return false;
			}
	return !meets_body(p, s);
}

int32_t quern_placer_worst(const placer *p, const quern_spot *s, quern_real share,
	bool (*counts)(const void *arg, int32_t), const void *arg, quern_real *by) {
	const int depth = p->dim == 3 ? 1 : 0;
	int32_t middle[3] = { 0 }, worst = -1;
	*by = share;
	for (uint32_t k = 0; k < p->dim; k++) middle[k] = cell_at(p, k, s->x[k]);
	for (int z = -depth; z <= depth; z++)
		for (int y = -1; y <= 1; y++)
			for (int x = -1; x <= 1; x++) {
				const int offset[3] = { x, y, z };
				int32_t c[3] = { 0 };
				for (uint32_t k = 0; k < p->dim; k++) c[k] = wrapped(p, k, middle[k] + offset[k]);
				for (int32_t i = p->head[hash(c) & (p->n_heads - 1)]; i >= 0; i = p->next[i]) {
					const quern_real overlap = overlap_of(p, s, &p->spot[i]);
					if (overlap > *by && (!counts || counts(arg, i))) *by = overlap, worst = i;
				}
			}
	return worst;
}

/* `number`, if any: of each spot, as it was added. */
static uint32_t find_near(const placer *p, const quern_real lower[3], const quern_real upper[3],
	quern_real reach, quern_spot *out, int32_t *number, uint32_t cap) {
	uint32_t n = 0;
	int32_t count[3] = { 1, 1, 1 }, first[3] = { 0 };
	for (uint32_t k = 0; k < p->dim; k++) {
		first[k] = cell_at(p, k, lower[k] - reach);
		count[k] = cell_at(p, k, upper[k] + reach) - first[k] + 1;
		if (p->periodic[k] && count[k] > p->wrap[k]) count[k] = p->wrap[k];
	}
	for (int32_t z = 0; z < count[2]; z++)
		for (int32_t y = 0; y < count[1]; y++)
			for (int32_t x = 0; x < count[0]; x++) {
				const int32_t offset[3] = { x, y, z };
				int32_t c[3] = { 0 };
				for (uint32_t k = 0; k < p->dim; k++) c[k] = wrapped(p, k, first[k] + offset[k]);
				for (int32_t i = p->head[hash(c) & (p->n_heads - 1)]; i >= 0; i = p->next[i]) {
					quern_spot s = p->spot[i];
					bool near = true;
					for (uint32_t k = 0; k < p->dim; k++) {
						if (cell_of(p, k, s.x[k]) != c[k]) near = false; /* another cell of the same hash */
						const quern_real middle = 0.5 * (lower[k] + upper[k]);
						s.x[k] = middle + nearest_image(p, k, s.x[k] - middle);
						near = near && s.x[k] >= lower[k] - reach && s.x[k] <= upper[k] + reach;
					}
					if (!near) continue;
					if (n < cap) out[n] = s;
					if (n < cap && number) number[n] = i;
					n++;
				}
			}
	return n;
}

uint32_t quern_placer_near(const placer *p, const quern_real lower[3], const quern_real upper[3],
	quern_real reach, quern_spot *out, uint32_t cap) {
	return find_near(p, lower, upper, reach, out, NULL, cap);
}

quern_spot *quern_placer_seeds(
	const placer *p, const quern_real lower[3], const quern_real upper[3], quern_real reach, uint32_t *n) {
	*n = quern_placer_near(p, lower, upper, reach, NULL, 0);
	quern_spot *seed = malloc(((size_t)*n + 1) * sizeof *seed);
	if (seed) quern_placer_near(p, lower, upper, reach, seed, *n);
	return seed;
}

typedef struct {
	quern_spot spot;
	int32_t number;
} numbered;

static int by_number(const void *a, const void *b) {
	const int32_t one = ((const numbered *)a)->number, other = ((const numbered *)b)->number;
	return (one > other) - (one < other);
}

quern_spot *quern_placer_seeds_in_order(
	const placer *p, const quern_real lower[3], const quern_real upper[3], quern_real reach, uint32_t *n) {
	quern_spot *seed = quern_placer_seeds(p, lower, upper, reach, n);
	int32_t *number = malloc(((size_t)*n + 1) * sizeof *number);
	numbered *all = malloc(((size_t)*n + 1) * sizeof *all);
	const bool good = seed && number && all;
	if (good) find_near(p, lower, upper, reach, seed, number, *n);
	for (uint32_t i = 0; i < *n && good; i++) all[i] = (numbered) { seed[i], number[i] };
	if (good) qsort(all, *n, sizeof *all, by_number);
	for (uint32_t i = 0; i < *n && good; i++) seed[i] = all[i].spot;
	free(number);
	free(all);
	if (!good) free(seed);
	return good ? seed : NULL;
}
