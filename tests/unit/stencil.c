/* SPDX-License-Identifier: MIT */
/* Nodes that a particle does not reach may be left out: sums are those over all of them to the last bit. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <common/stencil.h>
#include <stdlib.h>
#include <string.h>

enum { KINDS = 8 }; /* two or three nodes along each axis */

static quern_real random_real(uint32_t *state) {
	*state = *state * 1664525u + 1013904223u;
	return (quern_real)(*state >> 8) * 0x1p-23 - 1;
}

/* Weights of any kind; where `third` has no bit the last ones along its axis are zero. `bare`: those others have a slope alone. */
static void fill(stencil *s, const uint32_t third[STENCIL], bool bare, uint32_t *state) {
	memset(s, 0, sizeof *s);
	for (uint32_t i = 0; i < STENCIL; i++) {
		for (uint32_t a = 0; a < 3; a++) {
			s->position[a][i] = 0.1 + 0.01 * random_real(state);
			for (uint32_t k = 0; k < 3; k++) {
				const bool none = k == 2 && !(third[i] >> a & 1);
				s->value[a][k][i] = none || (k == 2 && bare) ? 0 : random_real(state);
				s->slope[a][k][i] = none ? 0 : random_real(state);
			}
		}
		s->node[i] = (int32_t)(i % 4 + tile_span(3) * (i / 4 % 4 + tile_span(3) * (i / 16)));
	}
}

static void reach_is_found(void **unused) {
	static stencil s;
	uint32_t state = 1, third[STENCIL];
	(void)unused;
	for (uint32_t n = 1; n <= STENCIL; n++) {
		for (uint32_t i = 0; i < STENCIL; i++) third[i] = (uint32_t)(4 + 4 * random_real(&state)) % KINDS;
		fill(&s, third, n % 2, &state);
		stencil_find_reach(n, &s);
		for (uint32_t i = 0; i < n; i++) assert_int_equal(s.reach[i], third[i]);
	}
}

static sent some_sent(uint32_t *state) {
	sent p;
	quern_real lane[4][QUERN_LANES] = { { 0 } };
	for (uint32_t k = 0; k < 4; k++)
		for (uint32_t l = 0; l < (k ? QUERN_LANES : CARRIED); l++) lane[k][l] = random_real(state);
	p.base = parted(lane[0]);
	for (uint32_t a = 0; a < 3; a++) p.lean[a] = parted(lane[1 + a]);
	return p;
}

/* With `reach` as found and with all nodes, which may be what it wants. */
static void sums_are_whole(void **unused) {
	static stencil s, all;
	static quern_row tile[2][QUERN_TILE_MOST], out[2][4];
	uint32_t state = 7, third[STENCIL];
	(void)unused;
	for (uint32_t i = 0; i < STENCIL; i++) third[i] = i % KINDS;
	fill(&s, third, false, &state);
	stencil_find_reach(STENCIL, &s);
	all = s;
	for (uint32_t i = 0; i < STENCIL; i++) all.reach[i] = KINDS - 1;
	for (uint32_t i = 0; i < STENCIL; i++) {
		const sent p = some_sent(&state);
		stencil_scatter(&s, i, &p, SENDS_SLOPE | SENDS_ALONG, tile[0], 3, 0.004);
		stencil_scatter(&all, i, &p, SENDS_SLOPE | SENDS_ALONG, tile[1], 3, 0.004);
	}
	assert_memory_equal(tile[0], tile[1], sizeof tile[0]);
	for (uint32_t i = 0; i < STENCIL; i++) {
		stencil_gather(&s, i, tile[0], 3, true, out[0]);
		stencil_gather(&all, i, tile[0], 3, true, out[1]);
		assert_memory_equal(out[0], out[1], sizeof out[0]);
	}
}

/* A sum that the kernels do not share: node by node, lane by lane. */
static void sums_are_right(void **unused) {
	static stencil s;
	static quern_row tile[QUERN_TILE_MOST], out[4];
	static quern_real plain[4][QUERN_LANES];
	uint32_t state = 3, third[STENCIL];
	(void)unused;
	for (uint32_t i = 0; i < STENCIL; i++) third[i] = i % KINDS;
	fill(&s, third, false, &state);
	stencil_find_reach(STENCIL, &s);
	for (uint32_t k = 0; k < QUERN_TILE_MOST; k++)
		for (uint32_t l = 0; l < QUERN_LANES; l++) tile[k][l] = random_real(&state);
	for (uint32_t i = 0; i < STENCIL; i++) {
		memset(plain, 0, sizeof plain);
		for (uint32_t n = 0; n < 27; n++) {
			const uint32_t at[3] = { n % 3, n / 3 % 3, n / 9 }, span = tile_span(3);
			const quern_row *row = &tile[(uint32_t)s.node[i] + (at[2] * span + at[1]) * span + at[0]];
			for (uint32_t g = 0; g < 4; g++) {
				quern_real weight = 1;
				for (uint32_t a = 0; a < 3; a++)
					weight *= g == a + 1 ? s.slope[a][at[a]][i] : s.value[a][at[a]][i];
				for (uint32_t l = 0; l < (g ? CARRIED : QUERN_LANES); l++) plain[g][l] += weight * (*row)[l];
			}
		}
		stencil_gather(&s, i, tile, 3, true, out);
		for (uint32_t g = 0; g < 4; g++)
			for (uint32_t l = 0; l < (g ? CARRIED : QUERN_LANES); l++)
				assert_true(fabs(out[g][l] - plain[g][l]) < 1e-14);
	}
}

