/* SPDX-License-Identifier: MIT */
/* Accuracy, special values and reproducibility of quern/math.h. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h> /* needs some of the above */

#include <quern/math.h>

enum { POINTS = 200000, CHUNK = 1000, RANGES = 9 };

static const long double pi = 3.14159265358979323846264338327950288L;

/* ==== the functions under test, as loops over batches ==== */

typedef void (*loop_fn)(size_t n, const double *a, const double *b, double *y);
typedef long double (*exact_fn)(long double a, long double b);

#define LOOP(name, call)                                                                                     \
	static void loop_##name(size_t n, const double *a, const double *b, double *y) {                         \
		(void)b;                                                                                             \
		QUERN_SIMD                                                                                           \
		for (size_t i = 0; i < n; i++) y[i] = call;                                                          \
	}

LOOP(exp, quern_exp(a[i]))
LOOP(log, quern_log(a[i]))
LOOP(pow, quern_pow(a[i], b[i]))
LOOP(cbrt, quern_cbrt(a[i]))
LOOP(sin, quern_sin(a[i]))
LOOP(cos, quern_cos(a[i]))
LOOP(atan2, quern_atan2(a[i], b[i]))
LOOP(acos, quern_acos(a[i]))
LOOP(asin, quern_asin(a[i]))
LOOP(carlson_rc, quern_carlson_rc(a[i], b[i]))
LOOP(floor, quern_floor(a[i]))
LOOP(round, quern_round(a[i]))
LOOP(min, quern_min(a[i], b[i]))
LOOP(max, quern_max(a[i], b[i]))
LOOP(clamp, quern_clamp(a[i], -1.0, b[i]))
LOOP(abs, quern_abs(a[i]))
LOOP(sign, quern_sign(a[i]))

/* ==== the same in long double ==== */

#define EXACT(name, value)                                                                                   \
	static long double exact_##name(long double a, long double b) {                                          \
		(void)b;                                                                                             \
		return value;                                                                                        \
	}

EXACT(exp, expl(a))
EXACT(log, logl(a))
EXACT(pow, powl(a, b))
EXACT(cbrt, cbrtl(a))
EXACT(sin, sinl(a))
EXACT(cos, cosl(a))
EXACT(atan2, atan2l(a, b))
EXACT(acos, acosl(a))
EXACT(asin, asinl(a))
EXACT(floor, floorl(a))
EXACT(round, rintl(a))

/* The closed forms, with arccos and arcosh written so that they lose nothing at x = y. */
static long double exact_carlson_rc(long double x, long double y) {
	if (x < y) return atan2l(sqrtl(y - x), sqrtl(x)) / sqrtl(y - x);
	if (x > y) return asinhl(sqrtl((x - y) / y)) / sqrtl(x - y);
	return 1.0L / sqrtl(x);
}

/* ==== pseudo-random arguments, without libm: the hashes must not depend on it ==== */

static uint64_t next_bits(uint64_t *state) {
	*state ^= *state << 13;
	*state ^= *state >> 7;
	*state ^= *state << 17;
	return *state * 0x2545f4914f6cdd1du;
}

static double uniform(uint64_t *state, double low, double high) {
	return low + (high - low) * ((double)(next_bits(state) >> 11) * 0x1p-53);
}

/* 2^e times something in [1, 2), without a sign; e in [low, high], evenly */
static double spread(uint64_t *state, double low, double high) {
	const int e = (int)uniform(state, low, high);
	return ldexp(uniform(state, 1.0, 2.0), e);
}

typedef enum {
	NONE,
	EVEN,     /* evenly in [low, high] */
	SPREAD,   /* binary exponents from low to high, either sign */
	POSITIVE, /* the same, without a sign */
	AROUND,   /* low, plus or minus something from 2^-60 to 2^-1 of it */
	BELOW,    /* low less something from 2^-53 to 2^-1 of it, either sign */
	QUARTERS, /* within a few ulp of multiples of pi/2, up to the low-th */
	RATIO,    /* second argument: the first times a number from low to high */
	POWER     /* second argument: such that low < y log x < high */
} range_kind;

typedef struct {
	range_kind kind;
	double low, high;
} range;

