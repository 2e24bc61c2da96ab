/* SPDX-License-Identifier: MIT */
/* enrich - mass owed to the grains becomes grains: a packer places them, the flow around gives them their motion. Cells that
 * do not see each other are packed at once, by all threads; which do is a matter of place alone. */
#include "../common/placer.h"
#include "../common/renew.h"
#include "../common/sort.h"
#include "update.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A cell that is owed grains, those that it shall have, and those that find room. */
typedef struct {
	const struct enriching *all;
	uint32_t c;
	int32_t cell[3];
	quern_real lower[3], upper[3];
	uint32_t first, wanted; /* numbers of its grains, in `numbers` */
	uint32_t whole, most;   /* of these, how many it lacks all of; how many may be placed now */
	new_grain *grain;
	uint32_t n;
	quern_real part; /* of its radius that a grain begins with */
	bool failed;     /* memory ran out */
} packed_cell;

typedef struct enriching {
	update *d;
	placer placer;     /* grains that are there, and those of colours before */
	packed_cell *cell; /* in the order of places */
	uint32_t n;
	int32_t *by_colour; /* numbers of cells */
	uint64_t *colour;   /* by cell */
	int32_t *numbers;   /* of draws: cell after cell */
	uint32_t n_numbers, cap_numbers;
	uint32_t waited, taken; /* numbers that waited before; of these, how many are given to a cell now */
	int32_t fresh;          /* the next number that nobody has had */
	/* grains' kg by cell: what they lack and are not to get yet, below 0 what they have too much; the same of its block, the cell and all that touch it */
	quern_real *rest, *around;
} enriching;

static quern_real mass_of(const hybrid *h, quern_real r) { return quern_radius_mass(r, h->density, h->dim); }

static quern_real radius_of(const update *d, int32_t number) {
	return quern_radius_draw(&d->h->radii, d->s->host, (uint64_t)number);
}

/* ---- whose turn it is ---- */

/* A radius that was drawn stays until its grain is placed, wherever: one that was drawn anew for every cell or every update would come
 * out small too often. Those that found no room wait as entries of a set, and are the next to be given to a cell. */
static int32_t next_number(const enriching *e) {
	const update *d = e->d;
	return e->taken < e->waited ? d->u[U_WAITING].index[e->taken] : e->fresh;
}

static bool take_number(enriching *e) {
	if (e->n_numbers == e->cap_numbers) {
		const uint32_t cap = e->cap_numbers ? 2 * e->cap_numbers : 256;
		int32_t *grown = realloc(e->numbers, cap * sizeof *grown);
		if (!grown) return false;
		e->numbers = grown;
		e->cap_numbers = cap;
	}
	const int32_t number = next_number(e);
	e->numbers[e->n_numbers++] = number;
	if (number == e->fresh) e->fresh++;
	else e->taken++;
	return true;
}

/* What grains carry less than their share of what the cell holds, as far as it has room for that. */
static quern_real lacking(const update *d, uint32_t c) {
	const quern_real all = cell_holds(d, c), room = d->full * (d->open[c] > 0.125 ? d->open[c] : 0.125);
	return grain_share(d, c) * (all < room ? all : room) - d->in_grains[c];
}

/* Sums round: what lacks nothing lacks a last bit or not, and how many cells lack something decides with which one the next update begins. */
static bool lacks_something(const update *d, uint32_t c) {
	return d->zone[c] == QUERN_HYBRID && lacking(d, c) > 1e-9 * d->full;
}

