/* SPDX-License-Identifier: MIT */
/* coupling.exact alone: against all of its equations, constraints and their impulses included, solved densely; what it keeps
 * and what passes it unchanged. docs/theory/hybrid.md, section 2 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "plugin_alone.h"
#include "table.h"
#include <quern/coupling.h>
#include <stdlib.h>
#include <string.h>

enum { NODES = 64, GRAINS = 96, REACH = 8, TAKEN = 64, SIZE = NODES + 2 * GRAINS };

/* ---- a host ---- */

typedef struct {
	void *taken[TAKEN];
	int n;
	bool stopped;
} desk;

static void *memory(quern_run *run, size_t bytes) {
	desk *d = (desk *)(void *)run;
	assert_true(d->n < TAKEN);
	return d->taken[d->n++] = calloc(1, bytes + 1);
}

static quern_status stop(
	quern_run *run, quern_status status, const char *set, int64_t id, const char *fmt, ...) {
	(void)set, (void)id, (void)fmt;
	((desk *)(void *)run)->stopped = true;
	return status;
}

static const quern_host host = { .abi = QUERN_ABI, .memory = memory, .stop = stop };

/* ---- systems ---- */

typedef struct {
	uint32_t dim, nodes, grains, row[GRAINS + 1], node[GRAINS * REACH];
	double value[GRAINS * REACH], mass[NODES], velocity[3][NODES];
	double grain_mass[GRAINS], weight[GRAINS], grain_velocity[3][GRAINS];
	double reach[GRAINS], share[GRAINS]; /* sum of a row; what is held of a grain */
	double place[NODES][3], at[GRAINS][3];
} setting;

static double uniform(uint64_t *state, double low, double high) {
	*state = *state * 6364136223846793005u + 1442695040888963407u;
	return low + (high - low) * (double)(*state >> 11) * 0x1p-53;
}

/* Nodes on a lattice, grains anywhere between them, linear functions of shape: so a linear field is exact. */
static void lay_out(setting *s, uint64_t *random, uint32_t side, uint32_t grains, bool apart) {
	const uint32_t lines = 2 * (side - 1);
	s->nodes = s->dim == 2 ? side * side : side * side * side;
	s->grains = grains;
	for (uint32_t i = 0; i < s->nodes; i++)
		for (uint32_t a = 0, rest = i; a < 3; a++, rest /= side)
			s->place[i][a] = a < s->dim ? rest % side : 0;
	for (uint32_t g = 0; g < grains; g++) {
		s->row[g + 1] = s->row[g];
		s->reach[g] = 0;
		for (uint32_t a = 0; a < s->dim; a++)
			s->at[g][a] = apart ? 0.5 * (a ? g / lines : g % lines) + uniform(random, 0.1, 0.4)
								: uniform(random, 0, side - 1);
		for (uint32_t i = 0; i < s->nodes; i++) {
			double value = 1;
			for (uint32_t a = 0; a < s->dim; a++) value *= fmax(0, 1 - fabs(s->at[g][a] - s->place[i][a]));
			if (!(value > 0)) continue;
			s->node[s->row[g + 1]] = i;
			s->value[s->row[g + 1]++] = value;
			s->reach[g] += value;
		}
	}
}

/* As if so many of the entries had met no continuum; the grain keeps one at least. */
static void thin_out(setting *s, uint64_t *random, double share) {
	uint32_t kept = 0;
	for (uint32_t g = 0, begin = 0; g < s->grains; g++) {
		const uint32_t end = s->row[g + 1];
		s->reach[g] = 0;
		for (uint32_t q = begin; q < end; q++) {
			if (uniform(random, 0, 1) < share && (q + 1 < end || s->reach[g] > 0)) continue;
			s->node[kept] = s->node[q];
			s->reach[g] += s->value[kept++] = s->value[q];
		}
		begin = end;
		s->row[g + 1] = kept;
	}
}

