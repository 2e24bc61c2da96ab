/* SPDX-License-Identifier: MIT */
#include "grid.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CELLS = 64 }; /* of a block, in both dimensions */

static uint32_t hash(const int32_t at[3]) {
	return ((uint32_t)at[0] * 73856093u) ^ ((uint32_t)at[1] * 19349663u) ^ ((uint32_t)at[2] * 83492791u);
}

int32_t quern_grid_find(const quern_grid *g, const int32_t at[3]) {
	if (!g->n_slots) return -1;
	for (uint32_t h = hash(at);; h++) {
		const int32_t b = g->slot[h & (g->n_slots - 1)];
		if (b < 0 || !memcmp(g->at[b], at, sizeof *g->at)) return b;
	}
}

static int32_t wrap(int32_t node, int32_t cells) {
	node %= cells;
	return node < 0 ? node + cells : node;
}

static bool tiles_meet(const quern_grid *g, int axis, int32_t c, int32_t d) {
	const int32_t edge = (int32_t)g->view.edge, span = (int32_t)g->view.span, cells = g->view.cells[axis];
	for (int32_t i = 0; i < span; i++)
		for (int32_t k = 0; k < span; k++)
			if (wrap(edge * c - 1 + i, cells) == wrap(edge * d - 1 + k, cells)) return true;
	return false;
}

/* Along a periodic axis parity fails at the seam unless the blocks come out even: colour greedily there. */
static quern_status colour_axis(quern_grid *g, int axis) {
	const int32_t n = g->blocks[axis];
	if (!g->view.periodic[axis] || (n % 2 == 0 && g->view.cells[axis] % (int32_t)g->view.edge == 0 && n > 2))
		return QUERN_OK;
	uint32_t *colour = calloc((size_t)n, sizeof(uint32_t));
	if (!colour) return QUERN_E_MEMORY;
	for (int32_t c = 0; c < n; c++) {
		uint32_t used = 0;
		for (int32_t d = 0; d < c; d++) /* only close ones can meet, counted through the seam */
			if ((c - d <= 3 || d + n - c <= 3) && tiles_meet(g, axis, c, d)) used |= 1u << colour[d];
		while (used & 1u << colour[c]) colour[c]++;
	}
	g->axis_colour[axis] = colour;
	return QUERN_OK;
}

quern_status quern_grid_init(quern_grid *g, uint32_t dim, double cell, const double lower[3],
	const double upper[3], const bool periodic[3]) {
	*g = (quern_grid) { 0 };
	quern_grid_view *v = &g->view;
	v->cell = cell;
	v->dim = dim;
	v->edge = dim == 2 ? 8 : 4;
	v->span = v->edge + 4;
	v->tile_size = dim == 2 ? v->span * v->span : v->span * v->span * v->span;
	for (uint32_t k = 0; k < 3; k++) {
		v->lower[k] = k < dim ? lower[k] : 0;
		v->cells[k] = 1;
		g->blocks[k] = 1;
		if (k >= dim) continue;
		const double cells = (upper[k] - lower[k]) / cell;
		if (!(cells <= 0x1p22)) return QUERN_E_PARAM;
		v->cells[k] = (int32_t)lround(cells);
		if (v->cells[k] < 1) v->cells[k] = 1;
		v->periodic[k] = periodic[k];
		const int32_t nodes = v->cells[k] + !periodic[k];
		g->blocks[k] = (nodes + (int32_t)v->edge - 1) / (int32_t)v->edge;
		const quern_status status = colour_axis(g, (int)k);
		if (status != QUERN_OK) return status;
	}
	return (double)v->cells[0] * v->cells[1] * v->cells[2] < 0x1p31 ? QUERN_OK : QUERN_E_PARAM;
}

static void clear(quern_grid *g) {
	free(g->at);
	free(g->asked);
	free(g->tile);
	free(g->colour);
	free(g->by_colour);
	free(g->by_place);
	free(g->slot);
	g->at = NULL;
	g->asked = NULL;
	g->tile = NULL;
	g->colour = g->by_colour = g->by_place = NULL;
	g->slot = NULL;
	g->n_slots = 0;
	g->covers = false;
}

