/* SPDX-License-Identifier: MIT */
/* quern_check_material - constitutive models: stress and history belong together, yield is obeyed, rotation does not matter */
#include "check.h"
#include <math.h>
#include <quern/material.h>
#include <stdlib.h>
#include <string.h>

enum { GRADIENT, GRID_DENSITY, DENSITY, STRESS, WAVE, ENERGY };
enum { OUTPUTS = 1, ASSIGNS = 2, VARIANTS = 4 };

typedef struct {
	quern_real bulk, shear, density;
} moduli;

static moduli moduli_of(const check_kernel *k) {
	moduli m = { 0 };
	((const quern_material_ops *)k->ops)->moduli(k->instance->self, k->dim, &m.bulk, &m.shear, &m.density);
	return m;
}

static uint32_t stresses(const check_kernel *k) { return k->dim == 2 ? 3 : 6; }

static void call(const check_kernel *k, const check_batch *b) {
	const quern_material_ops *ops = k->ops;
	quern_column use[CHECK_ROWS];
	const bool update = k->hook == QUERN_MATERIAL_UPDATE;
	quern_material_batch batch = { .n = b->n, .cap = b->cap, .dt = update ? k->dt : 0, .use = use };
	CHECK_VECTOR(batch.gradient, k, b, GRADIENT, k->dim * k->dim);
	CHECK_VECTOR(batch.stress, k, b, STRESS, stresses(k));
	batch.grid_density = check_at(k, b, GRID_DENSITY, 0);
	batch.density = check_at(k, b, DENSITY, 0);
	batch.wave_speed = check_at(k, b, WAVE, 0);
	batch.energy = check_at(k, b, ENERGY, 0);
	quern_check_columns(k, b, k->use, use);
	(update ? ops->update : ops->assign)[k->dim - 2](k->instance->self, &batch);
}

static void create(
	const check *c, const check_instance *it, uint32_t hook, bool outputs, uint32_t n, check_kernel *k) {
	const bool update = hook == QUERN_MATERIAL_UPDATE;
	quern_check_kernel_init(k, c, it, update ? "update" : "assign", n);
	k->call = call;
	if (update) {
		quern_check_add(k, GRADIENT, "gradient", CHECK_IN, k->dim * k->dim);
		quern_check_add(k, GRID_DENSITY, "grid_density", CHECK_IN, 1);
	}
	quern_check_add(k, DENSITY, "density", CHECK_CHANGED, 1);
	quern_check_add(k, STRESS, "stress", CHECK_CHANGED, stresses(k));
	if (outputs) {
		quern_check_add(k, WAVE, "wave_speed", CHECK_OUT, 1);
		quern_check_add(k, ENERGY, "energy", CHECK_OUT, 1);
	}
	quern_check_add_uses(k, hook, outputs, false);
	const quern_real density = moduli_of(k).density;
	for (uint32_t i = 0; i < n; i++) {
		quern_check_given(k, DENSITY, 0)[i] = density;
		if (update) quern_check_given(k, GRID_DENSITY, 0)[i] = density;
	}
}

/* Pressures up to `most` of the bulk modulus, with deviators up to `share` of the pressure. */
static void fill_stress(const check_kernel *k, double most, double share, uint64_t key) {
	const double bulk = moduli_of(k).bulk;
	for (uint32_t i = 0; i < k->n; i++) {
		const double p = quern_check_uniform(key, i, 0.1, 1) * most * bulk;
		double mean = 0;
		for (uint32_t c = 0; c < stresses(k); c++) {
			const double x = quern_check_uniform(key + 1, c * 65536 + i, -share, share) * p;
			quern_check_given(k, STRESS, c)[i] = x;
			if (c < k->dim) mean += x / k->dim;
		}
		for (uint32_t c = 0; c < k->dim; c++) quern_check_given(k, STRESS, c)[i] -= mean + p;
	}
}

