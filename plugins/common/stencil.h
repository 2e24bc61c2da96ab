/* SPDX-License-Identifier: MIT */
/* stencil - particles of one grid block and the nodes they reach, in the block's tile; for points and grains alike */
#pragma once
#include <math.h>
#include <quern/grid.h>
#include <quern/shape.h>
#include <quern/solver.h>

enum { STENCIL = 64 }; /* particles at once */

typedef struct stencil {
	_Alignas(64) quern_real position[3][STENCIL]; /* m from the grid's lower corner */
	quern_real value[3][3][STENCIL], slope[3][3][STENCIL];
	int32_t first[3][STENCIL];
	int32_t node[STENCIL]; /* of the lowest node, in the tile */
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

/* Weights and slopes at the positions that stand in s. */
QUERN_INLINE void stencil_weigh(const quern_grid_view *g, const quern_bound *shape, uint32_t n, stencil *s) {
	quern_shape_batch b = { .n = n, .cap = STENCIL, .dim = g->dim, .inverse_cell = 1 / g->cell };
	for (uint32_t a = 0; a < g->dim; a++) {
		b.position[a] = s->position[a];
		b.wall[a][0] = g->periodic[a] ? INT32_MIN : 0;
		b.wall[a][1] = g->periodic[a] ? INT32_MAX : g->cells[a];
		b.first[a] = s->first[a];
		for (int k = 0; k < 3; k++) b.value[a][k] = s->value[a][k], b.slope[a][k] = s->slope[a][k];
	}
	((const quern_shape_ops *)shape->ops)->weights(shape->self, &b);
}

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
	stencil_weigh(g, shape, n, s);
	const int32_t span = (int32_t)g->span;
	for (uint32_t i = 0; i < n; i++) {
		int32_t node = 0;
		for (uint32_t a = g->dim; a-- > 0;)
			node = node * span + s->first[a][i] - (g->at[block][a] * (int32_t)g->edge - 1);
		s->node[i] = node;
	}
}

/* True while every node that a particle at x may reach lies in the tile of its block: half a cell beyond it. */
QUERN_INLINE bool stencil_holds(const quern_grid_view *g, uint32_t block, uint32_t axis, quern_real x) {
	const quern_real t =
		(x - g->lower[axis]) * (1 / g->cell) - (quern_real)(g->at[block][axis] * (int32_t)g->edge);
	return t >= -0.5 && t <= (quern_real)g->edge + 0.5;
}

/* ---- rows in parts ---- */

/* A row as the processor takes it in one go: a compiler that has to cut rows by itself passes each factor through memory, and waits for it. */
#if defined __AVX512F__
enum { PARTS = 1 };
#elif defined __AVX__
enum { PARTS = 2 };
#else
enum { PARTS = 4 };
#endif
enum { PART_LANES = QUERN_LANES / PARTS };
typedef quern_real row_part __attribute__((vector_size(PART_LANES * sizeof(quern_real)), may_alias));
typedef struct parted_row {
	row_part part[PARTS];
} parted_row;

QUERN_INLINE row_part *parts_of(quern_row *row) { return (row_part *)(void *)row; }
QUERN_INLINE const row_part *const_parts_of(const quern_row *row) {
	return (const row_part *)(const void *)row;
}
/* Lanes in a list are put together in registers; one after the other they are not. */
QUERN_INLINE parted_row parted(const quern_real l[QUERN_LANES]) {
#if defined __AVX512F__
	return (parted_row) { { { l[0], l[1], l[2], l[3], l[4], l[5], l[6], l[7] } } };
#elif defined __AVX__
	return (parted_row) { { { l[0], l[1], l[2], l[3] }, { l[4], l[5], l[6], l[7] } } };
#else
	return (parted_row) { { { l[0], l[1] }, { l[2], l[3] }, { l[4], l[5] }, { l[6], l[7] } } };
#endif
}
#define PARTED(...) parted((const quern_real[QUERN_LANES]) { __VA_ARGS__ })

/* What a particle sends: `base` to every node; `along` per metre of way from the particle to the node (a velocity
 * gradient); `slope` per unit of the function's slope (a stress). Lanes that `along` and `slope` use must differ. */
typedef struct sent {
	parted_row base, along[3], slope[3];
} sent;

