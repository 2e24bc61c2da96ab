/* SPDX-License-Identifier: MIT */
/* begin - grains of another run's state: whether they can stand in this scene, and what its materials make of them */
#include "dem.h"
#include <math.h>
#include <stdio.h>

enum { WORDS = 240 };

static quern_status refuse(const quern_step *s, uint32_t i, const char *why) {
	const quern_column *u = s->use;
	return s->host->stop(s->run, QUERN_E_PARAM, "from", -1, "grain %lld, at (%g, %g, %g) m, %s",
		(long long)u[FILL_ID].id[i], u[FILL_POSITION].real[0][i], u[FILL_POSITION].real[1][i],
		s->dim == 3 ? u[FILL_POSITION].real[2][i] : 0, why);
}

static bool is_fixed(const quern_step *s, uint32_t i) {
	return s->use[FILL_FIXED].index && s->use[FILL_FIXED].index[i];
}

/* What is fixed may lie beyond the domain by its width, as in a fill. */
static bool is_inside(const quern_step *s, uint32_t i) {
	for (uint32_t k = 0; k < s->dim; k++) {
		const quern_real slack = is_fixed(s, i) || s->periodic[k] ? s->upper[k] - s->lower[k] : 0;
		const quern_real x = s->use[FILL_POSITION].real[k][i];
		if (!(x >= s->lower[k] - slack && x <= s->upper[k] + slack)) return false;
	}
	return true;
}

static bool is_sane(const quern_step *s, uint32_t i) {
	const quern_column *u = s->use;
	quern_real v[3] = { 0 }, w[3] = { 0 };
	for (uint32_t k = 0; k < s->dim; k++) v[k] = u[FILL_VELOCITY].real[k][i];
	for (uint32_t k = 0; u[FILL_SPIN].real[0] && k < (s->dim == 3 ? 3u : 1u); k++)
		w[k] = u[FILL_SPIN].real[k][i];
	return !quern_too_fast(v, 1) && !quern_too_fast(w, u[FILL_RADIUS].real[0][i]);
}

/* A bed presses into what it rests on: only what the run itself would not bear is refused. */
static bool is_clear(const dem *d, const quern_step *s, const body_pose *pose, uint32_t i, char why[WORDS]) {
	const quern_real radius = s->use[FILL_RADIUS].real[0][i];
	const quern_real most = d->overlap_most > 0 ? fmax(d->overlap_most, d->overlap_start) : 1;
	quern_real x[3] = { 0 };
	for (uint32_t k = 0; k < s->dim; k++) x[k] = s->use[FILL_POSITION].real[k][i];
	for (uint32_t b = 0; b < s->n_slot[SLOT_BODIES] && !is_fixed(s, i); b++) {
		const quern_bound *body = &s->slot[SLOT_BODIES][b];
		if (!quern_body_is_there(body, d->settles)) continue;
		const quern_real in = -quern_body_gap(body, &pose[b], s->dim, x, radius, NULL) / radius;
		char which[BODY_WORDS];
		if (!(in > (1 + 1e-9) * most)) continue;
		quern_body_say(body, b, which);
		if (in >= 1) snprintf(why, WORDS, "starts in %s, with its centre", which);
		else
			snprintf(why, WORDS, "overlaps %s, by %.2g of a radius; overlap.most allows %g", which, in, most);
		return false;
	}
	return true;
}

static quern_status check(const dem *d, const quern_step *s, const body_pose *pose, uint32_t i) {
	const quern_column *u = s->use;
	char why[WORDS];
	quern_real widest = 0;
	for (uint32_t k = 0; k < s->dim; k++) widest = fmax(widest, s->upper[k] - s->lower[k]);
	if (!(u[FILL_RADIUS].real[0][i] > 0 && u[FILL_RADIUS].real[0][i] <= 10 * widest))
		return refuse(s, i, "has a radius of no grain, or one far wider than the domain");
	if (u[FILL_MATERIAL].index &&
		(u[FILL_MATERIAL].index[i] < 0 || u[FILL_MATERIAL].index[i] >= (int32_t)d->n_materials))
		return refuse(s, i, "is of a material that this scene does not have");
	if (!is_inside(s, i)) return refuse(s, i, "lies outside of the domain");
	if (!is_sane(s, i)) return refuse(s, i, "moves or turns faster than light");
	if (d->reach > 0 && u[FILL_RADIUS].real[0][i] > (1 + 1e-9) * d->largest)
		return refuse(s, i,
			"is larger than any of this scene's materials, and the contact law acts at a distance that "
			"follows from these: let material.radius hold it");
	return is_clear(d, s, pose, i, why) ? QUERN_OK : refuse(s, i, why);
}

/* Mass follows from the radius and this scene's density, and what is fixed does not move. */
static void adopt(const dem *d, const quern_step *s, uint32_t i) {
	const quern_column *u = s->use;
	const int32_t kind = u[FILL_MATERIAL].index ? u[FILL_MATERIAL].index[i] : 0;
	u[FILL_MASS].real[0][i] = quern_radius_mass(u[FILL_RADIUS].real[0][i], d->material[kind].density, s->dim);
	if (!is_fixed(s, i)) return;
	u[FILL_FIXED].index[i] = 1;
	for (uint32_t k = 0; k < s->dim; k++) u[FILL_VELOCITY].real[k][i] = 0;
	for (uint32_t k = 0; u[FILL_SPIN].real[0] && k < (s->dim == 3 ? 3u : 1u); k++)
		u[FILL_SPIN].real[k][i] = 0;
}

quern_status quern_dem_begin(const dem *d, const quern_step *s) {
	const uint32_t n = s->host->set(s->run, "grain").n;
	const body_pose *pose = n ? quern_body_poses_now(s, SLOT_BODIES) : NULL;
	if (n && !pose) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) {
		const quern_status status = check(d, s, pose, i);
		if (status != QUERN_OK) return status;
		adopt(d, s, i);
	}
	s->use[FILL_DISPLACEMENT].real[0][0] = INFINITY;
	return QUERN_OK;
}
