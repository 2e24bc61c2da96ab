/* SPDX-License-Identifier: MIT */
#include "order.h"
#include "text.h"
#include <stdlib.h>
#include <string.h>

bool quern_plan_demands(const quern_plan_use *u) {
	return u->counts && !(u->row->flags & (QUERN_OPTIONAL | QUERN_WANTED));
}

/* Inside a phase: readers of the old value, writers, adders, updaters, readers. */
static int rank(const quern_use *row) {
	switch (row->access) {
	case QUERN_WRITE: return 1;
	case QUERN_ADD: return 2;
	case QUERN_UPDATE: return 3;
	default: return row->flags & QUERN_BEFORE ? 0 : 4;
	}
}

/* ---- stages ---- */

static bool before(const quern_plan *p, int a, int b) {
	const quern_plan_stage *sa = &p->stages[a], *sb = &p->stages[b];
	if (sa->solver == sb->solver) return sa->sequence < sb->sequence;
	for (size_t i = 0; i < p->n_uses; i++) {
		const quern_plan_use *u = &p->uses[i];
		if (u->stage != a || u->target < 0) continue;
		for (size_t k = 0; k < p->n_uses; k++) {
			const quern_plan_use *v = &p->uses[k];
			if (v->stage == b && v->target == u->target && rank(u->row) < rank(v->row)) return true;
		}
	}
	return false;
}

static void order_stages(quern_plan *p) {
	p->order = quern_take(p->n_stages, sizeof(int));
	int n = 0;
	for (int phase = 0; phase < QUERN_PHASES; phase++)
		for (;;) {
			int next = -1, left[2] = { -1, -1 };
			for (int a = 0; a < (int)p->n_stages; a++) {
				if ((int)p->stages[a].phase != phase || p->stages[a].order >= 0) continue;
				bool ready = true;
				left[left[0] >= 0] = a;
				for (int b = 0; b < (int)p->n_stages && ready; b++)
					ready = b == a || (int)p->stages[b].phase != phase || p->stages[b].order >= 0 ||
							!before(p, b, a);
				if (ready && next < 0) next = a;
			}
			if (left[0] < 0) break;
			if (next < 0) {
				quern_report_add(p->scene->report,
					p->stages[left[0]].section ? p->stages[left[0]].section->mark : (quern_mark) { 0 },
					"%s and %s each need the other to come first among the stages '%s'",
					p->stages[left[0]].name, left[1] >= 0 ? p->stages[left[1]].name : "itself",
					quern_phase_names[phase]);
				next = left[0];
			}
			p->stages[next].order = n;
			p->order[n++] = next;
		}
}

/* ---- what the order implies for each field ---- */

/* A row that only says what must be there has no column to read. */
static bool reads_others(const quern_use *row) {
	return row->flags & QUERN_OTHERS && !(row->flags & QUERN_EXISTS);
}

typedef struct {
	const quern_plan_use *last;
	bool read, first_seen, begins, fresh, written;
	bool whole; /* a stage itself looks at the column, not only the plugins that it calls */
	int stages, previous;
} history;

/* Two of a list both take what they remember of an entry for their own: of the set that their slot repeats, as contact laws do. Of others
 * it may be what they change one after the other. */
static bool share_memory(const quern_plan_use *a, const quern_plan_use *b) {
	const char *set = a->slot && a->slot->list ? a->slot->repeat : NULL;
	return set && a->slot == b->slot && a->stage == b->stage && a->bound != b->bound &&
		   a->row->access == QUERN_UPDATE && b->row->access == QUERN_UPDATE &&
		   !strncmp(a->row->field, set, strlen(set)) && a->row->field[strlen(set)] == '.';
}

