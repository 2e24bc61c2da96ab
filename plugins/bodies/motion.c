/* SPDX-License-Identifier: MIT */
#include "motion.h"
#include <math.h>
#include <quern/math.h>
#include <quern/vec.h>
#include <string.h>

static bool is_any(const quern_real v[3]) { return v[0] != 0 || v[1] != 0 || v[2] != 0; }

bool quern_motion_is_any(const body_motion *m) {
	return is_any(m->velocity) || m->spin != 0 || m->table.n ||
		   (m->frequency > 0 && (is_any(m->amplitude) || m->swing != 0));
}

/* How far, and how far turned; and the rates of both. */
typedef struct {
	quern_vec shift, velocity;
	quern_real angle, spin;
} course;

static void go_straight(const body_motion *m, quern_real since, bool on, course *c) {
	c->shift = quern_vec_axpy(since, QUERN_VEC_OF(m->velocity), c->shift);
	c->angle += since * m->spin;
	if (!on) return;
	c->velocity = quern_vec_add(c->velocity, QUERN_VEC_OF(m->velocity));
	c->spin += m->spin;
}

/* It begins where the body stands, whatever the phase. */
static void swing(const body_motion *m, quern_real since, bool on, course *c) {
	const quern_real omega = 6.283185307179586 * m->frequency, turns = m->frequency * since;
	const quern_real at = 6.283185307179586 * (turns - floor(turns)) + m->phase;
	const quern_real way = quern_sin(at) - quern_sin(m->phase), rate = omega * quern_cos(at);
	if (!(m->frequency > 0)) return;
	c->shift = quern_vec_axpy(way, QUERN_VEC_OF(m->amplitude), c->shift);
	c->angle += way * m->swing;
	if (!on) return;
	c->velocity = quern_vec_axpy(rate, QUERN_VEC_OF(m->amplitude), c->velocity);
	c->spin += rate * m->swing;
}

/* Before the first row and after the last one it rests there. */
static void follow_table(const body_motion *m, quern_real time, course *c) {
	const body_place *row = m->table.items;
	uint32_t next = 0;
	while (next < m->table.n && row[next].time <= time) next++;
	if (!m->table.n) return;
	const bool between = next && next < m->table.n;
	const body_place *a = &row[next ? next - 1 : 0], *b = between ? &row[next] : a;
	const quern_real length = b->time - a->time, share = between ? (time - a->time) / length : 0;
	for (int k = 0; k < 3; k++) {
		const quern_real way = b->shift[k] - a->shift[k];
		quern_real *shift = k == 0 ? &c->shift.x : k == 1 ? &c->shift.y : &c->shift.z;
		quern_real *velocity = k == 0 ? &c->velocity.x : k == 1 ? &c->velocity.y : &c->velocity.z;
		*shift += a->shift[k] + share * way;
		if (between) *velocity += way / length;
	}
	c->angle += a->angle + share * (b->angle - a->angle);
	if (between) c->spin += (b->angle - a->angle) / length;
}

static course course_at(const body_motion *m, quern_real time) {
	course c = { .angle = 0 };
	const quern_real since = quern_clamp(time, m->from, m->until) - m->from;
	const bool on = time >= m->from && time < m->until;
	go_straight(m, since, on, &c);
	swing(m, since, on, &c);
	follow_table(m, time, &c);
	return c;
}

/* Rodrigues' rotation by `angle` about the unit vector `a`, row by row. */
static void turn_about(const quern_real a[3], quern_real angle, quern_real turn[9]) {
	const quern_real s = quern_sin(angle), half = quern_sin(0.5 * angle), less = 2 * half * half;
	const quern_real cross[9] = { 0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0 };
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++) {
			const quern_real one = i == k ? 1 : 0;
			turn[3 * i + k] = one + s * cross[3 * i + k] + less * (a[i] * a[k] - one);
		}
}

/* A place x' of the body is at c + d + T (x' - c): the body's origin is at c + d - T c. */
void quern_motion_at(
	const body_motion *m, const body_pivot *p, quern_real time, quern_real rate, body_pose *out) {
	const course at = course_at(m, time), then = course_at(m, rate);
	const quern_vec c = QUERN_VEC_OF(p->about), pivot = quern_vec_add(c, at.shift),
					spin = quern_vec_scale(then.spin, QUERN_VEC_OF(p->axis));
	const quern_real whole =
		floor(at.angle * 0.15915494309189535); /* turns: sines of huge angles mean nothing */
	const quern_real angle = fabs(at.angle) > 1e5 ? at.angle - 6.283185307179586 * whole : at.angle;
	*out = (body_pose) { .moves = then.spin != 0 || quern_vec_dot(then.velocity, then.velocity, 3) > 0 };
	turn_about(p->axis, angle, out->pose.turn);
	const quern_vec origin = quern_vec_sub(pivot, quern_vec_turn(out->pose.turn, c));
	const quern_vec drift = quern_vec_add(then.velocity, quern_vec_cross(spin, quern_vec_sub(origin, pivot)));
	const quern_real to[4][3] = { { origin.x, origin.y, origin.z }, { drift.x, drift.y, drift.z },
		{ spin.x, spin.y, spin.z }, { pivot.x, pivot.y, pivot.z } };
	memcpy(out->pose.position, to[0], sizeof to[0]);
	memcpy(out->pose.velocity, to[1], sizeof to[1]);
	memcpy(out->pose.spin, to[2], sizeof to[2]);
	memcpy(out->pivot, to[3], sizeof to[3]);
}

