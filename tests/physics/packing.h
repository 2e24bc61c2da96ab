/* SPDX-License-Identifier: MIT */
/* packing - regions filled cell by cell by a packer as plugins/dem/fill.c does, and what is measured of them. The folder of the
 * plugins is QUERN_PLUGINS_DIR, or "plugins". */
#pragma once
#include <quern/body.h>
#include <quern/packer.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../../plugins/common/placer.h"
#include "../../plugins/common/radius.h"
#include "random.h"

static const double pi = 3.14159265358979312;
static const quern_host host = { .abi = QUERN_ABI, .random = quern_random };
static const radius_law law = { .law = RADIUS_NORMAL, .mean = 1e-3, .spread = 0.1, .stream = 11 };

/* ==== a plugin with its defaults ==== */

typedef struct {
	void *file, *self;
	const quern_plugin *plugin;
} packer;

static inline void set_default(void *self, const quern_param *row) {
	char *member = (char *)self + row->offset;
	if (row->type == QUERN_T_INT) *(int32_t *)(void *)member = (int32_t)row->def;
	else if (row->type == QUERN_T_REAL) *(quern_real *)(void *)member = row->def;
	else if (row->type == QUERN_T_BOOL) *(bool *)(void *)member = row->def != 0;
	else fail_msg("no default for %s", row->name);
}

static inline packer open_packer(const char *id) {
	const char *folder = getenv("QUERN_PLUGINS_DIR");
	char path[4096];
	snprintf(path, sizeof path, "%s/%s.so", folder ? folder : "plugins", id);
	packer p = { .file = dlopen(path, RTLD_NOW | RTLD_LOCAL) };
	if (!p.file) fail_msg("%s", dlerror());
	const quern_library *library = dlsym(p.file, QUERN_LIBRARY_SYMBOL);
	assert_non_null(library);
	p.plugin = library->plugin;
	assert_string_equal(p.plugin->id, id);
	p.self = calloc(1, p.plugin->instance_size);
	assert_non_null(p.self);
	for (const quern_param *row = p.plugin->params; row->name; row++) set_default(p.self, row);
	return p;
}

static inline void close_packer(packer *p) {
	free(p->self);
	dlclose(p->file);
}

/* ==== the caller ==== */

typedef struct {
	uint32_t dim, most; /* stops after `most` grains */
	placer placer;
	uint64_t draws, forgotten; /* radii drawn; those that were drawn and given up with their region */
	bool forgets;
	uint32_t growth; /* QUERN_STAYS_SMALL, ... */
	quern_real lower[3], upper[3], cell_lower[3], cell_upper[3];
	bool last[3];
	uint32_t outside; /* placed with the centre outside their own cell */
	uint32_t after_stop;
	double seconds;
} filling;

static inline quern_real job_radius(quern_pack_job *job) {
	const filling *f = job->scene;
	return quern_radius_draw(&law, job->host, f->draws + f->forgotten);
}

static inline bool job_inside(const quern_pack_job *job, const quern_real x[3]) {
	const filling *f = job->scene;
	for (uint32_t k = 0; k < f->dim; k++)
		if (x[k] < f->cell_lower[k] || (f->last[k] ? x[k] > f->cell_upper[k] : x[k] >= f->cell_upper[k]))
			return false;
	return true;
}

static inline bool job_free(const quern_pack_job *job, const quern_spot *spot) {
	return quern_placer_free(&((const filling *)job->scene)->placer, spot);
}

static inline bool job_place(quern_pack_job *job, const quern_spot *spot) {
	filling *f = job->scene;
	f->after_stop += f->placer.n >= f->most;
	f->outside += !job_inside(job, spot->x);
	quern_placer_add(&f->placer, spot);
	f->draws++;
	return f->placer.n < f->most;
}

static inline void begin(filling *f, uint32_t dim, uint32_t cells, bool periodic) {
	*f = (filling) { .dim = dim, .most = UINT32_MAX };
	bool around[3] = { false };
	for (uint32_t k = 0; k < dim; k++) {
		f->upper[k] = cells * 4 * law.mean;
		around[k] = periodic;
	}
	assert_int_equal(
		quern_placer_init(&f->placer, dim, f->lower, f->upper, around, quern_radius_most(&law)), QUERN_OK);
}

/* Returns the counter that the packer left. */
static inline uint64_t fill_cell(filling *f, const packer *p, uint64_t key, uint64_t counter) {
	enum { MOST = 4096 };
	static quern_spot seed[MOST];
	quern_pack_job job = { .dim = f->dim,
		.stream = law.stream + 1,
		.key = key,
		.counter = counter,
		.host = &host,
		.seed = seed,
		.radius = job_radius,
		.inside = job_inside,
		.free = job_free,
		.place = job_place,
		.scene = f,
		.growth = f->growth };
	memcpy(job.lower, f->cell_lower, sizeof job.lower);
	memcpy(job.upper, f->cell_upper, sizeof job.upper);
	const uint32_t n =
		quern_placer_near(&f->placer, f->cell_lower, f->cell_upper, 4 * quern_radius_most(&law), seed, MOST);
	assert_true(n <= MOST);
	job.n_seed = n;
	const quern_packer_ops *ops = p->plugin->ops;
	ops->pack[f->dim - 2](p->self, &job);
	f->forgotten += f->forgets;
	return job.counter;
}

