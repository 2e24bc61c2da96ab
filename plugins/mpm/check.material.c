/* SPDX-License-Identifier: MIT */
/* check.material - constitutive models: stress and history belong together, yield is obeyed, rotation does not matter */
#include <math.h>
#include <quern/check.h>
#include <quern/material.h>
#include <stdlib.h>
#include <string.h>

enum { GRADIENT, GRID_DENSITY, DENSITY, STRESS, WAVE, ENERGY, MEAN_PRESSURE };
enum { OUTPUTS = 1, ASSIGNS = 2, VARIANTS = 4 };

typedef struct {
	quern_real bulk, shear, density;
} moduli;

static moduli moduli_of(const quern_check_kernel *k) {
	moduli m = { 0 };
	((const quern_material_ops *)k->ops)->moduli(k->self, k->dim, &m.bulk, &m.shear, &m.density);
	return m;
}

static uint32_t stresses(const quern_check_kernel *k) { return k->dim == 2 ? 3 : 6; }

static void call(const quern_check_kernel *k, const quern_check_batch *b) {
	const quern_material_ops *ops = k->ops;
	quern_column use[QUERN_MOST_USES];
	const bool update = k->hook == QUERN_MATERIAL_UPDATE;
	quern_material_batch batch = { .n = b->n, .cap = b->cap, .dt = update ? k->dt : 0, .use = use };
	QUERN_CHECK_VECTOR(batch.gradient, k, b, GRADIENT, k->dim * k->dim);
	QUERN_CHECK_VECTOR(batch.stress, k, b, STRESS, stresses(k));
	batch.grid_density = quern_check_at(k, b, GRID_DENSITY, 0);
	batch.mean_pressure = quern_check_at(k, b, MEAN_PRESSURE, 0);
	batch.density = quern_check_at(k, b, DENSITY, 0);
	batch.wave_speed = quern_check_at(k, b, WAVE, 0);
	batch.energy = quern_check_at(k, b, ENERGY, 0);
	k->host->columns(k, b, k->use, use);
	(update ? ops->update : ops->assign)[k->dim - 2](k->self, &batch);
}

static quern_check_kernel *create(
	const quern_check *c, const quern_check_instance *it, uint32_t hook, bool outputs, uint32_t n) {
	const bool update = hook == QUERN_MATERIAL_UPDATE;
	quern_check_kernel *k = c->host->kernel_create(c, it, update ? "update" : "assign", n);
	k->call = call;
	if (update) {
		c->host->add(k, GRADIENT, "gradient", QUERN_CHECK_IN, k->dim * k->dim);
		c->host->add(k, GRID_DENSITY, "grid_density", QUERN_CHECK_IN, 1);
		/* as in a hybrid; with outputs as in a continuum alone, so that both are seen */
		if (!outputs) c->host->add(k, MEAN_PRESSURE, "mean_pressure", QUERN_CHECK_IN, 1);
	}
	c->host->add(k, DENSITY, "density", QUERN_CHECK_CHANGED, 1);
	c->host->add(k, STRESS, "stress", QUERN_CHECK_CHANGED, stresses(k));
	if (outputs) {
		c->host->add(k, WAVE, "wave_speed", QUERN_CHECK_OUT, 1);
		c->host->add(k, ENERGY, "energy", QUERN_CHECK_OUT, 1);
	}
	c->host->add_uses(k, hook, outputs);
	const quern_real density = moduli_of(k).density;
	for (uint32_t i = 0; i < n; i++) {
		quern_check_given(k, DENSITY, 0)[i] = density;
		if (update) quern_check_given(k, GRID_DENSITY, 0)[i] = density;
	}
	return k;
}

/* Pressures up to `most` of the bulk modulus, with deviators up to `share` of the pressure. */
static void fill_stress(const quern_check_kernel *k, double most, double share, uint64_t key) {
	const double bulk = moduli_of(k).bulk;
	for (uint32_t i = 0; i < k->n; i++) {
		const double p = k->host->uniform(key, i, 0.1, 1) * most * bulk;
		double mean = 0;
		for (uint32_t c = 0; c < stresses(k); c++) {
			const double x = k->host->uniform(key + 1, c * 65536 + i, -share, share) * p;
			quern_check_given(k, STRESS, c)[i] = x;
			if (c < k->dim) mean += x / k->dim;
		}
		for (uint32_t c = 0; c < k->dim; c++) quern_check_given(k, STRESS, c)[i] -= mean + p;
	}
}

