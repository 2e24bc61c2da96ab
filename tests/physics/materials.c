/* SPDX-License-Identifier: MIT */
/* The materials alone, point by point: against vectors, against the formulas of docs/theory/materials.md in long
 * double, and back from a stress. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "material_kit.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The implicit mu(I) update gives the published scheme's stress and plastic rate. */
static void vectors(void **unused) {
	static const double rows[][5] = { { 1000, 500, 1e-6, 399.778673007, 2.60575450181 },
		{ 1000, 5000, 1e-5, 447.285685918, 11.8370572166 }, { 10, 1000, 1e-5, 4.92141599775, 2.58720431841 },
		{ 1e5, 4.5e4, 3e-6, 40682.8748968, 37.4150842279 }, { 1000, 381, 1e-6, 381, 0 } };
	(void)unused;
	wide worst = 0;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const double shear = 1e8 / 2.6, bulk = dim == 3 ? 1e8 / 1.2 : shear * 1.3 / 0.7;
		const alone_value values[] = { { "bulk_modulus", bulk }, { "diameter", 5e-3 },
			{ "grain_density", 2450 }, { "critical_density", 1485 }, { "static_friction", 0.3819 },
			{ "limit_friction", 0.6435 }, { "inertial_number", 0.278 }, { NULL, 0 } };
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
	table_head("mu(I) against numbers of the published scheme");
	assert_true(table_row("worst relative gap, of twelve digits", (double)worst, 0, 1e-11));
}

/* From any state the stress is R s R^T + elastic increment, returned along its deviator to p mu(I), p untouched. */
static void mu_i_states(void **unused) {
	(void)unused;
	const double dt = 1e-4;
	char what[80];
	table_head("return to the yield stress: worst relative gap");
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
		snprintf(what, sizeof what, "mu_i, %uD: yield (%d of %d flow, %d open)", dim, flowing, POINTS, open);
		bool good = table_row(what, (double)yield, 0, 1e-12);
		good &= table_row("  pressure", (double)pressure, 0, 1e-14);
		good &= table_row("  stress", (double)stress, 0, 1e-14);
		assert_true(good && flowing > POINTS / 10 && open > POINTS / 10);
		free_cloud(&c), free_cloud(&was), free_law(&m);
	}
}

/* From any state the strain is pushed forward, keeps its determinant through the return, and its stress is on the yield
 * surface or within; the largest root of the cubic is the one that leaves the strain positive. */
static void drucker_prager_states(void **unused) {
	(void)unused;
	const double dt = 1e-4;
	char what[80];
	table_head("return to the yield stress: worst relative gap");
	for (uint32_t dim = 2; dim <= 3; dim++) {
		law m = usual_law(ids[DRUCKER_PRAGER], dim);
		cloud c = make_cloud(&m, POINTS), was = make_cloud(&m, POINTS);
		const wide alpha = sqrtl(2) * param(&m, "friction"), kappa = m.bulk, shear = m.shear;
		state = 88172645463325252u + dim;
		randomise(DRUCKER_PRAGER, &m, &was, 0.1);
		for (uint32_t i = 1; i < was.n; i += 8) { /* open ones */
			put(dim, was.stress, i, none);
			history(&was, "point.volume_strain")->real[0][i] = 0.1 * uniform();
		}
		memcpy(c.memory, was.memory, was.cap * was.n_columns * sizeof(quern_real));
		update(&m, &c, dt);
		wide yield = 0, strain = 0, det = 0, energy = 0, stress = 0, volume = 0;
		int open = 0, flowing = 0;
		for (uint32_t i = 0; i < c.n; i++) {
			const matrix f = plus(dim, unit, dt, get_gradient(dim, &c, i));
			const wide det_f = determinant(dim, f), e0 = history(&was, "point.volume_strain")->real[0][i];
			const matrix dev = scaled(dim, (1 + e0) / shear, deviator(dim, get(dim, was.stress, i)));
			const matrix b = plus(dim, dev, 1 + isochoric(dim, dev), unit);
			const wide j = (1 + e0) * det_f, p = kappa / 2 * (1 - j) * (1 + j);
			const matrix trial = scaled(dim, powl(det_f, -2.0L / dim), times(times(f, b), transposed(f)));
			const double e = history(&c, "point.volume_strain")->real[0][i];
			const matrix dev_trial = deviator(dim, trial),
						 now = scaled(dim, (1 + (wide)e) / shear, deviator(dim, get(dim, c.stress, i)));
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
			flowing += second < 1;
			const wide kirchhoff = (kappa / 2) * -(wide)e * (2 + (wide)e);
			if (second < 1) yield = largest(yield, fabsl(shear * norm(now) / (alpha * kirchhoff) - 1));
			else assert_true(shear * norm(now) <= alpha * kirchhoff * (1 + 1e-15L));
			/* gaps below 1e-18 are the reference's, which works with 1 + small */
			const wide gap = norm(plus(dim, now, -1, deviator(dim, returned))), gap_e = fabsl(e - (j - 1));
			/* of the strain, not of its deviator alone: that is a part of the stress, which is kept to its own round-off */
			const wide size = norm(dev) + fabsl(e0) + dt * norm(get_gradient(dim, &c, i));
			strain = largest(strain, gap > 1e-18L ? gap / size : 0);
			volume = largest(volume, gap_e > 1e-18L ? gap_e / size : 0);
			const wide of_volume = kappa / 2 * volume_energy(e), of_shape = shear / 2 * dim,
					   w = of_volume + of_shape * isochoric(dim, now), stored = c.energy[i] * m.density;
			energy = largest(energy, fabsl(stored / w - 1));
			/* the strain whose trace is what the stored energy says */
			const matrix kept = plus(dim, now, 1 + (stored - of_volume) / of_shape, unit);
			det = largest(det, fabsl(determinant(dim, kept) - 1));
			assert_true(positive(dim, kept));
			const matrix tau = plus(dim, scaled(dim, shear, now), -kirchhoff, unit);
			stress =
				largest(stress, norm(plus(dim, get(dim, c.stress, i), -1 / (1 + (wide)e), tau)) / norm(tau));
			const matrix s = get(dim, c.stress, i);
			if (second < 1)
				yield = largest(yield, fabsl(norm(deviator(dim, s)) / (-alpha * trace(dim, s) / dim) - 1));
		}
		snprintf(what, sizeof what, "drucker_prager, %uD: yield (%d of %d flow, %d open)", dim, flowing,
			POINTS, open);
		bool good = table_row(what, (double)yield, 0, 1e-12);
		good &= table_row("  deviator of the strain", (double)strain, 0, 1e-14);
		good &= table_row("  J - 1", (double)volume, 0, 1e-14);
		good &= table_row("  determinant of the strain", (double)det, 0, 1e-14);
		good &= table_row("  energy", (double)energy, 0, 1e-13);
		good &= table_row("  stress", (double)stress, 0, 1e-14);
		assert_true(good && flowing > POINTS / 10 && open > POINTS / 10);
		free_cloud(&c), free_cloud(&was), free_law(&m);
	}
}

