/* SPDX-License-Identifier: MIT */
/* gather - nodes to points, chunk by chunk: velocity, position, volume, stress */
#include "../common/calm.h"
#include "../common/cloud.h"
#include "../common/trips.h"
#include "mpm.h"
#include <math.h>

typedef struct {
	const mpm *p;
	const quern_step *s;
	const quern_grid_view *g;
	const uint32_t *point;
	cloud points;
	const quern_row *motion;
	trips trips;
	calm calm;
	bool answers;         /* volume does, to how full cells are */
	bool counts;          /* the same of a continuum alone, in this step */
	quern_real full;      /* from there on a cell is crowded */
	quern_real still;     /* 1/s: sheared much faster, material flows */
	int32_t *bad, *moved; /* by block: first bad point or -1; whether one has left the tile */
} gather_work;

typedef struct {
	quern_row tile[QUERN_TILE_MOST];
	trip_memory trip;
	_Alignas(64) quern_real gradient[9][STENCIL], grid_density[STENCIL], density[STENCIL], moved[STENCIL];
	_Alignas(64) quern_real kept[3][STENCIL], mean_pressure[STENCIL];
	/* by cell of the block: Pa and m^3 of its points, m^3 of those that are open, kg/m^3 of what it holds and of its points that
	 * are not open */
	quern_real level[QUERN_BLOCK_CELLS], room[QUERN_BLOCK_CELLS], loose[QUERN_BLOCK_CELLS],
		held[QUERN_BLOCK_CELLS], mean[QUERN_BLOCK_CELLS];
	fit_memory fit;                   /* where the transfer asks for it */
	int32_t cell[STENCIL];            /* of the block, by point of a chunk */
	quern_real said[QUERN_TILE_MOST]; /* kg/m^3 at the tile's nodes */
	bool silent[QUERN_TILE_MOST];     /* those that bodies leave no room */
} gather_memory;

/* For a node that says nothing those around it speak, if there are any that hold something. */
static quern_real said_around(const gather_work *w, const gather_memory *m, uint32_t node) {
	const int32_t span = (int32_t)w->g->span, deep = w->s->dim == 3 ? span : 1;
	const int32_t at[3] = { (int32_t)node % span, (int32_t)node / span % span,
		(int32_t)node / (span * span) };
	quern_real sum = 0;
	uint32_t n = 0;
	for (int32_t z = at[2] ? at[2] - 1 : 0; z < deep && z <= at[2] + 1; z++)
		for (int32_t y = at[1] ? at[1] - 1 : 0; y < span && y <= at[1] + 1; y++)
			for (int32_t x = at[0] ? at[0] - 1 : 0; x < span && x <= at[0] + 1; x++) {
				const quern_real one = m->tile[(z * span + y) * span + x][motion_density(w->s->dim)];
				if (one > 0) sum += one, n++;
			}
	return n ? sum / n : -m->tile[node][motion_density(w->s->dim)];
}

static void speak_for_others(const gather_work *w, gather_memory *m) {
	const uint32_t lane = motion_density(w->s->dim), nodes = w->g->tile_size;
	bool any = false;
	for (uint32_t k = 0; k < nodes; k++) {
		m->silent[k] = m->tile[k][lane] < 0;
		any = any || m->silent[k];
	}
	if (!any) return;
	for (uint32_t k = 0; k < nodes; k++)
		m->said[k] = m->tile[k][lane] < 0 ? said_around(w, m, k) : m->tile[k][lane];
	for (uint32_t k = 0; k < nodes; k++) m->tile[k][lane] = m->said[k];
}

/* What the nodes say at the points of a chunk. */
QUERN_INLINE void collect_chunk(
	const gather_work *w, gather_memory *m, uint32_t n, const int dim, const bool slopes) {
	for (uint32_t i = 0; i < n; i++) {
		quern_row v[4];
		stencil_gather(&m->trip.stencil, i, m->tile, dim, slopes, v);
		trips_hear(&m->trip, i, &v[0], 0, dim);
		for (int k = 0; k < dim; k++)
			for (int a = 0; a < dim && slopes; a++) m->gradient[dim * k + a][i] = v[1 + a][k];
		m->grid_density[i] = v[0][2 * dim];
	}
	trips_hear_echo(&w->trips, &m->trip, n, dim);
}

