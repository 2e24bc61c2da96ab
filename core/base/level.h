/* SPDX-License-Identifier: MIT */
/* level - which of the instruction sets x86-64-v1, v3 and v4 a processor has, all of each */
#pragma once
#include <stdint.h>

/* What a processor says of itself: registers of CPUID, by leaf, and the states that the system saves. */
typedef struct quern_processor {
	uint32_t one_c;      /* leaf 1, ECX */
	uint32_t seven_b;    /* leaf 7, EBX */
	uint32_t extended_c; /* leaf 0x80000001, ECX */
	uint64_t saved;      /* XCR0; 0: none */
} quern_processor;

/* 1, 3 or 4: objects built for this level run on it. */
int quern_level_of(const quern_processor *);
/* The same of the processor at hand. */
int quern_level_here(void);
