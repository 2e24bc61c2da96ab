/* SPDX-License-Identifier: MIT */
/* exchange - the inelastic exchange of momentum that both couplings make, node by node */
#pragma once
#include <quern/coupling.h>

/* v = (m_c v_c + m_d v_d)/(m_c + m_d), by one impulse that both take: its momentum is kept to the last bit but one. */
static inline void exchange(const quern_coupling_job *job) {
	const quern_real *restrict m = job->mass, *restrict n = job->other_mass;
	for (uint32_t k = 0; k < job->dim; k++) {
		quern_real *restrict v = job->velocity[k], *restrict other = job->other[k];
		QUERN_SIMD
		for (uint32_t i = 0; i < job->n; i++) {
			const quern_real impulse = m[i] * n[i] / (m[i] + n[i]) * (other[i] - v[i]);
			v[i] += impulse / m[i];
			other[i] -= impulse / n[i];
		}
	}
}
