/* SPDX-License-Identifier: MIT */
/* quern/math.h - elementary functions that give the same bits everywhere.
 *
 * libm's exp, log, pow and trigonometry differ between versions and, inside one version, between processors,
 * since it picks a variant with or without fma when the program starts. These differ nowhere: they consist of
 * + - * /, square roots, comparisons and integer operations, which IEEE 754 defines to the last bit. That
 * holds for gcc and clang on any x86-64, provided that compilers contract nothing to fma and reassociate nothing:
 * compile with -ffp-contract=off -fno-math-errno -fno-trapping-math, and never with -ffast-math. The rounding
 * mode is to nearest, subnormals are not flushed.
 *
 * Every function is free of branches and of table look-ups, so that a QUERN_SIMD loop over it vectorises;
 * both sides of every condition are computed, and one is selected. Errors are in ulp of the exact result, as
 * bounds that tests/unit/math.c asserts for 200 000 random arguments in each of its ranges;
 * results below 2^-1022 are left out. A result that is not a number is always the same one, quern_nan(),
 * except where an argument that is not a number is said to pass through.
 *
 * Polynomial coefficients were derived for this file: minimax on the range stated, by Remez exchange (for
 * exp, reweighted least squares) in 60 digits, rounded to double one by one, lowest first, the rest refitted
 * each time. The bound given with each set counts that rounding. */
#pragma once
#include <quern/abi.h>

#if defined(__FAST_MATH__) || __FLT_EVAL_METHOD__ != 0
#error "quern/math.h needs strict double arithmetic: SSE2, and no -ffast-math"
#endif

/* ==== pieces ==== */

/* hi + lo, unevaluated; |lo| is small against |hi| */
typedef struct quern_twofold {
	quern_real hi, lo;
} quern_twofold;

QUERN_INLINE uint64_t quern_bits(quern_real x) {
	uint64_t u;
	__builtin_memcpy(&u, &x, sizeof u);
	return u;
}

QUERN_INLINE quern_real quern_from_bits(uint64_t u) {
	quern_real x;
	__builtin_memcpy(&x, &u, sizeof x);
	return x;
}

QUERN_INLINE quern_real quern_nan(void) { return __builtin_nan(""); }

QUERN_INLINE quern_real quern_infinity(void) { return __builtin_inf(); }

/* Added to and taken from |x| < 2^51 it rounds to an integer, ties to even: at its size an ulp is 1. Between
 * the two, the low bits of the sum are that integer in two's complement. */
QUERN_INLINE quern_real quern_magic(void) { return 0x1.8p52; }

/* x cut off after 26 bits: the product of two such numbers is exact, and so is x - quern_head(x). */
QUERN_INLINE quern_real quern_head(quern_real x) {
	return quern_from_bits(quern_bits(x) & 0xfffffffff8000000u);
}

/* a + b without error, for |a| >= |b| or a = 0 (Dekker 1971) */
QUERN_INLINE quern_twofold quern_fast_sum(quern_real a, quern_real b) {
	const quern_real sum = a + b;
	return QUERN_VALUE(quern_twofold, sum, (a - sum) + b);
}

/* c0 + c1 x + c2 x^2 + rest x^3, by Horner's rule */
QUERN_INLINE quern_real quern_horner(
	quern_real x, quern_real c0, quern_real c1, quern_real c2, quern_real rest) {
	return c0 + x * (c1 + x * (c2 + x * rest));
}

/* ==== comparisons and rounding ==== */

/* The smaller. If either is not a number, or both are zeros: b, so that a NaN in b passes through. */
QUERN_INLINE quern_real quern_min(quern_real a, quern_real b) { return a < b ? a : b; }

/* The larger. If either is not a number, or both are zeros: b, so that a NaN in b passes through. */
QUERN_INLINE quern_real quern_max(quern_real a, quern_real b) { return a > b ? a : b; }

/* x held in [low, high]; an x that is not a number passes through. */
QUERN_INLINE quern_real quern_clamp(quern_real x, quern_real low, quern_real high) {
	return quern_min(high, quern_max(low, x));
}

