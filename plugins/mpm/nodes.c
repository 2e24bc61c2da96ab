/* SPDX-License-Identifier: MIT */
/* nodes - the grid between scatter and gather: velocities from momenta and forces, and what bodies do to them */
#include "../bodies/books.h"
#include "cut_hat.h"
#include "mpm.h"
#include <math.h>
#include <quern/vec.h>
#include <string.h>

enum { N = QUERN_BLOCK_CELLS, SURFACES = 5 };

typedef struct {
	const mpm *p;
	const quern_step *s;
	const quern_grid_view *g;
	quern_row *node, *motion;
	uint32_t n_bodies;
	const body_pose *pose; /* by body */
	bool twists;           /* moments and work are booked too */
	bool again;            /* after a coupling */
	body_books books;      /* on the material; the last one of a block: by faces and for light nodes */
} grid_work;

typedef struct {
	_Alignas(64) quern_real position[3][N], own[3][N], radius[N], gap[N], normal[3][N], velocity[3][N];
	/* cells to the face of the domain that a surface is, and to the one opposite; many of a body */
	int32_t faced[SURFACES][N], opposite[SURFACES][N];
	quern_real room[SURFACES][N],
		facing[SURFACES][3][N]; /* what faces and bodies leave of a node, and which way they face */
	uint32_t surfaces[N];
	quern_real counted[N]; /* what bodies leave of the hat around the cell above the node */
} near_nodes;

static int32_t cells_to_face(const quern_grid_view *g, const int32_t at[3], uint32_t k) {
	return at[k] < g->cells[k] - at[k] ? at[k] : g->cells[k] - at[k];
}

/* Volume of a node over that of one inside: less at and next to a face; between two of them both take. */
static quern_real share_at(const grid_work *w, int32_t away) {
	return away > 1 ? 1 : away == 1 ? w->p->share_next : w->p->share_wall;
}
static quern_real share_along(const grid_work *w, const int32_t at[3], uint32_t k) {
	const int32_t near = cells_to_face(w->g, at, k), far = w->g->cells[k] - near;
	return w->g->periodic[k] ? 1 : share_at(w, near) - (1 - share_at(w, far));
}

/* Of that the part before a surface in the distance `gap`; a face of the domain may be `away` cells off behind it, or many. */
enum { MANY = 9 };
static quern_real share_before(const grid_work *w, int32_t away, quern_real gap) {
	const quern_bound *shape = &w->s->slot[SLOT_SHAPE][0];
	const quern_shape_ops *ops = shape->ops;
	const quern_real from = -gap / w->g->cell;
	if (ops->beyond) return ops->beyond(shape->self, away, from);
	return cut_hat_beyond(fmax(from, -away)) + share_at(w, away) - (away ? 1 : 0.5);
}

/* Cells that a node's function may reach. */
static const quern_real widest = 1.5;

static uint32_t axis_nearest(const near_nodes *n, uint32_t i, uint32_t dim) {
	uint32_t axis = 0;
	for (uint32_t k = 1; k < dim; k++)
		if (fabs(n->normal[k][i]) > fabs(n->normal[axis][i])) axis = k;
	return axis;
}

/* Sets a node's velocity and books the impulse that it takes. */
QUERN_INLINE void change_velocity(
	quern_row *motion, uint32_t k, uint32_t dim, quern_real v, quern_real mass, quern_real *impulse) {
	const quern_real jump = v - (*motion)[k];
	(*motion)[k] = v;
	(*motion)[motion_change(dim) + k] += jump;
	impulse[k] += mass * jump;
}

/* m^2 (2-D: m): the part of a body's surface that the node bears. Nodes of one column along the axis that the normal is
 * nearest to share the column's part; where more than one of them is in the body each is taken for the only one. */
static quern_real node_area(const grid_work *w, const near_nodes *n, uint32_t b, uint32_t i) {
	const uint32_t axis = axis_nearest(n, i, w->g->dim);
	quern_real area = 1;
	int32_t at[3];
	quern_grid_cell_of(w->g, b * N + i, at);
	for (uint32_t k = 0; k < w->g->dim; k++)
		if (k != axis) area *= w->g->cell * share_along(w, at, k);
	return area / fabs(n->normal[axis][i]);
}

