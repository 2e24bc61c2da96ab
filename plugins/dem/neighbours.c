/* SPDX-License-Identifier: MIT */
/* neighbours - the stage that sorts grains, lists near pairs and near bodies, and carries their history over */
#include "../common/outlets.h"
#include "../common/sort.h"
#include "dem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
	const dem *d;
	const quern_step *s;
	const quern_bound *search;
	const quern_neighbour_ops *ops;
	quern_neighbour_job job;
	const int32_t *fixed, *material;
	const int64_t *id;
	quern_pair **pair; /* by block: its pairs, while it is searched a buffer */
	uint32_t *room;    /* by block: of the buffer, in pairs */
	uint32_t *found;   /* by block */
	uint32_t *again;   /* blocks that found more than they had room for */
	uint32_t *start;   /* by block: of the final list */
	uint32_t searched; /* the first block of those that are searched now */
	quern_pair *list;  /* of touches */
	int32_t *list_from, *list_feature;
	const uint32_t *bucket; /* by grain: its old entries in `entry` */
	const int32_t *entry;
	const int32_t *old_first, *old_second;
	const uint32_t *by_place;   /* blocks of grains, and so of contacts and touches; NULL: in order */
	const int32_t *old_feature; /* of touches; NULL: entries of one pair are one */
	const body_pose *pose;      /* by body */
} listing;

/* ---- sorting ---- */

static quern_real skin_of(const dem *d) { return d->skin * 2 * d->material[0].radii.mean; }
static quern_real reach_of(const dem *d) { return skin_of(d) + d->reach; }

static quern_real largest_radius(const quern_real *radius, uint32_t n) {
	quern_real most = 0;
	for (uint32_t i = 0; i < n; i++) most = radius[i] > most ? radius[i] : most;
	return most;
}

static bool set_job(listing *l) {
	const quern_step *s = l->s;
	const dem *d = l->d;
	const quern_set_view grains = s->host->set(s->run, "grain");
	l->job.n = grains.n;
	l->job.dim = s->dim;
	for (uint32_t k = 0; k < 3; k++) {
		l->job.position[k] = k < s->dim ? s->use[NEAR_POSITION].real[k] : NULL;
		l->job.lower[k] = s->lower[k];
		l->job.upper[k] = s->upper[k];
		l->job.periodic[k] = s->periodic[k];
	}
	l->job.radius = s->use[NEAR_RADIUS].real[0];
	l->job.largest = largest_radius(l->job.radius, grains.n);
	l->job.reach = reach_of(d);
	l->job.n_blocks = grains.n_blocks;
	l->job.block = grains.block;
	l->fixed = s->use[NEAR_FIXED].index;
	l->material = d->pairs.n ? s->use[NEAR_MATERIAL].index : NULL;
	l->id = s->use[NEAR_ID].id;
	return !d->boxed || quern_dem_box_straighten(s, &l->job);
}

#ifdef QUERN_PERMUTED_BLOCKS
/* Numbers of blocks that run against the order of their places: an odd factor takes no two to one. */
static void permute_blocks(uint32_t n, uint64_t *key) {
	for (uint32_t i = 0; i < n; i++)
		key[i] = (uint64_t)(((uint32_t)(key[i] >> 32) + 12345u) * 2654435761u) << 32 | (uint32_t)key[i];
}

/* place[b] is the number that block b would have had. */
static uint32_t *places_of(
	const listing *l, const uint64_t *key, const int32_t *from, const uint32_t *block, uint32_t n) {
	const quern_step *s = l->s;
	uint64_t *place = s->host->memory(s->run, ((size_t)n + 1) * sizeof(uint64_t));
	int32_t *order = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	void *work = s->host->memory(s->run, quern_sort_bytes(n));
	if (!place || !order || !work) return NULL;
	for (uint32_t b = 0; b < n; b++)
		place[b] = (uint32_t)((uint32_t)(key[from[block[b]]] >> 32) * 244002641u - 12345u);
	quern_sort_order(n, place, NULL, order, work);
	return (uint32_t *)order;
}
#endif

/* Before the release grains of one cell stand in an order that lists while settling have left, which is another one where settling was
 * part of another run. From there on they are taken in the order of their ids: what a kept state leads to does not depend on who kept it. */
