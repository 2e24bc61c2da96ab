/* SPDX-License-Identifier: MIT */
/* cells - who is in which cell, and what cells hold on average */
#include "../common/cover.h"
#include "../common/sort.h"
#include "update.h"
#include <math.h>
#include <string.h>

enum { N = QUERN_BLOCK_CELLS };

void quern_hybrid_centre(const update *d, const int32_t cell[3], quern_real x[3]) {
	for (uint32_t a = 0; a < 3; a++) x[a] = a < d->g->dim ? d->g->lower[a] + (cell[a] + 0.5) * d->g->cell : 0;
}

/* Within a block the next cell is a step away; from its edge it has to be looked for. */
static int32_t find_next(const update *d, uint32_t c, const int32_t cell[3], uint32_t axis, int step) {
	const int32_t edge = (int32_t)d->g->edge, place = cell[axis] % edge + step;
	int32_t to[3], stride = 1;
	memcpy(to, cell, sizeof to);
	to[axis] += step;
	for (uint32_t k = 0; k < axis; k++) stride *= edge;
	if (place >= 0 && place < edge && to[axis] < d->g->cells[axis]) return (int32_t)c + step * stride;
	return quern_grid_entry_back(d->g, to);
}

static void find_neighbours(void *arg, uint32_t b, uint32_t worker) {
	const update *d = arg;
	const uint32_t sides = 2 * d->s->dim;
	(void)worker;
	for (uint32_t c = b * N; c < (b + 1) * N; c++) {
		int32_t cell[3];
		const bool inside = quern_grid_cell_of(d->g, c, cell);
		for (uint32_t k = 0; k < sides; k++)
			d->beside[(size_t)c * sides + k] = inside ? find_next(d, c, cell, k / 2, k % 2 ? 1 : -1) : -1;
	}
}

/* ---- sorting ---- */

/* Entry of the cell that entry i of a set lies in; a point on an upper wall belongs to the last cell. */
static int32_t cell_of(const update *d, quern_real *const x[3], uint32_t i, quern_grid_cursor *last) {
	quern_real at[3];
	int32_t cell[3];
	quern_grid_position(d->g, x, i, at);
	quern_grid_cell_inside(d->g, at, cell);
	return quern_grid_entry_near(d->g, last, cell);
}

enum { CHUNK = 4096 };

typedef struct {
	const update *d;
	quern_real *const *x;
	const int32_t *fixed; /* NULL: none is */
	int32_t *cell;        /* by entry */
	uint32_t n;
} finding;

static void find_chunk(void *arg, uint32_t chunk, uint32_t worker) {
	const finding *f = arg;
	const uint32_t begin = chunk * CHUNK, end = begin + CHUNK < f->n ? begin + CHUNK : f->n;
	quern_grid_cursor last = { .block = -1 };
	(void)worker;
	for (uint32_t i = begin; i < end; i++)
		f->cell[i] = f->fixed && f->fixed[i] ? -1 : cell_of(f->d, f->x, i, &last);
}

static void find_cells(finding f) {
	f.d->s->host->parallel(f.d->s->run, (f.n + CHUNK - 1) / CHUNK, find_chunk, &f);
}

static void *take(update *d, size_t count, size_t size) {
	void *memory = d->s->host->memory(d->s->run, (count + 2) * size);
	d->failed = d->failed || !memory;
	return memory;
}

/* Blocks of whose cells something is owed stay, wherever the material has gone. */
static bool holds(const void *arg, uint32_t block) {
	const quern_step *s = arg;
	const quern_column *u = s->use;
	for (uint32_t k = block * N; k < (block + 1) * N; k++)
		if (quern_hybrid_is_owed(u, k, s->dim)) return true;
	return false;
}

