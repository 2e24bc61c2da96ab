/* SPDX-License-Identifier: MIT */
/* material.mu_i whose flow comes to a density of its own: docs/theory/materials.md, section 3 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "material_kit.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double bulk = 1e6, diameter = 2e-3, grain = 2500, critical = 2000, slow = 2040, loosened = 0.4,
					steepness = 20;

static law sand(uint32_t dim) {
	const alone_value values[] = { { "bulk_modulus", bulk }, { "diameter", diameter },
		{ "grain_density", grain }, { "critical_density", critical }, { "flow_density", slow },
		{ "dilation", loosened }, { NULL, 0 } };
	return make_law(ids[MU_I], dim, values);
}

static wide pressure_of(uint32_t dim, const cloud *c, uint32_t i) {
	return -trace(dim, get(dim, c->stress, i)) / dim;
}

/* What pressure adds to a density, e^(p/K) to second order. */
static wide pressed(wide p) { return 1 + p / bulk * (1 + p / bulk / 2); }

/* Of flow at this inertial number; what is looser than the loosest bears nothing. */
static wide loosest(wide number) { return slow * (1 - fminl(loosened * number, 0.2L)); }

/* Of density for each unit of shear, where flow is looser by this share, and the density off by that one. */
static wide pace_of(wide by, wide off) { return steepness / (1 + steepness * (by / (1 - by) + fabsl(off))); }

/* A step from any state is the one of the page: what shears bears more or less than it would by the factor of the page, pressure and shear stress
 * alike; what does not is elastic; what bore nothing and is looser than the flow around it would be stays open. */
static void steps(void **unused) {
	(void)unused;
	const double dt = 1e-4;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		law m = sand(dim);
		cloud c = make_cloud(&m, POINTS), was = make_cloud(&m, POINTS);
		static quern_real mean[POINTS];
		const wide mu_s = param(&m, "static_friction"), mu_2 = param(&m, "limit_friction");
		const wide i0 = param(&m, "inertial_number"), shear = m.shear;
		wide worst = 0;
		int open = 0, loose = 0, flowing = 0, still = 0;
		state = 88172645463325252u + dim;
		randomise(MU_I, &m, &was, 0.03);
		for (uint32_t i = 0; i < was.n; i++) {
			const wide p = pressure_of(dim, &was, i);
			mean[i] = i % 7 ? (double)(p * between(0.5, 2)) : 0;
			was.density[i] = critical * between(0.75, 1.08);
			if (i % 3 == 0) put(dim, was.stress, i, none);
			if (i % 3 == 0) mean[i] = bulk * sized(-14, -4);
		}
		memcpy(c.memory, was.memory, was.cap * was.n_columns * sizeof(quern_real));
		c.mean_pressure = mean;
		update(&m, &c, dt);
		for (uint32_t i = 0; i < c.n; i++) {
			const matrix l = get_gradient(dim, &c, i), old = get(dim, was.stress, i),
						 now = get(dim, c.stress, i);
			const matrix w = scaled(dim, 0.5L, plus(dim, l, -1, transposed(l)));
			const matrix e = scaled(dim, 0.5L, plus(dim, l, 1, transposed(l)));
			const matrix r = times(inverse(dim, plus(dim, unit, -dt / 2, w)), plus(dim, unit, dt / 2, w));
			matrix trial = plus(dim, times(times(r, old), transposed(r)), 2 * dt * shear, e);
			trial = plus(dim, trial, dt * (m.bulk - 2 * shear / dim) * trace(dim, l), unit);
			const wide p = -trace(dim, trial) / dim, tau = shear_of(dim, trial),
					   scale = norm(old) + m.bulk * dt * norm(l);
			const wide around = mean[i] > 0 ? mean[i] : p;
			wide flow = tau;
			if (p > 0 && tau > mu_s * p) {
				const wide a = shear * i0 * dt * sqrtl(around / grain) / diameter, u = (mu_2 - mu_s) * p,
						   v = tau - mu_s * p;
				flow =
					mu_s * p + 2 * u * v / (u + v + a + sqrtl((u - v) * (u - v) + a * a + 2 * a * (u + v)));
			}
			const bool slides = p > 0 && tau > mu_s * p;
			const wide strain =
				(tau - (slides ? flow : 0)) / shear; /* what bears nothing shears as a whole */
			const wide number =
				mean[i] > 0 ? strain / dt * diameter * sqrtl(grain / mean[i]) : 0; /* of what bears nothing */
			const wide most = fminl(mean[i] > 0 ? loosest(number) : critical, critical);
			if (fabsl(p) < 1e-12L * scale || fabsl(was.density[i] - most) < 1e-9L) continue;
			const bool bore = trace(dim, old) < 0 && was.density[i] >= loosest(1),
					   dilute = was.density[i] < most && !bore;
			const wide left = dilute ? fminl(was.grid_density[i], most) : (wide)was.density[i];
			assert_true(fabsl(c.density[i] / left - 1) < 1e-14L);
			if (dilute || p <= 0) {
				open++;
				assert_true(norm(now) == 0);
				continue;
			}
			wide grown = 1;
			if (slides) {
				const wide looser = loosened * strain / dt * diameter * sqrtl(grain / around),
						   by = fminl(0.2L, looser * fmaxl(0, (3 - p / around) / 2)), of = slow * (1 - by),
						   off = was.density[i] / (of * pressed(p)) - 1,
						   gain = pace_of(by, off) * bulk * strain;
				grown = 1 + fmaxl(-0.5L,
								fminl(gain * off / (p + gain * (looser * p / around / 2 + p / bulk)), 0.5L));
				flowing++;
			} else still++;
			loose += was.density[i] < critical;
			const matrix expected =
				plus(dim, scaled(dim, grown * flow / tau, deviator(dim, trial)), -grown * p, unit);
			worst = largest(worst, norm(plus(dim, now, -1, expected)) / (scale + norm(expected)));
		}
		printf("  %uD: %d open, %d flow, %d are still; %d of these are looser than at rest\n", dim, open,
			flowing, still, loose);
		assert_true(open > 500 && flowing > 500 && still > 500 && loose > 500);
		assert_true(table_row("stress after a step", (double)worst, 0, 1e-13));
		free_cloud(&c), free_cloud(&was), free_law(&m);
	}
}

