/* SPDX-License-Identifier: MIT */
/* check.transfer - from grid to particles and back, on a line of nodes: uniform motion stays, momentum is kept; where points
 * send a matrix, linear motion stays too */
#include <math.h>
#include <quern/check.h>
#include <quern/transfer.h>
#include <stdlib.h>
#include <string.h>

enum { PIC, CHANGE, ECHO, SEND, VELOCITY, FIT, SHIFT, AFFINE };

static void call(const quern_check_kernel *k, const quern_check_batch *b) {
	const quern_transfer_ops *ops = k->ops;
	quern_column use[QUERN_MOST_USES];
	quern_transfer_batch batch = { .n = b->n, .cap = b->cap, .pass = k->pass, .dt = k->dt, .use = use };
	QUERN_CHECK_VECTOR(batch.pic, k, b, PIC, k->dim);
	QUERN_CHECK_VECTOR(batch.change, k, b, CHANGE, k->dim);
	QUERN_CHECK_VECTOR(batch.echo, k, b, ECHO, k->dim);
	QUERN_CHECK_VECTOR(batch.send, k, b, SEND, k->dim);
	QUERN_CHECK_VECTOR(batch.velocity, k, b, VELOCITY, k->dim);
	if (quern_check_has(k, FIT)) {
		QUERN_CHECK_VECTOR(batch.fit, k, b, FIT, k->dim * k->dim);
		QUERN_CHECK_VECTOR(batch.shift, k, b, SHIFT, k->dim);
		QUERN_CHECK_VECTOR(batch.affine, k, b, AFFINE, k->dim * k->dim);
	}
	k->host->columns(k, b, k->use, use);
	ops->gather[k->dim - 2](k->self, &batch);
}

static uint32_t trips_of(const quern_check *c, const quern_check_instance *it) {
	return quern_transfer_trips(c->ops, it->self);
}

/* Before the last pass a transfer sends and leaves velocities alone. */
static quern_check_kernel *create(
	const quern_check *c, const quern_check_instance *it, uint32_t pass, uint32_t n) {
	const bool last = pass == trips_of(c, it), matrix = last && ((const quern_transfer_ops *)c->ops)->affine;
	quern_check_kernel *k = c->host->kernel_create(c, it, last ? "gather, last pass" : "gather", n);
	k->call = call;
	k->pass = pass;
	k->dt = 1e-3;
	c->host->add(k, PIC, "pic", QUERN_CHECK_IN, k->dim);
	c->host->add(k, CHANGE, "change", QUERN_CHECK_IN, k->dim);
	if (pass) c->host->add(k, ECHO, "echo", QUERN_CHECK_IN, k->dim);
	if (!last) c->host->add(k, SEND, "send", QUERN_CHECK_OUT, k->dim);
	c->host->add(k, VELOCITY, "velocity", last ? QUERN_CHECK_CHANGED : QUERN_CHECK_IN, k->dim);
	if (matrix) {
		c->host->add(k, FIT, "fit", QUERN_CHECK_IN, k->dim * k->dim);
		c->host->add(k, SHIFT, "shift", QUERN_CHECK_IN, k->dim);
		c->host->add(k, AFFINE, "affine", QUERN_CHECK_OUT, k->dim * k->dim);
		c->host->fill(k, SHIFT, k->dim, 89, 1, 1);
	}
	c->host->add_uses(k, 0, true);
	return k;
}

static quern_check_kernel *make(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	static const int names[] = { PIC, CHANGE, ECHO, VELOCITY };
	if (variant > trips_of(c, it)) return NULL;
	quern_check_kernel *k = create(c, it, variant, n);
	for (int i = 0; i < 4; i++)
		if (k->at[names[i]] >= 0) c->host->fill(k, names[i], k->dim, 90 + (uint64_t)i, -1, 1);
	if (quern_check_has(k, FIT)) {
		c->host->fill(k, FIT, k->dim * k->dim, 94, -1, 1);
		c->host->fill(k, SHIFT, k->dim, 99, 0.5, 2);
	}
	return k;
}

/* ---- particles on a line of nodes ---- */

enum { PARTICLES = 400, NODES = 41 };