/* Stress, density and history as assign leaves them. */
static void hand_over(const quern_check_kernel *from, quern_check_kernel *to) {
	const size_t n = from->n * sizeof(quern_real);
	for (uint32_t c = 0; c < stresses(from); c++)
		memcpy(quern_check_given(to, STRESS, c), quern_check_found(from, STRESS, c), n);
	memcpy(quern_check_given(to, DENSITY, 0), quern_check_found(from, DENSITY, 0), n);
	if (to->at[GRID_DENSITY] >= 0)
		memcpy(quern_check_given(to, GRID_DENSITY, 0), quern_check_found(from, DENSITY, 0), n);
	from->host->carry(from, to);
}

static void start(
	const quern_check *c, const quern_check_instance *it, quern_check_kernel *k, double most, double share) {
	quern_check_kernel *assign = create(c, it, QUERN_MATERIAL_ASSIGN, false, k->n);
	fill_stress(assign, most, share, 60);
	c->host->run(assign, 512, false);
	hand_over(assign, k);
	c->host->kernel_destroy(assign);
}

static quern_check_kernel *make(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	if (variant >= VARIANTS) return NULL;
	const uint32_t hook = variant & ASSIGNS ? QUERN_MATERIAL_ASSIGN : QUERN_MATERIAL_UPDATE;
	quern_check_kernel *k = create(c, it, hook, variant & OUTPUTS, n);
	if (hook == QUERN_MATERIAL_ASSIGN) {
		fill_stress(k, 1e-3, 1.5, 61);
		return k;
	}
	start(c, it, k, 1e-3, 1);
	k->dt = 1e-5;
	c->host->fill(k, GRADIENT, k->dim * k->dim, 62, -30, 30);
	for (uint32_t i = 0; i < n; i++) {
		quern_check_given(k, DENSITY, 0)[i] *= c->host->uniform(63, i, 0.998, 1.002);
		quern_check_given(k, GRID_DENSITY, 0)[i] *= c->host->uniform(64, i, 0.9, 1.05);
		if (k->at[MEAN_PRESSURE] < 0) continue;
		const double pressure = -quern_check_given(k, STRESS, 0)[i] * c->host->uniform(65, i, -0.5, 2);
		quern_check_given(k, MEAN_PRESSURE, 0)[i] = pressure > 0 ? pressure : 0;
	}
	return k;
}

/* ---- what must hold ---- */

enum { POINTS = 300 };

static double stress_size(const quern_check_kernel *k, uint32_t i, bool found) {
	double sum = 1e-30;
	for (uint32_t c = 0; c < stresses(k); c++)
		sum += fabs((found ? quern_check_found : quern_check_given)(k, STRESS, c)[i]);
	return sum;
}

typedef struct {
	quern_check_tally moduli, friction, again, held, yields, turned, axes, taken, violent;
} tallies;

static void check_moduli(const quern_check_kernel *assign, tallies *t) {
	const moduli m = moduli_of(assign);
	assign->host->expect(&t->moduli,
		m.bulk > 0 && m.shear >= 0 && m.density > 0 && isfinite(m.bulk + m.shear + m.density),
		"%u-D: bulk %.3g Pa, shear %.3g Pa, density %.3g kg/m^3", assign->dim, m.bulk, m.shear, m.density);
}

/* What a rough boundary takes, where there is one. */
static void check_friction(const quern_check_kernel *k, tallies *t) {
	quern_real slow = 0, fast = 0, number = 0, density = 1;
	const quern_material_ops *ops = k->ops;
	if (ops->friction) ops->friction(k->self, k->dim, &slow, &fast, &number, &density);
	k->host->expect(&t->friction,
		slow >= 0 && fast >= slow && number >= 0 && density > 0 && isfinite(fast + number + density),
		"%u-D: from %.3g to %.3g with I_0 = %.3g and grains of %.3g kg/m^3; it must not fall with the rate",
		k->dim, slow, fast, number, density);
}

