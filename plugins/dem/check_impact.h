/* SPDX-License-Identifier: MIT */
/* check_impact - an impact of two bodies, from touching to apart, moved by the forces of the law that is checked; beside it the columns
 * of check.contact's batches */
#pragma once
#include <math.h>
#include <quern/check.h>

enum {
	OVERLAP,
	NORMAL,
	VELOCITY,
	SPIN,
	TURN,
	RADIUS,
	MASS,
	FORCE,
	COUPLE,
	DASHPOT,
	STORED,
	SHEARED,
	RUBBED,
	DRAG_COUPLE,
	MEAN_VELOCITY,
	MEAN_SPIN
};

typedef struct {
	double x[3], v[3], w[2][3], r[2], m[2];
	/* J: at the start; to dashpots and sliding so far; in the books and of motion at most */
	double energy, lost, most, fastest;
} impact;

QUERN_INLINE double motion_energy(const quern_check_kernel *k, const impact *p) {
	const double m = p->m[0] * p->m[1] / (p->m[0] + p->m[1]), share = k->dim == 2 ? 0.5 : 0.4;
	double sum = 0;
	for (uint32_t c = 0; c < k->dim; c++) sum += 0.5 * m * p->v[c] * p->v[c];
	for (uint32_t s = 0; s < 2; s++)
		for (uint32_t c = 0; c < 3; c++)
			sum += 0.5 * share * p->m[s] * p->r[s] * p->r[s] * p->w[s][c] * p->w[s][c];
	return sum;
}

QUERN_INLINE void cross(const double a[3], const double b[3], double out[3]) {
	for (int c = 0; c < 3; c++) out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
}

QUERN_INLINE void begin_impact(const quern_check_kernel *k, uint32_t i, impact *p) {
	double n[3];
	*p = (impact) { .energy = 0 };
	k->host->direction(k->dim, 70, i, n);
	for (uint32_t s = 0; s < 2; s++) {
		p->r[s] = k->host->uniform(71 + s, i, 0.5e-3, 1.5e-3);
		p->m[s] = 2500 * 3.141592653589793 * p->r[s] * p->r[s] * (k->dim == 3 ? 4.0 / 3 * p->r[s] : 1);
		for (uint32_t c = k->dim == 3 ? 0 : 2; c < 3 && k->at[SPIN] >= 0; c++)
			p->w[s][c] = k->host->uniform(73 + s, c * 65536 + i, -50, 50);
	}
	for (uint32_t c = 0; c < k->dim; c++) {
		p->x[c] = n[c] * (p->r[0] + p->r[1]) * (1 + 1e-9);
		p->v[c] = -0.1 * n[c] + k->host->uniform(75, c * 65536 + i, -0.05, 0.05);
	}
	p->energy = motion_energy(k, p);
}

/* First minus second; b = -arm n for the first, +arm n for the second. Returns the overlap. */
QUERN_INLINE void give_impact(
	const quern_check_kernel *k, uint32_t i, const impact *p, double n[3], double arm[2]) {
	double length = 0, spin[3], drift[3];
	for (uint32_t c = 0; c < 3; c++) length += p->x[c] * p->x[c];
	length = sqrt(length);
	const double overlap = p->r[0] + p->r[1] - length;
	for (uint32_t c = 0; c < 3; c++) n[c] = p->x[c] / length;
	for (uint32_t s = 0; s < 2; s++) arm[s] = p->r[s] - 0.5 * overlap;
	for (uint32_t c = 0; c < 3; c++) spin[c] = -arm[0] * p->w[0][c] - arm[1] * p->w[1][c];
	cross(spin, n, drift);
	quern_check_given(k, OVERLAP, 0)[i] = overlap;
	quern_check_given(k, RADIUS, 0)[i] = p->r[0] * p->r[1] / (p->r[0] + p->r[1]);
	quern_check_given(k, MASS, 0)[i] = p->m[0] * p->m[1] / (p->m[0] + p->m[1]);
	for (uint32_t c = 0; c < k->dim; c++) {
		quern_check_given(k, NORMAL, c)[i] = n[c];
		quern_check_given(k, VELOCITY, c)[i] = p->v[c] + drift[c];
		if (k->at[MEAN_VELOCITY] >= 0) quern_check_given(k, MEAN_VELOCITY, c)[i] = p->v[c] + drift[c];
	}
	const uint32_t from = k->dim == 3 ? 0 : 2;
	for (uint32_t c = from; c < 3 && k->at[SPIN] >= 0; c++) {
		quern_check_given(k, SPIN, c - from)[i] = p->w[0][c] - p->w[1][c];
		if (k->at[MEAN_SPIN] >= 0) quern_check_given(k, MEAN_SPIN, c - from)[i] = p->w[0][c] - p->w[1][c];
		if (k->dim == 3) quern_check_given(k, TURN, c)[i] = 0.5 * (p->w[0][c] + p->w[1][c]);
	}
}

QUERN_INLINE void take_impact(
	const quern_check_kernel *k, uint32_t i, impact *p, const double n[3], const double arm[2]) {
	const double m = p->m[0] * p->m[1] / (p->m[0] + p->m[1]), share = k->dim == 2 ? 0.5 : 0.4;
	const uint32_t from = k->dim == 3 ? 0 : 2;
	double f[3] = { 0 }, torque[3];
	for (uint32_t c = 0; c < k->dim; c++) f[c] = quern_check_found(k, FORCE, c)[i];
	cross(f, n, torque); /* b x f = -arm n x f */
	for (uint32_t s = 0; s < 2; s++)
		for (uint32_t c = from; c < 3 && k->at[SPIN] >= 0; c++) {
			const double couple =
				k->at[COUPLE] < 0 ? 0 : (s ? -1 : 1) * quern_check_found(k, COUPLE, c - from)[i];
			p->w[s][c] += k->dt * (arm[s] * torque[c] + couple) / (share * p->m[s] * p->r[s] * p->r[s]);
		}
	for (uint32_t c = 0; c < k->dim; c++) {
		p->v[c] += k->dt * f[c] / m;
		p->x[c] += k->dt * p->v[c];
	}
}

/* Motion, springs, and what dashpots and sliding say that they have taken: together never more than at the start. */
QUERN_INLINE void keep_books(const quern_check_kernel *k, uint32_t i, impact *p) {
	const double motion = motion_energy(k, p);
	const double held =
		motion + quern_check_found(k, STORED, 0)[i] + quern_check_found(k, SHEARED, 0)[i] + p->lost;
	for (uint32_t c = 0; c < k->dim; c++)
		p->lost -= k->dt * quern_check_found(k, DASHPOT, c)[i] * quern_check_given(k, VELOCITY, c)[i];
	for (uint32_t c = 0; k->at[DRAG_COUPLE] >= 0 && c < quern_check_axial(k->dim); c++)
		p->lost -= k->dt * quern_check_found(k, DRAG_COUPLE, c)[i] * quern_check_given(k, SPIN, c)[i];
	p->lost += quern_check_found(k, RUBBED, 0)[i];
	if (!(held <= p->most)) p->most = held;
	if (motion > p->fastest) p->fastest = motion; /* more than at the start where grains attract each other */
}