static bool order_before(const listing *l, uint32_t n, uint64_t *key, void *work, const uint32_t **order) {
	const quern_step *s = l->s;
	*order = s->host->parts(s->run, "grain")->entry;
	if (s->settling || s->step || s->within) return true;
	int32_t *by_id = s->host->memory(s->run, ((size_t)n + 1) * sizeof *by_id);
	if (!by_id) return false;
	for (uint32_t i = 0; i < n; i++) key[i] = (uint64_t)s->use[NEAR_ID].id[i];
	quern_sort_order(n, key, *order, by_id, work);
	*order = (const uint32_t *)(const void *)by_id;
	return true;
}

/* Grains of one place keep the order that they had by their blocks' places. */
static quern_status sort_grains(listing *l) {
	const quern_step *s = l->s;
	if (!set_job(l)) return QUERN_E_MEMORY;
	const uint32_t n = l->job.n;
	/* forces have their rows there, in every step: what is gone before threads work takes no room beside them */
	uint64_t *key = s->host->scratch(s->run, 0,
		((size_t)n + 2) * (sizeof(uint64_t) + sizeof(int32_t) + sizeof(uint32_t)) + quern_sort_bytes(n));
	if (!key) return QUERN_E_MEMORY;
	int32_t *from = (int32_t *)(void *)(key + n + 2);
	uint32_t *block = (uint32_t *)(void *)(from + n + 2), *by_place = NULL;
	void *work = block + n + 2;
	const uint32_t *order;
	if (!order_before(l, n, key, work, &order)) return QUERN_E_MEMORY;
	const size_t wanted = l->ops->keys(l->search->self, &l->job, key);
#ifdef QUERN_PERMUTED_BLOCKS
	permute_blocks(n, key);
#endif
	quern_sort_order(n, key, order, from, work);
	uint32_t n_blocks = 0;
	for (uint32_t i = 0; i < n; i++)
		if (!i || key[from[i]] >> 32 != key[from[i - 1]] >> 32) block[n_blocks++] = i;
	block[n_blocks] = n;
#ifdef QUERN_PERMUTED_BLOCKS
	by_place = places_of(l, key, from, block, n_blocks);
	if (!by_place) return QUERN_E_MEMORY;
#endif
	quern_status status = s->host->remap(s->run, "grain", n, from, n_blocks, block);
	if (status == QUERN_OK) status = s->host->arrange(s->run, "grain", by_place);
	if (status != QUERN_OK) return status;
	l->by_place = by_place;
	if (!set_job(l)) return QUERN_E_MEMORY;
	l->job.memory = s->host->memory(s->run, wanted + 64);
	if (!l->job.memory) return QUERN_E_MEMORY;
	if (l->ops->index) l->ops->index(l->search->self, &l->job);
	return QUERN_OK;
}

/* ---- pairs ---- */

enum { BY_SECOND, BY_FIRST, BY_LAW };

static uint64_t key_of(const listing *l, const quern_pair *pair, int by) {
	if (by == BY_LAW) return (uint64_t)(1 + dem_item(l->d, l->material, pair->first, pair->second));
	return (uint64_t)l->id[by == BY_SECOND ? pair->second : pair->first];
}

/* One of the passes of a sort by several numbers: by the id of the second grains, then, keeping that order among equals, of
 * the first. */
static void sort_by(const listing *l, quern_pair *pair, uint32_t n, int by, uint64_t *memory) {
	uint64_t *key = memory, *work = key + n;
	int32_t *from = (int32_t *)(void *)(work + quern_sort_bytes(n) / sizeof *work + 1);
	quern_pair *copy = (quern_pair *)(void *)(from + n + n % 2);
	for (uint32_t i = 0; i < n; i++) key[i] = key_of(l, &pair[i], by);
	quern_sort_order(n, key, NULL, from, work);
	memcpy(copy, pair, n * sizeof *pair);
	for (uint32_t i = 0; i < n; i++) pair[i] = copy[from[i]];
}

/* The first of a pair is the one of lower id, for ever. In the order of ids, every grain adds up its forces in the
 * order of its partners' ids: sums have the same bits for any search, in whatever order it keeps the grains. Where pairs of
 * materials have parameters of their own, those of one pair come together, so that a law is called for many at once. */