/* Assigned twice is assigned once; without stress the density is that of moduli(), and pressure raises it by 1/K. */
static void check_assign(
	const quern_check *c, const quern_check_instance *it, quern_check_kernel *k, tallies *t) {
	const moduli m = moduli_of(k);
	fill_stress(k, 1e-4, 2, 65);
	c->host->run(k, 512, false);
	quern_check_kernel *again = create(c, it, QUERN_MATERIAL_ASSIGN, false, k->n);
	hand_over(k, again);
	c->host->run(again, 512, false);
	for (uint32_t i = 0; i < k->n; i++) {
		double pressure = 0;
		for (uint32_t s = 0; s < stresses(k); s++)
			c->host->measure(&t->again,
				fabs(quern_check_found(again, STRESS, s)[i] - quern_check_found(k, STRESS, s)[i]) /
					stress_size(k, i, true),
				1e-10, "%u-D: assign changes a stress that it has given back itself", k->dim);
		for (uint32_t s = 0; s < k->dim; s++) pressure -= quern_check_found(k, STRESS, s)[i] / k->dim;
		const double strain = log(quern_check_found(k, DENSITY, 0)[i] / m.density);
		c->host->measure(&t->moduli, fabs(strain * m.bulk - pressure) / (0.01 * pressure + 1e-12 * m.bulk), 1,
			"%u-D: a pressure of %.4g Pa goes with a density of %.6g kg/m^3, which moduli() does not say",
			k->dim, pressure, quern_check_found(k, DENSITY, 0)[i]);
	}
	c->host->kernel_destroy(again);
}

/* A point that does not deform keeps what assign gave it. */
static void check_rest(quern_check_kernel *k, tallies *t) {
	k->host->fill(k, GRADIENT, k->dim * k->dim, 66, 0, 0);
	k->dt = 1e-12;
	k->host->run(k, 512, false);
	for (uint32_t i = 0; i < k->n; i++)
		for (uint32_t c = 0; c < stresses(k); c++)
			k->host->measure(&t->held,
				fabs(quern_check_found(k, STRESS, c)[i] - quern_check_given(k, STRESS, c)[i]) /
					stress_size(k, i, false),
				1e-9, "%u-D: a point at rest turns a stress of %.9g Pa into %.9g", k->dim,
				quern_check_given(k, STRESS, c)[i], quern_check_found(k, STRESS, c)[i]);
}

/* Volumes follow the gradient, V *= det(1 + dt L), before a material is asked. */
static void follow_volume(const quern_check_kernel *k) {
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
	const quern_check *c, const quern_check_instance *it, quern_check_kernel *k, double strain, tallies *t) {
	quern_check_kernel *assign = create(c, it, QUERN_MATERIAL_ASSIGN, false, k->n);
	const char *column = "";
	k->dt = 1e-4;
	c->host->fill(k, GRADIENT, k->dim * k->dim, 67, -strain / k->dt, strain / k->dt);
	follow_volume(k);
	c->host->run(k, 512, false);
	c->host->expect(&t->violent, c->host->finite(k, &column),
		"%u-D: %s is not finite after a strain of %.2g in one step", k->dim, column, strain);
	hand_over(k, assign);
	c->host->run(assign, 512, false);
	for (uint32_t i = 0; i < k->n; i++)
		for (uint32_t s = 0; s < stresses(k); s++)
			c->host->measure(&t->yields,
				fabs(quern_check_found(assign, STRESS, s)[i] - quern_check_found(k, STRESS, s)[i]) /
					(stress_size(k, i, true) + 1e-12 * moduli_of(k).bulk),
				1e-9,
				"%u-D: update leaves a stress beyond yield or a tension: %.6g Pa, of which assign leaves "
				"%.6g",
				k->dim, quern_check_found(k, STRESS, s)[i], quern_check_found(assign, STRESS, s)[i]);
	for (uint32_t i = 0; i < k->n && k->at[WAVE] >= 0; i++)
		c->host->expect(&t->violent,
			quern_check_found(k, WAVE, 0)[i] >= 0 && quern_check_found(k, ENERGY, 0)[i] >= 0,
			"%u-D: wave speed %.3g m/s, energy %.3g J/kg", k->dim, quern_check_found(k, WAVE, 0)[i],
			quern_check_found(k, ENERGY, 0)[i]);
	c->host->kernel_destroy(assign);
}

