/* SPDX-License-Identifier: MIT */
/* contacts - the grains' list of contacts as the hybrid reads it */
#pragma once
#include "hybrid.h"

typedef struct contact_list {
	uint32_t dim;
	const int32_t *first, *second;
	quern_column force, position;
	quern_images images;
	quern_set_view contacts, grains;
} contact_list;

typedef struct contact_seen {
	int32_t first, second;
	quern_vec force, way; /* N on the first; m to its centre from that of the second */
	quern_real force2, distance2;
} contact_seen;

/* By the stage's rows. */
static inline contact_list contacts_of(const quern_step *s, int force, int first, int second, int position) {
	const quern_column *u = s->use;
	return (contact_list) { s->dim, u[first].index, u[second].index, u[force], u[position],
		quern_images_of(s->dim, s->lower, s->upper, s->periodic), s->host->set(s->run, "contact"),
		s->host->set(s->run, "grain") };
}

/* Entry q of block b. Pairs across blocks stand in both and count where the first is at home: false elsewhere. */
static inline bool contact_at(const contact_list *l, uint32_t b, uint32_t q, contact_seen *c) {
	const int32_t i = l->first[q], j = l->second[q];
	quern_real *const *x = l->position.real;
	if (i < (int32_t)l->grains.block[b] || i >= (int32_t)l->grains.block[b + 1]) return false;
	c->first = i;
	c->second = j;
	c->force = QUERN_VEC_AT(l->force.real, q, l->dim);
	c->way = quern_vec_image(
		quern_vec_sub(QUERN_VEC_AT(x, i, l->dim), QUERN_VEC_AT(x, j, l->dim)), l->images, (int)l->dim);
	c->force2 = quern_vec_dot(c->force, c->force, 3);
	c->distance2 = quern_vec_dot(c->way, c->way, 3);
	return true;
}
