/* SPDX-License-Identifier: MIT */
/* coupling.exact - every grain moves with the continuum's velocity at its centre: one system for all nodes and grains, by sparse
 * factors. docs/theory/hybrid.md, section 2 */
#include "exchange.h"
#include <quern/coupling.h>
#include <suitesparse/amd.h>
#include <suitesparse/ldl.h>

typedef struct {
	int32_t unused;
} coupling;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { { .field = "point.affine",
									  .unit = "1/s",
									  .doc = "Velocity gradient of the last step, sent with the velocity.",
									  .access = QUERN_READ,
									  .shape = QUERN_TENSOR },
	QUERN_END_USES };

/* Nobody calls it where there is `solve`; at a single node it says the same. */
static void couple(const void *self, const quern_coupling_job *job) { (void)self, exchange(job); }

typedef SuiteSparse_long whole;

/* A = M + sum of m N N^T over what is held of grains, by rows, with light nodes lumped; it is symmetric. A = P^T L D L^T P. */
typedef struct {
	const quern_coupling_system *c;
	whole n, *begin, *other; /* n + 1; by entry */
	quern_real *value;
	quern_real *lumped; /* by node: share of what it has to do with others that it settles by itself */
	quern_real *shape;  /* N, by entry of the system's matrix: without light nodes, a held grain's sum to 1 */
	quern_real *share;  /* by grain: of its mass that moves with the continuum */
	whole *meets;       /* by node and one more: its entries in */
	uint32_t *grain, *entry; /* the matrix of shapes by columns */
	whole *seen;             /* by node: where the present row of A has it, or less than where that begins */
	whole *order, *place;    /* P and its inverse */
	whole *low_begin, *low_at;   /* of L, by columns */
	quern_real *low, *diagonal;  /* L, D */
	quern_real *change, *solved; /* by node: of one component; the same in the order of P */
	quern_real *ahead;           /* by grain: what it is ahead of the continuum at its centre */
} exact;

static void *take(const exact *e, whole n, size_t size) {
	return e->c->host->memory(e->c->run, ((size_t)n + 1) * size);
}

/* ---- the matrix ---- */

/* Which grains reach a node, in their order. */
static void list_by_node(const exact *e) {
	const quern_coupling_system *c = e->c;
	for (uint32_t q = 0; q < c->row[c->n_grains]; q++) e->meets[c->node[q] + 1]++;
	for (whole i = 0; i < e->n; i++) e->meets[i + 1] += e->meets[i];
	for (uint32_t g = c->n_grains; g-- > 0;)
		for (uint32_t q = c->row[g]; q < c->row[g + 1]; q++) {
			const whole at = --e->meets[c->node[q] + 1];
			e->grain[at] = g;
			e->entry[at] = q;
		}
	/* each now begins one too far to the right */
	for (whole i = 0; i < e->n; i++) e->meets[i] = e->meets[i + 1];
	e->meets[e->n] = c->row[c->n_grains];
}

/* A node that holds next to no continuum must not bind grains to each other, nor be thrown about by them: with less than `least`
 * of what they weigh there it fades, and it settles with them by itself. So nothing jumps when a point's rim comes to reach a
 * node. A trace of that everywhere settles what neither mass nor grain holds. */
static void weigh_nodes(const exact *e) {
	const quern_coupling_system *c = e->c;
	const quern_real least = 0.02, trace = 1e-13;
	for (whole i = 0; i < e->n; i++) {
		quern_real brought = 0;
		for (whole k = e->meets[i]; k < e->meets[i + 1]; k++)
			brought += c->grain_weight[e->grain[k]] * c->grain_mass[e->grain[k]] * c->value[e->entry[k]];
		const quern_real ratio = c->mass[i] / (least * brought), lumped = 2 - ratio;
		for (whole k = e->meets[i]; k < e->meets[i + 1]; k++)
			e->shape[e->entry[k]] = c->value[e->entry[k]] * (ratio < 1 ? ratio : 1);
		e->lumped[i] = lumped > 1 ? 1 : lumped > trace ? lumped : trace;
	}
}

/* A grain is held where continuum has all of its reach, and not at all with a tenth less: its velocity would be compared with one
 * beside it, and a wave would find the zone's rim rigid. */
