/* SPDX-License-Identifier: MIT */
/* check.packer - placing grains in a region: no overlap, nothing outside, the radius that waits, the same again */
#include <math.h>
#include <quern/check.h>
#include <quern/packer.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 4000 };
enum { EMPTY, SEEDED, WALLED, ROUND, REGIONS };

typedef struct {
	quern_pack_job job; /* first, so that a job is its packing */
	const quern_check_host *host;
	uint32_t shape, n, limit;
	quern_spot spot[MOST];
	quern_real full[MOST]; /* m: what each shall grow to */
	uint32_t overlaps, outside, other_radius, after_end, off_plane;
} packing;

static const double mean = 1e-3, side = 12e-3;

static double drawn(const packing *p) { return mean * p->host->uniform(150, p->n - p->job.n_seed, 0.8, 1.2); }

static quern_real radius(quern_pack_job *job) { return drawn((packing *)(void *)job); }

static bool inside(const quern_pack_job *job, const quern_real x[3]) {
	const packing *p = (const packing *)(const void *)job;
	double r2 = 0;
	for (uint32_t k = 0; k < job->dim; k++) {
		if (!(x[k] >= job->lower[k] && x[k] <= job->upper[k])) return false;
		r2 += pow(x[k] - 0.5 * side, 2);
	}
	return p->shape != ROUND || r2 <= 0.25 * side * side;
}

static bool is_free(const quern_pack_job *job, const quern_spot *s) {
	const packing *p = (const packing *)(const void *)job;
	if (p->shape == WALLED && s->x[job->dim - 1] < s->radius * (1 - 1e-9)) return false;
	for (uint32_t i = 0; i < p->n; i++) {
		double d2 = 0;
		for (uint32_t k = 0; k < job->dim; k++) d2 += pow(s->x[k] - p->spot[i].x[k], 2);
		const double reach = s->radius + p->spot[i].radius - 1e-9 * s->radius;
		if (d2 < reach * reach) return false;
	}
	return true;
}

static bool place(quern_pack_job *job, const quern_spot *s) {
	packing *p = (packing *)(void *)job;
	if (p->n >= p->limit) return p->after_end++, false;
	p->overlaps += !is_free(job, s);
	p->outside += !inside(job, s->x);
	const double waits = drawn(p);
	p->other_radius += job->growth ? !(s->radius > 0 && s->radius <= waits) : s->radius != waits;
	p->full[p->n] = waits;
	p->off_plane += job->dim == 2 && s->x[2] != 0;
	p->spot[p->n++] = *s;
	return p->n < p->limit;
}

static void begin(
	const quern_check *c, uint32_t dim, uint32_t shape, uint64_t key, uint32_t limit, packing *p) {
	memset(p, 0, sizeof *p);
	p->host = c->host;
	p->shape = shape;
	p->job = (quern_pack_job) { .dim = dim,
		.stream = 3,
		.key = key,
		.host = c->init,
		.radius = radius,
		.inside = inside,
		.free = is_free,
		.place = place };
	for (uint32_t k = 0; k < dim; k++) p->job.upper[k] = side;
	if (shape == SEEDED) { /* one inside, two beside it */
		static const double at[3][3] = { { 0.5, 0.5, 0.5 }, { -0.05, 0.5, 0.5 }, { 1.1, 0.3, 0.5 } };
		for (int s = 0; s < 3; s++, p->n++) {
			p->spot[s].radius = mean;
			for (uint32_t k = 0; k < dim; k++) p->spot[s].x[k] = at[s][k] * side;
		}
		p->job.n_seed = 3;
	}
	p->limit = p->n + limit;
}

/* The seeds stay where they were at the start while others are placed. */
static void pack(const quern_check *c, const quern_check_instance *it, packing *p) {
	const quern_packer_ops *ops = c->ops;
	quern_spot seed[3];
	memcpy(seed, p->spot, sizeof seed);
	p->job.seed = seed;
	c->host->place(c, "pack, %u-D, in region %u", it->dim, p->shape);
	ops->pack[it->dim - 2](it->self, &p->job);
	p->job.seed = NULL;
}

typedef struct {
	quern_check_tally overlap, inside, radius, end, again, grains, self, smaller, relaxes;
} tallies;