static double draw(uint64_t *state, const range *r, double first) {
	const double sign = next_bits(state) & 1u ? -1.0 : 1.0;

	switch (r->kind) {
	case EVEN: return uniform(state, r->low, r->high);
	case SPREAD: return sign * spread(state, r->low, r->high);
	case POSITIVE: return spread(state, r->low, r->high);
	case AROUND: return r->low * (1.0 + sign * spread(state, -60, -1));
	case BELOW: return sign * r->low * (1.0 - spread(state, -54, -1));
	case QUARTERS: {
		const double near = (double)(floorl(uniform(state, 1.0, r->low)) * pi / 2);
		return sign * near * (1.0 + (double)(next_bits(state) % 5) * 0x1p-52 - 0x1p-51);
	}
	case RATIO: return first * uniform(state, r->low, r->high);
	case POWER: return first == 1.0 ? 1.0 : uniform(state, r->low, r->high) / log(first);
	case NONE: break;
	}
	return 0.0;
}

/* ==== accuracy ==== */

typedef struct {
	const char *name;
	loop_fn loop;
	exact_fn exact;
	double ulp, relative; /* promised in the header; 0 for `relative`: nothing */
	struct {
		range a, b;
	} ranges[RANGES];
} accuracy;

static const accuracy functions[] = {
	{ "exp", loop_exp, exact_exp, 0.75, 0,
		{ { { EVEN, -708.3, 709.78 }, { 0 } }, { { EVEN, -1.0, 1.0 }, { 0 } },
			{ { SPREAD, -60, 9 }, { 0 } } } },
	{ "log", loop_log, exact_log, 0.9, 0,
		{ { { POSITIVE, -1074, 1024 }, { 0 } }, { { AROUND, 1.0, 0 }, { 0 } }, { { EVEN, 0.5, 2.0 }, { 0 } },
			{ { EVEN, 0.0, 10.0 }, { 0 } }, { { AROUND, 0x1.6a09e667f3bcdp-1, 0 }, { 0 } } } },
	{ "pow", loop_pow, exact_pow, 1.0, 0,
		{ { { POSITIVE, -1074, 1024 }, { POWER, -708.3, 709.7 } },
			{ { AROUND, 1.0, 0 }, { POWER, -708.3, 709.7 } },
			{ { EVEN, 0.5, 2.0 }, { POWER, -708.3, 709.7 } },
			{ { EVEN, 1.3, 1.45 }, { POWER, -708.3, 709.7 } }, { { EVEN, 0.0, 1.0 }, { EVEN, 0.0, 2.5 } },
			{ { POSITIVE, -30, 30 }, { EVEN, -10, 10 } }, { { AROUND, 1.0, 0 }, { POWER, -1, 1 } } } },
	{ "cbrt", loop_cbrt, exact_cbrt, 0.51, 0,
		{ { { SPREAD, -1074, 1024 }, { 0 } }, { { EVEN, 1.0, 8.0 }, { 0 } }, { { EVEN, -1.0, 1.0 }, { 0 } },
			{ { AROUND, 1.0, 0 }, { 0 } } } },
	{ "sin", loop_sin, exact_sin, 0.85, 0,
		{ { { EVEN, -1e5, 1e5 }, { 0 } }, { { EVEN, -7.0, 7.0 }, { 0 } }, { { SPREAD, -300, 16 }, { 0 } },
			{ { QUARTERS, 63662, 0 }, { 0 } }, { { QUARTERS, 100, 0 }, { 0 } },
			{ { AROUND, 0x1.921fb54442d18p-1, 0 }, { 0 } } } },
	{ "cos", loop_cos, exact_cos, 0.85, 0,
		{ { { EVEN, -1e5, 1e5 }, { 0 } }, { { EVEN, -7.0, 7.0 }, { 0 } }, { { SPREAD, -300, 16 }, { 0 } },
			{ { QUARTERS, 63662, 0 }, { 0 } }, { { QUARTERS, 100, 0 }, { 0 } },
			{ { AROUND, 0x1.921fb54442d18p-1, 0 }, { 0 } } } },
	{ "atan2", loop_atan2, exact_atan2, 0.8, 0,
		{ { { EVEN, -1.0, 1.0 }, { EVEN, -1.0, 1.0 } }, { { SPREAD, -20, 20 }, { SPREAD, -20, 20 } },
			{ { SPREAD, -1074, 1024 }, { SPREAD, -1074, 1024 } },
			{ { SPREAD, -1000, 1000 }, { RATIO, 0.41, 0.42 } },
			{ { SPREAD, -1000, 1000 }, { RATIO, -2.5, -2.3 } },
			{ { SPREAD, -1074, -1000 }, { SPREAD, -1000, 1000 } },
			{ { SPREAD, -1000, 1000 }, { RATIO, 0.99, 1.01 } },
			{ { SPREAD, -1000, 0 }, { EVEN, -1.0, 1.0 } } } },
	{ "acos", loop_acos, exact_acos, 0.7, 0,
		{ { { EVEN, -1.0, 1.0 }, { 0 } }, { { BELOW, 1.0, 0 }, { 0 } }, { { SPREAD, -1070, -1 }, { 0 } },
			{ { AROUND, 0.5, 0 }, { 0 } }, { { AROUND, -0.5, 0 }, { 0 } } } },
	{ "asin", loop_asin, exact_asin, 0.7, 0,
		{ { { EVEN, -1.0, 1.0 }, { 0 } }, { { BELOW, 1.0, 0 }, { 0 } }, { { SPREAD, -1070, -1 }, { 0 } },
			{ { AROUND, 0.5, 0 }, { 0 } }, { { AROUND, -0.5, 0 }, { 0 } } } },
	{ "carlson_rc", loop_carlson_rc, exact_carlson_rc, 3.0, 4e-16,
		{ { { POSITIVE, -20, 20 }, { RATIO, 1e-8, 1.0 } }, { { POSITIVE, -20, 20 }, { RATIO, 1.0, 1e4 } },
			{ { POSITIVE, -13, 13 }, { POSITIVE, -13, 13 } }, { { POSITIVE, -33, 34 }, { EVEN, 1.0, 2.0 } },
			{ { EVEN, 1e7, 1e10 }, { EVEN, 1.0, 1.0 } }, { { AROUND, 1.0, 0 }, { EVEN, 1.0, 1.0 } },
			{ { EVEN, 0.0, 0.0 }, { POSITIVE, -830, 830 } }, { { POSITIVE, -800, -30 }, { EVEN, 1.0, 2.0 } },
			{ { POSITIVE, -830, 830 }, { RATIO, 1e-8, 1e8 } } } },
	{ "floor", loop_floor, exact_floor, 0.0, 0,
		{ { { SPREAD, -60, 51 }, { 0 } }, { { EVEN, -100.0, 100.0 }, { 0 } },
			{ { AROUND, 7.0, 0 }, { 0 } } } },
	{ "round", loop_round, exact_round, 0.0, 0,
		{ { { SPREAD, -60, 51 }, { 0 } }, { { EVEN, -100.0, 100.0 }, { 0 } },
			{ { AROUND, 7.5, 0 }, { 0 } } } },
};

