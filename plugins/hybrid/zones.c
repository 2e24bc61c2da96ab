/* SPDX-License-Identifier: MIT */
/* zones - oracles mark a surface, the distance inwards from it is made once for each, they wish, and the least
 * continuous wish becomes a zone, with hysteresis and one step at a time */
#include "update.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = QUERN_BLOCK_CELLS };

/* ---- distances, by spreading from the sources: the nearest first ---- */

typedef struct {
	quern_real distance;
	uint32_t cell, place; /* its entry; where it comes in the order of places */
} heap_entry;

typedef struct {
	const update *d;
	heap_entry *heap;
	size_t n, cap;
	quern_real *distance; /* by cell */
	int32_t (*way)[3];    /* by cell: to its source, in cells */
	uint32_t *place;      /* by block, in the order of places; NULL: as they come */
	bool boxes;           /* the source is a whole cell, not its centre */
	bool walls;           /* nothing goes through a body */
	quern_real most;      /* m: what is farther away nobody asks for */
	const bool *asked;    /* by cell; NULL: all are asked for */
	uint32_t left;        /* of those, not reached yet */
	bool *reached;        /* by cell: nothing comes nearer any more; NULL: what comes later may be nearer */
	bool failed;
} spreading;

static bool sooner(heap_entry a, heap_entry b) {
	return a.distance != b.distance ? a.distance < b.distance : a.place < b.place;
}

static void push(spreading *p, heap_entry e) {
	if (p->n == p->cap) {
		p->cap = p->cap ? 2 * p->cap : 1024;
		heap_entry *grown = realloc(p->heap, p->cap * sizeof(heap_entry));
		if (!grown) {
			p->failed = true;
			return;
		}
		p->heap = grown;
	}
	size_t i = p->n++;
	for (; i && sooner(e, p->heap[(i - 1) / 2]); i = (i - 1) / 2) p->heap[i] = p->heap[(i - 1) / 2];
	p->heap[i] = e;
}

static heap_entry pop(spreading *p) {
	const heap_entry top = p->heap[0], last = p->heap[--p->n];
	size_t i = 0;
	for (size_t k = 1; k < p->n; k = 2 * i + 1) {
		if (k + 1 < p->n && sooner(p->heap[k + 1], p->heap[k])) k++;
		if (!sooner(p->heap[k], last)) break;
		p->heap[i] = p->heap[k];
		i = k;
	}
	if (p->n) p->heap[i] = last;
	return top;
}

static quern_real length_of(const spreading *p, const int32_t way[3]) {
	quern_real sum = 0;
	for (uint32_t k = 0; k < p->d->g->dim; k++) {
		quern_real x = abs(way[k]);
		if (p->boxes) x = x > 0.5 ? x - 0.5 : 0;
		sum += x * x;
	}
	return sqrt(sum) * p->d->g->cell;
}

static void offer(spreading *p, uint32_t cell, const int32_t way[3]) {
	const quern_real distance = length_of(p, way);
	if (!(distance < p->distance[cell]) || (p->reached && p->reached[cell])) return;
	p->distance[cell] = distance;
	memcpy(p->way[cell], way, sizeof p->way[cell]);
	push(p, (heap_entry) { distance, cell, p->place ? p->place[cell / N] * N + cell % N : cell });
}

/* Whether a body stands between two cells beside each other. */
static bool is_walled(
	const update *d, uint32_t from, const int32_t cell[3], uint32_t to, const int32_t beside[3]) {
	quern_real a[3], b[3];
	if (d->wall[from] >= 2 * d->g->cell) return false;
	quern_hybrid_open_place(d, from, cell, a);
	quern_hybrid_open_place(d, to, beside, b);
	return quern_hybrid_walled(d, NULL, from, a, b);
}