static void fill(setting *s, uint64_t *random, double decades) {
	for (uint32_t i = 0; i < s->nodes; i++) {
		s->mass[i] = 10 * pow(10, uniform(random, -decades, 0));
		for (uint32_t a = 0; a < s->dim; a++) s->velocity[a][i] = uniform(random, -1, 1);
	}
	for (uint32_t g = 0; g < s->grains; g++) {
		s->grain_mass[g] = uniform(random, 0.1, 1);
		s->share[g] = fmin(1, fmax(0, (s->reach[g] - 0.9) / 0.1));
		s->weight[g] = uniform(random, 0.02, 1);
		for (uint32_t a = 0; a < s->dim; a++) s->grain_velocity[a][g] = uniform(random, -1, 1);
	}
}

static quern_status solve(setting *s) {
	const quern_plugin *plugin = alone_load("coupling.exact");
	desk d = { .n = 0 };
	quern_coupling_system c = { .dim = s->dim,
		.n_nodes = s->nodes,
		.n_grains = s->grains,
		.dt = 1e-4,
		.mass = s->mass,
		.row = s->row,
		.node = s->node,
		.value = s->value,
		.grain_mass = s->grain_mass,
		.grain_weight = s->weight,
		.host = &host,
		.run = (quern_run *)(void *)&d };
	for (uint32_t a = 0; a < s->dim; a++)
		c.velocity[a] = s->velocity[a], c.grain_velocity[a] = s->grain_velocity[a];
	const quern_status status = ((const quern_coupling_ops *)plugin->ops)->solve(NULL, &c);
	while (d.n) free(d.taken[--d.n]);
	assert_int_equal(d.stopped, status != QUERN_OK);
	return status;
}

/* ---- the same, densely ---- */

typedef struct {
	long double a[SIZE][SIZE + 1];
} dense;

static void eliminate(dense *m, uint32_t n) {
	for (uint32_t k = 0; k < n; k++) {
		uint32_t best = k;
		for (uint32_t i = k; i < n; i++)
			if (fabsl(m->a[i][k]) > fabsl(m->a[best][k])) best = i;
		for (uint32_t j = k; j <= n; j++) {
			const long double t = m->a[k][j];
			m->a[k][j] = m->a[best][j];
			m->a[best][j] = t;
		}
		for (uint32_t i = 0; i < n; i++) {
			const long double f = i == k || m->a[i][k] == 0 ? 0 : m->a[i][k] / m->a[k][k];
			for (uint32_t j = k; j <= n && f != 0; j++) m->a[i][j] -= f * m->a[k][j];
		}
	}
	for (uint32_t i = 0; i < n; i++) m->a[i][n] /= m->a[i][i];
}

/* Unknown: velocities of nodes, of the held parts of grains, and impulses; the rest of a grain takes part at the end. */
static void reference(const setting *s, uint32_t a, double *node, double *grain) {
	const uint32_t v = s->nodes, l = v + s->grains, n = l + s->grains;
	dense *m = calloc(1, sizeof *m);
	assert_non_null(m);
	for (uint32_t i = 0; i < s->nodes; i++) {
		m->a[i][i] = s->mass[i];
		m->a[i][n] = (long double)s->mass[i] * s->velocity[a][i];
	}
	for (uint32_t g = 0; g < s->grains; g++) {
		if (s->share[g] <= 0) { /* as if it were not there */
			m->a[v + g][v + g] = m->a[l + g][l + g] = 1;
			continue;
		}
		m->a[v + g][v + g] = (long double)s->share[g] * s->weight[g] * s->grain_mass[g];
		m->a[v + g][n] = m->a[v + g][v + g] * s->grain_velocity[a][g];
		m->a[v + g][l + g] = m->a[l + g][v + g] = -1;
		for (uint32_t q = s->row[g]; q < s->row[g + 1]; q++)
			m->a[s->node[q]][l + g] = m->a[l + g][s->node[q]] = (long double)s->value[q] / s->reach[g];
	}
	eliminate(m, n);
	for (uint32_t i = 0; i < s->nodes; i++) node[i] = (double)m->a[i][n];
	for (uint32_t g = 0; g < s->grains; g++)
		grain[g] =
			(double)(s->share[g] * m->a[v + g][n] + (1 - (long double)s->share[g]) * s->grain_velocity[a][g]);
	free(m);
}