/* Where points go in this step; what moves by more than a cell, or nowhere, is lost and found out behind. */
static void look_ahead(const gather_work *w, gather_memory *m, uint32_t n) {
	const quern_real dt = w->s->dt, most = w->g->cell;
	for (uint32_t a = 0; a < w->s->dim; a++)
		for (uint32_t i = 0; i < n; i++) {
			const quern_real way = dt * m->trip.pic[a][i], held = way < most ? way : most;
			m->fit.there.position[a][i] = m->trip.stencil.position[a][i] + (held > -most ? held : -most);
		}
	stencil_weigh(w->g, &w->s->slot[SLOT_SHAPE][0], EVERYWHERE, n, &m->fit.there);
}

/* The linear field that fits what the nodes say, point by point. */
QUERN_INLINE void fit_chunk(const gather_work *w, gather_memory *m, uint32_t n, const int dim) {
	const quern_real inverse = 1 / w->g->cell;
	const quern_real(*slope)[3][STENCIL] = (const quern_real(*)[3][STENCIL])m->fit.slope;
	fit_slopes(&m->trip.stencil, n, dim, inverse, &m->fit);
	for (uint32_t i = 0; i < n; i++) {
		quern_row v[4];
		stencil_gather_by(&m->trip.stencil, i, m->tile, dim, true, slope, v);
		for (int k = 0; k < dim; k++)
			for (int a = 0; a < dim; a++) m->fit.fit[dim * k + a][i] = v[1 + a][k];
	}
	if (w->p->moments) {
		look_ahead(w, m, n);
		fit_shift(n, dim, inverse, &m->fit);
	} else
		for (int a = 0; a < dim; a++)
			for (uint32_t i = 0; i < n; i++) m->fit.shift[a][i] = 1;
}

static void call_transfer(const gather_work *w, gather_memory *m, uint32_t begin, uint32_t n, bool last) {
	const quern_bound *transfer = w->trips.transfer;
	quern_real *velocity[3] = { NULL };
	quern_column own[QUERN_MOST_USES];
	for (uint32_t r = 0; r < transfer->n_uses; r++)
		own[r] = quern_column_from(transfer->column[r], transfer->uses[r].shape, begin);
	for (uint32_t k = 0; k < w->s->dim; k++) velocity[k] = w->s->use[GATHER_VELOCITY].real[k] + begin;
	trips_call(&w->trips, &m->trip, w->p->matrix ? &m->fit : NULL, velocity, own, n, last);
}

/* Of motion below the grid, at rest, over the shear rate of what is: all of it at once would take elastic waves along. */
static const quern_real calm_rate = 400;
/* Of the shear rate of what is at rest: where material flows for certain. What is alone has no noise of grains and conversions. */
static const quern_real flowing = 30, flowing_alone = 3;
/* What is shaken changes volume as much as shape, what flows hardly: weight of the former. */
static const quern_real shaken = 30;
/* Of densities within a cell: a rate over that at which they go to what the cell holds. */
static const quern_real evening = 10;
/* What is full, over what was full at first: that varies by so much. */
static const quern_real dead_band = 1.01;

/* From where to where along an axis, in cells from the block's corner, a point may be until the next sort: where all nodes that it reaches
 * are in the tile. That may reach far beyond the end of a period, where no cells are: what is counted in cells comes back before that. */
static void reach_of(const gather_work *w, uint32_t b, uint32_t k, quern_real reach[2]) {
	const quern_grid_view *g = w->g;
	const quern_real begin = (quern_real)(g->at[b][k] * (int32_t)g->edge), end = g->cells[k] - begin + 0.5;
	reach[0] = -0.5;
	reach[1] = (quern_real)g->edge + 0.5;
	if (w->p->alone && g->periodic[k] && end < reach[1]) reach[1] = end;
}

QUERN_INLINE bool one_leaves(
	const gather_work *w, uint32_t b, uint32_t k, const quern_real *restrict x, uint32_t n) {
	const quern_real lower = w->g->lower[k], inverse = 1 / w->g->cell,
					 begin = (quern_real)(w->g->at[b][k] * (int32_t)w->g->edge);
	quern_real reach[2];
	reach_of(w, b, k, reach);
	int leaves = 0;
	for (uint32_t i = 0; i < n; i++) {
		const quern_real t = (x[i] - lower) * inverse - begin;
		leaves |= !(t >= reach[0]) | !(t <= reach[1]);
	}
	return leaves;
}