/* `open` NULL: through every cell; otherwise only through those that are set. */
static void spread(spreading *p, const bool *open) {
	const int depth = p->d->g->dim == 3 ? 1 : 0;
	while (p->n && !p->failed) {
		const heap_entry e = pop(p);
		quern_grid_cursor home = { .block = (int32_t)(e.cell / N) };
		int32_t cell[3];
		memcpy(home.at, p->d->g->at[home.block], sizeof home.at);
		if (e.distance > p->most) break;
		if (e.distance > p->distance[e.cell] || !quern_grid_cell_of(p->d->g, e.cell, cell)) continue;
		if (p->reached) p->reached[e.cell] = true;
		if (p->asked && p->asked[e.cell] && !--p->left) break;
		for (int z = -depth; z <= depth; z++)
			for (int y = -1; y <= 1; y++)
				for (int x = -1; x <= 1; x++) {
					const int step[3] = { x, y, z };
					int32_t to[3], beside[3];
					int32_t way[3];
					for (uint32_t k = 0; k < 3; k++) {
						to[k] = beside[k] = cell[k] + step[k];
						way[k] = p->way[e.cell][k] - step[k];
					}
					quern_grid_cursor near = home;
					if (!quern_grid_bring_back(p->d->g, to)) continue;
					const int32_t c = quern_grid_entry_near(p->d->g, &near, to);
					if (c < 0 || (open && !open[c])) continue;
					if (p->walls && is_walled(p->d, e.cell, cell, (uint32_t)c, beside)) continue;
					offer(p, (uint32_t)c, way);
				}
	}
}

static bool spreading_init(spreading *p, update *d, bool boxes, quern_real *distance) {
	*p = (spreading) { .d = d, .distance = distance, .boxes = boxes, .most = INFINITY };
	p->way = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof *p->way);
	if (d->g->by_place) p->place = d->s->host->memory(d->s->run, d->g->n_blocks * sizeof(uint32_t));
	if (!p->way || !distance || !p->place != !d->g->by_place) return false;
	for (uint32_t q = 0; p->place && q < d->g->n_blocks; q++) p->place[d->g->by_place[q]] = q;
	for (uint32_t c = 0; c < d->n_cells; c++) distance[c] = INFINITY;
	return true;
}

/* Distance is that of the straight line and not of the way, which is longer round a body: who comes first stays,
 * mostly the one with the shortest way, and the answer for one cell does not depend on who else asks. */
quern_status quern_hybrid_nearest(
	update *d, const bool *source, const bool *through, const bool *asked, int32_t *nearest) {
	spreading p;
	quern_real *distance = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof(quern_real));
	if (!spreading_init(&p, d, false, distance)) return QUERN_E_MEMORY;
	p.walls = true;
	p.asked = asked;
	p.reached = d->s->host->memory(d->s->run, (size_t)d->n_cells + 1);
	if (!p.reached) return QUERN_E_MEMORY;
	for (uint32_t c = 0; c < d->n_cells; c++) p.left += asked[c];
	for (uint32_t c = 0; c < d->n_cells; c++)
		if (source[c]) offer(&p, c, (const int32_t[3]) { 0, 0, 0 });
	spread(&p, through);
	for (uint32_t c = 0; c < d->n_cells; c++) {
		int32_t cell[3];
		nearest[c] = -1;
		if (!asked[c] || !p.reached[c] || !quern_grid_cell_of(d->g, c, cell)) continue;
		for (uint32_t k = 0; k < d->g->dim; k++) cell[k] += p.way[c][k];
		nearest[c] = quern_grid_entry_back(d->g, cell);
	}
	free(p.heap);
	return p.failed ? QUERN_E_MEMORY : QUERN_OK;
}

quern_status quern_hybrid_distance(update *d, const bool *source, const bool *through, quern_real *distance) {
	spreading p;
	if (!spreading_init(&p, d, true, distance)) return QUERN_E_MEMORY;
	for (uint32_t c = 0; c < d->n_cells; c++)
		if (source[c]) offer(&p, c, (const int32_t[3]) { 0, 0, 0 });
	spread(&p, through);
	free(p.heap);
	return p.failed ? QUERN_E_MEMORY : QUERN_OK;
}

/* ---- the surface of one oracle ---- */

typedef struct {
	uint32_t flags, faces;          /* what counts, and beyond which faces of the domain it is open */
	uint32_t looks;                 /* ways that surface with open space must look */
	const bool *meant;              /* by body: those that it means; NULL: all */
	const quern_real *gap;          /* by cell: to these, NULL if nobody wants to know */
	bool *outside, *solid, *inside; /* by cell */
	uint32_t *queue;
	quern_real most; /* m: beyond, the oracle's answer is the same at any distance */
	bool found;      /* there is any */
} surface;

