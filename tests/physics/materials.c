/* The materials alone, point by point: against vectors, against the formulas of docs/theory/materials.md in long double,
 * and against what must hold for any of them. Loads the plugins from the folder QUERN_PLUGINS_DIR, of the instruction set
 * QUERN_PLUGINS_LEVEL ("", ".v3", ".v4"). */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <quern/abi.h>

enum { POINTS = 10000, COLUMNS = 19, FIELDS = 4 };

typedef struct value {
	const char *name;
	double x;
} value;

typedef struct law {
	const quern_plugin *plugin;
	const quern_material_ops *ops;
	void *self;
	uint32_t dim;
	quern_real bulk, shear, density;
} law;

/* ==== a host for one plugin ==== */

static quern_status complain(quern_err *err, quern_status status, const char *param, const char *fmt, ...) {
	va_list args;
	(void)err;
	printf("  %s: ", param ? param : "-");
	va_start(args, fmt);
	vprintf(fmt, args);
	va_end(args);
	printf("\n");
	return status;
}

static const quern_host host = { .abi = QUERN_ABI, .fail = complain };

static const quern_plugin *load(const char *id) {
	const char *folder = getenv("QUERN_PLUGINS_DIR"), *level = getenv("QUERN_PLUGINS_LEVEL");
	char path[512];
	snprintf(path, sizeof path, "%s/%s%s.so", folder ? folder : "plugins", id, level ? level : "");
	void *object = dlopen(path, RTLD_NOW | RTLD_LOCAL);
	if (!object) fail_msg("%s", dlerror());
	const quern_library *library = dlsym(object, "quern_library_1");
	assert_non_null(library);
	assert_int_equal(library->abi >> 16, QUERN_ABI_MAJOR);
	assert_string_equal(library->plugin->id, id);
	return library->plugin;
}

/* Defaults, then what is given; the status is init's. `values` ends with a NULL name. */
static quern_status try_law(law *out, const char *id, uint32_t dim, const value *values) {
	const quern_plugin *plugin = load(id);
	quern_real *self = calloc(1, plugin->instance_size);
	assert_non_null(self);
	for (const quern_param *row = plugin->params; row->name; row++) {
		const bool planar = dim == 2 && row->flags & QUERN_PLANAR;
		quern_real x = planar ? row->planar : row->def;
		bool found = !(row->flags & QUERN_REQUIRED);
		for (const value *v = values; v->name; v++)
			if (!strcmp(v->name, row->name)) x = v->x, found = true;
		if (!found) fail_msg("%s needs %s", id, row->name);
		assert_int_equal(row->type, QUERN_T_REAL);
		self[row->offset / sizeof *self] = x;
	}
	const quern_setup setup = { .dim = dim, .lanes = QUERN_LANES, .host = &host };
	*out = (law) { .plugin = plugin, .ops = plugin->ops, .self = self, .dim = dim };
	const quern_status status = plugin->init(self, &setup, NULL);
	out->ops->moduli(self, dim, &out->bulk, &out->shear, &out->density);
	return status;
}

static law make_law(const char *id, uint32_t dim, const value *values) {
	law out;
	assert_int_equal(try_law(&out, id, dim, values), QUERN_OK);
	return out;
}

/* The constants of most tests: bulk modulus 1e8 Pa, 1500 kg/m^3, grains of 5 mm and 2450 kg/m^3. */
static law usual_law(const char *id, uint32_t dim) {
	const value values[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 }, { "grain_density", 2450 },
		{ "critical_density", 1500 }, { "density", 1500 }, { NULL, 0 } };
	return make_law(id, dim, values);
}

static double param(const law *m, const char *name) {
	for (const quern_param *row = m->plugin->params; row->name; row++)
		if (!strcmp(row->name, name)) return ((const quern_real *)m->self)[row->offset / sizeof(quern_real)];
	fail_msg("no parameter %s", name);
	return 0;
}

static void free_law(law *m) { free(m->self); }

static const char *const ids[] = { "material.mu_i", "material.drucker_prager", "material.elastic" };
enum { MU_I, DRUCKER_PRAGER, ELASTIC, MATERIALS };

/* ==== points ==== */

typedef struct cloud {
	uint32_t n, cap, n_fields, n_columns;
	quern_real *memory, *gradient[9], *grid_density, *density, *stress[6], *wave_speed, *energy;
	const char *field[FIELDS]; /* of history and output, by name */
	quern_column history[FIELDS], use[2 * FIELDS];
} cloud;

static uint32_t shape_size(uint8_t shape, uint32_t dim) {
	return shape == QUERN_SCALAR ? 1 : dim == 2 ? 3 : 6;
}

static cloud make_cloud(const law *m, uint32_t n) {
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

static void free_cloud(cloud *c) { free(c->memory); }

static quern_column *history(cloud *c, const char *field) {
	for (uint32_t f = 0; f < c->n_fields; f++)
		if (!strcmp(c->field[f], field)) return &c->history[f];
	fail_msg("no field %s", field);
	return NULL;
}

/* Calls the material on points [first, first + n), which begin at a multiple of the lanes. */
static void call(const law *m, cloud *c, int hook, double dt, uint32_t first, uint32_t n) {
	quern_material_batch b = { .n = n, .cap = c->cap - first, .dt = dt };
	quern_column use[2 * FIELDS] = { 0 };
	const bool update = hook == QUERN_MATERIAL_UPDATE;
	for (uint32_t k = 0; k < 9 && update; k++) b.gradient[k] = c->gradient[k] ? c->gradient[k] + first : NULL;
	for (uint32_t k = 0; k < 6; k++) b.stress[k] = c->stress[k] ? c->stress[k] + first : NULL;
	b.grid_density = update ? c->grid_density + first : NULL;
	b.density = c->density + first;
	b.wave_speed = c->wave_speed ? c->wave_speed + first : NULL;
	b.energy = c->energy ? c->energy + first : NULL;
	for (uint32_t r = 0; m->plugin->uses[r].field; r++)
		for (uint32_t k = 0; k < 9 && m->plugin->uses[r].hook == hook; k++)
			if (c->use[r].real[k]) use[r].real[k] = c->use[r].real[k] + first;
	b.use = use;
	(update ? m->ops->update : m->ops->assign)[m->dim - 2](m->self, &b);
}

static void update(const law *m, cloud *c, double dt) { call(m, c, QUERN_MATERIAL_UPDATE, dt, 0, c->n); }
static void assign(const law *m, cloud *c) { call(m, c, QUERN_MATERIAL_ASSIGN, 0, 0, c->n); }

/* ==== tensors in long double ==== */

typedef long double wide;
typedef struct matrix {
	wide x[3][3];
} matrix;

static matrix times(matrix a, matrix b) {
	matrix c = { 0 };
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			for (int k = 0; k < 3; k++) c.x[i][j] += a.x[i][k] * b.x[k][j];
	return c;
}
static matrix transposed(matrix a) {
	matrix c;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++) c.x[i][j] = a.x[j][i];
	return c;
}
/* a + f b, on the first `dim` axes */
static matrix plus(uint32_t dim, matrix a, wide f, matrix b) {
	matrix c = { 0 };
	for (uint32_t i = 0; i < dim; i++)
		for (uint32_t j = 0; j < dim; j++) c.x[i][j] = a.x[i][j] + f * b.x[i][j];
	return c;
}
static const matrix none = { 0 }, unit = { { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } } };

static matrix scaled(uint32_t dim, wide f, matrix a) { return plus(dim, none, f, a); }
static wide trace(uint32_t dim, matrix a) { return a.x[0][0] + a.x[1][1] + (dim == 3 ? a.x[2][2] : 0); }
static matrix deviator(uint32_t dim, matrix a) { return plus(dim, a, -trace(dim, a) / dim, unit); }
static wide product(matrix a, matrix b) {
	wide sum = 0;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++) sum += a.x[i][j] * b.x[i][j];
	return sum;
}
static wide norm(matrix a) { return sqrtl(product(a, a)); }
static wide shear_of(uint32_t dim, matrix a) { return norm(deviator(dim, a)) / sqrtl(2); }
static wide minor2(matrix a) { return a.x[0][0] * a.x[1][1] - a.x[0][1] * a.x[1][0]; }
static wide determinant(uint32_t dim, matrix a) {
	if (dim == 2) return minor2(a);
	return a.x[2][2] * minor2(a) - a.x[2][1] * (a.x[0][0] * a.x[1][2] - a.x[0][2] * a.x[1][0]) +
		   a.x[2][0] * (a.x[0][1] * a.x[1][2] - a.x[0][2] * a.x[1][1]);
}
/* Sylvester's criterion */
static bool positive(uint32_t dim, matrix a) {
	return a.x[0][0] > 0 && minor2(a) > 0 && (dim == 2 || determinant(3, a) > 0);
}
static matrix inverse(uint32_t dim, matrix a) {
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
static wide isochoric(uint32_t dim, matrix a) {
	const wide q = product(a, a) / 2, det = determinant(dim, a);
	wide y = 2 * norm(a);
	for (int k = 0; k < 200; k++)
		y -= dim == 2 ? (y * (2 + y) - q) / (2 * (1 + y))
					  : (y * (3 + y * (3 + y)) - q * (1 + y) + det) / (3 * (1 + y) * (1 + y) - q);
	return y;
}
/* (J^2 - 1)/2 - ln J at J = 1 + e */
static wide volume_energy(wide e) {
	if (fabsl(e) > 0.1L) return e + e * e / 2 - log1pl(e);
	wide sum = 0;
	for (int k = 60; k >= 3; k--) sum = e * sum + (k % 2 ? -1 : 1) / (wide)k;
	return e * e * (1 + e * sum);
}

static const int row6[] = { 0, 1, 2, 0, 1, 0 }, column6[] = { 0, 1, 2, 1, 2, 2 };
static const int row3[] = { 0, 1, 0 }, column3[] = { 0, 1, 1 };

static matrix get(uint32_t dim, quern_real *const *columns, uint32_t i) {
	matrix a = { 0 };
	for (int k = 0; k < (dim == 2 ? 3 : 6); k++) {
		const int r = dim == 2 ? row3[k] : row6[k], q = dim == 2 ? column3[k] : column6[k];
		a.x[r][q] = a.x[q][r] = columns[k][i];
	}
	return a;
}
static void put(uint32_t dim, quern_real *const *columns, uint32_t i, matrix a) {
	for (int k = 0; k < (dim == 2 ? 3 : 6); k++)
		columns[k][i] = (quern_real)(dim == 2 ? a.x[row3[k]][column3[k]] : a.x[row6[k]][column6[k]]);
}
static matrix get_gradient(uint32_t dim, const cloud *c, uint32_t i) {
	matrix a = { 0 };
	for (uint32_t r = 0; r < dim; r++)
		for (uint32_t q = 0; q < dim; q++) a.x[r][q] = c->gradient[r * dim + q][i];
	return a;
}
static void put_gradient(uint32_t dim, const cloud *c, uint32_t i, matrix a) {
	for (uint32_t r = 0; r < dim; r++)
		for (uint32_t q = 0; q < dim; q++) c->gradient[r * dim + q][i] = (quern_real)a.x[r][q];
}

/* ==== random points, the same everywhere: no libm ==== */

static uint64_t state;

static double uniform(void) {
	state ^= state << 13, state ^= state >> 7, state ^= state << 17;
	return (double)(state >> 11) * 0x1p-53;
}
static double between(double a, double b) { return a + (b - a) * uniform(); }
/* spread evenly over the powers of two from 2^low to 2^high */
static double sized(int low, int high) {
	double x = between(1, 2);
	for (int k = low + (int)(uniform() * (high - low)); k; k += k > 0 ? -1 : 1) x *= k > 0 ? 2 : 0.5;
	return x;
}
static matrix random_matrix(uint32_t dim, double size) {
	matrix a = { 0 };
	for (uint32_t i = 0; i < dim; i++)
		for (uint32_t j = 0; j < dim; j++) a.x[i][j] = between(-size, size);
	return a;
}
/* a symmetric deviator with sqrt(s:s/2) = size */
static matrix random_deviator(uint32_t dim, double size) {
	const matrix a = random_matrix(dim, 1), s = deviator(dim, plus(dim, a, 1, transposed(a)));
	return scaled(dim, size / shear_of(dim, s), s);
}
static matrix random_rotation(uint32_t dim) {
	const matrix a = random_matrix(dim, 1), w = plus(dim, a, -1, transposed(a));
	return times(inverse(dim, plus(dim, unit, -1, w)), plus(dim, unit, 1, w));
}

/* Any state the material may be in, and a step of any size up to a strain of `largest`; dt = 1e-4. */
static void randomise(int which, const law *m, cloud *c, double largest) {
	for (uint32_t i = 0; i < c->n; i++) {
		const double p = m->bulk * sized(-30, -4);
		const double mu = which == MU_I      ? param(m, "limit_friction")
						  : which == ELASTIC ? 3
											 : param(m, "friction");
		matrix stress = plus(
			m->dim, random_deviator(m->dim, mu * p * uniform()), which == ELASTIC && i % 2 ? p : -p, unit);
		put(m->dim, c->stress, i, stress);
		put_gradient(m->dim, c, i, random_matrix(m->dim, 1e4 * largest * sized(-24, 0)));
		c->grid_density[i] = m->density * between(0.8, 1.1);
	}
	assign(m, c);
	for (uint32_t i = 0; i < c->n; i++)
		if (i % 4 == 0) c->density[i] = m->density * between(0.9, 1.1);
}

static wide largest(wide a, wide b) { return a > b || a != a ? a : b; }

/* ==== tests ==== */

/* The implicit mu(I) update gives the published scheme's stress and plastic rate. */
static void vectors(void **unused) {
	static const double rows[][5] = { { 1000, 500, 1e-6, 399.778673007, 2.60575450181 },
		{ 1000, 5000, 1e-5, 447.285685918, 11.8370572166 }, { 10, 1000, 1e-5, 4.92141599775, 2.58720431841 },
		{ 1e5, 4.5e4, 3e-6, 40682.8748968, 37.4150842279 }, { 1000, 381, 1e-6, 381, 0 } };
	(void)unused;
	wide worst = 0;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const double shear = 1e8 / 2.6, bulk = dim == 3 ? 1e8 / 1.2 : shear * 1.3 / 0.7;
		const value values[] = { { "bulk_modulus", bulk }, { "diameter", 5e-3 }, { "grain_density", 2450 },
			{ "critical_density", 1485 }, { "static_friction", 0.3819 }, { "limit_friction", 0.6435 },
			{ "inertial_number", 0.278 }, { NULL, 0 } };
		law m = make_law(ids[MU_I], dim, values);
		cloud c = make_cloud(&m, 1);
		for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
			const double *v = rows[r];
			matrix stress = scaled(dim, -v[0], unit);
			stress.x[0][1] = stress.x[1][0] = v[1];
			put(dim, c.stress, 0, stress);
			c.density[0] = c.grid_density[0] = 1485;
			update(&m, &c, v[2]);
			const double tau = c.stress[dim == 2 ? 2 : 3][0],
						 rate = history(&c, "point.shear_rate")->real[0][0];
			printf(
				"  %uD p %-7g tau* %-6g dt %-6g: tau %.12g, rate %.12g\n", dim, v[0], v[1], v[2], tau, rate);
			worst = largest(worst, fabsl(tau / v[3] - 1));
			worst = largest(worst, v[4] > 0 ? fabsl(rate / v[4] - 1) : fabsl(rate));
		}
		free_cloud(&c), free_law(&m);
	}
	printf("  worst %.2Le\n", worst);
	assert_true(worst < 1e-11);
}