static bool sort_pairs(const listing *l, quern_pair *pair, uint32_t n, uint32_t worker) {
	const size_t bytes = quern_sort_bytes(n) + (n + 2) * (sizeof(uint64_t) + sizeof(int32_t) + sizeof *pair);
	uint64_t *memory = l->s->host->scratch(l->s->run, worker, bytes);
	if (!memory) return false;
	for (uint32_t i = 0; i < n; i++)
		if (l->id[pair[i].first] > l->id[pair[i].second])
			pair[i] = (quern_pair) { pair[i].second, pair[i].first };
	sort_by(l, pair, n, BY_SECOND, memory);
	sort_by(l, pair, n, BY_FIRST, memory);
	if (l->material) sort_by(l, pair, n, BY_LAW, memory);
	return true;
}

static void find_pairs(void *arg, uint32_t b, uint32_t worker) {
	listing *l = arg;
	quern_pair *out = l->pair[b];
	const uint32_t n = l->ops->pairs(l->search->self, &l->job, b, l->room[b], out);
	if (n > l->room[b]) {
		l->found[b] = n;
		return;
	}
	const uint32_t near = l->d->boxed ? quern_dem_box_keep_near(l->s, reach_of(l->d), n, out) : n;
	uint32_t kept = 0;
	for (uint32_t i = 0; i < near; i++)
		if (!l->fixed || !l->fixed[out[i].first] || !l->fixed[out[i].second]) out[kept++] = out[i];
	l->found[b] = sort_pairs(l, out, kept, worker) ? kept : UINT32_MAX;
}

/* Bytes of an index of n entries, and of where those of the new list, as many as `made`, come from. */
static size_t index_bytes(const listing *l, uint32_t n, uint32_t made) {
	return ((size_t)l->job.n + 2 + n + made) * sizeof(int32_t) + sizeof(int32_t);
}

/* Entries of the old list by their first grain: an entry across blocks stands there twice, with equal contents. */
static void index_old(listing *l, uint32_t n, const int32_t *first, void *memory) {
	uint32_t *bucket = memory;
	int32_t *entry = (int32_t *)(void *)(bucket + l->job.n + 2);
	memset(bucket, 0, ((size_t)l->job.n + 2) * sizeof *bucket);
	quern_bucket(n, first, NULL, l->job.n, bucket, entry);
	l->bucket = bucket;
	l->entry = entry;
	l->old_first = first;
	l->list_from = entry + n;
}

static int32_t old_entry(const listing *l, int32_t first, int32_t second, int32_t feature) {
	for (uint32_t k = l->bucket[first]; k < l->bucket[first + 1]; k++) {
		const int32_t e = l->entry[k];
		if (l->old_second[e] == second && (!l->old_feature || l->old_feature[e] == feature)) return e;
	}
	return -1;
}

static void trace_pairs(void *arg, uint32_t b, uint32_t worker) {
	const listing *l = arg;
	const quern_pair *in = l->pair[b];
	(void)worker;
	for (uint32_t i = 0; i < l->found[b]; i++)
		l->list_from[l->start[b] + i] = old_entry(l, in[i].first, in[i].second, 0);
}

static void put_pairs(void *arg, uint32_t b, uint32_t worker) {
	const listing *l = arg;
	const quern_pair *in = l->pair[b];
	int32_t *first = l->s->use[NEAR_FIRST].index + l->start[b],
			*second = l->s->use[NEAR_SECOND].index + l->start[b];
	(void)worker;
	for (uint32_t i = 0; i < l->found[b]; i++) first[i] = in[i].first, second[i] = in[i].second;
}

static void find_next(void *arg, uint32_t k, uint32_t worker) {
	const listing *l = arg;
	find_pairs(arg, l->searched + k, worker);
}

static void find_again(void *arg, uint32_t k, uint32_t worker) {
	const listing *l = arg;
	find_pairs(arg, l->again[k], worker);
}

/* Every block has room for a usual number of pairs per grain; one with a large grain among small ones may need many times that, and
 * is searched again. */
static uint32_t usual_room(const listing *l, uint32_t b) {
	return (l->job.block[b + 1] - l->job.block[b]) * (l->s->dim == 2 ? 8 : 12);
}

/* The end of the blocks that are searched together, from `b` on: enough of them for all threads, and few of all, since one buffer serves
 * them one after the other. */
static uint32_t end_of_group(const listing *l, uint32_t b) {
	const uint32_t least = 8192 * l->s->host->workers(l->s->run), share = l->job.n / 16;
	const uint32_t wanted = share > least ? share : least, begin = l->job.block[b];
	while (b < l->job.n_blocks && l->job.block[b] - begin < wanted) b++;
	return b;
}

