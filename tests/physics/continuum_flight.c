/* SPDX-License-Identifier: MIT */
/* Free flight, in which nothing may happen that no force causes: transfers keep momentum, uniform motion stays as it is to
 * round-off, a body that turns as a whole feels no stress, and what a transfer takes from a turning body is what it
 * promises. */
#include <quern/grid.h>
#include <quern/shape.h>
#include <quern/transfer.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include "plugin_alone.h"
#include "table.h"
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979312;

static uint64_t state = 88172645463325252u;
static double uniform(void) {
	state ^= state << 13, state ^= state >> 7, state ^= state << 17;
	return (double)(state >> 11) * 0x1p-53;
}

/* ==== a transfer alone, on a grid of its own ==== */

enum { N = 512, EDGE = 8, NODES = EDGE * EDGE * EDGE };

typedef struct field {
	double x[3][NODES];
} field;

typedef struct swarm {
	uint32_t dim;
	double mass[N], weight[N][27], position[3][N], normal[3][N];
	int32_t node[N][27];
	double pic[3][N], change[3][N], echo[3][N], sent[3][N], velocity[3][N];
	double fit[9][N], shift[3][N], affine[9][N];
	double node_mass[NODES];
} swarm;

/* Points anywhere in a box, weights of the shape that is the solver's default. */
static void make_swarm(swarm *s, uint32_t dim) {
	static const alone_value none[] = { { NULL, 0 } };
	const alone shape = alone_make("shape.gimp", dim, none);
	double value[3][3][N], slope[3][3][N];
	int32_t first[3][N];
	quern_shape_batch b = { .n = N, .cap = N, .dim = dim, .inverse_cell = 1 };
	memset(s, 0, sizeof *s);
	s->dim = dim;
	for (uint32_t a = 0; a < dim; a++) {
		for (uint32_t i = 0; i < N; i++) s->position[a][i] = 1.5 + (EDGE - 4) * uniform();
		b.position[a] = s->position[a], b.first[a] = first[a];
		b.wall[a][0] = INT32_MIN, b.wall[a][1] = INT32_MAX;
		for (int k = 0; k < 3; k++) b.value[a][k] = value[a][k], b.slope[a][k] = slope[a][k];
	}
	((const quern_shape_ops *)shape.plugin->ops)->weights(shape.self, &b);
	for (uint32_t i = 0; i < N; i++) {
		double length = 0;
		s->mass[i] = 0.5 + uniform();
		for (uint32_t a = 0; a < dim; a++) {
			s->velocity[a][i] = 2 * uniform() - 1;
			s->normal[a][i] = 2 * uniform() - 1;
			length += s->normal[a][i] * s->normal[a][i];
		}
		for (uint32_t a = 0; a < dim; a++) s->normal[a][i] *= i % 5 ? 1 / sqrt(length) : 0;
		for (int k = 0; k < (dim == 3 ? 27 : 9); k++) {
			const int at[3] = { k % 3, k / 3 % 3, k / 9 };
			s->weight[i][k] = 1;
			for (uint32_t a = dim; a-- > 0;) {
				s->weight[i][k] *= value[a][at[a]][i];
				s->node[i][k] = s->node[i][k] * EDGE + first[a][i] + at[a];
			}
			s->node_mass[s->node[i][k]] += s->mass[i] * s->weight[i][k];
		}
	}
	free(shape.self);
}

/* To the nodes with mass, divided by theirs. */
static void scatter(const swarm *s, double (*from)[N], field *to) {
	memset(to, 0, sizeof *to);
	for (uint32_t a = 0; a < s->dim; a++) {
		for (uint32_t i = 0; i < N; i++)
			for (int k = 0; k < (s->dim == 3 ? 27 : 9); k++)
				to->x[a][s->node[i][k]] += s->mass[i] * s->weight[i][k] * from[a][i];
		for (int k = 0; k < NODES; k++) to->x[a][k] *= s->node_mass[k] > 0 ? 1 / s->node_mass[k] : 0;
	}
}

static void gather(const swarm *s, const field *from, double (*to)[N]) {
	for (uint32_t a = 0; a < s->dim; a++)
		for (uint32_t i = 0; i < N; i++) {
			to[a][i] = 0;
			for (int k = 0; k < (s->dim == 3 ? 27 : 9); k++)
				to[a][i] += s->weight[i][k] * from->x[a][s->node[i][k]];
		}
}

