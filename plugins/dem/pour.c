/* SPDX-License-Identifier: MIT */
/* pour - sources of grains: a packer places what is due where there is room. docs/theory/flow.md, section 3 */
#include "../common/placer.h"
#include "dem.h"
#include <math.h>
#include <quern/math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
	quern_spot spot;
	int32_t kind;
} poured;

typedef struct {
	const dem *d;
	const quern_step *s;
	const source *item;
	const dem_blend *of;
	region region;
	uint32_t i;      /* number of the source */
	int32_t kind;    /* material of the grain that waits */
	placer placer;   /* what is near the region */
	quern_real most; /* m, largest radius of that and of new grains */
	quern_real rest; /* kg still due */
	uint32_t draws;  /* radii of this source so far */
	poured *grain;
	uint32_t n, cap;
	bool failed;
} pouring;

/* Draws are numbered by source, so that its next grain does not depend on what others pour. */
static uint64_t draw_of(const pouring *p) { return (uint64_t)p->i << 32 | p->draws; }

static quern_real waiting(const pouring *p) {
	return quern_dem_radius(p->d, (uint32_t)p->kind, p->s->host, STREAM_SOURCES, draw_of(p));
}

static quern_real mass_of(const pouring *p, int32_t kind, quern_real radius) {
	return quern_radius_mass(radius, p->d->material[kind].density, p->s->dim);
}

static bool is_due(const pouring *p) { return p->rest >= mass_of(p, p->kind, waiting(p)); }

/* ---- of which material ---- */

/* kg, by material, with what their last bits do not hold. */
static quern_real *shares(const pouring *p, uint32_t row) {
	return p->s->use[row].real[0] + (size_t)p->i * p->d->n_materials;
}

static void choose_material(pouring *p) {
	p->kind = 0;
	if (p->of->mix.n)
		p->kind = quern_dem_mix(
			p->d, p->of->share, shares(p, POUR_SHARE_MASS), p->s->host, STREAM_SOURCES, draw_of(p));
	else
		while (!(p->of->share[p->kind] > 0)) p->kind++;
}

/* One of the scene's stages may change the shares: what was poured by others is not held against them. */
static void begin_mix(const pouring *p) {
	bool same = true;
	for (uint32_t k = 0; k < p->d->n_materials; k++)
		same = same && shares(p, POUR_SHARE)[k] == p->of->share[k];
	for (uint32_t k = 0; k < p->d->n_materials && !same; k++) {
		shares(p, POUR_SHARE)[k] = p->of->share[k];
		shares(p, POUR_SHARE_MASS)[k] = shares(p, POUR_SHARE_REST)[k] = 0;
	}
}

/* ---- what a packer may ask ---- */

static quern_real job_radius(quern_pack_job *job) { return waiting(job->scene); }

static bool job_inside(const quern_pack_job *job, const quern_real x[3]) {
	return quern_region_holds(&((const pouring *)job->scene)->region, x);
}

static bool job_free(const quern_pack_job *job, const quern_spot *spot) {
	return quern_placer_free(&((const pouring *)job->scene)->placer, spot);
}

static bool job_place(quern_pack_job *job, const quern_spot *spot) {
	pouring *p = job->scene;
	if (p->n == p->cap) {
		const uint32_t cap = p->cap ? 2 * p->cap : 256;
		poured *grown = realloc(p->grain, cap * sizeof *grown);
		if (!grown) return p->failed = true, false;
		p->grain = grown, p->cap = cap;
	}
	const quern_real mass = mass_of(p, p->kind, spot->radius);
	p->grain[p->n++] = (poured) { *spot, p->kind };
	quern_placer_add(&p->placer, spot);
	p->rest -= mass;
	if (p->of->mix.n)
		book_number(&shares(p, POUR_SHARE_MASS)[p->kind], &shares(p, POUR_SHARE_REST)[p->kind], mass);
	p->draws++;
	choose_material(p);
	p->failed = p->failed || p->placer.failed;
	return !p->failed && is_due(p);
}

