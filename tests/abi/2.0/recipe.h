/* SPDX-License-Identifier: MIT */
/* recipe.h - the kind `recipe`, which solver.frozen calls and nobody else has heard of: what becomes of a dough in a step */
#pragma once
#include <quern/abi.h>

typedef struct quern_recipe_batch {
	uint32_t n, cap;
	quern_real dt;
	quern_real *dough; /* kg, in and out */
	const quern_column *use;
} quern_recipe_batch;

typedef struct quern_recipe_ops {
	uint32_t size, pad;
	void (*knead)(const void *self, const quern_recipe_batch *); /* [batch] */
	quern_real (*patience)(const void *self);                    /* [setup] s; NULL: 1 */
} quern_recipe_ops;

QUERN_KIND(recipe, quern_recipe_ops, "What becomes of a dough.", QUERN_ONE(quern_recipe_ops, knead),
	QUERN_OPTIONALLY(quern_recipe_ops, patience));
