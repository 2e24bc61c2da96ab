/* SPDX-License-Identifier: MIT */
/* batches - what the call of a plugin's law costs: nanoseconds for a contact or a point, with the law
 *
 *   loaded    as a run has it: from a shared object, called through its table
 *   linked    from the same source in this program, called through its table
 *   inlined   from the same source, put by the compiler into the loop that calls it
 *
 *   batches ROUNDS     a line of CSV for each law; the three take turns, and the least of all rounds counts
 *   batches check      whether all three leave the same bits
 *
 * A batch has 256 contacts or 64 points, as in a run, and stays in the cache. docs/bench.md */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "../physics/plugin_alone.h"
#include "twin.h"
#include <math.h>
#include <quern/columns.h>
#include <quern/contact.h>
#include <quern/material.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { CONTACTS = 256, POINTS = 64, N = CONTACTS, CALLS = 200, COLUMNS = 56 }; /* batches as in a run */
typedef enum { LOADED, LINKED, INLINED, WAYS } way;

/* All columns of a batch. */
typedef struct store {
	_Alignas(64) quern_real column[COLUMNS][N];
	uint32_t used;
} store;

/* Numbers in no order that a processor could foresee. */
static quern_real *range(store *s, quern_real least, quern_real most) {
	assert_true(s->used < COLUMNS);
	quern_real *column = s->column[s->used++];
	for (uint32_t i = 0; i < N; i++)
		column[i] = least + (most - least) * (quern_real)((i + 1) * 2654435761u * s->used % 1021u) / 1020;
	return column;
}

static void vectors(store *s, const quern_real *out[], uint32_t n, quern_real most) {
	for (uint32_t k = 0; k < n; k++) out[k] = range(s, -most, most);
}

/* What a law remembers begins with nothing; what it asks of grains is no larger than the other numbers. */
static void uses(store *s, const quern_plugin *plugin, uint32_t dim, quern_column *use) {
	for (const quern_use *row = plugin->uses; row->field; row++, use++)
		for (uint32_t k = 0; k < quern_shape_size(row->shape, dim); k++)
			use->real[k] = range(s, 0, row->access == QUERN_READ ? 1 : 0);
}

static quern_contact_batch contacts(store *s, const quern_plugin *plugin, uint32_t dim, quern_column *use) {
	const uint32_t turns = dim == 3 ? 3 : 1;
	quern_contact_batch b = {
		.n = CONTACTS, .cap = N, .dt = 1e-5, .use = use, .use_second = use, .lag = 5e-11
	};
	quern_real *normal[3];
	b.overlap = range(s, -1e-6, 1e-5);
	b.radius = range(s, 4e-4, 6e-4);
	b.mass = range(s, 1e-6, 2e-6);
	for (uint32_t k = 0; k < dim; k++) b.normal[k] = normal[k] = range(s, 0.1, 1);
	for (uint32_t i = 0; i < N; i++) {
		quern_real square = 0;
		for (uint32_t k = 0; k < dim; k++) square += normal[k][i] * normal[k][i];
		for (uint32_t k = 0; k < dim; k++) normal[k][i] /= sqrt(square);
	}
	vectors(s, b.velocity, dim, 0.1);
	vectors(s, b.mean_velocity, dim, 0.1);
	vectors(s, b.spin, turns, 1);
	vectors(s, b.mean_spin, turns, 1);
	if (dim == 3) vectors(s, b.turn, 3, 1);
	for (uint32_t k = 0; k < dim; k++) b.force[k] = range(s, 0, 0);
	uses(s, plugin, dim, use);
	return b;
}

static quern_material_batch points(store *s, const quern_plugin *plugin, uint32_t dim, quern_column *use) {
	quern_material_batch b = { .n = POINTS, .cap = N, .dt = 1e-5, .use = use };
	vectors(s, b.gradient, dim * dim, 1);
	b.grid_density = range(s, 1990, 2010);
	b.density = range(s, 2000, 2010);
	for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, dim); k++)
		b.stress[k] = k < dim ? range(s, -1500, -500) : range(s, -100, 100);
	b.mean_pressure = range(s, 900, 1100);
	uses(s, plugin, dim, use);
	return b;
}

extern const twin linear_twin, hertz_twin, mu_i_twin, drucker_prager_twin;