/* From any state the stress is R s R^T + elastic increment, returned along its deviator to p mu(I), p untouched. */
static void mu_i_states(void **unused) {
	(void)unused;
	const double dt = 1e-4;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		law m = usual_law(ids[MU_I], dim);
		cloud c = make_cloud(&m, POINTS), was = make_cloud(&m, POINTS);
		const wide mu_s = param(&m, "static_friction"), mu_2 = param(&m, "limit_friction");
		const wide i0 = param(&m, "inertial_number"), d = param(&m, "diameter");
		state = 88172645463325252u + dim;
		randomise(MU_I, &m, &was, 0.1);
		memcpy(c.memory, was.memory, was.cap * was.n_columns * sizeof(quern_real));
		update(&m, &c, dt);
		wide yield = 0, pressure = 0, stress = 0;
		int open = 0, flowing = 0;
		for (uint32_t i = 0; i < c.n; i++) {
			const matrix l = get_gradient(dim, &c, i), old = get(dim, was.stress, i),
						 now = get(dim, c.stress, i);
			const matrix w = scaled(dim, (wide)0.5, plus(dim, l, -1, transposed(l)));
			const matrix e = scaled(dim, (wide)0.5, plus(dim, l, 1, transposed(l)));
			const matrix r = times(inverse(dim, plus(dim, unit, -dt / 2, w)), plus(dim, unit, dt / 2, w));
			const wide lambda = m.bulk - 2 * (wide)m.shear / dim;
			matrix trial = plus(dim, times(times(r, old), transposed(r)), 2 * dt * (wide)m.shear, e);
			trial = plus(dim, trial, dt * lambda * trace(dim, l), unit);
			const wide p = -trace(dim, trial) / dim, tau = shear_of(dim, trial),
					   scale = norm(old) + m.bulk * dt * norm(l);
			if (was.density[i] < m.density || p <= 0) {
				if (fabsl(p) < 1e-15 * scale) continue;
				open++;
				assert_true(norm(now) == 0);
				assert_true(
					c.density[i] ==
					(was.density[i] >= m.density ? was.density[i] : fmin(c.grid_density[i], m.density)));
				continue;
			}
			assert_true(c.density[i] == was.density[i]);
			const wide now_p = -trace(dim, now) / dim, now_tau = shear_of(dim, now);
			const wide a = m.shear * i0 * dt * sqrtl(now_p / 2450) / d, s0 = mu_s * now_p, s2 = mu_2 * now_p;
			const wide rate = history(&c, "point.shear_rate")->real[0][i],
					   from = now_tau + m.shear * dt * rate;
			if (rate > 0) {
				flowing++;
				const wide residual = (now_tau - s0) * a - (s2 - now_tau) * (from - now_tau);
				yield = largest(yield, fabsl(residual / (a + (from - now_tau) + (s2 - now_tau)) / s2));
			} else assert_true(now_tau <= s0 * (1 + 1e-15L));
			const matrix back = plus(dim, scaled(dim, from / tau, deviator(dim, trial)), -p, unit);
			const matrix expected = plus(dim, scaled(dim, now_tau / from, deviator(dim, back)), -p, unit);
			pressure = largest(pressure, fabsl(now_p - p) / scale);
			stress = largest(stress, norm(plus(dim, now, -1, expected)) / scale);
		}
		printf("  %uD %d flow, %d open: yield %.2Le, pressure %.2Le, stress %.2Le\n", dim, flowing, open,
			yield, pressure, stress);
		assert_true(flowing > POINTS / 10 && open > POINTS / 10);
		assert_true(yield < 1e-12 && pressure < 1e-14 && stress < 1e-14);
		free_cloud(&c), free_cloud(&was), free_law(&m);
	}
}

