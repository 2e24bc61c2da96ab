/* SPDX-License-Identifier: MIT */
/* floors - what the machine gives at most, for what tools/bench prints beside the continuum: bytes per second between memory and processor,
 * and sums and products of doubles per second.
 *
 *   floors THREADS
 *
 * Bytes are those of a = b + s c over arrays that no cache holds: two are read and one is written. Sums and products are those of 24
 * independent chains of fused products of a vector each. The best of several rounds counts. Prints one line of JSON. docs/bench.md */
#include <omp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum { ROUNDS = 8, CHAINS = 24, LANES = 8 };
static const size_t N = (size_t)1 << 24; /* 128 MiB for each array */

/* GB/s; 0: no memory. */
static double measure_bytes(int threads) {
	double *a = malloc(N * sizeof *a), *b = malloc(N * sizeof *b), *c = malloc(N * sizeof *c), best = 0;
	for (int round = 0; round < ROUNDS && a && b && c; round++) {
		const double begin = omp_get_wtime();
#pragma omp parallel for num_threads(threads) schedule(static)
		for (size_t i = 0; i < N; i++) {
			if (round) a[i] = b[i] + 0.5 * c[i];
			else a[i] = b[i] = c[i] = (double)i; /* each thread touches its part first */
		}
		const double rate = 3e-9 * sizeof(double) * (double)N / (omp_get_wtime() - begin);
		best = round && rate > best ? rate : best;
	}
	if (a && b && c && a[N - 1] != 1.5 * (double)(N - 1)) best = 0;
	free(a), free(b), free(c);
	return best;
}

typedef double lanes __attribute__((vector_size(LANES * sizeof(double))));

static double chain(long times) {
	lanes x[CHAINS];
	const lanes factor = (lanes) { 0 } + 0.999999, term = (lanes) { 0 } + 1e-6;
	double sum = 0;
	for (int k = 0; k < CHAINS; k++) x[k] = (lanes) { 0 } + k;
	for (long t = 0; t < times; t++)
#pragma GCC unroll 24
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
	printf("{\"gb_per_s\": %.2f, \"gflop_per_s\": %.1f}\n", measure_bytes((int)threads),
		measure_sums((int)threads));
	return 0;
}