/* Where changes are limited the farthest cells come last: all distances are asked for. */
static quern_real reach_of(const update *d, const quern_bound *oracle) {
	const quern_oracle_ops *ops = oracle->ops;
	if (!ops->reach || d->h->most_changes < 1) return INFINITY;
	return ops->reach(oracle->self) + 0.5 * d->h->hysteresis * d->h->diameter;
}

/* What lies one step from a cell: another one, open space, a closed face of the domain, or a wall, which may stand
 * between two cells: one that counts as surface where walls do, or another. */
enum { BESIDE_CELL, BESIDE_OPEN, BESIDE_WALL, BESIDE_NOTHING };

static int beside(const update *d, const surface *f, uint32_t c, const int32_t cell[3], uint32_t axis,
	int step, int32_t *entry) {
	const int32_t other = cell[axis] + step;
	quern_real from[3], to[3];
	*entry = cell_beside(d, c, axis, step);
	quern_hybrid_centre(d, cell, from);
	quern_hybrid_centre(d, cell, to);
	to[axis] += step * d->g->cell;
	if (quern_hybrid_walled(d, NULL, c, from, to))
		return !f->meant || quern_hybrid_walled(d, f->meant, c, from, to) ? BESIDE_WALL : BESIDE_NOTHING;
	if (*entry >= 0) return BESIDE_CELL;
	const bool beyond = !d->g->periodic[axis] && (other < 0 || other >= d->g->cells[axis]);
	return !beyond || f->faces >> (2 * axis + (step > 0)) & 1 ? BESIDE_OPEN : BESIDE_NOTHING;
}

/* Outside is what the open boundary reaches through cells that are marked so; a void within does not count. */
static void flood(const update *d, surface *f, const quern_real *level) {
	uint32_t n = 0;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		int32_t cell[3], other;
		bool open = false;
		if (!quern_grid_cell_of(d->g, c, cell) || f->solid[c] || level[c] > 0) continue;
		for (uint32_t k = 0; k < d->g->dim; k++)
			for (int step = -1; step <= 1; step += 2)
				open = open || beside(d, f, c, cell, k, step, &other) == BESIDE_OPEN;
		if (open) f->outside[c] = true, f->queue[n++] = c;
	}
	for (uint32_t q = 0; q < n; q++) {
		int32_t cell[3], c;
		quern_grid_cell_of(d->g, f->queue[q], cell);
		for (uint32_t k = 0; k < d->g->dim; k++)
			for (int step = -1; step <= 1; step += 2) {
				if (beside(d, f, f->queue[q], cell, k, step, &c) != BESIDE_CELL) continue;
				if (f->outside[c] || f->solid[c] || level[c] > 0) continue;
				f->outside[c] = true;
				f->queue[n++] = (uint32_t)c;
			}
	}
}

static void find_sides(const update *d, surface *f, const quern_real *level) {
	const bool floods = f->flags & QUERN_SURFACE_FLOOD && !(f->flags & QUERN_SURFACE_VOIDS);
	int32_t cell[3];
	for (uint32_t c = 0; c < d->n_cells; c++) {
		if (!quern_grid_cell_of(d->g, c, cell)) continue;
		f->solid[c] = d->open[c] == 0;
		if (!floods) f->outside[c] = !f->solid[c] && level[c] <= 0;
	}
	if (floods) flood(d, f, level);
	for (uint32_t c = 0; c < d->n_cells; c++) f->inside[c] = !f->outside[c] && !f->solid[c];
}

/* Whether a cell lies in a body that is meant. */
static bool is_meant(const update *d, const surface *f, int32_t c) {
	return f->solid[c] && (!f->meant || f->gap[c] <= d->wall[c]);
}

/* Whether there is surface between a cell inside and what lies one step from it. */
static bool is_surface(
	const update *d, const surface *f, uint32_t c, const int32_t cell[3], uint32_t axis, int step) {
	const bool looks = f->looks >> (2 * axis + (step > 0)) & 1;
	int32_t other;
	switch (beside(d, f, c, cell, axis, step, &other)) {
	case BESIDE_OPEN: return looks && f->flags & QUERN_SURFACE_FLOOD;
	case BESIDE_WALL: return f->flags & QUERN_SURFACE_WALLS;
	case BESIDE_NOTHING: return false;
	default: return (looks && f->outside[other]) || (f->flags & QUERN_SURFACE_WALLS && is_meant(d, f, other));
	}
}