/* Entries of the zone's cells in a block, a cell and those that touch it; how many there are. Along a short periodic axis each comes once. */
static uint32_t block_of(const update *d, uint32_t c, const int32_t cell[3], uint32_t entry[27]) {
	const quern_grid_view *g = d->g;
	quern_grid_cursor home = { .block = (int32_t)(c / QUERN_BLOCK_CELLS) };
	int32_t low[3] = { 0 }, high[3] = { 0 };
	uint32_t n = 0;
	memcpy(home.at, g->at[home.block], sizeof home.at);
	for (uint32_t k = 0; k < g->dim; k++) {
		low[k] = g->periodic[k] && g->cells[k] < 3 ? 0 : -1;
		high[k] = g->periodic[k] && g->cells[k] < 2 ? 0 : 1;
	}
	for (int32_t z = low[2]; z <= high[2]; z++)
		for (int32_t y = low[1]; y <= high[1]; y++)
			for (int32_t x = low[0]; x <= high[0]; x++) {
				int32_t at[3] = { cell[0] + x, cell[1] + y, cell[2] + z };
				quern_grid_cursor near = home;
				const int32_t there = quern_grid_bring_back(g, at) ? quern_grid_entry_near(g, &near, at) : -1;
				if (there >= 0 && d->zone[there] == QUERN_HYBRID) entry[n++] = (uint32_t)there;
			}
	return n;
}

/* In a cell that is too full grains have too much only beyond their share of all that is there. */
static quern_real rest_of(const update *d, uint32_t c) {
	const quern_real share = grain_share(d, c), lacks = lacking(d, c),
					 over = share * cell_holds(d, c) - d->in_grains[c];
	return (lacks > 0 ? lacks : over < 0 ? over : 0) / share;
}

static bool measure_rests(enriching *e) {
	const update *d = e->d;
	const size_t bytes = ((size_t)d->n_cells + 1) * sizeof(quern_real);
	uint32_t near[27];
	int32_t cell[3];
	e->rest = d->s->host->memory(d->s->run, bytes);
	e->around = d->s->host->memory(d->s->run, bytes);
	if (!e->rest || !e->around) return false;
	for (uint32_t c = 0; c < d->n_cells; c++)
		if (d->zone[c] == QUERN_HYBRID) e->rest[c] = rest_of(d, c);
	for (uint32_t c = 0; c < d->n_cells; c++) {
		if (d->zone[c] != QUERN_HYBRID || !quern_grid_cell_of(d->g, c, cell)) continue;
		const uint32_t n = block_of(d, c, cell, near);
		e->around[c] = 0;
		for (uint32_t k = 0; k < n; k++) e->around[c] += e->rest[near[k]];
	}
	return true;
}

/* A cell holds a few grains. If each got one only when a whole one is lacking, all would lack half
 * of one in the mean, an eighth of their grains in 2-D; half a grain too much in each would never be
 * paid back, since none is taken away. So a cell that lacks anything, and holds as much, gets one while its block lacks
 * half of one, unless a block that it is in would have a whole one too many then. Sums round, and
 * where all grains are alike a debt may be just that. */
static bool share_out(enriching *e, packed_cell *p) {
	const update *d = e->d;
	const quern_real rounding = 1e-9, holds = cell_holds(d, p->c);
	uint32_t near[27];
	const uint32_t n = block_of(d, p->c, p->cell, near);
	p->first = e->n_numbers;
	for (;; p->wanted++) {
		const quern_real mass = mass_of(d->h, radius_of(d, next_number(e))), least = rounding * mass;
		bool lacks = holds >= mass && e->rest[p->c] > least && e->around[p->c] > 0.5 * mass + least;
		for (uint32_t k = 0; k < n; k++) lacks = lacks && e->around[near[k]] > least;
		if (!lacks) return true;
		p->whole += e->rest[p->c] > mass - least;
		e->rest[p->c] -= mass;
		for (uint32_t k = 0; k < n; k++) e->around[near[k]] -= mass;
		if (!take_number(e)) return false;
	}
}

/* What waits from now on: what has not been given to any cell, and what has found no room there; first what was drawn first. */
static int by_number(const void *a, const void *b) {
	const int32_t one = *(const int32_t *)a, other = *(const int32_t *)b;
	return (one > other) - (one < other);
}

