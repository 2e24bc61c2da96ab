/* SPDX-License-Identifier: MIT */
#include "renew.h"

/* Old blocks of what is kept, and one for what is new. */
static quern_status remap(
	const quern_step *s, const renewal *r, const quern_parts *p, const int32_t *from, uint32_t *block) {
	const uint32_t n_blocks = p->n_blocks + (r->n_new > 0), n = r->first + r->n_new;
	uint32_t *place = s->host->memory(s->run, ((size_t)n_blocks + 1) * sizeof(uint32_t));
	if (!place) return QUERN_E_MEMORY;
	if (!p->block) return s->host->remap(s->run, r->set, n, from, 0, NULL);
	for (uint32_t q = 0; q < n_blocks; q++) place[q] = q < p->n_blocks ? quern_nth(p->by_place, q) : q;
	const bool turned = p->by_place;
	block[n_blocks] = n;
	const quern_status status = s->host->remap(s->run, r->set, n, from, n_blocks, block);
	return status == QUERN_OK && turned ? s->host->arrange(s->run, r->set, place) : status;
}

quern_status quern_renew(const quern_step *s, renewal *r) {
	const quern_parts *p = s->host->parts(s->run, r->set);
	int32_t *from = s->host->memory(s->run, ((size_t)p->n + r->n_new + 1) * sizeof(int32_t));
	uint32_t *block = s->host->memory(s->run, ((size_t)p->n_blocks + 2) * sizeof(uint32_t)), kept = 0, b = 0;
	if (!from || !block) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < p->n; i++) {
		for (; p->block && b < p->n_blocks && p->block[b] <= i; b++) block[b] = kept;
		if (r->now) r->now[i] = (int32_t)kept;
		if (!r->drop || !r->drop[i]) from[kept++] = (int32_t)i;
	}
	for (; b <= p->n_blocks; b++) block[b] = kept;
	r->first = kept;
	if (kept == p->n && !r->n_new) return QUERN_OK;
	for (uint32_t i = 0; i < r->n_new; i++)
		from[kept + i] = r->parent && r->parent[i] >= 0 ? -2 - r->parent[i] : -1;
	return remap(s, r, p, from, block);
}