/* As the solver does it: round trips, then the last call. */
static void transfer(swarm *s, const alone *t, double dt) {
	const quern_transfer_ops *ops = t->plugin->ops;
	const uint32_t trips = quern_transfer_trips(ops, t->self);
	quern_column use = { .real = { s->normal[0], s->normal[1], s->normal[2] } };
	for (uint32_t pass = 0; pass <= trips; pass++) {
		quern_transfer_batch b = { .n = N, .cap = N, .pass = pass, .dt = dt, .use = &use };
		for (uint32_t a = 0; a < s->dim; a++) {
			b.pic[a] = s->pic[a], b.change[a] = s->change[a], b.velocity[a] = s->velocity[a];
			b.echo[a] = pass ? s->echo[a] : NULL;
			b.send[a] = pass < trips ? s->sent[a] : NULL;
			b.shift[a] = s->shift[a];
		}
		for (uint32_t k = 0; k < s->dim * s->dim; k++) b.fit[k] = s->fit[k], b.affine[k] = s->affine[k];
		ops->gather[s->dim - 2](t->self, &b);
		if (pass == trips) break;
		field back;
		scatter(s, s->sent, &back);
		gather(s, &back, s->echo);
	}
}

static double momentum(const swarm *s, uint32_t a) {
	double sum = 0;
	for (uint32_t i = 0; i < N; i++) sum += s->mass[i] * s->velocity[a][i];
	return sum;
}

static const struct {
	const char *name, *id;
	alone_value values[2];
} transfers[] = { { "picflip, rate 0 (FLIP)", "transfer.picflip", { { "rate", 0 } } },
	{ "picflip, rate 30/s", "transfer.picflip", { { "rate", 30 } } },
	{ "picflip, rate 1e300/s (PIC)", "transfer.picflip", { { "rate", 1e300 } } },
	{ "picflip, flip 0.95", "transfer.picflip", { { "flip", 0.95 } } },
	{ "apic", "transfer.apic", { { "moment", 1 } } },
	{ "xpic, order 1", "transfer.xpic", { { "order", 1 } } },
	{ "xpic, order 2", "transfer.xpic", { { "order", 2 } } },
	{ "xpic, order 5", "transfer.xpic", { { "order", 5 } } },
	{ "xpic, order 10", "transfer.xpic", { { "order", 10 } } },
	{ "mixed", "transfer.mixed", { { NULL, 0 } } } };
enum { TRANSFERS = sizeof transfers / sizeof *transfers };

/* A rate of its own, so that the rows without one have it. */
static alone make_transfer(int k, uint32_t dim) {
	const alone_value values[] = { { "rate", 30 }, transfers[k].values[0], { NULL, 0 } };
	return alone_make(transfers[k].id, dim, transfers[k].values[0].name ? values : values + 2);
}

/* Random points, random velocities, random forces: points gain the momentum that the nodes gained, and nothing else. */
static void transfers_keep_momentum(void **unused) {
	(void)unused;
	bool good = true;
	swarm *s = malloc(sizeof *s);
	assert_non_null(s);
	table_head("momentum gained over sum m|v|, less the nodes' gain");
	for (int k = 0; k < TRANSFERS; k++)
		for (uint32_t dim = 2; dim <= 3; dim++) {
			const alone t = make_transfer(k, dim);
			double worst = 0, size = 0, expected[3];
			char what[80];
			field v, change = { 0 };
			make_swarm(s, dim);
			scatter(s, s->velocity, &v);
			for (uint32_t a = 0; a < dim; a++) {
				expected[a] = momentum(s, a);
				for (uint32_t i = 0; i < N; i++) size += s->mass[i] * fabs(s->velocity[a][i]);
				for (int i = 0; i < NODES; i++) {
					change.x[a][i] = uniform() - 0.5;
					v.x[a][i] += change.x[a][i];
					expected[a] += s->node_mass[i] * change.x[a][i];
				}
			}
			gather(s, &v, s->pic);
			gather(s, &change, s->change);
			transfer(s, &t, 0.01);
			for (uint32_t a = 0; a < dim; a++) worst = fmax(worst, fabs(momentum(s, a) - expected[a]) / size);
			snprintf(what, sizeof what, "%s, %uD", transfers[k].name, dim);
			good &= table_row(what, worst, 0, 1e-12);
			free(t.self);
		}
	free(s);
	assert_true(good);
}