/* Where component c of a stress stands in the nine of a tensor. */
static int place_of(const quern_check_kernel *k, uint32_t c) {
	static const int planar[] = { 0, 4, 1 }, spatial[] = { 0, 4, 8, 1, 5, 2 };
	return (k->dim == 2 ? planar : spatial)[c];
}

static void unpack(const quern_check_kernel *k, uint32_t i, bool found, double s[3][3]) {
	memset(s, 0, 9 * sizeof(double));
	for (uint32_t c = 0; c < stresses(k); c++) {
		const int at = place_of(k, c);
		s[at / 3][at % 3] = s[at % 3][at / 3] =
			(found ? quern_check_found : quern_check_given)(k, STRESS, c)[i];
	}
}

/* After a small turn by an angle a, sigma + a (w sigma - sigma w), up to a^2. */
static void check_rotation(quern_check_kernel *k, tallies *t) {
	const double angle = 1e-5, scale = moduli_of(k).bulk + moduli_of(k).shear;
	k->dt = 1e-6;
	for (uint32_t i = 0; i < k->n; i++) {
		double axis[3], w[3][3];
		k->host->direction(3, 68, i, axis);
		if (k->dim == 2) axis[0] = axis[1] = 0, axis[2] = 1;
		for (int a = 0; a < 3; a++)
			for (int b = 0; b < 3; b++) w[a][b] = a == b ? 0 : (b == (a + 1) % 3 ? -1 : 1) * axis[3 - a - b];
		for (uint32_t a = 0; a < k->dim; a++)
			for (uint32_t b = 0; b < k->dim; b++)
				quern_check_given(k, GRADIENT, a * k->dim + b)[i] = w[a][b] * angle / k->dt;
	}
	k->host->run(k, 512, false);
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
				k->host->measure(&t->turned, fabs(now[a][b] - turned), 10 * angle * angle * scale,
					"%u-D: after a turn by %.0e a stress of %.9g Pa should be %.9g, is %.9g", k->dim, angle,
					s[a][b], turned, now[a][b]);
			}
	}
}

/* ---- other axes ---- */

static void pack(const quern_check_kernel *k, uint32_t i, double s[3][3]) {
	for (uint32_t c = 0; c < stresses(k); c++)
		quern_check_given(k, STRESS, c)[i] = s[place_of(k, c) / 3][place_of(k, c) % 3];
}

/* Axes turned anyhow, point by point: q_ab is the part along the new axis a of the old one b. */
static void axes_of(const quern_check_kernel *k, uint32_t i, double q[3][3]) {
	double n[3] = { 0, 0, 1 };
	if (k->dim == 3) k->host->direction(3, 74, i, n);
	const double angle = k->host->uniform(73, i, 0, 6.283185307179586), c = cos(angle), s = sin(angle);
	for (int a = 0; a < 3; a++)
		for (int b = 0; b < 3; b++) {
			const double across = a == b ? 0 : (b == (a + 1) % 3 ? -1 : 1) * n[3 - a - b];
			q[a][b] = (a == b ? c : 0) + (1 - c) * n[a] * n[b] + s * across;
		}
}

static void in_axes(double q[3][3], double t[3][3]) {
	double half[3][3] = { { 0 } }, out[3][3] = { { 0 } };
	for (int a = 0; a < 3; a++)
		for (int b = 0; b < 3; b++)
			for (int c = 0; c < 3; c++) half[a][b] += q[a][c] * t[c][b];
	for (int a = 0; a < 3; a++)
		for (int b = 0; b < 3; b++)
			for (int c = 0; c < 3; c++) out[a][b] += half[a][c] * q[b][c];
	memcpy(t, out, sizeof out);
}