static quern_status put_back(const enriching *e) {
	const update *d = e->d;
	const quern_step *s = d->s;
	int32_t *number = s->host->memory(s->run, ((size_t)e->waited + e->n_numbers + 1) * sizeof *number);
	int32_t *from = s->host->memory(s->run, ((size_t)e->waited + e->n_numbers + 1) * sizeof *from);
	uint32_t n = 0;
	if (!number || !from) return QUERN_E_MEMORY;
	for (uint32_t q = e->taken; q < e->waited; q++) number[n++] = d->u[U_WAITING].index[q];
	for (uint32_t i = 0; i < e->n; i++)
		for (uint32_t k = e->cell[i].n; k < e->cell[i].wanted; k++)
			number[n++] = e->numbers[e->cell[i].first + k];
	qsort(number, n, sizeof *number, by_number);
	for (uint32_t q = 0; q < n; q++) from[q] = -1;
	const quern_status status = s->host->remap(s->run, "waiting", n, from, 0, NULL);
	for (uint32_t q = 0; q < n && status == QUERN_OK; q++) d->u[U_WAITING].index[q] = number[q];
	d->u[U_DRAWS].index[0] = e->fresh;
	return status;
}

/* ---- what a packer may ask ---- */

/* The grain that waits; a packer that goes on when it has been told to stop gets the last one again. */
static quern_real job_radius(quern_pack_job *job) {
	const packed_cell *p = job->scene;
	const uint32_t k = p->n < p->wanted ? p->n : p->wanted - 1;
	return p->part * radius_of(p->all->d, p->all->numbers[p->first + k]);
}

static bool job_inside(const quern_pack_job *job, const quern_real x[3]) {
	const packed_cell *p = job->scene;
	for (uint32_t k = 0; k < job->dim; k++)
		if (x[k] < p->lower[k] || x[k] >= p->upper[k]) return false;
	return true;
}

static quern_spot spot_of(const new_grain *g) {
	quern_spot spot = { .radius = g->radius };
	memcpy(spot.x, g->position, sizeof spot.x);
	return spot;
}

/* The placer knows the cell's own new grains only once its colour is through. */
static bool job_free(const quern_pack_job *job, const quern_spot *spot) {
	const packed_cell *p = job->scene;
	for (uint32_t i = 0; i < p->n; i++) {
		const quern_spot own = spot_of(&p->grain[i]);
		if (quern_placer_overlaps(&p->all->placer, spot, &own)) return false;
	}
	return quern_placer_free(&p->all->placer, spot) && quern_hybrid_seen(p->all->d, p->c, spot->x);
}

static bool job_place(quern_pack_job *job, const quern_spot *spot) {
	packed_cell *p = job->scene;
	const update *d = p->all->d;
	if (p->n >= p->most) return false;
	if (!p->grain) p->grain = malloc(p->wanted * sizeof(new_grain));
	if (!p->grain) return p->failed = true, false;
	new_grain *g = &p->grain[p->n++];
	*g = (new_grain) { .radius = spot->radius,
		.mass = mass_of(d->h, radius_of(d, p->all->numbers[p->first + p->n - 1])),
		.weight = grain_share(d, p->c),
		.cell = (int32_t)p->c };
	memcpy(g->position, spot->x, sizeof g->position);
	return p->n < p->most;
}

/* ---- one cell ---- */

/* New grains move as what is around them does; what they carry is owed no longer. */
static void settle(packed_cell *p) {
	update *d = p->all->d;
	for (uint32_t i = 0; i < p->n; i++) {
		const quern_real m = p->grain[i].weight * p->grain[i].mass;
		quern_hybrid_motion(d, &p->grain[i]);
		quern_hybrid_book(d, p->c, -m, p->grain[i].velocity);
		d->in_grains[p->c] += m;
	}
}

/* Unit vector towards the neighbours that are pure continuum; zero if there are none, or all around. */
static void find_upstream(const update *d, uint32_t cell, quern_real upstream[3]) {
	quern_real length = 0;
	for (uint32_t k = 0; k < d->s->dim; k++) {
		for (int step = -1; step <= 1; step += 2) {
			const int32_t c = cell_beside(d, cell, k, step);
			if (c >= 0 && d->zone[c] == QUERN_CONTINUUM) upstream[k] += step;
		}
		length += upstream[k] * upstream[k];
	}
	for (uint32_t k = 0; k < d->s->dim && length > 0; k++) upstream[k] /= sqrt(length);
}