typedef struct {
	double ulp, relative;
} errors;

static double larger(double a, double b) { return a > b ? a : b; }

static errors error_of(double value, long double exact) {
	const long double size = fabsl(exact), off = fabsl(value - exact);
	int e;

	if (off == 0.0L) return (errors) { 0.0, 0.0 };
	if (!(off < INFINITY) || size == 0.0L) return (errors) { INFINITY, INFINITY };
	(void)frexpl(exact, &e);
	return (errors) { (double)ldexpl(off, 53 - e), (double)(off / size) };
}

static void worsen(errors *worst, const accuracy *f, const range *ra, const range *rb, uint64_t *state) {
	double a[CHUNK], b[CHUNK], y[CHUNK];

	for (size_t i = 0; i < CHUNK; i++) {
		a[i] = draw(state, ra, 0.0);
		b[i] = draw(state, rb, a[i]);
	}
	f->loop(CHUNK, a, b, y);
	for (size_t i = 0; i < CHUNK; i++) {
		const long double exact = f->exact(a[i], b[i]), size = fabsl(exact);
		/* no promise where the result is subnormal or too large */
		if (size > 0x1.fffffffffffff7p1023L || (size > 0.0L && size < 0x1p-1022L)) continue;
		const errors e = error_of(y[i], exact);
		if (e.ulp > f->ulp)
			print_message("%s(%a, %a) = %a, off by %g ulp\n", f->name, a[i], b[i], y[i], e.ulp);
		worst->ulp = larger(worst->ulp, e.ulp);
		worst->relative = larger(worst->relative, e.relative);
	}
}

