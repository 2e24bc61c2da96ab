/* SPDX-License-Identifier: MIT */
/* Instruction sets: an object built for a level may use all of it, so a processor that lacks one part has not the level. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <level.h>

/* Bits of CPUID as the processors' manuals name them. */
enum { ECX1, EBX7, ECX81, XCR0 };
static const struct {
	const char *name;
	int word, bit, level; /* the level that is left without it */
} parts[] = { { "SSE3", ECX1, 0, 1 }, { "SSSE3", ECX1, 9, 1 }, { "FMA", ECX1, 12, 1 },
	{ "CMPXCHG16B", ECX1, 13, 1 }, { "SSE4.1", ECX1, 19, 1 }, { "SSE4.2", ECX1, 20, 1 },
	{ "MOVBE", ECX1, 22, 1 }, { "POPCNT", ECX1, 23, 1 }, { "OSXSAVE", ECX1, 27, 1 }, { "AVX", ECX1, 28, 1 },
	{ "F16C", ECX1, 29, 1 }, { "BMI1", EBX7, 3, 1 }, { "AVX2", EBX7, 5, 1 }, { "BMI2", EBX7, 8, 1 },
	{ "AVX512F", EBX7, 16, 3 }, { "AVX512DQ", EBX7, 17, 3 }, { "AVX512CD", EBX7, 28, 3 },
	{ "AVX512BW", EBX7, 30, 3 }, { "AVX512VL", EBX7, 31, 3 }, { "LAHF", ECX81, 0, 1 },
	{ "LZCNT", ECX81, 5, 1 }, { "saved SSE", XCR0, 1, 1 }, { "saved AVX", XCR0, 2, 1 },
	{ "saved masks", XCR0, 5, 3 }, { "saved upper halves", XCR0, 6, 3 },
	{ "saved upper registers", XCR0, 7, 3 } };

static quern_processor without(int word, int bit) {
	quern_processor p = { ~0u, ~0u, ~0u, ~0ull };
	const uint64_t mask = ~(1ull << bit);
	if (word == ECX1) p.one_c &= (uint32_t)mask;
	if (word == EBX7) p.seven_b &= (uint32_t)mask;
	if (word == ECX81) p.extended_c &= (uint32_t)mask;
	if (word == XCR0) p.saved &= mask;
	return p;
}

static void every_part_counts(void **state) {
	const quern_processor all = { ~0u, ~0u, ~0u, ~0ull }, none = { 0 };
	(void)state;
	assert_int_equal(quern_level_of(&all), 4);
	assert_int_equal(quern_level_of(&none), 1);
	for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
		const quern_processor p = without(parts[i].word, parts[i].bit);
		if (quern_level_of(&p) != parts[i].level)
			fail_msg("without %s the level is %d", parts[i].name, quern_level_of(&p));
	}
}

/* The level found here is one of a processor that can run this test's own compiler's code for it. */
static void here(void **state) {
	(void)state;
	__builtin_cpu_init();
	const int level = quern_level_here();
	assert_true(level == 1 || level == 3 || level == 4);
	if (level >= 3) assert_true(__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"));
	if (level == 4) assert_true(__builtin_cpu_supports("avx512vl"));
	if (level < 4 && __builtin_cpu_supports("avx512vl")) print_message("AVX-512 in part, or not saved\n");
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(every_part_counts), cmocka_unit_test(here) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
