/* SPDX-License-Identifier: MIT */
#include "h5.h"
#include "render.h"
#include "text.h"
#include <math.h>
#include <quern/body.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* Forces beyond are of no run. */
static const double most_force = 1e30;

/* ---- from the file ---- */

/* Two columns of a group that say what presses on what; NULL where the file has no such forces. */
typedef struct {
	size_t n;
	double *first, *second, *force;
	bool damaged;
} pairs;

static double *read_column(hid_t group, const char *name, size_t n, size_t wanted, pairs *p) {
	size_t columns = 0;
	double *table = quern_render_table(group, name, n, &columns);
	p->damaged |= !table || columns != wanted;
	return table;
}

static pairs read_pairs(hid_t file, const char *set, const char *first, const char *second) {
	pairs p = { 0 };
	size_t columns;
	const hid_t group = quern_h5_find(file, set);
	if (group >= 0 && H5Lexists(group, "force", H5P_DEFAULT) > 0) {
		p.damaged = !quern_h5_read_size(group, "force", &p.n, &columns);
		if (!p.damaged) p.force = read_column(group, "force", p.n, 3, &p);
		if (!p.damaged) p.first = read_column(group, first, p.n, 1, &p);
		if (!p.damaged) p.second = read_column(group, second, p.n, 1, &p);
	}
	if (group >= 0) H5Gclose(group);
	for (size_t i = 0; !p.damaged && i < 3 * p.n; i++) p.damaged = !(fabs(p.force[i]) <= most_force);
	return p;
}

static void finish_pairs(pairs *p) {
	free(p->first);
	free(p->second);
	free(p->force);
}

static bool is_index(double x, size_t n) { return x >= 0 && x < (double)n && x == floor(x); }

/* Along the line, of what the grain at `from` feels. */
static void set_force(render_link *l) {
	double along = 0, square = 0;
	for (int k = 0; k < 3; k++) {
		const double d = l->from[k] - l->to[k];
		along += d * l->vector[k];
		square += d * d;
	}
	l->force = square > 0 ? along / sqrt(square) : 0;
}

static bool add_contacts(render_frame *f, const pairs *p) {
	const render_cloud *grains = &f->grains;
	for (size_t i = 0; i < p->n; i++) {
		if (!is_index(p->first[i], grains->n) || !is_index(p->second[i], grains->n)) return false;
		const size_t a = (size_t)p->first[i], b = (size_t)p->second[i];
		render_link *l = &f->link[f->n_links++];
		*l = (render_link) { .body = -1, .radius = grains->size[a] };
		memcpy(l->from, grains->position[a], sizeof l->from);
		memcpy(l->to, grains->position[b], sizeof l->to);
		memcpy(l->vector, p->force + 3 * i, sizeof l->vector);
		set_force(l);
	}
	return true;
}

/* Until the body's own shape is known, to where the force comes from. */
static bool add_touches(render_frame *f, const pairs *p) {
	for (size_t i = 0; i < p->n; i++) {
		if (!is_index(p->first[i], f->grains.n) || !is_index(p->second[i], 1u << 31)) return false;
		const size_t a = (size_t)p->first[i];
		render_link *l = &f->link[f->n_links++];
		*l = (render_link) { .body = (int64_t)p->second[i], .radius = f->grains.size[a] };
		memcpy(l->from, f->grains.position[a], sizeof l->from);
		memcpy(l->vector, p->force + 3 * i, sizeof l->vector);
		const double *v = l->vector, size = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
		for (int k = 0; k < 3; k++) l->to[k] = l->from[k] - (size > 0 ? l->radius * v[k] / size : 0);
		set_force(l);
	}
	return true;
}

static int by_ends(const void *a, const void *b) {
	const render_link *l = a, *m = b;
	const int ends = memcmp(l, m, offsetof(render_link, force));
	if (ends) return ends;
	return (l->body > m->body) - (l->body < m->body);
}

/* A contact across the border of two blocks is in the frame twice. */
static void drop_twins(render_frame *f) {
	size_t kept = 0;
	qsort(f->link, f->n_links, sizeof *f->link, by_ends);
	for (size_t i = 0; i < f->n_links; i++)
		if (!kept || f->link[i].body >= 0 || by_ends(&f->link[kept - 1], &f->link[i]))
			f->link[kept++] = f->link[i];
	f->n_links = kept;
}