/* Stress, density and history as assign leaves them. */
static void hand_over(const check_kernel *from, check_kernel *to) {
	const size_t n = from->n * sizeof(quern_real);
	for (uint32_t c = 0; c < stresses(from); c++)
		memcpy(quern_check_given(to, STRESS, c), quern_check_found(from, STRESS, c), n);
	memcpy(quern_check_given(to, DENSITY, 0), quern_check_found(from, DENSITY, 0), n);
	if (to->at[GRID_DENSITY] >= 0)
		memcpy(quern_check_given(to, GRID_DENSITY, 0), quern_check_found(from, DENSITY, 0), n);
	quern_check_carry(from, to);
}

static void start(const check *c, const check_instance *it, check_kernel *k, double most, double share) {
	check_kernel *assign = malloc(sizeof *assign);
	if (!assign) abort();
	create(c, it, QUERN_MATERIAL_ASSIGN, false, k->n, assign);
	fill_stress(assign, most, share, 60);
	quern_check_run(assign, 512, NULL);
	hand_over(assign, k);
	quern_check_kernel_finish(assign);
	free(assign);
}

static bool make(const check *c, const check_instance *it, uint32_t variant, uint32_t n, check_kernel *k) {
	if (variant >= VARIANTS) return false;
	const uint32_t hook = variant & ASSIGNS ? QUERN_MATERIAL_ASSIGN : QUERN_MATERIAL_UPDATE;
	create(c, it, hook, variant & OUTPUTS, n, k);
	if (hook == QUERN_MATERIAL_ASSIGN) {
		fill_stress(k, 1e-3, 1.5, 61);
		return true;
	}
	start(c, it, k, 1e-3, 1);
	k->dt = 1e-5;
	quern_check_fill(k, GRADIENT, k->dim * k->dim, 62, -30, 30);
	for (uint32_t i = 0; i < n; i++) {
		quern_check_given(k, DENSITY, 0)[i] *= quern_check_uniform(63, i, 0.998, 1.002);
		quern_check_given(k, GRID_DENSITY, 0)[i] *= quern_check_uniform(64, i, 0.9, 1.05);
	}
	return true;
}

/* ---- what must hold ---- */

static double stress_size(const check_kernel *k, uint32_t i, bool found) {
	double sum = 1e-30;
	for (uint32_t c = 0; c < stresses(k); c++)
		sum += fabs((found ? quern_check_found : quern_check_given)(k, STRESS, c)[i]);
	return sum;
}

typedef struct {
	check_tally moduli, again, held, yields, turned, violent;
} tallies;

static void check_moduli(const check_kernel *assign, tallies *t) {
	const moduli m = moduli_of(assign);
	quern_check_expect(&t->moduli,
		m.bulk > 0 && m.shear >= 0 && m.density > 0 && isfinite(m.bulk + m.shear + m.density),
		"%u-D: bulk %.3g Pa, shear %.3g Pa, density %.3g kg/m^3", assign->dim, m.bulk, m.shear, m.density);
}

/* Assigned twice is assigned once; without stress the density is that of moduli(), and pressure raises it by 1/K. */
static void check_assign(const check *c, const check_instance *it, check_kernel *k, tallies *t) {
	check_kernel *again = malloc(sizeof *again);
	if (!again) abort();
	const moduli m = moduli_of(k);
	fill_stress(k, 1e-4, 2, 65);
	quern_check_run(k, 512, NULL);
	create(c, it, QUERN_MATERIAL_ASSIGN, false, k->n, again);
	hand_over(k, again);
	quern_check_run(again, 512, NULL);
	for (uint32_t i = 0; i < k->n; i++) {
		double pressure = 0;
		for (uint32_t s = 0; s < stresses(k); s++)
			quern_check_measure(&t->again,
				fabs(quern_check_found(again, STRESS, s)[i] - quern_check_found(k, STRESS, s)[i]) /
					stress_size(k, i, true),
				1e-10, "%u-D: assign changes a stress that it has given back itself", k->dim);
		for (uint32_t s = 0; s < k->dim; s++) pressure -= quern_check_found(k, STRESS, s)[i] / k->dim;
		const double strain = log(quern_check_found(k, DENSITY, 0)[i] / m.density);
		quern_check_measure(&t->moduli, fabs(strain * m.bulk - pressure) / (0.01 * pressure + 1e-12 * m.bulk),
			1, "%u-D: a pressure of %.4g Pa goes with a density of %.6g kg/m^3, which moduli() does not say",
			k->dim, pressure, quern_check_found(k, DENSITY, 0)[i]);
	}
	quern_check_kernel_finish(again);
	free(again);
}