/* The same stresses for both, in the second's own axes. */
static void start_in_axes(
	const quern_check *c, const quern_check_instance *it, quern_check_kernel *k, quern_check_kernel *turned) {
	quern_check_kernel *assign = create(c, it, QUERN_MATERIAL_ASSIGN, false, k->n);
	fill_stress(assign, 1e-3, 0.5, 75);
	c->host->run(assign, 512, false);
	hand_over(assign, k);
	for (uint32_t i = 0; i < k->n; i++) {
		double q[3][3], s[3][3];
		axes_of(k, i, q);
		unpack(assign, i, false, s);
		in_axes(q, s);
		pack(assign, i, s);
	}
	c->host->run(assign, 512, false);
	hand_over(assign, turned);
	c->host->kernel_destroy(assign);
}

static void deform_in_axes(quern_check_kernel *k, quern_check_kernel *turned, double strain) {
	const uint32_t dim = k->dim;
	k->dt = turned->dt = 1e-4;
	k->host->fill(k, GRADIENT, dim * dim, 76, -strain / k->dt, strain / k->dt);
	for (uint32_t i = 0; i < k->n; i++) {
		double q[3][3], l[3][3] = { { 0 } };
		axes_of(k, i, q);
		for (uint32_t c = 0; c < dim * dim; c++) l[c / dim][c % dim] = quern_check_given(k, GRADIENT, c)[i];
		in_axes(q, l);
		for (uint32_t c = 0; c < dim * dim; c++)
			quern_check_given(turned, GRADIENT, c)[i] = l[c / dim][c % dim];
	}
	k->host->run(k, 512, false);
	k->host->run(turned, 512, false);
}

/* What a material does, it does in any axes: of a deformation seen from turned ones the stress is turned, and no component is another. */
static void check_axes(const quern_check *c, const quern_check_instance *it, double strain, tallies *t) {
	quern_check_kernel *k = create(c, it, QUERN_MATERIAL_UPDATE, true, POINTS),
					   *turned = create(c, it, QUERN_MATERIAL_UPDATE, true, POINTS);
	start_in_axes(c, it, k, turned);
	deform_in_axes(k, turned, strain);
	const double scale = (strain + 1e-3) * (moduli_of(k).bulk + moduli_of(k).shear);
	for (uint32_t i = 0; i < k->n; i++) {
		double q[3][3], s[3][3], now[3][3];
		axes_of(k, i, q);
		unpack(k, i, true, s);
		in_axes(q, s);
		unpack(turned, i, true, now);
		for (int a = 0; a < 3; a++)
			for (int b = a; b < 3; b++)
				k->host->measure(&t->axes, fabs(now[a][b] - s[a][b]), 1e-9 * scale,
					"%u-D: in turned axes a stress after a strain of %.0e should be %.9g, is %.9g Pa", k->dim,
					strain, s[a][b], now[a][b]);
	}
	c->host->kernel_destroy(k);
	c->host->kernel_destroy(turned);
}

/* ---- what deformation costs ---- */

enum { CYCLE = 200 };

/* Of strain^2 (K + G). A law in rates is off by some ten times the strain, since no energy is behind it. */
static const double cycle_off = 0.02;

/* The velocity gradient of step s on a circle in strain, through 0: e (A sin t + B (1 - cos t)), A and B of a point's own. */
static void set_cycle(quern_check_kernel *k, double strain, int s) {
	const double step = 2 * 3.141592653589793 / CYCLE, t = (s + 0.5) * step;
	for (uint32_t c = 0; c < k->dim * k->dim; c++)
		for (uint32_t i = 0; i < k->n; i++) {
			const uint64_t at = c * 65536 + i;
			const double a = k->host->uniform(70, at, -1, 1), b = k->host->uniform(71, at, -1, 1);
			quern_check_given(k, GRADIENT, c)[i] = strain * step * (a * cos(t) + b * sin(t)) / k->dt;
		}
}