/* |x|; clears the sign bit, also of zero and of NaN. */
QUERN_INLINE quern_real quern_abs(quern_real x) { return __builtin_fabs(x); }

/* -1 for x < 0, else 1: also for both zeros and for NaN. */
QUERN_INLINE quern_real quern_sign(quern_real x) { return x < 0.0 ? -1.0 : 1.0; }

/* The nearest integer, ties to even. Exact for |x| < 2^51; beyond, a relative error of up to 2^-51. A zero
 * is +0. Infinities and NaN pass through. */
QUERN_INLINE quern_real quern_round(quern_real x) { return (x + quern_magic()) - quern_magic(); }

/* The largest integer <= x. Exact for |x| < 2^51; beyond, a relative error of up to 2^-51. A zero is +0.
 * Infinities and NaN pass through. */
QUERN_INLINE quern_real quern_floor(quern_real x) {
	const quern_real near = quern_round(x);
	return near - (near > x ? 1.0 : 0.0);
}

/* ==== exponential and logarithm ==== */

/* e^(x.hi + x.lo) for |x.lo| < 2^-30; clamps, so that everything from -infinity to infinity is fine.
 *
 * Cody and Waite's reduction: x = k ln 2 + r, |r| < 0.3466; e^r = 1 + r + r^2 Q(r); then twice half the power
 * of two, since 2^k itself may not be representable while the result is. */
QUERN_INLINE quern_real quern_exp_twofold(quern_twofold x) {
	const quern_real hi = quern_clamp(x.hi, -746.0, 710.0);
	/* 2046 more: the low bits then hold twice the exponent bias plus k, which is positive and easy to halve
	 * */
	const quern_real shift = quern_magic() + 2046.0;
	const quern_real shifted = hi * 0x1.71547652b82fep+0 + shift;
	const quern_real k = shifted - shift;
	/* the first part of ln 2 has 42 bits: its product with k is exact, and so is the difference; where that
	 * is the smaller part of r, what the sum loses is below 2^-80 */
	const quern_real near = hi - k * 0x1.62e42fefa3800p-1;
	const quern_twofold r = quern_fast_sum(near, x.lo - k * 0x1.ef35793c76730p-45);
	/* |r| < 0.3466, 2^-57.3 of e^r; the 1/2 was kept exact */
	const quern_real q = quern_horner(r.hi, 0x1.0000000000000p-1, 0x1.5555555555501p-3, 0x1.555555555320ep-5,
		quern_horner(r.hi, 0x1.11111111288f7p-7, 0x1.6c16c17cc0ec7p-10, 0x1.a01a011c1f299p-13,
			quern_horner(r.hi, 0x1.a019ab34cf115p-16, 0x1.71df550aa0326p-19, 0x1.289f82b20beecp-22,
				0x1.ad20b7639c520p-26)));
	const quern_twofold sum = quern_fast_sum(1.0, r.hi);
	const quern_real power = sum.hi + (sum.lo + (r.lo + r.hi * r.hi * q));
	const uint64_t twice = quern_bits(shifted), half = twice >> 1;
	return power * quern_from_bits(half << 52) * quern_from_bits((twice - half) << 52);
}

/* x = m 2^k with m in [sqrt(1/2), sqrt 2), as hi = m and lo = k, for positive finite x; whatever else comes
 * in, the caller selects its result away. */
QUERN_INLINE quern_twofold quern_log_split(quern_real x) {
	const bool tiny = x < 0x1p-1022;
	const uint64_t bits = quern_bits(tiny ? x * 0x1p54 : x);
	const uint64_t one = 0x3ff0000000000000u, root_half = 0x3fe6a09e667f3bcdu;
	const uint64_t above = bits + (one - root_half);
	const quern_real biased = quern_from_bits(above >> 52 | 0x4330000000000000u);
	return QUERN_VALUE(quern_twofold, quern_from_bits(bits - (above & 0xfff0000000000000u) + one),
		biased - (tiny ? 0x1p52 + 1023.0 + 54.0 : 0x1p52 + 1023.0));
}

