/* SPDX-License-Identifier: MIT */
/* The shape functions alone. Whatever the place of a point, up to the walls and into the corners, its weights sum to one
 * and reproduce positions, their slopes sum to zero and reproduce a unit gradient: without that neither momentum nor a
 * uniform strain rate survives the way to the grid and back. */
#include <quern/shape.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "plugin_alone.h"
#include "table.h"
#include <level.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { CELLS = 6, BATCH = 1024 };
static const double cell = 0.1;

typedef struct batch {
	double position[3][BATCH], value[3][3][BATCH], slope[3][3][BATCH];
	int32_t first[3][BATCH];
	quern_shape_batch b;
} batch;

static void weigh(const alone *shape, batch *m, uint32_t n, uint32_t dim, bool walls) {
	m->b = (quern_shape_batch) { .n = n, .cap = BATCH, .dim = dim, .inverse_cell = 1 / cell };
	for (uint32_t a = 0; a < dim; a++) {
		m->b.position[a] = m->position[a];
		m->b.wall[a][0] = walls ? 0 : INT32_MIN;
		m->b.wall[a][1] = walls ? CELLS : INT32_MAX;
		m->b.first[a] = m->first[a];
		for (int k = 0; k < 3; k++) m->b.value[a][k] = m->value[a][k], m->b.slope[a][k] = m->slope[a][k];
	}
	((const quern_shape_ops *)shape->plugin->ops)->weights(shape->self, &m->b);
}

static uint64_t state = 88172645463325252u;
static double uniform(void) {
	state ^= state << 13, state ^= state >> 7, state ^= state << 17;
	return (double)(state >> 11) * 0x1p-53;
}

/* Cell faces, the edges where a particle of half-width l leaves a cell, one step of rounding beside both, and anywhere. */
static double place(uint32_t i, double l) {
	const double face = (double)(i / 7 % (CELLS + 1)), edge = i % 2 ? 0 : l;
	double t = i % 7 < 2   ? face + edge
			   : i % 7 < 4 ? face - edge
			   : i % 7 < 5 ? nextafter(face + edge, CELLS)
			   : i % 7 < 6 ? nextafter(face - edge, 0)
						   : CELLS * uniform();
	t = t < 0 ? 0 : t > CELLS ? CELLS : t;
	return fmin(t * cell, CELLS * cell);
}

typedef struct misses {
	double unity, place, still, gradient, negative, outside;
} misses;

/* All sums over the tensor product's nodes, worst over axes. */
static void add_point(const batch *m, uint32_t i, uint32_t dim, bool walls, misses *worst) {
	double unity = 0, at[3] = { 0 }, still[3] = { 0 }, gradient[3][3] = { { 0 } };
	for (int node = 0; node < (dim == 3 ? 27 : 9); node++) {
		const int k[3] = { node % 3, node / 3 % 3, node / 9 };
		double s = 1, way[3] = { 0 };
		for (uint32_t a = 0; a < dim; a++) {
			const int32_t index = m->first[a][i] + k[a];
			s *= m->value[a][k[a]][i];
			way[a] = index - m->position[a][i] / cell;
			if (walls && (index < 0 || index > CELLS)) {
				const double weight = fabs(m->value[a][k[a]][i]), slope = fabs(m->slope[a][k[a]][i]) * cell;
				worst->outside = fmax(worst->outside, fmax(weight, slope));
			}
		}
		unity += s;
		worst->negative = fmin(worst->negative, s);
		for (uint32_t a = 0; a < dim; a++) {
			double g = m->slope[a][k[a]][i] * cell;
			for (uint32_t c = 0; c < dim; c++) g *= c == a ? 1 : m->value[c][k[c]][i];
			at[a] += s * way[a];
			still[a] += g;
			for (uint32_t c = 0; c < dim; c++) gradient[a][c] += g * way[c];
		}
	}
	worst->unity = fmax(worst->unity, fabs(unity - 1));
	for (uint32_t a = 0; a < dim; a++) {
		worst->place = fmax(worst->place, fabs(at[a]));
		worst->still = fmax(worst->still, fabs(still[a]));
		for (uint32_t c = 0; c < dim; c++)
			worst->gradient = fmax(worst->gradient, fabs(gradient[a][c] - (a == c)));
	}
}

/* The published function of the distance to a node, and its slope, in cells. */
static double gimp(double x, double l, double *slope) {
	const double d = fabs(x), sign = x > 0 ? 1 : -1;
	*slope = d < l ? -x / l : d < 1 - l ? -sign : d < 1 + l ? -sign * (1 + l - d) / (2 * l) : 0;
	return d < l       ? 1 - (d * d + l * l) / (2 * l)
		   : d < 1 - l ? 1 - d
		   : d < 1 + l ? (1 + l - d) * (1 + l - d) / (4 * l)
					   : 0;
}

