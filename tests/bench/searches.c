/* SPDX-License-Identifier: MIT */
/* searches - how long one remaking of the list takes by `cells` and by `hgrid`, for spheres of two sizes with equal volumes:
 *
 *   searches GRAINS ROUNDS SIGMA ...      SIGMA: small over large radius
 *
 * Large spheres are placed at random so that none overlap, small ones anywhere outside of them, in a periodic cube of which their volumes
 * together are 0.6. Timed are keys, sort, index and the pairs of all blocks, as the solver calls them, on one thread; the searches take
 * turns and the least of all rounds counts. Both must find as many pairs. One line of CSV for each SIGMA; docs/bench.md */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "../../plugins/common/sort.h"
#include "../physics/plugin_alone.h"
#include <math.h>
#include <quern/neighbours.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const double REACH =
	0.1; /* of the small diameter, as the solver's skin is of the mean one of its first material */

typedef struct cloud {
	uint32_t n, n_large;
	double *x[3], *radius, size, small;
} cloud;

static double uniform(uint64_t *state) {
	uint64_t z = *state += 0x9e3779b97f4a7c15u; /* splitmix64 */
	z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
	z = (z ^ z >> 27) * 0x94d049bb133111ebu;
	return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

static void *need(void *memory) {
	if (!memory) exit(1);
	return memory;
}

/* Large spheres by the cells of a grid as wide as they are. */
typedef struct lattice {
	int32_t side, *head, *next;
} lattice;

/* Whether a centre is nearer than `gap` to that of a large sphere. */
static bool is_taken(const cloud *c, const lattice *l, const double x[3], double gap) {
	int32_t at[3];
	for (int k = 0; k < 3; k++) at[k] = (int32_t)(x[k] / c->size * l->side);
	for (int32_t q = 0; q < 27; q++) {
		const int32_t cell[3] = { (at[0] + q % 3 - 1 + l->side) % l->side,
			(at[1] + q / 3 % 3 - 1 + l->side) % l->side, (at[2] + q / 9 - 1 + l->side) % l->side };
		for (int32_t i = l->head[(cell[2] * l->side + cell[1]) * l->side + cell[0]]; i >= 0; i = l->next[i]) {
			double d2 = 0;
			for (int k = 0; k < 3; k++) {
				const double d = fabs(x[k] - c->x[k][i]), near = fmin(d, c->size - d);
				d2 += near * near;
			}
			if (d2 < gap * gap) return true;
		}
	}
	return false;
}

static cloud scatter(uint32_t n, double sigma) {
	const double cube = sigma * sigma * sigma, ball = 4.1887902047863905;
	cloud c = { .n = n, .n_large = (uint32_t)(n * cube / (1 + cube) + 0.5), .small = sigma };
	uint64_t state = 1;
	c.size = cbrt(ball * (c.n_large + (n - c.n_large) * cube) / 0.6);
	for (int k = 0; k < 3; k++) c.x[k] = need(malloc(n * sizeof(double)));
	c.radius = need(malloc(n * sizeof(double)));
	lattice l = { .side = (int32_t)(c.size / 2) };
	const size_t cells = (size_t)l.side * (size_t)l.side * (size_t)l.side;
	l.head = need(malloc(cells * sizeof *l.head));
	l.next = need(malloc(n * sizeof *l.next));
	memset(l.head, -1, cells * sizeof *l.head);
	for (uint32_t i = 0; i < n; i++) {
		const bool large = i < c.n_large;
		double x[3];
		do
			for (int k = 0; k < 3; k++) x[k] = uniform(&state) * c.size;
		while (is_taken(&c, &l, x, large ? 2 : 1));
		for (int k = 0; k < 3; k++) c.x[k][i] = x[k];
		c.radius[i] = large ? 1 : sigma;
		if (!large) continue;
		int32_t at[3];
		for (int k = 0; k < 3; k++) at[k] = (int32_t)(x[k] / c.size * l.side);
		int32_t *head = &l.head[(at[2] * l.side + at[1]) * l.side + at[0]];
		l.next[i] = *head, *head = (int32_t)i;
	}
	free(l.head), free(l.next);
	return c;
}

static double now(void) {
	struct timespec t;
	clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t); /* others may be at work on the machine */
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

typedef struct timed {
	double seconds;
	uint64_t pairs;
} timed;

/* What the solver does between two copies of the grains' columns, which are not timed. */
static timed remake(const quern_neighbour_ops *ops, const cloud *c) {
	const double nothing[1] = { 0 };
	const uint32_t n = c->n;
	uint64_t *key = need(malloc((n + 1) * sizeof *key));
	int32_t *from = need(malloc((n + 1) * sizeof *from));
	uint32_t *block = need(malloc((n + 2) * sizeof *block));
	void *work = need(malloc(quern_sort_bytes(n) + 64));
	double *column = need(malloc(4 * (size_t)n * sizeof *column));
	quern_pair *out = need(malloc(((size_t)1 << 24) * sizeof *out));
	quern_neighbour_job job = {
		.n = n, .dim = 3, .largest = 1, .reach = REACH * 2 * c->small, .block = block, .radius = c->radius
	};
	for (int k = 0; k < 3; k++) job.position[k] = c->x[k], job.upper[k] = c->size, job.periodic[k] = true;
	double begin = now();
	const size_t bytes = ops->keys(nothing, &job, key);
	quern_sort_order(n, key, NULL, from, work);
	for (uint32_t i = 0; i < n; i++)
		if (!i || key[from[i]] >> 32 != key[from[i - 1]] >> 32) block[job.n_blocks++] = i;
	block[job.n_blocks] = n;
	timed t = { .seconds = now() - begin };
	for (uint32_t i = 0; i < n; i++) {
		for (uint32_t k = 0; k < 3; k++) column[k * (size_t)n + i] = c->x[k][from[i]];
		column[3 * (size_t)n + i] = c->radius[from[i]];
	}
	for (uint32_t k = 0; k < 3; k++) job.position[k] = column + k * (size_t)n;
	job.radius = column + 3 * (size_t)n;
	begin = now();
	job.memory = need(calloc(1, bytes + 64));
	if (ops->index) ops->index(nothing, &job);
	for (uint32_t b = 0; b < job.n_blocks; b++) {
		const uint32_t found = ops->pairs(nothing, &job, b, 1u << 24, out);
		for (uint32_t q = 0; q < found; q++) { /* a pair across blocks is found by both */
			const uint32_t k = (uint32_t)out[q].second;
			t.pairs += (k >= block[b] && k < block[b + 1]) ? 2 : 1;
		}
	}
	t.seconds += now() - begin;
	t.pairs /= 2;
	free(job.memory), free(key), free(from), free(block), free(work), free(column), free(out);
	return t;
}

int main(int argc, char **argv) {
	const char *const ids[] = { "neighbours.cells", "neighbours.hgrid" };
	if (argc < 4) return fprintf(stderr, "searches GRAINS ROUNDS SIGMA ...\n"), 2;
	const uint32_t n = (uint32_t)atoi(argv[1]);
	printf("sigma,grains,large,pairs,cells_ms,hgrid_ms\n");
	for (int a = 3; a < argc; a++) {
		const double sigma = atof(argv[a]);
		if (!(sigma > 0 && sigma <= 1))
			return fprintf(stderr, "searches: SIGMA is above 0 and at most 1\n"), 2;
		cloud c = scatter(n, sigma);
		timed least[2] = { { INFINITY, 0 }, { INFINITY, 0 } };
		for (int round = 0; round < 2 * atoi(argv[2]); round++) {
			const int k = (round + round / 2) % 2;
			const timed t = remake(alone_load(ids[k])->ops, &c);
			if (t.seconds < least[k].seconds) least[k] = t;
		}
		if (least[0].pairs != least[1].pairs) return fprintf(stderr, "searches: other pairs\n"), 1;
		printf("%g,%u,%u,%llu,%.4g,%.4g\n", sigma, n, c.n_large, (unsigned long long)least[0].pairs,
			1e3 * least[0].seconds, 1e3 * least[1].seconds);
		fflush(stdout);
		for (int k = 0; k < 3; k++) free(c.x[k]);
		free(c.radius);
	}
	return 0;
}