/* Pairs of the largest group, were it full. */
static size_t room_of_groups(const listing *l) {
	size_t most = 0;
	for (uint32_t begin = 0, end; begin < l->job.n_blocks; begin = end) {
		size_t sum = 0;
		end = end_of_group(l, begin);
		for (uint32_t b = begin; b < end; b++) sum += usual_room(l, b);
		most = sum > most ? sum : most;
	}
	return most;
}

static quern_status search_again(listing *l, uint32_t begin, uint32_t end) {
	const quern_step *s = l->s;
	uint32_t n = 0;
	size_t sum = 0;
	for (uint32_t b = begin; b < end; b++) {
		if (l->found[b] == UINT32_MAX || l->found[b] <= l->room[b]) continue;
		l->again[n++] = b;
		l->room[b] = l->found[b];
		sum += l->found[b];
	}
	quern_pair *pair = n ? s->host->memory(s->run, sum * sizeof *pair) : NULL;
	if (n && !pair) return QUERN_E_MEMORY;
	for (uint32_t k = 0; k < n; pair += l->room[l->again[k++]]) l->pair[l->again[k]] = pair;
	if (n) s->host->parallel(s->run, n, find_again, l);
	return QUERN_OK;
}

/* What the blocks have found leaves the buffer, for as much memory as it needs. */
static quern_status keep_found(
	listing *l, uint32_t begin, uint32_t end, const quern_pair *buffer, size_t room) {
	const quern_step *s = l->s;
	size_t sum = 0;
	for (uint32_t b = begin; b < end; b++) {
		if (l->found[b] == UINT32_MAX) return QUERN_E_MEMORY;
		sum += l->found[b];
	}
	quern_pair *to = s->host->memory(s->run, (sum + 1) * sizeof *to);
	if (!to) return QUERN_E_MEMORY;
	for (uint32_t b = begin; b < end; b++) {
		if (l->pair[b] < buffer || l->pair[b] >= buffer + room) continue; /* of one that was searched again */
		memcpy(to, l->pair[b], l->found[b] * sizeof *to);
		l->pair[b] = to;
		to += l->found[b];
	}
	return QUERN_OK;
}

static quern_status search_group(listing *l, uint32_t begin, uint32_t end, quern_pair *buffer, size_t room) {
	quern_pair *at = buffer;
	for (uint32_t b = begin; b < end; at += l->room[b++]) {
		l->room[b] = usual_room(l, b);
		l->pair[b] = at;
	}
	l->searched = begin;
	l->s->host->parallel(l->s->run, end - begin, find_next, l);
	const quern_status status = search_again(l, begin, end);
	return status == QUERN_OK ? keep_found(l, begin, end, buffer, room) : status;
}

static quern_status search_pairs(listing *l) {
	const quern_step *s = l->s;
	const uint32_t n_blocks = l->job.n_blocks;
	const size_t room = room_of_groups(l) + 1;
	l->found = s->host->memory(s->run, ((size_t)n_blocks + 1) * sizeof(uint32_t));
	l->start = s->host->memory(s->run, ((size_t)n_blocks + 1) * sizeof(uint32_t));
	l->room = s->host->memory(s->run, ((size_t)n_blocks + 1) * sizeof(uint32_t));
	l->again = s->host->memory(s->run, ((size_t)n_blocks + 1) * sizeof(uint32_t));
	l->pair = s->host->memory(s->run, ((size_t)n_blocks + 1) * sizeof(quern_pair *));
	quern_pair *buffer = s->host->memory(s->run, room * sizeof *buffer);
	if (!l->found || !l->start || !l->room || !l->again || !l->pair || !buffer) return QUERN_E_MEMORY;
	for (uint32_t begin = 0, end; begin < n_blocks; begin = end) {
		end = end_of_group(l, begin);
		const quern_status status = search_group(l, begin, end, buffer, room);
		if (status != QUERN_OK) return status;
	}
	for (uint32_t b = 0; b < n_blocks; b++) l->start[b + 1] = l->start[b] + l->found[b];
	return QUERN_OK;
}