/* x += dt sum S v; V *= det(1 + dt L); true density m/V */
QUERN_INLINE void move_chunk(
	const gather_work *w, gather_memory *m, uint32_t b, uint32_t begin, uint32_t n, const int dim) {
	const quern_column *u = w->s->use;
	const quern_real dt = w->s->dt;
	const quern_real *restrict mass = u[GATHER_MASS].real[0] + begin;
	quern_real *restrict volume = u[GATHER_VOLUME].real[0] + begin, *restrict density = m->density,
						 *restrict moved = m->moved;
	const quern_real *restrict l0 = m->gradient[0], *restrict l1 = m->gradient[1],
							   *restrict l2 = m->gradient[2];
	const quern_real *restrict l3 = m->gradient[3], *restrict l4 = m->gradient[4],
							   *restrict l5 = m->gradient[5];
	const quern_real *restrict l6 = m->gradient[6], *restrict l7 = m->gradient[7],
							   *restrict l8 = m->gradient[8];
	for (int k = 0; k < dim; k++) {
		quern_real *restrict x = u[GATHER_POSITION].real[k] + begin;
		const quern_real *restrict v = m->trip.pic[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) x[i] += dt * v[i];
		if (one_leaves(w, b, (uint32_t)k, x, n)) w->moved[b] = 1;
	}
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		quern_real det;
		if (dim == 2) det = (1 + dt * l0[i]) * (1 + dt * l3[i]) - dt * l1[i] * dt * l2[i];
		else {
			const quern_real a = 1 + dt * l0[i], e = 1 + dt * l4[i], k = 1 + dt * l8[i];
			det = a * (e * k - dt * l5[i] * dt * l7[i]) -
				  dt * l1[i] * (dt * l3[i] * k - dt * l5[i] * dt * l6[i]) +
				  dt * l2[i] * (dt * l3[i] * dt * l7[i] - e * dt * l6[i]);
		}
		volume[i] *= det;
		moved[i] = volume[i];
		density[i] = mass[i] / volume[i];
	}
}

/* Of the block's cells, those that points (m from the grid's lower corner) are in, or the nearest to them: between sorts a point may be
 * beyond. */
QUERN_INLINE void cells_of(const gather_work *w, uint32_t b, quern_real position[3][STENCIL], uint32_t n,
	const int dim, int32_t *restrict cell) {
	const quern_real width = w->g->cell;
	const int32_t edge = (int32_t)w->g->edge;
	memset(cell, 0, n * sizeof *cell);
	for (int k = dim; k-- > 0;) {
		const int32_t begin = w->g->at[b][k] * edge, inside = w->g->cells[k] - begin;
		const quern_real most = (w->p->alone && inside < edge ? inside : edge) - 1;
		const quern_real *restrict at = position[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			const quern_real x = at[i] / width - begin;
			cell[i] = cell[i] * edge + (int32_t)(x > 0 ? (x < most ? x : most) : 0);
		}
	}
}

static quern_real pressure_of(const gather_work *w, uint32_t i) {
	quern_real pressure = 0;
	for (uint32_t k = 0; k < w->s->dim; k++) pressure -= w->s->use[GATHER_STRESS].real[k][i] / w->s->dim;
	return pressure;
}

/* On the grid in the middle of a cell: the mean of its corners. */
static quern_real centre_density(const gather_work *w, const gather_memory *m, uint32_t place) {
	const uint32_t dim = w->s->dim, edge = w->g->edge;
	const uint32_t at[3] = { place % edge, place / edge % edge, place / edge / edge };
	quern_real sum = 0;
	for (uint32_t corner = 0; corner < 1u << dim; corner++) {
		uint32_t node = 0;
		for (uint32_t k = dim; k-- > 0;) node = node * w->g->span + at[k] + 1 + (corner >> k & 1);
		sum += m->tile[node][motion_density(dim)];
	}
	return sum / (1u << dim);
}

/* Whether every node of the domain that hats around the cell's centre reach up to knows a density: at a surface or a body some do not, and what
 * is counted there lacks what the body or the air holds. */
