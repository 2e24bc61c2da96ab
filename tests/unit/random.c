/* SPDX-License-Identifier: MIT */
/* Random numbers: the generator's known answers, and uniforms that depend on their three numbers alone. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <random.h>

/* Known-answer vectors of Random123 1.14 (Salmon et al. 2011), philox4x32-10. */
static void known_answers(void **state) {
	static const struct {
		uint32_t counter[4], key[2], wanted[4];
	} vectors[] = {
		{ { 0, 0, 0, 0 }, { 0, 0 }, { 0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8 } },
		{ { 0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff }, { 0xffffffff, 0xffffffff },
			{ 0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd } },
		{ { 0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344 }, { 0xa4093822, 0x299f31d0 },
			{ 0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1 } },
	};
	(void)state;
	for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
		uint32_t out[4];
		quern_philox(vectors[i].counter, vectors[i].key, out);
		assert_memory_equal(out, vectors[i].wanted, sizeof out);
	}
}

static void uniforms(void **state) {
	double sum = 0, square = 0, mixed = 0;
	enum { N = 100000 };
	(void)state;
	for (uint64_t i = 0; i < N; i++) {
		double u[2], again[2];
		quern_random(7, 3, i, u);
		quern_random(7, 3, i, again);
		assert_memory_equal(u, again, sizeof u);
		assert_true(u[0] >= 0 && u[0] < 1 && u[1] >= 0 && u[1] < 1);
		sum += u[0] + u[1];
		square += u[0] * u[0] + u[1] * u[1];
		mixed += u[0] * u[1];
	}
	assert_true(sum / (2 * N) > 0.497 && sum / (2 * N) < 0.503);
	assert_true(square / (2 * N) > 0.331 && square / (2 * N) < 0.336);
	assert_true(mixed / N > 0.247 && mixed / N < 0.253);
}

/* Each of stream, key and counter, in its low and its high half, gives other numbers. */
static void separate(void **state) {
	static const uint64_t words[][3] = { { 1, 2, 3 }, { 2, 2, 3 }, { 1, 3, 3 }, { 1, 2, 4 },
		{ 1ull << 32 | 1, 2, 3 }, { 1, 1ull << 32 | 2, 3 }, { 1, 2, 1ull << 32 | 3 } };
	enum { N = sizeof words / sizeof *words };
	double u[N][2];
	(void)state;
	for (int i = 0; i < N; i++) quern_random(words[i][0], words[i][1], words[i][2], u[i]);
	for (int i = 0; i < N; i++)
		for (int k = 0; k < i; k++) assert_true(u[i][0] != u[k][0] && u[i][1] != u[k][1]);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(known_answers), cmocka_unit_test(uniforms),
		cmocka_unit_test(separate) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
