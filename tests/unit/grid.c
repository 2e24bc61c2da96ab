/* SPDX-License-Identifier: MIT */
/* The sparse grid: which blocks exist, what tiles reach, and colours that never meet. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <grid.h>
#include <stdlib.h>
#include <string.h>

static const double lower[3] = { 0, 0, 0 };

static void cover(quern_grid *g, uint32_t n, const int32_t (*block)[3]) {
	quern_store empty = { .n_sets = 0 };
	assert_int_equal(quern_grid_cover(g, &empty, n, block), QUERN_OK);
}

static void one_block(void **state) {
	static const double upper[3] = { 64, 64, 0 };
	static const bool around[3] = { false };
	static const int32_t corner[1][3] = { { 0, 0, 0 } }, middle[1][3] = { { 3, 3, 0 } };
	quern_grid g;
	(void)state;
	assert_int_equal(quern_grid_init(&g, 2, 1, lower, upper, around), QUERN_OK);
	assert_int_equal(g.view.edge, 8);
	assert_int_equal(g.view.cells[1], 64);
	cover(&g, 1, corner);
	assert_int_equal(g.view.n_blocks, 4); /* nothing lies beyond the domain's faces */
	cover(&g, 1, middle);
	assert_int_equal(g.view.n_blocks, 9);
	const int32_t there[3] = { 3, 3, 0 }, far[3] = { 0, 0, 0 };
	const int32_t b = quern_grid_find(&g, there);
	assert_true(b >= 0);
	assert_int_equal(g.view.asked[b], 1);
	assert_int_equal(quern_grid_find(&g, far), -1);
	uint32_t asked = 0;
	for (uint32_t i = 0; i < g.view.n_blocks; i++) asked += g.view.asked[i];
	assert_int_equal(asked, 1);
	quern_grid_finish(&g);
}

/* The same blocks in any order and number leave the grid where it is; others, or a grid that a file has given, make it anew. */
static void again(void **state) {
	static const double upper[3] = { 64, 64, 0 };
	static const bool around[3] = { false };
	static const int32_t two[][3] = { { 3, 3, 0 }, { 6, 3, 0 } },
						 turned[][3] = { { 6, 3, 0 }, { 3, 3, 0 }, { 6, 3, 0 } },
						 beyond[][3] = { { 3, 3, 0 }, { 6, 3, 0 }, { 8, 3, 0 } };
	quern_grid g;
	(void)state;
	assert_int_equal(quern_grid_init(&g, 2, 1, lower, upper, around), QUERN_OK);
	cover(&g, 2, two);
	assert_int_equal(g.view.n_blocks, 18);
	const int32_t *tile = g.tile;
	cover(&g, 3, turned);
	assert_ptr_equal(g.tile, tile);
	cover(&g, 1, two);
	assert_int_equal(g.view.n_blocks, 9);
	cover(&g, 2, two);
	assert_int_equal(g.view.n_blocks, 18);
	cover(&g, 3, beyond); /* what lies outside is ignored, but for its neighbours */
	cover(&g, 2, two);
	assert_int_equal(g.view.n_blocks, 18);
	const uint8_t asked[] = { 1, 1 };
	assert_int_equal(quern_grid_restore(&g, 2, two, asked), QUERN_OK); /* without neighbours */
	cover(&g, 2, two);
	assert_int_equal(g.view.n_blocks, 18);
	quern_grid_finish(&g);
}