static quern_status list_contacts(listing *l) {
	const quern_step *s = l->s;
	quern_status status = search_pairs(l);
	if (status != QUERN_OK) return status;
	const uint32_t n = l->start[l->job.n_blocks], n_old = s->host->set(s->run, "contact").n;
	void *memory = s->host->scratch(s->run, 0, index_bytes(l, n_old, n));
	if (!memory) return QUERN_E_MEMORY;
	index_old(l, n_old, s->use[NEAR_FIRST].index, memory);
	l->old_second = s->use[NEAR_SECOND].index;
	l->old_feature = NULL;
	s->host->parallel(s->run, l->job.n_blocks, trace_pairs, l);
	status = s->host->remap(s->run, "contact", n, l->list_from, l->job.n_blocks, l->start);
	if (status == QUERN_OK) status = s->host->arrange(s->run, "contact", l->by_place);
	if (status == QUERN_OK) s->host->parallel(s->run, l->job.n_blocks, put_pairs, l);
	return status;
}

/* ---- grains near bodies ---- */

enum { CHUNK = 256, MOST_FEATURES = 64 };

typedef struct {
	_Alignas(64) quern_real position[3][CHUNK], gap[CHUNK], normal[3][CHUNK], velocity[3][CHUNK];
	int32_t feature[MOST_FEATURES];
} near_body;

/* Gaps of m grains from `first` on to the nearest place of body b. */
static void find_gaps(const listing *l, uint32_t b, uint32_t first, uint32_t m, near_body *w) {
	const quern_bound *body = &l->s->slot[SLOT_BODIES][b];
	quern_body_batch batch = { .n = m,
		.cap = CHUNK,
		.dim = l->s->dim,
		.pose = &l->pose[b].pose,
		.radius = l->job.radius + first,
		.gap = w->gap };
	for (uint32_t k = 0; k < l->s->dim; k++) {
		batch.position[k] = l->job.position[k] + first;
		batch.normal[k] = w->normal[k];
		batch.velocity[k] = w->velocity[k];
		if (l->pose[b].repeats) batch.position[k] = w->position[k];
	}
	if (l->pose[b].repeats)
		quern_motion_bring_all(&l->pose[b], l->s->dim, m,
			(const quern_real *const[3]) { l->job.position[0] + first, l->job.position[1] + first,
				l->s->dim == 3 ? l->job.position[2] + first : NULL },
			(quern_real *const[3]) { w->position[0], w->position[1], w->position[2] });
	((const quern_body_ops *)body->ops)->closest(body->self, &batch);
}

/* The features of a body that a grain is near; a body without any is feature 0. */
static uint32_t find_features(const listing *l, uint32_t b, uint32_t i, near_body *w) {
	const quern_bound *body = &l->s->slot[SLOT_BODIES][b];
	const quern_body_ops *ops = body->ops;
	quern_real x[3] = { 0 };
	w->feature[0] = 0;
	if (!ops->features) return 1;
	for (uint32_t k = 0; k < l->s->dim; k++) x[k] = quern_motion_bring(&l->pose[b], k, l->job.position[k][i]);
	return ops->features(
		body->self, &l->pose[b].pose, x, l->job.radius[i] + l->job.reach, MOST_FEATURES, w->feature);
}

/* Whether any grain has this item of the pairs on a body. */
static bool is_met(const dem *d, uint32_t body, int32_t item) {
	for (uint32_t k = 0; k < d->n_materials; k++)
		if (d->on_body[body * d->n_materials + k] == item) return true;
	return false;
}

/* Of a block's touches: one grain has too many, or there is no memory to count them. */
static const uint32_t too_many = UINT32_MAX, uncounted = UINT32_MAX - 1;

/* The touches of a block from entry `to` of the list on, or only how many there are, or that one grain has too many. Of a
 * body those with parameters of one pair of materials come together. */
