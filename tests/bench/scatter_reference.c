/* SPDX-License-Identifier: MIT */
/* scatter_reference - what Quern's continuum is timed against: the same step written the plain way. Points are structs,
 * sorted by cell; the grid is dense, one array per quantity; each point adds to its 9 or 27 nodes one by one.
 *
 *   scatter_reference DIM NX NY HEIGHT CELL DT BULK FRICTION VELOCITY WARM STEPS THREADS   (NX, NY, HEIGHT in cells)
 *   scatter_reference check
 *
 * A block of density 1500 with 2 points per cell and axis and the pressure of its weight slides with VELOCITY on a floor
 * that holds it. The other axes are periodic. Elastic in rates (Jaumann), with the yield stress FRICTION times pressure and no tension; FLIP with the
 * PIC share exp(-t sqrt(g/height)); uGIMP, folded at the floor. Prints one line of JSON. */
#include <math.h>
#include <omp.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double density = 1500, gravity = 9.81, poisson = 0.3, half_width = 0.25;
enum { POINTS = 2, SORT_EVERY = 100, MOST_THREADS = 64, LANES = 7 };

typedef struct point {
	double x[3], v[3], stress[6], mass, volume; /* stress: xx yy zz xy yz xz; in 2-D y is up and z not used */
} point;

typedef struct world {
	int dim, up, cells[3], threads;
	double cell, dt, bulk, shear, friction, keep;
	size_t n, nodes, stride[3];
	point *points, *sorted;
	uint32_t *key, *first;
	double
		*sent[MOST_THREADS][LANES]; /* mass, momentum, force: of each thread; the first one's are the sums */
	double *velocity[3], *change[3];
} world;

/* Of one point along each axis: nodes, as offsets into the grid, values and slopes. */
typedef struct stencil {
	size_t node[3][3];
	double value[3][3], slope[3][3];
} stencil;

#define INLINE static inline __attribute__((always_inline))

/* `dim` is a constant wherever speed matters. */
INLINE void make_stencil(const world *w, const point *p, stencil *s, const int dim) {
	const double l = half_width, inverse = 1 / w->cell;
	for (int a = 0; a < dim; a++) {
		const double t = p->x[a] * inverse, base = floor(t - l), f = t - base;
		const double near = 1 + l - f, far = f > 1 - l ? f - (1 - l) : 0;
		double *value = s->value[a], *slope = s->slope[a];
		int first = (int)base;
		value[0] = f < 1 - l ? 1 - f : near * near / (4 * l);
		slope[0] = f < 1 - l ? -1 : -near / (2 * l);
		value[2] = far * far / (4 * l);
		slope[2] = far / (2 * l);
		if (a == w->up && t < l) {
			first = 0;
			value[0] = 1 - t, value[2] = 0;
			slope[0] = -1, slope[2] = 0;
		}
		value[1] = 1 - value[0] - value[2];
		slope[1] = -(slope[0] + slope[2]);
		for (int i = 0; i < 3; i++) {
			int node = first + i;
			if (a != w->up) node += node < 0 ? w->cells[a] : node >= w->cells[a] ? -w->cells[a] : 0;
			s->node[a][i] = (size_t)node * w->stride[a];
			slope[i] *= inverse;
		}
	}
}

INLINE void scatter(const world *w, size_t begin, size_t end, double *const *sent, const int dim) {
	double *restrict mass = sent[0];
	for (size_t q = begin; q < end; q++) {
		const point *p = &w->points[q];
		const double *t = p->stress, volume = p->volume;
		stencil s;
		make_stencil(w, p, &s, dim);
		for (int k = 0; k < (dim == 3 ? 3 : 1); k++)
			for (int j = 0; j < 3; j++)
				for (int i = 0; i < 3; i++) {
					const double wz = dim == 3 ? s.value[2][k] : 1, wx = s.value[0][i], wy = s.value[1][j];
					const double m = wx * wy * wz * p->mass;
					const double gx = -volume * s.slope[0][i] * wy * wz,
								 gy = -volume * wx * s.slope[1][j] * wz;
					const size_t node = s.node[0][i] + s.node[1][j] + (dim == 3 ? s.node[2][k] : 0);
					mass[node] += m;
					for (int a = 0; a < dim; a++) sent[1 + a][node] += m * p->v[a];
					if (dim == 2) {
						sent[4][node] += t[0] * gx + t[3] * gy;
						sent[5][node] += t[3] * gx + t[1] * gy;
					} else {
						const double gz = -volume * wx * wy * s.slope[2][k];
						sent[4][node] += t[0] * gx + t[3] * gy + t[5] * gz;
						sent[5][node] += t[3] * gx + t[1] * gy + t[4] * gz;
						sent[6][node] += t[5] * gx + t[4] * gy + t[2] * gz;
					}
				}
	}
}