static rough_law law_of(const rough_law *material, const body_item *item) {
	if (isnan(item->slow)) return *material;
	return (rough_law) {
		.slow = item->slow, .fast = item->fast, .number = item->number, .density = material->density
	};
}

/* Between slip and sticky: what presses the node on the body lets it rub. After a coupling that is what has come since;
 * of what sticking has not used before, `grip` is the rest. */
static void rub_node(const grid_work *w, const body_item *item, const near_nodes *n, uint32_t b, uint32_t i,
	quern_real mass, quern_row *motion, quern_real *impulse) {
	const uint32_t dim = w->s->dim;
	quern_real into = 0, along2 = 0, along[3] = { 0 };
	for (uint32_t k = 0; k < dim; k++) into += ((*motion)[k] - n->velocity[k][i]) * n->normal[k][i];
	const quern_real pressed = into < 0 ? -into : 0, grip = w->again ? (*motion)[motion_grip(dim)] : 0;
	if (!(pressed > 0 || grip > 0)) return;
	for (uint32_t k = 0; k < dim; k++) {
		along[k] = (*motion)[k] - n->velocity[k][i] - into * n->normal[k][i];
		along2 += along[k] * along[k];
	}
	const rough_law law = law_of(&w->p->rubbing, item);
	const quern_real speed = sqrt(along2), moving = speed > grip ? speed - grip : 0;
	const quern_real pressure = mass * pressed / (node_area(w, n, b, i) * w->s->dt);
	const quern_real left = rough_slide(&law, rough_half(&law, item->slip, pressure), moving, pressed);
	const quern_real kept = speed > 0 ? left / speed : 0, unused = pressed * law.slow + grip - speed;
	for (uint32_t k = 0; k < dim; k++)
		change_velocity(motion, k, dim,
			n->velocity[k][i] + kept * along[k] + (into + pressed) * n->normal[k][i], mass, impulse);
	if (!w->again) (*motion)[motion_grip(dim)] += unused > 0 ? unused : 0;
	else (*motion)[motion_grip(dim)] = unused > 0 ? unused : 0;
}

static void meet_body(const body_item *item, const near_nodes *n, uint32_t i, uint32_t dim, quern_real mass,
	quern_row *motion, quern_real *impulse) {
	quern_real into = 0, along2 = 0, along[3] = { 0 };
	for (uint32_t k = 0; k < dim; k++) into += ((*motion)[k] - n->velocity[k][i]) * n->normal[k][i];
	if (item->boundary == BOUNDARY_STICKY && isnan(item->friction)) {
		for (uint32_t k = 0; k < dim; k++) change_velocity(motion, k, dim, n->velocity[k][i], mass, impulse);
		return;
	}
	if (!(into < 0)) return;
	for (uint32_t k = 0; k < dim; k++) {
		along[k] = (*motion)[k] - n->velocity[k][i] - into * n->normal[k][i];
		along2 += along[k] * along[k];
	}
	const quern_real speed = sqrt(along2), rubbed = isnan(item->friction) ? 0 : -item->friction * into;
	const quern_real kept = rubbed < speed ? 1 - rubbed / speed : rubbed > 0 ? 0 : 1;
	for (uint32_t k = 0; k < dim; k++)
		change_velocity(motion, k, dim, n->velocity[k][i] + kept * along[k], mass, impulse);
}

/* The same, with the moment of what it takes and the work that this does, if somebody asks for them. */
static void touch_node(const grid_work *w, uint32_t j, const near_nodes *n, uint32_t b, uint32_t i,
	quern_real mass, quern_row *motion, quern_real *booked) {
	const body_item *item = w->s->slot[SLOT_BODIES][j].item;
	const uint32_t dim = w->s->dim;
	quern_real given[3] = { 0 };
	if (isnan(item->slip)) meet_body(item, n, i, dim, mass, motion, given);
	else rub_node(w, item, n, b, i, mass, motion, given);
	for (uint32_t k = 0; k < dim; k++) booked[B_IMPULSE + k] += given[k];
	if (!w->twists) return;
	quern_real x[3] = { 0 };
	for (uint32_t k = 0; k < dim; k++) x[k] = quern_motion_bring(&w->pose[j], k, n->position[k][i]);
	const quern_vec arm = quern_vec_sub(QUERN_VEC_OF(x), QUERN_VEC_OF(w->pose[j].pivot));
	body_book_twist(booked, quern_vec_cross(arm, QUERN_VEC_OF(given)), 1, dim);
	booked[B_WORK] += quern_vec_dot(QUERN_VEC_OF(given), QUERN_VEC_AT(n->velocity, i, dim), 3);
}