/* From any state the strain is pushed forward, keeps its determinant through the return, and its stress is on the yield
 * surface or within; the largest root of the cubic is the one that leaves the strain positive. */
static void drucker_prager_states(void **unused) {
	(void)unused;
	const double dt = 1e-4;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		law m = usual_law(ids[DRUCKER_PRAGER], dim);
		cloud c = make_cloud(&m, POINTS), was = make_cloud(&m, POINTS);
		const wide alpha = sqrtl(2) * param(&m, "friction"), kappa = m.bulk, shear = m.shear;
		state = 88172645463325252u + dim;
		randomise(DRUCKER_PRAGER, &m, &was, 0.1);
		for (uint32_t i = 1; i < was.n; i += 8) { /* open ones */
			put(dim, history(&was, "point.deviator")->real, i, none);
			history(&was, "point.volume_strain")->real[0][i] = 0.1 * uniform();
		}
		memcpy(c.memory, was.memory, was.cap * was.n_columns * sizeof(quern_real));
		update(&m, &c, dt);
		wide yield = 0, strain = 0, det = 0, energy = 0, stress = 0, volume = 0;
		int open = 0, flowing = 0;
		for (uint32_t i = 0; i < c.n; i++) {
			const matrix f = plus(dim, unit, dt, get_gradient(dim, &c, i));
			const matrix dev = get(dim, history(&was, "point.deviator")->real, i);
			const matrix b = plus(dim, dev, 1 + isochoric(dim, dev), unit);
			const wide det_f = determinant(dim, f), e0 = history(&was, "point.volume_strain")->real[0][i];
			const wide j = (1 + e0) * det_f, p = kappa / 2 * (1 - j) * (1 + j);
			const matrix trial = scaled(dim, powl(det_f, -2.0L / dim), times(times(f, b), transposed(f)));
			const matrix dev_trial = deviator(dim, trial),
						 now = get(dim, history(&c, "point.deviator")->real, i);
			const double e = history(&c, "point.volume_strain")->real[0][i];
			if (fabsl(j - 1) < 1e-17) continue;
			if (j > 1) {
				open++;
				const double loose = fmin(c.grid_density[i], m.density);
				assert_true(norm(now) == 0 && norm(get(dim, c.stress, i)) == 0 && c.energy[i] == 0);
				assert_true(c.density[i] == loose && fabs((1 + e) * loose / m.density - 1) < 1e-15);
				continue;
			}
			assert_true(c.density[i] == was.density[i]);
			/* lambda_1 of the return by its own equation, from a third of the trial's trace */
			const wide second = fminl(1, alpha * p / (shear * norm(dev_trial))),
					   n2 = product(dev_trial, dev_trial);
			wide first = trace(dim, trial) / dim;
			for (int k = 0; k < 200; k++) {
				const wide cubic = first * first * first - second * second * n2 / 2 * first +
								   second * second * second * determinant(3, dev_trial) -
								   determinant(3, trial);
				first = dim == 2 ? sqrtl(minor2(trial) - second * second * minor2(dev_trial))
								 : first - cubic / (3 * first * first - second * second * n2 / 2);
			}
			const matrix returned = plus(dim, scaled(dim, second, dev_trial), first, unit);
			assert_true(positive(dim, returned));
			flowing += second < 1;
			const wide kirchhoff = (kappa / 2) * -(wide)e * (2 + (wide)e);
			if (second < 1) yield = largest(yield, fabsl(shear * norm(now) / (alpha * kirchhoff) - 1));
			else assert_true(shear * norm(now) <= alpha * kirchhoff * (1 + 1e-15L));
			/* gaps below 1e-18 are the reference's, which works with 1 + small */
			const wide gap = norm(plus(dim, now, -1, deviator(dim, returned))), gap_e = fabsl(e - (j - 1));
			const wide size = norm(dev) + dt * norm(get_gradient(dim, &c, i));
			strain = largest(strain, gap > 1e-18L ? gap / size : 0);
			volume = largest(volume, gap_e > 1e-18L ? gap_e / (fabsl(e0) + size) : 0);
			det = largest(det, fabsl(determinant(dim, returned) - 1));
			const wide w = kappa / 2 * volume_energy(e) + shear / 2 * dim * isochoric(dim, now);
			energy = largest(energy, fabsl(c.energy[i] * m.density / w - 1));
			const matrix tau = plus(dim, scaled(dim, shear, now), -kirchhoff, unit);
			stress =
				largest(stress, norm(plus(dim, get(dim, c.stress, i), -1 / (1 + (wide)e), tau)) / norm(tau));
			const matrix s = get(dim, c.stress, i);
			if (second < 1)
				yield = largest(yield, fabsl(norm(deviator(dim, s)) / (-alpha * trace(dim, s) / dim) - 1));
		}
		printf("  %uD %d flow, %d open: yield %.2Le, strain %.2Le, J - 1 %.2Le, det %.2Le, energy %.2Le, "
			   "stress %.2Le\n",
			dim, flowing, open, yield, strain, volume, det, energy, stress);
		assert_true(flowing > POINTS / 10 && open > POINTS / 10);
		assert_true(yield < 1e-12 && strain < 1e-14 && volume < 1e-14 && det < 1e-14 && stress < 1e-14 &&
					energy < 1e-13);
		free_cloud(&c), free_cloud(&was), free_law(&m);
	}
}