/* ---- what is in the way ---- */

/* In the order of ids, since packers see the order of their seeds, and that of the columns is the list's affair. */
typedef struct {
	int64_t id;
	quern_spot spot;
} obstacle;

static int by_id(const void *a, const void *b) {
	const obstacle *one = a, *other = b;
	return (one->id > other->id) - (one->id < other->id);
}

/* Whether a new grain with its centre in the region may touch it. */
static bool is_near(const pouring *p, const quern_spot *spot) {
	const quern_real reach = 1.001 * (spot->radius + quern_dem_most(p->d, p->of->share));
	for (uint32_t k = 0; k < p->s->dim; k++) {
		const quern_real half = 0.5 * (p->item->upper[k] - p->item->lower[k]),
						 middle = p->item->lower[k] + half;
		const quern_real length = p->s->periodic[k] ? p->s->upper[k] - p->s->lower[k] : 0;
		if (fabs(quern_image_far(spot->x[k] - middle, length)) > half + reach) return false;
	}
	return true;
}

static uint32_t grains_near(pouring *p, obstacle *near) {
	const quern_step *s = p->s;
	uint32_t m = 0;
	for (uint32_t i = 0; i < s->host->set(s->run, "grain").n; i++) {
		obstacle o = { s->use[POUR_ID].id[i], { .radius = s->use[POUR_RADIUS].real[0][i] } };
		for (uint32_t k = 0; k < s->dim; k++) o.spot.x[k] = s->use[POUR_POSITION].real[k][i];
		if (is_near(p, &o.spot)) near[m++] = o;
	}
	qsort(near, m, sizeof *near, by_id);
	return m;
}

/* Where a continuum stands for grains there is no room either: a point counts as a grain as wide as its own square or cube. */
static uint32_t points_near(pouring *p, obstacle *near) {
	const quern_step *s = p->s;
	const quern_real *volume = s->use[POUR_POINT_VOLUME].real[0];
	uint32_t m = 0;
	if (!s->use[POUR_POINT].real[0] || !volume) return 0;
	const quern_parts *points = s->host->parts(s->run, "point");
	for (uint32_t q = 0; q < points->n; q++) {
		const uint32_t i = quern_nth(points->entry, q);
		const quern_real width = s->dim == 2 ? sqrt(volume[i]) : quern_cbrt(volume[i]);
		obstacle o = { 0, { .radius = 0.5 * width } };
		for (uint32_t k = 0; k < s->dim; k++) o.spot.x[k] = s->use[POUR_POINT].real[k][i];
		if (is_near(p, &o.spot)) near[m++] = o;
	}
	return m;
}

static bool gather_near(pouring *p) {
	const quern_step *s = p->s;
	const size_t all = (size_t)s->host->set(s->run, "grain").n + s->host->set(s->run, "point").n;
	obstacle *near = s->host->memory(s->run, (all + 1) * sizeof *near);
	if (!near) return false;
	uint32_t m = grains_near(p, near);
	m += points_near(p, near + m);
	p->most = quern_dem_most(p->d, p->of->share);
	for (uint32_t q = 0; q < m; q++) p->most = fmax(p->most, near[q].spot.radius);
	if (quern_placer_init(&p->placer, s->dim, s->lower, s->upper, s->periodic, p->most) != QUERN_OK ||
		!quern_placer_bodies(&p->placer, s, SLOT_BODIES, false))
		return false;
	for (uint32_t q = 0; q < m; q++) quern_placer_add(&p->placer, &near[q].spot);
	return !p->placer.failed;
}

/* ---- one source ---- */