/* Every result is within the error that the header promises, over the whole range and where it is hardest. */
static void test_accuracy(void **unused) {
	uint64_t state = 0x9e3779b97f4a7c15u;
	bool kept = true;

	(void)unused;
	for (size_t i = 0; i < sizeof functions / sizeof functions[0]; i++) {
		const accuracy *f = &functions[i];
		errors worst = { 0.0, 0.0 };
		for (size_t r = 0; r < RANGES && f->ranges[r].a.kind != NONE; r++)
			for (size_t done = 0; done < POINTS; done += CHUNK)
				worsen(&worst, f, &f->ranges[r].a, &f->ranges[r].b, &state);
		print_message("%-10s error %.4f ulp, promised %.2f; relative %.3g\n", f->name, worst.ulp, f->ulp,
			worst.relative);
		kept = kept && worst.ulp <= f->ulp && (f->relative == 0 || worst.relative <= f->relative);
	}
	assert_true(kept);
}

/* Sine and cosine lose accuracy slowly beyond their range: by no more than one more rounding of x would cost.
 * */
static void test_far_angles(void **unused) {
	uint64_t state = 0x6a09e667f3bcc909u;
	double worst = 0.0;

	(void)unused;
	for (int i = 0; i < POINTS; i++) {
		const double x = 1e5 * (1.0 + spread(&state, -10, 13)), far = x < 1e9 ? x : 1e9;
		const double off_sin = (double)fabsl(quern_sin(far) - sinl(far));
		const double off_cos = (double)fabsl(quern_cos(far) - cosl(far));
		worst = larger(worst, larger(off_sin, off_cos) / far);
	}
	print_message("%-10s error %.3g of x, promised %.3g\n", "far angles", worst, 0x1p-52);
	assert_true(worst <= 0x1p-52);
}

/* ==== special values ==== */

typedef struct {
	const char *name;
	loop_fn loop;
	double a, b, expected;
} special;