/* J/kg, of the stress before and behind a step, half each. */
static double work_of(const quern_check_kernel *k, uint32_t i) {
	double old[3][3], now[3][3], sum = 0;
	unpack(k, i, false, old);
	unpack(k, i, true, now);
	for (uint32_t a = 0; a < k->dim; a++)
		for (uint32_t b = 0; b < k->dim; b++)
			sum += 0.5 * (old[a][b] + now[a][b]) * quern_check_given(k, GRADIENT, a * k->dim + b)[i] * k->dt;
	return sum / quern_check_given(k, DENSITY, 0)[i];
}

/* Work is stored or lost. Round a circle in strain, either way, a law that stores less than it is given gives nothing of its own. */
static void check_cycle(quern_check_kernel *k, double strain, tallies *t) {
	const moduli m = moduli_of(k);
	double *work = k->host->memory(2 * POINTS, sizeof *work), *before = work + POINTS;
	k->dt = 1e-4;
	k->host->fill(k, GRADIENT, k->dim * k->dim, 69, 0, 0);
	k->host->run(k, 512, false);
	for (uint32_t i = 0; i < k->n; i++) work[i] = 0, before[i] = quern_check_found(k, ENERGY, 0)[i];
	for (int s = 0; s < CYCLE; s++) {
		k->host->advance(k);
		set_cycle(k, strain, s);
		follow_volume(k);
		k->host->run(k, 512, false);
		for (uint32_t i = 0; i < k->n; i++) work[i] += work_of(k, i);
	}
	for (uint32_t i = 0; i < k->n; i++) {
		const double stored = quern_check_found(k, ENERGY, 0)[i] - before[i],
					 whole = strain * strain * (m.bulk + m.shear) / m.density;
		k->host->measure(&t->taken, (stored - work[i]) / whole, cycle_off,
			"%u-D: round a circle of strain %.0e work of %.6g J/kg stores %.6g, over %.6g of such strains",
			k->dim, strain, work[i], stored, whole);
	}
	free(work);
}

static void try_dimension(const quern_check *c, const quern_check_instance *it, tallies *t) {
	quern_check_kernel *k = create(c, it, QUERN_MATERIAL_ASSIGN, false, POINTS);
	check_moduli(k, t);
	check_friction(k, t);
	check_assign(c, it, k, t);
	c->host->kernel_destroy(k);
	k = create(c, it, QUERN_MATERIAL_UPDATE, true, POINTS);
	start(c, it, k, 1e-2, 0.1);
	check_rest(k, t);
	check_rotation(k, t);
	for (int e = -6; e <= -2; e++) check_axes(c, it, pow(10, e), t);
	for (int e = -4; e <= -3; e++) {
		start(c, it, k, 1e-3, 0.1);
		check_cycle(k, pow(10, e), t);
	}
	for (int e = -5; e <= 0; e++) {
		start(c, it, k, 1e-3, 0.1);
		check_yield(c, it, k, 0.3 * pow(10, e), t);
	}
	c->host->kernel_destroy(k);
}

static void law(const quern_check *c) {
	tallies t = { { .name = "moduli and density" }, { .name = "friction at walls" },
		{ .name = "assign twice" }, { .name = "assign and read back" }, { .name = "yield" },
		{ .name = "rotation" }, { .name = "any axes" }, { .name = "work is stored or lost" },
		{ .name = "large gradients" } };
	for (uint32_t dim = 2; dim <= 3; dim++) {
		quern_check_instance *it = c->host->instance_create(c, dim, 0);
		if (it) try_dimension(c, it, &t);
		c->host->instance_destroy(it);
	}
	c->host->tell(c, &t.moduli, NULL);
	c->host->tell(c, &t.friction, NULL);
	c->host->tell(c, &t.again, NULL);
	c->host->tell(c, &t.held, NULL);
	c->host->tell(c, &t.yields, NULL);
	c->host->tell(c, &t.turned, NULL);
	c->host->tell(c, &t.axes, "strains of 1e-6 to 0.01 in one step");
	c->host->tell(c, &t.taken, "round circles of strains of 1e-4 and 1e-3");
	c->host->tell(c, &t.violent, "strains of 3e-6 to 0.3 in one step");
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = {
	.size = sizeof ops, .kind = &quern_material_kind, .make = make, .law = law
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.material",
	.brief = "Constitutive models: stress and history belong together, yield, rotation, any axes.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
