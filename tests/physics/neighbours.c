/* SPDX-License-Identifier: MIT */
/* Searches against the one that looks at every pair: the same pairs, and the same motion to the bit. */
#include <quern/neighbours.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "../../plugins/common/sort.h"
#include "harness.h"
#include "plugin_alone.h"
#include "table.h"
#include <stdlib.h>
#include <string.h>

/* ==== pairs ==== */

enum { GRAINS = 800, SEEDS = 50 };

typedef struct cloud {
	uint32_t dim;
	double x[3][GRAINS], radius[GRAINS], lower[3], upper[3], reach;
	bool periodic[3];
} cloud;

static double uniform(uint64_t *state) {
	uint64_t z = *state += 0x9e3779b97f4a7c15u; /* splitmix64 */
	z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
	z = (z ^ z >> 27) * 0x94d049bb133111ebu;
	return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

typedef enum { OPEN, WRAPPED, ONE_AXIS, NARROW, FLAT, BOXES } box;
static const char *const box_names[] = { "open", "periodic", "periodic along x", "periodic, narrow along x",
	"open, all on a line or a plane" };

/* How many times wider than the smallest the largest grain is; some sizes are rare. */
typedef enum { NEAR_EQUAL, UNEQUAL, HUNDREDFOLD, FEW_LARGE, FEW_SMALL, SIZES } sizes;
static const char *const size_names[] = { "radii 4.5 to 5", "radii 1 to 5", "radii 0.05 to 5",
	"radii 0.5, one in 100 is 5", "radii 5, one in 100 is 0.05" };

static double radius_of(sizes of, double t, double rare) {
	switch (of) {
	case NEAR_EQUAL: return 4.5 + 0.5 * t;
	case UNEQUAL: return 1 + 4 * t;
	case HUNDREDFOLD: return 0.05 * pow(100, t);
	case FEW_LARGE: return rare < 0.01 ? 5 : 0.5;
	default: return rare < 0.01 ? 0.05 : 5;
	}
}

/* Grains of radius 5 at most in about the room that grains of 1 to 5 need; some sit on the corners and faces of the domain, some
 * on those of cells as wide as two of the largest or two of another grain. */
static void scatter(cloud *c, uint32_t dim, box kind, sizes of, uint64_t seed) {
	const double size = dim == 2 ? 285 : 74;
	uint64_t state = seed * 977 + dim * 31 + (uint64_t)kind + 7919 * (uint64_t)of;
	*c = (cloud) { .dim = dim, .reach = 0.4 };
	for (uint32_t k = 0; k < dim; k++) {
		c->lower[k] = -3.25;
		c->upper[k] = c->lower[k] + size;
		c->periodic[k] = kind == WRAPPED || kind == NARROW || (kind == ONE_AXIS && k == 0);
	}
	/* as narrow as the solver allows, and up to where a third cell fits in */
	if (kind == NARROW) c->upper[0] = c->lower[0] + 20.8 + uniform(&state) * 12;
	for (int i = 0; i < GRAINS; i++) {
		const double t = uniform(&state);
		c->radius[i] = i ? radius_of(of, t, uniform(&state)) : 5;
		for (uint32_t k = 0; k < dim; k++) {
			const double at = uniform(&state), length = c->upper[k] - c->lower[k];
			const double width = 2 * c->radius[i % 2 ? i / 2 : 0] + c->reach;
			const double cell = c->periodic[k] ? length / floor(length / width) : width;
			c->x[k][i] = c->lower[k] + (at < 0.01 ? 0 : at) * length;
			if (at > 0.8) c->x[k][i] = c->lower[k] + floor(at * (length / cell)) * cell;
		}
		if (kind == FLAT) c->x[1][i] = 7;
	}
}

static int by_value(const void *pa, const void *pb) {
	const uint64_t a = *(const uint64_t *)pa, b = *(const uint64_t *)pb;
	return a < b ? -1 : a > b;
}

/* All pairs as (lower << 32 | higher) in the cloud's own numbers, sorted; called as the grain solver does. A pair across
 * two blocks must come from both of them, one inside a block once; then it stands here once. */
static uint64_t *search(const char *id, const cloud *c, uint32_t *n_pairs) {
	const quern_neighbour_ops *ops = alone_load(id)->ops;
	const double nothing[1] = { 0 };
	static double x[3][GRAINS], radius[GRAINS];
	static uint64_t key[GRAINS], work[3 * GRAINS + 8];
	static int32_t from[GRAINS];
	static uint32_t block[GRAINS + 1], block_of[GRAINS];
	quern_neighbour_job job = { .n = GRAINS, .dim = c->dim, .largest = 5, .reach = c->reach, .block = block };
	for (uint32_t k = 0; k < 3; k++) {
		job.position[k] = k < c->dim ? c->x[k] : NULL;
		job.lower[k] = c->lower[k], job.upper[k] = c->upper[k], job.periodic[k] = c->periodic[k];
	}
	job.radius = c->radius;
	const size_t bytes = ops->keys(nothing, &job, key);
	quern_sort_order(GRAINS, key, NULL, from, work);
	for (uint32_t i = 0; i < GRAINS; i++) {
		for (uint32_t k = 0; k < c->dim; k++) x[k][i] = c->x[k][from[i]];
		radius[i] = c->radius[from[i]];
		if (!i || key[from[i]] >> 32 != key[from[i - 1]] >> 32) block[job.n_blocks++] = i;
		block_of[i] = job.n_blocks - 1;
	}
	block[job.n_blocks] = GRAINS;
	for (uint32_t k = 0; k < c->dim; k++) job.position[k] = x[k];
	job.radius = radius;
	job.memory = calloc(1, bytes + 64);
	if (ops->index) ops->index(nothing, &job);
	uint64_t *out = NULL;
	uint32_t n = 0;
	for (uint32_t b = 0; b < job.n_blocks; b++) {
		const uint32_t found = ops->pairs(nothing, &job, b, 0, NULL);
		quern_pair *pair = malloc((found + 1) * sizeof *pair);
		out = realloc(out, (n + found + 1) * sizeof *out);
		assert_int_equal(ops->pairs(nothing, &job, b, found, pair), found);
		for (uint32_t q = 0; q < found; q++) {
			assert_int_equal(block_of[pair[q].first], b);
			const bool across = block_of[pair[q].second] != b;
			const uint64_t i = (uint64_t)from[pair[q].first], j = (uint64_t)from[pair[q].second];
			out[n++] = (i < j ? i << 32 | j : j << 32 | i) << 1 | across;
		}
		free(pair);
	}
	free(job.memory);
	qsort(out, n, sizeof *out, by_value);
	uint32_t kept = 0;
	for (uint32_t q = 0; q < n; q++) {
		const bool across = out[q] & 1;
		if (across) assert_true(q + 1 < n && out[q + 1] == out[q]);
		out[kept] = out[q] >> 1;
		assert_true(!kept || out[kept] != out[kept - 1]);
		kept++;
		q += across;
	}
	*n_pairs = kept;
	return out;
}

/* Pairs that the search finds, pairs that there are, and seeds whose pairs are others. */
typedef struct tally {
	uint64_t found, all, different;
} tally;

static const char *const searches[] = { "neighbours.cells", "neighbours.hgrid" };
enum { SEARCHES = sizeof searches / sizeof *searches };

static void count_pairs(uint32_t dim, box kind, sizes of, tally count[SEARCHES]) {
	static cloud c;
	for (uint64_t seed = 1; seed <= SEEDS; seed++) {
		uint32_t n, m;
		scatter(&c, dim, kind, of, seed);
		uint64_t *all = search("neighbours.all_pairs", &c, &m);
		for (int k = 0; k < SEARCHES; k++) {
			uint64_t *found = search(searches[k], &c, &n);
			count[k].found += n, count[k].all += m;
			count[k].different += n != m || memcmp(found, all, n * sizeof *found) != 0;
			free(found);
		}
		free(all);
	}
}

static void same_pairs(void **unused) {
	(void)unused;
	bool good = true;
	char what[80];
	snprintf(what, sizeof what, "%d grains, %d seeds: pairs", GRAINS, SEEDS);
	table_head(what);
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (sizes of = NEAR_EQUAL; of < SIZES; of++)
			for (box kind = OPEN; kind < BOXES; kind++) {
				tally count[SEARCHES] = { { 0 } };
				count_pairs(dim, kind, of, count);
				printf("  %uD, %s, %s\n", dim, size_names[of], box_names[kind]);
				for (int k = 0; k < SEARCHES; k++) {
					good &= table_row(searches[k], (double)count[k].found, (double)count[k].all, 0);
					good &= table_row("  seeds with another set of pairs", (double)count[k].different, 0, 0);
				}
			}
	assert_true(good);
}

/* ==== motion ==== */

static quern_run *collapse(const char *search, uint32_t dim, bool periodic) {
	const bool deep = dim == 3;
	return harness_open(1,
		"{quern: 1, dimension: %u, gravity: [3, -9.81%s], domain: {lower: [0, 0%s], upper: [%s], periodic: "
		"[%s]},\n"
		"time: {end: 1}, output: {every: 0.01},\n"
		"bodies: [{plane: {point: [0, 0%s], normal: [0, 1%s]}}%s],\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01, spread: 0.4, law: uniform}},\n"
		"  overlap: {most: 0}, contact: {linear: {stiffness: 1e5, friction: 0.5}}, neighbours: %s,\n"
		"  fill: [{region: {box: {lower: [0.02, 0.02%s], upper: [%s]}}, velocity: [0.3, -1%s]}]}}\n",
		dim, deep ? ", 1" : "", deep ? ", 0" : "", deep ? "0.2, 1, 0.2" : "0.4, 1",
		periodic ? (deep ? "true, false, true" : "true, false")
				 : (deep ? "false, false, false" : "false, false"),
		deep ? ", 0" : "", deep ? ", 0" : "",
		periodic ? ""
		: deep   ? ", {plane: {point: [0.2, 0, 0], normal: [-1, 0, 0]}}, {plane: {point: [0, 0, 0.2], "
				   "normal: [0, 0, -1]}}, {plane: {point: [0, 0, 0], normal: [1, 0, 0]}}, "
				   "{plane: {point: [0, 0, 0], normal: [0, 0, 1]}}"
				 : ", {plane: {point: [0.4, 0], normal: [-1, 0]}}, {plane: {point: [0, 0], normal: [1, 0]}}",
		search, deep ? ", 0.02" : "", deep ? "0.18, 0.16, 0.18" : "0.38, 0.4", deep ? ", 0" : "");
}

/* Components of a field that differ in any bit, grain by grain. */
static uint32_t differences(quern_run *a, quern_run *b, const char *field, uint32_t components) {
	const uint32_t n = harness_count(a, "grain");
	assert_int_equal(n, harness_count(b, "grain"));
	const quern_column xa = harness_field(a, field), xb = harness_field(b, field);
	const int64_t *ia = harness_field(a, "grain.id").id, *ib = harness_field(b, "grain.id").id;
	uint32_t *at = calloc(n, sizeof *at), different = 0;
	for (uint32_t i = 0; i < n; i++) at[ib[i]] = i;
	for (uint32_t i = 0; i < n; i++)
		for (uint32_t k = 0; k < components; k++)
			different += memcmp(&xa.real[k][i], &xb.real[k][at[ia[i]]], sizeof(double)) != 0;
	free(at);
	return different;
}

static bool same_motion_by(const char *search, uint32_t dim, bool periodic) {
	char what[80];
	quern_run *one = collapse(search, dim, periodic), *all = collapse("all_pairs", dim, periodic);
	harness_steps(one, 1000);
	harness_steps(all, 1000);
	snprintf(what, sizeof what, "%s: %uD, %s, %u grains, %u contacts", search, dim,
		periodic ? "periodic" : "walls", harness_count(one, "grain"), harness_count(all, "contact"));
	uint32_t n = differences(one, all, "grain.position", dim);
	n += differences(one, all, "grain.velocity", dim);
	n += differences(one, all, "grain.spin", dim == 3 ? 3 : 1);
	harness_close(one);
	harness_close(all);
	return table_row(what, n, 0, 0);
}

static void same_motion(void **unused) {
	(void)unused;
	bool good = true;
	table_head("a fall onto a floor, 1000 steps: numbers that differ");
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int periodic = 0; periodic <= 1; periodic++) {
			good &= same_motion_by("cells", dim, periodic);
			good &= same_motion_by("hgrid", dim, periodic);
		}
	assert_true(good);
}

/* A grain less than half an ulp below a periodic face is brought back to the lower face, not to the upper one. */
static void seams_keep_grains_inside(void **unused) {
	(void)unused;
	quern_run *run = harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [0.8, 0.8], periodic: "
		"[true, "
		"true]},\n"
		"time: {end: 1, step: 1e-4}, output: {every: 0.1},\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: {linear: {stiffness: 1}},\n"
		"  place: [{position: [-1e-30, 0.1]}, {position: [0.2, -1e-18]}, {position: [0.8, 0.4]}]}}\n");
	harness_steps(run, 1);
	const quern_column now = harness_field(run, "grain.position");
	for (uint32_t i = 0; i < harness_count(run, "grain"); i++)
		for (int k = 0; k < 2; k++) assert_true(now.real[k][i] >= 0 && now.real[k][i] < 0.8);
	harness_close(run);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(same_pairs), cmocka_unit_test(same_motion),
		cmocka_unit_test(seams_keep_grains_inside) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