/* ---- what it keeps ---- */

typedef struct {
	double momentum[3], size, energy;
} sums;

static sums add_up(const setting *s) {
	sums t = { .size = 0 };
	for (uint32_t a = 0; a < s->dim; a++) {
		for (uint32_t i = 0; i < s->nodes; i++) {
			t.momentum[a] += s->mass[i] * s->velocity[a][i];
			t.size += s->mass[i] * fabs(s->velocity[a][i]);
			t.energy += 0.5 * s->mass[i] * s->velocity[a][i] * s->velocity[a][i];
		}
		for (uint32_t g = 0; g < s->grains; g++) {
			const double m = s->weight[g] * s->grain_mass[g], u = s->grain_velocity[a][g];
			t.momentum[a] += m * u;
			t.size += m * fabs(u);
			t.energy += 0.5 * m * u * u;
		}
	}
	return t;
}

static const struct {
	const char *name;
	uint32_t dim, side, grains;
	double missing;
} kinds[] = { { "2-D, few grains", 2, 4, 6, 0 }, { "2-D, more grains than nodes", 2, 4, 80, 0 },
	{ "2-D, at the continuum's rim", 2, 5, 60, 0.4 }, { "3-D", 3, 3, 40, 0 },
	{ "3-D, more grains than nodes, rim", 3, 3, 90, 0.4 } };

static void agrees_with_a_dense_solution(void **state) {
	uint64_t random = 7;
	(void)state;
	bool good = true;
	table_head("velocities off those of a dense solution; momentum; energy gained");
	for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
		double worst = 0, made = 0, gained = -1, node[NODES], grain[GRAINS];
		for (int tries = 0; tries < 10; tries++) {
			setting s = { .dim = kinds[k].dim };
			lay_out(&s, &random, kinds[k].side, kinds[k].grains, false);
			thin_out(&s, &random, kinds[k].missing);
			fill(&s, &random, 1);
			const setting before = s;
			const sums old = add_up(&s);
			assert_int_equal(solve(&s), QUERN_OK);
			const sums now = add_up(&s);
			for (uint32_t a = 0; a < s.dim; a++) {
				reference(&before, a, node, grain);
				for (uint32_t i = 0; i < s.nodes; i++) worst = fmax(worst, fabs(s.velocity[a][i] - node[i]));
				for (uint32_t g = 0; g < s.grains; g++)
					worst = fmax(worst, fabs(s.grain_velocity[a][g] - grain[g]));
				made = fmax(made, fabs(now.momentum[a] - old.momentum[a]) / old.size);
			}
			gained = fmax(gained, now.energy / old.energy - 1);
		}
		good = table_row(kinds[k].name, worst, 0, 1e-12) && good;
		good = table_row("  momentum", made, 0, 1e-14) && good;
		table_note("  energy, of what there was", gained);
		good = good && gained < 0;
	}
	assert_true(good);
}

