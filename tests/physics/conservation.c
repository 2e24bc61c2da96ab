/* SPDX-License-Identifier: MIT */
/* What a closed continuum keeps, with every shape and every transfer, in the plane and in space: mass to the bit, momentum to
 * round-off, and no energy comes from anywhere. docs/theory/transfers.md, section 6 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "table.h"
#include <string.h>

static const double wave = 25.8; /* m/s, of pressure */

typedef struct setting {
	const char *shape, *transfer;
	uint32_t dim;
	double step;   /* over the recommended one */
	bool trembles; /* every point moves as it likes; else the block swings */
} setting;

/* An elastic block in free flight over cells of 0.1 m. */
static quern_run *open_block(const setting *c, double step) {
	const bool deep = c->dim == 3;
	char word[40] = "";
	if (step > 0) snprintf(word, sizeof word, ", step: %.17g", step);
	return harness_open(1,
		"{quern: 1, dimension: %u, gravity: [0, 0%s], domain: {lower: [0, 0%s], upper: [2, 1%s]},\n"
		"time: {end: 1000%s}, output: {every: 1000, fields: [total.faces, point.energy]},\n"
		"continuum: {cell: 0.1, material: {elastic: {bulk_modulus: 1e6, poisson: 0.3, density: 1500}}, shape: %s,\n"
		"  transfer: {%s}, fill: [{region: {box: {lower: [0.3, 0.3%s], upper: [0.7, 0.7%s]}}}]}}\n",
		c->dim, deep ? ", 0" : "", deep ? ", 0" : "", deep ? ", 1" : "", word, c->shape, c->transfer,
		deep ? ", 0.3" : "", deep ? ", 0.7" : "");
}

/* m/s: over two cells; hats, whose step has no limit once points come near to the edge of nodes, stay where they are. */
static double drift(const setting *c) { return strcmp(c->shape, "linear") != 0 ? 0.7 : 0; }

static void set_going(quern_run *run, const setting *c) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		for (uint32_t k = 0; k < c->dim; k++) {
			double drawn[2];
			quern_host_table.random(2, k, i, drawn);
			v.real[k][i] = 1e-2 * wave * (c->trembles ? 2 * drawn[0] - 1 : 4 * (x.real[k][i] - 0.5)) +
						   (k ? 0 : drift(c));
		}
}

typedef struct sums {
	double mass, momentum[3], size, energy; /* of the motion about the middle */
} sums;

static sums sum(quern_run *run, uint32_t dim) {
	static const char *const names[] = { "momentum_x", "momentum_y", "momentum_z" };
	const quern_column v = harness_field(run, "point.velocity"), m = harness_field(run, "point.mass"),
					   booked = harness_field(run, "total.faces");
	sums s = { .mass = quern_run_carries(run, "mass"),
		.energy = quern_run_carries(run, "kinetic") + quern_run_carries(run, "elastic") };
	for (uint32_t k = 0; k < dim; k++) {
		const double momentum = quern_run_carries(run, names[k]);
		s.momentum[k] = momentum - booked.real[k][0];
		s.energy -= 0.5 * momentum * momentum / s.mass;
		for (uint32_t i = 0; i < harness_count(run, "point"); i++)
			s.size += m.real[0][i] * fabs(v.real[k][i]);
	}
	return s;
}

typedef struct result {
	bool same;                   /* mass, to the bit */
	double momentum, rise, left; /* gained, over those at the start, the most; of energy, at the end */
} result;

static result fly(const setting *c) {
	quern_run *run = open_block(c, 0);
	harness_steps(run, 1);
	const double step = c->step * run->clock.dt;
	harness_close(run);
	run = open_block(c, step);
	set_going(run, c);
	const sums before = sum(run, c->dim);
	result r = { true, 0, 0, 1 };
	while (quern_run_time(run) < (c->dim == 3 ? 0.05 : 0.3)) {
		harness_steps(run, 1);
		const sums now = sum(run, c->dim);
		r.same &= now.mass == before.mass;
		for (uint32_t k = 0; k < c->dim; k++)
			r.momentum = fmax(r.momentum, fabs(now.momentum[k] - before.momentum[k]) / before.size);
		r.left = now.energy / before.energy;
		r.rise = fmax(r.rise, r.left - 1);
	}
	harness_close(run);
	return r;
}

static const char *const shapes[] = { "gimp", "bspline", "linear" };
static const char *const transfers[] = { "picflip: {rate: 0}", "picflip: {rate: 30}", "picflip: {flip: 0.95}",
	"picflip: {rate: 1e300}", "apic", "apic: {moment: false}", "xpic: {order: 2}", "xpic: {order: 5}" };

/* Stresses are half a step ahead of velocities, so that energy goes up and down by a part that shrinks with the step; nothing else makes any. */
static bool try_setting(setting c) {
	static const double steps[] = { 0.8, 0.4, 0.2 };
	result r[3];
	char name[80];
	bool good = true;
	double momentum = 0;
	for (int k = 0; k < 3; k++) {
		c.step = steps[k];
		r[k] = fly(&c);
		good &= r[k].same;
		momentum = fmax(momentum, r[k].momentum);
	}
	snprintf(name, sizeof name, "%u-D %s, %s, %s", c.dim, c.shape, c.transfer,
		c.trembles ? "trembling" : "swinging");
	good &= table_row(name, momentum, 0, 1e-12);
	good &= table_row("  energy gained at 0.8 of the step", r[0].rise, 0, 0.3);
	good &= table_row("  at 0.4", r[1].rise, 0, 0.55 * r[0].rise);
	good &= table_row("  at 0.2", r[2].rise, 0, 0.55 * r[1].rise);
	table_note("  energy left at the end, at 0.2", r[2].left);
	return good;
}

static void all_is_kept(void **unused) {
	(void)unused;
	bool good = true;
	table_head("a block in free flight: momentum gained over sum m|v|, less what was booked");
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int k = 0; k < 3; k++)
			for (int t = 0; t < 8; t++)
				for (int trembles = 0; trembles < 2; trembles++)
					good &= try_setting((setting) { shapes[k], transfers[t], dim, 1, trembles });
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(all_is_kept) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
