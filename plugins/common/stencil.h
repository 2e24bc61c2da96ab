/* SPDX-License-Identifier: MIT */
/* stencil - particles of one grid block and the nodes they reach, in the block's tile; for points and grains alike */
#pragma once
#include "fused.h"
#include <math.h>
#include <quern/grid.h>
#include <quern/shape.h>
#include <quern/solver.h>

enum { STENCIL = 64 }; /* particles at once */

typedef struct stencil {
	_Alignas(64) quern_real position[3][STENCIL]; /* m from the grid's lower corner */
	quern_real value[3][3][STENCIL], slope[3][3][STENCIL];
	int32_t first[3][STENCIL];
	int32_t node[STENCIL];  /* of the lowest node, in the tile */
	int32_t reach[STENCIL]; /* in 3-D; bit a: there is a third node along axis a */
} stencil;

/* Grains come back through a periodic face when their list is made, not before: here each is taken as the image that
 * lies in its block, wherever round-off puts the block's faces. */
QUERN_INLINE void stencil_place(const quern_grid_view *g, uint32_t block, uint32_t axis, const quern_real *x,
	const int32_t *index, uint32_t n, quern_real *restrict position) {
	const int32_t edge = (int32_t)g->edge, begin = g->at[block][axis] * edge, rest = g->cells[axis] - begin;
	const quern_images images = quern_grid_images(g);
	const quern_real middle = (begin + 0.5 * (rest < edge ? rest : edge)) * g->cell;
	for (uint32_t i = 0; i < n; i++)
		position[i] =
			quern_image_at(x[index[i]] - g->lower[axis], middle, images.half[axis], images.length[axis]);
}

/* The walls along an axis that particles in the tile of a block may be near to; of all the domain: `block` is EVERYWHERE. */
enum { EVERYWHERE = -1 };
QUERN_INLINE void stencil_walls(const quern_grid_view *g, int64_t block, uint32_t axis, int32_t wall[2]) {
	const int32_t edge = (int32_t)g->edge, at = block < 0 ? 0 : g->at[block][axis];
	const bool low = !g->periodic[axis] && (block < 0 || at == 0),
			   high = !g->periodic[axis] && (block < 0 || (at + 1) * edge + 2 >= g->cells[axis]);
	wall[0] = low ? 0 : INT32_MIN;
	wall[1] = high ? g->cells[axis] : INT32_MAX;
}

/* Weights and slopes at the positions that stand in s. */
QUERN_INLINE void stencil_weigh(
	const quern_grid_view *g, const quern_bound *shape, int64_t block, uint32_t n, stencil *s) {
	quern_shape_batch b = { .n = n, .cap = STENCIL, .dim = g->dim, .inverse_cell = 1 / g->cell };
	for (uint32_t a = 0; a < g->dim; a++) {
		b.position[a] = s->position[a];
		stencil_walls(g, block, a, b.wall[a]);
		b.first[a] = s->first[a];
		for (int k = 0; k < 3; k++) b.value[a][k] = s->value[a][k], b.slope[a][k] = s->slope[a][k];
	}
	((const quern_shape_ops *)shape->ops)->weights(shape->self, &b);
}

/* ---- in 3-D: how far particles reach ---- */

/* Between two nodes a hat reaches only these, and gimp where a particle lies well between them: of 27 nodes 8 are left then, and 16 in the mean.
 * In a plane, with 9 nodes, finding out costs as much as it saves. */
QUERN_INLINE void stencil_find_reach(uint32_t n, stencil *s) {
	const quern_real *restrict vx = s->value[0][2], *restrict vy = s->value[1][2],
							   *restrict vz = s->value[2][2];
	const quern_real *restrict sx = s->slope[0][2], *restrict sy = s->slope[1][2],
							   *restrict sz = s->slope[2][2];
	int32_t *restrict reach = s->reach;
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		const int32_t x = (vx[i] != 0) | (sx[i] != 0), y = (vy[i] != 0) | (sy[i] != 0),
					  z = (vz[i] != 0) | (sz[i] != 0);
		reach[i] = x | y << 1 | z << 2;
	}
}

/* Nodes along an axis, of a particle that reaches so far. */
QUERN_INLINE uint32_t stencil_along(const uint32_t reach, const uint32_t axis) {
	return 2 + (reach >> axis & 1);
}