/* Over 21 decades of pressure the flow stress is a number between p mu_s and the smaller of p mu_2 and the trial. */
static void flow_stays_between(uint32_t dim, double limit_friction) {
	const alone_value values[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 }, { "grain_density", 2450 },
		{ "critical_density", 1500 }, { "static_friction", 0.3819 }, { "limit_friction", limit_friction },
		{ NULL, 0 } };
	law m = make_law(ids[MU_I], dim, values);
	cloud c = make_cloud(&m, POINTS);
	double *tau = calloc(POINTS, sizeof *tau), *p = calloc(POINTS, sizeof *p), worst = 0;
	assert_true(tau && p);
	for (int decade = -9; decade <= 0; decade++) {
		state = 88172645463325252u;
		for (uint32_t i = 0; i < c.n; i++) {
			p[i] = pow(10, between(-12, 9));
			tau[i] = p[i] * 0.3819 * (i % 2 ? pow(10, between(0, 20)) : 1 + pow(10, between(-16, 0)));
			matrix stress = scaled(dim, -p[i], unit);
			stress.x[0][1] = stress.x[1][0] = tau[i];
			put(dim, c.stress, i, stress);
			c.density[i] = c.grid_density[i] = 1500;
		}
		update(&m, &c, pow(10, decade));
		for (uint32_t i = 0; i < c.n; i++) {
			const double low = 0.3819 * p[i], high = fmin(limit_friction * p[i], tau[i]),
						 now = c.stress[dim == 3 ? 3 : 2][i];
			assert_true(isfinite(now) && isfinite(history(&c, "point.shear_rate")->real[0][i]));
			worst = fmax(worst, fmax(low - now, now - high) / low);
		}
	}
	printf(
		"  %uD, mu_2 %g: beyond the ends by at most %.2e of the yield stress\n", dim, limit_friction, worst);
	assert_true(worst <= 2 * 0x1p-52);
	free(tau), free(p), free_cloud(&c), free_law(&m);
}

static void mu_i_range(void **unused) {
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (int equal = 0; equal <= 1; equal++) flow_stays_between(dim, equal ? 0.3819 : 0.6435);
}

/* Friction that falls with the rate, and a bed denser than its grains, are refused. */
static void refusals(void **unused) {
	(void)unused;
	const alone_value falling[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 }, { "grain_density", 2450 },
		{ "critical_density", 1500 }, { "static_friction", 0.7 }, { NULL, 0 } };
	const alone_value dense[] = { { "bulk_modulus", 1e8 }, { "diameter", 5e-3 }, { "grain_density", 2450 },
		{ "critical_density", 2500 }, { NULL, 0 } };
	quern_status status;
	law m = try_law(ids[MU_I], 3, falling, &status);
	assert_int_equal(status, QUERN_E_PARAM);
	free_law(&m);
	m = try_law(ids[MU_I], 2, dense, &status);
	assert_int_equal(status, QUERN_E_PARAM);
	free_law(&m);
}

/* A stress that the material can carry is kept and read back by a step at rest, with the density that belongs to it; any
 * other comes back on the yield surface; tension is clipped. */
static void state_from_stress(void **unused) {
	(void)unused;
	char what[80];
	table_head("state from stress: worst relative gap");
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
			snprintf(what, sizeof what, "%s, %uD: %d kept", ids[which], dim, held);
			bool good = table_row(what, (double)kept, 0, 1e-12) && held > POINTS / 4;
			snprintf(what, sizeof what, "  %d returned (%d clipped)", returned, clipped);
			good &= table_row(what, (double)yield, 0, 1e-12);
			good &= table_row("  their pressure", (double)mean, 0, 1e-14);
			good &= table_row("  density", (double)density, 0, 1e-14);
			good &= table_row("  stress a step at rest later", (double)back, 0, 1e-12);
			assert_true(good);
			assert_true(which == ELASTIC || (returned > POINTS / 10 && clipped > POINTS / 10));
			free(given), free_cloud(&c), free_law(&m);
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

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(vectors), cmocka_unit_test(mu_i_states),
		cmocka_unit_test(drucker_prager_states), cmocka_unit_test(mu_i_range), cmocka_unit_test(refusals),
		cmocka_unit_test(state_from_stress), cmocka_unit_test(energy_derivative),
		cmocka_unit_test(hypoelastic_energy), cmocka_unit_test(elastic_modulus) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