static inline void fill_region(filling *f, const packer *p) {
	uint32_t count[3] = { 1, 1, 1 };
	struct timespec from, to;
	for (uint32_t k = 0; k < f->dim; k++)
		count[k] = (uint32_t)floor((f->upper[k] - f->lower[k]) / (4 * law.mean) + 0.5);
	clock_gettime(CLOCK_MONOTONIC, &from);
	for (uint32_t z = 0; z < count[2]; z++)
		for (uint32_t y = 0; y < count[1]; y++)
			for (uint32_t x = 0; x < count[0] && f->placer.n < f->most; x++) {
				const uint32_t at[3] = { x, y, z };
				for (uint32_t k = 0; k < f->dim; k++) {
					const quern_real width = (f->upper[k] - f->lower[k]) / count[k];
					f->cell_lower[k] = f->lower[k] + at[k] * width;
					f->last[k] = at[k] + 1 == count[k];
					f->cell_upper[k] = f->last[k] ? f->upper[k] : f->lower[k] + (at[k] + 1) * width;
				}
				fill_cell(f, p, ((uint64_t)z * count[1] + y) * count[0] + x, 0);
			}
	clock_gettime(CLOCK_MONOTONIC, &to);
	f->seconds = (double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec);
	assert_false(f->placer.failed);
}

/* ==== measures, none of which asks the placer ==== */

static inline double volume(const filling *f) {
	double sum = 0;
	for (uint32_t i = 0; i < f->placer.n; i++) {
		const double r = f->placer.spot[i].radius;
		sum += f->dim == 2 ? pi * r * r : 4 * pi / 3 * r * r * r;
	}
	return sum;
}

static inline double region(const filling *f) {
	double product = 1;
	for (uint32_t k = 0; k < f->dim; k++) product *= f->upper[k] - f->lower[k];
	return product;
}

static inline double gap(const filling *f, const quern_spot *a, const quern_spot *b) {
	double d2 = 0;
	for (uint32_t k = 0; k < f->dim; k++) {
		double d = fabs(a->x[k] - b->x[k]);
		if (f->placer.periodic[k] && d > 0.5 * f->placer.length[k]) d = f->placer.length[k] - d;
		d2 += d * d;
	}
	return sqrt(d2) - (a->radius + b->radius);
}

static inline int by_x(const void *a, const void *b) {
	const double x = ((const quern_spot *)a)->x[0], y = ((const quern_spot *)b)->x[0];
	return (x > y) - (x < y);
}

typedef struct {
	double overlap;   /* over the smaller radius; negative: none touches another */
	double touchings; /* per grain, gaps below 1e-9 of a radius */
} touch_count;

/* All pairs closer than two largest diameters along x, in a copy sorted by it. */
static inline touch_count measure_pairs(const filling *f) {
	const uint32_t n = f->placer.n;
	const double reach = 2 * quern_radius_most(&law),
				 around = f->placer.periodic[0] ? f->placer.length[0] : 0;
	quern_spot *s = malloc((n + 1) * sizeof *s);
	assert_non_null(s);
	memcpy(s, f->placer.spot, n * sizeof *s);
	qsort(s, n, sizeof *s, by_x);
	touch_count t = { .overlap = -1 };
	for (uint32_t i = 0; i < n; i++)
		for (uint32_t step = 1; step < n; step++) {
			const uint32_t j = (i + step) % n;
			if (j < i && around == 0) break;
			if (s[j].x[0] + (j < i ? around : 0) - s[i].x[0] > reach) break;
			const double d = gap(f, &s[i], &s[j]), least = fmin(s[i].radius, s[j].radius);
			t.overlap = fmax(t.overlap, -d / least);
			t.touchings += d < 1e-9 * least ? 1 : 0;
		}
	t.touchings /= n;
	free(s);
	return t;
}

static inline double normal_below(double z) { return 0.5 * erfc(-z / sqrt(2)); }

static inline int by_value(const void *a, const void *b) {
	const double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

/* Kolmogorov and Smirnov's p against the normal law cut at two standard deviations; Stephens 1970 for finite n. */
static inline double radius_p(const filling *f) {
	const uint32_t n = f->placer.n;
	double *r = malloc((n + 1) * sizeof *r), most = 0, p = 0;
	assert_non_null(r);
	for (uint32_t i = 0; i < n; i++) r[i] = f->placer.spot[i].radius;
	qsort(r, n, sizeof *r, by_value);
	for (uint32_t i = 0; i < n; i++) {
		const double z = (r[i] / law.mean - 1) / law.spread;
		const double cdf = (normal_below(z) - normal_below(-2)) / (normal_below(2) - normal_below(-2));
		most = fmax(most, fmax(cdf - (double)i / n, (double)(i + 1) / n - cdf));
	}
	free(r);
	const double root = sqrt(n), lambda = (root + 0.12 + 0.11 / root) * most;
	for (int k = 1; k <= 100; k++) p += (k % 2 ? 2 : -2) * exp(-2 * k * k * lambda * lambda);
	return fmin(1, fmax(0, p));
}

/* Fowler, Noll and Vo's 64-bit hash of every bit of every spot. */
static inline uint64_t fingerprint(const filling *f) {
	uint64_t h = 14695981039346656037u;
	const unsigned char *byte = (const unsigned char *)f->placer.spot;
	for (size_t i = 0; i < f->placer.n * sizeof(quern_spot); i++) h = (h ^ byte[i]) * 1099511628211u;
	return h;
}

/* The faces of the cube from 0 to self[0], with the grains inside. */
static inline void closest_face(const void *self, const quern_body_batch *b) {
	const quern_real width = *(const quern_real *)self;
	for (uint32_t i = 0; i < b->n; i++) {
		quern_real least = INFINITY;
		for (uint32_t k = 0; k < b->dim; k++)
			least = fmin(least, fmin(b->position[k][i], width - b->position[k][i]));
		b->gap[i] = least - b->radius[i];
	}
}