bool quern_motion_pivot(const body_motion *m, const quern_bound *body, uint32_t dim, body_pivot *p) {
	quern_real lower[3] = { 0 }, upper[3] = { 0 }, length = 0;
	bool known = true;
	*p = (body_pivot) { .axis = { 0, 0, 1 } };
	for (int k = 0; k < 3; k++) length += m->axis[k] * m->axis[k];
	for (int k = 0; k < 3 && length > 0; k++) p->axis[k] = m->axis[k] / sqrt(length);
	((const quern_body_ops *)body->ops)->bounds(body->self, dim, lower, upper);
	for (uint32_t k = 0; k < dim; k++) {
		const bool middle = isfinite(lower[k]) && isfinite(upper[k]), given = !isnan(m->about[k]);
		p->about[k] = given ? m->about[k] : middle ? 0.5 * (lower[k] + upper[k]) : 0;
		known = known && (given || middle);
	}
	return known;
}

const body_pose quern_motion_still = { .pose = { .turn = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } } };

void quern_motion_repeat(body_pose *p, const quern_bound *body, uint32_t dim, const quern_real lower[3],
	const quern_real upper[3], const bool periodic[3]) {
	quern_real low[3] = { 0 }, high[3] = { 0 };
	((const quern_body_ops *)body->ops)->bounds(body->self, dim, low, high);
	for (uint32_t k = 0; k < dim; k++) {
		quern_real half = 0, at = p->pose.position[k];
		for (uint32_t j = 0; j < dim; j++) {
			const quern_real t = p->pose.turn[3 * k + j];
			if (t == 0) continue;
			half += 0.5 * fabs(t) * (high[j] - low[j]);
			at += 0.5 * t * (high[j] + low[j]);
		}
		const bool bounded = half < INFINITY && 2 * half < upper[k] - lower[k];
		p->middle[k] = bounded ? at : 0;
		p->length[k] = bounded && periodic[k] ? upper[k] - lower[k] : 0;
		p->repeats = p->repeats || p->length[k] > 0;
	}
}

/* Largest rates of way and of turning from `from` to `to`, whenever they come. */
static void fastest(const body_motion *m, quern_real from, quern_real to, quern_real *way, quern_real *turn) {
	const body_place *row = m->table.items;
	const quern_real omega = 6.283185307179586 * m->frequency;
	*way = *turn = 0;
	if (from < m->until && to >= m->from) {
		const quern_vec v = QUERN_VEC_OF(m->velocity), a = QUERN_VEC_OF(m->amplitude);
		*way = sqrt(quern_vec_dot(v, v, 3)) + omega * sqrt(quern_vec_dot(a, a, 3));
		*turn = fabs(m->spin) + omega * fabs(m->swing);
	}
	quern_real along = 0, about = 0;
	for (uint32_t k = 0; k + 1 < m->table.n; k++) {
		if (row[k + 1].time < from || row[k].time > to) continue;
		const quern_real length = row[k + 1].time - row[k].time;
		const quern_vec d = quern_vec_sub(QUERN_VEC_OF(row[k + 1].shift), QUERN_VEC_OF(row[k].shift));
		along = quern_max(along, sqrt(quern_vec_dot(d, d, 3)) / length);
		about = quern_max(about, fabs(row[k + 1].angle - row[k].angle) / length);
	}
	*way += along;
	*turn += about;
}

/* Of a corner of the body's own box, or of the domain where it has none: no place is farther from the pivot. */
quern_real quern_motion_speed(
	const body_motion *m, const quern_bound *body, const quern_step *s, quern_real from, quern_real to) {
	quern_real low[3] = { 0 }, high[3] = { 0 }, way, turn, arm2 = 0;
	body_pivot pivot;
	fastest(m, from, to, &way, &turn);
	if (!(turn > 0)) return way;
	quern_motion_pivot(m, body, s->dim, &pivot);
	((const quern_body_ops *)body->ops)->bounds(body->self, s->dim, low, high);
	for (uint32_t k = 0; k < s->dim; k++) {
		const bool bounded = isfinite(low[k]) && isfinite(high[k]);
		const quern_real a = fabs((bounded ? low[k] : s->lower[k]) - pivot.about[k]),
						 b = fabs((bounded ? high[k] : s->upper[k]) - pivot.about[k]);
		arm2 += quern_max(a, b) * quern_max(a, b);
	}
	return way + turn * sqrt(arm2);
}