quern_status quern_hybrid_sort(update *d) {
	const quern_step *s = d->s;
	const cover c = { .point = s->use[U_POINT_POSITION],
		.grain = s->use[U_GRAIN_POSITION],
		.n_grains = s->host->set(s->run, "grain").n,
		.holds = holds,
		.arg = s };
	const quern_status status = quern_cover_sort(s, &c);
	if (status != QUERN_OK) return status;
	s->use[U_UNSORTED].index[0] = 0;
	d->g = s->host->grid(s->run);
	d->u = s->use;
	d->images = quern_images_of(s->dim, s->lower, s->upper, s->periodic);
	d->n_cells = d->g->n_blocks * N;
	d->n_grains = s->host->set(s->run, "grain").n;
	d->n_points = s->host->set(s->run, "point").n;
	d->grain_begin = take(d, d->n_cells, sizeof(uint32_t));
	d->point_begin = take(d, d->n_cells, sizeof(uint32_t));
	d->grain = take(d, d->n_grains, sizeof(int32_t));
	d->point = take(d, d->n_points, sizeof(int32_t));
	d->grain_cell = take(d, d->n_grains, sizeof(int32_t));
	d->point_cell = take(d, d->n_points, sizeof(int32_t));
	d->drop_grain = take(d, d->n_grains, sizeof(bool));
	d->drop_point = take(d, d->n_points, sizeof(bool));
	d->mass = take(d, d->n_cells, sizeof(quern_real));
	d->spread = take(d, d->n_cells, sizeof(quern_real));
	d->in_grains = take(d, d->n_cells, sizeof(quern_real));
	d->in_points = take(d, d->n_cells, sizeof(quern_real));
	d->wall = take(d, d->n_cells, sizeof(quern_real));
	d->open = take(d, d->n_cells, sizeof(quern_real));
	d->displaced = take(d, d->n_cells, sizeof(bool));
	d->zone = take(d, d->n_cells, sizeof(int32_t));
	d->share = take(d, d->n_cells, sizeof(quern_real));
	for (uint32_t k = 0; k < s->dim; k++) d->velocity[k] = take(d, d->n_cells, sizeof(quern_real));
	d->beside = take(d, (size_t)d->n_cells * 2 * s->dim, sizeof(int32_t));
	if (d->failed) return QUERN_E_MEMORY;
	s->host->parallel(s->run, d->g->n_blocks, find_neighbours, d);
	find_cells(
		(finding) { d, d->u[U_GRAIN_POSITION].real, d->u[U_GRAIN_FIXED].index, d->grain_cell, d->n_grains });
	find_cells((finding) { d, d->u[U_POINT_POSITION].real, NULL, d->point_cell, d->n_points });
	d->moving_grains = moving_grains(s);
	d->all_points = all_points(s);
	d->grain_order = s->host->parts(s->run, "grain")->entry;
	d->point_order = s->host->parts(s->run, "point")->entry;
	quern_bucket(d->n_grains, d->grain_cell, d->grain_order, d->n_cells, d->grain_begin, d->grain);
	quern_bucket(d->n_points, d->point_cell, d->point_order, d->n_cells, d->point_begin, d->point);
	return QUERN_OK;
}

/* ---- averages ---- */

static void add_particle(
	const update *d, uint32_t c, quern_real m, quern_real *const v[3], uint32_t i, quern_real *second) {
	quern_real v2 = 0;
	for (uint32_t k = 0; k < d->s->dim; k++) {
		d->velocity[k][c] += m * v[k][i];
		v2 += v[k][i] * v[k][i];
	}
	d->mass[c] += m;
	*second += m * v2;
}

static void average_block(void *arg, uint32_t b, uint32_t worker) {
	update *d = arg;
	const quern_column *u = d->u;
	const cloud grains = moving_grains(d->s), points = all_points(d->s);
	(void)worker;
	for (uint32_t c = b * N; c < (b + 1) * N; c++) {
		quern_real second = 0, square = 0;
		d->mass[c] = d->spread[c] = 0;
		for (uint32_t k = 0; k < d->s->dim; k++) d->velocity[k][c] = 0;
		for (uint32_t q = d->grain_begin[c]; q < d->grain_begin[c + 1]; q++) {
			const uint32_t i = (uint32_t)d->grain[q];
			add_particle(d, c, cloud_mass(&grains, i), u[U_GRAIN_VELOCITY].real, i, &second);
		}
		for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++) {
			const uint32_t i = (uint32_t)d->point[q];
			add_particle(d, c, cloud_mass(&points, i), u[U_POINT_VELOCITY].real, i, &second);
		}
		if (!(d->mass[c] > 0)) continue;
		for (uint32_t k = 0; k < d->s->dim; k++) {
			d->velocity[k][c] /= d->mass[c];
			square += d->velocity[k][c] * d->velocity[k][c];
		}
		const quern_real variance = second / d->mass[c] - square;
		d->spread[c] = variance > 0 ? sqrt(variance) : 0;
	}
}

/* Mass, mean velocity and its spread of both clouds together, with the weights as they are. */
void quern_hybrid_averages(update *d) { d->s->host->parallel(d->s->run, d->g->n_blocks, average_block, d); }

/* A grain counts as the square or cube of its volume: sums are exact, and a cell of a diameter or more hardly sees the
 * difference. */