/* Grains around a cell, and room for its own, which are among them when the packer is asked again. */
static quern_spot *find_seeds(const packed_cell *p, uint32_t *n) {
	quern_spot *seed = quern_placer_seeds_in_order(
		&p->all->placer, p->lower, p->upper, 2 * quern_radius_most(&p->all->d->h->radii), n);
	quern_spot *wider = seed ? realloc(seed, ((size_t)*n + p->wanted) * sizeof *seed) : NULL;
	if (!wider) free(seed);
	return wider;
}

/* Whether a cell is full, and its points bear more than the weight of one layer of grains. Without gravity, or points, none is. */
static bool is_pressed(const update *d, uint32_t c) {
	const quern_real pressure = quern_hybrid_points_pressure(d, c, d->u[U_POINT_VOLUME].real[0]),
					 layer = d->h->packed * quern_gravity_size(d->s->dim, d->s->gravity) * d->h->diameter;
	return cell_holds(d, c) > 0.8 * cell_room(d, c) && layer > 0 && pressure > layer;
}

static void enrich_cell(packed_cell *p) {
	const enriching *e = p->all;
	const update *d = e->d;
	const quern_bound *packer = &d->s->slot[SLOT_PACKER][0];
	uint32_t n = 0;
	quern_spot *seed = find_seeds(p, &n);
	if (!seed) {
		p->failed = true;
		return;
	}
	quern_pack_job job = { .dim = d->s->dim,
		.stream = d->h->radii.stream + 1,
		.host = d->s->host,
		.key = (uint64_t)quern_grid_number(d->g, p->cell),
		.counter = (uint64_t)d->u[U_UPDATES].index[0] << 32,
		.seed = seed,
		.n_seed = n,
		.radius = job_radius,
		.inside = job_inside,
		.free = job_free,
		.place = job_place,
		.scene = p };
	memcpy(job.lower, p->lower, sizeof job.lower);
	memcpy(job.upper, p->upper, sizeof job.upper);
	find_upstream(d, p->c, job.upstream);
	const quern_packer_ops *ops = packer->ops;
	const uint32_t again = !(d->h->growth > 0) ? 0 : ops->shrinks ? 1 : 3;
	/* what is rounded up finds room or waits: where nothing presses, grains that are squeezed in would */
	const uint32_t squeezed = again && is_pressed(d, p->c) ? p->wanted : p->whole;
	p->most = p->wanted;
	for (uint32_t k = 0; k <= again && p->n < p->most; k++) {
		static const quern_real parts[] = { 1, 0.85, 0.75, 0.66 };
		p->part = ops->shrinks ? 1 : parts[k];
		job.growth = k && ops->shrinks ? QUERN_GROWS_ALONE : QUERN_STAYS_SMALL;
		for (; job.n_seed < n + p->n; job.n_seed++) seed[job.n_seed] = spot_of(&p->grain[job.n_seed - n]);
		job.counter = ((uint64_t)d->u[U_UPDATES].index[0] << 32) + ((uint64_t)k << 24);
		ops->pack[d->s->dim - 2](packer->self, &job);
		p->most = squeezed;
	}
	free(seed);
	settle(p);
}

static void enrich_one(void *arg, uint32_t i, uint32_t worker) {
	const enriching *e = arg;
	(void)worker;
	enrich_cell(&e->cell[e->by_colour[i]]);
}

/* ---- all cells, colour by colour ---- */

static bool find_cells(enriching *e) {
	const update *d = e->d;
	size_t most = 0;
	for (uint32_t c = 0; c < d->n_cells; c++) most += lacks_something(d, c);
	if (!most) return true;
	e->cell = d->s->host->memory(d->s->run, (most + 1) * sizeof *e->cell);
	if (!e->cell || !measure_rests(e)) return false;
	for (uint32_t q = 0; q < d->n_cells; q++) {
		packed_cell p = { .all = e, .c = nth_cell(d, q) };
		if (!lacks_something(d, p.c) || !quern_grid_cell_of(d->g, p.c, p.cell)) continue;
		for (uint32_t k = 0; k < d->s->dim; k++) {
			p.lower[k] = d->g->lower[k] + p.cell[k] * d->g->cell;
			p.upper[k] = p.lower[k] + d->g->cell;
		}
		e->cell[e->n++] = p;
	}
	return true;
}

