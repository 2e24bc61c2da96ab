/* SPDX-License-Identifier: MIT */
/* forces - the stage that takes most of a run: block by block, distance test, laws, sums and integration.
 *
 * A block's grains are written by one worker alone. A pair inside a block is computed once; a pair across two blocks
 * once in each, with the same operands in the same order, so both see the same force. Sums run in list order. */
#include "packed.h"
#include <math.h>
#include <string.h>

static const quern_real NO_TIME = 1e-300; /* s; a law may divide by it */

typedef struct {
	char *base; /* NULL: only measured */
	size_t used;
} carver;

/* A line of the cache or more lies free behind it. */
static void *carve(carver *c, size_t bytes) {
	void *memory = c->base ? c->base + c->used : NULL;
	c->used += (bytes + 127) & ~(size_t)63;
	return memory;
}

static void carve_columns(carver *c, quern_real **column, uint32_t n, uint32_t cap) {
	for (uint32_t k = 0; k < n; k++) column[k] = carve(c, cap * sizeof(quern_real));
}

/* A law's rows need a number each, of whatever kind; those of grains one for the second grain too. */
static void carve_rows(const forces_shared *sh, forces_work *w, carver *c) {
	const uint32_t dim = sh->s->dim;
	uint32_t n = 0, at = 0;
	for (uint32_t l = 0; l < sh->n_laws; l++) n += sh->s->slot[SLOT_CONTACT][l].n_uses;
	law_row *rows = w->rows = carve(c, n * sizeof *rows);
	for (uint32_t l = 0; l < sh->n_laws; l++) {
		const quern_bound *law = &sh->s->slot[SLOT_CONTACT][l];
		for (uint32_t r = 0; r < law->n_uses; r++, at++)
			for (uint32_t k = 0; k < quern_shape_size(law->uses[r].shape, dim); k++) {
				void *mine = carve(c, sh->cap * sizeof(quern_real));
				void *other =
					quern_dem_is_history(&law->uses[r]) ? NULL : carve(c, sh->cap * sizeof(quern_real));
				if (rows) rows[at].mine[k] = mine, rows[at].other[k] = other;
			}
	}
}

static void carve_means(const forces_shared *sh, forces_work *w, carver *c) {
	const uint32_t dim = sh->s->dim;
	memcpy(w->mean_velocity, w->velocity,
		sizeof w->velocity); /* where they are not made apart they are the same */
	memcpy(w->mean_spin, w->spin, sizeof w->spin);
	if (!sh->means) return;
	carve_columns(c, w->mean_velocity, dim, sh->cap);
	if (sh->spin) carve_columns(c, w->mean_spin, dim == 3 ? 3 : 1, sh->cap);
}

/* Lays the columns out from `base`; with base NULL it only measures. Returns the bytes. */
static size_t lay_out(const forces_shared *sh, forces_work *w, char *base) {
	carver c = { base, 0 };
	const uint32_t cap = sh->cap, dim = sh->s->dim;
	*w = (forces_work) { 0 };
	carve_columns(&c, &w->overlap, 1, cap);
	carve_columns(&c, w->normal, dim, cap);
	carve_columns(&c, w->velocity, dim, cap);
	carve_columns(&c, &w->radius, 1, cap);
	carve_columns(&c, &w->mass, 1, cap);
	carve_columns(&c, &w->weight, 1, cap);
	carve_columns(&c, w->force, dim, cap);
	if (sh->works || sh->books) carve_columns(&c, w->wall, dim, cap);
	if (sh->boxed) carve_columns(&c, w->crossed, dim, cap);
	carve_columns(&c, w->arm, 2, cap);
	if (sh->spin) {
		carve_columns(&c, w->spin, dim == 3 ? 3 : 1, cap);
		if (dim == 2) carve_columns(&c, &w->planar, 1, cap);
		if (dim == 3) carve_columns(&c, w->turn, 3, cap);
	}
	carve_means(sh, w, &c);
	if (sh->couple) carve_columns(&c, w->couple, dim == 3 ? 3 : 1, cap);
	if (sh->books || sh->looks) {
		if (sh->couple) carve_columns(&c, w->drag_couple, dim == 3 ? 3 : 1, cap);
		carve_columns(&c, w->dashpot, dim, cap);
		carve_columns(&c, &w->stored, 1, cap);
		carve_columns(&c, &w->sheared, 1, cap);
		carve_columns(&c, &w->rubbed, 1, cap);
	}
	carve_rows(sh, w, &c);
	w->first = carve(&c, cap * sizeof(int32_t));
	w->second = carve(&c, cap * sizeof(int32_t));
	w->slot = carve(&c, cap * sizeof(int32_t));
	w->near = carve(&c, (cap / COMPRESS + 1) * sizeof(compress_bits));
	if (sh->d->features) w->feature = carve(&c, cap * sizeof(int32_t));
	carve_columns(&c, w->grains, N_GRAIN_COLUMNS, GRAINS);
	const quern_bound *integrator = dem_integrator(sh->s);
	for (uint32_t r = 0; r < integrator->n_uses && sh->looks; r++)
		carve_columns(&c, w->own[r], quern_shape_size(integrator->uses[r].shape, dim), GRAINS);
	w->row = carve(&c, ((size_t)sh->most_grains + 4) * sizeof *w->row);
	if (sh->couple) w->couple_row = carve(&c, ((size_t)sh->most_grains + 1) * sizeof *w->row);
	if (sh->books && dim == 3) w->drag_row = carve(&c, ((size_t)sh->most_grains + 1) * sizeof *w->drag_row);
	return c.used + 64;
}