static double bspline(double x, double unused, double *slope) {
	const double d = fabs(x), sign = x > 0 ? 1 : -1;
	(void)unused;
	*slope = d < 0.5 ? -2 * x : d < 1.5 ? -sign * (1.5 - d) : 0;
	return d < 0.5 ? 0.75 - d * d : d < 1.5 ? 0.5 * (1.5 - d) * (1.5 - d) : 0;
}

static const struct {
	const char *id, *name;
	double edge; /* between pieces, beside a node; of gimp the half-width that it is given */
	double (*formula)(double x, double l, double *slope); /* NULL: its slope jumps at nodes */
} shapes[] = { { "shape.gimp", "gimp, l = h/4", 0.25, gimp }, { "shape.gimp", "gimp, l = h/2", 0.5, gimp },
	{ "shape.gimp", "gimp, l = h/6", 1.0 / 6, gimp }, { "shape.gimp", "gimp, l = h/8", 0.125, gimp },
	{ "shape.gimp", "gimp, l = h/10", 0.1, gimp }, { "shape.bspline", "bspline", 0.5, bspline },
	{ "shape.linear", "linear", 0, NULL } };
enum { SHAPES = sizeof shapes / sizeof *shapes };

static alone make_shape(int k) {
	const alone_value width[] = { { "half_width", shapes[k].edge }, { NULL, 0 } };
	return alone_make(shapes[k].id, 3, shapes[k].formula == gimp ? width : width + 1);
}

/* Partition of unity and linear completeness, the same in the middle, at walls and in corners. */
static void completeness(void **unused) {
	(void)unused;
	batch *m = calloc(1, sizeof *m);
	bool good = m != NULL;
	table_head("completeness");
	for (int k = 0; k < SHAPES; k++)
		for (uint32_t dim = 2; dim <= 3; dim++)
			for (int walls = 0; walls <= 1; walls++) {
				const alone shape = make_shape(k);
				misses worst = { 0 };
				char title[80];
				for (uint32_t round = 0; round < 20; round++) {
					for (uint32_t i = 0; i < BATCH; i++)
						for (uint32_t a = 0; a < dim; a++)
							m->position[a][i] = place((uint32_t)(uniform() * 1e6), shapes[k].edge);
					weigh(&shape, m, BATCH, dim, walls);
					for (uint32_t i = 0; i < BATCH; i++) add_point(m, i, dim, walls, &worst);
				}
				snprintf(title, sizeof title, "%s, %uD, %s: sum S - 1", shapes[k].name, dim,
					walls ? "walls" : "periodic");
				good &= table_row(title, worst.unity, 0, 1e-13);
				good &= table_row("  (sum S x_i - x)/h", worst.place, 0, 1e-13);
				good &= table_row("  h sum grad S", worst.still, 0, 1e-13);
				good &= table_row("  sum grad S x_i - 1", worst.gradient, 0, 1e-13);
				good &= table_row("  most negative S", worst.negative, 0, 1e-15);
				if (walls) good &= table_row("  S or h grad S beyond a wall", worst.outside, 0, 1e-13);
				free(shape.self);
			}
	free(m);
	assert_true(good);
}

/* Every weight is the published function with the node outside a wall folded in: S_0 += 2 S_-1, S_1 -= S_-1. */
static void formula(void **unused) {
	(void)unused;
	batch *m = calloc(1, sizeof *m);
	bool good = m != NULL;
	table_head("each against its formula");
	for (int k = 0; k < SHAPES && shapes[k].formula; k++) {
		const alone shape = make_shape(k);
		const double l = shapes[k].edge;
		double value = 0, slope = 0;
		for (uint32_t round = 0; round < 20; round++) {
			for (uint32_t i = 0; i < BATCH; i++)
				for (uint32_t a = 0; a < 2; a++)
					m->position[a][i] = a ? CELLS * cell * uniform() : place(i + BATCH * round, l);
			weigh(&shape, m, BATCH, 2, true);
			for (uint32_t i = 0; i < BATCH; i++)
				for (uint32_t a = 0; a < 2; a++) {
					const double t = m->position[a][i] / cell;
					double w[CELLS + 3] = { 0 }, g[CELLS + 3] = { 0 };
					for (int n = -1; n <= CELLS + 1; n++) w[n + 1] = shapes[k].formula(t - n, l, &g[n + 1]);
					w[1] += 2 * w[0], w[2] -= w[0], w[CELLS + 1] += 2 * w[CELLS + 2],
						w[CELLS] -= w[CELLS + 2];
					g[1] += 2 * g[0], g[2] -= g[0], g[CELLS + 1] += 2 * g[CELLS + 2],
						g[CELLS] -= g[CELLS + 2];
					for (int n = 0; n <= CELLS; n++) {
						const int at = n - m->first[a][i];
						value = fmax(value, fabs(w[n + 1] - (at < 0 || at > 2 ? 0 : m->value[a][at][i])));
						slope =
							fmax(slope, fabs(g[n + 1] - (at < 0 || at > 2 ? 0 : m->slope[a][at][i] * cell)));
					}
				}
		}
		good &= table_row(shapes[k].name, value, 0, 1e-13);
		good &= table_row("  its slope", slope, 0, 1e-13);
		free(shape.self);
	}
	free(m);
	assert_true(good);
}

