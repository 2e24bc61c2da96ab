/* SPDX-License-Identifier: MIT */
/* checks - what is looked at now and then alone, since it costs: contacts that lie too deep for too long, and grains
 * out of the domain. docs/decisions/0015-too-deep.md */
#include "../common/outlets.h"
#include "forces.h"
#include <math.h>
#include <stdio.h>

enum { LASTS = 5 }; /* durations of a contact */

/* Steps, about a contact's duration; that of settling may be given as short as one likes. */
static uint32_t every(const forces_shared *sh) {
	const quern_real wanted = sh->s->settling ? 1 / sh->d->settle_step : 50;
	return wanted < 1e6 ? (uint32_t)wanted : 1000000;
}

void quern_dem_decide_checks(forces_shared *sh) {
	const bool regular = (sh->s->substep + 1) % every(sh) == 0;
	sh->checks = regular || sh->looks;
	sh->deep = sh->checks && sh->n_laws && sh->d->overlap_most > 0;
}

static bool is_watched(const forces_shared *sh, const deep_contact *c) {
	const quern_column *u = sh->use;
	return u[FORCE_DEEP_FIRST].real[0][0] == (quern_real)c->first &&
		   u[FORCE_DEEP_SECOND].real[0][0] == (quern_real)c->second;
}

/* Half the period of the stiffest law, and the largest stiffness that a law states; whose it is. */
static void ask_laws(
	const forces_shared *sh, deep_contact *c, int32_t item, quern_real mass, quern_real radius) {
	for (uint32_t l = 0; l < sh->n_laws; l++) {
		const quern_bound *law = &sh->s->slot[SLOT_CONTACT][l];
		const quern_contact_ops *ops = law->ops;
		const void *self = dem_law(law, item, c->second < 0 ? (int32_t)(-1 - c->second) : -1);
		const quern_real period = ops->period ? ops->period(self, sh->s->dim, mass, radius) : INFINITY;
		const quern_real k = ops->stiffness ? ops->stiffness(self, sh->s->dim, radius, c->force) : 0;
		c->period = period < c->period ? period : c->period;
		if (!c->law || k > c->stiffness) c->law = law->id, c->stiffness = k;
	}
}

/* The deeper one; of equals that of lower numbers, so that the order of blocks does not matter. */
static bool is_worse(const deep_contact *a, const deep_contact *b) {
	if (a->by != b->by) return a->by > b->by;
	return a->first != b->first ? a->first < b->first : a->second < b->second;
}

void quern_dem_check_contacts(const forces_shared *sh, const forces_work *w, const contact_chunk *chunk) {
	const uint32_t b = chunk->block;
	const quern_real *radius = sh->use[FORCE_RADIUS].real[0];
	const int64_t *id = sh->use[FORCE_ID].id;
	for (uint32_t q = 0; q < chunk->n; q++) {
		const quern_real r = radius[w->first[q]], other = radius[w->second[q]], small = r < other ? r : other;
		if (!(w->overlap[q] > sh->d->overlap_most * small)) continue;
		quern_real f2 = 0;
		for (uint32_t k = 0; k < sh->s->dim; k++) f2 += w->force[k][q] * w->force[k][q];
		deep_contact c = { .by = w->overlap[q] / small,
			.force = sqrt(f2),
			.period = INFINITY,
			.first = id[w->first[q]],
			.second = chunk->body < 0 ? id[w->second[q]] : -1 - chunk->body };
		ask_laws(sh, &c, chunk->item, w->mass[q], w->radius[q]);
		if (is_worse(&c, &sh->worst[b])) sh->worst[b] = c;
		if (!sh->looks && is_watched(sh, &c)) sh->watched[b] = c;
	}
}

