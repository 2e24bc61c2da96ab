/* SPDX-License-Identifier: MIT */
/* material_kit - materials without a scene */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "material_kit.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

law try_law(const char *id, uint32_t dim, const alone_value *values, quern_status *status) {
	const alone a = alone_make(id, dim, values);
	law out = { .plugin = a.plugin, .ops = a.plugin->ops, .self = a.self, .dim = dim };
	out.ops->moduli(out.self, dim, &out.bulk, &out.shear, &out.density);
	*status = a.status;
	return out;
}

law make_law(const char *id, uint32_t dim, const alone_value *values) {
	quern_status status;
	const law out = try_law(id, dim, values, &status);
	assert_int_equal(status, QUERN_OK);
	return out;
}

law usual_law(const char *id, uint32_t dim) {
	const alone_value values[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 }, { "grain_density", 2450 },
		{ "critical_density", 1500 }, { "density", 1500 }, { NULL, 0 } };
	return make_law(id, dim, values);
}

double param(const law *m, const char *name) {
	const alone a = { .plugin = m->plugin, .self = m->self };
	return alone_param(&a, name);
}

void free_law(law *m) { free(m->self); }

const char *const ids[] = { "material.mu_i", "material.drucker_prager", "material.elastic" };

const matrix none = { 0 }, unit = { { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } } };

/* ==== points ==== */

static uint32_t shape_size(uint8_t shape, uint32_t dim) {
	return shape == QUERN_SCALAR ? 1 : dim == 2 ? 3 : 6;
}

cloud make_cloud(const law *m, uint32_t n) {
	cloud c = { .n = n, .cap = (n + QUERN_LANES - 1) / QUERN_LANES * QUERN_LANES };
	const uint32_t n_gradient = m->dim * m->dim, n_stress = m->dim == 2 ? 3 : 6;
	const size_t bytes = (COLUMNS + 6 * FIELDS) * c.cap * sizeof(quern_real);
	c.memory = aligned_alloc(64, bytes);
	assert_non_null(c.memory);
	memset(c.memory, 0, bytes);
	quern_real *next = c.memory;
	for (uint32_t k = 0; k < n_gradient; k++, next += c.cap) c.gradient[k] = next;
	for (uint32_t k = 0; k < n_stress; k++, next += c.cap) c.stress[k] = next;
	c.grid_density = next, next += c.cap;
	c.density = next, next += c.cap;
	c.wave_speed = next, next += c.cap;
	c.energy = next, next += c.cap;
	for (uint32_t r = 0; m->plugin->uses[r].field; r++) {
		const quern_use *use = &m->plugin->uses[r];
		uint32_t f = 0;
		while (f < c.n_fields && strcmp(c.field[f], use->field) != 0) f++;
		if (f == c.n_fields) {
			c.field[c.n_fields++] = use->field;
			for (uint32_t k = 0; k < shape_size(use->shape, m->dim); k++, next += c.cap)
				c.history[f].real[k] = next;
		}
		c.use[r] = c.history[f];
	}
	c.n_columns = (uint32_t)((size_t)(next - c.memory) / c.cap);
	return c;
}

void free_cloud(cloud *c) { free(c->memory); }

quern_column *history(cloud *c, const char *field) {
	for (uint32_t f = 0; f < c->n_fields; f++)
		if (!strcmp(c->field[f], field)) return &c->history[f];
	fail_msg("no field %s", field);
	return NULL;
}

/* Calls the material on points [first, first + n), which begin at a multiple of the lanes. */
void call(const law *m, cloud *c, int hook, double dt, uint32_t first, uint32_t n) {
	quern_material_batch b = { .n = n, .cap = c->cap - first, .dt = dt };
	quern_column use[2 * FIELDS] = { 0 };
	const bool update = hook == QUERN_MATERIAL_UPDATE;
	for (uint32_t k = 0; k < 9 && update; k++) b.gradient[k] = c->gradient[k] ? c->gradient[k] + first : NULL;
	for (uint32_t k = 0; k < 6; k++) b.stress[k] = c->stress[k] ? c->stress[k] + first : NULL;
	b.grid_density = update ? c->grid_density + first : NULL;
	b.density = c->density + first;
	b.mean_pressure = update && c->mean_pressure ? c->mean_pressure + first : NULL;
	b.wave_speed = c->wave_speed ? c->wave_speed + first : NULL;
	b.energy = c->energy ? c->energy + first : NULL;
	for (uint32_t r = 0; m->plugin->uses[r].field; r++)
		for (uint32_t k = 0; k < 9 && m->plugin->uses[r].hook == hook; k++)
			if (c->use[r].real[k]) use[r].real[k] = c->use[r].real[k] + first;
	b.use = use;
	(update ? m->ops->update : m->ops->assign)[m->dim - 2](m->self, &b);
}