/* A point that does not deform keeps what assign gave it. */
static void check_rest(check_kernel *k, tallies *t) {
	quern_check_fill(k, GRADIENT, k->dim * k->dim, 66, 0, 0);
	k->dt = 1e-12;
	quern_check_run(k, 512, NULL);
	for (uint32_t i = 0; i < k->n; i++)
		for (uint32_t c = 0; c < stresses(k); c++)
			quern_check_measure(&t->held,
				fabs(quern_check_found(k, STRESS, c)[i] - quern_check_given(k, STRESS, c)[i]) /
					stress_size(k, i, false),
				1e-9, "%u-D: a point at rest turns a stress of %.9g Pa into %.9g", k->dim,
				quern_check_given(k, STRESS, c)[i], quern_check_found(k, STRESS, c)[i]);
}

/* Volumes follow the gradient, V *= det(1 + dt L), before a material is asked. */
static void follow_volume(const check_kernel *k) {
	for (uint32_t i = 0; i < k->n; i++) {
		double f[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, det = 0;
		for (uint32_t a = 0; a < k->dim; a++)
			for (uint32_t b = 0; b < k->dim; b++)
				f[a][b] += k->dt * quern_check_given(k, GRADIENT, a * k->dim + b)[i];
		for (int a = 0; a < 3; a++) {
			const int b = (a + 1) % 3, c = (a + 2) % 3;
			det += f[0][a] * (f[1][b] * f[2][c] - f[1][c] * f[2][b]);
		}
		quern_check_given(k, DENSITY, 0)[i] /= det > 0.1 ? det : 0.1;
		quern_check_given(k, GRID_DENSITY, 0)[i] = quern_check_given(k, DENSITY, 0)[i];
	}
}

/* Whatever the strain, the stress is one that assign lets stand. */
static void check_yield(
	const check *c, const check_instance *it, check_kernel *k, double strain, tallies *t) {
	check_kernel *assign = malloc(sizeof *assign);
	const char *column = "";
	if (!assign) abort();
	create(c, it, QUERN_MATERIAL_ASSIGN, false, k->n, assign);
	k->dt = 1e-4;
	quern_check_fill(k, GRADIENT, k->dim * k->dim, 67, -strain / k->dt, strain / k->dt);
	follow_volume(k);
	quern_check_run(k, 512, NULL);
	quern_check_expect(&t->violent, quern_check_finite(k, &column),
		"%u-D: %s is not finite after a strain of %.2g in one step", k->dim, column, strain);
	hand_over(k, assign);
	quern_check_run(assign, 512, NULL);
	for (uint32_t i = 0; i < k->n; i++)
		for (uint32_t s = 0; s < stresses(k); s++)
			quern_check_measure(&t->yields,
				fabs(quern_check_found(assign, STRESS, s)[i] - quern_check_found(k, STRESS, s)[i]) /
					(stress_size(k, i, true) + 1e-12 * moduli_of(k).bulk),
				1e-9,
				"%u-D: update leaves a stress beyond yield or a tension: %.6g Pa, of which assign leaves "
				"%.6g",
				k->dim, quern_check_found(k, STRESS, s)[i], quern_check_found(assign, STRESS, s)[i]);
	for (uint32_t i = 0; i < k->n && k->at[WAVE] >= 0; i++)
		quern_check_expect(&t->violent,
			quern_check_found(k, WAVE, 0)[i] >= 0 && quern_check_found(k, ENERGY, 0)[i] >= 0,
			"%u-D: wave speed %.3g m/s, energy %.3g J/kg", k->dim, quern_check_found(k, WAVE, 0)[i],
			quern_check_found(k, ENERGY, 0)[i]);
	quern_check_kernel_finish(assign);
	free(assign);
}

static void unpack(const check_kernel *k, uint32_t i, bool found, double s[3][3]) {
	static const int planar[] = { 0, 4, 1 }, spatial[] = { 0, 4, 8, 1, 5, 2 };
	memset(s, 0, 9 * sizeof(double));
	for (uint32_t c = 0; c < stresses(k); c++) {
		const int at = (k->dim == 2 ? planar : spatial)[c];
		s[at / 3][at % 3] = s[at % 3][at / 3] =
			(found ? quern_check_found : quern_check_given)(k, STRESS, c)[i];
	}
}

/* After a small turn by an angle a, sigma + a (w sigma - sigma w), up to a^2. */
static void check_rotation(check_kernel *k, tallies *t) {
	const double angle = 1e-5, scale = moduli_of(k).bulk + moduli_of(k).shear;
	k->dt = 1e-6;
	for (uint32_t i = 0; i < k->n; i++) {
		double axis[3], w[3][3];
		quern_check_direction(3, 68, i, axis);
		if (k->dim == 2) axis[0] = axis[1] = 0, axis[2] = 1;
		for (int a = 0; a < 3; a++)
			for (int b = 0; b < 3; b++) w[a][b] = a == b ? 0 : (b == (a + 1) % 3 ? -1 : 1) * axis[3 - a - b];
		for (uint32_t a = 0; a < k->dim; a++)
			for (uint32_t b = 0; b < k->dim; b++)
				quern_check_given(k, GRADIENT, a * k->dim + b)[i] = w[a][b] * angle / k->dt;
	}
	quern_check_run(k, 512, NULL);
	for (uint32_t i = 0; i < k->n; i++) {
		double s[3][3], now[3][3], w[3][3] = { { 0 } };
		unpack(k, i, false, s);
		unpack(k, i, true, now);
		for (uint32_t a = 0; a < k->dim; a++)
			for (uint32_t b = 0; b < k->dim; b++)
				w[a][b] = quern_check_given(k, GRADIENT, a * k->dim + b)[i] * k->dt;
		for (int a = 0; a < 3; a++)
			for (int b = 0; b < 3; b++) {
				double turned = s[a][b];
				for (int c = 0; c < 3; c++) turned += w[a][c] * s[c][b] - s[a][c] * w[c][b];
				quern_check_measure(&t->turned, fabs(now[a][b] - turned), 10 * angle * angle * scale,
					"%u-D: after a turn by %.0e a stress of %.9g Pa should be %.9g, is %.9g", k->dim, angle,
					s[a][b], turned, now[a][b]);
			}
	}
}

static void try_dimension(const check *c, const check_instance *it, tallies *t) {
	enum { POINTS = 300 };
	check_kernel *k = malloc(sizeof *k);
	if (!k) abort();
	create(c, it, QUERN_MATERIAL_ASSIGN, false, POINTS, k);
	check_moduli(k, t);
	check_assign(c, it, k, t);
	quern_check_kernel_finish(k);
	create(c, it, QUERN_MATERIAL_UPDATE, true, POINTS, k);
	start(c, it, k, 1e-2, 0.1);
	check_rest(k, t);
	check_rotation(k, t);
	for (int e = -5; e <= 0; e++) {
		start(c, it, k, 1e-3, 0.1);
		check_yield(c, it, k, 0.3 * pow(10, e), t);
	}
	quern_check_kernel_finish(k);
	free(k);
}

static void law(const check *c) {
	tallies t = { { .name = "moduli and density" }, { .name = "assign twice" },
		{ .name = "assign and read back" }, { .name = "yield" }, { .name = "rotation" },
		{ .name = "large gradients" } };
	for (uint32_t dim = 2; dim <= 3; dim++) {
		check_instance it;
		if (!check_has_dim(c, dim)) continue;
		if (quern_check_instance_create(c, dim, 0, &it) == CHECK_READY) try_dimension(c, &it, &t);
		quern_check_instance_finish(c, &it);
	}
	quern_check_tell(c, &t.moduli, NULL);
	quern_check_tell(c, &t.again, NULL);
	quern_check_tell(c, &t.held, NULL);
	quern_check_tell(c, &t.yields, NULL);
	quern_check_tell(c, &t.turned, NULL);
	quern_check_tell(c, &t.violent, "strains of 3e-6 to 0.3 in one step");
}

const check_kind quern_check_material = { .kind = &quern_material_kind, .make = make, .law = law };