static const special specials[] = {
	{ "exp", loop_exp, 0.0, 0, 1.0 },
	{ "exp", loop_exp, -0.0, 0, 1.0 },
	{ "exp", loop_exp, INFINITY, 0, INFINITY },
	{ "exp", loop_exp, -INFINITY, 0, 0.0 },
	{ "exp", loop_exp, 0x1.62e42fefa39efp+9, 0, 0x1.fffffffffff2ap+1023 },
	{ "exp", loop_exp, 0x1.62e42fefa39f0p+9, 0, INFINITY },
	{ "exp", loop_exp, 1e300, 0, INFINITY },
	{ "exp", loop_exp, -745.2, 0, 0.0 },
	{ "exp", loop_exp, -1e300, 0, 0.0 },
	{ "exp", loop_exp, -745.1, 0, 0x1p-1074 },
	{ "exp", loop_exp, NAN, 0, NAN },
	{ "log", loop_log, 1.0, 0, 0.0 },
	{ "log", loop_log, 0.0, 0, -INFINITY },
	{ "log", loop_log, -0.0, 0, -INFINITY },
	{ "log", loop_log, INFINITY, 0, INFINITY },
	{ "log", loop_log, 0x1p-1074, 0, -0x1.74385446d71c3p+9 },
	{ "log", loop_log, 0x1.fffffffffffffp+1023, 0, 0x1.62e42fefa39efp+9 },
	{ "log", loop_log, -0x1p-1074, 0, NAN },
	{ "log", loop_log, -1.0, 0, NAN },
	{ "log", loop_log, -INFINITY, 0, NAN },
	{ "log", loop_log, NAN, 0, NAN },
	{ "pow", loop_pow, 0.0, 2.5, 0.0 },
	{ "pow", loop_pow, 0.0, 1e-300, 0.0 },
	{ "pow", loop_pow, -0.0, 3.0, 0.0 },
	{ "pow", loop_pow, 0.0, -2.0, INFINITY },
	{ "pow", loop_pow, 0.0, 0.0, 1.0 },
	{ "pow", loop_pow, 0.0, INFINITY, 0.0 },
	{ "pow", loop_pow, 0.0, -INFINITY, INFINITY },
	{ "pow", loop_pow, 3.0, 0.0, 1.0 },
	{ "pow", loop_pow, -3.0, -0.0, 1.0 },
	{ "pow", loop_pow, INFINITY, 0.0, 1.0 },
	{ "pow", loop_pow, NAN, 0.0, 1.0 },
	{ "pow", loop_pow, 1.0, NAN, 1.0 },
	{ "pow", loop_pow, 1.0, INFINITY, 1.0 },
	{ "pow", loop_pow, 1.0, -1e300, 1.0 },
	{ "pow", loop_pow, INFINITY, 0.5, INFINITY },
	{ "pow", loop_pow, INFINITY, -0.5, 0.0 },
	{ "pow", loop_pow, INFINITY, INFINITY, INFINITY },
	{ "pow", loop_pow, INFINITY, -INFINITY, 0.0 },
	{ "pow", loop_pow, 0.5, INFINITY, 0.0 },
	{ "pow", loop_pow, 0.5, -INFINITY, INFINITY },
	{ "pow", loop_pow, 2.0, INFINITY, INFINITY },
	{ "pow", loop_pow, 2.0, -INFINITY, 0.0 },
	{ "pow", loop_pow, 2.0, 1e300, INFINITY },
	{ "pow", loop_pow, 2.0, -1e300, 0.0 },
	{ "pow", loop_pow, 1e300, 1e300, INFINITY },
	{ "pow", loop_pow, 2.0, 1024.0, INFINITY },
	{ "pow", loop_pow, 2.0, 1023.0, 0x1p1023 },
	{ "pow", loop_pow, 2.0, -1074.0, 0x1p-1074 },
	{ "pow", loop_pow, 0x1p-1074, 1.0, 0x1p-1074 },
	{ "pow", loop_pow, 0x1.fffffffffffffp+1023, 1.0, 0x1.fffffffffffffp+1023 },
	{ "pow", loop_pow, 0x1.fffffffffffffp+1023, 1e-320, 1.0 },
	{ "pow", loop_pow, 9.0, 0.5, 3.0 },
	{ "pow", loop_pow, -2.0, 2.0, NAN },
	{ "pow", loop_pow, -INFINITY, 2.0, NAN },
	{ "pow", loop_pow, NAN, 2.0, NAN },
	{ "pow", loop_pow, 2.0, NAN, NAN },
	{ "pow", loop_pow, 0.0, NAN, NAN },
	{ "cbrt", loop_cbrt, 0.0, 0, 0.0 },
	{ "cbrt", loop_cbrt, -0.0, 0, -0.0 },
	{ "cbrt", loop_cbrt, -27.0, 0, -3.0 },
	{ "cbrt", loop_cbrt, 0x1p-1074, 0, 0x1p-358 },
	{ "cbrt", loop_cbrt, -0x1p1023, 0, -0x1p341 },
	{ "cbrt", loop_cbrt, INFINITY, 0, INFINITY },
	{ "cbrt", loop_cbrt, -INFINITY, 0, -INFINITY },
	{ "cbrt", loop_cbrt, NAN, 0, NAN },
	{ "sin", loop_sin, 0.0, 0, 0.0 },
	{ "sin", loop_sin, -0.0, 0, -0.0 },
	{ "sin", loop_sin, 0x1p-1074, 0, 0x1p-1074 },
	{ "sin", loop_sin, INFINITY, 0, NAN },
	{ "sin", loop_sin, -INFINITY, 0, NAN },
	{ "sin", loop_sin, -1.1e9, 0, NAN },
	{ "sin", loop_sin, NAN, 0, NAN },
	{ "cos", loop_cos, 0.0, 0, 1.0 },
	{ "cos", loop_cos, -0.0, 0, 1.0 },
	{ "cos", loop_cos, -INFINITY, 0, NAN },
	{ "cos", loop_cos, 1.1e9, 0, NAN },
	{ "cos", loop_cos, NAN, 0, NAN },
	{ "atan2", loop_atan2, 0.0, 1.0, 0.0 },
	{ "atan2", loop_atan2, -0.0, 1.0, -0.0 },
	{ "atan2", loop_atan2, 0.0, 0.0, 0.0 },
	{ "atan2", loop_atan2, -0.0, 0.0, -0.0 },
	{ "atan2", loop_atan2, 0.0, -0.0, 0x1.921fb54442d18p+1 },
	{ "atan2", loop_atan2, -0.0, -0.0, -0x1.921fb54442d18p+1 },
	{ "atan2", loop_atan2, 0.0, -1.0, 0x1.921fb54442d18p+1 },
	{ "atan2", loop_atan2, -0.0, -INFINITY, -0x1.921fb54442d18p+1 },
	{ "atan2", loop_atan2, 1.0, 0.0, 0x1.921fb54442d18p+0 },
	{ "atan2", loop_atan2, -1.0, -0.0, -0x1.921fb54442d18p+0 },
	{ "atan2", loop_atan2, 1.0, 1.0, 0x1.921fb54442d18p-1 },
	{ "atan2", loop_atan2, -1.0, -1.0, -0x1.2d97c7f3321d2p+1 },
	{ "atan2", loop_atan2, 0x1p-1074, 0x1p-1074, 0x1.921fb54442d18p-1 },
	{ "atan2", loop_atan2, 0x1p1023, -0x1p1023, 0x1.2d97c7f3321d2p+1 },
	{ "atan2", loop_atan2, 0x1p-1074, 1.0, 0x1p-1074 },
	{ "atan2", loop_atan2, 1e-300, 1e300, 0.0 },
	{ "atan2", loop_atan2, 1.0, INFINITY, 0.0 },
	{ "atan2", loop_atan2, -1.0, -INFINITY, -0x1.921fb54442d18p+1 },
	{ "atan2", loop_atan2, INFINITY, -1.0, 0x1.921fb54442d18p+0 },
	{ "atan2", loop_atan2, INFINITY, INFINITY, 0x1.921fb54442d18p-1 },
	{ "atan2", loop_atan2, -INFINITY, INFINITY, -0x1.921fb54442d18p-1 },
	{ "atan2", loop_atan2, INFINITY, -INFINITY, 0x1.2d97c7f3321d2p+1 },
	{ "atan2", loop_atan2, NAN, INFINITY, NAN },
	{ "atan2", loop_atan2, 0.0, NAN, NAN },
	{ "acos", loop_acos, 1.0, 0, 0.0 },
	{ "acos", loop_acos, -1.0, 0, 0x1.921fb54442d18p+1 },
	{ "acos", loop_acos, 0.0, 0, 0x1.921fb54442d18p+0 },
	{ "acos", loop_acos, -0.0, 0, 0x1.921fb54442d18p+0 },
	{ "acos", loop_acos, 0x1.0000000000001p+0, 0, NAN },
	{ "acos", loop_acos, -INFINITY, 0, NAN },
	{ "acos", loop_acos, NAN, 0, NAN },
	{ "asin", loop_asin, 0.0, 0, 0.0 },
	{ "asin", loop_asin, -0.0, 0, -0.0 },
	{ "asin", loop_asin, 1.0, 0, 0x1.921fb54442d18p+0 },
	{ "asin", loop_asin, -1.0, 0, -0x1.921fb54442d18p+0 },
	{ "asin", loop_asin, -0x1.0000000000001p+0, 0, NAN },
	{ "asin", loop_asin, INFINITY, 0, NAN },
	{ "asin", loop_asin, NAN, 0, NAN },
	{ "carlson_rc", loop_carlson_rc, 1.0, 1.0, 1.0 },
	{ "carlson_rc", loop_carlson_rc, 4.0, 4.0, 0.5 },
	{ "carlson_rc", loop_carlson_rc, -1.0, 1.0, NAN },
	{ "carlson_rc", loop_carlson_rc, 1.0, 0.0, NAN },
	{ "carlson_rc", loop_carlson_rc, 1.0, -1.0, NAN },
	{ "carlson_rc", loop_carlson_rc, NAN, 1.0, NAN },
	{ "carlson_rc", loop_carlson_rc, 1.0, NAN, NAN },
	{ "floor", loop_floor, -0.0, 0, 0.0 },
	{ "floor", loop_floor, 0x1.fffffffffffffp-1, 0, 0.0 },
	{ "floor", loop_floor, -0x1p-1074, 0, -1.0 },
	{ "floor", loop_floor, 2.5, 0, 2.0 },
	{ "floor", loop_floor, -2.5, 0, -3.0 },
	{ "floor", loop_floor, -7.0, 0, -7.0 },
	{ "floor", loop_floor, 0x1.fffffffffffffp+50, 0, 0x1.ffffffffffffcp+50 },
	{ "floor", loop_floor, -INFINITY, 0, -INFINITY },
	{ "floor", loop_floor, NAN, 0, NAN },
	{ "round", loop_round, 0.5, 0, 0.0 },
	{ "round", loop_round, 1.5, 0, 2.0 },
	{ "round", loop_round, -0.3, 0, 0.0 },
	{ "round", loop_round, -2.5, 0, -2.0 },
	{ "round", loop_round, INFINITY, 0, INFINITY },
	{ "round", loop_round, NAN, 0, NAN },
	{ "min", loop_min, 1.0, 2.0, 1.0 },
	{ "min", loop_min, NAN, 2.0, 2.0 },
	{ "min", loop_min, 2.0, NAN, NAN },
	{ "min", loop_min, -0.0, 0.0, 0.0 },
	{ "min", loop_min, 0.0, -0.0, -0.0 },
	{ "max", loop_max, 1.0, 2.0, 2.0 },
	{ "max", loop_max, NAN, 2.0, 2.0 },
	{ "max", loop_max, 2.0, NAN, NAN },
	{ "max", loop_max, -0.0, 0.0, 0.0 },
	{ "max", loop_max, 0.0, -0.0, -0.0 },
	{ "clamp", loop_clamp, -3.0, 1.0, -1.0 },
	{ "clamp", loop_clamp, 0.5, 1.0, 0.5 },
	{ "clamp", loop_clamp, 3.0, 1.0, 1.0 },
	{ "clamp", loop_clamp, NAN, 1.0, NAN },
	{ "abs", loop_abs, -3.0, 0, 3.0 },
	{ "abs", loop_abs, -0.0, 0, 0.0 },
	{ "abs", loop_abs, -INFINITY, 0, INFINITY },
	{ "sign", loop_sign, -0.5, 0, -1.0 },
	{ "sign", loop_sign, 0.5, 0, 1.0 },
	{ "sign", loop_sign, 0.0, 0, 1.0 },
	{ "sign", loop_sign, -0.0, 0, 1.0 },
	{ "sign", loop_sign, NAN, 0, 1.0 },
};