/* The values of log outside (0, infinity), and `inside` elsewhere */
QUERN_INLINE quern_real quern_log_edges(quern_real x, quern_real inside) {
	const quern_real finite = x < quern_infinity() ? inside : quern_infinity();
	const quern_real positive = x > 0.0 ? finite : -quern_infinity();
	return x >= 0.0 ? positive : quern_nan();
}

/* ln x as a pair, |error| < 2^-63 of it, for positive finite x; nothing of use elsewhere.
 *
 * ln x = k ln 2 + 2 atanh s with s = (m - 1)/(m + 1), and 2 atanh s = s (2 + 2/3 z + z^2 Q(z)), z = s^2. What
 * matters above 2^-64 is kept in two parts. */
QUERN_INLINE quern_twofold quern_log_twofold(quern_real x) {
	const quern_twofold split = quern_log_split(x);
	const quern_real m = split.hi, k = split.lo;
	const quern_real over = m - 1.0, under = m + 1.0;
	const quern_real under_hi = quern_head(under), under_lo = m - (under_hi - 1.0);
	const quern_real inverse = 1.0 / under;
	/* s cut off, then what its product with the denominator leaves of the numerator */
	const quern_real s_hi = quern_head(over * inverse);
	const quern_real s_lo = ((over - s_hi * under_hi) - s_hi * under_lo) * inverse;
	const quern_real s = s_hi + s_lo;
	const quern_real z_hi = s_hi * s_hi, z_lo = s_lo * (s_hi + s), z = z_hi + z_lo;
	/* z < 0.02945, 2^-73.4 of 2 atanh s */
	const quern_real q = quern_horner(z, 0x1.9999999999996p-2, 0x1.2492492492f51p-2, 0x1.c71c71c5968e4p-3,
		quern_horner(z, 0x1.745d182957ca4p-3, 0x1.3b1364c8d10a7p-3, 0x1.11206f4384d99p-3,
			0x1.de3d6cd5d2a07p-4 + z * 0x1.eac5df64e8103p-4));
	/* 2/3 z, with 2/3 and z in two parts each; the first product is exact */
	const quern_real third = 0x1.5555550000000p-1, z_head = quern_head(z_hi);
	const quern_real cubic_hi = third * z_head;
	const quern_real rest = third * ((z_hi - z_head) + z_lo) + 0x1.5555555555555p-27 * z + z * z * q;
	const quern_real factor = 2.0 + (cubic_hi + rest);
	const quern_real factor_hi = quern_head(factor), factor_lo = ((2.0 - factor_hi) + cubic_hi) + rest;
	/* the first part of ln 2 has 42 bits, so that its product with k is exact */
	const quern_twofold sum = quern_fast_sum(k * 0x1.62e42fefa3800p-1, s_hi * factor_hi);
	const quern_real low = k * 0x1.ef35793c76730p-45 + (s_hi * factor_lo + s_lo * factor);
	return quern_fast_sum(sum.hi, sum.lo + low);
}

/* e^x. Error 0.75 ulp. Overflows to infinity, goes to zero through the subnormals; NaN for NaN. */
QUERN_INLINE quern_real quern_exp(quern_real x) {
	const quern_real power = quern_exp_twofold(QUERN_VALUE(quern_twofold, x, 0.0));
	return x == x ? power : quern_nan();
}

/* Natural logarithm, also of subnormals. Error 0.9 ulp. log(+-0) = -infinity, log(infinity) = infinity; NaN
 * below zero and for NaN.
 *
 * With f = m - 1, s = f/(2 + f), z = s^2: 2 atanh s = s (2 + z R(z)), and since 2 s = f - s f and
 * s f = f^2/2 - s f^2/2, that is f - (f^2/2 - s (f^2/2 + z R)): f is exact, and the rest small. */