/* Over 21 decades of pressure the flow stress is a number between p mu_s and the smaller of p mu_2 and the trial. */
static void mu_i_range(void **unused) {
	(void)unused;
	for (int equal = 0; equal <= 1; equal++) {
		const value values[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 }, { "grain_density", 2450 },
			{ "critical_density", 1500 }, { "limit_friction", equal ? 0.3819 : 0.6435 }, { NULL, 0 } };
		law m = make_law(ids[MU_I], 3, values);
		cloud c = make_cloud(&m, POINTS);
		double *tau = calloc(POINTS, sizeof *tau), *p = calloc(POINTS, sizeof *p), worst = 0;
		assert_true(tau && p);
		const double mu_s = param(&m, "static_friction"), mu_2 = param(&m, "limit_friction");
		for (int decade = -9; decade <= 0; decade++) {
			const double dt = pow(10, decade);
			state = 88172645463325252u;
			for (uint32_t i = 0; i < c.n; i++) {
				p[i] = pow(10, between(-12, 9));
				tau[i] = p[i] * mu_s * (i % 2 ? pow(10, between(0, 20)) : 1 + pow(10, between(-16, 0)));
				matrix stress = scaled(3, -p[i], unit);
				stress.x[0][1] = stress.x[1][0] = tau[i];
				put(3, c.stress, i, stress);
				c.density[i] = c.grid_density[i] = 1500;
			}
			update(&m, &c, dt);
			for (uint32_t i = 0; i < c.n; i++) {
				const double low = mu_s * p[i], high = fmin(mu_2 * p[i], tau[i]), now = c.stress[3][i];
				const double out = fmax(low - now, now - high) / low;
				assert_true(isfinite(now) && isfinite(history(&c, "point.shear_rate")->real[0][i]));
				worst = fmax(worst, out);
			}
		}
		printf("  mu_2 %g: beyond the ends by at most %.2e of the yield stress\n", mu_2, worst);
		assert_true(worst <= 2 * 0x1p-52);
		free(tau), free(p), free_cloud(&c), free_law(&m);
	}
}

/* Friction that falls with the rate, and a bed denser than its grains, are refused. */
static void refusals(void **unused) {
	(void)unused;
	const value falling[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 }, { "grain_density", 2450 },
		{ "critical_density", 1500 }, { "static_friction", 0.7 }, { NULL, 0 } };
	const value dense[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 }, { "grain_density", 2450 },
		{ "critical_density", 2500 }, { NULL, 0 } };
	law m;
	assert_int_equal(try_law(&m, ids[MU_I], 3, falling), QUERN_E_PARAM);
	free_law(&m);
	assert_int_equal(try_law(&m, ids[MU_I], 2, dense), QUERN_E_PARAM);
	free_law(&m);
}

static void turn_columns(uint32_t dim, matrix r, quern_real *const *columns, uint32_t i) {
	put(dim, columns, i, times(times(r, get(dim, columns, i)), transposed(r)));
}

/* Seen by a turned observer the answer is the turned answer. */
static void objectivity(void **unused) {
	(void)unused;
	for (int which = 0; which < MATERIALS; which++)
		for (uint32_t dim = 2; dim <= 3; dim++) {
			law m = usual_law(ids[which], dim);
			cloud c = make_cloud(&m, POINTS), turned = make_cloud(&m, POINTS);
			state = 88172645463325252u + dim;
			randomise(which, &m, &c, 0.01);
			memcpy(turned.memory, c.memory, c.cap * c.n_columns * sizeof(quern_real));
			matrix *r = calloc(POINTS, sizeof *r);
			double *before = calloc(POINTS, sizeof *before);
			assert_true(r && before);
			for (uint32_t i = 0; i < c.n; i++) {
				r[i] = random_rotation(dim);
				const matrix l = get_gradient(dim, &c, i);
				before[i] = (double)(norm(get(dim, c.stress, i)) + m.bulk * 1e-4 * norm(l));
				turn_columns(dim, r[i], turned.stress, i);
				if (which == DRUCKER_PRAGER)
					turn_columns(dim, r[i], history(&turned, "point.deviator")->real, i);
				put_gradient(dim, &turned, i, times(times(r[i], l), transposed(r[i])));
			}
			update(&m, &c, 1e-4), update(&m, &turned, 1e-4);
			wide worst = 0;
			for (uint32_t i = 0; i < c.n; i++) {
				turn_columns(dim, r[i], c.stress, i);
				const matrix gap = plus(dim, get(dim, c.stress, i), -1, get(dim, turned.stress, i));
				worst = largest(worst, norm(gap) / before[i]);
			}
			printf("  %-24s %uD: %.2Le\n", ids[which], dim, worst);
			assert_true(worst < 1e-12);
			free(r), free(before), free_cloud(&c), free_cloud(&turned), free_law(&m);
		}
}

/* Ten thousand steps of pure spin, small and large, keep the deviator's size and the pressure. */
static void spin(void **unused) {
	(void)unused;
	for (int which = 0; which < MATERIALS; which += ELASTIC)
		for (uint32_t dim = 2; dim <= 3; dim++) {
			law m = usual_law(ids[which], dim);
			cloud c = make_cloud(&m, 64);
			wide dev[64], p[64], worst = 0, worst_p = 0;
			state = 88172645463325252u + dim;
			for (uint32_t i = 0; i < c.n; i++) {
				const matrix a = random_matrix(dim, 1e4 * sized(-14, -2));
				put(dim, c.stress, i, plus(dim, random_deviator(dim, 2e3 * between(0.1, 1)), -1e4, unit));
				put_gradient(dim, &c, i, plus(dim, a, -1, transposed(a)));
				c.density[i] = c.grid_density[i] = 1500;
				dev[i] = shear_of(dim, get(dim, c.stress, i));
				p[i] = -trace(dim, get(dim, c.stress, i)) / dim;
			}
			for (int step = 0; step < 10000; step++) update(&m, &c, 1e-4);
			for (uint32_t i = 0; i < c.n; i++) {
				const matrix now = get(dim, c.stress, i);
				worst = largest(worst, fabsl(shear_of(dim, now) / dev[i] - 1));
				worst_p = largest(worst_p, fabsl(-trace(dim, now) / dim / p[i] - 1));
			}
			printf("  %-24s %uD: deviator %.2Le, pressure %.2Le\n", ids[which], dim, worst, worst_p);
			assert_true(worst < 1e-12 && worst_p < 1e-12);
			free_cloud(&c), free_law(&m);
		}
}