/* Nodes that hold next to nothing beside others, grains half a cell apart: no velocity grows, and momentum is kept. */
static void light_nodes_do_no_harm(void **state) {
	static const double decades[] = { 3, 10, 30 };
	uint64_t random = 11;
	(void)state;
	bool good = true;
	table_head("masses over so many decades: momentum made; fastest node, of 1 m/s before");
	for (int k = 0; k < 3; k++) {
		double made = 0, fastest = 0;
		for (int tries = 0; tries < 50; tries++) {
			setting s = { .dim = 2 };
			lay_out(&s, &random, 6, 90, true);
			fill(&s, &random, decades[k]);
			const sums old = add_up(&s);
			assert_int_equal(solve(&s), QUERN_OK);
			const sums now = add_up(&s);
			for (uint32_t a = 0; a < s.dim; a++) {
				made = fmax(made, fabs(now.momentum[a] - old.momentum[a]) / old.size);
				for (uint32_t i = 0; i < s.nodes; i++) fastest = fmax(fastest, fabs(s.velocity[a][i]));
			}
		}
		char name[40];
		snprintf(name, sizeof name, "%g", decades[k]);
		good = table_row(name, made, 0, 1e-14) && good;
		good = table_row("  fastest", fastest, 0, 10) && good;
	}
	assert_true(good);
}

/* Also past grains that reach beyond the continuum. */
static void fields_pass(void **state) {
	static const char *const names[] = { "uniform motion, grains at the rim too", "a linear field" };
	uint64_t random = 13;
	(void)state;
	bool good = true;
	table_head("m/s off, of 1");
	for (int field = 0; field < 2; field++)
		for (uint32_t dim = 2; dim <= 3; dim++) {
			double worst = 0, l[3][4];
			setting s = { .dim = dim };
			lay_out(&s, &random, dim == 2 ? 6 : 4, 90, false);
			if (!field) thin_out(&s, &random, 0.4);
			fill(&s, &random, 2);
			for (int a = 0; a < 3; a++)
				for (int b = 0; b < 4; b++) l[a][b] = b < 3 && !field ? 0 : uniform(&random, -0.3, 0.3);
			setting asked = s;
			for (uint32_t a = 0; a < dim; a++) {
				for (uint32_t i = 0; i < s.nodes; i++)
					asked.velocity[a][i] =
						l[a][3] + l[a][0] * s.place[i][0] + l[a][1] * s.place[i][1] + l[a][2] * s.place[i][2];
				for (uint32_t g = 0; g < s.grains; g++)
					asked.grain_velocity[a][g] =
						l[a][3] + l[a][0] * s.at[g][0] + l[a][1] * s.at[g][1] + l[a][2] * s.at[g][2];
			}
			s = asked;
			assert_int_equal(solve(&s), QUERN_OK);
			for (uint32_t a = 0; a < dim; a++) {
				for (uint32_t i = 0; i < s.nodes; i++)
					worst = fmax(worst, fabs(s.velocity[a][i] - asked.velocity[a][i]));
				for (uint32_t g = 0; g < s.grains; g++)
					worst = fmax(worst, fabs(s.grain_velocity[a][g] - asked.grain_velocity[a][g]));
			}
			char name[80];
			snprintf(name, sizeof name, "%u-D, %s", dim, names[field]);
			good = table_row(name, worst, 0, 1e-13) && good;
		}
	assert_true(good);
}

/* A mass that is no number ends the run in words. */
static void nonsense_is_told(void **state) {
	uint64_t random = 17;
	(void)state;
	setting s = { .dim = 2 };
	lay_out(&s, &random, 4, 6, false);
	fill(&s, &random, 1);
	s.grain_mass[3] = NAN;
	assert_int_equal(solve(&s), QUERN_E_NUMERIC);
}

/* The same system twice: not a bit of what came before stays. */
static void bits_are_repeated(void **state) {
	uint64_t random = 19;
	(void)state;
	setting s = { .dim = 3 };
	lay_out(&s, &random, 4, 90, false);
	thin_out(&s, &random, 0.3);
	fill(&s, &random, 3);
	setting one = s, two = s;
	assert_int_equal(solve(&one), QUERN_OK);
	assert_int_equal(solve(&two), QUERN_OK);
	assert_memory_equal(&one, &two, sizeof one);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(agrees_with_a_dense_solution),
		cmocka_unit_test(light_nodes_do_no_harm), cmocka_unit_test(fields_pass),
		cmocka_unit_test(nonsense_is_told), cmocka_unit_test(bits_are_repeated) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