static void weigh_grains(const exact *e) {
	const quern_coupling_system *c = e->c;
	const quern_real least = 0.9;
	for (uint32_t g = 0; g < c->n_grains; g++) {
		quern_real reach = 0;
		for (uint32_t q = c->row[g]; q < c->row[g + 1]; q++) reach += e->shape[q];
		const quern_real share = (reach - least) / (1 - least);
		e->share[g] = share > 1 ? 1 : share > 0 ? share : 0;
		for (uint32_t q = c->row[g]; q < c->row[g + 1]; q++) e->shape[q] /= reach > least ? reach : 1;
	}
}

static quern_real held_mass(const exact *e, uint32_t g) {
	return e->share[g] * e->c->grain_weight[g] * e->c->grain_mass[g];
}

/* Row i of A, which begins at `at`, with the diagonal first; returns where it ends. Without values its length alone is found.
 * What is lumped goes to the diagonal, so that a sum over the row, the momentum, stays as it is. */
static whole add_row(const exact *e, whole i, whole at, bool write) {
	const quern_coupling_system *c = e->c;
	const whole begin = at;
	if (write) e->other[at] = i, e->value[at] = c->mass[i];
	e->seen[i] = at++;
	for (whole k = e->meets[i]; k < e->meets[i + 1]; k++) {
		const uint32_t g = e->grain[k];
		const quern_real mine = held_mass(e, g) * e->shape[e->entry[k]];
		for (uint32_t q = c->row[g]; q < c->row[g + 1]; q++) {
			const uint32_t j = c->node[q];
			if (e->seen[j] < begin) {
				if (write) e->other[at] = j, e->value[at] = 0;
				e->seen[j] = at++;
			}
			if (!write) continue;
			const quern_real all = mine * e->shape[q],
							 lumped = all * (e->lumped[i] > e->lumped[j] ? e->lumped[i] : e->lumped[j]);
			e->value[begin] += lumped;
			e->value[e->seen[j]] += all - lumped;
		}
	}
	return at;
}

static bool make_matrix(exact *e) {
	const quern_coupling_system *c = e->c;
	const whole values = c->row[c->n_grains];
	if (!(e->share = take(e, c->n_grains, sizeof(quern_real))) ||
		!(e->meets = take(e, e->n + 1, sizeof(whole))) || !(e->grain = take(e, values, sizeof(uint32_t))) ||
		!(e->entry = take(e, values, sizeof(uint32_t))) || !(e->seen = take(e, e->n, sizeof(whole))) ||
		!(e->begin = take(e, e->n + 1, sizeof(whole))) || !(e->lumped = take(e, e->n, sizeof(quern_real))) ||
		!(e->shape = take(e, values, sizeof(quern_real))))
		return false;
	list_by_node(e);
	weigh_nodes(e);
	weigh_grains(e);
	for (whole i = 0; i < e->n; i++) e->seen[i] = -1;
	for (whole i = 0; i < e->n; i++) e->begin[i + 1] = add_row(e, i, e->begin[i], false);
	if (!(e->other = take(e, e->begin[e->n], sizeof(whole))) ||
		!(e->value = take(e, e->begin[e->n], sizeof(quern_real))))
		return false;
	for (whole i = 0; i < e->n; i++) e->seen[i] = -1;
	for (whole i = 0; i < e->n; i++) add_row(e, i, e->begin[i], true);
	return true;
}

/* ---- its factors ---- */