/* A stress that the material can carry is kept and read back by a step at rest, with the density that belongs to it; any
 * other comes back on the yield surface; tension is clipped. */
static void state_from_stress(void **unused) {
	(void)unused;
	for (int which = 0; which < MATERIALS; which++)
		for (uint32_t dim = 2; dim <= 3; dim++) {
			law m = usual_law(ids[which], dim);
			cloud c = make_cloud(&m, POINTS);
			matrix *given = calloc(POINTS, sizeof *given);
			assert_non_null(given);
			const double slow = which == MU_I ? param(&m, "static_friction") : 0;
			const double mu = which == MU_I             ? param(&m, "limit_friction")
							  : which == DRUCKER_PRAGER ? param(&m, "friction")
														: 1e30;
			state = 88172645463325252u + dim;
			for (uint32_t i = 0; i < c.n; i++) {
				const double p = (i % 5 ? 1 : -1) * m.bulk * sized(-40, -4);
				const matrix s = random_deviator(dim, fabs(p) * between(0, i % 2 ? 1.5 : 0.25));
				put(dim, c.stress, i, plus(dim, s, -p, unit));
				given[i] = get(dim, c.stress, i);
				c.grid_density[i] = 1500;
			}
			assign(&m, &c);
			wide kept = 0, yield = 0, density = 0, back = 0, mean = 0;
			int held = 0, clipped = 0, returned = 0;
			for (uint32_t i = 0; i < c.n; i++) {
				const matrix now = get(dim, c.stress, i);
				const wide p = -trace(dim, given[i]) / dim, tau = shear_of(dim, given[i]);
				const wide x = p / m.bulk, j = sqrtl(1 + x * x) - x;
				const bool tension = which != ELASTIC && p <= 0;
				const wide rho =
					tension ? m.density : m.density * (which == DRUCKER_PRAGER ? 1 / j : expl(x));
				density = largest(density, fabsl(c.density[i] / rho - 1));
				if (tension) {
					clipped++;
					assert_true(norm(now) == 0);
				} else if (tau <= mu * p || which == ELASTIC) {
					held++;
					kept = largest(kept, norm(plus(dim, now, -1, given[i])) / norm(given[i]));
				} else {
					returned++;
					yield = largest(yield, fabsl(shear_of(dim, now) / (mu * p) - 1));
					mean = largest(mean, fabsl(trace(dim, now) / dim / p + 1));
				}
				given[i] = now;
			}
			update(&m, &c, 1e-4); /* at rest */
			for (uint32_t i = 0; i < c.n; i++) {
				const wide size = norm(given[i]),
						   slack = shear_of(dim, given[i]) + slow * trace(dim, given[i]) / dim;
				if (which == MU_I && slack > 0) continue; /* flows on */
				if (size > 0)
					back = largest(back, norm(plus(dim, get(dim, c.stress, i), -1, given[i])) / size);
				else assert_true(norm(get(dim, c.stress, i)) == 0);
			}
			printf("  %-24s %uD %d kept: %.2Le, %d returned: yield %.2Le, pressure %.2Le, %d clipped; "
				   "density %.2Le, "
				   "a step later %.2Le\n",
				ids[which], dim, held, kept, returned, yield, mean, clipped, density, back);
			assert_true(held > POINTS / 4 && kept < 1e-12 && yield < 1e-12 && mean < 1e-14);
			assert_true(density < 1e-14 && back < 1e-12);
			assert_true(which == ELASTIC || (returned > POINTS / 10 && clipped > POINTS / 10));
			free(given), free_cloud(&c), free_law(&m);
		}
}

/* A point pulled apart is open until the grid is dense again, however it was pressed meanwhile, and closes without a
 * ghost volume: its pressure is that of its density. */
static void opening(void **unused) {
	(void)unused;
	for (int which = 0; which < ELASTIC; which++)
		for (uint32_t dim = 2; dim <= 3; dim++) {
			law m = usual_law(ids[which], dim);
			cloud c = make_cloud(&m, 2);
			const double rate = 1e-3, dt = 1;
			const double fastest = sqrt((m.bulk + 2.0 * (dim - 1) / dim * m.shear) / m.density) * (1 + 1e-15);
			for (uint32_t i = 0; i < 2; i++) put(dim, c.stress, i, scaled(dim, -2e5, unit));
			assign(&m, &c);
			double dense = c.density[0];
			for (int step = 0; step < 420; step++) {
				const double strain = step < 200 ? rate : -rate;
				matrix l = scaled(dim, strain / dt, unit);
				l.x[0][1] = 0.3 * rate / dt;
				const wide det = determinant(dim, plus(dim, unit, dt, l));
				dense = (double)(dense / det);
				for (uint32_t i = 0; i < 2; i++) {
					put_gradient(dim, &c, i, l);
					c.density[i] = (double)(c.density[i] / det);
				}
				/* the grid sees the one point's true density; the other's neighbours stay away for longer */
				c.grid_density[0] = dense;
				c.grid_density[1] = step < 410 ? fmin(dense, 0.8 * m.density) : dense;
				update(&m, &c, dt);
				for (uint32_t i = 0; i < 2; i++) {
					const bool open = norm(get(dim, c.stress, i)) == 0;
					assert_true(c.wave_speed[i] <= fastest);
					if (step > 10 && c.grid_density[i] < m.density * (1 - 1e-9)) {
						assert_true(open);
						assert_true(fabs(c.density[i] / c.grid_density[i] - 1) < 1e-12);
					}
				}
			}
			const double p = (double)(-trace(dim, get(dim, c.stress, 0)) / dim), j = m.density / dense;
			const double expected = which == DRUCKER_PRAGER ? m.bulk / 2 * (1 / j - j) : m.bulk * log(1 / j);
			const double late = (double)(-trace(dim, get(dim, c.stress, 1)) / dim);
			printf("  %-24s %uD: pressure %.6g, of its density %.6g; closed late %.6g\n", ids[which], dim, p,
				expected, late);
			assert_true(
				p > 0 && fabs(p - expected) < (which == DRUCKER_PRAGER ? 1e-9 * p : dim * rate * m.bulk));
			assert_true(fabs(c.density[0] / dense - 1) < 1e-12);
			free_cloud(&c), free_law(&m);
		}
}