/* Sums what other threads sent to nodes [begin, end), and moves them; the floor holds its own. */
INLINE void move_nodes(const world *w, size_t begin, size_t end, const int dim) {
	const double least = 1e-6 * density * pow(w->cell, dim);
	for (int thread = 1; thread < w->threads; thread++)
		for (int lane = 0; lane < LANES; lane++) {
			if (lane == 3 && dim == 2) continue;
			if (lane == 6 && dim == 2) continue;
			double *restrict to = w->sent[0][lane];
			const double *restrict from = w->sent[thread][lane];
			for (size_t i = begin; i < end; i++) to[i] += from[i];
		}
	const double *restrict mass = w->sent[0][0];
	for (int a = 0; a < dim; a++) {
		const double *restrict momentum = w->sent[0][1 + a], *restrict force = w->sent[0][4 + a];
		double *restrict velocity = w->velocity[a], *restrict change = w->change[a];
		const double pull = a == w->up ? -gravity : 0;
		for (size_t i = begin; i < end; i++) {
			const bool there = mass[i] > least;
			const double one_over = there ? 1 / mass[i] : 0, before = momentum[i] * one_over;
			const bool floor_node = i < w->stride[w->up];
			change[i] = !there ? 0 : floor_node ? -before : w->dt * (force[i] * one_over + pull);
			velocity[i] = before + change[i];
		}
	}
}

/* J = w s - s w with the spin w = (L - L^T)/2, then the elastic trial, then the return to the yield stress. */
INLINE void update_stress(const world *w, double *t, double l[3][3], const int dim) {
	const double dt = w->dt, two_g = 2 * w->shear, lambda = w->bulk - two_g / dim;
	const double volume = lambda * (dim == 3 ? l[0][0] + l[1][1] + l[2][2] : l[0][0] + l[1][1]);
	const double wxy = 0.5 * (l[0][1] - l[1][0]), dxy = 0.5 * (l[0][1] + l[1][0]);
	const double xx = t[0], yy = t[1], zz = t[2], xy = t[3], yz = t[4], xz = t[5];
	if (dim == 2) {
		t[0] += dt * (2 * wxy * xy + two_g * l[0][0] + volume);
		t[1] += dt * (-2 * wxy * xy + two_g * l[1][1] + volume);
		t[3] += dt * (wxy * (yy - xx) + two_g * dxy);
	} else {
		const double wyz = 0.5 * (l[1][2] - l[2][1]), dyz = 0.5 * (l[1][2] + l[2][1]);
		const double wxz = 0.5 * (l[0][2] - l[2][0]), dxz = 0.5 * (l[0][2] + l[2][0]);
		t[0] += dt * (2 * (wxy * xy + wxz * xz) + two_g * l[0][0] + volume);
		t[1] += dt * (2 * (wyz * yz - wxy * xy) + two_g * l[1][1] + volume);
		t[2] += dt * (-2 * (wxz * xz + wyz * yz) + two_g * l[2][2] + volume);
		t[3] += dt * (wxy * (yy - xx) + wxz * yz + wyz * xz + two_g * dxy);
		t[4] += dt * (wyz * (zz - yy) - wxy * xz - wxz * xy + two_g * dyz);
		t[5] += dt * (wxz * (zz - xx) + wxy * yz - wyz * xy + two_g * dxz);
	}
	const double p = -(dim == 3 ? t[0] + t[1] + t[2] : t[0] + t[1]) / dim;
	const double sx = t[0] + p, sy = t[1] + p, sz = dim == 3 ? t[2] + p : 0;
	double square = 0.5 * (sx * sx + sy * sy) + t[3] * t[3];
	if (dim == 3) square += 0.5 * sz * sz + t[4] * t[4] + t[5] * t[5];
	const double tau = sqrt(square), yield = w->friction * p;
	if (p > 0 && tau <= yield) return;
	const double share = p > 0 ? yield / tau : 0, mean = p > 0 ? -p : 0;
	t[0] = share * sx + mean, t[1] = share * sy + mean, t[3] *= share;
	if (dim == 3) t[2] = share * sz + mean, t[4] *= share, t[5] *= share;
}

