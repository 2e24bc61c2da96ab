/* SPDX-License-Identifier: MIT */
/* What the packers reach and what they must never do, on regions filled cell by cell as plugins/dem/fill.c does.
 * docs/theory/packers.md quotes the table. */
#define _POSIX_C_SOURCE 200809L /* clock_gettime */

#include "packing.h"

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
	{ .id = "packer.grid", .dim = 3, .cells = 10, .least = 0.46, .boxed = 0.43 },
	{ .id = "packer.circle_sweep", .dim = 3, .cells = 10, .least = 0.44, .boxed = 0.4 },
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