/* ---- the stage ---- */
static void move_block(void *arg, uint32_t b, uint32_t worker) {
	const forces_shared *sh = arg;
	forces_work w;
	char *base = sh->s->host->scratch(sh->s->run, worker, sh->bytes);
	if (!base) return;
	lay_out(sh, &w, base);
	const uint32_t n = sh->grain[b + 1] - sh->grain[b];
	quern_real *sums = sh->sums + (size_t)b * N_ENERGIES;
	memset(w.row, 0, ((size_t)n + 1) * sizeof *w.row);
	if (w.couple_row) memset(w.couple_row, 0, ((size_t)n + 1) * sizeof *w.row);
	if (w.drag_row) memset(w.drag_row, 0, ((size_t)n + 1) * sizeof *w.drag_row);
	if (sh->contact) quern_dem_pairs(sh, &w, b, sums);
	if (sh->touch) quern_dem_touches(sh, &w, b, sums);
	quern_dem_fold_couples(sh, &w, n);
	quern_dem_integrate(sh, &w, b, sums);
	if (sh->checks) quern_dem_check_grains(sh, b);
}

static void pack_block(void *arg, uint32_t b, uint32_t worker) {
	(void)worker;
	quern_dem_pack(arg, b);
}

/* Rows of all grains lie behind what the first worker takes, which asks for no more than that and so leaves them where they
 * are: they need no zeros, which the host's memory would get first. */
static bool pack_grains(forces_shared *sh, const quern_set_view grains) {
	const quern_step *s = sh->s;
	const size_t own = (sh->bytes + 63) & ~(size_t)63, row = sizeof *sh->place,
				 motions = packed_motions((int)s->dim), means = sh->means ? motions : 0;
	char *base = s->host->scratch(s->run, 0, own + (1 + motions + means) * row * grains.n);
	if (!base) return false;
	sh->motion = (lanes4 *)(void *)(base + own);
	sh->place = sh->motion + motions * (size_t)grains.n;
	sh->mean = means ? sh->place + grains.n : NULL;
	s->host->parallel(s->run, grains.n_blocks, pack_block, sh);
	return true;
}

/* All blocks: the same whether they move or are looked at. */
static bool act_on_blocks(forces_shared *sh, const quern_set_view grains) {
	forces_work w;
	sh->bytes = lay_out(sh, &w, NULL);
	if ((sh->contact || sh->predicts) && !pack_grains(sh, grains)) return false;
	sh->s->host->parallel(sh->s->run, grains.n_blocks, move_block, sh);
	return true;
}

static bool any_couples(const quern_step *s) {
	for (uint32_t l = 0; l < s->n_slot[SLOT_CONTACT]; l++)
		for (uint32_t r = 0; r < s->slot[SLOT_CONTACT][l].n_uses; r++)
			if (!strcmp(s->slot[SLOT_CONTACT][l].uses[r].field, "contact.couple")) return true;
	return false;
}

static bool asks_for_means(const quern_step *s) {
	for (uint32_t l = 0; l < s->n_slot[SLOT_CONTACT]; l++)
		if (((const quern_contact_ops *)s->slot[SLOT_CONTACT][l].ops)->means) return true;
	return false;
}

