/* SPDX-License-Identifier: MIT */
#include "run.h"
#include "identity.h"
#include "platform.h"
#include "run_episodes.h"
#include "start.h"
#include "text.h"
#include "watch.h"
#include "wishes.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

quern_status quern_run_stop(quern_run *run, quern_status status, const char *fmt, ...) {
	if (run->status != QUERN_OK) return status;
	quern_text text = { 0 };
	va_list list;
	va_start(list, fmt);
	if (run->stage)
		quern_text_add(&text, "%s, at t = %.6g s (step %lld): ", run->stage->name, quern_run_time(run),
			(long long)run->clock.step);
	quern_text_addv(&text, fmt, list);
	va_end(list);
	run->status = status;
	free(run->message);
	run->message = text.data;
	return status;
}

quern_status quern_run_refuse(quern_run *run, const char *param, const char *fmt, ...) {
	if (run->status != QUERN_OK) return QUERN_E_PARAM;
	const quern_section *section = run->stage ? run->stage->section : NULL;
	quern_text text = { 0 };
	va_list list;
	if (section) quern_text_add(&text, "%s: ", section->name);
	if (param) quern_text_add(&text, "%s: ", param);
	va_start(list, fmt);
	quern_text_addv(&text, fmt, list);
	va_end(list);
	run->fault = quern_param_mark(section ? section->node : run->scene->tree->root, param,
		section ? section->mark : (quern_mark) { 0 });
	run->status = QUERN_E_PARAM;
	free(run->message);
	run->message = text.data;
	return QUERN_E_PARAM;
}

void quern_run_complain(const quern_run *run, FILE *out) {
	const char *message = run->message ? run->message : "the run failed";
	if (!run->fault.file) {
		fprintf(out, "quern: error: %s\n", message);
		return;
	}
	quern_report *report = quern_report_create();
	quern_report_add(report, run->fault, "%s", message);
	quern_report_print(report, out);
	quern_report_destroy(report);
}

void quern_run_reset(quern_run *run) {
	quern_arena *a = &run->arena;
	for (size_t i = 0; i < a->n_extra; i++) free(a->extra[i]);
	if (a->n_extra) {
		const size_t wanted = (a->used + a->extra_bytes) * 5 / 4;
		free(a->data);
		a->data = quern_platform_memory((wanted + 63) & ~(size_t)63);
		a->capacity = a->data ? (wanted + 63) & ~(size_t)63 : 0;
	}
	a->used = a->n_extra = a->extra_bytes = 0;
}

/* Nobody looks between steps at rows of which no field is kept; the next step makes them zero, or writes all of them. */
static void forget_rows(quern_store *store, size_t set) {
	quern_set_store *s = &store->sets[set];
	for (size_t k = 0; k < store->n_fields; k++)
		if (store->fields[k].set == (int)set && store->fields[k].kept) return;
	if (s->rows && s->row) quern_platform_forget(s->row, (size_t)s->n * 64);
}

void quern_run_rest(quern_run *run) {
	quern_run_reset(run);
	for (size_t i = 0; i < run->plan->store.n_sets; i++) forget_rows(&run->plan->store, i);
	if (run->arena.data) quern_platform_forget(run->arena.data, run->arena.capacity);
	quern_pool_rest(run->pool);
}

static bool needs_grid(const quern_store *store) {
	for (size_t i = 0; i < store->n_fields; i++)
		if (store->sets[store->fields[i].set].grid) return true;
	return false;
}

static void init_grid(quern_run *run) {
	const quern_general *g = &run->scene->general;
	if (quern_grid_init(&run->grid, (uint32_t)g->dimension, quern_wish_cell(run->scene), g->lower, g->upper,
			g->periodic) != QUERN_OK)
		quern_report_add(run->scene->report,
			quern_param_mark(run->scene->tree->root, "domain.upper", (quern_mark) { 0 }),
			"the domain has more than 2^22 cells along an axis, or 2^31 in all: make it smaller or the cells "
			"larger");
}

/* What could not be made whole goes; the scene stays the caller's. */
static quern_run *give_up(quern_run *run) {
	run->scene = NULL;
	quern_run_destroy(run);
	return NULL;
}