/* What a transfer leaves of motion that the grid does not see: all (FLIP), none (PIC), e^(-rate dt); mixed none along the
 * normal and all across it. The points' velocities sum to nothing at every node, so that PIC is zero. */
static void motion_below_the_grid(void **unused) {
	(void)unused;
	bool good = true;
	swarm *s = malloc(sizeof *s);
	assert_non_null(s);
	table_head("unseen motion kept in a step of 0.01 s");
	for (int k = 0; k < TRANSFERS; k++) {
		const alone t = make_transfer(k, 3);
		const double asked[TRANSFERS] = { 1, exp(-0.3), 0, 0.95 };
		double along = 0, was_along = 0, across = 0, was_across = 0;
		make_swarm(s, 3);
		for (uint32_t i = 0; i < N; i++) { /* pairs at one place with opposite velocities */
			double dot = 0;
			for (uint32_t a = 0; a < 3; a++) {
				if (i % 2) s->velocity[a][i] = -s->velocity[a][i - 1], s->normal[a][i] = s->normal[a][i - 1];
				dot += s->velocity[a][i] * s->normal[a][i];
			}
			if (i % 2) memcpy(s->weight[i], s->weight[i - 1], sizeof *s->weight);
			if (i % 2) memcpy(s->node[i], s->node[i - 1], sizeof *s->node);
			s->mass[i] = 1;
			was_along += dot * dot;
			for (uint32_t a = 0; a < 3; a++) was_across += pow(s->velocity[a][i] - dot * s->normal[a][i], 2);
		}
		for (int i = 0; i < NODES; i++) s->node_mass[i] = 0;
		for (uint32_t i = 0; i < N; i++)
			for (int n = 0; n < 27; n++) s->node_mass[s->node[i][n]] += s->weight[i][n];
		transfer(s, &t, 0.01); /* pic and change are zero */
		for (uint32_t i = 0; i < N; i++) {
			double dot = 0;
			for (uint32_t a = 0; a < 3; a++) dot += s->velocity[a][i] * s->normal[a][i];
			along += dot * dot;
			for (uint32_t a = 0; a < 3; a++) across += pow(s->velocity[a][i] - dot * s->normal[a][i], 2);
		}
		good &= table_row(transfers[k].name, sqrt(along / was_along), asked[k], 1e-12);
		good &= table_row(
			"  across the normal", sqrt(across / was_across), k == TRANSFERS - 1 ? 1 : asked[k], 1e-12);
		free(t.self);
	}
	free(s);
	assert_true(good);
}

/* ==== a block in flight, the whole solver ==== */

static quern_run *throw_block(
	int cells, const char *transfer, const char *cut, double g, const char *rasterise) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, %.17g], domain: {lower: [0, 0], upper: [2, 2]},\n"
		"time: {end: 1000}, output: {every: 0.1, fields: [total.faces]},\n"
		"continuum: {cell: %.17g, cut: %s, material: {elastic: {bulk_modulus: 1e5, density: 1000}},\n"
		"  rasterise: %s, transfer: {%s}, fill: [{region: {box: {lower: [0.63, 0.63], upper: [1.43, "
		"1.43]}}}]}}\n",
		g, 0.8 / cells, cut, rasterise, transfer);
}

static quern_run *fly(int cells, const char *transfer, const char *cut, double g) {
	return throw_block(cells, transfer, cut, g, "auto");
}

typedef struct sums {
	double mass, momentum[2], angular, size, faces[2];
} sums;

static sums sum(quern_run *run) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
					   m = harness_field(run, "point.mass"), f = harness_field(run, "total.faces");
	sums s = { .faces = { f.real[0][0], f.real[1][0] } };
	double centre[2] = { 0 };
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		s.mass += m.real[0][i];
		for (int k = 0; k < 2; k++) {
			centre[k] += m.real[0][i] * x.real[k][i];
			s.momentum[k] += m.real[0][i] * v.real[k][i];
		}
		s.size += m.real[0][i] * hypot(v.real[0][i], v.real[1][i]);
		s.angular += m.real[0][i] * (x.real[0][i] * v.real[1][i] - x.real[1][i] * v.real[0][i]);
	}
	s.angular -= (centre[0] * s.momentum[1] - centre[1] * s.momentum[0]) / s.mass;
	return s;
}