bool quern_render_links_read(render_frame *f, hid_t file, const char *path, quern_text *why) {
	pairs contacts = read_pairs(file, "contacts", "first", "second");
	pairs touches = read_pairs(file, "touches", "grain", "body");
	bool good = !contacts.damaged && !touches.damaged;
	if (good && !contacts.force && !touches.force) {
		quern_text_add(why,
			"%s has no forces between grains: run the scene with contact.force and touch.force in output.fields",
			path);
		return false;
	}
	if (good) {
		f->link = quern_take(2 * (contacts.n + touches.n) + 1, sizeof *f->link);
		good = add_contacts(f, &contacts) && add_touches(f, &touches);
	}
	if (good) drop_twins(f);
	else
		quern_text_add(
			why, "%s is damaged: its contacts cannot be read, or are of grains that are not there", path);
	finish_pairs(&contacts);
	finish_pairs(&touches);
	return good;
}

/* ---- with the scene ---- */

/* The body's place that is nearest to the grain, of one feature or (NULL) of all, and the force along the way there; false
 * if the grain does not touch it. */
static bool find_place(const render_link *l, int dimension, const quern_filling *body, const quern_pose *pose,
	const int32_t *feature, render_link *to) {
	enum { ROOM = 8 }; /* columns are at least that long */
	_Alignas(64) quern_real x[3][ROOM] = { 0 }, radius[ROOM] = { 0 }, gap[ROOM] = { 0 },
							normal[3][ROOM] = { 0 }, velocity[3][ROOM] = { 0 };
	_Alignas(64) int32_t which[ROOM] = { feature ? *feature : 0 };
	for (int k = 0; k < 3; k++) x[k][0] = l->from[k];
	radius[0] = l->radius;
	const quern_body_batch batch = { .n = 1,
		.cap = ROOM,
		.dim = (uint32_t)dimension,
		.pose = pose,
		.position = { x[0], x[1], x[2] },
		.radius = radius,
		.feature = feature ? which : NULL,
		.gap = gap,
		.normal = { normal[0], normal[1], normal[2] },
		.velocity = { velocity[0], velocity[1], velocity[2] } };
	((const quern_body_ops *)body->instance->ops)->closest(body->instance->self, &batch);
	*to = *l;
	for (int k = 0; k < dimension; k++) to->to[k] = l->from[k] - (l->radius + gap[0]) * normal[k][0];
	set_force(to);
	return fabs(gap[0]) < l->radius;
}

/* To where the grain touches the body. In an inside corner it touches several features, each with a force of its own: the
 * frame does not say which is which, but a force presses most towards its own one. */
static void reach_body(render_link *l, int dimension, const quern_filling *body, const quern_pose *pose) {
	enum { MOST = 64 };
	const quern_body_ops *ops = body->instance->ops;
	int32_t feature[MOST];
	render_link best = *l, to;
	uint32_t n = 0, found = 0;
	if (ops->features) n = ops->features(body->instance->self, pose, l->from, 2 * l->radius, MOST, feature);
	for (uint32_t k = 0; k < n && k < MOST; k++)
		if (find_place(l, dimension, body, pose, &feature[k], &to) && (!found++ || to.force > best.force))
			best = to;
	if (found || find_place(l, dimension, body, pose, NULL, &to)) *l = found ? best : to;
}

/* Two halves, one at each face, of a contact through faces that are periodic. */
static void split(render_frame *f, render_link *l) {
	const quern_general *g = &f->scene->general;
	double way[3];
	bool through = false;
	for (int k = 0; k < 3; k++) {
		const double length = g->upper[k] - g->lower[k];
		way[k] = l->to[k] - l->from[k];
		if (k >= f->dimension || !g->periodic[k] || fabs(way[k]) < 0.5 * length) continue;
		way[k] -= length * round(way[k] / length);
		through = true;
	}
	if (!through) return;
	render_link *other = &f->link[f->n_links++];
	*other = *l;
	for (int k = 0; k < 3; k++) {
		other->from[k] = l->to[k] - 0.5 * way[k];
		l->to[k] = l->from[k] + 0.5 * way[k];
	}
	set_force(l);
	other->force = l->force;
}

void quern_render_links_mend(render_frame *f) {
	static const quern_pose still = { .turn = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } };
	const quern_section *bodies = quern_render_bodies(f);
	const size_t n = f->n_links, n_bodies = bodies && bodies->n_slots ? bodies->slots[0].n : 0;
	const bool posed = f->n_poses == n_bodies;
	for (size_t i = 0; i < n && f->scene; i++) {
		render_link *l = &f->link[i];
		const size_t b = (size_t)l->body;
		if (l->body < 0) split(f, l);
		else if (b < n_bodies)
			reach_body(l, f->dimension, &bodies->slots[0].filling[b], posed ? &f->pose[b] : &still);
	}
}
