/* SPDX-License-Identifier: MIT */
/* open - the integrator's part before the forces, where it has one */
#include "forces.h"
#include <math.h>
#include <string.h>

enum { CHUNK = 256 };

typedef struct {
	const quern_step *s;
	const quern_bound *bound;
	uint32_t n, n_spin;
	bool coasts;          /* velocities and spins stay */
	quern_real *farthest; /* by chunk: square of the way since the last list */
	ways *ways;           /* by chunk */
	bool boxed;
	dem_box box;
} opening;

typedef struct {
	_Alignas(64) quern_real position[3][CHUNK], velocity[3][CHUNK], spin[3][CHUNK], way[CHUNK], along[CHUNK];
} opened;

/* A column's new numbers, but for grains that are held. */
static void keep(
	quern_real *restrict to, const quern_real *restrict now, const int32_t *restrict held, uint32_t n) {
	if (!held) {
		memcpy(to, now, n * sizeof *to);
		return;
	}
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) to[i] = held[i] ? to[i] : now[i];
}

/* Of n squares of ways, at most CHUNK; what is held has gone none. In halves, so that no number waits for all those before it. */
static quern_real most_of(quern_real *restrict way, const int32_t *restrict held, uint32_t n) {
	/* what is not a number is found elsewhere, and would hide the others here */
	for (uint32_t i = 0; i < n; i++) way[i] = (held && held[i]) || !(way[i] < INFINITY) ? 0 : way[i];
	while (n > 1) {
		const uint32_t half = (n + 1) / 2;
		const quern_real *restrict upper = way + half;
		QUERN_SIMD
		for (uint32_t i = 0; i < n - half; i++) way[i] = upper[i] > way[i] ? upper[i] : way[i];
		n = half;
	}
	return way[0];
}

/* The new state is made aside and then copied: an integrator may read and write as if the columns were distinct. */
static void open_chunk(void *arg, uint32_t chunk, uint32_t worker) {
	const opening *o = arg;
	const quern_column *u = o->s->use;
	const uint32_t begin = chunk * CHUNK, n = o->n - begin < CHUNK ? o->n - begin : CHUNK, dim = o->s->dim;
	opened *w = o->s->host->scratch(o->s->run, worker, sizeof *w);
	quern_column own[QUERN_MOST_USES];
	if (!w) {
		o->farthest[chunk] = INFINITY;
		for (uint32_t k = 0; k < dim; k++)
			o->ways[chunk].along[k][0] = -INFINITY, o->ways[chunk].along[k][1] = INFINITY;
		return;
	}
	quern_integrator_batch b = { .n = n, .cap = CHUNK, .dt = o->s->dt, .use = own };
	for (uint32_t r = 0; r < o->bound->n_uses; r++)
		own[r] = quern_column_from(o->bound->column[r], o->bound->uses[r].shape, begin);
	for (uint32_t k = 0; k < dim; k++) {
		b.gravity[k] = o->s->gravity[k];
		b.position[k] = u[OPEN_POSITION].real[k] + begin;
		b.velocity[k] = u[OPEN_VELOCITY].real[k] + begin;
		b.new_position[k] = w->position[k];
		b.new_velocity[k] = w->velocity[k];
	}
	for (uint32_t k = 0; k < o->n_spin; k++) {
		b.spin[k] = u[OPEN_SPIN].real[k] + begin;
		b.new_spin[k] = w->spin[k];
	}
	((const quern_integrator_ops *)o->bound->ops)->open[dim - 2](o->bound->self, &b);
	const int32_t *held = u[OPEN_FIXED].index ? u[OPEN_FIXED].index + begin : NULL;
	quern_real *restrict way = w->way;
	memset(way, 0, n * sizeof *way);
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real *x = u[OPEN_POSITION].real[k] + begin, *from = u[OPEN_ANCHOR].real[k] + begin;
		quern_real *restrict along = w->along, *range = o->ways[chunk].along[k];
		keep(u[OPEN_POSITION].real[k] + begin, w->position[k], held, n);
		if (!o->coasts) keep(u[OPEN_VELOCITY].real[k] + begin, w->velocity[k], held, n);
		QUERN_SIMD
		for (uint32_t i = 0; i < n; i++) {
			along[i] = x[i] - from[i];
			way[i] += along[i] * along[i];
		}
		quern_dem_range(along, n, &range[0], &range[1]);
	}
	if (o->boxed)
		quern_dem_box_ways(&o->box, &u[OPEN_BOX_LISTED], begin, n,
			(quern_real *const[3]) { w->position[0], w->position[1], w->position[2] }, u[OPEN_ANCHOR].real,
			way);
	for (uint32_t k = 0; k < o->n_spin; k++) keep(u[OPEN_SPIN].real[k] + begin, w->spin[k], held, n);
	o->farthest[chunk] = most_of(way, held, n);
}

quern_status quern_dem_open(const void *self, const quern_step *s) {
	opening o = { .s = s, .bound = dem_integrator(s), .n = s->host->set(s->run, "grain").n };
	o.boxed = ((const dem *)self)->boxed;
	if (o.boxed) o.box = dem_box_at(s, &s->use[OPEN_BOX_LENGTH]);
	const quern_integrator_ops *ops = o.bound->ops;
	if (!ops->open[s->dim - 2] || !o.n) return QUERN_OK;
	o.coasts = ops->coasts;
	o.n_spin = s->use[OPEN_SPIN].real[0] && !o.coasts ? (s->dim == 3 ? 3 : 1) : 0;
	const uint32_t chunks = (o.n + CHUNK - 1) / CHUNK;
	o.farthest = s->host->memory(s->run, chunks * sizeof(quern_real));
	o.ways = s->host->memory(s->run, chunks * sizeof(ways));
	if (!o.farthest || !o.ways) return QUERN_E_MEMORY;
	s->host->parallel(s->run, chunks, open_chunk, &o);
	quern_real farthest = 0, *displacement = s->use[OPEN_DISPLACEMENT].real[0];
	for (uint32_t c = 0; c < chunks; c++) farthest = fmax(farthest, sqrt(o.farthest[c]));
	const quern_real now = s->time + (quern_real)s->within * s->dt,
					 *swept = s->settling ? NULL : s->use[OPEN_SWEPT].real[0];
	/* bodies are on their way through this step as well, which no sum has yet */
	const quern_real with_this =
		swept ? *swept + quern_bodies_speed(s, SLOT_BODIES, now, now + s->dt) * s->dt : 0;
	const bool alone = (s->settling || !s->use[OPEN_LENT].real[0]) && !o.boxed;
	*displacement =
		fmax(*displacement, quern_dem_used_of_skin(s, o.ways, chunks, farthest, with_this, alone));
	return QUERN_OK;
}