static quern_status factorise(exact *e) {
	const whole n = e->n;
	whole *parent = take(e, n, sizeof(whole)), *count = take(e, n, sizeof(whole)),
		  *flag = take(e, n, sizeof(whole)), *pattern = take(e, n, sizeof(whole));
	quern_real *row = take(e, n, sizeof(quern_real));
	e->order = take(e, n, sizeof(whole));
	e->place = take(e, n, sizeof(whole));
	e->low_begin = take(e, n + 1, sizeof(whole));
	e->diagonal = take(e, n, sizeof(quern_real));
	if (!parent || !count || !flag || !pattern || !row || !e->order || !e->place || !e->low_begin ||
		!e->diagonal || amd_l_order(n, e->begin, e->other, e->order, NULL, NULL) < AMD_OK)
		return QUERN_E_MEMORY;
	ldl_l_symbolic(n, e->begin, e->other, e->low_begin, parent, count, flag, e->order, e->place);
	e->low_at = take(e, e->low_begin[n], sizeof(whole));
	e->low = take(e, e->low_begin[n], sizeof(quern_real));
	if (!e->low_at || !e->low) return QUERN_E_MEMORY;
	/* from where it gives up, the diagonal stays zero */
	ldl_l_numeric(n, e->begin, e->other, e->value, e->low_begin, parent, count, e->low_at, e->low,
		e->diagonal, row, pattern, flag, e->order, e->place);
	for (whole i = 0; i < n; i++)
		if (!(e->diagonal[i] > 0))
			return e->c->host->stop(e->c->run, QUERN_E_NUMERIC, NULL, -1,
				"the exact coupling's matrix is not positive: masses or velocities have grown beyond all bounds; take a "
				"shorter step");
	return QUERN_OK;
}

/* ---- one component ---- */

/* What grains bring to the nodes beyond what these have. */
static void gather(const exact *e, uint32_t a) {
	const quern_coupling_system *c = e->c;
	for (uint32_t g = 0; g < c->n_grains; g++) {
		e->ahead[g] = 0;
		for (uint32_t q = c->row[g]; q < c->row[g + 1]; q++)
			e->ahead[g] += e->shape[q] * (c->grain_velocity[a][g] - c->velocity[a][c->node[q]]);
	}
	for (whole i = 0; i < e->n; i++) {
		e->change[i] = 0;
		for (whole k = e->meets[i]; k < e->meets[i + 1]; k++)
			e->change[i] += held_mass(e, e->grain[k]) * e->shape[e->entry[k]] * e->ahead[e->grain[k]];
	}
}

/* From momentum to velocity. */
static void apply_factors(const exact *e) {
	for (whole i = 0; i < e->n; i++) e->solved[i] = e->change[e->order[i]];
	ldl_l_lsolve(e->n, e->solved, e->low_begin, e->low_at, e->low);
	ldl_l_dsolve(e->n, e->solved, e->diagonal);
	ldl_l_ltsolve(e->n, e->solved, e->low_begin, e->low_at, e->low);
	for (whole i = 0; i < e->n; i++) e->change[e->order[i]] = e->solved[i];
}

static void move(const exact *e, uint32_t a) {
	const quern_coupling_system *c = e->c;
	for (whole i = 0; i < e->n; i++) c->velocity[a][i] += e->change[i];
	for (uint32_t g = 0; g < c->n_grains; g++) {
		quern_real gained = 0;
		for (uint32_t q = c->row[g]; q < c->row[g + 1]; q++) gained += e->shape[q] * e->change[c->node[q]];
		c->grain_velocity[a][g] += e->share[g] * (gained - e->ahead[g]);
	}
}

static quern_status solve(const void *self, const quern_coupling_system *c) {
	exact e = { .c = c, .n = c->n_nodes };
	(void)self;
	if (!make_matrix(&e) || !(e.change = take(&e, e.n, sizeof(quern_real))) ||
		!(e.solved = take(&e, e.n, sizeof(quern_real))) ||
		!(e.ahead = take(&e, c->n_grains, sizeof(quern_real))))
		return QUERN_E_MEMORY;
	const quern_status status = factorise(&e);
	for (uint32_t a = 0; a < c->dim && status == QUERN_OK; a++) {
		gather(&e, a);
		apply_factors(&e);
		move(&e, a);
	}
	return status;
}

static const quern_coupling_ops ops = { .size = sizeof ops, .couple = couple, .solve = solve };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "coupling.exact",
	.brief = "Grains move with the continuum at their centres: one sparse system a step.",
	.doc =
		"Exact for uniform motion, uniform strain rate and rigid rotation, where all nodes within a grain's reach hold "
		"continuum. Grains keep no motion below the grid's cell, and the hybrid's transfer is not asked. For tests and small "
		"scenes: it takes one thread.",
	.cite = "Yue et al. 2018",
	.instance_size = sizeof(coupling),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