static bool surrounded(const gather_work *w, const gather_memory *m, uint32_t b, uint32_t c) {
	const quern_grid_view *g = w->g;
	const uint32_t dim = w->s->dim, edge = g->edge, at[3] = { c % edge, c / edge % edge, c / edge / edge };
	for (uint32_t near = 0; near < 1u << 2 * dim; near++) {
		uint32_t node = 0;
		for (uint32_t k = dim; k-- > 0;) node = node * g->span + at[k] + (near >> 2 * k & 3);
		if (m->tile[node][motion_density(dim)] > 0 && !m->silent[node]) continue;
		bool outside = false;
		for (uint32_t k = 0; k < dim; k++) {
			/* the tile begins a cell before the block */
			const int32_t place = g->at[b][k] * (int32_t)edge + (int32_t)(at[k] + (near >> 2 * k & 3)) - 1;
			outside = outside || (!g->periodic[k] && (place < 0 || place > g->cells[k]));
		}
		if (!outside) return false;
	}
	return true;
}

/* Of a cell's density, what is measured in the cell itself, and not on the grid. */
static const quern_real own_part = 0.25, own_part_alone = 0.5;

/* The grid's density in the middle of a cell is smooth, but the same where full cells and empty ones take turns; what is counted in
 * a cell is neither. A continuum alone is counted by hats around the centres of cells (scatter.c). */
static quern_real density_of(const gather_work *w, const gather_memory *m, uint32_t b, uint32_t c) {
	const quern_real *fullness = w->s->use[GATHER_FULLNESS].real[0];
	const quern_real centre = centre_density(w, m, c);
	if (w->p->alone) {
		if (!surrounded(w, m, b, c)) return centre;
		const quern_row *node = w->trips.node + (size_t)b * QUERN_BLOCK_CELLS + c;
		return centre +
			   own_part_alone * ((*node)[node_held(w->s->dim)] / quern_grid_cell_volume(w->g) - centre);
	}
	const quern_real counted = fullness ? fullness[b * QUERN_BLOCK_CELLS + c] : 0;
	return counted > 0 ? centre + own_part * (counted * w->p->density - centre) : centre;
}

/* Of the stress-free density: a point less dense is open, its volume is the grid's. */
static const quern_real dense = 0.98;

/* The mean pressure of each cell's points, by volume, and the density of each cell. Points that lie loose and bear nothing are a part of what flows
 * where the cell is full; in one that is not they are spray beside it. */
QUERN_INLINE void level_block(const gather_work *w, gather_memory *m, uint32_t b, const int dim) {
	const quern_real *mass = w->s->use[GATHER_MASS].real[0], *volume = w->s->use[GATHER_VOLUME].real[0];
	quern_real *const *position = w->s->use[GATHER_POSITION].real,
					  (*place)[STENCIL] = m->trip.stencil.position;
	memset(m->level, 0, sizeof m->level);
	memset(m->room, 0, sizeof m->room);
	memset(m->loose, 0, sizeof m->loose);
	memset(m->mean, 0, sizeof m->mean);
	for (uint32_t begin = w->point[b]; begin < w->point[b + 1]; begin += STENCIL) {
		const uint32_t rest = w->point[b + 1] - begin, n = rest < STENCIL ? rest : STENCIL;
		for (int k = 0; k < dim; k++)
			for (uint32_t i = 0; i < n; i++) place[k][i] = position[k][begin + i] - w->g->lower[k];
		cells_of(w, b, place, n, dim, m->cell);
		for (uint32_t i = 0; i < n; i++) {
			const uint32_t at = begin + i, c = (uint32_t)m->cell[i];
			const bool open = mass[at] < dense * w->p->density * volume[at];
			m->level[c] += volume[at] * pressure_of(w, at);
			m->mean[c] += open ? 0 : mass[at];
			*(open ? &m->loose[c] : &m->room[c]) += volume[at];
		}
	}
	for (uint32_t c = 0; c < QUERN_BLOCK_CELLS; c++) {
		const bool any = m->room[c] + m->loose[c] > 0;
		m->held[c] = any ? density_of(w, m, b, c) : 0;
		m->mean[c] = m->room[c] > 0 ? m->mean[c] / m->room[c] : 0;
		const quern_real room = m->room[c] + (m->held[c] > dense * w->p->density ? m->loose[c] : 0);
		m->level[c] = room > 0 ? m->level[c] / room : 0;
	}
}

/* 0 at rest, 1 in flow, by the square of the shear rate. */
QUERN_INLINE quern_real flowing_share(quern_real still, quern_real rate2) {
	const quern_real fast = rate2 / (still * still), share = fast * fast / (1 + fast * fast);
	return still > 0 ? share : 1;
}

