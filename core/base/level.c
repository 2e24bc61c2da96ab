/* SPDX-License-Identifier: MIT */
#include "level.h"
#include <cpuid.h>
#include <stdbool.h>
#include <stddef.h>

/* The psABI's lists; what v2 asks for beyond the first set is part of v3. */
enum {
	SSE3 = 1u << 0,
	SSSE3 = 1u << 9,
	FMA = 1u << 12,
	CMPXCHG16B = 1u << 13,
	SSE4_1 = 1u << 19,
	SSE4_2 = 1u << 20,
	MOVBE = 1u << 22,
	POPCNT = 1u << 23,
	OSXSAVE = 1u << 27,
	AVX = 1u << 28,
	F16C = 1u << 29
};
enum { LAHF = 1u << 0, LZCNT = 1u << 5 };
enum { BMI1 = 1u << 3, AVX2 = 1u << 5, BMI2 = 1u << 8 };
#define AVX512 (1u << 16 | 1u << 17 | 1u << 28 | 1u << 30 | 1u << 31) /* F, DQ, CD, BW, VL */
enum { SAVED_AVX = 6, SAVED_AVX512 = 0xe6 };

static bool has(uint64_t what, uint64_t all) { return (what & all) == all; }

int quern_level_of(const quern_processor *p) {
	const bool v3 = has(p->one_c, SSE3 | SSSE3 | FMA | CMPXCHG16B | SSE4_1 | SSE4_2 | MOVBE | POPCNT |
									  OSXSAVE | AVX | F16C) &&
					has(p->extended_c, LAHF | LZCNT) && has(p->seven_b, BMI1 | AVX2 | BMI2) &&
					has(p->saved, SAVED_AVX);
	if (!v3) return 1;
	return has(p->seven_b, AVX512) && has(p->saved, SAVED_AVX512) ? 4 : 3;
}

int quern_level_here(void) {
	quern_processor p = { 0 };
	uint32_t a, b, c, d;
	if (__get_cpuid(1, &a, &b, &c, &d)) p.one_c = c;
	if (__get_cpuid_count(7, 0, &a, &b, &c, &d)) p.seven_b = b;
	if (__get_cpuid(0x80000001u, &a, &b, &c, &d)) p.extended_c = c;
	if (p.one_c & OSXSAVE) {
		__asm__ volatile("xgetbv" : "=a"(a), "=d"(d) : "c"(0));
		p.saved = (uint64_t)d << 32 | a;
	}
	return quern_level_of(&p);
}