QUERN_INLINE quern_real quern_log(quern_real x) {
	const quern_twofold split = quern_log_split(x);
	const quern_real f = split.hi - 1.0, k = split.lo;
	const quern_real s = f / (2.0 + f), z = s * s, half_square = 0.5 * f * f;
	/* z < 0.02945, 2^-59.4 of 2 atanh s */
	const quern_real r = quern_horner(z, 0x1.5555555555592p-1, 0x1.999999997ff08p-2, 0x1.24924941e2f34p-2,
		quern_horner(
			z, 0x1.c71c521286facp-3, 0x1.74663d6169f42p-3, 0x1.39a1db2297037p-3, 0x1.2f04554423597p-3));
	/* ln 2 in two parts as in quern_exp_twofold */
	const quern_twofold sum = quern_fast_sum(k * 0x1.62e42fefa3800p-1, f);
	const quern_real low = s * (half_square + z * r) + k * 0x1.ef35793c76730p-45;
	return quern_log_edges(x, sum.hi + (sum.lo - (half_square - low)));
}

/* x^y for x >= 0, where -0 counts as 0. Error 1 ulp. pow(x, 0) = pow(1, y) = 1, also if the other one is NaN;
 * pow(0, y) and pow(infinity, y) are 0 or infinity by the sign of y, pow(x, +-infinity) is 0 or infinity by
 * which side of 1 x is on; otherwise NaN for x < 0 and where x or y is NaN. Goes to zero through the
 * subnormals. */
QUERN_INLINE quern_real quern_pow(quern_real x, quern_real y) {
	const quern_twofold log_x = quern_log_twofold(x);
	const quern_real head = quern_head(log_x.hi), rest = (log_x.hi - head) + log_x.lo;
	const quern_real y_head = quern_head(y);
	const quern_twofold product = quern_fast_sum(y_head * head, (y - y_head) * head + y * rest);
	/* where the pair has overflowed, the plain product still tells which way */
	const quern_real plain = y * quern_log_edges(x, log_x.hi);
	const bool wide = !(quern_abs(plain) < 1000.0);
	const quern_real power =
		quern_exp_twofold(QUERN_VALUE(quern_twofold, wide ? plain : product.hi, wide ? 0.0 : product.lo));
	const quern_real number = power == power ? power : quern_nan();
	return ((x == 1.0) | (y == 0.0)) ? 1.0 : number;
}

/* ==== cube root ==== */

/* The real cube root, of negative numbers and subnormals too. Error 0.51 ulp. +-0, infinities and NaN pass
 * through.
 *
 * |x| = m 2^j 8^q with m in [1, 2), j in 0, 1, 2; a polynomial gives the root c of m 2^j, of which 17 bits
 * are kept, so that c^3 is exact; then the binomial series of (m 2^j/c^3)^(1/3). */
QUERN_INLINE quern_real quern_cbrt(quern_real x) {
	const quern_real size = quern_abs(x);
	const bool tiny = size < 0x1p-1022;
	const uint64_t bits = quern_bits(tiny ? size * 0x1p54 : size);
	const quern_real biased = quern_from_bits(bits >> 52 | 0x4330000000000000u);
	const quern_real exponent = biased - (0x1p52 + 1023.0);
	/* a third of (exponent - 1) is never near a tie */
	const quern_real shifted = (exponent - 1.0) * 0x1.5555555555555p-2 + quern_magic();
	const quern_real j = exponent - 3.0 * (shifted - quern_magic());
	const quern_real m = quern_from_bits((bits & 0x000fffffffffffffu) | 0x3ff0000000000000u);
	/* m in [1, 2), 2^-16.7 of the root */
	const quern_real root = quern_horner(m, 0x1.0392cf88cf234p-1, 0x1.6fb1cf63c9969p-1, -0x1.33d34c28c2b55p-2,
		0x1.60a0bc4b1e9f5p-4 + m * -0x1.5b76e0461fe60p-7);
	const quern_real part = j == 0.0 ? 1.0 : j == 1.0 ? 2.0 : 4.0;
	const quern_real part_root = j == 0.0 ? 1.0 : j == 1.0 ? 0x1.428a2f98d728bp+0 : 0x1.965fea53d6e3dp+0;
	const quern_real c = quern_from_bits(quern_bits(root * part_root) & 0xfffffff000000000u);
	const quern_real cube = c * c * c;
	const quern_real d = (m * part - cube) / cube;
	/* 1/3, -1/9, 5/81: |d| < 2^-13.5, the next term is below 2^-58 */
	const quern_real series =
		d * (0x1.5555555555555p-2 - d * (0x1.c71c71c71c71cp-4 - d * 0x1.f9add3c0ca458p-5));
	const uint64_t q = quern_bits(shifted) - (tiny ? 18u : 0u);
	const quern_real power = quern_from_bits((q << 52) + 0x3ff0000000000000u);
	const quern_real result = __builtin_copysign((c + c * series) * power, x);
	return ((size > 0.0) & (size < quern_infinity())) ? result : x;
}