static void look(const packing *p, tallies *t) {
	const uint32_t dim = p->job.dim, n = p->n - p->job.n_seed;
	p->host->expect(&t->overlap, !p->overlaps,
		"%u-D: %u of %u grains overlap others or a wall by more than 1e-9", dim, p->overlaps, n);
	p->host->expect(&t->inside, !p->outside && !p->off_plane,
		"%u-D: %u of %u grains have their centre outside the region", dim, p->outside + p->off_plane, n);
	p->host->expect(&t->radius, !p->other_radius,
		"%u-D: %u of %u grains have another radius than the one that waits", dim, p->other_radius, n);
	p->host->expect(&t->end, !p->after_end, "%u-D: %u grains are placed after place() has said enough", dim,
		p->after_end);
	p->host->expect(&t->grains, n > 0, "%u-D: nothing is placed in an empty region", dim);
}

static bool same(const packing *a, const packing *b) {
	return a->n == b->n && a->job.counter == b->job.counter &&
		   !memcmp(a->spot, b->spot, a->n * sizeof *a->spot);
}

static void try_dimension(const quern_check *c, const quern_check_instance *it, packing p[2], tallies *t) {
	const uint32_t size = c->instance_size;
	void *before = c->host->memory(1, size);
	memcpy(before, it->self, size);
	for (uint32_t shape = 0; shape < REGIONS; shape++)
		for (uint64_t key = 0; key < 4; key++) {
			for (int i = 0; i < 2; i++) {
				begin(c, it->dim, shape, key, key == 3 ? 7 : MOST - 8, &p[i]);
				pack(c, it, &p[i]);
			}
			look(&p[0], t);
			c->host->expect(&t->again, same(&p[0], &p[1]),
				"%u-D: the same seed and counter give another packing", it->dim);
		}
	c->host->expect(&t->self, !memcmp(before, it->self, size), "%u-D: self changes", it->dim);
	free(before);
}

/* ==== grains that grow ==== */

/* Holes may get smaller grains than the one that waits, and no larger ones. */
static void try_smaller(const quern_check *c, const quern_check_instance *it, packing *p, tallies *t) {
	for (uint32_t shape = 0; shape < REGIONS; shape++) {
		begin(c, it->dim, shape, 6, MOST - 8, p);
		p->job.growth = QUERN_GROWS_ALONE;
		pack(c, it, p);
		c->host->expect(&t->smaller, !p->other_radius && !p->overlaps && !p->outside,
			"%u-D: of %u grains that grow alone %u are larger than the one that waits, %u overlap others, and %u lie "
			"outside",
			it->dim, p->n - p->job.n_seed, p->other_radius, p->overlaps, p->outside);
	}
}

static bool inside_relaxed(const quern_relax_job *job, const quern_real x[3]) {
	return inside(&((const packing *)job->scene)->job, x);
}

/* The floor of a walled region. */
static quern_real gap(const quern_relax_job *job, uint32_t body, const quern_spot *s, quern_real normal[3]) {
	(void)body;
	for (uint32_t k = 0; k < 3; k++) normal[k] = k + 1 == job->dim ? 1 : 0;
	return s->x[job->dim - 1] - s->radius;
}

static quern_real most_overlap(const packing *p) {
	quern_real most = 0;
	for (uint32_t i = 0; i < p->n; i++)
		for (uint32_t j = 0; j < i; j++) {
			const quern_spot *a = &p->spot[i], *b = &p->spot[j];
			double d2 = 0;
			if (i < p->job.n_seed || !(a->radius > 0 && b->radius > 0)) continue;
			for (uint32_t k = 0; k < p->job.dim; k++) d2 += pow(a->x[k] - b->x[k], 2);
			most = fmax(most, (a->radius + b->radius - sqrt(d2)) / fmin(a->radius, b->radius));
		}
	for (uint32_t i = p->job.n_seed; i < p->n && p->shape == WALLED; i++)
		most = fmax(most, 1 - p->spot[i].x[p->job.dim - 1] / p->spot[i].radius);
	return most;
}

