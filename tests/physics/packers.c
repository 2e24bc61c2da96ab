/* SPDX-License-Identifier: MIT */
/* What the packers reach and what they must never do, on regions filled cell by cell as plugins/dem/fill.c does.
 * The folder of the plugins is QUERN_PLUGINS_DIR, or "plugins". docs/theory/packers.md quotes the table. */
#define _POSIX_C_SOURCE 200809L /* clock_gettime */

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

static void set_default(void *self, const quern_param *row) {
	char *member = (char *)self + row->offset;
	if (row->type == QUERN_T_INT) *(int32_t *)(void *)member = (int32_t)row->def;
	else if (row->type == QUERN_T_REAL) *(quern_real *)(void *)member = row->def;
	else if (row->type == QUERN_T_BOOL) *(bool *)(void *)member = row->def != 0;
	else fail_msg("no default for %s", row->name);
}

static packer open_packer(const char *id) {
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

static void close_packer(packer *p) {
	free(p->self);
	dlclose(p->file);
}

/* ==== the caller ==== */

typedef struct {
	uint32_t dim, most; /* stops after `most` grains */
	placer placer;
	uint64_t draws, forgotten; /* radii drawn; those that were drawn and given up with their region */
	bool forgets;
	quern_real lower[3], upper[3], cell_lower[3], cell_upper[3];
	bool last[3];
	uint32_t outside; /* placed with the centre outside their own cell */
	uint32_t after_stop;
	double seconds;
} filling;

static quern_real job_radius(quern_pack_job *job) {
	const filling *f = job->scene;
	return quern_radius_draw(&law, job->host, f->draws + f->forgotten);
}

static bool job_inside(const quern_pack_job *job, const quern_real x[3]) {
	const filling *f = job->scene;
	for (uint32_t k = 0; k < f->dim; k++)
		if (x[k] < f->cell_lower[k] || (f->last[k] ? x[k] > f->cell_upper[k] : x[k] >= f->cell_upper[k]))
			return false;
	return true;
}

static bool job_free(const quern_pack_job *job, const quern_spot *spot) {
	return quern_placer_free(&((const filling *)job->scene)->placer, spot);
}

static bool job_place(quern_pack_job *job, const quern_spot *spot) {
	filling *f = job->scene;
	f->after_stop += f->placer.n >= f->most;
	f->outside += !job_inside(job, spot->x);
	quern_placer_add(&f->placer, spot);
	f->draws++;
	return f->placer.n < f->most;
}

static void begin(filling *f, uint32_t dim, uint32_t cells, bool periodic) {
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
static uint64_t fill_cell(filling *f, const packer *p, uint64_t key, uint64_t counter) {
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
		.scene = f };
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

static void fill_region(filling *f, const packer *p) {
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

static double volume(const filling *f) {
	double sum = 0;
	for (uint32_t i = 0; i < f->placer.n; i++) {
		const double r = f->placer.spot[i].radius;
		sum += f->dim == 2 ? pi * r * r : 4 * pi / 3 * r * r * r;
	}
	return sum;
}

static double region(const filling *f) {
	double product = 1;
	for (uint32_t k = 0; k < f->dim; k++) product *= f->upper[k] - f->lower[k];
	return product;
}

static double gap(const filling *f, const quern_spot *a, const quern_spot *b) {
	double d2 = 0;
	for (uint32_t k = 0; k < f->dim; k++) {
		double d = fabs(a->x[k] - b->x[k]);
		if (f->placer.periodic[k] && d > 0.5 * f->placer.length[k]) d = f->placer.length[k] - d;
		d2 += d * d;
	}
	return sqrt(d2) - (a->radius + b->radius);
}

static int by_x(const void *a, const void *b) {
	const double x = ((const quern_spot *)a)->x[0], y = ((const quern_spot *)b)->x[0];
	return (x > y) - (x < y);
}

typedef struct {
	double overlap;   /* over the smaller radius; negative: none touches another */
	double touchings; /* per grain, gaps below 1e-9 of a radius */
} touch_count;

/* All pairs closer than two largest diameters along x, in a copy sorted by it. */
static touch_count measure_pairs(const filling *f) {
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

static double normal_below(double z) { return 0.5 * erfc(-z / sqrt(2)); }

static int by_value(const void *a, const void *b) {
	const double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

/* Kolmogorov and Smirnov's p against the normal law cut at two standard deviations; Stephens 1970 for finite n. */
static double radius_p(const filling *f) {
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
static uint64_t fingerprint(const filling *f) {
	uint64_t h = 14695981039346656037u;
	const unsigned char *byte = (const unsigned char *)f->placer.spot;
	for (size_t i = 0; i < f->placer.n * sizeof(quern_spot); i++) h = (h ^ byte[i]) * 1099511628211u;
	return h;
}

/* ==== the fills that most tests look at ==== */

typedef struct {
	const char *id;
	uint32_t dim, cells;
	double least, boxed; /* packing fractions to reach: endless, and in a box 20 diameters wide */
	packer packer;
	filling f;
	double fraction, p;
	touch_count pairs;
} fill;

static fill fills[] = { { .id = "packer.random", .dim = 2, .cells = 50, .least = 0.42, .boxed = 0.4 },
	{ .id = "packer.grid", .dim = 2, .cells = 50, .least = 0.66, .boxed = 0.61 },
	{ .id = "packer.circle_sweep", .dim = 2, .cells = 50, .least = 0.7, .boxed = 0.64 },
	{ .id = "packer.two_point_tangent", .dim = 2, .cells = 50, .least = 0.76, .boxed = 0.71 },
	{ .id = "packer.random", .dim = 3, .cells = 16, .least = 0.25, .boxed = 0.22 },
	{ .id = "packer.grid", .dim = 3, .cells = 16, .least = 0.46, .boxed = 0.43 },
	{ .id = "packer.circle_sweep", .dim = 3, .cells = 16, .least = 0.44, .boxed = 0.4 },
	{ .id = "packer.two_point_tangent", .dim = 3, .cells = 16, .least = 0.54, .boxed = 0.515 } };
enum { N_FILLS = sizeof fills / sizeof *fills };

static int fill_all(void **state) {
	(void)state;
	printf("%-24s %3s %7s %9s %7s %12s %10s %9s %s\n", "packer", "dim", "grains", "fraction", "KS p",
		"overlap / r", "touchings", "us/grain", "hash");
	for (int i = 0; i < N_FILLS; i++) {
		fill *a = &fills[i];
		a->packer = open_packer(a->id);
		begin(&a->f, a->dim, a->cells, true);
		fill_region(&a->f, &a->packer);
		a->fraction = volume(&a->f) / region(&a->f);
		a->p = radius_p(&a->f);
		a->pairs = measure_pairs(&a->f);
		printf("%-24s %3u %7u %9.4f %7.3f %12.1e %10.3f %9.2f %016llx\n", a->id, a->dim, a->f.placer.n,
			a->fraction, a->p, a->pairs.overlap, a->pairs.touchings, 1e6 * a->f.seconds / a->f.placer.n,
			(unsigned long long)fingerprint(&a->f));
	}
	return 0;
}

static int drop_all(void **state) {
	(void)state;
	for (int i = 0; i < N_FILLS; i++) {
		quern_placer_finish(&fills[i].f.placer);
		close_packer(&fills[i].packer);
	}
	return 0;
}

/* An empty periodic region is filled at least as densely as the theory page says. */
static void reaches_its_fraction(void **state) {
	(void)state;
	for (int i = 0; i < N_FILLS; i++) assert_true(fills[i].fraction >= fills[i].least);
}

/* No two grains overlap by more than 1e-9 of a radius, across periodic faces neither. */
static void no_overlap(void **state) {
	(void)state;
	for (int i = 0; i < N_FILLS; i++) assert_true(fills[i].pairs.overlap <= 1.001e-9);
}

/* Every centre lies in the region, and in the cell whose job placed it. */
static void centres_inside(void **state) {
	(void)state;
	for (int i = 0; i < N_FILLS; i++) {
		const filling *f = &fills[i].f;
		assert_int_equal(f->outside, 0);
		for (uint32_t g = 0; g < f->placer.n; g++)
			for (uint32_t k = 0; k < f->dim; k++)
				assert_true(f->placer.spot[g].x[k] >= f->lower[k] && f->placer.spot[g].x[k] <= f->upper[k]);
	}
}

/* Grains of all sizes get in: the radii placed are those drawn, in that order, and follow the law. */
static void radii_follow_the_law(void **state) {
	(void)state;
	for (int i = 0; i < N_FILLS; i++) {
		const filling *f = &fills[i].f;
		assert_true(f->placer.n >= 2000);
		assert_true(fills[i].p > 0.01);
		for (uint32_t g = 0; g < f->placer.n; g++)
			assert_true(f->placer.spot[g].radius == quern_radius_draw(&law, &host, g));
	}
}

/* The test can tell: darts whose radius is drawn anew for every region place too many small grains. */
static void radii_drawn_anew_do_not(void **state) {
	(void)state;
	packer darts = open_packer("packer.random");
	filling f;
	begin(&f, 2, 50, true);
	f.forgets = true;
	fill_region(&f, &darts);
	double mean = 0;
	for (uint32_t g = 0; g < f.placer.n; g++) mean += f.placer.spot[g].radius / f.placer.n;
	printf("  radii drawn anew: %u grains, KS p %.2g, mean radius %.4f of the law's\n", f.placer.n,
		radius_p(&f), mean / law.mean);
	assert_true(f.placer.n >= 5000 && radius_p(&f) < 1e-3 && mean < law.mean);
	quern_placer_finish(&f.placer);
	close_packer(&darts);
}

/* A second fill gives the same bits. */
static void repeats(void **state) {
	(void)state;
	for (int i = 0; i < N_FILLS; i++) {
		filling again;
		begin(&again, fills[i].dim, fills[i].cells, true);
		fill_region(&again, &fills[i].packer);
		assert_int_equal(again.placer.n, fills[i].f.placer.n);
		assert_true(fingerprint(&again) == fingerprint(&fills[i].f));
		quern_placer_finish(&again.placer);
	}
}

/* A tangent grain touches two others when placed, in 3-D three: so many contacts per grain, but for the start. */
static void tangent_grains_touch(void **state) {
	(void)state;
	for (int i = 0; i < N_FILLS; i++)
		if (!strcmp(fills[i].id, "packer.two_point_tangent"))
			assert_true(fills[i].pairs.touchings >= 0.99 * fills[i].dim);
}

/* ==== single jobs ==== */

static void one_cell(filling *f, uint32_t dim) {
	begin(f, dim, 1, false);
	for (uint32_t k = 0; k < dim; k++) {
		f->cell_upper[k] = f->upper[k];
		f->last[k] = true;
	}
}

/* A packer stops at the grain whose place() says that it was enough. */
static void stops_when_told(void **state) {
	(void)state;
	for (int i = 0; i < N_FILLS; i++)
		for (uint32_t most = 1; most <= 3; most++) {
			filling f;
			one_cell(&f, fills[i].dim);
			f.most = most;
			fill_cell(&f, &fills[i].packer, 5, 0);
			assert_int_equal(f.placer.n, most);
			assert_int_equal(f.after_stop, 0);
			quern_placer_finish(&f.placer);
		}
}

/* Random numbers come from the job's counter on, and the counter is left behind the last one used. */
static void keeps_the_counter(void **state) {
	(void)state;
	for (int i = 0; i < N_FILLS; i++) {
		filling a, b;
		one_cell(&a, fills[i].dim);
		one_cell(&b, fills[i].dim);
		assert_true(fill_cell(&a, &fills[i].packer, 5, 0) > 0);
		assert_true(fill_cell(&b, &fills[i].packer, 5, 1000) > 1000);
		assert_true(fingerprint(&a) != fingerprint(&b));
		quern_placer_finish(&a.placer);
		quern_placer_finish(&b.placer);
	}
}

/* An empty region gets grains whatever lies around it: nothing, one grain out of touch, one beside it, or two whose
 * common neighbours would lie outside. */
static void starts_from_anything(void **state) {
	(void)state;
	static const struct {
		uint32_t n;
		double x, second; /* in radii */
	} around[] = { { 0, 0, 0 }, { 1, -3.5, 0 }, { 1, -0.5, 0 }, { 2, -1.2, -3.2 } };
	for (int i = 0; i < N_FILLS; i++)
		for (size_t a = 0; a < sizeof around / sizeof *around; a++) {
			filling f;
			one_cell(&f, fills[i].dim);
			for (uint32_t k = 0; k < around[a].n; k++) {
				quern_spot s = { .radius = law.mean };
				s.x[0] = (k ? around[a].second : around[a].x) * law.mean;
				for (uint32_t d = 1; d < f.dim; d++) s.x[d] = 2 * law.mean;
				quern_placer_add(&f.placer, &s);
			}
			fill_cell(&f, &fills[i].packer, 9, 0);
			assert_true(f.placer.n >= around[a].n + 2);
			quern_placer_finish(&f.placer);
		}
}

/* ==== walls ==== */

/* The faces of the cube from 0 to self[0], with the grains inside. */
static void closest_face(const void *self, const quern_body_batch *b) {
	const quern_real width = *(const quern_real *)self;
	for (uint32_t i = 0; i < b->n; i++) {
		quern_real least = INFINITY;
		for (uint32_t k = 0; k < b->dim; k++)
			least = fmin(least, fmin(b->position[k][i], width - b->position[k][i]));
		b->gap[i] = least - b->radius[i];
	}
}

/* No grain overlaps a wall, and a closed box is still filled. */
static void respects_walls(void **state) {
	(void)state;
	static const quern_body_ops ops = { .size = sizeof ops, .closest = closest_face };
	for (int i = 0; i < N_FILLS; i++) {
		filling f;
		begin(&f, fills[i].dim, 10, false);
		const quern_real width = f.upper[0];
		const quern_bound body = { .self = &width, .ops = &ops };
		f.placer.body = &body;
		f.placer.n_bodies = 1;
		fill_region(&f, &fills[i].packer);
		for (uint32_t g = 0; g < f.placer.n; g++)
			for (uint32_t k = 0; k < f.dim; k++) {
				const quern_spot *s = &f.placer.spot[g];
				assert_true(fmin(s->x[k], width - s->x[k]) >= s->radius * (1 - 1.001e-9));
			}
		assert_true(measure_pairs(&f).overlap <= 1.001e-9);
		const double fraction = volume(&f) / region(&f);
		printf("%-24s %3u %7u %9.4f in a box 20 diameters wide\n", fills[i].id, f.dim, f.placer.n, fraction);
		assert_true(fraction >= fills[i].boxed);
		quern_placer_finish(&f.placer);
	}
}

/* Grains on whole multiples of the cell's width, where the places beside round to either side: what overlaps one of them is
 * never free, and each is found by who looks for it. */
static void finds_what_lies_on_faces(void **state) {
	static const quern_real radii[] = { 1.2e-3, 1e-3, 0.7e-3, 1.0 / 3 };
	(void)state;
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (size_t r = 0; r < sizeof radii / sizeof *radii; r++)
			for (int periodic = 0; periodic <= 1; periodic++)
				for (int k = 1; k < 40; k++) {
					const quern_real radius = radii[r], width = 2 * radius;
					const quern_real lower[3] = { 0 }, upper[3] = { 50 * width, 50 * width, 50 * width };
					const bool around[3] = { periodic, periodic, periodic };
					placer p;
					assert_int_equal(quern_placer_init(&p, dim, lower, upper, around, radius), QUERN_OK);
					const quern_spot there = { .x = { k * width, k * width, dim == 3 ? k * width : 0 },
						.radius = radius };
					quern_placer_add(&p, &there);
					for (uint32_t a = 0; a < dim; a++)
						for (int side = -1; side <= 1; side += 2) {
							quern_spot beside = there, found[4];
							beside.x[a] += side * 0.999 * width;
							assert_false(quern_placer_free(&p, &beside));
							assert_int_equal(quern_placer_near(&p, beside.x, beside.x, width, found, 4), 1);
							beside.x[a] = there.x[a] + side * 1.001 * width;
							assert_true(quern_placer_free(&p, &beside));
						}
					quern_placer_finish(&p);
				}
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(reaches_its_fraction), cmocka_unit_test(no_overlap),
		cmocka_unit_test(centres_inside), cmocka_unit_test(radii_follow_the_law),
		cmocka_unit_test(radii_drawn_anew_do_not), cmocka_unit_test(repeats),
		cmocka_unit_test(tangent_grains_touch), cmocka_unit_test(stops_when_told),
		cmocka_unit_test(keeps_the_counter), cmocka_unit_test(starts_from_anything),
		cmocka_unit_test(respects_walls), cmocka_unit_test(finds_what_lies_on_faces) };
	return cmocka_run_group_tests_name("packers", tests, fill_all, drop_all);
}