static bool prepare_box(forces_shared *sh, quern_real ahead, uint32_t n_blocks) {
	const quern_step *s = sh->s;
	sh->boxed = true;
	sh->box = dem_box_at(s, &s->use[FORCE_BOX_LENGTH]);
	sh->box_then = dem_box_after(&sh->box, (1 - ahead) * s->dt);
	for (uint32_t k = 0; k < s->dim; k++) quern_images_set(&sh->images, k, true, sh->box.length[k]);
	sh->box_sums = s->host->memory(s->run, (size_t)n_blocks * N_BOX_SUMS * sizeof(quern_real));
	return sh->box_sums;
}

static bool prepare(forces_shared *sh, const quern_set_view grains) {
	const quern_step *s = sh->s;
	const quern_set_view contacts = s->host->set(s->run, "contact"), touches = s->host->set(s->run, "touch");
	const quern_integrator_ops *integrator = dem_integrator(s)->ops;
	sh->use = s->use;
	/* springs are where the last forces were, grains have gone on since */
	const quern_real ahead = quern_integrator_ahead(integrator, s->dim), left = 1 - ahead;
	sh->dt = !sh->looks ? s->dt : left > 0 ? fmax(left * s->dt, NO_TIME) : NO_TIME;
	sh->waits =
		ahead < 1 ? 0 : 1; /* the half of a kick that `open` of the next step gives is as large as this one */
	sh->cap = s->batch;
	sh->n_bodies = s->n_slot[SLOT_BODIES];
	sh->n_laws = s->n_slot[SLOT_CONTACT];
	sh->couple = any_couples(s);
	sh->predicts = !sh->looks && integrator->predict[s->dim - 2];
	sh->means = sh->predicts && asks_for_means(s);
	sh->spin = s->use[FORCE_OLD_SPIN].real[0] != NULL;
	sh->books = !sh->looks && !s->settling && (s->use[FORCE_DAMPED].real[0] || s->use[FORCE_RUBBED].real[0]);
	if (!quern_dem_find_history(sh)) return false;
	sh->material = sh->d->pairs.n ? s->use[FORCE_MATERIAL].index : NULL;
	sh->grain = grains.block;
	sh->by_place = s->host->parts(s->run, "grain")->by_place;
	sh->contact = contacts.block;
	sh->touch = touches.n ? touches.block : NULL;
	for (uint32_t b = 0; b < grains.n_blocks; b++) {
		const uint32_t n = grains.block[b + 1] - grains.block[b];
		sh->most_grains = n > sh->most_grains ? n : sh->most_grains;
	}
	sh->images = quern_images_of(s->dim, s->lower, s->upper, s->periodic);
	if (sh->d->boxed && !prepare_box(sh, ahead, grains.n_blocks)) return false;
	sh->opens = integrator->open[s->dim - 2] && !sh->boxed;
	/* an integrator in two parts has moved the grains on already: bodies are where they will be then */
	const quern_real now = s->time + ((quern_real)s->within + (sh->looks ? 0 : ahead)) * s->dt;
	sh->pose = quern_body_poses(s, SLOT_BODIES, now, now);
	sh->mean_pose = sh->means ? quern_body_poses(s, SLOT_BODIES, now, now - 0.5 * s->dt) : NULL;
	if (!sh->pose || (sh->means && !sh->mean_pose)) return false;
	sh->works = !sh->looks && s->use[FORCE_WORK].real[0];
	sh->twists = !sh->looks && s->use[FORCE_TWIST].real[0];
	sh->sums = s->host->memory(s->run, (size_t)grains.n_blocks * N_ENERGIES * sizeof(quern_real));
	sh->farthest = s->host->memory(s->run, (size_t)grains.n_blocks * sizeof(quern_real));
	sh->ways = s->host->memory(s->run, (size_t)grains.n_blocks * sizeof(ways));
	sh->turned = s->host->memory(s->run, (size_t)grains.n_blocks * 2 * sizeof(quern_real));
	sh->bad = s->host->memory(s->run, (size_t)grains.n_blocks * sizeof(int32_t));
	quern_dem_decide_checks(sh);
	sh->outside = s->host->memory(s->run, (size_t)grains.n_blocks * sizeof(int32_t));
	if (sh->deep) {
		sh->worst = s->host->memory(s->run, (size_t)grains.n_blocks * sizeof(deep_contact));
		sh->watched = s->host->memory(s->run, (size_t)grains.n_blocks * sizeof(deep_contact));
		if (!sh->worst || !sh->watched) return false;
	}
	if (!sh->bad || !sh->outside) return false;
	for (uint32_t b = 0; b < grains.n_blocks; b++) sh->bad[b] = sh->outside[b] = -1;
	return body_books_open(&sh->books_of_bodies, s, grains.n_blocks, sh->n_bodies) && sh->sums &&
		   sh->farthest && sh->ways && sh->turned;
}