void quern_grid_finish(quern_grid *g) {
	if (!g) return;
	clear(g);
	for (int k = 0; k < 3; k++) free(g->axis_colour[k]);
	*g = (quern_grid) { 0 };
}

static int by_place(const void *pa, const void *pb) {
	const int32_t *a = pa, *b = pb;
	for (int k = 2; k >= 0; k--)
		if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
	return 0;
}

/* Blocks in the order of their places; none where that is their own. */
static quern_status order_blocks(quern_grid *g, uint32_t n) {
	bool ordered = true;
	for (uint32_t b = 1; b < n && ordered; b++) ordered = by_place(g->at[b - 1], g->at[b]) < 0;
	if (ordered) return QUERN_OK;
	int32_t(*block)[4] = malloc((size_t)n * sizeof *block);
	g->by_place = malloc((size_t)n * sizeof(uint32_t));
	if (!block || !g->by_place) return free(block), QUERN_E_MEMORY;
	for (uint32_t b = 0; b < n; b++) {
		memcpy(block[b], g->at[b], sizeof *g->at);
		block[b][3] = (int32_t)b;
	}
	qsort(block, n, sizeof *block, by_place);
	for (uint32_t q = 0; q < n; q++) g->by_place[q] = (uint32_t)block[q][3];
	free(block);
	return QUERN_OK;
}

#ifdef QUERN_PERMUTED_BLOCKS
static int by_hash(const void *pa, const void *pb) {
	const uint32_t a = hash(pa), b = hash(pb);
	return a != b ? (a < b ? -1 : 1) : by_place(pa, pb);
}
#endif

static quern_status index_blocks(quern_grid *g, uint32_t n) {
	uint32_t slots = 64;
	while (slots < 2 * n) slots *= 2;
	g->slot = malloc(slots * sizeof(int32_t));
	if (!g->slot) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < slots; i++) g->slot[i] = -1;
	g->n_slots = slots;
	for (uint32_t b = 0; b < n; b++) {
		uint32_t h = hash(g->at[b]);
		while (g->slot[h & (slots - 1)] >= 0) h++;
		g->slot[h & (slots - 1)] = (int32_t)b;
	}
	return QUERN_OK;
}

/* One axis of a tile: the blocks it reaches (three, or four where the last block of a periodic axis is thin), and for
 * each of its nodes which of them, and where in it. */
typedef struct {
	int32_t block[4];
	int n_blocks;
	int rank[16];
	int32_t place[16];
} tile_axis;

static tile_axis axis_of(const quern_grid *g, int axis, int32_t c) {
	const quern_grid_view *v = &g->view;
	const int32_t edge = (int32_t)v->edge;
	tile_axis a = { .n_blocks = 0 };
	if ((uint32_t)axis >= v->dim) {
		a.n_blocks = 1;
		return a;
	}
	for (uint32_t i = 0; i < v->span; i++) {
		int32_t node = edge * c - 1 + (int32_t)i;
		a.rank[i] = -1;
		if (v->periodic[axis]) node = wrap(node, v->cells[axis]);
		else if (node < 0 || node > v->cells[axis]) continue;
		const int32_t block = node / edge;
		int r = 0;
		while (r < a.n_blocks && a.block[r] != block) r++;
		if (r == a.n_blocks) a.block[a.n_blocks++] = block;
		a.rank[i] = r;
		a.place[i] = node % edge;
	}
	return a;
}

static void fill_tile(const quern_grid *g, uint32_t b, int32_t *tile) {
	const quern_grid_view *v = &g->view;
	const int32_t edge = (int32_t)v->edge;
	const tile_axis x = axis_of(g, 0, g->at[b][0]), y = axis_of(g, 1, g->at[b][1]),
					z = axis_of(g, 2, g->at[b][2]);
	int32_t found[4][4][4];
	for (int k = 0; k < z.n_blocks; k++)
		for (int j = 0; j < y.n_blocks; j++)
			for (int i = 0; i < x.n_blocks; i++)
				found[k][j][i] = quern_grid_find(g, (const int32_t[]) { x.block[i], y.block[j], z.block[k] });
	const uint32_t depth = v->dim == 3 ? v->span : 1;
	for (uint32_t k = 0; k < depth; k++)
		for (uint32_t j = 0; j < v->span; j++)
			for (uint32_t i = 0; i < v->span; i++, tile++) {
				*tile = -1;
				if (x.rank[i] < 0 || y.rank[j] < 0 || z.rank[k] < 0) continue;
				const int32_t block = found[z.rank[k]][y.rank[j]][x.rank[i]];
				if (block < 0) continue;
				*tile = block * CELLS + (z.place[k] * edge + y.place[j]) * edge + x.place[i];
			}
}