/* ==== trigonometry ==== */

/* sin(|x| + quadrant pi/2), with the bits `flip` of the result flipped.
 *
 * Cody and Waite's reduction: r = |x| - k pi/2 in two parts, with pi/2 in three, of 37, 36 and 53 bits:
 * products of the first two with k < 2^16 are exact. Then sin r = r + r z S(z) or cos r = 1 - z/2 + z^2 C(z),
 * z = r^2. */
QUERN_INLINE quern_real quern_sin_quadrant(quern_real x, uint64_t quadrant, uint64_t flip) {
	const quern_real size = quern_abs(x);
	const quern_real shifted = size * 0x1.45f306dc9c883p-1 + quern_magic();
	const quern_real k = shifted - quern_magic();
	const uint64_t turn = quern_bits(shifted) + quadrant;
	/* 2 or 0, compared as reals since SSE2 cannot compare 64-bit integers */
	const bool odd = quern_from_bits((turn & 1u) << 62) > 1.0;
	const quern_real coarse = size - k * 0x1.921fb54440000p+0, fine = k * 0x1.68c234c4c0000p-39;
	const quern_real r = coarse - fine;
	const quern_real r_low = ((coarse - r) - fine) - k * 0x1.98a2e03707345p-77;
	const quern_real z = r * r;
	const quern_real hump = 1.0 - 0.5 * z, hump_low = ((1.0 - hump) - 0.5 * z) - r * r_low;
	/* z < (pi/4)^2: S to 2^-58.0 of sin r / r, C to 2^-63.9 of cos r */
	const quern_real c0 = odd ? 0x1.555555555554bp-5 : -0x1.5555555555549p-3;
	const quern_real c1 = odd ? -0x1.6c16c16c15016p-10 : 0x1.111111110f8a5p-7;
	const quern_real c2 = odd ? 0x1.a01a019c8f426p-16 : -0x1.a01a019c15e17p-13;
	const quern_real c3 = odd ? -0x1.27e4f7f1a3407p-22 : 0x1.71de357adb386p-19;
	const quern_real c4 = odd ? 0x1.1ee9dbd76ecc2p-29 : -0x1.ae5e686256471p-26;
	const quern_real c5 = odd ? -0x1.8fa686a46b202p-37 : 0x1.5d9390486038ap-33;
	const quern_real series = c0 + z * (c1 + z * (c2 + z * (c3 + z * (c4 + z * c5))));
	const quern_real tail = (odd ? z : r) * z * series;
	const quern_real value = (odd ? hump : r) + ((odd ? hump_low : r_low * hump) + tail);
	const quern_real signed_value = quern_from_bits(quern_bits(value) ^ (turn & 2u) << 62 ^ flip);
	/* beyond this the reduction means little; catches infinity and NaN as well */
	return size <= 1e9 ? signed_value : quern_nan();
}

/* Sine of an angle in radians. Error 0.85 ulp for |x| <= 1e5. From there to 1e9 the absolute error is below
 * 2^-52 |x|, as if x had been rounded once more; beyond, and for NaN: NaN. sin(-x) = -sin(x), down to the
 * zeros. */