void update(const law *m, cloud *c, double dt) { call(m, c, QUERN_MATERIAL_UPDATE, dt, 0, c->n); }
void assign(const law *m, cloud *c) { call(m, c, QUERN_MATERIAL_ASSIGN, 0, 0, c->n); }

/* ==== tensors in long double ==== */

matrix times(matrix a, matrix b) {
	matrix c = { 0 };
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			for (int k = 0; k < 3; k++) c.x[i][j] += a.x[i][k] * b.x[k][j];
	return c;
}
matrix transposed(matrix a) {
	matrix c;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++) c.x[i][j] = a.x[j][i];
	return c;
}
/* a + f b, on the first `dim` axes */
matrix plus(uint32_t dim, matrix a, wide f, matrix b) {
	matrix c = { 0 };
	for (uint32_t i = 0; i < dim; i++)
		for (uint32_t j = 0; j < dim; j++) c.x[i][j] = a.x[i][j] + f * b.x[i][j];
	return c;
}

matrix scaled(uint32_t dim, wide f, matrix a) { return plus(dim, none, f, a); }
wide trace(uint32_t dim, matrix a) { return a.x[0][0] + a.x[1][1] + (dim == 3 ? a.x[2][2] : 0); }
matrix deviator(uint32_t dim, matrix a) { return plus(dim, a, -trace(dim, a) / dim, unit); }
wide product(matrix a, matrix b) {
	wide sum = 0;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++) sum += a.x[i][j] * b.x[i][j];
	return sum;
}
wide norm(matrix a) { return sqrtl(product(a, a)); }
wide shear_of(uint32_t dim, matrix a) { return norm(deviator(dim, a)) / sqrtl(2); }
wide minor2(matrix a) { return a.x[0][0] * a.x[1][1] - a.x[0][1] * a.x[1][0]; }
wide determinant(uint32_t dim, matrix a) {
	if (dim == 2) return minor2(a);
	return a.x[2][2] * minor2(a) - a.x[2][1] * (a.x[0][0] * a.x[1][2] - a.x[0][2] * a.x[1][0]) +
		   a.x[2][0] * (a.x[0][1] * a.x[1][2] - a.x[0][2] * a.x[1][1]);
}
/* Sylvester's criterion */
bool positive(uint32_t dim, matrix a) {
	return a.x[0][0] > 0 && minor2(a) > 0 && (dim == 2 || determinant(3, a) > 0);
}
matrix inverse(uint32_t dim, matrix a) {
	matrix c = { 0 };
	const wide det = determinant(dim, a);
	if (dim == 2)
		return (matrix) { { { a.x[1][1] / det, -a.x[0][1] / det, 0 },
			{ -a.x[1][0] / det, a.x[0][0] / det, 0 } } };
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++) {
			const int p = (j + 1) % 3, q = (j + 2) % 3, r = (i + 1) % 3, s = (i + 2) % 3;
			c.x[i][j] = (a.x[p][r] * a.x[q][s] - a.x[p][s] * a.x[q][r]) / det;
		}
	return c;
}
/* t - 1, for the largest t of det(a + t I) = 1 with a symmetric deviator: Newton's method from far above */
wide isochoric(uint32_t dim, matrix a) {
	const wide q = product(a, a) / 2, det = determinant(dim, a);
	wide y = 2 * norm(a);
	for (int k = 0; k < 200; k++)
		y -= dim == 2 ? (y * (2 + y) - q) / (2 * (1 + y))
					  : (y * (3 + y * (3 + y)) - q * (1 + y) + det) / (3 * (1 + y) * (1 + y) - q);
	return y;
}
/* (J^2 - 1)/2 - ln J at J = 1 + e */
wide volume_energy(wide e) {
	if (fabsl(e) > 0.1L) return e + e * e / 2 - log1pl(e);
	wide sum = 0;
	for (int k = 60; k >= 3; k--) sum = e * sum + (k % 2 ? -1 : 1) / (wide)k;
	return e * e * (1 + e * sum);
}