typedef struct {
	double x[PARTICLES], m[PARTICLES], v[PARTICLES][3], send[PARTICLES][3], echo[PARTICLES][3];
	double mass[NODES], old[NODES][3], now[NODES][3];
	double slope[PARTICLES][3]; /* of what a particle sends, along the line */
} line;

/* Mass-weighted means of `what` at the nodes. */
static void to_nodes(const line *l, double (*what)[3], double (*nodes)[3]) {
	memset(nodes, 0, NODES * sizeof *nodes);
	for (int p = 0; p < PARTICLES; p++) {
		const int i = (int)l->x[p];
		for (int c = 0; c < 3; c++) {
			nodes[i][c] += (i + 1 - l->x[p]) * l->m[p] * what[p][c];
			nodes[i + 1][c] += (l->x[p] - i) * l->m[p] * what[p][c];
		}
	}
	for (int i = 0; i < NODES; i++)
		for (int c = 0; c < 3; c++) nodes[i][c] = l->mass[i] > 0 ? nodes[i][c] / l->mass[i] : 0;
}

static double from_nodes(const line *l, double (*nodes)[3], int p, int c) {
	const int i = (int)l->x[p];
	return (i + 1 - l->x[p]) * nodes[i][c] + (l->x[p] - i) * nodes[i + 1][c];
}

static void begin_line(const quern_check_host *host, line *l, bool uniform) {
	memset(l, 0, sizeof *l);
	for (int p = 0; p < PARTICLES; p++) {
		l->x[p] = host->uniform(95, (uint64_t)p, 0, NODES - 1.001);
		l->m[p] = host->uniform(96, (uint64_t)p, 0.5, 2);
		for (int c = 0; c < 3; c++)
			l->v[p][c] = uniform ? 1 + c : host->uniform(97, (uint64_t)(p * 4 + c), -1, 1);
		const int i = (int)l->x[p];
		l->mass[i] += (i + 1 - l->x[p]) * l->m[p];
		l->mass[i + 1] += (l->x[p] - i) * l->m[p];
	}
	to_nodes(l, l->v, l->old);
	for (int i = 0; i < NODES; i++)
		for (int c = 0; c < 3; c++) {
			const double kick = uniform ? 0 : host->uniform(98, (uint64_t)(i * 4 + c), -0.5, 0.5);
			l->now[i][c] = l->old[i][c] + kick;
		}
}

/* What a particle may send beside its velocity: the slope along the line of what the nodes say. */
static void give_fit(const quern_check_kernel *k, const line *l) {
	for (int p = 0; p < PARTICLES && quern_check_has(k, FIT); p++)
		for (uint32_t a = 0; a < k->dim; a++)
			quern_check_given(k, FIT, k->dim * a)[p] = l->now[(int)l->x[p] + 1][a] - l->now[(int)l->x[p]][a];
}
static void take_affine(const quern_check_kernel *k, line *l) {
	for (int p = 0; p < PARTICLES && quern_check_has(k, AFFINE); p++)
		for (uint32_t a = 0; a < k->dim; a++) l->slope[p][a] = quern_check_found(k, AFFINE, k->dim * a)[p];
}

/* All passes; new velocities in l->v. */
static void gather(const quern_check *c, const quern_check_instance *it, line *l) {
	const uint32_t trips = trips_of(c, it);
	double(*nodes)[3] = c->host->memory(NODES, sizeof *nodes);
	for (uint32_t pass = 0; pass <= trips; pass++) {
		quern_check_kernel *k = create(c, it, pass, PARTICLES);
		for (uint32_t a = 0; a < k->dim; a++)
			for (int p = 0; p < PARTICLES; p++) {
				const double pic = from_nodes(l, l->now, p, (int)a);
				quern_check_given(k, PIC, a)[p] = pic;
				quern_check_given(k, CHANGE, a)[p] = pic - from_nodes(l, l->old, p, (int)a);
				quern_check_given(k, VELOCITY, a)[p] = l->v[p][a];
				if (k->at[ECHO] >= 0) quern_check_given(k, ECHO, a)[p] = l->echo[p][a];
			}
		give_fit(k, l);
		c->host->run(k, 64, false);
		take_affine(k, l);
		for (uint32_t a = 0; a < k->dim; a++)
			for (int p = 0; p < PARTICLES; p++) {
				if (pass == trips) l->v[p][a] = quern_check_found(k, VELOCITY, a)[p];
				else l->send[p][a] = quern_check_found(k, SEND, a)[p];
			}
		to_nodes(l, l->send, nodes);
		for (int p = 0; p < PARTICLES; p++)
			for (int a = 0; a < 3; a++) l->echo[p][a] = from_nodes(l, nodes, p, a);
		c->host->kernel_destroy(k);
	}
	free(nodes);
}