/* How far bodies have come at most since the last list: at the speed at the beginning of the step or at its end. */
static quern_real sweep(const forces_shared *sh) {
	const quern_step *s = sh->s;
	quern_real *swept = sh->use[FORCE_SWEPT].real[0];
	if (!swept || s->settling) return 0;
	const quern_real now = s->time + (quern_real)s->within * s->dt;
	*swept += quern_bodies_speed(s, SLOT_BODIES, now - s->dt, now + 2 * s->dt) * s->dt;
	return *swept;
}

/* Blocks in the order of their places, so that sums do not depend on who did what. */
static void collect(const forces_shared *sh, uint32_t n_blocks) {
	const quern_step *s = sh->s;
	const quern_column *u = sh->use;
	quern_real farthest = 0, *displacement = u[FORCE_DISPLACEMENT].real[0];
	quern_real energy[N_ENERGIES] = { 0 };
	for (uint32_t q = 0; q < n_blocks; q++) {
		const uint32_t b = quern_nth(sh->by_place, q);
		const quern_real way = sqrt(sh->farthest[b]);
		farthest = way > farthest ? way : farthest;
		for (int e = 0; e < N_ENERGIES; e++) energy[e] += sh->sums[(size_t)b * N_ENERGIES + (uint32_t)e];
	}
	if (!s->settling)
		body_books_close(&sh->books_of_bodies, s, n_blocks, sh->by_place, &u[FORCE_IMPULSE], &u[FORCE_TWIST],
			&u[FORCE_WORK], &u[FORCE_SUPPORT]);
	const bool alone = (s->settling || !u[FORCE_LENT].real[0]) && !sh->boxed;
	/* where ways are measured elsewhere they are 0 here, and bodies have come as far */
	*displacement =
		fmax(*displacement, quern_dem_used_of_skin(s, sh->ways, n_blocks, farthest, sweep(sh), alone));
	if (sh->boxed) quern_dem_box_collect(sh, n_blocks);
	if (u[FORCE_DAMPED].real[0]) u[FORCE_DAMPED].real[0][0] += energy[E_DAMPED];
	if (u[FORCE_RUBBED].real[0]) u[FORCE_RUBBED].real[0][0] += energy[E_RUBBED];
}

static quern_status lost(const forces_shared *sh, int32_t i) {
	const quern_column *u = sh->use;
	const quern_step *s = sh->s;
	const quern_real v2 = cloud_square(&u[FORCE_VELOCITY], (uint32_t)i, s->dim);
	const char *law = sh->n_laws ? s->slot[SLOT_CONTACT][0].id : "gravity";
	quern_real turn2 = 0;
	for (uint32_t k = 0; k < (s->dim == 3 ? 3u : 1u) && sh->spin; k++)
		turn2 += u[FORCE_SPIN].real[k][i] * s->dt * (u[FORCE_SPIN].real[k][i] * s->dt);
	if (isfinite(v2) && !(turn2 <= 1))
		return s->host->stop(s->run, QUERN_E_NUMERIC, "grain", u[FORCE_ID].id[i],
			"grain.spin turns it by %.3g radian in one step of %.3g s (%s): unstable, or the spin is absurd",
			sqrt(turn2), s->dt, law);
	if (!isfinite(v2))
		return s->host->stop(s->run, QUERN_E_NUMERIC, "grain", u[FORCE_ID].id[i],
			"grain.velocity is not a number after %s: is the step of %.3g s too long?", law, s->dt);
	return s->host->stop(s->run, QUERN_E_NUMERIC, "grain", u[FORCE_ID].id[i],
		"grain.velocity of %.3g m/s moves it by %.2g of its radius in one step of %.3g s (%s): unstable, or "
		"the stiffness "
		"is too low for such speeds",
		sqrt(v2), sqrt(v2) * s->dt / u[FORCE_RADIUS].real[0][i], s->dt, law);
}