static const char *const rates[] = { "picflip: {rate: 0}", "picflip: {rate: 3}", "picflip: {rate: 1e300}" };

/* An elastic block whose points move at random, for 0.5 s: its own stresses change no momentum but that of light nodes,
 * whose limited force is booked; gravity adds m g t. */
static void flight_keeps_momentum(void **unused) {
	(void)unused;
	bool good = true;
	for (int limited = 0; limited <= 1; limited++) {
		table_head(
			limited ? "gain less booked impulse, over sum m|v|" : "gain over sum m|v|, light nodes free");
		for (int k = 0; k < 3; k++)
			for (int falls = 0; falls <= 1; falls++) {
				const double g = falls ? -0.5 : 0;
				char what[80];
				quern_run *run = fly(8, rates[k], limited ? "1e-3" : "1e-12", g);
				const quern_column v = harness_field(run, "point.velocity");
				for (uint32_t i = 0; i < harness_count(run, "point"); i++)
					v.real[0][i] = uniform() - 0.5, v.real[1][i] = uniform() - 0.4;
				const sums before = sum(run);
				harness_until(run, 0.5);
				const sums after = sum(run);
				double worst = 0;
				for (int a = 0; a < 2; a++) {
					const double weight = a ? after.mass * g * quern_run_time(run) : 0;
					worst = fmax(worst, fabs(after.momentum[a] - before.momentum[a] - weight -
											 (limited ? after.faces[a] - before.faces[a] : 0)));
				}
				snprintf(what, sizeof what, "%s%s", rates[k], falls ? ", falling" : "");
				good &= table_row(what, worst / before.size, 0, 1e-12);
				harness_close(run);
			}
	}
	assert_true(good);
}

static void spin(quern_run *run, double rate) {
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		v.real[0][i] = -rate * (x.real[1][i] - 1.03), v.real[1][i] = rate * (x.real[0][i] - 1.03);
}

/* One step of rigid rotation: inside, where the lattice of points is whole around every node that is seen, the grid holds
 * the linear field exactly; so any transfer leaves velocities alone, and no stress arises. */
static void rotation_at_once(void **unused) {
	(void)unused;
	bool good = true;
	table_head("one step of rigid rotation, two cells inside: change");
	for (int k = 0; k < 3; k++) {
		quern_run *run = fly(8, rates[k], "1e-3", 0);
		const uint32_t n = harness_count(run, "point");
		double was[2][1024], at[2][1024], gap = 0, stress = 0;
		assert_true(n <= 1024);
		spin(run, 3);
		quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
		for (int a = 0; a < 2; a++) memcpy(at[a], x.real[a], n * sizeof **at);
		for (int a = 0; a < 2; a++) memcpy(was[a], v.real[a], n * sizeof **was);
		harness_steps(run, 1);
		x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity");
		const quern_column s = harness_field(run, "point.stress");
		const double dt = run->clock.dt;
		for (uint32_t i = 0; i < n; i++) {
			/* the sort may have moved it: its old place is where its new velocity came from */
			const double old[2] = { x.real[0][i] - dt * v.real[0][i], x.real[1][i] - dt * v.real[1][i] };
			if (fabs(old[0] - 1.03) > 0.2 || fabs(old[1] - 1.03) > 0.2) continue;
			uint32_t j = 0;
			while (j < n && hypot(at[0][j] - old[0], at[1][j] - old[1]) > 1e-6) j++;
			assert_true(j < n);
			gap = fmax(gap, hypot(v.real[0][i] - was[0][j], v.real[1][i] - was[1][j]));
			for (int a = 0; a < 3; a++) stress = fmax(stress, fabs(s.real[a][i]) / 1e5);
		}
		good &= table_row(rates[k], gap, 0, 1e-12);
		good &= table_row("  stress over the bulk modulus", stress, 0, 1e-12);
		harness_close(run);
	}
	assert_true(good);
}

/* Over a turn FLIP loses angular momentum at the free faces, less on finer grids; a PIC share takes more, PIC nearly all,
 * and nothing may add any. */
