/* SPDX-License-Identifier: MIT */
/* floors - what the machine gives at most, for what tools/bench prints beside the continuum: bytes per second between memory and processor,
 * and sums and products of doubles per second.
 *
 *   floors THREADS
 *
 * Bytes are those of a = b + s a over arrays that no cache holds: two are read and one is written, in place. Sums and products are those of
 * independent chains of fused products of a vector each, as many as registers hold. The best of several rounds counts. Prints one line of JSON. docs/bench.md */
#include <omp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#if defined __AVX512F__
enum { CHAINS = 24, LANES = 8 };
#elif defined __AVX__
enum { CHAINS = 12, LANES = 4 };
#else
enum { CHAINS = 12, LANES = 2 };
#endif
enum { ROUNDS = 8 };
static const size_t N = (size_t)1 << 24; /* 128 MiB for each array */

/* GB/s; 0: no memory. */
static double measure_bytes(int threads) {
	double *a = malloc(N * sizeof *a), *b = malloc(N * sizeof *b), best = 0;
	for (int round = 0; round < ROUNDS && a && b; round++) {
		const double begin = omp_get_wtime();
#pragma omp parallel for num_threads(threads) schedule(static)
		for (size_t i = 0; i < N; i++) {
			if (round) a[i] = b[i] + 0.5 * a[i];
			else a[i] = b[i] = (double)i; /* each thread touches its part first */
		}
		const double rate = 3e-9 * sizeof(double) * (double)N / (omp_get_wtime() - begin);
		best = round && rate > best ? rate : best;
	}
	/* i (2 - 1/2^k) after k rounds */
	if (a && b && a[N - 1] != (2 - 1.0 / (1 << (ROUNDS - 1))) * (double)(N - 1)) best = 0;
	free(a), free(b);
	return best;
}

typedef double lanes __attribute__((vector_size(LANES * sizeof(double))));

static double chain(long times) {
	lanes x[CHAINS];
	const lanes factor = (lanes) { 0 } + 0.999999, term = (lanes) { 0 } + 1e-6;
	double sum = 0;
	for (int k = 0; k < CHAINS; k++) x[k] = (lanes) { 0 } + k;
	for (long t = 0; t < times; t++)
#pragma GCC unroll 24 /* all of them */
		for (int k = 0; k < CHAINS; k++) x[k] = x[k] * factor + term;
	for (int k = 0; k < CHAINS; k++)
		for (int l = 0; l < LANES; l++) sum += x[k][l];
	return sum;
}

/* Gflop/s, a product and a sum for each. */
static double measure_sums(int threads) {
	const long times = 4000000;
	double best = 0, sum = 0;
	for (int round = 0; round < ROUNDS; round++) {
		const double begin = omp_get_wtime();
#pragma omp parallel num_threads(threads) reduction(+ : sum)
		sum += chain(times);
		const double rate = 2e-9 * CHAINS * LANES * (double)times * threads / (omp_get_wtime() - begin);
		best = rate > best ? rate : best;
	}
	return sum > 0 ? best : 0;
}

int main(int n, char **words) {
	const long threads = n == 2 ? strtol(words[1], NULL, 10) : 0;
	if (threads < 1 || threads > 1024) {
		fprintf(stderr, "floors: how many threads? docs/bench.md\n");
		return 2;
	}
	const double bytes = measure_bytes((int)threads), sums = measure_sums((int)threads);
	if (!(bytes > 0 && sums > 0)) {
		fprintf(stderr, "floors: no memory for two arrays of 128 MiB, or wrong sums\n");
		return 1;
	}
	printf("{\"gb_per_s\": %.2f, \"gflop_per_s\": %.1f}\n", bytes, sums);
	return 0;
}