static const int row6[] = { 0, 1, 2, 0, 1, 0 }, column6[] = { 0, 1, 2, 1, 2, 2 };
static const int row3[] = { 0, 1, 0 }, column3[] = { 0, 1, 1 };

matrix get(uint32_t dim, quern_real *const *columns, uint32_t i) {
	matrix a = { 0 };
	for (int k = 0; k < (dim == 2 ? 3 : 6); k++) {
		const int r = dim == 2 ? row3[k] : row6[k], q = dim == 2 ? column3[k] : column6[k];
		a.x[r][q] = a.x[q][r] = columns[k][i];
	}
	return a;
}
void put(uint32_t dim, quern_real *const *columns, uint32_t i, matrix a) {
	for (int k = 0; k < (dim == 2 ? 3 : 6); k++)
		columns[k][i] = (quern_real)(dim == 2 ? a.x[row3[k]][column3[k]] : a.x[row6[k]][column6[k]]);
}
matrix get_gradient(uint32_t dim, const cloud *c, uint32_t i) {
	matrix a = { 0 };
	for (uint32_t r = 0; r < dim; r++)
		for (uint32_t q = 0; q < dim; q++) a.x[r][q] = c->gradient[r * dim + q][i];
	return a;
}
void put_gradient(uint32_t dim, const cloud *c, uint32_t i, matrix a) {
	for (uint32_t r = 0; r < dim; r++)
		for (uint32_t q = 0; q < dim; q++) c->gradient[r * dim + q][i] = (quern_real)a.x[r][q];
}

/* ==== random points, the same everywhere: no libm ==== */

uint64_t state;

double uniform(void) {
	state ^= state << 13, state ^= state >> 7, state ^= state << 17;
	return (double)(state >> 11) * 0x1p-53;
}
double between(double a, double b) { return a + (b - a) * uniform(); }
/* spread evenly over the powers of two from 2^low to 2^high */
double sized(int low, int high) {
	double x = between(1, 2);
	for (int k = low + (int)(uniform() * (high - low)); k; k += k > 0 ? -1 : 1) x *= k > 0 ? 2 : 0.5;
	return x;
}
matrix random_matrix(uint32_t dim, double size) {
	matrix a = { 0 };
	for (uint32_t i = 0; i < dim; i++)
		for (uint32_t j = 0; j < dim; j++) a.x[i][j] = between(-size, size);
	return a;
}
/* a symmetric deviator with sqrt(s:s/2) = size */
matrix random_deviator(uint32_t dim, double size) {
	const matrix a = random_matrix(dim, 1), s = deviator(dim, plus(dim, a, 1, transposed(a)));
	return scaled(dim, size / shear_of(dim, s), s);
}
matrix random_rotation(uint32_t dim) {
	const matrix a = random_matrix(dim, 1), w = plus(dim, a, -1, transposed(a));
	return times(inverse(dim, plus(dim, unit, -1, w)), plus(dim, unit, 1, w));
}

/* Any state the material may be in, and a step of any size up to a strain of `largest`; dt = 1e-4. */
void randomise(int which, const law *m, cloud *c, double most) {
	for (uint32_t i = 0; i < c->n; i++) {
		const double p = m->bulk * sized(-30, -4);
		const double mu = which == MU_I      ? param(m, "limit_friction")
						  : which == ELASTIC ? 3
											 : param(m, "friction");
		matrix stress = plus(
			m->dim, random_deviator(m->dim, mu * p * uniform()), which == ELASTIC && i % 2 ? p : -p, unit);
		put(m->dim, c->stress, i, stress);
		put_gradient(m->dim, c, i, random_matrix(m->dim, 1e4 * most * sized(-24, 0)));
		c->grid_density[i] = m->density * between(0.8, 1.1);
	}
	assign(m, c);
	for (uint32_t i = 0; i < c->n; i++)
		if (i % 4 == 0) c->density[i] = m->density * between(0.9, 1.1);
}

wide largest(wide a, wide b) { return a > b || a != a ? a : b; }