QUERN_INLINE void stencil_scatter_part(const stencil *s, uint32_t i, const sent *p,
	const quern_row *split_lanes, quern_row *tile, const int dim, quern_real way[3][3], int32_t span,
	const int k) {
	const row_part split = const_parts_of(split_lanes)[k], rest = 1 - split;
	for (int z = 0; z < (dim == 3 ? 3 : 1); z++) {
		row_part u = p->base.part[k], ax = p->along[0].part[k] + p->slope[0].part[k],
				 ay = p->along[1].part[k], sy = p->slope[1].part[k];
		if (dim == 3) {
			const quern_real v = s->value[2][z][i];
			u = v * (u + way[2][z] * p->along[2].part[k]) + s->slope[2][z][i] * p->slope[2].part[k];
			ax = v * ax;
			ay = v * ay;
			sy = v * sy;
		}
		for (int y = 0; y < 3; y++) {
			const quern_real v = s->value[1][y][i];
			const row_part e = v * (u + way[1][y] * ay) + s->slope[1][y][i] * sy, t = v * ax;
			quern_row *row = tile + s->node[i] + (z * span + y) * span;
			for (int x = 0; x < 3; x++) {
				const quern_real w = s->value[0][x][i];
				parts_of(row + x)[k] += w * e + (w * way[0][x] * rest + s->slope[0][x][i] * split) * t;
			}
		}
	}
}

/* Adds one particle to the tile. `split` holds 1 in the lanes of `slope`, 0 elsewhere. */
QUERN_INLINE void stencil_scatter(const stencil *s, uint32_t i, const sent *p, const quern_row *split,
	quern_row *tile, const int dim, quern_real cell, int32_t span) {
	quern_real way[3][3] = { { 0 } };
	for (int a = 0; a < dim; a++)
		for (int k = 0; k < 3; k++) way[a][k] = (quern_real)(s->first[a][i] + k) * cell - s->position[a][i];
	for (int k = 0; k < PARTS; k++) stencil_scatter_part(s, i, p, split, tile, dim, way, span, k);
}

QUERN_INLINE void stencil_gather_part(const stencil *s, uint32_t i, const quern_row *tile, const int dim,
	const bool slopes, const quern_real slope[3][3][STENCIL], quern_row out[4], int32_t span, const int k) {
	row_part sum = { 0 }, sx = { 0 }, sy = { 0 }, sz = { 0 };
	for (int z = 0; z < (dim == 3 ? 3 : 1); z++) {
		row_part u = { 0 }, ux = { 0 }, uy = { 0 };
		for (int y = 0; y < 3; y++) {
			const quern_row *row = tile + s->node[i] + (z * span + y) * span;
			const row_part a = const_parts_of(row)[k], b = const_parts_of(row + 1)[k],
						   c = const_parts_of(row + 2)[k];
			const row_part e = s->value[0][0][i] * a + s->value[0][1][i] * b + s->value[0][2][i] * c;
			u += s->value[1][y][i] * e;
			if (!slopes) continue;
			const row_part d = slope[0][0][i] * a + slope[0][1][i] * b + slope[0][2][i] * c;
			ux += s->value[1][y][i] * d;
			uy += slope[1][y][i] * e;
		}
		const quern_real v = dim == 3 ? s->value[2][z][i] : 1;
		sum += v * u;
		sx += v * ux;
		sy += v * uy;
		if (dim == 3) sz += slope[2][z][i] * u;
	}
	parts_of(&out[0])[k] = sum;
	if (slopes) parts_of(&out[1])[k] = sx, parts_of(&out[2])[k] = sy, parts_of(&out[3])[k] = sz;
}

/* The weighted sum of a tile's rows at one particle in out[0]; with `slopes`, in out[1 + axis] their sums with what
 * `slope` has in place of the weights along that axis. */
QUERN_INLINE void stencil_gather_by(const stencil *s, uint32_t i, const quern_row *tile, const int dim,
	const bool slopes, const quern_real slope[3][3][STENCIL], quern_row out[4], int32_t span) {
	for (int k = 0; k < PARTS; k++) stencil_gather_part(s, i, tile, dim, slopes, slope, out, span, k);
}

/* The same with the functions' own slopes. */
QUERN_INLINE void stencil_gather(const stencil *s, uint32_t i, const quern_row *tile, const int dim,
	const bool slopes, quern_row out[4], int32_t span) {
	stencil_gather_by(s, i, tile, dim, slopes, s->slope, out, span);
}

/* ---- all blocks, where they add to nodes ---- */

typedef struct stencil_blocks {
	void (*body)(void *arg, uint32_t block, uint32_t worker);
	void *arg;
	const uint32_t *list; /* of one colour */
} stencil_blocks;

static inline void stencil_one_block(void *arg, uint32_t i, uint32_t worker) {
	const stencil_blocks *all = arg;
	all->body(all->arg, all->list[i], worker);
}

/* Colour by colour, so that no two blocks whose tiles share a node run at once, and each node sums in a fixed order. */
static inline void stencil_by_colour(const quern_step *s, const quern_grid_view *g,
	void (*body)(void *arg, uint32_t block, uint32_t worker), void *arg) {
	stencil_blocks all = { body, arg, NULL };
	for (uint32_t c = 0; c < g->n_colours; c++) {
		all.list = g->by_colour + g->colour[c];
		s->host->parallel(s->run, g->colour[c + 1] - g->colour[c], stencil_one_block, &all);
	}
}
