/* SPDX-License-Identifier: MIT */
/* a b + c has one rounding, with and without a processor's own: where the three nearly cancel, lie between two numbers, or are far apart. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <common/fused.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { TRIALS = 1000000 };

static uint64_t next(uint64_t *state) {
	*state ^= *state << 13, *state ^= *state >> 7, *state ^= *state << 17;
	return *state;
}

/* A number of `span` binary orders around one, of which `bits` of the mantissa are left. */
static quern_real some(uint64_t *state, int span, int bits) {
	const uint64_t u = next(state);
	const int64_t whole = (int64_t)(u >> 12 | 1ull << 52) & (int64_t)(~0ull << (52 - bits));
	const quern_real x = ldexp((quern_real)whole, (int)(u % (uint64_t)(2 * span + 1)) - span - 52);
	return u >> 11 & 1 ? x : -x;
}

static void hold(quern_real a, quern_real b, quern_real c) {
	row_part x = part_of(1), y = part_of(2), z = part_of(3);
	for (int l = 0; l < PART_LANES; l++) {
		row_part u = x, v = y, w = z, want;
		u[l] = a, v[l] = b, w[l] = c;
		for (int k = 0; k < PART_LANES; k++) want[k] = fma(u[k], v[k], w[k]);
		const row_part is = part_fma(u, v, w);
		for (int k = 0; k < PART_LANES; k++)
			if (memcmp((const char *)&is + (size_t)k * sizeof a, (const char *)&want + (size_t)k * sizeof a,
					sizeof a) &&
				!(isnan(is[k]) && isnan(want[k])))
				fail_msg("%a times %a and %a: %a, not %a", u[k], v[k], w[k], is[k], want[k]);
	}
}

static void random_numbers(void **unused) {
	uint64_t state = 88172645463325252u;
	(void)unused;
	for (int k = 0; k < TRIALS; k++) {
		const int span = k % 3 ? 2 : 60, bits = k % 5 ? 52 : 20;
		const quern_real a = some(&state, span, bits), b = some(&state, span, bits);
		hold(a, b, some(&state, 2 * span, bits));
		/* near to nothing */
		hold(a, b, -(a * b));
		hold(a, b, nextafter(-(a * b), k & 1 ? INFINITY : -INFINITY));
	}
}

/* What lies just beside the middle of two numbers is rounded twice by those who do so. */
static void beside_the_middle(void **unused) {
	uint64_t state = 3;
	(void)unused;
	for (int k = 0; k < TRIALS; k++) {
		const quern_real a = some(&state, 3, 26), b = some(&state, 3, 26), c = some(&state, 3, 52);
		hold(a, b, ldexp(c, 53));
		hold(a, b, ldexp(c, 54));
		hold(1 + 0x1p-52 * (quern_real)(k % 64), 0x1p-53 * (1 + 0x1p-52 * (k % 7 - 3)), k & 64 ? 1 : -1);
	}
}

static void at_the_ends(void **unused) {
	static const quern_real at[] = { 0, -0.0, 1, -1, 0x1p-1074, -0x1p-1074, 0x1p-1022, 0x1.8p-1022, 0x1p-540,
		0x1.fffffffffffffp-537, -0x1.8p-537, 0x1p-300, 0x1p-250, -0x1.0000000000001p-250, 0x1p500, -0x1p600,
		0x1.fffffffffffffp1023, INFINITY, -INFINITY, NAN, 0x1.0000000000001p0, 3 };
	enum { N = sizeof at / sizeof at[0] };
	(void)unused;
	for (int i = 0; i < N; i++)
		for (int j = 0; j < N; j++)
			for (int k = 0; k < N; k++) hold(at[i], at[j], at[k]);
}

int main(void) {
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(random_numbers),
		cmocka_unit_test(beside_the_middle),
		cmocka_unit_test(at_the_ends),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