/* Points do not feel that they lie one upon the other: as material is sheared, their density goes to their cell's, a part for each unit of
 * shear; if it went to the grid's at their own place it would take over that one's noise. A cell that bears nothing has no friction to lose,
 * and a point far denser than its cell is at a surface. Returned: by what share the point's density grows in this step,
 * `part` of what its cell has more. */
QUERN_INLINE quern_real follow_cell(
	quern_real level, quern_real held, quern_real own, quern_real part, quern_real solid) {
	const quern_real off = held / own - 1, grown = part / (1 + part) * (off < 0.1 ? off : 0.1);
	const bool follows = (level > 0) & (own >= solid) & (off >= -0.1);
	return follows ? grown : 0;
}

/* A continuum alone: densities of points go to the mean of their cell's, which keeps the volume of all, much faster
 * than that goes to what the cell holds. Each by itself would take over the noise of its own gradient. */
static quern_real follow_alone(
	const gather_work *w, const gather_memory *m, uint32_t c, uint32_t i, quern_real rate) {
	quern_real trace = 0;
	for (uint32_t k = 0; k < w->s->dim; k++) trace += m->gradient[(w->s->dim + 1) * k][i];
	if (!(rate > 0) || !(m->level[c] > 0) || !(m->mean[c] > 0) || m->density[i] < dense * w->p->density)
		return 0;
	const quern_real sheared = rate * rate / (rate * rate + shaken * trace * trace),
					 time = w->s->dt * COUNT_EVERY, shear = rate * sheared * time;
	const quern_real evened = evening * w->p->follow * shear, part = w->p->follow * shear,
					 off = m->held[c] / m->mean[c] - 1;
	return (evened / (1 + evened) * (1 - m->density[i] / m->mean[c]) +
			   (off < -0.1 ? 0 : part / (1 + part) * fmin(off, 0.1))) /
		   time;
}

/* Mass that came where there was no room has brought its volume along, and does not press: what pressure lacks comes as a compression
 * beside that of the flow, where material flows, so that it holds for every material. */
QUERN_INLINE void answer_chunk(
	const gather_work *w, gather_memory *m, uint32_t b, uint32_t begin, uint32_t n, const int dim) {
	const mpm *p = w->p;
	const quern_real dt = w->s->dt, bulk = p->bulk, follow = p->follow * dt, full = w->full,
					 solid = dense * p->density, still = w->still, stiff = p->relief * bulk,
					 soon = fmin(1, p->answer * dt);
	const quern_real *crowding = w->s->use[GATHER_CROWDING].real[0] + (size_t)b * QUERN_BLOCK_CELLS;
	const quern_real *stress[3];
	quern_real crowded[STENCIL], holds[STENCIL], lack[STENCIL];
	cells_of(w, b, m->trip.stencil.position, n, dim, m->cell);
	for (uint32_t i = 0; i < n; i++) {
		crowded[i] = crowding[m->cell[i]];
		holds[i] = m->held[m->cell[i]];
		m->mean_pressure[i] = m->level[m->cell[i]];
	}
	for (int k = 0; k < dim; k++) stress[k] = w->s->use[GATHER_STRESS].real[k] + begin;
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) {
		quern_real pressure = 0, trace = 0;
		for (int k = 0; k < dim; k++) {
			pressure -= stress[k][i] / dim;
			trace += m->gradient[(dim + 1) * k][i];
		}
		pressure -= bulk * trace * dt; /* what the flow itself will make of it */
		const quern_real rate2 = calm_shear(m->gradient, i, (uint32_t)dim),
						 flows = flowing_share(still, rate2);
		/* of the deformation, what changes shape: what only changes volume does not even out densities */
		const quern_real shape = rate2 / (rate2 > 0 ? rate2 + shaken * trace * trace : 1);
		const quern_real followed = flows * follow_cell(m->mean_pressure[i], holds[i], m->density[i],
												follow * sqrt(rate2) * shape, solid);
		/* a crowded cell's least pressure; at rest no mass arrives, and a bed is denser here than there */
		const quern_real least = stiff * (crowded[i] - full);
		const bool short_of = (least > 0) & (least > pressure);
		const quern_real lacks = short_of ? soon * (least - pressure) : 0;
		m->density[i] *= 1 + followed;
		lack[i] = flows * lacks + bulk * followed;
	}
	for (int k = 0; k < dim; k++) {
		quern_real *restrict l = m->gradient[(dim + 1) * k], *restrict kept = m->kept[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			kept[i] = l[i];
			l[i] -= lack[i] / (bulk * dt * dim);
		}
	}
}