static uint32_t colour_of(const quern_grid *g, uint32_t b) {
	uint32_t colour = 0;
	for (uint32_t k = 0; k < g->view.dim; k++) {
		const int32_t c = g->at[b][k];
		colour = colour * 4 + (g->axis_colour[k] ? g->axis_colour[k][c] : (uint32_t)c & 1u);
	}
	return colour;
}

/* Blocks sorted by colour, and by place within one: the order in which a node is added to. */
static quern_status colour_blocks(quern_grid *g, uint32_t n) {
	uint32_t count[64] = { 0 }, name[64], colours = 0;
	for (uint32_t b = 0; b < n; b++) count[colour_of(g, b)]++;
	g->colour = malloc(65 * sizeof(uint32_t));
	g->by_colour = malloc(((size_t)n + 1) * sizeof(uint32_t));
	if (!g->colour || !g->by_colour) return QUERN_E_MEMORY;
	uint32_t sum = 0, next[64];
	for (uint32_t c = 0; c < 64; c++)
		if (count[c]) {
			name[c] = colours;
			next[colours] = g->colour[colours] = sum;
			colours++;
			sum += count[c];
		}
	g->colour[colours] = sum;
	for (uint32_t b = 0; b < n; b++) g->by_colour[next[name[colour_of(g, b)]]++] = b;
	g->view.n_colours = colours;
	return QUERN_OK;
}

quern_status quern_grid_restore(quern_grid *g, uint32_t n, const int32_t (*block)[3], const uint8_t *asked) {
	quern_grid_view *v = &g->view;
	clear(g);
	g->at = malloc(((size_t)n + 1) * sizeof *g->at);
	g->tile = malloc(((size_t)n * v->tile_size + 1) * sizeof(int32_t));
	g->asked = calloc((size_t)n + 1, 1);
	if (!g->at || !g->tile || !g->asked) return QUERN_E_MEMORY;
	if (n) memcpy(g->at, block, n * sizeof *g->at);
	if (n && asked) memcpy(g->asked, asked, n);
	quern_status status = order_blocks(g, n);
	if (status == QUERN_OK) status = index_blocks(g, n);
	if (status == QUERN_OK) status = colour_blocks(g, n);
	if (status != QUERN_OK) return status;
	for (uint32_t b = 0; b < n; b++) fill_tile(g, b, g->tile + (size_t)b * v->tile_size);
	v->n_blocks = n;
	v->at = (const int32_t(*)[3])g->at;
	v->asked = g->asked;
	v->tile = g->tile;
	v->colour = g->colour;
	v->by_colour = g->by_colour;
	v->by_place = g->by_place;
	return QUERN_OK;
}

/* Every wanted block with all that its tile reaches, sorted, once each. */
static int32_t (*dilate(const quern_grid *g, uint32_t n, const int32_t (*block)[3], uint32_t *out_n))[3] {
	const uint32_t each = g->view.dim == 3 ? 64 : 16;
	int32_t(*all)[3] = malloc(((size_t)n * each + 1) * sizeof *all);
	uint32_t m = 0, kept = 0;
	if (!all) return NULL;
	for (uint32_t b = 0; b < n; b++) {
		const tile_axis x = axis_of(g, 0, block[b][0]), y = axis_of(g, 1, block[b][1]),
						z = axis_of(g, 2, block[b][2]);
		for (int k = 0; k < z.n_blocks; k++)
			for (int j = 0; j < y.n_blocks; j++)
				for (int i = 0; i < x.n_blocks; i++, m++)
					all[m][0] = x.block[i], all[m][1] = y.block[j], all[m][2] = z.block[k];
	}
	qsort(all, m, sizeof *all, by_place);
	for (uint32_t i = 0; i < m; i++)
		if (!kept || by_place(all[kept - 1], all[i])) memmove(all[kept++], all[i], sizeof *all);
#ifdef QUERN_PERMUTED_BLOCKS
	qsort(all, kept, sizeof *all, by_hash);
#endif
	*out_n = kept;
	return all;
}