static void spread_grain(const update *d, uint32_t i, quern_real times, quern_real *out) {
	const quern_column *u = d->u;
	const uint32_t dim = d->s->dim;
	const quern_real h = d->g->cell, r = u[U_GRAIN_RADIUS].real[0][i], volume = quern_grid_cell_volume(d->g);
	const quern_real half =
		(dim == 2 ? 0.886226925452758 : 0.805995977008235) * r; /* of the square, of the cube */
	int32_t first[3] = { 0 }, last[3] = { 0 };
	for (uint32_t k = 0; k < dim; k++) {
		first[k] = quern_grid_cell(d->g, k, u[U_GRAIN_POSITION].real[k][i] - half);
		last[k] = quern_grid_cell(d->g, k, u[U_GRAIN_POSITION].real[k][i] + half);
	}
	for (int32_t z = first[2]; z <= last[2]; z++)
		for (int32_t y = first[1]; y <= last[1]; y++)
			for (int32_t x = first[0]; x <= last[0]; x++) {
				int32_t cell[3] = { x, y, z };
				quern_real part = 1;
				for (uint32_t k = 0; k < dim; k++) {
					const quern_real low = d->g->lower[k] + cell[k] * h, at = u[U_GRAIN_POSITION].real[k][i];
					const quern_real from = at - half > low ? at - half : low,
									 to = at + half < low + h ? at + half : low + h;
					part *= to > from ? to - from : 0;
				}
				const int32_t c = quern_grid_entry_back(d->g, cell);
				if (c >= 0) out[c] += times * (part / volume);
			}
}

/* Fixed grains are walls: as densely as they may lie, they leave no room. Where nothing moves between them nothing
 * will. Those of a rough floor are a part of what grains lack before it, which its displacement counts. */
void quern_hybrid_fixed(update *d) {
	const int32_t *fixed = d->u[U_GRAIN_FIXED].index;
	quern_real *taken = fixed ? take(d, d->n_cells, sizeof(quern_real)) : NULL;
	if (!taken) return;
	for (uint32_t q = 0; q < d->n_grains; q++) {
		const uint32_t i = quern_nth(d->grain_order, q);
		if (fixed[i]) spread_grain(d, i, d->h->density / d->h->packed, taken);
	}
	for (uint32_t c = 0; c < d->n_cells; c++) {
		if (!(taken[c] > 0) || d->displaced[c]) continue;
		const quern_real left = d->open[c] - taken[c];
		d->open[c] = left >= 0.25 ? left : d->mass[c] > 0 ? 0.125 : 0;
	}
}

/* Of the room that bodies and fixed grains leave. A cell with a tenth of the mass that fills it in points is full: so
 * is what points stand for. */
void quern_hybrid_fractions(update *d) {
	const quern_column *u = d->u;
	quern_real *fraction = u[U_FRACTION].real[0];
	if (!fraction) return;
	memset(fraction, 0, d->n_cells * sizeof(quern_real));
	for (uint32_t q = 0; q < d->n_grains; q++) {
		const uint32_t i = quern_nth(d->grain_order, q);
		if (d->grain_cell[i] >= 0) spread_grain(d, i, 1, fraction);
	}
	for (uint32_t c = 0; c < d->n_cells; c++) {
		quern_real mass = 0;
		for (uint32_t q = d->point_begin[c]; q < d->point_begin[c + 1]; q++)
			mass += u[U_POINT_MASS].real[0][d->point[q]];
		const quern_real room = d->open[c] > 0.125 ? d->open[c] : 0.125;
		fraction[c] = mass >= 0.1 * room * d->full ? 1 : fraction[c] / room;
	}
}

/* The share of a cell's hat in which there can be contacts: bodies and fixed grains hold none. What lies behind a
 * face of the domain is sampled before it. */
static quern_real room_of(const update *d, uint32_t c) {
	const int depth = d->s->dim == 3 ? 1 : 0;
	int32_t cell[3];
	quern_real room = 0;
	const bool alone = d->wall[c] >= 2 * d->g->cell && !d->u[U_GRAIN_FIXED].index;
	if (alone || !quern_grid_cell_of(d->g, c, cell)) return 1;
	for (int z = -depth; z <= depth; z++)
		for (int y = -1; y <= 1; y++)
			for (int x = -1; x <= 1; x++) {
				const int32_t i =
					quern_grid_entry_back(d->g, (int32_t[3]) { cell[0] + x, cell[1] + y, cell[2] + z });
				const quern_real part =
					(x ? 0.125 : 0.75) * (y ? 0.125 : 0.75) * (depth ? z ? 0.125 : 0.75 : 1);
				room += part * (i >= 0 ? d->open[i] : 1);
			}
	return room > 0.125 ? room : 0.125;
}