static void check_uniform(
	const quern_check *c, const quern_check_instance *it, line *l, quern_check_tally *t) {
	begin_line(c->host, l, true);
	gather(c, it, l);
	for (int p = 0; p < PARTICLES; p++)
		for (uint32_t a = 0; a < it->dim; a++)
			c->host->measure(t, fabs(l->v[p][a] - 1 - a), 1e-13,
				"%u-D: a uniform velocity of %u m/s becomes %.15g", it->dim, a + 1, l->v[p][a]);
}

static void check_momentum(
	const quern_check *c, const quern_check_instance *it, line *l, quern_check_tally *t) {
	begin_line(c->host, l, false);
	gather(c, it, l);
	for (uint32_t a = 0; a < it->dim; a++) {
		double particles = 0, nodes = 0, scale = 0;
		for (int i = 0; i < NODES; i++) nodes += l->mass[i] * l->now[i][a];
		for (int p = 0; p < PARTICLES; p++)
			particles += l->m[p] * l->v[p][a], scale += l->m[p] * fabs(l->v[p][a]);
		c->host->measure(t, fabs(particles - nodes) / scale, 1e-12,
			"%u-D: nodes carry a momentum of %.9g, particles take up %.9g kg m/s", it->dim, nodes, particles);
	}
}

/* Nodes in linear motion: after the transfer, particles send what makes them move on alike. */
static void check_linear(
	const quern_check *c, const quern_check_instance *it, line *l, quern_check_tally *t) {
	begin_line(c->host, l, true);
	for (int i = 0; i < NODES; i++)
		for (int a = 0; a < 3; a++) l->old[i][a] = l->now[i][a] = 1 + a + 0.1 * (a - 0.5) * i;
	for (int p = 0; p < PARTICLES; p++)
		for (int a = 0; a < 3; a++) l->v[p][a] = 1 + a + 0.1 * (a - 0.5) * l->x[p];
	gather(c, it, l);
	for (int i = 1; i < NODES - 1; i++)
		for (uint32_t a = 0; a < it->dim; a++) {
			double sum = 0;
			for (int p = 0; p < PARTICLES; p++) {
				const double way = i - l->x[p], weight = 1 - fabs(way);
				if (weight > 0) sum += weight * l->m[p] * (l->v[p][a] + l->slope[p][a] * way);
			}
			if (!(l->mass[i] > 0)) continue;
			c->host->measure(t, fabs(sum / l->mass[i] - l->now[i][a]), 1e-12,
				"%u-D: a node of %.9g m/s in a linear field comes back as %.9g", it->dim, l->now[i][a],
				sum / l->mass[i]);
		}
}

static void law(const quern_check *c) {
	quern_check_tally uniform = { .name = "uniform motion" }, momentum = { .name = "momentum" },
					  linear = { .name = "linear motion" };
	const bool matrix = ((const quern_transfer_ops *)c->ops)->affine;
	uint32_t most = 0;
	line *l = c->host->memory(1, sizeof *l);
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (uint64_t setting = 0; setting < c->host->settings(c); setting++) {
			quern_check_instance *it = c->host->instance_create(c, dim, setting);
			if (!it) continue;
			check_uniform(c, it, l, &uniform);
			check_momentum(c, it, l, &momentum);
			if (matrix) check_linear(c, it, l, &linear);
			most = trips_of(c, it) > most ? trips_of(c, it) : most;
			c->host->instance_destroy(it);
		}
	free(l);
	c->host->tell(c, &uniform, NULL);
	c->host->tell(c, &momentum, "after %u extra round trips", most);
	if (matrix) c->host->tell(c, &linear, NULL);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = {
	.size = sizeof ops, .kind = &quern_transfer_kind, .make = make, .law = law
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.transfer",
	.brief = "From grid to particles and back: uniform and linear motion stay, momentum is kept.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
