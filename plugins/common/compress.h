/* SPDX-License-Identifier: MIT */
/* compress - the wanted ones of many entries, in order, and back to where they came from. With AVX-512 eight or sixteen at once:
 * one by one every entry waits for the place of the one before it. The results are the same. */
#pragma once
#include <quern/abi.h>
#ifdef __AVX512VL__
#include <immintrin.h>
#endif

/* Which of 16 entries are wanted, by bit. */
typedef uint16_t compress_bits;
enum { COMPRESS = 16 };

/* Whose `wanted` is not 0: their numbers go to `which`, which may be `wanted` itself, their bits, unless NULL, to `bits`; returns how
 * many there are. There is room in both for n rounded up to whole COMPRESS, as behind `wanted`. */
QUERN_INLINE uint32_t quern_compress_numbers(
	uint32_t n, const int32_t *wanted, int32_t *which, compress_bits *bits) {
	uint32_t kept = 0;
#ifdef __AVX512VL__
	__m512i number = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
	for (uint32_t k = 0; k < n; k += COMPRESS) {
		const uint32_t there = n - k < COMPRESS ? (1u << (n - k)) - 1 : 0xffff;
		const __m512i flag = _mm512_loadu_si512(wanted + k);
		const __mmask16 is = (__mmask16)(_mm512_test_epi32_mask(flag, flag) & there);
		_mm512_storeu_si512(which + kept, _mm512_maskz_compress_epi32(is, number));
		number = _mm512_add_epi32(number, _mm512_set1_epi32(COMPRESS));
		if (bits) bits[k / COMPRESS] = is;
		kept += (uint32_t)__builtin_popcount(is);
	}
#else
	(void)bits;
	for (uint32_t k = 0; k < n; k++) {
		const int32_t is = wanted[k] != 0;
		which[kept] = (int32_t)k;
		kept += (uint32_t)is;
	}
#endif
	return kept;
}

#ifdef __AVX512VL__
QUERN_INLINE void quern_compress_real(
	uint32_t n, const compress_bits *bits, const quern_real *from, quern_real *to) {
	for (uint32_t k = 0; k < n; k += 8) {
		const __mmask8 is = (__mmask8)(bits[k / COMPRESS] >> k % COMPRESS);
		_mm512_storeu_pd(to, _mm512_maskz_compress_pd(is, _mm512_maskz_loadu_pd(is, from + k)));
		to += __builtin_popcount(is);
	}
}
/* Back: who was not wanted gets `other`. */
QUERN_INLINE void quern_expand_real(
	uint32_t n, const compress_bits *bits, const quern_real *from, quern_real *to, quern_real other) {
	const __m512d rest = _mm512_set1_pd(other);
	for (uint32_t k = 0; k < n; k += 8) {
		const __mmask8 is = (__mmask8)(bits[k / COMPRESS] >> k % COMPRESS);
		const __m512d all = _mm512_mask_expand_pd(rest, is, _mm512_loadu_pd(from));
		if (n - k >= 8) _mm512_storeu_pd(to + k, all);
		else _mm512_mask_storeu_pd(to + k, (__mmask8)((1u << (n - k)) - 1), all);
		from += __builtin_popcount(is);
	}
}
#endif