/* A continuum alone: how fast each density will follow until cells are counted again, and the mean pressure around. */
QUERN_INLINE void measure_chunk(
	const gather_work *w, gather_memory *m, uint32_t b, uint32_t begin, uint32_t n, const int dim) {
	const quern_column *u = w->s->use;
	cells_of(w, b, m->trip.stencil.position, n, dim, m->cell);
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t c = (uint32_t)m->cell[i];
		const quern_real rate2 = calm_shear(m->gradient, i, (uint32_t)dim);
		u[GATHER_FOLLOWING].real[0][begin + i] =
			flowing_share(w->still, rate2) * follow_alone(w, m, c, i, sqrt(rate2));
		u[GATHER_AROUND].real[0][begin + i] = m->level[c];
	}
}

/* The density and, as a compression beside that of the flow, the pressure with it. */
static void follow_chunk(const gather_work *w, gather_memory *m, uint32_t begin, uint32_t n) {
	const uint32_t dim = w->s->dim;
	const quern_real *restrict following = w->s->use[GATHER_FOLLOWING].real[0] + begin;
	for (uint32_t k = 0; k < dim; k++) {
		quern_real *restrict l = m->gradient[(dim + 1) * k], *restrict kept = m->kept[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			kept[i] = l[i];
			l[i] -= following[i] / dim;
		}
	}
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) m->density[i] *= 1 + w->s->dt * following[i];
}

static void call_material(const gather_work *w, gather_memory *m, uint32_t begin, uint32_t n) {
	const quern_bound *material = &w->s->slot[SLOT_MATERIAL][0];
	const quern_column *u = w->s->use;
	const uint32_t dim = w->s->dim;
	quern_column own[QUERN_MOST_USES];
	quern_material_batch b = { .n = n,
		.cap = STENCIL,
		.dt = w->s->dt,
		.grid_density = m->grid_density,
		.density = m->density,
		.use = own,
		.mean_pressure = w->p->alone  ? u[GATHER_AROUND].real[0] + begin
						 : w->answers ? m->mean_pressure
									  : NULL };
	for (uint32_t k = 0; k < dim * dim; k++) b.gradient[k] = m->gradient[k];
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, dim); k++)
		b.stress[k] = u[GATHER_STRESS].real[k] + begin;
	if (u[GATHER_WAVE].real[0]) b.wave_speed = u[GATHER_WAVE].real[0] + begin;
	if (u[GATHER_ENERGY].real[0]) b.energy = u[GATHER_ENERGY].real[0] + begin;
	for (uint32_t r = 0; r < material->n_uses; r++)
		own[r] = quern_column_from(material->column[r], material->uses[r].shape, begin);
	((const quern_material_ops *)material->ops)->update[dim - 2](material->self, &b);
}

/* Whether the points from i to `end` of a chunk are all finite, keep a volume and go no farther than a cell. */
QUERN_INLINE bool are_sound(
	const gather_work *w, const gather_memory *m, uint32_t begin, uint32_t i, uint32_t end, const int dim) {
	const quern_column *u = w->s->use;
	const quern_real most = w->g->cell / w->s->dt, *restrict volume = u[GATHER_VOLUME].real[0] + begin;
	const int parts = dim == 3 ? 6 : 3;
	const quern_real *stress[6], *velocity[3];
	for (int k = 0; k < parts; k++) stress[k] = u[GATHER_STRESS].real[k] + begin;
	for (int k = 0; k < dim; k++) velocity[k] = m->trip.pic[k];
	int unsound = 0;
	for (; i < end; i++) {
		quern_real speed2 = 0, sum = volume[i];
		for (int k = 0; k < dim; k++) speed2 += velocity[k][i] * velocity[k][i];
		for (int k = 0; k < parts; k++) sum += fabs(stress[k][i]);
		unsound |= !(speed2 <= most * most) | !(sum < INFINITY) | !(volume[i] > 0);
	}
	return !unsound;
}

