/* SPDX-License-Identifier: MIT */
/* random - Philox 4x32-10 (Salmon et al. 2011): a function of (stream, key, counter), so order and threads do not
 * matter */
#pragma once
#include <stdint.h>

/* Two uniforms in [0, 1). */
void quern_random(uint64_t stream, uint64_t key, uint64_t counter, double out[2]);
/* The generator itself: four words from counter and key, for the known-answer test. */
void quern_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t out[4]);