quern_run *quern_run_create(quern_scene *scene, uint32_t workers) {
	quern_run *run = quern_take(1, sizeof *run);
	run->scene = scene;
	run->clock.frame = -1;
	run->mass_initial = NAN;
	run->plugins = quern_plugin_hashes(scene->loader);
	run->pool = quern_pool_create(workers);
	if (!run->pool) return give_up(run);
	quern_account_check(scene);
	run->plan = quern_plan_create(scene, run->pool);
	run->has_grid = needs_grid(&run->plan->store);
	if (!quern_report_errors(scene->report)) quern_wishes_check(scene, run->has_grid);
	quern_run_plan_episodes(run);
	if (run->has_grid && !quern_report_errors(scene->report)) init_grid(run);
	run->rss_before = quern_platform_peak_memory();
	const int total = quern_store_set(&run->plan->store, "total");
	bool reserved = quern_store_fill(&run->plan->store, total, 1) == QUERN_OK;
	for (int i = 0; i < (int)run->plan->store.n_sets;
		 i++) /* from now on a NULL column says: there is no such field */
		if (i != total && !run->plan->store.sets[i].rows)
			reserved = reserved && quern_store_fill(&run->plan->store, i, 0) == QUERN_OK;
	if (!reserved) return give_up(run);
	quern_plan_refresh(run->plan);
	return run;
}

void quern_run_destroy(quern_run *run) {
	if (!run) return;
	quern_run_finish_episodes(run);
	if (run->has_grid) quern_grid_finish(&run->grid);
	quern_pool_destroy(run->pool);
	quern_start_let_go(run);
	quern_scene_destroy(run->scene);
	quern_log_destroy(run->log);
	quern_run_reset(run);
	free(run->arena.data);
	free(run->arena.extra);
	free(run->folder);
	free(run->message);
	free(run->identity);
	free(run->plugins);
	free(run->replaced);
	free(run->taken);
	free(run);
}

/* ---- time ---- */

/* How far from a whole number of intervals still counts as one, in intervals: both times may be written as decimals. */
static double slack(double intervals) { return fmin(1e-9 * fmax(intervals, 1), 0.01); }

/* s, when the first frame after `time` is due: at whole multiples of output.every, and at time.end. */
static double due(const quern_run *run, double time) {
	const quern_general *g = &run->scene->general;
	const double last = g->end / g->every, now = time / g->every;
	const double next = floor(now + slack(now)) + 1;
	return next >= ceil(last - slack(last)) ? g->end : next * g->every;
}

/* s, the end of an interval that begins at `time`: a frame, or the end of one of the scene's stages. */
static double ends(const quern_run *run, double time) {
	return fmin(due(run, time), quern_run_episode_end(run, time));
}

/* Where stages of the scene meet there is a frame only if its time has come. */
static bool is_frame_time(const quern_run *run, double time) {
	const double intervals = time / run->scene->general.every;
	return !quern_run_is_seam(run, time) || fabs(intervals - floor(intervals + 0.5)) <= slack(intervals);
}

bool quern_run_over(const quern_run *run) {
	const quern_clock *c = &run->clock;
	const quern_general *g = &run->scene->general;
	const double now = c->end / g->every, last = g->end / g->every;
	return c->frame >= 0 && !c->steps_in && now >= last - slack(last);
}

double quern_run_time(const quern_run *run) {
	const quern_clock *c = &run->clock;
	return c->at == c->steps_in ? c->end : c->begin + (double)c->at * c->dt;
}

void quern_run_cut(quern_run *run) {
	quern_clock *c = &run->clock;
	c->begin = c->end = quern_run_time(run);
	c->at = c->steps_in = 0;
}

bool quern_run_rejoin(quern_run *run) {
	quern_clock *c = &run->clock;
	const quern_general *g = &run->scene->general;
	const double now = quern_run_time(run), intervals = now / g->every;
	if (c->frame >= 0 && g->end / g->every < intervals - slack(intervals)) return false;
	const bool same = ends(run, c->begin) == c->end || ends(run, now) == c->end;
	quern_run_find_episode(run);
	if (c->steps_in && !same) quern_run_cut(run);
	return true;
}

void quern_run_frame(quern_run *run) {
	quern_run_cut(run);
	run->clock.frame++;
}

