/* SPDX-License-Identifier: MIT */
/* The materials alone, over steps and as programs: what must hold for any of them, whoever looks, however points are
 * cut into batches and whatever the compiler. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "material_kit.h"
#include <level.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void turn_columns(uint32_t dim, matrix r, quern_real *const *columns, uint32_t i) {
	put(dim, columns, i, times(times(r, get(dim, columns, i)), transposed(r)));
}

/* Seen by a turned observer the answer is the turned answer. */
static void objectivity(void **unused) {
	(void)unused;
	char what[80];
	table_head("objectivity: worst relative gap");
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
				put_gradient(dim, &turned, i, times(times(r[i], l), transposed(r[i])));
			}
			update(&m, &c, 1e-4), update(&m, &turned, 1e-4);
			wide worst = 0;
			for (uint32_t i = 0; i < c.n; i++) {
				turn_columns(dim, r[i], c.stress, i);
				const matrix gap = plus(dim, get(dim, c.stress, i), -1, get(dim, turned.stress, i));
				worst = largest(worst, norm(gap) / before[i]);
			}
			snprintf(what, sizeof what, "%s, %uD", ids[which], dim);
			assert_true(table_row(what, (double)worst, 0, 1e-12));
			free(r), free(before), free_cloud(&c), free_cloud(&turned), free_law(&m);
		}
}

/* Ten thousand steps of pure spin, small and large, keep the deviator's size and the pressure. */
static void spin(void **unused) {
	(void)unused;
	char what[80];
	table_head("spin for ten thousand steps: change");
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
			snprintf(what, sizeof what, "%s, %uD: deviator", ids[which], dim);
			const bool good = table_row(what, (double)worst, 0, 1e-12);
			assert_true(table_row("  pressure", (double)worst_p, 0, 1e-12) && good);
			free_cloud(&c), free_law(&m);
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

/* Steady simple shear at constant pressure has tau/p = mu(I), over eight decades of rate. */
static void simple_shear(void **unused) {
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const alone_value values[] = { { "bulk_modulus", 1e10 }, { "diameter", 5e-3 },
			{ "grain_density", 2450 }, { "critical_density", 1500 }, { NULL, 0 } };
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
		const alone_value values[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 },
			{ "grain_density", 2450 }, { "critical_density", 1500 }, { "pressure_rate", 10 }, { NULL, 0 } };
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

static uint64_t hash_of_cloud(const cloud *c, uint64_t hash) {
	for (uint32_t q = 0; q < c->n_columns; q++)
		for (uint32_t i = 0; i < c->n; i++) {
			uint64_t word;
			const quern_real x = c->memory[q * c->cap + i];
			assert_true(isfinite(x));
			memcpy(&word, &x, sizeof word);
			hash = (hash ^ word) * 1099511628211u;
		}
	return hash;
}

/* One number for everything that a material computes on a fixed random set. */
static uint64_t hash_of(int which) {
	uint64_t hash = 14695981039346656037u;
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int rate = 0; rate <= 2 * (which == MU_I);
			 rate++) { /* the last one goes to a density of its own */
			const alone_value values[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 },
				{ "grain_density", 2450 }, { "critical_density", 1500 }, { "density", 1500 },
				{ "pressure_rate", 10 * (rate == 1) }, { "flow_density", 1510 * (rate == 2) },
				{ "dilation", 0.4 * (rate == 2) }, { NULL, 0 } };
			law m = make_law(ids[which], dim, values);
			cloud c = make_cloud(&m, POINTS);
			state = 88172645463325252u + dim;
			randomise(which, &m, &c, 0.1);
			for (int step = 0; step < 3; step++) update(&m, &c, 1e-4);
			hash = hash_of_cloud(&c, hash);
			free_cloud(&c), free_law(&m);
		}
	return hash;
}

/* Objects of all instruction sets that this processor has and the folder holds give the same number as the first one; how
 * many there are. */
static int same_hash(int which, const char *folder, uint64_t *hash) {
	int n = 0;
	for (int level = 1; level <= quern_level_here(); level++) {
		char name[16], path[4096];
		snprintf(name, sizeof name, "v%d", level);
		snprintf(path, sizeof path, level > 1 ? "%s/%s.%s.so" : "%s/%s.so", folder, ids[which], name);
		if (access(path, R_OK)) continue;
		setenv("QUERN_PLUGINS_DIR", folder, 1), setenv("QUERN_PLUGINS_LEVEL", name, 1);
		const uint64_t found = hash_of(which);
		printf("  %-24s %016llx %s\n", ids[which], (unsigned long long)found, path);
		if (!*hash) *hash = found;
		if (found != *hash) fail_msg("%s: other bits", path);
		n++;
	}
	return n;
}

/* The plugins beside the program of another compiler, if QUERN_OTHER names one. */
static const char *other_folder(char folder[4096]) {
	const char *other = getenv("QUERN_OTHER"), *slash = other ? strrchr(other, '/') : NULL;
	if (!slash) return NULL;
	snprintf(folder, 4096, "%.*s/plugins", (int)(slash - other), other);
	return folder;
}

/* The same bits for every instruction set of this processor, and for another compiler's objects. */
static void bits(void **unused) {
	(void)unused;
	char folder[4096], other[4096];
	snprintf(folder, sizeof folder, "%s", getenv("QUERN_PLUGINS_DIR"));
	if (!other_folder(other)) printf("  QUERN_OTHER names no program of another compiler: not compared\n");
	for (int which = 0; which < MATERIALS; which++) {
		uint64_t hash = 0;
		assert_true(same_hash(which, folder, &hash) > 0);
		if (other_folder(other)) assert_true(same_hash(which, other, &hash) > 0);
	}
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(objectivity), cmocka_unit_test(spin),
		cmocka_unit_test(opening), cmocka_unit_test(batches), cmocka_unit_test(simple_shear),
		cmocka_unit_test(pressure_rate), cmocka_unit_test(bits) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
