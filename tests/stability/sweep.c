/* SPDX-License-Identifier: MIT */
/* A hybrid column at rest whose zone is swept down by ten diameters and back, four times: grains become continuum and
 * continuum grains, and nothing else may happen. docs/stability.md, section 4 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "beyond.h"
#include "harness.h"
#include "held.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double diameter = 2e-3, start = 14e-3;
enum { CYCLES = 4, STRIDES = 20, STRIDE_UPDATES = 1 }; /* half a diameter per update */

/* Of a settled state, the worst of all cycles, of kinetic energy the mean over cycles of the largest in each, or the mean of that over states.
 * Which grains come where is chance, and the worst update of one cycle scatters by a third and more; means are what can be asked for: the
 * columns of the page's summary. */
typedef struct swept {
	double kinetic, lowest, highest, lost, carried,
		left;    /* lost: diameters of height; left: carried mass off in the end */
	double rest; /* kinetic energy over m g d in the end; of several the middle one */
} swept;
typedef struct limits {
	const char *packer;
	swept most;
} limits;
/* the shorter version gives it a fifth of the time to come to rest */
static const limits of_packer[] = { { "two_point_tangent", { 0.1, 0.05, 2.5, 2, 0.03, 0.01, 3e-3 } },
	{ "random", { 0.25, 0.03, 3.5, 3, 0.06, 0.02, 5e-3 } } };
static const double rest_of_shorter = 5e-2;

typedef struct book {
	double kinetic, lowest,
		highest;             /* largest over m g d; floor's push over the weight, means over an update */
	double carried, entries; /* worst of the carried mass over that at the start, minus one; ledger */
} book;

static double entries(quern_run *run, double mass) {
	const quern_column owed = harness_field(run, "cell.owed");
	double sum = 0;
	for (uint32_t c = 0; c < harness_count(run, "cell"); c++) sum += fabs(owed.real[0][c]);
	return sum / mass;
}

/* Long steps until the next update of the zones, and what happened on the way. */
static void go_on(const held *h, double mass, book *b) {
	const int32_t updates = harness_field(h->run, "total.updates").index[0];
	const double before = held_support(h), begin = quern_run_time(h->run);
	while (harness_field(h->run, "total.updates").index[0] == updates) {
		harness_steps(h->run, 1);
		b->kinetic = fmax(b->kinetic, held_kinetic(h));
	}
	const double push = (held_support(h) - before) / ((quern_run_time(h->run) - begin) * h->weight);
	const double carried = quern_run_carries(h->run, "mass") / mass - 1;
	b->lowest = fmin(b->lowest, push);
	b->highest = fmax(b->highest, push);
	b->carried = fabs(carried) > fabs(b->carried) ? carried : b->carried;
	b->entries = fmax(b->entries, entries(h->run, mass));
}

static void put(
	const held *h, const char *packer, int seed, const char *when, const book *b, double top, double mass) {
	const quern_account a = quern_run_account(h->run);
	beyond_row("%s | %d | %s | %.1e | %.2f ... %.2f | %+.2f | %+.4f | %+.4f | %.3f | %.0e | %u, %u", packer,
		seed, when, b->kinetic, b->lowest, b->highest, (held_top(h) - top) / diameter, b->carried,
		quern_account_of(&a, "mass") / mass - 1, b->entries, quern_account_of(&a, "defect"),
		harness_count(h->run, "grain"), harness_count(h->run, "point"));
}

static void take_worst(swept *w, const book *b, double lost) {
	w->kinetic += b->kinetic / CYCLES;
	w->lowest = fmin(w->lowest, b->lowest);
	w->highest = fmax(w->highest, b->highest);
	w->carried = fmax(w->carried, fabs(b->carried));
	w->lost = fmax(w->lost, lost);
}