INLINE void gather(const world *w, size_t begin, size_t end, const int dim) {
	for (size_t q = begin; q < end; q++) {
		point *p = &w->points[q];
		double pic[3] = { 0 }, change[3] = { 0 }, l[3][3] = { 0 };
		stencil s;
		make_stencil(w, p, &s, dim);
		for (int k = 0; k < (dim == 3 ? 3 : 1); k++)
			for (int j = 0; j < 3; j++)
				for (int i = 0; i < 3; i++) {
					const double wz = dim == 3 ? s.value[2][k] : 1, wx = s.value[0][i], wy = s.value[1][j];
					const double weight = wx * wy * wz;
					const double slope[3] = { s.slope[0][i] * wy * wz, wx * s.slope[1][j] * wz,
						dim == 3 ? wx * wy * s.slope[2][k] : 0 };
					const size_t node = s.node[0][i] + s.node[1][j] + (dim == 3 ? s.node[2][k] : 0);
					for (int a = 0; a < dim; a++) {
						const double v = w->velocity[a][node];
						pic[a] += weight * v;
						change[a] += weight * w->change[a][node];
						for (int b = 0; b < dim; b++) l[a][b] += slope[b] * v;
					}
				}
		double trace = 0;
		for (int a = 0; a < dim; a++) {
			const double length = w->cells[a] * w->cell;
			trace += l[a][a];
			p->x[a] += w->dt * pic[a];
			if (a != w->up) p->x[a] += p->x[a] < 0 ? length : p->x[a] >= length ? -length : 0;
			p->v[a] = w->keep * (p->v[a] + change[a]) + (1 - w->keep) * pic[a];
		}
		p->volume *= 1 + w->dt * trace;
		update_stress(w, p->stress, l, dim);
	}
}

/* ---- a step ---- */

static void sort(world *w) {
	memset(w->first, 0, (w->nodes + 1) * sizeof *w->first);
	for (size_t q = 0; q < w->n; q++) {
		size_t key = 0;
		for (int a = 0; a < w->dim; a++) key += (size_t)(w->points[q].x[a] / w->cell) * w->stride[a];
		w->key[q] = (uint32_t)key;
		w->first[key + 1]++;
	}
	for (size_t i = 0; i < w->nodes; i++) w->first[i + 1] += w->first[i];
	for (size_t q = 0; q < w->n; q++) w->sorted[w->first[w->key[q]]++] = w->points[q];
	point *sorted = w->sorted;
	w->sorted = w->points;
	w->points = sorted;
}

INLINE void step(world *w, const int dim) {
#pragma omp parallel num_threads(w->threads)
	{
		const size_t t = (size_t)omp_get_thread_num(), all = (size_t)w->threads;
		const size_t begin = w->n * t / all, end = w->n * (t + 1) / all;
		for (int lane = 0; lane < LANES; lane++) memset(w->sent[t][lane], 0, w->nodes * sizeof(double));
		scatter(w, begin, end, w->sent[t], dim);
#pragma omp barrier
		move_nodes(w, w->nodes * t / all, w->nodes * (t + 1) / all, dim);
#pragma omp barrier
		gather(w, begin, end, dim);
	}
}

static void run(world *w, long steps) {
	for (long i = 0; i < steps; i++) {
		if (i % SORT_EVERY == 0) sort(w);
		if (w->dim == 2) step(w, 2);
		else step(w, 3);
	}
}

/* ---- the block ---- */

static void *take(size_t n, size_t size) {
	void *memory = calloc(n, size);
	if (memory) return memory;
	fprintf(stderr, "scatter_reference: out of memory\n");
	exit(1);
}