static void rotation_over_a_turn(void **unused) {
	(void)unused;
	bool good = true;
	double kept[3][2];
	table_head("angular momentum kept over a turn of 2.1 s");
	for (int k = 0; k < 3; k++)
		for (int fine = 0; fine <= 1; fine++) {
			char what[80];
			quern_run *run = fly(fine ? 16 : 8, rates[k], "1e-3", 0);
			spin(run, 3);
			const double before = sum(run).angular;
			harness_until(run, 2 * pi / 3);
			kept[k][fine] = sum(run).angular / before;
			snprintf(what, sizeof what, "%s, %d cells across", rates[k], fine ? 16 : 8);
			table_note(what, kept[k][fine]);
			harness_close(run);
		}
	good &= table_row("FLIP, 8 cells", kept[0][0], 1, 0.1);
	good &= table_row("FLIP, 16 cells", kept[0][1], 1, 0.05);
	good &= table_row("PIC, 8 cells", kept[2][0], 0, 0.01);
	for (int fine = 0; fine <= 1; fine++)
		good &= kept[0][fine] > kept[1][fine] && kept[1][fine] > kept[2][fine] && kept[0][fine] < 1 + 1e-9;
	assert_true(good);
}

/* Points that send their gradient put a rigid rotation on the grid exactly at the free faces too: the first step changes
 * no point's velocity and makes no stress. Without the gradient it changes those at the faces. */
static void affine_rotation_at_once(void **unused) {
	static const char *const ways[] = { "plain", "affine" };
	(void)unused;
	bool good = true;
	table_head("one step of rigid rotation, the whole block: change of velocity over speed");
	for (int affine = 0; affine <= 1; affine++)
		for (int k = 0; k < 3; k++) {
			char what[80];
			double worst = 0, stress = 0;
			quern_run *run = throw_block(8, rates[k], "1e-12", 0, ways[affine]);
			spin(run, 3);
			for (uint32_t i = 0; affine && i < harness_count(run, "point"); i++) {
				const quern_column l = harness_field(run, "point.affine");
				l.real[1][i] = -3, l.real[2][i] = 3;
			}
			harness_steps(run, 1);
			const quern_column x = harness_field(run, "point.position"),
							   v = harness_field(run, "point.velocity"),
							   s = harness_field(run, "point.stress");
			const double dt = run->clock.dt;
			for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
				/* from where it came, x = x' + dt w x x', its velocity then was w x x' */
				const double a = x.real[0][i] - 1.03, b = x.real[1][i] - 1.03, t = 3 * dt;
				const double was[2] = { (a + t * b) / (1 + t * t), (b - t * a) / (1 + t * t) };
				worst = fmax(worst, hypot(v.real[0][i] + 3 * was[1], v.real[1][i] - 3 * was[0]));
				for (int c = 0; c < 3; c++) stress = fmax(stress, fabs(s.real[c][i]) / 1e5);
			}
			snprintf(what, sizeof what, "%s, %s", ways[affine], rates[k]);
			if (affine) {
				good &= table_row(what, worst / 1.7, 0, 1e-12);
				good &= table_row("  stress over the bulk modulus", stress, 0, 1e-12);
			} else {
				table_note(what, worst / 1.7);
				good &= stress > 1e-6; /* or the test would not see a thing */
			}
			harness_close(run);
		}
	assert_true(good);
}

/* ==== apic ==== */

/* D = sum S (x_i - x)^2 of gimp with two points per cell and axis, h the cell: by the way to the nearest node. */
static double gimp_moment(double x, double h) {
	const double l = 0.25 * h, way = fabs(x - h * floor(x / h + 0.5));
	return way < l ? h * (l * l + way * way) / (2 * l) - way * way : way * (h - way);
}

/* About the centre of mass, with what the points' matrices carry: sum m (x v_y - y v_x + C_yx D_x - C_xy D_y). */
static double whole_angular(quern_run *run, double h) {
	const quern_column x = harness_field(run, "point.position"), m = harness_field(run, "point.mass"),
					   c = harness_field(run, "point.affine");
	double all = sum(run).angular;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double a = x.real[0][i], b = x.real[1][i];
		all += m.real[0][i] * (c.real[2][i] * gimp_moment(a, h) - c.real[1][i] * gimp_moment(b, h));
	}
	return all;
}

typedef struct {
	double angular, energy,
		stress; /* gained, of what there was; kept of the motion's; pressure's size over K */
} turned;