/* Sheared in a volume that is kept, a point comes to the pressure that its density has in such a flow, from above and from below, however little
 * that is, and to mu(I). */
static void kept_volume(void **unused) {
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		law m = sand(dim);
		const double mu_s = param(&m, "static_friction"), mu_2 = param(&m, "limit_friction"),
					 i0 = param(&m, "inertial_number");
		for (int k = 0; k < 6; k++) {
			const double rate = pow(10, k / 2 - 1), density = slow * (k % 2 ? 1.002 : 0.985),
						 dt = 2e-5 / rate;
			cloud c = make_cloud(&m, 1);
			matrix l = none;
			l.x[0][1] = rate;
			put(dim, c.stress, 0, scaled(dim, k % 3 ? -100 : -5000, unit));
			put_gradient(dim, &c, 0, l);
			c.density[0] = c.grid_density[0] = density;
			for (int step = 0; step < 1000000; step++) update(&m, &c, dt);
			const matrix s = get(dim, c.stress, 0);
			const double p = (double)(-trace(dim, s) / dim);
			assert_true(p > 0);
			/* an elastic stress that turns with the shear lags behind it: tau' = G (rate) s_xy/tau is what flow takes up */
			const double slides = (double)(s.x[0][1] / shear_of(dim, s)) * rate;
			const double number = slides * diameter * sqrt(grain / p);
			const double wanted = slow * (1 - fmin(loosened * number, 0.2)) * (double)pressed(p);
			const double mu = mu_s + (mu_2 - mu_s) / (1 + i0 / number),
						 found = (double)(shear_of(dim, s) / p);
			printf("  %uD at %g 1/s, %g kg/m^3: %.6g Pa, I %.4g: of %.8g kg/m^3; friction off by %.1e\n", dim,
				rate, density, p, number, wanted, found / mu - 1);
			assert_true(fabs(wanted / density - 1) < 1e-8 && fabs(found / mu - 1) < 1e-6);
			free_cloud(&c);
		}
		free_law(&m);
	}
}