/* Tile node k of the asked block is the node that its coordinates say. */
static void tiles(void **state) {
	static const double upper[3] = { 16, 16, 16 };
	static const int32_t block[1][3] = { { 1, 2, 1 } };
	(void)state;
	for (int wrapped = 0; wrapped < 2; wrapped++) {
		const bool around[3] = { wrapped, wrapped, wrapped };
		quern_grid g;
		assert_int_equal(quern_grid_init(&g, 3, 1, lower, upper, around), QUERN_OK);
		cover(&g, 1, block);
		const quern_grid_view *v = &g.view;
		const int32_t b = quern_grid_find(&g, block[0]);
		for (uint32_t t = 0; t < v->tile_size; t++) {
			const uint32_t place[3] = { t % v->span, t / v->span % v->span, t / v->span / v->span };
			const int32_t entry = v->tile[(size_t)b * v->tile_size + t];
			assert_true(entry >= 0);
			for (int a = 0; a < 3; a++) {
				const int32_t wanted = (block[0][a] * 4 - 1 + (int32_t)place[a] + 16) % 16;
				const uint32_t inside[3] = { (uint32_t)entry % 64 % 4, (uint32_t)entry % 64 / 4 % 4,
					(uint32_t)entry % 64 / 16 };
				assert_int_equal(v->at[entry / 64][a] * 4 + (int32_t)inside[a], wanted);
			}
		}
		quern_grid_finish(&g);
	}
}

/* No two blocks of one colour add to one node; every block has one colour. */
static void colours(void **state) {
	static const double sizes[][3] = { { 64, 64, 0 }, { 40, 24, 0 }, { 24, 13, 0 }, { 12, 12, 12 },
		{ 20, 9, 13 } };
	(void)state;
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
		for (int wrapped = 0; wrapped < 2; wrapped++) {
			const uint32_t dim = sizes[i][2] > 0 ? 3 : 2, edge = dim == 2 ? 8 : 4;
			const bool around[3] = { wrapped, wrapped, wrapped };
			int32_t all[1000][3];
			uint32_t n = 0;
			quern_grid g;
			assert_int_equal(quern_grid_init(&g, dim, 1, lower, sizes[i], around), QUERN_OK);
			for (int32_t z = 0; z <= (int32_t)sizes[i][2] / (int32_t)edge; z++)
				for (int32_t y = 0; y <= (int32_t)sizes[i][1] / (int32_t)edge; y++)
					for (int32_t x = 0; x <= (int32_t)sizes[i][0] / (int32_t)edge; x++, n++)
						all[n][0] = x, all[n][1] = y, all[n][2] = z;
			cover(&g, n, (const int32_t(*)[3])all);
			const quern_grid_view *v = &g.view;
			int32_t *owner = malloc((size_t)v->n_blocks * 64 * sizeof *owner);
			assert_non_null(owner);
			assert_int_equal(v->colour[v->n_colours], v->n_blocks);
			for (uint32_t c = 0; c < v->n_colours; c++) {
				memset(owner, 0xff, (size_t)v->n_blocks * 64 * sizeof *owner);
				for (uint32_t k = v->colour[c]; k < v->colour[c + 1]; k++)
					for (uint32_t t = 0; t < v->tile_size; t++) {
						const int32_t entry = v->tile[(size_t)v->by_colour[k] * v->tile_size + t];
						if (entry < 0) continue;
						assert_true(owner[entry] < 0 || owner[entry] == (int32_t)v->by_colour[k]);
						owner[entry] = (int32_t)v->by_colour[k];
					}
			}
			free(owner);
			quern_grid_finish(&g);
		}
}

static void too_many_cells(void **state) {
	static const struct {
		uint32_t dim;
		double upper[3];
		quern_status status;
	} domains[] = { { 2, { 1e12, 1, 0 }, QUERN_E_PARAM }, { 2, { 4194305, 1, 0 }, QUERN_E_PARAM },
		{ 2, { 4194304, 1, 0 }, QUERN_OK }, { 2, { 65536, 32768, 0 }, QUERN_E_PARAM },
		{ 3, { 2000, 2000, 2000 }, QUERN_E_PARAM }, { 3, { 1200, 1200, 1200 }, QUERN_OK } };
	static const bool around[3] = { false };
	(void)state;
	for (size_t i = 0; i < sizeof domains / sizeof *domains; i++) {
		quern_grid g;
		assert_int_equal(
			quern_grid_init(&g, domains[i].dim, 1, lower, domains[i].upper, around), domains[i].status);
		quern_grid_finish(&g);
	}
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(one_block), cmocka_unit_test(again),
		cmocka_unit_test(tiles), cmocka_unit_test(colours), cmocka_unit_test(too_many_cells) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