/* Calls with a particle's reach as a constant. Without AVX, which processors have had since 2011, it is either least or most: less code, which would
 * be most of what there is to compile, and the same sums. */
#if defined __AVX__
#define STENCIL_BY_REACH(s, i, dim, call)                                                                    \
	switch (dim == 3 ? (s)->reach[i] : 3) {                                                                  \
	case 0: call(0); break;                                                                                  \
	case 1: call(1); break;                                                                                  \
	case 2: call(2); break;                                                                                  \
	case 3: call(3); break;                                                                                  \
	case 4: call(4); break;                                                                                  \
	case 5: call(5); break;                                                                                  \
	case 6: call(6); break;                                                                                  \
	default: call(7);                                                                                        \
	}
#else
#define STENCIL_BY_REACH(s, i, dim, call)                                                                    \
	switch (dim == 3 ? (s)->reach[i] : 3) {                                                                  \
	case 0: call(0); break;                                                                                  \
	default: call(7);                                                                                        \
	}
#endif

/* x: whole columns; the particles are entries begin .. begin + n, or those that `index` names. */
QUERN_INLINE void stencil_make(const quern_grid_view *g, const quern_bound *shape, uint32_t block,
	quern_real *const x[3], uint32_t begin, const int32_t *index, uint32_t n, stencil *s) {
	for (uint32_t a = 0; a < g->dim; a++) {
		const quern_real lower = g->lower[a];
		const quern_real *restrict from = x[a] + begin;
		if (index) stencil_place(g, block, a, x[a], index, n, s->position[a]);
		else
			for (uint32_t i = 0; i < n; i++) s->position[a][i] = from[i] - lower;
	}
	stencil_weigh(g, shape, block, n, s);
	memset(s->node, 0, n * sizeof s->node[0]);
	for (uint32_t a = g->dim; a-- > 0;) {
		/* the tile begins a cell before the block */
		const int32_t span = (int32_t)g->span, lowest = g->at[block][a] * (int32_t)g->edge - 1;
		const int32_t *restrict first = s->first[a];
		int32_t *restrict node = s->node;
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) node[i] = node[i] * span + first[i] - lowest;
	}
	if (g->dim == 3) stencil_find_reach(n, s);
}

/* True while every node that a particle at x may reach lies in the tile of its block: half a cell beyond it. */
QUERN_INLINE bool stencil_holds(const quern_grid_view *g, uint32_t block, uint32_t axis, quern_real x) {
	const quern_real t =
		(x - g->lower[axis]) * (1 / g->cell) - (quern_real)(g->at[block][axis] * (int32_t)g->edge);
	return t >= -0.5 && t <= (quern_real)g->edge + 0.5;
}

/* The cells around whose middles a hat at `position` (m from the grid's lower corner) is something along an axis, in the block's tile, whose nodes are
 * the lower corners of cells, and its parts there. What a face of the domain leaves without a cell goes to the one beside it. */
QUERN_INLINE void stencil_cells(const quern_grid_view *g, uint32_t block, int axis, quern_real position,
	uint32_t to[2], quern_real part[2]) {
	const int32_t begins = g->at[block][axis] * (int32_t)g->edge;
	/* the tile begins a cell before the block, and middles lie half a cell above nodes */
	const quern_real x = position / g->cell - begins + 0.5;
	const int32_t below = x > 0 ? (int32_t)x : 0, cell = begins + below - 1;
	to[0] = (uint32_t)(!g->periodic[axis] && cell < 0 ? below + 1 : below);
	to[1] = (uint32_t)(!g->periodic[axis] && cell + 1 >= g->cells[axis] ? below : below + 1);
	part[1] = x - below;
	part[0] = 1 - part[1];
}

/* ---- rows in parts ---- */

typedef struct parted_row {
	row_part part[PARTS];
} parted_row;

QUERN_INLINE row_part *parts_of(quern_row *row) { return (row_part *)(void *)row; }
QUERN_INLINE const row_part *const_parts_of(const quern_row *row) {
	return (const row_part *)(const void *)row;
}
/* Lanes in a list are put together in registers; one after the other they are not. */
QUERN_INLINE parted_row parted(const quern_real l[QUERN_LANES]) {
#if defined QUERN_WHOLE_ROWS
	return (parted_row) { { { l[0], l[1], l[2], l[3], l[4], l[5], l[6], l[7] } } };
#elif defined __AVX__
	return (parted_row) { { { l[0], l[1], l[2], l[3] }, { l[4], l[5], l[6], l[7] } } };
#else
	return (parted_row) { { { l[0], l[1] }, { l[2], l[3] }, { l[4], l[5] }, { l[6], l[7] } } };
#endif
}
#define PARTED(...) parted((const quern_real[QUERN_LANES]) { __VA_ARGS__ })