static void relax(const quern_check *c, const quern_check_instance *it, packing *p) {
	const quern_packer_ops *ops = c->ops;
	const uint32_t seeds = p->job.n_seed;
	quern_spot seed[3];
	memcpy(seed, p->spot, sizeof seed);
	quern_relax_job job = { .dim = it->dim,
		.n = p->n - seeds,
		.n_around = seeds,
		.n_bodies = p->shape == WALLED,
		.spot = p->spot + seeds,
		.full = p->full + seeds,
		.around = seed,
		.inside = inside_relaxed,
		.gap = gap,
		.scene = p };
	for (uint32_t k = 0; k < 3; k++) job.lower[k] = -side, job.upper[k] = 2 * side;
	c->host->place(c, "relax, %u-D, in region %u", it->dim, p->shape);
	if (ops->relax(it->self, &job) != QUERN_OK) p->n = seeds;
}

static void try_relaxing(const quern_check *c, const quern_check_instance *it, packing p[2], tallies *t) {
	for (uint32_t shape = 0; shape < REGIONS; shape++) {
		uint32_t others = 0, gone = 0, outside = 0;
		for (int i = 0; i < 2; i++) {
			begin(c, it->dim, shape, 7, MOST - 8, &p[i]);
			p[i].job.growth = QUERN_GROWS_TOGETHER;
			pack(c, it, &p[i]);
			relax(c, it, &p[i]);
		}
		for (uint32_t g = p->job.n_seed; g < p->n; g++) {
			const quern_spot *s = &p->spot[g];
			gone += s->radius == 0;
			others += s->radius != 0 && s->radius != p->full[g];
			outside += !inside(&p->job, s->x);
		}
		const quern_real overlap = most_overlap(p);
		c->host->expect(&t->relaxes,
			!others && !outside && overlap <= 0.01 && 2 * gone < p->n - p->job.n_seed && same(&p[0], &p[1]),
			"%u-D: of %u grains %u have not their full radius, %u are taken away, %u lie outside; they overlap by "
			"%g of a radius at most; and a second call gives %s",
			it->dim, p->n - p->job.n_seed, others, gone, outside, overlap,
			same(&p[0], &p[1]) ? "the same" : "other places");
	}
}

static bool sane(const quern_check *c, const quern_check_instance *it, const char **why) {
	packing *p = c->host->memory(1, sizeof *p);
	begin(c, it->dim, EMPTY, 5, 20, p);
	pack(c, it, p);
	const bool good = !p->overlaps && !p->outside && !p->other_radius && !p->after_end;
	free(p);
	*why = "a placed grain";
	return good;
}

static void law(const quern_check *c) {
	tallies t = { { .name = "no overlap" }, { .name = "inside the region" },
		{ .name = "the radius that waits" }, { .name = "enough is enough" }, { .name = "the same again" },
		{ .name = "places grains" }, { .name = "self" }, { .name = "smaller ones" }, { .name = "relaxes" } };
	const quern_packer_ops *ops = c->ops;
	packing *p = c->host->memory(2, sizeof *p);
	for (uint32_t dim = 2; dim <= 3; dim++) {
		quern_check_instance *it = c->host->instance_create(c, dim, 0);
		if (it) try_dimension(c, it, p, &t);
		if (it && ops->shrinks) try_smaller(c, it, p, &t);
		if (it && ops->relax) try_relaxing(c, it, p, &t);
		c->host->instance_destroy(it);
	}
	free(p);
	c->host->tell(c, &t.grains, NULL);
	c->host->tell(c, &t.overlap, "none above 1e-9 of a radius");
	c->host->tell(c, &t.inside, NULL);
	c->host->tell(c, &t.radius, NULL);
	c->host->tell(c, &t.end, NULL);
	c->host->tell(c, &t.again, NULL);
	c->host->tell(c, &t.self, "self is left alone");
	if (ops->shrinks) c->host->tell(c, &t.smaller, "none larger than the grain that waits");
	if (ops->relax) c->host->tell(c, &t.relaxes, "full radii, no overlap above 1 %% of a radius");
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = {
	.size = sizeof ops, .kind = &quern_packer_kind, .sane = sane, .law = law
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.packer",
	.brief = "Grains placed in a region: no overlap, nothing outside, the same again.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