/* Where the pressure around stays, be it little and half of a point's own, that comes to rest: it does not jump about its value. */
static void around_is_held(void **unused) {
	(void)unused;
	const double arounds[] = { 3, 30, 300 }, ratios[] = { 0.5, 1, 1.5, 1.8, 2, 2.5 }, inertial = 0.0975,
				 strain = 2.5e-3;
	law m = sand(2);
	for (int k = 0; k < 18; k++) {
		const quern_real mean = arounds[k / 6];
		const double ratio = ratios[k % 6], rate = inertial * sqrt(mean / grain) / diameter;
		cloud c = make_cloud(&m, 1);
		matrix l = none;
		double before = 0, now = 0;
		c.mean_pressure = &mean;
		l.x[0][1] = rate;
		put(2, c.stress, 0, scaled(2, -mean, unit));
		put_gradient(2, &c, 0, l);
		c.density[0] = c.grid_density[0] =
			slow * (1 - loosened * inertial * (1.5 - 0.5 * ratio)) * (double)pressed(ratio * mean);
		for (int step = 0; step < 5000; step++) {
			before = now;
			update(&m, &c, strain / rate);
			now = (double)pressure_of(2, &c, 0);
		}
		printf("  %g Pa around: %.6g Pa, %.4g of it, a step changes it by %.1e\n", mean, now, now / mean,
			now / before - 1);
		assert_true(fabs(now / before - 1) < 1e-9 && fabs(now / (ratio * mean) - 1) < 0.02);
		free_cloud(&c);
	}
	free_law(&m);
}

/* Slow flow that is off by little comes there as exp(-20 (shear)). */
static void approach(void **unused) {
	(void)unused;
	const double rate = 1e-3, density = slow * 1.001, end = 0.001 * bulk, shear = 0.1,
				 left = exp(-steepness * shear);
	double gap[2];
	for (uint32_t dim = 2; dim <= 3; dim++) {
		law m = sand(dim);
		for (int k = 0; k < 2; k++) {
			const int steps_of = 500 << k;
			const double dt = shear / (rate * steps_of), first = 2 * end;
			cloud c = make_cloud(&m, 1);
			matrix l = none;
			l.x[0][1] = rate;
			put_gradient(dim, &c, 0, l);
			matrix s = scaled(dim, -first, unit);
			s.x[0][1] = s.x[1][0] = param(&m, "static_friction") * first; /* flows from the first step on */
			put(dim, c.stress, 0, s);
			c.density[0] = c.grid_density[0] = density;
			for (int step = 0; step < steps_of; step++) update(&m, &c, dt);
			/* dp/d(shear) = (pace) K (rho/rho_I - 1), by small steps of second order */
			double p = first;
			for (int step = 0; step < 100000; step++) {
				const double h = shear / 100000;
				double mid = p;
				for (int stage = 0; stage < 2; stage++) {
					const wide by = loosened * rate * diameter * sqrt(grain / mid),
							   off = density / (slow * (1 - by) * pressed(mid)) - 1;
					mid = p + (stage + 1) * 0.5 * h * bulk * (double)(pace_of(by, off) * off);
				}
				p = mid;
			}
			gap[k] = fabs((double)pressure_of(dim, &c, 0) / p - 1);
			printf(
				"  %uD, %d steps of a shear of 0.1: from %g to %.6g Pa, off by %.2e; exp(-20 0.1) would leave %.6g\n",
				dim, steps_of, first, (double)pressure_of(dim, &c, 0), gap[k], end + (first - end) * left);
			assert_true(fabs(p / (end + (first - end) * left) - 1) < 0.01);
			free_cloud(&c);
		}
		assert_true(gap[1] < 0.01 && gap[0] / gap[1] > 1.7 && gap[0] / gap[1] < 2.3);
		free_law(&m);
	}
}

/* Pa/s over K: how the pressure of steady flow under p changes in a step so short that it is linear. */
static double pressing(const law *m, double density, double rate, const quern_real *p) {
	const double mu_s = param(m, "static_friction"), mu_2 = param(m, "limit_friction"),
				 i0 = param(m, "inertial_number"), dt = 1e-9 / rate;
	cloud c = make_cloud(m, 1);
	matrix l = none, s = scaled(m->dim, -*p, unit);
	c.mean_pressure = p;
	c.density[0] = c.grid_density[0] = density;
	l.x[0][1] = rate;
	put_gradient(m->dim, &c, 0, l);
	s.x[0][1] = s.x[1][0] = *p * (mu_s + (mu_2 - mu_s) / (1 + i0 * sqrt(*p / grain) / (rate * diameter)));
	put(m->dim, c.stress, 0, s);
	update(m, &c, dt);
	const double change = (double)(pressure_of(m->dim, &c, 0) - *p) / (bulk * dt);
	free_cloud(&c);
	return change;
}