/* Bits depend neither on how points are cut into batches nor on what the spare lanes hold, nor on which outputs are
 * wanted. */
static void batches(void **unused) {
	(void)unused;
	enum { N = 64 * 21 };
	static const uint32_t pieces[] = { 1, 7, 64, N };
	for (int which = 0; which < MATERIALS; which++)
		for (uint32_t dim = 2; dim <= 3; dim++)
			for (int hook = 0; hook <= QUERN_MATERIAL_ASSIGN; hook++) {
				law m = usual_law(ids[which], dim);
				cloud start = make_cloud(&m, N), whole = make_cloud(&m, N);
				const size_t bytes = start.cap * start.n_columns * sizeof(quern_real);
				state = 88172645463325252u + dim;
				randomise(which, &m, &start, 0.1);
				memcpy(whole.memory, start.memory, bytes);
				call(&m, &whole, hook, 1e-4, 0, N);
				for (size_t k = 0; k < sizeof pieces / sizeof *pieces; k++) {
					const uint32_t n = pieces[k];
					cloud part = make_cloud(&m, n);
					for (uint32_t first = 0; first < N; first += n) {
						const uint32_t here = first + n <= N ? n : N - first;
						const bool mute = (first / n) % 2;
						quern_real *speed = part.wave_speed, *energy = part.energy;
						for (uint32_t q = 0; q < part.n_columns; q++)
							for (uint32_t i = 0; i < part.cap; i++)
								part.memory[q * part.cap + i] =
									i < here ? start.memory[q * start.cap + first + i] : (quern_real)NAN;
						part.wave_speed = mute ? NULL : speed, part.energy = mute ? NULL : energy;
						call(&m, &part, hook, 1e-4, 0, here);
						part.wave_speed = speed, part.energy = energy;
						for (uint32_t q = 0; q < part.n_columns; q++) {
							const quern_real *now = part.memory + q * part.cap,
											 *then = whole.memory + q * whole.cap + first;
							if (mute && (now == speed || now == energy)) continue;
							assert_int_equal(memcmp(now, then, here * sizeof *now), 0);
						}
					}
					free_cloud(&part);
				}
				free_cloud(&start), free_cloud(&whole), free_law(&m);
			}
}

/* The hyperelastic stress is the derivative of the stored energy: rho_0 dE = J sigma:L dt along any elastic increment. */
static void energy_derivative(void **unused) {
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		law m = usual_law(ids[DRUCKER_PRAGER], dim);
		cloud at = make_cloud(&m, 1000), up = make_cloud(&m, 1000), down = make_cloud(&m, 1000);
		const size_t bytes = at.cap * at.n_columns * sizeof(quern_real);
		const double h = 1e-5, mu = param(&m, "friction");
		state = 88172645463325252u + dim;
		for (uint32_t i = 0; i < at.n; i++) {
			const double p = m.bulk * between(0.01, 0.5);
			put(dim, at.stress, i, plus(dim, random_deviator(dim, 0.9 * mu * p * uniform()), -p, unit));
			put_gradient(dim, &at, i, random_matrix(dim, 1));
		}
		assign(&m, &at);
		memcpy(up.memory, at.memory, bytes), memcpy(down.memory, at.memory, bytes);
		update(&m, &up, h), update(&m, &down, -h);
		wide worst = 0;
		for (uint32_t i = 0; i < at.n; i++) {
			const wide j = 1 + (wide)history(&at, "point.volume_strain")->real[0][i];
			const matrix s = get(dim, at.stress, i), l = get_gradient(dim, &at, i);
			const wide slope = m.density * ((wide)up.energy[i] - down.energy[i]) / (2 * h);
			worst = largest(worst, fabsl(slope - j * product(s, l)) / (j * norm(s) * norm(l)));
		}
		printf("  %uD: %.2Le\n", dim, worst);
		assert_true(worst < 1e-6);
		free_cloud(&at), free_cloud(&up), free_cloud(&down), free_law(&m);
	}
}

/* The stored energy of a hypoelastic point is what elastic work put in, to the order of the strain. */
static void hypoelastic_energy(void **unused) {
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		law m = usual_law(ids[ELASTIC], dim);
		cloud c = make_cloud(&m, 1);
		const int steps = 1000;
		wide work = 0;
		matrix before = none;
		state = 88172645463325252u + dim;
		const matrix l = random_matrix(dim, 1e-6);
		c.density[0] = c.grid_density[0] = m.density;
		put_gradient(dim, &c, 0, l);
		for (int step = 0; step < steps; step++) {
			update(&m, &c, 1);
			work += product(plus(dim, get(dim, c.stress, 0), 1, before), l) / 2 / m.density;
			before = get(dim, c.stress, 0);
		}
		const wide gap = fabsl(c.energy[0] / work - 1);
		printf("  %uD: %.2Le at a strain of %.1Le\n", dim, gap, norm(l) * steps);
		assert_true(gap < 1e-3);
		free_cloud(&c), free_law(&m);
	}
}