static void begin_at_surface(spreading *p, const surface *f) {
	const update *d = p->d;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		int32_t cell[3];
		if (!f->inside[c] || !quern_grid_cell_of(d->g, c, cell)) continue;
		for (uint32_t k = 0; k < d->g->dim; k++)
			for (int step = -1; step <= 1; step += 2) {
				int32_t way[3] = { 0 };
				way[k] = step;
				if (is_surface(d, f, c, cell, k, step)) offer(p, c, way);
			}
	}
}

/* What an oracle means by surface; `gap` is room for one number per cell. */
static bool surface_init(surface *f, update *d, const quern_bound *oracle, quern_real *gap) {
	const quern_step *s = d->s;
	const quern_oracle_ops *ops = oracle->ops;
	const uint32_t bodies = s->n_slot[SLOT_BODIES], wants = ops->wants ? ops->wants(oracle->self) : 0;
	bool *meant = ops->means ? s->host->memory(s->run, bodies + 1u) : NULL;
	*f = (surface) { .flags = ops->surface ? ops->surface(oracle->self) : 0,
		.faces = ops->faces ? ops->faces(oracle->self) : ~0u,
		.looks = ops->looks ? ops->looks(oracle->self) : ~0u,
		.most = reach_of(d, oracle),
		.meant = meant,
		.outside = s->host->memory(s->run, d->n_cells + 1u),
		.solid = s->host->memory(s->run, d->n_cells + 1u),
		.inside = s->host->memory(s->run, d->n_cells + 1u),
		.queue = s->host->memory(s->run, ((size_t)d->n_cells + 1) * sizeof(uint32_t)) };
	if (!f->outside || !f->solid || !f->inside || !f->queue || !meant != !ops->means) return false;
	bool all = true;
	for (uint32_t b = 0; meant && b < bodies; b++) all &= meant[b] = ops->means(oracle->self, b);
	if (all) f->meant = NULL; /* as if nothing had been said */
	if (f->meant) f->gap = gap;
	else if (wants & QUERN_ORACLE_GAP) f->gap = d->wall;
	return !f->meant || quern_hybrid_gaps(d, f->meant, gap) == QUERN_OK;
}

/* Distance of a cell's centre to the nearest cell outside, infinite where it is more than an oracle can ask for. */
static quern_status surface_distance(update *d, surface *f, const quern_real *level, quern_real *distance) {
	spreading p;
	if (!spreading_init(&p, d, true, distance)) return QUERN_E_MEMORY;
	p.most = f->most;
	find_sides(d, f, level);
	begin_at_surface(&p, f);
	f->found = p.n;
	spread(&p, f->inside);
	for (uint32_t c = 0; c < d->n_cells; c++)
		distance[c] = !f->inside[c] ? 0 : distance[c] > f->most ? INFINITY : distance[c];
	free(p.heap);
	return p.failed ? QUERN_E_MEMORY : QUERN_OK;
}

/* ---- asking the oracles ---- */

typedef struct {
	_Alignas(64) quern_real centre[3][N], shifted[N], gap[N], weight[N];
	int32_t marked[N];
} oracle_memory;

/* Bit of an oracle in what cells remember of marks, 0 for those that the field has no room for. */
static int32_t mark_of(const update *d, const quern_bound *oracle) {
	const ptrdiff_t o = oracle - d->s->slot[SLOT_ORACLE];
	return o < 31 ? (int32_t)(1u << o) : 0;
}

