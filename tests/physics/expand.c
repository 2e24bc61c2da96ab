/* SPDX-License-Identifier: MIT */
/* Grains that begin smaller than they are: how dense they are once they have grown. docs/theory/packers.md, section 7 */
#define _POSIX_C_SOURCE 200809L /* clock_gettime */

#include "packing.h"

static bool relax_inside(const quern_relax_job *job, const quern_real x[3]) {
	const filling *f = job->scene;
	for (uint32_t k = 0; k < f->dim; k++)
		if (!(x[k] >= f->lower[k] && x[k] <= f->upper[k])) return false;
	return true;
}

/* The face `body` of the box: 2 axis for the lower, 2 axis + 1 for the upper one. */
static quern_real relax_gap(
	const quern_relax_job *job, uint32_t body, const quern_spot *s, quern_real normal[3]) {
	const filling *f = job->scene;
	const uint32_t axis = body / 2;
	for (uint32_t k = 0; k < 3; k++) normal[k] = k == axis ? body % 2 ? -1 : 1 : 0;
	return (body % 2 ? f->upper[axis] - s->x[axis] : s->x[axis] - f->lower[axis]) - s->radius;
}

/* Of the whole fill; the placer has the grains afterwards. */
static void relax(filling *f, const packer *p) {
	const quern_packer_ops *ops = p->plugin->ops;
	const uint32_t n = f->placer.n;
	quern_spot *spot = malloc(n * sizeof *spot);
	quern_real *full = malloc(n * sizeof *full);
	assert_true(spot && full);
	memcpy(spot, f->placer.spot, n * sizeof *spot);
	for (uint32_t g = 0; g < n; g++) full[g] = quern_radius_draw(&law, &host, g);
	quern_relax_job job = { .dim = f->dim,
		.n = n,
		.n_bodies = f->placer.periodic[0] ? 0 : 2 * f->dim,
		.spot = spot,
		.full = full,
		.inside = relax_inside,
		.gap = relax_gap,
		.scene = f };
	memcpy(job.upper, f->upper, sizeof job.upper);
	for (uint32_t k = 0; k < 3; k++) job.periodic[k] = f->placer.periodic[k];
	assert_int_equal(ops->relax(p->self, &job), QUERN_OK);
	quern_placer_empty(&f->placer);
	for (uint32_t g = 0; g < n; g++) {
		assert_true(spot[g].radius == full[g] || spot[g].radius == 0);
		assert_true(relax_inside(&job, spot[g].x));
		if (spot[g].radius > 0) quern_placer_add(&f->placer, &spot[g]);
	}
	f->outside = n - f->placer.n;
	free(spot);
	free(full);
}

/* Grains that begin a little too small and grow together: as dense as grains at rest, endless and in a box, with hardly an overlap, with
 * the radii of the law, and of none taken away. The same again. */
static void grows_dense(void **state) {
	(void)state;
	static const struct {
		uint32_t dim, cells;
		bool periodic;
		double least;
	} cases[] = { { 2, 50, true, 0.8 }, { 2, 10, false, 0.74 }, { 3, 10, true, 0.58 }, { 3, 5, false, 0.5 } };
	packer expand = open_packer("packer.expand");
	for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
		uint64_t hash[2];
		for (int again = 0; again < 2; again++) {
			filling f;
			begin(&f, cases[c].dim, cases[c].cells, cases[c].periodic);
			const quern_real width = f.upper[0];
			const quern_body_ops walls = { .size = sizeof walls, .closest = closest_face };
			const quern_bound body = { .self = &width, .ops = &walls };
			f.placer.body = &body;
			f.placer.n_bodies = cases[c].periodic ? 0 : 1;
			f.growth = QUERN_GROWS_TOGETHER;
			fill_region(&f, &expand);
			relax(&f, &expand);
			hash[again] = fingerprint(&f);
			const double fraction = volume(&f) / region(&f), overlap = measure_pairs(&f).overlap;
			const double p = radius_p(&f);
			if (!again)
				printf(
					"  expand %u-D %s: %u grains, fraction %.4f, overlap %.4f of a radius, KS p %.2f, %u taken "
					"away\n",
					f.dim, cases[c].periodic ? "endless" : "in a box", f.placer.n, fraction, overlap, p,
					f.outside);
			assert_true(fraction >= cases[c].least && overlap <= 0.01 && p > 0.01);
			assert_int_equal(f.outside, 0);
			for (uint32_t g = 0; g < f.placer.n && !cases[c].periodic; g++)
				for (uint32_t k = 0; k < f.dim; k++) {
					const quern_spot *s = &f.placer.spot[g];
					assert_true(fmin(s->x[k], width - s->x[k]) >= 0.99 * s->radius);
				}
			quern_placer_finish(&f.placer);
		}
		assert_true(hash[0] == hash[1]);
	}
	close_packer(&expand);
}

/* Three times too many grains have no room: most are taken away, and what is left overlaps as little. */
static void takes_away_what_has_no_room(void **state) {
	(void)state;
	packer expand = open_packer("packer.expand");
	for (const quern_param *row = expand.plugin->params; row->name; row++)
		if (!strcmp(row->name, "start")) *(quern_real *)(void *)((char *)expand.self + row->offset) = 0.6;
	filling f;
	begin(&f, 2, 6, true);
	f.growth = QUERN_GROWS_TOGETHER;
	fill_region(&f, &expand);
	relax(&f, &expand);
	const double fraction = volume(&f) / region(&f);
	printf("  too many: %u taken away, %u stay, fraction %.4f\n", f.outside, f.placer.n, fraction);
	assert_true(f.outside > f.placer.n / 4 && fraction > 0.6 && measure_pairs(&f).overlap <= 0.01);
	quern_placer_finish(&f.placer);
	close_packer(&expand);
}

/* Where grains grow while the run goes on, holes get smaller ones, of half of their radius at least, and none overlaps; and no hole is left that
 * would take a larger one. */
static void fills_holes(void **state) {
	(void)state;
	packer expand = open_packer("packer.expand");
	for (uint32_t dim = 2; dim <= 3; dim++) {
		uint32_t small = 0, left = 0;
		filling f;
		begin(&f, dim, dim == 2 ? 20 : 6, true);
		f.growth = QUERN_GROWS_ALONE;
		fill_region(&f, &expand);
		for (uint32_t g = 0; g < f.placer.n; g++) {
			const double share = f.placer.spot[g].radius / quern_radius_draw(&law, &host, g);
			assert_true(share >= 0.5 && share <= 1);
			small += share < 1;
		}
		for (uint32_t g = 0; g < 100000; g++) { /* darts of 0.7 of the mean radius */
			quern_real u[4];
			quern_random(99, 1, 2 * (uint64_t)g, u);
			quern_random(99, 1, 2 * (uint64_t)g + 1, u + 2);
			quern_spot s = { .radius = 0.7 * law.mean };
			for (uint32_t k = 0; k < dim; k++) s.x[k] = u[k] * f.upper[k];
			left += quern_placer_free(&f.placer, &s);
		}
		printf("  %u-D: %u of %u grains begin smaller, %u of 100000 darts find room\n", dim, small,
			f.placer.n, left);
		assert_true(small > f.placer.n / 20 && left == 0 && measure_pairs(&f).overlap <= 1.001e-9);
		quern_placer_finish(&f.placer);
	}
	close_packer(&expand);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(grows_dense),
		cmocka_unit_test(takes_away_what_has_no_room), cmocka_unit_test(fills_holes) };
	return cmocka_run_group_tests_name("expand", tests, NULL, NULL);
}