/* Steady simple shear at constant pressure has tau/p = mu(I), over eight decades of rate. */
static void simple_shear(void **unused) {
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const value values[] = { { "bulk_modulus", 1e10 }, { "diameter", 5e-3 }, { "grain_density", 2450 },
			{ "critical_density", 1500 }, { NULL, 0 } };
		law m = make_law(ids[MU_I], dim, values);
		cloud c = make_cloud(&m, 1);
		const double p = 1000, mu_s = param(&m, "static_friction"), mu_2 = param(&m, "limit_friction");
		for (int decade = -4; decade <= 4; decade += 2) {
			const double rate = pow(10, decade), dt = 1e-6 / rate;
			put(dim, c.stress, 0, scaled(dim, -p, unit));
			matrix l = none;
			l.x[0][1] = rate;
			put_gradient(dim, &c, 0, l);
			c.density[0] = c.grid_density[0] = 1500;
			for (int step = 0; step < 20000; step++) update(&m, &c, dt);
			const matrix s = get(dim, c.stress, 0);
			const double number = rate * 5e-3 * sqrt(2450 / p);
			const double mu = mu_s + (mu_2 - mu_s) / (1 + param(&m, "inertial_number") / number);
			const double found = (double)(shear_of(dim, s) / (-trace(dim, s) / dim));
			const double flow = history(&c, "point.shear_rate")->real[0][0] / rate - 1;
			printf("  %uD I %-8.3g mu %.12g: off by %.2e, rate by %.2e\n", dim, number, mu, found / mu - 1,
				flow);
			assert_true(fabs(found / mu - 1) < 1e-10 && fabs(flow) < 1e-8);
		}
		free_cloud(&c), free_law(&m);
	}
}

/* The pull towards the equation of state is exact in time, added to the elastic rate, and takes no deviator. */
static void pressure_rate(void **unused) {
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const value values[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 }, { "grain_density", 2450 },
			{ "critical_density", 1500 }, { "pressure_rate", 10 }, { NULL, 0 } };
		law m = make_law(ids[MU_I], dim, values);
		cloud once = make_cloud(&m, 2), twice = make_cloud(&m, 2);
		cloud *const both[] = { &once, &twice };
		for (int k = 0; k < 2; k++)
			for (uint32_t i = 0; i < 2; i++) {
				matrix stress = scaled(dim, -1e5, unit);
				stress.x[0][1] = stress.x[1][0] = 1e3;
				put(dim, both[k]->stress, i, stress);
				both[k]->density[i] = both[k]->grid_density[i] = i ? 1510 : 1500;
			}
		update(&m, &once, 0.1), update(&m, &twice, 0.05), update(&m, &twice, 0.05);
		for (uint32_t i = 0; i < 2; i++) {
			const matrix a = get(dim, once.stress, i), b = get(dim, twice.stress, i);
			const double p = (double)(-trace(dim, a) / dim), target = i ? 1e8 * log(1510 / 1500.0) : 0;
			const double expected = target + (1e5 - target) * exp(-1);
			printf("  %uD: %.12g of %.12g Pa, in two steps off by %.2Le\n", dim, p, expected,
				norm(plus(dim, a, -1, b)) / norm(a));
			assert_true(fabs(p / expected - 1) < 1e-12 && norm(plus(dim, a, -1, b)) < 1e-12 * norm(a));
			assert_true(fabsl(a.x[0][1] / 1e3 - 1) < 1e-15);
		}
		free_cloud(&once), free_cloud(&twice), free_law(&m);
	}
}

/* Without yield a uniaxial strain meets the longitudinal modulus, pulled as well as pressed, and a point at rest keeps its
 * bits. */
static void elastic_modulus(void **unused) {
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		law m = usual_law(ids[ELASTIC], dim);
		cloud c = make_cloud(&m, 2);
		const double modulus = m.bulk + 2.0 * (dim - 1) / dim * m.shear;
		for (uint32_t i = 0; i < 2; i++) {
			matrix l = none;
			l.x[0][0] = i ? 1e-5 : -1e-5;
			put_gradient(dim, &c, i, l);
			c.density[i] = 1500;
		}
		for (int step = 0; step < 100; step++) update(&m, &c, 1);
		for (uint32_t i = 0; i < 2; i++) {
			assert_true(fabs(c.stress[0][i] / ((i ? 1e-3 : -1e-3) * modulus) - 1) < 1e-13);
			assert_true(fabs(c.wave_speed[i] / sqrt(modulus / 1500) - 1) < 1e-15);
			put_gradient(dim, &c, i, none);
		}
		const double was[] = { c.stress[0][0], c.stress[1][0], c.stress[0][1], c.stress[1][1] };
		update(&m, &c, 1);
		const double now[] = { c.stress[0][0], c.stress[1][0], c.stress[0][1], c.stress[1][1] };
		assert_memory_equal(was, now, sizeof was);
		free_cloud(&c), free_law(&m);
	}
}

/* One number for everything the materials compute on a fixed random set: the same for any compiler and processor. */
static void bits(void **unused) {
	(void)unused;
	for (int which = 0; which < MATERIALS; which++) {
		uint64_t hash = 14695981039346656037u;
		for (uint32_t dim = 2; dim <= 3; dim++)
			for (int rate = 0; rate <= (which == MU_I); rate++) {
				const value values[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 },
					{ "grain_density", 2450 }, { "critical_density", 1500 }, { "density", 1500 },
					{ "pressure_rate", 10 * rate }, { NULL, 0 } };
				law m = make_law(ids[which], dim, values);
				cloud c = make_cloud(&m, POINTS);
				state = 88172645463325252u + dim;
				randomise(which, &m, &c, 0.1);
				for (int step = 0; step < 3; step++) update(&m, &c, 1e-4);
				for (uint32_t q = 0; q < c.n_columns; q++)
					for (uint32_t i = 0; i < c.n; i++) {
						uint64_t word;
						const quern_real x = c.memory[q * c.cap + i];
						assert_true(isfinite(x));
						memcpy(&word, &x, sizeof word);
						hash = (hash ^ word) * 1099511628211u;
					}
				free_cloud(&c), free_law(&m);
			}
		printf("  %-24s %016llx\n", ids[which], (unsigned long long)hash);
	}
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(vectors), cmocka_unit_test(mu_i_states),
		cmocka_unit_test(drucker_prager_states), cmocka_unit_test(mu_i_range), cmocka_unit_test(refusals),
		cmocka_unit_test(objectivity), cmocka_unit_test(spin), cmocka_unit_test(state_from_stress),
		cmocka_unit_test(opening), cmocka_unit_test(batches), cmocka_unit_test(energy_derivative),
		cmocka_unit_test(hypoelastic_energy), cmocka_unit_test(simple_shear), cmocka_unit_test(pressure_rate),
		cmocka_unit_test(elastic_modulus), cmocka_unit_test(bits) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
