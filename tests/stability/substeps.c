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

static void row(int substeps) {
	const held h = held_open(0.04, 0.06, substeps, "two_point_tangent");
	double most[SPANS] = { 0 };
	const double share = h.grain_step * substeps / h.continuum_limit, top = held_top(&h);
	/* what explodes may take longer than what rests to show it: until its grains are out of the box */
	watch(&h, beyond_is_long() || share >= 2.5 ? 0.4 : 0.08, most);
	const double defect = quern_run_account(h.run).defect;
	beyond_row("%d | %.2f | %.1e | %.1e | %.1e | %.1e | %+.2f | %.0e | %s", substeps, share, most[0], most[1],
		most[2], most[3], (held_top(&h) - top) / 2e-3, defect, beyond_message(h.run));
	if (share <= 0.95 && h.run->status != QUERN_OK) fail_msg("%d substeps: %s", substeps, h.run->message);
	if (share <= 0.95 && !(fmax(most[2], most[3]) < 2e-3))
		fail_msg("%d substeps: it does not rest", substeps);
	/* half a unit in the last place for each grain step: what v += g dt rounds, docs/theory/hybrid.md */
	if (share <= 0.95 && !(defect <= 1e-12 + 1.2e-16 * (double)h.run->clock.substep))
		fail_msg("%d substeps: the ledger is off", substeps);
	if (share >= 2.5)
		beyond_expect_culprit(h.run, ", at t", strstr(beyond_message(h.run), "point") ? "point" : "grain");
	harness_close(h.run);
}

static void more_and_more_substeps(void **unused) {
	static const int substeps[] = { 1, 3, 10, 20, 30, 42, 50, 60, 80, 120, 200 };
	(void)unused;
	beyond_table(
		"A hybrid column at rest: largest kinetic energy over m g d of all grains, by quarter of the time",
		"substeps | step over the continuum's limit | 1st | 2nd | 3rd | 4th | top, diameters | ledger | what "
		"Quern "
		"says");
	for (size_t i = 0; i < sizeof substeps / sizeof *substeps; i++)
		if (beyond_is_long() || substeps[i] >= 10) row(substeps[i]);
}

int main(int argc, char **argv) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(more_and_more_substeps) };
	if (!beyond_begin(argc, argv, "substeps")) return 2;
	const int failed = cmocka_run_group_tests(tests, NULL, NULL);
	beyond_end();
	return failed;
}