/* Takes the corners from a block. */
static void cut_disc(quern_run *run) {
	const quern_column x = harness_field(run, "point.position");
	int32_t from[1024];
	uint32_t n = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		if (hypot(x.real[0][i] - 1.03, x.real[1][i] - 1.03) < 0.4) from[n++] = (int32_t)i;
	assert_int_equal(quern_host_table.remap(run, "point", n, from, 0, NULL), QUERN_OK);
	quern_plan_refresh(run->plan);
}

/* A disc of 8 cells across turns for one turn and drifts. */
static turned turn_disc(const char *transfer) {
	const double h = 0.1;
	turned out = { 0 };
	quern_run *run = throw_block(8, transfer, "1e-12", 0, strstr(transfer, "apic") ? "auto" : "affine");
	cut_disc(run);
	*harness_param(run, "solver.mpm", "cut") = 1e-100; /* no force is limited, or it would turn the disc */
	const quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
					   c = harness_field(run, "point.affine"), m = harness_field(run, "point.mass");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		const double a = x.real[0][i] - 1.03, b = x.real[1][i] - 1.03;
		v.real[0][i] = -3 * b + 0.1, v.real[1][i] = 3 * a - 0.05;
		c.real[1][i] = -3, c.real[2][i] = 3;
	}
	const double before = whole_angular(run, h);
	double had = 0, has = 0;
	for (uint32_t i = 0; i < harness_count(run, "point"); i++)
		had += m.real[0][i] * (v.real[0][i] * v.real[0][i] + v.real[1][i] * v.real[1][i]);
	harness_until(run, 2 * pi / 3);
	const quern_column u = harness_field(run, "point.velocity"), s = harness_field(run, "point.stress"),
					   n = harness_field(run, "point.mass");
	for (uint32_t i = 0; i < harness_count(run, "point"); i++) {
		has += n.real[0][i] * (u.real[0][i] * u.real[0][i] + u.real[1][i] * u.real[1][i]);
		out.stress = fmax(out.stress, fabs(s.real[0][i] + s.real[1][i]) / 2e5);
	}
	out.angular = whole_angular(run, h) / before - 1;
	out.energy = has / had;
	harness_close(run);
	return out;
}

/* Where the points' shape functions have a moment everywhere, apic keeps all angular momentum, as nothing else does. */
static void apic_keeps_angular_momentum(void **unused) {
	static const char *const ways[] = { "apic", "apic: {moment: false}", "picflip: {rate: 0}",
		"picflip: {rate: 1e300}" };
	(void)unused;
	bool good = true;
	table_head("a disc turns once: angular momentum gained; kinetic energy kept; pressure over K");
	for (int k = 0; k < 4; k++) {
		const turned t = turn_disc(ways[k]);
		if (k) table_note(ways[k], t.angular);
		else good &= table_row(ways[k], t.angular, 0, 1e-12);
		table_note("  energy", t.energy);
		table_note("  pressure", t.stress);
	}
	assert_true(good);
}

/* Nodes in linear motion are seen as such by every point and set in the same motion by them: rotation, strain and shear, at
 * free faces too. In a step in which nothing moves. */
static void apic_keeps_linear_fields(void **unused) {
	static const double l[2][2] = { { 0.7, -3 }, { 1.1, -0.4 } };
	static const char *const shapes[] = { "gimp", "bspline", "linear" };
	(void)unused;
	bool good = true;
	table_head("a linear field after one step: velocity over |L| h, matrix over |L|");
	for (int k = 0; k < 3; k++) {
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: 2, gravity: [0, 0], domain: {lower: [0, 0], upper: [2, 2]},\n"
			"time: {end: 1e-16, step: 1e-18}, output: {every: 1e-17},\n"
			"continuum: {cell: 0.1, cut: 1e-12, shape: %s, transfer: apic,\n"
			"  material: {elastic: {bulk_modulus: 1e5, density: 1000}},\n"
			"  fill: [{region: {box: {lower: [0.63, 0.63], upper: [1.43, 1.43]}}}]}}\n",
			shapes[k]);
		const uint32_t n = harness_count(run, "point");
		double was[2][1024], velocity = 0, matrix = 0;
		assert_true(n <= 1024);
		quern_column x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
					 c = harness_field(run, "point.affine");
		for (uint32_t i = 0; i < n; i++)
			for (int a = 0; a < 2; a++) {
				v.real[a][i] = l[a][0] * (x.real[0][i] - 1.03) + l[a][1] * (x.real[1][i] - 1.03);
				c.real[2 * a][i] = l[a][0], c.real[2 * a + 1][i] = l[a][1];
			}
		harness_steps(run, 2);
		x = harness_field(run, "point.position"), v = harness_field(run, "point.velocity"),
		c = harness_field(run, "point.affine");
		for (uint32_t i = 0; i < n; i++)
			for (int a = 0; a < 2; a++) {
				was[a][i] = l[a][0] * (x.real[0][i] - 1.03) + l[a][1] * (x.real[1][i] - 1.03);
				velocity = fmax(velocity, fabs(v.real[a][i] - was[a][i]) / 0.3);
				for (int b = 0; b < 2; b++) matrix = fmax(matrix, fabs(c.real[2 * a + b][i] - l[a][b]) / 3);
			}
		good &= table_row(shapes[k], velocity, 0, 1e-12);
		good &= table_row("  matrix", matrix, 0, 1e-12);
		harness_close(run);
	}
	assert_true(good);
}