/* The volumes that the solver divides nodal masses by are the integrals of the functions: else a body at rest would be
 * denser or thinner at a wall. Simpson's rule between the places where the pieces meet is exact. */
static void shares(void **unused) {
	(void)unused;
	enum { PARTS = 60 * CELLS };
	batch *m = calloc(1, sizeof *m);
	bool good = m != NULL;
	for (int k = 0; k < SHAPES; k++) {
		const alone shape = make_shape(k);
		const quern_shape_ops *ops = shape.plugin->ops;
		double integral[CELLS + 1] = { 0 }, wall, next;
		table_head(shapes[k].name);
		for (uint32_t i = 0; i < 2 * PARTS + 1; i++)
			m->position[0][i] = m->position[1][i] = fmin(i * cell / 120, CELLS * cell);
		weigh(&shape, m, 2 * PARTS + 1, 2, true);
		for (uint32_t i = 0; i < 2 * PARTS + 1; i++)
			for (int n = 0; n < 3; n++) {
				const int32_t at = m->first[0][i] + n;
				const double simpson = (i == 0 || i == 2 * PARTS ? 1 : i % 2 ? 4 : 2) / 360.0;
				if (at >= 0 && at <= CELLS) integral[at] += simpson * m->value[0][n][i];
			}
		ops->shares(shape.self, &wall, &next);
		good &= table_row("volume of a wall's node over h", wall, integral[0], 1e-13);
		good &= table_row("of the next one", next, integral[1], 1e-13);
		good &= table_row("of the upper wall's", wall, integral[CELLS], 1e-13);
		good &= table_row("of the one before", next, integral[CELLS - 1], 1e-13);
		good &= table_row("inside", 1, integral[CELLS / 2], 1e-13);
		free(shape.self);
	}
	free(m);
	assert_true(good);
}

static uint64_t hash_more(uint64_t hash, const void *data, size_t n) {
	for (const unsigned char *p = data; n--; p++) hash = (hash ^ *p) * 1099511628211u;
	return hash;
}

/* One number for all that a shape gives on a fixed set of places. */
static uint64_t hash_of(int k, batch *m) {
	const alone shape = make_shape(k);
	uint64_t hash = 14695981039346656037u;
	state = 88172645463325252u;
	for (int walls = 0; walls <= 1; walls++) {
		for (uint32_t i = 0; i < BATCH; i++)
			for (uint32_t a = 0; a < 3; a++)
				m->position[a][i] = place((uint32_t)(uniform() * 1e6), shapes[k].edge);
		weigh(&shape, m, BATCH, 3, walls);
		hash = hash_more(hash, m->value, sizeof m->value);
		hash = hash_more(hash, m->slope, sizeof m->slope);
		hash = hash_more(hash, m->first, sizeof m->first);
	}
	free(shape.self);
	return hash;
}

/* The same bits from the objects in this folder, of all instruction sets that this processor has; how many there are. */
static int same_hash(int k, const char *folder, batch *m, uint64_t *hash) {
	int n = 0;
	for (int level = 1; level <= quern_level_here(); level++) {
		char name[16], path[4096];
		snprintf(name, sizeof name, "v%d", level);
		snprintf(path, sizeof path, level > 1 ? "%s/%s.%s.so" : "%s/%s.so", folder, shapes[k].id, name);
		if (access(path, R_OK)) continue;
		setenv("QUERN_PLUGINS_DIR", folder, 1), setenv("QUERN_PLUGINS_LEVEL", name, 1);
		const uint64_t found = hash_of(k, m);
		if (!*hash) *hash = found;
		if (found != *hash) fail_msg("%s, %s: other bits", path, shapes[k].name);
		n++;
	}
	return n;
}

/* The same bits for every instruction set, and for the objects beside the program of another compiler, if QUERN_OTHER names one. */
static void bits(void **unused) {
	(void)unused;
	const char *other = getenv("QUERN_OTHER"), *slash = other ? strrchr(other, '/') : NULL;
	char folder[4096], beside[4096];
	batch *m = calloc(1, sizeof *m);
	assert_non_null(m);
	snprintf(folder, sizeof folder, "%s", getenv("QUERN_PLUGINS_DIR"));
	if (slash) snprintf(beside, sizeof beside, "%.*s/plugins", (int)(slash - other), other);
	else printf("  QUERN_OTHER names no program of another compiler: not compared\n");
	for (int k = 0; k < SHAPES; k++) {
		uint64_t hash = 0;
		assert_true(same_hash(k, folder, m, &hash) > 0);
		if (slash) assert_true(same_hash(k, beside, m, &hash) > 0);
		printf("  %-20s %016llx\n", shapes[k].name, (unsigned long long)hash);
	}
	free(m);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(completeness), cmocka_unit_test(formula),
		cmocka_unit_test(shares), cmocka_unit_test(bits) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