QUERN_INLINE quern_real quern_sin(quern_real x) {
	return quern_sin_quadrant(x, 0, quern_bits(x) & 0x8000000000000000u);
}

/* Cosine of an angle in radians. Error 0.85 ulp for |x| <= 1e5; otherwise as quern_sin. cos(-x) = cos(x). */
QUERN_INLINE quern_real quern_cos(quern_real x) { return quern_sin_quadrant(x, 1, 0); }

/* The angle of the point (x, y), in [-pi, pi]. Error 0.8 ulp. Zeros and infinities, with signs, as in C:
 * atan2(+-0, x) is +-0 for x >= +0 and +-pi for x <= -0; atan2(+-infinity, infinity) = +-pi/4 and so on. NaN
 * if either is.
 *
 * The smaller over the larger, t; above tan(pi/8), (t - 1)/(t + 1), which takes pi/4 away, so that |u| <
 * 0.4143. The quotient is carried in two parts; atan u = u + u z P(z), z = u^2. */
QUERN_INLINE quern_real quern_atan2(quern_real y, quern_real x) {
	const quern_real x_size = quern_abs(x), y_size = quern_abs(y);
	const bool steep = y_size > x_size, back = __builtin_copysign(1.0, x) < 0.0;
	const quern_real plain_low = steep ? x_size : y_size, plain_high = steep ? y_size : x_size;
	/* 0/0 counts as 0/1, and infinity/infinity as 1/1 */
	const bool endless = plain_high == quern_infinity();
	const quern_real edge_low = plain_low == quern_infinity() ? 1.0 : 0.0;
	/* keeps sums below the largest number, and what the quotient leaves above the smallest */
	const quern_real scale = plain_high > 0x1p400 ? 0x1p-4 : 0x1p600;
	const quern_real low = endless ? edge_low : plain_low * scale;
	const quern_real high = (endless | (plain_high == 0.0)) ? 1.0 : plain_high * scale;
	const bool wide = low > 0x1.a827999fcef32p-2 * high;
	const quern_real top = wide ? low - high : low, bottom = wide ? low + high : high;
	const quern_real top_error = wide ? low - (top + high) : 0.0;
	const quern_real bottom_error = wide ? low - (bottom - high) : 0.0;
	const quern_real bottom_head = quern_head(bottom), bottom_rest = (bottom - bottom_head) + bottom_error;
	const quern_real inverse = 1.0 / bottom;
	/* u cut off, then what its product with the denominator leaves of the numerator */
	const quern_real u_head = quern_head(top * inverse);
	const quern_real left = ((top - u_head * bottom_head) - u_head * bottom_rest) + top_error;
	const quern_twofold u = quern_fast_sum(u_head, left * inverse);
	const quern_real z = u.hi * u.hi;
	/* z < 0.1716, 2^-59.4 of atan u */
	const quern_real p = quern_horner(z, -0x1.555555555553dp-2, 0x1.999999999589bp-3, -0x1.24924922af0cdp-3,
		quern_horner(z, 0x1.c71c70e6c95e0p-4, -0x1.745cf8f1d0462p-4, 0x1.3b111a93c30bap-4,
			quern_horner(z, -0x1.10ebc85fc2f7fp-4, 0x1.df102a24f3c87p-5, -0x1.9cd66e665a60dp-5,
				0x1.37de64e147e52p-5 + z * -0x1.257c1388ca05ep-6)));
	const quern_real tail = u.hi * z * p + (u.lo - u.lo * z);
	/* the angle is eighths pi/4 + turn atan u; pi/4 in two parts, of which the first times 3 is exact */
	const quern_real turn = steep != back ? -1.0 : 1.0, eighth = wide ? 1.0 : 0.0;
	const quern_real quarter = steep ? 2.0 - eighth : eighth, eighths = back ? 4.0 - quarter : quarter;
	const quern_twofold sum = quern_fast_sum(eighths * 0x1.921fb54442d18p-1, turn * u.hi);
	const quern_real angle = sum.hi + (sum.lo + (turn * tail + eighths * 0x1.1a62633145c07p-55));
	return ((x == x) & (y == y)) ? __builtin_copysign(angle, y) : quern_nan();
}