/* Once an oracle has been asked for levels, `distance` is known. */
static void ask(const update *d, const quern_bound *oracle, uint32_t b, const quern_real *distance,
	const quern_real *gap, quern_real shift, oracle_memory *m, quern_real *level, int32_t *wish) {
	const quern_oracle_ops *ops = oracle->ops;
	const uint32_t wants = ops->wants ? ops->wants(oracle->self) : 0;
	const int32_t *marked = wants & QUERN_ORACLE_MARKED && !distance ? d->u[U_MARKED].index : NULL;
	quern_column own[QUERN_MOST_USES];
	quern_cell_batch batch = { .n = N,
		.cap = N,
		.dim = d->s->dim,
		.cell = d->g->cell,
		.zone = d->u[U_ZONE].index + (size_t)b * N,
		.use = own,
		.level = level,
		.wish = wish,
		.time = d->s->time,
		.dt = d->s->dt,
		.gap = wants & QUERN_ORACLE_GAP ? m->gap : NULL,
		.weight = distance && wants & QUERN_ORACLE_WEIGHT ? m->weight : NULL,
		.marked = marked ? m->marked : NULL };
	for (uint32_t k = 0; k < 3; k++) batch.gravity[k] = d->s->gravity[k];
	for (uint32_t i = 0; i < N; i++) {
		int32_t cell[3];
		quern_real x[3];
		quern_grid_cell_of(d->g, b * N + i, cell);
		quern_hybrid_centre(d, cell, x);
		for (uint32_t k = 0; k < 3; k++) m->centre[k][i] = x[k];
		if (distance) m->shifted[i] = distance[b * N + i] + shift;
		if (gap) m->gap[i] = gap[b * N + i] + shift;
		m->weight[i] = -1;
		if (marked) m->marked[i] = d->mass[b * N + i] > 0 && marked[b * N + i] & mark_of(d, oracle);
	}
	for (uint32_t k = 0; k < d->s->dim; k++) batch.centre[k] = m->centre[k];
	if (distance) batch.distance = m->shifted;
	for (uint32_t r = 0; r < oracle->n_uses; r++)
		own[r] = quern_column_from(oracle->column[r], oracle->uses[r].shape, b * N);
	if (distance) ops->decide(oracle->self, &batch);
	else ops->mark(oracle->self, &batch);
}

/* By cell, of the oracle that is asked and of all together. */
typedef struct {
	quern_real *level, *distance, *gap;
	int32_t *low,
		*high; /* the zone wished for half the hysteresis nearer to the surface, and half of it deeper */
} wish_cells;

/* Shares are asked for where the surface is; the least of all oracles wins, as their wishes do. */
static void ask_shares(
	const update *d, const quern_bound *oracle, const wish_cells *w, const surface *f, oracle_memory *m) {
	int32_t wish[N];
	for (uint32_t b = 0; b < d->g->n_blocks; b++) {
		quern_real *asked = d->asked + (size_t)b * N;
		ask(d, oracle, b, w->distance, f->gap, 0, m, NULL, wish);
		for (uint32_t i = 0; i < N; i++)
			if (m->weight[i] >= 0 && !(asked[i] >= 0 && asked[i] <= m->weight[i])) asked[i] = m->weight[i];
	}
}

/* At the first update, of an oracle that looks for open space: without any there is no surface, and all becomes continuum. */
static void warn_of_closed(const update *d, const quern_bound *oracle, const surface *f) {
	bool any = false;
	for (uint32_t c = 0; c < d->n_cells && !any; c++) any = f->inside[c] && d->mass[c] > 0;
	if (!any || f->found || !(f->flags & QUERN_SURFACE_FLOOD) || d->u[U_UPDATES].index[0]) return;
	d->s->host->log(d->s->run, 2,
		"%s finds no surface: no open space reaches the material%s, so all becomes continuum; in a "
		"closed vessel let voids count (oracle.packing_fraction: voids)",
		oracle->id, f->looks == ~0u ? "" : " from where it looks");
}

/* What an oracle has marked, for its next time. */
static void remember(const update *d, const quern_bound *oracle, const quern_real *level) {
	const quern_oracle_ops *ops = oracle->ops;
	int32_t *marked = d->u[U_MARKED].index;
	const int32_t bit = mark_of(d, oracle);
	if (!ops->wants || !(ops->wants(oracle->self) & QUERN_ORACLE_MARKED)) return;
	for (uint32_t c = 0; c < d->n_cells; c++)
		marked[c] = d->mass[c] > 0 && level[c] <= 0 ? marked[c] | bit : marked[c] & ~bit;
}

/* Levels become their means over so many cells along each axis, by what is open of them. The grid's blocks have sides of 8 or 4
 * cells, so that none of these lies in two. */