static uint32_t touches_of_block(const listing *l, uint32_t b, near_body *w, const uint32_t *to) {
	const quern_step *s = l->s;
	const uint32_t rounds = 1 + l->d->pairs.n;
	uint32_t n = 0;
	for (uint32_t round = 0; round < s->n_slot[SLOT_BODIES] * rounds; round++) {
		const uint32_t body = round / rounds;
		const int32_t item = (int32_t)(round % rounds) - 1;
		if (!quern_body_is_there(&s->slot[SLOT_BODIES][body], s->settling) || !is_met(l->d, body, item))
			continue;
		for (uint32_t i = l->job.block[b]; i < l->job.block[b + 1]; i += CHUNK) {
			const uint32_t m = l->job.block[b + 1] - i < CHUNK ? l->job.block[b + 1] - i : CHUNK;
			find_gaps(l, body, i, m, w);
			for (uint32_t k = 0; k < m; k++) {
				if (!(w->gap[k] < l->job.reach) || (l->fixed && l->fixed[i + k])) continue;
				if (dem_item_on(l->d, l->material, (int32_t)(i + k), (int32_t)body) != item) continue;
				const uint32_t features = find_features(l, body, i + k, w);
				if (features > MOST_FEATURES) return too_many;
				for (uint32_t f = 0; f < features; f++, n++) {
					if (!to) continue;
					l->list[*to + n] = (quern_pair) { (int32_t)(i + k), (int32_t)body };
					if (l->list_feature) l->list_feature[*to + n] = w->feature[f];
				}
			}
		}
	}
	return n;
}

static void count_touches(void *arg, uint32_t b, uint32_t worker) {
	listing *l = arg;
	near_body *w = l->s->host->scratch(l->s->run, worker, sizeof *w);
	l->found[b] = w ? touches_of_block(l, b, w, NULL) : uncounted;
}

static void gather_touches(void *arg, uint32_t b, uint32_t worker) {
	listing *l = arg;
	near_body *w = l->s->host->scratch(l->s->run, worker, sizeof *w);
	if (!w) return;
	touches_of_block(l, b, w, &l->start[b]);
	for (uint32_t k = l->start[b]; k < l->start[b + 1]; k++)
		l->list_from[k] =
			old_entry(l, l->list[k].first, l->list[k].second, l->list_feature ? l->list_feature[k] : 0);
}

static quern_status list_touches(listing *l) {
	const quern_step *s = l->s;
	l->pose = quern_body_poses_now(s, SLOT_BODIES);
	if (!l->pose) return QUERN_E_MEMORY;
	s->host->parallel(s->run, l->job.n_blocks, count_touches, l);
	l->start[0] = 0;
	for (uint32_t b = 0; b < l->job.n_blocks; b++) {
		if (l->found[b] == uncounted) return QUERN_E_MEMORY;
		if (l->found[b] == too_many)
			return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
				"a grain is near more than %d features of a body: make the skin or the grains smaller, or "
				"the "
				"body coarser",
				MOST_FEATURES);
		l->start[b + 1] = l->start[b] + l->found[b];
	}
	const uint32_t n = l->start[l->job.n_blocks];
	const uint32_t n_old = s->host->set(s->run, "touch").n;
	void *memory = s->host->memory(s->run, index_bytes(l, n_old, n));
	l->list = s->host->memory(s->run, ((size_t)n + 1) * sizeof(quern_pair));
	if (l->d->features) l->list_feature = s->host->memory(s->run, ((size_t)n + 1) * sizeof(int32_t));
	if (!memory || !l->list || (l->d->features && !l->list_feature)) return QUERN_E_MEMORY;
	index_old(l, n_old, s->use[NEAR_GRAIN].index, memory);
	l->old_second = s->use[NEAR_BODY].index;
	l->old_feature = s->use[NEAR_FEATURE].index;
	s->host->parallel(s->run, l->job.n_blocks, gather_touches, l);
	quern_status status = s->host->remap(s->run, "touch", n, l->list_from, l->job.n_blocks, l->start);
	if (status == QUERN_OK) status = s->host->arrange(s->run, "touch", l->by_place);
	if (status != QUERN_OK) return status;
	int32_t *grain = s->use[NEAR_GRAIN].index, *body = s->use[NEAR_BODY].index,
			*feature = s->use[NEAR_FEATURE].index;
	for (uint32_t k = 0; k < n; k++) grain[k] = l->list[k].first, body[k] = l->list[k].second;
	for (uint32_t k = 0; k < n && feature; k++) feature[k] = l->list_feature[k];
	return QUERN_OK;
}

/* ---- the stage ---- */

