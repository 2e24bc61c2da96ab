/* SPDX-License-Identifier: MIT */
/* gather - nodes to points, chunk by chunk: velocity, position, volume, stress */
#include "answer.h"
#include "damp.h"
#include "strained.h"
#include <math.h>

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
	const quern_real *density = (const quern_real *)(const void *)m->tile + lane;
	int any = 0;
	for (uint32_t k = 0; k < nodes; k++) any |= density[(size_t)k * QUERN_LANES] < 0;
	memset(m->silent, 0, nodes * sizeof *m->silent);
	if (!any) return;
	for (uint32_t k = 0; k < nodes; k++) m->silent[k] = m->tile[k][lane] < 0;
	for (uint32_t k = 0; k < nodes; k++)
		m->said[k] = m->tile[k][lane] < 0 ? said_around(w, m, k) : m->tile[k][lane];
	for (uint32_t k = 0; k < nodes; k++) m->tile[k][lane] = m->said[k];
}

/* What the nodes say at the points of a chunk. */
QUERN_INLINE void collect_chunk(
	const gather_work *w, gather_memory *m, uint32_t n, const int dim, const bool slopes, ahead_at *at) {
	for (uint32_t i = 0; i < n; i++) {
		ahead_ask(&w->ahead, w->motion, at);
		const bool doubled = slopes && stencil_doubles(dim);
		quern_row v[4];
		if (doubled) stencil_gather_doubled(&m->trip.stencil, i, m->tile, &v[0], &v[2]);
		else stencil_gather(&m->trip.stencil, i, m->tile, dim, slopes, v);
		trips_hear(&m->trip, i, &v[0], 0, dim);
		for (int k = 0; k < dim; k++)
			for (int a = 0; a < dim && slopes; a++)
				m->gradient[dim * k + a][i] = doubled && a == 0 ? v[0][ONCE_MORE + k] : v[1 + a][k];
		m->grid_density[i] = v[0][2 * dim];
	}
	for (uint32_t i = n; i < STENCIL; i++) ahead_ask(&w->ahead, w->motion, at);
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
		fit_shift(w->g, n, dim, &m->fit);
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

/* Of a volume in one step: what grows by more is no number any longer, and found out behind. A point that light nodes pull at once at a wall, in
 * spray, grows by some times, opens and is as before. */
static const quern_real most_growth = 1000;

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
		moved[i] = det <= most_growth ? volume[i] : NAN;
		density[i] = mass[i] / volume[i];
	}
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

/* The material, and the dashpots that its stress feels. */
QUERN_INLINE void press_chunk(
	const gather_work *w, gather_memory *m, uint32_t begin, uint32_t n, const int dim) {
	const quern_column *stress = &w->s->use[GATHER_STRESS], *dashpot = &w->s->use[GATHER_DASHPOT];
	const uint32_t parts = quern_shape_size(QUERN_SYMMETRIC, (uint32_t)dim);
	quern_real *old[6] = { NULL }, *new[6] = { NULL }, *out[6] = { NULL }, *gradient[9] = { NULL };
	for (uint32_t k = 0; k < parts && dashpot->real[0]; k++)
		memcpy(m->stress[k], stress->real[k] + begin, n * sizeof(quern_real));
	call_material(w, m, begin, n);
	if (!dashpot->real[0]) return;
	for (uint32_t k = 0; k < parts; k++)
		old[k] = m->stress[k], new[k] = stress->real[k] + begin, out[k] = dashpot->real[k] + begin;
	for (int k = 0; k < dim * dim; k++) gradient[k] = m->gradient[k];
	damp_chunk(dim, old, new, gradient, n, w->s->dt, w->p->damping, out);
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

/* Takes from gradients again what was added for how full cells are, and by strains: others get them as nodes say them. */
QUERN_INLINE void restore_gradient(const gather_work *w, gather_memory *m, uint32_t n, const int dim) {
	for (int k = 0; k < dim && (w->answers || w->p->alone); k++)
		memcpy(m->gradient[(dim + 1) * k], m->kept[k], n * sizeof(quern_real));
	for (int k = 0; k < dim * dim && w->strain->apply[dim - 2]; k++)
		memcpy(m->gradient[k], m->raw[k], n * sizeof(quern_real));
}

QUERN_INLINE void gather_block(
	const gather_work *w, gather_memory *m, uint32_t b, uint32_t next, const int dim, const bool last) {
	quern_real *const *x = w->s->use[GATHER_POSITION].real;
	const uint32_t begin = w->point[b], end = w->point[b + 1];
	if (begin == end) return;
	quern_tile_load(w->g, w->motion, b, m->tile);
	if (last) speak_for_others(w, m);
	if (last && stencil_doubles(dim)) stencil_double(m->tile, w->g->tile_size);
	trips_begin_block(&w->trips, &m->trip, b, last);
	if (last && (w->answers || w->counts)) level_block(w, m, b, dim);
	if (last && w->moment) spread_find_cut(w, m, b);
	if (last && w->strain->means) strain_block(w, m, b, dim);
	for (uint32_t i = begin; i < end; i += STENCIL) {
		const uint32_t n = end - i < STENCIL ? end - i : STENCIL;
		ahead_at at = ahead_from(&w->ahead, w->g, w->point, b, next, i, n);
		stencil_make(w->g, &w->s->slot[SLOT_SHAPE][0], b, x, i, NULL, n, &m->trip.stencil);
		collect_chunk(w, m, n, dim, last, &at);
		if (last && w->p->matrix) fit_chunk(w, m, n, dim);
		call_transfer(w, m, i, n, last);
		for (uint32_t k = 0; k < n && !last; k++)
			trips_send(&w->trips, &m->trip, k, cloud_mass(&w->points, i + k), dim);
		if (!last) continue;
		for (uint32_t k = 0; k < n && w->calm.part; k++)
			calm_note(
				&w->calm, k, i + k, m->gradient, m->trip.pic, w->s->use[GATHER_VELOCITY].real, (uint32_t)dim);
		if (w->strain->apply[dim - 2]) strain_chunk(w, m, b, i, n, dim);
		if (w->moment) spread_chunk(w, m, b, i, n, dim);
		if (w->spreads) spread_move(w, m, i, n);
		move_chunk(w, m, b, i, n, dim);
		if (w->answers) answer_chunk(w, m, b, i, n, dim);
		if (w->counts) measure_chunk(w, m, b, i, n, dim);
		if (w->p->alone) follow_chunk(w, m, i, n);
		press_chunk(w, m, i, n, dim);
		if (w->gives) restore_gradient(w, m, n, dim);
		finish_chunk(w, m, b, i, n, dim);
	}
	if (last && w->calm.part)
		calm_block(
			&w->calm, &w->points, NULL, begin, end - begin, w->s->use[GATHER_VELOCITY].real, (uint32_t)dim);
	trips_end_block(&w->trips, &m->trip, b, last);
}

static void run_block(const gather_work *w, uint32_t b, uint32_t next, uint32_t worker, bool last) {
	gather_memory *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m) return;
	if (w->s->dim == 2) {
		if (last) gather_block(w, m, b, next, 2, true);
		else gather_block(w, m, b, next, 2, false);
	} else if (last) gather_block(w, m, b, next, 3, true);
	else gather_block(w, m, b, next, 3, false);
}
static void gather_one(void *arg, uint32_t b, uint32_t worker) {
	const gather_work *w = arg;
	run_block(w, b, b + 1 < w->g->n_blocks ? b + 1 : b, worker, true);
}
static void send_one(void *arg, uint32_t b, uint32_t next, uint32_t worker) {
	run_block(arg, b, next, worker, false);
}

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
	if (isnan(volume))
		return s->host->stop(s->run, QUERN_E_NUMERIC, "point", i,
			"point.volume at (%.4g, %.4g) m is not a number, or grows more than %g times in one step of %.3g s (%s): unstable, or "
			"the step is too long",
			x, y, most_growth, s->dt, material);
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