quern_status quern_grid_cut(const quern_grid *g, quern_store *store, int set) {
	uint32_t *block = malloc(((size_t)g->view.n_blocks + 1) * sizeof(uint32_t));
	if (!block) return QUERN_E_MEMORY;
	for (uint32_t b = 0; b <= g->view.n_blocks; b++) block[b] = b * CELLS;
	const quern_status status = quern_store_partition(store, set, g->view.n_blocks, block);
	free(block);
	return status == QUERN_OK ? quern_store_arrange(store, set, g->by_place) : status;
}

static quern_status carry_cells(const quern_grid *g, const quern_grid *old, quern_store *store, int set) {
	const uint32_t n = g->view.n_blocks * CELLS;
	int32_t *from = malloc((size_t)n * sizeof(int32_t) + 4);
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t b = 0; b < g->view.n_blocks; b++) {
		const int32_t was = quern_grid_find(old, g->at[b]);
		for (int32_t k = 0; k < CELLS; k++) from[b * CELLS + (uint32_t)k] = was < 0 ? -1 : was * CELLS + k;
	}
	const quern_status status = quern_store_remap(store, set, n, from, 0, NULL);
	free(from);
	return status;
}

/* Marks the blocks that were asked for among those that came of it. */
static void mark_asked(quern_grid *g, uint32_t n, const int32_t (*block)[3]) {
	memset(g->asked, 0, g->view.n_blocks);
	g->covers = true;
	for (uint32_t i = 0; i < n; i++) {
		const int32_t b = quern_grid_find(g, block[i]);
		if (b >= 0) g->asked[b] = 1;
		else g->covers = false;
	}
}

/* Just these blocks were asked for the last time, too: mostly so. */
static bool are_asked(const quern_grid *g, uint32_t n, const int32_t (*block)[3]) {
	const uint32_t n_blocks = g->view.n_blocks;
	uint8_t *left = g->covers ? malloc((size_t)n_blocks + 1) : NULL;
	if (!left) return false;
	memcpy(left, g->asked, n_blocks);
	bool same = true;
	for (uint32_t i = 0; i < n && same; i++) {
		const int32_t b = quern_grid_find(g, block[i]);
		same = b >= 0 && g->asked[b];
		if (same) left[b] = 0;
	}
	for (uint32_t b = 0; b < n_blocks && same; b++) same = !left[b];
	free(left);
	return same;
}

quern_status quern_grid_cover(quern_grid *g, quern_store *store, uint32_t n, const int32_t (*block)[3]) {
	uint32_t m = 0;
	if (are_asked(g, n, block)) return QUERN_OK;
	int32_t(*wanted)[3] = dilate(g, n, block, &m);
	if (!wanted) return QUERN_E_MEMORY;
	if (m == g->view.n_blocks && g->at && !memcmp(wanted, g->at, m * sizeof *wanted)) {
		mark_asked(g, n, block);
		free(wanted);
		return QUERN_OK;
	}
	quern_grid old = { .at = g->at, .slot = g->slot, .n_slots = g->n_slots };
	g->at = NULL;
	g->slot = NULL;
	quern_status status = quern_grid_restore(g, m, (const int32_t(*)[3])wanted, NULL);
	if (status == QUERN_OK) mark_asked(g, n, block);
	for (size_t s = 0; s < store->n_sets && status == QUERN_OK; s++) {
		if (!store->sets[s].grid) continue;
		status = store->sets[s].rows ? quern_store_rows(store, (int)s, m * CELLS)
									 : carry_cells(g, &old, store, (int)s);
		if (status == QUERN_OK) status = quern_grid_cut(g, store, (int)s);
	}
	free(old.at);
	free(old.slot);
	free(wanted);
	return status;
}