static void conflicts(quern_plan *p, const quern_field *field, const quern_plan_use *u, history *h) {
	const quern_plan_use *last = h->last;
	if (last && last->stage != u->stage) {
		const quern_plan_stage *was = &p->stages[last->stage], *now = &p->stages[u->stage];
		if (u->row->access == QUERN_WRITE && last->row->access == QUERN_WRITE && was->phase != QUERN_SETUP)
			quern_report_add(p->scene->report, u->mark, "%s: %s overwrites what %s wrote and nobody read",
				field->name, u->owner, last->owner);
		if (u->row->access == QUERN_UPDATE && last->row->access == QUERN_UPDATE && was->phase == now->phase &&
			was->solver != now->solver && !now->observer) /* observers go in the order of their list */
			quern_report_add(p->scene->report, u->mark,
				"%s: %s and %s both change it and nothing says which comes first", field->name, last->owner,
				u->owner);
	}
	if (last && share_memory(last, u))
		quern_report_add(p->scene->report, u->mark,
			"%s: %s and %s are in one list and both change it, each as if it were its own", field->name,
			last->owner, u->owner);
	if (u->row->access == QUERN_ADD && h->fresh)
		quern_report_add(p->scene->report, u->mark, "%s: %s adds to it after %s has read it", field->name,
			u->owner, last->owner);
}

static void follow_field(quern_plan *p, int k) {
	quern_field *field = &p->store.fields[k];
	history h = { .read = field->shown, .previous = -1 };
	for (size_t o = 0; o < p->n_stages; o++) {
		const int s = p->order[o];
		const bool setup = p->stages[s].phase == QUERN_SETUP;
		bool others = false, changed = false;
		for (int r = 0; r < 5; r++)
			for (size_t i = 0; i < p->n_uses; i++) {
				const quern_plan_use *u = &p->uses[i];
				if (u->target != k || u->stage != s || rank(u->row) != r) continue;
				const bool fills = u->row->access == QUERN_WRITE || u->row->access == QUERN_ADD;
				h.read = h.read || u->row->access == QUERN_READ || u->row->access == QUERN_UPDATE;
				h.written = h.written || quern_use_changes(u->row);
				h.whole = h.whole ||
						  (i >= p->stages[s].first_use && i < p->stages[s].first_use + p->stages[s].n_uses);
				others = others || reads_others(u->row);
				changed = changed || u->row->access == QUERN_UPDATE || u->row->access == QUERN_WRITE;
				if (s != h.previous) h.stages++, h.previous = s;
				if (setup) continue;
				if (!h.first_seen) h.begins = fills, field->state = !fills || p->stages[s].sometimes;
				h.first_seen = true;
				conflicts(p, field, u, &h);
				h.fresh = u->row->access == QUERN_READ;
				h.last = u;
			}
		field->twice = field->twice || (others && changed);
	}
	if (!h.written)
		for (size_t i = 0; i < p->n_uses; i++)
			if (p->uses[i].target == k && quern_plan_demands(&p->uses[i])) {
				quern_report_add(p->scene->report, p->uses[i].mark,
					"%s needs %s, and nothing in this scene makes it", p->uses[i].owner, field->name);
				break;
			}
	field->local = !field->shown && ((h.stages <= 1 && h.begins && !h.whole) || !h.read);
	field->state = field->state && !field->local;
}

/* The first stage whose uses a solver's limit and account go by. */
static bool is_first_of_section(const quern_plan *p, int stage) {
	for (int s = 0; s < stage; s++)
		if (p->stages[s].section == p->stages[stage].section) return false;
	return p->stages[stage].section != NULL;
}

/* A row is cleared as a whole, with the lanes that nobody reads. */
static bool is_cleared(const quern_plan *p, const quern_field *field) {
	return !field->local || p->store.sets[field->set].rows;
}

/* Frames, observers, limits and accounts look at fields before anything is computed anew. What they see must come back
 * with a checkpoint, state or not. */