bool quern_hybrid_contact_stress(const update *d, uint32_t cell, quern_real stress[6]) {
	const quern_real samples = d->u[U_SAMPLES].real[0][0];
	const quern_real times = samples > 0 ? samples * room_of(d, cell) : 1;
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, d->s->dim); k++)
		stress[k] = samples > 0 ? d->u[U_STRESS].real[k][cell] / times : 0;
	return samples > 0;
}

/* A cell of which samples say what presses there. */
static bool is_sampled(const update *d, int32_t c) {
	return c >= 0 && d->u[U_ZONE].index[c] != QUERN_CONTINUUM && d->open[c] > 0.5 &&
		   d->mass[c] > 0.5 * d->open[c] * d->full;
}

static bool add_pair(
	const update *d, uint32_t here, const int32_t cell[3], const int32_t way[3], quern_real sum[6]) {
	quern_real stress[2][6], from[3], to[3];
	quern_hybrid_centre(d, cell, from);
	for (int side = 0; side < 2; side++) {
		int32_t at[3];
		for (uint32_t k = 0; k < 3; k++) at[k] = cell[k] + (side ? -way[k] : way[k]);
		quern_hybrid_centre(d, at, to);
		const int32_t c = quern_grid_entry_back(d->g, at);
		/* from either end: one farther from a body than two cells is not asked */
		if (!is_sampled(d, c) || quern_hybrid_walled(d, NULL, (uint32_t)c, to, from) ||
			quern_hybrid_walled(d, NULL, here, from, to))
			return false;
		quern_hybrid_contact_stress(d, (uint32_t)c, stress[side]);
	}
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, d->s->dim); k++)
		sum[k] += stress[0][k] + stress[1][k];
	return true;
}

enum { FAR = 2 };

bool quern_hybrid_mean_stress(const update *d, uint32_t c, quern_real stress[6]) {
	const int depth = d->s->dim == 3 ? FAR : 0;
	int32_t cell[3], n = 1;
	if (!quern_hybrid_contact_stress(d, c, stress)) return false;
	if (!quern_grid_cell_of(d->g, c, cell)) return true;
	for (int z = 0; z <= depth; z++)
		for (int y = z ? -FAR : 0; y <= FAR; y++)
			for (int x = z || y ? -FAR : 1; x <= FAR; x++)
				if (add_pair(d, c, cell, (int32_t[3]) { x, y, z }, stress)) n += 2;
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, d->s->dim); k++) stress[k] /= n;
	return true;
}

/* The unit vector along which the continuum's share grows at a cell, zero where it does not. */
static void normal_of(const update *d, uint32_t c, quern_real n[3]) {
	int32_t cell[3];
	quern_real length = 0;
	n[0] = n[1] = n[2] = 0;
	if (!quern_grid_cell_of(d->g, c, cell)) return;
	for (uint32_t k = 0; k < d->s->dim; k++) {
		const int32_t up = cell_beside(d, c, k, 1), down = cell_beside(d, c, k, -1);
		n[k] = old_share(d, up < 0 ? (int32_t)c : up) - old_share(d, down < 0 ? (int32_t)c : down);
		length += n[k] * n[k];
	}
	for (uint32_t k = 0; k < d->s->dim && length > 0; k++) n[k] /= sqrt(length);
}

static void put_normals(
	const update *d, uint32_t n, const quern_column *x, const quern_column *out, quern_real (*normal)[3]) {
	quern_grid_cursor last = { .block = -1 };
	for (uint32_t i = 0; i < n && out->real[0]; i++) {
		const int32_t c = cell_of(d, x->real, i, &last);
		for (uint32_t k = 0; k < d->s->dim; k++) out->real[k][i] = c < 0 ? 0 : normal[c][k];
	}
}

quern_status quern_hybrid_normals(update *d) {
	const quern_column *u = d->u;
	if (!u[U_GRAIN_NORMAL].real[0] && !u[U_POINT_NORMAL].real[0]) return QUERN_OK;
	quern_real(*normal)[3] = d->s->host->memory(d->s->run, ((size_t)d->n_cells + 1) * sizeof *normal);
	if (!normal) return QUERN_E_MEMORY;
	for (uint32_t c = 0; c < d->n_cells; c++) normal_of(d, c, normal[c]);
	put_normals(d, d->s->host->set(d->s->run, "grain").n, &u[U_GRAIN_POSITION], &u[U_GRAIN_NORMAL], normal);
	put_normals(d, d->s->host->set(d->s->run, "point").n, &u[U_POINT_POSITION], &u[U_POINT_NORMAL], normal);
	return QUERN_OK;
}
