/* SPDX-License-Identifier: MIT */
/* hold - points do not go into bodies. Shape functions are folded at faces of the domain alone: near a body the nodes that
 * are free carry points on, by a part of a cell into a floor whose nodes stand still, farther where an edge lies between
 * nodes. docs/theory/mpm.md, section 3 */
#include "../common/fit.h"
#include "mpm.h"
#include <math.h>

typedef struct {
	const quern_step *s;
	const quern_grid_view *g;
	const uint32_t *point;
	const body_pose *pose; /* by body */
	bool slopes;           /* points send one that may have grown on the way that they were to go */
	bool *holds;
	int32_t *left; /* by block: whether a point has left the tile */
} hold_work;

typedef struct {
	_Alignas(64) quern_real position[3][STENCIL], own[3][STENCIL], radius[STENCIL], gap[STENCIL],
		normal[3][STENCIL], velocity[3][STENCIL];
	stencil stencil;
} held_points;

/* Bodies that stand still, within the domain. One that moves meets points with its nodes, and may pass some. */
static bool holds(const quern_bound *body, const quern_step *s) {
	const body_item *item = body->item;
	quern_real lower[3], upper[3];
	if (!quern_body_meets_points(body, s->settling) || quern_motion_is_any(&item->motion)) return false;
	((const quern_body_ops *)body->ops)->bounds(body->self, s->dim, lower, upper);
	for (uint32_t k = 0; k < s->dim; k++)
		if (!s->periodic[k] &&
			(upper[k] + item->displacement <= s->lower[k] || lower[k] - item->displacement >= s->upper[k]))
			return false;
	return true;
}

/* Points reach half a cell beyond their block, and a cell farther in the step that they leave it. */
static bool is_far(const hold_work *w, uint32_t j, uint32_t b) {
	quern_real x[3] = { 0 };
	quern_grid_corner(w->g, b * QUERN_BLOCK_CELLS, x);
	for (uint32_t k = 0; k < w->s->dim; k++) x[k] += 0.5 * w->g->edge * w->g->cell;
	const body_item *item = w->s->slot[SLOT_BODIES][j].item;
	const quern_real reach =
		0.9 * (w->g->edge + 3) * w->g->cell + item->displacement; /* sqrt(3)/2 and a little */
	return quern_body_gap(&w->s->slot[SLOT_BODIES][j], &w->pose[j], w->s->dim, x, reach, NULL) > 0;
}

static void find_gaps(const hold_work *w, uint32_t j, uint32_t begin, uint32_t n, held_points *m) {
	quern_real *const *x = w->s->use[HOLD_POSITION].real;
	const quern_bound *body = &w->s->slot[SLOT_BODIES][j];
	quern_body_batch batch = {
		.n = n, .cap = STENCIL, .dim = w->s->dim, .pose = &w->pose[j].pose, .radius = m->radius, .gap = m->gap
	};
	for (uint32_t i = 0; i < STENCIL; i++) m->radius[i] = ((const body_item *)body->item)->displacement;
	for (uint32_t k = 0; k < w->s->dim; k++) {
		for (uint32_t i = 0; i < STENCIL; i++) m->position[k][i] = x[k][begin + (i < n ? i : 0)];
		batch.normal[k] = m->normal[k];
		batch.velocity[k] = m->velocity[k];
	}
	quern_motion_bring_all(&w->pose[j], w->s->dim, STENCIL,
		(const quern_real *const[3]) { m->position[0], m->position[1], m->position[2] },
		(quern_real *const[3]) { m->own[0], m->own[1], m->own[2] });
	for (uint32_t k = 0; k < w->s->dim; k++) batch.position[k] = m->own[k];
	((const quern_body_ops *)body->ops)->closest(body->self, &batch);
}

static void keep_slope(const hold_work *w, uint32_t k, uint32_t i, quern_real there, held_points *m) {
	const quern_real lower = w->g->lower[k];
	const quern_real by = fit_held(w->g, &w->s->slot[SLOT_SHAPE][0], (int)k, there - lower,
		w->s->use[HOLD_POSITION].real[k][i] - lower, &m->stencil);
	for (uint32_t a = 0; a < w->s->dim; a++) w->s->use[HOLD_AFFINE].real[w->s->dim * a + k][i] *= by;
}

/* Back to the surface, if that is across an axis. On others, which the grid sees in steps, points may well lie behind; and
 * what is deeper than a cell is there because the body was set upon it. */
static void hold_chunk(
	const hold_work *w, uint32_t j, uint32_t b, uint32_t begin, uint32_t n, held_points *m) {
	quern_real *const *x = w->s->use[HOLD_POSITION].real;
	find_gaps(w, j, begin, n, m);
	for (uint32_t i = 0; i < n; i++) {
		if (!(m->gap[i] < 0 && m->gap[i] > -w->g->cell)) continue;
		for (uint32_t k = 0; k < w->s->dim; k++) {
			if (fabs(m->normal[k][i]) < 1) continue;
			x[k][begin + i] += m->normal[k][i] * (1e-9 * w->g->cell - m->gap[i]);
			if (w->slopes) keep_slope(w, k, begin + i, m->position[k][i], m);
			if (!stencil_holds(w->g, b, k, x[k][begin + i])) w->left[b] = 1;
		}
	}
}

static void hold_block(void *arg, uint32_t b, uint32_t worker) {
	const hold_work *w = arg;
	const uint32_t begin = w->point[b], end = w->point[b + 1];
	held_points *m = w->s->host->scratch(w->s->run, worker, sizeof *m);
	if (!m || begin == end) return;
	for (uint32_t j = 0; j < w->s->n_slot[SLOT_BODIES]; j++) {
		if (!w->holds[j] || is_far(w, j, b)) continue;
		for (uint32_t i = begin; i < end; i += STENCIL)
			hold_chunk(w, j, b, i, end - i < STENCIL ? end - i : STENCIL, m);
	}
}

quern_status quern_mpm_hold(const void *self, const quern_step *s) {
	const quern_set_view points = s->host->set(s->run, "point");
	hold_work w = { .s = s, .g = s->host->grid(s->run), .point = points.block };
	if (!points.n) return QUERN_OK;
	w.slopes = ((const mpm *)self)->moments && s->use[HOLD_AFFINE].real[0];
	w.pose = quern_body_poses_now(s, SLOT_BODIES);
	w.left = s->host->memory(s->run, w.g->n_blocks * sizeof(int32_t));
	w.holds = s->host->memory(s->run, (s->n_slot[SLOT_BODIES] + (size_t)1) * sizeof(bool));
	if (!w.pose || !w.left || !w.holds) return QUERN_E_MEMORY;
	for (uint32_t j = 0; j < s->n_slot[SLOT_BODIES]; j++) w.holds[j] = holds(&s->slot[SLOT_BODIES][j], s);
	for (uint32_t b = 0; b < w.g->n_blocks; b++) w.left[b] = 0;
	s->host->parallel(s->run, w.g->n_blocks, hold_block, &w);
	for (uint32_t b = 0; b < w.g->n_blocks; b++)
		if (w.left[b]) s->use[HOLD_UNSORTED].index[0] = 1;
	return QUERN_OK;
}