/* A node within a body that turns moves as the body does there, not as its surface: what turns with the body is not sheared. */
static void move_within(
	const quern_pose *pose, quern_real displacement, uint32_t dim, near_nodes *n, uint32_t i) {
	const quern_real distance = n->gap[i] + displacement;
	const quern_vec way = quern_vec_scale(distance, QUERN_VEC_AT(n->normal, i, dim)),
					more = quern_vec_cross(QUERN_VEC_OF(pose->spin), way);
	n->velocity[0][i] += more.x, n->velocity[1][i] += more.y;
	if (dim == 3) n->velocity[2][i] += more.z;
}

static bool body_is_far(const quern_bound *body, const quern_real first[3], quern_body_batch batch,
	quern_real cell, quern_real extent) {
	near_nodes one;
	for (uint32_t k = 0; k < batch.dim; k++) {
		one.position[k][0] = first[k] + 0.5 * extent;
		for (uint32_t i = 1; i < QUERN_LANES; i++) one.position[k][i] = one.position[k][0];
		batch.position[k] = one.position[k];
		batch.normal[k] = one.normal[k];
		batch.velocity[k] = one.velocity[k];
	}
	/* sqrt(3)/2 and a little, and the cells in which a body takes room */
	const quern_real reach = 0.9 * extent + widest * cell + ((const body_item *)body->item)->displacement;
	for (uint32_t i = 0; i < QUERN_LANES; i++) one.radius[i] = reach;
	batch.n = 1;
	batch.cap = QUERN_LANES;
	batch.radius = one.radius;
	batch.gap = one.gap;
	((const quern_body_ops *)body->ops)->closest(body->self, &batch);
	return one.gap[0] > 0;
}

static void bring_nodes(const body_pose *pose, uint32_t dim, near_nodes *n) {
	quern_motion_bring_all(pose, dim, N,
		(const quern_real *const[3]) { n->position[0], n->position[1], n->position[2] },
		(quern_real *const[3]) { n->own[0], n->own[1], n->own[2] });
}

/* A plane on a face of the domain is that face. */
static bool is_face(const grid_work *w, const near_nodes *n, uint32_t b, uint32_t i) {
	int32_t at[3];
	const uint32_t k = axis_nearest(n, i, w->g->dim);
	quern_grid_cell_of(w->g, b * N + i, at);
	const int32_t away = n->normal[k][i] > 0 ? at[k] : w->g->cells[k] - at[k];
	return !w->g->periodic[k] && fabs(n->normal[k][i]) > 1 - 1e-9 &&
		   fabs(n->gap[i] - away * w->g->cell) < 1e-6 * w->g->cell;
}

/* The faces of the domain come first among a node's surfaces, so that a body just before one does not take its half again. */
static void begin_room(const grid_work *w, uint32_t b, uint32_t i, near_nodes *n) {
	int32_t at[3];
	quern_grid_cell_of(w->g, b * N + i, at);
	for (uint32_t k = 0; k < w->g->dim; k++) {
		const quern_real share = share_along(w, at, k);
		if (!(share < 1)) continue;
		const uint32_t q = n->surfaces[i]++;
		n->room[q][i] = share;
		n->faced[q][i] = cells_to_face(w->g, at, k);
		n->opposite[q][i] = w->g->cells[k] - n->faced[q][i];
		for (uint32_t m = 0; m < w->g->dim; m++) n->facing[q][m][i] = 0;
		n->facing[q][k][i] = at[k] < w->g->cells[k] - at[k] ? 1 : -1;
	}
}

/* Cosine of the angle within which surfaces face the same way. */
static const quern_real alike = 0.7;