/* Another cell begins each time, so that no one that has no room keeps grains from others for ever. Cells that get none are
 * left out. */
static bool share_out_all(enriching *e) {
	const uint32_t n = e->n, begin = n ? (uint32_t)e->d->u[U_UPDATES].index[0] % n : 0;
	for (uint32_t i = 0; i < n; i++)
		if (!share_out(e, &e->cell[(begin + i) % n])) return false;
	e->n = 0;
	for (uint32_t i = 0; i < n; i++)
		if (e->cell[i].wanted) e->cell[e->n++] = e->cell[i];
	return true;
}

/* Cells that are `apart` or more steps from each other along an axis cannot touch each other's grains. Where that many
 * do not go into a periodic axis, the cells that are left over have colours of their own. */
static uint64_t colour_of(const update *d, const int32_t cell[3], int32_t apart) {
	uint64_t colour = 0;
	for (uint32_t k = 0; k < d->s->dim; k++) {
		const int32_t rounds = d->g->cells[k] - d->g->cells[k] % apart;
		const bool over = d->g->periodic[k] && cell[k] >= rounds;
		colour = colour * 2 * (uint64_t)apart + (uint64_t)(over ? apart + cell[k] - rounds : cell[k] % apart);
	}
	return colour;
}

static bool colour_cells(enriching *e) {
	const update *d = e->d;
	const quern_step *s = d->s;
	const quern_real reach = 2 * quern_radius_most(&d->h->radii) / d->g->cell;
	e->colour = s->host->memory(s->run, ((size_t)e->n + 1) * sizeof *e->colour);
	e->by_colour = s->host->memory(s->run, ((size_t)e->n + 1) * sizeof *e->by_colour);
	void *work = s->host->memory(s->run, quern_sort_bytes(e->n));
	if (!e->colour || !e->by_colour || !work) return false;
	for (uint32_t i = 0; i < e->n; i++) e->colour[i] = colour_of(d, e->cell[i].cell, (int32_t)reach + 2);
	quern_sort_order(e->n, e->colour, NULL, e->by_colour, work);
	return true;
}

/* In the order of their numbers: two runs that differ in the last bits store grains in another order at times, and packers begin
 * with the first seed. */
static int32_t *obstacles_in_order(const update *d) {
	const quern_step *s = d->s;
	int32_t *order = s->host->memory(s->run, ((size_t)d->n_grains + 1) * sizeof *order);
	void *work = s->host->memory(s->run, quern_sort_bytes(d->n_grains));
	uint64_t *id = s->host->memory(s->run, ((size_t)d->n_grains + 1) * sizeof *id);
	if (!order || !work || !id) return NULL;
	for (uint32_t i = 0; i < d->n_grains; i++) id[i] = (uint64_t)d->u[U_GRAIN_ID].id[i];
	quern_sort_order(d->n_grains, id, NULL, order, work);
	return order;
}

static bool place_obstacles(enriching *e) {
	const update *d = e->d;
	const quern_step *s = d->s;
	const int32_t *order = obstacles_in_order(d);
	quern_real most = quern_radius_most(&d->h->radii);
	for (uint32_t i = 0; i < d->n_grains; i++)
		most = d->u[U_GRAIN_RADIUS].real[0][i] > most ? d->u[U_GRAIN_RADIUS].real[0][i] : most;
	if (!order || quern_placer_init(&e->placer, s->dim, s->lower, s->upper, s->periodic, most) != QUERN_OK ||
		!quern_placer_bodies(&e->placer, s, SLOT_BODIES, false))
		return false;
	for (uint32_t q = 0; q < d->n_grains; q++) {
		const int32_t i = order[q];
		quern_spot spot = { .radius = d->u[U_GRAIN_RADIUS].real[0][i] };
		if (d->drop_grain[i]) continue;
		for (uint32_t k = 0; k < s->dim; k++) spot.x[k] = d->u[U_GRAIN_POSITION].real[k][i];
		quern_placer_add(&e->placer, &spot);
	}
	return !e->placer.failed;
}