typedef struct law {
	const char *id;
	const twin *twin;
	bool contact; /* or a material */
	alone_value value[5];
} law;

static const law laws[] = {
	{ "contact.linear", &linear_twin, true, { { "stiffness", 1e5 } } },
	{ "contact.hertz", &hertz_twin, true, { { "young", 1e8 }, { "poisson", 0.3 }, { "impact_speed", 1 } } },
	{ "material.mu_i", &mu_i_twin, false,
		{ { "bulk_modulus", 3e5 }, { "diameter", 1e-3 }, { "grain_density", 2500 },
			{ "critical_density", 2000 } } },
	{ "material.drucker_prager", &drucker_prager_twin, false,
		{ { "bulk_modulus", 3e5 }, { "density", 2000 } } },
};

/* A law with the batch that it works on, as it was made. */
typedef struct bench {
	const law *law;
	alone loaded;
	uint32_t dim, n;
	store fresh, now;
	quern_column use[QUERN_MOST_USES];
	union {
		quern_contact_batch contact;
		quern_material_batch material;
	} batch;
} bench;

static void open_bench(bench *b, const law *l, uint32_t dim) {
	memset(b, 0, sizeof *b);
	b->law = l;
	b->dim = dim;
	b->loaded = alone_make(l->id, dim, l->value);
	assert_int_equal(b->loaded.status, QUERN_OK);
	b->n = l->contact ? CONTACTS : POINTS;
	if (l->contact) b->batch.contact = contacts(&b->now, b->loaded.plugin, dim, b->use);
	else b->batch.material = points(&b->now, b->loaded.plugin, dim, b->use);
	b->fresh = b->now;
}

/* Nanoseconds for one entry. */
static double time_calls(bench *b, way w) {
	const twin *source = b->law->twin;
	const quern_plugin *plugin = w == LOADED ? b->loaded.plugin : source->linked->plugin;
	struct timespec begin, end;
	b->now = b->fresh;
	clock_gettime(CLOCK_MONOTONIC, &begin);
	if (w == INLINED) source->inlined[b->dim - 2](b->loaded.self, &b->batch, CALLS);
	else source->call(plugin, b->dim, b->loaded.self, &b->batch, CALLS);
	clock_gettime(CLOCK_MONOTONIC, &end);
	return (1e9 * (double)(end.tv_sec - begin.tv_sec) + (double)(end.tv_nsec - begin.tv_nsec)) /
		   (b->n * CALLS);
}

static int compare(bench *b) {
	static store found[WAYS];
	for (way w = LOADED; w < WAYS; w++) {
		time_calls(b, w);
		found[w] = b->now;
	}
	assert_memory_not_equal(&found[LOADED], &b->fresh, sizeof b->fresh);
	const int differ = memcmp(&found[LOADED], &found[LINKED], sizeof(store)) ||
					   memcmp(&found[LOADED], &found[INLINED], sizeof(store));
	if (differ) printf("%s, %u-D: not the same bits\n", b->law->id, b->dim);
	return differ;
}

static void measure(bench *b, long rounds) {
	double least[WAYS] = { INFINITY, INFINITY, INFINITY };
	for (long r = 0; r < rounds; r++)
		for (long k = 0; k < WAYS; k++) {
			const way w = (way)((k + r) % WAYS);
			least[w] = fmin(least[w], time_calls(b, w));
		}
	printf("%s,%u,%.4f,%.4f,%.4f\n", b->law->id, b->dim, least[LOADED], least[LINKED], least[INLINED]);
}

int main(int n, char **words) {
	static bench b;
	const bool check = n == 2 && !strcmp(words[1], "check");
	const long rounds = n == 2 ? strtol(words[1], NULL, 10) : 0;
	int differ = 0;
	if (!check && rounds < 1) {
		fprintf(stderr, "batches: how many rounds? docs/bench.md\n");
		return 2;
	}
	if (!check) printf("law,dimension,loaded_ns,linked_ns,inlined_ns\n");
	for (uint32_t l = 0; l < sizeof laws / sizeof *laws; l++)
		for (uint32_t dim = 2; dim <= 3; dim++) {
			open_bench(&b, &laws[l], dim);
			if (check) differ |= compare(&b);
			else measure(&b, rounds);
			free(b.loaded.self);
		}
	return differ;
}