/* What one particle sends to one node, lane by lane. */
static quern_real sent_to(const stencil *s, uint32_t i, quern_real lane[4][QUERN_LANES], const uint32_t at[3],
	uint32_t dim, uint32_t l, quern_real cell) {
	quern_real even = 1, sum;
	for (uint32_t a = 0; a < dim; a++) even *= s->value[a][at[a]][i];
	sum = even * lane[0][l];
	for (uint32_t a = 0; a < dim; a++) {
		quern_real by = l < CARRIED ? at[a] * cell - s->position[a][i] : s->slope[a][at[a]][i];
		for (uint32_t b = 0; b < dim; b++)
			if (l < CARRIED || b != a) by *= s->value[b][at[b]][i];
		sum += by * lane[1 + a][l];
	}
	return sum;
}

static void what_is_sent_arrives(int what, const int dim) {
	static stencil s;
	static quern_row tile[QUERN_TILE_MOST];
	static quern_real plain[QUERN_TILE_MOST][QUERN_LANES];
	const quern_real cell = 0.004;
	uint32_t state = 11, third[STENCIL];
	for (uint32_t i = 0; i < STENCIL; i++) third[i] = dim == 3 ? i % KINDS : KINDS - 1;
	fill(&s, third, false, &state);
	stencil_find_reach(STENCIL, &s);
	memset(tile, 0, sizeof tile);
	memset(plain, 0, sizeof plain);
	for (uint32_t i = 0; i < STENCIL; i++) {
		quern_real lane[4][QUERN_LANES] = { { 0 } };
		sent p = { 0 };
		for (uint32_t k = 0; k < 4; k++)
			for (uint32_t l = 0; l < QUERN_LANES; l++)
				if (k == 0 ? l < CARRIED : what & (l < CARRIED ? SENDS_ALONG : SENDS_SLOPE))
					lane[k][l] = random_real(&state);
		p.base = parted(lane[0]);
		for (int a = 0; a < dim; a++) p.lean[a] = parted(lane[1 + a]);
		if (dim == 2) stencil_scatter(&s, i, &p, what, tile, 2, cell);
		else stencil_scatter(&s, i, &p, what, tile, 3, cell);
		for (uint32_t n = 0; n < (dim == 3 ? 27 : 9); n++) {
			const uint32_t at[3] = { n % 3, n / 3 % 3, n / 9 }, span = tile_span(dim);
			const uint32_t node = (uint32_t)s.node[i] + (at[2] * span + at[1]) * span + at[0];
			for (uint32_t l = 0; l < QUERN_LANES; l++)
				plain[node][l] += sent_to(&s, i, lane, at, (uint32_t)dim, l, cell);
		}
	}
	for (uint32_t k = 0; k < QUERN_TILE_MOST; k++)
		for (uint32_t l = 0; l < QUERN_LANES; l++) assert_true(fabs(tile[k][l] - plain[k][l]) < 1e-13);
}

static void all_that_is_sent_arrives(void **unused) {
	(void)unused;
	for (int dim = 2; dim <= 3; dim++)
		for (int what = SENDS_BASE; what <= (SENDS_ALONG | SENDS_SLOPE); what++)
			what_is_sent_arrives(what, dim);
}

/* Slopes along x that come by the same products as sums: neither differs in a bit from one by itself. */
static void doubled_rows_say_the_same(void **unused) {
	static stencil s;
	static quern_row tile[QUERN_TILE_MOST], out[4];
	uint32_t state = 11, third[STENCIL];
	(void)unused;
	for (uint32_t i = 0; i < STENCIL; i++) third[i] = i % KINDS;
	fill(&s, third, false, &state);
	for (uint32_t i = 0; i < STENCIL; i++) {
		quern_row sum, up;
		for (uint32_t k = 0; k < QUERN_TILE_MOST; k++)
			for (uint32_t l = 0; l < QUERN_LANES; l++) tile[k][l] = random_real(&state);
		stencil_gather(&s, i, tile, 2, true, out);
		stencil_double(tile, QUERN_TILE_MOST);
		stencil_gather_doubled(&s, i, tile, &sum, &up);
		for (int l = 0; l < ONCE_MORE; l++) assert_true(sum[l] == out[0][l]);
		for (int l = 0; l < 2; l++)
			assert_true(sum[ONCE_MORE + l] == out[1][l] && up[l] == out[2][l] && sum[l] != out[1][l]);
	}
}

int main(void) {
	/* where the code that is asked cannot run, `stencil` asks the same of what does instead: no case is left out there */
#if defined __AVX512F__
	if (!__builtin_cpu_supports("avx512vl")) return 77;
#elif defined __AVX2__
	if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return 77;
#endif
	const struct CMUnitTest tests[] = { cmocka_unit_test(reach_is_found), cmocka_unit_test(sums_are_whole),
		cmocka_unit_test(sums_are_right), cmocka_unit_test(all_that_is_sent_arrives),
		cmocka_unit_test(doubled_rows_say_the_same) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