/* Surfaces that face the same way are one, of which the nearest counts; two that face each other both take; what stands across multiplies. What the
 * opposite face of a narrow domain takes is taken already. */
static void take_room(const grid_work *w, uint32_t b, uint32_t i, near_nodes *n) {
	const quern_real gap = n->gap[i], share = share_before(w, MANY, gap);
	uint32_t q = 0;
	if (w->again || !(share < 1) || isnan(gap) || is_face(w, n, b, i)) return;
	if (!n->surfaces[i]) begin_room(w, b, i, n);
	for (; q < n->surfaces[i]; q++) {
		quern_real along = 0;
		for (uint32_t k = 0; k < w->g->dim; k++) along += n->facing[q][k][i] * n->normal[k][i];
		if (fabs(along) < alike) continue;
		const quern_real across = share_at(w, n->opposite[q][i]);
		n->room[q][i] = along > 0 ? fmin(n->room[q][i], share_before(w, n->faced[q][i], gap) - (1 - across))
								  : fmax(0, n->room[q][i] + share_before(w, n->opposite[q][i], gap) - across);
		return;
	}
	if (q == SURFACES) {
		n->room[q - 1][i] *= share;
		return;
	}
	n->surfaces[i] = q + 1;
	n->room[q][i] = share;
	n->faced[q][i] = n->opposite[q][i] = MANY;
	for (uint32_t k = 0; k < w->g->dim; k++) n->facing[q][k][i] = n->normal[k][i];
}

/* The same of the hat around the centre of the cell above the node, at a face of the domain, which folds it. Before bodies elsewhere nodes are silent, and
 * nobody asks. */
static void take_count(const grid_work *w, uint32_t b, uint32_t i, near_nodes *n) {
	const quern_real cell = w->g->cell;
	const uint32_t k = axis_nearest(n, i, w->g->dim);
	int32_t at[3];
	quern_real gap = n->gap[i];
	for (uint32_t m = 0; m < w->g->dim; m++) gap += 0.5 * cell * n->normal[m][i];
	if (w->again || !(gap < cell)) return;
	quern_grid_cell_of(w->g, b * N + i, at);
	const bool folded = !w->g->periodic[k] && fabs(n->normal[k][i]) > alike &&
						at[k] == (n->normal[k][i] > 0 ? 0 : w->g->cells[k] - 1);
	if (folded) n->counted[i] *= gap > 0 ? fmin(1, 0.5 + gap / cell) : cut_hat_beyond(-gap / cell);
}

/* Whether faces of the domain leave all nodes of a block their room. */
static bool is_inside(const quern_grid_view *g, uint32_t b) {
	for (uint32_t k = 0; k < g->dim; k++) {
		const int32_t first = g->at[b][k] * (int32_t)g->edge, last = first + (int32_t)g->edge - 1;
		if (!g->periodic[k] && (first < 2 || g->cells[k] - last < 2)) return false;
	}
	return true;
}

static void measure_densities_inside(const grid_work *w, uint32_t b) {
	const quern_real volume = quern_grid_cell_volume(w->g);
	const uint32_t lane = motion_density(w->g->dim);
	for (uint32_t i = b * N; i < (b + 1) * N; i++) w->motion[i][lane] = w->node[i][0] / volume;
}

/* A node to which bodies leave hardly any room does not say how full that is; its density is marked by a sign, and its size is that of a node
 * with the least room that says something. What is counted around a cell's centre becomes that of a whole one. */
static void measure_densities(const grid_work *w, uint32_t b, const near_nodes *n) {
	const quern_real least = 0.2, volume = quern_grid_cell_volume(w->g);
	for (uint32_t i = 0; i < N; i++) {
		quern_real faces = 1, bodies = 1;
		int32_t at[3];
		quern_grid_cell_of(w->g, b * N + i, at);
		for (uint32_t k = 0; k < w->g->dim; k++) faces *= share_along(w, at, k);
		for (uint32_t q = 0; q < n->surfaces[i]; q++) bodies *= n->room[q][i];
		if (n->surfaces[i]) bodies /= faces; /* which are among them */
		const quern_real density = w->node[(size_t)b * N + i][0] / (volume * faces * fmax(bodies, least));
		if (w->p->alone) w->node[(size_t)b * N + i][node_held(w->g->dim)] /= fmax(n->counted[i], least);
		w->motion[(size_t)b * N + i][motion_density(w->g->dim)] = bodies > least ? density : -density;
	}
}

