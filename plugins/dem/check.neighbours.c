/* SPDX-License-Identifier: MIT */
/* check.neighbours - searches: the same pairs as by looking at all of them, each once in its block */
#include <math.h>
#include <quern/check.h>
#include <quern/neighbours.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
	uint32_t n, dim, periodic; /* bits by axis */
	double spread, length[3], reach;
} scenery;

typedef struct {
	quern_neighbour_job job;
	quern_real *memory, *position[3], *radius;
	uint32_t *block;
} grains;

static const scenery sceneries[] = { { 0, 0, 0, 0.1, { 1, 1, 1 }, 0.1 }, { 1, 0, 0, 0.1, { 1, 1, 1 }, 0.1 },
	{ 2, 0, 7, 0.1, { 0.1, 0.1, 0.1 }, 0.1 }, { 500, 0, 0, 0.1, { 40, 40, 12 }, 0.2 },
	{ 500, 0, 7, 0.1, { 40, 40, 12 }, 0.2 }, { 400, 0, 1, 0.8, { 30, 60, 9 }, 0.5 },
	{ 300, 0, 7, 0.3, { 7, 40, 7 }, 0.3 }, { 200, 0, 2, 0.3, { 400, 400, 400 }, 0.1 },
	{ 300, 0, 0, 0.0, { 10, 0.001, 10 }, 0.1 }, { 400, 0, 0, 0.98, { 60, 60, 20 }, 0.01 },
	{ 400, 0, 5, 0.98, { 30, 60, 15 }, 0.05 } };

/* Lengths are in diameters of 2 mm. */
static void create(const quern_check *c, const scenery *s, uint64_t key, grains *g) {
	const double diameter = 2e-3;
	*g = (grains) { .memory = c->host->memory(4 * (size_t)(s->n + 8), sizeof(quern_real)) };
	g->block = c->host->memory((size_t)s->n + 2, sizeof(uint32_t));
	g->radius = g->memory + 3 * (s->n + 8);
	g->job =
		(quern_neighbour_job) { .n = s->n, .dim = s->dim, .radius = g->radius, .reach = s->reach * diameter };
	for (uint32_t i = 0; i < s->n; i++) {
		g->radius[i] = 0.5 * diameter * (1 + c->host->uniform(key, i, -s->spread, s->spread));
		if (g->radius[i] > g->job.largest) g->job.largest = g->radius[i];
	}
	for (uint32_t a = 0; a < s->dim; a++) {
		g->position[a] = g->memory + a * (s->n + 8);
		g->job.position[a] = g->position[a];
		g->job.lower[a] = -0.01;
		g->job.upper[a] = g->job.lower[a] + s->length[a] * diameter;
		g->job.periodic[a] = s->periodic >> a & 1;
		for (uint32_t i = 0; i < s->n; i++)
			g->position[a][i] =
				c->host->uniform(key + 1, (uint64_t)a << 32 | i, g->job.lower[a], g->job.upper[a]);
	}
}

static void finish(grains *g) {
	free(g->job.memory);
	free(g->memory);
	free(g->block);
}

typedef struct {
	uint64_t key;
	uint32_t from;
} place;

static int by_key(const void *pa, const void *pb) {
	const place *a = pa, *b = pb;
	if (a->key != b->key) return a->key < b->key ? -1 : 1;
	return a->from < b->from ? -1 : a->from > b->from;
}

/* As the grains' solver does it: keys, a stable sort, blocks, an index. */
static void sort_grains(const quern_check *c, const quern_check_instance *it, grains *g) {
	const quern_neighbour_ops *ops = c->ops;
	const uint32_t n = g->job.n;
	uint64_t *key = c->host->memory((size_t)n + 1, sizeof *key);
	place *order = c->host->memory((size_t)n + 1, sizeof *order);
	quern_real *old = c->host->memory((size_t)n + 1, sizeof *old);
	c->host->place(c, "keys, %u-D, while n = %u", g->job.dim, n);
	const size_t wanted = ops->keys(it->self, &g->job, key);
	for (uint32_t i = 0; i < n; i++) order[i] = (place) { key[i], i };
	qsort(order, n, sizeof *order, by_key);
	for (uint32_t a = 0; a <= g->job.dim; a++) {
		quern_real *column = a < g->job.dim ? g->position[a] : g->radius;
		memcpy(old, column, n * sizeof *old);
		for (uint32_t i = 0; i < n; i++) column[i] = old[order[i].from];
	}
	for (uint32_t i = 0; i < n; i++)
		if (!i || order[i].key >> 32 != order[i - 1].key >> 32) g->block[g->job.n_blocks++] = i;
	g->block[g->job.n_blocks] = n;
	g->job.block = g->block;
	g->job.memory = c->host->memory(wanted + 64, 1);
	c->host->place(c, "index, %u-D, while n = %u", g->job.dim, n);
	if (ops->index) ops->index(it->self, &g->job);
	free(key), free(order), free(old);
}

static bool is_near(const quern_neighbour_job *j, uint32_t a, uint32_t b) {
	double d2 = 0;
	for (uint32_t k = 0; k < j->dim; k++) {
		const double length = j->upper[k] - j->lower[k];
		double d = j->position[k][a] - j->position[k][b];
		if (j->periodic[k]) d = d > 0.5 * length ? d - length : d < -0.5 * length ? d + length : d;
		d2 += d * d;
	}
	const double reach = j->radius[a] + j->radius[b] + j->reach;
	return d2 < reach * reach;
}

typedef struct {
	const quern_check *c;
	const quern_check_instance *it;
	const grains *g;
	quern_pair **pair; /* by block */
	uint32_t *found, *overrun, cap;
} search;