static size_t section_index(const quern_run *run, const quern_section *section) {
	return section ? (size_t)(section - run->plan->scene->sections) : 0;
}

quern_step quern_run_record(quern_run *run, const quern_section *section) {
	const quern_general *g = &run->plan->scene->general;
	const size_t i = section_index(run, section);
	quern_step step = { .step = run->clock.step,
		.substep = run->clock.settled ? run->clock.substep : run->clock.settle_step,
		.dim = (uint32_t)g->dimension,
		.n_substeps = quern_wish_substeps(run->plan->scene),
		.settling = !run->clock.settled,
		.batch = (uint32_t)g->batch,
		.time = quern_run_time(run),
		.dt = run->clock.settled ? run->clock.dt : run->clock.settle_dt,
		.slot = section ? (const quern_bound *const *)run->plan->slots[i] : NULL,
		.n_slot = section ? run->plan->n_slot[i] : NULL,
		.host = &quern_host_table,
		.run = run,
		.stage_step = run->entered,
		.within = run->within };
	memcpy(step.gravity, g->gravity, sizeof step.gravity);
	memcpy(step.lower, g->lower, sizeof step.lower);
	memcpy(step.upper, g->upper, sizeof step.upper);
	memcpy(step.periodic, g->periodic, sizeof step.periodic);
	memcpy(step.open, g->open, sizeof step.open);
	for (size_t k = 0; k < run->plan->n_stages && section; k++)
		if (run->plan->stages[k].section == section) {
			step.use = run->plan->stages[k].column;
			break;
		}
	return step;
}

bool quern_section_takes_substeps(const quern_section *section) {
	for (const quern_stage *s = section->ops->stages; s->name; s++)
		if (s->phase == QUERN_SUBSTEP) return true;
	return false;
}

static bool settles(const quern_section *section) {
	for (const quern_stage *s = section->ops->stages; s->name; s++)
		if (s->flags & QUERN_SETTLES) return true;
	return false;
}

static double limit_of(const quern_section *s, const quern_step *step, double *hard, char why[160]) {
	quern_watch_enter(s->solver->file->plugin.id, "limit");
	const double limit = s->ops->limit(s->solver->self, step, hard, why);
	quern_watch_leave();
	if (!step->run->stage) quern_run_reset(step->run);
	return limit;
}

double quern_run_limit(quern_run *run, double *hard, char reason[200], char hard_reason[200]) {
	double least = INFINITY, least_hard = INFINITY;
	const uint32_t n = quern_wish_substeps(run->plan->scene);
	snprintf(reason, 200, "nothing");
	snprintf(hard_reason, 200, "nothing");
	for (size_t i = 0; i < run->plan->scene->n_sections; i++) {
		const quern_section *s = &run->plan->scene->sections[i];
		if (!s->ops->limit) continue;
		quern_step step = quern_run_record(run, s);
		step.settling = false; /* the steps after the release are meant, whenever this is asked */
		const uint32_t times = quern_section_takes_substeps(s) ? n : 1;
		char why[160] = "";
		double beyond = INFINITY;
		const double limit = times * limit_of(s, &step, &beyond, why);
		char factor[32] = "";
		if (times > 1) snprintf(factor, sizeof factor, "%u times ", times);
		if (limit < least) least = limit, snprintf(reason, 200, "%s%s", factor, why);
		if (times * beyond < least_hard)
			least_hard = times * beyond, snprintf(hard_reason, 200, "%s%s", factor, why);
	}
	*hard = least_hard;
	return least;
}

quern_own_steps quern_run_own_steps(quern_run *run) {
	quern_own_steps own = { .substep = INFINITY, .step = INFINITY };
	for (size_t i = 0; i < run->plan->scene->n_sections; i++) {
		const quern_section *s = &run->plan->scene->sections[i];
		if (!s->ops->limit) continue;
		quern_step step = quern_run_record(run, s);
		step.settling = false;
		const bool substeps = quern_section_takes_substeps(s);
		double *least = substeps ? &own.substep : &own.step, beyond = INFINITY;
		char why[160] = "";
		const double limit = limit_of(s, &step, &beyond, why);
		if (!(limit < *least)) continue;
		*least = limit;
		memcpy(substeps ? own.substep_reason : own.step_reason, why, sizeof why);
	}
	return own;
}