static void place(world *w, int height, double velocity) {
	const double spacing = w->cell / POINTS;
	const int across = w->dim == 3 ? POINTS * w->cells[1] : 1;
	const int volume_up = POINTS * height;
	for (int k = 0; k < volume_up; k++)
		for (int j = 0; j < across; j++)
			for (int i = 0; i < POINTS * w->cells[0]; i++) {
				point *p = &w->points[w->n++];
				const double pressure = density * gravity * (volume_up - k - 0.5) * spacing;
				*p = (point) { .x = { (i + 0.5) * spacing, (j + 0.5) * spacing }, .v = { velocity } };
				p->x[w->up] = (k + 0.5) * spacing;
				for (int a = 0; a < w->dim; a++) p->stress[a] = -pressure;
				p->volume = pow(spacing, w->dim);
				p->mass = density * p->volume;
			}
}

static world make(int dim, const int cells[2], int height, double cell, double dt, double bulk,
	double friction, int threads) {
	world w = { .dim = dim,
		.up = dim - 1,
		.threads = threads,
		.cell = cell,
		.dt = dt,
		.bulk = bulk,
		.friction = friction,
		.shear =
			dim == 2 ? bulk * (1 - poisson) / (1 + poisson) : 1.5 * bulk * (1 - 2 * poisson) / (1 + poisson),
		.keep = exp(-dt * sqrt(gravity / (height * cell))) };
	w.cells[0] = cells[0];
	w.cells[1] = dim == 3 ? cells[1] : height + height / 2 + 4;
	w.cells[2] = dim == 3 ? height + height / 2 + 4 : 1;
	w.stride[0] = 1;
	w.stride[1] = (size_t)w.cells[0];
	w.stride[2] = (size_t)w.cells[0] * (size_t)w.cells[1];
	w.nodes = w.stride[2] * (size_t)w.cells[2];
	size_t n = (size_t)POINTS * (size_t)height;
	for (int a = 0; a < w.up; a++) n *= (size_t)(POINTS * w.cells[a]);
	w.points = take(n, sizeof(point));
	w.sorted = take(n, sizeof(point));
	w.key = take(n, sizeof *w.key);
	w.first = take(w.nodes + 1, sizeof *w.first);
	for (int t = 0; t < threads; t++)
		for (int lane = 0; lane < LANES; lane++) w.sent[t][lane] = take(w.nodes, sizeof(double));
	for (int a = 0; a < dim; a++) {
		w.velocity[a] = take(w.nodes, sizeof(double));
		w.change[a] = take(w.nodes, sizeof(double));
	}
	return w;
}

static void finish(world *w) {
	free(w->points);
	free(w->sorted);
	free(w->key);
	free(w->first);
	for (int t = 0; t < w->threads; t++)
		for (int lane = 0; lane < LANES; lane++) free(w->sent[t][lane]);
	for (int a = 0; a < w->dim; a++) free(w->velocity[a]), free(w->change[a]);
}

static double mean_velocity(const world *w, int axis) {
	double momentum = 0, mass = 0;
	for (size_t q = 0; q < w->n; q++) {
		momentum += w->points[q].mass * w->points[q].v[axis];
		mass += w->points[q].mass;
	}
	return momentum / mass;
}

/* ---- is it right? ---- */

static int faults;
static void expect(bool good, int dim, const char *what, double found, double wanted) {
	printf("%s  %d-D  %-55s %.6g (%.6g)\n", good ? "ok  " : "FAIL", dim, what, found, wanted);
	faults += !good;
}

/* Mass and momentum arrive at the nodes, and inner forces add up to nothing. */
static void check_scatter(int dim) {
	world w = make(dim, (int[]) { 7, 6 }, 5, 0.1, 1e-4, 1e6, 0.4, 1);
	place(&w, 5, 0);
	double mass = 0, momentum[3] = { 0 }, sum[LANES] = { 0 }, force = 0;
	for (size_t q = 0; q < w.n; q++) {
		point *p = &w.points[q];
		for (int a = 0; a < dim; a++) {
			p->x[a] += 0.04 * sin((double)q + a); /* nothing in order */
			p->v[a] = cos(3 * (double)q + a);
			if (a != w.up) p->x[a] = fmod(p->x[a] + w.cells[a] * w.cell, w.cells[a] * w.cell);
			momentum[a] += p->mass * p->v[a];
		}
		mass += p->mass;
	}
	if (dim == 2) scatter(&w, 0, w.n, w.sent[0], 2);
	else scatter(&w, 0, w.n, w.sent[0], 3);
	for (int lane = 0; lane < LANES; lane++)
		for (size_t i = 0; i < w.nodes; i++) {
			sum[lane] += w.sent[0][lane][i];
			if (lane > 3) force += fabs(w.sent[0][lane][i]);
		}
	expect(fabs(sum[0] - mass) < 1e-12 * mass, dim, "mass of nodes", sum[0], mass);
	for (int a = 0; a < dim; a++) {
		expect(
			fabs(sum[1 + a] - momentum[a]) < 1e-12 * mass, dim, "momentum of nodes", sum[1 + a], momentum[a]);
		expect(fabs(sum[4 + a]) < 1e-12 * force, dim, "inner forces over the sum of their sizes",
			sum[4 + a] / force, 0);
	}
	finish(&w);
}