/* A stretch along the flow's own axis adds as much to the shear rate, and takes K times itself from the pressure. What it adds to that by the rate is less, at
 * every inertial number and density, or flow would not resist being squeezed. */
static void stretch_wins(void **unused) {
	(void)unused;
	const quern_real pressure = 1000;
	double most = 0;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		law m = sand(dim);
		for (int k = 0; k < 60; k++)
			for (int j = -20; j <= 20; j++) {
				const double inertial = pow(10, -3 + 0.06 * k), off = j * 0.01, part = 1e-3,
							 rate = inertial * sqrt(pressure / grain) / diameter,
							 density = (double)(loosest(inertial) * pressed(pressure)) * (1 + off);
				if (density < (double)loosest(1) ||
					density < (double)fminl(critical, loosest(inertial * (1 + part))))
					continue;
				const double more = pressing(&m, density, rate * (1 + part), &pressure) -
									pressing(&m, density, rate * (1 - part), &pressure);
				most = fmax(most, fabs(more) / (2 * part * rate));
			}
		free_law(&m);
	}
	table_head("what pressure gains as flow shears faster");
	const bool less = table_row("over what the stretch takes, at most", most, 0, 1);
	assert_true(less && most > 0.5);
}

/* A flow that stops stays as loose as it is, and goes on to bear; pulled apart it opens. */
static void stops(void **unused) {
	(void)unused;
	for (uint32_t dim = 2; dim <= 3; dim++) {
		law m = sand(dim);
		cloud c = make_cloud(&m, 1);
		const quern_real mean = 1000;
		c.mean_pressure = &mean;
		put(dim, c.stress, 0, scaled(dim, -1000, unit));
		c.density[0] = c.grid_density[0] = 0.97 * critical;
		for (int step = 0; step < 10; step++) update(&m, &c, 1e-4);
		assert_true(pressure_of(dim, &c, 0) == 1000 && c.density[0] == 0.97 * critical);
		put_gradient(dim, &c, 0, scaled(dim, 20, unit));
		update(&m, &c, 1e-4);
		assert_true(pressure_of(dim, &c, 0) == 0);
		/* open, and as loose as that: it does not bear when it is pressed, unless it shears as fast as a flow that is so loose */
		const double needed = (1 - 0.97 * critical / slow) / (loosened * diameter) * sqrt(mean / grain);
		for (int shears = 0; shears < 2; shears++) {
			matrix l = scaled(dim, -1e-6, unit);
			put(dim, c.stress, 0, none);
			l.x[0][1] = needed * (shears ? 1.001 : 0.999);
			put_gradient(dim, &c, 0, l);
			c.density[0] = 0.97 * critical;
			update(&m, &c, 1e-4);
			assert_true((pressure_of(dim, &c, 0) > 0) == shears);
		}
		/* pressed, but looser than any flow */
		put(dim, c.stress, 0, scaled(dim, -1000, unit));
		put_gradient(dim, &c, 0, none);
		c.density[0] = c.grid_density[0] = 0.99 * (double)loosest(1);
		update(&m, &c, 1e-4);
		assert_true(pressure_of(dim, &c, 0) == 0);
		free_cloud(&c), free_law(&m);
	}
}

/* What does not fit together is refused. */
static void refusals(void **unused) {
	(void)unused;
	const struct {
		double flow, dilation, rate;
	} bad[] = { { 0, 0.4, 0 }, { 2600, 0, 0 }, { 2040, 0.4, 10 } };
	for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
		const alone_value values[] = { { "bulk_modulus", bulk }, { "diameter", diameter },
			{ "grain_density", grain }, { "critical_density", critical }, { "flow_density", bad[k].flow },
			{ "dilation", bad[k].dilation }, { "pressure_rate", bad[k].rate }, { NULL, 0 } };
		quern_status status = QUERN_OK;
		law m = try_law(ids[MU_I], 2, values, &status);
		assert_int_equal(status, QUERN_E_PARAM);
		free_law(&m);
	}
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(steps), cmocka_unit_test(kept_volume),
		cmocka_unit_test(around_is_held), cmocka_unit_test(approach), cmocka_unit_test(stretch_wins),
		cmocka_unit_test(stops), cmocka_unit_test(refusals) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