static void pack(pouring *p, const quern_bound *packer) {
	const quern_step *s = p->s;
	uint32_t n = 0;
	quern_spot *seed = quern_placer_seeds(&p->placer, p->item->lower, p->item->upper, 2 * p->most, &n);
	if (!seed) {
		p->failed = true;
		return;
	}
	quern_pack_job job = { .dim = s->dim,
		.stream = p->d->stream + STREAM_SOURCES + 1,
		.key = p->i,
		.counter = (uint64_t)s->step << 24,
		.host = s->host,
		.seed = seed,
		.n_seed = n,
		.radius = job_radius,
		.inside = job_inside,
		.free = job_free,
		.place = job_place,
		.scene = p };
	memcpy(job.lower, p->item->lower, sizeof job.lower);
	memcpy(job.upper, p->item->upper, sizeof job.upper);
	((const quern_packer_ops *)packer->ops)->pack[s->dim - 2](packer->self, &job);
	free(seed);
}

static void write_grains(const pouring *p, uint32_t old) {
	const quern_step *s = p->s;
	const quern_column *u = s->use;
	const quern_real *v = p->item->velocity;
	for (uint32_t q = 0; q < p->n; q++) {
		const quern_spot *g = &p->grain[q].spot;
		booking b = { .mass = mass_of(p, p->grain[q].kind, g->radius), .count = 1 };
		for (uint32_t k = 0; k < s->dim; k++) {
			u[POUR_POSITION].real[k][old + q] = g->x[k];
			u[POUR_VELOCITY].real[k][old + q] = v[k];
			b.momentum[k] = b.mass * v[k];
			b.energy += 0.5 * b.mass * v[k] * v[k];
			b.potential -= b.mass * s->gravity[k] * g->x[k];
		}
		u[POUR_RADIUS].real[0][old + q] = g->radius;
		u[POUR_MASS].real[0][old + q] = b.mass;
		if (u[POUR_MATERIAL].index) u[POUR_MATERIAL].index[old + q] = p->grain[q].kind;
		book_add(&u[POURED_MASS], p->i, s->dim, &b);
	}
}

static quern_status add_grains(const pouring *p) {
	const quern_step *s = p->s;
	uint32_t old;
	const quern_status status = quern_source_room(s, "grain", "grains", p->n, &old);
	if (status != QUERN_OK) return status;
	write_grains(p, old);
	s->use[POUR_DISPLACEMENT].real[0][0] = INFINITY; /* the list misses new grains */
	return QUERN_OK;
}

static quern_status pour_one(pouring *p) {
	const quern_step *s = p->s;
	int32_t *draws = &s->use[POUR_DRAWS].index[p->i];
	p->draws = (uint32_t)*draws;
	if (p->of->mix.n) begin_mix(p);
	choose_material(p);
	p->rest = quern_source_due(p->item, s->time, p->i, &s->use[POUR_DUE]) - s->use[POURED_MASS].real[0][p->i];
	if (is_due(p)) {
		p->failed = !gather_near(p);
		if (!p->failed) pack(p, &s->slot[SLOT_SOURCE_PACKER][p->i]);
		quern_placer_finish(&p->placer);
		if (p->failed) return QUERN_E_MEMORY;
	}
	*draws = (int32_t)p->draws;
	quern_source_note(s, p->i, "grains", p->item, is_due(p) ? p->rest : 0, &s->use[POUR_WAITING]);
	const quern_status status = p->n ? add_grains(p) : QUERN_OK;
	quern_source_even(p->item, p->i, &s->use[POUR_DUE], &s->use[POURED_MASS]);
	return status;
}

quern_status quern_dem_pour(const void *self, const quern_step *s) {
	pouring p = { .d = self, .s = s };
	/* as many as the scene itself has, whatever one of its stages says */
	const uint32_t n = s->host->set(s->run, "grain_source").n;
	quern_status status = QUERN_OK;
	for (p.i = 0; p.i < p.d->source.n && p.i < n && status == QUERN_OK; p.i++) {
		const dem_source *item = (const dem_source *)p.d->source.items + p.i;
		p.item = &item->base, p.of = &item->of;
		p.region = quern_region_of(s, &s->slot[SLOT_SOURCE_REGION][p.i], p.item->lower, p.item->upper);
		p.n = 0;
		if (quern_source_acts(p.item, s)) status = pour_one(&p);
	}
	free(p.grain);
	return status;
}