/* A step within the limit turns a contact's motion in three steps at the least, so that the velocities of a whole set
 * point back in fewer than every second one. A step too long turns them in every one, and where dashpots and friction
 * eat what it makes the grains tremble for ever, without a blow-up. docs/stability.md, section 1 */
static quern_status look_for_trembling(const forces_shared *sh, uint32_t n_blocks) {
	enum { MOST = 200 };
	const quern_step *s = sh->s;
	int32_t *score = sh->use[FORCE_TREMBLING].index;
	quern_real turned = 0, mass = 0;
	for (uint32_t q = 0; q < n_blocks; q++) {
		const uint32_t b = quern_nth(sh->by_place, q);
		turned += sh->turned[2 * b], mass += sh->turned[2 * b + 1];
	}
	const quern_real way = 1e-9 * sh->d->material[0].radii.mean; /* below that it may be round-off */
	if (-turned * s->dt * s->dt > mass * way * way) ++*score;
	else if (*score) --*score;
	if (*score < MOST) return QUERN_OK;
	return s->host->stop(s->run, QUERN_E_NUMERIC, "grain", -1,
		"most steps of %.3g s turn back the velocities of all grains: they tremble, since the step is too "
		"long for "
		"their contacts (%s)",
		s->dt, sh->n_laws ? s->slot[SLOT_CONTACT][0].id : "gravity");
}

quern_status quern_dem_forces(const void *self, const quern_step *s) {
	forces_shared sh = { .d = self, .s = s };
	const quern_set_view grains = s->host->set(s->run, "grain");
	if (!grains.n) return QUERN_OK;
	if (!prepare(&sh, grains)) return QUERN_E_MEMORY;
	if (!act_on_blocks(&sh, grains)) return QUERN_E_MEMORY;
	for (uint32_t q = 0; q < grains.n_blocks; q++)
		if (sh.bad[quern_nth(sh.by_place, q)] >= 0) return lost(&sh, sh.bad[quern_nth(sh.by_place, q)]);
	collect(&sh, grains.n_blocks);
	quern_status status = sh.checks ? quern_dem_judge_grains(&sh, grains.n_blocks) : QUERN_OK;
	if (status == QUERN_OK && sh.deep) status = quern_dem_judge_contacts(&sh, grains.n_blocks);
	return status == QUERN_OK ? look_for_trembling(&sh, grains.n_blocks) : status;
}

/* ---- when somebody looks ---- */

/* The forces of the state as it is, and the kick that they would give: nothing moves, nothing is remembered. Before the
 * first step there is no step's length, and no kick. */
quern_status quern_dem_observe(const void *self, const quern_step *s) {
	quern_step now = *s;
	now.dt = s->dt > 0 ? s->dt / s->n_substeps : NO_TIME;
	forces_shared sh = { .d = self, .s = &now, .looks = true };
	const quern_set_view grains = s->host->set(s->run, "grain");
	for (int e = E_KINETIC; e <= E_SHEARED && !grains.n; e++) /* the last one may have left */
		if (s->use[OBSERVE_KINETIC + e].real[0]) s->use[OBSERVE_KINETIC + e].real[0][0] = 0;
	if (!grains.n) return QUERN_OK;
	if (!prepare(&sh, grains)) return QUERN_E_MEMORY;
	if (!act_on_blocks(&sh, grains)) return QUERN_E_MEMORY;
	quern_status status = quern_dem_judge_grains(&sh, grains.n_blocks);
	if (status == QUERN_OK && sh.deep) status = quern_dem_judge_contacts(&sh, grains.n_blocks);
	if (status != QUERN_OK) return status;
	quern_real energy[N_ENERGIES] = { 0 };
	for (uint32_t q = 0; q < grains.n_blocks; q++) {
		const uint32_t b = quern_nth(sh.by_place, q);
		if (sh.bad[b] >= 0) return lost(&sh, sh.bad[b]);
		for (int e = E_KINETIC; e <= E_SHEARED; e++)
			energy[e] += sh.sums[(size_t)b * N_ENERGIES + (uint32_t)e];
	}
	for (int e = E_KINETIC; e <= E_SHEARED; e++)
		if (s->use[OBSERVE_KINETIC + e].real[0]) s->use[OBSERVE_KINETIC + e].real[0][0] = energy[e];
	return QUERN_OK;
}
