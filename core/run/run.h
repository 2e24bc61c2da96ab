/* SPDX-License-Identifier: MIT */
/* run - a scene in motion: its plan, its grid, its counters; and the loop over steps */
#pragma once
#include "grid.h"
#include "log.h"
#include "plan.h"
#include "text.h"

/* Steps are counted in whole numbers: an interval runs from `begin` to `end`, when a frame is due, in `steps_in` equal
 * steps. Both ends are kept, so that a scene whose output changes on resume changes nothing that was. */
typedef struct quern_clock {
	int64_t step, substep, settle_step; /* since the start; substep counts those after the release */
	int64_t frame;                      /* last frame written; -1: none */
	int64_t at, steps_in;               /* steps done and to do in this interval; steps_in 0: between two */
	double begin, end;                  /* s, of this interval; between two, both are now */
	double dt, settle_dt;
	int64_t settled; /* 1: settling is over */
} quern_clock;

/* What plugins have for a stage. */
typedef struct quern_arena {
	char *data;
	size_t used, capacity;
	void **extra; /* what did not fit this time */
	size_t n_extra, extra_capacity, extra_bytes;
} quern_arena;

struct quern_run {
	quern_scene *scene;
	quern_plan *plan; /* the present one; plan->scene has the values that hold now */
	quern_pool *pool;
	quern_grid grid;
	bool has_grid;
	quern_clock clock;
	quern_arena arena;
	quern_log *log;
	char *folder; /* NULL: nothing is written */
	struct quern_sidecars *sidecars;
	/* of the scene's `stages`: the present one, -1 before the first; this step if it begins with it, else -1; a plan
	 * for each, NULL where that is the first one, which is the scene's own */
	int64_t episode, entered;
	uint32_t within; /* the substep that runs, of a step */
	quern_plan **plans, *first_plan;
	size_t n_plans;
	const quern_plan_stage *stage; /* the one that runs, for messages; NULL between stages */
	quern_status status;
	char *message;                      /* why the run stopped */
	quern_mark fault;                   /* where in the scene the reason stands; no file: nowhere */
	double wall_before, settle_wall;    /* s on the clock spent before a resume; in settling */
	double processor, settle_processor; /* s of all threads up to the last checkpoint; up to the release */
	double mass_initial;
	int64_t rss_before;     /* bytes that were resident at most before the first set was allocated */
	char limit_reason[200]; /* what sets the step */
	char *identity;         /* see identity.h */
	uint64_t scene_hash, *plugins;
	struct quern_held *held; /* by section: the file that it starts from, see start.h; NULL: none is held */
	bool *
		taken; /* by field: it holds what another run's state had of it; NULL: none does, or the set-up is over */
	bool mute;      /* what is tried is not told */
	char *replaced; /* plugins that took the place of others on the way, a line each; NULL: none */
};

/* Everything short of running: allocates, but no stage has run. Faults go to the scene's report; NULL if memory is
 * gone. Takes the scene over unless it fails. `workers`: quern_pool_create. */
quern_run *quern_run_create(quern_scene *, uint32_t workers);
void quern_run_destroy(quern_run *);

/* Runs the stages of the set-up phase, and notes the mass that there is. */
quern_status quern_run_setup(quern_run *);

/* What a run has done last, or waits for. */
typedef enum quern_event {
	QUERN_STOPPED,      /* run->message says why */
	QUERN_SETTLING,     /* one step of what settles alone */
	QUERN_FRAME_IS_DUE, /* at the release and at the end of an interval; nothing is done before quern_run_frame */
	QUERN_STEPPED,
	QUERN_OVER
} quern_event;

/* The one way to drive a run: does the next thing. A step that begins an interval chooses its length first. */
quern_event quern_run_next(quern_run *);
/* True if that would be a frame. */
bool quern_run_awaits_frame(const quern_run *);
/* About how many steps settling takes from here, by what its solvers say, and their length; 0: none. */
double quern_run_settling(quern_run *, double *dt);
/* Refuses the scene's own step if it is beyond the hard limit of the state as it is. */
quern_status quern_run_check_step(quern_run *, double hard, const char *hard_reason, double recommended);
/* Runs the stages that make what is only wanted when somebody looks: before observers and frames. */
quern_status quern_run_look(quern_run *);
/* Ends the interval, or the time before the first one, with a frame. */
void quern_run_frame(quern_run *);
/* Once a checkpoint's clock is there: leads the running interval to where the scene now wants a frame. False, and nothing
 * is changed, if time.end is over already. */
bool quern_run_rejoin(quern_run *);
/* Breaks the interval off, so that the next one begins at the present time. */
void quern_run_cut(quern_run *);

/* Before a file is built in memory: what stages work in goes back to the system until the next one writes there, so that a file takes its
 * place and not room beside it. */
void quern_run_rest(quern_run *);
/* Ends what plugins had for a stage, or for a call between stages. */
void quern_run_reset(quern_run *);

double quern_run_time(const quern_run *); /* s since the release */
/* True once the frame of time.end is written; a time that is later only by round-off counts as that. */
bool quern_run_over(const quern_run *);
/* The step record for code that is called between stages. */
quern_step quern_run_record(quern_run *, const quern_section *);
/* What all solvers carry, summed up by the names that they give. */
typedef struct quern_account {
	struct {
		const char *name, *unit;
		double value;
	} sum[QUERN_MOST_SUMS];
	size_t n;
} quern_account;
quern_account quern_run_account(quern_run *);
/* A fault of the scene if its solvers give more sums than there is room for. */
void quern_account_check(const quern_scene *);
double quern_account_of(const quern_account *, const char *name); /* 0 if nobody gives it */
double quern_run_carries(quern_run *, const char *name);
/* What is carried, owed and has left, over what there was and was poured, less 1; 0 where there never was any mass. */
double quern_run_mass_defect(const quern_run *, const quern_account *);
/* Whether all solvers can go on from the state as it is; else `why` says which cannot, and the run stays what it was. */
bool quern_run_accept(quern_run *, quern_text *why);
/* QUERN_E_NUMERIC with run->message if a sum over all that is carried is not finite. */
quern_status quern_run_check_account(quern_run *);
/* The smallest recommended long step, the smallest hard limit and what sets the first. */
double quern_run_limit(quern_run *, double *hard, char reason[200], char hard_reason[200]);
/* What those who take substeps and those who take none recommend for their own steps, each alone. */
typedef struct quern_own_steps {
	double substep, step; /* s; INFINITY: there is nobody, or nothing limits it */
	char substep_reason[160], step_reason[160];
} quern_own_steps;
quern_own_steps quern_run_own_steps(quern_run *);
/* The most of the one that fit into one of the other, at least 1; 0: there are not both. */
uint32_t quern_run_most_substeps(const quern_own_steps *);
bool quern_section_takes_substeps(const quern_section *);
/* Ends the run: keeps the first message. */
quern_status quern_run_stop(quern_run *, quern_status, const char *fmt, ...)
	__attribute__((format(printf, 3, 4)));

/* Ends the run for a fault of the scene that only its state shows: QUERN_E_PARAM. `param`: of the section whose stage
 * runs, or from the scene's root between stages; NULL: of the section itself. */
quern_status quern_run_refuse(quern_run *, const char *param, const char *fmt, ...)
	__attribute__((format(printf, 3, 4)));
/* Says why the run stopped, with the place in the scene if it has one. */
void quern_run_complain(const quern_run *, FILE *);

extern const quern_host quern_host_table;