uint32_t quern_run_most_substeps(const quern_own_steps *own) {
	if (!isfinite(own->substep) || !isfinite(own->step) || !(own->substep > 0)) return 0;
	return (uint32_t)fmin(fmax(floor(own->step / own->substep * (1 + 1e-9)), 1), 1e9);
}

quern_status quern_run_check_step(quern_run *run, double hard, const char *hard_reason, double recommended) {
	const quern_general *g = &run->plan->scene->general;
	if (g->force || !(g->step > hard)) return QUERN_OK;
	return quern_run_refuse(run, "time.step",
		"%.4g s is beyond the limit of %.4g s set by %s; recommended %.4g s (time.force: true takes it all "
		"the same)",
		g->step, hard, hard_reason, recommended);
}

/* Begins the interval up to the next frame that is due, or to the end of the scene's stage if that comes first, with
 * the values that hold from here on; and chooses its steps from the state as it is. */
static quern_status begin_interval(quern_run *run) {
	quern_clock *c = &run->clock;
	const quern_general *g = &run->scene->general;
	const double end = ends(run, c->end), length = end - c->end;
	double hard;
	char hard_reason[200];
	if (run->scene->n_episodes) quern_run_enter_episode(run, c->end);
	double limit = quern_run_limit(run, &hard, run->limit_reason, hard_reason);
	if (quern_run_check_step(run, hard, hard_reason, limit) != QUERN_OK) return QUERN_E_PARAM;
	if (g->step > 0) {
		if (g->step > hard && run->log && c->step == 0)
			quern_log_add(run->log, 2,
				"time.step of %.4g s is beyond the limit of %.4g s set by %s; recommended %.4g s", g->step,
				hard, hard_reason, limit);
		limit = g->step;
		snprintf(run->limit_reason, sizeof run->limit_reason, "the scene's time.step");
	}
	if (!(limit > 0))
		return quern_run_stop(run, QUERN_E_NUMERIC, "no step is small enough: %s", run->limit_reason);
	const double steps = isfinite(limit) ? ceil(length / limit - 1e-9) : 1;
	if (!(steps < 1e15))
		return quern_run_stop(
			run, QUERN_E_NUMERIC, "a step of %.3g s is too small for an interval of %.3g s", limit, length);
	c->steps_in = steps < 1 ? 1 : (int64_t)steps;
	c->dt = length / (double)c->steps_in;
	c->at = 0;
	c->begin = c->end;
	c->end = end;
	if (c->step == 0 && run->log)
		quern_log_add(run->log, 1, "step %.4g s, set by %s", c->dt, run->limit_reason);
	return QUERN_OK;
}

/* ---- what a stage is the first to add to ---- */

/* Entries at a time, and bytes below which one thread is done before another has come. */
enum { ZERO_CHUNK = 1024, ZERO_ALONE = 1 << 17 };

/* Components one after the other, or lanes of rows. */
typedef struct {
	void *const *data;
	size_t bytes, n, n_components;
	double *row;
	uint32_t lane[8], n_lanes;
} zeroed;

static void zero_chunk(void *arg, uint32_t chunk, uint32_t worker) {
	const zeroed *z = arg;
	const size_t begin = (size_t)chunk * ZERO_CHUNK, left = z->n - begin,
				 count = left < ZERO_CHUNK ? left : ZERO_CHUNK;
	(void)worker;
	for (size_t c = 0; c < z->n_components; c++)
		memset((char *)z->data[c] + begin * z->bytes, 0, count * z->bytes);
	for (size_t i = begin; i < begin + count && z->n_lanes; i++)
		for (uint32_t k = 0; k < z->n_lanes; k++) z->row[8 * i + z->lane[k]] = 0;
}

static void zero_all(quern_run *run, zeroed *z) {
	const uint32_t chunks = (uint32_t)((z->n + ZERO_CHUNK - 1) / ZERO_CHUNK);
	const size_t bytes = z->n * (z->n_lanes ? 64 : z->bytes * z->n_components);
	if (bytes >= ZERO_ALONE) quern_pool_each(run->pool, chunks, zero_chunk, z);
	else
		for (uint32_t c = 0; c < chunks; c++) zero_chunk(z, c, 0);
}