/* What the material left: volume from its density, what is stored for others, and whether all is sound. */
QUERN_INLINE void finish_chunk(
	const gather_work *w, const gather_memory *m, uint32_t b, uint32_t begin, uint32_t n, const int axes) {
	const quern_column *u = w->s->use;
	const uint32_t dim = (uint32_t)axes;
	const quern_real *restrict mass = u[GATHER_MASS].real[0] + begin, *restrict density = m->density,
							   *restrict moved = m->moved;
	quern_real *restrict volume = u[GATHER_VOLUME].real[0] + begin;
	/* whatever a material makes of a negative density, a point that was turned inside out stays so */
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) volume[i] = moved[i] > 0 ? mass[i] / density[i] : moved[i];
	const quern_real(*given)[STENCIL] = w->p->matrix ? m->fit.affine : m->gradient;
	for (uint32_t k = 0; k < dim * dim && u[GATHER_GRADIENT].real[0]; k++)
		memcpy(u[GATHER_GRADIENT].real[k] + begin, m->gradient[k], n * sizeof(quern_real));
	for (uint32_t k = 0; k < dim * dim && u[GATHER_AFFINE].real[0]; k++)
		memcpy(u[GATHER_AFFINE].real[k] + begin, given[k], n * sizeof(quern_real));
	for (uint32_t i = 0; i < n && u[GATHER_PRESSURE].real[0]; i++) {
		quern_real trace = 0;
		for (uint32_t k = 0; k < dim; k++) trace += u[GATHER_STRESS].real[k][begin + i];
		u[GATHER_PRESSURE].real[0][begin + i] = -trace / dim;
	}
	if (are_sound(w, m, begin, 0, n, axes)) return;
	for (uint32_t i = 0; i < n && w->bad[b] < 0; i++)
		if (!are_sound(w, m, begin, i, i + 1, axes)) w->bad[b] = (int32_t)(begin + i);
}

QUERN_INLINE void gather_block(
	const gather_work *w, gather_memory *m, uint32_t b, const int dim, const bool last) {
	quern_real *const *x = w->s->use[GATHER_POSITION].real;
	const uint32_t begin = w->point[b], end = w->point[b + 1];
	if (begin == end) return;
	quern_tile_load(w->g, w->motion, b, m->tile);
	if (last) speak_for_others(w, m);
	trips_begin_block(&w->trips, &m->trip, b, last);
	if (last && (w->answers || w->counts)) level_block(w, m, b, dim);
	for (uint32_t i = begin; i < end; i += STENCIL) {
		const uint32_t n = end - i < STENCIL ? end - i : STENCIL;
		stencil_make(w->g, &w->s->slot[SLOT_SHAPE][0], b, x, i, NULL, n, &m->trip.stencil);
		collect_chunk(w, m, n, dim, last);
		if (last && w->p->matrix) fit_chunk(w, m, n, dim);
		call_transfer(w, m, i, n, last);
		for (uint32_t k = 0; k < n && !last; k++)
			trips_send(&w->trips, &m->trip, k, cloud_mass(&w->points, i + k), dim);
		if (!last) continue;
		for (uint32_t k = 0; k < n && w->calm.part; k++)
			calm_note(
				&w->calm, k, i + k, m->gradient, m->trip.pic, w->s->use[GATHER_VELOCITY].real, (uint32_t)dim);
		move_chunk(w, m, b, i, n, dim);
		if (w->answers) answer_chunk(w, m, b, i, n, dim);
		if (w->counts) measure_chunk(w, m, b, i, n, dim);
		if (w->p->alone) follow_chunk(w, m, i, n);
		call_material(w, m, i, n);
		for (int k = 0; k < dim && (w->answers || w->p->alone); k++)
			memcpy(m->gradient[(dim + 1) * k], m->kept[k], n * sizeof(quern_real));
		finish_chunk(w, m, b, i, n, dim);
	}
	if (last && w->calm.part)
		calm_block(
			&w->calm, &w->points, NULL, begin, end - begin, w->s->use[GATHER_VELOCITY].real, (uint32_t)dim);
	trips_end_block(&w->trips, &m->trip, b, last);
}

static void run_block(void *arg, uint32_t b, uint32_t worker, bool last) {
	const gather_work *w = arg;
	gather_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m) w->bad[b] = 0;
	else if (w->s->dim == 2) {
		if (last) gather_block(w, m, b, 2, true);
		else gather_block(w, m, b, 2, false);
	} else if (last) gather_block(w, m, b, 3, true);
	else gather_block(w, m, b, 3, false);
}
static void gather_one(void *arg, uint32_t b, uint32_t worker) { run_block(arg, b, worker, true); }
static void send_one(void *arg, uint32_t b, uint32_t worker) { run_block(arg, b, worker, false); }

