/* SPDX-License-Identifier: MIT */
/* begin - points of another run's state: whether they can stand in this scene, and the rest of their state where another
 * material is at work */
#include "../common/stressed.h"
#include "mpm.h"
#include <math.h>
#include <stdio.h>

static quern_status refuse(const quern_step *s, uint32_t i, const char *why) {
	const quern_column *u = s->use;
	return s->host->stop(s->run, QUERN_E_PARAM, "from", -1, "the point at (%g, %g, %g) m %s",
		u[FILL_POSITION].real[0][i], u[FILL_POSITION].real[1][i],
		s->dim == 3 ? u[FILL_POSITION].real[2][i] : 0, why);
}

static quern_status check(const quern_step *s, uint32_t i) {
	const quern_column *u = s->use;
	quern_real v[3] = { 0 };
	for (uint32_t k = 0; k < s->dim; k++) {
		const quern_real x = u[FILL_POSITION].real[k][i],
						 slack = s->periodic[k] ? s->upper[k] - s->lower[k] : 0;
		if (!(x >= s->lower[k] - slack && x <= s->upper[k] + slack))
			return refuse(s, i, "lies outside of the domain");
		v[k] = u[FILL_VELOCITY].real[k][i];
	}
	if (!(u[FILL_MASS].real[0][i] > 0 && u[FILL_VOLUME].real[0][i] > 0))
		return refuse(s, i, "has a mass or a volume that is not above 0");
	return quern_too_fast(v, 1) ? refuse(s, i, "moves faster than light") : QUERN_OK;
}

/* Points reach into walls by a part of a cell. */
static quern_status check_bodies(const mpm *p, const quern_step *s, uint32_t n) {
	const body_pose *pose = quern_body_poses_now(s, SLOT_BODIES);
	if (!pose) return QUERN_E_MEMORY;
	for (uint32_t b = 0; b < s->n_slot[SLOT_BODIES]; b++) {
		const quern_bound *body = &s->slot[SLOT_BODIES][b];
		if (!quern_body_meets_points(body, false)) continue;
		for (uint32_t i = 0; i < n; i++) {
			quern_real x[3] = { 0 };
			char which[BODY_WORDS], why[BODY_WORDS + 60];
			for (uint32_t k = 0; k < s->dim; k++) x[k] = s->use[FILL_POSITION].real[k][i];
			if (quern_body_gap(body, &pose[b], s->dim, x, 0, NULL) >= -p->cell) continue;
			snprintf(why, sizeof why, "starts in %s, deeper than a cell", quern_body_say(body, b, which));
			return refuse(s, i, why);
		}
	}
	return QUERN_OK;
}

/* What a material keeps beside the stress is another's, or the file does not have it. */
static bool is_whole(const quern_step *s, const quern_bound *material) {
	for (uint32_t r = 0; r < material->n_uses; r++)
		if (material->uses[r].access == QUERN_UPDATE && material->column[r].real[0] &&
			!s->host->taken(s->run, material->uses[r].field))
			return false;
	return s->host->taken(s->run, material->id);
}

quern_status quern_mpm_begin(const mpm *p, const quern_step *s, uint32_t n) {
	const quern_column *u = s->use;
	const quern_bound *material = &s->slot[SLOT_MATERIAL][0];
	if (!n && !p->source.n)
		return s->host->stop(s->run, QUERN_E_PARAM, "from", -1,
			"that state has no points left: name a frame from before, RUN:FRAME, or give a source");
	for (uint32_t i = 0; i < n; i++) {
		const quern_status status = check(s, i);
		if (status != QUERN_OK) return status;
	}
	const quern_status status = check_bodies(p, s, n);
	if (status != QUERN_OK || is_whole(s, material)) return status;
	s->host->log(s->run, 1, "the state of %s follows from the stress alone: it is not what the points had",
		material->id);
	const stressed_points points = {
		.mass = u[FILL_MASS], .volume = u[FILL_VOLUME], .stress = u[FILL_STRESS], .energy = u[FILL_ENERGY]
	};
	quern_stressed_assign(&points, material, s->dim, 0, n);
	return QUERN_OK;
}