/* In rows, lanes of other fields stay as they are; where there are none, a row is cleared at once. */
static void zero_lanes(quern_run *run, const quern_set_store *set, uint32_t lanes) {
	void *const whole[] = { set->row };
	zeroed z = { .n = set->n, .row = set->row };
	if (lanes == (1u << set->lanes) - 1) z.data = whole, z.bytes = 64, z.n_components = 1;
	else
		for (uint32_t k = 0; k < set->lanes; k++)
			if (lanes >> k & 1) z.lane[z.n_lanes++] = k;
	zero_all(run, &z);
}

static void zero_column(quern_run *run, const quern_set_store *set, const quern_field *field) {
	zeroed z = { .data = field->data[field->now],
		.bytes = quern_field_bytes(field),
		.n = set->n,
		.n_components = field->n_components };
	zero_all(run, &z);
}

static void zero(quern_run *run, const int *fields) {
	quern_store *store = &run->plan->store;
	for (size_t s = 0; *fields >= 0 && s < store->n_sets; s++) {
		uint32_t lanes = 0;
		for (const int *k = fields; *k >= 0; k++) {
			quern_field *field = &store->fields[*k];
			if (field->set != (int)s) continue;
			if (store->sets[s].rows) lanes |= ((1u << field->n_components) - 1) << field->lane;
			else zero_column(run, &store->sets[s], field);
		}
		if (lanes) zero_lanes(run, &store->sets[s], lanes);
	}
}

/* ---- stages ---- */

static quern_status run_stage(quern_run *run, quern_plan_stage *stage, double dt) {
	if (!stage->stage) return QUERN_OK;
	const double begin = quern_wall();
	zero(run, run->clock.settled ? stage->zeros : stage->zeros_settling);
	quern_plan_refresh(run->plan);
	quern_step step = quern_run_record(run, stage->section);
	step.dt = dt;
	step.use = stage->column;
	run->stage = stage;
	quern_watch_enter(stage->section->solver->file->plugin.id, stage->name);
	quern_status status = stage->stage->run(stage->section->solver->self, &step);
	quern_watch_leave();
	quern_run_reset(run);
	/* a body that has no memory can only leave its work undone, of which what others say may be a consequence */
	if (quern_pool_lacked(run->pool)) {
		run->status = QUERN_OK;
		status = QUERN_E_MEMORY;
	}
	if (status == QUERN_OK) status = run->status;
	else quern_run_stop(run, status, status == QUERN_E_MEMORY ? "out of memory" : "failed");
	quern_plan_swap(run->plan, stage->swaps);
	run->stage = NULL;
	stage->seconds += quern_wall() - begin;
	return status;
}

static quern_status run_phase(quern_run *run, quern_phase phase, double dt) {
	for (size_t o = 0; o < run->plan->n_stages; o++) {
		quern_plan_stage *stage = &run->plan->stages[run->plan->order[o]];
		const bool rests = phase == QUERN_SUBSTEP && !run->clock.settled && !stage->settles;
		if (stage->phase != phase || rests) continue;
		const quern_status status = run_stage(run, stage, dt);
		if (status != QUERN_OK) return status;
	}
	return QUERN_OK;
}

quern_status quern_run_setup(quern_run *run) {
	quern_status status = quern_start_read(run);
	if (status == QUERN_OK) status = run_phase(run, QUERN_SETUP, 0);
	if (status == QUERN_OK) status = quern_start_read_rest(run);
	free(run->taken);
	run->taken = NULL;
	quern_platform_trim();
	if (status == QUERN_OK) run->mass_initial = quern_run_carries(run, "mass");
	return status;
}

/* The least limit of those who settle. */
static double settle_dt(quern_run *run) {
	double least = INFINITY;
	for (size_t i = 0; i < run->plan->scene->n_sections; i++) {
		const quern_section *s = &run->plan->scene->sections[i];
		if (!settles(s) || !s->ops->limit) continue;
		const quern_step step = quern_run_record(run, s);
		double hard;
		char why[160];
		least = fmin(least, limit_of(s, &step, &hard, why));
	}
	return isfinite(least) ? least : 0;
}