/* A block that starts with the pressure of its weight stays at rest; thrown, it is slowed by
 * friction times gravity, less the half cell by which the points are higher that hold it. */
static void check_block(int dim, int threads) {
	enum { HEIGHT = 8 };
	const double cell = 0.01, dt = 5e-5, friction = 0.3;
	const double braked = friction * gravity * (HEIGHT - 0.5) / HEIGHT;
	const long steps = threads == 1 ? 400 : 20;
	world w = make(dim, (int[]) { 4, 4 }, HEIGHT, cell, dt, 2e6, friction, threads);
	place(&w, HEIGHT, 0);
	run(&w, steps);
	double pressure = 0, bottom = 0, fastest = 0;
	for (size_t q = 0; q < w.n; q++) {
		const point *p = &w.points[q];
		for (int a = 0; a < dim; a++) fastest = fmax(fastest, fabs(p->v[a]));
		if (p->x[w.up] < cell / POINTS) pressure -= p->stress[w.up], bottom++;
	}
	const double wanted = density * gravity * (HEIGHT - 0.25) * cell;
	expect(fabs(pressure / bottom / wanted - 1) < 0.02, dim, "stress of the lowest points, Pa",
		pressure / bottom, wanted);
	expect(fastest < 1e-3 * sqrt(gravity * HEIGHT * cell), dim, "fastest point at rest, m/s", fastest, 0);
	finish(&w);
	w = make(dim, (int[]) { 4, 4 }, HEIGHT, cell, dt, 2e6, friction, threads);
	place(&w, HEIGHT, 0.5);
	run(&w, steps);
	const double before = mean_velocity(&w, 0);
	run(&w, steps);
	const double slowed = (before - mean_velocity(&w, 0)) / ((double)steps * dt);
	if (threads == 1)
		expect(
			fabs(slowed / braked - 1) < 0.01, dim, "deceleration of a sliding block, m/s^2", slowed, braked);
	finish(&w);
}

int main(int argc, char **argv) {
	if (argc == 2 && !strcmp(argv[1], "check")) {
		for (int dim = 2; dim <= 3; dim++) {
			check_scatter(dim);
			for (int threads = 1; threads <= 2; threads++) check_block(dim, threads);
		}
		return faults != 0;
	}
	const int dim = argc == 13 ? atoi(argv[1]) : 0, threads = argc == 13 ? atoi(argv[12]) : 0;
	if ((dim != 2 && dim != 3) || threads < 1 || threads > MOST_THREADS) {
		fprintf(stderr,
			"usage: scatter_reference check | DIM NX NY HEIGHT CELL DT BULK FRICTION VELOCITY WARM STEPS "
			"THREADS\n");
		return 1;
	}
	world w = make(dim, (int[]) { atoi(argv[2]), atoi(argv[3]) }, atoi(argv[4]), atof(argv[5]), atof(argv[6]),
		atof(argv[7]), atof(argv[8]), threads);
	place(&w, atoi(argv[4]), atof(argv[9]));
	run(&w, atol(argv[10]));
	const long steps = atol(argv[11]);
	const double begin = omp_get_wtime();
	run(&w, steps);
	const double seconds = omp_get_wtime() - begin;
	printf("{\"points\": %zu, \"steps\": %ld, \"ns_per_step\": %.4f, \"velocity\": %.9g}\n", w.n, steps,
		1e9 * seconds / ((double)steps * (double)w.n), mean_velocity(&w, 0));
	finish(&w);
	return 0;
}