static void average_levels(const update *d, quern_real *level) {
	const uint32_t k = (uint32_t)d->h->oracle_cells, edge = d->g->edge;
	for (uint32_t b = 0; b < d->g->n_blocks && k > 1; b++) {
		quern_real sum[N] = { 0 }, open[N] = { 0 };
		uint32_t home[N];
		for (uint32_t i = 0; i < N; i++) {
			const uint32_t c = b * N + i, x = i % edge, y = i / edge % edge, z = i / (edge * edge);
			int32_t cell[3];
			home[i] = (x - x % k) + edge * (y - y % k) + edge * edge * (z - z % k);
			if (!quern_grid_cell_of(d->g, c, cell)) continue;
			sum[home[i]] += d->open[c] * level[c];
			open[home[i]] += d->open[c];
		}
		for (uint32_t i = 0; i < N; i++)
			if (open[home[i]] > 0) level[b * N + i] = sum[home[i]] / open[home[i]];
	}
}

/* A zone between the two that are wished for stays. */
static quern_status wishes(update *d, const quern_bound *oracle, const wish_cells *w) {
	const quern_oracle_ops *ops = oracle->ops;
	const quern_real half = 0.5 * d->h->hysteresis * d->h->diameter, *distance = w->distance;
	int32_t wish[N];
	surface f;
	if (!surface_init(&f, d, oracle, w->gap)) return QUERN_E_MEMORY;
	oracle_memory *m = d->s->host->scratch(d->s->run, 0, sizeof *m);
	if (!m) return QUERN_E_MEMORY;
	for (uint32_t b = 0; b < d->g->n_blocks; b++)
		ask(d, oracle, b, NULL, f.gap, 0, m, w->level + (size_t)b * N, NULL);
	remember(d, oracle, w->level);
	average_levels(d, w->level);
	const quern_status status = surface_distance(d, &f, w->level, w->distance);
	if (status != QUERN_OK) return status;
	for (uint32_t c = 0; c < d->n_cells; c++)
		if (distance[c] < d->near[c]) d->near[c] = distance[c];
	warn_of_closed(d, oracle, &f);
	for (uint32_t b = 0; b < d->g->n_blocks; b++)
		for (int side = 0; side < 2; side++) {
			int32_t *out = (side ? w->high : w->low) + (size_t)b * N;
			ask(d, oracle, b, distance, f.gap, side ? half : -half, m, NULL, wish);
			for (uint32_t i = 0; i < N; i++) {
				const int32_t zone = distance[b * N + i] > 0 ? wish[i] : QUERN_DISCRETE;
				out[i] = zone < out[i] ? zone : out[i];
			}
		}
	if (d->asked && ops->wants && ops->wants(oracle->self) & QUERN_ORACLE_WEIGHT)
		ask_shares(d, oracle, w, &f, m);
	return QUERN_OK;
}

quern_status quern_hybrid_zones(update *d) {
	const quern_step *s = d->s;
	const size_t n = (size_t)d->n_cells + 1;
	const wish_cells w = { .level = s->host->memory(s->run, n * sizeof(quern_real)),
		.distance = s->host->memory(s->run, n * sizeof(quern_real)),
		.gap = s->host->memory(s->run, n * sizeof(quern_real)),
		.low = s->host->memory(s->run, n * sizeof(int32_t)),
		.high = s->host->memory(s->run, n * sizeof(int32_t)) };
	d->near = s->host->memory(s->run, n * sizeof(quern_real));
	if (!w.level || !w.distance || !w.gap || !w.low || !w.high || !d->near) return QUERN_E_MEMORY;
	if (d->h->ramped) d->asked = s->host->memory(s->run, n * sizeof(quern_real));
	if (d->h->ramped && !d->asked) return QUERN_E_MEMORY;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		w.low[c] = w.high[c] = QUERN_CONTINUUM;
		d->near[c] = INFINITY;
		if (d->asked) d->asked[c] = -1;
	}
	for (uint32_t o = 0; o < s->n_slot[SLOT_ORACLE]; o++) {
		const quern_status status = wishes(d, &s->slot[SLOT_ORACLE][o], &w);
		if (status != QUERN_OK) return status;
	}
	d->changed = 0;
	d->wish = w.low;
	for (uint32_t c = 0; c < d->n_cells; c++) {
		const int32_t old = d->u[U_ZONE].index[c];
		int32_t new = old < w.low[c] ? w.low[c] : old > w.high[c] ? w.high[c] : old;
		if (!(d->mass[c] > 0)) new = QUERN_DISCRETE;
		else if (new - old == 2 || old - new == 2) new = QUERN_HYBRID;
		d->zone[c] = new;
		d->changed += new != old;
	}
	return QUERN_OK;
}