double quern_run_settling(quern_run *run, double *dt) {
	double most = 0;
	*dt = settle_dt(run);
	for (size_t i = 0; i < run->plan->scene->n_sections; i++) {
		const quern_section *s = &run->plan->scene->sections[i];
		if (!s->ops->settling) continue;
		quern_step step = quern_run_record(run, s);
		step.dt = *dt;
		quern_watch_enter(s->solver->file->plugin.id, "settling");
		most = fmax(most, s->ops->settling(s->solver->self, &step));
		quern_watch_leave();
	}
	return most;
}

/* One step of settling, or none if all is at rest. */
static void settle(quern_run *run) {
	quern_clock *c = &run->clock;
	bool rest = true;
	if (c->settle_step == 0) c->settle_dt = settle_dt(run);
	for (size_t i = 0; i < run->plan->scene->n_sections; i++) {
		const quern_section *s = &run->plan->scene->sections[i];
		if (!s->ops->settled) continue;
		const quern_step step = quern_run_record(run, s);
		quern_watch_enter(s->solver->file->plugin.id, "settled");
		rest = s->ops->settled(s->solver->self, &step) && rest;
		quern_watch_leave();
		quern_run_reset(run);
	}
	if (rest || run->status != QUERN_OK) {
		c->settled = 1;
		return;
	}
	run_phase(run, QUERN_SUBSTEP, c->settle_dt);
	c->settle_step++;
}

static bool owns(const quern_section *section, const quern_set *set) {
	for (const quern_set *s = section->ops->sets; s->name; s++)
		if (s == set) return true;
	return false;
}

/* Steps of the entries that are counted: of those in substeps after these, of all others at the end. */
static void count_steps(quern_run *run, bool substeps, uint32_t times) {
	const quern_scene *scene = run->plan->scene;
	for (size_t k = 0; k < run->plan->store.n_sets; k++) {
		quern_set_store *set = &run->plan->store.sets[k];
		for (size_t i = 0; i < scene->n_sections && set->table && set->table->counted; i++)
			if (owns(&scene->sections[i], set->table) &&
				quern_section_takes_substeps(&scene->sections[i]) == substeps)
				set->stepped += (int64_t)set->n * times;
	}
}

static quern_status do_step(quern_run *run) {
	quern_clock *c = &run->clock;
	const uint32_t substeps = quern_wish_substeps(run->plan->scene);
	quern_status status = run_phase(run, QUERN_BEGIN, c->dt);
	for (uint32_t k = 0; k < substeps && status == QUERN_OK; k++) {
		run->within = k;
		status = run_phase(run, QUERN_SUBSTEP, c->dt / substeps);
		c->substep++;
	}
	run->within = 0;
	count_steps(run, true, substeps);
	for (int phase = QUERN_DEPOSIT; phase <= QUERN_END && status == QUERN_OK; phase++)
		status = run_phase(run, (quern_phase)phase, c->dt);
	count_steps(run, false, 1);
	c->step++;
	c->at++;
	run->entered = -1;
	return status;
}

bool quern_run_awaits_frame(const quern_run *run) {
	const quern_clock *c = &run->clock;
	const bool ended = c->steps_in && c->at == c->steps_in && is_frame_time(run, c->end);
	return run->status == QUERN_OK && c->settled && (c->frame < 0 || ended);
}

quern_event quern_run_next(quern_run *run) {
	if (run->status == QUERN_OK && !run->clock.settled) {
		settle(run);
		return run->status == QUERN_OK ? QUERN_SETTLING : QUERN_STOPPED;
	}
	if (quern_run_awaits_frame(run)) return QUERN_FRAME_IS_DUE;
	if (run->status == QUERN_OK && quern_run_over(run)) return QUERN_OVER;
	if (run->status == QUERN_OK && !run->clock.steps_in) begin_interval(run);
	if (run->status == QUERN_OK) do_step(run);
	if (run->clock.at == run->clock.steps_in && !is_frame_time(run, run->clock.end)) quern_run_cut(run);
	return run->status == QUERN_OK ? QUERN_STEPPED : QUERN_STOPPED;
}

quern_status quern_run_look(quern_run *run) { return run_phase(run, QUERN_OUTPUT, run->clock.dt); }