/* A periodic axis may be longer than its cells by up to a millionth. What lies in that sliver flies on with all others. */
static void sliver_of_a_period(void **unused) {
	bool good = true;
	(void)unused;
	table_head("uniform motion, with points between the last cell and the end of the period");
	for (int dim = 2; dim <= 3; dim++) {
		quern_run *run = harness_open(1,
			"{quern: 1, dimension: %d, gravity: %s, domain: {lower: %s, upper: %s, periodic: %s},\n"
			"time: {end: 1, step: 1e-9}, output: {every: 1},\n"
			"continuum: {cell: 3.333333 mm, material: {elastic: {bulk_modulus: 1e5, density: 1000}},\n"
			"  fill: {region: {box: {lower: %s, upper: %s}}, velocity: %s}}}\n",
			dim, dim == 2 ? "[0, 0]" : "[0, 0, 0]", dim == 2 ? "[0, 0]" : "[0, 0, 0]",
			dim == 2 ? "[0.2, 33.33333 mm]" : "[0.2, 33.33333 mm, 33.33333 mm]",
			dim == 2 ? "[true, false]" : "[true, false, false]",
			dim == 2 ? "[0, 10 mm]" : "[0, 10 mm, 10 mm]", dim == 2 ? "[0.2, 20 mm]" : "[0.2, 20 mm, 20 mm]",
			dim == 2 ? "[0.5, 0.1]" : "[0.5, 0.1, -0.2]");
		const uint32_t n = harness_count(run, "point");
		double off = 0;
		uint32_t moved = 0;
		quern_column x = harness_field(run, "point.position");
		for (uint32_t i = 0; i < n; i++)
			if (x.real[0][i] > 0.2 - 3e-3) x.real[0][i] = 0.2 - 1e-8, moved++;
		harness_steps(run, 4);
		const quern_column v = harness_field(run, "point.velocity");
		for (uint32_t i = 0; i < harness_count(run, "point"); i++)
			for (int k = 0; k < dim; k++)
				off = fmax(off, fabs(v.real[k][i] - (const double[3]) { 0.5, 0.1, -0.2 }[k]));
		int32_t cell[3];
		const bool inside = quern_grid_cell_at(
			quern_host_table.grid(run), (const quern_real[3]) { 0.2 - 1e-8, 15e-3, 15e-3 }, cell);
		assert_true(inside && cell[0] == 59); /* for whoever sorts points by cells */
		printf("  %d-D: %u of %u points\n", dim, moved, n);
		assert_true(moved > 0 && harness_count(run, "point") == n);
		good &= table_row("  worst velocity, off by", off, 0, 1e-12);
		harness_close(run);
	}
	assert_true(good);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(transfers_keep_momentum),
		cmocka_unit_test(motion_below_the_grid), cmocka_unit_test(flight_keeps_momentum),
		cmocka_unit_test(rotation_at_once), cmocka_unit_test(rotation_over_a_turn),
		cmocka_unit_test(affine_rotation_at_once), cmocka_unit_test(apic_keeps_angular_momentum),
		cmocka_unit_test(apic_keeps_linear_fields), cmocka_unit_test(sliver_of_a_period) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
