/* SPDX-License-Identifier: MIT */
/* conductivity - a kind that Quern has never heard of: how well a material conducts heat. Called by solver.heat, once a
 * step for every point */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct conductivity_batch {
	uint32_t n, cap;
	const quern_real *temperature; /* K */
	quern_real *conductivity;      /* W/(m K), out: finite and not negative */
	const quern_column *use; /* by row of the plugin's uses, hook 0; "particle" is a point of the continuum */
} conductivity_batch;

typedef struct conductivity_ops {
	uint32_t size, pad;
	void (*conductivity)(const void *self, const conductivity_batch *); /* [batch] */
} conductivity_ops;

QUERN_KIND(conductivity, conductivity_ops, "How well a material conducts heat.",
	QUERN_ONE(conductivity_ops, conductivity));

#ifdef __cplusplus
}
#endif