void quern_dem_check_grains(const forces_shared *sh, uint32_t b) {
	const quern_step *s = sh->s;
	const quern_column *u = sh->use;
	const int32_t *fixed = u[FORCE_FIXED].index;
	const uint32_t n_spin = sh->spin ? (s->dim == 3 ? 3 : 1) : 0;
	for (uint32_t i = sh->grain[b]; i < sh->grain[b + 1]; i++) {
		quern_real turn2 = 0;
		if (fixed && fixed[i]) continue;
		for (uint32_t k = 0; k < s->dim; k++) {
			const quern_real x = u[FORCE_POSITION].real[k][i];
			if (outlet_refuses(s, k, x) && sh->outside[b] < 0) sh->outside[b] = (int32_t)i;
		}
		for (uint32_t k = 0; k < n_spin; k++)
			turn2 += u[FORCE_SPIN].real[k][i] * s->dt * (u[FORCE_SPIN].real[k][i] * s->dt);
		if (sh->n_laws && !(turn2 <= 1) && sh->bad[b] < 0) sh->bad[b] = (int32_t)i;
	}
}

/* ---- what comes of it ---- */

static quern_status stop_deep(const forces_shared *sh, const deep_contact *c, const char *how) {
	const quern_step *s = sh->s;
	char partner[BODY_WORDS + 1], which[BODY_WORDS], remedy[200] = "";
	if (c->second < 0)
		snprintf(partner, sizeof partner, "%s,",
			quern_body_say(&s->slot[SLOT_BODIES][-1 - c->second], (uint32_t)(-1 - c->second), which));
	else snprintf(partner, sizeof partner, "grain %lld", (long long)c->second);
	if (c->stiffness > 0)
		snprintf(remedy, sizeof remedy,
			": the stiffness of %.3g N/m of %s is too low for that; a hundredth of a radius asks for %.0f "
			"times as "
			"much",
			c->stiffness, c->law, 100 * c->by);
	return s->host->stop(s->run, QUERN_E_NUMERIC, "grain", c->first,
		"overlaps %s by %.2g of its radius%s and bears %.3g N there%s (grains.overlap.most allows %g)",
		partner, c->by, how, c->force, remedy, sh->d->overlap_most);
}

/* An impact may go deep for a while, and one contact after another may: so one is watched, the deepest at first,
 * until it is no longer deep. One that is watched for several of its own durations lasts; a centre behind a surface
 * is enough at once. What falls into place while settling bears the shock of all that falls behind it, which is over
 * by the release. */
quern_status quern_dem_judge_contacts(const forces_shared *sh, uint32_t n_blocks) {
	const quern_column *u = sh->use;
	deep_contact worst = { .by = 0 }, watched = { .by = 0 };
	for (uint32_t q = 0; q < n_blocks; q++) {
		const uint32_t b = quern_nth(sh->by_place, q);
		if (is_worse(&sh->worst[b], &worst)) worst = sh->worst[b];
		if (sh->watched[b].by > 0) watched = sh->watched[b];
	}
	if (worst.by >= 1) return stop_deep(sh, &worst, ", its centre behind the surface,");
	if (sh->looks)
		return QUERN_OK; /* who looks does not watch; but no frame shows a grain behind a surface */
	quern_real *time = u[FORCE_DEEP_TIME].real[0];
	if (watched.by > 0 && !sh->s->settling) {
		*time += every(sh) * sh->s->dt;
		if (*time >= LASTS * watched.period) return stop_deep(sh, &watched, " for long");
		return QUERN_OK;
	}
	*time = 0;
	u[FORCE_DEEP_FIRST].real[0][0] = worst.by > 0 ? (quern_real)worst.first : -1;
	u[FORCE_DEEP_SECOND].real[0][0] = (quern_real)worst.second;
	return QUERN_OK;
}

quern_status quern_dem_judge_grains(const forces_shared *sh, uint32_t n_blocks) {
	const quern_step *s = sh->s;
	for (uint32_t q = 0; q < n_blocks; q++) {
		const int32_t i = sh->outside[quern_nth(sh->by_place, q)];
		if (i < 0) continue;
		for (uint32_t k = 0; k < s->dim; k++) {
			const quern_real x = sh->use[FORCE_POSITION].real[k][i];
			if (outlet_refuses(s, k, x)) return quern_dem_left(s, sh->use[FORCE_ID].id[i], k, x);
		}
	}
	return QUERN_OK;
}