/* Zeros, infinities, NaN and the ends of each range give the promised results, with their signs. */
static void test_special_values(void **unused) {
	bool right = true;

	(void)unused;
	for (size_t i = 0; i < sizeof specials / sizeof specials[0]; i++) {
		const special *s = &specials[i];
		double y;
		s->loop(1, &s->a, &s->b, &y);
		if (quern_bits(y) == quern_bits(s->expected)) continue;
		print_message("%s(%a, %a) = %a, not %a\n", s->name, s->a, s->b, y, s->expected);
		right = false;
	}
	assert_true(right);
}

/* ==== reproducibility ==== */

enum { HASHED = 20011 }; /* odd: every loop has a remainder */

typedef struct {
	const char *name;
	loop_fn loop;
	range a, b; /* of every other argument; the rest are random bits */
	uint64_t hash;
} hashed;

static const hashed hashes[] = {
	{ "exp", loop_exp, { EVEN, -750.0, 715.0 }, { 0 }, 0xeae19509aa78d645u },
	{ "log", loop_log, { EVEN, 0.0, 4.0 }, { 0 }, 0x0cf8578cfe9ef5f6u },
	{ "pow", loop_pow, { EVEN, 0.0, 10.0 }, { EVEN, -20.0, 20.0 }, 0x33f6cb59588c9adfu },
	{ "cbrt", loop_cbrt, { EVEN, -10.0, 10.0 }, { 0 }, 0x3689bb4004b6872cu },
	{ "sin", loop_sin, { EVEN, -1e5, 1e5 }, { 0 }, 0xa708d0865173a18cu },
	{ "cos", loop_cos, { EVEN, -1e5, 1e5 }, { 0 }, 0x2554b2f846bcb92du },
	{ "atan2", loop_atan2, { EVEN, -1.0, 1.0 }, { EVEN, -1.0, 1.0 }, 0xde2a900e78465916u },
	{ "acos", loop_acos, { EVEN, -1.01, 1.01 }, { 0 }, 0x0d1af9ac4a78f645u },
	{ "asin", loop_asin, { EVEN, -1.01, 1.01 }, { 0 }, 0x94abda7ff5df958au },
	{ "carlson_rc", loop_carlson_rc, { EVEN, 0.0, 10.0 }, { EVEN, 0.0, 1.0 }, 0x63d0b00b5c0307b7u },
	{ "floor", loop_floor, { EVEN, -1e3, 1e3 }, { 0 }, 0x6a3d6f541a29b1bcu },
	{ "round", loop_round, { EVEN, -1e3, 1e3 }, { 0 }, 0x1f3cb16bbbbe89acu },
	{ "min", loop_min, { EVEN, -1.0, 1.0 }, { EVEN, -1.0, 1.0 }, 0x7e5c6a6256ad369au },
	{ "max", loop_max, { EVEN, -1.0, 1.0 }, { EVEN, -1.0, 1.0 }, 0x847453a5fd8c7735u },
	{ "clamp", loop_clamp, { EVEN, -3.0, 3.0 }, { EVEN, 0.0, 1.0 }, 0x44c9593708660b83u },
	{ "abs", loop_abs, { EVEN, -1.0, 1.0 }, { 0 }, 0x8c39b94924deb239u },
	{ "sign", loop_sign, { EVEN, -1.0, 1.0 }, { 0 }, 0x89f9862900f99058u },
};