/* What is read of each of n points. */
static void note_columns(gather_work *w, uint32_t n) {
	static const uint32_t read[] = { GATHER_POSITION, GATHER_VELOCITY, GATHER_MASS, GATHER_VOLUME,
		GATHER_STRESS, GATHER_DASHPOT, GATHER_WEIGHT, GATHER_FOLLOWING, GATHER_AROUND, GATHER_SPREADING };
	const quern_bound *material = &w->s->slot[SLOT_MATERIAL][0];
	for (uint32_t k = 0; k < sizeof read / sizeof *read; k++) ahead_add(&w->ahead, &w->s->use[read[k]]);
	for (uint32_t r = 0; r < material->n_uses; r++)
		if (material->uses[r].shape != QUERN_INDEX && material->uses[r].shape != QUERN_ID)
			ahead_add(&w->ahead, &material->column[r]);
	ahead_end(&w->ahead, n);
	/* in a plane asking for columns takes longer than waiting for them: docs/decisions/0053 */
	if (w->s->dim == 2) w->ahead.n = 0;
}

quern_status quern_mpm_gather(const void *self, const quern_step *s) {
	const quern_set_view points = s->host->set(s->run, "point");
	const mpm *p = self;
	gather_work w = { .p = p,
		.s = s,
		.g = s->host->grid(s->run),
		.point = points.block,
		.points = { .mass = s->use[GATHER_MASS].real[0], .weight = s->use[GATHER_WEIGHT].real[0] },
		.strain = s->slot[SLOT_STRAIN][0].ops,
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
	w.gives = s->use[GATHER_GRADIENT].real[0] || s->use[GATHER_AFFINE].real[0];
	const bool due = p->counted && s->use[GATHER_UNCOUNTED].index[0] == 1;
	w.counts = due && p->alone;
	w.still = p->alone ? flowing_alone * p->rest_alone : flowing * p->rest_rate;
	w.spreads = p->counted && (p->alone || (w.answers && p->follow > 0)) && p->spread > 0 && w.still > 0;
	if (due && w.spreads && !spread_measure(&w)) return QUERN_E_MEMORY;
	const quern_real part = calm_rate * w.p->rest_rate * s->dt;
	w.calm = (calm) { .rate = w.p->rest_rate, .share = part / (1 + part) };
	if (!w.bad || !w.moved || calm_init(&w.calm, s, points.n) != QUERN_OK) return QUERN_E_MEMORY;
	note_columns(&w, points.n);
	for (uint32_t b = 0; b < w.g->n_blocks; b++) w.bad[b] = -1;
	if (trips_run(&w.trips, send_one, &w) != QUERN_OK) return QUERN_E_MEMORY;
	s->host->parallel(s->run, w.g->n_blocks, gather_one, &w);
	for (uint32_t q = 0; q < w.g->n_blocks; q++)
		if (w.bad[quern_nth(w.g->by_place, q)] >= 0) return lost(&w, w.bad[quern_nth(w.g->by_place, q)]);
	for (uint32_t b = 0; b < w.g->n_blocks; b++)
		if (w.moved[b]) s->use[GATHER_UNSORTED].index[0] = 1;
	return QUERN_OK;
}