static void place_nodes(const grid_work *w, uint32_t b, near_nodes *n) {
	for (uint32_t i = 0; i < N; i++) {
		quern_real x[3];
		quern_grid_corner(w->g, b * N + i, x);
		for (uint32_t k = 0; k < w->s->dim; k++) n->position[k][i] = x[k];
		n->surfaces[i] = 0;
		n->counted[i] = 1;
	}
}

/* False where no body is near, and nothing is placed. */
static bool meet_bodies(const grid_work *w, uint32_t b, near_nodes *n) {
	const quern_step *s = w->s;
	bool placed = false;
	quern_real first[3];
	quern_grid_corner(w->g, b * N, first);
	quern_body_batch batch = { .n = N, .cap = N, .dim = s->dim, .radius = n->radius, .gap = n->gap };
	for (uint32_t k = 0; k < s->dim; k++) {
		batch.normal[k] = n->normal[k];
		batch.velocity[k] = n->velocity[k];
	}
	for (uint32_t j = 0; j < w->n_bodies; j++) {
		const quern_bound *body = &s->slot[SLOT_BODIES][j];
		const body_item *item = body->item;
		if (!quern_body_meets_points(body, s->settling)) continue;
		batch.pose = &w->pose[j].pose;
		if (!w->pose[j].repeats && body_is_far(body, first, batch, w->g->cell, w->g->cell * w->g->edge))
			continue;
		if (!placed) place_nodes(w, b, n);
		placed = true;
		if (w->pose[j].repeats) bring_nodes(&w->pose[j], s->dim, n);
		for (uint32_t i = 0; i < N; i++) n->radius[i] = item->displacement;
		for (uint32_t k = 0; k < s->dim; k++)
			batch.position[k] = w->pose[j].repeats ? n->own[k] : n->position[k];
		((const quern_body_ops *)body->ops)->closest(body->self, &batch);
		for (uint32_t i = 0; i < N; i++) {
			const quern_real mass = w->node[(size_t)b * N + i][0];
			if (mass > 0) take_room(w, b, i, n);
			if (mass > 0 && w->p->alone) take_count(w, b, i, n);
			if (!(mass > 0 && n->gap[i] <= 1e-9 * w->g->cell)) continue;
			move_within(batch.pose, item->displacement, s->dim, n, i);
			touch_node(w, j, n, b, i, mass, &w->motion[(size_t)b * N + i], body_booked(&w->books, b, j));
		}
	}
	return placed;
}

/* A face of the domain without a body is closed unless the scene opens it: nothing passes, nothing rubs. */
static void close_faces(const grid_work *w, uint32_t b, quern_real *impulse) {
	const quern_grid_view *g = w->g;
	for (uint32_t k = 0; k < g->dim; k++) {
		const int32_t first = g->at[b][k] * (int32_t)g->edge;
		const bool lower = first == 0 && !w->s->open[0][k],
				   upper = first + (int32_t)g->edge > g->cells[k] && !w->s->open[1][k];
		if (g->periodic[k] || (!lower && !upper)) continue;
		for (uint32_t i = 0; i < N; i++) {
			int32_t at[3];
			quern_row *motion = &w->motion[(size_t)b * N + i];
			const quern_real mass = w->node[(size_t)b * N + i][0];
			if (!(mass > 0)) continue;
			quern_grid_cell_of(g, b * N + i, at);
			if ((lower && at[k] == 0 && (*motion)[k] < 0) ||
				(upper && at[k] == g->cells[k] && (*motion)[k] > 0))
				change_velocity(motion, k, g->dim, 0, mass, impulse);
		}
	}
}

