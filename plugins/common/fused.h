/* SPDX-License-Identifier: MIT */
/* fused - rows in the parts that a processor takes at once, and a b + c with one rounding, the same bits on every processor */
#pragma once
#if defined __AVX__
#include <immintrin.h>
#endif
#include <quern/grid.h>

#if defined __AVX512F__ && defined __FMA__
#define QUERN_WHOLE_ROWS
#endif

/* Rows are cut here: a compiler that has to do so by itself passes each factor through memory, and waits for it. */
#if defined QUERN_WHOLE_ROWS
enum { PARTS = 1 };
#elif defined __AVX__
enum { PARTS = 2 };
#else
enum { PARTS = 4 };
#endif
enum { PART_LANES = QUERN_LANES / PARTS };
typedef quern_real row_part __attribute__((vector_size(PART_LANES * sizeof(quern_real)), may_alias));

/* The same in all lanes. */
QUERN_INLINE row_part part_of(quern_real x) {
#if defined QUERN_WHOLE_ROWS
	return (row_part) { x, x, x, x, x, x, x, x };
#elif defined __AVX__
	return (row_part) { x, x, x, x };
#else
	return (row_part) { x, x };
#endif
}

/* The first lanes of a, and those of b from lane `from` on, which may be before all of them or behind. */
QUERN_INLINE row_part part_join(row_part a, row_part b, const int from) {
#if defined QUERN_WHOLE_ROWS
	return (row_part)_mm512_mask_blend_pd((__mmask8)(0xff << from), (__m512d)a, (__m512d)b);
#else
	for (int l = from > 0 ? from : 0; l < PART_LANES; l++) a[l] = b[l];
	return a;
#endif
}

#if !defined __FMA__ && !defined __FP_FAST_FMA
/* What a processor without fused products makes of those that it has: Boldo and Melquiond, Emulation of a FMA and correctly rounded sums: proved
 * algorithms using rounding to odd, IEEE Trans. Comput. 57 (2008). Numbers whose parts would not be exact go to the library, which takes ten times as long. */
typedef int64_t part_bits __attribute__((vector_size(PART_LANES * sizeof(int64_t))));
typedef uint64_t part_size __attribute__((vector_size(PART_LANES * sizeof(uint64_t))));
typedef struct part_pair {
	row_part hi, lo;
} part_pair;

QUERN_INLINE part_pair part_sum(row_part a, row_part b) {
	const row_part hi = a + b, of_b = hi - a;
	return (part_pair) { hi, (a - (hi - of_b)) + (b - of_b) };
}
QUERN_INLINE part_pair part_split(row_part a) {
	const row_part many = 0x1p27 * a + a, hi = many - (many - a);
	return (part_pair) { hi, a - hi };
}
QUERN_INLINE part_pair part_product(row_part a, row_part b) {
	const part_pair x = part_split(a), y = part_split(b);
	const row_part hi = a * b;
	return (part_pair) { hi, x.lo * y.lo - (((hi - x.hi * y.hi) - x.lo * y.hi) - x.hi * y.lo) };
}
/* Towards zero, with the last bit set where something is lost. */
QUERN_INLINE row_part part_sum_to_odd(row_part a, row_part b) {
	const part_pair s = part_sum(a, b);
	const part_bits lost = s.lo != 0,
					beyond = (part_bits)((part_size)((part_bits)s.hi ^ (part_bits)s.lo) >> 63);
	return (row_part)(((part_bits)s.hi - (beyond & lost)) | (lost & 1));
}
/* Sums near to zero, and infinite ones, are those of a weight that is nothing, or the library's. */
static inline row_part part_fma_apart(row_part a, row_part b, row_part c) {
	const part_pair u = part_product(a, b), t = part_sum(c, u.lo), v = part_sum(u.hi, t.hi);
	const row_part all = v.hi + part_sum_to_odd(t.lo, v.lo), square = all * all;
	const part_bits sound = (square > 0x1p-1000) & (square < 0x1p1000);
	row_part sum = all;
	for (int l = 0; l < PART_LANES; l++)
		if (!sound[l]) sum[l] = a[l] == 0 || b[l] == 0 ? a[l] * b[l] + c[l] : __builtin_fma(a[l], b[l], c[l]);
	return sum;
}
#endif

QUERN_INLINE row_part part_fma(row_part a, row_part b, row_part c) {
#if defined QUERN_WHOLE_ROWS
	return (row_part)_mm512_fmadd_pd((__m512d)a, (__m512d)b, (__m512d)c);
#elif defined __AVX__ && defined __FMA__
	return (row_part)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c);
#elif defined __FMA__ || defined __FP_FAST_FMA
	for (int l = 0; l < PART_LANES; l++) c[l] = __builtin_fma(a[l], b[l], c[l]);
	return c;
#else
	return part_fma_apart(a, b, c);
#endif
}

/* The first half of a row, or of the part of it that there is. */
#if defined QUERN_WHOLE_ROWS
typedef quern_real half_part __attribute__((vector_size(4 * sizeof(quern_real)), may_alias));
QUERN_INLINE half_part half_of(row_part a) { return (half_part)_mm512_castpd512_pd256((__m512d)a); }
QUERN_INLINE half_part half_with(quern_real x) { return (half_part) { x, x, x, x }; }
QUERN_INLINE half_part half_fma(half_part a, half_part b, half_part c) {
	return (half_part)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c);
}
#else
typedef row_part half_part;
QUERN_INLINE half_part half_of(row_part a) { return a; }
QUERN_INLINE half_part half_with(quern_real x) { return part_of(x); }
QUERN_INLINE half_part half_fma(half_part a, half_part b, half_part c) { return part_fma(a, b, c); }
#endif