static void mark_kept(quern_plan *p) {
	quern_store *store = &p->store;
	for (size_t i = 0; i < p->n_uses; i++) {
		const quern_plan_use *u = &p->uses[i];
		if (u->target < 0 || u->stage < 0) continue;
		if (p->stages[u->stage].observer || is_first_of_section(p, u->stage))
			store->fields[u->target].kept = true;
	}
	for (size_t k = 0; k < store->n_fields; k++) {
		quern_field *field = &store->fields[k];
		bool shown = field->shown; /* what something points at goes with it */
		for (size_t i = 0; i < store->n_fields && field->target >= 0; i++)
			shown = shown || (store->fields[i].set == field->set && store->fields[i].shown);
		field->kept = !field->local && (field->kept || shown || field->state || field->shape == QUERN_ID);
	}
}

bool quern_plan_settles(const quern_use *row) {
	return quern_use_changes(row) && !(row->flags & QUERN_RELEASED);
}

static bool stage_has(const quern_plan *p, int stage, int field, bool (*test)(const quern_use *)) {
	for (size_t i = 0; i < p->n_uses; i++)
		if (p->uses[i].stage == stage && p->uses[i].target == field && test(p->uses[i].row)) return true;
	return false;
}
static bool adds(const quern_use *row) { return row->access == QUERN_ADD; }

/* Before the first frame, whoever looks at it finds it as settling has left it. */
static bool is_looked_at(const quern_plan *p, int field) {
	bool renewed = false;
	for (int i = 0; i < (int)p->n_stages; i++)
		renewed = renewed || (p->stages[i].phase == QUERN_OUTPUT && stage_has(p, i, field, quern_use_renews));
	return p->store.fields[field].kept && !renewed;
}

/* What a settled state consists of. */
static void mark_settles(quern_plan *p) {
	for (size_t i = 0; i < p->n_uses; i++) {
		const quern_plan_use *u = &p->uses[i];
		if (u->target < 0 || u->stage < 0 || !p->stages[u->stage].settles) continue;
		quern_field *field = &p->store.fields[u->target];
		if (quern_plan_settles(u->row) && (field->state || is_looked_at(p, u->target))) field->settles = true;
	}
}

/* Until the release a step consists of the stages that settle; the set-up and what is made for frames come as ever. */
static bool acts_before_release(const quern_plan_stage *stage) {
	return stage->settles || stage->phase == QUERN_SETUP || stage->phase == QUERN_OUTPUT;
}

static void mark_swaps_and_zeros(quern_plan *p) {
	bool *zeroed = quern_take(p->store.n_fields, sizeof(bool)),
		 *settled = quern_take(p->store.n_fields, sizeof(bool));
	for (size_t o = 0; o < p->n_stages; o++) {
		quern_plan_stage *stage = &p->stages[p->order[o]];
		stage->swaps = quern_take(p->store.n_fields + 1, sizeof(int));
		stage->zeros = quern_take(p->store.n_fields + 1, sizeof(int));
		stage->zeros_settling = quern_take(p->store.n_fields + 1, sizeof(int));
		size_t swaps = 0, zeros = 0, n = 0;
		for (size_t k = 0; k < p->store.n_fields; k++) {
			const quern_field *field = &p->store.fields[k];
			const int s = p->order[o], f = (int)k;
			if (field->twice && stage_has(p, s, f, reads_others) && stage_has(p, s, f, quern_use_renews))
				stage->swaps[swaps++] = f;
			const bool cleared = is_cleared(p, field);
			if (cleared && !zeroed[k] && stage_has(p, s, f, adds))
				stage->zeros[zeros++] = f, zeroed[k] = true;
			if (acts_before_release(stage) && cleared && !settled[k] && stage_has(p, s, f, adds))
				stage->zeros_settling[n++] = f, settled[k] = true;
		}
		stage->swaps[swaps] = stage->zeros[zeros] = stage->zeros_settling[n] = -1;
	}
	free(zeroed);
	free(settled);
}

void quern_plan_order(quern_plan *p) {
	order_stages(p);
	for (size_t k = 0; k < p->store.n_fields; k++) follow_field(p, (int)k);
	mark_kept(p);
	mark_settles(p);
	mark_swaps_and_zeros(p);
}