/* A periodic image is found as the nearest one, which is right only if a pair cannot meet twice through the seam. */
static quern_status check_periodic(const listing *l) {
	const quern_step *s = l->s;
	const quern_real least = 2 * (2 * l->job.largest + l->job.reach);
	for (uint32_t k = 0; k < s->dim; k++) {
		const quern_real length = l->job.upper[k] - l->job.lower[k];
		if (!s->periodic[k] || !(length < least)) continue;
		if (l->d->boxed)
			return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
				"the box that is strained (grains.box) is only %.3g m long along axis %u: at its offset it must be %.3g m, "
				"room for two largest grains and their skins; begin with a larger domain, or one that is less long along x "
				"than along y",
				length, k, least);
		return s->host->stop(s->run, QUERN_E_PARAM, NULL, -1,
			"the domain is periodic along axis %u and only %.3g m wide there: it must hold two largest "
			"grains "
			"and their skins, %.3g m",
			k, length, least);
	}
	return QUERN_OK;
}

quern_status quern_dem_left(const quern_step *s, int64_t id, uint32_t axis, quern_real x) {
	return s->host->stop(s->run, QUERN_E_NUMERIC, "grain", id,
		"left the domain along axis %u, at %.4g m: put a body there, make the domain larger or open its face "
		"(domain.open)",
		axis, x);
}

/* A closed domain has bodies that keep grains inside; periodic axes bring them back here, where lists are remade. */
static quern_status keep_inside(const listing *l) {
	const quern_step *s = l->s;
	if (l->d->boxed) {
		quern_dem_box_bring_back(s);
		return QUERN_OK;
	}
	const uint32_t n = s->host->set(s->run, "grain").n;
	const int32_t *fixed = s->use[NEAR_FIXED].index;
	const uint32_t *order = s->host->parts(s->run, "grain")->entry;
	for (uint32_t k = 0; k < s->dim; k++) {
		quern_real *x = s->use[NEAR_POSITION].real[k];
		const quern_real lower = s->lower[k], upper = s->upper[k];
		for (uint32_t q = 0; q < n; q++) {
			const uint32_t i = quern_nth(order, q);
			if (s->periodic[k]) x[i] = quern_brought_back(x[i], lower, upper);
			else if (outlet_refuses(s, k, x[i]) && !(fixed && fixed[i]))
				return quern_dem_left(s, s->use[NEAR_ID].id[i], k, x[i]);
		}
	}
	return QUERN_OK;
}

/* At the release other bodies are there than while settling, whatever has moved; and when a stage of the scene begins. */
static bool is_release(const quern_step *s) {
	return !s->settling && s->within == 0 && (s->step == 0 || s->step == s->stage_step);
}

/* Before the first step there is no list yet, or that of settling; after it there always is one. */
quern_status quern_dem_list(const void *self, const quern_step *s) {
	const bool none = isinf(s->use[NEAR_DISPLACEMENT].real[0][0]);
	return none || is_release(s) ? quern_dem_neighbours(self, s) : QUERN_OK;
}

quern_status quern_dem_neighbours(const void *self, const quern_step *s) {
	listing l = { .d = self, .s = s, .search = &s->slot[SLOT_NEIGHBOURS][0] };
	l.ops = l.search->ops;
	quern_real *grown = s->use[NEAR_GROWN].real[0];
	const quern_real moved = s->use[NEAR_DISPLACEMENT].real[0][0] + (grown ? *grown : 0);
	if ((l.d->boxed ? quern_dem_box_moved(s, moved) : moved) < 0.5 * skin_of(l.d) && !is_release(s))
		return QUERN_OK;
	quern_status status = keep_inside(&l);
	if (status == QUERN_OK) status = sort_grains(&l);
	if (status == QUERN_OK) status = check_periodic(&l);
	if (status == QUERN_OK) status = list_contacts(&l);
	if (status == QUERN_OK && s->n_slot[SLOT_BODIES]) status = list_touches(&l);
	if (status != QUERN_OK) return status;
	for (uint32_t k = 0; k < s->dim; k++)
		memcpy(
			s->use[NEAR_ANCHOR].real[k], s->use[NEAR_POSITION].real[k], (size_t)l.job.n * sizeof(quern_real));
	if (l.d->boxed)
		quern_dem_box_list(s, 2 * largest_radius(s->use[NEAR_RADIUS].real[0], l.job.n) + l.d->reach);
	s->use[NEAR_DISPLACEMENT].real[0][0] = 0;
	if (grown && !s->settling) *grown = 0;
	if (s->use[NEAR_SWEPT].real[0]) s->use[NEAR_SWEPT].real[0][0] = 0;
	return QUERN_OK;
}