/* What the cells of one colour have got is in the way of the next ones. */
static bool add_obstacles(enriching *e, uint32_t begin, uint32_t end) {
	bool good = true;
	for (uint32_t i = begin; i < end; i++) {
		const packed_cell *p = &e->cell[e->by_colour[i]];
		good = good && !p->failed;
		for (uint32_t k = 0; k < p->n; k++) {
			const quern_spot spot = spot_of(&p->grain[k]);
			quern_placer_add(&e->placer, &spot);
		}
	}
	return good && !e->placer.failed;
}

static bool enrich_all(enriching *e) {
	const quern_step *s = e->d->s;
	int32_t *all = e->by_colour;
	bool good = true;
	for (uint32_t begin = 0, end; begin < e->n && good; begin = end) {
		for (end = begin + 1; end < e->n && e->colour[all[end]] == e->colour[all[begin]];) end++;
		e->by_colour = all + begin;
		s->host->parallel(s->run, end - begin, enrich_one, e);
		e->by_colour = all;
		good = add_obstacles(e, begin, end);
	}
	return good;
}

/* New grains in the order of their cells' places, which gives them their numbers. */
static bool gather(enriching *e) {
	update *d = e->d;
	size_t n = 0;
	for (uint32_t i = 0; i < e->n; i++) n += e->cell[i].n;
	d->grains = malloc((n + 1) * sizeof(new_grain));
	for (uint32_t i = 0; i < e->n && d->grains; i++) {
		if (!e->cell[i].n) continue;
		memcpy(d->grains + d->n_new_grains, e->cell[i].grain, e->cell[i].n * sizeof(new_grain));
		d->n_new_grains += e->cell[i].n;
	}
	return d->grains;
}

static quern_status enrich(enriching *e) {
	const bool good = find_cells(e) && share_out_all(e);
	if (good && !e->n) return QUERN_OK;
	if (!good || !colour_cells(e) || !place_obstacles(e) || !enrich_all(e) || !gather(e))
		return QUERN_E_MEMORY;
	return put_back(e);
}

quern_status quern_hybrid_grains(update *d) {
	enriching e = {
		.d = d, .fresh = d->u[U_DRAWS].index[0], .waited = d->s->host->set(d->s->run, "waiting").n
	};
	const quern_status status = enrich(&e);
	for (uint32_t i = 0; i < e.n; i++) free(e.cell[i].grain);
	free(e.numbers);
	quern_placer_finish(&e.placer);
	return status;
}

/* ---- the set itself ---- */

quern_status quern_hybrid_apply_grains(update *d) {
	const quern_step *s = d->s;
	renewal r = { .set = "grain", .drop = d->drop_grain, .n_new = d->n_new_grains };
	const quern_status status = quern_renew(s, &r);
	if (status != QUERN_OK || (r.first == d->n_grains && !d->n_new_grains)) return status;
	const quern_column *u = d->u;
	for (uint32_t i = 0; i < d->n_new_grains; i++) {
		const new_grain *g = &d->grains[i];
		const uint32_t to = r.first + i;
		for (uint32_t k = 0; k < s->dim; k++) {
			u[U_GRAIN_POSITION].real[k][to] = g->position[k];
			u[U_GRAIN_VELOCITY].real[k][to] = g->velocity[k];
		}
		for (uint32_t k = 0; u[U_GRAIN_SPIN].real[0] && k < (s->dim == 3 ? 3u : 1u); k++)
			u[U_GRAIN_SPIN].real[k][to] = g->spin[k];
		u[U_GRAIN_RADIUS].real[0][to] = g->radius;
		u[U_GRAIN_MASS].real[0][to] = g->mass;
		u[U_GRAIN_WEIGHT].real[0][to] = g->weight;
	}
	u[U_DISPLACEMENT].real[0][0] = INFINITY; /* the list names grains that are gone, and misses new ones */
	return QUERN_OK;
}