/* A row's first four lanes carry what particles bring along and its last four what pushes: parts of the processor's that hold
 * only one of the two are spared the work of the other. */
enum { CARRIED = QUERN_LANES / 2 };
QUERN_INLINE bool part_carries(const int k) { return k * PART_LANES < CARRIED; }
QUERN_INLINE bool part_pushes(const int k) { return (k + 1) * PART_LANES > CARRIED; }

/* What a particle sends: `base` to every node; of `lean`, the carried lanes per metre of way from the particle to the node (a velocity gradient), the
 * others per unit of the function's slope (a stress). `base` has none of the latter. */
typedef struct sent {
	parted_row base, lean[3];
} sent;
enum { SENDS_BASE = 0, SENDS_ALONG = 1, SENDS_SLOPE = 2 };

/* Nodes per axis of a tile, a constant where the dimension is one. */
QUERN_INLINE uint32_t tile_span(const int dim) { return dim == 2 ? 12 : 8; }

/* By what `lean` goes to node k along an axis. What carries and what pushes lie in lanes of their own, and cost no more together than one of them. */
QUERN_INLINE row_part stencil_lean(const stencil *s, uint32_t i, const int what, quern_real way[3][3],
	const uint32_t axis, const uint32_t k, const int part) {
	const bool along = part_carries(part) && what & SENDS_ALONG,
			   pushes = part_pushes(part) && what & SENDS_SLOPE;
	const quern_real c = along ? s->value[axis][k][i] * way[axis][k] : 0,
					 p = pushes ? s->slope[axis][k][i] : 0;
	if (along && pushes) return PARTED(c, c, c, c, p, p, p, p).part[0];
	return part_of(along ? c : p);
}

/* Lanes of the other kind are zero, and what is added for them changes nothing but the sign of a zero, which goes as tiles are added to nodes: rows come
 * out alike however they are cut.
 * What is added may lie anywhere for all that the compiler knows: what nodes share is read before. */
QUERN_INLINE void stencil_scatter_part(const stencil *s, uint32_t i, const sent *p, const int what,
	quern_row *tile, const int dim, quern_real way[3][3], const uint32_t to_x, const uint32_t to_y,
	const uint32_t to_z, const int k) {
	const bool carries = part_carries(k),
			   leans = (carries && what & SENDS_ALONG) || (part_pushes(k) && what & SENDS_SLOPE);
	const row_part none = { 0 };
	if (!carries && !leans) return;
	const uint32_t span = tile_span(dim);
	quern_row *const lowest = tile + s->node[i];
	row_part value[3], lean[3] = { none, none, none };
	for (uint32_t x = 0; x < to_x; x++) {
		value[x] = part_of(s->value[0][x][i]);
		if (leans) lean[x] = stencil_lean(s, i, what, way, 0, x, k);
	}
	for (uint32_t z = 0; z < to_z; z++) {
		row_part base = p->base.part[k], gx = p->lean[0].part[k], gy = p->lean[1].part[k];
		if (dim == 3) {
			const quern_real v = s->value[2][z][i];
			const row_part gz = p->lean[2].part[k];
			if (carries) base *= v;
			if (leans) gx *= v, gy *= v;
			if (leans && carries) base = part_fma(stencil_lean(s, i, what, way, 2, z, k), gz, base);
			else if (leans) base = stencil_lean(s, i, what, way, 2, z, k) * gz;
		}
		for (uint32_t y = 0; y < to_y; y++) {
			const quern_real v = s->value[1][y][i];
			row_part even = none, tilt = none;
			if (carries || dim == 3) even = v * base;
			if (leans) {
				const row_part lean_y = stencil_lean(s, i, what, way, 1, y, k);
				if (carries || dim == 3) even = part_fma(lean_y, gy, even);
				else even = lean_y * gy;
				tilt = v * gx;
			}
			for (uint32_t x = 0; x < to_x; x++) {
				row_part *const to = &parts_of(lowest + (z * span + y) * span + x)[k];
				row_part now = part_fma(value[x], even, *to);
				if (leans) now = part_fma(lean[x], tilt, now);
				*to = now;
			}
		}
	}
}