static const uint64_t hash_of_all = 0xd20e7d28211974cbu;

static const uint64_t fnv_start = 0xcbf29ce484222325u;

/* 64-bit FNV-1a over the bytes of `word`, lowest first */
static uint64_t fnv(uint64_t hash, uint64_t word) {
	for (int byte = 0; byte < 8; byte++) hash = (hash ^ (word >> 8 * byte & 0xffu)) * 0x100000001b3u;
	return hash;
}

static uint64_t hash_of(const hashed *h, uint64_t *state, double *a, double *b, double *y) {
	uint64_t hash = fnv_start;

	for (size_t i = 0; i < HASHED; i++) {
		const uint64_t bits_a = next_bits(state), bits_b = next_bits(state);
		const double even_a = draw(state, &h->a, 0.0), even_b = draw(state, &h->b, 0.0);
		a[i] = i % 2 ? even_a : quern_from_bits(bits_a);
		b[i] = i % 2 ? even_b : quern_from_bits(bits_b);
	}
	h->loop(HASHED, a, b, y);
	for (size_t i = 0; i < HASHED; i++) hash = fnv(hash, quern_bits(y[i]));
	return hash;
}

/* The bits of all results are the same for every compiler, optimisation and instruction set. */
static void test_same_bits_everywhere(void **unused) {
	static double a[HASHED], b[HASHED], y[HASHED];
	uint64_t state = 0xbb67ae8584caa73bu, all = fnv_start;
	bool same = true;

	(void)unused;
	for (size_t i = 0; i < sizeof hashes / sizeof hashes[0]; i++) {
		const uint64_t hash = hash_of(&hashes[i], &state, a, b, y);
		if (hash != hashes[i].hash)
			print_message("%s: hash %016llx\n", hashes[i].name, (unsigned long long)hash);
		same = same && hash == hashes[i].hash;
		all = fnv(all, hash);
	}
	print_message("hash of all results %016llx\n", (unsigned long long)all);
	assert_true(same);
	assert_true(all == hash_of_all);
}

/* A value does not depend on where in a batch, or in how long a batch, it is computed. */
static void test_same_bits_alone(void **unused) {
	static double a[HASHED], b[HASHED], y[HASHED];
	uint64_t state = 0x3c6ef372fe94f82bu;

	(void)unused;
	for (size_t f = 0; f < sizeof hashes / sizeof hashes[0]; f++) {
		(void)hash_of(&hashes[f], &state, a, b, y);
		for (size_t i = 0; i < HASHED; i++) {
			double alone;
			hashes[f].loop(1, &a[i], &b[i], &alone);
			assert_true(quern_bits(alone) == quern_bits(y[i]));
		}
	}
}

int main(void) {
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_accuracy),
		cmocka_unit_test(test_far_angles),
		cmocka_unit_test(test_special_values),
		cmocka_unit_test(test_same_bits_everywhere),
		cmocka_unit_test(test_same_bits_alone),
	};
	return cmocka_run_group_tests_name("math", tests, NULL, NULL);
}