/* asin |x| = s + rest for |x| <= 1/2 and pi/2 - 2 (s + rest) above, as hi = s and lo = rest: above, s is the
 * root of (1 - |x|)/2, and that difference is exact. asin s = s + s z P(z), z = s^2. */
QUERN_INLINE quern_twofold quern_asin_twofold(quern_real size) {
	const bool outer = size > 0.5;
	const quern_real z = outer ? 0.5 * (1.0 - size) : size * size;
	const quern_real root = __builtin_sqrt(z), s = outer ? root : size;
	/* what the root's square leaves of z, over 2 s; the root is above 2^-28 unless it is zero */
	const quern_real head = quern_head(root), left = (z - head * head) - (root - head) * (root + head);
	const quern_real s_low = outer ? left / quern_max(root + root, 0x1p-60) : 0.0;
	/* z <= 1/4, 2^-59.8 of asin s */
	const quern_real p = quern_horner(z, 0x1.5555555555578p-3, 0x1.333333332df20p-4, 0x1.6db6db722ab9cp-5,
		quern_horner(z, 0x1.f1c71a8be75d0p-6, 0x1.6e8bdfdd9486ap-6, 0x1.1c49deae551c8p-6,
			quern_horner(z, 0x1.ca2133467a7e1p-7, 0x1.75781e413ced1p-7, 0x1.6187701d71c58p-7,
				quern_horner(z, 0x1.e18e8782c6fa1p-9, 0x1.64f1fb1069d92p-6, -0x1.59df456184deap-6,
					0x1.0bdcf78f6e799p-5))));
	return QUERN_VALUE(quern_twofold, s, s * z * p + (s_low + s_low * (0.5 * z)));
}

/* Arc sine, in [-pi/2, pi/2]. Error 0.7 ulp. asin(-x) = -asin(x), also for zeros; NaN if |x| > 1 or NaN. */
QUERN_INLINE quern_real quern_asin(quern_real x) {
	const quern_real size = quern_abs(x);
	const bool outer = size > 0.5;
	const quern_twofold s = quern_asin_twofold(size);
	const quern_real times = outer ? -2.0 : 1.0;
	const quern_twofold sum = quern_fast_sum(outer ? 0x1.921fb54442d18p+0 : 0.0, times * s.hi);
	const quern_real angle = sum.hi + (sum.lo + (times * s.lo + (outer ? 0x1.1a62633145c07p-54 : 0.0)));
	return size <= 1.0 ? __builtin_copysign(angle, x) : quern_nan();
}

/* Arc cosine, in [0, pi]. Error 0.7 ulp. acos(1) = +0; NaN if |x| > 1 or NaN. */
QUERN_INLINE quern_real quern_acos(quern_real x) {
	const quern_real size = quern_abs(x);
	const bool outer = size > 0.5, back = x < 0.0;
	const quern_twofold s = quern_asin_twofold(size);
	/* 2 (s + rest) for x > 1/2, pi - 2 (s + rest) for x < -1/2, pi/2 - asin |x| or pi/2 + asin |x| between */
	const quern_real side = back ? -1.0 : 1.0, factor = outer ? 2.0 * side : -side;
	const quern_real quarters = outer ? 1.0 - side : 1.0;
	const quern_twofold sum = quern_fast_sum(quarters * 0x1.921fb54442d18p+0, factor * s.hi);
	const quern_real angle = sum.hi + (sum.lo + (factor * s.lo + quarters * 0x1.1a62633145c07p-54));
	return size <= 1.0 ? angle : quern_nan();
}

/* ==== Carlson's integral ==== */

/* hi + lo anew, so that hi has 26 bits; lo is then small against hi, but no longer below its last bit */
QUERN_INLINE quern_twofold quern_headed(quern_real hi, quern_real lo) {
	const quern_real head = quern_head(hi + lo);
	return QUERN_VALUE(quern_twofold, head, (hi - head) + lo);
}