QUERN_INLINE void stencil_scatter_reach(const stencil *s, uint32_t i, const sent *p, const int what,
	quern_row *tile, const int dim, quern_real way[3][3], const uint32_t reach) {
	const uint32_t x = stencil_along(reach, 0), y = stencil_along(reach, 1),
				   z = dim == 3 ? stencil_along(reach, 2) : 1;
	stencil_scatter_part(s, i, p, what, tile, dim, way, x, y, z, 0);
	if (PARTS > 1) stencil_scatter_part(s, i, p, what, tile, dim, way, x, y, z, 1);
	if (PARTS > 2) {
		stencil_scatter_part(s, i, p, what, tile, dim, way, x, y, z, 2);
		stencil_scatter_part(s, i, p, what, tile, dim, way, x, y, z, 3);
	}
}

/* Adds one particle to the tile; `what`, a constant, names the rows of `p` that hold something beside `base`. */
QUERN_INLINE void stencil_scatter(const stencil *s, uint32_t i, const sent *p, const int what,
	quern_row *tile, const int dim, quern_real cell) {
	quern_real way[3][3] = { { 0 } };
	for (int a = 0; a < dim && what & SENDS_ALONG; a++)
		for (int k = 0; k < 3; k++) way[a][k] = (quern_real)(s->first[a][i] + k) * cell - s->position[a][i];
#define SCATTER_REACH(reach) stencil_scatter_reach(s, i, p, what, tile, dim, way, reach)
	STENCIL_BY_REACH(s, i, dim, SCATTER_REACH)
}

QUERN_INLINE void stencil_gather_part(const stencil *s, uint32_t i, const quern_row *tile, const int dim,
	const bool slopes, const quern_real slope[3][3][STENCIL], quern_row out[4], const uint32_t to_x,
	const uint32_t to_y, const uint32_t to_z, const int k) {
	const bool sloped = slopes && part_carries(k);
	const uint32_t span = tile_span(dim);
	row_part sum = { 0 };
	half_part sx = { 0 }, sy = { 0 }, sz = { 0 };
	for (uint32_t z = 0; z < to_z; z++) {
		row_part u = { 0 };
		half_part ux = { 0 }, uy = { 0 };
		for (uint32_t y = 0; y < to_y; y++) {
			const quern_row *row = tile + s->node[i] + (z * span + y) * span;
			row_part e = { 0 };
			half_part d = { 0 };
			for (uint32_t x = 0; x < to_x; x++) {
				const row_part a = const_parts_of(row + x)[k];
				e = part_fma(part_of(s->value[0][x][i]), a, e);
				if (sloped) d = half_fma(half_with(slope[0][x][i]), half_of(a), d);
			}
			const row_part v = part_of(s->value[1][y][i]);
			u = part_fma(v, e, u);
			if (!sloped) continue;
			ux = half_fma(half_of(v), d, ux);
			uy = half_fma(half_with(slope[1][y][i]), half_of(e), uy);
		}
		if (dim == 2) {
			sum = u, sx = ux, sy = uy;
			break;
		}
		const row_part v = part_of(s->value[2][z][i]);
		sum = part_fma(v, u, sum);
		if (!sloped) continue;
		sx = half_fma(half_of(v), ux, sx);
		sy = half_fma(half_of(v), uy, sy);
		sz = half_fma(half_with(slope[2][z][i]), half_of(u), sz);
	}
	parts_of(&out[0])[k] = sum;
	if (!sloped) return;
	const half_part along[3] = { sx, sy, sz };
	for (int a = 0; a < dim; a++) *(half_part *)(void *)&parts_of(&out[1 + a])[k] = along[a];
}

QUERN_INLINE void stencil_gather_reach(const stencil *s, uint32_t i, const quern_row *tile, const int dim,
	const bool slopes, const quern_real slope[3][3][STENCIL], quern_row out[4], const uint32_t reach) {
	const uint32_t x = stencil_along(reach, 0), y = stencil_along(reach, 1),
				   z = dim == 3 ? stencil_along(reach, 2) : 1;
	stencil_gather_part(s, i, tile, dim, slopes, slope, out, x, y, z, 0);
	if (PARTS > 1) stencil_gather_part(s, i, tile, dim, slopes, slope, out, x, y, z, 1);
	if (PARTS > 2) {
		stencil_gather_part(s, i, tile, dim, slopes, slope, out, x, y, z, 2);
		stencil_gather_part(s, i, tile, dim, slopes, slope, out, x, y, z, 3);
	}
}