static void find(void *arg, uint32_t b, uint32_t worker) {
	enum { GUARD = -7 };
	search *s = arg;
	const quern_neighbour_ops *ops = s->c->ops;
	(void)worker;
	for (uint32_t i = s->cap; i < s->cap + 4; i++) s->pair[b][i] = (quern_pair) { GUARD, GUARD };
	s->found[b] = ops->pairs(s->it->self, &s->g->job, b, s->cap, s->pair[b]);
	for (uint32_t i = s->cap; i < s->cap + 4; i++)
		if (s->pair[b][i].first != GUARD || s->pair[b][i].second != GUARD) s->overrun[b]++;
}

typedef struct {
	quern_check_tally pairs, once, room, threads;
} tallies;

static void compare(const search *s, tallies *t) {
	const quern_check_host *host = s->c->host;
	const quern_neighbour_job *j = &s->g->job;
	bool *seen = host->memory((size_t)j->n * j->n + 1, sizeof *seen);
	for (uint32_t b = 0; b < j->n_blocks; b++) {
		const uint32_t begin = j->block[b], end = j->block[b + 1];
		memset(seen, 0, (size_t)j->n * j->n);
		for (uint32_t i = 0; i < s->found[b] && i < s->cap; i++) {
			const quern_pair p = s->pair[b][i];
			const bool known =
				p.first >= 0 && p.second >= 0 && (uint32_t)p.first < j->n && (uint32_t)p.second < j->n;
			host->expect(&t->once,
				known && (uint32_t)p.first >= begin && (uint32_t)p.first < end && p.first != p.second,
				"%u-D: the pair (%d, %d) does not begin in its block", j->dim, p.first, p.second);
			if (!known) continue;
			const size_t low = (size_t)(p.first < p.second ? p.first : p.second),
						 high = (size_t)(p.first < p.second ? p.second : p.first);
			host->expect(
				&t->once, !seen[low * j->n + high], "%u-D: a pair stands twice in one block", j->dim);
			host->expect(&t->pairs, is_near(j, (uint32_t)low, (uint32_t)high),
				"%u-D: a pair is farther than its reach", j->dim);
			seen[low * j->n + high] = true;
		}
		for (uint32_t a = begin; a < end; a++)
			for (uint32_t k = 0; k < j->n; k++) {
				const size_t low = a < k ? a : k, high = a < k ? k : a;
				if (k == a || !is_near(j, a, k)) continue;
				host->expect(&t->pairs, seen[low * j->n + high], "%u-D: %u grains: a near pair is not found",
					j->dim, j->n);
			}
	}
	free(seen);
}

static void try_scenery(
	const quern_check *c, const quern_check_instance *it, const scenery *what, tallies *t) {
	grains g;
	create(c, what, 140, &g);
	sort_grains(c, it, &g);
	search s = { .c = c, .it = it, .g = &g };
	s.pair = c->host->memory(g.job.n_blocks + 1, sizeof *s.pair);
	s.found = c->host->memory(g.job.n_blocks + 1, sizeof *s.found);
	s.overrun = c->host->memory(g.job.n_blocks + 1, sizeof *s.overrun);
	uint32_t *first = c->host->memory(g.job.n_blocks + 1, sizeof *first);
	for (uint32_t b = 0; b < g.job.n_blocks; b++)
		s.pair[b] = c->host->memory((size_t)g.job.n * 256 + 16, sizeof(quern_pair));
	c->host->place(c, "pairs, %u-D, while n = %u", g.job.dim, g.job.n);
	for (uint32_t cap = 0; cap < 3; cap++) { /* too little room: counts are right all the same */
		s.cap = cap;
		for (uint32_t b = 0; b < g.job.n_blocks; b++) find(&s, b, 0), first[b] = s.found[b];
	}
	s.cap = g.job.n * 256;
	for (uint32_t b = 0; b < g.job.n_blocks; b++) {
		find(&s, b, 0);
		c->host->expect(&t->room, first[b] == s.found[b],
			"%u-D: %u pairs are counted with little room, %u with enough", g.job.dim, first[b], s.found[b]);
		c->host->expect(&t->room, !s.overrun[b], "%u-D: pairs are written beyond cap", g.job.dim);
	}
	compare(&s, t);
	memcpy(first, s.found, g.job.n_blocks * sizeof *first);
	c->host->parallel(c, g.job.n_blocks, find, &s);
	c->host->expect(&t->threads, !memcmp(first, s.found, g.job.n_blocks * sizeof *first),
		"%u-D: several threads at once find other pairs", g.job.dim);
	for (uint32_t b = 0; b < g.job.n_blocks; b++) free(s.pair[b]);
	free(s.pair), free(s.found), free(s.overrun), free(first);
	finish(&g);
}

static void law(const quern_check *c) {
	tallies t = { { .name = "the same pairs as by brute force" }, { .name = "each once, in its block" },
		{ .name = "room" }, { .name = "threads" } };
	for (uint32_t dim = 2; dim <= 3; dim++) {
		quern_check_instance *it = c->host->instance_create(c, dim, 0);
		for (size_t i = 0; it && i < sizeof sceneries / sizeof *sceneries; i++) {
			scenery s = sceneries[i];
			s.dim = dim;
			try_scenery(c, it, &s, &t);
		}
		c->host->instance_destroy(it);
	}
	c->host->tell(c, &t.pairs, NULL);
	c->host->tell(c, &t.once, NULL);
	c->host->tell(c, &t.room, "counts do not depend on cap, and nothing is written beyond it");
	c->host->tell(c, &t.threads, NULL);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = { .size = sizeof ops, .kind = &quern_neighbours_kind, .law = law };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.neighbours",
	.brief = "Searches: the same pairs as by looking at all of them, each once in its block.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
