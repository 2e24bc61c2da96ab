/* SPDX-License-Identifier: MIT */
#include "random.h"

void quern_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]) {
	uint32_t c0 = counter[0], c1 = counter[1], c2 = counter[2], c3 = counter[3], k0 = key[0], k1 = key[1];
	for (int round = 0; round < 10; round++) {
		const uint64_t a = (uint64_t)0xd2511f53u * c0, b = (uint64_t)0xcd9e8d57u * c2;
		c0 = (uint32_t)(b >> 32) ^ c1 ^ k0;
		c2 = (uint32_t)(a >> 32) ^ c3 ^ k1;
		c1 = (uint32_t)b;
		c3 = (uint32_t)a;
		k0 += 0x9e3779b9u;
		k1 += 0xbb67ae85u;
	}
	out[0] = c0, out[1] = c1, out[2] = c2, out[3] = c3;
}

static double uniform(uint32_t high, uint32_t low) {
	return (double)(((uint64_t)high << 32 | low) >> 11) * 0x1p-53;
}

void quern_random(uint64_t stream, uint64_t key, uint64_t counter, double out[2]) {
	const uint32_t c[4] = { (uint32_t)counter, (uint32_t)(counter >> 32), (uint32_t)key,
		(uint32_t)(key >> 32) };
	const uint32_t k[2] = { (uint32_t)stream, (uint32_t)(stream >> 32) };
	uint32_t word[4];
	quern_philox(c, k, word);
	out[0] = uniform(word[0], word[1]);
	out[1] = uniform(word[2], word[3]);
}