/* The weighted sum of a tile's rows at one particle in out[0]; with `slopes`, in out[1 + axis] their sums with what
 * `slope` has in place of the weights along that axis, of the carried lanes alone. */
QUERN_INLINE void stencil_gather_by(const stencil *s, uint32_t i, const quern_row *tile, const int dim,
	const bool slopes, const quern_real slope[3][3][STENCIL], quern_row out[4]) {
#define GATHER_REACH(reach) stencil_gather_reach(s, i, tile, dim, slopes, slope, out, reach)
	STENCIL_BY_REACH(s, i, dim, GATHER_REACH)
}

/* The same with the functions' own slopes. */
QUERN_INLINE void stencil_gather(
	const stencil *s, uint32_t i, const quern_row *tile, const int dim, const bool slopes, quern_row out[4]) {
	stencil_gather_by(s, i, tile, dim, slopes, s->slope, out);
}

/* In a plane what comes back to points has five lanes, and a row has room for the first two once more: one product does for sums and for slopes along x, by a
 * factor that is the one or the other. All are the same to the bit. It pays where the processor takes a row at once. What motion has in the lanes that are taken,
 * its grip, is not read here. */
enum { ONCE_MORE = 5 };
QUERN_INLINE bool stencil_doubles(const int dim) { return dim == 2 && PARTS == 1; }

QUERN_INLINE void stencil_double(quern_row *tile, uint32_t n) {
	for (uint32_t k = 0; k < n; k++)
		tile[k] = __builtin_shufflevector(tile[k], tile[k], 0, 1, 2, 3, 4, 0, 1, 7);
}

/* Of doubled rows: the weighted sum, with its slopes along x from lane ONCE_MORE on; in the first lanes of `up` those along y. */
QUERN_INLINE void stencil_gather_doubled(
	const stencil *s, uint32_t i, const quern_row *tile, quern_row *sum, quern_row *up) {
	const uint32_t span = tile_span(2);
	for (int k = 0; k < PARTS; k++) {
		row_part along[3], all = { 0 }, high = { 0 };
		for (uint32_t x = 0; x < 3; x++)
			along[x] =
				part_join(part_of(s->value[0][x][i]), part_of(s->slope[0][x][i]), ONCE_MORE - k * PART_LANES);
		for (uint32_t y = 0; y < 3; y++) {
			const quern_row *row = tile + s->node[i] + y * span;
			row_part e = { 0 };
			for (uint32_t x = 0; x < 3; x++) e = part_fma(along[x], const_parts_of(row + x)[k], e);
			all = part_fma(part_of(s->value[1][y][i]), e, all);
			high = part_fma(part_of(s->slope[1][y][i]), e, high);
		}
		parts_of(sum)[k] = all;
		parts_of(up)[k] = high;
	}
}

/* ---- all blocks, where they add to nodes ---- */

/* `next` is worked on after `block`, by whichever worker; the same where there is none. */
typedef void stencil_body(void *arg, uint32_t block, uint32_t next, uint32_t worker);

typedef struct stencil_blocks {
	stencil_body *body;
	void *arg;
	const uint32_t *list; /* of one colour */
	uint32_t n;
} stencil_blocks;

static inline void stencil_one_block(void *arg, uint32_t i, uint32_t worker) {
	const stencil_blocks *all = arg;
	all->body(all->arg, all->list[i], all->list[i + 1 < all->n ? i + 1 : i], worker);
}

/* Colour by colour, so that no two blocks whose tiles share a node run at once, and each node sums in a fixed order. */
static inline void stencil_by_colour(
	const quern_step *s, const quern_grid_view *g, stencil_body *body, void *arg) {
	stencil_blocks all = { body, arg, NULL, 0 };
	for (uint32_t c = 0; c < g->n_colours; c++) {
		all.list = g->by_colour + g->colour[c];
		all.n = g->colour[c + 1] - g->colour[c];
		s->host->parallel(s->run, all.n, stencil_one_block, &all);
	}
}