static swept sweep(const char *packer, int seed) {
	swept w = { .lowest = INFINITY, .highest = -INFINITY, .lost = -INFINITY };
	const held h = held_open(0.04, 0.06, 20, packer, seed);
	double *depth = harness_param(h.run, "oracle.packing_fraction", "depth");
	assert_true(fabs(*depth - start) < 1e-12);
	harness_steps(h.run, 2);
	const double mass = h.weight / 9.81, top = held_top(&h);
	const int strides = STRIDES, each = beyond_is_long() ? 5 : STRIDE_UPDATES;
	book rest = { .lowest = INFINITY, .highest = -INFINITY };
	for (int i = 0; i < 5 * each; i++) go_on(&h, mass, &rest);
	put(&h, packer, seed, "at rest", &rest, top, mass);
	for (int cycle = 1; cycle <= CYCLES; cycle++) {
		book b = { .lowest = INFINITY, .highest = -INFINITY };
		char when[24];
		for (int way = 0; way < 2 * strides; way++) {
			*depth += (way < strides ? 0.5 : -0.5) * diameter;
			for (int i = 0; i < each; i++) go_on(&h, mass, &b);
		}
		snprintf(when, sizeof when, "cycle %d", cycle);
		put(&h, packer, seed, when, &b, top, mass);
		take_worst(&w, &b, (top - held_top(&h)) / diameter);
		if (!(quern_run_carries(h.run, "defect") <= 1e-12)) fail_msg("%s: the ledger is off", packer);
	}
	book last = { .lowest = INFINITY, .highest = -INFINITY };
	for (int i = 0; i < 10 * each; i++) go_on(&h, mass, &last);
	put(&h, packer, seed, "at rest again", &last, top, mass);
	w.rest = last.kinetic;
	w.left = fabs(quern_run_carries(h.run, "mass") / mass - 1);
	harness_close(h.run);
	return w;
}

static void add_state(swept *mean, const swept *w, int states) {
	mean->kinetic += w->kinetic / states;
	mean->lowest += w->lowest / states;
	mean->highest += w->highest / states;
	mean->lost += w->lost / states;
	mean->carried += w->carried / states;
	mean->left += w->left / states;
}

static void judge(const limits *l, const swept *w) {
	const swept *m = &l->most;
	const double rest = beyond_is_long() ? m->rest : rest_of_shorter;
	if (!(w->kinetic < m->kinetic)) fail_msg("%s: kinetic energy %g", l->packer, w->kinetic);
	if (!(w->lowest > m->lowest && w->highest < m->highest))
		fail_msg("%s: the floor feels it, %g to %g", l->packer, w->lowest, w->highest);
	if (!(w->carried < m->carried)) fail_msg("%s: carried mass %g", l->packer, w->carried);
	if (!(w->lost > -0.1 && w->lost < m->lost))
		fail_msg("%s: the column loses %g diameters", l->packer, w->lost);
	if (!(w->left < m->left)) fail_msg("%s: carried mass does not come back: %g", l->packer, w->left);
	if (!(w->rest < rest)) fail_msg("%s: it does not come to rest: %g", l->packer, w->rest);
}

static void zone_swept(void **unused) {
	(void)unused;
	beyond_table("A zone swept by ten diameters and back, four times",
		"packer | settled state | when | largest kinetic energy over m g d | floor's push over the weight | "
		"top, diameters | "
		"carried mass, worst | carried mass, last | entries over the mass | ledger | grains, points");
	for (size_t k = 0; k < 2; k++) {
		enum { STATES = 8 }; /* of three chance decided */
		double rest[STATES];
		swept mean = { .kinetic = 0 };
		for (int seed = 1; seed <= STATES; seed++) {
			const swept w = sweep(of_packer[k].packer, seed);
			add_state(&mean, &w, STATES);
			rest[seed - 1] = w.rest;
		}
		mean.rest = held_middle(rest, STATES);
		judge(&of_packer[k], &mean);
	}
}

int main(int argc, char **argv) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(zone_swept) };
	if (!beyond_begin(argc, argv, "sweep")) return 2;
	const int failed = cmocka_run_group_tests(tests, NULL, NULL);
	beyond_end();
	return failed;
}