/* The product of two headed numbers, headed: the first of its parts is exact. */
QUERN_INLINE quern_twofold quern_headed_product(quern_twofold a, quern_twofold b) {
	return quern_headed(a.hi * b.hi, a.hi * b.lo + a.lo * (b.hi + b.lo));
}

/* One duplication. With lambda = y + 2 sqrt(x y), x' = (x + lambda)/4 and y' = (y + lambda)/4, the ratio
 * x'/y' is half of 1 + sqrt(x/y), and y' = y times the new ratio. */
QUERN_INLINE quern_twofold quern_carlson_step(quern_twofold ratio) {
	const quern_real root = __builtin_sqrt(ratio.hi + ratio.lo), head = quern_head(root);
	/* what the root's square leaves of the ratio, over twice the root; zero stays zero */
	const quern_real left = ((ratio.hi - head * head) - (root - head) * (root + head)) + ratio.lo;
	const quern_real root_low = left / quern_max(root + root, 0x1p-540);
	const quern_real next = quern_head(0.5 + 0.5 * root);
	return QUERN_VALUE(quern_twofold, next, ((0.5 - next) + 0.5 * root) + 0.5 * root_low);
}

/* R_C(x, y) = 1/2 integral from 0 to infinity of dt/((t + y) sqrt(t + x)), for x >= 0 and y > 0:
 * arccos(sqrt(x/y))/sqrt(y - x) where x < y, arcosh(sqrt(x/y))/sqrt(x - y) where x > y, 1/sqrt x between.
 * Error 3 ulp or 4e-16 of the result, whichever is less, for x = 0 and x/y in [1e-250, 1e10], y in [1e-250,
 * 1e250]; less accurate or NaN beyond; NaN unless x >= 0 and y > 0.
 *
 * Carlson's duplication (Numer. Math. 33, 1979, 1), in ratios: six steps bring every ratio up to 1e10 within
 * 0.04 of 1, where the series in s = (y - a)/a, a = (x + 2 y)/3, is cut after s^8. What is left of the error
 * of a step never shrinks afterwards, so that ratios and their product are carried in two parts. */
QUERN_INLINE quern_real quern_carlson_rc(quern_real x, quern_real y) {
	const quern_twofold ratio1 = quern_carlson_step(quern_headed(x / y, 0.0));
	const quern_twofold ratio2 = quern_carlson_step(ratio1), ratio3 = quern_carlson_step(ratio2);
	const quern_twofold ratio4 = quern_carlson_step(ratio3), ratio5 = quern_carlson_step(ratio4);
	const quern_twofold ratio6 = quern_carlson_step(ratio5);
	const quern_twofold first =
		quern_headed_product(quern_headed(y, 0.0), quern_headed_product(ratio1, ratio2));
	const quern_twofold rest =
		quern_headed_product(quern_headed_product(ratio3, ratio4), quern_headed_product(ratio5, ratio6));
	const quern_twofold last = quern_headed_product(first, rest);
	/* the product is y after the last step; three times a is this times 2 + ratio */
	const quern_twofold thrice =
		quern_headed_product(last, QUERN_VALUE(quern_twofold, 2.0 + ratio6.hi, ratio6.lo));
	const quern_real ratio = ratio6.hi + ratio6.lo, s = (1.0 - ratio) / (2.0 + ratio);
	const quern_real series = quern_horner(s, 3.0 / 10.0, 1.0 / 7.0, 3.0 / 8.0,
		quern_horner(s, 9.0 / 22.0, 159.0 / 208.0, 9.0 / 8.0, 4275.0 / 2176.0));
	/* sqrt 3, in two parts, since the root was taken of three times a */
	const quern_real top =
		0x1.bb67ae8584caap+0 + (0x1.cec95d0b5c1e3p-54 + 0x1.bb67ae8584caap+0 * (s * s * series));
	const quern_real value = top / __builtin_sqrt(thrice.hi + thrice.lo);
	return ((x >= 0.0) & (y > 0.0) & (value == value)) ? value : quern_nan();
}