static quern_status lost(const gather_work *w, int32_t i) {
	const quern_step *s = w->s;
	const quern_column *u = s->use;
	const quern_real volume = u[GATHER_VOLUME].real[0][i], x = u[GATHER_POSITION].real[0][i],
					 y = u[GATHER_POSITION].real[1][i];
	const char *material = s->slot[SLOT_MATERIAL][0].id;
	const quern_real v2 = cloud_square(&u[GATHER_VELOCITY], (uint32_t)i, s->dim);
	quern_real stress = 0;
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, s->dim); k++)
		stress += fabs(u[GATHER_STRESS].real[k][i]);
	if (!isfinite(v2))
		return s->host->stop(s->run, QUERN_E_NUMERIC, "point", i,
			"point.velocity is not a number after %s: is the step of %.3g s too long?", material, s->dt);
	if (!(volume > 0 && volume < INFINITY))
		return s->host->stop(s->run, QUERN_E_NUMERIC, "point", i,
			"point.volume at (%.4g, %.4g) m is turned inside out by one step of %.3g s (%s): unstable, or "
			"the step is "
			"too long",
			x, y, s->dt, material);
	if (!isfinite(stress))
		return s->host->stop(s->run, QUERN_E_NUMERIC, "point", i,
			"point.stress at (%.4g, %.4g) m is not a number after %s: is the step of %.3g s too long?", x, y,
			material, s->dt);
	return s->host->stop(s->run, QUERN_E_NUMERIC, "point", i,
		"at (%.4g, %.4g) m, point.velocity %.3g m/s, goes farther than a cell in one step of %.3g s (%s): "
		"unstable, or "
		"the step is too long",
		x, y, sqrt(v2), s->dt, material);
}

quern_status quern_mpm_gather(const void *self, const quern_step *s) {
	const quern_set_view points = s->host->set(s->run, "point");
	const mpm *p = self;
	gather_work w = { .p = p,
		.s = s,
		.g = s->host->grid(s->run),
		.point = points.block,
		.points = { .mass = s->use[GATHER_MASS].real[0], .weight = s->use[GATHER_WEIGHT].real[0] },
		.motion = (const quern_row *)(const void *)s->use[GATHER_MOTION].real[0] };
	w.trips = (trips) { .s = s,
		.g = w.g,
		.transfer = &s->slot[SLOT_TRANSFER][0],
		.node = (const quern_row *)(const void *)s->use[GATHER_NODE].real[0] };
	if (!points.n) return QUERN_OK;
	w.bad = s->host->memory(s->run, w.g->n_blocks * sizeof(int32_t));
	w.moved = s->host->memory(s->run, w.g->n_blocks * sizeof(int32_t));
	w.full = s->use[GATHER_FULL].real[0] ? dead_band * s->use[GATHER_FULL].real[0][0] : 0;
	w.answers = p->rest_rate > 0 && w.full > 0 && s->use[GATHER_CROWDING].real[0];
	w.counts = p->alone && s->use[GATHER_UNCOUNTED].index[0] == 1;
	w.still = p->alone ? flowing_alone * p->rest_alone : flowing * p->rest_rate;
	const quern_real part = calm_rate * w.p->rest_rate * s->dt;
	w.calm = (calm) { .rate = w.p->rest_rate, .share = part / (1 + part) };
	if (!w.bad || !w.moved || calm_init(&w.calm, s, points.n) != QUERN_OK) return QUERN_E_MEMORY;
	for (uint32_t b = 0; b < w.g->n_blocks; b++) w.bad[b] = -1;
	if (trips_run(&w.trips, send_one, &w) != QUERN_OK) return QUERN_E_MEMORY;
	s->host->parallel(s->run, w.g->n_blocks, gather_one, &w);
	for (uint32_t q = 0; q < w.g->n_blocks; q++)
		if (w.bad[quern_nth(w.g->by_place, q)] >= 0) return lost(&w, w.bad[quern_nth(w.g->by_place, q)]);
	for (uint32_t b = 0; b < w.g->n_blocks; b++)
		if (w.moved[b]) s->use[GATHER_UNSORTED].index[0] = 1;
	return QUERN_OK;
}
