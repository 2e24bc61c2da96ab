/* SPDX-License-Identifier: MIT */
/* lend - what the coupling will give to grains is given ahead while they take their steps, and taken back before it is
 * reckoned. docs/theory/hybrid.md, section 2 */
#include "lend.h"
#include "contacts.h"
#include <math.h>

quern_real quern_hybrid_path(const hybrid *h, const quern_step *s) {
	return (0.5 * (h->substeps + 1) - h->ahead) / h->substeps * s->dt;
}

/* ---- before the exchange ---- */

enum { CHUNK = 4096 };

typedef struct {
	const quern_column *position, *velocity, *lent;
	const quern_column *anchor;
	quern_real dt, path, *farthest; /* by chunk: m^2 since the last list */
	uint32_t n, dim;
} taking;

static void take_chunk(void *arg, uint32_t chunk, uint32_t worker) {
	const taking *t = arg;
	const uint32_t begin = chunk * CHUNK, end = begin + CHUNK < t->n ? begin + CHUNK : t->n;
	quern_real *const *x = t->position->real, *const *at = t->anchor->real, most = 0;
	(void)worker;
	for (uint32_t k = 0; k < t->dim; k++) {
		quern_real *restrict v = t->velocity->real[k], *restrict lent = t->lent->real[k];
		for (uint32_t i = begin; i < end; i++) {
			const quern_real dv = t->dt * lent[i];
			v[i] -= dv;
			x[k][i] -= t->path * dv;
			lent[i] = 0;
		}
	}
	for (uint32_t i = begin; i < end; i++) {
		quern_real way = 0;
		for (uint32_t k = 0; k < t->dim; k++) way += (x[k][i] - at[k][i]) * (x[k][i] - at[k][i]);
		most = way > most ? way : most;
	}
	t->farthest[chunk] = most;
}

quern_status quern_hybrid_take_back(const hybrid *h, const quern_step *s) {
	const uint32_t n = s->host->set(s->run, "grain").n, chunks = (n + CHUNK - 1) / CHUNK;
	taking t = { &s->use[R_POSITION], &s->use[R_VELOCITY], &s->use[R_LENT], &s->use[R_ANCHOR], s->dt,
		quern_hybrid_path(h, s), s->host->memory(s->run, ((size_t)chunks + 1) * sizeof(quern_real)), n,
		s->dim };
	if (!t.farthest) return QUERN_E_MEMORY;
	s->host->parallel(s->run, chunks, take_chunk, &t);
	quern_real *displacement = s->use[R_DISPLACEMENT].real[0];
	for (uint32_t c = 0; c < chunks; c++) *displacement = fmax(*displacement, sqrt(t.farthest[c]));
	return QUERN_OK;
}

/* ---- as weights change ---- */

/* N per kg of a grain, by which what a contact bears of it becomes less. */
static quern_real lost(const quern_real *old, const quern_real *new, int32_t i, int32_t j, quern_real mass) {
	if (!(old[i] > 0) || !(new[i] > 0)) return 0;
	const quern_real before = old[i] < old[j] ? old[i] : old[j], now = new[i] < new[j] ? new[i] : new[j];
	return (before / old[i] - now / new[i]) / mass;
}

void quern_hybrid_lend(const update *d, const quern_real *old) {
	const quern_column *u = d->u;
	const quern_real *new = u[U_GRAIN_WEIGHT].real[0], *mass = u[U_GRAIN_MASS].real[0];
	const int32_t *fixed = u[U_GRAIN_FIXED].index;
	const contact_list list = contacts_of(d->s, U_BORNE, U_CONTACT_FIRST, U_CONTACT_SECOND, U_GRAIN_POSITION);
	const uint32_t *by_place = d->s->host->parts(d->s->run, "contact")->by_place;
	contact_seen c;
	for (uint32_t k = 0; k < list.contacts.n_blocks; k++) {
		const uint32_t b = quern_nth(by_place, k);
		for (uint32_t q = list.contacts.block[b]; q < list.contacts.block[b + 1]; q++) {
			if (!contact_at(&list, b, q, &c) || !(c.force2 > 0)) continue;
			const int32_t i = c.first, j = c.second;
			const quern_real mine = fixed && fixed[i] ? 0 : lost(old, new, i, j, mass[i]),
							 its = fixed && fixed[j] ? 0 : lost(old, new, j, i, mass[j]);
			const quern_real f[3] = { c.force.x, c.force.y, c.force.z };
			for (uint32_t a = 0; a < d->s->dim; a++) {
				u[U_LENT].real[a][i] += mine * f[a];
				u[U_LENT].real[a][j] -= its * f[a];
			}
		}
	}
}