static void meet_walls(void *arg, uint32_t b, uint32_t worker) {
	const grid_work *w = arg;
	near_nodes *n = w->s->host->scratch(w->s->run, worker, sizeof *n);
	bool any = false;
	for (uint32_t i = 0; i < N && !any; i++) any = w->node[(size_t)b * N + i][0] > 0;
	if (!any || !n) return;
	const bool met = meet_bodies(w, b, n);
	if (!w->again && !met && is_inside(w->g, b)) measure_densities_inside(w, b);
	else if (!w->again) {
		if (!met) place_nodes(w, b, n);
		measure_densities(w, b, n);
	}
	close_faces(w, b, body_booked(&w->books, b, w->n_bodies));
}

/* v = v_0 + dt (f/m + g); a light node's force is limited to what a mass m_cut would feel of it. Of less mass than has an inverse a node
 * knows no velocity, and feels none of its force. */
static void move_nodes(void *arg, uint32_t b, uint32_t worker) {
	const grid_work *w = arg;
	const quern_step *s = w->s;
	const uint32_t dim = s->dim;
	const quern_real volume = quern_grid_cell_volume(w->g), share = w->p->cut > 0 ? w->p->cut : w->p->light,
					 cut = share * w->p->density * volume;
	quern_real *left = body_booked(&w->books, b, w->n_bodies) + B_IMPULSE;
	for (uint32_t i = 0; i < N; i++) {
		const quern_row row = w->node[(size_t)b * N + i];
		quern_row out = { 0 };
		const quern_real mass = row[0], one_over = mass > NO_MASS ? 1 / mass : 0,
						 limited = mass > cut ? one_over : 1 / cut;
		for (uint32_t k = 0; k < dim && !(mass > NO_MASS); k++) left[k] -= s->dt * row[node_force(dim) + k];
		for (uint32_t k = 0; k < dim && mass > NO_MASS; k++) {
			const quern_real force = row[node_force(dim) + k],
							 change = s->dt * (force * limited + s->gravity[k]);
			out[k] = row[1 + k] * one_over + change;
			out[motion_change(dim) + k] = change;
			left[k] -= mass > cut ? 0 : s->dt * force * (1 - mass * limited);
		}
		w->motion[(size_t)b * N + i] = out;
	}
	meet_walls(arg, b, worker);
}

static bool prepare(grid_work *w, quern_column node, quern_column motion) {
	const quern_step *s = w->s;
	w->g = s->host->grid(s->run);
	w->n_bodies = s->n_slot[SLOT_BODIES];
	w->node = (quern_row *)(void *)node.real[0];
	w->motion = (quern_row *)(void *)motion.real[0];
	/* a wall moves on by half a step until its nodes do */
	w->pose = quern_body_poses(s, SLOT_BODIES, s->time, s->time + 0.5 * s->dt);
	return body_books_open(&w->books, s, w->g->n_blocks, w->n_bodies) && w->pose;
}

quern_status quern_mpm_nodes(const void *self, const quern_step *s) {
	grid_work w = { .p = self, .s = s };
	w.twists = s->use[NODES_TWIST].real[0] || s->use[NODES_WORK].real[0];
	if (!prepare(&w, s->use[NODES_NODE], s->use[NODES_MOTION])) return QUERN_E_MEMORY;
	s->host->parallel(s->run, w.g->n_blocks, move_nodes, &w);
	body_books_close(&w.books, s, w.g->n_blocks, w.g->by_place, &s->use[NODES_IMPULSE], &s->use[NODES_TWIST],
		&s->use[NODES_WORK], &s->use[NODES_FACES]);
	return QUERN_OK;
}

/* Without a coupling in between, the conditions still hold. */
quern_status quern_mpm_walls(const void *self, const quern_step *s) {
	grid_work w = { .p = self, .s = s, .again = true };
	if (!s->host->has(s->run, "hybrid")) return QUERN_OK;
	w.twists = s->use[WALLS_TWIST].real[0] || s->use[WALLS_WORK].real[0];
	if (!prepare(&w, s->use[WALLS_NODE], s->use[WALLS_MOTION])) return QUERN_E_MEMORY;
	s->host->parallel(s->run, w.g->n_blocks, meet_walls, &w);
	body_books_close(&w.books, s, w.g->n_blocks, w.g->by_place, &s->use[WALLS_IMPULSE], &s->use[WALLS_TWIST],
		&s->use[WALLS_WORK], &s->use[WALLS_FACES]);
	return QUERN_OK;
}
