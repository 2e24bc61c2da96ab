/* SPDX-License-Identifier: MIT */
/* A hybrid column at rest with more and more grain steps in a step of the continuum, up to beyond the continuum's own limit.
 * docs/stability.md, section 3 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "beyond.h"
#include "harness.h"
#include "held.h"
#include <math.h>
#include <string.h>

enum { SPANS = 4 };

/* Largest kinetic energy in each quarter of the time. */
static void watch(const held *h, double time, double most[SPANS]) {
	for (int k = 0; k < SPANS; k++)
		while (h->run->status == QUERN_OK && quern_run_time(h->run) < time * (k + 1) / SPANS)
			if (harness_try(h->run, 1) == QUERN_OK) most[k] = fmax(most[k], held_kinetic(h));
}

/* The page's figures, with room for other settled states: over eight of them the first quarter has up to 1.9e-3, the last one
 * up to 1.1e-4, or 1.6e-4 in the shorter time. */
static const double release = 3e-3, rest = 4e-4;
enum { AT_ONCE = 20 }; /* steps */

static void row(int substeps, int seed) {
	const held h = held_open(0.04, 0.06, substeps, "two_point_tangent", seed);
	double most[SPANS] = { 0 };
	const double share = h.grain_step * substeps / h.continuum_limit, top = held_top(&h);
	watch(&h, beyond_is_long() ? 0.4 : 0.08, most);
	const double defect = quern_run_carries(h.run, "defect"), lifted = (held_top(&h) - top) / 2e-3;
	beyond_row("%d | %d | %.2f | %.1e | %.1e | %.1e | %.1e | %+.2f | %.0e | %s", substeps, seed, share,
		most[0], most[1], most[2], most[3], lifted, defect, beyond_message(h.run));
	if (share <= 0.95) {
		if (h.run->status != QUERN_OK) fail_msg("%d substeps: %s", substeps, h.run->message);
		for (int k = 0; k < SPANS; k++)
			if (!(most[k] < release)) fail_msg("%d substeps: it does not rest", substeps);
		if (!(most[SPANS - 1] < rest)) fail_msg("%d substeps: it does not come to rest", substeps);
		/* half a unit in the last place for each grain step: what v += g dt rounds, docs/theory/hybrid.md */
		if (!(defect <= 1e-12 + 1.2e-16 * (double)h.run->clock.substep))
			fail_msg("%d substeps: the ledger is off", substeps);
	}
	/* what explodes ends at once, before anything is thrown */
	if (share >= 2.5) {
		beyond_expect_culprit(h.run, ", at t", "point");
		if (h.run->clock.step > AT_ONCE || !(fabs(lifted) < 1)) fail_msg("%d substeps: too late", substeps);
	}
	harness_close(h.run);
}

static void more_and_more_substeps(void **unused) {
	static const int substeps[] = { 1, 3, 10, 20, 30, 42, 50, 60, 80, 100, 120, 200 };
	enum { SEED = 7, MORE = 5 };
	(void)unused;
	beyond_table(
		"A hybrid column at rest: largest kinetic energy over m g d of all grains, by quarter of the time",
		"substeps | settled state | step over the continuum's limit | 1st | 2nd | 3rd | 4th | top, diameters "
		"| "
		"ledger | what Quern says");
	for (size_t i = 0; i < sizeof substeps / sizeof *substeps; i++)
		if (beyond_is_long() || substeps[i] >= 10) row(substeps[i], SEED);
	for (int seed = 1; seed <= MORE; seed++) {
		if (beyond_is_long()) row(42, seed);
		row(120, seed);
	}
}

/* Somebody who knows better may switch it off. */
static void not_looked_at(void **unused) {
	(void)unused;
	const held h = held_open(0.04, 0.06, 120, "two_point_tangent", 7);
	*harness_param(h.run, "solver.hybrid", "gain") = 0;
	harness_steps(h.run, AT_ONCE);
	assert_true(held_kinetic(&h) > 10);
	harness_close(h.run);
}

int main(int argc, char **argv) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(more_and_more_substeps),
		cmocka_unit_test(not_looked_at) };
	if (!beyond_begin(argc, argv, "substeps")) return 2;
	const int failed = cmocka_run_group_tests(tests, NULL, NULL);
	beyond_end();
	return failed;
}
